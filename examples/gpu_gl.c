/* ssdgs.h on a GPU: an ssdgs_gpu_hook in OpenGL 4.3 compute shaders. EGL and OpenGL are found when the
   program runs (libEGL.so.1), without a window; building needs neither their headers nor a library but
   dlopen's. Include this file after ssdgs.h with SSDGS_STAGES, or compile it on its own and declare the
   functions of its face.

       char message[256];
       gpu *g = gpu_create(message, sizeof message);
       ssdgs_gpu_hook hook = gpu_hook(g);
       desc.gpu = &hook;                              of ssdgs_context_create()

   What a stage leaves stays on the device, in buffers laid out as the arrays of ssdgs_frame and
   ssdgs_splat_view are documented, but for what is smaller than 32 bits, which becomes 32-bit, and numbers of
   instances, 32-bit too. */
#ifndef SSDGS_STAGES
#define SSDGS_STAGES
#endif
#include "../ssdgs.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifndef _WIN32
#include <dlfcn.h>
#endif

/* ==== face ==== */

typedef struct gpu gpu;
gpu *gpu_create(char *message, size_t size); /* NULL: message says why, as where there is no OpenGL 4.3 */
void gpu_destroy(
    gpu *g); /* after the contexts that have its hook, and all that was made on them; NULL is fine */
/* May serve several contexts, one call at a time, on threads without a GLX context. A frame in which the
   device fails ends with its message; those after it are the CPU's. */
ssdgs_gpu_hook gpu_hook(gpu *g);
const char *gpu_name(const gpu *g); /* of the device */
/* 1: each stage ends when the device is done with it, for timing. 0, the default: the device gets a frame's
   stages all at once. */
void gpu_wait(gpu *g, int waits);

/* ==== EGL and OpenGL ==== */

/* What is called of OpenGL: result, name, arguments. Enumerations, names and counts are 32-bit. */
#define GPU_FUNCTIONS(X) \
    X(void, AttachShader, (uint32_t program, uint32_t shader)) \
    X(void, BindBuffer, (uint32_t target, uint32_t buffer)) \
    X(void, BindBufferBase, (uint32_t target, uint32_t index, uint32_t buffer)) \
    X(void, BufferData, (uint32_t target, intptr_t size, const void *data, uint32_t usage)) \
    X(void, BufferSubData, (uint32_t target, intptr_t offset, intptr_t size, const void *data)) \
    X(void, CompileShader, (uint32_t shader)) \
    X(void, CopyBufferSubData, (uint32_t source, uint32_t to, intptr_t read, intptr_t write, intptr_t size)) \
    X(uint32_t, CreateProgram, (void)) \
    X(uint32_t, CreateShader, (uint32_t type)) \
    X(void, DeleteProgram, (uint32_t program)) \
    X(void, DeleteShader, (uint32_t shader)) \
    X(void, DispatchCompute, (uint32_t x, uint32_t y, uint32_t z)) \
    X(void, Finish, (void)) \
    X(void, GenBuffers, (int32_t count, uint32_t * buffers)) \
    X(void, GetBufferSubData, (uint32_t target, intptr_t offset, intptr_t size, void *data)) \
    X(uint32_t, GetError, (void)) \
    X(void, GetIntegerv, (uint32_t name, int32_t * value)) \
    X(void, GetProgramInfoLog, (uint32_t program, int32_t size, int32_t * length, char *log)) \
    X(void, GetProgramiv, (uint32_t program, uint32_t name, int32_t * value)) \
    X(void, GetShaderInfoLog, (uint32_t shader, int32_t size, int32_t * length, char *log)) \
    X(void, GetShaderiv, (uint32_t shader, uint32_t name, int32_t * value)) \
    X(const unsigned char *, GetString, (uint32_t name)) \
    X(void, LinkProgram, (uint32_t program)) \
    X(void, MemoryBarrier, (uint32_t barriers)) \
    X(void, ShaderSource, \
      (uint32_t shader, int32_t count, const char *const *texts, const int32_t *lengths)) \
    X(void, UseProgram, (uint32_t program))

enum {
    GPU_GL_OUT_OF_MEMORY = 0x0505,
    GPU_GL_RENDERER = 0x1F01,
    GPU_GL_STORAGE_BLOCKS = 0x90DB, /* of a compute program */
    GPU_GL_STORAGE_BINDINGS = 0x90DD,
    GPU_GL_STORAGE_BLOCK_SIZE = 0x90DE,
    GPU_GL_STREAM_READ = 0x88E1,
    GPU_GL_DYNAMIC_DRAW = 0x88E8,
    GPU_GL_UNIFORM_BUFFER = 0x8A11,
    GPU_GL_COMPILE_STATUS = 0x8B81,
    GPU_GL_LINK_STATUS = 0x8B82,
    GPU_GL_COPY_READ_BUFFER = 0x8F36,
    GPU_GL_COPY_WRITE_BUFFER = 0x8F37,
    GPU_GL_SHADER_STORAGE_BUFFER = 0x90D2,
    GPU_GL_COMPUTE_SHADER = 0x91B9,
    GPU_GL_BUFFER_UPDATE_BARRIER_BIT = 0x0200,
    GPU_GL_SHADER_STORAGE_BARRIER_BIT = 0x2000,
    GPU_EGL_DEVICES = 16,
    GPU_EGL_READ = 0x305A,
    GPU_EGL_DRAW = 0x3059,
    GPU_EGL_MAJOR_VERSION = 0x3098,
    GPU_EGL_OPENGL_API = 0x30A2,
    GPU_EGL_MINOR_VERSION = 0x30FB,
    GPU_EGL_PROFILE = 0x30FD,
    GPU_EGL_CORE_PROFILE = 1,
    GPU_EGL_PLATFORM_DEVICE = 0x313F,
    GPU_EGL_PLATFORM_SURFACELESS = 0x31DD,
    GPU_EGL_NONE = 0x3038
};

typedef void (*gpu_function)(void);

typedef struct gpu_egl {
    void *library, *display, *context;
    gpu_function (*GetProcAddress)(const char *name);
    void *(*GetPlatformDisplay)(uint32_t platform, void *native, const int32_t *attributes);
    void *(*GetDisplay)(void *native);
    uint32_t (*QueryDevices)(int32_t room, void **devices, int32_t *count);
    uint32_t (*Initialize)(void *display, int32_t *major, int32_t *minor);
    uint32_t (*BindAPI)(uint32_t api);
    uint32_t (*QueryAPI)(void);
    void *(*CreateContext)(void *display, void *config, void *share, const int32_t *attributes);
    uint32_t (*DestroyContext)(void *display, void *context);
    uint32_t (*MakeCurrent)(void *display, void *draw, void *read, void *context);
    void *(*GetCurrentContext)(void);
    void *(*GetCurrentDisplay)(void);
    void *(*GetCurrentSurface)(int32_t which);
} gpu_egl;

typedef struct gpu_gl {
#define GPU_MEMBER(result, name, arguments) result(*name) arguments;
    GPU_FUNCTIONS(GPU_MEMBER)
#undef GPU_MEMBER
} gpu_gl;

/* Memory of the device. All zero: none yet. */
typedef struct gpu_buffer {
    uint32_t name;
    size_t size; /* bytes */
} gpu_buffer;

/* The compute programs, compiled when they are first used. */
typedef enum gpu_program {
    GPU_SEEN_LIST,
    GPU_SEEN_COPY,
    GPU_TRANSPORT_NODES,
    GPU_TRANSPORT_SUMS,
    GPU_SHADE,
    GPU_HIGHLIGHT,
    GPU_PROJECT,
    GPU_SORT_COUNT,
    GPU_SORT_SCATTER,
    GPU_BIN_COUNT,
    GPU_BIN_EMIT,
    GPU_BIN_END,
    GPU_WALK_CAMERA,
    GPU_GATHER_CAMERA,
    GPU_WALK_LIGHT,
    GPU_WALK_MAP,
    GPU_GATHER_LIGHT,
    GPU_BLEND,
    GPU_BLEND_LAYERS,
    GPU_PROGRAMS
} gpu_program;

/* The program's caller may have a context of its own current: it gets it back. */
typedef struct gpu_current {
    void *display, *draw, *read, *context;
    uint32_t api;
} gpu_current;

/* What the stages up to WALK leave of a view, as in ssdgs_splat_view. */
typedef struct gpu_view {
    gpu_buffer record, depth, order, instance, of_gaussian, tile_start, tile_list, tile_seen, tile_needed,
        tile_sums;
} gpu_view;

/* The maps of a light's faces, one after the other: map_tile (faces, tiles) counts through all of them. */
typedef struct gpu_light {
    gpu_buffer light_map, map_tile;
    int ready; /* 1: the nodes are of the flux, and transport of what has this revision */
    uint32_t revision;
} gpu_light;

/* What only the device counts of a view. */
typedef struct gpu_fact {
    uint32_t visible, instances; /* instances: as many as there should be room for */
    float nearest;
} gpu_fact;

/* What a frame leaves, as in ssdgs_frame. */
typedef struct gpu_frame {
    gpu_view camera, face; /* the latter of the light's view at work */
    gpu_buffer facts;      /* (views) */
    gpu_light *light;
    int lights;           /* that there is room for */
    gpu_buffer gaussians; /* (SSDGS_CHANNELS, stride) the model's */
    gpu_buffer seen, visibility, depth_cue, flux;
    gpu_buffer shaded, color, layers; /* shaded: its count, then the Gaussians */
    gpu_buffer pixels, layer_pixels, transmittance, pixel_visibility, pixel_shadow;
    gpu_buffer networks, lamps, exposures, tally, neighbours; /* of SHADE */
    gpu_buffer nodes, transport, arrived; /* arrived: the revision, (lights, blocks of 64 Gaussians) */
    gpu_buffer faces;                     /* of the highlights */
} gpu_frame;

/* What stages use while they run. */
typedef struct gpu_scratch {
    gpu_buffer key[2], value[2]; /* what is sorted, from one to the other */
    gpu_buffer digits;           /* (blocks, 256) how often a digit is in a block */
    gpu_buffer groups;           /* (groups) instances of 256 ranks */
    gpu_buffer owner;            /* (instances) their Gaussians */
    gpu_buffer sums;             /* (n, 4) tile_sums of a light's views so far */
} gpu_scratch;

struct gpu {
    gpu_egl egl;
    gpu_gl gl;
    int32_t most; /* bytes of a buffer that programs can see */
    gpu_current callers;
    uint32_t program[GPU_PROGRAMS];
    gpu_buffer parameters, staging; /* staging: what downloads go by */
    gpu_frame frame;
    void *host; /* what gpu_host() gives */
    size_t host_size;
    gpu_scratch scratch;
    size_t instance_room; /* of each view */
    const void *model;    /* which one, of which revision, is uploaded */
    uint64_t revision;
    int exposed;         /* 1: the buffer `exposures` is this model's */
    uint32_t revisions;  /* that flux has had so far */
    double detail;       /* options.transport_detail that transport has */
    int busy;            /* 1: programs may still run */
    const void *owner;   /* frame.memory of the last frame: what views have left is of its */
    int lost;            /* 1: something has failed, and all is the CPU's from then on */
    int waits;           /* 1: for the device at the end of each stage */
    char name[128];      /* the device's */
    ssdgs_result result; /* the first failure since gpu_enter(): what follows it does nothing */
    char message[1024];
};

/* ==== shaders ==== */

/* GLSL is written as it is and becomes a string, whose line breaks and comments are gone. A compiler need
   take no string longer than 4095 characters, so a program's text is several, one after the other. No loop is
   left by return: NVIDIA's driver 580 takes its step even so. */
#define GPU_GLSL(...) #__VA_ARGS__ "\n"
enum { GPU_PARTS = 9 };
/* clang-format off */

/* What all programs begin with. A group is 256 threads, or a tile's pixels. group() counts
   through groups, where they are more than a dimension can have, too. */
static const char gpu_common[] = "#version 430\n" GPU_GLSL(
layout(local_size_x = 256) in;
uint lane() { return gl_LocalInvocationIndex; }
uint group() { return gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x; }
uint item() { return group() * 256u + lane(); }
);

/* Columns of the matrix: the axes of a quaternion w x y z of any length; 0 is the identity. First by the
   largest: squares neither over- nor underflow. */
static const char gpu_rotation[] = GPU_GLSL(
mat3 rotation(vec4 q) {
    float largest = max(max(abs(q.x), abs(q.y)), max(abs(q.z), abs(q.w)));
    q = largest < 1e-37 ? vec4(0) : q / largest;
    q *= 1 / sqrt(max(dot(q, q), 1e-30));
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
                2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
                2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
}
);

/* ---- SHADE, and COMPOSITE's highlights ---- */

/* What they know of a frame: struct gpu_lighting. */
static const char gpu_lit_frame[] = GPU_GLSL(
const int diffuse = 11; /* channels of a Gaussian */
const int specular = 14;
const int scattering = 17;
const int frame = 20;
const int asg_weight = 24;
const int material = 32;
const int diffuse_term = 1; /* flags */
const int specular_term = 2;
const int shadow_term = 4;
const int scattering_term = 8;
const int deferred = 16;
const int depth_cue = 32;
const int transport = 64;
const int residual_shadow = 128;
const int shadow_on_scattering = 256;
const int per_channel_optics = 512;
const int printed_dipole = 1024;
const int has_ambient = 2048;
const int has_medium = 4096;
const int visibility_given = 8192;
const int lengths = 5; /* of true dipole transport */
layout(std140, binding = 0) uniform parameters {
    vec4 eye; /* w: the least squared distance */
    vec4 centre; /* w: 1 / length unit */
    vec4 basis[24]; /* of each lobe: x axis, lambda; y axis, mu; deferred t, s, a */
    vec4 ambient[9];
    vec4 medium[lengths]; /* RGB weights; what comes to an evenly lit plane */
    vec4 camera[3]; /* its rotation; w: 1 / fx, 1 / fy, the bias of pixels in light maps */
    vec4 lens; /* virtual depth, light scale, cx, cy */
    ivec4 network[2]; /* scattering's, shadow's: layers, inputs, width, outputs */
    ivec4 inputs; /* octaves of wo, of wi, the networks' columns, where the shadow network's weights begin */
    ivec4 faces; /* of the light at work: the first view, how many; the light */
    ivec4 counts; /* Gaussians, stride of their planes, lights, layers */
    ivec4 size; /* width, height; flags */
};
struct lamp {
    vec4 place; /* w = 1: the direction to it */
    vec4 intensity; /* w = 1: it has a map */
    vec4 cone; /* the axis, of a spot or with a focus; w: 1 / range */
    vec4 rim; /* a spot leaves (a - b |way - axis|^2)^2, within 0 .. 1; z = 1: with cone, range or focus; focus */
};
bool on(int flag) { return (size.z & flag) != 0; }
);

static const char gpu_lit_functions[] = GPU_GLSL(
bool broken(float x) { return (floatBitsToUint(x) & 0x7f800000u) == 0x7f800000u; }
bool broken(vec3 x) { return broken(x.x) || broken(x.y) || broken(x.z); }
float power_of_e(float x) { return exp(clamp(x, -87.0, 87.0)); }
float sigmoid(float x) { return 1.0 / (1.0 + power_of_e(-x)); }
vec3 sigmoid(vec3 x) { return vec3(sigmoid(x.x), sigmoid(x.y), sigmoid(x.z)); }
float log_1_plus(float x) { /* of 0 .. 1 */
    float t = x / (x + 2.0);
    float t2 = t * t;
    float p = 2.0 / 17.0;
    for (float i = 15.0; i > 1.0; i -= 2.0) p = p * t2 + 2.0 / i;
    return p * t2 * t + 2.0 * t;
}
float softplus(float x) { return max(x, 0.0) + log_1_plus(power_of_e(-abs(x))); }
vec3 softplus(vec3 x) { return vec3(softplus(x.x), softplus(x.y), softplus(x.z)); }
/* Eq. 8: S of a visibility and the shadow network's answer. */
float shadow_factor(bool shadowed, float visibility, float answer) {
    if (!shadowed) return 1.0;
    if (network[1].x == 0) return visibility;
    float v = clamp(visibility, 0.01, 0.99);
    return sigmoid(on(residual_shadow) ? log(v / (1.0 - v)) + answer : answer);
}
/* h = wi + wo made a unit vector, 1 - wo.h; false: there is none. */
bool half_vector(vec3 wi, vec3 wo, out vec3 h, out float missing) {
    float h2 = dot(wi + wo, wi + wo);
    h = (wi + wo) / sqrt(max(h2, 1e-12));
    missing = clamp(1.0 - dot(wo, h), 0.0, 1.0);
    return h2 >= 1e-12;
}
float schlick(float f0, float missing) {
    float square = missing * missing;
    return f0 + (1.0 - f0) * (square * square * missing);
}
);

/* The Gaussians to be shaded, ascending, and for each that is skipped the place of its neighbour among them.
   What is drawn is known by the walk, which has counted 256 at a time. */
static const char gpu_seen[] = GPU_GLSL(
layout(std140, binding = 0) uniform parameters { uint count; uint layer_count; };
layout(std430, binding = 0) buffer seen_block { uint seen[]; };
layout(std430, binding = 1) buffer tally_block { uvec2 tally[]; }; /* seen; the first skipped */
layout(std430, binding = 2) buffer shaded_block { uint shaded_count; uint shaded[]; };
const uint is_seen = 1u;
const uint is_skipped = 2u;
);

/* Where all are skipped, some colour is needed: the first's. */
static const char gpu_seen_list[] = GPU_GLSL(
layout(std430, binding = 3) writeonly buffer neighbour_block { uint neighbours[]; };
shared uint first;
void main() {
    bool within = item() < count;
    uint is = within ? seen[item()] : 0u, before = 0u, all = 0u, own;
    if (lane() == 0u) first = none;
    barrier();
    for (uint at = lane(); 256u * at < count; at += 256u) {
        all += tally[at].x;
        if (at < group()) before += tally[at].x;
        if (tally[at].y != none) atomicMin(first, tally[at].y);
    }
    scan(before, before); /* of each the total alone */
    scan(all, all);
    if (all == 0u && item() == first) seen[item()] = is = is_seen;
    uint place = before + scan(uint(is == is_seen), own);
    if (item() == 0u) shaded_count = all == 0u && first != none ? 1u : all;
    if (!within) return;
    if (is == is_seen) shaded[place] = item();
    neighbours[item()] = is == is_skipped ? max(place, 1u) - 1u : none;
}
);

/* What is skipped takes its neighbour's colour. */
static const char gpu_seen_copy[] = GPU_GLSL(
layout(std430, binding = 3) readonly buffer neighbour_block { uint neighbours[]; };
layout(std430, binding = 4) buffer color_block { vec4 colors[]; };
layout(std430, binding = 5) buffer layer_block { vec4 layers[]; };
void main() {
    if (item() >= count || neighbours[item()] == none) return;
    uint from = shaded[neighbours[item()]];
    colors[item()] = colors[from];
    for (uint i = 0u; i < layer_count; i++) layers[i * count + item()] = layers[i * count + from];
}
);

/* Where light enters: nodes of 64 Gaussians, neighbours as training leaves them, and after them nodes of 64
   nodes. */
static const char gpu_transport_in[] = GPU_GLSL(
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
vec4 source(uint g) { return vec4(gauss[g], gauss[stride + g], gauss[2u * stride + g], flux[light * count + g]); }
);

