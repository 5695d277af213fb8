//! `stepvalve arm | disarm | reset | set | status | mark | save-timing`: talking to a running instance.

use crate::list::beyond_orders;
use crate::say::{is_heard, say};
use anyhow::anyhow;
use clap::{Args, Subcommand};
use config::{Compensation, Dimension, parse_quantity};
use injection::Injection;
use signals::SetPointKind;
use std::path::{Path, PathBuf};
use std::time::Duration;
use supervisor::{
    Answer, Failure, FoundInstance, InstanceName, Interruption, Outcome, Request, ask, ask_status,
    base_folder, instance_folder, instances, socket_path, whereabouts, without_a_folder,
};

/// How long an operator waits: what is not done by then is refused, and not done later.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often a status that is watched is printed.
const EVERY: Duration = Duration::from_secs(1);
/// What moves nothing may take longer: an instance may just be starting its processes again.
const LEISURE: Duration = Duration::from_secs(5);

/// Which instance.
#[derive(Debug, Args)]
pub struct Which {
    /// Name of the instance [default: the one that runs, if it is the only one]
    #[arg(long, value_name = "NAME", global = true)]
    pub instance: Option<InstanceName>,
    /// Print the answer as JSON
    #[arg(long, global = true)]
    pub json: bool,
}

/// A plain order.
#[derive(Debug, Args)]
pub struct Plain {
    /// Which instance.
    #[command(flatten)]
    pub which: Which,
}

/// How it is.
#[derive(Debug, Args)]
pub struct StatusOf {
    /// A line a second, until Ctrl-C
    #[arg(long)]
    watch: bool,
    #[command(flatten)]
    which: Which,
}

/// A note for the record.
#[derive(Debug, Args)]
pub struct Mark {
    /// The note
    text: String,
    #[command(flatten)]
    which: Which,
}

/// A fault.
#[derive(Debug, Args)]
pub struct Inject {
    /// The fault, whom or what it befalls, and key=value: `kill step-controller`, `pause plant-simulator ms=100`,
    /// `overrun step-controller cycles=3`, `silence trajectory-generator`, `drop feedback count=2`,
    /// `flip-bits reference bits=3 seed=7`, `field feedback name=angle_rad value=nan`, `replay step-command age=5`,
    /// `duplicate`, `delay`, `wrong-schema`, `wrong-generation`, `wrong-source` with a message, `frozen-encoder`,
    /// `encoder-jump by_rad=0.2`, `hog core=1 ms=1000`, `disk-stalled ms=10000`, `disk-full`. `at=CYCLE` says from which
    /// cycle on; without, at once
    #[arg(required = true, value_name = "WORD")]
    fault: Vec<String>,
    #[command(flatten)]
    which: Which,
}

/// A set-point.
#[derive(Debug, Args)]
pub struct Set {
    #[command(subcommand)]
    what: Settable,
    #[command(flatten)]
    which: Which,
}

#[derive(Debug, Subcommand)]
enum Settable {
    /// Go to an angle: 17deg, 0.3rad
    Angle(SetValue),
    /// Go to an opening from 0 (closed) to 1 (open)
    Opening(SetValue),
    /// Hold a flow: 40L/min, 600mL/s
    Flow(SetFlow),
    /// Turn without end: 60rpm, 11.2rad/s; for scenarios without angle limits
    Speed(SetValue),
    /// Stop as soon as the limits of motion allow, and stay armed
    Hold,
    /// Give a parameter of the controller another value, from the next cycle on: parameter observer-bandwidth 40
    Parameter(SetParameter),
}

#[derive(Debug, Args)]
struct SetParameter {
    /// compensation-level (none, coulomb-viscous, full, full-with-effects, or 0 to 3), observer-bandwidth (Hz), observer-limit (N·m; in the
    /// scenario it is a part of the holding torque), largest-following-error (rad), following-error-per-speed (s)
    name: String,
    /// Its new value
    #[arg(allow_hyphen_values = true, value_parser = parameter)]
    value: f64,
}

