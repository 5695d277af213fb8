//! `stepvalve campaign` as its users meet it: killed, resumed, cut into shards, given wrong plans; the table is always the same.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use injection::SplitSeed;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, SystemTime};
use stepvalve_tests::{Finished, TestPlace, repository};

/// What a plan says before its design; the scenario is one of the place.
fn head(scenario: &Path) -> String {
    format!(
        "format = \"stepvalve-campaign\"\nformat_version = 1\nname = \"test\"\nscenarios = [\"{}\"]\n",
        scenario.file_name().unwrap().to_str().unwrap()
    )
}

/// Forty runs; about one in six draws a torque below zero, which no valve has.
const FORTY: &str = "[design]\nkind = \"latin-hypercube\"\nruns = 40\nseed = 3\n\
    [[vary]]\npath = \"truth.friction.coulomb_torque_nm\"\nnormal = { mean = 1.0, sd = 1.0 }\n\
    [[vary]]\npath = \"scenario.compensation.level\"\nvalues = [\"none\", \"full\"]\n";

/// A plan over a sine of this length, in a place of its own.
fn plan(place: &TestPlace, duration_s: f64, rest: &str) -> PathBuf {
    let scenario = place.shortened("sine-1hz.toml", duration_s, &[]);
    place.write("plan.toml", &(head(&scenario) + rest))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn campaign(place: &TestPlace, plan: &Path, out: &str, more: &[&str]) -> Finished {
    place.stepvalve(&[&["campaign", text(plan), "--out", text(&place.path(out))], more].concat())
}

fn start(place: &TestPlace, plan: &Path, out: &str, more: &[&str]) -> Child {
    let mut command = place.command("stepvalve");
    command.args(["campaign", text(plan), "--out"]).arg(place.path(out)).args(more);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn table(place: &TestPlace, out: &str) -> Vec<u8> {
    std::fs::read(place.path(out).join("campaign.h5")).unwrap()
}

fn texts(file: &hdf5::File, name: &str) -> Vec<String> {
    let texts =
        file.dataset(&format!("rows/{name}")).unwrap().read_raw::<hdf5::types::VarLenUnicode>().unwrap();
    texts.iter().map(ToString::to_string).collect()
}

fn numbers(file: &hdf5::File, name: &str) -> Vec<f64> {
    file.dataset(&format!("rows/{name}")).unwrap().read_raw().unwrap()
}

#[test]
fn killed_and_resumed_the_table_is_the_same() {
    let seed = std::env::var("STEPVALVE_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok())
        .unwrap_or_else(|| SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs());
    println!("seed {seed}: STEPVALVE_SEED repeats its moments");
    let mut random = SplitSeed::new(seed);
    let place = TestPlace::new();
    let plan = plan(&place, 5.0, FORTY);
    campaign(&place, &plan, "whole", &[]).expect_code(0);
    let whole = table(&place, "whole");
    let (mut kills, mut in_the_middle) = (0, 0);
    while kills < 20 {
        let out = format!("killed-{kills}");
        for _ in 0..5 {
            let mut child = start(&place, &plan, &out, &["--resume"]);
            std::thread::sleep(Duration::from_millis(random.whole(20, 170)));
            child.kill().unwrap();
            child.wait().unwrap();
            kills += 1;
            in_the_middle += usize::from(!place.path(&out).join("campaign.h5").exists());
        }
        campaign(&place, &plan, &out, &["--resume"]).expect_code(0);
        assert!(table(&place, &out) == whole, "seed {seed}, {out}: another table");
    }
    assert!(in_the_middle > 0, "seed {seed}: every kill came too late");
}

#[test]
fn shards_and_threads_make_the_same_table() {
    let place = TestPlace::new();
    let plan = plan(&place, 0.5, FORTY);
    campaign(&place, &plan, "one", &["--jobs", "1"]).expect_code(0);
    campaign(&place, &plan, "two", &["--jobs", "2"]).expect_code(0);
    let one = table(&place, "one");
    assert!(one == table(&place, "two"), "1 and 2 threads");
    for shard in ["1/3", "2/3", "3/3"] {
        let out = format!("shard-{}", &shard[..1]);
        let finished = campaign(&place, &plan, &out, &["--shard", shard]).expect_code(0);
        assert!(
            finished.stdout.contains(&format!("all runs of shard {shard} are made")),
            "{}",
            finished.stdout
        );
        assert!(!place.path(&out).join("campaign.h5").exists());
    }
    let shard = |number: u32| place.path(&format!("shard-{number}"));
    let merge = |shards: &[PathBuf], out: &str| {
        let shards: Vec<&str> = shards.iter().map(|shard| text(shard)).collect();
        place.stepvalve(&[&["campaign", "merge"], &shards[..], &["--out", text(&place.path(out))]].concat())
    };
    let some = merge(&[shard(1), shard(3)], "some").expect_code(2);
    assert!(
        some.stderr.contains("found 27 of 40 runs, expected all: runs 1, 4, 7, 10, 13, … are missing"),
        "{}",
        some.stderr
    );
    assert!(!place.path("some").exists());
    // In any order, and one of them twice.
    merge(&[shard(3), shard(1), shard(2), shard(1)], "merged").expect_code(0);
    assert!(one == table(&place, "merged"), "three shards");
    assert!(place.path("merged/campaign.html").exists());
}

#[test]
fn what_can_not_be_simulated_is_a_row() {
    let place = TestPlace::new();
    let plan = plan(&place, 0.5, FORTY);
    let finished = campaign(&place, &plan, "out", &[]).expect_code(0);
    let file = hdf5::File::open(place.path("out/campaign.h5")).unwrap();
    let (outcomes, reasons) = (texts(&file, "outcome"), texts(&file, "reason"));
    let torques = numbers(&file, "truth.friction.coulomb_torque_nm");
    let errors = numbers(&file, "following_error_rms");
    assert_eq!(numbers(&file, "run"), (0..40).map(f64::from).collect::<Vec<_>>());
    let failed = torques.iter().filter(|torque| **torque <= 0.0).count();
    assert!((1..20).contains(&failed), "{failed}");
    assert!(finished.stdout.contains("that failed by themselves"), "{}", finished.stdout);
    for (run, torque) in torques.iter().enumerate() {
        assert_eq!(
            outcomes[run],
            if *torque > 0.0 && *torque <= 3.0 { "done" } else { "not simulated" },
            "{torque}"
        );
        assert_eq!(errors[run].is_nan(), outcomes[run] != "done");
        assert_eq!(reasons[run].contains("rig.toml:"), outcomes[run] != "done", "{}", reasons[run]);
    }
}

#[test]
fn a_limit_of_failures_ends_it() {
    let place = TestPlace::new();
    let plan = plan(&place, 0.5, &("failure_limit = 2\n".to_owned() + FORTY));
    let finished = campaign(&place, &plan, "out", &["--jobs", "1"]).expect_code(1);
    let expected = "found 3 runs that failed, expected at most 2 (failure_limit); run ";
    assert!(finished.stderr.contains(expected), "{}", finished.stderr);
    assert!(place.path("out/rows.log").exists() && !place.path("out/campaign.h5").exists());
}

#[test]
fn a_merge_counts_failures_too() {
    let place = TestPlace::new();
    // One fewer than fail: no shard alone has too many.
    let all = plan(&place, 0.5, FORTY);
    campaign(&place, &all, "all", &[]).expect_code(0);
    let outcomes = texts(&hdf5::File::open(place.path("all/campaign.h5")).unwrap(), "outcome");
    let limit = outcomes.iter().filter(|outcome| *outcome != "done").count() - 1;
    assert!(limit > 1, "{outcomes:?}");
    let plan = plan(&place, 0.5, &format!("failure_limit = {limit}\n{FORTY}"));
    for shard in ["1/2", "2/2"] {
        campaign(&place, &plan, &format!("part-{}", &shard[..1]), &["--shard", shard]).expect_code(0);
    }
    let parts = ["part-1", "part-2"].map(|part| text(&place.path(part)).to_owned());
    let merge = |out: &str| place.stepvalve(&["campaign", "merge", &parts[0], &parts[1], "--out", out]);
    let finished = merge(text(&place.path("whole"))).expect_code(1);
    assert!(
        finished.stderr.contains(&format!("expected at most {limit} (failure_limit); run ")),
        "{}",
        finished.stderr
    );
    // A shard by another spelling is a shard all the same.
    let rows = std::fs::read(place.path("part-1/rows.log")).unwrap();
    let finished = merge(&format!("{}/../part-1", parts[0])).expect_code(2);
    assert!(finished.stderr.contains("among the shards"), "{}", finished.stderr);
    assert!(std::fs::read(place.path("part-1/rows.log")).unwrap() == rows);
}

#[test]
fn a_campaign_of_failures_alone_is_no_result() {
    let place = TestPlace::new();
    // Each is possible beside the model's other number, and no two of them are.
    let fails = "[design]\nkind = \"latin-hypercube\"\nruns = 4\n\
        [[vary]]\npath = \"truth.friction.coulomb_torque_nm\"\nrange = [2.5, 2.9]\n\
        [[vary]]\npath = \"truth.friction.static_torque_nm\"\nrange = [1.6, 2.0]\n";
    let plan = plan(&place, 0.5, fails);
    let finished = campaign(&place, &plan, "out", &[]).expect_code(1);
    assert!(finished.stderr.contains("found that all 4 runs failed"), "{}", finished.stderr);
    assert!(place.path("out/campaign.html").exists());
}

#[test]
fn rows_that_are_gone_cost_no_table() {
    let place = TestPlace::new();
    let plan = plan(&place, 0.5, FORTY);
    campaign(&place, &plan, "out", &[]).expect_code(0);
    let before = table(&place, "out");
    std::fs::remove_file(place.path("out/rows.log")).unwrap();
    for more in [&["--resume"][..], &[]] {
        let finished = campaign(&place, &plan, "out", more).expect_code(2);
        assert!(finished.stderr.contains("campaign.h5"), "{}", finished.stderr);
        assert!(table(&place, "out") == before);
        assert!(!place.path("out/rows.log").exists());
    }
    // Nor are runs that another campaign kept taken for this one's.
    std::fs::create_dir_all(place.path("other/kept/run-00001")).unwrap();
    let finished = campaign(&place, &plan, "other", &["--keep", "worst=2"]).expect_code(2);
    assert!(finished.stderr.contains("holds recorded runs"), "{}", finished.stderr);
}

#[test]
fn one_process_writes_and_an_interruption_keeps_all_rows() {
    let place = TestPlace::new();
    let many = FORTY.replace("runs = 40", "runs = 4000");
    let plan = plan(&place, 5.0, &many);
    let child = start(&place, &plan, "out", &[]);
    place.wait_for("rows", || {
        std::fs::metadata(place.path("out/rows.log")).ok().filter(|log| log.len() > 20_000)
    });
    let second = campaign(&place, &plan, "out", &["--resume"]).expect_code(2);
    assert!(second.stderr.contains("another campaign writes to it"), "{}", second.stderr);
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(child.id() as i32), nix::sys::signal::Signal::SIGINT)
        .unwrap();
    let finished = Finished::from(child.wait_with_output().unwrap()).expect_code(130);
    assert!(finished.stdout.contains("of 4000 runs are in "), "{}", finished.stdout);
    assert!(finished.stdout.contains("--resume goes on"), "{}", finished.stdout);
    // Nothing is begun anew by mistake.
    let again = campaign(&place, &plan, "out", &[]).expect_code(2);
    assert!(
        again.stderr.contains("rows.log exists: --resume goes on with it, --force begins anew"),
        "{}",
        again.stderr
    );
}

#[test]
fn another_campaign_is_not_gone_on_with() {
    let place = TestPlace::new();
    let plan = plan(&place, 0.5, FORTY);
    campaign(&place, &plan, "out", &[]).expect_code(0);
    let before = table(&place, "out");
    let refused = |says: &str| {
        let finished = campaign(&place, &plan, "out", &["--resume"]).expect_code(2);
        assert!(
            finished.stderr.contains("found rows of another campaign: changed since: "),
            "{}",
            finished.stderr
        );
        assert!(finished.stderr.contains(says), "{}", finished.stderr);
        assert!(table(&place, "out") == before);
    };
    let original = std::fs::read_to_string(&plan).unwrap();
    std::fs::write(&plan, original.replace("seed = 3", "seed = 4")).unwrap();
    refused("the plan ");
    std::fs::write(&plan, &original).unwrap();
    let scenario = place.path("scenario-sine-1hz.toml");
    let text = std::fs::read_to_string(&scenario).unwrap();
    std::fs::write(&scenario, text.replace("2MPa", "3MPa")).unwrap();
    refused("the scenario scenario-sine-1hz.toml, line ");
    std::fs::write(&scenario, text).unwrap();
    // A log of another version, and one that is none.
    let log = place.path("out/rows.log");
    let mut bytes = std::fs::read(&log).unwrap();
    std::fs::write(&log, "something else").unwrap();
    let finished = campaign(&place, &plan, "out", &["--resume"]).expect_code(2);
    assert!(
        finished.stderr.contains("rows.log: found something else than a campaign's rows"),
        "{}",
        finished.stderr
    );
    // A flipped bit costs its row, which is made again.
    let place_of_flip = bytes.len() - 1000;
    bytes[place_of_flip] ^= 4;
    std::fs::write(&log, &bytes).unwrap();
    // What changes no row may change.
    std::fs::write(
        &plan,
        format!("# again\n{}", original.replace("[design]", "failure_limit = 39\n[design]")),
    )
    .unwrap();
    let finished = campaign(&place, &plan, "out", &["--resume"]).expect_code(0);
    std::fs::write(&plan, &original).unwrap();
    campaign(&place, &plan, "out", &["--resume"]).expect_code(0);
    assert!(
        finished.stderr.contains("bytes are no whole row; their runs are made again"),
        "{}",
        finished.stderr
    );
    assert!(table(&place, "out") == before);
}

#[test]
fn runs_are_recorded_on_demand() {
    let place = TestPlace::new();
    let plan = plan(&place, 0.5, FORTY);
    campaign(&place, &plan, "out", &["--keep", "worst=12"]).expect_code(0);
    let file = hdf5::File::open(place.path("out/campaign.h5")).unwrap();
    let (outcomes, errors) = (texts(&file, "outcome"), numbers(&file, "following_error_rms"));
    let kept: Vec<PathBuf> =
        std::fs::read_dir(place.path("out/kept")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(kept.len(), 12, "{kept:?}");
    let number = |path: &Path| path.to_str().unwrap().rsplit('-').next().unwrap().parse::<usize>().unwrap();
    let recorded: Vec<usize> =
        kept.iter().map(|path| number(path)).filter(|run| outcomes[*run] == "done").collect();
    assert!(!recorded.is_empty() && recorded.len() < 12, "{recorded:?}");
    for run in kept.iter().filter(|path| recorded.contains(&number(path))) {
        let files = ["run-0001.mcap", "run.h5", "run.html", "scenario.toml", "truth.toml", "belief.toml"];
        assert!(files.iter().all(|file| run.join(file).exists()), "{}", run.display());
    }
    // The record of a run is that of its row, whoever makes it.
    let run = recorded[0];
    let only = campaign(&place, &plan, "only", &["--only", &run.to_string()]).expect_code(0);
    let degrees = format!("RMS {:.5}°", errors[run].to_degrees());
    assert!(only.stdout.contains(&degrees), "{degrees} is not in {}", only.stdout);
    let record = |folder: PathBuf| std::fs::read(folder.join("run.h5")).unwrap();
    let kept = place.path(&format!("out/kept/run-{run:05}"));
    assert!(record(place.path("only")) == record(kept), "another record");
    campaign(&place, &plan, "none", &["--only", "40"]).expect_code(2);
    let forced = campaign(&place, &plan, "out", &["--force"]).expect_code(2);
    assert!(
        forced.stderr.contains("kept holds recorded runs, which are never overwritten"),
        "{}",
        forced.stderr
    );
}

/// The diagnosis in a row is that of `stepvalve diagnose` of the same run's record.
#[test]
fn a_row_s_diagnosis_is_that_of_its_record() {
    let place = TestPlace::new();
    let rest = "task = \"both\"\n[design]\nkind = \"grid\"\n[[vary]]\npath = \"truth.friction.viscous_nm_s_per_rad\"\n\
                as = \"factor\"\nvalues = [1, 40]\n";
    let plan = plan(&place, 2.0, rest);
    campaign(&place, &plan, "out", &["--keep", "worst=2"]).expect_code(0);
    let file = hdf5::File::open(place.path("out/campaign.h5")).unwrap();
    let (verdicts, causes) = (texts(&file, "verdict"), texts(&file, "causes"));
    for run in 0..2 {
        let kept = place.path(&format!("out/kept/run-{run:05}"));
        let out = place.path(&format!("found-{run}"));
        let (log, model) = (kept.join("run.h5"), kept.join("belief.toml"));
        let arguments = ["diagnose", "--log", text(&log), "--model", text(&model), "--out", text(&out)];
        place.stepvalve(&arguments).expect_code(0);
        let json = std::fs::read_to_string(out.join("diagnosis.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json["verdict"], verdicts[run].as_str());
        let named: Vec<&str> =
            json["causes"].as_array().unwrap().iter().map(|of| of["id"].as_str().unwrap()).collect();
        assert_eq!(named.join(", "), causes[run]);
    }
    println!("{verdicts:?} {causes:?}");
}

/// A plan that is wrong, by what stands in it and what is said.
#[test]
fn wrong_plans() {
    let vary = |text: &str| format!("[design]\nkind = \"random\"\nruns = 2\n[[vary]]\n{text}\n");
    let cases: Vec<(String, &str)> = vec![
        (String::new(), "1:1: design: found nothing, expected a section [design]"),
        (
            "[design]\nkind = \"sobol\"\n".into(),
            "5:1: design.runs: found nothing, expected a whole number from 1 to 65536",
        ),
        (
            "[design]\nkind = \"sobol\"\nruns = 70000\n".into(),
            "7:8: design.runs: found 70000, expected a whole number from 1 to 65536",
        ),
        (
            "[design]\nkind = \"hypercube\"\nruns = 2\n".into(),
            "6:8: design.kind: found hypercube, expected \"grid\" or",
        ),
        (
            "[design]\nkind = \"grid\"\nruns = 2\n".into(),
            "7:8: design.runs: found 2, expected no `runs` in a grid",
        ),
        (
            "task = \"both\"\nfailure_limit = \"x\"\n[design]\nkind = \"grid\"\n".into(),
            "6:17: failure_limit: found x, expected a whole number of runs, or a share",
        ),
        (
            "tsk = \"both\"\n[design]\nkind = \"grid\"\n".into(),
            "5:1: tsk: found an unknown key, expected task (did you mean it?)",
        ),
        (
            vary("path = \"truth.friction.coulomb_nm\"\nrange = [1, 2]"),
            "9:8: vary.path: found truth.friction.coulomb_nm, which ",
        ),
        (
            vary("path = \"plant.friction.law\"\nrange = [1, 2]"),
            "9:8: vary[0].path: found plant.friction.law, expected a path into truth, belief or scenario",
        ),
        (
            vary("path = \"truth.load.inertia_kg_m2\""),
            "8:1: vary[0]: found none of them, expected one of values, range, log or normal",
        ),
        (
            vary("path = \"truth.load.inertia_kg_m2\"\nrange = [2, 1]"),
            "10:13: vary[0].range[1]: found 1, expected more than 2",
        ),
        (vary("path = \"truth.load.inertia_kg_m2\"\nlog = [0, 1]"), "10:7: vary[0].log: found"),
        (
            vary("path = \"truth.load.inertia_kg_m2\"\nrange = [\"1MPa\", \"2bar\"]"),
            "10:9: vary[0].range: found",
        ),
        (
            vary("path = \"truth.load.inertia_kg_m2\"\nnormal = { mean = 1, sd = 0 }"),
            "10:27: vary[0].normal.sd: found 0, expected a number above zero",
        ),
        (
            vary("path = \"truth.load.inertia_kg_m2\"\nas = \"factor\"\nvalues = [\"1kg\"]"),
            "11:11: vary[0].values[0]: found 1kg, expected a number without a unit",
        ),
        (
            vary("path = \"truth.load.inertia_kg_m2\"\nrange = [1, 2]\nlevels = 3"),
            "11:10: vary[0].levels: found 3, expected `levels` only in a grid",
        ),
        (
            "[design]\nkind = \"grid\"\n[[vary]]\npath = \"truth.load.inertia_kg_m2\"\nrange = [1, 2]".into(),
            "7:1: vary[0].levels: found nothing, expected how many values",
        ),
        (
            vary("path = \"scenario.truth\"\nvalues = [\"a.toml\"]"),
            "9:8: vary[0].path: found scenario.truth, expected a value: for other models, list several scenarios",
        ),
    ];
    let place = TestPlace::new();
    for (rest, says) in cases {
        let plan = plan(&place, 0.5, &rest);
        let finished = campaign(&place, &plan, "out", &[]).expect_code(2);
        assert!(finished.stderr.contains(says), "{rest}\nexpected: {says}\nfound: {}", finished.stderr);
        assert!(finished.stderr.contains("plan.toml:"), "{}", finished.stderr);
        assert!(!place.path("out").exists(), "{rest}");
    }
    let plan = place.write("plan.toml", &head(Path::new("none.toml")));
    let finished = campaign(&place, &plan, "out", &[]).expect_code(2);
    assert!(finished.stderr.contains("[design]"), "{}", finished.stderr);
    let plan = place.write("plan.toml", &(head(Path::new("none.toml")) + "[design]\nkind = \"grid\"\n"));
    let finished = campaign(&place, &plan, "out", &[]).expect_code(2);
    assert!(finished.stderr.contains("plan.toml:4:14: scenarios: "), "{}", finished.stderr);
}

#[test]
fn the_shipped_plan_is_good() {
    let place = TestPlace::new();
    let plan = repository().join("rt-config/campaigns/friction.toml");
    let finished = place.stepvalve(&["check", text(&plan)]).expect_code(0);
    assert!(
        finished.stdout.contains("campaign \"friction unlike the belief\", 256 runs: good"),
        "{}",
        finished.stdout
    );
}

/// In place of Slurm: runs the tasks of an array one after the other, and any other job at once.
const SBATCH: &str = r#"#!/bin/sh
array=
for option in "$@"; do
    case $option in
    --array=1-*) array=${option#--array=1-} ;;
    --wrap=*) wrap=${option#--wrap=} ;;
    esac
done
if [ -z "$array" ]; then
    sh -c "$wrap" >&2 && echo 12
    exit
fi
for SLURM_ARRAY_TASK_ID in $(seq "$array"); do
    export SLURM_ARRAY_TASK_ID
    sh -c "$wrap" >&2 || exit 1
done
echo 11
"#;

#[test]
fn a_slurm_array_makes_the_same_table() {
    let place = TestPlace::new();
    let plan = plan(&place, 0.5, FORTY);
    campaign(&place, &plan, "plain", &[]).expect_code(0);
    let sbatch = place.write("sbatch", SBATCH);
    std::fs::set_permissions(&sbatch, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", sbatch.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let stepvalve = place.command("stepvalve").get_program().to_owned();
    let send = |arguments: &[&str]| {
        let mut command = std::process::Command::new(repository().join("tools/campaign_slurm"));
        command.args(arguments).env("PATH", &path).env("STEPVALVE", &stepvalve).env("LC_ALL", "C");
        Finished::from(command.output().unwrap())
    };
    let out = place.path("a folder's name with \u{fc} and 100%a");
    let sent = send(&[text(&plan), text(&out), "3", "--time=1"]).expect_code(0);
    assert!(
        sent.stdout.contains("array 11: 3 shards") && sent.stdout.contains("job 12 merges"),
        "{}",
        sent.stdout
    );
    assert!(std::fs::read(out.join("whole/campaign.h5")).unwrap() == table(&place, "plain"));
    for (arguments, says) in [
        (&[text(&plan), text(&out), "3"][..], "exists, expected another folder"),
        (&[text(&plan), "new", "0"], "expected a number from 1"),
        (&[text(&plan), "new", "many"], "expected a number from 1"),
        (&["no.toml", "new", "2"], "found no no.toml"),
        (&[text(&plan)], "usage:"),
    ] {
        let refused = send(arguments).expect_code(2);
        assert!(refused.stderr.contains(says), "{}", refused.stderr);
    }
    std::fs::remove_dir_all(out.join("whole")).unwrap();
    let refused = send(&[text(&plan), text(&out), "4"]).expect_code(2);
    assert!(refused.stderr.contains("found 3 shards"), "{}", refused.stderr);
}
