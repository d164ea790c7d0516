/* The GPU's stages (examples/gpu/gpu_gl.c), each alone and whole frames, against the CPU's. Not one of `make
   test`: it needs EGL with OpenGL 4.3, and Mesa's software renderer does. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/gpu/gpu_gl.c"
#include "scene.h"
#include <sys/wait.h>
#include <unistd.h>

static gpu *device;

/* ---- SHADE, and COMPOSITE's highlights ---- */

enum { LIGHTS = 6 };
static double worst_plane; /* error, relative to the largest value */

/* A frame whose stages up to `last` the CPU has run. */
static void begin(ssdgs_frame *frame, ssdgs_model *model, const ssdgs_light *lights, int count,
                  const ssdgs_render_options *options, int components, ssdgs_stage last) {
    const ssdgs_camera camera = camera_from(2, -2, 1);
    if (!CHECK(!ssdgs__frame_of_model(frame, model, &camera, lights, count, options, components, 0)) ||
        !CHECK(!ssdgs__run_stages(frame, SSDGS_STAGE_PROJECT, (int)last))) {
        printf("    %s\n", ssdgs_error_message(context));
        exit(1);
    }
}

/* What SHADE finds: seen, and of 256 at a time how many are and the first that is skipped. */
static void upload_seen(const uint32_t *seen, size_t n) {
    const size_t groups = gpu_groups(n);
    uint32_t(*tally)[2] = (uint32_t(*)[2])malloc(groups * sizeof *tally);
    for (size_t i = 0; i < groups; i++) tally[i][0] = 0, tally[i][1] = UINT32_MAX;
    for (size_t i = n; i--;) {
        tally[i / 256][0] += seen[i] == SSDGS_SEEN;
        if (seen[i] == SSDGS_SKIPPED) tally[i / 256][1] = (uint32_t)i;
    }
    gpu_upload(device, &device->frame.seen, seen, n * sizeof *seen);
    gpu_upload(device, &device->frame.tally, tally, groups * sizeof *tally);
    free(tally);
}

/* What SHADE reads, from the CPU. */
static void upload_walk(const ssdgs_frame *frame) {
    const size_t n = (size_t)frame->count, all = n * (size_t)frame->light_count * sizeof(float);
    for (size_t i = 0; i < n * (size_t)frame->light_count; i++) /* of lights without maps nothing is known */
        if (!ssdgs__casts(frame->lights + i / n)) {
            frame->visibility[i] = NAN;
            if (frame->depth_cue) frame->depth_cue[i] = NAN;
        }
    const ssdgs_model_view *v = &frame->objects->gaussians;
    gpu_frame *f = &device->frame;
    uint32_t *seen = (uint32_t *)malloc(n * sizeof *seen);
    for (size_t i = 0; i < n; i++) seen[i] = frame->seen[i];
    upload_seen(seen, n);
    gpu_upload(device, &f->gaussians, v->gaussians, SSDGS_CHANNELS * v->stride * sizeof(float));
    gpu_upload_networks(device, frame->objects);
    gpu_upload_sky_shares(device, frame->objects);
    gpu_upload(device, &f->visibility, frame->visibility, all);
    if (frame->depth_cue) gpu_upload(device, &f->depth_cue, frame->depth_cue, all);
    if (frame->flux) gpu_upload(device, &f->flux, frame->flux, all);
    gpu_upload(device, &f->camera.depth, frame->views[0].depth, n * sizeof(float));
    gpu_upload_lamps(device, frame);
    for (int i = 0; i < f->lights; i++) f->light[i].ready = 0;
    free(seen);
}

/* (layers, n, 4) of which the Gaussians drawn and three of four are compared, relative to the layer's
   largest. */
static void compare_planes(const ssdgs_frame *frame, const float *got, const ssdgs_real *want, int layers,
                           const char *name) {
    const size_t n = (size_t)frame->count;
    for (int layer = 0; layer < layers; layer++, got += 4 * n, want += 4 * n) {
        double worst = 0, largest = 0;
        for (size_t i = 0; i < 4 * n; i++) {
            if (i % 4 == 3 || !frame->seen[i / 4]) continue;
            const double error = fabs((double)got[i] - (double)want[i]);
            largest = fabs((double)want[i]) > largest ? fabs((double)want[i]) : largest;
            worst = error <= worst ? worst : error;
        }
        if (!test_check(worst <= 1e-5 * largest, __FILE__, __LINE__, name))
            printf("    layer %d: %g of %g\n", layer, worst, largest);
        if (largest > 0 && worst / largest > worst_plane) worst_plane = worst / largest;
    }
}

/* SHADE alone. */
static void shade(ssdgs_model *model, const ssdgs_light *lights, int light_count,
                  const ssdgs_render_options *options, int skip_all, const char *name) {
    ssdgs_frame frame;
    begin(&frame, model, lights, light_count, options, 0, SSDGS_STAGE_WALK);
    const size_t n = (size_t)frame.count, size = 4 * n * sizeof(float);
    float *color = (float *)malloc(size), *layers = (float *)malloc(size * (size_t)(frame.layer_count + 1));
    uint32_t *shaded = (uint32_t *)malloc((n + 1) * sizeof *shaded),
             *seen = (uint32_t *)malloc(n * sizeof *seen);
    for (size_t i = 0; i < n && skip_all; i++)
        if (frame.seen[i]) frame.seen[i] = SSDGS_SKIPPED;
    gpu_enter(device);
    upload_walk(&frame);
    gpu_shade(device, &frame);
    gpu_download(device, &device->frame.color, color, size);
    gpu_download(device, &device->frame.layers, layers, size * (size_t)frame.layer_count);
    gpu_download(device, &device->frame.shaded, shaded, (n + 1) * sizeof *shaded);
    gpu_download(device, &device->frame.seen, seen, n * sizeof *seen);
    if (!test_check(!gpu_leave(device, "shade"), __FILE__, __LINE__, name))
        printf("    %s\n", device->message);
    CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_SHADE));
    int other = 0;
    for (size_t i = 0; i < n; i++) other += seen[i] != frame.seen[i];
    CHECK(!other);
    if (CHECK(shaded[0] == (uint32_t)frame.shaded_count))
        CHECK(!memcmp(shaded + 1, frame.shaded, shaded[0] * sizeof *shaded));
    compare_planes(&frame, color, frame.color, 1, name);
    compare_planes(&frame, layers, frame.layers, frame.layer_count, name);
    free(seen);
    free(shaded);
    free(layers);
    free(color);
}

/* With these settings, of a cloud. */
static void shade_cloud(const ssdgs_settings *settings, const ssdgs_light *lights, int light_count,
                        const ssdgs_render_options *options, const char *name) {
    ssdgs_model *model = cloud(settings, 0, 300, 0.5);
    shade(model, lights, light_count, options, 0, name);
    ssdgs_model_destroy(model);
}

static void shade_published(const ssdgs_light *lights) {
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_settings settings = ssdgs_settings_published();
    settings.light_map.size = 64;
    shade_cloud(&settings, lights, 1, &options, "published");
    settings.scattering.width = 16;
    settings.shadow.width = 23;
    settings.depth_cue = settings.per_channel_optics = settings.shadow_on_scattering = 1;
    shade_cloud(&settings, lights, LIGHTS, &options, "published, all lights");
    settings.dipole = SSDGS_DIPOLE_PRINTED;
    settings.shadow.layers = 0;
    settings.octaves.light = 0;
    shade_cloud(&settings, lights, LIGHTS, &options, "printed dipole, no shadow network");
}

static void shade_default(const ssdgs_light *lights) {
    ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_settings settings = ssdgs_settings_default();
    settings.light_map.size = 64;
    options.transport_detail = 8;
    settings.transport = 0;
    shade_cloud(&settings, lights, LIGHTS, &options, "deferred");
    for (int i = 0; i < 27; i++)
        options.ambient[i / 3][i % 3] = (ssdgs_real)(i < 3 ? 1 : 0.4 * draw(900 + (uint64_t)i));
    shade_cloud(&settings, lights, LIGHTS, &options, "deferred, ambient");
    shade_cloud(&settings, lights, 0, &options, "deferred, ambient alone");
    settings.asg = SSDGS_ASG_GEOMETRIC;
    shade_cloud(&settings, lights, LIGHTS, &options, "geometric, ambient");
    settings = small_settings();
    shade_cloud(&settings, lights, LIGHTS, &options, "transport, cue, ambient");
    settings.scattering.layers = 0;
    for (int c = 0; c < 3; c++) {
        settings.medium.scattering[c] = (ssdgs_real)(10 + 5 * c);
        settings.medium.absorption[c] = (ssdgs_real)(1 + c);
    }
    shade_cloud(&settings, lights, LIGHTS, &options, "a medium");
    for (int terms = 1; terms < SSDGS_ALL_TERMS; terms *= 2) {
        options.terms = terms;
        shade_cloud(&settings, lights, LIGHTS, &options, "a term");
    }
}

