//! Of the report: the error over everything that was recorded, in plots in which what is selected in one lights up in all.

use diagnosis::{Found, Shown};
use log_data::Channel;
use log_data::median;
use report::{Axis, Block, Covariate, Hue, Linked, LinkedSeries, Section};
use std::f64::consts::TAU;
use study::words::{self, is_changed, short, unit};

/// Samples in the plots.
const SAMPLES: usize = 8000;
/// Samples so many deviations off are named, this many of them. Of a billion normal ones none is by chance.
const FAR: f64 = 7.0;
const NAMED: usize = 5;

/// What a sample is plotted over, if its run has it.
struct Over {
    label: &'static str,
    unit: &'static str,
    /// Whether it is shown at first.
    shown: bool,
    of: fn(&Shown, usize) -> Option<f64>,
}

const fn over(
    label: &'static str,
    unit: &'static str,
    shown: bool,
    of: fn(&Shown, usize) -> Option<f64>,
) -> Over {
    Over { label, unit, shown, of }
}

const OVER: [Over; 8] = [
    over("speed", "rad/s", true, |shown, index| shown.speed_rad_per_s.get(index).copied()),
    over("angle over a turn", "rad", true, |shown, index| {
        shown.angle_rad.get(index).map(|angle| angle.rem_euclid(TAU))
    }),
    over("angle", "rad", false, |shown, index| shown.angle_rad.get(index).copied()),
    over("time", "s", true, |shown, index| shown.time_s.get(index).copied()),
    over("time in the block", "s", false, |shown, index| {
        Some(shown.time_s.get(index)? - shown.time_s.first()?)
    }),
    over("measured value", "", false, |shown, index| shown.measured.get(index).copied()),
    over("pressure drop", "MPa", true, |shown, index| {
        shown.pressure_pa.get(index).map(|pressure| pressure / 1e6)
    }),
    over("oil temperature", "°C", false, |shown, index| shown.temperature_c.get(index).copied()),
];

/// The section.
pub fn section(found: &Found) -> Section {
    Section::new("Where the error sits")
        .with(Block::Text(
            "Measured less simulated, sample by sample, of the stretches of the runs (blocks) that were looked at. What is flat and as thin as the noise is \
             right; a slope, a step or a wave is something that the model misses. Pick what it is plotted over, and drag over \
             samples in one plot: they light up in the others, and their runs in the table above."
                .to_owned(),
        ))
        .with(Block::Linked(Box::new(linked(found))))
        .with(Block::Text(outliers(found)))
}

/// The samples that are farthest from both models, by name. Where a prediction is not well known itself, as where it begins,
/// an error says little of the sample.
fn outliers(found: &Found) -> String {
    let error = |shown: &Shown, index: usize| {
        let measured = shown.measured.get(index)?;
        Some((measured - shown.before.get(index)?).abs().min((measured - shown.after.get(index)?).abs()))
    };
    // In standard deviations of the error model.
    let errors = |shown: &Shown| -> Vec<f64> {
        let weights = shown.weights.iter().enumerate();
        weights.map(|(index, weight)| weight * error(shown, index).unwrap_or(f64::NAN)).collect()
    };
    let by_block: Vec<(&Shown, Vec<f64>)> = found.shown.iter().map(|shown| (shown, errors(shown))).collect();
    let mut all: Vec<f64> = by_block
        .iter()
        .flat_map(|(_, errors)| errors.iter().copied())
        .filter(|error| error.is_finite())
        .collect();
    // Of normal noise half of all errors are below 0.6745 of its standard deviation.
    let Some(usual) = median(&mut all).map(|median| median / 0.6745).filter(|usual| *usual > 0.0) else {
        return String::new();
    };
    let mut far: Vec<(f64, String)> = Vec::new();
    for (shown, errors) in &by_block {
        let begin = shown.time_s.first().copied().unwrap_or(0.0);
        for (index, deviations) in errors.iter().enumerate().filter(|(_, error)| **error > FAR * usual) {
            let time_s = shown.time_s.get(index).copied().unwrap_or(f64::NAN);
            let off = error(shown, index).unwrap_or(f64::NAN);
            far.push((
                *deviations,
                format!(
                    "{} at {time_s:.3} s ({} s into its block), off by {} {}",
                    shown.name,
                    short(time_s - begin),
                    short(off),
                    unit(found.channel)
                ),
            ));
        }
    }
    if far.is_empty() {
        return String::new();
    }
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    let named: Vec<&str> = far.iter().take(NAMED).map(|(_, place)| place.as_str()).collect();
    format!(
        "{} {} off by more than {FAR:.0} usual deviations with either model; the farthest: {}.",
        far.len(),
        if far.len() == 1 { "sample is" } else { "samples are" },
        named.join("; ")
    )
}

