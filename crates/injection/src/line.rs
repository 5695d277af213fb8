//! A publisher's messages on their way out, with the faults that befall them.

use crate::fault::{Damage, Fault, Injection, MAX_AGE, Stream};
use signals::{Body, Expectation, Header, Message, Source, check};
use std::f64::consts::TAU;

/// One fault under way.
#[derive(Debug, Clone)]
struct Active {
    at: u64,
    damage: Damage,
    left: u64,
}

impl Active {
    fn is_due(&self, cycle: u64) -> bool {
        self.at <= cycle && self.left > 0
    }

    fn use_up(&mut self) {
        if self.left != u64::MAX {
            self.left = self.left.saturating_sub(1);
        }
    }
}

/// What a publisher's messages of one kind pass through.
#[derive(Debug, Clone)]
pub struct Line<B: Body> {
    faults: Vec<Active>,
    held: Option<Message<B>>,
    // The newest first.
    history: [Option<Message<B>>; MAX_AGE as usize],
    frozen: Option<B>,
    counts_per_turn: f64,
}

/// What comes out for one message that went in.
#[derive(Debug, Clone, Copy)]
pub struct Carried<B: Body> {
    /// The messages, in the order in which they go out.
    pub messages: [Option<Message<B>>; 3],
    /// Whether the one that went in arrives and passes the readers' check: where not, and there is no clock to tell by,
    /// its absence has to be said.
    pub arrives: bool,
}

impl<B: Body> Line<B> {
    /// A line without a fault, beside an encoder of so many counts per turn; `None` where none is fitted.
    pub fn new(counts_per_turn: Option<f64>) -> Self {
        Self {
            faults: Vec::new(),
            held: None,
            history: [None; MAX_AGE as usize],
            frozen: None,
            // Without an encoder there are no counts that a jump could show in.
            counts_per_turn: counts_per_turn.unwrap_or(0.0),
        }
    }

    /// Lets a fault befall this line, if it is one of this kind of message.
    pub fn add(&mut self, injection: &Injection) {
        if let Fault::Message { stream, damage, count } = &injection.fault
            && Stream::of::<B>() == Some(*stream)
        {
            self.faults.push(Active { at: injection.at, damage: damage.clone(), left: *count });
        }
    }

    /// What goes out in cycle `cycle` in the place of a sealed message.
    pub fn carry(&mut self, cycle: u64, message: Message<B>) -> Carried<B> {
        let late = self.held.take();
        let message = self.jumped(cycle, message);
        let damage = self.due(cycle);
        if damage.is_none() {
            self.frozen = None;
        }
        let mut carried = match &damage {
            None => Carried { messages: [Some(message), None, None], arrives: true },
            Some(Damage::Drop) => nothing(),
            Some(Damage::Delay) => {
                self.held = Some(message);
                nothing()
            }
            Some(Damage::Duplicate) => {
                Carried { messages: [Some(message), Some(message), None], arrives: true }
            }
            Some(Damage::Replay { age }) => {
                let old = usize::try_from(age.saturating_sub(1)).ok().and_then(|i| self.history.get(i));
                Carried { messages: [old.copied().flatten(), None, None], arrives: false }
            }
            Some(other) => {
                let frozen = *self.frozen.get_or_insert(message.body);
                changed(other, &message, &frozen)
            }
        };
        if let Some(place) = carried.messages.iter_mut().find(|place| place.is_none()) {
            *place = late;
        }
        self.history.rotate_right(1);
        if let Some(newest) = self.history.first_mut() {
            *newest = Some(message);
        }
        carried
    }

    /// The message of an encoder that has jumped: jumps add up, and stay beside whatever else befalls the message.
    fn jumped(&mut self, cycle: u64, message: Message<B>) -> Message<B> {
        let mut by_rad = None;
        for fault in self.faults.iter_mut().filter(|fault| fault.is_due(cycle)) {
            if let Damage::EncoderJump { by_rad: by } = fault.damage {
                by_rad = Some(by_rad.unwrap_or(0.0) + by);
                fault.use_up();
            }
        }
        let counts_per_turn = self.counts_per_turn;
        by_rad.map_or(message, |by| Message::seal(message.header, jumped(&message.body, by, counts_per_turn)))
    }

