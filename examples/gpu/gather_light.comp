/* WALK of a light ends, a thread a Gaussian. Reads the sums of its instances in one of the light's views,
   and of the views before. Writes the sums of all so far. After the last view these become visibility,
   which is eq. 7, depth cue and flux. */
#version 430
#include "common.glsl"

layout(std140, binding = 0) uniform parameters { uint count, light, first, last, cue, flux; };
layout(std430, binding = 0) readonly buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 1) readonly buffer instances { pair instance[]; };
layout(std430, binding = 2) readonly buffer sums { vec4 tile_sums[]; };
layout(std430, binding = 3) buffer so_far { vec4 gathered[]; };
layout(std430, binding = 4) writeonly buffer visibilities { float visibility[]; };
layout(std430, binding = 5) writeonly buffer cues { float depth_cue[]; };
layout(std430, binding = 6) writeonly buffer fluxes { float all_flux[]; };
void main() {
    if (item() >= count) return;
    pair of = of_gaussian[item()];
    vec4 sum = first != 0u ? vec4(0) : gathered[item()];
    uint at = light * count + item();
    for (uint i = of.first; i < of.first + of.second; i++) sum += tile_sums[instance[i].first];
    if (last == 0u) {
        gathered[item()] = sum;
        return;
    }
    visibility[at] = sum.y > 0 ? sum.x / sum.y : 1; /* nothing in the way of an empty footprint */
    if (cue != 0u) depth_cue[at] = sum.y > 0 && sum.z > 0 ? sum.z / sum.y : 0;
    if (flux != 0u) all_flux[at] = sum.w;
}
