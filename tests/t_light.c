/* Lights as engines have them, also as real64: without shadow, with a range, from all around, from the sky of
   an environment map. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/sky.h"
#include "scene.h"

static double exactly(double floats) { return real64 ? 1e-11 : floats; }

/* One large Gaussian at `at`, which faces `normal`. */
static ssdgs_model *one(const ssdgs_settings *settings, const double at[3], const double normal[3]) {
    ssdgs_model *model = NULL;
    ssdgs_gaussian g = ssdgs_gaussian_default();
    if (!CHECK(!ssdgs_model_create(context, settings, 1, &model))) exit(1);
    for (int c = 0; c < 3; c++) {
        g.position[c] = (ssdgs_real)at[c];
        g.normal[c] = (ssdgs_real)normal[c];
        g.scale[c] = (ssdgs_real)0.3;
        g.diffuse[c] = (ssdgs_real)(0.3 + 0.2 * c);
        g.specular[c] = (ssdgs_real)(0.5 - 0.1 * c);
    }
    g.opacity = (ssdgs_real)0.9;
    CHECK(!ssdgs_model_set(model, 0, &g));
    stir_networks(model, 5);
    return model;
}

static void middle_of(const picture *p, int plane, double rgb[3]) {
    for (int c = 0; c < 3; c++)
        rgb[c] = (double)p->value[plane * PIXELS + 3 * (SIDE / 2 * SIDE + SIDE / 2) + c];
}

/* ---- in the dark ---- */

enum { DEEP = 24 };
static ssdgs_real cue[DEEP];

static ssdgs_result keep_cue(void *user, struct ssdgs_frame *frame, ssdgs_stage stage) {
    (void)user;
    if (stage == SSDGS_STAGE_COUNT) memcpy(cue, frame->depth_cue, sizeof cue);
    return SSDGS_OK;
}

/* A row of Gaussians deep in the shadow of a wall is as deep in it whether one lies in one tile of the
   light's map or in two. */
static void test_deep(void) {
    ssdgs_gpu_hook hook;
    ssdgs_context_desc desc;
    ssdgs_context *own = NULL;
    ssdgs_model *model = NULL;
    ssdgs_settings settings = ssdgs_settings_default();
    const ssdgs_camera camera = camera_from(0, -3, -1);
    const ssdgs_light light = parallel_light(0, 0, 1);
    ssdgs_render_options options = ssdgs_render_options_exact();
    const ssdgs_image image = planes_of(shot);
    memset(&hook, 0, sizeof hook);
    memset(&desc, 0, sizeof desc);
    hook.fetch = keep_cue;
    desc.gpu = &hook;
    settings.depth_cue = 1;
    settings.light_map.size = 256;
    CHECK(!ssdgs_context_create(&desc, &own) && !ssdgs_model_create(own, &settings, 8 * DEEP, &model));
    for (int i = 0; i < 8 * DEEP; i++) {
        ssdgs_gaussian g = ssdgs_gaussian_default();
        const int wall = i - DEEP;
        g.position[0] = (ssdgs_real)(wall < 0 ? i / (double)DEEP - 0.5 : wall % 48 / 40.0 - 0.6);
        g.position[1] = (ssdgs_real)(wall < 0 ? 0.03 : 0.2 * (wall / 48) - 0.3);
        g.position[2] = (ssdgs_real)(wall < 0 ? -0.5 : 0.5);
        for (int c = 0; c < 3; c++) g.scale[c] = (ssdgs_real)(wall < 0 || c == 2 ? 0.01 : 0.2);
        g.opacity = (ssdgs_real)(wall < 0 ? 0.9 : 0.99);
        CHECK(!ssdgs_model_set(model, i, &g));
    }
    options.stop = (ssdgs_real)1e-4;
    CHECK(!ssdgs_render_ex(model, &camera, &light, 1, &options, &image, NULL));
    for (int i = 0; i < DEEP; i++) CHECK(fabs((double)cue[i] - 1) < 0.05);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(own);
}

/* ---- without shadow, with a range, dark ---- */

