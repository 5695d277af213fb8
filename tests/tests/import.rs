//! `stepvalve import`: what people's tables hold becomes a valve-log; what is wrong in them is named with its place.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "shared/tables.rs"]
mod tables;

use log_data::{AngleZero, Log};
use std::path::Path;
use stepvalve_tests::{Finished, TestPlace, measured_data, repository};
use tables::{mat_v5, mat_v73, npy};

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
fn a_file_that_was_cut_off_within_a_number() {
    let whole = "0;1.500\n10;2.500\n20;3.500\n30;4.500\n40;5.500";
    for (cut, rows, note) in [
        (0, 5, None),
        (1, 4, Some("given.csv:5: the file ends within a number (\"5.50\"")),
        (4, 4, Some("(\"5\"")),
        (9, 4, None),
    ] {
        let place = TestPlace::new();
        let file = place.write("given.csv", &whole[..whole.len() - cut]);
        let finished = import(&place, &[&[file.to_str().unwrap()], &MAPS[..]].concat()).expect_code(0);
        assert_eq!(run_log::read_log(&place.path("out.h5")).unwrap().runs[0].len(), rows, "{cut} cut");
        let noted = finished.stderr.contains("left out");
        assert_eq!(noted, note.is_some(), "{cut} cut: {}", finished.stderr);
        assert!(note.is_none_or(|note| finished.stderr.contains(note)), "{}", finished.stderr);
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
        ("t,x\n0,1\n0,2\n", &["line 3", "time is 0 s as in the row before"]),
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
    let named = place.write("named.csv", "Pruefstand 7\nt [ms];phi (deg);t_oil\n0;1;20\n1;2;20\n2;3;20\n");
    let maps = ["--map", "time=t/1000", "--map", "angle=Phi*pi/180"];
    let arguments = [&[named.to_str().unwrap(), "--skip", "1"], &maps[..]].concat();
    refused(&place, &arguments, &["no column \"t\", is {t [ms]} meant?"]);
    let arguments = [&[named.to_str().unwrap()], &maps[..]].concat();
    refused(&place, &arguments, &["no column", "rows of numbers begin in line 3: try --skip auto"]);
    refused(&place, &[file, "--map", "time=t"], &["--map angle"]);
    refused(&place, &[file, "--map", "time=t", "--map", "speed=x"], &["speed", "NAME[UNIT]"]);
    refused(&place, &[file, "--map", "time=t", "--map", "angle=x*("], &["no expression"]);
    refused(&place, &[&[file, "--run", "a", "--run", "b"], &MAPS[..]].concat(), &["--run", "expected 1"]);
    refused(&place, &[&["missing.csv"], &MAPS[..]].concat(), &["missing.csv"]);
    let commas = place.write("commas.csv", "DAQ;4711\n\nt;x\ns;rad\n0;0,5\n1;0,6\n2;0,7\n");
    let arguments = [&[commas.to_str().unwrap(), "--skip", "auto"], &MAPS[..]].concat();
    refused(&place, &arguments, &["commas.csv", "say --decimal-comma"]);
    let binary = place.path("given.bin");
    std::fs::write(&binary, [0, 1, 2, 0, 255]).unwrap();
    refused(&place, &[&[binary.to_str().unwrap()], &MAPS[..]].concat(), &["not a text"]);
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

/// One of the recipes that are shipped.
fn recipe(name: &str) -> String {
    repository().join("rt-config/recipes").join(name).to_str().unwrap().to_owned()
}

/// The files of a folder, in order.
fn files_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap().flatten();
    let mut files: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some())
        .map(|path| path.to_str().unwrap().to_owned())
        .collect();
    files.sort();
    files
}

/// What one command makes of a measured set.
fn by_recipe(place: &TestPlace, files: &[String], name: &str) -> Log {
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    imported(place, &[&files[..], &["--recipe", &recipe(name)]].concat())
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

#[test]
fn a_carriage_on_a_screw() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let log = by_recipe(&place, &files_in(&data.join("emps")), "emps.toml");
    let run = &log.runs[0];
    assert_eq!(run.len(), 24_841);
    assert!((run.end_s() - run.start_s() - 24.84).abs() < 1e-6, "{}", run.end_s());
    // Some 0.24 m of travel on a screw of 2.5 mm pitch, under some tens of newtons.
    let turns = largest(&run.angle_rad) / std::f64::consts::TAU;
    assert!((80.0..110.0).contains(&turns), "{turns} turns");
    let most = largest(run.torque_nm.as_ref().unwrap());
    assert!((0.01..0.2).contains(&most), "{most} N*m");
}

