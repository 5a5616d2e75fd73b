// Vertices of paths from the eye or a surface: their reflected light and the continuation of the
// path. Include after receivers.glsl, bvh.glsl, lights.glsl, light_parts.glsl, brdf.glsl and
// textures.glsl. The including shader binds the texels `Surfaces` and `Lights` and `Reflectance
// materials[]`; its push block `push` has `light_count`.

struct Vertex {
    vec3 position;
    Receiver receiver;  // takes direct light
    vec3 geometric;  // unit normal on the visible side
    vec3 shading;    // the interpolated one at the first vertex, else the geometric one
    vec3 outgoing;   // unit, against the direction of travel
    Reflectance material;
};

Vertex vertex_at(Hit hit, vec3 direction, bool is_first) {
    Surface surface = surface_at(hit.triangle);
    bool is_back = dot(surface.normal, direction) > 0.0;
    float side = is_back ? -1.0 : 1.0;
    vec3 smooth_normal = hit.barycentric.x * surface.n0 + hit.barycentric.y * surface.n1 + hit.barycentric.z * surface.n2;
    vec3 geometric = side * surface.normal;
    vec3 shading = is_first ? side * normalize(smooth_normal) : geometric;
    vec3 position = hit_position(hit);
    Receiver receiver = Receiver(position, geometric);
    if (is_first) receiver = receiver_at(position, 2u * hit.triangle + uint(is_back), shading);
    Reflectance material = materials[surface.material];
    if (HAS_TEXTURES != 0u) material.diffuse *= image_at(surface.material, hit.triangle, hit.barycentric);
    return Vertex(position, receiver, geometric, shading, -normalize(direction), material);
}

// Radiance that a vertex reflects of direct light, W/m²/sr. `gathered` is the part of it that
// frames find by gather rays: diffuse reflection of the sky without its bright spots.
vec3 reflected_light(Vertex vertex, uint sample_index, uint seed, inout uint rays, out vec3 gathered) {
    Receiver at = vertex.receiver;
    vec3 radiance = vec3(0.0);
    gathered = vec3(0.0);
    for (uint i = 0u; i < push.light_count; ++i) {
        LightSource light = light_at(Lights, i);
        vec3 u = vec3(0.0);
        if_any (light.kind == LIGHT_AREA || light.kind == LIGHT_GROUP) u = sample_3d(sample_index, hash(seed, ~i));
        light = chosen_part(light, u.z);
        LightSample found;
        if (!sample_light(light, at.position, u.xy, found)) continue;
        float cosine = dot(vertex.shading, found.direction);
        // A light behind the surface has no effect, whatever the shading normal.
        if (cosine <= 0.0 || dot(at.normal, found.direction) <= 0.0) continue;
        vec3 reflected = brdf(vertex.material, vertex.shading, vertex.outgoing, found.direction) * found.irradiance;
        if (reflected == vec3(0.0)) continue;
        ++rays;
        if (!is_lit(at.position, at.normal, found)) continue;
        vec3 passed = passed_by_panes(shadow_ray(at.position, at.normal, found));
        reflected *= passed;
        radiance += cosine * reflected;
        if (light.kind == LIGHT_SKY) gathered += light.edge_v.x * cosine / PI * vertex.material.diffuse * found.irradiance * passed;
    }
    return radiance;
}

// Samples the continuation of a path. Returns false if the path ends here. Afterwards `throughput`
// includes brdf·cosθ/pdf and the roulette.
bool reflect_path(Vertex vertex, vec3 u, float roulette_threshold, inout vec3 throughput, out vec3 direction) {
    BrdfSample next = sample_brdf(vertex.material, vertex.shading, vertex.outgoing, u.xy);
    direction = next.incident;
    // If the shading normal leans away from the geometric one, part of its hemisphere lies
    // inside the surface.
    throughput *= dot(vertex.geometric, next.incident) > 0.0 ? next.weight : vec3(0.0);
    // Russian roulette: the survival probability falls with the throughput; dividing by it keeps
    // the estimate unbiased.
    float peak = max(throughput.x, max(throughput.y, throughput.z));
    float survival = min(1.0, peak / roulette_threshold);
    throughput /= max(survival, 1e-30);
    return u.z < survival;
}
