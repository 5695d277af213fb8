//! What the fuzzer throws at stepvalve: each function takes any bytes at all, and may not panic.
#![forbid(unsafe_code)]

mod arbitrary_log;
mod bus;

use arbitrary_log::arbitrary_log;
pub use bus::bus_replies;
use config::{parse_drive, parse_effects, parse_model, parse_plan, parse_scenario};
use diagnosis::{OneAfterTheOther, Options, diagnose};
use log_data::{Log, Run};
use recording::read_record;
use signals::{
    Body, BusStatus, ControlStatus, ControllerSnapshot, Expectation, Feedback, LoopTiming, Message,
    OperatorCommand, PlantTruth, RecorderProgress, Reference, SetPoint, Source, StepCommand, check,
};
use std::io::Write;
use table_import::{Format, Header, Interleaved, Map, Selection, Separated, Separator, Skip, Table, collect};
use valve_model::Model;

/// A scenario, a model, a drive file or a file of effects: refused with places, or accepted.
pub fn configuration(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let errors = [
        parse_scenario(text, "fuzz.toml").err(),
        parse_model(text, "fuzz.toml").err(),
        parse_drive(text, "fuzz.toml").err(),
        parse_effects(text, "fuzz.toml").err(),
        parse_plan(text, "fuzz.toml").err(),
    ];
    for error in errors.into_iter().flatten() {
        assert!(error.to_string().contains("fuzz.toml"), "an error without a place: {error}");
    }
}

/// A message of any kind: what passes the check is finite and in its range, and survives its bytes.
pub fn message_check(bytes: &[u8]) {
    each::<Reference>(bytes, Source::Trajectory);
    each::<StepCommand>(bytes, Source::Controller);
    each::<ControlStatus>(bytes, Source::Controller);
    each::<ControllerSnapshot>(bytes, Source::Controller);
    each::<Feedback>(bytes, Source::Plant);
    each::<PlantTruth>(bytes, Source::Plant);
    each::<BusStatus>(bytes, Source::Plant);
    each::<LoopTiming>(bytes, Source::Plant);
    each::<SetPoint>(bytes, Source::Supervisor);
    each::<OperatorCommand>(bytes, Source::Supervisor);
    each::<RecorderProgress>(bytes, Source::Recorder);
}

fn each<B: Body>(bytes: &[u8], source: Source) {
    let length = Message::<B>::WORDS * 8;
    let mut padded = bytes.to_vec();
    padded.resize(length, 0);
    let Some(raw) = Message::<B>::from_bytes(&padded) else { return };
    let expected = Expectation { source, generation: raw.header.generation };
    // As it is, and as a sender that computes nonsense would seal it.
    let mut header = raw.header;
    (header.schema_hash, header.source) = (B::SCHEMA_HASH, source.code());
    for message in [raw, Message::seal(header, raw.body)] {
        if check(&message, &expected).is_err() {
            continue;
        }
        let mut again = Vec::new();
        message.append_bytes(&mut again);
        let back = Message::<B>::from_bytes(&again);
        assert!(back.is_some_and(|back| check(&back, &expected).is_ok()));
        let mut fields = B::FIELDS.iter();
        message.body.each_word(|word| {
            if fields.next().is_some_and(|field| field.kind == signals::Kind::F64) {
                assert!(f64::from_bits(word).is_finite(), "a number that is none passed the check");
            }
        });
    }
}

/// A record, whole, cut or damaged: whatever can be read is read, the rest is told.
pub fn record_recovery(bytes: &[u8]) {
    let Ok(mut file) = tempfile::NamedTempFile::new() else { return };
    if file.write_all(bytes).is_err() {
        return;
    }
    let mut count = 0_u64;
    if let Ok(report) = read_record(&[file.path()], |_| count += 1) {
        assert_eq!(report.recorded(), count);
    }
}

/// What `stepvalve import` reads: the first line is a map, the rest the table, read with every separator.
pub fn text_table(bytes: &[u8]) {
    let (map, table) = bytes.split_at(bytes.iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len()));
    let Ok(mut file) = tempfile::NamedTempFile::new() else { return };
    if file.write_all(table.get(1..).unwrap_or_default()).is_err() {
        return;
    }
    let maps: Vec<Map> = ["time=row*0.001", "angle=c1"].iter().filter_map(|text| text.parse().ok()).collect();
    let given = std::str::from_utf8(map).ok().and_then(|text| text.parse::<Map>().ok());
    let maps: Vec<Map> = maps.into_iter().chain(given).collect();
    for (separator, header, decimal_comma, skip) in [
        (Separator::Auto, Header::Auto, false, Skip::Lines(0)),
        (Separator::Auto, Header::Auto, false, Skip::Auto),
        (Separator::Space, Header::No, true, Skip::Lines(1)),
        (Separator::Semicolon, Header::Yes, true, Skip::Lines(0)),
    ] {
        let format = Format { separator, header, skip, decimal_comma, ..Format::default() };
        let Ok(mut table) = Separated::open(file.path(), &format) else { continue };
        if let (Ok(interleaved), Ok(mut lines)) = ("c1,c2,c3".parse(), Separated::open(file.path(), &format))
        {
            interleave(&interleaved, &mut lines);
        }
        let mut run = Run { name: "fuzz".to_owned(), ..Run::default() };
        let limits = Selection { numbers: 100_000, ..Selection::default() };
        if collect(&mut table, &maps, &limits, &mut run).is_ok() && maps.len() == 2 {
            let log = Log { runs: vec![run], ..Log::default() };
            // Accepted or refused; never with a time that stands still.
            if log.check().is_ok() {
                let times = log.runs.iter().flat_map(|run| run.time_s.windows(2));
                assert!(times.into_iter().all(|pair| pair.first() < pair.last()), "time stands still");
            }
        }
    }
}

/// Lines of one sample each: refused, or columns of one length.
fn interleave(interleaved: &Interleaved, lines: &mut Separated) {
    if let Ok(columns) = interleaved.sorted(lines, 100_000) {
        assert!(!columns.names().is_empty(), "columns without names");
    }
}

/// The diagnosis of a log made of any bytes: refused with the run's name, or done with numbers.
pub fn log_diagnosis(bytes: &[u8]) {
    let (log, model_text) = arbitrary_log(bytes);
    let model: Model = match parse_model(model_text, "fuzz.toml") {
        Ok(model) => model,
        Err(error) => panic!("the target's own model is refused: {error}"),
    };
    if log.check().is_err() {
        return;
    }
    let found = diagnose(&log, &model, &Options::default(), &OneAfterTheOther, &mut |_| ());
    if let Ok(found) = found {
        for residual in &found.diagnosis.residual {
            assert!(residual.rms.is_finite() && residual.noise >= 0.0, "a residual that is no number");
        }
        for cause in &found.diagnosis.causes {
            let numbers = cause.parameters.values().all(|parameter| parameter.value.is_finite());
            assert!(numbers, "{}: a parameter that is no number", cause.id);
        }
        assert!(found.extended.validate().is_ok(), "an extended model that is refused");
    }
}
