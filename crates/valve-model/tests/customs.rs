//! Formulas and tables of users: the same as the listed effects that do the same, in a given motion and in a driven valve.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::*;
use proptest::prelude::*;
use valve_model::*;

fn formula(acts_on: ActsOn, text: &str, parameters: &[(&str, f64)]) -> Effect {
    let law = CustomLaw { acts_on, rule: Rule::Formula(text.to_owned()) };
    Effect::custom_named(&format!("own-{}", acts_on.name()), law, parameters).unwrap()
}

fn table(acts_on: ActsOn, axes: &[(Covariate, &[f64])], values: &[&[f64]]) -> Effect {
    let over = axes.iter().map(|axis| axis.0).collect();
    let knots = axes.iter().map(|axis| axis.1.to_vec()).collect();
    let grid = Grid::new(over, knots, values.iter().map(|row| row.to_vec()).collect()).unwrap();
    Effect::custom_named("own-table", CustomLaw { acts_on, rule: Rule::Table(grid) }, &[]).unwrap()
}

fn list(id: &str, cos: f64) -> Effect {
    Effect::from_parts(id, &[("cos", EffectValue::List(vec![cos]))]).unwrap()
}

/// A driven valve with rests, reversals, pressure and warm oil, in cycles of `dt_s`: angle, friction and other torque each
/// millisecond.
fn driven(model: &Model, dt_s: f64) -> Vec<[f64; 3]> {
    let valve = ValveParams::new(model).unwrap();
    let mut state = ValveState::at_rest(0.0);
    let command = |time_s: f64| if time_s < 0.05 { 0.0 } else { 0.3 * (8.0 * (time_s - 0.05)).sin() };
    let cycles = (1e-3 / dt_s).round() as i32;
    let mut found = Vec::new();
    for k in 0..600 * cycles {
        let (start, end) = (dt_s * f64::from(k), dt_s * f64::from(k + 1));
        let ends = input(command(start), command(end));
        let cycle = ValveInput { pressure_drop_pa: -5e6, oil_temperature_c: 55.0, ..ends };
        let out = step(&valve, &mut state, &cycle, dt_s);
        if (k + 1) % cycles == 0 {
            found.push([state.angle_rad, out.friction_torque_nm, out.other_torque_nm]);
        }
    }
    found
}

/// The torques of a given motion of 0.6 s.
fn given(model: &Model) -> Vec<MotionOutput> {
    let params = MotionParams::new(model).unwrap();
    let motion = |k: i32| {
        let (sin, cos) = (9e-3 * f64::from(k)).sin_cos();
        MotionSample {
            angle_rad: 0.4 * sin,
            speed_rad_per_s: 3.6 * cos,
            acceleration_rad_per_s2: -32.4 * sin,
        }
    };
    let mut state = params.at_start(&motion(0));
    let mut step = |k: i32| {
        let (start, end) = (motion(k), motion(k + 1));
        let input = MotionInput { start, end, pressure_drop_pa: -5e6, oil_temperature_c: 55.0 };
        motion_step(&params, &mut state, &input, 1e-3)
    };
    (0..600).map(&mut step).collect()
}

fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Both in a given motion and in a driven valve.
fn assert_same(name: &str, one: Vec<Effect>, other: Vec<Effect>) {
    let (one, other) = (with(one), with(other));
    let torque =
        |model: &Model| -> Vec<f64> { given(model).iter().map(|out| out.measured_torque_nm).collect() };
    for (a, b) in torque(&one).iter().zip(torque(&other)) {
        assert!((a - b).abs() < 1e-9, "{name}: {a} {b}");
    }
    let apart = apart(&driven(&one, 1e-3), &driven(&other, 1e-3));
    assert!(apart < 1e-5, "{name}: {apart}");
}

#[test]
fn they_do_what_listed_effects_do() {
    use ActsOn::{Level, Torque, Viscous};
    let same = |name: &str, own: Effect, listed: Effect| assert_same(name, vec![own], vec![listed]);
    same(
        "pressure",
        formula(Level, "gain*abs(pressure_drop)/1e6", &[("gain", 0.05)]),
        effect("pressure-dependent-friction", &[("gain", 0.05)]),
    );
    same(
        "temperature",
        formula(Level, "beta*(oil_temperature - 40)", &[("beta", -0.01)]),
        effect("temperature-dependent-friction", &[("beta_per_k", -0.01)]),
    );
    same(
        "viscosity",
        formula(Viscous, "exp(-beta*(oil_temperature - 40)) - 1", &[("beta", 0.03)]),
        effect("temperature-dependent-viscosity", &[("beta_per_k", 0.03)]),
    );
    same("position", formula(Torque, "a*cos(angle)", &[("a", 0.2)]), list("position-torque", 0.2));
    same(
        "pressure torque",
        formula(Torque, "0.1*pressure_drop/1e6", &[]),
        effect("pressure-torque", &[("gain", 0.1)]),
    );
    same("angle", formula(Level, "a*cos(angle)", &[("a", 0.2)]), list("angle-dependent-friction", 0.2));
    same(
        "wear",
        formula(Level, "gain*(1 - exp(-distance/s))", &[("gain", 0.5), ("s", 0.8)]),
        effect("wear-drift", &[("gain", 0.5), ("distance_rad", 0.8)]),
    );
}

