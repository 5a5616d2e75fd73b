// Structs and functions of glossy surfaces. Include after types.glsl, math.glsl,
// sampling.glsl and brdf.glsl.

// An entry point that may be glossy.
struct GlossEntry {
    vec3 position;
    uint path;
    vec3 normal;     // unit, geometric, of its side
    float weight;    // its area over the mean of all
    vec3 departure;  // unit direction in which its path leaves; zero if the path ends at once
    uint material;
    uint colour;     // of the image there, packed; only in scenes with images
};

// Light of one point sample at an entry point that may be glossy.
struct GlossBeam {
    vec3 mirror;   // unit mirror direction
    float factor;  // irradiance per unit of the light's emission, see light_factor for units
};

// A path vertex in a cluster that may be glossy.
struct GlossVertex {
    uint material;
    uint contribution;  // its index; UNWEIGHTED: accessibility does not weight it
};
const uint UNWEIGHTED = 0x80000000u;

// One outgoing direction of one cluster.
struct GlossBin {
    uint cluster;
    vec3 direction;  // unit: the mean direction of its readers
};

// In the spare component of a gather target's radiance: the target is a cell of the sky.
const float IS_SKY_CELL = 1.0;

// Fraction of the reflected light that the lobe reflects, in the channel where it is largest.
float gloss_fraction(Reflectance material) {
    vec3 fractions = material.specular / max(material.diffuse + material.specular, vec3(1e-6));
    return max(fractions.x, max(fractions.y, fractions.z));
}

// Fraction up to which an error of the lobe's light is small beside the diffuse light.
const float LITTLE = 0.4;

// Whether records bring the lobe's light to a pixel, instead of rays from the pixel.
// `exponents` holds the largest exponent of such lobes: of those with little of the reflected light
// in bits 0-15, of others in bits 16-31. Mirrors `BroadLobes` in src/passes/frame/gloss_records.rs.
bool is_broad(Reflectance material, uint exponents) {
    // Without a division, which devices round differently.
    bool is_little = all(lessThanEqual(material.specular, LITTLE * (material.diffuse + material.specular)));
    return has_lobe(material) && material.exponent <= float(is_little ? exponents & 0xffffu : exponents >> 16);
}

// Number of vertices that estimate the lobe's outgoing light well enough; 0: all are needed.
// Mirrors `vertices_for` in src/passes/frame/gloss.rs.
uint vertices_for(Reflectance material) {
    float excess = max(1.0, gloss_fraction(material) / 0.25);
    bool is_little = material.exponent <= 100.0 && excess * 0.25 <= LITTLE;
    return is_little ? uint(ceil(4.0 * excess * excess * sqrt(material.exponent + 1.0))) : 0u;
}
