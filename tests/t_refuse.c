/* What makes no sense is refused and named: every setting and option just outside of its range, and NaN;
   every argument that is missing. The ends of the ranges are taken. The presets are what comments say. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

typedef struct field {
    const char *name;
    size_t at;
    int real;
    double low, high;
} field;
#define WHOLE(type, name, low, high) \
    { #name, offsetof(type, name), 0, low, high }
#define REAL(type, name, low, high) \
    { #name, offsetof(type, name), 1, low, high }

static const field settings_fields[] = {
#define I(name, low, high) WHOLE(ssdgs_settings, name, low, high)
#define R(name, low, high) REAL(ssdgs_settings, name, low, high)
    I(terms, 0, 15),
    I(baked, 0, 1),
    I(harmonics, 0, 0),
    R(kept, 0, 1),
    I(transfer, 0, 1),
    I(dipole, 0, 1),
    I(asg, 0, 2),
    I(per_channel_optics, 0, 1),
    I(depth_cue, 0, 1),
    I(transport, 0, 1),
    I(residual_shadow, 0, 1),
    I(shadow_on_scattering, 0, 1),
    I(scattering.layers, 2, 16),
    I(scattering.width, 1, 1024),
    I(octaves.view, 0, 8),
    I(octaves.light, 0, 8),
    I(shadow.layers, 0, 16),
    I(shadow.width, 1, 1024),
    I(light_map.blur, 0, 1),
    I(light_map.size, 0, 8192),
    R(light_map.bias, 0, 1e30),
    R(pixel_variance, 0.01, 10),
    R(eta, 1, 2.5),
    R(length_unit, 1e-15, 1e15),
    R(light_scale, 0, 1e30),
    R(ambient[0], 0, 1e30),
    R(ambient[1], 0, 1e30),
    R(ambient[2], 0, 1e30),
    R(centre[0], -1e30, 1e30),
    R(centre[1], -1e30, 1e30),
    R(centre[2], -1e30, 1e30),
    R(origin[0], -1e9, 1e9),
    R(origin[1], -1e9, 1e9),
    R(origin[2], -1e9, 1e9),
    R(placement.turn[0], -7, 7),
    R(placement.turn[1], -7, 7),
    R(placement.turn[2], -7, 7),
    R(placement.move[0], -1e9, 1e9),
    R(placement.move[1], -1e9, 1e9),
    R(placement.move[2], -1e9, 1e9),
    R(placement.scale, -1e9, 1e9)
#undef I
#undef R
};
static const field medium_fields[] = {/* of settings, where no network scatters light */
#define R(name, low) REAL(ssdgs_settings, medium.name, low, 1e12)
                                      R(scattering[0], 1e-12),
                                      R(scattering[1], 1e-12),
                                      R(scattering[2], 1e-12),
                                      R(absorption[0], 0),
                                      R(absorption[1], 0),
                                      R(absorption[2], 0)
#undef R
};
static const field render_fields[] = {
#define R(name, low, high) REAL(ssdgs_render_options, name, low, high)
    R(stop, 0, 1),
    R(alpha_threshold, 0, 1),
    R(max_error, 0, 1),
    R(light_detail, 0.01, 8),
    R(transport_detail, 0.1, 8),
    R(level_detail, 0, 8),
#undef R
#define I(name, low, high) WHOLE(ssdgs_render_options, name, low, high)
    I(terms, 0, 15),
    I(antialias, 0, 1)
#undef I
};
static const field train_fields[] = {
#define I(name, low, high) WHOLE(ssdgs_train_options, name, low, high)
#define R(name, low, high) REAL(ssdgs_train_options, name, low, high)
#define RATE(name) R(rates.name.start, 0, 1e30), R(rates.name.end, 0, 1e30)
    I(iterations, 1, 100000000),
    I(schedule, 0, 3),
    I(max_gaussians, 0, 1 << 28),
    I(densify_every, 1, 2000000000),
    I(opacity_reset_every, 0, 2000000000),
    I(batch, 1, 256),
    I(refine, 0, 15),
    R(dssim, 0, 1),
    R(normal_weight, 0, 1e6),
    R(densify_gradient, 0, 1e30),
    R(surplus, 1, 100),
    R(prune_outside, 0, 1),
    R(adam_epsilon, 0, 1e30),
    R(finish, 0, 1),
    RATE(position),
    RATE(opacity),
    RATE(scale),
    RATE(rotation),
    RATE(color),
    RATE(asg),
    RATE(frame),
    RATE(material),
    RATE(shadow),
    RATE(scattering),
    RATE(camera),
    RATE(light)
#undef I
#undef R
};

static ssdgs_context *context;
static ssdgs_model *model;
static ssdgs_photo photo;
static ssdgs_settings settings;
static ssdgs_render_options render_options;
static ssdgs_train_options train_options;
static ssdgs_real color[4 * 4 * 3];

static ssdgs_image picture(void) {
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color;
    return image;
}

static ssdgs_result make_model(void) {
    ssdgs_model *made = NULL;
    const ssdgs_result result = ssdgs_model_create(context, &settings, 0, &made);
    CHECK(!result == (made != NULL));
    ssdgs_model_destroy(made);
    return result;
}

static ssdgs_result render(void) {
    const ssdgs_image image = picture();
    return ssdgs_render_ex(model, &photo.camera, &photo.light, 1, &render_options, &image, NULL);
}

