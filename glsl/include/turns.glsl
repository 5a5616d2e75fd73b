// Whether an invocation may trust what its loops did: lavapipe ends all loops of one, without a word, once they have turned 65 535
// times, and from then on none turns twice. Needs nothing.

// What a kernel writes where it may not, instead of a count or in it; as in src/types.rs.
const uint CUT_SHORT = 0x80000000u;

// `step` is above zero, and nothing that the compiler knows: it would do without the loop.
bool loops_still_turn(uint step) {
    uint turns = 0u;
    for (uint i = 0u; i < 2u * step; i += step) ++turns;
    return turns == 2u;
}
