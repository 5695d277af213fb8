//! Model files: read, refused with the place, and written back bit for bit.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use config::{ModelComments, parse_model, write_model};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use valve_model::{
    ActsOn, ClearanceParams, Covariate, CustomLaw, DahlParams, Effect, EffectId, EffectValue, FrictionParams,
    Grid, LeuvenParams, LoadParams, LuGreParams, Model, MotorParams, OilParams, OrificeParams, ParameterSpec,
    Rule, SealParams, StribeckParams, ValueKind, Window, WindowTable,
};

const MODEL: &str = r#"format = "stepvalve-model"
format_version = 1
name = "bench rig"

[motor]
phases = 5
rotor_teeth = 50
full_steps_per_rev = 500
microsteps_per_full_step = 225
holding_torque_nm = 6.0
rotor_inertia_kg_m2 = 4.0e-4
damping_nm_s_per_rad = 0.02
max_pulse_rate_hz = 600e3

[load]
inertia_kg_m2 = 1.0e-4

[friction]
law = "lugre"
coulomb_torque_nm = 1.5
static_torque_nm = 3
stribeck_velocity_rad_per_s = 0.05
stribeck_exponent = 2.0
bristle_stiffness_nm_per_rad = 1000.0
bristle_damping_nm_s_per_rad = 1.0
viscous_nm_s_per_rad = 2.0e-4

[[effect]]
id = "direction-asymmetry"
level = 0.12

[[effect]]
id = "position-torque"
sin = [0.1, 0]
cos = [-2e-3]
"#;

#[track_caller]
fn refused(from: &str, to: &str, expected: &str) {
    assert_eq!(MODEL.matches(from).count(), 1, "{from}");
    let errors = parse_model(&MODEL.replace(from, to), "m.toml").expect_err("accepted");
    assert_eq!(errors.to_string(), expected);
}

#[test]
fn a_model_means_what_it_says() {
    let model = parse_model(MODEL, "m.toml").unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(model.name, "bench rig");
    assert_eq!(model.motor.unwrap().max_pulse_rate_hz, 6e5);
    assert_eq!(model.load, Some(LoadParams { inertia_kg_m2: 1e-4 }));
    assert_eq!((model.orifice, model.oil), (None, None));
    let FrictionParams::LuGre(friction) = model.friction else { panic!("{:?}", model.friction) };
    assert_eq!((friction.coulomb_torque_nm, friction.static_torque_nm), (1.5, 3.0));
    assert_eq!(model.effects[0].number("level"), 0.12);
    assert_eq!((model.effects[1].list("sin"), model.effects[1].list("cos")), (&[0.1, 0.0][..], &[-2e-3][..]));
}

#[test]
fn friction_alone_is_a_model() {
    let (head, rest) = MODEL.split_once("[motor]").unwrap();
    let friction = &rest[rest.find("[friction]").unwrap()..rest.find("[[effect]]").unwrap()];
    let model = parse_model(&format!("{head}{friction}"), "m.toml").unwrap();
    assert_eq!((model.motor, model.load, model.effects.len()), (None, None, 0));
}

