/* Placed models in one frame, also as real64: one alone is ssdgs_render() to the bit; moved, turned, mirrored
   and scaled ones look as the model does from where the camera would be; parts equal the whole; shadows fall
   from one on another; what is refused, and what is kept. */
#include <stddef.h>
static size_t batch_bytes = (size_t)1 << 28; /* of lights' views that are worked on together */
#define SSDGS__BATCH_BYTES batch_bytes
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "scene.h"

/* ---- one object ---- */

static void test_identity(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light lights[2] = {point_light(2, -2, 2), parallel_light(0, 0, 1)};
    const ssdgs_render_options options[2] = {ssdgs_render_options_exact(), ssdgs_render_options_fast()};
    for (int kind = 0; kind < 3; kind++) {
        ssdgs_settings s = kind == 1 ? ssdgs_settings_published() : small_settings();
        s.baked = kind == 2;
        s.scattering.width = s.shadow.width = 16;
        ssdgs_model *model = cloud(&s, 0, 300, 0.5);
        const ssdgs_object object = ssdgs_object_default(model);
        for (int preset = 0; preset < 2; preset++) {
            alone(model, &camera, lights, 2, options + preset, shot);
            together(&object, 1, &camera, lights, 2, options + preset, shot + 1);
            CHECK(same(shot, shot + 1) && shot->stats.visible > 100);
            CHECK(!memcmp(&shot[0].stats, &shot[1].stats, sizeof shot->stats));
        }
        ssdgs_model_destroy(model);
    }
}

/* A camera and a light moved along with an object: they must see what they saw of it where it was. */
static void test_moved(void) {
    static const struct {
        double turn, scale, x, y, z;
        int mirror;
    } move[6] = {
        {0, 4, 1, -2, 0.5, 0},   {0.7, 1, 0, 0, 0, 0},
        {2, 0.125, 3, 1, -2, 0}, {0.7, 1, 0.5, -0.25, 0.125, 1},
        {1, 1e4, 5e4, 0, 0, 1},  {0.7, 2, 0.5, -0.25, 0.125, 1}}; /* colours that change with the view */
    ssdgs_settings settings = small_settings();
    for (int m = 0; m < 6; m++) {
        if (m == 1) settings = ssdgs_settings_published(), settings.scattering.width = 16;
        else settings = small_settings();
        settings.light_map.size = m ? 512 : 0;
        settings.baked = m == 5, settings.harmonics = 3 * settings.baked;
        ssdgs_model *model = cloud(&settings, 0, 300, 0.5);
        const ssdgs_model_view v = ssdgs_model_arrays(model);
        for (size_t c = SSDGS_HARMONICS; m == 5 && c < (size_t)v.channels; c++)
            for (size_t i = 0; i < 300; i++)
                v.gaussians[c * v.stride + i] = (ssdgs_real)(0.6 * ssdgs__uniform(c, i) - 0.3);
        for (int part = 0; part < 3; part++) { /* without what a light's map finds; with it; one from afar */
            ssdgs_render_options options = ssdgs_render_options_exact();
            ssdgs_camera camera = camera_from(0.4, -2.2, 0.8), moved = camera;
            ssdgs_light light = point_light(2, -2, 2), there;
            ssdgs_object o =
                placed(model, move[m].turn, move[m].scale, move[m].mirror, move[m].x, move[m].y, move[m].z);
            const double scale = move[m].scale;
            if (!m) { /* not turned: the map has the same pixels */
                memset(o.to_world, 0, sizeof o.to_world);
                for (int i = 0; i < 3; i++) o.to_world[5 * i] = (ssdgs_real)scale;
                o.to_world[3] = (ssdgs_real)move[m].x, o.to_world[7] = (ssdgs_real)move[m].y;
            }
            if (part == 2) {
                light.position[0] = light.position[2] = (ssdgs_real)0.6;
                light.position[1] = (ssdgs_real)-sqrt(1 - 2 * 0.36);
                TEST_PARALLEL(light);
            }
            there = light;
            options.alpha_threshold = (ssdgs_real)1e-6; /* or rounding shows and hides faint rims */
            options.stop = 0;
            if (!part) options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
            to_world(&o, light.position, part == 2, there.position);
            for (int i = 0; i < 3; i++) {
                if (part == 2) there.position[i] /= (ssdgs_real)scale;
                else there.intensity[i] *= (ssdgs_real)(scale * scale);
            }
            if (part == 2) TEST_PARALLEL(there);
            for (int i = 0; i < 3; i++) { /* its rows turn along; the first one of a mirrored one backwards */
                double back = 0;
                for (int j = 0; j < 3; j++) {
                    double sum = 0;
                    for (int k = 0; k < 3; k++)
                        sum += (double)camera.view[4 * i + k] * (double)o.to_world[4 * j + k] / scale;
                    moved.view[4 * i + j] = (ssdgs_real)(!i && move[m].mirror ? -sum : sum);
                    back -= (double)moved.view[4 * i + j] * (double)o.to_world[4 * j + 3];
                }
                moved.view[4 * i + 3] =
                    (ssdgs_real)(scale * (double)(!i && move[m].mirror ? -camera.view[3]
                                                                       : camera.view[4 * i + 3]) +
                                 back);
            }
            alone(model, &camera, &light, 1, &options, shot);
            together(&o, 1, &moved, &there, 1, &options, shot + 1);
            for (int plane = 0; plane < PLANES; plane++) { /* turn the picture to the first one's */
                const int triple = plane < 15, size = triple ? 3 : 1;
                for (int i = 0; i < PIXELS && plane % 3 * triple == 0; i++) {
                    const int x = i % SIDE, from = move[m].mirror ? i - x + SIDE - 1 - x : i;
                    ssdgs_real *to = shot[2].value + plane * PIXELS + i * size;
                    memcpy(to, shot[1].value + plane * PIXELS + from * size, (size_t)size * sizeof *to);
                    if (plane == 16) *to /= (ssdgs_real)scale; /* depth */
                    if (plane != 12) continue;
                    const ssdgs_real n[3] = {to[0], to[1], to[2]};
                    for (int c = 0; c < 3; c++)
                        to[c] = (n[0] * o.to_world[c] + n[1] * o.to_world[4 + c] + n[2] * o.to_world[8 + c]) /
                                (ssdgs_real)scale;
                }
            }
            const double tight = real64 ? 1e-9 : m == 4 ? 3e-3 : 3e-4;
            for (int plane = 0; plane < PLANES; plane++)
                if (part == 0 || !m)
                    CHECK_L2(shot[2].value + plane * PIXELS, shot[0].value + plane * PIXELS, PIXELS, tight,
                             "a moved object");
            CHECK_L2(shot[2].value, shot[0].value, 3 * PIXELS, 0.03, "a moved object under a light's map");
        }
        ssdgs_model_destroy(model);
    }
}

static void test_tint(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    for (int kind = 0; kind < 2; kind++) {
        ssdgs_settings s = kind ? ssdgs_settings_published() : small_settings();
        s.scattering.width = s.shadow.width = 16;
        ssdgs_model *model = cloud(&s, 0, 300, 0.5);
        ssdgs_object object = ssdgs_object_default(model);
        const ssdgs_render_options options = ssdgs_render_options_exact();
        together(&object, 1, &camera, &light, 1, &options, shot);
        for (int c = 0; c < 3; c++) object.tint[c] = (ssdgs_real)c / 2;
        together(&object, 1, &camera, &light, 1, &options, shot + 1);
        CHECK(shot[1].stats.camera_cached == 1 && shot[1].stats.lights_cached == 1);
        for (int i = 0; i < 12 * PIXELS; i++) shot[0].value[i] *= (ssdgs_real)(i % 3) / 2;
        CHECK_L2(shot[1].value, shot[0].value, 12 * PIXELS, 1e-6, "tinted light");
        CHECK(!memcmp(shot[1].value + 12 * PIXELS, shot[0].value + 12 * PIXELS,
                      6 * PIXELS * sizeof(ssdgs_real)));
        ssdgs_model_destroy(model);
    }
}

/* ---- several ---- */

/* A cloud in two parts equals the whole: sorting, blending, light maps, both networks. */
static void test_parts(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light lights[2] = {point_light(2, -2, 2), point_light(-1, -2, 3)};
    const ssdgs_render_options options = ssdgs_render_options_exact();
    for (int kind = 0; kind < 2; kind++) {
        ssdgs_settings s = kind ? ssdgs_settings_published() : small_settings();
        s.transport = 0; /* light scatters within each part alone */
        s.scattering.width = s.shadow.width = 16;
        s.light_map.size = 96;
        ssdgs_model *whole = cloud(&s, 0, 300, 0.5), *part[2];
        part[0] = cloud(&s, 0, 130, 0.5);
        part[1] = cloud(&s, 130, 170, 0.5);
        ssdgs_object object[2] = {ssdgs_object_default(part[0]), ssdgs_object_default(part[1])};
        alone(whole, &camera, lights, 2, &options, shot);
        together(object, 2, &camera, lights, 2, &options, shot + 1);
        CHECK(same(shot, shot + 1));
        CHECK(shot[1].stats.gaussians == 300 && shot[1].stats.visible == shot->stats.visible);
        together(object, 1, &camera, lights, 2, &options, shot + 1);
        CHECK(!same(shot, shot + 1) && shot[1].stats.gaussians == 130);
        ssdgs_model_destroy(whole);
        for (int i = 0; i < 2; i++) ssdgs_model_destroy(part[i]);
    }
}

/* Light that scatters within one of two that have it: as if the other, out of sight, were not there. */
static void test_transport(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = parallel_light(0.6, 0, 0.8);
    ssdgs_settings s = small_settings();
    s.transport = 1;
    s.light_map.size = 512;
    ssdgs_model *far_one = cloud(&s, 0, 100, 0.05), *near_one = cloud(&s, 100, 300, 0.5);
    ssdgs_object object[2] = {placed(far_one, 0, 1, 0, 0, -3, 1), ssdgs_object_default(near_one)};
    together(object + 1, 1, &camera, &light, 1, NULL, shot);
    together(object, 2, &camera, &light, 1, NULL, shot + 1);
    CHECK(shot[1].stats.visible == shot[0].stats.visible && shot[1].stats.gaussians == 400);
    CHECK_L2(shot[1].value + 9 * PIXELS, shot[0].value + 9 * PIXELS, 3 * PIXELS, 0.03,
             "scattering in one of two");
    ssdgs_model_destroy(far_one), ssdgs_model_destroy(near_one);
}

/* With every Gaussian within max_error each takes a colour, of its own object. */
static void test_skipped(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_settings s = small_settings();
    s.terms = SSDGS_DIFFUSE_TERM;
    ssdgs_object object[3];
    for (int i = 0; i < 3; i++) {
        object[i] = ssdgs_object_default(cloud(&s, 100 * i, 100, 0.2));
        object[i].to_world[3] = (ssdgs_real)(0.5 * i - 0.5);
        for (int k = 0; k < 100; k++) { /* faint, turned to the light */
            ssdgs_gaussian g;
            CHECK(!ssdgs_model_get(object[i].model, k, &g));
            g.opacity = (ssdgs_real)(k == 50 ? 0.9 : 0.02);
            for (int c = 0; c < 3; c++) g.normal[c] = light.position[c];
            CHECK(!ssdgs_model_set(object[i].model, k, &g));
        }
        for (int c = 0; c < 3; c++) object[i].tint[c] = (ssdgs_real)(c == i);
    }
    options.max_error = 1;
    together(object, 3, &camera, &light, 1, &options, shot);
    CHECK(shot->stats.shaded < 60 && shot->stats.skipped > 150);
    options.max_error = 0;
    together(object, 3, &camera, &light, 1, &options, shot + 1);
    for (int i = 0; i < 3 * PIXELS; i++) CHECK((shot->value[i] > 0) == (shot[1].value[i] > 0));
    for (int i = 0; i < 3; i++) ssdgs_model_destroy(object[i].model);
}

/* The product of two quaternions w x y z. */
static void multiply(const double a[4], const ssdgs_real b[4], ssdgs_real out[4]) {
    const double w = (double)b[0], x = (double)b[1], y = (double)b[2], z = (double)b[3];
    out[0] = (ssdgs_real)(a[0] * w - a[1] * x - a[2] * y - a[3] * z);
    out[1] = (ssdgs_real)(a[0] * x + a[1] * w + a[2] * z - a[3] * y);
    out[2] = (ssdgs_real)(a[0] * y - a[1] * z + a[2] * w + a[3] * x);
    out[3] = (ssdgs_real)(a[0] * z + a[1] * y - a[2] * x + a[3] * w);
}

/* Two placed clouds equal one model in which their Gaussians were moved. */
static void test_merged(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_settings s = small_settings();
    s.terms = SSDGS_ALL_TERMS & ~SSDGS_SCATTERING_TERM; /* networks see an object's own space */
    s.shadow.layers = 0;
    options.alpha_threshold = (ssdgs_real)1e-6;
    options.stop = 0;
    ssdgs_model *first = cloud(&s, 0, 200, 0.3), *second = cloud(&s, 200, 150, 0.3), *both = NULL;
    /* a quarter of a turn about z, half the size */
    const double root = sqrt(0.5), turn[4] = {root, 0, 0, root};
    ssdgs_object object[2] = {ssdgs_object_default(first), ssdgs_object_default(second)};
    memset(object[1].to_world, 0, sizeof object[1].to_world);
    object[1].to_world[1] = (ssdgs_real)-0.5;
    object[1].to_world[4] = object[1].to_world[10] = (ssdgs_real)0.5;
    object[1].to_world[3] = (ssdgs_real)0.35, object[1].to_world[7] = (ssdgs_real)-0.5;
    if (!CHECK(!ssdgs_model_create(context, &s, 350, &both))) exit(1);
    for (int i = 0; i < 350; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(i < 200 ? first : second, i < 200 ? i : i - 200, &g));
        if (i >= 200) {
            const ssdgs_gaussian was = g;
            to_world(object + 1, was.position, 0, g.position);
            to_world(object + 1, was.normal, 1, g.normal);
            multiply(turn, was.rotation, g.rotation);
            for (int c = 0; c < 3; c++) g.scale[c] = was.scale[c] / 2;
        }
        CHECK(!ssdgs_model_set(both, i, &g));
    }
    /* the highlights' frames turn too, which setting a normal leaves to chance */
    const ssdgs_model_view to = ssdgs_model_arrays(both),
                           from[2] = {ssdgs_model_peek(first), ssdgs_model_peek(second)};
    for (size_t i = 0; i < 350; i++) {
        const ssdgs_model_view *v = from + (i >= 200);
        ssdgs_real q[4], turned[4];
        for (size_t c = 0; c < 4; c++)
            q[c] = v->gaussians[(SSDGS_FRAME + c) * v->stride + i - (i < 200 ? 0 : 200)];
        multiply(turn, q, turned);
        for (size_t c = 0; c < 4; c++)
            to.gaussians[(SSDGS_FRAME + c) * to.stride + i] = i < 200 ? q[c] : turned[c];
    }
    alone(both, &camera, &light, 1, &options, shot);
    together(object, 2, &camera, &light, 1, &options, shot + 1);
    for (int plane = 0; plane < PLANES; plane++)
        CHECK_L2(shot[1].value + plane * PIXELS, shot[0].value + plane * PIXELS, PIXELS, real64 ? 1e-5 : 2e-3,
                 "two objects in one model");
    object[1] = ssdgs_object_default(second);
    together(object, 2, &camera, &light, 1, &options, shot + 2);
    double moved = 0, norm = 0;
    for (int i = 0; i < 3 * PIXELS; i++) {
        const double d = (double)(shot[2].value[i] - shot[0].value[i]);
        moved += d * d, norm += (double)(shot[0].value[i] * shot[0].value[i]);
    }
    CHECK(moved > 0.01 * norm); /* which a wrong transform would show */
    ssdgs_model_destroy(first), ssdgs_model_destroy(second), ssdgs_model_destroy(both);
}

/* Objects whose highlights differ are lit one by one: behind the first, what the second sends is dimmed by
   what the first lets through. Components still add up, and diffuse is what it is alone. */
static void test_materials(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light lights[2] = {point_light(2, -2, 2), point_light(-2, -1, 1)};
    ssdgs_settings s = small_settings(), published = ssdgs_settings_published();
    published.transfer = s.transfer;
    published.scattering.width = published.shadow.width = 16;
    for (int kind = 0; kind < 2; kind++) { /* two deferred ones, or one that shades its Gaussians */
        ssdgs_render_options options = ssdgs_render_options_exact();
        options.stop = 0;
        if (!kind) { /* three, of which no two overlap: the sum of each alone */
            ssdgs_object three[3];
            ssdgs_image image = planes_of(shot + 1);
            memset(shot[0].value, 0, sizeof shot[0].value);
            options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
            for (int i = 0; i < 3; i++) {
                three[i] = ssdgs_object_default(cloud(&s, 10 * i, 10, 0.03));
                three[i].to_world[3] = (ssdgs_real)(0.25 - 0.1 * (i - 1));
                three[i].to_world[11] = (ssdgs_real)0.2; /* in the middle of a tile */
                ssdgs_model_arrays(three[i].model).asg_sharpness[0] += (ssdgs_real)i;
                CHECK(!ssdgs_scene_render(scene, three + i, 1, &camera, lights, 2, &options, &image, NULL));
                for (int v = 0; v < 3 * PIXELS; v++) shot[0].value[v] += shot[1].value[v];
            }
            CHECK(!ssdgs_scene_render(scene, three, 3, &camera, lights, 2, &options, &image, NULL));
            CHECK_L2(shot[1].value, shot[0].value, 3 * PIXELS, 0.01, "three materials");
            for (int i = 0; i < 3; i++) ssdgs_model_destroy(three[i].model);
        }
        ssdgs_model *front = cloud(&s, 0, 60, 0.2), *back = cloud(kind ? &published : &s, 500, 200, 0.3);
        ssdgs_object object[2] = {ssdgs_object_default(back), ssdgs_object_default(front)};
        ssdgs_model_view v = ssdgs_model_arrays(back);
        for (size_t i = 0; i < SSDGS_ASG_COUNT; i++) v.asg_sharpness[2 * i] -= 1;
        object[1].to_world[3] = (ssdgs_real)0.2, object[1].to_world[7] = (ssdgs_real)-1;
        options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
        together(object, 1, &camera, lights, 2, &options, shot);
        together(object + 1, 1, &camera, lights, 2, &options, shot + 1);
        together(object, 2, &camera, lights, 2, &options, shot + 2);
        double mixed = 0;
        for (int i = 0; i < 3 * PIXELS; i++) {
            const ssdgs_real through = 1 - shot[1].value[15 * PIXELS + i / 3];
            mixed += (double)(through * (1 - through) * shot[0].value[i]);
            shot[0].value[i] = shot[1].value[i] + through * shot[0].value[i];
        }
        CHECK(mixed > 1);
        CHECK_L2(shot[2].value, shot[0].value, 3 * PIXELS, real64 ? 1e-12 : 1e-5, "one behind another");
        options.terms = SSDGS_ALL_TERMS;
        if (!kind) { /* where one alone is seen, its shadow is what it is when both are of one material */
            const ssdgs_object twins[2] = {ssdgs_object_default(cloud(&s, 500, 200, 0.3)), object[1]};
            together(object + 1, 1, &camera, lights, 2, &options, shot);
            together(twins, 2, &camera, lights, 2, &options, shot + 1);
            together(object, 2, &camera, lights, 2, &options, shot + 2);
            double seen = 0;
            for (int i = 0; i < PIXELS; i++) {
                const ssdgs_real *alpha = shot[0].value + 15 * PIXELS + i;
                if (*alpha > 0 && *alpha < shot[1].value[15 * PIXELS + i]) continue;
                const double d = (double)(shot[2].value[17 * PIXELS + i] - shot[1].value[17 * PIXELS + i]);
                CHECK(fabs(d) < (real64 ? 1e-9 : 1e-4));
                seen += (double)(*alpha > 0);
            }
            CHECK(seen > 20);
            ssdgs_model_destroy(twins[0].model);
        }
        together(object, 2, &camera, lights, 2, &options, shot);
        for (int i = 0; i < 3 * PIXELS; i++)
            shot[1].value[i] =
                shot[0].value[3 * PIXELS + i] + shot[0].value[6 * PIXELS + i] + shot[0].value[9 * PIXELS + i];
        CHECK_L2(shot[1].value, shot[0].value, 3 * PIXELS, real64 ? 1e-12 : 1e-5, "the components' sum");
        ssdgs_image image = planes_of(shot + 2);
        image.diffuse = image.specular = image.scattering = image.normal = image.shadow = image.depth = NULL;
        CHECK(!ssdgs_scene_render(scene, object, 2, &camera, lights, 2, &options, &image, NULL));
        CHECK(!memcmp(shot[2].value, shot[0].value, 3 * PIXELS * sizeof(ssdgs_real)));
        options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
        together(object, 2, &camera, lights, 2, &options, shot + 1);
        if (!kind)
            CHECK_L2(shot[0].value + 3 * PIXELS, shot[1].value, 3 * PIXELS, real64 ? 1e-9 : 1e-4,
                     "the diffuse component");
        CHECK_L2(shot[0].value + 17 * PIXELS, shot[1].value + 17 * PIXELS, PIXELS, real64 ? 1e-9 : 1e-4,
                 "the shadow component");
        for (int i = 0; i < PIXELS; i++)
            CHECK(shot[0].value[17 * PIXELS + i] <= shot[0].value[15 * PIXELS + i] + (ssdgs_real)1e-5);
        ssdgs_model_destroy(front), ssdgs_model_destroy(back);
    }
}