static void test_unshadowed(ssdgs_model *model) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_light lights[2] = {point_light(2, -2, 2), parallel_light(0.6, 0, 0.8)};
    options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
    alone(model, &camera, lights, 2, &options, shot);
    options.terms |= SSDGS_SHADOW_TERM;
    lights[0].unshadowed = lights[1].unshadowed = 1;
    alone(model, &camera, lights, 2, &options, shot + 1);
    CHECK(same(shot, shot + 1) && !shot[1].stats.light_views);
    /* beside one with shadow, all terms: light adds up, S is a mean */
    options = ssdgs_render_options_exact();
    lights[0].unshadowed = 0;
    alone(model, &camera, lights, 1, &options, shot);
    alone(model, &camera, lights + 1, 1, &options, shot + 1);
    alone(model, &camera, lights, 2, &options, shot + 2);
    CHECK(shot[0].stats.light_views == 1 && !shot[1].stats.light_views && shot[2].stats.light_views == 1);
    for (int i = 0; i < 12 * PIXELS; i++) shot[0].value[i] += shot[1].value[i];
    for (int i = 17 * PIXELS; i < VALUES; i++) shot[0].value[i] = (shot[0].value[i] + shot[1].value[i]) / 2;
    CHECK_NEAR(shot[2].value, shot[0].value, 12 * PIXELS, exactly(3e-6), exactly(1e-5), "two lights");
    CHECK_NEAR(shot[2].value + 17 * PIXELS, shot[0].value + 17 * PIXELS, PIXELS, exactly(3e-6), exactly(1e-5),
               "S");
    /* what is kept of one kind does not serve the other */
    for (int turn = 0; turn < 4; turn++) {
        lights[0].unshadowed = turn & 1;
        alone(model, &camera, lights, 2, &options, shot + 1);
        alone(model, &camera, lights, 2, &options, shot + 3);
        CHECK(same(shot + 1, shot + 3));
        if (!(turn & 1)) CHECK(same(shot + 1, shot + 2));
        else CHECK(!same(shot + 1, shot + 2));
    }
    for (int step = 0; step < 4; step++) { /* nor a map of where it was before it had none */
        lights[0].position[0] = (ssdgs_real)(step == 1 ? 2 : -2);
        lights[0].unshadowed = step == 2;
        alone(model, &camera, lights, 2, &options, shot + (step ? 1 : 0));
    }
    CHECK(same(shot, shot + 1));
    const ssdgs_object object = ssdgs_object_default(model);
    const ssdgs_real behind[3] = {(ssdgs_real)-0.6, 0, (ssdgs_real)-0.8};
    ssdgs_real fraction = 0;
    for (int unshadowed = 0; unshadowed < 2; unshadowed++) {
        lights[1].unshadowed = unshadowed;
        CHECK(!ssdgs_scene_light(scene, &object, 1, NULL, lights, 2, NULL));
        CHECK(!ssdgs_scene_shadow(scene, 1, behind, 1, &fraction));
        CHECK(unshadowed ? fraction >= 1 : fraction < (ssdgs_real)0.9);
    }
}

/* An LED is a point light that fades as cos^focus: of a Gaussian alone that factor, behind it nothing. A spot
   may have a focus within its cone; turned and mirrored worlds look the same. */
