// What the passes of glossy surfaces share. Include after types.glsl, math.glsl, sampling.glsl and
// brdf.glsl.

// An entry point that may be glossy.
struct GlossEntry {
    vec3 position;
    uint path;
    vec3 normal;     // unit, geometric, of its side
    float weight;    // its area over the mean of all
    vec3 departure;  // unit direction in which its path leaves; zero where that ends at once
    uint material;
    uint colour;     // of the image there, packed; only in scenes with images
};

// Light that arrives at such an entry point from one point sample of a light.
struct GlossBeam {
    vec3 mirror;   // unit direction in which a mirror would send it on
    float factor;  // irradiance per unit of the light's emission, see light_factor for units
};

// A path vertex in a cluster that may be glossy.
struct GlossVertex {
    vec3 mirror;    // unit direction in which a mirror would send its light on; idle at entry points
    uint material;
    uint entry;     // at an entry point that may be glossy: its index
};

// One outgoing direction of one cluster.
struct GlossSlot {
    uint cluster;
    vec3 direction;  // unit: the mean of those from which it is read
};

const uint NO_ENTRY = 0xffffffffu;

// Fraction of what a material reflects that its lobe does, in the channel where that is the most.
float gloss_fraction(Reflectance material) {
    vec3 fractions = material.specular / max(material.diffuse + material.specular, vec3(1e-6));
    return max(fractions.x, max(fractions.y, fractions.z));
}

// Fraction up to which a surface has a little gloss only: an error of what its lobe sends is small
// beside what it sends by its albedo.
const float LITTLE = 0.4;

// How many vertices tell well enough what a material's lobe sends; 0: all are needed. Mirrors
// `vertices_for` in src/passes/frame/gloss.rs.
uint vertices_for(Reflectance material) {
    float excess = max(1.0, gloss_fraction(material) / 0.25);
    bool is_little = material.exponent <= 100.0 && excess * 0.25 <= LITTLE;
    return is_little ? uint(ceil(4.0 * excess * excess * sqrt(material.exponent + 1.0))) : 0u;
}

// π times the Phong lobe's share of the BRDF.
vec3 lobe_share(Reflectance material, vec3 mirror, vec3 toward) {
    return material.specular * (0.5 * (material.exponent + 2.0) * phong_lobe(mirror, toward, material.exponent));
}
