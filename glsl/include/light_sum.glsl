// Sums over lights: push constants, and the number of lights that a dispatch reads.
layout(constant_id = 0) const uint LIGHTS = 4;  // 1, 2, 4 or 8

struct LightSumPush {
    uint count;       // values of a light
    uint adds;        // 1: adds to the sums so far; 0: starts from zero
    uint step;        // stride of the values of a light; 0 if no light is active and each light has one value
    float scale;      // of the whole
    vec3 emission_0;  // of each light; zero for an unused one, whose buffer is arbitrary
    vec3 emission_1;
    vec3 emission_2;
    vec3 emission_3;
    vec3 emission_4;
    vec3 emission_5;
    vec3 emission_6;
    vec3 emission_7;
};