/// A number, or a level of compensation by its name in a scenario.
fn parameter(text: &str) -> Result<f64, String> {
    let names = Compensation::NAMED.map(|(name, _)| name);
    let level = names.iter().position(|name| *name == text).map(|level| level as f64);
    let refused =
        || format!("found `{text}`, expected a number, or a level of compensation: {}", names.join(", "));
    level.map_or_else(|| text.parse().map_err(|_| refused()), Ok)
}

#[derive(Debug, Args)]
struct SetValue {
    /// The value, with its unit
    #[arg(allow_hyphen_values = true)]
    value: String,
    /// The unit, where a blank stands before it
    unit: Option<String>,
}

impl SetValue {
    fn text(&self) -> String {
        format!("{}{}", self.value, self.unit.as_deref().unwrap_or(""))
    }
}

#[derive(Debug, Args)]
struct SetFlow {
    #[command(flatten)]
    flow: SetValue,
    /// The pressure drop that it is meant at (2MPa); without, the measured one, followed as it changes
    #[arg(long, value_name = "PRESSURE")]
    pressure_drop: Option<String>,
}

/// Arms, disarms or resets; or saves the timing.
///
/// # Errors
/// As [`Failure`] tells: no such instance, or refused with the reason.
pub fn plain(request: &Request, arguments: &Plain) -> Result<Outcome, Failure> {
    send(request, &arguments.which)
}

/// Puts a note into the record.
///
/// # Errors
/// As [`plain`].
pub fn mark(arguments: &Mark) -> Result<Outcome, Failure> {
    let text = arguments.text.trim().to_owned();
    if text.is_empty() {
        return Err(Failure::Input(anyhow!("found an empty note, expected what is to be remembered")));
    }
    send(&Request::Mark { text }, &arguments.which)
}

/// Lets something go wrong on an instance that was started with `--allow-injection`.
///
/// # Errors
/// As [`plain`]; [`Failure::Input`] for a text that is no fault.
pub fn inject(arguments: &Inject) -> Result<Outcome, Failure> {
    let fault = Injection::parse(&arguments.fault.join(" ")).map_err(Failure::input)?;
    send(&Request::Inject { fault }, &arguments.which)
}

/// Sends a set-point.
///
/// # Errors
/// As [`plain`]; [`Failure::Input`] for a value that is none.
pub fn set(arguments: &Set) -> Result<Outcome, Failure> {
    let of = |kind: SetPointKind, value: &str, dimension: Dimension| -> Result<Request, Failure> {
        Ok(Request::Set { kind, value: quantity(value, dimension)?, pressure_drop_pa: None })
    };
    let request = match &arguments.what {
        Settable::Angle(set) => of(SetPointKind::Angle, &set.text(), Dimension::Angle)?,
        Settable::Opening(set) => of(SetPointKind::Opening, &set.text(), Dimension::Ratio)?,
        Settable::Speed(set) => of(SetPointKind::Speed, &set.text(), Dimension::Speed)?,
        Settable::Flow(set) => Request::Set {
            kind: SetPointKind::Flow,
            value: quantity(&set.flow.text(), Dimension::Flow)?,
            pressure_drop_pa: set
                .pressure_drop
                .as_deref()
                .map(|text| quantity(text, Dimension::Pressure))
                .transpose()?,
        },
        Settable::Hold => Request::Hold,
        Settable::Parameter(set) => Request::Parameter { name: set.name.clone(), value: set.value },
    };
    send(&request, &arguments.which)
}

/// Prints the status.
///
/// # Errors
/// As [`plain`].
pub fn status(arguments: &StatusOf) -> Result<Outcome, Failure> {
    let socket = find(&arguments.which)?;
    if !arguments.watch {
        let status = ask_status(&socket, LEISURE)?;
        if arguments.which.json {
            say(serde_json::to_string_pretty(&status).map_err(anyhow::Error::from)?);
        } else {
            say(status);
        }
        return Ok(Outcome::Done);
    }
    let interruption = Interruption::watch()?;
    while !interruption.wanted() {
        let status = ask_status(&socket, LEISURE)?;
        let line = if arguments.which.json {
            serde_json::to_string(&status).map_err(anyhow::Error::from)?
        } else {
            status.line()
        };
        if !is_heard(line) {
            break;
        }
        std::thread::sleep(EVERY);
    }
    Ok(Outcome::Done)
}

