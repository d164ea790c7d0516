/* Hooks of a frame's stages: whichever are replaced, by a device that keeps to itself what the CPU does not
   fetch, the frames have the same bits, and keep as much. */
#define SSDGS_IMPLEMENTATION
#ifndef SSDGS_STAGES
#define SSDGS_STAGES
#endif
#include "../ssdgs.h"
#include "scene.h"

enum { RENDERED = SSDGS_STAGE_COMPOSITE + 1, ROOM = 256, FRAMES = 7, LIGHTS = 2 };

/* ---- a device: what a stage writes goes there, and is spoilt where the CPU could read it ---- */

typedef struct array {
    void *host;
    size_t bytes;
    unsigned char *copy;
    int whole; /* whole numbers, that must not lead astray */
} array;

typedef struct device {
    int mask; /* of the stages that it runs */
    int away; /* 1: the arrays are spoilt */
    int count, fetched, stages, fails;
    array arrays[ROOM];
    const void *memory; /* of the last frame */
    const void *gone[16];
    int gone_count;
} device;

static void add(device *d, void *host, size_t count, size_t size, int whole) {
    if (!host || !count || !CHECK(d->count < ROOM)) return;
    array *a = d->arrays + d->count++;
    a->host = host;
    a->bytes = count * size;
    a->whole = whole;
}
#define ADD(host, count, whole) add(d, (void *)(host), (size_t)(count), sizeof *(host), whole)

/* What stages up to this one have left in the frame. */
static void find_arrays(device *d, ssdgs_frame *f, int stage) {
    const size_t n = (size_t)f->count, lights = (size_t)f->light_count,
                 pixels = (size_t)f->camera.width * (size_t)f->camera.height;
    d->count = 0;
    CHECK(f->batch[0] == 0 && f->batch[1] == f->view_count);
    for (int i = 0; i < f->view_count; i++) {
        ssdgs_splat_view *v = f->views + i;
        const size_t tiles = (size_t)v->tiles_x * (size_t)v->tiles_y;
        const int done = v->cached ? SSDGS_STAGE_WALK : stage,
                  own = !v->cached || (i == 0 && f->last > SSDGS_STAGE_WALK); /* maps alone stay of lights */
        if (own && done >= SSDGS_STAGE_PROJECT) ADD(v->record, n, 0), ADD(v->depth, n, 0);
        if (own && done >= SSDGS_STAGE_PROJECT) ADD(v->slope, 2 * n, 0);
        if (own && done >= SSDGS_STAGE_SORT) ADD(v->order, v->visible, 1);
        if (own && done >= SSDGS_STAGE_BIN) {
            ADD(v->instance, v->instance_room, 1);
            ADD(v->of_gaussian, n, 1);
            ADD(v->tile_start, tiles + 1, 1);
            ADD(v->tile_list, v->instances, 1);
        }
        if (own && done >= SSDGS_STAGE_WALK && i == 0) {
            ADD(v->tile_seen, v->instances, 1);
            ADD(v->tile_needed, v->instances, 1);
        }
        if (done >= SSDGS_STAGE_WALK && i && v->light_map) {
            size_t used = 0;
            for (size_t t = 0; t < tiles; t++) used += v->map_tile[t] != UINT32_MAX;
            ADD(v->light_map, 256 * used, 0);
            ADD(v->map_tile, tiles, 1);
        }
    }
    if (stage >= SSDGS_STAGE_WALK || f->views->cached) ADD(f->seen, n, 1);
    if (stage >= SSDGS_STAGE_WALK && f->view_count > 1) {
        ADD(f->visibility, n * lights, 0);
        ADD(f->depth_cue, n * lights, 0);
        ADD(f->flux, n * lights, 0);
    }
    if (stage >= SSDGS_STAGE_SHADE) {
        ADD(f->shaded, f->shaded_count, 1);
        ADD(f->color, 4 * n, 0);
        ADD(f->layers, 4 * n * (size_t)f->layer_count, 0);
        ADD(f->diffuse, 4 * n, 0);
        ADD(f->specular, 4 * n, 0);
        ADD(f->scattering, 4 * n, 0);
        ADD(f->normal, 4 * n, 0);
        ADD(f->shadow, 4 * n, 0);
    }
    if (stage >= SSDGS_STAGE_COMPOSITE) {
        ADD(f->pixels, 3 * pixels, 0);
        ADD(f->transmittance, pixels, 0);
        ADD(f->layer_pixels, 3 * pixels * (size_t)(f->pixel_shadow ? 1 + f->layer_count : 2), 0);
        ADD(f->pixel_visibility, pixels * lights, 0);
        ADD(f->pixel_shadow, pixels * lights, 0);
        ADD(f->median_depth, pixels, 0);
    }
}

