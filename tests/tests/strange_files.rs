//! Files of strangers, damaged in any manner: each is read, or refused with exit code 2 and its name; nothing crashes, hangs
//! or takes all memory. 100 files; `STEPVALVE_STRANGE_FILES=1000` tries so many. The seed of each is printed with a failure.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "shared/packed.rs"]
mod packed;
#[path = "shared/changed.rs"]
mod shared;
#[path = "shared/tables.rs"]
mod tables;

use injection::SplitSeed;
use log_data::{Log, Run};
use nix::sys::resource::{UsageWho, getrusage};
use packed::mat_v5_packed_zeros;
use shared::changed;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};
use stepvalve_tests::{Finished, TestPlace, repository};
use tables::{mat_v5, mat_v73, npy};

/// Longer than any limit lets a file of this size be read, on a busy machine.
const HANGS: Duration = Duration::from_secs(120);
/// No process takes more, MB.
const MOST_MB: i64 = 1000;

/// A kind of file, and what is done with it.
struct Kind {
    name: &'static str,
    whole: Vec<Vec<u8>>,
    commands: &'static [&'static [&'static str]],
}

/// Runs a command to its end; `None` where it has none.
fn ended(place: &TestPlace, arguments: &[String]) -> Option<Finished> {
    let mut command = place.command("stepvalve");
    let mut child = command.args(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > HANGS {
            child.kill().unwrap();
            child.wait().unwrap();
            return None;
        }
        std::thread::sleep(Duration::from_millis(3));
    }
    Some(finished(child))
}

fn finished(mut child: Child) -> Finished {
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    Finished { code: child.wait().unwrap().code(), stdout: String::new(), stderr }
}

fn log(rows: usize) -> Log {
    let time_s: Vec<f64> = (0..rows).map(|k| 1e-3 * k as f64).collect();
    let angle_rad: Vec<f64> = time_s.iter().map(|t| (3.0 * t).sin()).collect();
    let torque_nm = angle_rad.iter().map(|angle| 1.5 * angle.signum()).collect();
    let run = Run { name: "a".to_owned(), time_s, angle_rad, torque_nm: Some(torque_nm), ..Run::default() };
    Log { title: "whole".to_owned(), runs: vec![run], ..Log::default() }
}

const IMPORT: &[&str] = &["import", "FILE", "--map", "time=row*0.001", "--map", "angle=c2", "--out", "OUT"];
const PREDICT: &[&str] = &["predict", "--log", "FILE", "--model", "MODEL", "--out", "OUT"];
const REPORT: &[&str] = &["report", "FILE", "--out", "OUT"];

fn kinds(place: &TestPlace) -> Vec<Kind> {
    let bytes = |fill: &dyn Fn(&Path)| {
        let path = place.path("whole");
        fill(&path);
        std::fs::read(path).unwrap()
    };
    let hdf5 = |rows| bytes(&|path| run_log::write_log(path, &log(rows)).unwrap());
    let line: Vec<f64> = (0..200).map(f64::from).collect();
    let arrays: [(&str, &[f64]); 3] = [("t", &line), ("x", &line), ("gain", &[35.0])];
    let text: String = (0..200).map(|k| format!("{k}\t{}\t\"x\"\n", 2 * k)).collect();
    let npy_bytes: Vec<u8> = line.iter().flat_map(|number| number.to_le_bytes()).collect();
    vec![
        Kind { name: "log.h5", whole: vec![hdf5(300), hdf5(20_000)], commands: &[PREDICT, REPORT] },
        Kind {
            name: "table.mat",
            whole: vec![mat_v5(&arrays), bytes(&|path| mat_v73(path, &arrays))],
            commands: &[IMPORT],
        },
        Kind { name: "table.csv", whole: vec![text.into_bytes()], commands: &[IMPORT] },
        Kind { name: "table.npy", whole: vec![npy("'<f8'", "(100, 2)", &npy_bytes)], commands: &[IMPORT] },
    ]
}

/// A copy with one bit turned, mostly where a file says how it is built; or damaged in any manner.
fn damaged(details: &mut SplitSeed, whole: &[Vec<u8>]) -> Vec<u8> {
    if details.whole(0, 3) == 0 {
        return changed(details, whole);
    }
    let mut bytes = whole[details.whole(0, whole.len() as u64) as usize].clone();
    for _ in 0..details.whole(1, 4) {
        let reach = if details.whole(0, 4) == 0 { bytes.len() } else { bytes.len().min(3000) };
        let at = details.whole(0, reach as u64) as usize;
        bytes[at] ^= 1 << details.whole(0, 8);
    }
    bytes
}

#[test]
fn damaged_files_are_read_or_refused() {
    let place = TestPlace::new();
    let count: u64 = std::env::var("STEPVALVE_STRANGE_FILES").map_or(100, |count| count.parse().unwrap());
    let (kinds, model) = (kinds(&place), repository().join("rt-config/models/rig.toml"));
    let (mut read, mut refused, mut crashed, mut longest) = (0, 0, 0, Duration::ZERO);
    for seed in 0..count {
        let mut details = SplitSeed::new(seed);
        let kind = &kinds[seed as usize % kinds.len()];
        let (file, out) = (place.path(kind.name), place.path("out"));
        std::fs::write(&file, damaged(&mut details, &kind.whole)).unwrap();
        let command = kind.commands[details.whole(0, kind.commands.len() as u64) as usize];
        let arguments: Vec<String> = command
            .iter()
            .map(|word| match *word {
                "FILE" => file.display().to_string(),
                "OUT" => out.display().to_string(),
                "MODEL" => model.display().to_string(),
                word => word.to_owned(),
            })
            .collect();
        let begun = Instant::now();
        let finished =
            ended(&place, &arguments).unwrap_or_else(|| panic!("seed {seed}, {}: no end", kind.name));
        longest = longest.max(begun.elapsed());
        let said = finished.stderr.trim();
        match finished.code {
            Some(0) => {
                std::fs::remove_file(&out).unwrap();
                read += 1;
            }
            Some(2) => {
                assert!(said.contains(kind.name), "seed {seed}: {said:?} doesn't name the file");
                assert!(!out.exists(), "seed {seed}: refused, and yet something was written");
                refused += 1;
                crashed += u64::from(said.contains("reader crashed") || said.contains("reading it takes"));
            }
            code => panic!("seed {seed}, {}: exit code {code:?}: {said}", kind.name),
        }
    }
    let most_mb = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap().max_rss() / 1024;
    println!(
        "{count} damaged files: {read} read, {refused} refused, {crashed} of them after their reader's crash or at its limit; \
         the longest took {:.2} s, the largest process {most_mb} MB",
        longest.as_secs_f64()
    );
    assert!(read > 0 && refused > 0, "this test sees both");
    assert!(most_mb < MOST_MB, "{most_mb} MB");
}

#[test]
fn what_unpacks_to_gigabytes_is_refused() {
    let place = TestPlace::new();
    let out = place.path("out");
    let import = |name: &str| {
        let file = place.path(name);
        let maps = ["--map", "time=row", "--map", "angle=c1", "--out", out.to_str().unwrap()];
        let finished = place.stepvalve(&[&["import", file.to_str().unwrap()], &maps[..]].concat());
        let finished = finished.expect_code(2);
        println!("{}", finished.stderr.trim());
        assert!(finished.stderr.contains(name), "{}", finished.stderr);
        assert!(!out.exists());
        finished.stderr
    };
    // 300 MB of one line, as holes in a file.
    let line = std::fs::File::create(place.path("line.csv")).unwrap();
    std::io::copy(&mut std::io::repeat(b'7').take(300 << 20), &mut &line).unwrap();
    assert!(import("line.csv").contains("line 1"));
    // 1.6 GB of zeros in a deflated dataset of a MAT file of v7.3.
    let file = hdf5::File::create(place.path("bomb.mat")).unwrap();
    let zeros = file.new_dataset::<f64>().chunk(1 << 20).deflate(9).shape(200 << 20).create("x").unwrap();
    zeros.write_slice(&vec![1.0; 1 << 20], 0..1 << 20).unwrap();
    drop(zeros);
    file.close().unwrap();
    assert!(import("bomb.mat").contains("at most"));
    // 560 MB of zeros in a compressed element of a MAT file of v5; a hundredth of that is read.
    mat_v5_packed_zeros(&place.path("packed.mat"), 70_000_000);
    let bytes = std::fs::metadata(place.path("packed.mat")).unwrap().len();
    assert!(bytes < 2_000_000, "{bytes} bytes are no thousandth");
    let said = import("packed.mat");
    assert!(said.contains("takes more than") && said.contains("unpacks to less"), "{said}");
    mat_v5_packed_zeros(&place.path("small.mat"), 700_000);
    let (small, read) = (place.path("small.mat"), place.path("small.h5"));
    let maps = ["--map", "time=row", "--map", "angle=x", "--out", read.to_str().unwrap()];
    place.stepvalve(&[&["import", small.to_str().unwrap()], &maps[..]].concat()).expect_code(0);
    // The same in a valve-log.
    run_log::write_log(&place.path("bomb.h5"), &log(10)).unwrap();
    let file = hdf5::File::open_rw(place.path("bomb.h5")).unwrap();
    let run = file.group("runs/a").unwrap();
    run.unlink("torque").unwrap();
    let torque =
        run.new_dataset::<f64>().chunk(1 << 20).deflate(9).shape(200 << 20).create("torque").unwrap();
    let unit: hdf5::types::VarLenUnicode = "N*m".parse().unwrap();
    torque.new_attr::<hdf5::types::VarLenUnicode>().create("unit").unwrap().write_scalar(&unit).unwrap();
    drop((run, torque));
    file.close().unwrap();
    let model = repository().join("rt-config/models/rig.toml");
    let log = place.path("bomb.h5");
    let arguments = ["predict", "--log", log.to_str().unwrap(), "--model", model.to_str().unwrap()];
    let finished =
        place.stepvalve(&[&arguments[..], &["--out", out.to_str().unwrap()]].concat()).expect_code(2);
    println!("{}", finished.stderr.trim());
    assert!(
        finished.stderr.contains("bomb.h5") && finished.stderr.contains("at most"),
        "{}",
        finished.stderr
    );
    let most_mb = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap().max_rss() / 1024;
    assert!(most_mb < MOST_MB, "{most_mb} MB");
}
