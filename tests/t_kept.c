/* real64. Colours that no light makes: the same picture as that of the plain splat, lamps that add to it,
   shadows that take a light's share of it, files, what is made of such models. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/adopt.h"
#include "../examples/reduce.h"
#include "../examples/unbake.h"
#include "test.h"

enum { COUNT = 300, SIDE = 48, PIXELS = 3 * SIDE * SIDE };
static const double unit = 0.28209479177387814; /* of f_dc */

static ssdgs_settings plain_settings(int harmonics) {
    ssdgs_settings s = ssdgs_settings_default();
    s.baked = 1;
    s.transfer = SSDGS_TRANSFER_NONE;
    s.harmonics = harmonics;
    return s;
}

/* Lit and kept, without networks and with a bias that leaves no Gaussian a shadow on another. */
static ssdgs_settings kept_settings(int harmonics, int asg) {
    ssdgs_settings s = ssdgs_settings_default();
    s.kept = 1;
    s.harmonics = harmonics;
    s.asg = asg;
    s.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    s.scattering.layers = s.shadow.layers = s.transport = 0;
    s.light_map.bias = 100;
    return s;
}

/* Gaussians in a ball of radius 0.5, with colours and harmonics; the same whatever the settings. */
static ssdgs_model *ball(ssdgs_context *context, ssdgs_settings settings, int count) {
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, &settings, count, &model))) exit(1);
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    const size_t first = settings.baked ? SSDGS_DIFFUSE : SSDGS_CHANNELS;
    for (size_t i = 0; i < (size_t)count; i++) {
        uint64_t at = 100 * i;
        for (size_t c = 0; c < SSDGS_DIFFUSE; c++) {
            const double draw = 2 * test_uniform(7, at++) - 1;
            v.gaussians[c * v.stride + i] = (ssdgs_real)(c < SSDGS_ROTATION    ? 0.3 * draw
                                                         : c < SSDGS_LOG_SCALE ? draw
                                                         : c < SSDGS_OPACITY   ? -3 + 0.5 * draw
                                                                               : 1 + 2 * draw);
        }
        for (size_t c = SSDGS_DIFFUSE; c < SSDGS_FRAME && !settings.baked; c++)
            v.gaussians[c * v.stride + i] = (ssdgs_real)test_uniform(8, 100 * i + c);
        for (size_t c = first; c < (size_t)v.channels; c++)
            v.gaussians[c * v.stride + i] =
                (ssdgs_real)((c < first + 3 ? 1.5 : 0.2) * (2 * test_uniform(7, at++) - 1));
    }
    return model;
}

static ssdgs_camera camera_at(double x, double y, double z) {
    const ssdgs_real eye[3] = {(ssdgs_real)x, (ssdgs_real)y, (ssdgs_real)z}, target[3] = {0, 0, 0},
                     up[3] = {0, 0, 1};
    return ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.8, SIDE, SIDE);
}

static ssdgs_light lamp(double x, double y, double z, double power) {
    const ssdgs_real place[3] = {(ssdgs_real)x, (ssdgs_real)y, (ssdgs_real)z},
                     intensity[3] = {(ssdgs_real)power, (ssdgs_real)(0.8 * power), (ssdgs_real)(0.6 * power)};
    return ssdgs_light_point(place, intensity);
}

/* A scene's picture over black, exactly. */
static void draw(ssdgs_context *context, const ssdgs_object *objects, int count, const ssdgs_light *lights,
                 int light_count, const ssdgs_occluder *occluder, int terms, ssdgs_real *color) {
    const ssdgs_camera camera = camera_at(2, 1, 0.7);
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_scene *scene = NULL;
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color;
    options.terms = terms;
    if (!CHECK(!ssdgs_scene_create(context, &scene))) exit(1);
    ssdgs_scene_occlude(scene, occluder);
    if (!CHECK(
            !ssdgs_scene_render(scene, objects, count, &camera, lights, light_count, &options, &image, NULL)))
        printf("    %s\n", ssdgs_error_message(context));
    ssdgs_scene_destroy(scene);
}

static ssdgs_real one[PIXELS], two[PIXELS], want[PIXELS];

/* With kept 1 and no lamp the picture is the plain splat's in a frame of linear light, bit for bit; with a
   lamp it is the sum of both. */
