//! Fuzzes `stepvalve_fuzz::text_table`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stepvalve_fuzz::text_table(bytes));
