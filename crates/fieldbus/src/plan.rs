//! The bring-up in PRE-OP: every object that is written, read back, or must have a value, in order.

use crate::drive_file::{DriveFile, Homing, Profile, SdoValue};
use crate::objects::{self, Object};
use crate::process_data::OPTIONAL;
use thiserror::Error;

/// What a value read must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Check {
    Equals,
    AtMost,
    HasBits,
}

/// One step: written first where it is to be, then read, then judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request {
    /// Which object.
    pub object: Object,
    /// The value in the object's type: what is written, or expected.
    pub value: SdoValue,
    /// Whether it is written first.
    pub write: bool,
    check: Check,
}

/// An object that is not as it must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{object} is {found}, expected {expected}")]
pub struct Mismatch {
    /// Which.
    pub object: Object,
    /// What the drive says.
    pub found: i64,
    /// What it should say.
    pub expected: Expected,
}

/// What a value should be, for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Just this.
    Equal(i64),
    /// This or less.
    AtMost(i64),
    /// These bits set.
    Bits(i64),
}

impl core::fmt::Display for Expected {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Equal(value) => write!(f, "{value}"),
            Self::AtMost(value) => write!(f, "at most {value}"),
            Self::Bits(bits) => write!(f, "a value with the bits {bits:#x}"),
        }
    }
}

impl Request {
    fn write(object: Object, value: SdoValue) -> Self {
        Self { object, value, write: true, check: Check::Equals }
    }

    fn expect(object: Object, value: SdoValue, check: Check) -> Self {
        Self { object, value, write: false, check }
    }

    /// Judges what was read.
    ///
    /// # Errors
    /// [`Mismatch`], where it is not as it must be.
    pub fn judge(&self, found: i64) -> Result<(), Mismatch> {
        let wanted = self.value.number();
        let (good, expected) = match self.check {
            Check::Equals => (found == wanted, Expected::Equal(wanted)),
            Check::AtMost => (found <= wanted, Expected::AtMost(wanted)),
            Check::HasBits => (found & wanted == wanted, Expected::Bits(wanted)),
        };
        if good { Ok(()) } else { Err(Mismatch { object: self.object, found, expected }) }
    }
}

/// What the drive itself keeps to, whatever the frames say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnLimits {
    /// Deceleration of its ramps to a stop, position units per s².
    pub quick_stop_units_per_s2: u32,
    /// Highest speed, rpm: no frame that comes at a wrong time, or says a wrong target, makes it turn faster.
    pub max_speed_rpm: u32,
}

impl OwnLimits {
    /// The guard's limits, in the drive's units; the speed rounded up.
    pub fn of(guard: &drive::Params, units_per_rev: u32) -> Self {
        let rpm = guard.max_pulse_rate_hz * 60.0 / f64::from(units_per_rev.max(1));
        // `as` saturates.
        Self {
            quick_stop_units_per_s2: guard.quick_stop_deceleration_hz_per_s as u32,
            max_speed_rpm: rpm.ceil() as u32,
        }
    }
}

/// All steps of the bring-up in PRE-OP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    requests: Vec<Request>,
}

impl Plan {
    /// The steps for a drive at a cycle of `period_ns`, that shall keep to `limits` by itself.
    pub fn new(file: &DriveFile, period_ns: u32, limits: OwnLimits) -> Self {
        let mut requests: Vec<_> =
            file.sdos.iter().map(|sdo| Request::write(sdo.object(), sdo.value)).collect();
        let (outputs, inputs) = file.profile.pdos();
        // A terminal's PDOs are fixed: they are assigned, not mapped.
        let mapped = file.profile == Profile::Cia402Csp;
        assignment(
            &mut requests,
            objects::outputs_assignment,
            outputs,
            mapped.then(|| file.layout().outputs().collect()),
        );
        let inputs_mapping = mapped.then(|| file.layout().inputs().collect());
        assignment(&mut requests, objects::inputs_assignment, inputs, inputs_mapping);
        synchronisation(&mut requests, period_ns);
        if file.profile == Profile::Cia402Csp {
            units(&mut requests, file.units_per_rev);
            drive(&mut requests, (file.homing, file.bus_lost_cycles), period_ns, limits);
        }
        // What the file itself sets stays; what the drive lacks is passed over.
        let own = |request: &Request| file.sdos.iter().any(|sdo| sdo.object() == request.object);
        let count = file.sdos.len();
        let later = requests.split_off(count.min(requests.len()));
        requests
            .extend(later.into_iter().filter(|step| !(file.lacks(step.object) || step.write && own(step))));
        Self { requests }
    }