static void test_picture(ssdgs_context *context, int harmonics) {
    ssdgs_model *nothing = ball(context, kept_settings(0, SSDGS_ASG_DEFERRED), 0),
                *plain = ball(context, plain_settings(harmonics), COUNT);
    ssdgs_object objects[2] = {ssdgs_object_default(nothing), ssdgs_object_default(plain)};
    double bright = 0;
    CHECK(objects[1].kept >= 1 && objects[1].kept <= 1);
    draw(context, objects, 2, NULL, 0, NULL, SSDGS_ALL_TERMS, want);
    for (int i = 0; i < PIXELS; i++) bright += (double)want[i] / PIXELS;
    CHECK(bright > 0.03);
    for (int asg = 0; asg <= SSDGS_ASG_DEFERRED; asg += SSDGS_ASG_DEFERRED) {
        ssdgs_model *kept = ball(context, kept_settings(harmonics, asg), COUNT);
        ssdgs_object object = ssdgs_object_default(kept), dark = object;
        const ssdgs_light lights[2] = {lamp(1, 2, 2, 30), lamp(2, -1, 1, 20)};
        draw(context, &object, 1, NULL, 0, NULL, SSDGS_ALL_TERMS, one);
        CHECK(!memcmp(one, want, sizeof one));
        draw(context, &object, 1, lights, 2, NULL, SSDGS_ALL_TERMS, one);
        dark.kept = 0;
        draw(context, &dark, 1, lights, 2, NULL, SSDGS_ALL_TERMS, two);
        double lit = 0;
        for (int i = 0; i < PIXELS; i++) lit += (double)two[i] / PIXELS, two[i] += want[i];
        CHECK(lit > 0.03);
        CHECK_NEAR(one, two, PIXELS, 2e-6, 2e-6, "lamps add to what is kept");
        object.kept = (ssdgs_real)0.5;
        object.tint[1] = 0;
        draw(context, &object, 1, NULL, 0, NULL, SSDGS_ALL_TERMS, one);
        for (int i = 0; i < PIXELS; i++) two[i] = want[i] * (ssdgs_real)(i % 3 == 1 ? 0 : 0.5);
        CHECK_NEAR(one, two, PIXELS, 2e-6, 2e-6, "an object keeps half, without green");
        ssdgs_model_destroy(kept);
    }
    ssdgs_model_destroy(nothing);
    ssdgs_model_destroy(plain);
}

/* Where the parts of an image have what is kept: deferred, diffuse has the light's share of it, scattering
   the rest; else diffuse has all. Nothing shines. */
static void test_parts(ssdgs_context *context, int asg) {
    static ssdgs_real part[3][PIXELS];
    ssdgs_model *kept = ball(context, kept_settings(1, asg), COUNT);
    const ssdgs_object object = ssdgs_object_default(kept);
    const ssdgs_camera camera = camera_at(2, 1, 0.7);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_light light = lamp(1, 2, 2, 30);
    ssdgs_scene *scene = NULL;
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = one, image.diffuse = part[0], image.specular = part[1], image.scattering = part[2];
    light.kept = (ssdgs_real)0.4;
    CHECK(!ssdgs_scene_create(context, &scene));
    CHECK(!ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, &options, &image, NULL));
    draw(context, &object, 1, NULL, 0, NULL, SSDGS_ALL_TERMS, want);
    for (int i = 0; i < PIXELS; i++) {
        const ssdgs_real rest = asg == SSDGS_ASG_DEFERRED ? want[i] * (ssdgs_real)0.6 : 0;
        CHECK(fabs((double)part[1][i]) < 3e-6 && fabs((double)(part[2][i] - rest)) < 3e-6 &&
              fabs((double)(part[0][i] + rest - one[i])) < 3e-6);
    }
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(kept);
}

/* A share of each light is left, everywhere. */
static const double left[2] = {0.25, 0.5};
static void shade(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    (void)user, (void)points;
    for (int i = 0; i < count; i++) fraction[i] *= (ssdgs_real)left[light];
}

