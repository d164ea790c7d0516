/* SHADE begins, a group an object. Reads the tally of each 64 Gaussians. Writes how many are seen before
   these 64 in the object, and how many the object has in the list. If all are skipped some colour is
   needed: the first one is shaded. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "scan.glsl"
#include "seen.glsl"

shared uint first;
void main() {
    uint o = group(), sum = 0u;
    if (o >= object_count) return;
    uint from = uint(objects[o].place.x) / 64u, end = from + (uint(objects[o].place.y) + 63u) / 64u;
    if (lane() == 0u) first = none;
    barrier();
    for (uint at = from; at < end; at += 256u) {
        uvec2 own = at + lane() < end ? tally[at + lane()] : uvec2(0u, none);
        uint all, before = scan(own.x, all);
        if (own.y != none) atomicMin(first, own.y);
        if (at + lane() < end) ahead_of[at + lane()] = sum + before;
        sum += all;
    }
    barrier();
    bool alone = sum == 0u && first != none;
    if (lane() == 0u) of_object[o] = uvec2(alone ? 1u : sum, alone ? first : none);
}
