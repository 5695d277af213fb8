//! Of the report: whether what is left is the measurement's own noise, neighbour by neighbour, by frequency and by order of
//! the angle.

use super::words::unit;
use diagnosis::{Band, Description, Found, Order};
use log_data::Channel;
use report::{Axis, Block, Section, Style, XyPlot, XySeries};

/// The section.
pub fn section(found: &Found) -> Section {
    let (before, after) = (&found.diagnosis.description_before, &found.diagnosis.description_after);
    let changed = !found.diagnosis.causes.is_empty();
    let mut section = Section::new("Is what is left the measurement's own noise?").with(Block::Text(
        "An error that is noise alone jumps about from sample to sample, has no favourite frequency, and doesn't come back \
         at the same angle of every turn."
            .to_owned(),
    ));
    section = section.with(Block::Text(neighbours("The model as given", before)));
    if changed {
        section = section.with(Block::Text(neighbours("The model extended", after)));
    }
    if !before.bands.is_empty() {
        section = section.with(Block::Text(frequencies(if changed { after } else { before })));
        section = section.with(Block::XyPlot(by_frequency(found, changed)));
    }
    if !before.orders.is_empty() {
        section = section.with(Block::XyPlot(by_order(found, changed)));
        section =
            section.with(Block::Text(orders(if changed { after } else { before }, unit(found.channel))));
    }
    section
}

fn neighbours(which: &str, of: &Description) -> String {
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

fn by_frequency(found: &Found, changed: bool) -> XyPlot {
    let (before, after) = (&found.diagnosis.description_before, &found.diagnosis.description_after);
    let points = |bands: &[Band], of: fn(&Band) -> f64| {
        bands.iter().map(|band| ((band.from_hz * band.to_hz).sqrt(), of(band))).collect()
    };
    let line = |name: &str, points: Vec<(f64, f64)>| XySeries {
        name: name.to_owned(),
        style: Style::LineAndPoints,
        points,
    };
    let mut series = vec![line("model as given", points(&before.bands, |band| band.rms))];
    if changed {
        series.push(line("model extended", points(&after.bands, |band| band.rms)));
    }
    series.push(line("the measurement's noise", points(&after.bands, |band| band.noise)));
    XyPlot {
        title: "Error by frequency, in bands of half an octave".to_owned(),
        x: Axis::log("frequency", "Hz"),
        y: Axis::log("RMS in the band", unit(found.channel)),
        series,
    }
}

fn by_order(found: &Found, changed: bool) -> XyPlot {
    let (before, after) = (&found.diagnosis.description_before, &found.diagnosis.description_after);
    let points = |orders: &[Order], of: fn(&Order) -> f64| {
        orders.iter().map(|order| (order.order as f64, of(order))).collect()
    };
    let line = |name: &str, points: Vec<(f64, f64)>| XySeries {
        name: name.to_owned(),
        style: Style::LineAndPoints,
        points,
    };
    let mut series = vec![
        line("as given, the same both ways", points(&before.orders, |order| order.both_ways)),
        line("as given, against the motion", points(&before.orders, |order| order.against_motion)),
    ];
    if changed {
        series.push(line("extended, the same both ways", points(&after.orders, |order| order.both_ways)));
        series
            .push(line("extended, against the motion", points(&after.orders, |order| order.against_motion)));
    }
    let angle = if found.channel == Channel::Torque { "angle" } else { "command" };
    XyPlot {
        title: format!("Error by order of the {angle}: how much comes back so many times per turn"),
        x: Axis::new("times per turn", ""),
        y: Axis::new("amplitude", unit(found.channel)),
        series,
    }
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
                super::words::short(amplitude)
            )
        },
    )
}