static void test_focus(ssdgs_model *single, const ssdgs_camera *camera) {
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_light light = point_light(0, -2, 2);
    double even[3], lit[3], want[3];
    alone(single, camera, &light, 1, &options, shot);
    middle_of(shot, 0, even);
    for (int i = 0; i < 6; i++) {
        static const double off[6] = {0, 0.3, 0.9, 1.5, 1.6, 0.3}; /* radians from the Gaussian */
        static const double focus[6] = {2, 2, 0.7, 1, 1, 0};
        light.kind = i == 1 ? SSDGS_LIGHT_SPOT : SSDGS_LIGHT_POINT;
        light.cone[0] = 1, light.cone[1] = 2;
        light.focus = (ssdgs_real)focus[i];
        light.direction[0] = (ssdgs_real)sin(off[i]);
        light.direction[1] = (ssdgs_real)(cos(off[i]) * sqrt(0.5));
        light.direction[2] = -light.direction[1];
        alone(single, camera, &light, 1, &options, shot + 1);
        middle_of(shot + 1, 0, lit);
        for (int c = 0; c < 3; c++) want[c] = even[c] * pow(fmax(cos(off[i]), 0), focus[i]);
        CHECK_NEAR(lit, want, 3, 1e-6, exactly(1e-5), "an LED's focus");
    }
    light.kind = SSDGS_LIGHT_SPOT; /* beside a cone so narrow that its cosines are 1 it is dark */
    light.cone[0] = 0, light.cone[1] = (ssdgs_real)1e-9;
    light.direction[0] = (ssdgs_real)sin(0.01);
    light.direction[1] = (ssdgs_real)(1.0004 * cos(0.01) * sqrt(0.5)); /* not quite a unit vector */
    light.direction[2] = -light.direction[1];
    alone(single, camera, &light, 1, &options, shot);
    middle_of(shot, 0, lit);
    CHECK(lit[0] == 0 && lit[1] == 0 && lit[2] == 0);
    light.direction[1] = (ssdgs_real)(cos(0.01) * sqrt(0.5));
    light.direction[2] = -light.direction[1];
    light.kind = SSDGS_LIGHT_POINT;
    light.focus = 3;
    alone(single, camera, &light, 1, &options, shot);
    middle_of(shot, 0, want);
    /* a focus or an LED's direction that changes leaves the light's map, and does what it does in a first
     * frame */
    for (int i = 0; i < 2; i++) {
        ssdgs_light changed = light;
        if (i) changed.focus = 8;
        else changed.direction[0] = 0, changed.direction[1] = 1, changed.direction[2] = 0;
        alone(single, camera, &changed, 1, &options, shot + 1);
        CHECK(shot[1].stats.lights_cached == 1 && !same(shot, shot + 1));
        ssdgs_model_arrays(single); /* forgets */
        alone(single, camera, &changed, 1, &options, shot + 2);
        CHECK(shot[2].stats.lights_cached == 0 && same(shot + 1, shot + 2));
    }
    const ssdgs_object object = placed(single, 0.7, 1, 1, 0.3, -0.2, 0.1);
    ssdgs_camera seen = *camera;
    ssdgs_light there = light;
    to_world(&object, light.position, 0, there.position);
    to_world(&object, light.direction, 1, there.direction);
    for (int i = 0; i < 3; i++) { /* view x = seen (to_world x) */
        ssdgs_real *row = seen.view + 4 * i;
        row[3] = camera->view[4 * i + 3];
        to_world(&object, camera->view + 4 * i, 1, row);
        for (int c = 0; c < 3; c++) row[3] -= row[c] * object.to_world[4 * c + 3];
    }
    together(&object, 1, &seen, &there, 1, &options, shot + 1);
    middle_of(shot + 1, 0, lit);
    CHECK_NEAR(lit, want, 3, 0, exactly(1e-4), "an LED in a world that is turned");
    for (int i = 0; i < 4; i++) {
        static const char *const words[4] = {"focus = -1", "focus = 1001", "focus = nan", "unit vector"};
        ssdgs_image image = {0, shot[1].value, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
        light.focus = i == 0 ? -1 : i == 1 ? 1001 : i == 2 ? (ssdgs_real)NAN : 1;
        if (i == 3) light.direction[0] += 1;
        CHECK(ssdgs_render_ex(single, camera, &light, 1, &options, &image, NULL) == SSDGS_ERR_ARGUMENT);
        if (!CHECK(strstr(ssdgs_error_message(context), words[i]) != NULL))
            printf("    %s\n", ssdgs_error_message(context));
    }
}

static void test_range(ssdgs_model *model) {
    static const double at[3] = {0, 0, 0}, up[3] = {0, -0.6, 0.8};
    const ssdgs_settings settings = small_settings();
    ssdgs_model *single = one(&settings, at, up);
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_light light = point_light(0, -2, 2);
    double free[3], faded[3];
    alone(single, &camera, &light, 1, &options, shot);
    middle_of(shot, 0, free);
    CHECK(free[0] > 1e-3);
    for (int i = 0; i < 5; i++) { /* for deferred terms the Gaussian's centre speaks for the pixel */
        static const double range[5] = {2.5, 2.9, 4, 100, 0};
        const double share = sqrt(8.0) / (range[i] > 0 ? range[i] : 1e30), left = 1 - pow(share, 4);
        light.range = (ssdgs_real)range[i];
        alone(single, &camera, &light, 1, &options, shot + 1);
        middle_of(shot + 1, 0, faded);
        double want[3];
        for (int c = 0; c < 3; c++) want[c] = free[c] * fmax(left, 0);
        CHECK_NEAR(faded, want, 3, 1e-6, exactly(1e-5), "the range");
    }
    /* a world of twice the size has twice the range */
    ssdgs_object object = ssdgs_object_default(single);
    light.range = 4;
    alone(single, &camera, &light, 1, &options, shot);
    middle_of(shot, 0, free);
    for (int i = 0; i < 12; i++) object.to_world[i] *= 2;
    ssdgs_camera doubled = camera;
    ssdgs_light far_light = light;
    far_light.range = 8;
    for (int c = 0; c < 3; c++) {
        doubled.view[4 * c + 3] *= 2;
        far_light.position[c] *= 2;
        far_light.intensity[c] *= 4;
    }
    together(&object, 1, &doubled, &far_light, 1, &options, shot + 1);
    middle_of(shot + 1, 0, faded);
    CHECK_NEAR(faded, free, 3, 0, exactly(1e-4), "the range of a large world");
    test_focus(single, &camera);
    ssdgs_model_destroy(single);
    /* blocks that no light reaches are left out, but where S is asked for */
    light = point_light(0.8, -0.8, 0.8);
    light.range = (ssdgs_real)1.2;
    ssdgs_image image = {0, shot[1].value, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    ssdgs_render_stats stats;
    alone(model, &camera, &light, 1, &options, shot);
    CHECK(!ssdgs_render_ex(model, &camera, &light, 1, &options, &image, &stats));
    CHECK(!memcmp(shot[0].value, shot[1].value, 3 * PIXELS * sizeof(ssdgs_real)));
    double sum = 0;
    for (int i = 0; i < 3 * PIXELS; i++) sum += (double)shot[0].value[i];
    CHECK(sum > 1);
    /* a dark light is none */
    ssdgs_light two[2] = {light, point_light(-2, -2, 1)};
    memset(two[1].intensity, 0, sizeof two[1].intensity);
    alone(model, &camera, two, 2, &options, shot + 1);
    CHECK(!memcmp(shot[0].value, shot[1].value, 15 * PIXELS * sizeof(ssdgs_real)));
    CHECK(shot[1].stats.light_views == shot[0].stats.light_views);
    light.range = (ssdgs_real)-1;
    CHECK(ssdgs_render_ex(model, &camera, &light, 1, &options, &image, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "range = -1") != NULL);
}

/* ---- from all around ---- */

/* The irradiance, written out. */
static double even(const double sky[9], const double n[3]) {
    return sky[0] + sky[1] * n[1] + sky[2] * n[2] + sky[3] * n[0] + sky[4] * n[0] * n[1] +
           sky[5] * n[1] * n[2] + sky[6] * (3 * n[2] * n[2] - 1) + sky[7] * n[0] * n[2] +
           sky[8] * (n[0] * n[0] - n[1] * n[1]);
}

/* Every term, by a Gaussian alone, turned and mirrored too: a surface under an unshadowed light from its
   normal has the same irradiance, so diffuse light and scattering are the same. */
static void test_ambient_terms(int asg) {
    static const double at[3] = {0, 0, 0}, normal[3] = {0.48, -0.8, 0.36};
    ssdgs_settings settings = small_settings();
    settings.asg = asg;
    settings.terms &= ~SSDGS_SPECULAR_TERM;
    settings.light_scale = 3;
    ssdgs_model *single = one(&settings, at, normal);
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_render_options options = ssdgs_render_options_exact();
    for (int way = 0; way < 3; way++) {
        const ssdgs_object object =
            way ? placed(single, 0.7, 1.5, way == 2, 0, 0, 0) : ssdgs_object_default(single);
        const ssdgs_real own[3] = {(ssdgs_real)normal[0], (ssdgs_real)normal[1], (ssdgs_real)normal[2]};
        ssdgs_real turned[3];
        double n[3], want[3], got[3], length = way ? 1.5 : 1;
        to_world(&object, own, 1, turned);
        for (int c = 0; c < 3; c++) n[c] = (double)turned[c] / length;
        ssdgs_light light = parallel_light(n[0], n[1], n[2]);
        light.unshadowed = 1;
        for (int c = 0; c < 3; c++) light.intensity[c] = 1;
        together(&object, 1, &camera, &light, 1, &options, shot);
        for (int term = 0; term < 9; term++) {
            double sky[9] = {4, 0, 0, 0, 0, 0, 0, 0, 0};
            sky[term] += 1.5;
            memset(options.ambient, 0, sizeof options.ambient);
            for (int i = 0; i < 9; i++)
                for (int c = 0; c < 3; c++) options.ambient[i][c] = (ssdgs_real)(sky[i] * (1 + c));
            together(&object, 1, &camera, NULL, 0, &options, shot + 1);
            middle_of(shot, 0, want);
            middle_of(shot + 1, 0, got);
            for (int c = 0; c < 3; c++) want[c] *= even(sky, n) * (1 + c);
            CHECK_NEAR(got, want, 3, 0, exactly(2e-5), "a term of ambient light");
            double scattered[3];
            middle_of(shot + 1, 9, scattered);
            CHECK_NEAR(scattered, got, 3, 0, exactly(1e-6), "ambient light counts as scattered");
        }
        memset(options.ambient, 0, sizeof options.ambient);
        for (int c = 0; c < 3; c++) options.ambient[0][c] = -1;
        together(&object, 1, &camera, NULL, 0, &options, shot + 1);
        middle_of(shot + 1, 0, got);
        CHECK(got[0] >= 0 && got[0] <= 0); /* no light below 0 */
    }
    ssdgs_model_destroy(single);
}

/* What of a sky of radiance 1 + 0.3 z the highlight of a Gaussian sends to the eye, by eqs. 10 and 12 as
   >>highlight_kernel and, geometric, >>asg_kernel have them, numerically. */
static double sky_in_highlight(const ssdgs_model *model, double lambda, double f0, const double n[3],
                               const double wo[3]) {
    const ssdgs_model_view v = ssdgs_model_peek(model);
    const int deferred = ssdgs_model_settings(model)->asg == SSDGS_ASG_DEFERRED;
    double sum = 0;
    enum { MANY = 200000 };
    for (int i = 0; i < MANY; i++) {
        double wi[3], h[3], length2 = 0, nh = 0, woh = 0, cosine = 0, glow = 0;
        direction_of(i, MANY, wi);
        for (int c = 0; c < 3; c++) {
            h[c] = wi[c] + wo[c];
            length2 += h[c] * h[c];
            cosine += n[c] * wi[c];
        }
        if (cosine <= 0) continue;
        const double radiance = 1 + 0.3 * wi[2];
        for (int c = 0; c < 3; c++) {
            h[c] /= sqrt(length2);
            nh += n[c] * h[c];
            woh += wo[c] * h[c];
        }
        for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
            const double weight =
                (double)(deferred ? v.asg_sigma[j] : v.gaussians[(size_t)(SSDGS_ASG_WEIGHT + j) * v.stride]);
            glow += log1p(exp(weight)) * exp(-exp((double)v.asg_sharpness[2 * j]) * lambda * (1 - nh * nh));
        }
        const double least = fmax(woh, (double)SSDGS__GRAZING), fresnel = f0 + (1 - f0) * pow(1 - woh, 5);
        sum += (deferred ? cosine / (least * least) : 1) * fresnel * glow * radiance * 4 * pi / (double)MANY;
    }
    return sum;
}

static void test_ambient_highlight(int asg) {
    static const double at[3] = {0, 0, 0}, normal[3] = {0, -0.8, 0.6};
    ssdgs_settings settings = small_settings();
    settings.terms = SSDGS_SPECULAR_TERM | SSDGS_DIFFUSE_TERM;
    settings.asg = asg;
    ssdgs_model *single = one(&settings, at, normal);
    const int deferred = asg == SSDGS_ASG_DEFERRED;
    ssdgs_render_options options = ssdgs_render_options_exact();
    for (int c = 0; c < 3; c++) {
        options.ambient[0][c] = (ssdgs_real)pi;
        options.ambient[2][c] = (ssdgs_real)(0.2 * pi);
    }
    for (int i = 0; i < (deferred ? 12 : 9); i++) { /* geometric ones do not end at the horizon */
        const double lambda = deferred ? 0.5 * pow(6, i % 3) : 1, f0 = deferred ? 0.3 : 0.04;
        const double turn = (i / 3) * 0.45; /* from the normal to the eye */
        const double eye[3] = {0, -0.8 * cos(turn) - 0.6 * sin(turn), 0.6 * cos(turn) - 0.8 * sin(turn)};
        const ssdgs_camera camera = camera_from(3 * eye[0], 3 * eye[1], 3 * eye[2]);
        ssdgs_gaussian g;
        double got[3];
        CHECK(!ssdgs_model_get(single, 0, &g));
        g.sharpness[0] = g.sharpness[1] = (ssdgs_real)lambda;
        g.f0 = (ssdgs_real)f0;
        memset(g.diffuse, 0, sizeof g.diffuse);
        CHECK(!ssdgs_model_set(single, 0, &g));
        for (size_t j = 0; !deferred && j < SSDGS_ASG_COUNT; j++) {
            const ssdgs_model_view v = ssdgs_model_arrays(single);
            v.gaussians[(SSDGS_ASG_WEIGHT + j) * v.stride] = (ssdgs_real)(j == (size_t)i % 3 * 2 ? 2 : -20);
        }
        alone(single, &camera, NULL, 0, &options, shot);
        middle_of(shot, 0, got);
        const double alpha = (double)shot[0].value[15 * PIXELS + SIDE / 2 * SIDE + SIDE / 2];
        const double want = sky_in_highlight(single, lambda, f0, normal, eye);
        const double ratio = got[0] / alpha / (double)g.specular[0] / want;
        if (!real64) printf("figure ambient_highlight_%d_%d %.3f of the integral\n", asg, i, ratio);
        CHECK(ratio > (deferred ? 0.9 : 0.7) && ratio < 1.2);
    }
    ssdgs_model_destroy(single);
}

/* The shares of an even sky against those of many directions; light over the whole sky adds to that of
 * lights. */
static void test_ambient_cloud(ssdgs_model *model, int number) {
    enum { MANY = 300, MOST = 400 };
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_render_options options = ssdgs_render_options_exact();
    const ssdgs_light light = point_light(2, -2, 2);
    alone(model, &camera, &light, 1, &options, shot);
    for (int i = 0; i < 9; i++)
        for (int c = 0; c < 3; c++) options.ambient[i][c] = (ssdgs_real)((i ? 0.4 : 2) - 0.1 * c);
    alone(model, &camera, NULL, 0, &options, shot + 1);
    alone(model, &camera, &light, 1, &options, shot + 2);
    for (int i = 0; i < 3 * PIXELS; i++) shot[0].value[i] += shot[1].value[i];
    CHECK_NEAR(shot[2].value, shot[0].value, 3 * PIXELS, exactly(3e-6), exactly(1e-5),
               "ambient beside a light");
    /* image = its components */
    for (int i = 0; i < 3 * PIXELS; i++)
        shot[0].value[i] =
            shot[2].value[i + 3 * PIXELS] + shot[2].value[i + 6 * PIXELS] + shot[2].value[i + 9 * PIXELS];
    CHECK_NEAR(shot[0].value, shot[2].value, 3 * PIXELS, exactly(3e-6), exactly(1e-5), "components");

    static ssdgs_real found[MOST], many[MOST], sums[MOST];
    const int count = model->count;
    ssdgs__frame_memory *memory = NULL;
    CHECK(count <= MOST);
    memcpy(found, model->sky_share.memory, (size_t)count * sizeof *found);
    memset(many, 0, sizeof many);
    memset(sums, 0, sizeof sums);
    for (int i = 0; i < MANY; i++) {
        double d[3];
        direction_of(i, MANY, d);
        const ssdgs_real direction[3] = {(ssdgs_real)d[0], (ssdgs_real)d[1], (ssdgs_real)d[2]};
        CHECK(!ssdgs__sky_shares_from(model, &memory, direction, many, sums));
    }
    ssdgs__frame_memory_destroy(context, memory);
    double error2 = 0, mean = 0, low = 1, high = 0;
    for (int i = 0; i < count; i++) {
        many[i] /= sums[i];
        error2 += (double)((found[i] - many[i]) * (found[i] - many[i])) / count;
        mean += (double)many[i] / count;
        low = fmin(low, (double)many[i]);
        high = fmax(high, (double)many[i]);
    }
    if (!real64)
        printf("figure sky_share_%d %.3f RMS from that of %d directions, mean %.2f, from %.2f to %.2f\n",
               number, sqrt(error2), MANY, mean, low, high);
    CHECK(sqrt(error2) < 0.1 && high - low > 0.4);
    /* all that ambient light brings goes with them; they are found once */
    for (int half = 0; half < 2; half++) {
        for (int i = 0; i < count; i++)
            ((ssdgs_real *)model->sky_share.memory)[i] = found[i] * (half ? (ssdgs_real)0.5 : 1);
        alone(model, &camera, NULL, 0, &options, shot + half);
    }
    for (int i = 0; i < 3 * PIXELS; i++) shot[0].value[i] *= (ssdgs_real)0.5;
    CHECK_NEAR(shot[1].value, shot[0].value, 3 * PIXELS, exactly(1e-7), exactly(1e-5), "half of the sky");
    memcpy(model->sky_share.memory, found, (size_t)count * sizeof *found);
    /* once a model, until it changes */
    const uint64_t known = model->sky_share_revision;
    alone(model, &camera, NULL, 0, &options, shot + 1);
    CHECK(model->sky_share_revision == known);
    (void)ssdgs_model_arrays(model);
    alone(model, &camera, NULL, 0, &options, shot + 2);
    CHECK(model->sky_share_revision != known && same(shot + 1, shot + 2));
    options.ambient[3][1] = (ssdgs_real)NAN;
    const ssdgs_image image = planes_of(shot);
    CHECK(ssdgs_render_ex(model, &camera, NULL, 0, &options, &image, NULL) == SSDGS_ERR_NONFINITE);
    CHECK(strstr(ssdgs_error_message(context), "ambient[3]") != NULL);
}

/* A sheet across each axis hides the sky from what faces it. */
static void test_sky_shares_of_a_sheet(void) {
    enum { ROW = 21, SHEET = ROW * ROW };
    const ssdgs_settings settings = small_settings();
    for (int axis = 0; axis < 3; axis++) {
        ssdgs_model *model = NULL;
        ssdgs_render_options options = ssdgs_render_options_exact();
        const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
        options.ambient[0][0] = 1;
        CHECK(!ssdgs_model_create(context, &settings, SHEET + 2, &model));
        for (int i = 0; i < SHEET + 2; i++) {
            ssdgs_gaussian g = ssdgs_gaussian_default();
            const int probe = i - SHEET;
            g.position[(axis + 1) % 3] = (ssdgs_real)(probe < 0 ? 0.05 * (i % ROW - ROW / 2) : 0);
            g.position[(axis + 2) % 3] = (ssdgs_real)(probe < 0 ? 0.05 * (i / ROW - ROW / 2) : 0.05 * probe);
            g.position[axis] = (ssdgs_real)(probe < 0 ? 0 : 0.12);
            for (int c = 0; c < 3; c++)
                g.normal[c] =
                    (ssdgs_real)(c == axis ? probe == 1 ? -1 : 1 : 0), /* the second probe faces the sheet */
                    g.scale[c] = (ssdgs_real)(probe >= 0  ? 0.01
                                              : c == axis ? 0.005
                                                          : 0.05);
            g.rotation[0] = 1;
            g.opacity = (ssdgs_real)(probe < 0 ? 0.99 : 0.1);
            CHECK(!ssdgs_model_set(model, i, &g));
        }
        alone(model, &camera, NULL, 0, &options, shot);
        CHECK(((ssdgs_real *)model->sky_share.memory)[SHEET] > (ssdgs_real)0.85 &&
              ((ssdgs_real *)model->sky_share.memory)[SHEET + 1] < (ssdgs_real)0.25);
        ssdgs_model_destroy(model);
    }
}

/* Two objects, one without shadows of its own: pixels of each are lit as it is alone. */
static void test_of_two_kinds(void) {
    ssdgs_settings settings = small_settings();
    ssdgs_light lights[2] = {point_light(0, -1, 4), parallel_light(0, 0, 1)};
    const ssdgs_camera camera = camera_from(0, -4, 2);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    double apart = 0, all = 0;
    ssdgs_object objects[2];
    lights[0].unshadowed = 1;
    for (int i = 0; i < 2; i++) {
        settings.terms = SSDGS_DIFFUSE_TERM | (i ? SSDGS_SHADOW_TERM : 0);
        objects[i] = ssdgs_object_default(cloud(&settings, 0, 192, 0.4));
        objects[i].to_world[3] = (ssdgs_real)(i ? 0.7 : -0.7);
        together(objects + i, 1, &camera, lights, 2, &options, shot + i);
    }
    together(objects, 2, &camera, lights, 2, &options, shot + 2);
    for (int i = 0; i < 3 * PIXELS; i++) {
        apart += fabs((double)(shot[2].value[i] - shot[0].value[i] - shot[1].value[i]));
        all += (double)shot[2].value[i];
    }
    CHECK(all > 1 && apart < 0.01 * all);
    for (int i = 0; i < 2; i++) ssdgs_model_destroy(objects[i].model);
}

/* ---- environment maps ---- */

enum { WIDE = 64, HIGH = 32, TEXELS = WIDE * HIGH };
static ssdgs_real sky[3 * TEXELS];

static double texel(int x, int y, double d[3]) {
    const double top = cos(pi * y / (double)HIGH), bottom = cos(pi * (y + 1) / (double)HIGH),
                 z = (top + bottom) / 2;
    d[0] = sqrt(1 - z * z) * cos(2 * pi * (x + 0.5) / (double)WIDE);
    d[1] = sqrt(1 - z * z) * sin(2 * pi * (x + 0.5) / (double)WIDE);
    d[2] = z;
    return 2 * pi / (double)WIDE * (top - bottom);
}

/* Blue above, brown below, a sun and a window. */
static void paint_sky(void) {
    for (int y = 0; y < HIGH; y++)
        for (int x = 0; x < WIDE; x++) {
            double d[3];
            texel(x, y, d);
            for (int c = 0; c < 3; c++)
                sky[3 * (y * WIDE + x) + c] =
                    (ssdgs_real)(d[2] > 0 ? 0.3 + 0.2 * c + 0.2 * d[0] : 0.2 - 0.05 * c + 0.05 * d[1]);
            if (x / 2 == 7 && y / 2 == 4)
                for (int c = 0; c < 3; c++) sky[3 * (y * WIDE + x) + c] = (ssdgs_real)(120 - 10 * c);
            if (x > 40 && x < 50 && y > 10 && y < 14)
                for (int c = 0; c < 3; c++) sky[3 * (y * WIDE + x) + c] = 3;
        }
}

static void test_environment_sums(void) {
    static ssdgs_light lights[256];
    ssdgs_real ambient[9][3];
    double total[3] = {0, 0, 0}, direction[3];
    paint_sky();
    for (int y = 0; y < HIGH; y++)
        for (int x = 0; x < WIDE; x++)
            for (int c = 0; c < 3; c++)
                total[c] += texel(x, y, direction) * (double)sky[3 * (y * WIDE + x) + c];
    for (int count = 0; count <= 256; count = count ? 4 * count : 1)
        for (int both = 0; both < 2; both++) {
            double sum[3] = {0, 0, 0};
            if (!count && !both) continue;
            CHECK(!sky_lights(sky, WIDE, HIGH, NULL, lights, count, both ? ambient : NULL));
            for (int c = 0; c < 3; c++) {
                for (int i = 0; i < count; i++) sum[c] += (double)lights[i].intensity[c];
                if (both) sum[c] += 4 * (double)ambient[0][c]; /* its mean times the sphere, over pi */
            }
            CHECK_NEAR(sum, total, 3, 0, real64 ? 1e-12 : 1e-5, "no light is lost");
            for (int i = 0; i < count; i++)
                CHECK(lights[i].kind == SSDGS_LIGHT_DIRECTIONAL && !lights[i].unshadowed &&
                      fabs((double)(lights[i].direction[0] * lights[i].direction[0] +
                                    lights[i].direction[1] * lights[i].direction[1] +
                                    lights[i].direction[2] * lights[i].direction[2]) -
                           1) < 1e-5);
        }
    /* with both, ambient light has what is less than twice the mean, as bright as that of what is more */
    double mean = 0, left = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int y = 0; y < HIGH; y++)
            for (int x = 0; x < WIDE; x++) {
                const ssdgs_real *rgb = sky + 3 * (y * WIDE + x);
                const double size = texel(x, y, direction);
                const double light =
                    0.2126 * (double)rgb[0] + 0.7152 * (double)rgb[1] + 0.0722 * (double)rgb[2];
                if (!pass) mean += light * size / (4 * pi);
                else left += (double)rgb[0] * size * (light > 2 * mean ? 2 * mean / light : 1);
            }
    CHECK(!sky_lights(sky, WIDE, HIGH, NULL, lights, 4, ambient));
    CHECK(fabs(4 * (double)ambient[0][0] / left - 1) < (real64 ? 1e-12 : 1e-5) && left < 0.9 * total[0]);
    /* two spots are two lights */
    memset(sky, 0, sizeof sky);
    sky[3 * (8 * WIDE + 20)] = sky[3 * (21 * WIDE + 23)] = 5;
    CHECK(!sky_lights(sky, WIDE, HIGH, NULL, lights, 2, NULL));
    for (int i = 0; i < 2; i++) {
        double to[2][3], off[2] = {0, 0};
        texel(20, 8, to[0]);
        texel(23, 21, to[1]);
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 3; c++) off[k] += fabs((double)lights[i].direction[c] + to[k][c]);
        CHECK(fmin(off[0], off[1]) < 1e-5 && lights[i].intensity[0] > 0);
    }
    /* of three, the two that are close share one */
    memset(sky, 0, sizeof sky);
    sky[3 * (15 * WIDE + 10)] = sky[3 * (16 * WIDE + 12)] = sky[3 * (15 * WIDE + 50)] = 5;
    CHECK(!sky_lights(sky, WIDE, HIGH, NULL, lights, 2, NULL));
    texel(50, 15, direction);
    double closest = 9;
    for (int i = 0; i < 2; i++) {
        double off = 0;
        for (int c = 0; c < 3; c++) off += fabs((double)lights[i].direction[c] + direction[c]);
        closest = fmin(closest, off);
    }
    CHECK(closest < 1e-5);
    /* the irradiance: exact for a sky of these terms */
    for (int turn = 0; turn < 2; turn++) {
        static const double terms[9] = {2, 0.3, -0.2, 0.4, 0.25, -0.3, 0.1, 0.2, -0.15}; /* of radiance */
        static const double factor[9] = {3.14159, 2.0944, 2.0944, 2.0944, 0.7854,
                                         0.7854,  0.7854, 0.7854, 0.7854};
        const ssdgs_real turned[9] = {0, 0, 1, 1, 0, 0, 0, 1, 0};
        for (int y = 0; y < HIGH; y++)
            for (int x = 0; x < WIDE; x++) {
                texel(x, y, direction);
                const double w[3] = {direction[2], direction[0], direction[1]};
                for (int c = 0; c < 3; c++)
                    sky[3 * (y * WIDE + x) + c] = (ssdgs_real)(even(terms, turn ? w : direction) * (1 + c));
            }
        CHECK(!sky_lights(sky, WIDE, HIGH, turn ? turned : NULL, NULL, 0, ambient));
        for (int i = 0; i < 27; i++)
            CHECK(fabs((double)ambient[i / 3][i % 3] - factor[i / 3] * terms[i / 3] * (1 + i % 3)) < 0.03);
    }
    /* one bright pixel is one light, where it is */
    memset(sky, 0, sizeof sky);
    sky[3 * (5 * WIDE + 9) + 1] = 7;
    const double size = texel(9, 5, direction);
    for (int turn = 0; turn < 2; turn++) {
        const ssdgs_real turned[9] = {0, 0, 1, 1, 0, 0, 0, 1, 0};
        const double w[3] = {direction[2], direction[0], direction[1]};
        CHECK(!sky_lights(sky, WIDE, HIGH, turn ? turned : NULL, lights, 3, NULL));
        const double *to = turn ? w : direction;
        for (int c = 0; c < 3; c++)
            CHECK(fabs((double)lights[0].direction[c] + to[c]) < 1e-6); /* where it is */
        CHECK(fabs((double)lights[0].intensity[1] - 7 * size) < 1e-6);
        CHECK(!(lights[0].intensity[0] > 0) && !(lights[1].intensity[1] > 0) &&
              !(lights[2].intensity[1] > 0));
    }
}

