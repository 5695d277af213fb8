//! CiA 402: the drive's states as its status word tells them, and the control word that leads to the next one.
//!
//! ```text
//!  switch-on disabled ─0x06▶ ready to switch on ─0x07▶ switched on ─0x0F▶ operation enabled ─0x02▶ quick stop active
//!        ▲ bit 7, rising       any fault ─▶ fault reaction active ─▶ fault                         │
//!        └──────────────────────────────────────────────────────────┘◀──────────────────────────────┘
//! ```

/// Control words.
pub mod control {
    /// To ready-to-switch-on, from above and from below.
    pub const SHUTDOWN: u16 = 0x06;
    /// To switched-on.
    pub const SWITCH_ON: u16 = 0x07;
    /// To operation-enabled, and while there.
    pub const ENABLE: u16 = 0x0F;
    /// The drive ramps to a stop by itself.
    pub const QUICK_STOP: u16 = 0x02;
    /// Rising: leaves a fault.
    pub const FAULT_RESET: u16 = 0x80;
    /// In homing: begins.
    pub const START_HOMING: u16 = 0x1F;
}

/// The states (CiA 402-2, table 30), and what is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveState {
    /// Starting up.
    NotReady,
    /// Waits for shutdown.
    SwitchOnDisabled,
    /// Waits for switch-on.
    ReadyToSwitchOn,
    /// Carries current, waits for enable.
    SwitchedOn,
    /// Follows.
    OperationEnabled,
    /// Ramps to a stop as asked.
    QuickStopActive,
    /// Ramps to a stop because of a fault.
    FaultReactionActive,
    /// Waits for a reset.
    Fault,
    /// A pattern that the standard doesn't know.
    Unknown,
}

impl DriveState {
    /// The state that a status word tells.
    pub fn of(status: u16) -> Self {
        match (status & 0x4F, status & 0x6F) {
            (0x00, _) => Self::NotReady,
            (0x40, _) => Self::SwitchOnDisabled,
            (0x0F, _) => Self::FaultReactionActive,
            (0x08, _) => Self::Fault,
            (_, 0x21) => Self::ReadyToSwitchOn,
            (_, 0x23) => Self::SwitchedOn,
            (_, 0x27) => Self::OperationEnabled,
            (_, 0x07) => Self::QuickStopActive,
            _ => Self::Unknown,
        }
    }

    /// The state's name in the standard.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotReady => "not ready to switch on",
            Self::SwitchOnDisabled => "switch on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::OperationEnabled => "operation enabled",
            Self::QuickStopActive => "quick stop active",
            Self::FaultReactionActive => "fault reaction active",
            Self::Fault => "fault",
            Self::Unknown => "unknown",
        }
    }

    /// Whether the drive tells a fault.
    pub fn faulty(self) -> bool {
        matches!(self, Self::Fault | Self::FaultReactionActive)
    }
}

/// What is wanted of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// No current.
    Off,
    /// Current, and the command followed.
    On,
    /// Stop by its own ramp, then no current.
    QuickStop,
}

/// Leads the drive, one state a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cia402 {
    resetting: bool,
    reset_wanted: bool,
}

impl Cia402 {
    /// The operator asked for a reset: one rising edge of bit 7, once.
    pub fn reset(&mut self) {
        self.reset_wanted = true;
    }

    /// The control word after a reply that told `state`.
    pub fn control(&mut self, state: DriveState, order: Order) -> u16 {
        if self.resetting {
            // The edge has been seen when the bit falls again.
            self.resetting = false;
            return 0;
        }
        if state == DriveState::Fault && self.reset_wanted {
            (self.reset_wanted, self.resetting) = (false, true);
            return control::FAULT_RESET;
        }
        if !state.faulty() {
            self.reset_wanted = false;
        }
        use DriveState::{OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchedOn};
        match (order, state) {
            (Order::On, ReadyToSwitchOn) => control::SWITCH_ON,
            (Order::On, SwitchedOn | OperationEnabled) => control::ENABLE,
            (Order::QuickStop, OperationEnabled) => control::QUICK_STOP,
            // Through switch-on disabled: not back into operation from here.
            (_, QuickStopActive) => control::QUICK_STOP,
            _ => control::SHUTDOWN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use DriveState::{
        Fault, FaultReactionActive, NotReady, OperationEnabled, QuickStopActive, ReadyToSwitchOn,
        SwitchOnDisabled, SwitchedOn, Unknown,
    };

    /// Every status word there is, against the table of the standard, written as bit patterns.
    #[test]
    fn every_status_word_tells_its_state() {
        let table = [
            ("x0xx0000", NotReady),
            ("x1xx0000", SwitchOnDisabled),
            ("x01x0001", ReadyToSwitchOn),
            ("x01x0011", SwitchedOn),
            ("x01x0111", OperationEnabled),
            ("x00x0111", QuickStopActive),
            ("x0xx1111", FaultReactionActive),
            ("x0xx1000", Fault),
        ];
        for status in 0..=u16::MAX {
            let low = format!("{:08b}", status & 0xFF);
            let fits = |pattern: &str| pattern.chars().zip(low.chars()).all(|(p, b)| p == 'x' || p == b);
            let expected =
                table.iter().find(|(pattern, _)| fits(pattern)).map_or(Unknown, |(_, state)| *state);
            assert_eq!(DriveState::of(status), expected, "{status:#06x}");
        }
    }

    /// Every state under every order.
    #[test]
    fn every_state_gets_its_control_word() {
        let rows = [
            (NotReady, 0x06, 0x06, 0x06),
            (SwitchOnDisabled, 0x06, 0x06, 0x06),
            (ReadyToSwitchOn, 0x06, 0x07, 0x06),
            (SwitchedOn, 0x06, 0x0F, 0x06),
            (OperationEnabled, 0x06, 0x0F, 0x02),
            (QuickStopActive, 0x02, 0x02, 0x02),
            (FaultReactionActive, 0x06, 0x06, 0x06),
            (Fault, 0x06, 0x06, 0x06),
            (Unknown, 0x06, 0x06, 0x06),
        ];
        for (state, off, on, quick_stop) in rows {
            for (order, expected) in [(Order::Off, off), (Order::On, on), (Order::QuickStop, quick_stop)] {
                assert_eq!(Cia402::default().control(state, order), expected, "{state:?} {order:?}");
            }
        }
    }

    #[test]
    fn a_reset_is_one_edge_and_never_without_being_asked() {
        let mut drive = Cia402::default();
        let words: Vec<u16> = (0..3).map(|_| drive.control(Fault, Order::On)).collect();
        assert_eq!(words, [0x06; 3]);
        drive.reset();
        let words: Vec<u16> = (0..4).map(|_| drive.control(Fault, Order::On)).collect();
        assert_eq!(words, [0x80, 0x00, 0x06, 0x06]);
        // Asked for while there is no fault: forgotten.
        drive.reset();
        drive.control(SwitchOnDisabled, Order::Off);
        assert_eq!(drive.control(Fault, Order::Off), 0x06);
    }
}
