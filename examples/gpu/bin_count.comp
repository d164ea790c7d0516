/* BIN counts, a thread a Gaussian in a view, in depth order. Reads records, depths and their order.
   Writes of each Gaussian how many instances it has and where they begin in its group, of each group how
   many it has, and how many Gaussians of a view are visible. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "bin_mask.glsl"
#include "scan.glsl"

layout(std430, binding = 7) readonly buffer depths { float depth[]; };
uint base;
bool is_drawn(uint rank) { return rank < count && depth[base + order[base + rank]] >= 0; }
void main() {
    uint groups = groups_of(count), slot = part_of(groups), rank = item_of(groups), found = 0u, all;
    if (slot >= slots) return;
    uint view = view_at_work[slot];
    base = slot * count;
    bool drawn = is_drawn(rank);
    if (rank == 0u) facts[view].nearest = drawn ? depth[base + order[base]] : 0;
    if (rank == 0u && !drawn) facts[view].visible = 0u;
    if (drawn && !is_drawn(rank + 1u)) facts[view].visible = rank + 1u;
    if (drawn) {
        splat s = record[base + order[base + rank]];
        uvec4 within = box(s, views[view].size);
        for (uint y = within.y; y <= within.w; y++)
            for (uint x = within.x; x <= within.z; x++) found += touched(s, x, y) != 0u ? 1u : 0u;
    }
    uint first = scan(found, all);
    if (rank < count) of_gaussian[base + order[base + rank]] = pair(first, found);
    if (lane() == 0u) before[group()] = all;
}
