// Rays from glossy pixels into their Phong lobes.

// A ray from a glossy pixel, as the frame reads it under a still camera.
struct GlossRay {
    uint target;     // cluster | material << cluster_bits; NO_TARGET where the ray left the scene
    float weight;    // (n+2)/(n+1)·cosθ
    uint direction;  // unit direction back towards the pixel, octahedral, two 16-bit integers
    uint gloss_bin;       // gloss bin with the lobe's outgoing flux of the surface there; NO_GLOSS_BIN: the flux comes from its vertices
};

const uint NO_GLOSS_BIN = 0xffffffffu;

// The part of a pixel for which a sample stands. The mirror direction turns by `across` from the
// sample to the right border of the part, and by `down` to the lower one.
struct GlossPart {
    vec3 across;
    vec3 down;
    float weight;  // in the mean over the pixel
};

// Glossy radiance of a pixel, W/m²/sr.
struct PixelGloss {
    vec3 direct;    // of light straight from the lights
    vec3 indirect;  // of light from surfaces
};

// A broad lobe at a record. [Krivanek]
struct GlossRecord {
    vec3 radiance;  // per unit of specular albedo, W/m²/sr
    vec3 mirror;    // unit mirror direction of the camera
    mat3 change;    // column c: gradient of channel c as the mirror direction turns
    float unused;   // to whole texels
};

GlossRecord gloss_record_at(usamplerBuffer list, uint index) {
    int first = int(4u * index);
    vec4 a = numbers(texelFetch(list, first));
    vec4 b = numbers(texelFetch(list, first + 1));
    vec4 c = numbers(texelFetch(list, first + 2));
    vec4 d = numbers(texelFetch(list, first + 3));
    return GlossRecord(a.xyz, vec3(a.w, b.xy), mat3(b.zw, c, d.xyz), 0.0);
}

// Rays from each sample of a glossy pixel.
const uint LOBE_RAYS = 4u;

// The glossy pixels of a view, in the order of their list, and the samples of each.
struct GlossCounts {
    uvec2 pixels;   // those with a lobe that takes rays, then the others
    uvec2 samples;  // of each such pixel
};

// Samples within the capacity. Rays are noisier than light from records. Pixels with rays therefore
// take what the others leave after one sample each, if that is more than an equal part.
GlossCounts gloss_counts(uint traced, uint all, uint most, uint capacity) {
    uvec2 pixels = uvec2(traced, all - traced);
    uint equal = capacity / max(all, 1u);
    uint left = (capacity - min(pixels.y, capacity)) / max(traced, 1u);
    uint of_traced = min(most, max(equal, left));
    uint of_others = (capacity - min(traced * of_traced, capacity)) / max(pixels.y, 1u);
    return GlossCounts(pixels, uvec2(of_traced, min(most, of_others)));
}

uint sample_count(GlossCounts counts) { return counts.pixels.x * counts.samples.x + counts.pixels.y * counts.samples.y; }

// A sample's number in its pixel; the pixel's place in the list; its number of samples.
uvec3 owner_of_sample(GlossCounts counts, uint index) {
    uint traced = counts.pixels.x * counts.samples.x;
    if (index < traced) return uvec3(in_rows(index, counts.samples.x), counts.samples.x);
    return uvec3(in_rows(index - traced, counts.samples.y) + uvec2(0u, counts.pixels.x), counts.samples.y);
}

// First sample of a pixel in the list, and the end.
uvec2 samples_of_pixel(GlossCounts counts, uint place) {
    bool is_traced = place < counts.pixels.x;
    uint samples = is_traced ? counts.samples.x : counts.samples.y;
    uint first = is_traced ? place * samples : counts.pixels.x * counts.samples.x + (place - counts.pixels.x) * samples;
    return uvec2(first, first + samples);
}

uint pack_direction(vec3 direction) {
    vec3 d = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    vec2 signs = vec2(d.x >= 0.0 ? 1.0 : -1.0, d.y >= 0.0 ? 1.0 : -1.0);
    return packSnorm2x16(d.z >= 0.0 ? d.xy : (1.0 - abs(d.yx)) * signs);
}

vec3 unpack_direction(uint word) {
    vec2 p = unpackSnorm2x16(word);
    float z = 1.0 - abs(p.x) - abs(p.y);
    vec2 signs = vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return normalize(vec3(z >= 0.0 ? p : (1.0 - abs(p.yx)) * signs, z));
}
