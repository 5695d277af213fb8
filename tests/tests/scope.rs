//! `stepvalve scope`: who gets in, what a browser does with it, what a capture holds, and that a restart ends nothing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use recording::{Topic, read_record};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use stepvalve_tests::{Finished, TestPlace, despite_stalls, end_instance, program, repository};
use test_needs::python_with_browser;
use tungstenite::client::IntoClientRequest;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket, connect};

/// A scope that is there until it is dropped.
struct Scope {
    process: Child,
    page: String,
    foxglove: String,
}

impl Scope {
    fn start(place: &TestPlace, arguments: &[&str]) -> Self {
        Self::try_start(place, arguments).expect("a scope")
    }

    /// `None` where there is no instance to look at.
    fn try_start(place: &TestPlace, arguments: &[&str]) -> Option<Self> {
        let mut command = place.command("stepvalve");
        command.args(["scope", "--json"]).args(arguments).stdout(Stdio::piped());
        let mut process = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let Ok(opened) = serde_json::from_str::<Value>(&line) else {
            process.wait().unwrap();
            return None;
        };
        let text = |key: &str| opened[key].as_str().unwrap().to_owned();
        Some(Self { process, page: text("page"), foxglove: text("foxglove") })
    }

    /// Host and port, and the token.
    fn address(&self) -> (String, String) {
        let (host, token) = self.page.strip_prefix("http://").unwrap().split_once("/?token=").unwrap();
        (host.to_owned(), token.to_owned())
    }

    /// Status and body of a plain request with these header lines.
    fn request(&self, path: &str, headers: &str) -> (u16, String) {
        let (host, _) = self.address();
        let mut stream = TcpStream::connect(&host).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\n{headers}\r\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        (answer.split(' ').nth(1).unwrap().parse().unwrap(), answer)
    }

    fn socket(&self) -> WebSocket<MaybeTlsStream<TcpStream>> {
        let (host, token) = self.address();
        connect(format!("ws://{host}/ws?token={token}")).unwrap().0
    }
}

impl Drop for Scope {
    fn drop(&mut self) {
        kill(Pid::from_raw(self.process.id().cast_signed()), Signal::SIGTERM).unwrap();
        self.process.wait().unwrap();
    }
}

/// An instance that is armed, recorded to `bench`.
fn armed(place: &TestPlace) -> Child {
    let scenario = place.scenario("step-sequence.toml", &[("silence_cycles", "silence_cycles = 200")]);
    let run = place.start_instance("bench", &["--record", "all"], &scenario, &place.path("bench"));
    place.stepvalve(&["arm"]).expect_code(0);
    run
}

fn segments(folder: &Path) -> Vec<PathBuf> {
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> =
        names.filter(|path| path.extension().is_some_and(|kind| kind == "mcap")).collect();
    found.sort();
    found
}

/// Each message's words by topic and sequence number.
fn messages(segments: &[PathBuf]) -> BTreeMap<(Topic, u64), Vec<u64>> {
    let mut found = BTreeMap::new();
    read_record(segments, |message| {
        let mut words = Vec::new();
        message.each_word(|word| words.push(word));
        found.insert((message.topic().unwrap(), message.header().sequence), words);
    })
    .unwrap();
    found
}

/// The next text that `is` this.
fn next_text(socket: &mut WebSocket<MaybeTlsStream<TcpStream>>, is: &str) -> Value {
    loop {
        if let Message::Text(text) = socket.read().unwrap() {
            let told: Value = serde_json::from_str(&text).unwrap();
            assert!(told["is"] != "error" || is == "error", "{told}");
            if told["is"] == is {
                return told;
            }
        }
    }
}

