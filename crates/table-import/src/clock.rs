//! Times of day and dates in cells, as seconds.

use jiff::civil::{DateTime, Time};
use jiff::fmt::strtime;
use jiff::tz::TimeZone;
use jiff::{Timestamp, civil};

/// Seconds of a day.
const DAY_S: f64 = 86_400.0;

/// Seconds since 1970 of a date with a time, since midnight of a time alone: `2020-07-08 21:24:28.5`, with `T` and an
/// offset from UTC too, `21:24:28.5`, or what a format of strptime says. `None` where it is neither.
pub(crate) fn seconds(text: &str, format: Option<&str>) -> Option<f64> {
    if let Some(format) = format {
        let parts = strtime::parse(format, text).ok()?;
        let stamp = || parts.to_timestamp().ok().map(since_1970);
        let date = || parts.to_datetime().ok().and_then(of_date);
        return stamp().or_else(date).or_else(|| parts.to_time().ok().map(of_day));
    }
    let stamp = || text.parse::<Timestamp>().ok().map(since_1970);
    let date = || text.parse::<DateTime>().ok().and_then(of_date);
    let time = || text.parse::<Time>().ok().map(of_day);
    // A number alone is a number; what is left has colons or dashes.
    text.contains([':', '-']).then(|| stamp().or_else(date).or_else(time)).flatten()
}

/// Checks a format of strptime.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn check(format: &str) -> Result<(), String> {
    let example = civil::date(2020, 7, 8).at(21, 24, 28, 0);
    match strtime::format(format, example) {
        Ok(_) => Ok(()),
        Err(error) => Err(format!("{format:?}, expected a format such as %d.%m.%Y %H:%M:%S%.f: {error}")),
    }
}

fn since_1970(stamp: Timestamp) -> f64 {
    stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9
}

fn of_date(date: DateTime) -> Option<f64> {
    date.to_zoned(TimeZone::UTC).ok().map(|zoned| since_1970(zoned.timestamp()))
}

fn of_day(time: Time) -> f64 {
    let whole = 3600 * i32::from(time.hour()) + 60 * i32::from(time.minute()) + i32::from(time.second());
    f64::from(whole) + f64::from(time.subsec_nanosecond()) * 1e-9
}

/// Times of day in a column, from row to row: after midnight they go on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Days {
    before_s: f64,
    shift_s: f64,
}

impl Days {
    /// The time of a row, days counted.
    pub(crate) fn counted(&mut self, time_s: f64) -> f64 {
        // Half a day back can be nothing but midnight.
        if (0.0..DAY_S).contains(&time_s) && time_s < self.before_s - 0.5 * DAY_S {
            self.shift_s += DAY_S;
        }
        self.before_s = time_s;
        time_s + self.shift_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_times_of_day() {
        let date_s = 1_594_243_468.0;
        for (text, expected) in [
            ("2020-07-08 21:24:28", Some(date_s)),
            ("2020-07-08T21:24:28.25", Some(date_s + 0.25)),
            ("2020-07-08T21:24:28Z", Some(date_s)),
            ("2020-07-08T23:24:28+02:00", Some(date_s)),
            ("21:24:28.5", Some(77_068.5)),
            ("00:00:00", Some(0.0)),
            ("212428", None),
            ("word", None),
            ("25:00:00", None),
        ] {
            assert_eq!(seconds(text, None), expected, "{text}");
        }
        assert_eq!(seconds("08.07.2020 21:24:28.5", Some("%d.%m.%Y %H:%M:%S%.f")), Some(date_s + 0.5));
        assert_eq!(seconds("21h24", Some("%Hh%M")), Some(77_040.0));
        assert_eq!(seconds("2020-07-08 21:24:28", Some("%d.%m.%Y")), None);
        assert!(check("%d.%m.%Y %H:%M:%S%.f").is_ok() && check("%!").is_err());
    }

    #[test]
    fn midnight_is_passed() {
        let mut days = Days::default();
        let counted: Vec<f64> = [86_398.0, 86_399.5, 1.0, 2.0].into_iter().map(|s| days.counted(s)).collect();
        assert_eq!(counted, [86_398.0, 86_399.5, 86_401.0, 86_402.0]);
    }
}
