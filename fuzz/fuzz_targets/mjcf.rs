//! `phiw_fuzz_entry::mjcf` for cargo fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| phiw_fuzz_entry::mjcf(bytes));
