//! Of the report: whether what is left is the measurement's own noise, neighbour by neighbour, by frequency and by order of
//! the angle.

use diagnosis::{Band, Description, Found, Order};
use log_data::Channel;
use report::{Axis, Block, Hue, Section, Style, Table, XyPlot, XySeries};
use std::f64::consts::TAU;
use study::words::{self, unit};

/// An amplitude that chance makes as large with a greater probability is none.
const CHANCE: f64 = 0.01;
/// Rows of the table of orders.
const ORDERS: usize = 12;

/// The section.
pub fn section(found: &Found) -> Section {
    let (before, after) = (&found.diagnosis.description_before, &found.diagnosis.description_after);
    let changed = words::is_changed(found);
    let mut section = Section::new("Is what is left the measurement's own noise?").with(Block::Text(
        "An error that is noise alone jumps about from sample to sample, has no favourite frequency, and doesn't come back \
         at the same angle of every turn."
            .to_owned(),
    ));
    section = section.with(Block::Text(neighbours(words::GIVEN, before)));
    if changed {
        section = section.with(Block::Text(neighbours(words::changed(found), after)));
    }
    if !before.bands.is_empty() {
        section = section.with(Block::Text(frequencies(if changed { after } else { before })));
        section = section.with(Block::XyPlot(by_frequency(found, changed)));
    }
    if !before.orders.is_empty() {
        // What is nothing at all orders needs no plot.
        let is_something =
            |plot: &XyPlot| plot.series.iter().any(|series| series.points.iter().any(|(_, y)| *y != 0.0));
        section = by_order(found, changed)
            .into_iter()
            .filter(is_something)
            .fold(section, |section, plot| section.with(Block::XyPlot(plot)));
        let left = if changed { after } else { before };
        section = section.with(Block::Text(match part_of_a_turn(found) {
            Some(part) => part_only(part),
            None => orders(left, unit(found.channel)),
        }));
        section = section.with(order_table(found, changed));
    }
    section
}

fn neighbours(which: &str, of: &Description) -> String {
    let which = words::with_capital(which);
    let white = &of.whiteness;
    if white.white {
        return format!(
            "{which}: from one sample to the next the error is as unpredictable as noise; its size is {:.2} times the noise.",
            of.rms_over_noise
        );
    }
    format!(
        "{which}: {:.0} % of the error's square could be foretold from the {} samples before; of pure noise nothing can. Its \
         size is {:.2} times the noise.",
        100.0 * white.foretold,
        white.lags,
        of.rms_over_noise
    )
}

/// Bands in which the error is clearly more than noise: by a test, and by a tenth in size.
fn louder(bands: &[Band]) -> Vec<&Band> {
    bands.iter().filter(|band| band.p_value < 0.01 && band.rms > 1.1 * band.noise).collect()
}

fn frequencies(of: &Description) -> String {
    let louder = louder(&of.bands);
    let Some(greatest) = louder.iter().max_by(|a, b| a.rms.total_cmp(&b.rms)) else {
        return "By frequency what is left is nowhere larger than the noise.".to_owned();
    };
    let (least, most) = louder.iter().fold((f64::INFINITY, 0.0), |(least, most), band| {
        (f64::min(least, band.from_hz), f64::max(most, band.to_hz))
    });
    format!(
        "By frequency what is left is larger than the noise between {least:.1} and {most:.1} Hz, most between {:.1} and {:.1} Hz.",
        greatest.from_hz, greatest.to_hz
    )
}

fn line(name: &str, hue: Hue, points: Vec<(f64, f64)>) -> XySeries {
    XySeries { name: name.to_owned(), style: Style::LineAndPoints, hue, points }
}

fn by_frequency(found: &Found, changed: bool) -> XyPlot {
    let (before, after) = (&found.diagnosis.description_before, &found.diagnosis.description_after);
    let points = |bands: &[Band], of: fn(&Band) -> f64| {
        bands.iter().map(|band| ((band.from_hz * band.to_hz).sqrt(), of(band))).collect()
    };
    let mut series = vec![line(words::GIVEN, Hue::Given, points(&before.bands, |band| band.rms))];
    if changed {
        series.push(line(words::changed(found), Hue::Extended, points(&after.bands, |band| band.rms)));
    }
    series.push(line("the measurement's noise", Hue::Noise, points(&after.bands, |band| band.noise)));
    XyPlot {
        title: "Error by frequency, in bands of half an octave".to_owned(),
        x: Axis::log("frequency", "Hz"),
        y: Axis::log("RMS in the band", unit(found.channel)),
        series,
        ..XyPlot::default()
    }
}

