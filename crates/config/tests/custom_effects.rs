//! Formulas and tables in model files: what is read, and what is refused at which place.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use config::{ModelComments, parse_model, write_model};
use valve_model::{ActsOn, Covariate, Rule};

const HEAD: &str = "format = \"stepvalve-model\"\nformat_version = 1\nname = \"m\"\n[friction]\nlaw = \"dahl\"\ncoulomb_torque_nm = 1.5\n\
    bristle_stiffness_nm_per_rad = 1000.0\nviscous_nm_s_per_rad = 2e-4\ndahl_exponent = 1.0\n\n";

const FORMULA: &str = "[[effect]]\nid = \"formula\"\nname = \"drag\"\nacts_on = \"torque\"\n\
    expression = \"a*speed*abs(speed)\"\n[effect.parameters]\na = 0.006\n";

const TABLE: &str = "[[effect]]\nid = \"table\"\nname = \"t\"\nacts_on = \"level\"\nover = [\"speed\", \"pressure_drop\"]\n\
    knots = [[-1, 0.5], [0, 1e6, 2e6]]\nvalues = [[0, 1, 2], [3, 4, 5]]\n";

/// The effect begins in line 11.
fn refused(effect: &str) -> String {
    parse_model(&format!("{HEAD}{effect}"), "m.toml").unwrap_err().to_string()
}

fn assert_refused(effect: &str, from: &str, to: &str, expected: &str) {
    assert!(effect.contains(from), "{from}");
    let found = refused(&effect.replace(from, to));
    assert!(found.starts_with(expected), "{to}: {found}");
    assert!(!found.contains('\n'), "{to}: {found}");
}

