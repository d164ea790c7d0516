/* The GPU's stages (examples/gpu/gpu_gl.c), each alone and whole frames, against the CPU's. Not one of `make
   test`: it needs EGL with OpenGL 4.3, and Mesa's software renderer does. `t_gpu full` changes scenes
   more often. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/gpu/gpu_gl.c"
#include "scene.h"
#include <sys/wait.h>
#include <unistd.h>

static gpu *device;

/* ---- SHADE and COMPOSITE ---- */

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

/* A frame's views are all at work. */
static gpu_set *all_at_work(const ssdgs_frame *frame) {
    uint32_t views[GPU_VIEWS];
    for (int i = 0; i < frame->view_count; i++) views[i] = (uint32_t)i;
    gpu_enter(device);
    gpu_set_frame(device, frame);
    gpu_set_work(device, frame, views, frame->view_count);
    return &device->frame.camera;
}

/* What SHADE finds: seen, and of 64 at a time how many are and the first that is skipped. */
static void upload_seen(const uint32_t *seen, size_t n) {
    const size_t groups = (n + 63) / 64;
    uint32_t(*tally)[2] = (uint32_t(*)[2])malloc(groups * sizeof *tally);
    for (size_t i = 0; i < groups; i++) tally[i][0] = 0, tally[i][1] = UINT32_MAX;
    for (size_t i = n; i--;) {
        tally[i / 64][0] += seen[i] == SSDGS_SEEN;
        if (seen[i] == SSDGS_SKIPPED) tally[i / 64][1] = (uint32_t)i;
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
    gpu_frame *f = &device->frame;
    uint32_t *seen = (uint32_t *)malloc(n * sizeof *seen);
    all_at_work(frame);
    for (size_t i = 0; i < n; i++) seen[i] = frame->seen[i];
    upload_seen(seen, n);
    gpu_upload(device, &f->visibility, frame->visibility, all);
    if (frame->depth_cue) gpu_upload(device, &f->depth_cue, frame->depth_cue, all);
    if (frame->flux) gpu_upload(device, &f->flux, frame->flux, all);
    gpu_upload(device, &f->camera.depth, frame->views[0].depth, n * sizeof(float));
    for (int i = 0; i < GPU_LAMPS; i++) f->light[i].ready = 0;
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
    uint32_t *shaded = (uint32_t *)malloc((n + 65) * sizeof *shaded),
             *seen = (uint32_t *)malloc(n * sizeof *seen);
    for (size_t i = 0; i < n && skip_all; i++)
        if (frame.seen[i]) frame.seen[i] = SSDGS_SKIPPED;
    upload_walk(&frame);
    gpu_shade(device, &frame);
    gpu_download(device, &device->frame.layers, color, size);
    gpu_download_at(device, &device->frame.layers, size, layers, size * (size_t)frame.layer_count);
    gpu_download(device, &device->frame.shaded, shaded, ((n + 63) / 64 * 64 + 1) * sizeof *shaded);
    gpu_download(device, &device->frame.seen, seen, n * sizeof *seen);
    if (!test_check(!gpu_leave(device, "shade"), __FILE__, __LINE__, name))
        printf("    %s\n", device->message);
    CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_SHADE));
    int other = 0;
    for (size_t i = 0; i < n; i++) other += seen[i] != frame.seen[i];
    CHECK(!other);
    if (CHECK(shaded[0] == ((uint32_t)frame.shaded_count + 63) / 64 * 64))
        CHECK(!memcmp(shaded + 1, frame.shaded, (size_t)frame.shaded_count * sizeof *shaded));
    for (uint32_t i = (uint32_t)frame.shaded_count; i < shaded[0]; i++) other += shaded[1 + i] != UINT32_MAX;
    CHECK(!other);
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

/* The list of what is seen, and the neighbours of what is skipped, of objects with more than one group can
   add up at once, with a few, with all skipped, with none. */
