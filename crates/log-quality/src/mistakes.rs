//! Signs, units and channels, told by the model: what contradicts it as it stands and agrees once it is turned or scaled as
//! people mistake it.
//!
//! Distances are those of [`crate::expected::Sums::distance`]. A record contradicts from [`CONTRADICTS`] on, more than a factor
//! of three makes between what was measured and what was expected; it agrees below [`AGREES`], within a factor of two. So
//! what `diagnose` is for, friction that is somewhat else than the model's, makes no claim here.

use crate::expected::{AS_IT_IS, Expected, Mended, Scale, Sums, pooled};
use crate::finding::{Finding, Kind, Place, Severity, in_runs};
use crate::scale::median;
use crate::windows::{Source, Window, windows};
use log_data::{Channel, Log, Run};
use std::f64::consts::{PI, TAU};
use valve_model::{Model, MotorParams};

/// From here on a record contradicts the model.
const CONTRADICTS: f64 = 1.3;
/// Below this it agrees.
const AGREES: f64 = 0.65;
/// By so much a mended record must be nearer.
const NEARER: f64 = 2.0;
/// A unit of time or angle that friction hardly feels is claimed where what is left falls to a quarter.
const FEELS: f64 = 0.12;
const FALLS: f64 = 4.0;
/// Friction sampled more slowly than this shows neither stick nor slip: milliseconds are likelier than such a record, s.
const SLOW_S: f64 = 0.1;
/// A run that a mistake is not in agrees so many times less once mended.
const WORSE: f64 = 1.5;
/// A mended lag is no worse up to this factor.
const SAME: f64 = 1.05;
/// From here on a record has little in common with the model: of equal sizes, a correlation of a half.
const LITTLE_IN_COMMON: f64 = 1.0;
/// Nothing in common: the correlation of what was measured with what the motion takes.
const NOTHING: f64 = 0.3;
/// Correlated with the direction of motion so much the other way, a torque drives instead of braking.
const OPPOSED: f64 = 0.6;
/// Two mistakes at once must leave so many times less than one.
const TWO_MISTAKES: f64 = 2.5;
/// Degrees in a radian.
const DEGREES: f64 = 180.0 / PI;
/// How well a ratio of angle and command tells a unit.
const RATIO: f64 = 1.2;

/// One way to mistake a record, and how to mend it.
struct Mistake {
    kind: Kind,
    channels: &'static [Channel],
    scale: Scale,
    says: &'static str,
    mend: &'static str,
    /// How many mistakes it is at once.
    count: i32,
}

const fn mistake(
    kind: Kind,
    channels: &'static [Channel],
    scale: Scale,
    says: &'static str,
    mend: &'static str,
) -> Mistake {
    Mistake { kind, channels, scale, says, mend, count: 1 }
}

/// Torque and angle as an instrument shows them, in units of its own both.
const fn with_degrees(torque: f64, says: &'static str, mend: &'static str) -> Mistake {
    Mistake {
        kind: Kind::TorqueUnit,
        channels: &[Channel::Torque, Channel::Angle],
        scale: Scale { measured: torque, angle: 1.0 / DEGREES, time: 1.0 },
        says,
        mend,
        count: 2,
    }
}

/// Those of a torque log.
const OF_TORQUE: &[Mistake] = &[
    mistake(
        Kind::TorqueSign,
        &[Channel::Torque, Channel::Angle],
        Scale { measured: -1.0, ..AS_IT_IS },
        "with the torque's sign turned",
        "is the torque, or the angle, wired the other way? Then --map torque='-(...)', or the same for angle",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e-2, ..AS_IT_IS },
        "with the torque divided by 100",
        "is it in N*cm? Then --map torque='.../100'",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e-3, ..AS_IT_IS },
        "with the torque divided by 1000",
        "is it in mN*m? Then --map torque='.../1000'",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e2, ..AS_IT_IS },
        "with the torque times 100",
        "was it divided by 100 once too often?",
    ),
    mistake(
        Kind::TorqueUnit,
        &[Channel::Torque],
        Scale { measured: 1e3, ..AS_IT_IS },
        "with the torque times 1000",
        "is it in kN*m, or was it divided by 1000 once too often?",
    ),
    DEGREE,
    TURN,
    MILLISECOND,
    with_degrees(
        1e-2,
        "with the torque divided by 100 and the angle by 57.3",
        "are they in N*cm and degrees? Then --map torque='.../100' --map angle='...*pi/180'",
    ),
    with_degrees(
        1e-3,
        "with the torque divided by 1000 and the angle by 57.3",
        "are they in mN*m and degrees? Then --map torque='.../1000' --map angle='...*pi/180'",
    ),
];