static ssdgs_result make_trainer(void) {
    ssdgs_trainer *made = NULL;
    const ssdgs_result result = ssdgs_trainer_create(model, &photo, 1, &train_options, &made);
    CHECK(!result == (made != NULL));
    ssdgs_trainer_destroy(made);
    return result;
}

/* Each field of the options in turn at its ends and beyond; `use` is what looks at them. */
static void check_ranges(const field *f, size_t count, void *options, ssdgs_result (*use)(void)) {
    for (; count--; f++) {
        unsigned char *at = (unsigned char *)options + f->at, kept[sizeof(ssdgs_real)];
        const double below = !f->real     ? f->low - 1
                             : f->low > 0 ? f->low / 2
                             : f->low < 0 ? f->low * 1.01
                                          : -1e-3;
        const double values[5] = {f->low, f->high, below, f->real ? f->high * 1.01 : f->high + 1,
                                  f->real ? (double)NAN : f->low - 1};
        memcpy(kept, at, sizeof kept);
        for (int i = 0; i < 5; i++) {
            const ssdgs_real real = (ssdgs_real)values[i];
            const int whole = f->real ? 0 : (int)values[i];
            if (f->real) memcpy(at, &real, sizeof real);
            else memcpy(at, &whole, sizeof whole);
            if (!CHECK(i < 2 ? !use()
                             : use() == SSDGS_ERR_ARGUMENT && strstr(ssdgs_error_message(context), f->name)))
                printf("    %s = %g: %s\n", f->name, values[i], ssdgs_error_message(context));
        }
        memcpy(at, kept, sizeof kept);
    }
}

/* Forms of earlier versions are refused as such. */
static void test_gone(void) {
    static const char *const names[3] = {"the released form", "Burley's profile",
                                         "the released angular form"};
    for (int i = 0; i < 3; i++) {
        const ssdgs_settings kept = settings;
        if (i < 2) settings.dipole = 2 + i;
        else settings.asg = 1;
        CHECK(make_model() == SSDGS_ERR_ARGUMENT && strstr(ssdgs_error_message(context), names[i]) &&
              strstr(ssdgs_error_message(context), "gone"));
        settings = kept;
    }
}

/* A field and what it is to be in each preset; NONE where nothing says. */
#define NONE -1e9
typedef struct preset {
    const char *name;
    size_t at;
    int real;
    double value[4];
} preset;
#define PRESET(type, real, name, ...) \
    { \
#name, offsetof(type, name), real, { __VA_ARGS__ } \
    }

