// Light sources seen from a surface point. Include after types.glsl, texels.glsl, math.glsl and
// bvh.glsl. The including shader binds the texels `Lights`.

// A direction in which a light may be seen.
struct LightSample {
    vec3 direction;   // unit, towards the light
    float distance;   // metres; LIGHT_FAR for a directional light, 0 if the light has no direction here
    vec3 irradiance;  // of a facing surface, before visibility, over the sample's pdf, W/m²
};

const float LIGHT_FAR = 1e30;

// Fraction of a spot's intensity in a unit direction of travel; linear in the angle between
// the two half-angles.
float spot_falloff(LightSource light, vec3 direction) {
    // The arc cosine loses half its digits near the axis.
    float angle = atan(length(cross(light.axis, direction)), dot(light.axis, direction));
    if (angle <= light.inner_angle) return 1.0;
    return angle < light.outer_angle ? (light.outer_angle - angle) / (light.outer_angle - light.inner_angle) : 0.0;
}

// Fraction of a measured spot's largest intensity in a unit direction of travel: bilinear between
// the nodes of its grid. At the light's first word are the numbers of nodes from the axis and
// about it, the azimuth of the plane C0, and the first word of the fractions, which lights of one
// file have in common. As Grid in src/scene/luminaire.
float measured_fraction(LightSource light, vec3 direction) {
    uint first = uint(light.area);
    vec3 local = direction * frame_around(light.axis);
    float angle = atan(length(local.xy), local.z);
    if (angle > light.outer_angle) return 0.0;
    uint rows = uint(number_at(Lights, first));
    uint columns = uint(number_at(Lights, first + 1u));
    float row = angle / light.outer_angle * float(rows - 1u);
    uint low = min(uint(row), rows - 2u);
    // Horizontal angles increase clockwise for someone who looks along the axis.
    float turn = (number_at(Lights, first + 2u) - atan(local.y, local.x)) / (2.0 * PI);
    float column = (turn - floor(turn)) * float(columns);
    uint left = min(uint(column), columns - 1u);
    uint right = left + 1u == columns ? 0u : left + 1u;
    uvec2 node = uint(number_at(Lights, first + 3u)) + uvec2(left, right) * rows + low;
    vec2 near = vec2(number_at(Lights, node.x), number_at(Lights, node.y));
    vec2 far = vec2(number_at(Lights, node.x + 1u), number_at(Lights, node.y + 1u));
    vec2 of_columns = mix(near, far, row - float(low));
    return mix(of_columns.x, of_columns.y, column - float(left));
}

// Fraction of a spot's intensity in a unit direction of travel.
float spot_fraction(LightSource light, vec3 direction) {
    if (light.area > 0.0) return measured_fraction(light, direction);
    return spot_falloff(light, direction);
}

// Image of `u` in the unit square, on the triangle (0,0), (1,0), (0,1) if the light is one. Keeps
// equal areas equal.
vec2 on_shape(LightSource light, vec2 u) {
    if ((light.shape & SHAPE_TRIANGLE) == 0u) return u;
    float root = sqrt(u.x);
    return vec2(1.0 - root, u.y * root);
}

// Cosine at an area light that emits in a direction; zero if that side does not emit.
float emitted_cosine(LightSource light, vec3 direction) {
    float cosine = dot(light.axis, direction);
    return (light.shape & SHAPE_TWO_SIDED) != 0u ? abs(cosine) : max(0.0, cosine);
}

// Unit direction towards a point of a part of the sky, uniform over its solid angle.
vec3 sky_direction(LightSource light, vec2 u) {
    float azimuth = light.edge_u.x + u.x * light.edge_u.y;
    float height = light.edge_u.z + u.y * light.outer_angle;
    float radius = sqrt(max(0.0, 1.0 - height * height));
    return vec3(radius * sin(azimuth), height, -radius * cos(azimuth));
}

