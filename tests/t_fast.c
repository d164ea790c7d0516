/* What is skipped changes nothing, or no more than it says: kept frames, dead neurons, frozen networks,
   max_error, presets. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

enum { SIDE = 96, PIXELS = SIDE * SIDE, COUNT = 3000, FEWER = 1000 };
static const ssdgs_real target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
static ssdgs_real image[2][PIXELS * 3];

static double draw(uint64_t counter) { return ssdgs__uniform(77, counter); }

/* A shell of flat Gaussians, dense enough to hide most of itself, with networks that have something to
   say. */
static ssdgs_model *model_of(ssdgs_context *context, int count, int depth_cue, int transport) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    settings.depth_cue = depth_cue;
    settings.transport = transport;
    settings.pixel_variance = (ssdgs_real)0.3; /* broad, so that weights are often small */
    if (!CHECK(!ssdgs_model_create(context, &settings, count, &model))) exit(1);
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t i = 0; i < (size_t)count; i++) {
        const double z = 1 - (2 * (double)i + 1) / count, r = sqrt(1 - z * z), turn = 2.4 * (double)i;
        const double raw[7] = {0.5 * r * cos(turn), 0.5 * r * sin(turn), 0.5 * z, 1 + z,
                               -r * sin(turn),      r * cos(turn),       0};
        for (size_t c = 0; c < 3; c++) v.gaussians[(SSDGS_POSITION + c) * v.stride + i] = (ssdgs_real)raw[c];
        for (size_t c = 0; c < 4; c++)
            v.gaussians[(SSDGS_ROTATION + c) * v.stride + i] = v.gaussians[(SSDGS_FRAME + c) * v.stride + i] =
                (ssdgs_real)raw[3 + c];
        for (size_t c = 0; c < 3; c++)
            v.gaussians[(SSDGS_LOG_SCALE + c) * v.stride + i] = (ssdgs_real)(c < 2 ? -3.6 : -6);
        v.gaussians[SSDGS_OPACITY * v.stride + i] = (ssdgs_real)(3 * draw(50 * i) - 1);
        for (size_t c = SSDGS_DIFFUSE; c < SSDGS_FRAME; c++)
            v.gaussians[c * v.stride + i] = (ssdgs_real)(2 * draw(50 * i + c) - 1);
        for (size_t c = SSDGS_ASG_WEIGHT; c < SSDGS_CHANNELS; c++)
            v.gaussians[c * v.stride + i] = (ssdgs_real)(2 * draw(50 * i + c) - 1);
    }
    for (size_t i = 0; i < v.shadow_count; i++) v.shadow[i] += (ssdgs_real)(0.2 * draw(1000000 + i) - 0.1);
    return model;
}

static ssdgs_model *make_model(ssdgs_context *context, int count) { return model_of(context, count, 0, 1); }

static ssdgs_camera camera_at(double angle) {
    const ssdgs_real eye[3] = {(ssdgs_real)(2 * cos(angle)), (ssdgs_real)(2 * sin(angle)), (ssdgs_real)0.7};
    return ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, SIDE, SIDE);
}

static ssdgs_light light_at(double angle) {
    ssdgs_light light;
    memset(&light, 0, sizeof light);
    light.position[0] = (ssdgs_real)(2 * cos(angle));
    light.position[1] = (ssdgs_real)(2 * sin(angle));
    light.position[2] = 1;
    for (int c = 0; c < 3; c++) light.intensity[c] = (ssdgs_real)(3 + c);
    return light;
}

static void render(ssdgs_model *model, const ssdgs_camera *camera, const ssdgs_light *lights, int count,
                   const ssdgs_render_options *options, ssdgs_real *color, ssdgs_render_stats *stats) {
    ssdgs_image out;
    memset(&out, 0, sizeof out);
    out.color = color;
    CHECK(!ssdgs_render_ex(model, camera, lights, count, options, &out, stats));
}

