/* SHADE ends. Reads the neighbours that seen_list.comp found. Writes colours and layers: a skipped
   Gaussian gets its neighbour's. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "seen.glsl"

layout(std430, binding = 8) buffer layer_block { vec4 layer[]; };
void main() {
    if (item() >= count || neighbours[item()] == none) return;
    uint from = shaded[neighbours[item()]];
    for (uint i = 0u; i <= layers; i++) layer[i * count + item()] = layer[i * count + from];
}