/* What one object asks for, a depth cue, transport, deferred highlights, does not depend on what the last one
   asks for. */
static void test_order(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_settings modest = ssdgs_settings_published(), s = modest;
    modest.scattering.width = modest.shadow.width = 16;
    for (int kind = 0; kind < 3; kind++) {
        s = modest;
        if (kind == 0) s.depth_cue = 1;
        if (kind == 1) s.transport = 1;
        if (kind == 2) s.asg = SSDGS_ASG_DEFERRED;
        ssdgs_model *model[2];
        ssdgs_object object[3];
        model[0] = cloud(&s, 0, 100, 0.3), model[1] = cloud(&modest, 500, 100, 0.3);
        for (int i = 0; i < 3; i++) object[i] = ssdgs_object_default(model[i % 2]);
        object[1].to_world[3] = (ssdgs_real)0.3;
        together(object, 2, &camera, &light, 1, NULL, shot);
        together(object + 1, 2, &camera, &light, 1, NULL, shot + 1);
        CHECK_L2(shot[1].value, shot[0].value, 3 * PIXELS, real64 ? 1e-12 : 1e-5, "the other order");
        ssdgs_model_destroy(model[0]), ssdgs_model_destroy(model[1]);
    }
}

/* A plate between the light and a ball of another model takes the ball's light. */
static void test_shadows(void) {
    const ssdgs_camera camera = camera_from(0, -2.2, 0.3);
    const ssdgs_light light = point_light(0, 0, 4);
    ssdgs_settings s = small_settings();
    s.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    s.shadow.layers = 0;
    ssdgs_model *ball = cloud(&s, 0, 200, 0.3), *plate = NULL;
    if (!CHECK(!ssdgs_model_create(context, &s, 1, &plate))) exit(1);
    ssdgs_gaussian g = ssdgs_gaussian_default();
    g.scale[0] = g.scale[1] = (ssdgs_real)0.6;
    g.opacity = (ssdgs_real)0.999;
    for (int c = 0; c < 3; c++) g.diffuse[c] = 0; /* it darkens the picture in no other way */
    CHECK(!ssdgs_model_set(plate, 0, &g));
    ssdgs_object object[2] = {ssdgs_object_default(ball), ssdgs_object_default(plate)};
    object[1].to_world[11] = 1;
    double lit[2] = {0, 0};
    for (int count = 1; count <= 2; count++) {
        together(object, count, &camera, &light, 1, NULL, shot);
        for (int i = SIDE * SIDE / 3; i < PIXELS; i++) lit[count - 1] += (double)shot->value[3 * i];
    }
    CHECK(lit[0] > 1 && lit[1] < 0.05 * lit[0]);
    object[1].to_world[3] = 3; /* aside */
    together(object, 2, &camera, &light, 1, NULL, shot);
    lit[1] = 0;
    for (int i = SIDE * SIDE / 3; i < PIXELS; i++) lit[1] += (double)shot->value[3 * i];
    CHECK(fabs(lit[1] / lit[0] - 1) < 0.1);
    ssdgs_model_destroy(ball), ssdgs_model_destroy(plate);
}

/* A plain splat file's colours among linear ones are decoded. */
static void test_baked(void) {
    const ssdgs_camera camera = camera_from(0, -2.2, 0.3);
    const ssdgs_light light = point_light(0, -3, 1);
    ssdgs_settings s = small_settings();
    s.baked = 1;
    s.transfer = SSDGS_TRANSFER_NONE;
    ssdgs_model *plain = NULL;
    if (!CHECK(!ssdgs_model_create(context, &s, 1, &plain))) exit(1);
    s.baked = 0;
    s.transfer = SSDGS_TRANSFER_SRGB;
    ssdgs_model *lit = cloud(&s, 0, 100, 0.1);
    ssdgs_gaussian g = ssdgs_gaussian_default();
    for (int c = 0; c < 3; c++) g.scale[c] = (ssdgs_real)0.1, g.diffuse[c] = (ssdgs_real)(0.25 * (c + 1));
    g.opacity = (ssdgs_real)0.9;
    CHECK(!ssdgs_model_set(plain, 0, &g));
    ssdgs_object object[2] = {ssdgs_object_default(plain), ssdgs_object_default(lit)};
    object[1].to_world[3] = (ssdgs_real)0.6;
    together(object, 1, &camera, &light, 1, NULL, shot);
    together(object, 2, &camera, &light, 1, NULL, shot + 1);
    const int middle = SIDE / 2 * SIDE + SIDE / 2;
    for (int c = 0; c < 3; c++) {
        const ssdgs_real alpha = shot->value[15 * PIXELS + middle],
                         stored = shot->value[3 * middle + c] / alpha,
                         linear = shot[1].value[3 * middle + c] / alpha;
        CHECK(fabs((double)(stored - (ssdgs_real)(0.25 * (c + 1)))) < 1e-5);
        CHECK(fabs((double)(linear - ssdgs_srgb_decode((ssdgs_real)(0.25 * (c + 1))))) < 1e-5);
    }
    { /* nothing shadows what is baked, whether lights have maps or not */
        ssdgs_scene *fresh = NULL;
        s.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
        ssdgs_model *bright = cloud(&s, 0, 100, 0.1);
        ssdgs_object beside[2] = {object[0], object[1]};
        beside[1].model = bright;
        CHECK(!ssdgs_scene_create(context, &fresh));
        for (int pass = 0; pass < 2; pass++) {
            const ssdgs_image image = planes_of(shot);
            CHECK(!ssdgs_scene_render(fresh, beside, 2, &camera, &light, 1, NULL, &image, NULL));
            CHECK(fabs((double)(shot->value[17 * PIXELS + middle] / shot->value[15 * PIXELS + middle]) - 1) <
                  1e-5);
            CHECK(!ssdgs_scene_light(fresh, beside, 2, NULL, &light, 1, NULL));
        }
        ssdgs_scene_destroy(fresh);
        ssdgs_model_destroy(bright);
    }
#ifndef __FAST_MATH__
    for (int i = 0; i < 2; i++) { /* not finite: black, as beside no other */
        ssdgs_model_arrays(plain).gaussians[SSDGS_DIFFUSE * plain->capacity] =
            (ssdgs_real)(i ? INFINITY : NAN);
        together(object, 2, &camera, &light, 1, NULL, shot);
        CHECK(shot->stats.blackened == 1 && shot->value[3 * middle] == 0 && shot->value[3 * middle + 1] == 0);
    }
#endif
    ssdgs_model_destroy(plain), ssdgs_model_destroy(lit);
}

/* ---- other things in the picture ---- */

/* A Gaussian as a picture sees it, in double: its centre, its conic, and how its mean depth changes with x,
 * y. */
typedef struct footprint {
    double x, y, conic[3], depth, slope[2], opacity;
} footprint;

static footprint footprint_of(ssdgs_model *model, int i, const ssdgs_camera *camera) {
    ssdgs_gaussian g;
    footprint f;
    double t[3], r[9], q[4], norm = 0, m[3][3], cov[6] = {0};
    CHECK(!ssdgs_model_get(model, i, &g));
    for (int c = 0; c < 4; c++) norm += (double)g.rotation[c] * (double)g.rotation[c];
    for (int c = 0; c < 4; c++) q[c] = (double)g.rotation[c] / sqrt(norm);
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        r[4 * a] = 1 - 2 * (q[1 + b] * q[1 + b] + q[1 + c] * q[1 + c]);
        r[3 * b + a] = 2 * (q[1 + a] * q[1 + b] + q[0] * q[1 + c]);
        r[3 * c + a] = 2 * (q[1 + a] * q[1 + c] - q[0] * q[1 + b]);
    }
    for (int a = 0; a < 3; a++) {
        t[a] = (double)camera->view[4 * a + 3];
        for (int c = 0; c < 3; c++) t[a] += (double)camera->view[4 * a + c] * (double)g.position[c];
    }
    for (int a = 2; a >= 0; a--) /* rows of J W, then of z, times R S */
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int c = 0; c < 3; c++) {
                const double own = (double)camera->view[4 * a + c], z = (double)camera->view[8 + c];
                sum += (a == 2 ? own : (double)camera->fx / t[2] * (own - t[a] / t[2] * z)) * r[3 * c + j];
            }
            m[a][j] = sum * (double)g.scale[j];
        }
    for (int j = 0; j < 3; j++) {
        cov[0] += m[0][j] * m[0][j], cov[1] += m[0][j] * m[1][j], cov[2] += m[1][j] * m[1][j];
        cov[3] += m[0][j] * m[2][j], cov[4] += m[1][j] * m[2][j];
    }
    const double blur = (double)ssdgs_model_settings(model)->pixel_variance, a = cov[0] + blur,
                 c = cov[2] + blur, det = a * c - cov[1] * cov[1];
    f.x = (double)camera->fx * t[0] / t[2] + (double)camera->cx;
    f.y = (double)camera->fy * t[1] / t[2] + (double)camera->cy;
    f.conic[0] = c / det, f.conic[1] = -cov[1] / det, f.conic[2] = a / det;
    f.slope[0] = f.conic[0] * cov[3] + f.conic[1] * cov[4];
    f.slope[1] = f.conic[1] * cov[3] + f.conic[2] * cov[4];
    f.depth = t[2];
    f.opacity = (double)g.opacity;
    return f;
}

static int by_depth(const void *a, const void *b) {
    const double x = ((const footprint *)a)->depth, y = ((const footprint *)b)->depth;
    return (x > y) - (x < y);
}

/* Alpha and median depth of pixels where a depth hides what of each Gaussian is behind it there: differences
   to a frame's. A pixel counts as wrong where rounding does not decide. */
static void check_hidden(ssdgs_model *model, const ssdgs_camera *camera, const ssdgs_real *scene_depth,
                         const ssdgs_real *alpha, const ssdgs_real *median) {
    enum { MOST = 300 };
    static footprint f[MOST];
    const int count = ssdgs_model_count(model);
    int wrong = 0, close = 0;
    for (int i = 0; i < count; i++) f[i] = footprint_of(model, i, camera);
    qsort(f, (size_t)count, sizeof *f, by_depth);
    for (int i = 0; i < PIXELS; i++) {
        double t = 1, half = 0, near_edge = 1;
        for (int g = 0; g < count; g++) {
            const double x = i % SIDE + 0.5 - f[g].x, y = i / SIDE + 0.5 - f[g].y;
            const double power = f[g].conic[0] * x * x + 2 * f[g].conic[1] * x * y + f[g].conic[2] * y * y;
            const double a = fmin(f[g].opacity * exp(-power / 2), 0.999);
            const double z = f[g].depth + f[g].slope[0] * x + f[g].slope[1] * y;
            if (a < 1 / 255.0 + 1e-6) near_edge = fmin(near_edge, fabs(a - 1 / 255.0) * 1e3);
            if (a < 1 / 255.0) continue;
            if (scene_depth) near_edge = fmin(near_edge, fabs(z - (double)scene_depth[i]));
            if (scene_depth && z >= (double)scene_depth[i]) continue;
            near_edge = fmin(near_edge, median ? fabs(t * (1 - a) - 0.5) : 1);
            half = t >= 0.5 && t * (1 - a) < 0.5 ? z : half;
            t *= 1 - a;
        }
        if (near_edge < 2e-5) {
            close++;
            continue;
        }
        wrong += fabs((double)alpha[i] - (1 - t)) > 2e-5;
        if (median) wrong += fabs((double)median[i] - half) > 2e-5 * half;
    }
    if (!CHECK(wrong == 0 && close < PIXELS / 20)) printf("    %d pixels wrong, %d close\n", wrong, close);
}

/* Depths hide what is behind them: of each Gaussian at each pixel, by its mean depth there. */
static void test_scene_depth(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    static ssdgs_real depth[PIXELS], median[PIXELS];
    static const double plane[2] = {2.2, 2.6};
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_settings s = small_settings();
    s.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    const ssdgs_object object = ssdgs_object_default(model);
    ssdgs_image image = planes_of(shot + 2);
    options.stop = 0;
    options.alpha_threshold = (ssdgs_real)(1 / 255.0);
    CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, NULL));
    image.scene_depth = depth;                /* for which the camera's view that is kept does not do */
    for (int frame = 0; frame < 2; frame++) { /* the second one keeps nothing that the depths may change */
        for (int i = 0; i < PIXELS; i++) depth[i] = (ssdgs_real)plane[(i + i / SIDE + frame) % 2];
        CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, &shot[2].stats));
        check_hidden(model, &camera, depth, shot[2].value + 15 * PIXELS, NULL);
    }
    CHECK(shot[2].stats.shaded < 300);
    ssdgs_object half_as_far = object; /* about the eye: nothing changes but depths */
    static ssdgs_real half_depth[PIXELS];
    const double eye[3] = {0.4, -2.2, 0.8};
    for (int c = 0; c < 3; c++)
        half_as_far.to_world[5 * c] = (ssdgs_real)0.5,
                                 half_as_far.to_world[4 * c + 3] = (ssdgs_real)(0.5 * eye[c]);
    for (int i = 0; i < PIXELS; i++) half_depth[i] = depth[i] / 2;
    ssdgs_image near_image = planes_of(shot);
    near_image.scene_depth = half_depth;
    CHECK(!ssdgs_scene_render(scene, &half_as_far, 1, &camera, &light, 1, &options, &near_image, NULL));
    CHECK_L2(shot[0].value + 15 * PIXELS, shot[2].value + 15 * PIXELS, PIXELS, 1e-3, "half as far");
    enum { STRIDE = SIDE + 5 }; /* rows of the caller's */
    static ssdgs_real wide_depth[SIDE * STRIDE], wide_alpha[SIDE * STRIDE];
    ssdgs_image wide;
    memset(&wide, 0, sizeof wide);
    wide.stride = STRIDE, wide.alpha = wide_alpha, wide.scene_depth = wide_depth;
    for (int i = 0; i < PIXELS; i++) wide_depth[i / SIDE * STRIDE + i % SIDE] = depth[i];
    CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &wide, NULL));
    for (int i = 0; i < PIXELS; i++)
        CHECK(wide_alpha[i / SIDE * STRIDE + i % SIDE] >= shot[2].value[15 * PIXELS + i] &&
              wide_alpha[i / SIDE * STRIDE + i % SIDE] <= shot[2].value[15 * PIXELS + i]);
    image.scene_depth = NULL;
    image.median_depth = median;
    CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, &shot[0].stats));
    CHECK(shot[0].stats.camera_cached == 1); /* but for the walk */
    check_hidden(model, &camera, NULL, shot[2].value + 15 * PIXELS, median);
    int crossed = 0;
    for (int i = 0; i < PIXELS; i++) {
        crossed += median[i] > 0;
        depth[i] = median[i] > 0 ? (ssdgs_real)0.9998 * median[i] : 2;
    }
    CHECK(crossed > 300);
    image.scene_depth = depth;
    CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, NULL));
    check_hidden(model, &camera, depth, shot[2].value + 15 * PIXELS, median);
    image.median_depth = NULL;
    for (int i = 0; i < PIXELS; i++) /* a depth by no alpha, or none: nothing is hidden */
        depth[i] = i % 3 ? (ssdgs_real)(i % 3 - 2) : (ssdgs_real)NAN;
    CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, NULL));
    image.scene_depth = NULL;
    memcpy(shot, shot + 2, sizeof *shot);
    CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, NULL));
    CHECK(same(shot, shot + 2));
    ssdgs_model_destroy(model);
}

/* A dark light costs no networks and changes no picture; what is in sight is counted for one object too. */
static void test_dark(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    const ssdgs_settings s = small_settings();
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    ssdgs_light lights[2];
    lights[0] = point_light(2, -2, 2);
    lights[1] = point_light(-2, -2, 2);
    for (int c = 0; c < 3; c++) lights[1].intensity[c] = 0;
    CHECK(ssdgs_model_count(model) == 300 && ssdgs_model_count(NULL) == 0);
    alone(model, &camera, lights, 1, &options, shot);
    const double work = shot[0].stats.network_work;
    (void)ssdgs_model_arrays(model); /* forget */
    alone(model, &camera, lights, 2, &options, shot + 1);
    double worst = 0;
    for (int i = 0; i < 12 * PIXELS; i++)
        worst = test_most(worst, fabs((double)(shot[0].value[i] - shot[1].value[i])));
    CHECK(worst < 1e-6);
    CHECK(shot[1].stats.light_views == shot[0].stats.light_views && work > 0 &&
          shot[1].stats.network_work >= work && shot[1].stats.network_work <= work);
    CHECK(shot[1].stats.objects == 1 && shot[1].stats.light_instances == shot[0].stats.light_instances);
    static ssdgs_real color[2][3 * PIXELS]; /* and without a plane of each term */
    const ssdgs_object twice[2] = {ssdgs_object_default(model), placed(model, 0.7, 0.5, 1, 0.9, -0.2, 0.1)};
    for (int count = 1; count < 3; count++) {
        for (int i = 0; i < 2; i++) {
            ssdgs_image image;
            memset(&image, 0, sizeof image);
            image.color = color[i];
            CHECK(!ssdgs_scene_render(scene, twice, count, &camera, lights, 1 + i, &options, &image, NULL));
        }
        CHECK(!memcmp(color[0], color[1], sizeof color[0]));
    }
    ssdgs_camera behind = camera;
    for (int c = 0; c < 4; c++) behind.view[c] = -behind.view[c], behind.view[8 + c] = -behind.view[8 + c];
    alone(model, &behind, lights, 1, &options, shot);
    CHECK(shot[0].stats.objects == 0 && shot[0].stats.visible == 0);
    ssdgs_model_destroy(model);
}

/* ---- how much there is of an object ---- */

static void refused(const ssdgs_object *objects, int count, const char *word) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_image image = planes_of(shot);
    CHECK(ssdgs_scene_render(scene, objects, count, &camera, NULL, 0, NULL, &image, NULL) != SSDGS_OK);
    if (!CHECK(strstr(ssdgs_error_message(context), word) != NULL))
        printf("    %s\n", ssdgs_error_message(context));
}

static ssdgs_model *plate_of(const ssdgs_settings *s, double width, double opacity) {
    ssdgs_model *plate = NULL;
    if (!CHECK(!ssdgs_model_create(context, s, 1, &plate))) exit(1);
    ssdgs_gaussian g = ssdgs_gaussian_default();
    g.scale[0] = g.scale[1] = (ssdgs_real)width;
    g.scale[2] = (ssdgs_real)0.001;
    g.opacity = (ssdgs_real)opacity;
    for (int c = 0; c < 3; c++) g.diffuse[c] = 0;
    CHECK(!ssdgs_model_set(plate, 0, &g));
    return plate;
}

/* At a Gaussian's centre, and of the light behind it, transmittance is the whole's to the power of presence;
   so parts that stand in one place multiply to the whole. All of it is what it was to the bit, nothing is not
   there.
 */
static void test_presence(void) {
    static const double shares[4] = {0.3, 0.7, 1, 0};
    ssdgs_settings s = small_settings();
    s.light_map.size = 256;
    for (int baked = 0; baked < 2; baked++) {
        s.baked = baked;
        ssdgs_model *plate = plate_of(&s, 0.3, 0.8);
        const ssdgs_real eye[3] = {0, 0, 3}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0}, behind[3] = {0, 0, -1};
        const ssdgs_camera camera =
            ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.7, SIDE + 1, SIDE - 1);
        const ssdgs_light light = point_light(0, 0, 3);
        ssdgs_image image;
        static ssdgs_real alpha[(SIDE + 1) * (SIDE - 1)];
        memset(&image, 0, sizeof image);
        image.alpha = alpha;
        for (int i = 0; i < 5; i++) { /* the last: both parts */
            ssdgs_object objects[2] = {ssdgs_object_default(plate), ssdgs_object_default(plate)};
            ssdgs_render_stats stats;
            ssdgs_real passed = -1;
            for (int k = 0; k < 2; k++) objects[k].presence = (ssdgs_real)shares[i == 4 ? k : i];
            const int count = i == 4 ? 2 : 1;
            CHECK(!ssdgs_scene_light(scene, objects, count, NULL, &light, 1, NULL));
            CHECK(!ssdgs_scene_shadow(scene, 0, behind, 1, &passed));
            CHECK(!ssdgs_scene_render(scene, objects, count, &camera, &light, 1, NULL, &image, &stats));
            const double share = i == 4 ? 1 : shares[i], want = pow(0.2, share);
            const double seen = 1 - (double)alpha[(SIDE - 1) / 2 * (SIDE + 1) + (SIDE + 1) / 2];
            CHECK(fabs(seen - want) < 2e-3); /* half a pixel beside the centre */
            CHECK(fabs((double)passed - want) < 0.04 && (share > 0 || passed >= 1));
            CHECK(stats.visible == (share > 0 ? count : 0));
        }
        ssdgs_model_destroy(plate);
    }
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    s = small_settings();
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    ssdgs_object object = ssdgs_object_default(model);
    CHECK(object.presence >= 1 && object.presence <= 1 && !object.levels && !object.level_count);
    together(&object, 1, &camera, &light, 1, NULL, shot);
    object.presence = (ssdgs_real)0.5; /* nothing is kept of another one */
    together(&object, 1, &camera, &light, 1, NULL, shot + 1);
    CHECK(!shot[1].stats.camera_cached && !shot[1].stats.lights_cached && !same(shot, shot + 1));
    object.presence = 1;
    together(&object, 1, &camera, &light, 1, NULL, shot + 1);
    CHECK(same(shot, shot + 1));
    ssdgs_model_destroy(model);
}

