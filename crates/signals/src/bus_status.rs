//! BusStatus k: how the bus to a real drive fared in cycle k. For the record and for people; no loop process reads it.

message! {
    /// What the bridge to a real drive knows of its bus at the end of a cycle. The simulator publishes none.
    BusStatus, "bus-status" {
        /// What the bridge is doing with the bus, a [`crate::BusPhase`].
        phase: u64 ["1", Below(crate::BusPhase::END)],
        /// Working counter of the process data in the last reply: 3 where the drive read and wrote them.
        working_counter: u64 ["1", Below(1 << 16)],
        /// AL status of the last reply: the state in bits 0 to 3 (1 INIT, 2 PRE-OP, 4 SAFE-OP, 8 OP), an error in bit 4.
        al_status: u64 ["1", Below(1 << 16)],
        /// AL status code of the last reply; 0 without an error.
        al_code: u64 ["1", Below(1 << 16)],
        /// The drive's status word (0x6041) in the last inputs.
        drive_status: u64 ["1", Below(1 << 16)],
        /// The drive's error code (0x603F) in the last inputs.
        error_code: u64 ["1", Below(1 << 16)],
        /// The drive's mode of operation (0x6061) in the last inputs: 8 is cyclic synchronous position.
        mode: i64 ["1", Within(-128.0, 127.0)],
        /// From sending the last answered frame to its reply.
        round_trip_ns: u64 ["ns", Any],
        /// Where the last answered frame passed the drive in the SYNC0 cycle, less where it should have.
        clock_error_ns: i64 ["ns", Any],
        /// Frames in operation without a good reply since the start: lost, late, or with a wrong working counter.
        lost_frames: u64 ["1", Any],
        /// Replies that came after their cycle since the start.
        late_replies: u64 ["1", Any],
        /// Bring-ups since the start, the look before the first cycle included.
        bring_ups: u64 ["1", Any],
    }
}
