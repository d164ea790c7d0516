/* Shared by WALK and COMPOSITE: a group a tile, a thread a pixel. 16 threads are a micro-tile of 4x4
   pixels. Reads records and the tiles' lists. */

layout(std430, binding = 3) readonly buffer records { vec4 record[]; }; /* two of each splat */
layout(std430, binding = 4) readonly buffer lists { pair tile_list[]; };
layout(std430, binding = 5) readonly buffer starts { uint tile_start[]; };
layout(std430, binding = 6) readonly buffer depths { float depth[]; };

/* The tile among all at work, its view, its number there; where the view's Gaussians begin. */
uint tile, view, own_tile, base;
ivec4 view_size;
/* False: there is no such tile. */
bool find_tile(uint number, uint end) {
    uint slot = 0u, beyond = slots;
    tile = min(number, tiles - 1u);
    while (beyond - slot > 1u) {
        uint middle = (slot + beyond) / 2u;
        if (uint(views[view_at_work[middle]].of.z) <= tile) slot = middle;
        else beyond = middle;
    }
    view = view_at_work[slot];
    base = slot * count;
    own_tile = tile - uint(views[view].of.z);
    view_size = views[view].size;
    return number < end;
}

/* All programs find alpha by the same operations, so they decide alike. */
uint micro() { return lane() >> 4u; }
uvec2 pixel() {
    uint m = micro(), p = lane() & 15u;
    return 16u * uvec2(own_tile % uint(view_size.z), own_tile / uint(view_size.z)) +
        uvec2(4u * (m & 3u) + (p & 3u), 4u * (m >> 2u) + (p >> 2u));
}
bool inside() { return pixel().x < uint(view_size.x) && pixel().y < uint(view_size.y); }
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
