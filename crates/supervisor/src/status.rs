//! How a running instance is: gathered by the supervisor, printed by `stepvalve status`.

use crate::journal::advice_on_alarm;
use fieldbus::{DriveState, al_state_name};
use serde::{Deserialize, Serialize};
use signals::{BusPhase, BusStatus, ControllerState, FaultCode, HeldFlow, Source};
use std::collections::BTreeMap;
use std::fmt;

/// One process of the loop.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ProcessStatus {
    /// The last cycle that it reported.
    pub cycle: u64,
    /// Cycles that ran past the next deadline.
    pub overruns: u64,
    /// Whole cycles passed over.
    pub skipped_cycles: u64,
    /// Messages lost or refused on the way to it.
    pub missed_samples: u64,
    /// The largest wake-up latency that was seen in the last second or two, µs.
    pub wake_up_latency_us: f64,
    /// Whether it was late in the last ten seconds.
    pub late: bool,
    /// Whether it says nothing.
    pub silent: bool,
}

/// The bus to a real drive.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DriveBus {
    /// What the bridge is doing with it.
    pub phase: String,
    /// AL state of the last reply, by its name.
    pub al_state: String,
    /// AL status code of the last reply; 0 without an error.
    pub al_code: u64,
    /// The drive's state, by its name.
    pub drive_state: String,
    /// The drive's status word.
    pub drive_status: u64,
    /// The drive's error code.
    pub error_code: u64,
    /// The drive's mode of operation: 8 is cyclic synchronous position.
    pub mode: i64,
    /// Working counter of the process data: 3 where the drive read and wrote them.
    pub working_counter: u64,
    /// From sending the last answered frame to its reply, ns.
    pub round_trip_ns: u64,
    /// How far our cycle is off the bus's clock, ns.
    pub clock_error_ns: i64,
    /// Frames in operation without a good reply.
    pub lost_frames: u64,
    /// Replies that came after their cycle.
    pub late_replies: u64,
    /// Bring-ups so far.
    pub bring_ups: u64,
}

impl DriveBus {
    /// From what the bridge published last.
    pub fn new(bus: &BusStatus) -> Self {
        // Both have 16 bits on the bus.
        let (al_status, drive_status) = (bus.al_status as u16, bus.drive_status as u16);
        Self {
            phase: BusPhase::from_code(bus.phase).map_or("unknown", BusPhase::name).to_owned(),
            al_state: al_state_name(al_status).to_owned(),
            al_code: bus.al_code,
            drive_state: DriveState::of(drive_status).name().to_owned(),
            drive_status: bus.drive_status,
            error_code: bus.error_code,
            mode: bus.mode,
            working_counter: bus.working_counter,
            round_trip_ns: bus.round_trip_ns,
            clock_error_ns: bus.clock_error_ns,
            lost_frames: bus.lost_frames,
            late_replies: bus.late_replies,
            bring_ups: bus.bring_ups,
        }
    }
}

impl fmt::Display for DriveBus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { phase, al_state, al_code, drive_state, drive_status, mode, .. } = self;
        // Of a bus that does not answer everything is what it said last.
        let waits = phase == BusPhase::Wait.name();
        let heard = if waits { "; last heard:" } else { "," };
        let al_code = if *al_code == 0 { String::new() } else { format!(" with code {al_code:#06x}") };
        writeln!(
            f,
            "drive's bus      {phase}{heard} {al_state}{al_code}, working counter {}",
            self.working_counter
        )?;
        let error =
            if self.error_code == 0 { String::new() } else { format!(", error {:#06x}", self.error_code) };
        let then = if waits { ", when last heard" } else { "" };
        writeln!(f, "drive            {drive_state} ({drive_status:#06x}), mode {mode}{error}{then}")?;
        writeln!(
            f,
            "drive's frames   {} lost, {} late, round trip {:.0} µs, {:+.1} µs off its clock, {} bring-ups",
            self.lost_frames,
            self.late_replies,
            self.round_trip_ns as f64 / 1e3,
            self.clock_error_ns as f64 / 1e3,
            self.bring_ups
        )
    }
}

