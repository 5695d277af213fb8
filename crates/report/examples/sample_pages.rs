//! Writes pages of all kinds into a folder: what the browser test opens, and what to look at after a change.
//!
//!     cargo run --release -p report --example sample_pages -- FOLDER
#![allow(clippy::unwrap_used, missing_docs)]

use report::{
    Axis, Band, Block, Covariate, Distribution, Histogram, Hue, Level, Line, Linked, LinkedSeries, Marker,
    OpeningRow, OpeningTable, Page, Panel, ReportError, RunData, Section, Strip, Style, Table, TimeAxis,
    TimePlots, XyPlot, XySeries, run_page,
};
use std::f64::consts::TAU;
use std::path::Path;

/// The sample with the only peak of the following error; the test looks for its height, in millidegrees.
const PEAK_AT: f64 = 0.6180;
const PEAK_MDEG: f64 = 123.456;

fn main() -> Result<(), ReportError> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/sample-pages".to_owned());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)
        .map_err(|source| ReportError::Write { path: folder.to_owned(), source })?;
    for (name, samples) in [("run", 6_000), ("run-100k", 100_000), ("run-10m", 10_000_000)] {
        run_page(run(samples)?).write_html(&folder.join(format!("{name}.html")))?;
    }
    run_page(RunData { title: "nothing".into(), ..RunData::default() })
        .write_html(&folder.join("empty.html"))?;
    odd_signals()?.write_html(&folder.join("odd.html"))?;
    short_runs()?.write_html(&folder.join("short-runs.html"))?;
    linked().write_html(&folder.join("linked.html"))?;
    x_over_y().write_html(&folder.join("xy.html"))
}

/// Runs that each lie within one column of pixels, far apart.
fn short_runs() -> Result<Page, ReportError> {
    const RUNS: usize = 12;
    const SAMPLES: usize = 30;
    let place = |run: usize, k: usize| (run * 37 + run * run) as f64 + k as f64 * 1e-4;
    let time: Vec<f64> = (0..RUNS).flat_map(|run| (0..=SAMPLES).map(move |k| place(run, k))).collect();
    let axis = TimeAxis::new(&time, 1, &[])?;
    let value = |index: usize| {
        let k = index % (SAMPLES + 1);
        if k == SAMPLES { f64::NAN } else { (k as f64).sin() }
    };
    let trace = axis.trace((0..time.len()).map(value))?;
    let plots = TimePlots {
        panels: vec![Panel::new("Torque").with("torque", "N·m", trace)],
        ..TimePlots::default()
    };
    let mut page = Page::new("Short runs", "Twelve runs of three milliseconds in eight minutes.");
    page.sections.push(Section::new("All").with(Block::TimePlots(plots)));
    Ok(page)
}

/// Runs of a table that open, and their samples in linked plots; two samples are wild.
fn linked() -> Page {
    const RUNS: usize = 6;
    const SAMPLES: usize = 500;
    let name = |run: usize| format!("run <{run}>");
    let wild = |run: usize, k: usize| if (run, k) == (2, 100) || (run, k) == (4, 200) { 50.0 } else { 0.0 };
    let speed = |run: usize, k: usize| (run as f64 - 2.5) * (1.0 + 0.2 * (k as f64 * 0.02).sin());
    let given = |run: usize, k: usize| 0.3 * speed(run, k) + 0.02 * noise(run * SAMPLES + k) + wild(run, k);
    let extended = |run: usize, k: usize| 0.02 * noise(run * SAMPLES + k) + wild(run, k);
    let all = |value: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        (0..RUNS).flat_map(|run| (0..SAMPLES).map(move |k| (run, k))).map(|(run, k)| value(run, k)).collect()
    };
    let row = |run: usize| {
        let points = |of: &dyn Fn(usize, usize) -> f64| -> Vec<(f64, f64)> {
            (0..SAMPLES).map(|k| (k as f64 * 1e-3, of(run, k))).collect()
        };
        let series = |name: &str, style, hue, points| XySeries { name: name.into(), style, hue, points };
        let plot = XyPlot {
            title: name(run),
            x: Axis::new("time", "s"),
            y: Axis::new("torque", "N·m"),
            series: vec![
                series("measured", Style::Points, Hue::Measured, points(&given)),
                series("model", Style::Line, Hue::Given, points(&|_, _| 0.0)),
            ],
            bands: vec![Band { from: 0.1, to: 0.3, label: "fitted".into() }],
        };
        OpeningRow { cells: vec![name(run), format!("{run}.5")], plots: vec![plot] }
    };
    let header = ["run", "error"].map(str::to_owned).to_vec();
    let table = OpeningTable { header, rows: (0..RUNS).map(row).collect(), open: 1 };
    let over = |label: &str, shown, values| Covariate { axis: Axis::new(label, "rad/s"), values, shown };
    let linked = Linked {
        y: Axis::new("error", "N·m"),
        covariates: vec![
            over("speed", true, all(&speed)),
            over("time", true, all(&|_, k| k as f64)),
            over("run", false, all(&|run, _| run as f64)),
        ],
        series: vec![
            LinkedSeries { name: "given".into(), hue: Hue::Given, values: all(&given) },
            LinkedSeries { name: "extended".into(), hue: Hue::Extended, values: all(&extended) },
        ],
        groups: (0..RUNS).map(name).collect(),
        group: (0..RUNS).flat_map(|run| [run as u32; SAMPLES]).collect(),
    };
    let mut page = Page::new("Linked", "What is selected in one plot lights up in all.");
    page.sections.push(Section::new("Runs").with(Block::OpeningTable(table)));
    page.sections.push(Section::new("Samples").with(Block::Linked(Box::new(linked))));
    page
}