/* What is skipped takes another's colour, also where all are; what is not finite is black. */
static void shade_odd(const ssdgs_light *lights) {
    ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_settings settings = small_settings();
    options.max_error = 1;
    shade_cloud(&settings, lights, 1, &options, "some skipped");
    ssdgs_model *model = cloud(&settings, 0, 300, 0.5);
    shade(model, lights, 1, &options, 1, "all skipped");
    options.max_error = 0;
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    const size_t channels[6] = {SSDGS_DIFFUSE, SSDGS_SPECULAR,   SSDGS_SCATTERING,
                                SSDGS_FRAME,   SSDGS_ASG_WEIGHT, SSDGS_MATERIAL};
    for (size_t i = 0; i < 6; i++)
        v.gaussians[channels[i] * v.stride + 40 * i] = (ssdgs_real)(i & 1 ? NAN : INFINITY);
    shade(model, lights, 2, &options, 0, "not finite");
    ssdgs_model_destroy(model);
    options.ambient[0][0] = 1;
    options.ambient[1][0] = -3; /* less than nothing from one side */
    model = cloud(&settings, 0, 300, 0.5);
    const ssdgs_model_view broad = ssdgs_model_arrays(model);
    for (size_t i = 0; i < 100; i++)
        for (size_t c = 0; c < 2; c++) broad.gaussians[(SSDGS_ASG_WEIGHT + c) * broad.stride + i] = -11;
    shade(model, lights, 1, &options, 0, "broad highlights of a dark sky");
    ssdgs_model_destroy(model);
}

/* The list of what is seen, and the neighbours of what is skipped, of more than one group can add up at
   once. */
static void seen_list(void) {
    enum { MANY = 70001 };
    static uint32_t seen[MANY], shaded[MANY + 1], neighbours[MANY];
    const size_t groups = gpu_groups(MANY);
    uint32_t found = 0, wrong = 0;
    gpu_frame *f = &device->frame;
    for (uint32_t i = 0; i < MANY; i++) seen[i] = i < 500 ? i & 2 : (uint32_t)(3 * draw(i));
    gpu_enter(device);
    upload_seen(seen, MANY);
    gpu_reserve(device, &f->shaded, sizeof shaded);
    gpu_reserve(device, &f->neighbours, sizeof neighbours);
    gpu_seen_program(device, GPU_SEEN_LIST, MANY, 0, groups);
    gpu_download(device, &f->shaded, shaded, sizeof shaded);
    gpu_download(device, &f->neighbours, neighbours, sizeof neighbours);
    CHECK(!gpu_leave(device, "seen"));
    for (uint32_t i = 0; i < MANY; i++) {
        wrong += seen[i] == SSDGS_SEEN && shaded[1 + found] != i;
        wrong += seen[i] == SSDGS_SKIPPED && neighbours[i] != (found ? found - 1 : 0);
        wrong += seen[i] != SSDGS_SKIPPED && neighbours[i] != UINT32_MAX;
        found += seen[i] == SSDGS_SEEN;
    }
    CHECK(shaded[0] == found && !wrong);
}

/* Transport against its sum in double: exact where all nodes are opened, else, relative to the largest sum,
   within half of the 1 % that the manual says of transport_detail 1. */
static void transport(double detail, double bound) {
    enum { MANY = 20000 };
    ssdgs_render_options options = ssdgs_render_options_default();
    const ssdgs_settings settings = small_settings();
    const ssdgs_light light = point_light(1, -2, 2);
    ssdgs_model *model = cloud(&settings, 0, MANY, 1);
    for (int i = 0; i < MANY; i++) /* two, one far from the other */
        for (size_t c = 0; c < 3; c++) {
            ssdgs_real *x = model->gaussians + c * model->capacity + i;
            *x = (ssdgs_real)0.3 * *x + (ssdgs_real)(c ? 0 : i % 2 * 2 - 1);
        }
    CHECK(!ssdgs_model_sort(model));
    ssdgs_frame frame;
    options.transport_detail = (ssdgs_real)detail;
    begin(&frame, model, &light, 1, &options, 0, SSDGS_STAGE_WALK);
    gpu_enter(device);
    upload_walk(&frame);
    gpu_shade(device, &frame);
    float *got = (float *)malloc(GPU_LENGTHS * MANY * sizeof *got);
    gpu_download(device, &device->frame.transport, got, GPU_LENGTHS * MANY * sizeof *got);
    CHECK(!gpu_leave(device, "transport"));
    const ssdgs_model_view *v = &frame.gaussians;
    const double unit = (double)settings.length_unit, soft = 0.02 * unit;
    double worst[GPU_LENGTHS] = {0}, most[GPU_LENGTHS] = {0}, all = 0, own = 0;
    for (size_t i = 0; i < MANY; i += 97) {
        if (frame.seen[i] != SSDGS_SEEN) continue;
        for (int k = 0; k < GPU_LENGTHS; k++) {
            const double length = 0.04 * (1 << k) * unit;
            double sum = 0;
            for (size_t j = 0; j < MANY; j++) {
                double r = soft * soft;
                for (size_t c = 0; c < 3; c++) {
                    const double d =
                        (double)v->gaussians[c * v->stride + i] - (double)v->gaussians[c * v->stride + j];
                    r += d * d;
                }
                r = sqrt(r);
                sum += (double)frame.flux[j] * exp(-r / length) / (2 * 3.14159265358979 * length * r);
            }
            worst[k] = test_most(worst[k], fabs((double)got[(size_t)k * MANY + i] - sum));
            most[k] = fmax(most[k], sum);
            own = fmax(own, test_error((double)got[(size_t)k * MANY + i], sum, 1e-9, 1));
        }
    }
    for (int k = 0; k < GPU_LENGTHS; k++) all = fmax(all, worst[k] / most[k]);
    printf("transport at detail %g: off by %.2g of the largest sum\n", detail, all);
    CHECK(all > 0 && all <= bound && (detail < 8 || own <= bound));
    free(got);
    ssdgs_model_destroy(model);
}

/* Of planes (count, PIXELS) of what is to be seen all but a thousandth, where rounding decides on which side
   of a shadow's edge a place lies. */
static void compare_pixels(const ssdgs_frame *frame, const float *got, const ssdgs_real *want, int count,
                           const char *name) {
    int off = 0;
    double worst = 0;
    for (int i = 0; i < count * PIXELS; i++) {
        if (frame->transmittance[i % PIXELS] > (ssdgs_real)(1 - 1e-5)) continue;
        const double error = test_error((double)got[i], (double)want[i], 3e-5, 3e-5);
        off += error > 1;
        worst = test_most(worst, error);
    }
    if (!test_check(off <= count * PIXELS / 1000 && worst < 3000, __FILE__, __LINE__, name))
        printf("    %d of %d pixels differ, by %g at most\n", off, count * PIXELS, 3e-5 * worst);
}

/* The maps of a light's faces, one after the other, from the CPU. */
static void upload_maps(const ssdgs_frame *frame, int light, gpu_light *to) {
    uint32_t *map_tile = (uint32_t *)malloc(sizeof *map_tile);
    ssdgs_light_pixel *map = (ssdgs_light_pixel *)malloc(sizeof *map);
    size_t tiles = 0, used = 0;
    for (const ssdgs_splat_view *v = frame->views; v < frame->views + frame->view_count; v++) {
        if (v->light != light) continue;
        const size_t more = gpu_tiles(v), before = used;
        map_tile = (uint32_t *)realloc(map_tile, (tiles + more) * sizeof *map_tile);
        for (size_t i = 0; i < more; i++)
            map_tile[tiles + i] = v->map_tile[i] == UINT32_MAX ? UINT32_MAX : (uint32_t)used++;
        map = (ssdgs_light_pixel *)realloc(map, (256 * used + 1) * sizeof *map);
        memcpy(map + 256 * before, v->light_map, 256 * (used - before) * sizeof *map);
        tiles += more;
    }
    gpu_upload(device, &to->map_tile, map_tile, tiles * sizeof *map_tile);
    gpu_upload(device, &to->light_map, map, 256 * used * sizeof *map);
    free(map);
    free(map_tile);
}

