//! A valve-log made of any bytes: a byte a sample, so that small inputs reach far into the diagnosis.

use log_data::{AngleZero, Log, Run};

/// A model for logs with torque.
const TORQUE_MODEL: &str = "
format = \"stepvalve-model\"
format_version = 1
name = \"fuzz\"
[load]
inertia_kg_m2 = 1.0e-4
[friction]
law = \"lugre\"
coulomb_torque_nm = 1.5
static_torque_nm = 2.0
stribeck_velocity_rad_per_s = 0.05
stribeck_exponent = 2.0
bristle_stiffness_nm_per_rad = 1000.0
bristle_damping_nm_s_per_rad = 1.0
viscous_nm_s_per_rad = 0.02
";

/// The motor that logs with command and angle need.
const MOTOR: &str = "
[motor]
phases = 5
rotor_teeth = 50
full_steps_per_rev = 500
microsteps_per_full_step = 225
holding_torque_nm = 6.0
rotor_inertia_kg_m2 = 4.0e-4
damping_nm_s_per_rad = 0.02
max_pulse_rate_hz = 600e3
";

/// The log, and the text of a model that may fit it.
pub fn arbitrary_log(bytes: &[u8]) -> (Log, &'static str) {
    let mut bytes = bytes.iter().copied();
    let mut next = || bytes.next().unwrap_or(0);
    let (flags, runs) = (next(), usize::from(next() % 6));
    let has = |bit: u8| flags & (1 << bit) != 0;
    let angle_zero = if has(5) { AngleZero::PerRun } else { AngleZero::Common };
    let steps_s: Vec<f64> = (0..runs).map(|_| step_s(next())).collect();
    let rest: Vec<u8> = bytes.collect();
    let channels = 1 + (0..4).filter(|bit| has(*bit)).count();
    let length = rest.len() / channels / runs.max(1);
    let mut taken = rest.chunks_exact(length.max(1));
    let mut signal = |scale: f64| -> Vec<f64> {
        taken.next().unwrap_or_default().iter().map(|byte| number(*byte) * scale).collect()
    };
    let mut log = Log { title: "fuzz".to_owned(), angle_zero, ..Log::default() };
    let mut start_s = 0.0;
    for (index, step_s) in steps_s.into_iter().enumerate() {
        let angle_rad = signal(1e-2);
        let time_s: Vec<f64> = (0..angle_rad.len()).map(|row| start_s + row as f64 * step_s).collect();
        start_s += angle_rad.len() as f64 * step_s + 0.5;
        log.runs.push(Run {
            name: format!("run-{index}"),
            time_s,
            torque_nm: has(0).then(|| signal(0.1)),
            pressure_drop_pa: has(1).then(|| signal(1e5)),
            oil_temperature_c: has(2).then(|| signal(0.5)),
            angle_command_rad: has(3).then(|| signal(1e-2)),
            angle_rad,
            ..Run::default()
        });
    }
    (log, if has(0) { TORQUE_MODEL } else { angle_model() })
}

fn angle_model() -> &'static str {
    static TEXT: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    TEXT.get_or_init(|| format!("{TORQUE_MODEL}{MOTOR}"))
}

/// A sample's value, a few of them none at all.
fn number(byte: u8) -> f64 {
    match byte {
        0x80 => f64::NAN,
        0x81 => 1e300,
        0x82 => -1e-310,
        _ => f64::from(byte.cast_signed()),
    }
}

/// The time between two samples; most are usual.
fn step_s(byte: u8) -> f64 {
    match byte {
        0 => 1e-9,
        1 => 10.0,
        2 => -1e-3,
        3 => 0.0,
        _ => 1e-3 * f64::from(1 + byte % 4),
    }
}