/* A group makes 64 nodes and the one above them; a thread sums 16 Gaussians. */
static const char gpu_transport_nodes[] = GPU_GLSL(
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
);

/* To 64 neighbours a group, by four threads each: sums of flux exp(-r / l) / r, r = sqrt(distance^2 + soft^2),
   for each length l. Nodes that are far from all 64 are points, the others are opened. What one of the 64 needs
   all get, so what is kept does not depend on what has been seen before. */
static const char gpu_transport[] = GPU_GLSL(
const uint lengths = 5u;
const uint is_seen = 1u;
layout(std430, binding = 2) readonly buffer node_block { node node_of[]; };
layout(std430, binding = 3) readonly buffer seen_block { uint seen[]; };
layout(std430, binding = 4) writeonly buffer transport_block { float transported[]; };
layout(std430, binding = 5) buffer arrived_block { uint arrived[]; }; /* the revision of each 64 */
shared vec4 points[256];
shared uint opened[512]; /* nodes of nodes; nodes */
shared uint bits[16]; /* of 256 nodes: those far away; those to be opened */
shared float parts[256 * 5];
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
        float r2 = dot(way, way) + soft2, inverse = inversesqrt(r2), e = exp2(r2 * inverse * longest);
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
    uint first = 64u * group();
    if (first >= count) return;
    uint me = min(first + (lane() & 63u), count - 1u);
    if (lane() == 0u) wanted = 0u;
    barrier();
    if (seen[me] == is_seen) wanted = 1u;
    barrier();
    if (wanted == 0u || arrived[light * nodes + group()] == revision) return;
    place = source(me).xyz;
    for (uint k = 0u; k < lengths; k++) sum[k] = 0.0;
    find_middle();
    for (uint base = 0u; base < above(); base += 256u) {
        uint tops = open(nodes + base + lane(), base + lane() < above(), 0u);
        for (uint top = 0u; top < tops; top += 4u) {
            uint own = top + lane() / 64u, at = own < tops ? 64u * (opened[own] - nodes) + lane() % 64u : nodes;
            uint near = open(at, at < nodes, 256u);
            for (uint i = 0u; i < near; i += 4u) {
                uint which = i + lane() / 64u, g = which < near ? 64u * opened[256u + which] + lane() % 64u : count;
                points[lane()] = g < count ? source(g) : vec4(0);
                add_points(256u);
            }
        }
    }
    for (uint k = 0u; k < lengths; k++) parts[256u * k + lane()] = sum[k];
    barrier();
    for (uint k = 0u, at = lane(); k < lengths && lane() < 64u && first + lane() < count; k++, at += 256u)
        transported[(light * lengths + k) * count + me] =
            scale / float(1u << k) * (parts[at] + parts[at + 64u] + parts[at + 128u] + parts[at + 192u]);
    if (lane() == 0u) arrived[light * nodes + group()] = revision;
}
);

/* Networks of as many inputs as 4096 values hold, a column each, in place: a thread sums 4 neurons of 4
   columns. Those lie apart, so that neighbours read neighbours. Weights: (inputs, neurons), then biases;
   neurons are padded to 4. A hidden one that is NaN becomes 0, as on the CPU. */
static const char gpu_network[] = GPU_GLSL(
layout(std430, binding = 0) readonly buffer weight_block { vec4 weight[]; };
shared float row[4096];
void run_network(ivec4 net, int at) {
    int columns = inputs.z;
    int apart = columns / 4;
    int column = int(lane()) % apart;
    int first = int(lane()) / apart * 4;
    int depth = net.y;
    for (int layer = 1; layer <= net.x; layer++) {
        int neurons = layer < net.x ? net.z : net.w;
        int stride = (neurons + 3) / 4;
        int from = at + first / 4;
        vec4 sum0 = vec4(0);
        vec4 sum1 = vec4(0);
        vec4 sum2 = vec4(0);
        vec4 sum3 = vec4(0);
        barrier();
        if (first < neurons) {
            int x = column;
            for (int k = 0; k < depth; k++, from += stride, x += columns) {
                vec4 w = weight[from];
                vec4 v = vec4(row[x], row[x + apart], row[x + 2 * apart], row[x + 3 * apart]);
                sum0 += w.x * v;
                sum1 += w.y * v;
                sum2 += w.z * v;
                sum3 += w.w * v;
            }
            vec4 bias = weight[from];
            sum0 += bias.x;
            sum1 += bias.y;
            sum2 += bias.z;
            sum3 += bias.w;
        }
        barrier();
        if (layer < net.x) {
            sum0 = mix(vec4(0), sum0, greaterThan(sum0, vec4(0)));
            sum1 = mix(vec4(0), sum1, greaterThan(sum1, vec4(0)));
            sum2 = mix(vec4(0), sum2, greaterThan(sum2, vec4(0)));
            sum3 = mix(vec4(0), sum3, greaterThan(sum3, vec4(0)));
        }
        if (first < neurons) {
            for (int i = 0; i < 4; i++) {
                int to = first * columns + column + i * apart;
                row[to] = sum0[i];
                row[to + columns] = sum1[i];
                row[to + 2 * columns] = sum2[i];
                row[to + 3 * columns] = sum3[i];
            }
        }
        at += (depth + 1) * stride;
        depth = neurons;
    }
    barrier();
}
int put(int at, float x) {
    row[at * inputs.z + int(lane())] = x;
    return at + 1;
}
float answer_of(int at) { return row[at * inputs.z + int(lane())]; }
/* pi / 2 in three parts, good to 1e5 */
void sine_cosine(float x, out float s, out float c) {
    float n = round(x * 0.636619772);
    precise float r = x - n * 1.5703125;
    r = r - n * 4.83751296997070e-4;
    r = r - n * 7.54978995489188e-8;
    float r2 = r * r;
    float ps = ((-1.9515295891e-4 * r2 + 8.3321608736e-3) * r2 - 1.6666654611e-1) * r2 * r + r;
    float pc = ((2.4433157118e-5 * r2 - 1.3887316255e-3) * r2 + 4.1666645683e-2) * (r2 * r2) - 0.5 * r2 + 1.0;
    int quadrant = int(n) & 3;
    s = (quadrant & 1) == 0 ? ps : pc;
    c = (quadrant & 1) == 0 ? pc : ps;
    s = quadrant > 1 ? -s : s;
    c = quadrant == 1 || quadrant == 2 ? -c : c;
}
/* x, its sines, its cosines, each row after `dims` others'; one sine and cosine, the others by doubling the
   angle. */
void encode(int at, int dims, float x, int levels) {
    float s;
    float c;
    put(at, x);
    sine_cosine(clamp(x, -1e5, 1e5), s, c);
    for (int i = 1; i <= levels; i++) {
        float twice = s + s;
        put(at + dims * i, s);
        put(at + dims * (levels + i), c);
        s = twice * c;
        c = 1.0 - twice * (0.5 * twice);
    }
}
int encode(int at, vec3 x, int levels) {
    for (int i = 0; i < 3; i++) encode(at + i, 3, x[i], levels);
    return at + 3 + 6 * levels;
}
);

/* A Gaussian under a light: eqs. 9 to 12. */
static const char gpu_reflect[] = GPU_GLSL(
layout(std430, binding = 1) readonly buffer lamp_block { lamp lamps[]; };
layout(std430, binding = 2) readonly buffer gauss_block { float gauss[]; };
uint me; /* the Gaussian */
vec3 place;
mat3 axes; /* of its frame; the third is the normal */
vec3 wi;
vec3 wo;
float irradiance;
float cosine;
float gloss;
float raw(int channel) { return gauss[uint(channel) * uint(counts.y) + me]; }
vec3 place_of(uint g) { return vec3(gauss[g], gauss[uint(counts.y) + g], gauss[2u * uint(counts.y) + g]); }
vec3 raw3(int channel) { return vec3(raw(channel), raw(channel + 1), raw(channel + 2)); }
/* NaN, which max() and clamp() may lose. */
bool is_broken() {
    bool any = false;
    for (int i = diffuse; i < material; i++) any = any || (floatBitsToUint(raw(i)) & 0x7fffffffu) > 0x7f800000u;
    return any;
}
void find_frame() {
    place = place_of(me);
    axes = rotation(vec4(raw(frame), raw3(frame + 1)));
    vec3 to = eye.xyz - place;
    wo = to / sqrt(max(dot(to, to), eye.w));
}
/* Deferred: sqrt(lambda mu). */
float lobe_height() {
    return power_of_e(0.5 * (clamp(raw(asg_weight), -12.0, 12.0) + clamp(raw(asg_weight + 1), -12.0, 12.0)));
}
void find_geometry(lamp l) {
    bool directional = l.place.w > 0.0;
    vec3 to = directional ? l.place.xyz : l.place.xyz - place;
    irradiance = directional ? 1.0 : 1.0 / max(dot(to, to), eye.w);
    wi = to * sqrt(irradiance);
    cosine = max(0.0, dot(axes[2], wi));
    gloss = lobe_height(); /* deferred: the rest is the pixels' */
    if (on(deferred)) return;
    vec3 h;
    float missing;
    float sum = 0.0;
    bool shines = half_vector(wi, wo, h, missing) && on(specular_term);
    vec3 local = h * axes;
    for (int j = 0; j < 8 && shines; j++) {
        vec4 x = basis[3 * j];
        vec4 y = basis[3 * j + 1];
        float along = dot(x.xyz, local);
        float across = dot(y.xyz, local);
        sum += softplus(raw(asg_weight + j)) * power_of_e(-(x.w * along * along + y.w * across * across));
    }
    gloss = schlick(0.04, missing) * sum;
}
/* What a spot's cone, the range and the focus leave. */
float reach_of(lamp l, vec3 at) {
    vec3 way = at - l.place.xyz;
    float distance2 = dot(way, way);
    float far = distance2 * l.cone.w * l.cone.w;
    way /= sqrt(distance2 > 0.0 ? distance2 : 1.0);
    vec3 beside = way - l.cone.xyz;
    /* at the light itself the cosine counts as 0 */
    float beside2 = distance2 > 0.0 ? dot(beside, beside) : 1.0 + dot(l.cone.xyz, l.cone.xyz);
    float share = clamp(l.rim.x - l.rim.y * beside2, 0.0, 1.0);
    float focused = l.rim.w > 0.0 ? pow(max(dot(way, l.cone.xyz), 0.0), l.rim.w) : 1.0;
    return share * share * focused * max(0.0, 1.0 - far * far);
}
);

/* Eqs. 3 to 5 and 13. */
static const char gpu_colour[] = GPU_GLSL(
vec3 diffuse_sum;
vec3 specular_sum;
vec3 scattering_sum;
float dipole(float ss, float sa, float r) {
    float st = ss + sa;
    float s = on(printed_dipole) ? st : sqrt(3.0 * sa * st);
    float zr = 1.0 / st;
    float zv = zr * lens.x;
    float dr = sqrt(r * r + zr * zr);
    float dv = sqrt(r * r + zv * zv);
    float q = on(printed_dipole) ? dr : dv;
    float first = (s * dr + 1.0) * power_of_e(-s * dr) / (dr * dr * dr);
    float second = (s * q + 1.0) * power_of_e(-s * dv) / (dv * dv * dv);
    return ss * zr * 0.079577471545947668 * (zr * first + (on(printed_dipole) ? zr * zv : zv) * second);
}
/* Of the scattering network's answers. */
vec3 profile() {
    vec3 found = vec3(0.0);
    for (int c = 0; c < (on(per_channel_optics) ? 3 : 1); c++) {
        ivec3 at = on(per_channel_optics) ? ivec3(c, 3 + c, 6) : ivec3(0, 1, 2);
        vec3 unit = sigmoid(vec3(answer_of(at.x), answer_of(at.y), answer_of(at.z)));
        found[c] = dipole(2.0 * unit.x + 0.05, 2.0 * unit.y + 0.05, 3.0 * unit.z + 0.1);
    }
    return on(per_channel_optics) ? found : vec3(found.x);
}
/* Adds a light's; `arrives` of transport's lengths. Deferred ones are without S. */
void add_colour(vec3 intensity, float shadow, float arrives[lengths]) {
    vec3 power = irradiance * intensity;
    vec3 lit = on(deferred) ? power : shadow * power;
    if (on(diffuse_term)) diffuse_sum += softplus(raw3(diffuse)) * (0.31830988618 * cosine) * lit;
    if (on(specular_term)) specular_sum += softplus(raw3(specular)) * gloss * lit;
    if (!on(scattering_term)) return;
    vec3 through = vec3(0);
    for (int i = 0; i < lengths && on(has_medium); i++) through += 0.31830988618 * medium[i].rgb * arrives[i];
    if (!on(has_medium)) through = profile() * (on(shadow_on_scattering) ? shadow : 1.0);
    scattering_sum += softplus(raw3(scattering)) * through * power;
}
/* The networks' inputs. */
void encode_shadow(float visibility) {
    int at = encode(0, (place - centre.xyz) * (on(residual_shadow) ? centre.w : 1.0), 3);
    at = put(encode(at, wi, 3), visibility);
    for (int i = 0; i < 6; i++) at = put(at, raw(material + i));
}
void encode_scattering(float cue, float arrives[lengths]) {
    int at = encode(0, (place - centre.xyz) * (on(depth_cue | transport) ? centre.w : 1.0), 4);
    at = encode(encode(at, wo, inputs.x), wi, inputs.y);
    for (int i = 0; i < 3; i++) at = put(at, axes[2][i]);
    for (int i = 0; i < 6; i++) at = put(at, raw(material + i));
    if (on(depth_cue)) {
        encode(at, 1, cue * centre.w, 4);
        at += 9;
    }
    for (int i = 0; i < lengths && on(transport); i++) at = put(at, arrives[i]);
}
);

/* Deferred highlights' layers, and ambient light. */
static const char gpu_lobe[] = GPU_GLSL(
layout(std430, binding = 10) writeonly buffer layer_block { vec4 layers[]; };
bool live; /* the thread has a Gaussian of its own */
bool black; /* something is not finite, or too large */
void write_layer(int layer, vec3 value) {
    black = black || broken(value) || any(greaterThan(abs(value), vec3(1e30)));
    if (live) layers[uint(layer) * uint(counts.x) + me] = vec4(value, 0);
}
/* Q of the pixel's highlight, depth, F0, cover, normal. */
void write_lobe(float depth) {
    vec3 x = axes[0];
    vec3 y = axes[1];
    float along = power_of_e(clamp(raw(asg_weight), -12.0, 12.0));
    float across = power_of_e(clamp(raw(asg_weight + 1), -12.0, 12.0));
    write_layer(0, along * x * x + across * y * y);
    write_layer(1, along * x * x.yzx + across * y * y.yzx);
    write_layer(2, vec3(depth, sigmoid(raw(asg_weight + 2) - 3.1780538303479458), 1));
    write_layer(3, axes[2]);
}
/* What a lobe e^(-x u), u = 1 - (n.h)^2, sends back along n of a sky of radiance 1, over 4 pi. */
float lobe_share(float x) {
    bool even = x < 0.03;
    float share = even ? 0.5 - x / 8.0 : (1.0 - power_of_e(-0.5 * x)) / x;
    if (!on(deferred)) return share;
    return (even ? 0.25 - x / 24.0 : (1.0 - 2.0 * share) / x) * (1.0 + 1.0 / (4.4 + 0.75 * x));
}
float lobe_energy() {
    float sum = 0.0;
    float narrower = lobe_height();
    for (int j = 0; j < 8; j++) {
        vec4 b = basis[3 * j + 2];
        if (on(deferred)) sum += b.z * lobe_share(b.y * narrower);
        else sum += softplus(raw(asg_weight + j)) * lobe_share(sqrt(basis[3 * j].w * basis[3 * j + 1].w));
    }
    return 12.566370614359172 * sum * (on(deferred) ? narrower : 1.0);
}
/* The irradiance of ambient light on a surface with a normal. */
vec3 ambient_at(vec3 n) {
    return max(vec3(0), ambient[0].rgb + n.y * ambient[1].rgb + n.z * ambient[2].rgb + n.x * ambient[3].rgb +
        n.x * n.y * ambient[4].rgb + n.y * n.z * ambient[5].rgb + (3.0 * n.z * n.z - 1.0) * ambient[6].rgb +
        n.x * n.z * ambient[7].rgb + (n.x * n.x - n.y * n.y) * ambient[8].rgb);
}
/* Light from all around falls as from along the normal, and a highlight mirrors what is around its
   direction. */
void find_ambient_geometry(float exposure) {
    float facing = dot(axes[2], wo);
    float steep = on(deferred) ? min(1.0, max(0.0, facing) / 0.25) : 1.0;
    float f0 = on(deferred) ? sigmoid(raw(asg_weight + 2) - 3.1780538303479458) : 0.04;
    wi = axes[2];
    irradiance = exposure;
    cosine = 1.0;
    facing = clamp(facing, 0.0, 1.0);
    gloss = on(specular_term) ? schlick(f0, 1.0 - facing) * lobe_energy() : 0.0;
    gloss *= (on(deferred) ? steep * steep : facing) * 0.31830988618;
}
);