/* What is missing where lights' shadows fall on kept colours: of baked and of lit models, deferred or not. */
static void test_shares(ssdgs_context *context, int baked, int asg) {
    ssdgs_settings settings = baked ? plain_settings(1) : kept_settings(1, asg);
    settings.asg = asg;
    settings.light_map.bias = 100;
    ssdgs_model *nothing = ball(context, kept_settings(0, SSDGS_ASG_DEFERRED), 0),
                *model = ball(context, settings, COUNT);
    ssdgs_object objects[2] = {ssdgs_object_default(model), ssdgs_object_default(nothing)};
    ssdgs_occluder occluder;
    memset(&occluder, 0, sizeof occluder);
    occluder.shadow = shade;
    draw(context, objects, 2, NULL, 0, NULL, SSDGS_ALL_TERMS, want);
    for (int shares = 0; shares < 9; shares++) {
        ssdgs_light lights[2] = {lamp(1, 2, 2, baked ? 5 : 0), lamp(2, -1, 1, baked ? 5 : 0)};
        lights[0].kept = (ssdgs_real)(0.4 * (shares % 3)), lights[1].kept = (ssdgs_real)(0.35 * (shares / 3));
        const double sum = (double)(lights[0].kept + lights[1].kept), above = sum > 1 ? sum : 1;
        const double factor =
            1 - ((double)lights[0].kept * (1 - left[0]) + (double)lights[1].kept * (1 - left[1])) / above;
        for (int i = 0; i < PIXELS; i++) two[i] = (ssdgs_real)factor * want[i];
        draw(context, objects, 2, lights, 2, &occluder, SSDGS_ALL_TERMS, one);
        CHECK_NEAR(one, two, PIXELS, 3e-6, 3e-6, "shares of kept colours");
        objects[0].tint[0] = objects[0].tint[1] = objects[0].tint[2] = (ssdgs_real)0.5;
        for (int i = 0; i < PIXELS; i++) two[i] *= (ssdgs_real)0.5;
        draw(context, objects, 2, lights, 2, &occluder, SSDGS_ALL_TERMS, one);
        CHECK_NEAR(one, two, PIXELS, 3e-6, 3e-6, "shares of tinted colours");
        objects[0].tint[0] = objects[0].tint[1] = objects[0].tint[2] = 1;
        draw(context, objects, 2, lights, 2, &occluder, SSDGS_DIFFUSE_TERM, one);
        CHECK_NEAR(one, want, PIXELS, 3e-6, 3e-6, "no shadow is asked for");
        lights[0].unshadowed = lights[1].unshadowed = 1;
        draw(context, objects, 2, lights, 2, &occluder, SSDGS_ALL_TERMS, one);
        CHECK_NEAR(one, want, PIXELS, 3e-6, 3e-6, "nothing is in these lights' way");
    }
    ssdgs_light near_lamp = lamp(0, 0, 2, 0); /* half of its range away it fades by (1 - 1/16)^2 */
    near_lamp.kept = 1;
    near_lamp.range = 4;
    ssdgs_model_destroy(model);
    model = ball(context, settings, 1);
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t c = 0; c < 3; c++) v.gaussians[c * v.stride] = 0;
    objects[0] = ssdgs_object_default(model);
    draw(context, objects, 2, NULL, 0, NULL, SSDGS_ALL_TERMS, want);
    draw(context, objects, 2, &near_lamp, 1, &occluder, SSDGS_ALL_TERMS, one);
    const double reach = (1 - 1 / 16.0), factor = 1 - reach * (1 - left[0]);
    double bright = 0;
    for (int i = 0; i < PIXELS; i++)
        bright = fmax(bright, (double)want[i]), two[i] = (ssdgs_real)factor * want[i];
    CHECK(bright > 0.1);
    CHECK_NEAR(one, two, PIXELS, 3e-6, 3e-6, "a share within a lamp's range");
    ssdgs_model_destroy(nothing);
    ssdgs_model_destroy(model);
}

