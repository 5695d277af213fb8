//! A cycle of the trajectory does not touch the heap, whatever happens in it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{Rig, endless, limits, set_point, sine};
use realtime::{CountingAllocator, allocations_of_this_thread};
use signals::{ControllerState, SetPoint, SetPointKind};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn no_cycle_allocates() {
    let mut id = 0;
    for limits in [limits(), endless()] {
        let mut rig = Rig::running(limits, 0.0);
        let before = allocations_of_this_thread();
        for round in 0..400 {
            for kind in SetPointKind::ALL {
                id += 1;
                let share = f64::from(round) / 400.0;
                let wish = match kind {
                    SetPointKind::Sine => sine(id, 0.3 * share, 3.0),
                    SetPointKind::Flow => {
                        SetPoint { pressure_drop_pa: 1e6, ..set_point(id, *kind, 2e-3 * share) }
                    }
                    _ => set_point(id, *kind, 1.5 * share - 0.6),
                };
                rig.feedback.pressure_drop_pa = 1e6 * (1.0 + share);
                rig.status.time_scale = if round % 7 == 0 { share } else { 1.0 };
                rig.status.state =
                    if round % 50 == 49 { ControllerState::Fault } else { ControllerState::Running }.code();
                rig.set(&wish);
                for _ in 0..(round % 60) {
                    rig.cycle();
                }
            }
        }
        assert_eq!(allocations_of_this_thread() - before, 0);
    }
    drop(vec![0_u8; 100]);
    assert!(allocations_of_this_thread() > 0, "the allocator counts nothing");
}
