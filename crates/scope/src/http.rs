//! The little of HTTP that a page and a WebSocket need, and who is let in.
//!
//! Any program of this machine, and any page that a browser of it has open, can reach the port. So a request needs the token;
//! its Host must be this machine's own address, so that no foreign name that resolves to it gets through (DNS rebinding); and an
//! Origin, which browsers send and pages can't forge, must be the page's own, or one that the user has named.

use crate::token::Token;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// The longest request that is read.
const MOST_HEAD_BYTES: usize = 8 << 10;
const MOST_HEADERS: usize = 64;
/// How long a request may take to arrive.
const PATIENCE: Duration = Duration::from_secs(5);

/// A request, as far as it matters here.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Asked {
    method: String,
    path: String,
    query: String,
    host: Option<String>,
    origin: Option<String>,
    upgrade: bool,
    key: Option<String>,
    protocols: Vec<String>,
}

/// Who is let in.
#[derive(Debug, Clone)]
pub(crate) struct Door {
    pub(crate) token: Token,
    pub(crate) port: u16,
    /// Origins of other pages that the user allows.
    pub(crate) origins: Vec<String>,
}

/// What is done with a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The page.
    Page,
    /// A connection that stays; with the key of its handshake.
    Stay {
        key: String,
        /// Whether a Foxglove viewer asks.
        foxglove: bool,
    },
    /// Refused: status and reason.
    Refused(u16, &'static str),
}

/// What a Foxglove viewer calls the protocol that it speaks.
pub(crate) const FOXGLOVE: &str = "foxglove.sdk.v1";

impl Door {
    /// What becomes of a request.
    pub(crate) fn judge(&self, asked: &Asked) -> Verdict {
        let ours = |host: &str| {
            [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)]
                .contains(&host.to_owned())
        };
        if !asked.host.as_deref().is_some_and(ours) {
            return Verdict::Refused(403, "wrong Host: open the address that stepvalve scope printed");
        }
        let token = asked.query.split('&').find_map(|part| part.strip_prefix("token="));
        if !token.is_some_and(|token| self.token.is(token)) {
            return Verdict::Refused(403, "wrong token: open the address that stepvalve scope printed");
        }
        let known = |origin: &str| {
            origin.strip_prefix("http://").is_some_and(ours) || self.origins.iter().any(|one| one == origin)
        };
        if !asked.origin.as_deref().is_none_or(known) {
            return Verdict::Refused(403, "a page of another origin: --allow-origin lets it in");
        }
        match (asked.method.as_str(), &asked.key) {
            ("GET", Some(key)) if asked.upgrade => {
                let foxglove = asked.protocols.iter().any(|protocol| protocol == FOXGLOVE);
                if !foxglove && !asked.protocols.is_empty() {
                    return Verdict::Refused(
                        400,
                        "unknown WebSocket protocol, expected foxglove.sdk.v1 or none",
                    );
                }
                Verdict::Stay { key: key.clone(), foxglove }
            }
            ("GET", _) if asked.path == "/" => Verdict::Page,
            ("GET", _) => Verdict::Refused(404, "there is only one page"),
            _ => Verdict::Refused(405, "only GET"),
        }
    }
}

/// Reads a request's head. `None` where it is none, too long or too slow.
pub(crate) fn read_head(stream: &mut TcpStream) -> Option<Asked> {
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    let begun = std::time::Instant::now();
    let mut head = Vec::new();
    let mut buffer = [0; 1024];
    loop {
        let count = stream.read(&mut buffer).ok().filter(|count| *count > 0)?;
        head.extend_from_slice(buffer.get(..count)?);
        if let Some(asked) = parse(&head)? {
            return Some(asked);
        }
        if head.len() > MOST_HEAD_BYTES || begun.elapsed() > PATIENCE {
            return None;
        }
    }
}

/// A head from its bytes: `Some(None)` while it is not whole, `None` where it is none.
fn parse(head: &[u8]) -> Option<Option<Asked>> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    if request.parse(head).ok()?.is_partial() {
        return Some(None);
    }
    let target = request.path?;
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let mut asked = Asked {
        method: request.method?.to_owned(),
        path: path.to_owned(),
        query: query.to_owned(),
        ..Asked::default()
    };
    for header in request.headers.iter() {
        let value = std::str::from_utf8(header.value).ok()?.trim();
        match header.name.to_ascii_lowercase().as_str() {
            // Twice is once too often: which one would be meant?
            "host" if asked.host.is_none() => asked.host = Some(value.to_owned()),
            "origin" if asked.origin.is_none() => asked.origin = Some(value.to_owned()),
            "host" | "origin" => return None,
            "upgrade" => asked.upgrade = value.eq_ignore_ascii_case("websocket"),
            "sec-websocket-key" => asked.key = Some(value.to_owned()),
            "sec-websocket-protocol" => {
                asked.protocols.extend(value.split(',').map(|protocol| protocol.trim().to_owned()));
            }
            _ => {}
        }
    }
    Some(Some(asked))
}