/* Gaussians for a model's pixels by the box's shadow, averaged over directions, 3 for 8 pixels. */
static double needed_of(const ssdgs_model *model, double scale, double distance, double focal) {
    double side[3], half = 0, area = 0;
    for (int c = 0; c < 3; c++) {
        side[c] = model->bounds.high[c] - model->bounds.low[c];
        half += side[c] * side[c] / 4;
    }
    for (int i = 0; i < 10000; i++) {
        double d[3];
        direction_of(i, 10000, d);
        for (int c = 0; c < 3; c++) area += fabs(d[c]) * side[(c + 1) % 3] * side[(c + 2) % 3] / 10000;
    }
    const double near = distance - scale * sqrt(half);
    return near > 0 ? 3.0 / 8 * area * scale * scale * focal * focal / (near * near) : 1e30;
}

/* The level that covered pixels ask for, or two that fade into each other, are drawn as if they had been
   placed so. Where one comes and where the other has gone nothing pops. */
static void test_levels(void) {
    enum { STEPS = 120 };
    static const int counts[3] = {500, 200, 60};
    ssdgs_settings s = small_settings();
    ssdgs_model *models[3];
    ssdgs_render_options options = ssdgs_render_options_exact(); /* no skipping that comes and goes */
    const ssdgs_light light = point_light(2, -2, 2);
    int drawn[3] = {0, 0, 0}, both = 0;
    double pop = 0, apart = 0;
    for (int i = 0; i < 3; i++) models[i] = cloud(&s, 600 * i, counts[i], 0.5);
    for (int step = 0; step < STEPS; step++) {
        const double distance = 1.2 * pow(1.03, step), scale = 1.25;
        const ssdgs_camera camera = camera_from(0, -distance, 0);
        ssdgs_object whole = placed(models[0], 0.3, scale, step & 1, 0, 0, 0), want[2] = {whole, whole};
        double middle = 0, share = 0;
        int level = 0;
        whole.levels = models + 1;
        whole.level_count = 2;
        options.level_detail = (ssdgs_real)0.5;
        together(&whole, 1, &camera, &light, 1, &options, shot);
        for (int i = 0; i < 3; i++) {
            double from_eye = i == 1 ? distance : 0;
            for (int c = 0; c < 3; c++)
                from_eye += (double)whole.to_world[4 * i + c] *
                            (models[0]->bounds.low[c] + models[0]->bounds.high[c]) / 2;
            middle += from_eye * from_eye;
        }
        const double needed = 0.5 * needed_of(models[0], scale, sqrt(middle), (double)camera.fx);
        while (level < 2 && counts[level + 1] >= 1.1 * needed) level++;
        if (level < 2) share = (counts[level + 1] / needed - 1) / 0.1;
        want[0].model = models[level];
        if (share > 0) {
            want[0].presence = (ssdgs_real)(1 - share);
            want[1].model = models[level + 1];
            want[1].presence = (ssdgs_real)share;
        }
        together(want, share > 0 ? 2 : 1, &camera, &light, 1, &options, shot + 1);
        double off = 0;
        for (int i = 0; i < 3 * PIXELS; i++)
            off = test_most(off, fabs((double)shot[0].value[i] - (double)shot[1].value[i]));
        if (!CHECK(off < 1e-3 && shot[0].stats.gaussians == shot[1].stats.gaussians))
            printf("    step %d: level %d, share %g: %g off\n", step, level, share, off);
        drawn[level]++;
        both += share > 0;
        options.level_detail = 0; /* the model itself, as with a mask or by exact */
        together(&whole, 1, &camera, &light, 1, &options, shot + 1);
        want[0] = whole, want[0].level_count = 0;
        together(want, 1, &camera, &light, 1, &options, shot + 2);
        CHECK(same(shot + 1, shot + 2));
        for (int i = 0; i < 3 * PIXELS && level && !(share > 0); i++)
            apart = test_most(apart, fabs((double)shot[0].value[i] - (double)shot[1].value[i]));
        if (step % 20) continue;
        ssdgs_scene *was = scene; /* maps made ahead are those of the frame's levels */
        options.level_detail = (ssdgs_real)0.5;
        CHECK(!ssdgs_scene_create(context, &scene));
        for (int i = 0; i < 2; i++) {
            CHECK(!ssdgs_scene_light(scene, &whole, 1, i ? NULL : &camera, &light, 1, &options));
            together(&whole, 1, &camera, &light, 1, &options, shot + 1);
            CHECK(shot[1].stats.lights_cached == (!i || (!level && !(share > 0))));
        }
        ssdgs_scene_destroy(scene);
        scene = was;
        static unsigned char mask[500];
        memset(mask, 255, sizeof mask);
        want[1] = whole, want[1].mask = mask;
        options.level_detail = (ssdgs_real)0.5;
        together(want + 1, 1, &camera, &light, 1, &options, shot + 1);
        CHECK(same(shot + 1, shot + 2));
        const ssdgs_render_options exact = ssdgs_render_options_exact();
        together(&whole, 1, &camera, &light, 1, &exact, shot + 1);
        together(want, 1, &camera, &light, 1, &exact, shot + 2);
        CHECK(same(shot + 1, shot + 2));
    }
    CHECK(drawn[0] > 10 && drawn[1] > 10 && drawn[2] > 10 && both > 2);
    for (int end = 0; end < 4; end++) {
        double low = 1.2, high = 100;
        ssdgs_object whole = ssdgs_object_default(models[0]);
        whole.levels = models + 1;
        whole.level_count = 2;
        options.level_detail = 1;
        for (int c = 0; c < 3; c++) /* the box's centre is where the camera looks */
            whole.to_world[4 * c + 3] =
                -(ssdgs_real)(models[0]->bounds.low[c] + models[0]->bounds.high[c]) / 2;
        for (int i = 0; i < 60; i++) {
            const double middle = (low + high) / 2,
                         needed = needed_of(models[0], 1, middle, (double)camera_from(0, -1, 0).fx);
            *(needed * (end % 2 ? 1.1 : 1) > counts[1 + end / 2] ? &low : &high) = middle;
        }
        for (int i = 0; i < 2; i++) {
            const ssdgs_camera camera = camera_from(0, -low * (i ? 1.0003 : 0.9997), 0);
            together(&whole, 1, &camera, &light, 1, &options, shot + i);
            /* first the finer one alone, then both, then the coarser one alone */
            const int finer = counts[end / 2], coarser = counts[1 + end / 2];
            CHECK(shot[i].stats.gaussians == (end % 2 != i ? finer + coarser : i ? coarser : finer));
        }
        for (int i = 0; i < 3 * PIXELS; i++)
            pop = test_most(pop, fabs((double)shot[0].value[i] - (double)shot[1].value[i]));
    }
    for (int i = 0; i < 2; i++) { /* towards it, then away: it casts the same shadows */
        const ssdgs_real eye[3] = {0, -40, 0}, target[3] = {0, (ssdgs_real)(i ? -80 : 0), 0},
                         up[3] = {0, 0, 1};
        const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.7, SIDE, SIDE);
        ssdgs_object whole = ssdgs_object_default(models[0]);
        whole.levels = models + 1;
        whole.level_count = 2;
        together(&whole, 1, &camera, &light, 1, &options, shot);
        CHECK(shot->stats.gaussians == counts[2] && (shot->stats.visible > 0) == !i);
    }
    if (!CHECK(pop < 0.05 * apart)) printf("    pops by %g, %g apart\n", pop, apart);
    ssdgs_object object = ssdgs_object_default(models[1]);
    object.level_count = 1;
    refused(&object, 1, "object 0: 1 levels, but the array is NULL");
    object.levels = models, object.level_count = -1;
    refused(&object, 1, "object 0: -1 levels");
    object.level_count = 1;
    refused(&object, 1, "object 0: level 0 has 500 Gaussians, over four fifths of the 200 before it");
    object = ssdgs_object_default(models[0]), object.levels = models + 1, object.level_count = 2;
    ssdgs_model *wrong[3] = {models[1], models[1], NULL};
    object.levels = wrong;
    refused(&object, 1, "object 0: level 1 has 200 Gaussians, over four fifths of the 200 before it");
    object.levels = wrong + 2, object.level_count = 1;
    refused(&object, 1, "object 0: level 0 is NULL or has another context");
    s.transfer = SSDGS_TRANSFER_NONE;
    wrong[2] = cloud(&s, 0, 10, 0.5);
    refused(&object, 1, "object 0: level 0 is NULL or has another context");
    ssdgs_model_destroy(wrong[2]);
    const int many = 32768; /* twice as many are one too many */
    ssdgs_object *objects = (ssdgs_object *)malloc((size_t)many * sizeof *objects);
    for (int i = 0; i < many; i++) {
        objects[i] = ssdgs_object_default(models[1]);
        objects[i].levels = models + 2;
        objects[i].level_count = 1;
    }
    refused(objects, many, "a scene of 32768 objects");
    free(objects);
    for (int i = 0; i < 3; i++) ssdgs_model_destroy(models[i]);
}

/* ---- shadows from and on other things ---- */

/* Behind one Gaussian the light is 1 - its alpha, by its formula; before it and beside it nothing is missing.
 */
static void test_query(void) {
    enum { POINTS = 3000 };
    static ssdgs_real points[3 * POINTS], fraction[POINTS];
    ssdgs_settings s = small_settings();
    s.light_map.size = 256;
    for (int baked = 0; baked < 2; baked++)
        for (int kind = 0; kind < 2; kind++) {
            s.baked = baked; /* whose frames need no light themselves */
            ssdgs_model *plate = plate_of(&s, 0.3, 0.8);
            ssdgs_object object = ssdgs_object_default(plate);
            ssdgs_light lights[2] = {point_light(5, 0, 1), point_light(0.2, 0.1, 3)};
            if (kind) {
                lights[1].position[0] = lights[1].position[1] = 0, lights[1].position[2] = 1;
                TEST_PARALLEL(lights[1]);
            }
            object.to_world[11] = (ssdgs_real)0.5; /* lifted */
            CHECK(!ssdgs_scene_light(scene, &object, 1, NULL, lights, 2, NULL));
            double worst = 0, mean = 0;
            for (uint64_t i = 0; i < 3 * POINTS; i++) points[i] = (ssdgs_real)(2 * draw(i) - 1);
            CHECK(!ssdgs_scene_shadow(scene, 1, points, POINTS, fraction));
            for (int i = 0; i < POINTS; i++) {
                const double x = (double)points[3 * i], y = (double)points[3 * i + 1],
                             z = (double)points[3 * i + 2], t = kind ? 0 : (3 - 0.5) / (3 - z);
                const double px = kind ? x : 0.2 + (x - 0.2) * t, py = kind ? y : 0.1 + (y - 0.1) * t;
                const double want = z > 0.5 ? 1 : 1 - 0.8 * exp(-(px * px + py * py) / 2 / 0.09);
                /* a Gaussian's shadow begins at its centre's distance, less the bias */
                if (fabs(z - 0.5) < 0.15) continue;
                const double error = fabs((double)fraction[i] - want);
                worst = test_most(worst, error);
                mean += error;
            }
            CHECK(worst < 0.105 && mean < 0.02 * (double)POINTS); /* between a map's levels */
            CHECK(!ssdgs_scene_shadow(scene, 0, points, 0, NULL));
            CHECK(ssdgs__chunks(0) == 0 && ssdgs__chunks(2147483647) == 2097152);
            ssdgs_model_destroy(plate);
        }
}

/* Answers from another scene's maps. */
static void of_scene(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    ssdgs_real passed[256];
    CHECK(count > 0 && count <= 256);
    CHECK(!ssdgs_scene_shadow((ssdgs_scene *)user, light, points, count, passed));
    for (int i = 0; i < count; i++) fraction[i] *= passed[i];
}

/* The half of what comes, of the second light alone; counts what it is asked. */
static int asked;
static double about[3]; /* where the points must lie */
static void half_of(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    for (int i = 0; i < count; i++) {
        for (int c = 0; c < 3; c++) CHECK(fabs((double)points[3 * i + c] - about[c]) < 1);
        CHECK(fraction[i] == 1);
        if (light == *(int *)user) fraction[i] *= (ssdgs_real)0.5;
    }
    asked += count;
}

static void half_again(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    half_of(user, light, points, count, fraction);
}

/* An occluder equals a plate that does what it does; one that takes half leaves half. */
static void test_occluder(void) {
    const ssdgs_camera camera = camera_from(0, -2.2, 0.3);
    const ssdgs_light lights[2] = {point_light(0.3, 0, 4), point_light(2, -2, 1)};
    ssdgs_context *was = context;
    ssdgs_scene *was_scene = scene, *other_scene = NULL;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = 1;
    ssdgs_settings s = small_settings();
    s.light_map.size = 512;
    s.shadow.layers = 0;
    ssdgs_context *other = NULL;
    CHECK(!ssdgs_context_create(&desc, &other) && !ssdgs_scene_create(other, &other_scene));
    context = other;
    ssdgs_model *foreign = plate_of(&s, 0.25, 0.9);
    CHECK(!ssdgs_context_create(&desc, &context) && !ssdgs_scene_create(context, &scene));
    ssdgs_model *plate = plate_of(&s, 0.25, 0.9), *ball = cloud(&s, 0, 300, 0.3);
    ssdgs_object there = ssdgs_object_default(foreign), object[2];
    object[0] = placed(ball, 0.4, 1, 0, 0.1, 0, -0.2);
    object[1] = ssdgs_object_default(plate);
    there.to_world[11] = object[1].to_world[11] = (ssdgs_real)1.2;
    CHECK(!ssdgs_scene_light(other_scene, &there, 1, NULL, lights, 2, NULL));
    ssdgs_occluder occluder = {of_scene, other_scene, 1, NULL, 0};
    for (int transport = 0; transport < 2; transport++) {
        const ssdgs_render_options options = ssdgs_render_options_exact();
        together(object, 2, &camera, lights, 2, &options, shot);
        together(object, 1, &camera, lights, 2, &options, shot + 1);
        ssdgs_scene_occlude(scene, &occluder);
        together(object, 1, &camera, lights, 2, &options, shot + 2);
        CHECK(!shot[2].stats.lights_cached);
        const int first = 3 * PIXELS / 3; /* below the plate */
        double darker = 0, norm = 0;
        for (int i = first; i < 3 * PIXELS; i++) {
            darker += (double)(shot[1].value[i] - shot[0].value[i]);
            norm += (double)shot[1].value[i];
        }
        CHECK(darker > 0.05 * norm);
        CHECK_L2(shot[2].value + first, shot[0].value + first, 3 * PIXELS - first, 0.05,
                 "an occluder for a plate");
        CHECK_L2(shot[2].value + 9 * PIXELS + first, shot[0].value + 9 * PIXELS + first, 3 * PIXELS - first,
                 0.12, "what scatters");
        ssdgs_scene_occlude(scene, NULL);
        if (transport) break;
        s.transport = 1;
        ssdgs_model_destroy(ball);
        ball = object[0].model = cloud(&s, 0, 300, 0.3);
    }
    int second = 1;
    ssdgs_occluder half = {half_of, &second, 1, NULL, 0};
    together(object, 1, &camera, lights + 1, 1, NULL, shot);
    const ssdgs_light twice[2] = {lights[1], lights[1]};
    ssdgs_scene_occlude(scene, &half);
    asked = 0;
    object[0].to_world[3] = 50, about[0] = 50;
    together(object, 1, &camera, twice, 2, NULL, shot + 1);
    CHECK(asked == 600); /* no pixel */
    half.revision++;     /* nothing was in sight, nor is: no light is wanted, though its answers may differ */
    ssdgs_scene_occlude(scene, &half);
    together(object, 1, &camera, twice, 2, NULL, shot + 1);
    CHECK(asked == 600);
    ssdgs_scene *ahead = NULL; /* but maps that are asked for are made */
    CHECK(!ssdgs_scene_create(context, &ahead));
    ssdgs_scene_occlude(ahead, &half);
    CHECK(!ssdgs_scene_light(ahead, object, 1, NULL, twice, 2, NULL));
    CHECK(asked == 1200);
    ssdgs_scene_destroy(ahead);
    object[0].to_world[3] = (ssdgs_real)0.1, about[0] = 0;
    together(object, 1, &camera, twice, 2, NULL, shot + 1);
    CHECK(asked > 1500);
    double other_light = 0, sum = 0; /* by what comes to where it scatters: nothing else changes that */
    for (int i = 9 * PIXELS; i < 12 * PIXELS; i++) {
        other_light += fabs((double)(shot[1].value[i] - 2 * shot[0].value[i]));
        sum += (double)shot[1].value[i];
    }
    CHECK(other_light > 1e-3 * sum);
    for (int i = 0; i < 3 * PIXELS; i++) shot[0].value[3 * PIXELS + i] *= (ssdgs_real)1.5;
    CHECK_L2(shot[1].value + 3 * PIXELS, shot[0].value + 3 * PIXELS, 3 * PIXELS, 1e-5,
             "half of one of two lights");
    int same_second = 1;
    for (int change = 0; change < 5; change++) { /* what is kept stays until the answers may change */
        const int pixels_alone = asked = 0;
        if (change == 2) half.revision++;
        if (change == 3) half.user = &same_second;
        if (change == 4) half.shadow = half_again;
        ssdgs_scene_occlude(scene, change ? &half : NULL);
        together(object, 1, &camera, twice, 2, NULL, shot + 2);
        CHECK(shot[2].stats.lights_cached == 0 && (change > 0) == (asked > pixels_alone));
        together(object, 1, &camera, twice, 2, NULL, shot + 2);
        CHECK(shot[2].stats.lights_cached == 2);
    }
    CHECK(same(shot + 1, shot + 2));
    ssdgs_model_destroy(ball), ssdgs_model_destroy(plate), ssdgs_model_destroy(foreign);
    ssdgs_scene_destroy(scene), ssdgs_scene_destroy(other_scene);
    ssdgs_context_destroy(context), ssdgs_context_destroy(other);
    context = was, scene = was_scene;
}

/* The maps of a frame made ahead: the frame finds them, and what the camera saw stays. */
static void test_ahead(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_light lights[2] = {point_light(2, -2, 2), point_light(-2, -1, 1)};
    ssdgs_settings s = small_settings();
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    const ssdgs_object object = ssdgs_object_default(model);
    ssdgs_real point[3] = {0, 0, -2}, fraction = -1;
    together(&object, 1, &camera, lights, 2, NULL, shot);
    ssdgs_scene *ahead = NULL;
    const ssdgs_image image = planes_of(shot + 1);
    CHECK(!ssdgs_scene_create(context, &ahead));
    CHECK(ssdgs_scene_shadow(ahead, 0, point, 1, &fraction) == SSDGS_ERR_ARGUMENT);
    for (int frame = 0; frame < 3; frame++) {
        if (frame == 2) lights[1].position[0] += (ssdgs_real)0.5;
        CHECK(!ssdgs_scene_light(ahead, &object, 1, NULL, lights, 2, NULL));
        CHECK(!ssdgs_scene_shadow(ahead, 1, point, 1, &fraction) && fraction >= 0 && fraction <= 1);
        CHECK(!ssdgs_scene_render(ahead, &object, 1, &camera, lights, 2, NULL, &image, &shot[1].stats));
        CHECK(shot[1].stats.lights_cached == 2 && shot[1].stats.camera_cached == (frame > 0));
        CHECK((frame < 2) == same(shot, shot + 1));
    }
    /* one that draws without maps makes them when they are asked for */
    s = ssdgs_settings_published();
    s.scattering.width = 16;
    ssdgs_model *plain = cloud(&s, 0, 1500, 0.5);
    const ssdgs_object shaded = ssdgs_object_default(plain);
    ssdgs_scene *late = NULL;
    CHECK(!ssdgs_scene_create(context, &late));
    for (int i = 0; i < 2; i++)
        CHECK(!ssdgs_scene_render(late, &shaded, 1, &camera, lights, 2, NULL, &image, &shot[1].stats));
    CHECK(shot[1].stats.lights_cached == 2);
    CHECK(ssdgs_scene_shadow(late, 1, point, 1, &fraction) == SSDGS_ERR_ARGUMENT);
    ssdgs_scene *early = NULL; /* one that is lit before any camera looks has the same light */
    for (int i = 0; i < 2; i++) {
        const ssdgs_image both = planes_of(shot + i);
        CHECK(!ssdgs_scene_create(context, &early));
        if (i) CHECK(!ssdgs_scene_light(early, &shaded, 1, NULL, lights, 2, NULL));
        CHECK(!ssdgs_scene_render(early, &shaded, 1, &camera, lights, 2, NULL, &both, NULL));
        ssdgs_scene_destroy(early);
    }
    CHECK(same(shot, shot + 1));
    CHECK(!ssdgs_scene_light(late, &shaded, 1, NULL, lights, 2, NULL));
    for (int c = 0; c < 3; c++) point[c] = -lights[1].position[c];
    CHECK(!ssdgs_scene_shadow(late, 1, point, 1, &fraction) && fraction < (ssdgs_real)0.5);
    ssdgs_scene_destroy(late);
    ssdgs_model_destroy(plain);
    const int wrong[3] = {-1, 2, 0};
    for (int i = 0; i < 3; i++)
        CHECK(ssdgs_scene_shadow(ahead, wrong[i], i < 2 ? point : NULL, 1, &fraction) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_scene_shadow(NULL, 0, point, 1, &fraction) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_scene_light(NULL, &object, 1, NULL, lights, 2, NULL) == SSDGS_ERR_ARGUMENT);
    for (int i = 0; i < 2; i++) { /* where one is refused there are none of an earlier frame */
        CHECK(!ssdgs_scene_light(ahead, &object, 1, NULL, lights, 2, NULL));
        CHECK(!ssdgs_scene_shadow(ahead, 1, point, 1, &fraction));
        CHECK(ssdgs_scene_light(ahead, i ? &object : NULL, 1, NULL, i ? NULL : lights, 2, NULL) ==
              SSDGS_ERR_ARGUMENT);
        CHECK(ssdgs_scene_shadow(ahead, 1, point, 1, &fraction) == SSDGS_ERR_ARGUMENT);
        CHECK(!ssdgs_scene_light(ahead, &object, 1, NULL, lights, 2, NULL));
        CHECK(!ssdgs_scene_shadow(ahead, 1, point, 1, &fraction));
        CHECK(ssdgs_scene_render(ahead, i ? &object : NULL, 1, i ? NULL : &camera, lights, 2, NULL, &image,
                                 NULL) == SSDGS_ERR_ARGUMENT);
        CHECK(ssdgs_scene_shadow(ahead, 1, point, 1, &fraction) == SSDGS_ERR_ARGUMENT);
    }
    ssdgs_scene_occlude(NULL, NULL);
    ssdgs_scene_destroy(ahead);
    ssdgs_model_destroy(model);
}