    /// The steps, in order.
    pub fn requests(&self) -> &[Request] {
        &self.requests
    }
}

/// What a CiA 402 drive may lack, if the drive file lists it as `absent`: settings of the bring-up, and of the process data those
/// that frames can do without.
pub fn may_be_absent() -> Vec<Object> {
    let mut requests = Vec::new();
    synchronisation(&mut requests, 1_000_000);
    units(&mut requests, 1);
    drive(
        &mut requests,
        (Homing::None, 1),
        1_000_000,
        OwnLimits { quick_stop_units_per_s2: 1, max_speed_rpm: 1 },
    );
    let of_frames = |object: &Object| Profile::Cia402Csp.needs(*object);
    let mut objects: Vec<_> = requests.iter().map(|request| request.object).chain(OPTIONAL).collect();
    objects.retain(|object| !of_frames(object));
    objects.sort_unstable();
    objects.dedup();
    objects
}

/// Empties an assignment, maps its PDO where that is wanted, and assigns it.
fn assignment(
    requests: &mut Vec<Request>,
    place: fn(u8) -> Object,
    pdo: u16,
    mapping: Option<Vec<(Object, u8)>>,
) {
    requests.push(Request::write(place(0), SdoValue::U8(0)));
    if let Some(mapping) = mapping {
        requests.push(Request::write(objects::other(pdo, 0), SdoValue::U8(0)));
        for (sub, (object, bits)) in (1..).zip(&mapping) {
            let entry = u32::from(object.index) << 16 | u32::from(object.sub) << 8 | u32::from(*bits);
            requests.push(Request::write(objects::other(pdo, sub), SdoValue::U32(entry)));
        }
        requests.push(Request::write(objects::other(pdo, 0), SdoValue::U8(mapping.len() as u8)));
    }
    requests.push(Request::write(place(1), SdoValue::U16(pdo)));
    requests.push(Request::write(place(0), SdoValue::U8(1)));
}

/// Outputs and inputs at SYNC0, in a cycle that the drive can keep.
fn synchronisation(requests: &mut Vec<Request>, period_ns: u32) {
    for outputs in [true, false] {
        let minimum = objects::minimum_cycle(outputs);
        requests.push(Request::expect(minimum, SdoValue::U32(period_ns), Check::AtMost));
        requests.push(Request::write(objects::synchronisation(outputs), SdoValue::U16(2)));
        requests.push(Request::write(objects::cycle_time(outputs), SdoValue::U32(period_ns)));
    }
}

/// A revolution of the spool has just as many units as the model has micro-steps: nothing is rounded twice.
fn units(requests: &mut Vec<Request>, units_per_rev: u32) {
    let rows = [
        (objects::ENCODER_INCREMENTS, units_per_rev),
        (objects::ENCODER_REVOLUTIONS, 1),
        (objects::GEAR_MOTOR, 1),
        (objects::GEAR_SHAFT, 1),
        (objects::FEED_UNITS, units_per_rev),
        (objects::FEED_REVOLUTIONS, 1),
    ];
    for (object, value) in rows {
        requests.push(Request::expect(object, SdoValue::U32(value), Check::Equals));
    }
}

