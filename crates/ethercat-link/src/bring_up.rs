//! From whatever state to SAFE-OP with SYNC0 on our grid: identity, every SDO read back, watchdog, process data, clock.

use crate::error::{BringUpError, Step};
use crate::main_device::Grid;
use ethercrab::subdevice_group::{PreOp, SubDeviceGroup};
use ethercrab::{DefaultLock, MainDevice, SubDevice, SubDeviceGroupHandle, SubDeviceRef};
use fieldbus::objects::Object;
use fieldbus::{DriveFile, Plan, SdoValue, fit_rate, watchdog_registers};
use realtime::told_time;

/// No bus of a valve has more devices.
const DEVICES: usize = 16;
/// No drive's process data are longer, bytes.
const PROCESS_DATA: usize = 128;

/// The devices of a bus in PRE-OP.
pub(crate) type Group = SubDeviceGroup<DEVICES, PROCESS_DATA, DefaultLock, PreOp>;

/// Registers of the SubDevice controller (ETG.1000.4).
mod register {
    pub(super) const AL_CONTROL: u16 = 0x0120;
    pub(super) const AL_STATUS: u16 = 0x0130;
    pub(super) const AL_CODE: u16 = 0x0134;
    pub(super) const WATCHDOG_DIVIDER: u16 = 0x0400;
    pub(super) const WATCHDOG_TIME: u16 = 0x0420;
    pub(super) const SYSTEM_TIME: u16 = 0x0910;
    pub(super) const SYNC_ACTIVATION: u16 = 0x0981;
    pub(super) const SYNC_START: u16 = 0x0990;
    pub(super) const SYNC0_CYCLE: u16 = 0x09A0;
}

/// SYNC0 begins so long after it was set, ns: the frames until then have time to go.
const SYNC_LEAD_NS: u64 = 30_000_000;
/// So long the two clocks are compared, ns.
const COMPARE_NS: u64 = 30_000_000;

/// What a bring-up needs to know.
#[derive(Debug, Clone)]
pub(crate) struct Wanted {
    pub(crate) file: DriveFile,
    pub(crate) plan: Plan,
    pub(crate) grid: Grid,
    /// How long the device may be without outputs, ns.
    pub(crate) watchdog_ns: u64,
}

/// A device in SAFE-OP.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BroughtUp {
    pub(crate) station: u16,
    /// The bus's time at a SYNC0, ns.
    pub(crate) sync0_ns: u64,
    /// How much faster the bus's clock runs than ours.
    pub(crate) rate: f64,
}

/// Brings the one drive on the bus to SAFE-OP.
pub(crate) async fn bring_up(
    main: &'static MainDevice<'static>,
    wanted: Wanted,
) -> Result<BroughtUp, BringUpError> {
    let group = init(main, |device| check_identity(device, &wanted.file)).await?;
    if group.len() != 1 {
        return Err(BringUpError::Count { found: group.len(), expected: 1 });
    }
    {
        let device =
            group.subdevice(main, 0).map_err(|error| BringUpError::Bus { step: Step::Init, error })?;
        for request in wanted.plan.requests() {
            if request.write {
                write(&device, request.object, request.value).await?;
            }
            let found = read(&device, request.object, request.value, request.write).await?;
            request.judge(found)?;
        }
    }
    let of_registers = |error| BringUpError::Bus { step: Step::Registers, error };
    let of_data = |error| BringUpError::Bus { step: Step::ProcessData, error };
    let group = group.into_pre_op_pdi(main).await.map_err(of_data)?;
    let device = group.subdevice(main, 0).map_err(of_data)?;
    let sizes = (device.outputs_raw().len(), device.inputs_raw().len());
    check_sizes(&wanted.file, sizes)?;
    if !device.dc_support().any() {
        return Err(BringUpError::NoClock);
    }
    let (divider, time) = watchdog_registers(wanted.watchdog_ns);
    for (register, value) in [(register::WATCHDOG_DIVIDER, divider), (register::WATCHDOG_TIME, time)] {
        device.register_write(register, value).await.map_err(of_registers)?;
        let found: u16 = device.register_read(register).await.map_err(of_registers)?;
        if found != value {
            return Err(BringUpError::Register { register, found: found.into(), expected: value.into() });
        }
    }
    let (sync0_ns, rate) = start_sync0(&device, &wanted).await.map_err(of_registers)?;
    to_safe_op(&device).await?;
    Ok(BroughtUp { station: device.configured_address(), sync0_ns, rate })
}