enum { MAP = 96, REVERSED = 8, ENDLESS = 16, PARALLEL = 32, RADIAL = 64, UPWARDS = 128, CONVENTIONS = 256 };

/* How a shadow map is seen: from where, along which axes, how far to the sides. */
typedef struct looking {
    double eye[3], right[3], up[3], ahead[3], wide;
    int convention;
} looking;

/* Whether a plate of 0.8 x 0.6 at z = 0.5 is between a place and the light. near_edge: by how much not, or
 * so. */
static int plate_hides(const looking *l, const double *at, double *near_edge) {
    double from[3];
    for (int c = 0; c < 3; c++) from[c] = l->convention & PARALLEL ? at[c] - 9 * l->ahead[c] : l->eye[c];
    const double t = (0.5 - at[2]) / (from[2] - at[2]);
    const double x = at[0] + t * (from[0] - at[0]), y = at[1] + t * (from[1] - at[1]);
    *near_edge = fmax(fabs(x) - 0.4, fabs(y) - 0.3);
    return t > 0 && t < 1 && *near_edge < 0;
}

/* The light's matrix, and its map of the plate and a floor at z = -1. */
static void make_shadow_map(const looking *l, ssdgs_shadow_map *map, float depth[MAP * MAP]) {
    const int c = l->convention, parallel = c & PARALLEL;
    const double near_plane = 0.1, far_plane = 10;
    double rows[4][4] = {{0}}, zw[2]; /* clip z = zw[0] z + zw[1] of the way ahead, within 0 .. w */
    if (parallel) zw[0] = 1 / (far_plane - near_plane), zw[1] = -near_plane * zw[0];
    else if (c & ENDLESS) zw[0] = 1, zw[1] = -near_plane;
    else zw[0] = far_plane / (far_plane - near_plane), zw[1] = -near_plane * zw[0];
    for (int j = 0; j < 4; j++) {
        double x = 0, y = 0, z = 0;
        for (int i = 0; i < 3; i++) {
            const double at = j < 3 ? i == j : -l->eye[i];
            x += l->right[i] * at, y += l->up[i] * at, z += l->ahead[i] * at;
        }
        const double one = j == 3, w = parallel ? one : z;
        rows[0][j] = x / l->wide, rows[1][j] = y / l->wide * (c & SSDGS_CLIP_Y_DOWN ? -1 : 1);
        rows[2][j] = zw[0] * z + zw[1] * one, rows[3][j] = w;
        if (c & REVERSED) rows[2][j] = w - rows[2][j];
        if (!(c & SSDGS_CLIP_Z_FROM_0)) rows[2][j] = 2 * rows[2][j] - w;
    }
    memset(map, 0, sizeof *map);
    map->width = map->height = MAP;
    map->flags = c & 7;
    map->range = (ssdgs_real)(c & RADIAL ? 7 : 0);
    map->bias = (ssdgs_real)0.02;
    map->pitch = (c & UPWARDS ? -1 : 1) * (ptrdiff_t)(MAP * sizeof *depth);
    map->depth = depth + (c & UPWARDS ? MAP * (MAP - 1) : 0);
    for (int i = 0; i < 16; i++)
        map->matrix[c & SSDGS_COLUMN_MAJOR ? i % 4 * 4 + i / 4 : i] = (ssdgs_real)rows[i / 4][i % 4];
    for (int i = 0; i < MAP * MAP; i++) {
        const double x = (2 * (i % MAP + 0.5) / MAP - 1) * l->wide,
                     y = (1 - 2 * (i / MAP + 0.5) / MAP) * l->wide;
        double along[3], from[3], clip[4], distance = 0, edge;
        for (int j = 0; j < 3; j++) {
            const double side = x * l->right[j] + y * l->up[j];
            along[j] = l->ahead[j] + (parallel ? 0 : side);
            from[j] = l->eye[j] + (parallel ? side : 0);
        }
        double at[3];
        for (int j = 0; j < 3; j++) at[j] = from[j] + along[j] * (-1 - from[2]) / along[2];
        if (plate_hides(l, at, &edge))
            for (int j = 0; j < 3; j++) at[j] = from[j] + along[j] * (0.5 - from[2]) / along[2];
        for (int j = 0; j < 4; j++)
            clip[j] = rows[j][0] * at[0] + rows[j][1] * at[1] + rows[j][2] * at[2] + rows[j][3];
        for (int j = 0; j < 3; j++) distance += (at[j] - l->eye[j]) * (at[j] - l->eye[j]);
        const double z = clip[2] / clip[3], value = c & SSDGS_CLIP_Z_FROM_0 ? z : (1 + z) / 2;
        depth[(c & UPWARDS ? MAP - 1 - i / MAP : i / MAP) * MAP + i % MAP] =
            (float)(c & RADIAL ? sqrt(distance) / 7 : value);
    }
}

/* An engine's shadow map says where a plate's shadow is, by every convention. */
static void test_shadow_maps(void) {
    static float depth[MAP * MAP], other_depth[MAP * MAP];
    const double s = 1 / sqrt(6.0);
    looking l = {{0.6, -0.3, 1.8}, {2 * s, -s, -s}, {0, 0, 0}, {-1, 0, 0}, 1.1, 0};
    const double length = sqrt(0.6 * 0.6 + 0.3 * 0.3 + 1.8 * 1.8);
    for (int c = 0; c < 3; c++) l.ahead[c] = -l.eye[c] / length;
    double along = 0, norm2 = 0;
    for (int c = 0; c < 3; c++) along += l.right[c] * l.ahead[c];
    for (int c = 0; c < 3; c++) l.right[c] -= along * l.ahead[c], norm2 += l.right[c] * l.right[c];
    for (int c = 0; c < 3; c++) l.right[c] /= sqrt(norm2);
    for (int c = 0; c < 3; c++)
        l.up[c] = l.right[(c + 1) % 3] * l.ahead[(c + 2) % 3] - l.right[(c + 2) % 3] * l.ahead[(c + 1) % 3];
    const ssdgs_real ahead[3] = {(ssdgs_real)l.ahead[0], (ssdgs_real)l.ahead[1], (ssdgs_real)l.ahead[2]},
                     even[3] = {1, 1, 1};
    const ssdgs_light lights[2] = {point_light(0.6, -0.3, 1.8), ssdgs_light_directional(ahead, even)};
    ssdgs_shadow_map maps[2];
    ssdgs_occluder occluder = {NULL, NULL, 0, maps, 1};
    ssdgs_frame frame;
    memset(&frame, 0, sizeof frame);
    frame.occluder = &occluder;
    frame.light_count = 2;
    frame.lights = lights;
    for (l.convention = 0; l.convention < CONVENTIONS; l.convention++) {
        int dark = 0, wrong = 0;
        if ((l.convention & RADIAL) && (l.convention & (PARALLEL | REVERSED))) continue;
        make_shadow_map(&l, maps, depth);
        maps->light = (l.convention & PARALLEL) != 0;
        for (uint64_t i = 0; i < 400; i++) {
            double edge;
            const double at[3] = {2.4 * draw(3 * i) - 1.2, 2.4 * draw(3 * i + 1) - 1.2,
                                  1.6 * draw(3 * i + 2) - 0.9};
            const ssdgs_real point[3] = {(ssdgs_real)at[0], (ssdgs_real)at[1], (ssdgs_real)at[2]};
            ssdgs_real fraction[2];
            const int hidden = plate_hides(&l, at, &edge);
            if (fabs(edge) < 0.08 || fabs(at[2] - 0.5) < 0.05) continue;
            for (int light = 0; light < 2; light++)
                ssdgs__let_pass(&frame, light, point, 1, fraction + light);
            wrong += fabs((double)fraction[maps->light] - !hidden) > 1e-6;
            wrong += fraction[!maps->light] < 1; /* of which there is no map */
            dark += hidden;
        }
        if (!CHECK(dark > 10 && !wrong))
            printf("    convention %d: %d wrong, %d dark\n", l.convention, wrong, dark);
    }
    l.convention = 0;
    make_shadow_map(&l, maps, depth);
    const ssdgs_real below[9] = {0, 0, (ssdgs_real)0.499, 0, 0, (ssdgs_real)0.4, 0, 0, 0},
                     beside[9] = {9, 0, 0, (ssdgs_real)1.2, (ssdgs_real)-0.6, (ssdgs_real)3.6, 0, 0, -90};
    ssdgs_real passed[3];
    for (l.convention = RADIAL; l.convention >= 0; l.convention -= RADIAL) {
        make_shadow_map(&l, maps, depth);
        ssdgs__let_pass(&frame, 0, below, 3, passed); /* within the bias; behind it; farther behind */
        CHECK(passed[0] >= 1 && passed[1] <= 0 && passed[2] <= 0);
        ssdgs__let_pass(&frame, 0, beside, 2, passed); /* beside the map, behind the light */
        CHECK(passed[0] >= 1 && passed[1] >= 1);
    }
    l.convention = 0;
    double last = 0; /* across the plate's edge it goes up without a jump */
    int between = 0, down = 0;
    for (int i = 0; i <= 400; i++) {
        const ssdgs_real at[3] = {(ssdgs_real)(-0.6 - 0.001 * i), 0, 0};
        ssdgs__let_pass(&frame, 0, at, 1, passed);
        between += passed[0] > 0 && passed[0] < 1;
        down += (double)passed[0] < last - 1e-6 || (double)passed[0] > last + 0.1;
        last = (double)passed[0];
    }
    CHECK(between > 20 && !down && last >= 1);
    maps->width = maps->height = 1; /* one pixel, which the plate has */
    *depth = depth[MAP * MAP / 2 + MAP / 2];
    ssdgs__let_pass(&frame, 0, below, 3, passed);
    CHECK(passed[1] <= 0 && passed[2] <= 0);
    *depth = 1; /* nothing as far as the map goes, so nothing beyond */
    ssdgs_real far_off[3];
    for (int c = 0; c < 3; c++) far_off[c] = (ssdgs_real)(l.eye[c] + 12 * l.ahead[c]);
    ssdgs__let_pass(&frame, 0, far_off, 1, passed);
    CHECK(passed[0] >= 1);
    maps->width = maps->height = MAP;
    for (int i = 0; i < MAP * MAP; i++) depth[i] = i % MAP ? 0 : 1; /* the first column is light */
    for (int c = 0; c < 3; c++)
        far_off[c] = (ssdgs_real)(l.eye[c] + l.ahead[c] - 0.997 * l.wide * l.right[c]);
    ssdgs__let_pass(&frame, 0, far_off, 1, passed);
    CHECK(passed[0] >= 1 && passed[0] <= 1);
    maps->width = maps->height = 1;
    for (int i = 0; i < 3; i++) { /* what is not a depth hides nothing */
        *depth = (float)(i ? i > 1 ? INFINITY : 7 : NAN);
        ssdgs__let_pass(&frame, 0, below, 3, passed);
        CHECK(passed[0] >= 1 && passed[1] >= 1 && passed[2] >= 1);
    }
    make_shadow_map(&l, maps + 1, depth);
    l.wide = 0.1; /* a cascade: the first map that has a place decides */
    make_shadow_map(&l, maps, other_depth);
    for (int i = 0; i < MAP * MAP; i++) other_depth[i] = 1;
    occluder.map_count = 2;
    const ssdgs_real both[6] = {0, 0, 0, (ssdgs_real)-0.25, 0, 0};
    ssdgs__let_pass(&frame, 0, both, 2, passed);
    CHECK(passed[0] >= 1 && passed[1] <= 0);
    for (l.convention = 0; l.convention < CONVENTIONS;
         l.convention += REVERSED) { /* one that ends before it */
        if (l.convention & (ENDLESS | RADIAL)) continue;
        const double far_off_eye[3] = {20 * l.eye[0], 20 * l.eye[1], 20 * l.eye[2]};
        looking shallow = l;
        memcpy(shallow.eye, far_off_eye, sizeof shallow.eye);
        shallow.wide = 9;
        make_shadow_map(&shallow, maps, other_depth);
        maps->light = maps[1].light = (l.convention & PARALLEL) != 0;
        l.wide = 1.1;
        make_shadow_map(&l, maps + 1, depth);
        maps[1].light = maps->light;
        for (int i = 0; i < MAP * MAP; i++) other_depth[i] = l.convention & REVERSED ? 0 : 1;
        ssdgs__let_pass(&frame, maps->light, below, 3, passed);
        CHECK(passed[2] <= 0);
    }
    l.convention = 0;
    occluder.map_count = 1; /* nearer to the light than the bias nothing is dark */
    make_shadow_map(&l, maps, depth);
    maps->bias = 3;
    ssdgs__let_pass(&frame, 0, below, 3, passed);
    CHECK(passed[0] >= 1 && passed[1] >= 1 && passed[2] >= 1);
}

/* Exactly what the plate takes. */
static looking plate_light;
static void of_plate(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    (void)user;
    for (int i = 0; i < count && !light; i++) {
        double edge;
        const double at[3] = {(double)points[3 * i], (double)points[3 * i + 1], (double)points[3 * i + 2]};
        if (plate_hides(&plate_light, at, &edge)) fraction[i] = 0;
    }
}

/* A frame by a shadow map is one by a callback that knows the plate; what is kept stays until that light's
   map changes; what is not sound is refused. */
static void test_shadow_map_frames(void) {
    static float depth[MAP * MAP];
    const ssdgs_camera camera = camera_from(0, -2.2, 0.3);
    const ssdgs_light lights[2] = {point_light(0.3, 0, 3), point_light(2, -2, 1)};
    ssdgs_settings s = small_settings();
    s.light_map.size = 256;
    ssdgs_model *ball = cloud(&s, 0, 300, 0.5);
    const ssdgs_object object = placed(ball, 0.4, 1, 0, 0.1, 0, -0.2);
    const looking from = {{0.3, 0, 3}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, 0.4, 0};
    ssdgs_shadow_map map;
    ssdgs_occluder occluder = {of_plate, NULL, 1, NULL, 0};
    plate_light = from;
    together(&object, 1, &camera, lights, 2, NULL, shot);
    ssdgs_scene_occlude(scene, &occluder);
    together(&object, 1, &camera, lights, 2, NULL, shot + 1);
    make_shadow_map(&from, &map, depth);
    occluder.shadow = NULL, occluder.maps = &map, occluder.map_count = 1;
    ssdgs_scene_occlude(scene, &occluder);
    together(&object, 1, &camera, lights, 2, NULL, shot + 2);
    CHECK(shot[2].stats.lights_cached == 0); /* both had the callback's answers */
    double darker = 0, norm = 0;
    for (int i = 0; i < 3 * PIXELS; i++)
        darker += fabs((double)(shot[1].value[i] - shot[0].value[i])), norm += fabs((double)shot[0].value[i]);
    CHECK(darker > 0.05 * norm);
    CHECK_L2(shot[2].value, shot[1].value, 3 * PIXELS, 0.05, "a shadow map for a callback");
    static float copied[MAP * MAP];
    memcpy(copied, depth, sizeof copied);
    for (int change = 0; change < 6; change++) {
        map.depth = change % 2 ? copied : depth; /* the same elsewhere */
        if (change == 1) map.revision++;
        if (change == 2) map.bias *= 2;
        if (change == 3) map.matrix[3] *= (ssdgs_real)1.001;
        if (change == 4) map.light = 1;
        if (change == 5) occluder.map_count = 0;
        ssdgs_scene_occlude(scene, &occluder);
        together(&object, 1, &camera, lights, 2, NULL, shot + 2);
        CHECK(shot[2].stats.lights_cached == (change == 0 ? 2 : change == 4 ? 0 : 1));
    }
    CHECK(same(shot, shot + 2));
    make_shadow_map(&from, &map, depth);
    for (int wrong = 0; wrong < 16; wrong++) {
        ssdgs_shadow_map bad = map;
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        occluder.maps = wrong == 8 ? NULL : &bad, occluder.map_count = wrong == 9 ? -1 : 1;
        if (wrong == 0) bad.width = 0;
        if (wrong == 1) bad.height = 32769;
        if (wrong == 2) bad.depth = NULL;
        if (wrong == 3) bad.light = -1;
        if (wrong == 4) bad.flags = 8;
        if (wrong == 5) bad.bias = -1;
        if (wrong == 6) bad.range = (ssdgs_real)INFINITY;
        if (wrong == 7) bad.matrix[15] = (ssdgs_real)NAN;
        if (wrong == 10) bad.pitch = 0;
        if (wrong == 11) bad.pitch = 4 - bad.pitch;
        if (wrong == 12) bad.width = 32769;
        if (wrong == 13) bad.height = 0;
        if (wrong == 14) bad.bias = (ssdgs_real)NAN;
        if (wrong == 15) bad.range = -1;
        ssdgs_scene_occlude(scene, &occluder);
        CHECK(ssdgs_scene_render(scene, &object, 1, &camera, lights, 2, NULL, &image, NULL) ==
              (wrong == 7 ? SSDGS_ERR_NONFINITE : SSDGS_ERR_ARGUMENT));
        char pitch[80];
        sprintf(pitch, "pitch = %d, where a row has %d bytes", (int)bad.pitch, 4 * MAP);
        const char *says = wrong < 2 || wrong == 12 || wrong == 13 ? "pixels, where 1 to"
                           : wrong == 10 || wrong == 11            ? pitch
                                                                   : "shadow map";
        if (!CHECK(strstr(ssdgs_error_message(context), says)))
            printf("    %s\n", ssdgs_error_message(context));
    }
    ssdgs_scene_occlude(scene, NULL);
    ssdgs_model_destroy(ball);
}