static const preset settings_presets[] = {/* default, published: all of them */
#define I(...) PRESET(ssdgs_settings, 0, __VA_ARGS__)
#define R(...) PRESET(ssdgs_settings, 1, __VA_ARGS__)
                                          I(version, SSDGS_VERSION, SSDGS_VERSION),
                                          I(terms, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS),
                                          I(baked, 0, 0),
                                          I(harmonics, 0, 0),
                                          R(kept, 0, 0),
                                          I(transfer, SSDGS_TRANSFER_SRGB, SSDGS_TRANSFER_NONE),
                                          I(dipole, SSDGS_DIPOLE_JENSEN, SSDGS_DIPOLE_JENSEN),
                                          I(asg, SSDGS_ASG_DEFERRED, SSDGS_ASG_GEOMETRIC),
                                          I(per_channel_optics, 1, 0),
                                          I(depth_cue, 0, 0),
                                          I(transport, 1, 0),
                                          I(residual_shadow, 1, 0),
                                          I(shadow_on_scattering, 0, 0),
                                          I(scattering.layers, 3, 6),
                                          I(scattering.width, 128, 256),
                                          I(shadow.layers, 4, 4),
                                          I(shadow.width, 32, 32),
                                          I(octaves.view, 0, 4),
                                          I(octaves.light, 1, 4),
                                          I(light_map.blur, SSDGS_BLUR_FLOOR, SSDGS_BLUR_ADD),
                                          I(light_map.size, 0, 0),
                                          R(light_map.bias, 0.06, 0),
                                          R(pixel_variance, 0.1, 0.3),
                                          R(eta, 1.3, 1.3),
                                          R(centre[0], 0, 0),
                                          R(centre[1], 0, 0),
                                          R(centre[2], 0, 0),
                                          R(length_unit, 0.5, 1),
                                          R(light_scale, 1, 1),
                                          R(ambient[0], 0, 0),
                                          R(ambient[1], 0, 0),
                                          R(ambient[2], 0, 0),
                                          R(origin[0], 0, 0),
                                          R(origin[1], 0, 0),
                                          R(origin[2], 0, 0),
                                          R(placement.turn[0], 0, 0),
                                          R(placement.turn[1], 0, 0),
                                          R(placement.turn[2], 0, 0),
                                          R(placement.scale, 1, 1),
                                          R(placement.move[0], 0, 0),
                                          R(placement.move[1], 0, 0),
                                          R(placement.move[2], 0, 0),
                                          R(medium.scattering[0], 0, 0),
                                          R(medium.scattering[1], 0, 0),
                                          R(medium.scattering[2], 0, 0),
                                          R(medium.absorption[0], 0, 0),
                                          R(medium.absorption[1], 0, 0),
                                          R(medium.absorption[2], 0, 0)
#undef I
#undef R
};
static const preset render_presets[] = {/* default, exact, fast, preview */
#define I(...) PRESET(ssdgs_render_options, 0, __VA_ARGS__)
#define R(...) PRESET(ssdgs_render_options, 1, __VA_ARGS__)
                                        I(version, SSDGS_VERSION, SSDGS_VERSION, SSDGS_VERSION,
                                          SSDGS_VERSION),
                                        I(terms, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS, SSDGS_ALL_TERMS,
                                          SSDGS_ALL_TERMS),
                                        I(antialias, 0, 0, 0, 0),
                                        R(background[0], 0, 0, 0, 0),
                                        R(background[1], 0, 0, 0, 0),
                                        R(background[2], 0, 0, 0, 0),
                                        R(stop, 1.0 / 1024, NONE, 1.0 / 256, 1.0 / 64),
                                        R(alpha_threshold, NONE, NONE, NONE, 2.0 / 255),
                                        R(max_error, 1.0 / 16, 0, 1.0 / 4, 1.0 / 2),
                                        R(light_detail, 1, 1, 0.7, 0.6),
                                        R(transport_detail, 0.6, 1, 0.6, 0.4),
                                        R(level_detail, 1, 0, 0.5, 0.3)
#undef I
#undef R
};
static const preset train_presets[] = {/* default, published: all but the seed */
#define I(...) PRESET(ssdgs_train_options, 0, __VA_ARGS__)
#define R(...) PRESET(ssdgs_train_options, 1, __VA_ARGS__)
                                       I(version, SSDGS_VERSION, SSDGS_VERSION),
                                       I(iterations, 20000, 60000),
                                       I(schedule, SSDGS_SCHEDULE_MERGED, SSDGS_SCHEDULE_PROGRESSIVE),
                                       I(random_background, 1, 1),
                                       I(initial_points, 10000, 10000),
                                       I(max_gaussians, 0, 100000),
                                       I(densify_every, 100, 100),
                                       I(densify_from, 200, 500),
                                       I(densify_until, 50000, 50000),
                                       I(opacity_reset_every, 3000, 3000),
                                       I(batch, 1, 1),
                                       I(refine, 0, 0),
                                       R(background[0], 0, 0),
                                       R(background[1], 0, 0),
                                       R(background[2], 0, 0),
                                       R(dssim, 0.2, 0.2),
                                       R(normal_weight, 0.05, 0),
                                       R(bounds_min[0], -0.5, -0.5),
                                       R(bounds_min[1], -0.5, -0.5),
                                       R(bounds_min[2], -0.5, -0.5),
                                       R(bounds_max[0], 0.5, 0.5),
                                       R(bounds_max[1], 0.5, 0.5),
                                       R(bounds_max[2], 0.5, 0.5),
                                       R(densify_gradient, 4e-4, 2e-4),
                                       R(surplus, 2, 1),
                                       R(prune_outside, 0.02, 0),
                                       R(adam_epsilon, 0.1, 0),
                                       R(finish, 0.3, 1),
                                       R(rates.position.start, 6.4e-4, 1.6e-4),
                                       R(rates.position.end, 6.4e-6, 1.6e-6),
                                       R(rates.opacity.start, 0.05, 0.05),
                                       R(rates.opacity.end, 0.05, 0.05),
                                       R(rates.scale.start, 0.015, 0.005),
                                       R(rates.scale.end, 0.005, 0.005),
                                       R(rates.rotation.start, 0.001, 0.001),
                                       R(rates.rotation.end, 0.001, 0.001),
                                       R(rates.color.start, 0.03, 0.01),
                                       R(rates.color.end, 0.01, 0.01),
                                       R(rates.asg.start, 0.01, 0.01),
                                       R(rates.asg.end, 1e-4, 1e-4),
                                       R(rates.frame.start, 0.01, 0.01),
                                       R(rates.frame.end, 1e-4, 1e-4),
                                       R(rates.material.start, 0.001, 0.001),
                                       R(rates.material.end, 1e-5, 1e-5),
                                       R(rates.shadow.start, 0.001, 0.001),
                                       R(rates.shadow.end, 1e-5, 1e-5),
                                       R(rates.scattering.start, 0.001, 0.001),
                                       R(rates.scattering.end, 1e-5, 1e-5),
                                       R(rates.camera.start, 1e-3, 1e-3),
                                       R(rates.camera.end, 1e-5, 1e-5),
                                       R(rates.light.start, 1e-3, 1e-3),
                                       R(rates.light.end, 5e-5, 5e-5)
#undef I
#undef R
};

static void check_presets(const preset *p, size_t count, int column, const void *options) {
    for (; count--; p++) {
        const unsigned char *at = (const unsigned char *)options + p->at;
        ssdgs_real real = (ssdgs_real)p->value[column];
        int whole = 0;
        if (p->value[column] <= NONE) continue;
        memcpy(p->real ? (void *)&real : (void *)&whole, at, p->real ? sizeof real : sizeof whole);
        const double got = p->real ? (double)real : whole;
        if (!CHECK(fabs(got - p->value[column]) <= 1e-7 * fabs(p->value[column])))
            printf("    %s = %g, not %g\n", p->name, got, p->value[column]);
    }
}

