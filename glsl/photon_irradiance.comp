// Density estimate at the irradiance points: Σ flux·kernel over the photons around, over the
// kernel's mass there. [Christensen 1999] The mass is the same sum over points of equal area, so
// that edges of surfaces and walls on them lose no light. Deterministic. One invocation = one
// point. In: points with their reach, photon map, masses (m²). Out: irradiance, W/m².
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/photons.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint MAX_PHOTONS = 0;  // visited photons of one bucket

struct PhotonIrradiancePush {
    PhotonGrid grid;
    float radius;  // metres
    uint first_point;
    uint end_point;
};

layout(scalar, binding = 0) readonly buffer Points { MapEntry points[]; };
layout(scalar, binding = 1) readonly buffer Reaches { uvec4 reaches[]; };
layout(scalar, binding = 2) readonly buffer MapEntries { MapEntry map_entries[]; };
layout(scalar, binding = 3) readonly buffer EntryOffsets { uint entry_offsets[]; };
layout(scalar, binding = 4) readonly buffer Masses { vec3 masses[]; };
layout(scalar, binding = 5) writeonly buffer Irradiances { vec3 irradiances[]; };
layout(scalar, push_constant) uniform Push { PhotonIrradiancePush push; };

void main() {
    uint index = push.first_point + flat_invocation();
    if (index >= push.end_point) return;
    MapEntry point = points[index];
    uvec4 reach = reaches[index];
    ivec3 middle = photon_cell(push.grid, point.position);
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < 27u; ++i) {
        ivec3 cell = photon_neighbour(middle, i);
        uint bucket = photon_bucket(cell);
        uint first = entry_offsets[bucket];
        uint end = entry_offsets[bucket + 1u];
        // In the bucket of a narrow beam one photon in `stride` stands for all: the sum over all
        // would take too long.
        uint stride = (end - first + MAX_PHOTONS - 1u) / MAX_PHOTONS;
        float weight = float(stride);
        for (uint j = first + (stride > 1u ? hash(index, bucket) % stride : 0u); j < end; j += stride) {
            MapEntry entry = map_entries[j];
            vec3 offset = entry.position - point.position;
            float kernel = photon_kernel(offset, point.normal, entry.normal, push.radius);
            if (kernel <= 0.0) continue;
            // A bucket may hold photons of several cells; without this test a photon counts twice.
            if (photon_cell(push.grid, entry.position) != cell) continue;
            if (!is_within_reach(reach, point.normal, offset, push.radius)) continue;
            sum += weight * kernel * entry.flux;
        }
    }
    vec3 mass = masses[index];
    irradiances[index] = mix(vec3(0.0), sum / mass, greaterThan(mass, vec3(0.0)));
}
