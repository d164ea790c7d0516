/* ssdgs.h on a GPU: an ssdgs_gpu_hook in OpenGL 4.3 compute shaders. EGL and OpenGL are found when the
   program runs (libEGL.so.1), without a window; building needs neither their headers nor a library but
   dlopen's. Include this file after ssdgs.h with SSDGS_STAGES, or compile it on its own and declare the
   functions of its face. Each compute program is a file of this folder, *.comp. To be included they become
   gpu_shaders.h first:

       awk -f shaders.awk *.comp >gpu_shaders.h

   Then:

       char message[256];
       gpu *g = gpu_create(message, sizeof message);
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
gpu *gpu_create(char *message, size_t size); /* NULL: message says why, as where there is no OpenGL 4.3 */
/* After the contexts that have its hook, and after all that was made on them. NULL is fine. */
void gpu_destroy(gpu *g);
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
    X(SEEN_LIST, seen_list) \
    X(SEEN_COPY, seen_copy) \
    X(TRANSPORT_NODES, transport_nodes) \
    X(TRANSPORT_SUMS, transport_sums) \
    X(SHADE, shade) \
    X(HIGHLIGHT, highlight) \
    X(PROJECT, project) \
    X(SORT_COUNT, sort_count) \
    X(SORT_SCATTER, sort_scatter) \
    X(BIN_COUNT, bin_count) \
    X(BIN_EMIT, bin_emit) \
    X(BIN_END, bin_end) \
    X(WALK_CAMERA, walk_camera) \
    X(GATHER_CAMERA, gather_camera) \
    X(WALK_LIGHT, walk_light) \
    X(WALK_MAP, walk_map) \
    X(GATHER_LIGHT, gather_light) \
    X(BLEND, blend) \
    X(BLEND_LAYERS, blend_layers)

typedef enum gpu_program {
#define GPU_NUMBER(number, file) GPU_##number,
    GPU_EACH_PROGRAM(GPU_NUMBER) GPU_PROGRAMS
#undef GPU_NUMBER
} gpu_program;

/* The context that the calling program had current, and gets back. */
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
    gpu_buffer gaussians; /* (channels, stride) the model's */
    gpu_buffer seen, visibility, depth_cue, flux;
    gpu_buffer shaded, color, layers; /* shaded: its count, then the Gaussians */
    gpu_buffer pixels, layer_pixels, transmittance, pixel_visibility, pixel_shadow;
    gpu_buffer networks, lamps, sky_shares, tally, neighbours; /* of SHADE */
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
    int sky_ready;       /* 1: the buffer `sky_shares` is this model's */
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

/* Runs so many groups of a program, and perhaps some more: programs must look at item() or group(). Its block
   `parameters` (std140) is given, and its buffers: of bindings 0, 1 .., up to a NULL. Some may be other
   programs' alone. What runs later sees what it wrote. */
