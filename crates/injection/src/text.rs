//! A fault as one line of text: its name, whom or what it befalls, and `key=value` pairs in any order.

use crate::draw::SplitSeed;
use crate::fault::{Damage, Fault, Injection, MAX_AGE, Stream};
use signals::{Field, Kind, Source};
use std::collections::BTreeMap;
use thiserror::Error;

/// A text that is no fault.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("fault {text:?}: {what} is {found:?}, expected {expected}")]
pub struct FaultTextError {
    /// The whole text.
    pub text: String,
    /// Which part of it.
    pub what: String,
    /// What stands there.
    pub found: String,
    /// What could.
    pub expected: String,
}

/// All names, in the order of the help.
const NAMES: &str = "drop, duplicate, delay, replay, field, flip-bits, wrong-schema, wrong-generation, wrong-source, \
                     frozen-encoder, encoder-jump, overrun, silence, kill, pause, hog, disk-stalled, disk-full";

struct Words<'a> {
    text: &'a str,
    target: Option<&'a str>,
    pairs: BTreeMap<&'a str, &'a str>,
    /// The keys that the fault was asked for.
    known: Vec<&'static str>,
}

impl<'a> Words<'a> {
    fn split(text: &'a str) -> Result<(&'a str, Self), FaultTextError> {
        let mut words = text.split_whitespace();
        let name = words.next().unwrap_or("");
        let mut this = Self { text, target: None, pairs: BTreeMap::new(), known: Vec::new() };
        for word in words {
            match word.split_once('=') {
                Some((key, value)) => _ = this.pairs.insert(key, value),
                None if this.target.is_none() => this.target = Some(word),
                None => return Err(this.error("a word", word, "one target, then key=value")),
            }
        }
        Ok((name, this))
    }

    fn error(&self, what: &str, found: &str, expected: impl Into<String>) -> FaultTextError {
        FaultTextError {
            text: self.text.to_owned(),
            what: what.to_owned(),
            found: found.to_owned(),
            expected: expected.into(),
        }
    }