/* The frame from a context that has kept frames has the bits of one that has not. */
static void check_same(ssdgs_model *model, const ssdgs_camera *camera, const ssdgs_light *lights, int count,
                       const ssdgs_render_options *options, int camera_cached, int lights_cached,
                       const char *name) {
    ssdgs_render_stats stats;
    render(model, camera, lights, count, options, image[0], &stats);
    if (!test_check(stats.camera_cached == camera_cached && stats.lights_cached == lights_cached, __FILE__,
                    __LINE__, name))
        printf("    camera kept %d, lights kept %d\n", stats.camera_cached, stats.lights_cached);
    (void)ssdgs_model_arrays(model); /* forget */
    render(model, camera, lights, count, options, image[1], &stats);
    CHECK(!stats.camera_cached && !stats.lights_cached && stats.shadows_cached == 0);
    test_check(!memcmp(image[0], image[1], sizeof image[0]), __FILE__, __LINE__, name);
}

static void test_kept(void) {
    ssdgs_context *context = NULL;
    ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_camera a = camera_at(0), b = camera_at(1);
    ssdgs_light moved = light_at(2);
    if (!CHECK(!ssdgs_context_create(NULL, &context))) exit(1);
    ssdgs_model *model = make_model(context, FEWER);
    ssdgs_model *other = make_model(context, FEWER);
    ssdgs_light lights[2];
    lights[0] = light_at(1);
    lights[1] = light_at(4);
#define FIRST() render(model, &a, lights, 2, &options, image[0], NULL)
    FIRST();
    check_same(model, &a, lights, 2, &options, 1, 2, "nothing moved");
    FIRST();
    CHECK(ssdgs_model_peek(model).gaussians == model->gaussians && !ssdgs_model_peek(NULL).gaussians);
    check_same(model, &a, lights, 2, &options, 1, 2, "its arrays were read");
    FIRST();
    check_same(model, &b, lights, 2, &options, 0, 2, "the camera moved");
    FIRST();
    check_same(model, &a, &moved, 1, &options, 1, 0, "another light");
    FIRST();
    moved = lights[0], lights[0] = light_at(3);
    check_same(model, &a, lights, 2, &options, 1, 1, "a light moved");
    lights[0] = moved;
    FIRST();
    moved = lights[0], lights[0].intensity[1] *= 2;
    check_same(model, &a, lights, 2, &options, 1, 2, "a brighter light");
    lights[0] = moved;
    lights[1].position[0] = lights[1].position[1] = 0;
    TEST_PARALLEL(lights[1]);
    check_same(model, &a, lights, 2, &options, 1, 1, "another kind of light");
    FIRST();
    FIRST(); /* the shadow network's outputs are kept from here on */
    render(model, &b, lights, 2, &options, image[0], NULL);
    ssdgs_render_stats stats;
    render(model, &b, lights, 2, &options, image[0], &stats);
    CHECK(stats.shadows_cached >= 2 * (size_t)stats.shaded); /* whole blocks */
    check_same(model, &a, lights, 2, &options, 0, 2, "kept shadows, back again");
    FIRST();
    options.max_error = 0;
    check_same(model, &a, lights, 2, &options, 1, 2, "another max_error"); /* it is walked again */
    FIRST();
    options.stop = (ssdgs_real)0.1;
    check_same(model, &a, lights, 2, &options, 1, 0, "another stop");
    FIRST();
    options.antialias = 1;
    check_same(model, &a, lights, 2, &options, 0, 2, "antialias");
    FIRST();
    options.light_detail = (ssdgs_real)0.5;
    check_same(model, &a, lights, 2, &options, 1, 0, "another light_detail");
    FIRST();
    options.alpha_threshold = (ssdgs_real)0.02;
    check_same(model, &a, lights, 2, &options, 0, 0, "another alpha_threshold");
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    v.gaussians[(SSDGS_POSITION + 2) * v.stride] *= (ssdgs_real)1.2; /* the topmost, and faint */
    v.gaussians[SSDGS_OPACITY * v.stride] = -3;
    FIRST();
    options.alpha_threshold = (ssdgs_real)0.1;
    check_same(model, &a, lights, 2, &options, 0, 0, "one that the topmost is below");
    for (int cue = 0; cue < 2; cue++) { /* the depth cue, or the flux, is wanted, and was not or was: a map
                                           with the cue is another one, one with the flux does for all */
        ssdgs_model *sees = model_of(context, FEWER, cue, !cue);
        for (int before = 0; before < 2; before++) {
            if (!before) (void)ssdgs_model_arrays(sees);
            options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
            render(sees, &a, lights, 2, &options, image[0], NULL);
            options.terms = SSDGS_ALL_TERMS;
            check_same(sees, &a, lights, 2, &options, 1, before && !cue ? 2 : 0, "what scatters is wanted");
            render(sees, &a, lights, 2, &options, image[0], NULL);
        }
        ssdgs_model_destroy(sees);
    }
    FIRST();
    options.terms = SSDGS_DIFFUSE_TERM;
    check_same(model, &a, lights, 2, &options, 1, 0, "no shadow");
    options.terms = SSDGS_ALL_TERMS;
    FIRST();
    render(other, &a, lights, 2, &options, image[1], NULL);
    check_same(model, &a, lights, 2, &options, 1, 2, "another model between");
    FIRST();
    ssdgs_model_view view = ssdgs_model_arrays(model);
    view.gaussians[SSDGS_POSITION * view.stride] += (ssdgs_real)0.2;
    check_same(model, &a, lights, 2, &options, 0, 0, "the model changed");
    ssdgs_model_destroy(other);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* Blocks of powers of two bytes, the last one given back first, as engines' allocators are: what grows may
   stay where it was. */
typedef union block {
    union block *next;
    size_t size;
    unsigned char room[64];
} block;
static block *pool[64];

static int size_class(size_t bytes) {
    int k = 7;
    while ((size_t)1 << k < bytes + sizeof(block)) k++;
    return k;
}

static void *pool_allocate(void *user, size_t bytes) {
    const int k = size_class(bytes);
    block *b = pool[k];
    (void)user;
    if (b) pool[k] = b->next;
    else b = (block *)malloc((size_t)1 << k);
    if (!b) return NULL;
    b->size = bytes;
    return b + 1;
}

static void pool_release(void *user, void *memory) {
    block *b = (block *)memory - 1;
    const int k = size_class(b->size);
    (void)user;
    b->next = pool[k];
    pool[k] = b;
}

static void pool_empty(void) {
    for (int k = 0; k < 64; k++)
        while (pool[k]) {
            block *next = pool[k]->next;
            free(pool[k]);
            pool[k] = next;
        }
}

/* A random walk: each frame one thing or two change, of camera, lights, options, planes asked for and model,
   now and then a call fails or another model is evaluated. A context that keeps what it can, its memory from
   a pool, has the bits of one that forgets each time. */
static void test_walk(void) {
    enum { FRAMES = 400, VIEWS = 3, LIGHTS = 3, MODELS = 2, PLANE_COUNT = 8, VALUES = 17 };
    static ssdgs_real planes[2][PIXELS * VALUES];
    static unsigned char photograph[PIXELS * 4];
    ssdgs_context *context[2] = {NULL, NULL};
    ssdgs_render_options options = ssdgs_render_options_default();
    int which = 0, view = 0, light_count = 1, wanted = 0, cameras_kept = 0, lights_cached = 0, some_kept = 0,
        failures = 0;
    uint64_t at = 7000000;
#define PICK(n) ((int)(draw(at++) * (n)))
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.allocator.allocate = pool_allocate;
    desc.allocator.release = pool_release;
    ssdgs_model *models[2][MODELS];
    for (int k = 0; k < 2; k++) {
        if (!CHECK(!ssdgs_context_create(k ? NULL : &desc, &context[k]))) exit(1);
        for (int i = 0; i < MODELS; i++) models[k][i] = make_model(context[k], FEWER);
        models[k][1]->settings.asg = SSDGS_ASG_GEOMETRIC;
    }
    ssdgs_camera cameras[VIEWS];
    for (int i = 0; i < VIEWS; i++) cameras[i] = camera_at(2 * i);
    ssdgs_light lights[LIGHTS];
    for (int i = 0; i < LIGHTS; i++) lights[i] = light_at(1 + i);
    for (int frame = 0; frame < FRAMES; frame++) {
        const int changes = 1 + PICK(2);
        ssdgs_photo photo;
        ssdgs_metrics metrics;
        ssdgs_light other;
        for (int change = 0; change < changes; change++) {
            const int kind = PICK(20), channel = PICK(2) ? PICK(3) : PICK(SSDGS_CHANNELS),
                      gaussian = PICK(FEWER), light = PICK(LIGHTS);
            const ssdgs_real value = (ssdgs_real)draw(at++);
            switch (kind) {
            case 0: view = PICK(VIEWS); break;
            case 1: which = PICK(MODELS); break;
            case 2: light_count = PICK(LIGHTS + 1); break;
            case 3: lights[light].position[PICK(3)] += value - (ssdgs_real)0.5; break;
            case 4: lights[light].intensity[PICK(3)] = value; break;
            case 5: other = lights[light], lights[light] = lights[0], lights[0] = other; break;
            case 6: wanted = PICK(1 << (PLANE_COUNT - 1)); break;
            case 7: options.max_error = PICK(2) ? 0 : value / 4; break;
            case 8: options.terms = PICK(SSDGS_ALL_TERMS + 1); break;
            case 9: options.light_detail = PICK(2) ? 1 : (ssdgs_real)0.3 + value; break;
            case 10: options.alpha_threshold = (ssdgs_real)0.001 + value / 50; break;
            case 11: options.stop = PICK(2) ? 0 : value / 50; break;
            case 12: options.antialias = PICK(2); break;
            case 13: options.background[PICK(3)] = value; break;
            case 14: options.terms = SSDGS_ALL_TERMS; break;
            case 15:
                for (int i = 0; i < VIEWS; i++) cameras[i].width = SIDE / (2 + light);
                break;
            case 16:
                for (int k = 0; k < 2; k++) CHECK(!ssdgs_model_sort(models[k][which]));
                break;
            case 18: options.transport_detail = PICK(2) ? 1 : (ssdgs_real)0.3 + value; break;
            case 17: /* the model's own, in both contexts */
                for (int k = 0; k < 2; k++) {
                    const ssdgs_model_view v = ssdgs_model_arrays(models[k][which]);
                    v.gaussians[(size_t)channel * v.stride + (size_t)gaussian] += 2 * value - 1;
                    v.scattering[channel] += value - (ssdgs_real)0.5;
                }
                break;
            default: /* the first context's alone */
                memset(&photo, 0, sizeof photo);
                photo.camera = cameras[view];
                photo.light = lights[light];
                photo.pixels = photograph;
                CHECK(!ssdgs_evaluate(models[0][PICK(MODELS)], &photo, options.background, NULL, &metrics));
                photo.camera.fx = 0;
                failures +=
                    ssdgs_render(models[0][which], &photo.camera, lights, light_count, NULL) != SSDGS_OK;
            }
        }
        memset(planes, 0, sizeof planes);
        ssdgs_render_stats stats[2];
        for (int k = 0; k < 2; k++) {
            ssdgs_image out;
            ssdgs_real **const plane[PLANE_COUNT] = {&out.color,      &out.alpha,   &out.depth,
                                                     &out.normal,     &out.diffuse, &out.specular,
                                                     &out.scattering, &out.shadow};
            static const int first[PLANE_COUNT] = {0, 3, 4, 5, 8, 11, 14, 14};
            memset(&out, 0, sizeof out);
            for (int i = 0; i < PLANE_COUNT; i++)
                if (!i || (wanted >> (i - 1) & 1 && !(i == PLANE_COUNT - 1 && out.scattering)))
                    *plane[i] = planes[k] + PIXELS * first[i];
            ssdgs__frame_memory *memory = models[k][which]->frame;
            if (k && memory) memory->ready = 0;
            CHECK(!ssdgs_render_ex(models[k][which], cameras + view, lights, light_count, &options, &out,
                                   stats + k));
        }
        cameras_kept += stats[0].camera_cached;
        lights_cached += stats[0].lights_cached > 0;
        some_kept += stats[0].lights_cached > 0 && stats[0].lights_cached < light_count;
        CHECK(!stats[1].camera_cached && !stats[1].lights_cached);
        CHECK(stats[0].shaded == stats[1].shaded && stats[0].skipped == stats[1].skipped &&
              stats[0].instances == stats[1].instances && stats[0].light_views == stats[1].light_views);
        if (!CHECK(!memcmp(planes[0], planes[1], sizeof planes[0]))) printf("    frame %d\n", frame);
    }
#undef PICK
    printf("lights kept in %d of %d frames, some of them in %d\n", lights_cached, FRAMES, some_kept);
    CHECK(failures > 5 && some_kept > FRAMES / 64 && cameras_kept > FRAMES / 4 &&
          lights_cached > FRAMES / 16);
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < MODELS; i++) ssdgs_model_destroy(models[k][i]);
        ssdgs_context_destroy(context[k]);
    }
    pool_empty();
}