/// Those of an angle log.
const OF_ANGLE: &[Mistake] = &[
    mistake(
        Kind::SwappedChannels,
        &[Channel::Angle, Channel::AngleCommand],
        Scale { measured: -1.0, ..AS_IT_IS },
        "with angle and angle_command exchanged",
        "exchange the two columns",
    ),
    Mistake { scale: Scale { angle: 1.0 / DEGREES, measured: 1.0 / DEGREES, time: 1.0 }, ..DEGREE },
    Mistake { scale: Scale { angle: TAU, measured: TAU, time: 1.0 }, ..TURN },
    MILLISECOND,
];

const DEGREE: Mistake = mistake(
    Kind::AngleUnit,
    &[Channel::Angle],
    Scale { angle: 1.0 / DEGREES, ..AS_IT_IS },
    "with the angle divided by 57.3",
    "is it in degrees? Then --map angle='...*pi/180'",
);

const TURN: Mistake = mistake(
    Kind::AngleUnit,
    &[Channel::Angle],
    Scale { angle: TAU, ..AS_IT_IS },
    "with the angle times 6.28",
    "is it in turns? Then --map angle='...*2*pi'",
);

const MILLISECOND: Mistake = mistake(
    Kind::TimeUnit,
    &[Channel::Time],
    Scale { time: 1e-3, ..AS_IT_IS },
    "with the time divided by 1000",
    "is it in ms? Then --map time='.../1000'",
);

pub(crate) fn inspect(log: &Log, model: Option<&Model>) -> Vec<Finding> {
    let torque = log.runs.iter().any(|run| run.torque_nm.is_some());
    let by_command = against_command(log, model);
    if !by_command.is_empty() {
        return by_command;
    }
    let mut found = intervals_differ(log);
    let Some(expected) = Expected::new(model, torque) else { return found };
    let measured = if torque { Channel::Torque } else { Channel::AngleCommand };
    let source = Source { angle: Channel::Angle, measured, integrated: false, lag: !torque };
    let case = Case { log, expected, windows: windows(log, source), torque };
    found.extend(case.inspect(source));
    found
}

/// Runs whose clock is a thousand times as slow as the others'.
fn intervals_differ(log: &Log) -> Vec<Finding> {
    let interval = |run: &Run| (run.end_s() - run.start_s()) / run.len().saturating_sub(1).max(1) as f64;
    let usual = median(log.runs.iter().filter(|run| run.len() > 20).map(interval));
    let far =
        |run: &&Run| run.len() > 20 && (interval(run) / usual > 300.0 || interval(run) / usual < 1.0 / 300.0);
    let runs: Vec<&Run> = log.runs.iter().filter(far).collect();
    let Some(first) = runs.first() else { return Vec::new() };
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    vec![Finding {
        kind: Kind::RunsDiffer,
        severity: Severity::Mistake,
        evidence: format!(
            "the interval between samples is {:.4e} s {}, and {usual:.4e} s in most",
            interval(first),
            in_runs(&names, log.runs.len())
        ),
        place: Place::of(&[Channel::Time], names),
        mend: "are some in ms? Then import these with --map time='.../1000'".to_owned(),
    }]
}