#[test]
fn a_seal_under_four_pressures() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let files = files_in(&data.join("seal-friction"));
    let log = by_recipe(&place, &files, "seal-friction.toml");
    assert_eq!(log.runs.len(), files.len());
    let repetitions = log.runs.iter().filter(|run| !run.name.starts_with('3'));
    assert_eq!(repetitions.map(log_data::Run::len).sum::<usize>(), 54_016);
    assert!(log.is_on_one_clock());
    let run = log.run("1_O-ring257_5bar").unwrap();
    let pressure = run.pressure_drop_pa.as_ref().unwrap();
    let mean = pressure.iter().sum::<f64>() / pressure.len() as f64;
    assert!((4.8e5..5.2e5).contains(&mean), "{mean} Pa");
}

/// A scope's files: preambles of 10 to 12 lines, no angle, and the same names in two folders.
#[test]
fn a_screw_drive() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let folder = data.join("screw-drive");
    let files = [files_in(&folder.join("steady_state")), files_in(&folder.join("start_stop"))].concat();
    let log = by_recipe(&place, &files, "screw-drive.toml");
    assert_eq!((log.runs.len(), log.angle_zero), (34, AngleZero::PerRun));
    assert!(log.runs.iter().all(|run| run.len() == 500));
    let run = log.run("steady_state-200").unwrap();
    // 200 rpm for 3.2 s, turned; some 30 % of 9.84 mN·m.
    let (length_s, torque) = (run.end_s() - run.start_s(), run.torque_nm.as_ref().unwrap());
    let speed = (run.angle_rad[499] - run.angle_rad[0]) / length_s;
    assert!((20.5..21.5).contains(&speed), "{speed} rad/s");
    let mean = torque.iter().sum::<f64>() / 500.0;
    assert!((2.5e-3..3.5e-3).contains(&mean), "{mean} N*m");
}

/// Matrices of 3 × N: signals in rows.
#[test]
fn a_motor_that_cogs() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let log = by_recipe(&place, &files_in(&data.join("motor-cogging")), "motor-cogging.toml");
    let lengths: Vec<usize> = log.runs.iter().map(log_data::Run::len).collect();
    assert_eq!(lengths, [4306, 4267, 4342]);
    let run = &log.runs[0];
    let speed = (run.angle_rad[4305] - run.angle_rad[0]) / (run.end_s() - run.start_s());
    assert!((0.6..0.66).contains(&speed.abs()), "0.1 turns a second: {speed} rad/s");
    assert!((1e-3..2e-2).contains(&largest(run.torque_nm.as_ref().unwrap())));
}

#[test]
fn preambles_units_dates_and_what_is_missing() {
    let place = TestPlace::new();
    let text = "Drive 7\r\nrecorded;today\r\nwhen;x;M\r\nclock;mm;Nm\r\n\
                2020-07-08 23:59:59.5;1;n/a\r\n2020-07-09 00:00:00;2;-9999.0\r\n2020-07-09 00:00:00.5;-;3\r\n\
                2020-07-09 00:00:01;4;4\r\n";
    let file = place.write("given.csv", text);
    let maps = ["--map", "time=when", "--map", "angle=fill(x)", "--map", "torque=M", "--map", "travel[mm]=x"];
    let more = ["--missing", "-9999", "--skip", "2", "--units-line"];
    let log = imported(&place, &[&[file.to_str().unwrap()], &maps[..], &more].concat());
    let run = &log.runs[0];
    assert_eq!(run.time_s, [86_399.5, 86_400.0, 86_400.5, 86_401.0]);
    assert_eq!(log.attributes["time_zero_unix_s"], log_data::Attribute::Number(1_594_166_400.0));
    assert_eq!(run.angle_rad, [1.0, 2.0, 3.0, 4.0]);
    let torque = run.torque_nm.as_ref().unwrap();
    assert!(torque[0].is_nan() && torque[1].is_nan() && torque[2..] == [3.0, 4.0], "{torque:?}");
    assert!(run.extra("travel").unwrap().values[2].is_nan());
}

