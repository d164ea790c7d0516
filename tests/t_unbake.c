/* Plain splats that take light: sides and albedos of bodies that are known, what is told, the same bits on
 * any threads. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/unbake.h"
#include "test.h"
#include <locale.h>

enum { BALL = 1500, SIDE = 30, PLATE = 2 * SIDE * SIDE };

static ssdgs_model *plain_model(ssdgs_context *context, int count) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    settings.baked = 1;
    settings.transfer = SSDGS_TRANSFER_NONE;
    if (!CHECK(!ssdgs_model_create(context, &settings, count, &model))) exit(1);
    return model;
}

/* The model that takes light in the place of the plain one. */
static void unbake(ssdgs_context *context, ssdgs_model **model, const unbake_options *options) {
    ssdgs_model *plain = *model;
    CHECK(!unbake_model(context, plain, options, model));
    ssdgs_model_destroy(plain);
}

/* A flat Gaussian of that normal and linear colour. */
static void put(ssdgs_model *model, int index, const double at[3], const double normal[3], double width,
                const double color[3]) {
    ssdgs_gaussian g = ssdgs_gaussian_default();
    const int turned = normal[2] < -0.999; /* z turned to the normal, or half a turn about x */
    g.rotation[0] = (ssdgs_real)(turned ? 0 : 1 + normal[2]);
    g.rotation[1] = (ssdgs_real)(turned ? 1 : -normal[1]);
    g.rotation[2] = (ssdgs_real)(turned ? 0 : normal[0]);
    g.rotation[3] = 0;
    g.opacity = (ssdgs_real)0.95;
    for (int c = 0; c < 3; c++) {
        g.position[c] = (ssdgs_real)at[c];
        g.scale[c] = (ssdgs_real)(c == 2 ? width / 20 : width);
        g.diffuse[c] = ssdgs_srgb_encode((ssdgs_real)color[c]);
    }
    CHECK(!ssdgs_model_set(model, index, &g));
}

/* A ball whose colours are an albedo under a sky of that irradiance: 0.5 of what comes, less what is from
 * below. */
static void put_ball(ssdgs_model *model, int first, double radius, const ssdgs_real ambient[9][3]) {
    for (int i = 0; i < BALL; i++) {
        const double z = 1 - (2 * i + 1.0) / BALL, across = sqrt(1 - z * z), turn = 2.39996323 * i;
        const double n[3] = {across * cos(turn), across * sin(turn), z};
        const double at[3] = {radius * n[0], radius * n[1], radius * n[2]};
        const double term[9] = {1,
                                n[1],
                                n[2],
                                n[0],
                                n[0] * n[1],
                                n[1] * n[2],
                                3 * z * z - 1,
                                n[0] * n[2],
                                n[0] * n[0] - n[1] * n[1]};
        double color[3];
        for (int c = 0; c < 3; c++) {
            double light = 0;
            for (int j = 0; j < 9; j++) light += term[j] * (double)ambient[j][c];
            color[c] = 0.4 * light / 3.14159265358979;
        }
        put(model, first + i, at, n, 2.2 * radius / sqrt((double)BALL), color);
    }
}

static const ssdgs_real even_sky[9][3] = {{2, 2, 2}};
static const ssdgs_real colored_sky[9][3] = {{2, 2, 2},
                                             {0, (ssdgs_real)0.2, (ssdgs_real)0.4},
                                             {(ssdgs_real)0.6, (ssdgs_real)0.5, (ssdgs_real)0.4},
                                             {(ssdgs_real)0.4, 0, (ssdgs_real)-0.3},
                                             {(ssdgs_real)0.3, (ssdgs_real)-0.3, 0},
                                             {0, (ssdgs_real)0.3, (ssdgs_real)-0.3},
                                             {(ssdgs_real)-0.1, 0, (ssdgs_real)0.1},
                                             {0, (ssdgs_real)-0.3, (ssdgs_real)0.3},
                                             {(ssdgs_real)0.2, (ssdgs_real)-0.2, (ssdgs_real)0.2}};

