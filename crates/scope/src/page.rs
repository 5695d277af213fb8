//! The page: its text, look and scripts in one document, in the style of the reports.

use report::Document;

const STYLE: &str = include_str!("page/scope.css");
const BODY: &str = include_str!("page/scope.html");
/// In the order in which they build on each other.
const SCRIPTS: [&str; 8] = [
    include_str!("page/samples.js"),
    include_str!("page/view.js"),
    include_str!("page/panels.js"),
    include_str!("page/cursors.js"),
    include_str!("page/picker.js"),
    include_str!("page/trigger.js"),
    include_str!("page/captures.js"),
    include_str!("page/main.js"),
];

/// The page.
pub(crate) fn html() -> String {
    Document {
        title: "stepvalve scope",
        style: STYLE,
        body: BODY,
        scripts: &SCRIPTS,
        // Its own server and nothing else.
        connect: "'self' ws://127.0.0.1:* ws://localhost:*",
    }
    .to_html()
}
