//! `stepvalve export`: a model as a file that other simulators take.

use crate::files::{self, name};
use crate::say::say;
use anyhow::{Context, anyhow};
use fmu::{LIBRARY, MODEL_FILE, Version};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};
use whole_file::Partial;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// What to export.
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// A model as a functional mock-up unit (FMI, co-simulation), for Simulink, Modelica tools, Python
    Fmu(Unit),
}

/// Where from and where to.
#[derive(Debug, clap::Args)]
pub struct Unit {
    /// The model of a whole valve: one with a motor and a load
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// The unit to write
    #[arg(long, value_name = "VALVE.fmu")]
    out: PathBuf,
    /// The standard's version: 2 is what most tools read
    #[arg(long, value_name = "2|3", default_value = "2", value_parser = version)]
    fmi: Version,
    /// A shared library to put in [default: those that lie beside this program, or in ../lib/stepvalve]; .dll for Windows
    #[arg(long, value_name = "FILE")]
    library: Vec<PathBuf>,
    /// Replace the file that is there
    #[arg(long)]
    force: bool,
}

fn version(text: &str) -> Result<Version, String> {
    match text {
        "2" | "2.0" => Ok(Version::Two),
        "3" | "3.0" => Ok(Version::Three),
        other => Err(format!("found `{other}`, expected 2 or 3")),
    }
}

/// Exports.
///
/// # Errors
/// [`Failure::Input`] where the model is none of a whole valve, a library is missing, or the file is there;
/// [`Failure::Failed`] where writing fails.
pub fn run(command: &Command) -> Result<Outcome, Failure> {
    let Command::Fmu(arguments) = command;
    let text = files::read(&arguments.model)?;
    // Its own message says file, line and column; the unit's would name the file within.
    config::parse_model(&text, &name(&arguments.model)).map_err(Failure::input)?;
    let in_model = |error: fmu::UnitError| Failure::Input(anyhow!("{}: {error}", name(&arguments.model)));
    let description = fmu::description(&text, arguments.fmi).map_err(in_model)?;
    let documentation = fmu::documentation(&text).map_err(in_model)?;
    let libraries = libraries(&arguments.library, arguments.fmi)?;
    let partial =
        Partial::beside(&arguments.out).with_context(|| name(&arguments.out)).map_err(Failure::Input)?;
    let mut entries: Vec<(String, &[u8])> = vec![
        ("modelDescription.xml".to_owned(), description.as_bytes()),
        (format!("resources/{MODEL_FILE}"), text.as_bytes()),
        ("documentation/index.html".to_owned(), documentation.as_bytes()),
    ];
    entries.extend(libraries.iter().map(|(place, bytes)| (place.clone(), bytes.as_slice())));
    pack(partial.path(), &entries).with_context(|| name(&arguments.out))?;
    let done = if arguments.force { partial.replace() } else { partial.appear() };
    match done {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            let there = anyhow!("{} is there already: --force replaces it", name(&arguments.out));
            return Err(Failure::Input(there));
        }
        Err(error) => return Err(Failure::Failed(anyhow::Error::new(error).context(name(&arguments.out)))),
    }
    let places: Vec<&str> = libraries.iter().filter_map(|(place, _)| place.split('/').nth(1)).collect();
    say(format_args!("{}: FMI {}, for {}", name(&arguments.out), said(arguments.fmi), places.join(" and ")));
    Ok(Outcome::Done)
}

fn said(version: Version) -> &'static str {
    match version {
        Version::Two => "2.0",
        Version::Three => "3.0",
    }
}

/// Writes a zip archive.
fn pack(path: &Path, entries: &[(String, &[u8])]) -> io::Result<()> {
    let mut archive = ZipWriter::new(File::create(path)?);
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (place, bytes) in entries {
        archive.start_file(place.as_str(), options)?;
        archive.write_all(bytes)?;
    }
    archive.finish()?;
    Ok(())
}

/// The shared libraries, each with its place in the unit.
fn libraries(given: &[PathBuf], version: Version) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let found = if given.is_empty() { beside_this_program()? } else { given.to_vec() };
    let read = |file: &PathBuf| {
        let bytes =
            std::fs::read(file).with_context(|| file.display().to_string()).map_err(Failure::Input)?;
        let platform = platform(&bytes).ok_or_else(|| {
            Failure::Input(anyhow!(
                "{}: found no shared library, expected one for x86_64 or aarch64 Linux, or x86_64 Windows",
                file.display()
            ))
        })?;
        Ok((place(platform, version), bytes))
    };
    found.iter().map(read).collect()
}

fn beside_this_program() -> Result<Vec<PathBuf>, Failure> {
    let program = std::env::current_exe().context("this program's own file")?;
    let folder = program.parent().unwrap_or(Path::new("."));
    let names = [format!("lib{LIBRARY}.so"), format!("{LIBRARY}.dll")];
    for folder in [folder.to_owned(), folder.join("../lib/stepvalve")] {
        let there: Vec<PathBuf> =
            names.iter().map(|name| folder.join(name)).filter(|file| file.is_file()).collect();
        if !there.is_empty() {
            return Ok(there);
        }
    }
    Err(Failure::Input(anyhow!(
        "found neither lib{LIBRARY}.so nor {LIBRARY}.dll beside {}, expected one: `cargo build --release --package fmu-binary` makes it, \
         and --library says where another is",
        program.file_name().unwrap_or(OsStr::new("stepvalve")).display()
    )))
}

/// A machine that a shared library is for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Platform {
    LinuxX86,
    LinuxArm,
    WindowsX86,
}

/// Told from the first bytes: ELF with its machine, or a DOS stub.
fn platform(bytes: &[u8]) -> Option<Platform> {
    match bytes {
        [0x7f, b'E', b'L', b'F', 2, ..] => match bytes.get(18..20)? {
            [0x3e, 0] => Some(Platform::LinuxX86),
            [0xb7, 0] => Some(Platform::LinuxArm),
            _ => None,
        },
        [b'M', b'Z', ..] => Some(Platform::WindowsX86),
        _ => None,
    }
}

fn place(platform: Platform, version: Version) -> String {
    let (folder, end) = match (platform, version) {
        (Platform::LinuxX86, Version::Two) => ("linux64", "so"),
        (Platform::LinuxX86, Version::Three) => ("x86_64-linux", "so"),
        // FMI 2.0 knows no such machine; importers on it look here.
        (Platform::LinuxArm, _) => ("aarch64-linux", "so"),
        (Platform::WindowsX86, Version::Two) => ("win64", "dll"),
        (Platform::WindowsX86, Version::Three) => ("x86_64-windows", "dll"),
    };
    format!("binaries/{folder}/{LIBRARY}.{end}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_tell_their_machine() {
        let elf = |machine: u8| {
            let mut bytes = vec![0u8; 64];
            bytes.splice(0..5, [0x7f, b'E', b'L', b'F', 2]);
            bytes.splice(18..19, [machine]);
            bytes
        };
        assert_eq!(platform(&elf(0x3e)), Some(Platform::LinuxX86));
        assert_eq!(platform(&elf(0xb7)), Some(Platform::LinuxArm));
        assert_eq!(platform(&elf(0x28)), None);
        assert_eq!(platform(b"MZ\x90"), Some(Platform::WindowsX86));
        assert_eq!(platform(b""), None);
    }
}