#[test]
fn what_says_that_a_sample_is_missing_and_stands_nowhere_is_told() {
    let place = TestPlace::new();
    let file = place.write("given.csv", "t,F\n0,1894.25\n1,2\n2,-9999\n");
    let maps =
        [file.to_str().unwrap(), "--map", "time=t", "--map", "angle=t", "--map", "torque=fill(F/1000)"];
    // A number of the log is none of the file's.
    let told = import(&place, &[&maps[..], &["--missing", "1.89425", "--missing", "-9999"]].concat());
    let told = told.expect_code(0).stderr;
    assert!(told.contains("--missing 1.89425: no cell") && !told.contains("--missing -9999"), "{told}");
}

#[test]
fn a_column_in_another_unit_is_refused_with_the_map_that_was_meant() {
    let place = TestPlace::new();
    let file = place.write("given.csv", "Zeit;Winkel [deg]\nms;deg\n0;0\n10;90\n20;180\n");
    let file = file.to_str().unwrap();
    let given = |time: &'static str, angle: &'static str| {
        [file, "--skip", "auto", "--units-line", "--map", time, "--map", angle]
    };
    refused(
        &place,
        &given("time=Zeit", "angle={Winkel [deg]}"),
        &["ms by its line of units", "time='(Zeit)/1000'"],
    );
    let angle = ["deg by its line of units", "angle='(-{Winkel [deg]})*pi/180'"];
    refused(&place, &given("time=Zeit/1000", "angle=-{Winkel [deg]}"), &angle);
    let speed = ["deg by its name", "expected torque in N*m or another unit of it"];
    let more = ["--skip", "1", "--map", "time=c1", "--map", "angle=c2*1", "--map", "torque={Winkel [deg]}"];
    let named = place.write("named.csv", "\nZeit;c2;Winkel [deg]\n0;0;1\n1;2;3\n2;4;5\n");
    refused(&place, &[&[named.to_str().unwrap()], &more[2..]].concat(), &speed);
    let log = imported(&place, &given("time=Zeit/1000", "angle={Winkel [deg]}*pi/180"));
    assert_eq!(log.runs[0].time_s, [0.0, 0.01, 0.02]);
    let log = imported(&place, &[&given("time=Zeit*1", "angle={Winkel [deg]}*1")[..], &["--force"]].concat());
    assert_eq!((log.runs[0].time_s[2], log.runs[0].angle_rad[2]), (20.0, 180.0));
}

/// A test bench writes commas in its clock too.
#[test]
fn clocks_with_decimal_commas() {
    let place = TestPlace::new();
    let rows = "10:15:30,000;0,1\n10:15:30,500;0,2\n10:15:31,000;0,3\n";
    let times_s = [36_930.0, 36_930.5, 36_931.0];
    let german = "30.11.2026 10:15:30,0;0,1\n30.11.2026 10:15:30,5;0,2\n30.11.2026 10:15:31,0;0,3\n";
    for (text, more, time, angle) in [
        (
            format!("# bench 7\n# DN 16\nUhrzeit;w\n{rows}"),
            &["--skip", "auto"][..],
            "time=Uhrzeit",
            "angle=w",
        ),
        (format!("bench 7\n\nUhrzeit;w\n{rows}"), &["--skip", "auto"], "time=Uhrzeit", "angle=w"),
        (rows.to_owned(), &[], "time=c1", "angle=c2"),
        (format!("t;w\n{german}"), &["--time-format", "%d.%m.%Y %H:%M:%S%.f"], "time=t", "angle=w"),
    ] {
        let file = place.write("clock.csv", &text);
        let given = [file.to_str().unwrap(), "--decimal-comma", "--force", "--map", time, "--map", angle];
        let run = &imported(&place, &[&given[..], more].concat()).runs[0];
        let of_day: Vec<f64> = run.time_s.iter().map(|time_s| time_s % 86_400.0).collect();
        assert_eq!((of_day, run.angle_rad.clone()), (times_s.to_vec(), vec![0.1, 0.2, 0.3]), "{text}");
    }
    // One place at a time.
    drop(place);
    let place = TestPlace::new();
    let file = place.write("clock.csv", "t;w\n30/11/2026 10:15:30;1\n");
    let given = ["--time-format", "%d.%m.%Y %H:%M:%S", "--map", "time=t", "--map", "angle=w"];
    let says =
        ["found \"30/11/2026 10:15:30\", expected a number or a time of the format \"%d.%m.%Y %H:%M:%S\""];
    refused(&place, &[&[file.to_str().unwrap()], &given[..]].concat(), &says);
}

