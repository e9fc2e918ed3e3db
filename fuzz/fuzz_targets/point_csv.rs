//! `phiw_fuzz_entry::point_csv` for cargo fuzz.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| phiw_fuzz_entry::point_csv(bytes));