/* A spot inside its cone is a point light, outside it is none, between them glTF's part of it. */
static void test_spot(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light point = point_light(2, -2, 2);
    for (int kind = 0; kind < 3; kind++) { /* scattering by transport, without, and per Gaussian */
        ssdgs_settings s = kind == 2 ? ssdgs_settings_published() : small_settings();
        s.transport = kind == 0;
        s.scattering.width = s.shadow.width = 16;
        ssdgs_model *model = cloud(&s, 0, 300, 0.3);
        ssdgs_object object = placed(model, 0.4, 1.5, 0, 0.1, 0, -0.1);
        ssdgs_light spot = point;
        const ssdgs_render_options options = ssdgs_render_options_exact();
        spot.kind = SSDGS_LIGHT_SPOT;
        for (int c = 0; c < 3; c++) spot.direction[c] = (ssdgs_real)((c == 1 ? 1 : -1) * sqrt(1.0 / 3));
        together(&object, 1, &camera, &point, 1, &options, shot);
        spot.cone[0] = 1, spot.cone[1] = 2;
        together(&object, 1, &camera, &spot, 1, &options, shot + 1);
        CHECK(same(shot, shot + 1)); /* wide: all is inside */
        for (int c = 0; c < 3; c++) spot.direction[c] *= -1;
        spot.cone[0] = (ssdgs_real)0.1, spot.cone[1] = 1;
        together(&object, 1, &camera, &spot, 1, &options, shot + 1);
        double left = 0;
        for (int i = 0; i < 12 * PIXELS; i++) left += fabs((double)shot[1].value[i]);
        CHECK(left <= 0);
        /* a small object at a known angle: the part of it, on all that it sends */
        for (int c = 0; c < 3; c++) spot.direction[c] *= -1;
        spot.cone[0] = (ssdgs_real)0.05, spot.cone[1] = (ssdgs_real)0.4;
        object = placed(model, 0.4, 0.01, 0, 0.5, 0.3, 0.2);
        const ssdgs_camera close = camera_from(0.4, -2.2, 0.8);
        const double d[3] = {0.5 - 2, 0.3 + 2, 0.2 - 2},
                     far_away = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        const double along = (-d[0] + d[1] - d[2]) * sqrt(1.0 / 3) / far_away;
        const double t = (along - cos(0.4)) / (cos(0.05) - cos(0.4)), part = t * t;
        CHECK(t > 0.1 && t < 0.9);
        together(&object, 1, &close, &point, 1, &options, shot);
        together(&object, 1, &close, &spot, 1, &options, shot + 1);
        for (int i = 0; i < 12 * PIXELS; i++) shot[0].value[i] *= (ssdgs_real)part;
        CHECK_L2(shot[1].value, shot[0].value, 3 * PIXELS, 0.02, "a spot's rim");
        CHECK_L2(shot[1].value + 9 * PIXELS, shot[0].value + 9 * PIXELS, 3 * PIXELS, 0.02,
                 "what scatters in a spot's rim");
        ssdgs_model_destroy(model);
    }
    ssdgs_light wrong = point;
    const ssdgs_image image = planes_of(shot);
    wrong.kind = SSDGS_LIGHT_SPOT, wrong.cone[1] = 1;
    CHECK(ssdgs_scene_render(scene, NULL, 0, &camera, &wrong, 1, NULL, &image, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "light 0: its direction") != NULL);
    wrong.direction[0] = 1, wrong.cone[0] = 0;
    CHECK(!ssdgs_scene_render(scene, NULL, 0, &camera, &wrong, 1, NULL, &image, NULL));
    for (int i = 0; i < 7; i++) {
        static const char *const says[7] = {"the angles of its cone are 1 and 1",
                                            "the angles of its cone are -1 and 1",
                                            "the angles of its cone are 0 and 4",
                                            "kind = -1",
                                            "kind = 99",
                                            "range = -1",
                                            "range = inf"};
        ssdgs_light light = wrong;
        if (i < 2) light.cone[0] = (ssdgs_real)(i ? -1 : 1);
        if (i == 2) light.cone[1] = 4;
        if (i == 3 || i == 4) light.kind = (ssdgs_light_kind)(i == 3 ? -1 : 99);
        if (i > 4) light.range = (ssdgs_real)(i == 5 ? -1 : INFINITY);
        CHECK(ssdgs_scene_render(scene, NULL, 0, &camera, &light, 1, NULL, &image, NULL) ==
              SSDGS_ERR_ARGUMENT);
        if (!CHECK(strstr(ssdgs_error_message(context), says[i])))
            printf("    %s\n", ssdgs_error_message(context));
    }
}

/* All Gaussians to three standard deviations, strays left out; nothing where there is nothing. */
static void test_bounds(void) {
    ssdgs_settings s = small_settings();
    ssdgs_real low[3], high[3], want_low[3] = {9, 9, 9}, want_high[3] = {-9, -9, -9};
    ssdgs_model *model = cloud(&s, 0, 300, 0.3), *empty = NULL;
    for (int i = 0; i < 300; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        const ssdgs_real w = g.rotation[0], x = g.rotation[1], y = g.rotation[2], z = g.rotation[3],
                         n = 2 / (w * w + x * x + y * y + z * z);
        const ssdgs_real axis[9] = {
            1 - n * (y * y + z * z), n * (x * y - w * z),     n * (x * z + w * y),
            n * (x * y + w * z),     1 - n * (x * x + z * z), n * (y * z - w * x),
            n * (x * z - w * y),     n * (y * z + w * x),     1 - n * (x * x + y * y)};
        for (int c = 0; c < 3; c++) {
            double variance = 0;
            for (int k = 0; k < 3; k++)
                variance += (double)(axis[3 * c + k] * axis[3 * c + k] * g.scale[k] * g.scale[k]);
            const ssdgs_real reach = (ssdgs_real)(3 * sqrt(variance));
            want_low[c] = g.position[c] - reach < want_low[c] ? g.position[c] - reach : want_low[c];
            want_high[c] = g.position[c] + reach > want_high[c] ? g.position[c] + reach : want_high[c];
        }
    }
    CHECK(!ssdgs_model_bounds(model, low, high));
    CHECK_NEAR(low, want_low, 3, 1e-6, 1e-5, "bounds, low");
    CHECK_NEAR(high, want_high, 3, 1e-6, 1e-5, "bounds, high");
    ssdgs_model *faint = cloud(&s, 0, 5, 0.3); /* nothing of it is drawn; it still has a box */
    for (int i = 0; i < 5; i++)
        ssdgs_model_arrays(faint).gaussians[SSDGS_OPACITY * faint->capacity + (size_t)i] = -9;
    for (int i = 0; i < 5; i++) ssdgs_model_arrays(faint).gaussians[i] += 5;
    CHECK(!ssdgs_model_bounds(faint, low, high) && low[0] > 4 && high[0] > low[0] && high[0] < 6);
    ssdgs_model_destroy(faint);
    ssdgs_model_arrays(model).gaussians[7] = 100; /* a stray */
    CHECK(!ssdgs_model_bounds(model, low, high) && high[0] < 5);
    CHECK(!ssdgs_model_create(context, &s, 0, &empty));
    CHECK(!ssdgs_model_bounds(empty, low, high) && !(low[0] < 0) && !(high[2] > 0));
    CHECK(ssdgs_model_bounds(NULL, low, high) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_model_bounds(model, low, NULL) == SSDGS_ERR_ARGUMENT);
    ssdgs_model_destroy(model), ssdgs_model_destroy(empty);
}

/* ---- cameras ---- */

/* A camera at eye looks at target, as wide as fov_x, upright by up; any up makes a camera. */
/* Each kind's values are where they belong, the others 0, and a direction has length 1. */
static void test_light_kinds(void) {
    const ssdgs_real at[3] = {1, 2, 3}, along[3] = {0, 3, -4}, bright[3] = {5, 6, 7};
    const ssdgs_real unit[3] = {0, (ssdgs_real)0.6, (ssdgs_real)-0.8}, zero[3] = {0, 0, 0};
    const ssdgs_light lights[3] = {ssdgs_light_point(at, bright), ssdgs_light_directional(along, bright),
                                   ssdgs_light_spot(at, unit, bright, (ssdgs_real)0.25, (ssdgs_real)0.5)};
    for (int i = 0; i < 3; i++) {
        CHECK((int)lights[i].kind == i);
        CHECK(!memcmp(lights[i].intensity, bright, sizeof bright));
        CHECK(!memcmp(lights[i].position, i == 1 ? zero : at, sizeof at));
        for (int c = 0; c < 3; c++) CHECK(fabs((double)(lights[i].direction[c] - (i ? unit[c] : 0))) < 1e-7);
        CHECK(!(lights[i].range > 0) && !(lights[i].focus > 0) && !lights[i].unshadowed);
    }
    CHECK(!memcmp(lights[2].direction, unit, sizeof unit)); /* a unit vector stays as it is */
    CHECK(lights[2].cone[0] == (ssdgs_real)0.25 && lights[2].cone[1] == (ssdgs_real)0.5);
    const ssdgs_light none = ssdgs_light_directional(NULL, NULL);
    CHECK(!memcmp(none.direction, zero, sizeof zero) && !memcmp(none.intensity, zero, sizeof zero));
}

static void test_look_at(void) {
    enum { W = 80, H = 50 };
    for (int i = 0; i < 100; i++) {
        const uint64_t at = 16 * (uint64_t)i;
        const double fov = 0.1 + 2.5 * draw(at + 9);
        ssdgs_real eye[3], target[3], up[3];
        double distance = 0, length = 0, upright = 0, level = 0, error = 0;
        for (uint64_t c = 0; c < 3; c++) {
            eye[c] = (ssdgs_real)(8 * draw(at + c) - 4);
            target[c] = (ssdgs_real)(8 * draw(at + 3 + c) - 4);
            const double ahead = (double)(target[c] - eye[c]);
            up[c] = (ssdgs_real)(i < 60   ? 2 * draw(at + 6 + c) - 1
                                 : i < 70 ? 0.0
                                 : i < 80 ? ahead
                                 : i < 90 ? -3 * ahead
                                          : (i & 1 ? 1e30 : 1e-30) * (draw(at + 6 + c) - 0.5));
            distance += ahead * ahead;
            length += (double)up[c] * (double)up[c];
        }
        distance = sqrt(distance), length = sqrt(length);
        const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)fov, W, H);
        CHECK(camera.width == W && camera.height == H && !(camera.near_plane > 0));
        double point[3][3]; /* the eye, the target, what is beside it: seen by the camera */
        for (int k = 0; k < 3; k++)
            for (int r = 0; r < 3; r++) {
                point[k][r] = (double)camera.view[4 * r + 3];
                for (int c = 0; c < 3; c++)
                    point[k][r] +=
                        (double)camera.view[4 * r + c] *
                        (k == 0   ? (double)eye[c]
                         : k == 1 ? (double)target[c]
                                  : (double)target[c] + (double)camera.view[c] * distance * tan(fov / 2));
            }
        for (int r = 0; r < 3; r++) error = test_most(error, fabs(point[0][r]));
        CHECK(error < 1e-5 && fabs(point[1][2] - distance) < 1e-5 && fabs(point[2][2] - distance) < 1e-4);
        for (int k = 1; k < 3; k++) {
            const double x = (double)camera.fx * point[k][0] / point[k][2] + (double)camera.cx,
                         y = (double)camera.fy * point[k][1] / point[k][2] + (double)camera.cy;
            CHECK(fabs(x - (k == 1 ? W / 2 : W)) < 2e-3 && fabs(y - H / 2) < 2e-3);
        }
        const ssdgs_real *v = camera.view;
        for (int r = 0; r < 9; r++) {
            double dot = 0;
            for (int c = 0; c < 3; c++) dot += (double)v[4 * (r / 3) + c] * (double)v[4 * (r % 3) + c];
            CHECK(fabs(dot - (r / 3 == r % 3)) < 1e-6);
        }
        CHECK(v[0] * (v[5] * v[10] - v[6] * v[9]) - v[1] * (v[4] * v[10] - v[6] * v[8]) +
                  v[2] * (v[4] * v[9] - v[5] * v[8]) >
              (ssdgs_real)0.999);
        for (int c = 0; c < 3; c++) {
            level += (double)v[c] * (double)up[c] / length;
            upright -= (double)v[4 + c] * (double)up[c] / length; /* y points down */
        }
        if (i < 60 || i >= 90) CHECK(fabs(level) < 1e-5 && upright > 0);
    }
}

/* Tiles where nothing is are not blended: colour, alpha and median depth have the bits of a frame with
   components, which blends them all, over any background, and nothing beside the picture is written. */
static void test_empty_tiles(void) {
    enum { W = 75, H = 53, STRIDE = 80, PLANE = STRIDE * H };
    static ssdgs_real planes[2][8 * PLANE];
    ssdgs_settings s = small_settings();
    ssdgs_model *model = cloud(&s, 0, 300, 0.2);
    const ssdgs_object object = ssdgs_object_default(model);
    const ssdgs_light light = point_light(0.5, -3, 2);
    const ssdgs_real eye[3] = {0, -5, 1}, at[3] = {0, 0, (ssdgs_real)0.4}, up[3] = {0, 0, 1},
                     middle[3] = {0, 0, 0};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, at, up, (ssdgs_real)0.7, W, H),
                       close_by = ssdgs_camera_look_at(eye, middle, up, (ssdgs_real)0.05, W, H);
    for (int way = 0; way < 3; way++) {
        ssdgs_render_options options = ssdgs_render_options_default();
        for (int c = 0; c < 3 && way; c++) options.background[c] = (ssdgs_real)(way == 1 ? 0.2 * c : -1);
        for (int all = 0; all < 2; all++) {
            ssdgs_image image;
            memset(&image, 0, sizeof image);
            image.stride = STRIDE;
            image.color = planes[all], image.alpha = planes[all] + 3 * PLANE;
            image.median_depth = planes[all] + 4 * PLANE;
            if (all) image.normal = planes[all] + 5 * PLANE;
            CHECK(!ssdgs_scene_render(scene, &object, 1, &close_by, &light, 1, &options, &image, NULL));
            CHECK(planes[all][3 * PLANE] > (ssdgs_real)0.5); /* the corner was covered */
            for (int i = 0; i < 8 * PLANE; i++) planes[all][i] = 77;
            CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, NULL));
        }
        CHECK(!memcmp(planes[0], planes[1], 5 * PLANE * sizeof planes[0][0]));
        int beside = 0, covered = 0;
        for (int i = 0; i < 5 * PLANE; i++) {
            const int x = (i < 3 * PLANE ? i / 3 : i) % STRIDE;
            beside += x >= W && (planes[0][i] < 77 || planes[0][i] > 77);
            covered += i >= 3 * PLANE && i < 4 * PLANE && x < W && planes[0][i] > 0;
        }
        CHECK(!beside && covered > 20 && covered < W * H / 3);
        CHECK(planes[0][0] == options.background[0] && planes[0][1] == options.background[1] &&
              planes[0][3 * PLANE] == 0 && planes[0][4 * PLANE] == 0);
    }
    ssdgs_model_destroy(model);
}

/* A light's map as a shader reads it, by the lines that ssdgs.h has for it. */
static double shader_left(const float a[4], const float b[4], double d, double bias) {
    const int past = d > (double)a[1];
    const double from = (double)(past ? a[1] : a[0]), to = (double)(past ? a[2] : a[1]),
                 dark = (double)(past ? b[0] : a[3]), begin = to - bias > from ? to - bias : from,
                 rise = ((double)(past ? b[2] : b[1]) - dark) * (d - begin) / (to - begin);
    return d <= (double)a[0] ? 1 : d > (double)a[2] ? (double)b[3] : d > begin ? dark + rise : dark;
}

static double shader_passed(const ssdgs_light_map *map, const float *a, const float *b,
                            const ssdgs_real at[3]) {
    for (int face = 0; face < map->faces; face++) {
        double p[3], pixel[2], length = 0, sum = 0;
        for (int i = 0; i < 3; i++) {
            const ssdgs_real *row = map->view[face] + 4 * i;
            p[i] = (double)row[0] * (double)at[0] + (double)row[1] * (double)at[1] +
                   (double)row[2] * (double)at[2] + (double)row[3];
            length += p[i] * p[i];
        }
        for (int c = 0; c < 2; c++)
            pixel[c] = (double)map->focal * p[c] / (map->parallel ? 1 : p[2]) + map->size / 2.0 - 0.5;
        if (!(p[2] > 0) || !(pixel[0] >= 0 && pixel[0] <= map->size - 1) ||
            !(pixel[1] >= 0 && pixel[1] <= map->size - 1))
            continue;
        const double d = (map->parallel ? p[2] : sqrt(length)) * (1 - 1e-6) - (double)map->bias;
        const int x = (int)fmin(floor(pixel[0]), map->size - 2),
                  y = (int)fmin(floor(pixel[1]), map->size - 2);
        for (int i = 0; i < 4; i++) {
            const double u = pixel[0] - x, w = pixel[1] - y;
            const size_t from =
                4 * (((size_t)(face * map->size + y + i / 2)) * (size_t)map->size + (size_t)(x + i % 2));
            sum += (i % 2 ? u : 1 - u) * (i / 2 ? w : 1 - w) *
                   shader_left(a + from, b + from, d, (double)map->bias);
        }
        return sum;
    }
    return 1;
}