#[test]
fn nobody_gets_in_without_the_token_or_from_another_page() {
    let place = TestPlace::new();
    let run = armed(&place);
    let scope = Scope::start(&place, &[]);
    let (host, token) = scope.address();
    let page = format!("/?token={token}");
    let own = format!("Host: {host}\r\n");
    let (status, html) = scope.request(&page, &own);
    assert_eq!(status, 200);
    assert!(
        html.contains("X-Frame-Options: DENY") && html.contains("default-src 'none'"),
        "{}",
        &html[..600]
    );
    let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    for (path, headers) in [
        ("/", own.clone()),
        ("/?token=0123456789abcdef0123456789abcdef", own.clone()),
        (&page, "Host: rebound.example\r\n".to_owned()),
        (&format!("/ws?token={token}"), format!("{own}{upgrade}Origin: http://evil.example\r\n")),
        (&format!("/ws?token={token}"), format!("{own}{upgrade}Origin: null\r\n")),
        ("/ws", format!("{own}{upgrade}")),
    ] {
        assert_eq!(scope.request(path, &headers).0, 403, "{path} with {headers}");
    }
    // Only this machine is listened to.
    let port: u16 = host.split(':').nth(1).unwrap().parse().unwrap();
    let listening = std::fs::read_to_string("/proc/net/tcp").unwrap();
    assert!(listening.contains(&format!("0100007F:{port:04X} 00000000:0000 0A")), "{listening}");
    drop(scope);
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn a_browser_looks_measures_triggers_saves_and_reopens() {
    let Some(python) = python_with_browser() else { return };
    despite_stalls(|place| {
        let run = armed(place);
        let scope = Scope::start(place, &[]);
        let script = repository().join("tests/browser/test_scope.py");
        let mut command = place.within(Command::new(&python));
        let output = command.arg(script).arg(&scope.page).arg(program("stepvalve")).output().unwrap();
        print!("{}", Finished::from(output).expect_code(0).stdout);
        drop(scope);
        end_instance(run, Signal::SIGTERM).expect_code(0);
        check_captures(place);
    });
}

/// What was saved holds the loop's own messages bit for bit, and opens as any record does.
fn check_captures(place: &TestPlace) {
    let recorded = messages(&segments(&place.path("bench")));
    let saved = segments(&place.path("bench/captures"));
    assert!(saved.len() >= 2, "{saved:?}");
    for capture in &saved {
        let captured = messages(std::slice::from_ref(capture));
        assert!(captured.len() > 1000, "{}: {} messages", capture.display(), captured.len());
        for (key, words) in &captured {
            assert_eq!(Some(words), recorded.get(key), "{}: {key:?}", capture.display());
        }
        let page = capture.with_extension("html");
        let report =
            ["report", capture.with_extension("h5").to_str().unwrap(), "--out", page.to_str().unwrap()]
                .map(str::to_owned);
        place.stepvalve(&report.each_ref().map(String::as_str)).expect_code(0);
    }
}

#[test]
fn a_restart_of_the_generation_is_survived_and_a_dead_instance_is_told() {
    despite_stalls(|place| {
        let run = armed(place);
        let scope = Scope::start(place, &[]);
        let mut socket = scope.socket();
        assert_eq!(next_text(&mut socket, "attached")["generation"], 1);
        let show = r#"{"do":"show","signals":["feedback.angle_rad"]}"#;
        socket.send(Message::text(show)).unwrap();
        let controller = place.wait_for("the controller", || place.child_of(run.id(), "step-controller"));
        kill(controller, Signal::SIGKILL).unwrap();
        // What led to the death can be looked at after it.
        let last = next_text(&mut socket, "capture");
        assert_eq!((&last["word"], &last["generation"]), (&"ended".into(), &1.into()), "{last}");
        assert_eq!(last["window"]["zero"], last["window"]["to"], "{last}");
        assert_eq!(next_text(&mut socket, "attached")["generation"], 2);
        let live = (0..1000).any(|_| matches!(socket.read().unwrap(), Message::Binary(_)));
        assert!(live, "nothing comes of the second generation");
        end_instance(run, Signal::SIGTERM).expect_code(0);
        // In between it may be told that the generation it joined has ended.
        while next_text(&mut socket, "detached")["why"] != "the instance does not run" {}
    });
}

/// The cycles of a frame of live samples that holds one topic.
fn live_cycles(frame: &[u8]) -> Vec<u64> {
    let word = |at: usize| u32::from_le_bytes(frame[at..at + 4].try_into().unwrap()) as usize;
    if word(0) != 0 {
        return Vec::new();
    }
    let (rows, columns) = (word(8), word(12));
    let begin = 24 + 4 * columns.next_multiple_of(2);
    let cycle = |row: usize| f64::from_le_bytes(frame[begin + 8 * row..][..8].try_into().unwrap()) as u64;
    (0..rows).map(cycle).collect()
}

#[test]
fn a_gap_on_the_bus_is_told_with_its_place_and_length() {
    despite_stalls(|place| {
        let run = armed(place);
        let scope = Scope::start(place, &[]);
        let mut socket = scope.socket();
        socket.send(Message::text(r#"{"do":"show","signals":["feedback.angle_rad"]}"#)).unwrap();
        let pid = Pid::from_raw(scope.process.id().cast_signed());
        let (mut cycles, mut gaps) = (Vec::<u64>::new(), Vec::<(u64, u64)>::new());
        while gaps.is_empty() || cycles.last().is_none_or(|last| *last < gaps[0].0 + 500) {
            match socket.read().unwrap() {
                Message::Binary(frame) => cycles.extend(live_cycles(&frame)),
                Message::Text(text) => {
                    let told: Value = serde_json::from_str(&text).unwrap();
                    if told["is"] == "gap" {
                        gaps.push((told["before_cycle"].as_u64().unwrap(), told["lost"].as_u64().unwrap()));
                    }
                }
                _ => {}
            }
            // Long enough for a reader's buffer of a second to run over.
            if cycles.len() > 200 && gaps.is_empty() {
                kill(pid, Signal::SIGSTOP).unwrap();
                std::thread::sleep(std::time::Duration::from_millis(2500));
                kill(pid, Signal::SIGCONT).unwrap();
            }
        }
        let [(before, lost)] = gaps[..] else { panic!("{gaps:?}") };
        let last = cycles.iter().rfind(|cycle| **cycle < before).unwrap();
        let found = cycles.iter().find(|cycle| **cycle > *last).unwrap();
        println!("cycles {last} to {found}: {lost} lost");
        assert_eq!(*found, before, "the gap is told at another place than it is");
        // Cycles that the plant skipped itself are no loss.
        assert!((1000..before - last).contains(&lost), "{lost} of {} cycles", before - last - 1);
        drop(scope);
        end_instance(run, Signal::SIGTERM).expect_code(0);
    });
}

#[test]
fn captures_save_themselves_up_to_the_limit_and_no_further() {
    let place = TestPlace::new();
    let run = armed(&place);
    let folder = place.path("kept");
    let scope = Scope::start(&place, &["--captures", "3", "--out", folder.to_str().unwrap()]);
    let mut socket = scope.socket();
    let mut ask = |request: Value| socket.send(Message::text(request.to_string())).unwrap();
    // Always true: a capture every tenth of a second, without an end.
    let condition = serde_json::json!({ "kind": "level", "level": 0.5, "above": true });
    ask(serde_json::json!({ "do": "auto-save", "on": true }));
    ask(serde_json::json!({ "do": "trigger", "settings": {
        "signal": "feedback.oil_temperature_c", "condition": condition, "mode": "normal", "pre_cycles": 20, "post_cycles": 80,
    }}));
    // Each saved capture is told; without the limit they would go on.
    let mut saved = 0;
    let said = loop {
        let Message::Text(text) = socket.read().unwrap() else { continue };
        let told: Value = serde_json::from_str(&text).unwrap();
        saved += usize::from(told["is"] == "saved");
        assert!(saved <= 3, "{saved} captures saved themselves");
        if told["is"] == "error" {
            break told["text"].as_str().unwrap().to_owned();
        }
    };
    assert!(said.contains("3 captures are saved") && said.contains("--captures"), "{said}");
    assert_eq!(next_text(&mut socket, "trigger")["auto_save"], false);
    // Saving takes longer than finding on a busy machine.
    place.wait_for("the third file", || (segments(&folder).len() >= 3).then_some(()));
    // The trigger goes on, and nothing more is saved of what it finds.
    (0..5).for_each(|_| assert!(next_text(&mut socket, "capture")["id"].is_u64()));
    assert_eq!(segments(&folder).len(), 3);
    drop(scope);
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn in_lockstep_every_payload_is_the_same_beside_a_scope() {
    let place = TestPlace::new();
    let scenario = place.shortened("step-sequence.toml", 60.0, &[]);
    place.simulate(&scenario, "lockstep", "alone").expect_code(0);
    let run = place.start_simulate(&scenario, "lockstep", "beside", &[]);
    let scope = place.wait_for("the instance", || {
        let scope = Scope::try_start(&place, &["--out", place.path("captures").to_str().unwrap()])?;
        scope.page.starts_with("http").then_some(scope)
    });
    let mut socket = scope.socket();
    socket.send(Message::text(r#"{"do":"show","signals":["feedback.angle_rad"]}"#)).unwrap();
    // How much comes at once depends on how busy the machine is.
    let mut bytes = 0;
    while bytes < 4000 {
        match socket.read().expect("the scope saw too little of the run: it was no test") {
            Message::Binary(frame) => bytes += frame.len(),
            Message::Close(_) => panic!("the run ended before the scope saw it: it was no test"),
            _ => {}
        }
    }
    Finished::from(run.wait_with_output().unwrap()).expect_code(0);
    let record = |name: &str| messages(&segments(&place.path(name)));
    assert!(record("alone") == record("beside"), "payloads differ beside a scope");
}

#[test]
fn a_foxglove_viewer_is_sent_what_it_subscribes_to() {
    let place = TestPlace::new();
    let run = armed(&place);
    let scope = Scope::start(&place, &[]);
    let mut request = scope.foxglove.as_str().into_client_request().unwrap();
    let protocols = "foxglove.websocket.v1, foxglove.sdk.v1".parse().unwrap();
    request.headers_mut().insert("Sec-WebSocket-Protocol", protocols);
    let (mut socket, answer) = connect(request).unwrap();
    assert_eq!(answer.headers()["Sec-WebSocket-Protocol"], "foxglove.sdk.v1");
    let mut next = || match socket.read().unwrap() {
        Message::Text(text) => serde_json::from_str::<Value>(&text).unwrap(),
        other => panic!("{other:?}"),
    };
    assert_eq!(next()["op"], "serverInfo");
    let channels = next()["channels"].as_array().unwrap().clone();
    let feedback = channels.iter().find(|channel| channel["topic"] == "/feedback").unwrap();
    assert_eq!((&feedback["encoding"], &feedback["schemaEncoding"]), (&"cdr".into(), &"ros2msg".into()));
    assert!(feedback["schema"].as_str().unwrap().contains("float64 angle_rad"));
    let ask = serde_json::json!({
        "op": "subscribe", "subscriptions": [{ "id": 77, "channelId": feedback["id"] }]
    });
    socket.send(Message::text(ask.to_string())).unwrap();
    let mut cycles = Vec::new();
    while cycles.len() < 500 {
        let Message::Binary(data) = socket.read().unwrap() else { continue };
        assert_eq!(data[0], 1, "opcode");
        assert_eq!(u32::from_le_bytes(data[1..5].try_into().unwrap()), 77);
        assert_eq!(data[13..17], recording::CDR_HEADER);
        let word = |index: usize| u64::from_le_bytes(data[17 + 8 * index..][..8].try_into().unwrap());
        cycles.push(word(4));
    }
    assert!(cycles.is_sorted_by(|a, b| a < b), "{cycles:?}");
    drop(scope);
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn captures_open_without_an_instance_and_bad_input_is_refused() {
    let place = TestPlace::new();
    let scenario = place.shortened("step-sequence.toml", 0.5, &[]);
    place.simulate(&scenario, "in-process", "out").expect_code(0);
    let record = place.path("out/run-0001.mcap");
    let scope = Scope::start(&place, &[record.to_str().unwrap()]);
    let mut socket = scope.socket();
    assert_eq!(next_text(&mut socket, "detached")["alone"], true);
    let list = next_text(&mut socket, "captures");
    assert_eq!(list["open"], record.to_str().unwrap(), "the page would show another file first");
    let show = r#"{"do":"show","signals":["feedback.angle_rad"]}"#;
    socket.send(Message::text(show)).unwrap();
    let open = serde_json::json!({ "do": "open", "file": list["list"][0]["name"] });
    socket.send(Message::text(open.to_string())).unwrap();
    let opened = next_text(&mut socket, "capture");
    assert_eq!(opened["title"], "step sequence");
    next_text(&mut socket, "samples");
    for bad in [r#"{"do":"open","file":"../../etc/passwd"}"#, r#"{"do":"set","angle":1}"#, "nonsense"] {
        socket.send(Message::text(bad)).unwrap();
        next_text(&mut socket, "error");
    }
    place.stepvalve(&["scope"]).expect_code(2);
    let text = place.write("text.mcap", "not a record");
    place.stepvalve(&["scope", text.to_str().unwrap()]).expect_code(2);
    place.stepvalve(&["scope", "--history", "0s", record.to_str().unwrap()]).expect_code(2);
}
