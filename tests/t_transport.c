/* True dipole transport: the tree against every pair, closed forms, conservation; built again in double
   (real64). */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

#define SIDE 64
static ssdgs_context *context;

static double draw(uint64_t counter) { return ssdgs__uniform(91, counter); }

/* A frame through the light pass, with the networks' settings small and transport on. */
static void begin_as(ssdgs_frame *frame, ssdgs_model *model, const ssdgs_light *lights, int light_count,
                     int training) {
    static const ssdgs_real eye[3] = {0, -2, (ssdgs_real)0.5}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    static ssdgs_camera camera;
    camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.7, SIDE, SIDE);
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    ssdgs_model_arrays(model);
    if (!CHECK(!ssdgs__frame_of_model(frame, model, &camera, lights, light_count, &exact, 0, training)))
        exit(1);
    if (!CHECK(!ssdgs__run_stages(frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK))) exit(1);
}

static void begin(ssdgs_frame *frame, ssdgs_model *model, const ssdgs_light *lights, int light_count) {
    begin_as(frame, model, lights, light_count, 0);
}

static ssdgs_model *make_model(int count, double size) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    settings.transport = 1;
    settings.scattering.width = 16;
    if (!CHECK(!ssdgs_model_create(context, &settings, count, &model))) exit(1);
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            model->gaussians[(size_t)(SSDGS_LOG_SCALE + c) * model->capacity + (size_t)i] =
                (ssdgs_real)log(size);
    return model;
}

static void on_sphere(ssdgs_model *model, int count) {
    for (int i = 0; i < count; i++) {
        const double u = 2 * draw((uint64_t)i) - 1, w = sqrt(1 - u * u),
                     a = 6.2831853 * draw(9000 + (uint64_t)i);
        const double p[3] = {0.4 * w * cos(a), 0.4 * w * sin(a), 0.4 * u};
        for (int c = 0; c < 3; c++)
            model->gaussians[(size_t)c * model->capacity + (size_t)i] = (ssdgs_real)p[c];
    }
}

/* The sums at 64 places from the frame's flux, by the library. */
static void sums_at(ssdgs_frame *frame, int light, const ssdgs_real *x, ssdgs_real *sums) {
    ssdgs__transport_job job;
    memset(&job, 0, sizeof job);
    for (int i = 0; i < frame->light_count; i++) ssdgs__light_memories(frame)[i].transport_key = 0;
    CHECK(!ssdgs__nodes(frame, &job.tree));
    job.sources = (ssdgs_real *)malloc(SSDGS__SOURCES * 9 * sizeof *job.sources);
    ssdgs__transport_block(&job, job.tree.trees, light, 0, x, 15, sums);
    free(job.sources);
}

/* A series around a middle against the sum itself, off by a third-order term; that of balls, by their radii.
 */