static void test_shader_maps(void) {
    enum { POINTS = 3000 };
    static ssdgs_real points[3 * POINTS], fraction[POINTS];
    ssdgs_settings s = small_settings();
    ssdgs_model *model = cloud(&s, 0, 300, 0.4);
    ssdgs_object object[2] = {ssdgs_object_default(model), ssdgs_object_default(model)};
    object[1].to_world[3] = 2;
    ssdgs_light lights[6];
    const ssdgs_real one[3] = {1, 1, 1}, down[3] = {0, (ssdgs_real)0.6, (ssdgs_real)-0.8};
    lights[0] = point_light(0.5, -3, 2); /* outside */
    lights[1] = point_light(1, 0, 0);    /* between them: six faces */
    lights[2] = ssdgs_light_directional(down, one);
    lights[3] = point_light(3000, -9000, 9000); /* seen as a parallel one */
    lights[4] = ssdgs_light_spot(lights[0].position, down, one, (ssdgs_real)0.2, (ssdgs_real)0.3);
    lights[5] = lights[0], lights[5].unshadowed = 1;
    ssdgs_light_map map;
    CHECK(ssdgs_scene_light_map(scene, 0, NULL, NULL, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(!ssdgs_scene_light(scene, object, 2, NULL, lights, 6, NULL));
    CHECK(ssdgs_scene_light_map(scene, 6, &map, NULL, NULL) == SSDGS_ERR_ARGUMENT);
    for (int light = 0; light < 6; light++) {
        CHECK(!ssdgs_scene_light_map(scene, light, &map, NULL, NULL));
        CHECK(map.faces == (light == 1 ? 6 : light < 5) && map.parallel == (light == 2 || light == 3));
        const size_t size = 4 * (size_t)map.faces * (size_t)map.size * (size_t)map.size;
        float *a = (float *)malloc((size + 1) * sizeof *a), *b = (float *)malloc((size + 1) * sizeof *b);
        CHECK(ssdgs_scene_light_map(scene, light, &map, a, NULL) == SSDGS_ERR_ARGUMENT);
        CHECK(!ssdgs_scene_light_map(scene, light, &map, a, b));
        for (int i = 0; i < 3 * POINTS; i++)
            points[i] = (ssdgs_real)(3 * draw(900 + (uint64_t)i) - (i % 3 ? 1.5 : 0.5));
        CHECK(!ssdgs_scene_shadow(scene, light, points, POINTS, fraction));
        int off = 0, dark = 0;
        for (int i = 0; i < POINTS; i++) { /* where it falls a rounding tells */
            off += fabs(shader_passed(&map, a, b, points + 3 * i) - (double)fraction[i]) > 1e-3;
            dark += fraction[i] < (ssdgs_real)0.9;
        }
        if (!CHECK(off < POINTS / 300)) printf("    light %d: %d of %d\n", light, off, POINTS);
        CHECK(light == 5 ? !dark : dark > POINTS / 50);
        free(a), free(b);
    }
    /* what a scene drew before is not left in its maps */
    float *texels[2];
    for (int way = 0; way < 2; way++) {
        ssdgs_scene *fresh = NULL;
        CHECK(!ssdgs_scene_create(context, &fresh));
        lights[0].position[0] = (ssdgs_real)0.1;
        if (!way) CHECK(!ssdgs_scene_light(fresh, object, 1, NULL, lights, 1, NULL));
        lights[0].position[0] = 1;
        CHECK(!ssdgs_scene_light(fresh, object, 1, NULL, lights, 1, NULL));
        CHECK(!ssdgs_scene_light_map(fresh, 0, &map, NULL, NULL));
        const size_t size = 4 * (size_t)map.faces * (size_t)map.size * (size_t)map.size;
        texels[way] = (float *)calloc(2 * size, sizeof *texels[way]);
        CHECK(!ssdgs_scene_light_map(fresh, 0, &map, texels[way], texels[way] + size));
        if (way) CHECK(!memcmp(texels[0], texels[1], 2 * size * sizeof *texels[0]));
        ssdgs_scene_destroy(fresh);
    }
    free(texels[0]), free(texels[1]);
    ssdgs_model_destroy(model);
}

/* Engines' matrices, made from a camera by their books, give the camera back: right-handed and looking along
   -z, left-handed and along z, rows or columns, any range of depths, y up or down. */
static void test_matrices(void) {
    ssdgs_camera want = camera_from(0.4, -2.2, 0.8), got;
    want.width = 80, want.height = 50;
    want.cx = 35, want.cy = 27, want.fy = 70;
    for (int kind = 0; kind < 64; kind++) {
        const int column_major = kind & 1, y_down = kind >> 1 & 1, left = kind >> 2 & 1,
                  reverse = kind >> 3 & 1, gl = kind >> 4 & 1, infinite = kind >> 5 & 1;
        const double axis[3] = {1, y_down ? 1.0 : -1.0,
                                left ? 1.0 : -1.0}; /* of right, down, forward in view space */
        const double n = 0.1, far_plane = 50, s = axis[2], f = infinite ? 1e30 : far_plane;
        double near_z = reverse ? 1 : gl ? -1 : 0, far_z = reverse ? (gl ? -1 : 0) : 1;
        /* z = a s d + b, over d */
        const double b = (near_z - far_z) / (1 / n - 1 / f), a = s * (near_z - b / n);
        double view[16], projection[16];
        memset(view, 0, sizeof view), memset(projection, 0, sizeof projection);
        for (int i = 0; i < 12; i++) view[i] = axis[i / 4] * (double)want.view[i];
        view[15] = 1;
        const double up = y_down ? 1 : -1; /* of a pixel's y in clip space */
        projection[0] = 2 * (double)want.fx / want.width;
        projection[2] = s * (2 * (double)want.cx / want.width - 1);
        projection[5] = up * axis[1] * 2 * (double)want.fy / want.height;
        projection[6] = up * s * (2 * (double)want.cy / want.height - 1);
        projection[10] = a, projection[11] = b, projection[14] = s;
        ssdgs_real v[16], p[16];
        for (int i = 0; i < 16; i++) {
            const int from = column_major ? i % 4 * 4 + i / 4 : i;
            v[i] = (ssdgs_real)view[from], p[i] = (ssdgs_real)(3 * projection[from]); /* of any scale */
        }
        const int flags = (column_major ? SSDGS_COLUMN_MAJOR : 0) | (y_down ? SSDGS_CLIP_Y_DOWN : 0);
        if (!CHECK(!ssdgs_camera_from_matrices(context, v, p, flags, 80, 50, &got)))
            printf("    %s\n", ssdgs_error_message(context));
        CHECK(got.width == 80 && got.height == 50 && got.near_plane == 0);
        CHECK_NEAR(got.view, want.view, 12, 1e-6, 0, "view");
        CHECK_NEAR(&got.fx, &want.fx, 4, 1e-4, 0, "fx, fy, cx, cy");
        /* depth buffers that such projections make, oblique ones, too, are depths again; one row upwards */
        static float buffer[80 * 50];
        static ssdgs_real depth[80 * 50];
        const int oblique = kind % 3 == 0, upwards = kind % 5 == 0;
        double worst = 0;
        for (int i = 0; i < 80 * 50; i++) {
            const double d = i % 7 ? 0.2 + 40 * draw((uint64_t)i) : f;
            const double at[2] = {(i % 80 + 0.5 - (double)want.cx) * d / (double)want.fx,
                                  (i / 80 + 0.5 - (double)want.cy) * d / (double)want.fy};
            double z = (a * s * d + b) / d;
            for (int c = 0; c < 2 && oblique; c++) z += (c ? -0.02 : 0.03) * axis[c] * at[c] / d;
            buffer[(upwards ? 49 - i / 80 : i / 80) * 80 + i % 80] = (float)(gl ? (z + 1) / 2 : z);
        }
        for (int c = 0; c < 2 && oblique; c++)
            p[column_major ? 4 * c + 2 : 8 + c] = (ssdgs_real)(3 * (c ? -0.02 : 0.03));
        CHECK(!ssdgs_depth_from_buffer(
            context, p, flags | (gl ? 0 : SSDGS_CLIP_Z_FROM_0), buffer + (upwards ? 49 * 80 : 0),
            upwards ? -80 * (int)sizeof *buffer : 80 * (int)sizeof *buffer, 80, 50, depth));
        for (int i = 0; i < 80 * 50; i++) { /* floats near 1 tell depths of 40 to 5e-4 */
            const double d = i % 7 ? 0.2 + 40 * draw((uint64_t)i) : f;
            const double off = fabs((double)depth[i] / d - 1) / (1e-5 + 2e-5 * d);
            if (d > 1e29) CHECK(!(depth[i] > 0 && depth[i] < 10000));
            else worst = off > worst ? off : worst;
        }
        if (!CHECK(worst < 1)) printf("    kind %d: %g\n", kind, worst);
        for (int wrong = 0; wrong < 8; wrong++) {
            static const int sides[8][2] = {{80, 50}, {80, 50},     {80, 50}, {80, 50},
                                            {0, 50},  {1 << 29, 1}, {80, 0},  {80, 1 << 29}};
            CHECK(ssdgs_depth_from_buffer(context, wrong == 0 ? NULL : p, wrong == 1 ? 8 : 0,
                                          wrong == 2 ? NULL : buffer, 320, sides[wrong][0], sides[wrong][1],
                                          wrong == 3 ? NULL : depth) == SSDGS_ERR_ARGUMENT);
        }
        CHECK(ssdgs_depth_from_buffer(context, p, 0, buffer, -316, 80, 50, depth) == SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(context), "80 x 50 pixels, pitch -316") != NULL);
        ssdgs_real flat[16];
        memcpy(flat, p, sizeof flat);
        flat[column_major ? 14 : 11] = 0;
        CHECK(ssdgs_depth_from_buffer(context, flat, flags, buffer, 320, 80, 50, depth) ==
              SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(context), "its depths are all the same") != NULL);
        for (int c = 0; c < 2; c++) p[column_major ? 4 * c + 2 : 8 + c] = 0;
        /* the same camera from a world whose x is turned round: left-handed */
        for (int i = 0; i < 3; i++) v[column_major ? i : 4 * i] *= -1;
        CHECK(!ssdgs_camera_from_matrices(context, v, p, flags, 80, 50, &got));
        const ssdgs_image image = planes_of(shot);
        CHECK(!ssdgs_scene_render(scene, NULL, 0, &got, NULL, 0, NULL, &image, NULL));
        /* what is none */
        for (int broken = 0; broken < 6; broken++) {
            static const int place[6] = {12, 3, 15, 1, 14, 0};
            const int at = column_major ? place[broken] % 4 * 4 + place[broken] / 4 : place[broken];
            ssdgs_real *in = (broken == 0 ? v : p) + at, kept = *in;
            *in = broken == 1 || broken == 2 || broken == 3 || !broken ? 1 : 0;
            CHECK(ssdgs_camera_from_matrices(context, v, p, flags, 80, 50, &got) == SSDGS_ERR_ARGUMENT);
            *in = kept;
        }
        CHECK(ssdgs_camera_from_matrices(context, v, p, flags | 8, 80, 50, &got) == SSDGS_ERR_ARGUMENT);
        v[0] *= 2;
        CHECK(ssdgs_camera_from_matrices(context, v, p, flags, 80, 50, &got) == SSDGS_ERR_ARGUMENT);
        v[0] = (ssdgs_real)NAN;
        CHECK(ssdgs_camera_from_matrices(context, v, p, flags, 80, 50, &got) == SSDGS_ERR_NONFINITE);
    }
    const ssdgs_real none[16] = {0};
    CHECK(ssdgs_camera_from_matrices(context, NULL, none, 0, 80, 50, &got) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_camera_from_matrices(context, none, NULL, 0, 80, 50, &got) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_camera_from_matrices(context, none, none, 0, 80, 50, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_camera_from_matrices(NULL, none, none, 0, 80, 50, &got) == SSDGS_ERR_ARGUMENT);
}

/* A whole left-handed world: models placed by a reflection, a camera that mirrors. */
static void test_left_handed(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_camera mirrored = camera;
    ssdgs_light light = point_light(2, -2, 2), there = light;
    ssdgs_settings s = small_settings();
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    ssdgs_object object = ssdgs_object_default(model);
    ssdgs_render_options options = ssdgs_render_options_exact();
    options.alpha_threshold = (ssdgs_real)1e-6, options.stop = 0;
    options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
    together(&object, 1, &camera, &light, 1, &options, shot);
    object.to_world[0] = -1;
    there.position[0] *= -1;
    for (int i = 0; i < 3; i++) mirrored.view[4 * i] *= -1;
    together(&object, 1, &mirrored, &there, 1, &options, shot + 1);
    for (int i = 0; i < PIXELS; i++) shot[1].value[12 * PIXELS + 3 * i] *= -1; /* normals, in that world */
    for (int plane = 0; plane < PLANES; plane++)
        CHECK_L2(shot[1].value + plane * PIXELS, shot[0].value + plane * PIXELS, PIXELS,
                 real64 ? 1e-12 : 1e-5, "a left-handed world");
    const ssdgs_image image = planes_of(shot);
    CHECK(ssdgs_render(model, &mirrored, &light, 1, &image) == SSDGS_ERR_ARGUMENT);
    ssdgs_model_destroy(model);
}

/* ---- what a frame does without ---- */

/* A cloud of 64, somewhere, of some size. */
static ssdgs_model *somewhere(const ssdgs_settings *settings, int number, const double at[3], double size) {
    ssdgs_model *model = cloud(settings, 64 * number, 64, 0.3);
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    for (int i = 0; i < 64; i++)
        for (size_t c = 0; c < 3; c++) {
            ssdgs_real *x = v.gaussians + (SSDGS_POSITION + c) * v.stride + i;
            *x = (ssdgs_real)(size * (double)*x + at[c]);
            v.gaussians[(SSDGS_LOG_SCALE + c) * v.stride + (size_t)i] += (ssdgs_real)log(size);
        }
    return model;
}

/* Objects around the camera, near and far, large and small, leave out nothing that a single model of all
 * shows. */
static void test_out_of_sight(void) {
    enum { MANY = 24 };
    const ssdgs_settings settings = small_settings();
    ssdgs_light lights[3] = {parallel_light(0.6, 0, 0.8), point_light(0.5, -1, 1), point_light(-1, -2, 1)};
    int left_out = 0;
    for (int i = 0; i < 3; i++) lights[i].unshadowed = 1; /* so no map, which would cover other things */
    lights[1].range = (ssdgs_real)1.4;
    lights[2].kind = SSDGS_LIGHT_SPOT;
    lights[2].direction[0] = (ssdgs_real)0.6;
    lights[2].direction[1] = (ssdgs_real)0.8;
    lights[2].cone[0] = (ssdgs_real)0.2;
    lights[2].cone[1] = (ssdgs_real)0.5;
    for (int round = 0; round < 12; round++) {
        ssdgs_model *models[MANY], *all = NULL;
        ssdgs_object objects[MANY];
        const ssdgs_render_options options = ssdgs_render_options_exact();
        const ssdgs_camera camera = camera_from(2 * draw(9000 + (uint64_t)round) - 1, -2.2, 0.8);
        CHECK(!ssdgs_model_create(context, &settings, 64 * MANY, &all));
        stir_networks(all, 0);
        const ssdgs_model_view whole = ssdgs_model_arrays(all);
        for (int i = 0; i < MANY; i++) {
            const uint64_t seed = 10000 + 16 * (uint64_t)(MANY * round + i);
            double at[3];
            for (uint64_t c = 0; c < 3; c++)
                at[c] = 8 * pow(draw(seed + c), 2) * (draw(seed + 3 + c) < 0.5 ? -1 : 1);
            for (int c = 0; c < 3 && i < 2; c++) { /* one around the camera, one beside the picture */
                at[c] = -(double)(camera.view[c] * camera.view[3] + camera.view[4 + c] * camera.view[7] +
                                  camera.view[8 + c] * camera.view[11]);
                at[c] += i ? 2.5 * (double)camera.view[8 + c] + 1.4 * (double)camera.view[c]
                           : -0.1 * (double)camera.view[8 + c];
            }
            models[i] = somewhere(&settings, i, at, i ? 0.2 + 3 * pow(draw(seed + 7), 3) : 0.8);
            const ssdgs_model_view wide = ssdgs_model_arrays(models[i]);
            for (int g = 0; i == 1 && g < 64; g++) /* whose Gaussians are wide, and near each other */
                for (size_t c = 0; c < 3; c++) {
                    ssdgs_real *x = wide.gaussians + (SSDGS_POSITION + c) * wide.stride + g;
                    *x = (ssdgs_real)(at[c] + 0.02 * ((double)*x - at[c]));
                    wide.gaussians[(SSDGS_LOG_SCALE + c) * wide.stride + (size_t)g] = (ssdgs_real)log(0.2);
                }
            objects[i] = ssdgs_object_default(models[i]);
            const ssdgs_model_view part = ssdgs_model_peek(models[i]);
            for (size_t c = 0; c < (size_t)part.channels; c++)
                memcpy(whole.gaussians + c * whole.stride + 64 * i, part.gaussians + c * part.stride,
                       64 * sizeof(ssdgs_real));
        }
        together(objects, MANY, &camera, lights, 3, &options, shot);
        alone(all, &camera, lights, 3, &options, shot + 1);
        CHECK(same(shot, shot + 1) && shot[0].stats.visible == shot[1].stats.visible);
        CHECK(shot[0].stats.objects < MANY && shot[1].stats.objects == 1);
        left_out += MANY - shot[0].stats.objects;
        for (int i = 0; i < MANY; i++) ssdgs_model_destroy(models[i]);
        ssdgs_model_destroy(all);
    }
    if (!real64) printf("figure objects_left_out %d of %d\n", left_out, 12 * MANY);
    CHECK(left_out > 12 * MANY / 4);
}

/* Local lights: what they do not reach changes nothing of what they do; what moves out of their reach leaves
   their maps; one batch of views or many, kept or not, the picture is the same. */
static void test_local_lights(void) {
    enum { MANY = 9, LIGHTS = 4, STEPS = 30 };
    ssdgs_settings settings = small_settings();
    const ssdgs_render_options options = ssdgs_render_options_exact();
    const ssdgs_camera camera = camera_from(0.3, -4, 2);
    static const double origin[3] = {0, 0, 0};
    ssdgs_model *models[MANY];
    ssdgs_object objects[MANY];
    ssdgs_light lights[LIGHTS];
    ssdgs_scene *fresh = NULL;
    int kept = 0, of_some = 0;
    settings.light_map.size = 0; /* as fine as the Gaussians in reach ask for */
    for (int i = 0; i < MANY; i++) {
        models[i] = somewhere(&settings, i, origin, 0.7);
        objects[i] = ssdgs_object_default(models[i]);
        objects[i].to_world[3] = (ssdgs_real)(i % 3 - 1);
        objects[i].to_world[7] = (ssdgs_real)(i / 3 - 1);
    }
    for (int i = 0; i < LIGHTS; i++) {
        lights[i] = point_light(i % 2 * 1.6 - 0.8, i / 2 * 1.6 - 0.8, 0.5);
        lights[i].range = (ssdgs_real)0.9;
    }
    lights[3].kind = SSDGS_LIGHT_SPOT;
    lights[3].position[2] = 2;
    lights[3].range = 4;
    lights[3].direction[2] = -1;
    lights[3].cone[0] = (ssdgs_real)0.2;
    lights[3].cone[1] = (ssdgs_real)0.3;
    /* those far behind, out of the first light's reach: there or not */
    for (int i = 5; i < MANY; i++) objects[i].to_world[7] += 3;
    together(objects, MANY, &camera, lights, 1, &options, shot);
    together(objects, 5, &camera, lights, 1, &options, shot + 1);
    for (int i = 5; i < MANY; i++) objects[i].to_world[7] -= 3;
    CHECK(!memcmp(shot[0].value, shot[1].value, 3 * PIXELS * sizeof(ssdgs_real)));
    CHECK(shot[0].stats.light_instances == shot[1].stats.light_instances &&
          shot[0].stats.light_instances > 0);
    /* the same, twice as large: as fine a map */
    ssdgs_object large[MANY];
    ssdgs_camera further = camera;
    ssdgs_light brighter = lights[0];
    memcpy(large, objects, sizeof large);
    for (int i = 0; i < 12 * MANY; i++) large[i / 12].to_world[i % 12] *= 2;
    for (int c = 0; c < 3; c++) {
        further.view[4 * c + 3] *= 2;
        brighter.position[c] *= 2;
        brighter.intensity[c] *= 4;
    }
    brighter.range *= 2;
    together(objects, MANY, &camera, lights, 1, &options, shot);
    together(large, MANY, &further, &brighter, 1, &options, shot + 1);
    CHECK(shot[0].stats.light_instances == shot[1].stats.light_instances);
    CHECK_NEAR(shot[1].value, shot[0].value, 3 * PIXELS, real64 ? 1e-9 : 2e-4, real64 ? 1e-9 : 2e-3,
               "twice as large");
    for (int step = 0; step < STEPS; step++) {
        const uint64_t seed = 20000 + 8 * (uint64_t)step;
        const int which = (int)(draw(seed) * (double)MANY);
        const ssdgs_image planes[2] = {planes_of(shot), planes_of(shot + 1)};
        if (step % 5 != 4) {
            objects[which].to_world[3] += (ssdgs_real)(0.8 * draw(seed + 1) - 0.4);
            objects[which].to_world[7] += (ssdgs_real)(0.8 * draw(seed + 2) - 0.4);
        } else if (step < 5) lights[which % LIGHTS].position[0] += (ssdgs_real)0.1;
        else if (step < 10) lights[which % LIGHTS].range *= (ssdgs_real)1.1;
        else if (step < 15) lights[3].cone[1] += (ssdgs_real)0.1;
        else { /* sideways */ lights[3].direction[0] = (ssdgs_real)0.28;
            lights[3].direction[2] = (ssdgs_real)-0.96;
        }
        CHECK(!ssdgs_scene_render(scene, objects, MANY, &camera, lights, LIGHTS, &options, planes,
                                  &shot[0].stats));
        batch_bytes = step % 2 ? 0 : (size_t)1 << 28;
        CHECK(!ssdgs_scene_create(context, &fresh));
        CHECK(!ssdgs_scene_render(fresh, objects, MANY, &camera, lights, LIGHTS, &options, planes + 1,
                                  &shot[1].stats));
        ssdgs_scene_destroy(fresh);
        CHECK(same(shot, shot + 1) && !shot[1].stats.lights_cached);
        kept += shot[0].stats.lights_cached;
        of_some += shot[0].stats.lights_cached > 0 && shot[0].stats.lights_cached < LIGHTS;
        batch_bytes = step % 3 ? 0 : (size_t)1 << 28;
    }
    for (int batch = 0; batch < 2; batch++) { /* no view is walked twice */
        const ssdgs_image image = planes_of(shot);
        batch_bytes = (size_t)batch << 28;
        CHECK(!ssdgs_scene_create(context, &fresh));
        CHECK(!ssdgs_scene_render(fresh, objects, MANY, &camera, lights, LIGHTS, &options, &image,
                                  &shot[batch].stats));
        ssdgs_scene_destroy(fresh);
    }
    CHECK(shot[0].stats.light_instances == shot[1].stats.light_instances);
    if (!real64) printf("figure lights_kept %d of %d\n", kept, STEPS * LIGHTS);
    CHECK(kept > STEPS && of_some > STEPS / 3);
    /* what moves out of sight and out of all reach leaves everything */
    objects[8].to_world[7] = -40;
    together(objects, MANY, &camera, lights, LIGHTS, &options, shot);
    objects[8].to_world[7] = -41;
    together(objects, MANY, &camera, lights, LIGHTS, &options, shot + 1);
    CHECK(same(shot, shot + 1) && shot[1].stats.camera_cached && shot[1].stats.lights_cached == LIGHTS);
    CHECK(!shot[1].stats.light_instances && shot[1].stats.objects == MANY - 1);
    for (int i = 0; i < MANY; i++) ssdgs_model_destroy(models[i]);
}

/* A light of any kind, about around 0. */
static ssdgs_light any_light(uint64_t at) {
    double d[3], length = 0;
    for (int c = 0; c < 3; c++) {
        d[c] = 2 * draw(at + (uint64_t)c) - 1;
        length += d[c] * d[c];
    }
    length = sqrt(length) + 1e-9;
    const int kind = (int)(3 * draw(at + 3));
    ssdgs_light light = kind == 1 ? parallel_light(d[0] / length, d[1] / length, d[2] / length)
                                  : point_light(2 * d[0], 2 * d[1], 2 * d[2]);
    if (kind == 2) light.kind = SSDGS_LIGHT_SPOT;
    for (int c = 0; c < 3; c++) light.direction[c] = (ssdgs_real)(-d[c] / length);
    light.cone[0] = (ssdgs_real)(0.3 * draw(at + 4));
    light.cone[1] = light.cone[0] + (ssdgs_real)(0.1 + draw(at + 5));
    if (draw(at + 6) < 0.3) light.range = (ssdgs_real)(1 + 3 * draw(at + 7));
    if (draw(at + 8) < 0.3) light.focus = 2;
    light.unshadowed = draw(at + 9) < 0.2;
    return light;
}

/* Whatever an engine changes, in any order: a frame is what a new scene makes of it, and its colours do not
   depend on the planes that are asked for. */
static void test_anything(void) {
    enum { MODELS = 4, OBJECTS = 4, LIGHTS = 3, SEQUENCES = 12, STEPS = 25, CHANGES = 14 };
    for (uint64_t sequence = 0; sequence < SEQUENCES; sequence++) {
        uint64_t at = 50000 + 10000 * sequence;
        ssdgs_model *models[MODELS];
        ssdgs_object objects[OBJECTS];
        ssdgs_light lights[LIGHTS];
        ssdgs_camera camera = camera_from(0.3, -3, 1);
        ssdgs_render_options options = ssdgs_render_options_default();
        int count = OBJECTS, light_count = LIGHTS;
        for (int i = 0; i < MODELS; i++) { /* two of other lobes, one of lobes of its own, one baked */
            ssdgs_settings settings = small_settings();
            if (i == 2) settings.asg = SSDGS_ASG_GEOMETRIC;
            if (i == 3) settings.baked = 1;
            if (sequence % 3 == 1) settings.shadow.layers = 0;
            settings.light_map.size = sequence % 2 ? 0 : 64;
            models[i] = cloud(&settings, 400 + 100 * i, 70, 0.4);
        }
        ssdgs_model_arrays(models[1]).asg_sharpness[0] += 1;
        for (int i = 0; i < OBJECTS; i++)
            objects[i] = placed(models[i], 6 * draw(at + (uint64_t)i), 1, i & 1, 0.8 * i - 1.2, 0.3 * i, 0);
        for (int i = 0; i < LIGHTS; i++) lights[i] = any_light(at + 20 * (uint64_t)(1 + i));
        for (int step = 0; step < STEPS; step++) {
            at += 100;
            ssdgs_object *object = objects + (int)(OBJECTS * draw(at));
            ssdgs_light *light = lights + (int)(LIGHTS * draw(at + 1));
            const ssdgs_real some = (ssdgs_real)draw(at + 2);
            switch ((int)(CHANGES * draw(at + 3))) {
            case 0: object->to_world[3] += some - (ssdgs_real)0.5; break;
            case 1: object->model = models[(int)(MODELS * draw(at + 4))]; break;
            case 2: object->tint[1] = 2 * some, object->roughness = (ssdgs_real)0.5 + some; break;
            case 3: object->translucency = (ssdgs_real)0.5 + some; break;
            case 4: *light = any_light(at + 10); break;
            case 5: light->range = light->range > 0 ? 0 : 1 + 2 * some; break;
            case 6: light->focus = light->focus > 0 ? 0 : 3 * some; break;
            case 7: light->unshadowed = !light->unshadowed; break;
            case 8: light->intensity[0] = some > (ssdgs_real)0.7 ? 4 : 0; break;
            case 9:
                options.terms = draw(at + 5) < 0.5 ? SSDGS_ALL_TERMS : 1 + (int)(15 * draw(at + 6));
                break;
            case 10: count = 1 + (int)(OBJECTS * draw(at + 7)); break;
            case 11: light_count = (int)((LIGHTS + 1) * draw(at + 8)); break;
            case 12: options.ambient[0][1] = some; break;
            case 13: object->presence = some > (ssdgs_real)0.7 ? 1 : some; break;
            }
            if (draw(at + 9) < 0.1) ssdgs_model_arrays(models[0]).gaussians[5] += (ssdgs_real)0.1;
            if (draw(at + 30) < 0.3) camera = camera_from(2 * draw(at + 31) - 1, -3, 1);
            const ssdgs_image planes[2] = {planes_of(shot), planes_of(shot + 1)};
            ssdgs_image bare;
            ssdgs_scene *fresh = NULL;
            memset(&bare, 0, sizeof bare);
            bare.color = shot[2].value;
            const int bare_first = draw(at + 32) < 0.5;
            for (int i = 0; i < 2; i++)
                if (!CHECK(!ssdgs_scene_render(scene, objects, count, &camera, lights, light_count, &options,
                                               i == bare_first ? planes : &bare, NULL)))
                    printf("    %s\n", ssdgs_error_message(context));
            CHECK(!ssdgs_scene_create(context, &fresh));
            CHECK(!ssdgs_scene_render(fresh, objects, count, &camera, lights, light_count, &options,
                                      planes + 1, NULL));
            ssdgs_scene_destroy(fresh);
            const int kept = CHECK(same(shot, shot + 1)),
                      alike = CHECK(!memcmp(shot[0].value, shot[2].value, 3 * PIXELS * sizeof(ssdgs_real)));
            if (!kept || !alike) printf("    sequence %d, step %d\n", (int)sequence, step);
        }
        for (int i = 0; i < MODELS; i++) ssdgs_model_destroy(models[i]);
    }
}

/* A veil that a spot misses stands before a wall that it lights. The wall is as bright whether the veil is of
   the same model, another object, or one of other lobes, which is lit by itself, and whatever planes are
   asked for. */
static void test_missed(void) {
    const ssdgs_camera camera = camera_from(0, -3, 0);
    double first = 0;
    ssdgs_settings settings = small_settings();
    settings.shadow.layers = 0;
    ssdgs_model *both = NULL, *parts[2] = {NULL, NULL};
    CHECK(!ssdgs_model_create(context, &settings, 128, &both));
    for (int i = 0; i < 2; i++) CHECK(!ssdgs_model_create(context, &settings, 64, parts + i));
    for (int i = 0; i < 128; i++) {
        ssdgs_gaussian g = ssdgs_gaussian_default();
        g.position[0] = (ssdgs_real)(0.1 * (i % 8) - 0.35);
        g.position[1] = (ssdgs_real)(i < 64 ? -0.5 : 0.5);
        g.position[2] = (ssdgs_real)(0.1 * (i / 8 % 8) - 0.35);
        for (int c = 0; c < 3; c++) g.scale[c] = (ssdgs_real)(c < 2 ? 0.06 : 0.01);
        g.rotation[0] = g.rotation[1] = 1;
        g.normal[1] = -1;
        g.opacity = (ssdgs_real)(i < 64 ? 0.3 : 0.9);
        g.softness = 1;
        CHECK(!ssdgs_model_set(both, i, &g) && !ssdgs_model_set(parts[i / 64], i % 64, &g));
    }
    ssdgs_gaussian g; /* with other lobes it is another material */
    ssdgs_model *other = NULL;
    CHECK(!ssdgs_model_create(context, &settings, 64, &other));
    for (int i = 0; i < 64; i++) CHECK(!ssdgs_model_get(parts[0], i, &g) && !ssdgs_model_set(other, i, &g));
    ssdgs_model_arrays(other).asg_sharpness[0] += 1;
    ssdgs_light spot = point_light(0, -0.4, 0);
    spot.kind = SSDGS_LIGHT_SPOT;
    memset(spot.direction, 0, sizeof spot.direction);
    spot.direction[1] = 1;
    spot.cone[0] = (ssdgs_real)0.2;
    spot.cone[1] = (ssdgs_real)0.6;
    for (int c = 0; c < 3; c++) spot.intensity[c] = 3;
    ssdgs_render_options options = ssdgs_render_options_exact();
    options.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    for (int way = 0; way < 3; way++) {
        const ssdgs_object objects[2] = {ssdgs_object_default(way ? parts[1] : both),
                                         ssdgs_object_default(way == 1 ? parts[0] : other)};
        ssdgs_image image = planes_of(shot), bare;
        CHECK(!ssdgs_scene_render(scene, objects, way ? 2 : 1, &camera, &spot, 1, &options, &image, NULL));
        memset(&bare, 0, sizeof bare);
        bare.color = shot[1].value;
        CHECK(!ssdgs_scene_render(scene, objects, way ? 2 : 1, &camera, &spot, 1, &options, &bare, NULL));
        CHECK(!memcmp(shot[0].value, shot[1].value, 3 * PIXELS * sizeof(ssdgs_real)));
        const double red = (double)shot->value[3 * (SIDE / 2 * SIDE + SIDE / 2)];
        if (!way) first = red;
        if (!CHECK(fabs(red / first - 1) < 0.03)) printf("    %d: %g, not %g\n", way, red, first);
    }
    ssdgs_model_destroy(both), ssdgs_model_destroy(other);
    for (int i = 0; i < 2; i++) ssdgs_model_destroy(parts[i]);
}

/* ---- what is kept, and what is not ---- */

static void test_kept(void) {
    ssdgs_settings s = small_settings();
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_light lights[2] = {point_light(2, -2, 2), point_light(-2, -1, 1)};
    ssdgs_model *model[2] = {cloud(&s, 0, 200, 0.3), cloud(&s, 200, 100, 0.3)};
    ssdgs_object object[3] = {ssdgs_object_default(model[0]), placed(model[1], 1, 0.5, 0, 0.5, 0, 0),
                              placed(model[0], 2, 0.5, 1, -0.5, 0, 0)};
    const ssdgs_render_options options = ssdgs_render_options_default();
    together(object, 3, &camera, lights, 2, &options, shot);
    CHECK(!shot->stats.camera_cached && !shot->stats.lights_cached && shot->stats.gaussians == 500);
    for (int frame = 0; frame < 2; frame++) {
        together(object, 3, &camera, lights, 2, &options, shot + 1);
        CHECK(same(shot, shot + 1) && shot[1].stats.camera_cached && shot[1].stats.lights_cached == 2);
    }
    CHECK(shot[1].stats.shadows_cached > 0);
    lights[1].position[0] += (ssdgs_real)0.1;
    together(object, 3, &camera, lights, 2, &options, shot + 1);
    CHECK(shot[1].stats.camera_cached && shot[1].stats.lights_cached == 1);
    /* of each change, what a new scene makes of it */
    for (int change = 0; change < 5; change++) {
        if (change == 0) object[2].to_world[3] += (ssdgs_real)0.01;
        if (change == 1) ssdgs_model_arrays(model[1]).gaussians[0] += (ssdgs_real)0.01;
        if (change == 4) {
            object[1] = placed(model[1], 1.5, 0.5, 0, 0.5, 0, 0);
            together(object, 2, &camera, lights, 2, &options, shot + 1);
            object[1] = placed(model[1], 1.6, 0.5, 0, 0.5, 0, 0);
        }
        if (change == 2) {
            const ssdgs_object swap = object[0];
            object[0] = object[2];
            object[2] = swap;
        }
        together(object, change > 2 ? 2 : 3, &camera, lights, 2, &options, shot + 1);
        CHECK(!shot[1].stats.camera_cached && !shot[1].stats.lights_cached);
        ssdgs_scene *other = NULL;
        const ssdgs_image image = planes_of(shot + 2);
        CHECK(!ssdgs_scene_create(context, &other));
        CHECK(!ssdgs_scene_render(other, object, change > 2 ? 2 : 3, &camera, lights, 2, &options, &image,
                                  NULL));
        CHECK(same(shot + 1, shot + 2) && !same(shot, shot + 1));
        ssdgs_scene_destroy(other);
    }
    /* a focus, with which a light lights less: its map covers what it reaches, not all */
    for (int turn = 0; turn < 2; turn++) {
        ssdgs_scene *other = NULL;
        const ssdgs_image image = planes_of(shot + 1);
        lights[0].direction[1] = 1;
        lights[0].focus = (ssdgs_real)!turn;
        together(object, 2, &camera, lights, 2, &options, shot);
        CHECK(!ssdgs_scene_create(context, &other));
        CHECK(!ssdgs_scene_render(other, object, 2, &camera, lights, 2, &options, &image, NULL));
        CHECK(same(shot, shot + 1) && shot->stats.lights_cached == 1);
        ssdgs_scene_destroy(other);
    }
    /* a larger model out of sight and reach: what is kept of the others lies elsewhere then */
    ssdgs_model *larger = cloud(&s, 300, 300, 0.3);
    object[0] = placed(model[1], 0, 0.5, 0, 0, -40, 0);
    object[1] = ssdgs_object_default(model[0]);
    lights[0].range = lights[1].range = 5;
    together(object, 2, &camera, lights, 2, &options, shot);
    object[0].model = larger;
    together(object, 2, &camera, lights, 2, &options, shot + 1);
    CHECK(same(shot, shot + 1));
    s.transport = 0;
    ssdgs_model *dense =
        cloud(&s, 300, 300, 0.3); /* out of reach, but the trees of transport stand in one row */
    for (int way = 0; way < 2; way++) {
        object[0].model = way ? dense : larger;
        together(object, 2, &camera, lights, 2, &options, shot);
    }
    (void)ssdgs_model_arrays(model[0]);
    together(object, 2, &camera, lights, 2, &options, shot + 1);
    CHECK(shot->stats.lights_cached == 2 && same(shot, shot + 1));
    ssdgs_model_destroy(dense);
    for (int way = 0; way < 3; way++) { /* one that grows where it is, beside a larger one */
        ssdgs_camera near_by = camera;
        ssdgs_object two[2] = {placed(model[1], 0, way ? 0.6 : 0.5, 0, 0, 0, 0),
                               placed(model[0], 0, 3, 0, 0, 3, 0)};
        near_by.near_plane = (ssdgs_real)0.02;
        if (way == 2) (void)ssdgs_model_arrays(model[1]), (void)ssdgs_model_arrays(model[0]);
        together(two, 2, &near_by, lights, 2, &options, shot + (way > 1));
        CHECK(!shot[way > 1].stats.camera_cached);
    }
    CHECK(same(shot, shot + 1));
    for (int way = 0; way < 2; way++) { /* as many in all, but in other places */
        ssdgs_object four[4] = {placed(way ? larger : model[1], 0, 0.5, 0, 0, -40, 0), object[1],
                                placed(way ? model[1] : larger, 0, 0.5, 0, 0, -40, 0), object[1]};
        four[3].to_world[7] = 2;
        together(four, 4, &camera, lights, 2, &options, shot + way);
    }
    CHECK(same(shot, shot + 1));
    ssdgs_model_destroy(larger);
    for (int i = 0; i < 2; i++) ssdgs_model_destroy(model[i]);
    together(NULL, 0, &camera, lights, 2, &options, shot); /* and of models that are gone nothing is asked */
    CHECK(shot->stats.gaussians == 0 && shot->value[15 * PIXELS] == 0);
}

/* Whether a frame of the scene is that of a new one, shot that of shot[1]. */
static int as_new(const ssdgs_object *objects, int count, const ssdgs_camera *camera,
                  const ssdgs_light *light, const ssdgs_render_options *options) {
    ssdgs_scene *kept = scene;
    together(objects, count, camera, light, 1, options, shot);
    if (!CHECK(!ssdgs_scene_create(context, &scene))) exit(1);
    together(objects, count, camera, light, 1, options, shot + 1);
    ssdgs_scene_destroy(scene);
    scene = kept;
    return same(shot, shot + 1);
}

/* A light keeps its trees of transport while a model that it does not reach gives way to one of another size,
   or without a tree: those behind it lie elsewhere, also for Gaussians that come into view. */
static void test_moved_trees(void) {
    const ssdgs_real eye[3] = {(ssdgs_real)-1.5, -2, (ssdgs_real)0.3}, target[3] = {-2, 0, 0},
                     up[3] = {0, 0, 1};
    const ssdgs_camera apart = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.35, SIDE, SIDE),
                       all = camera_from(0.3, 3, 1);
    const ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_settings s = small_settings();
    s.shadow.layers = s.scattering.layers = 0;
    s.depth_cue = 0;
    for (int c = 0; c < 3; c++) s.medium.scattering[c] = 20, s.medium.absorption[c] = (ssdgs_real)0.1;
    ssdgs_settings bare = s;
    bare.terms &= ~SSDGS_SCATTERING_TERM;
    ssdgs_model *models[5] = {cloud(&s, 0, 60, 0.3), cloud(&s, 400, 10, 0.3), cloud(&s, 800, 150, 0.5),
                              cloud(&s, 600, 64, 0.3), cloud(&bare, 400, 10, 0.3)};
    ssdgs_light light = point_light(0, -1.5, 1.5);
    light.range = 4;
    ssdgs_object objects[3];
    for (int i = 0; i < 3; i++) objects[i] = ssdgs_object_default(models[i]);
    objects[0].to_world[3] = (ssdgs_real)-1.5;
    objects[1].to_world[3] = 8;
    for (int other = 3; other < 5; other++) {
        objects[1].model = models[1];
        together(objects, 3, &apart, &light, 1, &options, shot);
        objects[1].model = models[other];
        CHECK(as_new(objects, 3, &all, &light, &options) && shot->stats.lights_cached == 1);
    }
    for (int i = 0; i < 5; i++) ssdgs_model_destroy(models[i]);
}