/* A thing, lit or baked too, casts its shadow on a baked floor. */
static void test_floor(ssdgs_context *context, int baked) {
    ssdgs_settings settings = plain_settings(0),
                   lit = baked ? settings : kept_settings(0, SSDGS_ASG_DEFERRED);
    settings.light_map.bias = lit.light_map.bias = (ssdgs_real)0.05;
    ssdgs_model *floor_ = NULL, *thing = ball(context, lit, 1);
    enum { ROW = 40 };
    if (!CHECK(!ssdgs_model_create(context, &settings, ROW * ROW, &floor_))) exit(1);
    ssdgs_gaussian g = ssdgs_gaussian_default();
    g.opacity = (ssdgs_real)0.95;
    for (int i = 0; i < ROW * ROW; i++) {
        g.position[0] = (ssdgs_real)((i % ROW + 0.5) * 2 / ROW - 1);
        g.position[1] = (ssdgs_real)((i / ROW + 0.5) * 2 / ROW - 1);
        g.scale[0] = g.scale[1] = (ssdgs_real)0.05;
        g.scale[2] = (ssdgs_real)0.002;
        g.diffuse[0] = g.diffuse[1] = g.diffuse[2] = (ssdgs_real)0.7;
        CHECK(!ssdgs_model_set(floor_, i, &g));
    }
    g.position[0] = g.position[1] = 0, g.position[2] = (ssdgs_real)0.5;
    g.scale[0] = g.scale[1] = g.scale[2] = (ssdgs_real)0.15;
    g.opacity = 1;
    CHECK(!ssdgs_model_set(thing, 0, &g));
    static const ssdgs_real down[3] = {0, 0, -1}, none[3] = {0, 0, 0};
    const ssdgs_object objects[2] = {ssdgs_object_default(floor_), ssdgs_object_default(thing)};
    const ssdgs_real eye[3] = {0, (ssdgs_real)-0.01, -3}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.8, SIDE, SIDE);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_light sun = ssdgs_light_directional(down, none);
    ssdgs_image image;
    ssdgs_scene *scene = NULL;
    memset(&image, 0, sizeof image);
    image.color = one;
    CHECK(!ssdgs_scene_create(context, &scene));
    for (int turn = 0; turn < 2; turn++) {
        sun.kept = (ssdgs_real)(turn ? 0.6 : 0);
        CHECK(!ssdgs_scene_render(scene, objects, 2, &camera, &sun, 1, &options, &image, NULL));
        if (!turn) memcpy(want, one, sizeof one);
    }
    const size_t middle = 3 * (SIDE * (SIDE / 2) + SIDE / 2), corner = 3 * (SIDE * 8 + 8);
    CHECK_NEAR(one + corner, want + corner, 3, 0.02, 0, "the floor in the sun"); /* the map sees its front */
    for (size_t c = 0; c < 3; c++) CHECK(fabs((double)(one[middle + c] / want[middle + c]) - 0.46) < 0.06);
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(floor_);
    ssdgs_model_destroy(thing);
}

/* The number of a property among a file's vertices; -1: there is none. */
static int property(const char *header, const char *name) {
    int at = 0;
    const char *line = strstr(header, "element vertex");
    while (line && (line = strchr(line, '\n')) != NULL && !strncmp(++line, "property float ", 15)) {
        if (!strncmp(line + 15, name, strlen(name)) && line[15 + strlen(name)] == '\n') return at;
        at++;
    }
    return -1;
}

/* Files hold what is kept as f_dc and f_rest, which other programs show. */
static void test_files(ssdgs_context *context, const char *path) {
    ssdgs_model *kept = ball(context, kept_settings(2, SSDGS_ASG_DEFERRED), COUNT), *back = NULL;
    const ssdgs_model_view v = ssdgs_model_arrays(kept);
    CHECK(v.channels == SSDGS_CHANNELS + 27);
    if (!CHECK(!ssdgs_model_save(kept, path))) exit(1);
    CHECK(!ssdgs_model_load(context, path, &back, NULL));
    const ssdgs_model_view w = ssdgs_model_peek(back);
    CHECK(w.channels == v.channels && w.count == COUNT && ssdgs_model_settings(back)->kept >= 1);
    for (size_t c = 0; c < (size_t)w.channels; c++)
        for (size_t i = 0; i < COUNT; i++)
            CHECK((float)v.gaussians[c * v.stride + i] == (float)w.gaussians[c * w.stride + i]);
    ssdgs_model_destroy(back);
    FILE *file = fopen(path, "rb");
    char *bytes = (char *)calloc(1, 1 << 20);
    if (!CHECK(file && bytes)) exit(1);
    const size_t size = fread(bytes, 1, 1 << 20, file);
    fclose(file);
    CHECK(size > 0 && size < 1 << 20);
    char *rows = strstr(bytes, "end_header\n") + 11;
    const int properties = property(bytes, "neural_material_5") + 1, dc = property(bytes, "f_dc_0"),
              rest = property(bytes, "f_rest_0");
    CHECK(properties == 38 + 3 + 27 && rest == dc + 3 && property(bytes, "f_rest_23") == rest + 23);
    for (int i = 0; i < COUNT; i++)
        for (int c = 0; c < 27; c++) {
            float value;
            memcpy(&value, rows + 4 * (properties * i + dc + c), sizeof value);
            CHECK(value == (float)v.gaussians[(size_t)(SSDGS_CHANNELS + c) * v.stride + (size_t)i]);
        }
    static const char *const needed[2] = {"f_dc_1\n", "f_rest_23\n"};
    for (int i = 0; i < 2; i++) {
        char *at = strstr(bytes, needed[i]);
        at[2] = 'X';
        CHECK(ssdgs_model_load_memory(context, bytes, size, &back, NULL) == SSDGS_ERR_FORMAT && !back);
        at[2] = needed[i][2];
        CHECK(strstr(ssdgs_error_message(context), i ? "f_rest_23" : "f_dc_1") != NULL);
    }
    free(bytes);
    ssdgs_model_destroy(kept);
}

