// What blending and the search for needed records share.

// A record that speaks for another's place.
struct Neighbour {
    uint record;
    float weight;  // a record's weights sum to 1
};
