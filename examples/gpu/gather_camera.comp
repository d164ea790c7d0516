/* WALK of the camera ends, a thread a Gaussian. Reads what walk_camera.comp has found of its instances.
   Writes whether it is seen, skipped or neither. Writes of each 64 how many are seen, and the first that
   is skipped. */
#version 430
#include "common.glsl"
#include "frame.glsl"

layout(std430, binding = 3) readonly buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 4) readonly buffer instances { pair instance[]; };
layout(std430, binding = 5) readonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 6) readonly buffer neededs { uint tile_needed[]; };
layout(std430, binding = 7) writeonly buffer all_seen { uint seen[]; };
layout(std430, binding = 8) writeonly buffer tallies { uvec2 tally[]; }; /* seen; the first skipped */
shared uint sums[4], firsts[4];
void main() {
    uint blended = 0u, needed = 0u, own = lane() >> 6u;
    if (256u * group() >= count) return;
    if (lane() < 4u) sums[lane()] = 0u, firsts[lane()] = none;
    barrier();
    pair of = pair(0u, 0u);
    if (item() < count) of = of_gaussian[item()]; /* glslang's SPIR-V of ?: with structures is invalid */
    for (uint i = of.first; i < of.first + of.second; i++) {
        uint at = instance[i].first;
        blended |= tile_seen[at];
        needed |= thrifty != 0u ? tile_needed[at] : tile_seen[at];
    }
    if (item() < count) seen[item()] = needed != 0u ? is_seen : blended != 0u ? is_skipped : 0u;
    if (needed != 0u) atomicAdd(sums[own], 1u);
    else if (blended != 0u) atomicMin(firsts[own], item());
    barrier();
    if (lane() < 4u && 4u * group() + lane() < blocks)
        tally[4u * group() + lane()] = uvec2(sums[lane()], firsts[lane()]);
}
