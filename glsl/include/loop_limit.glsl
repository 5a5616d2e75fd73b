// Whether all loops of an invocation ran to their end. lavapipe (Mesa 22.3) ends every loop of an
// invocation silently after 65 535 iterations, and from then on each loop after one iteration.
// Needs nothing.

// What a kernel writes instead of a count, or in it, if its loops were truncated; as in
// src/types.rs.
const uint LOOP_TRUNCATED = 0x80000000u;

// `step` is above zero and unknown to the compiler, which would remove the loop.
bool loops_completed(uint step) {
    uint iterations = 0u;
    for (uint i = 0u; i < 2u * step; i += step) ++iterations;
    return iterations == 2u;
}
