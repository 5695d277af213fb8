//! `bench campaign`: a campaign's runs beside the bare loop, one job beside two, in turns; memory and rows of ten thousand runs.

use crate::output::{Results, Sheet, digits};
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::scenario::repository;
use crate::watched;
use anyhow::{Context, Result};
use campaign::{BaseTexts, Campaign, Source};
use closed_loop::{InProcess, wire};
use config::{Scenario, parse_model, parse_scenario};
use serde_json::{Value, json};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use valve_model::Model;

/// The shipped sine, and a model file beside it.
const SCENARIO: &str = "rt-config/scenarios/sine-1hz.toml";
/// The truth varied, and the belief: with it the controller is wired, and its observer designed, for each run.
const TRUTH: &str =
    "[[vary]]\npath = \"truth.friction.coulomb_torque_nm\"\nas = \"factor\"\nrange = [0.9, 1.1]\n";
const BELIEF: &str = "[[vary]]\npath = \"belief.load.inertia_kg_m2\"\nas = \"factor\"\nlog = [0.5, 2.0]\n";

/// How much is run.
struct Size {
    turns: usize,
    runs_of_a_turn: u64,
    runs_of_all: u64,
}

/// Ratios of a turn.
struct Turn {
    bare_per_s: f64,
    both_per_s: f64,
    truth_per_s: f64,
    one_job_s: f64,
    two_jobs_s: f64,
}

/// Measures.
///
/// # Errors
/// Where the program is missing or refuses the plan.
pub fn run(quick: bool) -> Result<Results> {
    let size = if quick {
        Size { turns: 2, runs_of_a_turn: 40, runs_of_all: 500 }
    } else {
        Size { turns: 9, runs_of_a_turn: 400, runs_of_all: 10_000 }
    };
    let place = Workplace::new()?;
    let progress = Progress::new(size.turns + 1);
    let mut turns = Vec::new();
    for number in 0..size.turns {
        progress.next(format!("turn {} of {}", number + 1, size.turns));
        turns.push(turn(&place, &size)?);
    }
    progress.next(format!("{} runs", size.runs_of_all));
    let (_, memory_mb, row_bytes) = program(&place, size.runs_of_all, 2)?;
    let mut sheet = Sheet::new(
        "campaign",
        format!("{} turns of {} runs of 5 s", size.turns, size.runs_of_a_turn),
        &["what", "median", "least", "largest"],
    );
    let mut spread = |what: &str, of: &dyn Fn(&Turn) -> f64| {
        let mut values: Vec<f64> = turns.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let at = |index: usize| values.get(index).copied().unwrap_or(f64::NAN);
        let found = [at(values.len() / 2), at(0), at(values.len().saturating_sub(1))];
        sheet.row([what.to_owned()].into_iter().chain(found.map(digits)));
        json!({ "what": what, "turns": values })
    };
    let data = vec![
        spread("runs a second, bare loop (wired and run)", &|turn| turn.bare_per_s),
        spread("the same as a campaign, truth and belief varied", &|turn| turn.both_per_s),
        spread("the same, the truth alone varied", &|turn| turn.truth_per_s),
        spread("time of a run, campaign over bare loop", &|turn| turn.bare_per_s / turn.both_per_s),
        spread("time of the command, 1 job over 2", &|turn| turn.one_job_s / turn.two_jobs_s),
    ];
    let whole = [("largest resident memory, MB", memory_mb), ("rows.log, MB", row_bytes as f64 / 1e6)];
    for (what, value) in whole {
        let cell = digits(value);
        sheet.row([format!("{what}, {} runs", size.runs_of_all), cell.clone(), cell.clone(), cell]);
    }
    Ok(Results {
        command: "campaign",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: vec![sheet],
        data: json!({ "turns": Value::Array(data), "memory_mb": memory_mb, "row_bytes": row_bytes }),
    })
}

/// All ways and both numbers of jobs, one after the other.
fn turn(place: &Workplace, size: &Size) -> Result<Turn> {
    let runs = size.runs_of_a_turn;
    let campaign = |varied: &str| -> Result<Campaign> {
        let source = Source { file: String::new(), text: plan(runs, varied) };
        Ok(Campaign::new(source, vec![texts()?])?)
    };
    let both = campaign(&[TRUTH, BELIEF].concat())?;
    // The bare loop is given what reading the same runs' texts comes to.
    let read = (0..runs).map(|run| models(&both, run)).collect::<Result<Vec<_>>>()?;
    let begun = Instant::now();
    for (scenario, truth, belief) in &read {
        InProcess::new(&wire(scenario, truth, belief)?).for_each(|cycle| _ = black_box(cycle));
    }
    let bare_s = begun.elapsed().as_secs_f64();
    let time_s = |campaign: &Campaign| {
        let begun = Instant::now();
        (0..runs).for_each(|run| _ = black_box(campaign.run(run, &|| false)));
        begun.elapsed().as_secs_f64()
    };
    let (both_s, truth_s) = (time_s(&both), time_s(&campaign(TRUTH)?));
    let (one_job_s, ..) = program(place, runs, 1)?;
    let (two_jobs_s, ..) = program(place, runs, 2)?;
    let per_s = |time_s: f64| runs as f64 / time_s;
    Ok(Turn {
        bare_per_s: per_s(bare_s),
        both_per_s: per_s(both_s),
        truth_per_s: per_s(truth_s),
        one_job_s,
        two_jobs_s,
    })
}

fn plan(runs: u64, varied: &str) -> String {
    let scenario = repository().join(SCENARIO);
    format!(
        "format = \"stepvalve-campaign\"\nformat_version = 1\nname = \"bench\"\nscenarios = [{scenario:?}]\n\
         [design]\nkind = \"latin-hypercube\"\nruns = {runs}\n{varied}"
    )
}

fn texts() -> Result<BaseTexts> {
    let read = |path: &Path| -> Result<Source> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        Ok(Source { file: path.display().to_string(), text })
    };
    let model = read(&repository().join("rt-config/models/rig.toml"))?;
    Ok(BaseTexts { scenario: read(&repository().join(SCENARIO))?, truth: model.clone(), belief: model })
}

fn models(campaign: &Campaign, run: u64) -> Result<(Scenario, Model, Model)> {
    let texts = campaign.texts(run).context("a run")?;
    let scenario = parse_scenario(&texts.scenario.text, &texts.scenario.file)?;
    let truth = parse_model(&texts.truth.text, &texts.truth.file)?;
    let belief = parse_model(&texts.belief.text, &texts.belief.file)?;
    Ok((scenario, truth, belief))
}

/// The command: its time in s, its largest resident memory in MB, and the bytes of its rows.
fn program(place: &Workplace, runs: u64, jobs: usize) -> Result<(f64, f64, u64)> {
    let (path, out) = (place.path("plan.toml"), place.path("campaign"));
    std::fs::write(&path, plan(runs, &[TRUTH, BELIEF].concat()))?;
    let mut command = place.stepvalve()?;
    command.arg("campaign").arg(&path).arg("--out").arg(&out).args(["--jobs", &jobs.to_string()]);
    let taken = watched::run(&mut command)?;
    let row_bytes = std::fs::metadata(out.join("rows.log"))?.len();
    std::fs::remove_dir_all(&out)?;
    Ok((taken.wall_s, taken.memory_mb, row_bytes))
}
