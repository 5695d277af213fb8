//! Signs, units and channels, told by the model: what contradicts it as it stands and agrees once it is turned or scaled as
//! people mistake it.
//!
//! Distances are those of [`crate::expected::Sums::distance`]. A record contradicts from [`CONTRADICTS`] on, more than a factor
//! of three makes between what was measured and what was expected; it agrees below [`AGREES`], within a factor of two. So
//! what `diagnose` is for, friction that is somewhat else than the model's, makes no claim here.

mod channels;
mod command;
mod table;

use crate::expected::{Expected, Mended, Scale, Sums, pooled};
use crate::finding::{Finding, Kind, Place, Severity, in_runs};
use crate::scale::median;
use crate::windows::{Source, Window, windows};
use command::{against_command, noisier_command_rad};
use log_data::{Channel, Log, Run};
use table::{Mistake, OF_ANGLE, OF_TORQUE};
use valve_model::Model;

/// From here on a record contradicts the model.
const CONTRADICTS: f64 = 1.3;
/// Below this it agrees.
const AGREES: f64 = 0.65;
/// By so much a mended record must be nearer.
const NEARER: f64 = 2.0;
/// Friction sampled more slowly than this shows neither stick nor slip: milliseconds are likelier than such a record, s.
const SLOW_S: f64 = 0.1;
/// Of a torque that is sampled so slowly, milliseconds leave so many times less.
const LIKELIER: f64 = 1.3;
/// A record as near as this agrees as it is.
const NEAR: f64 = 0.06;
/// A run that a mistake is not in agrees so many times less once mended.
const WORSE: f64 = 1.5;
/// A mended lag is no worse up to this factor.
const SAME: f64 = 1.05;
/// From here on a record has little in common with the model: of equal sizes, a correlation of a half.
const LITTLE_IN_COMMON: f64 = 1.0;
/// Correlated with the direction of motion so much the other way, a torque drives instead of braking.
const OPPOSED: f64 = 0.6;
/// Two mistakes at once must leave so many times less than one.
const TWO_MISTAKES: f64 = 2.5;

pub(crate) fn inspect(log: &Log, model: Option<&Model>) -> Vec<Finding> {
    let torque = log.runs.iter().any(|run| run.torque_nm.is_some());
    let by_command = against_command(log, model);
    if !by_command.is_empty() {
        return by_command;
    }
    let mut found = intervals_differ(log);
    found.extend(case(log, model, torque).into_iter().flat_map(|(case, source)| case.inspect(source)));
    found
}

fn case<'a>(log: &'a Log, model: Option<&'a Model>, torque: bool) -> Option<(Case<'a>, Source)> {
    let expected = Expected::new(model, torque)?;
    let measured = if torque { Channel::Torque } else { Channel::AngleCommand };
    let source = Source { angle: Channel::Angle, measured, integrated: false, lag: !torque };
    let windows = windows(log, source);
    let noisier_command_rad = if torque { None } else { noisier_command_rad(log) };
    Some((Case { log, expected, windows, torque, noisier_command_rad }, source))
}

/// The channels whose unit the model can't tell: it agrees with the log as it is, and about as well with the unit that is mistaken for it.
/// Coulomb friction knows no speed.
pub(crate) fn untold(log: &Log, model: &Model) -> Vec<Channel> {
    let torque = log.runs.iter().any(|run| run.torque_nm.is_some());
    let Some((case, _)) = case(log, Some(model), torque) else { return Vec::new() };
    let as_well = |tried: &Tried<'_>| {
        let (given, mended) = (pooled(&tried.given), pooled(&tried.mended));
        let agrees = given.tell() && mended.tell() && given.distance() <= AGREES;
        agrees && mended.distance() <= NEARER * given.distance()
    };
    let tries = case.tries();
    let untold = tries.iter().filter(|tried| tried.count() == 1 && as_well(tried));
    let of_motion = untold.filter(|tried| matches!(tried.mistake.kind, Kind::AngleUnit | Kind::TimeUnit));
    let mut channels: Vec<Channel> = of_motion.flat_map(|tried| tried.mistake.channels).copied().collect();
    channels.sort_unstable_by_key(|channel| channel.name());
    channels.dedup();
    channels
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

/// A run's sums about its own zero; none of a run that no window is of.
fn of_run(sums: &[Sums], run: usize) -> Sums {
    sums.get(run).copied().unwrap_or_default().about_zero()
}

