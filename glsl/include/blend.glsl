// A neighbour of a record, for blending and for the search for needed records.

struct Neighbour {
    uint record;
    float weight;  // a record's weights sum to 1
};