static void seen_list(void) {
    enum { OBJECTS = 6, MANY = 70001 + 64 * 200 + 4 * 64 };
    static const int counts[OBJECTS] = {130, 1, 70001, 64, 200, 77};
    static uint32_t seen[MANY], shaded[MANY + 65], neighbours[MANY], of[MANY / 64 + 4];
    uint32_t at = 1, wrong = 0, first = 0;
    gpu_frame *f = &device->frame;
    gpu_parameters *p = &device->p;
    gpu_enter(device);
    gpu_reserve_tables(device, OBJECTS);
    for (int o = 0; o < OBJECTS; o++) {
        device->tables->objects[o].place[0] = (int32_t)first;
        device->tables->objects[o].place[1] = counts[o];
        for (uint32_t i = 0; i < (uint32_t)counts[o]; i++) {
            const uint32_t any = i < 10 ? i & 2 : (uint32_t)(3 * draw(first + i));
            seen[first + i] = o == 3 ? 2 : o == 5 ? 0 : any;
            of[(first + i) / 64] = (uint32_t)o;
        }
        p->count = first + (uint32_t)counts[o];
        first = (p->count + 63) / 64 * 64;
    }
    p->blocks = (p->count + 63) / 64;
    p->object_count = OBJECTS;
    p->layers = 0;
    gpu_upload_tables(device);
    gpu_write_anew(device, &f->object_of, of, sizeof of);
    upload_seen(seen, p->count);
    const gpu_buffer *const buffers[] = {&f->seen,       &f->tally,  &f->of_object, &f->shaded,
                                         &f->neighbours, &f->layers, &f->ahead,     NULL};
    gpu_reserve(device, &f->facts, (GPU_VIEWS + GPU_TOTALS) * sizeof(gpu_fact));
    gpu_reserve(device, &f->shaded, sizeof shaded);
    gpu_reserve(device, &f->neighbours, sizeof neighbours);
    gpu_reserve(device, &f->of_object, OBJECTS * 2 * sizeof(uint32_t));
    gpu_reserve(device, &f->ahead, p->blocks * sizeof(uint32_t));
    gpu_run(device, GPU_SEEN_OBJECTS, p, buffers, OBJECTS);
    gpu_run(device, GPU_SEEN_LIST, p, buffers, gpu_groups(p->count));
    gpu_download(device, &f->shaded, shaded, sizeof shaded);
    gpu_download(device, &f->neighbours, neighbours, p->count * sizeof *neighbours);
    CHECK(!gpu_leave(device, "seen"));
    for (int o = 0; o < OBJECTS; o++) {
        const uint32_t from = (uint32_t)device->tables->objects[o].place[0], begin = at;
        if (o == 3) seen[from] = SSDGS_SEEN; /* some colour is needed */
        for (uint32_t i = from; i < from + (uint32_t)counts[o]; i++) {
            wrong += seen[i] == SSDGS_SEEN && shaded[at] != i;
            wrong += seen[i] == SSDGS_SKIPPED && neighbours[i] + 1 != (at > begin ? at - 1 : at);
            wrong += seen[i] != SSDGS_SKIPPED && neighbours[i] != UINT32_MAX;
            at += seen[i] == SSDGS_SEEN;
        }
        for (; (at - 1) % 64; at++) wrong += shaded[at] != UINT32_MAX;
    }
    CHECK(shaded[0] == at - 1 && !wrong);
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

/* Lists of all views, one after the other, as the device has them. */
static void upload_views(const ssdgs_frame *frame, gpu_set *to) {
    const size_t n = (size_t)frame->count, slots = (size_t)frame->view_count;
    size_t instances = 0, rooms = 0, tiles = 0, instance = 0, room = 0, tile = 0;
    for (const ssdgs_splat_view *v = frame->views; v < frame->views + slots; v++)
        instances += v->instances, rooms += v->instance_room, tiles += (size_t)gpu_tiles(v);
    ssdgs_record *record = (ssdgs_record *)malloc(slots * n * sizeof *record);
    float *depth = (float *)malloc(slots * n * sizeof *depth);
    uint32_t *order = (uint32_t *)malloc(slots * n * sizeof *order);
    ssdgs_instances *of = (ssdgs_instances *)malloc(slots * n * sizeof *of);
    ssdgs_instance *in = (ssdgs_instance *)malloc((rooms + 1) * sizeof *in);
    ssdgs_tile_entry *list = (ssdgs_tile_entry *)malloc((instances + 1) * sizeof *list);
    uint32_t *start = (uint32_t *)malloc((tiles + 1) * sizeof *start);
    gpu_fact *facts = (gpu_fact *)calloc(GPU_VIEWS + GPU_TOTALS, sizeof *facts);
    if (!record || !depth || !order || !of || !in || !list || !start || !facts) exit(1);
    for (size_t s = 0; s < slots; s++) {
        const ssdgs_splat_view *v = frame->views + s;
        size_t at = (size_t)v->visible;
        memcpy(record + s * n, v->record, n * sizeof *record);
        memcpy(depth + s * n, v->depth, n * sizeof *depth);
        memcpy(order + s * n, v->order, at * sizeof *order);
        for (size_t i = 0; i < n; i++) /* what is not drawn behind what is, as SORT does */
            if (!(v->depth[i] >= 0)) order[s * n + at++] = (uint32_t)i;
        CHECK(at == n);
        for (size_t i = 0; i < n; i++) {
            of[s * n + i] = v->of_gaussian[i];
            of[s * n + i].first += (uint32_t)room;
        }
        for (size_t i = 0; i < v->instance_room; i++) {
            in[room + i] = v->instance[i];
            in[room + i].place += (uint32_t)instance;
        }
        memcpy(list + instance, v->tile_list, v->instances * sizeof *list);
        for (int i = 0; i < gpu_tiles(v); i++) start[tile++] = (uint32_t)instance + v->tile_start[i];
        instance += v->instances;
        room += v->instance_room;
        facts[s].visible = (uint32_t)v->visible;
        facts[s].instances = (uint32_t)v->instances;
        facts[s].nearest = (float)v->nearest;
    }
    start[tiles] = (uint32_t)instances;
    device->instance_room = rooms + 100;
    gpu_upload(device, &device->frame.facts, facts, (GPU_VIEWS + GPU_TOTALS) * sizeof *facts);
    gpu_upload(device, &to->record, record, slots * n * sizeof *record);
    gpu_upload(device, &to->depth, depth, slots * n * sizeof *depth);
    gpu_upload(device, &to->order, order, slots * n * sizeof *order);
    gpu_upload(device, &to->of_gaussian, of, slots * n * sizeof *of);
    gpu_upload(device, &to->instance, in, rooms * sizeof *in);
    gpu_upload(device, &to->tile_list, list, instances * sizeof *list);
    gpu_upload(device, &to->tile_start, start, (tiles + 1) * sizeof *start);
    free(record), free(depth), free(order), free(of), free(in), free(list), free(start), free(facts);
}

/* The lights' maps, from the CPU. */
static void upload_maps(const ssdgs_frame *frame) {
    for (int i = 1; i < frame->view_count; i++) {
        const ssdgs_splat_view *v = frame->views + i;
        const size_t at = (size_t)device->tables->views[i].of[1], tile = 256 * sizeof(ssdgs_light_pixel);
        for (size_t t = 0; v->light_map && t < (size_t)gpu_tiles(v); t++) {
            const ssdgs_light_pixel empty = {{-1, 0, 0}, {0, 0}, {0, 0}, 0};
            const int nothing = v->map_tile[t] == UINT32_MAX;
            gpu_write(device, &device->frame.maps.buffer, (at + t) * tile,
                      nothing ? &empty : v->light_map + 256 * (size_t)v->map_tile[t],
                      nothing ? sizeof empty : tile);
        }
    }
}

/* Pixels, with their parts, from the CPU's lists, colours, layers and maps. */
static void composite(const ssdgs_settings *settings, const ssdgs_light *lights, int light_count,
                      const char *name) {
    const ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_model *model = cloud(settings, 0, 300, 0.5);
    ssdgs_frame frame;
    const int parts = settings->asg == SSDGS_ASG_DEFERRED;
    begin(&frame, model, lights, light_count, &options, parts, SSDGS_STAGE_COMPOSITE);
    const size_t n = (size_t)frame.count, layers = (size_t)frame.layer_count + 1,
                 size = PIXELS * sizeof(float), planes = gpu_planes(&frame);
    float *layer = (float *)malloc(layers * n * 4 * sizeof *layer), *got = (float *)malloc(planes * size);
    gpu_set *set = all_at_work(&frame);
    upload_views(&frame, set);
    upload_maps(&frame);
    uint32_t *seen = (uint32_t *)malloc((frame.views->instances + 1) * sizeof *seen);
    for (size_t i = 0; i < frame.views->instances; i++) seen[i] = frame.views->tile_seen[i];
    gpu_upload(device, &set->tile_seen, seen, frame.views->instances * sizeof *seen);
    memcpy(layer, frame.color, n * 4 * sizeof *layer);
    if (parts) memcpy(layer + 4 * n, frame.layers, (layers - 1) * n * 4 * sizeof *layer);
    gpu_upload(device, &device->frame.layers, layer, layers * n * 4 * sizeof *layer);
    spoil(&device->frame.planes, planes * size);
    gpu_composite(device, &frame);
    gpu_download(device, &device->frame.planes, got, planes * size);
    if (!test_check(!gpu_leave(device, "composite"), __FILE__, __LINE__, name))
        printf("    %s\n", device->message);
    compare_pixels(&frame, got, frame.pixels, 3, name);
    CHECK_NEAR(got + 3 * PIXELS, frame.transmittance, PIXELS, 2e-6, 0, "transmittance");
    if (parts) {
        const float *part = got + 5 * PIXELS;
        CHECK_NEAR(part, frame.layer_pixels, 3 * layers * PIXELS, 1e-5, 1e-5, "blended layers");
        part += 3 * layers * PIXELS;
        compare_pixels(&frame, part, frame.pixel_visibility, light_count, name);
        compare_pixels(&frame, part + light_count * PIXELS, frame.pixel_shadow, light_count, name);
    }
    free(seen), free(layer), free(got);
    ssdgs_model_destroy(model);
}

static void all_composites(const ssdgs_light *lights) {
    ssdgs_settings settings = small_settings();
    ssdgs_light inside = point_light(0.1, 0.1, -0.1);
    composite(&settings, lights, LIGHTS, "highlights");
    composite(&settings, lights, 3, "three lights");
    composite(&settings, &inside, 1, "highlights from within");
    settings.light_map.bias = (ssdgs_real)0.5;
    composite(&settings, lights, LIGHTS, "highlights, a wide bias");
    settings.shadow.layers = 0;
    composite(&settings, lights, 2, "highlights, no shadow network");
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
    composite(&settings, lights, 2, "highlights without shadow");
    settings = ssdgs_settings_published();
    settings.scattering.width = settings.shadow.width = 16;
    composite(&settings, lights, 1, "colours alone");
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
    all_composites(lights);
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
    gpu_set *set; /* of all views */
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
    s->set = all_at_work(&s->frame);
}

static void end_shooting(shooting *s, const char *name) {
    if (!CHECK(!gpu_leave(device, name))) printf("    %s: %s\n", name, device->message);
    ssdgs_model_destroy(s->model);
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
    gpu_project(device, s.set);
    const size_t slots = (size_t)s.frame.view_count;
    ssdgs_record *records =
        (ssdgs_record *)downloaded(&s.set->record, slots * (size_t)count * sizeof *records);
    float *depths = (float *)downloaded(&s.set->depth, slots * (size_t)count * sizeof *depths);
    for (int view = 0; view < s.frame.view_count; view++) {
        const ssdgs_splat_view *v = s.frame.views + view;
        const ssdgs_record *record = records + view * count;
        const float *depth = depths + view * count;
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
    }
    free(records);
    free(depths);
    CHECK(all > count / 2);
    end_shooting(&s, "project");
}

/* From the CPU's depths: the same order, to the last tie. */
static void sort(int which, int count) {
    shooting s;
    int all = 0;
    begin_shooting(&s, which, count);
    const size_t slots = (size_t)s.frame.view_count, n = (size_t)count;
    float *depth = (float *)malloc(slots * n * sizeof *depth);
    if (!depth) exit(1);
    for (size_t view = 0; view < slots; view++) {
        ssdgs_splat_view *v = s.frame.views + view;
        for (int i = 3; i < count; i += 7) v->depth[i] = v->depth[i - 3]; /* ties */
        memcpy(depth + view * n, v->depth, n * sizeof *depth);
    }
    CHECK(!ssdgs_stage_cpu(&s.frame, SSDGS_STAGE_SORT));
    gpu_upload(device, &s.set->depth, depth, slots * n * sizeof *depth);
    gpu_sort(device, s.set);
    uint32_t *order = (uint32_t *)downloaded(&s.set->order, slots * n * sizeof *order);
    for (size_t view = 0; view < slots; view++) {
        const ssdgs_splat_view *v = s.frame.views + view;
        all += v->visible;
        CHECK(!memcmp(order + view * n, v->order, (size_t)v->visible * sizeof *order));
    }
    free(order);
    free(depth);
    CHECK(all > count / 2);
    end_shooting(&s, "sort");
}

/* Where nothing is drawn. */
static void sort_nothing(void) {
    shooting s;
    begin_shooting(&s, 0, 300);
    const size_t slots = (size_t)s.frame.view_count;
    float *depth = (float *)malloc(slots * 300 * sizeof *depth);
    if (!depth) exit(1);
    for (size_t i = 0; i < slots * 300; i++) depth[i] = -1;
    gpu_reserve(device, &s.set->record, slots * 300 * sizeof(ssdgs_record));
    gpu_upload(device, &s.set->depth, depth, slots * 300 * sizeof(float));
    gpu_sort(device, s.set);
    device->instance_room = 100;
    spoil(&device->frame.facts, (GPU_VIEWS + GPU_TOTALS) * sizeof(gpu_fact));
    gpu_bin(device, s.set);
    gpu_fact *facts = (gpu_fact *)downloaded(&device->frame.facts, (GPU_VIEWS + GPU_TOTALS) * sizeof *facts);
    for (size_t i = 0; i < slots; i++)
        CHECK(facts[i].visible == 0 && facts[i].instances == 0 && facts[i].nearest <= 0 &&
              facts[i].nearest >= 0);
    CHECK(facts[GPU_VIEWS].instances == 0);
    free(facts);
    free(depth);
    const size_t tiles = device->p.tiles;
    uint32_t *start = (uint32_t *)downloaded(&s.set->tile_start, (tiles + 1) * sizeof *start);
    ssdgs_instances *of = (ssdgs_instances *)downloaded(&s.set->of_gaussian, slots * 300 * sizeof *of);
    uint32_t any = 0;
    for (size_t i = 0; i <= tiles; i++) any |= start[i];
    for (size_t i = 0; i < slots * 300; i++) any |= of[i].count;
    CHECK(!any);
    free(start);
    free(of);
    end_shooting(&s, "nothing");
}

/* From the CPU's records and order: the same lists, but for entries whose exponent is at the threshold up to
   rounding. Then every instance must be in its place. */
static void bin(int which, int count) {
    shooting s;
    size_t all = 0;
    begin_shooting(&s, which, count);
    upload_views(&s.frame, s.set);
    const size_t slots = (size_t)s.frame.view_count, n = (size_t)count;
    spoil(&s.set->tile_start, ((size_t)device->p.tiles + 1) * sizeof(uint32_t));
    spoil(&device->frame.facts, (GPU_VIEWS + GPU_TOTALS) * sizeof(gpu_fact));
    gpu_bin(device, s.set);
    gpu_fact *facts = (gpu_fact *)downloaded(&device->frame.facts, (GPU_VIEWS + GPU_TOTALS) * sizeof *facts);
    const size_t instances = facts[GPU_VIEWS].instances;
    ssdgs_instance *instance =
        (ssdgs_instance *)downloaded(&s.set->instance, instances * sizeof(ssdgs_instance));
    ssdgs_tile_entry *list =
        (ssdgs_tile_entry *)downloaded(&s.set->tile_list, instances * sizeof(ssdgs_tile_entry));
    uint32_t *starts =
        (uint32_t *)downloaded(&s.set->tile_start, ((size_t)device->p.tiles + 1) * sizeof(uint32_t));
    ssdgs_instances *ofs = (ssdgs_instances *)downloaded(&s.set->of_gaussian, slots * n * sizeof *ofs);
    for (size_t view = 0, first_tile = 0, counted = 0; view < slots; view++) {
        const ssdgs_splat_view *v = s.frame.views + view;
        const size_t tiles = (size_t)gpu_tiles(v);
        const uint32_t *start = starts + first_tile;
        const ssdgs_instances *of = ofs + view * n;
        CHECK(facts[view].visible == (uint32_t)v->visible);
        CHECK(!memcmp(&facts[view].nearest, &v->nearest, sizeof v->nearest));
        size_t missing = 0, extra = 0, bits = 0, other = 0,
               wrong = start[0] != counted || start[tiles] != counted + facts[view].instances;
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
        CHECK(sum == facts[view].instances);
        counted += sum;
        first_tile += tiles;
        if (!CHECK(wrong == 0 && missing + extra + other <= 1 + bits / 10000))
            printf("    scene %d, view %d: %d wrong, %d missing, %d more, %d masks differ of %d\n", which,
                   (int)view, (int)wrong, (int)missing, (int)extra, (int)other, (int)bits);
    }
    free(facts);
    free(instance);
    free(list);
    free(starts);
    free(ofs);
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
    gpu_set *to = s.set;
    const size_t n = (size_t)count, groups = (n + 63) / 64;
    upload_views(&s.frame, to);
    spoil(&to->tile_seen, v->instances * sizeof(uint32_t));
    spoil(&to->tile_needed, v->instances * sizeof(uint32_t));
    gpu_walk_camera(device, to);
    uint32_t *blends = (uint32_t *)downloaded(&to->tile_seen, v->instances * sizeof *blends);
    uint32_t *needed = (uint32_t *)downloaded(&to->tile_needed, v->instances * sizeof *needed);
    uint32_t *seen = (uint32_t *)downloaded(&device->frame.seen, n * sizeof *seen);
    uint32_t(*tally)[2] = (uint32_t(*)[2])downloaded(&device->frame.tally, groups * sizeof *tally);
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
        if (g % 64 == 63 || g == n - 1) {
            wrong += tally[g / 64][0] != (uint32_t)mine - before || tally[g / 64][1] != skipped;
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
static size_t compare_maps(const ssdgs_frame *frame, int view, const ssdgs_light_pixel *pixel, double stop) {
    const ssdgs_splat_view *v = frame->views + view;
    size_t all = 0, other = 0, falls = 0, empty = 0;
    double most = 0;
    for (size_t tile = 0; tile < (size_t)gpu_tiles(v); tile++) {
        const int nothing = pixel[256 * tile].distance[0] < 0;
        if (nothing || v->map_tile[tile] == UINT32_MAX) {
            empty += !nothing || v->map_tile[tile] != UINT32_MAX;
            continue;
        }
        for (size_t i = 0; i < 256; i++) {
            const ssdgs_light_pixel *a = pixel + 256 * tile + i,
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
    const double stop = (double)s.options.stop;
    size_t falls = 0;
    ssdgs_real *flux = (ssdgs_real *)calloc(n * (size_t)s.light_count, sizeof *flux);
    if (!flux) exit(1);
    s.frame.flux = flux;
    s.frame.maps = 1;
    CHECK(!ssdgs_stage_cpu(&s.frame, SSDGS_STAGE_WALK));
    all_at_work(&s.frame);
    upload_views(&s.frame, s.set);
    spoil(&s.set->tile_sums, device->instance_room * 4 * sizeof(float));
    gpu_walk_lights(device, s.set);
    for (int view = 1; view < s.frame.view_count; view++) {
        const size_t tile = 256 * sizeof(ssdgs_light_pixel),
                     size = (size_t)gpu_tiles(s.frame.views + view) * tile;
        ssdgs_light_pixel *map = (ssdgs_light_pixel *)malloc(size);
        if (!map) exit(1);
        gpu_download_at(device, &device->frame.maps.buffer, (size_t)device->tables->views[view].of[1] * tile,
                        map, size);
        falls += compare_maps(&s.frame, view, map, stop);
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

/* Takes a half of what is on one side. */
static void half_of(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    (void)user, (void)light;
    for (int i = 0; i < count; i++)
        if (points[3 * i] > 0) fraction[i] /= 2;
}

/* What the backend leaves to the CPU is the CPU's to the bit: an occluder's callback, parts where light is
   not deferred, no Gaussian, more lights than it has room for, maps asked for. */
static void left_to_the_cpu(void) {
    enum { CASES = 4, MANY = GPU_LAMPS + 1 };
    static picture pictures[2][CASES];
    static ssdgs_light lights[MANY];
    ssdgs_context *const own = context;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    for (int i = 0; i < MANY; i++) lights[i] = point_light(2 + 0.1 * i, 3, 4);
    for (int i = 0; i < 2; i++) {
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, &context) && !ssdgs_scene_create(context, &scene))) exit(1);
        ssdgs_settings settings[2] = {small_settings(), ssdgs_settings_published()};
        for (int m = 0; m < 2; m++) settings[m].scattering.width = settings[m].shadow.width = 16;
        for (int m = 0; m < 2; m++) settings[m].light_map.size = 32;
        ssdgs_model *models[2] = {cloud(settings, 0, 200, 0.5), cloud(settings + 1, 0, 200, 0.5)};
        const ssdgs_camera camera = camera_from(3, 0, 1);
        ssdgs_occluder occluder;
        memset(&occluder, 0, sizeof occluder);
        occluder.shadow = half_of;
        for (int c = 0; c < CASES; c++) {
            const ssdgs_object object = ssdgs_object_default(models[c == 1]);
            picture *p = pictures[i] + c;
            ssdgs_image image = planes_of(p);
            if (c == 3) image.diffuse = image.specular = image.scattering = image.normal = NULL;
            ssdgs_scene_occlude(scene, c ? NULL : &occluder);
            if (!CHECK(!ssdgs_scene_render(scene, &object, c != 2, &camera, lights, c == 3 ? MANY : 1, NULL,
                                           &image, &p->stats)))
                printf("    %s\n", ssdgs_error_message(context));
            if (i) CHECK(!gpu_last_picture(device).buffer);
        }
        for (int m = 0; m < 2; m++) ssdgs_model_destroy(models[m]);
        ssdgs_scene_destroy(scene);
        ssdgs_context_destroy(context);
    }
    context = own;
    for (int c = 0; c < CASES; c++) CHECK(same(pictures[0] + c, pictures[1] + c));
}

/* Maps that are asked for ahead of a frame: the host has them, they are the frame's, and another scene's stay
   apart. */
static void asked_maps(void) {
    enum { POINTS = 200 };
    static picture pictures[2];
    static ssdgs_real fraction[2][2][POINTS];
    ssdgs_context *const own = context;
    ssdgs_context_desc desc;
    ssdgs_real points[3 * POINTS];
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    for (uint64_t i = 0; i < 3 * POINTS; i++) points[i] = (ssdgs_real)(2 * draw(i) - 1);
    for (int i = 0; i < 2; i++) {
        ssdgs_scene *other;
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, &context) && !ssdgs_scene_create(context, &scene) &&
                   !ssdgs_scene_create(context, &other)))
            exit(1);
        const ssdgs_settings settings = small_settings();
        ssdgs_model *model = cloud(&settings, 0, 400, 0.5);
        const ssdgs_light lights[2] = {point_light(0.1, 0, -0.1), parallel_light(0.6, 0, 0.8)},
                          *second = lights + 1;
        const ssdgs_object objects[2] = {ssdgs_object_default(model), placed(model, 1, 0.5, 1, 0.4, 0.2, 0)};
        const ssdgs_camera camera = camera_from(3, 0, 1);
        ssdgs_image image = planes_of(pictures + i);
        CHECK(!ssdgs_scene_light(scene, objects, 2, NULL, lights, 2, NULL));
        CHECK(!ssdgs_scene_light(other, objects, 1, NULL, second, 1, NULL));
        CHECK(!ssdgs_scene_shadow(scene, 0, points, POINTS, fraction[i][0]));
        CHECK(!ssdgs_scene_shadow(scene, 1, points, POINTS, fraction[i][1]));
        CHECK(!ssdgs_scene_light(scene, objects, 2, NULL, lights, 2, NULL));
        CHECK(!ssdgs_scene_render(scene, objects, 2, &camera, lights, 2, NULL, &image, &pictures[i].stats));
        if (i) CHECK(gpu_last_picture(device).buffer);
        CHECK(pictures[i].stats.lights_cached == 2);
        static ssdgs_real again[POINTS];
        for (int light = 0; light < 2; light++) {
            CHECK(!ssdgs_scene_shadow(scene, light, points, POINTS, again));
            CHECK(!memcmp(again, fraction[i][light], sizeof again));
        }
        ssdgs_model_destroy(model);
        ssdgs_scene_destroy(other);
        ssdgs_scene_destroy(scene);
        ssdgs_context_destroy(context);
    }
    context = own;
    CHECK(device->host_map_count == 0);
    for (int light = 0; light < 2; light++)
        CHECK_NEAR(fraction[1][light], fraction[0][light], POINTS, 1e-3, 0, "maps asked for");
    CHECK(between(pictures + 1, pictures).rms < 1e-3);
}

static int dispatched;
static void (*own_dispatch)(uint32_t x, uint32_t y, uint32_t z);
static void count_dispatch(uint32_t x, uint32_t y, uint32_t z) {
    dispatched++;
    own_dispatch(x, y, z);
}

/* The number of dispatches depends neither on objects nor on lights. */
static void dispatches(void) {
    ssdgs_context *const own = context;
    ssdgs_context_desc desc;
    int counts[3] = {0, 0, 0};
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    desc.gpu = &hook;
    if (!CHECK(!ssdgs_context_create(&desc, &context) && !ssdgs_scene_create(context, &scene))) exit(1);
    const ssdgs_settings settings = small_settings();
    ssdgs_model *model = cloud(&settings, 0, 200, 0.4);
    own_dispatch = device->gl.DispatchCompute;
    device->gl.DispatchCompute = count_dispatch;
    device->instance_room = 1 << 18;
    for (int f = 0; f < 9; f++) { /* one object, one light; many; at rest */
        const int many = f / 3 > 0, at = f / 3 > 1 ? 5 : f;
        ssdgs_object objects[12];
        ssdgs_light lights[6];
        const ssdgs_camera camera = camera_from(3, 0.1 * at, 1);
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        image.color = shot->value;
        for (int i = 0; i < 12; i++)
            objects[i] = placed(model, i + at, 0.4, i % 3 == 0, 0.3 * (i % 4), 0.3 * (i / 4), 0);
        for (int i = 0; i < 6; i++)
            lights[i] = point_light(i == 3 ? 0.1 : 2 + 0.1 * at, i - 3, i == 3 ? 0 : 2);
        dispatched = 0;
        CHECK(!ssdgs_scene_render(scene, objects, many ? 12 : 1, &camera, lights, many ? 6 : 1, NULL, &image,
                                  NULL));
        CHECK(gpu_last_picture(device).buffer);
        counts[f / 3] = dispatched;
    }
    device->gl.DispatchCompute = own_dispatch;
    printf("dispatches a frame: %d with one object and light, %d with many, %d at rest\n", counts[0],
           counts[1], counts[2]);
    CHECK(counts[1] <= counts[0] + 2 && counts[2] < 8 && counts[0] < 30); /* 2: more than 256 tiles */
    ssdgs_model_destroy(model);
    ssdgs_scene_destroy(scene);
    ssdgs_context_destroy(context);
    context = own;
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
   with parts: as the CPU's alone, and as much kept. */
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
        const int anew = f == 8 || f == 9; /* of another model than the last */
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

enum { MODELS = 6, PLACES = 5, MOST_LIGHTS = 4, MAP = 32 };

/* A scene of many kinds of models under many kinds of lights. */
typedef struct stage_set {
    ssdgs_model *models[3][MODELS]; /* of each context */
    int model[PLACES], count, light_count, deep, mapped, wide, plain, parts;
    ssdgs_object objects[PLACES];
    ssdgs_light lights[MOST_LIGHTS];
    ssdgs_render_options options;
    double eye[3];
    unsigned char mask[400];
    float depth[PIXELS], map_depth[MAP * MAP];
    ssdgs_shadow_map map;
    uint64_t drawn;
} stage_set;

static ssdgs_model *model_of(int kind) {
    ssdgs_settings s = kind == 2 ? ssdgs_settings_published() : small_settings();
    s.transfer = SSDGS_TRANSFER_SRGB;
    s.light_map.size = kind == 1 ? 0 : 48;
    s.scattering.width = s.shadow.width = kind == 1 ? 23 : 16;
    if (kind == 3) s.baked = 1, s.harmonics = 3;
    if (kind == 4) {
        s.scattering.layers = s.shadow.layers = 0;
        for (int c = 0; c < 3; c++)
            s.medium.scattering[c] = (ssdgs_real)(10 + 5 * c), s.medium.absorption[c] = 1;
    }
    if (kind == 5) s.kept = (ssdgs_real)0.3, s.harmonics = 1;
    ssdgs_model *model = cloud(&s, 700 * kind, 150 + 40 * kind, 0.4);
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t c = kind == 3 ? SSDGS_DIFFUSE : SSDGS_CHANNELS; c < (size_t)v.channels; c++)
        for (size_t i = 0; i < (size_t)v.count; i++)
            v.gaussians[c * v.stride + i] = (ssdgs_real)(draw(90000 + 700 * c + i) - 0.5);
    if (kind == 1)
        for (int i = 0; i < SSDGS_ASG_COUNT; i++) v.asg_sigma[i] += (ssdgs_real)(0.2 * i);
    CHECK(!ssdgs_model_sort(model));
    return model;
}

static double next(stage_set *s) { return draw(7000000 + s->drawn++); }
static int pick(stage_set *s, int many) { return (int)(next(s) * many); }

static void change_place(stage_set *s, int i) {
    const double scale = 0.6 + 0.8 * next(s), turn = 6 * next(s);
    const ssdgs_object there =
        placed(NULL, turn, scale, pick(s, 4) == 0, 1.2 * next(s) - 0.6, 1.2 * next(s) - 0.6, next(s) - 0.5);
    memcpy(s->objects[i].to_world, there.to_world, sizeof there.to_world);
}

static void change_look(stage_set *s, int i) {
    ssdgs_object *o = s->objects + i;
    for (int c = 0; c < 3; c++) o->tint[c] = (ssdgs_real)(pick(s, 2) ? 1 : 0.3 + next(s));
    o->roughness = (ssdgs_real)(pick(s, 2) ? 1 : 0.5 + next(s));
    o->specular = (ssdgs_real)(pick(s, 2) ? 1 : 2 * next(s));
    o->translucency = (ssdgs_real)(pick(s, 3) ? 1 : 0.5 + next(s));
    o->presence = (ssdgs_real)(pick(s, 3) ? 1 : next(s));
    o->kept = (ssdgs_real)(pick(s, 2) ? 1 : next(s));
    o->mask = pick(s, 3) ? NULL : s->mask;
}

static void change_light(stage_set *s, int i) {
    double d[3];
    direction_of(pick(s, 30), 60, d);
    ssdgs_light *l = s->lights + i;
    const int kind = pick(s, 6);
    *l = kind == 1 ? parallel_light(d[0], d[1], d[2]) : point_light(2.5 * d[0], 2.5 * d[1], 2.5 * d[2]);
    if (kind == 2) *l = point_light(0.2 * d[0], 0.2 * d[1], 0.2 * d[2]); /* within: six views */
    if (kind == 3) l->range = (ssdgs_real)(2.2 + next(s));
    if (kind > 3)
        for (int c = 0; c < 3; c++) l->direction[c] = (ssdgs_real)-d[c];
    if (kind == 4) l->kind = SSDGS_LIGHT_SPOT, l->cone[0] = (ssdgs_real)0.1, l->cone[1] = (ssdgs_real)0.2;
    if (kind == 5) l->focus = 3;
    l->unshadowed = pick(s, 6) == 0;
    if (pick(s, 8) == 0) memset(l->intensity, 0, sizeof l->intensity);
    l->kept = (ssdgs_real)(pick(s, 2) ? 0 : next(s));
}

/* A wall beside the light, which hides a half of what it shines on. */
static void change_map(stage_set *s) {
    const double side = next(s) - 0.5;
    memset(&s->map, 0, sizeof s->map);
    s->mapped = pick(s, 3);
    s->map.light = pick(s, MOST_LIGHTS);
    s->map.width = s->map.height = MAP;
    s->map.depth = s->map_depth;
    s->map.pitch = MAP * sizeof(float);
    s->map.flags = pick(s, 2) ? SSDGS_CLIP_Z_FROM_0 : 0;
    s->map.bias = (ssdgs_real)(0.01 * pick(s, 3));
    s->map.revision++;
    for (int i = 0; i < MAP * MAP; i++) s->map_depth[i] = i % MAP > MAP / 2 + 8 * side ? 0.4f : 1;
    const double rows[16] = {0.5, 0.2, 0, 0, 0, 0.1, 0.5, 0, 0.1, 0, -0.2, 0.4, 0, 0, 0, 1};
    for (int i = 0; i < 16; i++) s->map.matrix[i] = (ssdgs_real)rows[i];
}

static void change_depth(stage_set *s) {
    const double edge = SIDE * next(s);
    s->deep = pick(s, 2);
    for (int i = 0; i < PIXELS; i++) s->depth[i] = i % SIDE < edge ? 0 : i % 7 ? 2.2f : (float)NAN;
}

static void change_options(stage_set *s) {
    s->options = pick(s, 2) ? ssdgs_render_options_default() : ssdgs_render_options_exact();
    s->options.antialias = pick(s, 2);
    s->options.light_detail = (ssdgs_real)(pick(s, 3) ? 1 : 0.5);
    for (int i = 0; i < 27; i++)
        s->options.ambient[i / 3][i % 3] = (ssdgs_real)(s->drawn % 3 ? 0 : i < 3 ? 0.5 : 0.2 * next(s));
}

/* One of many small changes, or none. */
static void change(stage_set *s) {
    const int kind = pick(s, 14), place = pick(s, PLACES);
    if (kind == 0) s->count = 1 + pick(s, PLACES);
    if (kind == 1) s->model[place] = pick(s, MODELS);
    if (kind == 2) change_place(s, place);
    if (kind == 3) change_look(s, place);
    if (kind == 4) change_light(s, pick(s, MOST_LIGHTS));
    if (kind == 5) s->light_count = pick(s, MOST_LIGHTS + 1);
    if (kind == 6) s->lights[pick(s, MOST_LIGHTS)].intensity[0] *= 2;
    if (kind == 7) change_map(s);
    if (kind == 8) change_depth(s);
    if (kind == 9) change_options(s);
    if (kind == 10) s->plain = pick(s, 3) == 0; /* a scene of plain splats alone */
    if (kind == 11) s->parts = pick(s, 2);
    for (int c = 0; c < 3 && kind > 11; c++) s->eye[c] = (c == 2 ? 1 : 2.2) + next(s) - 0.5;
}

/* A model is edited, or is another one in the same memory. */
static void change_model(stage_set *s, ssdgs_context *const contexts[3]) {
    const int which = pick(s, MODELS), gone = pick(s, 2), at = pick(s, 100);
    for (int i = 0; i < 3; i++) {
        context = contexts[i];
        if (gone) {
            ssdgs_model_destroy(s->models[i][which]);
            s->models[i][which] = model_of(which);
        }
        const ssdgs_model_view v = ssdgs_model_arrays(s->models[i][which]);
        v.gaussians[(SSDGS_LOG_SCALE + (size_t)at % 3) * v.stride + (size_t)at] += (ssdgs_real)0.5;
    }
}

static ssdgs_result draw_set(stage_set *s, int which, ssdgs_scene *in, picture *p, ssdgs_real *median) {
    const ssdgs_camera camera = camera_from(s->eye[0], s->eye[1], s->eye[2]);
    ssdgs_occluder occluder;
    ssdgs_object objects[PLACES];
    ssdgs_image image = planes_of(p);
    memset(&occluder, 0, sizeof occluder);
    occluder.maps = &s->map, occluder.map_count = s->mapped > 0;
    ssdgs_scene_occlude(in, &occluder);
    for (int i = 0; i < s->count; i++) {
        objects[i] = s->objects[i];
        objects[i].model = s->models[which][s->plain ? 3 : s->model[i]];
        objects[i].kept = s->plain && !(objects[i].kept > 0) ? 1 : objects[i].kept;
    }
    image.scene_depth = s->deep ? s->depth : NULL;
    image.median_depth = median;
    if (!s->parts)
        image.diffuse = image.specular = image.scattering = image.normal = image.depth = image.shadow = NULL;
    return ssdgs_scene_render(in, objects, s->count, &camera, s->lights, s->light_count, &s->options, &image,
                              &p->stats);
}

static double decibels(const ssdgs_real *got, const ssdgs_real *want, int count) {
    double square = 0, peak = 1e-3;
    for (int i = 0; i < count; i++) {
        const double d = (double)got[i] - (double)want[i];
        square += d * d / count;
        peak = fmax(peak, fabs((double)want[i]));
    }
    return test_finite(square) ? 10 * log10(peak * peak / (square + 1e-20)) : -1;
}

/* Forgets all that a device keeps. */
static void forget(gpu *g) {
    g->owner = NULL;
    g->outside = g->transported = 0;
    g->frame.models.count = g->frame.maps.count = 0;
    for (int i = 0; i < GPU_LAMPS; i++) g->frame.light[i].ready = 0;
}

/* Scenes that change step by step: what a device keeps from frame to frame has the bits of one that keeps
   nothing, and is close to the CPU's. */
static void changes(int steps) {
    static stage_set s;
    static picture got[3];
    static ssdgs_real median[3][PIXELS];
    ssdgs_context *const own = context, *contexts[3];
    ssdgs_scene *scenes[3];
    gpu *devices[3] = {NULL, device, NULL};
    char message[256] = "";
    double least = 200, least_part = 200;
    int cached = 0, on_device = 0, worst_step = -1;
    memset(&s, 0, sizeof s);
    devices[2] = gpu_create(NULL, message, sizeof message);
    if (!CHECK(devices[2] != NULL)) return;
    for (int i = 0; i < 3; i++) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        const ssdgs_gpu_hook hook = gpu_hook(devices[i ? i : 1]);
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, contexts + i) &&
                   !ssdgs_scene_create(contexts[i], scenes + i)))
            exit(1);
        context = contexts[i];
        for (int m = 0; m < MODELS; m++) s.models[i][m] = model_of(m);
    }
    s.count = 3, s.light_count = 2;
    for (int i = 0; i < 400; i++) s.mask[i] = (unsigned char)(i * 37);
    for (int i = 0; i < PLACES; i++) {
        s.model[i] = i;
        s.objects[i] = placed(NULL, 0, 1, 0, 0, 0, 0);
        change_place(&s, i);
    }
    for (int i = 0; i < MOST_LIGHTS; i++) change_light(&s, i);
    change_options(&s);
    change_map(&s);
    s.eye[0] = s.eye[1] = 2.2, s.eye[2] = 1;
    for (int step = 0; step < steps; step++) {
        if (step % 25 == 24) change_model(&s, contexts);
        for (int i = 0; i < 3; i++) {
            if (i == 2) forget(devices[2]);
            memset(&got[i], 0, sizeof got[i]);
            context = contexts[i];
            if (!CHECK(!draw_set(&s, i, scenes[i], got + i, median[i])))
                printf("    step %d: %s\n", step, ssdgs_error_message(context));
        }
        on_device += device->picture.buffer != 0;
        cached += got[1].stats.lights_cached;
        if (!CHECK(!memcmp(got[1].value, got[2].value, sizeof got[1].value) &&
                   !memcmp(median[1], median[2], sizeof median[1])))
            printf("    step %d: not as anew\n", step);
        const double color = fmin(decibels(got[1].value, got[0].value, 3 * PIXELS),
                                  decibels(got[1].value + 15 * PIXELS, got[0].value + 15 * PIXELS, PIXELS));
        if (!CHECK(color > 60)) printf("    step %d: %.1f dB\n", step, color);
        if (color < least) worst_step = step;
        least = fmin(least, color);
        for (int plane = 3; plane < PLANES && s.parts; plane += plane < 15 ? 3 : 1) {
            const int size = (plane < 15 ? 3 : 1) * PIXELS;
            const double part = decibels(got[1].value + plane * PIXELS, got[0].value + plane * PIXELS, size);
            if (!CHECK(part > 50)) printf("    step %d, plane %d: %.1f dB\n", step, plane, part);
            least_part = fmin(least_part, part);
        }
        int far_off = 0;
        for (int i = 0; i < PIXELS; i++) far_off += fabs((double)(median[1][i] - median[0][i])) > 1e-3;
        if (!CHECK(far_off <= PIXELS / 100)) printf("    step %d: %d median depths differ\n", step, far_off);
        change(&s);
    }
    printf(
        "%d changes: %.1f dB at least from the CPU's (step %d), parts %.1f; %d on the device, %d maps kept\n",
        steps, least, worst_step, least_part, on_device, cached);
    CHECK(on_device > steps / 2 && cached > steps / 2);
    for (int i = 0; i < 3; i++) {
        for (int m = 0; m < MODELS; m++) ssdgs_model_destroy(s.models[i][m]);
        ssdgs_scene_destroy(scenes[i]);
        ssdgs_context_destroy(contexts[i]);
    }
    gpu_destroy(devices[2]);
    context = own;
}

