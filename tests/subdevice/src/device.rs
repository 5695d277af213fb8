//! A device: its controller chip, its objects, its drive and its valve, and what happens to them as time passes.

use crate::al::{AlState, code};
use crate::cia402::DriveState;
use crate::clock::Clock;
use crate::coe::SdoServer;
use crate::dictionary::Dictionary;
use crate::esc::{Esc, Event, layout};
use crate::frame::Request;
use crate::motion::Valve;
use crate::profile::Profile;
use crate::settings::Settings;
use crate::sii;

/// What happened at a SYNC0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyncRow {
    /// The test's time, ns.
    pub host_ns: u64,
    /// Where the command comes from in the cycle that begins, micro-steps.
    pub start: i64,
    /// Where it goes to.
    pub end: i64,
    /// Whether outputs came since the last one.
    pub fresh: bool,
    /// How long before SYNC0 they came, ns.
    pub age_ns: u64,
    /// The status word.
    pub status: u16,
    /// The control word.
    pub control: u16,
    /// AL status.
    pub al: u16,
}

/// A simulated drive on the bus.
#[derive(Debug)]
pub struct Device {
    pub(crate) settings: Settings,
    pub(crate) esc: Esc,
    pub(crate) objects: Dictionary,
    sdo: SdoServer,
    pub(crate) profile: Profile,
    valve: Valve,
    inputs: Vec<u8>,
    input_map: Vec<(u16, u8, u8)>,
    output_map: Vec<(u16, u8, u8)>,
    outputs_came_ns: Option<u64>,
    rows: Vec<SyncRow>,
}

impl Device {
    /// A device that gets power at `now_ns`.
    pub fn new(settings: Settings, valve: Valve, now_ns: u64) -> Self {
        let (profile, objects) = Profile::new(&settings, &valve);
        let bytes =
            |map: &[(u16, u8, u8)]| (map.iter().map(|(_, _, bits)| u16::from(*bits)).sum::<u16>()) / 8;
        let (inputs, outputs) = (bytes(&objects.mapped(0x1C13)), bytes(&objects.mapped(0x1C12)));
        let sii =
            if settings.empty_sii { Vec::new() } else { sii::image(&settings.identity, outputs, inputs) };
        let clock = Clock::new(now_ns, 1_000_000, settings.drift_ppb);
        Self {
            esc: Esc::new(sii, clock),
            objects,
            sdo: SdoServer::default(),
            profile,
            valve,
            inputs: Vec::with_capacity(64),
            input_map: Vec::new(),
            output_map: Vec::new(),
            outputs_came_ns: None,
            rows: Vec::new(),
            settings,
        }
    }

    /// The same device after its power went and came again at `now_ns`: the spool stays where it is, the rest is forgotten.
    pub(crate) fn power_cycled(&mut self, now_ns: u64) {
        let rows = std::mem::take(&mut self.rows);
        *self = Self { rows, ..Self::new(self.settings.clone(), self.valve.clone(), now_ns) };
    }

    /// Gives an object another value than it is made with, in the object's own width.
    pub fn preset(&mut self, index: u16, sub: u8, value: i64) {
        self.objects.set(index, sub, value);
    }

    /// Takes an object away.
    pub fn without(&mut self, index: u16, sub: u8) {
        self.objects.remove(index, sub);
    }

    /// Refuses every access to an object, with an abort code.
    pub fn refuse(&mut self, index: u16, sub: u8, abort_code: u32) {
        self.objects.refuse(index, sub, abort_code);
    }

    /// Accepts every write to an object, and keeps its value.
    pub fn keep(&mut self, index: u16, sub: u8) {
        self.objects.keep(index, sub);
    }

    /// Objects that a main device wrote: index, subindex.
    pub fn written(&self) -> &[(u16, u8)] {
        &self.sdo.written
    }

    /// All SYNC0 pulses so far, and forgets them.
    pub fn take_rows(&mut self) -> Vec<SyncRow> {
        std::mem::take(&mut self.rows)
    }

    /// The AL state.
    pub fn al_state(&self) -> AlState {
        self.esc.al.state
    }

    /// The drive's state; `None` for a terminal, which has none.
    pub fn drive_state(&self) -> Option<DriveState> {
        match &self.profile {
            Profile::Cia402(drive) => Some(drive.state),
            Profile::PulseTrain(_) => None,
        }
    }

