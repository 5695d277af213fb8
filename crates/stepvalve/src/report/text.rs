//! Numbers, times and angles as an engineer writes them.

use std::time::{Duration, UNIX_EPOCH};

/// Three significant digits, without exponent where that stays readable.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "–".to_owned() };
    }
    let magnitude = value.abs().log10().floor();
    if !(-5.0..7.0).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    format!("{value:.*}", (2.0 - magnitude).max(0.0) as usize)
}

/// An angle in degrees.
pub fn degrees(angle_rad: f64) -> String {
    format!("{}°", number(angle_rad.to_degrees()))
}

/// A moment on the page's time axis.
pub fn moment(time_s: f64) -> String {
    format!("{time_s:.3} s")
}

/// A length of time.
pub fn duration(length_s: f64) -> String {
    match length_s {
        length if length < 600.0 => format!("{length:.3} s"),
        length if length < 7200.0 => format!("{:.1} min", length / 60.0),
        length => format!("{:.2} h", length / 3600.0),
    }
}

/// 1234567 as "1 234 567", with narrow no-break spaces.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let place = |index: usize| digits.len() - index;
    let spaced = digits.char_indices().flat_map(|(index, digit)| {
        let space = (index > 0 && place(index).is_multiple_of(3)).then_some('\u{202f}');
        space.into_iter().chain([digit])
    });
    spaced.collect()
}

/// A count with its noun: 1 lost step, 2 lost steps, no lost step.
pub fn count(count: u64, noun: &str) -> String {
    match count {
        0 => format!("no {noun}"),
        1 => format!("1 {noun}"),
        more => format!("{} {noun}s", grouped(more)),
    }
}

/// A time of the wall clock, UTC, from ns since 1970.
pub fn utc(unix_ns: f64) -> String {
    let time = UNIX_EPOCH + Duration::from_secs((unix_ns.max(0.0) / 1e9) as u64);
    humantime::format_rfc3339_seconds(time).to_string().replace('T', " ").replace('Z', " UTC")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        let found = [0.0, 0.003_141_59, 0.123_4, 6.0, 40.25, 225_000.0, -2.5, 1e-9, f64::NAN].map(number);
        assert_eq!(found, ["0", "0.00314", "0.123", "6.00", "40.2", "225000", "-2.50", "1.00e-9", "–"]);
        assert_eq!([7, 1_000, 1_234_567].map(grouped), ["7", "1\u{202f}000", "1\u{202f}234\u{202f}567"]);
        assert_eq!([0, 1, 2].map(|n| count(n, "fault")), ["no fault", "1 fault", "2 faults"]);
    }
}
