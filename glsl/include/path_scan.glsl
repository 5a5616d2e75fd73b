// Segmented product of the light-path energy scan, shared by its three kernels.
// Include after texels.glsl.

const uint BLOCK_STEPS = 1024u;  // per workgroup, whose invocations share them

// One step of a light path: the factor from the energy of the vertex before to that of this one.
struct PathStep {
    uint material;  // that reflected the path towards this vertex; HEAD where the path starts here, FROM_ENTRY where an entry
                    // point that may be glossy did: its reflection depends on the light
    float weight;   // cosθ/(π·pdf) over the survival probability; at the head, the path's own weight
    uint contribution;      // index of the vertex's contribution
};
const uint HEAD = 0xffffffffu;
const uint FROM_ENTRY = 0xfffffffeu;

PathStep path_step_at(usamplerBuffer list, uint index) {
    uvec3 words = triple_at(list, index);
    return PathStep(words.x, uintBitsToFloat(words.y), words.z);
}

// Product of steps since the last path start among them.
struct Segment {
    vec3 product;
    uint has_head;
};

// `first` followed by `second`: a path start in `second` discards `first`. Associative.
Segment join(Segment first, Segment second) {
    return second.has_head != 0u ? second : Segment(first.product * second.product, first.has_head);
}