#[test]
fn a_torque_by_acceleration_is_an_inertia() {
    let heavy = |effects: Vec<Effect>, load: f64| Model {
        load: Some(LoadParams { inertia_kg_m2: load }),
        ..with(effects)
    };
    let own = || formula(ActsOn::Torque, "j*acceleration", &[("j", 3e-4)]);
    let coupling =
        || effect("coupling-compliance", &[("stiffness_nm_per_rad", 800.0), ("damping_nm_s_per_rad", 0.1)]);
    for more in [vec![], vec![coupling()]] {
        let one = driven(&heavy([vec![own()], more.clone()].concat(), 1e-4), 1e-3);
        let other = driven(&heavy(more, 4e-4), 1e-3);
        let angles = one.iter().zip(&other).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f64::max);
        assert!(angles < 1e-7, "{angles}");
    }
    let one = given(&heavy(vec![own()], 1e-4));
    for (a, b) in one.iter().zip(given(&heavy(vec![], 4e-4))) {
        assert!((a.measured_torque_nm - b.measured_torque_nm).abs() < 1e-12);
    }
}

#[test]
fn a_drag_is_added_to_friction() {
    let drag = || formula(ActsOn::Torque, "a*speed*abs(speed)", &[("a", 0.02)]);
    let (plain, dragged) = (given(&with(vec![])), given(&with(vec![drag()])));
    for (k, (plain, dragged)) in plain.iter().zip(&dragged).enumerate() {
        let speed = 3.6 * (9e-3 * (k + 1) as f64).cos();
        let expected = plain.measured_torque_nm + 0.02 * speed * speed.abs();
        assert!((dragged.measured_torque_nm - expected).abs() < 1e-12);
    }
}

/// Within a cycle time, angle and speed go on: the length of the cycle doesn't matter.
#[test]
fn the_cycle_does_not_show() {
    use ActsOn::{Level, Torque, Viscous};
    for own in [
        formula(Torque, "0.3*sin(2*pi*17*time) + 0.02*speed*abs(speed)", &[]),
        formula(Level, "0.3*sin(2*pi*17*time) + 0.1*tanh(speed/0.5) + 0.05*sin(3*angle)", &[]),
        formula(Viscous, "100*abs(speed) + sin(40*time)", &[]),
        table(
            Level,
            &[(Covariate::Time, &[0.0, 0.1, 0.3, 0.4]), (Covariate::Speed, &[-1.0, 0.5, 2.0])],
            &[&[0.0, 0.1, 0.0], &[0.2, 0.1, 0.3], &[0.0, 0.2, 0.1], &[0.1, 0.1, 0.0]],
        ),
    ] {
        for more in [
            vec![],
            vec![effect(
                "coupling-compliance",
                &[("stiffness_nm_per_rad", 800.0), ("damping_nm_s_per_rad", 0.1)],
            )],
        ] {
            let model = with([vec![own.clone()], more].concat());
            // The command's corners are the cycle's: 1 ms apart in both.
            let apart = apart(&driven(&model, 1e-3), &driven(&model, 2.5e-4));
            let plain = with(model.effects.iter().skip(1).cloned().collect());
            let usual = self::apart(&driven(&plain, 1e-3), &driven(&plain, 2.5e-4));
            // A table has corners, which a sub-step may go over.
            let slack = if own.id().name() == "own-table" { 1e-3 } else { 1e-4 };
            assert!(apart < 3.0 * usual + slack, "{own:?}: {apart}, without {usual}");
        }
    }
}

#[test]
fn a_table_is_the_formula_that_it_follows() {
    use Covariate::{PressureDrop, Speed};
    let line = table(ActsOn::Torque, &[(Speed, &[-1.0, 0.0, 0.5])], &[&[-0.05], &[0.0], &[0.025]]);
    assert_same("line", vec![line], vec![formula(ActsOn::Torque, "0.05*speed", &[])]);
    let plane = table(
        ActsOn::Level,
        &[(PressureDrop, &[-1e7, 0.0]), (Speed, &[0.0, 1.0])],
        &[&[0.1, 0.2], &[0.0, 0.0]],
    );
    let same = formula(ActsOn::Level, "-pressure_drop/1e7*(0.1 + 0.1*speed)", &[]);
    assert_same("plane", vec![plane], vec![same]);
}

