//! `bench`: how close the loop is to what the machine can do, beside peers, in one run.
#![forbid(unsafe_code)]

mod bus;
mod campaign;
mod compensation;
mod data_quality;
mod diagnosis;
mod goals;
mod integrator;
mod jitter;
mod margins;
mod max;
mod output;
mod peers;
mod predict;
mod programs;
mod progress;
mod quiet;
mod robustness;
mod safety;
mod scenario;
mod scope;
mod sim;
mod stalls;
mod timing;
mod tune;
mod watched;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use output::Results;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Measures the loop beside its peers. Numbers are printed and written, never judged: a machine has its own.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Shorter runs: to see that it works, not to quote from
    #[arg(long, global = true)]
    quick: bool,
    /// How long each of `jitter`'s turns takes, in s [default: 8; quick: 0.5]
    #[arg(long, global = true, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=3600))]
    turn: Option<u64>,
    /// Folder for JSON and HTML
    #[arg(long, global = true, value_name = "DIR", default_value = "bench-results")]
    out: PathBuf,
    /// Put the tables into docs/realtime.md (or the file given) in their places
    #[arg(long, global = true, value_name = "FILE", num_args = 0..=1, default_missing_value = "docs/realtime.md")]
    docs: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    #[command(flatten)]
    Bench(Bench),
    #[command(flatten)]
    Echo(bus::Echo),
}

#[derive(Subcommand, Clone)]
enum Bench {
    /// How many times faster than real time the three modes are, and what a cycle costs
    Sim,
    /// Round trips over the bus beside other ways, and from feedback and set-point to step command
    Bus(bus::Arguments),
    /// The real loop's wake-up latency and execution time, beside cyclictest, idle and under load
    Jitter,
    /// The shortest period that holds
    Max,
    /// LinuxCNC's thread jitter beside the loop's, where it is installed
    Peers,
    /// How often `stepvalve diagnose` finds what is hidden, beside a stepwise regression; takes long, not among `all`
    Diagnosis(diagnosis::Arguments),
    /// Records of real drives, what is known of them by hand, and what `stepvalve diagnose` finds
    DiagnosisReal(diagnosis::drives::Arguments),
    /// Mistakes made on purpose in measured logs, and whether `stepvalve inspect` names them
    DataQuality(data_quality::Arguments),
    /// What a diagnosis costs, by samples and candidates; --docs docs/diagnosis-evidence.md
    DiagnosisSpeed(diagnosis::speed::Arguments),
    /// Laws that no cause of the list has, and what `stepvalve diagnose` makes of them
    DiagnosisUnnamed(diagnosis::unnamed::Arguments),
    /// Causes that a record can't tell apart, and how `stepvalve investigate` decides between them
    DiagnosisTwins(diagnosis::twins::Arguments),
    /// Wrong beliefs, put right by `stepvalve tune`, and what that is worth in the loop
    Tune(tune::Arguments),
    /// Faults by the thousand without a clock: in one thread, in lockstep, in files; --docs docs/safety.md
    Safety(safety::Arguments),
    /// Faults by the thousand in real time: processes killed, stopped, starved; --docs docs/safety.md
    SafetyLive(safety::Arguments),
    /// Faults of a drive's bus on a running instance, in a network namespace (`unshare -n`); --docs docs/safety.md
    SafetyBus(safety::Arguments),
    /// A valve that turns for half an hour beside stress-ng; --docs docs/safety.md
    Soak(safety::SoakArguments),
    /// A day of simulated time in one thread, and whether anything drifts; --docs docs/safety.md
    Day,
    /// The live view: how late a page draws, what the scope costs, whether the loop notices it; --docs docs/scope.md
    Scope(scope::Arguments),
    /// The valve's integrator beside SUNDIALS CVODE: error and cost by law, parameters and motion
    Integrator,
    /// An hour of data through `stepvalve predict`
    Predict,
    /// A campaign's runs beside the bare loop, one job beside two, memory and rows; --docs docs/campaign.md
    Campaign,
    /// What friction compensation is worth, over scenarios, levels and beliefs; --file docs/compensation.md
    Compensation(compensation::Arguments),
    /// How far the loop of encoder, observer and motor is from instability; --docs docs/robustness.md
    Margins,
    /// Whether compensation is ever worse than none, over valves unlike the belief; --docs docs/robustness.md
    Robustness(robustness::Arguments),
    /// Where the figures that `sim`, `bus`, `jitter` and `diagnosis-speed` left in --out stand against their goals: goals.html
    Goals,
    /// Sim, bus, jitter, max, peers and diagnosis-speed, then goals
    All(AllArguments),
}

/// How often.
#[derive(clap::Args, Clone)]
struct AllArguments {
    /// So many tries of each; the one beside which the machine was quietest is kept. Documents are written from five
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=20))]
    tries: u8,
}