#[test]
fn refused_with_the_place() {
    refused(
        "format = \"stepvalve-model\"",
        "format = \"valve-log\"",
        "m.toml:1:10: format: found valve-log, expected \"stepvalve-model\"",
    );
    let keys = "format, format_version, name, motor, load, oil, clearance, seals, friction, orifice, effect";
    let missing = "m.toml:1:1: friction: found nothing, expected a section [friction]";
    let unknown =
        "m.toml:18:2: fiction: found an unknown key, expected friction (did you mean it?) or one of";
    refused("[friction]\n", "[fiction]\n", &format!("{missing}\n{unknown} {keys}"));
    refused(
        "holding_torque_nm = 6.0",
        "holding_torque_nm = -6.0",
        "m.toml:10:21: motor.holding_torque_nm: found -6.0, expected a finite number above zero",
    );
    refused(
        "holding_torque_nm = 6.0",
        "holding_torque_nm = nan",
        "m.toml:10:21: motor.holding_torque_nm: found nan, expected a finite number",
    );
    refused(
        "holding_torque_nm = 6.0",
        "holding_torque_nm = \"6\"",
        "m.toml:10:21: motor.holding_torque_nm: found 6, expected a finite number",
    );
    refused(
        "phases = 5",
        "phases = 5.5",
        "m.toml:6:10: motor.phases: found 5.5, expected a whole number from 0 to 4294967295",
    );
    refused(
        "static_torque_nm = 3",
        "static_torque_nm = 1.4",
        "m.toml:21:20: friction.static_torque_nm: found 1.4, expected a finite number, `coulomb_torque_nm` or above",
    );
    refused(
        "static_torque_nm = 3\n",
        "",
        "m.toml:18:1: friction.static_torque_nm: found nothing, expected a number",
    );
    refused(
        "\"lugre\"",
        "\"lugree\"",
        "m.toml:19:7: friction.law: found lugree, expected \"lugre\" (did you mean it?) or one of \"lugre\", \"stribeck\", \"dahl\", \"leuven\"",
    );
    refused(
        "rotor_inertia_kg_m2 = 4.0e-4",
        "rotor_inertia_kg_m2 = 4.0e-4\nsupply_voltage_v = 48",
        "m.toml:5:1: motor.phase_resistance_ohm: found nothing, expected all five electrical keys, or none",
    );
}

/// What is said of an orifice with this window.
fn window_read(window: &str) -> Result<Window, String> {
    let orifice = "[orifice]\ndischarge_coefficient = 0.6\nwindow_area_m2 = 1e-4\nclosed_angle_rad = 0\n\
                   open_angle_rad = 1\n";
    let model = parse_model(&format!("{MODEL}\n{orifice}{window}\n"), "m.toml");
    model.map(|model| model.orifice.unwrap().window).map_err(|errors| errors.to_string())
}

#[test]
fn windows_by_name_and_by_table() {
    assert_eq!(window_read(""), Ok(Window::Linear));
    assert_eq!(window_read("window = \"round\""), Ok(Window::Round));
    let Ok(Window::Table(table)) = window_read("window_table = [[0, 0], [0.3, 0.1], [1, 1]]") else {
        panic!()
    };
    assert_eq!(table.points(), [(0.0, 0.0), (0.3, 0.1), (1.0, 1.0)]);
    for (bad, told) in [
        ("window = \"square\"", "\"linear\" or \"round\""),
        ("window = \"round\"\nwindow_table = [[0, 0], [1, 1]]", "one of the two"),
        ("window_table = [[0, 0], [0.3, 0.4], [0.5, 0.2], [1, 1]]", "rise strictly"),
        ("window_table = [[0, 0], [1]]", "points [way, area]"),
        ("window_table = [0, 1]", "points [way, area]"),
        ("window_table = 3", "a list of points [way, area]"),
    ] {
        let said = window_read(bad).unwrap_err();
        assert!(said.contains(told) && said.contains("m.toml:"), "{bad}: {said}");
    }
}

#[test]
fn effects_refused_with_the_place() {
    let known: Vec<&str> = EffectId::ALL.iter().map(|id| id.name()).chain(["formula", "table"]).collect();
    let known = known.join(", ");
    refused(
        "\"direction-asymmetry\"",
        "\"direction-asymetry\"",
        &format!(
            "m.toml:29:6: effect[0].id: found direction-asymetry, expected direction-asymmetry (did you mean it?) or one of {known}"
        ),
    );
    refused(
        "level = 0.12",
        "level = 1.0",
        "m.toml:30:9: effect[0].level: found 1.0, expected a number, -0.999 to 0.999",
    );
    refused(
        "level = 0.12",
        "leel = 0.1",
        "m.toml:30:1: effect[0].leel: found an unknown key, expected level (did you mean it?) or one of id, level, viscous",
    );
    refused(
        "cos = [-2e-3]",
        "cos = [-2e-3, inf]",
        "m.toml:35:15: effect[1].cos[1]: found inf, expected an array of at most 128 numbers, at most 24 of them other than 0",
    );
    refused(
        "cos = [-2e-3]",
        "cos = 1",
        "m.toml:35:7: effect[1].cos: found 1, expected an array of at most 128 numbers, at most 24 of them other than 0",
    );
    refused(
        "id = \"position-torque\"\n",
        "",
        "m.toml:32:1: effect[1].id: found nothing, expected the name of an effect",
    );
}

