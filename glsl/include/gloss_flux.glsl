// What the vertices of a base cluster send towards a direction by their Phong lobes. The including shader binds Materials,
// ReflectedFlux, FirstDeposits, Deposits, GlossVertices and GlossBeams.

// π times the lobes' radiance, times the cluster's area, W, of the `window.y` vertices from the `window.x`th on: a dispatch bounds the
// work of an invocation. `shift` turns the index of a deposit into that of its vertex.
vec3 gloss_flux(uint cluster, uint shift, vec3 toward, uint beam_count, uvec2 window) {
    vec3 flux = vec3(0.0);
    uint first = first_deposits[2u * cluster];
    uint first_other = first_deposits[2u * cluster + 1u];
    uint end = min(first_deposits[2u * cluster + 2u], first + window.x + window.y);
    first += window.x;
    for (uint i = first; i < min(first_other, end); ++i) {
        GlossVertex vertex = gloss_vertices[i + shift];
        if (vertex.entry == NO_ENTRY) continue;
        Reflectance material = materials[vertex.material];
        for (uint beam = vertex.entry * beam_count; beam < (vertex.entry + 1u) * beam_count; ++beam) {
            flux += gloss_beams[beam].flux * lobe_share(material, gloss_beams[beam].mirror, toward);
        }
    }
    for (uint i = max(first, first_other); i < end; ++i) {
        GlossVertex vertex = gloss_vertices[i + shift];
        vec3 arrived = deposits[i].throughput * reflected_flux[deposits[i].path];
        flux += arrived * lobe_share(materials[vertex.material], vertex.mirror, toward);
    }
    return flux;
}