/// What an angle is to its own command: the same but for a lag.
fn against_command(log: &Log, model: Option<&Model>) -> Vec<Finding> {
    let ratios: Vec<(&Run, f64, f64)> = log
        .runs
        .iter()
        .filter_map(|run| {
            let (ratio, correlation) = regression(run.channel(Channel::AngleCommand)?, &run.angle_rad)?;
            Some((run, ratio, correlation))
        })
        .collect();
    let most_lag_rad = model.and_then(|model| model.motor.as_ref()).map_or(0.0, most_lag_rad);
    let is = |ratio: f64, wanted: f64| ratio / wanted > 1.0 / RATIO && ratio / wanted < RATIO;
    let cases = [
        (
            Kind::AngleDirection,
            -1.0,
            "turns against its command",
            "is the encoder wired the other way? Then --map angle='-(...)'",
        ),
        (
            Kind::AngleUnit,
            DEGREES,
            "is 57.3 times its command",
            "is the angle in degrees, the command in radians? Then --map angle='...*pi/180'",
        ),
        (
            Kind::AngleUnit,
            1.0 / DEGREES,
            "is its command divided by 57.3",
            "is the command in degrees, the angle in radians? Then --map angle_command='...*pi/180'",
        ),
        (
            Kind::AngleUnit,
            1.0 / TAU,
            "is its command divided by 6.28",
            "is the angle in turns, the command in radians? Then --map angle='...*2*pi'",
        ),
        (
            Kind::AngleUnit,
            TAU,
            "is 6.28 times its command",
            "is the command in turns, the angle in radians? Then --map angle_command='...*2*pi'",
        ),
    ];
    for (kind, wanted, says, mend) in cases {
        let runs: Vec<String> = ratios
            .iter()
            .filter(|(_, ratio, correlation)| is(*ratio, wanted) && correlation.abs() > 0.9)
            .filter(|(run, ..)| lag_range_rad(run) > most_lag_rad)
            .map(|(run, ..)| run.name.clone())
            .collect();
        if runs.is_empty() || 10 * runs.len() < ratios.len() {
            continue;
        }
        let differ = ratios.iter().filter(|(_, ratio, _)| is(*ratio, 1.0)).count() > 0;
        return vec![Finding {
            kind: if differ { Kind::RunsDiffer } else { kind },
            severity: Severity::Mistake,
            evidence: format!("the angle {says} {}", in_runs(&runs, log.runs.len())),
            place: Place::of(&[Channel::Angle, Channel::AngleCommand], runs),
            mend: mend.to_owned(),
        }];
    }
    let strange: Vec<String> = ratios
        .iter()
        .filter(|(.., correlation)| correlation.abs() < 0.5)
        .map(|(run, ..)| run.name.clone())
        .collect();
    if ratios.is_empty() || 2 * strange.len() <= ratios.len() {
        return Vec::new();
    }
    vec![Finding {
        kind: Kind::WrongAngle,
        severity: Severity::Mistake,
        evidence: format!("the angle doesn't follow its command {}", in_runs(&strange, log.runs.len())),
        place: Place::of(&[Channel::Angle, Channel::AngleCommand], strange),
        mend: "is the angle's column the right one?".to_owned(),
    }]
}

/// How far a rotor's lag may range before it loses steps, rad: 90° electrical either way. Friction may hold it back by that in a short
/// motion.
fn most_lag_rad(motor: &MotorParams) -> f64 {
    PI / f64::from(motor.rotor_teeth)
}

/// From the least to the largest of command less angle, rad.
fn lag_range_rad(run: &Run) -> f64 {
    let command = run.channel(Channel::AngleCommand).unwrap_or_default();
    let lag = command.iter().zip(&run.angle_rad).map(|(command, angle)| command - angle);
    let (least, most) = lag
        .filter(|lag| lag.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), lag| (least.min(lag), most.max(lag)));
    most - least
}

/// Slope and correlation of a channel on another; `None` where one hardly varies or little is known.
fn regression(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let pairs = || x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite());
    let count = pairs().count() as f64;
    let (x_sum, y_sum) = pairs().fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (x_mean, y_mean) = (x_sum / count, y_sum / count);
    let (xx, yy, xy) = pairs().fold((0.0, 0.0, 0.0), |(xx, yy, xy), (x, y)| {
        let (x, y) = (x - x_mean, y - y_mean);
        (xx + x * x, yy + y * y, xy + x * y)
    });
    (count > 20.0 && xx > 0.0 && yy > 0.0).then(|| (xy / xx, xy / (xx * yy).sqrt()))
}

/// A log held against what is expected of it.
struct Case<'a> {
    log: &'a Log,
    expected: Expected<'a>,
    windows: Vec<Window>,
    torque: bool,
}