static void gpu_run(gpu *g, gpu_program which, const void *parameters, size_t size,
                    const gpu_buffer *const *buffers, size_t groups) {
    const size_t most = 65535, rows = (groups + most - 1) / most;
    unsigned char block[1024] = {0}; /* a std140 block's size is a multiple of 16; the largest has 800 */
    if (!g->result && !g->program[which]) g->program[which] = gpu_compile(g, which);
    if (g->result || !groups) return;
    g->gl.UseProgram(g->program[which]);
    if (!g->parameters.name) g->gl.GenBuffers(1, &g->parameters.name);
    g->gl.BindBufferBase(GPU_GL_UNIFORM_BUFFER, 0, g->parameters.name);
    memcpy(block, parameters, size);
    g->gl.BufferData(GPU_GL_UNIFORM_BUFFER, (intptr_t)((size + 15) / 16 * 16), block, GPU_GL_DYNAMIC_DRAW);
    for (uint32_t i = 0; buffers[i]; i++)
        g->gl.BindBufferBase(GPU_GL_SHADER_STORAGE_BUFFER, i, buffers[i]->name);
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

/* The parameters of the lighting programs; lighting.glsl says what they are. */
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
static void gpu_upload_sky_shares(gpu *g, const ssdgs_placed *o) {
    gpu_upload(g, &g->frame.sky_shares, o->sky_share,
               o->sky_share ? (size_t)o->gaussians.count * sizeof(float) : 0);
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
           (s->dipole == SSDGS_DIPOLE_PRINTED ? GPU_PRINTED_DIPOLE : 0) | (o->sky_share ? GPU_AMBIENT : 0) |
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

static int gpu_dark(const ssdgs_light *l) {
    return !(l->intensity[0] > 0 || l->intensity[1] > 0 || l->intensity[2] > 0);
}

/* Has the light a map? */
static int gpu_casts(const ssdgs_light *l) { return !l->unshadowed && !gpu_dark(l); }

static void gpu_set_lamp(gpu_lamp *lamp, const ssdgs_frame *frame, const ssdgs_light *l) {
    const int spot = l->kind == SSDGS_LIGHT_SPOT, directional = l->kind == SSDGS_LIGHT_DIRECTIONAL,
              ranged = !directional && l->range > 0, focused = !directional && l->focus > 0,
              dark = gpu_dark(l);
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

static size_t gpu_tiles(const ssdgs_splat_view *v) {
    return (size_t)((v->width + 15) / 16) * (size_t)((v->height + 15) / 16);
}

/* A face of a light's maps; highlight.comp says what it holds. */
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
    face->size[3] = (int32_t)gpu_tiles(v);
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
    const gpu_buffer *const buffers[] = {&f->seen,  &f->tally,  &f->shaded, &f->neighbours,
                                         &f->color, &f->layers, NULL};
    gpu_run(g, which, parameters, sizeof parameters, buffers, groups);
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
    const gpu_buffer *const buffers[] = {&f->gaussians, &f->flux,    &f->nodes, &f->seen,
                                         &f->transport, &f->arrived, NULL};
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
        gpu_run(g, GPU_TRANSPORT_NODES, &p, sizeof p, buffers, (nodes + GPU_NODE - 1) / GPU_NODE);
        f->light[light].revision = p.revision;
        f->light[light].ready = !g->result;
    }
    gpu_run(g, GPU_TRANSPORT_SUMS, &p, sizeof p, buffers, nodes);
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
    const gpu_buffer *const buffers[] = {&f->networks,     &f->lamps,     &f->gaussians, &f->shaded,
                                         &f->visibility,   &f->depth_cue, &f->transport, &f->sky_shares,
                                         &f->camera.depth, &f->color,     &f->layers,    NULL};
    gpu_reserve(g, &f->shaded, (n + 1) * sizeof(uint32_t));
    gpu_reserve(g, &f->neighbours, n * sizeof(uint32_t));
    gpu_reserve(g, &f->color, 4 * n * sizeof(float));
    gpu_reserve(g, &f->layers, 4 * n * (size_t)frame->layer_count * sizeof(float));
    gpu_seen_program(g, GPU_SEEN_LIST, count, layers, groups);
    gpu_transport_all(g, frame);
    gpu_run(g, GPU_SHADE, &k, sizeof k, buffers, (n + (size_t)k.inputs[2] - 1) / (size_t)k.inputs[2]);
    if (frame->options.max_error > 0) gpu_seen_program(g, GPU_SEEN_COPY, count, layers, groups);
}

/* ==== stages up to WALK, of one view ==== */

static float gpu_log2_threshold(const ssdgs_frame *frame) {
    const double threshold = (double)frame->options.alpha_threshold;
    return (float)(log(threshold > 1e-9 ? threshold : 1e-9) * 1.44269504088896341);
}

static void gpu_project_view(gpu *g, const ssdgs_frame *frame, int view, gpu_view *to) {
    const ssdgs_splat_view *v = frame->views + view;
    struct {
        float view[12], fx, fy, cx, cy, near_plane, log2_threshold, variance;
        uint32_t count, stride, width, height, orthographic, by_distance, compensate, floored;
    } p;
    const gpu_buffer *const buffers[] = {&g->frame.gaussians, &to->record, &to->depth, NULL};
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
    gpu_run(g, GPU_PROJECT, &p, sizeof p, buffers, gpu_groups(n));
}

enum { GPU_SORT_BLOCKS = 256, GPU_FIRST_ROOM = 1 << 16 };

/* Sorts the numbers of room keys at most by so many of their low bits, into key[*end], value[*end].
   instances: 1: facts.instances says how many there are; 0: as many as there is room for. */
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
        const int from = *end, to = *end = !from;
        const gpu_buffer *const buffers[] = {&g->frame.facts,
                                             p.shift ? s->key + from : keys,
                                             &s->digits,
                                             s->value + from,
                                             s->key + to,
                                             s->value + to,
                                             NULL};
        gpu_run(g, GPU_SORT_COUNT, &p, sizeof p, buffers, blocks);
        gpu_run(g, GPU_SORT_SCATTER, &p, sizeof p, buffers, blocks);
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
    gpu_scratch *s = &g->scratch;
    const gpu_buffer *const counted[] = {&g->frame.facts, &to->record, &to->order,    &to->of_gaussian,
                                         &s->groups,      &to->depth,  &to->instance, &s->owner,
                                         s->key,          NULL};
    int bits = 1, end; /* one pass at least: it numbers the instances */
    gpu_reserve_instances(g, frame, v, to);
    gpu_run(g, GPU_BIN_COUNT, &p, sizeof p, counted, gpu_groups(n));
    gpu_run(g, GPU_BIN_EMIT, &p, sizeof p, counted, gpu_groups(n));
    while (tiles > (size_t)1 << bits) bits++;
    gpu_radix_sort(g, view, s->key, room, bits, 1, &end);
    const gpu_buffer *const sorted[] = {&g->frame.facts, s->key + end,   s->value + end,  &s->owner,
                                        &to->instance,   &to->tile_list, &to->tile_start, NULL};
    gpu_run(g, GPU_BIN_END, &p, sizeof p, sorted, gpu_groups(room + 1));
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
    const gpu_buffer *const walked[] = {&to->record,    &to->tile_list,   &to->tile_start,
                                        &to->tile_seen, &to->tile_needed, NULL};
    const gpu_buffer *const gathered[] = {
        &to->of_gaussian, &to->instance, &to->tile_seen, &to->tile_needed, &g->frame.seen,
        &g->frame.tally,  NULL};
    gpu_reserve(g, &to->tile_seen, g->instance_room * sizeof(uint32_t));
    gpu_reserve(g, &to->tile_needed, g->instance_room * sizeof(uint32_t));
    gpu_reserve(g, &g->frame.seen, (size_t)frame->count * sizeof(uint32_t));
    gpu_reserve(g, &g->frame.tally, 2 * gpu_groups((size_t)frame->count) * sizeof(uint32_t));
    gpu_run(g, GPU_WALK_CAMERA, &p, sizeof p, walked, p.tiles);
    gpu_run(g, GPU_GATHER_CAMERA, &gather, sizeof gather, gathered, gpu_groups((size_t)frame->count));
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
    const gpu_buffer *const buffers[] = {
        &from->of_gaussian,   &from->instance,     &from->tile_sums, &g->scratch.sums,
        &g->frame.visibility, &g->frame.depth_cue, &g->frame.flux,   NULL};
    gpu_reserve(g, &g->scratch.sums, n * 4 * sizeof(float));
    gpu_reserve(g, &g->frame.visibility, all);
    gpu_reserve(g, &g->frame.depth_cue, frame->depth_cue ? all : 4);
    gpu_reserve(g, &g->frame.flux, frame->flux ? all : 4);
    gpu_run(g, GPU_GATHER_LIGHT, &p, sizeof p, buffers, gpu_groups(n));
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
    const gpu_buffer *const buffers[] = {
        &to->record,    &to->tile_list,  &to->tile_start,   &to->depth,       &to->of_gaussian,
        &to->tile_sums, &g->frame.facts, &light->light_map, &light->map_tile, NULL};
    gpu_run(g, GPU_WALK_LIGHT, &p, sizeof p, buffers, p.tiles);
    if (p.map || p.flux) gpu_run(g, GPU_WALK_MAP, &p, sizeof p, buffers, p.tiles);
    gpu_gather_light_view(g, frame, view, to);
}