/// Repeatable noise between -1 and 1.
fn noise(k: usize) -> f64 {
    let hash =
        (k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (hash >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Angle (deg), and speed (deg/s), of a spool that steps to another angle every second.
fn reference(time_s: f64) -> (f64, f64) {
    let targets = [0.0, 17.0, 40.0, 5.0, 22.5, 22.82, 12.0];
    let target = |k: usize| targets.get(k % targets.len()).copied().unwrap_or(0.0);
    let (step, into_s) = (time_s as usize, time_s.fract());
    let (from, to) = (target(step), target(step + 1));
    let part = (into_s / 0.12).min(1.0);
    let shape = part - (TAU * part).sin() / TAU;
    let speed = if part < 1.0 { (to - from) / 0.12 * (1.0 - (TAU * part).cos()) } else { 0.0 };
    (from + (to - from) * shape, speed)
}

fn run(samples: usize) -> Result<RunData, ReportError> {
    let time: Vec<f64> = (0..samples).map(|k| k as f64 * 1e-3).collect();
    let end = samples as f64 * 1e-3;
    let peak = (samples as f64 * PEAK_AT) as usize;
    let fault_s = end * 0.9;
    let axis = TimeAxis::new(&time, 13, &[(fault_s - 2.0, fault_s + 1.0)])?;
    let live = |s: f64| if s < fault_s { reference(s) } else { (reference(fault_s).0, 0.0) };
    let moving = |s: f64| if s < fault_s { 1.0 } else { f64::NAN };
    let trace =
        |value: &dyn Fn(usize, f64) -> f64| axis.trace(time.iter().enumerate().map(|(k, &s)| value(k, s)));
    let error =
        |k: usize, s: f64| moving(s) * if k == peak { PEAK_MDEG } else { 2.0 * noise(k) + live(s).1 * 0.02 };
    let friction = |s: f64| live(s).1.clamp(-40.0, 40.0) / 40.0 * 1.5;
    let flow = |s: f64| 208.0 * (live(s).0 / 40.0).max(0.0);
    let panels = vec![
        Panel::new("Angle")
            .with_line("reference", "deg", trace(&|_, s| moving(s) * live(s).0)?, Line::Underlay)
            .with("angle", "deg", trace(&|k, s| live(s).0 - 2e-6 * noise(k) - 2e-5 * live(s).1)?),
        Panel::new("Following error").with("reference − angle", "mdeg", trace(&error)?),
        Panel::new("Torque")
            .with("friction, true", "N·m", trace(&|k, s| friction(s) + 0.02 * noise(k))?)
            .with("friction, estimated", "N·m", trace(&|_, s| moving(s) * friction(s - 0.004))?)
            .with_line("wanted", "N·m", trace(&|_, s| moving(s) * friction(s) * 1.4)?, Line::Dashed),
        Panel::new("Torque reserve").with("reserve", "N·m", trace(&|_, s| 6.0 - friction(s).abs() * 1.4)?),
        Panel::new("Pulse rate").with("pulse rate", "kHz", trace(&|_, s| live(s).1 / 0.0032 * 1e-3)?),
        Panel::new("Pressure and flow")
            .with("pressure drop", "bar", trace(&|k, s| 20.0 - flow(s) * 0.01 + 0.05 * noise(k + 7))?)
            .with("flow", "L/min", trace(&|_, s| flow(s))?),
        Panel::new("Wake-up latency")
            .with("plant-simulator", "µs", trace(&|k, _| latency(k))?)
            .with("trajectory-generator", "µs", trace(&|k, _| latency(k + 1))?)
            .with("step-controller", "µs", trace(&|k, _| latency(k + 2))?),
    ];
    Ok(RunData {
        title: format!("step sequence, {samples} samples"),
        headline: "Followed within 2.3 mdeg RMS until the feedback fell silent; then it stopped and holds."
            .into(),
        summary: summary(end),
        strips: strips(&time, fault_s),
        events: events(&markers(end, fault_s)),
        markers: markers(end, fault_s),
        panels,
        histograms: timing(samples),
        machine: [("kernel", "Linux 6.18.44"), ("cores", "2"), ("PREEMPT_RT", "no")].map(owned).to_vec(),
        texts: vec![(
            "Scenario".into(),
            "name = \"step sequence\"\nperiod = \"1ms\" # </script><b>\n".into(),
        )],
    })
}

fn events(markers: &[Marker]) -> Table {
    let row = |marker: &Marker| vec![format!("{:.3} s", marker.time_s), marker.label.clone()];
    Table { header: ["time", ""].map(str::to_owned).to_vec(), rows: markers.iter().map(row).collect() }
}

fn owned((name, value): (&str, &str)) -> (String, String) {
    (name.to_owned(), value.to_owned())
}

fn latency(k: usize) -> f64 {
    let late = noise(k * 13 + 5);
    if late > 0.999 { 400.0 + 300.0 * noise(k) } else { 12.0 + 5.0 * late * late }
}

fn summary(end: f64) -> Vec<(String, String)> {
    let duration = format!("{end:.3} s at 1 ms");
    let rows = [
        ("started", "2026-11-21 09:14:03 UTC"),
        ("duration", duration.as_str()),
        ("following error, RMS", "2.31 mdeg"),
        ("following error, peak", "123.456 mdeg"),
        ("torque reserve, least", "3.84 N·m"),
        ("pulse rate, peak", "225.0 kHz"),
        ("overruns", "0"),
        ("lost steps", "0"),
        ("ended by", "feedback silent"),
    ];
    rows.map(owned).to_vec()
}

fn strips(time: &[f64], fault_s: f64) -> Vec<Strip> {
    let state = |s: f64| {
        if s < 0.2 {
            0.0
        } else if s < fault_s {
            1.0
        } else if s < fault_s + 0.05 {
            2.0
        } else {
            3.0
        }
    };
    let limit = |s: f64| {
        f64::from(u8::from(s < fault_s && s.fract() > 0.03 && s.fract() < 0.09 && s as u64 % 3 == 2))
    };
    vec![
        Strip::from_codes("state", time, time.iter().map(|&s| state(s)), |code| {
            let states =
                [("disarmed", Level::Neutral), ("running", Level::Normal), ("quick stop", Level::Attention)];
            let (name, level) =
                *states.get(code as usize).unwrap_or(&("fault: feedback silent", Level::Fault));
            Some((name.to_owned(), level))
        }),
        Strip::from_codes("limit", time, time.iter().map(|&s| limit(s)), |code| {
            (code > 0).then(|| ("pulse rate".to_owned(), Level::Attention))
        }),
    ]
}

fn markers(end: f64, fault_s: f64) -> Vec<Marker> {
    let marker = |time_s, label: &str, level| Marker { time_s, label: label.to_owned(), level };
    let mut markers: Vec<Marker> =
        (1..6).map(|k| marker(end * f64::from(k) / 7.0, "set angle", Level::Neutral)).collect();
    markers.push(marker(fault_s, "feedback silent", Level::Fault));
    markers
}

fn timing(samples: usize) -> Vec<Histogram> {
    let distribution = |name: &str, shift: usize, scale: f64| {
        let mut bins: Vec<(f64, u64)> = (0..60).map(|k| (2f64.powf(f64::from(k) / 4.0), 0)).collect();
        for k in 0..samples.min(200_000) {
            let value = scale * latency(k + shift);
            if let Some(bin) = bins.iter_mut().find(|bin| value <= bin.0) {
                bin.1 += 1;
            }
        }
        Distribution { name: name.into(), lower_edge: 0.0, bins }
    };
    let histogram = |title: &str, scale: f64| Histogram {
        title: title.into(),
        x: Axis::log("time", "µs"),
        distributions: vec![
            distribution("plant-simulator", 0, scale),
            distribution("trajectory-generator", 1, scale * 0.7),
            distribution("step-controller", 2, scale * 1.3),
        ],
    };
    vec![histogram("Wake-up latency", 1.0), histogram("Time from wake-up to done", 0.4)]
}

/// Signals that break plots: none, one sample, constant, all missing, lone samples between gaps.
fn odd_signals() -> Result<Page, ReportError> {
    let time: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
    let axis = TimeAxis::new(&time, 5, &[])?;
    let every = |value: &dyn Fn(usize) -> f64| axis.trace((0..1000).map(value));
    let lone = |k: usize| if k.is_multiple_of(50) { noise(k) } else { f64::NAN };
    let panels = vec![
        Panel::new("Constant").with("temperature", "°C", every(&|_| 40.0)?),
        Panel::new("Constant but for rounding").with("pressure", "Pa", every(&|k| 2e6 + 1e-9 * noise(k))?),
        Panel::new("Zero").with("error", "deg", every(&|_| 0.0)?),
        Panel::new("Missing").with("flow", "L/min", every(&|_| f64::NAN)?),
        Panel::new("Lone samples").with("sometimes", "N·m", every(&lone)?),
        Panel::new("Tiny").with("leak", "m³/s", every(&|k| 1e-9 * noise(k))?),
    ];
    let one = TimeAxis::new(&[5.0], 1, &[])?;
    let single = TimePlots {
        panels: vec![Panel::new("One").with("a", "V", one.trace([3.0])?)],
        ..TimePlots::default()
    };
    let none = TimeAxis::new(&[], 1, &[])?;
    let empty = TimePlots {
        panels: vec![Panel::new("None").with("a", "V", none.trace([])?)],
        ..TimePlots::default()
    };
    let all = TimePlots { panels, ..TimePlots::default() };
    let hostile = "<script>console.error('escaped?')</script><img src=x onerror=alert(1)>";
    let mut page = Page::new(hostile, hostile);
    page.sections.push(Section::new(hostile).with(Block::Text(hostile.into())).with(Block::TimePlots(all)));
    page.sections.push(Section::new("One sample").with(Block::TimePlots(single)));
    page.sections.push(Section::new("No sample").with(Block::TimePlots(empty)));
    Ok(page)
}

fn x_over_y() -> Page {
    let points = |count: usize, point: &dyn Fn(f64) -> (f64, f64)| {
        (0..count).map(|k| point(k as f64 / count as f64)).collect::<Vec<_>>()
    };
    let series = |name: &str, style, points| XySeries { name: name.into(), style, hue: Hue::ByPlace, points };
    let stribeck = |w: f64| 1.5 + 1.5 * (-(w / 0.05f64).powi(2)).exp() + 2e-4 * w;
    let curve = points(200, &|x| (10f64.powf(6.0 * x - 4.0), stribeck(10f64.powf(6.0 * x - 4.0))));
    let hysteresis = points(1_000_000, &|x| {
        let swing = (TAU * 40.0 * x).sin() * (0.3 + 0.7 * x);
        (
            swing,
            1.5 * (swing * 3.0 + (TAU * 40.0 * x).cos().signum()).tanh() + 0.01 * noise((x * 1e6) as usize),
        )
    });
    let measured = points(40, &|x| {
        (10f64.powf(6.0 * x - 4.0), stribeck(10f64.powf(6.0 * x - 4.0)) + 0.1 * noise((x * 40.0) as usize))
    });
    let steady = XyPlot {
        title: "Steady friction over speed".into(),
        x: Axis::log("speed", "rad/s"),
        y: Axis::new("friction torque", "N·m"),
        series: vec![series("model", Style::Line, curve), series("measured", Style::Points, measured)],
        ..XyPlot::default()
    };
    let loops = XyPlot {
        title: "Hysteresis, a million points".into(),
        x: Axis::new("angle", "mdeg"),
        y: Axis::new("friction torque", "N·m"),
        series: vec![series("friction", Style::Line, hysteresis)],
        ..XyPlot::default()
    };
    let cell = |text: &str| text.to_owned();
    let table = Table {
        header: ["quantity", "value", "the paper's", "unit"].map(cell).to_vec(),
        rows: vec![
            ["Coulomb torque", "1.50 ± 0.02", "2", "N·m"].map(cell).to_vec(),
            ["Stribeck velocity", "0.05", "0.001", "rad/s"].map(cell).to_vec(),
        ],
    };
    let mut page = Page::new("y over x", "Friction as it depends on speed and angle.");
    let section = Section::new("Friction").with(Block::XyPlot(steady)).with(Block::XyPlot(loops));
    page.sections.push(section.with(Block::Table(table)));
    timing(50_000)
        .into_iter()
        .for_each(|h| page.sections.push(Section::new("Alone").with(Block::Histogram(h))));
    page
}
