//! Quirks of drivers that the device layer works around.

/// Maximum of [`unused_bytes`].
pub(super) const MAX_UNUSED_BYTES: u64 = 256;

/// Number of unused bytes at the end of a buffer.
///
/// llvmpipe (Mesa 22.3.6) treats texel buffers like images. It compiles a shader again if the size
/// of one becomes a power of two, or if the second byte of that size becomes zero: that byte is
/// where images have their last level of detail. The added bytes keep every size free of both.
pub(super) const fn unused_bytes(bytes: u64) -> u64 {
    match bytes {
        _ if bytes & 0xff00 == 0 => MAX_UNUSED_BYTES,
        _ if bytes.is_power_of_two() => 16,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::buffer::MIN_BYTES;
    use super::*;

    #[test]
    fn no_size_is_a_power_of_two_or_has_a_zero_as_second_byte() {
        let powers = (4..40).map(|power| 1_u64 << power);
        let near_powers =
            powers.flat_map(|power| (0..=64).map(move |step| (power + 16 * step).saturating_sub(512)));
        for bytes in (16..1 << 18).step_by(16).chain(near_powers.filter(|&bytes| bytes >= MIN_BYTES)) {
            let unused = unused_bytes(bytes);
            let size = bytes + unused;
            assert!(unused <= MAX_UNUSED_BYTES && unused.is_multiple_of(16), "{bytes}");
            assert!(size & 0xff00 != 0 && !size.is_power_of_two(), "{bytes}");
        }
    }
}