/* The mean and the largest deviation of albedos, and how many normals are within 20 degrees of outward. */
static int albedos(const ssdgs_model *model, int first, double mean[3], double *off) {
    int right = 0;
    memset(mean, 0, 3 * sizeof *mean);
    *off = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = first; i < first + BALL; i++) {
            ssdgs_gaussian g;
            double along = 0, length = 0;
            CHECK(!ssdgs_model_get(model, i, &g));
            for (int c = 0; c < 3; c++) {
                along += (double)(g.normal[c] * g.position[c]);
                length += (double)(g.position[c] * g.position[c]);
                if (!pass) mean[c] += (double)g.diffuse[c] / BALL;
                else *off = fmax(*off, fabs((double)g.diffuse[c] / mean[c] - 1));
            }
            right += !pass && along > 0.94 * sqrt(length);
        }
    return right;
}

static void test_ball(int threads, ssdgs_real *normals) {
    ssdgs_context *context = test_context(threads);
    ssdgs_model *model = plain_model(context, BALL);
    unbake_options options = unbake_options_default();
    double mean[3], off;
    put_ball(model, 0, 0.4, even_sky);
    const ssdgs_model_view before = ssdgs_model_peek(model);
    ssdgs_real *planes = (ssdgs_real *)malloc(SSDGS_DIFFUSE * BALL * sizeof *planes);
    if (!CHECK(planes != NULL)) exit(1);
    for (size_t c = 0; c < SSDGS_DIFFUSE; c++)
        memcpy(planes + c * BALL, before.gaussians + c * before.stride, BALL * sizeof *planes);
    memcpy(options.ambient, even_sky, sizeof even_sky);
    unbake(context, &model, &options);
    CHECK(ssdgs_model_count(model) == BALL && !ssdgs_model_settings(model)->baked);
    CHECK(ssdgs_model_settings(model)->terms == (SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM));
    const ssdgs_model_view after = ssdgs_model_peek(model);
    for (size_t c = 0; c < SSDGS_DIFFUSE; c++)
        CHECK(!memcmp(planes + c * BALL, after.gaussians + c * after.stride, BALL * sizeof *planes));
    CHECK(albedos(model, 0, mean, &off) == BALL);
    printf("figure unbake_ball_albedo %.3f %.3f\n", mean[0], off);
    for (int c = 0; c < 3; c++) CHECK(fabs(mean[c] - 0.4) < 0.03);
    CHECK(off < 0.05);
    for (size_t i = 0; i < BALL; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, (int)i, &g));
        memcpy(normals + 6 * i, g.normal, sizeof g.normal);
        memcpy(normals + 6 * i + 3, g.diffuse, sizeof g.diffuse);
    }
    free(planes);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

static void test_same_bits(void) {
    static ssdgs_real one[6 * BALL], three[6 * BALL];
    test_ball(1, one);
    test_ball(3, three);
    CHECK(!memcmp(one, three, sizeof one));
}

