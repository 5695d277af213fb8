//! Faults on a running instance, in real time: it is armed, turns, and something is done to it at a random moment.
#![allow(clippy::indexing_slicing, reason = "a key that JSON lacks reads as null")]

use super::ground::{Ground, Variant};
use super::live_record::{Done, judge};
use super::lockstep::leftovers;
use super::tally::{Outcome, Tally};
use crate::programs::Workplace;
use crate::progress::Progress;
use anyhow::{Context, Result, bail};
use injection::{Injection, SplitSeed};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use realtime::now_ns;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Silence as a virtual machine needs it: its own stalls seldom last so long.
pub const SILENCE_CYCLES: i64 = 20;
/// An instance that takes longer for anything hangs.
const PATIENCE: Duration = Duration::from_secs(20);

/// An armed valve that has not moved for so long stands.
const STANDS_FOR: Duration = Duration::from_millis(100);
/// A valve moves beyond this rate, Hz; a pulse now and then corrects its angle.
const MOVES_HZ: f64 = 1e3;

/// Whether the valve moves, by an instance's status.
pub fn moves(status: &Value) -> bool {
    status["pulse_rate_hz"].as_f64().is_some_and(|rate| rate.abs() > MOVES_HZ)
}

/// Kinds of faults, the likelier ones more than once.
const KINDS: [&str; 20] = [
    "kill step-controller",
    "kill step-controller",
    "kill trajectory-generator",
    "kill trajectory-generator",
    "kill plant-simulator",
    "kill plant-simulator",
    "kill run-recorder",
    "pause step-controller",
    "pause step-controller",
    "pause trajectory-generator",
    "pause plant-simulator",
    "pause run-recorder",
    "overrun",
    "drop step-command count=30",
    "drop feedback count=30",
    "drop reference count=30",
    "field step-command name=position_unrounded value=nan count=3",
    "flip-bits feedback bits=8 count=2",
    "encoder-jump by_rad=1.5 count=50",
    "hog core=1",
];

/// The valve of the campaign.
///
/// # Errors
/// Where the shipped scenario is not what it was.
pub fn ground() -> Result<Ground> {
    Variant {
        shipped: "rotation-200khz",
        after_stop: "hold",
        loop_delay_cycles: 1,
        encoder: true,
        duration_s: 5.0,
        silence_cycles: SILENCE_CYCLES,
    }
    .ground()
}

/// Draws a fault: its kind for the table, and its text.
fn draw(details: &mut SplitSeed) -> (String, String) {
    let kind = details.one(&KINDS, "kill step-controller");
    if kind.starts_with("pause") {
        let ms = details.one(&[1, 3, 10, 100, 100, 5000], 10);
        // Five seconds are rare: a campaign has an end.
        let ms = if ms == 5000 && details.whole(0, 4) != 0 { 100 } else { ms };
        return (format!("{kind} {ms} ms"), format!("{kind} ms={ms}"));
    }
    if kind == "overrun" {
        let process = details.one(&["step-controller", "trajectory-generator", "plant-simulator"], "");
        let cycles = details.one(&[1, 3, 10], 1);
        return (format!("overrun of {cycles} cycles"), format!("overrun {process} cycles={cycles}"));
    }
    if kind.starts_with("flip") {
        let seed = details.whole(1, 1 << 32);
        return ("8 bits flipped".to_owned(), format!("{kind} seed={seed}"));
    }
    (kind.split(" count").next().unwrap_or(kind).to_owned(), kind.to_owned())
}

/// What a campaign does with its instances.
pub trait Trials {
    /// What one trial leaves for the judgement.
    type Done;
    /// Trials of one instance, at most.
    const PER_INSTANCE: u64;
    /// One trial; `None` where the instance is of no more use.
    ///
    /// # Errors
    /// Where the instance can't be spoken to.
    fn trial(&mut self, session: &mut Session, place: &Workplace) -> Result<Option<Self::Done>>;
    /// Judges the trials of an instance that has ended, with what its end complains of.
    ///
    /// # Errors
    /// Where its record can't be read.
    fn judge(
        &mut self,
        ground: &Ground,
        place: &Workplace,
        done: Vec<Self::Done>,
        ending: Vec<String>,
    ) -> Result<()>;
}