#[test]
fn on_one_clock_files_follow_their_numbers() {
    let place = TestPlace::new();
    let files = ["run-1", "run-10", "run-2"].map(|name| place.write(&format!("{name}.csv"), "0,1\n1,2\n"));
    let files = files.each_ref().map(|file| file.to_str().unwrap());
    let maps = ["--map", "time=c1", "--map", "angle=c2"];
    let begin = |log: &Log, name: &str| log.run(name).unwrap().start_s();
    let finished = import(&place, &[&files[..], &maps, &["--gap", "5"]].concat()).expect_code(0);
    assert!(finished.stdout.contains("run-2 before run-10"), "{}", finished.stdout);
    let log = run_log::read_log(&place.path("out.h5")).unwrap();
    assert_eq!(["run-1", "run-2", "run-10"].map(|name| begin(&log, name)), [0.0, 6.0, 12.0]);
    assert_eq!(log.title, "run-1, run-2, run-10");
    // Whoever says another order means it; the names that are given stay with their files.
    let order = [files[1], files[0], files[2]];
    let more = ["--gap", "5", "--force", "--run", "ten", "--run", "one", "--run", "two"];
    let log = imported(&place, &[&order[..], &maps, &more].concat());
    assert_eq!(["ten", "one", "two"].map(|name| begin(&log, name)), [0.0, 6.0, 12.0]);
    let more = ["--gap", "5", "--force", "--run", "one", "--run", "ten", "--run", "two"];
    let log = imported(&place, &[&files[..], &maps, &more].concat());
    assert_eq!(["one", "two", "ten"].map(|name| begin(&log, name)), [0.0, 6.0, 12.0]);
}

#[test]
fn rows_by_condition_every_nth_and_decimated() {
    let place = TestPlace::new();
    // A slow ramp, and a tone that lies above half of the new sampling rate.
    let row = |k: usize| format!("{},{},{}\n", k, k as f64 + (1.3 * k as f64).sin(), k % 2);
    let file = place.write("given.csv", &(0..400).map(row).collect::<String>());
    let file = file.to_str().unwrap();
    let log = |more: &[&str]| {
        let _ = std::fs::remove_file(place.path("out.h5"));
        imported(&place, &[&[file, "--map", "time=c1", "--map", "angle=c2"], more].concat()).runs.remove(0)
    };
    let odd = log(&["--where", "c3==1 && c1>10", "--where", "row<15"]);
    assert_eq!(odd.time_s, [11.0, 13.0]);
    let every = log(&["--rows", "2..20", "--every", "5"]);
    assert_eq!(every.time_s, [1.0, 6.0, 11.0, 16.0]);
    let decimated = log(&["--decimate", "5"]);
    assert_eq!(decimated.len(), 80);
    for k in 10..70 {
        let off = decimated.angle_rad[k] - decimated.time_s[k];
        assert!(off.abs() < 0.02, "row {k}: {off}");
    }
    refused(
        place_without_out(&place),
        &[file, "--map", "time=c1", "--map", "angle=c2", "--where", "c1<0"],
        &["c1<0", "none of 400 rows"],
    );
}

/// The same place, what was imported before taken away.
fn place_without_out(place: &TestPlace) -> &TestPlace {
    std::fs::remove_file(place.path("out.h5")).unwrap();
    place
}