const DESIGN: &str = r#"
[oil]
density_kg_per_m3 = 853.0
kinematic_viscosity_m2_per_s = 46e-6
reference_temperature_c = 40.0

[clearance]
spool_radius_m = 0.0096
sleeve_radius_m = 0.0097
length_m = 0.05
grooves = 0
groove_width_m = 0.0
opening_area_m2 = 8.75e-5

[seals]
spool_radius_m = 0.0096
seals = 2
o_ring_diameter_m = 2.62e-3
backup_ring_width_m = 1.4e-3
working_pressure_pa = 20e6
friction_coefficient = 0.027
static_ratio = 1.2
"#;

/// The model with its friction's numbers by design calculation; `kept` stays in `[friction]` nevertheless.
fn designed(kept: &str) -> String {
    let numbers = ["coulomb_torque_nm = 1.5\n", "static_torque_nm = 3\n", "viscous_nm_s_per_rad = 2.0e-4\n"];
    let text = numbers
        .iter()
        .filter(|number| **number != kept)
        .fold(MODEL.to_owned(), |text, number| text.replace(number, ""));
    text + DESIGN
}

#[test]
fn friction_by_design_calculation() {
    let model = parse_model(&designed(""), "m.toml").unwrap_or_else(|errors| panic!("{errors}"));
    let FrictionParams::LuGre(friction) = model.friction else { panic!("{:?}", model.friction) };
    let (clearance, seals) = (model.clearance.unwrap(), model.seals.unwrap());
    assert_eq!(friction.coulomb_torque_nm, seals.coulomb_torque_nm());
    assert_eq!(friction.static_torque_nm, 1.2 * friction.coulomb_torque_nm);
    assert_eq!(friction.viscous_nm_s_per_rad, clearance.viscous_nm_s_per_rad(&model.oil.unwrap()));
    let text = write_model(&model, &ModelComments::new());
    let (_, section) = text.split_once("[friction]").unwrap();
    let section = section.split("\n[").next().unwrap();
    assert!(!section.contains("torque_nm") && !section.contains("viscous"), "{section}");
    assert_eq!(parse_model(&text, "written").unwrap(), model);
}

#[test]
fn a_number_and_the_section_that_gives_it() {
    let both = |kept: &str| parse_model(&designed(kept), "m.toml").unwrap_err().to_string();
    assert_eq!(
        both("coulomb_torque_nm = 1.5\n"),
        "m.toml:20:21: friction.coulomb_torque_nm: found 1.5 beside [seals], which gives the same, expected \
         `friction.coulomb_torque_nm` or [seals], not both"
    );
    assert!(both("static_torque_nm = 3\n").contains("`friction.static_torque_nm` or [seals], not both"));
    let viscous = both("viscous_nm_s_per_rad = 2.0e-4\n");
    assert!(viscous.contains("`friction.viscous_nm_s_per_rad` or [clearance], not both"), "{viscous}");
}

#[test]
fn design_sections_refused_with_the_place() {
    let errors = |from: &str, to: &str| {
        assert_eq!(DESIGN.matches(from).count(), 1, "{from}");
        parse_model(&designed("").replace(from, to), "m.toml").unwrap_err().to_string()
    };
    assert!(
        errors("= 0.0097", "= 0.0096")
            .ends_with("clearance.sleeve_radius_m: found 0.0096, expected a radius above `spool_radius_m`")
    );
    assert!(errors("seals = 2", "seals = 0").ends_with("seals.seals: found 0, expected 1 to 100 seals"));
    assert!(
        errors("static_ratio = 1.2\n", "").ends_with("seals.static_ratio: found nothing, expected a number")
    );
    let without_oil = &DESIGN[DESIGN.find("[clearance]").unwrap()..];
    let errors = parse_model(&designed("").replace(DESIGN, without_oil), "m.toml").unwrap_err().to_string();
    assert_eq!(errors, "m.toml:1:1: oil: found nothing, expected a section [oil] beside [clearance]");
}