/// Whether a run agrees with the model.
fn agrees(sums: &[Sums], run: usize) -> bool {
    let sums = of_run(sums, run);
    sums.tell() && sums.distance() <= AGREES
}

/// A log held against what is expected of it.
struct Case<'a> {
    log: &'a Log,
    expected: Expected<'a>,
    windows: Vec<Window>,
    torque: bool,
    /// How much an angle log's command scatters, rad, if that is much more than the angle does in every run.
    noisier_command_rad: Option<f64>,
}

/// How a mistake, mended, would leave the record.
struct Tried<'a> {
    mistake: &'a Mistake,
    turned: bool,
    /// Each run as it is, over the samples that count once mended, too: other samples would be another comparison.
    given: Vec<Sums>,
    mended: Vec<Sums>,
}

impl Tried<'_> {
    /// How many mistakes it is at once.
    fn count(&self) -> i32 {
        self.mistake.count + i32::from(self.turned)
    }

    /// What it leaves, where one mistake is likelier than two.
    fn cost(&self) -> f64 {
        pooled(&self.mended).distance() * TWO_MISTAKES.powi(self.count() - 1)
    }
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
            if let Some(best) = claims.min_by(|a, b| a.cost().total_cmp(&b.cost())) {
                let exchange = if best.count() > 1 { self.exchange(source, &all) } else { None };
                return match exchange.filter(|(_, sums)| sums.distance() <= best.cost()) {
                    Some((tried, sums)) => vec![self.exchanged((source, tried), &all, &sums, Vec::new())],
                    None => vec![self.finding(best)],
                };
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
        let plain = before >= CONTRADICTS && after <= tried.mistake.agrees && before >= NEARER * after;
        match tried.mistake.kind {
            Kind::SwappedChannels => plain || (self.noisier_command_rad.is_some() && before > after),
            // A motor's lag hardly tells the speed; but what is sampled so slowly shows nothing of its motion.
            Kind::TimeUnit if !self.torque => self.interval_s() >= SLOW_S && after <= SAME * before,
            // A record so slow speaks for milliseconds by itself: the model has to agree that they are likelier, no more.
            Kind::TimeUnit => {
                let likelier = before >= LIKELIER * after && before >= NEAR && after <= AGREES;
                self.interval_s() >= SLOW_S && likelier
            }
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

    /// Runs that contradict the model where others agree with it, and agree once mended.
    fn some_runs(&self, tried: &[Tried<'_>], given: &[Sums]) -> Option<Finding> {
        let all = 0..self.log.runs.len();
        let contradicts = |run: &usize| {
            let given = of_run(given, *run);
            given.tell() && given.distance() >= CONTRADICTS
        };
        let contradicting = all.clone().filter(contradicts).count();
        if !all.clone().any(|run| agrees(given, run)) {
            return None;
        }
        let mut best: Option<(&Tried<'_>, Vec<usize>)> = None;
        for tried in tried.iter().filter(|tried| tried.count() == 1) {
            let explained = |run: &usize| {
                let (before, after) = (of_run(&tried.given, *run), of_run(&tried.mended, *run));
                before.tell()
                    && after.tell()
                    && before.distance() >= CONTRADICTS
                    && after.distance() <= 0.5 * tried.mistake.agrees
            };
            let runs: Vec<usize> = all.clone().filter(contradicts).filter(explained).collect();
            // Of many runs that contradict the model a few agree after almost any change.
            if 2 * runs.len() >= contradicting && runs.len() > best.as_ref().map_or(0, |(_, runs)| runs.len())
            {
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

    fn said(&self, tried: &Tried<'_>, runs: Vec<usize>, before: &Sums, after: &Sums) -> Finding {
        let names: Vec<String> =
            runs.iter().filter_map(|run| self.log.runs.get(*run)).map(|run| run.name.clone()).collect();
        let turned = if tried.turned { ", and its sign turned," } else { "" };
        let noise = self.noisier_command_rad.filter(|_| tried.mistake.kind == Kind::SwappedChannels);
        let scatters = noise.map_or(String::new(), |noise| {
            format!("; the command scatters by {noise:.1e} rad as an encoder does, the angle hardly, as if computed")
        });
        Finding {
            kind: if names.is_empty() { tried.mistake.kind } else { Kind::RunsDiffer },
            severity: Severity::Mistake,
            evidence: format!(
                "{}{turned} the error of the model falls from {:.4} to {:.4} {} {} (RMS in sliding){scatters}",
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
