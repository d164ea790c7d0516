/* True dipole transport begins, of lights whose nodes are not there. Reads places and flux. Writes nodes.
   A group makes 64 nodes and the one above them; a thread sums 16 Gaussians. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "model.glsl"
#include "transport.glsl"

layout(std430, binding = 5) writeonly buffer node_block { node node_of[]; };
shared vec4 middles[256];
shared float radii[256];
vec4 joined(vec4 a, vec4 b) {
    if (!(b.w > 0.0)) return a;
    return vec4(a.xyz + (b.xyz - a.xyz) * (b.w / (a.w + b.w)), a.w + b.w);
}
void main() {
    uint top = group() % above, mine = lane() / 4u, beyond = object_count;
    vec4 sum = vec4(0);
    float radius = 0.0;
    light = group() / above;
    o = 0u;
    while (beyond - o > 1u) { /* whose node above it is */
        uint middle = (o + beyond) / 2u;
        if (uint(objects[middle].of.z) <= top) o = middle;
        else beyond = middle;
    }
    if (light >= lights || lamps[light].of.w != 0 || !is_asked()) return;
    uint from = first_of() / 64u + 64u * (top - uint(objects[o].of.z)), own = from + mine;
    uint first = 64u * from + 16u * lane(), end = min(first + 16u, end_of());
    for (uint g = first; g < end; g++) sum = joined(sum, source(g));
    middles[lane()] = sum;
    barrier();
    sum = vec4(0);
    for (uint i = 4u * mine; i < 4u * mine + 4u; i++) sum = joined(sum, middles[i]);
    for (uint g = first; g < end; g++) {
        vec4 of = source(g);
        if (of.w > 0.0) radius = max(radius, distance(of.xyz, sum.xyz));
    }
    radii[lane()] = radius;
    barrier();
    for (uint i = 4u * mine; i < 4u * mine + 4u; i++) radius = max(radius, radii[i]);
    barrier();
    middles[mine] = sum;
    radii[mine] = radius;
    barrier();
    if (lane() % 4u == 0u && 64u * own < end_of()) node_of[first_node() + own] = node(sum, vec4(radius));
    if (lane() > 0u) return;
    for (uint i = 1u; i < 64u; i++) sum = joined(sum, middles[i]);
    radius = 0.0;
    for (uint i = 0u; i < 64u; i++)
        if (middles[i].w > 0.0) radius = max(radius, distance(middles[i].xyz, sum.xyz) + radii[i]);
    node_of[first_node() + blocks + top] = node(sum, vec4(radius));
}
