//! Skipping a test, or a part of one.

use std::io::Write;

/// Says that a test is skipped because something is not installed that `tools/check` installs.
///
/// # Panics
/// Where `STEPVALVE_CI` is 1: there nothing may be missing.
pub fn skip_without(what: &str) {
    #[allow(clippy::panic, reason = "test support: this is the failure of the test that called")]
    if std::env::var_os("STEPVALVE_CI").is_some_and(|value| value == "1") {
        panic!(
            "not installed: {what}; STEPVALVE_CI=1 allows no skipped test (tools/check installs what tests need)"
        );
    }
    say(&format!("not installed: {what}; tools/check installs it"));
}

/// Says that a test is skipped because this machine can't run it: a right, a kernel feature or data that no installation
/// brings. `why` names it. Never fails.
pub fn skip_on_this_machine(why: &str) {
    say(why);
}

/// To the real standard error: the harness captures what `println!` and `eprintln!` say, and no other writes.
fn say(why: &str) {
    let test = std::thread::current();
    let _ = writeln!(std::io::stderr(), "SKIPPED {}: {why}", test.name().unwrap_or("a test"));
}
