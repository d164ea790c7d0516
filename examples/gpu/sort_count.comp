/* SORT, first half of a pass. Reads keys. Writes how often each of the 256 digits is in each block. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "sort.glsl"

layout(std430, binding = 4) writeonly buffer digits { uint counted[]; };
shared uint found[256];
void main() {
    if (is_idle()) return;
    found[lane()] = 0u;
    barrier();
    for (uint row = 0u; row < rows; row++)
        if (at(row) < all_keys()) atomicAdd(found[digit(at(row))], 1u);
    barrier();
    counted[256u * group() + lane()] = found[lane()];
}