/// Disarms, whatever of the instance may hang, within a second.
///
/// # Errors
/// As [`plain`]; the refusal says what stops the valve instead.
pub fn disarm(arguments: &Plain) -> Result<Outcome, Failure> {
    let socket = find(&arguments.which)?;
    tell(supervisor::disarm(socket.parent().unwrap_or(Path::new("/"))), &arguments.which)
}

fn send(request: &Request, which: &Which) -> Result<Outcome, Failure> {
    let patience = match request {
        Request::Status | Request::Mark { .. } | Request::SaveTiming | Request::Inject { .. } => LEISURE,
        _ => PATIENCE,
    };
    tell(ask(&find(which)?, request, patience)?, which)
}

/// Prints an answer; a refusal is a failure.
///
/// # Errors
/// [`Failure::Failed`] for a refusal.
pub fn tell(answer: Answer, which: &Which) -> Result<Outcome, Failure> {
    if which.json {
        say(serde_json::to_string(&answer).map_err(anyhow::Error::from)?);
    } else if answer.done {
        say(&answer.text);
    }
    let Answer { done, text, .. } = answer;
    if done { Ok(Outcome::Done) } else { Err(Failure::Failed(anyhow!("refused: {text}"))) }
}

fn quantity(text: &str, dimension: Dimension) -> Result<f64, Failure> {
    parse_quantity(text, dimension).map_err(|error| Failure::Input(anyhow!("\"{text}\": {error}")))
}

/// The socket of the instance that is meant.
///
/// # Errors
/// [`Failure::Input`] where none runs, or several do and none is named.
pub fn find(which: &Which) -> Result<PathBuf, Failure> {
    let base = base_folder()?;
    let named = which.instance.as_ref().map(|name| socket_path(&instance_folder(&base, name)));
    if let Some(socket) = named.filter(|socket| socket.exists()) {
        return Ok(socket);
    }
    // One that was killed leaves its socket behind.
    meant(&base, which, FoundInstance::listens).map(|found| socket_path(&found.folder))
}

/// The instance that is meant, of those under `base` that `run`.
///
/// # Errors
/// [`Failure::Input`] where it doesn't, none does, or several do and none is named; it says which do.
pub fn meant(
    base: &Path,
    which: &Which,
    run: impl Fn(&FoundInstance) -> bool,
) -> Result<FoundInstance, Failure> {
    let locks = std::fs::read_to_string("/proc/locks").unwrap_or_default();
    let (mut running, others): (Vec<_>, Vec<_>) = instances(base, &locks).into_iter().partition(run);
    let names = running.iter().map(|found| found.name.as_str()).collect::<Vec<_>>().join(", ");
    let name = which.instance.as_ref().map(ToString::to_string);
    let beyond = || -> String {
        without_a_folder(&locks).into_iter().map(|process| format!("; {}", beyond_orders(process))).collect()
    };
    let wrong = match (&name, running.len()) {
        (_, 0) => format!(
            "no instance{} runs under {}; `stepvalve run SCENARIO.toml --instance NAME --out DIR` starts one, \
             `stepvalve list` looks elsewhere too{}{}",
            name.map_or(String::new(), |name| format!(" \"{name}\"")),
            base.display(),
            others.iter().map(died).collect::<String>(),
            beyond()
        ),
        (Some(name), _) if running.iter().all(|found| found.name != *name) => {
            format!("no instance \"{name}\" runs, but {names}{}", beyond())
        }
        (None, 2..) => format!("several instances run: --instance takes one of {names}"),
        (name, _) => {
            let place = running.iter().position(|found| name.as_ref().is_none_or(|name| found.name == *name));
            return Ok(running.swap_remove(place.unwrap_or(0)));
        }
    };
    Err(Failure::Input(anyhow!("{wrong}")))
}

/// What is known of one that a crash left; nothing where its processes still end.
fn died(left: &FoundInstance) -> String {
    let record = whereabouts(&left.folder).ok().filter(|_| !left.alive).map(|at| at.record);
    record.map_or(String::new(), |record| {
        format!("; {} died: `stepvalve events {}` says what happened", left.name, record.display())
    })
}
