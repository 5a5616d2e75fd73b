#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    lightpaths_fuzz::luminaire(bytes);
});
