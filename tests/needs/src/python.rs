//! The Python of the tests: the one that `STEPVALVE_PYTHON` names, else `tools/.venv`, which `tools/check` prepares.

use crate::skip_without;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The Python, where it imports all of `modules`; otherwise the test is to be skipped, which has been said.
///
/// # Panics
/// Under `STEPVALVE_CI=1`, where it doesn't.
#[must_use]
pub fn python(modules: &[&str]) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/.venv/bin/python");
    let path = std::env::var_os("STEPVALVE_PYTHON").map_or(own, PathBuf::from);
    let import = format!("import {}", modules.join(", "));
    let status = Command::new(&path).args(["-c", &import]).stderr(Stdio::null()).status();
    if status.is_ok_and(|status| status.success()) {
        return Some(path);
    }
    skip_without(&format!("Python with {} ({})", modules.join(", "), path.display()));
    None
}

/// The Python with Selenium, where there is also a Chromium for it (`CHROMIUM` and `CHROMEDRIVER` name others than Debian's).
///
/// # Panics
/// Under `STEPVALVE_CI=1`, where one of them is missing.
#[must_use]
pub fn python_with_browser() -> Option<PathBuf> {
    for (variable, usual) in [("CHROMIUM", "/usr/bin/chromium"), ("CHROMEDRIVER", "/usr/bin/chromedriver")] {
        let path = PathBuf::from(std::env::var_os(variable).unwrap_or_else(|| usual.into()));
        if !path.exists() {
            skip_without(&format!("{} ({variable})", path.display()));
            return None;
        }
    }
    python(&["selenium"])
}
