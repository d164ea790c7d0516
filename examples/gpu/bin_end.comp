/* BIN ends, a thread an instance, sorted by tiles of all views. Reads keys and values. Writes the tiles'
   lists, where each begins, and of each instance its place there. A tile without entries begins where the
   next one does. */
#version 430
#include "common.glsl"
#include "frame.glsl"

layout(std430, binding = 3) readonly buffer keys_ { uint key[]; };
layout(std430, binding = 4) readonly buffer values { uint value[]; };
layout(std430, binding = 5) readonly buffer owners { uint owner[]; };
layout(std430, binding = 6) buffer instances { pair instance[]; };
layout(std430, binding = 7) writeonly buffer lists { pair tile_list[]; };
layout(std430, binding = 8) writeonly buffer starts { uint tile_start[]; };
void main() {
    uint place = item(), all = listed(facts[total].instances, room);
    if (place > all) return;
    uint from = place == 0u ? 0u : key[place - 1u] + 1u, to = place == all ? tiles : key[place];
    for (uint tile = from; tile <= to; tile++) tile_start[tile] = place;
    if (place == all) return;
    uint number = value[place];
    instance[number].first = place;
    tile_list[place] = pair(owner[number], instance[number].second);
}