#[test]
fn lines_of_one_sample_each() {
    let place = TestPlace::new();
    let text = "signal,ms,value\nq,0,1\nM,0,5\nq,10,2\nq,20,3\nM,20,6\n";
    let file = place.write("given.csv", text);
    let file = file.to_str().unwrap();
    let maps = [
        "--interleaved",
        "signal,ms,value",
        "--map",
        "time=time/1000",
        "--map",
        "angle=q",
        "--map",
        "torque=M",
    ];
    let log = imported(&place, &[&[file], &maps[..]].concat());
    let run = &log.runs[0];
    assert_eq!((&run.time_s[..], &run.angle_rad[..]), (&[0.0, 0.01, 0.02][..], &[1.0, 2.0, 3.0][..]));
    let torque = run.torque_nm.as_ref().unwrap();
    assert!(torque[1].is_nan() && torque[0] == 5.0 && torque[2] == 6.0, "{torque:?}");
    std::fs::write(file, text.to_owned() + "M,20,7\n").unwrap();
    refused(place_without_out(&place), &[&[file], &maps[..]].concat(), &["line 7", "M at time 20 once more"]);
}

#[test]
fn numpy_arrays_whichever_way_they_lie() {
    let rows: [[f64; 2]; 3] = [[0.0, 5.0], [0.1, 6.0], [0.2, 7.0]];
    let bytes = |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let upright: Vec<f64> = rows.iter().flatten().copied().collect();
    let lying: Vec<f64> = (0..2).flat_map(|column| rows.iter().map(move |row| row[column])).collect();
    let plain = ["--map", "time=data_1", "--map", "angle=data_2"];
    let named = ["--map", "time=t", "--map", "angle={x mm}"];
    for (file, maps) in [
        (npy("'<f8'", "(3, 2)", &bytes(&upright)), plain),
        (npy("'<f8'", "(2, 3)", &bytes(&lying)), plain),
        (npy("[('t', '<f8'), ('x mm', '<f8')]", "(3,)", &bytes(&upright)), named),
    ] {
        let place = TestPlace::new();
        let path = place.path("given.npy");
        std::fs::write(&path, file).unwrap();
        let log = imported(&place, &[&[path.to_str().unwrap()], &maps[..]].concat());
        assert_eq!(log.runs[0].time_s, [0.0, 0.1, 0.2]);
        assert_eq!(log.runs[0].angle_rad, [5.0, 6.0, 7.0]);
    }
    let place = TestPlace::new();
    let path = place.path("given.npy");
    std::fs::write(&path, npy("'<f8'", "(3000000, 2)", &bytes(&upright))).unwrap();
    refused(
        &place,
        &[&[path.to_str().unwrap()], &plain[..]].concat(),
        &["given.npy", "expected a whole file"],
    );
}

#[test]
fn a_recipe_says_what_the_next_record_needs() {
    let place = TestPlace::new();
    let file = place.write("given.csv", "a;b\n0;1,5\n10;2,5\n");
    let file = file.to_str().unwrap();
    let recipe = place.path("drive.toml");
    let recipe = recipe.to_str().unwrap();
    let first = ["--map", "time=a/1000", "--map", "angle=b", "--decimal-comma", "--save-recipe", recipe];
    let log = imported(&place, &[&[file], &first[..]].concat());
    place_without_out(&place);
    let again = imported(&place, &[file, "--recipe", recipe]);
    assert_eq!(log.runs, again.runs);
    place_without_out(&place);
    let other = imported(&place, &[file, "--recipe", recipe, "--map", "angle=b*2"]);
    assert_eq!(other.runs[0].angle_rad, [3.0, 5.0], "the command line comes first");
    import(&place, &[file, "--recipe", recipe, "--force"]).expect_code(0);
    place_without_out(&place);
    for (wrong, says) in [
        (
            "format = \"stepvalve-recipe\"\nformat_version = 1\nskpi = 3\n",
            "drive.toml:3:1: unknown field `skpi`",
        ),
        ("format = \"stepvalve-model\"\nformat_version = 1\n", "expected format = \"stepvalve-recipe\""),
        (
            "format = \"stepvalve-recipe\"\nformat_version = 1\nrows = \"5\"\n",
            "drive.toml:3:8: \"5\", expected FIRST..LAST",
        ),
        ("[map]\ntime = \"c1*(\"\n", "no expression"),
    ] {
        std::fs::write(recipe, wrong).unwrap();
        refused(&place, &[file, "--recipe", recipe], &[says]);
    }
}
