/* ssdgs.h on a GPU: an ssdgs_gpu_hook in OpenGL 4.3 compute shaders. Scenes go to the device whole; the
   number of dispatches does not depend on objects or lights. OpenGL is found when the program runs: by EGL
   (libEGL.so.1), without a window, or in an engine's own context. Building needs neither headers nor a
   library but dlopen's. Include this file after ssdgs.h with SSDGS_STAGES, or compile it on its own and
   declare the functions of its face. Each compute program is a file of this folder, *.comp. To be included
   they become gpu_shaders.h first:

       awk -f shaders.awk *.comp >gpu_shaders.h

   Then:

       char message[256];
       gpu *g = gpu_create(NULL, message, sizeof message);
       ssdgs_gpu_hook hook = gpu_hook(g);
       desc.gpu = &hook;                              of ssdgs_context_create()

   What a stage leaves stays on the device. Its buffers are laid out as ssdgs_frame and ssdgs_splat_view say
   of their arrays, but every value has 32 bits: what has fewer or more there, too. */
#ifndef SSDGS_STAGES
#define SSDGS_STAGES
#endif
#include "../../ssdgs.h"
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
/* find: NULL: an OpenGL context of its own. Or what finds OpenGL's functions, as SDL_GL_GetProcAddress()
   does, in the context that is current on this thread: it must be current in all later calls, of the library
   too. They restore what they bind, but for OpenGL's error flag. Returns NULL: message says why, as where
   there is no OpenGL 4.3. */
gpu *gpu_create(void *(*find)(const char *name), char *message, size_t size);
/* After the contexts that have its hook, and after all that was made on them. NULL is fine. */
void gpu_destroy(gpu *g);
/* May serve several contexts, one call at a time; with an OpenGL context of its own on threads that have no
   GLX context. A frame in which the device fails ends with its message; those after it are the CPU's. */
ssdgs_gpu_hook gpu_hook(gpu *g);

/* ---- for engines whose OpenGL context it is in ----

   A frame, as tests/engine_gl.c has it:
       shadow maps of the meshes    then gpu_shadow_texture(), and ssdgs_scene_occlude() with their matrices
       ssdgs_scene_light()          the splats' light maps; gpu_last_map() for the meshes' shader
       the meshes                   into a texture of colour and one of depth, then gpu_scene_depth()
       ssdgs_scene_render()         with an image whose planes are NULL: nothing is read back
       a shader over all pixels     gpu_last_picture(): splats + transmittance x the meshes' colour */

/* What the last frame has left, for shaders: planes of height x width floats, top row first, of red, green
   and blue (linear, premultiplied), transmittance, and median depth where ssdgs_image asked for it. Planes of
   ssdgs_image that are NULL are not read back. buffer: 0: the CPU drew the frame, or none was drawn. */
typedef struct gpu_picture {
    uint32_t buffer; /* of GL_SHADER_STORAGE_BUFFER; valid until the next frame */
    int width, height;
} gpu_picture;
gpu_picture gpu_last_picture(const gpu *g);
/* A light's map of the last frame, for shaders: as ssdgs_light_map says, but on the device.
   ssdgs_scene_shadow() and ssdgs_scene_light_map() know nothing of it. What a pixel x, y of a face has is two
   vec4 of the buffer from 2 x ((first[face] + y / 16 x tiles + x / 16) x 256 + ((y & 12) << 4 | (x & 12) << 2
   | (y & 3) << 2 | (x & 3))) on, tiles = size / 16: a, then b; to a.xyz nearest[face] is to be added. Where
   the tile's first a.x is below 0 nothing is in the way. buffer: 0: there is no such map. */
typedef struct gpu_light_map {
    uint32_t buffer;
    ssdgs_light_map map;
    int first[6];
    float nearest[6];
} gpu_light_map;
gpu_light_map gpu_last_map(const gpu *g, int light);
/* For the frames from now on, instead of image.scene_depth: a depth texture (GL_TEXTURE_2D, of the picture's
   size) that this projection gave, (4,4), columns one after the other. 0: none. */
void gpu_scene_depth(gpu *g, uint32_t texture, const float projection[16]);
/* Instead of ssdgs_shadow_map.depth, which may then be NULL, of map number `map`: a depth texture, and its
   target: GL_TEXTURE_2D, or a face of a cube as GL_TEXTURE_CUBE_MAP_POSITIVE_X. It is read in each frame. 0:
   none. */
void gpu_shadow_texture(gpu *g, int map, uint32_t texture, uint32_t target);
const char *gpu_name(const gpu *g); /* of the device */
/* 1: each stage ends when the device is done with it, for timing. 0, the default: the device gets a frame's
   stages all at once. */
void gpu_wait(gpu *g, int waits);

/* ==== EGL and OpenGL ==== */

/* What is called of OpenGL: result, name, arguments. Enumerations, names and counts are 32-bit. */
#define GPU_FUNCTIONS(X) \
    X(void, AttachShader, (uint32_t program, uint32_t shader)) \
    X(void, BindBufferRange, \
      (uint32_t target, uint32_t index, uint32_t buffer, intptr_t from, intptr_t size)) \
    X(void, BindTexture, (uint32_t target, uint32_t texture)) \
    X(void, DeleteBuffers, (int32_t count, const uint32_t *buffers)) \
    X(void, GetInteger64i_v, (uint32_t name, uint32_t index, int64_t * value)) \
    X(void, GetIntegeri_v, (uint32_t name, uint32_t index, int32_t * value)) \
    X(void, GetTexImage, (uint32_t target, int32_t level, uint32_t format, uint32_t type, void *pixels)) \
    X(void, PixelStorei, (uint32_t name, int32_t value)) \
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
    GPU_GL_PACK_SWAP_BYTES = 0x0D00, /* from here on PACK_LSB_FIRST, ROW_LENGTH, SKIP_ROWS, SKIP_PIXELS */
    GPU_GL_TEXTURE_2D = 0x0DE1,
    GPU_GL_FLOAT = 0x1406,
    GPU_GL_DEPTH_COMPONENT = 0x1902,
    GPU_GL_RENDERER = 0x1F01,
    GPU_GL_TEXTURE_BINDING_2D = 0x8069,
    GPU_GL_TEXTURE_CUBE_MAP = 0x8513,
    GPU_GL_TEXTURE_BINDING_CUBE_MAP = 0x8514,
    GPU_GL_STREAM_READ = 0x88E1,
    GPU_GL_DYNAMIC_DRAW = 0x88E8,
    GPU_GL_PIXEL_PACK_BUFFER = 0x88EB,
    GPU_GL_PIXEL_PACK_BUFFER_BINDING = 0x88ED,
    GPU_GL_UNIFORM_BUFFER = 0x8A11,
    GPU_GL_UNIFORM_BUFFER_BINDING = 0x8A28, /* then its start and its size */
    GPU_GL_COMPILE_STATUS = 0x8B81,
    GPU_GL_LINK_STATUS = 0x8B82,
    GPU_GL_CURRENT_PROGRAM = 0x8B8D,
    GPU_GL_COPY_READ_BUFFER = 0x8F36,
    GPU_GL_COPY_WRITE_BUFFER = 0x8F37,
    GPU_GL_STORAGE_BLOCKS = 0x90DB, /* of a compute program */
    GPU_GL_SHADER_STORAGE_BUFFER = 0x90D2,
    GPU_GL_SHADER_STORAGE_BUFFER_BINDING = 0x90D3, /* as above */
    GPU_GL_STORAGE_BINDINGS = 0x90DD,
    GPU_GL_STORAGE_BLOCK_SIZE = 0x90DE,
    GPU_GL_COMPUTE_SHADER = 0x91B9,
    GPU_GL_PIXEL_BUFFER_BARRIER_BIT = 0x0080,
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

#define GPU_EGL_FUNCTIONS(X) \
    X(uint32_t, BindAPI, (uint32_t api)) \
    X(void *, CreateContext, (void *display, void *config, void *share, const int32_t *attributes)) \
    X(uint32_t, DestroyContext, (void *display, void *context)) \
    X(void *, GetCurrentContext, (void)) \
    X(void *, GetCurrentDisplay, (void)) \
    X(void *, GetCurrentSurface, (int32_t which)) \
    X(void *, GetDisplay, (void *native)) \
    X(gpu_function, GetProcAddress, (const char *name)) \
    X(uint32_t, Initialize, (void *display, int32_t *major, int32_t *minor)) \
    X(uint32_t, MakeCurrent, (void *display, void *draw, void *read, void *context)) \
    X(uint32_t, QueryAPI, (void))

#define GPU_MEMBER(result, name, arguments) result(*name) arguments;
typedef struct gpu_egl {
    void *library, *display, *context;
    GPU_EGL_FUNCTIONS(GPU_MEMBER)
    void *(*GetPlatformDisplay)(uint32_t platform, void *native, const int32_t *attributes);
    uint32_t (*QueryDevices)(int32_t room, void **devices, int32_t *count);
} gpu_egl;

typedef struct gpu_gl {
    GPU_FUNCTIONS(GPU_MEMBER)
} gpu_gl;
#undef GPU_MEMBER

/* Memory of the device. All zero: none yet. */
typedef struct gpu_buffer {
    uint32_t name;
    size_t size; /* bytes */
} gpu_buffer;

/* The compute programs, each of the file of its name, compiled when they are first used. */
#define GPU_EACH_PROGRAM(X) \
    X(SEEN_OBJECTS, seen_objects) \
    X(SEEN_LIST, seen_list) \
    X(SEEN_COPY, seen_copy) \
    X(TRANSPORT_NODES, transport_nodes) \
    X(TRANSPORT_SUMS, transport_sums) \
    X(SHADE, shade) \
    X(PROJECT, project) \
    X(SORT_COUNT, sort_count) \
    X(SORT_SCATTER, sort_scatter) \
    X(BIN_COUNT, bin_count) \
    X(BIN_SCAN, bin_scan) \
    X(BIN_EMIT, bin_emit) \
    X(BIN_END, bin_end) \
    X(WALK_CAMERA, walk_camera) \
    X(GATHER_CAMERA, gather_camera) \
    X(WALK_LIGHT, walk_light) \
    X(WALK_MAP, walk_map) \
    X(GATHER_LIGHT, gather_light) \
    X(COMPOSITE, composite) \
    X(COMPOSITE_LAYERS, composite_layers)

typedef enum gpu_program {
#define GPU_NUMBER(number, file) GPU_##number,
    GPU_EACH_PROGRAM(GPU_NUMBER) GPU_PROGRAMS
#undef GPU_NUMBER
} gpu_program;

enum {
    GPU_COMMON = 3,  /* bindings that all programs have: tables, objects of Gaussians, facts */
    GPU_SLOPES = 14, /* and these two: slopes; shadow maps, the scene's depth */
    GPU_OUTSIDE = 15,
    GPU_BINDINGS = 16,
    GPU_MOST_BLOCKS = 14, /* storage blocks of a program: COMPOSITE's */
    GPU_LAMPS = 64,
    GPU_VIEWS = 256,
    GPU_MAPS = 64,
    GPU_TOTALS = 256, /* batches of views */
    GPU_LENGTHS = 5,  /* of true dipole transport */
    GPU_ROWS = 4096   /* values that a group's networks work on */
};

/* The context that the calling program had current, and gets back; in its own context what was bound. */
typedef struct gpu_current {
    void *display, *draw, *read, *context;
    uint32_t api;
    int32_t program, buffers[4], storage[GPU_BINDINGS], uniform;
    int64_t range[GPU_BINDINGS + 1][2]; /* start and size; the last the uniform buffer's */
} gpu_current;