fn drive(
    requests: &mut Vec<Request>,
    (homing, bus_lost_cycles): (Homing, u64),
    period_ns: u32,
    limits: OwnLimits,
) {
    /// Bit 7 of 0x6502: cyclic synchronous position.
    const CSP: u32 = 1 << 7;
    /// Bit 5: homing.
    const HOMING: u32 = 1 << 5;
    requests.push(Request::expect(objects::SUPPORTED_MODES, SdoValue::U32(CSP), Check::HasBits));
    if let Homing::Drive { method } = homing {
        requests.push(Request::expect(objects::SUPPORTED_MODES, SdoValue::U32(HOMING), Check::HasBits));
        requests.push(Request::write(objects::HOMING_METHOD, SdoValue::I8(method)));
    }
    requests.push(Request::write(objects::MODE, SdoValue::I8(8)));
    let (value, exponent) = interpolation_time(period_ns);
    let writes = [
        (objects::INTERPOLATION_VALUE, SdoValue::U8(value)),
        (objects::INTERPOLATION_EXPONENT, SdoValue::I8(exponent)),
        // Quick stop: the ramp of 0x6085, then switch-on disabled.
        (objects::QUICK_STOP_OPTION, SdoValue::I16(2)),
        // Disabling operation, halt: a ramp.
        (objects::other(0x605C, 0), SdoValue::I16(1)),
        (objects::other(0x605D, 0), SdoValue::I16(1)),
        // A fault, and a lost bus, which is one: the ramp of a quick stop.
        (objects::other(0x605E, 0), SdoValue::I16(2)),
        (objects::ABORT_CONNECTION, SdoValue::I16(1)),
        (objects::QUICK_STOP_DECELERATION, SdoValue::U32(limits.quick_stop_units_per_s2)),
        (objects::MAX_MOTOR_SPEED, SdoValue::U32(limits.max_speed_rpm)),
        // The controller watches the following error, with friction in mind; the drive doesn't.
        (objects::other(0x6065, 0), SdoValue::U32(u32::MAX)),
        // The count goes all the way round: limits of motion are the controller's.
        (objects::other(0x607B, 1), SdoValue::I32(i32::MIN)),
        (objects::other(0x607B, 2), SdoValue::I32(i32::MAX)),
        (objects::other(0x607D, 1), SdoValue::I32(i32::MIN)),
        (objects::other(0x607D, 2), SdoValue::I32(i32::MAX)),
        (objects::other(0x10F1, 2), SdoValue::U16(bus_lost_cycles as u16)),
    ];
    requests.extend(writes.map(|(object, value)| Request::write(object, value)));
}

/// 0x60C2: a value of 8 bits and a power of ten of a second. Periods that don't fit are given as the nearest below.
fn interpolation_time(period_ns: u32) -> (u8, i8) {
    let (mut value, mut exponent) = (period_ns, -9);
    while value > 255 || value.is_multiple_of(10) {
        value /= 10;
        exponent += 1;
    }
    (value as u8, exponent)
}