/* Whether values are within bounds: whatever their number, and wherever the one is that is not. */
static void test_within(void) {
    enum { MANY = 37 };
    const ssdgs_real outside[4] = {(ssdgs_real)2.5, (ssdgs_real)-2.5, (ssdgs_real)INFINITY, (ssdgs_real)NAN};
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        const ssdgs__kernels *k = ssdgs__table(isa);
        for (size_t n = 0; k && n <= MANY; n++) {
            ssdgs_real values[MANY + 1];
            for (size_t i = 0; i <= n; i++) values[i] = i % 2 ? 2 : -2;
            values[n] = 9;
            CHECK(k->within(values, n, 2));
            for (size_t i = 0; i < 4 * n; i++) {
                const ssdgs_real was = values[i / 4];
                values[i / 4] = outside[i % 4];
                CHECK(!k->within(values, n, 2));
                values[i / 4] = was;
            }
        }
    }
}

/* A round Gaussian at the picture's corner, whose box holds the corner's pixel and whose own pixels all lie
   beside the picture, is not shaded. */
static void test_beside_the_picture(void) {
    static const double at[2] = {2.5, 6.2};
    const ssdgs_real eye[3] = {0, -3, 0};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, 5, 5);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        ssdgs_context *context = NULL;
        ssdgs_model *model = NULL;
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.isa = (ssdgs_isa)isa;
        if (!ssdgs__table(isa)) continue;
        if (!CHECK(!ssdgs_context_create(&desc, &context)) ||
            !CHECK(!ssdgs_model_create(context, NULL, 2, &model)))
            exit(1);
        for (int i = 0; i < 2; i++) {
            ssdgs_gaussian g = ssdgs_gaussian_default();
            g.position[0] = (ssdgs_real)((at[i] - (double)camera.cx) * 3 / (double)camera.fx);
            g.position[2] = (ssdgs_real)((at[i] - (double)camera.cy) * -3 / (double)camera.fy);
            for (int c = 0; c < 3; c++) g.scale[c] = (ssdgs_real)0.3;
            g.opacity = (ssdgs_real)0.03; /* it ends two pixels from its centre */
            CHECK(!ssdgs_model_set(model, i, &g));
        }
        ssdgs_real color[5 * 5 * 3], alpha[5 * 5], most = 0;
        ssdgs_image out;
        ssdgs_render_stats stats;
        memset(&out, 0, sizeof out);
        out.color = color;
        out.alpha = alpha;
        CHECK(!ssdgs_render_ex(model, &camera, NULL, 0, &options, &out, &stats));
        for (int i = 0; i < 5 * 5; i++) most = alpha[i] > most ? alpha[i] : most;
        CHECK(most == alpha[2 * 5 + 2] && most > (ssdgs_real)0.02 && stats.shaded == 1);
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
}

