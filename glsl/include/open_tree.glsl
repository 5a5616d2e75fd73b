// Roots of rays in a region (a shaft or a frustum): the few nodes and triangles that overlap it.
// Include after bvh.glsl. The including shader binds `uint roots[]`. It defines the largest number
// of roots, MAX_ROOTS, and of opened nodes, MAX_OPENED. It also defines the region: `bool
// is_outside(vec3 low, vec3 high)` for a box, `bool is_inside(Corners corners)` for a triangle.

// Children of a node that overlap the region: bits 24-31 inner ones, 0-23 leaf triangles.
uint children_inside(Node node) {
    vec3 origin = node_origin(node);
    vec3 cell = node_cell(node);
    uint found = 0u;
    for (uint child = 0u; child < 8u; ++child) {
        uint word = child >> 2;
        uint shift = 8u * (child & 3u);
        uint meta = node.children[2u + word] >> shift & 0xffu;
        vec3 low = origin + cell * vec3(uvec3(node.x_planes[word], node.y_planes[word], node.z_planes[word]) >> shift & 0xffu);
        uint far = word + 2u;
        vec3 high = origin + cell * vec3(uvec3(node.x_planes[far], node.y_planes[far], node.z_planes[far]) >> shift & 0xffu);
        if (meta != 0u && !is_outside(low, high)) found |= (meta >> 5) << (meta & 31u);
    }
    uint inside = 0u;
    for (uint left = found & 0xffffffu; left != 0u; left &= left - 1u) {
        uint place = uint(findLSB(left));
        if (is_inside(corners_of(node.children.y + place))) inside |= 1u << place;
    }
    return (found & 0xff000000u) | inside;
}

// Writes the roots of rays through the region to the words from `first` on: triangles after the
// first word, nodes from the end backwards. Returns their numbers, packed as in the first word.
uint open_tree(uint first) {
    uint triangle_roots = 0u;  // written so far
    uint node_roots = 0u;
    // Breadth first, so that all nodes are opened about equally deep.
    uint queue[MAX_ROOTS];
    uint head = 0u;
    uint waiting = 1u;
    queue[0] = 0u;
    for (uint opened = 0u; waiting != 0u; ++opened) {
        uint opening = queue[head];
        head = (head + 1u) % MAX_ROOTS;
        --waiting;
        Node node = node_at(opening);
        uint found = opened < MAX_OPENED ? children_inside(node) : 0u;
        if (opened >= MAX_OPENED || triangle_roots + node_roots + waiting + uint(bitCount(found)) > MAX_ROOTS) {
            // Rays start at this node and traverse it themselves.
            roots[first + MAX_ROOTS - node_roots++] = opening;
            continue;
        }
        for (uint left = found & 0xffffffu; left != 0u; left &= left - 1u) {
            roots[first + 1u + triangle_roots++] = node.children.y + uint(findLSB(left));
        }
        for (uint left = found >> 24; left != 0u; left &= left - 1u) {
            uint before = node.frame.w >> 24 & ((left & -left) - 1u);
            queue[(head + waiting++) % MAX_ROOTS] = node.children.x + uint(bitCount(before));
        }
    }
    return triangle_roots | node_roots << 16;
}
