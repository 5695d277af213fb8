//! The drive file: which drive is on the bus, in which units it counts, how it is set.

use crate::asked::Visit;
use crate::bounds::Bounds;
use crate::error::ConfigErrors;
use crate::reader::{Field, Section, asked as asked_of, parse};
use crate::units::Dimension;
use fieldbus::objects::Object;
use fieldbus::{DriveFile, Homing, Profile, Sdo, SdoValue};

const FORMAT: &str = "stepvalve-drive";
const FORMAT_VERSION: u64 = 1;

const SHIFT: Bounds = Bounds::within(0.0, 1e-2);
/// Less than the controller waits for current (2 s): what the drive lacks is known here alone.
const ENABLE_TIMEOUT: Bounds = Bounds::within(1e-3, 1.8);
const DEFAULT_ENABLE_TIMEOUT_S: f64 = 1.5;
const DEFAULT_BUS_LOST_CYCLES: u64 = 3;

/// The types of an SDO by name.
const TYPES: [(&str, SdoValue); 5] = [
    ("u16", SdoValue::U16(0)),
    ("u32", SdoValue::U32(0)),
    ("i8", SdoValue::I8(0)),
    ("i16", SdoValue::I16(0)),
    ("i32", SdoValue::I32(0)),
];

/// Reads a drive file from its text. `file` names it in errors.
///
/// # Errors
/// All that is wrong in the text, with line and column.
pub fn parse_drive(text: &str, file: &str) -> Result<DriveFile, ConfigErrors> {
    parse(text, file, FORMAT, FORMAT_VERSION, |root| Some(read(root)))
}

/// What the reader asks of drive files that together have every key.
pub(crate) fn asked() -> Vec<Visit> {
    let every_key = include_str!("../../../fuzz/corpus/configuration/drive.toml");
    let others =
        ["kind = \"none\"", "kind = \"drive\"\nmethod = 37"].map(|homing| format!("[homing]\n{homing}\n"));
    let texts = std::iter::once(every_key).chain(others.iter().map(String::as_str));
    texts.flat_map(|text| asked_of(text, FORMAT, FORMAT_VERSION, read)).collect()
}

fn read(root: Section<'_>) -> DriveFile {
    let profile = root
        .require("profile", "\"cia402-csp\" or \"el2522\"")
        .and_then(|field| field.choice(("cia402-csp", Profile::Cia402Csp), &[("el2522", Profile::El2522)]));
    let number = |key: &str| {
        let field = root.require(key, "a whole number of 32 bits");
        field.map_or(0, |field| field.integer(0..=u32::MAX.into()) as u32)
    };
    let sync = root.optional_section("sync");
    let faults = root.optional_section("faults");
    let drive = DriveFile {
        name: root.text("name", "a name"),
        profile: profile.unwrap_or(Profile::Cia402Csp),
        vendor: number("vendor"),
        product: number("product"),
        revision_min: root.integer_or("revision_min", 0..=u32::MAX.into(), 0) as u32,
        units_per_rev: number("units_per_rev").max(1),
        reversed: root
            .find("direction")
            .and_then(|field| field.choice(("positive", false), &[("negative", true)]))
            .unwrap_or(false),
        position_is_measured: root
            .require("position_is_measured", "true or false")
            .is_some_and(|field| field.boolean()),
        sync_shift_ns: nanoseconds(sync.as_ref(), "shift", SHIFT, 0.0) as u32,
        bus_lost_cycles: faults.as_ref().map_or(DEFAULT_BUS_LOST_CYCLES, |section| {
            section.integer_or("bus_lost_cycles", 1..=1000, DEFAULT_BUS_LOST_CYCLES)
        }),
        enable_timeout_ns: nanoseconds(
            faults.as_ref(),
            "enable_timeout",
            ENABLE_TIMEOUT,
            DEFAULT_ENABLE_TIMEOUT_S,
        ),
        homing: root.optional_section("homing").map_or(Homing::None, |section| read_homing(section, profile)),
        absent: root.list("absent").iter().filter_map(|field| read_absent(field, profile)).collect(),
        sdos: root.list("sdo").iter().filter_map(read_sdo).collect(),
    };
    sync.into_iter().chain(faults).for_each(Section::finish);
    root.finish();
    drive
}

fn nanoseconds(section: Option<&Section<'_>>, key: &str, bounds: Bounds, default_s: f64) -> u64 {
    let time_s = section.and_then(|section| section.optional_quantity(key, Dimension::Time, bounds));
    // A refused one is NaN, which counts as 0 and has been reported.
    (time_s.unwrap_or(default_s) * 1e9).round() as u64
}

/// The kinds of homing by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    None,
    Absolute,
    Drive,
}

