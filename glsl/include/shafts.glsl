// Possible occluders between a light and a batch of nearby points, found once for the batch:
// the few nodes and triangles from which its shadow rays start instead of the root. [Haines]
// Include after bvh.glsl.

const uint BATCH = 64u;        // points that share a shaft; src/passes/frame/shafts.rs
const uint SHAFT_WORDS = 16u;  // of a shaft: the numbers of its triangles (bits 0-15) and nodes (16-31); triangles; at the end, nodes
const uint MAX_ROOTS = 15u;

// The origins of a batch's shadow rays.
struct PointBatch {
    vec3 low;      // bounds of their origins; low > high: none
    float spread;  // largest distance of its unit normals from `normal`
    vec3 high;
    vec3 normal;
};

PointBatch no_points() { return PointBatch(vec3(1e30), 0.0, vec3(-1e30), vec3(0.0)); }

bool is_empty(PointBatch batch) { return batch.low.x > batch.high.x; }

// A batch and one more point; the first one's geometric normal is the batch's.
PointBatch with_point(PointBatch batch, vec3 position, vec3 normal) {
    vec3 origin = offset_origin(position, normal);
    vec3 first = is_empty(batch) ? normal : batch.normal;
    return PointBatch(min(batch.low, origin), max(batch.spread, distance(normal, first)), max(batch.high, origin), first);
}
