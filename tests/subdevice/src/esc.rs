//! The EtherCAT SubDevice controller's memory: registers, sync managers, FMMUs, and the mailboxes behind them (ETG.1000.4).

use crate::al::{Al, AlState};
use crate::clock::Clock;
use crate::watchdog::Watchdog;

/// Where this device's sync managers lie.
pub(crate) mod layout {
    pub(crate) const MAILBOX_OUT: u16 = 0x1000;
    pub(crate) const MAILBOX_IN: u16 = 0x1200;
    pub(crate) const MAILBOX_SIZE: u16 = 0x100;
    pub(crate) const OUTPUTS: u16 = 0x1400;
    pub(crate) const INPUTS: u16 = 0x1600;
}

/// Registers (ETG.1000.4, clause 6).
mod register {
    pub(super) const STATION_ADDRESS: u16 = 0x0010;
    pub(super) const AL_CONTROL: u16 = 0x0120;
    pub(super) const AL_STATUS: u16 = 0x0130;
    pub(super) const AL_CODE: u16 = 0x0134;
    pub(super) const WATCHDOG_DIVIDER: u16 = 0x0400;
    pub(super) const WATCHDOG_TIME: u16 = 0x0420;
    pub(super) const WATCHDOG_STATUS: u16 = 0x0440;
    pub(super) const SII_CONTROL: u16 = 0x0502;
    pub(super) const SII_ADDRESS: u16 = 0x0504;
    pub(super) const SII_DATA: u16 = 0x0508;
    pub(super) const FMMU: u16 = 0x0600;
    pub(super) const SYNC_MANAGER: u16 = 0x0800;
    pub(super) const RECEIVE_TIMES: u16 = 0x0900;
    pub(super) const SYSTEM_TIME: u16 = 0x0910;
    pub(super) const RECEIVE_TIME: u16 = 0x0918;
    pub(super) const SYSTEM_OFFSET: u16 = 0x0920;
    pub(super) const SYNC_ACTIVATION: u16 = 0x0981;
    pub(super) const SYNC_START: u16 = 0x0990;
    pub(super) const SYNC0_CYCLE: u16 = 0x09A0;
}

const MEMORY: usize = 0x2000;
const FMMUS: u16 = 4;
const SYNC_MANAGERS: u16 = 4;

/// A sync manager as it is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SyncManager {
    pub(crate) start: u16,
    pub(crate) length: u16,
    pub(crate) enabled: bool,
}

/// What a write set off, for the device to act upon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    /// A state was asked for.
    AlRequest(u16),
    /// A mailbox message is there.
    Mailbox,
    /// Outputs were written.
    Outputs,
}

/// Registers and process memory.
#[derive(Debug)]
pub(crate) struct Esc {
    memory: Box<[u8; MEMORY]>,
    sii: Vec<u8>,
    pub(crate) al: Al,
    pub(crate) clock: Clock,
    pub(crate) watchdog: Watchdog,
    mailbox_out_full: bool,
    mailbox_in_full: bool,
    events: Vec<Event>,
}

impl Esc {
    pub(crate) fn new(sii: Vec<u8>, clock: Clock) -> Self {
        let mut esc = Self {
            memory: Box::new([0; MEMORY]),
            sii,
            al: Al::new(),
            clock,
            watchdog: Watchdog::new(),
            mailbox_out_full: false,
            mailbox_in_full: false,
            events: Vec::with_capacity(8),
        };
        // Kind, revision, build; FMMUs, sync managers, RAM in kB, ports; features: 64-bit distributed clock.
        esc.put(0x0000, &[0x11, 0, 0, 0, FMMUS as u8, SYNC_MANAGERS as u8, 8, 0x0F, 0x0C, 0]);
        // Link on port 0; loop closed on the others.
        esc.put(0x0110, &0x5611_u16.to_le_bytes());
        esc
    }

    pub(crate) fn station(&self) -> u16 {
        self.word(register::STATION_ADDRESS)
    }

    /// Events since the last call.
    pub(crate) fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    pub(crate) fn get(&self, at: u16, length: usize) -> &[u8] {
        self.memory.get(usize::from(at)..usize::from(at) + length).unwrap_or(&[])
    }

    fn put(&mut self, at: u16, bytes: &[u8]) {
        let at = usize::from(at);
        if let Some(place) = self.memory.get_mut(at..at + bytes.len()) {
            place.copy_from_slice(bytes);
        }
    }

