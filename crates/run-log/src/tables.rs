//! What a run file says beside its samples: texts, machine, timing, gaps and notes.

use crate::{h5, messages};
use hdf5::{Group, Result};
use recording::{KnownGap, RecordInfo, Report, Topic};

/// The root's attributes of a run file, beside those of every valve-log.
pub(crate) fn root(file: &Group, report: &Report) -> Result<()> {
    let info = &report.info;
    h5::put_text(file, "provenance", "recorded by stepvalve")?;
    h5::put_text(file, "angle_zero", "common")?;
    h5::put_text(file, "instance", &info.instance)?;
    h5::put_text(file, "mode", &info.mode)?;
    h5::put_text(file, "program_version", &info.program_version)?;
    h5::put_number(file, "period_ns", info.period_ns)?;
    h5::put_number(file, "period_s", info.period_ns as f64 / 1e9)?;
    h5::put_number(file, "messages_recorded", report.recorded())?;
    h5::put_number(file, "messages_missed", report.missed())?;
    h5::put_number(file, "messages_refused", report.refused.values().sum::<u64>())?;
    if let Some(microstep) = info.microstep_rad {
        h5::put_number(file, "microstep_rad", microstep)?;
    }
    match info.started_unix_ns {
        Some(started) => h5::put_number(file, "started_unix_ns", started),
        None => Ok(()),
    }
}

/// `/scenario/text`, `/truth/text`, `/belief/text` and `/machine`.
pub(crate) fn origin(file: &Group, info: &RecordInfo) -> Result<()> {
    let texts = &info.texts;
    for (name, text) in [("scenario", &texts.scenario), ("truth", &texts.truth), ("belief", &texts.belief)] {
        h5::put_text_dataset(&file.create_group(name)?, "text", text)?;
    }
    let machine = file.create_group("machine")?;
    info.machine.iter().try_for_each(|(name, fact)| h5::put_text(&machine, name, fact))
}

/// `/timing`: the processes' LoopTiming, the same datasets as in `/messages/loop_timing`.
pub(crate) fn timing(file: &Group, report: &Report) -> Result<()> {
    let timing = file.create_group("timing")?;
    for topic in [Topic::TrajectoryTiming, Topic::ControllerTiming, Topic::PlantTiming] {
        let recorded = report.tallies.iter().any(|((known, _), tally)| *known == topic && tally.recorded > 0);
        if let (true, Some((_, process))) = (recorded, topic.path().rsplit_once('/')) {
            let table = file.group(&format!("messages/{}", messages::path(topic)))?;
            timing.create_group(process)?;
            for name in table.member_names()? {
                let place = format!("/messages/{}/{name}", messages::path(topic));
                file.link_hard(&place, &format!("/timing/{process}/{name}"))?;
            }
        }
    }
    Ok(())
}

/// `/gaps`: messages that are missing, one row for each gap.
pub(crate) fn gaps(file: &Group, gaps: &[KnownGap]) -> Result<()> {
    let group = file.create_group("gaps")?;
    let column = |value: fn(&KnownGap) -> u64| gaps.iter().map(value).collect::<Vec<u64>>();
    h5::put_column(&group, "generation", "1", &column(|known| known.gap.generation))?;
    h5::put_column(&group, "first_missing", "1", &column(|known| known.gap.first_missing))?;
    h5::put_column(&group, "missed", "1", &column(|known| known.gap.missed))?;
    let topics: Vec<_> = gaps.iter().map(|known| known.gap.topic.path()).collect();
    h5::put_texts(&group, "topic", &topics)?;
    let origins: Vec<_> = gaps.iter().map(|known| known.origin.name()).collect();
    h5::put_texts(&group, "origin", &origins)
}

/// `/notes`: the recorder's notes, and what is wrong with the record's files. `/noted`: after which Feedback each was taken, -1 where that
/// is not known.
pub(crate) fn notes(file: &Group, report: &Report) -> Result<()> {
    let damage = report.segments.iter().zip(1..).flat_map(|(segment, number)| {
        segment.damage.iter().map(move |damage| (format!("segment {number}: {damage}"), None))
    });
    let notes = report.notes.iter().map(|note| (note.text.clone(), note.after));
    let (texts, after): (Vec<_>, Vec<_>) = notes.chain(damage).unzip();
    h5::put_texts(file, "notes", &texts.iter().map(String::as_str).collect::<Vec<_>>())?;
    let noted = file.create_group("noted")?;
    let column = |value: fn((u64, u64)) -> u64| -> Vec<i64> {
        let of = |after: &Option<_>| after.and_then(|after| i64::try_from(value(after)).ok()).unwrap_or(-1);
        after.iter().map(of).collect()
    };
    h5::put_column(&noted, "generation", "1", &column(|(generation, _)| generation))?;
    h5::put_column(&noted, "cycle", "1", &column(|(_, cycle)| cycle))?;
    Ok(())
}
