//! `stepvalve list`: this user's instances, live or dead, in all runtime folders.

use crate::say::say;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Duration;
use supervisor::{
    Failure, FoundInstance, Outcome, ask_status, base_folders, instances, socket_path, whereabouts,
    without_a_folder,
};

/// How long each may take to say how it is.
const PATIENCE: Duration = Duration::from_secs(1);

/// How the list is printed.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Print the list as JSON
    #[arg(long)]
    json: bool,
}

/// An instance, for machines.
#[derive(Debug, Serialize)]
struct Listed {
    /// Unknown where its folder is gone.
    instance: Option<String>,
    /// The controller's state; `dead`, `ends` or `hangs` of the instance itself, `folder-gone` of one that no order reaches.
    state: String,
    fault: Option<String>,
    generation: Option<u64>,
    supervisor: Option<i32>,
    folder: Option<PathBuf>,
    record: Option<PathBuf>,
}

/// Lists them.
///
/// # Errors
/// None; a folder that can't be read holds nothing that this user could ask.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let locks = std::fs::read_to_string("/proc/locks").unwrap_or_default();
    let folders = base_folders();
    let found: Vec<_> =
        folders.iter().flat_map(|base| instances(base, &locks)).map(|one| look(&one)).collect();
    let folderless = without_a_folder(&locks);
    if arguments.json {
        let all: Vec<_> = found.into_iter().chain(folderless.into_iter().map(folder_gone)).collect();
        say(serde_json::to_string_pretty(&all).map_err(anyhow::Error::from)?);
        return Ok(Outcome::Done);
    }
    if found.is_empty() {
        let looked: Vec<_> = folders.iter().map(|folder| folder.display().to_string()).collect();
        let looked = if looked.is_empty() {
            "there is no runtime folder".to_owned()
        } else {
            format!("looked into {}", looked.join(", "))
        };
        say(format_args!(
            "no instances ({looked}); what one that has ended did is in its record's folder: stepvalve events DIR"
        ));
    } else {
        found.iter().for_each(print);
    }
    folderless.into_iter().for_each(|process| say(beyond_orders(process)));
    Ok(Outcome::Done)
}

/// What can be done about an instance whose folder is gone.
pub(crate) fn beyond_orders(process: i32) -> String {
    format!(
        "process {process} supervises an instance whose runtime folder is in none of these places: it was removed, or is elsewhere \
         (XDG_RUNTIME_DIR). No order reaches it from here; `kill {process}` stops its valve and ends it"
    )
}

fn look(found: &FoundInstance) -> Listed {
    let status = found.listens().then(|| ask_status(&socket_path(&found.folder), PATIENCE).ok()).flatten();
    let state = match &status {
        Some(status) => status.state.clone(),
        None if !found.alive => "dead".to_owned(),
        None if found.supervisor.is_some() => "hangs".to_owned(),
        None => "ends".to_owned(),
    };
    let at = whereabouts(&found.folder).ok();
    Listed {
        instance: Some(found.name.clone()),
        state,
        fault: status.as_ref().map(|status| status.fault.clone()).filter(|fault| fault != "none"),
        generation: status.as_ref().map(|status| status.generation),
        supervisor: found.supervisor,
        folder: Some(found.folder.clone()),
        record: at.map(|at| at.record),
    }
}

fn folder_gone(process: i32) -> Listed {
    Listed {
        instance: None,
        state: "folder-gone".to_owned(),
        fault: None,
        generation: None,
        supervisor: Some(process),
        folder: None,
        record: None,
    }
}

fn print(listed: &Listed) {
    let state = match (listed.state.as_str(), &listed.fault) {
        ("dead", _) => "dead: left by a crash, removed by the next start in its folder".to_owned(),
        ("hangs", _) => "its supervisor does not answer".to_owned(),
        ("ends", _) => "its supervisor is gone, its processes end".to_owned(),
        (state, Some(fault)) => format!("{state}: {fault}"),
        (state, None) => state.to_owned(),
    };
    let process = listed.supervisor.map_or(String::new(), |pid| format!(", process {pid}"));
    let record = listed.record.as_ref().map_or(String::new(), |path| format!(", record {}", path.display()));
    let name = listed.instance.as_deref().unwrap_or_default();
    let folder = listed.folder.as_ref().map_or(String::new(), |path| format!(", in {}", path.display()));
    say(format_args!("{name:<16} {state}{process}{record}{folder}"));
}
