//! Files damaged on purpose.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use injection::SplitSeed;

/// A copy with a few bytes changed, cut out, doubled, or exchanged for another file's.
pub fn changed(details: &mut SplitSeed, all: &[Vec<u8>]) -> Vec<u8> {
    let pick = |details: &mut SplitSeed| all[details.whole(0, all.len() as u64) as usize].clone();
    let mut bytes = pick(details);
    for _ in 0..details.whole(1, 5) {
        let length = bytes.len() as u64;
        let (from, to) = (details.whole(0, length + 1) as usize, details.whole(0, length + 1) as usize);
        let (from, to) = (from.min(to), from.max(to).min(from.min(to) + 64));
        match details.whole(0, 5) {
            0 => drop(bytes.drain(from..to)),
            1 => {
                let again = bytes[from..to].to_vec();
                drop(bytes.splice(from..from, again));
            }
            2 => bytes.truncate(from),
            3 => bytes[from..to].iter_mut().for_each(|byte| *byte = details.whole(0, 256) as u8),
            _ => {
                let other = pick(details);
                let end = to.min(other.len());
                drop(bytes.splice(from..to, other[from.min(end)..end].iter().copied()));
            }
        }
    }
    bytes
}