/* Pixels lit, from the CPU's layers and maps. */
static void highlights(const ssdgs_settings *settings, const ssdgs_light *lights, int light_count, int given,
                       const char *name) {
    const ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_model *model = cloud(settings, 0, 300, 0.5);
    ssdgs_frame frame;
    begin(&frame, model, lights, light_count, &options, 1, SSDGS_STAGE_COMPOSITE);
    const size_t size = PIXELS * sizeof(float), all = size * (size_t)light_count;
    gpu_light maps[LIGHTS];
    gpu_frame *f = &device->frame;
    float *pixels = (float *)malloc(3 * size), *visibility = (float *)malloc(all),
          *shadow = (float *)malloc(all);
    gpu_fact *facts = (gpu_fact *)calloc((size_t)frame.view_count, sizeof *facts);
    gpu_light *const own = f->light;
    const int own_count = f->lights;
    memset(maps, 0, sizeof maps);
    for (int i = 0; i < frame.view_count; i++) facts[i].nearest = (float)frame.views[i].nearest;
    for (size_t i = 0; given && i < PIXELS * (size_t)light_count; i++)
        frame.pixel_visibility[i] = (ssdgs_real)draw(i);
    frame.visibility_given = given;
    if (given) CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_COMPOSITE));
    gpu_enter(device);
    f->light = maps, f->lights = LIGHTS;
    gpu_upload(device, &f->layer_pixels, frame.layer_pixels, 3 * size * (size_t)(frame.layer_count + 1));
    gpu_upload(device, &f->facts, facts, (size_t)frame.view_count * sizeof *facts);
    gpu_upload_lamps(device, &frame);
    gpu_upload_faces(device, &frame);
    for (int i = 0; i < light_count; i++) upload_maps(&frame, i, maps + i);
    gpu_highlights(device, &frame);
    gpu_download(device, &f->pixels, pixels, 3 * size);
    gpu_download(device, &f->pixel_visibility, visibility, all);
    gpu_download(device, &f->pixel_shadow, shadow, all);
    f->light = own, f->lights = own_count;
    if (!test_check(!gpu_leave(device, "highlights"), __FILE__, __LINE__, name))
        printf("    %s\n", device->message);
    compare_pixels(&frame, pixels, frame.pixels, 3, name);
    compare_pixels(&frame, visibility, frame.pixel_visibility, light_count, name);
    compare_pixels(&frame, shadow, frame.pixel_shadow, light_count, name);
    free(facts);
    free(shadow);
    free(visibility);
    free(pixels);
    ssdgs_model_destroy(model);
}

static void all_highlights(const ssdgs_light *lights) {
    ssdgs_settings settings = small_settings();
    ssdgs_light inside = point_light(0.1, 0.1, -0.1);
    highlights(&settings, lights, LIGHTS, 0, "highlights");
    highlights(&settings, lights, 2, 1, "highlights, visibility given");
    highlights(&settings, &inside, 1, 0, "highlights from within");
    settings.light_map.bias = (ssdgs_real)0.5;
    highlights(&settings, lights, LIGHTS, 0, "highlights, a wide bias");
    settings.shadow.layers = 0;
    highlights(&settings, lights, 2, 0, "highlights, no shadow network");
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
    highlights(&settings, lights, 2, 0, "highlights without shadow");
}

static void shades(void) {
    ssdgs_light lights[LIGHTS];
    lights[0] = point_light(1, -2, 2);
    lights[1] = parallel_light(0, 0.6, 0.8);
    lights[2] = point_light(-1, 1, 1);
    lights[2].kind = SSDGS_LIGHT_SPOT;
    for (int c = 0; c < 3; c++) lights[2].direction[c] = (ssdgs_real)((c ? -1 : 1) / sqrt(3));
    lights[2].cone[0] = (ssdgs_real)0.1, lights[2].cone[1] = (ssdgs_real)0.25;
    lights[3] = point_light(0, -2, -1);
    lights[3].range = (ssdgs_real)1.9;
    lights[4] = parallel_light(0, -0.6, 0.8);
    lights[4].unshadowed = 1;
    lights[5] = point_light(3, 0, 0);
    lights[5].range = (ssdgs_real)0.5; /* reaches nothing */
    seen_list();
    transport(8, 1e-5);
    transport(0.7, 5e-3);
    transport(1, 2e-3);
    shade_published(lights);
    shade_default(lights);
    shade_odd(lights);
    all_highlights(lights);
    printf("largest error of colours and layers: %.3g\n", worst_plane);
}

/* ---- the platform, and the stages up to WALK ---- */

/* What a stage's test starts from: a model seen by a camera under lights, and the CPU's stages up to WALK. */
typedef struct shooting {
    ssdgs_model *model;
    ssdgs_camera camera;
    ssdgs_light lights[4];
    int light_count;
    ssdgs_render_options options;
    ssdgs_frame frame;
} shooting;

static void shoot(shooting *s) {
    if (!CHECK(!ssdgs__frame_of_model(&s->frame, s->model, &s->camera, s->lights, s->light_count, &s->options,
                                      0, 0)) ||
        !CHECK(!ssdgs__run_stages(&s->frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK))) {
        printf("    %s\n", ssdgs_error_message(context));
        exit(1);
    }
}

/* Every ninth Gaussian is a needle, another ninth opaque, another a veil, some are behind or right before the
 * camera, some are not finite or huge.
 */
static void put_oddities(shooting *s, int at_the_eye) {
    static const float values[] = {NAN, INFINITY, -INFINITY, 1e30f, -1e30f, 90, -90, 21, -21};
    const ssdgs_model_view v = ssdgs_model_arrays(s->model);
    for (size_t i = 0; i < (size_t)v.count; i += 9) {
        float *to = v.gaussians + i;
        to[SSDGS_LOG_SCALE * v.stride] = -9;
        if (i + 4 < (size_t)v.count)
            to[SSDGS_OPACITY * v.stride + 4] = 9, to[SSDGS_OPACITY * v.stride + 2] = (float)-4.8;
        if (i % 45 == 0)
            to[(i / 45 % 11) * v.stride] = values[i / 495 % (i / 45 % 11 < SSDGS_ROTATION ? 3 : 9)];
        if (!at_the_eye || i % 45 != 9) continue;
        for (size_t c = 0; c < 3; c++) { /* about the eye */
            const double eye =
                -(double)(s->camera.view[c] * s->camera.view[3] + s->camera.view[4 + c] * s->camera.view[7] +
                          s->camera.view[8 + c] * s->camera.view[11]);
            to[c * v.stride] = (float)(eye + 0.2 * test_uniform(5, 3 * i + c) - 0.1);
        }
        to[(SSDGS_LOG_SCALE + 1) * v.stride] = to[(SSDGS_LOG_SCALE + 2) * v.stride] = -9;
    }
}

/* Scene 0: the default settings under a point light from outside; 1: the published ones under a light within
   the cloud, so six views, and a distant one; 2: as 0, but large Gaussians, antialiased, under a spot light
   and two others.
 */
static void begin_shooting(shooting *s, int which, int count) {
    ssdgs_settings settings = which == 1 ? ssdgs_settings_published() : small_settings();
    memset(s, 0, sizeof *s);
    settings.scattering.width = settings.shadow.width = 16;
    settings.light_map.size = 96;
    settings.light_map.bias = (ssdgs_real)0.05;
    settings.depth_cue = which > 0; /* what lies in the dark alone is not sampled where there is none */
    s->model = cloud(&settings, 1000 * which, count, which == 2 ? 2 : 1);
    s->camera = camera_from(3, which, 1);
    s->camera.near_plane = (ssdgs_real)0.05;
    s->options = which == 1 ? ssdgs_render_options_exact() : ssdgs_render_options_default();
    s->options.antialias = which == 2;
    s->lights[s->light_count++] = which == 1 ? point_light(0.1, 0.2, -0.1) : point_light(2, 3, 4);
    if (which > 0) s->lights[s->light_count++] = parallel_light(0.6, -0.48, 0.64);
    if (which > 1) s->lights[s->light_count++] = point_light(-3, 1, 2);
    if (which == 2) {
        s->lights[0].kind = SSDGS_LIGHT_SPOT;
        for (int i = 0; i < 3; i++) s->lights[0].direction[i] = (ssdgs_real)(-(2 + i) / sqrt(29));
        s->lights[0].cone[0] = (ssdgs_real)0.1, s->lights[0].cone[1] = (ssdgs_real)0.2;
    }
    put_oddities(s, which == 2);
    if (which == 0) s->options.max_error = (ssdgs_real)0.25;
    shoot(s);
    gpu_enter(device);
    gpu_reserve(device, &device->frame.facts, (size_t)s->frame.view_count * sizeof(gpu_fact));
    gpu_upload(device, &device->frame.gaussians, s->frame.gaussians.gaussians,
               s->frame.gaussians.stride * SSDGS_CHANNELS * sizeof(float));
}