/* ==== COMPOSITE without its highlights ==== */

enum { GPU_LAYERS = 8 };

static void gpu_blend_all(gpu *g, const ssdgs_frame *frame) {
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height;
    gpu_frame *f = &g->frame;
    const gpu_buffer *const buffers[] = {
        &f->camera.record, &f->camera.tile_list, &f->camera.tile_start, &f->camera.tile_seen, &f->color,
        &f->layers,        &f->pixels,           &f->layer_pixels,      &f->transmittance,    NULL};
    const uint32_t all = frame->layer_count ? (uint32_t)frame->layer_count + 1 : 1;
    gpu_walk_parameters p = gpu_walk_of(frame, 0);
    p.gaussians = (uint32_t)frame->count;
    p.deferred = frame->layer_count > 0;
    gpu_reserve(g, &f->pixels, pixels * 3 * sizeof(float));
    gpu_reserve(g, &f->transmittance, pixels * sizeof(float));
    gpu_reserve(g, &f->layer_pixels, p.deferred ? pixels * 3 * all * sizeof(float) : 0);
    for (; p.first_layer < all; p.first_layer += GPU_LAYERS) {
        p.layers = all - p.first_layer;
        gpu_run(g, p.deferred ? GPU_BLEND_LAYERS : GPU_BLEND, &p, sizeof p, buffers, p.tiles);
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
        const gpu_buffer *const buffers[] = {&f->layer_pixels, &f->lamps,
                                             &f->faces,        &f->facts,
                                             &map->map_tile,   &map->light_map,
                                             &f->pixels,       &f->pixel_visibility,
                                             &f->pixel_shadow, NULL};
        k.faces[0] = view;
        while (view < frame->view_count && frame->views[view].light == light) view++;
        k.faces[1] = view - k.faces[0];
        k.faces[2] = light;
        gpu_run(g, GPU_HIGHLIGHT, &k, sizeof k, buffers, gpu_groups(pixels));
    }
}