static void test_presets(void) {
    const ssdgs_settings settings_of[2] = {ssdgs_settings_default(), ssdgs_settings_published()};
    const ssdgs_render_options render_of[4] = {ssdgs_render_options_default(), ssdgs_render_options_exact(),
                                               ssdgs_render_options_fast(), ssdgs_render_options_preview()};
    const ssdgs_train_options train_of[2] = {ssdgs_train_options_default(), ssdgs_train_options_published()};
#define EACH(table, of) \
    for (int i = 0; i < (int)(sizeof of / sizeof *of); i++) \
    check_presets(table, sizeof table / sizeof *table, i, of + i)
    const size_t rows[2] = {sizeof settings_presets / sizeof *settings_presets,
                            sizeof train_presets / sizeof *train_presets};
    CHECK(rows[0] * sizeof(float) == sizeof(ssdgs_settings)); /* none is forgotten */
    /* the seed, of 8 bytes, is not in the table */
    CHECK((rows[1] + 2) * sizeof(float) == offsetof(ssdgs_train_options, rates) + sizeof(ssdgs_rates));
    EACH(settings_presets, settings_of);
    EACH(render_presets, render_of);
    EACH(train_presets, train_of);
#undef EACH
    for (int i = 0; i < 27; i++) CHECK(!(fabs((double)render_of[0].ambient[i / 3][i % 3]) > 0));
    for (int i = 0; i < 2; i++) CHECK(train_of[i].seed == 1 && !train_of[i].sum.add); /* no int, no number */
    CHECK(settings_of[0].scattering.width < settings_of[1].scattering.width &&
          settings_of[0].scattering.layers < settings_of[1].scattering.layers);
    const ssdgs_gaussian g = ssdgs_gaussian_default(); /* grey, opacity 0.1, 0.02 wide, at 0 */
    for (int c = 0; c < 3; c++)
        CHECK(!(fabs((double)g.position[c]) > 0) && fabs((double)g.scale[c] - 0.02) < 0.005 &&
              fabs((double)g.diffuse[c] - (double)g.diffuse[0]) < 1e-6);
    CHECK(fabs((double)g.opacity - 0.1) < 1e-6);
    const ssdgs_object object = ssdgs_object_default(model);
    CHECK(object.model == model && !object.mask);
    const ssdgs_real ones[7] = {object.tint[0],  object.tint[1],      object.tint[2], object.roughness,
                                object.specular, object.translucency, object.presence};
    for (int i = 0; i < 12; i++) CHECK(!(fabs((double)object.to_world[i] - (i % 5 == 0)) > 0));
    for (int i = 0; i < 7; i++) CHECK(!(fabs((double)ones[i] - 1) > 0));
}

static void test_bounds(void) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++) {
            const ssdgs_train_options kept = train_options;
            if (k == 0) train_options.bounds_min[i] = train_options.bounds_max[i];
            if (k == 1) train_options.bounds_min[i] = (ssdgs_real)NAN;
            if (k == 2) train_options.bounds_max[i] = (ssdgs_real)HUGE_VAL;
            if (k == 3) train_options.background[i] = (ssdgs_real)NAN;
            CHECK(make_trainer() == SSDGS_ERR_ARGUMENT &&
                  strstr(ssdgs_error_message(context), k < 2   ? "bounds_min"
                                                       : k < 3 ? "bounds_max"
                                                               : "background"));
            train_options = kept;
        }
    for (int k = 0; k < 4; k++) { /* lengths that a model's file could not hold */
        const ssdgs_train_options kept = train_options;
        for (int i = 0; i < 3; i++) {
            train_options.bounds_min[i] = 0;
            train_options.bounds_max[i] = (ssdgs_real)(k == 0   ? 1e-15
                                                       : k == 1 ? 3e-15
                                                       : k == 2 ? 1e15
                                                                : 3e15);
        }
        CHECK(k == 1 || k == 2 ? !make_trainer()
                               : make_trainer() == SSDGS_ERR_ARGUMENT &&
                                     strstr(ssdgs_error_message(context), "longest side"));
        train_options = kept;
    }
}

#define MISSING(call) CHECK((call) == SSDGS_ERR_ARGUMENT)

#define SAYS(call, words) \
    do { \
        CHECK((call) != SSDGS_OK); \
        if (!CHECK(strstr(ssdgs_error_message(context), words))) puts(ssdgs_error_message(context)); \
    } while (0)

