/* BIN lists, a thread a Gaussian in a view, in depth order. Reads records, their order, and what
   bin_count.comp and bin_scan.comp have counted. Writes of each instance its mask, its Gaussian and, as a
   key, its tile. Writes of each Gaussian where its instances begin, and how many there are of all. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "bin_mask.glsl"

layout(std430, binding = 7) writeonly buffer instances { pair instance[]; };
layout(std430, binding = 8) writeonly buffer owners { uint owner[]; };
layout(std430, binding = 9) writeonly buffer keys_ { uint key[]; };
void main() {
    uint groups = groups_of(count), slot = part_of(groups), rank = item_of(groups), base = slot * count;
    if (slot >= slots || rank >= facts[view_at_work[slot]].visible) return;
    projection v = views[view_at_work[slot]];
    uint g = order[base + rank], at = of_gaussian[base + g].first + before[group()];
    splat s = record[base + g];
    uvec4 within = box(s, v.size);
    uint end = min(at + of_gaussian[base + g].second, listed(facts[total].instances, room));
    of_gaussian[base + g] = pair(at, at < end ? end - at : 0u);
    for (uint y = within.y; y <= within.w && at < end; y++)
        for (uint x = within.x; x <= within.z && at < end; x++) {
            uint mask = touched(s, x, y);
            if (mask == 0u) continue;
            instance[at].second = mask;
            owner[at] = g;
            key[at] = uint(v.of.z) + y * uint(v.size.z) + x;
            at++;
        }
}
