// Structs and functions of the near-light correction; they mirror src/passes/frame/near_lights.rs.
// A light closer to a surface than the spacing of entry points lights an area between them. Rays
// from the light sample that area, and the entry points around share the light of each hit.

// A ray from the light.
struct NearRay {
    vec3 direction;  // unit
    float flux;      // of the ray, per unit of the light's intensity, sr
};

// The hit of such a ray. `flux` is zero if entry points determine the light there, or if nothing
// was hit.
struct NearHit {
    vec3 position;
    float distance;   // from the light, metres
    vec3 normal;      // unit, geometric, of the side that was hit
    float clearance;  // height above and below the hit within which points count as its surface, metres
    float flux;       // sr
    float sum;        // of the weights of all entry points that share the hit's light, m²
};

// An entry point near the light.
struct NearPoint {
    vec3 position;
    float area_m2;
    vec3 normal;  // unit, geometric
    uint index;   // of the entry point
};

// Bits of positive floats, which order as integers do.
struct NearState {
    uint nearest;  // distance of the nearest hit, metres
    uint height;   // from which an entry point must see the light, metres
};

struct NearLightsPush {
    vec3 light_position;
    float mean_spacing;  // of all entry points, metres
    float spacing;       // of entry points beside the light, metres
    float area_m2;       // mean area of an entry point
    uint ray_count;
    uint point_count;
    uint first_point;    // of the list of near entry points, in this dispatch
    uint channel;          // 1 + that of the light; 0: all
    uint end_point;
};

// Distance of a light from the nearest surface, in mean spacings: below the first the correction
// applies in full, above the second not at all. The unit is the mean spacing because the clamp of
// 1/d² depends on it.
const vec2 CLOSE = vec2(2.0, 4.0);
// Distance from the light, in mean spacings: within half of it rays determine the light, beyond it
// entry points do.
const float REACH = 8.0;
// Distance, in local spacings, within which entry points share the light of a hit: with fewer of
// them the light would come from single paths.
const float SHARED = 16.0;
// Height, in local spacings, from which an entry point must see the light, over low obstacles.
// Entry points differ in height from the hit by no more than this, or by half the distance to the
// next surface above the hit.
const float OVER = 2.0;
// Offset, in local spacings, of rays upwards from a hit.
const float OFF = 0.01;
// Minimum cosine between the normals of a hit and an entry point that shares its light.
const float ALIKE = 0.7;

// Strength of the correction, 0..=1, from the distance of the nearest hit.
float strength(NearLightsPush push, uint nearest) {
    return clamp((CLOSE.y - uintBitsToFloat(nearest) / push.mean_spacing) / (CLOSE.y - CLOSE.x), 0.0, 1.0);
}

// Fraction of the light at that distance that rays determine.
float fraction_of_rays(NearLightsPush push, float strength, float distance) {
    float reach = REACH * push.mean_spacing;
    return distance < reach ? strength * clamp(2.0 - 2.0 * distance / reach, 0.0, 1.0) : 0.0;
}

// Weight of one of the entry points that share a hit's light, over the point's area.
float weight_of(NearLightsPush push, NearHit hit, NearPoint point) {
    vec3 apart = point.position - hit.position;
    float off = dot(apart, apart) / (SHARED * push.spacing * SHARED * push.spacing);
    bool is_level = abs(dot(apart, hit.normal)) < hit.clearance;
    return off < 1.0 && is_level && dot(point.normal, hit.normal) > ALIKE ? 1.0 - off : 0.0;
}