static void bring_back(device *d) {
    for (int i = 0; i < d->count && d->away; i++)
        memcpy(d->arrays[i].host, d->arrays[i].copy, d->arrays[i].bytes);
    for (int i = 0; i < d->count; i++) free(d->arrays[i].copy), d->arrays[i].copy = NULL;
    d->count = d->away = 0;
}

static void take_away(device *d, ssdgs_frame *frame, int stage) {
    find_arrays(d, frame, stage);
    for (int i = 0; i < d->count; i++) {
        array *a = d->arrays + i;
        a->copy = (unsigned char *)malloc(a->bytes);
        if (!CHECK(a->copy != NULL)) exit(1);
        memcpy(a->copy, a->host, a->bytes);
        memset(a->host, a->whole ? 0 : 0xFF, a->bytes);
    }
    d->away = 1;
}

static ssdgs_result on_device(void *user, ssdgs_frame *frame, ssdgs_stage stage) {
    device *d = (device *)user;
    bring_back(d);
    if (d->fails == (int)stage + 1)
        return ssdgs_context_fail(frame->context, SSDGS_ERR_MEMORY, "the device is full");
    const ssdgs_result result = ssdgs_stage_cpu(frame, stage);
    d->stages++;
    d->memory = frame->memory;
    if (!result && (int)stage < RENDERED) take_away(d, frame, (int)stage);
    return result;
}
#define HOOK(name, stage) \
    static ssdgs_result hook_##name(void *user, ssdgs_frame *frame) { return on_device(user, frame, stage); }
HOOK(project, SSDGS_STAGE_PROJECT)
HOOK(sort, SSDGS_STAGE_SORT)
HOOK(bin, SSDGS_STAGE_BIN)
HOOK(walk, SSDGS_STAGE_WALK)
HOOK(shade, SSDGS_STAGE_SHADE)
HOOK(composite, SSDGS_STAGE_COMPOSITE)

static ssdgs_result fetch(void *user, ssdgs_frame *frame, ssdgs_stage stage) {
    device *d = (device *)user;
    d->fetched++;
    CHECK(stage == SSDGS_STAGE_COUNT || !(d->mask >> stage & 1));
    CHECK(frame->last >= SSDGS_STAGE_WALK);
    bring_back(d);
    return d->fails == -1 ? ssdgs_context_fail(frame->context, SSDGS_ERR_IO, "the device is gone") : SSDGS_OK;
}

static void released(void *user, const void *gone) {
    device *d = (device *)user;
    if (CHECK(d->gone_count < 16)) d->gone[d->gone_count++] = gone;
}

static ssdgs_context *context_with(device *d, int mask) {
    ssdgs_gpu_hook gpu;
    ssdgs_context_desc desc;
    ssdgs_context *made = NULL;
    ssdgs_result (*const hooks[RENDERED])(void *, ssdgs_frame *) = {hook_project, hook_sort,  hook_bin,
                                                                    hook_walk,    hook_shade, hook_composite};
    memset(d, 0, sizeof *d);
    memset(&gpu, 0, sizeof gpu);
    memset(&desc, 0, sizeof desc);
    d->mask = mask;
    for (int stage = 0; stage < RENDERED; stage++)
        if (mask >> stage & 1) gpu.stage[stage] = hooks[stage];
    gpu.fetch = fetch;
    gpu.released = released;
    gpu.user = d;
    desc.threads = 2;
    if (mask) desc.gpu = &gpu;
    if (!CHECK(!ssdgs_context_create(&desc, &made))) exit(1);
    return made;
}

/* ---- frames ---- */

typedef struct shots {
    picture frames[FRAMES];
    ssdgs_real shadow[2];
    ssdgs_real trained[3 * PIXELS];
} shots;

static int with_parts(int frame) { return frame == 2 || frame == 6; }

/* Frames in which the camera, a light, both or neither moves; with parts and without; then scenes, shadows
   asked for, ambient light, training. */
