//! ARCHITECTURE.md's table of allowed edges between crates is the truth, and neither control processes nor their
//! supervisor ever reach HDF5.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand};
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use stepvalve_tests::repository;

/// The workspace as this machine builds it.
fn metadata() -> Metadata {
    let rustc = Command::new("rustc").arg("-vV").output().unwrap().stdout;
    let rustc = String::from_utf8(rustc).unwrap();
    let host = rustc.lines().find_map(|line| line.strip_prefix("host: ")).unwrap();
    let platform = vec!["--filter-platform".to_owned(), host.to_owned()];
    MetadataCommand::new()
        .manifest_path(repository().join("Cargo.toml"))
        .other_options(platform)
        .exec()
        .unwrap()
}

/// The edges that ARCHITECTURE.md allows: rows `| crate | may use |` of the table under "Allowed edges".
fn allowed() -> BTreeMap<String, BTreeSet<String>> {
    let text = std::fs::read_to_string(repository().join("ARCHITECTURE.md")).unwrap();
    let section = text.split("## Allowed edges").nth(1).expect("a section \"Allowed edges\"");
    let section = section.split("\n## ").next().unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| ") && !line.contains("---"));
    let split = |cell: &str| {
        cell.split(',').map(|name| name.trim().to_owned()).filter(|n| !n.is_empty() && n != "-").collect()
    };
    rows.skip(1)
        .map(|row| {
            let cells: Vec<_> = row.trim_matches('|').split('|').map(str::trim).collect();
            (cells[0].to_owned(), split(cells[1]))
        })
        .collect()
}

#[test]
fn crates_use_only_what_the_architecture_allows() {
    let metadata = metadata();
    let members: BTreeSet<_> =
        metadata.workspace_packages().iter().map(|package| package.name.to_string()).collect();
    let allowed = allowed();
    assert_eq!(members, allowed.keys().cloned().collect(), "the table lists just the workspace's crates");
    for package in metadata.workspace_packages() {
        let edges = package.dependencies.iter().filter(|edge| edge.kind != DependencyKind::Development);
        let ours: BTreeSet<_> =
            edges.map(|edge| edge.name.clone()).filter(|name| members.contains(name)).collect();
        let allowed = &allowed[package.name.as_str()];
        assert_eq!(&ours, allowed, "{} (left: in Cargo.toml, right: in ARCHITECTURE.md)", package.name);
    }
}

/// Everything that a package is built from.
fn reach(metadata: &Metadata, name: &str) -> BTreeSet<String> {
    let resolve = metadata.resolve.as_ref().unwrap();
    let name_of = |id: &cargo_metadata::PackageId| metadata[id].name.to_string();
    let mut open: Vec<_> = resolve.nodes.iter().filter(|node| name_of(&node.id) == name).collect();
    let mut reached = BTreeSet::new();
    while let Some(node) = open.pop() {
        for dependency in &node.deps {
            let normal = dependency.dep_kinds.iter().any(|kind| kind.kind == DependencyKind::Normal);
            if normal && reached.insert(name_of(&dependency.pkg)) {
                open.extend(resolve.nodes.iter().find(|node| node.id == dependency.pkg));
            }
        }
    }
    reached
}

#[test]
fn control_processes_and_their_supervisor_never_reach_hdf5() {
    let metadata = metadata();
    assert!(reach(&metadata, "run-log").contains("hdf5-metno"), "this test looks for the right name");
    for package in ["processes", "supervisor"] {
        let reached = reach(&metadata, package);
        for forbidden in
            ["hdf5-metno", "hdf5-metno-sys", "run-log", "report", "diagnosis", "prediction", "stepvalve"]
        {
            assert!(!reached.contains(forbidden), "{package} reaches {forbidden}");
        }
    }
}

#[test]
fn only_signal_bus_reaches_iceoryx2_itself() {
    let metadata = metadata();
    for package in metadata.workspace_packages() {
        let direct = package.dependencies.iter().any(|edge| edge.name == "iceoryx2");
        // The bench measures the bus beside bare iceoryx2.
        assert_eq!(direct, ["bench", "signal-bus"].contains(&package.name.as_str()), "{}", package.name);
    }
}
