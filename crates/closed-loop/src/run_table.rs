//! A run as a table, a row a cycle: the columns of run.h5, without a file.

use crate::CycleOutputs;
use signals::{
    Body, ControlStatus, Feedback, Field, PlantTruth, RUN_COLUMNS, Reference, StepCommand, validity,
};

/// A column of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSignal {
    /// Its name, as run.h5 has it.
    pub name: &'static str,
    /// Its unit; "1" for counts, codes and flags.
    pub unit: &'static str,
    /// A value a cycle, NaN where a message is missing. Counts and codes are rounded to `f64`.
    pub values: Vec<f64>,
}

/// Gathers a run's messages cycle by cycle.
#[derive(Debug)]
pub struct RunTable {
    period_ns: u64,
    cycles: Vec<u64>,
    reference: Messages,
    command: Messages,
    feedback: Messages,
    status: Messages,
    truth: Messages,
}

/// The messages of one topic: a column for each field.
#[derive(Debug)]
struct Messages {
    topic: &'static str,
    fields: &'static [Field],
    columns: Vec<Vec<f64>>,
}

impl Messages {
    /// Messages that are published so many cycles before their own: the first cycles have none.
    fn ahead<B: Body>(by: usize) -> Self {
        Self { topic: B::TOPIC, fields: B::FIELDS, columns: vec![vec![f64::NAN; by]; B::FIELDS.len()] }
    }

    fn note<B: Body>(&mut self, body: Option<&B>) {
        let Some(body) = body else {
            return self.columns.iter_mut().for_each(|column| column.push(f64::NAN));
        };
        let mut places = self.columns.iter_mut().zip(self.fields);
        body.each_word(|word| {
            if let Some((column, field)) = places.next() {
                column.push(field.kind.value(word));
            }
        });
    }

    fn column(&self, field: &str, rows: usize) -> Option<(&'static Field, &[f64])> {
        let (field, values) = self.fields.iter().zip(&self.columns).find(|(known, _)| known.name == field)?;
        Some((field, values.get(..rows)?))
    }
}

impl RunTable {
    /// Of a run with this period.
    pub fn new(period_ns: u64) -> Self {
        Self {
            period_ns,
            cycles: Vec::new(),
            reference: Messages::ahead::<Reference>(2),
            command: Messages::ahead::<StepCommand>(1),
            feedback: Messages::ahead::<Feedback>(0),
            status: Messages::ahead::<ControlStatus>(0),
            truth: Messages::ahead::<PlantTruth>(0),
        }
    }

    /// Takes note of a cycle; they follow one another from cycle 0.
    pub fn note(&mut self, outputs: &CycleOutputs) {
        self.cycles.push(outputs.cycle);
        self.reference.note(outputs.arrived.reference.as_ref());
        self.command.note(outputs.arrived.command.as_ref());
        self.feedback.note(outputs.arrived.feedback.as_ref());
        self.status.note(outputs.arrived.status.as_ref());
        self.truth.note(outputs.plant.as_ref().map(|plant| &plant.truth));
    }

    /// The columns, in run.h5's order: those that models know, following errors, every field of every message.
    pub fn columns(&self) -> Vec<RunSignal> {
        let time = |cycle: &u64| (cycle * self.period_ns) as f64 / 1e9;
        let angle = self.valid("angle_rad", validity::ENCODER).unwrap_or_else(|| self.of_truth("angle_rad"));
        let column =
            |name: &'static str, unit: &'static str, values: Vec<f64>| RunSignal { name, unit, values };
        let mut all = vec![
            column("time", "s", self.cycles.iter().map(time).collect()),
            column("angle", "rad", angle.clone()),
            column("angle_command", "rad", self.of_truth("command_angle_rad")),
        ];
        let conditions = [
            ("pressure_drop", "Pa", "pressure_drop_pa", validity::PRESSURE),
            ("oil_temperature", "degC", "oil_temperature_c", validity::TEMPERATURE),
        ];
        for (name, unit, field, flag) in conditions {
            all.extend(self.valid(field, flag).map(|values| column(name, unit, values)));
        }
        let reference = self.values(&self.reference, "angle_rad");
        let less = |angle: &[f64]| reference.iter().zip(angle).map(|(r, a)| r - a).collect();
        all.push(column("torque", "N*m", self.of_truth("load_torque_nm")));
        all.push(column("flow", "m^3/s", self.of_truth("flow_m3_per_s")));
        all.push(column("following_error", "rad", less(&angle)));
        all.push(column("true_following_error", "rad", less(&self.of_truth("angle_rad"))));
        let messages = [&self.reference, &self.command, &self.feedback, &self.status, &self.truth];
        for of in RUN_COLUMNS {
            let messages = messages.into_iter().find(|messages| messages.topic == of.topic);
            let found = messages.and_then(|messages| messages.column(of.field, self.cycles.len()));
            all.extend(found.map(|(field, values)| column(of.name, field.unit, values.to_vec())));
        }
        all
    }

    fn of_truth(&self, field: &str) -> Vec<f64> {
        self.values(&self.truth, field)
    }

    fn values(&self, messages: &Messages, field: &str) -> Vec<f64> {
        messages.column(field, self.cycles.len()).map_or_else(Vec::new, |(_, values)| values.to_vec())
    }

    /// A field of Feedback with NaN where its flag says that it is not valid; `None` where it never is.
    fn valid(&self, field: &str, flag: u64) -> Option<Vec<f64>> {
        let flags = self.values(&self.feedback, "validity");
        let is_valid = |flags: &f64| *flags as u64 & flag != 0;
        let values = self.values(&self.feedback, field);
        let masked =
            values.iter().zip(&flags).map(|(value, flags)| if is_valid(flags) { *value } else { f64::NAN });
        flags.iter().any(is_valid).then(|| masked.collect())
    }
}