static void end_shooting(shooting *s, const char *name) {
    if (!CHECK(!gpu_leave(device, name))) printf("    %s: %s\n", name, device->message);
    ssdgs_model_destroy(s->model);
}

static void *downloaded(const gpu_buffer *b, size_t size) {
    void *data = malloc(size + 1);
    if (!data) exit(1);
    gpu_download(device, b, data, size);
    return data;
}

/* What was there before must not be what a stage is thought to have written. */
static void spoil(gpu_buffer *b, size_t size) {
    void *data = malloc(size + 1);
    if (!data) exit(1);
    memset(data, 0x5A, size);
    gpu_upload(device, b, data, size);
    free(data);
}

/* Buffers and failures. */
static void platform(void) {
    float values[1000], back[1000];
    gpu_buffer b = {0, 0};
    for (int i = 0; i < 1000; i++) values[i] = (float)i;
    printf("%s\n", gpu_name(device));
    gpu_enter(device);
    gpu_upload(device, &b, values, sizeof values);
    gpu_download(device, &b, back, sizeof back);
    if (!CHECK(!memcmp(values, back, sizeof values))) printf("    %s\n", device->message);
    gpu_write(device, &b, 8, values, 12);
    gpu_download(device, &b, back, sizeof back);
    CHECK(!memcmp(values, back + 2, 12) && !memcmp(values + 5, back + 5, sizeof values - 20));
    gpu_download(device, &b, back, sizeof back + 1);
    CHECK(gpu_leave(device, "platform") == SSDGS_ERR_ISA && device->message[0]);
    gpu_enter(device);
    CHECK(!gpu_leave(device, "platform") && !device->message[0]);
}

static void worst(double *most, double got, double want, double absolute, double relative) {
    *most = fmax(*most, test_error(got, want, absolute, relative));
}

/* Records and depths: what is drawn may differ where rounding decides, as at the picture's border. */
static void project(int which, int count) {
    shooting s;
    int all = 0;
    begin_shooting(&s, which, count);
    for (int view = 0; view < s.frame.view_count; view++) {
        const ssdgs_splat_view *v = s.frame.views + view;
        gpu_view *to = &device->frame.camera;
        gpu_project_view(device, &s.frame, view, to);
        ssdgs_record *record = (ssdgs_record *)downloaded(&to->record, (size_t)count * sizeof *record);
        float *depth = (float *)downloaded(&to->depth, (size_t)count * sizeof *depth);
        int both = 0, other = 0;
        double most[4] = {0, 0, 0, 0};
        for (int i = 0; i < count; i++) {
            const int drawn = v->depth[i] >= 0;
            other += drawn != (depth[i] >= 0);
            if (!drawn || !(depth[i] >= 0)) continue;
            both++;
            const ssdgs_record *a = record + i, *b = v->record + i;
            /* what is near has lost digits by subtracting the eye */
            const double near = v->depth[i] < 1 && !v->orthographic ? 1 / (double)v->depth[i] : 1;
            const double px = 2e-6 * near * v->width;
            worst(most, (double)depth[i], (double)v->depth[i], 0, 1e-6 * near);
            worst(most + 1, (double)a->x, (double)b->x, px, 1e-6 * near);
            worst(most + 1, (double)a->y, (double)b->y, px, 1e-6 * near);
            worst(most + 2, (double)a->ux, (double)b->ux, 0, 1e-5 * near);
            worst(most + 2, (double)a->uy, (double)b->uy, 1e-5 * near * (double)b->ux, 1e-5 * near);
            worst(most + 2, (double)a->wy, (double)b->wy, 0, 1e-5 * near);
            worst(most + 3, (double)a->log2_opacity, (double)b->log2_opacity, 3e-5 * near, 1e-6);
            worst(most + 3, (double)a->extent_x, (double)b->extent_x, 1e-3 * near, 1e-5 * near);
            worst(most + 3, (double)a->extent_y, (double)b->extent_y, 1e-3 * near, 1e-5 * near);
        }
        all += both;
        CHECK(other <= 1);
        if (!CHECK(most[0] <= 1 && most[1] <= 1 && most[2] <= 1 && most[3] <= 1))
            printf("    scene %d, view %d: depth %.2g, centre %.2g, conic %.2g, the rest %.2g of the bound\n",
                   which, view, most[0], most[1], most[2], most[3]);
        free(record);
        free(depth);
    }
    CHECK(all > count / 2);
    end_shooting(&s, "project");
}

/* From the CPU's depths: the same order, to the last tie. */
static void sort(int which, int count) {
    shooting s;
    int all = 0;
    begin_shooting(&s, which, count);
    for (int view = 0; view < s.frame.view_count; view++) {
        ssdgs_splat_view *v = s.frame.views + view;
        gpu_view *to = &device->frame.camera;
        for (int i = 3; i < count; i += 7) v->depth[i] = v->depth[i - 3]; /* ties */
        CHECK(!ssdgs_stage_cpu(&s.frame, SSDGS_STAGE_SORT));
        gpu_upload(device, &to->depth, v->depth, (size_t)count * sizeof(float));
        gpu_sort_view(device, &s.frame, view, to);
        uint32_t *order = (uint32_t *)downloaded(&to->order, (size_t)v->visible * sizeof *order);
        all += v->visible;
        CHECK(!memcmp(order, v->order, (size_t)v->visible * sizeof *order));
        free(order);
    }
    CHECK(all > count / 2);
    end_shooting(&s, "sort");
}

/* Where nothing is drawn. */
static void sort_nothing(void) {
    shooting s;
    begin_shooting(&s, 0, 300);
    gpu_view *to = &device->frame.camera;
    for (int i = 0; i < 300; i++) s.frame.views->depth[i] = -1;
    gpu_upload(device, &to->depth, s.frame.views->depth, 300 * sizeof(float));
    gpu_sort_view(device, &s.frame, 0, to);
    gpu_upload(device, &to->record, s.frame.views->record, 300 * sizeof(ssdgs_record));
    device->instance_room = 100;
    spoil(&device->frame.facts, sizeof(gpu_fact));
    gpu_bin_view(device, &s.frame, 0, to);
    gpu_fact *facts = (gpu_fact *)downloaded(&device->frame.facts, sizeof *facts);
    CHECK(facts->visible == 0 && facts->nearest <= 0 && facts->nearest >= 0);
    free(facts);
    const size_t tiles = gpu_tiles(s.frame.views);
    uint32_t *start = (uint32_t *)downloaded(&to->tile_start, (tiles + 1) * sizeof *start);
    ssdgs_instances *of = (ssdgs_instances *)downloaded(&to->of_gaussian, 300 * sizeof *of);
    uint32_t any = 0;
    for (size_t i = 0; i <= tiles; i++) any |= start[i];
    for (int i = 0; i < 300; i++) any |= of[i].count;
    CHECK(!any);
    free(start);
    free(of);
    end_shooting(&s, "nothing");
}

static void upload_view(const ssdgs_frame *frame, int view, gpu_view *to) {
    const ssdgs_splat_view *v = frame->views + view;
    const size_t n = (size_t)frame->count;
    gpu_fact *facts = (gpu_fact *)calloc((size_t)frame->view_count, sizeof *facts);
    if (!facts) exit(1);
    facts[view].visible = (uint32_t)v->visible;
    facts[view].instances = (uint32_t)v->instances;
    facts[view].nearest = (float)v->nearest;
    gpu_upload(device, &device->frame.facts, facts, (size_t)frame->view_count * sizeof *facts);
    free(facts);
    gpu_upload(device, &to->record, v->record, n * sizeof(ssdgs_record));
    gpu_upload(device, &to->depth, v->depth, n * sizeof(float));
    gpu_reserve(device, &to->order, n * sizeof(uint32_t));
    uint32_t *order = (uint32_t *)malloc(n * sizeof *order); /* the rest after what is drawn, as SORT does */
    if (!order) exit(1);
    size_t at = (size_t)v->visible;
    memcpy(order, v->order, at * sizeof *order);
    for (size_t i = 0; i < n; i++)
        if (!(v->depth[i] >= 0)) order[at++] = (uint32_t)i;
    CHECK(at == n);
    gpu_upload(device, &to->order, order, n * sizeof *order);
    free(order);
    gpu_upload(device, &to->of_gaussian, v->of_gaussian, n * sizeof(ssdgs_instances));
    gpu_upload(device, &to->instance, v->instance, v->instance_room * sizeof(ssdgs_instance));
    gpu_upload(device, &to->tile_list, v->tile_list, v->instances * sizeof(ssdgs_tile_entry));
    gpu_upload(device, &to->tile_start, v->tile_start, (gpu_tiles(v) + 1) * sizeof(uint32_t));
}

