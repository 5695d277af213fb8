//! Which column of a run carries which field of which message, so that every field is found by a plain name.

use recording::Topic;
use recording::Topic::{BusStatus, ControlStatus, Feedback, PlantTruth, Reference, StepCommand};

/// A column of a closed-loop run, taken from a message as it is.
pub(crate) struct Column {
    /// Its name in the run.
    pub(crate) name: &'static str,
    /// The message.
    pub(crate) topic: Topic,
    /// The field.
    pub(crate) field: &'static str,
}

const fn column(name: &'static str, topic: Topic, field: &'static str) -> Column {
    Column { name, topic, field }
}

/// The columns that stand beside those that models know. Row k holds Reference k, StepCommand k, Feedback k,
/// ControlStatus k and
/// PlantTruth k, or with a real drive BusStatus k.
pub(crate) const COLUMNS: &[Column] = &[
    column("reference_angle", Reference, "angle_rad"),
    column("reference_speed", Reference, "speed_rad_per_s"),
    column("reference_acceleration", Reference, "acceleration_rad_per_s2"),
    column("reference_jerk", Reference, "jerk_rad_per_s3"),
    column("reference_target_angle", Reference, "target_angle_rad"),
    column("reference_moving", Reference, "moving"),
    column("reference_time_scale", Reference, "time_scale"),
    column("set_point_id", Reference, "set_point_id"),
    column("set_point_kind", Reference, "set_point_kind"),
    column("refused_set_point_id", Reference, "refused_id"),
    column("set_point_refusal", Reference, "refusal"),
    column("position_microsteps", StepCommand, "position_microsteps"),
    column("position_unrounded", StepCommand, "position_unrounded"),
    column("commanded_pulse_rate", StepCommand, "pulse_rate_hz"),
    column("torque_feed_forward", StepCommand, "torque_feed_forward_nm"),
    column("command_follow", StepCommand, "follow"),
    column("command_energise", StepCommand, "energise"),
    column("command_current_ratio", StepCommand, "current_ratio"),
    column("command_zero_id", StepCommand, "zero_id"),
    column("zero_shift", StepCommand, "zero_shift_rad"),
    column("zero_shift_microsteps", StepCommand, "zero_shift_microsteps"),
    column("encoder_counts", Feedback, "encoder_counts"),
    column("measured_angle", Feedback, "angle_rad"),
    column("accepted_microsteps", Feedback, "accepted_microsteps"),
    column("pulse_rate", Feedback, "pulse_rate_hz"),
    column("measured_pressure_drop", Feedback, "pressure_drop_pa"),
    column("measured_oil_temperature", Feedback, "oil_temperature_c"),
    column("validity", Feedback, "validity"),
    column("drive_fault", Feedback, "drive_fault"),
    column("drive_status_word", Feedback, "status_word"),
    column("digital_inputs", Feedback, "digital_inputs"),
    column("accepted_command_cycle", Feedback, "command_cycle"),
    column("zero_id", Feedback, "zero_id"),
    column("index_angle", Feedback, "index_angle_rad"),
    column("phase_correction", Feedback, "phase_correction_ns"),
    column("state", ControlStatus, "state"),
    column("fault", ControlStatus, "fault"),
    column("fault_cycle", ControlStatus, "fault_cycle"),
    column("controller_following_error", ControlStatus, "following_error_rad"),
    column("controller_following_error_peak", ControlStatus, "following_error_peak_rad"),
    column("friction_estimate", ControlStatus, "friction_estimate_nm"),
    column("disturbance_estimate", ControlStatus, "disturbance_estimate_nm"),
    column("wanted_torque", ControlStatus, "wanted_torque_nm"),
    column("lead_angle", ControlStatus, "lead_angle_rad"),
    column("torque_reserve", ControlStatus, "torque_reserve_nm"),
    column("limiting", ControlStatus, "limiting"),
    column("alarms", ControlStatus, "alarms"),
    column("load_angle", ControlStatus, "load_angle_rad"),
    column("missed_commands", ControlStatus, "missed_commands"),
    column("wanted_time_scale", ControlStatus, "time_scale"),
    column("lost_teeth_noticed", ControlStatus, "lost_teeth"),
    column("tooth_offset", ControlStatus, "tooth_offset"),
    column("operator_command_id", ControlStatus, "operator_id"),
    column("operator_result", ControlStatus, "operator_result"),
    column("homing_phase", ControlStatus, "homing_phase"),
    column("alignment_offset", ControlStatus, "alignment_offset_rad"),
    column("alignment_spread", ControlStatus, "alignment_spread_rad"),
    column("feedback_silent_cycles", ControlStatus, "feedback_silent_cycles"),
    column("reference_silent_cycles", ControlStatus, "reference_silent_cycles"),
    column("true_angle", PlantTruth, "angle_rad"),
    column("true_speed", PlantTruth, "speed_rad_per_s"),
    column("true_command_angle", PlantTruth, "command_angle_rad"),
    column("true_encoder_zero", PlantTruth, "encoder_zero_rad"),
    column("motor_torque", PlantTruth, "motor_torque_nm"),
    column("friction_torque", PlantTruth, "friction_torque_nm"),
    column("other_torque", PlantTruth, "other_torque_nm"),
    column("load_torque", PlantTruth, "load_torque_nm"),
    column("bristle_deflection", PlantTruth, "bristle_deflection_rad"),
    column("true_flow", PlantTruth, "flow_m3_per_s"),
    column("lost_teeth", PlantTruth, "lost_teeth"),
    column("pulses", PlantTruth, "pulses"),
    column("first_pulse", PlantTruth, "first_pulse_ns"),
    column("last_pulse", PlantTruth, "last_pulse_ns"),
    column("bus_phase", BusStatus, "phase"),
    column("bus_working_counter", BusStatus, "working_counter"),
    column("bus_al_status", BusStatus, "al_status"),
    column("bus_al_code", BusStatus, "al_code"),
    column("bus_drive_status", BusStatus, "drive_status"),
    column("bus_error_code", BusStatus, "error_code"),
    column("bus_mode", BusStatus, "mode"),
    column("bus_round_trip", BusStatus, "round_trip_ns"),
    column("bus_clock_error", BusStatus, "clock_error_ns"),
    column("bus_lost_frames", BusStatus, "lost_frames"),
    column("bus_late_replies", BusStatus, "late_replies"),
    column("bus_bring_ups", BusStatus, "bring_ups"),
];

/// The messages of a cycle.
pub(crate) const TOPICS: [Topic; 6] =
    [Reference, StepCommand, Feedback, ControlStatus, PlantTruth, BusStatus];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_field_of_a_cycle_has_one_column_and_every_column_a_field() {
        let named: BTreeSet<_> = COLUMNS.iter().map(|column| (column.topic, column.field)).collect();
        let fields = |topic: Topic| topic.body_fields().iter().map(move |field| (topic, field.name));
        let published: BTreeSet<_> = TOPICS.into_iter().flat_map(fields).collect();
        assert_eq!(named, published);
        let names: BTreeSet<_> = COLUMNS.iter().map(|column| column.name).collect();
        assert_eq!(names.len(), COLUMNS.len());
        assert!(names.iter().all(|name| log_data::Channel::from_name(name).is_none()));
    }
}
