/* SHADE ends. Reads the neighbours that seen_list.comp found. Writes colours and layers: a skipped
   Gaussian gets its neighbour's. */
#version 430
#include "common.glsl"
#include "seen.glsl"

layout(std430, binding = 3) readonly buffer neighbour_block { uint neighbours[]; };
layout(std430, binding = 4) buffer color_block { vec4 colors[]; };
layout(std430, binding = 5) buffer layer_block { vec4 layers[]; };
void main() {
    if (item() >= count || neighbours[item()] == none) return;
    uint from = shaded[neighbours[item()]];
    colors[item()] = colors[from];
    for (uint i = 0u; i < layer_count; i++) layers[i * count + item()] = layers[i * count + from];
}
