// Quirks of drivers that kernels work around, one entry each: driver, version, symptom, how it was
// seen. `src/gpu/quirks.rs` has those of the host. Needs no other include.
//
// No entry has a specialisation constant. Elsewhere the first costs an invocation some ten
// instructions after its rays, and the second is a branch. The third follows from the type of a
// binding, which no constant changes. Constants of the host limit the work of an invocation.

// Iteration limit. lavapipe (Mesa 22.3.6) ends every loop of an invocation silently after 65 535
// iterations in total, and each later loop after one iteration. Seen: the path tracer lost 93 % of
// the light in a sphere of albedo 0.99 (docs/decisions/path-tracer.md). Kernels that trace rays
// test at their end whether their loops completed.

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

// Branches. lavapipe (Mesa 22.3.6) executes the body of a branch for all lanes of a group, even if
// none takes it, but skips the body of a loop. Seen in its machine code, and as time of rays that
// no lane needs. A branch with a costly body is a loop of at most one iteration.
#define if_any(condition) for (bool is_due = (condition); is_due; is_due = false)

// Loads from storage. lavapipe (Mesa 22.3.6) loads a structure word by word, each in a loop over
// the lanes. Seen in its machine code; figures in docs/decisions/buffers.md. Lists that a kernel
// only reads are bound as texels of four words: texels.glsl.