fn linked(found: &Found) -> Linked {
    let samples = samples(found);
    let column = |of: &dyn Fn(&Shown, usize) -> Option<f64>| -> Vec<f64> {
        samples.iter().map(|(_, shown, index)| of(shown, *index).unwrap_or(f64::NAN)).collect()
    };
    let covariates = OVER.iter().filter_map(|over| {
        let values = column(&over.of);
        let axis = Axis::new(over.label, if over.unit.is_empty() { unit(found.channel) } else { over.unit });
        values.iter().any(|value| value.is_finite()).then_some(Covariate { axis, values, shown: over.shown })
    });
    let error = |predicted: fn(&Shown) -> &Vec<f64>| {
        column(&|shown, index| Some(shown.measured.get(index)? - predicted(shown).get(index)?))
    };
    let series = |name: &str, hue, values| LinkedSeries { name: name.to_owned(), hue, values };
    let mut errors = vec![series(words::GIVEN, Hue::Given, error(|shown| &shown.before))];
    if is_changed(found) {
        errors.push(series(words::changed(found), Hue::Extended, error(|shown| &shown.after)));
    }
    let mut covariates: Vec<Covariate> = covariates.collect();
    if found.channel == Channel::Angle {
        // The command's angle: that of the rotor follows it.
        covariates
            .iter_mut()
            .for_each(|of| of.axis.label = of.axis.label.replace("angle", "commanded angle"));
    }
    let mut groups: Vec<String> = Vec::new();
    let group = samples.iter().map(|(_, shown, _)| {
        if groups.last() != Some(&shown.name) && !groups.contains(&shown.name) {
            groups.push(shown.name.clone());
        }
        groups.iter().position(|name| *name == shown.name).unwrap_or(0) as u32
    });
    let group = group.collect();
    Linked {
        y: Axis::new("measured less simulated", unit(found.channel)),
        covariates,
        series: errors,
        groups,
        group,
    }
}

/// Samples of all blocks, evenly, and in each stretch between two of them the one that is farthest off.
fn samples(found: &Found) -> Vec<(usize, &Shown, usize)> {
    let total: usize = found.shown.iter().map(|shown| shown.time_s.len()).sum();
    let stride = (2 * total).div_ceil(SAMPLES).max(1);
    let mut samples = Vec::new();
    for (block, shown) in found.shown.iter().enumerate() {
        let error = |index: usize| {
            let (measured, after) = (shown.measured.get(index)?, shown.after.get(index)?);
            Some((measured - after).abs()).filter(|error| error.is_finite())
        };
        for from in (0..shown.time_s.len()).step_by(stride) {
            let part = from..(from + stride).min(shown.time_s.len());
            let farthest = part
                .filter_map(|index| Some((index, error(index)?)))
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map(|(index, _)| index);
            let even = error(from).map(|_| from);
            samples.extend(even.map(|index| (block, shown, index)));
            samples.extend(farthest.filter(|index| Some(*index) != even).map(|index| (block, shown, index)));
        }
    }
    samples
}