/* Pictures under a few lights beside those under 256. */
static double environment_psnr(const ssdgs_object *object, const ssdgs_camera *camera, int count, int both) {
    static ssdgs_light lights[256];
    ssdgs_render_options options = ssdgs_render_options_exact();
    CHECK(!sky_lights(sky, WIDE, HIGH, NULL, lights, count, both ? options.ambient : NULL));
    together(object, 1, camera, lights, count, &options, shot + 1);
    double error2 = 0, white = 0;
    for (int c = 0; c < 3 * PIXELS; c++) white = fmax(white, (double)shot[0].value[c]);
    for (int i = 0; i < 3 * PIXELS; i++) {
        double d[2];
        for (int k = 0; k < 2; k++) d[k] = (double)ssdgs_srgb_encode(shot[k].value[i] / (ssdgs_real)white);
        error2 += (d[1] - d[0]) * (d[1] - d[0]) / (3 * PIXELS);
    }
    return -10 * log10(error2);
}

static void test_environment_pictures(ssdgs_model *model) {
    const ssdgs_object object = ssdgs_object_default(model);
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    static ssdgs_light lights[256];
    double last = 0;
    paint_sky();
    CHECK(!sky_lights(sky, WIDE, HIGH, NULL, lights, 256, NULL));
    together(&object, 1, &camera, lights, 256, &exact, shot);
    for (int count = 1; count <= 64; count *= 4) {
        const double dB = environment_psnr(&object, &camera, count, 0);
        printf("figure environment_%d %.1f dB from 256 lights\n", count, dB);
        CHECK(dB > last);
        last = dB;
    }
    CHECK(last > 45);
    const double four = environment_psnr(&object, &camera, 4, 1),
                 none = environment_psnr(&object, &camera, 0, 1);
    printf("figure environment_4_ambient %.1f dB\nfigure environment_0_ambient %.1f dB\n", four, none);
    CHECK(four > 34 && none > 23);
}