/// What acts the same both ways, or against the motion: a plot for each, so that a colour means a model in both.
fn by_order(found: &Found, changed: bool) -> [XyPlot; 2] {
    let (before, after) = (&found.diagnosis.description_before, &found.diagnosis.description_after);
    let angle = if found.channel == Channel::Torque { "angle" } else { "command" };
    let plot = |how: &str, of: fn(&Order) -> f64| {
        let points = |orders: &[Order]| orders.iter().map(|order| (order.order as f64, of(order))).collect();
        let mut series = vec![line(words::GIVEN, Hue::Given, points(&before.orders))];
        if changed {
            series.push(line(words::changed(found), Hue::Extended, points(&after.orders)));
        }
        XyPlot {
            title: format!("Error by order of the {angle}, {how}"),
            x: Axis::new("times per turn", ""),
            y: Axis::new("amplitude", unit(found.channel)),
            series,
            ..XyPlot::default()
        }
    };
    [
        plot("the same both ways", |order| order.both_ways),
        plot("against the motion", |order| order.against_motion),
    ]
}

/// Orders by their amplitude, those first that are more than chance.
fn order_table(found: &Found, changed: bool) -> Block {
    let (before, after) = (&found.diagnosis.description_before, &found.diagnosis.description_after);
    let mut rows: Vec<(bool, f64, Vec<String>)> = Vec::new();
    for order in &before.orders {
        let left = after.orders.iter().find(|of| of.order == order.order);
        let both = (order.both_ways, order.p_both_ways, left.map(|of| (of.both_ways, of.p_both_ways)));
        let against = (
            order.against_motion,
            order.p_against_motion,
            left.map(|of| (of.against_motion, of.p_against_motion)),
        );
        for (how, (amplitude, chance, left)) in
            [("the same both ways", both), ("against the motion", against)]
        {
            let told = |p: f64| if p < CHANCE { "" } else { " (chance)" };
            let mut cells = vec![
                order.order.to_string(),
                how.to_owned(),
                format!("{}{}", words::short(amplitude), told(chance)),
            ];
            if changed {
                cells.push(left.map_or_else(
                    || "–".to_owned(),
                    |(amplitude, chance)| format!("{}{}", words::short(amplitude), told(chance)),
                ));
            }
            let shows = chance < CHANCE || left.is_some_and(|(_, chance)| chance < CHANCE);
            rows.push((shows, amplitude.max(left.map_or(0.0, |left| left.0)), cells));
        }
    }
    rows.sort_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)));
    let mut header = vec![
        "times per turn".to_owned(),
        "acts".to_owned(),
        format!("{}, {}", words::GIVEN, unit(found.channel)),
    ];
    if changed {
        header.push(format!("{}, {}", words::changed(found), unit(found.channel)));
    }
    Block::Table(Table { header, rows: rows.into_iter().take(ORDERS).map(|(.., cells)| cells).collect() })
}

/// How much of a turn was recorded, where it is not a whole one.
fn part_of_a_turn(found: &Found) -> Option<f64> {
    let angles = found.shown.iter().flat_map(|shown| &shown.angle_rad).filter(|angle| angle.is_finite());
    let (least, most) = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), angle| {
        (f64::min(least, *angle), f64::max(most, *angle))
    });
    Some((most - least) / TAU).filter(|part| (0.0..1.0).contains(part))
}

/// What orders mean where no turn was completed.
fn part_only(part: f64) -> String {
    format!(
        "These records cover {:.0}° of a turn, so nothing can be seen to come back turn by turn. A wave of order n has n × {part:.3} \
         periods within them: orders below {:.0} have less than one, and stand for a level, a slope or a bend over the angle.",
        360.0 * part,
        (1.0 / part).ceil()
    )
}

fn orders(of: &Description, unit: &str) -> String {
    let both =
        of.orders.iter().map(|order| (order.order, order.both_ways, order.p_both_ways, "the same both ways"));
    let against = of
        .orders
        .iter()
        .map(|order| (order.order, order.against_motion, order.p_against_motion, "against the motion"));
    let greatest =
        both.chain(against).filter(|of| of.2 < 0.01 && of.1 > 0.0).max_by(|a, b| a.1.total_cmp(&b.1));
    greatest.map_or_else(
        || "By angle nothing of what is left comes back turn by turn.".to_owned(),
        |(order, amplitude, _, how)| {
            format!(
                "By angle, what is left comes back {order} times per turn with an amplitude of {} {unit}, {how}.",
                words::short(amplitude)
            )
        },
    )
}
