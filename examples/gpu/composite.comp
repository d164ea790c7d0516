/* COMPOSITE where nothing is deferred: colours alone. composite.glsl says what it reads and writes. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "walk.glsl"
const uint window = 128u, windows = 1u;
#include "window.glsl"
#include "fours.glsl"
#include "hides.glsl"
const uint at_once = 1u;
#include "composite.glsl"
void main() {
    if (!find_tile(group(), camera_tiles)) return;
    material_now = 0;
    blend(0u);
    if (!inside()) return;
    for (uint c = 0u; c < 3u; c++) plane[c * pixels() + here()] = sums[0][c];
    plane[3u * pixels() + here()] = t;
    if (median != 0u) plane[4u * pixels() + here()] = half_depth;
}
