//! Fuzzes `stepvalve_fuzz::bus_replies`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stepvalve_fuzz::bus_replies(bytes));