/* What is seen, in groups of a network's columns, the lights one after the other. */
static const char gpu_shade_main[] = GPU_GLSL(
layout(std430, binding = 3) readonly buffer shaded_block { uint shaded_count; uint shaded[]; };
layout(std430, binding = 4) readonly buffer visibility_block { float visibilities[]; };
layout(std430, binding = 5) readonly buffer cue_block { float cues[]; };
layout(std430, binding = 6) readonly buffer transport_block { float transported[]; };
layout(std430, binding = 7) readonly buffer exposure_block { float exposures[]; };
layout(std430, binding = 8) readonly buffer depth_block { float depths[]; };
layout(std430, binding = 9) writeonly buffer color_block { vec4 colors[]; };
shared uint lit;
bool mine; /* the thread has a column */
/* Whether any is in the light's reach, of the 64 that the CPU shades together. */
bool reached(lamp l) {
    uint at = group() * uint(inputs.z) / 64u * 64u + lane();
    barrier();
    if (lane() == 0u) lit = 0u;
    barrier();
    if (lane() < 64u && reach_of(l, place_of(shaded[min(at, shaded_count - 1u)])) > 0.0) atomicOr(lit, 1u);
    barrier();
    return lit != 0u;
}
void add_light(int i) {
    lamp l = lamps[i];
    bool casts = l.intensity.w > 0.0;
    bool shadowed = casts && on(shadow_term);
    float share = mine && l.rim.z > 0.0 ? reach_of(l, place) : 1.0;
    float visibility = 1.0;
    float cue = 0.0;
    float answer = 0.0;
    float arrives[lengths] = float[lengths](0.0, 0.0, 0.0, 0.0, 0.0);
    if (l.rim.z > 0.0 && !reached(l)) {
        if (!on(deferred)) return;
        write_layer(4 + 3 * i, vec3(0));
        write_layer(5 + 3 * i, vec3(0));
        write_layer(6 + 3 * i, vec3(0, 1, sigmoid(raw(asg_weight + 3)))); /* there S is 1 */
        return;
    }
    if (mine) {
        find_geometry(l);
        uint at = uint(counts.x) * uint(i) + me;
        if (shadowed) visibility = visibilities[at];
        if (casts && on(depth_cue) && on(scattering_term)) cue = cues[at];
        for (int k = 0; k < lengths && on(transport); k++) {
            float brought = casts ? transported[uint(counts.x) * uint(lengths * i + k) + me] : 0.0;
            if (casts) arrives[k] = irradiance > 0.0 ? brought / irradiance : 0.0;
            else arrives[k] = cosine * medium[k].w;
        }
    }
    if (shadowed && network[1].x > 0) {
        if (mine) encode_shadow(visibility);
        run_network(network[1], inputs.w);
        if (mine) answer = answer_of(0);
    }
    if (on(scattering_term) && !on(has_medium)) {
        if (mine) encode_scattering(cue, arrives);
        run_network(network[0], 0);
    }
    if (!mine) return;
    float shadow = shadow_factor(shadowed, visibility, answer);
    irradiance *= share;
    add_colour(l.intensity.rgb, shadow, arrives);
    if (!on(deferred)) return;
    write_layer(4 + 3 * i, specular_sum);
    write_layer(5 + 3 * i, diffuse_sum);
    write_layer(6 + 3 * i, vec3(answer, visibility, sigmoid(raw(asg_weight + 3))));
    specular_sum = vec3(0);
    diffuse_sum = vec3(0);
}
void add_ambient() {
    float arrives[lengths];
    vec3 before[3] = vec3[3](diffuse_sum, specular_sum, scattering_sum);
    if (mine) find_ambient_geometry(exposures[me]);
    for (int k = 0; k < lengths; k++) arrives[k] = on(transport) ? medium[k].w : 0.0;
    if (on(scattering_term) && !on(has_medium)) {
        if (mine) encode_scattering(0.0, arrives);
        run_network(network[0], 0);
    }
    if (!mine) return;
    diffuse_sum = vec3(0);
    specular_sum = vec3(0);
    scattering_sum = vec3(0);
    add_colour(vec3(lens.y), 1.0, arrives);
    vec3 sum = ambient_at(axes[2]) * (diffuse_sum + scattering_sum);
    sum += ambient_at(2.0 * dot(axes[2], wo) * axes[2] - wo) * specular_sum;
    diffuse_sum = before[0];
    specular_sum = before[1];
    scattering_sum = before[2] + sum;
}
void main() {
    uint at = group() * uint(inputs.z);
    if (at >= shaded_count) return;
    mine = int(lane()) < inputs.z;
    at += lane();
    live = mine && at < shaded_count;
    me = shaded[min(at, shaded_count - 1u)];
    diffuse_sum = specular_sum = scattering_sum = vec3(0);
    black = false;
    if (mine) {
        find_frame();
        if (counts.w > 0) write_lobe(depths[me]);
    }
    for (int i = 0; i < counts.z; i++) add_light(i);
    if (on(has_ambient)) add_ambient();
    if (!live) return;
    vec3 sum = diffuse_sum + specular_sum + scattering_sum;
    black = black || broken(sum) || broken(axes[2]) || is_broken();
    for (int i = 0; i < counts.w && black; i++) layers[uint(i) * uint(counts.x) + me] = vec4(0);
    colors[me] = black ? vec4(0, 0, 0, 1) : vec4(sum, 0);
}
);

/* Deferred: a pixel under one light, from what its Gaussians blend to. */
static const char gpu_light_map[] = GPU_GLSL(
layout(std430, binding = 0) readonly buffer layer_pixel_block { float layer_pixels[]; };
layout(std430, binding = 1) readonly buffer lamp_block { lamp lamps[]; };
struct light_pixel {
    float fall[3]; /* the distances at which transmittance falls */
    float left[2];
    float before[2];
    float behind;
};
struct face {
    vec4 view[3];
    vec4 lens; /* fx, fy, cx, cy */
    vec4 kind; /* near plane; 1: orthographic; 1: by distance */
    ivec4 size; /* width, height, tiles in a row, tiles */
};
layout(std430, binding = 2) readonly buffer face_block { face face_of[]; };
layout(std430, binding = 3) readonly buffer fact_block { fact facts[]; };
layout(std430, binding = 4) readonly buffer map_tile_block { uint map_tiles[]; };
layout(std430, binding = 5) readonly buffer light_map_block { light_pixel light_pixels[]; };
/* Through a map's pixel: what a fall leaves stays until the next is nearer than `thick`, and from there goes
   straight to what there was before that. */
float passed(face f, int tiles_before, ivec2 p, float distance, float thick) {
    uint tile = map_tiles[tiles_before + (p.y >> 4) * f.size.z + (p.x >> 4)];
    if (tile == 0xffffffffu) return 1.0;
    light_pixel at = light_pixels[tile * 256u +
        uint((p.y & 12) << 4 | (p.x & 12) << 2 | (p.y & 3) << 2 | (p.x & 3))];
    int level = int(distance > at.fall[0]) + int(distance > at.fall[1]) + int(distance > at.fall[2]);
    if (level == 0) return 1.0;
    if (level == 3) return at.behind;
    float left = level == 1 ? at.left[0] : at.left[1];
    float end = level == 1 ? at.fall[1] : at.fall[2];
    float begin = max(end - thick, level == 1 ? at.fall[0] : at.fall[1]);
    if (distance <= begin) return left;
    return left + ((level == 1 ? at.before[0] : at.before[1]) - left) * (distance - begin) / (end - begin);
}
/* To a place in the world, between four pixels of a face; -1 outside of it. */
float passed_to(int which, int tiles_before, float nearest, vec3 place, float bias) {
    face f = face_of[which];
    vec2 most = vec2(f.size.xy - 1);
    vec3 t = vec3(dot(f.view[0].xyz, place) + f.view[0].w, dot(f.view[1].xyz, place) + f.view[1].w,
        dot(f.view[2].xyz, place) + f.view[2].w);
    if (!(t.z > f.kind.x)) return -1.0;
    vec2 at = f.lens.xy * t.xy * (f.kind.y > 0.0 ? 1.0 : 1.0 / t.z) + f.lens.zw - 0.5;
    if (!(at.x >= -0.5 && at.y >= -0.5 && at.x <= most.x + 0.5 && at.y <= most.y + 0.5)) return -1.0;
    at = clamp(at, vec2(0), most);
    float distance = f.kind.z > 0.0 ? length(t) : t.z;
    distance -= bias + 1e-6 * distance + nearest;
    ivec2 p = min(ivec2(at), f.size.xy - 2);
    at -= vec2(p);
    vec2 rows = vec2(0);
    for (int i = 0; i < 2; i++)
        rows[i] = mix(passed(f, tiles_before, p + ivec2(0, i), distance, bias),
            passed(f, tiles_before, p + ivec2(1, i), distance, bias), at.x);
    return mix(rows.x, rows.y, at.y);
}
);

static const char gpu_highlight[] = GPU_GLSL(
layout(std430, binding = 6) buffer pixel_block { float pixels[]; };
layout(std430, binding = 7) buffer pixel_visibility_block { float pixel_visibilities[]; };
layout(std430, binding = 8) writeonly buffer pixel_shadow_block { float pixel_shadows[]; };
vec3 blended(int layer, int plane, int at) {
    at += 3 * layer * plane;
    return vec3(layer_pixels[at], layer_pixels[at + plane], layer_pixels[at + 2 * plane]);
}
/* Of a light's faces the first that knows the place. */
float light_map_at(vec3 place) {
    float found = -1.0;
    for (int i = 0, tiles = 0; i < faces.y && found < 0.0; i++) {
        found = passed_to(faces.x + i, tiles, facts[faces.x + i].nearest, place, camera[2].w);
        tiles += face_of[faces.x + i].size.w;
    }
    return found;
}
/* n.wi / (wo.h)^2 F sum of a e^(-s ((1 - t) p.Q p + t h.Q h)) */
float highlight(vec3 wi, vec3 wo, vec3 normal, vec3 q, vec3 mixed, float f0) {
    vec3 h;
    float missing;
    bool shines = half_vector(wi, wo, h, missing) && dot(normal, normal) >= 1e-12;
    vec3 n = normal / sqrt(max(dot(normal, normal), 1e-12));
    vec3 p = h - n * dot(n, h);
    float own = dot(p, q * p + mixed * p.yzx + mixed.zxy * p.zxy);
    float all = dot(h, q * h + mixed * h.yzx + mixed.zxy * h.zxy);
    float grazing = max(0.25, 1.0 - missing);
    float sum = 0.0;
    for (int j = 0; j < 8; j++) {
        vec4 b = basis[3 * j + 2];
        sum += b.z * power_of_e(-b.y * max(0.0, (1.0 - b.x) * own + b.x * all));
    }
    return shines ? max(0.0, dot(n, wi)) / (grazing * grazing) * schlick(f0, missing) * sum : 0.0;
}
void main() {
    int at = int(item());
    int plane = size.x * size.y;
    int light = faces.z;
    if (at >= plane) return;
    lamp l = lamps[light];
    bool shadowed = on(shadow_term) && l.intensity.w > 0.0;
    vec3 more = blended(3, plane, at); /* depth, F0, cover */
    float cover = max(more.z, 1e-6);
    vec2 pixel = (vec2(at % size.x, at / size.x) + 0.5 - lens.zw) * vec2(camera[0].w, camera[1].w);
    vec3 ray = camera[0].xyz * pixel.x + camera[1].xyz * pixel.y + camera[2].xyz;
    vec3 place = eye.xyz + more.x / cover * ray;
    vec3 arrives = blended(7 + 3 * light, plane, at) / cover; /* the network's answer, v_g, softness */
    int of_light = light * plane + at;
    float map = on(visibility_given) ? pixel_visibilities[of_light] : 1.0;
    if (!on(visibility_given) && shadowed && more.z > 1e-6) {
        map = light_map_at(place);
        map = map < 0.0 ? arrives.y : map;
    }
    float shadow = shadow_factor(shadowed, mix(map, arrives.y, arrives.z), arrives.x);
    vec3 sum = shadow * blended(6 + 3 * light, plane, at);
    vec3 mirrored = blended(5 + 3 * light, plane, at);
    if (any(greaterThan(mirrored, vec3(0)))) {
        bool directional = l.place.w > 0.0;
        vec3 to = directional ? l.place.xyz : l.place.xyz - place;
        vec3 wi = directional ? to : to / sqrt(max(dot(to, to), eye.w));
        sum += mirrored * (shadow * highlight(wi, -normalize(ray), blended(4, plane, at),
            blended(1, plane, at) / cover, blended(2, plane, at) / cover, more.y / cover));
    }
    for (int c = 0; c < 3; c++) {
        int to = c * plane + at;
        pixels[to] = sum[c] + (light > 0 ? pixels[to] : layer_pixels[to]);
    }
    pixel_visibilities[of_light] = map;
    pixel_shadows[of_light] = shadow;
}
);

/* What views, records and lists are. */
static const char gpu_types[] = GPU_GLSL(
struct fact { uint visible, instances; float nearest; };
struct splat { float x, y, ux, uy, wy, log2_opacity, extent_x, extent_y; };
struct pair { uint first, second; }; /* instance: place, mask; of a Gaussian: first, count; entry: Gaussian, mask */
const float log2e = 1.44269504088896341;
const uint none = 0xFFFFFFFFu;
/* Instances that there is room for; none where they are too many to count, which is the limit. */
uint listed(uint instances, uint room) { return instances > 0x7FFFFFFFu ? 0u : min(instances, room); }
);

/* The sum of what the threads before this one have, and of all. */
static const char gpu_scan[] = GPU_GLSL(
shared uint scanned[256];
shared uint scanned_16[16]; /* of 16 threads */
uint scan(uint value, out uint total) {
    uint before = 0u, own = lane() & ~15u;
    barrier();
    scanned[lane()] = value;
    barrier();
    if (lane() < 16u) {
        uint sum = 0u;
        for (uint i = 0u; i < 16u; i++) sum += scanned[16u * lane() + i];
        scanned_16[lane()] = sum;
    }
    barrier();
    total = 0u;
    for (uint i = 0u; i < 16u; i++) {
        if (16u * i < own) before += scanned_16[i];
        total += scanned_16[i];
        if (own + i < lane()) before += scanned[own + i];
    }
    return before;
}
);

/* ---- PROJECT: eq. 1, a thread a Gaussian ---- */

static const char gpu_project_in[] = GPU_GLSL(
layout(std140, binding = 0) uniform parameters {
    vec4 view[3];
    float fx, fy, cx, cy, near_plane, log2_threshold, variance;
    uint count, stride, width, height, orthographic, by_distance, compensate, floored;
};
layout(std430, binding = 0) readonly buffer model { float gaussian[]; };
layout(std430, binding = 1) writeonly buffer records { splat record[]; };
layout(std430, binding = 2) writeonly buffer depths { float depth[]; };

float channel(uint which, uint i) { return gaussian[which * stride + i]; }
vec3 channels(uint which, uint i) {
    return vec3(channel(which, i), channel(which + 1u, i), channel(which + 2u, i));
}
/* By the bits: compilers may take NaN for impossible. */
bool is_number(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) <= 0x7F800000u; }
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) < 0x7F800000u; }

/* a b - c d, its rounding error put back. */
float difference(float a, float b, float c, float d) {
    precise float product = c * d;
    precise float first = fma(a, b, -product), error = fma(-c, d, product);
    return first + error;
}
);

/* C = m m' + h is the splat's covariance, m = J W R S. Opacity fades near the eye and, beside the picture, of
   what reaches far back along z: its affine projection would cover the picture. */
static const char gpu_project[] = GPU_GLSL(
void main() {
    uint i = item();
    if (i >= count) return;
    vec3 position = channels(0u, i);
    vec4 raw = vec4(channel(3u, i), channels(4u, i));
    vec3 log_scale = channels(7u, i);
    float logit = channel(10u, i);
    bool drawn = is_finite(position.x) && is_finite(position.y) && is_finite(position.z) &&
        is_finite(raw.x) && is_finite(raw.y) && is_finite(raw.z) && is_finite(raw.w) &&
        is_number(log_scale.x) && is_number(log_scale.y) && is_number(log_scale.z) && is_number(logit);
    vec3 scale = exp(clamp(log_scale, -20.0, 20.0));
    float opacity = 1 / (1 + exp(-clamp(logit, -20.0, 20.0)));
    vec3 t = vec3(dot(view[0].xyz, position) + view[0].w, dot(view[1].xyz, position) + view[1].w,
                  dot(view[2].xyz, position) + view[2].w);
    mat3 r = rotation(raw);
    float inverse_z = orthographic != 0u ? 1 : 1 / max(t.z, near_plane);
    vec2 slope = orthographic != 0u ? vec2(0) : t.xy * inverse_z;
    vec3 m0 = scale * (fx * inverse_z * (view[0].xyz - slope.x * view[2].xyz) * r);
    vec3 m1 = scale * (fy * inverse_z * (view[1].xyz - slope.y * view[2].xyz) * r);
    float a = dot(m0, m0), b = dot(m0, m1), c = dot(m1, m1);
    vec3 across = vec3(difference(m0.y, m1.z, m0.z, m1.y), difference(m0.z, m1.x, m0.x, m1.z),
                       difference(m0.x, m1.y, m0.y, m1.x));
    float det0 = dot(across, across), h = variance;
    if (floored != 0u) {
        float mean = 0.5 * (a + c), half_difference = 0.5 * (a - c);
        float largest = mean + sqrt(half_difference * half_difference + b * b);
        h = max(0.0, variance - det0 / max(largest, 1e-30));
    }
    float det = det0 + h * (a + c + h);
    if (orthographic == 0u) {
        vec3 axis = scale * inverse_z * (view[2].xyz * r);
        vec2 low = -vec2(cx, cy) / vec2(fx, fy), high = (vec2(width, height) - vec2(cx, cy)) / vec2(fx, fy);
        vec2 edge = clamp(slope, max(min(low, -1.0), -1e9), min(max(high, 1.0), 1e9));
        vec2 ratio = (1 + edge * edge) / (1 + slope * slope);
        float beside = ratio.x * ratio.y * ratio.x * ratio.y;
        float deep = clamp((dot(axis, axis) - 0.02) / 0.04, 0.0, 1.0);
        float inverse_near = near_plane > 1e-30 ? 1 / near_plane : 1e30;
        opacity *= clamp((t.z - near_plane) * inverse_near, 0.0, 1.0) * (1 - deep * (1 - beside));
    }
    if (compensate != 0u) opacity *= sqrt(det0 / det);
    float log2_opacity = log2(max(opacity, 1e-30));
    vec2 centre = vec2(fx * t.x, fy * t.y) * inverse_z + vec2(cx, cy);
    float reach = max(0.0, 2 * 0.69314718055994531 * (log2_opacity - log2_threshold));
    vec2 extent = vec2(sqrt(reach * (a + h)), sqrt(reach * (c + h)));
    drawn = drawn && log2_opacity >= log2_threshold && near_plane < t.z && t.z < 1e30;
    drawn = drawn && extent.x + extent.y < 1e9 && 0 < det && det < 1e37;
    drawn = drawn && centre.x + extent.x >= 0.5 && float(width) - 0.5 >= centre.x - extent.x;
    drawn = drawn && centre.y + extent.y >= 0.5 && float(height) - 0.5 >= centre.y - extent.y;
    depth[i] = drawn ? (by_distance != 0u ? length(t) : t.z) : -1;
    float ux = sqrt(0.5 * log2e * ((c + h) / det)), uy = -ux * (b / (c + h)), wy = sqrt(0.5 * log2e / (c + h));
    if (drawn) record[i] = splat(centre.x, centre.y, ux, uy, wy, log2_opacity, extent.x, extent.y);
}
);

/* ---- SORT: least significant digit first, of 8 bits, some rows of 256 keys a group ---- */

/* Of the first digit the values are 0, 1, 2 .. Depths are keys as they are: those drawn are not negative, so
   their bits are in their order, and what is not drawn, -1, comes last. */
static const char gpu_sort_in[] = GPU_GLSL(
layout(std140, binding = 0) uniform parameters { uint room, shift, blocks, rows, view, instances; };
layout(std430, binding = 0) buffer facts_ { fact facts[]; };
layout(std430, binding = 1) readonly buffer keys { uint key[]; };
uint count() { return instances != 0u ? listed(facts[view].instances, room) : room; }
uint at(uint row) { return (group() * rows + row) * 256u + lane(); }
uint digit(uint which) { return key[which] >> shift & 255u; }
);

static const char gpu_sort_count[] = GPU_GLSL(
layout(std430, binding = 2) writeonly buffer digits { uint counted[]; };
shared uint found[256];
void main() {
    if (group() >= blocks) return;
    found[lane()] = 0u;
    barrier();
    for (uint row = 0u; row < rows; row++)
        if (at(row) < count()) atomicAdd(found[digit(at(row))], 1u);
    barrier();
    counted[256u * group() + lane()] = found[lane()];
}
);

/* A digit begins after what is smaller, and after its like in the blocks before. Row after row of 256 keys: each
   digit has a word of bits for each 32 of them, and a key's place among its like is the number of bits before
   its own. */
