//! Units that a table states, held against those that channels are in.

use crate::expression::Map;
use anyhow::bail;
use log_data::Channel;

/// How units are written, in small letters and without signs between them, and what makes the channel's unit of them.
type Spellings = &'static [(&'static [&'static str], &'static str)];

const TIME: Spellings = &[
    (&["s", "sec", "second", "seconds", "sek"], ""),
    (&["ms", "msec", "millisecond", "milliseconds"], "/1000"),
    (&["us", "µs", "usec", "microsecond", "microseconds"], "/1e6"),
    (&["ns"], "/1e9"),
    (&["min", "minute", "minutes"], "*60"),
    (&["h", "hour", "hours"], "*3600"),
];
const ANGLE: Spellings = &[
    (&["rad", "radian", "radians"], ""),
    (&["mrad"], "/1000"),
    (&["deg", "degree", "degrees", "°", "grad"], "*pi/180"),
    (&["rev", "turn", "turns", "revolution", "revolutions"], "*2*pi"),
];
const TORQUE: Spellings = &[
    (&["nm"], ""),
    (&["ncm"], "/100"),
    (&["nmm"], "/1000"),
    (&["knm"], "*1000"),
    (&["lbin", "inlb", "lbfin", "inlbf"], "*0.112984829"),
    (&["lbft", "ftlb", "lbfft", "ftlbf"], "*1.355817948"),
];
const PRESSURE: Spellings = &[
    (&["pa"], ""),
    (&["hpa", "mbar"], "*100"),
    (&["kpa"], "*1000"),
    (&["bar"], "*1e5"),
    (&["mpa"], "*1e6"),
    (&["psi", "lbfin2"], "*6894.757"),
];
const FLOW: Spellings =
    &[(&["m3s"], ""), (&["lmin", "lpm"], "/60000"), (&["m3h"], "/3600"), (&["ls"], "/1000")];
const TEMPERATURE: Spellings =
    &[(&["degc", "°c", "c", "celsius"], ""), (&["k", "kelvin"], "-273.15"), (&["degf", "°f"], "*5/9-160/9")];

/// Units of what no channel is: speed, force, length, electricity, frequency, mass.
const OF_NO_CHANNEL: &[&str] = &[
    "rads", "degs", "°s", "rpm", "1min", "umin", "revmin", "rads2", "n", "kn", "mn", "lbf", "m", "mm", "µm",
    "cm", "inch", "v", "mv", "a", "ma", "w", "kw", "hz", "khz", "kg", "1s", "mms",
];

const fn spellings(channel: Channel) -> Spellings {
    match channel {
        Channel::Time => TIME,
        Channel::Angle | Channel::AngleCommand => ANGLE,
        Channel::Torque => TORQUE,
        Channel::PressureDrop => PRESSURE,
        Channel::Flow => FLOW,
        Channel::OilTemperature => TEMPERATURE,
    }
}

/// Refuses a column that is taken as it is for a channel, though the table says that it is in another unit. What a file says
/// in no way that is known here is not judged, nor a column with which something is done: whoever did it thought of its unit. Names and units
/// are those of the table's columns.
///
/// # Errors
/// The column, its unit, and the map that takes it into account.
pub(crate) fn check(map: &Map, names: &[String], units: &[String]) -> anyhow::Result<()> {
    let Some(channel) = Channel::from_name(map.target()) else { return Ok(()) };
    let Some(column) = map.column_as_it_is(names) else { return Ok(()) };
    let name = names.get(column).map_or("", String::as_str);
    let stated = units.get(column).map(String::as_str);
    let by_line = stated.and_then(|unit| Some((unit, to_channel(channel, unit)?, "line of units")));
    let by_name = || in_name(name).and_then(|unit| Some((unit, to_channel(channel, unit)?, "name")));
    match by_line.or_else(by_name) {
        Some((unit, change, by)) if !change.is_empty() => {
            let (target, taken) = (map.target(), map.right_side());
            bail!(
                "{map}: the column is in {unit} by its {by}, expected {}: --map {target}='({taken}){change}'; or '({taken})*1' \
                 if the file is wrong",
                channel.unit()
            )
        }
        Some(_) => Ok(()),
        None => refuse_another_quantity((map, channel), name, stated),
    }
}

/// Refuses a column whose line of units, or name in brackets, says that it is another quantity than the channel.
fn refuse_another_quantity(
    (map, channel): (&Map, Channel),
    name: &str,
    stated: Option<&str>,
) -> anyhow::Result<()> {
    let known = |unit: &&str| is_of_another(channel, unit);
    let by_line = stated.filter(known).map(|unit| (unit, "line of units"));
    let by_name = || in_brackets(name).filter(known).map(|unit| (unit, "name"));
    let Some((unit, by)) = by_line.or_else(by_name) else { return Ok(()) };
    let (target, taken) = (map.target(), map.right_side());
    bail!(
        "{map}: the column is in {unit} by its {by}, expected {target} in {} or another unit of it: map another column, calculate it from this \
         one, or say '({taken})*1' if the file is wrong",
        channel.unit()
    )
}

/// Whether a unit is known, and of another quantity than the channel.
fn is_of_another(channel: Channel, unit: &str) -> bool {
    let plain = plain(unit);
    let elsewhere = Channel::ALL.iter().any(|other| to_channel(*other, unit).is_some());
    to_channel(channel, unit).is_none() && (elsewhere || OF_NO_CHANNEL.contains(&plain.as_str()))
}