/* Scattering asks lights for the depth of what they light, also where it is dark; other terms do not. Which
   was asked for first changes nothing. */
static void test_asked_before(void) {
    const ssdgs_camera camera = camera_from(0.3, -3, -1);
    ssdgs_settings s = small_settings();
    s.light_map.size = 64;
    s.light_map.bias = (ssdgs_real)0.001;
    ssdgs_model *model = NULL;
    CHECK(!ssdgs_model_create(context, &s, 200, &model));
    stir_networks(model, 0);
    for (int i = 0; i < 200; i++) { /* a disk, and small ones in its shadow */
        ssdgs_gaussian g = ssdgs_gaussian_default();
        for (int c = 0; c < 3; c++) {
            const double at = 2 * draw(3 * (uint64_t)i + (uint64_t)c) - 1;
            g.position[c] = (ssdgs_real)(i ? (c < 2 ? 0.4 : 0.5) * at : c < 2 ? 0 : 0.6);
            g.scale[c] = (ssdgs_real)(i ? 0.03 : c < 2 ? 1 : 0.01);
            g.diffuse[c] = (ssdgs_real)0.8;
        }
        g.opacity = (ssdgs_real)(i ? 0.95 : 0.97);
        g.normal[0] = (ssdgs_real)0.3, g.normal[2] = 1;
        g.softness = 1;
        CHECK(!ssdgs_model_set(model, i, &g));
    }
    const ssdgs_object object = ssdgs_object_default(model);
    ssdgs_light light = parallel_light(0, 0, 1);
    for (int c = 0; c < 3; c++) light.intensity[c] = 1000;
    ssdgs_render_options options[2] = {ssdgs_render_options_default(), ssdgs_render_options_default()};
    options[0].stop = options[1].stop = (ssdgs_real)0.1;
    options[1].terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    together(&object, 1, &camera, &light, 1, options, shot);
    for (int i = 1; i < 4; i++) CHECK(as_new(&object, 1, &camera, &light, options + i % 2));
    ssdgs_model_destroy(model);
}

/* image.shadow does not depend on the objects' order: baked ones, which have none, are first or last. */
static void test_shadow_order(void) {
    const ssdgs_camera camera = camera_from(0, -3, 0.3);
    const ssdgs_light light = point_light(-1, -2, 3);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_settings s = small_settings();
    s.shadow.layers = 0;
    ssdgs_model *deferred = cloud(&s, 0, 64, 0.2);
    s.asg = SSDGS_ASG_GEOMETRIC;
    ssdgs_model *geometric = cloud(&s, 400, 100, 0.4);
    s.baked = 1;
    ssdgs_model *baked = cloud(&s, 800, 10, 0.05);
    double dark[2] = {0, 0};
    for (int way = 0; way < 2; way++) {
        ssdgs_object objects[3];
        objects[way ? 0 : 2] = ssdgs_object_default(baked);
        objects[way ? 1 : 0] = ssdgs_object_default(geometric);
        objects[way ? 2 : 1] = ssdgs_object_default(deferred);
        for (int i = 0; i < 3; i++)
            objects[i].to_world[3] = (ssdgs_real)(objects[i].model == geometric ? -0.5 : 0.7);
        objects[way ? 0 : 2].to_world[11] = (ssdgs_real)0.3;
        together(objects, 3, &camera, &light, 1, &options, shot + way);
        for (int i = 0; i < PIXELS; i++)
            dark[way] += (double)(shot[way].value[15 * PIXELS + i] - shot[way].value[17 * PIXELS + i]);
    }
    CHECK(dark[0] > 50 && fabs(dark[1] - dark[0]) < 1e-3 * dark[0]);
    ssdgs_model_destroy(deferred), ssdgs_model_destroy(geometric), ssdgs_model_destroy(baked);
}

/* A dark light keeps its map, and lights that come and go cost the others nothing. */
static void test_flicker(void) {
    static const struct {
        int lights, dark, inside, kept; /* dark: a mask; inside: where the first one is; kept: how many */
    } frames[] = {{2, 0, 0, 0}, {2, 1, 0, 2}, {2, 0, 0, 2}, {2, 1, 0, 2}, {2, 1, 1, 0}, {2, 0, 1, 1},
                  {2, 0, 1, 2}, {3, 0, 1, 2}, {2, 0, 1, 2}, {3, 2, 1, 2}, {3, 0, 1, 3}, {1, 0, 1, 1},
                  {2, 0, 1, 1}, {2, 3, 1, 2}, {2, 3, 0, 0}, {2, 2, 0, 1}, {2, 0, 0, 1}, {2, 0, 0, 2}};
    ssdgs_settings s = small_settings();
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    const ssdgs_object object = ssdgs_object_default(model);
    for (size_t f = 0; f < sizeof frames / sizeof *frames; f++) {
        ssdgs_light lights[3] = {point_light(2, -2, 2), point_light(-2, -1, 1), point_light(0, 2, 2)};
        if (frames[f].inside) lights[0] = point_light(0.05, 0, 0.1);
        for (int i = 0; i < 3; i++)
            if (frames[f].dark >> i & 1) memset(lights[i].intensity, 0, sizeof lights[i].intensity);
        together(&object, 1, &camera, lights, frames[f].lights, NULL, shot);
        if (!CHECK(shot->stats.lights_cached == frames[f].kept && shot->stats.camera_cached == (f > 0)))
            printf("    frame %d: %d\n", (int)f, shot->stats.lights_cached);
        ssdgs_scene *other = NULL;
        const ssdgs_image image = planes_of(shot + 1);
        CHECK(!ssdgs_scene_create(context, &other));
        CHECK(!ssdgs_scene_render(other, &object, 1, &camera, lights, frames[f].lights, NULL, &image,
                                  &shot[1].stats));
        CHECK(same(shot, shot + 1) && shot->stats.light_views == shot[1].stats.light_views);
        ssdgs_scene_destroy(other);
    }
    const ssdgs_light dark = point_light(2, -2, 2);
    ssdgs_real behind[3] = {-2, 2, -2}, fraction = -1;
    for (int shines = 1; shines >= 0; shines--) { /* who asks for the shadow of a dark light hears of none */
        ssdgs_light light = dark;
        if (!shines) memset(light.intensity, 0, sizeof light.intensity);
        CHECK(!ssdgs_scene_light(scene, &object, 1, NULL, &light, 1, NULL));
        CHECK(!ssdgs_scene_shadow(scene, 0, behind, 1, &fraction) && (fraction < 1) == shines);
    }
    ssdgs_model_destroy(model);
}

static test_meter memory;

/* Any number of threads; nothing allocated from the second frame on, once it has been where things move to; a
   model that stands in many places is there once. */
