/* Shared by transport_nodes.comp and transport_sums.comp. Reads the places of Gaussians, and the flux that
   a light brings to each. 64 Gaussians are a node: training leaves neighbours together. After these nodes
   come the nodes above them, of 64 nodes each. */

layout(std140, binding = 0) uniform parameters {
    uint count, stride, light, nodes;
    float soft2, longest, far_radii, scale; /* of the sums of the shortest length */
    uint revision;
};
layout(std430, binding = 0) readonly buffer gauss_block { float gauss[]; };
layout(std430, binding = 1) readonly buffer flux_block { float flux[]; };
struct node {
    vec4 middle; /* of the flux; w: its sum */
    vec4 radius;
};
uint above() { return (nodes + 63u) / 64u; }
uint first_node() { return light * (nodes + above()); }
vec4 source(uint g) {
    return vec4(gauss[g], gauss[stride + g], gauss[2u * stride + g], flux[light * count + g]);
}