    /// What stands behind a key; a fault takes each of its keys, present or not, so that others can be refused.
    fn take(&mut self, key: &'static str) -> Option<&'a str> {
        self.known.push(key);
        self.pairs.remove(key)
    }

    fn number(&mut self, key: &'static str, default: u64) -> Result<u64, FaultTextError> {
        let Some(value) = self.take(key) else { return Ok(default) };
        if value == "all" {
            return Ok(u64::MAX);
        }
        value.parse().map_err(|_| self.error(key, value, "a whole number"))
    }

    fn real(&mut self, key: &'static str, default: f64) -> Result<f64, FaultTextError> {
        let Some(value) = self.take(key) else { return Ok(default) };
        value.parse().map_err(|_| self.error(key, value, "a number"))
    }

    fn stream(&self) -> Result<Stream, FaultTextError> {
        let found = self.target.unwrap_or("");
        let known = || Stream::ALL.iter().copied();
        known().find(|stream| stream.name() == found).ok_or_else(|| {
            self.error("the message", found, known().map(Stream::name).collect::<Vec<_>>().join(", "))
        })
    }

    fn process(&self, known: &[Source]) -> Result<Source, FaultTextError> {
        let found = self.target.unwrap_or("");
        known.iter().copied().find(|source| source.name() == found).ok_or_else(|| {
            let names: Vec<_> = known.iter().map(|source| source.name()).collect();
            self.error("the process", found, names.join(", "))
        })
    }

    fn done(&self) -> Result<(), FaultTextError> {
        match self.pairs.keys().next() {
            Some(key) => Err(self.error("a key", key, format!("of this fault's {}", self.known.join(", ")))),
            None => Ok(()),
        }
    }
}

const LOOP: [Source; 3] = [Source::Plant, Source::Trajectory, Source::Controller];
const CHILDREN: [Source; 4] = [Source::Plant, Source::Trajectory, Source::Controller, Source::Recorder];
const ALL: [Source; 5] =
    [Source::Plant, Source::Trajectory, Source::Controller, Source::Recorder, Source::Supervisor];

impl Injection {
    /// Reads the text form.
    ///
    /// # Errors
    /// [`FaultTextError`] with the word that is wrong and what is expected in its place.
    pub fn parse(text: &str) -> Result<Self, FaultTextError> {
        let (name, mut words) = Words::split(text)?;
        let at = words.number("at", 0)?;
        let fault = fault(name, &mut words)?;
        words.done()?;
        Ok(Self { at, fault })
    }
}

fn fault(name: &str, words: &mut Words<'_>) -> Result<Fault, FaultTextError> {
    Ok(match name {
        "overrun" => Fault::Overrun { process: words.process(&LOOP)?, cycles: words.number("cycles", 3)? },
        "silence" => Fault::Silence { process: words.process(&LOOP)? },
        "kill" => Fault::Kill { process: words.process(&ALL)? },
        "pause" => Fault::Pause { process: words.process(&CHILDREN)?, ms: words.number("ms", 10)? },
        "hog" => Fault::Hog {
            core: usize::try_from(words.number("core", 1)?).unwrap_or(usize::MAX),
            ms: words.number("ms", 1000)?,
        },
        "disk-stalled" => Fault::DiskStalled { ms: words.number("ms", 10_000)? },
        "disk-full" => Fault::DiskFull,
        "frozen-encoder" => message(words, Stream::Feedback, Damage::FrozenEncoder, u64::MAX)?,
        "encoder-jump" => {
            let by_rad = words.real("by_rad", 0.1)?;
            message(words, Stream::Feedback, Damage::EncoderJump { by_rad }, u64::MAX)?
        }
        _ => {
            let stream = words.stream();
            let damage = damage(name, words)?;
            message(words, stream?, damage, 1)?
        }
    })
}

fn message(
    words: &mut Words<'_>,
    stream: Stream,
    damage: Damage,
    count: u64,
) -> Result<Fault, FaultTextError> {
    Ok(Fault::Message { stream, damage, count: words.number("count", count)? })
}

fn damage(name: &str, words: &mut Words<'_>) -> Result<Damage, FaultTextError> {
    Ok(match name {
        "drop" => Damage::Drop,
        "duplicate" => Damage::Duplicate,
        "delay" => Damage::Delay,
        "replay" => Damage::Replay { age: words.number("age", 1)?.clamp(1, MAX_AGE) },
        "wrong-schema" => Damage::WrongSchema,
        "wrong-generation" => Damage::WrongGeneration,
        "wrong-source" => Damage::WrongSource,
        "flip-bits" => {
            if let Some(places) = words.take("places") {
                let bits: Result<Vec<u16>, _> = places.split(':').map(str::parse).collect();
                let bits = bits.map_err(|_| words.error("places", places, "numbers of bits, like 3:17"))?;
                return Ok(Damage::Flip { bits });
            }
            let (bits, seed) = (words.number("bits", 1)?, words.number("seed", 1)?);
            if !(1..=64).contains(&bits) {
                return Err(words.error("bits", &bits.to_string(), "1 to 64"));
            }
            Damage::Flip { bits: SplitSeed::new(seed).bits(words.stream()?.bits(), bits) }
        }
        "field" => field(words)?,
        other => return Err(words.error("the name", other, NAMES)),
    })
}

fn field(words: &mut Words<'_>) -> Result<Damage, FaultTextError> {
    let stream = words.stream()?;
    let name = words.take("name").unwrap_or("");
    let value = words.take("value").unwrap_or("");
    let Some((index, field)) = stream.fields().iter().enumerate().find(|(_, field)| field.name == name)
    else {
        let names: Vec<_> = stream.fields().iter().map(|field| field.name).collect();
        return Err(words.error("name", name, names.join(", ")));
    };
    let bits = bits_of(field, value).ok_or_else(|| words.error("value", value, "a number of its kind"))?;
    Ok(Damage::Field { index, bits })
}

/// A value's bits in a field: numbers as people write them, `nan`, `inf`, and `0x…` for bits.
fn bits_of(field: &Field, value: &str) -> Option<u64> {
    if let Some(hex) = value.strip_prefix("0x") {
        return u64::from_str_radix(hex, 16).ok();
    }
    match field.kind {
        Kind::U64 => value.parse().ok(),
        Kind::I64 => value.parse().ok().map(i64::cast_unsigned),
        Kind::F64 => value.parse().ok().map(f64::to_bits),
    }
}

impl core::fmt::Display for Injection {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}", self.fault)?;
        if self.at > 0 { write!(f, " at={}", self.at) } else { Ok(()) }
    }
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Message { stream, damage, count } => {
                match damage {
                    Damage::FrozenEncoder | Damage::EncoderJump { .. } => write!(f, "{damage}")?,
                    _ => write_with_stream(f, *stream, damage)?,
                }
                match *count {
                    u64::MAX => f.write_str(" count=all"),
                    count => write!(f, " count={count}"),
                }
            }
            Self::Overrun { process, cycles } => write!(f, "overrun {process} cycles={cycles}"),
            Self::Silence { process } => write!(f, "silence {process}"),
            Self::Kill { process } => write!(f, "kill {process}"),
            Self::Pause { process, ms } => write!(f, "pause {process} ms={ms}"),
            Self::Hog { core, ms } => write!(f, "hog core={core} ms={ms}"),
            Self::DiskStalled { ms } => write!(f, "disk-stalled ms={ms}"),
            Self::DiskFull => f.write_str("disk-full"),
        }
    }
}

fn write_with_stream(f: &mut core::fmt::Formatter<'_>, stream: Stream, damage: &Damage) -> core::fmt::Result {
    let stream_name = stream.name();
    match damage {
        Damage::Replay { age } => write!(f, "replay {stream_name} age={age}"),
        Damage::Field { index, bits } => {
            let name = stream.fields().get(*index).map_or("?", |field| field.name);
            write!(f, "field {stream_name} name={name} value={bits:#x}")
        }
        Damage::Flip { bits } => {
            let places: Vec<_> = bits.iter().map(u16::to_string).collect();
            write!(f, "flip-bits {stream_name} places={}", places.join(":"))
        }
        other => write!(f, "{other} {stream_name}"),
    }
}

impl core::fmt::Display for Damage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Drop => f.write_str("drop"),
            Self::Duplicate => f.write_str("duplicate"),
            Self::Delay => f.write_str("delay"),
            Self::Replay { .. } => f.write_str("replay"),
            Self::Field { .. } => f.write_str("field"),
            Self::Flip { .. } => f.write_str("flip-bits"),
            Self::WrongSchema => f.write_str("wrong-schema"),
            Self::WrongGeneration => f.write_str("wrong-generation"),
            Self::WrongSource => f.write_str("wrong-source"),
            Self::FrozenEncoder => f.write_str("frozen-encoder"),
            Self::EncoderJump { by_rad } => write!(f, "encoder-jump by_rad={by_rad}"),
        }
    }
}
