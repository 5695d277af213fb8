//! The simulated drive on a network interface: answers frames until its stdin ends; lines there say what is to go wrong.

use anyhow::{Context, anyhow, bail};
use clap::Parser;
use realtime::{PacketSocket, Wanted, now_ns, obtain};
use std::io::{BufRead, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use subdevice::{Alarm, Bus, Device, Hurt, Kind, OnMissed, Settings, SyncRow, Valve, write_log};

/// EtherType of EtherCAT.
const ETHERTYPE: u16 = 0x88A4;

/// Longest sleep, ns: stdin is looked at after it.
const LONGEST_SLEEP_NS: u64 = 5_000_000;

/// A simulated stepper drive on an EtherCAT cable, for tests.
#[derive(Debug, Parser)]
struct Arguments {
    /// The network interface.
    #[arg(long)]
    interface: String,
    /// The model of the valve that it moves.
    #[arg(long)]
    model: PathBuf,
    /// The spool's angle at the start, rad.
    #[arg(long, default_value_t = 0.0)]
    angle: f64,
    /// A pulse-train terminal in place of a CiA 402 drive.
    #[arg(long)]
    pulse_train: bool,
    /// How many of them are on the cable.
    #[arg(long, default_value_t = 1)]
    devices: usize,
    /// Where a row for each SYNC0 goes at the end, as CSV.
    #[arg(long)]
    log: Option<PathBuf>,
    /// Crystal, parts per billion.
    #[arg(long, default_value_t = 0, allow_hyphen_values = true)]
    drift: i64,
    /// Position on the bus less that of the spool.
    #[arg(long, default_value_t = 0, allow_hyphen_values = true)]
    zero_offset: i64,
    /// Vendor id.
    #[arg(long)]
    vendor: Option<u32>,
    /// Product code.
    #[arg(long)]
    product: Option<u32>,
    /// Revision.
    #[arg(long)]
    revision: Option<u32>,
    /// An EEPROM without content.
    #[arg(long)]
    empty_sii: bool,
    /// Smallest cycle, ns.
    #[arg(long)]
    minimum_cycle: Option<u32>,
    /// Cycles from switched on to operation enabled.
    #[arg(long)]
    enable_cycles: Option<u32>,
    /// Goes on at its last rate in a cycle without fresh outputs; else it stands.
    #[arg(long)]
    extrapolate: bool,
    /// Reports its command as its position.
    #[arg(long)]
    open_loop: bool,
    /// An object's value, as INDEX:SUB=VALUE; index and sub hexadecimal, value decimal.
    #[arg(long)]
    set: Vec<String>,
    /// An object that is not there, as INDEX:SUB.
    #[arg(long)]
    without: Vec<String>,
    /// An object that accepts every write and keeps its value, as INDEX:SUB.
    #[arg(long)]
    stubborn: Vec<String>,
    /// An object whose accesses are refused, as INDEX:SUB=CODE, all hexadecimal.
    #[arg(long)]
    refuse: Vec<String>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("subdevice: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut bus = bus(arguments)?;
    let socket = PacketSocket::open(&arguments.interface, ETHERTYPE)
        .with_context(|| format!("--interface {}", arguments.interface))?;
    // A device has a processor of its own; a test's machine may refuse even a priority.
    let _guard = obtain(&Wanted { core: None, priority: Some(90), lock_memory: false });
    let mut alarm = Alarm::new().context("timer")?;
    let orders = listen();
    answer("ready")?;
    let mut rows: Vec<SyncRow> = Vec::with_capacity(1 << 20);
    let mut buffer = [0_u8; 2048];
    loop {
        match orders.try_recv() {
            Ok(line) => match line.parse::<Hurt>() {
                Ok(hurt) => {
                    let now = now_ns();
                    bus.hurt(hurt, now);
                    answer(now)?;
                }
                Err(error) => answer(error)?,
            },
            Err(TryRecvError::Disconnected) => break,
            Err(TryRecvError::Empty) => {}
        }
        let sleep_until = now_ns() + LONGEST_SLEEP_NS;
        let until = bus.next_event_ns().map_or(sleep_until, |event| event.min(sleep_until));
        // A link that goes down ends a wait with an error; the link may come back.
        let _ = alarm.wait(&socket, now_ns(), until);
        if let Ok(Some(length)) = socket.receive_now(&mut buffer) {
            bus.send(buffer.get(..length).unwrap_or(&[]), now_ns());
        }
        let now = now_ns();
        bus.advance(now);
        while let Some(reply) = bus.receive(now) {
            let _ = socket.send(&reply);
        }
        if let Some(device) = bus.devices().first_mut() {
            rows.append(&mut device.take_rows());
        }
    }
    if let Some(path) = &arguments.log {
        write_log(path, &rows).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// A line to whom it serves: when something went wrong, or why not.
fn answer(what: impl std::fmt::Display) -> std::io::Result<()> {
    println!("{what}");
    std::io::stdout().flush()
}

/// Lines of stdin; their end is the end of the device.
fn listen() -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

fn bus(arguments: &Arguments) -> anyhow::Result<Bus> {
    let path = &arguments.model;
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let model =
        config::parse_model(&text, &path.display().to_string()).map_err(|error| anyhow!("{error}"))?;
    let settings = settings(arguments);
    let now = now_ns();
    let devices = (0..arguments.devices).map(|_| {
        let valve = Valve::new(&model, arguments.angle)?;
        let mut device = Device::new(settings.clone(), valve, now);
        for text in &arguments.set {
            let (index, sub, value) = entry(text)?;
            device.preset(index, sub, value.unwrap_or("").parse().with_context(|| text.clone())?);
        }
        for text in &arguments.without {
            let (index, sub, _) = entry(text)?;
            device.without(index, sub);
        }
        for text in &arguments.stubborn {
            let (index, sub, _) = entry(text)?;
            device.keep(index, sub);
        }
        for text in &arguments.refuse {
            let (index, sub, code) = entry(text)?;
            device.refuse(
                index,
                sub,
                u32::from_str_radix(code.unwrap_or(""), 16).with_context(|| text.clone())?,
            );
        }
        Ok(device)
    });
    Ok(Bus::new(devices.collect::<anyhow::Result<_>>()?))
}

fn settings(arguments: &Arguments) -> Settings {
    let mut settings = Settings {
        kind: if arguments.pulse_train { Kind::PulseTrain } else { Kind::Cia402 },
        empty_sii: arguments.empty_sii,
        drift_ppb: arguments.drift,
        zero_offset: arguments.zero_offset,
        on_missed: if arguments.extrapolate { OnMissed::Extrapolate } else { OnMissed::Hold },
        position_is_measured: !arguments.open_loop,
        ..Settings::default()
    };
    let identity = &mut settings.identity;
    if arguments.pulse_train {
        (identity.vendor, identity.product) = (2, 0x09DA_3052);
    }
    identity.vendor = arguments.vendor.unwrap_or(identity.vendor);
    identity.product = arguments.product.unwrap_or(identity.product);
    identity.revision = arguments.revision.unwrap_or(identity.revision);
    settings.minimum_cycle_ns = arguments.minimum_cycle.unwrap_or(settings.minimum_cycle_ns);
    settings.enable_cycles = arguments.enable_cycles.unwrap_or(settings.enable_cycles);
    settings
}

/// INDEX:SUB or INDEX:SUB=VALUE.
fn entry(text: &str) -> anyhow::Result<(u16, u8, Option<&str>)> {
    let (place, value) = text.split_once('=').map_or((text, None), |(place, value)| (place, Some(value)));
    let Some((index, sub)) = place.split_once(':') else {
        bail!("`{text}`, expected INDEX:SUB or INDEX:SUB=VALUE")
    };
    Ok((u16::from_str_radix(index, 16)?, u8::from_str_radix(sub, 16)?, value))
}