static void test_threads_and_memory(void) {
    ssdgs_settings s = small_settings();
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_context *was = context;
    ssdgs_scene *was_scene = scene;
    for (int threads = 1; threads <= 5; threads += 4) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = threads;
        TEST_METER(desc, &memory);
        CHECK(!ssdgs_context_create(&desc, &context) && !ssdgs_scene_create(context, &scene));
        ssdgs_model *model[2] = {cloud(&s, 0, 1500, 0.3), cloud(&s, 200, 100, 0.3)};
        const size_t models = memory.live;
        ssdgs_object object[6];
        for (int i = 0; i < 6; i++)
            object[i] = placed(model[i % 2], i, 0.3 + 0.1 * i, i & 1, 0.2 * i - 0.5, 0.1 * i, 0);
        together(object, 6, &camera, &light, 1, NULL, shot + threads / 5);
        const size_t after = memory.live;
        for (int i = 0; i < 6; i++) object[i].tint[0] = (ssdgs_real)0.5;
        together(object, 6, &camera, &light, 1, NULL, shot + 2);
        CHECK(memory.live == after && memory.peak == after && models > 0);
        long before = 0;
        for (int frame = 0; frame < 8; frame++) { /* all move to and fro between two places */
            const ssdgs_camera from = frame & 1 ? camera_from(-1.3, -1.6, 0.3) : camera;
            const ssdgs_light by = frame & 1 ? point_light(-1.5, -2, 1) : light;
            if (frame == 2) before = memory.calls;
            object[0] = placed(model[0], frame & 1, 0.5, 0, 0.3 * (frame & 1), 0, 0);
            together(object, 6, &from, &by, 1, NULL, shot + 2);
            CHECK(!shot[2].stats.camera_cached && !shot[2].stats.lights_cached);
        }
        if (!CHECK(memory.calls == before)) printf("    %ld allocations\n", memory.calls - before);
        ssdgs_scene_destroy(scene);
        ssdgs_model_destroy(model[0]), ssdgs_model_destroy(model[1]);
        ssdgs_context_destroy(context);
        CHECK(memory.live == 0);
        memory.peak = 0;
    }
    CHECK(same(shot, shot + 1));
    context = was, scene = was_scene;
}

/* Any one allocation fails. ssdgs_scene_light() then leaves no light's map, not that of the frame before
   either. After it, and after a picture that failed, the next call makes them as a new scene does. */
static void test_failed_frame(void) {
    enum { LIGHTS = 8, OBJECTS = 40 };
    ssdgs_settings s = small_settings();
    ssdgs_object object[OBJECTS];
    ssdgs_context *was = context;
    ssdgs_light lights[LIGHTS];
    int failed = 0, wrong = 0;
    for (int k = 0; k < 336; k++) {
        const int many = k / 2 % 2 ? OBJECTS : 1; /* objects of the second frame */
        const ssdgs_camera camera = camera_from(0, -3, 1);
        const ssdgs_image image = planes_of(shot);
        const ssdgs_real point[3] = {0, 0, -1};
        ssdgs_scene *scenes[2] = {NULL, NULL};
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = 1;
        TEST_METER(desc, &memory);
        CHECK(!ssdgs_context_create(&desc, &context));
        for (int i = 0; i < 2; i++) CHECK(!ssdgs_scene_create(context, scenes + i));
        ssdgs_model *plate = plate_of(&s, 0.3, 0.8), *less = NULL;
        CHECK(!ssdgs_model_create(context, &s, 0, &less));
        ssdgs_model *const levels[1] = {less};
        for (int i = 0; i < OBJECTS; i++) {
            object[i] = ssdgs_object_default(plate);
            object[i].levels = levels;
            object[i].level_count = 1;
            object[i].to_world[3] = (ssdgs_real)(5 * i);
        }
        for (int i = 0; i < LIGHTS; i++) lights[i] = point_light(0.1 * i, 0, 3);
        CHECK(!ssdgs_scene_light(*scenes, object, 1, NULL, lights, k % 2 ? LIGHTS : 1, NULL));
        lights[0] = point_light(3, 0, 0.2); /* past the plate's edge */
        memory.fail_at = memory.calls + 1 + k / 8;
        const ssdgs_result result =
            k / 4 % 2
                ? ssdgs_scene_light(*scenes, object, many, NULL, lights, LIGHTS, NULL)
                : ssdgs_scene_render(*scenes, object, many, &camera, lights, LIGHTS, NULL, &image, NULL);
        memory.fail_at = 0;
        ssdgs_real fraction[2];
        failed += result == SSDGS_ERR_MEMORY;
        for (int i = 0; i < LIGHTS && result && k / 4 % 2; i++)
            wrong += ssdgs_scene_shadow(*scenes, i, point, 1, fraction) != SSDGS_ERR_ARGUMENT;
        for (int i = 0; i < 2; i++)
            CHECK(!ssdgs_scene_light(scenes[i], object, many, NULL, lights, LIGHTS, NULL));
        for (int i = 0; i < LIGHTS; i++) {
            for (int j = 0; j < 2; j++) CHECK(!ssdgs_scene_shadow(scenes[j], i, point, 1, fraction + j));
            wrong += memcmp(fraction, fraction + 1, sizeof *fraction) != 0;
        }
        for (int i = 0; i < 2; i++) ssdgs_scene_destroy(scenes[i]);
        ssdgs_model_destroy(plate), ssdgs_model_destroy(less);
        ssdgs_context_destroy(context);
    }
    if (!CHECK(memory.live == 0 && failed > 4 && !wrong)) printf("    %d failed, %d wrong\n", failed, wrong);
    context = was;
}

/* What a splat's blur, or its size, spreads into the picture from beside it is drawn, whether one object is
   there or two. */
static void test_blurred(void) {
    ssdgs_settings s = small_settings();
    s.pixel_variance = 10;
    const ssdgs_camera camera = camera_from(0, -3, 0);
    ssdgs_model *model = NULL;
    ssdgs_gaussian g = ssdgs_gaussian_default();
    CHECK(!ssdgs_model_create(context, &s, 1, &model));
    for (int c = 0; c < 3; c++) g.scale[c] = (ssdgs_real)1e-4;
    g.opacity = (ssdgs_real)0.999;
    CHECK(!ssdgs_model_set(model, 0, &g));
    ssdgs_render_options options = ssdgs_render_options_exact();
    double drawn[2] = {0, 0};
    for (int i = 0; i < 76; i++) { /* on the left, on the right */
        const double beside = i < 60 ? 3 + (i / 2 < 10 ? i / 2 : i - i % 2 - 10) : i - 40,
                     at = (beside + SIDE / 2) * 3 / (double)camera.fx;
        for (int c = 0; c < 3 && i == 60; c++) g.scale[c] = (ssdgs_real)0.4;
        if (i == 60) CHECK(!ssdgs_model_set(model, 0, &g));
        ssdgs_object object[2] = {ssdgs_object_default(model), ssdgs_object_default(model)};
        options.alpha_threshold = (ssdgs_real)(i < 20 ? 1.0 / 255 : 0);
        object[0].to_world[3] = (ssdgs_real)(i % 2 ? at : -at);
        object[1].to_world[3] = 1000;
        for (int j = 0; j < 2; j++) together(object, 1 + j, &camera, NULL, 0, &options, shot + j);
        CHECK(same(shot, shot + 1));
        for (int p = 0; p < PIXELS; p++) drawn[i / 60] += (double)shot->value[15 * PIXELS + p];
    }
    CHECK(drawn[0] > 0.5 && drawn[1] > 100);
    ssdgs_model_destroy(model);
}

/* Memory that is given back is taken anew, with the same picture. */
static void test_trim(void) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    TEST_METER(desc, &memory);
    ssdgs_settings s = small_settings();
    ssdgs_context *was = context;
    CHECK(!ssdgs_context_create(&desc, &context));
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    const size_t before = memory.live;
    alone(model, &camera, &light, 1, NULL, shot);
    const size_t grown = memory.live;
    ssdgs_context_trim(context);
    const size_t kept = memory.live; /* what the model keeps */
    CHECK(kept > before && kept < grown);
    alone(model, &camera, &light, 1, NULL, shot + 1);
    CHECK(same(shot, shot + 1) && shot[1].stats.camera_cached && memory.live > kept && memory.live <= grown);
    ssdgs_model_destroy(model);
    ssdgs_context_trim(context);
    CHECK(memory.live < before);
    ssdgs_context_trim(NULL);
    ssdgs_context_destroy(context);
    CHECK(memory.live == 0);
    context = was;
}

/* A model made on one context draws on another, which it then belongs to. */
static void test_moved_over(void) {
    ssdgs_settings s = small_settings();
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_context *was = context, *loader = NULL, *counted = NULL;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    TEST_METER(desc, &memory);
    CHECK(!ssdgs_context_create(NULL, &loader) && !ssdgs_context_create(&desc, &counted));
    context = loader;
    ssdgs_model *model = cloud(&s, 0, 300, 0.5);
    alone(model, &camera, &light, 1, NULL, shot);
    context = was;
    const ssdgs_object object = ssdgs_object_default(model);
    refused(&object, 1, "of another context");
    CHECK(ssdgs_model_move(model, counted) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(loader), "allocators differ") != NULL);
    CHECK(!ssdgs_model_move(model, loader) && !ssdgs_model_move(model, context));
    ssdgs_context_destroy(loader); /* nothing of it is left */
    together(&object, 1, &camera, &light, 1, NULL, shot + 1);
    CHECK(same(shot, shot + 1));
    ssdgs_model_arrays(model).gaussians[0] += 1; /* the new context's frames know of changes */
    together(&object, 1, &camera, &light, 1, NULL, shot + 1);
    CHECK(!same(shot, shot + 1) && !shot[1].stats.camera_cached);
    /* of two that were the first of their contexts a frame tells which it has seen */
    ssdgs_context *one = NULL, *two = NULL;
    ssdgs_scene *kept = NULL;
    CHECK(!ssdgs_context_create(NULL, &one) && !ssdgs_context_create(NULL, &two));
    CHECK(!ssdgs_scene_create(two, &kept));
    context = one;
    ssdgs_model *comes = cloud(&s, 0, 300, 0.5);
    context = two;
    ssdgs_model *there = cloud(&s, 300, 300, 0.5);
    const ssdgs_object turn[2] = {ssdgs_object_default(there), ssdgs_object_default(comes)};
    const ssdgs_image image = planes_of(shot + 1);
    CHECK(!ssdgs_model_move(comes, two));
    for (int i = 0; i < 2; i++)
        CHECK(!ssdgs_scene_render(kept, turn + i, 1, &camera, &light, 1, NULL, &image, &shot[1].stats));
    CHECK(!shot[1].stats.camera_cached && !shot[1].stats.lights_cached);
    ssdgs_scene_destroy(kept);
    ssdgs_model_destroy(comes), ssdgs_model_destroy(there);
    /* nor is what was found in one context of a model that has changed since taken for true in the other */
    ssdgs_render_options options = ssdgs_render_options_default();
    for (int c = 0; c < 3; c++) options.ambient[0][c] = (ssdgs_real)0.5;
    context = one;
    comes = cloud(&s, 0, 300, 0.5);
    alone(comes, &camera, &light, 1, &options, shot);
    ssdgs_model_arrays(comes).gaussians[0] += 1;
    two->revisions = comes->sky_share_revision - 1;
    CHECK(!ssdgs_model_move(comes, two));
    alone(comes, &camera, &light, 1, &options, shot);
    ssdgs_model_arrays(comes);
    alone(comes, &camera, &light, 1, &options, shot + 1);
    CHECK(same(shot, shot + 1));
    /* nor its box, by which what is out of sight is left out */
    CHECK(!ssdgs_scene_create(one, &kept) && !ssdgs_model_move(comes, one));
    ssdgs_object pair[2] = {ssdgs_object_default(comes), ssdgs_object_default(comes)};
    pair[1].to_world[11] = 100;
    CHECK(!ssdgs_scene_render(kept, pair, 2, &camera, &light, 1, NULL, &image, NULL));
    ssdgs_scene_destroy(kept);
    for (size_t i = 0; i < 300; i++) ssdgs_model_arrays(comes).gaussians[2 * comes->capacity + i] += 1000;
    two->revisions = comes->box_revision - 1;
    pair[0].to_world[11] = -1000;
    CHECK(!ssdgs_model_move(comes, two) && !ssdgs_scene_create(two, &kept));
    CHECK(!ssdgs_scene_render(kept, pair, 2, &camera, &light, 1, NULL, &image, &shot[1].stats));
    CHECK(shot[1].stats.objects == 1);
    ssdgs_scene_destroy(kept);
    ssdgs_model_destroy(comes);
    ssdgs_context_destroy(one), ssdgs_context_destroy(two);
    context = was;
    CHECK(ssdgs_model_move(NULL, context) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_model_move(model, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "ssdgs_model_move: to is NULL") != NULL);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(counted);
    CHECK(memory.live == 0);
}

/* A job system is given few tasks, and the picture of any other number of them. */
static int job_calls, job_tasks, job_most;
static void jobs(void *user, int count, void (*task)(void *data, int index), void *data) {
    (void)user;
    job_calls++;
    job_tasks += count;
    job_most = count > job_most ? count : job_most;
    for (int i = count; i-- > 0;) task(data, i);
}
static void test_jobs(void) {
    ssdgs_settings s = small_settings();
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_context *was = context;
    for (int threads = 0; threads <= 16; threads += 16) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.parallel.run = jobs;
        desc.threads = threads;
        job_calls = job_tasks = job_most = 0;
        CHECK(!ssdgs_context_create(&desc, &context));
        ssdgs_model *model = cloud(&s, 0, 3000, 0.5);
        alone(model, &camera, &light, 1, NULL, shot + (threads > 0));
        CHECK(job_most == 3 * (threads ? threads : 4) && job_calls > 10);
        if (!threads) CHECK(job_tasks < 250);
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
    context = was;
    ssdgs_model *model = cloud(&s, 0, 3000, 0.5);
    alone(model, &camera, &light, 1, NULL, shot + 2);
    CHECK(same(shot, shot + 1) && same(shot, shot + 2));
    ssdgs_model_destroy(model);
}

/* ---- extremes ---- */

static int finite_picture(const picture *p) {
    int ok = 1;
    for (int i = 0; i < VALUES; i++) ok &= test_finite((double)p->value[i]);
    return ok;
}

static void test_refused(void) {
    ssdgs_settings s = small_settings();
    ssdgs_model *model = cloud(&s, 0, 10, 0.3);
    s.transfer = SSDGS_TRANSFER_NONE;
    ssdgs_model *stored = cloud(&s, 0, 10, 0.3), *foreign = NULL;
    ssdgs_context *other = NULL;
    CHECK(!ssdgs_context_create(NULL, &other) && !ssdgs_model_create(other, NULL, 1, &foreign));
    const ssdgs_object good = ssdgs_object_default(model);
    ssdgs_object object[2] = {good, good};
    refused(NULL, 1, "1 objects, but the array is NULL");
    refused(object, -1, "-1 objects");
    object[1].model = NULL, refused(object, 2, "object 1: its model is NULL");
    object[1].model = foreign, refused(object, 2, "object 1: its model is of another context");
    object[1].model = stored, refused(object, 2, "object 1: its settings.transfer");
    object[1] = good, object[1].to_world[3] = (ssdgs_real)NAN;
    refused(object, 2, "object 1: to_world[3] is not finite");
    object[1] = good, memset(object[1].to_world, 0, sizeof good.to_world);
    refused(object, 2, "object 1: to_world's scale is 0");
    object[1] = good;
    for (int j = 0; j < 3; j++) object[1].to_world[5 * j] = (ssdgs_real)1e13;
    refused(object, 2, "object 1: to_world's scale is ");
    object[1] = good, object[1].to_world[0] = (ssdgs_real)1.01;
    refused(object, 2, "object 1: to_world is not a rotation times one scale");
    object[1] = good, object[1].to_world[1] = (ssdgs_real)0.01;
    refused(object, 2, "object 1: to_world is not a rotation times one scale");
    object[1] = good, object[1].tint[2] = -1, refused(object, 2, "object 1: tint[2] = -1");
    object[1] = good, object[1].tint[0] = (ssdgs_real)INFINITY;
    refused(object, 2, "object 1: tint[0] = inf");
    object[1] = good;
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_image image = planes_of(shot);
    CHECK(ssdgs_scene_render(NULL, object, 2, &camera, NULL, 0, NULL, &image, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_scene_render(scene, object, 2, NULL, NULL, 0, NULL, &image, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_scene_render(scene, object, 2, &camera, NULL, 0, NULL, NULL, NULL) == SSDGS_ERR_ARGUMENT);
    ssdgs_scene_destroy(scene);
    CHECK(ssdgs_scene_create(NULL, &scene) == SSDGS_ERR_ARGUMENT && !scene);
    CHECK(ssdgs_scene_create(context, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(!ssdgs_scene_create(context, &scene));
    ssdgs_scene_destroy(NULL);
    ssdgs_model_arrays(stored).shadow[0] = (ssdgs_real)NAN;
    object[0] = ssdgs_object_default(stored);
    refused(object, 1, "the shadow network is not finite");
    ssdgs_model_destroy(model), ssdgs_model_destroy(stored), ssdgs_model_destroy(foreign);
    ssdgs_context_destroy(other);
}

static void test_extremes(void) {
    ssdgs_settings s = small_settings();
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    static ssdgs_light lights[1000];
    ssdgs_model *model = cloud(&s, 0, 100, 0.3), *empty = NULL;
    CHECK(!ssdgs_model_create(context, &s, 0, &empty));
    for (int i = 0; i < 1000; i++)
        lights[i] = point_light(2 * cos(0.1 * i), 2 * sin(0.1 * i), 1 + 0.02 * (i % 60));
    ssdgs_object object[3] = {ssdgs_object_default(model), ssdgs_object_default(empty),
                              ssdgs_object_default(model)};
    together(object, 1, &camera, lights, 1, NULL, shot);
    together(object, 2, &camera, lights, 1, NULL, shot + 1);
    CHECK(same(shot, shot + 1)); /* nobody misses an empty one */
    together(object + 1, 1, &camera, lights, 1, NULL, shot + 1);
    CHECK(finite_picture(shot + 1) && shot[1].value[15 * PIXELS] == 0);
    object[1] = object[2];
    for (int i = 0; i < 5; i++) { /* behind the camera, far away, tiny, huge, at the same place */
        static const double scale[5] = {1, 1, 1e-9, 1e9, 1}, away[5] = {9, 1e6, 0, 0, 0};
        object[1] = placed(model, 0.3, scale[i], 0, 0.4 * away[i], -2.2 * away[i], 0.8 * away[i]);
        together(object, 2, &camera, lights, 2, NULL, shot + 1);
        CHECK(finite_picture(shot + 1) && (i == 3 || shot[1].stats.visible >= shot->stats.visible));
        if (i == 0) CHECK(shot[1].stats.visible == shot->stats.visible);
    }
    /* a tiny one close by, beside which the others are far: cameras that name no near plane serve the least
     */
    object[0] = placed(model, 0.3, 1e-3, 0, 0, 0, 0);
    object[1] = placed(model, 0.3, 1, 0, 0, 9, 0);
    const ssdgs_camera close = camera_from(4e-4, -2.2e-3, 8e-4);
    together(object, 2, &close, lights, 1, NULL, shot + 1);
    CHECK(shot[1].value[15 * PIXELS + PIXELS / 2 + SIDE / 2] > (ssdgs_real)0.1);
    object[0] = ssdgs_object_default(model);
    object[1] = placed(model, 0.3, 0.5, 0, 0.3, 0, 0);
    for (int count = 0; count <= 1000; count = count ? 50 * count : 20) {
        together(object, 2, &camera, lights, count, NULL, shot + 1);
        CHECK(finite_picture(shot + 1) && (shot[1].value[3 * (PIXELS + SIDE) / 2] > 0) == (count > 0));
    }
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t i = 0; i < 10; i++) v.gaussians[i % 3 * v.stride + i] = (ssdgs_real)NAN;
    together(object, 2, &camera, lights, 2, NULL, shot + 1);
    CHECK(finite_picture(shot + 1) && shot[1].stats.rejected == 20);
    ssdgs_model_destroy(model), ssdgs_model_destroy(empty);
}

int main(void) {
    if (!CHECK(!ssdgs_context_create(NULL, &context)) || !CHECK(!ssdgs_scene_create(context, &scene)))
        return 1;
    test_identity();
    test_moved();
    test_tint();
    test_parts();
    test_transport();
    test_skipped();
    test_merged();
    test_materials();
    test_order();
    test_shadows();
    test_baked();
    test_scene_depth();
    test_dark();
    test_presence();
    TEST_ROW("97", "levels of detail", test_levels());
    test_query();
    test_occluder();
    test_shadow_maps();
    test_shadow_map_frames();
    test_ahead();
    test_spot();
    test_bounds();
    test_look_at();
    test_light_kinds();
    test_empty_tiles();
    test_shader_maps();
    test_matrices();
    test_left_handed();
    test_missed();
    test_anything();
    test_kept();
    test_moved_trees();
    test_asked_before();
    test_shadow_order();
    test_flicker();
    TEST_ROW("94", "objects out of sight", test_out_of_sight());
    TEST_ROW("95", "lights that reach some", test_local_lights());
    test_threads_and_memory();
    test_trim();
    test_failed_frame();
    test_blurred();
    test_moved_over();
    test_jobs();
    test_refused();
    TEST_ROW("87", "scenes: tiny, huge, far away, at one place, under 1,000 lights", test_extremes());
    ssdgs_scene_destroy(scene);
    ssdgs_context_destroy(context);
    TEST_END();
}
