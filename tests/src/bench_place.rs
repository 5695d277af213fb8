//! A folder with scenarios and a runtime directory of its own, in which `stepvalve` is run as a user would.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// One test at a time: they share two cores, and some run in real time.
static MACHINE: Mutex<()> = Mutex::new(());

/// Waits until no other test of this program has the machine, and takes it.
pub(crate) fn machine() -> MutexGuard<'static, ()> {
    MACHINE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A change of a shipped scenario: the processes wake before their deadlines, ready themselves and spin.
pub const EARLY: (&str, &str) =
    ("[timing.plant-simulator]", "[timing]\nearly = \"60us\"\n\n[timing.plant-simulator]");

/// The repository's root.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// A program of the workspace, as cargo built it beside this test.
///
/// # Panics
/// Where it is not built: `cargo build --workspace --bins --examples` comes first.
pub fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let path = test.parent().and_then(Path::parent).unwrap().join(name);
    assert!(
        path.exists(),
        "{} is missing: run `cargo build --workspace --bins --examples` first",
        path.display()
    );
    path
}

/// What the names of an instance's shared memory begin with, by its folder.
pub fn shared_memory_prefix(folder: &Path) -> String {
    let hash = crc32c::crc32c(folder.as_os_str().as_encoded_bytes());
    format!("stepvalve_{}_{hash:08x}_", nix::unistd::getuid())
}

/// A run that has ended.
pub struct Finished {
    /// Exit code; `None` where a signal ended it.
    pub code: Option<i32>,
    /// What it printed.
    pub stdout: String,
    /// What it complained of.
    pub stderr: String,
}

impl From<Output> for Finished {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

impl Finished {
    /// The summary of a run with `--json`.
    ///
    /// # Panics
    /// Where stdout is none.
    pub fn summary(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|_| panic!("no summary: {} {}", self.stdout, self.stderr))
    }

    /// Checks the exit code.
    ///
    /// # Panics
    /// Where it is another.
    #[track_caller]
    pub fn expect_code(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        self
    }
}

/// A place for one test.
pub struct TestPlace {
    folder: tempfile::TempDir,
    _machine: MutexGuard<'static, ()>,
}

impl Default for TestPlace {
    fn default() -> Self {
        Self::new()
    }
}

/// Of a model file.
const OWN_LAWS: &str = "
[[effect]]
id = \"formula\"
name = \"own\"
acts_on = \"torque\"
expression = \"a*speed*abs(speed) + 0.05*sin(2*pi*5*time)\"
parameters = { a = 0.02 }