/// How a mistake, mended, would leave the record.
struct Tried<'a> {
    mistake: &'a Mistake,
    turned: bool,
    /// Each run as it is, over the samples that count once mended, too: other samples would be another comparison.
    given: Vec<Sums>,
    mended: Vec<Sums>,
}

impl Case<'_> {
    fn inspect(&self, source: Source) -> Vec<Finding> {
        let given = self.expected.sums(&self.windows, self.log.runs.len());
        let all = pooled(&given);
        if matches!(self.expected, Expected::Direction) {
            return self.direction(&all);
        }
        let tried = self.tries();
        if all.tell() {
            let claims = tried.iter().filter(|tried| self.claims(tried, &all));
            // One mistake is likelier than two.
            let cost = |tried: &Tried<'_>| {
                let more = tried.mistake.count - 1 + i32::from(tried.turned);
                pooled(&tried.mended).distance() * TWO_MISTAKES.powi(more)
            };
            if let Some(best) = claims.min_by(|a, b| cost(a).total_cmp(&cost(b))) {
                return vec![self.finding(best)];
            }
        }
        if let Some(found) = self.some_runs(&tried, &given).or_else(|| self.some_exchanged(source, &given)) {
            return vec![found];
        }
        // An angle that hardly moves, or has little in common with the torque, may be another channel.
        if !all.tell() || all.distance() >= LITTLE_IN_COMMON {
            return self.wrong_channels(source, &all).into_iter().collect();
        }
        Vec::new()
    }

    /// Each mistake alone, and a torque's with its sign turned beside.
    fn tries(&self) -> Vec<Tried<'static>> {
        let mistakes = if self.torque { OF_TORQUE } else { OF_ANGLE };
        let with = |mistake: &'static Mistake, turned: bool| {
            let sign = if turned { -1.0 } else { 1.0 };
            let scale = Scale { measured: sign * mistake.scale.measured, ..mistake.scale };
            let sums = self.expected.mended(&self.windows, self.log.runs.len(), scale);
            let (given, mended) = sums.into_iter().map(|Mended { given, mended }| (given, mended)).unzip();
            Tried { mistake, turned, given, mended }
        };
        let alone = mistakes.iter().map(|mistake| with(mistake, false));
        let turned = mistakes.iter().filter(|mistake| mistake.kind != Kind::TorqueSign && self.torque);
        alone.chain(turned.map(|mistake| with(mistake, true))).collect()
    }

    /// Whether a mistake explains what contradicts the model.
    fn claims(&self, tried: &Tried<'_>, all: &Sums) -> bool {
        let (given, mended) = (pooled(&tried.given), pooled(&tried.mended));
        if !(given.tell() && mended.tell()) {
            return false;
        }
        let (before, after) = (given.distance().min(all.distance()), mended.distance());
        let plain = before >= CONTRADICTS && after <= AGREES && before >= NEARER * after;
        match tried.mistake.kind {
            Kind::AngleUnit => plain || (before >= FEELS && before >= FALLS * after),
            // A motor's lag hardly tells the speed; but what is sampled so slowly shows nothing of its motion.
            Kind::TimeUnit if !self.torque => self.interval_s() >= SLOW_S && after <= SAME * before,
            // The intervals speak for it, too.
            Kind::TimeUnit => self.interval_s() >= SLOW_S && before >= FEELS && before >= NEARER * after,
            _ => plain,
        }
    }

    fn interval_s(&self) -> f64 {
        median(self.windows.iter().map(|window| window.interval_s))
    }

    fn unit(&self) -> &'static str {
        if self.torque { "N*m" } else { "rad" }
    }

    fn finding(&self, best: &Tried<'_>) -> Finding {
        let of = |sums: &[Sums], run: usize| {
            sums.get(run).filter(|sums| sums.tell()).map(|sums| sums.about_zero().distance())
        };
        // Runs that agree as they are, and would agree less, by half or more.
        let is_right = |run: &usize| {
            let (before, after) = (of(&best.given, *run), of(&best.mended, *run));
            before.zip(after).is_some_and(|(before, after)| before <= AGREES && after >= WORSE * before)
        };
        let others: Vec<usize> = (0..self.log.runs.len()).filter(is_right).collect();
        if others.is_empty() {
            return self.said(best, Vec::new(), &pooled(&best.given), &pooled(&best.mended));
        }
        let runs = (0..self.log.runs.len()).filter(|run| !others.contains(run)).collect();
        self.said(best, runs, &pooled(&best.given), &pooled(&best.mended))
    }

    /// Runs that contradict the model where others don't, and agree once mended.
    fn some_runs(&self, tried: &[Tried<'_>], given: &[Sums]) -> Option<Finding> {
        let mut best: Option<(&Tried<'_>, Vec<usize>)> = None;
        for tried in tried.iter().filter(|tried| tried.mistake.count == 1) {
            let explained = |run: &usize| {
                let of = |sums: &[Sums]| sums.get(*run).copied().unwrap_or_default();
                let (before, after) = (of(&tried.given), of(&tried.mended));
                before.tell()
                    && after.tell()
                    && of(given).about_zero().distance() >= CONTRADICTS
                    && before.about_zero().distance() >= CONTRADICTS
                    && after.about_zero().distance() <= 0.5 * AGREES
            };
            let runs: Vec<usize> = (0..self.log.runs.len()).filter(explained).collect();
            if runs.len() > best.as_ref().map_or(0, |(_, runs)| runs.len()) {
                best = Some((tried, runs));
            }
        }
        let (tried, runs) = best?;
        let of = |all: &[Sums]| {
            let chosen = runs.iter().filter_map(|run| all.get(*run)).copied();
            pooled(&chosen.collect::<Vec<_>>())
        };
        let (before, after) = (of(&tried.given), of(&tried.mended));
        Some(self.said(tried, runs, &before, &after))
    }

    /// Runs that contradict the model where others agree with it, and agree once two channels are exchanged.
    fn some_exchanged(&self, source: Source, given: &[Sums]) -> Option<Finding> {
        let runs = self.log.runs.len();
        let of = |sums: &[Sums], run: usize| sums.get(run).copied().unwrap_or_default().about_zero();
        let agrees = |run: usize| of(given, run).tell() && of(given, run).distance() <= AGREES;
        let suspects: Vec<usize> = (0..runs)
            .filter(|run| !of(given, *run).tell() || of(given, *run).distance() >= CONTRADICTS)
            .collect();
        if suspects.is_empty() || !(0..runs).any(agrees) {
            return None;
        }
        let mut best: Option<(Source, Vec<Sums>, Vec<usize>)> = None;
        for tried in self.other_sources(source).into_iter().filter(|of| !of.integrated) {
            let sums = self.expected.sums(&windows(self.log, tried), runs);
            let explained =
                |run: &usize| of(&sums, *run).tell() && of(&sums, *run).distance() <= 0.5 * AGREES;
            let explained: Vec<usize> = suspects.iter().copied().filter(explained).collect();
            if explained.len() > best.as_ref().map_or(0, |(.., runs)| runs.len()) {
                best = Some((tried, sums, explained));
            }
        }
        let (tried, sums, explained) = best?;
        let chosen = |all: &[Sums]| {
            pooled(&explained.iter().filter_map(|run| all.get(*run)).copied().collect::<Vec<_>>())
        };
        let names = explained.iter().filter_map(|run| self.log.runs.get(*run)).map(|run| run.name.clone());
        Some(self.exchanged((source, tried), &chosen(given), &chosen(&sums), names.collect()))
    }

    fn said(&self, tried: &Tried<'_>, runs: Vec<usize>, before: &Sums, after: &Sums) -> Finding {
        let names: Vec<String> =
            runs.iter().filter_map(|run| self.log.runs.get(*run)).map(|run| run.name.clone()).collect();
        let turned = if tried.turned { ", and its sign turned," } else { "" };
        Finding {
            kind: if names.is_empty() { tried.mistake.kind } else { Kind::RunsDiffer },
            severity: Severity::Mistake,
            evidence: format!(
                "{}{turned} the error of the model falls from {:.4} to {:.4} {} {} (RMS in sliding)",
                tried.mistake.says,
                before.error(),
                after.error(),
                self.unit(),
                in_runs(&names, self.log.runs.len()),
            ),
            place: Place::of(tried.mistake.channels, names),
            mend: tried.mistake.mend.to_owned(),
        }
    }

    /// Another channel in the place of the angle or the torque.
    fn wrong_channels(&self, source: Source, given: &Sums) -> Option<Finding> {
        let mut best: Option<(Source, Sums)> = None;
        for tried in self.other_sources(source) {
            let windows = windows(self.log, tried);
            let sums = pooled(&self.expected.sums(&windows, self.log.runs.len()));
            let nearer = best.is_none_or(|(_, known)| sums.distance() < known.distance());
            if sums.tell() && nearer {
                best = Some((tried, sums));
            }
        }
        let nearer = |sums: &Sums| !given.tell() || given.distance() >= NEARER * sums.distance();
        let explained = best.filter(|(_, sums)| sums.distance() <= AGREES && nearer(sums));
        if let Some((tried, sums)) = explained {
            return Some(self.exchanged((source, tried), given, &sums, Vec::new()));
        }
        // An angle log's angle was held against its command before; lost steps and an eccentric encoder rule the lag.
        let nothing = self.torque && given.tell() && given.correlation().abs() < NOTHING;
        nothing.then(|| Finding {
            kind: Kind::WrongAngle,
            severity: Severity::Mistake,
            evidence: format!(
                "the torque has nothing to do with the motion that the angle says: their correlation in sliding is {:.2}, and \
                 the error of the model {:.4} {}",
                given.correlation(),
                given.error(),
                self.unit()
            ),
            place: Place::of(&[Channel::Angle], Vec::new()),
            mend: "is the angle's column the right one, and of this record?".to_owned(),
        })
    }

    fn other_sources(&self, source: Source) -> Vec<Source> {
        let mut others = vec![Source { integrated: true, ..source }];
        if self.torque {
            others.push(Source { angle: Channel::Torque, measured: Channel::Angle, ..source });
            for other in
                [Channel::PressureDrop, Channel::OilTemperature, Channel::Flow, Channel::AngleCommand]
            {
                others.push(Source { angle: other, ..source });
                others.push(Source { measured: other, ..source });
            }
        }
        others
    }

    fn exchanged(
        &self,
        (source, tried): (Source, Source),
        before: &Sums,
        after: &Sums,
        runs: Vec<String>,
    ) -> Finding {
        let falls = format!("falls from {:.4} to {:.4} {}", before.error(), after.error(), self.unit());
        if tried.integrated {
            return Finding {
                kind: Kind::WrongAngle,
                severity: Severity::Mistake,
                evidence: format!("with the angle integrated over time the error of the model {falls}"),
                place: Place::of(&[Channel::Angle], Vec::new()),
                mend: "is its column a speed? Then --map angle='integral(...)'".to_owned(),
            };
        }
        let channels = if tried.angle == source.angle {
            [source.measured, tried.measured]
        } else {
            [source.angle, tried.angle]
        };
        let [one, other] = channels;
        Finding {
            kind: Kind::SwappedChannels,
            severity: Severity::Mistake,
            evidence: format!(
                "with {one} and {other} exchanged {} the error of the model {falls}",
                in_runs(&runs, self.log.runs.len())
            ),
            mend: if runs.is_empty() {
                "exchange the two columns".to_owned()
            } else {
                "exchange the two columns of these runs".to_owned()
            },
            place: Place::of(&channels, runs),
        }
    }

    /// Without a model: friction acts against the motion.
    fn direction(&self, all: &Sums) -> Vec<Finding> {
        if !all.tell() || all.correlation() > -OPPOSED {
            return Vec::new();
        }
        vec![Finding {
            kind: Kind::TorqueSign,
            severity: Severity::Mistake,
            evidence: format!(
                "the torque acts against friction: its correlation with the direction of motion is {:.2}",
                all.correlation()
            ),
            place: Place::of(&[Channel::Torque, Channel::Angle], Vec::new()),
            mend: "is the torque, or the angle, wired the other way? Then --map torque='-(...)', or the same for angle"
                .to_owned(),
        }]
    }
}