/* A part of a buffer that something has; in units of the arena. */
typedef struct gpu_piece {
    size_t at, size;
    const void *owner;
    uint64_t revision; /* of what is there; 0: nothing */
    int sky;           /* 1: sky shares, too */
} gpu_piece;

typedef struct gpu_arena {
    gpu_buffer buffer;
    size_t unit;       /* bytes */
    gpu_piece *pieces; /* by `at` */
    int count, room;
} gpu_arena;

/* What the stages up to WALK leave of views, slot by slot, as in ssdgs_splat_view: slot i has the Gaussians
   from i n on, and tiles are numbered through. */
typedef struct gpu_set {
    gpu_buffer record, depth, order, instance, of_gaussian, tile_start, tile_list, tile_seen, tile_needed,
        tile_sums;
} gpu_set;

typedef struct gpu_light {
    int ready; /* 1: the nodes are of the flux, and transport of what has this revision */
    uint32_t revision;
} gpu_light;

/* What only the device counts of a view. */
typedef struct gpu_fact {
    uint32_t visible, instances;
    float nearest;
} gpu_fact;

/* What a frame leaves, as in ssdgs_frame. */
typedef struct gpu_frame {
    gpu_set camera,
        others; /* of the camera, and lights in the same frame; of lights while the camera rests */
    gpu_buffer tables, object_of, facts, slopes, outside, masks;
    gpu_arena models; /* planes, networks, sky shares; floats */
    gpu_arena maps;   /* tiles of light maps */
    gpu_light light[GPU_LAMPS];
    gpu_buffer seen, tally, of_object, ahead, visibility, depth_cue, flux;
    gpu_buffer shaded, layers, neighbours; /* shaded: its count, then the Gaussians */
    gpu_buffer nodes, transport, arrived;  /* arrived: the revision, (lights, blocks of 64 Gaussians) */
    gpu_buffer planes;                     /* composite.glsl says which */
} gpu_frame;

/* What stages use while they run. */
typedef struct gpu_scratch {
    gpu_buffer key[2], value[2]; /* what is sorted, from one to the other */
    gpu_buffer digits;           /* (segments, blocks, 256) how often a digit is in a block */
    gpu_buffer groups;           /* (slots, groups) instances of 256 ranks */
    gpu_buffer owner;            /* (instances) their Gaussians */
} gpu_scratch;

/* frame.glsl says what these are. */
typedef struct gpu_parameters {
    float eye[4], ambient[9][4];
    uint32_t count, lights, layers, object_count, blocks, above, width, height, cue, flux, maps, thrifty,
        hides, median, parts, map_count, slots, works, tiles, camera_tiles, sharing, room, total, looks,
        segments, keys, shift, rows;
    float log2_threshold, stop, max_error, bias, pixel_bias, far_radii;
    uint32_t scene_at, scene_raw;
    float unseen[4];
} gpu_parameters;
typedef struct gpu_lamp {
    float place[4], intensity[4], cone[4], rim[4], share[4];
    int32_t of[4];
} gpu_lamp;
typedef struct gpu_projection {
    float view[12], lens[4], kind[4];
    int32_t size[4], of[4], more[4];
} gpu_projection;
typedef struct gpu_shadow_map {
    float clip[16], kind[4];
    int32_t size[4];
} gpu_shadow_map;
typedef struct gpu_object {
    float turn[3][4], shape[4], eye[4], centre[4], tint[4], edit[4], travel[4], basis[3 * SSDGS_ASG_COUNT][4],
        medium[GPU_LENGTHS][4];
    int32_t network[2][4], inputs[4], place[4], more[4], of[4];
    uint32_t reach[4];
} gpu_object;
typedef struct gpu_tables {
    gpu_lamp lamps[GPU_LAMPS];
    gpu_projection views[GPU_VIEWS];
    int32_t light_at_work[GPU_LAMPS][4];
    gpu_shadow_map maps[GPU_MAPS];
    uint32_t view_at_work[GPU_VIEWS];
    gpu_object objects[1]; /* and more */
} gpu_tables;

/* Light maps on the host, for who asks the library. */
typedef struct gpu_host_map {
    const void *memory; /* frame.memory of the frames */
    int view;
    ssdgs_light_pixel *pixels;
    uint32_t *tiles;
} gpu_host_map;

typedef struct gpu_texture {
    uint32_t name, target;
} gpu_texture;

struct gpu {
    gpu_egl egl;
    gpu_gl gl;
    int guest;    /* 1: in the caller's context */
    int32_t most; /* bytes of a buffer that programs can see */
    gpu_current callers;
    uint32_t program[GPU_PROGRAMS];
    gpu_buffer uniforms, staging; /* staging: what downloads go by */
    gpu_frame frame;
    gpu_parameters p; /* of the frame at work */
    gpu_tables *tables;
    size_t tables_size; /* bytes */
    void *host;         /* what gpu_host() gives */
    size_t host_size;
    gpu_scratch scratch;
    size_t instance_room; /* of each set */
    int32_t columns;      /* the fewest that any object's networks have */
    uint32_t deep;        /* 1: the camera's view has slopes */
    uint32_t revisions;   /* that flux has had so far */
    uint64_t transported; /* what transport depends on besides flux */
    uint64_t outside;     /* which shadow maps the device has */
    gpu_texture scene_texture, shadow_texture[GPU_MAPS];
    float scene_projection[16];
    gpu_picture picture;
    gpu_light_map maps[GPU_LAMPS]; /* of a guest */
    gpu_host_map *host_maps;
    int host_map_count;
    int busy;            /* 1: programs may still run */
    const void *owner;   /* frame.memory of the last frame: what views have left is of its */
    int lost;            /* 1: something has failed, and all is the CPU's from then on */
    int waits;           /* 1: for the device at the end of each stage */
    char name[128];      /* the device's */
    ssdgs_result result; /* the first failure since gpu_enter(): what follows it does nothing */
    char message[1024];
};

/* ==== shaders ==== */

/* A driver's message has a file's number and a line: 0 is the program's own file; 1, 2 .. are those that it
   includes, in their order. */
#include "gpu_shaders.h"

static const struct {
    const char *name, *text;
} gpu_sources[GPU_PROGRAMS] = {
#define GPU_SOURCE(number, file) {#file ".comp", gpu_##file##_comp},
    GPU_EACH_PROGRAM(GPU_SOURCE)
#undef GPU_SOURCE
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
gpu_picture gpu_last_picture(const gpu *g) { return g->picture; }

gpu_light_map gpu_last_map(const gpu *g, int light) {
    gpu_light_map none;
    memset(&none, 0, sizeof none);
    return light < 0 || light >= GPU_LAMPS ? none : g->maps[light];
}

void gpu_scene_depth(gpu *g, uint32_t texture, const float projection[16]) {
    g->scene_texture.name = texture;
    g->scene_texture.target = GPU_GL_TEXTURE_2D;
    if (texture) memcpy(g->scene_projection, projection, sizeof g->scene_projection);
}

void gpu_shadow_texture(gpu *g, int map, uint32_t texture, uint32_t target) {
    if (map < 0 || map >= GPU_MAPS) return;
    g->shadow_texture[map].name = texture;
    g->shadow_texture[map].target = target;
}

/* ==== contexts ==== */

#ifdef _WIN32 /* where drivers have no EGL */
static void *gpu_open_egl(void) { return NULL; }
static void gpu_find(void *library, const char *name, void *function) {
    (void)library, (void)name, (void)function;
}
#else
/* It stays open: loaded again it would make its displays anew, which are never closed. */
static void *gpu_open_egl(void) { return dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL); }
/* ISO C has no cast from dlsym's result. */
static void gpu_find(void *library, const char *name, void *function) {
    void *const found = dlsym(library, name);
    memcpy(function, &found, sizeof found);
}
#endif

/* An extension's function, or OpenGL's: NULL where it is missing. */
static void gpu_extension(const gpu_egl *egl, const char *name, void *function) {
    const gpu_function found = egl->GetProcAddress(name);
    memcpy(function, &found, sizeof found);
}

