//! A simulated EtherCAT SubDevice: a stepper drive that moves a simulated valve, for tests of the bridge to real drives.
//!
//! It answers frames as the EtherCAT SubDevice controller (ESC) of a drive does: registers, SII, AL states with their codes,
//! mailbox with CoE, FMMUs and sync managers, distributed clock with SYNC0, process data watchdog; and behind them a CiA 402
//! drive in cyclic synchronous position, or the profile of a pulse-train terminal. It shares no code with the bridge: both were
//! written from the standards (ETG.1000.4, ETG.1000.6, CiA 402), so that a misreading shows as a disagreement.
//!
//! Time comes from outside: `Bus::exchange` takes the present time, so a test may run it without a clock.
#![forbid(unsafe_code)]

mod al;
mod alarm;
mod bus;
mod cia402;
mod clock;
mod coe;
mod device;
mod dictionary;
mod esc;
mod frame;
mod hurt;
mod motion;
mod objects;
mod process;
mod profile;
mod pulse_train;
mod settings;
mod sii;
mod watchdog;

pub use al::AlState;
pub use alarm::Alarm;
pub use bus::Bus;
pub use cia402::DriveState;
pub use device::{Device, SyncRow};
pub use hurt::{Hurt, HurtParseError, Line};
pub use motion::Valve;
pub use process::{DriveProcess, FAR, NEAR, lay_cable, read_log, write_log};
pub use settings::{Identity, Kind, OnMissed, Settings};