static void test_series(void) {
    enum { COUNT = 32 };
    static ssdgs_real sources[5 * SSDGS__SOURCES], sums[SSDGS__LENGTHS * SSDGS__BLOCK], x[3 * SSDGS__BLOCK];
    ssdgs_real series[SSDGS__LENGTHS * SSDGS__SERIES];
    const ssdgs_real middle[3] = {(ssdgs_real)0.1, (ssdgs_real)-0.2, (ssdgs_real)0.3};
    const double soft = 0.01, longest = 0.32, spread = 1e-4;
    const ssdgs_real scale[2] = {(ssdgs_real)(soft * soft), (ssdgs_real)(-1.4426950408889634 / longest)};
    double worst = 0;
    for (int ball = 0; ball < 2; ball++) {
        for (uint64_t i = 0; i < COUNT; i++) {
            double d[3], r = 0;
            for (uint64_t c = 0; c < 3; c++) d[c] = draw(700 + 3 * i + c) - 0.5, r += d[c] * d[c];
            for (int c = 0; c < 3; c++)
                sources[c * SSDGS__SOURCES + (int)i] =
                    middle[c] + (ssdgs_real)(d[c] / sqrt(r) * (0.2 + 0.3 * draw(900 + i)));
            sources[3 * SSDGS__SOURCES + i] = (ssdgs_real)(i < 19 ? draw(1000 + i) : 0);
            sources[4 * SSDGS__SOURCES + i] = (ssdgs_real)(ball ? spread : 0);
        }
        for (int i = 0; i < 3 * SSDGS__BLOCK; i++)
            x[i] = middle[i / SSDGS__BLOCK] + (ssdgs_real)(0.012 * (draw(1100 + (uint64_t)i) - 0.5));
        memset(series, 0, sizeof series);
        memset(sums, 0, sizeof sums);
        context->k->expand(sources, COUNT, middle, scale, series);
        context->k->series(series, middle, x, SSDGS__BLOCK, sums);
        for (int k = 0; k < SSDGS__LENGTHS; k++)
            for (int s = 0; s < SSDGS__BLOCK; s++) {
                const double l = longest / (1 << (SSDGS__LENGTHS - 1 - k));
                double sum = 0, bound = 0;
                for (int i = 0; i < COUNT; i++) {
                    double r = soft * soft, away = 0;
                    for (int c = 0; c < 3; c++) {
                        const double at = (double)x[c * SSDGS__BLOCK + s];
                        r += pow(at - (double)sources[c * SSDGS__SOURCES + i], 2);
                        away += pow(at - (double)middle[c], 2);
                    }
                    r = sqrt(r);
                    const double light = (double)sources[3 * SSDGS__SOURCES + i] * exp(-r / l) / r;
                    sum += light * (1 + (ball ? spread / (6 * l * l) : 0));
                    bound += light * pow(sqrt(away) * (1 / l + 1 / r), 3) / 3;
                }
                const double error = fabs((double)sums[k * SSDGS__BLOCK + s] - sum) / (bound + 2e-6 * sum);
                worst = test_most(worst, error);
            }
    }
    printf("series: at most %.2g of a third-order term\n", worst);
    CHECK(worst < 1 && worst > 0.01);
}

/* 3,000 Gaussians on a sphere, as training orders them or without order, some dark, two lights: against the
   sum over all pairs. */
static void test_pairs(int sorted, double detail, double most_error) {
    enum { COUNT = 3001 };
    static ssdgs_real x[3 * SSDGS__BLOCK], sums[SSDGS__LENGTHS * SSDGS__BLOCK];
    ssdgs_model *model = make_model(COUNT, 0.01);
    ssdgs_light lights[2];
    double worst[SSDGS__LENGTHS] = {0}, most[SSDGS__LENGTHS] = {0}, all = 0;
    memset(lights, 0, sizeof lights);
    lights[0].position[2] = lights[1].position[0] = 2;
    lights[0].intensity[0] = lights[1].intensity[0] = 1;
    on_sphere(model, COUNT);
    if (sorted) CHECK(!ssdgs_model_sort(model));
    ssdgs_frame frame;
    begin(&frame, model, lights, 2);
    for (int i = 0; i < 2 * COUNT; i++)
        frame.flux[i] = (ssdgs_real)(i % 7 < 4 ? 0 : 1e-4 * draw(20000 + (uint64_t)i));
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        for (int c = 0; c < 3; c++)
            x[c * SSDGS__BLOCK + s] = model->gaussians[(size_t)c * model->capacity + 1000 + (size_t)s];
    }
    frame.options.transport_detail = (ssdgs_real)detail;
    for (int light = 0; light < 2; light++) {
        sums_at(&frame, light, x, sums);
        for (int s = 0; s < SSDGS__BLOCK; s++)
            for (int k = 0; k < SSDGS__LENGTHS; k++) {
                const double l = 0.5 * 0.04 * (1 << k);
                double sum = 0;
                for (int i = 0; i < COUNT; i++) {
                    double r = 0.01 * 0.01;
                    for (int c = 0; c < 3; c++)
                        r += pow((double)(x[c * SSDGS__BLOCK + s] -
                                          model->gaussians[(size_t)c * model->capacity + (size_t)i]),
                                 2);
                    r = sqrt(r);
                    sum += (double)frame.flux[light * COUNT + i] * exp(-r / l) / (6.283185307179586 * l * r);
                }
                const double error = fabs((double)sums[k * SSDGS__BLOCK + s] - sum);
                worst[k] = test_most(worst[k], error);
                most[k] = sum > most[k] ? sum : most[k];
            }
    }
    for (int k = 0; k < SSDGS__LENGTHS; k++) all = worst[k] / most[k] > all ? worst[k] / most[k] : all;
    printf("against all pairs, %s, detail %g: off by %.2g of the largest sum\n",
           sorted ? "sorted" : "unsorted", detail, all);
    CHECK(all < most_error && (!sorted || all > most_error / 20));
    ssdgs_model_destroy(model);
}

