//! A question to its answer: the log's own faults, the diagnosis, what it is worth in the loop, what to run next.

use crate::best::diagnose_best;
use crate::experiment::{self, Asked, Experiment, Range, Valve};
use crate::headline::headline;
use crate::readings::{Reading, is_commanded, readings};
use crate::{closed_loop, extended, quality, unnamed};
use anyhow::Context;
use diagnosis::{Event, Found, Options, Workers};
use log_data::{Channel, Log};
use log_quality::Finding;
use valve_model::Model;

/// What is asked beside the log and the model.
pub struct Question<'a> {
    /// How the diagnosis goes about it.
    pub options: Options,
    /// The valve whose limits the next experiment keeps, for a log of a commanded one.
    pub valve: Option<Valve<'a>>,
    /// What the next experiment may do.
    pub within: &'a [Range],
    /// The longest that it may take, s.
    pub most_s: f64,
}

/// A log and a model, ready to be held against each other.
pub struct Case<'a> {
    model: &'a Model,
    readings: Vec<Reading>,
    /// What is wrong with the log itself.
    pub quality: Vec<Finding>,
}

impl<'a> Case<'a> {
    /// Inspects a log, cuts what can't be used of it, and decides how it is read.
    ///
    /// # Errors
    /// Where nothing of it can be used.
    pub fn new(log: Log, model: &'a Model) -> anyhow::Result<Self> {
        let quality = log_quality::inspect(&log, Some(model));
        let readings = readings(log_quality::without_wild(log), model)?;
        Ok(Self { model, readings, quality })
    }

    /// What the model predicts of this log.
    pub fn channel(&self) -> Channel {
        let angle = self.readings.first().is_some_and(|reading| is_commanded(&reading.log, self.model));
        if angle { Channel::Angle } else { Channel::Torque }
    }

    /// The answer.
    ///
    /// # Errors
    /// A log that can't be diagnosed; limits that leave no motion for an experiment.
    pub fn answer(
        self,
        question: &Question<'_>,
        workers: &dyn Workers,
        tell: &mut dyn FnMut(Event<'_>),
    ) -> anyhow::Result<Answer> {
        let best = diagnose_best(self.readings, self.model, &question.options, workers, tell)?;
        let (mut found, Reading { log, told, .. }) = best.context("no run is left")?;
        found.diagnosis.observations.extend(told.iter().cloned());
        tell(Event::Step("simulating the gain in the loop"));
        found.diagnosis.gain.closed_loop = closed_loop::gain(&found, self.model);
        tell(Event::Step("planning the next experiment"));
        let asked = Asked {
            log: &log,
            model: self.model,
            valve: question.valve.as_ref(),
            within: question.within,
            most_s: question.most_s,
        };
        let next = experiment::next(&found, &asked)?;
        if let Some(next) = &next {
            found.diagnosis.next_experiment = next.said.clone();
        }
        Ok(Answer { found, log, told, quality: self.quality, next })
    }
}

/// What was found, and what can be said of it.
pub struct Answer {
    /// The diagnosis, and the model that it came to.
    pub found: Found,
    /// The log as it was read.
    pub log: Log,
    /// What was done to it in reading.
    pub told: Vec<String>,
    /// What is wrong with the log itself.
    pub quality: Vec<Finding>,
    /// The experiment that would decide what is left open.
    pub next: Option<Experiment>,
}

impl Answer {
    /// The answer in a sentence or two.
    pub fn headline(&self) -> String {
        let own = headline(&self.found, &unnamed::sentence(&self.found));
        match quality::mistaken(&self.quality) {
            None => own,
            Some(warning) => format!("{warning} {own}"),
        }
    }

    /// diagnosis.json.
    ///
    /// # Errors
    /// A number that JSON has no form of, which none is.
    pub fn json(&self) -> anyhow::Result<String> {
        quality::json(&self.found.diagnosis, &self.quality)
    }

    /// model-extended.toml, which names the log and the model as these.
    pub fn extended(&self, given: &Model, log: &str, model: &str) -> String {
        extended::text(&self.found, given, log, model)
    }
}
