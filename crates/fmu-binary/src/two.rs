//! FMI 2.0 for co-simulation, as fmi2Functions.h declares it.

use crate::instance::{DISCARD, ERROR, Instance, Log, Logger2, OK, Tell, free, none_of_this_type, with};
use crate::memory::{fill, free_state, keep_state, kept_state, list, put, text};
use fmu::{Snapshot, UnitError};
use std::ffi::{c_char, c_double, c_int, c_uint, c_void};

/// fmi2CoSimulation.
const CO_SIMULATION: c_int = 1;
/// fmi2LastSuccessfulTime.
const LAST_SUCCESSFUL_TIME: c_int = 2;

/// fmi2CallbackFunctions.
#[repr(C)]
pub struct Callbacks {
    logger: Option<Logger2>,
    allocate: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    free: Option<unsafe extern "C" fn(*mut c_void)>,
    step_finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    environment: *mut c_void,
}

type Component = *mut c_void;

/// The platform's types.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// The standard's version.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// Errors are always logged, and nothing else is.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(
    _: Component,
    _on: c_int,
    _count: usize,
    _categories: *const *const c_char,
) -> c_int {
    OK
}

/// A new instance; null where it can't be made.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resources: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> Component {
    if kind != CO_SIMULATION {
        return std::ptr::null_mut();
    }
    // SAFETY: the standard's: callbacks live as long as the instance, texts through the call.
    let (callbacks, name, guid, resources) =
        unsafe { (callbacks.as_ref(), text(name), text(guid), text(resources)) };
    let tell =
        callbacks.map_or(Tell::Two(None, std::ptr::null_mut()), |of| Tell::Two(of.logger, of.environment));
    Instance::open(Log::new(name, tell), guid, resources)
}

/// Ends an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(instance: Component) {
    // SAFETY: the standard's: an instance of ours, and its last call.
    unsafe { free(instance) }
}

/// Times are the importer's; the valve has none of its own.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    instance: Component,
    _has_tolerance: c_int,
    _tolerance: c_double,
    _start: c_double,
    _has_stop: c_int,
    _stop: c_double,
) -> c_int {
    // SAFETY: the standard's: an instance of ours, in no other call.
    unsafe { with(instance, |_| Ok(())) }
}

/// Before the start values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(instance: Component) -> c_int {
    // SAFETY: as above.
    unsafe { with(instance, |_| Ok(())) }
}

/// The start values are in.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(instance: Component) -> c_int {
    // SAFETY: as above.
    unsafe { with(instance, |of| of.unit.begin()) }
}

/// The end of a simulation.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(instance: Component) -> c_int {
    // SAFETY: as above.
    unsafe { with(instance, |_| Ok(())) }
}

/// As it was instantiated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(instance: Component) -> c_int {
    // SAFETY: as above.
    unsafe { with(instance, Instance::reset) }
}

/// Numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(
    instance: Component,
    references: *const c_uint,
    count: usize,
    values: *mut c_double,
) -> c_int {
    // SAFETY: the standard's: `count` references, room for `count` values, an instance of ours.
    unsafe { with(instance, |of| fill(list(references, count), values, |reference| of.unit.real(reference))) }
}

/// Whole numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(
    instance: Component,
    references: *const c_uint,
    count: usize,
    values: *mut c_int,
) -> c_int {
    let narrow = |value: i64| value.clamp(i64::from(c_int::MIN), i64::from(c_int::MAX)) as c_int;
    // SAFETY: as for numbers.
    unsafe {
        with(instance, |of| {
            fill(list(references, count), values, |reference| of.unit.integer(reference).map(narrow))
        })
    }
}

/// Truth values, of which there are none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBoolean(
    instance: Component,
    references: *const c_uint,
    count: usize,
    _values: *mut c_int,
) -> c_int {
    // SAFETY: as for numbers.
    unsafe { none_of_this_type(instance, references, count) }
}

/// Texts, of which there are none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetString(
    instance: Component,
    references: *const c_uint,
    count: usize,
    _values: *mut *const c_char,
) -> c_int {
    // SAFETY: as for numbers.
    unsafe { none_of_this_type(instance, references, count) }
}

/// Sets inputs and parameters.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    instance: Component,
    references: *const c_uint,
    count: usize,
    values: *const c_double,
) -> c_int {
    // SAFETY: the standard's: `count` references and values, an instance of ours.
    unsafe {
        with(instance, |of| {
            let pairs = list(references, count).iter().zip(list(values, count));
            pairs.into_iter().try_for_each(|(reference, value)| of.unit.set_real(*reference, *value))
        })
    }
}

/// Whole numbers are outputs: none can be set.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetInteger(
    instance: Component,
    references: *const c_uint,
    count: usize,
    _values: *const c_int,
) -> c_int {
    // SAFETY: as for numbers.
    unsafe { none_of_this_type(instance, references, count) }
}

