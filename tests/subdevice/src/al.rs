//! The application layer's states (ETG.1000.6, clause 6): INIT, PRE-OP, SAFE-OP, OP, and the codes of refusals.
//!
//! ```text
//!  INIT ──▶ PRE-OP ──▶ SAFE-OP ──▶ OP
//!   ▲────────┴───────────┴─────────┘  down at any time, on request; by itself with the error bit and a code
//! ```

/// A state, with its code in registers 0x0120 and 0x0130.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum AlState {
    /// No mailbox, no process data.
    Init = 1,
    /// The mailbox works.
    PreOp = 2,
    /// Inputs are good, outputs are ignored.
    SafeOp = 4,
    /// Inputs and outputs.
    Op = 8,
}

impl AlState {
    /// The state of a code, if there is one.
    pub(crate) fn from_code(code: u16) -> Option<Self> {
        match code & 0x0F {
            1 => Some(Self::Init),
            2 => Some(Self::PreOp),
            4 => Some(Self::SafeOp),
            8 => Some(Self::Op),
            _ => None,
        }
    }

    /// The state just above.
    pub(crate) fn next(self) -> Option<Self> {
        match self {
            Self::Init => Some(Self::PreOp),
            Self::PreOp => Some(Self::SafeOp),
            Self::SafeOp => Some(Self::Op),
            Self::Op => None,
        }
    }
}

/// AL status codes (ETG.1000.6, table 11).
pub(crate) mod code {
    pub(crate) const INVALID_STATE_CHANGE: u16 = 0x0011;
    pub(crate) const UNKNOWN_STATE: u16 = 0x0012;
    pub(crate) const INVALID_MAILBOX: u16 = 0x0016;
    pub(crate) const WATCHDOG: u16 = 0x001B;
    pub(crate) const INVALID_OUTPUTS: u16 = 0x001D;
    pub(crate) const INVALID_INPUTS: u16 = 0x001E;
    pub(crate) const NO_SYNC: u16 = 0x002D;
    pub(crate) const INVALID_DC_SYNC: u16 = 0x0030;
    pub(crate) const INVALID_SYNC0_CYCLE: u16 = 0x0036;
}

/// State and error of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Al {
    pub(crate) state: AlState,
    pub(crate) error: bool,
    pub(crate) code: u16,
}

impl Al {
    pub(crate) fn new() -> Self {
        Self { state: AlState::Init, error: false, code: 0 }
    }

    /// Falls back by itself.
    pub(crate) fn fall(&mut self, state: AlState, code: u16) {
        *self = Self { state: self.state.min(state), error: true, code };
    }

    /// What register 0x0130 reads.
    pub(crate) fn status(&self) -> u16 {
        self.state as u16 | if self.error { 0x10 } else { 0 }
    }

    /// A write to register 0x0120; `may_enter` says the code that a step up is refused with.
    pub(crate) fn request(&mut self, control: u16, mut may_enter: impl FnMut(AlState) -> Result<(), u16>) {
        if self.error {
            // An error is kept until it is acknowledged.
            if control & 0x10 == 0 {
                return;
            }
            *self = Self { error: false, code: 0, ..*self };
        }
        let Some(wanted) = AlState::from_code(control) else {
            return self.fall(self.state, code::UNKNOWN_STATE);
        };
        if wanted <= self.state {
            self.state = wanted;
        } else if self.state.next() == Some(wanted) {
            match may_enter(wanted) {
                Ok(()) => self.state = wanted,
                Err(code) => self.fall(self.state, code),
            }
        } else {
            self.fall(self.state, code::INVALID_STATE_CHANGE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_request_in_every_state() {
        use AlState::{Init, Op, PreOp, SafeOp};
        for from in [Init, PreOp, SafeOp, Op] {
            for to in [Init, PreOp, SafeOp, Op] {
                let mut al = Al { state: from, error: false, code: 0 };
                al.request(to as u16, |_| Ok(()));
                let allowed = to <= from || from.next() == Some(to);
                let expected = if allowed { to as u16 } else { from as u16 | 0x10 };
                assert_eq!(al.status(), expected, "{from:?} to {to:?}");
            }
        }
    }

    #[test]
    fn an_error_waits_for_its_acknowledgement() {
        let mut al = Al::new();
        al.request(2, |_| Err(code::INVALID_MAILBOX));
        assert_eq!((al.status(), al.code), (0x11, code::INVALID_MAILBOX));
        al.request(2, |_| Ok(()));
        assert_eq!(al.status(), 0x11);
        al.request(0x12, |_| Ok(()));
        assert_eq!((al.status(), al.code), (2, 0));
    }
}
