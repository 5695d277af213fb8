//! The machine's files, read under a folder that is `/` but in tests.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// Where `/proc`, `/sys` and `/dev` are.
pub struct Root {
    folder: PathBuf,
}

impl Root {
    /// All paths are meant under `folder`.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// Whether this is the machine itself.
    pub fn is_machine(&self) -> bool {
        self.folder == Path::new("/")
    }

    /// A path as the machine has it, where it is here.
    pub fn path(&self, path: &str) -> PathBuf {
        self.folder.join(path.trim_start_matches('/'))
    }

    /// A file's text without white space around it; `None` where it is missing or may not be read.
    pub fn text(&self, path: &str) -> Option<String> {
        self.try_text(path).ok()
    }

    /// The same with the reason.
    ///
    /// # Errors
    /// What the system says.
    pub fn try_text(&self, path: &str) -> io::Result<String> {
        // Bytes first: a process's name need not be UTF-8.
        let bytes = std::fs::read(self.path(path))?;
        Ok(String::from_utf8_lossy(&bytes).trim().to_owned())
    }

    /// The names in a folder, sorted; `None` where it is missing or may not be read.
    pub fn names(&self, path: &str) -> Option<Vec<String>> {
        let entries = std::fs::read_dir(self.path(path)).ok()?.flatten();
        let mut names: Vec<_> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        Some(names)
    }

    /// A file that lists cores, as "0-3,5"; empty for an empty file or "(null)".
    pub fn cores(&self, path: &str) -> Option<BTreeSet<usize>> {
        parse_cores(&self.text(path)?)
    }

    /// Whether a hypervisor stands between this system and the processor: then the kernel does not see all.
    pub fn is_virtual(&self) -> bool {
        let text = self.text("/proc/cpuinfo").unwrap_or_default();
        let mut flags = text.lines().filter(|line| line.starts_with("flags"));
        flags.any(|line| line.split_whitespace().any(|flag| flag == "hypervisor"))
    }

    /// The value of an option of the kernel command line, the last one where it is given several times.
    pub fn command_line_option(&self, name: &str) -> Option<String> {
        let line = self.text("/proc/cmdline")?;
        // What follows "--" is for the first process, not for the kernel.
        let kernels = line.split_whitespace().take_while(|word| *word != "--");
        let values = kernels.filter_map(|word| word.split_once('=')).filter(|(key, _)| *key == name);
        values.last().map(|(_, value)| value.to_owned())
    }
}

/// "0-3,5" as cores; `None` for anything else.
pub fn parse_cores(text: &str) -> Option<BTreeSet<usize>> {
    let mut cores = BTreeSet::new();
    let text = text.trim();
    if text.is_empty() || text == "(null)" {
        return Some(cores);
    }
    for range in text.split(',') {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let (first, last): (usize, usize) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
        cores.extend(first..=last);
    }
    Some(cores)
}

/// Cores as people write them.
pub fn list(cores: &BTreeSet<usize>) -> String {
    let texts: Vec<_> = cores.iter().map(usize::to_string).collect();
    if texts.is_empty() { "none".to_owned() } else { texts.join(",") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_cores() {
        assert_eq!(parse_cores("0-2,5\n").map(|cores| list(&cores)), Some("0,1,2,5".to_owned()));
        assert_eq!(parse_cores("(null)").map(|cores| list(&cores)), Some("none".to_owned()));
        assert_eq!(parse_cores(""), Some(BTreeSet::new()));
        assert_eq!(parse_cores("managed_irq"), None);
    }
}