/// Truth values, of which there are none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetBoolean(
    instance: Component,
    references: *const c_uint,
    count: usize,
    _values: *const c_int,
) -> c_int {
    // SAFETY: as for numbers.
    unsafe { none_of_this_type(instance, references, count) }
}

/// Texts, of which there are none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetString(
    instance: Component,
    references: *const c_uint,
    count: usize,
    _values: *const *const c_char,
) -> c_int {
    // SAFETY: as for numbers.
    unsafe { none_of_this_type(instance, references, count) }
}

/// Keeps the state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(instance: Component, state: *mut *mut c_void) -> c_int {
    // SAFETY: the standard's: null, a pointer at null, or at a state of ours.
    unsafe {
        with(instance, |of| {
            keep_state(state, of.unit.snapshot());
            Ok(())
        })
    }
}

/// Goes back to a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(instance: Component, state: *mut c_void) -> c_int {
    // SAFETY: the standard's: a state of ours.
    unsafe { with(instance, |of| of.unit.restore(kept_state(state)?)) }
}

/// Frees a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(instance: Component, state: *mut *mut c_void) -> c_int {
    // SAFETY: as for keeping it.
    unsafe {
        with(instance, |_| {
            free_state(state);
            Ok(())
        })
    }
}

/// How many bytes a state takes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(
    instance: Component,
    state: *mut c_void,
    size: *mut usize,
) -> c_int {
    // SAFETY: the standard's: a state of ours, and a place for its size.
    unsafe {
        with(instance, |_| {
            put(size, kept_state(state)?.to_bytes()?.len());
            Ok(())
        })
    }
}

/// A state as bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    instance: Component,
    state: *mut c_void,
    bytes: *mut u8,
    size: usize,
) -> c_int {
    // SAFETY: the standard's: a state of ours, and room for `size` bytes.
    unsafe { with(instance, |_| write_state(kept_state(state)?, bytes, size)) }
}

/// Bytes as a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    instance: Component,
    bytes: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> c_int {
    // SAFETY: the standard's: `size` bytes, and a place for a state.
    unsafe {
        with(instance, |_| {
            keep_state(state, Snapshot::of_bytes(list(bytes, size))?);
            Ok(())
        })
    }
}

/// Writes a state's bytes where they find room.
///
/// # Safety
/// `place` is null or has room for `size` bytes.
pub unsafe fn write_state(state: &Snapshot, place: *mut u8, size: usize) -> Result<(), UnitError> {
    let bytes = state.to_bytes()?;
    if place.is_null() || bytes.len() > size {
        return Err(UnitError::State);
    }
    // SAFETY: there is room for all bytes, which are our own and elsewhere.
    unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), place, bytes.len()) };
    Ok(())
}

/// Not provided, as the description says.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetDirectionalDerivative(
    _: Component,
    _unknowns: *const c_uint,
    _unknown_count: usize,
    _knowns: *const c_uint,
    _known_count: usize,
    _known: *const c_double,
    _unknown: *mut c_double,
) -> c_int {
    ERROR
}

/// Not provided, as the description says.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetRealInputDerivatives(
    _: Component,
    _references: *const c_uint,
    _count: usize,
    _orders: *const c_int,
    _values: *const c_double,
) -> c_int {
    ERROR
}

/// Not provided, as the description says.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetRealOutputDerivatives(
    _: Component,
    _references: *const c_uint,
    _count: usize,
    _orders: *const c_int,
    _values: *mut c_double,
) -> c_int {
    ERROR
}

/// A communication step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(
    instance: Component,
    _at: c_double,
    step: c_double,
    _no_way_back: c_int,
) -> c_int {
    // SAFETY: the standard's: an instance of ours, in no other call.
    unsafe { with(instance, |of| of.unit.step(step)) }
}

/// No step runs on.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2CancelStep(_: Component) -> c_int {
    ERROR
}

/// No step runs on.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetStatus(_: Component, _kind: c_int, _value: *mut c_int) -> c_int {
    DISCARD
}

/// The time that was reached.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(instance: Component, kind: c_int, value: *mut c_double) -> c_int {
    if kind != LAST_SUCCESSFUL_TIME {
        return DISCARD;
    }
    // SAFETY: the standard's: an instance of ours, and a place for the time.
    unsafe {
        with(instance, |of| {
            put(value, of.unit.time_s());
            Ok(())
        })
    }
}

/// No step runs on.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetIntegerStatus(_: Component, _kind: c_int, _value: *mut c_int) -> c_int {
    DISCARD
}

/// No step runs on.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetBooleanStatus(_: Component, _kind: c_int, _value: *mut c_int) -> c_int {
    DISCARD
}

/// No step runs on.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetStringStatus(_: Component, _kind: c_int, _value: *mut *const c_char) -> c_int {
    DISCARD
}
