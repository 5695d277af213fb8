//! Fuzzes `stepvalve_fuzz::message_check`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stepvalve_fuzz::message_check(bytes));
