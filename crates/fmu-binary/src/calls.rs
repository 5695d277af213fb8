//! What both versions of the standard call alike.

use crate::instance::with;
use crate::memory::{free_state, keep_state, kept_state, list, put};
use fmu::{Snapshot, UnitError};
use std::ffi::{c_int, c_void};

/// A call that changes nothing of a valve.
///
/// # Safety
/// As for [`with`].
pub unsafe fn nothing(instance: *mut c_void) -> c_int {
    // SAFETY: the caller's promise.
    unsafe { with(instance, |_| Ok(())) }
}

/// A call on variables of a type of which this unit has none: nothing was asked, or an error.
///
/// # Safety
/// As for [`with`]; `references` points at `count` of them.
pub unsafe fn none_of_this_type(instance: *mut c_void, references: *const u32, count: usize) -> c_int {
    // SAFETY: the caller's promise.
    let references = unsafe { list(references, count) };
    // SAFETY: the caller's promise.
    unsafe { with(instance, |_| references.first().map_or(Ok(()), |one| Err(UnitError::Unknown(*one)))) }
}

/// Sets inputs and parameters.
///
/// # Safety
/// As for [`with`]; so many references and values are there.
pub unsafe fn set_numbers(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const f64,
    value_count: usize,
) -> c_int {
    // SAFETY: the caller's promise.
    let (references, values) = unsafe { (list(references, count), list(values, value_count)) };
    let mut pairs = references.iter().zip(values);
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |of| pairs.try_for_each(|(reference, value)| of.unit.set_real(*reference, *value)))
    }
}

/// Keeps the state.
///
/// # Safety
/// As for [`with`] and [`keep_state`].
pub unsafe fn get_state(instance: *mut c_void, state: *mut *mut c_void) -> c_int {
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |of| {
            keep_state(state, of.unit.snapshot());
            Ok(())
        })
    }
}

/// Goes back to a state.
///
/// # Safety
/// As for [`with`] and [`kept_state`].
pub unsafe fn set_state(instance: *mut c_void, state: *mut c_void) -> c_int {
    // SAFETY: the caller's promise.
    unsafe { with(instance, |of| of.unit.restore(kept_state(state)?)) }
}

/// Frees a state.
///
/// # Safety
/// As for [`with`] and [`free_state`].
pub unsafe fn release_state(instance: *mut c_void, state: *mut *mut c_void) -> c_int {
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |_| {
            free_state(state);
            Ok(())
        })
    }
}

/// How many bytes a state takes.
///
/// # Safety
/// As for [`with`] and [`kept_state`]; `size` is null or a place for it.
pub unsafe fn state_size(instance: *mut c_void, state: *mut c_void, size: *mut usize) -> c_int {
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |_| {
            put(size, kept_state(state)?.to_bytes()?.len());
            Ok(())
        })
    }
}

/// A state as bytes.
///
/// # Safety
/// As for [`with`] and [`kept_state`]; `place` is null or has room for `size` bytes.
pub unsafe fn state_to_bytes(
    instance: *mut c_void,
    state: *mut c_void,
    place: *mut u8,
    size: usize,
) -> c_int {
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |_| {
            let bytes = kept_state(state)?.to_bytes()?;
            if place.is_null() || bytes.len() > size {
                return Err(UnitError::State);
            }
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), place, bytes.len());
            Ok(())
        })
    }
}

/// Bytes as a state.
///
/// # Safety
/// As for [`with`] and [`keep_state`]; `bytes` points at `size` of them.
pub unsafe fn state_of_bytes(
    instance: *mut c_void,
    bytes: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> c_int {
    // SAFETY: the caller's promise.
    unsafe {
        with(instance, |_| {
            keep_state(state, Snapshot::of_bytes(list(bytes, size))?);
            Ok(())
        })
    }
}