/// A unit in small letters and without signs between them.
fn plain(unit: &str) -> String {
    let small = unit.to_lowercase().replace('μ', "µ").replace('²', "2").replace('³', "3");
    small.chars().filter(|c| c.is_alphanumeric() || *c == '°').collect()
}

/// What makes a channel's unit of another; `None` where the other isn't known.
fn to_channel(channel: Channel, unit: &str) -> Option<&'static str> {
    let plain = plain(unit);
    // Milli- and mega- differ in their letter's size alone.
    let milli = unit.trim_matches(|c: char| !c.is_alphanumeric()).starts_with('m');
    if milli && plain == "mpa" {
        return None;
    }
    if channel == Channel::Torque && plain == "mnm" {
        return Some(if milli { "/1000" } else { "*1e6" });
    }
    let rows = spellings(channel);
    rows.iter().find(|(names, _)| names.contains(&plain.as_str())).map(|(_, change)| *change)
}

/// The unit in a name: "Time (ms)", "angle [deg]", "t_ms".
fn in_name(name: &str) -> Option<&str> {
    let bare = || name.rsplit_once('_').or_else(|| name.rsplit_once(" in "));
    in_brackets(name).or_else(|| bare().map(|(_, unit)| unit.trim()))
}

/// The unit in the brackets behind a name.
fn in_brackets(name: &str) -> Option<&str> {
    let name = name.trim();
    let bracket = |open, close| name.strip_suffix(close).and_then(|name| name.rsplit_once(open));
    let found = bracket('(', ')').or_else(|| bracket('[', ']')).or_else(|| bracket('{', '}'));
    found.map(|(_, unit)| unit.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(map: &str, name: &str, unit: &str) -> Result<(), String> {
        let units = if unit.is_empty() { vec![] } else { vec![unit.to_owned()] };
        check(&map.parse().unwrap(), &[name.to_owned()], &units).map_err(|error| error.to_string())
    }

    #[test]
    fn another_unit_is_refused_with_what_mends_it() {
        for (map, name, unit, mend) in [
            ("time=Zeit", "Zeit", "ms", "time='(Zeit)/1000'"),
            ("time=Zeit", "Zeit", "[µs]", "/1e6"),
            ("time=Zeit", "Zeit", "(\u{3bc}s)", "/1e6"),
            ("angle=-w", "w", "deg", "angle='(-w)*pi/180'"),
            ("angle={Winkel [°]}", "Winkel [°]", "", "({Winkel [°]})*pi/180"),
            ("angle_command=c1", "soll_deg", "", "(c1)*pi/180"),
            ("torque=M", "M", "N·cm", "/100"),
            ("torque=M", "M", "N*cm", "/100"),
            ("torque=M", "M", "mNm", "/1000"),
            ("torque=M", "M", "MNm", "*1e6"),
            ("pressure_drop=p", "p", "bar", "*1e5"),
            ("pressure_drop=p", "p", "MPa", "*1e6"),
            ("flow=Q", "Q", "L/min", "/60000"),
            ("oil_temperature=T", "T", "K", "-273.15"),
        ] {
            let error = judged(map, name, unit).unwrap_err();
            assert!(error.contains(mend), "{map}, {unit}: {error}");
            let (target, _) = map.split_once('=').unwrap();
            let mended =
                error.split("--map ").nth(1).unwrap().split("'; or").next().unwrap().replace('\'', "");
            assert!(judged(&mended, name, unit).is_ok(), "{target}: {mended}");
        }
    }

    #[test]
    fn another_quantity_is_refused() {
        for (map, name, unit) in [
            ("angle=n", "n", "rpm"),
            ("angle=n", "n", "1/min"),
            ("angle={n [1/min]}", "n [1/min]", ""),
            ("angle=-n", "n", "rad/s"),
            ("angle=x", "x", "mm"),
            ("torque={p (bar)}", "p (bar)", ""),
            ("torque={F [N]}", "F [N]", ""),
            ("torque=M", "M", "V"),
            ("flow={p [bar]}", "p [bar]", ""),
            ("time=T", "T", "°C"),
        ] {
            let error = judged(map, name, unit).unwrap_err();
            assert!(error.contains("or another unit of it"), "{map}, {unit}: {error}");
        }
    }

    #[test]
    fn nothing_is_said_of_the_right_unit_an_unknown_one_or_a_column_that_was_changed() {
        for (map, name, unit) in [
            ("time=t", "t", "s"),
            ("time=t", "t", "[s]"),
            ("time=t", "t", "hh:mm:ss"),
            ("time=t/1000", "t", "ms"),
            ("time=t*1", "t", "ms"),
            ("time=row*0.01", "t", "ms"),
            ("torque=M", "M", "N m"),
            ("torque=M", "M", "N\u{b7}m"),
            ("pressure_drop=p", "p", "mPa"),
            ("motor_current[A]=i", "i", "mA"),
            // Behind a line a letter is seldom a unit.
            ("angle=x", "position_mm", ""),
            ("torque=m", "torque_v", ""),
            ("angle=x", "x", ""),
            ("oil_temperature=T", "T", "°C"),
            ("flow=Q", "Q", "m³/s"),
        ] {
            assert_eq!(judged(map, name, unit), Ok(()), "{map}, {name}, {unit}");
        }
    }
}
