//! FMI 3.0 for co-simulation, as fmi3Functions.h declares it. The standard wants every function to be there, also those that
//! belong to other kinds of units.

use crate::calls;
use crate::instance::{ERROR, Instance, Log, Logger3, OK, Tell, free, with};
use crate::memory::{fill, list, put, text};
use std::ffi::{c_char, c_int, c_void};

type Handle = *mut c_void;

/// The standard's version.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// Errors are always logged, and nothing else is.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(
    _: Handle,
    _on: bool,
    _count: usize,
    _categories: *const *const c_char,
) -> c_int {
    OK
}

/// A new instance; null where it can't be made.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _events: bool,
    _early_return: bool,
    _intermediate: *const u32,
    _intermediate_count: usize,
    environment: *mut c_void,
    logger: Option<Logger3>,
    _update: Option<unsafe extern "C" fn()>,
) -> Handle {
    // SAFETY: the standard's: texts live through the call.
    let (name, token, resources) = unsafe { (text(name), text(token), text(resources)) };
    Instance::open(Log::new(name, Tell::Three(logger, environment)), token, resources)
}

/// This unit is for co-simulation.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    _name: *const c_char,
    _token: *const c_char,
    _resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _environment: *mut c_void,
    _logger: Option<Logger3>,
) -> Handle {
    std::ptr::null_mut()
}

/// This unit is for co-simulation.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _name: *const c_char,
    _token: *const c_char,
    _resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _environment: *mut c_void,
    _logger: Option<Logger3>,
    _update: Option<unsafe extern "C" fn()>,
    _lock: Option<unsafe extern "C" fn()>,
    _unlock: Option<unsafe extern "C" fn()>,
) -> Handle {
    std::ptr::null_mut()
}

/// Ends an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: Handle) {
    // SAFETY: the standard's: an instance of ours, and its last call.
    unsafe { free(instance) }
}

/// Before the start values. Times are the importer's; the valve has none of its own.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: Handle,
    _has_tolerance: bool,
    _tolerance: f64,
    _start: f64,
    _has_stop: bool,
    _stop: f64,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::nothing(instance) }
}

/// The start values are in.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(instance: Handle) -> c_int {
    // SAFETY: as above.
    unsafe { with(instance, |of| of.unit.begin()) }
}

/// As it was instantiated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(instance: Handle) -> c_int {
    // SAFETY: as above.
    unsafe { with(instance, Instance::reset) }
}

nothing_to_do! {
    fmi3Terminate: "The end of a simulation.",
    fmi3EnterEventMode: "There are no events.",
    fmi3EnterStepMode: "It always is.",
    fmi3EnterConfigurationMode: "There are no structural parameters.",
    fmi3ExitConfigurationMode: "There are no structural parameters.",
    fmi3EvaluateDiscreteStates: "There are none.",
}

/// Numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    instance: Handle,
    references: *const u32,
    count: usize,
    values: *mut f64,
    _value_count: usize,
) -> c_int {
    // SAFETY: the standard's: `count` references, room for as many values (all are scalars), an instance of ours.
    unsafe {
        with(instance, |of| {
            fill(list(references, count), values, |reference| of.unit.number_or_time(reference))
        })
    }
}

/// Sets inputs and parameters.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    instance: Handle,
    references: *const u32,
    count: usize,
    values: *const f64,
    value_count: usize,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::set_numbers(instance, references, count, values, value_count) }
}

/// Whole numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetInt64(
    instance: Handle,
    references: *const u32,
    count: usize,
    values: *mut i64,
    _value_count: usize,
) -> c_int {
    // SAFETY: as for numbers.
    unsafe {
        with(instance, |of| fill(list(references, count), values, |reference| of.unit.integer(reference)))
    }
}