/* A plane that takes up irradiance 1: at height h the integral is exp(-sqrt(h^2 + soft^2) / l). */
static void test_plane(void) {
    enum { ROW = 160, COUNT = ROW * ROW };
    static ssdgs_real x[3 * SSDGS__BLOCK], sums[SSDGS__LENGTHS * SSDGS__BLOCK];
    ssdgs_model *model = make_model(COUNT, 0.01);
    ssdgs_light light;
    memset(&light, 0, sizeof light);
    light.position[2] = 2;
    light.intensity[0] = 1;
    for (int i = 0; i < COUNT; i++) { /* 0.005 apart */
        const int row = i / ROW, column = i % ROW;
        model->gaussians[i] = (ssdgs_real)(0.005 * (column - ROW / 2));
        model->gaussians[model->capacity + (size_t)i] = (ssdgs_real)(0.005 * (row - ROW / 2));
    }
    CHECK(!ssdgs_model_sort(model));
    ssdgs_frame frame;
    begin(&frame, model, &light, 1);
    for (int i = 0; i < COUNT; i++) frame.flux[i] = (ssdgs_real)(0.005 * 0.005);
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        x[s] = (ssdgs_real)(0.05 * (draw((uint64_t)s) - 0.5));
        x[SSDGS__BLOCK + s] = (ssdgs_real)(0.05 * (draw(100 + (uint64_t)s) - 0.5));
        x[2 * SSDGS__BLOCK + s] = (ssdgs_real)(0.002 * s);
    }
    sums_at(&frame, 0, x, sums);
    for (int k = 0; k < 3; k++) /* longer lengths leave the plane */
        for (int s = 0; s < SSDGS__BLOCK; s++) {
            const double l = 0.5 * 0.04 * (1 << k), h = 0.002 * s,
                         expected = exp(-sqrt(h * h + 0.01 * 0.01) / l);
            CHECK(fabs((double)sums[k * SSDGS__BLOCK + s] - expected) < 0.02 * expected + 0.004);
        }
    ssdgs_model_destroy(model);
}

/* The scattering network's inputs, of the Gaussians that are seen, under two lights: sums over all pairs, by
   the irradiance each has. */
