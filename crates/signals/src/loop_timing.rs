//! LoopTiming k: how a process kept its cycle k.

message! {
    /// One process's timing in one cycle; each process has a service of its own for it.
    LoopTiming, "loop-timing" {
        /// The absolute time it should have woken at, CLOCK_MONOTONIC.
        deadline_ns: u64 ["ns", Any],
        /// How much later it woke than the deadline that it slept for, which is `deadline_ns` less what was skipped.
        wake_up_latency_ns: u64 ["ns", Any],
        /// Time it spent reading messages.
        read_ns: u64 ["ns", Any],
        /// Time it spent computing.
        step_ns: u64 ["ns", Any],
        /// Time it spent writing the cycle's messages, this one excepted.
        write_ns: u64 ["ns", Any],
        /// Cycles that ran past the next deadline since the start.
        overruns: u64 ["1", Any],
        /// Whole cycles that were skipped for it since the start.
        skipped_cycles: u64 ["1", Any],
        /// Messages lost or refused on the way to this process since the start.
        missed_samples: u64 ["1", Any],
        /// The scheduling obtained, a [`crate::Scheduling`].
        scheduling: u64 ["1", Below(crate::Scheduling::END)],
        /// The real-time priority obtained; 0 under the normal scheduler.
        priority: u64 ["1", Below(100)],
    }
}