    /// The fault of this cycle, used up by one: of several, one after the other, and one without an end where there is no other.
    fn due(&mut self, cycle: u64) -> Option<Damage> {
        self.faults.retain(|fault| fault.left > 0);
        let is_jump = |fault: &Active| matches!(fault.damage, Damage::EncoderJump { .. });
        let due = self.faults.iter_mut().filter(|fault| fault.is_due(cycle) && !is_jump(fault));
        let fault = due.min_by_key(|fault| fault.left == u64::MAX)?;
        fault.use_up();
        Some(fault.damage.clone())
    }
}

fn nothing<B: Body>() -> Carried<B> {
    Carried { messages: [None; 3], arrives: false }
}

fn changed<B: Body>(damage: &Damage, message: &Message<B>, frozen: &B) -> Carried<B> {
    let header = message.header;
    let sealed = |header: Header, body: B| Message::seal(header, body);
    let new = match damage {
        Damage::Field { index, bits } => sealed(header, with_word(&message.body, *index, *bits)),
        Damage::Flip { bits } => flipped(message, bits),
        Damage::WrongSchema => {
            sealed(Header { schema_hash: header.schema_hash.rotate_left(1) | 1, ..header }, message.body)
        }
        Damage::WrongGeneration => {
            sealed(Header { generation: header.generation.wrapping_sub(1), ..header }, message.body)
        }
        Damage::WrongSource => {
            let other =
                if header.source == Source::Recorder.code() { Source::Plant } else { Source::Recorder };
            sealed(Header { source: other.code(), ..header }, message.body)
        }
        Damage::FrozenEncoder => sealed(header, frozen_encoder(&message.body, frozen)),
        _ => *message,
    };
    let source = Source::from_code(header.source).unwrap_or(Source::Supervisor);
    let arrives = check(&new, &Expectation { source, generation: header.generation }).is_ok();
    Carried { messages: [Some(new), None, None], arrives }
}

/// The body with field number `index` replaced.
fn with_word<B: Body>(body: &B, index: usize, bits: u64) -> B {
    changed_words(body, |place, word| if place == index { bits } else { word })
}

fn changed_words<B: Body>(body: &B, change: impl Fn(usize, u64) -> u64) -> B {
    let mut words = Vec::with_capacity(B::FIELDS.len());
    body.each_word(|word| words.push(change(words.len(), word)));
    B::from_words(words.into_iter())
}

fn flipped<B: Body>(message: &Message<B>, bits: &[u16]) -> Message<B> {
    let mut bytes = Vec::with_capacity(Message::<B>::WORDS * 8);
    message.append_bytes(&mut bytes);
    let length = bytes.len() * 8;
    for bit in bits {
        let bit = usize::from(*bit) % length;
        if let Some(byte) = bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    }
    Message::from_bytes(&bytes).unwrap_or(*message)
}

fn field<B: Body>(index: usize) -> &'static str {
    B::FIELDS.get(index).map_or("", |field| field.name)
}

/// The encoder's two fields as they were.
fn frozen_encoder<B: Body>(body: &B, frozen: &B) -> B {
    let mut old = Vec::with_capacity(B::FIELDS.len());
    frozen.each_word(|word| old.push(word));
    changed_words(body, |index, word| match field::<B>(index) {
        "encoder_counts" | "angle_rad" => old.get(index).copied().unwrap_or(word),
        _ => word,
    })
}

fn jumped<B: Body>(body: &B, by_rad: f64, counts_per_turn: f64) -> B {
    let by_counts = (by_rad / TAU * counts_per_turn).round() as i64;
    changed_words(body, |index, word| match field::<B>(index) {
        "encoder_counts" => word.cast_signed().wrapping_add(by_counts).cast_unsigned(),
        "angle_rad" => (f64::from_bits(word) + by_rad).to_bits(),
        _ => word,
    })
}