#[test]
fn all_errors_at_once() {
    let text = MODEL.replace("phases = 5", "phases = 1").replace("= 1.5", "= 0.0").replace("= 0.12", "= 2.0");
    let errors = parse_model(&text.replace("[load]", "[lode]"), "m.toml").unwrap_err();
    let keys: Vec<&str> = errors.errors().iter().map(|error| error.key.as_str()).collect();
    assert_eq!(keys, ["motor.phases", "lode", "friction.coulomb_torque_nm", "effect[0].level"]);
}

#[test]
fn comments_stand_where_they_belong() {
    let model = parse_model(MODEL, "m.toml").unwrap();
    let comments = ModelComments::new()
        .with_header("Fitted to the records of May.\n\nSecond line\u{7}.")
        .with_section("friction", "from rests")
        .with_section("effect[1]", "the coupling")
        .with_key("friction", "coulomb_torque_nm", "1.5 ± 0.1")
        .with_key("friction", "static_torque_nm", "two\r\nlines")
        .with_key("friction", "no_such_key", "not written");
    let text = write_model(&model, &comments);
    assert!(
        text.starts_with(
            "# Fitted to the records of May.\n#\n# Second line .\nformat = \"stepvalve-model\"\n"
        ),
        "{text}"
    );
    assert!(text.contains("\n\n# from rests\n[friction]\nlaw = \"lugre\"\ncoulomb_torque_nm = 1.5  # 1.5 ± 0.1\n# two\n# lines\nstatic_torque_nm = 3.0\n"), "{text}");
    assert!(
        text.contains(
            "\n\n# the coupling\n[[effect]]\nid = \"position-torque\"\nsin = [0.1, 0.0]\ncos = [-0.002]\n"
        ),
        "{text}"
    );
    assert!(!text.contains("not written"));
    assert_eq!(parse_model(&text, "written").unwrap(), model);
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![1e-12..1e12f64, Just(f64::MIN_POSITIVE), Just(5e-324), Just(f64::MAX), Just(0.1)]
}

fn not_negative() -> impl Strategy<Value = f64> {
    prop_oneof![positive(), Just(0.0), Just(-0.0)]
}

prop_compose! {
    fn motor()(phases in 2u32..=10, rotor_teeth in 1u32..=1000, microsteps_per_full_step in 1u32..=100_000,
        numbers in (positive(), positive(), not_negative(), positive()),
        electrical in option::of([1e-6..1e3f64, 1e-6..1e3f64, 1e-6..1e3f64, 1e-6..1e3f64])) -> MotorParams {
        MotorParams {
            phases, rotor_teeth, full_steps_per_rev: 2 * phases * rotor_teeth, microsteps_per_full_step,
            holding_torque_nm: numbers.0, rotor_inertia_kg_m2: numbers.1,
            damping_nm_s_per_rad: numbers.2, max_pulse_rate_hz: numbers.3,
            supply_voltage_v: electrical.map(|[r, _, i, _]| 2.0 * r * i),
            phase_resistance_ohm: electrical.map(|[r, ..]| r), phase_inductance_h: electrical.map(|[_, l, ..]| l),
            rated_current_a: electrical.map(|[_, _, i, _]| i), torque_constant_nm_per_a: electrical.map(|[.., k]| k),
        }
    }
}

fn window() -> impl Strategy<Value = Window> {
    (0..3, 0.001..0.999f64, 0.001..0.999f64).prop_map(|(shape, way, area)| match shape {
        0 => Window::Linear,
        1 => Window::Round,
        _ => Window::Table(WindowTable::new(&[(0.0, 0.0), (way, area), (1.0, 1.0)]).unwrap()),
    })
}

prop_compose! {
    fn orifice()(discharge_coefficient in 1e-9..=1.0f64, window_area_m2 in positive(), closed_angle_rad in -1e3..1e3f64,
        travel_rad in 0.01..6.0f64, window in window()) -> OrificeParams {
        OrificeParams { discharge_coefficient, window_area_m2, closed_angle_rad, open_angle_rad: closed_angle_rad + travel_rad, window }
    }
}