static const char gpu_sort_scatter[] = GPU_GLSL(
layout(std430, binding = 2) readonly buffer digits { uint counted[]; };
layout(std430, binding = 3) readonly buffer values { uint value[]; };
layout(std430, binding = 4) writeonly buffer keys_out { uint key_out[]; };
layout(std430, binding = 5) writeonly buffer values_out { uint value_out[]; };
shared uint bits[8 * 256];
shared uint next[256];
void main() {
    if (group() >= blocks) return;
    uint before = 0u, like = 0u, all;
    for (uint block = 0u; block < blocks; block += 8u) {
        uint here[8]; /* loads that do not wait for one another */
        for (uint i = 0u; i < 8u; i++) here[i] = counted[256u * min(block + i, blocks - 1u) + lane()];
        for (uint i = 0u; i < 8u; i++) {
            before += block + i < group() ? here[i] : 0u;
            like += block + i < blocks ? here[i] : 0u;
        }
    }
    next[lane()] = before + scan(like, all);
    for (uint word = 0u; word < 8u; word++) bits[word * 256u + lane()] = 0u;
    for (uint row = 0u; row < rows; row++) {
        bool there = at(row) < count();
        uint own = there ? digit(at(row)) : 0u, bit = lane() & 31u;
        barrier();
        if (there) atomicOr(bits[(lane() >> 5u) * 256u + own], 1u << bit);
        barrier();
        if (there) {
            uint place = next[own] + uint(bitCount(bits[(lane() >> 5u) * 256u + own] & ((1u << bit) - 1u)));
            for (uint word = 0u; word < lane() >> 5u; word++) place += uint(bitCount(bits[word * 256u + own]));
            key_out[place] = key[at(row)];
            value_out[place] = shift == 0u ? at(row) : value[at(row)];
        }
        barrier();
        for (uint word = 0u; word < 8u; word++) {
            next[lane()] += uint(bitCount(bits[word * 256u + lane()]));
            bits[word * 256u + lane()] = 0u;
        }
    }
}
);

/* ---- BIN: instances rank by rank, then sorted by their tiles, so lists stay in depth order ---- */

static const char gpu_bin_in[] = GPU_GLSL(
layout(std140, binding = 0) uniform parameters {
    uint count, view, tiles_x, tiles_y, room;
    float log2_threshold;
};
layout(std430, binding = 0) buffer facts_ { fact facts[]; };
);

/* As the CPU's bin kernel: over the rectangle of a micro-tile's pixel centres u^2 + w^2 is least on the sides
   that face the centre. */
static const char gpu_bin_mask[] = GPU_GLSL(
layout(std430, binding = 1) readonly buffer records { splat record[]; };
layout(std430, binding = 2) readonly buffer orders { uint order[]; };
layout(std430, binding = 3) buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 4) buffer groups { uint before[]; };

uvec4 box(splat s) {
    vec2 last = vec2(16u * tiles_x - 1u, 16u * tiles_y - 1u);
    precise vec2 low = vec2(s.x - s.extent_x, s.y - s.extent_y) - 1,
                 high = vec2(s.x + s.extent_x, s.y + s.extent_y) + 1;
    return uvec4(clamp(low, vec2(0), last), clamp(high, vec2(0), last)) / 16u;
}
uint touched(splat s, uint tx, uint ty) {
    /* precise: two programs ask, and must get the same answer */
    precise float best_x = -s.uy / s.ux, best_y = -s.ux * s.uy / (s.uy * s.uy + s.wy * s.wy);
    /* with more than the rounding of u^2 + w^2 */
    precise float most = s.log2_opacity - log2_threshold + 1e-3 + 4e-6 * (s.ux * s.extent_x + abs(s.uy) * s.extent_y);
    uint mask = 0u;
    for (uint micro = 0u; micro < 16u; micro++) {
        precise vec2 low = vec2(16u * tx + 4u * (micro & 3u), 16u * ty + 4u * (micro >> 2u)) + 0.5 - vec2(s.x, s.y),
             high = low + 3, near = clamp(vec2(0), low, high);
        precise float on_x = clamp(best_x * near.y, low.x, high.x), on_y = clamp(best_y * near.x, low.y, high.y);
        precise float u = min(abs(s.ux * near.x + s.uy * on_y), abs(s.ux * on_x + s.uy * near.y)), w = s.wy * on_y;
        precise float far_off = u * u + w * w;
        if (far_off <= most) mask |= 1u << micro;
    }
    return mask;
}
);

static const char gpu_bin_count[] = GPU_GLSL(
layout(std430, binding = 5) readonly buffer depths { float depth[]; };
bool is_drawn(uint rank) { return rank < count && depth[order[rank]] >= 0; }
void main() {
    uint rank = item(), found = 0u, total;
    bool drawn = is_drawn(rank);
    if (group() * 256u >= count) return;
    if (rank == 0u) facts[view].nearest = drawn ? depth[order[0]] : 0;
    if (rank == 0u && !drawn) facts[view].visible = 0u;
    if (drawn && !is_drawn(rank + 1u)) facts[view].visible = rank + 1u;
    if (drawn) {
        splat s = record[order[rank]];
        uvec4 tiles = box(s);
        for (uint y = tiles.y; y <= tiles.w; y++)
            for (uint x = tiles.x; x <= tiles.z; x++) found += touched(s, x, y) != 0u ? 1u : 0u;
    }
    uint first = scan(found, total);
    if (rank < count) of_gaussian[order[rank]] = pair(first, found);
    if (lane() == 0u) before[group()] = total;
}
);

static const char gpu_bin_emit[] = GPU_GLSL(
layout(std430, binding = 5) writeonly buffer instances { pair instance[]; };
layout(std430, binding = 6) writeonly buffer owners { uint owner[]; };
layout(std430, binding = 7) writeonly buffer keys { uint key[]; };
uint in_256s(uint x) { return (x >> 8u) + 1u; } /* sums of these fit 32 bits where sums of x may not */
void main() {
    uint rank = item(), groups = (count + 255u) / 256u, all = 0u, first = 0u, most = 0u;
    for (uint i = lane(); i < groups; i += 256u) {
        all += min(before[i], 0x7FFFFFFFu - all);
        if (i < group()) first += before[i];
    }
    scan(in_256s(all), most); /* of each the total alone */
    scan(all, all);
    scan(first, first);
    if (most > 7812500u) all = none; /* 2e9 */
    if (rank == 0u) facts[view].instances = all;
    if (rank >= facts[view].visible) return;
    uint g = order[rank], at = of_gaussian[g].first + first;
    splat s = record[g];
    uvec4 tiles = box(s);
    uint end = min(at + of_gaussian[g].second, listed(all, room));
    of_gaussian[g] = pair(at, at < end ? end - at : 0u);
    for (uint y = tiles.y; y <= tiles.w && at < end; y++)
        for (uint x = tiles.x; x <= tiles.z && at < end; x++) {
            uint mask = touched(s, x, y);
            if (mask == 0u) continue;
            instance[at].second = mask;
            owner[at] = g;
            key[at] = y * tiles_x + x;
            at++;
        }
}
);

/* A thread a place of the sorted list. Tiles without entries begin where the next one does. */
static const char gpu_bin_end[] = GPU_GLSL(
layout(std430, binding = 1) readonly buffer keys { uint key[]; };
layout(std430, binding = 2) readonly buffer values { uint value[]; };
layout(std430, binding = 3) readonly buffer owners { uint owner[]; };
layout(std430, binding = 4) buffer instances { pair instance[]; };
layout(std430, binding = 5) writeonly buffer lists { pair tile_list[]; };
layout(std430, binding = 6) writeonly buffer starts { uint tile_start[]; };
void main() {
    uint place = item(), all = listed(facts[view].instances, room), tiles = tiles_x * tiles_y;
    if (place > all) return;
    uint from = place == 0u ? 0u : key[place - 1u] + 1u, to = place == all ? tiles : key[place];
    for (uint tile = from; tile <= to; tile++) tile_start[tile] = place;
    if (place == all) return;
    uint number = value[place];
    instance[number].first = place;
    tile_list[place] = pair(owner[number], instance[number].second);
}
);

/* ---- WALK: a group a tile, a thread a pixel; 16 threads are a 4x4 micro-tile ---- */

static const char gpu_walk_in[] = GPU_GLSL(
layout(std140, binding = 0) uniform parameters {
    uint view, tiles_x, tiles, width, height, first_tile;
    float log2_threshold, stop, max_error, bias, cx, cy, inverse_focal;
    uint orthographic, cue, flux, map, shared_views, gaussians, first_layer, layers, deferred;
};
layout(std430, binding = 0) readonly buffer records { vec4 record[]; }; /* two of each splat */
layout(std430, binding = 1) readonly buffer lists { pair tile_list[]; };
layout(std430, binding = 2) readonly buffer starts { uint tile_start[]; };
);

/* Every program finds alpha by the same operations, so all of them take the same decisions. */
static const char gpu_alpha[] = GPU_GLSL(
uint micro() { return lane() >> 4u; }
uvec2 pixel() {
    uint m = micro(), p = lane() & 15u;
    return 16u * uvec2(group() % tiles_x, group() / tiles_x) +
        uvec2(4u * (m & 3u) + (p & 3u), 4u * (m >> 2u) + (p >> 2u));
}
bool inside() { return pixel().x < width && pixel().y < height; }
vec2 centre() { return vec2(pixel()) + 0.5; }
float weight_of(vec4 splat, vec2 spread, vec2 at) { /* x, y, ux, uy; wy, log2 opacity; 0: not drawn */
    precise float dx = at.x - splat.x, dy = at.y - splat.y;
    precise float u = fma(splat.z, dx, splat.w * dy), w = spread.x * dy;
    precise float p = fma(-u, u, fma(-w, w, spread.y));
    return p >= log2_threshold ? exp2(p) : 0;
}
float alpha_of(float weight) { return min(weight, 0.999); }
/* Has every pixel of the group fallen below the stop by this step, of 1, 2 ..? What is dark stays so. */
shared uint lit;
bool is_dark(float t, uint step) {
    if (t >= stop) lit = step;
    barrier();
    return lit < step;
}
);

/* A window of entries of a tile's list, and which of them each micro-tile has: a bit an entry, in depth order. */
static const char gpu_window_64[] = GPU_GLSL(const uint window = 64u;);
static const char gpu_window_128[] = GPU_GLSL(const uint window = 128u;);
static const char gpu_window_256[] = GPU_GLSL(const uint window = 256u;);
static const char gpu_window[] = GPU_GLSL(
const uint nothing = 0xFFFFFFFFu;
/* The entry of the lowest bit, which goes; nothing: there is none. */
uint take(inout uint bits, uint word) {
    uint first = bits == 0u ? nothing : 32u * word + uint(findLSB(bits));
    bits &= bits - 1u;
    return first;
}
const uint words = window / 32u;
shared vec4 splats[window];
shared vec2 spreads[window];
shared uint masks[window]; /* 0 where there is no entry */
shared uint covered[16u * words]; /* a bit an entry, of each micro-tile */
void load(uint place, uint gaussian, uint mask) {
    splats[place] = record[2u * gaussian];
    spreads[place] = record[2u * gaussian + 1u].xy;
    masks[place] = mask;
}
void find_covered() {
    uint word = lane() % words, bits = 0u;
    barrier();
    if (lane() < 16u * words) {
        for (uint i = 0u; i < 32u; i++) bits |= (masks[32u * word + i] >> lane() / words & 1u) << i;
        covered[lane()] = bits;
    }
    barrier();
}
);

/* A micro-tile's list, four entries after four, whose weights do not wait for one another. */
static const char gpu_fours[] = GPU_GLSL(
/* What a program does with an entry of the window, or with `nothing`, whose weight is 0. */
void meet(float weight, uint i);
float weight_at(uint i, vec2 at) {
    uint some = i % window;
    float weight = weight_of(splats[some], spreads[some], at);
    return i == nothing ? 0 : weight;
}
/* The next four of these bits, which are a word of the list. */
void meet_four(inout uint rest, uint word, vec2 at) {
    uint a = take(rest, word), b = take(rest, word), c = take(rest, word), d = take(rest, word);
    float of_a = weight_at(a, at), of_b = weight_at(b, at), of_c = weight_at(c, at), of_d = weight_at(d, at);
    meet(of_a, a);
    meet(of_b, b);
    meet(of_c, c);
    meet(of_d, d);
}
);

/* Which micro-tiles blend an entry, and whether it must be shaded. A pixel passes over small weights as long as
   their sum stays within max_error: what no pixel needs adds up to no more in any. What is heavy in some pixel
   is shaded anyway and takes nothing of that, so it is found in a round before. */
static const char gpu_walk_camera[] = GPU_GLSL(
layout(std430, binding = 3) writeonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 4) writeonly buffer neededs { uint tile_needed[]; };
shared uint blends[16 * 8]; /* as `covered` */
shared uint heavy[8];
shared uint must[8];
float t, over;
uint blended, marked; /* bits of 32 entries */
float slight;
uint strong;
/* Marked is what weighs more than `slight`, and beyond max_error what is not in `strong`. */
void meet(float weight, uint i) {
    bool drawn = weight > 0 && t >= stop;
    float alpha = drawn ? alpha_of(weight) : 0, w = alpha * t;
    uint own = drawn ? 1u << (i & 31u) : 0u, passed_over = own & ~strong;
    t = fma(-alpha, t, t);
    over += passed_over != 0u ? w : 0;
    blended |= own;
    marked |= w > slight ? own : over > max_error ? passed_over : 0u;
}
void main() {
    if (group() >= tiles) return;
    uint begin = tile_start[group()], end = tile_start[group() + 1u], step = 0u;
    bool dark = false, thrifty = max_error > 0;
    vec2 at = centre();
    t = inside() ? 1 : -1;
    over = 0;
    if (lane() == 0u) lit = 0u;
    uint from = begin;
    for (; from < end && !dark; from += window) {
        uint entries = min(window, end - from);
        barrier();
        if (lane() < 16u * words) blends[lane()] = 0u;
        if (lane() < words) heavy[lane()] = must[lane()] = 0u;
        if (lane() < entries) load(lane(), tile_list[from + lane()].first, tile_list[from + lane()].second);
        else masks[lane()] = 0u;
        find_covered();
        float before = t;
        for (uint round = thrifty ? 0u : 1u; round < 2u; round++) {
            t = before;
            for (uint word = 0u; word < words && t >= stop; word++) {
                uint rest = covered[words * micro() + word];
                strong = round == 0u || !thrifty ? ~0u : heavy[word];
                slight = round == 0u ? max_error * 0.03125 : 1e30;
                blended = marked = 0u;
                while (rest != 0u && t >= stop) meet_four(rest, word, at);
                if (round == 1u && blended != 0u) atomicOr(blends[words * micro() + word], blended);
                if (round == 0u && marked != 0u) atomicOr(heavy[word], marked);
                if (round == 1u && marked != 0u) atomicOr(must[word], marked);
            }
            barrier();
        }
        if (lane() < entries) {
            uint word = lane() >> 5u, place = lane() & 31u, mask = 0u;
            for (uint m = 0u; m < 16u; m++) mask |= (blends[words * m + word] >> place & 1u) << m;
            tile_seen[from + lane()] = mask;
            if (thrifty) tile_needed[from + lane()] = (heavy[word] | must[word]) >> place & 1u;
        }
        dark = is_dark(t, ++step);
    }
    for (uint i = from + lane(); i < end; i += 256u) {
        tile_seen[i] = 0u;
        if (thrifty) tile_needed[i] = 0u;
    }
}
);

static const char gpu_gather_camera[] = GPU_GLSL(
layout(std140, binding = 0) uniform parameters { uint count, thrifty; };
layout(std430, binding = 0) readonly buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 1) readonly buffer instances { pair instance[]; };
layout(std430, binding = 2) readonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 3) readonly buffer neededs { uint tile_needed[]; };
layout(std430, binding = 4) writeonly buffer all_seen { uint seen[]; };
layout(std430, binding = 5) writeonly buffer tallies { uvec2 tally[]; }; /* seen; the first skipped */
shared uint first;
void main() {
    uint blended = 0u, needed = 0u, sum;
    if (256u * group() >= count) return;
    pair of = item() < count ? of_gaussian[item()] : pair(0u, 0u);
    for (uint i = of.first; i < of.first + of.second; i++) {
        uint at = instance[i].first;
        blended |= tile_seen[at];
        needed |= thrifty != 0u ? tile_needed[at] : tile_seen[at];
    }
    if (item() < count) seen[item()] = needed != 0u ? 1u : blended != 0u ? 2u : 0u;
    if (lane() == 0u) first = none;
    scan(needed != 0u ? 1u : 0u, sum);
    if (needed == 0u && blended != 0u) atomicMin(first, item());
    barrier();
    if (lane() == 0u) tally[group()] = uvec2(sum, first);
}
);

/* Sums of up to three values of the pixels of 8 entries, whose micro-tiles alone are looked at: 32 threads an
   entry, one for each pixel of two micro-tiles, then four a value. */
static const char gpu_sums[] = GPU_GLSL(
const uint at_once = 8u;
shared float part[3][8][256];
void add_up(uint values, uint mask) { /* mask: entry lane() / 32's */
    uint entry = lane() >> 5u, first = lane() & 31u, which = first >> 2u;
    uint rest = mask & (first < 16u ? 0x5555u : 0xAAAAu);
    vec3 sum = vec3(0);
    barrier();
    while (rest != 0u) {
        uint pixel = 16u * take(rest, 0u) + (first & 15u);
        sum.x += part[0][entry][pixel];
        if (values > 1u) sum.y += part[1][entry][pixel];
        if (values > 2u) sum.z += part[2][entry][pixel];
    }
    part[0][entry][first] = sum.x; /* which no other thread of the entry reads before the barrier */
    if (values > 1u) part[1][entry][first] = sum.y;
    if (values > 2u) part[2][entry][first] = sum.z;
    barrier();
    if (which < values) {
        float quarter = 0;
        for (uint i = first & 3u; i < 32u; i += 4u) quarter += part[which][entry][i];
        part[which][entry][first & 3u] = quarter;
    }
    barrier();
}
/* After add_up(). */
float added(uint which, uint entry) {
    return (part[which][entry][0] + part[which][entry][1]) + (part[which][entry][2] + part[which][entry][3]);
}
);

/* Eqs. 6, 7 and the depth cue. Per entry the sums of rho v, rho and rho x cue. It is sampled once all that is
   nearer than its distance - bias is in the transmittance, so two windows run along the list; a thread takes
   of them what its micro-tile has. In the dark nothing is applied any more, and what is in no other tile is
   not sampled, unless for its cue: v = 0 / 1. */
static const char gpu_walk_light[] = GPU_GLSL(
layout(std430, binding = 3) readonly buffer depths { float depth[]; };
layout(std430, binding = 4) readonly buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 5) writeonly buffer sums { vec4 tile_sums[]; };
layout(std430, binding = 6) readonly buffer facts_ { fact facts[]; };
shared float depths_of[window];
shared uint alone[window];
shared vec4 near_splats[64]; /* as window's */
shared vec2 near_spreads[64];
shared float near_depths[64];
shared uint near_masks[64];
shared uint near_covered[32];
float t, met; /* transmittance; sum of blend weight x distance */
uint near_rest, near_word; /* what of the micro-tile's is not applied yet */

