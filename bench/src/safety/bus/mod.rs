//! `bench safety-bus`: faults of a drive's bus under a running instance, over a pair of virtual interfaces: cable, power, link,
//! frames, AL states, the drive itself, and the bridge's process.

#![allow(clippy::indexing_slicing, reason = "a key that JSON lacks reads as null")]

mod faults;
mod judge;

use super::ground::Variant;
use super::live::Session;
use super::lockstep::leftovers;
use super::tally::{Outcome, Tally};
use crate::programs::{Workplace, beside};
use crate::progress::Progress;
use crate::scenario::repository;
use crate::stalls::watch;
use anyhow::{Context, Result};
use faults::{Fault, Trouble};
use injection::SplitSeed;
use judge::{Told, judged};
use nix::sys::signal::{Signal, kill};
use realtime::now_ns;
use serde_json::json;
use std::process::Command;
use std::time::{Duration, Instant};
use subdevice::{DriveProcess, NEAR, lay_cable, read_log};
use toml_edit::{DocumentMut, Item, Table, value};

/// Silence, and frames lost, as a virtual machine needs it: its own stalls seldom last so long.
pub(super) const SILENCE_CYCLES: u64 = 20;
/// Trials of one instance, at most; and deaths of its bridge: the fourth in ten minutes ends it.
const PER_INSTANCE: u64 = 12;
const MOST_DEATHS: u32 = 3;
/// So long after a trouble's end it is looked whether anything arms by itself.
const WATCHED: Duration = Duration::from_millis(300);
/// It is waited so long for the bus to operate again.
const PATIENCE: Duration = Duration::from_secs(15);
/// A trouble has been noticed so long after its end, or never.
const NOTICED: Duration = Duration::from_millis(60);
/// So many of the bridge's complaints are shown.
const MOST_COMPLAINTS: usize = 6;
/// Restarted processes are looked for so long.
const RESTART_WITHIN: Duration = Duration::from_secs(10);
/// Cycles from switched on to operation enabled, as the simulated drive is made.
const ENABLE_CYCLES: u64 = 5;

/// Runs many trials.
///
/// # Errors
/// Where no cable can be laid, or an instance can't be started.
pub(super) fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    println!("on a drive's bus: seed {seed}");
    lay_cable().context(
        "expected a network namespace of its own: `unshare -n` as root, `unshare -Urn` as anybody",
    )?;
    let progress = Progress::new(usize::try_from(trials)?);
    let mut details = SplitSeed::new(seed);
    let text = scenario()?;
    let (mut done, mut extrapolates) = (0, false);
    while done < trials {
        let place = Workplace::new()?;
        // Drives differ in what they do without fresh outputs: some stand, some go on.
        extrapolates = !extrapolates;
        let stalls = watch();
        let mut campaign = OnADrive::start(&place, &text, extrapolates)?;
        let mut all = Vec::new();
        while all.len() as u64 <= PER_INSTANCE && done < trials && campaign.deaths < MOST_DEATHS {
            let fault = faults::draw(&mut details);
            progress.next(fault.kind.as_str());
            match campaign.trial(fault, &mut details)? {
                Some(told) => all.push(told),
                None => break,
            }
            done += 1;
        }
        let mut wrong = campaign.end()?;
        wrong.extend(leftovers(&place, "fault"));
        let (rows, stalls) = (read_log(&place.path("drive.csv"))?, stalls.seen());
        all.iter().for_each(|told| tally.note(judged(told, &rows, &stalls)));
        if all.is_empty() || !wrong.is_empty() {
            let violations = if wrong.is_empty() { vec!["the valve did not turn".to_owned()] } else { wrong };
            tally.note(Outcome { fault: "end of an instance".to_owned(), violations, ..Outcome::default() });
        }
    }
    Ok(())
}

/// The rotation at 200 kHz, on the shipped simulated drive.
fn scenario() -> Result<String> {
    let ground = Variant {
        shipped: "rotation-200khz",
        after_stop: "hold",
        loop_delay_cycles: 2,
        encoder: true,
        duration_s: 5.0,
        silence_cycles: SILENCE_CYCLES.cast_signed(),
    }
    .ground()?;
    let mut scenario: DocumentMut = ground.text.parse()?;
    let mut drive = Table::new();
    drive.insert("file", value("drive.toml"));
    drive.insert("interface", value(NEAR));
    scenario.insert("drive", Item::Table(drive));
    for (process, phase) in [("trajectory-generator", "400us"), ("step-controller", "600us")] {
        let timing = scenario.get_mut("timing").and_then(|timing| timing.get_mut(process));
        timing.and_then(Item::as_table_mut).context(process)?.insert("phase", value(phase));
    }
    Ok(scenario.to_string())
}

/// An instance with its drive.
struct OnADrive {
    session: Session,
    drive: DriveProcess,
    deaths: u32,
}

