/* WALK of the camera ends, a thread a Gaussian. Reads what walk_camera.comp has found of its instances.
   Writes whether it is seen, skipped or neither. Writes of each 256 how many are seen, and the first that
   is skipped. */
#version 430
#include "common.glsl"
#include "scan.glsl"

layout(std140, binding = 0) uniform parameters { uint count, thrifty; };
layout(std430, binding = 0) readonly buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 1) readonly buffer instances { pair instance[]; };
layout(std430, binding = 2) readonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 3) readonly buffer neededs { uint tile_needed[]; };
layout(std430, binding = 4) writeonly buffer all_seen { uint seen[]; };
layout(std430, binding = 5) writeonly buffer tallies { uvec2 tally[]; }; /* seen; the first skipped */
shared uint first;
void main() {
    uint blended = 0u, needed = 0u, sum;
    if (256u * group() >= count) return;
    pair of = pair(0u, 0u);
    if (item() < count) of = of_gaussian[item()]; /* glslang's SPIR-V of ?: with structures is invalid */
    for (uint i = of.first; i < of.first + of.second; i++) {
        uint at = instance[i].first;
        blended |= tile_seen[at];
        needed |= thrifty != 0u ? tile_needed[at] : tile_seen[at];
    }
    if (item() < count) seen[item()] = needed != 0u ? is_seen : blended != 0u ? is_skipped : 0u;
    if (lane() == 0u) first = none;
    scan(needed != 0u ? 1u : 0u, sum);
    if (needed == 0u && blended != 0u) atomicMin(first, item());
    barrier();
    if (lane() == 0u) tally[group()] = uvec2(sum, first);
}
