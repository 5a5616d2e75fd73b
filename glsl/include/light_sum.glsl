// Sums over lights: push constants, and how many rows a dispatch reads.
layout(constant_id = 0) const uint ROWS = 4;  // 1, 2, 4 or 8

struct LightSumPush {
    uint count;       // values of a row
    uint adds;        // 1: to the sums so far; 0: from zero
    uint step;        // from one value of a row to the next; 0 where no light is active and the rows are one value long
    float scale;      // of the whole
    vec3 emission_0;  // of each row's light; zero where there is none, then the row is any
    vec3 emission_1;
    vec3 emission_2;
    vec3 emission_3;
    vec3 emission_4;
    vec3 emission_5;
    vec3 emission_6;
    vec3 emission_7;
};
