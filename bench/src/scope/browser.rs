//! A headless Chromium with one page, spoken to over its debugging socket.

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket, connect};

/// How long it may take to be there, and the page to be loaded.
const PATIENCE: Duration = Duration::from_secs(30);

/// A page in a browser; both end when it is dropped.
pub(super) struct Browser {
    process: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    asked: u64,
    _profile: TempDir,
}

impl Browser {
    /// Opens a page and waits until its scope is there.
    ///
    /// # Errors
    /// Where Chromium is missing, or the page does not come.
    pub(super) fn open(page: &str) -> Result<Self> {
        let program = std::env::var("CHROMIUM").unwrap_or("/usr/bin/chromium".to_owned());
        let profile = tempfile::tempdir()?;
        let mut command = Command::new(&program);
        command.args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-dev-shm-usage",
            "--disable-background-networking",
            "--disable-component-update",
            "--window-size=1400,1000",
            "--remote-debugging-port=0",
        ]);
        command.arg(format!("--user-data-dir={}", profile.path().display())).arg(page);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().with_context(|| program.clone())?;
        let port = process.stderr.take().context("its stderr").and_then(debugging_port);
        let socket = port.and_then(|port| Ok(connect(page_socket(port)?)?.0));
        let socket = match socket {
            Ok(socket) => socket,
            Err(error) => {
                process.kill()?;
                return Err(error);
            }
        };
        let mut browser = Self { process, socket, asked: 0, _profile: profile };
        let begun = Instant::now();
        while browser.evaluate("window.scope?.counts.rows > 100")? != Value::Bool(true) {
            if begun.elapsed() > PATIENCE {
                bail!("the page shows nothing");
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        Ok(browser)
    }

    /// What an expression is on the page.
    ///
    /// # Errors
    /// Where it throws, or the browser is gone.
    pub(super) fn evaluate(&mut self, expression: &str) -> Result<Value> {
        self.asked += 1;
        let asked = json!({
            "id": self.asked, "method": "Runtime.evaluate",
            "params": { "expression": expression, "returnByValue": true },
        });
        self.socket.send(Message::text(asked.to_string()))?;
        loop {
            let Message::Text(text) = self.socket.read()? else { continue };
            let answer: Value = serde_json::from_str(&text)?;
            if answer.get("id").and_then(Value::as_u64) != Some(self.asked) {
                continue;
            }
            if let Some(thrown) = answer.pointer("/result/exceptionDetails") {
                bail!("{expression}: {thrown}");
            }
            return Ok(answer.pointer("/result/result/value").cloned().unwrap_or(Value::Null));
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Chromium says it on stderr, whose rest is read so that it never blocks.
fn debugging_port(stderr: impl Read + Send + 'static) -> Result<u16> {
    let mut lines = BufReader::new(stderr).lines();
    let found = lines.by_ref().find_map(|line| {
        let line = line.ok()?;
        let address = line.split("ws://127.0.0.1:").nth(1)?;
        address.split('/').next()?.parse().ok()
    });
    std::thread::spawn(move || lines.for_each(drop));
    found.context("Chromium tells no debugging port")
}

/// The debugging socket of its one page.
fn page_socket(port: u16) -> Result<String> {
    let begun = Instant::now();
    loop {
        let mut stream = TcpStream::connect(("127.0.0.1", port))?;
        write!(stream, "GET /json/list HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n")?;
        let mut answer = Vec::new();
        // It may keep the connection: what came within a second is all.
        stream.set_read_timeout(Some(Duration::from_secs(1)))?;
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer);
        let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
        let list: Vec<Value> = serde_json::from_str(body).unwrap_or_default();
        let text = |target: &Value, key: &str| Some(target.get(key)?.as_str()?.to_owned());
        let page = list.iter().find(|target| text(target, "type").as_deref() == Some("page"));
        if let Some(url) = page.and_then(|page| text(page, "webSocketDebuggerUrl")) {
            return Ok(url);
        }
        if begun.elapsed() > PATIENCE {
            bail!("Chromium has no page");
        }
    }
}
