//! FMI 3.0 for co-simulation, as fmi3Functions.h declares it. The standard wants every function to be there, also those that
//! belong to other kinds of units.

use crate::instance::{ERROR, Instance, Log, Logger3, OK, Tell, free, none_of_this_type, with};
use crate::memory::{fill, free_state, keep_state, kept_state, list, put, text};
use crate::two::write_state;
use fmu::Snapshot;
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
    // SAFETY: the standard's: an instance of ours, in no other call.
    unsafe { with(instance, |_| Ok(())) }
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

/// Defines calls that change nothing of a valve.
macro_rules! nothing_to_do {
    ($($name:ident: $about:literal),+ $(,)?) => {$(
        #[doc = $about]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(instance: Handle) -> c_int {
            // SAFETY: the standard's: an instance of ours, in no other call.
            unsafe { with(instance, |_| Ok(())) }
        }
    )+};
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
    // SAFETY: the standard's: so many references and values, an instance of ours.
    unsafe {
        with(instance, |of| {
            let pairs = list(references, count).iter().zip(list(values, value_count));
            pairs.into_iter().try_for_each(|(reference, value)| of.unit.set_real(*reference, *value))
        })
    }
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

/// Defines calls on variables of types that no variable has.
macro_rules! no_such_variables {
    ($($name:ident: $value:ty),+ $(,)?) => {$(
        /// There are no variables of this type to get or to set.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            instance: Handle,
            references: *const u32,
            count: usize,
            _values: $value,
            _value_count: usize,
        ) -> c_int {
            // SAFETY: the standard's: `count` references, an instance of ours.
            unsafe { none_of_this_type(instance, references, count) }
        }
    )+};
}

no_such_variables! {
    fmi3GetFloat32: *mut f32,
    fmi3GetInt8: *mut i8,
    fmi3GetUInt8: *mut u8,
    fmi3GetInt16: *mut i16,
    fmi3GetUInt16: *mut u16,
    fmi3GetInt32: *mut i32,
    fmi3GetUInt32: *mut u32,
    fmi3GetUInt64: *mut u64,
    fmi3GetBoolean: *mut bool,
    fmi3GetString: *mut *const c_char,
    fmi3SetFloat32: *const f32,
    fmi3SetInt8: *const i8,
    fmi3SetUInt8: *const u8,
    fmi3SetInt16: *const i16,
    fmi3SetUInt16: *const u16,
    fmi3SetInt32: *const i32,
    fmi3SetUInt32: *const u32,
    fmi3SetInt64: *const i64,
    fmi3SetUInt64: *const u64,
    fmi3SetBoolean: *const bool,
    fmi3SetString: *const *const c_char,
}

/// Defines calls on clocks and binaries: so many references, and arguments that nobody looks at.
macro_rules! no_such_variables_either {
    ($($name:ident($($argument:ident: $kind:ty),*)),+ $(,)?) => {$(
        /// There are no variables of this type to get or to set.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            instance: Handle,
            references: *const u32,
            count: usize,
            $($argument: $kind),*
        ) -> c_int {
            // SAFETY: the standard's: `count` references, an instance of ours.
            unsafe { none_of_this_type(instance, references, count) }
        }
    )+};
}

no_such_variables_either! {
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
pub unsafe extern "C" fn fmi3SetFMUState(instance: Handle, state: *mut c_void) -> c_int {
    // SAFETY: the standard's: a state of ours.
    unsafe { with(instance, |of| of.unit.restore(kept_state(state)?)) }
}

/// Frees a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(instance: Handle, state: *mut *mut c_void) -> c_int {
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
pub unsafe extern "C" fn fmi3SerializedFMUStateSize(
    instance: Handle,
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
pub unsafe extern "C" fn fmi3SerializeFMUState(
    instance: Handle,
    state: *mut c_void,
    bytes: *mut u8,
    size: usize,
) -> c_int {
    // SAFETY: the standard's: a state of ours, and room for `size` bytes.
    unsafe { with(instance, |_| write_state(kept_state(state)?, bytes, size)) }
}

/// Bytes as a state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DeserializeFMUState(
    instance: Handle,
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

/// Defines what this unit doesn't provide, as its description says.
macro_rules! not_provided {
    ($($name:ident($($kind:ty),*)),+ $(,)?) => {$(
        /// Not provided, as the description says.
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(_: Handle $(, _: $kind)*) -> c_int {
            ERROR
        }
    )+};
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
