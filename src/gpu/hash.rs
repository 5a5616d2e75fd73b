//! FNV-1a, shared by the build script and the interface test. It detects changes and does not
//! resist an attacker.

/// The 64-bit FNV-1a hash of `bytes`, as 16 hexadecimal digits.
pub fn fnv1a(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}
