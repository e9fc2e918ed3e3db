//! `phiw_fuzz_entry::motion` for cargo fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| phiw_fuzz_entry::motion(bytes));
