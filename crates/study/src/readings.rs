//! How a log can be read: without what no model knows, and as a whole or in those runs alone that have every channel.

use anyhow::anyhow;
use log_data::{Channel, Log, Run};
use valve_model::{Condition, EffectId, Model};

/// Leaves out runs by name, rows in which the motor carried no current, and signals that models do not know.
///
/// # Errors
/// A name that is no run's; nothing left.
pub fn prepare(log: &mut Log, exclude: &[String]) -> anyhow::Result<()> {
    leave_out(log, exclude)?;
    for run in &mut log.runs {
        log_data::cut_to_energised(run);
        run.extra = Vec::new();
    }
    Ok(())
}

fn leave_out(log: &mut Log, exclude: &[String]) -> anyhow::Result<()> {
    if let Some(unknown) = exclude.iter().find(|wanted| log.run(wanted).is_none()) {
        let names: Vec<&str> = log.runs.iter().map(|run| run.name.as_str()).collect();
        return Err(anyhow!("--exclude: found no run {unknown}, expected one of {}", names.join(", ")));
    }
    log.runs.retain(|run| !exclude.contains(&run.name));
    if log.runs.is_empty() {
        return Err(anyhow!("--exclude: no run is left, expected one at least"));
    }
    Ok(())
}

/// A log as it can be diagnosed, with what was done to it in words.
#[derive(Debug, Clone)]
pub struct Reading {
    /// The log.
    pub log: Log,
    /// What was done to it.
    pub told: Vec<String>,
    /// Channels that some runs lack: the others are alone in it.
    pub cut_for: Vec<Channel>,
}

/// Whether the angle is predicted from its command.
pub(crate) fn is_commanded(log: &Log, model: &Model) -> bool {
    model.motor.is_some() && log.runs.iter().all(|run| run.angle_command_rad.is_some())
}

/// Cuts runs in which too many samples are missing to what is known of them, and leaves out those of which nothing is.
///
/// What depends on a channel can't be computed for a run without it. Where some runs lack one, the log is read in two ways: all runs
/// without the channel, and the runs that have it alone. The first is not among them where the model needs the channel, the second not
/// where the runs that have it hold less than half of the samples.
///
/// # Errors
/// Where nothing is left.
pub fn readings(mut log: Log, model: &Model) -> anyhow::Result<Vec<Reading>> {
    let commanded = is_commanded(&log, model);
    let needed = [Channel::Angle, if commanded { Channel::AngleCommand } else { Channel::Torque }];
    let useful = [Channel::PressureDrop, Channel::OilTemperature];
    let told: Vec<String> =
        log.runs.iter_mut().flat_map(|run| log_data::cut_to_known(run, &needed, &useful)).collect();
    log.runs.retain(|run| !run.is_empty());
    if let (true, Some(first)) = (log.runs.is_empty(), told.first()) {
        return Err(anyhow!("no run is left: {first}, expected four fifths of them in one run at least"));
    }
    let (mut all, mut cut) = (
        Reading { log: log.clone(), told: told.clone(), cut_for: Vec::new() },
        Reading { log, told, cut_for: Vec::new() },
    );
    let mut model_needs = false;
    for channel in useful {
        if let Some(told) = agree(&mut cut.log, channel) {
            if cut.log.runs.iter().any(|run| run.channel(channel).is_some()) {
                cut.cut_for.push(channel);
                model_needs |= model.effects.iter().any(|effect| needs(effect.id(), channel));
            }
            cut.told.push(told);
        }
        all.told.extend(do_without(&mut all.log, channel));
    }
    let same = cut.cut_for.is_empty();
    Ok(if same || model_needs { vec![cut] } else { vec![all, cut] })
}

/// Whether an effect depends on a channel.
pub(crate) fn needs(id: EffectId, channel: Channel) -> bool {
    match id.spec().needs {
        Some(Condition::PressureDrop) => channel == Channel::PressureDrop,
        Some(Condition::OilTemperature) => channel == Channel::OilTemperature,
        None => false,
    }
}

