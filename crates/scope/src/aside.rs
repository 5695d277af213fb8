//! Where the scope runs: on the cores that the loop does not use, and behind other work there.

use rustix::process::nice;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// Of two programs that want the same core one with this gets a tenth.
const NICE: i32 = 10;

/// Keeps the calling thread, and those that it starts from now on, off these cores, unless no other is left to it. Without SCHED_FIFO
/// nothing else keeps a scope from delaying a process of the loop. What the kernel refuses costs the scope nothing.
pub(crate) fn stand_aside(loop_cores: &[usize]) {
    let _ = nice(NICE);
    if let Ok(own) = sched_getaffinity(None)
        && let Some(left) = without(&own, loop_cores)
    {
        let _ = sched_setaffinity(None, &left);
    }
}

/// The cores of a set without these; `None` where none would be left.
fn without(own: &CpuSet, cores: &[usize]) -> Option<CpuSet> {
    let mut left = *own;
    cores.iter().filter(|core| **core < CpuSet::MAX_CPU).for_each(|core| left.unset(*core));
    (left.count() > 0).then_some(left)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(cores: &[usize]) -> CpuSet {
        let mut set = CpuSet::new();
        cores.iter().for_each(|core| set.set(*core));
        set
    }

    #[test]
    fn the_loops_cores_are_left_to_it_where_there_are_others() {
        for (own, cores, left) in [
            (&[0, 1][..], &[1, 1, 1][..], Some(&[0][..])),
            (&[0, 1, 2, 3], &[1, 2], Some(&[0, 3])),
            (&[0, 1], &[], Some(&[0, 1])),
            (&[0, 1], &[5000], Some(&[0, 1])),
            (&[1], &[1], None),
            (&[0, 1], &[0, 1], None),
        ] {
            assert_eq!(without(&set(own), cores), left.map(set), "{own:?} without {cores:?}");
        }
    }

    #[test]
    fn threads_that_are_started_later_stand_aside_too() {
        let own = sched_getaffinity(None).unwrap();
        let cores: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|core| own.is_set(*core)).collect();
        let Some((first, others)) = cores.split_first().filter(|(_, others)| !others.is_empty()) else {
            return test_needs::skip_on_this_machine("one core: none to stand aside to");
        };
        // In a thread of its own: neither can be taken back.
        let (first, others) = (*first, set(others));
        let seen = std::thread::spawn(move || {
            stand_aside(&[first]);
            let look = || (nice(0).unwrap(), sched_getaffinity(None).unwrap());
            std::thread::spawn(look).join().unwrap()
        });
        let (at, on) = seen.join().unwrap();
        assert!(at >= NICE.min(19), "nice {at}");
        assert_eq!(on, others);
    }
}
