//! Makes a campaign with the model's own equations and diagnoses it: `campaign [EFFECT KEY=VALUE...] ...`
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use diagnosis::{Event, OneAfterTheOther, Options, Workers, diagnose};
use log_data::{Log, Run};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use valve_model::*;

struct Two;
impl Workers for Two {
    fn run(&self, count: usize, job: &(dyn Fn(usize) + Sync)) {
        let next = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    loop {
                        let index = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        if index >= count {
                            break;
                        }
                        job(index);
                    }
                });
            }
        });
    }
}

fn model() -> Model {
    Model {
        name: "rig".into(),
        motor: Some(MotorParams {
            phases: 5,
            rotor_teeth: 50,
            full_steps_per_rev: 500,
            microsteps_per_full_step: 225,
            holding_torque_nm: 6.0,
            rotor_inertia_kg_m2: 4e-4,
            damping_nm_s_per_rad: 0.02,
            max_pulse_rate_hz: 600e3,
            supply_voltage_v: None,
            phase_resistance_ohm: None,
            phase_inductance_h: None,
            rated_current_a: None,
            torque_constant_nm_per_a: None,
        }),
        load: Some(LoadParams { inertia_kg_m2: 1e-4 }),
        friction: FrictionParams::LuGre(LuGreParams {
            coulomb_torque_nm: 1.5,
            static_torque_nm: 2.2,
            stribeck_velocity_rad_per_s: 0.05,
            stribeck_exponent: 2.0,
            bristle_stiffness_nm_per_rad: 1000.0,
            bristle_damping_nm_s_per_rad: 1.0,
            viscous_nm_s_per_rad: 0.02,
        }),
        orifice: None,
        oil: None,
        clearance: None,
        seals: None,
        effects: Vec::new(),
    }
}

fn parse() -> (Vec<Effect>, bool, u64) {
    let mut effects = Vec::new();
    let (mut angle, mut seed) = (false, 1);
    let mut arguments = std::env::args().skip(1).peekable();
    while let Some(id) = arguments.next() {
        if id == "angle" {
            angle = true;
            continue;
        }
        if let Some(number) = id.strip_prefix("seed=") {
            seed = number.parse().unwrap();
            continue;
        }
        let mut parts: Vec<(String, EffectValue)> = Vec::new();
        while let Some(next) = arguments.next_if(|next| next.contains('=') && !next.starts_with("seed")) {
            let (key, value) = next.split_once('=').unwrap();
            let value = if value.contains(',') || key == "cos" || key == "sin" {
                EffectValue::List(value.split(',').map(|v| v.parse().unwrap()).collect())
            } else {
                EffectValue::Number(value.parse().unwrap())
            };
            parts.push((key.into(), value));
        }
        let parts: Vec<(&str, EffectValue)> = parts.iter().map(|(k, v)| (k.as_str(), v.clone())).collect();
        effects.push(Effect::from_parts(&id, &parts).unwrap());
    }
    (effects, angle, seed)
}

type Motion2 = Box<dyn Fn(f64) -> f64>;

