/* BIN lists the instances of one Gaussian after the other, in depth order, the views' one after the
   other, and sorts them by tiles. So a tile's list stays in depth order. Here: which tiles may have a
   splat, and which micro-tiles of one it touches. As in the CPU's kernel: over the rectangle of a micro-
   tile's pixel centres u^2 + w^2 is least on a side that faces the splat's centre. */

layout(std430, binding = 3) readonly buffer records { splat record[]; };
layout(std430, binding = 4) readonly buffer orders { uint order[]; };
layout(std430, binding = 5) buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 6) buffer groups_ { uint before[]; }; /* of each 256 ranks of a view */

uvec4 box(splat s, ivec4 size) {
    vec2 last = vec2(16 * size.z - 1, 16 * (size.w / size.z) - 1);
    precise vec2 low = vec2(s.x - s.extent_x, s.y - s.extent_y) - 1,
                 high = vec2(s.x + s.extent_x, s.y + s.extent_y) + 1;
    return uvec4(clamp(low, vec2(0), last), clamp(high, vec2(0), last)) / 16u;
}
uint touched(splat s, uint tx, uint ty) {
    /* precise: two programs ask, and must get the same answer */
    precise float best_x = -s.uy / s.ux, best_y = -s.ux * s.uy / (s.uy * s.uy + s.wy * s.wy);
    /* with more than the rounding of u^2 + w^2 */
    precise float most =
        s.log2_opacity - log2_threshold + 1e-3 + 4e-6 * (s.ux * s.extent_x + abs(s.uy) * s.extent_y);
    uint mask = 0u;
    for (uint micro = 0u; micro < 16u; micro++) {
        precise vec2 low =
            vec2(16u * tx + 4u * (micro & 3u), 16u * ty + 4u * (micro >> 2u)) + 0.5 - vec2(s.x, s.y),
            high = low + 3, near = clamp(vec2(0), low, high);
        precise float on_x = clamp(best_x * near.y, low.x, high.x),
            on_y = clamp(best_y * near.x, low.y, high.y);
        precise float u = min(abs(s.ux * near.x + s.uy * on_y), abs(s.ux * on_x + s.uy * near.y)),
            w = s.wy * on_y;
        precise float far_off = u * u + w * w;
        if (far_off <= most) mask |= 1u << micro;
    }
    return mask;
}
