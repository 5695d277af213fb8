//! The Python package (crates/python): the command's numbers bit for bit, pandas, executors, errors, signals; its types.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::{Path, PathBuf};
use std::process::Command;
use stepvalve_tests::{Finished, TestPlace, program, repository};
use test_needs::python;

/// What the package and its test import.
const MODULES: [&str; 6] = ["h5py", "numpy", "pandas", "matplotlib", "distributed", "mypy"];

/// The package as pip would put it together, of the library that cargo built beside this test.
fn package(place: &TestPlace) -> PathBuf {
    let (from, to) = (repository().join("crates/python/python/stepvalve"), place.path("package/stepvalve"));
    std::fs::create_dir_all(&to).unwrap();
    for file in
        std::fs::read_dir(from).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file())
    {
        std::fs::copy(&file, to.join(file.file_name().unwrap())).unwrap();
    }
    std::fs::copy(program("lib_stepvalve.so"), to.join("_stepvalve.abi3.so")).unwrap();
    place.path("package")
}

fn run(python: &Path, package: &Path, arguments: &[PathBuf]) -> Finished {
    let mut command = Command::new(python);
    command.env("PYTHONPATH", package).env("PYTHONDONTWRITEBYTECODE", "1").args(arguments);
    Finished::from(command.output().unwrap())
}

#[test]
fn python_answers_as_the_command_does() {
    let Some(python) = python(&MODULES) else { return };
    let place = TestPlace::new();
    let package = package(&place);
    let script = repository().join("tests/python/test_package.py");
    let given = [script, program("stepvalve"), program("hidden-effect-rig"), repository()];
    run(&python, &package, &given).expect_code(0);
}

#[test]
fn its_types_hold_and_it_needs_no_hdf5_of_its_own() {
    let Some(python) = python(&MODULES) else { return };
    let place = TestPlace::new();
    let package = package(&place);
    let configuration = repository().join("crates/python/pyproject.toml");
    let words = ["-m", "mypy", "--no-incremental", "--config-file"].map(PathBuf::from);
    let given = [words.to_vec(), vec![configuration, package.join("stepvalve")]].concat();
    run(&python, &package, &given).expect_code(0);
    let needed =
        Command::new("readelf").arg("-d").arg(package.join("stepvalve/_stepvalve.abi3.so")).output().unwrap();
    let needed = String::from_utf8(needed.stdout).unwrap();
    assert!(
        needed.contains("libc.so") && !needed.contains("hdf5") && !needed.contains("libpython"),
        "{needed}"
    );
}
