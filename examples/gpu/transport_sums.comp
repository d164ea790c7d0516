/* True dipole transport. Reads places, flux, nodes, and which Gaussians are seen. Writes for each
   Gaussian and each length l the sum of flux exp(-r / l) / r, r = sqrt(distance^2 + soft^2). Writes which
   revision of the flux these are of. A group does 64 neighbours, with four threads for each. A node that
   is far from all 64 is a point; others are opened. If one of the 64 is seen all get their sums, so that
   what is kept does not depend on what was seen before. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "model.glsl"
#include "transport.glsl"

const uint lengths = 5u;
layout(std430, binding = 5) readonly buffer node_block { node node_of[]; };
layout(std430, binding = 6) readonly buffer seen_block { uint seen[]; };
layout(std430, binding = 7) writeonly buffer transport_block { float transported[]; };
layout(std430, binding = 8) buffer arrived_block { uint arrived[]; }; /* the revision of each 64 */
shared vec4 points[256];
shared uint opened[512]; /* nodes of nodes; nodes */
shared uint bits[16]; /* of 256 nodes: those far away; those to be opened */
shared float shares[256 * 5];
shared uint wanted;
vec3 place;
vec4 middle; /* of the 64; how far they are from it */
float sum[lengths];
void add_points(uint many) {
    barrier();
    for (uint i = lane() >> 6u; i < many; i += 4u) {
        vec4 from = points[i];
        if (from.w == 0.0) continue;
        vec3 way = place - from.xyz;
        float r2 = dot(way, way) + objects[o].travel.x, inverse = inversesqrt(r2);
        float e = exp2(r2 * inverse * objects[o].travel.y);
        for (uint k = lengths; k > 0u; k--) {
            sum[k - 1u] += from.w * inverse * e;
            e *= e;
        }
    }
    barrier();
}
/* The box's middle, and how far the 64 are from it. */
void find_middle() {
    points[lane()] = vec4(place, 0);
    barrier();
    vec3 low = place, high = place;
    float reach = 0.0;
    for (uint i = 0u; i < 64u; i++) {
        low = min(low, points[i].xyz);
        high = max(high, points[i].xyz);
    }
    middle.xyz = 0.5 * (low + high);
    for (uint i = 0u; i < 64u; i++) reach = max(reach, distance(points[i].xyz, middle.xyz));
    middle.w = reach;
}
/* Adds those of 256 nodes that are far away; lists the others, and says how many. */
uint open(uint at, bool there, uint list) {
    node of = node_of[first_node() + (there ? at : 0u)];
    bool some = there && of.middle.w > 0.0;
    bool apart = some && distance(of.middle.xyz, middle.xyz) > of.radius.x * far_radii + middle.w;
    uint kind = apart ? 0u : 8u, own = lane() >> 5u, place_of = 0u, counts[2] = uint[2](0u, 0u);
    barrier();
    if (lane() < 16u) bits[lane()] = 0u;
    barrier();
    if (some) atomicOr(bits[kind + own], 1u << (lane() & 31u));
    barrier();
    for (uint word = 0u; word < 16u; word++) counts[word >> 3u] += uint(bitCount(bits[word]));
    for (uint word = 0u; word < own; word++) place_of += uint(bitCount(bits[kind + word]));
    place_of += uint(bitCount(bits[kind + own] & (1u << (lane() & 31u)) - 1u));
    if (apart) points[place_of] = of.middle;
    else if (some) opened[list + place_of] = at;
    add_points(counts[0]);
    return counts[1];
}
void main() {
    uint block = group() % blocks, first = 64u * block;
    light = group() / blocks;
    o = object_at(first);
    if (light >= lights || !is_asked()) return;
    uint me = min(first + (lane() & 63u), end_of() - 1u);
    uint low = first_of() / 64u, nodes = (end_of() + 63u) / 64u;
    if (lane() == 0u) wanted = 0u;
    barrier();
    if (seen[me] == is_seen) wanted = 1u;
    barrier();
    if (wanted == 0u || arrived[light * blocks + block] == uint(lamps[light].of.z)) return;
    place = source(me).xyz;
    if (!is_finite(place)) place = vec3(0); /* it is not drawn; its neighbours are */
    for (uint k = 0u; k < lengths; k++) sum[k] = 0.0;
    find_middle();
    uint top_first = blocks + uint(objects[o].of.z), all_tops = uint(objects[o].of.w);
    for (uint base = 0u; base < all_tops; base += 256u) {
        uint tops = open(top_first + base + lane(), base + lane() < all_tops, 0u);
        for (uint top = 0u; top < tops; top += 4u) {
            uint own = top + lane() / 64u,
                at = own < tops ? low + 64u * (opened[own] - top_first) + lane() % 64u : nodes;
            uint near = open(at, at < nodes, 256u);
            for (uint i = 0u; i < near; i += 4u) {
                uint which = i + lane() / 64u,
                    g = which < near ? 64u * opened[256u + which] + lane() % 64u : end_of();
                points[lane()] = g < end_of() ? source(g) : vec4(0);
                add_points(256u);
            }
        }
    }
    for (uint k = 0u; k < lengths; k++) shares[256u * k + lane()] = sum[k];
    barrier();
    for (uint k = 0u, at = lane(); k < lengths && lane() < 64u && first + lane() < end_of(); k++, at += 256u)
        transported[(light * lengths + k) * count + me] = objects[o].travel.z / float(1u << k) *
            (shares[at] + shares[at + 64u] + shares[at + 128u] + shares[at + 192u]);
    if (lane() == 0u) arrived[light * blocks + block] = uint(lamps[light].of.z);
}
