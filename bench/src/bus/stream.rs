//! A pipe each way, and a Unix socket: the kernel carries the bytes and wakes the reader.

use super::{BACK_WORDS, Carrier, THERE_WORDS, other_side};
use crate::timing::Times;
use anyhow::{Context, Result};
use realtime::now_ns;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Stdio;

pub(super) fn pipe(trips: u64, times: &mut Times) -> Result<()> {
    let mut echo = other_side(Carrier::Pipe, Path::new("."), Stdio::piped(), Stdio::piped())?;
    let there = echo.stdin.take().context("stdin")?;
    let back = echo.stdout.take().context("stdout")?;
    trip_all(there, back, trips, times)?;
    echo.wait()?;
    Ok(())
}

pub(super) fn socket(trips: u64, times: &mut Times) -> Result<()> {
    let (ours, others) = UnixStream::pair()?;
    let output = OwnedFd::from(others.try_clone()?);
    let mut echo =
        other_side(Carrier::Socket, Path::new("."), Stdio::from(OwnedFd::from(others)), Stdio::from(output))?;
    let back = ours.try_clone()?;
    trip_all(&ours, back, trips, times)?;
    ours.shutdown(std::net::Shutdown::Both)?;
    echo.wait()?;
    Ok(())
}

fn trip_all(mut there: impl Write, mut back: impl Read, trips: u64, times: &mut Times) -> Result<()> {
    let message = [1_u8; THERE_WORDS * 8];
    let mut answer = [0_u8; BACK_WORDS * 8];
    for _ in 0..trips {
        let begun = now_ns();
        there.write_all(&message)?;
        back.read_exact(&mut answer)?;
        times.add(now_ns() - begun);
    }
    Ok(())
}

pub(super) fn echo() -> Result<()> {
    let (mut there, mut back) = (std::io::stdin().lock(), std::io::stdout().lock());
    let mut message = [0_u8; THERE_WORDS * 8];
    let answer = [2_u8; BACK_WORDS * 8];
    loop {
        match there.read_exact(&mut message) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(()),
            result => result?,
        }
        back.write_all(&answer)?;
        back.flush()?;
    }
}