fn plan() -> Vec<(&'static str, f64, Motion2)> {
    let mut runs: Vec<(&'static str, f64, Motion2)> = Vec::new();
    for speed in [0.05, 0.2, 1.0, 4.0, 10.0] {
        for sign in [1.0, -1.0] {
            runs.push(("constant-velocity", 2.0, Box::new(move |t| sign * speed * t)));
        }
    }
    for (f, a) in [(0.5, 0.5), (1.0, 0.3), (2.0, 0.2), (5.0, 0.08), (0.7, 2.0), (1.3, 1.0)] {
        runs.push(("sine", 2.5, Box::new(move |t: f64| a * (1.0 - (6.283 * f * t).cos()))));
    }
    for s in [0.3, 1.7, 2.9, 4.1] {
        runs.push((
            "multisine",
            2.5,
            Box::new(move |t: f64| {
                [1.0, 2.3, 3.7, 7.1, 13.0, 29.0]
                    .iter()
                    .enumerate()
                    .map(|(k, f)| {
                        0.3 / (1.0 + f * f * 0.5)
                            * ((6.283 * f * t + s * k as f64).sin() - (s * k as f64).sin())
                    })
                    .sum()
            }),
        ));
    }
    for a in [3e-4, 8e-4, 1.5e-3, 2.5e-3] {
        runs.push((
            "presliding",
            2.0,
            Box::new(move |t: f64| a * (6.283 * 1.0 * t).sin() * (t / 2.0).min(1.0)),
        ));
    }
    for rest in [0.3, 0.8, 1.5, 2.5] {
        runs.push((
            "dwell",
            4.0,
            Box::new(move |t: f64| {
                let v = 0.4;
                let mut x = 0.0;
                let mut left = t;
                let mut sign = 1.0;
                while left > 0.0 {
                    x += sign * v * left.min(0.4);
                    left -= 0.4;
                    if left > 0.0 {
                        left -= rest;
                    }
                    sign = -sign;
                }
                x
            }),
        ));
    }
    runs
}

const STEP: f64 = std::f64::consts::TAU / 131_072.0;

fn main() {
    let (effects, angle_log, seed) = parse();
    let nominal = model();
    let truth = Model { effects, ..nominal.clone() };
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let noise = Normal::new(0.0, 0.02).unwrap();
    let mut log = Log { title: "made".into(), ..Log::default() };
    let mut clock = 0.0;
    let mut past = ContactPast::default();
    for (index, (kind, duration, motion)) in plan().into_iter().enumerate() {
        let pressure = [0.0, 4e6, 10e6, 18e6][random.random_range(0..4)];
        let temperature = [25.0, 40.0, 55.0][random.random_range(0..3)];
        let offset: f64 = random.random_range(-2.0..2.0);
        let count = (duration * 1e3) as usize;
        let fine = 10;
        let at = |t: f64| offset + motion(t);
        let mut run = Run { name: format!("r{index:02}-{kind}"), kind: kind.into(), ..Run::default() };
        if angle_log {
            let params = ValveParams::new(&truth).unwrap();
            past.rest_s += 3.0;
            let mut state = params.met_at(at(0.0), 0.0, at(0.0), &past);
            let (mut angle, mut command) = (Vec::new(), Vec::new());
            for k in 0..count {
                let t = k as f64 * 1e-3;
                command.push(at(t));
                if k > 0 {
                    let input = ValveInput {
                        command_start_rad: at(t - 1e-3),
                        command_end_rad: at(t),
                        pressure_drop_pa: pressure,
                        oil_temperature_c: temperature,
                        energised: true,
                    };
                    angle.push(step(&params, &mut state, &input, 1e-3).encoder_angle_rad);
                } else {
                    angle.push(at(0.0));
                }
            }
            run.time_s = (0..count).map(|k| clock + k as f64 * 1e-3).collect();
            run.angle_rad = angle
                .iter()
                .map(|a| ((a + noise.sample(&mut random) * 5e-4) / STEP).round() * STEP)
                .collect();
            run.angle_command_rad = Some(command);
        } else {
            let params = MotionParams::new(&truth).unwrap();
            let m = |t: f64| {
                let h = 1e-4;
                Motion {
                    angle_rad: at(t),
                    speed_rad_per_s: (at(t + h) - at(t - h)) / (2.0 * h),
                    acceleration_rad_per_s2: (at(t + h) - 2.0 * at(t) + at(t - h)) / (h * h),
                }
            };
            past.rest_s += 3.0;
            past.deflection_rad = 0.0;
            let mut state = params.at_start_after(&m(0.0), &past);
            let mut torque = Vec::new();
            let dt = 1e-3 / fine as f64;
            for k in 0..count * fine {
                let t = k as f64 * dt;
                let input = MotionInput {
                    start: m(t - dt),
                    end: m(t),
                    pressure_drop_pa: pressure,
                    oil_temperature_c: temperature,
                };
                let out = motion_step(&params, &mut state, &input, dt);
                if k % fine == 0 {
                    torque.push(out.measured_torque_nm);
                }
            }
            past = state.friction.past();
            run.time_s = (0..count).map(|k| clock + k as f64 * 1e-3).collect();
            prediction::delay(&run.time_s.clone(), &mut torque, params.sensor_delay_s());
            run.angle_rad = (0..count).map(|k| (at(k as f64 * 1e-3) / STEP).round() * STEP).collect();
            run.torque_nm = Some(torque.iter().map(|t| t + noise.sample(&mut random)).collect());
        }
        run.pressure_drop_pa = Some(vec![pressure; count]);
        run.oil_temperature_c = Some(vec![temperature; count]);
        clock += duration + 3.0;
        log.runs.push(run);
    }
    let begin = std::time::Instant::now();
    let _ = OneAfterTheOther;
    let found = diagnose(&log, &nominal, &Options { seed }, &Two, &mut |event| match event {
        Event::Ranking(ranking) => {
            println!("{:.2} s ranking {:?}", begin.elapsed().as_secs_f64(), &ranking[..6.min(ranking.len())])
        }
        other => println!("{:.2} s {other:?}", begin.elapsed().as_secs_f64()),
    })
    .unwrap();
    for (accepted, before, rivals) in &found.rounds {
        println!("round: before {before:.4} accepted {accepted:?} rivals {rivals:?}");
    }
    let d = &found.diagnosis;
    println!("{:.2} s VERDICT {:?} of {} samples", begin.elapsed().as_secs_f64(), d.verdict, found.samples.0);
    for cause in &d.causes {
        println!("  {} gain {:.3}", cause.id, cause.rms_gain);
        for (key, p) in &cause.parameters {
            println!("     {key} = {:.5} [{:.5}, {:.5}]", p.value, p.ci95[0], p.ci95[1]);
        }
    }
    println!("  ambiguous {:?}", d.ambiguous.iter().map(|g| &g.ids).collect::<Vec<_>>());
    println!(
        "  residual {:?}\n  gain {:.4} -> {:.4}  {:?}",
        d.residual, d.gain.rms_before, d.gain.rms_after, d.gain.ratio_ci95
    );
    for s in d.structure_after.iter().take(4) {
        println!("  left: {} friction {} share {:.3}", s.on, s.as_friction, s.share);
    }
}
