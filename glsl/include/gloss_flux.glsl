// What the vertices of a base cluster send towards a direction by their Phong lobes. The including shader binds Materials,
// ReflectedFlux, FirstDeposits, Deposits, GlossVertices and GlossBeams.

// π times the lobes' radiance, times the cluster's area, W. `shift` turns the index of a deposit into that of its vertex.
vec3 gloss_flux(uint cluster, uint shift, vec3 toward, uint beam_count) {
    vec3 flux = vec3(0.0);
    uint first_other = first_deposits[2u * cluster + 1u];
    for (uint i = first_deposits[2u * cluster]; i < first_other; ++i) {
        GlossVertex vertex = gloss_vertices[i + shift];
        if (vertex.entry == NO_ENTRY) continue;
        Reflectance material = materials[vertex.material];
        for (uint beam = vertex.entry * beam_count; beam < (vertex.entry + 1u) * beam_count; ++beam) {
            flux += gloss_beams[beam].flux * lobe_share(material, gloss_beams[beam].mirror, toward);
        }
    }
    for (uint i = first_other; i < first_deposits[2u * cluster + 2u]; ++i) {
        GlossVertex vertex = gloss_vertices[i + shift];
        vec3 arrived = deposits[i].throughput * reflected_flux[deposits[i].path];
        flux += arrived * lobe_share(materials[vertex.material], vertex.mirror, toward);
    }
    return flux;
}