/* Editors of splats leave no settings; levels of detail merge Gaussians. */
static void test_edited(ssdgs_context *context) {
    const ssdgs_settings settings = kept_settings(1, SSDGS_ASG_DEFERRED),
                         published = ssdgs_settings_published();
    ssdgs_model *kept = ball(context, settings, COUNT), *edited = NULL;
    ssdgs_load_stats lost;
    const char *problem = NULL;
    memset(&lost, 0, sizeof lost);
    lost.untrained = 1;
    if (!CHECK(!ssdgs_model_create(context, &published, COUNT + 1, &edited))) exit(1);
    const ssdgs_model_view from = ssdgs_model_peek(kept), to = ssdgs_model_arrays(edited);
    for (size_t c = 0; c < SSDGS_CHANNELS; c++)
        for (size_t i = 0; i < COUNT; i++)
            to.gaussians[c * to.stride + i] = from.gaussians[c * from.stride + COUNT - 1 - i];
    CHECK(!adopt_model(context, &edited, &lost, kept, NULL, &problem) && !problem);
    const ssdgs_model_view back = ssdgs_model_peek(edited);
    CHECK(back.channels == SSDGS_CHANNELS + 12);
    for (size_t c = 0; c < (size_t)back.channels; c++)
        for (size_t i = 0; i < COUNT; i++)
            CHECK(!memcmp(back.gaussians + c * back.stride + i,
                          from.gaussians + c * from.stride + COUNT - 1 - i, sizeof *back.gaussians));
    for (size_t c = SSDGS_CHANNELS; c < (size_t)back.channels; c++)
        CHECK(fabs((double)back.gaussians[c * back.stride + COUNT] +
                   (c < SSDGS_CHANNELS + 3 ? 0.5 / unit : 0)) < 1e-6); /* black */
    ssdgs_model_destroy(edited);

    const ssdgs_model_view v = ssdgs_model_arrays(kept);
    for (size_t c = SSDGS_CHANNELS; c < (size_t)v.channels; c++)
        for (size_t i = 0; i < COUNT; i++) v.gaussians[c * v.stride + i] = (ssdgs_real)(0.01 * (double)c);
    CHECK(!reduce_model(context, &kept, COUNT / 2) && ssdgs_model_count(kept) == COUNT / 2);
    const ssdgs_model_view fewer = ssdgs_model_peek(kept);
    for (size_t c = SSDGS_CHANNELS; c < (size_t)fewer.channels; c++)
        for (size_t i = 0; i < COUNT / 2; i++)
            CHECK(fabs((double)fewer.gaussians[c * fewer.stride + i] - 0.01 * (double)c) < 1e-6);
    ssdgs_model_destroy(kept);
}

/* What a plain splat keeps when it is made to take light; linear colours are encoded. */
static void test_unbaked(ssdgs_context *context, int linear) {
    ssdgs_settings settings = plain_settings(1);
    ssdgs_model *nothing = ball(context, kept_settings(0, SSDGS_ASG_DEFERRED), 0);
    settings.transfer = linear ? SSDGS_TRANSFER_SRGB : SSDGS_TRANSFER_NONE;
    ssdgs_model *model = ball(context, settings, COUNT);
    ssdgs_model *lit = NULL;
    ssdgs_object objects[2] = {ssdgs_object_default(nothing), ssdgs_object_default(model)};
    unbake_options options = unbake_options_default();
    if (linear) { /* well above black, and changing little: the encoding is one of first order */
        const ssdgs_model_view v = ssdgs_model_arrays(model);
        for (size_t c = SSDGS_DIFFUSE; c < (size_t)v.channels; c++)
            for (size_t i = 0; i < COUNT; i++)
                v.gaussians[c * v.stride + i] *= (ssdgs_real)(c < SSDGS_HARMONICS ? 0.6 : 0.1);
    }
    draw(context, objects, 2, NULL, 0, NULL, SSDGS_ALL_TERMS, want);
    options.kept = 1;
    CHECK(!unbake_model(context, model, &options, &lit) && !ssdgs_model_settings(lit)->baked);
    objects[1] = ssdgs_object_default(lit);
    draw(context, objects + 1, 1, NULL, 0, NULL, SSDGS_ALL_TERMS, one);
    if (linear) CHECK_NEAR(one, want, PIXELS, 1e-3, 1e-3, "encoded colours");
    else CHECK(!memcmp(one, want, sizeof one));
    ssdgs_model_destroy(nothing);
    ssdgs_model_destroy(lit);
    ssdgs_model_destroy(model);
}

