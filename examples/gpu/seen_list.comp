/* SHADE begins. Reads what the walk has seen and skipped. Writes the Gaussians to be shaded, ascending,
   and for each that is skipped the place of its neighbour among them. Where all are skipped, some colour
   is needed: the first's. */
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
