//! The bare echo: a process that sends every frame back, and this side's trips to it in the bridge's cycle.

use super::ride::{PERIOD_NS, PLACE_NS, REPLY_NS};
use crate::timing::Times;
use anyhow::{Context, Result, bail};
use ethercat_link::{Link, PacketLink};
use realtime::{CyclicTimer, PacketSocket, Wanted, now_ns, obtain};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Command, Stdio};
use subdevice::{FAR, NEAR};

const ETHERTYPE: u16 = 0x88A4;
/// As long as the bridge's frame to a CiA 402 drive, bytes.
const FRAME: usize = 94;
/// As the simulated drive's process has.
const PRIORITY: u8 = 90;

/// The other side's `main`: until its stdin ends.
///
/// # Errors
/// Where it has no socket.
pub(in crate::bus) fn echo() -> Result<()> {
    let socket = PacketSocket::open(FAR, ETHERTYPE)?;
    let _awake = obtain(&Wanted { core: None, priority: Some(PRIORITY), lock_memory: false });
    println!("ready");
    std::io::stdout().flush()?;
    std::thread::spawn(|| {
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        std::process::exit(0);
    });
    let mut buffer = [0; 2048];
    loop {
        if let Some(length) = socket.receive(&mut buffer, now_ns() + 1_000_000_000)? {
            socket.send(buffer.get(..length).unwrap_or(&[]))?;
        }
    }
}

/// Trips to the echo and back, one a cycle.
pub(super) fn trips(cycles: u64, times: &mut Times) -> Result<()> {
    let mut other = Command::new(std::env::current_exe()?)
        .arg("echo-frames")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .context("the echo")?;
    let mut line = String::new();
    BufReader::new(other.stdout.take().context("its stdout")?).read_line(&mut line)?;
    if line != "ready\n" {
        bail!("the echo said {line:?}, expected \"ready\"");
    }
    let mut link = PacketLink::open(NEAR)?;
    let mut timer = CyclicTimer::new(now_ns() + 5_000_000, PERIOD_NS, PLACE_NS);
    let mut frame = [0; FRAME];
    frame.iter_mut().zip([0xFF; 6]).for_each(|(place, byte)| *place = byte);
    frame.iter_mut().skip(12).zip(ETHERTYPE.to_be_bytes()).for_each(|(place, byte)| *place = byte);
    let mut buffer = [0; 2048];
    for cycle in 0..cycles {
        let wake = timer.wait();
        // By the number at its end a reply is known.
        frame.iter_mut().rev().zip(cycle.to_le_bytes()).for_each(|(place, byte)| *place = byte);
        let until_ns = wake.deadline_ns + (REPLY_NS - PLACE_NS);
        let sent_ns = link.now_ns();
        link.send(&frame)?;
        while let Some(length) = link.receive(&mut buffer, until_ns)? {
            if buffer.get(..length) == Some(&frame) {
                times.add(link.now_ns().saturating_sub(sent_ns));
                break;
            }
        }
    }
    drop(other.stdin.take());
    other.wait()?;
    Ok(())
}
