//! The host check: what it says of machines made of files, of this one, and of what dead instances left.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;
use std::process::{Command, Stdio};
use stepvalve_tests::{FakeMachine, Finished, TestPlace, repository};

/// What the doctor says of a machine, without a measurement.
fn look(place: &TestPlace, machine: &FakeMachine, more: &[&str]) -> Finished {
    let root = machine.folder().to_str().unwrap();
    let fixed = ["doctor", "--json", "--measure", "0s", "--root", root];
    place.stepvalve(&[&fixed[..], more].concat())
}

fn finding(report: &Value, id: &str) -> Value {
    let findings = report["findings"].as_array().unwrap();
    findings
        .iter()
        .find(|finding| finding["id"] == id)
        .unwrap_or_else(|| panic!("no {id} in {report}"))
        .clone()
}

#[test]
fn a_machine_that_suits_the_loop_is_ok_throughout_but_its_latency_is_unknown() {
    let place = TestPlace::new();
    let machine = FakeMachine::good(place.path("machine"));
    let report = look(&place, &machine, &[]).expect_code(0).summary();
    for finding in report["findings"].as_array().unwrap() {
        assert_eq!(finding["state"], "ok", "{finding}");
    }
    assert_eq!(report["verdict"], "unknown", "what was not measured can't be promised");
    assert_eq!(report["target"]["period_ns"], 1_000_000);
}

#[test]
fn what_cannot_be_known_is_unknown() {
    let place = TestPlace::new();
    let machine = FakeMachine::mute(place.path("machine"));
    let report = look(&place, &machine, &["--bus-interface", "enp1s0"]).expect_code(0).summary();
    let findings = report["findings"].as_array().unwrap();
    assert!(findings.len() >= 18, "{}", findings.len());
    for finding in findings {
        assert_eq!(finding["state"], "unknown", "{finding}");
        assert!(finding["found"].as_str().unwrap().starts_with("unknown: "), "{finding}");
    }
    assert_eq!(report["verdict"], "unknown");
}

