//! `stepvalve import`: what people's tables hold becomes a valve-log; what is wrong in them is named with its place.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{AngleZero, Log};
use std::path::Path;
use stepvalve_tests::{Finished, TestPlace, measured_data};

/// Runs `import` with `out.h5` as the output.
fn import(place: &TestPlace, arguments: &[&str]) -> Finished {
    let out = place.path("out.h5");
    place.stepvalve(&[&["import", "--out", out.to_str().unwrap()], arguments].concat())
}

fn imported(place: &TestPlace, arguments: &[&str]) -> Log {
    import(place, arguments).expect_code(0);
    run_log::read_log(&place.path("out.h5")).unwrap()
}

/// Refused with exit code 2, naming all of `says`; nothing written.
#[track_caller]
fn refused(place: &TestPlace, arguments: &[&str], says: &[&str]) {
    let finished = import(place, arguments).expect_code(2);
    for part in says {
        assert!(finished.stderr.contains(part), "{part:?} is not in: {}", finished.stderr);
    }
    let names = std::fs::read_dir(place.path("")).unwrap().flatten().map(|entry| entry.file_name());
    let left: Vec<_> = names.filter(|name| name.to_string_lossy().contains("out")).collect();
    assert!(left.is_empty(), "left: {left:?}");
}

const MAPS: [&str; 4] = ["--map", "time=c1*1e-3", "--map", "angle=c2/10"];

#[test]
fn texts_of_every_kind() {
    let cases = [
        ("tabs", "0\t1.5\n10\t2.5\n", &[][..]),
        ("commas, with names", "t,x\n0,1.5\n10,2.5\n", &[][..]),
        (
            "Windows line ends, a byte order mark, comments",
            "\u{feff}t;x\r\n# a remark\r\n0;1.5\r\n10;2.5\r\n",
            &[][..],
        ),
        ("spaces", "  0   1.5\n 10   2.5\n\n", &[][..]),
        ("decimal commas", "0;1,5\n10;2,5\n", &["--decimal-comma"][..]),
    ];
    for (what, text, more) in cases {
        let place = TestPlace::new();
        let file = place.write("given.csv", text);
        let log = imported(&place, &[&[file.to_str().unwrap()], &MAPS[..], more].concat());
        assert_eq!(log.runs[0].time_s, [0.0, 0.01], "{what}");
        assert_eq!(log.runs[0].angle_rad, [0.15, 0.25], "{what}");
    }
}

