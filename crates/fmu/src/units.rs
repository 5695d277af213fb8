//! Units as an importer reads them, from the ends of a model file's keys.

/// A unit in SI base units, and what it is displayed in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UnitSpec {
    /// As variables name it.
    pub name: &'static str,
    /// Exponents of kg, m, s, A, K, rad; `None` where the dimension is a product that is not spelled out.
    pub base: Option<[i32; 6]>,
    /// The offset to the SI unit: of °C to K.
    pub offset: f64,
    /// The unit that people prefer: its name, and how many of it make one.
    pub display: Option<(&'static str, f64)>,
}

const fn unit(name: &'static str, base: [i32; 6]) -> UnitSpec {
    UnitSpec { name, base: Some(base), offset: 0.0, display: None }
}

/// The units of the unit's own variables and of a model file's sections.
pub(crate) const UNITS: &[UnitSpec] = &[
    UnitSpec { display: Some(("deg", 180.0 / std::f64::consts::PI)), ..unit("rad", [0, 0, 0, 0, 0, 1]) },
    UnitSpec {
        display: Some(("rev/min", 30.0 / std::f64::consts::PI)),
        ..unit("rad/s", [0, 0, -1, 0, 0, 1])
    },
    unit("N.m", [1, 2, -2, 0, 0, 0]),
    unit("N.m/rad", [1, 2, -2, 0, 0, -1]),
    unit("N.m.s/rad", [1, 2, -1, 0, 0, -1]),
    unit("N.m/A", [1, 2, -2, -1, 0, 0]),
    unit("kg.m2", [1, 2, 0, 0, 0, 0]),
    unit("kg/m3", [1, -3, 0, 0, 0, 0]),
    unit("m", [0, 1, 0, 0, 0, 0]),
    unit("m2", [0, 2, 0, 0, 0, 0]),
    unit("m2/s", [0, 2, -1, 0, 0, 0]),
    UnitSpec { display: Some(("L/min", 60_000.0)), ..unit("m3/s", [0, 3, -1, 0, 0, 0]) },
    UnitSpec { display: Some(("bar", 1e-5)), ..unit("Pa", [1, -1, -2, 0, 0, 0]) },
    UnitSpec { offset: 273.15, ..unit("degC", [0, 0, 0, 0, 1, 0]) },
    unit("s", [0, 0, 1, 0, 0, 0]),
    unit("Hz", [0, 0, -1, 0, 0, 0]),
    unit("V", [1, 2, -3, -1, 0, 0]),
    unit("Ohm", [1, 2, -3, -2, 0, 0]),
    unit("H", [1, 2, -2, -2, 0, 0]),
    unit("A", [0, 0, 0, 1, 0, 0]),
];

/// Ends of keys and what they are measured in, the longer ones first.
const ENDS: &[(&str, &str)] = &[
    ("_nm_s_per_rad", "N.m.s/rad"),
    ("_nm_per_rad", "N.m/rad"),
    ("_rad_per_s", "rad/s"),
    ("_kg_per_m3", "kg/m3"),
    ("_m2_per_s", "m2/s"),
    ("_nm_per_a", "N.m/A"),
    ("_kg_m2", "kg.m2"),
    ("_nm", "N.m"),
    ("_rad", "rad"),
    ("_m2", "m2"),
    ("_ohm", "Ohm"),
    ("_pa", "Pa"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_c", "degC"),
    ("_s", "s"),
    ("_v", "V"),
    ("_h", "H"),
    ("_a", "A"),
];

/// The unit of a key of a section; `None` where it has none.
pub(crate) fn of_key(key: &str) -> Option<&'static str> {
    ENDS.iter().find(|(end, _)| key.ends_with(end)).map(|(_, unit)| *unit)
}

pub(crate) fn spec(name: &str) -> Option<&'static UnitSpec> {
    UNITS.iter().find(|unit| unit.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_end_with_their_units() {
        for (key, expected) in [
            ("coulomb_torque_nm", Some("N.m")),
            ("viscous_nm_s_per_rad", Some("N.m.s/rad")),
            ("bristle_stiffness_nm_per_rad", Some("N.m/rad")),
            ("stribeck_velocity_rad_per_s", Some("rad/s")),
            ("kinematic_viscosity_m2_per_s", Some("m2/s")),
            ("inertia_kg_m2", Some("kg.m2")),
            ("stribeck_exponent", None),
            ("discharge_coefficient", None),
        ] {
            assert_eq!(of_key(key), expected, "{key}");
        }
    }

    #[test]
    fn every_end_has_a_unit_that_is_defined() {
        assert!(ENDS.iter().all(|(_, unit)| spec(unit).is_some()));
    }
}
