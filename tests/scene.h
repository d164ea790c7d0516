/* Clouds of Gaussians, cameras, lights and pictures, for the tests of scenes, lights and materials. */
#ifndef SSDGS_TEST_SCENE_H
#define SSDGS_TEST_SCENE_H
#include "test.h"

enum { SIDE = 64, PIXELS = SIDE * SIDE, PLANES = 18, VALUES = PLANES * PIXELS };
static const int real64 = sizeof(ssdgs_real) == 8;
static const double pi = 3.14159265358979323846;
static ssdgs_context *context;
static ssdgs_scene *scene;

/* A picture's planes: color, diffuse, specular, scattering, normal (3 each), alpha, depth, shadow. */
typedef struct picture {
    ssdgs_real value[VALUES];
    ssdgs_render_stats stats;
} picture;
static picture shot[4];

static inline double draw(uint64_t counter) { return test_uniform(34, counter); }

/* One of many directions, spread evenly. */
static inline void direction_of(int i, int many, double d[3]) {
    const double z = 1 - 2 * (i + 0.5) / many, across = sqrt(1 - z * z), turn = pi * (3 - sqrt(5.0)) * i;
    d[0] = across * cos(turn);
    d[1] = across * sin(turn);
    d[2] = z;
}

static inline ssdgs_image planes_of(picture *p) {
    ssdgs_image image = {0,
                         p->value,
                         p->value + 15 * PIXELS,
                         p->value + 16 * PIXELS,
                         p->value + 12 * PIXELS,
                         p->value + 3 * PIXELS,
                         p->value + 6 * PIXELS,
                         p->value + 9 * PIXELS,
                         p->value + 17 * PIXELS,
                         NULL,
                         NULL};
    return image;
}

/* Networks that have something to say, none of them small. */
static inline void stir_networks(ssdgs_model *model, uint64_t seed) {
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t i = 0; i < v.shadow_count; i++)
        v.shadow[i] += (ssdgs_real)(0.3 * draw(seed + 2000000 + i) - 0.15);
    for (size_t i = 0; i < v.scattering_count; i++)
        v.scattering[i] += (ssdgs_real)(0.3 * draw(seed + 4000000 + i) - 0.15);
}

/* Gaussians from `first` on of an endless cloud in a ball of this radius. */
static inline ssdgs_model *cloud(const ssdgs_settings *settings, int first, int count, double radius) {
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, settings, count, &model))) exit(1);
    for (int i = 0; i < count; i++) {
        const uint64_t at = 64 * (uint64_t)(first + i);
        ssdgs_gaussian g = ssdgs_gaussian_default();
        for (uint64_t c = 0; c < 4; c++) g.rotation[c] = (ssdgs_real)(2 * draw(at + c) - 1);
        for (uint64_t c = 0; c < 3; c++) {
            g.position[c] = (ssdgs_real)(radius * (2 * draw(at + 8 + c) - 1));
            g.scale[c] = (ssdgs_real)(radius * (0.05 + 0.1 * draw(at + 16 + c)));
            g.normal[c] = (ssdgs_real)(2 * draw(at + 24 + c) - 1);
            g.diffuse[c] = (ssdgs_real)draw(at + 32 + c);
            g.specular[c] = (ssdgs_real)draw(at + 40 + c);
            g.scattering[c] = (ssdgs_real)draw(at + 48 + c);
            g.material[c] = (ssdgs_real)draw(at + 56 + c);
        }
        g.opacity = (ssdgs_real)(0.2 + 0.6 * draw(at + 60));
        g.sharpness[0] = (ssdgs_real)(2 + 6 * draw(at + 61));
        g.sharpness[1] = (ssdgs_real)(2 + 6 * draw(at + 4));
        g.f0 = (ssdgs_real)(0.02 + 0.1 * draw(at + 62));
        g.softness = (ssdgs_real)draw(at + 63);
        CHECK(!ssdgs_model_set(model, i, &g));
    }
    stir_networks(model, 0);
    return model;
}

static inline ssdgs_settings small_settings(void) {
    ssdgs_settings s = ssdgs_settings_default();
    s.scattering.width = s.shadow.width = 16;
    s.light_map.size = 96;
    s.light_map.bias = (ssdgs_real)0.05;
    s.depth_cue = 1;
    return s;
}

static inline ssdgs_camera camera_from(double x, double y, double z) {
    const ssdgs_real eye[3] = {(ssdgs_real)x, (ssdgs_real)y, (ssdgs_real)z}, target[3] = {0, 0, 0},
                     up[3] = {0, 0, 1};
    return ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.7, SIDE, SIDE);
}

static inline ssdgs_light point_light(double x, double y, double z) {
    const double position[3] = {x, y, z};
    ssdgs_light light;
    memset(&light, 0, sizeof light);
    for (int c = 0; c < 3; c++) {
        light.position[c] = (ssdgs_real)position[c];
        light.intensity[c] = (ssdgs_real)(9 - c);
    }
    return light;
}

/* From so far away in that direction. */
static inline ssdgs_light parallel_light(double x, double y, double z) {
    ssdgs_light light = point_light(x, y, z);
    TEST_PARALLEL(light);
    for (int c = 0; c < 3; c++) light.intensity[c] = (ssdgs_real)(1 + c % 2);
    return light;
}

static inline void alone(ssdgs_model *model, const ssdgs_camera *camera, const ssdgs_light *lights, int count,
                         const ssdgs_render_options *options, picture *p) {
    const ssdgs_image image = planes_of(p);
    CHECK(!ssdgs_render_ex(model, camera, lights, count, options, &image, &p->stats));
}

static inline void together(const ssdgs_object *objects, int count, const ssdgs_camera *camera,
                            const ssdgs_light *lights, int light_count, const ssdgs_render_options *options,
                            picture *p) {
    const ssdgs_image image = planes_of(p);
    if (!CHECK(!ssdgs_scene_render(scene, objects, count, camera, lights, light_count, options, &image,
                                   &p->stats)))
        printf("    %s\n", ssdgs_error_message(context));
}

static inline int same(const picture *a, const picture *b) {
    return !memcmp(a->value, b->value, sizeof a->value);
}

/* A third of a turn about (1 1 1) and some more about z, times scale; mirrored in x first. */
static inline ssdgs_object placed(ssdgs_model *model, double turn, double scale, int mirror, double x,
                                  double y, double z) {
    ssdgs_object o = ssdgs_object_default(model);
    const double c = cos(turn), s = sin(turn), r[9] = {0, -s, c, 0, c, s, -1, 0, 0}, at[3] = {x, y, z};
    for (int i = 0; i < 9; i++)
        o.to_world[i / 3 * 4 + i % 3] = (ssdgs_real)(scale * (mirror && i % 3 == 0 ? -r[i] : r[i]));
    for (int i = 0; i < 3; i++) o.to_world[4 * i + 3] = (ssdgs_real)at[i];
    return o;
}

static inline void to_world(const ssdgs_object *o, const ssdgs_real from[3], int direction,
                            ssdgs_real to[3]) {
    for (int i = 0; i < 3; i++) {
        const ssdgs_real *row = o->to_world + 4 * i;
        to[i] = row[0] * from[0] + row[1] * from[1] + row[2] * from[2] + (direction ? 0 : row[3]);
    }
}

#endif
