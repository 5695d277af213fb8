//! The commands in the help's list, grouped by what somebody is about to do.

use clap::builder::styling::Style;
use clap::{Command, builder::StyledStr};
use std::fmt::Write;

/// Headings, and the commands under each in the order in which they are needed.
const GROUPS: [(&str, &[&str]); 5] = [
    ("Simulate", &["new", "check", "simulate", "campaign", "report", "compare", "export", "paper"]),
    (
        "Run a valve",
        &[
            "doctor",
            "bus",
            "run",
            "home",
            "arm",
            "set",
            "disarm",
            "reset",
            "status",
            "watch",
            "scope",
            "events",
            "list",
            "mark",
            "save-timing",
            "inject",
        ],
    ),
    ("Records", &["convert", "replay"]),
    ("Measured data", &["import", "inspect", "predict", "diagnose", "investigate", "tune"]),
    ("Shells and editors", &["help", "completions", "man", "schema"]),
];

/// The command with a help that lists its subcommands by groups.
pub fn grouped(command: Command) -> Command {
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{}{}\n{{options}}\n",
        list(&command).ansi(),
        heading("Options")
    );
    command.help_template(StyledStr::from(template))
}

fn heading(text: &str) -> String {
    let style = Style::new().bold().underline();
    format!("{style}{text}:{style:#}")
}

fn list(command: &Command) -> StyledStr {
    let longest = names().map(str::len).max().unwrap_or(0);
    let bold = Style::new().bold();
    let mut text = StyledStr::new();
    for (of, names) in GROUPS {
        let _ = writeln!(text, "{}", heading(of));
        for name in names {
            let about = command.find_subcommand(name).and_then(Command::get_about);
            // clap adds its own `help` later.
            let about = about.map_or("Print help of a command".to_owned(), ToString::to_string);
            let _ = writeln!(text, "  {bold}{name:longest$}{bold:#}  {about}");
        }
        let _ = writeln!(text);
    }
    text
}

fn names() -> impl Iterator<Item = &'static str> {
    GROUPS.iter().flat_map(|(_, names)| names.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::collections::BTreeSet;

    #[test]
    fn every_command_is_in_one_group() {
        let command = crate::Arguments::command();
        let shown = command.get_subcommands().filter(|of| !of.is_hide_set()).map(Command::get_name);
        let shown: BTreeSet<&str> = shown.chain(["help"]).collect();
        assert_eq!(names().collect::<BTreeSet<_>>(), shown);
        assert_eq!(names().count(), shown.len(), "one is listed twice");
    }
}