/// The runs without a channel, where others have it.
fn lacking(log: &Log, channel: Channel) -> Option<Vec<&Run>> {
    let without: Vec<&Run> = log.runs.iter().filter(|run| run.channel(channel).is_none()).collect();
    (!without.is_empty() && without.len() < log.runs.len()).then_some(without)
}

fn names(runs: &[&Run]) -> String {
    runs.iter().map(|run| run.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Makes all runs do without a channel that some lack.
fn do_without(log: &mut Log, channel: Channel) -> Option<String> {
    let without = lacking(log, channel)?;
    let (runs, of) = (without.len(), log.runs.len());
    let told = format!(
        "{channel} is not used: {runs} of {of} runs have none ({}); --exclude leaves them out instead",
        names(&without)
    );
    log.runs.iter_mut().for_each(|run| drop(run.take_channel(channel)));
    Some(told)
}

/// Makes all runs have a channel, or none. Leaves out the runs without it where they hold half of the samples at most; else does
/// without the channel.
fn agree(log: &mut Log, channel: Channel) -> Option<String> {
    let samples: usize = log.runs.iter().map(Run::len).sum();
    let without = lacking(log, channel)?;
    if 2 * without.iter().map(|run| run.len()).sum::<usize>() > samples {
        return do_without(log, channel);
    }
    let (runs, of, names) = (without.len(), log.runs.len(), names(&without));
    log.runs.retain(|run| run.channel(channel).is_some());
    Some(format!("{runs} of {of} runs are left out, since they have no {channel}: {names}"))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
mod tests {
    use super::*;
    use valve_model::{Effect, EffectValue};

    /// Runs of these lengths, those marked with a pressure.
    fn log(runs: &[(usize, bool)]) -> Log {
        let run = |(index, (rows, pressure)): (usize, &(usize, bool))| Run {
            name: index.to_string(),
            time_s: vec![0.0; *rows],
            angle_rad: vec![0.0; *rows],
            torque_nm: Some(vec![0.0; *rows]),
            pressure_drop_pa: pressure.then(|| vec![0.0; *rows]),
            ..Run::default()
        };
        Log { runs: runs.iter().enumerate().map(run).collect(), ..Log::default() }
    }

    #[test]
    fn runs_without_a_channel_of_the_others() {
        // Runs of these lengths, with a pressure or without; runs of each reading, and those of them with a pressure.
        type Case<'a> = (&'a [(usize, bool)], &'a [(usize, usize)]);
        let table: [Case; 5] = [
            (&[(100, true), (100, true)], &[(2, 2)]),
            (&[(100, false), (100, false)], &[(2, 0)]),
            (&[(100, true), (100, false)], &[(2, 0), (1, 1)]),
            (&[(100, true), (110, false)], &[(2, 0)]),
            (&[(200, true), (50, false), (50, false), (50, true)], &[(4, 0), (2, 2)]),
        ];
        let having = |log: &Log| log.runs.iter().filter(|run| run.pressure_drop_pa.is_some()).count();
        let plain = Model { motor: None, ..Model::bench_rig() };
        let pressed = Effect::new(EffectId::PressureTorque, &[("gain", EffectValue::Number(0.1))]).unwrap();
        let of_pressure = Model { effects: vec![pressed], ..plain.clone() };
        for (runs, expected) in table {
            let read = readings(log(runs), &plain).unwrap();
            let found: Vec<(usize, usize)> =
                read.iter().map(|of| (of.log.runs.len(), having(&of.log))).collect();
            assert_eq!(found, expected, "{runs:?}");
            assert!(read.iter().all(
                |of| of.told.is_empty() == (runs.len() == having(&log(runs)) || having(&log(runs)) == 0)
            ));
            // A model that needs the pressure is held against runs that have it.
            let read = readings(log(runs), &of_pressure).unwrap();
            assert_eq!((read.len(), having(&read[0].log)), (1, expected[expected.len() - 1].1), "{runs:?}");
        }
    }
}