/// Runs many trials, on one instance after the other.
///
/// # Errors
/// Where an instance can't be started.
pub fn over_instances<T: Trials>(campaign: &mut T, trials: u64) -> Result<()> {
    let ground = ground()?;
    let mut done = 0;
    while done < trials {
        let place = Workplace::new()?;
        let mut session = Session::start(&place, &ground.text, &[])?;
        let mut all = Vec::new();
        while (all.len() as u64) < T::PER_INSTANCE.min(trials - done) && session.alive()? {
            match campaign.trial(&mut session, &place)? {
                Some(trial) => all.push(trial),
                None => break,
            }
        }
        done += (all.len() as u64).max(1);
        let mut ending = session.end()?;
        ending.extend(leftovers(&place, "fault"));
        campaign.judge(&ground, &place, all, ending)?;
    }
    Ok(())
}

/// Faults on running instances.
struct Faults<'a> {
    progress: Progress,
    details: SplitSeed,
    tally: &'a mut Tally,
}

impl Trials for Faults<'_> {
    type Done = Done;
    const PER_INSTANCE: u64 = 25;

    fn trial(&mut self, session: &mut Session, _place: &Workplace) -> Result<Option<Done>> {
        let (kind, text) = draw(&mut self.details);
        self.progress.next(text.as_str());
        session.trial(kind, &text, &mut self.details)
    }

    fn judge(
        &mut self,
        ground: &Ground,
        place: &Workplace,
        done: Vec<Done>,
        ending: Vec<String>,
    ) -> Result<()> {
        judge(ground, &place.path("record"), done, ending, self.tally)
    }
}

/// Runs many trials.
///
/// # Errors
/// Where an instance can't be started.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    println!("on running instances: seed {seed}");
    let progress = Progress::new(trials as usize);
    over_instances(&mut Faults { progress, details: SplitSeed::new(seed), tally }, trials)
}

/// An instance that faults are tried on.
pub struct Session {
    process: Child,
    socket: PathBuf,
    complaints: PathBuf,
    deaths: u32,
    /// The exit code that its end is to have.
    code: i32,
}

impl Session {
    /// Starts one, and waits until it answers.
    ///
    /// # Errors
    /// Where it does not.
    pub fn start(place: &Workplace, text: &str, environment: &[(&str, String)]) -> Result<Self> {
        let scenario = place.path("scenario.toml");
        std::fs::write(&scenario, text)?;
        let complaints = place.path("complaints");
        // An instance must not outlive the one who hurts it: what it leaves on a core falsifies every measurement after.
        let mut command = place.stepvalve_until_we_end()?;
        command.args(["run", "--instance", "fault", "--allow-injection", "--record", "all", "--out"]);
        command.arg(place.path("record")).arg(&scenario);
        command.envs(environment.iter().map(|(name, value)| (*name, value.as_str())));
        command.stdout(Stdio::null()).stderr(File::create(&complaints)?);
        let process = command.spawn().context("stepvalve run")?;
        let socket = place.path("runtime/stepvalve/fault/control.sock");
        let mut session = Self { process, socket, complaints, deaths: 0, code: 0 };
        if session
            .wait(|status| status["processes"]["step-controller"]["cycle"].as_u64() > Some(0))?
            .is_none()
        {
            bail!("the instance did not start: {}", session.complaints());
        }
        Ok(session)
    }

    /// What it complained of.
    pub fn complaints(&self) -> String {
        std::fs::read_to_string(&self.complaints).unwrap_or_default()
    }

    /// Its record will not be whole, which its exit code is to tell.
    pub fn loses_record(&mut self) {
        self.code = 1;
    }

    /// Whether it still runs.
    ///
    /// # Errors
    /// What the system says.
    pub fn alive(&mut self) -> Result<bool> {
        Ok(self.process.try_wait()?.is_none())
    }

