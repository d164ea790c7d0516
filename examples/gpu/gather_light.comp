/* WALK of the lights ends, a thread a Gaussian under one. Reads the sums of its instances in all of the
   light's views, and the engine's shadow maps. Writes visibility, which is eq. 7, depth cue and flux. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "model.glsl"
#include "occlude.glsl"

layout(std430, binding = 4) readonly buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 5) readonly buffer instances { pair instance[]; };
layout(std430, binding = 6) readonly buffer sums { vec4 tile_sums[]; };
layout(std430, binding = 7) writeonly buffer visibilities { float visibility[]; };
layout(std430, binding = 8) writeonly buffer cues { float depth_cue[]; };
layout(std430, binding = 9) writeonly buffer fluxes { float all_flux[]; };
void main() {
    uint work = part_of(groups_of(count)), g = item_of(groups_of(count));
    if (work >= works || g >= count) return;
    ivec4 of_light = light_at_work[work];
    vec4 sum = vec4(0);
    for (int slot = of_light.y; slot < of_light.z; slot++) {
        pair of = of_gaussian[uint(slot) * count + g];
        for (uint i = of.first; i < of.first + of.second; i++) sum += tile_sums[instance[i].first];
    }
    uint o = object_at(g), own = g - uint(objects[o].place.x), at = uint(of_light.x) * count + g;
    float passes = 1;
    if (map_count > 0u && own < uint(objects[o].place.y)) {
        vec3 place = to_world(o, planes_of(o, 0u, own));
        if (is_finite(place)) passes = let_pass(of_light.x, place);
    }
    visibility[at] = passes * (sum.y > 0 ? sum.x / sum.y : 1); /* nothing in the way of an empty footprint */
    if (cue != 0u) depth_cue[at] = sum.y > 0 && sum.z > 0 ? sum.z / sum.y : 0;
    if (flux != 0u) all_flux[at] = passes * sum.w;
}