/* A window of what is to be applied, from this entry on. */
void load_near(uint from, uint end) {
    barrier();
    if (lane() < 64u) {
        bool there = from + lane() < end;
        pair entry = tile_list[there ? from + lane() : from];
        near_splats[lane()] = record[2u * entry.first];
        near_spreads[lane()] = record[2u * entry.first + 1u].xy;
        near_depths[lane()] = there ? depth[entry.first] : 1e30;
        near_masks[lane()] = there ? entry.second : 0u;
    }
    barrier();
    if (lane() < 32u) {
        uint bits = 0u;
        for (uint i = 0u; i < 32u; i++) bits |= (near_masks[32u * (lane() & 1u) + i] >> (lane() >> 1u) & 1u) << i;
        near_covered[lane()] = bits;
    }
    barrier();
    near_word = 0u;
    near_rest = near_covered[2u * micro()];
}
/* All of the window that is nearer than this. */
void apply(float reach, float nearest, vec2 at) {
    bool nearer = true;
    while (nearer) {
        if (near_rest == 0u && near_word == 0u) near_rest = near_covered[2u * micro() + ++near_word];
        uint i = 32u * near_word + uint(findLSB(near_rest)) % 32u;
        nearer = near_rest != 0u && near_depths[i] < reach;
        if (nearer) {
            float alpha = alpha_of(weight_of(near_splats[i], near_spreads[i], at));
            met += alpha * t * (near_depths[i] - nearest);
            t = max(fma(-alpha, t, t), 1e-20);
            near_rest &= near_rest - 1u;
        }
    }
}
);
static const char gpu_walk_light_main[] = GPU_GLSL(
void main() {
    if (group() >= tiles) return;
    uint begin = tile_start[group()], end = tile_start[group() + 1u], next = begin + 64u; /* near window */
    float nearest = facts[view].nearest;
    bool dark = false;
    vec2 at = centre();
    t = 1;
    met = 0;
    if (lane() == 0u) lit = 0u;
    if (begin < end) load_near(begin, end);
    for (uint from = begin, step = 1u; from < end; from += at_once, step++) {
        uint loaded = (from - begin) % window, entries = min(at_once, end - from), sampled = 0u;
        barrier();
        if (loaded == 0u) {
            if (lane() < window) {
                masks[lane()] = 0u;
                if (from + lane() < end) {
                    pair entry = tile_list[from + lane()];
                    load(lane(), entry.first, entry.second);
                    depths_of[lane()] = depth[entry.first];
                    alone[lane()] = shared_views + cue == 0u && of_gaussian[entry.first].second == 1u ? 1u : 0u;
                }
            }
            find_covered();
        }
        for (uint i = 0u; i < entries; i++)
            if (!dark || alone[loaded + i] == 0u) sampled |= 1u << i;
        uint word = loaded >> 5u, shift = loaded & 31u, rest = covered[words * micro() + word] >> shift & sampled;
        float last = depths_of[loaded + entries - 1u] - bias;
        bool more = true;
        while (more) {
            float within = near_depths[63]; /* what is nearer is in the window */
            more = !dark && within < last;
            bool goes_on = rest != 0u;
            while (goes_on) {
                uint i = uint(findLSB(rest));
                float distance = depths_of[loaded + i];
                goes_on = !more || distance - bias <= within;
                if (goes_on) {
                    if (!dark) apply(distance - bias, nearest, at);
                    float rho = weight_of(splats[loaded + i], spreads[loaded + i], at);
                    part[0][i][lane()] = rho * t;
                    part[1][i][lane()] = rho;
                    if (cue != 0u)
                        part[2][i][lane()] = rho * ((distance - nearest) - (distance - nearest) * t - met);
                    rest &= rest - 1u;
                    goes_on = rest != 0u;
                }
            }
            if (more) {
                apply(last, nearest, at);
                load_near(next, end);
                next += 64u;
            }
        }
        if (!dark) dark = is_dark(t, step);
        uint own = lane() >> 5u;
        if (sampled != 0u) add_up(cue != 0u ? 3u : 2u, (sampled >> own & 1u) != 0u ? masks[loaded + own] : 0u);
        if (lane() < entries) {
            vec4 sum = vec4(0, 1, 0, 0);
            if ((sampled >> lane() & 1u) != 0u)
                sum = vec4(added(0u, lane()), added(1u, lane()), cue != 0u ? added(2u, lane()) : 0, 0);
            tile_sums[from + lane()] = sum;
        }
    }
}
);

/* The light's map, where on its way the transmittance falls below 0.98, 0.5, 0.1, and with flux the sums of solid
   angle x blend weight. */
static const char gpu_walk_map[] = GPU_GLSL(
layout(std430, binding = 3) readonly buffer depths { float depth[]; };
layout(std430, binding = 4) writeonly buffer maps { vec4 light_map[]; };
layout(std430, binding = 5) buffer sums { vec4 tile_sums[]; };
layout(std430, binding = 6) readonly buffer facts_ { fact facts[]; };
layout(std430, binding = 7) writeonly buffer map_tiles { uint map_tile[]; };
shared float distances[window];
float t, omega; /* transmittance; solid angle */
const float levels[4] = float[4](0.98, 0.5, 0.1, -1);
uint fallen;
vec3 falls;
vec2 left, before;

void note(float from, float to, float distance) {
    for (uint l = 0u; l < 3u; l++) {
        if (l != fallen || to >= levels[l]) continue;
        falls[l] = distance;
        if (l < 2u) left[l] = to;
        if (l > 0u) before[l - 1u] = from;
        fallen++;
    }
}
float solid_angle() {
    vec2 slope = (centre() - vec2(cx, cy)) * inverse_focal;
    float cosine2 = orthographic != 0u ? 1 : 1 / (1 + dot(slope, slope));
    return cosine2 * sqrt(cosine2) * inverse_focal * inverse_focal;
}
);
static const char gpu_walk_map_main[] = GPU_GLSL(
void meet(float weight, uint i) {
    float alpha = alpha_of(weight), past = t;
    if (i == nothing) return;
    t = max(fma(-alpha, t, t), 1e-20);
    if (t < levels[fallen]) note(past, t, distances[i]);
    if (flux != 0u) part[0][i % at_once][lane()] = omega * alpha * past;
}
void main() {
    if (group() >= tiles) return;
    uint begin = tile_start[group()], end = tile_start[group() + 1u], number = first_tile + group();
    if (map != 0u && lane() == 0u) map_tile[number] = begin < end ? number : none;
    float nearest = facts[view].nearest;
    bool dark = false;
    vec2 at = centre();
    t = 1;
    omega = solid_angle();
    fallen = 0u;
    falls = vec3(1e30);
    left = before = vec2(0);
    if (lane() == 0u) lit = 0u;
    for (uint from = begin, step = 1u; from < end && !dark; from += window, step++) {
        uint entries = min(window, end - from), own = lane() >> 5u;
        barrier();
        if (lane() < window) masks[lane()] = 0u;
        if (lane() < entries) {
            pair entry = tile_list[from + lane()];
            load(lane(), entry.first, entry.second);
            distances[lane()] = depth[entry.first] - nearest;
        }
        find_covered();
        for (uint first = 0u; first < entries; first += at_once) {
            uint word = first >> 5u, rest = covered[words * micro() + word] & 0xFFu << (first & 31u);
            while (rest != 0u) meet_four(rest, word, at);
            if (flux == 0u) continue;
            add_up(1u, masks[first + own]);
            if (lane() < at_once && first + lane() < entries)
                tile_sums[from + first + lane()].w = added(0u, lane());
            barrier();
        }
        dark = is_dark(t, step);
    }
    if (map == 0u || begin == end) return;
    light_map[(number * 256u + lane()) * 2u] = vec4(falls, left.x);
    light_map[(number * 256u + lane()) * 2u + 1u] = vec4(left.y, before, t);
}
);

/* Of the views of a light one after the other; what the last one adds up to is eq. 7. */
static const char gpu_gather_light[] = GPU_GLSL(
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
);

/* ---- COMPOSITE: eq. 1, the colour and the layers of what is seen ---- */

static const char gpu_one_layer[] = GPU_GLSL(const uint at_once = 1u;);
static const char gpu_many_layers[] = GPU_GLSL(const uint at_once = 8u;);

/* Layer 0 is the colour. layers: how many there are from first_layer on. */
static const char gpu_blend[] = GPU_GLSL(
layout(std430, binding = 3) readonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 4) readonly buffer colors { vec4 color[]; };
layout(std430, binding = 5) readonly buffer layer_colors { vec4 layer[]; };
layout(std430, binding = 6) writeonly buffer all_pixels { float pixels[]; };
layout(std430, binding = 7) writeonly buffer all_layer_pixels { float layer_pixels[]; };
layout(std430, binding = 8) writeonly buffer transmittances { float transmittance[]; };
shared vec4 values[window * at_once];
vec3 sums[at_once];
float t;
void meet(float weight, uint i) {
    if (!(weight > 0) || t < stop) return;
    float alpha = alpha_of(weight), w = alpha * t;
    for (uint l = 0u; l < at_once; l++) sums[l] += w * values[i * at_once + l].rgb;
    t = fma(-alpha, t, t);
}
vec4 value_of(uint which, uint gaussian) {
    if (which == 0u) return color[gaussian];
    return which < first_layer + layers ? layer[(which - 1u) * gaussians + gaussian] : vec4(0);
}
void store() {
    uint plane = width * height, at = pixel().y * width + pixel().x;
    if (first_layer == 0u) {
        transmittance[at] = t;
        for (uint c = 0u; c < 3u; c++) pixels[c * plane + at] = sums[0][c];
    }
    if (deferred == 0u) return;
    for (uint l = 0u; l < min(layers, at_once); l++)
        for (uint c = 0u; c < 3u; c++) layer_pixels[((first_layer + l) * 3u + c) * plane + at] = sums[l][c];
}
void main() {
    if (group() >= tiles) return;
    uint begin = tile_start[group()], end = tile_start[group() + 1u];
    bool dark = false;
    vec2 at = centre();
    t = inside() ? 1 : -1;
    for (uint l = 0u; l < at_once; l++) sums[l] = vec3(0);
    if (lane() == 0u) lit = 0u;
    for (uint from = begin, step = 1u; from < end && !dark; from += window, step++) {
        uint entries = min(window, end - from);
        barrier();
        if (lane() < entries) load(lane(), tile_list[from + lane()].first, tile_seen[from + lane()]);
        else if (lane() < window) masks[lane()] = 0u;
        for (uint i = lane(); i < entries * at_once; i += 256u)
            values[i] = value_of(first_layer + i % at_once, tile_list[from + i / at_once].first);
        find_covered();
        for (uint word = 0u; word < words && t >= stop; word++) {
            uint rest = covered[words * micro() + word];
            while (rest != 0u && t >= stop) meet_four(rest, word, at);
        }
        dark = is_dark(t, step);
    }
    if (inside()) store();
}
);

/* clang-format on */

static const struct {
    const char *name, *part[GPU_PARTS]; /* after gpu_common */
} gpu_sources[GPU_PROGRAMS] = {
    {"seen: list", {gpu_types, gpu_scan, gpu_seen, gpu_seen_list}},
    {"seen: copy", {gpu_types, gpu_seen, gpu_seen_copy}},
    {"transport: nodes", {gpu_transport_in, gpu_transport_nodes}},
    {"transport: sums", {gpu_transport_in, gpu_transport}},
    {"shade",
     {gpu_rotation, gpu_lit_frame, gpu_lit_functions, gpu_network, gpu_reflect, gpu_colour, gpu_lobe,
      gpu_shade_main}},
    {"highlight", {gpu_types, gpu_lit_frame, gpu_lit_functions, gpu_light_map, gpu_highlight}},
    {"project", {gpu_types, gpu_rotation, gpu_project_in, gpu_project}},
    {"sort: count", {gpu_types, gpu_sort_in, gpu_sort_count}},
    {"sort: scatter", {gpu_types, gpu_sort_in, gpu_scan, gpu_sort_scatter}},
    {"bin: count", {gpu_types, gpu_bin_in, gpu_bin_mask, gpu_scan, gpu_bin_count}},
    {"bin: emit", {gpu_types, gpu_bin_in, gpu_bin_mask, gpu_scan, gpu_bin_emit}},
    {"bin: end", {gpu_types, gpu_bin_in, gpu_bin_end}},
    {"walk: camera",
     {gpu_types, gpu_walk_in, gpu_alpha, gpu_window_256, gpu_window, gpu_fours, gpu_walk_camera}},
    {"walk: what is seen", {gpu_types, gpu_scan, gpu_gather_camera}},
    {"walk: light",
     {gpu_types, gpu_walk_in, gpu_alpha, gpu_window_64, gpu_window, gpu_sums, gpu_walk_light,
      gpu_walk_light_main}},
    {"walk: map",
     {gpu_types, gpu_walk_in, gpu_alpha, gpu_window_64, gpu_window, gpu_fours, gpu_sums, gpu_walk_map,
      gpu_walk_map_main}},
    {"walk: visibility", {gpu_types, gpu_gather_light}},
    {"blend",
     {gpu_types, gpu_walk_in, gpu_alpha, gpu_window_128, gpu_window, gpu_fours, gpu_one_layer, gpu_blend}},
    {"blend: layers",
     {gpu_types, gpu_walk_in, gpu_alpha, gpu_window_128, gpu_window, gpu_fours, gpu_many_layers, gpu_blend}},
};

/* ==== failures ==== */

/* Keeps the first failure. */
static void gpu_fail(gpu *g, ssdgs_result result, const char *format, ...) {
    if (g->result) return;
    va_list list;
    va_start(list, format);
    vsnprintf(g->message, sizeof g->message, format, list);
    va_end(list);
    g->result = result;
}

/* What OpenGL has to complain about since the last call. */
static void gpu_check(gpu *g, const char *what) {
    const uint32_t error = g->gl.GetError();
    if (error == GPU_GL_OUT_OF_MEMORY) gpu_fail(g, SSDGS_ERR_MEMORY, "%s: the GPU's memory is full", what);
    else if (error) gpu_fail(g, SSDGS_ERR_ISA, "%s: OpenGL error 0x%x", what, (unsigned)error);
}

const char *gpu_name(const gpu *g) { return g->name; }
void gpu_wait(gpu *g, int waits) { g->waits = waits; }

/* ==== contexts ==== */

#ifdef _WIN32 /* where drivers have no EGL */
static void *gpu_open_egl(void) { return NULL; }
static void *gpu_find(void *library, const char *name) {
    (void)library, (void)name;
    return NULL;
}
#else
/* It stays open: loaded again it would make its displays anew, which are never closed. */
static void *gpu_open_egl(void) { return dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL); }
static void *gpu_find(void *library, const char *name) { return dlsym(library, name); }
#endif

/* ISO C has no cast from dlsym's result. */
static void gpu_symbol(const gpu_egl *egl, const char *name, void *function) {
    void *const found = gpu_find(egl->library, name);
    memcpy(function, &found, sizeof found);
}

/* An extension's function: NULL where it is missing. */
static void gpu_extension(const gpu_egl *egl, const char *name, void *function) {
    const gpu_function found = egl->GetProcAddress(name);
    memcpy(function, &found, sizeof found);
}

static int gpu_load_egl(gpu_egl *egl) {
    egl->library = gpu_open_egl();
    if (!egl->library) return 0;
    gpu_symbol(egl, "eglGetProcAddress", &egl->GetProcAddress);
    gpu_symbol(egl, "eglGetDisplay", &egl->GetDisplay);
    gpu_symbol(egl, "eglInitialize", &egl->Initialize);
    gpu_symbol(egl, "eglBindAPI", &egl->BindAPI);
    gpu_symbol(egl, "eglQueryAPI", &egl->QueryAPI);
    gpu_symbol(egl, "eglCreateContext", &egl->CreateContext);
    gpu_symbol(egl, "eglDestroyContext", &egl->DestroyContext);
    gpu_symbol(egl, "eglMakeCurrent", &egl->MakeCurrent);
    gpu_symbol(egl, "eglGetCurrentContext", &egl->GetCurrentContext);
    gpu_symbol(egl, "eglGetCurrentDisplay", &egl->GetCurrentDisplay);
    gpu_symbol(egl, "eglGetCurrentSurface", &egl->GetCurrentSurface);
    if (!egl->GetProcAddress || !egl->GetDisplay || !egl->Initialize || !egl->BindAPI || !egl->QueryAPI ||
        !egl->CreateContext || !egl->DestroyContext || !egl->MakeCurrent || !egl->GetCurrentContext ||
        !egl->GetCurrentDisplay || !egl->GetCurrentSurface)
        return 0;
    gpu_extension(egl, "eglGetPlatformDisplayEXT", &egl->GetPlatformDisplay);
    gpu_extension(egl, "eglQueryDevicesEXT", &egl->QueryDevices);
    return 1;
}

