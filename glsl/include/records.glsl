// Validity of a record at a surface point: the error metric of irradiance caching. [Tabellion]

// Cosine of the angle up to which facets share records. At that angle the hidden part of the
// other's hemisphere is at most (1 - cos)/2, a twentieth.
const float FACETS_ALIKE = 0.9;

// sin² of 1°: a point at less than 1° from a record's plane is on its surface, however narrow
// the record's surroundings.
const float FLAT_SINE2 = 0.0003;

// Tolerances of a record in height and normals.
struct Tolerance {
    float above2;                // above the plane between both, over the distance, squared
    float below2;                // below it
    float facets;                // cosine between facets
    float inverse_normal_error;  // 1 / sqrt(1 - cos) of the angle between normals
    float behind;                // factor of its weight behind its nearest occluder plane
};
// Valid records: 10° between normals, 12° above the plane and 4° below it. A lower point may
// be in the shadow of the record's own support, as a table is under the rim of a plate.
// [Tabellion §4; Ward]
const Tolerance VALID = Tolerance(0.04, 0.004, FACETS_ALIKE, 8.1131, 0.0);
// Relaxed validity, where valid records are few: 45° above the plane, 30° below it, 90° between
// facets, 72° between normals. On thin or curved surface a record that faces elsewhere says more
// than a distant one, or one in a crack.
const Tolerance RELAXED = Tolerance(0.5, 0.25, 0.0, 1.2, 0.1);

// Height of a point at offset d from a record above the plane between both. Shading normals give
// zero on a sphere, facets give zero on a facet whose shading normals lean.
float height_between(vec3 d, vec3 n, vec3 facet, CachePoint record) {
    vec2 heights = 0.5 * vec2(dot(d, record.normal + n), dot(d, record.facet + facet));
    return abs(heights.x) < abs(heights.y) ? heights.x : heights.y;
}

// Sum of weights below which relaxed records join the valid ones: a record in a crack is valid, and
// says little of what is outside.
const float MIN_WEIGHT = 0.1;

// Weight of a record at position x with shading normal n, on a facet with that geometric normal:
// positive inside its validity, 1 at its centre. Zero for points far in front of or behind the
// record's plane, which are on another surface. Zero for points behind the nearest occluder plane,
// where the view of the scene differs; a relaxed record keeps a part there, because a plane goes on
// where its occluder ends. Zero for points further off the record's plane than half the distance to
// that occluder: cloth in front of the record's surface, or the spine of a book beside the crevice
// of the record. Radii have a lower bound, so that few records cover all surface. Beyond the radius
// without that bound, half of the clearance, the weight falls with the distance.
float record_weight(vec3 x, vec3 n, vec3 facet, CachePoint record, Tolerance tolerance) {
    vec3 d = x - record.position;
    float distance2 = dot(d, d);
    float height = height_between(d, n, facet, record);
    float reach = 0.01 * record.radius;
    float height2 = height > 0.0 ? tolerance.above2 : tolerance.below2;
    if (height * height > height2 * (distance2 + reach * reach)) return 0.0;
    float part = dot(d, record.occluder) > 1.0 ? tolerance.behind : 1.0;
    bool is_beyond = height * height * dot(record.occluder, record.occluder) > 0.25;
    if (is_beyond && height * height > FLAT_SINE2 * distance2) return 0.0;
    if (dot(facet, record.facet) < tolerance.facets) return 0.0;
    float position_error = sqrt(distance2) / record.radius;
    float normal_error = sqrt(max(0.0, 1.0 - dot(n, record.normal))) * tolerance.inverse_normal_error;
    return part * (1.0 - max(position_error, normal_error)) / max(1.0, sqrt(distance2) * record.inverse_reach);
}