#[test]
fn several_files_names_kinds_rows_and_one_clock() {
    let place = TestPlace::new();
    let table: String =
        (0..10).map(|k| format!("{k},{},{}\n", 2 * k, if k == 4 { "" } else { "7" })).collect();
    let one = place.write("one.csv", &format!("t,x [mm],F\n{table}"));
    let two = place.write("two.csv", &format!("t,x [mm],F\n{table}"));
    let files = [one.to_str().unwrap(), two.to_str().unwrap()];
    let maps =
        ["--map", "time=t", "--map", "angle={x [mm]}*pi", "--map", "torque=F*0.5", "--map", "force[N]=F"];
    let more = ["--kind", "sine", "--kind", "dwell", "--run", "first", "--run", "second"];
    let rest = ["--gap", "5", "--rows", "2..6", "--angle-zero", "per-run", "--title", "Two tables"];
    let log = imported(&place, &[&files[..], &maps, &more, &rest].concat());
    assert_eq!((log.title.as_str(), log.angle_zero), ("Two tables", AngleZero::PerRun));
    let (first, second) = (log.run("first").unwrap(), log.run("second").unwrap());
    assert_eq!((first.kind.as_str(), second.kind.as_str()), ("sine", "dwell"));
    assert_eq!(first.time_s, [1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(second.time_s, [10.0, 11.0, 12.0, 13.0, 14.0]);
    assert!((first.angle_rad[0] - 2.0 * std::f64::consts::PI).abs() < 1e-12);
    let torque = first.torque_nm.as_ref().unwrap();
    assert!(torque[3].is_nan() && torque[2] == 3.5, "an empty cell is a missing sample: {torque:?}");
    assert_eq!(first.extra("force").unwrap().unit, "N");
    assert!(log.provenance.unwrap().contains("torque=F*0.5"));
}

#[test]
fn wrong_texts_are_refused_with_their_place() {
    let cases: [(&str, &[&str]); 7] = [
        ("t,x\n0,1\n1,word\n", &["given.csv", "line 3", "column 2 (x)", "\"word\""]),
        ("t,x\n0,1\n1\n", &["line 3", "1 columns, expected 2"]),
        ("t,x\n0,1\n0,2\n", &["line 3", "time is 0 s after 0 s"]),
        ("t,x\n0,1\n,2\n", &["line 3", "time is NaN"]),
        ("t,x\n0,1\n1,inf\n", &["line 3", "angle", "inf"]),
        ("t,x\n", &["no row"]),
        ("", &["empty"]),
    ];
    for (text, says) in cases {
        let place = TestPlace::new();
        let file = place.write("given.csv", text);
        refused(&place, &[&[file.to_str().unwrap()], &MAPS[..]].concat(), says);
    }
    let place = TestPlace::new();
    let file = place.write("given.csv", "t,x\n0,1\n");
    let file = file.to_str().unwrap();
    refused(&place, &[file, "--map", "time=t", "--map", "angle=y"], &["no column \"y\"", "t, x"]);
    refused(&place, &[file, "--map", "time=t"], &["--map angle"]);
    refused(&place, &[file, "--map", "time=t", "--map", "speed=x"], &["speed", "NAME[UNIT]"]);
    refused(&place, &[file, "--map", "time=t", "--map", "angle=x*("], &["no expression"]);
    refused(&place, &[&[file, "--run", "a", "--run", "b"], &MAPS[..]].concat(), &["--run", "expected 1"]);
    refused(&place, &[&["missing.csv"], &MAPS[..]].concat(), &["missing.csv"]);
    let binary = place.path("given.bin");
    std::fs::write(&binary, [0, 1, 2, 0, 255]).unwrap();
    refused(&place, &[&[binary.to_str().unwrap()], &MAPS[..]].concat(), &["not a text"]);
}

/// A MAT file of v5 without compression, as MATLAB's `save -v6` writes it.
fn mat_v5(arrays: &[(&str, &[f64])]) -> Vec<u8> {
    let element = |kind: u32, data: &[u8]| {
        let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().div_ceil(8) * 8, 0);
        bytes
    };
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0, 1, b'I', b'M']);
    for (name, values) in arrays {
        let numbers: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let flags = [6u32.to_le_bytes(), 0u32.to_le_bytes()].concat();
        let shape = [(values.len() as i32).to_le_bytes(), 1i32.to_le_bytes()].concat();
        let inner =
            [element(6, &flags), element(5, &shape), element(1, name.as_bytes()), element(9, &numbers)];
        file.extend(element(14, &inner.concat()));
    }
    file
}