static int gpu_load_gl(gpu *g) {
    int found = 1;
#define GPU_LOAD(result, name, arguments) \
    gpu_extension(&g->egl, "gl" #name, &g->gl.name); \
    found = found && g->gl.name;
    GPU_FUNCTIONS(GPU_LOAD)
#undef GPU_LOAD
    return found;
}

static void gpu_leave_context(gpu *g) {
    const gpu_egl *egl = &g->egl;
    const gpu_current *c = &g->callers;
    egl->MakeCurrent(egl->display, NULL, NULL, NULL);
    egl->BindAPI(c->api);
    if (c->context) egl->MakeCurrent(c->display, c->draw, c->read, c->context);
}

static int gpu_enter_context(gpu *g) {
    const gpu_egl *egl = &g->egl;
    gpu_current *c = &g->callers;
    c->api = egl->QueryAPI();
    c->context = egl->GetCurrentContext();
    c->display = egl->GetCurrentDisplay();
    c->draw = egl->GetCurrentSurface(GPU_EGL_DRAW);
    c->read = egl->GetCurrentSurface(GPU_EGL_READ);
    if (egl->BindAPI(GPU_EGL_OPENGL_API) && egl->MakeCurrent(egl->display, NULL, NULL, egl->context))
        return 1;
    gpu_leave_context(g);
    return 0;
}

enum { GPU_MOST_BLOCKS = 11 }; /* storage blocks of a program: SHADE's */

/* Is there OpenGL 4.3 on the display? Then its context is g's. Displays are shared by all of a process, so
   none is ever closed. */
static int gpu_try_display(gpu *g, void *display) {
    static const int32_t attributes[] = {
        GPU_EGL_MAJOR_VERSION, 4,           GPU_EGL_MINOR_VERSION, 3, GPU_EGL_PROFILE,
        GPU_EGL_CORE_PROFILE,  GPU_EGL_NONE};
    gpu_egl *egl = &g->egl;
    if (!display || !egl->Initialize(display, NULL, NULL)) return 0;
    const uint32_t api = egl->QueryAPI();
    egl->display = display;
    egl->context =
        egl->BindAPI(GPU_EGL_OPENGL_API) ? egl->CreateContext(display, NULL, NULL, attributes) : NULL;
    egl->BindAPI(api);
    if (!egl->context) return 0;
    if (gpu_enter_context(g)) {
        int found = gpu_load_gl(g);
        int32_t blocks = 0, bindings = 0;
        if (found) {
            g->gl.GetIntegerv(GPU_GL_STORAGE_BLOCKS, &blocks);
            g->gl.GetIntegerv(GPU_GL_STORAGE_BINDINGS, &bindings);
            g->gl.GetIntegerv(GPU_GL_STORAGE_BLOCK_SIZE, &g->most);
        }
        found = blocks >= GPU_MOST_BLOCKS && bindings >= GPU_MOST_BLOCKS; /* OpenGL promises 8 */
        if (found) snprintf(g->name, sizeof g->name, "%s", (const char *)g->gl.GetString(GPU_GL_RENDERER));
        gpu_leave_context(g);
        if (found) return 1;
    }
    egl->DestroyContext(display, egl->context);
    egl->context = NULL;
    return 0;
}

/* Devices first: among them are the GPUs of every vendor, software last. */
static int gpu_find_display(gpu *g) {
    const gpu_egl *egl = &g->egl;
    void *devices[GPU_EGL_DEVICES];
    int32_t count = 0;
    if (egl->GetPlatformDisplay && egl->QueryDevices && !egl->QueryDevices(GPU_EGL_DEVICES, devices, &count))
        count = 0;
    for (int32_t i = 0; i < count; i++)
        if (gpu_try_display(g, egl->GetPlatformDisplay(GPU_EGL_PLATFORM_DEVICE, devices[i], NULL))) return 1;
    if (egl->GetPlatformDisplay &&
        gpu_try_display(g, egl->GetPlatformDisplay(GPU_EGL_PLATFORM_SURFACELESS, NULL, NULL)))
        return 1;
    return gpu_try_display(g, egl->GetDisplay(NULL));
}

gpu *gpu_create(char *message, size_t size) {
    gpu *g = (gpu *)calloc(1, sizeof *g);
    const char *missing = "memory";
    if (g && !gpu_load_egl(&g->egl)) missing = "libEGL.so.1";
    else if (g && !gpu_find_display(g)) missing = "display with OpenGL 4.3 and 11 storage blocks a program";
    else if (g) return g;
    if (size) snprintf(message, size, "no GPU: there is no %s", missing);
    gpu_destroy(g);
    return NULL;
}

/* The context is this thread's until gpu_leave(). */
static void gpu_enter(gpu *g) {
    g->result = SSDGS_OK;
    g->message[0] = 0;
    if (!gpu_enter_context(g)) gpu_fail(g, SSDGS_ERR_ISA, "OpenGL's context is lost, or in use elsewhere");
}

static void gpu_finish(gpu *g) {
    if (g->busy) g->gl.Finish();
    g->busy = 0;
}

static ssdgs_result gpu_leave(gpu *g, const char *stage) {
    if (!g->result) gpu_check(g, stage);
    if (g->waits) gpu_finish(g);
    gpu_leave_context(g);
    return g->result;
}

/* ==== buffers ==== */

/* Room for so many bytes at least; what was there is gone where it grows. */
static void gpu_reserve(gpu *g, gpu_buffer *b, size_t size) {
    if (g->result || (b->name && b->size >= size)) return;
    const size_t more = b->size + b->size / 2;
    if (size < more && more <= (size_t)g->most) size = more;
    if (size > (size_t)g->most) { /* so that 32 bits count the values of any buffer, too */
        gpu_fail(g, SSDGS_ERR_LIMIT, "a buffer of %lu bytes, where programs can see %lu", (unsigned long)size,
                 (unsigned long)g->most);
        return;
    }
    g->owner = NULL; /* it may have been something that is kept */
    if (!b->name) g->gl.GenBuffers(1, &b->name);
    g->gl.BindBuffer(GPU_GL_SHADER_STORAGE_BUFFER, b->name);
    g->gl.BufferData(GPU_GL_SHADER_STORAGE_BUFFER, (intptr_t)(size < 16 ? 16 : size), NULL,
                     GPU_GL_DYNAMIC_DRAW);
    gpu_check(g, "a buffer");
    b->size = g->result ? 0 : size;
}

/* From there on in a buffer that has room for it. Programs that still run are waited for: on NVIDIA's driver
   580 they could see what was written after they were started. */
static void gpu_write(gpu *g, const gpu_buffer *b, size_t from, const void *data, size_t size) {
    if (g->result) return;
    gpu_finish(g);
    g->gl.BindBuffer(GPU_GL_SHADER_STORAGE_BUFFER, b->name);
    g->gl.BufferSubData(GPU_GL_SHADER_STORAGE_BUFFER, (intptr_t)from, (intptr_t)size, data);
}

static void gpu_upload(gpu *g, gpu_buffer *b, const void *data, size_t size) {
    gpu_reserve(g, b, size);
    if (size) gpu_write(g, b, 0, data, size);
}

/* Waits for the device. By way of memory that is the host's: straight from the device's it is slow. */
static void gpu_download(gpu *g, const gpu_buffer *b, void *data, size_t size) {
    if (!g->result && b->size < size) gpu_fail(g, SSDGS_ERR_ISA, "a buffer holds less than is read");
    if (g->result || !size) return;
    g->gl.MemoryBarrier(GPU_GL_BUFFER_UPDATE_BARRIER_BIT);
    g->gl.BindBuffer(GPU_GL_COPY_READ_BUFFER, b->name);
    if (!g->staging.name) g->gl.GenBuffers(1, &g->staging.name);
    g->gl.BindBuffer(GPU_GL_COPY_WRITE_BUFFER, g->staging.name);
    if (g->staging.size < size) {
        g->gl.BufferData(GPU_GL_COPY_WRITE_BUFFER, (intptr_t)size, NULL, GPU_GL_STREAM_READ);
        gpu_check(g, "a buffer to read from");
        g->staging.size = g->result ? 0 : size;
    }
    if (g->result) return;
    g->gl.CopyBufferSubData(GPU_GL_COPY_READ_BUFFER, GPU_GL_COPY_WRITE_BUFFER, 0, 0, (intptr_t)size);
    g->gl.GetBufferSubData(GPU_GL_COPY_WRITE_BUFFER, 0, (intptr_t)size, data);
    g->busy = 0;
}

/* ==== programs ==== */

static uint32_t gpu_compile(gpu *g, gpu_program which) {
    const char *text[GPU_PARTS + 1] = {gpu_common}, *name = gpu_sources[which].name;
    int32_t count = 1, compiled = 0, linked = 0;
    char log[768] = "";
    while (count <= GPU_PARTS && gpu_sources[which].part[count - 1])
        text[count] = gpu_sources[which].part[count - 1], count++;
    const uint32_t shader = g->gl.CreateShader(GPU_GL_COMPUTE_SHADER), program = g->gl.CreateProgram();
    g->gl.ShaderSource(shader, count, text, NULL);
    g->gl.CompileShader(shader);
    g->gl.GetShaderiv(shader, GPU_GL_COMPILE_STATUS, &compiled);
    if (compiled) {
        g->gl.AttachShader(program, shader);
        g->gl.LinkProgram(program);
        g->gl.GetProgramiv(program, GPU_GL_LINK_STATUS, &linked);
        g->gl.GetProgramInfoLog(program, sizeof log, NULL, log);
    } else g->gl.GetShaderInfoLog(shader, sizeof log, NULL, log);
    g->gl.DeleteShader(shader);
    if (linked) return program;
    g->gl.DeleteProgram(program);
    gpu_fail(g, SSDGS_ERR_ISA, "%s: %s", name, log);
    return 0;
}

/* The program that the next gpu_dispatch() runs, with what its block `parameters` holds (std140). */
static void gpu_use(gpu *g, gpu_program which, const void *parameters, size_t size) {
    if (!g->result && !g->program[which]) g->program[which] = gpu_compile(g, which);
    if (g->result) return;
    g->gl.UseProgram(g->program[which]);
    if (!g->parameters.name) g->gl.GenBuffers(1, &g->parameters.name);
    g->gl.BindBufferBase(GPU_GL_UNIFORM_BUFFER, 0, g->parameters.name);
    unsigned char block[1024] = {0}; /* a std140 block's size is a multiple of 16; the largest has 800 */
    memcpy(block, parameters, size);
    g->gl.BufferData(GPU_GL_UNIFORM_BUFFER, (intptr_t)((size + 15) / 16 * 16), block, GPU_GL_DYNAMIC_DRAW);
}

static void gpu_bind(gpu *g, uint32_t binding, const gpu_buffer *b) {
    if (!g->result) g->gl.BindBufferBase(GPU_GL_SHADER_STORAGE_BUFFER, binding, b->name);
}

enum { GPU_GROUP = 256 };
static size_t gpu_groups(size_t items) { return (items + GPU_GROUP - 1) / GPU_GROUP; }

/* So many groups, and perhaps some more: programs must look at item() or group(). What follows sees what they
   wrote. */
static void gpu_dispatch(gpu *g, size_t groups) {
    const size_t most = 65535;
    const size_t rows = (groups + most - 1) / most;
    if (g->result || !groups) return;
    g->gl.DispatchCompute((uint32_t)((groups + rows - 1) / rows), (uint32_t)rows, 1);
    g->gl.MemoryBarrier(GPU_GL_SHADER_STORAGE_BARRIER_BIT);
    g->busy = 1;
}

/* ==== SHADE ==== */

/* Flags of the lighting programs; the terms of SSDGS_ALL_TERMS are the first four. */
enum {
    GPU_DEFERRED = 16,
    GPU_DEPTH_CUE = 32,
    GPU_TRANSPORT = 64,
    GPU_RESIDUAL_SHADOW = 128,
    GPU_SHADOW_ON_SCATTERING = 256,
    GPU_PER_CHANNEL_OPTICS = 512,
    GPU_PRINTED_DIPOLE = 1024,
    GPU_AMBIENT = 2048,
    GPU_MEDIUM = 4096,
    GPU_VISIBILITY_GIVEN = 8192,
    GPU_LENGTHS = 5, /* of true dipole transport */
    GPU_NODE = 64,   /* Gaussians where light enters, taken together */
    GPU_ROWS = 4096  /* values that a group's networks work on */
};
#define GPU_SOFT 0.02     /* length units: transport's distances are sqrt(r^2 + soft^2) */
#define GPU_SHORTEST 0.04 /* of its lengths, each twice the one before */

/* The parameters of the lighting programs; the GLSL says what they are. */
typedef struct gpu_lighting {
    float eye[4], centre[4], basis[3 * SSDGS_ASG_COUNT][4], ambient[9][4], medium[GPU_LENGTHS][4],
        camera[3][4], lens[4];
    int32_t network[2][4], inputs[4], faces[4], counts[4], size[4];
} gpu_lighting;

typedef struct gpu_lamp {
    float place[4], intensity[4], cone[4], rim[4];
} gpu_lamp;

/* Memory to make an upload in, all zero. NULL: there is none, which is a failure. */
static void *gpu_host(gpu *g, size_t size) {
    if (g->host_size < size || !g->host) {
        free(g->host);
        g->host = malloc(size + 1);
        g->host_size = g->host ? size : 0;
    }
    if (g->host) memset(g->host, 0, size);
    else gpu_fail(g, SSDGS_ERR_MEMORY, "out of memory for %lu bytes", (unsigned long)size);
    return g->host;
}

/* Layers, inputs, width, outputs. */
static void gpu_network_sizes(const ssdgs_settings *s, int shadow, int32_t sizes[4]) {
    const int scattering = 27 + 3 * (1 + 2 * s->octaves.view) + 3 * (1 + 2 * s->octaves.light) + 3 +
                           SSDGS_MATERIAL_COUNT + (s->depth_cue ? 9 : 0) + (s->transport ? GPU_LENGTHS : 0);
    sizes[0] = shadow ? s->shadow.layers : s->scattering.layers;
    sizes[1] = shadow ? 21 + 21 + 1 + SSDGS_MATERIAL_COUNT : scattering;
    sizes[2] = shadow ? s->shadow.width : s->scattering.width;
    sizes[3] = shadow ? 1 : s->per_channel_optics ? 7 : 3;
}

/* Floats of a network on the device, with its neurons padded to 4. */
static size_t gpu_network_size(const int32_t sizes[4]) {
    size_t size = 0, depth = (size_t)sizes[1];
    for (int layer = 1; layer <= sizes[0]; layer++) {
        const size_t neurons = (size_t)sizes[layer < sizes[0] ? 2 : 3];
        size += (depth + 1) * ((neurons + 3) / 4 * 4);
        depth = neurons;
    }
    return size;
}

/* A network's weights, (neurons, inputs) and then biases of each layer, as the device has them: (inputs,
   neurons), the biases as one input more. `to` is all 0. */
static void gpu_turn_network(const int32_t sizes[4], const ssdgs_real *weights, float *to) {
    size_t depth = (size_t)sizes[1];
    for (int layer = 1; layer <= sizes[0]; layer++) {
        const size_t neurons = (size_t)sizes[layer < sizes[0] ? 2 : 3], stride = (neurons + 3) / 4 * 4;
        for (size_t i = 0; i < neurons; i++) {
            for (size_t k = 0; k < depth; k++) to[k * stride + i] = (float)weights[i * depth + k];
            to[depth * stride + i] = (float)weights[neurons * depth + i];
        }
        weights += neurons * (depth + 1);
        to += stride * (depth + 1);
        depth = neurons;
    }
}

static void gpu_upload_networks(gpu *g, const ssdgs_placed *o) {
    int32_t sizes[2][4];
    for (int i = 0; i < 2; i++) gpu_network_sizes(&o->settings, i, sizes[i]);
    const size_t first = gpu_network_size(sizes[0]), all = first + gpu_network_size(sizes[1]);
    float *const turned = (float *)gpu_host(g, all * sizeof *turned);
    if (!turned) return;
    gpu_turn_network(sizes[0], o->gaussians.scattering, turned);
    gpu_turn_network(sizes[1], o->gaussians.shadow, turned + first);
    gpu_upload(g, &g->frame.networks, turned, all * sizeof *turned);
}

/* What of ambient light comes to each Gaussian. */
static void gpu_upload_exposures(gpu *g, const ssdgs_placed *o) {
    gpu_upload(g, &g->frame.exposures, o->exposure,
               o->exposure ? (size_t)o->gaussians.count * sizeof(float) : 0);
}

static double gpu_sigmoid(double x) { return 1 / (1 + exp(-x)); }

/* The axes of a quaternion w x y z of any length, where x -> axis 0. */
static void gpu_axes(const ssdgs_real *raw, double axes[3][3]) {
    double q[4], norm = 0;
    for (int i = 0; i < 4; i++) norm += (double)raw[i] * (double)raw[i];
    for (int i = 0; i < 4; i++) q[i] = norm > 0 ? (double)raw[i] / sqrt(norm) : i == 0;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        axes[i][i] = 1 - 2 * (q[1 + j] * q[1 + j] + q[1 + k] * q[1 + k]);
        axes[i][j] = 2 * (q[1 + i] * q[1 + j] + q[0] * q[1 + k]);
        axes[i][k] = 2 * (q[1 + i] * q[1 + k] - q[0] * q[1 + j]);
    }
}

/* As the CPU's, of what its numbers can hold. */
static float gpu_exp(double x) { return (float)exp(x > 87 ? 87 : x < -87 ? -87 : x); }

/* The lobes that all Gaussians share. */
static void gpu_find_basis(const ssdgs_placed *o, float basis[3 * SSDGS_ASG_COUNT][4]) {
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        const ssdgs_real *sharpness = o->gaussians.asg_sharpness + 2 * j;
        const double least = -10, most = 20; /* of the raw a */
        double raw = (double)o->gaussians.asg_sigma[j], axes[3][3];
        raw = raw > most ? most : raw < least ? least : raw;
        gpu_axes(o->gaussians.asg_basis + 4 * j, axes);
        for (int i = 0; i < 6; i++) basis[3 * j + i / 3][i % 3] = (float)axes[i / 3][i % 3];
        for (int i = 0; i < 2; i++) basis[3 * j + i][3] = gpu_exp((double)sharpness[i]);
        basis[3 * j + 2][0] = (float)gpu_sigmoid((double)sharpness[1]);
        basis[3 * j + 2][1] = gpu_exp((double)sharpness[0]);
        basis[3 * j + 2][2] = (float)(log1p(exp(-fabs(raw))) + (raw > 0 ? raw : 0));
    }
}

static int32_t gpu_flags(const ssdgs_frame *frame) {
    const ssdgs_placed *o = frame->objects;
    const ssdgs_settings *s = &o->settings;
    const int medium = !s->scattering.layers && (o->terms & SSDGS_SCATTERING_TERM);
    return (o->terms & SSDGS_ALL_TERMS) | (s->asg == SSDGS_ASG_DEFERRED ? GPU_DEFERRED : 0) |
           (s->depth_cue ? GPU_DEPTH_CUE : 0) |
           (s->transport && (o->terms & SSDGS_SCATTERING_TERM) ? GPU_TRANSPORT : 0) |
           (s->residual_shadow ? GPU_RESIDUAL_SHADOW : 0) |
           (s->shadow_on_scattering ? GPU_SHADOW_ON_SCATTERING : 0) |
           (s->per_channel_optics ? GPU_PER_CHANNEL_OPTICS : 0) |
           (s->dipole == SSDGS_DIPOLE_PRINTED ? GPU_PRINTED_DIPOLE : 0) | (o->exposure ? GPU_AMBIENT : 0) |
           (medium ? GPU_MEDIUM : 0) | (frame->visibility_given ? GPU_VISIBILITY_GIVEN : 0);
}

/* As many columns as a network's widest layer leaves room for, a power of 2 up to 64. */
static int32_t gpu_columns(int32_t network[2][4]) {
    int32_t columns = 64;
    for (int i = 0; i < 2; i++)
        for (int j = 1; j < 4 && network[i][0]; j++)
            while (columns * network[i][j] > GPU_ROWS) columns /= 2;
    return columns;
}

static gpu_lighting gpu_lighting_of(const ssdgs_frame *frame) {
    const ssdgs_placed *o = frame->objects;
    const ssdgs_settings *s = &o->settings;
    const ssdgs_camera *c = &frame->camera;
    const double unit = (double)s->length_unit, eta = (double)s->eta,
                 fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
    gpu_lighting k;
    memset(&k, 0, sizeof k);
    for (int i = 0; i < 3; i++) {
        k.eye[i] = (float)frame->eye[i];
        k.centre[i] = (float)s->centre[i];
        for (int j = 0; j < 3; j++) k.camera[i][j] = (float)c->view[4 * i + j];
        for (int j = 0; j < 9; j++) k.ambient[j][i] = (float)frame->options.ambient[j][i];
        for (int j = 0; j < GPU_LENGTHS; j++) k.medium[j][i] = (float)o->medium[GPU_LENGTHS * i + j];
    }
    for (int j = 0; j < GPU_LENGTHS; j++) k.medium[j][3] = (float)exp(-GPU_SOFT / (GPU_SHORTEST * (1 << j)));
    k.eye[3] = (float)(1e-6 * unit * unit);
    k.centre[3] = (float)(1 / unit);
    k.camera[0][3] = (float)(1 / c->fx);
    k.camera[1][3] = (float)(1 / c->fy);
    k.camera[2][3] = (float)frame->bias[1];
    gpu_find_basis(o, k.basis);
    k.lens[0] = (float)(1 + 4.0 / 3 * (1 + fdr) / (1 - fdr));
    k.lens[1] = (float)s->light_scale;
    k.lens[2] = (float)c->cx;
    k.lens[3] = (float)c->cy;
    for (int i = 0; i < 2; i++) gpu_network_sizes(s, i, k.network[i]);
    k.inputs[0] = s->octaves.view;
    k.inputs[1] = s->octaves.light;
    k.inputs[2] = gpu_columns(k.network);
    k.inputs[3] = (int32_t)(gpu_network_size(k.network[0]) / 4);
    k.counts[0] = frame->count;
    k.counts[1] = (int32_t)o->gaussians.stride;
    k.counts[2] = frame->light_count;
    k.counts[3] = frame->layer_count;
    k.size[0] = c->width;
    k.size[1] = c->height;
    k.size[2] = gpu_flags(frame);
    return k;
}

/* Has the light a map? One that is dark has none. */
static int gpu_casts(const ssdgs_light *l) {
    return !l->unshadowed && (l->intensity[0] > 0 || l->intensity[1] > 0 || l->intensity[2] > 0);
}

