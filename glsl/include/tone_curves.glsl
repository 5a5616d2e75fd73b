// Published tone curves: exposed linear Rec.709 to linear display values. src/cpu/tone_curves.rs
// mirrors them.

const uint CURVE_STANDARD = 0u;
const uint CURVE_NONE = 1u;
const uint CURVE_FILMIC = 2u;
const uint CURVE_ACES = 3u;
const uint CURVE_AGX = 4u;

// All curves are at their ends here; squares stay finite.
const float LINEAR_MAX = 1e6;

// Negative values and NaN become 0.
float bounded(float linear) { return linear > 0.0 ? min(linear, LINEAR_MAX) : 0.0; }
vec3 bounded(vec3 linear) { return vec3(bounded(linear.r), bounded(linear.g), bounded(linear.b)); }

// [Hable 2010, Uncharted 2] with A = 0.15, B = 0.5, C = 0.1, D = 0.2, E = 0.02, F = 0.3.
vec3 hable(vec3 x) {
    return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
}

// Exposure bias 2; the linear white is 11.2.
vec3 filmic_curve(vec3 linear) { return hable(2.0 * linear) / hable(vec3(11.2)); }

// The fit of [Hill, BakingLab] to the transforms of ACES: the reference rendering transform, and
// the output transform of sRGB displays.
vec3 aces_curve(vec3 linear) {
    // Rec.709 to AP1 with the desaturation of the reference transform, by columns; and its inverse.
    const mat3 into = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    const mat3 back =
        mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    vec3 v = into * linear;
    return back * ((v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081));
}

// The fit of degree 6 of [Wrensch 2023] to AgX, base look [Sobotka 2022].
vec3 agx_curve(vec3 linear) {
    // The inset of the primaries, by columns, and the outset.
    const mat3 inset = mat3(
        0.842479062253094, 0.0423282422610123, 0.0423756549057051,
        0.0784335999999992, 0.878468636469772, 0.0784336,
        0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const mat3 outset = mat3(
        1.19687900512017, -0.0528968517574562, -0.0529716355144438,
        -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
        -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
    // Range of the logarithm, stops.
    const float low = -12.47393, high = 4.026069;
    vec3 stops = clamp(log2(max(inset * linear, 1e-10)), low, high);
    vec3 x = (stops - low) / (high - low);
    vec3 y = x * (x * (x * (x * (x * (15.5 * x - 40.14) + 31.96) - 6.868) + 0.4298) + 0.1191) - 0.00232;
    // The curve ends in the codes of a display with a pure exponent of 2.2.
    return pow(max(outset * y, 0.0), vec3(2.2));
}
