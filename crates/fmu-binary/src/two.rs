//! FMI 2.0 for co-simulation, as fmi2Functions.h declares it.

use crate::calls;
use crate::instance::{DISCARD, ERROR, Instance, Log, Logger2, OK, Tell, free, with};
use crate::memory::{fill, list, put, text};
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
    // SAFETY: the standard's.
    unsafe { calls::nothing(instance) }
}

/// The start values are in.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(instance: Component) -> c_int {
    // SAFETY: as above.
    unsafe { with(instance, |of| of.unit.begin()) }
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

/// Sets inputs and parameters.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    instance: Component,
    references: *const c_uint,
    count: usize,
    values: *const c_double,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::set_numbers(instance, references, count, values, count) }
}

/// Keeps the state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(instance: Component, state: *mut *mut c_void) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::get_state(instance, state) }
}

/// Goes back to a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(instance: Component, state: *mut c_void) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::set_state(instance, state) }
}

/// Frees a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(instance: Component, state: *mut *mut c_void) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::release_state(instance, state) }
}

/// How many bytes a state takes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(
    instance: Component,
    state: *mut c_void,
    size: *mut usize,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::state_size(instance, state, size) }
}

/// A state as bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    instance: Component,
    state: *mut c_void,
    bytes: *mut u8,
    size: usize,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::state_to_bytes(instance, state, bytes, size) }
}

/// Bytes as a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    instance: Component,
    bytes: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::state_of_bytes(instance, bytes, size, state) }
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

nothing_to_do! {
    fmi2EnterInitializationMode: "Before the start values.",
    fmi2Terminate: "The end of a simulation.",
}

no_such_variables! {
    fmi2GetBoolean(_values: *mut c_int),
    fmi2GetString(_values: *mut *const c_char),
    fmi2SetInteger(_values: *const c_int),
    fmi2SetBoolean(_values: *const c_int),
    fmi2SetString(_values: *const *const c_char),
}

not_provided! {
    fmi2GetDirectionalDerivative(*const c_uint, usize, *const c_uint, usize, *const c_double, *mut c_double),
    fmi2SetRealInputDerivatives(*const c_uint, usize, *const c_int, *const c_double),
    fmi2GetRealOutputDerivatives(*const c_uint, usize, *const c_int, *mut c_double),
    fmi2CancelStep(),
}
