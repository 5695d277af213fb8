//! What is said of a command that does not exist.

use clap::Command;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};

/// The error with a tip that leads on: to `set`, where one of its kinds stands alone, and never to a command that no user gives.
pub fn led_on(mut error: Error, command: &Command) -> Error {
    let typed = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(typed)) if error.kind() == ErrorKind::InvalidSubcommand => typed.clone(),
        _ => return error,
    };
    let tips = match command.find_subcommand("set").and_then(|set| set.find_subcommand(&typed)) {
        Some(kind) => vec![format!("set {}", kind.get_name())],
        None => shown(command, error.get(ContextKind::SuggestedSubcommand)),
    };
    error.remove(ContextKind::SuggestedSubcommand);
    if !tips.is_empty() {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(tips));
    }
    error
}

/// Those of clap's own suggestions that the help shows.
fn shown(command: &Command, suggested: Option<&ContextValue>) -> Vec<String> {
    let all = match suggested {
        Some(ContextValue::String(one)) => vec![one.clone()],
        Some(ContextValue::Strings(several)) => several.clone(),
        _ => Vec::new(),
    };
    all.into_iter().filter(|name| !command.find_subcommand(name).is_some_and(Command::is_hide_set)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// What is said of `stepvalve WORDS`.
    fn said(words: &[&str]) -> String {
        let command = crate::Arguments::command();
        let given = ["stepvalve"].iter().chain(words).copied();
        let error = command.clone().try_get_matches_from(given).expect_err("no such command");
        led_on(error, &command).to_string()
    }

    #[test]
    fn a_forgotten_set_is_named_and_no_hidden_command_is() {
        assert!(said(&["hold"]).contains("'set hold'"), "{}", said(&["hold"]));
        assert!(said(&["angle", "17deg"]).contains("'set angle'"));
        assert!(said(&["simulat"]).contains("'simulate'"));
        assert!(!said(&["conclud"]).contains("'conclude'"), "{}", said(&["conclud"]));
        assert!(!said(&["draw-pag"]).contains("'draw-page'"));
        assert!(said(&["simulate"]).contains("required"), "other mistakes are told as before");
    }
}
