//! Reference + Feedback → StepCommand: friction compensation through the load angle, and the safety state machine.
//!
//! The states are drawn at [`signals::ControllerState`]; which order does what in which state is the table in `orders`.
//! During cycle k the controller turns Feedback k and Reference k+2 into StepCommand k+1, which says where the
//! micro-step command shall be at t_k+2. It knows a model of the valve (its belief), never the plant's truth.
//! No clock, heap, lock or I/O.
#![forbid(unsafe_code)]

mod acceptance;
mod alignment;
mod analysis;
#[cfg(test)]
#[path = "../tests/common/bench_rig.rs"]
mod bench_rig;
mod compensation;
mod correction;
mod homing;
mod homing_params;
mod homing_state;
mod input;
mod measure;
mod observer;
mod orders;
mod params;
mod partner;
mod reception;
mod recovery;
mod reference;
mod ringing;
mod rotor;
mod state;
mod step;
mod supervise;
mod track;
mod tuning;
mod watch;

pub use correction::LARGEST_ENCODER_DELAY_CYCLES;
pub use homing_params::{Homing, HomingMethod};
pub use input::{Input, Output};
pub use observer::margins::Margins;
pub use observer::shaft::ShaftFactors;
pub use observer::{LARGEST_HZ, Observer, ObserverSettings, SLOWEST_HZ};
pub use params::{Compensation, ControlError, LostSteps, Params, ReferenceLimits};
pub use reference::shaper::Shaper;
pub use state::State;
pub use step::step;