/// Gives addresses, reads SII, and goes to PRE-OP with those whom `check` lets pass.
pub(crate) async fn init(
    main: &'static MainDevice<'static>,
    check: impl Fn(&SubDevice) -> Result<(), BringUpError>,
) -> Result<Group, BringUpError> {
    let mut refused = None;
    let filtered = main
        .init::<DEVICES, _>(told_time, Group::default(), |group, device| match check(device) {
            Ok(()) => Ok(group as &dyn SubDeviceGroupHandle),
            Err(error) => {
                refused = Some(error);
                Err(ethercrab::error::Error::UnknownSubDevice)
            }
        })
        .await;
    match (filtered, refused) {
        (_, Some(error)) => Err(error),
        (Ok(group), None) => Ok(group),
        // Several devices that ethercrab can't make a line of.
        (Err(ethercrab::error::Error::Topology), None) => {
            Err(BringUpError::Count { found: main.num_subdevices(), expected: 1 })
        }
        (Err(error), None) => Err(BringUpError::Bus { step: Step::Init, error }),
    }
}

fn check_identity(device: &SubDevice, file: &DriveFile) -> Result<(), BringUpError> {
    let found = device.identity();
    let wrong =
        |what, found, expected, at_least| Err(BringUpError::Identity { what, found, expected, at_least });
    if found.vendor_id != file.vendor {
        return wrong("vendor", found.vendor_id, file.vendor, false);
    }
    if found.product_id != file.product {
        return wrong("product", found.product_id, file.product, false);
    }
    if found.revision < file.revision_min {
        return wrong("revision", found.revision, file.revision_min, true);
    }
    Ok(())
}

fn check_sizes(file: &DriveFile, (outputs, inputs): (usize, usize)) -> Result<(), BringUpError> {
    let expected = file.layout().sizes();
    for (what, found, expected) in [("outputs", outputs, expected.0), ("inputs", inputs, expected.1)] {
        if found != expected {
            return Err(BringUpError::Size { what, found, expected });
        }
    }
    Ok(())
}

async fn write<S: core::ops::Deref<Target = SubDevice>>(
    device: &SubDeviceRef<'_, S>,
    object: Object,
    value: SdoValue,
) -> Result<(), BringUpError> {
    let Object { index, sub } = object;
    let written = match value {
        SdoValue::U8(value) => device.sdo_write(index, sub, value).await,
        SdoValue::U16(value) => device.sdo_write(index, sub, value).await,
        SdoValue::U32(value) => device.sdo_write(index, sub, value).await,
        SdoValue::I8(value) => device.sdo_write(index, sub, value).await,
        SdoValue::I16(value) => device.sdo_write(index, sub, value).await,
        SdoValue::I32(value) => device.sdo_write(index, sub, value).await,
    };
    written.map_err(|error| BringUpError::Sdo { object, write: true, expected: value.number(), error })
}

async fn read<S: core::ops::Deref<Target = SubDevice>>(
    device: &SubDeviceRef<'_, S>,
    object: Object,
    like: SdoValue,
    write: bool,
) -> Result<i64, BringUpError> {
    let Object { index, sub } = object;
    let found = match like {
        SdoValue::U8(_) => device.sdo_read::<u8>(index, sub).await.map(i64::from),
        SdoValue::U16(_) => device.sdo_read::<u16>(index, sub).await.map(i64::from),
        SdoValue::U32(_) => device.sdo_read::<u32>(index, sub).await.map(i64::from),
        SdoValue::I8(_) => device.sdo_read::<i8>(index, sub).await.map(i64::from),
        SdoValue::I16(_) => device.sdo_read::<i16>(index, sub).await.map(i64::from),
        SdoValue::I32(_) => device.sdo_read::<i32>(index, sub).await.map(i64::from),
    };
    found.map_err(|error| BringUpError::Sdo { object, write, expected: like.number(), error })
}

