//! What was found, on the terminal and in the model file.

use crate::say::say;
use config::{ModelComments, write_model};
use diagnosis::{Identification, Identified};
use study::words;
use toml::Table;
use valve_model::{EffectId, Model};

/// A delay that is told, s.
const LATE_S: f64 = 5e-6;

/// From this many times the noise on, the numbers leave something unexplained.
const LEFT: f64 = 1.2;

/// Where a number stands in a model file.
struct Place {
    section: &'static str,
    key: &'static str,
}

/// The number that an effect is a factor on; of two the first.
fn place(id: EffectId) -> Option<Place> {
    let number = id.spec().folded_into?;
    Some(Place { section: number.section, key: number.each_key().next()? })
}

/// A line of the table.
struct Row {
    place: Place,
    before: f64,
    found: f64,
    std_error: f64,
    known: bool,
}

/// Each number that the record could show, as the model has it.
fn rows(found: &Identification, given: &Model) -> Vec<Row> {
    let table = |model: &Model| toml::from_str::<Table>(&write_model(model, &ModelComments::new())).ok();
    let (before, after) = (table(given), table(&found.model));
    let value =
        |table: &Option<Table>, place: &Place| table.as_ref()?.get(place.section)?.get(place.key)?.as_float();
    let row = |of: &Identified| {
        let place = place(of.id)?;
        let (before, found) = (value(&before, &place)?, value(&after, &place)?);
        Some(Row { place, before, found, std_error: of.std_error * found, known: of.is_shown() })
    };
    found.numbers.iter().filter_map(row).collect()
}

/// Prints what was found.
pub(super) fn report(found: &Identification, given: &Model, of: &str) {
    say(format_args!("{of}:"));
    say(format_args!("{:40} {:>12} {:>12} {:>12}", "", "before", "found", "std error"));
    for row in rows(found, given) {
        let doubt = if row.known { "" } else { "   not shown by this motion" };
        let name = format!("{}.{}", row.place.section, row.place.key);
        let Row { before, found, std_error, .. } = row;
        say(format_args!("{name:40} {before:>12.5} {found:>12.5} {std_error:>12.2e}{doubt}"));
    }
    if let Some((before, after)) = given.resonance_hz().zip(found.model.resonance_hz()) {
        say(format_args!("rotor and load swing about their command at {after:.1} Hz ({before:.1} before)"));
    }
    let delay = found.model.effects.iter().find(|effect| effect.id() == EffectId::SensorDelay);
    if let Some(delay_s) =
        delay.map(|delay| delay.number("delay_s")).filter(|delay_s| delay_s.abs() >= LATE_S)
    {
        let way = if delay_s > 0.0 { "late" } else { "early: its clock and the command's differ" };
        say(format_args!("the encoder is {:.2} ms {way}", 1e3 * delay_s.abs()));
    }
    say(outcome(found));
    for place in found.unfinished.iter().filter_map(|id| place(*id)) {
        say(format_args!(
            "{}.{} was still on its way when the last fit ended: begin from what was found",
            place.section, place.key
        ));
    }
    if found.gain.over_noise_after > LEFT && found.better {
        say(format_args!(
            "it leaves {:.1} times the noise: numbers farther from these than the fits came, or what is no number of the model, which \
             `stepvalve diagnose` looks for",
            found.gain.over_noise_after
        ));
    }
}

/// Whether the numbers are better, in a sentence.
fn outcome(found: &Identification) -> String {
    let unit = words::unit(found.channel);
    let gain = &found.gain;
    if found.better {
        format!(
            "on parts that were held out, encoder minus model is {} {unit} RMS, {} before",
            words::short(gain.rms_after),
            words::short(gain.rms_before)
        )
    } else {
        format!(
            "the belief stays as it was: with it, encoder minus model is {} {unit} RMS on parts that were held out, with the best of \
             other numbers {}, which is no less than chance makes it",
            words::short(gain.rms_before),
            words::short(gain.rms_after)
        )
    }
}

/// The model file's text.
pub(super) fn file(found: &Identification, given: &Model, of: &str) -> String {
    let header = format!(
        "{}, its numbers found by `stepvalve tune` from {of}.\nBehind each its standard error.\n{}",
        given.name,
        outcome(found)
    );
    let comments = rows(found, given).iter().fold(
        ModelComments::new().with_header(header),
        |comments, Row { place, std_error, known, .. }| {
            let text =
                if *known { format!("± {std_error:.1e}") } else { "not shown by the motion".to_owned() };
            comments.with_key(place.section, place.key, text)
        },
    );
    write_model(&found.model, &comments)
}