    fn word(&self, at: u16) -> u16 {
        self.get(at, 2).first_chunk::<2>().map_or(0, |bytes| u16::from_le_bytes(*bytes))
    }

    fn double(&self, at: u16) -> u32 {
        self.get(at, 4).first_chunk::<4>().map_or(0, |bytes| u32::from_le_bytes(*bytes))
    }

    fn quad(&self, at: u16) -> u64 {
        self.get(at, 8).first_chunk::<8>().map_or(0, |bytes| u64::from_le_bytes(*bytes))
    }

    pub(crate) fn sync_manager(&self, index: u16) -> SyncManager {
        let at = register::SYNC_MANAGER + 8 * index;
        SyncManager { start: self.word(at), length: self.word(at + 2), enabled: self.get(at + 6, 1) == [1] }
    }

    /// The outputs as they lie in sync manager 2.
    pub(crate) fn outputs(&self, length: usize) -> &[u8] {
        self.get(self.sync_manager(2).start, length)
    }

    /// Puts the inputs into sync manager 3.
    pub(crate) fn set_inputs(&mut self, inputs: &[u8]) {
        let manager = self.sync_manager(3);
        if manager.enabled {
            let length = inputs.len().min(usize::from(manager.length));
            self.put(manager.start, inputs.get(..length).unwrap_or(&[]));
        }
    }

    /// The mailbox message that the main device wrote.
    pub(crate) fn take_mailbox(&mut self) -> Vec<u8> {
        self.mailbox_out_full = false;
        let manager = self.sync_manager(0);
        self.get(manager.start, usize::from(manager.length)).to_vec()
    }

    /// Puts an answer where the main device reads it.
    pub(crate) fn answer_mailbox(&mut self, answer: &[u8]) {
        let manager = self.sync_manager(1);
        let mut message = answer.to_vec();
        message.resize(usize::from(manager.length), 0);
        self.put(manager.start, &message);
        self.mailbox_in_full = true;
    }

    /// A physical read; whether it counts.
    pub(crate) fn read(&mut self, at: u16, data: &mut [u8], now_ns: u64) -> bool {
        let end = usize::from(at) + data.len();
        if end > MEMORY {
            return false;
        }
        let mailbox = self.sync_manager(1);
        let in_mailbox = self.mailbox_in_full_or_unset(at, mailbox);
        if in_mailbox == Some(false) {
            return false;
        }
        self.refresh(now_ns);
        data.copy_from_slice(self.get(at, data.len()));
        if in_mailbox == Some(true) && end == usize::from(mailbox.start) + usize::from(mailbox.length) {
            self.mailbox_in_full = false;
        }
        true
    }

    /// Whether an address lies in the mailbox that the main device reads, and if so, whether there is something.
    fn mailbox_in_full_or_unset(&self, at: u16, mailbox: SyncManager) -> Option<bool> {
        let inside = mailbox.enabled && at >= mailbox.start && at - mailbox.start < mailbox.length;
        inside.then_some(self.mailbox_in_full)
    }

    /// A physical write; whether it counts.
    pub(crate) fn write(&mut self, at: u16, data: &[u8], now_ns: u64) -> bool {
        let end = usize::from(at) + data.len();
        if end > MEMORY || data.is_empty() {
            return false;
        }
        let mailbox = self.sync_manager(0);
        if mailbox.enabled && at >= mailbox.start && at - mailbox.start < mailbox.length {
            if self.mailbox_out_full {
                return false;
            }
            self.put(at, data);
            if end == usize::from(mailbox.start) + usize::from(mailbox.length) {
                self.mailbox_out_full = true;
                self.events.push(Event::Mailbox);
            }
            return true;
        }
        if at >= 0x1000 || !read_only(at) {
            self.put(at, data);
        }
        self.react(at, end, now_ns);
        true
    }