/* From the CPU's records and order: the same lists, but for entries whose exponent is at the threshold up to
   rounding. Then every instance must be in its place. */
static void bin(int which, int count) {
    shooting s;
    size_t all = 0;
    begin_shooting(&s, which, count);
    for (int view = 0; view < s.frame.view_count; view++) {
        const ssdgs_splat_view *v = s.frame.views + view;
        gpu_view *to = &device->frame.camera;
        const size_t tiles = gpu_tiles(v), n = (size_t)count;
        upload_view(&s.frame, view, to);
        device->instance_room = v->instances + 100;
        spoil(&to->tile_start, (tiles + 1) * sizeof(uint32_t));
        spoil(&device->frame.facts, (size_t)(view + 1) * sizeof(gpu_fact));
        gpu_bin_view(device, &s.frame, view, to);
        gpu_fact *facts = (gpu_fact *)downloaded(&device->frame.facts, (size_t)(view + 1) * sizeof *facts);
        CHECK(facts[view].visible == (uint32_t)v->visible);
        CHECK(!memcmp(&facts[view].nearest, &v->nearest, sizeof v->nearest));
        const size_t instances = facts[view].instances;
        ssdgs_instance *instance =
            (ssdgs_instance *)downloaded(&to->instance, instances * sizeof(ssdgs_instance));
        ssdgs_tile_entry *list =
            (ssdgs_tile_entry *)downloaded(&to->tile_list, instances * sizeof(ssdgs_tile_entry));
        uint32_t *start = (uint32_t *)downloaded(&to->tile_start, (tiles + 1) * sizeof(uint32_t));
        ssdgs_instances *of = (ssdgs_instances *)downloaded(&to->of_gaussian, n * sizeof *of);
        size_t missing = 0, extra = 0, bits = 0, other = 0,
               wrong = start[0] != 0 || start[tiles] != instances;
        for (size_t tile = 0; tile < tiles; tile++) { /* a merge of two lists in the same order */
            uint32_t a = start[tile], b = v->tile_start[tile];
            while (a < start[tile + 1] || b < v->tile_start[tile + 1]) {
                const int there = a < start[tile + 1], here = b < v->tile_start[tile + 1];
                if (there && here && list[a].gaussian == v->tile_list[b].gaussian) {
                    const uint32_t differ = list[a].mask ^ v->tile_list[b].mask;
                    bits++;
                    other += differ != 0;
                    wrong += (differ & (differ - 1)) != 0; /* more than one micro-tile */
                    a++, b++;
                } else if (there && a + 1 < start[tile + 1] && here &&
                           list[a + 1].gaussian == v->tile_list[b].gaussian)
                    extra++, a++;
                else if (here) missing++, b++;
                else extra++, a++;
            }
        }
        for (size_t g = 0; g < n; g++)
            for (uint32_t i = of[g].first; i < of[g].first + of[g].count; i++)
                wrong += i >= instances || instance[i].place >= instances ||
                         list[instance[i].place].gaussian != g ||
                         list[instance[i].place].mask != instance[i].mask;
        size_t sum = 0;
        for (size_t g = 0; g < n; g++) sum += of[g].count;
        all += bits;
        CHECK(sum == instances);
        if (!CHECK(wrong == 0 && missing + extra + other <= 1 + bits / 10000))
            printf("    scene %d, view %d: %d wrong, %d missing, %d more, %d masks differ of %d\n", which,
                   view, (int)wrong, (int)missing, (int)extra, (int)other, (int)bits);
        free(facts);
        free(instance);
        free(list);
        free(start);
        free(of);
    }
    CHECK(all > (size_t)count);
    end_shooting(&s, "bin");
}

/* What a pixel passes over adds up to max_error at most: the largest sum of any. */
static double passed_over(const ssdgs_frame *frame, const uint32_t *needed) {
    const ssdgs_splat_view *v = frame->views;
    const double threshold = pow(2, (double)gpu_log2_threshold(frame));
    double most = 0;
    for (int y = 0; y < v->height; y++)
        for (int x = 0; x < v->width; x++) {
            const int tile = y / 16 * v->tiles_x + x / 16;
            double t = 1, sum = 0;
            for (uint32_t i = v->tile_start[tile]; i < v->tile_start[tile + 1]; i++) {
                const ssdgs_record *r = v->record + v->tile_list[i].gaussian;
                const double dx = x + 0.5 - (double)r->x, dy = y + 0.5 - (double)r->y;
                const double u = (double)r->ux * dx + (double)r->uy * dy, w = (double)r->wy * dy;
                double alpha = pow(2, (double)r->log2_opacity - u * u - w * w);
                if (alpha < threshold || t < (double)frame->options.stop) continue;
                alpha = fmin(alpha, 0.999);
                sum += needed[i] ? 0 : alpha * t;
                t -= alpha * t;
            }
            most = fmax(most, sum);
        }
    return most;
}

/* From the CPU's lists: what is blended where, but for weights at the threshold; and with max_error no more
   is needed than by the CPU, which asks its micro-tiles one after the other. */
static void walk_camera(int which, int count) {
    shooting s;
    begin_shooting(&s, which, count);
    const ssdgs_splat_view *v = s.frame.views;
    gpu_view *to = &device->frame.camera;
    const size_t n = (size_t)count;
    upload_view(&s.frame, 0, to);
    device->instance_room = v->instance_room;
    spoil(&to->tile_seen, v->instances * sizeof(uint32_t));
    spoil(&to->tile_needed, v->instances * sizeof(uint32_t));
    gpu_walk_camera_view(device, &s.frame, to);
    uint32_t *blends = (uint32_t *)downloaded(&to->tile_seen, v->instances * sizeof *blends);
    uint32_t *needed = (uint32_t *)downloaded(&to->tile_needed, v->instances * sizeof *needed);
    uint32_t *seen = (uint32_t *)downloaded(&device->frame.seen, n * sizeof *seen);
    uint32_t(*tally)[2] = (uint32_t(*)[2])downloaded(&device->frame.tally, gpu_groups(n) * sizeof *tally);
    size_t other = 0, mine = 0, theirs = 0, differ = 0, wrong = 0, all = 0;
    for (size_t i = 0; i < v->instances; i++) {
        all += v->tile_seen[i] != 0;
        other += blends[i] != v->tile_seen[i];
    }
    uint32_t before = 0, skipped = UINT32_MAX;
    for (size_t g = 0; g < n; g++) {
        uint32_t is_seen = 0, is_needed = 0;
        for (uint32_t i = v->of_gaussian[g].first; i < v->of_gaussian[g].first + v->of_gaussian[g].count;
             i++) {
            is_seen |= blends[v->instance[i].place];
            is_needed |= v->tile_needed ? needed[v->instance[i].place] : blends[v->instance[i].place];
        }
        wrong += seen[g] != (uint32_t)(is_needed ? SSDGS_SEEN : is_seen ? SSDGS_SKIPPED : 0);
        mine += seen[g] == SSDGS_SEEN;
        skipped = skipped != UINT32_MAX || seen[g] != SSDGS_SKIPPED ? skipped : (uint32_t)g;
        if (g % 256 == 255 || g == n - 1) {
            wrong += tally[g / 256][0] != (uint32_t)mine - before || tally[g / 256][1] != skipped;
            before = (uint32_t)mine, skipped = UINT32_MAX;
        }
        theirs += s.frame.seen[g] == SSDGS_SEEN;
        differ += seen[g] != s.frame.seen[g];
    }
    CHECK(theirs > n / 10 && wrong == 0);
    if (!CHECK(other <= 1 + all / 2000))
        printf("    scene %d: %d of %d masks differ\n", which, (int)other, (int)all);
    if (s.options.max_error > 0) {
        const double over = passed_over(&s.frame, needed);
        if (!CHECK(mine <= theirs + theirs / 100 && mine >= theirs - theirs / 10 && mine < n &&
                   over <= 1.001 * (double)s.options.max_error && over > 0.1 * (double)s.options.max_error))
            printf("    scene %d: %d to be shaded, by the CPU %d; passed over %g\n", which, (int)mine,
                   (int)theirs, over);
    } else CHECK(differ <= 1);
    free(blends);
    free(needed);
    free(seen);
    free(tally);
    end_shooting(&s, "walk: camera");
}

