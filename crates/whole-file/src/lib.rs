//! Files that appear under their names whole or not at all.
//!
//! A file is written under another name beside the place where it shall appear, brought to the disk, and then renamed, which
//! is one step for everybody who looks. Whatever goes wrong before, a file that stood there is untouched, and no part of the
//! new one is left.
#![forbid(unsafe_code)]

use std::fs::{File, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// A file that is being written. Dropped, it leaves nothing behind.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("belief.toml");
/// let new = whole_file::Partial::beside(&path)?;
/// std::fs::write(new.path(), "name = \"bench rig\"")?;
/// assert!(!path.exists());
/// new.replace()?;
/// assert!(path.exists());
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct Partial {
    temporary: TempPath,
    path: PathBuf,
}

impl Partial {
    /// An empty file in the folder of `path`, which must exist. As of any new file, the umask decides who may read it.
    ///
    /// # Errors
    /// Where the system refuses, or something else than a file has the name. A device must not be replaced, nor a link, behind
    /// which anything may be: `/dev/stdout` is one, to a file where output is redirected.
    pub fn beside(path: &Path) -> io::Result<Self> {
        if std::fs::symlink_metadata(path).is_ok_and(|there| !there.is_file()) {
            return Err(io::Error::new(
                ErrorKind::InvalidInput,
                "no regular file (a link is none), expected one, or none",
            ));
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let temporary = tempfile::Builder::new()
            .prefix(".")
            .suffix(".partial")
            .permissions(Permissions::from_mode(0o666))
            .tempfile_in(folder.unwrap_or(Path::new(".")))?
            .into_temp_path();
        Ok(Self { temporary, path: path.to_owned() })
    }

    /// Where to write meanwhile.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// Gives the file its name. One that has the name already is replaced.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn replace(self) -> io::Result<()> {
        self.to_disk()?;
        self.temporary.persist(&self.path).map_err(|error| error.error)
    }

    /// Gives the file its name, which no other file may have.
    ///
    /// # Errors
    /// [`io::ErrorKind::AlreadyExists`]; or where the system refuses.
    pub fn appear(self) -> io::Result<()> {
        self.to_disk()?;
        self.temporary.persist_noclobber(&self.path).map_err(|error| error.error)
    }

    fn to_disk(&self) -> io::Result<()> {
        File::open(&self.temporary)?.sync_all()
    }
}

/// Writes a file; one that was there is replaced.
///
/// # Errors
/// Where the system refuses.
pub fn write(path: &Path, contents: impl AsRef<[u8]>) -> io::Result<()> {
    let partial = Partial::beside(path)?;
    std::fs::write(partial.path(), contents)?;
    partial.replace()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_is_replaced_in_one_step() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        write(&path, "old").unwrap();
        let new = Partial::beside(&path).unwrap();
        std::fs::write(new.path(), "new").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        new.replace().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(folder.path()), ["a"]);
    }

    #[test]
    fn what_is_given_up_or_refused_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        drop(Partial::beside(&path).unwrap());
        assert!(names(folder.path()).is_empty());
        write(&path, "old").unwrap();
        let error = Partial::beside(&path).unwrap().appear().unwrap_err();
        assert_eq!(error.kind(), ErrorKind::AlreadyExists);
        std::fs::create_dir(folder.path().join("b")).unwrap();
        std::os::unix::fs::symlink("a", folder.path().join("c")).unwrap();
        for not_a_file in ["b", "c"] {
            let error = write(&folder.path().join(not_a_file), "new").unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput);
        }
        assert!(write(&folder.path().join("none/d"), "new").is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        let mut left = names(folder.path());
        left.sort();
        assert_eq!(left, ["a", "b", "c"]);
    }

    #[test]
    fn others_may_read_it_as_any_new_file() {
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("a"), folder.path().join("b"));
        write(&ours, "").unwrap();
        std::fs::write(&plain, "").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
