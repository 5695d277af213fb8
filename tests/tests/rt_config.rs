//! What a machine gets installed: every file says how to verify it, systemd takes the unit, and the service speaks to it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use stepvalve_tests::{Finished, TestPlace, program, repository};
use test_needs::skip_on_this_machine;

/// Folders and what they hold at least.
const FILES: [&str; 9] = [
    "systemd/stepvalve@.service",
    "systemd/drive.conf",
    "kernel/one-core-isolated.cfg",
    "kernel/no-core-isolated.cfg",
    "sysctl.d/60-stepvalve.conf",
    "limits.d/60-stepvalve.conf",
    "udev/60-stepvalve.rules",
    "tuned/stepvalve/tuned.conf",
    "sysusers.d/stepvalve.conf",
];

fn file(name: &str) -> PathBuf {
    repository().join("rt-config").join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(file(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn all_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        if entry.path().is_dir() { all_files(&entry.path(), found) } else { found.push(entry.path()) }
    }
}

#[test]
fn each_file_begins_with_how_to_verify_it() {
    FILES.iter().for_each(|name| assert!(file(name).exists(), "{name} is missing"));
    let mut files = Vec::new();
    all_files(&repository().join("rt-config"), &mut files);
    // A record is as its instrument wrote it; the file beside it says what it is. JSON has no comments.
    let bare = |path: &&PathBuf| path.extension().is_some_and(|end| end == "csv" || end == "json");
    for path in files.iter().filter(|path| !bare(path)) {
        let text = std::fs::read_to_string(path).unwrap();
        let head: Vec<_> = text.lines().take_while(|line| line.starts_with('#')).collect();
        assert!(
            head.iter().any(|line| line.to_lowercase().contains("verify")),
            "{}: {head:?}",
            path.display()
        );
    }
}

/// A setting stands below a comment, with nothing but other settings of the same reason between.
#[test]
fn each_setting_has_its_reason() {
    for name in FILES {
        let mut reason = false;
        for (number, line) in text(name).lines().enumerate() {
            match line.trim() {
                "" => reason = false,
                line if line.starts_with('#') => reason = true,
                line if line.starts_with('[') || line.starts_with("summary=") => {}
                line => assert!(reason, "{name}:{}: {line} has no reason above it", number + 1),
            }
        }
    }
}

fn installed(name: &str) -> bool {
    let there = Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if there.is_err() {
        skip_on_this_machine(&format!("it does not run systemd: there is no {name}"));
    }
    there.is_ok()
}

#[test]
fn systemd_takes_the_unit() {
    if !installed("systemd-analyze") {
        return;
    }
    let place = TestPlace::new();
    let unit = text("systemd/stepvalve@.service");
    let own = program("stepvalve").display().to_string();
    let verify = |unit: &str| -> Finished {
        let copy = place.write("stepvalve@.service", &unit.replace("/usr/local/bin/stepvalve", &own));
        let mut analyze = Command::new("systemd-analyze");
        analyze.args(["verify", "--man=no"]).arg(copy).env("LANG", "C").output().unwrap().into()
    };
    let finished = verify(&unit).expect_code(0);
    assert!(!finished.stderr.contains("stepvalve@"), "{}", finished.stderr);
    let mistake = verify(&unit.replace("WatchdogSec=", "WatchdogSecs="));
    assert!(mistake.stderr.contains("WatchdogSecs"), "this test sees mistakes: {}", mistake.stderr);
}

/// The unit without network takes the drive's drop-in, and has the one capability then.
#[test]
fn systemd_takes_the_drop_in_of_a_drive() {
    if !installed("systemd-analyze") {
        return;
    }
    let place = TestPlace::new();
    let own = program("stepvalve").display().to_string();
    let unit = text("systemd/stepvalve@.service").replace("/usr/local/bin/stepvalve", &own);
    let verify = |drop_in: &str| -> Finished {
        let unit = place.write("drop/stepvalve@bench.service", &unit);
        place.write("drop/stepvalve@bench.service.d/drive.conf", drop_in);
        let mut analyze = Command::new("systemd-analyze");
        analyze.args(["verify", "--man=no"]).arg(unit).env("LANG", "C").output().unwrap().into()
    };
    let drop_in = text("systemd/drive.conf");
    let finished = verify(&drop_in).expect_code(0);
    assert!(!finished.stderr.contains("drive.conf"), "{}", finished.stderr);
    let mistake = verify(&drop_in.replace("PrivateNetwork=", "PrivateNetworks="));
    assert!(mistake.stderr.contains("PrivateNetworks"), "this test sees mistakes: {}", mistake.stderr);
}

#[test]
fn sysusers_makes_a_system_user() {
    if !installed("systemd-sysusers") {
        return;
    }
    let place = TestPlace::new();
    let mut sysusers = Command::new("systemd-sysusers");
    // A root of its own, so that no user of this machine is in the way.
    sysusers.arg("--dry-run").arg(format!("--root={}", place.path("root").display()));
    let inside = place.write("root/etc/sysusers.d/stepvalve.conf", &text("sysusers.d/stepvalve.conf"));
    let finished = Finished::from(sysusers.arg(inside).output().unwrap());
    let said = finished.stdout + &finished.stderr;
    assert_eq!(finished.code, Some(0), "{said}");
    assert!(said.contains("user 'stepvalve'") || said.contains("user \"stepvalve\""), "{said}");
}

#[test]
fn every_sysctl_is_one() {
    for line in text("sysctl.d/60-stepvalve.conf").lines().filter(|l| !l.is_empty() && !l.starts_with('#')) {
        let (key, value) = line.trim_start_matches('-').split_once(" = ").expect(line);
        value.parse::<i64>().expect(line);
        let path = Path::new("/proc/sys").join(key.replace('.', "/"));
        if !path.exists() {
            skip_on_this_machine(&format!("its kernel has no {key}"));
        }
    }
}

#[test]
fn the_limits_are_what_the_unit_gives() {
    let (limits, unit) = (text("limits.d/60-stepvalve.conf"), text("systemd/stepvalve@.service"));
    let fields = |item: &str| {
        let line = limits.lines().filter(|line| !line.starts_with('#')).find(|line| line.contains(item));
        line.unwrap().split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(fields("rtprio"), ["@stepvalve", "-", "rtprio", "90"]);
    assert_eq!(fields("memlock"), ["@stepvalve", "-", "memlock", "unlimited"]);
    for line in ["LimitRTPRIO=90", "LimitMEMLOCK=infinity", "Type=notify", "KillMode=mixed"] {
        assert!(unit.lines().any(|found| found == line), "{line}");
    }
}

/// What comes over the socket until a message says `what`.
#[track_caller]
fn hear(socket: &UnixDatagram, what: &str) -> String {
    let (begun, mut heard) = (Instant::now(), String::new());
    let mut message = [0; 4096];
    while begun.elapsed() < Duration::from_secs(60) {
        if let Ok(length) = socket.recv(&mut message) {
            heard += &(String::from_utf8_lossy(&message[..length]).into_owned() + "\n");
            if heard.lines().any(|line| line == what) {
                return heard;
            }
        }
    }
    panic!("no {what} in {heard}");
}

#[test]
fn the_service_tells_systemd_that_it_is_ready_alive_and_ending() {
    let place = TestPlace::new();
    let socket = UnixDatagram::bind(place.path("notify")).unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    // The unit's own command, with places of this test.
    let unit = text("systemd/stepvalve@.service");
    let command = unit.lines().find_map(|line| line.strip_prefix("ExecStart=")).unwrap();
    let scenario = place.scenario("step-sequence.toml", &[]);
    let command = command
        .replace("/usr/local/bin/stepvalve", &program("stepvalve").display().to_string())
        .replace("/etc/stepvalve/%i.toml", &scenario.display().to_string())
        .replace("/var/lib/stepvalve/%i", &place.path("out").display().to_string())
        .replace("%i", "service")
        // This machine need not grant what the unit's does.
        .replace(" --require-realtime", "");
    let mut shell = place.within(Command::new("sh"));
    shell.args(["-c", &format!("export WATCHDOG_PID=$$; exec {command}")]);
    shell.env("NOTIFY_SOCKET", place.path("notify")).env("WATCHDOG_USEC", "400000");
    let run = shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    hear(&socket, "READY=1");
    for _ in 0..3 {
        hear(&socket, "WATCHDOG=1");
    }
    for name in ["plant-simulator", "run-recorder"] {
        let child = place.child_of(run.id(), name).unwrap();
        let environment = std::fs::read(format!("/proc/{child}/environ")).unwrap();
        assert!(!String::from_utf8_lossy(&environment).contains("NOTIFY_SOCKET"), "{name} could speak too");
    }
    kill(Pid::from_raw(run.id().cast_signed()), Signal::SIGTERM).unwrap();
    hear(&socket, "STOPPING=1");
    Finished::from(run.wait_with_output().unwrap()).expect_code(0);
    place.assert_nothing_left(&["service"]);
}
