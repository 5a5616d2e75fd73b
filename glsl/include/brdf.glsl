// Reflection: Lambert plus the energy-normalised modified Phong lobe ρ_s (n+2)/(2π) cosⁿα, α the
// angle to the mirror direction. [Lafortune 1994] Directions are unit and point away from the
// surface. Include after types.glsl, math.glsl and sampling.glsl.

float luminance(vec3 rgb) { return dot(rgb, vec3(0.2126, 0.7152, 0.0722)); }

// cosⁿα, zero from 90° on, of x = 1 - cosα: the cosine itself has no digits left where a narrow
// lobe varies.
float phong_lobe(float x, float exponent) {
    float logarithm = x < 0.02 ? -x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + 0.25 * x))) : log(max(1.0 - x, 1e-30));
    return x < 1.0 ? exp(exponent * logarithm) : 0.0;
}

// 1 - cosα between two unit directions, from their difference.
float off_mirror(vec3 mirror, vec3 direction) {
    vec3 apart = mirror - direction;
    return 0.5 * dot(apart, apart);
}

float phong_lobe(vec3 mirror, vec3 direction, float exponent) {
    return phong_lobe(off_mirror(mirror, direction), exponent);
}

bool has_lobe(Reflectance material) { return any(greaterThan(material.specular, vec3(0.0))); }

// π times the BRDF, for a direction whose 1 - cosα off the mirror direction is x: the albedo,
// where there is no lobe.
vec3 reflected_fraction(Reflectance material, float x) {
    return material.diffuse + material.specular * (0.5 * (material.exponent + 2.0) * phong_lobe(x, material.exponent));
}

// BRDF, 1/sr, of light from `incident` that leaves along `outgoing`; zero for light from below the
// surface.
vec3 brdf(Reflectance material, vec3 normal, vec3 outgoing, vec3 incident) {
    if (dot(normal, incident) <= 0.0) return vec3(0.0);
    return reflected_fraction(material, off_mirror(reflect(-outgoing, normal), incident)) * (1.0 / PI);
}

// A direction around `mirror`, of density (n+1)/(2π)·cosⁿα.
vec3 sample_phong_lobe(vec3 mirror, float exponent, vec2 u) {
    float azimuth = 2.0 * PI * u.y;
    // 1 - cosα, in terms that do not cancel in narrow lobes.
    float power = log(max(1.0 - u.x, 1e-8)) / (exponent + 1.0);
    float height = power > -0.02 ? -power * (1.0 + power * (0.5 + power * (1.0 / 6.0 + power / 24.0))) : 1.0 - exp(power);
    return frame_around(mirror) * vec3(sqrt(height * (2.0 - height)) * vec2(cos(azimuth), sin(azimuth)), 1.0 - height);
}

// A direction that light may have come from.
struct BrdfSample {
    vec3 incident;
    float pdf;    // 1/sr
    vec3 weight;  // brdf·cosθ/pdf; zero below the surface
};

// Samples one of the two lobes, chosen by luminance, with the pdf of their mixture.
BrdfSample sample_brdf(Reflectance material, vec3 normal, vec3 outgoing, vec2 u) {
    float gloss = luminance(material.specular);
    float total = gloss + luminance(material.diffuse);
    if (total <= 0.0) return BrdfSample(normal, 1.0 / PI, vec3(0.0));
    float fraction = gloss / total;  // of the Phong lobe
    bool is_phong = u.x < fraction;
    // Rescales the subinterval that selected the lobe to the unit interval.
    float v = is_phong ? u.x / fraction : (u.x - fraction) / (1.0 - fraction);
    vec3 mirror = reflect(-outgoing, normal);
    vec3 incident = is_phong ? sample_phong_lobe(mirror, material.exponent, vec2(v, u.y))
                             : frame_around(normal) * sample_cosine(vec2(min(v, 1.0), u.y));
    float cosine = dot(normal, incident);
    float lobe = phong_lobe(mirror, incident, material.exponent);
    float pdf = (1.0 - fraction) * max(cosine, 0.0) / PI + fraction * lobe * (material.exponent + 1.0) / (2.0 * PI);
    bool is_above = cosine > 0.0 && pdf > 0.0;
    vec3 reflected = material.diffuse / PI + material.specular * (lobe * (material.exponent + 2.0) / (2.0 * PI));
    return BrdfSample(incident, pdf, is_above ? reflected * (cosine / max(pdf, 1e-30)) : vec3(0.0));
}
