//! Reference + Feedback → StepCommand: friction compensation through the load angle, and the safety state machine.
//!
//! The states are drawn at [`signals::ControllerState`]; which order does what in which state is the table in `orders`.
//! During cycle k the controller turns Feedback k and Reference k+2 into StepCommand k+1, which says where the
//! micro-step command shall be at t_k+2. It knows a model of the valve (its belief), never the plant's truth.
//! No clock, heap, lock or I/O.
#![forbid(unsafe_code)]

mod acceptance;
mod alarms;
mod alignment;
mod analysis;
#[cfg(test)]
#[path = "../tests/common/bench_rig.rs"]
mod bench_rig;
mod benefit;
mod compensation;
mod correction;
mod design;
mod homing;
mod homing_params;
mod homing_state;
mod input;
mod load_share;
mod margins;
mod measure;
mod observer;
mod orders;
mod oscillation;
mod params;
mod partner;
mod re_entry;
mod reception;
mod recovery;
mod riccati;
mod ringing;
mod rotor;
mod shaft;
mod shaper;
mod state;
mod step;
mod supervise;
mod time_scale;
mod track;
mod tuning;
mod window;

pub use correction::LARGEST_ENCODER_DELAY_CYCLES;
pub use homing_params::{Homing, HomingMethod};
pub use input::{Input, Output};
pub use margins::Margins;
pub use observer::{LARGEST_HZ, Observer, ObserverSettings, SLOWEST_HZ};
pub use params::{Compensation, ControlError, LostSteps, Params, ReferenceLimits};
pub use shaft::ShaftFactors;
pub use shaper::Shaper;
pub use state::State;
pub use step::step;