/* What was refused is named: which photograph, which light, which value. */
static void test_messages(void) {
    ssdgs_photo shots[3];
    ssdgs_train_options options = train_options;
    ssdgs_light light = photo.light;
    ssdgs_trainer *trainer = NULL;
    const ssdgs_image image = picture();
    const int numbers[2] = {4, 7}; /* of no format, no kind */
    for (int i = 0; i < 3; i++) shots[i] = photo;
    shots[2].camera.view[3] = (ssdgs_real)NAN;
    SAYS(ssdgs_trainer_create(model, shots, 3, NULL, &trainer),
         "photograph 2: camera: view[3] is not finite");
    shots[2] = photo;
    shots[1].light.intensity[1] = -1;
    SAYS(ssdgs_trainer_create(model, shots, 3, NULL, &trainer), "photograph 1: light 0: intensity[1] = -1");
    shots[1] = photo;
    shots[1].pixels = NULL;
    SAYS(ssdgs_trainer_create(model, shots, 3, NULL, &trainer), "photograph 1: it has no pixels");
    ssdgs_metrics metrics;
    SAYS(ssdgs_evaluate(model, shots + 1, train_options.background, NULL, &metrics),
         "photograph: it has no pixels");
    shots[1] = photo;
    memcpy(&shots[1].format, &numbers[0], sizeof numbers[0]); /* C++ has no such conversion */
    SAYS(ssdgs_trainer_create(model, shots, 3, NULL, &trainer), "photograph 1: format = 4");
    SAYS(ssdgs_refine_photo(model, shots + 1, train_options.background, 1), "photograph: format = 4");
    const size_t count = 4 * (size_t)photo.camera.width * (size_t)photo.camera.height;
    float *floats = (float *)calloc(count, sizeof *floats);
    if (!floats) exit(1);
    shots[1].pixels = floats;
    shots[1].format = SSDGS_PIXELS_RGBA32F;
    floats[9] = (float)INFINITY;
    SAYS(ssdgs_trainer_create(model, shots, 3, NULL, &trainer), "photograph 1: pixel 2 is not finite");
    floats[9] = 1e9f;
    floats[15] = 1.25f;
    SAYS(ssdgs_trainer_create(model, shots, 3, NULL, &trainer), "photograph 1: pixel 3 has alpha 1.25");
    floats[15] = -0.5f;
    SAYS(ssdgs_evaluate(model, shots + 1, train_options.background, NULL, &metrics),
         "pixel 3 has alpha -0.5");
    free(floats);
    SAYS(ssdgs_trainer_create(model, NULL, 3, NULL, &trainer), "3 photographs, but the array is NULL");
    SAYS(ssdgs_render(model, &photo.camera, NULL, 2, &image), "2 lights, but the array is NULL");
    light.kind = SSDGS_LIGHT_DIRECTIONAL;
    SAYS(ssdgs_render(model, &photo.camera, &light, 1, &image),
         "light 0: its direction is not a unit vector");
    light.position[0] = 0, light.position[1] = (ssdgs_real)-0.6, light.position[2] = (ssdgs_real)0.8;
    SAYS(ssdgs_render(model, &photo.camera, &light, 1, &image),
         "light 0: a directional light shines along `direction`, and its position is not read: set direction "
         "to "
         "(0, 0.6, -0.8), which is -position");
    light = photo.light;
    memcpy(&light.kind, &numbers[1], sizeof numbers[1]);
    SAYS(ssdgs_render(model, &photo.camera, &light, 1, &image), "light 0: kind = 7");
    SAYS(ssdgs_compare(context, color, NULL, 4, 4, &metrics), "ssdgs_compare: reference is NULL");
    options.densify_every = 0;
    SAYS(ssdgs_trainer_create(model, &photo, 1, &options, &trainer), "densify_every = 0 is not within 1 .. ");
    options = train_options;
    options.dssim = (ssdgs_real)-1.5e20;
    SAYS(ssdgs_trainer_create(model, &photo, 1, &options, &trainer), "dssim = -1.5e+20 is");
    options = train_options;
    options.bounds_max[0] = (ssdgs_real)INFINITY;
    SAYS(ssdgs_trainer_create(model, &photo, 1, &options, &trainer),
         "bounds_max[0] = inf is not within -1e+30 .. 1e+30");
    CHECK(!trainer);
}

/* How far a checkpoint's run had come; what is none. */
static void test_checkpoint(ssdgs_trainer *trainer) {
    static const char path[] = "build/t_refuse.run";
    int iteration = 7;
    MISSING(ssdgs_checkpoint_iteration(NULL, path, &iteration, NULL));
    MISSING(ssdgs_checkpoint_iteration(context, NULL, &iteration, NULL));
    MISSING(ssdgs_checkpoint_iteration(context, path, NULL, NULL));
    for (int i = 0; i < 3; i++) {
        CHECK(!ssdgs_trainer_save(trainer, path));
        CHECK(!ssdgs_checkpoint_iteration(context, path, &iteration, NULL) && iteration == i);
        CHECK(!ssdgs_trainer_step(trainer, NULL));
    }
    CHECK(!ssdgs_model_save(model, path));
    CHECK(ssdgs_checkpoint_iteration(context, path, &iteration, NULL) == SSDGS_ERR_FORMAT);
    CHECK(strstr(ssdgs_error_message(context), path) != NULL);
    remove(path);
    CHECK(ssdgs_checkpoint_iteration(context, path, &iteration, NULL) == SSDGS_ERR_IO);
    CHECK(strstr(ssdgs_error_message(context), path) != NULL);
}