static void gpu_set_lamp(gpu_lamp *lamp, const ssdgs_frame *frame, const ssdgs_light *l) {
    const int spot = l->kind == SSDGS_LIGHT_SPOT, directional = l->kind == SSDGS_LIGHT_DIRECTIONAL,
              ranged = !directional && l->range > 0, focused = !directional && l->focus > 0,
              dark = !(l->intensity[0] > 0 || l->intensity[1] > 0 || l->intensity[2] > 0);
    const double inner = (double)l->cone[0], outer = (double)l->cone[1],
                 width = 2 * sin((inner + outer) / 2) * sin((outer - inner) / 2); /* of their cosines */
    double length2 = 0, norm2 = 0;
    for (int i = 0; i < 3; i++) length2 += (double)l->direction[i] * (double)l->direction[i];
    for (int i = 0; i < 3; i++) {
        lamp->place[i] = directional ? -(float)l->direction[i] : (float)l->position[i];
        lamp->intensity[i] = (float)(l->intensity[i] * frame->settings.light_scale);
        lamp->cone[i] = (float)(spot || focused ? (double)l->direction[i] / sqrt(length2) : 0);
        norm2 += (double)lamp->cone[i] * (double)lamp->cone[i];
    }
    lamp->place[3] = (float)directional;
    lamp->intensity[3] = (float)gpu_casts(l);
    lamp->cone[3] = dark ? 1e15f : ranged ? (float)(1 / l->range) : 0; /* a dark one reaches nothing */
    lamp->rim[0] = spot ? (float)(((1 + norm2) / 2 - cos(outer)) / width) : 1;
    lamp->rim[1] = spot ? (float)(0.5 / width) : 0;
    lamp->rim[2] = (float)(spot || ranged || focused || dark);
    lamp->rim[3] = focused ? (float)l->focus : 0;
}

static void gpu_upload_lamps(gpu *g, const ssdgs_frame *frame) {
    const size_t lights = (size_t)frame->light_count;
    gpu_lamp *const lamps = (gpu_lamp *)gpu_host(g, lights * sizeof *lamps);
    for (size_t i = 0; i < lights && lamps; i++) gpu_set_lamp(lamps + i, frame, frame->lights + i);
    gpu_upload(g, &g->frame.lamps, lamps, lights * sizeof *lamps);
}

/* A face of a light's maps; the GLSL says what it holds. */
typedef struct gpu_face {
    float view[12], lens[4], kind[4];
    int32_t size[4];
} gpu_face;

static void gpu_set_face(gpu_face *face, const ssdgs_splat_view *v) {
    for (int i = 0; i < 12; i++) face->view[i] = (float)v->view[i];
    face->lens[0] = (float)v->fx;
    face->lens[1] = (float)v->fy;
    face->lens[2] = (float)v->cx;
    face->lens[3] = (float)v->cy;
    face->kind[0] = (float)v->near_plane;
    face->kind[1] = (float)v->orthographic;
    face->kind[2] = (float)v->by_distance;
    face->size[0] = v->width;
    face->size[1] = v->height;
    face->size[2] = (v->width + 15) / 16;
    face->size[3] = (v->width + 15) / 16 * ((v->height + 15) / 16);
}

static void gpu_upload_faces(gpu *g, const ssdgs_frame *frame) {
    const size_t views = (size_t)frame->view_count;
    gpu_face *const faces = (gpu_face *)gpu_host(g, views * sizeof *faces);
    for (size_t i = 0; i < views && faces; i++) gpu_set_face(faces + i, frame->views + i);
    gpu_upload(g, &g->frame.faces, faces, views * sizeof *faces);
}

static void gpu_seen_program(gpu *g, gpu_program which, uint32_t count, uint32_t layers, size_t groups) {
    const uint32_t parameters[2] = {count, layers};
    gpu_frame *f = &g->frame;
    const gpu_buffer *const buffers[6] = {&f->seen,       &f->tally, &f->shaded,
                                          &f->neighbours, &f->color, &f->layers};
    gpu_use(g, which, parameters, sizeof parameters);
    for (uint32_t i = 0; i < 6; i++) gpu_bind(g, i, buffers[i]);
    gpu_dispatch(g, groups);
}

static void gpu_reserve_lights(gpu *g, int count) {
    if (g->result || g->frame.lights >= count) return;
    gpu_light *more = (gpu_light *)realloc(g->frame.light, (size_t)count * sizeof *more);
    if (!more) {
        gpu_fail(g, SSDGS_ERR_MEMORY, "out of memory");
        return;
    }
    memset(more + g->frame.lights, 0, (size_t)(count - g->frame.lights) * sizeof *more);
    g->frame.light = more;
    g->frame.lights = count;
}

/* True dipole transport from where light enters to what is to be shaded and does not have it yet. */
static void gpu_transport_light(gpu *g, const ssdgs_frame *frame, int light) {
    gpu_frame *f = &g->frame;
    const size_t n = (size_t)frame->count, nodes = (n + GPU_NODE - 1) / GPU_NODE;
    const double unit = (double)frame->settings.length_unit, pi = 3.14159265358979323846;
    const double shortest = GPU_SHORTEST * unit, longest = shortest * (1 << (GPU_LENGTHS - 1));
    const gpu_buffer *const buffers[6] = {&f->gaussians, &f->flux,      &f->nodes,
                                          &f->seen,      &f->transport, &f->arrived};
    struct {
        uint32_t count, stride, light, nodes;
        float soft2, longest, far_radii, scale;
        uint32_t revision;
    } p;
    p.count = (uint32_t)n;
    p.stride = (uint32_t)frame->objects->gaussians.stride;
    p.light = (uint32_t)light;
    p.nodes = (uint32_t)nodes;
    p.soft2 = (float)(GPU_SOFT * unit * GPU_SOFT * unit);
    p.longest = (float)(-1 / (log(2) * longest));
    p.far_radii = (float)(2 * frame->options.transport_detail);
    p.scale = (float)(1 / (2 * pi * shortest));
    p.revision = f->light[light].ready ? f->light[light].revision : ++g->revisions;
    if (!f->light[light].ready) {
        gpu_use(g, GPU_TRANSPORT_NODES, &p, sizeof p);
        for (uint32_t i = 0; i < 3; i++) gpu_bind(g, i, buffers[i]);
        gpu_dispatch(g, (nodes + GPU_NODE - 1) / GPU_NODE);
        f->light[light].revision = p.revision;
        f->light[light].ready = !g->result;
    }
    gpu_use(g, GPU_TRANSPORT_SUMS, &p, sizeof p);
    for (uint32_t i = 0; i < 6; i++) gpu_bind(g, i, buffers[i]);
    gpu_dispatch(g, nodes);
}

/* Room for transport of all lights. What another transport_detail has left is made anew; other numbers of
   lights or of Gaussians come with walks. No revision is 0. */
static void gpu_reserve_transport(gpu *g, const ssdgs_frame *frame) {
    gpu_frame *f = &g->frame;
    const size_t n = (size_t)frame->count, lights = (size_t)frame->light_count,
                 nodes = (n + GPU_NODE - 1) / GPU_NODE, all = nodes + (nodes + GPU_NODE - 1) / GPU_NODE,
                 arrived = lights * nodes * sizeof(uint32_t);
    const double detail = (double)frame->options.transport_detail;
    gpu_reserve_lights(g, frame->light_count);
    gpu_reserve(g, &f->nodes, lights * all * 8 * sizeof(float));
    gpu_reserve(g, &f->transport, lights * GPU_LENGTHS * n * sizeof(float));
    if (f->arrived.size < arrived) { /* 0: what later models find behind these too */
        gpu_reserve(g, &f->arrived, arrived);
        gpu_upload(g, &f->arrived, gpu_host(g, f->arrived.size), f->arrived.size);
    }
    for (int i = 0; i < f->lights && (g->detail < detail || g->detail > detail); i++) f->light[i].ready = 0;
    g->detail = detail;
}

static void gpu_transport_all(gpu *g, const ssdgs_frame *frame) {
    if (!frame->flux || !(frame->objects->terms & SSDGS_SCATTERING_TERM)) return;
    gpu_reserve_transport(g, frame);
    for (int i = 0; i < frame->light_count && !g->result; i++)
        if (gpu_casts(frame->lights + i)) gpu_transport_light(g, frame, i);
}

/* The Gaussians seen: a list of them, and their colours and layers. */
static void gpu_shade(gpu *g, const ssdgs_frame *frame) {
    const size_t n = (size_t)frame->count, groups = gpu_groups(n);
    const uint32_t count = (uint32_t)n, layers = (uint32_t)frame->layer_count;
    gpu_frame *f = &g->frame;
    const gpu_lighting k = gpu_lighting_of(frame);
    const gpu_buffer *const buffers[11] = {&f->networks,     &f->lamps,     &f->gaussians, &f->shaded,
                                           &f->visibility,   &f->depth_cue, &f->transport, &f->exposures,
                                           &f->camera.depth, &f->color,     &f->layers};
    gpu_reserve(g, &f->shaded, (n + 1) * sizeof(uint32_t));
    gpu_reserve(g, &f->neighbours, n * sizeof(uint32_t));
    gpu_reserve(g, &f->color, 4 * n * sizeof(float));
    gpu_reserve(g, &f->layers, 4 * n * (size_t)frame->layer_count * sizeof(float));
    gpu_seen_program(g, GPU_SEEN_LIST, count, layers, groups);
    gpu_transport_all(g, frame);
    gpu_use(g, GPU_SHADE, &k, sizeof k);
    for (uint32_t i = 0; i < 11; i++) gpu_bind(g, i, buffers[i]);
    gpu_dispatch(g, (n + (size_t)k.inputs[2] - 1) / (size_t)k.inputs[2]);
    if (frame->options.max_error > 0) gpu_seen_program(g, GPU_SEEN_COPY, count, layers, groups);
}

/* ==== stages up to WALK, of one view ==== */

static float gpu_log2_threshold(const ssdgs_frame *frame) {
    const double threshold = (double)frame->options.alpha_threshold;
    return (float)(log(threshold > 1e-9 ? threshold : 1e-9) * 1.44269504088896341);
}

static size_t gpu_tiles(const ssdgs_splat_view *v) {
    return (size_t)((v->width + 15) / 16) * (size_t)((v->height + 15) / 16);
}

static void gpu_project_view(gpu *g, const ssdgs_frame *frame, int view, gpu_view *to) {
    const ssdgs_splat_view *v = frame->views + view;
    struct {
        float view[12], fx, fy, cx, cy, near_plane, log2_threshold, variance;
        uint32_t count, stride, width, height, orthographic, by_distance, compensate, floored;
    } p;
    const size_t n = (size_t)frame->count;
    for (int i = 0; i < 12; i++) p.view[i] = (float)v->view[i];
    p.fx = (float)v->fx, p.fy = (float)v->fy, p.cx = (float)v->cx, p.cy = (float)v->cy;
    p.near_plane = (float)v->near_plane;
    p.log2_threshold = gpu_log2_threshold(frame);
    p.variance = (float)v->variance;
    p.count = (uint32_t)frame->count;
    p.stride = (uint32_t)frame->gaussians.stride;
    p.width = (uint32_t)v->width, p.height = (uint32_t)v->height;
    p.orthographic = v->orthographic != 0;
    p.by_distance = v->by_distance != 0;
    p.compensate = v->compensate != 0;
    p.floored = v->blur == SSDGS_BLUR_FLOOR;
    gpu_reserve(g, &to->record, n * sizeof(ssdgs_record));
    gpu_reserve(g, &to->depth, n * sizeof(float));
    gpu_use(g, GPU_PROJECT, &p, sizeof p);
    gpu_bind(g, 0, &g->frame.gaussians);
    gpu_bind(g, 1, &to->record);
    gpu_bind(g, 2, &to->depth);
    gpu_dispatch(g, gpu_groups(n));
}

enum { GPU_SORT_BLOCKS = 256, GPU_FIRST_ROOM = 1 << 16 };

/* Sorts the numbers of room keys at most by so many of their low bits, into key[*end], value[*end].
   instances: how many there are facts.instances says, else room. */
static void gpu_radix_sort(gpu *g, int view, const gpu_buffer *keys, size_t room, int bits, int instances,
                           int *end) {
    gpu_scratch *s = &g->scratch;
    struct {
        uint32_t room, shift, blocks, rows, view, instances;
    } p;
    p.room = (uint32_t)room;
    p.view = (uint32_t)view;
    p.instances = (uint32_t)instances;
    p.rows = (uint32_t)(2 + gpu_groups(room) / GPU_SORT_BLOCKS); /* blocks read what all have counted */
    const size_t blocks = (room + GPU_GROUP * p.rows - 1) / (GPU_GROUP * p.rows);
    p.blocks = (uint32_t)blocks;
    gpu_reserve(g, &s->digits, blocks * 256 * sizeof(uint32_t));
    *end = 0;
    for (p.shift = 0; p.shift < (uint32_t)bits; p.shift += 8) {
        gpu_use(g, GPU_SORT_COUNT, &p, sizeof p);
        gpu_bind(g, 0, &g->frame.facts);
        gpu_bind(g, 1, p.shift ? s->key + *end : keys);
        gpu_bind(g, 2, &s->digits);
        gpu_dispatch(g, blocks);
        gpu_use(g, GPU_SORT_SCATTER, &p, sizeof p);
        gpu_bind(g, 3, s->value + *end);
        *end = !*end;
        gpu_bind(g, 4, s->key + *end);
        gpu_bind(g, 5, s->value + *end);
        gpu_dispatch(g, blocks);
    }
}

static void gpu_reserve_keys(gpu *g, size_t count) {
    for (int i = 0; i < 2; i++) {
        gpu_reserve(g, g->scratch.key + i, count * sizeof(uint32_t));
        gpu_reserve(g, g->scratch.value + i, count * sizeof(uint32_t));
    }
}

static void gpu_sort_view(gpu *g, const ssdgs_frame *frame, int view, gpu_view *to) {
    const size_t n = (size_t)frame->count;
    int end;
    gpu_reserve_keys(g, n);
    gpu_radix_sort(g, view, &to->depth, n, 32, 0, &end);
    const gpu_buffer order = g->scratch.value[end]; /* its memory for what order has had */
    g->scratch.value[end] = to->order;
    to->order = order;
}

static void gpu_reserve_instances(gpu *g, const ssdgs_frame *frame, const ssdgs_splat_view *v, gpu_view *to) {
    const size_t n = (size_t)frame->count, room = g->instance_room;
    gpu_reserve_keys(g, room);
    gpu_reserve(g, &g->scratch.groups, gpu_groups(n) * sizeof(uint32_t));
    gpu_reserve(g, &g->scratch.owner, room * sizeof(uint32_t));
    gpu_reserve(g, &to->of_gaussian, n * sizeof(ssdgs_instances));
    gpu_reserve(g, &to->instance, room * sizeof(ssdgs_instance));
    gpu_reserve(g, &to->tile_list, room * sizeof(ssdgs_tile_entry));
    gpu_reserve(g, &to->tile_start, (gpu_tiles(v) + 1) * sizeof(uint32_t));
}

static void gpu_bin_view(gpu *g, const ssdgs_frame *frame, int view, gpu_view *to) {
    const ssdgs_splat_view *v = frame->views + view;
    const size_t n = (size_t)frame->count, room = g->instance_room, tiles = gpu_tiles(v);
    const struct {
        uint32_t count, view, tiles_x, tiles_y, room;
        float log2_threshold;
    } p = {(uint32_t)n,
           (uint32_t)view,
           (uint32_t)(v->width + 15) / 16,
           (uint32_t)(v->height + 15) / 16,
           (uint32_t)room,
           gpu_log2_threshold(frame)};
    int bits = 1, end; /* one pass at least: it numbers the instances */
    gpu_reserve_instances(g, frame, v, to);
    gpu_use(g, GPU_BIN_COUNT, &p, sizeof p);
    gpu_bind(g, 0, &g->frame.facts);
    gpu_bind(g, 1, &to->record);
    gpu_bind(g, 2, &to->order);
    gpu_bind(g, 3, &to->of_gaussian);
    gpu_bind(g, 4, &g->scratch.groups);
    gpu_bind(g, 5, &to->depth);
    gpu_dispatch(g, gpu_groups(n));
    gpu_use(g, GPU_BIN_EMIT, &p, sizeof p);
    gpu_bind(g, 5, &to->instance);
    gpu_bind(g, 6, &g->scratch.owner);
    gpu_bind(g, 7, g->scratch.key);
    gpu_dispatch(g, gpu_groups(n));
    while (tiles > (size_t)1 << bits) bits++;
    gpu_radix_sort(g, view, g->scratch.key, room, bits, 1, &end);
    gpu_use(g, GPU_BIN_END, &p, sizeof p);
    gpu_bind(g, 1, g->scratch.key + end);
    gpu_bind(g, 2, g->scratch.value + end);
    gpu_bind(g, 3, &g->scratch.owner);
    gpu_bind(g, 4, &to->instance);
    gpu_bind(g, 5, &to->tile_list);
    gpu_bind(g, 6, &to->tile_start);
    gpu_dispatch(g, gpu_groups(room + 1));
}

/* What the walks and COMPOSITE are told of a view. */
typedef struct gpu_walk_parameters {
    uint32_t view, tiles_x, tiles, width, height, first_tile;
    float log2_threshold, stop, max_error, bias, cx, cy, inverse_focal;
    uint32_t orthographic, cue, flux, map, shared_views, gaussians, first_layer, layers, deferred;
} gpu_walk_parameters;

static gpu_walk_parameters gpu_walk_of(const ssdgs_frame *frame, int view) {
    const ssdgs_splat_view *v = frame->views + view;
    gpu_walk_parameters p;
    memset(&p, 0, sizeof p);
    p.view = (uint32_t)view;
    p.tiles_x = (uint32_t)(v->width + 15) / 16;
    p.tiles = (uint32_t)gpu_tiles(v);
    p.width = (uint32_t)v->width, p.height = (uint32_t)v->height;
    p.log2_threshold = gpu_log2_threshold(frame);
    p.stop = (float)frame->options.stop;
    p.max_error = (float)frame->options.max_error;
    p.bias = (float)frame->bias[0];
    p.cx = (float)v->cx, p.cy = (float)v->cy;
    p.inverse_focal = (float)(1 / (v->fx * v->distance));
    p.orthographic = v->orthographic != 0;
    p.cue = frame->depth_cue != NULL;
    p.flux = frame->flux != NULL;
    return p;
}

static void gpu_walk_camera_view(gpu *g, const ssdgs_frame *frame, gpu_view *to) {
    const gpu_walk_parameters p = gpu_walk_of(frame, 0);
    const struct { uint32_t count, thrifty; } gather = {(uint32_t)frame->count, frame->options.max_error > 0};
    gpu_reserve(g, &to->tile_seen, g->instance_room * sizeof(uint32_t));
    gpu_reserve(g, &to->tile_needed, g->instance_room * sizeof(uint32_t));
    gpu_reserve(g, &g->frame.seen, (size_t)frame->count * sizeof(uint32_t));
    gpu_reserve(g, &g->frame.tally, 2 * gpu_groups((size_t)frame->count) * sizeof(uint32_t));
    gpu_use(g, GPU_WALK_CAMERA, &p, sizeof p);
    gpu_bind(g, 0, &to->record);
    gpu_bind(g, 1, &to->tile_list);
    gpu_bind(g, 2, &to->tile_start);
    gpu_bind(g, 3, &to->tile_seen);
    gpu_bind(g, 4, &to->tile_needed);
    gpu_dispatch(g, p.tiles);
    gpu_use(g, GPU_GATHER_CAMERA, &gather, sizeof gather);
    gpu_bind(g, 0, &to->of_gaussian);
    gpu_bind(g, 1, &to->instance);
    gpu_bind(g, 2, &to->tile_seen);
    gpu_bind(g, 3, &to->tile_needed);
    gpu_bind(g, 4, &g->frame.seen);
    gpu_bind(g, 5, &g->frame.tally);
    gpu_dispatch(g, gpu_groups((size_t)frame->count));
}

