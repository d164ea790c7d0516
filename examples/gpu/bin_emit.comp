/* BIN lists, a thread a Gaussian in depth order. Reads records, their order, and what bin_count.comp has
   counted. Writes of each instance its mask, its Gaussian and, as a key, its tile. Writes of each Gaussian
   where its instances begin, and how many there are of all. */
#version 430
#include "common.glsl"
#include "bin.glsl"
#include "bin_mask.glsl"
#include "scan.glsl"

layout(std430, binding = 6) writeonly buffer instances { pair instance[]; };
layout(std430, binding = 7) writeonly buffer owners { uint owner[]; };
layout(std430, binding = 8) writeonly buffer keys { uint key[]; };
uint in_256s(uint x) { return (x >> 8u) + 1u; } /* sums of these fit 32 bits where sums of x may not */
void main() {
    uint rank = item(), groups = (count + 255u) / 256u, all = 0u, first = 0u, most = 0u;
    for (uint i = lane(); i < groups; i += 256u) {
        all += min(before[i], 0x7FFFFFFFu - all);
        if (i < group()) first += before[i];
    }
    scan(in_256s(all), most); /* of each the total alone */
    scan(all, all);
    scan(first, first);
    if (most > 7812500u) all = none; /* 2e9 */
    if (rank == 0u) facts[view].instances = all;
    if (rank >= facts[view].visible) return;
    uint g = order[rank], at = of_gaussian[g].first + first;
    splat s = record[g];
    uvec4 tiles = box(s);
    uint end = min(at + of_gaussian[g].second, listed(all, room));
    of_gaussian[g] = pair(at, at < end ? end - at : 0u);
    for (uint y = tiles.y; y <= tiles.w && at < end; y++)
        for (uint x = tiles.x; x <= tiles.z && at < end; x++) {
            uint mask = touched(s, x, y);
            if (mask == 0u) continue;
            instance[at].second = mask;
            owner[at] = g;
            key[at] = y * tiles_x + x;
            at++;
        }
}