    /// The spool's angle, rad.
    pub fn angle_rad(&self) -> f64 {
        self.valve.angle_rad()
    }

    /// When something happens next without a frame.
    pub(crate) fn next_event_ns(&self) -> Option<u64> {
        let in_op = self.esc.al.state == AlState::Op;
        let watchdog = self.esc.watchdog.deadline_ns().filter(|_| in_op).map(|deadline| deadline + 1);
        [self.esc.clock.next_sync0_host_ns(), watchdog].into_iter().flatten().min()
    }

    /// Lets everything happen that was due by `now_ns`, each at its time.
    pub(crate) fn advance(&mut self, now_ns: u64) {
        while let Some(at_ns) = self.next_event_ns().filter(|at| *at <= now_ns) {
            if self.esc.clock.take_sync0(at_ns).is_some() {
                self.sync(at_ns);
            } else {
                self.fall(AlState::SafeOp, code::WATCHDOG);
            }
        }
    }

    /// Falls back from OP by itself.
    pub(crate) fn fall(&mut self, state: AlState, code: u16) {
        self.esc.al.fall(state, code);
        self.profile.bus_lost(&mut self.objects);
    }

    fn sync(&mut self, now_ns: u64) {
        let period_s = f64::from(self.esc.clock.period_ns()) / 1e9;
        let (start, end) = self.profile.motion();
        self.valve.step(start, end, self.profile.energised(), period_s);
        let in_op = self.esc.al.state == AlState::Op;
        let came = self.outputs_came_ns.take();
        let fresh = in_op && came.is_some();
        if fresh {
            let length = self.output_map.iter().map(|(_, _, bits)| usize::from(*bits) / 8).sum();
            let outputs = self.esc.outputs(length).to_vec();
            self.objects.unpack(&self.output_map, &outputs);
        }
        self.profile.sync(&mut self.objects, &self.valve, &self.settings, fresh, period_s);
        let mut inputs = std::mem::take(&mut self.inputs);
        self.objects.pack(&self.input_map, &mut inputs);
        self.esc.set_inputs(&inputs);
        self.inputs = inputs;
        let (start, end) = self.profile.motion();
        self.rows.push(SyncRow {
            host_ns: now_ns,
            start,
            end,
            fresh,
            age_ns: came.map_or(0, |came| now_ns.saturating_sub(came)),
            status: self.objects.unsigned(0x6041, 0) as u16,
            control: self.objects.unsigned(0x6040, 0) as u16,
            al: self.esc.al.status(),
        });
    }

    /// A datagram passes: what the working counter grows by, and the position address as it leaves.
    pub(crate) fn datagram(&mut self, request: Request, data: &mut [u8], now_ns: u64) -> (u16, u16) {
        let Request { command, adp, ado } = request;
        let next = adp.wrapping_add(1);
        let mine = adp == self.esc.station();
        let (count, adp) = match command {
            1 => (self.access(adp == 0, true, false, ado, data, now_ns), next),
            2 => (self.access(adp == 0, false, true, ado, data, now_ns), next),
            3 => (self.access(adp == 0, true, true, ado, data, now_ns), next),
            4 => (self.access(mine, true, false, ado, data, now_ns), adp),
            5 => (self.access(mine, false, true, ado, data, now_ns), adp),
            6 => (self.access(mine, true, true, ado, data, now_ns), adp),
            7 => (self.broadcast(true, false, ado, data, now_ns), next),
            8 => (self.broadcast(false, true, ado, data, now_ns), next),
            9 => (self.broadcast(true, true, ado, data, now_ns), next),
            10 => (self.esc.logical(request.logical(), data, true, false, now_ns), adp),
            11 => (self.esc.logical(request.logical(), data, false, true, now_ns), adp),
            12 => (self.esc.logical(request.logical(), data, true, true, now_ns), adp),
            // The addressed one reads, all others write what was read.
            13 => (self.access(true, adp == 0, adp != 0, ado, data, now_ns), next),
            14 => (self.access(true, mine, !mine, ado, data, now_ns), adp),
            _ => (0, adp),
        };
        self.react(now_ns);
        (count, adp)
    }