impl OnADrive {
    fn start(place: &Workplace, scenario: &str, extrapolates: bool) -> Result<Self> {
        let shipped = std::fs::read_to_string(repository().join("rt-config/drives/simulated.toml"))?;
        let lost = format!("bus_lost_cycles = {SILENCE_CYCLES} ");
        std::fs::write(place.path("drive.toml"), shipped.replace("bus_lost_cycles = 3 ", &lost))?;
        let (model, log) = (repository().join("rt-config/models/rig.toml"), place.path("drive.csv"));
        let mut arguments = vec!["--log".as_ref(), log.as_os_str()];
        if extrapolates {
            arguments.push("--extrapolate".as_ref());
        }
        let drive = DriveProcess::start(&beside("subdevice")?, &model, &arguments)?;
        let session = Session::start(place, scenario, &[])?;
        Ok(Self { session, drive, deaths: 0 })
    }

    /// One fault at a random moment, and what follows; `None` where the valve could not be made to turn.
    fn trial(&mut self, fault: Fault, details: &mut SplitSeed) -> Result<Option<Told>> {
        let ready = if fault.while_arming() { self.session.rest()? } else { self.session.turn()? };
        if !ready {
            return Ok(None);
        }
        std::thread::sleep(Duration::from_micros(details.whole(0, 60_000)));
        let generation = self.generation();
        let mut told = Told::new(fault, now_ns());
        let over = self.strike(&mut told)?;
        std::thread::sleep(over.saturating_duration_since(Instant::now()));
        self.await_restart(&mut told, generation)?;
        self.await_bus(&mut told)?;
        // What follows is whatever the operator orders next.
        std::thread::sleep(WATCHED);
        told.until_ns = now_ns();
        let state = self.session.status().unwrap_or_default();
        told.state = state["state"].as_str().unwrap_or("silent").to_owned();
        if let Trouble::Enabling(_) = told.fault.trouble {
            self.drive.hurt(&format!("enabling {ENABLE_CYCLES}"))?;
        }
        Ok(Some(told))
    }

    /// Lets it go wrong, and notes when; when the trouble will be over.
    fn strike(&mut self, told: &mut Told) -> Result<Instant> {
        let now = Instant::now();
        let after_ms = |ms: u64| now + Duration::from_millis(ms);
        match &told.fault.trouble {
            Trouble::Far { line, ms } => {
                told.at_ns = self.drive.hurt(line)?;
                return Ok(after_ms(*ms) + NOTICED);
            }
            Trouble::Enabling(cycles) => {
                self.drive.hurt(&format!("enabling {cycles}"))?;
                let _ = self.session.ask(&json!({"request": "arm"}));
                // As long as the controller waits for current, and more.
                return Ok(after_ms(2_500));
            }
            Trouble::Link(ms) => {
                ip(&["link", "set", NEAR, "down"])?;
                told.at_ns = now_ns();
                std::thread::sleep(Duration::from_millis(*ms));
                ip(&["link", "set", NEAR, "up"])?;
            }
            Trouble::Paused(ms) => {
                let bridge = self.session.pid_of("valve-bridge")?;
                kill(bridge, Signal::SIGSTOP)?;
                std::thread::sleep(Duration::from_millis(*ms));
                kill(bridge, Signal::SIGCONT)?;
            }
            Trouble::Killed => {
                kill(self.session.pid_of("valve-bridge")?, Signal::SIGKILL)?;
                self.deaths += 1;
            }
        }
        Ok(Instant::now())
    }

    fn generation(&self) -> Option<u64> {
        self.session.status()?["generation"].as_u64()
    }

    /// After the death of a process all of them start again.
    fn await_restart(&mut self, told: &mut Told, before: Option<u64>) -> Result<()> {
        if told.fault.trouble != Trouble::Killed {
            return Ok(());
        }
        let begun = Instant::now();
        while self.generation().is_none_or(|now| Some(now) == before) {
            if begun.elapsed() > RESTART_WITHIN || !self.session.alive()? {
                told.violations.push(format!("no restart: {}", self.session.complaints()));
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    fn await_bus(&mut self, told: &mut Told) -> Result<()> {
        let begun = Instant::now();
        told.over_ns = now_ns();
        loop {
            let status = self.session.status().unwrap_or_default();
            if status["bus"]["phase"] == "in operation" {
                told.back = Some(begun.elapsed());
                let complaints = self.session.complaints();
                let own: Vec<_> = complaints.lines().filter(|line| line.starts_with(NEAR)).collect();
                told.complaints =
                    own.get(own.len().saturating_sub(MOST_COMPLAINTS)..).unwrap_or(&[]).join("; ");
                return Ok(());
            }
            if begun.elapsed() > PATIENCE || !self.session.alive()? {
                told.violations.push(format!(
                    "the bus is not back: {}; {}",
                    status["bus"],
                    self.session.complaints()
                ));
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// What was wrong at the end.
    fn end(self) -> Result<Vec<String>> {
        let wrong = self.session.end()?;
        self.drive.end()?;
        Ok(wrong)
    }
}

fn ip(arguments: &[&str]) -> Result<()> {
    let status = Command::new("ip").args(arguments).status().context("ip")?;
    anyhow::ensure!(status.success(), "ip {}: {status}", arguments.join(" "));
    Ok(())
}
