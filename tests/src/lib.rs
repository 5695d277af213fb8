//! What the black-box tests share: the real programs, run in folders of their own, and a look at what they left.
#![forbid(unsafe_code)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "test support: a failure here is the test's message"
)]

mod bench_place;
mod blind;
mod cable;
mod fake_machine;
mod instance;
mod measured_data;
mod payloads;
mod stalls;

pub use bench_place::{EARLY, Finished, TestPlace, program, repository, shared_memory_prefix};
pub use blind::{count, nothing_hidden, ten_strong_effects};
pub use cable::{
    drive_scenario, end_drive, on_a_cable, on_a_cable_in_real_time, patient_drive_scenario, start_drive,
};
pub use fake_machine::FakeMachine;
pub use instance::end_instance;
pub use measured_data::measured_data;
pub use payloads::{Payloads, payloads};
pub use stalls::{despite_stalls, despite_stalls_seen, stood_still_ns};
