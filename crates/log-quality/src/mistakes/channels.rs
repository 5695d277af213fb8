//! Another channel in the place of the angle or the torque, in all runs or in some.

use super::{AGREES, Case, LITTLE_IN_COMMON, NEARER, agrees, of_run};
use crate::expected::{Sums, pooled};
use crate::finding::{Finding, Kind, Place, Severity, in_runs};
use crate::windows::{Source, windows};
use log_data::Channel;

/// Nothing in common: the correlation of what was measured with what the motion takes, and the part of that which is in it. A magnet's torque
/// over the angle that is several times the friction lowers the first, and not the second.
const NOTHING: f64 = 0.3;
const HARDLY_A_PART: f64 = 0.5;

impl Case<'_> {
    /// Runs that contradict the model where others agree with it, and agree once two channels are exchanged.
    pub(super) fn some_exchanged(&self, source: Source, given: &[Sums]) -> Option<Finding> {
        let runs = self.log.runs.len();
        let is_suspect = |run: &usize| {
            let given = of_run(given, *run);
            !given.tell() || given.distance() >= LITTLE_IN_COMMON
        };
        let suspects: Vec<usize> = (0..runs).filter(is_suspect).collect();
        if suspects.is_empty() || !(0..runs).any(|run| agrees(given, run)) {
            return None;
        }
        let mut best: Option<(Source, Vec<Sums>, Vec<usize>)> = None;
        for tried in self.other_sources(source).into_iter().filter(|of| !of.integrated) {
            let sums = self.expected.sums(&windows(self.log, tried), runs);
            // A run that says nothing as it is contradicts nothing. A slow drift in the angle's place goes one way, and any torque agrees
            // with that.
            let is_evidence =
                |run: usize| of_run(given, run).tell() || sums.get(run).is_some_and(|of| of.zero().is_some());
            let explained = |run: &usize| {
                let sums = of_run(&sums, *run);
                sums.tell() && sums.distance() <= 0.5 * AGREES && is_evidence(*run)
            };
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

    /// The channels that agree best with the model in the place of angle and torque, if they do agree, and are at least twice as near as those given.
    pub(super) fn exchange(&self, source: Source, given: &Sums) -> Option<(Source, Sums)> {
        let of = |tried: Source| {
            (tried, pooled(&self.expected.sums(&windows(self.log, tried), self.log.runs.len())))
        };
        let told = self.other_sources(source).into_iter().map(of).filter(|(_, sums)| sums.tell());
        let nearer = |sums: &Sums| !given.tell() || given.distance() >= NEARER * sums.distance();
        told.min_by(|(_, a), (_, b)| a.distance().total_cmp(&b.distance()))
            .filter(|(_, sums)| sums.distance() <= AGREES && nearer(sums))
    }

    /// Another channel in the place of the angle or the torque.
    pub(super) fn wrong_channels(&self, source: Source, given: &Sums) -> Option<Finding> {
        if let Some((tried, sums)) = self.exchange(source, given) {
            return Some(self.exchanged((source, tried), given, &sums, Vec::new()));
        }
        // An angle log's angle was held against its command before; lost steps and an eccentric encoder rule the lag.
        let nothing = given.correlation().abs() < NOTHING && given.factor() < HARDLY_A_PART;
        (self.torque && given.tell() && nothing).then(|| Finding {
            kind: Kind::WrongAngle,
            severity: Severity::Mistake,
            evidence: format!(
                "the torque has nothing to do with the motion that the angle says: their correlation in sliding is {:.2}, \
                 {:.2} times what it takes is in the torque, and the error of the model is {:.4} {}",
                given.correlation(),
                given.factor(),
                given.error(),
                self.unit()
            ),
            place: Place::of(&[Channel::Angle], Vec::new()),
            mend: "is the angle's column the right one, and is it of this record?".to_owned(),
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

    pub(super) fn exchanged(
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
}