/// The instance.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Its name.
    pub instance: String,
    /// Its generation: counts the starts of the processes.
    pub generation: u64,
    /// The controller's state; `silent` where the controller says nothing.
    pub state: String,
    /// The last state that it told.
    pub last_state: String,
    /// For how long it has said nothing where that is too long, s; else 0.
    pub controller_silent_s: f64,
    /// Why the valve was stopped; `none` if it was not.
    pub fault: String,
    /// Why the plant side stopped the valve by itself; `none` if it did not.
    pub drive_fault: String,
    /// The cycle in which that was found.
    pub fault_cycle: u64,
    /// How many cycles ago; 0 without a fault.
    pub fault_since_cycles: u64,
    /// What it means and what to do.
    pub fault_advice: String,
    /// The set-point that is followed, by its id; 0 before the first.
    pub set_point: u64,
    /// What kind it is.
    pub set_point_kind: String,
    /// What an operator asked for with it, in his units; empty for an angle.
    #[serde(default)]
    pub set_point_asked: String,
    /// Where it leads, rad.
    pub target_angle_rad: f64,
    /// Whether the reference still moves.
    pub moving: bool,
    /// Whether a flow that is to be held while the pressure drop changes is; `none` where there is none.
    #[serde(default)]
    pub held_flow: String,
    /// Measured angle, rad; 0 where none was heard of yet.
    pub angle_rad: f64,
    /// Whether an angle was heard of since the processes started.
    #[serde(default = "yes")]
    pub angle_heard: bool,
    /// Whether the angle's zero is known.
    pub homed: bool,
    /// Whether it may be wrong by whole steps, which were lost and not found again by homing.
    #[serde(default)]
    pub angle_doubted: bool,
    /// Whether the windings carry current.
    pub energised: bool,
    /// Where homing is, or how far the last one came.
    pub homing: String,
    /// Angle of the encoder beyond the one that the motor's teeth held, as the last homing found it, rad.
    pub alignment_offset_rad: f64,
    /// How far single rests of the alignment lay from their mean, rad.
    pub alignment_spread_rad: f64,
    /// Following error, rad.
    pub following_error_rad: f64,
    /// Its peak until the last reset, rad.
    pub following_error_peak_rad: f64,
    /// What the motor has beyond the wanted torque, N·m.
    pub torque_reserve_nm: f64,
    /// Whether a limit holds the command back.
    pub limiting: bool,
    /// What the operator has to know and what stops nothing.
    pub alarms: Vec<String>,
    /// Commands since arming that the drive did not have in time.
    pub missed_commands: u64,
    /// Pulse rate, Hz.
    pub pulse_rate_hz: f64,
    /// Pressure drop, Pa.
    pub pressure_drop_pa: f64,
    /// Oil temperature, °C.
    pub oil_temperature_c: f64,
    /// The bus to the drive; `None` where the valve is simulated.
    #[serde(default)]
    pub bus: Option<DriveBus>,
    /// By process.
    pub processes: BTreeMap<String, ProcessStatus>,
    /// Messages recorded since the recorder started.
    pub recorded: u64,
    /// Messages lost on the way to it.
    pub recorder_missed: u64,
    /// Whether the disk takes what is written.
    pub recorder_healthy: bool,
    /// Whether the recorder says nothing.
    pub recorder_silent: bool,
    /// How often the recorder was replaced in this generation.
    pub recorder_restarts: u32,
    /// Whether it died so often that nothing is recorded any more.
    pub recorder_given_up: bool,
}

/// What a supervisor that does not tell says.
fn yes() -> bool {
    true
}

impl Status {
    /// The state in words, with the fault or the silence that stands behind it.
    pub fn state_words(&self) -> String {
        let silent = self.controller_silent_s;
        if silent > 0.0 {
            return format!(
                "UNKNOWN: the controller has said nothing for {silent:.1} s; it was {}",
                self.last_state
            );
        }
        if self.fault == "none" {
            return self.state.clone();
        }
        let (cycle, ago) = (self.fault_cycle, self.fault_since_cycles);
        let by_drive = self.fault == FaultCode::Drive.name() && self.drive_fault != FaultCode::None.name();
        let why = if by_drive { format!(" ({})", self.drive_fault) } else { String::new() };
        format!("{}: {}{why}, found in cycle {cycle}, {ago} cycles ago", self.state, self.fault)
    }

    /// The set-point in words: its kind, what was asked, and where it leads.
    pub fn set_point_words(&self) -> String {
        let motion = match (self.moving, self.controller_silent_s > 0.0) {
            (true, false) => "moving to",
            (true, true) => "was moving to",
            (false, _) => "at",
        };
        let kind = if self.set_point == 0 { "none" } else { &self.set_point_kind };
        let asked = &self.set_point_asked;
        let space = if asked.is_empty() { "" } else { " " };
        let held = self.unheld_words();
        format!("{kind}{space}{asked}{held}, {motion} {:.3}°", self.target_angle_rad.to_degrees())
    }

