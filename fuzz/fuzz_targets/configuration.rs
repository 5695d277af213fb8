//! Fuzzes `stepvalve_fuzz::configuration`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stepvalve_fuzz::configuration(bytes));
