//! `stepvalve`: the command line.
#![forbid(unsafe_code)]
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod bus;
mod campaign;
mod check;
mod conclude;
mod convert;
mod diagnose;
mod doctor;
mod drive;
mod errand;
mod events;
mod export;
mod files;
mod findings;
mod home;
mod import;
mod in_process;
mod inspect;
mod investigate;
mod keep;
mod list;
mod live_motion;
mod loaded;
mod metrics;
mod new;
mod operator;
mod output;
mod paper;
mod predict;
mod pulse;
mod record_info;
mod replay;
mod report;
mod run;
mod say;
mod schema;
mod scope;
mod shell;
mod simulate;
mod strangers;
mod summary;
mod tune;
mod watch;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use processes::complain;
use std::process::ExitCode;
use supervisor::{Outcome, Request};

/// Positions a stepped rotary hydraulic valve, simulates it, and records what it does.
///
/// Exit codes: 0 done, 1 failed, 2 wrong input or usage, 3 a fault stopped the valve, 130 interrupted after a clean stop.
#[derive(Parser)]
#[command(version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scenario in closed loop and write DIR/run.h5 and DIR/run.html
    Simulate(simulate::Arguments),
    /// Run the valve in real time until Ctrl-C or SIGTERM, which stop it first
    Run(run::Arguments),
    /// Begin to follow set-points
    Arm(operator::Plain),
    /// Find the angle's zero and align the motor's teeth to the encoder
    Home(operator::Plain),
    /// Stop the valve, then take its current away, or hold it, as the scenario says (holds_when_disarmed)
    Disarm(operator::Plain),
    /// Leave a fault; the valve stays disarmed
    Reset(operator::Plain),
    /// Give a set-point: angle 17deg, opening 0.5, flow 40L/min, speed 60rpm, hold
    Set(operator::Set),
    /// Show state, set-point, angle, following error, torque reserve, overruns, who is late or silent
    Status(operator::StatusOf),
    /// List this user's instances, live or dead, in all runtime folders
    List(list::Arguments),
    /// Show what happened to an instance: orders, faults with what to do, alarms, restarts
    Events(events::Arguments),
    /// Show a running instance on the terminal: state, angle, error, processes, events; q ends the view
    Watch(operator::Plain),
    /// Show a running instance in a browser: signals at full rate, triggers, captures
    Scope(scope::Arguments),
    /// Put a note into the record
    Mark(operator::Mark),
    /// Save the last seconds of every process's timing
    SaveTiming(operator::Plain),
    /// Let something go wrong on purpose, on an instance started with --allow-injection: a fault that must stop the valve
    Inject(operator::Inject),
    /// Write a commented scenario, model or drive file to begin from
    New(new::Arguments),
    /// Print the JSON Schema of scenarios, models or drive files, for editors
    Schema(schema::Arguments),
    /// Print what a shell needs to complete commands and options
    Completions(shell::Completions),
    /// Write the manual's pages
    Man(shell::Man),
    /// Validate a scenario (with its models) or a model
    Check(check::Arguments),
    /// Simulate and diagnose scenarios by the thousand, with values varied; DIR/campaign.h5 and DIR/campaign.html
    Campaign(Box<campaign::Arguments>),
    /// Fit the belief's numbers to a motion, a record or a running valve, and say how well they are known
    Tune(tune::Arguments),
    /// Check whether this machine holds the loop: what stands in the way, what to do, and how late a process wakes
    Doctor(doctor::Arguments),
    /// A drive's bus: who is on it, what goes over it
    #[command(subcommand)]
    Bus(bus::Command),
    /// Turn a record (MCAP) into run.h5
    Convert(convert::Arguments),
    /// Tell how a run ended, once the supervisor is done
    #[command(hide = true)]
    Conclude,
    /// Find what a model gets wrong about measured runs, name the cause, extend the model, measure the gain
    Diagnose(diagnose::Arguments),
    /// Diagnose, plan the experiment that decides, make it, diagnose again: until it is decided
    Investigate(Box<investigate::Arguments>),
    /// Turn tables (CSV, MAT, NumPy) into a valve-log
    Import(Box<import::Arguments>),
    /// Say what is wrong with a log itself: units, signs, exchanged channels, rails, gaps, missing samples
    Inspect(inspect::Arguments),
    /// Write the page of a run file, within limits
    #[command(hide = true)]
    DrawPage(report::Limited),
    /// Read a file that somebody else wrote, for another process of this program
    #[command(hide = true)]
    ReadFile(strangers::ReadFile),
    /// Write a model as a file that other simulators take
    #[command(subcommand)]
    Export(export::Command),
    /// Reproduce or refute the paper's figures and tables: DIR/paper.html and paper.json
    Paper(paper::Arguments),
    /// Predict torque or angle of measured runs with a model
    Predict(predict::Arguments),
    /// Recompute every StepCommand of a record and compare, bit for bit
    Replay(replay::Arguments),
    /// Turn a run file into a page with plots (run.html)
    Report(report::Arguments),
    /// Put two runs on one page: key figures beside each other, signals over each other, what differs in their files
    Compare(report::compare::Arguments),
    /// Write the page of two runs, within limits
    #[command(hide = true)]
    DrawComparison(report::compare::Limited),
}

fn main() -> ExitCode {
    // clap ends with code 2 on wrong usage by itself.
    let command = shell::grouped(Arguments::command());
    let given = command.clone().try_get_matches();
    let given = given.unwrap_or_else(|error| shell::led_on(error, &command).exit());
    let arguments = Arguments::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
    let outcome = match arguments.command {
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Arm(arguments) => operator::plain(&Request::Arm, &arguments),
        Command::Home(arguments) => home::run(&arguments),
        Command::Disarm(arguments) => operator::disarm(&arguments),
        Command::Reset(arguments) => operator::plain(&Request::Reset, &arguments),
        Command::Set(arguments) => operator::set(&arguments),
        Command::Status(arguments) => operator::status(&arguments),
        Command::List(arguments) => list::run(&arguments),
        Command::Events(arguments) => events::run(&arguments),
        Command::Watch(arguments) => watch::run(&arguments),
        Command::Scope(arguments) => scope::run(&arguments),
        Command::Mark(arguments) => operator::mark(&arguments),
        Command::SaveTiming(arguments) => operator::plain(&Request::SaveTiming, &arguments),
        Command::Inject(arguments) => operator::inject(&arguments),
        Command::New(arguments) => new::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Completions(arguments) => shell::completions(&arguments),
        Command::Man(arguments) => shell::man(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Campaign(arguments) => campaign::run(&arguments),
        Command::Tune(arguments) => tune::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Bus(command) => bus::run(&command),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Conclude => conclude::conclude(),
        Command::Diagnose(arguments) => diagnose::run(&arguments),
        Command::Investigate(arguments) => investigate::run(&arguments),
        Command::Import(arguments) => import::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::DrawPage(arguments) => report::draw(&arguments),
        Command::ReadFile(arguments) => strangers::read_file(&arguments),
        Command::Export(command) => export::run(&command),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Predict(arguments) => predict::run(&arguments),
        Command::Replay(arguments) => replay::run(&arguments),
        Command::Report(arguments) => report::run(&arguments),
        Command::Compare(arguments) => report::compare::run(&arguments),
        Command::DrawComparison(arguments) => report::compare::draw(&arguments),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Fault) => ExitCode::from(3),
        Ok(Outcome::Interrupted) => ExitCode::from(130),
        Err(failure) => {
            complain(&failure);
            failure.code()
        }
    }
}