    /// Why a flow that is to be held is not; empty where all is well.
    pub fn unheld_words(&self) -> &'static str {
        if self.held_flow == HeldFlow::OutOfReach.name() {
            ", OUT OF REACH"
        } else if self.held_flow == HeldFlow::NoPressure.name() {
            ", NOT HELD: no valid pressure drop"
        } else {
            ""
        }
    }

    /// The most important of it in a line.
    pub fn line(&self) -> String {
        let degrees = |rad: f64| rad.to_degrees();
        let alarms = self.alarms.iter().map(|alarm| format!(", ALARM: {alarm}")).collect::<String>();
        format!(
            "{}: {}, to {:.3}°{}, error {:.4}°, reserve {}{alarms}",
            self.state_words(),
            self.angle_words(),
            degrees(self.target_angle_rad),
            self.unheld_words(),
            degrees(self.following_error_rad),
            self.reserve_words()
        )
    }

    /// The angle in words, with what has to be known of its zero and its age.
    pub fn angle_words(&self) -> String {
        if !self.angle_heard {
            return "not known yet".to_owned();
        }
        let is_silent = self.processes.get(Source::Plant.name()).is_some_and(|plant| plant.silent);
        let age = if is_silent { ", WHEN IT WAS LAST HEARD OF" } else { "" };
        format!("{:.3}°{age}{}", self.angle_rad.to_degrees(), self.zero_words())
    }

    /// What has to be known of the angle's zero; empty where all is well.
    fn zero_words(&self) -> &'static str {
        match (self.homed, self.angle_doubted) {
            (false, true) => ", NOT HOMED: steps were lost since the zero was found",
            (false, false) => ", NOT HOMED",
            (true, _) => "",
        }
    }

    /// The torque reserve in words: there is one while the controller commands the valve.
    pub fn reserve_words(&self) -> String {
        let commands = [ControllerState::Running, ControllerState::Homing, ControllerState::QuickStop];
        if commands.iter().any(|state| state.name() == self.state) {
            format!("{:.2} N·m", self.torque_reserve_nm)
        } else {
            "–".to_owned()
        }
    }

    fn named(&self, which: impl Fn(&ProcessStatus) -> bool) -> Vec<&str> {
        self.processes.iter().filter(|(_, p)| which(p)).map(|(name, _)| name.as_str()).collect()
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "instance         {}, generation {}", self.instance, self.generation)?;
        writeln!(f, "state            {}", self.state_words())?;
        if !self.fault_advice.is_empty() {
            writeln!(f, "                 {}", self.fault_advice)?;
        }
        writeln!(f, "set-point        {}", self.set_point_words())?;
        writeln!(f, "angle            {}", self.angle_words())?;
        writeln!(
            f,
            "following error  {:.4}°, peak {:.4}°",
            self.following_error_rad.to_degrees(),
            self.following_error_peak_rad.to_degrees()
        )?;
        let limiting = if self.limiting { ", held back by a limit" } else { "" };
        writeln!(f, "torque reserve   {}{limiting}", self.reserve_words())?;
        writeln!(f, "pulse rate       {:.1} kHz", self.pulse_rate_hz / 1e3)?;
        if self.missed_commands > 0 {
            writeln!(f, "missed commands  {} since arming", self.missed_commands)?;
        }
        for alarm in &self.alarms {
            writeln!(f, "ALARM            {alarm}")?;
            writeln!(f, "                 {}", advice_on_alarm(alarm))?;
        }
        writeln!(
            f,
            "oil              {:.2} MPa, {:.1} °C",
            self.pressure_drop_pa / 1e6,
            self.oil_temperature_c
        )?;
        if let Some(bus) = &self.bus {
            write!(f, "{bus}")?;
        }
        for (name, process) in &self.processes {
            let ProcessStatus { cycle, overruns, skipped_cycles, missed_samples, .. } = process;
            writeln!(
                f,
                "{name:<20} cycle {cycle}; overruns {overruns}, skipped {skipped_cycles}, missed samples {missed_samples}"
            )?;
        }
        let mut silent = self.named(|p| p.silent);
        if self.recorder_silent {
            silent.push(Source::Recorder.name());
        }
        for (label, names) in [("SILENT", silent), ("late", self.named(|p| p.late))] {
            if !names.is_empty() {
                writeln!(f, "{label:<16} {}", names.join(", "))?;
            }
        }
        let disk = match (self.recorder_given_up, self.recorder_healthy) {
            (true, _) => "; LOST: NOTHING IS RECORDED ANY MORE",
            (false, false) => "; LOST: THE DISK DOES NOT TAKE IT",
            (false, true) => "",
        };
        // A replaced recorder begins to count anew.
        let replaced = match self.recorder_restarts {
            0 => String::new(),
            1 => " since the recorder was replaced".to_owned(),
            times => format!(" since the recorder was last replaced, of {times} times"),
        };
        write!(
            f,
            "record           {} messages, {} missed{replaced}{disk}",
            self.recorded, self.recorder_missed
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_that_nobody_knows_or_that_is_old_says_so() {
        let with = |angle_heard: bool, silent: bool, homed: bool| {
            let plant = ProcessStatus { silent, ..ProcessStatus::default() };
            let processes = [(Source::Plant.name().to_owned(), plant)].into();
            Status { angle_rad: 0.3, angle_heard, homed, processes, ..Status::default() }.angle_words()
        };
        for (heard, silent, homed, expected) in [
            (true, false, true, "17.189°"),
            (true, false, false, "17.189°, NOT HOMED"),
            (true, true, true, "17.189°, WHEN IT WAS LAST HEARD OF"),
            (false, false, false, "not known yet"),
            (false, true, false, "not known yet"),
        ] {
            assert_eq!(with(heard, silent, homed), expected);
        }
    }

    #[test]
    fn a_flow_that_is_not_held_says_so() {
        for (held, expected) in [
            (HeldFlow::None, ""),
            (HeldFlow::Held, ""),
            (HeldFlow::OutOfReach, ", OUT OF REACH"),
            (HeldFlow::NoPressure, ", NOT HELD: no valid pressure drop"),
        ] {
            let status = Status { held_flow: held.name().to_owned(), ..Status::default() };
            assert_eq!(status.unheld_words(), expected);
        }
    }
}