/* What is refused. */
static void test_refused(ssdgs_context *context) {
    ssdgs_model *model = ball(context, kept_settings(0, SSDGS_ASG_DEFERRED), 1), *none = NULL;
    const ssdgs_camera camera = camera_at(2, 1, 0.7);
    const double wrong[2] = {-0.5, 2e6};
    ssdgs_scene *scene = NULL;
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = one;
    CHECK(!ssdgs_scene_create(context, &scene));
    for (int i = 0; i < 2; i++) {
        ssdgs_object object = ssdgs_object_default(model);
        ssdgs_light light = lamp(1, 2, 2, 1);
        light.kept = (ssdgs_real)wrong[i];
        CHECK(ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, NULL, &image, NULL) ==
              SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(context), "light 0: kept = ") != NULL);
        light.kept = 0;
        object.kept = (ssdgs_real)wrong[i];
        CHECK(ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, NULL, &image, NULL) ==
              SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(context), "object 0: ") != NULL);
    }
    ssdgs_settings settings = kept_settings(0, 0);
    settings.kept = 0;
    settings.harmonics = 1; /* of what? */
    CHECK(ssdgs_model_create(context, &settings, 1, &none) == SSDGS_ERR_ARGUMENT && !none);
    CHECK(strstr(ssdgs_error_message(context), "harmonics = 1") != NULL);
    for (int i = 0; i < 2; i++) { /* too much; of what is baked already */
        settings.baked = i;
        settings.kept = (ssdgs_real)(i ? 0.5 : 1.5);
        CHECK(ssdgs_model_create(context, &settings, 1, &none) == SSDGS_ERR_ARGUMENT && !none);
        CHECK(strstr(ssdgs_error_message(context), i ? "kept = 0.5" : "kept = 1.5") != NULL);
    }
    unsigned char pixels[4 * 16 * 16];
    memset(pixels, 255, sizeof pixels);
    ssdgs_photo photo;
    ssdgs_trainer *trainer = NULL;
    memset(&photo, 0, sizeof photo);
    photo.camera = camera;
    photo.camera.width = photo.camera.height = 16;
    photo.light = lamp(1, 2, 2, 1);
    photo.pixels = pixels;
    CHECK(ssdgs_trainer_create(model, &photo, 1, NULL, &trainer) == SSDGS_ERR_ARGUMENT && !trainer);
    CHECK(strstr(ssdgs_error_message(context), "kept colours cannot be trained") != NULL);
    photo.light.kept = (ssdgs_real)0.5;
    const ssdgs_real black[3] = {0, 0, 0};
    CHECK(ssdgs_refine_photo(model, &photo, black, 1) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "share of kept colours") != NULL);
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(model);
}

int main(void) {
    ssdgs_context *context = test_context(2);
    for (int harmonics = 0; harmonics < 4; harmonics++) test_picture(context, harmonics);
    test_parts(context, SSDGS_ASG_GEOMETRIC);
    test_parts(context, SSDGS_ASG_DEFERRED);
    for (int i = 0; i < 4; i++) test_shares(context, i & 1, i & 2 ? SSDGS_ASG_DEFERRED : SSDGS_ASG_GEOMETRIC);
    for (int baked = 0; baked < 2; baked++) test_floor(context, baked);
    test_files(context, "build/kept.ply");
    test_edited(context);
    for (int linear = 0; linear < 2; linear++) test_unbaked(context, linear);
    test_refused(context);
    ssdgs_context_destroy(context);
    TEST_END();
}