static void take_shots(device *d, int mask, const ssdgs_settings *settings, shots *out) {
    const ssdgs_render_options options = ssdgs_render_options_default();
    context = context_with(d, mask);
    ssdgs_model *model = cloud(settings, 0, 150, 0.5), *other = cloud(settings, 900, 70, 0.2);
    memset(out, 0, sizeof *out);
    for (int i = 0; i < FRAMES; i++) {
        const int camera_turns = i > 1 && i != 5, light_turns = i == 1 || i == 4;
        const ssdgs_camera camera = camera_from(2, 0.4 * camera_turns, 0.8 + 0.1 * (i == 4));
        const ssdgs_light lights[LIGHTS] = {point_light(-1, -2, 2 + 0.2 * light_turns),
                                            parallel_light(0.6, 0, 0.8)};
        ssdgs_image image = planes_of(out->frames + i);
        if (!with_parts(i)) {
            const ssdgs_image bare = {0,    image.color, image.alpha, NULL, NULL, NULL,
                                      NULL, NULL,        NULL,        NULL, NULL};
            image = bare;
        }
        CHECK(!ssdgs_render_ex(model, &camera, lights, LIGHTS, &options, &image, &out->frames[i].stats));
        CHECK(!d->away);
    }
    ssdgs_object objects[2] = {ssdgs_object_default(model), placed(other, 0.7, 1.2, 0, 0.6, 0.1, 0)};
    ssdgs_light lamp = point_light(1.2, -0.6, 0.5);
    const ssdgs_real behind[3] = {(ssdgs_real)-0.9, (ssdgs_real)0.3, (ssdgs_real)-0.4};
    const ssdgs_camera camera = camera_from(2, 0.3, 0.5);
    ssdgs_render_options ambient = options;
    ambient.ambient[0][1] = ambient.ambient[3][0] = (ssdgs_real)0.3;
    if (!CHECK(!ssdgs_scene_create(context, &scene))) exit(1);
    for (int i = 0; i < 3; i++) {
        picture p;
        ssdgs_image image = planes_of(&p);
        lamp.range = i < 2 ? (ssdgs_real)1.1 : 0;
        if (i == 1) objects[0].to_world[3] = (ssdgs_real)0.02;
        CHECK(!ssdgs_scene_light(scene, objects, 2, NULL, &lamp, 1, &options));
        out->shadow[i % 2] = 1;
        CHECK(!ssdgs_scene_shadow(scene, 0, behind, 1, out->shadow + i % 2));
        CHECK(
            !ssdgs_scene_render(scene, objects, 2, &camera, &lamp, 1, i ? &ambient : &options, &image, NULL));
        for (int k = 0; k < VALUES; k++) out->frames[i].value[k] += p.value[k];
    }
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(other);
    static unsigned char pixels[4 * PIXELS];
    memset(pixels, 100, sizeof pixels);
    ssdgs_photo photo;
    memset(&photo, 0, sizeof photo);
    photo.camera = camera;
    photo.light = lamp;
    photo.pixels = pixels;
    ssdgs_train_options train = ssdgs_train_options_default();
    ssdgs_trainer *trainer = NULL;
    train.iterations = 3;
    train.schedule = SSDGS_SCHEDULE_JOINT;
    train.densify_until = 0;
    for (int c = 0; c < 3; c++) train.bounds_max[c] = -(train.bounds_min[c] = -1);
    CHECK(!ssdgs_trainer_create(model, &photo, 1, &train, &trainer));
    CHECK(mask >> SSDGS_STAGE_SHADE & 1 ||
          !ssdgs_trainer_run(trainer, NULL, NULL)); /* it goes with its backward */
    ssdgs_trainer_destroy(trainer);
    const ssdgs_real black[3] = {0, 0, 0};
    ssdgs_metrics metrics;
    CHECK(!ssdgs_evaluate(model, &photo, black, out->trained, &metrics));
    if (mask >> SSDGS_STAGE_SHADE & 1) memset(out->trained, 0, sizeof out->trained);
    ssdgs_model_destroy(model);
    CHECK(!d->away);
    ssdgs_context_destroy(context);
}

