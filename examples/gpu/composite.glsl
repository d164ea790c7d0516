/* COMPOSITE: eq. 1, and deferred highlights. Reads the tiles' lists, what WALK of the camera has found,
   layers of Gaussians and lights' maps. Writes planes of the picture. The program says before how many
   layers are blended at once: `at_once`. */

layout(std430, binding = 7) readonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 8) readonly buffer layer_block { vec4 layer[]; }; /* the first is the colour */
/* The picture (3), transmittance, median depth; and where parts are asked for layer_pixels (layers + 1, 3),
   pixel_visibility (lights), pixel_shadow (lights). */
layout(std430, binding = 10) buffer planes { float plane[]; };
shared vec4 values[window * at_once];
shared uint next_material;
vec3 sums[at_once];
float t, half_depth;
int material_now; /* what others blend only darkens */
uint first_layer;
void meet(float weight, uint i) {
    if (!(weight > 0) || t < stop || !is_open(i)) return;
    float alpha = alpha_of(weight), w = alpha * t, before = t;
    for (uint l = 0u; l < at_once; l++) sums[l] += w * values[i * at_once + l].rgb;
    t = fma(-alpha, t, t);
    if (before >= 0.5 && t < 0.5) half_depth = depth_at(i, centre());
}
int material_of(uint gaussian) { return sharing == 0u ? 0 : objects[object_at(gaussian)].of.y; }
vec4 value_of(uint which, uint gaussian) {
    bool ours = which <= layers && material_of(gaussian) == material_now;
    return ours ? layer[which * count + gaussian] : vec4(0);
}
/* Blends as many layers as fit into `sums`. */
void blend(uint first) {
    uint begin = tile_start[tile], end = tile_start[tile + 1u];
    bool dark = false;
    vec2 at = centre();
    first_layer = first;
    find_behind();
    half_depth = 0;
    t = inside() ? 1 : -1;
    for (uint l = 0u; l < at_once; l++) sums[l] = vec3(0);
    barrier();
    if (lane() == 0u) lit = 0u;
    for (uint from = begin, step = 1u; from < end && !dark; from += window, step++) {
        uint entries = min(window, end - from);
        barrier();
        if (lane() < entries) load(lane(), tile_list[from + lane()].first, tile_seen[from + lane()]);
        else if (lane() < window) masks[lane()] = 0u;
        if (lane() < entries) load_front(lane(), tile_list[from + lane()].first);
        for (uint i = lane(); i < entries * at_once; i += 256u)
            values[i] = value_of(first_layer + i % at_once, tile_list[from + i / at_once].first);
        find_covered(0u);
        for (uint word = 0u; word < words && t >= stop; word++) {
            uint rest = covered[words * micro() + word];
            while (rest != 0u && t >= stop) meet_four(rest, word, at);
        }
        dark = is_dark(t, step);
    }
}
/* Of the materials that the tile blends the first after that one; none: there is none. */
uint material_after(int last) {
    if (sharing == 0u) return last < 0 ? 0u : none;
    barrier();
    if (lane() == 0u) next_material = none;
    barrier();
    for (uint i = tile_start[tile] + lane(); i < tile_start[tile + 1u]; i += 256u) {
        int own = material_of(tile_list[i].first);
        if (tile_seen[i] != 0u && own > last) atomicMin(next_material, uint(own));
    }
    barrier();
    return next_material;
}
uint pixels() { return width * height; }
uint here() { return pixel().y * width + pixel().x; }