static void test_inputs(void) {
    enum { COUNT = 2000 };
    ssdgs_model *model = make_model(COUNT, 0.02);
    ssdgs_light lights[2];
    double worst = 0, most = 0, dark = 1e30;
    memset(lights, 0, sizeof lights);
    lights[0].position[2] = lights[1].position[0] = 2;
    lights[0].intensity[0] = lights[1].intensity[0] = 1;
    on_sphere(model, COUNT);
    for (int i = 0; i < COUNT; i++) model->gaussians[(size_t)SSDGS_OPACITY * model->capacity + (size_t)i] = 6;
    CHECK(!ssdgs_model_sort(model));
    ssdgs_frame frame;
    begin_as(&frame, model, lights, 2, 1);
    if (!CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_SHADE, SSDGS_STAGE_SHADE))) exit(1);
    ssdgs__block_layout l = ssdgs__layout(&frame, frame.objects);
    const ssdgs_real *activations = (const ssdgs_real *)frame.scratch->activations.memory;
    CHECK(frame.shaded_count > COUNT / 4 && frame.shaded_count < COUNT);
    for (int j = 0; j < frame.shaded_count; j += 7)
        for (int light = 0; light < 2; light++)
            for (int k = 0; k < SSDGS__LENGTHS; k++) {
                const size_t at = frame.shaded[j];
                const double length = 0.5 * 0.04 * (1 << k);
                double sum = 0, away = 0;
                for (int c = 0; c < 3; c++)
                    away += pow((double)(lights[light].position[c] -
                                         model->gaussians[(size_t)c * model->capacity + at]),
                                2);
                for (int i = 0; i < COUNT; i++) {
                    double r = 0.01 * 0.01;
                    for (int c = 0; c < 3; c++)
                        r += pow((double)(model->gaussians[(size_t)c * model->capacity + at] -
                                          model->gaussians[(size_t)c * model->capacity + (size_t)i]),
                                 2);
                    r = sqrt(r);
                    sum += (double)frame.flux[light * COUNT + i] * exp(-r / length) /
                           (6.283185307179586 * length * r);
                }
                sum *= away;
                const double error = fabs((double)activations[l.size * (size_t)(j / SSDGS__BLOCK) + l.lights +
                                                              l.light_size * (size_t)light + l.transport +
                                                              (size_t)(k * SSDGS__BLOCK + j % SSDGS__BLOCK)] -
                                          sum);
                worst = test_most(worst, error);
                most = sum > most ? sum : most;
                dark = sum < dark ? sum : dark;
            }
    printf("inputs from %.2g to %.2g, off by %.2g\n", dark, most, worst);
    CHECK(most > 0.3 && dark < 0.01 && worst < 0.01 * most);
    ssdgs_model_destroy(model);
}

/* What a closed sheet of Gaussians takes up is what the light sends there, near, far and from infinity; the
   tree's root has it all. */
static void test_flux(void) {
    enum { ROW = 60, COUNT = ROW * ROW };
    ssdgs_model *model = make_model(COUNT, 0.012);
    for (int i = 0; i < COUNT; i++) {
        model->gaussians[i] = (ssdgs_real)(0.01 * (i % ROW - ROW / 2 + 0.5));
        model->gaussians[model->capacity + (size_t)i] = (ssdgs_real)(0.01 * (i / ROW - ROW / 2 + 0.5));
        model->gaussians[(size_t)SSDGS_OPACITY * model->capacity + (size_t)i] = 6;
    }
    for (int part = 0; part < 3; part++) {
        const double height = part == 1 ? 5000 : 3, half = 0.3 + 0.012;
        double sum = 0, expected = 4 * half * half;
        ssdgs_light light;
        memset(&light, 0, sizeof light);
        light.position[2] = (ssdgs_real)(part == 2 ? 1 : height);
        if (part == 2) TEST_PARALLEL(light);
        light.intensity[0] = 1;
        ssdgs_frame frame;
        begin(&frame, model, &light, 1);
        for (int i = 0; i < COUNT; i++) sum += (double)frame.flux[i];
        if (part == 0)
            expected =
                4 * atan(half * half /
                         (height * sqrt(height * height + 2 * half * half))); /* a square's solid angle */
        if (part == 1) expected /= height * height;
        printf("flux %g of %g\n", sum, expected);
        CHECK(fabs(sum / expected - 1) < 0.06);
        ssdgs__node_job job;
        CHECK(!ssdgs__nodes(&frame, &job));
        const ssdgs__node *root = job.trees->nodes + job.trees->count - 1;
        CHECK(fabs((double)root->flux / sum - 1) < 1e-4);
        double square = 0;
        for (int i = 0; i < COUNT; i++) {
            const double dx = (double)(model->gaussians[i] - root->x[0]),
                         dy = (double)(model->gaussians[model->capacity + (size_t)i] - root->x[1]);
            square += (double)frame.flux[i] * (dx * dx + dy * dy);
        }
        CHECK(fabs((double)root->spread / (square / sum) - 1) < 1e-4);
        for (int i = 0; i < COUNT; i += ROW - 1) { /* and nobody is outside it */
            const double dx = (double)(model->gaussians[i] - root->x[0]),
                         dy = (double)(model->gaussians[model->capacity + (size_t)i] - root->x[1]);
            CHECK(sqrt(dx * dx + dy * dy) <= (double)root->radius * 1.0001);
        }
    }
    ssdgs_model_destroy(model);
}

