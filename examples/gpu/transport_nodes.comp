/* True dipole transport of a light begins. Reads places and flux. Writes nodes. A group makes 64 nodes and
   the one above them; a thread sums 16 Gaussians. */
#version 430
#include "common.glsl"
#include "transport.glsl"

layout(std430, binding = 2) writeonly buffer node_block { node node_of[]; };
shared vec4 middles[256];
shared float radii[256];
vec4 joined(vec4 a, vec4 b) {
    if (!(b.w > 0.0)) return a;
    return vec4(a.xyz + (b.xyz - a.xyz) * (b.w / (a.w + b.w)), a.w + b.w);
}
void main() {
    uint first = 16u * item(), mine = lane() / 4u, own = 64u * group() + mine;
    vec4 sum = vec4(0);
    float radius = 0.0;
    if (64u * group() >= nodes) return;
    for (uint g = first; g < min(first + 16u, count); g++) sum = joined(sum, source(g));
    middles[lane()] = sum;
    barrier();
    sum = vec4(0);
    for (uint i = 4u * mine; i < 4u * mine + 4u; i++) sum = joined(sum, middles[i]);
    for (uint g = first; g < min(first + 16u, count); g++) {
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
    if (lane() % 4u == 0u && own < nodes) node_of[first_node() + own] = node(sum, vec4(radius));
    if (lane() > 0u) return;
    for (uint i = 1u; i < 64u; i++) sum = joined(sum, middles[i]);
    radius = 0.0;
    for (uint i = 0u; i < 64u; i++)
        if (middles[i].w > 0.0) radius = max(radius, distance(middles[i].xyz, sum.xyz) + radii[i]);
    node_of[first_node() + nodes + group()] = node(sum, vec4(radius));
}
