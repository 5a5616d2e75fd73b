// How far a cache record speaks for a surface point: the error metric of irradiance caching.
// [Tabellion]

// Cosine of the angle up to which facets share records: what one sees beyond the horizon of the
// other is then at most (1 - cos)/2, a twentieth of its hemisphere.
const float FACETS_ALIKE = 0.9;

// What lies less than 1° over or under a record's plane is of its surface, however narrow the place
// is that the record stands in.
const float FLAT_SINE2 = 0.0003;

// How far from its own a point may lie, in height and normals, that a record speaks for.
struct Tolerance {
    float above2;                // over the plane between both, of the distance, squared
    float below2;                // under it
    float facets;                // cosine between facets
    float inverse_normal_error;  // 1 / sqrt(1 - cos) of the angle between normals
};
// What a record is valid for: 10° between normals, 12° over the plane and 4° under it: who lies
// lower may lie in the shadow of what the record stands on, as a table does under the rim of a
// plate. [Tabellion §4; Ward]
const Tolerance VALID = Tolerance(0.04, 0.004, FACETS_ALIKE, 8.1131);
// Where no other record does: 45° over the plane, 30° under it, 60° between facets, 30° between
// normals.
const Tolerance RELAXED = Tolerance(0.5, 0.25, 0.5, 2.7321);

// Height of a point, by d from a record, over the plane between both: by shading normals none on a
// sphere, by facets none on a facet whose shading normals lean.
float height_between(vec3 d, vec3 n, vec3 facet, CachePoint record) {
    vec2 heights = 0.5 * vec2(dot(d, record.normal + n), dot(d, record.facet + facet));
    return abs(heights.x) < abs(heights.y) ? heights.x : heights.y;
}

// Weight of a record at position x with shading normal n, on a facet with that geometric normal:
// positive inside its validity, 1 at its centre. Points in front of or behind the record's plane
// lie on another surface and get none; nor do points behind the nearest wall, from where the world
// looks different however near they are, and those further off its plane than half of the way to
// that wall: cloth that hangs before the record's surface, the spine of a book beside the crevice
// that the record is in.
float record_weight(vec3 x, vec3 n, vec3 facet, CachePoint record, Tolerance tolerance) {
    vec3 d = x - record.position;
    float distance2 = dot(d, d);
    float height = height_between(d, n, facet, record);
    float reach = 0.01 * record.radius;
    float height2 = height > 0.0 ? tolerance.above2 : tolerance.below2;
    if (height * height > height2 * (distance2 + reach * reach) || dot(d, record.wall) > 1.0) return 0.0;
    bool is_beyond = height * height * dot(record.wall, record.wall) > 0.25;
    if (is_beyond && height * height > FLAT_SINE2 * distance2) return 0.0;
    if (dot(facet, record.facet) < tolerance.facets) return 0.0;
    float position_error = sqrt(distance2) / record.radius;
    float normal_error = sqrt(max(0.0, 1.0 - dot(n, record.normal))) * tolerance.inverse_normal_error;
    return 1.0 - max(position_error, normal_error);
}
