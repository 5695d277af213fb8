//! OperatorCommand: arm, disarm, reset, and changes of the controller's parameters.

message! {
    /// An order to the controller, answered in [`crate::ControlStatus`].
    OperatorCommand, "operator-command" {
        /// Counts commands from 1; a command is carried out once.
        id: u64 ["1", Any],
        /// The last cycle in which it may be carried out: an order that was given up has no effect later.
        valid_until_cycle: u64 ["1", Any],
        /// What is wanted, a [`crate::OperatorKind`].
        kind: u64 ["1", Below(crate::OperatorKind::END)],
        /// For a change of a parameter: which, a [`crate::ControlParameter`]; else 0.
        parameter: u64 ["1", Below(crate::ControlParameter::END)],
        /// Its new value, in the parameter's unit.
        value: f64 ["1", Within(-1e9, 1e9)],
    }
}
