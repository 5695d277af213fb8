//! A drive on the bus that answers anything: bytes of the simulated drive's replies are changed as the fuzzer says, from the
//! first frame of the bring-up on, through SII and CoE, into operation.

use closed_loop::wire;
use config::{parse_drive, parse_model, parse_scenario};
use ethercat_link::{Bridge, BridgeParams, Link, LinkError};
use signals::StepCommand;
use std::cell::RefCell;
use subdevice::{Bus, Device, Settings, Valve};

const DRIVE: &str = include_str!("../../rt-config/drives/simulated.toml");
const SCENARIO: &str = include_str!("../../rt-config/scenarios/drive.toml");
const MODEL: &str = include_str!("../../rt-config/models/rig.toml");

const PERIOD_NS: u64 = 1_000_000;
/// From the main device to the drive, and back, ns.
const ONE_WAY_NS: u64 = 10_000;
/// Cycles after the first look at the drive: bring-up, clock, operation.
const CYCLES: u64 = 700;
/// What precedes the datagrams of a frame, but for its source address.
const HEADER: usize = 12;

/// A cable in memory that changes replies.
struct Hostile {
    bus: Bus,
    now_ns: u64,
    /// After so many replies, at which byte, by which bits.
    changes: Vec<[u8; 3]>,
    replies: u64,
}

impl Hostile {
    fn new(bus: Bus, bytes: &[u8]) -> Self {
        let changes = bytes.chunks_exact(3).filter_map(|chunk| chunk.first_chunk::<3>().copied()).collect();
        Self { bus, now_ns: 1_000_000, changes, replies: 0 }
    }

    fn change(&mut self, reply: &mut [u8]) {
        self.replies += 1;
        let Some([after, place, bits]) = self.changes.last().copied() else { return };
        if self.replies < u64::from(after) {
            return;
        }
        self.changes.pop();
        self.replies = 0;
        let length = reply.len().max(HEADER + 1) - HEADER;
        if let Some(byte) = reply.get_mut(HEADER + usize::from(place) % length) {
            *byte ^= bits;
        }
    }
}

impl Link for Hostile {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), LinkError> {
        self.now_ns += ONE_WAY_NS;
        self.bus.send(frame, self.now_ns);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], until_ns: u64) -> Result<Option<usize>, LinkError> {
        if let Some(mut reply) = self.bus.receive(self.now_ns) {
            self.change(&mut reply);
            self.now_ns += ONE_WAY_NS;
            buffer.iter_mut().zip(&reply).for_each(|(place, byte)| *place = *byte);
            return Ok(Some(reply.len()));
        }
        self.now_ns = self.now_ns.max(until_ns);
        self.bus.advance(self.now_ns);
        Ok(None)
    }
}

thread_local! {
    /// ethercrab's memory is never given back: one bridge serves all.
    static BRIDGE: RefCell<Option<Bridge<Hostile>>> = const { RefCell::new(None) };
}

fn drive() -> Bus {
    let Ok(model) = parse_model(MODEL, "rig.toml") else { panic!("the shipped model is refused") };
    let Ok(valve) = Valve::new(&model, 0.0) else { panic!("the shipped model makes no valve") };
    Bus::new(vec![Device::new(Settings::default(), valve, 0)])
}

fn params() -> BridgeParams {
    let all = (parse_drive(DRIVE, ""), parse_scenario(SCENARIO, ""), parse_model(MODEL, ""));
    let (Ok(file), Ok(scenario), Ok(model)) = all else { panic!("a shipped file is refused") };
    let Ok(parts) = wire(&scenario, &model, &model) else { panic!("the shipped scenario is refused") };
    let params = BridgeParams::new(file, parts.plant.drive, PERIOD_NS, PERIOD_NS);
    params.unwrap_or_else(|error| panic!("{error}"))
}

/// Whatever the drive answers: the bring-up ends, with a drive or with an error, and the cycles go on at their pace.
pub fn bus_replies(bytes: &[u8]) {
    BRIDGE.with_borrow_mut(|bridge| {
        let bridge = bridge.get_or_insert_with(|| Bridge::new(Hostile::new(drive(), &[]), params()));
        let before_ns = bridge.link().now_ns();
        *bridge.link() = Hostile { now_ns: before_ns, ..Hostile::new(drive(), bytes) };
        let _ = bridge.check();
        let begin_ns = bridge.link().now_ns();
        assert!(
            begin_ns - before_ns < 20_000_000_000,
            "a look at the drive takes {} ns",
            begin_ns - before_ns
        );
        let command = StepCommand { energise: 1, ..StepCommand::default() };
        for cycle in 0..CYCLES {
            let begin_ns = begin_ns + cycle * PERIOD_NS;
            let link = bridge.link();
            link.now_ns = link.now_ns.max(begin_ns + PERIOD_NS / 10);
            bridge.cycle(cycle, begin_ns, Some(&command), false);
            let late_ns = bridge.link().now_ns().saturating_sub(begin_ns + PERIOD_NS);
            assert!(late_ns < PERIOD_NS, "cycle {cycle} ends {late_ns} ns after its own");
        }
    });
}