/* A map's pixels say the same, but for falls at a level up to rounding. */
static size_t compare_maps(const ssdgs_frame *frame, int view, const ssdgs_light_pixel *pixel,
                           const uint32_t *map_tile, double stop) {
    const ssdgs_splat_view *v = frame->views + view;
    size_t all = 0, other = 0, falls = 0, empty = 0;
    double most = 0;
    for (size_t tile = 0; tile < gpu_tiles(v); tile++) {
        if (map_tile[tile] == UINT32_MAX || v->map_tile[tile] == UINT32_MAX) {
            empty += map_tile[tile] != v->map_tile[tile];
            continue;
        }
        for (size_t i = 0; i < 256; i++) {
            const ssdgs_light_pixel *a = pixel + 256 * (size_t)map_tile[tile] + i,
                                    *b = v->light_map + 256 * (size_t)v->map_tile[tile] + i;
            int same = 1;
            for (int l = 0; l < 3; l++) {
                const int there = b->distance[l] < (ssdgs_real)1e29;
                same = same && there == (a->distance[l] < 1e29f) &&
                       test_error((double)a->distance[l], (double)b->distance[l], 1e-6, 1e-6) <= 1;
                falls += (size_t)there;
                if (!same || !there || l == 2) continue;
                most = fmax(most, fabs((double)(a->left[l] - b->left[l])));
                if (a->distance[l + 1] < 1e29f)
                    most = fmax(most, fabs((double)(a->before[l] - b->before[l])));
            }
            all++;
            other += !same;
            if (same) most = fmax(most, fabs((double)(a->behind - b->behind)) - stop);
        }
    }
    if (!CHECK(empty == 0 && other <= 2 + all / 1000 && most < 5e-6))
        printf("    view %d: %d of %d pixels of the map fall elsewhere, else off by %.2g\n", view, (int)other,
               (int)all, most);
    return falls;
}

/* Visibility, cue, flux and the maps from the CPU's lists. Below the stop the CPU goes on to the end of its
   batch; it gives no cue to what lies in the dark alone. */
static void walk_light(int which, int count) {
    shooting s;
    begin_shooting(&s, which, count);
    const size_t n = (size_t)count;
    gpu_view *to = &device->frame.face;
    const double stop = (double)s.options.stop;
    size_t falls = 0;
    ssdgs_real *flux = (ssdgs_real *)calloc(n * (size_t)s.light_count, sizeof *flux);
    if (!flux) exit(1);
    s.frame.flux = flux;
    s.frame.maps = 1;
    CHECK(!ssdgs_stage_cpu(&s.frame, SSDGS_STAGE_WALK));
    for (int view = 1; view < s.frame.view_count; view++) {
        const ssdgs_splat_view *v = s.frame.views + view;
        upload_view(&s.frame, view, to);
        device->instance_room = v->instance_room;
        spoil(&to->tile_sums, v->instances * 4 * sizeof(float));
        gpu_walk_light_view(device, &s.frame, view, to);
        if (gpu_same_light(&s.frame, view, view + 1)) continue;
        const size_t tiles = gpu_tiles(v);
        int first = view;
        while (gpu_same_light(&s.frame, view, first - 1)) first--;
        const size_t faces = (size_t)(view - first) + 1;
        const gpu_light *light = device->frame.light + v->light;
        uint32_t *map_tile = (uint32_t *)downloaded(&light->map_tile, faces * tiles * sizeof *map_tile);
        ssdgs_light_pixel *map =
            (ssdgs_light_pixel *)downloaded(&light->light_map, faces * tiles * 256 * sizeof *map);
        for (int face = first; face <= view; face++)
            falls += compare_maps(&s.frame, face, map, map_tile + (size_t)(face - first) * tiles, stop);
        free(map_tile);
        free(map);
    }
    CHECK(falls > 1000);
    const size_t all = n * (size_t)s.light_count;
    float *visibility = (float *)downloaded(&device->frame.visibility, all * sizeof *visibility);
    float *fluxes = (float *)downloaded(&device->frame.flux, all * sizeof *fluxes);
    size_t empty = 0; /* footprints, in the dark: nothing is in their way, but the CPU does not look there */
    for (size_t i = 0; i < all; i++)
        if (stop > 0 && s.frame.visibility[i] <= 0 && visibility[i] >= 1) visibility[i] = 0, empty++;
    CHECK(empty <= 1 + all / 1000);
    CHECK_NEAR(visibility, s.frame.visibility, all, 1e-5 + 2 * stop, 0, "visibility");
    if (s.frame.depth_cue) {
        float *cue = (float *)downloaded(&device->frame.depth_cue, all * sizeof *cue);
        for (size_t i = 0; i < all; i++)
            if (stop > 0 && s.frame.depth_cue[i] <= 0) cue[i] = 0;
        CHECK_NEAR(cue, s.frame.depth_cue, all, 1e-5 + 5 * stop, 1e-5, "depth cue");
        free(cue);
    }
    double most = 0, mean = 0;
    for (size_t i = 0; i < all; i++)
        most = fmax(most, (double)flux[i]), mean += (double)visibility[i] / (double)all;
    CHECK_NEAR(fluxes, flux, all, (1e-6 + stop) * most, 1e-5, "flux");
    CHECK(mean > 0.02 && mean < 0.9);
    free(visibility);
    free(fluxes);
    free(flux);
    end_shooting(&s, "walk: light");
}

/* Pixels and layers from the CPU's colours and layers. */
static void blend(int which, int count) {
    shooting s;
    begin_shooting(&s, which, count);
    const size_t n = (size_t)count, pixels = PIXELS, layers = (size_t)s.frame.layer_count;
    gpu_frame *f = &device->frame;
    gpu_view *to = &f->camera;
    ssdgs_real *layer_pixels = (ssdgs_real *)calloc((layers + 1) * 3 * pixels, sizeof *layer_pixels);
    ssdgs_real *planes = (ssdgs_real *)calloc((size_t)s.light_count * 2 * pixels, sizeof *planes);
    if (!layer_pixels || !planes) exit(1);
    if (layers) s.frame.layer_pixels = layer_pixels;
    s.frame.pixel_visibility = planes;
    s.frame.pixel_shadow = planes + (size_t)s.light_count * pixels;
    CHECK(!ssdgs__run_stages(&s.frame, SSDGS_STAGE_SHADE, SSDGS_STAGE_COMPOSITE));
    const ssdgs_splat_view *v = s.frame.views;
    upload_view(&s.frame, 0, to);
    uint32_t *seen = (uint32_t *)malloc((v->instances + 1) * sizeof *seen);
    if (!seen) exit(1);
    for (size_t i = 0; i < v->instances; i++) seen[i] = v->tile_seen[i];
    gpu_upload(device, &to->tile_seen, seen, v->instances * sizeof *seen);
    free(seen);
    gpu_upload(device, &f->color, s.frame.color, n * 4 * sizeof(float));
    gpu_upload(device, &f->layers, s.frame.layers, layers * n * 4 * sizeof(float));
    spoil(&f->pixels, 3 * pixels * sizeof(float));
    spoil(&f->transmittance, pixels * sizeof(float));
    spoil(&f->layer_pixels, (layers + 1) * 3 * pixels * sizeof(float));
    gpu_blend_all(device, &s.frame);
    float *got = (float *)downloaded(&f->pixels, 3 * pixels * sizeof *got);
    float *transmittance = (float *)downloaded(&f->transmittance, pixels * sizeof *transmittance);
    CHECK_NEAR(got, layers ? layer_pixels : s.frame.pixels, 3 * pixels, 1e-5, 1e-5, "pixels");
    CHECK_NEAR(transmittance, s.frame.transmittance, pixels, 2e-6, 0, "transmittance");
    free(got);
    free(transmittance);
    if (layers) {
        got = (float *)downloaded(&f->layer_pixels, (layers + 1) * 3 * pixels * sizeof *got);
        CHECK_NEAR(got, layer_pixels, (layers + 1) * 3 * pixels, 1e-5, 1e-5, "blended layers");
        free(got);
    }
    free(layer_pixels);
    free(planes);
    s.frame.layer_pixels = NULL;
    end_shooting(&s, "blend");
}

/* ---- whole frames ---- */

typedef struct difference {
    double rms, most;
    int far; /* pixels off by more than a hundredth of the brightest */
} difference;

static difference between(const picture *got, const picture *want) {
    difference d = {0, 0, 0};
    double peak = 0;
    for (int i = 0; i < 3 * PIXELS; i++) peak = fmax(peak, fabs((double)want->value[i]));
    for (int i = 0; i < 3 * PIXELS; i++) {
        const double e = fabs((double)got->value[i] - (double)want->value[i]) / peak;
        d.rms += e * e / (3 * PIXELS);
        d.most = fmax(d.most, test_finite(e) ? e : 1e30);
        d.far += !(e < 0.01);
    }
    d.rms = sqrt(d.rms);
    return d;
}