/// Sends a whole answer.
pub(crate) fn answer(stream: &mut TcpStream, status: u16, kind: &str, body: &str) {
    let reason = match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        503 => "Service Unavailable",
        _ => "Method Not Allowed",
    };
    let head = format!(
        "HTTP/1.1 {status} {reason}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {}\r\n\
         Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\n\
         X-Frame-Options: DENY\r\nCross-Origin-Resource-Policy: same-origin\r\nConnection: close\r\n\r\n",
        body.len()
    );
    // Who has gone meanwhile needs no answer.
    let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body.as_bytes()));
}

/// Agrees to stay connected.
///
/// # Errors
/// Where the other side is gone.
pub(crate) fn accept(stream: &mut TcpStream, key: &str, foxglove: bool) -> std::io::Result<()> {
    let accepted = tungstenite::handshake::derive_accept_key(key.as_bytes());
    let protocol = if foxglove { format!("Sec-WebSocket-Protocol: {FOXGLOVE}\r\n") } else { String::new() };
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {accepted}\r\n{protocol}\r\n"
    );
    stream.write_all(head.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_page_s_own_browser_and_programs_with_the_token_get_in() {
        let token = Token::draw().unwrap();
        let good = format!("token={}", token.as_str());
        let door = Door { token, port: 7000, origins: vec!["https://app.example".to_owned()] };
        let stays = |head: &str| match parse(head.as_bytes()).flatten().map(|asked| door.judge(&asked)) {
            Some(Verdict::Stay { foxglove, .. }) => if foxglove { "foxglove" } else { "page's" }.to_owned(),
            Some(Verdict::Page) => "page".to_owned(),
            Some(Verdict::Refused(status, _)) => status.to_string(),
            None => "nonsense".to_owned(),
        };
        let ws = "Upgrade: websocket\r\nSec-WebSocket-Key: abc\r\n";
        let fox = format!("{ws}Sec-WebSocket-Protocol: foxglove.websocket.v1, foxglove.sdk.v1\r\n");
        let table = [
            (format!("GET /?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n\r\n"), "page"),
            (format!("GET /?{good} HTTP/1.1\r\nHost: localhost:7000\r\n\r\n"), "page"),
            ("GET / HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n\r\n".to_owned(), "403"),
            ("GET /?token=0 HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n\r\n".to_owned(), "403"),
            (format!("GET /?{good} HTTP/1.1\r\nHost: evil.example:7000\r\n\r\n"), "403"),
            (format!("GET /?{good} HTTP/1.1\r\nHost: 127.0.0.1:7001\r\n\r\n"), "403"),
            (format!("GET /?{good} HTTP/1.1\r\n\r\n"), "403"),
            (
                format!("GET /?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\nHost: evil.example\r\n\r\n"),
                "nonsense",
            ),
            (format!("GET /x?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n\r\n"), "404"),
            (format!("POST /?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n\r\n"), "405"),
            (format!("GET /ws?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{ws}\r\n"), "page's"),
            (
                format!(
                    "GET /ws?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{ws}Origin: http://127.0.0.1:7000\r\n\r\n"
                ),
                "page's",
            ),
            (
                format!(
                    "GET /ws?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{ws}Origin: http://evil.example\r\n\r\n"
                ),
                "403",
            ),
            (format!("GET /ws?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{ws}Origin: null\r\n\r\n"), "403"),
            (
                format!(
                    "GET /ws?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{ws}Origin: https://app.example\r\n\r\n"
                ),
                "page's",
            ),
            (format!("GET /ws?token=1 HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{fox}\r\n"), "403"),
            (format!("GET /?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{fox}\r\n"), "foxglove"),
            (
                format!(
                    "GET /?{good} HTTP/1.1\r\nHost: 127.0.0.1:7000\r\n{ws}Sec-WebSocket-Protocol: x\r\n\r\n"
                ),
                "400",
            ),
            ("nonsense\r\n\r\n".to_owned(), "nonsense"),
        ];
        for (head, expected) in table {
            assert_eq!(stays(&head), expected, "{head}");
        }
    }
}
