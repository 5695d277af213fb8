//! From a validated scenario and its two models to what each process is told.

use crate::controller::ControllerPart;
use crate::encoder::EncoderParams;
use crate::marks::Marks;
use crate::plant::PlantPart;
use crate::plant_start::PlantStart;
use crate::timeline::Timeline;
use crate::trajectory::{DueSetPoint, TrajectoryPart};
use config::{FlowPressure, Scenario, ScheduledSetPoint, SetPoint};
use serde::{Deserialize, Serialize};
use signals::{Feedback, PlantTruth, SetPointKind};
use std::f64::consts::TAU;
use step_control::ObserverSettings;
use thiserror::Error;
use valve_model::{FrictionLaw, LoadParams, Model, MotionParams, MotorParams, ParamError, ValveParams};

// config and step-control may not use each other; here it is checked that they mean the same.
const _: () = assert!(config::LARGEST_ENCODER_DELAY_CYCLES == step_control::LARGEST_ENCODER_DELAY_CYCLES);
const _: () = assert!(config::OBSERVER_BANDWIDTH_HZ.0 == step_control::SLOWEST_HZ);
const _: () = assert!(config::OBSERVER_BANDWIDTH_HZ.1 == step_control::LARGEST_HZ);

/// A scenario that can't be wired. Files that passed `config`'s checks never give one.
#[derive(Debug, Error)]
pub enum WiringError {
    /// A model lacks a section or has a number that no valve can have.
    #[error("{role} model: {source}")]
    Model {
        /// "truth" or "belief".
        role: &'static str,
        /// What is wrong.
        source: ParamError,
    },
    /// The driver's or the controller's settings.
    #[error(transparent)]
    Controller(#[from] step_control::ControlError),
    /// The trajectory's settings.
    #[error(transparent)]
    Trajectory(#[from] trajectory::TrajectoryError),
}

/// What each process is told, and the run's cycles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parts {
    /// The run's cycles.
    pub timeline: Timeline,
    /// For the plant simulator: the truth.
    pub plant: PlantPart,
    /// For the trajectory generator.
    pub trajectory: TrajectoryPart,
    /// For the step controller: the belief.
    pub controller: ControllerPart,
}

impl Parts {
    /// The same where an earlier process left the valve, by its last messages.
    #[must_use]
    pub fn left_by(mut self, feedback: &Feedback, truth: &PlantTruth, absolute_encoder: bool) -> Self {
        let microstep_rad = self.plant.drive.microstep_angle_rad;
        let start = PlantStart::left_by(feedback, truth, microstep_rad, absolute_encoder);
        self.controller.initial_microsteps = start.count_microsteps;
        self.trajectory.initial_angle_rad = feedback.angle_rad;
        self.plant.start = start;
        self
    }