static void test_refused(void) {
    static ssdgs_light lights[2];
    ssdgs_real ambient[9][3];
    const char *wrong = sky_lights(NULL, WIDE, HIGH, NULL, lights, 2, NULL);
    CHECK(wrong && strstr(wrong, "no pixels"));
    wrong = sky_lights(sky, 0, HIGH, NULL, lights, 2, NULL);
    CHECK(wrong && strstr(wrong, "no pixels"));
    wrong = sky_lights(sky, WIDE, 32769, NULL, lights, 2, NULL);
    CHECK(wrong && strstr(wrong, "32768 a side"));
    wrong = sky_lights(sky, WIDE, HIGH, NULL, NULL, 2, NULL);
    CHECK(wrong && strstr(wrong, "there must be an array"));
    wrong = sky_lights(sky, WIDE, HIGH, NULL, lights, -1, NULL);
    CHECK(wrong && strstr(wrong, "0 to 65536 lights"));
    for (int bad = 0; bad < 3; bad++) {
        sky[40] = bad == 2 ? (ssdgs_real)NAN : bad ? (ssdgs_real)INFINITY : (ssdgs_real)-1;
        memset(ambient, 0, sizeof ambient);
        wrong = sky_lights(sky, WIDE, HIGH, NULL, NULL, 0, ambient);
        CHECK(wrong && strstr(wrong, "negative or not finite") && !(ambient[0][0] > 0));
    }
    memset(sky, 0, sizeof sky);
    CHECK(!sky_lights(sky, WIDE, HIGH, NULL, lights, 2, ambient)); /* night */
    CHECK(!(ambient[0][0] > 0) && !(lights[0].intensity[0] > 0));
}

int main(void) {
    if (!CHECK(!ssdgs_context_create(NULL, &context)) || !CHECK(!ssdgs_scene_create(context, &scene)))
        TEST_END();
    for (int kind = 0; kind < 2; kind++) {
        ssdgs_settings settings = small_settings();
        if (kind) settings.asg = SSDGS_ASG_GEOMETRIC;
        ssdgs_model *model = cloud(&settings, 0, 300, 0.6);
        TEST_ROW("88", "lights without shadow", test_unshadowed(model));
        TEST_ROW("89", "lights with a range", test_range(model));
        test_ambient_terms(settings.asg);
        TEST_ROW("90", "ambient light", test_ambient_cloud(model, kind));
        if (!kind && !real64) test_environment_pictures(model);
        ssdgs_model_destroy(model);
    }
    test_deep();
    test_ambient_highlight(SSDGS_ASG_DEFERRED);
    test_ambient_highlight(SSDGS_ASG_GEOMETRIC);
    test_sky_shares_of_a_sheet();
    test_of_two_kinds();
    TEST_ROW("91", "environment maps", test_environment_sums());
    test_refused();
    ssdgs_scene_destroy(scene);
    ssdgs_context_destroy(context);
    TEST_END();
}