fn friction() -> impl Strategy<Value = FrictionParams> {
    let numbers =
        ([1e-9..1e6f64, 1.0..1e6f64], [positive(), positive(), positive()], [not_negative(), not_negative()]);
    (0..4, numbers, 8u32..=16, 1.001..100.0f64).prop_map(
        |(law, ([coulomb, ratio], [a, b, c], [d, e]), elements, over)| {
            let (coulomb_torque_nm, static_torque_nm) = (coulomb, coulomb * ratio);
            let (stribeck_velocity_rad_per_s, stribeck_exponent, bristle_stiffness_nm_per_rad) = (a, b, c);
            let (bristle_damping_nm_s_per_rad, viscous_nm_s_per_rad) = (d, e);
            match law {
                0 => FrictionParams::Stribeck(StribeckParams {
                    coulomb_torque_nm,
                    static_torque_nm,
                    stribeck_velocity_rad_per_s,
                    stribeck_exponent,
                    viscous_nm_s_per_rad,
                    regularisation_velocity_rad_per_s: c,
                }),
                1 => FrictionParams::Dahl(DahlParams {
                    coulomb_torque_nm,
                    bristle_stiffness_nm_per_rad,
                    viscous_nm_s_per_rad,
                    dahl_exponent: a,
                }),
                2 => FrictionParams::LuGre(LuGreParams {
                    coulomb_torque_nm,
                    static_torque_nm,
                    stribeck_velocity_rad_per_s,
                    stribeck_exponent,
                    bristle_stiffness_nm_per_rad,
                    bristle_damping_nm_s_per_rad,
                    viscous_nm_s_per_rad,
                }),
                _ => FrictionParams::Leuven(LeuvenParams {
                    coulomb_torque_nm,
                    static_torque_nm,
                    stribeck_velocity_rad_per_s,
                    stribeck_exponent,
                    bristle_stiffness_nm_per_rad,
                    bristle_damping_nm_s_per_rad,
                    viscous_nm_s_per_rad,
                    transition_exponent: over,
                    maxwell_elements: elements,
                    maxwell_saturation_ratio: over,
                    maxwell_spacing_exponent: b,
                    maxwell_tail_exponent: 0.5,
                    maxwell_curve_share: 0.25,
                    maxwell_damping_share: 0.75,
                }),
            }
        },
    )
}

/// A value within a parameter's range: `at` is where, from 0 to 1.
fn number_in(row: &ParameterSpec, at: f64) -> f64 {
    let (low, high) = (row.min.max(-1e9), row.max.min(1e9));
    (low + at * (high - low)).clamp(row.min, row.max)
}

/// A formula or a table.
fn custom() -> impl Strategy<Value = Effect> {
    let numbers = || vec(-1e9..1e9f64, 2..9);
    (0..3, prop::sample::select(ActsOn::ALL.to_vec()), "[a-z][a-z0-9_-]{0,30}", numbers(), numbers())
        .prop_map(|(kind, acts_on, name, mut knots, values)| {
            let name = if EffectId::from_name(&name).is_some() { "other" } else { &name };
            if kind == 0 {
                let rule = Rule::Formula("a*speed*abs(speed) +  b".to_owned());
                let parameters = [("b", knots[0]), ("a", values[0])];
                return Effect::custom_named(name, CustomLaw { acts_on, rule }, &parameters).unwrap();
            }
            knots.sort_by(f64::total_cmp);
            let columns = if kind == 1 { 1 } else { 2 };
            let over = [Covariate::Speed, Covariate::PressureDrop][..columns].to_vec();
            let axes = [knots.clone(), vec![-1.5, 0.25]][..columns].to_vec();
            let row = |index: usize| vec![values[index % values.len()]; columns];
            let grid = Grid::new(over, axes, (0..knots.len()).map(row).collect()).unwrap();
            Effect::custom_named(name, CustomLaw { acts_on, rule: Rule::Table(grid) }, &[]).unwrap()
        })
}

