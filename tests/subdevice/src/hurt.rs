//! What a test can do to the device and its cable, and how it says so in a line of text.

use std::str::FromStr;
use thiserror::Error;

/// What befalls frames on their way back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Line {
    /// The frame never reaches the device.
    DropRequest,
    /// The device got it, the answer is lost.
    DropReply,
    /// The answer comes so much later, ns.
    Delay(u64),
    /// The answer comes twice.
    Duplicate,
    /// The answer comes behind the next one.
    Reorder,
    /// Half of the answer is missing.
    Truncate,
    /// Random bytes in place of the answer.
    Garbage,
    /// A frame of another protocol comes first.
    Foreign,
    /// The working counters come back as if no device had been there.
    WorkingCounter,
}

/// Something that goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hurt {
    /// So many frames, from the next on.
    Line(Line, u32),
    /// The cable is out for so long, ns.
    Cable(u64),
    /// The power is off for so long, ns.
    Power(u64),
    /// Falls back to SAFE-OP with this AL status code.
    AlFall(u16),
    /// A fault of the drive, with this code in 0x603F.
    DriveFault(u16),
    /// So many cycles without bit 12 of the status word.
    NoFollowing(u32),
    /// So many cycles with another mode in 0x6061.
    Mode(i8, u32),
    /// From now on it takes so many cycles from switched on to operation enabled.
    Enabling(u32),
    /// The clock leaps, ns.
    ClockJump(i64),
    /// The crystal runs differently, parts per billion.
    Drift(i64),
}

/// A line that says no hurt.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{found}`, expected one of: {EXPECTED}")]
pub struct HurtParseError {
    /// The line.
    pub found: String,
}

const EXPECTED: &str = "drop-request N | drop-reply N | delay NS N | duplicate N | reorder N | truncate N | garbage N | \
    foreign N | working-counter N | cable NS | power NS | al-fall CODE | drive-fault CODE | no-following CYCLES | \
    mode MODE CYCLES | enabling CYCLES | clock-jump NS | drift PPB";

impl FromStr for Hurt {
    type Err = HurtParseError;

    fn from_str(text: &str) -> Result<Self, HurtParseError> {
        parse(text).ok_or_else(|| HurtParseError { found: text.to_owned() })
    }
}

fn parse(text: &str) -> Option<Hurt> {
    let mut words = text.split_whitespace();
    let name = words.next()?;
    let numbers: Vec<i64> = words.map(number).collect::<Option<_>>()?;
    let line = |line: Line, count: i64| Some(Hurt::Line(line, count.try_into().ok()?));
    match (name, &*numbers) {
        ("drop-request", [n]) => line(Line::DropRequest, *n),
        ("drop-reply", [n]) => line(Line::DropReply, *n),
        ("delay", [ns, n]) => line(Line::Delay((*ns).try_into().ok()?), *n),
        ("duplicate", [n]) => line(Line::Duplicate, *n),
        ("reorder", [n]) => line(Line::Reorder, *n),
        ("truncate", [n]) => line(Line::Truncate, *n),
        ("garbage", [n]) => line(Line::Garbage, *n),
        ("foreign", [n]) => line(Line::Foreign, *n),
        ("working-counter", [n]) => line(Line::WorkingCounter, *n),
        ("cable", [ns]) => Some(Hurt::Cable((*ns).try_into().ok()?)),
        ("power", [ns]) => Some(Hurt::Power((*ns).try_into().ok()?)),
        ("al-fall", [code]) => Some(Hurt::AlFall((*code).try_into().ok()?)),
        ("drive-fault", [code]) => Some(Hurt::DriveFault((*code).try_into().ok()?)),
        ("no-following", [cycles]) => Some(Hurt::NoFollowing((*cycles).try_into().ok()?)),
        ("mode", [mode, cycles]) => Some(Hurt::Mode((*mode).try_into().ok()?, (*cycles).try_into().ok()?)),
        ("enabling", [cycles]) => Some(Hurt::Enabling((*cycles).try_into().ok()?)),
        ("clock-jump", [ns]) => Some(Hurt::ClockJump(*ns)),
        ("drift", [ppb]) => Some(Hurt::Drift(*ppb)),
        _ => None,
    }
}

fn number(word: &str) -> Option<i64> {
    match word.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => word.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_say_hurts() {
        assert_eq!("delay 2000000 3".parse(), Ok(Hurt::Line(Line::Delay(2_000_000), 3)));
        assert_eq!("al-fall 0x1b".parse(), Ok(Hurt::AlFall(0x1B)));
        assert_eq!("clock-jump -500".parse(), Ok(Hurt::ClockJump(-500)));
        for wrong in ["", "drop-reply", "drop-reply x", "drop-reply -1", "delay 1", "what 1"] {
            assert!(wrong.parse::<Hurt>().is_err(), "{wrong}");
        }
    }
}
