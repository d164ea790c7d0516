/* Levels of detail: merging keeps mass, place and spread, finds twins, takes what is hidden first, and looks
   like the whole. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/reduce.h"
#include "test.h"

enum { SIDE = 96, PIXELS = SIDE * SIDE };

static double draw(uint64_t counter) { return test_uniform(91, counter); }

static ssdgs_model *new_model(ssdgs_context *context, const ssdgs_settings *settings, int count) {
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, settings, count, &model))) exit(1);
    return model;
}

static void set(ssdgs_model *model, int index, const ssdgs_gaussian *g) {
    CHECK(!ssdgs_model_set(model, index, g));
}

/* Somewhere in the box, of any shape and colour. */
static ssdgs_gaussian any(int index) {
    const uint64_t at = 64 * (uint64_t)index;
    ssdgs_gaussian g = ssdgs_gaussian_default();
    for (int c = 0; c < 4; c++) g.rotation[c] = (ssdgs_real)(2 * draw(at + (uint64_t)c) - 1);
    for (int c = 0; c < 3; c++) {
        g.position[c] = (ssdgs_real)(draw(at + 8 + (uint64_t)c) - 0.5);
        g.scale[c] = (ssdgs_real)(0.005 + 0.03 * draw(at + 16 + (uint64_t)c));
        g.normal[c] = (ssdgs_real)(2 * draw(at + 24 + (uint64_t)c) - 1);
        g.diffuse[c] = (ssdgs_real)draw(at + 32 + (uint64_t)c);
        g.specular[c] = (ssdgs_real)draw(at + 40 + (uint64_t)c);
        g.scattering[c] = (ssdgs_real)draw(at + 48 + (uint64_t)c);
        g.material[c] = (ssdgs_real)draw(at + 56 + (uint64_t)c);
    }
    g.opacity = (ssdgs_real)(0.05 + 0.2 * draw(at + 60));
    g.sharpness[0] = (ssdgs_real)(1 + draw(at + 61));
    g.f0 = (ssdgs_real)(0.02 + 0.1 * draw(at + 62));
    g.softness = (ssdgs_real)(0.2 + 0.5 * draw(at + 63));
    return g;
}

