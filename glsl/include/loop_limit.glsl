// Detects truncated loops. lavapipe (Mesa 22.3.6) ends every loop of an invocation silently after
// 65 535 iterations in total, and each later loop after one iteration. Needs no other include.

// A kernel writes this instead of a count, or as a bit of it, if its loops were truncated;
// as in src/types.rs.
const uint LOOP_TRUNCATED = 0x80000000u;

// Whether all loops of the invocation ran to their end. `step` is above zero and unknown to the
// compiler, which would otherwise remove the loop.
bool loops_completed(uint step) {
    uint iterations = 0u;
    for (uint i = 0u; i < 2u * step; i += step) ++iterations;
    return iterations == 2u;
}
