//! Faults of start, end and surroundings: processes killed in their first 20 ms, the supervisor killed, a second
//! instance, another user, too little memory, jumps of the wall clock, a disk that stalls or is full.
#![allow(clippy::indexing_slicing, reason = "a key that JSON lacks reads as null")]

use super::ground::Ground;
use super::live::{Session, ground, plain};
use super::live_record::judge;
use super::lockstep::{end_of, leftovers, shared_memory_prefix};
use super::tally::Tally;
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::scenario::repository;
use anyhow::{Context, Result};
use injection::SplitSeed;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use recording::{GapOrigin, read_record};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Somebody who has nothing to say here.
const NOBODY: u32 = 65534;
/// No start takes longer.
const PATIENCE: Duration = Duration::from_secs(30);
/// Trials in ten of each kind; what takes long is tried less.
const KINDS: [&str; 20] = [
    "killed in the first 20 ms",
    "killed in the first 20 ms",
    "killed in the first 20 ms",
    "killed in the first 20 ms",
    "killed in the first 20 ms",
    "killed in the first 20 ms",
    "killed in the first 20 ms",
    "supervisor killed",
    "supervisor killed",
    "supervisor killed",
    "supervisor killed",
    "second instance",
    "second instance",
    "another user",
    "another user",
    "too little memory",
    "too little memory",
    "too little memory",
    "wall clock jumps",
    "disk full",
];

/// Runs many trials, and one in which the disk stalls for ten seconds.
///
/// # Errors
/// Where a trial can't be made.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    let ground = ground()?;
    println!("around an instance: seed {seed}");
    let progress = Progress::new(trials as usize);
    let mut details = SplitSeed::new(seed);
    for number in 0..trials {
        let kind = if number == 0 { "disk stalled 10 s" } else { details.one(&KINDS, "second instance") };
        progress.next(kind);
        let place = Workplace::new()?;
        let mut violations = Vec::new();
        let exact = match kind {
            "killed in the first 20 ms" => killed_early(&place, &ground, &mut details, &mut violations)?,
            "supervisor killed" => supervisor_killed(&place, &ground, &mut details, &mut violations)?,
            "too little memory" => little_memory(&place, &ground, &mut details, &mut violations)?,
            other => on_running(other, &place, &ground, &mut violations)?,
        };
        violations.extend(leftovers(&place, "fault"));
        tally.note(plain(kind, format!("seed {seed}, trial {number}: {exact}"), violations));
    }
    Ok(())
}

fn simulate(place: &Workplace, ground: &Ground) -> Result<Command> {
    let scenario = place.path("scenario.toml");
    std::fs::write(&scenario, ground.text.replace("duration = 5.0", "duration = 0.05"))?;
    let mut command = place.stepvalve()?;
    command.args(["simulate", "--instance", "fault", "--record", "none", "--out"]);
    command.arg(place.path("out")).arg(&scenario).stdout(Stdio::null()).stderr(Stdio::null());
    Ok(command)
}

/// A child of the supervisor, killed soon after it was started: the run ends, as one that failed.
fn killed_early(
    place: &Workplace,
    ground: &Ground,
    details: &mut SplitSeed,
    violations: &mut Vec<String>,
) -> Result<String> {
    let victim =
        details.one(&["plant-simulator", "trajectory-generator", "step-controller", "run-recorder"], "");
    let after = Duration::from_micros(details.whole(0, 20_000));
    let mut run = simulate(place, ground)?.spawn().context("stepvalve simulate")?;
    let begun = Instant::now();
    let mut pid = None;
    while pid.is_none() && begun.elapsed() < PATIENCE && run.try_wait()?.is_none() {
        pid = child_of(run.id(), victim);
    }
    std::thread::sleep(after);
    let killed = pid.is_some_and(|pid| kill(pid, Signal::SIGKILL).is_ok());
    let mut code = None;
    while code.is_none() && begun.elapsed() < PATIENCE {
        code = run.try_wait()?.map(|status| status.code());
        std::thread::sleep(Duration::from_millis(1));
    }
    match code {
        None => {
            violations.push("hangs".to_owned());
            run.kill()?;
            run.wait()?;
        }
        // A recorder that dies once the loop runs is replaced.
        Some(Some(1)) => {}
        Some(Some(0 | 3)) if victim == "run-recorder" || !killed => {}
        Some(code) => violations.push(format!("ended with {code:?}")),
    }
    Ok(format!("{victim} after {after:?}"))
}

/// The process id of a child that runs this program.
fn child_of(supervisor: u32, name: &str) -> Option<Pid> {
    let children = std::fs::read_to_string(format!("/proc/{supervisor}/task/{supervisor}/children")).ok()?;
    let pids = children.split_whitespace().filter_map(|pid| pid.parse::<i32>().ok());
    let mut runs = pids.filter(|pid| {
        let link = std::fs::read_link(format!("/proc/{pid}/exe"));
        link.is_ok_and(|path| path.file_name().is_some_and(|file| file == name))
    });
    runs.next().map(Pid::from_raw)
}