fn effect() -> impl Strategy<Value = Effect> {
    prop_oneof![4 => listed_effect(), 1 => custom()]
}

fn listed_effect() -> impl Strategy<Value = Effect> {
    (0..EffectId::ALL.len(), vec((any::<bool>(), vec(0.0..=1.0f64, 1..20)), 8), any::<bool>()).prop_map(
        |(index, draws, backwards)| {
            let spec = EffectId::ALL[index].spec();
            let drawn = spec.parameters.iter().zip(&draws).filter(|(_, (given, _))| *given);
            let mut parts: Vec<(&str, EffectValue)> = drawn
                .map(|(row, (_, draws))| match row.kind {
                    ValueKind::Number => (row.key, EffectValue::Number(number_in(row, draws[0]))),
                    ValueKind::List(most) => (
                        row.key,
                        EffectValue::List(draws.iter().take(most).map(|&at| number_in(row, at)).collect()),
                    ),
                })
                .collect();
            if backwards {
                parts.reverse();
            }
            Effect::new(spec.id, &parts).unwrap()
        },
    )
}

prop_compose! {
    fn clearance()(spool_radius_m in 1e-3..1.0f64, gap_m in 1e-6..1e-3f64, length_m in 0.1..1.0f64, grooves in 0u32..10,
        groove_width_m in 0.0..1e-3f64, opening_area_m2 in 0.0..1e-5f64) -> ClearanceParams {
        let sleeve_radius_m = spool_radius_m + gap_m;
        ClearanceParams { spool_radius_m, sleeve_radius_m, length_m, grooves, groove_width_m, opening_area_m2 }
    }
}

prop_compose! {
    fn seals()(spool_radius_m in 1e-3..1.0f64, seals in 1u32..=100, o_ring_diameter_m in 1e-4..1e-2f64,
        backup_ring_width_m in 0.0..1e-2f64, working_pressure_pa in 1.0..1e8f64, friction_coefficient in 1e-3..1.0f64,
        static_ratio in 1.0..10.0f64) -> SealParams {
        SealParams { spool_radius_m, seals, o_ring_diameter_m, backup_ring_width_m, working_pressure_pa,
            friction_coefficient, static_ratio }
    }
}

prop_compose! {
    fn model()(name in "\\PC*[a-zA-Z\"'\\\\äω#]\\PC*", motor in option::of(motor()), inertia in option::of(not_negative()),
        friction in friction(), orifice in option::of(orifice()), oil in option::of((positive(), positive(), -273.0..1e4f64)),
        clearance in option::of(clearance()), seals in option::of(seals()), effects in vec(effect(), 0..4)) -> Model {
        let oil = oil.map(|(density_kg_per_m3, kinematic_viscosity_m2_per_s, reference_temperature_c)| {
            OilParams { density_kg_per_m3, kinematic_viscosity_m2_per_s, reference_temperature_c }
        });
        let load = inertia.map(|inertia_kg_m2| LoadParams { inertia_kg_m2 });
        let mut model = Model { name, motor, load, friction, orifice, oil, clearance, seals, effects };
        if model.oil.is_none() {
            model.clearance = None;
        }
        model.take_design().unwrap();
        model
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_reads_back_bit_for_bit(model in model(), header in "(\\PC|[\\n\\r\\t\u{7}])*", note in "(\\PC|[\\n\\r\\t\u{7}])*") {
        prop_assume!(model.validate().is_ok());
        let comments = ModelComments::new()
            .with_header(header)
            .with_section("friction", note.clone())
            .with_section("effect[0]", note.clone())
            .with_key("friction", "coulomb_torque_nm", note.clone())
            .with_key("motor", "phases", note);
        let text = write_model(&model, &comments);
        let read = parse_model(&text, "written").map_err(|errors| TestCaseError::fail(format!("{errors}\n{text}")))?;
        // Debug tells -0.0 from 0.0 and is exact for every other number.
        prop_assert_eq!(format!("{read:?}"), format!("{model:?}"));
        prop_assert_eq!(read, model);
    }
}
