/* SHADE begins. Reads which Gaussians are seen and which are skipped, and the tally of each 256. Writes
   the list of those to be shaded, ascending. Writes for each skipped one its neighbour, a place in that
   list. If all are skipped some colour is needed: the first one is shaded. */
#version 430
#include "common.glsl"
#include "scan.glsl"
#include "seen.glsl"

layout(std430, binding = 3) writeonly buffer neighbour_block { uint neighbours[]; };
shared uint first;
void main() {
    bool within = item() < count;
    uint is = within ? seen[item()] : 0u, before = 0u, all = 0u, own;
    if (lane() == 0u) first = none;
    barrier();
    for (uint at = lane(); 256u * at < count; at += 256u) {
        all += tally[at].x;
        if (at < group()) before += tally[at].x;
        if (tally[at].y != none) atomicMin(first, tally[at].y);
    }
    scan(before, before); /* of each the total alone */
    scan(all, all);
    if (all == 0u && item() == first) seen[item()] = is = is_seen;
    uint place = before + scan(uint(is == is_seen), own);
    if (item() == 0u) shaded_count = all == 0u && first != none ? 1u : all;
    if (!within) return;
    if (is == is_seen) shaded[place] = item();
    neighbours[item()] = is == is_skipped ? max(place, 1u) - 1u : none;
}
