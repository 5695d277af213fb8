//! Waiting for a frame or for a time, without setting a timer for each frame.

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::time::{TimeSpec, TimeValLike};
use nix::sys::timerfd::{ClockId, Expiration, TimerFd, TimerFlags, TimerSetTimeFlags};
use std::os::fd::AsFd;

/// Wakes at a time on CLOCK_MONOTONIC. It stays set while frames come: a time limit of `poll` is set and cancelled with each of them,
/// which takes a virtual machine more than twice as long as a frame and its reply.
#[derive(Debug)]
pub struct Alarm {
    timer: TimerFd,
    at_ns: u64,
}

impl Alarm {
    /// One that is not set.
    ///
    /// # Errors
    /// What the system says.
    pub fn new() -> nix::Result<Self> {
        Ok(Self { timer: TimerFd::new(ClockId::CLOCK_MONOTONIC, TimerFlags::TFD_CLOEXEC)?, at_ns: 0 })
    }

    /// Waits until `other` can be read, or until `until_ns` at the latest; a time before is kept if it is still to come.
    ///
    /// # Errors
    /// What the system says.
    pub fn wait(&mut self, other: &impl AsFd, now_ns: u64, until_ns: u64) -> nix::Result<()> {
        if self.at_ns <= now_ns || self.at_ns > until_ns {
            let at = TimeSpec::nanoseconds(until_ns.max(1).cast_signed());
            self.timer.set(Expiration::OneShot(at), TimerSetTimeFlags::TFD_TIMER_ABSTIME)?;
            self.at_ns = until_ns;
        }
        let waits = |descriptor| PollFd::new(descriptor, PollFlags::POLLIN);
        poll(&mut [waits(other.as_fd()), waits(self.timer.as_fd())], PollTimeout::NONE)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use realtime::now_ns;
    use std::io::Write;
    use std::os::unix::net::UnixStream;

    #[test]
    fn it_wakes_at_its_time_and_again_and_for_what_comes_before() {
        let (mut near, far) = UnixStream::pair().unwrap();
        let mut alarm = Alarm::new().unwrap();
        for _ in 0..2 {
            let until_ns = now_ns() + 2_000_000;
            alarm.wait(&far, now_ns(), until_ns).unwrap();
            assert!(now_ns() >= until_ns);
        }
        near.write_all(b"x").unwrap();
        let until_ns = now_ns() + 60_000_000_000;
        alarm.wait(&far, now_ns(), until_ns).unwrap();
        assert!(now_ns() < until_ns);
        // An earlier time takes the place of one that is set.
        let (_near, silent) = UnixStream::pair().unwrap();
        alarm.wait(&silent, now_ns(), now_ns() + 2_000_000).unwrap();
        assert!(now_ns() < until_ns);
    }
}