    fn access(
        &mut self,
        addressed: bool,
        read: bool,
        write: bool,
        at: u16,
        data: &mut [u8],
        now_ns: u64,
    ) -> u16 {
        if !addressed {
            return 0;
        }
        let asked = data.to_vec();
        let has_read = read && self.esc.read(at, data, now_ns);
        let has_written = write && self.esc.write(at, &asked, now_ns);
        u16::from(has_read) + if read && write { 2 } else { 1 } * u16::from(has_written)
    }

    /// A broadcast read gathers what all devices answer.
    fn broadcast(&mut self, read: bool, write: bool, at: u16, data: &mut [u8], now_ns: u64) -> u16 {
        let before = data.to_vec();
        let count = self.access(true, read, write, at, data, now_ns);
        if read {
            data.iter_mut().zip(before).for_each(|(byte, before)| *byte |= before);
        }
        count
    }

    fn react(&mut self, now_ns: u64) {
        for event in self.esc.take_events() {
            match event {
                Event::AlRequest(control) => self.request_state(control, now_ns),
                Event::Mailbox => self.serve_mailbox(),
                Event::Outputs => self.outputs_came_ns = Some(now_ns),
            }
        }
    }

    fn serve_mailbox(&mut self) {
        let message = self.esc.take_mailbox();
        if self.esc.al.state == AlState::Init {
            return;
        }
        let room = usize::from(self.esc.sync_manager(1).length);
        if let Some(answer) = self.sdo.answer(&message, room, &mut self.objects, self.esc.al.state) {
            self.esc.answer_mailbox(&answer);
        }
    }

    fn request_state(&mut self, control: u16, now_ns: u64) {
        let before = self.esc.al.state;
        let mut al = self.esc.al;
        al.request(control, |wanted| self.may_enter(wanted, now_ns));
        self.esc.al = al;
        if before == AlState::Op && al.state < AlState::Op {
            self.profile.bus_lost(&mut self.objects);
        }
        if al.state < AlState::SafeOp {
            self.esc.watchdog.stop();
            self.esc.clock.deactivate();
        }
    }

    /// The code that a step up is refused with.
    fn may_enter(&mut self, wanted: AlState, now_ns: u64) -> Result<(), u16> {
        match wanted {
            AlState::Init => Ok(()),
            AlState::PreOp => {
                let good = |index: u16, start: u16| {
                    let manager = self.esc.sync_manager(index);
                    manager.enabled && manager.start == start && manager.length == layout::MAILBOX_SIZE
                };
                let both = good(0, layout::MAILBOX_OUT) && good(1, layout::MAILBOX_IN);
                both.then_some(()).ok_or(code::INVALID_MAILBOX)
            }
            AlState::SafeOp => self.may_enter_safe_op(),
            AlState::Op if !self.esc.watchdog.alive(now_ns) => Err(code::WATCHDOG),
            AlState::Op if !self.esc.clock.sync0_active() => Err(code::NO_SYNC),
            AlState::Op => Ok(()),
        }
    }

    fn may_enter_safe_op(&mut self) -> Result<(), u16> {
        self.output_map = self.objects.mapped(0x1C12);
        self.input_map = self.objects.mapped(0x1C13);
        let bytes = |map: &[(u16, u8, u8)]| map.iter().map(|(_, _, bits)| u16::from(*bits)).sum::<u16>() / 8;
        let (outputs, inputs) = (self.esc.sync_manager(2), self.esc.sync_manager(3));
        if !outputs.enabled || outputs.length != bytes(&self.output_map) {
            return Err(code::INVALID_OUTPUTS);
        }
        if !inputs.enabled || inputs.length != bytes(&self.input_map) {
            return Err(code::INVALID_INPUTS);
        }
        if self.objects.unsigned(0x1C32, 1) == 2 {
            let cycle = self.objects.unsigned(0x1C32, 2);
            if !self.esc.clock.sync0_active() {
                return Err(code::INVALID_DC_SYNC);
            }
            if u64::from(self.esc.clock.period_ns()) != cycle
                || cycle < u64::from(self.settings.minimum_cycle_ns)
            {
                return Err(code::INVALID_SYNC0_CYCLE);
            }
        }
        Ok(())
    }
}