/* In every pixel the weights of what is left unshaded sum to max_error at most, and the stages say what was
   left. */
static void test_max_error(void) {
    static const double bounds[3] = {1.0 / 64, 1.0 / 16, 1.0 / 4};
    ssdgs_context *context = NULL;
    ssdgs_light light = light_at(1);
    ssdgs_camera camera = camera_at(0);
    int last = COUNT;
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.isa = (ssdgs_isa)isa;
        if (!ssdgs__table(isa)) continue;
        if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
        ssdgs_model *model = make_model(context, COUNT);
        int b;
        for (b = 0, last = COUNT; b < 3; b++) {
            ssdgs_render_options options = ssdgs_render_options_exact();
            double most = 0;
            int glimpsed = 0;
            options.max_error = (ssdgs_real)bounds[b];
            ssdgs_frame frame;
            CHECK(!ssdgs__frame_of_model(&frame, model, &camera, &light, 1, &options, 0, 0));
            CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_SHADE));
            for (int i = 0; i < COUNT; i++) {
                frame.color[4 * i] = frame.seen[i] == SSDGS_SKIPPED;
                glimpsed += frame.seen[i] == SSDGS_SKIPPED;
            }
            frame.layer_count = 0; /* the weights alone */
            CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_COMPOSITE));
            for (int i = 0; i < PIXELS; i++)
                most = (double)frame.pixels[i] > most ? (double)frame.pixels[i] : most;
            CHECK(most > 0 && most <= bounds[b] * (1 + 1e-5));
            CHECK(glimpsed > 0 && frame.shaded_count < last);
            last = frame.shaded_count;
        }
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
}

