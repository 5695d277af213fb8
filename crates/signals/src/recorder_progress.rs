//! RecorderProgress: how far the recorder has come.

message! {
    /// Published by the recorder after every round; in lockstep the plant waits for it.
    RecorderProgress, "recorder-progress" {
        /// The newest Feedback cycle taken over from shared memory.
        feedback_cycle: u64 ["1", Any],
        /// Messages recorded, all services together.
        recorded: u64 ["1", Any],
        /// Messages known to be lost on the way to the recorder.
        missed: u64 ["1", Any],
        /// Bytes written.
        bytes_written: u64 ["B", Any],
        /// 1 while the disk takes what is written.
        healthy: u64 ["1", Below(2)],
    }
}
