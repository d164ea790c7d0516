/* What every program knows of a frame. The block `parameters` and the buffer of tables are gpu_parameters
   and gpu_tables in gpu_gl.c. */

layout(std140, binding = 0) uniform parameters {
    vec4 eye;
    vec4 ambient[9];
    uint count, lights, layers, object_count; /* count: Gaussians */
    uint blocks, above, width, height; /* blocks of 64 Gaussians; transport's nodes above them; the picture */
    uint cue, flux, maps, thrifty; /* 1: asked for */
    uint hides, median, parts, map_count; /* 1: there is a scene depth; asked for: median depth, parts;
                                             engine's shadow maps */
    uint slots, works, tiles, camera_tiles; /* at work: views, lights, tiles of all views and of the camera */
    uint sharing, room, total, looks; /* 1: several materials; instances that there is room for; the fact with
                                         all of them; 1: slot 0 is the camera */
    uint segments, keys, shift, rows; /* of a sort */
    float log2_threshold, stop, max_error, bias;
    float pixel_bias, far_radii;
    uint scene_at, scene_raw; /* where the scene's depths begin; 1: an engine's, rows upwards, of which */
    vec4 unseen; /* dot(unseen, (column, row, value, 1)) is 1 / depth */
};
struct lamp {
    vec4 place; /* w = 1: the direction to it */
    vec4 intensity; /* w = 1: it has a map */
    vec4 cone; /* the axis, of a spot or with a focus; w: 1 / range */
    vec4 rim; /* a, b: a spot leaves (a - b |way - axis|^2)^2, within 0 .. 1; z = 1: with cone, range or
                 focus; the focus */
    vec4 share; /* of kept colours */
    ivec4 of; /* its first view, how many; the revision of its flux; 1: transport's nodes are of that */
};
struct projection {
    vec4 view[3];
    vec4 lens; /* fx, fy, cx, cy */
    vec4 kind; /* near plane; 1: orthographic; 1: by distance; 1 / (fx distance) */
    ivec4 size; /* width, height, tiles in a row, tiles */
    ivec4 of; /* the light, -1: the camera; where its light map's tiles begin; at work: its first tile; 1:
                 one of several of a light */
    ivec4 more; /* 1: opacity compensated */
};
struct shadow_map { /* an engine's */
    vec4 clip[4];
    vec4 kind; /* bias, range; 1: clip z from 0; -1: clip y down, else 1 */
    ivec4 size; /* width, height, where its depths begin, the light */
};
struct object {
    vec4 turn[3]; /* its rotation, rows; w: its offset */
    vec4 shape; /* scale, presence, pixel variance, kept */
    vec4 eye; /* in its space; w: the least squared distance */
    vec4 centre; /* w: 1 / length unit */
    vec4 tint; /* w: specular */
    vec4 edit; /* roughness, the depth cue's factor, light scale, virtual depth */
    vec4 travel; /* transport: soft distance^2, -log2(e) / longest length, the shortest length's factor */
    vec4 basis[24]; /* of each lobe: x axis, lambda; y axis, mu; deferred t, s, a */
    vec4 medium[5]; /* RGB weights; what comes to an evenly lit plane */
    ivec4 network[2]; /* scattering's, shadow's: layers, inputs, width, outputs */
    ivec4 inputs; /* octaves of wo, of wi, the networks' columns, harmonics */
    ivec4 place; /* its first Gaussian, how many; where the model's planes begin, their stride */
    ivec4 more; /* where its weights begin, in fours, and the shadow network's; where sky shares begin; where
                   its mask begins, or -1 */
    ivec4 of; /* flags; material; transport's nodes above: the first, how many */
    uvec4 reach; /* bits: the camera, the lights; 0: out of reach */
};
const int diffuse_term = 1; /* flags */
const int specular_term = 2;
const int shadow_term = 4;
const int scattering_term = 8;
const int is_deferred = 16;
const int has_cue = 32;
const int has_transport = 64;
const int residual_shadow = 128;
const int shadow_on_scattering = 256;
const int per_channel_optics = 512;
const int printed_dipole = 1024;
const int has_ambient = 2048;
const int has_medium = 4096;
const int is_baked = 8192;
const int is_lit = 16384; /* lights change it */
const int decodes = 32768; /* kept colours are stored ones, where light is linear */
const int blur_floor = 65536; /* of its splats in light maps */
layout(std430, binding = 0) readonly buffer tables {
    lamp lamps[64];
    projection views[256];
    ivec4 light_at_work[64]; /* the light, its first slot, the slot behind its last */
    shadow_map shadow_maps[64];
    uint view_at_work[256]; /* of each slot */
    object objects[];
};
layout(std430, binding = 1) readonly buffer object_ofs { uint object_of[]; }; /* of 64 Gaussians */
layout(std430, binding = 15) readonly buffer outsides { float outside[]; }; /* shadow maps; scene depth */
layout(std430, binding = 14) buffer slopes { vec2 slope[]; }; /* as in ssdgs_splat_view, of the camera */
layout(std430, binding = 2) buffer facts_ { fact facts[]; }; /* of each view; behind 256 totals */

uint object_at(uint g) { return object_count > 1u ? object_of[g >> 6u] : 0u; }
/* A dispatch of so many groups for each of some parts: which part, and the item within it. */
uint part_of(uint groups) { return group() / groups; }
uint item_of(uint groups) { return group() % groups * 256u + lane(); }
uint groups_of(uint items) { return (items + 255u) >> 8u; }
/* From an object's space to the world, and back. */
vec3 turned(uint o, vec3 v) {
    return vec3(dot(objects[o].turn[0].xyz, v), dot(objects[o].turn[1].xyz, v),
                dot(objects[o].turn[2].xyz, v));
}
vec3 turned_back(uint o, vec3 v) {
    return v.x * objects[o].turn[0].xyz + v.y * objects[o].turn[1].xyz + v.z * objects[o].turn[2].xyz;
}
vec3 offset_of(uint o) { return vec3(objects[o].turn[0].w, objects[o].turn[1].w, objects[o].turn[2].w); }
vec3 to_world(uint o, vec3 p) { return objects[o].shape.x * turned(o, p) + offset_of(o); }
bool reaches(int light, uint o) { /* -1: the camera */
    uint bit = uint(light + 1);
    return (objects[o].reach[bit >> 5u] >> (bit & 31u) & 1u) != 0u;
}
