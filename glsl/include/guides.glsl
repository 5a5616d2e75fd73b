// Directions towards regions of small cells. Points outside of them are sparse and stand for much
// area. Few of their paths would find a region by chance, and each would bring too much light. So
// half of the directions aim at a region; the pdf is that of the mixture. The including shader's
// push block `push` has `guide_centres`, `guide_radii` and `guide_count`.
const float GUIDED = 0.5;
// See `CellSizes::nominal_weight`.
const float FALL = 3.0;

// Area of an entry point at a position, over that in the region with the smallest cells.
float nominal_weight(vec3 position) {
    float least = 3e38;
    for (uint i = 0u; i < guides.length(); ++i) {
        float beyond = max(0.0, distance(position, guides[i].centre) - guides[i].radius);
        least = min(least, guides[i].weight * pow(1.0 + beyond / (1.5 * guides[i].radius), FALL));
    }
    return least;
}

// Squared sine of the half-angle under which a region is seen; zero from inside.
float guide_sin2(uint guide, vec3 position) {
    vec3 towards = guides[guide].centre - position;
    float ratio = guides[guide].radius * guides[guide].radius / dot(towards, towards);
    return ratio < 0.99 ? ratio : 0.0;
}

// One less the cosine of an angle.
float one_less_cosine(float sin2) { return sin2 / (1.0 + sqrt(1.0 - sin2)); }

// Direction from a point of a surface; `weight` is cosθ/(π·pdf). Zero weight: below the surface.
vec3 guided_direction(vec3 position, vec3 normal, vec2 u, out float weight) {
    float place = u.x / GUIDED;
    u.x = place < 1.0 ? fract(place * float(guides.length())) : (u.x - GUIDED) / (1.0 - GUIDED);
    vec3 direction = frame_around(normal) * sample_cosine(u);
    if (place < 1.0) {
        uint guide = min(uint(place * float(guides.length())), guides.length() - 1u);
        float sin2 = guide_sin2(guide, position);
        if (sin2 > 0.0) {
            float z = 1.0 - u.x * one_less_cosine(sin2);
            float radius = sqrt(max(0.0, 1.0 - z * z));
            float turn = 2.0 * PI * u.y;
            direction = frame_around(normalize(guides[guide].centre - position)) * vec3(radius * cos(turn), radius * sin(turn), z);
        }
    }
    float share = GUIDED / float(guides.length());
    float unguided = 1.0;
    float pdf = 0.0;
    for (uint i = 0u; i < guides.length(); ++i) {
        float sin2 = guide_sin2(i, position);
        if (sin2 == 0.0) continue;
        unguided -= share;
        vec3 axis = normalize(guides[i].centre - position);
        vec3 across = cross(axis, direction);
        bool is_inside = dot(axis, direction) > 0.0 && dot(across, across) <= 1.0001 * sin2;
        if (is_inside) pdf += share / (2.0 * PI * one_less_cosine(sin2));
    }
    float cosine = dot(normal, direction);
    pdf += unguided * cosine / PI;
    weight = cosine > 0.0 ? cosine / (PI * pdf) : 0.0;
    return direction;
}