/// A look at the bus's clock: our time and the bus's, and how long the look took.
#[derive(Debug, Clone, Copy)]
struct Sample {
    trip_ns: u64,
    pair: (u64, u64),
}

/// How much faster the bus's clock runs than ours, and the surest pair. A look that took long was interrupted somewhere, and says
/// little.
fn compare(samples: &[Sample]) -> Option<(f64, (u64, u64))> {
    /// Looks longer by this than the shortest don't count, ns.
    const SLACK_NS: u64 = 20_000;
    /// No crystal on a bus is off by more.
    const MAX_RATE: f64 = 500e-6;
    let surest = samples.iter().rev().min_by_key(|sample| sample.trip_ns)?;
    let pairs: Vec<_> = samples
        .iter()
        .filter(|sample| sample.trip_ns <= surest.trip_ns + SLACK_NS)
        .map(|sample| sample.pair)
        .collect();
    Some((fit_rate(&pairs).clamp(-MAX_RATE, MAX_RATE), surest.pair))
}

/// Compares the clocks, and starts SYNC0 where our cycles begin: the bus's time at a SYNC0, and the rate of its clock.
async fn start_sync0<S>(
    device: &SubDeviceRef<'_, S>,
    wanted: &Wanted,
) -> Result<(u64, f64), ethercrab::error::Error> {
    device.register_write(register::SYNC_ACTIVATION, 0_u8).await?;
    let mut samples: Vec<Sample> = Vec::new();
    let began = told_time();
    while told_time() < began + COMPARE_NS && samples.len() < 1000 {
        let before = told_time();
        let system: u64 = device.register_read(register::SYSTEM_TIME).await?;
        let trip_ns = told_time() - before;
        samples.push(Sample { trip_ns, pair: (before + trip_ns / 2, system) });
    }
    let (rate, (ours, system)) = compare(&samples).unwrap_or((0.0, (began, began)));
    let begin = wanted.grid.next(told_time() + SYNC_LEAD_NS);
    let ahead = begin.saturating_sub(ours) as f64 * (1.0 + rate);
    let sync0_ns = system + ahead.round() as u64 + u64::from(wanted.file.sync_shift_ns);
    device.register_write(register::SYNC0_CYCLE, wanted.grid.period_ns).await?;
    device.register_write(register::SYNC_START, sync0_ns).await?;
    // Cyclic operation, SYNC0.
    device.register_write(register::SYNC_ACTIVATION, 0x03_u8).await?;
    Ok((sync0_ns, rate))
}

/// Asks for SAFE-OP; a refusal comes with its code.
async fn to_safe_op<S>(device: &SubDeviceRef<'_, S>) -> Result<(), BringUpError> {
    const SAFE_OP: u16 = 0x04;
    const LIMIT_NS: u64 = 3_000_000_000;
    let step = Step::SafeOp;
    let of_bus = |error| BringUpError::Bus { step, error };
    device.register_write(register::AL_CONTROL, SAFE_OP).await.map_err(of_bus)?;
    let began = told_time();
    loop {
        let al_status: u16 = device.register_read(register::AL_STATUS).await.map_err(of_bus)?;
        if al_status & 0x1F == SAFE_OP {
            return Ok(());
        }
        if al_status & 0x10 != 0 || told_time() > began + LIMIT_NS {
            let al_code: u16 = device.register_read(register::AL_CODE).await.map_err(of_bus)?;
            return Err(BringUpError::State { step, al_status, al_code });
        }
    }
}
