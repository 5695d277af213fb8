//! Where instances live: `$RUNTIME_DIRECTORY` or `$XDG_RUNTIME_DIR`, then `stepvalve/NAME/`; and what a name may be.

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs::DirBuilder;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The longest name of an instance: it becomes part of a socket's path, which may have 107 bytes.
const MAX_NAME: usize = 32;

/// An instance's name: letters, digits, `-` and `_`, so that it can never lead out of the folder that it names one in.
///
/// ```
/// use supervisor::InstanceName;
/// assert!("bench-2".parse::<InstanceName>().is_ok());
/// assert!("../../evil".parse::<InstanceName>().is_err());
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String")]
pub struct InstanceName(String);

impl FromStr for InstanceName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let good = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if text.is_empty() || text.len() > MAX_NAME || !text.chars().all(good) {
            return Err(format!(
                "instance name {text:?}: expected 1 to {MAX_NAME} letters, digits, '-' or '_'"
            ));
        }
        Ok(Self(text.to_owned()))
    }
}

impl TryFrom<String> for InstanceName {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl fmt::Display for InstanceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// `$RUNTIME_DIRECTORY/stepvalve` or `$XDG_RUNTIME_DIR/stepvalve`, or where neither is set one in the temporary folder
/// that belongs to this user.
///
/// # Errors
/// Where it can't be made, is a link, belongs to somebody else, or is open to others.
pub fn base_folder() -> Result<PathBuf> {
    let base = base_path();
    make_private(&base).context("XDG_RUNTIME_DIR names where it lies")?;
    Ok(base)
}

/// Where [`base_folder`] is or will be.
pub fn base_path() -> PathBuf {
    let from = |variable: &str| {
        let value = std::env::var(variable).ok()?;
        // systemd separates several by colons; the first is the service's own.
        let first = value.split(':').next().filter(|path| path.starts_with('/'))?;
        Some(PathBuf::from(first).join("stepvalve"))
    };
    from("RUNTIME_DIRECTORY")
        .or_else(|| from("XDG_RUNTIME_DIR"))
        .unwrap_or_else(|| std::env::temp_dir().join(format!("stepvalve-{}", nix::unistd::getuid())))
}

/// The folder of an instance, whether it exists or not.
pub fn instance_folder(base: &Path, name: &InstanceName) -> PathBuf {
    base.join(&name.0)
}

/// Makes a folder for this user alone, or finds that it is one. Whoever may write in it decides whose socket an operator
/// speaks to, so one that somebody else made, opened to others, or put a link in the place of, is refused.
pub(crate) fn make_private(folder: &Path) -> Result<()> {
    let shown = folder.display();
    DirBuilder::new().recursive(true).mode(0o700).create(folder).with_context(|| shown.to_string())?;
    let found = std::fs::symlink_metadata(folder).with_context(|| shown.to_string())?;
    let uid = nix::unistd::getuid();
    if !found.is_dir() {
        bail!("{shown} is a link, expected a folder");
    }
    if found.uid() != uid.as_raw() {
        bail!("{shown} belongs to user {}, expected {uid}", found.uid());
    }
    let mode = found.mode() & 0o777;
    if mode & 0o077 != 0 {
        bail!("{shown} is open to other users (mode {mode:o}), expected 700: chmod 700 {shown}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_checked() {
        for bad in ["", "a/b", "..", "../../evil", "a b", "a\0", &"x".repeat(33)] {
            assert!(bad.parse::<InstanceName>().is_err(), "{bad:?}");
        }
    }
}