/* Two scenes in turn on one device, with terms that are left out, lights that are dark for a frame, frames
   that the CPU draws in between: each frame is the CPU's. */
static void in_turn(void) {
    enum { KINDS = 4, TURNS = 4 };
    static picture pictures[2][KINDS][TURNS];
    ssdgs_context *const own = context;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    for (int i = 0; i < 2; i++) {
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
        for (int kind = 0; kind < KINDS; kind++) {
            ssdgs_settings s = small_settings();
            ssdgs_scene *scenes[2];
            if (kind == 3) s.asg = SSDGS_ASG_GEOMETRIC;
            if (kind != 1) {
                s.scattering.layers = s.shadow.layers = 0;
                for (int c = 0; c < 3; c++) s.medium.scattering[c] = 10, s.medium.absorption[c] = 1;
            }
            ssdgs_model *models[2] = {cloud(&s, 0, 1000, 0.5), cloud(&s, 5000, 1000, 0.2)};
            for (int m = 0; m < 2; m++) CHECK(!ssdgs_model_sort(models[m]));
            for (int m = 0; m < 2; m++) CHECK(!ssdgs_scene_create(context, scenes + m));
            for (int f = 0; f < TURNS; f++) {
                const int other = kind < 3 && f == 1;
                ssdgs_light lights[2] = {point_light(2, 3, 4), point_light(-3, 1, 2)};
                ssdgs_render_options options = ssdgs_render_options_default();
                const ssdgs_object object = ssdgs_object_default(models[other]);
                const ssdgs_camera camera = camera_from(2, 0.3, 1);
                picture *p = pictures[i][kind] + f;
                ssdgs_image image = planes_of(p);
                if (kind < 3 || f % 3 == 0) /* without parts, which here are the CPU's */
                    image.diffuse = image.specular = image.scattering = image.normal = image.depth =
                        image.shadow = NULL;
                if (other) lights[0] = point_light(-2, -3, 1), lights[1] = point_light(1, -4, 2);
                if (kind == 0 && f == 2) memset(lights[0].intensity, 0, sizeof lights[0].intensity);
                if (kind == 1 && f == 2) options.terms &= ~SSDGS_SHADOW_TERM;
                if ((kind == 2 && f == 2) || (kind == 3 && f == 1)) options.terms &= ~SSDGS_SCATTERING_TERM;
                CHECK(!ssdgs_scene_render(scenes[other], &object, 1, &camera, lights, 2, &options, &image,
                                          NULL));
            }
            for (int m = 0; m < 2; m++) ssdgs_model_destroy(models[m]), ssdgs_scene_destroy(scenes[m]);
        }
        ssdgs_context_destroy(context);
    }
    context = own;
    for (int kind = 0; kind < KINDS; kind++)
        for (int f = 0; f < TURNS; f++) {
            const double db = decibels(pictures[1][kind][f].value, pictures[0][kind][f].value, 3 * PIXELS);
            if (!CHECK(db > 60)) printf("    kind %d, turn %d: %.1f dB\n", kind, f, db);
        }
}

