//! A record without mistakes, and ways to spoil it.
#![allow(dead_code, reason = "each test takes what it needs")]

use log_data::{Channel, Log, Run};
use log_quality::{Finding, Kind};
use std::f64::consts::TAU;
use valve_model::{FrictionParams, LoadParams, LuGreParams, Model};

pub fn model() -> Model {
    let friction = FrictionParams::LuGre(LuGreParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 2.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        bristle_stiffness_nm_per_rad: 1000.0,
        bristle_damping_nm_s_per_rad: 1.0,
        viscous_nm_s_per_rad: 0.05,
    });
    Model {
        name: "test".to_owned(),
        motor: None,
        load: Some(LoadParams { inertia_kg_m2: 4e-4 }),
        friction,
        orifice: None,
        oil: None,
        clearance: None,
        seals: None,
        effects: Vec::new(),
    }
}

/// Noise of deviation 1, the same every time.
pub fn noise() -> impl FnMut() -> f64 {
    let mut state = 88_172_645_463_325_252_u64;
    move || {
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// Slow and fast sines of 2 s at 1 kHz, torque by the steady curve, at three pressures.
pub fn log() -> Log {
    let mut noise = noise();
    let model = model();
    let runs = (0..6).map(|index| {
        let (hz, speed) = (0.5 + 0.25 * f64::from(index), 1.0 + f64::from(index));
        let time_s: Vec<f64> = (0..2000).map(|row| 10.0 * f64::from(index) + 1e-3 * f64::from(row)).collect();
        let w = TAU * hz;
        let phase = |t: &f64| w * (t - 10.0 * f64::from(index));
        let torque = |t: &f64| {
            let (speed_now, acceleration) = (speed * phase(t).cos(), -speed * w * phase(t).sin());
            model.friction.steady_torque(speed_now) + 4e-4 * acceleration
        };
        Run {
            name: format!("run {index}"),
            angle_rad: time_s
                .iter()
                .map(|t| ((speed / w * phase(t).sin() + 1e-5 * noise()) / 1e-5).round() * 1e-5)
                .collect(),
            torque_nm: Some(time_s.iter().map(|t| torque(t) + 0.01 * noise()).collect()),
            pressure_drop_pa: Some(
                time_s.iter().map(|_| 1e6 * f64::from(1 + index % 3) + 500.0 * noise()).collect(),
            ),
            oil_temperature_c: Some(vec![40.0; 2000]),
            time_s,
            ..Run::default()
        }
    });
    Log { title: "test".to_owned(), runs: runs.collect(), ..Log::default() }
}

pub fn scale(log: &mut Log, channel: Channel, factor: f64) {
    for run in &mut log.runs {
        let mut values = run.take_channel(channel).unwrap();
        values.iter_mut().for_each(|value| *value *= factor);
        run.set_channel(channel, values);
    }
}

pub fn exchange(run: &mut Run, one: Channel, other: Channel) {
    let (first, second) = (run.take_channel(one).unwrap(), run.take_channel(other).unwrap());
    run.set_channel(one, second);
    run.set_channel(other, first);
}

pub fn drain(run: &mut Run, rows: std::ops::Range<usize>) {
    for channel in Channel::ALL {
        if let Some(mut values) = run.take_channel(*channel) {
            values.drain(rows.clone());
            run.set_channel(*channel, values);
        }
    }
}

pub fn named(found: &[Finding], kind: Kind) -> &Finding {
    found.iter().find(|finding| finding.kind == kind).unwrap_or_else(|| panic!("no {kind:?}: {found:#?}"))
}