/* The same on both contexts; the second frame of the GPU to the bit as the first. Where exact, alike up to
   rounding; else up to what the options allow. */
static void frame(int which, int count, int exact, double bound) {
    ssdgs_context *const own = context;
    ssdgs_context_desc desc;
    picture alpha[3];
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    device->instance_room = 50; /* too few: the stages run again */
    for (int i = 0; i < 2; i++) {
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
        ssdgs_settings settings = which == 1 ? ssdgs_settings_published() : small_settings();
        settings.scattering.width = settings.shadow.width = 16;
        ssdgs_model *model = cloud(&settings, 1000 * which, count, 1);
        ssdgs_light lights[3] = {point_light(2, 3, 4), parallel_light(0.6, -0.48, 0.64),
                                 point_light(0.1, 0.2, -0.1)};
        const ssdgs_camera camera = camera_from(3, which, 1);
        const ssdgs_render_options options =
            exact ? ssdgs_render_options_exact() : ssdgs_render_options_default();
        for (int again = 0; again <= i; again++) { /* stage by stage, then all at once */
            gpu_wait(device, i && !again);
            ssdgs_image image;
            picture *p = shot + i + again;
            memset(&image, 0, sizeof image);
            image.color = p->value;
            image.alpha = alpha[i + again].value;
            if (!CHECK(!ssdgs_render_ex(model, &camera, lights, which == 2 ? 3 : 1, &options, &image,
                                        &p->stats)))
                printf("    %s; %s\n", ssdgs_error_message(context), device->message);
        }
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
    context = own;
    const difference d = between(shot + 1, shot);
    printf("frame %d of %d, %s: off by %.2g in the mean, %.2g at most, shaded %d and %d\n", which, count,
           exact ? "exact" : "default", d.rms, d.most, shot[1].stats.shaded, shot[0].stats.shaded);
    CHECK(d.rms < bound && d.far <= 3 * PIXELS / 1000);
    CHECK_NEAR(alpha[1].value, alpha[0].value, PIXELS, exact ? 1e-4 : 2e-3, 0, "alpha");
    CHECK(!memcmp(shot[1].value, shot[2].value, 3 * PIXELS * sizeof(ssdgs_real)));
    CHECK(abs(shot[1].stats.visible - shot[0].stats.visible) <= 1 && shot[1].stats.visible > count / 2);
    CHECK(abs(shot[1].stats.shaded - shot[0].stats.shaded) <= 1 + shot[0].stats.shaded / 10);
    CHECK(shot[1].stats.instances > 0 && shot[1].stats.light_instances > 0);
}

/* What the backend leaves to the CPU is the CPU's to the bit: several objects, one that is turned, moved,
   tinted or rougher, components. */
static void left_to_the_cpu(void) {
    enum { CASES = 6 };
    static picture pictures[2][CASES];
    ssdgs_context *const own = context;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    for (int i = 0; i < 2; i++) {
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, &context) && !ssdgs_scene_create(context, &scene))) exit(1);
        const ssdgs_settings settings = small_settings();
        ssdgs_model *model = cloud(&settings, 0, 200, 0.5);
        const ssdgs_light light = point_light(2, 3, 4);
        const ssdgs_camera camera = camera_from(3, 0, 1);
        for (int c = 0; c < CASES; c++) {
            ssdgs_object objects[2] = {ssdgs_object_default(model), placed(model, 1, 1, 0, 0.5, 0.2, 0)};
            picture *p = pictures[i] + c;
            ssdgs_image image = planes_of(p);
            if (c)
                image.diffuse = image.specular = image.scattering = image.normal = image.depth =
                    image.shadow = NULL;
            if (c == 1) objects[0] = placed(model, 1, 1, 0, 0, 0, 0);
            if (c == 2) objects->to_world[3] = (ssdgs_real)0.1;
            if (c == 3) objects->tint[1] = (ssdgs_real)0.5;
            if (c == 4) objects->roughness = 2;
            CHECK(!ssdgs_scene_render(scene, objects, c == 5 ? 2 : 1, &camera, &light, 1, NULL, &image,
                                      &p->stats));
        }
        ssdgs_model_destroy(model);
        ssdgs_scene_destroy(scene);
        ssdgs_context_destroy(context);
    }
    context = own;
    for (int c = 0; c < CASES; c++) CHECK(same(pictures[0] + c, pictures[1] + c));
}

/* A trained model from two sides, under one light, then under two and the sky. */
static void trained(const char *path, int exact) {
    enum { WIDE = 120, TALL = 90, VIEWS = 2 };
    ssdgs_context *contexts[2] = {NULL, NULL};
    ssdgs_model *models[2] = {NULL, NULL};
    const ssdgs_gpu_hook hook = gpu_hook(device);
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    for (int i = 0; i < 2; i++) {
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, contexts + i)) ||
            !CHECK(!ssdgs_model_load(contexts[i], path, models + i, NULL)))
            exit(1);
    }
    double least = 200;
    for (int view = 0; view < VIEWS; view++) {
        const ssdgs_real eye[3] = {(ssdgs_real)(2 * cos(2.1 * view)), (ssdgs_real)(2 * sin(2.1 * view)), 1},
                         target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
        const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, WIDE, TALL);
        ssdgs_render_options options = exact ? ssdgs_render_options_exact() : ssdgs_render_options_default();
        const ssdgs_light lights[2] = {point_light(2, 1, 2), parallel_light(-0.6, 0, 0.8)};
        static ssdgs_real color[2][WIDE * TALL * 3];
        double square = 0, peak = 0;
        options.ambient[0][1] = (ssdgs_real)(0.5 * view);
        for (int i = 0; i < 2; i++) {
            ssdgs_image image;
            memset(&image, 0, sizeof image);
            image.color = color[i];
            CHECK(!ssdgs_render_ex(models[i], &camera, lights, 1 + view, &options, &image, NULL));
        }
        for (int i = 0; i < WIDE * TALL * 3; i++) {
            const double a = (double)color[1][i], b = (double)color[0][i];
            peak = fmax(peak, b);
            square += (a - b) * (a - b) / (WIDE * TALL * 3);
        }
        CHECK(test_finite(square));
        least = fmin(least, 10 * log10(peak * peak / square));
    }
    printf("%s, %s: %.1f dB from the CPU's\n", path, exact ? "exact" : "default", least);
    CHECK(least > 60);
    for (int i = 0; i < 2; i++) {
        ssdgs_model_destroy(models[i]);
        ssdgs_context_destroy(contexts[i]);
    }
}

/* Frames in turn, of which some keep what the last one has found, of two models, one of them now and then
   with parts that the CPU draws: as the CPU's alone, and as much kept. */