/* What is not finite, in each channel of each kind of model, as the CPU has it; and a frame with too many
   splats for the device harms no other. */
static void odd_models(void) {
    static picture pictures[2];
    ssdgs_context *const own = context;
    ssdgs_context *contexts[2];
    ssdgs_context_desc desc;
    const int32_t most = device->most;
    memset(&desc, 0, sizeof desc);
    const ssdgs_gpu_hook hook = gpu_hook(device);
    const ssdgs_light light = point_light(2, 3, 4);
    ssdgs_render_options options = ssdgs_render_options_exact();
    for (int i = 0; i < 2; i++) {
        desc.gpu = i ? &hook : NULL;
        if (!CHECK(!ssdgs_context_create(&desc, contexts + i))) exit(1);
    }
    for (int kind = 0; kind < MODELS; kind++)
        for (int value = 0; value < 2; value++) {
            ssdgs_scene *scenes[2];
            ssdgs_model *models[2];
            for (int i = 0; i < 2; i++) {
                context = contexts[i];
                models[i] = model_of(kind);
                const ssdgs_model_view v = ssdgs_model_arrays(models[i]);
                for (int c = 0; c < v.channels;
                     c++) /* networks make of infinite codes what their sums' order does */
                    if (!value || c < SSDGS_MATERIAL || c >= SSDGS_CHANNELS || kind == 3)
                        v.gaussians[(size_t)c * v.stride + (size_t)(2 * c)] = (float)(value ? INFINITY : NAN);
                ssdgs_object object = ssdgs_object_default(models[i]);
                object.presence = (ssdgs_real)(value ? 1 : 0.9);
                const ssdgs_camera camera = camera_from(2, 0.3, 1);
                ssdgs_image image;
                memset(&image, 0, sizeof image);
                image.color = pictures[i].value, image.alpha = pictures[i].value + 15 * PIXELS;
                CHECK(!ssdgs_scene_create(context, scenes + i));
                CHECK(!ssdgs_scene_render(scenes[i], &object, 1, &camera, &light, 1, &options, &image,
                                          &pictures[i].stats));
            }
            const double db =
                fmin(decibels(pictures[1].value, pictures[0].value, 3 * PIXELS),
                     decibels(pictures[1].value + 15 * PIXELS, pictures[0].value + 15 * PIXELS, PIXELS));
            if (!CHECK(db > 60)) printf("    kind %d, value %d: %.1f dB\n", kind, value, db);
            CHECK(pictures[1].stats.blackened == pictures[0].stats.blackened);
            for (int i = 0; i < 2; i++) ssdgs_scene_destroy(scenes[i]), ssdgs_model_destroy(models[i]);
        }
    context = contexts[1];
    const ssdgs_settings s = small_settings();
    ssdgs_model *small = cloud(&s, 0, 100, 0.4), *large = cloud(&s, 0, 1200, 6);
    const ssdgs_model_view v = ssdgs_model_arrays(large);
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < 1200; i++) v.gaussians[(SSDGS_LOG_SCALE + c) * v.stride + i] += 2;
    device->most = 4 << 20;
    device->instance_room = 100;
    for (int f = 0; f < 3; f++) {
        ssdgs_camera camera = camera_from(2, 0.3, 1);
        static ssdgs_real color[3 * 400 * 400];
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        image.color = color;
        if (f == 1)
            camera.width = camera.height = 400, camera.fx = camera.fy = 300, camera.cx = camera.cy = 200;
        const ssdgs_result result =
            ssdgs_render_ex(f == 1 ? large : small, &camera, &light, 1, &options, &image, NULL);
        CHECK(f == 1 ? result == SSDGS_ERR_LIMIT : !result && gpu_last_picture(device).buffer);
    }
    device->most = most;
    ssdgs_model_destroy(small), ssdgs_model_destroy(large);
    for (int i = 0; i < 2; i++) ssdgs_context_destroy(contexts[i]);
    context = own;
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
        gpu *const g = gpu_create(NULL, message, sizeof message);
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
        gpu *const g = gpu_create(NULL, message, sizeof message);
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
        const gpu *g = gpu_create(NULL, message, sizeof message);
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

int main(int argc, char **argv) {
    const int full = argc > 1 && !strcmp(argv[1], "full");
    char message[256] = "";
    without_drivers();
    device = gpu_create(NULL, message, sizeof message);
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
        asked_maps();
        dispatches();
        kept();
        changes(full ? 400 : 100);
        in_turn();
        odd_models();
        kept_transport();
        failures();
        for (int which = 0; which < 3; which++) {
            project(which, which ? 500 : 3000);
            sort(which, which ? 500 : 5000);
            bin(which, which ? 500 : 3000);
            walk_camera(which, which ? 500 : 3000);
            walk_light(which, which ? 500 : 3000);
            frame(which, which ? 500 : 2000, 1, 1e-4);
            frame(which, which ? 500 : 2000, 0, 3e-3);
        }
    }
    gpu_destroy(device);
    ssdgs_context_destroy(context);
    TEST_END();
}