    /// What follows from a write to registers from `at` to before `end`.
    fn react(&mut self, at: u16, end: usize, now_ns: u64) {
        let touched = |register: u16| at <= register && end > usize::from(register);
        if touched(register::AL_CONTROL) {
            self.events.push(Event::AlRequest(self.word(register::AL_CONTROL)));
        }
        if touched(register::WATCHDOG_DIVIDER) {
            self.watchdog.divider = self.word(register::WATCHDOG_DIVIDER);
        }
        if touched(register::WATCHDOG_TIME) {
            self.watchdog.time = self.word(register::WATCHDOG_TIME);
        }
        if touched(register::SII_CONTROL) && self.word(register::SII_CONTROL) & 0x0100 != 0 {
            self.read_sii();
        }
        if touched(register::RECEIVE_TIMES) {
            let local = self.clock.local_ns(now_ns) as u64;
            self.put(register::RECEIVE_TIMES, &(local as u32).to_le_bytes());
            self.put(register::RECEIVE_TIME, &local.to_le_bytes());
        }
        if touched(register::SYSTEM_OFFSET) {
            self.clock.offset_ns = self.quad(register::SYSTEM_OFFSET).cast_signed();
        }
        if touched(register::SYNC_ACTIVATION) {
            let activation = self.get(register::SYNC_ACTIVATION, 1).first().copied().unwrap_or(0);
            if activation & 0x03 == 0x03 {
                let (start, period) = (self.quad(register::SYNC_START), self.double(register::SYNC0_CYCLE));
                self.clock.activate(now_ns, start, period);
            } else {
                self.clock.deactivate();
            }
        }
    }

    fn read_sii(&mut self) {
        let at = self.double(register::SII_ADDRESS) as usize * 2;
        let mut data = [0xFF_u8; 8];
        for (place, byte) in data.iter_mut().zip(self.sii.iter().skip(at)) {
            *place = *byte;
        }
        self.put(register::SII_DATA, &data);
        // Done; eight bytes a read; two address bytes.
        self.put(register::SII_CONTROL, &0x00C0_u16.to_le_bytes());
    }

    /// Brings registers that live to the present.
    fn refresh(&mut self, now_ns: u64) {
        self.put(register::AL_STATUS, &self.al.status().to_le_bytes());
        self.put(register::AL_CODE, &self.al.code.to_le_bytes());
        self.put(register::WATCHDOG_DIVIDER, &self.watchdog.divider.to_le_bytes());
        self.put(register::WATCHDOG_TIME, &self.watchdog.time.to_le_bytes());
        self.put(register::WATCHDOG_STATUS, &[u8::from(self.watchdog.alive(now_ns)), 0]);
        self.put(register::SYSTEM_TIME, &(self.clock.system_ns(now_ns) as u64).to_le_bytes());
        let full = |full: bool| [if full { 0x08 } else { 0 }];
        self.put(register::SYNC_MANAGER + 5, &full(self.mailbox_out_full));
        self.put(register::SYNC_MANAGER + 8 + 5, &full(self.mailbox_in_full));
    }

    /// A logical access through the FMMUs: what the working counter grows by.
    pub(crate) fn logical(
        &mut self,
        start: u32,
        data: &mut [u8],
        read: bool,
        write: bool,
        now_ns: u64,
    ) -> u16 {
        let (mut has_read, mut has_written) = (false, false);
        for index in 0..FMMUS {
            let at = register::FMMU + 16 * index;
            let (from, length) = (self.double(at), u32::from(self.word(at + 4)));
            let (physical, kind) = (self.word(at + 8), self.get(at + 11, 1).first().copied().unwrap_or(0));
            let active = self.get(at + 12, 1) == [1];
            let first = from.max(start);
            let last = (from + length).min(start.saturating_add(data.len() as u32));
            if !active || first >= last || self.al.state < AlState::SafeOp {
                continue;
            }
            let place = (first - start) as usize..(last - start) as usize;
            let Some(part) = data.get_mut(place) else { continue };
            let physical = physical + (first - from) as u16;
            if read && kind & 1 != 0 {
                part.copy_from_slice(self.get(physical, part.len()));
                has_read = true;
            } else if write && kind & 2 != 0 {
                self.put(physical, part);
                self.watchdog.feed(now_ns);
                self.events.push(Event::Outputs);
                has_written = true;
            }
        }
        match (read && write, has_read, has_written) {
            (true, has_read, has_written) => u16::from(has_read) + 2 * u16::from(has_written),
            (false, has_read, has_written) => u16::from(has_read || has_written),
        }
    }
}

/// Registers that a main device can't write.
fn read_only(at: u16) -> bool {
    at < 0x0010
        || (0x0110..0x0120).contains(&at)
        || (0x0130..0x0140).contains(&at)
        || (0x0910..0x0920).contains(&at)
}
