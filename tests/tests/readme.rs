//! The README's commands, one after the other as they stand there, in an empty folder with what the repository ships.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;
use stepvalve_tests::{Finished, TestPlace, despite_stalls, program, repository};
use test_needs::python;

/// The commands of all blocks that are shell, continued lines joined, comments taken off.
fn commands(text: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let blocks = text.split("```sh\n").skip(1).map(|block| block.split("```").next().unwrap());
    for block in blocks {
        for line in block.replace("\\\n", " ").lines() {
            let command = line.split(" #").next().unwrap().trim();
            if !command.is_empty() {
                commands.push(command.to_owned());
            }
        }
    }
    commands
}

/// What to do with a command.
enum How {
    /// Its own check: this very test is part of what it runs, or it needs minutes.
    Elsewhere,
    /// To its end, with one of these exit codes.
    Ends(&'static [i32]),
    /// It stays until the block's other commands were typed "in another terminal".
    Stays,
    /// It goes on until it is interrupted, and has said this by then.
    Follows(&'static str),
    /// It fills the terminal until `q`.
    Terminal,
}

fn how(command: &str) -> How {
    let is = |beginning: &str| command.starts_with(beginning);
    // The Python package is built, and its example run, in tools/check and tests/tests/python_package.rs.
    let of_package = is("pip install") || is("python3 crates/python");
    if is("./tools/") || is("cargo build") || is("export PATH") || of_package {
        How::Elsewhere
    } else if is("stepvalve run ") {
        How::Stays
    } else if is("stepvalve events --follow") {
        How::Follows("ready, disarmed")
    } else if is("stepvalve scope") {
        How::Follows("http://127.0.0.1:")
    } else if is("stepvalve watch") {
        How::Terminal
    } else if is("stepvalve doctor") {
        // What it says of this machine is its own matter.
        How::Ends(&[0, 1])
    } else {
        How::Ends(&[0])
    }
}

struct Shell<'a> {
    place: &'a TestPlace,
    python: &'a Path,
}

impl Shell<'_> {
    fn command(&self, line: &str) -> Command {
        let mut command = self.place.within(Command::new("bash"));
        let folder = program("stepvalve").parent().unwrap().display().to_string();
        let path = format!("{folder}:{}", std::env::var("PATH").unwrap());
        let line = line.replace("python3 ", &format!("{} ", self.python.display()));
        command.args(["-c", &line]).env("PATH", path).current_dir(self.place.path("home"));
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn ends(&self, line: &str, codes: &[i32]) {
        let finished = Finished::from(self.command(line).output().unwrap());
        let code = finished.code.unwrap_or(-1);
        assert!(codes.contains(&code), "{line}: {code}\n{}{}", finished.stdout, finished.stderr);
    }

    /// A running instance, waited for until it answers.
    fn stays(&self, line: &str) -> Child {
        // bash becomes the last command of a line: signals reach it.
        let child = self.command(&format!("exec {line}")).spawn().unwrap();
        self.place.wait_for(line, || {
            self.place.status()?["processes"]["step-controller"]["cycle"].as_u64().filter(|cycle| *cycle > 0)
        });
        child
    }

    fn follows(&self, line: &str, says: &str) {
        let child = self.command(&format!("exec {line}")).spawn().unwrap();
        sleep(Duration::from_millis(500));
        kill(Pid::from_raw(child.id().cast_signed()), Signal::SIGINT).unwrap();
        let finished = Finished::from(child.wait_with_output().unwrap());
        assert_eq!(finished.code, Some(130), "{line}: {}", finished.stderr);
        assert!(finished.stdout.contains(says), "{line}: {}", finished.stdout);
    }

    fn terminal(&self, line: &str) {
        let mut child = self
            .command(&format!("exec script -qec 'stty rows 30 cols 100; {line}' /dev/null"))
            .stdin(Stdio::piped())
            .spawn()
            .unwrap();
        sleep(Duration::from_secs(1));
        child.stdin.as_mut().unwrap().write_all(b"q").unwrap();
        let finished = Finished::from(child.wait_with_output().unwrap());
        assert_eq!(finished.code, Some(0), "{line}: {}", finished.stderr);
    }
}

fn end(child: Child) {
    kill(Pid::from_raw(child.id().cast_signed()), Signal::SIGTERM).unwrap();
    let ended = Finished::from(child.wait_with_output().unwrap());
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
}

#[test]
fn every_command_of_the_readme_works_in_its_order() {
    let Some(python) = python(&["h5py", "matplotlib"]) else { return };
    despite_stalls(|place| follow_readme(place, &python));
}

#[test]
fn pip_brings_what_the_plot_needs() {
    const IMPORTED: &str = "
import ast, sys
tree = list(ast.walk(ast.parse(open(sys.argv[1]).read())))
plain = [name.name for node in tree if isinstance(node, ast.Import) for name in node.names]
taken = [node.module for node in tree if isinstance(node, ast.ImportFrom)]
print(*{name.split('.')[0] for name in plain + taken} - sys.stdlib_module_names)";
    let Some(python) = python(&["ast"]) else { return };
    let script = repository().join("tools/plot_run.py");
    let asked = Command::new(python).args(["-c", IMPORTED]).arg(&script).output().unwrap();
    let imported = String::from_utf8(asked.stdout).unwrap();
    assert!(imported.contains("h5py"), "{imported}");
    let all = commands(&std::fs::read_to_string(repository().join("README.md")).unwrap());
    let installed = all.iter().find_map(|line| line.strip_prefix("pip install ")).unwrap();
    // numpy comes with h5py.
    let installed: Vec<&str> = installed.split_whitespace().chain(["numpy"]).collect();
    for module in imported.split_whitespace() {
        assert!(installed.contains(&module), "{module} is not among {installed:?}");
    }
}

fn follow_readme(place: &TestPlace, python: &Path) {
    let home = place.path("home");
    std::fs::create_dir(&home).unwrap();
    for shipped in ["rt-config", "tools"] {
        symlink(repository().join(shipped), home.join(shipped)).unwrap();
    }
    let shell = Shell { place, python };
    let all = commands(&std::fs::read_to_string(repository().join("README.md")).unwrap());
    assert!(all.len() > 25, "{all:#?}");
    let mut running: Option<Child> = None;
    for line in &all {
        println!("$ {line}");
        match how(line) {
            How::Elsewhere => {}
            How::Ends(codes) => shell.ends(line, codes),
            How::Stays => {
                running.take().into_iter().for_each(end);
                running = Some(shell.stays(line));
            }
            How::Follows(says) => shell.follows(line, says),
            How::Terminal => shell.terminal(line),
        }
    }
    running.take().into_iter().for_each(end);
    let found = std::fs::read_to_string(home.join("found/diagnosis.json")).unwrap();
    assert!(found.contains("\"explained\"") && found.contains("pressure-dependent-friction"), "{found}");
    for made in [
        "sine.html",
        "sine.png",
        "compare.html",
        "predicted.h5",
        "runs/bench/events.jsonl",
        "my-scenario.toml",
    ] {
        assert!(home.join(made).exists(), "{made}");
    }
}