/// Watchdog registers for outputs that may be away for `limit_ns`: the divider at 0x0400 for 100 µs or less, the time at 0x0420.
pub fn watchdog_registers(limit_ns: u64) -> (u16, u16) {
    // 25 MHz over the divider and two.
    const TICK_NS: u64 = 40;
    let divider: u64 = if limit_ns > 6_000_000_000 { 0xFFFF } else { 2498 };
    let unit_ns = (divider + 2) * TICK_NS;
    (divider as u16, limit_ns.div_ceil(unit_ns).clamp(1, 0xFFFF) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive_file::Sdo;

    const LIMITS: OwnLimits = OwnLimits { quick_stop_units_per_s2: 1000, max_speed_rpm: 320 };

    pub(crate) fn file() -> DriveFile {
        DriveFile {
            name: "test".to_owned(),
            profile: Profile::Cia402Csp,
            vendor: 1,
            product: 2,
            revision_min: 3,
            units_per_rev: 112_500,
            reversed: false,
            position_is_measured: true,
            sync_shift_ns: 0,
            bus_lost_cycles: 3,
            enable_timeout_ns: 2_000_000_000,
            homing: Homing::None,
            absent: Vec::new(),
            sdos: Vec::new(),
        }
    }

    fn index_of(plan: &Plan, index: u16, sub: u8) -> Vec<usize> {
        let steps = plan.requests().iter().enumerate();
        steps.filter(|(_, step)| step.object == objects::other(index, sub)).map(|(place, _)| place).collect()
    }

    #[test]
    fn a_pdo_is_emptied_mapped_counted_and_assigned_in_this_order() {
        let plan = Plan::new(&file(), 1_000_000, LIMITS);
        let (assigned, mapped) = (index_of(&plan, 0x1C12, 0), index_of(&plan, 0x1600, 0));
        let (first, pdo) = (index_of(&plan, 0x1600, 1), index_of(&plan, 0x1C12, 1));
        assert!(assigned[0] < mapped[0] && mapped[0] < first[0] && first[0] < mapped[1]);
        assert!(mapped[1] < pdo[0] && pdo[0] < assigned[1]);
        assert_eq!(plan.requests()[first[0]].value, SdoValue::U32(0x6040_0010));
    }

    #[test]
    fn the_files_own_settings_come_first_and_stay() {
        let own = Sdo { index: 0x6007, sub: 0, value: SdoValue::I16(3) };
        let plan = Plan::new(&DriveFile { sdos: vec![own], ..file() }, 1_000_000, LIMITS);
        assert_eq!(index_of(&plan, 0x6007, 0), [0]);
        assert_eq!(plan.requests()[0].value, SdoValue::I16(3));
    }

    #[test]
    fn the_drives_own_speed_is_the_guards_rounded_up() {
        let guard = |max_pulse_rate_hz| drive::Params {
            period_s: 1e-3,
            microstep_angle_rad: 5.6e-5,
            max_pulse_rate_hz,
            max_pulse_acceleration_hz_per_s: 4e8,
            quick_stop_deceleration_hz_per_s: 1e7,
            after_stop: drive::AfterStop::Hold,
            silence_cycles: 3,
            energise_cycles: 0,
            lowest_angle_rad: None,
            highest_angle_rad: None,
            standstill_rad: 1e-3,
        };
        for (rate_hz, rpm) in [(600e3, 320), (600_001.0, 321), (1.0, 1)] {
            let limits = OwnLimits::of(&guard(rate_hz), 112_500);
            assert_eq!(limits, OwnLimits { quick_stop_units_per_s2: 10_000_000, max_speed_rpm: rpm });
        }
    }

    #[test]
    fn what_the_drive_lacks_is_passed_over() {
        let plan = Plan::new(&DriveFile { absent: vec![(0x10F1, 2)], ..file() }, 1_000_000, LIMITS);
        assert!(index_of(&plan, 0x10F1, 2).is_empty());
    }

    #[test]
    fn interpolation_times() {
        let rows = [
            (1_000_000, (1, -3)),
            (250_000, (25, -5)),
            (500_000, (5, -4)),
            (10_000_000, (1, -2)),
            (125_000, (125, -6)),
        ];
        for (period_ns, expected) in rows {
            assert_eq!(interpolation_time(period_ns), expected);
        }
    }

    #[test]
    fn values_are_judged() {
        let limit = Request::expect(objects::minimum_cycle(true), SdoValue::U32(1000), Check::AtMost);
        assert_eq!(limit.judge(1000), Ok(()));
        let error = limit.judge(1001).unwrap_err();
        assert_eq!(error.to_string(), "0x1C32:05 is 1001, expected at most 1000");
        let bits = Request::expect(objects::SUPPORTED_MODES, SdoValue::U32(0x80), Check::HasBits);
        assert!(bits.judge(0x3A5).is_ok() && bits.judge(0x25).is_err());
    }

    #[test]
    fn a_watchdog_waits_at_least_as_long_as_asked() {
        for limit_ns in [100_000, 5_000_000, 5_000_001, 52_000_000, 7_000_000_000] {
            let (divider, time) = watchdog_registers(limit_ns);
            let waits = (u64::from(divider) + 2) * 40 * u64::from(time);
            assert!(waits >= limit_ns && waits < limit_ns + 3_000_000, "{limit_ns}: {waits}");
        }
    }
}
