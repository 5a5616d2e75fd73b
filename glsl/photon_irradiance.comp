// Density estimate at the irradiance points: Σ flux·kernel over the photons around, by the kernel's
// mass there. [Christensen 1999] Deterministic. One invocation = one point. In: points with their
// reach, photon map, masses (m²). Out: irradiance, W/m². The mass is this very sum over points that
// stand for equal areas: edges of surfaces and walls on them take nothing away.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "include/types.glsl"
#include "include/dispatch.glsl"
#include "include/math.glsl"
#include "include/sampling.glsl"
#include "include/photons.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint MAX_PHOTONS = 0;  // of one bucket that are looked at

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
        // Where a beam is narrow, one photon in `stride` stands for all: a sum over all of them
        // would take forever.
        uint stride = (end - first + MAX_PHOTONS - 1u) / MAX_PHOTONS;
        float weight = float(stride);
        for (uint j = first + (stride > 1u ? hash(index, bucket) % stride : 0u); j < end; j += stride) {
            MapEntry entry = map_entries[j];
            vec3 offset = entry.position - point.position;
            float kernel = photon_kernel(offset, point.normal, entry.normal, push.radius);
            if (kernel <= 0.0) continue;
            // Cells that share a bucket are told apart, or a photon counts twice.
            if (photon_cell(push.grid, entry.position) != cell) continue;
            if (!is_within_reach(reach, point.normal, offset, push.radius)) continue;
            sum += weight * kernel * entry.flux;
        }
    }
    vec3 mass = masses[index];
    irradiances[index] = mix(vec3(0.0), sum / mass, greaterThan(mass, vec3(0.0)));
}