/* A sky that is told leaves no colour in the albedo; one that is not told does. */
static void test_told(void) {
    for (int told = 0; told < 2; told++) {
        ssdgs_context *context = test_context(2);
        ssdgs_model *model = plain_model(context, BALL);
        unbake_options options = unbake_options_default();
        double mean[3], off;
        put_ball(model, 0, 0.4, colored_sky);
        if (told) memcpy(options.ambient, colored_sky, sizeof colored_sky);
        unbake(context, &model, &options);
        CHECK(albedos(model, 0, mean, &off) == BALL);
        printf("figure unbake_told_%d %.3f %.3f\n", told, mean[0], off);
        if (told) CHECK(off < 0.05);
        else CHECK(off > 0.3);
        CHECK(told || fmax(mean[0], fmax(mean[1], mean[2])) < 0.9);
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
}

/* Two layers of a plate look down into the open, and up to the ball that stands on them: both are turned up.
 */
static void test_plate(void) {
    static const double up[3] = {0, 0, 1}, down[3] = {0, 0, -1}, grey[3] = {0.1, 0.1, 0.1};
    ssdgs_context *context = test_context(2);
    ssdgs_model *model = plain_model(context, BALL + PLATE);
    double mean[3], off;
    int right = 0;
    put_ball(model, 0, 0.2, even_sky);
    for (int i = 0; i < PLATE; i++) {
        const double at[3] = {1.0 * (i % SIDE) / SIDE - 0.5, 1.0 * (i / SIDE % SIDE) / SIDE - 0.5,
                              i < PLATE / 2 ? -0.21 : -0.23};
        put(model, BALL + i, at, i % 2 ? up : down, 0.6 / SIDE, grey);
    }
    unbake(context, &model, NULL);
    for (int i = BALL; i < BALL + PLATE; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        right += g.normal[2] > (ssdgs_real)0.9;
    }
    printf("figure unbake_plate_up %.3f\n", 1.0 * right / PLATE);
    CHECK(right > 0.95 * PLATE);
    CHECK(albedos(model, 0, mean, &off) > 0.9 * BALL);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* A ball on a floor of one layer, whichever way is up: the floor is lit from the ball's side, and both have
   their albedos, 0.3 and 0.6, but for a factor. */
static void test_floor(void) {
    static const double ups[6][3] = {
        {0, 0, 1},         {0, -1, 0},
        {0, 1, 0},         {-0.48, 0.6, -0.64},
        {0.8, 0.36, 0.48}, {0.1056, 0.191, -0.9759}}; /* as far as can be from those of the sky */
    static const double floor_color[3] = {0.6, 0.6, 0.6};
    ssdgs_context *context = test_context(2);
    for (int turn = 0; turn < 6; turn++) {
        const double *up = ups[turn];
        ssdgs_model *model = plain_model(context, BALL + SIDE * SIDE);
        double mean[3], off, floor_albedo = 0, side[3], across[3], length = 0;
        int right = 0;
        for (int c = 0; c < 3; c++) side[c] = (fabs(up[c]) < 0.5) - up[c] * 0.4, length += side[c] * up[c];
        for (int c = 0; c < 3; c++) side[c] -= length * up[c];
        length = sqrt(side[0] * side[0] + side[1] * side[1] + side[2] * side[2]);
        for (int c = 0; c < 3; c++) side[c] /= length;
        for (int c = 0; c < 3; c++)
            across[c] = up[(c + 1) % 3] * side[(c + 2) % 3] - up[(c + 2) % 3] * side[(c + 1) % 3];
        for (int i = 0; i < BALL; i++) {
            const double z = 1 - (2 * i + 1.0) / BALL, r = sqrt(1 - z * z), angle = 2.39996323 * i;
            double n[3], at[3], color[3];
            for (int c = 0; c < 3; c++)
                n[c] = r * cos(angle) * side[c] + r * sin(angle) * across[c] + z * up[c];
            for (int c = 0; c < 3; c++) at[c] = 0.2 * n[c], color[c] = 0.3 * (0.5 + 0.5 * z);
            put(model, i, at, n, 0.44 / sqrt((double)BALL), color);
        }
        for (int i = 0; i < SIDE * SIDE; i++) {
            const double x = 1.4 * (i % SIDE + 0.5) / SIDE - 0.7, y = 1.4 * (i / SIDE + 0.5) / SIDE - 0.7;
            double at[3];
            for (int c = 0; c < 3; c++) at[c] = x * side[c] + y * across[c] - 0.21 * up[c];
            put(model, BALL + i, at, up, 0.9 / SIDE, floor_color);
        }
        unbake(context, &model, NULL);
        for (int i = BALL; i < BALL + SIDE * SIDE; i++) {
            ssdgs_gaussian g;
            double along = 0;
            CHECK(!ssdgs_model_get(model, i, &g));
            for (int c = 0; c < 3; c++) along += up[c] * (double)g.normal[c];
            right += along > 0.9;
            floor_albedo += (double)g.diffuse[0] / (SIDE * SIDE);
        }
        albedos(model, 0, mean, &off);
        printf("figure unbake_floor_%d %.3f %.3f\n", turn, floor_albedo, mean[0]);
        CHECK(right > 0.98 * SIDE * SIDE);
        CHECK(floor_albedo > 0.5 && floor_albedo < 0.91);
        CHECK(mean[0] > 0.3 * floor_albedo && mean[0] < 0.65 * floor_albedo);
        ssdgs_model_destroy(model);
    }
    ssdgs_context_destroy(context);
}

/* A floor with a thin pole on it and a ball under it: it looks flatter from the pole's side, but most of what
   there is stands there, so that side is up. */
static void test_pole(void) {
    static const double up[3] = {0, 0, 1}, grey[3] = {0.3, 0.3, 0.3};
    ssdgs_context *context = test_context(2);
    ssdgs_model *model = plain_model(context, BALL + SIDE * SIDE);
    int right = 0;
    for (int i = 0; i < BALL; i++) {
        const double share = (i / 2 + 0.5) / (BALL / 2), angle = 2.39996323 * i, z = 1 - 2 * share;
        const double r = i % 2 ? sqrt(1 - z * z) : 1, n[3] = {r * cos(angle), r * sin(angle), i % 2 ? z : 0};
        const double size = i % 2 ? 0.2 : 0.06,
                     at[3] = {size * n[0], size * n[1], i % 2 ? -0.5 + 0.2 * z : 2.2 * share};
        put(model, i, at, n, i % 2 ? 0.016 : 0.021, grey);
    }
    for (int i = 0; i < SIDE * SIDE; i++) {
        const double at[3] = {1.4 * (i % SIDE + 0.5) / SIDE - 0.7, 1.4 * (i / SIDE + 0.5) / SIDE - 0.7, 0};
        put(model, BALL + i, at, up, 0.9 / SIDE, grey);
    }
    unbake(context, &model, NULL);
    for (int i = BALL; i < BALL + SIDE * SIDE; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        right += g.normal[2] > (ssdgs_real)0.9;
    }
    CHECK(right > 0.95 * SIDE * SIDE);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* A ball of two colours: they do not run into each other. The white of what is not told is 0.9. */
static void test_hues(void) {
    static const double hue[2][3] = {{0.3, 0.02, 0.02}, {0.02, 0.02, 0.3}};
    ssdgs_context *context = test_context(2);
    ssdgs_model *model = plain_model(context, BALL);
    double least = 1;
    put_ball(model, 0, 0.4, even_sky);
    for (int i = 0; i < BALL; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        for (int c = 0; c < 3; c++) g.diffuse[c] = ssdgs_srgb_encode((ssdgs_real)hue[i < BALL / 2][c]);
        CHECK(!ssdgs_model_set(model, i, &g));
    }
    unbake(context, &model, NULL);
    for (int i = 0; i < BALL; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        const int blue = i < BALL / 2 ? 0 : 2;
        least = fmin(least, (double)g.diffuse[2 - blue]);
        CHECK((double)g.diffuse[blue] < 0.12);
    }
    printf("figure unbake_hues_least %.3f\n", least);
    CHECK(least > 0.8);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* Half of the sky that the open sees gives half of the light, and a twentieth at least. */
static void test_share(void) {
    const unbake_options options = unbake_options_default();
    unbake__splat splat[3];
    float albedo[9];
    unbake__state u;
    memset(&u, 0, sizeof u);
    memset(splat, 0, sizeof splat);
    u.options = &options;
    u.count = 3;
    u.most = 0.4;
    u.splat = splat;
    u.albedo = albedo;
    for (int i = 0; i < 3; i++) {
        splat[i].normal[2] = 1;
        splat[i].share = i ? i == 1 ? 0.2f : 0.001f : 0.5f;
        splat[i].color[1] = 0.1f;
    }
    unbake__albedo_task(&u, 0);
    for (int i = 0; i < 3; i++) {
        const double light = i ? i == 1 ? 0.5 : 0.05 : 1;
        CHECK(fabs((double)albedo[3 * i + 1] * light - 0.1 * 3.14159265) < 1e-5 && albedo[3 * i] == 0);
    }
}

/* The tree finds the nearest, also where many lie in one place. */
static void test_nearest(void) {
    static unbake__splat splat[BALL];
    static uint32_t tree[BALL], who[UNBAKE__NEAR];
    static unsigned char across[BALL];
    unbake__state u;
    memset(&u, 0, sizeof u);
    u.count = BALL;
    u.splat = splat;
    u.tree = tree;
    u.across = across;
    for (int i = 0; i < BALL; i++) {
        tree[i] = (uint32_t)i;
        for (int c = 0; c < 3; c++)
            splat[i].position[c] = i % 5 ? (float)test_uniform(7, (uint64_t)(3 * i + c)) : 0.5f;
    }
    unbake__cut(&u, 0, BALL);
    for (int i = 0; i < BALL; i++) {
        unbake__near found;
        int closer = 0;
        found.at = splat[i].position;
        found.who = who;
        found.count = 0;
        unbake__search(&u, 0, BALL, &found);
        if (!CHECK(found.count == UNBAKE__NEAR)) continue;
        for (int j = 0; j < BALL; j++) {
            float d2 = 0;
            for (int c = 0; c < 3; c++) {
                const float d = splat[j].position[c] - splat[i].position[c];
                d2 += d * d;
            }
            closer += d2 < found.distance2[UNBAKE__NEAR - 1];
        }
        CHECK(closer < UNBAKE__NEAR);
    }
}

/* Half a ball that is closed below stands on nothing: its bottom looks down. */
static void test_bottom(void) {
    static const double down[3] = {0, 0, -1}, grey[3] = {0.2, 0.2, 0.2};
    ssdgs_context *context = test_context(2);
    ssdgs_model *model = plain_model(context, BALL);
    int right = 0;
    put_ball(model, 0, 0.4, even_sky);
    for (int i = BALL / 2; i < BALL; i++) { /* the lower half becomes a disk */
        const double from = 0.4 * sqrt((i - BALL / 2 + 0.5) / (BALL / 2)), turn = 2.39996323 * i;
        const double at[3] = {from * cos(turn), from * sin(turn), 0};
        put(model, i, at, down, 0.022, grey);
    }
    unbake(context, &model, NULL);
    for (int i = BALL / 2; i < BALL; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        right += g.normal[2] < (ssdgs_real)-0.9;
    }
    printf("figure unbake_bottom_down %.3f\n", 2.0 * right / BALL);
    CHECK(right > 0.98 * (BALL / 2));
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* Light from the eye's side comes back from the ball's middle as albedo / pi; without light it is black. A
   plain splat may hold linear colours, too: the albedos are the same. */
static void test_lit(void) {
    enum { WIDE = 33, MIDDLE = WIDE * WIDE / 2 };
    static ssdgs_real picture[3 * WIDE * WIDE], alpha[WIDE * WIDE];
    static const ssdgs_real eye[3] = {0, -3, 0}, middle[3] = {0, 0, 0}, up[3] = {0, 0, 1},
                            away[3] = {0, 1, 0}, white[3] = {3, 3, 3};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, middle, up, (ssdgs_real)0.4, WIDE, WIDE);
    const ssdgs_light light = ssdgs_light_directional(away, white);
    ssdgs_context *context = test_context(2);
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = picture;
    image.alpha = alpha;
    for (int linear = 0; linear < 2; linear++) {
        ssdgs_model *model = plain_model(context, BALL);
        put_ball(model, 0, 0.4, even_sky);
        if (linear) {
            ssdgs_settings settings = *ssdgs_model_settings(model);
            ssdgs_model *stored = model;
            settings.transfer = SSDGS_TRANSFER_SRGB;
            CHECK(!ssdgs_model_create(context, &settings, BALL, &model));
            for (int i = 0; i < BALL; i++) {
                ssdgs_gaussian g;
                CHECK(!ssdgs_model_get(stored, i, &g));
                for (int c = 0; c < 3; c++) g.diffuse[c] = ssdgs_srgb_decode(g.diffuse[c]);
                CHECK(!ssdgs_model_set(model, i, &g));
            }
            ssdgs_model_destroy(stored);
        }
        unbake_options options = unbake_options_default();
        memcpy(options.ambient, even_sky, sizeof even_sky);
        unbake(context, &model, &options);
        CHECK(!ssdgs_render(model, &camera, &light, 1, &image));
        const double back = (double)(picture[3 * MIDDLE] / alpha[MIDDLE]) * 3.14159265 / 3;
        printf("figure unbake_lit_%d %.3f\n", linear, back);
        CHECK(fabs(back - 0.4) < 0.04);
        CHECK(!ssdgs_render(model, &camera, NULL, 0, &image));
        for (int i = 0; i < 3 * WIDE * WIDE; i++) CHECK(picture[i] == 0);
        ssdgs_model_destroy(model);
    }
    ssdgs_context_destroy(context);
}

/* Wax, gloss; nothing, one Gaussian, one that is not finite; a model that is not plain. */
static void test_edges(void) {
    ssdgs_context *context = test_context(2);
    unbake_options options = unbake_options_default();
    ssdgs_gaussian g;
    ssdgs_model *model = plain_model(context, BALL);
    put_ball(model, 0, 0.4, even_sky);
    for (int c = 0; c < 3; c++) options.scattering[c] = 20, options.absorption[c] = (ssdgs_real)(c + 1);
    options.roughness = (ssdgs_real)0.3;
    unbake(context, &model, &options);
    const ssdgs_settings *settings = ssdgs_model_settings(model);
    CHECK(settings->terms == SSDGS_ALL_TERMS && settings->transport && !settings->scattering.layers);
    CHECK(settings->medium.scattering[2] > 19 && settings->medium.absorption[2] > 2);
    CHECK(!ssdgs_model_get(model, 0, &g));
    CHECK(fabs((double)g.diffuse[0] - 0.45) < 0.02 && fabs((double)g.scattering[0] - 0.45) < 0.02);
    CHECK(g.specular[0] > 0 && fabs((double)g.f0 - 0.04) < 1e-4);
    CHECK(fabs((double)g.sharpness[0] - 1 / 0.09) < 1e-3);
    ssdgs_model *lit = model;
    CHECK(unbake_model(context, model, NULL, &lit) == SSDGS_ERR_ARGUMENT && !lit);
    CHECK(strstr(ssdgs_error_message(context), "plain is not baked") != NULL);
    ssdgs_model_destroy(model);
    CHECK(unbake_model(context, NULL, NULL, &lit) == SSDGS_ERR_ARGUMENT && !lit);
    CHECK(strstr(ssdgs_error_message(context), "plain is NULL") != NULL);

    for (int count = 0; count < 2; count++) {
        model = plain_model(context, count);
        unbake(context, &model, NULL);
        CHECK(ssdgs_model_count(model) == count && !ssdgs_model_settings(model)->baked);
        ssdgs_model_destroy(model);
    }
    model = plain_model(context, BALL);
    put_ball(model, 0, 0.4, even_sky);
    ssdgs_model_view view = ssdgs_model_arrays(model);
    view.gaussians[SSDGS_POSITION * view.stride + 7] = (ssdgs_real)NAN;
    view.gaussians[SSDGS_DIFFUSE * view.stride + 8] = (ssdgs_real)INFINITY;
    view.gaussians[SSDGS_ROTATION * view.stride + 9] = (ssdgs_real)NAN;
    unbake(context, &model, NULL);
    view = ssdgs_model_peek(model);
    for (size_t c = SSDGS_DIFFUSE; c < SSDGS_CHANNELS; c++)
        for (size_t i = 0; i < BALL; i++)
            CHECK(view.gaussians[c * view.stride + i] - view.gaussians[c * view.stride + i] == 0);
    ssdgs_model_destroy(model);

    model = plain_model(context, 3);
    lit = model;
    static const ssdgs_real eye[1][3] = {{0, (ssdgs_real)NAN, 0}};
    setlocale(LC_ALL, "de_DE.UTF-8"); /* where there is one, it writes 2,5 */
    for (int wrong = 0; wrong < 13; wrong++) {
        static const char *const says[13] = {"roughness is neither 0 nor 0.01 .. 1: 2.5",
                                             "roughness is neither 0 nor 0.01 .. 1: -1",
                                             "roughness is neither 0 nor 0.01 .. 1: nan",
                                             "f0 is not above 0, up to 1: 2",
                                             "f0 is not above 0, up to 1: nan",
                                             "ambient is not finite, or its mean is negative: nan",
                                             "or its mean is negative: -5",
                                             "ambient is not finite, or its mean is negative: inf",
                                             "a place of eyes is not finite or too far",
                                             "eyes is NULL, eye_count 1",
                                             "eye_count is not 0 .. 32: 33",
                                             "kept",
                                             "scattering or absorption is not 0 .. 1e18: -1"};
        options = unbake_options_default();
        if (wrong < 3) options.roughness = (ssdgs_real)(wrong == 0 ? 2.5 : wrong == 1 ? -1 : (double)NAN);
        if (wrong == 3 || wrong == 4) options.f0 = (ssdgs_real)(wrong == 3 ? 2 : NAN);
        if (wrong == 5) options.ambient[8][1] = (ssdgs_real)NAN;
        if (wrong == 6) options.ambient[0][2] = -5;
        if (wrong == 7) options.ambient[0][0] = (ssdgs_real)INFINITY;
        if (wrong == 8) options.eyes = eye;
        if (wrong == 8 || wrong == 9) options.eye_count = 1;
        if (wrong == 10) options.eye_count = 33;
        if (wrong == 11) options.kept = (ssdgs_real)NAN;
        if (wrong == 12) options.scattering[1] = -1;
        lit = model;
        CHECK(unbake_model(context, model, &options, &lit) == SSDGS_ERR_ARGUMENT && !lit);
        if (!CHECK(strstr(ssdgs_error_message(context), says[wrong])))
            printf("    %d: %s\n", wrong, ssdgs_error_message(context));
    }
    setlocale(LC_ALL, "C");
    options = unbake_options_default();
    options.ambient[0][0] = options.ambient[0][1] = options.ambient[0][2] = (ssdgs_real)1e-30;
    CHECK(unbake_model(context, model, &options, &lit) &&
          strstr(ssdgs_error_message(context), "make an albedo"));
    view = ssdgs_model_arrays(model);
    view.gaussians[SSDGS_POSITION * view.stride] = (ssdgs_real)1e16;
    CHECK(unbake_model(context, model, NULL, &lit) == SSDGS_ERR_ARGUMENT && !lit);
    CHECK(strstr(ssdgs_error_message(context), "does a Gaussian stray") != NULL);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* A room, seen from two places in it: its walls face them, and are lit alike. */
static void test_room(void) {
    enum { WALL = 20, ROOM = 6 * WALL * WALL };
    static const ssdgs_real eyes[2][3] = {{(ssdgs_real)0.3, (ssdgs_real)-0.2, (ssdgs_real)0.1},
                                          {(ssdgs_real)-0.5, (ssdgs_real)0.4, (ssdgs_real)-0.3}};
    ssdgs_context *context = test_context(2);
    static const int hues[6] = {1, 2, 4, 3, 5, 6};
    ssdgs_model *model = plain_model(context, ROOM), *lit = NULL;
    double first = 0;
    unbake_options options = unbake_options_default();
    for (int i = 0; i < ROOM; i++) {
        const int wall = i / (WALL * WALL), axis = wall / 2, side = wall % 2 ? 1 : -1;
        double at[3], normal[3] = {0, 0, 0}, color[3];
        at[axis] = side;
        at[(axis + 1) % 3] = (i % WALL + 0.5) * 2 / WALL - 1;
        at[(axis + 2) % 3] = (i / WALL % WALL + 0.5) * 2 / WALL - 1;
        normal[axis] = i % 2 ? 1 : -1; /* of either sign */
        for (int c = 0; c < 3; c++) color[c] = 0.1 * (wall + 1) * (hues[wall] >> c & 1 ? 1 : 0.3);
        put(model, i, at, normal, 2.0 / WALL, color);
    }
    options.eyes = eyes;
    options.eye_count = 2;
    CHECK(!unbake_model(context, model, &options, &lit));
    for (int i = 0; i < ROOM; i++) {
        const int wall = i / (WALL * WALL), axis = wall / 2, side = wall % 2 ? 1 : -1;
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(lit, i, &g));
        CHECK(-side * (double)g.normal[axis] > 0.9);
        const double scale = (double)g.diffuse[0] / (0.1 * (wall + 1) * (hues[wall] & 1 ? 1 : 0.3));
        if (!i) first = scale;
        if (wall < 5) CHECK(fabs(scale / first - 1) < 0.03); /* the brightest is limited */
    }
    ssdgs_model_destroy(lit);
    ssdgs_model_destroy(model);
    /* two sides of a wall, each seen from one place */
    static const ssdgs_real beside[2][3] = {{(ssdgs_real)0.7, 0, 0}, {(ssdgs_real)-0.7, 0, 0}};
    model = plain_model(context, 2 * WALL * WALL);
    for (int i = 0; i < 2 * WALL * WALL; i++) {
        const double side = i < WALL * WALL ? 1 : -1, normal[3] = {i % 2 ? 1.0 : -1.0, 0, 0},
                     color[3] = {0.5, 0.5, 0.5};
        const double at[3] = {0.1 * side, (i % WALL + 0.5) * 2 / WALL - 1,
                              (i / WALL % WALL + 0.5) * 2 / WALL - 1};
        put(model, i, at, normal, 2.0 / WALL, color);
    }
    options.eyes = beside;
    CHECK(!unbake_model(context, model, &options, &lit));
    for (int i = 0; i < 2 * WALL * WALL; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(lit, i, &g));
        CHECK((i < WALL * WALL ? 1 : -1) * (double)g.normal[0] > 0.9);
    }
    ssdgs_model_destroy(lit);
    options.eye_count = 33;
    CHECK(unbake_model(context, model, &options, &lit) == SSDGS_ERR_ARGUMENT && !lit);
    options.eye_count = -1;
    CHECK(unbake_model(context, model, &options, &lit) == SSDGS_ERR_ARGUMENT && !lit);
    options.eye_count = 1;
    options.eyes = NULL;
    CHECK(unbake_model(context, model, &options, &lit) == SSDGS_ERR_ARGUMENT && !lit);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

int main(void) {
    test_same_bits();
    test_room();
    test_told();
    test_plate();
    test_floor();
    test_pole();
    test_lit();
    test_hues();
    test_bottom();
    test_share();
    test_nearest();
    test_edges();
    TEST_END();
}
