//! `/runs`: the messages of a record as tables, a row a cycle, made from `/messages` column by column.

use crate::columns::{columns, topics};
use crate::cycles::{CycleTable, Span, spans};
use crate::{h5, messages};
use hdf5::{Group, Result};
use log_data::Channel;
use recording::{RecordInfo, Topic};
use signals::{Field, validity};
use std::collections::BTreeMap;

/// Writes a run for each generation that sent Feedback, in their order; returns their spans.
pub(crate) fn write(file: &Group, info: &RecordInfo) -> Result<Vec<Span>> {
    let runs = file.create_group("runs")?;
    let spans = spans(file, info.period_ns)?;
    for (span, number) in spans.iter().zip(1..) {
        let name = if number == 1 { "closed-loop".to_owned() } else { format!("closed-loop-{number}") };
        let out = runs.create_group(&name)?;
        h5::put_text(&out, "kind", "closed-loop")?;
        h5::put_number(&out, "generation", span.generation)?;
        h5::put_number(&out, "first_cycle", span.first_cycle)?;
        let mut tables = BTreeMap::new();
        for topic in topics() {
            if let Some(table) = CycleTable::open(file, topic, span)? {
                tables.insert(topic, table);
            }
        }
        RunWriter { out, tables }.write(span, info)?;
    }
    Ok(spans)
}

struct RunWriter {
    out: Group,
    tables: BTreeMap<Topic, CycleTable>,
}

impl RunWriter {
    fn write(&self, span: &Span, info: &RecordInfo) -> Result<()> {
        self.put_channel(Channel::Time, &span.times_s(info.period_ns), "cycle")?;
        let angle = self.angle()?;
        self.angle_command(info)?;
        self.conditions()?;
        if let Some(torque) = self.field(Topic::PlantTruth, "load_torque_nm")? {
            self.put_channel(Channel::Torque, &torque, "truth")?;
        }
        if let Some(flow) = self.field(Topic::PlantTruth, "flow_m3_per_s")? {
            self.put_channel(Channel::Flow, &flow, "truth")?;
        }
        self.following_errors(&angle)?;
        for (column, topic) in columns() {
            if let Some(values) = self.field(topic, column.field)? {
                let field = topic.body_fields().iter().find(|field| field.name == column.field);
                let unit = field.map_or("1", |field: &Field| field.unit);
                let dataset = h5::put_column(&self.out, column.name, unit, &values)?;
                messages::explain(&dataset, topic, column.field)?;
            }
        }
        Ok(())
    }

    /// The encoder's angle where one is fitted, else the simulator's true one, else what the drive says.
    fn angle(&self) -> Result<Vec<f64>> {
        let measured = self.valid(Topic::Feedback, "angle_rad", validity::ENCODER)?;
        let (angle, source) = match (measured, self.field(Topic::PlantTruth, "angle_rad")?) {
            (Some(measured), _) => (measured, "encoder"),
            (None, Some(truth)) => (truth, "truth"),
            (None, None) => (self.field(Topic::Feedback, "angle_rad")?.unwrap_or_default(), "command"),
        };
        self.put_channel(Channel::Angle, &angle, source)?;
        Ok(angle)
    }

    /// The simulator's command angle, else the accepted micro-steps where the size of one is known.
    fn angle_command(&self, info: &RecordInfo) -> Result<()> {
        if let Some(truth) = self.field(Topic::PlantTruth, "command_angle_rad")? {
            return self.put_channel(Channel::AngleCommand, &truth, "truth");
        }
        match (self.field(Topic::Feedback, "accepted_microsteps")?, info.microstep_rad) {
            (Some(mut angle), Some(microstep_rad)) => {
                angle.iter_mut().for_each(|value| *value *= microstep_rad);
                self.put_channel(Channel::AngleCommand, &angle, "drive")
            }
            _ => Ok(()),
        }
    }

    /// Pressure drop and oil temperature, where they were measured at all.
    fn conditions(&self) -> Result<()> {
        let measured = [
            (Channel::PressureDrop, "pressure_drop_pa", validity::PRESSURE),
            (Channel::OilTemperature, "oil_temperature_c", validity::TEMPERATURE),
        ];
        for (channel, field, flag) in measured {
            if let Some(values) = self.valid(Topic::Feedback, field, flag)? {
                self.put_channel(channel, &values, "feedback")?;
            }
        }
        Ok(())
    }

    /// Reference less measured angle, and reference less true angle.
    fn following_errors(&self, angle: &[f64]) -> Result<()> {
        let Some(reference) = self.field(Topic::Reference, "angle_rad")? else { return Ok(()) };
        let less = |angle: &[f64]| reference.iter().zip(angle).map(|(r, a)| r - a).collect::<Vec<f64>>();
        h5::put_column(&self.out, "following_error", "rad", &less(angle))?;
        if let Some(truth) = self.field(Topic::PlantTruth, "angle_rad")? {
            h5::put_column(&self.out, "true_following_error", "rad", &less(&truth))?;
        }
        Ok(())
    }

    fn field(&self, topic: Topic, field: &str) -> Result<Option<Vec<f64>>> {
        self.tables.get(&topic).map(|table| table.column(field)).transpose()
    }

    /// A field with NaN where Feedback's flag says that it is not valid; `None` where it never is.
    fn valid(&self, topic: Topic, field: &str, flag: u64) -> Result<Option<Vec<f64>>> {
        let (Some(mut values), Some(flags)) =
            (self.field(topic, field)?, self.field(Topic::Feedback, "validity")?)
        else {
            return Ok(None);
        };
        let mut any = false;
        for (value, flags) in values.iter_mut().zip(flags) {
            // A missing sample's flags are NaN, which converts to no flag.
            if flags as u64 & flag == 0 {
                *value = f64::NAN;
            } else {
                any = true;
            }
        }
        Ok(any.then_some(values))
    }

    fn put_channel(&self, channel: Channel, values: &[f64], source: &str) -> Result<()> {
        let dataset = h5::put_column(&self.out, channel.name(), channel.unit(), values)?;
        h5::put_text(&dataset, "source", source)
    }
}
