//! A cable for EtherCAT without hardware or root: a pair of virtual interfaces in a network namespace of the test's own, with the
//! simulated drive at its far end.

use crate::bench_place::machine;
use crate::{TestPlace, program, repository};
use std::path::{Path, PathBuf};
use std::process::Command;
use subdevice::{DriveProcess, NEAR, lay_cable};
use test_needs::{skip_on_this_machine, skip_without};

/// Set in a test that runs again inside its namespace.
const INSIDE: &str = "STEPVALVE_TEST_NAMESPACE";

/// A network namespace of nobody's.
const OF_NOBODY: &[&str] = &["unshare", "-Urn"];
/// The same with the rights that rt-config/limits.d gives, where the tests' user may give them; or root's, where root runs the tests.
const IN_REAL_TIME: [&[&str]; 2] =
    [&["prlimit", "--rtprio=99", "--memlock=unlimited", "unshare", "-Urn"], &["unshare", "-n"]];

/// Runs `test`, which is the test function named `name`, in a user and network namespace of its own, where [`NEAR`] and
/// its far end are connected. Skips loudly where this machine allows none.
///
/// # Panics
/// Where the test fails.
pub fn on_a_cable(name: &str, test: impl FnOnce()) {
    within(name, OF_NOBODY, test);
}

/// The same with real-time priorities and locked memory, where the tests' user may have them.
///
/// # Panics
/// Where the test fails.
pub fn on_a_cable_in_real_time(name: &str, test: impl FnOnce()) {
    let gives_priority = |way: &&&[&str]| run(way, &["chrt", "-f", "80", "true"]).is_ok();
    let way = IN_REAL_TIME.iter().find(gives_priority);
    if way.is_none() && std::env::var_os(INSIDE).is_none() {
        println!("{name}: no right to real-time priorities");
    }
    within(name, way.unwrap_or(&OF_NOBODY), test);
}

/// Runs a command in a namespace; what it complains of.
fn run(way: &[&str], command: &[&str]) -> Result<(), String> {
    let [program, arguments @ ..] = way else { return Err("nothing to run".to_owned()) };
    let output = Command::new(program).args(arguments).args(command).output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    Err(String::from_utf8_lossy(&output.stderr).trim().to_owned())
}

fn within(name: &str, way: &[&str], test: impl FnOnce()) {
    if std::env::var_os(INSIDE).is_some() {
        lay_cable().unwrap();
        return test();
    }
    if Command::new("ip").arg("-V").output().is_err() {
        return skip_without("ip (iproute2)");
    }
    if let Err(reason) = run(way, &["ip", "link", "add", "name", NEAR, "type", "veth"]) {
        return skip_on_this_machine(&format!("no network namespace ({}): {reason}", way.join(" ")));
    }
    // The test inside is a program of its own, which does not see that others of this one wait.
    let _machine = machine();
    let status = Command::new(way[0])
        .args(&way[1..])
        .arg(std::env::current_exe().unwrap())
        .args([name, "--exact", "--nocapture"])
        .env(INSIDE, "1")
        .status()
        .unwrap();
    assert!(status.success(), "{name}, in its namespace: {status}");
}

/// The simulated drive at the far end of the cable, moving the valve of `model`.
///
/// # Panics
/// Where it does not start.
pub fn start_drive(model: &Path, arguments: &[&str]) -> DriveProcess {
    DriveProcess::start(&program("subdevice"), model, arguments).unwrap()
}

/// Ends it; its log is written then.
///
/// # Panics
/// Where it failed.
pub fn end_drive(drive: DriveProcess) {
    let status = drive.end().unwrap();
    assert!(status.success(), "subdevice: {status}");
}

/// The shipped scenario of a drive, in which silence and lost frames are borne for half a second: a busy test machine stalls.
///
/// # Panics
/// Where the shipped files are not what they were.
pub fn patient_drive_scenario(place: &TestPlace) -> PathBuf {
    drive_scenario(place, "simulated", 500, &[])
}

/// The shipped scenario of a drive with a shipped drive file, with so many cycles of silence and of lost frames, and changed lines as of
/// [`TestPlace::scenario`].
///
/// # Panics
/// As [`patient_drive_scenario`].
pub fn drive_scenario(place: &TestPlace, drive: &str, cycles: u64, changes: &[(&str, &str)]) -> PathBuf {
    let path = repository().join(format!("rt-config/drives/{drive}.toml"));
    let drive = std::fs::read_to_string(path).unwrap();
    let drive = drive.replace("bus_lost_cycles = 3 ", &format!("bus_lost_cycles = {cycles} "));
    let drive = place.write("drive.toml", &drive);
    let (file, silence) = (format!("file = \"{}\"", drive.display()), format!("silence_cycles = {cycles}"));
    let fixed = [
        ("file =", &*file),
        ("silence_cycles", &*silence),
        ("max_following_error", "max_following_error = \"30deg\""),
    ];
    place.scenario("drive.toml", &[&fixed, changes].concat())
}
