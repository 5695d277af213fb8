//! Where runs stand on their log's clock.

use log_data::{Attribute, Log, Run};

/// Seconds of a day.
const DAY_S: f64 = 86_400.0;
/// A log's clock that is further on tells dates: three years, s.
const DATES_S: f64 = 3.0 * 365.0 * DAY_S;

/// Moves a run behind the one before it, where a gap is wanted.
pub(super) fn follow(run: &mut Run, before: Option<&Run>, gap_s: Option<f64>) {
    if let (Some(before), Some(gap_s)) = (before, gap_s) {
        run.shift(before.end_s() + gap_s - run.start_s());
    }
}

/// A clock of dates, seconds since 1970, begins with the day on which the first run does: so many digits fewer are spent on
/// the date. The attribute `time_zero_unix_s` says which day it is.
pub(super) fn begin_with_a_day(log: &mut Log) {
    let start_s = log.runs.iter().map(Run::start_s).fold(f64::INFINITY, f64::min);
    if !(start_s.is_finite() && start_s > DATES_S) {
        return;
    }
    let day_s = (start_s / DAY_S).floor() * DAY_S;
    log.runs.iter_mut().for_each(|run| run.shift(-day_s));
    log.attributes.insert("time_zero_unix_s".to_owned(), Attribute::Number(day_s));
}