// Samples a light as seen from `position`; `u` selects the point of an area light, uniformly, and
// is unused for other kinds. Returns false if the light does not reach that point. The irradiance
// is unbounded towards the light, but finite.
bool sample_light(LightSource light, vec3 position, vec2 u, out LightSample found) {
    if (light.kind == LIGHT_DIRECTIONAL) {
        found = LightSample(-light.axis, LIGHT_FAR, light.emission);
        return true;
    }
    if (light.kind == LIGHT_SKY) {
        found = LightSample(sky_direction(light, u), LIGHT_FAR, light.area * light.emission);
        return true;
    }
    found = LightSample(vec3(0.0), 0.0, vec3(0.0));
    u = on_shape(light, u);
    vec3 to_light = light.position + u.x * light.edge_u + u.y * light.edge_v - position;
    float distance2 = dot(to_light, to_light);
    // A light on the receiver itself has no direction.
    if (!(distance2 > 1e-24)) return false;
    float inverse = inversesqrt(distance2);
    vec3 direction = to_light * inverse;
    float factor = 1.0;
    if (light.kind == LIGHT_SPOT) factor = spot_fraction(light, -direction);
    if (light.kind == LIGHT_AREA) factor = light.area * emitted_cosine(light, -direction);
    found = LightSample(direction, distance2 * inverse, light.emission * (factor * inverse * inverse));
    return factor > 0.0;
}

#ifdef SAMPLES_OF_PIXEL
// The image points of a pixel each see a light by samples of their own, so that a pixel has many
// and an image point few. Together they are a lattice, and each of its sets is one, too. The
// functions are those below. `modulus` of a light is the number of the set, `stride` the step of
// the whole.

// Number of sets; one for a light of so few samples that it may stand for a curved surface, which
// its corners leave. As in src/passes/lattice.rs.
uint sample_sets(LightSource light) { return light.samples < 4u ? 1u : 16u; }

uint lattice_row(LightSource light, uint i) {
    uint sets = sample_sets(light);
    return (light.modulus + sets * i) * light.stride % (sets * light.samples);
}

uint next_row(LightSource light, uint row) {
    uint sets = sample_sets(light);
    uint next = row + sets * (light.stride % light.samples);
    return next < sets * light.samples ? next : next - sets * light.samples;
}

vec2 lattice_place(LightSource light, uint i, uint row) {
    uint sets = sample_sets(light);
    return (vec2(light.modulus + sets * i, row) + 0.5) / float(sets * light.samples);
}

// The light with the samples of image point `number` of a pixel. `step`: of the whole lattice.
LightSource seen_from_point(LightSource light, uint number, uint step) {
    // All samples if they are few; as in src/passes/lattice.rs.
    light.samples = max(min(light.samples, 8u), (light.samples + 3u) / 4u);
    light.stride = step;
    light.modulus = number % sample_sets(light);
    return light;
}
#else
uint sample_sets(LightSource light) { return 1u; }

// Point samples of a light form a lattice with one in every row and every column. `lattice_row`
// returns the row of sample `i`, counted with the rows that the lattice leaves out ahead of the
// first; `next_row` returns that of the next sample without a division.
uint lattice_row(LightSource light, uint i) { return (i + light.modulus - light.samples) * light.stride % light.modulus; }

uint next_row(LightSource light, uint row) {
    uint next = row + light.stride;
    return next < light.modulus ? next : next - light.modulus;
}

vec2 lattice_place(LightSource light, uint i, uint row) { return (vec2(i, row + light.samples - light.modulus) + 0.5) / float(light.samples); }

// Point sample number `i` of a light, for sample_light.
vec2 lattice_point(LightSource light, uint i) { return lattice_place(light, i, lattice_row(light, i)); }
#endif

// From a surface point, on the side that `normal` faces, to a light.
Ray shadow_ray(vec3 position, vec3 normal, LightSample light) {
    vec3 origin = offset_origin(position, normal);
    // To infinity, or to the sampled point of the light: the offset origin turns the ray.
    if (light.distance >= LIGHT_FAR) return Ray(origin, light.direction, LIGHT_FAR);
    return Ray(origin, position + light.distance * light.direction - origin, 0.99999);
}

// Whether nothing stands between the point and the light.
bool is_lit(vec3 position, vec3 normal, LightSample light) {
    Hit hit;
    return !trace(shadow_ray(position, normal, light), true, hit);
}
