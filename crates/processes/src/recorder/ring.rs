//! Which segments stay: all, or the newest of so many bytes together and those around a fault.

use crate::part::Keep;
use crate::segments::{SegmentName, segments_in};
use std::path::{Path, PathBuf};

/// A ring consists of so many segments: the finer, the less goes at once.
const SEGMENTS_PER_RING: u64 = 16;
/// No segment of a ring is smaller, in bytes: under a second of a 1 kHz loop makes no sense.
const MIN_SEGMENT_BYTES: u64 = 2 << 20;
/// Without a ring a segment ends here, so that none grows without bound.
const SEGMENT_BYTES: u64 = 1 << 30;

/// The rule, and the folder that it is applied to.
pub(crate) struct Ring {
    folder: PathBuf,
    keep: Keep,
}

impl Ring {
    pub(crate) fn new(folder: &Path, keep: Keep) -> Self {
        Self { folder: folder.to_owned(), keep }
    }

    /// The size at which a segment ends.
    pub(crate) fn segment_bytes(&self) -> u64 {
        match self.keep {
            Keep::None | Keep::All => SEGMENT_BYTES,
            Keep::Ring { bytes } => (bytes / SEGMENTS_PER_RING).max(MIN_SEGMENT_BYTES),
        }
    }

    /// Removes the oldest segments until the rest fits. Those kept for a fault may fill half of the ring.
    pub(crate) fn trim(&self, current: u32) {
        let Keep::Ring { bytes } = self.keep else { return };
        let mut left = bytes.saturating_sub(self.segment_bytes());
        for (fault, most) in [(true, bytes / 2), (false, bytes)] {
            let ours = segments_in(&self.folder)
                .into_iter()
                .filter(|name| name.fault == fault && name.number != current);
            let sized: Vec<(SegmentName, u64)> = ours
                .map(|name| {
                    let size = self.size(&name);
                    (name, size)
                })
                .collect();
            let mut total: u64 = sized.iter().map(|(_, size)| size).sum();
            for (name, size) in sized {
                if total <= most.min(left) {
                    break;
                }
                // One that can't be removed is tried again next time.
                if std::fs::remove_file(name.path(&self.folder)).is_ok() {
                    total -= size;
                }
            }
            left = left.saturating_sub(total);
        }
    }

    /// Gives a segment the name under which it stays; without a ring all of them do.
    pub(crate) fn mark_fault(&self, number: u32) {
        if !matches!(self.keep, Keep::Ring { .. }) {
            return;
        }
        let from = SegmentName { number, fault: false }.path(&self.folder);
        let to = SegmentName { number, fault: true }.path(&self.folder);
        // It may be gone already, or marked.
        let _ = std::fs::rename(from, to);
    }

    fn size(&self, name: &SegmentName) -> u64 {
        std::fs::metadata(name.path(&self.folder)).map_or(0, |metadata| metadata.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_go_first_and_faults_stay() {
        let folder = tempfile::tempdir().unwrap();
        let ring = Ring::new(folder.path(), Keep::Ring { bytes: 10 << 20 });
        for number in 1..=8 {
            let file =
                std::fs::File::create(SegmentName { number, fault: false }.path(folder.path())).unwrap();
            file.set_len(2 << 20).unwrap();
        }
        ring.mark_fault(2);
        ring.trim(8);
        let left: Vec<_> = segments_in(folder.path()).iter().map(|name| (name.number, name.fault)).collect();
        // Ten in all: the current one's two, two for the fault, and six more.
        assert_eq!(left, [(2, true), (5, false), (6, false), (7, false), (8, false)]);
        (4..=7).for_each(|number| ring.mark_fault(number));
        ring.trim(8);
        let left: Vec<_> = segments_in(folder.path()).iter().map(|name| (name.number, name.fault)).collect();
        assert_eq!(left, [(6, true), (7, true), (8, false)], "faults fill half of the ring at most");
    }
}
