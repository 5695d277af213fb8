//! The devices on a cable, and the cable: frames go through all of them and come back, unless a test hurts the line.

use crate::al::AlState;
use crate::device::Device;
use crate::frame;
use crate::hurt::{Hurt, Line};
use crate::profile::Profile;
use std::collections::VecDeque;

/// A frame on its way back.
#[derive(Debug)]
struct Reply {
    due_ns: u64,
    frame: Vec<u8>,
}

/// Devices in a row on one cable.
#[derive(Debug)]
pub struct Bus {
    devices: Vec<Device>,
    replies: VecDeque<Reply>,
    line: Option<(Line, u32)>,
    held_back: Option<Vec<u8>>,
    cable_out_until_ns: u64,
    power_off_until_ns: Option<u64>,
    /// For garbage: the same in every run.
    noise: u64,
}

impl Bus {
    /// These devices, in the order of the cable.
    pub fn new(devices: Vec<Device>) -> Self {
        Self {
            devices,
            replies: VecDeque::new(),
            line: None,
            held_back: None,
            cable_out_until_ns: 0,
            power_off_until_ns: None,
            noise: 0x2545_F491_4F6C_DD1D,
        }
    }

    /// The devices.
    pub fn devices(&mut self) -> &mut [Device] {
        &mut self.devices
    }

    /// Something goes wrong, from now on.
    pub fn hurt(&mut self, hurt: Hurt, now_ns: u64) {
        self.advance(now_ns);
        match hurt {
            Hurt::Line(line, count) => self.line = Some((line, count)),
            Hurt::Cable(ns) => self.cable_out_until_ns = now_ns + ns,
            Hurt::Power(ns) => self.power_off_until_ns = Some(now_ns + ns),
            _ => self.devices.iter_mut().for_each(|device| hurt_device(device, hurt, now_ns)),
        }
    }

    /// Whether something that befell the line, the cable or the power is not over yet.
    pub fn is_hurt(&self, now_ns: u64) -> bool {
        self.line.is_some() || self.power_off_until_ns.is_some() || now_ns < self.cable_out_until_ns
    }

    /// Lets everything happen that was due by `now_ns`.
    pub fn advance(&mut self, now_ns: u64) {
        match self.power_off_until_ns {
            Some(until) if now_ns >= until => {
                self.power_off_until_ns = None;
                self.devices.iter_mut().for_each(|device| device.power_cycled(until));
            }
            Some(_) => return,
            None => {}
        }
        self.devices.iter_mut().for_each(|device| device.advance(now_ns));
    }

    /// When something happens next without a frame.
    pub fn next_event_ns(&self) -> Option<u64> {
        let replies = self.replies.iter().map(|reply| reply.due_ns);
        let devices = self.devices.iter().filter_map(Device::next_event_ns);
        let devices = devices.filter(|_| self.power_off_until_ns.is_none());
        replies.chain(devices).chain(self.power_off_until_ns).min()
    }

    /// A frame comes from the main device.
    pub fn send(&mut self, frame: &[u8], now_ns: u64) {
        self.advance(now_ns);
        let dark = self.power_off_until_ns.is_some() || now_ns < self.cable_out_until_ns;
        let line = self.next_line();
        if dark || line == Some(Line::DropRequest) || !frame::is_ethercat(frame) {
            return;
        }
        let mut frame = frame.to_vec();
        let before = frame.clone();
        for device in &mut self.devices {
            frame::each_datagram(&mut frame, |request, data| device.datagram(request, data, now_ns));
        }
        frame::mark_processed(&mut frame);
        self.answer(line, frame, &before, now_ns);
    }

    /// The next frame that is back by `now_ns`.
    pub fn receive(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        self.advance(now_ns);
        let ready = self.replies.iter().position(|reply| reply.due_ns <= now_ns)?;
        self.replies.remove(ready).map(|reply| reply.frame)
    }

    fn next_line(&mut self) -> Option<Line> {
        let (line, count) = self.line?;
        self.line = (count > 1).then_some((line, count - 1));
        (count > 0).then_some(line)
    }

    fn answer(&mut self, line: Option<Line>, frame: Vec<u8>, before: &[u8], now_ns: u64) {
        let mut push = |due_ns: u64, frame: Vec<u8>| self.replies.push_back(Reply { due_ns, frame });
        match line {
            Some(Line::DropReply | Line::DropRequest) => {}
            Some(Line::Delay(ns)) => push(now_ns + ns, frame),
            Some(Line::Duplicate) => {
                push(now_ns, frame.clone());
                push(now_ns, frame);
            }
            Some(Line::Reorder) => self.held_back = Some(frame),
            Some(Line::Truncate) => push(now_ns, frame.get(..frame.len() / 2).unwrap_or(&[]).to_vec()),
            Some(Line::Garbage) => {
                let mut noise = self.noise;
                let bytes = frame.iter().map(|_| {
                    noise ^= noise << 13;
                    noise ^= noise >> 7;
                    noise ^= noise << 17;
                    noise as u8
                });
                let mut garbage: Vec<u8> = bytes.collect();
                // As EtherCAT it claims to come, so that the receiver has to look at it.
                garbage.iter_mut().zip(&frame).take(16).for_each(|(byte, header)| *byte = *header);
                push(now_ns, garbage);
                self.noise = noise;
            }
            Some(Line::Foreign) => {
                let mut foreign = frame.clone();
                foreign.iter_mut().skip(12).zip([0x08, 0x06]).for_each(|(byte, kind)| *byte = kind);
                push(now_ns, foreign);
                push(now_ns, frame);
            }
            Some(Line::WorkingCounter) => {
                let mut untouched = before.to_vec();
                frame::mark_processed(&mut untouched);
                push(now_ns, untouched);
            }
            None => {
                push(now_ns, frame);
                if let Some(late) = self.held_back.take() {
                    push(now_ns, late);
                }
            }
        }
    }
}

fn hurt_device(device: &mut Device, hurt: Hurt, now_ns: u64) {
    match hurt {
        Hurt::Enabling(cycles) => device.settings.enable_cycles = cycles,
        Hurt::AlFall(code) => device.fall(AlState::SafeOp, code),
        Hurt::ClockJump(ns) => device.esc.clock.jump(ns),
        Hurt::Drift(ppb) => device.esc.clock.set_drift(now_ns, ppb),
        _ => {}
    }
    let Profile::Cia402(drive) = &mut device.profile else { return };
    match hurt {
        Hurt::DriveFault(code) => drive.fail(code),
        Hurt::NoFollowing(cycles) => drive.withhold_following = cycles,
        Hurt::Mode(mode, cycles) => drive.false_mode = Some((i64::from(mode), cycles)),
        _ => {}
    }
}
