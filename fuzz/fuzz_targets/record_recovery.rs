//! Fuzzes `stepvalve_fuzz::record_recovery`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stepvalve_fuzz::record_recovery(bytes));
