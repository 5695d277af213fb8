//! Entries that are there because the standard wants them, many of a kind.

/// Defines calls that change nothing of a valve.
macro_rules! nothing_to_do {
    ($($name:ident: $about:literal),+ $(,)?) => {$(
        #[doc = $about]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(instance: *mut c_void) -> c_int {
            // SAFETY: the standard's: an instance of ours, in no other call.
            unsafe { calls::nothing(instance) }
        }
    )+};
}

/// Defines calls on variables of types that no variable has: so many references, and arguments that nobody looks at.
macro_rules! no_such_variables {
    ($($name:ident($($argument:ident: $kind:ty),*)),+ $(,)?) => {$(
        /// There are no variables of this type to get or to set.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            instance: *mut c_void,
            references: *const u32,
            count: usize,
            $($argument: $kind),*
        ) -> c_int {
            // SAFETY: the standard's: `count` references, an instance of ours.
            unsafe { calls::none_of_this_type(instance, references, count) }
        }
    )+};
}

/// Defines what this unit doesn't provide, as its description says.
macro_rules! not_provided {
    ($($name:ident($($kind:ty),*)),+ $(,)?) => {$(
        /// Not provided, as the description says.
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(_: *mut c_void $(, _: $kind)*) -> c_int {
            ERROR
        }
    )+};
}