/// File, its text (`None`: not there), the finding that it changes, the state, a word of what is found, exit code.
type Change = (&'static str, Option<&'static str>, &'static str, &'static str, &'static str, i32);

const CHANGES: [Change; 27] = [
    ("proc/cpuinfo", Some("flags\t\t: fpu hypervisor\n"), "smt", "unknown", "host", 0),
    ("proc/cpuinfo", Some("flags\t\t: fpu hypervisor\n"), "idle-states", "unknown", "host", 0),
    ("sys/devices/system/cpu/isolated", Some("\n"), "isolated-cores", "problem", "in force is: none", 0),
    ("sys/devices/system/cpu/nohz_full", Some("(null)\n"), "nohz-cores", "problem", "in force is: none", 0),
    ("sys/devices/system/cpu/nohz_full", None, "nohz-cores", "problem", "this kernel can't", 0),
    ("proc/cmdline", Some("quiet isolcpus=0"), "isolated-cores", "problem", "isolcpus=0", 0),
    ("sys/devices/system/cpu/online", Some("0\n"), "cores", "problem", "core 1 is not online", 1),
    ("sys/devices/system/cpu/smt/active", Some("1\n"), "smt", "unknown", "siblings of core 1", 0),
    (
        "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor",
        Some("powersave\n"),
        "governor",
        "problem",
        "powersave",
        0,
    ),
    (
        "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor",
        None,
        "governor",
        "unknown",
        "does not govern",
        0,
    ),
    ("dev/cpu_dma_latency", None, "idle-states", "problem", "C6, 133 µs", 0),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/disable", Some("1\n"), "idle-states", "ok", "POLL", 0),
    ("sys/devices/system/cpu/cpu1/cpuidle", None, "idle-states", "unknown", "core 1", 0),
    (
        "sys/devices/system/clocksource/clocksource0/current_clocksource",
        Some("hpet\n"),
        "clock-source",
        "problem",
        "hpet",
        0,
    ),
    (
        "sys/devices/system/clocksource/clocksource0/current_clocksource",
        Some("sundial\n"),
        "clock-source",
        "unknown",
        "sundial",
        0,
    ),
    (
        "proc/timer_list",
        Some("  .hres_active    : 1\n  .hres_active    : 0\n"),
        "high-resolution-timers",
        "problem",
        "1 cores",
        1,
    ),
    ("proc/irq/24/effective_affinity_list", Some("0-1\n"), "irq-affinity", "advice", "24 eth0 (77 times", 0),
    ("proc/2/comm", Some("irqbalance\n"), "irqbalance", "advice", "runs", 0),
    ("proc/sys/kernel/sched_rt_runtime_us", Some("0\n"), "sched-rt-runtime", "problem", "none at all", 1),
    ("proc/sys/kernel/sched_rt_runtime_us", Some("-1\n"), "sched-rt-runtime", "advice", "unlimited", 0),
    (
        "proc/self/limits",
        Some("Max locked memory  8388608  8388608 bytes\nMax realtime priority 0 0\n"),
        "rtprio",
        "problem",
        "asks for 80",
        1,
    ),
    (
        "proc/self/limits",
        Some("Max locked memory  65536  65536 bytes\nMax realtime priority 90 90\n"),
        "memlock",
        "problem",
        "64 kB",
        0,
    ),
    (
        "proc/self/status",
        Some("Uid:\t0\t0\t0\t0\nCapEff:\t000001ffffffffff\n"),
        "capabilities",
        "advice",
        "root",
        0,
    ),
    ("proc/swaps", Some("Filename Type\n/dev/sda2 partition 1 0 -2\n"), "swap", "advice", "/dev/sda2", 0),
    ("proc/mounts", Some("/dev/sda1 / ext4 rw 0 0\n"), "shared-memory", "problem", "not mounted", 1),
    ("proc/mounts", Some("/dev/sda1 /dev/shm ext4 rw 0 0\n"), "shared-memory", "problem", "ext4", 1),
    ("proc/locks", None, "leftovers", "unknown", "/proc/locks", 0),
];

#[test]
fn each_thing_that_stands_in_the_way_is_found_and_told_how_to_mend() {
    let place = TestPlace::new();
    for (number, (file, text, id, state, found, code)) in CHANGES.into_iter().enumerate() {
        let machine = FakeMachine::good(place.path(&format!("machine-{number}")));
        match text {
            Some(text) => machine.set(file, text),
            None => machine.remove(file),
        }
        let report = look(&place, &machine, &[]).expect_code(code).summary();
        let finding = finding(&report, id);
        assert_eq!(finding["state"], state, "{file}: {finding}");
        assert!(finding["found"].as_str().unwrap().contains(found), "{found:?}: {finding}");
        assert_eq!(report["verdict"], if code == 1 { "out-of-reach" } else { "unknown" }, "{file}");
        if state == "problem" || state == "advice" {
            let fix = finding["fix"].as_str().unwrap();
            assert!(!fix.is_empty() && !finding["why"].as_str().unwrap().is_empty(), "{finding}");
            for word in fix.split([' ', ';', ',', ')', '(']).filter(|word| word.starts_with("rt-config/")) {
                assert!(repository().join(word).exists(), "{word} is recommended and not there: {finding}");
            }
        }
    }
}

#[test]
fn isolation_counts_only_for_the_loops_cores() {
    let place = TestPlace::new();
    let machine = FakeMachine::good(place.path("machine"));
    let report = look(&place, &machine, &["--core", "0"]).expect_code(0).summary();
    let isolated = finding(&report, "isolated-cores");
    assert_eq!(isolated["state"], "advice", "{isolated}");
    assert!(isolated["found"].as_str().unwrap().contains("the loop is on 0"), "{isolated}");
    assert_eq!(finding(&report, "nohz-cores")["state"], "advice");
}

/// Both variants of the kernel command line, as GRUB puts them together, are what the doctor expects.
#[test]
fn the_shipped_command_lines_are_understood() {
    let place = TestPlace::new();
    for (variant, isolated) in [("one-core-isolated", "1"), ("no-core-isolated", "")] {
        let file = repository().join(format!("rt-config/kernel/{variant}.cfg"));
        let script = format!(". '{}' && echo \"$GRUB_CMDLINE_LINUX_DEFAULT\"", file.display());
        let line = Finished::from(
            Command::new("sh")
                .args(["-euc", &format!("GRUB_CMDLINE_LINUX_DEFAULT=quiet; {script}")])
                .output()
                .unwrap(),
        );
        let line = line.expect_code(0).stdout;
        assert!(line.starts_with("quiet ") && line.contains("irqaffinity=0"), "{line}");
        let machine = FakeMachine::good(place.path(variant));
        machine.set("proc/cmdline", &line);
        machine.set("sys/devices/system/cpu/isolated", isolated);
        machine.set("sys/devices/system/cpu/nohz_full", isolated);
        let report = look(&place, &machine, &[]).expect_code(0).summary();
        let expected = if isolated.is_empty() { "advice" } else { "ok" };
        for id in ["isolated-cores", "nohz-cores"] {
            assert_eq!(finding(&report, id)["state"], expected, "{variant}");
        }
        // The same line on a kernel that did not take it.
        machine.set("sys/devices/system/cpu/isolated", "");
        let refused = finding(&look(&place, &machine, &[]).summary(), "isolated-cores");
        assert_eq!(refused["state"], if isolated.is_empty() { "advice" } else { "problem" }, "{refused}");
    }
}

/// A program that stands in for another one on the path.
fn stand_in(place: &TestPlace, name: &str, script: &str) -> String {
    let path = place.write(&format!("bin/{name}"), &format!("#!/bin/sh\n{script}\n"));
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    format!("{}:{}", path.parent().unwrap().display(), std::env::var("PATH").unwrap())
}

/// The verdict where cyclictest finds so many wake-ups at so many µs, the longest one given.
fn measured(place: &TestPlace, histogram: &str, cycles: u64, max_us: u64, code: i32) -> Value {
    let machine = FakeMachine::good(place.path("machine"));
    let thread = format!(r#"{{"histogram":{{{histogram}}},"cycles":{cycles},"max":{max_us}}}"#);
    let path = stand_in(place, "cyclictest", &format!("echo '{{\"thread\":{{\"0\":{thread}}}}}'"));
    let mut doctor = place.command("stepvalve");
    doctor.args(["doctor", "--json", "--measure", "1s", "--root"]).arg(machine.folder()).env("PATH", path);
    Finished::from(doctor.output().unwrap()).expect_code(code).summary()
}

#[test]
fn the_verdict_follows_what_was_measured() {
    let place = TestPlace::new();
    let good = measured(&place, r#""5":9000,"100":1000"#, 10_000, 100, 0);
    assert_eq!(good["verdict"], "in-reach");
    assert_eq!(good["measurement"]["with"], "cyclictest");
    assert!(good["measurement"]["p50_ns"].as_u64().unwrap().abs_diff(5_000) < 50, "{good}");
    let few = measured(&place, r#""5":9995,"400":5"#, 10_000, 400, 0);
    assert_eq!((&few["verdict"], &few["measurement"]["late"]), (&"in-reach-with-misses".into(), &5.into()));
    assert_eq!(measured(&place, r#""5":9900,"400":100"#, 10_000, 400, 1)["verdict"], "out-of-reach");
    // One beyond the histogram, for longer than the controller may be silent.
    let silent = measured(&place, r#""5":9999"#, 10_000, 12_000, 1);
    assert!(silent["reasons"][0].as_str().unwrap().contains("silence"), "{silent}");
}

#[test]
fn without_a_cyclictest_that_works_the_loops_own_timer_measures() {
    let place = TestPlace::new();
    let path = stand_in(&place, "cyclictest", "echo 'no rights' >&2; exit 1");
    let mut doctor = place.command("stepvalve");
    let output = doctor.args(["doctor", "--json", "--measure", "300ms"]).env("PATH", path).output().unwrap();
    let finished = Finished::from(output);
    assert!(finished.stderr.contains("no rights"), "{}", finished.stderr);
    let report = finished.summary();
    assert_eq!(report["measurement"]["with"], "built-in");
    assert!(report["measurement"]["wake_ups"].as_u64().unwrap() > 0, "{report}");
    let expected = if report["verdict"] == "out-of-reach" { 1 } else { 0 };
    finished.expect_code(expected);
    // A machine's files are there to be read: this test runs on one.
    assert_ne!(finding(&report, "cores")["state"], "unknown");
}

#[test]
fn where_no_terminal_shows_a_bar_there_is_a_line_every_few_seconds() {
    let place = TestPlace::new();
    let root = FakeMachine::good(place.path("machine"));
    let mut doctor = place.command("stepvalve");
    doctor
        .args(["doctor", "--json", "--measure", "9s", "--root"])
        .arg(root.folder())
        .env("PATH", "/nonexistent");
    let said = String::from_utf8(doctor.output().unwrap().stderr).unwrap();
    // After 3 s and after 7.5 s.
    let lines = said.lines().filter(|line| line.ends_with(" s  measuring wake-up latency, of 9 s"));
    assert!(lines.count() >= 2, "{said}");
}

#[test]
fn coalescing_is_asked_for_where_a_bus_is() {
    let place = TestPlace::new();
    let machine = FakeMachine::good(place.path("machine"));
    machine.set("sys/class/net/enp1s0/operstate", "up\n");
    for (adaptive, rx_us, state) in
        [("off", "0", "ok"), ("off", "3", "problem"), ("on", "0", "problem"), ("off", "n/a", "unknown")]
    {
        let answer = format!(
            "echo 'Adaptive RX: {adaptive}  TX: off'; echo 'rx-usecs:\t{rx_us}'; echo 'tx-usecs:\t0'"
        );
        let path = stand_in(&place, "ethtool", &answer);
        let mut doctor = place.command("stepvalve");
        doctor.args(["doctor", "--json", "--measure", "0s", "--interface", "enp1s0", "--root"]);
        let output = doctor.arg(machine.folder()).env("PATH", path).output().unwrap();
        let report = Finished::from(output).expect_code(0).summary();
        assert_eq!(finding(&report, "nic-coalescing")["state"], state, "{adaptive} {rx_us}");
    }
    let missing = look(&place, &machine, &["--interface", "eth9"]).summary();
    assert_eq!(finding(&missing, "nic-link")["state"], "problem");
}

/// A machine whose interface enp1s0 suits a drive: an Intel card with a link, and nothing else on it.
fn with_an_interface(place: &TestPlace, name: &str) -> FakeMachine {
    let machine = FakeMachine::good(place.path(name));
    let card = "sys/devices/pci0000:00/0000:01:00.0";
    let files = [
        ("sys/class/net/enp1s0/operstate", "up\n"),
        ("sys/class/net/enp1s0/carrier", "1\n"),
        ("sys/class/net/enp1s0/speed", "100\n"),
        ("sys/class/net/enp1s0/ifindex", "3\n"),
        ("sys/class/net/enp1s0/gro_flush_timeout", "0\n"),
        ("sys/devices/usb1/1-1/.keep", ""),
        ("sys/bus/pci/drivers/igb/.keep", ""),
        ("sys/bus/pci/drivers/r8169/.keep", ""),
        ("proc/net/route", "Iface\tDestination\tGateway\neth0\t00000000\t0102A8C0\n"),
        ("proc/net/if_inet6", "fe800000000000000000000000000001 02 40 20 80 eth0\n"),
        ("proc/irq/25/effective_affinity_list", "0\n"),
        ("proc/irq/25/enp1s0-TxRx-0/.keep", ""),
        ("proc/self/status", "Uid:\t995\t995\t995\t995\nCapEff:\t0000000000002000\n"),
    ];
    files.iter().for_each(|(path, text)| machine.set(path, text));
    machine.set(&format!("{card}/.keep"), "");
    link(&machine, &format!("{card}/driver"), "sys/bus/pci/drivers/igb");
    link(&machine, "sys/class/net/enp1s0/device", card);
    machine
}

fn link(machine: &FakeMachine, from: &str, to: &str) {
    let _ = std::fs::remove_file(machine.path(from));
    std::os::unix::fs::symlink(machine.path(to), machine.path(from)).unwrap();
}

/// ethtool of an interface that holds nothing back: what it says of coalescing, offloads and energy-efficient Ethernet.
const GOOD_ETHTOOL: &str = r#"case "$1" in
-c) echo 'Adaptive RX: off  TX: off'; echo 'rx-usecs:	0'; echo 'tx-usecs:	0';;
-k) echo 'generic-receive-offload: off'; echo 'large-receive-offload: off [fixed]';;
--show-eee) echo '	EEE status: disabled';;
esac"#;

fn look_at_the_interface(place: &TestPlace, machine: &FakeMachine, ethtool: &str) -> Value {
    stand_in(place, "nmcli", "echo '100 (connected)'");
    let path = stand_in(place, "ethtool", ethtool);
    let mut doctor = place.command("stepvalve");
    doctor.args(["doctor", "--json", "--measure", "0s", "--interface", "enp1s0", "--root"]);
    let output = doctor.arg(machine.folder()).env("PATH", path).output().unwrap();
    Finished::from(output).expect_code(0).summary()
}

#[test]
fn an_interface_that_suits_a_drive_is_ok_throughout() {
    let place = TestPlace::new();
    let report = look_at_the_interface(&place, &with_an_interface(&place, "machine"), GOOD_ETHTOOL);
    let ids = [
        "nic-link",
        "nic-driver",
        "nic-address",
        "nic-manager",
        "nic-coalescing",
        "nic-offloads",
        "nic-energy-efficient-ethernet",
        "nic-interrupts",
        "nic-raw-socket",
    ];
    for id in ids {
        assert_eq!(finding(&report, id)["state"], "ok", "{}", finding(&report, id));
    }
}

/// File and text, the finding, its state, a word of what is found.
const INTERFACE_CHANGES: [(&str, &str, &str, &str, &str); 9] = [
    ("sys/class/net/enp1s0/carrier", "0\n", "nic-link", "problem", "no link"),
    ("sys/class/net/enp1s0/speed", "10\n", "nic-link", "problem", "10 Mbit/s"),
    ("proc/net/route", "Iface\nenp1s0\t0002A8C0\t00000000\n", "nic-address", "problem", "IPv4"),
    ("proc/net/if_inet6", "fe80 03 40 20 80 enp1s0\n", "nic-address", "advice", "1 of IPv6"),
    ("proc/7/comm", "NetworkManager\n", "nic-manager", "problem", "NetworkManager"),
    ("proc/7/comm", "dhclient\n", "nic-manager", "advice", "dhclient"),
    ("sys/class/net/enp1s0/gro_flush_timeout", "20000\n", "nic-offloads", "problem", "gro_flush_timeout"),
    ("proc/irq/25/effective_affinity_list", "0-1\n", "nic-interrupts", "advice", "25 enp1s0-TxRx-0"),
    ("proc/self/status", "CapEff:\t0\n", "nic-raw-socket", "advice", "does not have it"),
];

#[test]
fn what_delays_a_drives_frames_is_found_and_told_how_to_mend() {
    let place = TestPlace::new();
    let expect = |report: &Value, id: &str, state: &str, found: &str| {
        let finding = finding(report, id);
        assert_eq!(finding["state"], state, "{finding}");
        assert!(finding["found"].as_str().unwrap().contains(found), "{found:?}: {finding}");
        assert!(!finding["fix"].as_str().unwrap().is_empty(), "{finding}");
    };
    for (number, (file, text, id, state, found)) in INTERFACE_CHANGES.into_iter().enumerate() {
        let machine = with_an_interface(&place, &format!("changed-{number}"));
        machine.set(file, text);
        expect(&look_at_the_interface(&place, &machine, GOOD_ETHTOOL), id, state, found);
    }
    let cards = [
        ("sys/devices/pci0000:00/0000:01:00.0/driver", "sys/bus/pci/drivers/r8169", "advice", "Realtek"),
        ("sys/class/net/enp1s0/device", "sys/devices/usb1/1-1", "problem", "USB"),
    ];
    for (number, (from, to, state, found)) in cards.into_iter().enumerate() {
        let machine = with_an_interface(&place, &format!("card-{number}"));
        link(&machine, from, to);
        expect(&look_at_the_interface(&place, &machine, GOOD_ETHTOOL), "nic-driver", state, found);
    }
    let answers = [
        ("receive-offload: off", "receive-offload: on", "nic-offloads", "advice", "generic-receive-offload"),
        ("disabled", "enabled - active", "nic-energy-efficient-ethernet", "problem", "enabled"),
    ];
    let machine = with_an_interface(&place, "answers");
    for (good, bad, id, state, found) in answers {
        expect(
            &look_at_the_interface(&place, &machine, &GOOD_ETHTOOL.replacen(good, bad, 1)),
            id,
            state,
            found,
        );
    }
}

#[test]
fn bad_questions_are_refused() {
    let place = TestPlace::new();
    for (option, value) in
        [("--period", "1h"), ("--period", "50us"), ("--measure", "2d"), ("--scenario", "no.toml")]
    {
        let refused = place.stepvalve(&["doctor", option, value]).expect_code(2);
        assert!(refused.stderr.contains(value), "{}", refused.stderr);
        assert!(refused.stdout.is_empty(), "{}", refused.stdout);
    }
}

#[test]
fn a_scenario_says_what_loop_is_meant() {
    let place = TestPlace::new();
    let machine = FakeMachine::good(place.path("machine"));
    let scenario = place.scenario(
        "sine-1hz.toml",
        &[("period", "period = \"2ms\""), ("silence_cycles", "silence_cycles = 7")],
    );
    let report = look(&place, &machine, &["--scenario", scenario.to_str().unwrap()]).expect_code(0).summary();
    assert_eq!(report["target"]["period_ns"], 2_000_000);
    assert_eq!(report["target"]["silence_ns"], 14_000_000);
    assert_eq!(report["target"]["cores"], serde_json::json!([1]));
}

#[test]
fn the_living_are_told_from_the_dead() {
    let place = TestPlace::new();
    let machine = FakeMachine::good(place.path("machine"));
    let lock = |name: &str| place.write(&format!("runtime/stepvalve/{name}/supervisor.lock"), "");
    let (alive, _dead) = (lock("alive"), lock("dead"));
    let inode = std::fs::metadata(&alive).unwrap().ino();
    machine.set("proc/locks", &format!("1: FLOCK  ADVISORY  WRITE 77 fe:00:{inode} 0 EOF\n"));
    for name in
        ["stepvalve_0_11111111_1_a", "stepvalve_0_22222222_1_a", "stepvalve_0_22222222_1_b", "not_ours_0_1"]
    {
        machine.set(&format!("dev/shm/{name}"), "x");
    }
    machine.set("proc/1/maps", "7f00-7f01 rw-s 00000000 00:1a 7 /dev/shm/stepvalve_0_11111111_1_a\n");
    let left = finding(&look(&place, &machine, &[]).expect_code(0).summary(), "leftovers");
    assert_eq!(left["state"], "advice", "{left}");
    let found = left["found"].as_str().unwrap();
    assert!(found.contains("/dead") && found.contains("2 files /dev/shm/stepvalve_0_22222222_*"), "{found}");
    assert!(
        !found.contains("/alive") && !found.contains("11111111") && !found.contains("not_ours"),
        "{found}"
    );
}

/// Kills a whole instance, finds what it left, removes it as told, and finds it gone.
#[test]
fn what_a_killed_instance_left_is_found_and_removed_as_told() {
    let place = TestPlace::new();
    let scenario = place.scenario("step-sequence.toml", &[("silence_cycles", "silence_cycles = 500")]);
    let mut command = place.command("stepvalve");
    command
        .args(["run", "--instance", "victim", "--record", "none", "--out"])
        .arg(place.path("out"))
        .arg(&scenario);
    let mut run = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let children = place.wait_for("all processes", || {
        let names = ["plant-simulator", "trajectory-generator", "step-controller", "run-recorder"];
        let found: Vec<_> = names.iter().filter_map(|name| place.child_of(run.id(), name)).collect();
        (found.len() == names.len() && !place.shared_memory_of("victim").is_empty()).then_some(found)
    });
    let running = finding(&doctor_here(&place), "leftovers");
    let folder = place.path("runtime/stepvalve/victim").display().to_string();
    assert!(!running["found"].as_str().unwrap().contains(&folder), "alive: {running}");
    for pid in [Pid::from_raw(run.id().cast_signed())].iter().chain(&children) {
        kill(*pid, Signal::SIGKILL).unwrap();
    }
    run.wait().unwrap();
    place.wait_for("their end", || children.iter().all(|pid| !runs(*pid)).then_some(()));
    let left = finding(&doctor_here(&place), "leftovers");
    let fix = left["fix"].as_str().unwrap();
    assert!(left["found"].as_str().unwrap().contains(&folder), "{left}");
    assert!(!place.shared_memory_of("victim").is_empty(), "nothing was left: this test tests nothing");
    // Only what is told of this instance: another test's machine may have leftovers of its own.
    let shared = place.shared_memory_of("victim")[0].display().to_string();
    let commands = fix.split("now: ").nth(1).unwrap().split("; ");
    let ours = |command: &&str| {
        command.contains(&folder)
            || command.strip_prefix("rm ").is_some_and(|glob| shared.starts_with(glob.trim_end_matches('*')))
    };
    let commands: Vec<_> = commands.filter(ours).collect();
    assert_eq!(commands.len(), 2, "{fix}");
    Finished::from(Command::new("sh").args(["-ec", &commands.join("; ")]).output().unwrap()).expect_code(0);
    place.assert_nothing_left(&["victim"]);
    let after = finding(&doctor_here(&place), "leftovers");
    assert!(!after["found"].as_str().unwrap().contains(&folder), "{after}");
}

fn doctor_here(place: &TestPlace) -> Value {
    place.stepvalve(&["doctor", "--json", "--measure", "0s"]).summary()
}

fn runs(pid: Pid) -> bool {
    // A zombie that nobody has buried yet holds nothing any more.
    let status = std::fs::read_to_string(Path::new("/proc").join(pid.to_string()).join("status"));
    status.is_ok_and(|status| !status.contains("State:\tZ"))
}
