//! Of the report: what the models leave, and what to do next, in words to act on.

use super::quality::mend_first;
use super::words::{first_guesses, names, short, unit};
use diagnosis::{Dependence, Found, Verdict};
use log_quality::Finding;
use report::{Block, Section, Table};

/// Dependences that are spelled out.
const MOST: usize = 4;

/// The section.
pub fn section(found: &Found, quality: &[Finding]) -> Section {
    let section = Section::new("What remains, and what to do next").with(Block::Text(left(found)));
    let mut rows: Vec<Vec<String>> = Vec::new();
    // Where a group explains it, that is what remains.
    let open =
        found.diagnosis.structure_after.iter().filter(|_| found.diagnosis.verdict != Verdict::Ambiguous);
    for row in open.map(remaining) {
        if rows.len() < MOST && !rows.iter().any(|known| known.get(1) == row.get(1)) {
            rows.push(row);
        }
    }
    let section = if rows.is_empty() {
        section
    } else {
        let header =
            ["what remains", "what makes such an error", "how to look for it"].map(str::to_owned).to_vec();
        section.with(Block::Table(Table { header, rows }))
    };
    steps(found, quality)
        .into_iter()
        .enumerate()
        .fold(section, |section, (index, step)| section.with(Block::Text(format!("{}. {step}", index + 1))))
}

/// How much is left, beside the noise.
fn left(found: &Found) -> String {
    let after = found.diagnosis.description_after.rms_over_noise;
    let noise = found.diagnosis.residual.first().map_or(f64::NAN, |residual| residual.noise);
    let noise = format!("{} {} on average", short(noise), unit(found.channel));
    let times = format!(
        "each sample counted by how well it is known, {after:.1} times the measurement's own noise, which is {noise}"
    );
    match found.diagnosis.verdict {
        Verdict::NoDiscrepancy | Verdict::Explained => {
            format!("What remains is as large as the measurement's own noise, {noise}, and looks like it.")
        }
        Verdict::PartlyExplained => {
            format!("What remains is, {times}.")
        }
        Verdict::Unexplained if !found.diagnosis.unnamed.is_empty() => {
            format!("No cause is accepted. What remains beside the laws without a name is, {times}.")
        }
        Verdict::Ambiguous | Verdict::Unexplained => {
            format!("No cause is accepted, so all of the model's error remains: {times}.")
        }
    }
}

fn remaining(of: &Dependence) -> Vec<String> {
    let how = if of.as_friction { "as friction, against the motion" } else { "the same both ways" };
    let what = format!("an error by {}, {how}: {:.0} % of its square", of.on, 100.0 * of.share);
    let (makes, look) = cause_of(&of.on, of.as_friction);
    [what.as_str(), makes, look].map(str::to_owned).to_vec()
}

/// What usually makes an error that depends on this, and how it is looked for.
pub fn cause_of(on: &str, as_friction: bool) -> (&'static str, &'static str) {
    match on {
        on if on.starts_with("angle") && as_friction => (
            "a shaft or bore out of round, a bent spool, a seal that is worn on one side",
            "turn slowly by a whole turn both ways; loosen or exchange one part, and see whether it moves or goes",
        ),
        on if on.starts_with("angle") => (
            "something that pushes by the angle: an unbalance, a magnet, flow forces, an eccentric coupling or encoder",
            "turn slowly by a whole turn both ways, without pressure and with it; turn the encoder or the coupling by 90° and repeat",
        ),
        on if on.starts_with("speed") => (
            "another friction law than the model's: a Stribeck curve of another form, viscosity, hydrodynamic drag",
            "run constant speeds both ways over the whole range, some three in each decade, at one temperature",
        ),
        on if on.starts_with("acceleration") => (
            "an inertia, a delay of a channel, a coupling that gives",
            "run sines of one amplitude at three frequencies a factor of three apart",
        ),
        on if on.starts_with("pressure") => (
            "seals pressed on by the pressure, or a pressure on an area of the spool",
            "repeat the same runs at zero, half and full pressure, in mixed order",
        ),
        on if on.starts_with("temperature") || on.starts_with("oil") => (
            "oil that becomes thinner, seals that become softer",
            "repeat the same runs cold and warm, 20 K apart",
        ),
        on if on.starts_with("time since rest") || on.starts_with("time_at_rest") => (
            "friction that grows while the contact rests, oil that is squeezed out, a bristle's own time",
            "start after rests of 0.1, 1 and 10 s, in mixed order",
        ),
        on if on.starts_with("motion") => (
            "a motion that the model was not made for, or a part of the record that is no run of its kind",
            "see in the table which runs are worst, and diagnose them alone (--exclude RUN)",
        ),
        on if on.starts_with("run") || on.starts_with("distance") => (
            "something that changes from run to run: a transducer's zero, wear, warming up",
            "repeat the first runs at the end; record the oil's temperature and the transducer's zero before each run",
        ),
        _ => (
            "nothing that is known to depend on it alone",
            "repeat runs that differ in that alone, everything else kept",
        ),
    }
}

/// What to do, in order.
fn steps(found: &Found, quality: &[Finding]) -> Vec<String> {
    let diagnosis = &found.diagnosis;
    let mut steps = mend_first(quality);
    steps.extend(first_guesses(diagnosis));
    if !diagnosis.causes.is_empty() {
        steps.push(
            "Take model-extended.toml for the simulation; a controller makes use of it as its belief, with [compensation] level = \
             \"full-with-effects\" where it has effects."
                .to_owned(),
        );
    }
    if !diagnosis.unnamed.is_empty() {
        steps.push(
            "The laws without a name are in model-extended.toml: take it where a good prediction is wanted, within what these runs \
             cover. To find out what makes them, see what could, below."
                .to_owned(),
        );
    }
    for group in &diagnosis.ambiguous {
        steps.push(match &group.best {
            Some(best) => format!(
                "{} can't be told apart by these data. Until they can, {} may stand for them: its entry is in model-extended.toml, \
                 behind comment marks.",
                names(&group.ids),
                best.id
            ),
            None => format!("{} can't be told apart by these data: {}.", names(&group.ids), group.reason),
        });
    }
    if diagnosis.verdict == Verdict::NoDiscrepancy && steps.is_empty() {
        steps.push(if diagnosis.within_tolerance.is_empty() {
            "Nothing has to be done: the model may be used as it is, over the range that these runs cover."
                .to_owned()
        } else {
            format!(
                "Nothing has to be done. The given model is off by {} {unit} on the runs kept aside, and model-extended.toml, which has \
                 these corrections, by {}: take it where the difference matters.",
                short(diagnosis.gain.rms_before),
                short(diagnosis.gain.rms_after),
                unit = unit(found.channel)
            )
        });
    }
    steps.push(diagnosis.next_experiment.clone());
    steps
}