/* Same bits for any number of threads and for a light at rest; and the cues do reach the image. */
static void test_bits(void) {
    enum { COUNT = 700 };
    static const ssdgs_real eye[2][3] = {{0, -2, (ssdgs_real)0.5}, {1, -2, 0}}, target[3] = {0, 0, 0},
                            up[3] = {0, 0, 1};
    static ssdgs_real color[6][SIDE * SIDE * 3];
    ssdgs_light light;
    memset(&light, 0, sizeof light);
    light.position[0] = light.position[2] = 2;
    for (int c = 0; c < 3; c++) light.intensity[c] = 9;
    /* one thread; three; its camera moved there; without transport's light; its light moved there; a Gaussian
       did */
    for (int part = 0; part < 6; part++) {
        ssdgs_context_desc desc;
        ssdgs_context *own = NULL, *shared = context;
        memset(&desc, 0, sizeof desc);
        desc.threads = part == 1 ? 3 : 1;
        if (!CHECK(!ssdgs_context_create(&desc, &own))) exit(1);
        context = own;
        ssdgs_model *model = make_model(COUNT, 0.05);
        context = shared;
        for (int i = 0; i < COUNT; i++)
            for (int c = 0; c < 3; c++) {
                model->gaussians[(size_t)c * model->capacity + (size_t)i] =
                    (ssdgs_real)(0.6 * draw(50000 + 3 * (uint64_t)i + (uint64_t)c) - 0.3);
                model->gaussians[(size_t)(SSDGS_SCATTERING + c) * model->capacity + (size_t)i] = 3;
            }
        if (part == 3) { /* the last SSDGS__LENGTHS inputs of the first layer */
            int sizes[SSDGS_MAX_LAYERS + 1];
            ssdgs_real *weights = ssdgs_model_arrays(model).scattering;
            ssdgs__network_sizes(&model->settings, 0, sizes);
            for (int i = 0; i < sizes[1]; i++)
                for (int c = 0; c < SSDGS__LENGTHS; c++) weights[(i + 1) * sizes[0] - 1 - c] = 0;
        }
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        image.color = color[part];
        for (int view = part == 2 || part > 3 ? 0 : 1; view < 2; view++) {
            const ssdgs_real x = (ssdgs_real)(0.6 * draw(50000) - 0.3);
            light.position[0] = part == 4 && !view ? -2 : 2;
            if (part == 5) *ssdgs_model_arrays(model).gaussians = view ? x : x + 1;
            const ssdgs_camera camera =
                ssdgs_camera_look_at(eye[part > 3 ? 1 : view], target, up, (ssdgs_real)0.7, SIDE, SIDE);
            CHECK(!ssdgs_render(model, &camera, &light, 1, &image));
        }
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(own);
    }
    CHECK(!memcmp(color[0], color[1], sizeof color[0]));
    CHECK(!memcmp(color[0], color[2], sizeof color[0]));
    CHECK(memcmp(color[0], color[3], sizeof color[0]));
    CHECK(!memcmp(color[0], color[4], sizeof color[0]));
    CHECK(!memcmp(color[0], color[5], sizeof color[0]));
}

int main(void) {
    if (!CHECK(!ssdgs_context_create(NULL, &context))) return 1;
    test_series();
    test_pairs(1, 1, 0.01);
    test_pairs(0, 1, 1e-5);
    test_pairs(1, 0.7, 0.06);
    test_pairs(1, 3, 0.002);
    test_plane();
    test_inputs();
    test_flux();
    test_bits();
    ssdgs_context_destroy(context);
    TEST_END();
}
