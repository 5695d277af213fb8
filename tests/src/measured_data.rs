//! Measurements of real drives that nobody made for the tests.

use crate::repository;
use std::path::PathBuf;
use test_needs::skip_on_this_machine;

/// Where they are: `STEPVALVE_DATA`, else beside the repository; `None`, said loudly, where they are absent.
pub fn measured_data() -> Option<PathBuf> {
    let folder =
        std::env::var_os("STEPVALVE_DATA").map_or_else(|| repository().join("../shared/data"), PathBuf::from);
    if folder.join("README.md").exists() {
        return Some(folder);
    }
    skip_on_this_machine(&format!(
        "no measured data in {}: they are no part of the repository, STEPVALVE_DATA names their folder",
        folder.display()
    ));
    None
}