/// The supervisor dies while the valve turns: the plant stops it, everybody ends, the next start cleans up.
fn supervisor_killed(
    place: &Workplace,
    ground: &Ground,
    details: &mut SplitSeed,
    violations: &mut Vec<String>,
) -> Result<String> {
    let mut session = Session::start(place, &ground.text, &[])?;
    session.turn()?;
    let after = Duration::from_micros(details.whole(0, 60_000));
    std::thread::sleep(after);
    let supervisor = session.process();
    let names = ["plant-simulator", "trajectory-generator", "step-controller", "run-recorder"];
    let children: Vec<_> = names.into_iter().filter_map(|name| child_of(supervisor.id(), name)).collect();
    supervisor.kill()?;
    supervisor.wait()?;
    let begun = Instant::now();
    let lives = |pid: &Pid| kill(*pid, None).is_ok();
    while children.iter().any(lives) && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(2));
    }
    if children.iter().any(lives) {
        violations.push("a process lives on without its supervisor".to_owned());
    }
    let mut tally = Tally::default();
    judge(ground, &place.path("record"), vec![done("supervisor killed")], Vec::new(), &mut tally)?;
    if tally.violations() > 0 {
        violations.push(tally.found().to_string());
    }
    // The next start of the name wipes what was left.
    if end_of(simulate(place, ground)?)? != Some(0) {
        violations.push("the next start fails".to_owned());
    }
    Ok(format!("after {after:?}"))
}

fn done(kind: &str) -> super::live_record::Done {
    super::live_record::Done {
        kind: kind.to_owned(),
        text: kind.to_owned(),
        at_ns: 0,
        generation: 1,
        violations: Vec::new(),
    }
}

/// Starts with an address space that is too small, or just not.
fn little_memory(
    place: &Workplace,
    ground: &Ground,
    details: &mut SplitSeed,
    violations: &mut Vec<String>,
) -> Result<String> {
    let megabytes = details.whole(10, 400);
    let run = simulate(place, ground)?;
    let mut limited = Command::new("prlimit");
    limited.arg(format!("--as={}", megabytes << 20)).arg(run.get_program()).args(run.get_args());
    limited.stderr(Stdio::null());
    for (name, value) in run.get_envs() {
        match value {
            Some(value) => limited.env(name, value),
            None => limited.env_remove(name),
        };
    }
    if end_of(limited)?.is_none() {
        violations.push("hangs".to_owned());
    }
    // What a process that ran out of memory left, the next start removes.
    if end_of(simulate_again(place, ground)?)? != Some(0) {
        violations.push("the next start fails".to_owned());
    }
    Ok(format!("{megabytes} MB"))
}

fn simulate_again(place: &Workplace, ground: &Ground) -> Result<Command> {
    let _ = std::fs::remove_dir_all(place.path("out"));
    simulate(place, ground)
}

/// What an instance that turns must not notice.
fn on_running(
    kind: &str,
    place: &Workplace,
    ground: &Ground,
    violations: &mut Vec<String>,
) -> Result<String> {
    let environment: Vec<_> = match kind {
        "wall clock jumps" => vec![("LD_PRELOAD", clock_shim(place)?.display().to_string())],
        _ => Vec::new(),
    };
    let mut session = Session::start(place, &ground.text, &environment)?;
    session.turn()?;
    let wait = match kind {
        "second instance" => {
            let second = end_of(simulate(place, ground)?)?;
            if second != Some(2) {
                violations.push(format!("the second instance ended with {second:?}, expected 2"));
            }
            0
        }
        "another user" => {
            another_user(place, violations)?;
            0
        }
        "disk full" => {
            session.inject("disk-full")?;
            session.loses_record();
            300
        }
        "disk stalled 10 s" => {
            session.inject("disk-stalled ms=10000")?;
            11_000
        }
        _ => 300,
    };
    std::thread::sleep(Duration::from_millis(wait));
    if !session.turn()? {
        violations.push("the valve does not turn any more".to_owned());
    }
    violations.extend(session.end()?);
    account(place, violations)?;
    Ok(kind.to_owned())
}

/// What is missing in the record is declared.
fn account(place: &Workplace, violations: &mut Vec<String>) -> Result<()> {
    let mut segments: Vec<PathBuf> =
        std::fs::read_dir(place.path("record"))?.flatten().map(|entry| entry.path()).collect();
    segments.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    segments.sort();
    let report = read_record(&segments, |_| {})?;
    let undeclared = report.gaps.iter().filter(|gap| gap.origin == GapOrigin::Undeclared).count();
    if undeclared > 0 {
        violations.push(format!("{undeclared} gaps in the record that nobody declared"));
    }
    Ok(())
}

/// Another user gets neither to the socket nor to the shared memory.
fn another_user(place: &Workplace, violations: &mut Vec<String>) -> Result<()> {
    let folder = place.path("runtime/stepvalve/fault");
    let prefix = shared_memory_prefix(&folder);
    let socket = folder.join("control.sock");
    let probe = format!(
        "import socket,os,sys\n\
         s=socket.socket(socket.AF_UNIX)\n\
         try:\n    s.connect({socket:?})\n    print('socket')\n\
         except OSError: pass\n\
         for f in os.listdir('/dev/shm'):\n    \
         if f.startswith({prefix:?}):\n        \
         for mode in (os.O_RDONLY, os.O_RDWR):\n            \
         try:\n                os.open('/dev/shm/'+f, mode)\n                print(f)\n            \
         except OSError: pass\n"
    );
    let output = Command::new("python3").args(["-c", &probe]).uid(NOBODY).gid(NOBODY).output()?;
    if !output.status.success() || !output.stdout.is_empty() {
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        violations.push(format!("another user got to: {text}{}", String::from_utf8_lossy(&output.stderr)));
    }
    Ok(())
}

/// The library that makes the wall clock jump in the processes that load it.
fn clock_shim(place: &Workplace) -> Result<PathBuf> {
    let library = place.path("clock.so");
    let source = repository().join("tools/clock_jumps.c");
    let made =
        Command::new("cc").args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(source).status()?;
    anyhow::ensure!(made.success(), "cc: tools/clock_jumps.c");
    Ok(library)
}