    /// The same valve without the scenario's course: it arms, moves and ends only when it is told to.
    #[must_use]
    pub fn without_end(mut self) -> Self {
        self.timeline = self.timeline.without_end();
        self.plant.timeline = self.timeline;
        self.controller.params.arm_at_cycle = None;
        self.controller.params.disarm_at_cycle = None;
        self.trajectory.set_points.clear();
        self
    }
}

/// Wires a scenario: `truth` becomes the plant, `belief` what the controller knows.
///
/// # Errors
/// [`WiringError`], naming the model or setting.
pub fn wire(scenario: &Scenario, truth: &Model, belief: &Model) -> Result<Parts, WiringError> {
    let (truth_motor, _) = shaft_of(truth, "truth")?;
    let (belief_motor, belief_load) = shaft_of(belief, "belief")?;
    // The driver's micro-step is a fact of the rig; both sides count the same.
    let drive = drive_params(scenario, &truth_motor);
    let timeline = Timeline::new(scenario.period_ns, scenario.duration_s, drive::stop_cycles_bound(&drive));
    let valve = ValveParams::new(truth).map_err(|source| WiringError::Model { role: "truth", source })?;
    let with_effects =
        MotionParams::new(belief).map_err(|source| WiringError::Model { role: "belief", source })?;
    let mut params =
        controller_params(scenario, belief, belief_motor, belief_load, with_effects, drive, &timeline);
    if scenario.control.observer && scenario.encoder.fitted {
        let settings = observer_settings(scenario, &params);
        params = params.with_observer(settings);
    }
    if scenario.control.damping == config::Damping::Shaping {
        params = params.with_shaper();
    }
    params.validate()?;
    let trajectory = trajectory_part(scenario, belief, &timeline, drive.microstep_angle_rad);
    trajectory.params.validate()?;
    let plant = plant_part(scenario, valve, truth_motor, drive, timeline);
    let initial_microsteps = plant.start.count_microsteps;
    let controller = ControllerPart { params, initial_microsteps, zero_in_doubt: false };
    Ok(Parts { timeline, plant, trajectory, controller })
}

/// Wires a scenario with another truth than `like` was wired with, and the same belief: what the controller is told stays, and its
/// observer, whose design takes half as long as a run of seconds, is not designed anew.
///
/// # Errors
/// As [`wire`], which gives the same parts.
pub fn wire_like(
    like: &Parts,
    scenario: &Scenario,
    truth: &Model,
    belief: &Model,
) -> Result<Parts, WiringError> {
    let (truth_motor, _) = shaft_of(truth, "truth")?;
    let drive = drive_params(scenario, &truth_motor);
    if drive != like.plant.drive {
        // The controller counts the truth's micro-steps.
        return wire(scenario, truth, belief);
    }
    let valve = ValveParams::new(truth).map_err(|source| WiringError::Model { role: "truth", source })?;
    Ok(Parts { plant: plant_part(scenario, valve, truth_motor, drive, like.timeline), ..like.clone() })
}

fn shaft_of(model: &Model, role: &'static str) -> Result<(MotorParams, LoadParams), WiringError> {
    let missing = |key: &'static str, expected: &'static str| WiringError::Model {
        role,
        source: ParamError { key, found: "missing".to_owned(), expected },
    };
    let motor = model.motor.ok_or_else(|| missing("motor", "a section [motor]"))?;
    let load = model.load.ok_or_else(|| missing("load", "a section [load]"))?;
    Ok((motor, load))
}

fn drive_params(scenario: &Scenario, motor: &MotorParams) -> drive::Params {
    drive::Params {
        period_s: scenario.period_s(),
        microstep_angle_rad: motor.microstep_angle_rad(),
        max_pulse_rate_hz: scenario.driver.max_pulse_rate_hz,
        max_pulse_acceleration_hz_per_s: scenario.driver.max_pulse_acceleration_hz_per_s,
        quick_stop_deceleration_hz_per_s: scenario.driver.quick_stop_deceleration_hz_per_s,
        after_stop: match scenario.driver.after_stop {
            config::AfterStop::Hold => drive::AfterStop::Hold,
            config::AfterStop::DeEnergise => drive::AfterStop::DeEnergise,
            config::AfterStop::Neutral { angle_rad, speed_rad_per_s } => {
                let microstep_rad = motor.microstep_angle_rad();
                let reach = |end: Option<f64>| end.map_or(0.0, |end| (end - angle_rad).abs());
                let limits = &scenario.limits;
                let longest_rad = reach(limits.min_angle_rad).max(reach(limits.max_angle_rad));
                drive::AfterStop::Neutral {
                    microsteps: (angle_rad / microstep_rad).round() as i64,
                    pulse_rate_hz: speed_rad_per_s / microstep_rad,
                    // Where the valve was led beyond its limits by a following error, it is as far again.
                    longest_way: (2.0 * longest_rad / microstep_rad).ceil(),
                }
            }
        },
        silence_cycles: scenario.safety.silence_cycles,
        energise_cycles: (scenario.driver.energise_time_s / scenario.period_s()).ceil() as u64,
        lowest_angle_rad: scenario
            .limits
            .min_angle_rad
            .map(|lowest| lowest - angle_slack_rad(scenario, motor)),
        highest_angle_rad: scenario
            .limits
            .max_angle_rad
            .map(|highest| highest + angle_slack_rad(scenario, motor)),
        standstill_rad: STANDSTILL_NOISES * scenario.encoder.noise_rad
            + STANDSTILL_COUNTS * TAU / scenario.encoder.counts_per_turn as f64,
    }
}

/// Noise of the encoder, RMS, and counts that a valve at standstill may show.
const STANDSTILL_NOISES: f64 = 8.0;
const STANDSTILL_COUNTS: f64 = 2.5;

/// The guard's margin beyond the limits of angle: the largest permitted following error, at least a quarter of a
/// tooth pitch (load angle 90°).
fn angle_slack_rad(scenario: &Scenario, motor: &MotorParams) -> f64 {
    let quarter_pitch_rad = TAU / f64::from(motor.rotor_teeth) / 4.0;
    scenario.safety.max_following_error_rad.max(quarter_pitch_rad)
}

fn controller_params(
    scenario: &Scenario,
    belief: &Model,
    motor: MotorParams,
    load: LoadParams,
    with_effects: MotionParams,
    drive: drive::Params,
    timeline: &Timeline,
) -> step_control::Params {
    let coulomb_torque_nm = belief.friction.coulomb_torque_nm();
    let viscous_nm_s_per_rad = belief.friction.viscous_nm_s_per_rad();
    step_control::Params {
        period_s: scenario.period_s(),
        loop_delay_cycles: scenario.loop_delay_cycles,
        motor,
        inertia_kg_m2: motor.rotor_inertia_kg_m2 + load.inertia_kg_m2,
        friction: FrictionLaw::new(&belief.friction),
        with_effects,
        coulomb_torque_nm,
        viscous_nm_s_per_rad,
        compensation: match scenario.compensation {
            config::Compensation::None => step_control::Compensation::None,
            config::Compensation::CoulombViscous => step_control::Compensation::CoulombViscous,
            config::Compensation::Full => step_control::Compensation::Full,
            config::Compensation::FullWithEffects => step_control::Compensation::FullWithEffects,
        },
        observer: None,
        shaper: None,
        encoder_delay_cycles: scenario.encoder.delay_cycles,
        homing: scenario.homing.search.map(homing),
        holds_when_disarmed: scenario.driver.holds_when_disarmed,
        lost_steps: match scenario.safety.lost_steps {
            config::LostSteps::Fault => step_control::LostSteps::Fault,
            config::LostSteps::Resynchronise => step_control::LostSteps::Resynchronise,
        },
        drive,
        reference_limits: step_control::ReferenceLimits {
            min_angle_rad: scenario.limits.min_angle_rad,
            max_angle_rad: scenario.limits.max_angle_rad,
            max_speed_rad_per_s: scenario.limits.max_speed_rad_per_s,
            unhomed_speed_rad_per_s: scenario.limits.unhomed_speed_rad_per_s,
        },
        max_following_error_rad: scenario.safety.max_following_error_rad,
        following_error_per_speed_s: scenario.safety.following_error_per_speed_s,
        arm_at_cycle: Some(timeline.arm_cycle),
        disarm_at_cycle: Some(timeline.disarm_cycle),
    }
}

fn homing(search: config::HomingSearch) -> step_control::Homing {
    step_control::Homing {
        method: match search.method {
            config::HomingMethod::Switch => step_control::HomingMethod::Switch,
            config::HomingMethod::Stop => step_control::HomingMethod::Stop,
            config::HomingMethod::Index => step_control::HomingMethod::Index,
            config::HomingMethod::Absolute => step_control::HomingMethod::Absolute,
        },
        speed_rad_per_s: search.speed_rad_per_s,
        angle_rad: search.angle_rad,
        longest_rad: search.longest_rad,
        stop_current: search.stop_current,
        largest_spread_rad: search.largest_spread_rad,
    }
}

fn observer_settings(scenario: &Scenario, params: &step_control::Params) -> ObserverSettings {
    let control = &scenario.control;
    let count_rad = TAU / scenario.encoder.counts_per_turn as f64;
    let noise_rad = scenario.encoder.noise_rad;
    let suited_hz = || params.suited_bandwidth_hz(count_rad, noise_rad);
    ObserverSettings {
        bandwidth_hz: control.observer_bandwidth_hz.unwrap_or_else(suited_hz),
        torque_limit_nm: control.observer_limit * params.motor.holding_torque_nm,
        count_rad,
        noise_rad,
        delay_cycles: scenario.encoder.delay_cycles,
        damps: control.damping == config::Damping::Active,
    }
}

fn plant_part(
    scenario: &Scenario,
    valve: ValveParams,
    motor: MotorParams,
    drive: drive::Params,
    timeline: Timeline,
) -> PlantPart {
    let encoder = scenario.encoder.fitted.then(|| EncoderParams {
        counts_per_turn: scenario.encoder.counts_per_turn as f64,
        noise_rad: scenario.encoder.noise_rad,
        delay_cycles: usize::try_from(scenario.encoder.delay_cycles).unwrap_or(usize::MAX),
        seed: scenario.seed,
    });
    let (angle_rad, homing) = (scenario.initial_angle_rad, &scenario.homing);
    let start = if homing.begins_homed {
        PlantStart::homed(angle_rad, drive.microstep_angle_rad)
    } else {
        PlantStart::switched_on(angle_rad, scenario.encoder.absolute)
    };
    let marks = Marks {
        switch_rad: homing.marks.switch_angle_rad,
        switch_below: homing.search.is_some_and(|search| search.speed_rad_per_s < 0.0),
        index_rad: homing.marks.index_angle_rad,
        low_stop_rad: homing.marks.low_stop_rad,
        high_stop_rad: homing.marks.high_stop_rad,
    };
    let holds = scenario.driver.holds_when_disarmed;
    PlantPart {
        timeline,
        valve,
        motor,
        drive,
        encoder,
        loop_delay_cycles: scenario.loop_delay_cycles,
        start: PlantStart { energised: holds, ..start },
        marks,
        pressure_drop_pa: scenario.pressure_drop.clone(),
        oil_temperature_c: scenario.oil_temperature.clone(),
    }
}

fn trajectory_part(
    scenario: &Scenario,
    belief: &Model,
    timeline: &Timeline,
    microstep_rad: f64,
) -> TrajectoryPart {
    let limits = &scenario.limits;
    TrajectoryPart {
        params: trajectory::Params {
            period_s: scenario.period_s(),
            limits: trajectory::Limits {
                min_angle_rad: limits.min_angle_rad,
                max_angle_rad: limits.max_angle_rad,
                max_speed_rad_per_s: limits.max_speed_rad_per_s,
                max_acceleration_rad_per_s2: limits.max_acceleration_rad_per_s2,
                max_jerk_rad_per_s3: limits.max_jerk_rad_per_s3,
                unhomed_speed_rad_per_s: limits.unhomed_speed_rad_per_s,
            },
            orifice: belief.orifice,
            oil_density_kg_per_m3: belief.oil.map(|oil| oil.density_kg_per_m3),
        },
        initial_angle_rad: scenario.initial_angle_rad,
        set_points: scenario.set_points.iter().map(|point| due(point, timeline, microstep_rad)).collect(),
    }
}

fn due(point: &ScheduledSetPoint, timeline: &Timeline, microstep_rad: f64) -> DueSetPoint {
    let nothing = DueSetPoint::hold(timeline.cycle_of(point.time_s));
    let of = |kind: SetPointKind, value: f64| DueSetPoint { kind: kind.code(), value, ..nothing };
    match point.set_point {
        SetPoint::Angle { angle_rad } => of(SetPointKind::Angle, angle_rad),
        SetPoint::Opening { opening } => of(SetPointKind::Opening, opening),
        SetPoint::Flow { flow_m3_per_s, pressure_drop } => DueSetPoint {
            pressure_drop_pa: match pressure_drop {
                FlowPressure::Measured => None,
                FlowPressure::Given(pressure_pa) => Some(pressure_pa),
            },
            ..of(SetPointKind::Flow, flow_m3_per_s)
        },
        SetPoint::Speed { speed_rad_per_s } => of(SetPointKind::Speed, speed_rad_per_s),
        SetPoint::PulseRate { pulse_rate_hz } => of(SetPointKind::Speed, pulse_rate_hz * microstep_rad),
        SetPoint::Sine { amplitude_rad, frequency_hz } => {
            DueSetPoint { frequency_hz, ..of(SetPointKind::Sine, amplitude_rad) }
        }
        SetPoint::Hold => nothing,
    }
}
