//! `stepvalve completions | man | help`: what a shell, `man` and readers want to know of the commands.

mod groups;
mod mistyped;

use crate::files::name;
use crate::say::say;
use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;
use std::io::{Write, stdout};
use std::path::PathBuf;
use supervisor::{Failure, Outcome};

pub use groups::grouped;
pub use mistyped::led_on;

/// For which shell.
#[derive(Debug, clap::Args)]
pub struct Completions {
    /// The shell; for bash: `stepvalve completions bash > /etc/bash_completion.d/stepvalve`
    #[arg(value_enum)]
    shell: Shell,
}

/// Where to.
#[derive(Debug, clap::Args)]
pub struct Man {
    /// Folder for the pages, one a command
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Prints the shell's completions.
///
/// # Errors
/// None: a closed pipe means that nobody listens any more.
pub fn completions(arguments: &Completions) -> Result<Outcome, Failure> {
    let mut command = crate::Arguments::command();
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "stepvalve", &mut text);
    let _ = stdout().write_all(&text);
    Ok(Outcome::Done)
}

/// Writes the manual's pages.
///
/// # Errors
/// [`Failure::Input`] where the folder can't be written.
pub fn man(arguments: &Man) -> Result<Outcome, Failure> {
    let folder = &arguments.out;
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(crate::Arguments::command(), folder))
        .with_context(|| name(folder))
        .map_err(Failure::Input)?;
    say(format_args!("man -l {}/stepvalve.1", name(folder)));
    Ok(Outcome::Done)
}