/* Faint layers behind each other weigh little each and much together: the budget ends what is passed over. */
static void test_spent_budget(void) {
    enum { LAYERS = 200 };
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    ssdgs_camera camera = camera_at(0);
    ssdgs_render_options options = ssdgs_render_options_exact();
    double most = 0;
    int glimpsed = 0;
    options.max_error = (ssdgs_real)0.5;
    if (!CHECK(!ssdgs_context_create(NULL, &context)) ||
        !CHECK(!ssdgs_model_create(context, NULL, LAYERS, &model)))
        exit(1);
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (int i = 0; i < LAYERS; i++) {
        v.gaussians[SSDGS_POSITION * v.stride + (size_t)i] = (ssdgs_real)(0.001 * i);
        v.gaussians[SSDGS_OPACITY * v.stride + (size_t)i] = (ssdgs_real)-4.6;
        for (int c = 0; c < 3; c++)
            v.gaussians[(size_t)(SSDGS_LOG_SCALE + c) * v.stride + (size_t)i] = (ssdgs_real)-1.5;
    }
    ssdgs_frame frame;
    CHECK(!ssdgs__frame_of_model(&frame, model, &camera, NULL, 0, &options, 0, 0));
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_SHADE));
    for (int i = 0; i < LAYERS; i++) {
        frame.color[4 * i] = frame.seen[i] == SSDGS_SKIPPED;
        glimpsed += frame.seen[i] == SSDGS_SKIPPED;
    }
    CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_COMPOSITE));
    for (int i = 0; i < PIXELS; i++) most = (double)frame.pixels[i] > most ? (double)frame.pixels[i] : most;
    CHECK(most > 0.3 && most <= 0.5 * (1 + 1e-5));
    CHECK(glimpsed > 0 && frame.shaded_count > LAYERS / 4);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* The presets against the exact image, and the numbers that describe a frame. */
