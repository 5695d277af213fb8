//! Which column of a run carries which field of which message, so that every field is found by a plain name.

use crate::{Body, BusStatus, ControlStatus, Feedback, PlantTruth, Reference, StepCommand};

/// A column of a closed-loop run, taken from a message as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunColumn {
    /// Its name in the run.
    pub name: &'static str,
    /// The message's topic.
    pub topic: &'static str,
    /// The field.
    pub field: &'static str,
}

const fn column(name: &'static str, topic: &'static str, field: &'static str) -> RunColumn {
    RunColumn { name, topic, field }
}

/// The columns of a run that stand beside those that models know, in their order. Row k holds Reference k, StepCommand k, Feedback k,
/// ControlStatus k and PlantTruth k, or with a real drive BusStatus k.
pub const RUN_COLUMNS: &[RunColumn] = &[
    column("reference_angle", Reference::TOPIC, "angle_rad"),
    column("reference_speed", Reference::TOPIC, "speed_rad_per_s"),
    column("reference_acceleration", Reference::TOPIC, "acceleration_rad_per_s2"),
    column("reference_jerk", Reference::TOPIC, "jerk_rad_per_s3"),
    column("reference_target_angle", Reference::TOPIC, "target_angle_rad"),
    column("reference_moving", Reference::TOPIC, "moving"),
    column("reference_time_scale", Reference::TOPIC, "time_scale"),
    column("set_point_id", Reference::TOPIC, "set_point_id"),
    column("set_point_kind", Reference::TOPIC, "set_point_kind"),
    column("refused_set_point_id", Reference::TOPIC, "refused_id"),
    column("set_point_refusal", Reference::TOPIC, "refusal"),
    column("held_flow", Reference::TOPIC, "held_flow"),
    column("position_microsteps", StepCommand::TOPIC, "position_microsteps"),
    column("position_unrounded", StepCommand::TOPIC, "position_unrounded"),
    column("commanded_pulse_rate", StepCommand::TOPIC, "pulse_rate_hz"),
    column("torque_feed_forward", StepCommand::TOPIC, "torque_feed_forward_nm"),
    column("command_follow", StepCommand::TOPIC, "follow"),
    column("command_follow_id", StepCommand::TOPIC, "follow_id"),
    column("command_energise", StepCommand::TOPIC, "energise"),
    column("command_current_ratio", StepCommand::TOPIC, "current_ratio"),
    column("command_zero_id", StepCommand::TOPIC, "zero_id"),
    column("zero_shift", StepCommand::TOPIC, "zero_shift_rad"),
    column("zero_shift_microsteps", StepCommand::TOPIC, "zero_shift_microsteps"),
    column("zero_in_doubt", StepCommand::TOPIC, "zero_in_doubt"),
    column("encoder_counts", Feedback::TOPIC, "encoder_counts"),
    column("measured_angle", Feedback::TOPIC, "angle_rad"),
    column("accepted_microsteps", Feedback::TOPIC, "accepted_microsteps"),
    column("pulse_rate", Feedback::TOPIC, "pulse_rate_hz"),
    column("measured_pressure_drop", Feedback::TOPIC, "pressure_drop_pa"),
    column("measured_oil_temperature", Feedback::TOPIC, "oil_temperature_c"),
    column("validity", Feedback::TOPIC, "validity"),
    column("drive_fault", Feedback::TOPIC, "drive_fault"),
    column("drive_status_word", Feedback::TOPIC, "status_word"),
    column("digital_inputs", Feedback::TOPIC, "digital_inputs"),
    column("accepted_command_cycle", Feedback::TOPIC, "command_cycle"),
    column("zero_id", Feedback::TOPIC, "zero_id"),
    column("index_angle", Feedback::TOPIC, "index_angle_rad"),
    column("phase_correction", Feedback::TOPIC, "phase_correction_ns"),
    column("state", ControlStatus::TOPIC, "state"),
    column("fault", ControlStatus::TOPIC, "fault"),
    column("fault_cycle", ControlStatus::TOPIC, "fault_cycle"),
    column("controller_following_error", ControlStatus::TOPIC, "following_error_rad"),
    column("controller_following_error_peak", ControlStatus::TOPIC, "following_error_peak_rad"),
    column("friction_estimate", ControlStatus::TOPIC, "friction_estimate_nm"),
    column("disturbance_estimate", ControlStatus::TOPIC, "disturbance_estimate_nm"),
    column("wanted_torque", ControlStatus::TOPIC, "wanted_torque_nm"),
    column("lead_angle", ControlStatus::TOPIC, "lead_angle_rad"),
    column("torque_reserve", ControlStatus::TOPIC, "torque_reserve_nm"),
    column("limiting", ControlStatus::TOPIC, "limiting"),
    column("alarms", ControlStatus::TOPIC, "alarms"),
    column("load_angle", ControlStatus::TOPIC, "load_angle_rad"),
    column("missed_commands", ControlStatus::TOPIC, "missed_commands"),
    column("wanted_time_scale", ControlStatus::TOPIC, "time_scale"),
    column("lost_teeth_noticed", ControlStatus::TOPIC, "lost_teeth"),
    column("tooth_offset", ControlStatus::TOPIC, "tooth_offset"),
    column("operator_command_id", ControlStatus::TOPIC, "operator_id"),
    column("operator_result", ControlStatus::TOPIC, "operator_result"),
    column("homing_phase", ControlStatus::TOPIC, "homing_phase"),
    column("alignment_offset", ControlStatus::TOPIC, "alignment_offset_rad"),
    column("alignment_spread", ControlStatus::TOPIC, "alignment_spread_rad"),
    column("feedback_silent_cycles", ControlStatus::TOPIC, "feedback_silent_cycles"),
    column("reference_silent_cycles", ControlStatus::TOPIC, "reference_silent_cycles"),
    column("true_angle", PlantTruth::TOPIC, "angle_rad"),
    column("true_speed", PlantTruth::TOPIC, "speed_rad_per_s"),
    column("true_command_angle", PlantTruth::TOPIC, "command_angle_rad"),
    column("true_encoder_zero", PlantTruth::TOPIC, "encoder_zero_rad"),
    column("motor_torque", PlantTruth::TOPIC, "motor_torque_nm"),
    column("friction_torque", PlantTruth::TOPIC, "friction_torque_nm"),
    column("other_torque", PlantTruth::TOPIC, "other_torque_nm"),
    column("load_torque", PlantTruth::TOPIC, "load_torque_nm"),
    column("bristle_deflection", PlantTruth::TOPIC, "bristle_deflection_rad"),
    column("true_flow", PlantTruth::TOPIC, "flow_m3_per_s"),
    column("lost_teeth", PlantTruth::TOPIC, "lost_teeth"),
    column("pulses", PlantTruth::TOPIC, "pulses"),
    column("first_pulse", PlantTruth::TOPIC, "first_pulse_ns"),
    column("last_pulse", PlantTruth::TOPIC, "last_pulse_ns"),
    column("bus_phase", BusStatus::TOPIC, "phase"),
    column("bus_working_counter", BusStatus::TOPIC, "working_counter"),
    column("bus_al_status", BusStatus::TOPIC, "al_status"),
    column("bus_al_code", BusStatus::TOPIC, "al_code"),
    column("bus_drive_status", BusStatus::TOPIC, "drive_status"),
    column("bus_error_code", BusStatus::TOPIC, "error_code"),
    column("bus_mode", BusStatus::TOPIC, "mode"),
    column("bus_round_trip", BusStatus::TOPIC, "round_trip_ns"),
    column("bus_clock_error", BusStatus::TOPIC, "clock_error_ns"),
    column("bus_lost_frames", BusStatus::TOPIC, "lost_frames"),
    column("bus_late_replies", BusStatus::TOPIC, "late_replies"),
    column("bus_bring_ups", BusStatus::TOPIC, "bring_ups"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Field;
    use std::collections::BTreeSet;

    #[test]
    fn every_field_of_a_cycle_has_one_column_and_every_column_a_field() {
        let named: BTreeSet<_> = RUN_COLUMNS.iter().map(|column| (column.topic, column.field)).collect();
        let cycle: [(&str, &[Field]); 6] = [
            (Reference::TOPIC, Reference::FIELDS),
            (StepCommand::TOPIC, StepCommand::FIELDS),
            (Feedback::TOPIC, Feedback::FIELDS),
            (ControlStatus::TOPIC, ControlStatus::FIELDS),
            (PlantTruth::TOPIC, PlantTruth::FIELDS),
            (BusStatus::TOPIC, BusStatus::FIELDS),
        ];
        let fields = |(topic, fields): (&'static str, &'static [Field])| {
            fields.iter().map(move |field| (topic, field.name))
        };
        let published: BTreeSet<_> = cycle.into_iter().flat_map(fields).collect();
        assert_eq!(named, published);
        let names: BTreeSet<_> = RUN_COLUMNS.iter().map(|column| column.name).collect();
        assert_eq!(names.len(), RUN_COLUMNS.len());
    }
}
