/* Shared by WALK and COMPOSITE: a group a tile, a thread a pixel. 16 threads are a micro-tile of 4x4
   pixels. Reads records and the tiles' lists. */

layout(std140, binding = 0) uniform parameters {
    uint view, tiles_x, tiles, width, height, first_tile;
    float log2_threshold, stop, max_error, bias, cx, cy, inverse_focal;
    uint orthographic, cue, flux, map, shared_views, gaussians, first_layer, layers, deferred;
};
layout(std430, binding = 0) readonly buffer records { vec4 record[]; }; /* two of each splat */
layout(std430, binding = 1) readonly buffer lists { pair tile_list[]; };
layout(std430, binding = 2) readonly buffer starts { uint tile_start[]; };

/* All programs find alpha by the same operations, so they decide alike. */
uint micro() { return lane() >> 4u; }
uvec2 pixel() {
    uint m = micro(), p = lane() & 15u;
    return 16u * uvec2(group() % tiles_x, group() / tiles_x) +
        uvec2(4u * (m & 3u) + (p & 3u), 4u * (m >> 2u) + (p >> 2u));
}
bool inside() { return pixel().x < width && pixel().y < height; }
vec2 centre() { return vec2(pixel()) + 0.5; }
float weight_of(vec4 splat, vec2 spread, vec2 at) { /* x, y, ux, uy; wy, log2 opacity; 0: not drawn */
    precise float dx = at.x - splat.x, dy = at.y - splat.y;
    precise float u = fma(splat.z, dx, splat.w * dy), w = spread.x * dy;
    precise float p = fma(-u, u, fma(-w, w, spread.y));
    return p >= log2_threshold ? exp2(p) : 0;
}
float alpha_of(float weight) { return min(weight, 0.999); }
/* Are all pixels of the group below the stop? step: 1, 2 .., one more each time. What is dark stays so. */
shared uint lit;
bool is_dark(float t, uint step) {
    if (t >= stop) lit = step;
    barrier();
    return lit < step;
}
