//! A run in memory as run.h5 would hold it, for the diagnosis: the same channels, sample for sample.

use closed_loop::{CycleOutputs, InProcess, Parts};
use log_data::{Extra, Log, Run};
use signals::validity;

/// Runs a loop to its end in one thread: its log, as `stepvalve diagnose` has it of run.h5.
pub fn record(parts: &Parts) -> Log {
    let mut recorded = Recorded::new(parts.timeline.period_ns);
    let mut cycles = InProcess::new(parts);
    // `cycles.cycle()` would be the iterator's.
    while let Some(outputs) = InProcess::cycle(&mut cycles) {
        recorded.note(&outputs);
    }
    recorded.into_log()
}

/// Gathers a run's channels cycle by cycle.
#[derive(Debug, Default)]
pub(crate) struct Recorded {
    period_ns: u64,
    run: Run,
    encoder: Optional,
    true_angle_rad: Vec<f64>,
    command_rad: Vec<f64>,
    torque_nm: Vec<f64>,
    flow_m3_per_s: Vec<f64>,
    pressure_pa: Optional,
    temperature_c: Optional,
    energise: Vec<f64>,
    current_ratio: Vec<f64>,
}

/// A channel that is measured only while a flag says so.
#[derive(Debug, Default)]
struct Optional {
    values: Vec<f64>,
    any: bool,
}

impl Optional {
    fn note(&mut self, value: f64, is_valid: bool) {
        self.any |= is_valid;
        self.values.push(if is_valid { value } else { f64::NAN });
    }

    fn known(self) -> Option<Vec<f64>> {
        self.any.then_some(self.values)
    }
}

impl Recorded {
    pub(crate) fn new(period_ns: u64) -> Self {
        Self { period_ns, ..Self::default() }
    }

    /// Takes note of a cycle; one without a plant has no row.
    pub(crate) fn note(&mut self, outputs: &CycleOutputs) {
        let Some(plant) = &outputs.plant else { return };
        let (feedback, truth) = (&plant.feedback, &plant.truth);
        let valid = |flag: u64| feedback.validity & flag != 0;
        self.run.time_s.push((outputs.cycle * self.period_ns) as f64 / 1e9);
        self.encoder.note(feedback.angle_rad, valid(validity::ENCODER));
        self.pressure_pa.note(feedback.pressure_drop_pa, valid(validity::PRESSURE));
        self.temperature_c.note(feedback.oil_temperature_c, valid(validity::TEMPERATURE));
        self.true_angle_rad.push(truth.angle_rad);
        self.command_rad.push(truth.command_angle_rad);
        self.torque_nm.push(truth.load_torque_nm);
        self.flow_m3_per_s.push(truth.flow_m3_per_s);
        // StepCommand k was made in cycle k−1; none was for the first.
        let command = outputs.received;
        self.energise.push(command.map_or(f64::NAN, |command| command.energise as f64));
        self.current_ratio.push(command.map_or(f64::NAN, |command| command.current_ratio));
    }

    /// The log, as `stepvalve diagnose` has it of run.h5.
    pub(crate) fn into_log(self) -> Log {
        let extra =
            |name: &str, values: Vec<f64>| Extra { name: name.to_owned(), unit: "1".to_owned(), values };
        let mut run = Run {
            name: "closed-loop".to_owned(),
            kind: "closed-loop".to_owned(),
            angle_rad: self.encoder.known().unwrap_or(self.true_angle_rad),
            angle_command_rad: Some(self.command_rad),
            torque_nm: Some(self.torque_nm),
            flow_m3_per_s: Some(self.flow_m3_per_s),
            pressure_drop_pa: self.pressure_pa.known(),
            oil_temperature_c: self.temperature_c.known(),
            extra: vec![
                extra("command_energise", self.energise),
                extra("command_current_ratio", self.current_ratio),
            ],
            ..self.run
        };
        log_data::cut_to_energised(&mut run);
        run.extra = Vec::new();
        Log { runs: vec![run], ..Log::default() }
    }
}
