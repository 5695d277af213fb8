//! `stepvalve home`: the angle's zero is found and the motor's teeth aligned to the encoder, on a running instance.

use crate::operator::{Plain, find, tell};
use crate::pulse::Pulse;
use crate::say::say;
use indicatif::ProgressBar;
use std::path::Path;
use std::time::{Duration, Instant};
use supervisor::{Answer, Failure, Interruption, Outcome, Request, Status, ask, ask_status, disarm};

/// How long the controller may take to say that it has begun: the drive energises the motor first.
const BEGINNING: Duration = Duration::from_secs(1);
/// How often the operator is shown where it is.
const LOOK: Duration = Duration::from_millis(100);
/// A supervisor that gives no status for so long is not waited for any more.
const LOST_AFTER: Duration = Duration::from_secs(5);

/// Homes the valve, and waits until that is done. An interruption (Ctrl-C) disarms.
///
/// # Errors
/// [`Failure::Failed`] where it is refused or fails, with the reason.
pub fn run(arguments: &Plain) -> Result<Outcome, Failure> {
    let socket = find(&arguments.which)?;
    let interruption = Interruption::watch()?;
    let begun = ask(&socket, &Request::Home, BEGINNING)?;
    if !begun.done {
        return tell(begun, &arguments.which);
    }
    let bar = ProgressBar::new_spinner();
    let shown = bar.clone();
    let pulse = Pulse::new(move || shown.message());
    let status = follow(&socket, &interruption, &bar);
    drop(pulse);
    bar.finish_and_clear();
    let Some(status) = status? else {
        let stopped = disarm(folder(&socket));
        say(format_args!("homing was interrupted: {}", stopped.text));
        return Ok(Outcome::Interrupted);
    };
    tell(verdict(&status), &arguments.which)
}

/// The status once homing is over; `None` where the operator interrupted it.
fn follow(
    socket: &Path,
    interruption: &Interruption,
    bar: &ProgressBar,
) -> Result<Option<Status>, anyhow::Error> {
    let mut heard = Instant::now();
    loop {
        if interruption.wanted() {
            return Ok(None);
        }
        match ask_status(socket, LOST_AFTER) {
            Ok(status) => {
                heard = Instant::now();
                if !["arming", "homing", "quick-stop"].contains(&status.state.as_str()) {
                    return Ok(Some(status));
                }
                bar.set_message(format!("{}: {:.2}°", status.homing, status.angle_rad.to_degrees()));
                bar.tick();
            }
            Err(error) if heard.elapsed() > LOST_AFTER => return Err(error),
            Err(_) => {}
        }
        std::thread::sleep(LOOK);
    }
}

fn verdict(status: &Status) -> Answer {
    if status.homed && status.fault == "none" && status.homing == "done" {
        return Answer::done(format!(
            "homed at {:.3}°; encoder and teeth stood {:.4}° apart, single rests within {:.4}°",
            status.angle_rad.to_degrees(),
            status.alignment_offset_rad.to_degrees(),
            status.alignment_spread_rad.to_degrees()
        ));
    }
    let fault = if status.fault == "none" { "it was stopped" } else { &status.fault };
    Answer::refused(format!("homing ended in \"{}\": {fault}; the valve is {}", status.homing, status.state))
}

fn folder(socket: &Path) -> &Path {
    socket.parent().unwrap_or(Path::new("/"))
}