fn all_benches() -> [Bench; 6] {
    [
        Bench::Sim,
        Bench::Bus(bus::Arguments { drive: false }),
        Bench::Jitter,
        Bench::Max,
        Bench::Peers,
        Bench::DiagnosisSpeed(diagnosis::speed::Arguments::default()),
    ]
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match &arguments.command {
        Command::Echo(echo) => bus::echo(echo),
        Command::Bench(Bench::All(all)) => run_all(all, &arguments),
        Command::Bench(Bench::Goals) => goals_of(&arguments),
        Command::Bench(Bench::Compensation(own)) => compensation::run(own),
        Command::Bench(bench) => run(bench, &arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(bench: &Bench, arguments: &Arguments) -> Result<()> {
    tell(&results_of(bench, arguments)?, &arguments.out, arguments.docs.as_ref())
}

/// Everything, the quietest try of each, and the page that says where it stands. One bench that fails costs itself.
fn run_all(all: &AllArguments, arguments: &Arguments) -> Result<()> {
    let mut failed = Vec::new();
    for bench in all_benches() {
        let mut kept: Option<(Results, quiet::Quiet)> = None;
        for number in 1..=all.tries {
            // On a thread of its own: a bench may bind itself to a core, and what it starts inherits that.
            let tried = std::thread::scope(|scope| {
                scope.spawn(|| quiet::beside(|| results_of(&bench, arguments))).join()
            });
            match tried.unwrap_or_else(|_| Err(anyhow::anyhow!("a bench panicked"))) {
                Ok((results, quiet)) => {
                    eprintln!(
                        "{}, try {number}: beside it a core was taken {quiet} of the time",
                        results.command
                    );
                    if kept.as_ref().is_none_or(|(_, before)| quiet < *before) {
                        kept = Some((results, quiet));
                    }
                }
                Err(error) => failed.push(error),
            }
        }
        if let Some((results, _)) = kept {
            // What a diagnosis costs has a document of its own.
            let docs = arguments.docs.as_ref().filter(|_| results.command != "diagnosis-speed");
            tell(&results, &arguments.out, docs)?;
        }
    }
    goals_of(arguments)?;
    failed.iter().for_each(|error| eprintln!("{error:#}"));
    failed.pop().map_or(Ok(()), Err)
}

/// Where the figures that lie in the folder stand.
fn goals_of(arguments: &Arguments) -> Result<()> {
    let found = goals::All::read(&arguments.out)?;
    let standing = found.standing();
    tell(&standing, &arguments.out, arguments.docs.as_ref())?;
    found.write_page(&standing, &arguments.out.join("goals.html"))
}

fn tell(results: &Results, out: &Path, docs: Option<&PathBuf>) -> Result<()> {
    println!("{}", results.text());
    results.write_json(out)?;
    docs.map_or(Ok(()), |document| results.put_into(document))
}

fn results_of(bench: &Bench, arguments: &Arguments) -> Result<Results> {
    let (quick, out) = (arguments.quick, &arguments.out);
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    match bench {
        Bench::Sim => sim::run(quick),
        Bench::Bus(arguments) => bus::run(arguments, quick),
        Bench::Jitter => jitter::run(quick, arguments.turn, out),
        Bench::Max => max::run(quick),
        Bench::Peers => peers::run(quick),
        Bench::Diagnosis(arguments) => diagnosis::run(arguments, quick, out),
        Bench::DiagnosisReal(arguments) => diagnosis::drives::run(arguments, quick),
        Bench::DataQuality(arguments) => data_quality::run(arguments, quick),
        Bench::DiagnosisSpeed(arguments) => diagnosis::speed::run(arguments, quick),
        Bench::DiagnosisUnnamed(arguments) => diagnosis::unnamed::run(arguments, quick),
        Bench::DiagnosisTwins(arguments) => diagnosis::twins::run(arguments, quick),
        Bench::Tune(arguments) => tune::run(arguments, quick),
        Bench::Safety(arguments) => safety::run(arguments, quick),
        Bench::SafetyLive(arguments) => safety::run_live(arguments, quick),
        Bench::SafetyBus(arguments) => safety::run_bus(arguments, quick),
        Bench::Soak(arguments) => safety::run_soak(arguments, quick),
        Bench::Day => safety::run_day(quick),
        Bench::Scope(arguments) => scope::run(arguments, quick),
        Bench::Integrator => integrator::run(quick),
        Bench::Predict => predict::run(quick),
        Bench::Campaign => campaign::run(quick),
        Bench::Margins => margins::run(quick),
        Bench::Robustness(arguments) => robustness::run(arguments, quick),
        Bench::Compensation(_) | Bench::All(_) | Bench::Goals => {
            anyhow::bail!("it has no results of its own")
        }
    }
}