/* ==== whole frames ==== */

/* The model is uploaded anew where it may have changed. */
static void gpu_upload_model(gpu *g, const ssdgs_placed *o) {
    const ssdgs_model_view *v = &o->gaussians;
    const int known = g->model == o->model && g->revision == o->revision;
    if (!known) {
        gpu_upload(g, &g->frame.gaussians, v->gaussians, v->stride * (size_t)v->channels * sizeof(float));
        gpu_upload_networks(g, o);
    }
    if (!known || !g->sky_ready) gpu_upload_sky_shares(g, o);
    g->sky_ready = o->sky_share != NULL;
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
        v->cached = v->cached == 2 && !v->record && g->owner == frame->memory ? 2 : 0;
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
   gpu_end_frame() and uploads in mid-frame wait for the device. A view that was kept has its
   counts. */
static int gpu_had_room(gpu *g, ssdgs_frame *frame) {
    const size_t size = (size_t)frame->view_count * sizeof(gpu_fact);
    gpu_fact *facts = (gpu_fact *)gpu_host(g, size);
    size_t most = 0;
    if (!facts) return 1;
    gpu_download(g, &g->frame.facts, facts, size);
    for (int i = 0; i < frame->view_count && !g->result; i++) {
        ssdgs_splat_view *v = frame->views + i;
        if (v->cached) continue;
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
                             (double)o->gaussians.stride * o->gaussians.channels,
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
    plain = plain && gpu_is(o->roughness, 1) && gpu_is(o->specular, 1) && gpu_is(o->translucency, 1) &&
            gpu_is(o->presence, 1) && gpu_is(o->kept, 0);
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
            if (!frame->views[i].record) frame->views[i].cached = 0;
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
