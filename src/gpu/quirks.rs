//! Quirks of drivers that the host works around: one entry each, with driver, version, symptom and
//! how it was seen. `glsl/include/quirks.glsl` has those of kernels.

/// Iterations of all loops of an invocation together.
///
/// lavapipe (Mesa 22.3.6) silently ends every loop after them (`glsl/include/quirks.glsl`).
/// Constants of passes bound the work of an invocation on every device, because a dispatch with
/// more would also take too long.
pub const MAX_LOOP_ITERATIONS: u32 = 65_535;

/// Whether timestamps wait for a barrier first.
///
/// Once lavapipe (Mesa 22.3.6) has drawn to a window, it takes a timestamp only when it next
/// executes its commands: a pass of one dispatch seemed to take no time
/// (`docs/decisions/window.md`). A barrier executes them. Other devices do not wait.
pub(super) fn delays_timestamps(has_window: bool, is_cpu: bool) -> bool {
    has_window && is_cpu
}

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
