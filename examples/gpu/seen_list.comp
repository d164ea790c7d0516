/* SHADE lists, a thread a Gaussian. Reads which are seen, which are skipped, and what seen_objects.comp
   has counted. Writes the list of those to be shaded, ascending. Writes for each skipped one its
   neighbour, a place in that list. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "scan.glsl"
#include "seen.glsl"

uint listed_of(uint o) { return (of_object[o].x + 63u) & ~63u; }
void main() {
    uint g = min(item(), count - 1u), o = object_at(g), o_first = object_at(min(256u * group(), count - 1u));
    uint mine = 0u, before, all;
    if (256u * group() >= count) return;
    for (uint p = lane(); p < o_first; p += 256u) mine += listed_of(p);
    scan(mine, before); /* the total alone */
    for (uint p = o_first; p < o; p++) before += listed_of(p);
    bool within = item() < count && g - uint(objects[o].place.x) < uint(objects[o].place.y);
    uint is = within ? seen[g] : 0u;
    if (within && g == of_object[o].y) seen[g] = is = is_seen;
    uint rank = scan(uint(is == is_seen), all), ahead = lane() & ~63u;
    barrier();
    scanned[lane()] = rank; /* less that of the first of the 64 */
    barrier();
    uint place = before + (of_object[o].y == none ? ahead_of[g >> 6u] : 0u) + rank - scanned[ahead];
    if (is == is_seen) shaded[place] = g;
    if (item() < count) neighbours[g] = is == is_skipped ? max(place, before + 1u) - 1u : none;
    uint last = uint(objects[o].place.x) + uint(objects[o].place.y) - 1u, used = of_object[o].x;
    if (item() >> 6u == last >> 6u && (used & 63u) != 0u && (item() & 63u) >= (used & 63u))
        shaded[before + (used & ~63u) + (item() & 63u)] = none; /* the object's last 64 fill its part up */
    if (item() == count - 1u) shaded_count = before + listed_of(o);
}
