//! Pointers of the importer's as slices, texts and places.

use fmu::{Snapshot, UnitError};
use std::ffi::{CStr, c_char, c_void};

/// An array that the importer handed over; empty where it is none.
///
/// # Safety
/// `first` is null or points at `count` values that live through the call.
pub unsafe fn list<'a, T>(first: *const T, count: usize) -> &'a [T] {
    if first.is_null() || count == 0 {
        return &[];
    }
    // SAFETY: the caller's promise; null was turned away.
    unsafe { std::slice::from_raw_parts(first, count) }
}

/// A text that the importer handed over; empty where it is none or no UTF-8.
///
/// # Safety
/// `text` is null or ends with a zero, and lives through the call.
pub unsafe fn text<'a>(text: *const c_char) -> &'a str {
    if text.is_null() {
        return "";
    }
    // SAFETY: the caller's promise; null was turned away.
    unsafe { CStr::from_ptr(text) }.to_str().unwrap_or("")
}

/// Puts values, one for each reference, where the importer wants them.
///
/// # Safety
/// `place` has room for as many values as there are references.
pub unsafe fn fill<T>(
    references: &[u32],
    place: *mut T,
    value: impl Fn(u32) -> Result<T, UnitError>,
) -> Result<(), UnitError> {
    for (index, reference) in references.iter().enumerate() {
        let value = value(*reference)?;
        // SAFETY: index is below the number of references, for which the caller promised room.
        unsafe { put(place.wrapping_add(index), value) };
    }
    Ok(())
}

/// Puts a value where the importer wants it, if it does.
///
/// # Safety
/// `place` is null or has room for the value.
pub unsafe fn put<T>(place: *mut T, value: T) {
    if !place.is_null() {
        // SAFETY: the caller's promise; what was there is plain data or nothing, so nothing has to be dropped.
        unsafe { place.write(value) };
    }
}

/// Keeps a state where `place` points: anew, or over the state that is there.
///
/// # Safety
/// `place` is null, or points at null or at a state that an earlier call put there and nobody freed.
pub unsafe fn keep_state(place: *mut *mut c_void, state: Snapshot) {
    if place.is_null() {
        return;
    }
    // SAFETY: not null, so it points at a pointer.
    let there = unsafe { place.read() };
    // SAFETY: the caller's promise: null, or a state of ours.
    match unsafe { there.cast::<Snapshot>().as_mut() } {
        Some(kept) => *kept = state,
        // SAFETY: as above, `place` may be written to.
        None => unsafe { place.write(Box::into_raw(Box::new(state)).cast()) },
    }
}

/// The state that an earlier call kept.
///
/// # Safety
/// `state` is null or was put there by [`keep_state`], and nobody freed it.
pub unsafe fn kept_state<'a>(state: *mut c_void) -> Result<&'a Snapshot, UnitError> {
    // SAFETY: the caller's promise.
    unsafe { state.cast::<Snapshot>().as_ref() }.ok_or(UnitError::State)
}

/// Frees the state that `place` points at, and makes that null.
///
/// # Safety
/// As for [`keep_state`].
pub unsafe fn free_state(place: *mut *mut c_void) {
    if place.is_null() {
        return;
    }
    // SAFETY: not null, so it points at a pointer, which is taken and replaced by null: it is freed once.
    let state = unsafe { place.replace(std::ptr::null_mut()) };
    if !state.is_null() {
        // SAFETY: made by Box::into_raw in `keep_state`.
        drop(unsafe { Box::from_raw(state.cast::<Snapshot>()) });
    }
}
