//! Whether the valve's angle may be wrong by whole steps: from a fault that says so until it is homed.

use signals::{FaultCode, HomingPhase};

/// Remembered beyond the controller's fault, which a reset leaves, and beyond a restart, which leaves the valve where it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AngleDoubt {
    doubted: bool,
    /// Whether homing was at its end at the last look.
    was_homed: bool,
}

impl AngleDoubt {
    /// As a generation before left it.
    pub fn left(doubted: bool) -> Self {
        Self { doubted, was_homed: false }
    }

    /// Whether the angle is in doubt.
    pub fn is_doubted(self) -> bool {
        self.doubted
    }

    /// Takes in the controller's fault, and where homing is.
    pub fn take(&mut self, fault: FaultCode, homing: HomingPhase) {
        let homed = homing == HomingPhase::Done;
        if homed && !self.was_homed {
            self.doubted = false;
        }
        self.was_homed = homed;
        self.doubted |= fault == FaultCode::LostSteps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_is_in_doubt_from_lost_steps_until_it_is_homed() {
        use FaultCode::{FollowingError, LostSteps, None as Nothing};
        use HomingPhase::{Done, None as Never, Seek};
        let mut doubt = AngleDoubt::default();
        // The controller's fault, where homing is, and whether the angle is in doubt.
        for (fault, homing, doubted) in [
            (Nothing, Never, false),
            (FollowingError, Never, false),
            (LostSteps, Never, true),
            // A reset does not help.
            (Nothing, Never, true),
            (Nothing, Seek, true),
            (Nothing, Done, false),
            (LostSteps, Done, true),
            // What was homed before the steps were lost is of no use.
            (Nothing, Done, true),
            (Nothing, Seek, true),
            (Nothing, Done, false),
        ] {
            doubt.take(fault, homing);
            assert_eq!(doubt.is_doubted(), doubted, "{fault}, {homing}");
        }
        assert!(AngleDoubt::left(true).is_doubted());
    }
}