[[effect]]
id = \"table\"
acts_on = \"level\"
over = [\"angle\", \"pressure_drop\"]
knots = [[0.0, 0.5], [0.0, 1e7]]
values = [[0.0, 0.1], [0.1, 0.2]]
";

impl TestPlace {
    /// An empty place; waits until no other test of this program has one.
    pub fn new() -> Self {
        let machine = machine();
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("runtime")).unwrap();
        Self { folder, _machine: machine }
    }

    /// A path in this place.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    }

    /// A copy of a shipped scenario with lines replaced: the first line that begins with the key becomes the text.
    pub fn scenario(&self, shipped: &str, changes: &[(&str, &str)]) -> PathBuf {
        let mut text =
            std::fs::read_to_string(repository().join("rt-config/scenarios").join(shipped)).unwrap();
        for (key, replacement) in changes {
            let line =
                text.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("no line {key}"));
            text = text.replacen(&line.to_owned(), replacement, 1);
        }
        let models = repository().join("rt-config/models");
        let text = text.replace("\"../models/", &format!("\"{}/", models.display()));
        self.write(&format!("scenario-{shipped}"), &text)
    }

    /// The step sequence with a formula and a table in truth and belief, compensated.
    pub fn scenario_with_own_laws(&self) -> PathBuf {
        let rig = std::fs::read_to_string(repository().join("rt-config/models/rig.toml")).unwrap();
        let model = self.write("own.toml", &(rig + OWN_LAWS));
        let [truth, belief] = ["truth", "belief"].map(|of| format!("{of} = \"{}\"", model.display()));
        let level = "level = \"full-with-effects\"";
        let changes = [("truth", truth.as_str()), ("belief", belief.as_str()), ("level", level)];
        self.scenario("step-sequence.toml", &changes)
    }

    /// A shipped scenario that ends after `duration_s`, without the set-points that would come later.
    pub fn shortened(&self, shipped: &str, duration_s: f64, changes: &[(&str, &str)]) -> PathBuf {
        let duration = format!("duration = \"{duration_s}s\"");
        let changes: Vec<_> = changes.iter().copied().chain([("duration", duration.as_str())]).collect();
        let path = self.scenario(shipped, &changes);
        let text = std::fs::read_to_string(&path).unwrap();
        let mut blocks = text.split("[[set_point]]");
        let mut kept = blocks.next().unwrap().to_owned();
        for block in blocks.filter(|block| set_point_time_s(block) < duration_s) {
            kept = kept + "[[set_point]]" + block;
        }
        std::fs::write(&path, kept).unwrap();
        path
    }

    /// A command with this place's runtime directory.
    pub fn command(&self, name: &str) -> Command {
        self.within(Command::new(program(name)))
    }

    /// The same for any command.
    pub fn within(&self, mut command: Command) -> Command {
        command
            .env("XDG_RUNTIME_DIR", self.path("runtime"))
            .env_remove("RUNTIME_DIRECTORY")
            .stdin(Stdio::null());
        command
    }

    /// Runs `stepvalve` to its end.
    pub fn stepvalve(&self, arguments: &[&str]) -> Finished {
        self.command("stepvalve").args(arguments).output().unwrap().into()
    }

    /// Simulates a scenario; the run goes to `out` in this place.
    pub fn simulate(&self, scenario: &Path, mode: &str, out: &str) -> Finished {
        self.start_simulate(scenario, mode, out, &[]).wait_with_output().unwrap().into()
    }

    /// Starts a simulation and returns at once.
    pub fn start_simulate(&self, scenario: &Path, mode: &str, out: &str, more: &[&str]) -> Child {
        let mut command = self.command("stepvalve");
        command
            .args(["simulate", "--json", "--mode", mode, "--out"])
            .arg(self.path(out))
            .arg(scenario)
            .args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// Asserts that nothing is left of any instance of this place: no folder, no shared memory.
    ///
    /// # Panics
    /// Where there is.
    #[track_caller]
    pub fn assert_nothing_left(&self, instances: &[&str]) {
        let base = self.path("runtime/stepvalve");
        let left: Vec<_> =
            std::fs::read_dir(&base).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        assert!(left.is_empty(), "left in the runtime directory: {left:?}");
        for instance in instances {
            let files = self.shared_memory_of(instance);
            assert!(files.is_empty(), "left in shared memory: {files:?}");
        }
    }

    /// The shared-memory files of an instance of this place.
    pub fn shared_memory_of(&self, instance: &str) -> Vec<PathBuf> {
        let prefix = shared_memory_prefix(&self.path("runtime/stepvalve").join(instance));
        let entries = std::fs::read_dir("/dev/shm").unwrap().flatten();
        let ours = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix));
        ours.map(|entry| entry.path()).collect()
    }

    /// Waits until a condition holds.
    ///
    /// # Panics
    /// When it doesn't for a minute.
    #[track_caller]
    pub fn wait_for<T>(&self, what: &str, mut look: impl FnMut() -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            if let Some(found) = look() {
                return found;
            }
            assert!(begun.elapsed() < Duration::from_secs(60), "waited for {what} in vain");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// The process id of a child of `supervisor` that runs this program.
    pub fn child_of(&self, supervisor: u32, name: &str) -> Option<Pid> {
        let children =
            std::fs::read_to_string(format!("/proc/{supervisor}/task/{supervisor}/children")).ok()?;
        let pids = children.split_whitespace().filter_map(|pid| pid.parse::<i32>().ok());
        let runs = |pid: &i32| {
            let link = std::fs::read_link(format!("/proc/{pid}/exe"));
            link.is_ok_and(|path| path.file_name().is_some_and(|file| file == name))
        };
        pids.filter(runs).map(Pid::from_raw).next()
    }
}

/// What a failed test left running goes with its place: a loop in the background would be the next test's trouble.
impl Drop for TestPlace {
    fn drop(&mut self) {
        let variable = format!("XDG_RUNTIME_DIR={}", self.path("runtime").display());
        for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
            let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else { continue };
            let environment = std::fs::read(entry.path().join("environ")).unwrap_or_default();
            if environment.split(|byte| *byte == 0).any(|entry| entry == variable.as_bytes()) {
                let _ = kill(Pid::from_raw(pid), Signal::SIGKILL);
            }
        }
    }
}

/// The time of a set-point's block, in s.
fn set_point_time_s(block: &str) -> f64 {
    let time = block.lines().find_map(|line| line.trim().strip_prefix("time = \"")).unwrap();
    time.split("s\"").next().unwrap().parse().unwrap()
}
