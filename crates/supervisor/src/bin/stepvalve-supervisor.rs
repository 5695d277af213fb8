//! `stepvalve-supervisor`: what `stepvalve run` and `simulate` become while the loop's processes live.
#![forbid(unsafe_code)]

use processes::complain;
use std::process::ExitCode;
use supervisor::{Conclusion, Failure, Mission, conclude, received, supervise};

fn main() -> ExitCode {
    match live() {
        Ok(never) => match never {},
        Err(failure) => {
            complain(&failure);
            failure.code()
        }
    }
}

fn live() -> Result<std::convert::Infallible, Failure> {
    let mut mission: Mission = received()?;
    let ending = supervise(&mission)?;
    let errand = std::mem::take(&mut mission.errand);
    Ok(conclude(&Conclusion { errand, ending })?)
}