static void test_same(void) {
    static shots plain, hooked;
    static const int masks[] = {1, 2, 4, 8, 16, 32, 15, 63, 48, 31, 9, 40, 21, 42};
    for (int published = 0; published < 2; published++) {
        ssdgs_settings settings = small_settings();
        device d;
        if (published) settings.asg = SSDGS_ASG_GEOMETRIC, settings.transport = 0;
        take_shots(&d, 0, &settings, &plain);
        const ssdgs_render_stats *stats = &plain.frames[0].stats;
        CHECK(!d.fetched && !d.stages && stats[0].shaded > 20 && plain.shadow[0] < (ssdgs_real)0.95);
        CHECK(plain.frames[1].stats.camera_cached && plain.frames[3].stats.lights_cached == LIGHTS);
        for (size_t i = 0; i < sizeof masks / sizeof *masks; i++) {
            const int shades = masks[i] >> SSDGS_STAGE_SHADE & 1;
            take_shots(&d, masks[i], &settings, &hooked);
            CHECK(d.stages > FRAMES && d.fetched > FRAMES);
            if (shades) memcpy(hooked.trained, plain.trained, sizeof plain.trained);
            for (int frame = 0; frame < FRAMES; frame++) {
                if (!CHECK(same(plain.frames + frame, hooked.frames + frame)))
                    printf("    frame %d, stages %x\n", frame, (unsigned)masks[i]);
                if (!CHECK(!memcmp(&plain.frames[frame].stats, &hooked.frames[frame].stats,
                                   sizeof(ssdgs_render_stats))))
                    printf("    statistics of frame %d, stages %x\n", frame, (unsigned)masks[i]);
            }
            CHECK(!memcmp(plain.shadow, hooked.shadow, sizeof plain.shadow));
            CHECK(!memcmp(plain.trained, hooked.trained, sizeof plain.trained));
        }
    }
}

/* A stage that fails ends the frame with its message, and the next frame keeps nothing. */
static void test_failures(void) {
    const ssdgs_settings settings = small_settings();
    const ssdgs_camera camera = camera_from(2, 0, 0.8);
    const ssdgs_light light = point_light(-1, -2, 2);
    device d;
    context = context_with(&d, 63);
    ssdgs_model *model = cloud(&settings, 0, 100, 0.5);
    const ssdgs_image image = planes_of(shot);
    for (int stage = -1; stage < RENDERED; stage++) {
        ssdgs_render_stats stats;
        for (int i = 0; i < 2; i++)
            CHECK(!ssdgs_render_ex(model, &camera, &light, 1, NULL, &image, &stats) &&
                  stats.camera_cached == i);
        d.fails = stage + 1 ? stage + 1 : -1;
        CHECK(ssdgs_render(model, &camera, &light, 1, &image) ==
              (stage < 0 ? SSDGS_ERR_IO : SSDGS_ERR_MEMORY));
        CHECK(!strcmp(ssdgs_error_message(context), stage < 0 ? "the device is gone" : "the device is full"));
        d.fails = 0;
    }
    CHECK(ssdgs_context_fail(NULL, SSDGS_ERR_IO, "") == SSDGS_ERR_ARGUMENT);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* A hook hears of each model and of each memory of frames once, when it is gone or moves away. */
static void test_released(void) {
    const ssdgs_settings settings = small_settings();
    const ssdgs_camera camera = camera_from(2, 0, 0.8);
    const ssdgs_light light = point_light(-1, -2, 2);
    const ssdgs_image image = planes_of(shot);
    device d, idle;
    ssdgs_context *other = context_with(&idle, 0);
    context = context_with(&d, 63);
    ssdgs_model *models[3];
    for (int i = 0; i < 3; i++) models[i] = cloud(&settings, 100 * i, 20, 0.5);
    CHECK(!ssdgs_render(models[0], &camera, &light, 1, &image));
    const void *const first = d.memory;
    CHECK(!ssdgs_scene_create(context, &scene));
    const ssdgs_object objects[2] = {ssdgs_object_default(models[0]), ssdgs_object_default(models[1])};
    CHECK(!ssdgs_scene_render(scene, objects, 2, &camera, &light, 1, NULL, &image, NULL));
    CHECK(d.gone_count == 0);
    const void *const of_scene = d.memory;
    ssdgs_model_destroy(models[0]);
    CHECK(d.gone_count == 2 && d.gone[0] == models[0] && d.gone[1] == first);
    ssdgs_scene_destroy(scene);
    CHECK(d.gone_count == 3 && d.gone[2] == of_scene);
    CHECK(!ssdgs_model_move(models[1], other));
    CHECK(d.gone_count == 4 && d.gone[3] == models[1] && !idle.gone_count);
    ssdgs_context_destroy(context);
    ssdgs_model_destroy(models[2]);
    CHECK(d.gone_count == 5 && d.gone[4] == models[2]);
    ssdgs_model_destroy(models[1]);
    ssdgs_context_destroy(other);
    CHECK(d.gone_count == 5);
}

int main(void) {
    test_same();
    test_failures();
    test_released();
    TEST_END();
}