#[test]
fn they_survive_serialisation() {
    let speed_table = table(ActsOn::Viscous, &[(Covariate::Speed, &[0.0, 1.0])], &[&[0.0], &[1.0]]);
    let model = with(vec![formula(ActsOn::Torque, "a*speed", &[("a", 0.1)]), speed_table]);
    let bytes = postcard::to_stdvec(&model).unwrap();
    assert_eq!(postcard::from_bytes::<Model>(&bytes).unwrap(), model);
    let (valve, motion) = (ValveParams::new(&model).unwrap(), MotionParams::new(&model).unwrap());
    assert_eq!(postcard::from_bytes::<ValveParams>(&postcard::to_stdvec(&valve).unwrap()).unwrap(), valve);
    assert_eq!(postcard::from_bytes::<MotionParams>(&postcard::to_stdvec(&motion).unwrap()).unwrap(), motion);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let made = |name: &str, text: &str, parameters: &[(&str, f64)]| {
        let law = CustomLaw { acts_on: ActsOn::Level, rule: Rule::Formula(text.to_owned()) };
        Effect::custom_named(name, law, parameters).map_err(|error| error.key)
    };
    for name in ["", "2a", "a b", "load-inertia", "a-name-of-more-than-thirty-one-bytes"] {
        assert_eq!(made(name, "speed", &[]), Err("name"), "{name}");
    }
    assert_eq!(made("a", "sped", &[]), Err("expression"));
    assert_eq!(made("a", "k*speed", &[("k", f64::NAN)]), Err("parameters"));
    let own = |name: &str, text: &str| made(name, text, &[]).unwrap();
    let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i"];
    let many = |count: usize| with(names[..count].iter().map(|name| own(name, "0*speed")).collect());
    assert_eq!(many(8).validate(), Ok(()));
    assert_eq!(many(9).validate().unwrap_err().key, "id");
    assert_eq!(with(vec![own("a", "speed"), own("a", "angle")]).validate().unwrap_err().key, "id");
    let by_acceleration = with(vec![own("a", "abs(acceleration)")]);
    assert_eq!(ValveParams::new(&by_acceleration).unwrap_err().key, "acts_on");
    assert!(MotionParams::new(&by_acceleration).is_ok());
}

#[test]
fn poles_within_what_valves_have_are_refused() {
    let found = check_expression("1 + a/(angle - 0.3)", &[("a", 1.0)], ActsOn::Torque).unwrap_err();
    assert_eq!(found.at, 5);
    assert!(found.found.contains("near angle 0.3"), "{found}");
    assert!(check_expression("a*speed*abs(speed)", &[("a", 1.0)], ActsOn::Torque).is_ok());
}

/// What a fit makes of parameters is refused where a file of it would be.
#[test]
fn parameters_that_leave_a_pole_are_refused() {
    for (b, is_refused) in [(0.0, false), (0.5, false), (-1.8, true)] {
        let text = "a*speed*sqrt(b + abs(speed))";
        let law = CustomLaw { acts_on: ActsOn::Torque, rule: Rule::Formula(text.to_owned()) };
        let effect = Effect::custom_named("own", law, &[("a", 0.01), ("b", b)]).unwrap();
        assert_eq!(effect.check_values().is_err(), is_refused, "b = {b}");
        let refused = check_expression(text, &[("a", 0.01), ("b", b)], ActsOn::Torque).is_err();
        assert_eq!(refused, is_refused, "b = {b}");
    }
}

/// A power of what is hardly above zero: 1e100 N·m and more.
#[test]
fn a_torque_beyond_all_reason_leaves_numbers() {
    let law = CustomLaw { acts_on: ActsOn::Torque, rule: Rule::Formula("time_at_rest^speed".to_owned()) };
    let valve = ValveParams::new(&with(vec![Effect::custom_named("own", law, &[]).unwrap()])).unwrap();
    assert_stays_a_number(&valve).unwrap();
}

fn assert_stays_a_number(valve: &ValveParams) -> Result<(), TestCaseError> {
    let mut state = ValveState::at_rest(0.0);
    for k in 0..40 {
        let command = |k: i32| 0.05 * (0.2 * f64::from(k)).sin();
        let out = step(valve, &mut state, &input(command(k), command(k + 1)), 1e-3);
        prop_assert!(state.angle_rad.is_finite() && out.load_torque_nm.is_finite(), "{state:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// Poles that were not looked for, and torques beyond all reason: the state stays a number.
    #[test]
    fn no_formula_breaks_the_valve(
        text in "(1e9|1/speed|sign\\(speed\\)|sqrt\\(angle\\)|speed\\^2|acceleration|1/time|time_at_rest)(\\*|-|/|\\^)(speed|angle|0\\.5|acceleration|sin\\(1e4\\*time\\)|distance)",
        acts_on in prop::sample::select(ActsOn::ALL.to_vec()),
    ) {
        let law = CustomLaw { acts_on, rule: Rule::Formula(text) };
        let model = with(vec![Effect::custom_named("own", law, &[]).unwrap()]);
        let Ok(valve) = ValveParams::new(&model) else { return Ok(()) };
        assert_stays_a_number(&valve)?;
    }
}