/* Are the lights' maps asked for? */
static int gpu_maps(const ssdgs_frame *frame) {
    return frame->maps || (frame->layer_count && (frame->terms & SSDGS_SHADOW_TERM));
}

/* Whether the view before this one, or the one after it, is of the same light. */
static int gpu_same_light(const ssdgs_frame *frame, int view, int other) {
    return other > 0 && other < frame->view_count && frame->views[other].light == frame->views[view].light;
}

/* Adds up what the view tells of its light's visibility; the light's last view ends that. */
static void gpu_gather_light_view(gpu *g, const ssdgs_frame *frame, int view, const gpu_view *from) {
    const size_t n = (size_t)frame->count, all = n * (size_t)frame->light_count * sizeof(float);
    const struct {
        uint32_t count, light, first, last, cue, flux;
    } p = {(uint32_t)n,
           (uint32_t)frame->views[view].light,
           !gpu_same_light(frame, view, view - 1),
           !gpu_same_light(frame, view, view + 1),
           frame->depth_cue != NULL,
           frame->flux != NULL};
    gpu_reserve(g, &g->scratch.sums, n * 4 * sizeof(float));
    gpu_reserve(g, &g->frame.visibility, all);
    gpu_reserve(g, &g->frame.depth_cue, frame->depth_cue ? all : 4);
    gpu_reserve(g, &g->frame.flux, frame->flux ? all : 4);
    gpu_use(g, GPU_GATHER_LIGHT, &p, sizeof p);
    gpu_bind(g, 0, &from->of_gaussian);
    gpu_bind(g, 1, &from->instance);
    gpu_bind(g, 2, &from->tile_sums);
    gpu_bind(g, 3, &g->scratch.sums);
    gpu_bind(g, 4, &g->frame.visibility);
    gpu_bind(g, 5, &g->frame.depth_cue);
    gpu_bind(g, 6, &g->frame.flux);
    gpu_dispatch(g, gpu_groups(n));
}

static void gpu_walk_light_view(gpu *g, const ssdgs_frame *frame, int view, gpu_view *to) {
    const ssdgs_splat_view *v = frame->views + view;
    gpu_walk_parameters p = gpu_walk_of(frame, view);
    int first = view, faces = 1;
    while (gpu_same_light(frame, view, first - 1)) first--;
    while (gpu_same_light(frame, first, first + faces)) faces++;
    p.shared_views = faces > 1;
    p.map = (uint32_t)gpu_maps(frame);
    p.first_tile = (uint32_t)(view - first) * p.tiles;
    gpu_reserve_lights(g, frame->light_count);
    gpu_reserve(g, &to->tile_sums, g->instance_room * 4 * sizeof(float));
    if (g->result) return;
    gpu_light *light = g->frame.light + v->light;
    light->ready = 0;
    const size_t tiles = p.map ? (size_t)faces * p.tiles : 1;
    gpu_reserve(g, &light->map_tile, tiles * sizeof(uint32_t));
    gpu_reserve(g, &light->light_map, tiles * 256 * sizeof(ssdgs_light_pixel));
    gpu_use(g, GPU_WALK_LIGHT, &p, sizeof p);
    gpu_bind(g, 0, &to->record);
    gpu_bind(g, 1, &to->tile_list);
    gpu_bind(g, 2, &to->tile_start);
    gpu_bind(g, 3, &to->depth);
    gpu_bind(g, 4, &to->of_gaussian);
    gpu_bind(g, 5, &to->tile_sums);
    gpu_bind(g, 6, &g->frame.facts);
    gpu_dispatch(g, p.tiles);
    if (p.map || p.flux) {
        gpu_use(g, GPU_WALK_MAP, &p, sizeof p);
        gpu_bind(g, 4, &light->light_map);
        gpu_bind(g, 7, &light->map_tile);
        gpu_dispatch(g, p.tiles);
    }
    gpu_gather_light_view(g, frame, view, to);
}

/* ==== COMPOSITE without its highlights ==== */

enum { GPU_LAYERS = 8 };

static void gpu_blend_all(gpu *g, const ssdgs_frame *frame) {
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height;
    gpu_frame *f = &g->frame;
    const gpu_buffer *const buffers[9] = {
        &f->camera.record, &f->camera.tile_list, &f->camera.tile_start, &f->camera.tile_seen, &f->color,
        &f->layers,        &f->pixels,           &f->layer_pixels,      &f->transmittance};
    const uint32_t all = frame->layer_count ? (uint32_t)frame->layer_count + 1 : 1;
    gpu_walk_parameters p = gpu_walk_of(frame, 0);
    p.gaussians = (uint32_t)frame->count;
    p.deferred = frame->layer_count > 0;
    gpu_reserve(g, &f->pixels, pixels * 3 * sizeof(float));
    gpu_reserve(g, &f->transmittance, pixels * sizeof(float));
    gpu_reserve(g, &f->layer_pixels, p.deferred ? pixels * 3 * all * sizeof(float) : 0);
    for (; p.first_layer < all; p.first_layer += GPU_LAYERS) {
        p.layers = all - p.first_layer;
        gpu_use(g, p.deferred ? GPU_BLEND_LAYERS : GPU_BLEND, &p, sizeof p);
        for (uint32_t i = 0; i < 9; i++) gpu_bind(g, i, buffers[i]);
        gpu_dispatch(g, p.tiles);
    }
}

/* ==== COMPOSITE's highlights ==== */

/* Where light is deferred: lights what the pixels' layers hold, the lights one after the other. */
static void gpu_highlights(gpu *g, const ssdgs_frame *frame) {
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height,
                 all = pixels * (size_t)frame->light_count * sizeof(float);
    gpu_frame *f = &g->frame;
    gpu_lighting k = gpu_lighting_of(frame);
    gpu_reserve(g, &f->pixels, 3 * pixels * sizeof(float));
    gpu_reserve(g, &f->pixel_shadow, all);
    if (frame->visibility_given) gpu_upload(g, &f->pixel_visibility, frame->pixel_visibility, all);
    else gpu_reserve(g, &f->pixel_visibility, all);
    gpu_reserve_lights(g, frame->light_count); /* those without maps */
    for (int light = 0, view = 1; light < frame->light_count && !g->result; light++) {
        const gpu_light *map = f->light + light;
        const gpu_buffer *const buffers[9] = {
            &f->layer_pixels, &f->lamps,       &f->faces,  &f->facts,
            &map->map_tile,   &map->light_map, &f->pixels, &f->pixel_visibility,
            &f->pixel_shadow};
        k.faces[0] = view;
        while (view < frame->view_count && frame->views[view].light == light) view++;
        k.faces[1] = view - k.faces[0];
        k.faces[2] = light;
        gpu_use(g, GPU_HIGHLIGHT, &k, sizeof k);
        for (uint32_t i = 0; i < 9; i++) gpu_bind(g, i, buffers[i]);
        gpu_dispatch(g, gpu_groups(pixels));
    }
}

/* ==== whole frames ==== */

/* The model is uploaded anew where it may have changed. */
static void gpu_upload_model(gpu *g, const ssdgs_placed *o) {
    const ssdgs_model_view *v = &o->gaussians;
    const int known = g->model == o->model && g->revision == o->revision;
    if (!known) {
        gpu_upload(g, &g->frame.gaussians, v->gaussians, v->stride * SSDGS_CHANNELS * sizeof(float));
        gpu_upload_networks(g, o);
    }
    if (!known || !g->exposed) gpu_upload_exposures(g, o);
    g->exposed = o->exposure != NULL;
    g->model = g->result ? NULL : o->model;
    g->revision = o->revision;
}

/* What all stages find on the device. A view stays `cached` if the device still has its results; a record of
   NULL says that host memory has not. */
static void gpu_begin_frame(gpu *g, const ssdgs_frame *frame) {
    const size_t n = (size_t)frame->count, lights = (size_t)frame->light_count;
    gpu_frame *f = &g->frame;
    gpu_reserve(g, &f->facts, (size_t)frame->view_count * sizeof(gpu_fact));
    gpu_reserve(g, &f->visibility, n * lights * sizeof(float));
    gpu_reserve(g, &f->depth_cue, frame->depth_cue ? n * lights * sizeof(float) : 0);
    gpu_reserve(g, &f->flux, frame->flux ? n * lights * sizeof(float) : 0);
    gpu_upload_model(g, frame->objects);
    gpu_upload_lamps(g, frame);
    gpu_upload_faces(g, frame);
    for (int i = 0; i < frame->view_count; i++) {
        ssdgs_splat_view *v = frame->views + i;
        v->cached = v->cached && !v->record && g->owner == frame->memory;
        v->record = NULL;
        v->light_map = NULL;
    }
}

/* Of the views at work; the lights' faces share memory, so each goes through its stages by itself. */
static void gpu_walk_all(gpu *g, const ssdgs_frame *frame) {
    gpu_view *face = &g->frame.face;
    for (int view = frame->batch[0]; view < frame->batch[1]; view++) {
        if (frame->views[view].cached) continue;
        if (!view) {
            gpu_walk_camera_view(g, frame, &g->frame.camera);
            continue;
        }
        gpu_project_view(g, frame, view, face);
        gpu_sort_view(g, frame, view, face);
        gpu_bin_view(g, frame, view, face);
        gpu_walk_light_view(g, frame, view, face);
    }
}

static void gpu_run_stage(gpu *g, ssdgs_frame *frame, ssdgs_stage stage) {
    gpu_view *camera = &g->frame.camera;
    const int looks = !frame->batch[0] && !frame->views->cached;
    switch (stage) {
    case SSDGS_STAGE_PROJECT:
        if (looks) gpu_project_view(g, frame, 0, camera);
        break;
    case SSDGS_STAGE_SORT:
        if (looks) gpu_sort_view(g, frame, 0, camera);
        break;
    case SSDGS_STAGE_BIN:
        if (looks) gpu_bin_view(g, frame, 0, camera);
        break;
    case SSDGS_STAGE_WALK: gpu_walk_all(g, frame); break;
    case SSDGS_STAGE_SHADE: gpu_shade(g, frame); break;
    default:
        gpu_blend_all(g, frame);
        if (frame->layer_count) gpu_highlights(g, frame);
    }
}

static void gpu_run_stages(gpu *g, ssdgs_frame *frame, ssdgs_stage first, ssdgs_stage last) {
    for (int stage = (int)first; stage <= (int)last; stage++) gpu_run_stage(g, frame, (ssdgs_stage)stage);
}

/* Reads what the device has counted: 1 where every list had room, else there is more from now on. This,
   gpu_end_frame() and uploads in mid-frame wait for the device. What is counted of a view that was kept is
   its last. */
static int gpu_had_room(gpu *g, ssdgs_frame *frame) {
    const size_t size = (size_t)frame->view_count * sizeof(gpu_fact);
    gpu_fact *facts = (gpu_fact *)gpu_host(g, size);
    size_t most = 0;
    if (!facts) return 1;
    gpu_download(g, &g->frame.facts, facts, size);
    for (int i = 0; i < frame->view_count && !g->result; i++) {
        ssdgs_splat_view *v = frame->views + i;
        if (most < facts[i].instances) most = facts[i].instances;
        v->visible = (int)facts[i].visible;
        v->instances = facts[i].instances;
        v->nearest = (ssdgs_real)facts[i].nearest;
    }
    if (most > UINT32_MAX / 2) gpu_fail(g, SSDGS_ERR_LIMIT, "too many splats for the image or a light's map");
    if (g->result || most <= g->instance_room) return 1;
    const size_t fits = (size_t)g->most / 16; /* of 16 bytes, at most */
    g->instance_room = most + most / 4 > fits && most <= fits ? fits : most + most / 4;
    return 0;
}

/* The picture, where it is asked for, and what ssdgs_render_stats counts. */
static void gpu_end_frame(gpu *g, ssdgs_frame *frame) {
    const gpu_frame *f = &g->frame;
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height,
                 n = (size_t)frame->count;
    const int picture = !frame->image || frame->image->color;
    if (picture) gpu_download(g, &f->pixels, frame->pixels, pixels * 3 * sizeof(float));
    if (picture || frame->image->alpha)
        gpu_download(g, &f->transmittance, frame->transmittance, pixels * sizeof(float));
    if (!frame->statistics) return;
    uint32_t *list = (uint32_t *)gpu_host(g, (n + 1) * sizeof *list);
    gpu_download(g, &f->color, frame->color, n * 4 * sizeof(float));
    if (list) gpu_download(g, &f->shaded, list, (n + 1) * sizeof *list);
    if (g->result) return;
    frame->shaded_count = (int)list[0];
    memcpy(frame->shaded, list + 1, list[0] * sizeof *list);
    gpu_download(g, &f->seen, list, n * sizeof *list);
    for (size_t i = 0; i < n; i++) frame->seen[i] = (unsigned char)list[i];
    frame->light_instances = 0;
    for (int i = 1; i < frame->view_count; i++)
        frame->light_instances += frame->views[i].cached ? 0 : frame->views[i].instances;
}

/* ==== hook ==== */

static int gpu_is(ssdgs_real value, double expected) {
    return !((double)value < expected || (double)value > expected);
}

/* Do a frame's buffers, but for lists of instances, fit what programs can see? */
static int gpu_holds(const gpu *g, const ssdgs_frame *frame) {
    const ssdgs_placed *o = frame->objects;
    const double n = frame->count, lights = frame->light_count, layers = frame->layer_count + 1,
                 pixels = (double)frame->camera.width * frame->camera.height,
                 sizes[4] = {3 * pixels * layers, 4 * n * layers,
                             (double)o->gaussians.stride * SSDGS_CHANNELS,
                             n * lights * (frame->flux ? GPU_LENGTHS : 1)};
    int holds = 1;
    for (int i = 0; i < 4; i++) holds = holds && sizes[i] * sizeof(float) <= g->most;
    return holds && pixels * lights * sizeof(float) <= g->most;
}

/* Does the backend do this frame? Others are the CPU's. */
static int gpu_takes(const gpu *g, const ssdgs_frame *frame) {
    const ssdgs_placed *o = frame->objects;
    int plain = sizeof(ssdgs_real) == sizeof(float) && frame->object_count == 1;
    if (g->lost || frame->training || frame->last != SSDGS_STAGE_COMPOSITE || frame->maps) return 0;
    if (!plain || frame->occluder || frame->scene_depth) return 0;
    if (frame->diffuse || frame->layer_pixels || frame->median_depth) return 0;
    if (!gpu_holds(g, frame)) return 0;
    for (int i = 0; i < 3; i++) plain = plain && gpu_is(o->offset[i], 0) && gpu_is(o->tint[i], 1);
    plain = plain && gpu_is(o->roughness, 1) && gpu_is(o->specular, 1) && gpu_is(o->translucency, 1);
    return plain && !o->turned && gpu_is(o->scale, 1) && !o->settings.baked && !o->mask && o->gaussians.count;
}

/* gpu_leave() for a hook: a failure ends the frame; where it is the device's later ones are the CPU's. */
static ssdgs_result gpu_answer(gpu *g, ssdgs_frame *frame, const char *what) {
    const ssdgs_result result = gpu_leave(g, what);
    if (!result) return SSDGS_OK;
    g->lost = result != SSDGS_ERR_LIMIT; /* the device is well: it was this frame */
    g->owner = NULL;
    return ssdgs_stage_fail(frame, result, g->message);
}

static ssdgs_result gpu_stage(void *user, ssdgs_frame *frame, ssdgs_stage stage) {
    gpu *g = (gpu *)user;
    if (!gpu_takes(g, frame)) {
        for (int i = 0; i < frame->view_count; i++) /* what the device has the CPU must find anew */
            frame->views[i].cached = frame->views[i].cached && frame->views[i].record;
        return ssdgs_stage_cpu(frame, stage);
    }
    if (!g->waits && stage != SSDGS_STAGE_COMPOSITE) return SSDGS_OK; /* to enter a context takes time */
    gpu_enter(g);
    if (!g->instance_room) g->instance_room = GPU_FIRST_ROOM;
    if (!g->waits) frame->batch[0] = 0;
    if (!g->waits || (stage == SSDGS_STAGE_PROJECT && !frame->batch[0])) gpu_begin_frame(g, frame);
    gpu_run_stages(g, frame, g->waits ? stage : SSDGS_STAGE_PROJECT, stage);
    if (stage == SSDGS_STAGE_COMPOSITE) {
        frame->batch[0] = 0;         /* of all views, where some lists had no room */
        if (!gpu_had_room(g, frame)) /* what is counted is right even so: once is enough */
            gpu_run_stages(g, frame, SSDGS_STAGE_PROJECT, stage);
        g->owner = frame->memory;
    }
    return gpu_answer(g, frame, "a stage");
}

static ssdgs_result gpu_fetch(void *user, ssdgs_frame *frame, ssdgs_stage stage) {
    gpu *g = (gpu *)user;
    if (stage != SSDGS_STAGE_COUNT || !gpu_takes(g, frame)) return SSDGS_OK;
    gpu_enter(g);
    gpu_end_frame(g, frame);
    return gpu_answer(g, frame, "a picture");
}

static void gpu_released(void *user, const void *gone) {
    gpu *g = (gpu *)user;
    if (g->model == gone) g->model = NULL;
    if (g->owner == gone) g->owner = NULL;
}

#define GPU_HOOK(name, stage) \
    static ssdgs_result gpu_hook_##name(void *user, ssdgs_frame *frame) { \
        return gpu_stage(user, frame, stage); \
    }
GPU_HOOK(project, SSDGS_STAGE_PROJECT)
GPU_HOOK(sort, SSDGS_STAGE_SORT)
GPU_HOOK(bin, SSDGS_STAGE_BIN)
GPU_HOOK(walk, SSDGS_STAGE_WALK)
GPU_HOOK(shade, SSDGS_STAGE_SHADE)
GPU_HOOK(composite, SSDGS_STAGE_COMPOSITE)
#undef GPU_HOOK

ssdgs_gpu_hook gpu_hook(gpu *g) {
    ssdgs_gpu_hook hook;
    memset(&hook, 0, sizeof hook);
    hook.user = g;
    hook.stage[SSDGS_STAGE_PROJECT] = gpu_hook_project;
    hook.stage[SSDGS_STAGE_SORT] = gpu_hook_sort;
    hook.stage[SSDGS_STAGE_BIN] = gpu_hook_bin;
    hook.stage[SSDGS_STAGE_WALK] = gpu_hook_walk;
    hook.stage[SSDGS_STAGE_SHADE] = gpu_hook_shade;
    hook.stage[SSDGS_STAGE_COMPOSITE] = gpu_hook_composite;
    hook.fetch = gpu_fetch;
    hook.released = gpu_released;
    return hook;
}

void gpu_destroy(gpu *g) {
    if (!g) return;
    if (g->egl.context)
        g->egl.DestroyContext(g->egl.display, g->egl.context); /* with its buffers and programs */
    free(g->frame.light);
    free(g->host);
    free(g);
}