static void test_missing(void) {
    static unsigned char byte = 0;
    static const ssdgs_real nowhere[3] = {0, (ssdgs_real)INFINITY, 0};
    const ssdgs_image image = picture();
    const ssdgs_real *background = train_options.background;
    ssdgs_camera camera = photo.camera;
    ssdgs_light light = photo.light;
    ssdgs_model *made = model;
    ssdgs_trainer *trainer = NULL;
    ssdgs_image narrow = image;
    ssdgs_photo bad = photo;
    MISSING(ssdgs_context_create(NULL, NULL));
    ssdgs_context_destroy(NULL);
    ssdgs_model_destroy(NULL);
    ssdgs_trainer_destroy(NULL);
    CHECK(*ssdgs_error_message(NULL) && *ssdgs_result_string(SSDGS_RESULT_COUNT) &&
          *ssdgs_isa_string(SSDGS_ISA_COUNT));
    CHECK(ssdgs_context_isa(NULL) == SSDGS_ISA_AUTO && !ssdgs_context_threads(NULL) &&
          !ssdgs_model_settings(NULL));
    CHECK(!ssdgs_model_arrays(NULL).count && !ssdgs_model_arrays(NULL).gaussians);
    MISSING(ssdgs_stage_cpu(NULL, SSDGS_STAGE_PROJECT));
    MISSING(ssdgs_model_create(NULL, NULL, 0, &made));
    MISSING(ssdgs_model_create(context, NULL, 0, NULL));
    MISSING(ssdgs_model_load_memory(NULL, &byte, 1, &made, NULL));
    MISSING(ssdgs_model_load_memory(context, NULL, 1, &made, NULL));
    MISSING(ssdgs_model_load_memory(context, &byte, 1, NULL, NULL));
    MISSING(ssdgs_model_load(NULL, "build/none", &made, NULL));
    MISSING(ssdgs_model_load(context, NULL, &made, NULL));
    MISSING(ssdgs_model_load(context, "build/none", NULL, NULL));
    CHECK(!made);
    MISSING(ssdgs_model_sort(NULL));
    MISSING(ssdgs_model_save(NULL, "build/none"));
    MISSING(ssdgs_model_save(model, NULL));
    MISSING(ssdgs_model_write(model, NULL, NULL));
    MISSING(ssdgs_render(NULL, &camera, &light, 1, &image));
    MISSING(ssdgs_render(model, NULL, &light, 1, &image));
    MISSING(ssdgs_render(model, &camera, &light, 1, NULL));
    MISSING(ssdgs_render(model, &camera, NULL, 1, &image));
    narrow.stride = camera.width - 1;
    MISSING(ssdgs_render(model, &camera, &light, 1, &narrow));
    ssdgs_metrics metrics;
    MISSING(ssdgs_compare(NULL, color, color, 4, 4, &metrics));
    MISSING(ssdgs_compare(context, NULL, color, 4, 4, &metrics));
    MISSING(ssdgs_compare(context, color, NULL, 4, 4, &metrics));
    MISSING(ssdgs_compare(context, color, color, 0, 4, &metrics));
    MISSING(ssdgs_compare(context, color, color, 4, 0, &metrics));
    MISSING(ssdgs_compare(context, color, color, 40000, 4, &metrics));
    MISSING(ssdgs_compare(context, color, color, 4, 40000, &metrics));
    MISSING(ssdgs_compare(context, color, color, 4, 4, NULL));
    MISSING(ssdgs_trainer_create(NULL, &photo, 1, NULL, &trainer));
    MISSING(ssdgs_trainer_create(model, &photo, 1, NULL, NULL));
    MISSING(ssdgs_trainer_create(model, NULL, 1, NULL, &trainer));
    MISSING(ssdgs_trainer_create(model, &photo, 0, NULL, &trainer));
    bad.pixels = NULL;
    MISSING(ssdgs_trainer_create(model, &bad, 1, NULL, &trainer));
    MISSING(ssdgs_evaluate(model, &bad, background, NULL, &metrics));
    MISSING(ssdgs_refine_photo(model, &bad, background, 1));
    bad = photo;
    bad.camera.width = 0;
    MISSING(ssdgs_trainer_create(model, &bad, 1, NULL, &trainer));
    MISSING(ssdgs_evaluate(model, &bad, background, NULL, &metrics));
    MISSING(ssdgs_refine_photo(model, &bad, background, 1));
    CHECK(ssdgs_evaluate(model, &photo, nowhere, NULL, &metrics) == SSDGS_ERR_NONFINITE);
    CHECK(ssdgs_refine_photo(model, &photo, nowhere, 1) == SSDGS_ERR_NONFINITE);
    CHECK(!trainer);
    test_messages();
    MISSING(ssdgs_evaluate(NULL, &photo, background, NULL, &metrics));
    MISSING(ssdgs_evaluate(model, NULL, background, NULL, &metrics));
    MISSING(ssdgs_evaluate(model, &photo, NULL, NULL, &metrics));
    MISSING(ssdgs_evaluate(model, &photo, background, NULL, NULL));
    MISSING(ssdgs_refine_photo(NULL, &bad, background, 1));
    MISSING(ssdgs_refine_photo(model, NULL, background, 1));
    MISSING(ssdgs_refine_photo(model, &bad, NULL, 1));
    MISSING(ssdgs_refine_photo(model, &bad, background, -1));
    CHECK(!ssdgs_trainer_create(model, &photo, 1, NULL, &trainer));
    MISSING(ssdgs_trainer_step(NULL, NULL));
    MISSING(ssdgs_trainer_run(NULL, NULL, NULL));
    MISSING(ssdgs_trainer_refined(NULL, 0, &camera, &light));
    MISSING(ssdgs_trainer_refined(trainer, -1, &camera, &light));
    MISSING(ssdgs_trainer_refined(trainer, 1, &camera, &light));
    MISSING(ssdgs_trainer_refined(trainer, 0, NULL, &light));
    MISSING(ssdgs_trainer_refined(trainer, 0, &camera, NULL));
    MISSING(ssdgs_trainer_save(NULL, "build/none"));
    MISSING(ssdgs_trainer_save(trainer, NULL));
    MISSING(ssdgs_trainer_load(NULL, "build/none"));
    MISSING(ssdgs_trainer_load(trainer, NULL));
    test_checkpoint(trainer);
    ssdgs_trainer_destroy(trainer);
    settings.baked = 1;
    CHECK(!ssdgs_model_create(context, &settings, 0, &made));
    MISSING(ssdgs_trainer_create(made, &photo, 1, NULL, &trainer)); /* baked colours do not learn */
    settings.baked = 0;
    ssdgs_model_destroy(made);
}

/* The transfer curve leaves alone what is no number. */
static void test_curve(void) {
    const ssdgs_real values[3] = {(ssdgs_real)NAN, (ssdgs_real)INFINITY, (ssdgs_real)-INFINITY};
    for (int i = 0; i < 3; i++) {
        const ssdgs_real encoded = ssdgs_srgb_encode(values[i]), decoded = ssdgs_srgb_decode(values[i]);
        CHECK(!memcmp(&encoded, values + i, sizeof encoded) && !memcmp(&decoded, values + i, sizeof decoded));
    }
}