static void test_presets(void) {
    ssdgs_context *context = NULL;
    ssdgs_light light = light_at(0.5);
    ssdgs_camera camera = camera_at(0);
    ssdgs_image out;
    memset(&out, 0, sizeof out);
    static const char *const names[4] = {"exact", "default", "fast", "preview"};
    static const double least[4] = {0, 50, 35, 25}; /* dB */
    ssdgs_render_options options[4];
    options[0] = ssdgs_render_options_exact();
    options[1] = ssdgs_render_options_default();
    options[2] = ssdgs_render_options_fast();
    options[3] = ssdgs_render_options_preview();
    if (!CHECK(!ssdgs_context_create(NULL, &context))) exit(1);
    ssdgs_model *model = make_model(context, COUNT);
    ssdgs_render_stats stats[4];
    for (int o = 0; o < 4; o++) {
        double squares = 0;
        render(model, &camera, &light, 1, options + o, image[o > 0], stats + o);
        for (int i = 0; o && i < PIXELS * 3; i++) squares += pow((double)(image[1][i] - image[0][i]), 2);
        const double psnr = ssdgs__psnr(squares / (PIXELS * 3));
        if (o) printf("%s against exact: %.1f dB\n", names[o], psnr);
        CHECK(psnr > least[o]);
        CHECK(stats[o].gaussians == COUNT && stats[o].light_views == 1 && stats[o].rejected == 0);
        CHECK(stats[o].network_work > 0.3 && stats[o].network_work <= 1);
    }
    CHECK(stats[0].skipped == 0 && stats[1].skipped > 0);
    CHECK(stats[0].shaded >= stats[1].shaded + stats[1].skipped - 1 && stats[2].shaded < stats[1].shaded &&
          stats[3].shaded < stats[2].shaded);
    options[0].max_error = 2;
    CHECK(ssdgs_render_ex(model, &camera, &light, 1, options, &out, NULL) == SSDGS_ERR_ARGUMENT);
    options[0] = ssdgs_render_options_exact();
    options[0].light_detail = 0;
    CHECK(ssdgs_render_ex(model, &camera, &light, 1, options, &out, NULL) == SSDGS_ERR_ARGUMENT);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

static int all_rows(const ssdgs_real *rows, int count, uint16_t *list) {
    (void)rows;
    for (int i = 0; i < count; i++) list[i] = (uint16_t)i;
    return count;
}

/* A network half of whose neurons are dead in the block gives the bits of one in which nothing is left out,
   both ways. */
static void test_dead_neurons(void) {
    enum {
        INS = 20,
        WIDE = 37,
        OUTS = 3,
        WEIGHTS = (INS + 1) * WIDE + (WIDE + 1) * WIDE + (WIDE + 1) * OUTS
    };
    static const int sizes[4] = {INS, WIDE, WIDE, OUTS};
    static ssdgs_real weights[WEIGHTS], inputs[INS * SSDGS__BLOCK],
        outputs[2][(2 * WIDE + OUTS) * SSDGS__BLOCK];
    static ssdgs_real gradient[2][(32 + 16) * WIDE + (48 + 16) * (WIDE + OUTS)], d[2][64 * SSDGS__BLOCK],
        spare[64 * SSDGS__BLOCK], transposed[64 * SSDGS__BLOCK];
    static ssdgs_real sums[WEIGHTS];
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        const ssdgs__kernels *table = ssdgs__table(isa);
        if (!table) continue;
        for (int i = 0; i < WEIGHTS; i++) weights[i] = (ssdgs_real)(draw((uint64_t)i) - 0.5);
        for (int i = 0; i < INS * SSDGS__BLOCK; i++) inputs[i] = (ssdgs_real)draw(9000 + (uint64_t)i);
        for (int i = 0; i < WIDE; i += 2)
            weights[INS * WIDE + i] = weights[(INS + 1) * WIDE + WIDE * WIDE + i] = -100; /* biases */
        const ssdgs__network net = {sizes, 3, weights};
        ssdgs_real *dinputs[2];
        uint64_t few = 0;
        for (int part = 0; part < 2; part++) {
            ssdgs__kernels k = *table;
            if (part) k.live_rows = all_rows;
            ssdgs__row_lists lists;
            ssdgs__row_lists_fill(&lists);
            memset(gradient[part], 0, sizeof gradient[part]);
            const ssdgs__network_scratch backward = {d[part], spare, transposed};
            ssdgs__network_forward(&k, &net, NULL, &lists, inputs, outputs[part]);
            few = part ? few : lists.multiplied;
            CHECK(part ? lists.multiplied == lists.multipliable : lists.multiplied < lists.multipliable);
            for (int i = 0; i < OUTS * SSDGS__BLOCK; i++)
                d[part][i] = (ssdgs_real)(draw(5000 + (uint64_t)i) - 0.5);
            dinputs[part] = ssdgs__network_backward(&k, &net, inputs, outputs[part], &backward, &lists, INS,
                                                    gradient[part]);
            if (dinputs[part] == spare) memcpy(d[part], spare, sizeof spare);
        }
        CHECK(!memcmp(outputs[0], outputs[1], sizeof outputs[0]));
        /* nor does it change a bit to sum up once what two lights' inputs have in common */
        static ssdgs_real together[WIDE * SSDGS__BLOCK];
        ssdgs__common common = {7, 0, together};
        for (int light = 0; light < 2; light++) {
            ssdgs__row_lists lists;
            ssdgs__row_lists_fill(&lists);
            for (int i = 0; light && i < INS * SSDGS__BLOCK; i++)
                if (i < 7 * SSDGS__BLOCK) inputs[i] = 1e9f; /* is not read again */
            memset(outputs[1], 0, sizeof outputs[1]);
            ssdgs__network_forward(table, &net, &common, &lists, inputs, outputs[1]);
            CHECK(common.made && !memcmp(outputs[0], outputs[1], sizeof outputs[0]));
            CHECK(lists.multiplied == few - (uint64_t)(light ? 7 * WIDE : 0));
        }
        CHECK(!memcmp(gradient[0], gradient[1], sizeof gradient[0]));
        CHECK(!memcmp(d[0], d[1], INS * SSDGS__BLOCK * sizeof d[0][0]));
        ssdgs__sum_slots(sizes, 3, gradient[0], 0, 1, 0, 1, sums);
        CHECK(sums[INS * WIDE + 1] != 0 && sums[INS * WIDE] == 0);
    }
}