fn read_homing(section: Section<'_>, profile: Option<Profile>) -> Homing {
    const EXPECTED: &str = "\"none\", \"absolute\" or \"drive\"";
    const OTHERS: [(&str, Kind); 2] = [("absolute", Kind::Absolute), ("drive", Kind::Drive)];
    let field = section.require("kind", EXPECTED);
    let kind = field.as_ref().and_then(|field| field.choice(("none", Kind::None), &OTHERS));
    let homing = match kind.unwrap_or(Kind::None) {
        Kind::None => Homing::None,
        Kind::Absolute => {
            let range = i64::from(i32::MIN)..=i64::from(i32::MAX);
            Homing::Absolute { offset: section.find("offset").map_or(0, |field| whole(&field, range)) }
        }
        Kind::Drive => {
            let method = section.require("method", "a homing method as 0x6098 takes it, such as 37");
            // In the range of the object.
            Homing::Drive { method: method.map_or(0, |field| whole(&field, -128..=127)) as i8 }
        }
    };
    if let (Homing::Drive { .. }, Some(Profile::El2522), Some(field)) = (homing, profile, &field) {
        field.refuse("\"none\" or \"absolute\": a terminal has no homing");
    }
    section.finish();
    homing
}

/// A whole number that may be negative; 0 if refused.
fn whole(field: &Field<'_>, range: std::ops::RangeInclusive<i64>) -> i64 {
    let expected = format!("a whole number from {} to {}", range.start(), range.end());
    let number = field.number(&expected);
    let inside = number.fract() == 0.0 && range.contains(&(number as i64));
    if !inside && !number.is_nan() {
        field.refuse(expected);
    }
    if inside { number as i64 } else { 0 }
}

/// An object as text: "0x10F1:02".
fn read_object(field: &Field<'_>) -> Option<(u16, u8)> {
    const EXPECTED: &str = "an object such as \"0x10F1:02\"";
    let text = field.text(EXPECTED);
    let object = text.strip_prefix("0x").and_then(|text| text.split_once(':')).and_then(|(index, sub)| {
        Some((u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?))
    });
    if object.is_none() && !text.is_empty() {
        field.refuse(EXPECTED);
    }
    object
}

/// An object that the drive lacks: none that the bridge needs in every frame.
fn read_absent(field: &Field<'_>, profile: Option<Profile>) -> Option<(u16, u8)> {
    let (index, sub) = read_object(field)?;
    if profile.is_some_and(|profile| profile.needs(Object { index, sub })) {
        field.refuse("an object that the bridge can do without: this one is in every frame");
    }
    Some((index, sub))
}

fn read_sdo(field: &Field<'_>) -> Option<Sdo> {
    let section = field.section("a table [[sdo]]")?;
    let index = section.require("index", "an index such as 0x6085")?.integer(0..=u16::MAX.into()) as u16;
    let sub = section.integer_or("sub", 0..=u8::MAX.into(), 0) as u8;
    let kind = section.require("type", "\"u8\", \"u16\", \"u32\", \"i8\", \"i16\" or \"i32\"");
    let kind = kind.and_then(|field| field.choice(("u8", SdoValue::U8(0)), &TYPES))?;
    let value = section.require("value", "a number")?;
    let number = whole(&value, i64::from(i32::MIN)..=u32::MAX.into());
    let typed = kind.with(number);
    if typed.is_none() {
        value.refuse("a number that fits the type");
    }
    section.finish();
    Some(Sdo { index, sub, value: typed? })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
format = "stepvalve-drive"
format_version = 1
name = "test"
profile = "cia402-csp"
vendor = 0x5356
product = 0x402
units_per_rev = 112500
position_is_measured = true
absent = ["0x10F1:02"]
[homing]
kind = "absolute"
offset = -5
[[sdo]]
index = 0x2001
type = "i16"
value = -3
"#;

    #[test]
    fn a_good_file_is_read() {
        let drive = parse_drive(GOOD, "drive.toml").unwrap();
        assert_eq!((drive.vendor, drive.units_per_rev, drive.bus_lost_cycles), (0x5356, 112_500, 3));
        assert_eq!(drive.homing, Homing::Absolute { offset: -5 });
        assert_eq!(drive.absent, [(0x10F1, 2)]);
        assert_eq!(drive.sdos, [Sdo { index: 0x2001, sub: 0, value: SdoValue::I16(-3) }]);
        assert_eq!(drive.validate(), Ok(()));
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        let rows = [
            ("vendor = 0x5356", "vendor = -1", "6:10: vendor"),
            ("\"cia402-csp\"", "\"canopen\"", "5:11: profile"),
            ("0x10F1:02", "10F1", "10:11: absent[0]"),
            ("0x10F1:02", "0x6041:00", "an object that the bridge can do without"),
            ("value = -3", "value = 40000", "17:9: sdo[0].value"),
            ("units_per_rev = 112500", "units = 1", "units"),
            ("kind = \"absolute\"\noffset = -5", "kind = \"drive\"", "homing"),
            ("kind = \"absolute\"\noffset = -5", "kind = \"drive\"\nmethod = 200", "13:10: homing.method"),
        ];
        for (good, bad, place) in rows {
            let errors = parse_drive(&GOOD.replace(good, bad), "drive.toml").unwrap_err().to_string();
            assert!(errors.contains(place), "{bad}: {errors}");
        }
    }
}