/* ssdgs_model_set() and _get(): what is written is what is used and what is read; what makes no sense is
   named. */
static void test_gaussian(void) {
    static const struct {
        size_t at;
        double value;
        const char *name;
    } bad[] = {{offsetof(ssdgs_gaussian, position), (double)NAN, "position"},
               {offsetof(ssdgs_gaussian, rotation), (double)NAN, "rotation"},
               {offsetof(ssdgs_gaussian, scale), 0, "scale"},
               {offsetof(ssdgs_gaussian, scale), (double)INFINITY, "scale"},
               {offsetof(ssdgs_gaussian, normal), (double)NAN, "normal"},
               {offsetof(ssdgs_gaussian, opacity), 1.01, "opacity"},
               {offsetof(ssdgs_gaussian, opacity), (double)NAN, "opacity"},
               {offsetof(ssdgs_gaussian, diffuse), -0.1, "diffuse"},
               {offsetof(ssdgs_gaussian, diffuse), (double)INFINITY, "diffuse"},
               {offsetof(ssdgs_gaussian, specular), (double)NAN, "specular"},
               {offsetof(ssdgs_gaussian, specular), (double)INFINITY, "specular"},
               {offsetof(ssdgs_gaussian, scattering), -1, "scatter"},
               {offsetof(ssdgs_gaussian, scattering), (double)INFINITY, "scatter"},
               {offsetof(ssdgs_gaussian, sharpness), 0, "sharpness"},
               {offsetof(ssdgs_gaussian, sharpness), (double)INFINITY, "sharpness"},
               {offsetof(ssdgs_gaussian, f0), 0, "f0"},
               {offsetof(ssdgs_gaussian, f0), 1.01, "f0"},
               {offsetof(ssdgs_gaussian, softness), -1, "softness"},
               {offsetof(ssdgs_gaussian, softness), 1.01, "softness"},
               {offsetof(ssdgs_gaussian, material), (double)NAN, "material"}};
    const double tolerance = sizeof(ssdgs_real) == 4 ? 2e-6 : 1e-12;
    ssdgs_model *two = NULL;
    ssdgs_gaussian g = ssdgs_gaussian_default();
    CHECK(!ssdgs_model_create(context, NULL, 2, &two));
    ssdgs_gaussian back;
    CHECK(!ssdgs_model_get(two, 1, &back) &&
          !memcmp(&g, &back, sizeof g)); /* a new model's are the default's */
    ssdgs_model_view v = ssdgs_model_arrays(two);
    const double values[] = {0.3,  -2,  7,    0.5,  -0.5, 0.5, 0.5, 0.02, 0.3, 1e-3, 0,
                             -0.6, 0.8, 0.75, 0.4,  0,    2,   0.1, 0.2,  0.3, 0.5,  40,
                             1e-4, 30,  0.5,  0.08, 0.9,  1,   -1,  0,    0.5, 2,    3};
    ssdgs_real *fields = (ssdgs_real *)(void *)&g;
    for (size_t i = 0; i < sizeof g / sizeof *fields; i++) fields[i] = (ssdgs_real)values[i];
    CHECK(sizeof g == sizeof values / sizeof *values * sizeof *fields);
    CHECK(!ssdgs_model_set(two, 1, &g) && !ssdgs_model_get(two, 1, &back));
    CHECK_NEAR((const ssdgs_real *)(const void *)&back, values, sizeof g / sizeof *fields, tolerance,
               tolerance, "a Gaussian is read as it was written");
#define RAW(channel) (double)v.gaussians[(size_t)(channel)*v.stride + 1]
    CHECK(fabs(exp(RAW(SSDGS_LOG_SCALE + 1)) - 0.3) < 1e-6 &&
          fabs(1 / (1 + exp(-RAW(SSDGS_OPACITY))) - 0.75) < 1e-6);
    CHECK(fabs(log1p(exp(RAW(SSDGS_DIFFUSE))) - 0.4) < 1e-6 && RAW(SSDGS_DIFFUSE + 1) < -15);
    CHECK(fabs(exp(RAW(SSDGS_ASG_WEIGHT)) - 30) < 1e-4 && fabs(exp(RAW(SSDGS_ASG_WEIGHT + 1)) - 0.5) < 1e-6);
    CHECK(fabs(1 / (1 + exp(3.1780538303479458 - RAW(SSDGS_ASG_WEIGHT + 2))) - 0.08) < 1e-6);
    /* a frame that has the normal stays, whichever way it turns about it */
    const double w = RAW(SSDGS_FRAME), x = RAW(SSDGS_FRAME + 1), y = RAW(SSDGS_FRAME + 2),
                 z = RAW(SSDGS_FRAME + 3);
    const double turned[4] = {0.8 * w - 0.6 * z, 0.8 * x + 0.6 * y, 0.8 * y - 0.6 * x, 0.8 * z + 0.6 * w};
    for (size_t i = 0; i < 4; i++) v.gaussians[(SSDGS_FRAME + i) * v.stride + 1] = (ssdgs_real)turned[i];
    ssdgs_gaussian again;
    CHECK(!ssdgs_model_get(two, 1, &again));
    CHECK_NEAR(again.normal, back.normal, 3, tolerance, 0, "turned about its normal");
    CHECK(!ssdgs_model_set(two, 1, &again) && RAW(SSDGS_FRAME + 3) == (double)(ssdgs_real)turned[3]);
    /* and turns where the Gaussian does */
    ssdgs_gaussian quarter = ssdgs_gaussian_default();
    quarter.normal[2] = 1;
    CHECK(!ssdgs_model_set(two, 1, &quarter));
    quarter.rotation[0] = quarter.rotation[3] = 1;
    CHECK(!ssdgs_model_set(two, 1, &quarter) && RAW(SSDGS_FRAME) > 0 &&
          fabs(RAW(SSDGS_FRAME + 3) / RAW(SSDGS_FRAME) - 1) < 1e-6);
    for (int i = 0; i < 8; i++) { /* a normal may have any length, and point anywhere */
        static const double lengths[] = {1e-25, 1, 1e25, 3.4e38};
        const double side = i & 1 ? -1 : 1;
        for (int c = 0; c < 3; c++) g.normal[c] = (ssdgs_real)((c - 1) * side * lengths[i / 2]);
        CHECK(!ssdgs_model_set(two, 1, &g) && !ssdgs_model_get(two, 1, &again));
        CHECK(side * (double)again.normal[0] < -0.7 && side * (double)again.normal[2] > 0.7);
    }
    /* without a rotation the third axis is the normal, without a normal the normal is the third axis */
    for (int down = 0; down < 2; down++) {
        const ssdgs_real normal[3] = {0, 0, (ssdgs_real)(down ? -2 : 2)};
        memset(g.rotation, 0, sizeof g.rotation);
        memcpy(g.normal, normal, sizeof normal);
        CHECK(!ssdgs_model_set(two, 0, &g) && !ssdgs_model_get(two, 0, &back));
        CHECK(back.normal[2] == (down ? -1 : 1) && fabs((double)back.rotation[down]) == 1);
        memset(back.normal, 0, sizeof back.normal);
        CHECK(!ssdgs_model_set(two, 0, &back) && !ssdgs_model_get(two, 0, &again));
        CHECK(again.normal[2] == (down ? -1 : 1));
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        back = g;
        const ssdgs_real value = (ssdgs_real)bad[i].value;
        memcpy((char *)&back + bad[i].at, &value, sizeof value);
        if (!CHECK(ssdgs_model_set(two, 0, &back) == SSDGS_ERR_ARGUMENT &&
                   strstr(ssdgs_error_message(context), bad[i].name)))
            printf("    %s: %s\n", bad[i].name, ssdgs_error_message(context));
    }
    CHECK(ssdgs_model_get(two, 0, &again) == SSDGS_OK && again.scale[0] == back.scale[0]);
    back = g; /* what is read can be written: an f0 that rounds to 1 */
    back.f0 = 1;
    CHECK(!ssdgs_model_set(two, 0, &back) && !ssdgs_model_get(two, 0, &again) &&
          again.f0 > (ssdgs_real)0.99999 && !ssdgs_model_set(two, 0, &again));
    ssdgs_settings odd = settings; /* numbers that are not used are finite too, as files need them */
    odd.medium.absorption[1] = (ssdgs_real)NAN;
    ssdgs_model *none = NULL;
    CHECK(ssdgs_model_create(context, &odd, 1, &none) == SSDGS_ERR_ARGUMENT && !none);
    odd = settings; /* and widths that are not used may be 0 */
    odd.scattering.layers = odd.shadow.layers = odd.scattering.width = odd.shadow.width = 0;
    odd.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    CHECK(!ssdgs_model_create(context, &odd, 1, &none));
    ssdgs_model_destroy(none);
    CHECK(ssdgs_model_set(two, 2, &g) == SSDGS_ERR_ARGUMENT &&
          ssdgs_model_get(two, -1, &g) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_model_set(two, 0, NULL) == SSDGS_ERR_ARGUMENT &&
          ssdgs_model_get(two, 0, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_model_set(NULL, 0, &g) == SSDGS_ERR_ARGUMENT &&
          ssdgs_model_get(NULL, 0, &g) == SSDGS_ERR_ARGUMENT);
    ssdgs_model_destroy(two);
}

int main(void) {
    static unsigned char pixels[4 * 4 * 4];
    const ssdgs_real eye[3] = {0, -3, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    memset(pixels, 128, sizeof pixels);
    photo.camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, 4, 4);
    photo.light.position[2] = 3;
    photo.light.intensity[0] = photo.light.intensity[1] = photo.light.intensity[2] = 1;
    photo.pixels = pixels;
    settings = ssdgs_settings_default();
    render_options = ssdgs_render_options_default();
    train_options = ssdgs_train_options_default();
    if (!CHECK(!ssdgs_context_create(NULL, &context) && !ssdgs_model_create(context, NULL, 3, &model)))
        return 1;
    test_gaussian();
    check_ranges(settings_fields, sizeof settings_fields / sizeof *settings_fields, &settings, make_model);
    check_ranges(render_fields, sizeof render_fields / sizeof *render_fields, &render_options, render);
    check_ranges(train_fields, sizeof train_fields / sizeof *train_fields, &train_options, make_trainer);
    settings.scattering.layers = 0;
    for (int c = 0; c < 3; c++) settings.medium.scattering[c] = 1;
    check_ranges(medium_fields, sizeof medium_fields / sizeof *medium_fields, &settings, make_model);
    settings = ssdgs_settings_default();
    test_gone();
    test_presets();
    test_bounds();
    test_curve();
    test_missing();
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    TEST_END();
}