/* However far out a coordinate is, its sines and cosines are none of them beyond 1. */
static void test_far_out(void) {
    static ssdgs_real in[SSDGS__BLOCK], out[9 * SSDGS__BLOCK];
    for (int i = 0; i < SSDGS__BLOCK; i++) in[i] = (ssdgs_real)((i & 1 ? -1 : 1) * pow(10, i / 2));
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        const ssdgs__kernels *table = ssdgs__table(isa);
        double most = 0;
        if (!table) continue;
        table->encode(out, in, NULL, 1, 1, 4);
        for (int i = SSDGS__BLOCK; i < 9 * SSDGS__BLOCK; i++)
            most = fabs((double)out[i]) <= most ? most : fabs((double)out[i]);
        CHECK(most > 0.9 && most < 1.01);
    }
}

/* Frozen networks get no gradient, and take none from anybody else. */
static void test_frozen(void) {
    ssdgs_context *context = NULL;
    ssdgs_light light = light_at(1);
    ssdgs_camera camera = camera_at(0);
    ssdgs_real *planes = NULL;
    if (!CHECK(!ssdgs_context_create(NULL, &context))) exit(1);
    ssdgs_model *model = make_model(context, COUNT);
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&model->settings, first);
    const size_t n = model->capacity * SSDGS_CHANNELS;
    for (int part = 0; part < 4; part++) {
        ssdgs_frame frame;
        CHECK(!ssdgs__frame_of_model(&frame, model, &camera, &light, 1, NULL, 0, 1));
        CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_COMPOSITE));
        for (size_t i = 0; i < PIXELS * 4; i++) frame.pixel_gradient[i] = (ssdgs_real)(draw(i) - 0.5);
        frame.frozen[0] = part & 1;
        frame.frozen[1] = part >> 1;
        CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_COMPOSITE_BACKWARD, SSDGS_STAGE_PROJECT_BACKWARD));
        for (int g = 0; g < 2; g++) {
            double sum = 0;
            for (size_t i = first[g ? SSDGS__SHADOW_NET : SSDGS__SCATTERING_NET];
                 i < first[(g ? SSDGS__SHADOW_NET : SSDGS__SCATTERING_NET) + 1]; i++)
                sum += fabs((double)frame.global_gradient[i]);
            CHECK(frame.frozen[g] ? sum == 0 : sum > 0);
        }
        if (!part)
            planes = (ssdgs_real *)memcpy(malloc(n * sizeof *planes), frame.gradient, n * sizeof *planes);
        else CHECK(!memcmp(planes, frame.gradient, n * sizeof *planes));
    }
    free(planes);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* Where all that is glimpsed may go unshaded, it has the first such Gaussian's look, not that of one that is
   not drawn. */
