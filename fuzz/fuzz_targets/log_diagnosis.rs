//! Fuzzes `stepvalve_fuzz::log_diagnosis`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stepvalve_fuzz::log_diagnosis(bytes));
