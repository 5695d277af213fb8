//! paper.html.

use super::figures::{Rotation, Sine};
use super::verdict::{self, Verdict};
use super::{Findings, Short};
use report::{Axis, Block, Hue, Page, Section, Style, Table, XyPlot, XySeries};

/// The page.
pub fn page(findings: &Findings) -> Page {
    let headline = verdict::headline(&findings.verdicts);
    let mut page = Page::new("Friction of a stepped rotary flow control valve: the paper, checked", headline);
    page.sections.push(verdicts(findings));
    page.sections.push(sines(findings));
    page.sections.push(rotations(findings));
    page.sections.push(ramps(findings));
    page.sections.extend(numbers(findings));
    page
}

fn verdicts(findings: &Findings) -> Section {
    let row = |verdict: &Verdict| {
        vec![verdict.outcome.word().to_owned(), verdict.claim.to_owned(), verdict.why.clone()]
    };
    let header = ["verdict", "the paper states", "what its numbers say"].map(str::to_owned).to_vec();
    let table = Table { header, rows: findings.verdicts.iter().map(row).collect() };
    Section::new("What became of its statements").with(Block::Table(table))
}

/// Every number, folded away under its heading.
fn numbers(findings: &Findings) -> impl Iterator<Item = Section> {
    findings.groups().map(|facts| {
        let rows = facts.iter().map(|fact| {
            let unit = fact.unit_shown();
            let stated =
                fact.stated.map_or_else(|| "–".to_owned(), |stated| format!("{}{unit}", Short(stated)));
            vec![fact.text.clone(), format!("{}{unit}", Short(fact.value)), stated, fact.id.clone()]
        });
        let header = ["what", "found", "the paper", "name in paper.json"].map(str::to_owned).to_vec();
        let heading = facts.first().map_or("", |fact| fact.group);
        let heading = format!("{heading}: {} numbers", facts.len());
        Section::folded(heading).with(Block::Table(Table { header, rows: rows.collect() }))
    })
}

fn plot(title: &str, x: Axis, y: Axis, series: Vec<XySeries>) -> Block {
    Block::XyPlot(XyPlot { title: title.to_owned(), x, y, series, ..XyPlot::default() })
}

fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> XySeries {
    XySeries { name: name.into(), style: Style::Line, hue: Hue::ByPlace, points }
}

fn pairs(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).collect()
}

fn sines(findings: &Findings) -> Section {
    let against = |x: fn(&Sine) -> &[f64]| -> Vec<XySeries> {
        findings.sines.iter().map(|sine| line(sine.name, pairs(x(sine), &sine.torque_nm))).collect()
    };
    let text = "Figure 7 is the set \"initial\", Figure 12 the set \"revised\". The paper gives the sine's frequency, 1 Hz, and no amplitude: 1 rad/s here.";
    Section::new("Figures 7 and 12: friction under a sine of speed")
        .with(Block::Text(text.to_owned()))
        .with(plot(
            "Friction over time",
            Axis::new("time", "s"),
            Axis::new("friction torque", "N·m"),
            against(|sine| &sine.time_s),
        ))
        .with(plot(
            "Friction over speed",
            Axis::new("speed", "rad/s"),
            Axis::new("friction torque", "N·m"),
            against(|sine| &sine.speed_rad_per_s),
        ))
}

/// How much of a rotation is shown: the ramp, and some swings of a motor that does not turn. All of it would be solid ink.
const START_S: f64 = 0.15;

fn rotations(findings: &Findings) -> Section {
    let figure = |pulse_rate_hz: f64| -> Vec<XySeries> {
        let shown = findings.rotations.iter().filter(|rotation| rotation.pulse_rate_hz == pulse_rate_hz);
        let start = |rotation: &Rotation| {
            let points = pairs(&rotation.time_s, &rotation.friction_nm);
            points.into_iter().take_while(|(time_s, _)| *time_s <= START_S).collect()
        };
        shown.map(|rotation| line(label(rotation), start(rotation))).collect()
    };
    let text = "The paper measured 1.5 N·m on average and about 3 N·m at the start of motion, at both rates. It gives no ramp: 10 MHz/s here. Shown is the start; a motor that does not turn the valve swings on like that, and paper.json has all.";
    let axes = || (Axis::new("time", "s"), Axis::new("friction torque", "N·m"));
    let mut section =
        Section::new("Figures 10 and 11: rotation by the motor").with(Block::Text(text.to_owned()));
    for (title, pulse_rate_hz) in [("Figure 10: 200 kHz", 200e3), ("Figure 11: 600 kHz", 600e3)] {
        let (x, y) = axes();
        section = section.with(plot(title, x, y, figure(pulse_rate_hz)));
    }
    section
}

fn label(rotation: &Rotation) -> String {
    let turns = if rotation.follows { "" } else { " (does not turn)" };
    format!("{}{turns}", rotation.name)
}

fn ramps(findings: &Findings) -> Section {
    let series = findings.ramps.iter().map(|ramps| line(ramps.name, ramps.peaks.clone())).collect();
    let text = "How high the torque rises when motion starts depends on how fast it starts: T_s is reached only below about ω_s²σ0/2T_s. \
                Far above, the bristles' damping σ1·ω makes a peak of its own. \
                The measured 3 N·m says nothing about T_s without the ramp. What a set costs in slow motion stands beside it.";
    let header = ["set", "ω_s²σ0/2T_s, rad/s²", "T_s, N·m", "stick-slip at 0.02 rad/s, peak to peak, rad"]
        .map(str::to_owned)
        .to_vec();
    let row = |ramps: &super::ramp::Ramps| {
        let slow = if ramps.stick_slip_rad.is_finite() {
            Short(ramps.stick_slip_rad).to_string()
        } else {
            "does not turn".to_owned()
        };
        vec![
            ramps.name.to_owned(),
            Short(ramps.bound_rad_per_s2).to_string(),
            Short(ramps.static_nm).to_string(),
            slow,
        ]
    };
    let table = Table { header, rows: findings.ramps.iter().map(row).collect() };
    Section::new("The peak at the start against the ramp")
        .with(Block::Text(text.to_owned()))
        .with(plot(
            "Peak of the friction torque",
            Axis::log("acceleration", "rad/s²"),
            Axis::new("peak", "N·m"),
            series,
        ))
        .with(Block::Table(table))
}
