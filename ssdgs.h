/* ssdgs.h - v0.3.0 - relightable Gaussian splatting in C - MIT, see the end

Trains 3D Gaussians on photographs that each show an object under known light. Renders them from new views
under new lights, with shadows, anisotropic highlights and subsurface scattering. The method is that of
"SSD-GS: Scattering and Shadow Decomposition for Relightable 3D Gaussian Splatting" (ICLR 2026); its equations
are cited by number. It runs on the CPU and needs C99 or C++11, libc, libm and the system's threads.

DO THIS
  In one C or C++ file define SSDGS_IMPLEMENTATION, then include ssdgs.h. Everywhere else include it alone.
  Link with -lm -lpthread (nothing on Windows) and optimise (-O2, /O2). Keep the file's name, as it includes
  itself once per instruction set, or say -DSSDGS_SELF='"other.h"'.

  Rendering a model file or, without one, a single grey Gaussian, into color, linear RGB:
--- render example ---
    #define SSDGS_IMPLEMENTATION
    #include "ssdgs.h"
    int main(int argc, char **argv) {
        static ssdgs_real color[64 * 64 * 3], eye[3] = {0, -3, 1}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
        ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, 64, 64);
        static const ssdgs_real lamp[3] = {1, -2, 2}, white[3] = {9, 9, 9};
        ssdgs_light light = ssdgs_light_point(lamp, white);
        static ssdgs_image image;
        ssdgs_context *context = NULL;
        ssdgs_model *model = NULL;
        ssdgs_result result = ssdgs_context_create(NULL, &context);
        if (!result && argc > 1) result = ssdgs_model_load(context, argv[1], &model, NULL);
        if (!result && argc <= 1) result = ssdgs_model_create(context, NULL, 1, &model);
        image.color = color;
        if (!result) result = ssdgs_render(model, &camera, &light, 1, &image);
        if (result) printf("%s: %s\n", ssdgs_result_string(result), ssdgs_error_message(context));
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
        return result != SSDGS_OK;
    }
--- end ---
  Training on photographs that the program has read:
--- train example ---
    #define SSDGS_IMPLEMENTATION
    #include "ssdgs.h"
    int train(const ssdgs_photo *photos, int count, int iterations, const char *path) {
        ssdgs_train_options options = ssdgs_train_options_default();
        ssdgs_context *context = NULL;
        ssdgs_model *model = NULL;
        ssdgs_trainer *trainer = NULL;
        ssdgs_result result = ssdgs_context_create(NULL, &context);
        options.iterations = iterations;
        if (!result) result = ssdgs_model_create(context, NULL, 0, &model);
        if (!result) result = ssdgs_trainer_create(model, photos, count, &options, &trainer);
        if (!result) result = ssdgs_trainer_run(trainer, NULL, NULL);
        if (!result) result = ssdgs_model_save(model, path);
        if (result) printf("%s: %s\n", ssdgs_result_string(result), ssdgs_error_message(context));
        ssdgs_trainer_destroy(trainer);
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
        return result != SSDGS_OK;
    }
--- end ---

WHAT IT COMPUTES
  Gaussians are projected and blended front to back (eq. 1). Each has the colour of eq. 3:
      C = sum over lights of E (((c_d / pi) f_d + c_s f_s) S + c_sss f_sss)
  E      light_scale x intensity / distance^2
  f_d    max(0, n . wi) (eq. 9)        f_s  Fresnel x anisotropic spherical Gaussians, ASG (eqs. 10 to 12)
  S      light that arrives (eqs. 6, 7), refined by the shadow network (eq. 8)
  f_sss  a dipole (eq. 5) of the optical parameters that the scattering network predicts (eq. 4)
  ssdgs_settings_published() is the paper's model. ssdgs_settings_default() differs in what measured as
  better. It shades in linear light. Highlights and shadow edges are computed per pixel, of what Gaussians
  blend to ("deferred"). The scattering network is smaller and has five more inputs: the light that a true
  dipole brings from elsewhere on the object.

CONVENTIONS
  camera  x right, y down, z forward; the centre of pixel (0,0), top left, is (0.5, 0.5); no lens distortion.
  world   right-handed (scenes: either), any unit, the same for cameras, lights and Gaussians. Floats hold
          seven digits: if a scene lies 1,000 times its size from 0, subtract a nearby point from all
          positions and set settings.origin to it.
  light   a spot's cone, a range and a focus reduce E. For directional and ambient light E is light_scale x
          intensity. Give intensities in the unit used for the photographs: training sets light_scale so that
          the geometric mean of E at the centre of the bounds is 1.
  colour  renders are linear light, never encoded or clamped, multiplied by alpha ("premultiplied").
          ssdgs_to_pixels(), ssdgs_blend_pixels() and ssdgs_to_bytes() encode them. Plain splats alone
          are blended as stored values, for SSDGS_TRANSFER_NONE: SCENES. Photographs,
          options.background and ssdgs_evaluate() use stored values; settings.transfer relates these to linear
          ones. A photograph's alpha blends stored values, as ssdgs_compose() does.
  images  row-major, top row first, up to 32768 px a side.

MEMORY, THREADS, DETERMINISM
  Memory comes from desc.allocator, on the thread that called the library; libc's own is not in it.
  A frame allocates only where it is larger than every earlier one: in pixels, lights, Gaussians or tile
  entries. Pixels, planes and paths stay the caller's. Contexts, models, scenes and trainers
  may be destroyed in any order.
  A context serves one thread at a time, with all that was made on it; contexts share nothing. Hooks,
  allocator, log, tracer and progress run on the caller's thread, an occluder on any. A call made while
  another is at work on the context returns ERR_ARGUMENT; progress may call all but the trainer's destruction.
  After fork() the child can use its copies on one thread, unless a call was running at the fork. A call or a
  task needs up to 96 KiB of stack, unoptimised 150.
  The same calls give the same bits for any number of threads, and of processes that share training's batches
  (options.sum). AVX2, AVX-512 and NEON give the same bits; so do SSE2, WebAssembly and scalar code; the two
  groups differ, as FMA rounds once. Builds agree as far as their libm does, but not with clang's -ffast-math
  or -ffp-contract=fast, nor on x87. Threads keep the rounding mode in which their context was made: a
  host that changes its own gets bits that depend on the threads.

ERRORS
  Calls return SSDGS_OK, which is 0, or a code. ssdgs_error_message() names the file, byte, argument or
  parameter. Where making or loading something fails, *out becomes NULL. Nothing exits or prints.
  All values that a call reads of cameras, lights, networks and ASG must be finite. Gaussians that are not
  finite are not drawn, or black; infinite sizes and opacities are clamped. A training step whose gradient is
  not finite changes nothing; ssdgs_trainer_run() ends after ten in a row.

FILES
  A model is one binary little-endian PLY: vertices as splat viewers know them with our raw parameters added,
  then ssdgs_settings, asg_basis, scattering_weight and shadow_weight. x y z are relative to settings.origin.
  PlayCanvas' tools, three, Babylon, Spark, GaussianSplats3D and loaders.gl read it; examples/export.c writes
  files for gsplat and spz-js, which take nothing behind the vertices. Models of older versions load. A plain
  splat file loads as baked colours, which change with the view by harmonics up to degree 3, in either order
  of f_rest: drawn as they are, not trained. It takes 14 planes of a Gaussian, 59 with degree 3.
  Reading takes ASCII and both byte orders, skips what it does not know, and mends or drops broken Gaussians
  (ssdgs_load_stats). Limits: 2^28 Gaussians, a header of 1 MiB with 64 elements and 1024 properties.
  Editors of splats drop what lies behind the vertices, and move these: examples/adopt.h mends that.
  Checkpoints have native byte order, and fit one version, precision, set of options and photographs; else the
  message names the first that differs.
  Files are written under another name and renamed when complete: a link is replaced, not followed. A process
  that is killed may leave a file PATH.tmp.*

SCENES, as engines have them: examples/engine.c is one
  ssdgs_scene_render() draws placed models, ssdgs_object, in one frame: sorted and blended together, shadowing
  each other. Scattered light stays within an object. A frame:
      ssdgs_camera_from_matrices()   the engine's view and projection
      ssdgs_scene_light()            the lights' maps
      draw the meshes, with shadows of splats by ssdgs_scene_shadow(), or in a shader by
                                     ssdgs_scene_light_map()
      ssdgs_scene_render()           with the meshes' depth as image.scene_depth, which
                                     ssdgs_depth_from_buffer() makes, and their shadow maps by
                                     ssdgs_scene_occlude()
      ssdgs_blend_pixels()           over the engine's framebuffer; or ssdgs_to_pixels() and the GPU's
                                     blending, best of SSDGS_RGBA16F + SSDGS_PREMULTIPLIED
  For a wanted irradiance E at a distance d from a point light, intensity is E d^2 / light_scale.
  A light's map covers what it reaches, with up to 1024 pixels a side by default. So give lights a range: they
  cost what they reach, and keep their maps while they and what they reach stay, dark or not. A directional
  light's map covers all objects of the array: leave out what is far away.
  All objects share the largest one's shadow bias: a very large model removes contact shadows of small ones.
  If models have different settings.light_scale, set object.tint to compensate.
  Plain splats are blended as they were made, as stored values, while a frame has nothing else: then give
  SSDGS_TRANSFER_NONE to ssdgs_blend_pixels(). Beside any other model they are linear light, as all else.
  Baked colours are the light of a capture. examples/unbake.h makes models of them that take light, and may
  keep a share of them. light.kept says how much of them its shadow takes away. That is for shadows of what
  the capture did not have: its own, which it shows already, become twice as dark.

SPEED
  ssdgs_render_options_exact() is the method as written. _default() loses less than 0.02 dB against
  photographs where it was measured, _fast() less than 0.1 dB, _preview() less than 0.5 dB. Time goes with
  the number of Gaussians: examples/reduce.h makes levels of detail and teaches them what the model shows. Of
  ssdgs_object.levels a frame draws what its pixels ask for.
  Each more light that moves takes about three quarters of what a frame with one takes. With sixteen,
  options.light_detail 0.6 saves a fifth, 61 dB from exact. With one light that would be 51 dB.
  Skipped without changing any bit: Gaussians that no pixel blends, neurons that are 0 in a whole block of 64
  Gaussians, terms not asked for, results of the last frame that still hold.

MACROS, defined before the header; those with * in every file that includes it
  SSDGS_IMPLEMENTATION  in one file: the code
  SSDGS_STATIC          every function is static, in a file that has the implementation
  SSDGS_API *           stands before every function: extern, or your __declspec(dllexport)
  SSDGS_STAGES          shows a frame's stages, for GPU hooks
  SSDGS_NO_TRAINER *    rendering only: half of the code and of the time to compile
  SSDGS_NO_STDIO *      no functions with a path
  SSDGS_NO_THREADS      no threads of its own; desc.parallel still works
  SSDGS_NO_AVX512, SSDGS_NO_AVX2, SSDGS_NO_SIMD  leave these kernels out; SSDGS_SCALAR adds the scalar ones
  SSDGS_ASSERT(x)       checks an invariant: assert, for instance; nothing by default
  SSDGS_REAL64 *        ssdgs_real is double, on scalar kernels and libm: for tests. Linking such a program
                        to a library of floats fails: it lacks ssdgs_context_create_real64()

BESIDE IT, in examples/, headers on this interface
  judge.h and hull.h judge captures, reduce.h makes levels of detail, sky.h lights of environment maps,
  unbake.h models that take light of plain splats, splats.h reads packed ones, adopt.h mends edited models,
  olat.h reads datasets, colmap.h what COLMAP found, images.h PNG, JPEG and OpenEXR; gpu/ draws scenes in
  OpenGL 4.3, in a context of its own or in an engine's. Nothing finds cameras or lights (options.refine
  corrects small errors), traces light between objects, or compresses models.

CHANGES, for programs written for 0.2.4
  ssdgs_model_reduce, _adopt     reduce_model() of examples/reduce.h, adopt_model() of adopt.h: other models
  ssdgs_environment, and notes   sky_lights() of examples/sky.h; judge_photos() of judge.h notes on captures
  {SSDGS_LIGHT_POINT, ..}        ssdgs_light_point(), _spot(); _directional(-position, ..) for a sun
  another argument               ssdgs_checkpoint_iteration() has the run's length, ssdgs_scene_light() the
                                 camera before the lights, _to_pixels() and _blend_pixels() the context first
  ssdgs_stage_fail(frame, ..)    ssdgs_context_fail(frame->context, ..); a hook's view is `cached` 2 for 1:
                                 1 says that WALK is to be done again
  options.max_gaussians          what training ends with; before it may have options.surplus times as many
  image.scene_depth              hides at each pixel by a Gaussian's mean depth there, not by its centre's
  raw planes of a baked model    14, and f_rest behind: ssdgs_model_view.channels; SSDGS_DIFFUSE is f_dc

CONTENTS, search for the tag
  >>config >>memory >>threads >>cpu  compiler and CPU; contexts and errors; the pool; which kernels run
  >>model >>frame >>camera           parameters and networks; a frame's memory; cameras and lights by values
  >>objects >>lights >>options       placed models and bounds; views of light maps; presets
  >>table >>begin                    what kernels need of a light; a frame's beginning, and what it finds kept
  >>project >>shadow >>transport     splats and tiles; visibility from the lights; dipole transport
  >>shade >>composite >>render       colour of the Gaussians seen; blending, highlights; stages in order
  >>scene >>loss >>ply               placed models; loss and metrics; model files
  >>trainer >>density                one photograph and Adam; clone, split, prune
  >>steps >>checkpoint               the trainer's public functions; a run's whole state
  >>kernels >>vmath >>*_kernel       vector macros, elementary functions, the kernels
  eq. 1  project, composite_layers    eq. 3  colour; deferred: highlight    eq. 4  network_forward
  eq. 5  dipole                       eq. 6, 7  walk_light                  eq. 8  shadow_factor
  eq. 9  reflect; highlight           eq. 10  half_vector                   eq. 12  asg; deferred: glow
  eq. 14  colour                      loss  ssim_row                        Adam  adam_lanes
  where X has a gradient, X_backward stands behind it */

/* ==== the interface ==== */

#if !defined(SSDGS__ISA)
#ifndef SSDGS_H
#define SSDGS_H

#include <stddef.h>
#include <stdint.h>

#define SSDGS_VERSION 300 /* 0.3.0; written into files */

#if defined(__GNUC__) && !defined(__TINYC__) && !defined(__PCC__) /* which say GCC without having it all */
#define SSDGS__GNUC __GNUC__
#else
#define SSDGS__GNUC 0
#endif
#ifndef SSDGS_API
#if !defined(SSDGS_STATIC)
#define SSDGS_API extern
#elif SSDGS__GNUC
#define SSDGS_API static __attribute__((unused))
#else
#define SSDGS_API static
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

#ifdef SSDGS_REAL64 /* for tests of values and gradients */
typedef double ssdgs_real;
#define ssdgs_context_create ssdgs_context_create_real64 /* the linker tells who is built otherwise */
#else
typedef float ssdgs_real;
#endif

/* One list makes the enum, ssdgs_result_string() and the codes the log sees. */
#define SSDGS_RESULTS(X) \
    X(OK, "ok") \
    X(ERR_ARGUMENT, "an argument is out of range") \
    X(ERR_OPTIONS, "the options were not made by their _default() function") \
    X(ERR_MEMORY, "out of memory") \
    X(ERR_IO, "a file could not be read or written") \
    X(ERR_FORMAT, "a file does not hold what it should") \
    X(ERR_LIMIT, "a size is over its limit") \
    X(ERR_CANCELLED, "cancelled by a callback") \
    X(ERR_NONFINITE, "a value is not finite") \
    X(ERR_ISA, "this CPU or build lacks the instruction set asked for")

#define SSDGS__RESULT_ENUM(name, text) SSDGS_##name,
typedef enum ssdgs_result { SSDGS_RESULTS(SSDGS__RESULT_ENUM) SSDGS_RESULT_COUNT } ssdgs_result;
#undef SSDGS__RESULT_ENUM

/* clang-format off */
typedef enum ssdgs_isa {
    SSDGS_ISA_AUTO = 0, SSDGS_ISA_SCALAR, SSDGS_ISA_SSE2, SSDGS_ISA_WASM, SSDGS_ISA_AVX2, SSDGS_ISA_AVX512,
    SSDGS_ISA_NEON, SSDGS_ISA_COUNT
} ssdgs_isa;
/* clang-format on */

typedef struct ssdgs_context ssdgs_context; /* allocator, log, threads, kernels */
typedef struct ssdgs_model ssdgs_model;     /* Gaussians, ASG bases, both networks, settings */
typedef struct ssdgs_scene ssdgs_scene;     /* what frames of placed models keep for the next */
typedef struct ssdgs_trainer ssdgs_trainer; /* optimiser state of one training run */

/* ---- context ---- */

typedef struct ssdgs_allocator { /* both functions or none */
    void *(*allocate)(void *user, size_t bytes);
    void (*release)(void *user, void *memory);
    void *user;
} ssdgs_allocator;

typedef struct ssdgs_logger { /* hears failures, and notes with the code SSDGS_OK */
    void (*write)(void *user, ssdgs_result code, const char *message);
    void *user;
} ssdgs_logger;

/* Runs task(data, 0) .. task(data, count - 1) in any order, on any threads, and returns when all are done. */
typedef struct ssdgs_parallel {
    void (*run)(void *user, int count, void (*task)(void *data, int index), void *data);
    void *user;
} ssdgs_parallel;

/* For profilers: hears the name of a frame's or training step's stage as it begins, and NULL as it ends. */
typedef struct ssdgs_tracer {
    void (*stage)(void *user, const char *name);
    void *user;
} ssdgs_tracer;

typedef struct ssdgs_context_desc {   /* all zero = defaults */
    ssdgs_allocator allocator;        /* malloc and free */
    ssdgs_logger logger;              /* none */
    ssdgs_parallel parallel;          /* threads of the context's own */
    ssdgs_tracer tracer;              /* none */
    const struct ssdgs_gpu_hook *gpu; /* none; see SSDGS_STAGES. Copied */
    int threads; /* its own, the caller counted, up to 1024; 0 = one per CPU of the machine. With `parallel`:
                    how many that has; 0 = 4. It is given thrice as many tasks at once */
    ssdgs_isa isa; /* the best this CPU has; ERR_ISA where one is missing */
} ssdgs_context_desc;

/* Makes a context; desc may be NULL. Contexts share nothing; one context serves one thread at a time. */
SSDGS_API ssdgs_result ssdgs_context_create(const ssdgs_context_desc *desc, ssdgs_context **out);
/* Joins the threads. What was made on the context goes on working without them, and keeps its memory until
   the last of it is gone. NULL is fine. */
SSDGS_API void ssdgs_context_destroy(ssdgs_context *context);
/* Gives back the memory that frames and training have left for the next; those that follow take it anew. What
   models and scenes keep stays theirs. */
SSDGS_API void ssdgs_context_trim(ssdgs_context *context);
/* Lends the context's threads: runs task(data, 0) .. task(data, count - 1) on them, in any order, and returns
   when all are done. Tasks may not call into the context. ERR_ARGUMENT: count is above 0, and
   there is no task. */
SSDGS_API ssdgs_result ssdgs_context_run(ssdgs_context *context, int count,
                                         void (*task)(void *data, int index), void *data);
/* What the last failure was about: the file, key, byte, argument or parameter. Never NULL. */
SSDGS_API const char *ssdgs_error_message(const ssdgs_context *context);
SSDGS_API const char *ssdgs_result_string(ssdgs_result result);
SSDGS_API const char *ssdgs_isa_string(ssdgs_isa isa);
SSDGS_API ssdgs_isa ssdgs_context_isa(const ssdgs_context *context); /* the one in use */
SSDGS_API int ssdgs_context_threads(
    const ssdgs_context *context); /* how many work; with desc.parallel as desc says */

/* ---- model ---- */

/* clang-format off */
enum { /* of eq. 3; a mask */
    SSDGS_DIFFUSE_TERM = 1, SSDGS_SPECULAR_TERM = 2, SSDGS_SHADOW_TERM = 4, SSDGS_SCATTERING_TERM = 8,
    SSDGS_ALL_TERMS = 15
};
typedef enum ssdgs_transfer { SSDGS_TRANSFER_SRGB = 0, SSDGS_TRANSFER_NONE } ssdgs_transfer;
typedef enum ssdgs_dipole { SSDGS_DIPOLE_JENSEN = 0, SSDGS_DIPOLE_PRINTED } ssdgs_dipole;
typedef enum ssdgs_asg { SSDGS_ASG_GEOMETRIC = 0, SSDGS_ASG_DEFERRED = 2 } ssdgs_asg;
typedef enum ssdgs_blur { SSDGS_BLUR_ADD = 0, SSDGS_BLUR_FLOOR } ssdgs_blur;

#define SSDGS_ASG_COUNT 8
#define SSDGS_MATERIAL_COUNT 6
#define SSDGS_MAX_LAYERS 16   /* linear layers of a network */
#define SSDGS_MAX_WIDTH 1024  /* neurons of a layer */
/* clang-format on */

/* What a model computes; stored in its file. 0 or 1 where nothing else is said. */
typedef struct ssdgs_settings {
    int version; /* set by ssdgs_settings_default / _published */
    int terms;   /* SSDGS_*_TERM mask: what the model has */
    int baked;   /* 1: each Gaussian has a fixed colour, as in plain splat files, which lights change by their
                    `kept` alone */
    int harmonics; /* degree, 0 .. 3, of the harmonics by which baked and kept colours change with the view */
    ssdgs_real kept; /* 0 .. 1: share of baked colours that a model which is not baked sends besides what its
                        lights make of it, see ssdgs_object. Above 0 its Gaussians have them */
    int transfer;    /* ssdgs_transfer: stored images are sRGB-encoded, or are what is blended */
    int dipole;      /* ssdgs_dipole: eq. 5 with Jensen's distances, or as printed */
    int asg;         /* ssdgs_asg: highlights per Gaussian (eq. 12), or per pixel (deferred) */
    int per_channel_optics;   /* 1: sigma_s and sigma_a of each colour channel; 0: one for all */
    int depth_cue;            /* 1: the scattering network sees how deep in the object a point lies */
    int transport;            /* 1: it also sees what true dipole transport brings from where light enters */
    int residual_shadow;      /* 1: the shadow network corrects the logit of eq. 7; 0: its output is S */
    int shadow_on_scattering; /* 1: eq. 14, the paper's ablation: S darkens scattering too */
    struct {
        int layers;       /* linear ones, up to SSDGS_MAX_LAYERS, not 1 of scattering; 0: light scatters by
                             `medium`, S is eq. 7's transmittance */
        int width;        /* neurons of the hidden layers, up to SSDGS_MAX_WIDTH */
    } scattering, shadow; /* the two networks */
    struct {
        int view, light;
    } octaves; /* 0 .. 8: of the sines of wo and wi that the scattering network sees; many overfit */
    struct {
        int blur;        /* ssdgs_blur: 0.3 px^2 added, or a floor of 0.2 px^2 */
        int size;        /* px a side, up to 8192; 0 = a typical Gaussian is about a pixel wide */
        ssdgs_real bias; /* length units: what is nearer to the light by less casts no shadow. Models made in
                            code: three standard deviations of their Gaussians */
    } light_map;
    ssdgs_real pixel_variance; /* px^2, 0.01 .. 10: added to a splat's in the camera pass */
    ssdgs_real eta;            /* index of refraction, 1 .. 2.5 */
    ssdgs_real centre[3];      /* world: origin of the networks' positions */
    ssdgs_real length_unit;    /* world units in one unit of the networks */
    ssdgs_real light_scale;    /* factor from the dataset's intensities to the model's */
    ssdgs_real ambient[3];     /* RGB, 0 or more: even light that the photographs have besides their lights.
                                  Training and evaluation add it; renders do where options.ambient[0] is it */
    ssdgs_real origin[3]; /* world: where the model's 0 lies. The library only stores it, see CONVENTIONS */
    struct {
        ssdgs_real turn[3], scale, move[3];
    } placement; /* where an editor of splats has put the model, see examples/adopt.h: its point p is drawn
                    at scale x (p turned) + move. turn: axis x radians; scale: 1, below 0 it mirrors, too */
    struct {
        ssdgs_real scattering[3], absorption[3]; /* RGB, of 1 world unit: the reduced sigma_s, and sigma_a */
    } medium; /* of models made in code, where scattering.layers is 0 and transport 1: light travels in it by
                 true transport, without a network. Lengths are told apart from 0.04 to 0.64 length_unit. A
                 ball of wax has 28 dB beside path tracing, 22 lit from the side */
} ssdgs_settings;

SSDGS_API ssdgs_settings ssdgs_settings_default(void);
SSDGS_API ssdgs_settings ssdgs_settings_published(void); /* the paper's model */

/* A model of count Gaussians, each as ssdgs_gaussian_default(), networks at their start. settings NULL =
   default. */
SSDGS_API ssdgs_result ssdgs_model_create(ssdgs_context *context, const ssdgs_settings *settings, int count,
                                          ssdgs_model **out);
SSDGS_API void ssdgs_model_destroy(ssdgs_model *model); /* NULL is fine */
SSDGS_API const ssdgs_settings *ssdgs_model_settings(const ssdgs_model *model);
SSDGS_API int ssdgs_model_count(const ssdgs_model *model); /* Gaussians */
/* Hands a model to another context, after loading it on another thread for instance, while no call is at work
   on either. Both must have the same allocator. ERR_ARGUMENT: they have not, or a trainer has the model. */
SSDGS_API ssdgs_result ssdgs_model_move(ssdgs_model *model, ssdgs_context *to);

/* One Gaussian in physical units. */
typedef struct ssdgs_gaussian {
    ssdgs_real position[3];   /* world */
    ssdgs_real rotation[4];   /* quaternion w x y z, of any length: its axes in the world; 0: the third is the
                                 normal */
    ssdgs_real scale[3];      /* standard deviations along them, world units, above 0 */
    ssdgs_real normal[3];     /* of the surface, for shading; 0 0 0 = the third axis. Highlights lie along the
                                 other two, turned with the third to the normal */
    ssdgs_real opacity;       /* 0 .. 1 at the centre */
    ssdgs_real diffuse[3];    /* c_d: albedo, 0 or more */
    ssdgs_real specular[3];   /* c_s; deferred, its lobe's height: see ssdgs_gaussian_mirror(). 0 = none */
    ssdgs_real scattering[3]; /* c_sss: scale of the dipole's light */
    ssdgs_real sharpness[2];  /* lambda, mu of a deferred highlight, above 0: 1 = broad, more is narrower */
    ssdgs_real f0;            /* of a deferred highlight, at normal incidence, above 0, up to 1: 0.04 for
                                 dielectrics */
    ssdgs_real softness;      /* 0: a deferred shadow is the pixel's, sharp; 1: the Gaussian's */
    ssdgs_real material[SSDGS_MATERIAL_COUNT]; /* code that the networks see */
} ssdgs_gaussian;

SSDGS_API ssdgs_gaussian ssdgs_gaussian_default(void); /* grey, opacity 0.1, 0.02 wide, at 0 */
/* Gives a Gaussian, of a model made in code, the highlight of a mirror of microfacets: roughness, along its
   first and second axis, is Beckmann's alpha. Sets sharpness and specular, and gives the model the one lobe
   that this needs, for all its Gaussians. For metals let f0 be 0.9 and multiply specular by their colour.
   Balls of metal of roughness 0.15, 0.3 and 0.6 have 37, 30 and 17 dB beside microfacets.
   ERR_ARGUMENT: highlights are not deferred, or a roughness is not 0.01 .. 1. */
SSDGS_API ssdgs_result ssdgs_gaussian_mirror(ssdgs_model *model, const ssdgs_real roughness[2],
                                             ssdgs_gaussian *gaussian);
/* Writes and reads Gaussian `index`. ERR_ARGUMENT: no such Gaussian, or a value out of range. */
SSDGS_API ssdgs_result ssdgs_model_set(ssdgs_model *model, int index, const ssdgs_gaussian *gaussian);
SSDGS_API ssdgs_result ssdgs_model_get(const ssdgs_model *model, int index, ssdgs_gaussian *gaussian);
/* Puts Gaussians in the order that training leaves, neighbours together, which is faster. Indices change.
   Call it once a model made in code is filled; not while it is trained. ERR_ARGUMENT, ERR_MEMORY. */
SSDGS_API ssdgs_result ssdgs_model_sort(ssdgs_model *model);
/* The box, in the model's space, that holds its Gaussians to three standard deviations, but for a few strays.
   0 0 0 where it has none. ERR_MEMORY. */
SSDGS_API ssdgs_result ssdgs_model_bounds(ssdgs_model *model, ssdgs_real low[3], ssdgs_real high[3]);

typedef struct ssdgs_load_stats { /* what reading a file mended */
    int zero_rotations;           /* replaced by the identity */
    int clamped_opacities;        /* to +-20 before sigmoid */
    int clamped_scales;           /* to +-20 before exp */
    int dropped;                  /* Gaussians with values that are not finite */
    int plain;                    /* 1: a plain splat file, loaded as baked colours */
    int untrained;                /* 1: ours without settings, as editors leave it: examples/adopt.h */
    int version;                  /* SSDGS_VERSION of who wrote its settings; 0: it has none */
    int sorted;                   /* 1: was in no order, so ssdgs_model_sort() was called */
} ssdgs_load_stats;

#ifndef SSDGS_NO_STDIO
/* One PLY file; paths are UTF-8 on Windows, too. Saving replaces it only once all is written. Loading sorts
   Gaussians that are in no order. stats may be NULL. ERR_IO, ERR_FORMAT, ERR_LIMIT, ERR_MEMORY; on saving
   ERR_NONFINITE where networks or ASG are not finite. */
SSDGS_API ssdgs_result ssdgs_model_save(const ssdgs_model *model, const char *path);
/* Hands the bytes of that file to `take`, a part at a time, on this thread: for memory, or an archive. If
   take does not return 0, that ends it with ERR_CANCELLED. */
SSDGS_API ssdgs_result ssdgs_model_write(const ssdgs_model *model,
                                         int (*take)(void *user, const void *bytes, size_t size), void *user);
SSDGS_API ssdgs_result ssdgs_model_load(ssdgs_context *context, const char *path, ssdgs_model **out,
                                        ssdgs_load_stats *stats);
#endif
/* The same from bytes in memory, which are not kept. */
SSDGS_API ssdgs_result ssdgs_model_load_memory(ssdgs_context *context, const void *bytes, size_t size,
                                               ssdgs_model **out, ssdgs_load_stats *stats);

/* ---- camera and light ---- */

typedef struct ssdgs_camera {  /* a pinhole */
    int width, height;         /* px */
    ssdgs_real fx, fy, cx, cy; /* px; pixel centres at +0.5 */
    ssdgs_real view[12];       /* (3,4) row-major, world to camera: x right, y down, z forward */
    ssdgs_real near_plane;     /* nearer is not drawn; what is nearer than twice as far is faint. 0 = 0.02
                                  length units (published: 0.01) */
} ssdgs_camera;

/* clang-format off */
typedef enum ssdgs_light_kind {
    SSDGS_LIGHT_POINT = 0, SSDGS_LIGHT_DIRECTIONAL, SSDGS_LIGHT_SPOT
} ssdgs_light_kind;
/* clang-format on */
typedef struct ssdgs_light {
    ssdgs_light_kind kind;
    ssdgs_real position[3];  /* world; of a directional light not read */
    ssdgs_real intensity[3]; /* RGB, 0 or more, in the training data's units; directional: irradiance */
    ssdgs_real direction[3]; /* directional, spot, focus: unit vector along which it shines */
    ssdgs_real cone[2]; /* spot: angles to it in radians, 0 .. pi, full inside the first, 0 outside the larger
                           second; between them as in glTF. No light scatters across its rim */
    ssdgs_real range;   /* point, spot: where it fades to 0, as in glTF; 0: nowhere */
    ssdgs_real focus; /* point, spot: fades as cos^focus of the angle to direction, as LEDs do; up to 1000; 0:
                         does not */
    int unshadowed;   /* not in photographs. 1: nothing is in its way, and it costs no map; light scatters as
                         beneath a plane */
    ssdgs_real kept;  /* not in photographs. 0 .. 1: share of baked and kept colours that is this light's, and
                         is missing in its shadow; of stored values, where all models are baked. Shares of
                         all lights that sum to more than 1 are scaled to 1 */
} ssdgs_light;

/* Lights of each kind; what else they have, set behind that. direction: of any length. cone: angles inner and
   outer. NULL: zeros; rendering refuses a direction of zeros. */
SSDGS_API ssdgs_light ssdgs_light_point(const ssdgs_real position[3], const ssdgs_real intensity[3]);
SSDGS_API ssdgs_light ssdgs_light_directional(const ssdgs_real direction[3], const ssdgs_real irradiance[3]);
SSDGS_API ssdgs_light ssdgs_light_spot(const ssdgs_real position[3], const ssdgs_real direction[3],
                                       const ssdgs_real intensity[3], ssdgs_real inner, ssdgs_real outer);

/* A camera at eye that looks at target; fov_x: horizontal field of view in radians. up may be any vector. fx
   is 0, which rendering refuses, where eye is target or fov_x not within 0 .. pi. */
SSDGS_API ssdgs_camera ssdgs_camera_look_at(const ssdgs_real eye[3], const ssdgs_real target[3],
                                            const ssdgs_real up[3], ssdgs_real fov_x, int width, int height);
/* A camera of an engine's matrices, (4,4) each: clip = projection x view x point. flags: SSDGS_COLUMN_MAJOR
   where their columns lie one after the other, as in OpenGL, SSDGS_CLIP_Y_DOWN where clip y points down, as
   in Vulkan. Off-centre is fine, and so is any range of depths, reversed or infinite: it is not read. In a
   left-handed world the view mirrors: scenes alone take it, with models placed by a reflection; without one
   they look like their mirror images. Set near_plane after that. ERR_ARGUMENT: view is no rotation and
   translation, projection no perspective, or there is no such flag. */
enum { SSDGS_COLUMN_MAJOR = 1, SSDGS_CLIP_Y_DOWN = 2, SSDGS_CLIP_Z_FROM_0 = 4 };
SSDGS_API ssdgs_result ssdgs_camera_from_matrices(ssdgs_context *context, const ssdgs_real view[16],
                                                  const ssdgs_real projection[16], int flags, int width,
                                                  int height, ssdgs_camera *out);
/* Makes image.scene_depth (height,width) of an engine's depth buffer: floats within 0 .. 1 that this
   projection gave, be it reversed, infinite or of an oblique near plane. flags: as above, and
   SSDGS_CLIP_Z_FROM_0 where clip z runs from 0, as in Direct3D, Vulkan and Metal, not from -1, as in OpenGL.
   pitch: bytes from row to row, negative where `buffer` is the top row of one stored bottom row first, as
   glReadPixels() gives it. Errors as above. */
SSDGS_API ssdgs_result ssdgs_depth_from_buffer(ssdgs_context *context, const ssdgs_real projection[16],
                                               int flags, const float *buffer, ptrdiff_t pitch, int width,
                                               int height, ssdgs_real *depth);

/* ---- render ---- */

/* Where results go. Set all to 0 first. Planes are the caller's; NULL = not computed. Colours are linear, not
   clamped (settings.transfer none: as stored). diffuse + specular + scattering + (1 - alpha) background =
   color. Beside an object with deferred highlights, scattering has all light of those without, and baked and
   kept colours but for lights' shares of them, which diffuse has. */
typedef struct ssdgs_image {
    int stride;             /* pixels from row to row; 0 = camera width */
    ssdgs_real *color;      /* (h,w,3) */
    ssdgs_real *alpha;      /* (h,w) */
    ssdgs_real *depth;      /* (h,w) sum of weight x camera depth: divide by alpha */
    ssdgs_real *normal;     /* (h,w,3) sum of weight x normal, world */
    ssdgs_real *diffuse;    /* (h,w,3) */
    ssdgs_real *specular;   /* (h,w,3) */
    ssdgs_real *scattering; /* (h,w,3) */
    ssdgs_real *shadow;     /* (h,w) sum of weight x S, averaged over the lights. While an object has deferred
                               highlights, others' S is that of light maps */
    ssdgs_real *median_depth; /* (h,w) camera depth, at the pixel, of the Gaussian that takes transmittance
                                 below 1/2; 0: none does */
    const ssdgs_real *scene_depth; /* (h,w) read: camera depth, z, of meshes and the like: a Gaussian is not
                                      drawn at pixels where its mean depth is behind it. NaN, 0 and less:
                                      nothing is hidden. May be NULL */
} ssdgs_image;

typedef struct ssdgs_render_options {
    int version;   /* set by the functions below */
    int terms;     /* SSDGS_*_TERM mask: of the model's, those to render */
    int antialias; /* 1: opacity makes up for pixel_variance, so far Gaussians do not grow (Mip-Splatting) */
    ssdgs_real background[3]; /* linear; settings.transfer none: as stored */
    ssdgs_real stop; /* 0 .. 1: pixels, a light map's too, are done below this transmittance; 0 = never */
    ssdgs_real alpha_threshold; /* 0 .. 1: a splat is not drawn at pixels where its alpha is below this */
    ssdgs_real max_error;    /* 0 .. 1: Gaussians whose weights sum to less in every pixel are not shaded */
    ssdgs_real light_detail; /* 0.01 .. 8: resolution of the light maps; 1 = the model's choice */
    ssdgs_real transport_detail; /* 0.1 .. 8: accuracy of true dipole transport; 1 = 1 % off at most, about */
    ssdgs_real level_detail;     /* 0 .. 8: how fine ssdgs_object.levels are to be; 0: the model itself */
    ssdgs_real ambient[9][3];    /* RGB, light from all around: see below; 0 = none */
} ssdgs_render_options;
/* ambient: the irradiance on a surface with the world's normal x y z is the sum of ambient[0] .. [8] times 1,
   y, z, x, xy, yz, 3zz - 1, xz, xx - yy. Of radiance in real spherical harmonics these are the coefficients
   times 0.886227, then thrice 1.023327, 0.858086, 0.858086, 0.247708, 0.858086, 0.429043. A Gaussian gets
   what of an even sky its own model leaves it, which is found anew after each change of the model. Shadows do
   not change it; image.scattering has it. */

/* For games (max_error 1/16, stop 1/1024, transport_detail 0.6, level_detail 1), the method as written, for
   speed (max_error 1/4, stop 1/256, light_detail 0.7, transport_detail 0.6, level_detail 0.5) and for
   previews (max_error 1/2, stop 1/64, light_detail 0.6, transport_detail 0.4, level_detail 0.3,
   alpha_threshold 2/255). SPEED in the manual says what they lose. */
SSDGS_API ssdgs_render_options ssdgs_render_options_default(void);
SSDGS_API ssdgs_render_options ssdgs_render_options_exact(void);
SSDGS_API ssdgs_render_options ssdgs_render_options_fast(void);
SSDGS_API ssdgs_render_options ssdgs_render_options_preview(void);

typedef struct ssdgs_render_stats {
    int gaussians;         /* in the model */
    int objects;           /* in sight; the others only cast shadows */
    int visible;           /* inside the camera's frustum */
    int shaded;            /* contributing to a pixel */
    int skipped;           /* contributing, but not shaded, within max_error: drawn in a neighbour's colour */
    int rejected;          /* never drawn: a parameter is not finite */
    int blackened;         /* drawn black: the colour is not finite */
    int light_views;       /* light maps in use */
    int camera_cached;     /* 1: projection, order and tiles are the last frame's */
    int lights_cached;     /* lights whose maps are the last frame's */
    size_t shadows_cached; /* Gaussians x lights whose shadow network did not run again */
    double network_work;   /* share of the networks' multiplications done */
    size_t instances;      /* (tile, splat) pairs of the camera */
    size_t light_instances; /* the same of the lights' maps made for this frame */
} ssdgs_render_stats;

/* Renders model as camera sees it under lights[0 .. light_count). */
SSDGS_API ssdgs_result ssdgs_render(ssdgs_model *model, const ssdgs_camera *camera, const ssdgs_light *lights,
                                    int light_count, const ssdgs_image *image);
/* The same with options (NULL = default) and statistics (may be NULL). */
SSDGS_API ssdgs_result ssdgs_render_ex(ssdgs_model *model, const ssdgs_camera *camera,
                                       const ssdgs_light *lights, int light_count,
                                       const ssdgs_render_options *options, const ssdgs_image *image,
                                       ssdgs_render_stats *stats);

/* ---- scenes: several models in one frame ---- */

/* A model placed in the world. */
typedef struct ssdgs_object {
    ssdgs_model *model;      /* of the scene's context; one model may stand in many places */
    ssdgs_real to_world[12]; /* (3,4) row-major, the model's space to the world: a rotation or a reflection,
                                times one scale above 0; then a translation */
    ssdgs_real tint[3];      /* RGB, 0 or more: factor of the light that it sends */
    ssdgs_real roughness;    /* 0.1 .. 10: factor of its highlights' widths. What they reflect of an even sky
                                stays; 1 */
    ssdgs_real specular;     /* 0 or more: factor of its highlights; 1 */
    ssdgs_real translucency; /* 0.1 .. 10: factor of how far light travels in it, by true transport; 1 */
    ssdgs_real kept;         /* 0 or more: factor of its baked colours, which it sends without any light;
                                settings.kept, 1 of what is baked */
    const unsigned char *mask;  /* (Gaussians of the model) 255: takes tint, roughness and specular whole; 0:
                                   stays as it is. Geometric lobes take roughness whole. Read in the call.
                                   NULL: all do; NULL */
    ssdgs_real presence;        /* 0 .. 1: share of its optical depth that is there: fades it in and out; 1 */
    ssdgs_model *const *levels; /* (level_count) the same thing made of fewer and fewer Gaussians: each has at
                                   most four fifths of those before. A frame draws the smallest that has 3
                                   Gaussians for 8 pixels of the object's box, times options.level_detail. Up
                                   to a tenth more, it and the one before fade into each other. An object with
                                   a mask stays as it is. Read in the call; NULL */
    int level_count;
} ssdgs_object;
/* A model as it was trained, where its settings.placement puts it. */
SSDGS_API ssdgs_object ssdgs_object_default(ssdgs_model *model);

/* A scene holds no objects: it keeps what its last frame found. Views of one frame share the lights' maps on
   one scene, which is best while lights or objects move; while they rest a scene for each view is faster. To
   shrink one destroy it and make another. */
SSDGS_API ssdgs_result ssdgs_scene_create(ssdgs_context *context, ssdgs_scene **out);
SSDGS_API void ssdgs_scene_destroy(ssdgs_scene *scene); /* NULL is fine */
/* As ssdgs_render_ex(), of several objects. Their Gaussians are sorted and blended together and shadow each
   other. Light scatters within each alone. A model that is scaled stays as bright. objects may be NULL when
   object_count is 0. ERR_ARGUMENT: a transform is none of the above, a tint is negative, or the models mix
   settings.transfer (baked ones may). ERR_NONFINITE: a transform or a background is not finite. ERR_LIMIT:
   2^28 Gaussians in all, 65,535 objects; those with levels count twice. */
SSDGS_API ssdgs_result ssdgs_scene_render(ssdgs_scene *scene, const ssdgs_object *objects, int object_count,
                                          const ssdgs_camera *camera, const ssdgs_light *lights,
                                          int light_count, const ssdgs_render_options *options,
                                          const ssdgs_image *image, ssdgs_render_stats *stats);

/* A shadow map of an engine's meshes: depths seen from the light's position or, directional, along its
   direction. Several of one light, cascades or a cube's faces, are asked in their order, finer ones first,
   until one has the place in its picture and ahead of its far end. If none has, nothing is hidden. Four
   pixels are compared. */
typedef struct ssdgs_shadow_map {
    int light;             /* its number in the frame; one that is `unshadowed` ignores the map */
    int width, height;     /* px */
    int flags;             /* of matrix: SSDGS_COLUMN_MAJOR, SSDGS_CLIP_Y_DOWN, SSDGS_CLIP_Z_FROM_0 */
    uint64_t revision;     /* another one whenever depths change: else Gaussians keep the last ones' shadow */
    ssdgs_real matrix[16]; /* (4,4) world to the light's clip space, w above 0 ahead of it; not to 0 .. 1 */
    ssdgs_real bias;       /* world units: a place is dark only if it is farther behind a surface */
    ssdgs_real range; /* of point lights and spots: above 0: depth is the distance from the light / range; 0:
                         it is clip space's */
    const float *depth; /* (height,width) 0 .. 1, may be reversed; the clear value where nothing is. Top row
                           first: of OpenGL's textures point to the last row, and let pitch be negative. NaN
                           hides nothing. NULL: only desc.gpu has them; frames drawn by the CPU lack them */
    ptrdiff_t pitch;    /* bytes from row to row */
} ssdgs_shadow_map;
/* What else takes light from the objects, meshes for instance. */
typedef struct ssdgs_occluder {
    /* Multiplies fraction (count) by what of light number `light` passes on the way to points (count,3),
       world. Several threads call it at once. NULL: only maps do; with both, both do */
    void (*shadow)(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction);
    void *user;
    uint64_t revision; /* of shadow: another one whenever its answer for a light may differ; until then what
                          was found for Gaussians is kept. Pixels ask in every frame. Lights that move, come
                          or go need none */
    const ssdgs_shadow_map *maps; /* (map_count) read in each frame, with their depths */
    int map_count;
} ssdgs_occluder;
/* For the frames from now on: Gaussians, what scatters in them and pixels get what it leaves. NULL: nothing
   else. Copied, but for the maps. Frames return ERR_ARGUMENT or ERR_NONFINITE where a map is not sound. */
SSDGS_API void ssdgs_scene_occlude(ssdgs_scene *scene, const ssdgs_occluder *occluder);
/* Makes the lights' maps of a frame ahead of it, for ssdgs_scene_shadow(). ssdgs_scene_render() with the same
   objects, lights and options finds them made. From then on every frame of the scene makes them. camera: the
   frame's, for objects with levels; NULL: of the models themselves. */
SSDGS_API ssdgs_result ssdgs_scene_light(ssdgs_scene *scene, const ssdgs_object *objects, int object_count,
                                         const ssdgs_camera *camera, const ssdgs_light *lights,
                                         int light_count, const ssdgs_render_options *options);
/* What of a light passes the scene's objects on the way to points (count,3), world: fraction (count), 0 .. 1.
   By the maps of the scene's last frame, of ssdgs_scene_light() or ssdgs_scene_render(), which note the first
   2 % lost. 1 for a light without shadow. ERR_ARGUMENT: that frame had no such light, made no maps or
   failed. */
SSDGS_API ssdgs_result ssdgs_scene_shadow(ssdgs_scene *scene, int light, const ssdgs_real *points, int count,
                                          ssdgs_real *fraction);
/* The same map for an engine's shader, which has at each pixel three distances from the light, a.xyz, where
   the way through splats darkens; a.w and b.xyz say what is left between them, b.w behind them. */
/* clang-format off */
/* In GLSL, with the map's textures and members as uniforms, at four pixels, weighted as usual; outside 1:
       vec3 p = vec3(dot(view[0], vec4(at, 1)), dot(view[1], vec4(at, 1)), dot(view[2], vec4(at, 1)));
       vec2 pixel = focal * p.xy / (parallel ? 1 : p.z) + size / 2 - 0.5;
       float d = (parallel ? p.z : length(p)) * (1 - 1e-6) - bias;
       float left(vec4 a, vec4 b, float d) {
           bool past = d > a.y;
           float from = past ? a.y : a.x, to = past ? a.z : a.y, dark = past ? b.x : a.w;
           float begin = max(to - bias, from), part = (d - begin) / (to - begin);
           return d <= a.x ? 1 : d > a.z ? b.w : d > begin ? mix(dark, past ? b.z : b.y, part) : dark;
       } */
/* clang-format on */
typedef struct ssdgs_light_map {
    int faces;    /* 0: nothing is in the way; 1, or 6 of a cube, where a place is looked up in the face that
                     has it */
    int size;     /* px, of a face's side */
    int parallel; /* 1: distances are along z, not from the light */
    ssdgs_real view[6][12]; /* (3,4) of each face, world to x right, y down, z forward */
    ssdgs_real focal;       /* px */
    ssdgs_real bias;        /* how far behind a place its own surface may be */
} ssdgs_light_map;
/* a, b: (faces, size, size, 4) floats; NULL: map alone. Errors as of ssdgs_scene_shadow(). */
SSDGS_API ssdgs_result ssdgs_scene_light_map(ssdgs_scene *scene, int light, ssdgs_light_map *map, float *a,
                                             float *b);

SSDGS_API ssdgs_real ssdgs_srgb_encode(ssdgs_real linear); /* IEC 61966-2-1 */
SSDGS_API ssdgs_real ssdgs_srgb_decode(ssdgs_real encoded);
/* 1; 0: x is infinite or NaN. Also under -ffast-math, where comparisons do not tell. */
SSDGS_API int ssdgs_finite(ssdgs_real x);
/* Clamps, encodes by transfer and rounds (count) values to bytes, at most one level off. */
SSDGS_API void ssdgs_to_bytes(const ssdgs_real *values, size_t count, int transfer, unsigned char *bytes);
/* Bytes in memory: SSDGS_BGRA8 is D3D's B8G8R8A8 and, on little-endian machines, SDL's ARGB8888 and
   Irrlicht's and OGRE's A8R8G8B8. */
typedef enum ssdgs_format {
    SSDGS_RGBA8 = 0,
    SSDGS_BGRA8,
    SSDGS_RGBA16F,
    SSDGS_RGBA32F,
    SSDGS_PREMULTIPLIED = 16 /* may be added to a format */
} ssdgs_format;
/* color and alpha of a rendering without background as pixels of straight, or premultiplied, alpha; without
   image->alpha opaque; 0 where alpha is. Bytes are encoded by transfer, halves and floats stay linear. For a
   GPU to blend: premultiplied halves in a linear target, or premultiplied sRGB bytes as an sRGB texture in an
   sRGB target. Other bytes are off at edges, by up to 74 levels. pitch: bytes from row to row, negative where
   `pixels` is the first row of an image stored bottom row first. context: its threads do it; NULL, or in use
   by another thread: this thread alone. */
SSDGS_API void ssdgs_to_pixels(ssdgs_context *context, const ssdgs_image *image, int width, int height,
                               int transfer, int format, void *pixels, ptrdiff_t pitch);
/* Lays such a rendering over a framebuffer: pixels become color + (1 - alpha) x what they hold, by light, so
   bytes are decoded and encoded again. Where alpha is 0 they stay as they are. */
SSDGS_API void ssdgs_blend_pixels(ssdgs_context *context, const ssdgs_image *image, int width, int height,
                                  int transfer, int format, void *pixels, ptrdiff_t pitch);
/* Stored values (pixels,3) of such a rendering laid over `background`, stored values too. stored may be
   color. */
SSDGS_API void ssdgs_compose(const ssdgs_real *color, const ssdgs_real *alpha, size_t pixels, int transfer,
                             const ssdgs_real background[3], ssdgs_real *stored);

typedef enum ssdgs_pixels {
    SSDGS_PIXELS_RGBA8 = 0,
    SSDGS_PIXELS_RGBA16,  /* native-endian, as all that follow */
    SSDGS_PIXELS_RGBA16F, /* halves and floats are linear light, which may exceed 1; settings.transfer encodes
                             it */
    SSDGS_PIXELS_RGBA32F
} ssdgs_pixels;
typedef struct ssdgs_photo { /* set to 0 first */
    ssdgs_camera camera;
    ssdgs_light light;
    const void *pixels; /* (h,w,4) packed, straight alpha; must outlive the trainer */
    ssdgs_pixels format;
    const ssdgs_light *more; /* (more_count) lights that shine as well; must outlive the trainer. With any,
                                none of the photograph's lights is refined */
    int more_count;
} ssdgs_photo;

#ifndef SSDGS_NO_TRAINER
/* ---- train ---- */

/* clang-format off */
typedef enum ssdgs_schedule { /* the paper's orders H to K */
    SSDGS_SCHEDULE_PROGRESSIVE = 0, SSDGS_SCHEDULE_JOINT, SSDGS_SCHEDULE_SWAPPED, SSDGS_SCHEDULE_MERGED
} ssdgs_schedule;
/* clang-format on */
enum {
    SSDGS_REFINE_CAMERA = 1,
    SSDGS_REFINE_LIGHT = 2,
    SSDGS_REFINE_INTENSITY = 4,
    SSDGS_REFINE_AMBIENT = 8
};

/* A learning rate: from start to end by equal factors, to or from 0 by equal steps. */
typedef struct ssdgs_rate {
    ssdgs_real start, end;
} ssdgs_rate;
typedef struct ssdgs_rates {
    ssdgs_rate position; /* of 1.1 x the cameras' radius or the bounds' longest side, whichever is more */
    ssdgs_rate opacity, scale, rotation, color;
    ssdgs_rate asg, frame;                   /* start up to iteration 40,000*, end at 90,000* */
    ssdgs_rate material, shadow, scattering; /* start up to 50,000*, end at 100,000* */
    ssdgs_rate camera, light; /* of the bounds' longest side; turns of a camera of its angle of view,
                                 directions in radians. They rise until 20,000* and 30,000*, end at 60,000*.
                                 Times sqrt(300 / shows) where a photograph has fewer than 300 shows */
} ssdgs_rates;

/* Processes that share each batch. All hold the same photographs and options; each draws its part, and the
   gradients are added. Where batch / processes is a power of two, adding the ranks in pairs, then the pairs
   in pairs, keeps the bits (examples/train_mpi.c). */
typedef struct ssdgs_sum {
    /* Makes of `count` values their sums over all processes, the same everywhere. Any result but SSDGS_OK
       ends the step, which changes nothing. A process whose step returns ERR_MEMORY must end all: it may not
       have called this, or has other Gaussians than the rest. */
    ssdgs_result (*add)(void *user, ssdgs_real *values, size_t count);
    void *user;
    int rank, processes; /* this one, 0 and up, of so many, of which `batch` is a multiple */
} ssdgs_sum;

/* Iterations marked * are of a run of 60,000; shorter runs scale them. 0 disables where nothing else is
   said. */
typedef struct ssdgs_train_options {
    int version;           /* set by ssdgs_train_options_default / _published */
    int iterations;        /* 20000: photographs drawn */
    uint64_t seed;         /* 1 */
    int schedule;          /* ssdgs_schedule: in which order the terms join; merged */
    int random_background; /* 1: photographs with transparency are laid over a new colour each step, but where
                              `background` is taken for empty only those with an outline; 0: over background;
                              1 */
    int initial_points;    /* random Gaussians in the bounds when the model is empty, no more than density
                              control makes; 10000 */
    int max_gaussians;     /* density control ends with so many at most; 0: three eighths of the pixels that
                              a photograph shows, on average, but 1,000 to 50,000; 0 */
    int densify_every;     /* 1 and up: iterations between two rounds of density control; 100 */
    int densify_from;      /* first round; 200 */
    int densify_until;     /* last round; 50000* */
    int opacity_reset_every; /* iterations; fades what is not needed; 3000 */
    int batch;  /* photographs a step, whose gradients are averaged; rates grow with its square root; 1 */
    int refine; /* SSDGS_REFINE_* mask: fit photographs' poses, their lights and intensities, and
                   settings.ambient, too; 0 */
    ssdgs_real background[3];    /* stored values: what opaque photographs show around the object; black */
    ssdgs_real dssim;            /* weight of 1 - SSIM in the loss; L1 has the rest; 0.2 */
    ssdgs_real normal_weight;    /* deferred: weight of blended normals' distance to the depth's; 0.05 */
    ssdgs_real bounds_min[3];    /* world: the box that holds the object alone; -0.5 */
    ssdgs_real bounds_max[3];    /* 0.5 */
    ssdgs_real densify_gradient; /* half images: a Gaussian pulled as hard is cloned or split; 0: all; 4e-4 */
    ssdgs_real surplus; /* 1 and up: density control makes so many times max_gaussians at first. From 0.36 to
                           0.72 of densify_until those go that the loss would miss least; 2 */
    /* A Gaussian is removed if more than this share of the photographs that see its centre show background
       there, or if none sees it; 0.02. Photographs should be transparent where the object is not. One has an
       outline if more than 1 % of its pixels, but not all, have alpha 0. Of eight outlines or more those that
       contradict the rest are ignored. With too few the pictures' borders decide: if most border pixels have
       `background`'s colour, that colour means empty, and Gaussians of it fade. Otherwise every pixel shows
       the object. The log says which. */
    ssdgs_real prune_outside;
    ssdgs_real adam_epsilon; /* Adam's, as a share of a one-byte error's gradient; 0.1; 0 = 1e-15 */
    ssdgs_real finish; /* factor of the model's rates in the last tenth of the iterations; 0.3; 1 = none */
    ssdgs_rates rates;
    ssdgs_sum sum; /* none */
} ssdgs_train_options;

SSDGS_API ssdgs_train_options ssdgs_train_options_default(void);
/* The paper's order, density control, rates and length. */
SSDGS_API ssdgs_train_options ssdgs_train_options_published(void);

typedef struct ssdgs_train_stats {
    int iteration; /* done so far */
    int gaussians;
    int shaded;        /* of a photograph in this step */
    int terms;         /* SSDGS_*_TERM mask: the schedule's so far; the others are untrained */
    int skipped_steps; /* refused so far, as a gradient was not finite */
    double loss, psnr; /* of this step's images, on average */
} ssdgs_train_stats;

/* Returns 0 to stop: ssdgs_trainer_run() then returns ERR_CANCELLED, and the model is whole. */
typedef int (*ssdgs_progress)(void *user, const ssdgs_train_stats *stats);

/* Trains model on photos; the photo structs are copied. A model of 0 Gaussians starts from random points and
   gets light_scale, centre, length_unit and new networks; one that has Gaussians goes on (with
   SSDGS_SCHEDULE_JOINT with all terms) where it was trained: a settings.placement is dropped, with a note.
   options NULL = default. Once something else has moved the model's Gaussians (ssdgs_model_sort(), another
   trainer) it neither steps, saves nor loads. */
SSDGS_API ssdgs_result ssdgs_trainer_create(ssdgs_model *model, const ssdgs_photo *photos, int photo_count,
                                            const ssdgs_train_options *options, ssdgs_trainer **out);
SSDGS_API void ssdgs_trainer_destroy(ssdgs_trainer *trainer); /* NULL is fine */
/* A step: `batch` iterations. ERR_NONFINITE: its photographs are passed over, or, where stats->iteration
   stays, the model's networks are not finite. ERR_MEMORY: nothing has changed or, where stats->iteration
   moves, density control alone is left out. ERR_CANCELLED: another process failed. */
SSDGS_API ssdgs_result ssdgs_trainer_step(ssdgs_trainer *trainer, ssdgs_train_stats *stats);
/* Steps until `iterations` are done, and calls progress (may be NULL) after each. Ten refused steps in a row
   end it. */
SSDGS_API ssdgs_result ssdgs_trainer_run(ssdgs_trainer *trainer, ssdgs_progress progress, void *user);
/* Camera and light of photograph `index` as refined so far. */
SSDGS_API ssdgs_result ssdgs_trainer_refined(const ssdgs_trainer *trainer, int index, ssdgs_camera *camera,
                                             ssdgs_light *light);

#ifndef SSDGS_NO_STDIO
/* A run's whole state: it goes on bit for bit. Load it into a trainer made with the same photographs, options
   and settings; else ERR_FORMAT names the first that differs. Only iterations, max_gaussians and rates may be
   others: the run goes on as if it had had them at its iteration, and the log tells each. */
SSDGS_API ssdgs_result ssdgs_trainer_save(const ssdgs_trainer *trainer, const char *path);
SSDGS_API ssdgs_result ssdgs_trainer_load(ssdgs_trainer *trainer, const char *path);
/* How far the run of a checkpoint had come, of how many iterations (may be NULL). ERR_IO without a file,
   ERR_FORMAT where it is no checkpoint of this version. */
SSDGS_API ssdgs_result ssdgs_checkpoint_iteration(ssdgs_context *context, const char *path, int *iteration,
                                                  int *iterations);
#endif

typedef struct ssdgs_metrics {
    double psnr, ssim; /* dB, 100 for equal images; 1 is best */
} ssdgs_metrics;
/* Compares (h,w,3) images of stored values, clamped to [0,1]. */
SSDGS_API ssdgs_result ssdgs_compare(ssdgs_context *context, const ssdgs_real *image,
                                     const ssdgs_real *reference, int width, int height,
                                     ssdgs_metrics *metrics);
/* Renders a photograph's camera and light, exactly, over `background` (stored values) and compares. image
   (h,w,3) gets stored values; may be NULL. */
SSDGS_API ssdgs_result ssdgs_evaluate(ssdgs_model *model, const ssdgs_photo *photo,
                                      const ssdgs_real background[3], ssdgs_real *image,
                                      ssdgs_metrics *metrics);
/* Fits photo's camera and light to its pixels by so many steps of Adam, the model fixed. How baked and kept
   colours change with the view is not followed. ERR_ARGUMENT: it has a settings.placement. */
SSDGS_API ssdgs_result ssdgs_refine_photo(ssdgs_model *model, ssdgs_photo *photo,
                                          const ssdgs_real background[3], int iterations);
#endif /* SSDGS_NO_TRAINER */

#ifdef __cplusplus
}
#endif
#endif /* SSDGS_H */

#if (defined(SSDGS_STAGES) || defined(SSDGS_IMPLEMENTATION)) && !defined(SSDGS__STAGES_H)
#define SSDGS__STAGES_H
#ifdef __cplusplus
extern "C" {
#endif

/* ==== raw arrays of a model, seen with SSDGS_STAGES ==== */

/* clang-format off */
/* The first plane of each of a Gaussian's raw parameters. */
enum {
    SSDGS_POSITION = 0, SSDGS_ROTATION = 3, SSDGS_LOG_SCALE = 7, SSDGS_OPACITY = 10, SSDGS_DIFFUSE = 11,
    SSDGS_SPECULAR = 14, SSDGS_SCATTERING = 17, SSDGS_FRAME = 20, SSDGS_ASG_WEIGHT = 24, SSDGS_MATERIAL = 32,
    SSDGS_CHANNELS = 38,
    SSDGS_HARMONICS = 14 /* of baked models: there SSDGS_DIFFUSE has f_dc, and from here on lies f_rest, as in
                            other programs' files: all of red first, then green, then blue */
};
/* clang-format on */

/* The raw arrays, valid until the model changes. Call ssdgs_model_arrays() before each round of writing: it
   is how rendering knows that what it has cached is out of date. */
typedef struct ssdgs_model_view {
    int count;     /* Gaussians */
    size_t stride; /* reals from one plane to the next */
    int channels;  /* planes: SSDGS_CHANNELS; baked: SSDGS_HARMONICS + 0, 9, 24 or 45; with settings.kept
                      SSDGS_CHANNELS + 3 (f_dc) + 0, 9, 24 or 45 (f_rest) */
    ssdgs_real *gaussians;     /* (channels, stride): scale = exp, opacity = sigmoid, colours and weights =
                                  softplus; deferred, ssdgs_gaussian's specular is c_s sqrt(lambda mu) */
    ssdgs_real *asg_basis;     /* (SSDGS_ASG_COUNT, 4) quaternions w x y z */
    ssdgs_real *asg_sharpness; /* (SSDGS_ASG_COUNT, 2) log lambda, log mu; deferred: log s, logit t */
    ssdgs_real *asg_sigma;     /* (SSDGS_ASG_COUNT) deferred: a before softplus; else unused */
    ssdgs_real *scattering;    /* per layer: (out, in) weights, row-major, then (out) biases */
    size_t scattering_count;
    ssdgs_real *shadow;
    size_t shadow_count;
} ssdgs_model_view;
SSDGS_API ssdgs_model_view ssdgs_model_arrays(ssdgs_model *model);
/* The same to read alone: what frames have kept stays. */
SSDGS_API ssdgs_model_view ssdgs_model_peek(const ssdgs_model *model);

/* ==== stages of a frame, seen with SSDGS_STAGES: for GPUs and engines that run some of their own ====

   ssdgs_context_desc.gpu replaces stages; NULL leaves one to the CPU. A stage reads and writes the
   ssdgs_frame as its members say. examples/gpu replaces all that a rendering takes.

   What a stage writes in ssdgs_splat_view has no memory before it: a hook points the members at its own. All
   else has memory. A hook need not write there what it keeps on a device: before the CPU reads what hooks may
   have left it calls fetch. frame.memory says whose frame it is, a model's or a scene's; models have
   revisions; `released` hears when one of either is gone.

   The stages up to WALK run for the views of frame.batch, then perhaps for more views. For a view
   that is `cached` these stages have found all that they would find, in `seen` and the light's rows too, and
   leave it as it is; those up to BIN also where `cached` is 1. So what a hook has left for a view stays
   until that stage works on the view again, or the memory is released. Where it is lost, PROJECT clears
   `cached`.

   A result other than SSDGS_OK ends the frame, of which nothing is kept; ssdgs_context_fail() says why.

   Where layer_count is not 0, light is deferred: WALK fills the light maps, SHADE the layers, and COMPOSITE
   adds the diffuse and specular terms of what they blend to. An image's components are the CPU's work. It
   reads layer_pixels and pixel_shadow or, where layer_count is 0, view 0's record, depth, order, tile_start,
   tile_list and tile_seen. In training SHADE and SHADE_BACKWARD are replaced together or not at all: the CPU
   keeps activations in between.

   What the CPU's stages agree on, and stages beside them must, is in examples/gpu/STAGES.md. */

typedef enum ssdgs_stage {
    SSDGS_STAGE_PROJECT = 0, /* Gaussians -> records and depths of every view */
    SSDGS_STAGE_SORT,        /* -> order, nearest first */
    SSDGS_STAGE_BIN,         /* -> instances and tile lists */
    SSDGS_STAGE_WALK,        /* -> seen (camera), visibility, depth_cue, flux, light_map (lights) */
    SSDGS_STAGE_SHADE,       /* -> color, layers or the components asked for */
    SSDGS_STAGE_COMPOSITE,   /* -> pixels, layer_pixels, transmittance, pixel_visibility, pixel_shadow */
    SSDGS_STAGE_COMPOSITE_BACKWARD, /* pixel_gradient, normal_gradient -> splat_gradient, color_gradient,
                                       layer_gradient; sets the shared gradients */
    SSDGS_STAGE_SHADE_BACKWARD, /* color_gradient, layer_gradient -> gradient; adds to the shared gradients */
    SSDGS_STAGE_PROJECT_BACKWARD, /* splat_gradient -> gradient, view_gradient */
    SSDGS_STAGE_COUNT
} ssdgs_stage;

struct ssdgs_frame;
typedef struct ssdgs_gpu_hook { /* set to 0 first */
    ssdgs_result (*stage[SSDGS_STAGE_COUNT])(void *user, struct ssdgs_frame *frame);
    void *user;
    /* Brings to host memory what the CPU is about to read: what `stage` reads of earlier ones; with
       SSDGS_STAGE_COUNT what frame.last, the last of a run, has left. That is, after COMPOSITE, what
       frame.image and frame.statistics ask for; without an image, and after other stages, all. NULL: it is
       there. */
    ssdgs_result (*fetch)(void *user, struct ssdgs_frame *frame, ssdgs_stage stage);
    /* A model, or the memory of some frames (frame.memory), is gone. NULL: nobody listens. So user must live
       until the context and all that was made on it are gone. */
    void (*released)(void *user, const void *gone);
} ssdgs_gpu_hook;

/* dL/d(x, y); 2 ln(2) times the sums of u^2, u w, w^2 x dL/d(ln alpha); dL/d(ln opacity); the sum of blend
   weights; dL/d(camera depth) */
#define SSDGS_SPLAT_GRADIENTS 8

typedef struct ssdgs_tile_entry {
    uint32_t gaussian, mask; /* bits: which of the tile's 4x4 micro-tiles it can touch */
} ssdgs_tile_entry;

/* One Gaussian in one tile. A Gaussian's instances are neighbours, from number `first` on. */
typedef struct ssdgs_instance {
    uint32_t place, mask;
} ssdgs_instance; /* index in tile_list; mask as there */
typedef struct ssdgs_instances {
    uint32_t first, count;
} ssdgs_instances;

enum { SSDGS_SEEN = 1, SSDGS_SKIPPED = 2 }; /* to be shaded; blended, but within max_error in every pixel */

/* A Gaussian projected: at pixel (x + dx, y + dy) alpha is 2^(log2_opacity - u^2 - w^2), with u = ux dx + uy
   dy and w = wy dy. (ux, uy; 0, wy) is the Cholesky factor of log2(e) / 2 times the conic (eq. 1): far along
   a needle rounding would spoil the conic's own sum, but not a sum of squares. */
typedef struct ssdgs_record {
    ssdgs_real x, y;       /* px: the centre */
    ssdgs_real ux, uy, wy; /* 1 / px */
    ssdgs_real log2_opacity;
    ssdgs_real extent_x, extent_y; /* px: half the box that it touches */
} ssdgs_record;

/* A pixel of a light's map: where on its way the transmittance falls. */
typedef struct ssdgs_light_pixel {
    ssdgs_real
        distance[3]; /* at which it falls below 0.98, 0.5, 0.1, less the nearest Gaussian's; 1e30: nowhere */
    ssdgs_real left[2];   /* what is left after the first two steps */
    ssdgs_real before[2]; /* what there was before the last two */
    ssdgs_real behind;    /* what is left behind all */
} ssdgs_light_pixel;

/* One projection of the model: view 0 is the camera, the others are faces of the lights' maps. Of these all
   but light_map, map_tile and nearest is gone once others of the frame have taken the memory. */
typedef struct ssdgs_splat_view {
    int light;            /* -1: the camera */
    int width, height;    /* px */
    int tiles_x, tiles_y; /* of 16x16 px */
    int orthographic;
    ssdgs_real distance; /* of a point light seen as a parallel one, else 1 */
    int by_distance;     /* order by distance, not by depth */
    int compensate;      /* opacity compensated for the blur */
    int blur;            /* ssdgs_blur */
    ssdgs_real variance; /* px^2, of the blur */
    ssdgs_real fx, fy, cx, cy, view[12], near_plane;
    int cached; /* 1: everything up to SSDGS_STAGE_BIN is an earlier frame's, 2: up to SSDGS_STAGE_WALK */
    /* SSDGS_STAGE_PROJECT */
    ssdgs_record *record; /* (n) */
    ssdgs_real *depth;    /* (n) camera depth or distance to the light; negative = not drawn, see
                             ssdgs_camera.near_plane */
    ssdgs_real *slope; /* (n, 2) of the camera, where pixels ask how deep it is there: depth + slope . (u, w),
                          its mean depth there. NULL: they do not */
    /* SSDGS_STAGE_SORT */
    uint32_t *order; /* (visible) the Gaussians drawn, all of them: nearest first, ties by index */
    int visible;
    /* SSDGS_STAGE_BIN */
    size_t instance_room;         /* instance numbers in use, with gaps */
    size_t instances;             /* without the gaps */
    ssdgs_instance *instance;     /* (instance_room) */
    ssdgs_instances *of_gaussian; /* (n) none where not drawn */
    uint32_t *tile_start;         /* (tiles + 1) places in tile_list */
    ssdgs_tile_entry *tile_list;  /* (instances) per tile, nearest first */
    /* SSDGS_STAGE_WALK, camera */
    uint16_t *tile_seen;        /* (instances) which micro-tiles blend it */
    unsigned char *tile_needed; /* (instances) it must be shaded; NULL: where it is seen */
    /* SSDGS_STAGE_WALK and SSDGS_STAGE_COMPOSITE_BACKWARD */
    ssdgs_real *tile_sums; /* (instances, 4 of a light's walk or 8 + 4 (1 + layer_count) of the backward) */
    ssdgs_light_pixel *light_map; /* a light's: (tiles with Gaussians, 16 micro-tiles, 16 pixels), rows first.
                                     NULL: not wanted */
    uint32_t *map_tile;           /* (tiles) a tile's number in light_map; UINT32_MAX: it has no Gaussian */
    ssdgs_real nearest;           /* depth of the nearest Gaussian, 0 without any: set by SSDGS_STAGE_SORT */
} ssdgs_splat_view;

/* A model in a frame. Its Gaussian i is Gaussian first + i of the frame. */
typedef struct ssdgs_placed {
    ssdgs_model *model;
    uint64_t revision; /* of the model */
    ssdgs_settings settings;
    ssdgs_model_view gaussians;
    int first;                                /* a multiple of 64; the gaps that this leaves are not drawn */
    int terms;                                /* to render, after settings and options */
    int light_count;                          /* the frame's; 0 where no light changes it */
    int turned;                               /* 0: rotation is the identity */
    ssdgs_real rotation[9], scale, offset[3]; /* point p -> scale rotation p + offset; it may mirror */
    uint64_t key; /* of revision, first, rotation, scale, offset, presence: equal where these are */
    double middle[3], radius; /* world: a ball around what it draws; no use with one object alone */
    ssdgs_real tint[3], roughness, specular, translucency, kept, presence;
    ssdgs_real medium[15];       /* RGB weights of true transport's lengths, where a medium scatters */
    const unsigned char *mask;   /* as in ssdgs_object */
    int material;                /* pixels blend and light the layers of each material by themselves */
    const ssdgs_real *sky_share; /* what of ambient light comes to each Gaussian; NULL: there is none */
} ssdgs_placed;

typedef struct ssdgs_frame {
    ssdgs_context *context;
    ssdgs_model *model; /* this and the next two: the first object's that is not baked, or the first's */
    ssdgs_settings settings;
    ssdgs_model_view gaussians;
    ssdgs_placed *objects; /* in training one */
    int object_count;
    int count;                 /* Gaussians of all objects and the gaps between them; n below */
    const uint16_t *object_of; /* (n / 64) of 64 Gaussians; NULL: of the first */
    int material_count;
    const uint16_t *material_of; /* (n / 64) of 64 Gaussians; NULL: all are of one material */
    ssdgs_camera camera;
    ssdgs_render_options options;
    ssdgs_real eye[3]; /* the camera's centre */
    const ssdgs_light *lights;
    int light_count;
    int terms;             /* to render, of any object */
    ssdgs_real bias[2];    /* world units: the largest light_map.bias, of Gaussians and of pixels */
    ssdgs_real near_plane; /* world units: of cameras that name none */
    int training;          /* 1: network activations are kept for the backward */
    int frozen[2];         /* 1: no gradient of the scattering, the shadow network's weights */
    ssdgs_splat_view *views;
    int view_count;
    int batch[2];               /* views at work in the stages up to WALK: from, to before */
    ssdgs_stage last;           /* stage of this run */
    const ssdgs_image *image;   /* what is asked for; NULL: planes of the frame */
    int statistics;             /* 1: asked for; read from seen, color, views[0] */
    const unsigned char *reach; /* (1 + lights, objects) 0: out of reach of the camera, of a light: what
                                   stages find of its Gaussians there is not read; NULL: all are within */
    /* SSDGS_STAGE_WALK */
    size_t light_instances; /* of all lights' views that were walked */
    unsigned char *seen;    /* (n) SSDGS_SEEN, SSDGS_SKIPPED or 0 */
    ssdgs_real *visibility; /* (lights, n) eq. 7; of a light without views neither this nor the next two */
    /* These two are NULL, and not computed, unless settings ask or the stages' caller sets them. */
    ssdgs_real *depth_cue; /* (lights, n) world units */
    ssdgs_real *flux;      /* (lights, n) intercepted, sr per unit intensity, directional: area */
    /* SSDGS_STAGE_SHADE */
    uint32_t *shaded; /* (shaded_count) Gaussians seen, ascending */
    int shaded_count;
    ssdgs_real *color;  /* (n, 4); the fourth: 1 where one was not finite, so black */
    int layer_count;    /* 0, or 4 + 3 light_count: light is deferred, color is scattering alone */
    ssdgs_real *layers; /* (layer_count, n, 4) Q's xx, yy, zz; xy, yz, zx; camera depth, F0, 1; normal; of
                           each light M; D; the shadow network's answer, v_g, softness */
    ssdgs_real *diffuse, *specular, *scattering, *normal,
        *shadow; /* (n, 4) each; shadow: S, depth; NULL: light is deferred */
    /* SSDGS_STAGE_COMPOSITE */
    ssdgs_real *pixels;        /* (3, h, w) without background */
    ssdgs_real *layer_pixels;  /* (1 + layer_count, 3, h, w) the colour and the layers, blended; 0 where
                                  nothing is; for components. In training, where pixel_shadow is NULL, it
                                  is (2, 3, h, w): camera depth, F0, 1; normal */
    ssdgs_real *transmittance; /* (h, w) */
    unsigned char *empty; /* (tiles) 0 as COMPOSITE begins; 1: there is nothing, and the planes say nothing;
                             NULL: they do everywhere */
    ssdgs_real *median_depth;      /* (h, w) as in ssdgs_image; NULL: not asked for */
    const ssdgs_real *scene_depth; /* (h, stride) as in ssdgs_image; for WALK and COMPOSITE */
    int stride;
    ssdgs_real *pixel_visibility,
        *pixel_shadow; /* (lights, h, w) v, S where light is deferred; for components. In training v is there
                          for visibility_given alone */
    const ssdgs_occluder
        *occluder;        /* NULL, or with neither callback nor maps: none; for WALK and COMPOSITE */
    int maps;             /* 1: light maps are asked for, whoever needs them */
    int visibility_given; /* 1: pixel_visibility is the caller's, held fixed or of rays traced by other
                             means */
    /* backward */
    ssdgs_real *pixel_gradient; /* (4, h, w) dL/d(pixels), dL/d(transmittance) */
    ssdgs_real
        *normal_gradient; /* (4, h, w) dL/d(the normals' layer), dL/d(its alpha, the ones' layer); NULL = 0 */
    ssdgs_real *splat_gradient; /* (n, SSDGS_SPLAT_GRADIENTS) */
    ssdgs_real *color_gradient; /* (n, 4) */
    ssdgs_real *layer_gradient; /* (layer_count, n, 4) */
    ssdgs_real *gradient;       /* (SSDGS_CHANNELS, stride) */
    ssdgs_real
        *global_gradient; /* as the model's globals: ASG quaternions, sharpness, sigma, scattering, shadow */
    ssdgs_real light_gradient[3];   /* position of light 0; of a directional one, the vector towards it */
    ssdgs_real ambient_gradient[3]; /* options.ambient[0] */
    double intensity[2]; /* how far ln of its intensity is from fitting the photograph; how sure that is */
    ssdgs_real view_gradient[12]; /* camera.view */
    struct ssdgs__frame_memory *memory;
    struct ssdgs__scratch *scratch;
} ssdgs_frame;

/* Runs the CPU's version of a stage: what a hook calls where it cannot. */
SSDGS_API ssdgs_result ssdgs_stage_cpu(ssdgs_frame *frame, ssdgs_stage stage);
/* Makes `message` that of the context, tells its log, and returns `result`: for hooks, and what is built on
   the library. */
SSDGS_API ssdgs_result ssdgs_context_fail(ssdgs_context *context, ssdgs_result result, const char *message);

#ifdef __cplusplus
}
#endif
#endif /* SSDGS_STAGES */

/* Stop here if you only want the interface. */

#if defined(SSDGS_IMPLEMENTATION) && !defined(SSDGS__IMPLEMENTED)
#define SSDGS__IMPLEMENTED

/* ==== >>config  what this compiler and CPU can do ==== */

/* Reads the compiler's macros. Defines which kernels are built, all limits and clamps, and the structs
   that kernels are called with. */

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef SSDGS_ASSERT
#define SSDGS_ASSERT(condition) ((void)0) /* invariants: a bug of the library's where one is false */
#endif

#ifndef SSDGS_SELF
#define SSDGS_SELF "ssdgs.h" /* how this file includes itself: keep its name, or define this */
#endif

/* Rounding must not depend on the user's flags: fuse multiplications and additions only where V_FMA says
   so. */
#if defined(__clang__)
#if __clang_major__ >= 12
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wignored-pragmas" /* of machines without float_control */
#pragma float_control(precise, on, push)             /* which lets expressions fuse */
#pragma clang diagnostic pop
#ifdef __FAST_MATH__
#pragma clang fp reassociate(off) /* for those machines */
#endif
#endif
#pragma STDC FP_CONTRACT OFF
#elif SSDGS__GNUC
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off", "no-fast-math")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif

#if SSDGS__GNUC || defined(__clang__)
#define SSDGS__INLINE inline __attribute__((always_inline))
#define SSDGS__ATTRIBUTE(target_string) __attribute__((target(target_string)))
#define SSDGS__PREFETCH(p) __builtin_prefetch(p)
#define SSDGS__UNUSED __attribute__((unused))
#define SSDGS__FORMAT(n) __attribute__((format(__printf__, n, n + 1))) /* the compiler looks at arguments */
#if defined(__clang__)
#define SSDGS__UNROLL _Pragma("clang loop unroll(full)")
#define SSDGS__UNROLL_SCALAR /* its vectoriser does better */
#elif __GNUC__ >= 8
#define SSDGS__UNROLL _Pragma("GCC unroll 16")
#define SSDGS__UNROLL_SCALAR \
    _Pragma("GCC unroll 4") /* sixteenfold is slower, and half of the time to compile */
#endif
#else
#ifdef _MSC_VER
#define SSDGS__INLINE __forceinline
#else
#define SSDGS__INLINE inline
#endif
#define SSDGS__ATTRIBUTE(target_string)
#define SSDGS__PREFETCH(p) ((void)(p))
#define SSDGS__UNUSED
#define SSDGS__FORMAT(n)
#endif
#ifndef SSDGS__UNROLL
#define SSDGS__UNROLL
#define SSDGS__UNROLL_SCALAR
#endif
#ifdef SSDGS_NO_TRAINER
#define SSDGS__TRAINING SSDGS__UNUSED /* what only training calls is left out by the compiler */
#define SSDGS__TRAINS(kernel) NULL
#else
#define SSDGS__TRAINING
#define SSDGS__TRAINS(kernel) kernel
#endif
/* Of the kernels, by their instruction set */
#define SSDGS__FN static SSDGS__TRAINING SSDGS__TARGET
#define SSDGS__FI static SSDGS__INLINE SSDGS__TARGET
#define SSDGS__NV (16 / SSDGS__VW) /* vectors in a 4x4 micro-tile */

/* Code that takes no time of a frame or a training step is compiled to be small: SSDGS__SMALL_BEGIN ..
   _END. */
#if defined(__clang__)
#define SSDGS__SMALL_BEGIN _Pragma("clang attribute push(__attribute__((minsize)), apply_to = function)")
#define SSDGS__SMALL_END _Pragma("clang attribute pop")
#elif SSDGS__GNUC >= 8 && defined(__OPTIMIZE__)
#define SSDGS__SMALL_BEGIN _Pragma("GCC push_options") _Pragma("GCC optimize(\"Os\")")
#define SSDGS__SMALL_END _Pragma("GCC pop_options")
#else
#define SSDGS__SMALL_BEGIN
#define SSDGS__SMALL_END
#endif

#define SSDGS__ISA_SCALAR 1
#define SSDGS__ISA_SSE2 2
#define SSDGS__ISA_WASM 3
#define SSDGS__ISA_AVX2 4
#define SSDGS__ISA_AVX512 5
#define SSDGS__ISA_NEON 6

#if !defined(SSDGS_NO_SIMD) && !defined(SSDGS_REAL64) && (SSDGS__GNUC || defined(_MSC_VER))
/* Not _M_IX86: Microsoft's compiler of 32 bits takes three vectors by value at most. */
#if defined(__x86_64__) || defined(_M_X64) || defined(__i386__)
#if defined(__MINGW32__) && !defined(__clang__) && !defined(__OPTIMIZE__)
#define SSDGS__X86 1 /* its 16-byte stack cannot hold spilled AVX vectors: SSE2 alone */
#elif defined(SSDGS_NO_AVX2)
#define SSDGS__X86 1
#elif defined(SSDGS_NO_AVX512)
#define SSDGS__X86 2
#else
#define SSDGS__X86 3
#endif
#elif defined(__aarch64__) || defined(_M_ARM64)
#define SSDGS__NEON 1
#elif defined(__wasm_simd128__)
#define SSDGS__WASM 1
#endif
#endif
#ifndef SSDGS__X86
#define SSDGS__X86 0
#endif
#ifndef SSDGS__NEON
#define SSDGS__NEON 0
#endif
#ifndef SSDGS__WASM
#define SSDGS__WASM 0
#endif
#if defined(SSDGS_SCALAR) || \
    !(SSDGS__NEON || SSDGS__WASM || (SSDGS__X86 && (defined(__x86_64__) || defined(_M_X64))))
#define SSDGS__SCALAR 1
#else
#define SSDGS__SCALAR 0 /* every CPU that this is compiled for has SSE2, NEON or SIMD128 */
#endif

#if SSDGS__X86
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized" /* g++ on its own avx512fintrin.h */
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif
#include <immintrin.h>
#if defined(__clang__) && defined(_MSC_VER) /* clang-cl hides these without -mavx512f */
#include <smmintrin.h>
#include <avxintrin.h>
#include <avx2intrin.h>
#include <fmaintrin.h>
#include <avx512fintrin.h>
#endif
#if defined(_MSC_VER)
#include <intrin.h>
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
#endif
#if SSDGS__NEON
#include <arm_neon.h>
#endif
#if SSDGS__WASM
#include <wasm_simd128.h>
#endif

#if defined(_WIN32)
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
#elif !defined(SSDGS_NO_THREADS)
#include <pthread.h>
#include <unistd.h>
#endif

#ifdef SSDGS_REAL64
#define SSDGS__SQRT(x) sqrt(x)
#define SSDGS__MOST DBL_MAX
#else
#define SSDGS__SQRT(x) sqrtf(x)
#define SSDGS__MOST FLT_MAX
#endif

#define SSDGS__BLOCK 64 /* Gaussians shaded together */
#define SSDGS__AHEAD 12 /* how far ahead loops prefetch, in ranks or tile entries */
#define SSDGS__BATCH 64 /* tile entries walked together: bits of a word */
#define SSDGS__SPLAT SSDGS_SPLAT_GRADIENTS
#define SSDGS__SLOTS \
    16 /* partial sums of shared gradients: fixed, so that threads cannot change the result */
#define SSDGS__GLANCES 2000         /* of a thread before it sleeps: about 0.1 ms on x86 */
#define SSDGS__BAND 16              /* image rows of a task */
#define SSDGS__CHUNK 1024           /* Gaussians projected by one task */
#define SSDGS__BIN_CHUNKS 64        /* tasks that make a view's tile lists */
#define SSDGS__SORT_WORDS (1 << 12) /* of a histogram */
#ifndef SSDGS__BATCH_BYTES
#define SSDGS__BATCH_BYTES ((size_t)1 << 28) /* of views walked together, 80 a Gaussian */
#endif
#define SSDGS__SOFT 0.02     /* true dipole transport, length units: distances are sqrt(r^2 + soft^2) */
#define SSDGS__LENGTHS 5     /* of true dipole transport: 0.04, 0.08 .. 0.64 length units */
#define SSDGS__SHORTEST 0.04 /* the first of them */
#define SSDGS__SERIES 10     /* coefficients of a series to second order in x, y, z */
#define SSDGS__SOURCES 512   /* of light, gathered for a kernel */
#define SSDGS__ALPHA_MAX 0.999
#define SSDGS__RAW_LIMIT 20 /* log scales and logits of opacities are clamped to +-20 */
#define SSDGS__SHARE \
    ((ssdgs_real)0.03125) /* of max_error, the most that one splat may take: fringes would use it up */
#define SSDGS__F0 0.04    /* Schlick */
#define SSDGS__HARMONIC 0.28209479177387814 /* a baked colour is 0.5 + this x f_dc + what f_rest gives */
#define SSDGS__F0_LOGIT -3.1780538303479458
#define SSDGS__SHARPEST 12             /* |log lambda|, |log mu| of deferred lobes at most */
#define SSDGS__THIN ((ssdgs_real)1e-6) /* alpha below which nothing is divided by it */
#define SSDGS__SOLID ((ssdgs_real)0.5) /* alpha from which on a pixel's depth is a surface's */
#define SSDGS__MAX_GAUSSIANS (1 << 28)
#define SSDGS__MAX_SIDE (1 << 15) /* px of an image */
#define SSDGS__MOST_LIGHT 1e30    /* of light_scale */
#define SSDGS__NEVER ((ssdgs_real)1e30)
#define SSDGS__MAP_STEPS 3 /* levels of transmittance below which a light's map says where it falls */
#define SSDGS__LANE_SUMS (6 + 12 * SSDGS_ASG_COUNT)
#define SSDGS__GRAZING ((ssdgs_real)0.25) /* wo.h of deferred highlights at least */
#define SSDGS__TILE_FOURTH \
    48 /* where in a micro-tile's 64 values the last 16 are: transmittance, or the gradients' product */
#define SSDGS__TILE_LAYER 1024 /* values of a layer in a tile: [micro-tile][3 values, one more][16 lanes] */
#define SSDGS__LOBE 11         /* rows: Q (6), normal (3), F0, how soft its shadow is */
#define SSDGS__HIGHLIGHT_SUMS \
    (15 + 3 * SSDGS_ASG_COUNT) /* light, eye, rays x camera rays (9), log s with logit t, raw a */
/* A Gaussian beside the picture that is deep, that reaches far along z, would by its affine projection cover
   the picture. So its opacity fades with its slopes x / z and y / z: from the picture's border on, but not
   below slopes of STEEP, so that parts of pictures of 90 degrees agree. It is not deep where its variance
   along z is below BACK x z^2, and wholly so from FAR_BACK x z^2 on. */
#define SSDGS__STEEP 1
#define SSDGS__BACK 0.02
#define SSDGS__FAR_BACK 0.06

/* Layers of three values that pixels blend: the colour and, where light is deferred, what lights it. */
enum {
    SSDGS__COLOUR_LAYER,
    SSDGS__Q_LAYER,         /* the lobe's Q: six values, two layers */
    SSDGS__DEPTH_LAYER = 3, /* depth, F0, 1: the last blends to the cover */
    SSDGS__NORMAL_LAYER,
    SSDGS__LIGHT_LAYER, /* the first light's, others follow: the specular term without its lobes */
    SSDGS__DIFFUSE_LAYER,
    SSDGS__SHADOW_LAYER, /* the shadow network's output, v, how soft the shadow is */
    SSDGS__LAYERS,       /* blended in one walk */
    SSDGS__PER_LIGHT = SSDGS__LAYERS - SSDGS__LIGHT_LAYER
};

/* Rows of a block's geometry */
enum {
    SSDGS__WI = 0,
    SSDGS__WO = 3,
    SSDGS__NORMAL = 6,
    SSDGS__IRRADIANCE = 9,
    SSDGS__COSINE,
    SSDGS__GLOSS,
    SSDGS__ROWS,
    /* of what a Gaussian gives: RGB of each term, S */
    SSDGS__OUT_DIFFUSE = 0,
    SSDGS__OUT_SPECULAR = 3,
    SSDGS__OUT_SCATTERING = 6,
    SSDGS__OUT_SHADOW = 9,
    SSDGS__OUTS = 10,
    /* of a deferred lobe, after the six of Q */
    SSDGS__LOBE_NORMAL = 6,
    SSDGS__LOBE_FRESNEL = 9,
    SSDGS__LOBE_SOFTNESS = 10
};

/* ---- what the kernels are called with ---- */

typedef struct ssdgs__projection {
    ssdgs_real view[12], fx, fy, cx, cy, near_plane, log2_threshold, variance, depth_scale, presence;
    int width, height, orthographic, by_distance, compensate, blur;
} ssdgs__projection;

typedef struct ssdgs__tile {
    const ssdgs_record *record;
    const ssdgs_real *depth, *slope;
    const ssdgs_tile_entry *list; /* (count) */
    const uint16_t *seen;         /* (count) micro-tiles that the walk saw blend, NULL before it */
    uint32_t count;
    int x, y, width, height;
    ssdgs_real log2_threshold, stop, max_error, bias, depth_origin, cx, cy, inverse_focal;
    int cue, flux, orthographic;  /* 1: a light's walk finds depth_cue, flux; the view is orthographic */
    ssdgs_light_pixel *light_map; /* of the tile, or NULL */
    const ssdgs_instances *of_gaussian; /* of a light's only view, or NULL */
    const ssdgs_real *scene_depth;      /* [micro-tile][16 lanes] entries must be nearer, or NULL */
    ssdgs_real *median; /* [micro-tile][64] in the first 16 lanes where it falls below 1/2, or NULL */
    const uint16_t *material_of; /* NULL: layers are those of all; else of `material` alone */
    int material;
} ssdgs__tile;

typedef struct ssdgs__product {
    ssdgs_real *out;
    const ssdgs_real *a, *b, *bias, /* (rows) */
        *start,                     /* as out: sums go on from it; NULL: from the bias */
        *mask;                      /* as out: results where it is not positive become 0 */
    size_t out_stride, a_row, a_k, b_stride;
    const uint16_t *row_list, *depth_list; /* (rows), (depth) */
    int rows, columns, depth, accumulate, relu;
} ssdgs__product;

/* Of a depth, multiplied out before the inner loop. */
typedef struct ssdgs__offsets {
    uint32_t a, b;
} ssdgs__offsets;

typedef struct ssdgs__lighting {
    ssdgs_real light[3], eye[3], intensity[3], least_distance2, virtual_depth, kept;
    ssdgs_real basis[12 * SSDGS_ASG_COUNT]; /* deferred: t, s, a, da/d(raw a) at 8 .. 11 of each 12 */
    int directional, printed_dipole, diffuse, specular, shadow, scattering;
    int residual_shadow, refined_shadow, per_channel_optics, shadow_on_scattering, deferred;
    ssdgs_real view[12], inverse_fx, inverse_fy, cx, cy; /* of the camera */
} ssdgs__lighting;

/* Gradients of a projection: dL/d(splat) (n, SSDGS__SPLAT) in, those of the planes added to, of the view (12)
   written. */
typedef struct ssdgs__project_gradient {
    const ssdgs_real *splat;
    ssdgs_real *planes;
    size_t stride;
    ssdgs_real *view;
} ssdgs__project_gradient;

/* A network's layers: sizes (layers + 1), and per layer (out, in) weights, then (out) biases. */
typedef struct ssdgs__network {
    const int *sizes;
    int layers;
    const ssdgs_real *weights;
} ssdgs__network;

/* A block under one light, rows of SSDGS__BLOCK: what its colour is made of, and the gradients. */
typedef struct ssdgs__colour_in {
    const ssdgs_real *gauss;      /* (SSDGS_CHANNELS) raw parameters */
    const ssdgs_real *geometry;   /* (SSDGS__ROWS) */
    const ssdgs_real *visibility; /* (1) */
    const ssdgs_real *shadow;     /* (1) the shadow network's output, or NULL */
    const ssdgs_real *optics;     /* (3 or 7) the scattering network's, or NULL */
    const ssdgs_real *kept;       /* (4) kept colours and the share that is the light's, or NULL */
} ssdgs__colour_in;
typedef struct ssdgs__colour_gradient {
    const ssdgs_real *color, *diffuse,
        *specular;        /* (3) in; the last two are color unless light is deferred */
    ssdgs_real *gauss;    /* added to */
    ssdgs_real *geometry; /* irradiance, f_d, f_s are written, as all that follow */
    ssdgs_real *shadow, *optics, *visibility;
} ssdgs__colour_gradient;

/* A row of SSIM: pointers to its column 0 in planes of a stride, with borders of 5 rows and 16 columns. */
typedef struct ssdgs__ssim_row {
    const ssdgs_real *image, *reference;
    ssdgs_real *d_mean, *d_square,
        *d_product;      /* d(SSIM)/d(mean, E[i^2], E[ij]): out, then in of the backward */
    ssdgs_real *scratch; /* 5 rows */
    size_t stride;
    int width;
} ssdgs__ssim_row;

/* Adam's numbers for a group of parameters: learning rate, bias corrections of mean and square, epsilon. */
typedef struct ssdgs__adam_rate {
    ssdgs_real rate, correct_mean, correct_square, epsilon;
} ssdgs__adam_rate;

/* Every kernel once: K(result, name, arguments), T where only training asks for it. */
/* clang-format off */
#define SSDGS__KERNELS(K, T) \
    K(void, project, (const ssdgs__projection *view, const ssdgs_real *gaussians, size_t stride, \
        size_t begin, size_t end, ssdgs_record *record, ssdgs_real *depth, ssdgs_real *slope)) \
    T(void, project_backward, (const ssdgs__projection *view, const ssdgs_real *gaussians, size_t stride, \
        size_t begin, size_t end, const ssdgs__project_gradient *d)) \
    K(uint32_t, bin, (const ssdgs_splat_view *view, const uint16_t *boxes, ssdgs_real log2_threshold, \
        int begin, int end, uint32_t at)) \
    K(void, walk_camera, (const ssdgs__tile *tile, uint16_t *blends, unsigned char *needed)) \
    K(void, walk_light, (const ssdgs__tile *tile, ssdgs_real *sums)) \
    K(void, places, (const ssdgs__lighting *lighting, const ssdgs__tile *tile, int micro, \
        const ssdgs_real *depth, const ssdgs_real *asked, ssdgs_real *ray, ssdgs_real *at)) \
    K(int, map_transmittance, (const ssdgs_splat_view *map, ssdgs_real bias, const ssdgs_real *at, \
        ssdgs_real *passed, ssdgs_real *slope)) \
    K(void, composite, (const ssdgs__tile *tile, int layers, const ssdgs_real *const *color, \
        ssdgs_real *pixels)) \
    T(void, composite_backward, (const ssdgs__tile *tile, int layers, const ssdgs_real *const *color, \
        const ssdgs_real *pixels, ssdgs_real *scratch, ssdgs_real *sums, size_t stride, int slot)) \
    K(void, highlight, (const ssdgs__lighting *lighting, const ssdgs__tile *tile, ssdgs_real *layers, \
        ssdgs_real *visibility)) \
    T(void, highlight_backward, (const ssdgs__lighting *lighting, const ssdgs__tile *tile, \
        const ssdgs_real *layers, const ssdgs_real *visibility, ssdgs_real *gradient, ssdgs_real *sums)) \
    K(void, lobe, (const ssdgs_real *gauss, ssdgs_real *rows)) \
    T(void, lobe_backward, (const ssdgs_real *gauss, const ssdgs_real *drows, ssdgs_real *dgauss)) \
    K(void, transport, (const ssdgs_real *sources, int count, const ssdgs_real *x, \
        const ssdgs_real *scale, ssdgs_real *sums)) \
    K(void, expand, (const ssdgs_real *sources, int count, const ssdgs_real *middle, \
        const ssdgs_real *scale, ssdgs_real *series)) \
    K(void, series, (const ssdgs_real *series, const ssdgs_real *middle, const ssdgs_real *x, int lanes, \
        ssdgs_real *sums)) \
    K(void, dense, (const ssdgs__product *product)) \
    K(int, live_rows, (const ssdgs_real *rows, int count, uint16_t *list)) \
    T(void, transpose, (const ssdgs_real *rows, int count, size_t padded, size_t stride, ssdgs_real *out)) \
    T(void, row_sums, (ssdgs_real *sums, size_t stride, const ssdgs_real *rows, const uint16_t *list, \
        int count)) \
    K(void, harmonics, (const ssdgs_real *position, const ssdgs_real *rows, int degree, \
        const ssdgs_real *eye, ssdgs_real *out)) \
    K(void, encode, (ssdgs_real *out, const ssdgs_real *in, const ssdgs_real *origin, ssdgs_real scale, \
        int dims, int levels)) \
    T(void, encode_backward, (ssdgs_real *din, const ssdgs_real *dout, const ssdgs_real *out, \
        ssdgs_real scale, int dims, int levels)) \
    K(void, reflect, (const ssdgs__lighting *lighting, const ssdgs_real *gauss, ssdgs_real *rows)) \
    T(void, reflect_backward, (const ssdgs__lighting *lighting, const ssdgs_real *gauss, \
        const ssdgs_real *drows, ssdgs_real *dgauss, ssdgs_real *lane_sums)) \
    K(void, colour, (const ssdgs__lighting *lighting, const ssdgs__colour_in *in, ssdgs_real *out)) \
    T(void, colour_backward, (const ssdgs__lighting *lighting, const ssdgs__colour_in *in, \
        const ssdgs__colour_gradient *d)) \
    T(void, depth_normals, (const ssdgs_camera *camera, const ssdgs_real *depth, size_t stride, int y, \
        ssdgs_real weight, ssdgs_real *out)) \
    K(void, srgb_encode, (ssdgs_real *out, ssdgs_real *slope, const ssdgs_real *in, size_t n)) \
    K(void, srgb_decode, (ssdgs_real *out, const ssdgs_real *in, size_t n)) \
    T(void, ssim_row, (const ssdgs__ssim_row *row, ssdgs_real *sums)) \
    T(void, ssim_backward_row, (const ssdgs__ssim_row *row, ssdgs_real by_l1, ssdgs_real by_ssim, \
        ssdgs_real *gradient)) \
    K(int, within, (const ssdgs_real *values, size_t n, ssdgs_real most)) \
    T(void, adam, (ssdgs_real *parameter, const ssdgs_real *gradient, ssdgs_real *mean, \
        ssdgs_real *square, size_t n, const ssdgs__adam_rate *rate))
/* clang-format on */
#define SSDGS__KERNEL(result, name, arguments) result(*name) arguments;
typedef struct ssdgs__kernels {
    SSDGS__KERNELS(SSDGS__KERNEL, SSDGS__KERNEL)
} ssdgs__kernels;
#undef SSDGS__KERNEL

/* Pixel offsets of the lanes of a 4x4 micro-tile, and the lanes' numbers. */
static const ssdgs_real ssdgs__lane_x[16] = {0.5, 1.5, 2.5, 3.5, 0.5, 1.5, 2.5, 3.5,
                                             0.5, 1.5, 2.5, 3.5, 0.5, 1.5, 2.5, 3.5};
static const ssdgs_real ssdgs__lane_y[16] = {0.5, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5, 1.5,
                                             2.5, 2.5, 2.5, 2.5, 3.5, 3.5, 3.5, 3.5};
static const ssdgs_real ssdgs__count[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
/* Pixel centres at the low corner of the micro-tiles of a tile. */
static const ssdgs_real ssdgs__micro_x[16] = {0.5, 4.5, 8.5, 12.5, 0.5, 4.5, 8.5, 12.5,
                                              0.5, 4.5, 8.5, 12.5, 0.5, 4.5, 8.5, 12.5};
static const ssdgs_real ssdgs__micro_y[16] = {0.5, 0.5, 0.5, 0.5, 4.5,  4.5,  4.5,  4.5,
                                              8.5, 8.5, 8.5, 8.5, 12.5, 12.5, 12.5, 12.5};
#if SSDGS__NEON
static const uint32_t ssdgs__lane_bits[4] = {1, 2, 4, 8};
#endif
static const ssdgs_real ssdgs__map_level[SSDGS__MAP_STEPS] = {(ssdgs_real)0.98, (ssdgs_real)0.5,
                                                              (ssdgs_real)0.1};
/* SSIM's window: 11 taps of a Gaussian of sigma 1.5, normalised. */
static const ssdgs_real ssdgs__window[11] = {
    (ssdgs_real)0.00102838008447911,  (ssdgs_real)0.007598758135239185, (ssdgs_real)0.03600077212843083,
    (ssdgs_real)0.10936068950970002,  (ssdgs_real)0.2130055377112537,   (ssdgs_real)0.26601172486179436,
    (ssdgs_real)0.2130055377112537,   (ssdgs_real)0.10936068950970002,  (ssdgs_real)0.03600077212843083,
    (ssdgs_real)0.007598758135239185, (ssdgs_real)0.00102838008447911};

static SSDGS__INLINE int ssdgs__lowest_bit(uint64_t mask) {
#if SSDGS__GNUC
    return __builtin_ctzll(mask);
#else
    int bit = 0;
    for (int half = 32; half; half /= 2)
        if (!(mask >> bit & (((uint64_t)1 << half) - 1))) bit += half;
    return bit;
#endif
}

static SSDGS__INLINE int ssdgs__highest_bit(uint64_t mask) { /* of 0: 0 */
#if SSDGS__GNUC
    return 63 ^ __builtin_clzll(mask | 1);
#else
    int bit = 0;
    for (int half = 32; half; half /= 2)
        if (mask >> bit >> half) bit += half;
    return bit;
#endif
}

/* ---- a light's map of where transmittance falls ---- */

/* Closes the list of each pixel, of `levels` so far. */
static void ssdgs__light_map_end(const ssdgs__tile *tile, const unsigned char *levels,
                                 const ssdgs_real *transmittance) {
    for (int i = 0; i < 256; i++) {
        ssdgs_light_pixel *at = tile->light_map + i;
        for (int l = levels[i]; l < SSDGS__MAP_STEPS; l++) {
            at->distance[l] = SSDGS__NEVER;
            if (l < SSDGS__MAP_STEPS - 1) at->left[l] = 0;
            if (l) at->before[l - 1] = 0;
        }
        at->behind = transmittance[i];
    }
}

/* ---- scalar lanes ---- */

static SSDGS__INLINE ssdgs_real ssdgs__round(ssdgs_real x) { /* to nearest, ties to even */
#if defined(__wasm__) && !defined(SSDGS_REAL64)
    return __builtin_rintf(x); /* one instruction; LLVM 14 mixes up volatile floats in what it vectorises */
#else
    const ssdgs_real magic =
        sizeof(ssdgs_real) == 4 ? (ssdgs_real)12582912.0 : (ssdgs_real)6755399441055744.0;
    volatile ssdgs_real shifted = x + magic; /* volatile: -ffast-math would fold it away */
    return shifted - magic;
#endif
}

static SSDGS__INLINE float ssdgs__pow2(float n) {
    const uint32_t bits = n > -127 ? (uint32_t)((int)n + 127) << 23
                                   : (uint32_t)1 << 22; /* 2^-127, subnormal, for less and for NaN */
    float x;
    memcpy(&x, &bits, 4);
    return x;
}

static SSDGS__INLINE float ssdgs__exponent(float x) {
    uint32_t bits;
    memcpy(&bits, &x, 4);
    return (float)((int)(bits >> 23) - 127);
}

/* How many harmonics there are up to a degree, but for the constant one. */
static SSDGS__INLINE int ssdgs__harmonics(int degree) { return (degree + 1) * (degree + 1) - 1; }

static int ssdgs__finite(ssdgs_real x) {
#ifdef SSDGS_REAL64
    uint64_t bits;
    memcpy(&bits, &x, 8);
    return (bits >> 52 & 0x7FF) != 0x7FF;
#else
    uint32_t bits;
    memcpy(&bits, &x, 4);
    return (bits >> 23 & 0xFF) != 0xFF;
#endif
}

/* ---- the tables ---- */

/* The kernels' shortest names; an includer's macros of these are put away until the tables are made. */
#pragma push_macro("R")
#pragma push_macro("V")
#pragma push_macro("VM")
#pragma push_macro("F")
#undef R
#undef V
#undef VM
#undef F
#define SSDGS__ISA SSDGS__ISA_SCALAR
#ifdef __PCC__ /* cannot include what a macro names */
#include "ssdgs.h"
#else
#include SSDGS_SELF
#endif
#undef SSDGS__ISA
#if SSDGS__X86 >= 1
#define SSDGS__ISA SSDGS__ISA_SSE2
#include SSDGS_SELF
#undef SSDGS__ISA
#endif
#if SSDGS__X86 >= 2
#define SSDGS__ISA SSDGS__ISA_AVX2
#include SSDGS_SELF
#undef SSDGS__ISA
#endif
#if SSDGS__X86 >= 3
#define SSDGS__ISA SSDGS__ISA_AVX512
#include SSDGS_SELF
#undef SSDGS__ISA
#endif
#if SSDGS__NEON
#define SSDGS__ISA SSDGS__ISA_NEON
#include SSDGS_SELF
#undef SSDGS__ISA
#endif
#if SSDGS__WASM
#define SSDGS__ISA SSDGS__ISA_WASM
#include SSDGS_SELF
#undef SSDGS__ISA
#endif

#pragma pop_macro("R")
#pragma pop_macro("V")
#pragma pop_macro("VM")
#pragma pop_macro("F")

/* ==== >>memory  contexts, errors, aligned allocation ==== */

/* Reads desc's allocator and log. Holds messages, notes and buffers that only grow. All sections call it. */

#define SSDGS__MESSAGE 512

/* Values that several threads read and write. Compilers without atomic operations neither wait for a value
   nor exclude each other. */
#if SSDGS__GNUC
#define SSDGS__GLANCE(p) __atomic_load_n(p, __ATOMIC_ACQUIRE)
#define SSDGS__PUBLISH(p, value) __atomic_store_n(p, value, __ATOMIC_RELEASE)
#define SSDGS__PUBLISH_TEXT(p, text) SSDGS__PUBLISH(p, text)
#define SSDGS__EXCHANGE(p, value) __atomic_exchange_n(p, value, __ATOMIC_ACQ_REL)
#if SSDGS__X86
#define SSDGS__PAUSE() __builtin_ia32_pause()
#else
#define SSDGS__PAUSE() ((void)0)
#endif
#elif defined(_MSC_VER)
#define SSDGS__GLANCE(p) (*(p))
#define SSDGS__PUBLISH(p, value) ((void)InterlockedExchange((volatile LONG *)(p), (LONG)(value)))
#define SSDGS__PUBLISH_TEXT(p, text) ((void)InterlockedExchangePointer((void *volatile *)(p), (void *)(text)))
#define SSDGS__EXCHANGE(p, value) ((int)InterlockedExchange((volatile LONG *)(p), (LONG)(value)))
#define SSDGS__PAUSE() YieldProcessor()
#else
#define SSDGS__GLANCE(p) (*(p))
#define SSDGS__PUBLISH(p, value) (*(p) = (value))
#define SSDGS__PUBLISH_TEXT(p, text) (*(p) = (text))
static int ssdgs__exchange(volatile int *p, int value) {
    const int old = *p;
    *p = value;
    return old;
}
#define SSDGS__EXCHANGE(p, value) ssdgs__exchange(p, value)
#endif

struct ssdgs_context {
    ssdgs_allocator allocator;
    ssdgs_logger logger;
    ssdgs_tracer tracer;
    ssdgs_parallel parallel;
    ssdgs_gpu_hook gpu;
    const ssdgs__kernels *k;
    struct ssdgs__pool *pool;
    struct ssdgs__scratch *scratch; /* reused by every frame on this context */
    int isa, threads, groups;       /* groups: of tasks for a job system; 0: there is none */
    int references; /* the owner, models, scenes, trainers, calls that destroy: the last to go frees it */
    volatile int busy, telling;   /* 1 while a call is at work, while the log hears a message */
    const char *volatile refusal; /* why a call was refused, if nothing failed since */
    long process;                 /* id of the process that has the threads: a fork has none */
    uint64_t revisions;           /* handed out to models */
    const char *subject; /* what is being checked, for messages: a file's name, or the one of several things
                            with its number */
    int subject_number;  /* -1: it has none */
    char message[SSDGS__MESSAGE];
};

/* Of a long path it keeps the end, and room for what is wrong with it. */
static void ssdgs__append(char *text, size_t *at, const char *more) {
    const size_t length = strlen(more), most = SSDGS__MESSAGE / 2;
    if (length > most) {
        ssdgs__append(text, at, "...");
        more += length - most;
    }
    while (*more && *at + 1 < SSDGS__MESSAGE) text[(*at)++] = *more++;
    text[*at] = 0;
}

/* A whole number in full, others to seven digits, with a point wherever the program's locale has another; nan
   without a sign. */
static void ssdgs__append_number(char *text, size_t *at, double value) {
    char digits[40], one[2] = {0, 0};
    snprintf(digits, sizeof digits, value > -1e15 && value < 1e15 && value == floor(value) ? "%.0f" : "%.7g",
             value);
    for (const char *c = digits + !strncmp(digits, "-nan", 4); *c; c++) {
        *one = strchr("+-0123456789einfa", *c) ? *c : '.';
        if ((*c & 0xC0) != 0x80) ssdgs__append(text, at, one); /* else the rest of a point in UTF-8 */
    }
}

/* Appends %s, %d, %zu and %g, as printf() does; others stand as they are. */
static void ssdgs__append_format(char *text, size_t *at, const char *format, va_list arguments) {
    char one[2] = {0, 0};
    for (; *format; format++) {
        *one = *format;
        if (*format != '%') ssdgs__append(text, at, one);
        else switch (*++format) {
            case 's': ssdgs__append(text, at, va_arg(arguments, const char *)); break;
            case 'd': ssdgs__append_number(text, at, (double)va_arg(arguments, int)); break;
            case 'z': format++, ssdgs__append_number(text, at, (double)va_arg(arguments, size_t)); break;
            case 'g': ssdgs__append_number(text, at, va_arg(arguments, double)); break;
            default: ssdgs__append(text, at, one), format--;
            }
    }
}

static void ssdgs__tell(ssdgs_context *context, ssdgs_result code, const char *message) {
    if (!context->logger.write || context->telling) return;
    SSDGS__PUBLISH(&context->telling, 1);
    context->logger.write(context->logger.user, code, message);
    SSDGS__PUBLISH(&context->telling, 0);
}

static ssdgs_result ssdgs__fail(ssdgs_context *, ssdgs_result, const char *, ...) SSDGS__FORMAT(3);
static void ssdgs__note(ssdgs_context *, const char *, ...) SSDGS__FORMAT(2);

/* Records what went wrong, tells the log, returns the code; without a context, that alone. */
static ssdgs_result ssdgs__fail(ssdgs_context *context, ssdgs_result code, const char *format, ...) {
    size_t at = 0;
    if (!context) return code;
    SSDGS__PUBLISH_TEXT(&context->refusal, NULL);
    context->message[0] = 0;
    if (context->subject) {
        ssdgs__append(context->message, &at, context->subject);
        if (context->subject_number >= 0) {
            ssdgs__append(context->message, &at, " ");
            ssdgs__append_number(context->message, &at, context->subject_number);
        }
        ssdgs__append(context->message, &at, ": ");
    }
    va_list arguments;
    va_start(arguments, format);
    ssdgs__append_format(context->message, &at, format, arguments);
    va_end(arguments);
    ssdgs__tell(context, code, context->message);
    return code;
}

static ssdgs_result ssdgs__null(ssdgs_context *context, const char *function, const char *argument) {
    return ssdgs__fail(context, SSDGS_ERR_ARGUMENT, "%s: %s is NULL", function, argument);
}

/* What is no failure, for the log alone. */
static void ssdgs__note(ssdgs_context *context, const char *format, ...) {
    char text[SSDGS__MESSAGE] = "";
    size_t at = 0;
    va_list arguments;
    va_start(arguments, format);
    ssdgs__append_format(text, &at, format, arguments);
    va_end(arguments);
    ssdgs__tell(context, SSDGS_OK, text);
}

static void ssdgs__pool_forked(ssdgs_context *context);

/* A call begins. It is refused while another is at work: one from a hook, a callback or a task, or on another
   thread, which may touch nothing else. The log does not hear of it, as the log may be who calls. */
static ssdgs_result ssdgs__enter(ssdgs_context *context, const char *refusal) {
    if (SSDGS__GLANCE(&context->telling)) return SSDGS_ERR_ARGUMENT; /* the message being told stays */
    if (SSDGS__EXCHANGE(&context->busy, 1)) {
        if (refusal) SSDGS__PUBLISH_TEXT(&context->refusal, refusal);
        return SSDGS_ERR_ARGUMENT;
    }
    ssdgs__pool_forked(context);
    return SSDGS_OK;
}
#define SSDGS__ENTER(context, function) \
    ssdgs__enter(context, function ": another call on this context is at work")

/* And ends. */
static ssdgs_result ssdgs__leave(ssdgs_context *context, ssdgs_result result) {
    SSDGS__PUBLISH(&context->busy, 0);
    return result;
}

/* Where `wrong` holds, returns ERR_ARGUMENT with this message. */
#define SSDGS__REFUSE(wrong, ...) \
    do { \
        if (wrong) return ssdgs__fail(context, SSDGS_ERR_ARGUMENT, __VA_ARGS__); \
    } while (0)

/* Returns what `call` does, unless all is well. */
#define SSDGS__TRY(call) \
    do { \
        const ssdgs_result tried_ = (call); \
        if (tried_) return tried_; \
    } while (0)

/* A public function begins, or refuses to. */
#define SSDGS__BEGIN(object, context, function) \
    if (!(object)) return SSDGS_ERR_ARGUMENT; \
    SSDGS__TRY(SSDGS__ENTER(context, function))

/* The body of a public function: while `call` is at work, other calls on the context are refused. */
#define SSDGS__GUARD(object, context, function, call) \
    SSDGS__BEGIN(object, context, function); \
    return ssdgs__leave(context, call)

static void ssdgs__context_drop(ssdgs_context *context);

/* Ends a call and drops a reference. Where it was the last, the context stays busy until freed. */
static void ssdgs__leave_and_drop(ssdgs_context *context) {
    if (context->references == 1) {
        ssdgs__context_drop(context);
        return;
    }
    context->references--;
    SSDGS__PUBLISH(&context->busy, 0);
}

/* a b, or SIZE_MAX, which is more than there is. */
static size_t ssdgs__times(size_t a, size_t b) { return b && a > SIZE_MAX / b ? SIZE_MAX : a * b; }

static void *ssdgs__default_allocate(void *user, size_t bytes) {
    (void)user;
    return malloc(bytes);
}

static void ssdgs__default_release(void *user, void *memory) {
    (void)user;
    free(memory);
}

/* 64-byte aligned and zeroed; the distance to the allocator's pointer stands in front. */
static void *ssdgs__allocate_from(const ssdgs_allocator *allocator, size_t bytes) {
    if (bytes > SIZE_MAX - 128) return NULL;
    unsigned char *raw = (unsigned char *)allocator->allocate(allocator->user, bytes + 128);
    if (!raw) return NULL;
    unsigned char *memory = raw + 128 - ((uintptr_t)raw & 63);
    memory[-1] = (unsigned char)(memory - raw);
    memset(memory, 0, bytes);
    return memory;
}

static void ssdgs__release_to(const ssdgs_allocator *allocator, void *memory) {
    unsigned char *bytes = (unsigned char *)memory;
    if (bytes) allocator->release(allocator->user, bytes - bytes[-1]);
}

static void *ssdgs__allocate(ssdgs_context *context, size_t bytes) {
    void *memory = ssdgs__allocate_from(&context->allocator, bytes);
    if (!memory) ssdgs__fail(context, SSDGS_ERR_MEMORY, "out of memory: %zu bytes", bytes);
    return memory;
}

static void ssdgs__release(ssdgs_context *context, void *memory) {
    ssdgs__release_to(&context->allocator, memory);
}

/* A buffer that only grows: after the first frame of a size nothing is allocated. Contents are lost on
   growth. */
typedef struct ssdgs__buffer {
    void *memory;
    size_t bytes;
} ssdgs__buffer;

static ssdgs_result ssdgs__reserve(ssdgs_context *context, ssdgs__buffer *buffer, size_t count, size_t size) {
    size_t bytes = ssdgs__times(count, size);
    if (bytes > SIZE_MAX - bytes / 8)
        return ssdgs__fail(context, SSDGS_ERR_LIMIT, "a buffer of %zu x %zu bytes does not fit in memory",
                           count, size);
    if (bytes <= buffer->bytes && buffer->memory) return SSDGS_OK;
    ssdgs__release(context, buffer->memory);
    if (buffer->bytes) bytes += bytes / 8; /* what grows once will again */
    buffer->bytes = 0;
    buffer->memory = ssdgs__allocate(context, bytes);
    if (!buffer->memory) return SSDGS_ERR_MEMORY;
    buffer->bytes = bytes;
    return SSDGS_OK;
}

/* The same, but what is there stays. */
static ssdgs_result ssdgs__grow(ssdgs_context *context, ssdgs__buffer *buffer, size_t count, size_t size) {
    ssdgs__buffer grown = {NULL, buffer->bytes};
    if (buffer->memory && ssdgs__times(count, size) <= buffer->bytes) return SSDGS_OK;
    const ssdgs_result result = ssdgs__reserve(context, &grown, count, size);
    if (!result && buffer->memory) memcpy(grown.memory, buffer->memory, buffer->bytes);
    if (result) return result;
    ssdgs__release(context, buffer->memory);
    *buffer = grown;
    return SSDGS_OK;
}

/* ---- hashes, of files and of what frames depend on ---- */

#define SSDGS__FOLD_START UINT64_C(0xCBF29CE484222325)
#define SSDGS__FOLD(key, value) ((key) = ssdgs__fold((key), &(value), sizeof(value)))

static uint64_t ssdgs__fold(uint64_t hash, const void *data, size_t size) { /* FNV-1a on bytes */
    const unsigned char *bytes = (const unsigned char *)data;
    for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * UINT64_C(0x100000001B3);
    return hash;
}

/* ==== >>threads  a pool per context ==== */

/* Runs the tasks of a stage, on the context's threads or desc.parallel. Work is cut by the problem, never
   by the thread count, and every task writes its own place. */

typedef void (*ssdgs__task)(void *data, int index);

#ifndef SSDGS_NO_THREADS
#if defined(_WIN32)
typedef CRITICAL_SECTION ssdgs__mutex;
typedef CONDITION_VARIABLE ssdgs__condition;
typedef HANDLE ssdgs__thread;
#define SSDGS__THREAD_FUNCTION(name) static DWORD WINAPI name(LPVOID data)
static int ssdgs__mutex_create(ssdgs__mutex *m) {
    InitializeCriticalSection(m);
    return 1;
}
static void ssdgs__mutex_destroy(ssdgs__mutex *m) { DeleteCriticalSection(m); }
static void ssdgs__lock(ssdgs__mutex *m) { EnterCriticalSection(m); }
static void ssdgs__unlock(ssdgs__mutex *m) { LeaveCriticalSection(m); }
static int ssdgs__condition_create(ssdgs__condition *c) {
    InitializeConditionVariable(c);
    return 1;
}
static void ssdgs__condition_destroy(ssdgs__condition *c) { (void)c; }
static void ssdgs__wait(ssdgs__condition *c, ssdgs__mutex *m) { SleepConditionVariableCS(c, m, INFINITE); }
static void ssdgs__wake(ssdgs__condition *c) { WakeAllConditionVariable(c); }
static int ssdgs__thread_create(ssdgs__thread *t, LPTHREAD_START_ROUTINE f, void *data) {
    return (*t = CreateThread(NULL, 0, f, data, 0, NULL)) != NULL;
}
static void ssdgs__thread_join(ssdgs__thread t) {
    WaitForSingleObject(t, INFINITE);
    CloseHandle(t);
}
static int ssdgs__cpu_count(void) {
    SYSTEM_INFO info;
    GetSystemInfo(&info);
    return (int)info.dwNumberOfProcessors;
}
#else
typedef pthread_mutex_t ssdgs__mutex;
typedef pthread_cond_t ssdgs__condition;
typedef pthread_t ssdgs__thread;
#define SSDGS__THREAD_FUNCTION(name) static void *name(void *data)
static int ssdgs__mutex_create(ssdgs__mutex *m) { return pthread_mutex_init(m, NULL) == 0; }
static void ssdgs__mutex_destroy(ssdgs__mutex *m) { pthread_mutex_destroy(m); }
static void ssdgs__lock(ssdgs__mutex *m) { pthread_mutex_lock(m); }
static void ssdgs__unlock(ssdgs__mutex *m) { pthread_mutex_unlock(m); }
static int ssdgs__condition_create(ssdgs__condition *c) { return pthread_cond_init(c, NULL) == 0; }
static void ssdgs__condition_destroy(ssdgs__condition *c) { pthread_cond_destroy(c); }
static void ssdgs__wait(ssdgs__condition *c, ssdgs__mutex *m) { pthread_cond_wait(c, m); }
static void ssdgs__wake(ssdgs__condition *c) { pthread_cond_broadcast(c); }
static int ssdgs__thread_create(ssdgs__thread *t, void *(*f)(void *), void *data) {
    return pthread_create(t, NULL, f, data) == 0;
}
static void ssdgs__thread_join(ssdgs__thread t) { pthread_join(t, NULL); }
static int ssdgs__cpu_count(void) {
#ifdef _SC_NPROCESSORS_ONLN
    return (int)sysconf(_SC_NPROCESSORS_ONLN);
#else
    return 1;
#endif
}
#endif

/* A thread waits a little while before it goes to sleep: waking up takes longer than many a stage. */
#if defined(SSDGS__PAUSE)
#define SSDGS__LINGER(pool, condition) \
    do { \
        int glances_ = (pool)->glances; \
        ssdgs__unlock(&(pool)->mutex); \
        while (glances_-- && (condition)) SSDGS__PAUSE(); \
        ssdgs__lock(&(pool)->mutex); \
    } while (0)
#else
#define SSDGS__LINGER(pool, condition) ((void)0)
#endif

typedef struct ssdgs__pool {
    ssdgs__mutex mutex;
    ssdgs__condition start, done;
    ssdgs__thread *threads;
    int thread_count, stop, glances;
    volatile unsigned generation;
    volatile int running;
    ssdgs__task task;
    void *data;
    int count, next;
} ssdgs__pool;

/* Takes tasks until none is left; called with the mutex held. */
static void ssdgs__pool_work(ssdgs__pool *pool) {
    SSDGS__PUBLISH(&pool->running, pool->running + 1);
    while (pool->next < pool->count) {
        const int index = pool->next++;
        ssdgs__unlock(&pool->mutex);
        pool->task(pool->data, index);
        ssdgs__lock(&pool->mutex);
    }
    SSDGS__PUBLISH(&pool->running, pool->running - 1);
    if (pool->running == 0) ssdgs__wake(&pool->done);
}

SSDGS__THREAD_FUNCTION(ssdgs__pool_thread) {
    ssdgs__pool *pool = (ssdgs__pool *)data;
    unsigned seen = 0;
    ssdgs__lock(&pool->mutex);
    for (;;) {
        if (!pool->stop && pool->generation == seen)
            SSDGS__LINGER(pool, SSDGS__GLANCE(&pool->generation) == seen);
        while (!pool->stop && pool->generation == seen) ssdgs__wait(&pool->start, &pool->mutex);
        if (pool->stop) break;
        seen = pool->generation;
        ssdgs__pool_work(pool);
    }
    ssdgs__unlock(&pool->mutex);
    return 0;
}

static void ssdgs__pool_run(void *user, int count, ssdgs__task task, void *data) {
    ssdgs__pool *pool = (ssdgs__pool *)user;
    ssdgs__lock(&pool->mutex);
    pool->task = task;
    pool->data = data;
    pool->count = count;
    pool->next = 0;
    SSDGS__PUBLISH(&pool->generation, pool->generation + 1);
    ssdgs__wake(&pool->start);
    ssdgs__pool_work(pool);
    if (pool->running) SSDGS__LINGER(pool, SSDGS__GLANCE(&pool->running) != 0);
    while (pool->running) ssdgs__wait(&pool->done, &pool->mutex);
    ssdgs__unlock(&pool->mutex);
}

static void ssdgs__pool_destroy(const ssdgs_allocator *allocator, ssdgs__pool *pool) {
    ssdgs__lock(&pool->mutex);
    pool->stop = 1;
    SSDGS__PUBLISH(&pool->generation, pool->generation + 1); /* no worker lingers on */
    ssdgs__wake(&pool->start);
    ssdgs__unlock(&pool->mutex);
    for (int i = 0; i < pool->thread_count; i++) ssdgs__thread_join(pool->threads[i]);
    ssdgs__condition_destroy(&pool->done);
    ssdgs__condition_destroy(&pool->start);
    ssdgs__mutex_destroy(&pool->mutex);
    ssdgs__release_to(allocator, pool->threads);
    ssdgs__release_to(allocator, pool);
}

/* A pool of `threads` workers, the caller counted; fewer where the system gives fewer. */
static ssdgs__pool *ssdgs__pool_create(const ssdgs_allocator *allocator, int threads) {
    ssdgs__pool *pool = (ssdgs__pool *)ssdgs__allocate_from(allocator, sizeof *pool);
    if (!pool) return NULL;
    pool->threads = (ssdgs__thread *)ssdgs__allocate_from(allocator, sizeof(ssdgs__thread) * (size_t)threads);
    const int locks = pool->threads && ssdgs__mutex_create(&pool->mutex),
              starts = locks && ssdgs__condition_create(&pool->start);
    if (!starts || !ssdgs__condition_create(&pool->done)) {
        if (starts) ssdgs__condition_destroy(&pool->start);
        if (locks) ssdgs__mutex_destroy(&pool->mutex);
        ssdgs__release_to(allocator, pool->threads);
        ssdgs__release_to(allocator, pool);
        return NULL;
    }
    pool->glances = threads <= ssdgs__cpu_count() ? SSDGS__GLANCES : 0;
    while (pool->thread_count < threads - 1) {
        if (!ssdgs__thread_create(&pool->threads[pool->thread_count], ssdgs__pool_thread, pool)) break;
        pool->thread_count++;
    }
    return pool;
}
#endif

static void ssdgs__serial_run(void *user, int count, ssdgs__task task, void *data) {
    (void)user;
    for (int i = 0; i < count; i++) task(data, i);
}

static void ssdgs__context_serial(ssdgs_context *context) {
    context->parallel.run = ssdgs__serial_run;
    context->pool = NULL;
    context->threads = 1;
}

/* In a process forked from the one that made the threads there are none, and locks may be held for ever: goes
   on without. */
static void ssdgs__pool_forked(ssdgs_context *context) {
#if !defined(SSDGS_NO_THREADS) && !defined(_WIN32)
    if (!context->pool || context->process == (long)getpid()) return;
    ssdgs__release_to(&context->allocator, context->pool->threads);
    ssdgs__release_to(&context->allocator, context->pool);
    ssdgs__context_serial(context);
#else
    (void)context;
#endif
}

/* Runs every groups-th of `count` tasks, as costly ones are neighbours in images. */
typedef struct ssdgs__group_job {
    ssdgs__task task;
    void *data;
    int count, groups;
} ssdgs__group_job;

static void ssdgs__group_task(void *data, int index) {
    const ssdgs__group_job *job = (const ssdgs__group_job *)data;
    for (int i = index; i < job->count; i += job->groups) {
        job->task(job->data, i);
        if (job->count - i <= job->groups) return; /* i + groups may be beyond INT_MAX */
    }
}

/* Runs tasks: in groups on a job system, where each costs more than on our threads. */
static void ssdgs__parallel(ssdgs_context *context, int count, ssdgs__task task, void *data) {
    ssdgs__group_job job = {task, data, count,
                            context->groups && context->groups < count ? context->groups : count};
    ssdgs__pool_forked(context); /* within this call, by a callback */
    if (count < 1) return;
    if (job.groups == count) context->parallel.run(context->parallel.user, count, task, data);
    else context->parallel.run(context->parallel.user, job.groups, ssdgs__group_task, &job);
}

SSDGS_API ssdgs_result ssdgs_context_run(ssdgs_context *context, int count,
                                         void (*task)(void *data, int index), void *data) {
    SSDGS__BEGIN(context, context, "ssdgs_context_run");
    if (!task && count > 0) return ssdgs__leave(context, ssdgs__null(context, "ssdgs_context_run", "task"));
    ssdgs__parallel(context, count, task, data);
    return ssdgs__leave(context, SSDGS_OK);
}

/* ==== >>cpu  which tables this machine can run ==== */

/* Reads CPUID. Picks a table of kernels. Makes and destroys contexts. */

#if SSDGS__X86
/* All 0 for a leaf that the CPU has not. Without <cpuid.h>: clang 14's lets ebx come out where the subleaf
   goes in. */
static void ssdgs__cpuid(unsigned leaf, unsigned subleaf, unsigned out[4]) {
#if defined(_MSC_VER)
    int r[4];
    __cpuidex(r, (int)leaf, (int)subleaf);
    memcpy(out, r, sizeof r);
#elif defined(__x86_64__)
    __asm__("xchgq %%rbx, %q1\n\tcpuid\n\txchgq %%rbx, %q1"
            : "=a"(out[0]), "=&r"(out[1]), "=c"(out[2]), "=d"(out[3])
            : "0"(leaf), "2"(subleaf));
#else
    __asm__("xchgl %%ebx, %k1\n\tcpuid\n\txchgl %%ebx, %k1"
            : "=a"(out[0]), "=&r"(out[1]), "=c"(out[2]), "=d"(out[3])
            : "0"(leaf), "2"(subleaf));
#endif
    if (leaf) {
        unsigned first[4];
        ssdgs__cpuid(0, 0, first);
        if (first[0] < leaf) memset(out, 0, 4 * sizeof *out);
    }
}

/* 1 = SSE2, 2 = and AVX2 with FMA, 3 = and AVX-512F; the operating system must save the registers too. */
static int ssdgs__x86_level(void) {
    unsigned a[4];
    ssdgs__cpuid(1, 0, a);
    unsigned b[4];
    ssdgs__cpuid(7, 0, b);
    if (!(a[3] >> 26 & 1)) return 0;
    if (!(a[2] >> 27 & 1) || !(a[2] >> 28 & 1) || !(a[2] >> 12 & 1) || !(b[1] >> 5 & 1)) return 1;
    unsigned saved;
#if defined(_MSC_VER)
    saved = (unsigned)_xgetbv(0);
#else
    {
        unsigned high;
        __asm__ volatile("xgetbv" : "=a"(saved), "=d"(high) : "c"(0));
    }
#endif
    if ((saved & 6u) != 6u) return 1;
    return (b[1] >> 16 & 1) && (saved & 0xE0u) == 0xE0u ? 3 : 2;
}
#endif

static const ssdgs__kernels *ssdgs__table(int isa) {
#if SSDGS__X86
    const int level = ssdgs__x86_level();
#endif
    switch (isa) {
#if SSDGS__SCALAR
    case SSDGS_ISA_SCALAR: return &ssdgs__kernels_scalar;
#endif
#if SSDGS__X86 >= 1
    case SSDGS_ISA_SSE2: return level >= 1 ? &ssdgs__kernels_sse2 : NULL;
#endif
#if SSDGS__X86 >= 2
    case SSDGS_ISA_AVX2: return level >= 2 ? &ssdgs__kernels_avx2 : NULL;
#endif
#if SSDGS__X86 >= 3
    case SSDGS_ISA_AVX512: return level >= 3 ? &ssdgs__kernels_avx512 : NULL;
#endif
#if SSDGS__NEON
    case SSDGS_ISA_NEON: return &ssdgs__kernels_neon;
#endif
#if SSDGS__WASM
    case SSDGS_ISA_WASM: return &ssdgs__kernels_wasm;
#endif
    default: return NULL;
    }
}

SSDGS_API const char *ssdgs_result_string(ssdgs_result result) {
#define SSDGS__RESULT_TEXT(name, text) text,
    static const char *const texts[] = {SSDGS_RESULTS(SSDGS__RESULT_TEXT) "unknown"};
#undef SSDGS__RESULT_TEXT
    return texts[(int)result >= 0 && result < SSDGS_RESULT_COUNT ? (int)result : (int)SSDGS_RESULT_COUNT];
}

SSDGS_API const char *ssdgs_isa_string(ssdgs_isa isa) {
    static const char *const names[] = {"auto", "scalar", "sse2", "wasm",
                                        "avx2", "avx512", "neon", "unknown"};
    return names[(int)isa >= 0 && isa < SSDGS_ISA_COUNT ? (int)isa : (int)SSDGS_ISA_COUNT];
}

static void ssdgs__frame_memory_destroy(ssdgs_context *context, struct ssdgs__frame_memory *memory);
static void ssdgs__scratch_destroy(ssdgs_context *context, struct ssdgs__scratch *scratch);

/* Tells the log why there is no context. */
static ssdgs_result ssdgs__no_context(const ssdgs_context_desc *asked, ssdgs_result code, const char *why) {
    if (asked->logger.write) asked->logger.write(asked->logger.user, code, why);
    return code;
}

SSDGS_API ssdgs_result ssdgs_context_create(const ssdgs_context_desc *desc, ssdgs_context **out) {
    if (!out) return SSDGS_ERR_ARGUMENT;
    *out = NULL;
    ssdgs_context_desc asked;
    memset(&asked, 0, sizeof asked);
    if (desc) asked = *desc;
    if (!asked.allocator.allocate != !asked.allocator.release)
        return ssdgs__no_context(&asked, SSDGS_ERR_ARGUMENT,
                                 "ssdgs_context_create: allocate or release is NULL");
    if (asked.threads < 0 || asked.threads > 1024)
        return ssdgs__no_context(&asked, SSDGS_ERR_ARGUMENT,
                                 "ssdgs_context_create: threads is not within 0 .. 1024");
    if (!asked.allocator.allocate) {
        asked.allocator.allocate = ssdgs__default_allocate;
        asked.allocator.release = ssdgs__default_release;
    }
    int best = (int)asked.isa;
    for (int isa = SSDGS_ISA_COUNT - 1; isa > 0 && best == SSDGS_ISA_AUTO; isa--)
        if (ssdgs__table(isa)) best = isa;
    if (best < 0 || best >= SSDGS_ISA_COUNT || !ssdgs__table(best))
        return ssdgs__no_context(&asked, SSDGS_ERR_ISA,
                                 "ssdgs_context_create: this CPU or this build lacks the isa");
    ssdgs_context *context = (ssdgs_context *)ssdgs__allocate_from(&asked.allocator, sizeof *context);
    if (!context) return ssdgs__no_context(&asked, SSDGS_ERR_MEMORY, "ssdgs_context_create: out of memory");
    context->allocator = asked.allocator;
    context->logger = asked.logger;
    context->tracer = asked.tracer;
    if (asked.gpu) context->gpu = *asked.gpu;
    context->isa = best;
    context->k = ssdgs__table(best);
    context->references = 1;
    ssdgs__context_serial(context);
    if (asked.parallel.run) {
        context->parallel = asked.parallel;
        context->threads = asked.threads ? asked.threads : 4;
        context->groups = 3 * context->threads;
    } else {
#ifndef SSDGS_NO_THREADS
        const int threads = asked.threads ? asked.threads : ssdgs__cpu_count();
        if (threads > 1) {
            context->pool = ssdgs__pool_create(&context->allocator, threads);
            if (!context->pool) {
                ssdgs__release_to(&asked.allocator, context);
                return ssdgs__no_context(&asked, SSDGS_ERR_MEMORY, "ssdgs_context_create: out of memory");
            }
            context->threads = context->pool->thread_count + 1;
            context->parallel.run = ssdgs__pool_run;
            context->parallel.user = context->pool;
#ifndef _WIN32
            context->process = (long)getpid();
#endif
        }
#endif
    }
    *out = context;
    return SSDGS_OK;
}

/* One that used the context is gone. */
static void ssdgs__context_drop(ssdgs_context *context) {
    const ssdgs_allocator allocator = context->allocator;
    if (--context->references) return;
    ssdgs__scratch_destroy(context, context->scratch);
    ssdgs__release_to(&allocator, context);
}

SSDGS_API void ssdgs_context_destroy(ssdgs_context *context) {
    if (!context || SSDGS__ENTER(context, "ssdgs_context_destroy")) return;
#ifndef SSDGS_NO_THREADS
    if (context->pool) {
        ssdgs__pool_destroy(&context->allocator, context->pool);
        ssdgs__context_serial(context);
    }
#endif
    if (context->references > 1)
        ssdgs__note(
            context,
            "ssdgs_context_destroy: %d models, scenes or trainers are still there: the context goes with the "
            "last of them",
            context->references - 1);
    ssdgs__leave_and_drop(context);
}

SSDGS_API const char *ssdgs_error_message(const ssdgs_context *context) {
    if (!context) return "no context";
    const char *refusal = SSDGS__GLANCE(&context->refusal);
    return refusal ? refusal : context->message;
}
SSDGS_API ssdgs_isa ssdgs_context_isa(const ssdgs_context *context) {
    return context ? (ssdgs_isa)context->isa : SSDGS_ISA_AUTO;
}
SSDGS_API int ssdgs_context_threads(const ssdgs_context *context) { return context ? context->threads : 0; }

/* ==== >>model  Gaussians, ASG bases, networks, settings ==== */

/* Reads settings. Holds raw parameters, ASG and networks, and their public functions. Files and the
   trainer make models of them. */

typedef struct ssdgs__bounds { /* what a light's map must cover, and how finely */
    double low[3], high[3], log_scale;
    int count;
} ssdgs__bounds;

struct ssdgs_model {
    ssdgs_context *context;
    ssdgs_settings settings;
    uint64_t revision;    /* another one whenever the model may have changed */
    uint64_t arrangement; /* another one whenever its Gaussians change places, which trainers' moments must
                             follow */
    int references;       /* itself and its trainers: the last that goes frees it */
    int count;
    size_t capacity; /* plane stride, a multiple of SSDGS__BLOCK */
    int channels;
    ssdgs_real *gaussians; /* (channels, capacity) */
    size_t global_count;
    ssdgs_real *globals;               /* the groups of ssdgs__global_groups, in order */
    struct ssdgs__frame_memory *frame; /* of its frames: what the last one found is there for the next */
    double low[3], high[3];            /* the box that holds all that its Gaussians draw */
    ssdgs__bounds bounds;              /* of them to three standard deviations, but for a few strays */
    uint64_t box_revision;             /* of which revision both are */
    ssdgs__buffer
        sky_share; /* (2 x capacity) the share of an even sky that each Gaussian gets, and scratch */
    uint64_t sky_share_revision; /* for which of its revisions */
};

/* Parameters that learn together: planes of every Gaussian, then what all share */
enum {
    SSDGS__G_POSITION = 0,
    SSDGS__G_ROTATION,
    SSDGS__G_SCALE,
    SSDGS__G_OPACITY,
    SSDGS__G_DIFFUSE,
    SSDGS__G_SPECULAR,
    SSDGS__G_SCATTERING,
    SSDGS__G_FRAME,
    SSDGS__G_ASG_WEIGHT,
    SSDGS__G_MATERIAL,
    SSDGS__PLANE_GROUPS,
    SSDGS__ASG_BASIS = 0,
    SSDGS__ASG_SHARPNESS,
    SSDGS__ASG_SIGMA,
    SSDGS__SCATTERING_NET,
    SSDGS__SHADOW_NET,
    SSDGS__GLOBAL_GROUPS,
    SSDGS__GROUPS = SSDGS__PLANE_GROUPS + SSDGS__GLOBAL_GROUPS
};

/* Whether positions are in a length unit, which the paper's form does not have. */
static int ssdgs__has_unit(const ssdgs_settings *s) {
    return s->depth_cue || s->residual_shadow || s->transport || s->light_map.bias > 0;
}

/* A counter-based generator: the value depends on the key and the counter alone, never on the order of
   use. */
static uint64_t ssdgs__hash(uint64_t key, uint64_t counter) {
    uint64_t x = key * UINT64_C(0x9E3779B97F4A7C15) + counter;
    x = (x ^ (x >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94D049BB133111EB);
    x ^= x >> 31;
    x = (x + UINT64_C(0x9E3779B97F4A7C15)) * UINT64_C(0xD6E8FEB86659FD93);
    return x ^ (x >> 32);
}

static double ssdgs__uniform(uint64_t key, uint64_t counter) { /* [0, 1) */
    return (double)(ssdgs__hash(key, counter) >> 11) * (1.0 / 9007199254740992.0);
}

/* Layer sizes, inputs first; returns the number of linear layers. */
static int ssdgs__network_sizes(const ssdgs_settings *settings, int shadow, int sizes[SSDGS_MAX_LAYERS + 1]) {
    const int layers = shadow ? settings->shadow.layers : settings->scattering.layers;
    sizes[0] = shadow ? 21 + 21 + 1 + SSDGS_MATERIAL_COUNT
                      : 27 + 3 * (1 + 2 * settings->octaves.view) + 3 * (1 + 2 * settings->octaves.light) +
                            3 + SSDGS_MATERIAL_COUNT + (settings->depth_cue ? 9 : 0) +
                            (settings->transport ? SSDGS__LENGTHS : 0);
    for (int i = 1; i < layers; i++) sizes[i] = shadow ? settings->shadow.width : settings->scattering.width;
    if (layers) sizes[layers] = shadow ? 1 : settings->per_channel_optics ? 7 : 3;
    return layers;
}

static size_t ssdgs__network_count(const ssdgs_settings *settings, int shadow) {
    int sizes[SSDGS_MAX_LAYERS + 1];
    const int layers = ssdgs__network_sizes(settings, shadow, sizes);
    size_t count = 0;
    for (int i = 0; i < layers; i++) count += (size_t)(sizes[i] + 1) * (size_t)sizes[i + 1];
    return count;
}

/* First value of each group of shared parameters; the last entry is their number. */
static void ssdgs__global_groups(const ssdgs_settings *settings, size_t first[SSDGS__GLOBAL_GROUPS + 1]) {
    first[0] = 0;
    first[1] = SSDGS_ASG_COUNT * 4;
    first[2] = first[1] + SSDGS_ASG_COUNT * 2;
    first[3] = first[2] + SSDGS_ASG_COUNT;
    first[4] = first[3] + ssdgs__network_count(settings, 0);
    first[5] = first[4] + ssdgs__network_count(settings, 1);
}

/* Every setting once, in the order of files: member, its property there, values (0: one), type (an int, or a
   real), range, default, published, and what held where older files lack it (-1: none does). */
/* clang-format off */
#define SSDGS__SETTINGS(S) \
    S(version, "version", 0, 'i', SSDGS_VERSION, SSDGS_VERSION, SSDGS_VERSION, SSDGS_VERSION, -1) \
    S(terms, "terms", 0, 'i', 0, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS, -1) \
    S(baked, "baked", 0, 'i', 0, 1, 0, 0, -1) \
    S(harmonics, "harmonics", 0, 'i', 0, 3, 0, 0, 0) \
    S(kept, "kept", 0, 'r', 0, 1, 0, 0, 0) \
    S(transfer, "transfer", 0, 'i', 0, SSDGS_TRANSFER_NONE, SSDGS_TRANSFER_SRGB, SSDGS_TRANSFER_NONE, -1) \
    S(dipole, "dipole", 0, 'i', 0, SSDGS_DIPOLE_PRINTED, 0, 0, -1) \
    S(asg, "asg", 0, 'i', 0, SSDGS_ASG_DEFERRED, SSDGS_ASG_DEFERRED, SSDGS_ASG_GEOMETRIC, -1) \
    S(per_channel_optics, "per_channel_optics", 0, 'i', 0, 1, 1, 0, -1) \
    S(depth_cue, "depth_cue", 0, 'i', 0, 1, 0, 0, -1) \
    S(transport, "transport", 0, 'i', 0, 1, 1, 0, 0) \
    S(residual_shadow, "residual_shadow", 0, 'i', 0, 1, 1, 0, -1) \
    S(shadow_on_scattering, "shadow_on_scattering", 0, 'i', 0, 1, 0, 0, -1) \
    S(scattering.layers, "scattering_layers", 0, 'i', 0, SSDGS_MAX_LAYERS, 3, 6, -1) \
    S(scattering.width, "scattering_width", 0, 'i', 0, SSDGS_MAX_WIDTH, 128, 256, -1) \
    S(octaves.view, "view_octaves", 0, 'i', 0, 8, 0, 4, 4) \
    S(octaves.light, "light_octaves", 0, 'i', 0, 8, 1, 4, 4) \
    S(shadow.layers, "shadow_layers", 0, 'i', 0, SSDGS_MAX_LAYERS, 4, 4, -1) \
    S(shadow.width, "shadow_width", 0, 'i', 0, SSDGS_MAX_WIDTH, 32, 32, -1) \
    S(light_map.blur, "light_blur", 0, 'i', 0, SSDGS_BLUR_FLOOR, SSDGS_BLUR_FLOOR, SSDGS_BLUR_ADD, -1) \
    S(light_map.size, "light_map_size", 0, 'i', 0, 8192, 0, 0, -1) \
    S(light_map.bias, "light_bias", 0, 'r', 0, 1e30, 0.06, 0, -1) \
    S(pixel_variance, "pixel_variance", 0, 'r', 0.01, 10, 0.1, 0.3, 0.3) \
    S(eta, "eta", 0, 'r', 1, 2.5, 1.3, 1.3, -1) \
    S(centre, "centre_", 3, 'r', -1e30, 1e30, 0, 0, -1) \
    S(length_unit, "length_unit", 0, 'r', 1e-15, 1e15, 0.5, 1, -1) \
    S(light_scale, "light_scale", 0, 'r', 0, SSDGS__MOST_LIGHT, 1, 1, -1) \
    S(ambient, "ambient_", 3, 'r', 0, SSDGS__MOST_LIGHT, 0, 0, 0) \
    S(origin, "origin_", 3, 'r', -1e9, 1e9, 0, 0, 0) \
    S(placement.turn, "placement_turn_", 3, 'r', -7, 7, 0, 0, 0) \
    S(placement.scale, "placement_scale", 0, 'r', -1e9, 1e9, 1, 1, 1) \
    S(placement.move, "placement_move_", 3, 'r', -1e9, 1e9, 0, 0, 0) \
    S(medium.scattering, "medium_scattering_", 3, 'r', 0, 1e12, 0, 0, 0) \
    S(medium.absorption, "medium_absorption_", 3, 'r', 0, 1e12, 0, 0, 0)
/* clang-format on */
/* A number among settings and options: what it is, its range and its presets. */
typedef struct ssdgs__number {
    const char *name;
    size_t at;
    int count, type; /* values of an array, or 0; 'i' int, 'r' ssdgs_real, 'u' uint64_t */
    double low, high, preset[4];
} ssdgs__number;
#define SSDGS__S(member, property, count, type, low, high, standard, published, before) \
    {#member, offsetof(ssdgs_settings, member), count, type, low, high, {standard, published, 0, 0}},
static const ssdgs__number ssdgs__settings[] = {SSDGS__SETTINGS(SSDGS__S)};
#undef SSDGS__S
enum { SSDGS__SETTING_COUNT = sizeof ssdgs__settings / sizeof *ssdgs__settings };

static size_t ssdgs__number_size(int type) {
    return type == 'i' ? sizeof(int) : type == 'r' ? sizeof(ssdgs_real) : sizeof(uint64_t);
}

static double ssdgs__number_get(int type, const unsigned char *at) {
    int whole;
    ssdgs_real real;
    uint64_t wide;
    if (type == 'i') return memcpy(&whole, at, sizeof whole), (double)whole;
    if (type == 'r') return memcpy(&real, at, sizeof real), (double)real;
    return memcpy(&wide, at, sizeof wide), (double)wide;
}

static void ssdgs__number_put(int type, unsigned char *at, double value) {
    const int whole = type == 'i' ? (int)value : 0;
    const ssdgs_real real = (ssdgs_real)value;
    const uint64_t wide = type == 'u' ? (uint64_t)value : 0;
    const void *from = type == 'i' ? (const void *)&whole : type == 'r' ? (const void *)&real : &wide;
    memcpy(at, from, ssdgs__number_size(type));
}

/* Where its value i lies, in bytes. */
static size_t ssdgs__number_at(const ssdgs__number *n, int i) {
    return n->at + (size_t)i * ssdgs__number_size(n->type);
}

static void ssdgs__numbers_preset(const ssdgs__number *list, int count, int preset, void *to) {
    for (const ssdgs__number *n = list; n < list + count; n++)
        for (int i = 0; !i || i < n->count; i++)
            ssdgs__number_put(n->type, (unsigned char *)to + ssdgs__number_at(n, i), n->preset[preset]);
}

/* Ranges are those of files, which hold floats. */
static ssdgs_result ssdgs__number_check(ssdgs_context *context, const char *what, const ssdgs__number *n,
                                        const void *of, double low, double high) {
    for (int i = 0; !i || i < n->count; i++) {
        const double value = ssdgs__number_get(n->type, (const unsigned char *)of + ssdgs__number_at(n, i));
        const char index[4] = {'[', (char)('0' + i), ']', 0};
        const int within = n->type == 'r' ? (float)value >= (float)low && (float)value <= (float)high &&
                                                ssdgs__finite((ssdgs_real)value)
                                          : value >= low && value <= high;
        SSDGS__REFUSE(!within, "%s: %s%s = %g is not within %g .. %g", what, n->name, n->count ? index : "",
                      value, low, high);
    }
    return SSDGS_OK;
}

static ssdgs_result ssdgs__numbers_check(ssdgs_context *context, const char *what, const ssdgs__number *list,
                                         int count, const void *of) {
    ssdgs_result result = SSDGS_OK;
    for (const ssdgs__number *n = list; n < list + count && !result; n++)
        result = ssdgs__number_check(context, what, n, of, n->low, n->high);
    return result;
}

/* Whether Gaussians have colours, f_dc and f_rest, that no light makes; and the first plane of these. */
static int ssdgs__keeps(const ssdgs_settings *s) { return s->baked || s->kept > 0; }
static int ssdgs__kept_plane(const ssdgs_settings *s) { return s->baked ? SSDGS_DIFFUSE : SSDGS_CHANNELS; }

static ssdgs_settings ssdgs__settings_preset(int preset) {
    ssdgs_settings s;
    memset(&s, 0, sizeof s);
    ssdgs__numbers_preset(ssdgs__settings, SSDGS__SETTING_COUNT, preset, &s);
    return s;
}

SSDGS_API ssdgs_settings ssdgs_settings_default(void) { return ssdgs__settings_preset(0); }
SSDGS_API ssdgs_settings ssdgs_settings_published(void) { return ssdgs__settings_preset(1); }

static int ssdgs__is_placed(const ssdgs_settings *s) {
    ssdgs_settings here;
    memset(&here.placement, 0, sizeof here.placement);
    here.placement.scale = 1;
    return memcmp(&s->placement, &here.placement, sizeof here.placement) != 0;
}

/* Where a placed model is drawn, (3,4) as ssdgs_object.to_world. */
static void ssdgs__placement_matrix(const ssdgs_settings *s, ssdgs_real m[12]) {
    double turn[3], q[4]; /* axis times radians, the same as a quaternion */
    for (int i = 0; i < 3; i++) turn[i] = (double)s->placement.turn[i];
    const double angle = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
    q[0] = cos(0.5 * angle);
    for (int i = 0; i < 3; i++) q[1 + i] = angle > 0 ? sin(0.5 * angle) * turn[i] / angle : 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            const int k = 3 - i - j; /* the third axis, where i and j differ */
            const double cross = i == j ? 0 : (j - i + 3) % 3 == 1 ? -q[0] * q[1 + k] : q[0] * q[1 + k];
            const double r = 2 * (q[1 + i] * q[1 + j] + cross) + (i == j ? 2 * q[0] * q[0] - 1 : 0);
            m[4 * i + j] = (ssdgs_real)((double)s->placement.scale * r);
        }
        m[4 * i + 3] = s->placement.move[i];
    }
}

/* Whether, with these terms, light scatters by settings.medium, not by a network. */
static int ssdgs__has_medium(const ssdgs_settings *s, int terms) {
    return !s->scattering.layers && (terms & SSDGS_SCATTERING_TERM);
}

static ssdgs_result ssdgs__settings_check(ssdgs_context *context, const ssdgs_settings *s) {
    if (s->version != SSDGS_VERSION)
        return ssdgs__fail(context, SSDGS_ERR_OPTIONS, "settings: not made by ssdgs_settings_default()");
    SSDGS__REFUSE(s->dipole == 2 || s->dipole == 3,
                  "settings: dipole = %d, %s, was never better and is gone; train with 0 or 1", s->dipole,
                  s->dipole == 2 ? "the released form" : "Burley's profile");
    SSDGS__REFUSE(s->asg == 1, "settings: asg = 1, the released angular form, is gone; train with 0 or 2");
    SSDGS__REFUSE(s->scattering.layers == 1,
                  "settings: scattering.layers = 1, where 0 or 2 .. %d are allowed", SSDGS_MAX_LAYERS);
    const int medium = ssdgs__has_medium(s, s->terms);
    for (const ssdgs__number *n = ssdgs__settings; n < ssdgs__settings + SSDGS__SETTING_COUNT; n++) {
        double low = n->low, high = n->high; /* some depend on others */
        if (n->at == offsetof(ssdgs_settings, harmonics) && !ssdgs__keeps(s)) high = 0;
        if (n->at == offsetof(ssdgs_settings, kept) && s->baked) high = 0;
        if (n->at == offsetof(ssdgs_settings, scattering.width)) low = s->scattering.layers > 1;
        if (n->at == offsetof(ssdgs_settings, shadow.width)) low = s->shadow.layers > 1;
        if (n->at == offsetof(ssdgs_settings, medium.scattering) && medium) low = 1e-12;
        if (n->at >= offsetof(ssdgs_settings, medium.scattering) && !medium)
            high = (double)FLT_MAX, low = -high;
        SSDGS__TRY(ssdgs__number_check(context, "settings", n, s, low, high));
    }
    SSDGS__REFUSE(s->placement.scale < (ssdgs_real)1e-9 && s->placement.scale > (ssdgs_real)-1e-9,
                  "settings: placement.scale = %g is too small", (double)s->placement.scale);
    SSDGS__REFUSE(medium && !s->transport, "settings: a medium needs transport = 1");
    return SSDGS_OK;
}

/* A neutral raw value: grey, opacity 0.1, everything else at the start of training. */
static ssdgs_real ssdgs__neutral(int channel) {
    if (channel == SSDGS_ROTATION || channel == SSDGS_FRAME || channel >= SSDGS_MATERIAL) return 1;
    if (channel == SSDGS_OPACITY) return (ssdgs_real)-2.1972245773362196; /* logit 0.1 */
    if (channel >= SSDGS_DIFFUSE && channel < SSDGS_FRAME) return (ssdgs_real)0.5;
    return channel >= SSDGS_LOG_SCALE && channel < SSDGS_OPACITY ? (ssdgs_real)-4 : 0;
}

/* f_dc of an albedo's raw value. */
static ssdgs_real ssdgs__to_dc(ssdgs_real raw) {
    return (ssdgs_real)(((double)ssdgs__softplus_scalar(raw) - 0.5) / SSDGS__HARMONIC);
}

static void ssdgs__gaussian_reset(ssdgs_real *gaussians, size_t stride, size_t index) {
    for (int i = 0; i < SSDGS_CHANNELS; i++) gaussians[(size_t)i * stride + index] = ssdgs__neutral(i);
}

/* Networks start as PyTorch's linear layers do (uniform within 1 / sqrt(inputs)); the residual shadow
   network's last layer is 0. ASG lobes start spread over the hemisphere, from broad to sharp. */
static void ssdgs__globals_reset(ssdgs_model *model, uint64_t seed) {
    const double pi = 3.14159265358979323846;
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&model->settings, first);
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        ssdgs_real *q = model->globals + 4 * j,
                   *sharpness = model->globals + first[SSDGS__ASG_SHARPNESS] + 2 * j;
        q[0] = (ssdgs_real)cos(pi * j / (2 * SSDGS_ASG_COUNT));
        q[1] = q[2] = 0;
        q[3] = (ssdgs_real)sin(pi * j / (2 * SSDGS_ASG_COUNT)); /* a turn about the normal */
        sharpness[0] = (ssdgs_real)((model->settings.asg == SSDGS_ASG_DEFERRED ? 1.5 : 0.5) + 0.6 * j);
        sharpness[1] = model->settings.asg == SSDGS_ASG_DEFERRED ? 0 : sharpness[0];
    }
    for (int net = 0; net < 2; net++) {
        int sizes[SSDGS_MAX_LAYERS + 1];
        const int layers = ssdgs__network_sizes(&model->settings, net, sizes);
        size_t at = first[net ? SSDGS__SHADOW_NET : SSDGS__SCATTERING_NET];
        for (int layer = 0; layer < layers; layer++) {
            const double bound = 1 / sqrt((double)sizes[layer]);
            const int still = net && layer == layers - 1 && model->settings.residual_shadow;
            for (int i = 0; i < (sizes[layer] + 1) * sizes[layer + 1]; i++, at++)
                model->globals[at] =
                    still ? 0 : (ssdgs_real)(bound * (2 * ssdgs__uniform(seed ^ UINT64_C(0x6E6574), at) - 1));
        }
    }
}

/* Tells a hook to let go of what it has kept for a model or some frames. */
static void ssdgs__tell_released(ssdgs_context *context, const void *what) {
    if (context->gpu.released) context->gpu.released(context->gpu.user, what);
}

static void ssdgs__model_drop(ssdgs_model *model) {
    if (!model || --model->references) return;
    ssdgs_context *context = model->context;
    ssdgs__tell_released(context, model);
    ssdgs__release(context, model->gaussians);
    ssdgs__release(context, model->globals);
    ssdgs__frame_memory_destroy(context, model->frame);
    ssdgs__release(context, model->sky_share.memory);
    ssdgs__release(context, model);
    ssdgs__context_drop(context);
}

static ssdgs_result ssdgs__model_create(ssdgs_context *context, const ssdgs_settings *settings, int count,
                                        ssdgs_model **out) {
    const ssdgs_settings s = settings ? *settings : ssdgs_settings_default();
    if (!out) return ssdgs__null(context, "ssdgs_model_create", "out");
    SSDGS__TRY(ssdgs__settings_check(context, &s));
    SSDGS__REFUSE(count < 0, "a model of %d Gaussians: fewer than 0", count);
    if (count > SSDGS__MAX_GAUSSIANS)
        return ssdgs__fail(context, SSDGS_ERR_LIMIT, "a model of %d Gaussians: over 2^28", count);
    ssdgs_model *model = (ssdgs_model *)ssdgs__allocate(context, sizeof *model);
    if (!model) return SSDGS_ERR_MEMORY;
    model->context = context;
    context->references++;
    model->references = 1;
    model->settings = s;
    model->revision = ++context->revisions;
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&s, first);
    model->global_count = first[SSDGS__GLOBAL_GROUPS];
    model->globals = (ssdgs_real *)ssdgs__allocate(context, model->global_count * sizeof(ssdgs_real));
    model->capacity = (size_t)(count / SSDGS__BLOCK + 1) * SSDGS__BLOCK;
    model->channels = SSDGS_CHANNELS;
    if (ssdgs__keeps(&s)) model->channels = ssdgs__kept_plane(&s) + 3 + 3 * ssdgs__harmonics(s.harmonics);
    const size_t bytes = ssdgs__times(model->capacity, (size_t)model->channels * sizeof(ssdgs_real));
    if (model->globals) model->gaussians = (ssdgs_real *)ssdgs__allocate(context, bytes);
    if (!model->gaussians) {
        ssdgs__model_drop(model);
        return SSDGS_ERR_MEMORY;
    }
    model->count = count;
    for (int c = 0; c < model->channels; c++) {
        const ssdgs_real value = c < (s.baked ? SSDGS_DIFFUSE : SSDGS_CHANNELS) ? ssdgs__neutral(c)
                                 : s.baked && c < SSDGS_HARMONICS ? ssdgs__to_dc(ssdgs__neutral(c))
                                                                  : 0;
        for (size_t i = 0; i < (size_t)count; i++) model->gaussians[(size_t)c * model->capacity + i] = value;
    }
    ssdgs__globals_reset(model, 1);
    *out = model;
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_model_create(ssdgs_context *context, const ssdgs_settings *settings, int count,
                                          ssdgs_model **out) {
    if (out) *out = NULL;
    SSDGS__GUARD(context, context, "ssdgs_model_create", ssdgs__model_create(context, settings, count, out));
}

SSDGS_API void ssdgs_model_destroy(ssdgs_model *model) {
    if (!model || SSDGS__ENTER(model->context, "ssdgs_model_destroy")) return;
    ssdgs_context *context = model->context;
    if (model->references > 1)
        ssdgs__note(context, "ssdgs_model_destroy: a trainer still has the model, which goes with it");
    context->references++;
    ssdgs__model_drop(model);
    ssdgs__leave_and_drop(context);
}

/* No frame and no file may hold networks or ASG that are not finite: all Gaussians share them. */
static ssdgs_result ssdgs__globals_check(const ssdgs_model *model) {
    static const char *const names[SSDGS__GLOBAL_GROUPS] = {"asg_basis", "asg_sharpness", "asg_sigma",
                                                            "the scattering network", "the shadow network"};
    if (model->context->k->within(model->globals, model->global_count, SSDGS__MOST)) return SSDGS_OK;
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&model->settings, first);
    size_t i;
    for (i = 0; ssdgs__finite(model->globals[i]); i++) {}
    int group;
    for (group = 0; i >= first[group + 1]; group++) {}
    return ssdgs__fail(model->context, SSDGS_ERR_NONFINITE, "model: value %zu of %s is not finite",
                       i - first[group], names[group]);
}

static void ssdgs__model_changed(ssdgs_model *model) { model->revision = ++model->context->revisions; }

static ssdgs_model_view ssdgs__model_view(const ssdgs_model *model) {
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&model->settings, first);
    ssdgs_model_view view;
    view.count = model->count;
    view.stride = model->capacity;
    view.channels = model->channels;
    view.gaussians = model->gaussians;
    view.asg_basis = model->globals;
    view.asg_sharpness = model->globals + first[SSDGS__ASG_SHARPNESS];
    view.asg_sigma = model->globals + first[SSDGS__ASG_SIGMA];
    view.scattering = model->globals + first[SSDGS__SCATTERING_NET];
    view.scattering_count = first[SSDGS__SHADOW_NET] - first[SSDGS__SCATTERING_NET];
    view.shadow = model->globals + first[SSDGS__SHADOW_NET];
    view.shadow_count = model->global_count - first[SSDGS__SHADOW_NET];
    return view;
}

SSDGS_API ssdgs_model_view ssdgs_model_peek(const ssdgs_model *model) {
    ssdgs_model_view none;
    memset(&none, 0, sizeof none);
    return model ? ssdgs__model_view(model) : none;
}

SSDGS_API ssdgs_model_view ssdgs_model_arrays(ssdgs_model *model) {
    if (model) ssdgs__model_changed(model);
    return ssdgs_model_peek(model);
}

/* ---- one Gaussian in physical units ---- */

/* log(e^x - 1): what softplus makes x of; -20 for 0. */
static double ssdgs__softplus_inverse(double x) {
    return x < 2.1e-9 ? -SSDGS__RAW_LIMIT : x > 30 ? x : log(expm1(x));
}

static double ssdgs__logit(double x) {
    const double raw = log(x) - log1p(-x);
    return raw < -SSDGS__RAW_LIMIT ? -SSDGS__RAW_LIMIT : raw > SSDGS__RAW_LIMIT ? SSDGS__RAW_LIMIT : raw;
}

/* Turns axes the shortest way that brings the third to a direction; 0 0 0 turns nothing. Both are quaternions
   of any length. to may be from. */
static void ssdgs__turn_to(const ssdgs_real direction[3], const double from[4], double to[4]) {
    ssdgs_real raw[4], q[4], r[9];
    double v[3]; /* the direction in those axes */
    for (int i = 0; i < 4; i++) raw[i] = (ssdgs_real)from[i];
    ssdgs__rotation_scalar(raw, q, r);
    for (int i = 0; i < 3; i++) {
        v[i] = 0;
        for (int j = 0; j < 3; j++) v[i] += (double)r[3 * j + i] * (double)direction[j];
    }
    const double length = hypot(hypot(v[0], v[1]), v[2]);
    for (int i = 0; i < 3 && length > 0; i++) v[i] /= length; /* a long one's quaternion would be infinite */
    double w = 1 + v[2], x = -v[1], y = v[0];
    if (w <= 1e-9) x = 1, w = y = 0; /* straight back */
    const double b = (double)q[1], c = (double)q[2], d = (double)q[3];
    const double a = fabs((double)q[0]) + fabs(b) + fabs(c) + fabs(d) > 0 ? (double)q[0] : 1; /* r is 1 */
    to[0] = a * w - b * x - c * y;
    to[1] = a * x + b * w - d * y;
    to[2] = a * y + c * w + d * x;
    to[3] = b * y - c * x + d * w;
}

static const char *ssdgs__gaussian_wrong(const ssdgs_gaussian *g) {
    const ssdgs_real most = (ssdgs_real)SSDGS__MOST_LIGHT;
    const ssdgs_real values[] = {g->position[0], g->position[1], g->position[2], g->rotation[0],
                                 g->rotation[1], g->rotation[2], g->rotation[3], g->normal[0],
                                 g->normal[1],   g->normal[2]};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        if (!ssdgs__finite(values[i])) return i < 3 ? "position" : i < 7 ? "rotation" : "normal";
    for (int i = 0; i < 3; i++) {
        if (!(g->scale[i] > 0) || !ssdgs__finite(g->scale[i])) return "scale";
        if (!(g->diffuse[i] >= 0 && g->diffuse[i] <= most)) return "diffuse";
        if (!(g->specular[i] >= 0 && g->specular[i] <= most)) return "specular";
        if (!(g->scattering[i] >= 0 && g->scattering[i] <= most)) return "scattering";
        if (i < 2 && (!(g->sharpness[i] > 0) || !ssdgs__finite(g->sharpness[i]))) return "sharpness";
    }
    for (int i = 0; i < SSDGS_MATERIAL_COUNT; i++)
        if (!ssdgs__finite(g->material[i])) return "material";
    if (!(g->opacity >= 0 && g->opacity <= 1)) return "opacity";
    if (!(g->f0 > 0 && g->f0 <= 1)) return "f0";
    return g->softness >= 0 && g->softness <= 1 ? NULL : "softness";
}

/* sqrt(lambda mu) of raw ASG weights `stride` apart: with it c_s is a deferred highlight's energy, however
   narrow, and c_s times it the height of its lobe. */
static ssdgs_real ssdgs__lobe_height(const ssdgs_real *raw, size_t stride) {
    ssdgs_real sum = 0;
    for (int i = 0; i < 2; i++) {
        const ssdgs_real log_sharp = raw[(size_t)i * stride];
        sum += log_sharp > SSDGS__SHARPEST    ? SSDGS__SHARPEST
               : log_sharp < -SSDGS__SHARPEST ? -SSDGS__SHARPEST
                                              : log_sharp;
    }
    return ssdgs__exp_scalar(sum / 2);
}

/* Writes c_s. deferred 1: such that the lobe has the heights `specular`; reads the ASG weights. */
static void ssdgs__specular_store(const ssdgs_real specular[3], int deferred, ssdgs_real *plane,
                                  size_t stride) {
    const double height =
        deferred ? (double)ssdgs__lobe_height(plane + SSDGS_ASG_WEIGHT * stride, stride) : 1;
    for (size_t i = 0; i < 3; i++)
        plane[(SSDGS_SPECULAR + i) * stride] =
            (ssdgs_real)ssdgs__softplus_inverse((double)specular[i] / height);
}

/* The raw parameters of a Gaussian; those of highlights only where the model's are deferred. A frame that
   already has the normal stays unless the Gaussian turns: training has found its tangents. */
static void ssdgs__gaussian_store(const ssdgs_gaussian *g, int deferred, ssdgs_real to[SSDGS_CHANNELS]) {
    double raw[SSDGS_CHANNELS], size = 0;
    const int flat = g->normal[0] == 0 && g->normal[1] == 0 && g->normal[2] == 0;
    double along = 0, length = 0, dot = 0, was = 0;
    for (int i = 0; i < SSDGS_CHANNELS; i++) raw[i] = (double)to[i];
    for (int i = 0; i < 4; i++) {
        const double before = raw[SSDGS_ROTATION + i], now = (double)g->rotation[i];
        raw[SSDGS_ROTATION + i] = now;
        dot += before * now, was += before * before, size += now * now;
    }
    const int turned = !(dot * dot > 0.999999 * was * size);
    if (!(size > 0)) ssdgs__turn_to(g->normal, raw + SSDGS_ROTATION, raw + SSDGS_ROTATION);
    ssdgs_real q[4], r[9];
    ssdgs__rotation_scalar(to + SSDGS_FRAME, q, r);
    for (int i = 0; i < 3; i++) {
        along += (double)r[3 * i + 2] * (double)g->normal[i];
        length += (double)g->normal[i] * (double)g->normal[i];
        raw[SSDGS_POSITION + i] = (double)g->position[i];
        raw[SSDGS_LOG_SCALE + i] = log((double)g->scale[i]);
        raw[SSDGS_DIFFUSE + i] = ssdgs__softplus_inverse((double)g->diffuse[i]);
        raw[SSDGS_SCATTERING + i] = ssdgs__softplus_inverse((double)g->scattering[i]);
    }
    if (flat) memcpy(raw + SSDGS_FRAME, raw + SSDGS_ROTATION, 4 * sizeof *raw);
    else if (turned || !(along > 0.999999 * sqrt(length)))
        ssdgs__turn_to(g->normal, raw + SSDGS_ROTATION, raw + SSDGS_FRAME);
    raw[SSDGS_OPACITY] = ssdgs__logit((double)g->opacity);
    if (deferred) {
        raw[SSDGS_ASG_WEIGHT] = log((double)g->sharpness[0]);
        raw[SSDGS_ASG_WEIGHT + 1] = log((double)g->sharpness[1]);
        raw[SSDGS_ASG_WEIGHT + 2] = ssdgs__logit((double)g->f0) - SSDGS__F0_LOGIT;
        raw[SSDGS_ASG_WEIGHT + 3] = ssdgs__logit((double)g->softness);
    }
    for (int i = 0; i < SSDGS_MATERIAL_COUNT; i++) raw[SSDGS_MATERIAL + i] = (double)g->material[i];
    for (int i = 0; i < SSDGS_CHANNELS; i++) to[i] = (ssdgs_real)raw[i];
    ssdgs__specular_store(g->specular, deferred, to, 1);
}

/* deferred 0: specular is c_s itself, not a lobe's height. */
static void ssdgs__gaussian_load(ssdgs_gaussian *g, int deferred, const ssdgs_real raw[SSDGS_CHANNELS]) {
    const ssdgs_real height = deferred ? ssdgs__lobe_height(raw + SSDGS_ASG_WEIGHT, 1) : 1;
    ssdgs_real q[4], r[9];
    ssdgs__rotation_scalar(raw + SSDGS_FRAME, q, r);
    for (int i = 0; i < 3; i++) {
        g->position[i] = raw[SSDGS_POSITION + i];
        g->scale[i] = ssdgs__exp_scalar(raw[SSDGS_LOG_SCALE + i]);
        g->normal[i] = r[3 * i + 2];
        g->diffuse[i] = ssdgs__softplus_scalar(raw[SSDGS_DIFFUSE + i]);
        g->specular[i] = ssdgs__softplus_scalar(raw[SSDGS_SPECULAR + i]) * height;
        g->scattering[i] = ssdgs__softplus_scalar(raw[SSDGS_SCATTERING + i]);
    }
    ssdgs__rotation_scalar(raw + SSDGS_ROTATION, g->rotation, r);
    g->opacity = ssdgs__sigmoid_scalar(raw[SSDGS_OPACITY]);
    for (int i = 0; i < 2; i++) g->sharpness[i] = ssdgs__exp_scalar(raw[SSDGS_ASG_WEIGHT + i]);
    g->f0 = ssdgs__sigmoid_scalar(raw[SSDGS_ASG_WEIGHT + 2] + (ssdgs_real)SSDGS__F0_LOGIT);
    g->softness = ssdgs__sigmoid_scalar(raw[SSDGS_ASG_WEIGHT + 3]);
    memcpy(g->material, raw + SSDGS_MATERIAL, sizeof g->material);
}

SSDGS_API ssdgs_gaussian ssdgs_gaussian_default(void) {
    ssdgs_real plane[SSDGS_CHANNELS];
    ssdgs__gaussian_reset(plane, 1, 0);
    ssdgs_gaussian g;
    ssdgs__gaussian_load(&g, 1, plane);
    return g;
}

/* One lobe, e^(-u / alpha^2) as Beckmann's is nearly: u = 1 - (n.h)^2, n the pixel's. */
static ssdgs_result ssdgs__gaussian_mirror(ssdgs_model *model, const ssdgs_real roughness[2],
                                           ssdgs_gaussian *gaussian) {
    ssdgs_context *context = model->context;
    const ssdgs_model_view shared = ssdgs__model_view(model);
    if (!roughness || !gaussian)
        return ssdgs__null(context, "ssdgs_gaussian_mirror", roughness ? "gaussian" : "roughness");
    SSDGS__REFUSE(model->settings.asg != SSDGS_ASG_DEFERRED,
                  "ssdgs_gaussian_mirror: the model's highlights are geometric");
    for (int i = 0; i < 2; i++)
        SSDGS__REFUSE(!(roughness[i] >= (ssdgs_real)0.01 && roughness[i] <= 1),
                      "ssdgs_gaussian_mirror: roughness[%d] = %g is not within 0.01 .. 1", i,
                      (double)roughness[i]);
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        shared.asg_sharpness[2 * j] = 0;
        shared.asg_sharpness[2 * j + 1] = -SSDGS__RAW_LIMIT;
        shared.asg_sigma[j] = (ssdgs_real)ssdgs__softplus_inverse(1.0 / SSDGS_ASG_COUNT);
    }
    ssdgs__model_changed(model);
    for (int i = 0; i < 2; i++) gaussian->sharpness[i] = 1 / (roughness[i] * roughness[i]);
    for (int c = 0; c < 3; c++)
        gaussian->specular[c] =
            (ssdgs_real)0.079577471545947668 / (roughness[0] * roughness[1]); /* 1 / (4 pi) */
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_gaussian_mirror(ssdgs_model *model, const ssdgs_real roughness[2],
                                             ssdgs_gaussian *gaussian) {
    SSDGS__GUARD(model, model->context, "ssdgs_gaussian_mirror",
                 ssdgs__gaussian_mirror(model, roughness, gaussian));
}

/* A Gaussian's raw parameters; a baked one's colour as if it were an albedo, and neutral values behind. */
static void ssdgs__gaussian_raw(const ssdgs_model *model, size_t index, ssdgs_real raw[SSDGS_CHANNELS]) {
    const int baked = model->settings.baked;
    ssdgs__gaussian_reset(raw, 1, 0);
    for (int c = 0; c < (baked ? SSDGS_HARMONICS : SSDGS_CHANNELS); c++)
        raw[c] = model->gaussians[(size_t)c * model->capacity + index];
    for (int c = SSDGS_DIFFUSE; c < SSDGS_HARMONICS && baked; c++)
        raw[c] = (ssdgs_real)ssdgs__softplus_inverse(0.5 + SSDGS__HARMONIC * (double)raw[c]);
}

static ssdgs_result ssdgs__gaussian_check(const ssdgs_model *model, const char *function, int index,
                                          const ssdgs_gaussian *gaussian) {
    if (!gaussian) return ssdgs__null(model->context, function, "gaussian");
    if (index >= 0 && index < model->count) return SSDGS_OK;
    return ssdgs__fail(model->context, SSDGS_ERR_ARGUMENT, "%s: there is no Gaussian %d, the model has %d",
                       function, index, model->count);
}

SSDGS_API ssdgs_result ssdgs_model_set(ssdgs_model *model, int index, const ssdgs_gaussian *gaussian) {
    SSDGS__BEGIN(model, model->context, "ssdgs_model_set");
    ssdgs_result result = ssdgs__gaussian_check(model, "ssdgs_model_set", index, gaussian);
    const int baked = model->settings.baked;
    const char *wrong = result ? NULL : ssdgs__gaussian_wrong(gaussian);
    if (wrong)
        result = ssdgs__fail(model->context, SSDGS_ERR_ARGUMENT,
                             "ssdgs_model_set: the %s of Gaussian %d is out of range", wrong, index);
    if (!result) {
        ssdgs__model_changed(model);
        const int deferred = model->settings.asg == SSDGS_ASG_DEFERRED;
        ssdgs_real raw[SSDGS_CHANNELS];
        ssdgs_gaussian was;
        ssdgs__gaussian_raw(model, (size_t)index, raw);
        ssdgs__gaussian_load(&was, deferred, raw);
        ssdgs__gaussian_store(gaussian, deferred, raw);
        for (int c = 0; c < (baked ? SSDGS_HARMONICS : SSDGS_CHANNELS); c++) {
            ssdgs_real *to = model->gaussians + (size_t)c * model->capacity + index;
            const int color = baked && c >= SSDGS_DIFFUSE ? c - SSDGS_DIFFUSE : -1;
            if (color < 0) *to = raw[c];
            else if (memcmp(was.diffuse + color, gaussian->diffuse + color, sizeof *to))
                *to = ssdgs__to_dc(raw[c]); /* else it stays, also below black */
        }
    }
    return ssdgs__leave(model->context, result);
}

SSDGS_API ssdgs_result ssdgs_model_get(const ssdgs_model *model, int index, ssdgs_gaussian *gaussian) {
    SSDGS__BEGIN(model, model->context, "ssdgs_model_get");
    ssdgs_result result = ssdgs__gaussian_check(model, "ssdgs_model_get", index, gaussian);
    ssdgs_real raw[SSDGS_CHANNELS];
    if (!result) {
        ssdgs__gaussian_raw(model, (size_t)index, raw);
        ssdgs__gaussian_load(gaussian, model->settings.asg == SSDGS_ASG_DEFERRED, raw);
    }
    return ssdgs__leave(model->context, result);
}

SSDGS_API int ssdgs_model_count(const ssdgs_model *model) { return model ? model->count : 0; }

SSDGS_API const ssdgs_settings *ssdgs_model_settings(const ssdgs_model *model) {
    return model ? &model->settings : NULL;
}

static int ssdgs__key_compare(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* Puts keys (Gaussians' indices in the low halves) in order: halves them across their longest side, then each
   half, down to 8. A half has a multiple of the largest 8^k below the count, so each node, a run of 8^k, is
   compact. Neighbours then share a block, whose neurons live and die together, the cache, and transport's
   nodes. */
static void ssdgs__split(const ssdgs_real *position, size_t stride, uint64_t *keys, size_t count) {
    while (count > 8) {
        const ssdgs_real *along = position;
        double longest = -1;
        for (size_t c = 0; c < 3; c++) {
            const ssdgs_real *x = position + c * stride;
            double low = 1e30, high = -1e30;
            for (size_t i = 0; i < count; i++) {
                const double at = (double)x[(uint32_t)keys[i]];
                low = at < low ? at : low;
                high = at > high ? at : high;
            }
            if (high - low > longest) longest = high - low, along = x;
        }
        for (size_t i = 0; i < count; i++) {
            const float x = (float)along[(uint32_t)keys[i]];
            uint32_t bits;
            memcpy(&bits, &x, sizeof bits);
            bits = bits >> 31 ? ~bits : bits | 0x80000000u; /* in the order of the numbers */
            keys[i] = (uint64_t)bits << 32 | (uint32_t)keys[i];
        }
        qsort(keys, count, sizeof *keys, ssdgs__key_compare);
        size_t node;
        for (node = 8; 8 * node < count;) node *= 8;
        const size_t half = (count / 2 + node - 1) / node * node;
        ssdgs__split(position, stride, keys, half);
        keys += half;
        count -= half;
    }
}

/* Reorders planes: place i gets what was at index keys[i]. scratch: count values. */
static void ssdgs__arrange(ssdgs_real *planes, int channels, size_t stride, const uint64_t *keys,
                           size_t count, ssdgs_real *scratch) {
    for (size_t c = 0; c < (size_t)channels; c++) {
        ssdgs_real *plane = planes + c * stride;
        for (size_t i = 0; i < count; i++) scratch[i] = plane[(uint32_t)keys[i]];
        memcpy(plane, scratch, count * sizeof *plane);
    }
}

static ssdgs_result ssdgs__model_sort(ssdgs_model *model) {
    const size_t count = (size_t)model->count;
    uint64_t *keys =
        (uint64_t *)ssdgs__allocate(model->context, (count + 1) * (sizeof *keys + sizeof(ssdgs_real)));
    if (!keys) return SSDGS_ERR_MEMORY;
    for (size_t i = 0; i < count; i++) keys[i] = i;
    ssdgs__split(model->gaussians + SSDGS_POSITION * model->capacity, model->capacity, keys, count);
    ssdgs__arrange(model->gaussians, model->channels, model->capacity, keys, count,
                   (ssdgs_real *)(keys + count));
    ssdgs__release(model->context, keys);
    ssdgs__model_changed(model);
    model->arrangement++;
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_model_sort(ssdgs_model *model) {
    SSDGS__GUARD(model, model->context, "ssdgs_model_sort", ssdgs__model_sort(model));
}

/* Gaussians as a file of that version has them become today's: up to 0.2.0 c_s was a deferred lobe's height.
 */
static void ssdgs__gaussians_update(ssdgs_model *model, int version) {
    const int older = version <= 200 && model->settings.asg == SSDGS_ASG_DEFERRED && !model->settings.baked;
    for (size_t i = 0; i < (size_t)model->count && older; i++) {
        ssdgs_gaussian g;
        ssdgs_real raw[SSDGS_CHANNELS];
        ssdgs__gaussian_raw(model, i, raw);
        ssdgs__gaussian_load(&g, 0, raw);
        ssdgs__specular_store(g.specular, 1, model->gaussians + i, model->capacity);
    }
}

/* Notes where a model stands, if not where it was trained. */
static void ssdgs__tell_placement(const ssdgs_model *model, const char *name) {
    const ssdgs_settings *s = &model->settings;
    double angle = 0;
    if (!ssdgs__is_placed(s)) return;
    for (int k = 0; k < 3; k++) angle += (double)s->placement.turn[k] * (double)s->placement.turn[k];
    angle = sqrt(angle);
    const double unit = angle > 0 ? angle : 1;
    ssdgs__note(
        model->context,
        "%s: stands where an editor has put it: turned by %g degrees about (%g, %g, %g), %s%g times as "
        "large, moved by (%g, %g, %g)",
        name, floor(angle * 5729.577951308232 + 0.5) / 100, (double)s->placement.turn[0] / unit,
        (double)s->placement.turn[1] / unit, (double)s->placement.turn[2] / unit,
        s->placement.scale < 0 ? "mirrored, " : "", fabs((double)s->placement.scale),
        (double)s->placement.move[0], (double)s->placement.move[1], (double)s->placement.move[2]);
}

/* Whether a Gaussian's predecessor is often further away than another a little before it: half of the time in
   no order, seldom in ssdgs__split's, however far apart some are. */
static int ssdgs__in_no_order(const ssdgs_model *model) {
    enum { few = 1024, around = 128 }; /* order of few matters little */
    const ssdgs_real *x = model->gaussians + SSDGS_POSITION * model->capacity;
    const size_t n = (size_t)model->count;
    size_t further = 0;
    if (n < few) return 0;
    for (size_t i = around; i < n; i++) {
        const size_t back = 2 + (size_t)(ssdgs__uniform(1, i) * (around - 2));
        double step2 = 0, back2 = 0;
        for (size_t c = 0; c < 3; c++) {
            const ssdgs_real *at = x + c * model->capacity + i;
            const double step = (double)at[0] - (double)*(at - 1),
                         leap = (double)at[0] - (double)*(at - back);
            step2 += step * step;
            back2 += leap * leap;
        }
        further += step2 > back2;
    }
    return further > (n - around) / 3;
}

/* ==== >>frame  what a frame has in memory, and what of it stays for the next ==== */

/* Buffers of a model's or a scene's frames, and of a context. >>begin reserves them. */

typedef struct ssdgs__view_memory {
    ssdgs__buffer light_map, map_tile; /* the view's own; the batches share the rest */
    ssdgs__buffer record, depth, slope, keys, order, instance, of_gaussian, start, list, seen, needed, sums,
        histogram;
    uint64_t chunk_room[SSDGS__BIN_CHUNKS];
} ssdgs__view_memory;

/* Of a light. */
typedef struct ssdgs__light_memory {
    uint64_t key;           /* what its maps and rows depend on */
    uint64_t shadow_key;    /* of the shadow network's outputs that are there */
    uint64_t transport_key; /* of the transport that is there */
    int made, wanted;       /* SSDGS__MADE_*: what is there for the key, what this frame needs */
    int kept;               /* 1: an earlier frame has made all that is wanted */
    int transport_ready;    /* 1: its nodes need not be built */
    int first, views;       /* its views among the frame's */
} ssdgs__light_memory;

enum { SSDGS__MADE_VISIBILITY = 1, SSDGS__MADE_MAP = 2, SSDGS__MADE_CUE = 4, SSDGS__MADE_FLUX = 8 };

/* Of a model or a scene, kept from frame to frame: what the last one found is there for the next. */
typedef struct ssdgs__frame_memory {
    ssdgs__buffer views, view_memory, seen, visibility, cue, flux, nodes, points, lights, shadow_logit,
        shadow_known, transport, transport_known, objects, object_of, material_of, reach;
    int ready;                         /* 1: what the keys stand for is there */
    uint64_t camera_key, walk_key;     /* of the camera's view up to BIN, and up to WALK */
    uint64_t bounds_key;               /* of `scene` */
    int mapped;                        /* lights that ssdgs_scene_shadow() may ask */
    ssdgs_real bias;                   /* the frame's, of pixels */
    uint64_t counts[3 * SSDGS__SLOTS]; /* of the last shading, for the statistics */
    ssdgs__bounds scene;
} ssdgs__frame_memory;

/* Of a context: every frame writes it anew. */
typedef struct ssdgs__scratch {
    ssdgs__buffer shaded, color, component[5], pixels, transmittance, layers, layer_pixels, pixel_visibility,
        pixel_shadow, bounds, image, sources, lightings, layouts, blocks, trees, median, empty, activations,
        scratch;
    ssdgs__buffer slots, lane_slots, view_slots, layer_gradient, highlight_sums, pixel_gradient,
        splat_gradient, color_gradient, gradient, global_gradient, loss, photo_lights;
} ssdgs__scratch;

static void ssdgs__buffers_release(ssdgs_context *context, void *buffers, size_t bytes) {
    for (size_t i = 0; i < bytes / sizeof(ssdgs__buffer); i++)
        ssdgs__release(context, ((ssdgs__buffer *)buffers + i)->memory);
}

static ssdgs_result ssdgs__scratch_create(ssdgs_context *context) {
    if (!context->scratch)
        context->scratch = (ssdgs__scratch *)ssdgs__allocate(context, sizeof *context->scratch);
    return context->scratch ? SSDGS_OK : SSDGS_ERR_MEMORY;
}

static void ssdgs__scratch_destroy(ssdgs_context *context, ssdgs__scratch *scratch) {
    if (!scratch) return;
    ssdgs__buffers_release(context, scratch, sizeof *scratch);
    ssdgs__release(context, scratch);
}

static void ssdgs__frame_memory_destroy(ssdgs_context *context, ssdgs__frame_memory *m) {
    if (!m) return;
    ssdgs__tell_released(context, m);
    for (size_t v = 0; v < m->view_memory.bytes / sizeof(ssdgs__view_memory); v++)
        ssdgs__buffers_release(context, (ssdgs__view_memory *)m->view_memory.memory + v,
                               offsetof(ssdgs__view_memory, chunk_room));
    ssdgs__buffers_release(context, m, offsetof(ssdgs__frame_memory, ready));
    ssdgs__release(context, m);
}

#define SSDGS__RESERVE_BY(reserve, buffer, pointer, type, count) \
    do { \
        SSDGS__TRY(reserve(context, &(buffer), (size_t)(count), sizeof(type))); \
        (pointer) = (type *)(buffer).memory; \
    } while (0)
#define SSDGS__RESERVE(buffer, pointer, type, count) \
    SSDGS__RESERVE_BY(ssdgs__reserve, buffer, pointer, type, count)
#define SSDGS__KEEP(buffer, pointer, type, count) /* what is there stays */ \
    SSDGS__RESERVE_BY(ssdgs__grow, buffer, pointer, type, count)

SSDGS_API void ssdgs_context_trim(ssdgs_context *context) {
    if (!context || SSDGS__ENTER(context, "ssdgs_context_trim")) return;
    ssdgs__scratch_destroy(context, context->scratch);
    context->scratch = NULL;
    (void)ssdgs__leave(context, SSDGS_OK);
}

static ssdgs_result ssdgs__model_move(ssdgs_model *model, ssdgs_context *to) {
    ssdgs_context *from = model->context;
    if (model->references > 1)
        return ssdgs__fail(from, SSDGS_ERR_ARGUMENT, "ssdgs_model_move: a trainer has the model");
    if (memcmp(&from->allocator, &to->allocator, sizeof from->allocator) != 0)
        return ssdgs__fail(from, SSDGS_ERR_ARGUMENT, "ssdgs_model_move: the contexts' allocators differ");
    ssdgs__tell_released(from, model);
    ssdgs__frame_memory_destroy(from, model->frame);
    model->frame = NULL;
    model->context = to;
    model->revision = ++to->revisions;
    model->box_revision = 0; /* they counted in `from` */
    model->sky_share_revision = 0;
    to->references++;
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_model_move(ssdgs_model *model, ssdgs_context *to) {
    if (!model) return SSDGS_ERR_ARGUMENT;
    ssdgs_context *from = model->context;
    ssdgs_result result = SSDGS__ENTER(from, "ssdgs_model_move");
    if (!result && !to) return ssdgs__leave(from, ssdgs__null(from, "ssdgs_model_move", "to"));
    if (result || from == to) return result ? result : ssdgs__leave(from, SSDGS_OK);
    if (SSDGS__ENTER(to, "ssdgs_model_move"))
        return ssdgs__leave(from, ssdgs__fail(from, SSDGS_ERR_ARGUMENT,
                                              "ssdgs_model_move: a call on the other context is at work"));
    result = ssdgs__model_move(model, to);
    (void)ssdgs__leave(to, SSDGS_OK);
    if (result) return ssdgs__leave(from, result);
    ssdgs__leave_and_drop(from);
    return SSDGS_OK;
}

/* ==== >>camera  cameras and lights by their values ==== */

/* Reads the caller's values. Writes ssdgs_camera and ssdgs_light; a light map's views look along too. */

/* c = a x b */
static void ssdgs__cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* View axes (right, down, forward) looking along `forward` from `eye`. The image's up is `up` or, where that
   is NULL or along forward, the axis least along forward. */
static void ssdgs__look_along(const double eye[3], const double forward[3], const double up[3],
                              ssdgs_real view[12]) {
    double best = 2;
    int axis = 0;
    double length = sqrt(forward[0] * forward[0] + forward[1] * forward[1] + forward[2] * forward[2]);
    double f[3];
    for (int i = 0; i < 3; i++)
        f[i] = length > 0 && length < 1e300 ? forward[i] / length : (i == 2); /* no direction: any */
    double u[3];
    for (int i = 0; i < 3; i++) {
        u[i] = up ? up[i] : 0;
        if (fabs(f[i]) < best) {
            best = fabs(f[i]);
            axis = i;
        }
    }
    double r[3];
    for (;;) { /* an up along the view is replaced */
        ssdgs__cross(f, u, r);
        length = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
        if (length > 1e-6 * sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) && length < 1e300) break;
        u[0] = u[1] = u[2] = 0;
        u[axis] = 1;
    }
    for (int i = 0; i < 3; i++) r[i] /= length;
    double d[3];
    ssdgs__cross(f, r, d);
    for (int i = 0; i < 3; i++) {
        view[i] = (ssdgs_real)r[i];
        view[4 + i] = (ssdgs_real)d[i];
        view[8 + i] = (ssdgs_real)f[i];
    }
    view[3] = (ssdgs_real) - (r[0] * eye[0] + r[1] * eye[1] + r[2] * eye[2]);
    view[7] = (ssdgs_real) - (d[0] * eye[0] + d[1] * eye[1] + d[2] * eye[2]);
    view[11] = (ssdgs_real) - (f[0] * eye[0] + f[1] * eye[1] + f[2] * eye[2]);
}

static void ssdgs__camera_centre(const ssdgs_camera *camera, double centre[3]) {
    for (int j = 0; j < 3; j++) {
        centre[j] = 0;
        for (int l = 0; l < 3; l++)
            centre[j] -= (double)camera->view[4 * l + j] * (double)camera->view[4 * l + 3];
    }
}

SSDGS_API ssdgs_camera ssdgs_camera_look_at(const ssdgs_real eye[3], const ssdgs_real target[3],
                                            const ssdgs_real up[3], ssdgs_real fov_x, int width, int height) {
    ssdgs_camera camera;
    memset(&camera, 0, sizeof camera);
    if (!eye || !target || !up) return camera;
    double e[3], f[3], u[3];
    for (int i = 0; i < 3; i++) {
        e[i] = (double)eye[i];
        f[i] = (double)target[i] - (double)eye[i];
        u[i] = (double)up[i];
    }
    ssdgs__look_along(e, f, u, camera.view);
    camera.width = width;
    camera.height = height;
    const int sees =
        fov_x > 0 && (double)fov_x < 3.14159265358979323846 && f[0] * f[0] + f[1] * f[1] + f[2] * f[2] > 0;
    camera.fx = camera.fy = sees ? (ssdgs_real)(0.5 * width / tan(0.5 * (double)fov_x)) : 0;
    camera.cx = (ssdgs_real)width / 2;
    camera.cy = (ssdgs_real)height / 2;
    return camera;
}

static ssdgs_light ssdgs__light_of(ssdgs_light_kind kind, const ssdgs_real *position,
                                   const ssdgs_real *direction, const ssdgs_real *intensity) {
    ssdgs_light light;
    double length2 = 0;
    memset(&light, 0, sizeof light);
    light.kind = kind;
    for (int i = 0; direction && i < 3; i++) length2 += (double)direction[i] * (double)direction[i];
    const double inverse = fabs(length2 - 1) < 1e-6 || !(length2 > 0) ? 1 : 1 / sqrt(length2);
    for (int i = 0; i < 3; i++) {
        if (position) light.position[i] = position[i];
        if (intensity) light.intensity[i] = intensity[i];
        if (direction) light.direction[i] = (ssdgs_real)((double)direction[i] * inverse);
    }
    return light;
}

SSDGS_API ssdgs_light ssdgs_light_point(const ssdgs_real position[3], const ssdgs_real intensity[3]) {
    return ssdgs__light_of(SSDGS_LIGHT_POINT, position, NULL, intensity);
}

SSDGS_API ssdgs_light ssdgs_light_directional(const ssdgs_real direction[3], const ssdgs_real irradiance[3]) {
    return ssdgs__light_of(SSDGS_LIGHT_DIRECTIONAL, NULL, direction, irradiance);
}

SSDGS_API ssdgs_light ssdgs_light_spot(const ssdgs_real position[3], const ssdgs_real direction[3],
                                       const ssdgs_real intensity[3], ssdgs_real inner, ssdgs_real outer) {
    ssdgs_light light = ssdgs__light_of(SSDGS_LIGHT_SPOT, position, direction, intensity);
    light.cone[0] = inner;
    light.cone[1] = outer;
    return light;
}

SSDGS__SMALL_BEGIN

static ssdgs_result ssdgs__camera_check(ssdgs_context *context, const ssdgs_camera *c, int mirrored) {
    SSDGS__REFUSE(c->width < 1 || c->height < 1 || c->width > SSDGS__MAX_SIDE || c->height > SSDGS__MAX_SIDE,
                  "camera: %d x %d pixels", c->width, c->height);
    SSDGS__REFUSE(!(c->fx > 0) || !(c->fy > 0) || !ssdgs__finite(c->fx) || !ssdgs__finite(c->fy) ||
                      !ssdgs__finite(c->cx) || !ssdgs__finite(c->cy) || !(c->near_plane >= 0) ||
                      !ssdgs__finite(c->near_plane),
                  "camera: fx = %g, fy = %g, cx = %g, cy = %g, near_plane = %g: focal "
                  "lengths must be positive, near_plane not negative, all finite%s",
                  (double)c->fx, (double)c->fy, (double)c->cx, (double)c->cy, (double)c->near_plane,
                  c->fx > 0 || c->fx < 0 ? "" : "; is eye target, or the field of view in degrees?");
    for (int i = 0; i < 12; i++)
        if (!ssdgs__finite(c->view[i]))
            return ssdgs__fail(context, SSDGS_ERR_NONFINITE, "camera: view[%d] is not finite", i);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++) {
            const ssdgs_real *a = c->view + 4 * i, *b = c->view + 4 * j;
            const double dot = (double)(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
            SSDGS__REFUSE(fabs(dot - (i == j)) > 1e-3, "camera: the rows of view are not orthonormal");
        }
    const double determinant = (double)(c->view[0] * (c->view[5] * c->view[10] - c->view[6] * c->view[9]) -
                                        c->view[1] * (c->view[4] * c->view[10] - c->view[6] * c->view[8]) +
                                        c->view[2] * (c->view[4] * c->view[9] - c->view[5] * c->view[8]));
    SSDGS__REFUSE(determinant < 0 && !mirrored, "camera: view is a mirror image");
    return SSDGS_OK;
}

/* An engine's matrix, row after row. */
static ssdgs_result ssdgs__engine_matrix(ssdgs_context *context, const ssdgs_real *from, int flags,
                                         const char *name, double to[16]) {
    SSDGS__REFUSE(flags & ~(SSDGS_COLUMN_MAJOR | SSDGS_CLIP_Y_DOWN | SSDGS_CLIP_Z_FROM_0),
                  "camera: flags = %d", flags);
    for (int i = 0; i < 16; i++) {
        const ssdgs_real value = from[flags & SSDGS_COLUMN_MAJOR ? i % 4 * 4 + i / 4 : i];
        to[i] = (double)value;
        if (!ssdgs__finite(value))
            return ssdgs__fail(context, SSDGS_ERR_NONFINITE, "camera: row %d, column %d of %s is not finite",
                               i / 4, i % 4, name);
    }
    return SSDGS_OK;
}

static ssdgs_result ssdgs__projection_matrix(ssdgs_context *context, const ssdgs_real *from, int flags,
                                             double p[16]) {
    SSDGS__TRY(ssdgs__engine_matrix(context, from, flags, "projection", p));
    SSDGS__REFUSE(p[14] == 0 || fabs(p[12]) + fabs(p[13]) + fabs(p[15]) > 1e-6 * fabs(p[14]),
                  "camera: the last row of projection is not 0 0 +-1 0: it is no perspective, or its "
                  "elements are in the other order");
    SSDGS__REFUSE(p[0] == 0 || p[5] == 0 || fabs(p[1]) + fabs(p[3]) > 1e-6 * fabs(p[0]) ||
                      fabs(p[4]) + fabs(p[7]) > 1e-6 * fabs(p[5]),
                  "camera: projection shears, shifts or is flat");
    return SSDGS_OK;
}

static ssdgs_result ssdgs__camera_from_matrices(ssdgs_context *context, const ssdgs_real *view,
                                                const ssdgs_real *projection, int flags, int width,
                                                int height, ssdgs_camera *out) {
    double v[16], p[16];
    if (!view || !projection || !out)
        return ssdgs__null(context, "ssdgs_camera_from_matrices",
                           !view         ? "view"
                           : !projection ? "projection"
                                         : "out");
    SSDGS__TRY(ssdgs__engine_matrix(context, view, flags, "view", v));
    SSDGS__REFUSE(fabs(v[12]) + fabs(v[13]) + fabs(v[14]) > 1e-6 || fabs(v[15] - 1) > 1e-6,
                  "camera: the last row of view is not 0 0 0 1: is it the other order of elements?");
    SSDGS__TRY(ssdgs__projection_matrix(context, projection, flags, p));
    const double w = p[14], size = fabs(w);
    const double down = flags & SSDGS_CLIP_Y_DOWN ? 1 : -1;
    const double sign[3] = {p[0] > 0 ? 1.0 : -1.0, p[5] * down > 0 ? 1.0 : -1.0, w > 0 ? 1.0 : -1.0};
    ssdgs_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.width = width;
    camera.height = height;
    camera.fx = (ssdgs_real)(0.5 * width * fabs(p[0]) / size);
    camera.fy = (ssdgs_real)(0.5 * height * fabs(p[5]) / size);
    camera.cx = (ssdgs_real)(0.5 * width * (1 + p[2] / w));
    camera.cy = (ssdgs_real)(0.5 * height * (1 + down * p[6] / w));
    for (int i = 0; i < 12; i++) camera.view[i] = (ssdgs_real)(sign[i / 4] * v[i]);
    const ssdgs_result result = ssdgs__camera_check(context, &camera, 1);
    if (!result) *out = camera;
    return result;
}

SSDGS_API ssdgs_result ssdgs_camera_from_matrices(ssdgs_context *context, const ssdgs_real view[16],
                                                  const ssdgs_real projection[16], int flags, int width,
                                                  int height, ssdgs_camera *out) {
    SSDGS__GUARD(context, context, "ssdgs_camera_from_matrices",
                 ssdgs__camera_from_matrices(context, view, projection, flags, width, height, out));
}

/* depth = scale / (z - a x - b y - c), with clip z of the buffer's value and the pixel's column and row. */
typedef struct ssdgs__depth_job {
    double scale, a, b, c;
    const float *buffer;
    ptrdiff_t pitch;
    int width, height, from_0;
    ssdgs_real *depth;
} ssdgs__depth_job;

static void ssdgs__depth_task(void *data, int index) {
    const ssdgs__depth_job *job = (const ssdgs__depth_job *)data;
    for (int y = SSDGS__BAND * index; y < SSDGS__BAND * (index + 1) && y < job->height; y++) {
        const char *row = (const char *)job->buffer + y * job->pitch;
        ssdgs_real *to = job->depth + (size_t)y * (size_t)job->width;
        for (int x = 0; x < job->width; x++) {
            float value;
            memcpy(&value, row + (size_t)x * sizeof value, sizeof value);
            const double z = job->from_0 ? (double)value : 2 * (double)value - 1;
            to[x] = (ssdgs_real)(job->scale / (z - (job->a * x + job->b * y + job->c)));
        }
    }
}

SSDGS_API ssdgs_result ssdgs_depth_from_buffer(ssdgs_context *context, const ssdgs_real projection[16],
                                               int flags, const float *buffer, ptrdiff_t pitch, int width,
                                               int height, ssdgs_real *depth) {
    double p[16];
    SSDGS__BEGIN(context, context, "ssdgs_depth_from_buffer");
    ssdgs_result result = !projection || !buffer || !depth
                              ? ssdgs__null(context, "ssdgs_depth_from_buffer",
                                            !projection ? "projection"
                                            : !buffer   ? "buffer"
                                                        : "depth")
                              : ssdgs__projection_matrix(context, projection, flags, p);
    if (!result && (width < 1 || width > SSDGS__MAX_SIDE || height < 1 || height > SSDGS__MAX_SIDE ||
                    (height > 1 && pitch < 4 * width && -pitch < 4 * width)))
        result = ssdgs__fail(context, SSDGS_ERR_ARGUMENT, "depth buffer: %d x %d pixels, pitch %g", width,
                             height, (double)pitch);
    if (!result && p[11] == 0)
        result = ssdgs__fail(context, SSDGS_ERR_ARGUMENT,
                             "depth buffer: row 2, column 3 of projection is 0: its depths are all the same");
    if (result) return ssdgs__leave(context, result);
    /* clip z = p8 x + p9 y + p10 z + p11; clip x = p0 x + p2 z = (2 (column + 1/2) / width - 1) w; y alike */
    const double by_x = p[8] / p[0], by_y = p[9] / p[5], down = flags & SSDGS_CLIP_Y_DOWN ? 1 : -1;
    ssdgs__depth_job job;
    job.scale = p[11] / fabs(p[14]);
    job.a = by_x * 2 / width;
    job.b = by_y * 2 / height * down;
    job.c = by_x * (1.0 / width - 1 - p[2] / p[14]) + by_y * (down * (1.0 / height - 1) - p[6] / p[14]) +
            p[10] / p[14];
    job.buffer = buffer;
    job.pitch = pitch;
    job.width = width;
    job.height = height;
    job.from_0 = flags & SSDGS_CLIP_Z_FROM_0;
    job.depth = depth;
    ssdgs__parallel(context, (height - 1) / SSDGS__BAND + 1, ssdgs__depth_task, &job);
    return ssdgs__leave(context, SSDGS_OK);
}

SSDGS__SMALL_END

/* ==== >>objects  placed models: their spaces, checks and bounds ==== */

/* Reads ssdgs_object and raw parameters. Writes bounds of what is drawn. Stages walk objects piece by piece.
 */

/* From the world to the object's space. */
static void ssdgs__to_object(const ssdgs_placed *o, const ssdgs_real world[3], ssdgs_real local[3]) {
    double d[3];
    for (int i = 0; i < 3; i++) d[i] = ((double)world[i] - (double)o->offset[i]) / (double)o->scale;
    for (int i = 0; i < 3; i++)
        local[i] = (ssdgs_real)((double)o->rotation[i] * d[0] + (double)o->rotation[3 + i] * d[1] +
                                (double)o->rotation[6 + i] * d[2]);
}

/* A direction, from the object's space to the world or back. */
static void ssdgs__turn(const ssdgs_placed *o, int back, const ssdgs_real from[3], ssdgs_real to[3]) {
    const ssdgs_real x = from[0], y = from[1], z = from[2], *r = o->rotation;
    for (int i = 0; i < 3; i++) {
        const int at = back ? i : 3 * i, step = back ? 3 : 1;
        to[i] = r[at] * x + r[at + step] * y + r[at + 2 * step] * z;
    }
}

/* The object that Gaussian g of the frame belongs to, or stands behind in its gap. */
static const ssdgs_placed *ssdgs__object_of(const ssdgs_frame *frame, int g) {
    return frame->objects + (frame->object_of ? frame->object_of[g / SSDGS__BLOCK] : 0);
}

static int ssdgs__chunks(int count) { return count / SSDGS__CHUNK + (count % SSDGS__CHUNK > 0); }

static int ssdgs__chunk_end(const ssdgs_frame *frame, int chunk) {
    return frame->count / SSDGS__CHUNK > chunk ? (chunk + 1) * SSDGS__CHUNK : frame->count;
}

/* Some Gaussians of one object, in its own numbers. */
typedef struct ssdgs__piece {
    const ssdgs_placed *object;
    int begin, end, gap; /* the gap's Gaussians follow end */
} ssdgs__piece;

/* Takes from the frame's Gaussians *at .. end those of one object; 0 when none are left. */
static int ssdgs__piece_next(const ssdgs_frame *frame, int *at, int end, ssdgs__piece *piece) {
    if (*at >= end) return 0;
    const ssdgs_placed *o = ssdgs__object_of(frame, *at), *next = o + 1;
    const int last = next < frame->objects + frame->object_count && next->first < end ? next->first : end;
    const int count = o->gaussians.count;
    piece->object = o;
    piece->begin = *at - o->first < count ? *at - o->first : count;
    piece->end = last - o->first < count ? last - o->first : count;
    piece->gap = last - o->first - piece->end;
    *at = last;
    return 1;
}

SSDGS__SMALL_BEGIN

/* The square of the scale of a transform (3,4). */
static double ssdgs__scale2(const ssdgs_real m[12]) {
    double sum = 0;
    for (int i = 0; i < 9; i++) sum += (double)m[i / 3 * 4 + i % 3] * (double)m[i / 3 * 4 + i % 3];
    return sum / 3;
}

static ssdgs_result ssdgs__objects_check(ssdgs_context *context, const ssdgs_object *objects, int count) {
    int64_t gaussians = 0;
    int drawn = 0;
    const ssdgs_model *first = NULL;
    SSDGS__REFUSE(count < 0 || (count && !objects),
                  count < 0 ? "%d objects" : "%d objects, but the array is NULL", count);
    for (int i = 0; i < count; i++) {
        const ssdgs_object *o = objects + i;
        const double length2 = ssdgs__scale2(o->to_world);
        SSDGS__REFUSE(
            !o->model || o->model->context != context,
            o->model ? "object %d: its model is of another context" : "object %d: its model is NULL", i);
        for (int j = 0; j < 12; j++)
            if (!ssdgs__finite(o->to_world[j]))
                return ssdgs__fail(context, SSDGS_ERR_NONFINITE, "object %d: to_world[%d] is not finite", i,
                                   j);
        SSDGS__REFUSE(!(length2 >= 1e-24 && length2 <= 1e24), "object %d: to_world's scale is %g", i,
                      sqrt(length2));
        for (int j = 0; j < 9; j++) {
            const ssdgs_real *a = o->to_world + j / 3 * 4, *b = o->to_world + j % 3 * 4;
            const double dot =
                (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
            SSDGS__REFUSE(!(fabs(dot / length2 - (j % 4 == 0)) <= 1e-3),
                          "object %d: to_world is not a rotation times one scale", i);
        }
        for (int j = 0; j < 3; j++)
            SSDGS__REFUSE(!(o->tint[j] >= 0) || !ssdgs__finite(o->tint[j]),
                          "object %d: tint[%d] = %g is negative or not finite", i, j, (double)o->tint[j]);
        SSDGS__REFUSE(!(o->roughness >= (ssdgs_real)0.1 && o->roughness <= 10) ||
                          !(o->translucency >= (ssdgs_real)0.1 && o->translucency <= 10) ||
                          !(o->specular >= 0 && o->specular <= (ssdgs_real)1e6) ||
                          !(o->kept >= 0 && o->kept <= (ssdgs_real)1e6) ||
                          !(o->presence >= 0 && o->presence <= 1),
                      "object %d: roughness = %g, specular = %g, translucency = %g, kept = %g, presence = "
                      "%g, where 0.1 .. 10, 0 .. 1e6, 0.1 .. 10, 0 .. 1e6 and 0 .. 1 are allowed; "
                      "ssdgs_object_default() sets them",
                      i, (double)o->roughness, (double)o->specular, (double)o->translucency, (double)o->kept,
                      (double)o->presence);
        SSDGS__REFUSE(o->level_count < 0 || (o->level_count && !o->levels),
                      o->level_count < 0 ? "object %d: %d levels"
                                         : "object %d: %d levels, but the array is NULL",
                      i, o->level_count);
        for (int j = 0; j < o->level_count; j++) {
            const ssdgs_model *level = o->levels[j], *before = j ? o->levels[j - 1] : o->model;
            SSDGS__REFUSE(
                !level || level->context != context ||
                    level->settings.transfer != o->model->settings.transfer ||
                    level->settings.baked != o->model->settings.baked,
                "object %d: level %d is NULL or has another context, settings.transfer or settings.baked", i,
                j);
            SSDGS__REFUSE(5 * (int64_t)level->count > 4 * (int64_t)before->count,
                          "object %d: level %d has %d Gaussians, over four fifths of the %d before it", i, j,
                          level->count, before->count);
        }
        if (!o->model->settings.baked) {
            SSDGS__REFUSE(first && first->settings.transfer != o->model->settings.transfer,
                          "object %d: its settings.transfer is not that of the objects before it", i);
            first = o->model;
        }
        for (int j = 0; j < 1 + (o->level_count > 0); j++, drawn++) /* two may fade into each other */
            gaussians +=
                ((j ? o->levels[0] : o->model)->count + SSDGS__BLOCK - 1) / SSDGS__BLOCK * SSDGS__BLOCK;
    }
    if (drawn > (int)UINT16_MAX) return ssdgs__fail(context, SSDGS_ERR_LIMIT, "a scene of %d objects", count);
    if (gaussians > SSDGS__MAX_GAUSSIANS)
        return ssdgs__fail(context, SSDGS_ERR_LIMIT, "a scene of more than %d Gaussians",
                           SSDGS__MAX_GAUSSIANS);
    return SSDGS_OK;
}

SSDGS__SMALL_END

/* Where a Gaussian reaches in the world, and its mean log scale; 0 where alpha_threshold, by its logit, lets
   it draw nothing. */
static int ssdgs__gaussian_box(const ssdgs_placed *o, int index, ssdgs_real faint, double low[3],
                               double high[3], double *log_scale) {
    const ssdgs_model_view *g = &o->gaussians;
    const ssdgs_real *p = g->gaussians + index;
    ssdgs_real largest = -SSDGS__RAW_LIMIT;
    int usable = p[SSDGS_OPACITY * g->stride] >= faint, j;
    for (j = 0; j < SSDGS_LOG_SCALE; j++) usable = usable && ssdgs__finite(p[(size_t)j * g->stride]);
    for (*log_scale = 0; j < SSDGS_OPACITY;
         j++) { /* at the upper clamp it would leave no pixel to the others; NaN fails too */
        const ssdgs_real s = p[(size_t)j * g->stride];
        usable = usable && s < SSDGS__RAW_LIMIT;
        largest = s > largest ? s : largest;
        *log_scale += (double)(s > -SSDGS__RAW_LIMIT ? s : -SSDGS__RAW_LIMIT) / 3;
    }
    if (!usable) return 0;
    const double scale = (double)o->scale, reach = scale * (double)(3 * ssdgs__exp_scalar(largest));
    *log_scale += log(scale);
    for (j = 0; j < 3; j++) {
        double at = 0;
        for (int i = 0; i < 3; i++) at += (double)o->rotation[3 * j + i] * (double)p[(size_t)i * g->stride];
        at = scale * at + (double)o->offset[j];
        low[j] = at - reach;
        high[j] = at + reach;
    }
    return 1;
}

/* Adds a box of some Gaussians, and the sum of their log scales. */
static void ssdgs__bounds_add(ssdgs__bounds *b, const double low[3], const double high[3], double log_scale,
                              int count) {
    for (int c = 0; c < 3 && count; c++) {
        b->low[c] = b->count && b->low[c] < low[c] ? b->low[c] : low[c];
        b->high[c] = b->count && b->high[c] > high[c] ? b->high[c] : high[c];
    }
    b->log_scale += log_scale;
    b->count += count;
}

typedef struct ssdgs__bounds_job {
    const ssdgs_frame *frame;
    ssdgs__bounds *chunk;
    ssdgs_real faint;
} ssdgs__bounds_job;

static void ssdgs__bounds_task(void *data, int index) {
    const ssdgs__bounds_job *job = (const ssdgs__bounds_job *)data;
    const ssdgs_frame *frame = job->frame;
    ssdgs__bounds *b = job->chunk + index;
    ssdgs__piece piece;
    const int end = ssdgs__chunk_end(frame, index);
    memset(b, 0, sizeof *b);
    for (int at = index * SSDGS__CHUNK; ssdgs__piece_next(frame, &at, end, &piece);)
        for (int i = piece.begin; i < piece.end; i++) {
            double low[3], high[3], log_scale;
            if (ssdgs__gaussian_box(piece.object, i, job->faint, low, high, &log_scale))
                ssdgs__bounds_add(b, low, high, log_scale, 1);
        }
}

/* Keeps the `keep` least of the numbers it is shown, in order. */
static void ssdgs__keep_least(double *least, int keep, double number) {
    int i = keep - 1;
    if (number >= least[i]) return;
    for (; i > 0 && least[i - 1] > number; i--) least[i] = least[i - 1];
    least[i] = number;
}

/* Cuts what a few stray Gaussians add to the bounds: these stay within thrice the box that, on each side, one
   in 200 of a sample reaches beyond. A light's map that had to hold them would have few pixels left for the
   scene. */
static void ssdgs__cut_strays(const ssdgs_frame *frame, ssdgs_real faint, ssdgs__bounds *total) {
    enum { sample = 4096, keep = sample / 200 + 1 };
    double least[6][keep];
    int seen = 0;
    for (int i = 0; i < 6 * keep; i++) least[i / keep][i % keep] = 1e300;
    for (int i = 0; i < frame->count; i += 1 + (frame->count - 1) / sample) {
        const ssdgs_placed *o = ssdgs__object_of(frame, i);
        double low[3], high[3], log_scale;
        if (i - o->first >= o->gaussians.count ||
            !ssdgs__gaussian_box(o, i - o->first, faint, low, high, &log_scale))
            continue;
        seen++;
        for (int j = 0; j < 3; j++) {
            ssdgs__keep_least(least[j], keep, low[j]);
            ssdgs__keep_least(least[3 + j], keep, -high[j]);
        }
    }
    for (int j = 0; j < 3 && seen; j++) {
        const double from = least[j][seen / 200], to = -least[3 + j][seen / 200], margin = to - from;
        if (from - margin > total->low[j]) total->low[j] = from - margin;
        if (to + margin < total->high[j]) total->high[j] = to + margin;
    }
}

/* The bounds of what alpha_threshold lets draw. */
static ssdgs_result ssdgs__scene_bounds(const ssdgs_frame *frame, ssdgs__bounds *total) {
    ssdgs_context *context = frame->context;
    const int chunks = ssdgs__chunks(frame->count);
    const double threshold = (double)frame->options.alpha_threshold;
    ssdgs__bounds_job job;
    SSDGS__RESERVE(frame->scratch->bounds, job.chunk, ssdgs__bounds, chunks + 1);
    job.frame = frame;
    job.faint = threshold > 1e-9 ? (ssdgs_real)log(threshold) : -21; /* below the logit, by little */
    ssdgs__parallel(context, chunks, ssdgs__bounds_task, &job);
    memset(total, 0, sizeof *total);
    for (const ssdgs__bounds *b = job.chunk; b < job.chunk + chunks; b++)
        ssdgs__bounds_add(total, b->low, b->high, b->log_scale, b->count);
    if (total->count) total->log_scale /= total->count;
    ssdgs__cut_strays(frame, job.faint, total);
    return SSDGS_OK;
}

/* A model in its own space. */
static ssdgs_object ssdgs__object_alone(ssdgs_model *model) {
    ssdgs_object object;
    memset(&object, 0, sizeof object);
    object.model = model;
    for (int i = 0; i < 3; i++) object.to_world[5 * i] = object.tint[i] = 1;
    object.roughness = object.specular = object.translucency = object.presence = 1;
    if (model) object.kept = model->settings.baked ? 1 : model->settings.kept;
    return object;
}

/* ==== >>lights  what a light reaches, and the views of its map ==== */

/* Reads lights and bounds. Writes ssdgs_splat_view. Called by >>begin; stages ask who is in reach. */

static void ssdgs__light_blur(const ssdgs_settings *s, int *blur, ssdgs_real *variance, int *compensate) {
    *blur = s->light_map.blur;
    *compensate = *blur == SSDGS_BLUR_FLOOR;
    *variance = (ssdgs_real)(*compensate ? 0.2 : 0.3);
}

SSDGS__SMALL_BEGIN

/* Whether a light is not dark, or its shadow takes from what is kept. */
static int ssdgs__shines(const ssdgs_light *light) {
    return light->intensity[0] > 0 || light->intensity[1] > 0 || light->intensity[2] > 0 || light->kept > 0;
}

/* Whether it has a map. */
static int ssdgs__casts(const ssdgs_light *light) { return !light->unshadowed && ssdgs__shines(light); }

/* Whether a light's direction matters. */
static int ssdgs__aimed(const ssdgs_light *light) {
    return light->kind == SSDGS_LIGHT_SPOT || (light->kind == SSDGS_LIGHT_POINT && light->focus > 0);
}

/* Where it is; of a directional one, the unit vector towards it. */
static void ssdgs__light_place(const ssdgs_light *light, ssdgs_real place[3]) {
    for (int i = 0; i < 3; i++)
        place[i] = light->kind == SSDGS_LIGHT_DIRECTIONAL ? -light->direction[i] : light->position[i];
}

/* Whether it does not reach everything as 1 / distance^2. */
static int ssdgs__limited(const ssdgs_light *light) {
    return ssdgs__aimed(light) || (light->kind == SSDGS_LIGHT_POINT && light->range > 0);
}

/* Which objects a light (-1: the camera) reaches: its row (objects); NULL, as with one object: all. */
static const unsigned char *ssdgs__reach(const ssdgs_frame *frame, int light) {
    return frame->reach ? frame->reach + (ptrdiff_t)(light + 1) * frame->object_count : NULL;
}

/* Whether an object is out of the reach of a light, or with -1 the camera: nothing is known of it or asked.
 */
static int ssdgs__out_of_reach(const ssdgs_frame *frame, int light, const ssdgs_placed *o) {
    const unsigned char *reach = ssdgs__reach(frame, light);
    return reach && !reach[o - frame->objects];
}

/* Moves *at to the next Gaussian, before end, of an object that the light (-1: the camera) reaches; *stop
   ends its run. 0: there is none. For the others the stages up to WALK set nothing. */
static int ssdgs__reached_next(const ssdgs_frame *frame, int light, int *at, int end, int *stop) {
    const unsigned char *reach = ssdgs__reach(frame, light);
    *stop = end;
    if (!reach || *at >= end) return *at < end;
    const ssdgs_placed *o = ssdgs__object_of(frame, *at), *const last = frame->objects + frame->object_count;
    for (; o < last && o->first < end && !reach[o - frame->objects]; o++) {}
    if (o == last || o->first >= end) return 0;
    if (o->first > *at) *at = o->first;
    for (; o < last && o->first < end && reach[o - frame->objects]; o++) {}
    if (o < last && o->first < end) *stop = o->first;
    return 1;
}

/* What a light's map must cover: all objects, or those in its reach. */
static ssdgs__bounds ssdgs__light_bounds(const ssdgs_frame *frame, int index) {
    const ssdgs_light *light = frame->lights + index;
    const unsigned char *reach = ssdgs__reach(frame, index);
    ssdgs__bounds b = frame->memory->scene;
    if (!reach || !ssdgs__limited(light)) return b;
    memset(&b, 0, sizeof b);
    for (int i = 0; i < frame->object_count; i++) {
        const ssdgs_placed *o = frame->objects + i;
        const ssdgs__bounds *own = &o->model->bounds;
        double low[3], high[3];
        if (!reach[i] || !own->count) continue;
        for (int c = 0; c < 3; c++) {
            double at = (double)o->offset[c], half = 0;
            for (int j = 0; j < 3; j++) {
                const double r = (double)o->scale * (double)o->rotation[3 * c + j];
                at += r * (own->high[j] + own->low[j]) / 2;
                half += fabs(r) * (own->high[j] - own->low[j]) / 2;
            }
            low[c] = at - half;
            high[c] = at + half;
        }
        ssdgs__bounds_add(&b, low, high, (own->log_scale + log((double)o->scale)) * own->count, own->count);
    }
    if (b.count) b.log_scale /= b.count;
    return b;
}

/* The views that cover, from a light, what is in its reach: one frustum from outside, or along a spot's cone
   where that is narrower; an orthographic one from very far, six faces of a cube from close by or inside.
   Returns how many. */
static int ssdgs__light_views(const ssdgs_frame *frame, int index, ssdgs_splat_view views[6]) {
    const ssdgs_settings *settings = &frame->settings;
    const ssdgs__bounds bounds = ssdgs__light_bounds(frame, index), *b = &bounds;
    const ssdgs_light *light = frame->lights + index;
    const double detail = (double)frame->options.light_detail;
    if (light->unshadowed) return 0;
    double centre[3], position[3], to_scene[3], radius2 = 0, distance2 = 0;
    ssdgs_real place[3];
    ssdgs__light_place(light, place);
    for (int i = 0; i < 3; i++) {
        const double half = b->count ? 0.5 * (b->high[i] - b->low[i]) : 1;
        centre[i] = b->count ? 0.5 * (b->high[i] + b->low[i]) : 0;
        position[i] = (double)place[i];
        to_scene[i] = light->kind == SSDGS_LIGHT_DIRECTIONAL ? -position[i] : centre[i] - position[i];
        radius2 += half * half;
        distance2 += to_scene[i] * to_scene[i];
    }
    const double radius = sqrt(radius2);
    double distance = sqrt(distance2);
    if (light->kind == SSDGS_LIGHT_DIRECTIONAL) distance = 1e30;
    const double cone = light->kind == SSDGS_LIGHT_SPOT && light->cone[1] < (ssdgs_real)1.2
                            ? 1.01 * tan((double)light->cone[1])
                            : 1e30;
    const int outside = distance > 1.3 * radius;
    const int along = cone < (outside ? radius / sqrt(distance * distance - radius2) : 1e29);
    const int faces = outside || along ? 1 : 6;
    if (along) distance = distance > radius ? distance : radius; /* of what it lights, about */
    int map = settings->light_map.size;
    if (!map) {
        const double size = 2 * (along ? cone * distance : radius) / exp(b->log_scale),
                     most = frame->object_count > 1 && faces == 1 ? 1024 : 512;
        map = (int)(size < 64 ? 64 : size > most ? most : size);
    }
    const double size = map * detail < 8192 ? map * detail : 8192;
    map = size < 16 ? 16 : ((int)size + 15) / 16 * 16;
    for (int face = 0; face < faces; face++) {
        ssdgs_splat_view *v = views + face;
        memset(v, 0, sizeof *v);
        v->light = index;
        v->width = v->height = map;
        v->distance = 1;
        ssdgs__light_blur(settings, &v->blur, &v->variance, &v->compensate);
        v->cx = v->cy = (ssdgs_real)map / 2;
        double direction[3], eye[3], f;
        if (faces == 6) {
            for (int i = 0; i < 3; i++) {
                direction[i] = i == face / 2 ? (face & 1 ? -1 : 1) : 0;
                eye[i] = position[i];
            }
            f = 0.5 * map;
            v->near_plane = (ssdgs_real)(1e-4 * radius);
            v->by_distance = 1;
        } else {
            v->orthographic = !along && distance > 1000 * radius;
            if (v->orthographic && light->kind != SSDGS_LIGHT_DIRECTIONAL) v->distance = (ssdgs_real)distance;
            for (int i = 0; i < 3; i++) {
                direction[i] = along ? (double)light->direction[i] : to_scene[i];
                eye[i] =
                    v->orthographic ? centre[i] - 2 * radius * to_scene[i] / sqrt(distance2) : position[i];
            }
            f = along             ? (0.5 * map - 1) / cone
                : v->orthographic ? 0.5 * map / radius
                                  : 0.5 * map * sqrt(distance * distance - radius2) / radius;
            v->near_plane = v->orthographic ? 0 : (ssdgs_real)((outside ? 1e-3 : 1e-4) * distance);
            v->by_distance = !v->orthographic;
        }
        v->fx = v->fy = (ssdgs_real)f;
        ssdgs__look_along(eye, direction, NULL, v->view);
    }
    return faces;
}

static ssdgs_result ssdgs__lights_check(ssdgs_context *context, const ssdgs_light *lights, int light_count) {
    SSDGS__REFUSE(light_count < 0 || (light_count && !lights),
                  light_count < 0 ? "%d lights" : "%d lights, but the array is NULL", light_count);
    for (int i = 0; i < light_count; i++) {
        const ssdgs_real *cone = lights[i].cone, *along = lights[i].direction;
        const int directional = lights[i].kind == SSDGS_LIGHT_DIRECTIONAL;
        double norm2 = 0, old_norm2 = 0; /* position towards the light was its direction before 0.2.5 */
        SSDGS__REFUSE((int)lights[i].kind < 0 || lights[i].kind > SSDGS_LIGHT_SPOT, "light %d: kind = %d", i,
                      (int)lights[i].kind);
        for (int j = 0; j < 3; j++) {
            if (!directional && !ssdgs__finite(lights[i].position[j]))
                return ssdgs__fail(context, SSDGS_ERR_NONFINITE, "light %d: its position is not finite", i);
            SSDGS__REFUSE(!(lights[i].intensity[j] >= 0) || !ssdgs__finite(lights[i].intensity[j]),
                          "light %d: intensity[%d] = %g is negative or not finite", i, j,
                          (double)lights[i].intensity[j]);
            norm2 += (double)along[j] * (double)along[j];
            old_norm2 += (double)lights[i].position[j] * (double)lights[i].position[j];
        }
        SSDGS__REFUSE(directional && !(norm2 > 0) && fabs(old_norm2 - 1) <= 1e-3,
                      "light %d: a directional light shines along `direction`, and its position is not "
                      "read: set direction to (%g, %g, %g), which is -position",
                      i, 0 - (double)lights[i].position[0], 0 - (double)lights[i].position[1],
                      0 - (double)lights[i].position[2]);
        SSDGS__REFUSE((directional || ssdgs__aimed(lights + i)) && !(fabs(norm2 - 1) <= 1e-3),
                      "light %d: its direction is not a unit vector", i);
        SSDGS__REFUSE(lights[i].kind == SSDGS_LIGHT_SPOT &&
                          !(cone[0] >= 0 && cone[1] > cone[0] && cone[1] <= (ssdgs_real)3.1416),
                      "light %d: the angles of its cone are %g and %g, where 0 <= first < second <= "
                      "pi is needed",
                      i, (double)cone[0], (double)cone[1]);
        SSDGS__REFUSE(!(lights[i].range >= 0) || !ssdgs__finite(lights[i].range),
                      "light %d: range = %g is negative or not finite", i, (double)lights[i].range);
        SSDGS__REFUSE(!(lights[i].focus >= 0) || lights[i].focus > 1000,
                      "light %d: focus = %g is not in 0 .. 1000", i, (double)lights[i].focus);
        SSDGS__REFUSE(!(lights[i].kept >= 0 && lights[i].kept <= 1), "light %d: kept = %g is not in 0 .. 1",
                      i, (double)lights[i].kept);
    }
    return SSDGS_OK;
}

static ssdgs_result ssdgs__occluder_check(ssdgs_context *context, const ssdgs_occluder *occluder) {
    const int known = SSDGS_COLUMN_MAJOR | SSDGS_CLIP_Y_DOWN | SSDGS_CLIP_Z_FROM_0;
    SSDGS__REFUSE(occluder->map_count < 0 || (occluder->map_count && !occluder->maps),
                  occluder->map_count < 0 ? "%d shadow maps" : "%d shadow maps, but the array is NULL",
                  occluder->map_count);
    for (int i = 0; i < occluder->map_count; i++) {
        const ssdgs_shadow_map *m = occluder->maps + i;
        SSDGS__REFUSE(m->width < 1 || m->width > SSDGS__MAX_SIDE || m->height < 1 ||
                          m->height > SSDGS__MAX_SIDE,
                      "shadow map %d: %d x %d pixels, where 1 to %d are possible", i, m->width, m->height,
                      SSDGS__MAX_SIDE);
        SSDGS__REFUSE(!m->depth && !context->gpu.stage[SSDGS_STAGE_WALK], "shadow map %d: depth is NULL", i);
        SSDGS__REFUSE(m->height > 1 && m->depth && m->pitch < 4 * m->width && -m->pitch < 4 * m->width,
                      "shadow map %d: pitch = %g, where a row has %d bytes", i, (double)m->pitch,
                      4 * m->width);
        SSDGS__REFUSE(m->light < 0, "shadow map %d: light = %d is negative", i, m->light);
        SSDGS__REFUSE(m->flags & ~known, "shadow map %d: flags = %d has unknown bits", i, m->flags);
        SSDGS__REFUSE(!(m->bias >= 0 && ssdgs__finite(m->bias) && m->range >= 0 && ssdgs__finite(m->range)),
                      "shadow map %d: bias = %g or range = %g is negative or not finite", i, (double)m->bias,
                      (double)m->range);
        for (int j = 0; j < 16; j++)
            if (!ssdgs__finite(m->matrix[j]))
                return ssdgs__fail(context, SSDGS_ERR_NONFINITE, "shadow map %d: its matrix is not finite",
                                   i);
    }
    return SSDGS_OK;
}

/* ==== >>options  how to render ==== */

/* Presets and their checks, and what settings and options ask of a frame. */

#define SSDGS__PER_PIXEL 0.375 /* Gaussians: more take time and show little */

/* clang-format off */
#define SSDGS__O(member, type, low, high, exact, standard, fast, preview) \
    {#member, offsetof(ssdgs_render_options, member), 0, type, low, high, {exact, standard, fast, preview}}
static const ssdgs__number ssdgs__render_numbers[] = {
    SSDGS__O(terms, 'i', 0, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS,
             SSDGS_ALL_TERMS),
    SSDGS__O(antialias, 'i', 0, 1, 0, 0, 0, 0),
    SSDGS__O(stop, 'r', 0, 1, 1e-4, 1.0 / 1024, 1.0 / 256, 1.0 / 64),
    SSDGS__O(alpha_threshold, 'r', 0, 1, 1.0 / 255, 1.0 / 255, 1.0 / 255, 2.0 / 255),
    SSDGS__O(max_error, 'r', 0, 1, 0, 1.0 / 16, 1.0 / 4, 1.0 / 2),
    SSDGS__O(light_detail, 'r', 0.01, 8, 1, 1, 0.7, 0.6),
    SSDGS__O(transport_detail, 'r', 0.1, 8, 1, 0.6, 0.6, 0.4),
    SSDGS__O(level_detail, 'r', 0, 8, 0, 1, 0.5, 0.3)};
/* clang-format on */
#undef SSDGS__O
enum { SSDGS__RENDER_NUMBERS = sizeof ssdgs__render_numbers / sizeof *ssdgs__render_numbers };

static ssdgs_render_options ssdgs__render_preset(int preset) {
    ssdgs_render_options o;
    memset(&o, 0, sizeof o);
    o.version = SSDGS_VERSION;
    ssdgs__numbers_preset(ssdgs__render_numbers, SSDGS__RENDER_NUMBERS, preset, &o);
    return o;
}

SSDGS_API ssdgs_render_options ssdgs_render_options_exact(void) { return ssdgs__render_preset(0); }
SSDGS_API ssdgs_render_options ssdgs_render_options_default(void) { return ssdgs__render_preset(1); }
SSDGS_API ssdgs_render_options ssdgs_render_options_fast(void) { return ssdgs__render_preset(2); }
SSDGS_API ssdgs_render_options ssdgs_render_options_preview(void) { return ssdgs__render_preset(3); }

static ssdgs_result ssdgs__render_options_check(ssdgs_context *context, const ssdgs_render_options *o) {
    if (o->version != SSDGS_VERSION)
        return ssdgs__fail(context, SSDGS_ERR_OPTIONS,
                           "render options: not made by ssdgs_render_options_default()");
    SSDGS__TRY(
        ssdgs__numbers_check(context, "render options", ssdgs__render_numbers, SSDGS__RENDER_NUMBERS, o));
    for (int i = 0; i < 3; i++)
        if (!ssdgs__finite(o->background[i]))
            return ssdgs__fail(context, SSDGS_ERR_NONFINITE, "render options: background[%d] is not finite",
                               i);
    for (int i = 0; i < 27; i++)
        if (!ssdgs__finite(o->ambient[i / 3][i % 3]))
            return ssdgs__fail(context, SSDGS_ERR_NONFINITE, "render options: ambient[%d][%d] is not finite",
                               i / 3, i % 3);
    return SSDGS_OK;
}

SSDGS__SMALL_END

/* Whether an object scatters what comes to it by true dipole transport. */
static int ssdgs__has_transport(const ssdgs_placed *o) {
    return (o->terms & SSDGS_SCATTERING_TERM) && o->settings.transport && o->light_count;
}

/* Whether walks are to leave maps for pixels and for who asks. */
static int ssdgs__wants_maps(const ssdgs_frame *frame) {
    return frame->maps || (frame->layer_count && (frame->terms & SSDGS_SHADOW_TERM));
}

static ssdgs__light_memory *ssdgs__light_memories(const ssdgs_frame *frame) {
    return (ssdgs__light_memory *)frame->memory->lights.memory;
}

/* ==== >>table  what kernels need of each light ==== */

/* Reads objects, lights and the camera. Writes ssdgs__lighting, once a frame. */

/* Raw weights of deferred lobes, within what neither over- nor underflows. */
static ssdgs_real ssdgs__lobe_raw(ssdgs_real raw) {
    return raw > 20 ? (ssdgs_real)20 : raw < -10 ? (ssdgs_real)-10 : raw;
}

SSDGS__SMALL_BEGIN

/* What true dipole transport, by soft distances, brings to an evenly lit plane, over the irradiance. */
static double ssdgs__beneath_plane(int length) {
    return exp(-SSDGS__SOFT / (SSDGS__SHORTEST * (1 << length)));
}

/* 4 A / 3 of eq. 5, where A follows from the index of refraction. */
static double ssdgs__boundary(double eta) {
    const double fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
    return 4.0 / 3 * (1 + fdr) / (1 - fdr);
}

/* The dipole of settings.medium (eq. 5 with Jensen's distances) as weights of true transport's lengths, for
   each colour: at 24 distances, from half a mean free path to 16, the sum of least squares, relative to the
   dipole. What Jensen's albedo has beyond that sum goes to the shortest length. All is multiplied by the
   share of diffuse light that the surface lets in and out. */
static void ssdgs__medium_weights(const ssdgs_settings *s, ssdgs_real translucency,
                                  ssdgs_real weights[3 * SSDGS__LENGTHS]) {
    enum { places = 24, rounds = 100 };
    const double eta = (double)s->eta, boundary = ssdgs__boundary(eta), pi = 3.14159265358979323846;
    const double passed =
        1 + 0.4399 - eta * (0.7099 - eta * (0.3319 - eta * 0.0636)); /* Egan and Hilgeman's */
    for (int c = 0; c < 3; c++) {
        const double scattering = (double)s->medium.scattering[c],
                     all = scattering + (double)s->medium.absorption[c];
        const double albedo = scattering / all, root = sqrt(3 * (1 - albedo));
        double kernel[places][SSDGS__LENGTHS], rest[places], found[SSDGS__LENGTHS];
        double missing = albedo / 2 * (1 + exp(-boundary * root)) * exp(-root);
        for (int i = 0; i < places; i++) {
            const double r = 0.5 * pow(2, 5.0 * i / (places - 1)); /* mean free paths */
            double dipole = 0;
            for (int source = 0; source < 2; source++) {
                const double z = source ? 1 + boundary : 1, d = sqrt(r * r + z * z);
                dipole += albedo / (4 * pi) * z * (root * d + 1) * exp(-root * d) / (d * d * d);
            }
            for (int k = 0; k < SSDGS__LENGTHS; k++) {
                const double length =
                    SSDGS__SHORTEST * (1 << k) * (double)(s->length_unit / translucency) * all;
                kernel[i][k] = exp(-r / length) / (2 * pi * length * r) / dipole;
            }
            rest[i] = 1;
        }
        memset(found, 0, sizeof found);
        for (int round = 0; round < rounds * SSDGS__LENGTHS; round++) { /* none below 0 */
            const int k = round % SSDGS__LENGTHS;
            double along = 0, length2 = 0;
            for (int i = 0; i < places; i++) {
                along += kernel[i][k] * rest[i];
                length2 += kernel[i][k] * kernel[i][k];
            }
            const double step = length2 > 0 && found[k] + along / length2 > 0 ? along / length2 : -found[k];
            found[k] += step;
            for (int i = 0; i < places; i++) rest[i] -= step * kernel[i][k];
        }
        double sum = 0;
        for (int k = 0; k < SSDGS__LENGTHS; k++) sum += found[k];
        const double scale = sum > missing ? missing / sum : 1;
        found[0] += sum > missing ? 0 : missing - sum;
        for (int k = 0; k < SSDGS__LENGTHS; k++)
            weights[c * SSDGS__LENGTHS + k] =
                (ssdgs_real)(scale * found[k] * passed * passed / ssdgs__beneath_plane(k));
    }
}

/* A light in an object's space, where a length is 1 / scale of the world's. Behind the last is ambient
   light's, of irradiance 1. lobes: another light's, to copy the lobes from, or NULL. */
static ssdgs__lighting ssdgs__lighting_of(const ssdgs_frame *frame, const ssdgs_placed *o, int light,
                                          const ssdgs__lighting *lobes) {
    static const ssdgs_light even = {
        SSDGS_LIGHT_DIRECTIONAL, {0, 0, 0}, {1, 1, 1}, {0, 0, -1}, {0, 0}, 0, 0, 1, 0};
    const ssdgs_settings *s = &o->settings;
    const ssdgs_light *from = light < frame->light_count ? frame->lights + light : &even;
    ssdgs__lighting k;
    memset(&k, 0, sizeof k);
    k.directional = from->kind == SSDGS_LIGHT_DIRECTIONAL;
    const ssdgs_real area = k.directional ? 1 : o->scale * o->scale;
    ssdgs__to_object(o, frame->eye, k.eye);
    ssdgs_real place[3];
    ssdgs__light_place(from, place);
    if (k.directional) ssdgs__turn(o, 1, place, k.light);
    else ssdgs__to_object(o, place, k.light);
    for (int i = 0; i < 3; i++) k.intensity[i] = from->intensity[i] * s->light_scale / area;
    k.least_distance2 = (ssdgs_real)1e-6 * s->length_unit * s->length_unit;
    k.virtual_depth = (ssdgs_real)(1 + ssdgs__boundary((double)s->eta));
    k.printed_dipole = s->dipole == SSDGS_DIPOLE_PRINTED;
    k.diffuse = (o->terms & SSDGS_DIFFUSE_TERM) != 0;
    k.specular = (o->terms & SSDGS_SPECULAR_TERM) != 0;
    k.shadow = (o->terms & SSDGS_SHADOW_TERM) && o->light_count && ssdgs__casts(from);
    k.scattering = (o->terms & SSDGS_SCATTERING_TERM) && !ssdgs__has_medium(s, o->terms);
    k.residual_shadow = s->residual_shadow;
    k.refined_shadow = s->shadow.layers > 0;
    k.per_channel_optics = s->per_channel_optics;
    k.shadow_on_scattering = s->shadow_on_scattering;
    k.deferred = s->asg == SSDGS_ASG_DEFERRED && (light == frame->light_count || o->light_count);
    memcpy(k.view, frame->camera.view, sizeof k.view);
    k.inverse_fx = 1 / frame->camera.fx;
    k.inverse_fy = 1 / frame->camera.fy;
    k.cx = frame->camera.cx;
    k.cy = frame->camera.cy;
    if (lobes) memcpy(k.basis, lobes->basis, sizeof k.basis);
    for (int j = 0; j < SSDGS_ASG_COUNT && !lobes; j++) {
        const ssdgs_real *sharpness = o->gaussians.asg_sharpness + 2 * j;
        ssdgs_real q[4], r[9], *b = k.basis + 12 * j;
        ssdgs__rotation_scalar(o->gaussians.asg_basis + 4 * j, q, r);
        for (int i = 0; i < 9; i++) b[i] = r[i % 3 * 3 + i / 3]; /* columns: the basis axes */
        if (k.deferred) {
            b[8] = ssdgs__sigmoid_scalar(sharpness[1]);
            b[9] = ssdgs__exp_scalar(sharpness[0]);
            b[10] = ssdgs__softplus_scalar(ssdgs__lobe_raw(o->gaussians.asg_sigma[j]));
            b[11] = ssdgs__sigmoid_scalar(ssdgs__lobe_raw(o->gaussians.asg_sigma[j]));
        } else {
            for (int i = 0; i < 2; i++)
                b[9 + i] = ssdgs__exp_scalar(sharpness[i]) / (o->roughness * o->roughness);
        }
    }
    return k;
}

SSDGS__SMALL_END

/* The lights as an object sees them, and one more. */
static const ssdgs__lighting *ssdgs__lightings(const ssdgs_frame *frame, const ssdgs_placed *o) {
    return (const ssdgs__lighting *)frame->scratch->lightings.memory +
           (o - frame->objects) * (ptrdiff_t)(frame->light_count + 1);
}

/* The lights in the world, with a material's lobes: for pixels. */
static const ssdgs__lighting *ssdgs__pixel_lightings(const ssdgs_frame *frame, int material) {
    return ssdgs__lightings(frame, frame->objects + frame->object_count) +
           material * (ptrdiff_t)frame->light_count;
}

SSDGS__SMALL_BEGIN

/* Whether pixels are lit in the same way: by the same lobes, with the same kind of shadow. */
static int ssdgs__lit_alike(const ssdgs__lighting *a, const ssdgs__lighting *b, int lights) {
    if (a->deferred != b->deferred) return 0;
    for (int i = 0; i < lights; i++)
        if (a[i].shadow != b[i].shadow) return 0;
    if (!a->deferred) return 1;
    return !memcmp(a->basis, b->basis, sizeof a->basis) && a->refined_shadow == b->refined_shadow &&
           a->residual_shadow == b->residual_shadow;
}

/* Fills the table, objects first. Objects that pixels light alike share a material; notes that of each 64
   Gaussians, unless all have one. */
static ssdgs_result ssdgs__light_table(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    const int lights = frame->light_count;
    ssdgs__lighting *table, *pixels;
    uint16_t *of;
    ssdgs_real taken = 0;
    for (int light = 0; light < lights; light++) taken += frame->lights[light].kept;
    SSDGS__RESERVE(frame->scratch->lightings, table, ssdgs__lighting,
                   ssdgs__times(2 * ((size_t)frame->object_count + 1), (size_t)lights + 1));
    SSDGS__RESERVE(frame->memory->material_of, of, uint16_t, (size_t)frame->count / SSDGS__BLOCK + 1);
    pixels = table + frame->object_count * (ptrdiff_t)(lights + 1);
    frame->material_count = 0;
    for (int i = 0; i < frame->object_count; i++) {
        ssdgs_placed *o = frame->objects + i, world = *o;
        memset(world.rotation, 0, sizeof world.rotation);
        memset(world.offset, 0, sizeof world.offset);
        world.rotation[0] = world.rotation[4] = world.rotation[8] = world.scale = 1;
        world.settings.length_unit *= o->scale;
        const ssdgs__lighting *own = table;
        for (int light = 0; light <= lights; light++, table++) {
            *table = ssdgs__lighting_of(frame, o, light, light ? own : NULL);
            if (light < lights) table->kept = frame->lights[light].kept / (taken > 1 ? taken : 1);
        }
        if (!lights) continue;
        for (o->material = 0; o->material < frame->material_count; o->material++)
            if (ssdgs__lit_alike(pixels + o->material * (ptrdiff_t)lights, own, lights)) break;
        for (int g = 0; g < o->gaussians.count; g += SSDGS__BLOCK)
            of[(o->first + g) / SSDGS__BLOCK] = (uint16_t)o->material;
        if (o->material < frame->material_count) continue;
        for (int light = 0; light < lights; light++)
            pixels[frame->material_count * (ptrdiff_t)lights + light] =
                ssdgs__lighting_of(frame, &world, light, own);
        frame->material_count++;
    }
    frame->material_of = frame->material_count > 1 ? of : NULL;
    return SSDGS_OK;
}

/* ==== >>begin  objects placed, memory reserved, views and what is there of them ==== */

/* Reads model, camera, lights and options. Writes ssdgs_frame, and finds what of earlier frames still holds.
   Called by render and by the trainer. */

/* A model where it stands. */
static void ssdgs__place(const ssdgs_object *object, ssdgs_placed *o) {
    const ssdgs_real *m = object->to_world;
    const double length2 = ssdgs__scale2(m);
    memset(o, 0, sizeof *o);
    o->model = object->model;
    o->revision = o->model->revision;
    o->settings = o->model->settings;
    o->gaussians = ssdgs__model_view(o->model);
    o->scale = (ssdgs_real)(fabs(length2 - 1) < 1e-12 ? 1 : sqrt(length2));
    for (int i = 0; i < 9; i++) {
        o->rotation[i] = m[i / 3 * 4 + i % 3] / o->scale;
        o->turned |= !(o->rotation[i] >= (i % 4 == 0) && o->rotation[i] <= (i % 4 == 0));
    }
    for (int i = 0; i < 3; i++) {
        o->offset[i] = m[4 * i + 3];
        o->tint[i] = object->tint[i];
    }
    o->roughness = object->roughness;
    o->specular = object->specular;
    o->translucency = object->translucency;
    o->kept = ssdgs__keeps(&o->settings) ? object->kept : 0;
    o->mask = object->mask;
    o->presence = object->presence;
    if (o->settings.baked)
        o->settings.terms &= SSDGS_SHADOW_TERM, o->settings.shadow.layers = 0; /* eq. 7's */
}

/* Puts the objects into the frame, one after the other. */
static ssdgs_result ssdgs__place_all(ssdgs_frame *frame, const ssdgs_object *objects, int count,
                                     const ssdgs_light *lights, int light_count) {
    ssdgs_context *context = frame->context;
    ssdgs__frame_memory *m = frame->memory;
    uint64_t at = 0;
    int taken = 0; /* by lights, of what is kept */
    for (int i = 0; i < light_count; i++) taken |= lights[i].kept > 0;
    SSDGS__RESERVE(m->objects, frame->objects, ssdgs_placed, count + 1);
    frame->object_count = count;
    frame->settings = ssdgs_settings_default();
    frame->near_plane = (ssdgs_real)1e30;
    for (int i = 0; i < count; i++) {
        ssdgs_placed o, *last = frame->objects + i;
        ssdgs__place(objects + i, &o);
        const int known = last->revision == o.revision; /* that of no model is 0 */
        if (!known) SSDGS__TRY(ssdgs__globals_check(o.model));
        if (known && !memcmp(&last->translucency, &o.translucency, sizeof o.translucency))
            memcpy(o.medium, last->medium, sizeof o.medium);
        else if (ssdgs__has_medium(&o.settings, o.settings.terms))
            ssdgs__medium_weights(&o.settings, o.translucency, o.medium);
        o.first = (int)at;
        o.key = SSDGS__FOLD_START;
        SSDGS__FOLD(o.key, o.revision);
        SSDGS__FOLD(o.key, o.first);
        SSDGS__FOLD(o.key, o.rotation);
        SSDGS__FOLD(o.key, o.scale);
        SSDGS__FOLD(o.key, o.offset);
        SSDGS__FOLD(o.key, o.presence);
        o.terms = o.settings.terms & frame->options.terms;
        o.light_count = o.settings.baked && !(taken && o.kept > 0) ? 0 : light_count;
        frame->light_count = o.light_count > frame->light_count ? o.light_count : frame->light_count;
        frame->terms |= o.terms;
        frame->count = o.first + o.gaussians.count;
        at = ((uint64_t)frame->count + SSDGS__BLOCK - 1) / SSDGS__BLOCK * SSDGS__BLOCK;
        const ssdgs_real unit = o.settings.length_unit * o.scale,
                         rounding = (ssdgs_real)1e-5; /* casts no shadow */
        const ssdgs_real bias[2] = {o.settings.light_map.bias * unit,
                                    (o.settings.light_map.bias + rounding) * unit};
        for (int j = 0; j < 2; j++) frame->bias[j] = bias[j] > frame->bias[j] ? bias[j] : frame->bias[j];
        const ssdgs_real near_plane =
            ssdgs__has_unit(&o.settings) ? (ssdgs_real)0.02 * unit : (ssdgs_real)0.01 * o.scale;
        if (near_plane < frame->near_plane) frame->near_plane = near_plane;
        *last = o;
    }
    uint16_t *object_of;
    SSDGS__RESERVE(m->object_of, object_of, uint16_t, (size_t)frame->count / SSDGS__BLOCK + 1);
    frame->object_of = count > 1 ? object_of : NULL;
    for (int i = 0; i < count; i++)
        for (int g = 0; g < frame->objects[i].gaussians.count; g += SSDGS__BLOCK)
            object_of[(frame->objects[i].first + g) / SSDGS__BLOCK] = (uint16_t)i;
    for (int i = 0; i < count; i++) { /* one that is lit says how colours are stored */
        if (i && (frame->objects[i].settings.baked || !frame->settings.baked)) continue;
        frame->model = frame->objects[i].model;
        frame->settings = frame->objects[i].settings;
        frame->gaussians = frame->objects[i].gaussians;
    }
    return SSDGS_OK;
}

/* What a frame is to show. */
typedef struct ssdgs__request {
    const ssdgs_object *objects;
    int object_count;
    const ssdgs_camera *camera; /* NULL: nobody looks; what is there of the camera's view stays */
    const ssdgs_light *lights;
    int light_count;
    const ssdgs_render_options *options; /* NULL: default */
    const ssdgs_image *image;            /* NULL: nothing but pixels */
    int components, training;
    int maps;                       /* 1: light maps are made, though nothing in the frame needs them */
    int mirrored;                   /* 1: the view may mirror */
    const ssdgs_occluder *occluder; /* NULL: none */
} ssdgs__request;

static ssdgs__request ssdgs__request_of(const ssdgs_object *objects, int object_count,
                                        const ssdgs_camera *camera, const ssdgs_light *lights,
                                        int light_count, const ssdgs_render_options *options) {
    const ssdgs__request request = {
        objects, object_count, camera, lights, light_count, options, NULL, 0, 0, 0, 0, NULL};
    return request;
}

static int ssdgs__components_asked(const ssdgs_image *image) {
    return image->diffuse || image->specular || image->scattering || image->normal || image->shadow ||
           image->depth;
}

/* Finds the boxes of an object's model, in its space: the bounds of all that is drawn at alpha 1/255; and one
   holds all that its Gaussians draw, to 3.4 standard deviations. */
static ssdgs_result ssdgs__model_box(ssdgs_model *model) {
    if (model->box_revision == model->revision) return SSDGS_OK;
    ssdgs_context *context = model->context;
    const ssdgs_object object = ssdgs__object_alone(model);
    ssdgs_placed placed;
    ssdgs_frame frame;
    SSDGS__TRY(ssdgs__scratch_create(context));
    ssdgs__place(&object, &placed);
    memset(&frame, 0, sizeof frame);
    frame.context = context;
    frame.scratch = context->scratch;
    frame.options = ssdgs_render_options_exact();
    frame.objects = &placed;
    frame.object_count = 1;
    frame.count = model->count;
    SSDGS__TRY(ssdgs__scene_bounds(&frame, &model->bounds));
    model->box_revision = model->revision;
    int any = 0;
    for (int i = 0; i < model->count; i++) {
        const ssdgs_real *p = model->gaussians + i;
        ssdgs_real largest = -SSDGS__RAW_LIMIT;
        for (size_t c = 0; c < 3; c++) {
            const ssdgs_real s = p[(SSDGS_LOG_SCALE + c) * model->capacity];
            largest = s > largest ? s : largest;
        }
        const double reach =
            3.4 * (double)ssdgs__exp_scalar(largest < SSDGS__RAW_LIMIT ? largest : SSDGS__RAW_LIMIT);
        for (size_t c = 0; c < 3; c++) {
            const double at = (double)p[(SSDGS_POSITION + c) * model->capacity];
            if (!any || at - reach < model->low[c]) model->low[c] = at - reach;
            if (!any || at + reach > model->high[c]) model->high[c] = at + reach;
        }
        any = 1;
    }
    for (int c = 0; c < 3 && !any; c++) model->low[c] = model->high[c] = 0;
    return SSDGS_OK;
}

/* Whether something of a ball may be in the picture. Twice the radius: a splat is affine, which beside the
   picture makes it larger than it is. */
static int ssdgs__in_sight(const ssdgs_frame *frame, const ssdgs_placed *o) {
    const ssdgs_camera *camera = &frame->camera;
    const double near_plane = (double)(camera->near_plane > 0 ? camera->near_plane : frame->near_plane);
    double at[3];
    for (int i = 0; i < 3; i++) {
        const ssdgs_real *row = camera->view + 4 * i;
        at[i] = (double)row[0] * o->middle[0] + (double)row[1] * o->middle[1] +
                (double)row[2] * o->middle[2] + (double)row[3];
    }
    if (at[2] + o->radius < near_plane) return 0;
    for (int axis = 0; axis < 2; axis++) {
        const double focal = (double)(axis ? camera->fy : camera->fx),
                     centre = (double)(axis ? camera->cy : camera->cx);
        const double low = (-21 - centre) / focal, /* a splat's blur reaches 20.4 px at most */
            high = ((axis ? camera->height : camera->width) + 21 - centre) / focal;
        if ((at[axis] - high * at[2]) / sqrt(1 + high * high) > 2 * o->radius) return 0;
        if ((low * at[2] - at[axis]) / sqrt(1 + low * low) > 2 * o->radius) return 0;
    }
    return 1;
}

/* Whether a light shines on something of a ball: within its range and its cone. */
static int ssdgs__in_light(const ssdgs_light *light, const ssdgs_placed *o) {
    double along = 0, distance2 = 0;
    if (light->kind == SSDGS_LIGHT_DIRECTIONAL) return 1;
    for (int c = 0; c < 3; c++) {
        const double d = o->middle[c] - (double)light->position[c];
        along += d * (double)light->direction[c];
        distance2 += d * d;
    }
    const double distance = sqrt(distance2);
    if (light->range > 0 && distance - o->radius > (double)light->range) return 0;
    if (light->kind != SSDGS_LIGHT_SPOT || distance <= o->radius) return 1;
    const double cosine = along / distance, angle = acos(cosine > 1 ? 1 : cosine < -1 ? -1 : cosine);
    return angle - asin(o->radius / distance) <= (double)light->cone[1] + 1e-3;
}

/* Where the objects are, and of several which of them the camera and the lights reach. sees: whether the
   camera any. Of one object it is asked only if the last frame drew nothing: boxes of models that are edited
   from frame to frame take time. */
static ssdgs_result ssdgs__find_reach(ssdgs_frame *frame, int *sees) {
    ssdgs_context *context = frame->context;
    const int count = frame->object_count, rows = frame->light_count + 1, several = count > 1;
    const ssdgs_splat_view *last = (const ssdgs_splat_view *)frame->memory->views.memory;
    const int boxed = several || (!frame->training && !(last && last->visible));
    unsigned char *reach;
    SSDGS__RESERVE(frame->memory->reach, reach, unsigned char, ssdgs__times((size_t)count + 1, (size_t)rows));
    frame->reach = several ? reach : NULL;
    *sees = 0;
    for (int i = 0; i < count; i++) {
        ssdgs_placed *o = frame->objects + i;
        const ssdgs_model *model = o->model;
        double half2 = 0;
        if (boxed) SSDGS__TRY(ssdgs__model_box(o->model));
        for (int c = 0; c < 3; c++) {
            const double half = (model->high[c] - model->low[c]) / 2;
            half2 += half * half;
            o->middle[c] = (double)o->offset[c];
            for (int j = 0; j < 3; j++)
                o->middle[c] +=
                    (double)o->scale * (double)o->rotation[3 * c + j] * (model->high[j] + model->low[j]) / 2;
        }
        o->radius = (double)o->scale * sqrt(half2) * (1 + 1e-5);
        const int anywhere = !boxed || !(o->radius < 1e30); /* with Gaussians that are not finite */
        for (int row = 0; row < rows; row++) {
            const int in =
                anywhere || (row ? ssdgs__in_light(frame->lights + row - 1, o) : ssdgs__in_sight(frame, o));
            reach[(ptrdiff_t)row * count + i] = (unsigned char)in;
            *sees |= !row && in;
        }
    }
    return SSDGS_OK;
}

static ssdgs_result ssdgs__sky_shares_of(ssdgs_placed *o);

/* ---- what earlier frames have found has a key of all that it depends on; equal keys, equal results ---- */

/* Of what is drawn and where it stands: all objects, or those that `reach` has. */
static uint64_t ssdgs__objects_key(const ssdgs_frame *frame, const unsigned char *reach) {
    uint64_t key = SSDGS__FOLD_START;
    SSDGS__FOLD(key, frame->count); /* rows are as long */
    SSDGS__FOLD(key, frame->options.alpha_threshold);
    for (int i = 0; i < frame->object_count; i++)
        if (!reach || reach[i]) SSDGS__FOLD(key, frame->objects[i].key);
    return key;
}

/* Of the camera's view, up to BIN, or of a light's. */
static uint64_t ssdgs__views_key(const ssdgs_frame *frame, int light, const ssdgs_splat_view *views,
                                 int count) {
    uint64_t key = ssdgs__objects_key(frame, ssdgs__reach(frame, light));
    for (int i = 0; i < count; i++) key = ssdgs__fold(key, views + i, offsetof(ssdgs_splat_view, cached));
    return key;
}

/* Whether the camera's pixels ask how deep a Gaussian is. */
static int ssdgs__asks_depth(const ssdgs_frame *frame) { return frame->scene_depth || frame->median_depth; }

static void ssdgs__begin_camera(ssdgs_frame *frame) {
    ssdgs__frame_memory *m = frame->memory;
    const ssdgs_camera *camera = &frame->camera;
    ssdgs_splat_view v;
    memset(&v, 0, sizeof v);
    v.light = -1;
    v.distance = 1;
    v.width = camera->width;
    v.height = camera->height;
    v.fx = camera->fx;
    v.fy = camera->fy;
    v.cx = camera->cx;
    v.cy = camera->cy;
    v.near_plane = camera->near_plane > 0 ? camera->near_plane : frame->near_plane;
    v.compensate = frame->options.antialias;
    v.variance = frame->settings.pixel_variance;
    memcpy(v.view, camera->view, sizeof v.view);
    const int asks = ssdgs__asks_depth(frame);
    uint64_t key = ssdgs__views_key(frame, -1, &v, 1);
    SSDGS__FOLD(key, asks);
    uint64_t walk = key;
    SSDGS__FOLD(walk, frame->options.stop);
    SSDGS__FOLD(walk, frame->options.max_error);
    if (frame->scene_depth) walk = 0; /* what it hides may change behind the pointer */
    if (key != m->camera_key) *frame->views = v;
    frame->views->cached = key != m->camera_key ? 0 : walk && walk == m->walk_key ? 2 : 1;
    m->camera_key = key;
    m->walk_key = walk;
}

/* Room for so many views; what is there of them stays. */
static ssdgs_result ssdgs__views_reserve(ssdgs_frame *frame, int count) {
    ssdgs_context *context = frame->context;
    ssdgs__frame_memory *m = frame->memory;
    SSDGS__TRY(ssdgs__grow(context, &m->view_memory, (size_t)count, sizeof(ssdgs__view_memory)));
    SSDGS__KEEP(m->views, frame->views, ssdgs_splat_view, count);
    frame->view_count = frame->batch[1] = count;
    return SSDGS_OK;
}

/* Appends a light's views. A dark light's are not made, but what is there of them stays. */
static ssdgs_result ssdgs__begin_light(ssdgs_frame *frame, int index, int wanted) {
    const ssdgs_light *light = frame->lights + index;
    ssdgs__light_memory *own = ssdgs__light_memories(frame) + index;
    ssdgs_splat_view views[6];
    ssdgs_real place[3];
    own->first = frame->view_count;
    own->views = ssdgs__light_views(frame, index, views);
    SSDGS__TRY(ssdgs__views_reserve(frame, own->first + own->views));
    ssdgs__light_place(light, place);
    uint64_t key = ssdgs__views_key(frame, index, views, own->views);
    const int cue = wanted & SSDGS__MADE_CUE; /* samples Gaussians that without it are known to be dark */
    SSDGS__FOLD(key, cue);
    SSDGS__FOLD(key, light->kind);
    SSDGS__FOLD(key, place);
    SSDGS__FOLD(key, own->first);
    SSDGS__FOLD(key, frame->options.stop);
    SSDGS__FOLD(key, frame->bias);
    if (frame->occluder && frame->occluder->shadow)
        key = ssdgs__fold(key, frame->occluder, offsetof(ssdgs_occluder, maps));
    for (int i = 0; frame->occluder && i < frame->occluder->map_count; i++)
        if (frame->occluder->maps[i].light == index) /* where its depths lie does not matter */
            key = ssdgs__fold(key, frame->occluder->maps + i, offsetof(ssdgs_shadow_map, depth));
    own->wanted = ssdgs__casts(light) ? wanted : 0;
    own->kept = key == own->key && !(own->wanted & ~own->made);
    own->key = key;
    if (!own->kept) own->made = own->wanted;
    for (int i = 0; i < own->views; i++) {
        ssdgs_splat_view *v = frame->views + own->first + i;
        if (!own->kept) *v = views[i];
        v->cached = own->kept || !own->wanted ? 2 : 0;
    }
    return SSDGS_OK;
}

/* Lays out the views, and finds what is there of them. wanted: SSDGS__MADE_* of the lights; looks: 0: no
   camera does. */
static ssdgs_result ssdgs__begin_views(ssdgs_frame *frame, int wanted, int looks) {
    ssdgs_context *context = frame->context;
    ssdgs__frame_memory *m = frame->memory;
    ssdgs__light_memory *lights;
    const int light_count = wanted ? frame->light_count : 0;
    SSDGS__KEEP(m->lights, lights, ssdgs__light_memory, frame->light_count + 1);
    SSDGS__TRY(ssdgs__views_reserve(frame, 1));
    frame->views->light = -1;
    frame->views->cached = 2;
    if (looks) ssdgs__begin_camera(frame);
    if (!light_count) return SSDGS_OK;
    const uint64_t key = ssdgs__objects_key(frame, NULL);
    if (key != m->bounds_key) SSDGS__TRY(ssdgs__scene_bounds(frame, &m->scene));
    m->bounds_key = key;
    /* those behind may lose their views to others */
    memset(lights + light_count, 0, m->lights.bytes - (size_t)light_count * sizeof *lights);
    for (int i = 0; i < light_count; i++) SSDGS__TRY(ssdgs__begin_light(frame, i, wanted));
    return SSDGS_OK;
}

/* Forgets what earlier frames have found. */
static void ssdgs__frame_forget(ssdgs__frame_memory *m) {
    m->camera_key = m->walk_key = m->bounds_key = 0;
    if (m->lights.memory) memset(m->lights.memory, 0, m->lights.bytes);
    if (m->objects.memory) memset(m->objects.memory, 0, m->objects.bytes);
}

/* Checks a request, places its objects, reserves memory, finds what is there from earlier frames. */
static ssdgs_result ssdgs__frame_begin(ssdgs_frame *frame, ssdgs_context *context,
                                       ssdgs__frame_memory **memory, const ssdgs__request *request) {
    static const ssdgs_real eye[3] = {0, 0, 0}, ahead[3] = {0, 1, 0}, up[3] = {0, 0, 1};
    const ssdgs_camera nobody = ssdgs_camera_look_at(eye, ahead, up, 1, 16, 16),
                       *camera = request->camera ? request->camera : &nobody;
    const ssdgs_image *image = request->image;
    const int light_count = request->light_count, training = request->training;
    const int components = request->components || (image && ssdgs__components_asked(image));
    ssdgs__frame_memory *m;
    ssdgs__scratch *w;
    if (!*memory) *memory = (ssdgs__frame_memory *)ssdgs__allocate(context, sizeof *m);
    SSDGS__TRY(ssdgs__scratch_create(context));
    if (!*memory) return SSDGS_ERR_MEMORY;
    m = *memory;
    w = context->scratch;
    memset(frame, 0, sizeof *frame);
    frame->options = request->options ? *request->options : ssdgs_render_options_default();
    SSDGS__TRY(ssdgs__render_options_check(context, &frame->options));
    SSDGS__TRY(ssdgs__camera_check(context, camera, request->mirrored));
    SSDGS__TRY(ssdgs__lights_check(context, request->lights, light_count));
    frame->stride = image && image->stride ? image->stride : camera->width;
    SSDGS__REFUSE(frame->stride < camera->width, "image: stride = %d is below the width of %d", frame->stride,
                  camera->width);
    frame->scene_depth = image ? image->scene_depth : NULL;
    frame->image = image;
    frame->context = context;
    frame->memory = m;
    frame->scratch = w;
    frame->camera = *camera;
    frame->lights = request->lights;
    frame->occluder = request->occluder;
    if (frame->occluder) SSDGS__TRY(ssdgs__occluder_check(context, frame->occluder));
    frame->maps = request->maps;
    frame->light_count = request->maps ? light_count : 0;
    frame->training = training;
    SSDGS__REFUSE(training && ssdgs__has_medium(&request->objects->model->settings,
                                                request->objects->model->settings.terms),
                  "settings: scattering.layers = 0: a medium is not trained");
    for (int i = 0; i < 3; i++)
        frame->eye[i] = -(camera->view[i] * camera->view[3] + camera->view[4 + i] * camera->view[7] +
                          camera->view[8 + i] * camera->view[11]);
    if (!m->ready || training) ssdgs__frame_forget(m);
    m->ready = m->mapped = 0; /* again once the walks are done */
    SSDGS__TRY(
        ssdgs__place_all(frame, request->objects, request->object_count, request->lights, light_count));
    int ambient = 0;
    for (int i = 0; i < 27; i++) {
        const ssdgs_real value = frame->options.ambient[i / 3][i % 3];
        ambient |= value < 0 || value > 0;
    }
    for (int i = 0; ambient && i < frame->object_count; i++)
        SSDGS__TRY(ssdgs__sky_shares_of(frame->objects + i));
    int sees;
    SSDGS__TRY(ssdgs__find_reach(frame, &sees));
    const size_t n = (size_t)frame->count + SSDGS__BLOCK;
    if (frame->settings.baked) frame->options.max_error = 0; /* nothing is dear to shade */
    memset(m->counts, 0, sizeof m->counts);
    const size_t pixels = (size_t)camera->width * (size_t)camera->height;
    SSDGS__KEEP(m->seen, frame->seen, unsigned char, n);
    const size_t lit = ssdgs__times(n, (size_t)frame->light_count);
    SSDGS__KEEP(m->visibility, frame->visibility, ssdgs_real, lit);
    int deferred = 0, cue = 0, transport = 0, mapped = frame->maps; /* 1: lights need maps */
    for (int i = 0; i < frame->object_count; i++) {
        const ssdgs_placed *o = frame->objects + i;
        deferred |= o->settings.asg == SSDGS_ASG_DEFERRED && o->light_count; /* its pixels are lit */
        const int cued = (o->terms & SSDGS_SCATTERING_TERM) && o->settings.depth_cue;
        cue |= cued;
        transport |= ssdgs__has_transport(o);
        mapped |= o->light_count && ((o->terms & SSDGS_SHADOW_TERM) || cued);
    }
    if (cue) SSDGS__KEEP(m->cue, frame->depth_cue, ssdgs_real, lit);
    if (transport) SSDGS__KEEP(m->flux, frame->flux, ssdgs_real, lit);
    SSDGS__RESERVE(w->shaded, frame->shaded, uint32_t, n);
    SSDGS__RESERVE(w->color, frame->color, ssdgs_real, n * 4 + SSDGS__SORT_WORDS);
    if (deferred) {
        frame->layer_count = SSDGS__LIGHT_LAYER - 1 + SSDGS__PER_LIGHT * frame->light_count;
        const size_t layers = ssdgs__times(n * 4, (size_t)frame->layer_count);
        SSDGS__RESERVE(w->layers, frame->layers, ssdgs_real, layers);
        if (components || training) {
            const size_t lit_pixels = ssdgs__times(pixels, (size_t)frame->light_count);
            SSDGS__RESERVE(w->pixel_visibility, frame->pixel_visibility, ssdgs_real, lit_pixels);
            if (components) SSDGS__RESERVE(w->pixel_shadow, frame->pixel_shadow, ssdgs_real, lit_pixels);
            const int kept = components ? frame->layer_count + 1 : SSDGS__LIGHT_LAYER - SSDGS__DEPTH_LAYER;
            SSDGS__RESERVE(w->layer_pixels, frame->layer_pixels, ssdgs_real,
                           ssdgs__times(pixels * 3, (size_t)kept));
        }
        if (training) SSDGS__RESERVE(w->layer_gradient, frame->layer_gradient, ssdgs_real, layers);
    }
    if (components && !frame->layer_count) {
        SSDGS__RESERVE(w->component[0], frame->diffuse, ssdgs_real, n * 4);
        SSDGS__RESERVE(w->component[1], frame->specular, ssdgs_real, n * 4);
        SSDGS__RESERVE(w->component[2], frame->scattering, ssdgs_real, n * 4);
        SSDGS__RESERVE(w->component[3], frame->normal, ssdgs_real, n * 4);
        SSDGS__RESERVE(w->component[4], frame->shadow, ssdgs_real, n * 4);
    }
    SSDGS__RESERVE(w->pixels, frame->pixels, ssdgs_real, pixels * 3);
    SSDGS__RESERVE(w->transmittance, frame->transmittance, ssdgs_real, pixels);
    if (image && image->median_depth) SSDGS__RESERVE(w->median, frame->median_depth, ssdgs_real, pixels);
    if (!training && !components) {
        const size_t tiles = (size_t)((camera->width + 15) / 16) * (size_t)((camera->height + 15) / 16);
        SSDGS__RESERVE(w->empty, frame->empty, unsigned char, tiles);
        memset(frame->empty, 0, tiles);
    }
    if (training) {
        SSDGS__RESERVE(w->pixel_gradient, frame->pixel_gradient, ssdgs_real, ssdgs__times(pixels, 4));
        SSDGS__RESERVE(w->splat_gradient, frame->splat_gradient, ssdgs_real, n * SSDGS__SPLAT);
        SSDGS__RESERVE(w->color_gradient, frame->color_gradient, ssdgs_real, n * 4);
        SSDGS__RESERVE(w->gradient, frame->gradient, ssdgs_real, frame->gaussians.stride * SSDGS_CHANNELS);
        SSDGS__RESERVE(w->global_gradient, frame->global_gradient, ssdgs_real, frame->model->global_count);
    }
    const int wanted = !(mapped | transport) || (!sees && !frame->maps && !training)
                           ? 0
                           : SSDGS__MADE_VISIBILITY | (ssdgs__wants_maps(frame) ? SSDGS__MADE_MAP : 0) |
                                 (cue ? SSDGS__MADE_CUE : 0) | (transport ? SSDGS__MADE_FLUX : 0);
    SSDGS__TRY(ssdgs__light_table(frame));
    return ssdgs__begin_views(frame, wanted, request->camera != NULL);
}

/* Begins a frame of one model, in its space and memory. */
static SSDGS__TRAINING ssdgs_result ssdgs__frame_of_model(ssdgs_frame *frame, ssdgs_model *model,
                                                          const ssdgs_camera *camera,
                                                          const ssdgs_light *lights, int light_count,
                                                          const ssdgs_render_options *options, int components,
                                                          int training) {
    const ssdgs_object object = ssdgs__object_alone(model);
    ssdgs__request request = ssdgs__request_of(&object, 1, camera, lights, light_count, options);
    request.components = components;
    request.training = training;
    return ssdgs__frame_begin(frame, model->context, &model->frame, &request);
}

SSDGS__SMALL_END

/* ==== >>project  records, order, instances, tile lists ==== */

/* Reads raw parameters and views. Writes record, depth, order, instance, tile_start, tile_list. Stages
   PROJECT, SORT and BIN. */

static ssdgs_real ssdgs__log2_threshold(const ssdgs_frame *frame) {
    const double threshold = (double)frame->options.alpha_threshold;
    return (ssdgs_real)(log(threshold > 1e-9 ? threshold : 1e-9) * 1.44269504088896341);
}

/* A view as an object sees it: all but depths in its own space, where a length is 1 / scale of the world's.
 */
static ssdgs__projection ssdgs__projection_of(const ssdgs_frame *frame, const ssdgs_placed *o,
                                              const ssdgs_splat_view *v) {
    const ssdgs_settings *s = &o->settings;
    const double scale = (double)o->scale;
    ssdgs__projection p;
    for (int i = 0; i < 3; i++) {
        const ssdgs_real *row = v->view + 4 * i;
        double to_origin = (double)row[3];
        for (int j = 0; j < 3; j++) {
            p.view[4 * i + j] = (ssdgs_real)((double)row[0] * (double)o->rotation[j] +
                                             (double)row[1] * (double)o->rotation[3 + j] +
                                             (double)row[2] * (double)o->rotation[6 + j]);
            to_origin += (double)row[j] * (double)o->offset[j];
        }
        p.view[4 * i + 3] = (ssdgs_real)(to_origin / scale);
    }
    const ssdgs_real zoom = v->orthographic ? o->scale : 1;
    p.fx = v->fx * zoom;
    p.fy = v->fy * zoom;
    p.cx = v->cx;
    p.cy = v->cy;
    p.near_plane = v->near_plane / o->scale;
    p.depth_scale = o->scale;
    p.presence = o->presence;
    p.log2_threshold = ssdgs__log2_threshold(frame);
    p.width = v->width;
    p.height = v->height;
    p.orthographic = v->orthographic;
    p.by_distance = v->by_distance;
    p.compensate = v->compensate;
    p.blur = v->blur;
    p.variance = s->pixel_variance;
    if (v->light >= 0) ssdgs__light_blur(s, &p.blur, &p.variance, &p.compensate);
    return p;
}

/* The memory that the stages up to WALK work in: batches of lights' views have the same. */
static ssdgs__view_memory *ssdgs__view_memory_of(const ssdgs_frame *frame, int view) {
    const int first = frame->batch[0] > 1 ? frame->batch[0] : 1;
    return (ssdgs__view_memory *)frame->memory->view_memory.memory + (view ? 1 + view - first : 0);
}

static void ssdgs__project_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const int chunks = ssdgs__chunks(frame->count), chunk = index % chunks;
    ssdgs_splat_view *v = frame->views + frame->batch[0] + index / chunks;
    ssdgs__piece piece;
    if (v->cached) return;
    for (int at = chunk * SSDGS__CHUNK;
         ssdgs__piece_next(frame, &at, ssdgs__chunk_end(frame, chunk), &piece);) {
        const ssdgs_placed *o = piece.object;
        if (ssdgs__out_of_reach(frame, v->light, o)) continue;
        const ssdgs__projection p = ssdgs__projection_of(frame, o, v);
        frame->context->k->project(&p, o->gaussians.gaussians, o->gaussians.stride, (size_t)piece.begin,
                                   (size_t)piece.end, v->record + o->first, v->depth + o->first,
                                   v->slope ? v->slope + 2 * o->first : NULL);
        for (int i = 0; i < piece.gap; i++) v->depth[o->first + piece.end + i] = -1;
    }
}

static ssdgs_result ssdgs__project(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    const size_t n = (size_t)frame->count + SSDGS__BLOCK;
    for (int i = frame->batch[0]; i < frame->batch[1]; i++) {
        ssdgs_splat_view *v = frame->views + i;
        ssdgs__view_memory *m = ssdgs__view_memory_of(frame, i);
        if (v->cached) continue;
        SSDGS__RESERVE(m->record, v->record, ssdgs_record, n);
        SSDGS__RESERVE(m->depth, v->depth, ssdgs_real, n);
        v->slope = NULL;
        if (!i && ssdgs__asks_depth(frame)) SSDGS__RESERVE(m->slope, v->slope, ssdgs_real, 2 * n);
        v->tiles_x = (v->width + 15) / 16;
        v->tiles_y = (v->height + 15) / 16;
    }
    ssdgs__parallel(context, (frame->batch[1] - frame->batch[0]) * ssdgs__chunks(frame->count),
                    ssdgs__project_task, frame);
    return SSDGS_OK;
}

/* The memory that SORT and BIN of a view work in: two keys of each Gaussian, later its box and, behind all
   boxes, the instances of each rank. The camera's view borrows that of the colours, which come later. */
static void *ssdgs__bin_memory(const ssdgs_frame *frame, int view) {
    return view ? ssdgs__view_memory_of(frame, view)->keys.memory : frame->scratch->color.memory;
}

static ssdgs_result ssdgs__bin_reserve(const ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    for (int i = frame->batch[0]; i < frame->batch[1]; i++) {
        uint32_t *words;
        if (!i || frame->views[i].cached) continue;
        SSDGS__RESERVE(ssdgs__view_memory_of(frame, i)->keys, words, uint32_t,
                       4 * (size_t)frame->count + SSDGS__SORT_WORDS);
        (void)words;
    }
    return SSDGS_OK;
}

/* Least-significant-digit radix sort of (depth bits, index): stable, so equal depths keep the order of their
   indices. Depths that are alike differ in few bits, which take fewer passes. */
static void ssdgs__sort_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    ssdgs_splat_view *v = frame->views + frame->batch[0] + index;
    const int n = frame->count;
    if (v->cached) return;
    uint64_t *from = (uint64_t *)ssdgs__bin_memory(frame, frame->batch[0] + index), *to = from + n;
    uint32_t *histogram = (uint32_t *)(to + n);
    uint32_t low = UINT32_MAX, high = 0;
    int visible = 0, width = 0;
    for (int begin = 0, stop; ssdgs__reached_next(frame, v->light, &begin, n, &stop); begin = stop)
        for (int i = begin; i < stop; i++) {
            const float depth = (float)v->depth[i];
            if (!(depth >= 0)) continue;
            uint32_t bits;
            memcpy(&bits, &depth, 4);
            from[visible++] = (uint64_t)bits << 32 | (uint32_t)i;
            low = bits < low ? bits : low;
            high = bits > high ? bits : high;
        }
    while (width < 32 && visible && (high - low) >> width) width++;
    const int passes = (width + 11) / 12, digit = passes ? (width + passes - 1) / passes : 0;
    for (int pass = 0; pass < passes; pass++) {
        const uint32_t mask = (1u << digit) - 1;
        const int shift = digit * pass;
        uint32_t sum = 0;
        memset(histogram, 0, (mask + 1) * sizeof *histogram);
        for (int i = 0; i < visible; i++) histogram[((uint32_t)(from[i] >> 32) - low) >> shift & mask]++;
        for (uint32_t i = 0; i <= mask; i++) {
            const uint32_t count = histogram[i];
            histogram[i] = sum;
            sum += count;
        }
        for (int i = 0; i < visible; i++)
            to[histogram[((uint32_t)(from[i] >> 32) - low) >> shift & mask]++] = from[i];
        uint64_t *swap = from;
        from = to;
        to = swap;
    }
    for (int i = 0; i < visible; i++) v->order[i] = (uint32_t)from[i];
    v->visible = visible;
    v->nearest = visible ? v->depth[v->order[0]] : 0;
}

static ssdgs_result ssdgs__sort(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    const size_t n = (size_t)frame->count;
    for (int i = frame->batch[0]; i < frame->batch[1]; i++) {
        ssdgs__view_memory *m = ssdgs__view_memory_of(frame, i);
        if (frame->views[i].cached) continue;
        SSDGS__RESERVE(m->order, frame->views[i].order, uint32_t, n + 1);
    }
    SSDGS__TRY(ssdgs__bin_reserve(frame));
    ssdgs__parallel(context, frame->batch[1] - frame->batch[0], ssdgs__sort_task, frame);
    return SSDGS_OK;
}

/* Tiles the record's bounding box touches: first and last column and row. */
static void ssdgs__tile_box(const ssdgs_splat_view *v, const ssdgs_record *record, uint16_t box[4]) {
    const ssdgs_real low[2] = {record->x - record->extent_x - 1, record->y - record->extent_y - 1};
    const ssdgs_real high[2] = {record->x + record->extent_x + 1, record->y + record->extent_y + 1};
    const int tiles[2] = {v->tiles_x, v->tiles_y};
    for (int a = 0; a < 2; a++) {
        const ssdgs_real last = (ssdgs_real)(16 * tiles[a] - 1);
        const ssdgs_real from = low[a] < last ? low[a] : last, to = high[a] < last ? high[a] : last;
        box[a] = (uint16_t)((unsigned)(int)(from > 0 ? from : 0) / 16);
        box[2 + a] = (uint16_t)((unsigned)(int)(to > 0 ? to : 0) / 16);
    }
}

/* One of SSDGS__BIN_CHUNKS equal parts of `count` ranks or Gaussians. */
static void ssdgs__bin_range(int count, int chunk, int *begin, int *end) {
    const int size = (count + SSDGS__BIN_CHUNKS - 1) / SSDGS__BIN_CHUNKS;
    *begin = chunk * size < count ? chunk * size : count;
    *end = *begin + size < count ? *begin + size : count;
}

/* The boxes of a chunk of Gaussians, empty where not drawn, and how many instances there can be at most. */
static void ssdgs__bin_room_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const int view = frame->batch[0] + index / SSDGS__BIN_CHUNKS, chunk = index % SSDGS__BIN_CHUNKS;
    const ssdgs_splat_view *v = frame->views + view;
    ssdgs__view_memory *m = ssdgs__view_memory_of(frame, view);
    uint64_t room = 0;
    if (v->cached) return;
    int begin, end, stop;
    ssdgs__bin_range(frame->count, chunk, &begin, &end);
    for (; ssdgs__reached_next(frame, v->light, &begin, end, &stop); begin = stop)
        for (int g = begin; g < stop; g++) {
            uint16_t *box = (uint16_t *)ssdgs__bin_memory(frame, view) + 4 * (size_t)g;
            if (v->depth[g] >= 0) {
                ssdgs__tile_box(v, v->record + g, box);
                room += (uint64_t)(box[2] - box[0] + 1) * (uint64_t)(box[3] - box[1] + 1);
            } else {
                box[0] = box[1] = 1;
                box[2] = box[3] = 0;
            }
        }
    m->chunk_room[chunk] = room;
}

/* The instances of a chunk of Gaussians, from its first number on: tiles for places. */
static void ssdgs__bin_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const int view = frame->batch[0] + index / SSDGS__BIN_CHUNKS, chunk = index % SSDGS__BIN_CHUNKS;
    const ssdgs__view_memory *m = ssdgs__view_memory_of(frame, view);
    const ssdgs_splat_view *v = frame->views + view;
    uint32_t number = (uint32_t)m->chunk_room[chunk];
    if (v->cached) return;
    int begin, end, stop;
    ssdgs__bin_range(frame->count, chunk, &begin, &end);
    for (; ssdgs__reached_next(frame, v->light, &begin, end, &stop); begin = stop)
        number = frame->context->k->bin(v, (const uint16_t *)ssdgs__bin_memory(frame, view),
                                        ssdgs__log2_threshold(frame), begin, stop, number);
}

static uint32_t *ssdgs__histogram(const ssdgs_frame *frame, int view, int chunk) {
    const ssdgs_splat_view *v = frame->views + view;
    return (uint32_t *)ssdgs__view_memory_of(frame, view)->histogram.memory +
           (size_t)chunk * (size_t)(v->tiles_x * v->tiles_y);
}

/* Counts the instances that a chunk of ranks has in each tile. Copies of_gaussian into the order of ranks, as
   its entries lie anywhere in memory. */
static void ssdgs__bin_count_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const int view = frame->batch[0] + index / SSDGS__BIN_CHUNKS, chunk = index % SSDGS__BIN_CHUNKS;
    const ssdgs_splat_view *v = frame->views + view;
    if (v->cached) return;
    ssdgs_instances *of_rank = (ssdgs_instances *)ssdgs__bin_memory(frame, view) + frame->count;
    uint32_t *histogram = ssdgs__histogram(frame, view, chunk);
    memset(histogram, 0, sizeof *histogram * (size_t)(v->tiles_x * v->tiles_y));
    int begin, end;
    ssdgs__bin_range(v->visible, chunk, &begin, &end);
    for (int rank = begin; rank < end; rank++) {
        const ssdgs_instances of = v->of_gaussian[v->order[rank]];
        of_rank[rank] = of;
        int ahead;
        if ((ahead = rank + SSDGS__AHEAD) < end)
            SSDGS__PREFETCH(v->instance + v->of_gaussian[v->order[ahead]].first);
        if ((ahead += SSDGS__AHEAD) < end) SSDGS__PREFETCH(v->of_gaussian + v->order[ahead]);
        for (uint32_t i = of.first; i < of.first + of.count; i++) histogram[v->instance[i].place]++;
    }
}

/* Turns the counts into places: per tile, chunk after chunk, so lists stay in depth order. */
static void ssdgs__bin_offsets_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const int view = frame->batch[0] + index;
    ssdgs_splat_view *v = frame->views + view;
    const int tiles = v->tiles_x * v->tiles_y;
    if (v->cached) return;
    uint32_t *place = v->tile_start + 1, sum = 0; /* a tile's list ends where the next one's starts */
    memset(v->tile_start, 0, ((size_t)tiles + 1) * sizeof *place);
    for (int chunk = 0; chunk < SSDGS__BIN_CHUNKS; chunk++) {
        const uint32_t *counts = ssdgs__histogram(frame, view, chunk);
        for (int tile = 0; tile < tiles; tile++) place[tile] += counts[tile];
    }
    for (int tile = 0; tile < tiles; tile++) {
        const uint32_t count = place[tile];
        place[tile] = sum;
        sum += count;
    }
    for (int chunk = 0; chunk < SSDGS__BIN_CHUNKS; chunk++) {
        uint32_t *counts = ssdgs__histogram(frame, view, chunk);
        for (int tile = 0; tile < tiles; tile++) {
            const uint32_t count = counts[tile];
            counts[tile] = place[tile];
            place[tile] += count;
        }
    }
    v->instances = sum;
}

static void ssdgs__bin_scatter_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const int view = frame->batch[0] + index / SSDGS__BIN_CHUNKS, chunk = index % SSDGS__BIN_CHUNKS;
    const ssdgs_splat_view *v = frame->views + view;
    if (v->cached) return;
    const ssdgs_instances *of_rank = (const ssdgs_instances *)ssdgs__bin_memory(frame, view) + frame->count;
    uint32_t *place = ssdgs__histogram(frame, view, chunk);
    int begin, end;
    ssdgs__bin_range(v->visible, chunk, &begin, &end);
    for (int rank = begin; rank < end; rank++) {
        const ssdgs_instances of = of_rank[rank];
        if (rank + SSDGS__AHEAD < end) SSDGS__PREFETCH(v->instance + of_rank[rank + SSDGS__AHEAD].first);
        for (uint32_t i = of.first; i < of.first + of.count; i++) {
            const uint32_t at = place[v->instance[i].place]++;
            v->instance[i].place = at;
            v->tile_list[at].gaussian = v->order[rank];
            v->tile_list[at].mask = v->instance[i].mask;
        }
    }
}

static ssdgs_result ssdgs__bin(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    const size_t n = (size_t)frame->count;
    const int views = frame->batch[1] - frame->batch[0], tasks = views * SSDGS__BIN_CHUNKS;
    SSDGS__TRY(ssdgs__bin_reserve(frame)); /* a hook may have sorted */
    ssdgs__parallel(context, tasks, ssdgs__bin_room_task, frame);
    for (int i = frame->batch[0]; i < frame->batch[1]; i++) {
        ssdgs_splat_view *v = frame->views + i;
        ssdgs__view_memory *m = ssdgs__view_memory_of(frame, i);
        const size_t tiles = (size_t)(v->tiles_x * v->tiles_y);
        uint64_t room = 0;
        if (v->cached) continue;
        for (int chunk = 0; chunk < SSDGS__BIN_CHUNKS; chunk++) { /* from here on a chunk's first number */
            const uint64_t chunk_room = m->chunk_room[chunk];
            m->chunk_room[chunk] = room;
            room += chunk_room;
        }
        if (room > UINT32_MAX / 2)
            return ssdgs__fail(context, SSDGS_ERR_LIMIT,
                               v->light < 0 ? "too many splats for an image of %d x %d"
                                            : "too many splats for a light's map of %d x %d",
                               v->width, v->height);
        v->instance_room = (size_t)room;
        SSDGS__RESERVE(m->of_gaussian, v->of_gaussian, ssdgs_instances, n + 1);
        SSDGS__RESERVE(m->instance, v->instance, ssdgs_instance, v->instance_room + 1);
        SSDGS__RESERVE(m->list, v->tile_list, ssdgs_tile_entry, v->instance_room + 1);
        SSDGS__RESERVE(m->start, v->tile_start, uint32_t, tiles + 1);
        uint32_t *histogram;
        SSDGS__RESERVE(m->histogram, histogram, uint32_t, tiles * SSDGS__BIN_CHUNKS);
        (void)histogram;
    }
    ssdgs__parallel(context, tasks, ssdgs__bin_task, frame);
    ssdgs__parallel(context, tasks, ssdgs__bin_count_task, frame);
    ssdgs__parallel(context, views, ssdgs__bin_offsets_task, frame);
    ssdgs__parallel(context, tasks, ssdgs__bin_scatter_task, frame);
    return SSDGS_OK;
}

/* ==== >>shadow  eqs. 6, 7 and the depth cue; which Gaussians the camera sees ==== */

/* Reads records and tile lists of all views in one loop: the camera's walk and the light pass run side by
   side. Writes seen, visibility, depth_cue, flux and the light maps. Stage WALK. */

/* walked: entries count only where the walk saw them blend. */
static ssdgs__tile ssdgs__tile_of(const ssdgs_frame *frame, const ssdgs_splat_view *v, int index,
                                  int walked) {
    ssdgs__tile t;
    memset(&t, 0, sizeof t);
    t.record = v->record;
    t.depth = v->depth;
    t.slope = v->slope;
    t.list = v->tile_list + v->tile_start[index];
    t.seen = walked ? v->tile_seen + v->tile_start[index] : NULL;
    t.count = v->tile_start[index + 1] - v->tile_start[index];
    t.x = 16 * (index % v->tiles_x);
    t.y = 16 * (index / v->tiles_x);
    t.width = v->width;
    t.height = v->height;
    t.log2_threshold = ssdgs__log2_threshold(frame);
    t.stop = frame->options.stop;
    t.max_error = frame->options.max_error;
    t.bias = frame->bias[0];
    t.depth_origin = v->nearest;
    t.cx = v->cx;
    t.cy = v->cy;
    t.inverse_focal = 1 / (v->fx * v->distance);
    t.cue = frame->depth_cue != NULL;
    t.flux = frame->flux != NULL;
    t.orthographic = v->orthographic;
    t.light_map = v->light_map && t.count ? v->light_map + (size_t)v->map_tile[index] * 256 : NULL;
    const int shared =
        v->light >= 0 &&
        (v[-1].light == v->light || (v + 1 < frame->views + frame->view_count && v[1].light == v->light));
    t.of_gaussian = shared ? NULL : v->of_gaussian;
    return t;
}

/* The tile's part of scene_depth, if there is one, into 256 values. */
static void ssdgs__tile_scene_depth(const ssdgs_frame *frame, ssdgs__tile *tile, ssdgs_real *values) {
    if (!frame->scene_depth) return;
    for (int i = 0; i < 256; i++) {
        const int x = tile->x + (i / 16 & 3) * 4 + (i & 3), y = tile->y + i / 64 * 4 + (i % 16 >> 2);
        const int inside = x < tile->width && y < tile->height;
        const ssdgs_real depth =
            inside ? frame->scene_depth[(size_t)y * (size_t)frame->stride + (size_t)x] : 0;
        /* median_depth's 0, or a depth by no alpha, hides nothing */
        values[i] = inside && !(depth > 0) ? (ssdgs_real)FLT_MAX : depth;
    }
    tile->scene_depth = values;
}

static void ssdgs__walk_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const ssdgs_splat_view *v = frame->views + frame->batch[0];
    for (; v->cached == 2 || index >= v->tiles_x * v->tiles_y; v++)
        index -= v->cached == 2 ? 0 : v->tiles_x * v->tiles_y;
    ssdgs__tile tile = ssdgs__tile_of(frame, v, index, 0);
    if (!tile.count) return;
    ssdgs_real scene_depth[256];
    if (v->light < 0) {
        ssdgs__tile_scene_depth(frame, &tile, scene_depth);
        frame->context->k->walk_camera(&tile, v->tile_seen + v->tile_start[index],
                                       v->tile_needed ? v->tile_needed + v->tile_start[index] : NULL);
    } else frame->context->k->walk_light(&tile, v->tile_sums + (size_t)v->tile_start[index] * 4);
}

#define SSDGS__POINTS 256 /* that an occluder is asked for at once */

typedef struct ssdgs__gather_job {
    const ssdgs_frame *frame;
    int light, first_view, end_view; /* the light's */
} ssdgs__gather_job;

/* Per Gaussian, the sums over its instances in the light's views, in their order, and their ratios. */
static void ssdgs__gather_light_task(void *data, int index) {
    const ssdgs__gather_job *job = (const ssdgs__gather_job *)data;
    const ssdgs_frame *frame = job->frame;
    const size_t first = (size_t)frame->count * (size_t)job->light;
    int begin, end, stop;
    ssdgs__bin_range(frame->count, index, &begin, &end);
    for (int g = begin; ssdgs__reached_next(frame, job->light, &g, end, &stop);)
        for (; g < stop; g++) {
            const size_t at = first + (size_t)g;
            ssdgs_real sum[4] = {0, 0, 0, 0};
            for (int view = job->first_view; view < job->end_view; view++) {
                const ssdgs_splat_view *v = frame->views + view;
                const ssdgs_instances of = v->of_gaussian[g];
                for (uint32_t i = of.first; i < of.first + of.count; i++)
                    for (int c = 0; c < 4; c++)
                        sum[c] += v->tile_sums[(size_t)v->instance[i].place * 4 + (size_t)c];
            }
            frame->visibility[at] =
                sum[1] > 0 ? sum[0] / sum[1] : 1; /* nothing in the way of an empty footprint */
            if (frame->depth_cue) frame->depth_cue[at] = sum[1] > 0 && sum[2] > 0 ? sum[2] / sum[1] : 0;
            if (frame->flux) frame->flux[at] = sum[3];
        }
}

/* What passes an engine's shadow map on the way to a point, of four comparisons; -1: it does not have the
   place. away: unit vector from the light. */
static ssdgs_real ssdgs__shadow_map_at(const ssdgs_shadow_map *m, const ssdgs_real *point,
                                       const double away[3], double distance) {
    const int columns = m->flags & SSDGS_COLUMN_MAJOR;
    double at[4], by[4], passed = 0; /* in clip space, and how it changes away from the light */
    for (int i = 0; i < 4; i++) {
        at[i] = (double)m->matrix[columns ? 12 + i : 4 * i + 3];
        by[i] = 0;
        for (int j = 0; j < 3; j++) {
            const double factor = (double)m->matrix[columns ? 4 * j + i : 4 * i + j];
            at[i] += factor * (double)point[j];
            by[i] += factor * away[j];
        }
    }
    const double down = m->flags & SSDGS_CLIP_Y_DOWN ? 1 : -1, w = m->width, h = m->height;
    double x = (1 + at[0] / at[3]) / 2 * w - 0.5, y = (1 + down * at[1] / at[3]) / 2 * h - 0.5;
    if (!(at[3] > 0 && x >= -0.5 && x <= w - 0.5 && y >= -0.5 && y <= h - 0.5)) return -1;
    const int reversed = !(m->range > 0) && by[2] * at[3] < at[2] * by[3];
    const double bias = (double)m->bias, w_there = at[3] - bias * by[3], z = (at[2] - bias * by[2]) / w_there;
    double d = m->range > 0                     ? (distance - bias) / (double)m->range
               : m->flags & SSDGS_CLIP_Z_FROM_0 ? z
                                                : (1 + z) / 2;
    const int beyond = reversed ? d < 0 : d > 1;
    if (!(m->range > 0) && !(w_there > 0)) return 1; /* nearer to the light than the bias */
    d = d > 1 ? 1 : d > 0 ? d : 0;
    x = x > 0 ? x : 0, y = y > 0 ? y : 0;
    for (int i = 0; i < 4; i++) {
        const int column = (int)x + (i & 1), row = (int)y + (i >> 1);
        const double part = (i & 1 ? x - (int)x : (int)x + 1 - x) * (i >> 1 ? y - (int)y : (int)y + 1 - y);
        const ptrdiff_t line = m->pitch * (row < m->height ? row : m->height - 1);
        float value;
        memcpy(&value, (const char *)m->depth + line + 4 * (column < m->width ? column : m->width - 1), 4);
        const double there = (double)value;
        passed += (reversed ? there > d : there < d) ? 0 : part;
    }
    return beyond && passed > 0.999999 ? -1 : (ssdgs_real)passed;
}

/* Whether the occluder has something to say of a light. */
static int ssdgs__occluded(const ssdgs_frame *frame, int light) {
    const ssdgs_occluder *o = frame->occluder;
    int any = o && o->shadow;
    for (int i = 0; o && i < o->map_count && !any; i++) any = o->maps[i].light == light;
    return any;
}

/* What the occluder leaves of a light at points: fraction (count). */
static void ssdgs__let_pass(const ssdgs_frame *frame, int light, const ssdgs_real *points, int count,
                            ssdgs_real *fraction) {
    const ssdgs_occluder *o = frame->occluder;
    const ssdgs_light *from = frame->lights + light;
    for (int i = 0; i < count; i++) fraction[i] = 1;
    if (count && o->shadow) o->shadow(o->user, light, points, count, fraction);
    for (int i = 0; i < count && o->map_count; i++, points += 3) {
        double away[3], distance = 0;
        for (int c = 0; c < 3; c++) {
            const double d = (double)points[c] - (double)from->position[c];
            away[c] = from->kind == SSDGS_LIGHT_DIRECTIONAL ? (double)from->direction[c] : d;
            distance += away[c] * away[c];
        }
        distance = sqrt(distance);
        for (int c = 0; c < 3; c++) away[c] /= distance > 0 ? distance : 1;
        ssdgs_real passed = -1;
        for (int j = 0; j < o->map_count && passed < 0; j++)
            if (o->maps[j].light == light && o->maps[j].depth)
                passed = ssdgs__shadow_map_at(o->maps + j, points, away, distance);
        if (passed >= 0) fraction[i] *= passed;
    }
}

/* Multiplies the visibility and flux of Gaussians `which` by the occluder's fractions. */
static void ssdgs__occlude(const ssdgs_frame *frame, int light, const int *which, const ssdgs_real *points,
                           int count) {
    const size_t first = (size_t)frame->count * (size_t)light;
    ssdgs_real fraction[SSDGS__POINTS];
    ssdgs__let_pass(frame, light, points, count, fraction);
    for (int i = 0; i < count; i++) {
        frame->visibility[first + (size_t)which[i]] *= fraction[i];
        if (frame->flux) frame->flux[first + (size_t)which[i]] *= fraction[i];
    }
}

static void ssdgs__occlude_task(void *data, int index) {
    const ssdgs__gather_job *job = (const ssdgs__gather_job *)data;
    const ssdgs_frame *frame = job->frame;
    ssdgs_real points[3 * SSDGS__POINTS];
    int at, end, which[SSDGS__POINTS], count = 0;
    ssdgs__piece piece;
    ssdgs__bin_range(frame->count, index, &at, &end);
    while (ssdgs__piece_next(frame, &at, end, &piece)) {
        const ssdgs_placed *o = piece.object;
        const ssdgs_model_view *g = &o->gaussians;
        if (ssdgs__out_of_reach(frame, job->light, o)) continue;
        for (int i = piece.begin; i < piece.end; i++) {
            ssdgs_real local[3], *to = points + 3 * count;
            for (size_t c = 0; c < 3; c++)
                local[c] = g->gaussians[(SSDGS_POSITION + c) * g->stride + (size_t)i];
            ssdgs__turn(o, 0, local, to);
            for (int c = 0; c < 3; c++) to[c] = to[c] * o->scale + o->offset[c];
            which[count] = o->first + i;
            count += ssdgs__finite(to[0]) && ssdgs__finite(to[1]) && ssdgs__finite(to[2]);
            if (count < SSDGS__POINTS) continue;
            ssdgs__occlude(frame, job->light, which, points, count);
            count = 0;
        }
    }
    ssdgs__occlude(frame, job->light, which, points, count);
}

static void ssdgs__gather_camera_task(void *data, int index) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const ssdgs_splat_view *v = frame->views;
    int begin, end, stop;
    ssdgs__bin_range(frame->count, index, &begin, &end);
    memset(frame->seen + begin, 0, (size_t)(end - begin));
    for (int g = begin; ssdgs__reached_next(frame, -1, &g, end, &stop);)
        for (; g < stop; g++) {
            const ssdgs_instances of = v->of_gaussian[g];
            unsigned seen = 0, needed = 0;
            for (uint32_t i = of.first; i < of.first + of.count; i++) {
                const uint32_t place = v->instance[i].place;
                seen |= v->tile_seen[place];
                needed |= v->tile_needed ? v->tile_needed[place] : v->tile_seen[place];
            }
            frame->seen[g] = (unsigned char)(needed ? SSDGS_SEEN : seen ? SSDGS_SKIPPED : 0);
        }
}

static ssdgs_result ssdgs__walk(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    int tiles = 0;
    for (int i = frame->batch[0]; i < frame->batch[1]; i++) {
        ssdgs_splat_view *v = frame->views + i;
        ssdgs__view_memory *m = ssdgs__view_memory_of(frame, i),
                           *own = (ssdgs__view_memory *)frame->memory->view_memory.memory + i;
        if (v->cached == 2) continue;
        tiles += v->tiles_x * v->tiles_y;
        if (v->light < 0) {
            SSDGS__RESERVE(m->seen, v->tile_seen, uint16_t, v->instances + 1);
            v->tile_needed = NULL;
            if (frame->options.max_error > 0)
                SSDGS__RESERVE(m->needed, v->tile_needed, unsigned char, v->instances + 1);
        } else {
            frame->light_instances += v->instances;
            SSDGS__RESERVE(m->sums, v->tile_sums, ssdgs_real, v->instances * 4 + 4);
            v->light_map = NULL;
            if (!ssdgs__wants_maps(frame)) continue;
            const int all = v->tiles_x * v->tiles_y;
            uint32_t used = 0;
            SSDGS__RESERVE(own->map_tile, v->map_tile, uint32_t, all + 1);
            for (int tile = 0; tile < all; tile++)
                v->map_tile[tile] = v->tile_start[tile] < v->tile_start[tile + 1] ? used++ : UINT32_MAX;
            SSDGS__RESERVE(own->light_map, v->light_map, ssdgs_light_pixel, (size_t)used * 256 + 1);
        }
    }
    ssdgs__parallel(context, tiles, ssdgs__walk_task, frame);
    if (!frame->batch[0] && frame->views->cached < 2)
        ssdgs__parallel(context, SSDGS__BIN_CHUNKS, ssdgs__gather_camera_task, frame);
    ssdgs__gather_job job;
    job.frame = frame;
    for (job.first_view = frame->batch[0] ? frame->batch[0] : 1; job.first_view < frame->batch[1];
         job.first_view = job.end_view) {
        job.light = frame->views[job.first_view].light;
        job.end_view = job.first_view + 1;
        while (job.end_view < frame->batch[1] && frame->views[job.end_view].light == job.light)
            job.end_view++;
        if (frame->views[job.first_view].cached) continue;
        ssdgs__parallel(context, SSDGS__BIN_CHUNKS, ssdgs__gather_light_task, &job);
        if (ssdgs__occluded(frame, job.light))
            ssdgs__parallel(context, SSDGS__BIN_CHUNKS, ssdgs__occlude_task, &job);
    }
    return SSDGS_OK;
}

/* ==== >>transport  true dipole transport: what comes to Gaussians from where light enters ==== */

/* Reads flux. Writes SSDGS__LENGTHS sums per Gaussian and light; shade calls it. Where flux enters: nodes
   of 8 consecutive Gaussians, then of 8 such nodes, and so on up to one. In the order that training leaves
   they are compact. */

typedef struct ssdgs__node {
    ssdgs_real x[3], flux;     /* the mean, and how much enters */
    ssdgs_real radius, spread; /* how far from the mean its sources lie at most, and the mean square */
    int points;                /* of a lowest node: how many points stand for it nearby */
} ssdgs__node;

#define SSDGS__LEVELS 12
#define SSDGS__LEAF 8   /* Gaussians of a lowest node, and parts of a higher one */
#define SSDGS__NEAR 256 /* lowest nodes near a block, taken together */
/* From SSDGS__FAR of its radii away a node is one point. From SSDGS__WIDE of the receivers' reaches away it
   joins the series around them. */
#define SSDGS__FAR ((ssdgs_real)2)
#define SSDGS__WIDE ((ssdgs_real)3)
/* In a lowest node whose radius is below SSDGS__COMPACT length units, all Gaussians with less than SSDGS__DIM
   of the mean flux are one point. */
#define SSDGS__DIM ((ssdgs_real)0.05)
#define SSDGS__COMPACT ((ssdgs_real)0.08)

/* How many levels n Gaussians have; where each begins, and after the last one how many nodes there are. */
static int ssdgs__levels(size_t n, size_t first[SSDGS__LEVELS + 1]) {
    int levels = 0;
    first[0] = 0;
    do {
        n = (n + SSDGS__LEAF - 1) / SSDGS__LEAF;
        first[levels + 1] = first[levels] + n;
    } while (++levels < SSDGS__LEVELS && n > 1);
    return levels;
}

/* Where light enters an object, in its space. */
typedef struct ssdgs__tree {
    const ssdgs_placed *object;
    ssdgs__node *nodes; /* (lights, count) */
    ssdgs_real *points; /* (lights, leaves, SSDGS__LEAF, 4) x, y, z, flux */
    size_t count, leaves;
} ssdgs__tree;

typedef struct ssdgs__node_job {
    const ssdgs_frame *frame;
    ssdgs__tree *trees;                /* (objects) those without transport have no leaves */
    const ssdgs__light_memory *lights; /* of those whose transport is ready nothing changes */
    int points;                        /* what tasks on leaves make: 0: nodes, 1: points */
} ssdgs__node_job;

/* A Gaussian as a node of its own. */
static ssdgs__node ssdgs__node_of(const ssdgs_frame *frame, const ssdgs_placed *o, int light, size_t i) {
    const ssdgs_model_view *g = &o->gaussians;
    const ssdgs_real *x = g->gaussians + (size_t)SSDGS_POSITION * g->stride + i;
    const ssdgs_real area = frame->lights[light].kind == SSDGS_LIGHT_DIRECTIONAL ? o->scale * o->scale : 1;
    const ssdgs_real flux = frame->flux[(size_t)frame->count * (size_t)light + (size_t)o->first + i] / area;
    const ssdgs__node node = {{x[0], x[g->stride], x[2 * g->stride]}, flux, 0, 0, 1};
    return node;
}

/* Grows a node by one of its parts, whose flux is not 0. */
static void ssdgs__node_add(ssdgs__node *node, const ssdgs__node *part) {
    node->flux += part->flux;
    for (int c = 0; c < 3; c++) node->x[c] += (part->x[c] - node->x[c]) * (part->flux / node->flux);
}

/* Grows a node's radius and spread by one of its parts. Its mean must be final. */
static void ssdgs__node_reach(ssdgs__node *node, const ssdgs__node *part) {
    ssdgs_real distance2 = 0;
    for (int c = 0; c < 3; c++) distance2 += (part->x[c] - node->x[c]) * (part->x[c] - node->x[c]);
    const ssdgs_real radius = part->radius + SSDGS__SQRT(distance2);
    node->radius = radius > node->radius ? radius : node->radius;
    node->spread += (part->spread + distance2) * (part->flux / node->flux);
}

/* A node of up to SSDGS__LEAF parts. */
static ssdgs__node ssdgs__node_join(const ssdgs__node *parts, size_t count) {
    ssdgs__node node;
    memset(&node, 0, sizeof node);
    for (size_t i = 0; i < count; i++)
        if (parts[i].flux > 0) ssdgs__node_add(&node, parts + i);
    for (size_t i = 0; i < count; i++)
        if (parts[i].flux > 0) ssdgs__node_reach(&node, parts + i);
    return node;
}

/* The Gaussians of a lowest node; returns how many. */
static size_t ssdgs__leaf_parts(const ssdgs_frame *frame, const ssdgs_placed *o, int light, size_t leaf,
                                ssdgs__node *parts) {
    const size_t n = (size_t)o->gaussians.count, first = SSDGS__LEAF * leaf;
    const size_t count = n - first < SSDGS__LEAF ? n - first : SSDGS__LEAF;
    for (size_t i = 0; i < count; i++) parts[i] = ssdgs__node_of(frame, o, light, first + i);
    return count;
}

/* The higher nodes of an object, all lights. */
static void ssdgs__join_task(void *data, int index) {
    const ssdgs__node_job *job = (const ssdgs__node_job *)data;
    const ssdgs__tree *tree = job->trees + index;
    size_t first[SSDGS__LEVELS + 1];
    const int levels = ssdgs__levels((size_t)tree->object->gaussians.count, first);
    for (int light = 0; light < job->frame->light_count && tree->leaves; light++) {
        if (job->lights[light].transport_ready || ssdgs__out_of_reach(job->frame, light, tree->object))
            continue;
        ssdgs__node *nodes = tree->nodes + tree->count * (size_t)light;
        for (int level = 1; level < levels; level++) {
            ssdgs__node *to = nodes + first[level];
            const size_t below = first[level] - first[level - 1];
            for (size_t i = 0; i < below; i += SSDGS__LEAF)
                to[i / SSDGS__LEAF] = ssdgs__node_join(nodes + first[level - 1] + i,
                                                       below - i < SSDGS__LEAF ? below - i : SSDGS__LEAF);
        }
    }
}

/* A node as a point: x, y, z, flux. */
static void ssdgs__point_put(ssdgs_real *point, const ssdgs__node *node) {
    memcpy(point, node->x, sizeof node->x);
    point[3] = node->flux;
}

/* The points that stand for lowest nodes nearby: Gaussians of much flux, and one for all others. */
static void ssdgs__points_of(const ssdgs_frame *frame, const ssdgs__tree *tree, int light, size_t leaf) {
    const ssdgs_real compact = SSDGS__COMPACT * tree->object->settings.length_unit;
    ssdgs__node *nodes = tree->nodes + tree->count * (size_t)light;
    const ssdgs_real mean = nodes[tree->count - 1].flux / (ssdgs_real)tree->object->gaussians.count;
    ssdgs_real *points = tree->points + (tree->leaves * (size_t)light + leaf) * SSDGS__LEAF * 4;
    ssdgs__node parts[SSDGS__LEAF], others;
    const size_t count = ssdgs__leaf_parts(frame, tree->object, light, leaf, parts);
    const ssdgs_real dim = nodes[leaf].radius < compact ? SSDGS__DIM * mean : 0;
    memset(&others, 0, sizeof others);
    for (size_t i = 0; i < count; i++) {
        if (parts[i].flux > dim) ssdgs__point_put(points + 4 * nodes[leaf].points++, parts + i);
        else if (parts[i].flux > 0) ssdgs__node_add(&others, parts + i);
    }
    if (others.flux > 0) ssdgs__point_put(points + 4 * nodes[leaf].points++, &others);
}

/* The lowest nodes of a chunk, all lights, or the points that stand for them. */
static void ssdgs__leaf_task(void *data, int chunk) {
    const ssdgs__node_job *job = (const ssdgs__node_job *)data;
    const ssdgs_frame *frame = job->frame;
    ssdgs__piece piece;
    for (int at = chunk * SSDGS__CHUNK;
         ssdgs__piece_next(frame, &at, ssdgs__chunk_end(frame, chunk), &piece);) {
        const ssdgs__tree *tree = job->trees + (piece.object - frame->objects);
        for (int light = 0; light < frame->light_count && tree->leaves; light++) {
            if (job->lights[light].transport_ready || ssdgs__out_of_reach(frame, light, piece.object))
                continue;
            for (size_t leaf = (size_t)piece.begin / SSDGS__LEAF; SSDGS__LEAF * leaf < (size_t)piece.end;
                 leaf++) {
                ssdgs__node parts[SSDGS__LEAF];
                if (job->points) ssdgs__points_of(frame, tree, light, leaf);
                else
                    tree->nodes[tree->count * (size_t)light + leaf] =
                        ssdgs__node_join(parts, ssdgs__leaf_parts(frame, piece.object, light, leaf, parts));
            }
        }
    }
}

static ssdgs_result ssdgs__nodes(const ssdgs_frame *frame, ssdgs__node_job *job) {
    ssdgs_context *context = frame->context;
    const size_t lights = (size_t)frame->light_count;
    const int chunks = ssdgs__chunks(frame->count);
    size_t nodes = 0, leaves = 0, first[SSDGS__LEVELS + 1];
    ssdgs__node *node;
    ssdgs_real *points;
    job->frame = frame;
    job->lights = ssdgs__light_memories(frame);
    SSDGS__RESERVE(frame->scratch->trees, job->trees, ssdgs__tree, frame->object_count + 1);
    for (int i = 0; i < frame->object_count; i++) {
        ssdgs__tree *tree = job->trees + i;
        const ssdgs_placed *o = tree->object = frame->objects + i;
        const int levels = ssdgs__levels((size_t)o->gaussians.count, first);
        tree->count = ssdgs__has_transport(o) ? first[levels] : 0;
        tree->leaves = ssdgs__has_transport(o) ? first[1] : 0;
        nodes += tree->count;
        leaves += tree->leaves;
    }
    SSDGS__RESERVE(frame->memory->nodes, node, ssdgs__node, nodes * lights + 1);
    SSDGS__RESERVE(frame->memory->points, points, ssdgs_real, leaves * SSDGS__LEAF * 4 * lights + 1);
    for (ssdgs__tree *tree = job->trees; tree < job->trees + frame->object_count; tree++) {
        tree->nodes = node;
        tree->points = points;
        node += tree->count * lights;
        points += tree->leaves * SSDGS__LEAF * 4 * lights;
    }
    job->points = 0;
    ssdgs__parallel(context, chunks, ssdgs__leaf_task, job);
    ssdgs__parallel(context, frame->object_count, ssdgs__join_task, job);
    job->points = 1; /* of the nodes' sums */
    ssdgs__parallel(context, chunks, ssdgs__leaf_task, job);
    return SSDGS_OK;
}

/* Gaussians that receive light, and what far sources bring around their middle, to second order: for each
   length the coefficients of 1, x, y, z, xx, xy, xz, yy, yz, zz. */
typedef struct ssdgs__receivers {
    ssdgs_real middle[3], reach, series[SSDGS__LENGTHS * SSDGS__SERIES];
} ssdgs__receivers;

/* Around some lanes' positions (3, BLOCK). */
static ssdgs__receivers ssdgs__receivers_at(const ssdgs_real *x, int lanes) {
    ssdgs__receivers to;
    ssdgs_real reach2 = 0;
    memset(&to, 0, sizeof to);
    for (int c = 0; c < 3; c++) {
        ssdgs_real low = x[c * SSDGS__BLOCK], high = low;
        for (int s = 1; s < lanes; s++) {
            const ssdgs_real at = x[c * SSDGS__BLOCK + s];
            low = at < low ? at : low;
            high = at > high ? at : high;
        }
        to.middle[c] = (low + high) / 2;
    }
    for (int s = 0; s < lanes; s++) {
        ssdgs_real distance2 = 0;
        for (int c = 0; c < 3; c++)
            distance2 += (x[c * SSDGS__BLOCK + s] - to.middle[c]) * (x[c * SSDGS__BLOCK + s] - to.middle[c]);
        reach2 = distance2 > reach2 ? distance2 : reach2;
    }
    to.reach = SSDGS__SQRT(reach2);
    return to;
}

/* What transport to one block of receivers works on. */
typedef struct ssdgs__transport_state {
    const ssdgs__kernels *k;
    const ssdgs__node *nodes;            /* the light's */
    const ssdgs_real *points;            /* of its lowest nodes */
    const ssdgs_real *x;                 /* (3, BLOCK) the receivers */
    ssdgs_real *sums;                    /* (SSDGS__LENGTHS, BLOCK) */
    ssdgs_real *remote, *nearby;         /* (5, SSDGS__SOURCES) and (SSDGS__SOURCES, 4), for a kernel */
    ssdgs_real scale[2], radii, reaches; /* SSDGS__FAR and SSDGS__WIDE, in this detail */
    int remote_count, nearby_count, leaf_count;
    int groups; /* of 16 receivers: a mask of those asked for */
    ssdgs__receivers block, group[SSDGS__BLOCK / 16];
    uint32_t leaves[SSDGS__NEAR]; /* lowest nodes near the block */
} ssdgs__transport_state;

/* What a node is for receivers: several points, one, or part of a series. */
enum { SSDGS__AS_POINTS, SSDGS__AS_POINT, SSDGS__AS_SERIES, SSDGS__WAYS };

static SSDGS__INLINE int ssdgs__way_of(const ssdgs__transport_state *t, const ssdgs__node *node,
                                       const ssdgs__receivers *to) {
    const ssdgs_real point = node->radius * t->radii + to->reach, series = to->reach * t->reaches;
    const ssdgs_real x = node->x[0] - to->middle[0], y = node->x[1] - to->middle[1],
                     z = node->x[2] - to->middle[2], distance2 = x * x + y * y + z * z;
    const int point_like = distance2 > point * point;
    return point_like +
           (point_like & (distance2 > series * series)); /* no branch: it would be mispredicted */
}

static void ssdgs__remote_flush(ssdgs__transport_state *t, ssdgs__receivers *to) {
    for (; t->remote_count % 16; t->remote_count++)
        for (int c = 0; c < 5; c++) t->remote[c * SSDGS__SOURCES + t->remote_count] = 0;
    t->k->expand(t->remote, t->remote_count, to->middle, t->scale, to->series);
    t->remote_count = 0;
}

static void ssdgs__remote_add(ssdgs__transport_state *t, ssdgs__receivers *to, const ssdgs__node *node) {
    ssdgs_real *const at = t->remote + t->remote_count++;
    for (int c = 0; c < 3; c++) at[c * SSDGS__SOURCES] = node->x[c];
    at[3 * SSDGS__SOURCES] = node->flux;
    at[4 * SSDGS__SOURCES] = node->spread;
    if (t->remote_count == SSDGS__SOURCES) ssdgs__remote_flush(t, to);
}

static void ssdgs__nearby_flush(ssdgs__transport_state *t, int group) {
    t->k->transport(t->nearby, t->nearby_count, t->x + 16 * group, t->scale, t->sums + 16 * group);
    t->nearby_count = 0;
}

/* The lowest nodes near the block, to each of its groups of 16. */
static void ssdgs__transport_leaves(ssdgs__transport_state *t) {
    for (int group = 0; group < SSDGS__BLOCK / 16; group++) {
        ssdgs__receivers *to = t->group + group;
        uint32_t list[SSDGS__WAYS][SSDGS__NEAR];
        int count[SSDGS__WAYS] = {0, 0, 0};
        if (!(t->groups >> group & 1)) continue;
        for (int i = 0; i < t->leaf_count; i++) {
            const int way = ssdgs__way_of(t, t->nodes + t->leaves[i], to);
            list[way][count[way]++] = t->leaves[i];
        }
        for (int i = 0; i < count[SSDGS__AS_SERIES]; i++)
            ssdgs__remote_add(t, to, t->nodes + list[SSDGS__AS_SERIES][i]);
        ssdgs__remote_flush(t, to);
        for (int i = 0; i < count[SSDGS__AS_POINT]; i++)
            ssdgs__point_put(t->nearby + 4 * t->nearby_count++, t->nodes + list[SSDGS__AS_POINT][i]);
        for (int i = 0; i < count[SSDGS__AS_POINTS]; i++) {
            const uint32_t leaf = list[SSDGS__AS_POINTS][i];
            if (t->nearby_count > SSDGS__SOURCES - SSDGS__LEAF) ssdgs__nearby_flush(t, group);
            memcpy(t->nearby + 4 * t->nearby_count, t->points + (size_t)leaf * 4 * SSDGS__LEAF,
                   4 * SSDGS__LEAF * sizeof *t->nearby);
            t->nearby_count += t->nodes[leaf].points;
        }
        ssdgs__nearby_flush(t, group);
    }
    t->leaf_count = 0;
}

typedef struct ssdgs__transport_job {
    ssdgs__node_job tree; /* where the light enters */
    int blocks; /* of SSDGS__BLOCK Gaussians, of all in the frame, seen or not: sums do not depend on the
                   camera */
    ssdgs_real *sources; /* (slots, 5 remote + 4 nearby, SSDGS__SOURCES) */
    ssdgs_real *sums;    /* (lights, blocks, SSDGS__LENGTHS, SSDGS__BLOCK) */
    unsigned char
        *known; /* (lights, blocks) masks of groups of 16 whose sums are there: for as long as lights rest */
} ssdgs__transport_job;

/* True dipole transport to some groups of a block, a mask: sum_k = sum over h of flux_h exp(-r / l_k) /
   (2 pi l_k r), r their distance. The profiles integrate to 1 over a plane. Far nodes become one
   series around the block. Each group of 16 takes the rest as a series or as points. */
static void ssdgs__transport_block(const ssdgs__transport_job *job, const ssdgs__tree *tree, int light,
                                   int slot, const ssdgs_real *x, int groups, ssdgs_real *sums) {
    const ssdgs_frame *frame = job->tree.frame;
    const ssdgs_real soft = (ssdgs_real)SSDGS__SOFT * tree->object->settings.length_unit;
    const ssdgs_real longer =
        ssdgs__has_medium(&tree->object->settings, tree->object->terms) ? 1 : tree->object->translucency;
    const ssdgs_real unit = tree->object->settings.length_unit * longer; /* a medium's weights have it */
    size_t first[SSDGS__LEVELS + 1], stack[SSDGS__LEAF * SSDGS__LEVELS];
    int level_of[SSDGS__LEAF * SSDGS__LEVELS], depth = 0;
    const int levels = ssdgs__levels((size_t)tree->object->gaussians.count, first);
    ssdgs__transport_state t;
    t.k = frame->context->k;
    t.nodes = tree->nodes + tree->count * (size_t)light;
    t.points = tree->points + tree->leaves * (size_t)light * SSDGS__LEAF * 4;
    t.x = x;
    t.sums = sums;
    t.remote = job->sources + (size_t)slot * 9 * SSDGS__SOURCES;
    t.nearby = t.remote + 5 * SSDGS__SOURCES;
    t.scale[0] = soft * soft;
    t.scale[1] = (ssdgs_real)-1.4426950408889634 /
                 ((ssdgs_real)SSDGS__SHORTEST * (ssdgs_real)(1 << (SSDGS__LENGTHS - 1)) * unit);
    t.radii = SSDGS__FAR * frame->options.transport_detail;
    t.reaches = SSDGS__WIDE * frame->options.transport_detail;
    t.remote_count = t.nearby_count = t.leaf_count = 0;
    t.groups = groups;
    t.block = ssdgs__receivers_at(x, SSDGS__BLOCK);
    for (int i = 0; i < SSDGS__BLOCK / 16; i++) t.group[i] = ssdgs__receivers_at(x + 16 * i, 16);
    memset(sums, 0, SSDGS__LENGTHS * SSDGS__BLOCK * sizeof *sums);
    for (stack[depth] = 0, level_of[depth++] = levels - 1; depth;) {
        const size_t at = stack[--depth];
        const int level = level_of[depth];
        const ssdgs__node *node = t.nodes + first[level] + at;
        if (!(node->flux > 0)) continue;
        if (ssdgs__way_of(&t, node, &t.block) == SSDGS__AS_SERIES) ssdgs__remote_add(&t, &t.block, node);
        else if (level) {
            const size_t end = SSDGS__LEAF * (at + 1), parts = first[level] - first[level - 1];
            for (size_t part = SSDGS__LEAF * at; part < end && part < parts; part++) {
                stack[depth] = part;
                level_of[depth++] = level - 1;
            }
        } else {
            t.leaves[t.leaf_count++] = (uint32_t)at;
            if (t.leaf_count < SSDGS__NEAR) continue;
            ssdgs__remote_flush(&t, &t.block);
            ssdgs__transport_leaves(&t);
        }
    }
    ssdgs__remote_flush(&t, &t.block);
    ssdgs__transport_leaves(&t);
    t.k->series(t.block.series, t.block.middle, x, SSDGS__BLOCK, sums);
    for (int i = 0; i < SSDGS__BLOCK / 16; i++)
        if (groups >> i & 1) t.k->series(t.group[i].series, t.group[i].middle, x + 16 * i, 16, sums + 16 * i);
    for (int k = 0; k < SSDGS__LENGTHS; k++) {
        const ssdgs_real scale =
            (ssdgs_real)0.15915494309189535 / ((ssdgs_real)SSDGS__SHORTEST * (ssdgs_real)(1 << k) * unit);
        for (int s = 0; s < SSDGS__BLOCK; s++) sums[k * SSDGS__BLOCK + s] *= scale;
    }
}

/* Blocks of a slot are neighbours; slots are fixed by the number of blocks alone. */
static int ssdgs__slot_begin(int blocks, int slot) { return (int)((int64_t)blocks * slot / SSDGS__SLOTS); }

/* Transport to groups that are to be shaded and not known yet. */
static void ssdgs__transport_task(void *data, int slot) {
    const ssdgs__transport_job *job = (const ssdgs__transport_job *)data;
    const ssdgs_frame *frame = job->tree.frame;
    ssdgs_real x[3 * SSDGS__BLOCK];
    for (int block = ssdgs__slot_begin(job->blocks, slot); block < ssdgs__slot_begin(job->blocks, slot + 1);
         block++) {
        const ssdgs_placed *o = ssdgs__object_of(frame, block * SSDGS__BLOCK);
        const ssdgs_model_view *g = &o->gaussians;
        const int first = block * SSDGS__BLOCK - o->first;
        int seen = 0;
        if (!job->tree.trees[o - frame->objects].leaves) continue;
        for (int s = 0; s < SSDGS__BLOCK; s++) { /* the last one fills the block up */
            const int at = first + s < g->count ? first + s : g->count - 1;
            for (int k = 0; k < 3; k++) {
                const ssdgs_real to = g->gaussians[(size_t)(SSDGS_POSITION + k) * g->stride + (size_t)at];
                x[k * SSDGS__BLOCK + s] = ssdgs__finite(to) ? to : 0; /* not drawn; its neighbours are */
            }
            seen |= (frame->seen[o->first + at] == SSDGS_SEEN) << s / 16;
        }
        for (int light = 0; light < frame->light_count; light++) {
            const size_t at = (size_t)job->blocks * (size_t)light + (size_t)block;
            const int groups = !ssdgs__casts(frame->lights + light) || ssdgs__out_of_reach(frame, light, o)
                                   ? 0
                                   : seen & ~job->known[at];
            if (!groups) continue;
            ssdgs_real sums[SSDGS__LENGTHS * SSDGS__BLOCK];
            ssdgs__transport_block(job, job->tree.trees + (o - frame->objects), light, slot, x, groups, sums);
            for (int k = 0; k < SSDGS__LENGTHS; k++)
                for (int s = 0; s < SSDGS__BLOCK; s++)
                    if (groups >> s / 16 & 1)
                        job->sums[(at * SSDGS__LENGTHS + (size_t)k) * SSDGS__BLOCK + (size_t)s] =
                            sums[k * SSDGS__BLOCK + s];
            job->known[at] = (unsigned char)(job->known[at] | groups);
        }
    }
}

/* Transport to what is to be shaded: (lights, blocks, SSDGS__LENGTHS, SSDGS__BLOCK). */
static ssdgs_result ssdgs__transport(ssdgs_frame *frame, const ssdgs_real **sums) {
    ssdgs_context *context = frame->context;
    ssdgs__light_memory *lights = ssdgs__light_memories(frame);
    ssdgs__transport_job job;
    job.blocks = (frame->count + SSDGS__BLOCK - 1) / SSDGS__BLOCK;
    const size_t blocks = (size_t)job.blocks * (size_t)frame->light_count;
    SSDGS__RESERVE(frame->scratch->sources, job.sources, ssdgs_real,
                   (size_t)SSDGS__SOURCES * 9 * SSDGS__SLOTS);
    SSDGS__RESERVE(frame->memory->transport, job.sums, ssdgs_real,
                   blocks * SSDGS__LENGTHS * SSDGS__BLOCK + 1);
    SSDGS__RESERVE(frame->memory->transport_known, job.known, unsigned char, blocks + 1);
    uint64_t common = SSDGS__FOLD_START; /* to the keys of all lights */
    SSDGS__FOLD(common, frame->options.transport_detail);
    SSDGS__FOLD(common, frame->light_count); /* the nodes' places */
    for (const ssdgs_placed *o = frame->objects; o < frame->objects + frame->object_count; o++) {
        const int has = ssdgs__has_transport(o);
        SSDGS__FOLD(common, has);
        SSDGS__FOLD(common, o->gaussians.count);
        SSDGS__FOLD(common, o->translucency);
    }
    for (int i = 0; i < frame->light_count; i++) {
        const int casts = ssdgs__casts(frame->lights + i);
        uint64_t key = lights[i].key;
        SSDGS__FOLD(key, common);
        lights[i].transport_ready = key == lights[i].transport_key || !casts;
        if (key == lights[i].transport_key) continue;
        memset(job.known + (size_t)i * (size_t)job.blocks, 0, (size_t)job.blocks);
        lights[i].transport_key = casts ? key : 0;
    }
    SSDGS__TRY(ssdgs__nodes(frame, &job.tree));
    ssdgs__parallel(context, SSDGS__SLOTS, ssdgs__transport_task, &job);
    *sums = job.sums;
    return SSDGS_OK;
}

/* ==== >>shade  eqs. 3 to 13 for the Gaussians seen, in blocks ==== */

/* Reads raw parameters, visibility, cues and flux. Runs both networks. Writes color, layers or components.
   Stages SHADE and SHADE_BACKWARD. */

/* How a block's memory is laid out, in values. What the backward asks for again: the Gaussians' channels and,
   per light, the geometry, the cues and the layers' outputs. Scratch, one per slot: the networks' inputs,
   cheaper made again than kept. */
typedef struct ssdgs__block_layout {
    int scattering[SSDGS_MAX_LAYERS + 1], shadow[SSDGS_MAX_LAYERS + 1], scattering_layers, shadow_layers,
        widest;
    size_t rows, visibility, cue, transport, shadow_at, scattering_at, light_size; /* within a light's part */
    size_t gauss, lights, size;                                                    /* within the block */
    size_t inputs, common, outs, lobe, kept, harmonics;     /* scratch of both directions */
    size_t dgauss, drows, dnet, dnet2, transposed, scratch; /* and of the backward */
} ssdgs__block_layout;

/* Rows of all layers' outputs. */
static size_t ssdgs__output_rows(const int *sizes, int layers) {
    size_t rows = 0;
    for (int i = 1; i <= layers; i++) rows += (size_t)sizes[i];
    return rows;
}

static ssdgs__block_layout ssdgs__layout(const ssdgs_frame *frame, const ssdgs_placed *o) {
    ssdgs__block_layout l;
    const size_t b = SSDGS__BLOCK;
    memset(&l, 0, sizeof l);
    if (o->terms & SSDGS_SCATTERING_TERM)
        l.scattering_layers = ssdgs__network_sizes(&o->settings, 0, l.scattering);
    if (o->terms & SSDGS_SHADOW_TERM) l.shadow_layers = ssdgs__network_sizes(&o->settings, 1, l.shadow);
    for (int i = 0; i <= SSDGS_MAX_LAYERS; i++) {
        l.widest = l.scattering[i] > l.widest ? l.scattering[i] : l.widest;
        l.widest = l.shadow[i] > l.widest ? l.shadow[i] : l.widest;
    }
    l.visibility = SSDGS__ROWS * b;
    l.cue = l.visibility + b;
    l.transport = l.cue + b;
    l.shadow_at = l.transport + (o->settings.transport ? SSDGS__LENGTHS * b : 0);
    l.scattering_at = l.shadow_at + b * ssdgs__output_rows(l.shadow, l.shadow_layers);
    l.light_size = l.scattering_at + b * ssdgs__output_rows(l.scattering, l.scattering_layers);
    l.lights = b * SSDGS_CHANNELS;
    l.size = l.lights + l.light_size * (size_t)(frame->training ? frame->light_count + (o->sky_share != NULL)
                                                                : 1); /* only the backward asks again */
    l.common = b * (size_t)(l.widest + 1);
    l.outs = l.common + b * (size_t)(l.scattering[1] + l.shadow[1]);
    l.lobe = l.outs + b * SSDGS__OUTS;
    l.kept = l.lobe + b * SSDGS__LOBE;
    l.harmonics = l.kept + b * (o->kept > 0 ? 4 : 0);
    l.dgauss = l.harmonics +
               b * (o->kept > 0 ? (size_t)(o->gaussians.channels - ssdgs__kept_plane(&o->settings)) : 0);
    l.drows = l.dgauss + b * SSDGS_CHANNELS;
    l.dnet = l.drows + b * SSDGS__ROWS;
    l.dnet2 = l.dnet + b * (size_t)(l.widest + 1);
    l.transposed = l.dnet2 + b * (size_t)(l.widest + 1);
    l.scratch = l.transposed + b * (size_t)(l.widest + 32);
    return l;
}

/* Sums over lanes of dL/d(basis rows) -> raw ASG parameters. */
static void ssdgs__asg_backward(ssdgs_frame *frame, const ssdgs_real *dbasis) {
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&frame->settings, first);
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        const ssdgs_real *d = dbasis + 12 * j, *sharpness = frame->gaussians.asg_sharpness + 2 * j;
        ssdgs_real q[4], r[9], dr[9],
            inverse = ssdgs__rotation_scalar(frame->gaussians.asg_basis + 4 * j, q, r);
        ssdgs_real *out = frame->global_gradient + first[SSDGS__ASG_SHARPNESS] + 2 * j;
        for (int i = 0; i < 9; i++) dr[i % 3 * 3 + i / 3] = d[i];
        ssdgs__rotation_backward_scalar(frame->global_gradient + 4 * j, q, inverse, dr);
        for (int i = 0; i < 2; i++) out[i] = d[9 + i] * ssdgs__exp_scalar(sharpness[i]);
    }
}

/* Lists of rows for dense products: all of them, and those that live. */
typedef struct ssdgs__row_lists {
    uint16_t all[SSDGS_MAX_WIDTH], in[SSDGS_MAX_WIDTH], out[SSDGS_MAX_WIDTH];
    uint64_t multiplied, multipliable; /* per Gaussian of a block: done, and of all neurons */
    uint64_t shadows_cached;
} ssdgs__row_lists;

static void ssdgs__row_lists_fill(ssdgs__row_lists *lists) {
    for (int i = 0; i < SSDGS_MAX_WIDTH; i++) lists->all[i] = (uint16_t)i;
    lists->multiplied = lists->multipliable = lists->shadows_cached = 0;
}

/* What several lights have in common of a network's first layer: its sums over the first `rows` inputs. */
typedef struct ssdgs__common {
    int rows, made;   /* made: 1: the sums are there */
    ssdgs_real *sums; /* (outputs, BLOCK) */
} ssdgs__common;

/* inputs: (size, BLOCK); outputs: every layer's, (size, BLOCK) each. The last layer has no ReLU. Neurons that
   are 0 in the whole block are left out of the sums, which changes no bit. common: NULL, or what the first
   call that has it makes. */
static void ssdgs__network_forward(const ssdgs__kernels *k, const ssdgs__network *net, ssdgs__common *common,
                                   ssdgs__row_lists *lists, const ssdgs_real *inputs, ssdgs_real *outputs) {
    const int *sizes = net->sizes, layers = net->layers;
    const ssdgs_real *weights = net->weights;
    ssdgs__product p;
    memset(&p, 0, sizeof p);
    p.row_list = lists->all;
    for (int layer = 0; layer < layers; layer++) {
        const size_t in = (size_t)sizes[layer], out = (size_t)sizes[layer + 1];
        p.a = weights;
        p.a_row = in;
        p.a_k = 1;
        p.b = inputs;
        p.bias = weights + in * out;
        p.out = outputs;
        inputs = outputs;
        outputs += out * SSDGS__BLOCK;
        p.out_stride = p.b_stride = SSDGS__BLOCK;
        p.columns = SSDGS__BLOCK;
        p.rows = sizes[layer + 1];
        p.depth = sizes[layer];
        p.depth_list = lists->all;
        p.start = NULL;
        if (!layer && common && common->rows) {
            if (!common->made) {
                p.depth = common->rows;
                p.out = common->sums;
                k->dense(&p);
                lists->multiplied += (uint64_t)common->rows * out;
                common->made = 1;
                p.out = outputs - out * SSDGS__BLOCK;
            }
            p.start = common->sums;
            p.a += common->rows;
            p.b += common->rows * SSDGS__BLOCK;
            p.depth = sizes[0] - common->rows;
        }
        p.relu = layer < layers - 1;
        if (layer) {
            p.depth = k->live_rows(p.b, sizes[layer], lists->in);
            p.depth_list = lists->in;
        }
        k->dense(&p);
        lists->multiplied += (uint64_t)p.depth * out;
        lists->multipliable += (uint64_t)in * out;
        weights += (in + 1) * out;
    }
}

/* A layer's gradient in a slot, made for adding block after block: per output, the weights' with zeros up to
   a multiple of 16, then 16 partial sums of the bias's. */
static size_t ssdgs__padded(int inputs) { return ((size_t)inputs + 15) / 16 * 16; }

static size_t ssdgs__slot_gradient_size(const int *sizes, int layers) {
    size_t size = 0;
    for (int i = 0; i < layers; i++) size += (size_t)sizes[i + 1] * (ssdgs__padded(sizes[i]) + 16);
    return size;
}

/* The slots' gradients of a network, stride apart, summed up in the order of its parameters: each row with
   number % parts == part. */
static void ssdgs__sum_slots(const int *sizes, int layers, const ssdgs_real *slots, size_t stride, int count,
                             int part, int parts, ssdgs_real *gradient) {
    for (int layer = 0; layer < layers; layer++) {
        const size_t in = (size_t)sizes[layer], out = (size_t)sizes[layer + 1],
                     padded = ssdgs__padded(sizes[layer]);
        for (int row = part; row < sizes[layer + 1]; row += parts) {
            const ssdgs_real *from = slots + (size_t)row * (padded + 16);
            ssdgs_real *to = gradient + (size_t)row * in, bias = 0;
            for (int slot = 0; slot < count; slot++, from += stride) {
                for (size_t i = 0; i < in; i++) to[i] = slot ? to[i] + from[i] : from[i];
                for (int lane = 0; lane < 16; lane++) bias += from[padded + (size_t)lane];
            }
            gradient[in * out + (size_t)row] = bias;
        }
        slots += out * (padded + 16);
        gradient += (in + 1) * out;
    }
}

typedef struct ssdgs__network_scratch {
    ssdgs_real *d, *spare;  /* (rows of the widest layer and one, BLOCK) each */
    ssdgs_real *transposed; /* (BLOCK, inputs of the widest layer and 32) */
} ssdgs__network_scratch;

/* d holds dL/d(outputs) and ends as dL/d(inputs), the first `asked` rows of it, in d or spare: that one is
   returned. Adds to the slot's gradient unless that is NULL. Neurons that are 0 in the whole block have no
   part in it. */
static ssdgs_real *ssdgs__network_backward(const ssdgs__kernels *k, const ssdgs__network *net,
                                           const ssdgs_real *inputs, const ssdgs_real *outputs,
                                           const ssdgs__network_scratch *scratch, ssdgs__row_lists *lists,
                                           int asked, ssdgs_real *slot_gradient) {
    const int *sizes = net->sizes, layers = net->layers;
    const ssdgs_real *weights = net->weights;
    ssdgs_real *d = scratch->d, *spare = scratch->spare, *transposed = scratch->transposed;
    const ssdgs_real *layer_in = layers > 1 ? outputs : inputs;
    int live_out = sizes[layers];
    const uint16_t *outs = lists->all;
    for (int layer = 0; layer < layers; layer++) {
        if (layer && layer < layers - 1) layer_in += (size_t)sizes[layer] * SSDGS__BLOCK;
        weights += (size_t)(sizes[layer] + 1) * (size_t)sizes[layer + 1];
    }
    if (slot_gradient) slot_gradient += ssdgs__slot_gradient_size(sizes, layers);
    for (int layer = layers - 1; layer >= 0; layer--) {
        const size_t in = (size_t)sizes[layer], out = (size_t)sizes[layer + 1],
                     padded = ssdgs__padded(sizes[layer]);
        uint16_t *list = outs == lists->in ? lists->out : lists->in;
        const int live_in = layer ? k->live_rows(layer_in, sizes[layer], list) : asked;
        ssdgs_real *swap = d;
        ssdgs__product p;
        memset(&p, 0, sizeof p);
        weights -= (in + 1) * out;
        if (slot_gradient) {
            slot_gradient -= out * (padded + 16);
            k->transpose(layer_in, sizes[layer], padded, padded + 16, transposed);
            p.out = slot_gradient; /* dW += d x^T */
            p.out_stride = padded + 16;
            p.a = d;
            p.a_row = SSDGS__BLOCK;
            p.a_k = 1;
            p.b = transposed;
            p.b_stride = padded + 16; /* multiples of 256 would share a few cache sets */
            p.rows = live_out;
            p.row_list = outs;
            p.columns = (int)padded;
            p.depth = SSDGS__BLOCK;
            p.depth_list = lists->all;
            p.accumulate = 1;
            k->dense(&p);
            k->row_sums(slot_gradient + padded, padded + 16, d, outs, live_out);
        }
        p.out = spare; /* dx = W^T d */
        p.out_stride = p.b_stride = SSDGS__BLOCK;
        p.columns = SSDGS__BLOCK;
        p.a = weights;
        p.a_row = 1;
        p.a_k = in;
        p.b = d;
        p.rows = live_in;
        p.row_list = layer ? list : lists->all;
        p.depth = live_out;
        p.depth_list = outs;
        p.accumulate = 0;
        p.mask = layer ? layer_in : NULL;
        k->dense(&p);
        if (layer) layer_in = layer > 1 ? layer_in - (size_t)sizes[layer - 1] * SSDGS__BLOCK : inputs;
        live_out = live_in;
        outs = list;
        d = spare;
        spare = swap;
    }
    return d;
}

/* The networks' inputs and their encodings, in the order of their rows. */
typedef struct ssdgs__input {
    int row, dims, levels; /* levels < 0: copied */
    ssdgs_real scale;
    size_t from; /* in the light's part, or for the Gaussian's own rows in gauss */
    int of_gaussian;
} ssdgs__input;

static int ssdgs__inputs(const ssdgs_settings *s, const ssdgs__block_layout *l, int shadow,
                         ssdgs__input inputs[7]) {
    const size_t b = SSDGS__BLOCK;
    const int scaled = shadow ? s->residual_shadow : s->depth_cue || s->transport;
    const ssdgs_real inverse_unit = 1 / s->length_unit;
    int n = 0, row = 0;
#define SSDGS__INPUT(width, depth, factor, place, own) \
    do { \
        inputs[n].row = row, inputs[n].dims = (width), inputs[n].levels = (depth), \
        inputs[n].scale = (factor); \
        inputs[n].from = (place), inputs[n++].of_gaussian = (own), \
        row += (width) * ((depth) < 0 ? 1 : 1 + 2 * (depth)); \
    } while (0)
    SSDGS__INPUT(3, shadow ? 3 : 4, scaled ? inverse_unit : 1, b * SSDGS_POSITION, 1);
    if (!shadow) SSDGS__INPUT(3, s->octaves.view, 1, b * SSDGS__WO, 0);
    SSDGS__INPUT(3, shadow ? 3 : s->octaves.light, 1, b * SSDGS__WI, 0);
    if (shadow) SSDGS__INPUT(1, -1, 1, l->visibility, 0);
    else SSDGS__INPUT(3, -1, 1, b * SSDGS__NORMAL, 0);
    SSDGS__INPUT(SSDGS_MATERIAL_COUNT, -1, 1, b * SSDGS_MATERIAL, 1);
    if (!shadow && s->depth_cue) SSDGS__INPUT(1, 4, inverse_unit, l->cue, 0);
    if (!shadow && s->transport) SSDGS__INPUT(SSDGS__LENGTHS, -1, 1, l->transport, 0);
#undef SSDGS__INPUT
    SSDGS_ASSERT(row == (shadow ? l->shadow : l->scattering)[0]);
    return n;
}

/* The rows of the first `count` of a network's inputs. */
static int ssdgs__input_rows(const ssdgs_settings *s, const ssdgs__block_layout *l, int shadow, int count) {
    ssdgs__input in[7];
    const int n = ssdgs__inputs(s, l, shadow, in);
    return n > count ? in[count].row : (shadow ? l->shadow : l->scattering)[0];
}

/* All, or those whose sums are not in `common`. */
static void ssdgs__encode_inputs(const ssdgs__kernels *k, const ssdgs_settings *settings,
                                 const ssdgs__block_layout *l, int shadow, const ssdgs__common *common,
                                 const ssdgs_real *gauss, const ssdgs_real *part, ssdgs_real *activations) {
    ssdgs__input in[7];
    const int n = ssdgs__inputs(settings, l, shadow, in);
    for (int i = 0; i < n; i++) {
        if (common && common->made && in[i].row < common->rows) continue;
        const ssdgs_real *from = (in[i].of_gaussian ? gauss : part) + in[i].from;
        ssdgs_real *to = activations + (size_t)in[i].row * SSDGS__BLOCK;
        const int centred = in[i].of_gaussian && in[i].levels >= 0;
        if (in[i].levels < 0) memcpy(to, from, (size_t)in[i].dims * SSDGS__BLOCK * sizeof *to);
        else k->encode(to, from, centred ? settings->centre : NULL, in[i].scale, in[i].dims, in[i].levels);
    }
}

/* Gradients of the inputs go to dgauss, to drows (geometry) and to dvisibility; the light pass's cues are
   held fixed. */
static void ssdgs__encode_inputs_backward(const ssdgs__kernels *k, const ssdgs_settings *s,
                                          const ssdgs__block_layout *l, int shadow,
                                          const ssdgs_real *activations, const ssdgs_real *dinputs,
                                          ssdgs_real *dgauss, ssdgs_real *drows, ssdgs_real *dvisibility) {
    ssdgs__input in[7];
    const int n = ssdgs__inputs(s, l, shadow, in);
    for (int i = 0; i < n; i++) {
        const size_t row = (size_t)in[i].row * SSDGS__BLOCK;
        ssdgs_real *to = in[i].of_gaussian             ? dgauss + in[i].from
                         : in[i].from == l->visibility ? dvisibility
                                                       : drows + in[i].from;
        if (!in[i].of_gaussian && in[i].from >= l->cue) continue;
        if (in[i].levels >= 0)
            k->encode_backward(to, dinputs + row, activations + row, in[i].scale, in[i].dims, in[i].levels);
        else
            for (int at = 0; at < in[i].dims * SSDGS__BLOCK; at++) to[at] += dinputs[row + (size_t)at];
    }
}

/* Gaussians shaded together: shaded[first] and those behind it, of one object. */
typedef struct ssdgs__shade_block {
    const ssdgs_placed *object;
    int first, live;
} ssdgs__shade_block;

typedef struct ssdgs__shade_job {
    ssdgs_frame *frame;
    const ssdgs__block_layout *layouts; /* (objects) */
    ssdgs__shade_block *block;
    int blocks;
    size_t size, scratch_size;       /* of a block, and of a slot's scratch, for any object */
    size_t slot_stride, slot_shadow; /* slots: the scattering network's gradient, then the shadow network's */
    ssdgs_real *shadow_logit; /* (lights, n) outputs of the shadow network kept for lights at rest, or NULL */
    unsigned char *shadow_known; /* (lights, n) which of them */
    uint64_t *counts;            /* per slot: multiplications done, those of all neurons, shadows kept */
    const ssdgs_real *transport; /* of ssdgs__transport_job, or NULL */
    ssdgs_real *activations, *scratch, *slots, *lane_slots;
} ssdgs__shade_job;

/* The Gaussian in lane s of a block; the last one fills the block up. */
static size_t ssdgs__block_lane(const ssdgs__shade_job *job, int block, int s) {
    const ssdgs__shade_block *b = job->block + block;
    return job->frame->shaded[b->first + (s < b->live ? s : b->live - 1)];
}

/* Which fours of a block's lanes come from four places in a row, as bits: most do. */
static unsigned ssdgs__fours(const size_t from[SSDGS__BLOCK]) {
    unsigned fours = 0;
    for (int s = 0; s < SSDGS__BLOCK; s += 4)
        fours |=
            (unsigned)(from[s + 1] == from[s] + 1 && from[s + 2] == from[s] + 2 && from[s + 3] == from[s] + 3)
            << s / 4;
    return fours;
}

/* A plane's values at a block's lanes. */
static void ssdgs__gather(const ssdgs_real *plane, const size_t from[SSDGS__BLOCK], unsigned fours,
                          ssdgs_real *row) {
    for (int s = 0; s < SSDGS__BLOCK; s += 4, fours >>= 1)
        if (fours & 1) memcpy(row + s, plane + from[s], 4 * sizeof *row);
        else
            for (int i = s; i < s + 4; i++) row[i] = plane[from[i]];
}

/* The shadow network's outputs for the Gaussians of a block, if all of them are known; it does not see the
   camera. */
static int ssdgs__shadow_recall(const ssdgs__shade_job *job, int light, const size_t at[SSDGS__BLOCK],
                                ssdgs_real *shadow) {
    const size_t first = (size_t)job->frame->count * (size_t)light;
    if (!job->shadow_known) return 0;
    for (int s = 0; s < SSDGS__BLOCK; s++)
        if (!job->shadow_known[first + at[s]]) return 0;
    for (int s = 0; s < SSDGS__BLOCK; s++) shadow[s] = job->shadow_logit[first + at[s]];
    return 1;
}

static void ssdgs__shadow_keep(const ssdgs__shade_job *job, int light, const size_t at[SSDGS__BLOCK],
                               const ssdgs_real *shadow) {
    const size_t first = (size_t)job->frame->count * (size_t)light;
    if (!job->shadow_known) return;
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        job->shadow_known[first + at[s]] = 1;
        job->shadow_logit[first + at[s]] = shadow[s];
    }
}

static ssdgs_real *ssdgs__layer(const ssdgs_frame *frame, int layer) {
    return layer ? frame->layers + (size_t)(layer - 1) * 4 * (size_t)frame->count : frame->color;
}

/* Rows of a block into a layer. */
static void ssdgs__layer_store(const ssdgs_frame *frame, int layer, const size_t at[SSDGS__BLOCK], int live,
                               const ssdgs_real *rows) {
    ssdgs_real *to = ssdgs__layer(frame, layer);
    for (int s = 0; s < live; s++)
        for (int c = 0; c < 3; c++) to[4 * at[s] + (size_t)c] = rows[c * SSDGS__BLOCK + s];
}

/* Q's rows and the normal, from the object's space to the world. */
static void ssdgs__lobe_turn(const ssdgs_placed *o, ssdgs_real *lobe) {
    static const int at[9] = {0, 3, 5, 3, 1, 4, 5, 4, 2}; /* rows xx, yy, zz, xy, yz, zx */
    for (int s = 0; s < SSDGS__BLOCK; s++, lobe++) {
        ssdgs_real q[9], n[3];
        for (int i = 0; i < 9; i++) q[i] = lobe[at[i] * SSDGS__BLOCK];
        for (int i = 0; i < 3; i++) ssdgs__turn(o, 0, q + 3 * i, q + 3 * i); /* Q R' */
        for (int i = 0; i < 3; i++) {
            const ssdgs_real column[3] = {q[i], q[3 + i], q[6 + i]};
            ssdgs_real turned[3];
            ssdgs__turn(o, 0, column, turned);
            for (int c = 0; c <= i; c++) lobe[at[3 * c + i] * SSDGS__BLOCK] = turned[c];
            n[i] = lobe[(SSDGS__LOBE_NORMAL + i) * SSDGS__BLOCK];
        }
        ssdgs__turn(o, 0, n, n);
        for (int i = 0; i < 3; i++) lobe[(SSDGS__LOBE_NORMAL + i) * SSDGS__BLOCK] = n[i];
    }
}

/* What of a light's irradiance its range, its cone, as in glTF's KHR_lights_punctual, and its focus leave. */
typedef struct ssdgs__reaching {
    double direction[3], range2, outer, width, focus; /* 1 / range^2; the outer cosine, the inner's less it */
} ssdgs__reaching;

static ssdgs__reaching ssdgs__reaching_of(const ssdgs_light *light, const ssdgs_real direction[3],
                                          double scale) {
    const double inverse_range = light->range > 0 ? scale / (double)light->range : 0;
    ssdgs__reaching r;
    double length2 = 0; /* 1, to a thousandth */
    for (int c = 0; c < 3; c++) length2 += (double)direction[c] * (double)direction[c];
    const double unit = 1 / sqrt(length2);
    for (int c = 0; c < 3; c++) r.direction[c] = ssdgs__aimed(light) ? (double)direction[c] * unit : 0;
    r.range2 = inverse_range * inverse_range;
    const double inner = (double)light->cone[0], outer = (double)light->cone[1];
    r.outer = light->kind == SSDGS_LIGHT_SPOT ? cos(outer) : 0;
    r.width = light->kind == SSDGS_LIGHT_SPOT ? 2 * sin((inner + outer) / 2) * sin((outer - inner) / 2)
                                              : 0; /* 0: no cone; cosines of narrow ones are both 1 */
    r.focus = (double)light->focus;
    return r;
}

/* What is left at d, from the light. slope: its gradient. */
static double ssdgs__reach_at(const ssdgs__reaching *r, const double d[3], double slope[3]) {
    const double distance2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2],
                 distance = sqrt(distance2 > 1e-60 ? distance2 : 1e-60), way2 = distance2 * r->range2,
                 left = way2 < 1 ? 1 - way2 * way2 : 0,
                 cosine =
                     (d[0] * r->direction[0] + d[1] * r->direction[1] + d[2] * r->direction[2]) / distance;
    double cone = 1, fade = 1, by_cosine[2] = {0, 0}; /* how they change with the cosine */
    if (r->width > 0) {
        const double t = (cosine - r->outer) / r->width;
        cone = t > 1 ? 1 : t > 0 ? t * t : 0;
        by_cosine[0] = t > 0 && t < 1 ? 2 * t / r->width : 0;
    }
    if (r->focus > 0) { /* below 1 it is endlessly steep at its edge */
        fade = cosine > 0 ? pow(cosine, r->focus) : 0;
        by_cosine[1] = r->focus * fade / (cosine > 1e-3 ? cosine : 1e-3);
    }
    const double steep = left * (by_cosine[0] * fade + cone * by_cosine[1]) / distance,
                 nearer = left > 0 ? cone * fade * 4 * way2 * r->range2 : 0;
    for (int c = 0; c < 3; c++)
        slope[c] = steep * (r->direction[c] - cosine * d[c] / distance) - nearer * d[c];
    return cone * fade * left;
}

/* The same for the Gaussians of a block. slope: (3, BLOCK) its gradient to their positions, times 1 / their
   distance^2; or NULL. Returns 0 where nothing comes to any. */
static int ssdgs__reach_row(const ssdgs_frame *frame, const ssdgs_placed *o, int index,
                            const ssdgs_real *gauss, ssdgs_real *reach, ssdgs_real *slope) {
    const ssdgs_light *light = frame->lights + index;
    const ssdgs__lighting *k = ssdgs__lightings(frame, o) + index;
    int any = 0;
    ssdgs_real direction[3];
    ssdgs__turn(o, 1, light->direction, direction);
    const ssdgs__reaching reaching = ssdgs__reaching_of(light, direction, (double)o->scale);
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        double d[3], by[3], distance2 = 0;
        for (int c = 0; c < 3; c++) {
            d[c] = (double)gauss[(SSDGS_POSITION + c) * SSDGS__BLOCK + s] - (double)k->light[c];
            distance2 += d[c] * d[c];
        }
        if (distance2 < (double)k->least_distance2) distance2 = (double)k->least_distance2;
        reach[s] = (ssdgs_real)ssdgs__reach_at(&reaching, d, by);
        for (int c = 0; slope && c < 3; c++) slope[c * SSDGS__BLOCK + s] = (ssdgs_real)(by[c] / distance2);
        any |= reach[s] > 0;
    }
    return any;
}

SSDGS__SMALL_BEGIN

/* What a lobe e^(-x u), u = 1 - (n.h)^2, sends to an eye along n of a sky of radiance 1, over 4 pi. As dwi is
   4 pi du, that is the integral of e^(-x u) to u = 1/2, where n.wi ends. Deferred, the lobe is multiplied by
   n.wi / (wo.h)^2 = (1 - 2 u) / (1 - u); what 1 / (1 - u) adds is right to 1.5 %. */
static ssdgs_real ssdgs__lobe_share(ssdgs_real x, int deferred) {
    const int even = x < (ssdgs_real)0.03;
    const ssdgs_real share = even ? (ssdgs_real)0.5 - x / 8 : (1 - ssdgs__exp_scalar(-x / 2)) / x;
    if (!deferred) return share;
    return (even ? (ssdgs_real)0.25 - x / 24 : (1 - 2 * share) / x) *
           (1 + 1 / ((ssdgs_real)4.4 + (ssdgs_real)0.75 * x));
}

/* Of Gaussian s of a block, were its lobes that much narrower: how much light its highlight sends back of a
   sky of radiance 1, with c_s and Fresnel's F both 1. */
static ssdgs_real ssdgs__lobe_energy(const ssdgs__lighting *k, const ssdgs_real *gauss, int s,
                                     ssdgs_real narrower) {
    ssdgs_real sum = 0;
    const ssdgs_real *raw = gauss + SSDGS_ASG_WEIGHT * SSDGS__BLOCK + s;
    narrower *= k->deferred ? ssdgs__lobe_height(raw, SSDGS__BLOCK) : 1;
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        const ssdgs_real *b = k->basis + 12 * j;
        sum += k->deferred ? b[10] * ssdgs__lobe_share(b[9] * narrower, 1)
                           : ssdgs__softplus_scalar(raw[j * SSDGS__BLOCK]) *
                                 ssdgs__lobe_share(SSDGS__SQRT(b[9] * b[10]) * narrower, 0);
    }
    return (ssdgs_real)12.566370614359172 * sum * (k->deferred ? narrower : 1); /* 4 pi */
}

/* Adds to a block's scattering rows c_sss times what comes out of the medium: transport's rows are in units
   of the irradiance, rows of the geometry. */
static void ssdgs__medium_rows(const ssdgs__lighting *k, const ssdgs_real *weights, const ssdgs_real *gauss,
                               const ssdgs_real *rows, const ssdgs_real *transport, ssdgs_real *outs) {
    for (int i = 0; i < 3 * SSDGS__BLOCK; i++) {
        const int c = i / SSDGS__BLOCK, lane = i % SSDGS__BLOCK;
        ssdgs_real sum = 0;
        for (int j = 0; j < SSDGS__LENGTHS; j++)
            sum += weights[c * SSDGS__LENGTHS + j] * transport[j * SSDGS__BLOCK + lane];
        outs[SSDGS__OUT_SCATTERING * SSDGS__BLOCK + i] +=
            ssdgs__softplus_scalar(gauss[SSDGS_SCATTERING * SSDGS__BLOCK + i]) * sum *
            rows[SSDGS__IRRADIANCE * SSDGS__BLOCK + lane] * k->intensity[c] * (ssdgs_real)0.31830988618379067;
    }
}

/* The irradiance of ambient light on a surface with a normal, in the world. */
static void ssdgs__ambient_at(const ssdgs_real ambient[9][3], const ssdgs_real n[3], ssdgs_real rgb[3]) {
    const ssdgs_real x = n[0], y = n[1], z = n[2];
    const ssdgs_real term[9] = {1, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y};
    for (int c = 0; c < 3; c++) {
        ssdgs_real sum = 0;
        for (int i = 0; i < 9; i++) sum += term[i] * ambient[i][c];
        rgb[c] = sum > 0 ? sum : 0;
    }
}

/* A block's rows under ambient light of irradiance 1. Light scatters as beneath an evenly lit plane: from the
   normal, and with as much transport of any length. f_s: a highlight mirrors the irradiance around its
   direction, which is smooth. gloss_factor: what the object makes of highlights, or NULL. mirrored: those
   directions. */
static void ssdgs__ambient_rows(const ssdgs__lighting *lighting, const ssdgs__kernels *k,
                                const ssdgs_real *gauss, const ssdgs_real *gloss_factor, ssdgs_real *rows,
                                ssdgs_real mirrored[SSDGS__BLOCK][3]) {
    k->reflect(lighting, gauss, rows);
    memcpy(rows + SSDGS__WI * SSDGS__BLOCK, rows + SSDGS__NORMAL * SSDGS__BLOCK,
           3 * SSDGS__BLOCK * sizeof *rows);
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        const ssdgs_real *n = rows + SSDGS__NORMAL * SSDGS__BLOCK + s,
                         *wo = rows + SSDGS__WO * SSDGS__BLOCK + s;
        const ssdgs_real facing =
            n[0] * wo[0] + n[SSDGS__BLOCK] * wo[SSDGS__BLOCK] + n[2 * SSDGS__BLOCK] * wo[2 * SSDGS__BLOCK];
        for (int c = 0; c < 3; c++) mirrored[s][c] = 2 * facing * n[c * SSDGS__BLOCK] - wo[c * SSDGS__BLOCK];
        const ssdgs_real cosine = facing > 0 ? facing < 1 ? facing : 1 : 0, missing = 1 - cosine;
        const ssdgs_real steep = cosine < SSDGS__GRAZING ? cosine / SSDGS__GRAZING : 1;
        const ssdgs_real f0 = lighting->deferred
                                  ? ssdgs__sigmoid_scalar(gauss[(SSDGS_ASG_WEIGHT + 2) * SSDGS__BLOCK + s] +
                                                          (ssdgs_real)SSDGS__F0_LOGIT)
                                  : (ssdgs_real)SSDGS__F0;
        const ssdgs_real fresnel = f0 + (1 - f0) * missing * missing * missing * missing * missing;
        ssdgs_real gloss = lighting->specular ? fresnel * ssdgs__lobe_energy(lighting, gauss, s, 1) : 0;
        gloss *= (lighting->deferred ? steep * steep : cosine) * (gloss_factor ? gloss_factor[s] : 1);
        rows[SSDGS__GLOSS * SSDGS__BLOCK + s] = gloss * (ssdgs_real)0.31830988618379067;
        rows[SSDGS__COSINE * SSDGS__BLOCK + s] = 1;
    }
}

/* Adds to a block's scattering rows what ambient light brings. */
static void ssdgs__shade_ambient(const ssdgs_frame *frame, const ssdgs_placed *o,
                                 const ssdgs__block_layout *l, ssdgs__row_lists *lists,
                                 const size_t at[SSDGS__BLOCK], const ssdgs_real *gloss_factor,
                                 ssdgs_real *memory, ssdgs_real *scratch) {
    const ssdgs__kernels *k = frame->context->k;
    const ssdgs__lighting *lighting = ssdgs__lightings(frame, o) + frame->light_count;
    const ssdgs_real *gauss = memory + l->gauss, *optics = NULL;
    ssdgs_real *part =
        memory + l->lights + l->light_size * (size_t)(frame->training ? frame->light_count : 0);
    ssdgs_real *rows = part + l->rows, *outs = scratch + l->outs;
    ssdgs_real own[SSDGS__OUTS * SSDGS__BLOCK], mirrored[SSDGS__BLOCK][3];
    memset(own, 0, sizeof own);
    ssdgs__ambient_rows(lighting, k, gauss, gloss_factor, rows, mirrored);
    for (size_t s = 0; s < SSDGS__BLOCK; s++) {
        rows[SSDGS__IRRADIANCE * SSDGS__BLOCK + s] = o->sky_share[at[s] - (size_t)o->first];
        part[l->visibility + s] = 1;
        part[l->cue + s] = 0;
    }
    for (int i = 0; o->settings.transport && i < SSDGS__LENGTHS; i++) {
        const ssdgs_real even = (ssdgs_real)ssdgs__beneath_plane(i);
        for (size_t s = 0; s < SSDGS__BLOCK; s++) part[l->transport + (size_t)i * SSDGS__BLOCK + s] = even;
    }
    if (l->scattering_layers) {
        const ssdgs__network net = {l->scattering, l->scattering_layers, o->gaussians.scattering};
        ssdgs__encode_inputs(k, &o->settings, l, 0, NULL, gauss, part, scratch + l->inputs);
        ssdgs__network_forward(k, &net, NULL, lists, scratch + l->inputs, part + l->scattering_at);
        optics = part + l->light_size - (size_t)l->scattering[l->scattering_layers] * SSDGS__BLOCK;
    }
    const ssdgs__colour_in in = {gauss, rows, part + l->visibility, NULL, optics, NULL};
    k->colour(lighting, &in, own);
    if (ssdgs__has_medium(&o->settings, o->terms))
        ssdgs__medium_rows(lighting, o->medium, gauss, rows, part + l->transport, own);
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        ssdgs_real n[3], light[3], shine[3];
        for (int c = 0; c < 3; c++) n[c] = rows[(SSDGS__NORMAL + c) * SSDGS__BLOCK + s];
        if (o->turned) {
            ssdgs__turn(o, 0, n, n);
            ssdgs__turn(o, 0, mirrored[s], mirrored[s]);
        }
        ssdgs__ambient_at(frame->options.ambient, n, light);
        ssdgs__ambient_at(frame->options.ambient, mirrored[s], shine);
        for (int c = 0; c < 3; c++) {
            const ssdgs_real *to = own + c * SSDGS__BLOCK + s;
            outs[(SSDGS__OUT_SCATTERING + c) * SSDGS__BLOCK + s] +=
                light[c] * (to[0] + to[SSDGS__OUT_SCATTERING * SSDGS__BLOCK]) +
                shine[c] * to[SSDGS__OUT_SPECULAR * SSDGS__BLOCK];
        }
    }
}

/* Finds how an object differs from its model: rows of factors of the colours and, last, of the highlights.
   Changes the sharpness of deferred lobes. 0: it does not differ. */
static int ssdgs__object_factors(const ssdgs_frame *frame, const ssdgs_placed *o,
                                 const size_t at[SSDGS__BLOCK], ssdgs_real *gauss,
                                 ssdgs_real factors[4 * SSDGS__BLOCK]) {
    const ssdgs__lighting *k = ssdgs__lightings(frame, o) + frame->light_count;
    const int rougher = (o->terms & SSDGS_SPECULAR_TERM) && (o->roughness < 1 || o->roughness > 1);
    int edited = rougher || o->specular < 1 || o->specular > 1;
    for (int c = 0; c < 3; c++) edited |= o->tint[c] < 1 || o->tint[c] > 1;
    for (int s = 0; s < SSDGS__BLOCK && edited; s++) {
        const ssdgs_real share = o->mask ? (ssdgs_real)o->mask[at[s] - (size_t)o->first] / 255 : 1;
        const ssdgs_real wider = k->deferred ? 1 + share * (o->roughness - 1) : o->roughness;
        ssdgs_real *raw = gauss + SSDGS_ASG_WEIGHT * SSDGS__BLOCK + s;
        for (int c = 0; c < 3; c++) factors[c * SSDGS__BLOCK + s] = 1 + share * (o->tint[c] - 1);
        factors[3 * SSDGS__BLOCK + s] = 1 + share * (o->specular - 1);
        if (!rougher) continue;
        factors[3 * SSDGS__BLOCK + s] *=
            k->deferred
                ? ssdgs__lobe_energy(k, gauss, s, 1) / ssdgs__lobe_energy(k, gauss, s, 1 / (wider * wider))
                : ssdgs__lobe_energy(k, gauss, s, wider * wider) / ssdgs__lobe_energy(k, gauss, s, 1);
        for (int i = 0; i < 2 && k->deferred; i++)
            raw[i * SSDGS__BLOCK] -= 2 * (ssdgs_real)log((double)wider);
    }
    return edited;
}

/* Multiplies the first so many rows of a block's outs by what ssdgs__object_factors() found. */
static void ssdgs__edit_rows(const ssdgs_real *factors, int rows, ssdgs_real *outs) {
    for (int i = 0; i < rows * SSDGS__BLOCK; i++) {
        const int row = i / SSDGS__BLOCK, s = i % SSDGS__BLOCK;
        outs[i] *= factors[row % 3 * SSDGS__BLOCK + s] *
                   (row / 3 * 3 == SSDGS__OUT_SPECULAR ? factors[3 * SSDGS__BLOCK + s] : 1);
    }
}

SSDGS__SMALL_END

/* The colours that no light makes, as they are seen from the eye: stored values, decoded where the frame
   blends linear light, unless a baked model has linear ones. */
static void ssdgs__kept(const ssdgs_frame *frame, const ssdgs_placed *o, const size_t own[SSDGS__BLOCK],
                        unsigned fours, const ssdgs_real *position, ssdgs_real *rows, ssdgs_real *kept) {
    const ssdgs__kernels *k = frame->context->k;
    const int first = ssdgs__kept_plane(&o->settings);
    for (int c = first; c < o->gaussians.channels; c++) {
        const ssdgs_real *plane = o->gaussians.gaussians + (size_t)c * o->gaussians.stride;
        ssdgs__gather(plane, own, fours, rows + (c - first) * SSDGS__BLOCK);
    }
    k->harmonics(position, rows, o->settings.harmonics, ssdgs__lightings(frame, o)->eye, kept);
    if (frame->settings.transfer == SSDGS_TRANSFER_SRGB &&
        !(o->settings.baked && o->settings.transfer == SSDGS_TRANSFER_SRGB))
        k->srgb_decode(kept, kept, 3 * SSDGS__BLOCK);
    for (int i = 0; i < 3 * SSDGS__BLOCK; i++) kept[i] *= o->kept;
}

static void ssdgs__shade_block_of(const ssdgs__shade_job *job, int block, ssdgs__row_lists *lists,
                                  ssdgs_real *memory, ssdgs_real *scratch) {
    const ssdgs_frame *frame = job->frame;
    const ssdgs_placed *o = job->block[block].object;
    const ssdgs_settings *settings = &o->settings;
    const ssdgs__block_layout *l = job->layouts + (o - frame->objects);
    const ssdgs__kernels *k = frame->context->k;
    const size_t n = (size_t)frame->count, blocks = (n + SSDGS__BLOCK - 1) / SSDGS__BLOCK;
    ssdgs_real *gauss = memory + l->gauss, *outs = scratch + l->outs, *inputs = scratch + l->inputs;
    const int live = job->block[block].live;
    size_t at[SSDGS__BLOCK], own[SSDGS__BLOCK], sums[SSDGS__BLOCK]; /* in the frame, the object, transport */
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        at[s] = ssdgs__block_lane(job, block, s);
        own[s] = at[s] - (size_t)o->first;
        sums[s] = at[s] / SSDGS__BLOCK * SSDGS__LENGTHS * SSDGS__BLOCK + at[s] % SSDGS__BLOCK;
    }
    const unsigned fours = ssdgs__fours(at), sums_fours = ssdgs__fours(sums);
    const ssdgs_real most = (ssdgs_real)1e30; /* of a layer's values: products with lobes must be finite */
    int sound = 1;                            /* they are all within it: no need to look at each */
    const int bare = settings->baked && !o->light_count && !frame->layer_count &&
                     !frame->diffuse; /* needs a colour alone */
    for (int i = 0; i < (bare ? SSDGS_ROTATION : SSDGS_CHANNELS); i++) {
        ssdgs_real *row = gauss + i * SSDGS__BLOCK;
        const int neutral = settings->baked && i >= SSDGS_ROTATION;
        if (!neutral)
            ssdgs__gather(o->gaussians.gaussians + (size_t)i * o->gaussians.stride, own, fours, row);
        for (int s = 0; neutral && s < SSDGS__BLOCK; s++) row[s] = ssdgs__neutral(i);
    }
    memset(outs, 0, SSDGS__OUTS * SSDGS__BLOCK * sizeof *outs);
    ssdgs_real factors[4 * SSDGS__BLOCK], rest[SSDGS__BLOCK], *kept = scratch + l->kept;
    const int edited = ssdgs__object_factors(frame, o, at, gauss, factors);
    if (o->kept > 0) ssdgs__kept(frame, o, own, fours, gauss, scratch + l->harmonics, kept);
    for (int s = 0; s < SSDGS__BLOCK; s++) rest[s] = 1; /* what of it no light takes for its own */
    const int medium = ssdgs__has_medium(settings, o->terms);
    if (frame->layer_count) k->lobe(gauss, scratch + l->lobe);
    if (frame->layer_count && o->turned) ssdgs__lobe_turn(o, scratch + l->lobe);
    if (frame->layer_count) sound = k->within(scratch + l->lobe, SSDGS__LOBE * SSDGS__BLOCK, most);
    const ssdgs__network scattering_net = {l->scattering, l->scattering_layers, o->gaussians.scattering};
    const ssdgs__network shadow_net = {l->shadow, l->shadow_layers, o->gaussians.shadow};
    /* several lights have in common the Gaussian's place and, but for the shadow network, where it is seen
     * from */
    ssdgs__common common[2] = {{0, 0, scratch + l->common},
                               {0, 0, scratch + l->common + l->scattering[1] * SSDGS__BLOCK}};
    if (frame->light_count > 1 && l->scattering_layers) common[0].rows = ssdgs__input_rows(settings, l, 0, 2);
    if (frame->light_count > 1 && l->shadow_layers) common[1].rows = ssdgs__input_rows(settings, l, 1, 1);
    for (int light = 0; light < frame->light_count; light++) {
        const ssdgs__lighting *lighting = ssdgs__lightings(frame, o) + light;
        ssdgs_real *part = memory + l->lights + l->light_size * (size_t)(frame->training ? light : 0),
                   *shadow = NULL, *scattering = NULL;
        const int layer = SSDGS__PER_LIGHT * light; /* behind those of the first */
        const ssdgs_light *source = frame->lights + light;
        const int off = ssdgs__out_of_reach(frame, light, o);
        const int limited = ssdgs__limited(source), casts = ssdgs__casts(source);
        ssdgs_real reach[SSDGS__BLOCK];
        int lit = o->light_count && !off && (ssdgs__shines(source) || frame->training);
        if (lit && limited) lit = ssdgs__reach_row(frame, o, light, gauss, reach, NULL) || frame->training;
        for (int s = 0; frame->layer_count && !(lit && lighting->deferred) && s < live; s++) {
            for (int i = 0; i < SSDGS__PER_LIGHT; i++)
                memset(ssdgs__layer(frame, SSDGS__LIGHT_LAYER + layer + i) + 4 * at[s], 0,
                       3 * sizeof(ssdgs_real));
            if (!lighting->deferred) continue;
            ssdgs_real *to = ssdgs__layer(frame, SSDGS__SHADOW_LAYER + layer) + 4 * at[s];
            to[1] = 1; /* or what blends with it would be darker */
            to[2] = scratch[l->lobe + SSDGS__LOBE_SOFTNESS * SSDGS__BLOCK + (size_t)s];
        }
        for (int s = 0; !lit && s < SSDGS__BLOCK; s++) outs[SSDGS__OUT_SHADOW * SSDGS__BLOCK + s] += 1;
        if (!lit) continue;
        k->reflect(lighting, gauss, part + l->rows);
        ssdgs_real *visibility = part + l->visibility, *cue = part + l->cue, light_in[SSDGS__BLOCK];
        if (lighting->shadow) ssdgs__gather(frame->visibility + n * (size_t)light, at, fours, visibility);
        for (int s = 0; !lighting->shadow && s < SSDGS__BLOCK; s++) visibility[s] = 1;
        const int cued = lighting->scattering && settings->depth_cue && casts;
        if (cued) ssdgs__gather(frame->depth_cue + n * (size_t)light, at, fours, cue);
        for (int s = 0; s < SSDGS__BLOCK; s++) {
            const ssdgs_real irradiance = part[l->rows + (size_t)(SSDGS__IRRADIANCE * SSDGS__BLOCK + s)];
            cue[s] = cued ? cue[s] / (o->scale * o->translucency) : 0;
            light_in[s] = irradiance > 0 ? irradiance : 1; /* 1 / distance^2 of a light very far away is 0 */
        }
        for (int i = 0; job->transport && settings->transport && i < SSDGS__LENGTHS; i++) {
            ssdgs_real *to =
                part + l->transport + i * SSDGS__BLOCK; /* in units of the irradiance of its own */
            const ssdgs_real *cosine = part + l->rows + SSDGS__COSINE * SSDGS__BLOCK,
                             even = casts ? 0 : (ssdgs_real)ssdgs__beneath_plane(i);
            const size_t first = (blocks * (size_t)light * SSDGS__LENGTHS + (size_t)i) * SSDGS__BLOCK;
            if (casts) ssdgs__gather(job->transport + first, sums, sums_fours, to);
            for (int s = 0; s < SSDGS__BLOCK; s++) to[s] = casts ? to[s] / light_in[s] : cosine[s] * even;
        }
        if (l->shadow_layers && lighting->shadow) {
            shadow = part + l->scattering_at - SSDGS__BLOCK;
            if (!ssdgs__shadow_recall(job, light, at, shadow)) {
                ssdgs__encode_inputs(k, settings, l, 1, common + 1, gauss, part, inputs);
                ssdgs__network_forward(k, &shadow_net, common + 1, lists, inputs, part + l->shadow_at);
                ssdgs__shadow_keep(job, light, at, shadow);
            } else lists->shadows_cached += SSDGS__BLOCK;
        }
        if (l->scattering_layers) {
            ssdgs__encode_inputs(k, settings, l, 0, common, gauss, part, inputs);
            ssdgs__network_forward(k, &scattering_net, common, lists, inputs, part + l->scattering_at);
            scattering = part + l->light_size - (size_t)l->scattering[l->scattering_layers] * SSDGS__BLOCK;
        }
        for (int s = 0; limited && s < SSDGS__BLOCK; s++)
            part[l->rows + (size_t)(SSDGS__IRRADIANCE * SSDGS__BLOCK + s)] *= reach[s];
        const int takes = lighting->kept > 0 && o->kept > 0;
        for (int s = 0; takes && s < SSDGS__BLOCK; s++) {
            kept[3 * SSDGS__BLOCK + s] = lighting->kept * (limited ? reach[s] : 1);
            rest[s] -= kept[3 * SSDGS__BLOCK + s];
        }
        const ssdgs__colour_in in = {gauss,  part + l->rows, part + l->visibility,
                                     shadow, scattering,     takes ? kept : NULL};
        k->colour(lighting, &in, outs);
        if (medium && job->transport)
            ssdgs__medium_rows(lighting, o->medium, gauss, part + l->rows, part + l->transport, outs);
        if (lighting->deferred) {
            if (edited) ssdgs__edit_rows(factors, 6, outs);
            sound = sound && k->within(outs, SSDGS__OUT_SCATTERING * SSDGS__BLOCK, most) &&
                    k->within(visibility, SSDGS__BLOCK, most) &&
                    (!shadow || k->within(shadow, SSDGS__BLOCK, most));
            ssdgs__layer_store(frame, SSDGS__LIGHT_LAYER + layer, at, live,
                               outs + SSDGS__OUT_SPECULAR * SSDGS__BLOCK);
            ssdgs__layer_store(frame, SSDGS__DIFFUSE_LAYER + layer, at, live, outs);
            memset(outs, 0, SSDGS__OUT_SCATTERING * SSDGS__BLOCK * sizeof *outs);
            for (int s = 0; s < live; s++) {
                ssdgs_real *to = ssdgs__layer(frame, SSDGS__SHADOW_LAYER + layer) + 4 * at[s];
                to[0] = shadow ? shadow[s] : 0;
                to[1] = visibility[s];
                to[2] = scratch[l->lobe + SSDGS__LOBE_SOFTNESS * SSDGS__BLOCK + (size_t)s];
            }
        }
    }
    if (o->sky_share)
        ssdgs__shade_ambient(frame, o, l, lists, at, edited ? factors + 3 * SSDGS__BLOCK : NULL, memory,
                             scratch);
    for (int i = 0; o->kept > 0 && i < 3 * SSDGS__BLOCK; i++)
        outs[i] += kept[i] * (rest[i % SSDGS__BLOCK] > 0 ? rest[i % SSDGS__BLOCK] : 0);
    if (edited) ssdgs__edit_rows(factors, 9, outs);
    if (frame->layer_count) {
        for (int i = 0; i < 3; i++)
            ssdgs__layer_store(frame, i < 2 ? SSDGS__Q_LAYER + i : SSDGS__NORMAL_LAYER, at, live,
                               scratch + l->lobe + 3 * i * SSDGS__BLOCK);
        for (int s = 0; s < live; s++) {
            ssdgs_real *to = ssdgs__layer(frame, SSDGS__DEPTH_LAYER) + 4 * at[s];
            to[0] = frame->views[0].depth[at[s]];
            to[1] = scratch[l->lobe + SSDGS__LOBE_FRESNEL * SSDGS__BLOCK + (size_t)s];
            to[2] = 1;
        }
    }
    for (int s = 0; s < live; s++) {
        const size_t g = at[s];
        ssdgs_real *to = outs + s, *color = frame->color + 4 * g;
        int black = !ssdgs__finite(to[SSDGS__OUT_SHADOW * SSDGS__BLOCK]);
        for (int c = 0; c < 3; c++) {
            color[c] = to[c * SSDGS__BLOCK] + to[(SSDGS__OUT_SPECULAR + c) * SSDGS__BLOCK] +
                       to[(SSDGS__OUT_SCATTERING + c) * SSDGS__BLOCK];
            black |= !ssdgs__finite(color[c]);
            for (int i = 1; i <= frame->layer_count && !sound; i++) {
                const ssdgs_real value = ssdgs__layer(frame, i)[4 * g + (size_t)c];
                black |= !(value <= most && value >= -most);
            }
        }
        for (int i = 1; i <= frame->layer_count && black; i++)
            memset(ssdgs__layer(frame, i) + 4 * g, 0, 4 * sizeof(ssdgs_real));
        for (int c = 0; c < SSDGS__OUTS && black; c++)
            color[c % 3] = to[c * SSDGS__BLOCK] = 0; /* or it spoils other pixels */
        color[3] = (ssdgs_real)black;
        if (!frame->diffuse) continue;
        ssdgs_real raw[4], q[4], r[9];
        for (int i = 0; i < 4; i++) raw[i] = gauss[(SSDGS_FRAME + i) * SSDGS__BLOCK + s];
        ssdgs__rotation_scalar(raw, q, r);
        ssdgs_real normal[3] = {r[2], r[5], r[8]};
        if (o->turned) ssdgs__turn(o, 0, normal, normal);
        for (int c = 0; c < 3; c++) {
            frame->diffuse[4 * g + (size_t)c] = to[c * SSDGS__BLOCK];
            frame->specular[4 * g + (size_t)c] = to[(SSDGS__OUT_SPECULAR + c) * SSDGS__BLOCK];
            frame->scattering[4 * g + (size_t)c] = to[(SSDGS__OUT_SCATTERING + c) * SSDGS__BLOCK];
            frame->normal[4 * g + (size_t)c] = ssdgs__finite(normal[c]) ? normal[c] : 0;
        }
        frame->shadow[4 * g] =
            o->light_count ? to[SSDGS__OUT_SHADOW * SSDGS__BLOCK] / (ssdgs_real)o->light_count : 1;
        frame->shadow[4 * g + 1] = frame->views[0].depth[g];
        frame->shadow[4 * g + 2] = 0;
    }
}

/* A skipped Gaussian takes the colour of the last one of its object shaded before it, a neighbour. A block
   serves those from its first up to the next block's first; an object's first block also those ahead. */
static void ssdgs__shade_skipped(const ssdgs__shade_job *job, int block) {
    const ssdgs_frame *frame = job->frame;
    const ssdgs__shade_block *b = job->block + block;
    const ssdgs_placed *o = b->object;
    ssdgs_real *const planes[6] = {frame->color,      frame->diffuse, frame->specular,
                                   frame->scattering, frame->normal,  frame->shadow};
    const int opens = !block || b[-1].object != o, closes = block + 1 == job->blocks || b[1].object != o;
    const size_t last = closes ? (size_t)(o->first + o->gaussians.count) : frame->shaded[b[1].first];
    size_t from = frame->shaded[b->first];
    for (size_t g = opens ? (size_t)o->first : from; g < last; g++) {
        if (frame->seen[g] == SSDGS_SEEN) from = g;
        if (frame->seen[g] != SSDGS_SKIPPED) continue;
        for (int p = 0; p < (frame->diffuse ? 6 : 1); p++)
            memcpy(planes[p] + 4 * g, planes[p] + 4 * from, 4 * sizeof(ssdgs_real));
        for (int p = 1; p <= frame->layer_count; p++)
            memcpy(ssdgs__layer(frame, p) + 4 * g, ssdgs__layer(frame, p) + 4 * from, 4 * sizeof(ssdgs_real));
    }
}

static void ssdgs__shade_task(void *data, int slot) {
    const ssdgs__shade_job *job = (const ssdgs__shade_job *)data;
    ssdgs__row_lists lists;
    ssdgs__row_lists_fill(&lists);
    for (int block = ssdgs__slot_begin(job->blocks, slot); block < ssdgs__slot_begin(job->blocks, slot + 1);
         block++) {
        ssdgs__shade_block_of(job, block, &lists,
                              job->activations + job->size * (size_t)(job->frame->training ? block : slot),
                              job->scratch + job->scratch_size * (size_t)slot);
        if (job->frame->options.max_error > 0) ssdgs__shade_skipped(job, block);
    }
    job->counts[3 * slot] = lists.multiplied;
    job->counts[3 * slot + 1] = lists.multipliable;
    job->counts[3 * slot + 2] = lists.shadows_cached;
}

/* The objects' layouts, and the blocks of what is to be shaded. */
static ssdgs_result ssdgs__shade_setup(ssdgs_frame *frame, ssdgs__shade_job *job) {
    ssdgs_context *context = frame->context;
    ssdgs__block_layout *layout;
    memset(job, 0, sizeof *job);
    job->frame = frame;
    SSDGS__RESERVE(frame->scratch->layouts, layout, ssdgs__block_layout, frame->object_count + 1);
    job->layouts = layout;
    for (int i = 0; i < frame->object_count; i++) {
        layout[i] = ssdgs__layout(frame, frame->objects + i);
        job->size = layout[i].size > job->size ? layout[i].size : job->size;
        job->scratch_size = layout[i].scratch > job->scratch_size ? layout[i].scratch : job->scratch_size;
    }
    SSDGS__RESERVE(frame->scratch->blocks, job->block, ssdgs__shade_block,
                   (frame->shaded_count + SSDGS__BLOCK - 1) / SSDGS__BLOCK + frame->object_count + 1);
    const ssdgs_placed *o = frame->objects;
    for (int first = 0; first < frame->shaded_count; job->blocks++) {
        ssdgs__shade_block *b = job->block + job->blocks;
        int g = (int)frame->shaded[first];
        while (o + 1 < frame->objects + frame->object_count && o[1].first <= g) o++;
        const int end = o->first + o->gaussians.count;
        b->object = o;
        b->first = first;
        for (b->live = 0; b->live < SSDGS__BLOCK && g < end; b->live++)
            g = ++first < frame->shaded_count ? (int)frame->shaded[first] : end;
    }
    SSDGS__RESERVE(frame->scratch->scratch, job->scratch, ssdgs_real, job->scratch_size * SSDGS__SLOTS);
    return SSDGS_OK;
}

static ssdgs_result ssdgs__shade(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    frame->shaded_count = 0;
    for (int i = 0; i < frame->object_count; i++) {
        const ssdgs_placed *o = frame->objects + i;
        const int before = frame->shaded_count;
        int skipped = -1;
        for (int g = o->first; g < o->first + o->gaussians.count; g++) {
            if (frame->seen[g] == SSDGS_SEEN) frame->shaded[frame->shaded_count++] = (uint32_t)g;
            else if (frame->seen[g] && skipped < 0) skipped = g;
        }
        if (frame->shaded_count > before || skipped < 0) continue;
        frame->seen[skipped] = SSDGS_SEEN; /* some colour is needed: the first's */
        frame->shaded[frame->shaded_count++] = (uint32_t)skipped;
    }
    ssdgs__shade_job job;
    SSDGS__TRY(ssdgs__shade_setup(frame, &job));
    SSDGS__RESERVE(frame->scratch->activations, job.activations, ssdgs_real,
                   job.size * (size_t)(frame->training ? job.blocks + 1 : SSDGS__SLOTS));
    int transport = 0, shadows = 0;
    for (int i = 0; i < frame->object_count; i++) {
        transport |= ssdgs__has_transport(frame->objects + i);
        shadows |= job.layouts[i].shadow_layers > 0;
    }
    if (shadows && !frame->training) {
        const size_t n = (size_t)frame->count, pairs = n * (size_t)frame->light_count;
        ssdgs__light_memory *lights = ssdgs__light_memories(frame);
        SSDGS__KEEP(frame->memory->shadow_logit, job.shadow_logit, ssdgs_real, pairs + 1);
        SSDGS__KEEP(frame->memory->shadow_known, job.shadow_known, unsigned char, pairs + 1);
        for (int i = 0; i < frame->light_count; i++) {
            if (lights[i].shadow_key != lights[i].key) memset(job.shadow_known + n * (size_t)i, 0, n);
            lights[i].shadow_key = lights[i].key;
        }
    }
    job.counts = frame->memory->counts;
    if (transport && frame->shaded_count) SSDGS__TRY(ssdgs__transport(frame, &job.transport));
    ssdgs__parallel(context, SSDGS__SLOTS, ssdgs__shade_task, &job);
    return SSDGS_OK;
}

static ssdgs_real *ssdgs__layer_gradient(const ssdgs_frame *frame, int layer) {
    return layer ? frame->layer_gradient + (size_t)(layer - 1) * 4 * (size_t)frame->count
                 : frame->color_gradient;
}

/* (n, 4) of the Gaussians `at` -> rows (3, BLOCK), 0 where none is. */
static void ssdgs__gradient_rows(const ssdgs_real *from, const size_t at[SSDGS__BLOCK], int live,
                                 ssdgs_real *rows) {
    for (int s = 0; s < SSDGS__BLOCK; s++)
        for (int c = 0; c < 3; c++) rows[c * SSDGS__BLOCK + s] = s < live ? from[4 * at[s] + (size_t)c] : 0;
}

/* The lights that a training frame's Gaussians learn from: ambient light is one more. */
static int ssdgs__learning_lights(const ssdgs_frame *frame) {
    return frame->light_count + (frame->objects->sky_share != NULL);
}

/* Adds dL/d(ambient light's intensity) to the lane sums that hold a lamp's dL/d(position), then gives lamp
   that intensity. */
static void ssdgs__ambient_backward(const ssdgs_frame *frame, ssdgs__lighting *lamp,
                                    const ssdgs__colour_in *in, const ssdgs_real *dcolor,
                                    ssdgs_real *lane_sums) {
    ssdgs_real own[SSDGS__OUTS * SSDGS__BLOCK];
    memset(own, 0, sizeof own);
    frame->context->k->colour(lamp, in, own);
    for (int i = 0; i < 3 * SSDGS__BLOCK; i++)
        lane_sums[i / SSDGS__BLOCK * 16 + i % 16] +=
            dcolor[i] * (own[i] + own[SSDGS__OUT_SPECULAR * SSDGS__BLOCK + i] +
                         own[SSDGS__OUT_SCATTERING * SSDGS__BLOCK + i]);
    for (int c = 0; c < 3; c++) lamp->intensity[c] *= frame->options.ambient[0][c];
}

/* E = reach / distance^2. dL/d(reach) goes on to positions and the light; dL/d(1 / distance^2) stays in
   drows. */
static void ssdgs__reach_backward(const ssdgs_frame *frame, int light, const ssdgs_real *gauss,
                                  ssdgs_real *drows, ssdgs_real *dgauss, ssdgs_real *lane_sums) {
    ssdgs_real reach[SSDGS__BLOCK], slope[3 * SSDGS__BLOCK], *de = drows + SSDGS__IRRADIANCE * SSDGS__BLOCK;
    ssdgs__reach_row(frame, frame->objects, light, gauss, reach, slope);
    for (int i = 0; i < 3 * SSDGS__BLOCK; i++) {
        const ssdgs_real d = de[i % SSDGS__BLOCK] * slope[i];
        dgauss[SSDGS_POSITION * SSDGS__BLOCK + i] += d;
        lane_sums[i / SSDGS__BLOCK * 16 + i % 16] -= d;
    }
    for (int s = 0; s < SSDGS__BLOCK; s++) de[s] *= reach[s];
}

static void ssdgs__shade_backward_block(const ssdgs__shade_job *job, int block, ssdgs__row_lists *lists,
                                        int slot) {
    const ssdgs_frame *frame = job->frame;
    const ssdgs_settings *settings = &frame->settings;
    const ssdgs__block_layout *l = job->layouts;
    const ssdgs__kernels *k = frame->context->k;
    const ssdgs_real *memory = job->activations + l->size * (size_t)block, *gauss = memory + l->gauss;
    ssdgs_real *scratch = job->scratch + l->scratch * (size_t)slot, *inputs = scratch + l->inputs;
    ssdgs_real *dgauss = scratch + l->dgauss, *drows = scratch + l->drows, *dlobe = scratch + l->lobe;
    ssdgs_real *dnet = scratch + l->dnet, *dnet2 = scratch + l->dnet2;
    ssdgs_real dcolor[3 * SSDGS__BLOCK], ddiffuse[3 * SSDGS__BLOCK], dspecular[3 * SSDGS__BLOCK],
        dresidual[3 * SSDGS__BLOCK], dvisibility[SSDGS__BLOCK];
    ssdgs_real *slot_gradient = job->slots + job->slot_stride * (size_t)slot;
    ssdgs_real *dshadow = scratch + l->transposed - SSDGS__BLOCK;
    const int live = job->block[block].live;
    memset(dgauss, 0, SSDGS_CHANNELS * SSDGS__BLOCK * sizeof *dgauss);
    size_t at[SSDGS__BLOCK];
    for (int s = 0; s < SSDGS__BLOCK; s++) at[s] = ssdgs__block_lane(job, block, s);
    ssdgs__gradient_rows(frame->color_gradient, at, live, dcolor);
    if (frame->layer_count) {
        for (int c = 0; c < 3; c++)
            ssdgs__gradient_rows(
                ssdgs__layer_gradient(frame, c < 2 ? SSDGS__Q_LAYER + c : SSDGS__NORMAL_LAYER), at, live,
                dlobe + 3 * c * SSDGS__BLOCK);
        ssdgs_real rows[3 * SSDGS__BLOCK];
        ssdgs__gradient_rows(ssdgs__layer_gradient(frame, SSDGS__DEPTH_LAYER), at, live, rows);
        memcpy(dlobe + SSDGS__LOBE_FRESNEL * SSDGS__BLOCK, rows + SSDGS__BLOCK,
               SSDGS__BLOCK * sizeof *rows); /* depth is the projection's */
        memset(dlobe + SSDGS__LOBE_SOFTNESS * SSDGS__BLOCK, 0,
               SSDGS__BLOCK * sizeof *dlobe); /* softness is every light's */
    }
    const ssdgs__network scattering_net = {l->scattering, l->scattering_layers, frame->gaussians.scattering};
    const ssdgs__network shadow_net = {l->shadow, l->shadow_layers, frame->gaussians.shadow};
    const ssdgs__network_scratch backward = {dnet, dnet2, scratch + l->transposed};
    const int lights = ssdgs__learning_lights(frame);
    for (int light = 0; light < lights; light++) {
        const int even = light == frame->light_count; /* ambient light, behind the others */
        ssdgs__lighting lamp = ssdgs__lightings(frame, frame->objects)[light];
        const ssdgs__lighting *lighting = &lamp;
        const ssdgs_real *part = memory + l->lights + l->light_size * (size_t)light;
        const ssdgs_real *shadow =
            l->shadow_layers && lighting->shadow ? part + l->scattering_at - SSDGS__BLOCK : NULL;
        const ssdgs_real *scattering =
            part + l->light_size - (size_t)l->scattering[l->scattering_layers] * SSDGS__BLOCK;
        ssdgs_real *lane_sums = job->lane_slots + (size_t)(slot * lights + light) * SSDGS__LANE_SUMS * 16;
        const int deferred = lighting->deferred && !even;
        const ssdgs__colour_in in = {gauss, part + l->rows, part + l->visibility, shadow, scattering, NULL};
        memset(drows, 0, SSDGS__ROWS * SSDGS__BLOCK * sizeof *drows);
        if (even) ssdgs__ambient_backward(frame, &lamp, &in, dcolor, lane_sums);
        /* both networks' output gradients first: shadow's one row in dnet2's last, scattering's in dnet */
        if (deferred) {
            const int layer = SSDGS__PER_LIGHT * light; /* behind those of the first */
            ssdgs__gradient_rows(ssdgs__layer_gradient(frame, SSDGS__LIGHT_LAYER + layer), at, live,
                                 dspecular);
            ssdgs__gradient_rows(ssdgs__layer_gradient(frame, SSDGS__DIFFUSE_LAYER + layer), at, live,
                                 ddiffuse);
            ssdgs__gradient_rows(ssdgs__layer_gradient(frame, SSDGS__SHADOW_LAYER + layer), at, live,
                                 dresidual);
            for (int s = 0; s < SSDGS__BLOCK; s++)
                dlobe[SSDGS__LOBE_SOFTNESS * SSDGS__BLOCK + s] += dresidual[2 * SSDGS__BLOCK + s];
        }
        const ssdgs_real *dd = deferred ? ddiffuse : dcolor, *ds = deferred ? dspecular : dcolor;
        const ssdgs__colour_gradient out = {dcolor, dd, ds, dgauss, drows, dshadow, dnet, dvisibility};
        k->colour_backward(lighting, &in, &out);
        for (int s = 0; deferred && shadow && s < SSDGS__BLOCK; s++) dshadow[s] += dresidual[s];
        if (l->scattering_layers) {
            ssdgs__encode_inputs(k, settings, l, 0, NULL, gauss, part, inputs);
            ssdgs_real *dinputs = ssdgs__network_backward(
                k, &scattering_net, inputs, part + l->scattering_at, &backward, lists,
                ssdgs__input_rows(settings, l, 0,
                                  5), /* the light pass's cues, behind these, are held fixed */
                frame->frozen[0] ? NULL : slot_gradient);
            ssdgs__encode_inputs_backward(k, settings, l, 0, inputs, dinputs, dgauss, drows, dvisibility);
        }
        if (shadow) {
            memcpy(dnet, dshadow, SSDGS__BLOCK * sizeof *dnet);
            ssdgs__encode_inputs(k, settings, l, 1, NULL, gauss, part, inputs);
            ssdgs_real *dinputs = ssdgs__network_backward(
                k, &shadow_net, inputs, part + l->shadow_at, &backward, lists, l->shadow[0],
                frame->frozen[1] ? NULL : slot_gradient + job->slot_shadow);
            ssdgs__encode_inputs_backward(k, settings, l, 1, inputs, dinputs, dgauss, drows, dvisibility);
        }
        if (even) { /* it comes along the normal, wherever that points; the rest is held fixed */
            for (int i = 0; i < 3 * SSDGS__BLOCK; i++) {
                drows[SSDGS__NORMAL * SSDGS__BLOCK + i] += drows[SSDGS__WI * SSDGS__BLOCK + i];
                drows[SSDGS__WI * SSDGS__BLOCK + i] = 0;
            }
            memset(drows + SSDGS__IRRADIANCE * SSDGS__BLOCK, 0, 3 * SSDGS__BLOCK * sizeof *drows);
        }
        if (!even && ssdgs__limited(frame->lights + light))
            ssdgs__reach_backward(frame, light, gauss, drows, dgauss, lane_sums);
        k->reflect_backward(lighting, gauss, drows, dgauss, lane_sums);
    }
    if (frame->layer_count) k->lobe_backward(gauss, dlobe, dgauss);
    for (int c = 0; c < SSDGS_CHANNELS; c++)
        for (int s = 0; s < live; s++)
            frame->gradient[(size_t)c * frame->gaussians.stride + at[s]] = dgauss[c * SSDGS__BLOCK + s];
}

static void ssdgs__shade_backward_task(void *data, int slot) {
    const ssdgs__shade_job *job = (const ssdgs__shade_job *)data;
    const size_t lanes = (size_t)SSDGS__LANE_SUMS * 16 * (size_t)ssdgs__learning_lights(job->frame);
    ssdgs__row_lists lists;
    ssdgs__row_lists_fill(&lists);
    memset(job->slots + job->slot_stride * (size_t)slot, 0, job->slot_stride * sizeof(ssdgs_real));
    memset(job->lane_slots + lanes * (size_t)slot, 0, lanes * sizeof(ssdgs_real));
    for (int block = ssdgs__slot_begin(job->blocks, slot); block < ssdgs__slot_begin(job->blocks, slot + 1);
         block++)
        ssdgs__shade_backward_block(job, block, &lists, slot);
}

static void ssdgs__sum_slots_task(void *data, int part) {
    const ssdgs__shade_job *job = (const ssdgs__shade_job *)data;
    const ssdgs__block_layout *l = job->layouts;
    ssdgs_frame *frame = job->frame;
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&frame->settings, first);
    ssdgs__sum_slots(l->scattering, l->scattering_layers, job->slots, job->slot_stride, SSDGS__SLOTS, part,
                     SSDGS__SLOTS, frame->global_gradient + first[SSDGS__SCATTERING_NET]);
    ssdgs__sum_slots(l->shadow, l->shadow_layers, job->slots + job->slot_shadow, job->slot_stride,
                     SSDGS__SLOTS, part, SSDGS__SLOTS, frame->global_gradient + first[SSDGS__SHADOW_NET]);
}

/* eye = -R^T t */
static void ssdgs__eye_backward(ssdgs_frame *frame, const ssdgs_real deye[3]) {
    for (int j = 0; j < 3; j++)
        for (int c = 0; c < 3; c++) {
            frame->view_gradient[4 * j + c] -= frame->camera.view[4 * j + 3] * deye[c];
            frame->view_gradient[4 * j + 3] -= frame->camera.view[4 * j + c] * deye[c];
        }
}

/* Overwrites gradient and the networks' part of global_gradient, without layers the ASG's too; adds to
   light_gradient, ambient_gradient and view_gradient. */
static SSDGS__TRAINING ssdgs_result ssdgs__shade_backward(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    const int lights = ssdgs__learning_lights(frame);
    const size_t n = frame->gaussians.stride * SSDGS_CHANNELS,
                 lanes = (size_t)SSDGS__LANE_SUMS * (size_t)lights;
    ssdgs__shade_job job;
    SSDGS__TRY(ssdgs__shade_setup(frame, &job));
    const ssdgs__block_layout *l = job.layouts;
    job.slot_shadow = ssdgs__slot_gradient_size(l->scattering, l->scattering_layers);
    job.slot_stride = job.slot_shadow + ssdgs__slot_gradient_size(l->shadow, l->shadow_layers);
    job.activations = (ssdgs_real *)frame->scratch->activations.memory;
    SSDGS__RESERVE(frame->scratch->slots, job.slots, ssdgs_real, job.slot_stride * SSDGS__SLOTS + 1);
    SSDGS__RESERVE(frame->scratch->lane_slots, job.lane_slots, ssdgs_real, lanes * 16 * SSDGS__SLOTS + 1);
    memset(frame->gradient, 0, n * sizeof(ssdgs_real));
    ssdgs__parallel(context, SSDGS__SLOTS, ssdgs__shade_backward_task, &job);
    ssdgs__parallel(context, SSDGS__SLOTS, ssdgs__sum_slots_task, &job);
    ssdgs_real sums[SSDGS__LANE_SUMS];
    memset(sums, 0, sizeof sums);
    for (int slot = 0; slot < SSDGS__SLOTS; slot++)
        for (int light = 0; light < lights; light++)
            for (size_t i = 0; i < SSDGS__LANE_SUMS; i++) {
                const ssdgs_real *row =
                    job.lane_slots + ((size_t)(slot * lights + light) * SSDGS__LANE_SUMS + i) * 16;
                ssdgs_real sum = 0;
                for (int lane = 0; lane < 16; lane++) sum += row[lane];
                sums[i] += sum;
                if (i < 3 && light == 0) frame->light_gradient[i] += sum;
                if (i < 3 && light == frame->light_count) frame->ambient_gradient[i] += sum;
            }
    if (!frame->layer_count) ssdgs__asg_backward(frame, sums + 6);
    ssdgs__eye_backward(frame, sums + 3);
    return SSDGS_OK;
}

/* ==== >>composite  eq. 1, highlights per pixel, and their backward over tiles ==== */

/* Reads color, layers, tile lists and light maps. Writes pixels, layer_pixels, transmittance. Stages
   COMPOSITE, COMPOSITE_BACKWARD and PROJECT_BACKWARD. */

/* Writes, or with add adds, the first `count` of a tile's values, [micro-tile][4][16 lanes], to planes. */
static void ssdgs__tile_store(const ssdgs__tile *tile, const ssdgs_real *values, int count, int add,
                              ssdgs_real *const planes[]) {
    for (int micro = 0; micro < 16; micro++)
        for (int row = 0; row < 4; row++) {
            const int x = tile->x + 4 * (micro & 3), y = tile->y + 4 * (micro >> 2) + row,
                      inside = tile->width - x;
            const size_t at = (size_t)y * (size_t)tile->width + (size_t)x;
            if (inside <= 0 || y >= tile->height) continue;
            for (int c = 0; c < count; c++) {
                const ssdgs_real *from = values + micro * 64 + c * 16 + 4 * row;
                const int many = inside < 4 ? inside : 4;
                if (!add && many == 4) memcpy(planes[c] + at, from, 4 * sizeof *from);
                else
                    for (int i = 0; i < many; i++)
                        planes[c][at + (size_t)i] = from[i] + (add ? planes[c][at + (size_t)i] : 0);
            }
        }
}

static void ssdgs__tile_load(const ssdgs__tile *tile, const ssdgs_real *plane, int c, ssdgs_real *values) {
    for (int micro = 0; micro < 16; micro++)
        for (int row = 0; row < 4; row++) {
            const int x = tile->x + 4 * (micro & 3), y = tile->y + 4 * (micro >> 2) + row;
            const int inside = y < tile->height ? tile->width - x : 0;
            const size_t at = (size_t)y * (size_t)tile->width + (size_t)x;
            ssdgs_real *to = values + micro * 64 + 16 * c + 4 * row;
            if (inside >= 4) memcpy(to, plane + at, 4 * sizeof *to);
            else {
                memset(to, 0, 4 * sizeof *to);
                if (inside > 0) memcpy(to, plane + at, (size_t)inside * sizeof *to);
            }
        }
}

/* The first of the blended layers that are kept: all, or in training the depth's and the normals'. */
static int ssdgs__first_kept(const ssdgs_frame *frame) {
    return frame->pixel_shadow ? SSDGS__COLOUR_LAYER : SSDGS__DEPTH_LAYER;
}

static ssdgs_real *ssdgs__layer_plane(const ssdgs_frame *frame, int layer, int c) {
    return frame->layer_pixels + (size_t)frame->camera.width * (size_t)frame->camera.height *
                                     (size_t)(3 * (layer - ssdgs__first_kept(frame)) + c);
}

static void ssdgs__layer_pixels_store(const ssdgs_frame *frame, const ssdgs__tile *tile, int layer, int add,
                                      const ssdgs_real *values) {
    if (!frame->layer_pixels) return;
    ssdgs_real *planes[3];
    for (int c = 0; c < 3; c++) planes[c] = ssdgs__layer_plane(frame, layer, c);
    ssdgs__tile_store(tile, values, 3, add, planes);
}

typedef struct ssdgs__composite_job {
    const ssdgs_frame *frame;
    const ssdgs_real *color;
    ssdgs_real *planes[4]; /* colour, transmittance */
} ssdgs__composite_job;

/* Transmittance from a light to sixteen places in the world, rows of x, y and z, by the maps of its views in
   turn, where passed is -1, as it stays where none knows the place. slope: rows of its gradient by the place,
   or NULL. */
static void ssdgs__light_transmittance(const ssdgs__kernels *k, const ssdgs_splat_view *view,
                                       const ssdgs_splat_view *end, ssdgs_real bias, const ssdgs_real *at,
                                       ssdgs_real *passed, ssdgs_real *slope) {
    while (view < end && (!view->light_map || k->map_transmittance(view, bias, at, passed, slope))) view++;
}

/* Transmittance from a light to the places of a micro-tile's pixels, by their depth layer, where passed is
   -1. ray, at: what the kernel `places` finds on its way. */
static void ssdgs__places_transmittance(const ssdgs_frame *frame, const ssdgs__lighting *lighting, int light,
                                        const ssdgs__tile *tile, int micro, const ssdgs_real *depth,
                                        ssdgs_real *passed, ssdgs_real *ray, ssdgs_real *at,
                                        ssdgs_real *slope) {
    const ssdgs__kernels *k = frame->context->k;
    const ssdgs__light_memory *own = ssdgs__light_memories(frame) + light;
    const ssdgs_splat_view *first = frame->views + own->first;
    k->places(lighting, tile, micro, depth, passed, ray, at);
    ssdgs__light_transmittance(k, first, first + own->views, frame->bias[1], at, passed, slope);
}

/* What the light's map says of a tile's pixels, [micro-tile][4][16 lanes]: the transmittance to the place at
   their depth. Where no map knows it, that of their Gaussians. */
static void ssdgs__pixel_visibility(const ssdgs_frame *frame, const ssdgs__lighting *k, int light,
                                    const ssdgs__tile *tile, const ssdgs_real *layers,
                                    ssdgs_real *visibility) {
    ssdgs_real points[3 * SSDGS__POINTS], fraction[SSDGS__POINTS];
    int lanes[SSDGS__POINTS], points_count = 0;
    const int occluded = ssdgs__occluded(frame, light);
    for (int micro = 0; micro < 16; micro++) {
        const ssdgs_real *depth = layers + SSDGS__DEPTH_LAYER * SSDGS__TILE_LAYER + 64 * micro,
                         *own = layers + SSDGS__SHADOW_LAYER * SSDGS__TILE_LAYER + 64 * micro + 16;
        ssdgs_real ray[32], at[48], *passed = visibility + 64 * micro;
        int any = 0;
        for (int i = 0; i < 16; i++) {
            const int asked = k->shadow && depth[i + 32] > SSDGS__THIN;
            passed[i] = asked ? -1 : 1;
            any |= asked;
        }
        if (!any) continue;
        ssdgs__places_transmittance(frame, k, light, tile, micro, depth, passed, ray, at, NULL);
        for (int i = 0; i < 16; i++) {
            if (passed[i] < 0) passed[i] = own[i] / depth[i + 32]; /* has what the occluder says already */
            else if (occluded && depth[i + 32] > SSDGS__THIN) {
                for (int c = 0; c < 3; c++) points[3 * points_count + c] = at[i + 16 * c];
                lanes[points_count++] = 64 * micro + i;
            }
        }
    }
    if (!points_count) return;
    ssdgs__let_pass(frame, light, points, points_count, fraction);
    while (points_count--) visibility[lanes[points_count]] *= fraction[points_count];
}

/* Of the materials that the tile's pixels blend the first after `material`; -1: there is none. */
static int ssdgs__material_after(const ssdgs__tile *tile, int material) {
    int first = -1;
    for (uint32_t i = 0; tile->material_of && i < tile->count; i++) {
        const int of = tile->material_of[tile->list[i].gaussian / SSDGS__BLOCK];
        if (tile->seen[i] && of > material && (first < 0 || of < first)) first = of;
    }
    return first < 0 && material < 0 ? 0 : first; /* 0: with nothing to blend a tile still has its pixels */
}

/* Of several materials in a tile: averages this one's v and S (the first 2 of visibility) with those before
   it, in pixel_visibility and pixel_shadow, weighted by cover. Scales D such that D x the joint S is the sum
   of both diffuse terms. depth: this material's depth layer; its third value is the cover. */
static void ssdgs__join_shadows(const ssdgs_frame *frame, const ssdgs__tile *tile, int light,
                                const ssdgs_real *depth, ssdgs_real *diffuse, ssdgs_real *visibility) {
    const size_t plane = (size_t)tile->width * (size_t)tile->height * (size_t)light;
    ssdgs_real before[SSDGS__TILE_LAYER], others[SSDGS__TILE_LAYER];
    ssdgs__tile_load(tile, frame->pixel_visibility + plane, 0, before);
    ssdgs__tile_load(tile, frame->pixel_shadow + plane, 1, before);
    ssdgs__tile_load(tile, ssdgs__layer_plane(frame, SSDGS__DEPTH_LAYER, 2), 2, before);
    for (int c = 0; c < 3; c++)
        ssdgs__tile_load(tile, ssdgs__layer_plane(frame, SSDGS__DIFFUSE_LAYER + SSDGS__PER_LIGHT * light, c),
                         c, others);
    for (int i = 0; i < 256; i++) {
        const int at = i / 16 * 64 + i % 16;                            /* [micro-tile][4][16 lanes] */
        const ssdgs_real cover = depth[at + 32], all = before[at + 32]; /* has this one's cover already */
        const ssdgs_real share = all > SSDGS__THIN ? cover / all : 1, shadow = visibility[at + 16];
        for (int j = 0; j < 2; j++) {
            ssdgs_real *v = visibility + at + 16 * j;
            *v = before[at + 16 * j] + share * (*v - before[at + 16 * j]);
        }
        for (int c = 0; c < 3; c++) {
            const ssdgs_real sum = diffuse[at + 16 * c] * shadow + others[at + 16 * c] * before[at + 16];
            diffuse[at + 16 * c] = visibility[at + 16] > 0 ? sum / visibility[at + 16] : 0;
        }
    }
}

/* Lights the pixels of a tile by one light; with pixel_shadow, keeps what it found. later: other materials
   have been here. */
static void ssdgs__light_tile(const ssdgs_frame *frame, const ssdgs__tile *tile, int light, int later,
                              ssdgs_real *pixels) {
    const ssdgs__kernels *k = frame->context->k;
    const ssdgs__lighting *lighting = ssdgs__pixel_lightings(frame, tile->material) + light;
    const int first = SSDGS__LIGHT_LAYER + SSDGS__PER_LIGHT * light, empty = !tile->count;
    const size_t plane = (size_t)tile->width * (size_t)tile->height * (size_t)light;
    ssdgs_real visibility[SSDGS__TILE_LAYER], *lit = pixels + SSDGS__LIGHT_LAYER * SSDGS__TILE_LAYER;
    if (!empty) {
        const ssdgs_real *color[SSDGS__PER_LIGHT];
        for (int layer = 0; layer < SSDGS__PER_LIGHT; layer++)
            color[layer] = ssdgs__layer(frame, first + layer);
        if (light) k->composite(tile, SSDGS__PER_LIGHT, color, lit); /* the first's came with the others */
        if (frame->visibility_given) ssdgs__tile_load(tile, frame->pixel_visibility + plane, 0, visibility);
        else ssdgs__pixel_visibility(frame, lighting, light, tile, pixels, visibility);
        k->highlight(lighting, tile, pixels, visibility);
    } else memset(visibility, 0, sizeof visibility);
    if (!frame->pixel_shadow) return;
    if (later)
        ssdgs__join_shadows(frame, tile, light, pixels + SSDGS__DEPTH_LAYER * SSDGS__TILE_LAYER,
                            pixels + SSDGS__DIFFUSE_LAYER * SSDGS__TILE_LAYER, visibility);
    for (int layer = 0; layer < SSDGS__PER_LIGHT; layer++)
        ssdgs__layer_pixels_store(frame, tile, first + layer,
                                  later && first + layer != SSDGS__DIFFUSE_LAYER + SSDGS__PER_LIGHT * light,
                                  lit + layer * SSDGS__TILE_LAYER);
    const int given = frame->visibility_given != 0;
    ssdgs_real *planes[2];
    planes[0] = frame->pixel_visibility + plane;
    planes[1] = frame->pixel_shadow + plane;
    ssdgs__tile_store(tile, visibility + 16 * given, 2 - given, 0, planes + given);
}

/* Whether a light reaches any of the objects that a tile blends. */
static int ssdgs__reaches_tile(const ssdgs_frame *frame, const ssdgs__tile *tile, int light) {
    const unsigned char *reach = ssdgs__reach(frame, light);
    if (!ssdgs__shines(frame->lights + light)) return 0;
    int any = !reach;
    for (uint32_t i = 0; i < tile->count && !any; i++)
        any = tile->seen[i] && reach[frame->object_of[tile->list[i].gaussian / SSDGS__BLOCK]];
    return any;
}

static void ssdgs__composite_task(void *data, int index) {
    const ssdgs__composite_job *job = (const ssdgs__composite_job *)data;
    const ssdgs_frame *frame = job->frame;
    ssdgs__tile tile = ssdgs__tile_of(frame, frame->views, index, 1);
    if (frame->empty && !tile.count) {
        frame->empty[index] = 1;
        return;
    }
    const int layers =
        frame->layer_count && tile.count ? SSDGS__LAYERS : 1; /* where there is nothing, nothing shines */
    const ssdgs_real *color[SSDGS__LAYERS];
    ssdgs_real pixels[SSDGS__LAYERS * SSDGS__TILE_LAYER];
    for (int layer = 0; layer < layers; layer++)
        color[layer] = layer ? ssdgs__layer(frame, layer) : job->color;
    for (int y = tile.y; y < tile.y + 16 && y < tile.height; y++) /* to be near once it is stored */
        for (int c = 0; c < 4; c++)
            SSDGS__PREFETCH(job->planes[c] + (size_t)y * (size_t)tile.width + (size_t)tile.x);
    ssdgs_real scene_depth[256], median[SSDGS__TILE_LAYER];
    ssdgs__tile_scene_depth(frame, &tile, scene_depth);
    if (job->color == frame->color && frame->median_depth) {
        memset(median, 0, sizeof median);
        tile.median = median;
    }
    if (frame->layer_count) tile.material_of = frame->material_of;
    tile.material = ssdgs__material_after(&tile, -1);
    for (int later = 0; tile.material >= 0; later = 1) {
        frame->context->k->composite(&tile, layers, color, pixels);
        if (tile.median) ssdgs__tile_store(&tile, median, 1, 0, &frame->median_depth);
        tile.median = NULL;
        if (frame->layer_count && layers == 1)
            memset(pixels + SSDGS__TILE_LAYER, 0, sizeof pixels - SSDGS__TILE_LAYER * sizeof *pixels);
        for (int layer = ssdgs__first_kept(frame); frame->layer_count && layer < SSDGS__LIGHT_LAYER; layer++)
            ssdgs__layer_pixels_store(frame, &tile, layer, later, pixels + layer * SSDGS__TILE_LAYER);
        for (int light = 0; frame->layer_count && light < frame->light_count; light++)
            if (frame->pixel_shadow || ssdgs__reaches_tile(frame, &tile, light))
                ssdgs__light_tile(frame, &tile, light, later, pixels);
        ssdgs__tile_store(&tile, pixels, later ? 3 : 4, later, job->planes);
        tile.material = ssdgs__material_after(&tile, tile.material);
    }
}

/* Blends color, any triple per Gaussian; where deferred, the layers too, and lights what they blend to. */
static void ssdgs__composite_tiles(const ssdgs_frame *frame, const ssdgs_real *color, ssdgs_real *pixels) {
    const size_t plane = (size_t)frame->camera.width * (size_t)frame->camera.height;
    ssdgs__composite_job job = {
        frame, color, {pixels, pixels + plane, pixels + 2 * plane, frame->transmittance}};
    ssdgs__parallel(frame->context, frame->views[0].tiles_x * frame->views[0].tiles_y, ssdgs__composite_task,
                    &job);
}

typedef struct ssdgs__uncomposite_job {
    ssdgs_frame *frame;
    const ssdgs__lighting *lightings;
    ssdgs_real *highlight_sums; /* (tiles, lights, SSDGS__HIGHLIGHT_SUMS) */
    size_t stride;              /* of tile_sums: 8 and 4 per layer */
} ssdgs__uncomposite_job;

/* Sets the first layer's fourth value to the sum of gradient x pixel; transmittance 1: with T's. */
static void ssdgs__gradient_product(const ssdgs_real *pixels, ssdgs_real *gradient, int layers,
                                    int transmittance) {
    for (int micro = 0; micro < 16; micro++)
        for (int lane = 0; lane < 16; lane++) {
            const int at = micro * 64 + lane;
            ssdgs_real total =
                transmittance ? pixels[at + SSDGS__TILE_FOURTH] * gradient[at + SSDGS__TILE_FOURTH] : 0;
            for (int layer = 0; layer < layers; layer++)
                for (int c = 0; c < 3; c++) {
                    const int value = layer * SSDGS__TILE_LAYER + at + 16 * c;
                    total += gradient[value] * pixels[value];
                }
            gradient[at + SSDGS__TILE_FOURTH] = total;
        }
}

/* Where a shadow's edge falls depends on the depth of the surface that receives it. Takes dL/dv, the fourth
   of the light's last layer, through the light's map, which is held fixed: adds to the gradient of the
   pixels' depths and, for the camera, to the highlights' sums. */
static void ssdgs__place_backward(const ssdgs_frame *frame, const ssdgs__lighting *k, int light,
                                  const ssdgs__tile *tile, const ssdgs_real *pixels, ssdgs_real *gradient,
                                  ssdgs_real *sums) {
    for (int micro = 0; micro < 16; micro++) {
        const int layer = SSDGS__DEPTH_LAYER * SSDGS__TILE_LAYER + 64 * micro,
                  own = SSDGS__SHADOW_LAYER * SSDGS__TILE_LAYER + 64 * micro + 16;
        const ssdgs_real *depth = pixels + layer, *dv = gradient + own - 16 + SSDGS__TILE_FOURTH;
        ssdgs_real ray[32], at[48], slope[48], passed[16], *ddepth = gradient + layer;
        unsigned char asked[16];
        int any = 0;
        for (int i = 0; i < 16; i++) {
            any |= asked[i] = (dv[i] < 0 || dv[i] > 0) && depth[i + 32] > SSDGS__THIN;
            passed[i] = asked[i] ? -1 : 1;
        }
        if (!any) continue;
        ssdgs__places_transmittance(frame, k, light, tile, micro, depth, passed, ray, at, slope);
        for (int i = 0; i < 16; i++) {
            const ssdgs_real cover = depth[i + 32], z = depth[i] / cover;
            ssdgs_real along = 0;
            if (!asked[i]) continue;
            if (passed[i] < 0) { /* it is the Gaussians' */
                gradient[own + i] += dv[i] / cover;
                ddepth[i + 32] -= dv[i] * pixels[own + i] / (cover * cover);
                continue;
            }
            for (int c = 0; c < 3; c++) { /* at = eye + z (x, y, 1) R */
                const ssdgs_real d = dv[i] * slope[i + 16 * c];
                along += d * (k->view[c] * ray[i] + k->view[4 + c] * ray[i + 16] + k->view[8 + c]);
                sums[3 + c] += d;
                sums[6 + c] += d * z * ray[i];
                sums[9 + c] += d * z * ray[i + 16];
                sums[12 + c] += d * z;
            }
            ddepth[i] += along / cover;
            ddepth[i + 32] -= along * z / cover;
        }
    }
}

static void ssdgs__composite_backward_task(void *data, int index) {
    const ssdgs__uncomposite_job *job = (const ssdgs__uncomposite_job *)data;
    const ssdgs_frame *frame = job->frame;
    const ssdgs_splat_view *v = frame->views;
    const ssdgs__kernels *k = frame->context->k;
    const ssdgs__tile tile = ssdgs__tile_of(frame, v, index, 1);
    const size_t plane = (size_t)v->width * (size_t)v->height;
    const int deferred = frame->layer_count > 0, layers = deferred ? SSDGS__LAYERS : 1;
    const int lit = SSDGS__LIGHT_LAYER * SSDGS__TILE_LAYER;
    ssdgs_real *sums = v->tile_sums + (size_t)v->tile_start[index] * job->stride;
    if (!tile.count) return;
    memset(sums, 0, tile.count * job->stride * sizeof *sums);
    ssdgs_real gradient[SSDGS__LAYERS * SSDGS__TILE_LAYER];
    for (int c = 0; c < 4; c++)
        ssdgs__tile_load(&tile, frame->pixel_gradient + plane * (size_t)c, c, gradient);
    ssdgs_real pixels[SSDGS__LAYERS * SSDGS__TILE_LAYER]; /* blended again: to keep them takes memory and more
                                                             time */
    const ssdgs_real *color[SSDGS__LAYERS];
    for (int layer = 0; layer < layers; layer++) color[layer] = ssdgs__layer(frame, layer);
    k->composite(&tile, layers, color, pixels);
    memset(gradient + SSDGS__TILE_LAYER, 0, (size_t)(layers - 1) * SSDGS__TILE_LAYER * sizeof *gradient);
    for (int c = 0; deferred && frame->normal_gradient && c < 4; c++)
        ssdgs__tile_load(&tile, frame->normal_gradient + plane * (size_t)c, c < 3 ? c : 2,
                         gradient + (SSDGS__DEPTH_LAYER + (c < 3)) * SSDGS__TILE_LAYER);
    for (int light = deferred ? frame->light_count - 1 : -1; light >= 0; light--) {
        const ssdgs__lighting *lighting = job->lightings + light;
        const int first = SSDGS__LIGHT_LAYER + SSDGS__PER_LIGHT * light;
        ssdgs_real visibility[SSDGS__TILE_LAYER];
        for (int layer = 0; layer < SSDGS__PER_LIGHT; layer++)
            color[SSDGS__LIGHT_LAYER + layer] = ssdgs__layer(frame, first + layer);
        if (frame->light_count > 1)
            k->composite(&tile, SSDGS__PER_LIGHT, color + SSDGS__LIGHT_LAYER, pixels + lit);
        if (frame->visibility_given)
            ssdgs__tile_load(&tile, frame->pixel_visibility + plane * (size_t)light, 0, visibility);
        else ssdgs__pixel_visibility(frame, lighting, light, &tile, pixels, visibility);
        ssdgs_real *highlight_sums =
            job->highlight_sums +
            ((size_t)index * (size_t)frame->light_count + (size_t)light) * SSDGS__HIGHLIGHT_SUMS;
        k->highlight_backward(lighting, &tile, pixels, visibility, gradient, highlight_sums);
        if (!frame->visibility_given)
            ssdgs__place_backward(frame, lighting, light, &tile, pixels, gradient, highlight_sums);
        if (!light) continue; /* its layers are walked below */
        for (int layer = 0; layer < SSDGS__PER_LIGHT; layer++) {
            const int at = lit + layer * SSDGS__TILE_LAYER;
            ssdgs__gradient_product(pixels + at, gradient + at, 1, 0);
            k->composite_backward(&tile, 1, color + SSDGS__LIGHT_LAYER + layer, gradient + at, pixels + at,
                                  sums, job->stride, first + layer);
        }
    }
    ssdgs__gradient_product(pixels, gradient, layers, 1);
    k->composite_backward(&tile, layers, color, gradient, pixels, sums, job->stride, 0);
}

static void ssdgs__splat_gradient_task(void *data, int index) {
    const ssdgs__uncomposite_job *job = (const ssdgs__uncomposite_job *)data;
    const ssdgs_frame *frame = job->frame;
    const ssdgs_splat_view *v = frame->views;
    const ssdgs_real two_ln2 = (ssdgs_real)(2 * 0.69314718055994531);
    int begin, end;
    ssdgs__bin_range(frame->count, index, &begin, &end);
    for (size_t g = (size_t)begin; g < (size_t)end; g++) {
        const ssdgs_instances of = v->of_gaussian[g];
        const ssdgs_record *r = v->record + g;
        ssdgs_real *d = frame->splat_gradient + SSDGS__SPLAT * g;
        if (!of.count) continue;
        ssdgs_real sum[8];
        memset(sum, 0, sizeof sum);
        for (uint32_t instance = of.first; instance < of.first + of.count; instance++) {
            const uint32_t place = v->instance[instance].place;
            const ssdgs_real *from = v->tile_sums + (size_t)place * job->stride;
            if (!v->tile_seen[place]) continue;
            for (int i = 0; i < 8; i++) sum[i] += from[i];
            for (int layer = 0; layer <= frame->layer_count; layer++) {
                ssdgs_real *to = ssdgs__layer_gradient(frame, layer) + 4 * g;
                for (int i = 0; i < 3; i++) to[i] += from[8 + 4 * layer + i];
            }
        }
        /* ln alpha = ln o - ln(2) (u^2 + w^2), of pixel - centre */
        d[0] = two_ln2 * r->ux * sum[1];
        d[1] = two_ln2 * (r->uy * sum[1] + r->wy * sum[2]);
        for (int i = 2; i < 5; i++) d[i] = two_ln2 * sum[i + 1];
        d[5] = sum[0];
        d[6] = sum[6];
        d[7] = frame->layer_count ? ssdgs__layer_gradient(frame, SSDGS__DEPTH_LAYER)[4 * g] : 0;
    }
}

/* Sums of the tiles -> light, view and ASG gradients. */
static void ssdgs__highlight_gradient(ssdgs_frame *frame, const ssdgs__uncomposite_job *job) {
    const size_t tiles = (size_t)frame->views[0].tiles_x * (size_t)frame->views[0].tiles_y;
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&frame->settings, first);
    for (size_t tile = 0; tile < tiles; tile++)
        for (int light = 0; light < frame->light_count; light++) {
            const size_t at = tile * (size_t)frame->light_count + (size_t)light;
            const ssdgs_real *sum = job->highlight_sums + at * SSDGS__HIGHLIGHT_SUMS;
            for (int i = 0; i < 3 && !light; i++) frame->light_gradient[i] += sum[i];
            ssdgs__eye_backward(frame, sum + 3);
            for (int i = 0; i < 9; i++) frame->view_gradient[4 * (i / 3) + i % 3] += sum[6 + i];
            for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
                for (int i = 0; i < 2; i++)
                    frame->global_gradient[first[SSDGS__ASG_SHARPNESS] + (size_t)(2 * j + i)] +=
                        sum[15 + 2 * j + i];
                frame->global_gradient[first[SSDGS__ASG_SIGMA] + (size_t)j] +=
                    sum[15 + 2 * SSDGS_ASG_COUNT + j];
            }
        }
}

static SSDGS__TRAINING ssdgs_result ssdgs__composite_backward(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    ssdgs_splat_view *v = frame->views;
    ssdgs__view_memory *m = (ssdgs__view_memory *)frame->memory->view_memory.memory;
    const size_t n = (size_t)frame->count + SSDGS__BLOCK, tiles = (size_t)v->tiles_x * (size_t)v->tiles_y;
    const size_t sums = tiles * (size_t)frame->light_count * SSDGS__HIGHLIGHT_SUMS;
    ssdgs__uncomposite_job job;
    memset(&job, 0, sizeof job);
    job.frame = frame;
    job.stride = 8 + 4 * (size_t)(1 + frame->layer_count);
    if (frame->layer_count) {
        job.lightings = ssdgs__pixel_lightings(frame, 0);
        SSDGS__RESERVE(frame->scratch->highlight_sums, job.highlight_sums, ssdgs_real, sums);
        memset(job.highlight_sums, 0, sums * sizeof *job.highlight_sums);
        memset(frame->layer_gradient, 0, n * 4 * (size_t)frame->layer_count * sizeof(ssdgs_real));
    }
    SSDGS__RESERVE(m->sums, v->tile_sums, ssdgs_real, (v->instances + 1) * job.stride);
    memset(frame->splat_gradient, 0, n * SSDGS__SPLAT * sizeof(ssdgs_real));
    memset(frame->color_gradient, 0, n * 4 * sizeof(ssdgs_real));
    memset(frame->global_gradient, 0, frame->model->global_count * sizeof(ssdgs_real));
    memset(frame->light_gradient, 0, sizeof frame->light_gradient);
    memset(frame->view_gradient, 0, sizeof frame->view_gradient);
    memset(frame->ambient_gradient, 0, sizeof frame->ambient_gradient);
    ssdgs__parallel(context, (int)tiles, ssdgs__composite_backward_task, &job);
    ssdgs__parallel(context, SSDGS__BIN_CHUNKS, ssdgs__splat_gradient_task, &job);
    if (frame->layer_count) ssdgs__highlight_gradient(frame, &job);
    return SSDGS_OK;
}

static void ssdgs__project_backward_task(void *data, int chunk) {
    const ssdgs_frame *frame = (const ssdgs_frame *)data;
    const ssdgs__projection p = ssdgs__projection_of(frame, frame->objects, frame->views);
    const size_t begin = (size_t)chunk * SSDGS__CHUNK, n = (size_t)frame->count,
                 end = begin + SSDGS__CHUNK < n ? begin + SSDGS__CHUNK : n;
    const ssdgs__project_gradient d = {frame->splat_gradient, frame->gradient, frame->gaussians.stride,
                                       (ssdgs_real *)frame->scratch->view_slots.memory + 12 * (size_t)chunk};
    frame->context->k->project_backward(&p, frame->gaussians.gaussians, frame->gaussians.stride, begin, end,
                                        &d);
}

static SSDGS__TRAINING ssdgs_result ssdgs__project_backward(ssdgs_frame *frame) {
    ssdgs_context *context = frame->context;
    const int chunks = ssdgs__chunks(frame->count);
    ssdgs_real *slots;
    SSDGS__RESERVE(frame->scratch->view_slots, slots, ssdgs_real, 12 * (size_t)chunks + 12);
    ssdgs__parallel(context, chunks, ssdgs__project_backward_task, frame);
    for (int i = 0; i < chunks; i++)
        for (int j = 0; j < 12; j++) frame->view_gradient[j] += slots[12 * i + j];
    return SSDGS_OK;
}

/* ==== >>render  the stages in order ==== */

/* Runs each stage's hook or the CPU's version, then fills ssdgs_image. Public: ssdgs_render(),
   ssdgs_stage_cpu(). */

SSDGS_API ssdgs_result ssdgs_stage_cpu(ssdgs_frame *frame, ssdgs_stage stage) {
    if (!frame) return SSDGS_ERR_ARGUMENT;
    switch (stage) {
    case SSDGS_STAGE_PROJECT: return ssdgs__project(frame);
    case SSDGS_STAGE_SORT: return ssdgs__sort(frame);
    case SSDGS_STAGE_BIN: return ssdgs__bin(frame);
    case SSDGS_STAGE_WALK: return ssdgs__walk(frame);
    case SSDGS_STAGE_SHADE: return ssdgs__shade(frame);
    case SSDGS_STAGE_COMPOSITE: return ssdgs__composite_tiles(frame, frame->color, frame->pixels), SSDGS_OK;
#ifndef SSDGS_NO_TRAINER
    case SSDGS_STAGE_COMPOSITE_BACKWARD: return ssdgs__composite_backward(frame);
    case SSDGS_STAGE_SHADE_BACKWARD: return ssdgs__shade_backward(frame);
    case SSDGS_STAGE_PROJECT_BACKWARD: return ssdgs__project_backward(frame);
#endif
    default: return SSDGS_ERR_ARGUMENT;
    }
}

SSDGS_API ssdgs_result ssdgs_context_fail(ssdgs_context *context, ssdgs_result result, const char *message) {
    if (!context || !message) return SSDGS_ERR_ARGUMENT;
    return ssdgs__fail(context, result, "%s", message);
}

static ssdgs_result ssdgs__run_each(ssdgs_frame *frame, int first, int last) {
    static const char *const names[SSDGS_STAGE_COUNT] = {"project",
                                                         "sort",
                                                         "bin",
                                                         "walk",
                                                         "shade",
                                                         "composite",
                                                         "composite backward",
                                                         "shade backward",
                                                         "project backward"};
    const ssdgs_gpu_hook *gpu = &frame->context->gpu;
    const ssdgs_tracer *tracer = &frame->context->tracer;
    ssdgs_result result = SSDGS_OK;
    for (int stage = first; stage <= last && !result; stage++) {
        if (tracer->stage) tracer->stage(tracer->user, names[stage]);
        if (gpu->stage[stage]) result = gpu->stage[stage](gpu->user, frame);
        else {
            if (gpu->fetch) result = gpu->fetch(gpu->user, frame, (ssdgs_stage)stage);
            if (!result) result = ssdgs_stage_cpu(frame, (ssdgs_stage)stage);
        }
        if (tracer->stage) tracer->stage(tracer->user, NULL);
    }
    return result;
}

/* The stages up to WALK run once per batch of views; later stages need little of their memory. A batch has
   the lights that fit SSDGS__BATCH_BYTES, at least one. */
static ssdgs_result ssdgs__run_stages(ssdgs_frame *frame, int first, int last) {
    const ssdgs_gpu_hook *gpu = &frame->context->gpu;
    ssdgs__frame_memory *m = frame->memory;
    const int walks = last < SSDGS_STAGE_WALK ? last : SSDGS_STAGE_WALK, finds = first <= walks;
    const size_t room = SSDGS__BATCH_BYTES / (80 * ((size_t)frame->count + 1));
    ssdgs_result result = SSDGS_OK;
    frame->last = (ssdgs_stage)last;
    for (int begin = 0, end; finds && !result && begin < frame->view_count; begin = end) {
        for (end = begin + 1; end < frame->view_count; end++) {
            const int within = end > 1 && frame->views[end].light == frame->views[end - 1].light;
            if (!within && (size_t)(end - begin) >= room) break;
        }
        frame->batch[0] = begin;
        frame->batch[1] = end;
        result = ssdgs__run_each(frame, first, walks);
    }
    if (!result)
        result = ssdgs__run_each(frame, first > SSDGS_STAGE_WALK ? first : SSDGS_STAGE_WALK + 1, last);
    if (!result && gpu->fetch) result = gpu->fetch(gpu->user, frame, SSDGS_STAGE_COUNT);
    if (finds) {
        for (int i = 1; i < frame->view_count;
             i++) { /* a hook may have found less there than was made once */
            ssdgs__light_memory *own = ssdgs__light_memories(frame) + frame->views[i].light;
            if (!frame->views[i].cached) own->made = own->wanted;
        }
        m->ready = !result && !frame->training;
        m->mapped = m->ready && frame->maps ? frame->light_count : 0;
        m->bias = frame->bias[1];
    }
    return result;
}

typedef struct ssdgs__rows_job {
    const ssdgs_frame *frame;
    const ssdgs_real *planes;
    ssdgs_real *out, background[3];
    int channels, shows; /* 1: where there is nothing, this is not 0 */
} ssdgs__rows_job;

static void ssdgs__rows_task(void *data, int index) {
    const ssdgs__rows_job *job = (const ssdgs__rows_job *)data;
    const ssdgs_frame *frame = job->frame;
    const int w = frame->camera.width, h = frame->camera.height, n = job->channels;
    const int end = (index + 1) * SSDGS__BAND < h ? (index + 1) * SSDGS__BAND : h;
    const size_t plane = (size_t)w * (size_t)h;
    const unsigned char *empty = frame->empty;
    for (int y = index * SSDGS__BAND; y < end; y++) {
        const ssdgs_real *t = frame->transmittance + (size_t)y * (size_t)w,
                         *from = job->planes ? job->planes + (size_t)y * (size_t)w : NULL;
        ssdgs_real *row = job->out + (size_t)y * (size_t)frame->stride * (size_t)n;
        const unsigned char *tiles = empty ? empty + (size_t)(y / 16) * (size_t)((w + 15) / 16) : NULL;
        for (int x = 0, next; x < w; x = next) { /* so many that are all empty, or none is */
            const int nothing = tiles && tiles[x / 16];
            for (next = x / 16 * 16 + 16; tiles && next < w && tiles[next / 16] == nothing; next += 16) {}
            next = tiles && next < w ? next : w;
            ssdgs_real *to = row + (size_t)(n * x);
            if (nothing && !job->shows) memset(to, 0, (size_t)(n * (next - x)) * sizeof *to);
            else
                for (int i = x; i < next; i++, to += n)
                    for (int c = 0; c < n; c++) {
                        const ssdgs_real own = !from ? 1 : nothing ? 0 : from[plane * (size_t)c + (size_t)i];
                        to[c] = own + (nothing ? 1 : t[i]) * job->background[c];
                    }
        }
    }
}

/* Planes, one or three, to the caller's rows: out[y][x][c] = plane_c + transmittance x background_c. A plane
   of NULL is 1. */
static void ssdgs__write_rows(const ssdgs_frame *frame, const ssdgs_real *planes, int channels,
                              const ssdgs_real *background, ssdgs_real *out) {
    ssdgs__rows_job job = {frame, planes, out, {0, 0, 0}, channels, 0};
    if (background) memcpy(job.background, background, sizeof job.background);
    for (int c = 0; c < channels; c++) {
        const ssdgs_real there = (planes ? 0 : 1) + job.background[c];
        job.shows |= there < 0 || there > 0;
    }
    ssdgs__parallel(frame->context, (frame->camera.height + SSDGS__BAND - 1) / SSDGS__BAND, ssdgs__rows_task,
                    &job);
}

/* Three planes of a frame whose light is deferred: 0 diffuse, 1 specular, 2 scattering, 3 the normal, 4 S,
   depth. */
static void ssdgs__deferred_component(const ssdgs_frame *frame, int component, ssdgs_real *planes) {
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height;
    const ssdgs_real *depth = ssdgs__layer_plane(frame, SSDGS__DEPTH_LAYER, 0);
    for (int c = 0; c < 3; c++) {
        const ssdgs_real *scattering = ssdgs__layer_plane(frame, 0, c),
                         *all = frame->pixels + pixels * (size_t)c;
        const ssdgs_real *normal = ssdgs__layer_plane(frame, SSDGS__DEPTH_LAYER + 1, c);
        ssdgs_real *to = planes + pixels * (size_t)c;
        for (size_t i = 0; i < pixels; i++)
            to[i] = component == 1             ? all[i] - scattering[i]
                    : component == 2           ? scattering[i]
                    : component == 3           ? normal[i]
                    : component == 4 && c == 1 ? depth[i]
                                               : 0;
        for (int light = 0; light < frame->light_count; light++) {
            const ssdgs_real *shadow = frame->pixel_shadow + pixels * (size_t)light;
            const ssdgs_real *d =
                ssdgs__layer_plane(frame, SSDGS__DIFFUSE_LAYER + SSDGS__PER_LIGHT * light, c);
            for (size_t i = 0; i < pixels && component < 2; i++)
                to[i] += (component ? -d[i] : d[i]) * shadow[i];
            for (size_t i = 0; i < pixels && component == 4 && c == 0; i++)
                to[i] += shadow[i] * (1 - frame->transmittance[i]) / (ssdgs_real)frame->light_count;
        }
    }
}

static void ssdgs__render_statistics(const ssdgs_frame *frame, ssdgs_render_stats *stats) {
    double done = 0, all = 0;
    stats->visible = frame->views[0].visible;
    stats->shaded = frame->shaded_count;
    stats->camera_cached = frame->views[0].cached > 0;
    for (int l = 0; frame->view_count > 1 && l < frame->light_count; l++) {
        const ssdgs__light_memory *light = ssdgs__light_memories(frame) + l;
        stats->lights_cached += light->kept;
        stats->light_views += light->wanted ? light->views : 0;
    }
    for (int i = 0; i < frame->count; i++) stats->skipped += frame->seen[i] == SSDGS_SKIPPED;
    for (int c = 0; c < SSDGS__SLOTS; c++) {
        const uint64_t *counts = frame->memory->counts + 3 * c;
        done += (double)counts[0];
        all += (double)counts[1];
        stats->shadows_cached += (size_t)counts[2];
    }
    stats->network_work = all > 0 ? done / all : 0;
    stats->instances = frame->views[0].instances;
    stats->light_instances = frame->light_instances;
    for (int i = 0; i < frame->object_count; i++)
        stats->objects +=
            frame->reach ? !ssdgs__out_of_reach(frame, -1, frame->objects + i) : stats->visible > 0;
    for (int i = 0; i < frame->shaded_count; i++)
        stats->blackened += frame->color[4 * (size_t)frame->shaded[i] + 3] > 0;
    for (const ssdgs_placed *o = frame->objects; o < frame->objects + frame->object_count; o++) {
        const ssdgs_model_view *g = &o->gaussians;
        int finite = 1;
        stats->gaussians += g->count;
        for (size_t c = 0; c < SSDGS_DIFFUSE; c++)
            finite = finite &&
                     frame->context->k->within(g->gaussians + c * g->stride, (size_t)g->count, SSDGS__MOST);
        for (size_t i = 0; i < (size_t)g->count && !finite; i++)
            for (size_t c = 0; c < SSDGS_DIFFUSE; c++) {
                const ssdgs_real value = g->gaussians[c * g->stride + i];
                if (ssdgs__finite(value) || (c >= SSDGS_LOG_SCALE && ssdgs__finite(1 / value))) continue;
                stats->rejected++;
                break;
            }
    }
}

/* Runs the stages of a frame that has begun and fills the image. */
static ssdgs_result ssdgs__render(ssdgs_frame *frame, const ssdgs_image *image, ssdgs_render_stats *stats) {
    ssdgs_context *context = frame->context;
    const ssdgs_camera *camera = &frame->camera;
    frame->statistics = stats != NULL;
    SSDGS__TRY(ssdgs__run_stages(frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_COMPOSITE));
    const size_t pixels = (size_t)camera->width * (size_t)camera->height;
    if (image->color) ssdgs__write_rows(frame, frame->pixels, 3, frame->options.background, image->color);
    if (image->median_depth) ssdgs__write_rows(frame, frame->median_depth, 1, NULL, image->median_depth);
    static const ssdgs_real less[3] = {-1, 0, 0};
    if (image->alpha) ssdgs__write_rows(frame, NULL, 1, less, image->alpha);
    ssdgs_real *planes = NULL;
    if (ssdgs__components_asked(image)) SSDGS__RESERVE(frame->scratch->image, planes, ssdgs_real, pixels * 3);
    for (int c = 0; c < 4; c++) {
        ssdgs_real *const to[4] = {image->diffuse, image->specular, image->scattering, image->normal};
        const ssdgs_real *const from[4] = {frame->diffuse, frame->specular, frame->scattering, frame->normal};
        if (!to[c]) continue;
        if (frame->layer_count) ssdgs__deferred_component(frame, c, planes);
        else ssdgs__composite_tiles(frame, from[c], planes);
        ssdgs__write_rows(frame, planes, 3, NULL, to[c]);
    }
    if (image->shadow || image->depth) {
        if (frame->layer_count) ssdgs__deferred_component(frame, 4, planes);
        else ssdgs__composite_tiles(frame, frame->shadow, planes);
        if (image->shadow) ssdgs__write_rows(frame, planes, 1, NULL, image->shadow);
        if (image->depth) ssdgs__write_rows(frame, planes + pixels, 1, NULL, image->depth);
    }
    if (stats) ssdgs__render_statistics(frame, stats);
    return SSDGS_OK;
}

static ssdgs_result ssdgs__render_model(ssdgs_model *model, const ssdgs_camera *camera,
                                        const ssdgs_light *lights, int light_count,
                                        const ssdgs_render_options *options, const ssdgs_image *image,
                                        ssdgs_render_stats *stats) {
    ssdgs_frame frame;
    if (!camera || !image) return ssdgs__null(model->context, "ssdgs_render", camera ? "image" : "camera");
    const ssdgs_object object = ssdgs_object_default(model);
    ssdgs__request request = ssdgs__request_of(&object, 1, camera, lights, light_count, options);
    request.image = image;
    const ssdgs_result result = ssdgs__frame_begin(&frame, model->context, &model->frame, &request);
    return result ? result : ssdgs__render(&frame, image, stats);
}

SSDGS_API ssdgs_result ssdgs_render_ex(ssdgs_model *model, const ssdgs_camera *camera,
                                       const ssdgs_light *lights, int light_count,
                                       const ssdgs_render_options *options, const ssdgs_image *image,
                                       ssdgs_render_stats *stats) {
    if (stats) memset(stats, 0, sizeof *stats);
    SSDGS__GUARD(model, model->context, "ssdgs_render",
                 ssdgs__render_model(model, camera, lights, light_count, options, image, stats));
}

SSDGS_API ssdgs_result ssdgs_render(ssdgs_model *model, const ssdgs_camera *camera, const ssdgs_light *lights,
                                    int light_count, const ssdgs_image *image) {
    return ssdgs_render_ex(model, camera, lights, light_count, NULL, image, NULL);
}

/* ==== >>scene  placed models in one frame, shadows asked for and given ==== */

/* Frames of ssdgs_object, and what comes of ambient light to each Gaussian.
   Placing objects is in >>frame, their maps in >>shadow. */

SSDGS__SMALL_BEGIN

struct ssdgs_scene {
    ssdgs_context *context;
    struct ssdgs__frame_memory *frame; /* of its frames */
    ssdgs_occluder occluder;
    ssdgs__buffer chosen; /* objects of a frame, by levels */
    int maps;             /* 1: light maps have been asked for, so every frame makes them */
};

SSDGS_API ssdgs_object ssdgs_object_default(ssdgs_model *model) {
    ssdgs_object object = ssdgs__object_alone(model);
    if (model && ssdgs__is_placed(&model->settings))
        ssdgs__placement_matrix(&model->settings, object.to_world);
    return object;
}

SSDGS_API ssdgs_result ssdgs_scene_create(ssdgs_context *context, ssdgs_scene **out) {
    if (out) *out = NULL;
    SSDGS__BEGIN(context, context, "ssdgs_scene_create");
    if (!out) return ssdgs__leave(context, ssdgs__null(context, "ssdgs_scene_create", "out"));
    *out = (ssdgs_scene *)ssdgs__allocate(context, sizeof **out);
    if (!*out) return ssdgs__leave(context, SSDGS_ERR_MEMORY);
    (*out)->context = context;
    context->references++;
    return ssdgs__leave(context, SSDGS_OK);
}

SSDGS_API void ssdgs_scene_destroy(ssdgs_scene *scene) {
    if (!scene || SSDGS__ENTER(scene->context, "ssdgs_scene_destroy")) return;
    ssdgs_context *context = scene->context;
    ssdgs__frame_memory_destroy(context, scene->frame);
    ssdgs__release(context, scene->chosen.memory);
    ssdgs__release(context, scene);
    ssdgs__leave_and_drop(context);
}

/* Ends a call on a scene. One that failed leaves no maps: those there are belong to an earlier frame. */
static ssdgs_result ssdgs__scene_leave(ssdgs_scene *scene, ssdgs_result result) {
    if (result && scene->frame) scene->frame->mapped = 0;
    return ssdgs__leave(scene->context, result);
}

/* The Gaussians that an object needs: so many for each pixel of its box, whose shadow's mean area is a
   quarter of its surface (Cauchy). By distance, not depth: the same wherever the camera looks. */
static double ssdgs__needed(const ssdgs_object *o, const ssdgs_camera *camera, double detail) {
    const ssdgs__bounds *b = &o->model->bounds;
    const double side[3] = {b->high[0] - b->low[0], b->high[1] - b->low[1], b->high[2] - b->low[2]};
    const double area = (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]) / 2;
    const double half2 = (side[0] * side[0] + side[1] * side[1] + side[2] * side[2]) / 4;
    const double scale2 = ssdgs__scale2(o->to_world);
    double eye[3], distance2 = 0;
    ssdgs__camera_centre(camera, eye);
    for (int i = 0; i < 3; i++) {
        double at = (double)o->to_world[4 * i + 3] - eye[i];
        for (int j = 0; j < 3; j++) at += (double)o->to_world[4 * i + j] * (b->low[j] + b->high[j]) / 2;
        distance2 += at * at;
    }
    const double z = sqrt(distance2) - sqrt(half2 * scale2); /* of what may be nearest */
    return z > 0
               ? detail * SSDGS__PER_PIXEL * area * scale2 * (double)camera->fx * (double)camera->fy / (z * z)
               : 1e30;
}

/* Puts in the place of objects the levels that their sizes in the picture ask for. Nothing else decides, so
   nothing pops. */
static ssdgs_result ssdgs__choose_levels(ssdgs_scene *scene, const ssdgs_camera *camera,
                                         ssdgs__request *request) {
    ssdgs_context *context = scene->context;
    ssdgs_object *chosen;
    const double detail = (double)(request->options ? request->options->level_detail
                                                    : ssdgs_render_options_default().level_detail);
    int levels = 0, count = 0;
    for (int i = 0; i < request->object_count; i++) levels += request->objects[i].level_count > 0;
    if (!levels || !camera || !(detail > 0)) return SSDGS_OK;
    SSDGS__RESERVE(scene->chosen, chosen, ssdgs_object, request->object_count + levels);
    for (int i = 0; i < request->object_count; i++) {
        ssdgs_object *o = chosen + count++;
        *o = request->objects[i];
        if (!o->level_count || o->mask) continue;
        SSDGS__TRY(ssdgs__model_box(o->model));
        const double needed = ssdgs__needed(o, camera, detail);
        for (int j = 0; j < o->level_count; j++) {
            const double share =
                10 * (o->levels[j]->count / needed - 1); /* the level's; the one before has the rest */
            if (!(share > 0)) break;
            if (share < 1) {
                chosen[count] = *o;
                chosen[count].model = o->levels[j];
                chosen[count++].presence *= (ssdgs_real)share;
                o->presence *= (ssdgs_real)(1 - share);
                break;
            }
            o->model = o->levels[j];
        }
    }
    request->objects = chosen;
    request->object_count = count;
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_scene_render(ssdgs_scene *scene, const ssdgs_object *objects, int object_count,
                                          const ssdgs_camera *camera, const ssdgs_light *lights,
                                          int light_count, const ssdgs_render_options *options,
                                          const ssdgs_image *image, ssdgs_render_stats *stats) {
    ssdgs_frame frame;
    if (stats) memset(stats, 0, sizeof *stats);
    SSDGS__BEGIN(scene, scene->context, "ssdgs_scene_render");
    ssdgs_context *context = scene->context;
    ssdgs_result result = SSDGS_OK;
    if (!camera || !image) result = ssdgs__null(context, "ssdgs_scene_render", camera ? "image" : "camera");
    if (!result) result = ssdgs__objects_check(context, objects, object_count);
    ssdgs__request request = ssdgs__request_of(objects, object_count, camera, lights, light_count, options);
    request.image = image;
    request.maps = scene->maps;
    request.mirrored = 1;
    request.occluder = &scene->occluder;
    if (!result) result = ssdgs__choose_levels(scene, camera, &request);
    if (!result) result = ssdgs__frame_begin(&frame, context, &scene->frame, &request);
    if (!result) result = ssdgs__render(&frame, image, stats);
    return ssdgs__scene_leave(scene, result);
}

SSDGS_API void ssdgs_scene_occlude(ssdgs_scene *scene, const ssdgs_occluder *occluder) {
    if (!scene || SSDGS__ENTER(scene->context, "ssdgs_scene_occlude")) return;
    memset(&scene->occluder, 0, sizeof scene->occluder);
    if (occluder) scene->occluder = *occluder;
    (void)ssdgs__leave(scene->context, SSDGS_OK);
}

/* Projects, sorts, bins and walks what the lights see; the camera's view stays as it is. */
SSDGS_API ssdgs_result ssdgs_scene_light(ssdgs_scene *scene, const ssdgs_object *objects, int object_count,
                                         const ssdgs_camera *camera, const ssdgs_light *lights,
                                         int light_count, const ssdgs_render_options *options) {
    ssdgs_frame frame;
    SSDGS__BEGIN(scene, scene->context, "ssdgs_scene_light");
    ssdgs_result result = ssdgs__objects_check(scene->context, objects, object_count);
    ssdgs__request request = ssdgs__request_of(objects, object_count, NULL, lights, light_count, options);
    request.maps = scene->maps = 1;
    request.mirrored = 1;
    request.occluder = &scene->occluder;
    if (!result) result = ssdgs__choose_levels(scene, camera, &request);
    if (!result) result = ssdgs__frame_begin(&frame, scene->context, &scene->frame, &request);
    if (!result) result = ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK);
    return ssdgs__scene_leave(scene, result);
}

typedef struct ssdgs__shadow_job {
    const ssdgs__kernels *k;
    const ssdgs_splat_view *view, *end; /* the light's */
    const ssdgs_real *points;
    ssdgs_real *fraction, bias;
    int count;
} ssdgs__shadow_job;

static void ssdgs__shadow_task(void *data, int chunk) {
    const ssdgs__shadow_job *job = (const ssdgs__shadow_job *)data;
    const int end = job->count / SSDGS__CHUNK > chunk ? (chunk + 1) * SSDGS__CHUNK : job->count;
    for (int first = chunk * SSDGS__CHUNK; first < end; first += 16) {
        const int count = end - first < 16 ? end - first : 16;
        ssdgs_real at[48], passed[16];
        for (int i = 0; i < 16; i++) { /* the last of them fills up */
            const ssdgs_real *from = job->points + 3 * (size_t)(first + (i < count ? i : count - 1));
            for (int c = 0; c < 3; c++) at[i + 16 * c] = from[c];
            passed[i] = -1;
        }
        ssdgs__light_transmittance(job->k, job->view, job->end, job->bias, at, passed, NULL);
        for (int i = 0; i < count; i++)
            job->fraction[first + i] = passed[i] < 0 ? 1 : passed[i]; /* 1: beside all objects */
    }
}

/* A light's views with maps, from *view up to *end. */
static ssdgs_result ssdgs__mapped_views(const ssdgs_scene *scene, int light, const ssdgs_splat_view **view,
                                        const ssdgs_splat_view **end) {
    ssdgs_context *context = scene->context;
    const ssdgs__frame_memory *m = scene->frame;
    *view = *end = NULL;
    SSDGS__REFUSE(!m || light < 0 || light >= m->mapped,
                  "light %d: ssdgs_scene_light() has made no map of it", light);
    const ssdgs__light_memory *own = (const ssdgs__light_memory *)m->lights.memory + light;
    *view = (const ssdgs_splat_view *)m->views.memory + own->first;
    *end = *view + (own->wanted ? own->views : 0);
    return SSDGS_OK;
}

static ssdgs_result ssdgs__scene_shadow(ssdgs_scene *scene, int light, const ssdgs_real *points, int count,
                                        ssdgs_real *fraction) {
    ssdgs_context *context = scene->context;
    const ssdgs_splat_view *view, *end;
    SSDGS__REFUSE(count < 0 || (count && (!points || !fraction)),
                  count < 0 ? "%d points" : "%d points, but an array is NULL", count);
    SSDGS__TRY(ssdgs__mapped_views(scene, light, &view, &end));
    ssdgs__shadow_job job = {context->k, view, end, points, fraction, scene->frame->bias, count};
    ssdgs__parallel(context, ssdgs__chunks(count), ssdgs__shadow_task, &job);
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_scene_shadow(ssdgs_scene *scene, int light, const ssdgs_real *points, int count,
                                          ssdgs_real *fraction) {
    SSDGS__GUARD(scene, scene->context, "ssdgs_scene_shadow",
                 ssdgs__scene_shadow(scene, light, points, count, fraction));
}

static ssdgs_result ssdgs__scene_light_map(ssdgs_scene *scene, int light, ssdgs_light_map *map, float *a,
                                           float *b) {
    ssdgs_context *context = scene->context;
    const ssdgs_splat_view *v, *end;
    SSDGS__REFUSE(!map || !a != !b, "light's map: %s is NULL", map ? a ? "b" : "a" : "map");
    memset(map, 0, sizeof *map);
    SSDGS__TRY(ssdgs__mapped_views(scene, light, &v, &end));
    for (; v < end && v->light_map; v++) {
        map->size = v->width;
        map->parallel = v->orthographic;
        map->focal = v->fx;
        map->bias = scene->frame->bias;
        memcpy(map->view[map->faces++], v->view, sizeof v->view);
        for (int y = 0; a && y < v->height; y++)
            for (int x = 0; x < v->width; x++, a += 4, b += 4) {
                const uint32_t tile = v->map_tile[y / 16 * v->tiles_x + x / 16];
                const int at = (y & 12) << 4 | (x & 12) << 2 | (y & 3) << 2 | (x & 3);
                ssdgs_light_pixel p = {{SSDGS__NEVER, SSDGS__NEVER, SSDGS__NEVER}, {0, 0}, {0, 0}, 0};
                if (tile != UINT32_MAX) p = v->light_map[(size_t)tile * 256 + (size_t)at];
                for (int i = 0; i < 3; i++) /* 1e30 stays */
                    a[i] = (float)(p.distance[i] + v->nearest);
                a[3] = (float)p.left[0], b[0] = (float)p.left[1], b[3] = (float)p.behind;
                b[1] = (float)p.before[0], b[2] = (float)p.before[1];
            }
    }
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_scene_light_map(ssdgs_scene *scene, int light, ssdgs_light_map *map, float *a,
                                             float *b) {
    SSDGS__GUARD(scene, scene->context, "ssdgs_scene_light_map",
                 ssdgs__scene_light_map(scene, light, map, a, b));
}

/* ---- light from all around ---- */

/* Adds to the shares those of one direction, and its weights to `sums`. */
static ssdgs_result ssdgs__sky_shares_from(ssdgs_model *model, ssdgs__frame_memory **memory,
                                           const ssdgs_real direction[3], ssdgs_real *sky_share,
                                           ssdgs_real *sums) {
    const ssdgs_object object = ssdgs__object_alone(model);
    const ssdgs_render_options options = ssdgs_render_options_preview();
    static const ssdgs_real even[3] = {1, 1, 1};
    const ssdgs_real along[3] = {-direction[0], -direction[1], -direction[2]};
    const ssdgs_light light = ssdgs_light_directional(along, even);
    ssdgs__request request = ssdgs__request_of(&object, 1, NULL, &light, 1, &options);
    request.maps = 1;
    ssdgs_frame frame;
    ssdgs_result result = ssdgs__frame_begin(&frame, model->context, memory, &request);
    if (!result) result = ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK);
    for (int i = 0; !result && i < model->count; i++) {
        ssdgs_real raw[4], q[4], r[9];
        for (size_t c = 0; c < 4; c++)
            raw[c] = model->gaussians[(SSDGS_FRAME + c) * model->capacity + (size_t)i];
        ssdgs__rotation_scalar(raw, q, r);
        const ssdgs_real facing = r[2] * direction[0] + r[5] * direction[1] + r[8] * direction[2];
        if (!(facing > 0)) continue;
        sky_share[i] += facing * frame.visibility[i];
        sums[i] += facing;
    }
    return result;
}

/* sky_share (2 x room): the share of an even sky that reaches each Gaussian, by light walks from an
   icosahedron's corners. The second half is scratch. */
static ssdgs_result ssdgs__sky_shares(ssdgs_model *model, size_t room, ssdgs_real *sky_share) {
    static const ssdgs_real a = (ssdgs_real)0.5257311121191336, b = (ssdgs_real)0.85065080835204;
    ssdgs__frame_memory *memory = NULL;
    ssdgs_result result = SSDGS_OK;
    ssdgs_real *sums = sky_share + room;
    memset(sky_share, 0, 2 * room * sizeof *sums);
    for (int i = 0; i < 12 && !result; i++) {
        ssdgs_real direction[3];
        direction[i / 4] = 0;
        direction[(i / 4 + 1) % 3] = i & 1 ? -a : a;
        direction[(i / 4 + 2) % 3] = i & 2 ? -b : b;
        result = ssdgs__sky_shares_from(model, &memory, direction, sky_share, sums);
    }
    ssdgs__frame_memory_destroy(model->context, memory);
    for (int i = 0; i < model->count && !result; i++) sky_share[i] = sums[i] > 0 ? sky_share[i] / sums[i] : 1;
    return result;
}

/* Finds the share of an even sky of each of an object's Gaussians, unless they are known. */
static ssdgs_result ssdgs__sky_shares_of(ssdgs_placed *o) {
    ssdgs_model *model = o->model;
    ssdgs_context *context = model->context;
    if (o->settings.baked) return SSDGS_OK;
    ssdgs_real *sky_share;
    SSDGS__RESERVE(model->sky_share, sky_share, ssdgs_real, 2 * model->capacity);
    o->sky_share = sky_share;
    if (model->sky_share_revision == model->revision) return SSDGS_OK;
    const ssdgs_result result = ssdgs__sky_shares(model, model->capacity, sky_share);
    if (!result) model->sky_share_revision = model->revision;
    return result;
}

static ssdgs_result ssdgs__model_bounds(ssdgs_model *model, ssdgs_real low[3], ssdgs_real high[3]) {
    ssdgs_context *context = model->context;
    const ssdgs_object object = ssdgs__object_alone(model);
    ssdgs_placed placed;
    if (!low || !high) return ssdgs__null(context, "ssdgs_model_bounds", low ? "high" : "low");
    SSDGS__TRY(ssdgs__model_box(model));
    const ssdgs__bounds bounds = model->bounds; /* without strays, of balls: too wide */
    ssdgs__place(&object, &placed);
    ssdgs_real least[3] = {0, 0, 0}, most[3] = {0, 0, 0};
    for (int i = 0, none = 1; i < model->count; i++) {
        const ssdgs_real *p = model->gaussians + i;
        double box[6], log_scale;
        ssdgs_real raw[4], q[4], r[9];
        if (!ssdgs__gaussian_box(&placed, i, -21, box, box + 3, &log_scale)) continue;
        for (size_t c = 0; c < 4; c++) raw[c] = p[(SSDGS_ROTATION + c) * model->capacity];
        ssdgs__rotation_scalar(raw, q, r);
        for (size_t j = 0; j < 3; j++) {
            ssdgs_real variance = 0, at = p[(SSDGS_POSITION + j) * model->capacity];
            for (size_t c = 0; c < 3; c++) {
                const ssdgs_real s = ssdgs__exp_scalar(p[(SSDGS_LOG_SCALE + c) * model->capacity]);
                variance += r[3 * j + c] * r[3 * j + c] * s * s;
            }
            const ssdgs_real reach = 3 * SSDGS__SQRT(variance);
            least[j] = none || at - reach < least[j] ? at - reach : least[j];
            most[j] = none || at + reach > most[j] ? at + reach : most[j];
        }
        none = 0;
    }
    for (int j = 0; j < 3; j++) {
        const int cut = bounds.count > 0; /* else all are too faint to draw */
        low[j] = !cut || least[j] > (ssdgs_real)bounds.low[j] ? least[j] : (ssdgs_real)bounds.low[j];
        high[j] = !cut || most[j] < (ssdgs_real)bounds.high[j] ? most[j] : (ssdgs_real)bounds.high[j];
    }
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_model_bounds(ssdgs_model *model, ssdgs_real low[3], ssdgs_real high[3]) {
    SSDGS__GUARD(model, model->context, "ssdgs_model_bounds", ssdgs__model_bounds(model, low, high));
}

SSDGS__SMALL_END

/* ==== >>loss  0.8 L1 + 0.2 (1 - SSIM) with its gradient, transfer curve, metrics ==== */

/* Reads images of stored values. Writes loss, gradient, bytes and metrics. Called by the trainer and by
   users. */

#if SSDGS__X86 && (defined(__x86_64__) || defined(_M_X64))
#define SSDGS__SRGB_ENCODE ssdgs__srgb_encode_sse2 /* the widest that needs no look at the CPU */
#elif SSDGS__NEON
#define SSDGS__SRGB_ENCODE ssdgs__srgb_encode_neon
#elif SSDGS__WASM
#define SSDGS__SRGB_ENCODE ssdgs__srgb_encode_wasm
#else
#define SSDGS__SRGB_ENCODE ssdgs__srgb_encode_scalar
#endif

SSDGS_API int ssdgs_finite(ssdgs_real x) { return ssdgs__finite(x); }

SSDGS_API ssdgs_real ssdgs_srgb_encode(ssdgs_real linear) {
    ssdgs_real out = linear;
    if (ssdgs__finite(linear)) ssdgs__srgb_encode_scalar(&out, NULL, &linear, 1);
    return out;
}

SSDGS_API ssdgs_real ssdgs_srgb_decode(ssdgs_real encoded) {
    ssdgs_real out = encoded;
    if (ssdgs__finite(encoded)) ssdgs__srgb_decode_scalar(&out, &encoded, 1);
    return out;
}

/* sRGB bytes of 0 .. 1 in 8192 equal parts, the last one half as wide. A part has the byte of its middle, at
   most 0.2 of a byte off at its ends. */
#define SSDGS__PARTS 8192
#define SSDGS__PART_SCALE ((ssdgs_real)(SSDGS__PARTS - 0.5))

static void ssdgs__bytes_make(unsigned char bytes[SSDGS__PARTS]) {
    ssdgs_real begin[256];
    int at = 0;
    for (int byte = 0; byte < 256; byte++)
        begin[byte] = ((ssdgs_real)byte + (ssdgs_real)0.5) / 255; /* of the next */
    ssdgs__srgb_decode_scalar(begin, begin, 256);
    for (int byte = 0; byte < 256; byte++) {
        const int end = byte < 255 ? (int)(begin[byte] * SSDGS__PART_SCALE + (ssdgs_real)0.5) : SSDGS__PARTS;
        memset(bytes + at, byte, (size_t)(end - at));
        at = end;
    }
}

/* A value's byte: by the table, else linear; NaN gives 0. */
static SSDGS__INLINE unsigned char ssdgs__byte(const unsigned char *table, ssdgs_real value) {
    value = value > 0 ? value : 0;
    value = value < 1 ? value : 1;
    return table ? table[(int)(value * SSDGS__PART_SCALE)] : (unsigned char)(value * 255 + (ssdgs_real)0.5);
}

SSDGS_API void ssdgs_to_bytes(const ssdgs_real *values, size_t count, int transfer, unsigned char *bytes) {
    if (!values || !bytes) return;
    unsigned char table[SSDGS__PARTS];
    const int srgb = transfer == SSDGS_TRANSFER_SRGB;
    if (srgb) ssdgs__bytes_make(table);
    for (size_t i = 0; i < count; i++) bytes[i] = ssdgs__byte(srgb ? table : NULL, values[i]);
}

/* IEEE half precision, to the nearest, ties to even. */
static uint16_t ssdgs__half(float value) {
    uint32_t bits, low;
    memcpy(&bits, &value, sizeof bits);
    const uint32_t sign = bits >> 16 & 0x8000u, rest = bits & 0x7FFFFFFFu;
    if (rest >= 0x47800000u) return (uint16_t)(sign | (rest > 0x7F800000u ? 0x7E00u : 0x7C00u));
    if (rest >= 0x38800000u)
        return (uint16_t)(sign | ((rest + 0xFFF + (rest >> 13 & 1) - 0x38000000u) >> 13));
    const float shifted =
        (value < 0 ? -value : value) + 0.5f; /* which leaves the bits that a subnormal has */
    memcpy(&low, &shifted, sizeof low);
    return (uint16_t)(sign | (low - 0x3F000000u));
}

static float ssdgs__from_half(uint16_t half) {
    const uint32_t exponent = half >> 10 & 31, rest = half & 1023;
    const uint32_t bits = (exponent + (exponent < 31 ? 112u : 224u)) << 23 | rest << 13;
    float value;
    memcpy(&value, &bits, sizeof value);
    if (!exponent) value = (float)rest / 16777216;
    return half & 0x8000 ? -value : value;
}

/* Linear colour and alpha of a framebuffer's pixel, and back. */
typedef struct ssdgs__framebuffer {
    int place[3], size;          /* of red, green, blue in a pixel of bytes; bytes of a pixel */
    const unsigned char *encode; /* NULL: bytes are linear */
    unsigned char bytes[SSDGS__PARTS];
    ssdgs_real decode[256];
} ssdgs__framebuffer;

static void ssdgs__framebuffer_make(ssdgs__framebuffer *f, int transfer, ssdgs_format format) {
    for (int c = 0; c < 3; c++) f->place[c] = format == SSDGS_BGRA8 ? 2 - c : c;
    f->size = format == SSDGS_RGBA32F ? 16 : format == SSDGS_RGBA16F ? 8 : 4;
    f->encode = transfer == SSDGS_TRANSFER_SRGB ? f->bytes : NULL;
    if (f->size > 4) return;
    if (f->encode) ssdgs__bytes_make(f->bytes);
    for (int i = 0; i < 256; i++) f->decode[i] = (ssdgs_real)(i / 255.0);
    if (f->encode) ssdgs__srgb_decode_scalar(f->decode, f->decode, 256);
}

static void ssdgs__pixel_get(const ssdgs__framebuffer *f, const unsigned char *from, ssdgs_real rgba[4]) {
    uint16_t half[4];
    float wide[4];
    if (f->size == 4) {
        for (int c = 0; c < 3; c++) rgba[c] = f->decode[from[f->place[c]]];
        rgba[3] = (ssdgs_real)from[3] / 255;
        return;
    }
    if (f->size == 8) memcpy(half, from, sizeof half);
    else memcpy(wide, from, sizeof wide);
    for (int c = 0; c < 4; c++) rgba[c] = (ssdgs_real)(f->size == 8 ? ssdgs__from_half(half[c]) : wide[c]);
}

static void ssdgs__pixel_put(const ssdgs__framebuffer *f, const ssdgs_real rgba[4], unsigned char *to) {
    uint16_t half[4];
    float wide[4];
    if (f->size == 4) {
        for (int c = 0; c < 3; c++) to[f->place[c]] = ssdgs__byte(f->encode, rgba[c]);
        to[3] = ssdgs__byte(NULL, rgba[3]);
        return;
    }
    for (int c = 0; c < 4; c++) {
        wide[c] = (float)rgba[c];
        half[c] = f->size == 8 ? ssdgs__half(wide[c]) : 0;
    }
    if (f->size == 8) memcpy(to, half, sizeof half);
    else memcpy(to, wide, sizeof wide);
}

typedef struct ssdgs__pixels_job {
    ssdgs__framebuffer f;
    const ssdgs_image *image;
    int width, height, blend, straight;
    unsigned char *pixels;
    ptrdiff_t pitch;
} ssdgs__pixels_job;

static void ssdgs__pixels_task(void *data, int index) {
    const ssdgs__pixels_job *job = (const ssdgs__pixels_job *)data;
    const ssdgs__framebuffer *f = &job->f;
    for (int y = SSDGS__BAND * index; y < SSDGS__BAND * (index + 1) && y < job->height; y++) {
        const size_t row = (size_t)y * (size_t)(job->image->stride ? job->image->stride : job->width);
        const ssdgs_real *color = job->image->color + 3 * row,
                         *alpha = job->image->alpha ? job->image->alpha + row : NULL;
        unsigned char *to = job->pixels + y * job->pitch;
        for (int x = 0, next; x < job->width; x = next) {
            for (next = x; alpha && next < job->width && !(alpha[next] > 0); next++) {}
            if (!job->blend) memset(to + (size_t)(f->size * x), 0, (size_t)(f->size * (next - x)));
            for (; next < job->width && (!alpha || alpha[next] > 0); next++) {
                unsigned char *pixel = to + (size_t)(f->size * next);
                const ssdgs_real a = alpha ? alpha[next] : 1,
                                 by = job->straight ? 1 / (a > SSDGS__THIN ? a : SSDGS__THIN) : 1;
                ssdgs_real rgba[4] = {0, 0, 0, 0};
                if (job->blend) ssdgs__pixel_get(f, pixel, rgba);
                for (int c = 0; c < 3; c++)
                    rgba[c] = job->blend ? color[3 * next + c] + (1 - a) * rgba[c] : color[3 * next + c] * by;
                rgba[3] = job->blend ? a + (1 - a) * rgba[3] : a;
                ssdgs__pixel_put(f, rgba, pixel);
            }
        }
    }
}

static void ssdgs__pixels(ssdgs_context *context, const ssdgs_image *image, int width, int height,
                          int transfer, int format, int blend, void *pixels, ptrdiff_t pitch) {
    ssdgs__pixels_job job;
    if (!image || !image->color || !pixels) return;
    ssdgs__framebuffer_make(&job.f, transfer, (ssdgs_format)(format & ~SSDGS_PREMULTIPLIED));
    job.image = image;
    job.width = width;
    job.height = height;
    job.blend = blend;
    job.straight = !blend && !(format & SSDGS_PREMULTIPLIED);
    job.pixels = (unsigned char *)pixels;
    job.pitch = pitch;
    const int tasks = height > 0 ? (height - 1) / SSDGS__BAND + 1 : 0;
    const int pooled = context && !ssdgs__enter(context, NULL);
    if (pooled) ssdgs__parallel(context, tasks, ssdgs__pixels_task, &job);
    for (int i = 0; i < tasks && !pooled; i++) ssdgs__pixels_task(&job, i);
    if (pooled) (void)ssdgs__leave(context, SSDGS_OK);
}

SSDGS_API void ssdgs_to_pixels(ssdgs_context *context, const ssdgs_image *image, int width, int height,
                               int transfer, int format, void *pixels, ptrdiff_t pitch) {
    ssdgs__pixels(context, image, width, height, transfer, format, 0, pixels, pitch);
}

SSDGS_API void ssdgs_blend_pixels(ssdgs_context *context, const ssdgs_image *image, int width, int height,
                                  int transfer, int format, void *pixels, ptrdiff_t pitch) {
    ssdgs__pixels(context, image, width, height, transfer, format, 1, pixels, pitch);
}

SSDGS_API void ssdgs_compose(const ssdgs_real *color, const ssdgs_real *alpha, size_t pixels, int transfer,
                             const ssdgs_real background[3], ssdgs_real *stored) {
    enum { part = 240 }; /* values at a time: whole pixels and whole vectors */
    ssdgs_real straight[part], encoded[part];
    if (!color || !alpha || !background || !stored) return;
    for (; pixels; color += part, stored += part, alpha += part / 3, pixels -= part / 3) {
        const int n = pixels < part / 3 ? 3 * (int)pixels : part;
        for (int i = 0; i < part; i++)
            straight[i] = i < n ? color[i] / (alpha[i / 3] > SSDGS__THIN ? alpha[i / 3] : SSDGS__THIN) : 0;
        if (transfer == SSDGS_TRANSFER_SRGB) SSDGS__SRGB_ENCODE(encoded, NULL, straight, part);
        else memcpy(encoded, straight, sizeof encoded);
        for (int i = 0; i < n; i++)
            stored[i] = alpha[i / 3] * encoded[i] + (1 - alpha[i / 3]) * background[i % 3];
        if (n < part) return;
    }
}

#ifndef SSDGS_NO_TRAINER
typedef struct ssdgs__loss_values {
    double loss, l1, ssim, mse;
} ssdgs__loss_values;

typedef struct ssdgs__loss_job { /* of one channel: a photograph may have many pixels */
    const ssdgs__kernels *k;
    const ssdgs_real *image, *target; /* (h, w) */
    ssdgs_real *gradient;             /* (h, w) */
    ssdgs_real *padded[5];            /* image, target, three derivative planes: (h + 10, stride) */
    ssdgs_real *scratch;              /* (bands, 5, stride) */
    double *sums;                     /* (bands, 3) */
    size_t stride;
    int width, height, bands;
    ssdgs_real by_l1, by_ssim;
} ssdgs__loss_job;

/* Rows of whole vectors with a border of 16 columns. */
static size_t ssdgs__padded_stride(int width) { return (size_t)(width + 15) / 16 * 16 + 32; }

static size_t ssdgs__padded_at(const ssdgs__loss_job *job, int y) { /* row y, column 0 */
    return (size_t)(y + 5) * job->stride + 16;
}

/* Copies a band into the padded planes; the first and last also own the border rows. */
static void ssdgs__loss_pad_task(void *data, int band) {
    const ssdgs__loss_job *job = (const ssdgs__loss_job *)data;
    const int w = job->width, begin = band ? band * SSDGS__BAND : -5,
              end = band == job->bands - 1 ? job->height + 5 : (band + 1) * SSDGS__BAND;
    for (int y = begin; y < end; y++)
        for (int p = 0; p < 5; p++) {
            const ssdgs_real outside =
                p < 2 ? (ssdgs_real)-0.5 : 0; /* black, less the 1/2 the kernel expects */
            const int inside = y >= 0 && y < job->height;
            ssdgs_real *to = job->padded[p] + ssdgs__padded_at(job, y) - 16;
            for (int x = 0; x < 16; x++) to[x] = outside;
            for (int x = 0; x < w && !inside; x++) to[16 + x] = outside;
            for (int x = 16 + w; x < (int)job->stride; x++) to[x] = outside;
            if (!inside || p > 1) continue; /* ssim_row writes the derivatives */
            const ssdgs_real *from = (p ? job->target : job->image) + (size_t)y * (size_t)w;
            for (int x = 0; x < w; x++) to[16 + x] = from[x] - (ssdgs_real)0.5;
        }
}

static ssdgs__ssim_row ssdgs__loss_row(const ssdgs__loss_job *job, int band, int y) {
    const size_t at = ssdgs__padded_at(job, y), scratch = (size_t)band * 5 * job->stride;
    ssdgs_real *const *p = job->padded;
    const ssdgs__ssim_row row = {p[0] + at,   p[1] + at, p[2] + at,
                                 p[3] + at,   p[4] + at, job->scratch + scratch,
                                 job->stride, job->width};
    return row;
}

static void ssdgs__loss_task(void *data, int band) {
    const ssdgs__loss_job *job = (const ssdgs__loss_job *)data;
    const int begin = band * SSDGS__BAND;
    const int end = begin + SSDGS__BAND < job->height ? begin + SSDGS__BAND : job->height;
    for (int i = 0; i < 3; i++) job->sums[3 * band + i] = 0;
    for (int y = begin; y < end; y++) {
        const ssdgs__ssim_row at = ssdgs__loss_row(job, band, y);
        ssdgs_real sums[3];
        job->k->ssim_row(&at, sums);
        for (int i = 0; i < 3; i++) job->sums[3 * band + i] += (double)sums[i];
    }
}

static void ssdgs__loss_backward_task(void *data, int band) {
    const ssdgs__loss_job *job = (const ssdgs__loss_job *)data;
    const int begin = band * SSDGS__BAND;
    const int end = begin + SSDGS__BAND < job->height ? begin + SSDGS__BAND : job->height;
    for (int y = begin; y < end; y++) {
        const ssdgs__ssim_row at = ssdgs__loss_row(job, band, y);
        ssdgs_real *row = at.scratch + 4 * job->stride;
        job->k->ssim_backward_row(&at, job->by_l1, job->by_ssim, row);
        memcpy(job->gradient + (size_t)y * (size_t)job->width, row, (size_t)job->width * sizeof *row);
    }
}

/* Images (3, h, w) of stored values that are compared. */
typedef struct ssdgs__images {
    const ssdgs_real *image, *target;
    int width, height;
} ssdgs__images;

/* gradient (3, h, w) may be NULL. */
static ssdgs_result ssdgs__loss(ssdgs_context *context, ssdgs__buffer *memory, const ssdgs__images *images,
                                ssdgs_real dssim, ssdgs_real *gradient, ssdgs__loss_values *values) {
    const int width = images->width, height = images->height;
    ssdgs__loss_job job;
    const size_t channel = (size_t)width * (size_t)height;
    const double pixels = 3.0 * width * height;
    double sum[3] = {0, 0, 0};
    memset(&job, 0, sizeof job);
    job.k = context->k;
    job.width = width;
    job.height = height;
    job.bands = (height + SSDGS__BAND - 1) / SSDGS__BAND;
    job.stride = ssdgs__padded_stride(width);
    const size_t plane = (size_t)(height + 10) * job.stride, bands = (size_t)job.bands;
    ssdgs_real *at;
    SSDGS__RESERVE(*memory, at, ssdgs_real, 6 * bands + 5 * plane + bands * 5 * job.stride);
    job.sums = (double *)memory->memory;
    at += 6 * bands;
    for (int i = 0; i < 5; i++, at += plane) job.padded[i] = at;
    job.scratch = at;
    job.by_l1 = (ssdgs_real)((1 - (double)dssim) / pixels);
    job.by_ssim = (ssdgs_real)(-(double)dssim / pixels);
    for (size_t c = 0; c < 3; c++) {
        job.image = images->image + c * channel;
        job.target = images->target + c * channel;
        ssdgs__parallel(context, job.bands, ssdgs__loss_pad_task, &job);
        ssdgs__parallel(context, job.bands, ssdgs__loss_task, &job);
        if (gradient) {
            job.gradient = gradient + c * channel;
            ssdgs__parallel(context, job.bands, ssdgs__loss_backward_task, &job);
        }
        for (int i = 0; i < job.bands; i++)
            for (int j = 0; j < 3; j++) sum[j] += job.sums[3 * i + j];
    }
    values->ssim = sum[0] / pixels;
    values->l1 = sum[1] / pixels;
    values->mse = sum[2] / pixels;
    values->loss = (1 - (double)dssim) * values->l1 + (double)dssim * (1 - values->ssim);
    return SSDGS_OK;
}

static double ssdgs__psnr(double mse) { return mse > 1e-10 ? -10 * log10(mse) : 100; }

/* ---- comparing images ---- */

static ssdgs_result ssdgs__compare(ssdgs_context *context, const ssdgs_real *image,
                                   const ssdgs_real *reference, int width, int height,
                                   ssdgs_metrics *metrics) {
    ssdgs__buffer planes = {0, 0}, memory = {0, 0};
    if (!metrics) return ssdgs__null(context, "ssdgs_compare", "metrics");
    memset(metrics, 0, sizeof *metrics);
    if (!image || !reference) return ssdgs__null(context, "ssdgs_compare", image ? "reference" : "image");
    SSDGS__REFUSE(width < 1 || height < 1 || width > SSDGS__MAX_SIDE || height > SSDGS__MAX_SIDE,
                  "compare: images of %d x %d", width, height);
    const size_t pixels = (size_t)width * (size_t)height;
    ssdgs_result result = ssdgs__reserve(context, &planes, pixels, 6 * sizeof(ssdgs_real));
    ssdgs__loss_values values;
    if (!result) {
        ssdgs_real *p = (ssdgs_real *)planes.memory;
        for (size_t i = 0; i < 3 * pixels; i++) {
            ssdgs_real *to = p + pixels * (i % 3) + i / 3;
            to[0] = image[i] > 0 ? (image[i] < 1 ? image[i] : 1) : 0;
            to[3 * pixels] = reference[i] > 0 ? (reference[i] < 1 ? reference[i] : 1) : 0;
        }
        const ssdgs__images images = {p, p + 3 * pixels, width, height};
        result = ssdgs__loss(context, &memory, &images, (ssdgs_real)0.2, NULL, &values);
    }
    if (!result) {
        metrics->psnr = ssdgs__psnr(values.mse);
        metrics->ssim = values.ssim;
    }
    ssdgs__release(context, planes.memory);
    ssdgs__release(context, memory.memory);
    return result;
}

SSDGS_API ssdgs_result ssdgs_compare(ssdgs_context *context, const ssdgs_real *image,
                                     const ssdgs_real *reference, int width, int height,
                                     ssdgs_metrics *metrics) {
    SSDGS__GUARD(context, context, "ssdgs_compare",
                 ssdgs__compare(context, image, reference, width, height, metrics));
}
#endif /* SSDGS_NO_TRAINER */

/* ==== >>ply  model files, files at large ==== */

/* Reads and writes PLY and whole files. Checkpoints use the writer too. */

SSDGS__SMALL_BEGIN

/* A model is one PLY file: element vertex with the Gaussians, then the settings, the ASG bases and the
   weights. One table of properties drives both ways. Reading: the header is matched against the table, a
   survey finds where each element lies and that all of it is there, then the rows of known elements are read
   and mended. */

#ifndef SSDGS_NO_STDIO
#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#ifdef _WIN32
#include <io.h>
#include <process.h>
#else
#include <unistd.h>
#if defined(__STRICT_ANSI__) && !defined(__cplusplus)
int fsync(int file); /* hidden by -std=c99 */
#endif
#endif
#endif

enum {
    SSDGS__PLY_VERTEX = 0,
    SSDGS__PLY_SETTINGS,
    SSDGS__PLY_BASIS,
    SSDGS__PLY_SCATTERING,
    SSDGS__PLY_SHADOW,
    SSDGS__PLY_KINDS
};
static const char *const ssdgs__ply_kinds[SSDGS__PLY_KINDS] = {"vertex", "ssdgs_settings", "asg_basis",
                                                               "scattering_weight", "shadow_weight"};

/* A row is an array of 32-bit words: floats, as bits, or the integers of the settings when they are written.
   A vertex has a trained model's planes first, then what other programs use; settings follow each other;
   globals lie at 4 x group. */
enum {
    SSDGS__PLY_NORMAL = SSDGS_CHANNELS,
    SSDGS__PLY_DC = SSDGS_CHANNELS + 3,
    SSDGS__PLY_REST = SSDGS__PLY_DC + 3,
    SSDGS__PLY_RGB = SSDGS__PLY_REST + 45, /* behind all that is written, settings too */
    SSDGS__PLY_WORDS = SSDGS__PLY_RGB + 3
};

typedef struct ssdgs__ply_field {
    int kind;         /* element */
    const char *stem; /* of the names stem0, stem1, .. */
    int count;        /* of those; 0 = the stem is the name */
    int word;         /* of the first; of a setting where it lies in ssdgs_settings, bytes */
    int type;         /* of a setting: 'i' int, 'r' real; else 0 */
    double before;    /* of a setting, where files of older versions lack it; -1: none may */
} ssdgs__ply_field;

#define SSDGS__V(stem, count, word) \
    { SSDGS__PLY_VERTEX, stem, count, word, 0, -1 }
#define SSDGS__S(member, property, count, type, low, high, standard, published, before) \
    {SSDGS__PLY_SETTINGS, property, count, offsetof(ssdgs_settings, member), type, before},
#define SSDGS__G(kind, stem, count, group) \
    { kind, stem, count, 4 * group, 0, -1 }
/* In the order of the file; red, green, blue are only read. */
static const ssdgs__ply_field ssdgs__ply_fields[] = {
    SSDGS__V("x", 0, SSDGS_POSITION),
    SSDGS__V("y", 0, SSDGS_POSITION + 1),
    SSDGS__V("z", 0, SSDGS_POSITION + 2),
    SSDGS__V("nx", 0, SSDGS__PLY_NORMAL),
    SSDGS__V("ny", 0, SSDGS__PLY_NORMAL + 1),
    SSDGS__V("nz", 0, SSDGS__PLY_NORMAL + 2),
    SSDGS__V("f_dc_", 3, SSDGS__PLY_DC),
    SSDGS__V("f_rest_", 45, SSDGS__PLY_REST),
    SSDGS__V("opacity", 0, SSDGS_OPACITY),
    SSDGS__V("scale_", 3, SSDGS_LOG_SCALE),
    SSDGS__V("rot_", 4, SSDGS_ROTATION),
    SSDGS__V("kd_", 3, SSDGS_DIFFUSE),
    SSDGS__V("ks_", 3, SSDGS_SPECULAR),
    SSDGS__V("ksss_", 3, SSDGS_SCATTERING),
    SSDGS__V("alpha_asg_", SSDGS_ASG_COUNT, SSDGS_ASG_WEIGHT),
    SSDGS__V("local_q_", 4, SSDGS_FRAME),
    SSDGS__V("neural_material_", SSDGS_MATERIAL_COUNT, SSDGS_MATERIAL),
    SSDGS__V("red", 0, SSDGS__PLY_RGB),
    SSDGS__V("green", 0, SSDGS__PLY_RGB + 1),
    SSDGS__V("blue", 0, SSDGS__PLY_RGB + 2),
    SSDGS__SETTINGS(SSDGS__S) /* they follow each other */
    SSDGS__G(SSDGS__PLY_BASIS, "q", 4, SSDGS__ASG_BASIS),
    SSDGS__G(SSDGS__PLY_BASIS, "sharpness", 2, SSDGS__ASG_SHARPNESS),
    SSDGS__G(SSDGS__PLY_BASIS, "sigma", 0, SSDGS__ASG_SIGMA),
    SSDGS__G(SSDGS__PLY_SCATTERING, "value", 0, SSDGS__SCATTERING_NET),
    SSDGS__G(SSDGS__PLY_SHADOW, "value", 0, SSDGS__SHADOW_NET)};
#undef SSDGS__V
#undef SSDGS__S
#undef SSDGS__G

typedef struct ssdgs__ply_cursor { /* walks properties: set field to NULL, then call ssdgs__ply_next */
    const ssdgs__ply_field *field;
    int index, word;
} ssdgs__ply_cursor;

static int ssdgs__ply_next(ssdgs__ply_cursor *cursor, int kind) {
    const ssdgs__ply_field *const end =
        ssdgs__ply_fields + sizeof ssdgs__ply_fields / sizeof *ssdgs__ply_fields;
    const int settings = kind == SSDGS__PLY_SETTINGS, next = cursor->field ? cursor->word + 1 : 0;
    if (cursor->field && cursor->index + 1 < cursor->field->count) {
        cursor->index++;
    } else {
        cursor->index = 0;
        cursor->field = cursor->field ? cursor->field + 1 : ssdgs__ply_fields;
        while (cursor->field < end && cursor->field->kind != kind) cursor->field++;
        if (cursor->field == end) return 0;
    }
    cursor->word = settings ? next : cursor->field->word + cursor->index;
    return 1;
}

/* The name of the property, which it writes to name. */
static const char *ssdgs__ply_name(const ssdgs__ply_cursor *cursor, char name[32]) {
    if (cursor->field->count) snprintf(name, 32, "%s%d", cursor->field->stem, cursor->index);
    return cursor->field->count ? name : cursor->field->stem;
}

/* Where in ssdgs_settings a setting lies: an int or a ssdgs_real. */
static size_t ssdgs__ply_setting(const ssdgs__ply_cursor *cursor) {
    return (size_t)cursor->field->word + (size_t)cursor->index * sizeof(ssdgs_real);
}

/* Where anything else lies. */
static ssdgs_real *ssdgs__ply_cell(const ssdgs_model *model, size_t row, const ssdgs__ply_cursor *cursor) {
    const size_t width = cursor->field->count ? (size_t)cursor->field->count : 1;
    const int dc = cursor->word - SSDGS__PLY_DC;
    if (cursor->field->kind == SSDGS__PLY_VERTEX)
        return model->gaussians +
               (size_t)(dc < 0 ? cursor->word : ssdgs__kept_plane(&model->settings) + dc) * model->capacity +
               row;
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&model->settings, first);
    return model->globals + first[cursor->field->word / 4] + row * width + (size_t)cursor->index;
}

/* Rows of anything but the vertices. */
static size_t ssdgs__ply_rows(const ssdgs_settings *settings, int kind) {
    if (kind == SSDGS__PLY_SETTINGS) return 1;
    return kind == SSDGS__PLY_BASIS ? SSDGS_ASG_COUNT
                                    : ssdgs__network_count(settings, kind == SSDGS__PLY_SHADOW);
}

/* The float nearest to x, as bits, which can be tested whatever -ffast-math assumes. Only what is in range is
   cast. */
static uint32_t ssdgs__ply_bits(double x) {
    uint64_t wide;
    memcpy(&wide, &x, sizeof wide);
    const uint64_t size = wide & UINT64_C(0x7fffffffffffffff);
    uint32_t bits = (uint32_t)((wide ^ size) >> 32);
    if (size > UINT64_C(0x7ff0000000000000)) return bits | 0x7fc00000u;
    if (size > UINT64_C(0x47efffffe0000000))
        return bits | (size < UINT64_C(0x47effffff0000000) ? 0x7f7fffffu : 0x7f800000u);
    float single = (float)x;
    memcpy(&bits, &single, sizeof bits);
    return bits;
}

static double ssdgs__ply_value(uint32_t bits) {
    float single;
    memcpy(&single, &bits, sizeof single);
    return (double)single;
}

static int ssdgs__ply_finite(uint32_t bits) { return (bits & 0x7f800000u) != 0x7f800000u; }

/* ---- reading ---- */

/* Limits of a header */
enum { SSDGS__PLY_MAX_HEADER = 1 << 20, SSDGS__PLY_MAX_ELEMENTS = 64, SSDGS__PLY_MAX_PROPERTIES = 1024 };
enum {
    SSDGS__PLY_UINT8 = 1,
    SSDGS__PLY_UINT16 = 3,
    SSDGS__PLY_FLOAT32 = 6,
    SSDGS__PLY_FLOAT64 = 7,
    SSDGS__PLY_TYPES = 8
}; /* 0, 2, 4 are signed */
static const char *const ssdgs__ply_types[SSDGS__PLY_TYPES][2] = {
    {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
    {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
static const unsigned char ssdgs__ply_sizes[SSDGS__PLY_TYPES] = {1, 1, 2, 2, 4, 4, 4, 8};

typedef enum ssdgs__ply_format {
    SSDGS__PLY_UNKNOWN = 0,
    SSDGS__PLY_ASCII,
    SSDGS__PLY_LITTLE,
    SSDGS__PLY_BIG
} ssdgs__ply_format;

typedef struct ssdgs__ply_token {
    const unsigned char *text;
    size_t length;
} ssdgs__ply_token;

typedef struct ssdgs__ply_property {
    ssdgs__ply_token name;
    int type, list; /* type of the values, of a list's count; -1 = no list */
    int word;       /* -1 = skipped */
} ssdgs__ply_property;

typedef struct ssdgs__ply_element {
    ssdgs__ply_token name;
    size_t count;
    int kind;                                /* -1 = skipped */
    int first, properties;                   /* in ssdgs__ply.properties */
    int lists;                               /* 1: some are lists */
    unsigned char present[SSDGS__PLY_WORDS]; /* 1: a property gives this word */
    const unsigned char *data;
} ssdgs__ply_element;

typedef struct ssdgs__ply {
    ssdgs_context *context;
    const char *name; /* of the file, for messages */
    const unsigned char *begin, *at, *end;
    int version;          /* that wrote it; 0: it does not say */
    double origin[3];     /* to be taken from positions: files up to 0.2.4 have them in the world */
    double color_unit[3]; /* of red, green and blue: by their types */
    ssdgs__ply_format format;
    int newline, line, element_count, property_count;
    int harmonics, interleaved; /* of f_rest: values of each channel; 1: red, green and blue lie together */
    ssdgs__ply_element elements[SSDGS__PLY_MAX_ELEMENTS], *known[SSDGS__PLY_KINDS];
    ssdgs__ply_property properties[SSDGS__PLY_MAX_PROPERTIES];
    const ssdgs__ply_property *bad; /* where a row is broken, and how */
    const char *why;
    size_t behind; /* bytes behind the last element */
} ssdgs__ply;

static int ssdgs__ply_space(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

static int ssdgs__ply_same(ssdgs__ply_token a, ssdgs__ply_token b) {
    return a.length == b.length && memcmp(a.text, b.text, a.length) == 0;
}

static int ssdgs__ply_is(ssdgs__ply_token token, const char *text) {
    return token.length == strlen(text) && memcmp(token.text, text, token.length) == 0;
}

/* The next token before end; an empty one when there is none. */
static ssdgs__ply_token ssdgs__ply_cut(const unsigned char **at, const unsigned char *end) {
    while (*at < end && ssdgs__ply_space(**at)) ++*at;
    ssdgs__ply_token token;
    token.text = *at;
    while (*at < end && !ssdgs__ply_space(**at)) ++*at;
    token.length = (size_t)(*at - token.text);
    return token;
}

/* Decimal digits only; 0 on anything else and on overflow. */
static int ssdgs__ply_count(ssdgs__ply_token token, size_t *count) {
    *count = 0;
    for (size_t i = 0; i < token.length; i++) {
        const unsigned digit = token.text[i] - (unsigned)'0';
        if (digit > 9 || *count > (SIZE_MAX - digit) / 10) return 0;
        *count = *count * 10 + digit;
    }
    return token.length > 0;
}

/* A decimal number, nan or inf, whatever the locale. Seventeen digits count. It is off by less than 1e-15 of
   itself; beyond 1e60 and below 1e-60 it is only large or small. */
static int ssdgs__ply_number(ssdgs__ply_token token, double *number) {
    static const char *const words[3] = {"nan", "inf", "infinity"};
    const unsigned char *p = token.text, *const end = p + token.length;
    int any = 0, point = 0, exponent = 0;
    int negative = 0;
    double value = 0;

    if (token.length == 0 || token.length > 1000) return 0;
    if (*p == '-' || *p == '+') negative = *p++ == '-';
    for (int i = 0; i < 3; i++) { /* by their bits: -ffast-math knows neither */
        const size_t length = strlen(words[i]);
        size_t k = 0;
        while (k < length && p + k < end && (p[k] | 32) == words[i][k]) k++;
        if (k < length || (p + k != end && (i || p[k] != '(' || end[-1] != ')'))) continue; /* nan(ind) */
        uint64_t bits =
            (uint64_t)negative << 63 | (i ? UINT64_C(0x7ff0000000000000) : UINT64_C(0x7ff8000000000000));
        memcpy(number, &bits, sizeof bits);
        return 1;
    }
    for (; p < end && ((*p >= '0' && *p <= '9') || (*p == '.' && !point)); p++) {
        if (*p == '.') {
            point = 1;
        } else {
            any = 1;
            if (value < 1e16) value = value * 10 + (*p - '0'), exponent -= point;
            else exponent += !point;
        }
    }
    if (!any) return 0;
    if (p < end && (*p | 32) == 'e') {
        int minus = 0, given = 0;
        if (++p < end && (*p == '-' || *p == '+')) minus = *p++ == '-';
        if (p == end) return 0;
        for (; p < end && *p >= '0' && *p <= '9'; p++) given = given < 9999 ? given * 10 + (*p - '0') : given;
        exponent += minus ? -given : given;
    }
    while (exponent && value > 1e-60 && value < 1e60) {
        const int step = exponent < 0 ? 1 : -1;
        double power = 1;
        for (; exponent && power < 1e22; exponent += step) power *= 10;
        value = step > 0 ? value / power : value * power;
    }
    *number = negative ? -value : value;
    return p == end;
}

/* The next header line, split at blanks: the number of tokens found (at most 6), -1 when the header does not
   go on. */
static int ssdgs__ply_line(ssdgs__ply *ply, ssdgs__ply_token tokens[6]) {
    const unsigned char *p = ply->at, *line = p, *end = ply->end;
    int count = 0;
    if (end - ply->begin > SSDGS__PLY_MAX_HEADER) end = ply->begin + SSDGS__PLY_MAX_HEADER;
    while (p < end && *p != ply->newline && (ply->newline || (*p != '\r' && *p != '\n'))) p++;
    if (p == end) return -1;
    if (!ply->newline) { /* the first line decides between CR, LF and CRLF: a CR must not swallow a data byte
                            10 */
        if (*p == '\r' && p + 1 < end && p[1] == '\n') p++;
        ply->newline = *p;
    }
    ply->at = p + 1;
    ply->line++;
    for (; count < 6; count++) { /* pcc 1.2.0 makes no member of an assignment's value */
        tokens[count] = ssdgs__ply_cut(&line, p);
        if (!tokens[count].length) break;
    }
    return count;
}

static ssdgs_result ssdgs__ply_refuse(const ssdgs__ply *ply, const char *text) {
    return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: PLY header, line %d: %s", ply->name, ply->line,
                       text);
}

static int ssdgs__ply_type(ssdgs__ply_token token) {
    int type = SSDGS__PLY_TYPES - 1;
    for (; type >= 0; type--)
        if (ssdgs__ply_is(token, ssdgs__ply_types[type][0]) ||
            ssdgs__ply_is(token, ssdgs__ply_types[type][1]))
            break;
    return type;
}

static ssdgs_result ssdgs__ply_add_element(ssdgs__ply *ply, const ssdgs__ply_token *tokens) {
    ssdgs__ply_element *element = ply->elements + ply->element_count;
    if (ply->element_count == SSDGS__PLY_MAX_ELEMENTS) return ssdgs__ply_refuse(ply, "more than 64 elements");
    element->name = tokens[1];
    if (!ssdgs__ply_count(tokens[2], &element->count))
        return ssdgs__ply_refuse(ply, "the count is not a number");
    for (int i = 0; i < ply->element_count; i++)
        if (ssdgs__ply_same(ply->elements[i].name, element->name))
            return ssdgs__ply_refuse(ply, "this name was given before");
    element->first = ply->property_count;
    element->kind = SSDGS__PLY_KINDS - 1;
    while (element->kind >= 0 && !ssdgs__ply_is(element->name, ssdgs__ply_kinds[element->kind]))
        element->kind--;
    if (element->kind >= 0) ply->known[element->kind] = element;
    ply->element_count++;
    return SSDGS_OK;
}

static ssdgs_result ssdgs__ply_add_property(ssdgs__ply *ply, const ssdgs__ply_token *tokens, int list) {
    if (ply->element_count == 0) return ssdgs__ply_refuse(ply, "a property before any element");
    ssdgs__ply_element *element = ply->elements + ply->element_count - 1;
    ssdgs__ply_property *property = ply->properties + ply->property_count;
    if (ply->property_count == SSDGS__PLY_MAX_PROPERTIES)
        return ssdgs__ply_refuse(ply, "more than 1024 properties");
    property->name = tokens[list ? 4 : 2];
    property->type = ssdgs__ply_type(tokens[list ? 3 : 1]);
    property->list = list ? ssdgs__ply_type(tokens[2]) : -1;
    property->word = -1;
    if (property->type < 0 || (list && property->list < 0)) return ssdgs__ply_refuse(ply, "unknown type");
    if (property->list >= SSDGS__PLY_FLOAT32)
        return ssdgs__ply_refuse(ply, "a list's count must be an integer");
    for (int i = element->first; i < ply->property_count; i++)
        if (ssdgs__ply_same(ply->properties[i].name, property->name))
            return ssdgs__ply_refuse(ply, "this name was given before");
    ssdgs__ply_cursor cursor;
    char name[32];
    for (cursor.field = NULL; !list && property->word < 0 && ssdgs__ply_next(&cursor, element->kind);) {
        if (*property->name.text != (unsigned char)*cursor.field->stem)
            continue; /* saves most of the names */
        if (!ssdgs__ply_is(property->name, ssdgs__ply_name(&cursor, name))) continue;
        if (element->kind == SSDGS__PLY_VERTEX && cursor.word >= SSDGS__PLY_RGB) {
            if (property->type < SSDGS__PLY_FLOAT32 && property->type != SSDGS__PLY_UINT8 &&
                property->type != SSDGS__PLY_UINT16)
                continue;
            ply->color_unit[cursor.word - SSDGS__PLY_RGB] = property->type == SSDGS__PLY_UINT8    ? 255
                                                            : property->type == SSDGS__PLY_UINT16 ? 65535
                                                                                                  : 1;
        }
        property->word = cursor.word;
        element->present[cursor.word] = 1;
    }
    element->lists |= list;
    element->properties++;
    ply->property_count++;
    return SSDGS_OK;
}

static ssdgs_result ssdgs__ply_header(ssdgs__ply *ply) {
    ssdgs__ply_token tokens[6];
    ssdgs_result result = SSDGS_OK;
    if (ssdgs__ply_line(ply, tokens) != 1 || !ssdgs__ply_is(tokens[0], "ply"))
        return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: not a PLY file", ply->name);
    while (result == SSDGS_OK) {
        const int count = ssdgs__ply_line(ply, tokens);
        if (count < 0)
            return ssdgs__ply_refuse(ply, ply->end - ply->begin > SSDGS__PLY_MAX_HEADER
                                              ? "the header's end does not follow within 1 MiB"
                                              : "the file ends within the header");
        if (count && (ssdgs__ply_is(tokens[0], "comment") || ssdgs__ply_is(tokens[0], "obj_info"))) continue;
        if (count == 3 && ssdgs__ply_is(tokens[0], "format") && ply->format == SSDGS__PLY_UNKNOWN) {
            if (ssdgs__ply_is(tokens[1], "ascii")) ply->format = SSDGS__PLY_ASCII;
            if (ssdgs__ply_is(tokens[1], "binary_little_endian")) ply->format = SSDGS__PLY_LITTLE;
            if (ssdgs__ply_is(tokens[1], "binary_big_endian")) ply->format = SSDGS__PLY_BIG;
            if (!ply->format || !ssdgs__ply_is(tokens[2], "1.0"))
                return ssdgs__ply_refuse(ply, "unknown format");
        } else if (count == 3 && ssdgs__ply_is(tokens[0], "element")) {
            result = ssdgs__ply_add_element(ply, tokens);
        } else if (count == 5 && ssdgs__ply_is(tokens[0], "property") && ssdgs__ply_is(tokens[1], "list")) {
            result = ssdgs__ply_add_property(ply, tokens, 1);
        } else if (count == 3 && ssdgs__ply_is(tokens[0], "property")) {
            result = ssdgs__ply_add_property(ply, tokens, 0);
        } else if (count == 1 && ssdgs__ply_is(tokens[0], "end_header") && ply->format) {
            return SSDGS_OK;
        } else {
            return ssdgs__ply_refuse(ply, "not understood");
        }
    }
    return result;
}

/* Reads a number: less an origin, as a float, to *bits, or a list's length to *count; with neither it is
   stepped over. 0: the file ends, or this is no number. */
static int ssdgs__ply_scalar(ssdgs__ply *ply, int type, double origin, uint32_t *bits, size_t *count) {
    const int size = ssdgs__ply_sizes[type], moved = origin < 0 || origin > 0;
    uint64_t raw = 0;
    double value;
    if (type == SSDGS__PLY_FLOAT32 && ply->format == SSDGS__PLY_LITTLE && bits && !moved &&
        ply->end - ply->at >= 4) { /* what nearly all are */
        *bits = (uint32_t)ply->at[0] | (uint32_t)ply->at[1] << 8 | (uint32_t)ply->at[2] << 16 |
                (uint32_t)ply->at[3] << 24;
        ply->at += 4;
        return 1;
    }
    if (ply->format == SSDGS__PLY_ASCII) {
        const ssdgs__ply_token token = ssdgs__ply_cut(&ply->at, ply->end);
        if (count || !bits) return count ? ssdgs__ply_count(token, count) : token.length > 0;
        if (!ssdgs__ply_number(token, &value)) return 0;
        *bits = ssdgs__ply_bits(moved ? value - origin : value);
        return 1;
    }
    if (ply->end - ply->at < size) return 0;
    for (int i = 0; i < size; i++) raw = raw << 8 | ply->at[ply->format == SSDGS__PLY_BIG ? i : size - 1 - i];
    ply->at += size;
    const uint64_t negative = type < SSDGS__PLY_FLOAT32 && !(type & 1) ? raw >> (8 * size - 1) : 0;
    if (count) *count = (size_t)raw;
    if (count || !bits) return !count || !negative;
    value = (double)raw - (negative ? (double)((uint64_t)1 << 8 * size) : 0);
    if (type == SSDGS__PLY_FLOAT64) memcpy(&value, &raw, sizeof value);
    if (type == SSDGS__PLY_FLOAT32 && !moved) return *bits = (uint32_t)raw, 1;
    if (type == SSDGS__PLY_FLOAT32) value = ssdgs__ply_value((uint32_t)raw);
    *bits = ssdgs__ply_bits(moved ? value - origin : value);
    return 1;
}

/* The known words of one row; NULL: it is stepped over. 0: it is broken, as ply->bad and why say. */
static int ssdgs__ply_row(ssdgs__ply *ply, const ssdgs__ply_element *element, uint32_t *words) {
    const ssdgs__ply_property *property = ply->properties + element->first;
    const int ascii = ply->format == SSDGS__PLY_ASCII;
    for (int i = 0; i < element->properties; i++, property++) {
        const size_t size = ascii ? 1 : ssdgs__ply_sizes[property->type];
        size_t count = 1;
        ply->bad = property;
        ply->why = "the file ends, or this is no number";
        if (property->list >= 0) {
            if (!ssdgs__ply_scalar(ply, property->list, 0, NULL, &count)) return 0;
            ply->why = "this list does not end within the file";
            if (count > (size_t)(ply->end - ply->at) / size) return 0;
        }
        const int wanted = words && property->list < 0 && property->word >= 0,
                  position = wanted && element->kind == SSDGS__PLY_VERTEX && property->word < SSDGS_ROTATION;
        for (; count; count--)
            if (!ssdgs__ply_scalar(ply, property->type, position ? ply->origin[property->word] : 0,
                                   wanted ? &words[property->word] : NULL, NULL))
                return 0;
    }
    while (ascii && ply->at < ply->end && (*ply->at == ' ' || *ply->at == '\t')) ply->at++;
    ply->why = "the line should end here: it has more or fewer values than the row";
    return !ascii || ply->at == ply->end || ssdgs__ply_space(*ply->at);
}

/* Refuses a row, counted from 0, as ply->bad and why say. */
static ssdgs_result ssdgs__ply_broken(const ssdgs__ply *ply, const ssdgs__ply_element *element, size_t row) {
    char names[2][64];
    const ssdgs__ply_token tokens[2] = {element->name, ply->bad->name};
    for (int i = 0; i < 2; i++) {
        const size_t length = tokens[i].length < 63 ? tokens[i].length : 63;
        memcpy(names[i], tokens[i].text, length);
        names[i][length] = 0;
    }
    return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: element %s, row %zu, property %s: %s", ply->name,
                       names[0], row, names[1], ply->why);
}

/* Finds where every element lies, so that they may come in any order. */
static ssdgs_result ssdgs__ply_survey(ssdgs__ply *ply) {
    const int ascii = ply->format == SSDGS__PLY_ASCII;
    for (int e = 0; e < ply->element_count; e++) {
        ssdgs__ply_element *element = ply->elements + e;
        const ssdgs__ply_property *property = ply->properties + element->first;
        const size_t left = (size_t)(ply->end - ply->at) + (size_t)ascii; /* the last line may lack its end */
        size_t least = 0;                                                 /* bytes of a row */
        for (int i = 0; i < element->properties; i++, property++)
            least += ascii ? 2 : ssdgs__ply_sizes[property->list < 0 ? property->type : property->list];
        element->data = ply->at;
        if (!least) continue;
        ply->bad = property - 1;
        ply->why = "the file is cut short";
        if (element->count > left / least) return ssdgs__ply_broken(ply, element, left / least);
        if (!ascii && !element->lists) ply->at += element->count * least;
        else
            for (size_t row = 0; row < element->count; row++)
                if (!ssdgs__ply_row(ply, element, NULL)) return ssdgs__ply_broken(ply, element, row);
    }
    while (ascii && ply->at < ply->end && ssdgs__ply_space(*ply->at)) ply->at++;
    ply->behind = (size_t)(ply->end - ply->at);
    return SSDGS_OK;
}

/* Every property whose word lies in [first, last) must be there. */
static ssdgs_result ssdgs__ply_require(const ssdgs__ply *ply, int kind, int first, int last) {
    ssdgs__ply_cursor cursor;
    char name[32];
    for (cursor.field = NULL; ssdgs__ply_next(&cursor, kind);) {
        if (cursor.word >= first && cursor.word < last && cursor.field->before < 0 &&
            !ply->known[kind]->present[cursor.word])
            return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: element %s lacks property %s%s",
                               ply->name, ssdgs__ply_kinds[kind], ssdgs__ply_name(&cursor, name),
                               kind == SSDGS__PLY_VERTEX && cursor.word >= SSDGS_ROTATION &&
                                       !memchr(ply->known[kind]->present + SSDGS_ROTATION, 1, 8)
                                   ? ": these are no Gaussian splats, but a point cloud or a mesh"
                                   : "");
    }
    return SSDGS_OK;
}

/* Whether settings read from a file may be used. */
static ssdgs_result ssdgs__settings_of_file(ssdgs_context *context, const char *name,
                                            const ssdgs_settings *settings) {
    context->subject = name;
    context->subject_number = -1;
    const ssdgs_result result = ssdgs__settings_check(context, settings);
    context->subject = NULL;
    return result ? SSDGS_ERR_FORMAT : SSDGS_OK;
}

static ssdgs_result ssdgs__ply_read_settings(ssdgs__ply *ply, ssdgs_settings *settings) {
    ssdgs__ply_element *element = ply->known[SSDGS__PLY_SETTINGS];
    uint32_t words[SSDGS__PLY_WORDS];
    SSDGS__TRY(ssdgs__ply_require(ply, SSDGS__PLY_SETTINGS, 0, SSDGS__PLY_WORDS));
    ssdgs__ply_cursor cursor;
    for (cursor.field = NULL; ssdgs__ply_next(&cursor, SSDGS__PLY_SETTINGS);)
        words[cursor.word] = ssdgs__ply_bits(cursor.field->before);
    ply->at = element->data;
    if (element->count != 1 || !ssdgs__ply_row(ply, element, words))
        return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: ssdgs_settings is not one row of numbers",
                           ply->name);
    char name[32];
    for (cursor.field = NULL; ssdgs__ply_next(&cursor, SSDGS__PLY_SETTINGS);) {
        const double value = ssdgs__ply_value(words[cursor.word]);
        if (!ssdgs__ply_finite(words[cursor.word]) ||
            (cursor.field->type == 'i' && (fabs(value) > 1e6 || floor(value) != value)))
            return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: setting %s is not finite or not whole",
                               ply->name, ssdgs__ply_name(&cursor, name));
        ssdgs__number_put(cursor.field->type, (unsigned char *)settings + ssdgs__ply_setting(&cursor), value);
    }
    if (settings->version < 1 || settings->version > SSDGS_VERSION)
        return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: version %d; this library reads 1 to %d",
                           ply->name, settings->version, SSDGS_VERSION);
    ply->version = settings->version;
    settings->version = SSDGS_VERSION;
    return ssdgs__settings_of_file(ply->context, ply->name, settings);
}

/* Makes a Gaussian fit for use; 0 = drop it. Without their sign, floats order as their bits do: finite,
   infinity, NaN. */
static int ssdgs__ply_mend(uint32_t *words, int planes, ssdgs_load_stats *stats) {
    const uint32_t sign = 0x80000000u, infinity = 0x7f800000u, most = 0x41a00000u /* SSDGS__RAW_LIMIT, 20 */,
                   one = 0x3f800000u;
    for (int i = 0; i < planes; i++) {
        const int clamped =
            i >= SSDGS_LOG_SCALE && i <= SSDGS_OPACITY; /* scales and opacity may be infinite */
        if ((words[i] & ~sign) >= infinity + (uint32_t)clamped) return stats->dropped++, 0;
    }
    for (int i = SSDGS_LOG_SCALE; i <= SSDGS_OPACITY; i++) {
        if ((words[i] & ~sign) <= most) continue;
        words[i] = (words[i] & sign) | most;
        ++*(i == SSDGS_OPACITY ? &stats->clamped_opacities : &stats->clamped_scales);
    }
    for (int i = SSDGS_ROTATION; i <= SSDGS_FRAME && i < planes; i += SSDGS_FRAME - SSDGS_ROTATION) {
        double largest = 0;
        for (int k = 0; k < 4; k++) {
            const double size = fabs(ssdgs__ply_value(words[i + k]));
            largest = size > largest ? size : largest;
        }
        if (largest >= 1e-37 && largest <= 1e37) continue; /* float can divide by it, as drawing does */
        for (int k = 0; k < 4; k++) words[i + k] = k ? 0 : one;
        stats->zero_rotations++;
    }
    return 1;
}

static int ssdgs__ply_has(const ssdgs__ply *ply, const ssdgs__ply_element *element, const char *name) {
    int i;
    for (i = 0; i < element->properties && !ssdgs__ply_is(ply->properties[element->first + i].name, name);
         i++) {}
    return i < element->properties;
}

/* The degree of a plain file's harmonics that are not all 0. f_rest lies channel by channel, or coefficient
   by coefficient, as some programs have written it. A file does not say which, but colours change with the
   view more in brightness than in hue: what lies together as red, green and blue of a coefficient has a
   larger sum of squares of its sums. */
static int ssdgs__ply_harmonics(ssdgs__ply *ply) {
    enum { ENOUGH = 20000 }; /* rows, to tell by */
    const ssdgs__ply_element *vertex = ply->known[SSDGS__PLY_VERTEX];
    unsigned char used[45];
    double apart = 0, together = 0;
    int all = 0, degree = 3, first_unused = 0;
    while (all < 45 && vertex->present[SSDGS__PLY_REST + all]) all++;
    if (!all) return 0;
    while (degree && 3 * ssdgs__harmonics(degree) != all) degree--;
    if (!degree || ssdgs__ply_has(ply, vertex, "f_rest_45")) {
        ssdgs__note(ply->context, "%s: f_rest is left out: it is not of degree 1, 2 or 3", ply->name);
        return 0;
    }
    memset(used, 0, sizeof used);
    ply->at = vertex->data;
    ply->harmonics = all / 3;
    for (size_t row = 0; row < vertex->count && (row < ENOUGH || first_unused < all); row++) {
        uint32_t words[SSDGS__PLY_WORDS], *rest = words + SSDGS__PLY_REST;
        if (!ssdgs__ply_row(ply, vertex, words)) return 0; /* reading the rows reports it */
        for (int i = 0; i < all; i++) used[i] |= (rest[i] & 0x7fffffffu) != 0;
        while (first_unused < all && used[first_unused]) first_unused++;
        for (int i = 0; i < ply->harmonics && row < ENOUGH; i++) {
            double sum[2] = {0, 0};
            for (int c = 0; c < 3; c++) {
                sum[0] += ssdgs__ply_value(rest[i + c * ply->harmonics]);
                sum[1] += ssdgs__ply_value(rest[3 * i + c]);
            }
            if (!(fabs(sum[0]) < 1e15 && fabs(sum[1]) < 1e15)) continue;
            apart += sum[0] * sum[0];
            together += sum[1] * sum[1];
        }
    }
    ply->interleaved = together > 1.5 * apart;
    if (ply->interleaved)
        ssdgs__note(
            ply->context,
            "%s: f_rest seems to hold one coefficient after the other, not one channel: it is read so",
            ply->name);
    degree = 0;
    for (int i = 0; i < all; i++) {
        const int at = ply->interleaved ? i / 3 : i % ply->harmonics;
        while (used[i] && at >= ssdgs__harmonics(degree)) degree++;
    }
    return degree;
}

typedef struct ssdgs__ply_target { /* where a word of a row goes: to[row x step] */
    ssdgs__ply_cursor cursor;
    ssdgs_real *to;
    size_t step;
} ssdgs__ply_target;

/* Fills the model's arrays from an element's rows. */
static ssdgs_result ssdgs__ply_read_rows(ssdgs__ply *ply, int kind, ssdgs_model *model,
                                         ssdgs_load_stats *stats) {
    ssdgs__ply_element *element = ply->known[kind];
    const int vertex = kind == SSDGS__PLY_VERTEX, baked = vertex && model->settings.baked;
    const int planes = baked ? SSDGS_HARMONICS : SSDGS_CHANNELS,
              keeps = vertex && ssdgs__keeps(&model->settings);
    const int albedo =
        baked &&
        element->present[SSDGS_SPECULAR]; /* files up to 0.2.5 have no f_dc in kd_, but what an albedo has */
    const int more = ssdgs__harmonics(model->settings.harmonics);
    ssdgs__ply_target targets[SSDGS__PLY_WORDS], *target = targets;
    ssdgs__ply_cursor cursor;
    for (cursor.field = NULL; ssdgs__ply_next(&cursor, kind);) {
        const int rest = cursor.word - SSDGS__PLY_REST;
        target->cursor = cursor;
        if (keeps && rest >= 0 && rest < 3 * ply->harmonics) {
            const int c = ply->interleaved ? rest % 3 : rest / ply->harmonics,
                      i = ply->interleaved ? rest / 3 : rest % ply->harmonics;
            if (i >= more) continue; /* a band that is 0 */
            target->to = model->gaussians +
                         (size_t)(ssdgs__kept_plane(&model->settings) + 3 + c * more + i) * model->capacity;
        } else if ((cursor.word < planes && (element->present[cursor.word] || (baked && stats->plain))) ||
                   (keeps && !baked && cursor.word >= SSDGS__PLY_DC && rest < 0)) {
            target->to = ssdgs__ply_cell(model, 0, &cursor);
        } else continue;
        target++->step = vertex ? 1 : (size_t)(cursor.field->count ? cursor.field->count : 1);
    }
    size_t kept = 0;
    ply->at = element->data;
    for (size_t row = 0; row < element->count; row++) {
        uint32_t words[SSDGS__PLY_WORDS];
        if (!ssdgs__ply_row(ply, element, words)) return ssdgs__ply_broken(ply, element, row);
        for (int i = 0; i < 3 && baked; i++) {
            uint32_t *word = words + SSDGS_DIFFUSE + i;
            if (stats->plain && element->present[SSDGS__PLY_DC]) *word = words[SSDGS__PLY_DC + i];
            else if (stats->plain && ssdgs__ply_finite(words[SSDGS__PLY_RGB + i]))
                *word =
                    ssdgs__ply_bits((ssdgs__ply_value(words[SSDGS__PLY_RGB + i]) / ply->color_unit[i] - 0.5) /
                                    SSDGS__HARMONIC);
            else if (stats->plain) *word = words[SSDGS__PLY_RGB + i];
            else if (albedo && ssdgs__ply_finite(*word))
                *word = ssdgs__ply_bits((double)ssdgs__to_dc((ssdgs_real)ssdgs__ply_value(*word)));
        }
        if (vertex && !ssdgs__ply_mend(words, planes, stats)) continue;
        const ssdgs__ply_target *bad = targets;
        while (bad < target && ssdgs__ply_finite(words[bad->cursor.word])) bad++;
        if (bad < target && vertex) {
            stats->dropped++;
            continue;
        }
        if (bad < target) {
            char name[32];
            return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT,
                               "%s: element %s, row %zu, property %s: it is not finite", ply->name,
                               ssdgs__ply_kinds[kind], row, ssdgs__ply_name(&bad->cursor, name));
        }
        for (const ssdgs__ply_target *t = targets; t < target; t++)
            t->to[kept * t->step] = (ssdgs_real)ssdgs__ply_value(words[t->cursor.word]);
        kept++;
    }
    if (vertex) model->count = (int)kept;
    return SSDGS_OK;
}

/* Sets an origin where doubles of a foreign file lie more than 1,000 and a thousand times their box from 0:
   floats would be coarse. */
static void ssdgs__ply_find_origin(ssdgs__ply *ply, ssdgs_settings *settings) {
    ssdgs__ply_element *vertex = ply->known[SSDGS__PLY_VERTEX];
    double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
    int doubles = 0, far_away = 0;
    for (int i = 0; i < vertex->properties; i++) {
        const ssdgs__ply_property *p = ply->properties + vertex->first + i;
        doubles += p->type == SSDGS__PLY_FLOAT64 && p->word >= 0 && p->word < SSDGS_ROTATION;
    }
    if (doubles != 3 || !vertex->count) return;
    ply->at = vertex->data;
    for (size_t row = 0; row < vertex->count; row++) {
        uint32_t words[SSDGS__PLY_WORDS];
        if (!ssdgs__ply_row(ply, vertex, words)) return; /* reading the rows reports it */
        for (int i = 0; i < 3; i++) {
            const double x = ssdgs__ply_value(words[i]);
            if (!ssdgs__ply_finite(words[i])) continue;
            low[i] = x < low[i] ? x : low[i];
            high[i] = x > high[i] ? x : high[i];
        }
    }
    for (int i = 0; i < 3; i++) far_away |= fabs(high[i] + low[i]) > 2000 * (high[i] - low[i]) + 2000;
    for (int i = 0; i < 3 && far_away; i++)
        ply->origin[i] = (double)(settings->origin[i] =
                                      (ssdgs_real)(float)(low[i] <= high[i] ? 0.5 * (low[i] + high[i]) : 0));
}

/* Notes what a model will not do that its user may expect. */
static void ssdgs__ply_tell(const ssdgs__ply *ply, const ssdgs_model *model, const ssdgs_load_stats *stats) {
    ssdgs_context *context = model->context;
    const char *name = ply->name;
    int moved = 0;
    for (int i = 0; i < 3; i++) moved |= ply->origin[i] < 0 || ply->origin[i] > 0;
    if (ply->behind)
        ssdgs__note(context, "%s: %zu bytes behind the last element are not read: was it copied as text?",
                    name, ply->behind);
    if (stats->dropped)
        ssdgs__note(context, "%s: %d Gaussians of %d are left out: they have values that are not finite",
                    name, stats->dropped, stats->dropped + model->count);
    if (!model->count) ssdgs__note(context, "%s: holds no Gaussians: its pictures are empty", name);
    else if (model->settings.baked)
        ssdgs__note(context, "%s: plain splats, which have their colours baked in: lights change nothing",
                    name);
    if (!ply->known[SSDGS__PLY_SETTINGS] && moved)
        ssdgs__note(context, "%s: positions are relative to settings.origin, %g, %g, %g", name,
                    (double)model->settings.origin[0], (double)model->settings.origin[1],
                    (double)model->settings.origin[2]);
    if (stats->untrained)
        ssdgs__note(context,
                    "%s: has no settings, as editors of splats drop them, mostly with ASG and networks: it "
                    "is not drawn as it "
                    "was trained. relight --networks ORIGINAL.ply (examples/adopt.h) takes them from the "
                    "original file",
                    name);
    ssdgs__tell_placement(model, name);
}

static ssdgs_result ssdgs__ply_read(ssdgs__ply *ply, ssdgs_model **out, ssdgs_load_stats *stats) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_result result = ssdgs__ply_header(ply);
    if (!result) result = ssdgs__ply_survey(ply);
    if (result) return result;
    const ssdgs__ply_element *vertex = ply->known[SSDGS__PLY_VERTEX];
    if (!vertex) return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT, "%s: no element vertex", ply->name);
    if (vertex->count > SSDGS__MAX_GAUSSIANS)
        return ssdgs__fail(ply->context, SSDGS_ERR_LIMIT, "%s: %zu Gaussians are too many", ply->name,
                           vertex->count);

    if (ssdgs__ply_has(ply, vertex, "packed_position"))
        return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT,
                           "%s: a compressed PLY (packed_position): examples/splats.h reads it", ply->name);
    if (ssdgs__ply_has(ply, vertex, "filter_3D"))
        return ssdgs__fail(
            ply->context, SSDGS_ERR_FORMAT,
            "%s: sizes and opacities are still without their filter (filter_3D): save it fused", ply->name);

    const int ours = ply->known[SSDGS__PLY_SETTINGS] != NULL;
    stats->plain = !ours && !vertex->present[SSDGS_DIFFUSE];
    stats->untrained = !stats->plain && !ours;
    if (ours) {
        result = ssdgs__ply_read_settings(ply, &settings);
        for (int c = 0; c < 3 && ply->version <= 204; c++) ply->origin[c] = (double)settings.origin[c];
    } else if (stats->plain) {
        settings.baked = 1;
        settings.transfer = SSDGS_TRANSFER_NONE;
        settings.pixel_variance = (ssdgs_real)0.3; /* as other programs trained it */
        const int color = vertex->present[SSDGS__PLY_DC] || !vertex->present[SSDGS__PLY_RGB] ? SSDGS__PLY_DC
                                                                                             : SSDGS__PLY_RGB;
        result = ssdgs__ply_require(ply, SSDGS__PLY_VERTEX, color, color + 3);
    } else { /* the published implementation keeps the rest elsewhere */
        settings = ssdgs_settings_published();
    }
    if (!result)
        result = ssdgs__ply_require(ply, SSDGS__PLY_VERTEX, 0,
                                    stats->plain     ? SSDGS_DIFFUSE
                                    : settings.baked ? SSDGS_HARMONICS
                                                     : SSDGS_CHANNELS);
    if (!result && stats->plain) settings.harmonics = ssdgs__ply_harmonics(ply);
    if (!result && ours) {
        ply->harmonics = ssdgs__harmonics(settings.harmonics);
        result =
            ssdgs__ply_require(ply, SSDGS__PLY_VERTEX, settings.kept > 0 ? SSDGS__PLY_DC : SSDGS__PLY_REST,
                               SSDGS__PLY_REST + 3 * ply->harmonics);
    }
    if (!result && !ours) ssdgs__ply_find_origin(ply, &settings);
    for (int kind = SSDGS__PLY_BASIS; kind < SSDGS__PLY_KINDS && !result; kind++) {
        const size_t expected = ssdgs__ply_rows(&settings, kind),
                     rows = ply->known[kind] ? ply->known[kind]->count : 0;
        if (rows != expected && (ours || ply->known[kind]))
            return ssdgs__fail(ply->context, SSDGS_ERR_FORMAT,
                               "%s: element %s has %zu rows, the settings need %zu%s", ply->name,
                               ssdgs__ply_kinds[kind], rows, expected,
                               ply->known[kind] ? "" : ": has another program dropped it?");
        if (ply->known[kind]) result = ssdgs__ply_require(ply, kind, 0, SSDGS__PLY_WORDS);
    }
    if (!result) result = ssdgs__model_create(ply->context, &settings, (int)vertex->count, out);
    for (int kind = 0; kind < SSDGS__PLY_KINDS && !result; kind++)
        if (kind != SSDGS__PLY_SETTINGS && ply->known[kind])
            result = ssdgs__ply_read_rows(ply, kind, *out, stats);
    if (result) return result;
    stats->version = ply->version;
    if (ours) ssdgs__gaussians_update(*out, ply->version);
    ssdgs__ply_tell(ply, *out, stats);
    return SSDGS_OK;
}

static ssdgs_result ssdgs__ply_load(ssdgs_context *context, const char *name, const void *bytes, size_t size,
                                    ssdgs_model **out, ssdgs_load_stats *stats) {
    ssdgs_load_stats own;
    ssdgs_result result = SSDGS_ERR_MEMORY;
    ssdgs__ply *ply = (ssdgs__ply *)ssdgs__allocate(context, sizeof *ply);
    memset(&own, 0, sizeof own);
    if (ply) {
        ply->context = context;
        ply->name = name;
        ply->begin = ply->at = (const unsigned char *)bytes;
        ply->end = ply->begin + size;
        result = ssdgs__ply_read(ply, out, &own);
        ssdgs__release(context, ply);
    }
    if (!result && !(*out)->settings.baked && ssdgs__in_no_order(*out)) {
        result = ssdgs__model_sort(*out);
        own.sorted = 1;
    }
    if (result) {
        ssdgs__model_drop(*out);
        *out = NULL;
        memset(&own, 0, sizeof own);
    }
    if (stats) *stats = own;
    return result;
}

SSDGS_API ssdgs_result ssdgs_model_load_memory(ssdgs_context *context, const void *bytes, size_t size,
                                               ssdgs_model **out, ssdgs_load_stats *stats) {
    if (stats) memset(stats, 0, sizeof *stats);
    if (out) *out = NULL;
    SSDGS__BEGIN(context, context, "ssdgs_model_load_memory");
    ssdgs_result result = SSDGS_OK;
    if (!bytes || !out) result = ssdgs__null(context, "ssdgs_model_load_memory", bytes ? "out" : "bytes");
    else result = ssdgs__ply_load(context, "PLY in memory", bytes, size, out, stats);
    return ssdgs__leave(context, result);
}

#ifndef SSDGS_NO_STDIO

#ifdef _WIN32
enum { SSDGS__PATH = 4096 };

/* A path of UTF-8 for Windows; where it is none, as of its code page. Too long ones become empty. */
static const wchar_t *ssdgs__wide(const char *path, wchar_t to[SSDGS__PATH]) {
    if (!MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, to, SSDGS__PATH) &&
        !MultiByteToWideChar(CP_ACP, 0, path, -1, to, SSDGS__PATH))
        to[0] = 0;
    return to;
}
#endif

/* Folders, devices and pipes are neither read, which might never end, nor replaced. */
static int ssdgs__irregular(const char *path) {
#ifdef _WIN32
    wchar_t wide[SSDGS__PATH];
    const DWORD kind = GetFileAttributesW(ssdgs__wide(path, wide));
    return kind != INVALID_FILE_ATTRIBUTES && (kind & (FILE_ATTRIBUTE_DIRECTORY | FILE_ATTRIBUTE_DEVICE));
#else
    struct stat info;
    return stat(path, &info) == 0 && !S_ISREG(info.st_mode);
#endif
}

/* Reads a file in pieces: `most` bytes, or all where that is 0. What the system says of its size is a
   hint. */
static ssdgs_result ssdgs__read_file(ssdgs_context *context, const char *path, size_t most,
                                     unsigned char **bytes, size_t *size) {
    const uint64_t limit = (uint64_t)128 << 30; /* a checkpoint of as many Gaussians as there may be */
    unsigned char *buffer = NULL;
    size_t room = 0, used = 0;
    ssdgs_result result = SSDGS_OK;
    *bytes = NULL;
    *size = 0;
    if (ssdgs__irregular(path)) return ssdgs__fail(context, SSDGS_ERR_IO, "%s: is not a regular file", path);
#ifdef _WIN32
    wchar_t wide[SSDGS__PATH];
    FILE *file = _wfopen(ssdgs__wide(path, wide), L"rb");
#else
    FILE *file = fopen(path, "rb");
#endif
    if (!file) return ssdgs__fail(context, SSDGS_ERR_IO, "%s: cannot be opened (errno %d)", path, errno);
    const long hint = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : 0;
    rewind(file);
    unsigned char *larger;
    while (used == room && !result && !(most && used)) { /* a byte more than the file has tells its end */
        const uint64_t more = most ? most : room ? room : hint > 0 ? (uint64_t)hint + 1 : 65536;
        if (more > limit + 1 - room || more > SIZE_MAX - room) {
            result = ssdgs__fail(context, SSDGS_ERR_LIMIT, "%s: too large (128 GiB at most)", path);
        } else if ((larger = (unsigned char *)ssdgs__allocate(context, room + (size_t)more)) == NULL) {
            result = SSDGS_ERR_MEMORY;
        } else {
            if (used) memcpy(larger, buffer, used);
            ssdgs__release(context, buffer);
            buffer = larger;
            room += (size_t)more;
            used += fread(buffer + used, 1, room - used, file);
        }
    }
    if (!result && ferror(file))
        result = ssdgs__fail(context, SSDGS_ERR_IO, "%s: cannot be read (errno %d)", path, errno);
    fclose(file);
    if (result) ssdgs__release(context, buffer);
    else *bytes = buffer, *size = used;
    return result;
}

SSDGS_API ssdgs_result ssdgs_model_load(ssdgs_context *context, const char *path, ssdgs_model **out,
                                        ssdgs_load_stats *stats) {
    unsigned char *bytes = NULL;
    if (stats) memset(stats, 0, sizeof *stats);
    if (out) *out = NULL;
    SSDGS__BEGIN(context, context, "ssdgs_model_load");
    ssdgs_result result = SSDGS_OK;
    size_t size;
    if (!path || !out) result = ssdgs__null(context, "ssdgs_model_load", path ? "out" : "path");
    else result = ssdgs__read_file(context, path, 0, &bytes, &size);
    if (!result) result = ssdgs__ply_load(context, path, bytes, size, out, stats);
    ssdgs__release(context, bytes);
    return ssdgs__leave(context, result);
}

/* ---- writing ---- */

#ifdef _WIN32
#define SSDGS__WRITE(file, bytes, size) _write(file, bytes, (unsigned)(size))
#define SSDGS__SYNC(file) _commit(file)
#define SSDGS__CLOSE(file) _close(file)
#define SSDGS__OPEN_NEW(path) ssdgs__open_new(path)
#define SSDGS__UNLINK(path) ssdgs__unlink(path)
#define SSDGS__RENAME(from, to) ssdgs__rename(from, to)
#define SSDGS__PROCESS() ((unsigned long)_getpid())

static int ssdgs__open_new(const char *path) {
    wchar_t wide[SSDGS__PATH];
    return _wopen(ssdgs__wide(path, wide), _O_WRONLY | _O_CREAT | _O_EXCL | _O_BINARY, _S_IREAD | _S_IWRITE);
}

static void ssdgs__unlink(const char *path) {
    wchar_t wide[SSDGS__PATH];
    (void)_wunlink(ssdgs__wide(path, wide));
}

static int ssdgs__rename(const char *from, const char *to) {
    wchar_t wide[2][SSDGS__PATH];
    return MoveFileExW(ssdgs__wide(from, wide[0]), ssdgs__wide(to, wide[1]),
                       MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH)
               ? 0
               : -1;
}
#else
#define SSDGS__OPEN_NEW(path) open(path, O_WRONLY | O_CREAT | O_EXCL, 0666)
#define SSDGS__WRITE(file, bytes, size) write(file, bytes, size)
#define SSDGS__SYNC(file) fsync(file)
#define SSDGS__CLOSE(file) close(file)
#define SSDGS__UNLINK(path) unlink(path)
#define SSDGS__RENAME(from, to) rename(from, to)
#define SSDGS__PROCESS() ((unsigned long)getpid())
#endif

enum { SSDGS__WRITER_BUFFER = 65536, SSDGS__WRITER_SUFFIX = 64 };

/* A file that gets its name only when it is complete, or somebody who takes its bytes. The first failure
   sticks; close reports it. */
typedef struct ssdgs__writer {
    ssdgs_context *context;
    int (*take)(void *user, const void *bytes, size_t size); /* NULL: a file */
    void *user;
    const char *path; /* the caller's, until close */
    char *temporary;  /* the file's name before; the buffer follows it */
    unsigned char *buffer;
    size_t used;
    int file; /* -1 = none */
    ssdgs_result result;
} ssdgs__writer;

static ssdgs_result ssdgs__writer_open(ssdgs__writer *writer, ssdgs_context *context, const char *path,
                                       int (*take)(void *, const void *, size_t), void *user) {
    const size_t room = strlen(path) + SSDGS__WRITER_SUFFIX;
    memset(writer, 0, sizeof *writer);
    writer->context = context;
    writer->path = path;
    writer->file = -1;
    writer->take = take;
    writer->user = user;
    if (!take && ssdgs__irregular(path))
        return writer->result = ssdgs__fail(context, SSDGS_ERR_IO, "%s: is not a regular file", path);
#ifndef _WIN32 /* where replacing it is refused */
    struct stat old;
    const int replaces = !take && stat(path, &old) == 0;
    if (replaces && access(path, W_OK))
        return writer->result = ssdgs__fail(context, SSDGS_ERR_IO, "%s: is write-protected", path);
#endif
    writer->temporary = (char *)ssdgs__allocate(context, room + SSDGS__WRITER_BUFFER);
    if (!writer->temporary) return writer->result = SSDGS_ERR_MEMORY;
    writer->buffer = (unsigned char *)writer->temporary + room;
    errno = EEXIST;
    for (int attempt = 0; !take && attempt < 100 && writer->file < 0 && errno == EEXIST;
         attempt++) { /* a crash may have left that name */
        snprintf(writer->temporary, room, "%s.tmp.%lx.%lx.%d", path, SSDGS__PROCESS(),
                 (unsigned long)(size_t)context, attempt);
        writer->file = SSDGS__OPEN_NEW(writer->temporary);
    }
    if (!take && writer->file < 0)
        writer->result = ssdgs__fail(context, SSDGS_ERR_IO, "%s: cannot be created (errno %d)", path, errno);
#ifndef _WIN32
    if (writer->file >= 0 && replaces) chmod(writer->temporary, old.st_mode & 0777); /* stays private */
#endif
    return writer->result;
}

static void ssdgs__writer_flush(ssdgs__writer *writer) {
    size_t done = writer->take ? writer->used : 0;
    if (done && !writer->result && writer->take(writer->user, writer->buffer, done))
        writer->result =
            ssdgs__fail(writer->context, SSDGS_ERR_CANCELLED, "%s: its bytes were not taken", writer->path);
    while (!writer->result && done < writer->used) {
        const ptrdiff_t wrote =
            (ptrdiff_t)SSDGS__WRITE(writer->file, writer->buffer + done, writer->used - done);
        if (wrote > 0) done += (size_t)wrote;
        else if (wrote == 0 || errno != EINTR)
            writer->result = ssdgs__fail(writer->context, SSDGS_ERR_IO, "%s: cannot be written (errno %d)",
                                         writer->path, errno);
    }
    writer->used = 0;
}

static void ssdgs__writer_put(ssdgs__writer *writer, const void *bytes, size_t size) {
    const unsigned char *from = (const unsigned char *)bytes;
    while (!writer->result && size) {
        const size_t room = SSDGS__WRITER_BUFFER - writer->used, part = size < room ? size : room;
        memcpy(writer->buffer + writer->used, from, part);
        writer->used += part;
        from += part;
        size -= part;
        if (writer->used == SSDGS__WRITER_BUFFER) ssdgs__writer_flush(writer);
    }
}

static ssdgs_result ssdgs__writer_close(ssdgs__writer *writer) {
    if (writer->file >= 0 || writer->take) ssdgs__writer_flush(writer);
    if (writer->file >= 0) {
        int failed = 0;
        while (!writer->result && !failed && SSDGS__SYNC(writer->file) != 0 && errno != EINVAL)
            failed = errno != EINTR; /* EINVAL: some file systems cannot */
        failed |= SSDGS__CLOSE(writer->file) != 0;
        if (!writer->result && (failed || SSDGS__RENAME(writer->temporary, writer->path) != 0))
            writer->result = ssdgs__fail(writer->context, SSDGS_ERR_IO, "%s: cannot be finished (errno %d)",
                                         writer->path, errno);
        if (writer->result) SSDGS__UNLINK(writer->temporary);
#ifndef _WIN32
        else { /* the new name should survive a power cut too; no harm if that cannot be had */
            char *slash = strrchr(writer->temporary, '/');
            if (slash) slash[slash == writer->temporary] = 0;
            writer->file = open(slash ? writer->temporary : ".", O_RDONLY);
            if (writer->file >= 0) {
                fsync(writer->file);
                close(writer->file);
            }
        }
#endif
    }
    ssdgs__release(writer->context, writer->temporary);
    return writer->result;
}

static void ssdgs__writer_text(ssdgs__writer *writer, const char *text) {
    ssdgs__writer_put(writer, text, strlen(text));
}

static double ssdgs__ply_softplus(ssdgs_real raw) { return raw > 20 ? (double)raw : log1p(exp((double)raw)); }

/* What other programs show: the normal, and as f_dc the look under a training set's average light. That light
   is 1 at the object and comes from anywhere above the surface: c_d / pi x 1/2, and c_sss x 0.02, a typical
   f_sss. */
static void ssdgs__average_colour(const ssdgs_model *model, size_t row, uint32_t *words) {
    const ssdgs_settings *settings = &model->settings;
    ssdgs_real raw[SSDGS_CHANNELS];
    ssdgs__gaussian_raw(model, row, raw);
    double q[4], size = 0;
    for (int i = 0; i < 4; i++) {
        q[i] = (double)raw[SSDGS_FRAME + i];
        size += q[i] * q[i];
    }
    const double scale = size > 0 ? 2 / size : 0;
    words[SSDGS__PLY_NORMAL] = ssdgs__ply_bits(scale * (q[1] * q[3] + q[0] * q[2]));
    words[SSDGS__PLY_NORMAL + 1] = ssdgs__ply_bits(scale * (q[2] * q[3] - q[0] * q[1]));
    words[SSDGS__PLY_NORMAL + 2] = ssdgs__ply_bits(1 - scale * (q[1] * q[1] + q[2] * q[2]));
    for (int i = 0; i < 3; i++) {
        const double diffuse = ssdgs__ply_softplus(raw[SSDGS_DIFFUSE + i]);
        const double scattering = ssdgs__ply_softplus(raw[SSDGS_SCATTERING + i]);
        double color = settings->baked
                           ? diffuse
                           : (settings->terms & SSDGS_DIFFUSE_TERM ? diffuse * 0.15915494309189535 : 0) +
                                 (settings->terms & SSDGS_SCATTERING_TERM ? scattering * 0.02 : 0);
        if (settings->transfer == SSDGS_TRANSFER_SRGB) color = (double)ssdgs_srgb_encode((ssdgs_real)color);
        words[SSDGS__PLY_DC + i] = ssdgs__ply_bits((color - 0.5) / SSDGS__HARMONIC);
        if (settings->baked && settings->transfer == SSDGS_TRANSFER_NONE)
            words[SSDGS__PLY_DC + i] = ssdgs__ply_bits(
                (double)model->gaussians[(size_t)(SSDGS_DIFFUSE + i) * model->capacity + row]);
    }
}

/* Whether a model's file has a property. */
static int ssdgs__ply_written(const ssdgs_settings *s, int kind, int word) {
    if (kind != SSDGS__PLY_VERTEX) return 1;
    if (s->baked && word >= SSDGS_HARMONICS && word < SSDGS_CHANNELS) return 0;
    return word < SSDGS__PLY_REST + 3 * ssdgs__harmonics(s->harmonics);
}

static void ssdgs__ply_write_row(const ssdgs_model *model, int kind, size_t row, ssdgs__writer *writer) {
    const ssdgs_settings *settings = &model->settings;
    uint32_t words[SSDGS__PLY_WORDS];
    if (kind == SSDGS__PLY_VERTEX) ssdgs__average_colour(model, row, words);
    ssdgs__ply_cursor cursor;
    for (cursor.field = NULL; ssdgs__ply_next(&cursor, kind);) {
        uint32_t *word = &words[cursor.word];
        if (!ssdgs__ply_written(settings, kind, cursor.word)) continue;
        if (kind == SSDGS__PLY_SETTINGS) {
            const double value = ssdgs__number_get(cursor.field->type, (const unsigned char *)settings +
                                                                           ssdgs__ply_setting(&cursor));
            *word = cursor.field->type == 'i' ? (uint32_t)(int)value : ssdgs__ply_bits(value);
        } else if (kind != SSDGS__PLY_VERTEX || cursor.word < SSDGS_CHANNELS ||
                   cursor.word >= (settings->kept > 0 ? SSDGS__PLY_DC : SSDGS__PLY_REST)) {
            *word = ssdgs__ply_bits((double)*ssdgs__ply_cell(model, row, &cursor));
        }
        const unsigned char bytes[4] = {(unsigned char)*word, (unsigned char)(*word >> 8),
                                        (unsigned char)(*word >> 16), (unsigned char)(*word >> 24)};
        ssdgs__writer_put(writer, bytes, 4);
    }
}

static ssdgs_result ssdgs__savable(const ssdgs_model *model, const char *path) {
    model->context->subject = path;
    model->context->subject_number = -1;
    const ssdgs_result result = ssdgs__globals_check(model);
    model->context->subject = NULL;
    return result;
}

static ssdgs_result ssdgs__model_save(const ssdgs_model *model, const char *path,
                                      int (*take)(void *, const void *, size_t), void *user) {
    const ssdgs_result result = ssdgs__savable(model, path);
    if (result) return result;
    ssdgs__writer writer;
    ssdgs__writer_open(&writer, model->context, path, take, user);
    ssdgs__writer_text(&writer, "ply\nformat binary_little_endian 1.0\n");
    size_t rows[SSDGS__PLY_KINDS];
    ssdgs__ply_cursor cursor;
    for (int kind = 0; kind < SSDGS__PLY_KINDS; kind++) {
        rows[kind] =
            kind == SSDGS__PLY_VERTEX ? (size_t)model->count : ssdgs__ply_rows(&model->settings, kind);
        char line[128], name[32];
        snprintf(line, sizeof line, "element %s %lu\n", ssdgs__ply_kinds[kind], (unsigned long)rows[kind]);
        ssdgs__writer_text(&writer, line);
        for (cursor.field = NULL; ssdgs__ply_next(&cursor, kind);) {
            if (!ssdgs__ply_written(&model->settings, kind, cursor.word)) continue;
            snprintf(line, sizeof line, "property %s %s\n", cursor.field->type == 'i' ? "int" : "float",
                     ssdgs__ply_name(&cursor, name));
            ssdgs__writer_text(&writer, line);
        }
    }
    ssdgs__writer_text(&writer, "end_header\n");
    for (int kind = 0; kind < SSDGS__PLY_KINDS; kind++)
        for (size_t row = 0; row < rows[kind] && !writer.result; row++)
            ssdgs__ply_write_row(model, kind, row, &writer);
    return ssdgs__writer_close(&writer);
}

SSDGS_API ssdgs_result ssdgs_model_save(const ssdgs_model *model, const char *path) {
    SSDGS__GUARD(model, model->context, "ssdgs_model_save",
                 path ? ssdgs__model_save(model, path, NULL, NULL)
                      : ssdgs__null(model->context, "ssdgs_model_save", "path"));
}

SSDGS_API ssdgs_result ssdgs_model_write(const ssdgs_model *model,
                                         int (*take)(void *user, const void *bytes, size_t size),
                                         void *user) {
    SSDGS__GUARD(model, model->context, "ssdgs_model_write",
                 take ? ssdgs__model_save(model, "model", take, user)
                      : ssdgs__null(model->context, "ssdgs_model_write", "take"));
}
#endif /* SSDGS_NO_STDIO */

SSDGS__SMALL_END

#ifndef SSDGS_NO_TRAINER

/* ==== >>trainer  schedule, one photograph forward and backward, Adam ==== */

/* Reads a photograph and the options. Writes gradients, then parameters and their moments. Called by
   steps. */

static const int ssdgs__group_plane[SSDGS__PLANE_GROUPS + 1] = {
    SSDGS_POSITION,   SSDGS_ROTATION, SSDGS_LOG_SCALE,  SSDGS_OPACITY,  SSDGS_DIFFUSE, SSDGS_SPECULAR,
    SSDGS_SCATTERING, SSDGS_FRAME,    SSDGS_ASG_WEIGHT, SSDGS_MATERIAL, SSDGS_CHANNELS};
static const char *const ssdgs__group_names[SSDGS__GROUPS] = {
    "position",       "rotation",           "log scale",         "opacity",
    "diffuse colour", "specular colour",    "scattering colour", "shading frame",
    "ASG weight",     "material",           "ASG basis",         "ASG sharpness",
    "ASG sigma",      "scattering network", "shadow network"};

/* What a photograph moves: gradients of value[0 .. 8] below, a Gauss-Newton step of value[9] and how sure it
   is, the gradient of settings.ambient. */
#define SSDGS__CORRECTIONS 14
/* value: the camera's shift t' and rotation w (x_cam = exp(w)(R x + t) + t'), the light's shift, ln of its
   intensity's factor. */
typedef struct ssdgs__correction {
    double value[10], mean[9], square[9];
    double sure;  /* how well the photograph tells the intensity */
    int steps[2]; /* Adam's clocks of the camera, of the light */
} ssdgs__correction;

/* How far a run is: with the arrays, what a checkpoint keeps. */
typedef struct ssdgs__run {
    double start_size;        /* of random points, 0 without */
    double ambient[6];        /* Adam's moments of settings.ambient: means, then squares */
    int steps[SSDGS__GROUPS]; /* Adam's clocks: a frozen group's stands still */
    int ambient_steps;        /* its clock of settings.ambient */
    int iteration, skipped;
    int sky_ready; /* 1: sky_share is up to date */
    int outlines;  /* 1: photographs show where the object ends */
} ssdgs__run;

struct ssdgs_trainer {
    ssdgs_context *context;
    ssdgs_model *model;
    uint64_t arrangement; /* the model's, that the planes below belong to */
    ssdgs_train_options options;
    ssdgs_photo *photos;
    ssdgs__correction *corrections;
    unsigned char
        *transparent; /* per photograph: 0 nowhere, 1 somewhere, 2 so that it shows where the object ends */
    ssdgs_real *small_object_gain; /* per photograph: what makes up for an object small in the picture, 1 for
                                      others */
    int photo_count;
    uint32_t *order;           /* the photographs in the order of a pass */
    int pass;                  /* whose; -1: none */
    size_t stride;             /* of the planes below: the model's capacity */
    ssdgs_real *mean, *square; /* (SSDGS_CHANNELS, stride) Adam's moments */
    ssdgs_real *global_mean, *global_square;
    ssdgs_real *screen_gradient; /* (n) each, sums since the last density control: pull, views, worth */
    ssdgs_real *screen_count;
    ssdgs_real *worth;     /* |dL/d(ln opacity)|: what the loss would change without it, to first order */
    ssdgs_real *sky_share; /* (2 x stride) what of settings.ambient comes to each Gaussian, and scratch */
    double extent;         /* 1.1 x the cameras' radius or the bounds' longest side, whichever is more */
    int budget;            /* density control ends with no more Gaussians */
    int backdrop,
        opaque_everywhere; /* no outlines, but options.background around it; or surfaces, everywhere */
    int one_light;         /* photographs do not tell how the object looks in other light */
    double unit;           /* the bounds' longest side */
    ssdgs__run run;
    int running;        /* in ssdgs_trainer_run() */
    ssdgs__buffer sums; /* of a batch */
};

#define SSDGS__MAX_BATCH 256
enum {
    SSDGS__REFINE_ALL =
        SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT | SSDGS_REFINE_INTENSITY | SSDGS_REFINE_AMBIENT
};
/* clang-format off */
#define SSDGS__O(member, count, type, low, high, standard, published) \
    {#member, offsetof(ssdgs_train_options, member), count, type, low, high, {standard, published, 0, 0}}
#define SSDGS__R(rate, first, last, published_first, published_last) /* a rate */ \
    SSDGS__O(rates.rate.start, 0, 'r', 0, 1e30, first, published_first), \
    SSDGS__O(rates.rate.end, 0, 'r', 0, 1e30, last, published_last)
static const ssdgs__number ssdgs__train_numbers[] = {
    SSDGS__O(iterations, 0, 'i', 1, 100000000, 20000, 60000),
    SSDGS__O(seed, 0, 'u', 0, 18446744073709551615.0, 1, 1),
    SSDGS__O(schedule, 0, 'i', 0, SSDGS_SCHEDULE_MERGED, SSDGS_SCHEDULE_MERGED, SSDGS_SCHEDULE_PROGRESSIVE),
    SSDGS__O(random_background, 0, 'i', -2147483648.0, 2147483647.0, 1, 1),
    SSDGS__O(initial_points, 0, 'i', -2147483648.0, 2147483647.0, 10000, 10000),
    SSDGS__O(max_gaussians, 0, 'i', 0, SSDGS__MAX_GAUSSIANS, 0, 100000),
    SSDGS__O(densify_every, 0, 'i', 1, 2000000000, 100, 100),
    SSDGS__O(densify_from, 0, 'i', -2147483648.0, 2147483647.0, 200, 500),
    SSDGS__O(densify_until, 0, 'i', -2147483648.0, 2147483647.0, 50000, 50000),
    SSDGS__O(opacity_reset_every, 0, 'i', 0, 2000000000, 3000, 3000),
    SSDGS__O(batch, 0, 'i', 1, SSDGS__MAX_BATCH, 1, 1),
    SSDGS__O(refine, 0, 'i', 0, SSDGS__REFINE_ALL, 0, 0),
    SSDGS__O(background, 3, 'r', -(double)FLT_MAX, (double)FLT_MAX, 0, 0),
    SSDGS__O(dssim, 0, 'r', 0, 1, 0.2, 0.2),
    SSDGS__O(normal_weight, 0, 'r', 0, 1000000, 0.05, 0),
    SSDGS__O(bounds_min, 3, 'r', -1e30, 1e30, -0.5, -0.5),
    SSDGS__O(bounds_max, 3, 'r', -1e30, 1e30, 0.5, 0.5),
    SSDGS__O(densify_gradient, 0, 'r', 0, 1e30, 4e-4, 2e-4),
    SSDGS__O(surplus, 0, 'r', 1, 100, 2, 1),
    SSDGS__O(prune_outside, 0, 'r', 0, 1, 0.02, 0),
    SSDGS__O(adam_epsilon, 0, 'r', 0, 1e30, 0.1, 0),
    SSDGS__O(finish, 0, 'r', 0, 1, 0.3, 1),
    SSDGS__R(position, 6.4e-4, 6.4e-6, 1.6e-4, 1.6e-6),
    SSDGS__R(opacity, 0.05, 0.05, 0.05, 0.05),
    SSDGS__R(scale, 0.015, 0.005, 0.005, 0.005),
    SSDGS__R(rotation, 0.001, 0.001, 0.001, 0.001),
    SSDGS__R(color, 0.03, 0.01, 0.01, 0.01),
    SSDGS__R(asg, 0.01, 1e-4, 0.01, 1e-4),
    SSDGS__R(frame, 0.01, 1e-4, 0.01, 1e-4),
    SSDGS__R(material, 0.001, 1e-5, 0.001, 1e-5),
    SSDGS__R(shadow, 0.001, 1e-5, 0.001, 1e-5),
    SSDGS__R(scattering, 0.001, 1e-5, 0.001, 1e-5),
    SSDGS__R(camera, 1e-3, 1e-5, 1e-3, 1e-5),
    SSDGS__R(light, 1e-3, 5e-5, 1e-3, 5e-5)};
/* clang-format on */
#undef SSDGS__O
#undef SSDGS__R
enum { SSDGS__TRAIN_NUMBERS = sizeof ssdgs__train_numbers / sizeof *ssdgs__train_numbers };

static ssdgs_train_options ssdgs__train_preset(int preset) {
    ssdgs_train_options o;
    memset(&o, 0, sizeof o);
    o.version = SSDGS_VERSION;
    ssdgs__numbers_preset(ssdgs__train_numbers, SSDGS__TRAIN_NUMBERS, preset, &o);
    return o;
}

SSDGS_API ssdgs_train_options ssdgs_train_options_default(void) { return ssdgs__train_preset(0); }
SSDGS_API ssdgs_train_options ssdgs_train_options_published(void) { return ssdgs__train_preset(1); }

/* The iteration on the scale of a 60,000-iteration run. */
static double ssdgs__schedule_time(const ssdgs_train_options *o, int iteration) {
    return o->iterations < 60000 ? iteration * (60000.0 / o->iterations) : (double)iteration;
}

/* The schedule time at which a run ends. */
static double ssdgs__schedule_end(const ssdgs_train_options *o) {
    return o->iterations > 60000 ? o->iterations : 60e3;
}

/* Terms in use at time t, and per group whether it learns. Deferred lobes have no basis that could be
   frozen. */
static int ssdgs__phase(const ssdgs_train_options *o, int asg, double t, int learns[SSDGS__GROUPS]) {
    double scattering = 9e3, specular = 16e3, freeze_scattering = 13e3, thaw_scattering = 20e3,
           thaw_asg = 20e3;
    int terms = SSDGS_DIFFUSE_TERM;
    const int joint = o->schedule == SSDGS_SCHEDULE_JOINT, merged = o->schedule == SSDGS_SCHEDULE_MERGED;
    if (o->schedule == SSDGS_SCHEDULE_SWAPPED) {
        scattering = 16e3;
        specular = 9e3;
        freeze_scattering = thaw_scattering = 0;
        thaw_asg = 13e3;
    }
    for (int i = 0; i < SSDGS__GROUPS; i++) learns[i] = 1;
    if (joint || merged) return joint || t >= 5e3 ? SSDGS_ALL_TERMS : terms;
    if (t >= 5e3) terms |= SSDGS_SHADOW_TERM;
    if (t >= scattering) terms |= SSDGS_SCATTERING_TERM;
    if (t >= specular) terms |= SSDGS_SPECULAR_TERM;
    learns[SSDGS__PLANE_GROUPS + SSDGS__SHADOW_NET] = learns[SSDGS__G_MATERIAL] = !(t >= 9e3 && t < 16e3);
    learns[SSDGS__PLANE_GROUPS + SSDGS__SCATTERING_NET] = !(t >= freeze_scattering && t < thaw_scattering);
    for (int i = SSDGS__ASG_BASIS; i <= SSDGS__ASG_SIGMA; i++)
        learns[SSDGS__PLANE_GROUPS + i] = t >= thaw_asg || asg == SSDGS_ASG_DEFERRED;
    return terms;
}

/* The last multiple of opacity_reset_every up to an iteration, or 0 if density control has ended half a
   period after it: then opacities are not reset any more. */
static int ssdgs__last_reset(const ssdgs_train_options *o, int iteration) {
    const int every = o->opacity_reset_every, last = every ? iteration - iteration % every : 0;
    return ssdgs__schedule_time(o, last + every / 2) <= o->densify_until ? last : 0;
}

static double ssdgs__decay(ssdgs_rate rate, double from, double over, double t) {
    const double x = t < from ? 0 : t > from + over ? 1 : (t - from) / over;
    return rate.start > 0 && rate.end > 0 ? exp(log((double)rate.start) * (1 - x) + log((double)rate.end) * x)
                                          : (double)rate.start * (1 - x) + (double)rate.end * x;
}

static double ssdgs__group_rate(const ssdgs_trainer *trainer, int group, double t) {
    const ssdgs_train_options *o = &trainer->options;
    const double whole = ssdgs__schedule_end(o);
    switch (group) {
    case SSDGS__G_POSITION: return trainer->extent * ssdgs__decay(o->rates.position, 0, whole, t);
    case SSDGS__G_ROTATION: return ssdgs__decay(o->rates.rotation, 0, whole, t);
    case SSDGS__G_SCALE: return ssdgs__decay(o->rates.scale, 0, whole, t);
    case SSDGS__G_OPACITY: return ssdgs__decay(o->rates.opacity, 0, whole, t);
    case SSDGS__G_DIFFUSE:
    case SSDGS__G_SPECULAR:
    case SSDGS__G_SCATTERING: return ssdgs__decay(o->rates.color, 0, whole, t);
    case SSDGS__G_FRAME: return ssdgs__decay(o->rates.frame, 40e3, 50e3, t);
    case SSDGS__G_MATERIAL: return ssdgs__decay(o->rates.material, 50e3, 50e3, t);
    case SSDGS__PLANE_GROUPS + SSDGS__SCATTERING_NET: return ssdgs__decay(o->rates.scattering, 50e3, 50e3, t);
    case SSDGS__PLANE_GROUPS + SSDGS__SHADOW_NET: return ssdgs__decay(o->rates.shadow, 50e3, 50e3, t);
    default: return ssdgs__decay(o->rates.asg, 40e3, 50e3, t);
    }
}

/* ---- one photograph ---- */

static int ssdgs__is_light(const ssdgs_photo *photo) {
    return photo->format == SSDGS_PIXELS_RGBA16F || photo->format == SSDGS_PIXELS_RGBA32F;
}

/* A number as it is in memory, bytes and words from 0 to 1. */
static ssdgs_real ssdgs__photo_number(const ssdgs_photo *photo, size_t at) {
    switch (photo->format) {
    case SSDGS_PIXELS_RGBA8:
        return (ssdgs_real)(1.0 / 255) * (ssdgs_real)((const uint8_t *)photo->pixels)[at];
    case SSDGS_PIXELS_RGBA16:
        return (ssdgs_real)(1.0 / 65535) * (ssdgs_real)((const uint16_t *)photo->pixels)[at];
    case SSDGS_PIXELS_RGBA16F: return (ssdgs_real)ssdgs__from_half(((const uint16_t *)photo->pixels)[at]);
    default: return (ssdgs_real)((const float *)photo->pixels)[at];
    }
}

/* Stored values of pixels begin .. end, as planes. */
static void ssdgs__photo_planes(const ssdgs__kernels *k, const ssdgs_photo *photo, int transfer,
                                const ssdgs_real background[3], size_t begin, size_t end,
                                ssdgs_real *planes) {
    const size_t pixels = (size_t)photo->camera.width * (size_t)photo->camera.height;
    const int encodes = transfer == SSDGS_TRANSFER_SRGB && ssdgs__is_light(photo);
    for (size_t c = 0; c < 3; c++)
        for (size_t first = begin; first < end; first += SSDGS__BLOCK) {
            ssdgs_real value[SSDGS__BLOCK];
            const size_t n = first + SSDGS__BLOCK < end ? SSDGS__BLOCK : end - first;
            for (size_t i = 0; i < SSDGS__BLOCK; i++)
                value[i] = i < n ? ssdgs__photo_number(photo, 4 * (first + i) + c) : 0;
            if (encodes) k->srgb_encode(value, NULL, value, SSDGS__BLOCK);
            for (size_t i = 0; i < n; i++) {
                const ssdgs_real alpha = ssdgs__photo_number(photo, 4 * (first + i) + 3);
                planes[pixels * c + first + i] = alpha * value[i] + (1 - alpha) * background[c];
            }
        }
}

/* 0 .. 65535, in steps of 257 where values are bytes. */
static int ssdgs__photo_alpha(const ssdgs_photo *photo, size_t pixel) {
    return (int)(65535 * ssdgs__photo_number(photo, 4 * pixel + 3) + (ssdgs_real)0.5);
}

/* exp(w) as a matrix, and the left Jacobian; both by series where the angle is small. */
static void ssdgs__rotate_by(const double w[3], double e[9], double jacobian[9]) {
    const double k[9] = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};
    const double t2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2], t = sqrt(t2);
    const double a = t2 < 1e-3 ? 1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42)) : sin(t) / t;
    const double b = t2 < 1e-3 ? 0.5 * (1 - t2 / 12 * (1 - t2 / 30 * (1 - t2 / 56))) : (1 - cos(t)) / t2;
    const double c = t2 < 1e-3 ? (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72))) / 6 : (t - sin(t)) / (t2 * t);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double k2 = 0;
            for (int l = 0; l < 3; l++) k2 += k[3 * i + l] * k[3 * l + j];
            e[3 * i + j] = (i == j) + a * k[3 * i + j] + b * k2;
            jacobian[3 * i + j] = (i == j) + b * k[3 * i + j] + c * k2;
        }
}

/* What a moved light is divided by: directions stay unit vectors. */
static double ssdgs__moved_length(const ssdgs_light *light, const double value[10]) {
    ssdgs_real place[3];
    double square = 0;
    ssdgs__light_place(light, place);
    for (int i = 0; i < 3; i++)
        square += ((double)place[i] + value[6 + i]) * ((double)place[i] + value[6 + i]);
    return light->kind != SSDGS_LIGHT_DIRECTIONAL || !(square > 0) ? 1 : sqrt(square);
}

static void ssdgs__correct(const ssdgs_photo *photo, const double value[10], ssdgs_camera *camera,
                           ssdgs_light *light) {
    *camera = photo->camera;
    *light = photo->light;
    const double length = ssdgs__moved_length(&photo->light, value);
    const int directional = light->kind == SSDGS_LIGHT_DIRECTIONAL;
    ssdgs_real place[3];
    ssdgs__light_place(&photo->light, place);
    double e[9], jacobian[9];
    ssdgs__rotate_by(value + 3, e, jacobian);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            double sum = j == 3 ? value[i] : 0;
            for (int l = 0; l < 3; l++) sum += e[3 * i + l] * (double)photo->camera.view[4 * l + j];
            camera->view[4 * i + j] = (ssdgs_real)sum;
        }
        const double moved = ((double)place[i] + value[6 + i]) / length;
        *(directional ? light->direction + i : light->position + i) =
            (ssdgs_real)(directional ? -moved : moved);
        if (value[9] < 0 || value[9] > 0)
            light->intensity[i] = (ssdgs_real)((double)photo->light.intensity[i] * exp(value[9]));
    }
}

/* dL/d(view) of the corrected camera -> dL/d(t', w). */
static void ssdgs__correct_backward(const ssdgs_photo *photo, const double value[10],
                                    const ssdgs_real dview[12], double d[6]) {
    double e[9], jacobian[9], m[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    ssdgs__rotate_by(value + 3, e, jacobian);
    for (int i = 0; i < 3; i++) {
        double de[3] = {0, 0, 0};
        for (int j = 0; j < 12; j++)
            de[j / 4] += (double)dview[4 * i + j % 4] * (double)photo->camera.view[j];
        for (int j = 0; j < 9; j++) m[3 * i + j / 3] += de[j % 3] * e[j];
    }
    const double delta[3] = {m[7] - m[5], m[2] - m[6], m[3] - m[1]}; /* exp(w + dw) = exp(J dw) exp(w) */
    for (int i = 0; i < 3; i++) {
        d[i] = (double)dview[4 * i + 3];
        d[3 + i] = 0;
        for (int j = 0; j < 3; j++) d[3 + i] += jacobian[3 * j + i] * delta[j];
    }
}

/* What moves a photograph's corrections. */
static void ssdgs__moves_of(const ssdgs_photo *photo, const double value[10], const ssdgs_frame *frame,
                            double correction_gradient[SSDGS__CORRECTIONS]) {
    ssdgs__correct_backward(photo, value, frame->view_gradient, correction_gradient);
    for (int i = 0; i < 3; i++)
        correction_gradient[6 + i] =
            (double)frame->light_gradient[i] / ssdgs__moved_length(&photo->light, value);
    for (int i = 0; i < 2; i++) correction_gradient[9 + i] = frame->intensity[i];
    for (int i = 0; i < 3; i++) correction_gradient[11 + i] = (double)frame->ambient_gradient[i];
}

#define SSDGS__PIXELS 1024               /* of a store task */
#define SSDGS__CLIPPED (ssdgs_real)0.999 /* stored values beyond may have been more */

typedef struct ssdgs__store_job {
    ssdgs_frame *frame;
    const ssdgs_photo *photo;
    const ssdgs_real *background; /* stored values */
    ssdgs_real *image, *target;   /* planes of stored values: rendered, photographed */
} ssdgs__store_job;

/* Of a channel of up to SSDGS__PIXELS pixels: u = pixels / (1 - T), its stored value s(u) and ds/du. A
   photograph's 1 may stand for anything brighter, so there s is at most 1; halves and floats stand for what
   they are. */
static void ssdgs__store_values(const ssdgs__store_job *job, int c, size_t begin, size_t n, ssdgs_real *u,
                                ssdgs_real *s, ssdgs_real *slope) {
    const ssdgs_frame *frame = job->frame;
    const ssdgs_real *t = frame->transmittance + begin,
                     *pixels = frame->pixels +
                               (size_t)frame->camera.width * (size_t)frame->camera.height * (size_t)c + begin;
    for (size_t i = 0; i < n; i++) u[i] = pixels[i] / (1 - t[i] > SSDGS__THIN ? 1 - t[i] : SSDGS__THIN);
    for (size_t i = n; i < n + 16; i++) u[i] = 0;
    if (frame->settings.transfer != SSDGS_TRANSFER_NONE) frame->context->k->srgb_encode(s, slope, u, n);
    else
        for (size_t i = 0; i < n; i++) s[i] = u[i], slope[i] = 1;
    if (ssdgs__is_light(job->photo)) return;
    for (size_t i = 0; i < n; i++) {
        const ssdgs_real shown = ssdgs__photo_number(job->photo, 4 * (begin + i) + (size_t)c);
        if (shown > SSDGS__CLIPPED && s[i] > shown) s[i] = shown, slope[i] = 0;
    }
}

/* The rendered image as stored values, (1 - T) s(u) + T background, beside the photograph on the same
   background. */
static void ssdgs__store_task(void *data, int index) {
    const ssdgs__store_job *job = (const ssdgs__store_job *)data;
    const ssdgs_frame *frame = job->frame;
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height,
                 begin = (size_t)index * SSDGS__PIXELS;
    const size_t n = begin + SSDGS__PIXELS < pixels ? SSDGS__PIXELS : pixels - begin;
    const ssdgs_real *t = frame->transmittance + begin;
    ssdgs__photo_planes(frame->context->k, job->photo, frame->settings.transfer, job->background, begin,
                        begin + n, job->target);
    ssdgs_real u[SSDGS__PIXELS + 16], s[SSDGS__PIXELS + 16], slope[SSDGS__PIXELS + 16];
    for (int c = 0; c < 3; c++) {
        ssdgs_real *image = job->image + pixels * (size_t)c + begin;
        ssdgs__store_values(job, c, begin, n, u, s, slope);
        for (size_t i = 0; i < n; i++) image[i] = (1 - t[i]) * s[i] + t[i] * job->background[c];
    }
}

/* d/d(pixels) = s'(u), d/dT = background - s(u) + u s'(u). */
static void ssdgs__store_backward_task(void *data, int index) {
    const ssdgs__store_job *job = (const ssdgs__store_job *)data;
    const size_t pixels = (size_t)job->frame->camera.width * (size_t)job->frame->camera.height;
    const size_t begin = (size_t)index * SSDGS__PIXELS;
    const size_t n = begin + SSDGS__PIXELS < pixels ? SSDGS__PIXELS : pixels - begin;
    ssdgs_real *gradient = job->frame->pixel_gradient + begin, *by_t = gradient + 3 * pixels;
    ssdgs_real u[SSDGS__PIXELS + 16], s[SSDGS__PIXELS + 16], slope[SSDGS__PIXELS + 16];
    for (size_t i = 0; i < n; i++) by_t[i] = 0;
    for (int c = 0; c < 3; c++, gradient += pixels) {
        ssdgs__store_values(job, c, begin, n, u, s, slope);
        for (size_t i = 0; i < n; i++) {
            by_t[i] += gradient[i] * (job->background[c] - s[i] + slope[i] * u[i]);
            gradient[i] *= slope[i];
        }
    }
}

/* As if all light were the lamp's, d(image)/d(ln intensity) is slope x pixels: the step of ln intensity, at
   most 1, that brings the image nearest to the photograph, and the sum of squares that it is sure by. */
static void ssdgs__intensity_fit(const ssdgs__store_job *job, double found[2]) {
    const size_t pixels = (size_t)job->frame->camera.width * (size_t)job->frame->camera.height;
    ssdgs_real u[SSDGS__PIXELS + 16], s[SSDGS__PIXELS + 16], slope[SSDGS__PIXELS + 16];
    double along = 0, across = 0;
    for (int c = 0; c < 3; c++)
        for (size_t begin = 0; begin < pixels; begin += SSDGS__PIXELS) {
            const size_t n = begin + SSDGS__PIXELS < pixels ? SSDGS__PIXELS : pixels - begin,
                         at = pixels * (size_t)c + begin;
            ssdgs__store_values(job, c, begin, n, u, s, slope);
            for (size_t i = 0; i < n; i++) {
                const double d = (double)slope[i] * (double)job->frame->pixels[at + i];
                across += d * d;
                along += d * ((double)job->target[at + i] - (double)job->image[at + i]);
            }
        }
    const double step = across > 0 ? along / across : 0; /* without bounds where a photograph is black */
    found[0] = step < -1 ? -1 : step > 1 ? 1 : step;
    found[1] = across;
}

typedef struct ssdgs__normals_job {
    const ssdgs_frame *frame;
    ssdgs_real weight, *scratch; /* (bands, SSDGS__BAND + 6, stride) */
    size_t stride;
} ssdgs__normals_job;

static void ssdgs__normals_task(void *data, int index) {
    const ssdgs__normals_job *job = (const ssdgs__normals_job *)data;
    const ssdgs_frame *frame = job->frame;
    const int w = frame->camera.width, h = frame->camera.height, begin = index * SSDGS__BAND;
    const int end = begin + SSDGS__BAND < h ? begin + SSDGS__BAND : h;
    const ssdgs_real *depth = ssdgs__layer_plane(frame, SSDGS__DEPTH_LAYER, 0),
                     *alpha = ssdgs__layer_plane(frame, SSDGS__DEPTH_LAYER, 2);
    ssdgs_real *rows = job->scratch + (size_t)index * (SSDGS__BAND + 6) * job->stride;
    ssdgs_real *out = rows + (SSDGS__BAND + 2) * job->stride;
    memset(rows, 0, (SSDGS__BAND + 2) * job->stride * sizeof *rows);
    for (int y = begin > 0 ? begin - 1 : 0; y <= end && y < h; y++)
        for (int x = 0; x < w; x++) {
            const size_t at = (size_t)y * (size_t)w + (size_t)x;
            if (alpha[at] >= SSDGS__SOLID)
                rows[(size_t)(y - begin + 1) * job->stride + 16 + (size_t)x] = depth[at] / alpha[at];
        }
    for (int y = begin; y < end; y++) {
        frame->context->k->depth_normals(&frame->camera, rows + (size_t)(y - begin + 1) * job->stride + 16,
                                         job->stride, y, job->weight, out);
        for (int c = 0; c < 4; c++)
            memcpy(frame->normal_gradient + ((size_t)c * (size_t)h + (size_t)y) * (size_t)w,
                   out + (size_t)c * job->stride, (size_t)w * sizeof *out);
    }
}

/* The gradient of weight x the mean of alpha - N . n, N the blended normals, n those of the blended depth,
   held fixed. */
static ssdgs_result ssdgs__normals_loss(ssdgs_frame *frame, ssdgs_real weight) {
    ssdgs_context *context = frame->context;
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height;
    const int bands = (frame->camera.height + SSDGS__BAND - 1) / SSDGS__BAND;
    frame->normal_gradient = NULL;
    if (!frame->layer_count || weight <= 0) return SSDGS_OK;
    const size_t stride = ssdgs__padded_stride(frame->camera.width);
    /* where the loss of the colours was found, which is done */
    SSDGS__RESERVE(frame->scratch->loss, frame->normal_gradient, ssdgs_real,
                   4 * pixels + (size_t)bands * (SSDGS__BAND + 6) * stride);
    ssdgs__normals_job job = {frame, weight / (ssdgs_real)pixels, frame->normal_gradient + 4 * pixels,
                              stride};
    ssdgs__parallel(context, bands, ssdgs__normals_task, &job);
    return SSDGS_OK;
}

/* A photograph to draw, and how. */
typedef struct ssdgs__photo_job {
    const ssdgs_photo *photo;
    const ssdgs_camera *camera; /* of the photograph, or refined */
    const ssdgs_light *light;
    const ssdgs_real *background; /* stored values */
    int terms;                    /* to render */
    int frozen[2];                /* 1: no gradient of the scattering, the shadow network's weights */
    ssdgs_real dssim, normal_weight;
    int exact; /* 1: for poses and lights; 0: with default options, which Gaussians learn from as well */
    const ssdgs_real *sky_share; /* what of settings.ambient comes to each Gaussian; NULL: to be found */
} ssdgs__photo_job;

/* A photograph's lights: `light`, which may be refined, and those beside its own. */
static ssdgs_result ssdgs__photo_lights(ssdgs_context *context, const ssdgs_photo *photo,
                                        const ssdgs_light *light, ssdgs_light **lights) {
    SSDGS__TRY(ssdgs__scratch_create(context));
    SSDGS__RESERVE(context->scratch->photo_lights, *lights, ssdgs_light, photo->more_count + 1);
    **lights = *light;
    if (photo->more_count) memcpy(*lights + 1, photo->more, (size_t)photo->more_count * sizeof *light);
    return SSDGS_OK;
}

/* The loss of one photograph and all gradients, left in the frame. */
static ssdgs_result ssdgs__photo_backward(ssdgs_frame *frame, ssdgs_model *model,
                                          const ssdgs__photo_job *photo_job, ssdgs__loss_values *values) {
    const ssdgs_camera *camera = photo_job->camera;
    ssdgs_context *context = model->context;
    const size_t pixels = (size_t)camera->width * (size_t)camera->height;
    ssdgs_render_options options =
        photo_job->exact ? ssdgs_render_options_exact() : ssdgs_render_options_default();
    const int tasks = (int)((pixels + SSDGS__PIXELS - 1) / SSDGS__PIXELS);
    options.terms = photo_job->terms;
    options.max_error = 0; /* all that a pixel blends gets a gradient */
    if (!photo_job->sky_share)
        memcpy(options.ambient[0], model->settings.ambient, sizeof model->settings.ambient);
    ssdgs_light *lights;
    ssdgs_result result = ssdgs__photo_lights(context, photo_job->photo, photo_job->light, &lights);
    if (!result)
        result = ssdgs__frame_of_model(frame, model, camera, lights, 1 + photo_job->photo->more_count,
                                       &options, 0, 1);
    if (!result && photo_job->sky_share) { /* set earlier, the frame would find it itself */
        memcpy(frame->options.ambient[0], model->settings.ambient, sizeof model->settings.ambient);
        frame->objects->sky_share = photo_job->sky_share;
    }
    if (!result) result = ssdgs__run_stages(frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_COMPOSITE);
    if (result) return result;
    ssdgs_real *image;
    SSDGS__RESERVE(frame->scratch->image, image, ssdgs_real, pixels * 6);
    ssdgs__store_job job = {frame, photo_job->photo, photo_job->background, image, image + pixels * 3};
    ssdgs__parallel(context, tasks, ssdgs__store_task, &job);
    frame->intensity[0] = frame->intensity[1] = 0;
    if (photo_job->exact) ssdgs__intensity_fit(&job, frame->intensity);
    const ssdgs__images images = {job.image, job.target, camera->width, camera->height};
    result =
        ssdgs__loss(context, &frame->scratch->loss, &images, photo_job->dssim, frame->pixel_gradient, values);
    if (result) return result;
    ssdgs__parallel(context, tasks, ssdgs__store_backward_task, &job);
    result = ssdgs__normals_loss(frame, photo_job->normal_weight);
    if (result) return result;
    memcpy(frame->frozen, photo_job->frozen, sizeof frame->frozen);
    /* Where no network mends what is wrong in shadows, surfaces that follow them run away. */
    if (!model->settings.shadow.layers) frame->visibility_given = 1;
    return ssdgs__run_stages(frame, SSDGS_STAGE_COMPOSITE_BACKWARD, SSDGS_STAGE_PROJECT_BACKWARD);
}

/* ---- Adam over the model ---- */

#define SSDGS__ADAM_CHUNK 8192
#define SSDGS__INTENSITY_STEP 0.3

typedef struct ssdgs__adam_range {
    ssdgs_real *parameter, *mean, *square;
    const ssdgs_real *gradient;
    size_t n;
    ssdgs__adam_rate rate;
    int group;
    size_t first_chunk;
    size_t bad; /* first non-finite gradient + 1, per range */
} ssdgs__adam_range;

typedef struct ssdgs__adam_job {
    const ssdgs__kernels *k;
    ssdgs__adam_range range[(int)SSDGS_CHANNELS + (int)SSDGS__GLOBAL_GROUPS];
    int ranges;
    size_t chunks;
} ssdgs__adam_job;

static void ssdgs__finite_task(void *data, int index) {
    ssdgs__adam_job *job = (ssdgs__adam_job *)data;
    ssdgs__adam_range *r = job->range + index;
    if (job->k->within(r->gradient, r->n, SSDGS__MOST)) return;
    for (size_t i = 0; i < r->n && !r->bad; i++)
        if (!ssdgs__finite(r->gradient[i])) r->bad = i + 1;
}

static void ssdgs__adam_task(void *data, int index) {
    const ssdgs__adam_job *job = (const ssdgs__adam_job *)data;
    const ssdgs__adam_range *r = job->range;
    while (r + 1 < job->range + job->ranges && r[1].first_chunk <= (size_t)index) r++;
    const size_t begin = ((size_t)index - r->first_chunk) * SSDGS__ADAM_CHUNK;
    const size_t n = r->n - begin < SSDGS__ADAM_CHUNK ? r->n - begin : SSDGS__ADAM_CHUNK;
    job->k->adam(r->parameter + begin, r->gradient + begin, r->mean + begin, r->square + begin, n, &r->rate);
}

static ssdgs_real ssdgs__bias_correction(double beta,
                                         int steps) { /* 1 / (1 - beta^steps), the power by squaring */
    double power = 1, square = beta;
    for (int n = steps; n; n >>= 1, square *= square)
        if (n & 1) power *= square;
    return (ssdgs_real)(1 / (1 - power));
}

/* Adds a group's range of n numbers, whose arrays are the caller's to set. */
static ssdgs__adam_range *ssdgs__adam_add(ssdgs__adam_job *job, const ssdgs_trainer *trainer, int group,
                                          double t, double epsilon, size_t n) {
    ssdgs__adam_range *r = job->range + job->ranges++;
    const ssdgs_train_options *o = &trainer->options;
    const double rate = ssdgs__group_rate(trainer, group, t) * sqrt((double)o->batch) *
                        (t < 0.9 * ssdgs__schedule_end(o) ? 1 : (double)o->finish);
    r->group = group;
    r->n = n;
    r->bad = 0;
    r->rate.rate = (ssdgs_real)(rate < 1e18 ? rate : 1e18); /* times a gradient, at most 1e18, it is finite */
    r->rate.correct_mean = ssdgs__bias_correction(0.9, trainer->run.steps[group] + 1);
    r->rate.correct_square = ssdgs__bias_correction(0.999, trainer->run.steps[group] + 1);
    if (group == SSDGS__G_POSITION) epsilon /= trainer->unit; /* of a move by the bounds' longest side */
    r->rate.epsilon = (ssdgs_real)(epsilon < 1e-15 ? 1e-15 : epsilon < 1e30 ? epsilon : 1e30);
    r->first_chunk = job->chunks;
    job->chunks += (n + SSDGS__ADAM_CHUNK - 1) / SSDGS__ADAM_CHUNK;
    return r;
}

/* Which terms a group serves: it rests while none of them is in use. Where light is deferred an ASG weight is
   how soft shadows are. */
static int ssdgs__group_used(int group, int terms, int asg) {
    switch (group) {
    case SSDGS__G_DIFFUSE: return terms & SSDGS_DIFFUSE_TERM;
    case SSDGS__G_SPECULAR: return terms & SSDGS_SPECULAR_TERM;
    case SSDGS__G_ASG_WEIGHT:
        return terms & (SSDGS_SPECULAR_TERM | (asg == SSDGS_ASG_DEFERRED ? SSDGS_SHADOW_TERM : 0));
    case SSDGS__G_SCATTERING: return terms & SSDGS_SCATTERING_TERM;
    case SSDGS__G_MATERIAL: return terms & (SSDGS_SCATTERING_TERM | SSDGS_SHADOW_TERM);
    case SSDGS__PLANE_GROUPS + SSDGS__SHADOW_NET: return terms & SSDGS_SHADOW_TERM;
    case SSDGS__PLANE_GROUPS + SSDGS__SCATTERING_NET: return terms & SSDGS_SCATTERING_TERM;
    default: return group < SSDGS__PLANE_GROUPS || terms & SSDGS_SPECULAR_TERM;
    }
}

/* What the photographs of a step have in common. */
typedef struct ssdgs__step {
    double t; /* schedule time */
    int terms, learns[SSDGS__GROUPS];
} ssdgs__step;

/* By the frame's gradients. pixels: of a photograph. */
static ssdgs_result ssdgs__adam_step(ssdgs_trainer *trainer, const ssdgs_frame *frame, double pixels,
                                     const ssdgs__step *step) {
    ssdgs_context *context = trainer->context;
    ssdgs_model *model = trainer->model;
    const double epsilon = (double)trainer->options.adam_epsilon / (255 * 3 * pixels);
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&model->settings, first);
    ssdgs__adam_job job;
    job.k = context->k;
    job.ranges = 0;
    job.chunks = 0;
    for (int group = 0; group < SSDGS__GROUPS; group++) {
        const int shared = group - SSDGS__PLANE_GROUPS, own = shared < 0;
        if (!step->learns[group] || !ssdgs__group_used(group, step->terms, model->settings.asg)) continue;
        size_t at = own ? (size_t)ssdgs__group_plane[group] * trainer->stride : first[shared];
        const size_t n = own ? (size_t)model->count : first[shared + 1] - at;
        int planes = own ? ssdgs__group_plane[group + 1] - ssdgs__group_plane[group] : n > 0;
        for (; planes; planes--, at += trainer->stride) {
            ssdgs__adam_range *r = ssdgs__adam_add(&job, trainer, group, step->t, epsilon, n);
            r->parameter = (own ? model->gaussians : model->globals) + at;
            r->gradient = (own ? frame->gradient : frame->global_gradient) + at;
            r->mean = (own ? trainer->mean : trainer->global_mean) + at;
            r->square = (own ? trainer->square : trainer->global_square) + at;
        }
    }
    ssdgs__parallel(context, job.ranges, ssdgs__finite_task, &job);
    for (int i = 0; i < job.ranges; i++)
        if (job.range[i].bad)
            return ssdgs__fail(context, SSDGS_ERR_NONFINITE,
                               "iteration %d refused: the gradient of %s, element %zu, is not finite",
                               trainer->run.iteration, ssdgs__group_names[job.range[i].group],
                               job.range[i].bad - 1);
    ssdgs__parallel(context, (int)job.chunks, ssdgs__adam_task, &job);
    for (int group = 0; group < SSDGS__GROUPS; group++)
        trainer->run.steps[group] +=
            step->learns[group] && ssdgs__group_used(group, step->terms, model->settings.asg);
    return SSDGS_OK;
}

/* Adam's step of a number at rate 1, whose moments it moves. */
static double ssdgs__adam_one(double gradient, double *mean, double *square, int steps) {
    *mean = 0.9 * *mean + 0.1 * gradient;
    *square = 0.999 * *square + 0.001 * gradient * gradient;
    return *mean * (double)ssdgs__bias_correction(0.9, steps) /
           (sqrt(*square * (double)ssdgs__bias_correction(0.999, steps)) + 1e-15);
}

/* Adam on a photograph's camera (part 0) or light (part 1). A move's rate is a share of `unit`, a direction's
   of a radian, a turn's of the angle across the picture's width. */
static void ssdgs__correction_step(ssdgs__correction *c, const ssdgs_photo *photo, const double *gradient,
                                   int part, double rate, double unit) {
    const double angle = 2 * atan(0.5 * photo->camera.width / (double)photo->camera.fx);
    const int steps = ++c->steps[part];
    if (part && photo->light.kind == SSDGS_LIGHT_DIRECTIONAL) unit = 1;
    for (int i = part ? 6 : 0; i < (part ? 9 : 6); i++) {
        const double step = ssdgs__adam_one(gradient[i], c->mean + i, c->square + i, steps);
        c->value[i] -= rate * (i / 3 == 1 ? angle : unit) * step;
    }
}

/* A point (w = 1) or direction (0) of the world in the camera's frame. */
static void ssdgs__to_camera(const ssdgs_camera *camera, const double world[3], double w, double seen[3]) {
    int j;
    for (int i = 0; i < 3; i++)
        for (seen[i] = w * (double)camera->view[4 * i + 3], j = 0; j < 3; j++)
            seen[i] += (double)camera->view[4 * i + j] * world[j];
}

static const ssdgs_light *ssdgs__photo_light(const ssdgs_photo *photo, int i) {
    return i ? photo->more + i - 1 : &photo->light;
}

/* A light's mean E at a place, no nearer than `nearest`. */
static double ssdgs__light_at(const ssdgs_light *light, const double place[3], double nearest) {
    double d[3], distance2 = 0, slope[3], intensity = 0;
    const ssdgs__reaching reaching = ssdgs__reaching_of(light, light->direction, 1);
    for (int c = 0; c < 3; c++) {
        d[c] = place[c] - (double)light->position[c];
        distance2 += d[c] * d[c];
        intensity += (double)light->intensity[c] / 3;
    }
    if (light->kind == SSDGS_LIGHT_DIRECTIONAL) return intensity;
    return intensity / (distance2 > nearest * nearest ? distance2 : nearest * nearest) *
           ssdgs__reach_at(&reaching, d, slope);
}

/* Goes only a part of the way to the intensity that fits best: what does not fit yet may be the model. */
static void ssdgs__intensity_step(ssdgs__correction *c, const double *correction_gradient) {
    c->value[9] += SSDGS__INTENSITY_STEP * correction_gradient[9];
    c->sure = correction_gradient[10];
}

/* Keeps the intensities' mean, each weighted by how sure it is: twice the light on colours half as bright
   looks the same. */
static void ssdgs__anchor_intensities(ssdgs_trainer *trainer) {
    double sum = 0, weight = 0;
    for (int i = 0; i < trainer->photo_count; i++) {
        sum += trainer->corrections[i].sure * trainer->corrections[i].value[9];
        weight += trainer->corrections[i].sure;
    }
    for (int i = 0; i < trainer->photo_count && weight > 0; i++)
        if (!trainer->photos[i].more_count) trainer->corrections[i].value[9] -= sum / weight;
}

/* The bounds' longest side. */
static double ssdgs__bounds_side(const ssdgs_train_options *o) {
    double longest = 0;
    for (int j = 0; j < 3; j++) {
        const double side = (double)o->bounds_max[j] - (double)o->bounds_min[j];
        longest = side > longest ? side : longest;
    }
    return longest;
}

static void ssdgs__bounds_centre(const ssdgs_train_options *o, double centre[3]) {
    for (int j = 0; j < 3; j++) centre[j] = 0.5 * ((double)o->bounds_min[j] + (double)o->bounds_max[j]);
}

/* Takes out of the corrections the turn and the move of the bounds' centre that all cameras have in common,
   to first order: the scene would follow, and its photographs look the same. */
static void ssdgs__anchor_cameras(ssdgs_trainer *trainer) {
    double centre[3], move[3] = {0, 0, 0}, turn[3] = {0, 0, 0};
    ssdgs__bounds_centre(&trainer->options, centre);
    double x[3];
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < trainer->photo_count; i++) {
            const ssdgs_camera *camera = &trainer->photos[i].camera;
            double *value = trainer->corrections[i].value;
            double p[3];
            ssdgs__to_camera(camera, centre, 1, p);
            if (pass) {
                ssdgs__to_camera(camera, move, 0, x);
                for (int j = 0; j < 3; j++) value[j] -= x[j];
                ssdgs__to_camera(camera, turn, 0, x);
                for (int j = 0; j < 3; j++) value[3 + j] -= x[j];
                double y[3];
                ssdgs__cross(x, p, y);
                for (int j = 0; j < 3; j++) value[j] += y[j];
            } else {
                ssdgs__cross(value + 3, p, x);
                for (int j = 0; j < 3; j++)
                    for (int l = 0; l < 3; l++) {
                        move[j] += (double)camera->view[4 * l + j] * (value[l] + x[l]) / trainer->photo_count;
                        turn[j] += (double)camera->view[4 * l + j] * value[3 + l] / trainer->photo_count;
                    }
            }
        }
}

/* ==== >>density  clone, split, prune: the number of Gaussians ==== */

/* Reads gradients gathered over the photographs. Adds and removes Gaussians. Called by steps. */

#define SSDGS__STATISTICS 3
#define SSDGS__FULL 0.36       /* of densify_until: so long there may be options.surplus times as many */
#define SSDGS__LEAN 0.72       /* and from here on no more than the budget */
#define SSDGS__SPLIT_SIZE 0.01 /* of the scene's extent: smaller ones are cloned, larger ones split */
#define SSDGS__FAINT 0.005     /* opacity below which a Gaussian is removed */
#define SSDGS__FADE 0.8        /* px: what an opaque Gaussian costs where photographs show `background` */
#define SSDGS__ONE_LIGHT_WEIGHT \
    0.02 /* weight of c_s and c_sss in the loss where photographs have one light */
#define SSDGS__SMALL_OBJECT \
    0.15 /* an object that fills less of its photographs gets its Gaussians all the same */

static void ssdgs__rearranged(ssdgs_trainer *trainer) {
    trainer->arrangement = ++trainer->model->arrangement;
    trainer->run.sky_ready = 0;
}

/* Room for `count` Gaussians in the model, the moments and the statistics, which start anew when they move:
   all or nothing. */
static ssdgs_result ssdgs__trainer_grow(ssdgs_trainer *trainer, size_t count) {
    ssdgs_context *context = trainer->context;
    ssdgs_model *model = trainer->model;
    ssdgs_real **const planes[3] = {&model->gaussians, &trainer->mean, &trainer->square};
    const size_t n = (size_t)model->count, old[3] = {model->capacity, trainer->stride, trainer->stride};
    if (trainer->mean && count <= model->capacity) return SSDGS_OK;
    const size_t capacity = count <= model->capacity
                                ? model->capacity
                                : (count + count / 4 + SSDGS__BLOCK - 1) / SSDGS__BLOCK * SSDGS__BLOCK;
    const size_t bytes = ssdgs__times(capacity, SSDGS_CHANNELS * sizeof(ssdgs_real));
    if (bytes == SIZE_MAX) return ssdgs__fail(context, SSDGS_ERR_LIMIT, "%zu Gaussians", capacity);
    ssdgs_real *statistics =
        (ssdgs_real *)ssdgs__allocate(context, (SSDGS__STATISTICS + 2) * capacity * sizeof(ssdgs_real));
    ssdgs_real *grown[3];
    for (size_t i = 0; i < 3; i++)
        grown[i] = statistics ? (ssdgs_real *)ssdgs__allocate(context, bytes) : NULL;
    if (!statistics || !grown[0] || !grown[1] || !grown[2]) {
        for (size_t i = 0; i < 3; i++) ssdgs__release(context, grown[i]);
        ssdgs__release(context, statistics);
        return SSDGS_ERR_MEMORY;
    }
    for (size_t i = 0; i < 3; i++) {
        for (size_t c = 0; c < SSDGS_CHANNELS && *planes[i]; c++)
            memcpy(grown[i] + c * capacity, *planes[i] + c * old[i], n * sizeof(ssdgs_real));
        ssdgs__release(context, *planes[i]);
        *planes[i] = grown[i];
    }
    ssdgs__release(context, trainer->screen_gradient);
    trainer->screen_gradient = statistics;
    trainer->screen_count = statistics + capacity;
    trainer->worth = statistics + 2 * capacity;
    trainer->sky_share = statistics + SSDGS__STATISTICS * capacity;
    trainer->run.sky_ready = 0;
    if (capacity != model->capacity) model->arrangement++;
    trainer->arrangement = model->arrangement;
    trainer->stride = model->capacity = capacity;
    return SSDGS_OK;
}

/* Sum of twelve uniforms less six: normal enough to scatter split Gaussians, the same on every machine. */
static double ssdgs__normal(uint64_t key, uint64_t counter) {
    double sum = -6;
    for (int i = 0; i < 12; i++) sum += ssdgs__uniform(key, counter * 12 + (uint64_t)i);
    return sum;
}

typedef struct ssdgs__ranked {
    ssdgs_real value;
    uint32_t index;
} ssdgs__ranked;

static int ssdgs__ranked_compare(const void *a, const void *b) { /* largest first, then by index */
    const ssdgs__ranked *x = (const ssdgs__ranked *)a, *y = (const ssdgs__ranked *)b;
    if (x->value != y->value) return x->value > y->value ? -1 : 1;
    return x->index < y->index ? -1 : x->index > y->index;
}

/* Puts the Gaussians listed in the order of ssdgs__split and drops the others. scratch: count values. */
static void ssdgs__reorder(ssdgs_trainer *trainer, uint64_t *keys, size_t count, ssdgs_real *scratch) {
    ssdgs_model *model = trainer->model;
    ssdgs__split(model->gaussians + SSDGS_POSITION * trainer->stride, trainer->stride, keys, count);
    ssdgs__arrange(model->gaussians, SSDGS_CHANNELS, trainer->stride, keys, count, scratch);
    ssdgs__arrange(trainer->mean, SSDGS_CHANNELS, trainer->stride, keys, count, scratch);
    ssdgs__arrange(trainer->square, SSDGS_CHANNELS, trainer->stride, keys, count, scratch);
    model->count = (int)count;
    ssdgs__rearranged(trainer);
}

/* Clears what Adam knows of a Gaussian. */
static void ssdgs__forget(ssdgs_trainer *trainer, size_t at) {
    for (size_t c = 0; c < SSDGS_CHANNELS; c++)
        trainer->mean[c * trainer->stride + at] = trainer->square[c * trainer->stride + at] = 0;
}

/* The log scale of its longest axis. */
static ssdgs_real ssdgs__longest(const ssdgs_trainer *trainer, size_t at) {
    const ssdgs_real *scale = trainer->model->gaussians + SSDGS_LOG_SCALE * trainer->stride + at;
    ssdgs_real longest = *scale;
    for (size_t c = 1; c < 3; c++)
        longest = scale[c * trainer->stride] > longest ? scale[c * trainer->stride] : longest;
    return longest;
}

/* Makes two Gaussians of `from`, the second at `to`: clones if it is small; two samples of it, smaller, if it
   is large. */
static void ssdgs__make_two(ssdgs_trainer *trainer, size_t from, size_t to) {
    const ssdgs_train_options *o = &trainer->options;
    const uint64_t key = o->seed ^ ((uint64_t)trainer->run.iteration << 32) ^ from;
    const size_t stride = trainer->stride;
    ssdgs_real *p = trainer->model->gaussians;
    for (size_t c = 0; c < SSDGS_CHANNELS; c++) p[c * stride + to] = p[c * stride + from];
    ssdgs__forget(trainer, to);
    if ((double)ssdgs__longest(trainer, from) <= log(SSDGS__SPLIT_SIZE * trainer->extent))
        return; /* the copy is the clone */
    ssdgs_real raw[4];
    for (int c = 0; c < 4; c++) raw[c] = p[(size_t)(SSDGS_ROTATION + c) * stride + from];
    ssdgs_real q[4], r[9];
    ssdgs__rotation_scalar(raw, q, r);
    for (int half = 0; half < 2; half++) {
        const size_t at = half ? to : from;
        double offset[3];
        for (int c = 0; c < 3; c++) {
            ssdgs_real *scale = p + (size_t)(SSDGS_LOG_SCALE + c) * stride + at;
            offset[c] = (double)ssdgs__exp_scalar(*scale) * ssdgs__normal(key, (uint64_t)(3 * half + c));
            *scale += (ssdgs_real)-0.47000362924573558; /* ln 1.6 */
        }
        for (int c = 0; c < 3; c++)
            for (int j = 0; j < 3; j++)
                p[(size_t)(SSDGS_POSITION + c) * stride + at] +=
                    (ssdgs_real)((double)r[3 * c + j] * offset[j]);
    }
    ssdgs__forget(trainer, from);
}

typedef struct ssdgs__outlines_job {
    const ssdgs_trainer *trainer;
    const ssdgs_camera *cameras; /* of the photographs, as refined so far */
    unsigned char *outside;      /* per Gaussian */
} ssdgs__outlines_job;

/* Whether photographs exceed a share of all. Of eight or more one may be wrong: one alone is not enough. */
static int ssdgs__several(int photographs, int all, double share) {
    return photographs > (all < 8 ? 0 : 1) && photographs > share * all;
}

/* 0: the place is not in the picture. 1: it is. 2: and the photograph is transparent there and around. */
static int ssdgs__outline_side(const ssdgs_photo *photo, const ssdgs_camera *camera, int transparent,
                               const ssdgs_real x[3]) {
    const int reach = (camera->width + 127) / 128;
    ssdgs_real t[3];
    for (int c = 0; c < 3; c++) {
        const ssdgs_real *row = camera->view + 4 * c;
        t[c] = row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3];
    }
    if (!(t[2] > 0)) return 0;
    const ssdgs_real u = camera->fx * t[0] / t[2] + camera->cx;
    const ssdgs_real v = camera->fy * t[1] / t[2] + camera->cy;
    if (!(u >= 0 && v >= 0 && u < (ssdgs_real)camera->width && v < (ssdgs_real)camera->height)) return 0;
    for (int i = 0; i < 5 && transparent; i++) { /* the centre and beside it */
        const int px = (int)u + reach * ((i == 1) - (i == 2)), py = (int)v + reach * ((i == 3) - (i == 4));
        if (px < 0 || py < 0 || px >= camera->width || py >= camera->height) continue;
        if (ssdgs__photo_alpha(photo, (size_t)py * (size_t)camera->width + (size_t)px)) return 1;
    }
    return transparent ? 2 : 1;
}

static void ssdgs__outlines_task(void *data, int chunk) {
    const ssdgs__outlines_job *job = (const ssdgs__outlines_job *)data;
    const ssdgs_trainer *trainer = job->trainer;
    const size_t n = (size_t)trainer->model->count, begin = (size_t)chunk * SSDGS__CHUNK;
    const size_t end = begin + SSDGS__CHUNK < n ? begin + SSDGS__CHUNK : n;
    const ssdgs_real *position = trainer->model->gaussians + (size_t)SSDGS_POSITION * trainer->stride;
    for (size_t i = begin; i < end; i++) {
        const ssdgs_real x[3] = {position[i], position[trainer->stride + i],
                                 position[2 * trainer->stride + i]};
        int seen = 0, outside = 0;
        for (int photo = 0; photo < trainer->photo_count; photo++) {
            const int outlines = trainer->transparent[photo] == 2;
            const int side = ssdgs__outline_side(trainer->photos + photo, job->cameras + photo, outlines, x);
            seen += side > 0;
            outside += side == 2;
        }
        job->outside[i] = !seen || ssdgs__several(outside, seen, (double)trainer->options.prune_outside);
    }
}

/* Marks the Gaussians outside of the object's outlines. */
static ssdgs_result ssdgs__outlines(const ssdgs_trainer *trainer, unsigned char *outside) {
    ssdgs_context *context = trainer->context;
    memset(outside, 0, (size_t)trainer->model->count);
    if (!(trainer->options.prune_outside > 0) || !trainer->run.outlines) return SSDGS_OK;
    ssdgs_camera *cameras =
        (ssdgs_camera *)ssdgs__allocate(context, (size_t)trainer->photo_count * sizeof *cameras);
    if (!cameras) return SSDGS_ERR_MEMORY;
    for (int i = 0; i < trainer->photo_count; i++) {
        ssdgs_light light;
        ssdgs__correct(trainer->photos + i, trainer->corrections[i].value, cameras + i, &light);
    }
    ssdgs__outlines_job job = {trainer, cameras, outside};
    ssdgs__parallel(context, ssdgs__chunks(trainer->model->count), ssdgs__outlines_task, &job);
    ssdgs__release(context, cameras);
    return SSDGS_OK;
}

/* So many Gaussians may there be until the next round of density control. */
static size_t ssdgs__allowed(const ssdgs_trainer *trainer) {
    const ssdgs_train_options *o = &trainer->options;
    const double t = ssdgs__schedule_time(o, trainer->run.iteration + o->densify_every) / o->densify_until;
    const double left = t < SSDGS__FULL   ? 1
                        : t < SSDGS__LEAN ? (SSDGS__LEAN - t) / (SSDGS__LEAN - SSDGS__FULL)
                                          : 0;
    const double most = trainer->budget * (1 + left * ((double)o->surplus - 1));
    return most < SSDGS__MAX_GAUSSIANS ? (size_t)(most + 0.5) : SSDGS__MAX_GAUSSIANS;
}

static ssdgs_result ssdgs__densify(ssdgs_trainer *trainer) {
    ssdgs_context *context = trainer->context;
    ssdgs_model *model = trainer->model;
    const ssdgs_train_options *o = &trainer->options;
    const size_t n = (size_t)model->count, allowed = ssdgs__allowed(trainer);
    const double largest =
        log(0.1 * trainer->extent > 4 * trainer->run.start_size ? 0.1 * trainer->extent
                                                                : 4 * trainer->run.start_size);
    const ssdgs_real faint = (ssdgs_real)log(SSDGS__FAINT / (1 - SSDGS__FAINT));
    /* opacities were reset since the last control: worths say little */
    const int before = trainer->run.iteration - o->batch, last = ssdgs__last_reset(o, before);
    const int recovering = last && last > before - o->densify_every;
    uint64_t *order;
    size_t kept = 0, dropped = 0, wanted = 0;
    const ssdgs_real *p = model->gaussians;
    /* two lists of n candidates; at most 2 n Gaussians' order, a plane of them; what is dropped */
    ssdgs__ranked *candidates = (ssdgs__ranked *)ssdgs__allocate(
        context, n * (2 * sizeof *candidates + 2 * sizeof *order + 2 * sizeof *p + 1) + 1);
    if (!candidates) return SSDGS_ERR_MEMORY;
    order = (uint64_t *)(void *)(candidates + 2 * n);
    unsigned char *drop = (unsigned char *)((ssdgs_real *)(order + 2 * n) + 2 * n);
    ssdgs_result result = ssdgs__outlines(trainer, drop);
    if (result) {
        ssdgs__release(context, candidates);
        return result;
    }
    for (size_t i = 0; i < n; i++) {
        drop[i] = drop[i] || p[SSDGS_OPACITY * trainer->stride + i] < faint ||
                  (double)ssdgs__longest(trainer, i) > largest;
        dropped += drop[i];
        if (drop[i] || !(trainer->screen_count[i] > 0)) continue;
        const ssdgs_real gradient = trainer->screen_gradient[i] / trainer->screen_count[i];
        if (gradient < o->densify_gradient) continue;
        candidates[wanted].value = gradient;
        candidates[wanted++].index = (uint32_t)i;
    }
    if (dropped == n) { /* never extinct */
        drop[0] = 0;
        dropped--;
    }
    qsort(candidates, wanted, sizeof *candidates, ssdgs__ranked_compare);
    size_t room = allowed > n - dropped ? allowed - (n - dropped) : 0;
    if (wanted > room || n - dropped > allowed) {
        /* over the cap those of least worth go at once; up to it they make room for new ones, a twentieth
           at a time */
        ssdgs__ranked *least = candidates + n;
        const size_t over = n - dropped > allowed ? n - dropped - allowed : 0;
        const size_t more = wanted > room ? wanted - room : 0;
        size_t spare = over + (recovering ? 0 : more < n / 20 ? more : n / 20), m = 0;
        for (size_t i = 0; i < n; i++)
            if (!drop[i]) { /* those of photographs that were not drawn: last */
                const ssdgs_real seen = trainer->screen_count[i];
                least[m].value = seen > 0 ? -trainer->worth[i] / seen : (ssdgs_real)-1e30;
                least[m++].index = (uint32_t)i;
            }
        qsort(least, m, sizeof *least, ssdgs__ranked_compare);
        for (size_t i = 0; i < spare && i + 1 < m; i++, dropped++) {
            drop[least[i].index] = 1;
            room += i >= over;
        }
    }
    wanted = wanted < room ? wanted : room;
    result = ssdgs__trainer_grow(trainer, n + wanted);
    if (result) {
        ssdgs__release(context, candidates);
        return result;
    }
    size_t i, added;
    for (i = 0, added = 0; i < wanted; i++)
        if (!drop[candidates[i].index]) ssdgs__make_two(trainer, candidates[i].index, n + added++);
    for (i = 0; i < n + added; i++)
        if (i >= n || !drop[i]) order[kept++] = i;
    ssdgs__reorder(trainer, order, kept, (ssdgs_real *)(order + 2 * n));
    memset(trainer->screen_gradient, 0, SSDGS__STATISTICS * trainer->stride * sizeof(ssdgs_real));
    ssdgs__release(context, candidates);
    return SSDGS_OK;
}

static void ssdgs__reset_opacity(ssdgs_trainer *trainer) {
    const ssdgs_real most = (ssdgs_real)-4.5951198501345898; /* logit 0.01 */
    ssdgs_real *opacity = trainer->model->gaussians + (size_t)SSDGS_OPACITY * trainer->stride;
    for (int i = 0; i < trainer->model->count; i++) {
        opacity[i] = opacity[i] < most ? opacity[i] : most;
        trainer->mean[(size_t)SSDGS_OPACITY * trainer->stride + (size_t)i] =
            trainer->square[(size_t)SSDGS_OPACITY * trainer->stride + (size_t)i] = 0;
    }
}

/* Adds what a photograph says of its Gaussians to (SSDGS__STATISTICS, stride) sums. */
static void ssdgs__gather_statistics(const ssdgs_trainer *trainer, const ssdgs_frame *frame,
                                     ssdgs_real small_object_gain, ssdgs_real *sums) {
    const ssdgs_real half_w = small_object_gain * (ssdgs_real)frame->camera.width / 2,
                     half_h = small_object_gain * (ssdgs_real)frame->camera.height / 2;
    for (int i = 0; i < frame->shaded_count; i++) {
        const size_t g = frame->shaded[i];
        const ssdgs_real *d = frame->splat_gradient + SSDGS__SPLAT * g, x = d[0] * half_w, y = d[1] * half_h;
        sums[g] += SSDGS__SQRT(x * x + y * y);
        sums[trainer->stride + g] += 1;
        sums[2 * trainer->stride + g] += d[5] < 0 ? -d[5] : d[5];
    }
}

/* ==== >>steps  the trainer's public functions ==== */

/* Judges the photographs, starts a run, steps, evaluates, refines. Users call it. */

SSDGS__SMALL_BEGIN

static ssdgs_result ssdgs__options_check(ssdgs_context *context, const ssdgs_train_options *o) {
    if (o->version != SSDGS_VERSION)
        return ssdgs__fail(context, SSDGS_ERR_OPTIONS,
                           "train options: not made by ssdgs_train_options_default()");
    SSDGS__TRY(ssdgs__numbers_check(context, "train options", ssdgs__train_numbers, SSDGS__TRAIN_NUMBERS, o));
    SSDGS__REFUSE(o->sum.add && (o->sum.processes < 1 || o->sum.rank < 0 || o->sum.rank >= o->sum.processes ||
                                 o->batch % o->sum.processes),
                  "train options: process %d of %d cannot share a batch of %d", o->sum.rank, o->sum.processes,
                  o->batch);
    for (int i = 0; i < 3; i++)
        SSDGS__REFUSE(!(o->bounds_min[i] < o->bounds_max[i]),
                      "train options: bounds_min[%d] = %g is not below bounds_max[%d] = %g", i,
                      (double)o->bounds_min[i], i, (double)o->bounds_max[i]);
    SSDGS__REFUSE(!(ssdgs__bounds_side(o) >= 2e-15 && ssdgs__bounds_side(o) <= 2e15),
                  "train options: the longest side of bounds_min .. bounds_max, %g, is not within "
                  "2e-15 .. 2e15",
                  ssdgs__bounds_side(o));
    return SSDGS_OK;
}

/* A random place in the bounds, and where it lies between them. */
static void ssdgs__draw_place(const ssdgs_train_options *o, uint64_t draw, double u[3], ssdgs_real x[3]) {
    for (int c = 0; c < 3; c++) {
        u[c] = ssdgs__uniform(o->seed, 3 * draw + (uint64_t)c);
        x[c] = (ssdgs_real)((double)o->bounds_min[c] +
                            u[c] * ((double)o->bounds_max[c] - (double)o->bounds_min[c]));
    }
}

/* Whether more than a tenth of what a photograph shows lies beside the bounds' picture. */
static int ssdgs__shows_beside(const ssdgs_photo *photo, const ssdgs_train_options *o) {
    const ssdgs_camera *camera = &photo->camera;
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30}, shown = 0, beside = 0;
    for (int corner = 0; corner < 8; corner++) {
        double world[3], seen[3];
        for (int c = 0; c < 3; c++)
            world[c] = (double)(corner >> c & 1 ? o->bounds_max[c] : o->bounds_min[c]);
        ssdgs__to_camera(camera, world, 1, seen);
        if (!(seen[2] > 0)) return 0; /* reaching behind the camera it may be anywhere */
        for (int c = 0; c < 2; c++) {
            const double p = (double)(c ? camera->fy : camera->fx) * seen[c] / seen[2] +
                             (double)(c ? camera->cy : camera->cx);
            low[c] = p < low[c] ? p : low[c];
            high[c] = p > high[c] ? p : high[c];
        }
    }
    for (int y = 0; y < camera->height; y++)
        for (int x = 0; x < camera->width; x++) {
            if (ssdgs__photo_alpha(photo, (size_t)y * (size_t)camera->width + (size_t)x) < 32768) continue;
            shown++;
            beside += x + 1 < low[0] || x > high[0] || y + 1 < low[1] || y > high[1];
        }
    return beside > 0.1 * shown;
}

/* Of eight or more outlines leaves out the wrong ones. The object's places are those where at most one
   photograph, or a tenth, is transparent. One that is transparent at more than a third of them has a wrong
   mask or pose. Where most photographs show something beside the bounds' picture these do not hold the
   object, and its edges alone would be judged: then none is wrong. */
static ssdgs_result ssdgs__doubt_outlines(ssdgs_trainer *trainer) {
    enum { places = 2048, few = 30 };
    const int photos = trainer->photo_count;
    int *shown =
        (int *)ssdgs__allocate(trainer->context, 2 * (size_t)photos * sizeof *shown + (size_t)photos);
    int outlined = 0, beside = 0, wrong = 0, first = 0;
    if (!shown) return SSDGS_ERR_MEMORY;
    int *refused = shown + photos;
    unsigned char *side = (unsigned char *)(refused + photos);
    for (int i = 0; i < photos; i++) outlined += trainer->transparent[i] == 2;
    for (int place = 0; place < places && outlined >= 8; place++) {
        double u[3];
        ssdgs_real x[3];
        int seen = 0, outside = 0;
        ssdgs__draw_place(&trainer->options, (uint64_t)place, u, x);
        for (int i = 0; i < photos; i++) {
            const ssdgs_photo *photo = trainer->photos + i;
            side[i] = trainer->transparent[i] == 2
                          ? (unsigned char)ssdgs__outline_side(photo, &photo->camera, 1, x)
                          : 0;
            seen += side[i] > 0;
            outside += side[i] == 2;
        }
        if (outside > 1 && 10 * outside > seen) continue;
        for (int i = 0; i < photos; i++) {
            shown[i] += side[i] > 0;
            refused[i] += side[i] == 2;
        }
    }
    for (int i = 0; i < photos; i++) {
        refused[i] = shown[i] >= few && 3 * refused[i] > shown[i];
        wrong += refused[i];
    }
    for (int i = 0; i < photos && wrong; i++)
        beside += trainer->transparent[i] == 2 && ssdgs__shows_beside(trainer->photos + i, &trainer->options);
    if (2 * beside > outlined) wrong = 0;
    for (int i = photos - 1; i >= 0 && wrong; i--)
        if (refused[i]) trainer->transparent[i] = 1, first = i;
    if (wrong)
        ssdgs__note(
            trainer->context,
            "%d photographs of %d, the first number %d, are transparent where the others show the object: is "
            "it their masks or poses that are wrong? Their outlines are not used",
            wrong, photos, first);
    ssdgs__release(trainer->context, shown);
    return SSDGS_OK;
}

/* Random points in the bounds; their size is the mean distance to the three nearest that such points have,
   their normals point away from the centre; in the order of ssdgs__split. Those outside of the object's
   outlines are left out, and where few would be left others are drawn. */
static ssdgs_result ssdgs__random_start(ssdgs_trainer *trainer) {
    enum { rounds = 16, least = 4 }; /* more than one in so many is left, or so many rounds are drawn */
    ssdgs_model *model = trainer->model;
    const ssdgs_train_options *o = &trainer->options;
    const size_t allowed = ssdgs__allowed(trainer);
    const size_t n = (size_t)o->initial_points < allowed ? (size_t)o->initial_points : allowed;
    double volume = 1;
    size_t kept = 0;
    if (o->initial_points < 1)
        return ssdgs__fail(trainer->context, SSDGS_ERR_ARGUMENT,
                           "train options: initial_points = %d for an empty model", o->initial_points);
    ssdgs_result result = ssdgs__trainer_grow(trainer, n);
    if (result) return result;
    uint64_t *draws =
        (uint64_t *)ssdgs__allocate(trainer->context, n * (sizeof *draws + sizeof(ssdgs_real) + 1));
    if (!draws) return SSDGS_ERR_MEMORY;
    unsigned char *outside = (unsigned char *)((ssdgs_real *)(draws + n) + n);
    const size_t stride = model->capacity;
    double u[3];
    ssdgs_real x[3];
    int round;
    for (round = 0; round < rounds && kept <= n / least && !result; round++) {
        for (size_t i = kept; i < n; i++) {
            draws[i] = (uint64_t)round * n + i;
            ssdgs__draw_place(o, draws[i], u, x);
            for (int c = 0; c < 3; c++) model->gaussians[(size_t)(SSDGS_POSITION + c) * stride + i] = x[c];
        }
        model->count = (int)n;
        result = ssdgs__outlines(trainer, outside);
        for (size_t i = kept; i < n; i++)
            if (!outside[i]) draws[kept++] = draws[i];
    }
    if (!kept) { /* never none */
        ssdgs__note(
            trainer->context,
            "no random point is inside of the outlines, so these are not used: do bounds_min and bounds_max "
            "hold the object, are masks and poses right?");
        trainer->run.outlines = 0;
        kept = n;
        round = 1;
    }
    for (int c = 0; c < 3; c++) volume *= (double)o->bounds_max[c] - (double)o->bounds_min[c];
    /* half of random points' mean distance to their three nearest */
    trainer->run.start_size = 0.5 * 0.71812 * pow(volume / ((double)n * round), 1.0 / 3);
    for (size_t i = 0; i < kept; i++) {
        ssdgs_real *g = model->gaussians + i;
        double length = 0;
        ssdgs__gaussian_reset(model->gaussians, stride, i);
        ssdgs__draw_place(o, draws[i], u, x);
        double away[3];
        for (int c = 0; c < 3; c++) {
            g[(size_t)(SSDGS_POSITION + c) * stride] = x[c];
            g[(size_t)(SSDGS_LOG_SCALE + c) * stride] = (ssdgs_real)log(trainer->run.start_size);
            away[c] = (u[c] - 0.5) * ((double)o->bounds_max[c] - (double)o->bounds_min[c]);
            length += away[c] * away[c];
        }
        length = sqrt(length);
        if (away[2] > -0.999 * length) { /* the rotation that takes z there: (1 + z, z cross there) */
            g[SSDGS_FRAME * stride] = (ssdgs_real)(length + away[2]);
            g[(SSDGS_FRAME + 1) * stride] = (ssdgs_real)-away[1];
            g[(SSDGS_FRAME + 2) * stride] = (ssdgs_real)away[0];
            length = sqrt(2 * length * (length + away[2]));
            for (int c = 0; c < 3; c++) g[(size_t)(SSDGS_FRAME + c) * stride] /= (ssdgs_real)length;
        }
    }
    for (size_t i = 0; i < kept; i++) draws[i] = i;
    if (!result) ssdgs__reorder(trainer, draws, kept, (ssdgs_real *)(draws + n));
    else model->count = 0;
    ssdgs__release(trainer->context, draws);
    return result;
}

static void ssdgs__trainer_drop(ssdgs_trainer *trainer) {
    ssdgs_context *context = trainer->context;
    ssdgs__model_drop(trainer->model);
    ssdgs__release(context, trainer->photos);
    ssdgs__release(context, trainer->corrections);
    ssdgs__release(context, trainer->transparent);
    ssdgs__release(context, trainer->small_object_gain);
    ssdgs__release(context, trainer->sums.memory);
    ssdgs__release(context, trainer->order);
    ssdgs__release(context, trainer->mean);
    ssdgs__release(context, trainer->square);
    ssdgs__release(context, trainer->global_mean);
    ssdgs__release(context, trainer->screen_gradient);
    ssdgs__release(context, trainer);
    ssdgs__context_drop(context);
}

SSDGS_API void ssdgs_trainer_destroy(ssdgs_trainer *trainer) {
    if (!trainer || SSDGS__ENTER(trainer->context, "ssdgs_trainer_destroy")) return;
    ssdgs_context *context = trainer->context;
    context->references++;
    if (!trainer->running) ssdgs__trainer_drop(trainer);
    else
        ssdgs__fail(context, SSDGS_ERR_ARGUMENT,
                    "ssdgs_trainer_destroy: the trainer runs, its progress callback must not destroy it");
    ssdgs__leave_and_drop(context);
}

/* Whether a photograph, of several the one with an index, else -1, can be rendered and compared on a
   background. */
static ssdgs_result ssdgs__photo_check(ssdgs_context *context, const ssdgs_photo *photo, int index,
                                       const ssdgs_real background[3]) {
    context->subject = "photograph";
    context->subject_number = index;
    ssdgs_result result = ssdgs__camera_check(context, &photo->camera, 0);
    if (!result) result = ssdgs__lights_check(context, &photo->light, 1);
    if (!result) {
        context->subject = "the other lights of photograph";
        result = ssdgs__lights_check(context, photo->more, photo->more_count);
        context->subject = "photograph";
    }
    for (int i = 0; !result && i <= photo->more_count; i++)
        if (ssdgs__photo_light(photo, i)->unshadowed || ssdgs__photo_light(photo, i)->kept > 0)
            result = ssdgs__fail(context, SSDGS_ERR_ARGUMENT,
                                 "a photograph's lights have shadows; one of these is unshadowed, or its "
                                 "share of kept colours is not 0");
    if (!result && !photo->pixels) result = ssdgs__fail(context, SSDGS_ERR_ARGUMENT, "it has no pixels");
    if (!result && ((int)photo->format < 0 || photo->format > SSDGS_PIXELS_RGBA32F))
        result = ssdgs__fail(context, SSDGS_ERR_ARGUMENT, "format = %d", (int)photo->format);
    const size_t numbers = 4 * (size_t)photo->camera.width * (size_t)photo->camera.height;
    for (size_t i = 0; !result && ssdgs__is_light(photo) && i < numbers; i++) {
        const ssdgs_real number = ssdgs__photo_number(photo, i);
        if (!ssdgs__finite(number))
            result = ssdgs__fail(context, SSDGS_ERR_NONFINITE, "pixel %zu is not finite", i / 4);
        else if (i % 4 == 3 && (number < 0 || number > 1))
            result =
                ssdgs__fail(context, SSDGS_ERR_ARGUMENT, "pixel %zu has alpha %g", i / 4, (double)number);
    }
    for (int i = 0; i < 3 && !result; i++)
        if (!ssdgs__finite(background[i]))
            result = ssdgs__fail(context, SSDGS_ERR_NONFINITE, "background[%d] is not finite", i);
    context->subject = NULL;
    return result;
}

/* Decides whether the lights tell what other lights do: not where they hardly move, or hardly move in the
   camera's axes. radius: of the cameras. */
static void ssdgs__judge_lights(ssdgs_trainer *trainer, double radius) {
    ssdgs_context *context = trainer->context;
    const int n = trainer->photo_count;
    double centre[3], mean[3] = {0, 0, 0}, held[3] = {0, 0, 0}, spread = 0, apart = 0, away = 0, lit_from = 0;
    int points = 0, several = 0;
    ssdgs__bounds_centre(&trainer->options, centre);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < n; i++) {
            const ssdgs_photo *photo = trainer->photos + i;
            const int point = photo->light.kind != SSDGS_LIGHT_DIRECTIONAL;
            double eye[3], p[3], seen[3], from_mean = 0, from_held = 0, to_eye = 0, to_light = 0;
            ssdgs_real place[3];
            ssdgs__camera_centre(&photo->camera, eye);
            ssdgs__light_place(&photo->light, place);
            for (int j = 0; j < 3; j++) p[j] = (double)place[j];
            ssdgs__to_camera(&photo->camera, p, point, seen);
            for (int j = 0; j < 3; j++) {
                from_mean += (p[j] - mean[j]) * (p[j] - mean[j]);
                from_held += (seen[j] - held[j]) * (seen[j] - held[j]);
                to_eye += (eye[j] - centre[j]) * (eye[j] - centre[j]);
                to_light += (p[j] - centre[j]) * (p[j] - centre[j]);
                if (!pass) mean[j] += p[j] / n, held[j] += seen[j] / n;
            }
            points += !pass && point;
            several |= photo->more_count > 0;
            if (!pass) continue;
            spread = from_mean > spread ? from_mean : spread;
            apart = from_held > apart ? from_held : apart;
            away += (points ? sqrt(to_eye) : 1) / n;
            lit_from += (points ? sqrt(to_light) : 1) / n;
        }
    if (n < 2 || several || (points && points < n)) return;
    if (points && radius > 1e-3 * trainer->unit && radius < away)
        away = radius; /* bounds, and so away, may be wrong */
    const int still = sqrt(spread) < 0.03 * lit_from;
    trainer->one_light = still || sqrt(apart) < 0.1 * away;
    if (still)
        ssdgs__note(
            context,
            "all photographs are lit from one place: they do not tell how the object looks in other light");
    else if (trainer->one_light)
        ssdgs__note(context,
                    "the light moves with the camera, at (%g, %g, %g) of its axes (right, down, forward) in "
                    "all photographs: they do not tell how the object looks in other light",
                    floor(1e3 * held[0] + 0.5) / 1e3, floor(1e3 * held[1] + 0.5) / 1e3,
                    floor(1e3 * held[2] + 0.5) / 1e3);
}

/* ---- a trainer and its steps ---- */

/* Decides what opaque photographs show around the object: options.background, where most of their borders
   have about its colour, else surfaces, which fill the pictures. */
static void ssdgs__judge_background(ssdgs_trainer *trainer) {
    const ssdgs_real *background = trainer->options.background;
    double mean[3] = {0, 0, 0}, square[3] = {0, 0, 0}, count = 0, same = 0, spread = 0;
    for (int i = 0; i < trainer->photo_count; i++) {
        const ssdgs_photo *photo = trainer->photos + i;
        const int w = photo->camera.width, h = photo->camera.height;
        const int encodes =
            ssdgs__is_light(photo) && trainer->model->settings.transfer == SSDGS_TRANSFER_SRGB;
        if (trainer->transparent[i] == 2) continue;
        for (int y = 0; y < h; y++)
            for (int x = 0; x < w; x += y == 0 || y == h - 1 || w == 1 ? 1 : w - 1) {
                const size_t pixel = (size_t)y * (size_t)w + (size_t)x;
                const ssdgs_real alpha = ssdgs__photo_number(photo, 4 * pixel + 3);
                ssdgs_real apart = 0;
                if (!ssdgs__photo_alpha(photo, pixel)) continue; /* shows nothing */
                for (size_t c = 0; c < 3; c++) {                 /* stored values on the background */
                    const ssdgs_real number = ssdgs__photo_number(photo, 4 * pixel + c),
                                     value = alpha * (encodes ? ssdgs_srgb_encode(number) : number) +
                                             (1 - alpha) * background[c],
                                     d = value > background[c] ? value - background[c]
                                                               : background[c] - value;
                    apart = d > apart ? d : apart;
                    mean[c] += (double)value;
                    square[c] += (double)value * (double)value;
                }
                same += apart < (ssdgs_real)(8.5 / 255);
                count++;
            }
    }
    for (int c = 0; c < 3; c++) {
        const double variance = square[c] / count - mean[c] / count * (mean[c] / count);
        spread = variance > spread ? variance : spread;
    }
    trainer->backdrop = same >= 0.5 * count;
    trainer->opaque_everywhere = !trainer->backdrop;
    if (trainer->backdrop)
        ssdgs__note(
            trainer->context,
            "too few photographs are transparent around the object, but their borders have the colour of "
            "`background`: it is taken for empty, and Gaussians of its colour fade (prune_outside=0 keeps "
            "them)");
    else
        ssdgs__note(trainer->context,
                    "too few photographs are transparent around the object, and their borders, %g,%g,%g on "
                    "average%s, "
                    "are not of the colour of `background`: all that they show is taken for opaque. Where "
                    "there is a background set "
                    "`background` to its colour",
                    floor(100 * mean[0] / count + 0.5) / 100, floor(100 * mean[1] / count + 0.5) / 100,
                    floor(100 * mean[2] / count + 0.5) / 100, spread < 0.001 ? " and all alike" : "");
}

static ssdgs_result ssdgs__trainer_setup(ssdgs_trainer *trainer, const ssdgs_photo *photos, int photo_count) {
    ssdgs_context *context = trainer->context;
    ssdgs_model *model = trainer->model;
    const ssdgs_train_options *o = &trainer->options;
    double mean[3] = {0, 0, 0}, middle[3], radius = 0, irradiance = 0;
    ssdgs_result result = ssdgs__options_check(context, o);
    const int fresh = model->count == 0;
    int outlined = 0, empty = 0, dark = 0;
    double shown = 0;
    if (result) return result;
    SSDGS__REFUSE(ssdgs__keeps(&model->settings), "a model of baked or kept colours cannot be trained");
    SSDGS__REFUSE(ssdgs__has_medium(&model->settings, model->settings.terms),
                  "settings: scattering.layers = 0: a medium is not trained");
    SSDGS__REFUSE(photo_count < 1 || !photos,
                  photo_count < 1 ? "%d photographs" : "%d photographs, but the array is NULL", photo_count);
    for (int i = 0; i < photo_count; i++) {
        result = ssdgs__photo_check(context, photos + i, i, o->background);
        if (result) return result;
    }
    trainer->photos = (ssdgs_photo *)ssdgs__allocate(context, (size_t)photo_count * sizeof *photos);
    trainer->corrections =
        (ssdgs__correction *)ssdgs__allocate(context, (size_t)photo_count * sizeof *trainer->corrections);
    trainer->order = (uint32_t *)ssdgs__allocate(context, (size_t)photo_count * sizeof *trainer->order);
    trainer->transparent = (unsigned char *)ssdgs__allocate(context, (size_t)photo_count);
    trainer->small_object_gain =
        (ssdgs_real *)ssdgs__allocate(context, (size_t)photo_count * sizeof *trainer->small_object_gain);
    trainer->global_mean =
        (ssdgs_real *)ssdgs__allocate(context, 2 * model->global_count * sizeof(ssdgs_real));
    if (!trainer->photos || !trainer->corrections || !trainer->order || !trainer->transparent ||
        !trainer->small_object_gain || !trainer->global_mean)
        return SSDGS_ERR_MEMORY;
    trainer->global_square = trainer->global_mean + model->global_count;
    memcpy(trainer->photos, photos, (size_t)photo_count * sizeof *photos);
    trainer->photo_count = photo_count;
    for (int i = 0; i < photo_count; i++) {
        const size_t pixels = (size_t)photos[i].camera.width * (size_t)photos[i].camera.height;
        size_t clear = 0, veiled = 0;
        for (size_t at = 0; at < pixels; at++) {
            const int alpha = ssdgs__photo_alpha(photos + i, at);
            clear += !alpha;
            shown += alpha / 65535.0 / photo_count;
            veiled += alpha < 65535;
        }
        /* one that shows nothing at all has no outlines: a failed mask; nor do a few pixels make them */
        trainer->transparent[i] = clear < pixels && clear > pixels / 100 ? 2 : veiled > 0;
        /* the smaller the object is in it, the less the mean loss pulls */
        const double lack =
            clear < pixels ? SSDGS__SMALL_OBJECT * (double)pixels / (double)(pixels - clear) : 0;
        trainer->small_object_gain[i] = (ssdgs_real)(lack > 1 ? sqrt(lack) : 1);
        empty += clear == pixels;
    }
    const double most = SSDGS__PER_PIXEL * shown;
    trainer->budget = o->max_gaussians ? o->max_gaussians
                      : most < 1000    ? 1000
                      : most < 50000   ? (int)most
                                       : 50000;
    result = ssdgs__doubt_outlines(trainer);
    if (result) return result;
    for (int i = 0; i < photo_count; i++) outlined += trainer->transparent[i] == 2;
    trainer->run.outlines = ssdgs__several(outlined, photo_count, 0.02);
    if (empty)
        ssdgs__note(context, "%d photographs of %d are wholly transparent: they show nothing", empty,
                    photo_count);
    if (!trainer->run.outlines && empty < photo_count) ssdgs__judge_background(trainer);
    for (int i = 0; i < photo_count; i++) {
        double centre[3];
        ssdgs__camera_centre(&photos[i].camera, centre);
        for (int j = 0; j < 3; j++) mean[j] += centre[j] / photo_count;
    }
    trainer->unit = ssdgs__bounds_side(o);
    ssdgs__bounds_centre(o, middle);
    for (int i = 0; i < photo_count; i++) {
        double centre[3], d2 = 0;
        ssdgs__camera_centre(&photos[i].camera, centre);
        for (int j = 0; j < 3; j++) d2 += (centre[j] - mean[j]) * (centre[j] - mean[j]);
        radius = sqrt(d2) > radius ? sqrt(d2) : radius;
        double e =
            0; /* as from half the unit at least: a light inside of the object must not darken others */
        for (int l = 0; l <= photos[i].more_count; l++)
            e += ssdgs__light_at(ssdgs__photo_light(photos + i, l), middle, 0.5 * trainer->unit);
        if (e > 0) irradiance += log(e);
        else dark++;
    }
    if (dark) ssdgs__note(context, "%d photographs of %d have no light", dark, photo_count);
    if (radius < 1e-3 * trainer->unit)
        ssdgs__note(context, "all photographs are taken from one place: other views cannot be right");
    ssdgs__judge_lights(trainer, radius);
    trainer->extent = 1.1 * (radius > trainer->unit ? radius : trainer->unit); /* one camera has no radius */
    result = fresh ? ssdgs__random_start(trainer) : ssdgs__trainer_grow(trainer, (size_t)model->count);
    if (fresh && !result) { /* the model stays as it was when that fails */
        const ssdgs_settings *s = &model->settings;
        const int scaled = ssdgs__has_unit(s);
        for (int j = 0; scaled && j < 3; j++) model->settings.centre[j] = (ssdgs_real)middle[j];
        if (scaled) model->settings.length_unit = (ssdgs_real)(0.5 * trainer->unit);
        /* the logarithm of E averages 0: few strong lights must not darken all others */
        const double scale = dark < photo_count ? exp(-irradiance / (photo_count - dark)) : 1;
        model->settings.light_scale = (ssdgs_real)(scale < SSDGS__MOST_LIGHT ? scale : SSDGS__MOST_LIGHT);
        ssdgs__globals_reset(model, o->seed);
    }
    return result;
}

SSDGS_API ssdgs_result ssdgs_trainer_create(ssdgs_model *model, const ssdgs_photo *photos, int photo_count,
                                            const ssdgs_train_options *options, ssdgs_trainer **out) {
    if (out) *out = NULL;
    SSDGS__BEGIN(model, model->context, "ssdgs_trainer_create");
    ssdgs_context *context = model->context;
    ssdgs_result result = SSDGS_OK;
    if (!out) return ssdgs__leave(context, ssdgs__null(context, "ssdgs_trainer_create", "out"));
    ssdgs_trainer *trainer = (ssdgs_trainer *)ssdgs__allocate(context, sizeof *trainer);
    if (!trainer) return ssdgs__leave(context, SSDGS_ERR_MEMORY);
    trainer->context = context;
    trainer->model = model;
    context->references++;
    model->references++;
    ssdgs__model_changed(model);
    trainer->options = options ? *options : ssdgs_train_options_default();
    trainer->pass = -1;
    result = ssdgs__trainer_setup(trainer, photos, photo_count);
    if (!result && ssdgs__is_placed(&model->settings)) {
        const ssdgs_settings unplaced = ssdgs_settings_default();
        ssdgs__note(context,
                    "training goes on where the model was trained: the place that an editor gave it is "
                    "dropped");
        model->settings.placement = unplaced.placement;
    }
    if (result) ssdgs__trainer_drop(trainer);
    else *out = trainer;
    return ssdgs__leave(context, result);
}

/* The photograph of an iteration: every pass visits each once, in an order drawn for the pass. */
static int ssdgs__photo_of(ssdgs_trainer *trainer, int iteration) {
    const int n = trainer->photo_count, pass = iteration / n;
    uint32_t *order = trainer->order;
    if (pass != trainer->pass) {
        for (int i = 0; i < n; i++) order[i] = (uint32_t)i;
        for (int i = n - 1; i > 0; i--) {
            const int j = (int)(ssdgs__uniform(trainer->options.seed ^ UINT64_C(0x70617373),
                                               (uint64_t)pass * (uint64_t)n + (uint64_t)i) *
                                (i + 1));
            const uint32_t swap = order[i];
            order[i] = order[j];
            order[j] = swap;
        }
        trainer->pass = pass;
    }
    return (int)order[iteration % n];
}

/* With a backdrop, adds the gradient of SSDGS__FADE (1 - t / 30e3) x the sum of opacities / pixels. */
static void ssdgs__fade(const ssdgs_trainer *trainer, double t, double pixels, ssdgs_real *gradient) {
    const size_t n = (size_t)trainer->model->count;
    const ssdgs_real *opacity = trainer->model->gaussians + SSDGS_OPACITY * trainer->stride;
    const double fade = !trainer->backdrop || trainer->options.prune_outside <= 0 || t >= 30e3
                            ? 0
                            : SSDGS__FADE * (1 - t / 30e3) / pixels;
    for (size_t i = 0; i < n && fade > 0; i++) {
        const double a = 1 / (1 + (double)ssdgs__exp_scalar(-opacity[i]));
        if (a > 0)
            gradient[i] += (ssdgs_real)(fade * a * (1 - a)); /* one that is no number is not drawn either */
    }
}

/* Where photographs have one light, highlights and scattered light are a guess in any other: a matt surface
   is the safer one. Adds the gradient of SSDGS__ONE_LIGHT_WEIGHT x the mean of c_s and c_sss over the
   picture. */
static void ssdgs__doubt(const ssdgs_trainer *trainer, const ssdgs_frame *frame, double pixels) {
    for (int i = 0; i < frame->shaded_count && trainer->one_light; i++) {
        const size_t g = frame->shaded[i];
        const ssdgs_real weight = frame->splat_gradient[SSDGS__SPLAT * g + 6];
        for (int c = 0; c < 6; c++) {
            const size_t at = (size_t)(SSDGS_SPECULAR + c) * trainer->stride + g;
            frame->gradient[at] += (ssdgs_real)(SSDGS__ONE_LIGHT_WEIGHT / (3 * pixels)) * weight *
                                   ssdgs__sigmoid_scalar(trainer->model->gaussians[at]);
        }
    }
}

/* Whether the Gaussians are where the trainer left them. */
static ssdgs_result ssdgs__trainer_check(const ssdgs_trainer *trainer) {
    return trainer->arrangement == trainer->model->arrangement
               ? SSDGS_OK
               : ssdgs__fail(
                     trainer->context, SSDGS_ERR_ARGUMENT,
                     "another trainer or ssdgs_model_sort() has moved the Gaussians of this trainer's model");
}

/* Whether photographs have ambient light, or may have. */
static int ssdgs__sees_ambient(const ssdgs_trainer *trainer) {
    const ssdgs_real *ambient = trainer->model->settings.ambient;
    return trainer->options.refine & SSDGS_REFINE_AMBIENT || ambient[0] > 0 || ambient[1] > 0 ||
           ambient[2] > 0;
}

/* Draws the photograph of an iteration. Leaves its gradients in the frame, that of its corrections in
   moves. */
static ssdgs_result ssdgs__draw_photo(ssdgs_trainer *trainer, const ssdgs__step *step, int iteration,
                                      int photo, ssdgs_frame *frame,
                                      double correction_gradient[SSDGS__CORRECTIONS], double drawn[3]) {
    const ssdgs_train_options *o = &trainer->options;
    const double *correction = trainer->corrections[photo].value;
    const int shown = trainer->transparent[photo]; /* a few soft pixels do not hide a backdrop */
    ssdgs_real background[3];
    for (int j = 0; j < 3; j++)
        background[j] =
            o->random_background && (trainer->backdrop ? shown == 2 : shown || trainer->opaque_everywhere)
                ? (ssdgs_real)ssdgs__uniform(o->seed ^ UINT64_C(0x6261636B),
                                             3 * (uint64_t)iteration + (uint64_t)j)
                : o->background[j];
    ssdgs_camera camera;
    ssdgs_light light;
    ssdgs__correct(trainer->photos + photo, correction, &camera, &light);
    ssdgs__loss_values values;
    const int *learns = step->learns + SSDGS__PLANE_GROUPS;
    const ssdgs__photo_job photo_job = {trainer->photos + photo,
                                        &camera,
                                        &light,
                                        background,
                                        step->terms,
                                        {!learns[SSDGS__SCATTERING_NET], !learns[SSDGS__SHADOW_NET]},
                                        o->dssim,
                                        o->normal_weight,
                                        o->refine & ~SSDGS_REFINE_AMBIENT,
                                        ssdgs__sees_ambient(trainer) ? trainer->sky_share : NULL};
    SSDGS__TRY(ssdgs__photo_backward(frame, trainer->model, &photo_job, &values));
    ssdgs__moves_of(trainer->photos + photo, correction, frame, correction_gradient);
    ssdgs__fade(trainer, step->t, (double)camera.width * camera.height,
                frame->gradient + SSDGS_OPACITY * frame->gaussians.stride);
    ssdgs__doubt(trainer, frame, (double)camera.width * camera.height);
    if (!iteration && !frame->shaded_count)
        ssdgs__note(
            trainer->context,
            "the first photograph drawn has no Gaussian in view: do the camera's axes, position, near_plane "
            "and the bounds suit each other?");
    drawn[0] = values.loss, drawn[1] = ssdgs__psnr(values.mse), drawn[2] = frame->shaded_count;
    return SSDGS_OK;
}

/* Where things lie in what a batch adds up, and how long it is. */
typedef struct ssdgs__batch_layout {
    size_t correction_gradient, gradient, globals, statistics,
        size; /* before: failures, loss, psnr, shaded */
} ssdgs__batch_layout;

static ssdgs__batch_layout ssdgs__batch_layout_of(const ssdgs_trainer *trainer) {
    ssdgs__batch_layout at;
    at.correction_gradient = 4;
    at.gradient = at.correction_gradient + SSDGS__CORRECTIONS * (size_t)trainer->options.batch;
    at.globals = at.gradient + SSDGS_CHANNELS * trainer->stride;
    at.statistics = at.globals + trainer->model->global_count;
    at.size = at.statistics + SSDGS__STATISTICS * trainer->stride;
    return at;
}

#define SSDGS__SKY_SHARES_EVERY 100 /* iterations until what comes to each Gaussian is found anew */

/* Finds what of settings.ambient comes to each Gaussian, where the step needs it anew. */
static ssdgs_result ssdgs__sky_shares_step(ssdgs_trainer *trainer) {
    const int before = trainer->run.iteration, last = before - trainer->options.batch;
    if (!ssdgs__sees_ambient(trainer) ||
        (trainer->run.sky_ready && before / SSDGS__SKY_SHARES_EVERY <= last / SSDGS__SKY_SHARES_EVERY))
        return SSDGS_OK;
    const ssdgs_result result = ssdgs__sky_shares(trainer->model, trainer->stride, trainer->sky_share);
    trainer->run.sky_ready = !result;
    return result;
}

/* Draws this process's part of a batch and adds all, in pairs, pairs of pairs and so on: so the bits are
   those of one process where each draws a power of two. Leaves the mean gradients in the frame, all
   photographs' in moves (batch, SSDGS__CORRECTIONS) and their statistics' sums, (SSDGS__STATISTICS, stride),
   where *statistics says. A process whose photograph fails, but not one without memory for the sums, takes
   part in the sum, so that the others hear of it. */
static ssdgs_result ssdgs__draw_batch(ssdgs_trainer *trainer, const ssdgs__step *step, const int *photos,
                                      ssdgs_frame *frame, double *correction_gradient,
                                      const ssdgs_real **statistics, double drawn[3]) {
    ssdgs_context *context = trainer->context;
    const ssdgs_sum *sum = &trainer->options.sum;
    const ssdgs__batch_layout at = ssdgs__batch_layout_of(trainer);
    const int batch = trainer->options.batch, own = sum->add ? batch / sum->processes : batch;
    const int first = sum->add ? own * sum->rank : 0;
    int depth = 0, room = 2;
    for (int i = own; i > 1; i /= 2) room++;
    ssdgs_real *sums;
    SSDGS__RESERVE(trainer->sums, sums, ssdgs_real, at.size * (size_t)room);
    ssdgs_result failed = ssdgs__sky_shares_step(trainer);
    for (int i = 0; i < own && !failed; i++) {
        const int b = first + i;
        ssdgs_real *out = sums + at.size * (size_t)depth++;
        memset(out, 0, at.size * sizeof *out);
        failed = ssdgs__draw_photo(trainer, step, trainer->run.iteration + b, photos[b], frame,
                                   correction_gradient + SSDGS__CORRECTIONS * b, drawn);
        if (failed) break;
        ssdgs__gather_statistics(trainer, frame, trainer->small_object_gain[photos[b]], out + at.statistics);
        for (int j = 0; j < 3; j++) out[1 + j] = (ssdgs_real)drawn[j];
        for (int j = SSDGS__CORRECTIONS * b; j < SSDGS__CORRECTIONS * (b + 1); j++)
            out[at.correction_gradient + (size_t)j] = (ssdgs_real)correction_gradient[j];
        memcpy(out + at.gradient, frame->gradient, SSDGS_CHANNELS * trainer->stride * sizeof *out);
        memcpy(out + at.globals, frame->global_gradient, trainer->model->global_count * sizeof *out);
        for (int pairs = i + 1; depth > 1 && (pairs % 2 == 0 || i + 1 == own); pairs /= 2, depth--)
            for (size_t k = 0; k < at.size; k++)
                sums[at.size * (size_t)(depth - 2) + k] += sums[at.size * (size_t)(depth - 1) + k];
    }
    if (failed) memset(sums, 0, at.size * sizeof *sums);
    sums[0] = failed != SSDGS_OK;
    const ssdgs_result result = sum->add ? sum->add(sum->user, sums, at.size) : SSDGS_OK;
    if (failed) return failed;
    if (result)
        return ssdgs__fail(context, result, "iteration %d refused: options.sum.add() failed",
                           trainer->run.iteration);
    if (sums[0] > 0)
        return ssdgs__fail(context, SSDGS_ERR_CANCELLED, "iteration %d refused: another process failed",
                           trainer->run.iteration);
    const ssdgs_real mean = 1 / (ssdgs_real)batch;
    for (int i = 0; i < 3; i++) drawn[i] = (double)(mean * sums[1 + i]);
    for (int j = 0; j < SSDGS__CORRECTIONS * batch; j++)
        correction_gradient[j] = (double)sums[at.correction_gradient + (size_t)j];
    for (size_t k = 0; k < at.globals - at.gradient; k++) frame->gradient[k] = mean * sums[at.gradient + k];
    for (size_t k = 0; k < at.statistics - at.globals; k++)
        frame->global_gradient[k] = mean * sums[at.globals + k];
    *statistics = sums + at.statistics;
    return SSDGS_OK;
}

/* Moves the camera and the light of a photograph. */
static void ssdgs__refine_step(ssdgs_trainer *trainer, double t, int photo,
                               const double correction_gradient[SSDGS__CORRECTIONS], const int refines[4]) {
    const ssdgs_train_options *o = &trainer->options;
    const double shows = (double)o->iterations / trainer->photo_count,
                 wider = shows < 300 ? sqrt(300 / shows) : 1;
    ssdgs__correction *correction = trainer->corrections + photo;
    if (refines[0])
        ssdgs__correction_step(correction, trainer->photos + photo, correction_gradient, 0,
                               wider * ssdgs__decay(o->rates.camera, 0, 60e3, t) * (t < 20e3 ? t / 20e3 : 1),
                               trainer->unit);
    if (refines[0] && o->rates.position.start > 0)
        ssdgs__anchor_cameras(trainer); /* else the scene stays, and says where they are */
    if (trainer->photos[photo].more_count) return;
    if (refines[1])
        ssdgs__correction_step(correction, trainer->photos + photo, correction_gradient, 1,
                               wider * ssdgs__decay(o->rates.light, 0, 60e3, t) * (t < 30e3 ? t / 30e3 : 1),
                               trainer->unit);
    if (refines[2]) ssdgs__intensity_step(correction, correction_gradient);
    if (refines[2] && o->rates.color.start > 0) /* colours that stay as they are tell the intensities */
        ssdgs__anchor_intensities(trainer);
}

#define SSDGS__AMBIENT_RATE 0.01 /* of the lamps' light */

/* Adam on settings.ambient, by the moves of a batch. */
static void ssdgs__ambient_step(ssdgs_trainer *trainer, double t, const double *correction_gradient) {
    ssdgs_settings *s = &trainer->model->settings;
    const int batch = trainer->options.batch, steps = ++trainer->run.ambient_steps;
    const double end = ssdgs__schedule_end(&trainer->options);
    const double rate = SSDGS__AMBIENT_RATE * (1 - 0.99 * (t < end ? t : end) / end) * sqrt((double)batch);
    for (int c = 0; c < 3; c++) {
        double g = 0;
        for (int i = 0; i < batch; i++) g += correction_gradient[SSDGS__CORRECTIONS * i + 11 + c] / batch;
        const double step = ssdgs__adam_one(g, trainer->run.ambient + c, trainer->run.ambient + 3 + c, steps),
                     value = (double)s->ambient[c] - rate / (double)s->light_scale * step;
        s->ambient[c] = (ssdgs_real)(value > 0 ? value < SSDGS__MOST_LIGHT ? value : SSDGS__MOST_LIGHT : 0);
    }
}

static ssdgs_result ssdgs__trainer_step(ssdgs_trainer *trainer, ssdgs_train_stats *stats) {
    const ssdgs_train_options *o = &trainer->options;
    const int before = trainer->run.iteration, after = before + o->batch;
    ssdgs_result result = ssdgs__trainer_check(trainer);
    if (result) return result;
    ssdgs__step step;
    step.t = ssdgs__schedule_time(o, before);
    step.terms =
        ssdgs__phase(o, trainer->model->settings.asg, step.t, step.learns) & trainer->model->settings.terms;
    int photos[SSDGS__MAX_BATCH];
    double correction_gradient[SSDGS__CORRECTIONS * SSDGS__MAX_BATCH];
    for (int i = 0; i < o->batch; i++) photos[i] = ssdgs__photo_of(trainer, before + i);
    const ssdgs_real *statistics = NULL;
    double drawn[3]; /* loss, PSNR, Gaussians shaded: of a photograph, or of a batch on average */
    ssdgs_frame frame;
    if (o->batch > 1 || o->sum.add)
        result = ssdgs__draw_batch(trainer, &step, photos, &frame, correction_gradient, &statistics, drawn);
    else {
        result = ssdgs__sky_shares_step(trainer);
        if (!result)
            result = ssdgs__draw_photo(trainer, &step, before, photos[0], &frame, correction_gradient, drawn);
    }
    if (result) return result;
    const int refines[4] = {(o->refine & SSDGS_REFINE_CAMERA) && step.t >= 5e3,
                            (o->refine & SSDGS_REFINE_LIGHT) && step.t >= 16e3,
                            (o->refine & SSDGS_REFINE_INTENSITY) && step.t >= 5e3,
                            (o->refine & SSDGS_REFINE_AMBIENT) != 0};
    for (int i = 0; i < SSDGS__CORRECTIONS * o->batch && !result; i++) {
        const int j = i % SSDGS__CORRECTIONS, of = j < 6 ? 0 : j < 9 ? 1 : j < 11 ? 2 : 3;
        if (refines[of] && !ssdgs__finite((ssdgs_real)correction_gradient[i]))
            result = ssdgs__fail(trainer->context, SSDGS_ERR_NONFINITE,
                                 "iteration %d refused: the gradient of photograph %d's %s is not finite",
                                 before, photos[i / SSDGS__CORRECTIONS],
                                 of == 3 ? "ambient light"
                                 : of    ? "light"
                                         : "camera");
    }
    if (!result) {
        const ssdgs_camera *camera = &trainer->photos[photos[0]].camera;
        result = ssdgs__adam_step(trainer, &frame, (double)camera->width * camera->height, &step);
    }
    trainer->run.skipped += result != SSDGS_OK;
    for (int i = 0; i < o->batch && !result; i++)
        ssdgs__refine_step(trainer, step.t, photos[i], correction_gradient + SSDGS__CORRECTIONS * i, refines);
    if (!result && refines[3]) ssdgs__ambient_step(trainer, step.t, correction_gradient);
    ssdgs__model_changed(trainer->model);
    trainer->run.iteration = after;
    if (!result && ssdgs__schedule_time(o, after) <= o->densify_until) {
        for (size_t k = 0; statistics && k < SSDGS__STATISTICS * trainer->stride; k++)
            trainer->screen_gradient[k] += statistics[k];
        if (!statistics)
            ssdgs__gather_statistics(trainer, &frame, trainer->small_object_gain[photos[0]],
                                     trainer->screen_gradient);
        if (after >= o->densify_from && after / o->densify_every > before / o->densify_every)
            result = ssdgs__densify(trainer);
        if (ssdgs__last_reset(o, after) > before) ssdgs__reset_opacity(trainer);
    }
    if (stats) {
        stats->shaded = (int)(drawn[2] + 0.5);
        stats->terms = step.terms;
        stats->loss = drawn[0];
        stats->psnr = drawn[1];
    }
    return result;
}

SSDGS_API ssdgs_result ssdgs_trainer_step(ssdgs_trainer *trainer, ssdgs_train_stats *stats) {
    if (stats) memset(stats, 0, sizeof *stats);
    SSDGS__BEGIN(trainer, trainer->context, "ssdgs_trainer_step");
    ssdgs_result result = ssdgs__trainer_step(trainer, stats);
    if (stats) {
        stats->iteration = trainer->run.iteration;
        stats->gaussians = trainer->model->count;
        stats->skipped_steps = trainer->run.skipped;
    }
    return ssdgs__leave(trainer->context, result);
}

SSDGS_API ssdgs_result ssdgs_trainer_run(ssdgs_trainer *trainer, ssdgs_progress progress, void *user) {
    int bad = 0;
    SSDGS__BEGIN(trainer, trainer->context, "ssdgs_trainer_run");
    ssdgs_result result = SSDGS_OK;
    ssdgs__leave(trainer->context, SSDGS_OK);
    trainer->running++;
    while (trainer->run.iteration < trainer->options.iterations) {
        const int before = trainer->run.iteration;
        ssdgs_train_stats stats;
        result = ssdgs_trainer_step(trainer, &stats);
        bad = result ? bad + 1 : 0;
        if (bad == 10 || (result && (result != SSDGS_ERR_NONFINITE || trainer->run.iteration == before)))
            break;
        result = SSDGS_OK;
        if (!progress || progress(user, &stats)) continue;
        result = ssdgs__fail(trainer->context, SSDGS_ERR_CANCELLED, "cancelled at iteration %d",
                             trainer->run.iteration);
        break;
    }
    trainer->running--;
    return result;
}

static ssdgs_result ssdgs__trainer_refined(const ssdgs_trainer *trainer, int index, ssdgs_camera *camera,
                                           ssdgs_light *light) {
    if (!camera || !light)
        return ssdgs__null(trainer->context, "ssdgs_trainer_refined", camera ? "light" : "camera");
    if (index < 0 || index >= trainer->photo_count)
        return ssdgs__fail(trainer->context, SSDGS_ERR_ARGUMENT, "ssdgs_trainer_refined: photograph %d of %d",
                           index, trainer->photo_count);
    ssdgs__correct(trainer->photos + index, trainer->corrections[index].value, camera, light);
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_trainer_refined(const ssdgs_trainer *trainer, int index, ssdgs_camera *camera,
                                             ssdgs_light *light) {
    SSDGS__GUARD(trainer, trainer->context, "ssdgs_trainer_refined",
                 ssdgs__trainer_refined(trainer, index, camera, light));
}

static ssdgs_result ssdgs__evaluate(ssdgs_model *model, const ssdgs_photo *photo,
                                    const ssdgs_real background[3], ssdgs_real *image,
                                    ssdgs_metrics *metrics) {
    ssdgs_context *context = model->context;
    ssdgs_render_options options = ssdgs_render_options_exact();
    memcpy(options.ambient[0], model->settings.ambient, sizeof model->settings.ambient);
    if (!metrics) return ssdgs__null(context, "ssdgs_evaluate", "metrics");
    memset(metrics, 0, sizeof *metrics);
    if (!photo || !background) return ssdgs__null(context, "ssdgs_evaluate", photo ? "background" : "photo");
    ssdgs_result result = ssdgs__photo_check(context, photo, -1, background);
    if (result) return result;
    const size_t pixels = (size_t)photo->camera.width * (size_t)photo->camera.height;
    ssdgs_real *rendered;
    if (pixels > SIZE_MAX / 9 / sizeof *rendered)
        return ssdgs__fail(context, SSDGS_ERR_LIMIT, "a photograph of %zu pixels", pixels);
    rendered = (ssdgs_real *)ssdgs__allocate(context, pixels * 9 * sizeof *rendered);
    if (!rendered) return SSDGS_ERR_MEMORY;
    ssdgs_real *target = rendered + 3 * pixels;
    ssdgs_real *planes = rendered + 6 * pixels;
    ssdgs_image out;
    memset(&out, 0, sizeof out);
    out.color = rendered;
    out.alpha = planes;
    ssdgs_light *lights;
    result = ssdgs__photo_lights(context, photo, &photo->light, &lights);
    if (!result)
        result =
            ssdgs__render_model(model, &photo->camera, lights, 1 + photo->more_count, &options, &out, NULL);
    if (!result) {
        ssdgs_compose(rendered, out.alpha, pixels, model->settings.transfer, background, rendered);
        ssdgs__photo_planes(context->k, photo, model->settings.transfer, background, 0, pixels, planes);
        for (size_t i = 0; i < pixels; i++)
            for (int c = 0; c < 3; c++) target[3 * i + (size_t)c] = planes[pixels * (size_t)c + i];
        if (image) memcpy(image, rendered, pixels * 3 * sizeof *image);
        result =
            ssdgs__compare(context, rendered, target, photo->camera.width, photo->camera.height, metrics);
    }
    ssdgs__release(context, rendered);
    return result;
}

SSDGS_API ssdgs_result ssdgs_evaluate(ssdgs_model *model, const ssdgs_photo *photo,
                                      const ssdgs_real background[3], ssdgs_real *image,
                                      ssdgs_metrics *metrics) {
    SSDGS__GUARD(model, model->context, "ssdgs_evaluate",
                 ssdgs__evaluate(model, photo, background, image, metrics));
}

/* As long as the longest side of a trainer's bounds; where settings have no such unit, of the Gaussians'
   box. */
static double ssdgs__model_unit(const ssdgs_model *model) {
    double unit = 0;
    if (ssdgs__has_unit(&model->settings)) return 2 * (double)model->settings.length_unit;
    for (int c = 0; c < 3; c++) {
        const ssdgs_real *x = model->gaussians + (size_t)(SSDGS_POSITION + c) * model->capacity;
        double low = 1e30, high = -1e30;
        for (int i = 0; i < model->count; i++) {
            if (!ssdgs__finite(x[i])) continue;
            low = (double)x[i] < low ? (double)x[i] : low;
            high = (double)x[i] > high ? (double)x[i] : high;
        }
        unit = high - low > unit ? high - low : unit;
    }
    return unit;
}

static ssdgs_result ssdgs__refine_photo(ssdgs_model *model, ssdgs_photo *photo,
                                        const ssdgs_real background[3], int iterations) {
    if (!photo || !background)
        return ssdgs__null(model->context, "ssdgs_refine_photo", photo ? "background" : "photo");
    if (iterations < 0)
        return ssdgs__fail(model->context, SSDGS_ERR_ARGUMENT, "ssdgs_refine_photo: %d iterations",
                           iterations);
    if (ssdgs__is_placed(&model->settings))
        return ssdgs__fail(
            model->context, SSDGS_ERR_ARGUMENT,
            "ssdgs_refine_photo: an editor has moved the model from where its photographs show it");
    ssdgs_result result = ssdgs__photo_check(model->context, photo, -1, background);
    if (result) return result;
    ssdgs__correction correction;
    memset(&correction, 0, sizeof correction);
    const double unit = ssdgs__model_unit(model);
    ssdgs_camera camera;
    ssdgs_light light;
    for (int i = 0; i < iterations; i++) {
        double rate = 1e-3 * (1 - (double)i / iterations);
        ssdgs__correct(photo, correction.value, &camera, &light);
        ssdgs__loss_values values;
        ssdgs_frame frame;
        const ssdgs__photo_job photo_job = {
            photo, &camera, &light, background, model->settings.terms, {1, 1}, (ssdgs_real)0.2, 0, 1, NULL};
        result = ssdgs__photo_backward(&frame, model, &photo_job, &values);
        if (result) return result;
        double gradient[SSDGS__CORRECTIONS];
        ssdgs__moves_of(photo, correction.value, &frame, gradient);
        for (int j = 0; j < SSDGS__CORRECTIONS; j++)
            if (!ssdgs__finite((ssdgs_real)gradient[j]))
                return ssdgs__fail(model->context, SSDGS_ERR_NONFINITE,
                                   "refinement: a gradient is not finite");
        ssdgs__correction_step(&correction, photo, gradient, 0, rate, unit);
        if (photo->more_count || model->settings.baked) continue;
        ssdgs__correction_step(&correction, photo, gradient, 1, rate, unit);
        ssdgs__intensity_step(&correction, gradient);
    }
    ssdgs__correct(photo, correction.value, &camera, &light);
    photo->camera = camera;
    photo->light = light;
    return SSDGS_OK;
}

SSDGS_API ssdgs_result ssdgs_refine_photo(ssdgs_model *model, ssdgs_photo *photo,
                                          const ssdgs_real background[3], int iterations) {
    SSDGS__GUARD(model, model->context, "ssdgs_refine_photo",
                 ssdgs__refine_photo(model, photo, background, iterations));
}

#ifndef SSDGS_NO_STDIO
/* ==== >>checkpoint  a run's whole state ==== */

/* Reads and writes it in native byte order; another version, precision or run is refused. */

#define SSDGS__CHECKPOINT_MAGIC "SSDGSCK7" /* the last letter changes with the layout */
#define SSDGS__BYTE_ORDER 0x01020304u
/* Of bytes by the gigabyte: words of 8 in four lanes, each step of which can be undone, so that no changed
   word is lost; then the lanes and the rest. */
static uint64_t ssdgs__fold_many(uint64_t hash, const void *data, size_t size) {
    const unsigned char *bytes = (const unsigned char *)data;
    uint64_t lane[4] = {1, 2, 3, 4};
    for (; size >= sizeof lane; size -= sizeof lane, bytes += sizeof lane) {
        uint64_t word[4];
        memcpy(word, bytes, sizeof word);
        for (int i = 0; i < 4; i++) {
            const uint64_t mixed = lane[i] ^ word[i];
            lane[i] = (mixed << 31 | mixed >> 33) * UINT64_C(0x9E3779B97F4A7C15);
        }
    }
    return ssdgs__fold(ssdgs__fold(hash, lane, sizeof lane), bytes, size);
}

/* What must be the same where a run goes on, besides settings and options: of each photograph, as hashes. */
typedef struct ssdgs__checkpoint_photo {
    uint64_t camera, lights, pixels;
} ssdgs__checkpoint_photo;

typedef struct ssdgs__checkpoint_head { /* then the photographs, the arrays and a hash of all before it */
    char magic[8];
    uint32_t byte_order, version, real_size, fused; /* products and sums rounded once: FMA */
    uint64_t global_count;
    int32_t photo_count, count;
    ssdgs__run run;
    ssdgs_settings settings;
    ssdgs_train_options options; /* without sum */
} ssdgs__checkpoint_head;

/* A checkpoint that is written or, without a writer, read. */
typedef struct ssdgs__checkpoint_io {
    ssdgs__writer *writer;
    const unsigned char *bytes;
    uint64_t hash;
} ssdgs__checkpoint_io;

static void ssdgs__checkpoint_part(ssdgs__checkpoint_io *io, void *data, size_t size) {
    if (io->writer) {
        io->hash = ssdgs__fold(io->hash, data, size);
        ssdgs__writer_put(io->writer, data, size);
    } else {
        memcpy(data, io->bytes, size);
        io->bytes += size;
    }
}

/* Every array of the state, in order. */
static void ssdgs__checkpoint_arrays(const ssdgs_trainer *trainer, ssdgs__checkpoint_io *io) {
    ssdgs_model *model = trainer->model;
    const size_t n = (size_t)model->count * sizeof(ssdgs_real);
    ssdgs_real *const planes[3] = {model->gaussians, trainer->mean, trainer->square};
    ssdgs_real *const shared[3] = {model->globals, trainer->global_mean, trainer->global_square};
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < SSDGS_CHANNELS; c++)
            ssdgs__checkpoint_part(io, planes[i] + (size_t)c * trainer->stride, n);
        ssdgs__checkpoint_part(io, shared[i], model->global_count * sizeof(ssdgs_real));
    }
    for (size_t i = 0; i < SSDGS__STATISTICS + 1; i++) /* and sky_share behind them */
        ssdgs__checkpoint_part(io, trainer->screen_gradient + i * trainer->stride, n);
    ssdgs__checkpoint_part(io, trainer->corrections,
                           (size_t)trainer->photo_count * sizeof *trainer->corrections);
}

static void ssdgs__checkpoint_describe(const ssdgs_trainer *trainer, ssdgs__checkpoint_head *head) {
    memset(head, 0, sizeof *head);
    memcpy(head->magic, SSDGS__CHECKPOINT_MAGIC, 8);
    head->byte_order = SSDGS__BYTE_ORDER;
    head->version = SSDGS_VERSION;
    head->real_size = (uint32_t)sizeof(ssdgs_real);
    head->fused = trainer->context->isa >= SSDGS_ISA_AVX2; /* from there on all have FMA */
    head->global_count = trainer->model->global_count;
    head->photo_count = trainer->photo_count;
    head->count = trainer->model->count;
    memcpy(&head->run, &trainer->run, sizeof head->run); /* with its padding */
    head->settings = trainer->model->settings;
    head->options = trainer->options;
    memset(&head->options.sum, 0, sizeof head->options.sum);
}

typedef struct ssdgs__checkpoint_job {
    const ssdgs_photo *photos;
    ssdgs__checkpoint_photo *hashes;
} ssdgs__checkpoint_job;

static void ssdgs__checkpoint_photo_task(void *data, int index) {
    const ssdgs__checkpoint_job *job = (const ssdgs__checkpoint_job *)data;
    const ssdgs_photo *photo = job->photos + index;
    const ssdgs_camera *camera = &photo->camera;
    const size_t number = photo->format == SSDGS_PIXELS_RGBA8     ? 1
                          : photo->format == SSDGS_PIXELS_RGBA32F ? 4
                                                                  : 2;
    ssdgs__checkpoint_photo hash = {ssdgs__fold(SSDGS__FOLD_START, camera, sizeof *camera), SSDGS__FOLD_START,
                                    ssdgs__fold(SSDGS__FOLD_START, &photo->format, sizeof photo->format)};
    for (int i = 0; i <= photo->more_count; i++) {
        const ssdgs_light *light = ssdgs__photo_light(photo, i);
        SSDGS__FOLD(hash.lights, light->kind);
        hash.lights = ssdgs__fold(hash.lights, light->position,
                                  offsetof(ssdgs_light, unshadowed) - offsetof(ssdgs_light, position));
    }
    hash.pixels = ssdgs__fold_many(hash.pixels, photo->pixels,
                                   4 * number * (size_t)camera->width * (size_t)camera->height);
    job->hashes[index] = hash;
}

/* Of all photographs, to be released; NULL: out of memory. */
static ssdgs__checkpoint_photo *ssdgs__checkpoint_photos(const ssdgs_trainer *trainer) {
    ssdgs__checkpoint_job job = {trainer->photos, (ssdgs__checkpoint_photo *)ssdgs__allocate(
                                                      trainer->context, (size_t)trainer->photo_count *
                                                                            sizeof(ssdgs__checkpoint_photo))};
    if (job.hashes)
        ssdgs__parallel(trainer->context, trainer->photo_count, ssdgs__checkpoint_photo_task, &job);
    return job.hashes;
}

/* Copies what a checkpoint begins with; what is wrong, or NULL. */
static const char *ssdgs__checkpoint_head_of(const unsigned char *bytes, size_t size,
                                             ssdgs__checkpoint_head *head) {
    memset(head, 0, sizeof *head);
    memcpy(head, bytes, size < sizeof *head ? size : sizeof *head);
    if (memcmp(head->magic, SSDGS__CHECKPOINT_MAGIC, 7)) return "it is not a checkpoint";
    if (memcmp(head->magic, SSDGS__CHECKPOINT_MAGIC, 8) || head->byte_order != SSDGS__BYTE_ORDER ||
        head->real_size != sizeof(ssdgs_real) || head->version != SSDGS_VERSION)
        return "it was written by another version or machine";
    if (size < sizeof *head + 8) return "it is cut short";
    const ssdgs__run *run = &head->run;
    int sound = head->count >= 1 && head->count <= SSDGS__MAX_GAUSSIANS && run->iteration >= 0 &&
                run->iteration <= 1000000000 && run->skipped >= 0 && run->skipped <= run->iteration &&
                run->start_size >= 0 && run->start_size < 1e30 && run->ambient_steps >= 0 &&
                run->ambient_steps <= run->iteration && run->sky_ready >= 0 && run->sky_ready <= 1 &&
                run->outlines >= 0 && run->outlines <= 1;
    for (int i = 0; i < SSDGS__GROUPS; i++)
        sound = sound && run->steps[i] >= 0 && run->steps[i] <= run->iteration;
    for (int i = 0; i < 6; i++)
        sound = sound && run->ambient[i] < 1e300 && run->ambient[i] >= (i > 2 ? 0 : -1e300);
    return sound ? NULL : "its counts are out of range";
}

static ssdgs_result ssdgs__trainer_save(const ssdgs_trainer *trainer, const char *path) {
    if (!path) return ssdgs__null(trainer->context, "ssdgs_trainer_save", "path");
    ssdgs_result result = ssdgs__trainer_check(trainer);
    if (!result) result = ssdgs__savable(trainer->model, path);
    if (result) return result;
    ssdgs__checkpoint_photo *const photos = ssdgs__checkpoint_photos(trainer);
    if (!photos) return SSDGS_ERR_MEMORY;
    ssdgs__writer writer;
    ssdgs__writer_open(&writer, trainer->context, path, NULL, NULL);
    ssdgs__checkpoint_head head;
    ssdgs__checkpoint_describe(trainer, &head);
    ssdgs__checkpoint_io io = {&writer, NULL, SSDGS__FOLD_START};
    ssdgs__checkpoint_part(&io, &head, sizeof head);
    ssdgs__checkpoint_part(&io, photos, (size_t)trainer->photo_count * sizeof *photos);
    ssdgs__checkpoint_arrays(trainer, &io);
    ssdgs__writer_put(&writer, &io.hash, sizeof io.hash);
    ssdgs__release(trainer->context, photos);
    return ssdgs__writer_close(&writer);
}

SSDGS_API ssdgs_result ssdgs_trainer_save(const ssdgs_trainer *trainer, const char *path) {
    SSDGS__GUARD(trainer, trainer->context, "ssdgs_trainer_save", ssdgs__trainer_save(trainer, path));
}

/* Whether what Adam and the density control rely on makes sense; Gaussians may be anything, as in a model. */
static int ssdgs__checkpoint_sound(const ssdgs__checkpoint_head *head, const unsigned char *at) {
    const size_t planes = (size_t)head->count * SSDGS_CHANNELS, shared = (size_t)head->global_count;
    const size_t sizes[7] = {
        planes, shared, planes, shared, planes, shared, (size_t)head->count * (SSDGS__STATISTICS + 1)};
    for (int part = 0; part < 7; part++)
        for (size_t k = 0; k < sizes[part]; k++, at += sizeof(ssdgs_real)) {
            ssdgs_real x;
            memcpy(&x, at, sizeof x);
            if (part && (!ssdgs__finite(x) || (part / 2 == 2 && x < 0))) return 0; /* 4, 5: second moments */
        }
    for (int i = 0; i < head->photo_count; i++, at += sizeof(ssdgs__correction)) {
        ssdgs__correction c;
        memcpy(&c, at, sizeof c);
        for (int j = 0; j < 9; j++)
            if (!(fabs(c.value[j]) < 1e30 && fabs(c.mean[j]) < 1e150 && c.square[j] >= 0 &&
                  c.square[j] < 1e300))
                return 0;
        if (!(fabs(c.value[9]) < 1e30 && c.sure >= 0 && c.sure < 1e300)) return 0;
        for (int j = 0; j < 2; j++)
            if (c.steps[j] < 0 || c.steps[j] > head->run.iteration) return 0;
    }
    return 1;
}

#define SSDGS__ANOTHER ": a run goes on with the same options, settings and photographs"

/* Options that may change in the midst of a run. */
static int ssdgs__may_change(const ssdgs__number *n) {
    return !strncmp(n->name, "rates.", 6) || !strcmp(n->name, "iterations") ||
           !strcmp(n->name, "max_gaussians");
}

/* Compares a checkpoint's numbers with the trainer's: refuses those that may not change, or tells those that
   have. */
static ssdgs_result ssdgs__checkpoint_numbers(ssdgs_context *context, const char *path, int tells,
                                              const ssdgs__number *list, int count, const void *there,
                                              const void *here) {
    for (const ssdgs__number *n = list; n < list + count; n++)
        for (int i = 0; !i || i < n->count; i++) {
            const unsigned char *was = (const unsigned char *)there + ssdgs__number_at(n, i),
                                *is = (const unsigned char *)here + ssdgs__number_at(n, i);
            const char index[4] = {'[', (char)('0' + i), ']', 0}, *const at = n->count ? index : "";
            if (!memcmp(was, is, ssdgs__number_size(n->type)) || ssdgs__may_change(n) != tells) continue;
            const double values[2] = {ssdgs__number_get(n->type, was), ssdgs__number_get(n->type, is)};
            if (!tells)
                return ssdgs__fail(context, SSDGS_ERR_FORMAT,
                                   "%s: %s%s was %g in its run and is %g now" SSDGS__ANOTHER, path, n->name,
                                   at, values[0], values[1]);
            ssdgs__note(context, "%s: %s%s was %g in its run and is %g now", path, n->name, at, values[0],
                        values[1]);
        }
    return SSDGS_OK;
}

/* Whether a checkpoint is of the trainer's run; the message names the first thing that differs. */
static ssdgs_result ssdgs__checkpoint_same(const ssdgs_trainer *trainer, const char *path,
                                           const ssdgs__checkpoint_head *own,
                                           const ssdgs__checkpoint_head *head, const unsigned char *hashes) {
    ssdgs_context *context = trainer->context;
    ssdgs_settings was = head->settings; /* but for what comes of the photographs */
    memcpy(was.centre, own->settings.centre, sizeof was.centre);
    was.length_unit = own->settings.length_unit;
    was.light_scale = own->settings.light_scale;
    ssdgs_result result = ssdgs__checkpoint_numbers(context, path, 0, ssdgs__train_numbers,
                                                    SSDGS__TRAIN_NUMBERS, &head->options, &own->options);
    if (!result)
        result = ssdgs__checkpoint_numbers(context, path, 0, ssdgs__settings, SSDGS__SETTING_COUNT, &was,
                                           &own->settings);
    if (result) return result;
    if (head->photo_count != own->photo_count)
        return ssdgs__fail(context, SSDGS_ERR_FORMAT,
                           "%s: its run had %d photographs, this one has %d" SSDGS__ANOTHER, path,
                           head->photo_count, own->photo_count);
    if (head->global_count != own->global_count) /* from here on the file is as long as this run's */
        return ssdgs__fail(context, SSDGS_ERR_FORMAT, "%s: its counts are out of range", path);
    ssdgs__checkpoint_photo *const photos = ssdgs__checkpoint_photos(trainer);
    result = photos ? SSDGS_OK : SSDGS_ERR_MEMORY;
    for (int i = 0; i < own->photo_count && !result; i++, hashes += sizeof *photos) {
        ssdgs__checkpoint_photo saved;
        memcpy(&saved, hashes, sizeof saved);
        const char *what = saved.camera != photos[i].camera   ? "another camera"
                           : saved.lights != photos[i].lights ? "other lights"
                           : saved.pixels != photos[i].pixels ? "other pixels"
                                                              : NULL;
        if (what)
            result = ssdgs__fail(context, SSDGS_ERR_FORMAT,
                                 "%s: photograph %d has %s than in its run" SSDGS__ANOTHER, path, i, what);
    }
    ssdgs__release(context, photos);
    return result;
}
#undef SSDGS__ANOTHER

static ssdgs_result ssdgs__trainer_load(ssdgs_trainer *trainer, const char *path) {
    ssdgs_context *context = trainer->context;
    unsigned char *bytes = NULL;
    size_t size = 0;
    if (!path) return ssdgs__null(context, "ssdgs_trainer_load", "path");
    ssdgs_result result = ssdgs__trainer_check(trainer);
    if (!result) result = ssdgs__read_file(context, path, 0, &bytes, &size);
    if (result) return result;
    ssdgs__checkpoint_head own;
    ssdgs__checkpoint_describe(trainer, &own);
    ssdgs__checkpoint_head head;
    const char *reason = ssdgs__checkpoint_head_of(bytes, size, &head);
    const size_t photos = (size_t)own.photo_count * sizeof(ssdgs__checkpoint_photo);
    if (!reason) {
        const uint64_t expected =
            sizeof head + 8 +
            (uint64_t)head.photo_count * (sizeof(ssdgs__checkpoint_photo) + sizeof(ssdgs__correction)) +
            sizeof(ssdgs_real) *
                ((uint64_t)head.count * (3 * SSDGS_CHANNELS + SSDGS__STATISTICS + 1) + 3 * head.global_count);
        uint64_t hash;
        memcpy(&hash, bytes + size - 8, 8);
        if (size != expected) reason = "it is cut short or too long";
        else if (hash != ssdgs__fold(SSDGS__FOLD_START, bytes, size - 8)) reason = "its checksum is wrong";
        if (own.options.refine & SSDGS_REFINE_AMBIENT) /* learned */
            memcpy(own.settings.ambient, head.settings.ambient, sizeof own.settings.ambient);
        if (!reason) result = ssdgs__checkpoint_same(trainer, path, &own, &head, bytes + sizeof head);
        if (!reason && !result && !ssdgs__checkpoint_sound(&head, bytes + sizeof head + photos))
            reason = "its values are out of range";
    }
    if (reason) result = ssdgs__fail(context, SSDGS_ERR_FORMAT, "%s: %s", path, reason);
    if (!result) result = ssdgs__settings_of_file(context, path, &head.settings);
    if (!result) result = ssdgs__trainer_grow(trainer, (size_t)head.count);
    if (!result) {
        ssdgs__checkpoint_numbers(context, path, 1, ssdgs__train_numbers, SSDGS__TRAIN_NUMBERS, &head.options,
                                  &own.options);
        if (head.fused != own.fused)
            ssdgs__note(
                context,
                "%s: its run rounded otherwise (with or without FMA): it goes on, but not bit for bit", path);
        trainer->model->settings = head.settings;
        trainer->model->count = head.count;
        ssdgs__checkpoint_io io = {NULL, bytes + sizeof head + photos, 0};
        ssdgs__checkpoint_arrays(trainer, &io);
        ssdgs__model_changed(trainer->model);
        ssdgs__rearranged(trainer);
        trainer->run = head.run;
    }
    ssdgs__release(context, bytes);
    return result;
}

SSDGS_API ssdgs_result ssdgs_trainer_load(ssdgs_trainer *trainer, const char *path) {
    SSDGS__GUARD(trainer, trainer->context, "ssdgs_trainer_load", ssdgs__trainer_load(trainer, path));
}

SSDGS_API ssdgs_result ssdgs_checkpoint_iteration(ssdgs_context *context, const char *path, int *iteration,
                                                  int *iterations) {
    unsigned char *bytes = NULL;
    size_t size = 0;
    if (iteration) *iteration = 0;
    if (iterations) *iterations = 0;
    SSDGS__BEGIN(context, context, "ssdgs_checkpoint_iteration");
    ssdgs_result result = SSDGS_OK;
    if (!path || !iteration)
        result = ssdgs__null(context, "ssdgs_checkpoint_iteration", path ? "iteration" : "path");
    else result = ssdgs__read_file(context, path, sizeof(ssdgs__checkpoint_head) + 8, &bytes, &size);
    if (!result) {
        ssdgs__checkpoint_head head;
        const char *reason = ssdgs__checkpoint_head_of(bytes, size, &head);
        if (reason) result = ssdgs__fail(context, SSDGS_ERR_FORMAT, "%s: %s", path, reason);
        else *iteration = head.run.iteration;
        if (!reason && iterations) *iterations = head.options.iterations;
    }
    ssdgs__release(context, bytes);
    return ssdgs__leave(context, result);
}
#endif /* SSDGS_NO_STDIO */
SSDGS__SMALL_END
#endif /* SSDGS_NO_TRAINER */

#if defined(__clang__)
#if __clang_major__ >= 12
#ifdef __FAST_MATH__
#pragma clang fp reassociate(on)
#endif
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wignored-pragmas"
#pragma float_control(pop) /* on x86 this gives back the includer's FP_CONTRACT too */
#pragma clang diagnostic pop
#endif
#if __clang_major__ < 12 || !SSDGS__X86
#pragma STDC FP_CONTRACT DEFAULT
#endif
#elif SSDGS__GNUC
#pragma GCC pop_options
#endif
#endif /* SSDGS_IMPLEMENTATION */
#else  /* SSDGS__ISA: the kernels, included once per instruction set */
/* ==== >>kernels  one body for every instruction set ==== */

/* V holds SSDGS__VW lanes of R, VM is a mask. Where a or b is NaN, V_MIN(a, b) and V_MAX(a, b) are b. Kernels
   call no libm (except in the double build) and fuse only through V_FMA, so a forward and its backward round
   alike. */

#if SSDGS__ISA == SSDGS__ISA_SCALAR
#define SSDGS__NAME(name) ssdgs__##name##_scalar
#define SSDGS__TR 2
#define SSDGS__TV 4
#define SSDGS__TARGET
#define V ssdgs_real
#define VM int
#define SSDGS__VW 1
#define V_LOAD(p) (*(p))
#define V_STORE(p, v) (*(p) = (v))
#define V_SET(c) ((R)(c))
#define V_ADD(a, b) ((a) + (b))
#define V_SUB(a, b) ((a) - (b))
#define V_MUL(a, b) ((a) * (b))
#define V_DIV(a, b) ((a) / (b))
#define V_FMA(a, b, c) ((a) * (b) + (c))
#define V_FNMA(a, b, c) ((c) - (a) * (b))
#define V_MIN(a, b) ((a) < (b) ? (a) : (b))
#define V_MAX(a, b) ((a) > (b) ? (a) : (b))
#define V_SQRT(a) SSDGS__SQRT(a)
#define V_LT(a, b) ((a) < (b))
#define V_GE(a, b) ((a) >= (b))
#define V_AND(m, n) ((m) & (n))
#define V_BITS(m) (m)
#define V_SEL(m, a, b) ((m) ? (a) : (b))
#define V_ROUND(a) ssdgs__round(a)
#define V_LDEXP(x, n) ((x)*ssdgs__pow2(n))
#define V_EXPONENT(x) ssdgs__exponent(x)

#elif SSDGS__ISA == SSDGS__ISA_SSE2
#define SSDGS__NAME(name) ssdgs__##name##_sse2
#define SSDGS__TR 5 /* of 6 gcc keeps one sum in memory */
#define SSDGS__TV 2
#define SSDGS__TARGET SSDGS__ATTRIBUTE("sse2")
#define SSDGS__MM(name) _mm_##name
#define V __m128
#define VM __m128
#define SSDGS__VW 4
#define V_FMA(a, b, c) _mm_add_ps(_mm_mul_ps(a, b), c)
#define V_FNMA(a, b, c) _mm_sub_ps(c, _mm_mul_ps(a, b))
#define V_LT(a, b) _mm_cmplt_ps(a, b)
#define V_GE(a, b) _mm_cmpge_ps(a, b)
#define V_AND(m, n) _mm_and_ps(m, n)
#define V_BITS(m) _mm_movemask_ps(m)
#define V_SEL(m, a, b) _mm_or_ps(_mm_and_ps(m, a), _mm_andnot_ps(m, b))
#define V_ROUND(a) _mm_cvtepi32_ps(_mm_cvtps_epi32(a))
#define V_LDEXP(x, n) \
    _mm_castsi128_ps(_mm_add_epi32(_mm_castps_si128(x), _mm_slli_epi32(_mm_cvtps_epi32(n), 23)))
#define V_EXPONENT(x) \
    _mm_cvtepi32_ps(_mm_sub_epi32(_mm_srli_epi32(_mm_castps_si128(x), 23), _mm_set1_epi32(127)))

#elif SSDGS__ISA == SSDGS__ISA_AVX2
#define SSDGS__NAME(name) ssdgs__##name##_avx2
#define SSDGS__TR 5 /* of 6 gcc keeps one sum in memory */
#define SSDGS__TV 2
#define SSDGS__TARGET SSDGS__ATTRIBUTE("avx2,fma")
#define SSDGS__MM(name) _mm256_##name
#define V __m256
#define VM __m256
#define SSDGS__VW 8
#define V_FMA(a, b, c) _mm256_fmadd_ps(a, b, c)
#define V_FNMA(a, b, c) _mm256_fnmadd_ps(a, b, c)
#define V_LT(a, b) _mm256_cmp_ps(a, b, _CMP_LT_OQ)
#define V_GE(a, b) _mm256_cmp_ps(a, b, _CMP_GE_OQ)
#define V_AND(m, n) _mm256_and_ps(m, n)
#define V_BITS(m) _mm256_movemask_ps(m)
#define V_SEL(m, a, b) _mm256_blendv_ps(b, a, m)
#define V_ROUND(a) _mm256_round_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC)
#define V_LDEXP(x, n) \
    _mm256_castsi256_ps( \
        _mm256_add_epi32(_mm256_castps_si256(x), _mm256_slli_epi32(_mm256_cvtps_epi32(n), 23)))
#define V_EXPONENT(x) \
    _mm256_cvtepi32_ps( \
        _mm256_sub_epi32(_mm256_srli_epi32(_mm256_castps_si256(x), 23), _mm256_set1_epi32(127)))

#elif SSDGS__ISA == SSDGS__ISA_AVX512
#define SSDGS__NAME(name) ssdgs__##name##_avx512
#define SSDGS__TR 6
#define SSDGS__TV 4
#define SSDGS__TARGET SSDGS__ATTRIBUTE("avx512f")
#define SSDGS__MM(name) _mm512_##name
#define V __m512
#define VM __mmask16
#define SSDGS__VW 16
#define V_FMA(a, b, c) _mm512_fmadd_ps(a, b, c)
#define V_FNMA(a, b, c) _mm512_fnmadd_ps(a, b, c)
#define V_LT(a, b) _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ)
#define V_GE(a, b) _mm512_cmp_ps_mask(a, b, _CMP_GE_OQ)
#define V_AND(m, n) ((__mmask16)((m) & (n)))
#define V_BITS(m) ((int)(m))
#define V_SEL(m, a, b) _mm512_mask_blend_ps(m, b, a)
#define V_ROUND(a) \
    _mm512_cvtepi32_ps(_mm512_cvt_roundps_epi32(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC))
#define V_LDEXP(x, n) \
    _mm512_castsi512_ps( \
        _mm512_add_epi32(_mm512_castps_si512(x), _mm512_slli_epi32(_mm512_cvtps_epi32(n), 23)))
#define V_EXPONENT(x) \
    _mm512_cvtepi32_ps( \
        _mm512_sub_epi32(_mm512_srli_epi32(_mm512_castps_si512(x), 23), _mm512_set1_epi32(127)))

#elif SSDGS__ISA == SSDGS__ISA_NEON
#define SSDGS__NAME(name) ssdgs__##name##_neon
#define SSDGS__TR 6
#define SSDGS__TV 4
#define SSDGS__TARGET
#define V float32x4_t
#define VM uint32x4_t
#define SSDGS__VW 4
#define V_LOAD(p) vld1q_f32(p)
#define V_STORE(p, v) vst1q_f32(p, v)
#define V_SET(c) vdupq_n_f32((float)(c))
#define V_ADD(a, b) vaddq_f32(a, b)
#define V_SUB(a, b) vsubq_f32(a, b)
#define V_MUL(a, b) vmulq_f32(a, b)
#define V_DIV(a, b) vdivq_f32(a, b)
#define V_FMA(a, b, c) vfmaq_f32(c, a, b)
#define V_FNMA(a, b, c) vfmsq_f32(c, a, b)
#define V_MIN(a, b) vbslq_f32(vcltq_f32(a, b), a, b)
#define V_MAX(a, b) vbslq_f32(vcgtq_f32(a, b), a, b)
#define V_SQRT(a) vsqrtq_f32(a)
#define V_LT(a, b) vcltq_f32(a, b)
#define V_GE(a, b) vcgeq_f32(a, b)
#define V_AND(m, n) vandq_u32(m, n)
#define V_BITS(m) ((int)vaddvq_u32(vandq_u32(m, vld1q_u32(ssdgs__lane_bits))))
#define V_SEL(m, a, b) vbslq_f32(m, a, b)
#define V_ROUND(a) vrndnq_f32(a)
#define V_LDEXP(x, n) \
    vreinterpretq_f32_s32(vaddq_s32(vreinterpretq_s32_f32(x), vshlq_n_s32(vcvtnq_s32_f32(n), 23)))
#define V_EXPONENT(x) \
    vcvtq_f32_s32( \
        vsubq_s32(vreinterpretq_s32_u32(vshrq_n_u32(vreinterpretq_u32_f32(x), 23)), vdupq_n_s32(127)))

#elif SSDGS__ISA == SSDGS__ISA_WASM
#define SSDGS__NAME(name) ssdgs__##name##_wasm
#define SSDGS__TR 5
#define SSDGS__TV 2
#define SSDGS__TARGET
#define V v128_t
#define VM v128_t
#define SSDGS__VW 4
#define V_LOAD(p) wasm_v128_load(p)
#define V_STORE(p, v) wasm_v128_store(p, v)
#define V_SET(c) wasm_f32x4_splat((float)(c))
#define V_ADD(a, b) wasm_f32x4_add(a, b)
#define V_SUB(a, b) wasm_f32x4_sub(a, b)
#define V_MUL(a, b) wasm_f32x4_mul(a, b)
#define V_DIV(a, b) wasm_f32x4_div(a, b)
#define V_FMA(a, b, c) wasm_f32x4_add(wasm_f32x4_mul(a, b), c)
#define V_FNMA(a, b, c) wasm_f32x4_sub(c, wasm_f32x4_mul(a, b))
#define V_MIN(a, b) wasm_f32x4_pmin(b, a) /* a < b ? a : b */
#define V_MAX(a, b) wasm_f32x4_pmax(b, a)
#define V_SQRT(a) wasm_f32x4_sqrt(a)
#define V_LT(a, b) wasm_f32x4_lt(a, b)
#define V_GE(a, b) wasm_f32x4_ge(a, b)
#define V_AND(m, n) wasm_v128_and(m, n)
#define V_BITS(m) ((int)wasm_i32x4_bitmask(m))
#define V_SEL(m, a, b) wasm_v128_bitselect(a, b, m)
#define V_ROUND(a) wasm_f32x4_nearest(a)
/* the float 1.5 x 2^23 + n has n in its low bits */
#define V_LDEXP(x, n) wasm_i32x4_add(x, wasm_i32x4_shl(V_ADD(n, V_SET(12582912)), 23))
#define V_EXPONENT(x) wasm_f32x4_convert_i32x4(wasm_i32x4_sub(wasm_u32x4_shr(x, 23), wasm_i32x4_splat(127)))
#endif
#ifdef SSDGS__MM /* x86 */
#define V_LOAD(p) SSDGS__MM(loadu_ps)(p)
#define V_STORE(p, v) SSDGS__MM(storeu_ps)(p, v)
#define V_SET(c) SSDGS__MM(set1_ps)((float)(c))
#define V_ADD(a, b) SSDGS__MM(add_ps)(a, b)
#define V_SUB(a, b) SSDGS__MM(sub_ps)(a, b)
#define V_MUL(a, b) SSDGS__MM(mul_ps)(a, b)
#define V_DIV(a, b) SSDGS__MM(div_ps)(a, b)
#define V_MIN(a, b) SSDGS__MM(min_ps)(a, b)
#define V_MAX(a, b) SSDGS__MM(max_ps)(a, b)
#define V_SQRT(a) SSDGS__MM(sqrt_ps)(a)
#endif

#define F(name) SSDGS__NAME(name)
#define R ssdgs_real /* a float where there are vectors */
#if SSDGS__ISA == SSDGS__ISA_SCALAR
#define V_UNROLL SSDGS__UNROLL_SCALAR
#else
#define V_UNROLL SSDGS__UNROLL
#endif
#define V_NEG(a) V_SUB(V_SET(0), a)
#define V_ABS(a) V_MAX(a, V_NEG(a))
#define V_DOT3(ax, ay, az, bx, by, bz) V_FMA(az, bz, V_FMA(ay, by, V_MUL(ax, bx)))
#define V_DOT(a, b) V_DOT3((a)[0], (a)[1], (a)[2], (b)[0], (b)[1], (b)[2])
#define V_DOT_SET(c, b) V_DOT3(V_SET((c)[0]), V_SET((c)[1]), V_SET((c)[2]), (b)[0], (b)[1], (b)[2])
#define V_STORE_ADD(to, v) V_STORE(to, V_ADD(V_LOAD(to), v)) /* to += v */
#define V_STORE_FMA(to, a, b) V_STORE(to, V_FMA(a, b, V_LOAD(to)))

/* Sums over lanes are sums of sixteen, SSDGS__NV vectors of them, by halves whatever the width: all
   instruction sets that fuse products and sums give the same bits, and so do all that do not. */
SSDGS__FI R F(sum)(const V *v) {
    R lane[16];
    for (int i = 0; i < SSDGS__NV; i++) V_STORE(lane + i * SSDGS__VW, v[i]);
    for (int n = 8; n > 0; n /= 2)
        for (int i = 0; i < n; i++) lane[i] += lane[i + n];
    return lane[0];
}

/* out[0..3] += the sums of a, b, c, d. */
SSDGS__FI void F(sum4)(R *out, const V *a, const V *b, const V *c, const V *d) {
#if SSDGS__ISA == SSDGS__ISA_AVX512
    __m512 ab = _mm512_add_ps(_mm512_shuffle_f32x4(*a, *b, 0x44), _mm512_shuffle_f32x4(*a, *b, 0xEE));
    __m512 cd = _mm512_add_ps(_mm512_shuffle_f32x4(*c, *d, 0x44), _mm512_shuffle_f32x4(*c, *d, 0xEE));
    __m512 abcd = _mm512_add_ps(_mm512_shuffle_f32x4(ab, cd, 0x88), _mm512_shuffle_f32x4(ab, cd, 0xDD));
    abcd = _mm512_add_ps(abcd, _mm512_permute_ps(abcd, 0x4E));
    abcd = _mm512_add_ps(abcd, _mm512_permute_ps(abcd, 0xB1));
    _mm_storeu_ps(
        out, _mm_add_ps(_mm_loadu_ps(out), _mm512_castps512_ps128(_mm512_maskz_compress_ps(0x8421, abcd))));
#elif SSDGS__ISA == SSDGS__ISA_AVX2
    const __m256 a1 = _mm256_add_ps(a[0], a[1]), b1 = _mm256_add_ps(b[0], b[1]);
    const __m256 c1 = _mm256_add_ps(c[0], c[1]), d1 = _mm256_add_ps(d[0], d[1]);
    __m256 ab = _mm256_add_ps(_mm256_permute2f128_ps(a1, b1, 0x20), _mm256_permute2f128_ps(a1, b1, 0x31));
    __m256 cd = _mm256_add_ps(_mm256_permute2f128_ps(c1, d1, 0x20), _mm256_permute2f128_ps(c1, d1, 0x31));
    __m256 acbd = _mm256_add_ps(_mm256_unpacklo_ps(ab, cd), _mm256_unpackhi_ps(ab, cd));
    acbd = _mm256_add_ps(acbd, _mm256_permute_ps(acbd, 0x4E));
    const __m128 abcd = _mm_unpacklo_ps(_mm256_castps256_ps128(acbd), _mm256_extractf128_ps(acbd, 1));
    _mm_storeu_ps(out, _mm_add_ps(_mm_loadu_ps(out), abcd));
#elif SSDGS__ISA == SSDGS__ISA_SSE2
    const __m128 a1 = _mm_add_ps(_mm_add_ps(a[0], a[2]), _mm_add_ps(a[1], a[3]));
    const __m128 b1 = _mm_add_ps(_mm_add_ps(b[0], b[2]), _mm_add_ps(b[1], b[3]));
    const __m128 c1 = _mm_add_ps(_mm_add_ps(c[0], c[2]), _mm_add_ps(c[1], c[3]));
    const __m128 d1 = _mm_add_ps(_mm_add_ps(d[0], d[2]), _mm_add_ps(d[1], d[3]));
    const __m128 ab = _mm_add_ps(_mm_unpacklo_ps(a1, b1), _mm_unpackhi_ps(a1, b1));
    const __m128 cd = _mm_add_ps(_mm_unpacklo_ps(c1, d1), _mm_unpackhi_ps(c1, d1));
    _mm_storeu_ps(out,
                  _mm_add_ps(_mm_loadu_ps(out), _mm_add_ps(_mm_movelh_ps(ab, cd), _mm_movehl_ps(cd, ab))));
#elif SSDGS__ISA == SSDGS__ISA_WASM
    const v128_t a1 = V_ADD(V_ADD(a[0], a[2]), V_ADD(a[1], a[3])),
                 b1 = V_ADD(V_ADD(b[0], b[2]), V_ADD(b[1], b[3]));
    const v128_t c1 = V_ADD(V_ADD(c[0], c[2]), V_ADD(c[1], c[3])),
                 d1 = V_ADD(V_ADD(d[0], d[2]), V_ADD(d[1], d[3]));
    const v128_t ab = V_ADD(wasm_i32x4_shuffle(a1, b1, 0, 4, 1, 5), wasm_i32x4_shuffle(a1, b1, 2, 6, 3, 7));
    const v128_t cd = V_ADD(wasm_i32x4_shuffle(c1, d1, 0, 4, 1, 5), wasm_i32x4_shuffle(c1, d1, 2, 6, 3, 7));
    V_STORE_ADD(out, V_ADD(wasm_i64x2_shuffle(ab, cd, 0, 2), wasm_i64x2_shuffle(ab, cd, 1, 3)));
#else
    out[0] += F(sum)(a);
    out[1] += F(sum)(b);
    out[2] += F(sum)(c);
    out[3] += F(sum)(d);
#endif
}

/* Four rows of four values become columns. */
SSDGS__FI void F(transpose4)(const R *in, size_t in_stride, R *out, size_t out_stride) {
#if SSDGS__ISA == SSDGS__ISA_SSE2 || SSDGS__ISA == SSDGS__ISA_AVX2 || SSDGS__ISA == SSDGS__ISA_AVX512
    __m128 r[4];
    V_UNROLL for (int i = 0; i < 4; i++) r[i] = _mm_loadu_ps(in + (size_t)i * in_stride);
    _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
    V_UNROLL for (int i = 0; i < 4; i++) _mm_storeu_ps(out + (size_t)i * out_stride, r[i]);
#elif SSDGS__ISA == SSDGS__ISA_WASM
    for (int i = 0; i < 4; i += 2) {
        const v128_t a = V_LOAD(in), b = V_LOAD(in + in_stride), c = V_LOAD(in + 2 * in_stride),
                     d = V_LOAD(in + 3 * in_stride);
        const v128_t ab = i ? wasm_i32x4_shuffle(a, b, 2, 6, 3, 7) : wasm_i32x4_shuffle(a, b, 0, 4, 1, 5);
        const v128_t cd = i ? wasm_i32x4_shuffle(c, d, 2, 6, 3, 7) : wasm_i32x4_shuffle(c, d, 0, 4, 1, 5);
        V_STORE(out + (size_t)i * out_stride, wasm_i64x2_shuffle(ab, cd, 0, 2));
        V_STORE(out + (size_t)(i + 1) * out_stride, wasm_i64x2_shuffle(ab, cd, 1, 3));
    }
#else
    for (int i = 0; i < 16; i++)
        out[(size_t)(i & 3) * out_stride + (size_t)(i >> 2)] =
            in[(size_t)(i >> 2) * in_stride + (size_t)(i & 3)];
#endif
}

/* SSDGS__VW rows of eight values become eight columns. */
SSDGS__FI void F(columns8)(const ssdgs_light_pixel *const *pixel, R (*column)[SSDGS__VW]) {
    R rows[SSDGS__VW][8];
    for (int i = 0; i < SSDGS__VW; i++) memcpy(rows[i], pixel[i], sizeof rows[i]);
#if SSDGS__VW == 1
    memcpy(column, rows, sizeof rows);
#else
    for (int i = 0; i < SSDGS__VW; i += 4)
        for (int j = 0; j < 8; j += 4) F(transpose4)(rows[i] + j, 8, column[j] + i, SSDGS__VW);
#endif
}

/* ==== >>vmath  elementary functions on V, the transfer curve ==== */

/* The kernels call them; the host calls their scalar forms. */

/* The greatest whole number up to x >= 0. */
SSDGS__FI V F(floor)(V x) {
    const V whole = V_ROUND(x);
    return V_SEL(V_LT(x, whole), V_SUB(whole, V_SET(1)), whole);
}

#ifdef SSDGS_REAL64
SSDGS__FI V F(exp)(V x) { return exp(V_MIN(700.0, x)); }
SSDGS__FI V F(exp2)(V x) { return exp(x * 0.69314718055994530942); }
SSDGS__FI V F(log)(V x) { return log(x); }
SSDGS__FI void F(sincos)(V x, V *s, V *c) {
    *s = sin(x);
    *c = cos(x);
}
SSDGS__FI V F(log1p)(V x) { return log1p(x); }
#else
/* 2^x for x up to 127, saturating below -126: degree 5 on [-1/2, 1/2], 2.4e-7 relative. */
SSDGS__FI V F(exp2)(V x) {
    x = V_MAX(V_SET(-126), x);
    const V whole = V_ROUND(x);
    const V f = V_SUB(x, whole);
    V p = V_FMA(f, V_SET(1.33908633e-3), V_SET(9.67603177e-3));
    p = V_FMA(p, f, V_SET(5.55035695e-2));
    p = V_FMA(p, f, V_SET(2.40221068e-1));
    p = V_FMA(p, f, V_SET(6.93147182e-1));
    p = V_FMA(p, f, V_SET(1.00000012));
    return V_LDEXP(p, whole);
}

/* e^x, saturating beyond +-87; ln 2 in two parts keeps the error independent of |x|. */
SSDGS__FI V F(exp)(V x) {
    x = V_MAX(V_SET(-87), V_MIN(V_SET(87), x));
    const V whole = V_ROUND(V_MUL(x, V_SET(1.44269504088896341)));
    const V f = V_FNMA(whole, V_SET(-2.12194440e-4), V_FNMA(whole, V_SET(0.693359375), x));
    V p = V_FMA(f, V_SET(1.9875691500e-4), V_SET(1.3981999507e-3));
    p = V_FMA(p, f, V_SET(8.3334519073e-3));
    p = V_FMA(p, f, V_SET(4.1665795894e-2));
    p = V_FMA(p, f, V_SET(1.6666665459e-1));
    p = V_FMA(p, f, V_SET(5.0000001201e-1));
    p = V_ADD(V_FMA(p, V_MUL(f, f), f), V_SET(1));
    return V_LDEXP(p, whole);
}

/* ln x for normal x > 0: 2 atanh((m - 1) / (m + 1)) + e ln 2, m in [sqrt(1/2), sqrt 2). */
SSDGS__FI V F(log)(V x) {
    V e = V_EXPONENT(x), m = V_LDEXP(x, V_NEG(e));
    VM big = V_LT(V_SET(1.41421356), m);
    m = V_SEL(big, V_MUL(m, V_SET(0.5)), m);
    e = V_SEL(big, V_ADD(e, V_SET(1)), e);
    const V t = V_DIV(V_SUB(m, V_SET(1)), V_ADD(m, V_SET(1)));
    const V t2 = V_MUL(t, t);
    V p = V_FMA(t2, V_SET(2.0 / 9), V_SET(2.0 / 7));
    p = V_FMA(p, t2, V_SET(2.0 / 5));
    p = V_FMA(p, t2, V_SET(2.0 / 3));
    p = V_FMA(V_MUL(p, t2), t, V_MUL(t, V_SET(2)));
    return V_FMA(e, V_SET(0.693359375), V_FMA(e, V_SET(-2.12194440e-4), p));
}

/* ln(1 + x) for 0 <= x <= 1, accurate near 0. */
SSDGS__FI V F(log1p)(V x) {
    V t = V_DIV(x, V_ADD(x, V_SET(2))), t2 = V_MUL(t, t);
    V p = V_FMA(t2, V_SET(2.0 / 17), V_SET(2.0 / 15));
    p = V_FMA(p, t2, V_SET(2.0 / 13));
    p = V_FMA(p, t2, V_SET(2.0 / 11));
    p = V_FMA(p, t2, V_SET(2.0 / 9));
    p = V_FMA(p, t2, V_SET(2.0 / 7));
    p = V_FMA(p, t2, V_SET(2.0 / 5));
    p = V_FMA(p, t2, V_SET(2.0 / 3));
    return V_FMA(V_MUL(p, t2), t, V_MUL(t, V_SET(2)));
}

/* Good to |x| about 1e5: pi/2 in three parts. */
SSDGS__FI void F(sincos)(V x, V *s, V *c) {
    V n = V_ROUND(V_MUL(x, V_SET(0.636619772367581)));
    V r = V_FNMA(n, V_SET(1.5703125), x);
    r = V_FNMA(n, V_SET(4.83751296997070e-4), r);
    r = V_FNMA(n, V_SET(7.54978995489188e-8), r);
    const V r2 = V_MUL(r, r);
    V ps = V_FMA(r2, V_SET(-1.9515295891e-4), V_SET(8.3321608736e-3));
    ps = V_FMA(ps, r2, V_SET(-1.6666654611e-1));
    ps = V_FMA(V_MUL(ps, r2), r, r);
    V pc = V_FMA(r2, V_SET(2.443315711809948e-5), V_SET(-1.388731625493765e-3));
    pc = V_FMA(pc, r2, V_SET(4.166664568298827e-2));
    pc = V_FMA(V_MUL(pc, r2), r2, V_FNMA(r2, V_SET(0.5), V_SET(1)));
    const V q = V_FNMA(V_ROUND(V_FMA(n, V_SET(0.25), V_SET(-0.375))), V_SET(4), n); /* quadrant 0..3 */
    const VM odd = V_LT(V_ABS(V_SUB(V_ABS(V_SUB(q, V_SET(2))), V_SET(1))), V_SET(0.5));
    const VM negative_s = V_GE(q, V_SET(1.5));
    const VM negative_c = V_LT(V_ABS(V_SUB(q, V_SET(1.5))), V_SET(1));
    *s = V_SEL(odd, pc, ps);
    *c = V_SEL(odd, ps, pc);
    *s = V_SEL(negative_s, V_NEG(*s), *s);
    *c = V_SEL(negative_c, V_NEG(*c), *c);
}
#endif

#define V_EXP(x) F(exp)(x)
#define V_LOG(x) F(log)(x)

SSDGS__FI V F(sigmoid)(V x) { return V_DIV(V_SET(1), V_ADD(V_SET(1), V_EXP(V_NEG(x)))); }
SSDGS__FI V F(softplus)(V x) { return V_ADD(V_MAX(x, V_SET(0)), F(log1p)(V_EXP(V_NEG(V_ABS(x))))); }

/* Unit quaternion q (w x y z) of a raw one and its row-major matrix r; returns 1 / |raw|. A zero one: the
   identity. */
SSDGS__FI V F(rotation)(const V raw[4], V q[4], V r[9]) {
    V largest = V_MAX(V_MAX(V_ABS(raw[0]), V_ABS(raw[1])), V_MAX(V_ABS(raw[2]), V_ABS(raw[3])));
    V least = V_SET(1e-37), two = V_SET(2), one = V_SET(1);
    V inverse = V_SEL(V_LT(largest, least), V_SET(0), V_DIV(one, V_MAX(largest, least)));
    for (int i = 0; i < 4; i++)
        q[i] = V_MUL(raw[i], inverse); /* first by the largest: squares neither over- nor underflow */
    V norm2 = V_MAX(V_FMA(q[0], q[0], V_DOT3(q[1], q[2], q[3], q[1], q[2], q[3])), V_SET(1e-30));
    norm2 = V_DIV(one, V_SQRT(norm2));
    for (int i = 0; i < 4; i++) q[i] = V_MUL(q[i], norm2);
    inverse = V_MUL(inverse, norm2);
    r[0] = V_FNMA(two, V_FMA(q[2], q[2], V_MUL(q[3], q[3])), one);
    r[1] = V_MUL(two, V_FNMA(q[0], q[3], V_MUL(q[1], q[2])));
    r[2] = V_MUL(two, V_FMA(q[0], q[2], V_MUL(q[1], q[3])));
    r[3] = V_MUL(two, V_FMA(q[0], q[3], V_MUL(q[1], q[2])));
    r[4] = V_FNMA(two, V_FMA(q[1], q[1], V_MUL(q[3], q[3])), one);
    r[5] = V_MUL(two, V_FNMA(q[0], q[1], V_MUL(q[2], q[3])));
    r[6] = V_MUL(two, V_FNMA(q[0], q[2], V_MUL(q[1], q[3])));
    r[7] = V_MUL(two, V_FMA(q[0], q[1], V_MUL(q[2], q[3])));
    r[8] = V_FNMA(two, V_FMA(q[1], q[1], V_MUL(q[2], q[2])), one);
    return inverse;
}

/* d_raw = d(rotation)/d(raw)^T dr: through the matrix, then projected off the radial direction. */
SSDGS__FI void F(rotation_backward)(V d_raw[4], const V q[4], V inverse, const V dr[9]) {
    V w = q[0], x = q[1], y = q[2], z = q[3], g[4];
    V a = V_SUB(dr[7], dr[5]), b = V_SUB(dr[2], dr[6]), c = V_SUB(dr[3], dr[1]);
    V xy = V_ADD(dr[1], dr[3]), xz = V_ADD(dr[2], dr[6]), yz = V_ADD(dr[5], dr[7]);
    g[0] = V_DOT3(x, y, z, a, b, c);
    g[1] = V_SUB(V_FMA(w, a, V_FMA(y, xy, V_MUL(z, xz))), V_MUL(V_MUL(V_SET(2), x), V_ADD(dr[4], dr[8])));
    g[2] = V_SUB(V_FMA(w, b, V_FMA(x, xy, V_MUL(z, yz))), V_MUL(V_MUL(V_SET(2), y), V_ADD(dr[0], dr[8])));
    g[3] = V_SUB(V_FMA(w, c, V_FMA(x, xz, V_MUL(y, yz))), V_MUL(V_MUL(V_SET(2), z), V_ADD(dr[0], dr[4])));
    for (int i = 0; i < 4; i++) g[i] = V_MUL(V_SET(2), g[i]);
    const V radial = V_FMA(w, g[0], V_DOT3(x, y, z, g[1], g[2], g[3]));
    for (int i = 0; i < 4; i++) d_raw[i] = V_MUL(inverse, V_FNMA(q[i], radial, g[i]));
}

/* sRGB encoding; with slope also its derivative. Negative values take the linear part. */
SSDGS__FN void F(srgb_encode)(R *out, R *slope, const R *in, size_t n) {
    for (size_t i = 0; i < n; i += SSDGS__VW) {
        const V x = V_LOAD(in + i), safe = V_MAX(x, V_SET(0.0031308));
        const VM curved =
            V_AND(V_GE(x, V_SET(0.0031308)), V_LT(V_SUB(x, x), V_SET(1))); /* NaN and infinity stay */
        const V power = V_MUL(V_SET(1.055), V_EXP(V_MUL(V_LOG(safe), V_SET(1 / 2.4))));
        V_STORE(out + i, V_SEL(curved, V_SUB(power, V_SET(0.055)), V_MUL(x, V_SET(12.92))));
        if (slope) V_STORE(slope + i, V_SEL(curved, V_DIV(power, V_MUL(safe, V_SET(2.4))), V_SET(12.92)));
    }
}

SSDGS__FN void F(srgb_decode)(R *out, const R *in, size_t n) {
    for (size_t i = 0; i < n; i += SSDGS__VW) {
        const V x = V_LOAD(in + i),
                base = V_MUL(V_ADD(V_MAX(x, V_SET(0.04045)), V_SET(0.055)), V_SET(1 / 1.055));
        const V power = V_EXP(V_MUL(V_LOG(base), V_SET(2.4)));
        const VM curved =
            V_AND(V_GE(x, V_SET(0.04045)), V_LT(V_SUB(x, x), V_SET(1))); /* NaN and infinity stay */
        V_STORE(out + i, V_SEL(curved, power, V_MUL(x, V_SET(1 / 12.92))));
    }
}

/* Kernels below have a scalar form only with SSDGS_SCALAR, or where SIMD may be missing. */
#if SSDGS__ISA != SSDGS__ISA_SCALAR || SSDGS__SCALAR

/* ==== >>project_kernel  eq. 1: EWA projection of Gaussians begin .. end ==== */

/* What both directions need of a projection, per lane. */
typedef struct F(projection) {
    V x[3], t[3], inverse_z, row[2][3], q[4], inverse_q, r[9], s[3], m[2][3], cross[3], a, b, c, det0, h, det,
        inverse_det, ux, uy, wy, opacity, clear;
    /* cross = m0 x m1; conic = 1 / (a + h, b; b, c + h) = U' U, U = (ux, uy; 0, wy), which a record has times
       sqrt(log2(e) / 2); clear = 1 - opacity */
    V slope[2], edge[2], axis[3], back, beside, deep, rise, fade;
    /* edge: the slope, or the border's where it is beyond; axis: deviations along z / depth, back = axis^2;
       fade = rise (1 - deep (1 - beside)) */
} F(projection);

/* Where opacity fades: slopes of the borders, 1 / near_plane. */
typedef struct F(rim) {
    V low[2], high[2], inverse_near;
} F(rim);

SSDGS__FI void F(rim_of)(const ssdgs__projection *k, F(rim) * rim) {
    for (int i = 0; i < 2; i++) {
        const R focal = i ? k->fy : k->fx, centre = i ? k->cy : k->cx,
                most = (R)1e9; /* products of two squares are finite */
        const R low = -centre / focal, high = ((R)(i ? k->height : k->width) - centre) / focal;
        rim->low[i] = V_SET(low > -SSDGS__STEEP ? -SSDGS__STEEP : low > -most ? low : -most);
        rim->high[i] = V_SET(high < SSDGS__STEEP ? SSDGS__STEEP : high < most ? high : most);
    }
    rim->inverse_near = V_SET(k->near_plane > (R)1e-30 ? 1 / k->near_plane : (R)1e30);
}

/* What opacity is multiplied by: less and less from twice near_plane down to it, and beside the picture where
   the Gaussian is deep, by the squares of (1 + edge^2) / (1 + slope^2), which are cos^4 of angles: none pops
   when the camera turns. */
SSDGS__FI void F(fade)(const ssdgs__projection *k, const F(rim) * rim, F(projection) * p) {
    const V one = V_SET(1);
    p->fade = one;
    if (k->orthographic) return;
    V away = V_MAX(V_SET(0), V_SUB(V_SET(2 * k->near_plane), p->t[2]));
    for (int i = 0; i < 2; i++) {
        p->slope[i] = V_MUL(p->t[i], p->inverse_z);
        p->edge[i] = V_MAX(rim->low[i], V_MIN(rim->high[i], p->slope[i]));
        away = V_ADD(away, V_ABS(V_SUB(p->slope[i], p->edge[i])));
    }
    if (!V_BITS(V_LT(V_SET(0), away))) return;
    p->back = V_SET(0);
    for (int j = 0; j < 3; j++) {
        p->axis[j] = V_MUL(V_MUL(p->s[j], p->inverse_z),
                           V_DOT3(V_SET(k->view[8]), V_SET(k->view[9]), V_SET(k->view[10]), p->r[j],
                                  p->r[3 + j], p->r[6 + j]));
        p->back = V_FMA(p->axis[j], p->axis[j], p->back);
    }
    p->beside = V_DIV(V_MUL(V_FMA(p->edge[0], p->edge[0], one), V_FMA(p->edge[1], p->edge[1], one)),
                      V_MUL(V_FMA(p->slope[0], p->slope[0], one), V_FMA(p->slope[1], p->slope[1], one)));
    p->beside = V_MUL(p->beside, p->beside);
    p->deep = V_MAX(V_SET(0), V_MIN(one, V_MUL(V_SUB(p->back, V_SET(SSDGS__BACK)),
                                               V_SET(1 / (SSDGS__FAR_BACK - SSDGS__BACK)))));
    p->rise = V_MAX(V_SET(0), V_MIN(one, V_MUL(V_SUB(p->t[2], V_SET(k->near_plane)), rim->inverse_near)));
    p->fade = V_MUL(p->rise, V_FNMA(p->deep, V_SUB(one, p->beside), one));
}

/* Lanes in `off` get neutral parameters: what is not drawn must not reach the others, whatever it holds. */
SSDGS__FI void F(project_lanes)(F(projection) * p, const ssdgs__projection *k, const R *g, size_t stride,
                                VM off) {
    for (int i = 0; i < 3; i++)
        p->x[i] = V_SEL(off, V_SET(0), V_LOAD(g + (size_t)(SSDGS_POSITION + i) * stride));
    V raw[4];
    for (int i = 0; i < 4; i++)
        raw[i] = V_SEL(off, V_SET(i == 0), V_LOAD(g + (size_t)(SSDGS_ROTATION + i) * stride));
    for (int i = 0; i < 3; i++) {
        V log_scale = V_SEL(off, V_SET(0), V_LOAD(g + (size_t)(SSDGS_LOG_SCALE + i) * stride));
        p->s[i] = V_EXP(V_MAX(V_SET(-SSDGS__RAW_LIMIT), V_MIN(V_SET(SSDGS__RAW_LIMIT), log_scale)));
        p->t[i] = V_ADD(V_DOT_SET(k->view + 4 * i, p->x), V_SET(k->view[4 * i + 3]));
    }
    p->inverse_q = F(rotation)(raw, p->q, p->r);
    p->inverse_z = k->orthographic ? V_SET(1) : V_DIV(V_SET(1), V_MAX(p->t[2], V_SET(k->near_plane)));
    p->inverse_z = V_SEL(off, V_SET(0), p->inverse_z); /* the world's 0 may be behind the camera */
    for (int i = 0; i < 2; i++) {                      /* rows of J W */
        V focal = V_MUL(V_SET(i ? k->fy : k->fx), p->inverse_z);
        V slope = k->orthographic ? V_SET(0) : V_MUL(p->t[i], p->inverse_z);
        for (int j = 0; j < 3; j++)
            p->row[i][j] = V_MUL(focal, V_FNMA(slope, V_SET(k->view[8 + j]), V_SET(k->view[4 * i + j])));
        for (int j = 0; j < 3; j++) /* m = J W R S */
            p->m[i][j] = V_MUL(
                p->s[j], V_DOT3(p->row[i][0], p->row[i][1], p->row[i][2], p->r[j], p->r[3 + j], p->r[6 + j]));
    }
    p->a = V_DOT(p->m[0], p->m[0]);
    p->b = V_DOT(p->m[0], p->m[1]);
    p->c = V_DOT(p->m[1], p->m[1]);
    /* difference of products, its rounding error put back by the fused operation */
    for (int i = 0; i < 3; i++) {
        V u0 = p->m[0][(i + 1) % 3], v0 = p->m[1][(i + 2) % 3], u1 = p->m[0][(i + 2) % 3],
          v1 = p->m[1][(i + 1) % 3];
        V product = V_MUL(u1, v1);
        p->cross[i] = V_ADD(V_FMA(u0, v0, V_NEG(product)), V_FNMA(u1, v1, product));
    }
    p->det0 = V_DOT(p->cross, p->cross);
    if (k->blur == SSDGS_BLUR_ADD) {
        p->h = V_SET(k->variance);
    } else {
        V mean = V_MUL(V_SET(0.5), V_ADD(p->a, p->c)), half = V_MUL(V_SET(0.5), V_SUB(p->a, p->c));
        V largest = V_ADD(mean, V_SQRT(V_FMA(half, half, V_MUL(p->b, p->b))));
        p->h = V_MAX(V_SET(0), V_SUB(V_SET(k->variance), V_DIV(p->det0, V_MAX(largest, V_SET(1e-30)))));
    }
    p->det = V_ADD(p->det0, V_MUL(p->h, V_ADD(V_ADD(p->a, p->c), p->h)));
    p->inverse_det = V_DIV(V_SET(1), p->det);
    const V high = V_ADD(p->c, p->h), inverse_high = V_DIV(V_SET(1), high);
    p->ux = V_SQRT(V_MUL(high, p->inverse_det));
    p->uy = V_MUL(p->ux, V_NEG(V_MUL(p->b, inverse_high)));
    p->wy = V_SQRT(inverse_high);
    p->opacity = V_SEL(off, V_SET(0), V_LOAD(g + (size_t)SSDGS_OPACITY * stride));
    p->clear = V_EXP(V_NEG(V_MAX(V_SET(-SSDGS__RAW_LIMIT), V_MIN(V_SET(SSDGS__RAW_LIMIT), p->opacity))));
    p->opacity = V_DIV(V_SET(1), V_ADD(V_SET(1), p->clear));
    p->clear = V_MUL(p->clear, p->opacity);
}

SSDGS__FN void F(project)(const ssdgs__projection *k, const R *gaussians, size_t stride, size_t begin,
                          size_t end, ssdgs_record *record, R *depth, R *slope) {
    const V log2e = V_SET(1.44269504088896341), unit = V_SET(0.84932180028801904); /* sqrt(log2(e) / 2) */
    F(rim) rim;
    F(rim_of)(k, &rim);
    for (size_t i = begin; i < end; i += SSDGS__VW) {
        F(projection) p;
        F(project_lanes)(&p, k, gaussians + i, stride, V_LT(V_SET(1), V_SET(0)));
        F(fade)(k, &rim, &p);
        if (k->presence < 1) { /* transmittances of parts multiply to that of the whole */
            const V part = V_EXP(V_MUL(V_SET(k->presence), V_LOG(V_MAX(p.clear, V_SET(1e-30)))));
            p.opacity = V_SEL(V_GE(p.clear, V_SET(0)), V_SUB(V_SET(1), part), p.opacity); /* NaN stays */
        }
        V opacity = V_MUL(p.opacity, p.fade);
        if (k->compensate) opacity = V_MUL(opacity, V_SQRT(V_MUL(p.det0, p.inverse_det)));
        const V log2_opacity = V_MUL(V_LOG(V_MAX(opacity, V_SET(1e-30))), log2e);
        const V x = V_FMA(V_MUL(V_SET(k->fx), p.t[0]), p.inverse_z, V_SET(k->cx));
        const V y = V_FMA(V_MUL(V_SET(k->fy), p.t[1]), p.inverse_z, V_SET(k->cy));
        const V reach = V_MAX(
            V_SET(0), V_MUL(V_SET(2 * 0.69314718055994531), V_SUB(log2_opacity, V_SET(k->log2_threshold))));
        const V ex = V_SQRT(V_MUL(reach, V_ADD(p.a, p.h)));
        const V ey = V_SQRT(V_MUL(reach, V_ADD(p.c, p.h)));
        const V d = k->by_distance ? V_SQRT(V_DOT(p.t, p.t)) : p.t[2];
        /* NaN fails every comparison, so nothing that is not finite is drawn */
        VM drawn = V_AND(V_GE(log2_opacity, V_SET(k->log2_threshold)),
                         V_AND(V_LT(V_SET(k->near_plane), p.t[2]), V_LT(p.t[2], V_SET(1e30))));
        drawn = V_AND(drawn, V_LT(V_ADD(ex, ey), V_SET(1e9)));
        drawn = V_AND(drawn, V_AND(V_LT(V_SET(0), p.det), V_LT(p.det, V_SET(1e37))));
        drawn = V_AND(drawn,
                      V_AND(V_GE(V_ADD(x, ex), V_SET(0.5)), V_GE(V_SET((R)k->width - (R)0.5), V_SUB(x, ex))));
        drawn = V_AND(
            drawn, V_AND(V_GE(V_ADD(y, ey), V_SET(0.5)), V_GE(V_SET((R)k->height - (R)0.5), V_SUB(y, ey))));
        V_STORE(depth + i, V_SEL(drawn, V_MUL(d, V_SET(k->depth_scale)), V_SET(-1)));
        if (!V_BITS(drawn)) continue;
        R fields[8][SSDGS__VW];
        if (slope) { /* the covariance with z by U: depth is linear in the pixel's u and w */
            V along[3];
            for (int j = 0; j < 3; j++)
                along[j] = V_MUL(V_MUL(p.s[j], V_SET(k->depth_scale)),
                                 V_DOT3(V_SET(k->view[8]), V_SET(k->view[9]), V_SET(k->view[10]), p.r[j],
                                        p.r[3 + j], p.r[6 + j]));
            const V by_x = V_DOT(p.m[0], along), by_y = V_DOT(p.m[1], along);
            V_STORE(fields[0], V_DIV(V_FMA(p.ux, by_x, V_MUL(p.uy, by_y)), unit));
            V_STORE(fields[1], V_DIV(V_MUL(p.wy, by_y), unit));
            for (size_t l = 0; l < 2 * SSDGS__VW; l++) slope[2 * i + l] = fields[l & 1][l / 2];
        }
        V_STORE(fields[0], x);
        V_STORE(fields[1], y);
        V_STORE(fields[2], V_MUL(unit, p.ux));
        V_STORE(fields[3], V_MUL(unit, p.uy));
        V_STORE(fields[4], V_MUL(unit, p.wy));
        V_STORE(fields[5], log2_opacity);
        V_STORE(fields[6], ex);
        V_STORE(fields[7], ey);
#if SSDGS__VW >= 4
        for (int f = 0; f < 8; f += 4)
            for (int l = 0; l < SSDGS__VW; l += 4)
                F(transpose4)(fields[f] + l, SSDGS__VW, (R *)(void *)(record + i + (size_t)l) + f, 8);
#else
        for (int f = 0; f < 8; f++)
            for (int l = 0; l < SSDGS__VW; l++) ((R *)(void *)(record + i + (size_t)l))[f] = fields[f][l];
#endif
    }
}

/* The gradient of ln fade, times g: adds to the planes of the scales, to dr and to view_sum, all of Gaussians
   i and on; push: dL/d(slope of x, of y, z). */
SSDGS__FI void F(fade_backward)(const ssdgs__projection *k, const F(rim) * rim, const F(projection) * p, V g,
                                const R *raw, size_t stride, R *gradient, size_t gradient_stride, V dr[9],
                                V push[3], V view_sum[12][SSDGS__NV], size_t v) {
    const V zero = V_SET(0), one = V_SET(1);
    const V dq = V_DIV(g, V_MAX(V_FNMA(p->deep, V_SUB(one, p->beside), one), V_SET(1e-20)));
    for (int i = 0; i < 2; i++) { /* beside = ((1 + edge^2) / (1 + slope^2))^2 .. */
        const V down = V_DIV(V_MUL(V_SET(-4), p->slope[i]), V_FMA(p->slope[i], p->slope[i], one));
        push[i] = V_SEL(V_LT(zero, V_ABS(V_SUB(p->slope[i], p->edge[i]))),
                        V_MUL(V_MUL(dq, p->deep), V_MUL(p->beside, down)), zero);
    }
    /* axis_j = s_j / z (view row 2 . r_j) */
    const V steep =
        V_SEL(V_AND(V_LT(zero, p->deep), V_LT(p->deep, one)),
              V_MUL(V_MUL(dq, V_SUB(one, p->beside)), V_SET(-2 / (SSDGS__FAR_BACK - SSDGS__BACK))), zero);
    push[2] = V_MUL(V_NEG(V_MUL(steep, p->back)), p->inverse_z);
    push[2] = V_ADD(push[2], V_SEL(V_AND(V_LT(zero, p->rise), V_LT(p->rise, one)),
                                   V_DIV(V_MUL(g, rim->inverse_near), V_MAX(p->rise, V_SET(1e-20))), zero));
    for (int j = 0; j < 3; j++) {
        const V by_axis = V_MUL(steep, p->axis[j]), along = V_MUL(by_axis, V_MUL(p->s[j], p->inverse_z));
        const V held = V_ABS(V_LOAD(raw + (size_t)(SSDGS_LOG_SCALE + j) * stride));
        V_STORE_ADD(gradient + (size_t)(SSDGS_LOG_SCALE + j) * gradient_stride,
                    V_SEL(V_LT(held, V_SET(SSDGS__RAW_LIMIT)), V_MUL(by_axis, p->axis[j]), zero));
        for (int l = 0; l < 3; l++) {
            dr[3 * l + j] = V_FMA(along, V_SET(k->view[8 + l]), dr[3 * l + j]);
            view_sum[8 + l][v] = V_FMA(along, p->r[3 * l + j], view_sum[8 + l][v]);
        }
    }
}

/* splat (n, SSDGS__SPLAT): see SSDGS_SPLAT_GRADIENTS. Adds to the gradient planes; view_slot (12) is
   overwritten. */
SSDGS__FN void F(project_backward)(const ssdgs__projection *k, const R *gaussians, size_t stride,
                                   size_t begin, size_t end, const ssdgs__project_gradient *out) {
    const R *splat = out->splat;
    R *gradient = out->planes, *view_slot = out->view;
    const size_t gradient_stride = out->stride;
    V view_sum[12][SSDGS__NV];
    for (int j = 0; j < 12; j++)
        for (int l = 0; l < SSDGS__NV; l++) view_sum[j][l] = V_SET(0);
    F(rim) rim;
    F(rim_of)(k, &rim);
    for (size_t i = begin; i < end; i += SSDGS__VW) {
        const size_t v = i / SSDGS__VW % SSDGS__NV;
        R lane[8][SSDGS__VW];
        for (int l = 0; l < SSDGS__VW; l++)
            for (int j = 0; j < 8; j++)
                lane[j][l] = j == 6 ? 0 : splat[(i + (size_t)l) * SSDGS__SPLAT + (size_t)j];
        V total = V_SET(0);
        V g[8];
        for (int j = 0; j < 8; j++) {
            g[j] = V_LOAD(lane[j]);
            total = V_ADD(total, V_ABS(g[j]));
        }
        const VM off = V_GE(V_SET(0), total); /* NaN stays in, to be refused */
        if (V_BITS(off) == (1 << SSDGS__VW) - 1) continue;
        F(projection) p;
        F(project_lanes)(&p, k, gaussians + i, stride, off);
        F(fade)(k, &rim, &p);
        const V ux_by_high = V_MUL(p.ux, V_MUL(p.wy, p.wy));
        const V inverse_det0 = V_DIV(V_SET(1), V_MAX(p.det0, V_SET(1e-20)));
        V du[2][3];
        for (int j = 0; j < 3; j++) du[0][j] = du[1][j] = V_SET(0);
        /* m = (J W) (R S), covariance C = m m' + h, conic K = 1 / C = U' U. With M = sum of dL/d(ln alpha) v
           v', v = U (pixel - centre), and n = U m: dL/dm = U' M n, dL/d(ln s_j) = n_j.M n_j. Multiplied
           out, U m and K m of a thin Gaussian cancel; det K m = h m + (m1 x X, X x m0), X = m0 x m1, does
           not. */
        V dr[9];
        for (int j = 0; j < 3; j++) {
            const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            const V across0 = V_FNMA(p.m[1][j2], p.cross[j1], V_MUL(p.m[1][j1], p.cross[j2])),
                    along0 = V_FMA(p.h, p.m[0][j], across0);
            const V n0 = V_MUL(ux_by_high, along0), n1 = V_MUL(p.wy, p.m[1][j]);
            const V mn0 = V_FMA(g[2], n0, V_MUL(g[3], n1)), mn1 = V_FMA(g[3], n0, V_MUL(g[4], n1));
            V dm0 = V_MUL(p.ux, mn0), dm1 = V_FMA(p.uy, mn0, V_MUL(p.wy, mn1));
            V raw = V_LOAD(gaussians + (size_t)(SSDGS_LOG_SCALE + j) * stride + i),
              ds = V_FMA(n0, mn0, V_MUL(n1, mn1));
            if (k->compensate) { /* ln opacity += (ln det0 - ln det) / 2 */
                const V across1 = V_FNMA(p.m[0][j1], p.cross[j2], V_MUL(p.m[0][j2], p.cross[j1])),
                        along1 = V_FMA(p.h, p.m[1][j], across1);
                const V push0 = V_MUL(g[5], V_FNMA(along0, p.inverse_det, V_MUL(across0, inverse_det0))),
                        push1 = V_MUL(g[5], V_FNMA(along1, p.inverse_det, V_MUL(across1, inverse_det0)));
                dm0 = V_ADD(dm0, push0);
                dm1 = V_ADD(dm1, push1);
                ds = V_FMA(push0, p.m[0][j], V_FMA(push1, p.m[1][j], ds));
            }
            V_STORE_ADD(gradient + (size_t)(SSDGS_LOG_SCALE + j) * gradient_stride + i,
                        V_SEL(V_LT(V_ABS(raw), V_SET(SSDGS__RAW_LIMIT)), ds, V_SET(0)));
            dm0 = V_MUL(dm0, p.s[j]);
            dm1 = V_MUL(dm1, p.s[j]);
            for (int l = 0; l < 3; l++) {
                dr[3 * l + j] = V_FMA(dm0, p.row[0][l], V_MUL(dm1, p.row[1][l]));
                du[0][l] = V_FMA(dm0, p.r[3 * l + j], du[0][l]);
                du[1][l] = V_FMA(dm1, p.r[3 * l + j], du[1][l]);
            }
        }
        V push[3];
        for (int j = 0; j < 3; j++) push[j] = V_SET(0);
        if (V_BITS(V_LT(p.fade, V_SET(1)))) F(fade_backward)
        (k, &rim, &p, g[5], gaussians + i, stride, gradient + i, gradient_stride, dr, push, view_sum, v);
        V dq[4];
        F(rotation_backward)(dq, p.q, p.inverse_q, dr);
        for (int j = 0; j < 4; j++)
            V_STORE_ADD(gradient + (size_t)(SSDGS_ROTATION + j) * gradient_stride + i, dq[j]);
        const V raw = V_LOAD(gaussians + (size_t)SSDGS_OPACITY * stride + i);
        V_STORE_ADD(gradient + (size_t)SSDGS_OPACITY * gradient_stride + i, /* d ln o / d logit = 1 - o */
                    V_SEL(V_LT(V_ABS(raw), V_SET(SSDGS__RAW_LIMIT)), V_MUL(g[5], p.clear), V_SET(0)));
        V dt[3];
        dt[2] = V_ADD(g[7], push[2]);
        for (int l = 0; l < 2; l++) { /* J: focal / z, -focal t / z^2; centre: focal t / z */
            V focal = V_SET(l ? k->fy : k->fx), scaled = V_MUL(focal, p.inverse_z),
              slope = V_MUL(p.t[l], p.inverse_z);
            V dj = V_DOT_SET(k->view + 4 * l, du[l]), dj2 = V_DOT_SET(k->view + 8, du[l]);
            V dslope = V_ADD(push[l], V_FNMA(scaled, dj2, V_MUL(focal, g[l]))); /* slope = t / z stands in J
                                                                               and in the centre, and fades */
            dt[l] = V_MUL(dslope, p.inverse_z);
            dt[2] = V_FNMA(V_MUL(dslope, slope), p.inverse_z, dt[2]);
            dt[2] = V_FNMA(V_MUL(scaled, p.inverse_z), V_FNMA(slope, dj2, dj), dt[2]);
            for (int j = 0; j < 3; j++) {
                view_sum[4 * l + j][v] = V_FMA(scaled, du[l][j], view_sum[4 * l + j][v]);
                view_sum[8 + j][v] = V_FNMA(V_MUL(scaled, slope), du[l][j], view_sum[8 + j][v]);
            }
        }
        for (int j = 0; j < 3; j++) {
            V_STORE_ADD(
                gradient + (size_t)(SSDGS_POSITION + j) * gradient_stride + i,
                V_DOT3(dt[0], dt[1], dt[2], V_SET(k->view[j]), V_SET(k->view[4 + j]), V_SET(k->view[8 + j])));
            for (int l = 0; l < 3; l++) view_sum[4 * j + l][v] = V_FMA(dt[j], p.x[l], view_sum[4 * j + l][v]);
            view_sum[4 * j + 3][v] = V_ADD(view_sum[4 * j + 3][v], dt[j]);
        }
    }
    for (int j = 0; j < 12; j++) view_slot[j] = F(sum)(view_sum[j]);
}

/* ==== >>bin_kernel  which 4x4 micro-tiles an ellipse touches ==== */

/* Lists the instances of Gaussians begin .. end, numbered from `at` on: the tiles of a Gaussian's box, row by
   row, where some pixel's alpha may reach the threshold, with a mask of such micro-tiles (lanes). Over
   the rectangle of a micro-tile's pixel centres, u^2 + w^2 is least on the sides that face the centre:
   nearest dx with the best dy for it, or nearest dy with the best dx. */
SSDGS__FN uint32_t F(bin)(const ssdgs_splat_view *view, const uint16_t *boxes, R log2_threshold, int begin,
                          int end, uint32_t at) {
    const V zero = V_SET(0), side = V_SET(3);
    for (int g = begin; g < end; g++) {
        const ssdgs_record *record = view->record + g;
        const uint16_t *box = boxes + 4 * (size_t)g;
        ssdgs_instances *of = view->of_gaussian + g;
        int left = (box[2] - box[0] + 1) * (box[3] - box[1] + 1), tx = box[0], ty = box[1];
        of->first = at;
        of->count = 0;
        if (!left) continue;
        const V ux = V_SET(record->ux), uy = V_SET(record->uy), wy = V_SET(record->wy);
        const V best_x = V_SET(-record->uy / record->ux);
        const V best_y =
            V_SET(-record->ux * record->uy / (record->uy * record->uy + record->wy * record->wy));
        const V terms = V_FMA(ux, V_SET(record->extent_x), V_MUL(V_ABS(uy), V_SET(record->extent_y)));
        /* with more than the rounding of u^2 + w^2, so no pixel that blends is missed */
        const V most = V_FMA(V_SET(4e-6), terms, V_SET(record->log2_opacity - log2_threshold + (R)1e-3));
        for (; left; left--) { /* one loop: its end is the only branch that is hard to foresee */
            unsigned touched = 0;
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                V x0 = V_ADD(V_LOAD(ssdgs__micro_x + v * SSDGS__VW), V_SET((R)(16 * tx) - record->x)),
                  x1 = V_ADD(x0, side);
                V y0 = V_ADD(V_LOAD(ssdgs__micro_y + v * SSDGS__VW), V_SET((R)(16 * ty) - record->y)),
                  y1 = V_ADD(y0, side);
                V near_x = V_MAX(x0, V_MIN(zero, x1)), near_y = V_MAX(y0, V_MIN(zero, y1));
                V on_x = V_MAX(x0, V_MIN(V_MUL(best_x, near_y), x1)),
                  on_y = V_MAX(y0, V_MIN(V_MUL(best_y, near_x), y1));
                V u = V_MIN(V_ABS(V_FMA(ux, near_x, V_MUL(uy, on_y))),
                            V_ABS(V_FMA(ux, on_x, V_MUL(uy, near_y))));
                V w = V_MUL(wy, on_y); /* where the second side has the least value, on_y is near_y */
                touched |= (unsigned)V_BITS(V_GE(most, V_FMA(u, u, V_MUL(w, w)))) << v * SSDGS__VW;
            }
            view->instance[at].place = (uint32_t)(ty * view->tiles_x + tx);
            view->instance[at].mask = touched;
            at += touched != 0;
            ty += tx == box[2];
            tx = tx == box[2] ? box[0] : tx + 1;
        }
        of->count = at - of->first;
    }
    return at;
}

/* ==== >>walk_kernels  eqs. 1, 6, 7 over the pixels of a 16x16 tile ==== */

/* The tile's list is taken in batches; in a batch each 4x4 micro-tile runs through the entries that touch
   it with its pixels in registers. Every walk finds alpha by the same operations in the same order, so all
   of them take the same decisions. */

typedef struct F(batch) {
    ssdgs_record record[SSDGS__BATCH];
    R distance[SSDGS__BATCH]; /* a light's walk: of the Gaussian, less the nearest one's; the camera's
                                 depth, where it matters */
    R slope[SSDGS__BATCH][2];
    uint32_t place[SSDGS__BATCH]; /* in the tile's lists */
    uint16_t mask[SSDGS__BATCH];
    uint64_t entries[16]; /* per micro-tile, which of the batch touch it */
} F(batch);

/* Turns the masks of count entries, micro-tiles per entry, into entries per micro-tile. */
SSDGS__FI void F(batch_transpose)(F(batch) * batch, int count) {
    for (int micro = 0; micro < 16; micro++) batch->entries[micro] = 0;
#if SSDGS__ISA == SSDGS__ISA_SSE2 || SSDGS__ISA == SSDGS__ISA_AVX2 || SSDGS__ISA == SSDGS__ISA_AVX512
    for (int i = count; i & 15; i++) batch->mask[i] = 0;
    for (int i = 0; i < count; i += 16) {
        const __m128i low = _mm_set1_epi16(255);
        const __m128i a = _mm_loadu_si128((const __m128i *)(const void *)(batch->mask + i));
        const __m128i b = _mm_loadu_si128((const __m128i *)(const void *)(batch->mask + i + 8));
        __m128i half[2];
        half[0] = _mm_packus_epi16(_mm_and_si128(a, low), _mm_and_si128(b, low));
        half[1] = _mm_packus_epi16(_mm_srli_epi16(a, 8), _mm_srli_epi16(b, 8));
        V_UNROLL for (int micro = 15; micro >= 0; micro--) { /* the top bits of sixteen bytes at a time */
            batch->entries[micro] |= (uint64_t)(unsigned)_mm_movemask_epi8(half[micro / 8]) << i;
            half[micro / 8] = _mm_add_epi8(half[micro / 8], half[micro / 8]);
        }
    }
#elif SSDGS__ISA == SSDGS__ISA_WASM
    for (int i = count; i & 15; i++) batch->mask[i] = 0;
    for (int i = 0; i < count; i += 16) {
        const v128_t a = wasm_v128_load(batch->mask + i), b = wasm_v128_load(batch->mask + i + 8);
        v128_t half[2];
        half[0] = wasm_i8x16_shuffle(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        half[1] = wasm_i8x16_shuffle(a, b, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        V_UNROLL for (int micro = 15; micro >= 0; micro--) {
            batch->entries[micro] |= (uint64_t)wasm_i8x16_bitmask(half[micro / 8]) << i;
            half[micro / 8] = wasm_i8x16_add(half[micro / 8], half[micro / 8]);
        }
    }
#else
    for (int i = 0; i < count; i++) {
        unsigned mask = batch->mask[i];
        for (; mask; mask &= mask - 1) batch->entries[ssdgs__lowest_bit(mask)] |= (uint64_t)1 << i;
    }
#endif
}

SSDGS__FI void F(batch_add)(F(batch) * batch, int index, const ssdgs__tile *tile, uint32_t place,
                            unsigned mask) {
    SSDGS_ASSERT(index < SSDGS__BATCH && place < tile->count);
    if (place + SSDGS__AHEAD < tile->count)
        SSDGS__PREFETCH(tile->record + tile->list[place + SSDGS__AHEAD].gaussian);
    batch->place[index] = place;
    batch->mask[index] = (uint16_t)mask;
    batch->record[index] = tile->record[tile->list[place].gaussian];
}

/* Gathers the list's next entries that touch anything from *from on; returns how many. */
SSDGS__FI int F(batch_gather)(F(batch) * batch, const ssdgs__tile *tile, uint32_t *from) {
    int n = 0;
    for (; n < SSDGS__BATCH && *from < tile->count; ++*from) {
        const unsigned mask = tile->seen ? tile->seen[*from] : tile->list[*from].mask;
        if (!mask) continue;
        if (tile->scene_depth || tile->median) {
            const size_t gaussian = tile->list[*from].gaussian;
            batch->distance[n] = tile->depth[gaussian];
            memcpy(batch->slope[n], tile->slope + 2 * gaussian, sizeof batch->slope[n]);
        }
        F(batch_add)(batch, n++, tile, *from, mask);
    }
    F(batch_transpose)(batch, n);
    return n;
}

/* alpha of one record at VW pixels, 0 where below the threshold; *drawn is that test. */
SSDGS__FI V F(alpha)(const ssdgs_record *record, V px, V py, V log2_threshold, V *u, V *w, V *raw,
                     VM *drawn) {
    const V dx = V_SUB(px, V_SET(record->x)), dy = V_SUB(py, V_SET(record->y));
    *u = V_FMA(V_SET(record->ux), dx, V_MUL(V_SET(record->uy), dy));
    *w = V_MUL(V_SET(record->wy), dy);
    const V p = V_FNMA(*u, *u, V_FNMA(*w, *w, V_SET(record->log2_opacity)));
    *drawn = V_GE(p, log2_threshold);
    *raw = F(exp2)(p);
    return V_SEL(*drawn, V_MIN(*raw, V_SET(SSDGS__ALPHA_MAX)), V_SET(0));
}

/* The mean depth of a Gaussian at VW pixels, above 0. */
SSDGS__FI V F(depth_at)(const F(batch) * batch, int index, V u, V w) {
    return V_MAX(V_SET((R)0.001 * batch->distance[index]),
                 V_FMA(V_SET(batch->slope[index][0]), u,
                       V_FMA(V_SET(batch->slope[index][1]), w, V_SET(batch->distance[index]))));
}

/* alpha, but 0 and not drawn where the entry is not nearer than scene_depth. */
SSDGS__FI V F(in_front)(const ssdgs__tile *tile, int micro, int v, V depth, V alpha, VM *drawn) {
    const VM nearer = V_LT(depth, V_LOAD(tile->scene_depth + micro * 16 + v * SSDGS__VW));
    *drawn = V_AND(*drawn, nearer);
    return V_SEL(nearer, alpha, V_SET(0));
}

/* Within a batch transmittance runs on below the stop: no select in the chain of products. Between batches
   -1 marks a pixel that has stopped. */
SSDGS__FI V F(unstopped)(V t, V stop) { return V_SEL(V_GE(t, stop), t, V_SET(-1)); }

SSDGS__FI void F(pixel_centres)(const ssdgs__tile *tile, int micro, V *px, V *py) {
    for (int v = 0; v < SSDGS__NV; v++) {
        px[v] = V_ADD(V_LOAD(ssdgs__lane_x + v * SSDGS__VW), V_SET(tile->x + 4 * (micro & 3)));
        py[v] = V_ADD(V_LOAD(ssdgs__lane_y + v * SSDGS__VW), V_SET(tile->y + 4 * (micro >> 2)));
    }
}

/* A walk's first transmittances: pixels outside the image can blend nothing. */
SSDGS__FI void F(start)(const ssdgs__tile *tile, R (*transmittance)[16]) {
    const V wide = V_SET(tile->width), high = V_SET(tile->height), one = V_SET(1), none = V_SET(-1);
    for (int micro = 0; micro < 16; micro++) {
        V px[SSDGS__NV], py[SSDGS__NV];
        F(pixel_centres)(tile, micro, px, py);
        for (int v = 0; v < SSDGS__NV; v++)
            V_STORE(transmittance[micro] + v * SSDGS__VW,
                    V_SEL(V_AND(V_LT(px[v], wide), V_LT(py[v], high)), one, none));
    }
}

/* Transmittance walk of the camera: per entry, the micro-tiles where a pixel blends it, and with max_error >
   0 whether it must be shaded. A pixel passes over small weights as long as their sum stays within max_error,
   so what no pixel needs adds up to no more than that in any. */
SSDGS__FN void F(walk_camera)(const ssdgs__tile *tile, uint16_t *blends, unsigned char *needed) {
    const int thrifty = needed != NULL;
    const V threshold = V_SET(tile->log2_threshold), stop = V_SET(tile->stop);
    const V budget = V_SET(tile->max_error), slight = V_SET(tile->max_error * SSDGS__SHARE);
    F(batch) batch;
    uint32_t from = 0;
    unsigned live = 0xFFFF;
    memset(blends, 0, tile->count * sizeof *blends);
    if (thrifty) memset(needed, 0, tile->count);
    R transmittance[16][16], passed_over[16][16];
    F(start)(tile, transmittance);
    memset(passed_over, 0, sizeof passed_over);
    while (from < tile->count && live) {
        F(batch_gather)(&batch, tile, &from);
        for (int micro = 0; micro < 16; micro++) {
            uint64_t left = live >> micro & 1u ? batch.entries[micro] : 0;
            int alive = 0;
            if (!left) continue;
            V px[SSDGS__NV], py[SSDGS__NV];
            F(pixel_centres)(tile, micro, px, py);
            V t[SSDGS__NV], over[SSDGS__NV];
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                t[v] = V_LOAD(transmittance[micro] + v * SSDGS__VW);
                over[v] = V_LOAD(passed_over[micro] + v * SSDGS__VW);
            }
            for (; left; left &= left - 1) {
                const int index = ssdgs__lowest_bit(left);
                const uint32_t place = batch.place[index];
                int any = 0, must = 0;
                V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                    V u, w, raw;
                    VM drawn;
                    V alpha = F(alpha)(batch.record + index, px[v], py[v], threshold, &u, &w, &raw, &drawn);
                    if (tile->scene_depth)
                        alpha = F(in_front)(tile, micro, v, F(depth_at)(&batch, index, u, w), alpha, &drawn);
                    const VM blended = V_AND(drawn, V_GE(t[v], stop));
                    any |= V_BITS(blended);
                    if (thrifty &&
                        !needed[place]) { /* what is needed uses no budget; past it all is needed */
                        const V blend = V_MUL(alpha, t[v]);
                        const VM light = V_GE(slight, blend);
                        over[v] = V_ADD(over[v], V_SEL(V_AND(light, blended), blend, V_SET(0)));
                        must |= V_BITS(blended) & ~V_BITS(V_AND(light, V_GE(budget, over[v])));
                    }
                    t[v] = V_FNMA(alpha, t[v], t[v]);
                }
                if (!any) {
                    V_UNROLL for (int v = 0; v < SSDGS__NV; v++) any |= V_BITS(V_GE(t[v], stop));
                    if (!any) break; /* all have stopped, for the rest of the batch too */
                    continue;
                }
                blends[place] = (uint16_t)(blends[place] | 1u << micro);
                if (thrifty) needed[place] = (unsigned char)(needed[place] | (must != 0));
            }
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                V_STORE(transmittance[micro] + v * SSDGS__VW, F(unstopped)(t[v], stop));
                V_STORE(passed_over[micro] + v * SSDGS__VW, over[v]);
                alive |= V_BITS(V_GE(t[v], stop));
            }
            if (!alive) live &= ~(1u << micro);
        }
    }
}

/* Which of a micro-tile's transmittances are below the level that each pixel waits for, as bits. */
SSDGS__FI unsigned F(below)(const R *transmittance, const R *next) {
    unsigned bits = 0;
    V_UNROLL for (int v = 0; v < SSDGS__NV; v++) bits |=
        (unsigned)V_BITS(V_LT(V_LOAD(transmittance + v * SSDGS__VW), V_LOAD(next + v * SSDGS__VW)))
        << v * SSDGS__VW;
    return bits;
}

/* Notes in the light's map where pixels of a micro-tile fall below levels. after: transmittances, row 0
   before any entry, row index + 1 after that entry. */
SSDGS__FI void F(light_map_note)(const ssdgs__tile *tile, int micro, uint64_t entries, R (*after)[16],
                                 const R *distance, R *next, unsigned char *level) {
    if (!F(below)(after[ssdgs__highest_bit(entries << 1)], next)) return; /* not after the last either */
    for (int before = 0; entries; entries &= entries - 1) {
        const int index = ssdgs__lowest_bit(entries);
        for (unsigned fell = F(below)(after[index + 1], next); fell; fell &= fell - 1) {
            const int lane = ssdgs__lowest_bit(fell);
            const R t = after[index + 1][lane];
            ssdgs_light_pixel *at = tile->light_map + 16 * micro + lane;
            int l = level[lane];
            for (; l < SSDGS__MAP_STEPS && t < ssdgs__map_level[l]; l++) {
                at->distance[l] = distance[index];
                if (l < SSDGS__MAP_STEPS - 1) at->left[l] = t;
                if (l) at->before[l - 1] = after[before][lane];
            }
            level[lane] = (unsigned char)l;
            next[lane] = l < SSDGS__MAP_STEPS ? ssdgs__map_level[l] : -1;
        }
        before = index + 1;
    }
}

/* Light walk, eqs. 6, 7, the depth cue and the flux if asked for: per entry, sums (n, 4) of rho v, rho, rho
   x cue, solid angle x blend weight. An entry is sampled once everything nearer than its distance - bias is
   in the transmittance, and takes part in it once its own distance is reached. So two cursors run along the
   list: `applying` multiplies entries into the transmittance and notes it after each; `sampling`, ahead of it
   by the bias, reads what was noted last before its own distance - bias.
   Micro-tiles whose pixels are all below the stop are dark: nothing is applied there any more. An entry all
   of whose micro-tiles are dark is not sampled either, unless its Gaussian lies in other tiles too. */
SSDGS__FN void F(walk_light)(const ssdgs__tile *tile, R *sums) {
    const V threshold = V_SET(tile->log2_threshold), one = V_SET(1);
    const int all = tile->flux || tile->light_map, cue = tile->cue, flux = tile->flux;
    V nothing[SSDGS__NV];
    uint32_t applying = 0, sampling = 0;
    unsigned lit = 0xFFFF; /* micro-tiles that are not dark */
    for (int v = 0; v < SSDGS__NV; v++) nothing[v] = V_SET(0);
    /* met: sum of blend weight x distance; next: level to fall below */
    R transmittance[16][16], met[16][16], next[16][16];
    for (int micro = 0; micro < 16; micro++)
        for (int v = 0; v < 16; v++) {
            transmittance[micro][v] = 1;
            met[micro][v] = 0;
            next[micro][v] = tile->light_map ? ssdgs__map_level[0] : -1;
        }
    unsigned char steps[16][16];
    memset(steps, 0, sizeof steps);
    F(batch) applied, sampled;
    while (sampling < tile->count || (all && applying < tile->count)) {
        uint64_t nearer[SSDGS__BATCH]; /* per entry to sample, those of the applied ahead of it */
        int samples = 0, applies = 0;
        while (sampling < tile->count || (all && applying < tile->count)) {
            const int sample =
                sampling < tile->count && tile->depth[tile->list[sampling].gaussian] - tile->bias <=
                                              tile->depth[tile->list[applying].gaussian];
            F(batch) *batch = sample ? &sampled : &applied;
            const uint32_t place = sample ? sampling : applying;
            const int n = sample ? samples : applies;
            if (n == (sample ? SSDGS__BATCH : SSDGS__BATCH - 1)) break;
            const uint32_t gaussian = tile->list[place].gaussian;
            const unsigned mask = tile->list[place].mask;
            int taken = (mask & lit) != 0;
            sampling += (uint32_t)sample;
            applying += (uint32_t)!sample;
            if (sample) {
                memset(sums + (size_t)place * 4, 0, 4 * sizeof(R));
                taken |= cue || !tile->of_gaussian || tile->of_gaussian[gaussian].count > 1;
                sums[(size_t)place * 4 + 1] = taken ? 0 : 1; /* else v is 0 */
            }
            if (!taken) continue;
            F(batch_add)(batch, n, tile, place, sample ? mask : mask & lit);
            batch->distance[n] = tile->depth[gaussian] - tile->depth_origin;
            if (sample) nearer[n] = ((uint64_t)1 << applies) - 1;
            samples += sample;
            applies += !sample;
        }
        F(batch_transpose)(&applied, applies);
        F(batch_transpose)(&sampled, samples);
        V lanes[SSDGS__BATCH][3][SSDGS__NV]; /* the sums before the lanes are added up */
        for (int i = 0; i < samples; i++)
            for (int v = 0; v < 3 * SSDGS__NV; v++) lanes[i][v / SSDGS__NV][v % SSDGS__NV] = V_SET(0);
        V energy[SSDGS__BATCH][SSDGS__NV];
        for (int i = 0; flux && i < applies; i++)
            for (int v = 0; v < SSDGS__NV; v++) energy[i][v] = V_SET(0);
        /* transmittance and met, before the first applied and after each; 63 at most */
        R history[2][SSDGS__BATCH][16];
        for (int micro = 0; micro < 16; micro++) {
            const uint64_t entries = applied.entries[micro];
            if (!(entries | sampled.entries[micro])) continue;
            V px[SSDGS__NV], py[SSDGS__NV];
            F(pixel_centres)(tile, micro, px, py);
            V t[SSDGS__NV], b[SSDGS__NV], omega[SSDGS__NV];
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                if (flux) {
                    V u = V_MUL(V_SUB(px[v], V_SET(tile->cx)), V_SET(tile->inverse_focal));
                    const V w = V_MUL(V_SUB(py[v], V_SET(tile->cy)), V_SET(tile->inverse_focal));
                    const V cosine2 = tile->orthographic ? one : V_DIV(one, V_FMA(u, u, V_FMA(w, w, one)));
                    omega[v] = V_MUL(V_MUL(cosine2, V_SQRT(cosine2)),
                                     V_SET(tile->inverse_focal * tile->inverse_focal));
                }
                t[v] = V_LOAD(transmittance[micro] + v * SSDGS__VW);
                V_STORE(history[0][0] + v * SSDGS__VW, t[v]);
                if (!cue) continue;
                b[v] = V_LOAD(met[micro] + v * SSDGS__VW);
                V_STORE(history[1][0] + v * SSDGS__VW, b[v]);
            }
            for (uint64_t left = entries; left; left &= left - 1) {
                const int index = ssdgs__lowest_bit(left);
                const V distance = V_SET(applied.distance[index]);
                V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                    const V before = t[v];
                    V u, w, raw;
                    VM drawn;
                    const V alpha =
                        F(alpha)(applied.record + index, px[v], py[v], threshold, &u, &w, &raw, &drawn);
                    t[v] = V_FNMA(alpha, before, before);
                    V_STORE(history[0][index + 1] + v * SSDGS__VW, t[v]);
                    if (flux) energy[index][v] = V_FMA(omega[v], V_MUL(alpha, before), energy[index][v]);
                    if (cue) {
                        b[v] = V_FMA(V_MUL(alpha, before), distance, b[v]);
                        V_STORE(history[1][index + 1] + v * SSDGS__VW, b[v]);
                    }
                }
            }
            F(light_map_note)(tile, micro, entries, history[0], applied.distance, next[micro], steps[micro]);
            for (uint64_t left = sampled.entries[micro]; left; left &= left - 1) {
                const int index = ssdgs__lowest_bit(left),
                          then = ssdgs__highest_bit((entries & nearer[index]) << 1);
                const V distance = V_SET(sampled.distance[index]);
                V(*sum)[SSDGS__NV] = lanes[index];
                V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                    const V past = V_LOAD(history[0][then] + v * SSDGS__VW);
                    V u, w, raw;
                    VM drawn;
                    (void)F(alpha)(sampled.record + index, px[v], py[v], threshold, &u, &w, &raw, &drawn);
                    raw = V_SEL(drawn, raw, V_SET(0)); /* opacity x rho; in the ratio the opacity cancels */
                    sum[0][v] = V_FMA(raw, past, sum[0][v]);
                    sum[1][v] = V_ADD(sum[1][v], raw);
                    if (cue)
                        sum[2][v] = V_FMA(
                            raw,
                            V_FNMA(distance, past, V_SUB(distance, V_LOAD(history[1][then] + v * SSDGS__VW))),
                            sum[2][v]);
                }
            }
            int alive = 0;
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                V_STORE(transmittance[micro] + v * SSDGS__VW,
                        V_MAX(t[v], V_SET(1e-20))); /* few subnormals deep inside */
                if (cue) V_STORE(met[micro] + v * SSDGS__VW, b[v]);
                alive |= V_BITS(V_GE(t[v], V_SET(tile->stop)));
            }
            if (!alive) lit &= ~(1u << micro);
        }
        for (int i = 0; i < samples; i++)
            F(sum4)(sums + (size_t)sampled.place[i] * 4, lanes[i][0], lanes[i][1], lanes[i][2], nothing);
        for (int i = 0; flux && i < applies; i++) sums[(size_t)applied.place[i] * 4 + 3] += F(sum)(energy[i]);
    }
    if (tile->light_map) ssdgs__light_map_end(tile, steps[0], transmittance[0]);
}

/* ==== >>map_kernels  where pixels are, and what a light's map leaves of light there ==== */

/* Where a micro-tile's pixels are in the world, rows of x, y and z, by their depth layer, and the camera's
   rays (x, y, 1) through them, rows of x and y. Where asked is not below 0 they stand at the eye. */
SSDGS__FN void F(places)(const ssdgs__lighting *k, const ssdgs__tile *tile, int micro, const R *depth,
                         const R *asked, R *ray, R *at) {
    V px[SSDGS__NV], py[SSDGS__NV];
    F(pixel_centres)(tile, micro, px, py);
    for (int v = 0; v < SSDGS__NV; v++) {
        const int lane = v * SSDGS__VW;
        const V z = V_DIV(V_LOAD(depth + lane), V_LOAD(depth + 32 + lane));
        const V depth_asked = V_SEL(V_LT(V_LOAD(asked + lane), V_SET(0)), z, V_SET(0));
        const V x = V_MUL(V_SUB(px[v], V_SET(k->cx)), V_SET(k->inverse_fx));
        const V y = V_MUL(V_SUB(py[v], V_SET(k->cy)), V_SET(k->inverse_fy));
        V_STORE(ray + lane, x);
        V_STORE(ray + 16 + lane, y);
        for (int c = 0; c < 3; c++) {
            const V xy = V_ADD(V_MUL(V_SET(k->view[c]), x), V_MUL(V_SET(k->view[4 + c]), y));
            const V along = V_MUL(depth_asked, V_ADD(xy, V_SET(k->view[8 + c])));
            V_STORE(at + 16 * c + lane, V_ADD(V_SET(k->eye[c]), along));
        }
    }
}

/* Transmittance at distances from the light, by pixels of its map, columns of ssdgs_light_pixel. After a fall
   it stays at what that left, until `thick` ahead of the next fall, then goes linearly to what there was
   before that one. steep: its derivative by the distance, or NULL. */
SSDGS__FI V F(pixel_transmittance)(R (*pixel)[SSDGS__VW], V distance, V thick, V *steep) {
    const V zero = V_SET(0), first = V_LOAD(pixel[0]), second = V_LOAD(pixel[1]), third = V_LOAD(pixel[2]);
    const VM past = V_LT(second, distance); /* the second fall */
    const V left = V_SEL(past, V_LOAD(pixel[4]), V_LOAD(pixel[3]));
    const V rise = V_SUB(V_SEL(past, V_LOAD(pixel[6]), V_LOAD(pixel[5])), left);
    const V last = V_SEL(past, second, first), next = V_SEL(past, third, second);
    const V begin = V_MAX(V_SUB(next, thick), last), length = V_SUB(next, begin);
    const VM none = V_GE(first, distance), all = V_LT(third, distance), rises = V_LT(begin, distance);
    const V between = V_ADD(left, V_DIV(V_MUL(rise, V_SUB(distance, begin)), length));
    if (steep) *steep = V_SEL(none, zero, V_SEL(all, zero, V_SEL(rises, V_DIV(rise, length), zero)));
    return V_SEL(none, V_SET(1), V_SEL(all, V_LOAD(pixel[7]), V_SEL(rises, between, left)));
}

/* Transmittance from a light to sixteen places in the world, rows of x, y and z, between four pixels of a
   map: passed, where it is -1 and the map has the place. Returns whether any is left at -1. slope: rows of
   its gradient by the place, or NULL. */
SSDGS__FN int F(map_transmittance)(const ssdgs_splat_view *map, R bias, const R *at, R *passed, R *slope) {
    static const ssdgs_light_pixel open = {{SSDGS__NEVER, SSDGS__NEVER, SSDGS__NEVER}, {0, 0}, {0, 0}, 0};
    const V zero = V_SET(0), one = V_SET(1), half = V_SET(0.5), tiny = V_SET(1e-6), thick = V_SET(bias);
    const V wide = V_SET(map->width - 1), high = V_SET(map->height - 1);
    const R *m = map->view;
    int unknown = 0;
    for (int lane = 0; lane < 16; lane += SSDGS__VW) {
        const V before = V_LOAD(passed + lane);
        V t[3];
        for (int i = 0; i < 3; i++) {
            const V x = V_MUL(V_SET(m[4 * i]), V_LOAD(at + lane));
            const V y = V_MUL(V_SET(m[4 * i + 1]), V_LOAD(at + 16 + lane));
            const V z = V_MUL(V_SET(m[4 * i + 2]), V_LOAD(at + 32 + lane));
            t[i] = V_ADD(V_ADD(V_ADD(x, y), z), V_SET(m[4 * i + 3]));
        }
        const V inverse_z = map->orthographic ? one : V_DIV(one, t[2]);
        V u = V_SUB(V_ADD(V_MUL(V_MUL(V_SET(map->fx), t[0]), inverse_z), V_SET(map->cx)), half);
        V w = V_SUB(V_ADD(V_MUL(V_MUL(V_SET(map->fy), t[1]), inverse_z), V_SET(map->cy)), half);
        const VM inside = V_AND(V_AND(V_AND(V_GE(u, V_NEG(half)), V_GE(V_ADD(wide, half), u)),
                                      V_AND(V_GE(w, V_NEG(half)), V_GE(V_ADD(high, half), w))),
                                V_AND(V_LT(V_SET(map->near_plane), t[2]), V_LT(before, zero)));
        const V xx_yy = V_ADD(V_MUL(t[0], t[0]), V_MUL(t[1], t[1]));
        const V far_off = map->by_distance ? V_SQRT(V_ADD(xx_yy, V_MUL(t[2], t[2]))) : t[2];
        const V distance = V_SUB(far_off, V_ADD(V_ADD(thick, V_MUL(tiny, far_off)), V_SET(map->nearest)));
        if (!V_BITS(inside)) {
            unknown |= V_BITS(V_LT(before, zero));
            continue;
        }
        u = V_MIN(V_MAX(u, zero), wide);
        w = V_MIN(V_MAX(w, zero), high);
        const VM moves_u = V_AND(V_LT(zero, u), V_LT(u, wide)), moves_w = V_AND(V_LT(zero, w), V_LT(w, high));
        const V left = V_MIN(F(floor)(u), V_SUB(wide, one)), top = V_MIN(F(floor)(w), V_SUB(high, one));
        R corner_x[SSDGS__VW], corner_y[SSDGS__VW];
        uint32_t tile_x[2][SSDGS__VW], tile_y[2][SSDGS__VW], in_x[2][SSDGS__VW], in_y[2][SSDGS__VW];
        V_STORE(corner_x, left);
        V_STORE(corner_y, top);
        for (int j = 0; j < 2; j++)
            for (int i = 0; i < SSDGS__VW; i++) {
                const uint32_t x = (uint32_t)((int)corner_x[i] + j), y = (uint32_t)((int)corner_y[i] + j);
                tile_x[j][i] = x >> 4;
                tile_y[j][i] = (y >> 4) * (uint32_t)map->tiles_x;
                in_x[j][i] = (x & 12) << 2 | (x & 3);
                in_y[j][i] = (y & 12) << 4 | (y & 3) << 2;
            }
        u = V_SUB(u, left);
        w = V_SUB(w, top);
        V found[4], steep[4];
        for (int corner = 0; corner < 4; corner++) {
            const ssdgs_light_pixel *pixel[SSDGS__VW];
            R column[8][SSDGS__VW];
            for (int i = 0; i < SSDGS__VW; i++) {
                const uint32_t tile = map->map_tile[tile_y[corner >> 1][i] + tile_x[corner & 1][i]];
                const uint32_t of_tile = in_y[corner >> 1][i] + in_x[corner & 1][i];
                pixel[i] = tile == UINT32_MAX ? &open : map->light_map + (size_t)tile * 256 + of_tile;
                column[0][i] = pixel[i]->distance[0];
            }
            if (!V_BITS(V_LT(V_LOAD(column[0]), distance))) { /* nothing is ahead */
                found[corner] = one;
                steep[corner] = zero;
                continue;
            }
            F(columns8)(pixel, column);
            found[corner] = F(pixel_transmittance)(column, distance, thick, slope ? steep + corner : NULL);
        }
        const V not_u = V_SUB(one, u), not_w = V_SUB(one, w);
        const V upper = V_ADD(V_MUL(not_u, found[0]), V_MUL(u, found[1]));
        const V lower = V_ADD(V_MUL(not_u, found[2]), V_MUL(u, found[3]));
        const V all = V_SEL(inside, V_ADD(V_MUL(not_w, upper), V_MUL(w, lower)), before);
        V_STORE(passed + lane, all);
        unknown |= V_BITS(V_LT(all, zero));
        if (!slope) continue;
        V du = V_ADD(V_MUL(not_w, V_SUB(found[1], found[0])), V_MUL(w, V_SUB(found[3], found[2])));
        V dw = V_SUB(lower, upper);
        du = V_SEL(moves_u, V_MUL(V_MUL(du, V_SET(map->fx)), inverse_z), zero);
        dw = V_SEL(moves_w, V_MUL(V_MUL(dw, V_SET(map->fy)), inverse_z), zero);
        const V upper_steep = V_ADD(V_MUL(not_u, steep[0]), V_MUL(u, steep[1]));
        const V lower_steep = V_ADD(V_MUL(not_u, steep[2]), V_MUL(u, steep[3]));
        const V steepness = V_MUL(V_ADD(V_MUL(not_w, upper_steep), V_MUL(w, lower_steep)), V_SUB(one, tiny));
        V dt[3] = {du, dw, zero};
        if (!map->orthographic) dt[2] = V_MUL(V_NEG(V_ADD(V_MUL(du, t[0]), V_MUL(dw, t[1]))), inverse_z);
        for (int i = 0; i < 3; i++)
            dt[i] = V_ADD(dt[i], map->by_distance ? V_DIV(V_MUL(steepness, t[i]), far_off)
                                 : i == 2         ? steepness
                                                  : zero);
        for (int i = 0; i < 3; i++) {
            const V x = V_MUL(V_SET(m[i]), dt[0]), y = V_MUL(V_SET(m[4 + i]), dt[1]);
            const V along = V_ADD(V_ADD(x, y), V_MUL(V_SET(m[8 + i]), dt[2]));
            V_STORE(slope + 16 * i + lane, V_SEL(inside, along, V_LOAD(slope + 16 * i + lane)));
        }
    }
    return unknown;
}

/* ==== >>composite_kernel  eq. 1: layers of color (n, 4) of Gaussians -> the tile's pixels ==== */

/* pixels: [layer][micro-tile][3 colours, transmittance in the first layer][16 lanes]. */
SSDGS__FI void F(composite_layers)(const int layers, const ssdgs__tile *tile, const R *const *color,
                                   R *pixels) {
    const V threshold = V_SET(tile->log2_threshold), stop = V_SET(tile->stop);
    F(batch) batch;
    uint32_t from = 0;
    const int at_once = SSDGS__NV == 1 ? layers : 1; /* as many sums as there are registers */
    memset(pixels, 0, (size_t)layers * SSDGS__TILE_LAYER * sizeof *pixels);
    R transmittance[16][16];
    F(start)(tile, transmittance);
    for (int micro = 0; micro < 16; micro++)
        for (int v = 0; v < 16; v++) pixels[micro * 64 + SSDGS__TILE_FOURTH + v] = 1;
    R local[SSDGS__LAYERS][SSDGS__BATCH][4], weight[SSDGS__BATCH][16];
    int which[SSDGS__BATCH];
    while (from < tile->count) {
        int n = F(batch_gather)(&batch, tile, &from);
        uint64_t ours = tile->material_of ? 0 : ~(uint64_t)0; /* what leaves a colour: others only darken */
        for (int i = 0; tile->material_of && i < n; i++)
            ours |= (uint64_t)(tile->material_of[tile->list[batch.place[i]].gaussian / SSDGS__BLOCK] ==
                               tile->material)
                    << i;
        for (int layer = 0; layer < layers; layer++)
            for (int i = 0; i < n; i++)
                memcpy(local[layer][i], color[layer] + (size_t)tile->list[batch.place[i]].gaussian * 4,
                       4 * sizeof(R));
        for (int micro = 0; micro < 16; micro++) {
            uint64_t left = batch.entries[micro];
            R *pixel = pixels + micro * 64;
            if (!left) continue;
            V px[SSDGS__NV], py[SSDGS__NV];
            F(pixel_centres)(tile, micro, px, py);
            V t[SSDGS__NV], last[SSDGS__NV];
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                last[v] = V_LOAD(pixel + SSDGS__TILE_FOURTH + v * SSDGS__VW);
                t[v] = V_LOAD(transmittance[micro] + v * SSDGS__VW);
            }
            int used = 0;
            for (; left; left &= left - 1) {
                const int index = which[used] = ssdgs__lowest_bit(left);
                V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                    V u, w, raw;
                    VM drawn, live = V_GE(t[v], stop);
                    V alpha = F(alpha)(batch.record + index, px[v], py[v], threshold, &u, &w, &raw, &drawn);
                    if (tile->scene_depth)
                        alpha = F(in_front)(tile, micro, v, F(depth_at)(&batch, index, u, w), alpha, &drawn);
                    V_STORE(weight[used] + v * SSDGS__VW, V_SEL(live, V_MUL(alpha, t[v]), V_SET(0)));
                    const V before = t[v];
                    t[v] = V_FNMA(alpha, t[v], t[v]);
                    last[v] = V_SEL(live, t[v], last[v]);
                    if (tile->median) {
                        R *to = tile->median + micro * 64 + v * SSDGS__VW;
                        const VM fell = V_AND(V_AND(live, V_GE(before, V_SET(0.5))), V_LT(t[v], V_SET(0.5)));
                        V_STORE(to, V_SEL(fell, F(depth_at)(&batch, index, u, w), V_LOAD(to)));
                    }
                }
                used += (int)(ours >> index & 1);
            }
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                V_STORE(pixel + SSDGS__TILE_FOURTH + v * SSDGS__VW, last[v]);
                V_STORE(transmittance[micro] + v * SSDGS__VW, F(unstopped)(t[v], stop));
            }
            for (int layer = 0; layer < layers; layer += at_once, pixel += at_once * SSDGS__TILE_LAYER) {
                V c[SSDGS__LAYERS][3][SSDGS__NV];
                V_UNROLL for (int l = 0; l < at_once; l++) V_UNROLL for (int v = 0; v < SSDGS__NV; v++)
                    V_UNROLL for (int i = 0; i < 3; i++) c[l][i][v] =
                        V_LOAD(pixel + l * SSDGS__TILE_LAYER + 16 * i + v * SSDGS__VW);
                for (n = 0; n < used; n++) V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                        const V w = V_LOAD(weight[n] + v * SSDGS__VW);
                        V_UNROLL for (int l = 0; l < at_once; l++) V_UNROLL for (int i = 0; i < 3; i++)
                            c[l][i][v] = V_FMA(w, V_SET(local[layer + l][which[n]][i]), c[l][i][v]);
                    }
                V_UNROLL for (int l = 0; l < at_once; l++) V_UNROLL for (int v = 0; v < SSDGS__NV; v++)
                    V_UNROLL for (int i = 0; i < 3; i++)
                        V_STORE(pixel + l * SSDGS__TILE_LAYER + 16 * i + v * SSDGS__VW, c[l][i][v]);
            }
        }
    }
}

SSDGS__FN void F(composite)(const ssdgs__tile *tile, int layers, const R *const *color, R *pixels) {
#if SSDGS__NV > 1
    F(composite_layers)(layers, tile, color, pixels);
#else /* sums in registers: their number is a constant */
    if (layers == 1) F(composite_layers)(1, tile, color, pixels);
    else if (layers == SSDGS__PER_LIGHT) F(composite_layers)(SSDGS__PER_LIGHT, tile, color, pixels);
    else F(composite_layers)(SSDGS__LAYERS, tile, color, pixels);
#endif
}

/* gradient: [layer][micro-tile][3 colours, in the first layer the gradients' product with the pixel][16
   lanes]; scratch: room for as many, used with all layers. Per entry adds to sums (n, stride), g = dL/d(ln
   alpha): g, g u, g w, g u^2, g u w, g w^2, the blend weight b (slot 0 only), 0; from 8 + 4 slot on, b dC
   of each layer: three values, one unused. layers: all, or 1. Walks front to back again: what lies behind
   an entry is the final pixel less what has been passed, so alpha and T are the forward's, bit for bit. */
SSDGS__FI void F(composite_layers_backward)(const int layers, const ssdgs__tile *tile, const R *const *color,
                                            const R *gradient, R *scratch, R *sums, size_t stride, int slot) {
    const V threshold = V_SET(tile->log2_threshold), stop = V_SET(tile->stop), one = V_SET(1),
            zero = V_SET(0);
    /* with all layers sums over pixels have lanes over their values */
    const int wide = layers == SSDGS__LAYERS, width = 4 * layers;
    F(batch) batch;
    uint32_t from = 0;
    for (int micro = 0; wide && micro < 16; micro++)
        for (int layer = 0; layer < layers; layer++)
            for (int i = 0; i < 16; i += 4) {
                const R *rows = gradient + layer * SSDGS__TILE_LAYER + micro * 64 + i;
                F(transpose4)(rows, 16, scratch + (micro * 16 + i) * width + 4 * layer, (size_t)width);
            }
    R passed[16][16], transmittance[16][16];
    F(start)(tile, transmittance);
    memset(passed, 0, sizeof passed);
    R local[SSDGS__LAYERS][SSDGS__BATCH][4], weight[SSDGS__BATCH][16];
    int which[SSDGS__BATCH];
    while (from < tile->count) {
        int n = F(batch_gather)(&batch, tile, &from);
        for (int layer = 0; layer < layers; layer++)
            for (int i = 0; i < n; i++)
                memcpy(local[layer][i], color[layer] + (size_t)tile->list[batch.place[i]].gaussian * 4,
                       4 * sizeof(R));
        for (int micro = 0; micro < 16; micro++) {
            uint64_t left = batch.entries[micro];
            const R *pixel = gradient + micro * 64, *rows = scratch + micro * 16 * width;
            if (!left) continue;
            V px[SSDGS__NV], py[SSDGS__NV];
            F(pixel_centres)(tile, micro, px, py);
            V dc[SSDGS__LAYERS][3][SSDGS__NV], product[SSDGS__NV], t[SSDGS__NV], before[SSDGS__NV];
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                V_UNROLL for (int layer = 0; layer < layers; layer++) V_UNROLL for (int i = 0; i < 3; i++)
                    dc[layer][i][v] = V_LOAD(pixel + layer * SSDGS__TILE_LAYER + 16 * i + v * SSDGS__VW);
                product[v] = V_LOAD(pixel + SSDGS__TILE_FOURTH + v * SSDGS__VW);
                t[v] = V_LOAD(transmittance[micro] + v * SSDGS__VW);
                before[v] = V_LOAD(passed[micro] + v * SSDGS__VW);
            }
            int used;
            for (used = 0; left; left &= left - 1, used++) {
                const int index = which[used] = ssdgs__lowest_bit(left);
                R *out = sums + (size_t)batch.place[index] * stride;
                V sum[12][SSDGS__NV];
                V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                    V u, w, raw, before_it = t[v];
                    VM drawn;
                    V alpha = F(alpha)(batch.record + index, px[v], py[v], threshold, &u, &w, &raw, &drawn);
                    t[v] = V_FNMA(alpha, t[v], t[v]);
                    alpha = V_SEL(V_GE(before_it, stop), alpha, zero);
                    const V blend = V_MUL(alpha, before_it);
                    V part[4];
                    part[0] = part[1] = part[2] = part[3] =
                        zero; /* one chain of sums would be what all waits for */
                    V_UNROLL for (int layer = 0; layer < layers; layer++) V_UNROLL for (int i = 0; i < 3; i++)
                        part[layer & 3] =
                            V_FMA(V_SET(local[layer][index][i]), dc[layer][i][v], part[layer & 3]);
                    const V shade = V_ADD(V_ADD(part[0], part[1]), V_ADD(part[2], part[3]));
                    before[v] = V_FMA(blend, shade, before[v]);
                    const V behind = V_DIV(V_SUB(product[v], before[v]), V_SUB(one, alpha));
                    V g = V_MUL(alpha, V_FMA(before_it, shade, V_NEG(behind)));
                    g = V_SEL(V_LT(raw, V_SET(SSDGS__ALPHA_MAX)), g, zero); /* alpha = min(0.999, .) */
                    const V gu = V_MUL(g, u);
                    const V gw = V_MUL(g, w);
                    sum[0][v] = g;
                    sum[1][v] = gu;
                    sum[2][v] = gw;
                    sum[3][v] = V_MUL(gu, u);
                    sum[4][v] = V_MUL(gu, w);
                    sum[5][v] = V_MUL(gw, w);
                    sum[6][v] = slot ? zero : blend;
                    sum[7][v] = zero;
                    if (wide) {
                        V_STORE(weight[used] + v * SSDGS__VW, blend);
                    } else {
                        V_UNROLL for (int i = 0; i < 3; i++) sum[8 + i][v] = V_MUL(blend, dc[0][i][v]);
                        sum[11][v] = zero;
                    }
                }
                F(sum4)(out, sum[0], sum[1], sum[2], sum[3]);
                F(sum4)(out + 4, sum[4], sum[5], sum[6], sum[7]);
                if (!wide) F(sum4)(out + 8 + 4 * slot, sum[8], sum[9], sum[10], sum[11]);
            }
            for (n = 0; wide && n < used; n++) {
                R *out = sums + (size_t)batch.place[which[n]] * stride + 8;
                V sum[4 * SSDGS__LAYERS / SSDGS__VW];
                V_UNROLL for (int v = 0; v < width / SSDGS__VW; v++) sum[v] = zero;
                for (int i = 0; i < 16; i++) {
                    const V w = V_SET(weight[n][i]);
                    V_UNROLL for (int v = 0; v < width / SSDGS__VW; v++) sum[v] =
                        V_FMA(w, V_LOAD(rows + i * width + v * SSDGS__VW), sum[v]);
                }
                V_UNROLL for (int v = 0; v < width / SSDGS__VW; v++) V_STORE_ADD(out + v * SSDGS__VW, sum[v]);
            }
            V_UNROLL for (int v = 0; v < SSDGS__NV; v++) {
                V_STORE(transmittance[micro] + v * SSDGS__VW, F(unstopped)(t[v], stop));
                V_STORE(passed[micro] + v * SSDGS__VW, before[v]);
            }
        }
    }
}

SSDGS__FN void F(composite_backward)(const ssdgs__tile *tile, int layers, const R *const *color,
                                     const R *gradient, R *scratch, R *sums, size_t stride, int slot) {
    if (layers == 1) F(composite_layers_backward)(1, tile, color, gradient, scratch, sums, stride, slot);
    else F(composite_layers_backward)(SSDGS__LAYERS, tile, color, gradient, scratch, sums, stride, slot);
}

/* ==== >>transport_kernel  light that comes through the object ==== */

/* sources (count, 4): x, y, z, flux; x (3, BLOCK), of which 16 lanes; scale: soft^2, -log2(e) / longest
   length. Adds flux exp(-r / l_k) / r to sums (SSDGS__LENGTHS, BLOCK), r = sqrt(distance^2 + soft^2): one
   exponential for the longest l, its squares for the others. */
SSDGS__FN void F(transport)(const R *sources, int count, const R *x, const R *scale, R *sums) {
    for (int s = 0; s < 16; s += SSDGS__VW) {
        const V px = V_LOAD(x + s), py = V_LOAD(x + SSDGS__BLOCK + s), pz = V_LOAD(x + 2 * SSDGS__BLOCK + s);
        const V soft = V_SET(scale[0]), longest = V_SET(scale[1]);
        V sum[SSDGS__LENGTHS];
        V_UNROLL for (int k = 0; k < SSDGS__LENGTHS; k++) sum[k] = V_LOAD(sums + k * SSDGS__BLOCK + s);
        for (int i = 0; i < count; i++) {
            const R *source = sources + 4 * i;
            const V dx = V_SUB(px, V_SET(source[0])), dy = V_SUB(py, V_SET(source[1])),
                    dz = V_SUB(pz, V_SET(source[2]));
            const V r = V_SQRT(V_FMA(dx, dx, V_FMA(dy, dy, V_FMA(dz, dz, soft)))),
                    weight = V_DIV(V_SET(source[3]), r);
            V e = F(exp2)(V_MUL(r, longest));
            V_UNROLL for (int k = SSDGS__LENGTHS - 1; k >= 0; k--) {
                sum[k] = V_FMA(weight, e, sum[k]);
                e = V_MUL(e, e);
            }
        }
        V_UNROLL for (int k = 0; k < SSDGS__LENGTHS; k++) V_STORE(sums + k * SSDGS__BLOCK + s, sum[k]);
    }
}

/* sources (5, SSDGS__SOURCES): x, y, z, flux, mean square radius; count of them, a multiple of 16. Adds their
   light around middle, to second order, to series (SSDGS__LENGTHS, SSDGS__SERIES). With u the direction from
   a source, p = exp(-r / l) / r and a = 1 / l + 1 / r, the slope of p is -a p u and its second derivatives
   are (a^2 p + (a p + p / r) / r) u u' - a p / r. The light of a ball is a point's times 1 + radius^2 / (6
   l^2), as p solves l^2 laplace(p) = p. */
SSDGS__FN void F(expand)(const R *sources, int count, const R *middle, const R *scale, R *series) {
    R ux[SSDGS__SOURCES], uy[SSDGS__SOURCES], uz[SSDGS__SOURCES], by_r[SSDGS__SOURCES],
        weight[SSDGS__SOURCES], decay[SSDGS__SOURCES], lanes[SSDGS__SERIES][16];
    R by_l = (R)-0.6931471805599453 * scale[1];
    for (int i = 0; i < count; i += SSDGS__VW) {
        const V dx = V_SUB(V_SET(middle[0]), V_LOAD(sources + i)),
                dy = V_SUB(V_SET(middle[1]), V_LOAD(sources + SSDGS__SOURCES + i)),
                dz = V_SUB(V_SET(middle[2]), V_LOAD(sources + 2 * SSDGS__SOURCES + i));
        const V r = V_SQRT(V_FMA(dx, dx, V_FMA(dy, dy, V_FMA(dz, dz, V_SET(scale[0]))))),
                inverse = V_DIV(V_SET(1), r);
        V_STORE(ux + i, V_MUL(dx, inverse));
        V_STORE(uy + i, V_MUL(dy, inverse));
        V_STORE(uz + i, V_MUL(dz, inverse));
        V_STORE(by_r + i, inverse);
        V_STORE(weight + i, V_MUL(V_LOAD(sources + 3 * SSDGS__SOURCES + i), inverse));
        V_STORE(decay + i, F(exp2)(V_MUL(r, V_SET(scale[1]))));
    }
    for (int k = SSDGS__LENGTHS - 1; k >= 0; k--, by_l += by_l) {
        const V ball = V_SET(by_l * by_l * (R)(1.0 / 6));
        for (int s = 0; s < 16; s += SSDGS__VW) {
            V sum[SSDGS__SERIES], round = V_SET(0);
            V_UNROLL for (int j = 0; j < SSDGS__SERIES; j++) sum[j] = V_SET(0);
            for (int i = s; i < count; i += 16) {
                const V x = V_LOAD(ux + i), y = V_LOAD(uy + i), z = V_LOAD(uz + i),
                        inverse = V_LOAD(by_r + i);
                const V e = V_LOAD(decay + i),
                        more = V_FMA(V_LOAD(sources + 4 * SSDGS__SOURCES + i), ball, V_SET(1)),
                        p = V_MUL(V_MUL(V_LOAD(weight + i), more), e), a = V_ADD(inverse, V_SET(by_l)),
                        ap = V_MUL(a, p), b = V_FMA(a, ap, V_MUL(inverse, V_FMA(inverse, p, ap)));
                const V bx = V_MUL(b, x), by = V_MUL(b, y), bz = V_MUL(b, z);
                V_STORE(decay + i, V_MUL(e, e));
                sum[0] = V_ADD(sum[0], p);
                sum[1] = V_FNMA(ap, x, sum[1]);
                sum[2] = V_FNMA(ap, y, sum[2]);
                sum[3] = V_FNMA(ap, z, sum[3]);
                sum[4] = V_FMA(bx, x, sum[4]);
                sum[5] = V_FMA(bx, y, sum[5]);
                sum[6] = V_FMA(bx, z, sum[6]);
                sum[7] = V_FMA(by, y, sum[7]);
                sum[8] = V_FMA(by, z, sum[8]);
                sum[9] = V_FMA(bz, z, sum[9]);
                round = V_FMA(ap, inverse, round);
            }
            sum[4] = V_MUL(V_SET((R)0.5), V_SUB(sum[4], round));
            sum[7] = V_MUL(V_SET((R)0.5), V_SUB(sum[7], round));
            sum[9] = V_MUL(V_SET((R)0.5), V_SUB(sum[9], round));
            V_UNROLL for (int j = 0; j < SSDGS__SERIES; j++) V_STORE(lanes[j] + s, sum[j]);
        }
        for (int j = 0; j < SSDGS__SERIES; j++)
            for (int s = 0; s < 16; s++) series[k * SSDGS__SERIES + j] += lanes[j][s];
    }
}

/* Adds a series' values at x (3, BLOCK), of which so many lanes, to sums (SSDGS__LENGTHS, BLOCK). */
SSDGS__FN void F(series)(const R *series, const R *middle, const R *x, int lanes, R *sums) {
    for (int s = 0; s < lanes; s += SSDGS__VW) {
        const V dx = V_SUB(V_LOAD(x + s), V_SET(middle[0])),
                dy = V_SUB(V_LOAD(x + SSDGS__BLOCK + s), V_SET(middle[1])),
                dz = V_SUB(V_LOAD(x + 2 * SSDGS__BLOCK + s), V_SET(middle[2]));
        for (int k = 0; k < SSDGS__LENGTHS; k++) {
            const R *of = series + k * SSDGS__SERIES;
            const V x1 = V_FMA(dz, V_SET(of[6]),
                               V_FMA(dy, V_SET(of[5]), V_FMA(dx, V_SET(of[4]), V_SET(of[1])))),
                    y1 = V_FMA(dz, V_SET(of[8]), V_FMA(dy, V_SET(of[7]), V_SET(of[2]))),
                    z1 = V_FMA(dz, V_SET(of[9]), V_SET(of[3]));
            const V value = V_FMA(dx, x1, V_FMA(dy, y1, V_FMA(dz, z1, V_SET(of[0]))));
            V_STORE_ADD(sums + k * SSDGS__BLOCK + s, value);
        }
    }
}

/* ==== >>dense_kernel  all three matrix products of a linear layer ==== */

/* out (rows, columns) = a (rows, depth) b (depth, columns) [+ bias per row] [+ out] [ReLU] for the rows
   and the depths listed; a is read as a[row * a_row + k * a_k], so W, its transpose and the gradient of
   the outputs all serve without a copy; lanes run over the columns, a multiple of 16. Tiles of SSDGS__TR
   rows x SSDGS__TV vectors stay in registers. */
SSDGS__FI void F(dense_tile)(const int rows, const ssdgs__product *p, const ssdgs__offsets *depth,
                             const int vectors, const uint16_t *row, int column) {
    V sum[6][SSDGS__TV];
    const R *a[6], *columns = p->b + column;
    const ssdgs__offsets *const end = depth + p->depth;
    V_UNROLL for (int i = 0; i < rows; i++) {
        a[i] = p->a + (size_t)row[i] * p->a_row;
        const R *start = p->start ? p->start + (size_t)row[i] * p->out_stride + column : NULL;
        V_UNROLL for (int v = 0; v < vectors; v++) sum[i][v] = start     ? V_LOAD(start + v * SSDGS__VW)
                                                               : p->bias ? V_SET(p->bias[row[i]])
                                                                         : V_SET(0);
    }
    for (; depth < end; depth++) {
        const size_t at = depth->a;
        const R *b = columns + depth->b;
        V lanes[SSDGS__TV];
        V_UNROLL for (int v = 0; v < vectors; v++) lanes[v] = V_LOAD(b + v * SSDGS__VW);
        V_UNROLL for (int i = 0; i < rows; i++) {
            const V weight = V_SET(a[i][at]);
            V_UNROLL for (int v = 0; v < vectors; v++) sum[i][v] = V_FMA(weight, lanes[v], sum[i][v]);
        }
    }
    size_t out[6];
    V_UNROLL for (int i = 0; i < rows; i++) out[i] = (size_t)row[i] * p->out_stride + (size_t)column;
    if (p->accumulate) {
        V_UNROLL for (int i = 0; i < rows; i++) V_UNROLL for (int v = 0; v < vectors; v++) sum[i][v] =
            V_ADD(sum[i][v], V_LOAD(p->out + out[i] + v * SSDGS__VW));
    }
    if (p->relu) {
        V_UNROLL for (int i = 0; i < rows; i++) V_UNROLL for (int v = 0; v < vectors; v++) sum[i][v] =
            V_MAX(sum[i][v], V_SET(0));
    }
    if (p->mask) {
        V_UNROLL for (int i = 0; i < rows; i++) V_UNROLL for (int v = 0; v < vectors; v++) sum[i][v] =
            V_SEL(V_LT(V_SET(0), V_LOAD(p->mask + out[i] + v * SSDGS__VW)), sum[i][v], V_SET(0));
    }
    V_UNROLL for (int i = 0; i < rows; i++) {
        R *const to = p->out + out[i];
        V_UNROLL for (int v = 0; v < vectors; v++) V_STORE(to + v * SSDGS__VW, sum[i][v]);
    }
}

/* All rows over some columns, in tiles of about equal height. */
SSDGS__FI void F(dense_columns)(const ssdgs__product *p, const ssdgs__offsets *depth, const int vectors,
                                int column) {
    int left = (p->rows + SSDGS__TR - 1) / SSDGS__TR, row = 0;
    for (; left; left--) {
        const int rows = (p->rows - row + left - 1) / left;
        const uint16_t *list = p->row_list + row;
        if (SSDGS__TR > 5 && rows == 6) F(dense_tile)(6, p, depth, vectors, list, column);
        else if (SSDGS__TR > 4 && rows == 5) F(dense_tile)(5, p, depth, vectors, list, column);
        else if (SSDGS__TR > 3 && rows == 4) F(dense_tile)(4, p, depth, vectors, list, column);
        else if (SSDGS__TR > 2 && rows == 3) F(dense_tile)(3, p, depth, vectors, list, column);
        else if (rows == 2) F(dense_tile)(2, p, depth, vectors, list, column);
        else F(dense_tile)(1, p, depth, vectors, list, column);
        row += rows;
    }
}

SSDGS__FN void F(dense)(const ssdgs__product *p) {
    ssdgs__offsets depth[SSDGS_MAX_WIDTH];
    SSDGS_ASSERT(p->depth <= SSDGS_MAX_WIDTH && p->columns % 16 == 0);
    int column = 0;
    for (int k = 0; k < p->depth; k++) {
        depth[k].a = (uint32_t)(p->depth_list[k] * p->a_k);
        depth[k].b = (uint32_t)(p->depth_list[k] * p->b_stride);
    }
    for (; column + SSDGS__TV * SSDGS__VW <= p->columns; column += SSDGS__TV * SSDGS__VW)
        F(dense_columns)(p, depth, SSDGS__TV, column);
    for (; SSDGS__TV * SSDGS__VW > 16 && column + 2 * SSDGS__VW <= p->columns; column += 2 * SSDGS__VW)
        F(dense_columns)(p, depth, 2, column);
    for (; SSDGS__VW > 8 && column < p->columns; column += SSDGS__VW) F(dense_columns)(p, depth, 1, column);
}

/* Which rows of ReLU outputs (count, BLOCK) are not all 0: neurons that live somewhere in the block. Returns
   how many. */
SSDGS__FN int F(live_rows)(const R *rows, int count, uint16_t *list) {
    int n = 0;
    for (int i = 0; i < count; i++) {
        V most = V_LOAD(rows + i * SSDGS__BLOCK);
        for (int s = SSDGS__VW; s < SSDGS__BLOCK; s += SSDGS__VW)
            most = V_MAX(most, V_LOAD(rows + i * SSDGS__BLOCK + s));
        list[n] = (uint16_t)i;
        n += V_BITS(V_LT(V_SET(0), most)) != 0;
    }
    return n;
}

/* (count, BLOCK) -> (BLOCK, padded) in rows of stride, columns from count on 0; padded is a multiple of 4. */
SSDGS__FN void F(transpose)(const R *rows, int count, size_t padded, size_t stride, R *out) {
    const size_t all = (size_t)count * SSDGS__BLOCK;
    R last[4 * SSDGS__BLOCK];
    for (size_t i = 0; i < padded; i += 4) {
        const size_t first = i * SSDGS__BLOCK;
        const R *from = first + 4 * SSDGS__BLOCK <= all ? rows + first : last;
        for (size_t s = 0; from == last && s < 4 * SSDGS__BLOCK; s++)
            last[s] = first + s < all ? rows[first + s] : 0;
        for (size_t s = 0; s < SSDGS__BLOCK; s += 4)
            F(transpose4)(from + s, SSDGS__BLOCK, out + s * stride + i, stride);
    }
}

/* Adds each listed row of rows (., SSDGS__BLOCK), as 16 partial sums, to sums + row x stride. */
SSDGS__FN void F(row_sums)(R *sums, size_t stride, const R *rows, const uint16_t *list, int count) {
    for (int i = 0; i < count; i++)
        for (int j = 0; j < 16; j += SSDGS__VW) {
            const R *row = rows + list[i] * SSDGS__BLOCK + j;
            V sum = V_LOAD(row);
            for (int s = 16; s < SSDGS__BLOCK; s += 16) sum = V_ADD(sum, V_LOAD(row + s));
            V_STORE_ADD(sums + list[i] * stride + j, sum);
        }
}

/* ==== >>encode_kernel  enc_L(v) = (v, sin v .. sin 2^(L-1) v, cos v .. cos 2^(L-1) v) ==== */

/* Each component on its own. in (dims, BLOCK) is read as (in - origin) * scale; one sine and cosine, the
   others by doubling the angle. */
SSDGS__FN void F(encode)(R *out, const R *in, const R *origin, R scale, int dims, int levels) {
    for (int d = 0; d < dims; d++)
        for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
            V x =
                V_MUL(V_SUB(V_LOAD(in + d * SSDGS__BLOCK + s), V_SET(origin ? origin[d] : 0)), V_SET(scale));
            V_STORE(out + d * SSDGS__BLOCK + s, x);
            V sine, cosine;
            F(sincos)(V_MAX(V_SET(-1e5), V_MIN(V_SET(1e5), x)), &sine, &cosine); /* finite however far out */
            for (int l = 0; l < levels; l++) {
                const V twice = V_ADD(sine, sine);
                V_STORE(out + (dims * (1 + l) + d) * SSDGS__BLOCK + s, sine);
                V_STORE(out + (dims * (1 + levels + l) + d) * SSDGS__BLOCK + s, cosine);
                cosine = V_FNMA(twice, sine, V_SET(1));
                sine = V_MUL(twice, V_LOAD(out + (dims * (1 + levels + l) + d) * SSDGS__BLOCK + s));
            }
        }
}

/* din += scale (dv + sum 2^l (dsin cos - dcos sin)), from the encoded values in `out`. */
SSDGS__FN void F(encode_backward)(R *din, const R *dout, const R *out, R scale, int dims, int levels) {
    for (int d = 0; d < dims; d++)
        for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
            V sum = V_LOAD(dout + d * SSDGS__BLOCK + s), power = V_SET(1);
            for (int l = 0; l < levels; l++) {
                const int sine = (dims * (1 + l) + d) * SSDGS__BLOCK + s,
                          cosine = (dims * (1 + levels + l) + d) * SSDGS__BLOCK + s;
                V turn = V_FNMA(V_LOAD(dout + cosine), V_LOAD(out + sine),
                                V_MUL(V_LOAD(dout + sine), V_LOAD(out + cosine)));
                sum = V_FMA(power, turn, sum);
                power = V_ADD(power, power);
            }
            V_STORE_FMA(din + d * SSDGS__BLOCK + s, sum, V_SET(scale));
        }
}

/* ==== >>asg_kernel  eqs. 9 to 12 of a block under one light ==== */

/* Directions, Lambert's cosine, Fresnel x ASG. */

/* h = wi + wo made a unit vector, whether there is one, 1 - wo.h and its fifth power. */
SSDGS__FI void F(half_vector)(V h[3], const V wo[3], V *inverse_h, VM *half, V *missing, V *fifth) {
    V h2 = V_DOT(h, h);
    *half = V_GE(h2, V_SET(1e-12)); /* wi = -wo has no half vector: no highlight there */
    *inverse_h = V_DIV(V_SET(1), V_SQRT(V_MAX(h2, V_SET(1e-12))));
    for (int i = 0; i < 3; i++) h[i] = V_MUL(h[i], *inverse_h);
    *missing = V_SUB(V_SET(1), V_DOT(wo, h));
    *missing = V_MAX(
        V_SET(0), V_MIN(V_SET(1), *missing)); /* where wi is nearly -wo, h is rounding and wo.h any number */
    h2 = V_MUL(*missing, *missing);
    *fifth = V_MUL(V_MUL(h2, h2), *missing);
}

/* One lane set of the geometry; both directions of the pass run through it. */
typedef struct F(geometry) {
    V wi[3], wo[3], inverse_light, inverse_eye, irradiance, q[4], inverse_q, r[9], cosine, h[3], inverse_h,
        local[3], missing, fresnel; /* missing: 1 - wo.h */
    VM half;
} F(geometry);

SSDGS__FI void F(geometry_lanes)(F(geometry) * g, const ssdgs__lighting *k, const R *gauss) {
    V x[3];
    for (int i = 0; i < 3; i++) x[i] = V_LOAD(gauss + (SSDGS_POSITION + i) * SSDGS__BLOCK);
    V raw[4];
    for (int i = 0; i < 4; i++) raw[i] = V_LOAD(gauss + (SSDGS_FRAME + i) * SSDGS__BLOCK);
    g->inverse_q = F(rotation)(raw, g->q, g->r);
    for (int i = 0; i < 3; i++) {
        g->wi[i] = k->directional ? V_SET(k->light[i]) : V_SUB(V_SET(k->light[i]), x[i]);
        g->wo[i] = V_SUB(V_SET(k->eye[i]), x[i]);
    }
    const V d2 = V_MAX(V_DOT(g->wi, g->wi), V_SET(k->least_distance2));
    const V e2 = V_MAX(V_DOT(g->wo, g->wo), V_SET(k->least_distance2));
    g->irradiance = k->directional ? V_SET(1) : V_DIV(V_SET(1), d2);
    g->inverse_light = k->directional ? V_SET(1) : V_SQRT(g->irradiance);
    g->inverse_eye = V_DIV(V_SET(1), V_SQRT(e2));
    for (int i = 0; i < 3; i++) {
        g->wi[i] = V_MUL(g->wi[i], g->inverse_light);
        g->wo[i] = V_MUL(g->wo[i], g->inverse_eye);
        g->h[i] = V_ADD(g->wi[i], g->wo[i]);
    }
    g->cosine = V_DOT3(g->r[2], g->r[5], g->r[8], g->wi[0], g->wi[1], g->wi[2]);
    V fifth;
    F(half_vector)(g->h, g->wo, &g->inverse_h, &g->half, &g->missing, &fifth);
    for (int i = 0; i < 3; i++)
        g->local[i] = V_DOT3(g->r[i], g->r[3 + i], g->r[6 + i], g->h[0], g->h[1], g->h[2]);
    g->fresnel = V_FMA(V_SET(1 - SSDGS__F0), fifth, V_SET(SSDGS__F0));
}

/* One basis at the local half vector h (eq. 12). b: x, y, z axes (9), lambda, mu. With dh NULL only the
   value; else also the exponent's derivatives: to h (3), and to the x axis, the y axis, lambda and mu (8). */
SSDGS__FI V F(asg)(const R *b, const V h[3], V *dh, V *db) {
    const V x = V_DOT_SET(b, h);
    const V y = V_DOT_SET(b + 3, h);
    const V value = V_EXP(V_NEG(V_FMA(V_MUL(V_SET(b[9]), x), x, V_MUL(V_MUL(V_SET(b[10]), y), y))));
    if (dh) {
        const V dx = V_MUL(V_SET(-2 * b[9]), x), dy = V_MUL(V_SET(-2 * b[10]), y);
        for (int i = 0; i < 3; i++) {
            dh[i] = V_FMA(dx, V_SET(b[i]), V_MUL(dy, V_SET(b[3 + i])));
            db[i] = V_MUL(dx, h[i]);
            db[3 + i] = V_MUL(dy, h[i]);
        }
        db[6] = V_NEG(V_MUL(x, x));
        db[7] = V_NEG(V_MUL(y, y));
    }
    return value;
}

/* Deferred: lambda or mu of its logarithm. */
SSDGS__FI V F(sharpness)(V raw) {
    return V_EXP(V_MAX(V_SET(-SSDGS__SHARPEST), V_MIN(V_SET(SSDGS__SHARPEST), raw)));
}
/* As ssdgs__lobe_height(): sqrt(lambda mu). */
SSDGS__FI V F(lobe_height)(const R *gauss) {
    const R *raw = gauss + SSDGS_ASG_WEIGHT * SSDGS__BLOCK;
    return V_SQRT(V_MUL(F(sharpness)(V_LOAD(raw)), F(sharpness)(V_LOAD(raw + SSDGS__BLOCK))));
}

/* gauss (CHANNELS, BLOCK) -> rows (SSDGS__ROWS, BLOCK): wi, wo, n, irradiance, f_d, f_s. Deferred,
   f_s is the lobe's height; the rest of it is the pixel's. */
SSDGS__FN void F(reflect)(const ssdgs__lighting *k, const R *gauss, R *rows) {
    for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
        F(geometry) g;
        V d = V_SET(0);
        F(geometry_lanes)(&g, k, gauss + s);
        for (int i = 0; i < 3; i++) {
            V_STORE(rows + (SSDGS__WI + i) * SSDGS__BLOCK + s, g.wi[i]);
            V_STORE(rows + (SSDGS__WO + i) * SSDGS__BLOCK + s, g.wo[i]);
            V_STORE(rows + (SSDGS__NORMAL + i) * SSDGS__BLOCK + s, g.r[3 * i + 2]);
        }
        V_STORE(rows + SSDGS__IRRADIANCE * SSDGS__BLOCK + s, g.irradiance);
        V_STORE(rows + SSDGS__COSINE * SSDGS__BLOCK + s, V_MAX(V_SET(0), g.cosine));
        if (k->specular && !k->deferred)
            for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
                V weight = F(softplus)(V_LOAD(gauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s));
                V lobe = F(asg)(k->basis + 12 * j, g.local, NULL, NULL);
                d = V_FMA(weight, lobe, d);
            }
        V_STORE(rows + SSDGS__GLOSS * SSDGS__BLOCK + s,
                k->deferred ? F(lobe_height)(gauss + s) : V_MUL(g.fresnel, V_SEL(g.half, d, V_SET(0))));
    }
}

/* Where least_distance2 holds the length that a direction was divided by: it is shorter than 1 there. */
SSDGS__FI VM F(held)(const V direction[3]) { return V_LT(V_DOT(direction, direction), V_SET(0.99)); }

/* drows: gradients of the rows above. Adds to dgauss (CHANNELS, BLOCK) and to the lane sums of the light (3),
   the eye (3) and the bases (8 x 12), each (16 lanes). */
SSDGS__FN void F(reflect_backward)(const ssdgs__lighting *k, const R *gauss, const R *drows, R *dgauss,
                                   R *lane_sums) {
    for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
        F(geometry) g;
        V d = V_SET(0);
        F(geometry_lanes)(&g, k, gauss + s);
        V dwi[3], dwo[3], dn[3], dlocal[3];
        for (int i = 0; i < 3; i++) {
            dwi[i] = V_LOAD(drows + (SSDGS__WI + i) * SSDGS__BLOCK + s);
            dwo[i] = V_LOAD(drows + (SSDGS__WO + i) * SSDGS__BLOCK + s);
            dn[i] = V_LOAD(drows + (SSDGS__NORMAL + i) * SSDGS__BLOCK + s);
            dlocal[i] = V_SET(0);
        }
        const V dgloss = V_LOAD(drows + SSDGS__GLOSS * SSDGS__BLOCK + s),
                df = k->deferred ? V_SET(0) : V_SEL(g.half, dgloss, V_SET(0));
        if (k->deferred) { /* d sqrt(lambda mu) / d(log lambda) is half of it */
            const V dlog = V_MUL(V_MUL(V_SET(0.5), dgloss), F(lobe_height)(gauss + s));
            for (int j = 0; j < 2; j++) {
                const V raw = V_LOAD(gauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s);
                V_STORE_ADD(dgauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s,
                            V_SEL(V_LT(V_ABS(raw), V_SET(SSDGS__SHARPEST)), dlog, V_SET(0)));
            }
        }
        const V dlobe = V_MUL(df, g.fresnel);
        if (k->specular && !k->deferred)
            for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
                V raw = V_LOAD(gauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s), weight = F(softplus)(raw),
                  de[3], db[8];
                const V lobe = F(asg)(k->basis + 12 * j, g.local, de, db);
                d = V_FMA(weight, lobe, d);
                V_STORE_FMA(dgauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s, V_MUL(dlobe, lobe),
                            F(sigmoid)(raw));
                const V push = V_MUL(V_MUL(dlobe, weight), lobe);
                for (int i = 0; i < 3; i++) dlocal[i] = V_FMA(push, de[i], dlocal[i]);
                for (int i = 0; i < 8; i++) { /* the z axis, rows 6 to 8, has no part in it */
                    V_STORE_FMA(lane_sums + (6 + 12 * j + (i < 6 ? i : i + 3)) * 16 + s % 16, push, db[i]);
                }
            }
        /* F = F0 + (1 - F0) (1 - wo.h)^5 */
        const V missing2 = V_MUL(g.missing, g.missing);
        const V dwoh = V_MUL(V_MUL(df, d), V_MUL(V_SET(-5 * (1 - SSDGS__F0)), V_MUL(missing2, missing2)));
        V dr[9], dh[3];
        for (int i = 0; i < 3; i++) {
            dh[i] = V_FMA(dwoh, g.wo[i], V_DOT(g.r + 3 * i, dlocal));
            dwo[i] = V_FMA(dwoh, g.h[i], dwo[i]);
            for (int j = 0; j < 3; j++) dr[3 * i + j] = V_MUL(g.h[i], dlocal[j]);
        }
        /* f_d = max(0, n.wi) */
        const V dcosine =
            V_SEL(V_LT(V_SET(0), g.cosine), V_LOAD(drows + SSDGS__COSINE * SSDGS__BLOCK + s), V_SET(0));
        const V along_h = V_DOT(g.h, dh);
        for (int i = 0; i < 3; i++) { /* h = (wi + wo) / |wi + wo| */
            const V dsum = V_MUL(V_FNMA(g.h[i], along_h, dh[i]), g.inverse_h);
            dwi[i] = V_FMA(dcosine, g.r[3 * i + 2], V_ADD(dwi[i], dsum));
            dwo[i] = V_ADD(dwo[i], dsum);
            dr[3 * i + 2] = V_ADD(dr[3 * i + 2], V_FMA(dcosine, g.wi[i], dn[i]));
        }
        V dq[4];
        F(rotation_backward)(dq, g.q, g.inverse_q, dr);
        for (int i = 0; i < 4; i++) V_STORE_ADD(dgauss + (SSDGS_FRAME + i) * SSDGS__BLOCK + s, dq[i]);
        /* wi = (light - x) / d, irradiance = 1 / d^2; wo alike */
        V along_light = V_DOT(g.wi, dwi);
        if (!k->directional)
            along_light = V_FMA(V_MUL(V_SET(2), g.irradiance),
                                V_LOAD(drows + SSDGS__IRRADIANCE * SSDGS__BLOCK + s), along_light);
        along_light = V_SEL(F(held)(g.wi), V_SET(0), along_light);
        const V along_eye = V_SEL(F(held)(g.wo), V_SET(0), V_DOT(g.wo, dwo));
        for (int i = 0; i < 3; i++) {
            R *out = dgauss + (SSDGS_POSITION + i) * SSDGS__BLOCK + s;
            const V to_light = V_MUL(V_FNMA(g.wi[i], along_light, dwi[i]), g.inverse_light);
            const V to_eye = V_MUL(V_FNMA(g.wo[i], along_eye, dwo[i]), g.inverse_eye);
            V_STORE(out, V_SUB(V_LOAD(out), k->directional ? to_eye : V_ADD(to_light, to_eye)));
            out = lane_sums + i * 16 + s % 16;
            V_STORE_ADD(out, to_light);
            V_STORE_ADD(out + 3 * 16, to_eye); /* the eye's, after the light's three */
        }
    }
}

/* ==== >>highlight_kernel  deferred: eqs. 9, 10 and 12 of a tile's pixels under one light ==== */

/* Reads what the pixel's Gaussians blend to. One term per pixel and light:
       S (D + M (n.wi / (wo.h)^2) (F0 + (1 - F0) (1 - wo.h)^5) sum_j a_j e_j)
       e_j = exp(-s_j ((1 - t_j) p.Q p + t_j h.Q h))

   D = (c_d / pi) f_d E and M = c_s sqrt(lambda mu) E are blended, and so are the normal n and, over the
   pixel's alpha, F0 and Q = lambda xx' + mu yy' of the frames' axes. With the factor sqrt(lambda mu) a lobe
   sends back as much light, however narrow it is. p is h less its part along n. With t_j = 0 a lobe sees the
   normals' mean, right for smooth surfaces; with 1 each Gaussian's own, right for rough ones. n.wi / (wo.h)^2
   is what shadowing and masking of microfacets come to (Kelemen and Szirmay-Kalos 2001); n.wi >= 0,
   wo.h >= SSDGS__GRAZING.

   S is eq. 8's of two blended things: the shadow network's answers, and (1 - soft) v + soft v_g. v is the
   transmittance to the place at the pixel's depth, from the light map. v_g is the Gaussians' own. Softness is
   0 for a shadow's edge on what reflects, 1 where light comes out beside where it went in.

   Why per pixel: a narrow highlight passes over one Gaussian in few photographs, which its own normal fits by
   heart. The normals' mean at a pixel carries over to other views. A shadow's edge is narrower than
   Gaussians.

   Layers: Q is layers 1, 2 over A, depth and F0 layer 3 over A, with A, the sum of weights, its third; the
   normal is layer 4's direction, M is layer 5. */

typedef struct F(highlight_geometry) {
    V ray[3], inverse_ray, inverse_cover, depth, f0, wi[3], wo[3], inverse_light, h[3], inverse_h;
    V missing, fifth, fresnel;
    /* the normal, n.h, p = h - n (n.h) and h, Q p, p.Q p */
    V n[3], inverse_n, along, p[2][3], row[2][3], q[2];
    /* max(0, n.wi), 1 / wo.h, n.wi / (wo.h)^2: Kelemen and Szirmay-Kalos */
    V cosine, inverse_woh, microfacet;
    V to_camera[2]; /* the camera's ray (x, y, 1) */
    VM half;
} F(highlight_geometry);

SSDGS__FI void F(highlight_geometry_lanes)(F(highlight_geometry) * g, const ssdgs__lighting *k,
                                           const V pixel[2], const R *layers) {
    const R *q = layers + SSDGS__Q_LAYER * SSDGS__TILE_LAYER,
            *more = layers + SSDGS__DEPTH_LAYER * SSDGS__TILE_LAYER,
            *normal = layers + SSDGS__NORMAL_LAYER * SSDGS__TILE_LAYER;
    g->inverse_cover = V_DIV(V_SET(1), V_MAX(V_LOAD(more + 32), V_SET(SSDGS__THIN)));
    g->depth = V_MUL(V_LOAD(more), g->inverse_cover);
    g->f0 = V_MUL(V_LOAD(more + 16), g->inverse_cover);
    g->to_camera[0] = V_MUL(V_SUB(pixel[0], V_SET(k->cx)), V_SET(k->inverse_fx));
    g->to_camera[1] = V_MUL(V_SUB(pixel[1], V_SET(k->cy)), V_SET(k->inverse_fy));
    for (int i = 0; i < 3; i++)
        g->ray[i] = V_FMA(V_SET(k->view[i]), g->to_camera[0],
                          V_FMA(V_SET(k->view[4 + i]), g->to_camera[1], V_SET(k->view[8 + i])));
    V d2 = V_DOT(g->ray, g->ray);
    g->inverse_ray = V_DIV(V_SET(1), V_SQRT(d2));
    V at[3];
    for (int i = 0; i < 3; i++) {
        at[i] = V_FMA(g->ray[i], g->depth, V_SET(k->eye[i]));
        g->wo[i] = V_NEG(V_MUL(g->ray[i], g->inverse_ray));
        g->wi[i] = k->directional ? V_SET(k->light[i]) : V_SUB(V_SET(k->light[i]), at[i]);
    }
    d2 = V_MAX(V_DOT(g->wi, g->wi), V_SET(k->least_distance2));
    g->inverse_light = k->directional ? V_SET(1) : V_DIV(V_SET(1), V_SQRT(d2));
    for (int i = 0; i < 3; i++) {
        g->wi[i] = V_MUL(g->wi[i], g->inverse_light);
        g->h[i] = V_ADD(g->wi[i], g->wo[i]);
    }
    F(half_vector)(g->h, g->wo, &g->inverse_h, &g->half, &g->missing, &g->fifth);
    g->fresnel = V_FMA(V_SUB(V_SET(1), g->f0), g->fifth, g->f0);
    for (int i = 0; i < 3; i++) g->n[i] = V_LOAD(normal + 16 * i);
    d2 = V_DOT(g->n, g->n);
    g->half = V_AND(
        g->half, V_GE(d2, V_SET(SSDGS__THIN * SSDGS__THIN))); /* nor is there a highlight without a normal */
    g->inverse_n = V_DIV(V_SET(1), V_SQRT(V_MAX(d2, V_SET(SSDGS__THIN * SSDGS__THIN))));
    for (int i = 0; i < 3; i++) g->n[i] = V_MUL(g->n[i], g->inverse_n);
    g->along = V_DOT(g->n, g->h);
    g->cosine = V_MAX(V_SET(0), V_DOT(g->n, g->wi));
    g->inverse_woh = V_DIV(V_SET(1), V_MAX(V_SET(SSDGS__GRAZING), V_SUB(V_SET(1), g->missing)));
    g->microfacet = V_MUL(g->cosine, V_MUL(g->inverse_woh, g->inverse_woh));
    for (int i = 0; i < 3; i++) {
        g->p[0][i] = V_FNMA(g->n[i], g->along, g->h[i]);
        g->p[1][i] = g->h[i];
    }
    for (int j = 0; j < 2; j++) {
        for (int i = 0; i < 3; i++)
            g->row[j][i] = V_MUL(g->inverse_cover,
                                 V_FMA(V_LOAD(q + 16 * i), g->p[j][i],
                                       V_FMA(V_LOAD(q + SSDGS__TILE_LAYER + 16 * i), g->p[j][(i + 1) % 3],
                                             V_MUL(V_LOAD(q + SSDGS__TILE_LAYER + 16 * ((i + 2) % 3)),
                                                   g->p[j][(i + 2) % 3]))));
        g->q[j] = V_DOT(g->row[j], g->p[j]);
    }
}

/* exp(-s ((1 - t) q0 + t q1)) of lobe j */
SSDGS__FI V F(glow_lobe)(const R *basis, const V q[2]) {
    return V_EXP(V_MUL(V_SET(-basis[9]),
                       V_MAX(V_SET(0), V_FMA(V_SET(1 - basis[8]), q[0], V_MUL(V_SET(basis[8]), q[1])))));
}

SSDGS__FI V F(glow)(const ssdgs__lighting *k, const V q[2], V lobes[SSDGS_ASG_COUNT]) {
    V sum = V_SET(0);
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        lobes[j] = F(glow_lobe)(k->basis + 12 * j, q);
        sum = V_FMA(V_SET(k->basis[12 * j + 10]), lobes[j], sum);
    }
    return sum;
}

/* Eq. 8: S of a visibility and the shadow network's answer. */
SSDGS__FI V F(shadow_factor)(const ssdgs__lighting *k, V visibility, V answer) {
    const V v = V_MAX(V_MIN(visibility, V_SET(0.99)), V_SET(0.01)); /* NaN: 0.99 */
    if (!k->shadow) return V_SET(1);
    if (!k->refined_shadow) return visibility;
    return F(sigmoid)(k->residual_shadow ? V_ADD(V_LOG(V_DIV(v, V_SUB(V_SET(1), v))), answer) : answer);
}

/* *d: dL/dS, then dL/dv. Returns dL/d(answer). */
SSDGS__FI V F(shadow_factor_backward)(const ssdgs__lighting *k, V visibility, V factor, V *d) {
    if (!k->shadow) *d = V_SET(0);
    if (!k->shadow || !k->refined_shadow) return V_SET(0);
    const V danswer = V_MUL(*d, V_FNMA(factor, factor, factor));
    /* d logit(v) = 1 / (v (1 - v)) inside the clamp */
    const VM inside = V_AND(V_LT(V_SET(0.01), visibility), V_LT(visibility, V_SET(0.99)));
    *d = k->residual_shadow
             ? V_SEL(inside, V_DIV(danswer, V_FNMA(visibility, visibility, visibility)), V_SET(0))
             : V_SET(0);
    return danswer;
}

/* What arrives at pixels: eq. 8 with a visibility between the map's and the Gaussians', as soft as these
   are. */
typedef struct F(arrival) {
    V inverse_cover, residual, gauss, soft, map, visibility, factor;
} F(arrival);

SSDGS__FI void F(arrival_lanes)(F(arrival) * a, const ssdgs__lighting *k, const R *layers, V map) {
    const R *more = layers + SSDGS__SHADOW_LAYER * SSDGS__TILE_LAYER;
    a->inverse_cover = V_DIV(
        V_SET(1), V_MAX(V_LOAD(layers + SSDGS__DEPTH_LAYER * SSDGS__TILE_LAYER + 32), V_SET(SSDGS__THIN)));
    a->residual = V_MUL(V_LOAD(more), a->inverse_cover);
    a->gauss = V_MUL(V_LOAD(more + 16), a->inverse_cover);
    a->soft = V_MUL(V_LOAD(more + 32), a->inverse_cover);
    a->map = map;
    a->visibility = V_FMA(a->soft, V_SUB(a->gauss, map), map);
    a->factor = F(shadow_factor)(k, a->visibility, a->residual);
}

/* Writes the gradient of the layer with the residual and, as its fourth, dL/dv of the map's v; returns
   -A dL/dA, A the cover. */
SSDGS__FI V F(arrival_backward)(const F(arrival) * a, const ssdgs__lighting *k, V dfactor, R *dlayers) {
    R *dmore = dlayers + SSDGS__SHADOW_LAYER * SSDGS__TILE_LAYER;
    V dvisibility = dfactor;
    const V dresidual = F(shadow_factor_backward)(k, a->visibility, a->factor, &dvisibility);
    const V dgauss = V_MUL(dvisibility, a->soft), dsoft = V_MUL(dvisibility, V_SUB(a->gauss, a->map));
    V_STORE(dmore + SSDGS__TILE_FOURTH, V_MUL(dvisibility, V_SUB(V_SET(1), a->soft)));
    V_STORE(dmore, V_MUL(dresidual, a->inverse_cover));
    V_STORE(dmore + 16, V_MUL(dgauss, a->inverse_cover));
    V_STORE(dmore + 32, V_MUL(dsoft, a->inverse_cover));
    return V_FMA(dresidual, a->residual, V_FMA(dgauss, a->gauss, V_MUL(dsoft, a->soft)));
}

/* Adds the light's diffuse and specular terms to layer 0. visibility: visibility, in; S, out. */
SSDGS__FN void F(highlight)(const ssdgs__lighting *k, const ssdgs__tile *tile, R *layers, R *visibility) {
    for (int micro = 0; micro < 16; micro++) {
        V px[SSDGS__NV], py[SSDGS__NV];
        R *at = layers + micro * 64, *m = at + SSDGS__LIGHT_LAYER * SSDGS__TILE_LAYER,
          *diffuse = at + SSDGS__DIFFUSE_LAYER * SSDGS__TILE_LAYER, *s = visibility + micro * 64;
        F(pixel_centres)(tile, micro, px, py);
        for (int v = 0; v < SSDGS__NV;
             v++, at += SSDGS__VW, m += SSDGS__VW, diffuse += SSDGS__VW, s += SSDGS__VW) {
            const V pixel[2] = {px[v], py[v]};
            F(arrival) arrival;
            F(arrival_lanes)(&arrival, k, at, V_LOAD(s));
            const V factor = arrival.factor;
            V_STORE(s + 16, factor);
            for (int c = 0; c < 3; c++) V_STORE_FMA(at + 16 * c, factor, V_LOAD(diffuse + 16 * c));
            if (!V_BITS(V_LT(V_SET(0), V_MAX(V_MAX(V_LOAD(m), V_LOAD(m + 16)), V_LOAD(m + 32))))) continue;
            F(highlight_geometry) g;
            F(highlight_geometry_lanes)(&g, k, pixel, at);
            V lobes[SSDGS_ASG_COUNT];
            const V value =
                V_MUL(factor,
                      V_SEL(g.half, V_MUL(V_MUL(g.microfacet, g.fresnel), F(glow)(k, g.q, lobes)), V_SET(0)));
            for (int c = 0; c < 3; c++) V_STORE_FMA(at + 16 * c, value, V_LOAD(m + 16 * c));
        }
    }
}

/* gradient: layer 0 holds dL/d(pixel). Adds to layers 1 to 4, writes 5 to 7 and dL/dv as the fourth of 7;
   adds to sums (SSDGS__HIGHLIGHT_SUMS). */
SSDGS__FN void F(highlight_backward)(const ssdgs__lighting *k, const ssdgs__tile *tile, const R *layers,
                                     const R *visibility, R *gradient, R *sums) {
    V sum[SSDGS__HIGHLIGHT_SUMS][SSDGS__NV];
    for (int i = 0; i < SSDGS__HIGHLIGHT_SUMS; i++)
        for (int v = 0; v < SSDGS__NV; v++) sum[i][v] = V_SET(0);
    for (int micro = 0; micro < 16; micro++) {
        V px[SSDGS__NV], py[SSDGS__NV];
        const R *at = layers + micro * 64, *m = at + SSDGS__LIGHT_LAYER * SSDGS__TILE_LAYER,
                *s = visibility + micro * 64;
        R *d = gradient + micro * 64, *dm = d + SSDGS__LIGHT_LAYER * SSDGS__TILE_LAYER;
        F(pixel_centres)(tile, micro, px, py);
        for (int v = 0; v < SSDGS__NV;
             v++, at += SSDGS__VW, m += SSDGS__VW, d += SSDGS__VW, dm += SSDGS__VW, s += SSDGS__VW) {
            const V pixel[2] = {px[v], py[v]};
            F(arrival) arrival;
            V push = V_SET(0), dfactor = V_SET(0);
            R *d_q = d + SSDGS__Q_LAYER * SSDGS__TILE_LAYER;
            F(arrival_lanes)(&arrival, k, at, V_LOAD(s));
            F(highlight_geometry) g;
            F(highlight_geometry_lanes)(&g, k, pixel, at);
            V lobes[SSDGS_ASG_COUNT];
            const V glow = F(glow)(k, g.q, lobes);
            const V value = V_SEL(g.half, V_MUL(V_MUL(g.microfacet, g.fresnel), glow), V_SET(0));
            for (int i = 0; i < 3; i++) {
                const V pull = V_MUL(V_LOAD(d + 16 * i), arrival.factor);
                V_STORE(dm + 16 * i, V_MUL(pull, value));
                V_STORE(d + SSDGS__DIFFUSE_LAYER * SSDGS__TILE_LAYER + 16 * i, pull);
                push = V_FMA(pull, V_LOAD(m + 16 * i), push);
                dfactor = V_FMA(V_LOAD(d + 16 * i),
                                V_FMA(value, V_LOAD(m + 16 * i),
                                      V_LOAD(at + SSDGS__DIFFUSE_LAYER * SSDGS__TILE_LAYER + 16 * i)),
                                dfactor);
            }
            V dcover = F(arrival_backward)(&arrival, k, dfactor, d);
            push = V_SEL(g.half, push, V_SET(0));
            const V dmicrofacet = V_MUL(push, V_MUL(g.fresnel, glow));
            push = V_MUL(push, g.microfacet);
            V dq[2];
            dq[0] = dq[1] = V_SET(0);
            /* a exp(-s ((1 - t) q0 + t q1)), s = exp(log s), t = sigmoid(logit t) */
            for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
                const R *b = k->basis + 12 * j;
                const V lobe = V_MUL(V_MUL(push, g.fresnel), lobes[j]),
                        pull = V_MUL(V_SET(-b[9] * b[10]), lobe);
                V *out = sum[15 + 2 * j] + v;
                const V fold = V_FMA(V_SET(1 - b[8]), g.q[0], V_MUL(V_SET(b[8]), g.q[1]));
                dq[0] = V_FMA(V_SET(1 - b[8]), pull, dq[0]);
                dq[1] = V_FMA(V_SET(b[8]), pull, dq[1]);
                *out = V_FMA(fold, pull, *out);
                out += SSDGS__NV;
                *out = V_FMA(V_MUL(V_SET(b[8] * (1 - b[8])), V_SUB(g.q[1], g.q[0])), pull, *out);
                sum[15 + 2 * SSDGS_ASG_COUNT + j][v] =
                    V_FMA(V_SET(b[11]), lobe, sum[15 + 2 * SSDGS_ASG_COUNT + j][v]);
            }
            /* F = F0 + (1 - F0) (1 - wo.h)^5 */
            push = V_MUL(push, glow);
            const V df0 = V_MUL(push, V_SUB(V_SET(1), g.fifth));
            const V missing2 = V_MUL(g.missing, g.missing);
            V dwoh = V_MUL(V_MUL(push, V_SUB(V_SET(1), g.f0)), V_MUL(V_SET(-5), V_MUL(missing2, missing2)));
            const V steep = V_MUL(V_MUL(V_SET(-2), dmicrofacet), V_MUL(g.microfacet, g.inverse_woh));
            dwoh = V_ADD(dwoh, V_SEL(V_LT(g.missing, V_SET(1 - SSDGS__GRAZING)), steep, V_SET(0)));
            const V dcosine = V_SEL(V_LT(V_SET(0), g.cosine),
                                    V_MUL(dmicrofacet, V_MUL(g.inverse_woh, g.inverse_woh)), V_SET(0));
            for (int j = 0; j < 2; j++) {
                const V scale = V_MUL(dq[j], g.inverse_cover);
                for (int i = 0; i < 3; i++) {
                    const V twice = V_MUL(V_MUL(V_SET(2), scale), g.p[j][i]);
                    V_STORE_FMA(d_q + 16 * i, V_MUL(scale, g.p[j][i]), g.p[j][i]);
                    V_STORE_FMA(d_q + SSDGS__TILE_LAYER + 16 * i, twice, g.p[j][(i + 1) % 3]);
                }
            }
            V dh[3];
            for (int i = 0; i < 3; i++) dh[i] = V_MUL(V_MUL(V_SET(2), dq[0]), g.row[0][i]); /* p's */
            const V dh_along = V_DOT(g.n, dh);
            V dn[3], dwo[3];
            for (int i = 0; i < 3; i++) { /* p = h - n (n.h) */
                dn[i] = V_FMA(dcosine, g.wi[i], V_NEG(V_FMA(g.along, dh[i], V_MUL(g.h[i], dh_along))));
                dh[i] = V_FMA(dwoh, g.wo[i],
                              V_FMA(V_MUL(V_SET(2), dq[1]), g.row[1][i], V_FNMA(g.n[i], dh_along, dh[i])));
                dwo[i] = V_MUL(dwoh, g.h[i]);
            }
            const V dn_along = V_DOT(g.n, dn);
            for (int i = 0; i < 3; i++) {
                V_STORE_FMA(d + SSDGS__NORMAL_LAYER * SSDGS__TILE_LAYER + 16 * i,
                            V_FNMA(g.n[i], dn_along, dn[i]), g.inverse_n);
            }
            const V along_h = V_DOT(g.h, dh);
            for (int i = 0; i < 3; i++) { /* h = (wi + wo) / |wi + wo|; dh becomes wi's */
                const V dsum = V_MUL(V_FNMA(g.h[i], along_h, dh[i]), g.inverse_h);
                dwo[i] = V_ADD(dwo[i], dsum);
                dh[i] = V_FMA(dcosine, g.n[i], dsum);
            }
            const V along_light = V_SEL(F(held)(g.wi), V_SET(0), V_DOT(g.wi, dh));
            const V along_eye = V_DOT(g.wo, dwo);
            V ddepth = V_SET(0);
            V dat[3];
            /* wi = (light - at) / |light - at|, at = eye + depth ray, wo = -ray / |ray| */
            for (int i = 0; i < 3; i++) {
                dat[i] = V_MUL(V_SUB(V_MUL(g.wi[i], along_light), dh[i]), g.inverse_light);
                sum[i][v] = V_SUB(sum[i][v], dat[i]);
                if (k->directional) dat[i] = V_SET(0);
                ddepth = V_FMA(dat[i], g.ray[i], ddepth);
                sum[3 + i][v] = V_ADD(sum[3 + i][v], dat[i]);
                const V dray =
                    V_FMA(dat[i], g.depth, V_MUL(V_SUB(V_MUL(g.wo[i], along_eye), dwo[i]), g.inverse_ray));
                sum[6 + i][v] = V_FMA(dray, g.to_camera[0], sum[6 + i][v]); /* ray = R' (x, y, 1) */
                sum[9 + i][v] = V_FMA(dray, g.to_camera[1], sum[9 + i][v]);
                sum[12 + i][v] = V_ADD(dray, sum[12 + i][v]);
            }
            R *ddepth_layer = d + SSDGS__DEPTH_LAYER * SSDGS__TILE_LAYER;
            V_STORE_FMA(ddepth_layer, ddepth, g.inverse_cover);
            V_STORE_FMA(ddepth_layer + 16, df0, g.inverse_cover);
            /* -A dL/dA: all are divided by A */
            dcover =
                V_FMA(dq[0], g.q[0], V_FMA(dq[1], g.q[1], V_FMA(ddepth, g.depth, V_FMA(df0, g.f0, dcover))));
            V_STORE(ddepth_layer + 32, V_FNMA(dcover, g.inverse_cover, V_LOAD(ddepth_layer + 32)));
        }
    }
    for (int i = 0; i < SSDGS__HIGHLIGHT_SUMS; i++) sums[i] += F(sum)(sum[i]);
}

/* Deferred: F0 of its logit from 0.04's on. */
SSDGS__FI V F(reflectance)(V raw) { return F(sigmoid)(V_ADD(raw, V_SET(SSDGS__F0_LOGIT))); }

/* gauss (CHANNELS, BLOCK) -> rows (SSDGS__LOBE, BLOCK): Q's xx, yy, zz, xy, yz, zx, the normal, F0,
   softness. */
SSDGS__FN void F(lobe)(const R *gauss, R *rows) {
    for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
        V raw[4];
        for (int i = 0; i < 4; i++) raw[i] = V_LOAD(gauss + (SSDGS_FRAME + i) * SSDGS__BLOCK + s);
        V q[4], r[9];
        F(rotation)(raw, q, r);
        V sharp[2];
        for (int j = 0; j < 2; j++)
            sharp[j] = F(sharpness)(V_LOAD(gauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s));
        for (int i = 0; i < 6; i++) {
            const int a = 3 * (i % 3), b = i < 3 ? a : (a + 3) % 9;
            V_STORE(rows + i * SSDGS__BLOCK + s,
                    V_FMA(V_MUL(sharp[0], r[a]), r[b], V_MUL(V_MUL(sharp[1], r[a + 1]), r[b + 1])));
        }
        for (int i = 0; i < 3; i++) V_STORE(rows + (SSDGS__LOBE_NORMAL + i) * SSDGS__BLOCK + s, r[3 * i + 2]);
        V_STORE(rows + SSDGS__LOBE_FRESNEL * SSDGS__BLOCK + s,
                F(reflectance)(V_LOAD(gauss + (SSDGS_ASG_WEIGHT + 2) * SSDGS__BLOCK + s)));
        V_STORE(rows + SSDGS__LOBE_SOFTNESS * SSDGS__BLOCK + s,
                F(sigmoid)(V_LOAD(gauss + (SSDGS_ASG_WEIGHT + 3) * SSDGS__BLOCK + s)));
    }
}

/* drows: gradients of the rows above. Adds to dgauss (CHANNELS, BLOCK). */
SSDGS__FN void F(lobe_backward)(const R *gauss, const R *drows, R *dgauss) {
    for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
        V raw[4];
        R *out = dgauss + SSDGS_FRAME * SSDGS__BLOCK + s;
        for (int i = 0; i < 4; i++) raw[i] = V_LOAD(gauss + (SSDGS_FRAME + i) * SSDGS__BLOCK + s);
        V q[4], r[9];
        const V inverse_q = F(rotation)(raw, q, r);
        V dr[9];
        for (int i = 0; i < 3; i++)
            dr[3 * i + 2] = V_LOAD(drows + (SSDGS__LOBE_NORMAL + i) * SSDGS__BLOCK + s);
        /* Q = sharp r r': d sharp = r' dQ r, dr = 2 sharp dQ r, off the diagonal dQ is halved */
        for (int j = 0; j < 2; j++) {
            const V log_sharp = V_LOAD(gauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s),
                    sharp = F(sharpness)(log_sharp);
            V product = V_SET(0);
            for (int i = 0; i < 3; i++) {
                const int next = (i + 1) % 3, before = (i + 2) % 3;
                const V row =
                    V_FMA(V_MUL(V_SET(2), V_LOAD(drows + i * SSDGS__BLOCK + s)), r[3 * i + j],
                          V_FMA(V_LOAD(drows + (3 + i) * SSDGS__BLOCK + s), r[3 * next + j],
                                V_MUL(V_LOAD(drows + (3 + before) * SSDGS__BLOCK + s), r[3 * before + j])));
                dr[3 * i + j] = V_MUL(sharp, row);
                product = V_FMA(V_MUL(V_SET(0.5), row), r[3 * i + j], product);
            }
            product = V_SEL(V_LT(V_ABS(log_sharp), V_SET(SSDGS__SHARPEST)), V_MUL(product, sharp), V_SET(0));
            V_STORE_ADD(dgauss + (SSDGS_ASG_WEIGHT + j) * SSDGS__BLOCK + s, product);
        }
        V dq[4];
        F(rotation_backward)(dq, q, inverse_q, dr);
        for (int i = 0; i < 4; i++, out += SSDGS__BLOCK) V_STORE_ADD(out, dq[i]);
        const V f0 = F(reflectance)(V_LOAD(gauss + (SSDGS_ASG_WEIGHT + 2) * SSDGS__BLOCK + s));
        out = dgauss + (SSDGS_ASG_WEIGHT + 2) * SSDGS__BLOCK + s;
        V_STORE_FMA(out, V_FNMA(f0, f0, f0), V_LOAD(drows + SSDGS__LOBE_FRESNEL * SSDGS__BLOCK + s));
        const V soft = F(sigmoid)(V_LOAD(gauss + (SSDGS_ASG_WEIGHT + 3) * SSDGS__BLOCK + s));
        out += SSDGS__BLOCK;
        V_STORE_FMA(out, V_FNMA(soft, soft, soft), V_LOAD(drows + SSDGS__LOBE_SOFTNESS * SSDGS__BLOCK + s));
    }
}

/* ==== >>dipole_kernel  eq. 5 ==== */

/* f_sss of (sigma_s, sigma_a, r); with d, also its three derivatives. virtual_depth = 1 + 4A/3. Jensen's
   form: z (s d + 1) e^(-s d) / d^3 of the real and the virtual source, s = sqrt(3 sigma_a sigma_t). As
   printed, s is sigma_t, the virtual source's factor zr zv, and its bracket has the real source's
   distance. */
SSDGS__FI V F(dipole)(const int printed, V ss, V sa, V r, R virtual_depth, V *d) {
    const V one = V_SET(1), st = V_ADD(ss, sa), inverse_st = V_DIV(one, st), albedo = V_MUL(ss, inverse_st);
    const V str = V_SQRT(V_MUL(V_MUL(V_SET(3), sa), st)), s = printed ? st : str;
    const V zr = inverse_st, zv = V_MUL(zr, V_SET(virtual_depth)), factor = printed ? V_MUL(zr, zv) : zv;
    const V dr = V_SQRT(V_FMA(r, r, V_MUL(zr, zr))), dv = V_SQRT(V_FMA(r, r, V_MUL(zv, zv))),
            q = printed ? dr : dv;
    const V ir = V_DIV(one, dr), iv = V_DIV(one, dv);
    const V er = V_MUL(V_EXP(V_NEG(V_MUL(s, dr))), V_MUL(ir, V_MUL(ir, ir)));
    const V ev = V_MUL(V_EXP(V_NEG(V_MUL(s, dv))), V_MUL(iv, V_MUL(iv, iv)));
    const V br = V_FMA(s, dr, one), bv = V_FMA(s, q, one);
    const V scale = V_MUL(albedo, V_SET(0.079577471545947668)); /* 1 / (4 pi) */
    const V first = V_MUL(br, er), second = V_MUL(bv, ev), f = V_FMA(zr, first, V_MUL(factor, second));
    if (d) {
        const V ddr = V_NEG(V_MUL(V_MUL(zr, er), V_FMA(V_MUL(s, dr), s, V_MUL(V_SET(3), V_ADD(s, ir)))));
        const V ddv = V_NEG(V_MUL(V_MUL(factor, second), V_FMA(V_SET(3), iv, s)));
        const V dq = V_MUL(V_MUL(factor, ev), s);
        const V to_dr = printed ? V_ADD(ddr, dq) : ddr, to_dv = printed ? ddv : V_ADD(ddv, dq);
        const V ds =
            V_FNMA(V_MUL(zr, er), V_MUL(s, V_MUL(dr, dr)), V_MUL(V_MUL(factor, ev), V_FNMA(dv, bv, q)));
        const V dfactor = printed ? V_MUL(V_MUL(V_SET(2), second), zv) : V_MUL(second, V_SET(virtual_depth));
        const V dzv = V_MUL(V_MUL(to_dv, V_MUL(zv, iv)), V_SET(virtual_depth));
        const V dz = V_ADD(V_ADD(first, dfactor), V_FMA(to_dr, V_MUL(zr, ir), dzv));
        V dst = V_NEG(V_MUL(dz, V_MUL(zr, zr))), dsa = V_SET(0);
        if (printed) {
            dst = V_ADD(dst, ds);
        } else { /* str^2 = 3 sa st */
            const V k = V_MUL(V_MUL(ds, V_SET(1.5)), V_DIV(one, V_MAX(str, V_MUL(V_SET(1e-7), st))));
            dst = V_FMA(k, sa, dst);
            dsa = V_MUL(k, st);
        }
        d[0] = V_MUL(scale, V_FMA(V_DIV(f, ss), V_MUL(sa, inverse_st), dst));
        d[1] = V_MUL(scale, V_FNMA(f, inverse_st, V_ADD(dst, dsa)));
        d[2] = V_MUL(V_MUL(scale, r), V_FMA(to_dr, ir, V_MUL(to_dv, iv)));
    }
    return V_MUL(scale, f);
}

/* ==== >>colour_kernel  eqs. 3, 8 and 13: a block's colour from the networks' outputs ==== */

/* The dipole of colour channel c, by sigma_s, sigma_a, r of the network's output rows; unit: their sigmoids.
 */
SSDGS__FI V F(dipole_of)(const ssdgs__lighting *k, const R *network, int c, int s, V unit[3], V *d) {
    const int first = k->per_channel_optics ? c : 0, absorb = k->per_channel_optics ? 3 + c : 1,
              separation = k->per_channel_optics ? 6 : 2;
    unit[0] = F(sigmoid)(V_LOAD(network + first * SSDGS__BLOCK + s));
    unit[1] = F(sigmoid)(V_LOAD(network + absorb * SSDGS__BLOCK + s));
    unit[2] = F(sigmoid)(V_LOAD(network + separation * SSDGS__BLOCK + s));
    return F(dipole)(k->printed_dipole, V_FMA(unit[0], V_SET(2), V_SET(0.05)),
                     V_FMA(unit[1], V_SET(2), V_SET(0.05)), V_FMA(unit[2], V_SET(3), V_SET(0.1)),
                     k->virtual_depth, d);
}

/* Adds to out (SSDGS__OUTS, BLOCK). */
SSDGS__FN void F(colour)(const ssdgs__lighting *k, const ssdgs__colour_in *in, R *out) {
    const R *gauss = in->gauss, *rows = in->geometry, *visibility = in->visibility, *shadow = in->shadow;
    for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
        const V irradiance = V_LOAD(rows + SSDGS__IRRADIANCE * SSDGS__BLOCK + s),
                factor = F(shadow_factor)(k, V_LOAD(visibility + s), shadow ? V_LOAD(shadow + s) : V_SET(0));
        V profile = V_SET(0), unit[3];
        R *o = out + s;
        for (int c = 0; c < 3; c++) {
            const V power = V_MUL(irradiance, V_SET(k->intensity[c])), shaded = V_MUL(power, factor);
            const V lit = k->deferred ? power : shaded;
            if (k->diffuse) {
                const V kd = F(softplus)(V_LOAD(gauss + (SSDGS_DIFFUSE + c) * SSDGS__BLOCK + s));
                const V f = V_MUL(V_MUL(kd, V_SET(0.31830988618379067)),
                                  V_LOAD(rows + SSDGS__COSINE * SSDGS__BLOCK + s));
                V_STORE_FMA(o + c * SSDGS__BLOCK, f, lit);
            }
            if (in->kept) {
                const V own =
                    V_MUL(V_LOAD(in->kept + c * SSDGS__BLOCK + s), V_LOAD(in->kept + 3 * SSDGS__BLOCK + s));
                V_STORE_FMA(o + c * SSDGS__BLOCK, own, k->deferred ? V_SET(1) : factor);
            }
            if (k->specular) {
                const V ks = F(softplus)(V_LOAD(gauss + (SSDGS_SPECULAR + c) * SSDGS__BLOCK + s));
                const V f = V_MUL(ks, V_LOAD(rows + SSDGS__GLOSS * SSDGS__BLOCK + s));
                V_STORE_FMA(o + (SSDGS__OUT_SPECULAR + c) * SSDGS__BLOCK, f, lit);
            }
            if (k->scattering) {
                const V kss = F(softplus)(V_LOAD(gauss + (SSDGS_SCATTERING + c) * SSDGS__BLOCK + s));
                if (c == 0 || k->per_channel_optics) profile = F(dipole_of)(k, in->optics, c, s, unit, NULL);
                V_STORE_FMA(o + (SSDGS__OUT_SCATTERING + c) * SSDGS__BLOCK, V_MUL(kss, profile),
                            k->shadow_on_scattering ? shaded : power);
            }
        }
        V_STORE_ADD(o + SSDGS__OUT_SHADOW * SSDGS__BLOCK, factor);
    }
}

/* dcolor (3, BLOCK), ddiffuse and dspecular for those terms alone: dcolor, unless they are deferred. Adds to
   dgauss; writes drows' irradiance, f_d, f_s, and the output gradients dshadow (1), doptics (3 or 7). */
SSDGS__FN void F(colour_backward)(const ssdgs__lighting *k, const ssdgs__colour_in *in,
                                  const ssdgs__colour_gradient *out) {
    const R *gauss = in->gauss, *rows = in->geometry, *visibility = in->visibility, *shadow = in->shadow;
    const R *dcolor = out->color, *ddiffuse = out->diffuse, *dspecular = out->specular;
    R *dgauss = out->gauss, *drows = out->geometry, *dshadow = out->shadow, *doptics = out->optics;
    R *dvisibility = out->visibility;
    for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
        const V irradiance = V_LOAD(rows + SSDGS__IRRADIANCE * SSDGS__BLOCK + s),
                factor = F(shadow_factor)(k, V_LOAD(visibility + s), shadow ? V_LOAD(shadow + s) : V_SET(0));
        const V cosine = V_LOAD(rows + SSDGS__COSINE * SSDGS__BLOCK + s),
                gloss = V_LOAD(rows + SSDGS__GLOSS * SSDGS__BLOCK + s);
        const V direct = k->deferred ? V_SET(1) : factor;
        V dirradiance = V_SET(0), dcosine = V_SET(0), dgloss = V_SET(0), dfactor = V_SET(0),
          ddirect = V_SET(0), profile = V_SET(0), unit[3], d[3], dunit[3];
        for (int i = 0; i < 3; i++) unit[i] = d[i] = dunit[i] = V_SET(0);
        for (int c = 0; c < 3; c++) {
            if (k->diffuse) { /* (c_d / pi) f_d S */
                const V raw = V_LOAD(gauss + (SSDGS_DIFFUSE + c) * SSDGS__BLOCK + s);
                const V kd = V_MUL(F(softplus)(raw), V_SET(0.31830988618379067)), surface = V_MUL(kd, cosine);
                const V push = V_MUL(V_LOAD(ddiffuse + c * SSDGS__BLOCK + s), V_SET(k->intensity[c])),
                        lit = V_MUL(V_MUL(push, irradiance), direct);
                R *to = dgauss + (SSDGS_DIFFUSE + c) * SSDGS__BLOCK + s;
                V_STORE_FMA(to, V_MUL(V_MUL(lit, cosine), V_SET(0.31830988618379067)), F(sigmoid)(raw));
                dcosine = V_FMA(lit, kd, dcosine);
                dirradiance = V_FMA(V_MUL(push, direct), surface, dirradiance);
                ddirect = V_FMA(V_MUL(push, irradiance), surface, ddirect);
            }
            if (k->specular) { /* c_s f_s S */
                const V raw = V_LOAD(gauss + (SSDGS_SPECULAR + c) * SSDGS__BLOCK + s), ks = F(softplus)(raw);
                const V push = V_MUL(V_LOAD(dspecular + c * SSDGS__BLOCK + s), V_SET(k->intensity[c])),
                        lobe_lit = V_MUL(V_MUL(push, irradiance), direct), shine = V_MUL(ks, gloss);
                R *to = dgauss + (SSDGS_SPECULAR + c) * SSDGS__BLOCK + s;
                V_STORE_FMA(to, V_MUL(lobe_lit, gloss), F(sigmoid)(raw));
                dgloss = V_FMA(lobe_lit, ks, dgloss);
                dirradiance = V_FMA(V_MUL(push, direct), shine, dirradiance);
                ddirect = V_FMA(V_MUL(push, irradiance), shine, ddirect);
            }
            if (k->scattering) { /* c_sss f_sss */
                const V g = V_MUL(V_LOAD(dcolor + c * SSDGS__BLOCK + s), V_SET(k->intensity[c]));
                const V raw = V_LOAD(gauss + (SSDGS_SCATTERING + c) * SSDGS__BLOCK + s),
                        kss = F(softplus)(raw);
                R *to = dgauss + (SSDGS_SCATTERING + c) * SSDGS__BLOCK + s;
                const V power = k->shadow_on_scattering ? V_MUL(g, factor) : g,
                        lamp = V_MUL(power, irradiance);
                if (c == 0 || k->per_channel_optics) profile = F(dipole_of)(k, in->optics, c, s, unit, d);
                V_STORE_FMA(to, V_MUL(lamp, profile), F(sigmoid)(raw));
                dirradiance = V_FMA(power, V_MUL(kss, profile), dirradiance);
                if (k->shadow_on_scattering)
                    dfactor = V_FMA(V_MUL(g, irradiance), V_MUL(kss, profile), dfactor);
                const V dprofile = V_MUL(lamp, kss);
                for (int i = 0; i < 3; i++) dunit[i] = V_FMA(dprofile, d[i], dunit[i]);
                if (k->per_channel_optics || c == 2)
                    for (int i = 0; i < 2; i++) { /* sigma = 2 sigmoid(o) + 0.05 */
                        V_STORE(doptics + (k->per_channel_optics ? 3 * i + c : i) * SSDGS__BLOCK + s,
                                V_MUL(V_MUL(V_SET(2), dunit[i]), V_FNMA(unit[i], unit[i], unit[i])));
                        dunit[i] = V_SET(0);
                    }
            }
        }
        if (k->scattering)
            V_STORE(doptics + (k->per_channel_optics ? 6 : 2) * SSDGS__BLOCK + s,
                    V_MUL(V_MUL(V_SET(3), dunit[2]), V_FNMA(unit[2], unit[2], unit[2])));
        if (!k->deferred) dfactor = V_ADD(dfactor, ddirect); /* else S is the pixel's for these two */
        if (k->shadow) {
            V_STORE(dshadow + s, F(shadow_factor_backward)(k, V_LOAD(visibility + s), factor, &dfactor));
            V_STORE(dvisibility + s, dfactor);
        }
        V_STORE(drows + SSDGS__IRRADIANCE * SSDGS__BLOCK + s, dirradiance);
        V_STORE(drows + SSDGS__COSINE * SSDGS__BLOCK + s, dcosine);
        V_STORE(drows + SSDGS__GLOSS * SSDGS__BLOCK + s, dgloss);
    }
}

/* ==== >>harmonics_kernel  colours of plain splats ==== */

/* out (3, BLOCK) = max(0, 0.5 + sum of harmonics x their values), seen from the eye: real spherical harmonics
   up to degree 3, with the signs of the published 3D Gaussian splatting. rows: f_dc (3), then all others of
   red, of green, of blue. */
SSDGS__FN void F(harmonics)(const R *position, const R *rows, int degree, const R *eye, R *out) {
    const int more = ssdgs__harmonics(degree);
    for (int s = 0; s < SSDGS__BLOCK; s += SSDGS__VW) {
        V y[15], d[3], length = V_SET(0);
        for (int i = 0; i < 3 && more; i++) {
            d[i] = V_SUB(V_LOAD(position + i * SSDGS__BLOCK + s), V_SET(eye[i]));
            length = V_FMA(d[i], d[i], length);
        }
        if (more) {
            length = V_DIV(V_SET(1), V_SQRT(V_MAX(length, V_SET(1e-30))));
            for (int i = 0; i < 3; i++) d[i] = V_MUL(d[i], length);
            y[0] = V_MUL(V_SET(-0.48860251190291992), d[1]);
            y[1] = V_MUL(V_SET(0.48860251190291992), d[2]);
            y[2] = V_MUL(V_SET(-0.48860251190291992), d[0]);
        }
        if (degree > 1) {
            const V xx = V_MUL(d[0], d[0]), yy = V_MUL(d[1], d[1]), zz = V_MUL(d[2], d[2]);
            const V xy = V_MUL(d[0], d[1]), yz = V_MUL(d[1], d[2]), xz = V_MUL(d[0], d[2]);
            const V round = V_ADD(xx, yy), across = V_SUB(xx, yy),
                    four = V_FNMA(V_SET(1), round, V_MUL(V_SET(4), zz));
            y[3] = V_MUL(V_SET(1.0925484305920792), xy);
            y[4] = V_MUL(V_SET(-1.0925484305920792), yz);
            y[5] = V_MUL(V_SET(0.31539156525252005), V_SUB(V_ADD(zz, zz), round));
            y[6] = V_MUL(V_SET(-1.0925484305920792), xz);
            y[7] = V_MUL(V_SET(0.54627421529603959), across);
            y[8] = V_MUL(V_MUL(V_SET(-0.59004358992664352), d[1]), V_SUB(V_MUL(V_SET(3), xx), yy));
            y[9] = V_MUL(V_MUL(V_SET(2.8906114426405538), xy), d[2]);
            y[10] = V_MUL(V_MUL(V_SET(-0.45704579946446572), d[1]), four);
            y[11] = V_MUL(V_MUL(V_SET(0.3731763325901154), d[2]), V_FNMA(V_SET(3), round, V_ADD(zz, zz)));
            y[12] = V_MUL(V_MUL(V_SET(-0.45704579946446572), d[0]), four);
            y[13] = V_MUL(V_MUL(V_SET(1.4453057213202769), d[2]), across);
            y[14] = V_MUL(V_MUL(V_SET(-0.59004358992664352), d[0]), V_SUB(xx, V_MUL(V_SET(3), yy)));
        }
        for (int c = 0; c < 3; c++) {
            const R *value = rows + (3 + c * more) * SSDGS__BLOCK + s;
            V sum = V_FMA(V_SET(SSDGS__HARMONIC), V_LOAD(rows + c * SSDGS__BLOCK + s), V_SET(0.5));
            for (int i = 0; i < more; i++) sum = V_FMA(y[i], V_LOAD(value + i * SSDGS__BLOCK), sum);
            V_STORE(out + c * SSDGS__BLOCK + s, V_MAX(V_SET(0), sum));
        }
    }
}

/* ==== >>image_kernels  SSIM, normals from depths, Adam ==== */

/* One row of SSIM. image and reference point at the row in planes with a border of 5 rows and 16 columns of
   "black"; values are stored less 1/2, which leaves variances as they are and, where values are 0 .. 1, keeps
   them from cancelling. Writes d(SSIM)/d(mean, E[i^2], E[ij]) and returns the sums of SSIM, |i - j| and
   (i - j)^2. scratch: 5 rows of the stride. */
SSDGS__FN void F(ssim_row)(const ssdgs__ssim_row *at, R sums[3]) {
    const R *image = at->image, *reference = at->reference;
    R *scratch = at->scratch, *d_mean = at->d_mean, *d_square = at->d_square, *d_product = at->d_product;
    const size_t stride = at->stride;
    const int width = at->width;
    const V c1 = V_SET(1e-4), c2 = V_SET(9e-4), half = V_SET(0.5), zero = V_SET(0);
    for (int x = -16; x + 16 < (int)stride; x += SSDGS__VW) {
        V sum[5];
        for (int m = 0; m < 5; m++) sum[m] = zero;
        for (int t = -5; t <= 5; t++) {
            const V w = V_SET(ssdgs__window[t + 5]);
            const V i = V_LOAD(image + t * (ptrdiff_t)stride + x),
                    j = V_LOAD(reference + t * (ptrdiff_t)stride + x);
            const V wi = V_MUL(w, i), wj = V_MUL(w, j);
            sum[0] = V_ADD(sum[0], wi);
            sum[1] = V_ADD(sum[1], wj);
            sum[2] = V_FMA(wi, i, sum[2]);
            sum[3] = V_FMA(wj, j, sum[3]);
            sum[4] = V_FMA(wi, j, sum[4]);
        }
        for (int m = 0; m < 5; m++) V_STORE(scratch + (size_t)m * stride + 16 + x, sum[m]);
    }
    V total[3][SSDGS__NV];
    for (int m = 0; m < 3 * SSDGS__NV; m++) total[m / SSDGS__NV][m % SSDGS__NV] = zero;
    for (int x = 0; x < width; x += SSDGS__VW) {
        const int v = x / SSDGS__VW % SSDGS__NV;
        V e[5];
        const VM inside = V_LT(V_LOAD(ssdgs__count), V_SET(width - x));
        for (int m = 0; m < 5; m++) {
            const R *row = scratch + (size_t)m * stride + 16 + x;
            e[m] = zero;
            for (int t = -5; t <= 5; t++) e[m] = V_FMA(V_SET(ssdgs__window[t + 5]), V_LOAD(row + t), e[m]);
        }
        const V mi = V_ADD(e[0], half);
        const V mj = V_ADD(e[1], half);
        V vi = V_FNMA(e[0], e[0], e[2]);
        const VM varies = V_LT(zero, vi);
        vi = V_MAX(vi, zero);
        const V vj = V_MAX(V_FNMA(e[1], e[1], e[3]), zero);
        const V cov = V_SEL(V_AND(varies, V_LT(zero, vj)), V_FNMA(e[0], e[1], e[4]),
                            zero); /* what does not vary does so with nothing */
        const V a1 = V_FMA(V_MUL(V_SET(2), mi), mj, c1);
        const V a2 = V_FMA(V_SET(2), cov, c2);
        const V b1 = V_FMA(mi, mi, V_FMA(mj, mj, c1));
        const V b2 = V_ADD(V_ADD(vi, vj), c2);
        const V inverse = V_DIV(V_SET(1), V_MUL(b1, b2));
        const V ssim = V_MUL(V_MUL(a1, a2), inverse);
        const V by_cov = V_MUL(V_MUL(V_SET(2), a1), inverse);
        const V by_var = V_SEL(varies, V_NEG(V_DIV(ssim, b2)), zero);
        V by_mean =
            V_MUL(V_SET(2), V_FNMA(V_MUL(ssim, mi), V_DIV(V_SET(1), b1), V_MUL(V_MUL(mj, a2), inverse)));
        by_mean = V_FNMA(by_cov, e[1], V_FNMA(V_MUL(V_SET(2), by_var), e[0], by_mean));
        V_STORE(d_mean + x, V_SEL(inside, by_mean, zero));
        V_STORE(d_square + x, V_SEL(inside, by_var, zero));
        V_STORE(d_product + x, V_SEL(inside, by_cov, zero));
        const V diff = V_SEL(inside, V_SUB(V_LOAD(image + x), V_LOAD(reference + x)), zero);
        total[0][v] = V_ADD(total[0][v], V_SEL(inside, ssim, zero));
        total[1][v] = V_ADD(total[1][v], V_ABS(diff));
        total[2][v] = V_FMA(diff, diff, total[2][v]);
    }
    for (int m = 0; m < 3; m++) sums[m] = F(sum)(total[m]);
}

/* gradient = by_l1 sign(i - j) + by_ssim (B[d_mean] + 2 i B[d_square] + j B[d_product]), B the window
   again. */
SSDGS__FN void F(ssim_backward_row)(const ssdgs__ssim_row *at, R by_l1, R by_ssim, R *gradient) {
    const R *image = at->image, *reference = at->reference;
    const R *d_mean = at->d_mean, *d_square = at->d_square, *d_product = at->d_product;
    R *scratch = at->scratch;
    const size_t stride = at->stride;
    const int width = at->width;
    for (int x = -16; x + 16 < (int)stride; x += SSDGS__VW) {
        V sum[3];
        for (int m = 0; m < 3; m++) sum[m] = V_SET(0);
        for (int t = -5; t <= 5; t++) {
            const V w = V_SET(ssdgs__window[t + 5]);
            sum[0] = V_FMA(w, V_LOAD(d_mean + t * (ptrdiff_t)stride + x), sum[0]);
            sum[1] = V_FMA(w, V_LOAD(d_square + t * (ptrdiff_t)stride + x), sum[1]);
            sum[2] = V_FMA(w, V_LOAD(d_product + t * (ptrdiff_t)stride + x), sum[2]);
        }
        for (int m = 0; m < 3; m++) V_STORE(scratch + (size_t)m * stride + 16 + x, sum[m]);
    }
    for (int x = 0; x < width; x += SSDGS__VW) {
        const V i = V_LOAD(image + x), j = V_LOAD(reference + x), diff = V_SUB(i, j), zero = V_SET(0);
        V b[3];
        for (int m = 0; m < 3; m++) {
            const R *row = scratch + (size_t)m * stride + 16 + x;
            b[m] = zero;
            for (int t = -5; t <= 5; t++) b[m] = V_FMA(V_SET(ssdgs__window[t + 5]), V_LOAD(row + t), b[m]);
        }
        V g = V_MUL(V_SET(by_ssim), V_FMA(V_MUL(V_SET(2), i), b[1], V_FMA(j, b[2], b[0])));
        g = V_ADD(g, V_SEL(V_LT(zero, diff), V_SET(by_l1), V_SEL(V_LT(diff, zero), V_SET(-by_l1), zero)));
        V_STORE(gradient + x, g);
    }
}

/* A row of dL/d(normal, alpha) of L = weight (alpha - normal . n), n the normal of the surface that depth
   shows, from the nearer neighbours along the row and across it: for depth d along the ray (u, v, 1),
   n = ((ln d)_u, (ln d)_v, -1 - u (ln d)_u - v (ln d)_v) / |..|. Where a depth is 0 (unknown), so is the
   gradient. depth points at the row in a plane with a border of 1 row and 16 columns of 0; out: 4
   rows of the stride. */
SSDGS__FN void F(depth_normals)(const ssdgs_camera *camera, const R *depth, size_t stride, int y, R weight,
                                R *out) {
    const V zero = V_SET(0), most = V_SET(1e12);
    const R focal[2] = {camera->fx, camera->fy};
    for (int x = 0; x < camera->width; x += SSDGS__VW) {
        const ptrdiff_t step[2] = {1, (ptrdiff_t)stride};
        const V here = V_LOAD(depth + x);
        V slope[2], least = here;
        for (int i = 0; i < 2; i++) {
            const V before = V_LOAD(depth + x - step[i]), after = V_LOAD(depth + x + step[i]);
            const V rise[2] = {V_SUB(here, before), V_SUB(after, here)};
            const VM nearer = V_LT(V_ABS(rise[0]), V_ABS(rise[1]));
            least = V_MIN(least, V_MIN(before, after));
            slope[i] = V_DIV(V_MUL(V_SET(focal[i]), V_SEL(nearer, rise[0], rise[1])),
                             V_MAX(V_SEL(nearer, before, after), V_SET(1e-30)));
            slope[i] = V_MAX(V_NEG(most), V_MIN(most, slope[i]));
        }
        const VM known = V_LT(zero, least);
        const V ray = V_DIV(V_ADD(V_ADD(V_LOAD(ssdgs__count), V_SET(x)), V_SET((R)0.5 - camera->cx)),
                            V_SET(camera->fx));
        V n[3];
        n[0] = slope[0];
        n[1] = slope[1];
        n[2] = V_NEG(V_FMA(slope[0], ray,
                           V_FMA(slope[1], V_SET(((R)y + (R)0.5 - camera->cy) / camera->fy), V_SET(1))));
        const V length = V_DIV(V_SET(-weight), V_SQRT(V_DOT(n, n)));
        for (int i = 0; i < 3; i++)
            V_STORE(out + (size_t)i * stride + x,
                    V_SEL(known,
                          V_MUL(length, V_DOT3(V_SET(camera->view[i]), V_SET(camera->view[4 + i]),
                                               V_SET(camera->view[8 + i]), n[0], n[1], n[2])),
                          zero));
        V_STORE(out + 3 * stride + x, V_SEL(known, V_SET(weight), zero));
    }
}

/* Whether all of n values are within -most .. most. */
SSDGS__FN int F(within)(const R *values, size_t n, R most) {
    size_t i = 0;
    int bad = 0;
#if SSDGS__VW > 1
    for (; i + SSDGS__VW <= n; i += SSDGS__VW)
        bad |= V_BITS(V_GE(V_SET(most), V_ABS(V_LOAD(values + i)))) ^ ((1 << SSDGS__VW) - 1);
#endif
    for (; i < n; i++) bad |= !ssdgs__finite(values[i]) || values[i] > most || values[i] < -most;
    return !bad;
}

/* Adam: m = b1 m + (1 - b1) g, v = b2 v + (1 - b2) g^2, p -= rate m' / (sqrt(v') + eps), ' = bias-corrected.
   Gradients below 4e-18 become 0, as (1 - b2) g^2 would be subnormal, and so do tiny moments: CPUs that flush
   subnormals agree. Gradients are cut at 1e18, so no square and no product with a rate overflows. */
SSDGS__FI void F(adam_lanes)(R *parameter, const R *gradient, R *mean, R *square,
                             const ssdgs__adam_rate *rate) {
    V g = V_LOAD(gradient);
    g = V_SEL(V_LT(V_ABS(g), V_SET(4e-18)), V_SET(0), V_MAX(V_SET(-1e18), V_MIN(V_SET(1e18), g)));
    V m = V_FMA(V_SET(0.9), V_LOAD(mean), V_MUL(V_SET(1 - 0.9), g));
    V v = V_FMA(V_SET(0.999), V_LOAD(square), V_MUL(V_MUL(V_SET(1 - 0.999), g), g));
    m = V_SEL(V_LT(V_ABS(m), V_SET(1e-30)), V_SET(0), m);
    v = V_SEL(V_LT(v, V_SET(1e-36)), V_SET(0), v);
    V_STORE(mean, m);
    V_STORE(square, v);
    m = V_MUL(V_SET(rate->rate), V_MUL(m, V_SET(rate->correct_mean)));
    v = V_ADD(V_SQRT(V_MUL(v, V_SET(rate->correct_square))), V_SET(rate->epsilon));
    V_STORE(parameter, V_SUB(V_LOAD(parameter), V_DIV(m, v)));
}

SSDGS__FN void F(adam)(R *parameter, const R *gradient, R *mean, R *square, size_t n,
                       const ssdgs__adam_rate *rate) {
    size_t i;
    for (i = 0; i + SSDGS__VW <= n; i += SSDGS__VW) {
        F(adam_lanes)(parameter + i, gradient + i, mean + i, square + i, rate);
    }
    if (i == n) return;
    R tail[4][SSDGS__VW];
    for (size_t l = 0; l < SSDGS__VW; l++) {
        tail[0][l] = i + l < n ? parameter[i + l] : 0;
        tail[1][l] = i + l < n ? gradient[i + l] : 0;
        tail[2][l] = i + l < n ? mean[i + l] : 0;
        tail[3][l] = i + l < n ? square[i + l] : 0;
    }
    F(adam_lanes)(tail[0], tail[1], tail[2], tail[3], rate);
    for (size_t l = 0; i + l < n; l++) {
        parameter[i + l] = tail[0][l];
        mean[i + l] = tail[2][l];
        square[i + l] = tail[3][l];
    }
}

#define SSDGS__KERNEL(result, name, arguments) F(name),
#define SSDGS__TRAINED(result, name, arguments) SSDGS__TRAINS(F(name)),
static const ssdgs__kernels F(kernels) = {SSDGS__KERNELS(SSDGS__KERNEL, SSDGS__TRAINED)};
#undef SSDGS__KERNEL
#undef SSDGS__TRAINED

#endif /* SSDGS__SCALAR */

#undef SSDGS__NAME
#undef SSDGS__TR
#undef SSDGS__TV
#undef SSDGS__TARGET
#undef SSDGS__MM
#undef R
#undef V
#undef VM
#undef SSDGS__VW
#undef V_LOAD
#undef V_STORE
#undef V_SET
#undef V_ADD
#undef V_SUB
#undef V_MUL
#undef V_DIV
#undef V_FMA
#undef V_FNMA
#undef V_MIN
#undef V_MAX
#undef V_SQRT
#undef V_LT
#undef V_GE
#undef V_AND
#undef V_BITS
#undef V_SEL
#undef V_ROUND
#undef V_LDEXP
#undef V_EXPONENT
#undef V_EXP
#undef V_LOG
#undef V_NEG
#undef V_UNROLL
#undef V_ABS
#undef V_DOT3
#undef V_DOT
#undef V_DOT_SET
#undef V_STORE_ADD
#undef V_STORE_FMA
#undef F
#endif /* SSDGS__ISA */

/*
MIT License

Copyright (c) 2026 the ssdgs.h authors

Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
documentation files (the "Software"), to deal in the Software without restriction, including without
limitation the rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the
Software, and to permit persons to whom the Software is furnished to do so, subject to the following
conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions
of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED
TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL
THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF
CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER
DEALINGS IN THE SOFTWARE. */
