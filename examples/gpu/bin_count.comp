/* BIN counts, a thread a Gaussian in depth order. Reads records, depths and their order. Writes of each
   Gaussian how many instances it has and where they begin in its group, of each group how many it has, and
   how many Gaussians are visible. */
#version 430
#include "common.glsl"
#include "bin.glsl"
#include "bin_mask.glsl"
#include "scan.glsl"

layout(std430, binding = 5) readonly buffer depths { float depth[]; };
bool is_drawn(uint rank) { return rank < count && depth[order[rank]] >= 0; }
void main() {
    uint rank = item(), found = 0u, total;
    bool drawn = is_drawn(rank);
    if (group() * 256u >= count) return;
    if (rank == 0u) facts[view].nearest = drawn ? depth[order[0]] : 0;
    if (rank == 0u && !drawn) facts[view].visible = 0u;
    if (drawn && !is_drawn(rank + 1u)) facts[view].visible = rank + 1u;
    if (drawn) {
        splat s = record[order[rank]];
        uvec4 tiles = box(s);
        for (uint y = tiles.y; y <= tiles.w; y++)
            for (uint x = tiles.x; x <= tiles.z; x++) found += touched(s, x, y) != 0u ? 1u : 0u;
    }
    uint first = scan(found, total);
    if (rank < count) of_gaussian[order[rank]] = pair(first, found);
    if (lane() == 0u) before[group()] = total;
}
