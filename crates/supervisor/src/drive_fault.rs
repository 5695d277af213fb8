//! Why the plant side stopped the valve by itself: remembered, since it says so no longer once it hears the controller again.

use signals::FaultCode;

/// Cycles until a controller that hears the plant side has answered to what that says.
const ANSWERED_WITHIN: u64 = 3;

/// The last fault that the plant side told of, for as long as the controller's own fault is due to it.
#[derive(Debug, Clone, Copy)]
pub struct DriveFault {
    fault: FaultCode,
    /// The last cycle in which it was told.
    cycle: u64,
}

impl DriveFault {
    /// Nothing told so far.
    pub const NONE: Self = Self { fault: FaultCode::None, cycle: 0 };

    /// The fault; none where there is none, or where the controller has left it.
    pub fn fault(self) -> FaultCode {
        self.fault
    }

    /// Takes in the newest cycle and fault of the plant side's, and of the controller's.
    ///
    /// A word of the controller's that says of no fault takes the plant side's back, but not one from before that: while the controller is
    /// stopped its last word is old.
    pub fn take(&mut self, plant: Option<(u64, FaultCode)>, controller: Option<(u64, FaultCode)>) {
        if let Some((cycle, fault)) = plant.filter(|(_, fault)| *fault != FaultCode::None) {
            *self = Self { fault, cycle };
        } else if let Some((cycle, FaultCode::None)) = controller
            && cycle > self.cycle + ANSWERED_WITHIN
        {
            self.fault = FaultCode::None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_kept_until_the_controller_has_answered_and_left_its_fault() {
        const NONE: FaultCode = FaultCode::None;
        const SILENT: FaultCode = FaultCode::CommandSilent;
        // Cycle and fault that the plant side tells, cycle and fault that the controller tells, and what is to be known.
        let table = [
            ((10, NONE), (10, NONE), NONE),
            // The controller is stopped in cycle 10; its last word stays.
            ((20, SILENT), (10, NONE), SILENT),
            ((90, SILENT), (10, NONE), SILENT),
            // It goes on, and the plant side hears it before its first word is there.
            ((92, NONE), (10, NONE), SILENT),
            ((92, NONE), (91, NONE), SILENT),
            ((93, NONE), (93, FaultCode::Drive), SILENT),
            ((500, NONE), (500, FaultCode::Drive), SILENT),
            // An operator resets it.
            ((600, NONE), (600, NONE), NONE),
        ];
        let mut known = DriveFault::NONE;
        for (plant, controller, expected) in table {
            known.take(Some(plant), Some(controller));
            assert_eq!(known.fault(), expected, "{plant:?}, {controller:?}");
        }
    }
}