/* Their mass, opacity x area, its first and its second moments: 1 + 3 + 6. */
static void moments(const ssdgs_model *model, int count, double sum[10]) {
    memset(sum, 0, 10 * sizeof *sum);
    for (int i = 0; i < count; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        const double w = (double)g.rotation[0], x = (double)g.rotation[1], y = (double)g.rotation[2],
                     z = (double)g.rotation[3];
        const double axis[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                                   {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                                   {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
        const double s[3] = {(double)g.scale[0], (double)g.scale[1], (double)g.scale[2]};
        const double mass = (double)g.opacity * (s[0] * s[1] + s[1] * s[2] + s[2] * s[0]);
        int at = 4;
        sum[0] += mass;
        for (int a = 0; a < 3; a++) {
            sum[1 + a] += mass * (double)g.position[a];
            for (int b = a; b < 3; b++, at++) {
                sum[at] += mass * (double)g.position[a] * (double)g.position[b];
                for (int c = 0; c < 3; c++) sum[at] += mass * axis[c][a] * axis[c][b] * s[c] * s[c];
            }
        }
    }
}

static void test_moments(void) {
    ssdgs_context *context = test_context(1);
    ssdgs_model *model = new_model(context, NULL, 600);
    double before[10], after[10];
    for (int i = 0; i < 600; i++) {
        const ssdgs_gaussian g = any(i);
        set(model, i, &g);
    }
    moments(model, 600, before);
    for (int count = 599; count > 100; count -= 149) {
        CHECK(!reduce_model(context, &model, count));
        CHECK(ssdgs_model_arrays(model).count == count);
        moments(model, count, after);
        CHECK_NEAR(after, before, 10, 0.01 * before[0], 0.01, "mass, place and spread stay");
    }
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* Each of two halves of one, at the same place, becomes that one again, however their quaternions are signed.
 */
static void test_twins(void) {
    enum { N = 200 };
    ssdgs_context *context = test_context(1);
    ssdgs_model *model = new_model(context, NULL, 2 * N);
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    int whole = 0, turned = 0;
    for (int i = 0; i < N; i++) {
        ssdgs_gaussian g = any(i);
        for (int c = 0; c < 3; c++)
            g.position[c] = (ssdgs_real)((i / (c == 0 ? 1 : c == 1 ? 6 : 36)) % 6 - 2.5); /* far apart */
        g.opacity /= 2;
        set(model, i, &g);
        for (int c = 0; c < 3; c++) g.normal[c] += (ssdgs_real)(0.1 * draw((uint64_t)(1000 * i + c)));
        set(model, 2 * N - 1 - i, &g); /* with about its normal */
        for (size_t c = 0; c < 4; c++) /* as much of a rotation as before */
            v.gaussians[(SSDGS_FRAME + c) * v.stride + (size_t)i] *= -3;
    }
    CHECK(!reduce_model(context, &model, N));
    for (int i = 0; i < N; i++) {
        double worst = 0;
        ssdgs_gaussian got;
        CHECK(!ssdgs_model_get(model, i, &got));
        int j = 0, step = 1;
        for (int c = 0; c < 3; c++, step *= 6) j += step * (int)floor((double)got.position[c] + 3);
        const ssdgs_gaussian want = any(j);
        ssdgs_real length = 0;
        for (int c = 0; c < 3; c++) length += want.normal[c] * want.normal[c];
        length = (ssdgs_real)sqrt((double)length);
        for (int c = 0; c < 3; c++) {
            const ssdgs_real pairs[5][2] = {{got.diffuse[c], want.diffuse[c]},
                                            {got.specular[c], want.specular[c]},
                                            {got.scattering[c], want.scattering[c]},
                                            {got.opacity, want.opacity},
                                            {got.material[c], want.material[c]}};
            for (int k = 0; k < 5; k++) {
                const double error = fabs((double)(pairs[k][0] - pairs[k][1]));
                worst = error <= worst ? worst : error;
            }
        }
        const double others[3] = {(double)(got.sharpness[0] / want.sharpness[0]), (double)(got.f0 / want.f0),
                                  (double)(got.softness / want.softness)};
        for (int k = 0; k < 3; k++) worst = fabs(others[k] - 1) <= worst ? worst : fabs(others[k] - 1);
        ssdgs_real a = got.scale[0] * got.scale[1] * got.scale[2],
                   b = want.scale[0] * want.scale[1] * want.scale[2];
        worst = fabs((double)(a / b) - 1) <= worst ? worst : fabs((double)(a / b) - 1);
        double along = 0;
        for (int c = 0; c < 3; c++) along += (double)got.normal[c] * (double)want.normal[c] / (double)length;
        whole += worst < 1e-3 && along > 0.9;
        turned += fabs((double)got.rotation[1]) > 0.01;
    }
    if (!CHECK(whole >= 9 * N / 10)) printf("    %d of %d\n", whole, N);
    CHECK(turned > N / 2);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* Inside of a closed shell is nothing that one would miss. */
static void test_hidden(int baked) {
    enum { SHELL = 400, INSIDE = 200 };
    ssdgs_context *context = test_context(1);
    ssdgs_settings settings = ssdgs_settings_default();
    settings.baked = baked;
    ssdgs_model *model = new_model(context, &settings, SHELL + INSIDE);
    int outside = 0, untouched = 0;
    for (int i = 0; i < SHELL + INSIDE; i++) {
        const int n = i < SHELL ? SHELL : INSIDE, k = i < SHELL ? i : i - SHELL;
        const double z = 1 - (2 * k + 1.0) / n, r = sqrt(1 - z * z), radius = i < SHELL ? 0.5 : 0.2;
        ssdgs_gaussian g = ssdgs_gaussian_default();
        g.position[0] = (ssdgs_real)(radius * r * cos(2.4 * k));
        g.position[1] = (ssdgs_real)(radius * r * sin(2.4 * k));
        g.position[2] = (ssdgs_real)(radius * z);
        for (int c = 0; c < 3; c++) g.scale[c] = (ssdgs_real)(i < SHELL ? 0.08 : 0.02);
        g.opacity = (ssdgs_real)0.99;
        set(model, i, &g);
    }
    CHECK(!reduce_model(context, &model, SHELL + INSIDE / 4));
    for (int i = 0; i < SHELL + INSIDE / 4; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        double r2 = 0;
        for (int c = 0; c < 3; c++) r2 += (double)g.position[c] * (double)g.position[c];
        outside += r2 > 0.16;
        untouched += r2 > 0.16 && fabs((double)g.scale[0] - 0.08) < 1e-3;
    }
    if (!CHECK(outside == SHELL && untouched == SHELL))
        printf("    %d, %d as they were\n", outside, untouched);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* A sphere's shell of flat Gaussians with smooth stripes; of `step` at a time one. */
static ssdgs_model *striped(ssdgs_context *context, int count, int step, int terms) {
    ssdgs_settings settings = ssdgs_settings_default();
    settings.terms = terms & SSDGS_ALL_TERMS;
    settings.baked = !terms;
    settings.light_map.bias = (ssdgs_real)0.3; /* no Gaussian shadows its neighbours */
    ssdgs_model *model = new_model(context, &settings, count / step);
    for (int i = 0; i < count; i += step) {
        const double z = 1 - (2 * i + 1.0) / count, r = sqrt(1 - z * z);
        ssdgs_gaussian g = ssdgs_gaussian_default();
        const double at[3] = {r * cos(2.39996323 * i), r * sin(2.39996323 * i), z};
        for (int c = 0; c < 3; c++) {
            g.normal[c] = (ssdgs_real)at[c];
            g.position[c] = (ssdgs_real)(0.5 * at[c]);
            g.scale[c] = (ssdgs_real)(c < 2 ? 1.2 / sqrt((double)count) : 0.002);
            g.diffuse[c] = (ssdgs_real)(0.5 + 0.4 * sin(6 * at[c] + c));
            g.specular[c] = (ssdgs_real)0.1;
            g.scattering[c] = (ssdgs_real)0.2;
            g.rotation[c] = 0;
        }
        g.rotation[3] = 0; /* across the normal */
        g.opacity = (ssdgs_real)0.7;
        set(model, i / step, &g);
    }
    CHECK(!ssdgs_model_sort(model));
    return model;
}

static void picture(ssdgs_model *model, ssdgs_real *color) {
    const ssdgs_real eye[3] = {(ssdgs_real)1.5, (ssdgs_real)-1.2, (ssdgs_real)0.7}, target[3] = {0, 0, 0},
                     up[3] = {0, 0, 1};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, SIDE, SIDE);
    ssdgs_light light;
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_image out;
    memset(&light, 0, sizeof light);
    memset(&out, 0, sizeof out);
    out.color = color;
    for (int c = 0; c < 3; c++) light.position[c] = 2 * eye[c], light.intensity[c] = 20;
    CHECK(!ssdgs_render_ex(model, &camera, &light, 1, &options, &out, NULL));
}

static double error_of(const ssdgs_real *a, const ssdgs_real *b) {
    double sum = 0;
    for (int i = 0; i < 3 * PIXELS; i++) sum += (double)(a[i] - b[i]) * (double)(a[i] - b[i]);
    return sum;
}

/* Whatever the model has: reflectance, all terms, baked colours. */
static void test_looks(void) {
    static ssdgs_real whole[3 * PIXELS], reduced[3 * PIXELS], fewer[3 * PIXELS];
    static const int terms[6] = {SSDGS_DIFFUSE_TERM, 3, 5, 9, 15, 0};
    ssdgs_context *context = test_context(2);
    for (size_t i = 0; i < sizeof terms / sizeof *terms; i++) {
        ssdgs_model *model = striped(context, 4000, 1, terms[i]), *half = striped(context, 4000, 2, terms[i]);
        double power = 0;
        picture(model, whole);
        picture(half, fewer);
        CHECK(!reduce_model(context, &model, 2000) && ssdgs_model_arrays(model).count == 2000);
        picture(model, reduced);
        for (int k = 0; k < 3 * PIXELS; k++) power += (double)whole[k] * (double)whole[k];
        const double left = error_of(whole, reduced) / power, dropped = error_of(whole, fewer) / power;
        if (!CHECK(left < 4e-3 && left < 0.05 * dropped))
            printf("    terms %d: %g, every other one %g\n", terms[i], left, dropped);
        ssdgs_model_destroy(model);
        ssdgs_model_destroy(half);
    }
    ssdgs_context_destroy(context);
}

/* Taught, a level shows what its original does, also where no lesson looked; what is not trained stays. */
static void test_teach(void) {
    static ssdgs_real whole[3 * PIXELS], merged[3 * PIXELS], taught[3 * PIXELS];
    ssdgs_context *context = test_context(2);
    ssdgs_model *original = striped(context, 600, 1, SSDGS_ALL_TERMS),
                *level = striped(context, 600, 1, SSDGS_ALL_TERMS);
    picture(original, whole);
    CHECK(!reduce_model(context, &level, 60));
    picture(level, merged);
    CHECK(!reduce_teach(original, level) && ssdgs_model_peek(level).count == 60);
    picture(level, taught);
    const double before = error_of(whole, merged), after = error_of(whole, taught);
    if (!CHECK(after < 0.5 * before)) printf("    %g merged, %g taught\n", before, after);
    ssdgs_model_destroy(original);
    ssdgs_model_destroy(level);
    for (int kind = 0; kind < 4; kind++) {
        ssdgs_settings s = ssdgs_settings_default();
        s.baked = kind == 0;
        if (kind == 1) s.placement.scale = 2;
        if (kind == 2) s.scattering.layers = 0;
        for (int c = 0; c < 3 && kind == 2; c++) s.medium.scattering[c] = 1;
        original = new_model(context, &s, 20);
        for (int i = 0; i < 20; i++) {
            const ssdgs_gaussian g = any(i);
            set(original, i, &g);
        }
        const ssdgs_model_view v = ssdgs_model_arrays(original);
        for (int i = 0; i < 20 && kind == 3; i++) v.gaussians[i] = (ssdgs_real)NAN; /* nothing to see */
        ssdgs_real was[20];
        memcpy(was, v.gaussians + SSDGS_DIFFUSE * v.stride, sizeof was);
        CHECK(!reduce_teach(original, original));
        CHECK(!memcmp(was, v.gaussians + SSDGS_DIFFUSE * v.stride, sizeof was));
        ssdgs_model_destroy(original);
    }
    ssdgs_context_destroy(context);
}

/* The same for any number of threads; what has fewer stays; nothing that is no number gets in. */
static void test_edges(void) {
    ssdgs_context *contexts[2];
    ssdgs_model *models[2];
    for (int i = 0; i < 2; i++) {
        contexts[i] = test_context(1 + 2 * i);
        models[i] = striped(contexts[i], 1500, 1, SSDGS_ALL_TERMS);
        const ssdgs_model_view v = ssdgs_model_arrays(models[i]);
        const ssdgs_settings before = *ssdgs_model_settings(models[i]);
        CHECK(reduce_model(contexts[i], &models[i], 0) == SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(contexts[i]), "count < 1") != NULL);
        CHECK(reduce_model(contexts[i], NULL, 9) == SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(contexts[i]), "model is NULL") != NULL);
        CHECK(reduce_model(NULL, &models[i], 9) == SSDGS_ERR_ARGUMENT);
        CHECK(!reduce_model(contexts[i], &models[i], 1500) && ssdgs_model_arrays(models[i]).count == 1500);
        v.gaussians[7] = NAN;                            /* never drawn: it goes */
        v.gaussians[SSDGS_DIFFUSE * v.stride + 9] = NAN; /* drawn black */
        for (size_t k = 20; k < 40; k++) v.gaussians[SSDGS_OPACITY * v.stride + k] = -60; /* nothing of it */
        CHECK(!reduce_model(contexts[i], &models[i], 700) && ssdgs_model_arrays(models[i]).count == 700);
        CHECK(!memcmp(&before, ssdgs_model_settings(models[i]), sizeof before));
    }
    int bad = 0;
    for (size_t c = 0; c < (size_t)ssdgs_model_peek(models[0]).channels; c++) {
        const ssdgs_model_view a = ssdgs_model_arrays(models[0]), b = ssdgs_model_arrays(models[1]);
        CHECK(!memcmp(a.gaussians + c * a.stride, b.gaussians + c * b.stride, 700 * sizeof(ssdgs_real)));
        for (size_t i = 0; i < 700; i++) bad += !test_finite((double)a.gaussians[c * a.stride + i]);
    }
    CHECK(bad == 1); /* the black one, which comes last */
    for (int i = 0; i < 2; i++) {
        CHECK(!reduce_model(contexts[i], &models[i], 1) && ssdgs_model_arrays(models[i]).count == 1);
        ssdgs_model_destroy(models[i]);
    }
    ssdgs_model *same = new_model(contexts[0], NULL, 100); /* all in one place, and opaque */
    ssdgs_gaussian g = ssdgs_gaussian_default();
    g.opacity = 1;
    for (int i = 0; i < 100; i++) set(same, i, &g);
    CHECK(!reduce_model(contexts[0], &same, 3) && ssdgs_model_arrays(same).count == 3);
    CHECK(!ssdgs_model_get(same, 2, &g) && g.opacity > (ssdgs_real)0.99);
    ssdgs_model_destroy(same);
    for (int i = 0; i < 2; i++) ssdgs_context_destroy(contexts[i]);
}

/* The same whatever was drawn before: here what the first of the lights that tell what is seen shows. */
static void test_after_frame(void) {
    static ssdgs_real color[PIXELS * 3];
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_context *context = test_context(1);
    ssdgs_model *models[2];
    for (int i = 0; i < 2; i++) {
        ssdgs_settings settings = ssdgs_settings_default();
        settings.transport = 0; /* so a frame asks for no flux */
        models[i] = new_model(context, &settings, 300);
        for (int k = 0; k < 300; k++) {
            const ssdgs_gaussian g = any(k);
            set(models[i], k, &g);
        }
        if (i) {
            const double z = 1 - 1.0 / REDUCE__VIEWS;
            const ssdgs_real eye[3] = {0, -3, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
            const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.5, SIDE, SIDE);
            ssdgs_light light;
            ssdgs_image image;
            memset(&light, 0, sizeof light);
            memset(&image, 0, sizeof image);
            light.position[0] = (ssdgs_real)sqrt(1 - z * z);
            light.position[2] = (ssdgs_real)z;
            TEST_PARALLEL(light);
            for (int c = 0; c < 3; c++) light.intensity[c] = 1;
            image.color = color;
            CHECK(!ssdgs_render_ex(models[i], &camera, &light, 1, &options, &image, NULL));
        }
        CHECK(!reduce_model(context, &models[i], 100));
    }
    const ssdgs_model_view a = ssdgs_model_arrays(models[0]), b = ssdgs_model_arrays(models[1]);
    for (size_t c = 0; c < (size_t)a.channels; c++)
        CHECK(!memcmp(a.gaussians + c * a.stride, b.gaussians + c * b.stride, 100 * sizeof(ssdgs_real)));
    for (int i = 0; i < 2; i++) ssdgs_model_destroy(models[i]);
    ssdgs_context_destroy(context);
}

/* Each Gaussian that is not merged stays as it is, also of many, and networks and lobes are the old ones. */
static void test_rest(void) {
    enum { N = 5000 };
    static unsigned char met[N];
    ssdgs_context *context = test_context(2);
    ssdgs_model *model = new_model(context, NULL, N);
    for (int i = 0; i < N; i++) {
        ssdgs_gaussian g = any(i);
        g.material[0] = (ssdgs_real)i;
        set(model, i, &g);
    }
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    ssdgs_real *const lists[5] = {v.asg_basis, v.asg_sharpness, v.asg_sigma, v.scattering, v.shadow};
    const size_t counts[5] = {4 * SSDGS_ASG_COUNT, 2 * SSDGS_ASG_COUNT, SSDGS_ASG_COUNT, v.scattering_count,
                              v.shadow_count};
    ssdgs_real *before[5];
    for (int k = 0; k < 5; k++) {
        before[k] = (ssdgs_real *)malloc(counts[k] * sizeof(ssdgs_real));
        if (!CHECK(before[k])) exit(1);
        for (size_t i = 0; i < counts[k]; i++)
            before[k][i] = lists[k][i] = (ssdgs_real)draw(100000 * (uint64_t)k + i);
    }
    CHECK(!reduce_model(context, &model, N - 1));
    const ssdgs_model_view w = ssdgs_model_arrays(model);
    const ssdgs_real *const after[5] = {w.asg_basis, w.asg_sharpness, w.asg_sigma, w.scattering, w.shadow};
    CHECK(w.count == N - 1 && w.scattering_count == counts[3] && w.shadow_count == counts[4]);
    for (int k = 0; k < 5; k++) {
        CHECK(!memcmp(before[k], after[k], counts[k] * sizeof(ssdgs_real)));
        free(before[k]);
    }
    int kept = 0;
    for (int i = 0; i < N - 1; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(model, i, &g));
        const int name = (int)g.material[0];
        const ssdgs_gaussian old = any(name);
        if (met[name] || memcmp(g.position, old.position, sizeof g.position) != 0) continue;
        met[name] = 1;
        kept++;
    }
    CHECK(kept == N - 2); /* two became one */
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

int main(void) {
    test_rest();
    test_moments();
    test_after_frame();
    test_twins();
    test_hidden(0);
    test_hidden(1);
    test_looks();
    test_teach();
    test_edges();
    TEST_END();
}
