//! Faults drawn at random, from a seed: the same on every machine.

use crate::fault::{Damage, Fault, Injection, MAX_AGE, Stream};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use signals::{Field, Kind, Rule, Source};

/// A source of random details.
#[derive(Debug, Clone)]
pub struct SplitSeed(Pcg64Mcg);

impl SplitSeed {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// A whole number from `low` up to, not including, `end`.
    pub fn whole(&mut self, low: u64, end: u64) -> u64 {
        self.0.random_range(low..end.max(low + 1))
    }

    /// A number from `low` to `high`.
    pub fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// One of several.
    pub fn one<T: Copy>(&mut self, of: &[T], otherwise: T) -> T {
        let index = self.whole(0, of.len() as u64) as usize;
        of.get(index).copied().unwrap_or(otherwise)
    }

    /// Different places of `count` bits among `length`.
    pub fn bits(&mut self, length: u16, count: u64) -> Vec<u16> {
        let mut bits = Vec::new();
        while (bits.len() as u64) < count.min(u64::from(length)) {
            let bit = self.whole(0, u64::from(length)) as u16;
            if !bits.contains(&bit) {
                bits.push(bit);
            }
        }
        bits
    }
}

/// A fault of the given name (one of the text form) with random details, from cycle `at` on. `None` for a name that
/// means nothing without a clock.
pub fn draw(name: &str, at: u64, seed: &mut SplitSeed) -> Option<Injection> {
    let process = seed.one(&[Source::Plant, Source::Trajectory, Source::Controller], Source::Controller);
    let stream = seed.one(Stream::ALL, Stream::Feedback);
    let few = seed.whole(1, 6);
    let single = |stream, damage, count| Fault::Message { stream, damage, count };
    let fault = match name {
        "drop" => single(stream, Damage::Drop, seed.one(&[1, 2, 3, 5, 10, u64::MAX], 1)),
        "duplicate" => single(stream, Damage::Duplicate, few),
        "delay" => single(stream, Damage::Delay, few),
        "replay" => single(stream, Damage::Replay { age: seed.whole(1, MAX_AGE + 1) }, few),
        "field" => single(stream, nonsense(stream, seed), seed.one(&[1, 1, 1, 3, u64::MAX], 1)),
        "flip-bits" => {
            let count = seed.whole(1, 9);
            single(stream, Damage::Flip { bits: seed.bits(stream.bits(), count) }, few)
        }
        "wrong-schema" => single(stream, Damage::WrongSchema, few),
        "wrong-generation" => single(stream, Damage::WrongGeneration, few),
        "wrong-source" => single(stream, Damage::WrongSource, few),
        "frozen-encoder" => single(Stream::Feedback, Damage::FrozenEncoder, u64::MAX),
        "encoder-jump" => {
            let by_rad = seed.real(0.4, 3.0) * seed.one(&[-1.0, 1.0], 1.0);
            single(Stream::Feedback, Damage::EncoderJump { by_rad }, u64::MAX)
        }
        "overrun" => Fault::Overrun { process, cycles: seed.one(&[1, 3, 10], 1) },
        "silence" => Fault::Silence { process },
        _ => return None,
    };
    Some(Injection { at, fault })
}

/// NaN, infinity, a denormal, or something beyond its rule, in any field.
fn nonsense(stream: Stream, seed: &mut SplitSeed) -> Damage {
    let fields = stream.fields();
    let index = seed.whole(0, fields.len() as u64) as usize;
    let bits = fields.get(index).map_or(0, |field| nonsense_bits(field, seed));
    Damage::Field { index, bits }
}

fn nonsense_bits(field: &Field, seed: &mut SplitSeed) -> u64 {
    let beyond = match field.rule {
        Rule::Within(low, high) => seed.one(&[low * 2.0 - 1.0, high * 2.0 + 1.0], f64::NAN),
        Rule::Any | Rule::Below(_) => f64::INFINITY,
    };
    match field.kind {
        Kind::F64 => {
            let edge = match field.rule {
                Rule::Within(low, high) => seed.one(&[low, high], 0.0),
                _ => f64::MAX,
            };
            seed.one(
                &[
                    f64::NAN,
                    f64::INFINITY,
                    f64::NEG_INFINITY,
                    f64::MIN_POSITIVE / 8.0,
                    -f64::MIN_POSITIVE / 1e3,
                    f64::MAX,
                    beyond,
                    edge,
                ],
                f64::NAN,
            )
            .to_bits()
        }
        Kind::I64 => seed.one(&[i64::MIN, i64::MAX, 1 << 53, -(1 << 53), -1], -1).cast_unsigned(),
        Kind::U64 => seed.one(&[u64::MAX, 1 << 63, 255, 1], u64::MAX),
    }
}
