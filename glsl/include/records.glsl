// How far a cache record speaks for a surface point: the error metric of irradiance caching. [Tabellion]

// 1 / sqrt(1 - cos 10°): the normal that turned by ten degrees is the edge of validity.
const float INVERSE_NORMAL_ERROR = 8.1131;

// Cosine of the angle up to which facets share records: what one sees beyond the horizon of the other is then at most
// (1 - cos)/2, a twentieth of its hemisphere.
const float FACETS_ALIKE = 0.9;

// Geometric normal of a side.
vec3 facet_of(Surface surface, uint side) { return (side & 1u) != 0u ? -surface.normal : surface.normal; }

// Weight of a record at position x with shading normal n, on a facet with that geometric normal: positive inside its validity, 1
// at its centre.
// Points in front of or behind the record's plane lie on another surface and get none; nor do points behind the nearest
// wall, from where the world looks different however near they are.
float record_weight(vec3 x, vec3 n, vec3 facet, CachePoint record) {
    vec3 d = x - record.position;
    float distance2 = dot(d, d);
    float height = dot(d, record.normal);
    float reach = 0.01 * record.radius;
    if (height * height > 0.1 * (distance2 + reach * reach) || dot(d, record.wall) > 1.0) return 0.0;
    if (dot(facet, record.facet) < FACETS_ALIKE) return 0.0;
    float position_error = sqrt(distance2) / record.radius;
    float normal_error = sqrt(max(0.0, 1.0 - dot(n, record.normal))) * INVERSE_NORMAL_ERROR;
    return 1.0 - max(position_error, normal_error);
}