static int gpu_load_egl(gpu_egl *egl) {
    int found = 1;
    egl->library = gpu_open_egl();
    if (!egl->library) return 0;
#define GPU_LOAD(result, name, arguments) \
    gpu_find(egl->library, "egl" #name, &egl->name); \
    found = found && egl->name;
    GPU_EGL_FUNCTIONS(GPU_LOAD)
#undef GPU_LOAD
    if (!found) return 0;
    gpu_extension(egl, "eglGetPlatformDisplayEXT", &egl->GetPlatformDisplay);
    gpu_extension(egl, "eglQueryDevicesEXT", &egl->QueryDevices);
    return 1;
}

/* OpenGL's functions, and whether it does what programs need. */
static int gpu_load_gl(gpu *g, void *(*find)(const char *name)) {
    int found = 1;
    int32_t blocks = 0, bindings = 0;
#define GPU_LOAD(result, name, arguments) \
    if (find) { \
        void *const function = find("gl" #name); \
        memcpy(&g->gl.name, &function, sizeof function); \
    } else gpu_extension(&g->egl, "gl" #name, &g->gl.name); \
    found = found && g->gl.name;
    GPU_FUNCTIONS(GPU_LOAD)
#undef GPU_LOAD
    if (!found) return 0;
    g->gl.GetIntegerv(GPU_GL_STORAGE_BLOCKS, &blocks);
    g->gl.GetIntegerv(GPU_GL_STORAGE_BINDINGS, &bindings);
    g->gl.GetIntegerv(GPU_GL_STORAGE_BLOCK_SIZE, &g->most);
    if (blocks < GPU_MOST_BLOCKS || bindings < GPU_BINDINGS) return 0; /* OpenGL promises 8 */
    snprintf(g->name, sizeof g->name, "%s", (const char *)g->gl.GetString(GPU_GL_RENDERER));
    return 1;
}

/* Where buffers are bound that are not a program's. */
static const uint32_t gpu_targets[4][2] = {
    {GPU_GL_SHADER_STORAGE_BUFFER, GPU_GL_SHADER_STORAGE_BUFFER_BINDING},
    {GPU_GL_UNIFORM_BUFFER, GPU_GL_UNIFORM_BUFFER_BINDING},
    {GPU_GL_COPY_READ_BUFFER, GPU_GL_COPY_READ_BUFFER},
    {GPU_GL_COPY_WRITE_BUFFER, GPU_GL_COPY_WRITE_BUFFER}};

/* What the caller has bound; then that again. */
static void gpu_note_bound(gpu *g) {
    gpu_current *c = &g->callers;
    const gpu_gl *gl = &g->gl;
    /* errors of the caller's calls; a lost context has no end of them */
    for (int i = 0; i < 8 && gl->GetError(); i++) {}
    gl->GetIntegerv(GPU_GL_CURRENT_PROGRAM, &c->program);
    for (int i = 0; i < 4; i++) gl->GetIntegerv(gpu_targets[i][1], c->buffers + i);
    for (uint32_t i = 0; i <= GPU_BINDINGS; i++) {
        const uint32_t name = gpu_targets[i == GPU_BINDINGS][1], index = i % GPU_BINDINGS;
        gl->GetIntegeri_v(name, index, i < GPU_BINDINGS ? c->storage + i : &c->uniform);
        for (uint32_t j = 0; j < 2; j++) gl->GetInteger64i_v(name + 1 + j, index, &c->range[i][j]);
    }
}

static void gpu_bind_again(gpu *g) {
    const gpu_current *c = &g->callers;
    const gpu_gl *gl = &g->gl;
    gl->UseProgram((uint32_t)c->program);
    for (uint32_t i = 0; i <= GPU_BINDINGS; i++) {
        const uint32_t target = gpu_targets[i == GPU_BINDINGS][0], index = i % GPU_BINDINGS,
                       buffer = (uint32_t)(i < GPU_BINDINGS ? c->storage[i] : c->uniform);
        if (buffer && c->range[i][1])
            gl->BindBufferRange(target, index, buffer, (intptr_t)c->range[i][0], (intptr_t)c->range[i][1]);
        else gl->BindBufferBase(target, index, buffer);
    }
    for (int i = 0; i < 4; i++) gl->BindBuffer(gpu_targets[i][0], (uint32_t)c->buffers[i]);
}

static void gpu_leave_context(gpu *g) {
    const gpu_egl *egl = &g->egl;
    const gpu_current *c = &g->callers;
    if (g->guest) {
        gpu_bind_again(g);
        return;
    }
    egl->MakeCurrent(egl->display, NULL, NULL, NULL);
    egl->BindAPI(c->api);
    if (c->context) egl->MakeCurrent(c->display, c->draw, c->read, c->context);
}

static int gpu_enter_context(gpu *g) {
    const gpu_egl *egl = &g->egl;
    gpu_current *c = &g->callers;
    if (g->guest) {
        gpu_note_bound(g);
        return 1;
    }
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
        const int found = gpu_load_gl(g, NULL);
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

gpu *gpu_create(void *(*find)(const char *name), char *message, size_t size) {
    gpu *g = (gpu *)calloc(1, sizeof *g);
    const char *missing = "memory";
    if (g) {
        g->guest = find != NULL;
        g->frame.models.unit = sizeof(float);
        g->frame.maps.unit = 256 * sizeof(ssdgs_light_pixel);
        if (!find && !gpu_load_egl(&g->egl)) missing = "libEGL.so.1";
        else if (find ? gpu_load_gl(g, find) : gpu_find_display(g)) return g;
        else missing = "OpenGL 4.3 with 14 storage blocks a program";
    }
    if (size) snprintf(message, size, "no GPU: there is no %s", missing);
    if (g) memset(&g->gl, 0, sizeof g->gl);
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

/* The same, but what was there stays. */
static void gpu_extend(gpu *g, gpu_buffer *b, size_t size) {
    gpu_buffer old = *b;
    if (g->result || (b->name && b->size >= size)) return;
    const void *const owner = g->owner;
    b->name = 0;
    gpu_reserve(g, b, size);
    g->owner = g->result ? NULL : owner;
    if (old.name && !g->result) {
        g->gl.BindBuffer(GPU_GL_COPY_READ_BUFFER, old.name);
        g->gl.BindBuffer(GPU_GL_COPY_WRITE_BUFFER, b->name);
        g->gl.MemoryBarrier(GPU_GL_BUFFER_UPDATE_BARRIER_BIT);
        g->gl.CopyBufferSubData(GPU_GL_COPY_READ_BUFFER, GPU_GL_COPY_WRITE_BUFFER, 0, 0, (intptr_t)old.size);
    }
    if (old.name) g->gl.DeleteBuffers(1, &old.name);
}

/* A piece of so many units, of an owner that has one at most. NULL: there is no room. */
static gpu_piece *gpu_place(gpu *g, gpu_arena *a, const void *owner, size_t size) {
    size_t at = 0;
    int i = 0;
    for (; i < a->count && a->pieces[i].owner != owner; i++) {}
    if (i < a->count && a->pieces[i].size == size) return a->pieces + i;
    if (i < a->count) memmove(a->pieces + i, a->pieces + i + 1, (size_t)(--a->count - i) * sizeof *a->pieces);
    for (i = 0; i < a->count && a->pieces[i].at - at < size; i++) at = a->pieces[i].at + a->pieces[i].size;
    if (a->count == a->room) {
        gpu_piece *more = (gpu_piece *)realloc(a->pieces, (size_t)(2 * a->room + 16) * sizeof *more);
        if (!more) {
            gpu_fail(g, SSDGS_ERR_MEMORY, "out of memory");
            return NULL;
        }
        a->pieces = more;
        a->room = 2 * a->room + 16;
    }
    if ((at + size) * a->unit > (size_t)g->most) return NULL;
    gpu_extend(g, &a->buffer, (at + size) * a->unit);
    memmove(a->pieces + i + 1, a->pieces + i, (size_t)(a->count++ - i) * sizeof *a->pieces);
    memset(a->pieces + i, 0, sizeof *a->pieces);
    a->pieces[i].at = at, a->pieces[i].size = size, a->pieces[i].owner = owner;
    return g->result ? NULL : a->pieces + i;
}

/* Writes to a buffer that has room, from there on. Waits for programs that still run: on NVIDIA's driver 580
   they could see what was written after they were started. */
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

/* A small buffer that is written in every frame: the driver takes other memory while programs still read it.
 */
static void gpu_write_anew(gpu *g, gpu_buffer *b, const void *data, size_t size) {
    if (g->result) return;
    if (!b->name) g->gl.GenBuffers(1, &b->name);
    g->gl.BindBuffer(GPU_GL_SHADER_STORAGE_BUFFER, b->name);
    g->gl.BufferData(GPU_GL_SHADER_STORAGE_BUFFER, (intptr_t)size, data, GPU_GL_DYNAMIC_DRAW);
    gpu_check(g, "a table");
    b->size = g->result ? 0 : size;
}

/* Waits for the device. By way of memory that is the host's: straight from the device's it is slow. */
static void gpu_download_at(gpu *g, const gpu_buffer *b, size_t from, void *data, size_t size) {
    if (!g->result && b->size < from + size) gpu_fail(g, SSDGS_ERR_ISA, "a buffer holds less than is read");
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
    g->gl.CopyBufferSubData(GPU_GL_COPY_READ_BUFFER, GPU_GL_COPY_WRITE_BUFFER, (intptr_t)from, 0,
                            (intptr_t)size);
    g->gl.GetBufferSubData(GPU_GL_COPY_WRITE_BUFFER, 0, (intptr_t)size, data);
    g->busy = 0;
}

static void gpu_download(gpu *g, const gpu_buffer *b, void *data, size_t size) {
    gpu_download_at(g, b, 0, data, size);
}

/* ==== programs ==== */

static uint32_t gpu_compile(gpu *g, gpu_program which) {
    const char *name = gpu_sources[which].name;
    int32_t compiled = 0, linked = 0;
    char log[768] = "";
    const uint32_t shader = g->gl.CreateShader(GPU_GL_COMPUTE_SHADER), program = g->gl.CreateProgram();
    g->gl.ShaderSource(shader, 1, &gpu_sources[which].text, NULL);
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

enum { GPU_GROUP = 256 };
static size_t gpu_groups(size_t items) { return (items + GPU_GROUP - 1) / GPU_GROUP; }

/* Runs so many groups of a program, and perhaps some more: programs must look at item() or group(). Besides
   the common ones it has these buffers, of bindings GPU_COMMON and so on, up to a NULL. Some may be other
   programs' alone. What runs later sees what it wrote. */
static void gpu_run(gpu *g, gpu_program which, const gpu_parameters *p, const gpu_buffer *const *buffers,
                    size_t groups) {
    const size_t most = 65535, rows = (groups + most - 1) / most;
    const gpu_frame *f = &g->frame;
    if (!g->result && !g->program[which]) g->program[which] = gpu_compile(g, which);
    if (g->result || !groups) return;
    g->gl.UseProgram(g->program[which]);
    if (!g->uniforms.name) g->gl.GenBuffers(1, &g->uniforms.name);
    g->gl.BindBufferBase(GPU_GL_UNIFORM_BUFFER, 0, g->uniforms.name);
    g->gl.BufferData(GPU_GL_UNIFORM_BUFFER, sizeof *p, p, GPU_GL_DYNAMIC_DRAW);
    const gpu_buffer *const common[GPU_COMMON] = {&f->tables, &f->object_of, &f->facts};
    for (uint32_t i = 0; i < GPU_COMMON; i++)
        g->gl.BindBufferBase(GPU_GL_SHADER_STORAGE_BUFFER, i, common[i]->name);
    g->gl.BindBufferBase(GPU_GL_SHADER_STORAGE_BUFFER, GPU_SLOPES, f->slopes.name);
    g->gl.BindBufferBase(GPU_GL_SHADER_STORAGE_BUFFER, GPU_OUTSIDE, f->outside.name);
    for (uint32_t i = 0; buffers[i]; i++)
        g->gl.BindBufferBase(GPU_GL_SHADER_STORAGE_BUFFER, GPU_COMMON + i, buffers[i]->name);
    g->gl.DispatchCompute((uint32_t)((groups + rows - 1) / rows), (uint32_t)rows, 1);
    g->gl.MemoryBarrier(GPU_GL_SHADER_STORAGE_BARRIER_BIT);
    g->busy = 1;
}

/* ==== what programs know of a frame ==== */

/* Flags of an object; frame.glsl has them. The terms of SSDGS_ALL_TERMS are the first four. */
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
    GPU_BAKED = 8192,
    GPU_LIT = 16384,
    GPU_DECODES = 32768,
    GPU_FLOOR = 65536
};
#define GPU_SOFT 0.02     /* length units: transport's distances are sqrt(r^2 + soft^2) */
#define GPU_SHORTEST 0.04 /* of its lengths, each twice the one before */

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

static size_t gpu_fours(size_t count) { return (count + 3) / 4 * 4; }

/* Floats of a network on the device, with its neurons padded to 4. */
static size_t gpu_network_size(const int32_t sizes[4]) {
    size_t size = 0, depth = (size_t)sizes[1];
    for (int layer = 1; layer <= sizes[0]; layer++) {
        const size_t neurons = (size_t)sizes[layer < sizes[0] ? 2 : 3];
        size += (depth + 1) * gpu_fours(neurons);
        depth = neurons;
    }
    return size;
}

/* A network's weights, (neurons, inputs) and then biases of each layer, as the device has them: (inputs,
   neurons), the biases as one input more. `to` is all 0. */
static void gpu_turn_network(const int32_t sizes[4], const ssdgs_real *weights, float *to) {
    size_t depth = (size_t)sizes[1];
    for (int layer = 1; layer <= sizes[0]; layer++) {
        const size_t neurons = (size_t)sizes[layer < sizes[0] ? 2 : 3], stride = gpu_fours(neurons);
        for (size_t i = 0; i < neurons; i++) {
            for (size_t k = 0; k < depth; k++) to[k * stride + i] = (float)weights[i * depth + k];
            to[depth * stride + i] = (float)weights[neurons * depth + i];
        }
        weights += neurons * (depth + 1);
        to += stride * (depth + 1);
        depth = neurons;
    }
}

/* Planes of a model, packed, padded to fours; its networks; room for sky shares. In floats. */
typedef struct gpu_model_layout {
    size_t stride, weights, shadow, sky, size; /* where each begins; size: of all */
    int32_t networks[2][4];
} gpu_model_layout;

static gpu_model_layout gpu_layout(const ssdgs_placed *o) {
    gpu_model_layout l;
    l.stride = gpu_fours((size_t)o->gaussians.count);
    l.weights = l.stride * (size_t)o->gaussians.channels;
    for (int i = 0; i < 2; i++) gpu_network_sizes(&o->settings, i, l.networks[i]);
    l.shadow = l.weights + (o->settings.baked ? 0 : gpu_network_size(l.networks[0]));
    l.sky = l.shadow + (o->settings.baked ? 0 : gpu_network_size(l.networks[1]));
    l.size = l.sky + (o->settings.baked ? 0 : l.stride);
    return l;
}

/* Brings a model to its piece, unless it is there. */
static void gpu_upload_model(gpu *g, const ssdgs_placed *o, gpu_piece *piece) {
    const gpu_model_layout l = gpu_layout(o);
    const ssdgs_model_view *v = &o->gaussians;
    const gpu_buffer *to = &g->frame.models.buffer;
    if (piece->revision != o->revision) {
        float *const all = (float *)gpu_host(g, l.sky * sizeof *all);
        if (!all) return;
        for (size_t c = 0; c < (size_t)v->channels; c++)
            memcpy(all + c * l.stride, v->gaussians + c * v->stride, (size_t)v->count * sizeof *all);
        if (!o->settings.baked) {
            gpu_turn_network(l.networks[0], v->scattering, all + l.weights);
            gpu_turn_network(l.networks[1], v->shadow, all + l.shadow);
        }
        gpu_write(g, to, piece->at * sizeof *all, all, l.sky * sizeof *all);
        piece->sky = 0;
        piece->revision = g->result ? 0 : o->revision;
    }
    if (o->sky_share && !piece->sky) {
        gpu_write(g, to, (piece->at + l.sky) * sizeof(float), o->sky_share, (size_t)v->count * sizeof(float));
        piece->sky = !g->result;
    }
}

/* All of a frame's models. Where they do not fit beside those of earlier frames these go. */
static void gpu_upload_models(gpu *g, const ssdgs_frame *frame) {
    gpu_arena *a = &g->frame.models;
    for (int again = 0; again < 2; again++) {
        int i = 0;
        for (; i < frame->object_count && !g->result; i++) {
            const ssdgs_placed *o = frame->objects + i;
            gpu_piece *piece = gpu_place(g, a, o->model, gpu_layout(o).size);
            if (!piece) break;
            gpu_upload_model(g, o, piece);
        }
        if (i == frame->object_count || g->result) return;
        a->count = 0;
    }
    gpu_fail(g, SSDGS_ERR_LIMIT, "the models do not fit in %lu bytes", (unsigned long)g->most);
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

/* The lobes that all Gaussians of a model share; those of a Gaussian's own frame are as rough as the object.
 */
static void gpu_find_basis(const ssdgs_placed *o, float basis[3 * SSDGS_ASG_COUNT][4]) {
    const int deferred = o->settings.asg == SSDGS_ASG_DEFERRED;
    const double rough2 = deferred ? 1 : (double)o->roughness * (double)o->roughness;
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        const ssdgs_real *sharpness = o->gaussians.asg_sharpness + 2 * j;
        const double least = -10, most = 20; /* of the raw a */
        double raw = (double)o->gaussians.asg_sigma[j], axes[3][3];
        raw = raw > most ? most : raw < least ? least : raw;
        gpu_axes(o->gaussians.asg_basis + 4 * j, axes);
        for (int i = 0; i < 6; i++) basis[3 * j + i / 3][i % 3] = (float)axes[i / 3][i % 3];
        for (int i = 0; i < 2; i++)
            basis[3 * j + i][3] = (float)((double)gpu_exp((double)sharpness[i]) / rough2);
        basis[3 * j + 2][0] = (float)gpu_sigmoid((double)sharpness[1]);
        basis[3 * j + 2][1] = gpu_exp((double)sharpness[0]);
        basis[3 * j + 2][2] = (float)(log1p(exp(-fabs(raw))) + (raw > 0 ? raw : 0));
    }
}

static int gpu_has_medium(const ssdgs_placed *o) {
    return !o->settings.scattering.layers && (o->terms & SSDGS_SCATTERING_TERM);
}

static int32_t gpu_flags(const ssdgs_frame *frame, const ssdgs_placed *o) {
    const ssdgs_settings *s = &o->settings;
    const int stored = s->baked && s->transfer == SSDGS_TRANSFER_SRGB;
    return (o->terms & SSDGS_ALL_TERMS) | (s->asg == SSDGS_ASG_DEFERRED ? GPU_DEFERRED : 0) |
           (s->depth_cue ? GPU_DEPTH_CUE : 0) |
           (s->transport && (o->terms & SSDGS_SCATTERING_TERM) ? GPU_TRANSPORT : 0) |
           (s->residual_shadow ? GPU_RESIDUAL_SHADOW : 0) |
           (s->shadow_on_scattering ? GPU_SHADOW_ON_SCATTERING : 0) |
           (s->per_channel_optics ? GPU_PER_CHANNEL_OPTICS : 0) |
           (s->dipole == SSDGS_DIPOLE_PRINTED ? GPU_PRINTED_DIPOLE : 0) | (o->sky_share ? GPU_AMBIENT : 0) |
           (gpu_has_medium(o) ? GPU_MEDIUM : 0) | (s->baked ? GPU_BAKED : 0) |
           (o->light_count ? GPU_LIT : 0) |
           (frame->settings.transfer == SSDGS_TRANSFER_SRGB && !stored ? GPU_DECODES : 0) |
           (s->light_map.blur == SSDGS_BLUR_FLOOR ? GPU_FLOOR : 0);
}

/* As many columns as a network's widest layer leaves room for, a power of 2 up to 64. */
static int32_t gpu_columns(int32_t network[2][4]) {
    int32_t columns = 64;
    for (int i = 0; i < 2; i++)
        for (int j = 1; j < 4 && network[i][0]; j++)
            while (columns * network[i][j] > GPU_ROWS) columns /= 2;
    return columns;
}

/* All but where its model is. */
static void gpu_set_object(gpu_object *to, const ssdgs_frame *frame, const ssdgs_placed *o) {
    const ssdgs_settings *s = &o->settings;
    const double unit = (double)s->length_unit, eta = (double)s->eta, scale = (double)o->scale,
                 fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta,
                 longer = gpu_has_medium(o) ? 1 : (double)o->translucency,
                 shortest = GPU_SHORTEST * unit * longer, longest = shortest * (1 << (GPU_LENGTHS - 1));
    const ptrdiff_t index = o - frame->objects;
    memset(to, 0, sizeof *to);
    for (int i = 0; i < 3; i++) {
        double at = 0;
        for (int j = 0; j < 3; j++) {
            to->turn[i][j] = (float)o->rotation[3 * i + j];
            at += (double)o->rotation[3 * j + i] * ((double)frame->eye[j] - (double)o->offset[j]) / scale;
        }
        to->turn[i][3] = (float)o->offset[i];
        to->eye[i] = (float)at;
        to->centre[i] = (float)s->centre[i];
        to->tint[i] = (float)o->tint[i];
        for (int j = 0; j < GPU_LENGTHS; j++) to->medium[j][i] = (float)o->medium[GPU_LENGTHS * i + j];
    }
    for (int j = 0; j < GPU_LENGTHS; j++)
        to->medium[j][3] = (float)exp(-GPU_SOFT / (GPU_SHORTEST * (1 << j)));
    to->shape[0] = (float)o->scale;
    to->shape[1] = (float)o->presence;
    to->shape[2] = (float)s->pixel_variance;
    to->shape[3] = (float)o->kept;
    to->eye[3] = (float)(1e-6 * unit * unit);
    to->centre[3] = (float)(1 / unit);
    to->tint[3] = (float)o->specular;
    to->edit[0] = (float)o->roughness;
    to->edit[1] = (float)(1 / (scale * (double)o->translucency));
    to->edit[2] = (float)s->light_scale;
    to->edit[3] = (float)(1 + 4.0 / 3 * (1 + fdr) / (1 - fdr));
    to->travel[0] = (float)(GPU_SOFT * unit * GPU_SOFT * unit);
    to->travel[1] = (float)(-1 / (log(2) * longest));
    to->travel[2] = (float)(1 / (2 * 3.14159265358979323846 * shortest));
    gpu_find_basis(o, to->basis);
    for (int i = 0; i < 2; i++) gpu_network_sizes(s, i, to->network[i]);
    to->inputs[0] = s->octaves.view;
    to->inputs[1] = s->octaves.light;
    to->inputs[2] = gpu_columns(to->network);
    to->inputs[3] = s->harmonics;
    to->place[0] = o->first;
    to->place[1] = o->gaussians.count;
    to->more[3] = -1;
    to->of[0] = gpu_flags(frame, o);
    to->of[1] = o->material;
    for (ptrdiff_t row = 0; row <= frame->light_count && row < 128; row++)
        if (!frame->reach || frame->reach[row * frame->object_count + index])
            to->reach[row / 32] |= (uint32_t)1 << row % 32;
}

/* The objects, their masks, and which of them each 64 Gaussians are of. */
static void gpu_upload_objects(gpu *g, const ssdgs_frame *frame) {
    gpu_frame *f = &g->frame;
    size_t masked = 0;
    g->p.above = 0;
    g->columns = 64;
    for (int i = 0; i < frame->object_count && !g->result; i++) {
        const ssdgs_placed *o = frame->objects + i;
        const gpu_model_layout l = gpu_layout(o);
        gpu_object *to = g->tables->objects + i;
        const gpu_piece *piece = gpu_place(g, &f->models, o->model, l.size); /* it is there */
        if (!piece) return;
        gpu_set_object(to, frame, o);
        to->place[2] = (int32_t)piece->at;
        to->place[3] = (int32_t)l.stride;
        to->more[0] = (int32_t)((piece->at + l.weights) / 4);
        to->more[1] = (int32_t)((piece->at + l.shadow) / 4);
        to->more[2] = (int32_t)(piece->at + l.sky);
        to->of[2] = (int32_t)g->p.above;
        to->of[3] = (int32_t)(((size_t)o->gaussians.count + 4095) / 4096);
        g->p.above += (uint32_t)to->of[3];
        if (to->inputs[2] < g->columns) g->columns = to->inputs[2];
        if (!o->mask) continue;
        to->more[3] = (int32_t)masked;
        masked += gpu_fours((size_t)o->gaussians.count);
    }
    unsigned char *const masks = (unsigned char *)gpu_host(g, masked + 16);
    for (int i = 0; i < frame->object_count && masks; i++)
        if (frame->objects[i].mask)
            memcpy(masks + g->tables->objects[i].more[3], frame->objects[i].mask,
                   (size_t)frame->objects[i].gaussians.count);
    gpu_write_anew(g, &f->masks, masks, masked + 16);
    uint32_t *const of = (uint32_t *)gpu_host(g, (g->p.blocks + 4) * sizeof *of);
    for (size_t i = 0; i < g->p.blocks && of && frame->object_of; i++) of[i] = frame->object_of[i];
    gpu_write_anew(g, &f->object_of, of, (g->p.blocks + 4) * sizeof *of);
}

/* Whether it is not dark, or its shadow takes from what is kept. */
static int gpu_shines(const ssdgs_light *l) {
    return l->intensity[0] > 0 || l->intensity[1] > 0 || l->intensity[2] > 0 || l->kept > 0;
}

/* Has the light a map? */
static int gpu_casts(const ssdgs_light *l) { return !l->unshadowed && gpu_shines(l); }

static void gpu_set_lamp(gpu_lamp *lamp, const ssdgs_light *l) {
    const int spot = l->kind == SSDGS_LIGHT_SPOT, directional = l->kind == SSDGS_LIGHT_DIRECTIONAL,
              ranged = !directional && l->range > 0, focused = !directional && l->focus > 0;
    const double inner = (double)l->cone[0], outer = (double)l->cone[1],
                 width = 2 * sin((inner + outer) / 2) * sin((outer - inner) / 2); /* of their cosines */
    double length2 = 0, norm2 = 0;
    for (int i = 0; i < 3; i++) length2 += (double)l->direction[i] * (double)l->direction[i];
    for (int i = 0; i < 3; i++) {
        lamp->place[i] = directional ? -(float)l->direction[i] : (float)l->position[i];
        lamp->intensity[i] = (float)l->intensity[i];
        lamp->cone[i] = (float)(spot || focused ? (double)l->direction[i] / sqrt(length2) : 0);
        norm2 += (double)lamp->cone[i] * (double)lamp->cone[i];
    }
    lamp->place[3] = (float)directional;
    lamp->intensity[3] = (float)(gpu_shines(l) ? gpu_casts(l) : -1);
    lamp->cone[3] = ranged ? (float)(1 / l->range) : 0;
    lamp->rim[0] = spot ? (float)(((1 + norm2) / 2 - cos(outer)) / width) : 1;
    lamp->rim[1] = spot ? (float)(0.5 / width) : 0;
    lamp->rim[2] = (float)(spot || ranged || focused);
    lamp->rim[3] = focused ? (float)l->focus : 0;
}

static int gpu_tiles(const ssdgs_splat_view *v) { return ((v->width + 15) / 16) * ((v->height + 15) / 16); }

static void gpu_set_view(gpu_projection *to, const ssdgs_splat_view *v) {
    memset(to, 0, sizeof *to);
    for (int i = 0; i < 12; i++) to->view[i] = (float)v->view[i];
    to->lens[0] = (float)v->fx;
    to->lens[1] = (float)v->fy;
    to->lens[2] = (float)v->cx;
    to->lens[3] = (float)v->cy;
    to->kind[0] = (float)v->near_plane;
    to->kind[1] = (float)v->orthographic;
    to->kind[2] = (float)v->by_distance;
    to->kind[3] = (float)(1 / (v->fx * v->distance));
    to->size[0] = v->width;
    to->size[1] = v->height;
    to->size[2] = (v->width + 15) / 16;
    to->size[3] = gpu_tiles(v);
    to->of[0] = v->light;
    to->more[0] = v->compensate;
}

/* Are the lights' maps asked for? */
static int gpu_maps(const ssdgs_frame *frame) {
    return frame->maps || (frame->layer_count && (frame->terms & SSDGS_SHADOW_TERM));
}

/* Views, and the places of the lights' maps. A map that stays keeps its place. 0: there is no room. */
static int gpu_set_views(gpu *g, const ssdgs_frame *frame) {
    gpu_tables *t = g->tables;
    for (int i = 0; i < frame->view_count; i++) gpu_set_view(t->views + i, frame->views + i);
    for (int i = 0, view = 1; i < frame->light_count && !g->result; i++) {
        size_t tiles = 0, at = 0;
        t->lamps[i].of[0] = view;
        for (; view < frame->view_count && frame->views[view].light == i; view++)
            tiles += (size_t)gpu_tiles(frame->views + view);
        t->lamps[i].of[1] = view - t->lamps[i].of[0];
        if (tiles && gpu_maps(frame)) {
            const gpu_piece *piece = gpu_place(g, &g->frame.maps, g->frame.light + i, tiles);
            if (!piece) return 0;
            at = piece->at;
        }
        for (int j = t->lamps[i].of[0]; j < view; j++) {
            t->views[j].of[1] = (int32_t)at;
            t->views[j].of[3] = t->lamps[i].of[1] > 1;
            at += (size_t)gpu_tiles(frame->views + j);
        }
    }
    return 1;
}

static void gpu_set_lights(gpu *g, const ssdgs_frame *frame) {
    double kept = 0;
    for (int i = 0; i < frame->light_count; i++) kept += (double)frame->lights[i].kept;
    for (int i = 0; i < frame->light_count; i++) {
        gpu_lamp *lamp = g->tables->lamps + i;
        memset(lamp, 0, sizeof *lamp);
        gpu_set_lamp(lamp, frame->lights + i);
        lamp->share[0] = (float)((double)frame->lights[i].kept / (kept > 1 ? kept : 1));
    }
    if (gpu_set_views(g, frame) || g->result) return;
    g->frame.maps.count = 0; /* there are gaps between maps that stay: make all anew */
    g->owner = NULL;
    if (!gpu_set_views(g, frame)) gpu_fail(g, SSDGS_ERR_LIMIT, "the lights' maps do not fit");
}

/* Copies a depth texture into a buffer. */
static void gpu_copy_texture(gpu *g, const gpu_texture *texture, const gpu_buffer *to, size_t from) {
    const gpu_gl *gl = &g->gl;
    const int flat = texture->target == GPU_GL_TEXTURE_2D;
    const uint32_t target = flat ? GPU_GL_TEXTURE_2D : GPU_GL_TEXTURE_CUBE_MAP;
    int32_t bound = 0, pack = 0, store[5];
    if (g->result) return;
    gl->GetIntegerv(flat ? GPU_GL_TEXTURE_BINDING_2D : GPU_GL_TEXTURE_BINDING_CUBE_MAP, &bound);
    gl->GetIntegerv(GPU_GL_PIXEL_PACK_BUFFER_BINDING, &pack);
    for (uint32_t i = 0; i < 5; i++) {
        gl->GetIntegerv(GPU_GL_PACK_SWAP_BYTES + i, store + i);
        gl->PixelStorei(GPU_GL_PACK_SWAP_BYTES + i, 0);
    }
    gl->BindTexture(target, texture->name);
    gl->BindBuffer(GPU_GL_PIXEL_PACK_BUFFER, to->name);
    gl->GetTexImage(texture->target, 0, GPU_GL_DEPTH_COMPONENT, GPU_GL_FLOAT, (void *)(intptr_t)from);
    gl->BindBuffer(GPU_GL_PIXEL_PACK_BUFFER, (uint32_t)pack);
    gl->BindTexture(target, (uint32_t)bound);
    for (uint32_t i = 0; i < 5; i++) gl->PixelStorei(GPU_GL_PACK_SWAP_BYTES + i, store[i]);
    gl->MemoryBarrier(GPU_GL_PIXEL_BUFFER_BARRIER_BIT);
    gpu_check(g, "a depth texture");
}

/* An engine's shadow map, row-major, and its rows' direction. */
static void gpu_set_shadow_map(gpu *g, int index, const ssdgs_shadow_map *m, size_t at) {
    gpu_shadow_map *to = g->tables->maps + index;
    memset(to, 0, sizeof *to);
    for (int i = 0; i < 16; i++)
        to->clip[i] = (float)m->matrix[m->flags & SSDGS_COLUMN_MAJOR ? i % 4 * 4 + i / 4 : i];
    to->kind[0] = (float)m->bias;
    to->kind[1] = (float)m->range;
    to->kind[2] = (float)((m->flags & SSDGS_CLIP_Z_FROM_0) != 0);
    to->kind[3] = m->flags & SSDGS_CLIP_Y_DOWN || g->shadow_texture[index].name ? 1 : -1;
    to->size[0] = m->width;
    to->size[1] = m->height;
    to->size[2] = (int32_t)at;
    to->size[3] = m->light;
}

static uint64_t gpu_fold(uint64_t key, const void *data, size_t size) {
    for (size_t i = 0; i < size; i++)
        key = (key ^ ((const unsigned char *)data)[i]) * UINT64_C(0x100000001B3);
    return key;
}

/* Writes rows of so many bytes, which on the host are `pitch` apart. */
static void gpu_write_rows(gpu *g, const gpu_buffer *b, size_t from, const void *rows, ptrdiff_t pitch,
                           size_t row, int count) {
    const size_t size = row * (size_t)count;
    if (pitch == (ptrdiff_t)row) {
        gpu_write(g, b, from, rows, size);
        return;
    }
    char *const packed = (char *)gpu_host(g, size);
    for (int y = 0; y < count && packed; y++)
        memcpy(packed + row * (size_t)y, (const char *)rows + pitch * y, row);
    gpu_write(g, b, from, packed, size);
}

/* In front the engine's shadow maps, which stay until one changes; behind them the scene's depth. */
static void gpu_upload_outside(gpu *g, const ssdgs_frame *frame) {
    gpu_buffer *to = &g->frame.outside;
    const size_t width = (size_t)frame->camera.width, pixels = width * (size_t)frame->camera.height,
                 value = sizeof(float);
    const int map_count = frame->occluder ? frame->occluder->map_count : 0;
    const ssdgs_shadow_map *maps = map_count ? frame->occluder->maps : NULL;
    size_t all = 0;
    uint64_t key = UINT64_C(0xCBF29CE484222325);
    for (int i = 0; i < map_count; i++) {
        gpu_set_shadow_map(g, i, maps + i, all);
        all += (size_t)maps[i].width * (size_t)maps[i].height;
        key = gpu_fold(key, maps + i, sizeof *maps);
        key = gpu_fold(key, g->shadow_texture + i, sizeof *g->shadow_texture);
    }
    const int hides = frame->scene_depth || g->scene_texture.name;
    const size_t size = (all + (hides ? pixels : 4)) * value;
    const void *const owner = g->owner;
    if (to->size < size) g->outside = 0;
    gpu_reserve(g, to, size);
    g->owner = owner; /* nothing that is kept */
    for (int i = 0; i < map_count && !g->result; i++) {
        const ssdgs_shadow_map *m = maps + i;
        const size_t at = (size_t)g->tables->maps[i].size[2] * value;
        if (g->shadow_texture[i].name) gpu_copy_texture(g, g->shadow_texture + i, to, at);
        else if (key != g->outside && m->depth)
            gpu_write_rows(g, to, at, m->depth, m->pitch, (size_t)m->width * value, m->height);
    }
    g->outside = g->result ? 0 : key;
    g->p.map_count = (uint32_t)map_count;
    g->p.hides = hides != 0;
    g->p.scene_at = (uint32_t)all;
    g->p.scene_raw = g->scene_texture.name != 0;
    if (g->scene_texture.name) gpu_copy_texture(g, &g->scene_texture, to, all * value);
    else if (frame->scene_depth)
        gpu_write_rows(g, to, all * value, frame->scene_depth, (ptrdiff_t)value * frame->stride,
                       width * value, frame->camera.height);
}

/* 1 / depth of a value of OpenGL's depth buffer, by the pixel's column, its row from the top, and the value:
   as in ssdgs_depth_from_buffer(). */
static void gpu_find_unseen(const float m[16], int width, int height, float unseen[4]) {
    const double by_x = (double)m[2] / (double)m[0], by_y = (double)m[6] / (double)m[5], w = (double)m[11],
                 scale = (double)m[14] / fabs(w),
                 rest = by_x * (1.0 / width - 1 - (double)m[8] / w) +
                        by_y * (1 - 1.0 / height - (double)m[9] / w) + (double)m[10] / w;
    unseen[0] = (float)(-by_x * 2 / width / scale);
    unseen[1] = (float)(by_y * 2 / height / scale);
    unseen[2] = (float)(2 / scale);
    unseen[3] = (float)((-1 - rest) / scale);
}

static float gpu_log2_threshold(const ssdgs_frame *frame) {
    const double threshold = (double)frame->options.alpha_threshold;
    return (float)(log(threshold > 1e-9 ? threshold : 1e-9) * 1.44269504088896341);
}

/* What is the same for all dispatches of a frame. */
static void gpu_set_parameters(gpu *g, const ssdgs_frame *frame) {
    gpu_parameters *p = &g->p;
    const ssdgs_camera *c = &frame->camera;
    memset(p, 0, sizeof *p);
    for (int i = 0; i < 3; i++) {
        p->eye[i] = (float)frame->eye[i];
        for (int j = 0; j < 9; j++) p->ambient[j][i] = (float)frame->options.ambient[j][i];
    }
    p->count = (uint32_t)frame->count;
    p->lights = (uint32_t)frame->light_count;
    p->layers = (uint32_t)frame->layer_count;
    p->object_count = (uint32_t)frame->object_count;
    p->blocks = (p->count + 63) / 64;
    p->total = GPU_VIEWS;
    p->width = (uint32_t)c->width;
    p->height = (uint32_t)c->height;
    p->cue = frame->depth_cue != NULL;
    p->flux = frame->flux != NULL;
    p->maps = gpu_maps(frame) != 0;
    p->thrifty = frame->options.max_error > 0;
    p->median = g->guest || frame->median_depth;
    p->parts = frame->pixel_shadow != NULL;
    p->sharing = frame->layer_count > 0 && frame->material_count > 1;
    p->log2_threshold = gpu_log2_threshold(frame);
    p->stop = (float)frame->options.stop;
    p->max_error = (float)frame->options.max_error;
    p->bias = (float)frame->bias[0];
    p->pixel_bias = (float)frame->bias[1];
    p->far_radii = (float)(2 * frame->options.transport_detail);
    if (g->scene_texture.name) gpu_find_unseen(g->scene_projection, c->width, c->height, p->unseen);
}

static void gpu_upload_tables(gpu *g) {
    gpu_write_anew(g, &g->frame.tables, g->tables,
                   offsetof(gpu_tables, objects) + g->p.object_count * sizeof(gpu_object));
}

/* Host memory for the tables. */
static void gpu_reserve_tables(gpu *g, size_t objects) {
    const size_t size = sizeof(gpu_tables) + objects * sizeof(gpu_object);
    if (g->tables_size >= size) return;
    gpu_tables *more = (gpu_tables *)realloc(g->tables, size);
    if (!more) {
        gpu_fail(g, SSDGS_ERR_MEMORY, "out of memory");
        return;
    }
    memset((char *)more + g->tables_size, 0, size - g->tables_size);
    g->tables = more;
    g->tables_size = size;
}

/* ==== SHADE ==== */

/* Transport depends on these besides the flux. Where they change, or the memory grows, all is made anew. */
static void gpu_reserve_transport(gpu *g, const ssdgs_frame *frame) {
    gpu_frame *f = &g->frame;
    const size_t lights = g->p.lights, size = lights * GPU_LENGTHS * g->p.count * sizeof(float),
                 nodes = lights * (g->p.blocks + g->p.above) * 8 * sizeof(float),
                 arrived = (lights * g->p.blocks + 4) * sizeof(uint32_t);
    const double detail = (double)frame->options.transport_detail;
    uint64_t key = gpu_fold(UINT64_C(0xCBF29CE484222325), &detail, sizeof detail);
    key = gpu_fold(key, &g->p.lights, sizeof g->p.lights);
    for (int i = 0; i < frame->object_count; i++) {
        key = gpu_fold(key, g->tables->objects[i].travel, sizeof g->tables->objects[i].travel);
        key = gpu_fold(key, g->tables->objects[i].of, sizeof g->tables->objects[i].of);
    }
    if (f->transport.size < size || f->nodes.size < nodes || f->arrived.size < arrived) g->transported = ~key;
    for (int i = 0; i < GPU_LAMPS && key != g->transported; i++) f->light[i].ready = 0;
    g->transported = key;
    for (int i = 0; i < frame->light_count; i++) {
        if (!f->light[i].ready) f->light[i].revision = ++g->revisions;
        g->tables->lamps[i].of[2] = (int32_t)f->light[i].revision;
        g->tables->lamps[i].of[3] = f->light[i].ready;
    }
    gpu_reserve(g, &f->transport, size);
    gpu_reserve(g, &f->nodes, nodes);
    if (f->arrived.size < arrived) { /* no revision is 0 */
        gpu_reserve(g, &f->arrived, arrived);
        gpu_upload(g, &f->arrived, gpu_host(g, f->arrived.size), f->arrived.size);
    }
}

/* True dipole transport from where light enters to what is to be shaded and does not have it yet. */
static void gpu_transport(gpu *g, const ssdgs_frame *frame) {
    gpu_frame *f = &g->frame;
    const gpu_buffer *const nodes[] = {&f->models.buffer, &f->flux, &f->nodes, NULL};
    const gpu_buffer *const sums[] = {&f->models.buffer, &f->flux,    &f->nodes, &f->seen,
                                      &f->transport,     &f->arrived, NULL};
    gpu_run(g, GPU_TRANSPORT_NODES, &g->p, nodes, (size_t)g->p.lights * g->p.above);
    gpu_run(g, GPU_TRANSPORT_SUMS, &g->p, sums, (size_t)g->p.lights * g->p.blocks);
    for (int i = 0; i < frame->light_count; i++)
        f->light[i].ready = !g->result; /* dark ones are walked again */
}

/* The Gaussians seen: a list of them, and their colours and layers. */
static void gpu_shade(gpu *g, const ssdgs_frame *frame) {
    const size_t n = g->p.count, groups = gpu_groups(n);
    gpu_frame *f = &g->frame;
    gpu_parameters p = g->p;
    const int travels = frame->flux && (frame->terms & SSDGS_SCATTERING_TERM);
    const gpu_buffer *const seen[] = {&f->seen,       &f->tally,  &f->of_object, &f->shaded,
                                      &f->neighbours, &f->layers, &f->ahead,     NULL};
    const gpu_buffer *const shaded[] = {
        &f->models.buffer, &f->models.buffer, &f->shaded, &f->visibility, &f->depth_cue, &f->transport,
        &f->camera.depth,  &f->models.buffer, &f->layers, &f->masks,      NULL};
    gpu_reserve(g, &f->of_object, 2 * (size_t)p.object_count * sizeof(uint32_t));
    gpu_reserve(g, &f->shaded, ((size_t)p.blocks * 64 + 1) * sizeof(uint32_t));
    gpu_reserve(g, &f->neighbours, n * sizeof(uint32_t));
    gpu_reserve(g, &f->layers, 4 * n * (size_t)(p.layers + 1) * sizeof(float));
    gpu_reserve(g, &f->ahead, (size_t)p.blocks * sizeof(uint32_t));
    gpu_reserve(g, &f->transport, 16);
    if (travels) gpu_reserve_transport(g, frame);
    gpu_upload_tables(g);
    gpu_run(g, GPU_SEEN_OBJECTS, &p, seen, p.object_count);
    gpu_run(g, GPU_SEEN_LIST, &p, seen, groups);
    if (travels) gpu_transport(g, frame);
    p.segments = (uint32_t)g->columns;
    gpu_run(g, GPU_SHADE, &p, shaded, p.blocks * (size_t)(64 / g->columns));
    if (p.thrifty) gpu_run(g, GPU_SEEN_COPY, &p, seen, groups);
}

/* ==== stages up to WALK ==== */

/* The views at work, their tiles and lights. They must be whole lights, or the camera first. */
static void gpu_set_work(gpu *g, const ssdgs_frame *frame, const uint32_t *views, int count) {
    gpu_tables *t = g->tables;
    gpu_parameters *p = &g->p;
    p->slots = (uint32_t)count;
    p->looks = views[0] == 0;
    p->tiles = p->camera_tiles = p->works = 0;
    for (int slot = 0; slot < count; slot++) {
        const int view = (int)views[slot], light = frame->views[view].light;
        t->view_at_work[slot] = (uint32_t)view;
        t->views[view].of[2] = (int32_t)p->tiles;
        p->tiles += (uint32_t)gpu_tiles(frame->views + view);
        if (light < 0) {
            p->camera_tiles = p->tiles;
            continue;
        }
        int32_t *last = p->works ? t->light_at_work[p->works - 1] : NULL;
        if (last && last[0] == light) {
            last[2] = slot + 1;
            continue;
        }
        const int32_t work[4] = {light, slot, slot + 1, 0};
        memcpy(t->light_at_work[p->works++], work, sizeof work);
        g->frame.light[light].ready = 0;
    }
    gpu_upload_tables(g);
}

static void gpu_project(gpu *g, gpu_set *set) {
    const size_t all = (size_t)g->p.slots * g->p.count;
    const gpu_buffer *const buffers[] = {&g->frame.models.buffer, &set->record, &set->depth, NULL};
    gpu_reserve(g, &set->record, all * sizeof(ssdgs_record));
    gpu_reserve(g, &set->depth, all * sizeof(float));
    gpu_run(g, GPU_PROJECT, &g->p, buffers, g->p.slots * gpu_groups(g->p.count));
}

enum { GPU_SORT_BLOCKS = 256, GPU_FIRST_ROOM = 1 << 16 };

/* Sorts so many keys of each segment by so many of their low bits, into key[*end], value[*end]. 0 segments:
   the instances, of which there are that many keys at most. */
static void gpu_radix_sort(gpu *g, const gpu_buffer *from_keys, size_t keys, size_t segments, int bits,
                           int *end) {
    gpu_scratch *s = &g->scratch;
    gpu_parameters p = g->p;
    p.keys = (uint32_t)keys;
    p.segments = (uint32_t)segments;
    p.rows = (uint32_t)(2 + gpu_groups(keys) / GPU_SORT_BLOCKS); /* blocks read what all have counted */
    const size_t blocks =
        (segments ? segments : 1) * ((keys + GPU_GROUP * p.rows - 1) / (GPU_GROUP * p.rows));
    gpu_reserve(g, &s->digits, blocks * 256 * sizeof(uint32_t));
    *end = 0;
    for (p.shift = 0; p.shift < (uint32_t)bits; p.shift += 8) {
        const int from = *end, to = *end = !from;
        const gpu_buffer *const buffers[] = {p.shift ? s->key + from : from_keys,
                                             &s->digits,
                                             s->value + from,
                                             s->key + to,
                                             s->value + to,
                                             NULL};
        gpu_run(g, GPU_SORT_COUNT, &p, buffers, blocks);
        gpu_run(g, GPU_SORT_SCATTER, &p, buffers, blocks);
    }
}

static void gpu_reserve_keys(gpu *g, size_t count) {
    for (int i = 0; i < 2; i++) {
        gpu_reserve(g, g->scratch.key + i, count * sizeof(uint32_t));
        gpu_reserve(g, g->scratch.value + i, count * sizeof(uint32_t));
    }
}

static void gpu_sort(gpu *g, gpu_set *set) {
    int end;
    gpu_reserve_keys(g, (size_t)g->p.slots * g->p.count);
    gpu_radix_sort(g, &set->depth, g->p.count, g->p.slots, 32, &end);
    const gpu_buffer order = g->scratch.value[end]; /* its memory for what order has had */
    g->scratch.value[end] = set->order;
    set->order = order;
}

static void gpu_bin(gpu *g, gpu_set *set) {
    const size_t all = (size_t)g->p.slots * g->p.count, room = g->instance_room,
                 groups = g->p.slots * gpu_groups(g->p.count);
    gpu_scratch *s = &g->scratch;
    int bits = 1, end; /* one pass at least: it numbers the instances */
    gpu_reserve_keys(g, room);
    const gpu_buffer *const counted[] = {&set->record, &set->order, &set->of_gaussian,
                                         &s->groups,   &set->depth, NULL};
    const gpu_buffer *const emitted[] = {
        &set->record, &set->order, &set->of_gaussian, &s->groups, &set->instance, &s->owner, s->key, NULL};
    g->p.room = (uint32_t)room;
    gpu_reserve(g, &s->groups, groups * sizeof(uint32_t));
    gpu_reserve(g, &s->owner, room * sizeof(uint32_t));
    gpu_reserve(g, &set->of_gaussian, all * sizeof(ssdgs_instances));
    gpu_reserve(g, &set->instance, room * sizeof(ssdgs_instance));
    gpu_reserve(g, &set->tile_list, room * sizeof(ssdgs_tile_entry));
    gpu_reserve(g, &set->tile_start, ((size_t)g->p.tiles + 1) * sizeof(uint32_t));
    gpu_run(g, GPU_BIN_COUNT, &g->p, counted, groups);
    gpu_run(g, GPU_BIN_SCAN, &g->p, counted, 1);
    gpu_run(g, GPU_BIN_EMIT, &g->p, emitted, groups);
    while (g->p.tiles > (uint32_t)1 << bits) bits++;
    gpu_radix_sort(g, s->key, room, 0, bits, &end);
    const gpu_buffer *const sorted[] = {s->key + end,    s->value + end,   &s->owner, &set->instance,
                                        &set->tile_list, &set->tile_start, NULL};
    gpu_run(g, GPU_BIN_END, &g->p, sorted, gpu_groups(room + 1));
}

static void gpu_walk_camera(gpu *g, gpu_set *set) {
    const size_t n = g->p.count;
    gpu_frame *f = &g->frame;
    const gpu_buffer *const walked[] = {&set->record, &set->tile_list, &set->tile_start,
                                        &set->depth,  &set->tile_seen, &set->tile_needed,
                                        NULL};
    const gpu_buffer *const gathered[] = {
        &set->of_gaussian, &set->instance, &set->tile_seen, &set->tile_needed, &f->seen, &f->tally, NULL};
    gpu_reserve(g, &set->tile_seen, g->instance_room * sizeof(uint32_t));
    gpu_reserve(g, &set->tile_needed, g->instance_room * sizeof(uint32_t));
    gpu_reserve(g, &f->seen, n * sizeof(uint32_t));
    gpu_reserve(g, &f->tally, 2 * (size_t)g->p.blocks * sizeof(uint32_t));
    gpu_run(g, GPU_WALK_CAMERA, &g->p, walked, g->p.camera_tiles);
    gpu_run(g, GPU_GATHER_CAMERA, &g->p, gathered, gpu_groups(n));
}

static void gpu_walk_lights(gpu *g, gpu_set *set) {
    gpu_frame *f = &g->frame;
    const size_t tiles = g->p.tiles - g->p.camera_tiles;
    const gpu_buffer *const walked[] = {&set->record,      &set->tile_list, &set->tile_start, &set->depth,
                                        &set->of_gaussian, &set->tile_sums, &f->maps.buffer,  NULL};
    const gpu_buffer *const gathered[] = {
        &f->models.buffer, &set->of_gaussian, &set->instance, &set->tile_sums,
        &f->visibility,    &f->depth_cue,     &f->flux,       NULL};
    gpu_reserve(g, &set->tile_sums, g->instance_room * 4 * sizeof(float));
    gpu_run(g, GPU_WALK_LIGHT, &g->p, walked, tiles);
    if (g->p.maps || g->p.flux) gpu_run(g, GPU_WALK_MAP, &g->p, walked, tiles);
    gpu_run(g, GPU_GATHER_LIGHT, &g->p, gathered, g->p.works * gpu_groups(g->p.count));
}

/* Some stages of some views. The camera's lists stay in their set while lights go on in the other. */
static void gpu_run_views(gpu *g, const ssdgs_frame *frame, const uint32_t *views, int count, int first,
                          int last) {
    gpu_set *set = views[0] ? &g->frame.others : &g->frame.camera;
    gpu_set_work(g, frame, views, count);
    for (int stage = first; stage <= last && !g->result; stage++) {
        if (stage == SSDGS_STAGE_PROJECT) gpu_project(g, set);
        if (stage == SSDGS_STAGE_SORT) gpu_sort(g, set);
        if (stage == SSDGS_STAGE_BIN) gpu_bin(g, set);
        if (stage != SSDGS_STAGE_WALK) continue;
        if (g->p.looks) gpu_walk_camera(g, set);
        if (g->p.works) gpu_walk_lights(g, set);
    }
    if (last == SSDGS_STAGE_WALK && g->p.total + 1 < GPU_VIEWS + GPU_TOTALS) g->p.total++;
}

/* As many views at once as a buffer of records has room for. */
static size_t gpu_most_slots(const gpu *g, const ssdgs_frame *frame) {
    const size_t limit = (size_t)1 << 28, bytes = (size_t)g->most < limit ? (size_t)g->most : limit,
                 slots = bytes / (sizeof(ssdgs_record) * (size_t)(frame->count > 0 ? frame->count : 1));
    return slots < GPU_VIEWS ? slots : (size_t)GPU_VIEWS;
}

/* The views from, up to before `to` that are not there. */
static void gpu_run_batches(gpu *g, const ssdgs_frame *frame, int from, int to, int first, int last) {
    uint32_t views[GPU_VIEWS];
    const size_t most = gpu_most_slots(g, frame);
    size_t count = 0;
    if (!from && frame->views->cached == 1) {
        const uint32_t camera = 0;
        if (last == SSDGS_STAGE_WALK) gpu_run_views(g, frame, &camera, 1, SSDGS_STAGE_WALK, last);
        from = 1;
    }
    for (int view = from, next; view < to && !g->result; view = next) {
        next = view + 1;
        while (view && next < to && frame->views[next].light == frame->views[view].light) next++;
        if (frame->views[view].cached) continue;
        if (count && count + (size_t)(next - view) > most) {
            gpu_run_views(g, frame, views, (int)count, first, last);
            count = 0;
        }
        for (int i = view; i < next; i++) views[count++] = (uint32_t)i;
    }
    if (count && !g->result) gpu_run_views(g, frame, views, (int)count, first, last);
}

/* ==== COMPOSITE ==== */

/* Planes of the picture: composite.glsl says which. */
static size_t gpu_planes(const ssdgs_frame *frame) {
    return 5 +
           (frame->pixel_shadow ? 3 * (size_t)(frame->layer_count + 1) + 2 * (size_t)frame->light_count : 0);
}

static void gpu_composite(gpu *g, const ssdgs_frame *frame) {
    gpu_frame *f = &g->frame;
    gpu_set *set = &f->camera;
    const gpu_buffer *const buffers[] = {&set->record,    &set->tile_list, &set->tile_start,
                                         &set->depth,     &set->tile_seen, &f->layers,
                                         &f->maps.buffer, &f->planes,      NULL};
    const uint32_t camera = 0;
    if (!g->p.looks) gpu_set_work(g, frame, &camera, 1);
    gpu_reserve(g, &f->planes, gpu_planes(frame) * g->p.width * g->p.height * sizeof(float));
    gpu_run(g, frame->layer_count ? GPU_COMPOSITE_LAYERS : GPU_COMPOSITE, &g->p, buffers, g->p.camera_tiles);
}

/* ==== whole frames ==== */

/* What all stages find on the device. */
static void gpu_set_frame(gpu *g, const ssdgs_frame *frame) {
    const size_t n = (size_t)frame->count, all = n * (size_t)frame->light_count * sizeof(float);
    gpu_frame *f = &g->frame;
    gpu_reserve_tables(g, (size_t)frame->object_count);
    if (g->result) return;
    gpu_set_parameters(g, frame);
    gpu_reserve(g, &f->facts, (GPU_VIEWS + GPU_TOTALS) * sizeof(gpu_fact));
    gpu_reserve(g, &f->slopes, n * 2 * sizeof(float));
    gpu_reserve(g, &f->visibility, all);
    gpu_reserve(g, &f->depth_cue, frame->depth_cue ? all : 16);
    gpu_reserve(g, &f->flux, frame->flux ? all : 16);
    gpu_extend(g, &f->maps.buffer, 16);
    gpu_upload_models(g, frame);
    gpu_upload_objects(g, frame);
    gpu_upload_outside(g, frame);
    gpu_set_lights(g, frame);
}

/* A view stays `cached` if the device still has its results; a record of NULL says that host memory has not.
 */
static void gpu_begin_frame(gpu *g, const ssdgs_frame *frame) {
    gpu_set_frame(g, frame);
    for (int i = 0; i < frame->view_count; i++) {
        ssdgs_splat_view *v = frame->views + i;
        if (v->record || g->owner != frame->memory) v->cached = 0;
        if (!i && (g->p.hides | g->p.median) != g->deep) v->cached = 0; /* slopes are there, or not */
        if (!i && v->cached == 2 && g->p.hides) v->cached = 1; /* what hides may be another texture's */
        v->record = NULL;
        if (!v->cached) v->light_map = NULL;
    }
    g->deep = g->p.hides | g->p.median;
}

/* The stages, of the views from, up to before `to`; without waiting all of them at once. */
static void gpu_run_stages(gpu *g, ssdgs_frame *frame, int from, int to, int first, int last) {
    const int walks = last < SSDGS_STAGE_WALK ? last : SSDGS_STAGE_WALK;
    if (first <= SSDGS_STAGE_WALK) gpu_run_batches(g, frame, from, to, first, walks);
    if (first <= SSDGS_STAGE_SHADE && last >= SSDGS_STAGE_SHADE) gpu_shade(g, frame);
    if (last >= SSDGS_STAGE_COMPOSITE) gpu_composite(g, frame);
}

/* Reads what the device has counted: 1 where every list had room, else there is more from now on. This,
   gpu_end_frame() and uploads in mid-frame wait for the device. A view that was kept has its
   counts. */
static int gpu_had_room(gpu *g, ssdgs_frame *frame) {
    gpu_fact facts[GPU_VIEWS + GPU_TOTALS];
    size_t most = 0;
    gpu_download(g, &g->frame.facts, facts, sizeof facts);
    for (uint32_t i = GPU_VIEWS; i < g->p.total && !g->result; i++)
        if (most < facts[i].instances) most = facts[i].instances;
    for (int i = 0; i < frame->view_count && !g->result; i++) {
        ssdgs_splat_view *v = frame->views + i;
        if (v->cached) continue;
        v->visible = (int)facts[i].visible;
        v->instances = facts[i].instances;
        v->nearest = (ssdgs_real)facts[i].nearest;
    }
    const size_t fits = (size_t)g->most / 16; /* of 16 bytes, at most */
    if (most > fits) gpu_fail(g, SSDGS_ERR_LIMIT, "too many splats for the image or the lights' maps");
    if (g->result || most <= g->instance_room) return 1;
    g->instance_room = most + most / 4 > fits ? fits : most + most / 4;
    return 0;
}

/* What an engine is told of the lights' maps. */
static void gpu_note_maps(gpu *g, const ssdgs_frame *frame) {
    memset(g->maps, 0, sizeof g->maps);
    for (int i = 1; i < frame->view_count && gpu_maps(frame); i++) {
        const ssdgs_splat_view *v = frame->views + i;
        gpu_light_map *to = g->maps + v->light;
        if (!gpu_casts(frame->lights + v->light) || to->map.faces == 6) continue;
        to->buffer = g->frame.maps.buffer.name;
        to->first[to->map.faces] = g->tables->views[i].of[1];
        to->nearest[to->map.faces] = (float)v->nearest;
        memcpy(to->map.view[to->map.faces++], v->view, sizeof v->view);
        to->map.size = v->width;
        to->map.parallel = v->orthographic;
        to->map.focal = v->fx;
        to->map.bias = frame->bias[1];
    }
}

/* A view's map on the host. NULL: there is no memory. */
static gpu_host_map *gpu_find_host_map(gpu *g, const ssdgs_frame *frame, int view) {
    for (int i = 0; i < g->host_map_count; i++)
        if (g->host_maps[i].memory == frame->memory && g->host_maps[i].view == view) return g->host_maps + i;
    gpu_host_map *more =
        (gpu_host_map *)realloc(g->host_maps, (size_t)(g->host_map_count + 1) * sizeof *more);
    if (!more) return NULL;
    g->host_maps = more;
    more += g->host_map_count++;
    memset(more, 0, sizeof *more);
    more->memory = frame->memory;
    more->view = view;
    return more;
}

/* Maps that are asked for, to where the library looks for them. Those of views that stay are there. */
static void gpu_download_maps(gpu *g, ssdgs_frame *frame) {
    for (int i = 1; i < frame->view_count && !g->result; i++) {
        ssdgs_splat_view *v = frame->views + i;
        const size_t tiles = (size_t)gpu_tiles(v), size = 256 * sizeof(ssdgs_light_pixel);
        if (v->light_map || !gpu_casts(frame->lights + v->light)) continue;
        gpu_host_map *map = gpu_find_host_map(g, frame, i);
        ssdgs_light_pixel *pixels = map ? (ssdgs_light_pixel *)realloc(map->pixels, tiles * size) : NULL;
        uint32_t *numbers = pixels ? (uint32_t *)realloc(map->tiles, tiles * sizeof *numbers) : NULL;
        if (pixels) map->pixels = pixels;
        if (numbers) map->tiles = numbers;
        if (!numbers) {
            gpu_fail(g, SSDGS_ERR_MEMORY, "out of memory for a light's map");
            return;
        }
        gpu_download_at(g, &g->frame.maps.buffer, (size_t)g->tables->views[i].of[1] * size, pixels,
                        tiles * size);
        for (size_t t = 0; t < tiles; t++)
            numbers[t] = pixels[256 * t].distance[0] < 0 ? UINT32_MAX : (uint32_t)t;
        v->tiles_x = (v->width + 15) / 16;
        v->tiles_y = (v->height + 15) / 16;
        v->map_tile = numbers;
        v->light_map = pixels;
    }
}

/* What ssdgs_render_stats counts. */
static void gpu_end_statistics(gpu *g, ssdgs_frame *frame) {
    const size_t n = (size_t)frame->count, room = (size_t)g->p.blocks * 64 + 1;
    uint32_t *list = (uint32_t *)gpu_host(g, room * sizeof *list);
    gpu_download(g, &g->frame.layers, frame->color, n * 4 * sizeof(float));
    if (list) gpu_download(g, &g->frame.shaded, list, room * sizeof *list);
    if (g->result) return;
    frame->shaded_count = 0;
    for (uint32_t i = 1; i <= list[0]; i++)
        if (list[i] != UINT32_MAX) frame->shaded[frame->shaded_count++] = list[i];
    gpu_download(g, &g->frame.seen, list, n * sizeof *list);
    for (size_t i = 0; i < n; i++) frame->seen[i] = (unsigned char)list[i];
    frame->light_instances = 0;
    for (int i = 1; i < frame->view_count; i++)
        frame->light_instances += frame->views[i].cached ? 0 : frame->views[i].instances;
}

/* What is asked for of the picture. */
static void gpu_end_frame(gpu *g, ssdgs_frame *frame) {
    if (frame->maps && !g->guest) gpu_download_maps(g, frame);
    if (frame->last == SSDGS_STAGE_WALK) return;
    const gpu_buffer *planes = &g->frame.planes;
    const ssdgs_image *image = frame->image;
    const size_t plane = (size_t)frame->camera.width * (size_t)frame->camera.height * sizeof(float),
                 lights = (size_t)frame->light_count, layers = 3 * (size_t)(frame->layer_count + 1);
    const int picture = !image || image->color || frame->pixel_shadow;
    if (picture) gpu_download(g, planes, frame->pixels, 3 * plane);
    if (picture || image->alpha) gpu_download_at(g, planes, 3 * plane, frame->transmittance, plane);
    if (frame->median_depth) gpu_download_at(g, planes, 4 * plane, frame->median_depth, plane);
    if (frame->pixel_shadow) {
        gpu_download_at(g, planes, 5 * plane, frame->layer_pixels, layers * plane);
        gpu_download_at(g, planes, (5 + layers) * plane, frame->pixel_visibility, lights * plane);
        gpu_download_at(g, planes, (5 + layers + lights) * plane, frame->pixel_shadow, lights * plane);
    }
    if (frame->statistics) gpu_end_statistics(g, frame);
}

/* ==== hook ==== */

/* Do a frame's buffers, but for lists of instances, fit what programs can see? */
static int gpu_holds(const gpu *g, const ssdgs_frame *frame) {
    const double n = frame->count, lights = frame->light_count;
    double tiles = 0, models = 0, outside = (double)frame->camera.width * frame->camera.height;
    for (int i = 1; i < frame->view_count; i++) tiles += gpu_tiles(frame->views + i);
    for (int i = 0; i < frame->object_count; i++) models += (double)gpu_layout(frame->objects + i).size;
    for (int i = 0; frame->occluder && i < frame->occluder->map_count; i++)
        outside += (double)frame->occluder->maps[i].width * frame->occluder->maps[i].height;
    const double sizes[5] = {outside, models, 4 * n * (frame->layer_count + 1),
                             n * lights * (frame->flux ? GPU_LENGTHS : 1),
                             (double)gpu_planes(frame) * frame->camera.width * frame->camera.height};
    int holds = tiles * 256 * sizeof(ssdgs_light_pixel) <= g->most && gpu_most_slots(g, frame) >= 6;
    for (int i = 0; i < 5; i++) holds = holds && sizes[i] * sizeof(float) <= g->most;
    return holds;
}

/* Does the backend do this frame? Others are the CPU's: training; an occluder's callback; parts where light
   is not deferred; what is too large. */
static int gpu_takes(const gpu *g, const ssdgs_frame *frame) {
    const ssdgs_occluder *o = frame->occluder;
    if (g->lost || sizeof(ssdgs_real) != sizeof(float) || frame->training) return 0;
    const int lights = frame->last == SSDGS_STAGE_WALK && frame->maps && o; /* ssdgs_scene_light() */
    if (frame->last != SSDGS_STAGE_COMPOSITE && !lights) return 0;
    if (!frame->count || frame->diffuse) return 0;
    if (frame->visibility_given || (o && (o->shadow || o->map_count > GPU_MAPS))) return 0;
    if (frame->light_count > GPU_LAMPS || frame->view_count > GPU_VIEWS) return 0;
    return gpu_holds(g, frame);
}

/* gpu_leave() for a hook: a failure ends the frame; where it is the device's later ones are the CPU's. */
static ssdgs_result gpu_answer(gpu *g, ssdgs_frame *frame, const char *what) {
    const ssdgs_result result = gpu_leave(g, what);
    if (!result) return SSDGS_OK;
    g->lost = result != SSDGS_ERR_LIMIT; /* the device is well: it was this frame */
    g->owner = NULL;
    g->picture.buffer = 0;
    memset(g->maps, 0, sizeof g->maps);
    for (int i = 0; i < GPU_LAMPS; i++) g->frame.light[i].ready = 0;
    return ssdgs_context_fail(frame->context, result, g->message);
}

static ssdgs_result gpu_stage(void *user, ssdgs_frame *frame, ssdgs_stage stage) {
    gpu *g = (gpu *)user;
    if (!gpu_takes(g, frame)) {
        g->picture.buffer = 0;
        memset(g->maps, 0, sizeof g->maps);
        for (int i = 0; i < frame->view_count; i++) /* what the device has the CPU must find anew */
            if (!frame->views[i].record) frame->views[i].cached = 0;
        return ssdgs_stage_cpu(frame, stage);
    }
    const int ends = stage == frame->last && frame->batch[1] == frame->view_count;
    if (!g->waits && !ends) return SSDGS_OK; /* to enter a context takes time */
    gpu_enter(g);
    if (!g->instance_room) g->instance_room = GPU_FIRST_ROOM;
    if (!g->waits || (stage == SSDGS_STAGE_PROJECT && !frame->batch[0])) gpu_begin_frame(g, frame);
    gpu_run_stages(g, frame, g->waits ? frame->batch[0] : 0, g->waits ? frame->batch[1] : frame->view_count,
                   g->waits ? (int)stage : (int)SSDGS_STAGE_PROJECT, (int)stage);
    if (ends) {
        if (!gpu_had_room(g, frame)) { /* what is counted is right even so: once is enough */
            g->p.total = GPU_VIEWS;
            gpu_run_stages(g, frame, 0, frame->view_count, SSDGS_STAGE_PROJECT, (int)stage);
        }
        const gpu_picture picture = {g->frame.planes.name, frame->camera.width, frame->camera.height};
        g->owner = frame->memory;
        if (stage == SSDGS_STAGE_COMPOSITE) g->picture = picture;
        if (g->guest) gpu_note_maps(g, frame);
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
    gpu_arena *a = &g->frame.models;
    if (g->owner == gone) g->owner = NULL;
    for (int i = 0; i < a->count; i++)
        if (a->pieces[i].owner == gone)
            memmove(a->pieces + i, a->pieces + i + 1, (size_t)(--a->count - i) * sizeof *a->pieces);
    for (int i = g->host_map_count; i--;) {
        if (g->host_maps[i].memory != gone) continue;
        free(g->host_maps[i].pixels);
        free(g->host_maps[i].tiles);
        g->host_maps[i] = g->host_maps[--g->host_map_count];
    }
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

/* All of a context that stays. */
static void gpu_delete_all(gpu *g) {
    gpu_buffer *const own[] = {&g->uniforms, &g->staging};
    gpu_buffer *const more[] = {(gpu_buffer *)&g->frame.camera, (gpu_buffer *)&g->scratch};
    const size_t counts[] = {2 * sizeof(gpu_set) / sizeof(gpu_buffer),
                             sizeof(gpu_scratch) / sizeof(gpu_buffer)};
    gpu_frame *f = &g->frame;
    gpu_buffer *const rest[] = {
        &f->tables,        &f->object_of,   &f->facts,   &f->outside, &f->slopes,    &f->masks,
        &f->models.buffer, &f->maps.buffer, &f->seen,    &f->tally,   &f->of_object, &f->ahead,
        &f->visibility,    &f->depth_cue,   &f->flux,    &f->shaded,  &f->layers,    &f->neighbours,
        &f->nodes,         &f->transport,   &f->arrived, &f->planes};
    for (int i = 0; i < 2; i++) g->gl.DeleteBuffers(1, &own[i]->name);
    for (int i = 0; i < 2; i++)
        for (size_t j = 0; j < counts[i]; j++) g->gl.DeleteBuffers(1, &more[i][j].name);
    for (size_t i = 0; i < sizeof rest / sizeof *rest; i++) g->gl.DeleteBuffers(1, &rest[i]->name);
    for (int i = 0; i < GPU_PROGRAMS; i++) g->gl.DeleteProgram(g->program[i]);
}

void gpu_destroy(gpu *g) {
    if (!g) return;
    if (g->egl.context)
        g->egl.DestroyContext(g->egl.display, g->egl.context); /* with its buffers and programs */
    else if (g->gl.DeleteBuffers) gpu_delete_all(g);
    for (int i = 0; i < g->host_map_count; i++) free(g->host_maps[i].pixels), free(g->host_maps[i].tiles);
    free(g->host_maps);
    free(g->frame.models.pieces);
    free(g->frame.maps.pieces);
    free(g->tables);
    free(g->host);
    free(g);
}
