//! Orders to an instance of which a process is stopped and continued at random moments: what was refused must have no
//! effect later, and whoever disarms knows within a second what became of it.
#![allow(clippy::indexing_slicing, reason = "a key that JSON lacks reads as null")]

use super::ground::Ground;
use super::live::{Session, Trials, moves, over_instances};
use super::live_record::judge_orders;
use super::tally::{Outcome, Tally};
use crate::programs::Workplace;
use crate::progress::Progress;
use anyhow::Result;
use injection::SplitSeed;
use nix::sys::signal::{Signal, kill};
use realtime::now_ns;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// What is stopped.
const STOPPED: [&str; 4] =
    ["stepvalve-supervisor", "step-controller", "trajectory-generator", "plant-simulator"];
/// What is ordered meanwhile.
const ORDERS: [&str; 4] = ["arm", "set", "disarm", "reset"];
/// An operator who disarms knows by then.
const DISARM_WITHIN: Duration = Duration::from_secs(1);

/// Orders around stopped processes.
struct Orders<'a> {
    progress: Progress,
    details: SplitSeed,
    tally: &'a mut Tally,
}

impl Trials for Orders<'_> {
    type Done = Outcome;
    const PER_INSTANCE: u64 = 50;

    fn trial(&mut self, session: &mut Session, place: &Workplace) -> Result<Option<Outcome>> {
        let outcome = trial(session, place, &mut self.details)?;
        if outcome.is_some() {
            self.progress.next("order");
        }
        Ok(outcome)
    }

    fn judge(
        &mut self,
        ground: &Ground,
        place: &Workplace,
        mut done: Vec<Outcome>,
        mut ending: Vec<String>,
    ) -> Result<()> {
        ending.extend(judge_orders(ground, &place.path("record"))?);
        if let Some(last) = done.last_mut() {
            last.violations.extend(ending);
        }
        done.into_iter().for_each(|outcome| self.tally.note(outcome));
        Ok(())
    }
}

/// Runs many trials.
///
/// # Errors
/// Where an instance can't be started.
pub fn campaign(seed: u64, trials: u64, tally: &mut Tally) -> Result<()> {
    println!("orders around stopped processes: seed {seed}");
    let progress = Progress::new(trials as usize);
    over_instances(&mut Orders { progress, details: SplitSeed::new(seed), tally }, trials)
}

/// One process stopped around one order.
fn trial(session: &mut Session, place: &Workplace, details: &mut SplitSeed) -> Result<Option<Outcome>> {
    let (stopped, order) = (details.one(&STOPPED, ""), details.one(&ORDERS, ""));
    let ready = if order == "disarm" { session.turn()? } else { session.rest()? };
    if !ready {
        return Ok(None);
    }
    // A valve that was armed just now is still pulled to its reference, and a supervisor that was stopped would tell of that late.
    if order == "set" && !session.stand()? {
        return Ok(None);
    }
    let ms = |details: &mut SplitSeed, most: u64| Duration::from_micros(details.whole(0, most * 1000));
    let (phase, before, patience, after) =
        (ms(details, 3), ms(details, 40), Duration::from_millis(20) + ms(details, 180), ms(details, 200));
    std::thread::sleep(phase);
    let pid = session.pid_of(stopped)?;
    kill(pid, Signal::SIGSTOP)?;
    std::thread::sleep(before);
    // Continued while the order waits, or after it was given up.
    let continued = std::thread::spawn(move || {
        std::thread::sleep(after);
        kill(pid, Signal::SIGCONT)
    });
    let begun = Instant::now();
    let answer = give(session, place, order, patience)?;
    let took = begun.elapsed();
    let _ = continued.join();
    let mut outcome = Outcome {
        fault: format!("{order} while {stopped} is stopped"),
        exact: format!(
            "{order}, {stopped} stopped, order after {before:?}, continued after {after:?}, patience {patience:?}"
        ),
        ..Outcome::default()
    };
    if order == "disarm" && took > DISARM_WITHIN {
        outcome.violations.push(format!("the operator knew after {took:?}"));
    }
    watch(session, order, answer == Some(true), &mut outcome);
    Ok(Some(outcome))
}

/// Gives the order; whether it was done, `None` where nobody said.
fn give(session: &Session, place: &Workplace, order: &str, patience: Duration) -> Result<Option<bool>> {
    if order == "disarm" {
        // As an operator does, from process start to exit code.
        let status = place.stepvalve()?.args(["disarm", "--instance", "fault"]).output()?.status;
        return Ok(Some(status.success()));
    }
    let until_ns = now_ns() + patience.as_nanos() as u64;
    let mut request = match order {
        "set" => json!({"request": "set", "kind": "speed", "value": 11.17, "pressure_drop_pa": null}),
        order => json!({"request": order}),
    };
    request["until_ns"] = json!(until_ns);
    let answer = session.ask_within(&request, patience);
    Ok(answer.and_then(|answer| answer["done"].as_bool()))
}

/// What the order must not have brought about, looked at for some time.
fn watch(session: &Session, order: &str, done: bool, outcome: &mut Outcome) {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_millis(120) {
        let status = session.status().unwrap_or(Value::Null);
        let state = status["state"].as_str().unwrap_or("");
        let violation = match order {
            "arm" if !done && ["running", "arming"].contains(&state) => {
                Some("armed by an order that was refused")
            }
            "reset" if ["running", "arming"].contains(&state) => Some("armed by a reset"),
            "set" if !done && moves(&status) => Some("moves by a set-point that was refused"),
            "disarm" if done && ["running", "arming"].contains(&state) => {
                Some("runs after a disarm that was done")
            }
            _ => None,
        };
        if let Some(violation) = violation {
            let seen = format!("{state}, {} Hz, set-point {}", status["pulse_rate_hz"], status["set_point"]);
            return outcome.violations.push(format!("{violation}: {seen}"));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// The name under which the table says how much was tried.
pub fn sheet(tally: &Tally) -> crate::output::Sheet {
    tally.short_sheet("safety-orders", "Orders around processes that are stopped and continued at random")
}