    /// Asks for something; `None` where nobody answers.
    pub fn ask(&self, request: &Value) -> Option<Value> {
        self.ask_within(request, PATIENCE)
    }

    /// Injects a fault, given in its text form; `None` where nobody answers.
    ///
    /// # Errors
    /// A text that is no fault.
    pub fn inject(&self, text: &str) -> Result<Option<Value>> {
        let fault = Injection::parse(text)?;
        Ok(self.ask(&json!({"request": "inject", "fault": fault})))
    }

    /// Its status.
    pub fn status(&self) -> Option<Value> {
        self.ask(&json!({"request": "status"})).and_then(|answer| answer.get("status").cloned())
    }

    /// Waits for a status; `None` where it never comes.
    fn wait(&mut self, enough: impl Fn(&Value) -> bool) -> Result<Option<Value>> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE && self.alive()? {
            if let Some(status) = self.status().filter(&enough) {
                return Ok(Some(status));
            }
            std::thread::sleep(Duration::from_millis(3));
        }
        Ok(None)
    }

    /// Armed and turning; `false` where that can't be had any more.
    ///
    /// # Errors
    /// What the system says.
    pub fn turn(&mut self) -> Result<bool> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE && self.alive()? {
            let Some(status) = self.status() else { continue };
            match status["state"].as_str() {
                Some("running") if status["pulse_rate_hz"].as_f64().is_some_and(|rate| rate > 100e3) => {
                    return Ok(true);
                }
                Some("running") if status["set_point_kind"] == "speed" => {}
                Some("running") => {
                    _ = self.ask(
                        &json!({"request": "set", "kind": "speed", "value": 11.17, "pressure_drop_pa": null}),
                    );
                }
                Some("fault") => _ = self.ask(&json!({"request": "reset"})),
                Some("disarmed") => _ = self.ask(&json!({"request": "arm"})),
                _ => {}
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(false)
    }

    /// Disarmed and without a fault; `false` where that can't be had any more.
    ///
    /// # Errors
    /// What the system says.
    pub fn rest(&mut self) -> Result<bool> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE && self.alive()? {
            let Some(status) = self.status() else { continue };
            match status["state"].as_str() {
                Some("disarmed") => return Ok(true),
                Some("fault") => _ = self.ask(&json!({"request": "reset"})),
                Some(_) => _ = self.ask(&json!({"request": "disarm"})),
                None => {}
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Ok(false)
    }

    /// Armed, and without pulses for so long that none comes of arming any more; `false` where that can't be had.
    ///
    /// # Errors
    /// What the system says.
    pub fn stand(&mut self) -> Result<bool> {
        let _ = self.ask(&json!({"request": "arm"}));
        let (begun, mut moved) = (Instant::now(), Instant::now());
        while begun.elapsed() < PATIENCE && self.alive()? {
            let status = self.status().unwrap_or(Value::Null);
            if status["state"] != "running" || moves(&status) {
                moved = Instant::now();
            } else if moved.elapsed() > STANDS_FOR {
                return Ok(true);
            }
            std::thread::sleep(Duration::from_millis(3));
        }
        Ok(false)
    }

    /// A process of the instance by its program's name.
    ///
    /// # Errors
    /// Where there is none.
    pub fn pid_of(&self, program: &str) -> Result<Pid> {
        let own = self.process.id();
        let children = std::fs::read_to_string(format!("/proc/{own}/task/{own}/children"))?;
        let pids = children.split_whitespace().filter_map(|pid| pid.parse().ok());
        let runs = |pid: &i32| {
            let path = std::fs::read_link(format!("/proc/{pid}/exe"));
            path.is_ok_and(|path| path.file_name().is_some_and(|name| name == program))
        };
        let found = pids.chain([i32::try_from(own)?]).find(runs);
        found.map(Pid::from_raw).with_context(|| format!("{program} does not run"))
    }

    /// Asks for something as a client that does not wait longer than this.
    pub fn ask_within(&self, request: &Value, patience: Duration) -> Option<Value> {
        let mut stream = UnixStream::connect(&self.socket).ok()?;
        stream.set_read_timeout(Some(patience)).ok()?;
        stream.write_all(format!("{request}\n").as_bytes()).ok()?;
        let mut line = String::new();
        BufReader::new(&stream).read_line(&mut line).ok()?;
        serde_json::from_str(&line).ok()
    }

    /// One fault, at a random moment, and what follows; `None` where the instance was not to be had.
    fn trial(&mut self, kind: String, text: &str, details: &mut SplitSeed) -> Result<Option<Done>> {
        if !self.turn()? {
            return Ok(None);
        }
        std::thread::sleep(Duration::from_micros(details.whole(0, 60_000)));
        let before = self.status().unwrap_or_default();
        let at_ns = now_ns();
        let answer = self.inject(text)?;
        let mut done = Done {
            kind,
            text: text.to_owned(),
            at_ns,
            generation: before["generation"].as_u64().unwrap_or(0),
            violations: Vec::new(),
        };
        if answer.is_some_and(|answer| answer["done"] != true) {
            done.violations.push("the fault was not injected".to_owned());
        }
        self.aftermath(text, &mut done)?;
        Ok(Some(done))
    }

    /// Waits until what the fault brings is over.
    fn aftermath(&mut self, text: &str, done: &mut Done) -> Result<()> {
        let generation = done.generation;
        if text.starts_with("kill run-recorder") {
            std::thread::sleep(Duration::from_millis(100));
            return Ok(());
        }
        if text.starts_with("kill") {
            self.deaths += 1;
            if self.deaths > 3 {
                self.gives_up(done)?;
            } else {
                let next = self.wait(|status| {
                    status["generation"].as_u64() > Some(generation)
                        && status["processes"]["step-controller"]["cycle"].as_u64() > Some(0)
                })?;
                match next {
                    Some(status) if status["state"] == "disarmed" => {}
                    Some(status) => done.violations.push(format!("not disarmed: {}", status["state"])),
                    None => done.violations.push(format!("no restart: {}", self.complaints())),
                }
            }
            return Ok(());
        }
        let lasts_ms = match Injection::parse(text).map(|injection| injection.fault) {
            Ok(injection::Fault::Pause { ms, .. } | injection::Fault::Hog { ms, .. }) => ms,
            _ => 0,
        };
        std::thread::sleep(Duration::from_millis(lasts_ms + 80));
        Ok(())
    }

    /// After the fourth death it ends by itself, with exit code 1.
    fn gives_up(&mut self, done: &mut Done) -> Result<()> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Some(status) = self.process.try_wait()? {
                if status.code() != Some(1) {
                    done.violations.push(format!("the instance gave up with {status}"));
                }
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        done.violations.push("the instance did not give up after four deaths".to_owned());
        Ok(())
    }

    /// Ends it, where it still runs; what was wrong with that.
    ///
    /// # Errors
    /// What the system says.
    pub fn end(mut self) -> Result<Vec<String>> {
        let mut wrong = Vec::new();
        if self.alive()? {
            kill(Pid::from_raw(i32::try_from(self.process.id())?), Signal::SIGTERM)?;
            let begun = Instant::now();
            loop {
                if let Some(status) = self.process.try_wait()? {
                    if status.code() != Some(self.code) {
                        wrong.push(format!("ended with {status}: {}", self.complaints()));
                    }
                    break;
                }
                if begun.elapsed() > PATIENCE {
                    wrong.push("hangs at its end".to_owned());
                    self.process.kill()?;
                    self.process.wait()?;
                    break;
                }
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        if self.complaints().contains("panicked") {
            wrong.push(format!("panic: {}", self.complaints()));
        }
        Ok(wrong)
    }

    /// The supervisor's process.
    pub fn process(&mut self) -> &mut Child {
        &mut self.process
    }
}

/// A trial that had nothing but an outcome.
pub fn plain(kind: &str, exact: String, violations: Vec<String>) -> Outcome {
    Outcome { fault: kind.to_owned(), exact, violations, ..Outcome::default() }
}
