/* COMPOSITE: eq. 1. Reads the tiles' lists, what WALK of the camera has found, colours and layers. Writes
   pixels, those of layers, and transmittance. Layer 0 is the colour; `layers` counts them from first_layer
   on. The program says before how many are blended at once: `at_once`. */

layout(std430, binding = 3) readonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 4) readonly buffer colors { vec4 color[]; };
layout(std430, binding = 5) readonly buffer layer_colors { vec4 layer[]; };
layout(std430, binding = 6) writeonly buffer all_pixels { float pixels[]; };
layout(std430, binding = 7) writeonly buffer all_layer_pixels { float layer_pixels[]; };
layout(std430, binding = 8) writeonly buffer transmittances { float transmittance[]; };
shared vec4 values[window * at_once];
vec3 sums[at_once];
float t;
void meet(float weight, uint i) {
    if (!(weight > 0) || t < stop) return;
    float alpha = alpha_of(weight), w = alpha * t;
    for (uint l = 0u; l < at_once; l++) sums[l] += w * values[i * at_once + l].rgb;
    t = fma(-alpha, t, t);
}
vec4 value_of(uint which, uint gaussian) {
    if (which == 0u) return color[gaussian];
    return which < first_layer + layers ? layer[(which - 1u) * gaussians + gaussian] : vec4(0);
}
void store() {
    uint plane = width * height, at = pixel().y * width + pixel().x;
    if (first_layer == 0u) {
        transmittance[at] = t;
        for (uint c = 0u; c < 3u; c++) pixels[c * plane + at] = sums[0][c];
    }
    if (deferred == 0u) return;
    for (uint l = 0u; l < min(layers, at_once); l++)
        for (uint c = 0u; c < 3u; c++) layer_pixels[((first_layer + l) * 3u + c) * plane + at] = sums[l][c];
}
void main() {
    if (group() >= tiles) return;
    uint begin = tile_start[group()], end = tile_start[group() + 1u];
    bool dark = false;
    vec2 at = centre();
    t = inside() ? 1 : -1;
    for (uint l = 0u; l < at_once; l++) sums[l] = vec3(0);
    if (lane() == 0u) lit = 0u;
    for (uint from = begin, step = 1u; from < end && !dark; from += window, step++) {
        uint entries = min(window, end - from);
        barrier();
        if (lane() < entries) load(lane(), tile_list[from + lane()].first, tile_seen[from + lane()]);
        else if (lane() < window) masks[lane()] = 0u;
        for (uint i = lane(); i < entries * at_once; i += 256u)
            values[i] = value_of(first_layer + i % at_once, tile_list[from + i / at_once].first);
        find_covered(0u);
        for (uint word = 0u; word < words && t >= stop; word++) {
            uint rest = covered[words * micro() + word];
            while (rest != 0u && t >= stop) meet_four(rest, word, at);
        }
        dark = is_dark(t, step);
    }
    if (inside()) store();
}