no_such_variables! {
    fmi3GetFloat32(_values: *mut f32, _value_count: usize),
    fmi3GetInt8(_values: *mut i8, _value_count: usize),
    fmi3GetUInt8(_values: *mut u8, _value_count: usize),
    fmi3GetInt16(_values: *mut i16, _value_count: usize),
    fmi3GetUInt16(_values: *mut u16, _value_count: usize),
    fmi3GetInt32(_values: *mut i32, _value_count: usize),
    fmi3GetUInt32(_values: *mut u32, _value_count: usize),
    fmi3GetUInt64(_values: *mut u64, _value_count: usize),
    fmi3GetBoolean(_values: *mut bool, _value_count: usize),
    fmi3GetString(_values: *mut *const c_char, _value_count: usize),
    fmi3SetFloat32(_values: *const f32, _value_count: usize),
    fmi3SetInt8(_values: *const i8, _value_count: usize),
    fmi3SetUInt8(_values: *const u8, _value_count: usize),
    fmi3SetInt16(_values: *const i16, _value_count: usize),
    fmi3SetUInt16(_values: *const u16, _value_count: usize),
    fmi3SetInt32(_values: *const i32, _value_count: usize),
    fmi3SetUInt32(_values: *const u32, _value_count: usize),
    fmi3SetInt64(_values: *const i64, _value_count: usize),
    fmi3SetUInt64(_values: *const u64, _value_count: usize),
    fmi3SetBoolean(_values: *const bool, _value_count: usize),
    fmi3SetString(_values: *const *const c_char, _value_count: usize),
    fmi3GetBinary(_sizes: *mut usize, _values: *mut *const u8, _value_count: usize),
    fmi3SetBinary(_sizes: *const usize, _values: *const *const u8, _value_count: usize),
    fmi3GetClock(_values: *mut bool),
    fmi3SetClock(_values: *const bool),
    fmi3GetIntervalDecimal(_intervals: *mut f64, _qualifiers: *mut c_int),
    fmi3GetIntervalFraction(_counters: *mut u64, _resolutions: *mut u64, _qualifiers: *mut c_int),
    fmi3GetShiftDecimal(_shifts: *mut f64),
    fmi3GetShiftFraction(_counters: *mut u64, _resolutions: *mut u64),
    fmi3SetIntervalDecimal(_intervals: *const f64),
    fmi3SetIntervalFraction(_counters: *const u64, _resolutions: *const u64),
    fmi3SetShiftDecimal(_shifts: *const f64),
    fmi3SetShiftFraction(_counters: *const u64, _resolutions: *const u64),
    fmi3GetOutputDerivatives(_orders: *const i32, _values: *mut f64, _value_count: usize),
}

/// Keeps the state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(instance: Handle, state: *mut *mut c_void) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::get_state(instance, state) }
}

/// Goes back to a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(instance: Handle, state: *mut c_void) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::set_state(instance, state) }
}

/// Frees a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(instance: Handle, state: *mut *mut c_void) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::release_state(instance, state) }
}

/// How many bytes a state takes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(
    instance: Handle,
    state: *mut c_void,
    size: *mut usize,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::state_size(instance, state, size) }
}

/// A state as bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SerializeFMUState(
    instance: Handle,
    state: *mut c_void,
    bytes: *mut u8,
    size: usize,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::state_to_bytes(instance, state, bytes, size) }
}

/// Bytes as a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    instance: Handle,
    bytes: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> c_int {
    // SAFETY: the standard's.
    unsafe { calls::state_of_bytes(instance, bytes, size, state) }
}

/// A communication step. It is made whole, and asks for nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: Handle,
    at: f64,
    step: f64,
    _no_way_back: bool,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    reached: *mut f64,
) -> c_int {
    // SAFETY: the standard's: an instance of ours, and a place for each answer.
    unsafe {
        for flag in [event, terminate, early] {
            put(flag, false);
        }
        put(reached, at);
        with(instance, |of| {
            of.unit.step(step)?;
            put(reached, at + step);
            Ok(())
        })
    }
}

/// Nothing is discrete.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3UpdateDiscreteStates(
    instance: Handle,
    again: *mut bool,
    terminate: *mut bool,
    nominals: *mut bool,
    values: *mut bool,
    has_next: *mut bool,
    _next: *mut f64,
) -> c_int {
    // SAFETY: the standard's: an instance of ours, and a place for each answer.
    unsafe {
        for flag in [again, terminate, nominals, values, has_next] {
            put(flag, false);
        }
        with(instance, |_| Ok(()))
    }
}

not_provided! {
    fmi3GetNumberOfVariableDependencies(u32, *mut usize),
    fmi3GetVariableDependencies(u32, *mut usize, *mut u32, *mut usize, *mut c_int, usize),
    fmi3GetDirectionalDerivative(*const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize),
    fmi3GetAdjointDerivative(*const u32, usize, *const u32, usize, *const f64, usize, *mut f64, usize),
    fmi3EnterContinuousTimeMode(),
    fmi3CompletedIntegratorStep(bool, *mut bool, *mut bool),
    fmi3SetTime(f64),
    fmi3SetContinuousStates(*const f64, usize),
    fmi3GetContinuousStateDerivatives(*mut f64, usize),
    fmi3GetEventIndicators(*mut f64, usize),
    fmi3GetContinuousStates(*mut f64, usize),
    fmi3GetNominalsOfContinuousStates(*mut f64, usize),
    fmi3GetNumberOfEventIndicators(*mut usize),
    fmi3GetNumberOfContinuousStates(*mut usize),
    fmi3ActivateModelPartition(u32, f64),
}