static void kept(void) {
    enum { FRAMES = 14 };
    static picture pictures[2][FRAMES];
    ssdgs_context *const own = context;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    device->instance_room = 100; /* so that it grows under way */
    for (int i = 0; i < 2; i++) {
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
        const ssdgs_settings settings = small_settings();
        ssdgs_model *models[2] = {cloud(&settings, 0, 300, 0.5), cloud(&settings, 5000, 200, 0.4)};
        for (int f = 0; f < FRAMES; f++) {
            /* camera, first and second light, lights, model; parts are frame 5's and 12's */
            static const int scenes[FRAMES][5] = {
                {0, 0, 0, 2, 0}, {0, 0, 0, 2, 0}, {1, 0, 0, 2, 0}, {1, 1, 0, 2, 0}, {1, 1, 0, 2, 0},
                {1, 1, 0, 2, 0}, {1, 1, 0, 2, 0}, {1, 1, 1, 2, 0}, {1, 1, 1, 1, 1}, {1, 1, 1, 2, 0},
                {1, 1, 1, 3, 0}, {1, 1, 1, 3, 0}, {1, 1, 1, 3, 0}, {2, 1, 1, 3, 0}};
            const int *scene_of = scenes[f];
            ssdgs_light lights[3] = {point_light(2, 3 - scene_of[1], 4), parallel_light(0.6, -0.48, 0.64),
                                     point_light(-2, 1, 2 + scene_of[2])};
            for (int c = 0; c < 3; c++) lights[2].direction[c] = (ssdgs_real)(c == 1 ? -0.6 : c ? -0.8 : 0);
            lights[2].focus = 3;
            if (scene_of[3] == 2) lights[1] = lights[2];
            if (f == 4) lights[0].intensity[0] *= 2;
            const ssdgs_camera camera = camera_from(2, 0.3 * scene_of[0], 1);
            picture *p = pictures[i] + f;
            ssdgs_image image = planes_of(p);
            if (f != 5 && f != 12)
                image.diffuse = image.specular = image.scattering = image.normal = image.depth =
                    image.shadow = NULL;
            if (!CHECK(!ssdgs_render_ex(models[scene_of[4]], &camera, lights, scene_of[3], NULL, &image,
                                        &p->stats)))
                printf("    %s\n", ssdgs_error_message(context));
        }
        for (int m = 0; m < 2; m++) ssdgs_model_destroy(models[m]);
        ssdgs_context_destroy(context);
    }
    context = own;
    for (int f = 0; f < FRAMES; f++) {
        const ssdgs_render_stats *got = &pictures[1][f].stats, *want = &pictures[0][f].stats;
        const difference d = between(pictures[1] + f, pictures[0] + f);
        const int anew = f == 5 || f == 6 || f == 12 || f == 13 || f == 9; /* in other memory than the last */
        if (!CHECK(d.rms < 1e-3 && d.far <= 3 * PIXELS / 1000)) printf("    frame %d: %g\n", f, d.rms);
        if (!anew &&
            !CHECK(got->camera_cached == want->camera_cached && got->lights_cached == want->lights_cached))
            printf("    frame %d: kept %d and %d, not %d and %d\n", f, got->camera_cached, got->lights_cached,
                   want->camera_cached, want->lights_cached);
        if (anew) CHECK(!got->camera_cached);
        CHECK(got->gaussians == want->gaussians && abs(got->shaded - want->shaded) <= 1 + want->shaded / 10);
    }
    CHECK(pictures[0][1].stats.camera_cached && pictures[0][4].stats.lights_cached == 2);
    CHECK(!memcmp(pictures[1][0].value, pictures[1][1].value, 3 * PIXELS * sizeof(ssdgs_real)));
    CHECK(memcmp(pictures[1][3].value, pictures[1][4].value, 3 * PIXELS * sizeof(ssdgs_real)) != 0);
}

/* With another transport_detail, from where other Gaussians are seen, what is kept of transport is to the bit
   what a device has that has drawn nothing before. */
static void kept_transport(void) {
    static picture pictures[2];
    ssdgs_context *const own = context;
    const ssdgs_settings settings = small_settings();
    const ssdgs_light light = point_light(2, 3, 4);
    ssdgs_render_options options = ssdgs_render_options_default();
    for (int i = 0; i < 2; i++) {
        ssdgs_context_desc desc;
        ssdgs_image image;
        char message[256] = "";
        gpu *const g = gpu_create(message, sizeof message);
        if (!CHECK(g != NULL)) return;
        const ssdgs_gpu_hook hook = gpu_hook(g);
        memset(&desc, 0, sizeof desc);
        memset(&image, 0, sizeof image);
        desc.gpu = &hook;
        image.color = pictures[i].value;
        if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
        ssdgs_model *model = cloud(&settings, 0, 3000, 1);
        CHECK(!ssdgs_model_sort(model));
        for (int f = i ? 3 : 0; f < 4; f++) { /* two details, two cameras */
            const ssdgs_camera camera = camera_from(2, f / 2 * 0.3, 1);
            options.transport_detail = (ssdgs_real)(f ? 8 : 0.1);
            CHECK(!ssdgs_render_ex(model, &camera, &light, 1, &options, &image, NULL));
        }
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
        gpu_destroy(g);
    }
    context = own;
    CHECK(!memcmp(pictures[0].value, pictures[1].value, 3 * PIXELS * sizeof(ssdgs_real)));
}

/* ---- failures ---- */

static uint32_t full(void) { return GPU_GL_OUT_OF_MEMORY; }

/* A device that fails ends the frame with a message; later frames are the CPU's, to the bit. */
static void failures(void) {
    static picture pictures[3];
    ssdgs_context *const own = context;
    for (int way = 0; way < 2; way++) {
        char message[256] = "";
        gpu *const g = gpu_create(message, sizeof message);
        if (!CHECK(g != NULL)) return;
        const ssdgs_gpu_hook hook = gpu_hook(g);
        const ssdgs_settings settings = small_settings();
        const ssdgs_light light = point_light(2, 3, 4);
        const ssdgs_camera camera = camera_from(2, 0, 1);
        for (int i = 0; i < 2; i++) {
            ssdgs_context_desc desc;
            memset(&desc, 0, sizeof desc);
            desc.gpu = i ? &hook : NULL;
            if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
            ssdgs_model *model = cloud(&settings, 0, 200, 0.5);
            ssdgs_image image;
            memset(&image, 0, sizeof image);
            image.color = pictures[i].value;
            CHECK(!ssdgs_render(model, &camera, &light, 1, &image));
            image.color = pictures[2].value;
            void *const lost = g->egl.context;
            if (i && way) g->gl.GetError = full;
            if (i && !way) g->egl.context = &message;
            const ssdgs_result result = ssdgs_render(model, &camera, &light, 1, &image);
            CHECK(result == (!i ? SSDGS_OK : way ? SSDGS_ERR_MEMORY : SSDGS_ERR_ISA));
            if (i && !CHECK(strstr(ssdgs_error_message(context),
                                   way ? "memory is full" : "context is lost") != NULL))
                printf("    %s\n", ssdgs_error_message(context));
            for (int again = 0; again < 2; again++) {
                memset(&pictures[2], 0, sizeof pictures[2]);
                CHECK(!ssdgs_render(model, &camera, &light, 1, &image));
                if (i) CHECK(!memcmp(pictures[0].value, pictures[2].value, 3 * PIXELS * sizeof(ssdgs_real)));
            }
            g->egl.context = lost;
            ssdgs_model_destroy(model);
            ssdgs_context_destroy(context);
        }
        gpu_destroy(g);
    }
    context = own;
}

/* Without any driver there is a message; this must be asked before EGL has looked for drivers. */
static void without_drivers(void) {
    const pid_t child = fork();
    if (!child) {
        char message[256] = "";
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", 1);
        const gpu *g = gpu_create(message, sizeof message);
        _exit(g ? !message[0] ? 0 : 1 : strstr(message, "no GPU: there is no") ? 0 : 1);
    }
    int status = 1;
    CHECK(child > 0 && waitpid(child, &status, 0) == child && status == 0);
}

/* A picture and light maps of one tile, 16 pixels a side. */
static void one_tile(void) {
    ssdgs_context *const own = context;
    static ssdgs_real color[2][16 * 16 * 3];
    const ssdgs_gpu_hook hook = gpu_hook(device);
    for (int i = 0; i < 2; i++) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
        ssdgs_settings settings = small_settings();
        settings.light_map.size = 16;
        ssdgs_model *model = cloud(&settings, 0, 300, 1);
        ssdgs_camera camera = camera_from(3, 0, 1);
        const ssdgs_light light = point_light(2, 3, 4);
        const ssdgs_render_options options = ssdgs_render_options_exact();
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        image.color = color[i];
        camera.width = camera.height = 16;
        camera.fx /= 4, camera.fy /= 4, camera.cx /= 4, camera.cy /= 4;
        CHECK(!ssdgs_render_ex(model, &camera, &light, 1, &options, &image, NULL));
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
    context = own;
    double light = 0, worst = 0;
    for (int i = 0; i < 16 * 16 * 3; i++) {
        light = fmax(light, (double)color[0][i]);
        worst = test_most(worst, fabs((double)(color[1][i] - color[0][i])));
    }
    if (!CHECK(light > 0.01 && worst < 1e-3 * light)) printf("    off by %g of %g\n", worst, light);
}

int main(void) {
    char message[256] = "";
    without_drivers();
    device = gpu_create(message, sizeof message);
    if (!CHECK(device != NULL)) printf("%s\n", message);
    if (!CHECK(!ssdgs_context_create(NULL, &context))) return 1;
    if (device) {
        platform();
        shades();
        trained("examples/data/waxcow.ply", 1);
        trained("examples/data/waxcow.ply", 0);
        sort_nothing();
        one_tile();
        left_to_the_cpu();
        kept();
        kept_transport();
        failures();
        for (int which = 0; which < 3; which++) {
            project(which, which ? 500 : 3000);
            sort(which, which ? 500 : 5000);
            bin(which, which ? 500 : 3000);
            walk_camera(which, which ? 500 : 3000);
            walk_light(which, which ? 500 : 3000);
            blend(which, which ? 500 : 3000);
            frame(which, which ? 500 : 2000, 1, 1e-4);
            frame(which, which ? 500 : 2000, 0, 3e-3);
        }
    }
    gpu_destroy(device);
    ssdgs_context_destroy(context);
    TEST_END();
}