#[test]
fn both_are_read_and_written_back() {
    let one = TABLE.replace("\"t\"", "\"u\"").replace("[\"speed\", \"pressure_drop\"]", "[\"time\"]");
    let one =
        one.replace("[[-1, 0.5], [0, 1e6, 2e6]]", "[0, 1]").replace("[[0, 1, 2], [3, 4, 5]]", "[0.5, 0.25]");
    let second = FORMULA.replace("drag", "drag-2").replace("torque", "viscous");
    let model = parse_model(&format!("{HEAD}{FORMULA}{TABLE}{one}{second}"), "m.toml").unwrap();
    let names: Vec<&str> = model
        .effects
        .iter()
        .map(|effect| match effect.id() {
            valve_model::EffectId::Custom(_) => effect.custom().unwrap().file_id(),
            _ => panic!("a listed effect"),
        })
        .collect();
    assert_eq!(names, ["formula", "table", "table", "formula"]);
    assert_eq!(model.effects[0].number("a"), 0.006);
    assert_eq!(model.effects[3].custom().unwrap().acts_on, ActsOn::Viscous);
    let Rule::Table(grid) = &model.effects[1].custom().unwrap().rule else { panic!("no table") };
    assert_eq!(
        grid.axes().map(|axis| axis.0).collect::<Vec<_>>(),
        [Covariate::Speed, Covariate::PressureDrop]
    );
    assert_eq!(grid.values(), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
    let comments = ModelComments::new().with_key("effect[0].parameters", "a", "fitted");
    let text = write_model(&model, &comments);
    assert!(
        text.contains("expression = \"a*speed*abs(speed)\"\n\n[effect.parameters]\na = 0.006  # fitted\n"),
        "{text}"
    );
    assert!(text.contains("over = [\"time\"]\nknots = [0.0, 1.0]\nvalues = [0.5, 0.25]\n"), "{text}");
    assert_eq!(parse_model(&text, "written").unwrap(), model);
}

#[test]
fn a_table_needs_no_name() {
    let model = parse_model(&format!("{HEAD}{}", TABLE.replace("name = \"t\"\n", "")), "m.toml").unwrap();
    assert_eq!(model.effects[0].id().name(), "table");
}

#[test]
fn expressions_are_refused_at_their_column() {
    for (to, expected) in [
        (
            "a*sped*abs(speed)",
            "m.toml:15:17: effect[0].expression: found an unknown name `sped`, expected speed (did you mean it?) or one of angle,",
        ),
        (
            "a*speed*abs(speed, 2)",
            "m.toml:15:23: effect[0].expression: found 2 argument(s), expected 1 of abs",
        ),
        ("a*b*abs(speed)", "m.toml:15:17: effect[0].expression: found an unknown name `b`"),
        (
            "speed*abs(speed)",
            "m.toml:17:1: effect[0].parameters.a: found a parameter `a` that is not in the expression",
        ),
        (
            "a/speed",
            "m.toml:15:16: effect[0].expression: found an operation that has no finite value near speed ",
        ),
        ("a*(speed", "m.toml:15:23: effect[0].expression: found the end, expected an operator or `)`"),
        (
            "a*speed + speed + pressure_drop",
            "m.toml:15:31: effect[0].expression: found 1/s beside Pa, expected quantities of one unit",
        ),
        (
            "a*sin(speed)",
            "m.toml:15:17: effect[0].expression: found a function of 1/s, expected a pure number",
        ),
    ] {
        assert_refused(FORMULA, "a*speed*abs(speed)", to, expected);
    }
    let long = format!("a*({})", vec!["speed"; 40].join("+"));
    assert!(
        refused(&FORMULA.replace("a*speed*abs(speed)", &long))
            .contains("found an expression that is too long")
    );
    assert_refused(
        FORMULA,
        "\"a*speed*abs(speed)\"",
        "'a*speed*abs(sped)'",
        "m.toml:15:27: effect[0].expression: found an unknown name `sped`",
    );
}

#[test]
fn keys_of_a_formula_are_checked() {
    for (from, to, expected) in [
        ("name = \"drag\"\n", "", "m.toml:11:1: effect[0].name: found nothing"),
        (
            "\"drag\"",
            "\"load-inertia\"",
            "m.toml:13:8: effect[0].name: found load-inertia, expected a name of at most 31",
        ),
        ("\"torque\"", "\"force\"", "m.toml:14:11: effect[0].acts_on: found force, expected \"torque\" or"),
        ("a = 0.006", "a = \"x\"", "m.toml:17:5: effect[0].parameters.a: found x, expected a finite number"),
        (
            "name = ",
            "nam = 1\nname = ",
            "m.toml:13:1: effect[0].nam: found an unknown key, expected name (did you mean it?)",
        ),
        (
            "a = 0.006",
            "speed = 1\na = 0.006",
            "m.toml:17:1: effect[0].parameters.speed: found a parameter `speed`",
        ),
    ] {
        assert_refused(FORMULA, from, to, expected);
    }
    let twice = refused(&format!("{FORMULA}{FORMULA}"));
    assert_eq!(
        twice,
        "m.toml:18:1: effect[1]: found drag, given twice, expected each effect and each name once"
    );
    let nine = (0..9).map(|index| FORMULA.replace("drag", &format!("drag-{index}"))).collect::<String>();
    let expected = "m.toml:67:1: effect[8]: found 9 formulas and tables, expected at most 8 of them";
    assert_eq!(refused(&nine), expected);
}

#[test]
fn tables_are_refused_at_their_number() {
    for (from, to, expected) in [
        (
            "[0, 1e6, 2e6]",
            "[0, 2e6, 1e6]",
            "m.toml:16:30: effect[0].knots[1][2]: found 1e6, expected a knot above the one before, 2000000",
        ),
        ("[-1, 0.5]", "[-1, -1]", "m.toml:16:15: effect[0].knots[0][1]: found -1, expected a knot above"),
        ("[3, 4, 5]", "[3, 4]", "m.toml:17:10: effect[0].values: found"),
        ("[3, 4, 5]", "[3, 4, nan]", "m.toml:17:29: effect[0].values[1][2]: found nan"),
        (
            "\"pressure_drop\"",
            "\"presure_drop\"",
            "m.toml:15:18: effect[0].over[1]: found presure_drop, expected pressure_drop (did you mean it?)",
        ),
        ("\"pressure_drop\"", "\"speed\"", "m.toml:15:18: effect[0].over[1]: found speed, expected another"),
        ("[[-1, 0.5], [0, 1e6, 2e6]]", "[0, 1]", "m.toml:16:10: effect[0].knots[0]: found 0"),
    ] {
        assert_refused(TABLE, from, to, expected);
    }
    let many: Vec<String> = (0..17).map(|knot| knot.to_string()).collect();
    let found = refused(&TABLE.replace("[0, 1e6, 2e6]", &format!("[{}]", many.join(","))));
    assert!(found.starts_with("m.toml:16:9: effect[0].knots: found 17 numbers, expected"), "{found}");
}
