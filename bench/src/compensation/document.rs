//! The tables as text.

use super::campaign::{Findings, LEVELS, Spread};
use super::cases::{Case, Demand};
use super::cycle_time::CycleTime;
use super::response::FREQUENCIES_HZ;
use closed_loop::Outcome;
use std::fmt::Write;

/// Everything that was measured.
pub struct Measured {
    /// Cases that the motor can turn, with their findings.
    pub cases: Vec<(Case, Findings)>,
    /// Cases that it can't.
    pub stuck: Vec<(Case, Findings)>,
    /// The speed below which sliding is unstable, rad/s.
    pub stick_slip_rad_per_s: f64,
    /// Frequency responses with their headings.
    pub responses: Vec<(&'static str, Vec<f64>)>,
    /// Times of a control cycle with what was at work.
    pub cycle_times: Vec<(&'static str, CycleTime)>,
}

/// What compensation is held to, and what came of it.
struct Promise {
    what: &'static str,
    wanted: f64,
    worst: f64,
    case: String,
}

impl Measured {
    /// The document.
    pub fn text(&self) -> String {
        let mut text = String::new();
        self.head(&mut text);
        self.promises(&mut text);
        self.right_belief(&mut text);
        self.wrong_beliefs(&mut text);
        self.stuck(&mut text);
        self.frequency_response(&mut text);
        self.cycle_times(&mut text);
        text
    }

    fn head(&self, text: &mut String) {
        let speed = self.stick_slip_rad_per_s;
        _ = write!(
            text,
            "# What friction compensation is worth\n\n\
             Written by `target/release/bench compensation --file docs/compensation.md`: every scenario of \
             `rt-config/scenarios` and generated ones, in process, plant and controller with a model each. The error is \
             reference minus true angle, while running; a ratio says how many times lower its RMS is than without \
             compensation. Encoder: 131,072 counts a turn, 0.01 mrad of noise, one cycle from reading to command.\n\n\
             Stick-slip speed of `rig.toml`: {speed:.3} rad/s ({:.1} °/s). Above it sliding is stable on the motor's own \
             spring; below it the falling Stribeck curve makes it unstable (Routh's criterion on the linearised LuGre \
             law), and no feed-forward can change that.\n\n",
            speed.to_degrees()
        );
    }

    fn promises(&self, text: &mut String) {
        *text += "## What is promised\n\n| | wanted | worst | in | |\n|---|---|---|---|---|\n";
        for promise in self.promised() {
            let verdict = if promise.worst >= promise.wanted { "kept" } else { "**not kept**" };
            let Promise { what, wanted, worst, case } = promise;
            _ = writeln!(text, "| {what} | {wanted}× | {worst:.2}× | {case} | {verdict} |");
        }
        *text += "\nA sine of 10 Hz and 0.02 rad reverses friction every 50 ms; the observer needs some 5 ms to learn of \
                  a reversal that the belief got wrong, so a tenth of the time is lost there.\n\n";
    }

    fn promised(&self) -> Vec<Promise> {
        let right =
            |index: usize| move |_: &Case, f: &Findings| f.right.get(index).map_or(f64::NAN, |o| ratio(f, o));
        vec![
            self.promise(
                "right belief, no encoder: sine, steps, triangles above stick-slip",
                10.0,
                right(1),
                |d| d == Demand::BeliefAlone,
            ),
            self.promise("right belief, encoder: triangles below stick-slip", 5.0, right(4), |d| {
                d == Demand::BelowStickSlip
            }),
            self.promise(
                "encoder, ±30 % in T_c, T_s, σ2, ±50 % in σ0, ω_s: shipped scenarios and triangles",
                5.0,
                |_, f| f.thirty_percent[1].worst,
                |d| d != Demand::Encoder,
            ),
            self.promise(
                "the same, generated sines",
                5.0,
                |_, f| f.thirty_percent[1].worst,
                |d| d == Demand::Encoder,
            ),
            self.promise(
                "encoder, any parameter wrong by two: never worse",
                1.0,
                |_, f| f.factor_of_two[1].worst,
                |_| true,
            ),
        ]
    }

    fn promise(
        &self,
        what: &'static str,
        wanted: f64,
        ratio: impl Fn(&Case, &Findings) -> f64,
        concerns: impl Fn(Demand) -> bool,
    ) -> Promise {
        let concerned = self.cases.iter().filter(|(case, _)| concerns(case.demand));
        let worst = concerned
            .map(|(case, findings)| (ratio(case, findings), case.name.clone()))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (worst, case) = worst.unwrap_or((f64::NAN, String::new()));
        Promise { what, wanted, worst, case }
    }

    fn right_belief(&self, text: &mut String) {
        *text += "## The belief is right\n\nRMS / peak error in mrad, and the ratio.\n\n| scenario | none |";
        LEVELS.iter().for_each(|(name, _)| _ = write!(text, " {name} |"));
        *text += "\n|---|---|";
        *text += &"---|".repeat(LEVELS.len());
        *text += "\n";
        for (case, findings) in &self.cases {
            _ = write!(text, "| {} | {} |", case.name, errors(&findings.none));
            for outcome in &findings.right {
                _ = write!(text, " {}, **{:.1}×** |", errors(outcome), ratio(findings, outcome));
            }
            *text += "\n";
        }
        *text += "\n";
    }

    fn wrong_beliefs(&self, text: &mut String) {
        *text += "## The belief is wrong\n\nWorst and median ratio over all corners (full law; F: runs that ended in a \
                  fault). Without an encoder a belief that is too high by two may be worse than none.\n\n\
                  | scenario | ±30 %, ±50 %, no encoder | the same, encoder | factor of two, no encoder | the same, \
                  encoder | inertia or holding torque ±30 %, encoder |\n|---|---|---|---|---|---|\n";
        for (case, findings) in &self.cases {
            let [thirty, thirty_seen] = findings.thirty_percent.map(spread);
            let [two, two_seen] = findings.factor_of_two.map(spread);
            let shaft = spread(findings.wrong_shaft);
            _ = writeln!(text, "| {} | {thirty} | {thirty_seen} | {two} | {two_seen} | {shaft} |", case.name);
        }
        *text += "\n";
    }

    fn stuck(&self, text: &mut String) {
        if self.stuck.is_empty() {
            return;
        }
        *text += "## Where the motor can't turn the valve\n\nBreak-away or sliding takes more than the motor holds; no \
                  compensation helps. The controller says so: cycles limited by torque, steps lost.\n\n\
                  | scenario | none | full law, observer | cycles limited | tooth pitches off at the end | ended by |\n\
                  |---|---|---|---|---|---|\n";
        for (case, findings) in &self.stuck {
            let Some(seen) = findings.right.last() else { continue };
            let fault = seen.fault.map_or("", |fault| fault.name());
            _ = writeln!(
                text,
                "| {} | {} | {} | {} of {} | {} | {fault} |",
                case.name,
                errors(&findings.none),
                errors(seen),
                seen.limiting_cycles,
                seen.cycles,
                seen.lost_teeth
            );
        }
        *text += "\n";
    }

    fn frequency_response(&self, text: &mut String) {
        *text += "## Resonance of motor and load while turning\n\nAmplitude of the spool over that of a sine of 0.2 mrad, \
                  at 6 rad/s: on the command (as a disturbing torque would act), and on the reference.\n\n| Hz |";
        self.responses.iter().for_each(|(name, _)| _ = write!(text, " {name} |"));
        *text += "\n|---|";
        *text += &"---|".repeat(self.responses.len());
        *text += "\n";
        for (index, frequency) in FREQUENCIES_HZ.iter().enumerate() {
            _ = write!(text, "| {frequency} |");
            for (_, response) in &self.responses {
                _ = write!(text, " {:.2} |", response.get(index).copied().unwrap_or(f64::NAN));
            }
            *text += "\n";
        }
        *text += "\nActive damping needs an encoder and a period of 1 ms or less; at longer ones it is refused, and the \
                  observer is slowed down until it leaves the resonance alone. Shaping costs a delay of a quarter of the \
                  resonance's period, 2 ms, which counts as following error.\n\n";
    }

    fn cycle_times(&self, text: &mut String) {
        *text += "## Time of a control cycle\n\nOne by one over a million cycles of the sine, the clock's own \
                  reading included.\n\n| at work | median | 99.9 % | worst |\n|---|---|---|---|\n";
        for (name, time) in &self.cycle_times {
            let [median, most, worst] = [time.median_s, time.longest_but_one_in_a_thousand_s, time.worst_s]
                .map(|time_s| time_s * 1e6);
            _ = writeln!(text, "| {name} | {median:.2} µs | {most:.2} µs | {worst:.1} µs |");
        }
    }
}

fn ratio(findings: &Findings, outcome: &Outcome) -> f64 {
    findings.none.rms_rad / outcome.rms_rad
}

fn errors(outcome: &Outcome) -> String {
    let fault = outcome.fault.map_or(String::new(), |fault| format!(" ({fault})"));
    format!("{:.3} / {:.2}{fault}", outcome.rms_rad * 1e3, outcome.peak_rad * 1e3)
}

fn spread(spread: Spread) -> String {
    let faults =
        if spread.faults == 0 { String::new() } else { format!(", {} F of {}", spread.faults, spread.runs) };
    format!("{:.1}×, {:.1}×{faults}", spread.worst, spread.median)
}