static void test_all_glimpsed(void) {
    static ssdgs_real planes[PIXELS * 5];
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    ssdgs_camera camera = camera_at(0);
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_image out;
    memset(&out, 0, sizeof out);
    out.color = planes;
    out.alpha = planes + 3 * PIXELS;
    out.depth = planes + 4 * PIXELS;
    if (!CHECK(!ssdgs_context_create(NULL, &context)) ||
        !CHECK(!ssdgs_model_create(context, NULL, 3, &model)))
        exit(1);
    double depth[2];
    for (int pass = 0; pass < 2; pass++) {
        options.max_error = (ssdgs_real)(pass ? 0.5 : 0);
        ssdgs_model_view v = ssdgs_model_arrays(model);
        for (int i = 0; i < 3; i++) {
            v.gaussians[SSDGS_OPACITY * v.stride + (size_t)i] = (ssdgs_real)-4.5;
            for (size_t c = 0; c < 3; c++)
                v.gaussians[(SSDGS_LOG_SCALE + c) * v.stride + (size_t)i] = (ssdgs_real)-1.5;
        }
        v.gaussians[0] = (ssdgs_real)NAN;
        for (size_t c = 0; c < 3; c++)
            v.gaussians[(SSDGS_POSITION + c) * v.stride + 1] =
                -3 * camera.view[8 + c]; /* behind the camera */
        CHECK(!ssdgs_render_ex(model, &camera, NULL, 0, &options, &out, NULL));
        int i;
        for (depth[pass] = 0, i = 0; i < PIXELS; i++)
            if ((double)out.alpha[i] > 0.005) depth[pass] = (double)(out.depth[i] / out.alpha[i]);
    }
    CHECK(depth[0] > 0.5 && fabs(depth[1] - depth[0]) < 1e-4 * depth[0]);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

int main(void) {
    test_kept();
    test_walk();
    test_within();
    test_beside_the_picture();
    test_max_error();
    test_spent_budget();
    test_all_glimpsed();
    test_presets();
    test_dead_neurons();
    test_far_out();
    test_frozen();
    TEST_END();
}