/// A MAT file of v7.3: HDF5 behind a header of 512 bytes, arrays transposed.
fn mat_v73(path: &Path, arrays: &[(&str, &[f64])]) {
    let mut options = hdf5::File::with_options();
    let file = options.with_fcpl(|create| create.userblock(512)).create(path).unwrap();
    for (name, values) in arrays {
        let dataset = file.new_dataset::<f64>().shape((1, values.len())).create(*name).unwrap();
        dataset.write_raw(*values).unwrap();
    }
    file.close().unwrap();
    let mut bytes = std::fs::read(path).unwrap();
    let mut head = b"MATLAB 7.3 MAT-file".to_vec();
    head.resize(124, b' ');
    head.extend([0, 2, b'I', b'M']);
    bytes[..128].copy_from_slice(&head);
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn mat_files_of_both_kinds_and_cut_ones() {
    let time: Vec<f64> = (0..50).map(|k| 1e-3 * f64::from(k)).collect();
    let motor: Vec<f64> = time.iter().map(|t| t.sin()).collect();
    let arrays: [(&str, &[f64]); 3] = [("t", &time), ("qm", &motor), ("gain", &[35.0])];
    for kind in ["v5", "v7.3"] {
        let place = TestPlace::new();
        let file = place.path("given.mat");
        match kind {
            "v5" => std::fs::write(&file, mat_v5(&arrays)).unwrap(),
            _ => mat_v73(&file, &arrays),
        }
        let maps = ["--map", "time=t", "--map", "angle=qm*2", "--map", "torque=gain*qm"];
        let log = imported(&place, &[&[file.to_str().unwrap()], &maps[..]].concat());
        let run = &log.runs[0];
        assert_eq!((run.name.as_str(), run.len()), ("given", 50), "{kind}");
        assert!((run.angle_rad[20] - 2.0 * motor[20]).abs() < 1e-15, "{kind}");
        assert!((run.torque_nm.as_ref().unwrap()[20] - 35.0 * motor[20]).abs() < 1e-12, "{kind}");
        std::fs::remove_file(place.path("out.h5")).unwrap();
        let whole = std::fs::read(&file).unwrap();
        for part in [1, 3, 5, 7] {
            let cut = place.path("cut.mat");
            std::fs::write(&cut, &whole[..whole.len() * part / 8]).unwrap();
            refused(&place, &[&[cut.to_str().unwrap()], &maps[..]].concat(), &["cut.mat"]);
        }
    }
}

#[test]
fn what_is_no_mat_file() {
    let place = TestPlace::new();
    for (bytes, says) in [(&b"short"[..], "5 bytes"), (&[7u8; 4000][..], "MATLAB")] {
        let file = place.path("given.mat");
        std::fs::write(&file, bytes).unwrap();
        refused(&place, &[&[file.to_str().unwrap()], &MAPS[..]].concat(), &["given.mat", says]);
    }
}

#[test]
fn a_record_of_a_drive() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let file = data.join("emps/DATA_EMPS.mat");
    let maps = ["--map", "time=t", "--map", "angle=qm*2*pi/0.0025", "--map", "torque=gtau*vir*0.0025/(2*pi)"];
    let log = imported(&place, &[&[file.to_str().unwrap()], &maps[..]].concat());
    let run = &log.runs[0];
    assert_eq!(run.len(), 24_841);
    assert!((run.end_s() - run.start_s() - 24.84).abs() < 1e-6, "{}", run.end_s());
    // Some 0.24 m of travel on a screw of 2.5 mm pitch, under some tens of newtons.
    let turns = run.angle_rad.iter().fold(0.0, |most: f64, angle| most.max(*angle)) / std::f64::consts::TAU;
    assert!((80.0..110.0).contains(&turns), "{turns} turns");
    let most = run.torque_nm.as_ref().unwrap().iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
    assert!((0.01..0.2).contains(&most), "{most} N*m");
}

#[test]
fn records_of_a_seal() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let mut files: Vec<_> =
        std::fs::read_dir(data.join("seal-friction")).unwrap().flatten().map(|f| f.path()).collect();
    files.sort();
    let files: Vec<&str> = files.iter().map(|file| file.to_str().unwrap()).collect();
    let maps = ["--map", "time=c1/1000", "--map", "angle=c5/12.5", "--map", "torque=c7*0.0125"];
    let more = ["--map", "pressure_drop=c6*1e5", "--gap", "60", "--kind", "constant-velocity"];
    let log = imported(&place, &[&files[..], &maps, &more].concat());
    assert_eq!(log.runs.len(), 8);
    assert_eq!(log.runs.iter().map(log_data::Run::len).sum::<usize>(), 54_016);
    assert!(log.is_on_one_clock());
    let run = log.run("1_O-ring257_5bar").unwrap();
    let pressure = run.pressure_drop_pa.as_ref().unwrap();
    let mean = pressure.iter().sum::<f64>() / pressure.len() as f64;
    assert!((4.8e5..5.2e5).contains(&mean), "{mean} Pa");
}
