/* Training under stress: spoiled gradients, degenerate photographs and cameras, explosion, extinction, soak,
   foreign states of FPU and locale; one hash with FMA and one without, whatever the threads and the
   instruction set. A row per case; `t_soak full` goes deeper, `t_soak full 61` runs one row. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"
#include <fenv.h>
#include <locale.h>
#if defined(__SSE2__) && !defined(__TINYC__)
#include <xmmintrin.h>
#endif
#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#define POSIX_THREADS 1
static pthread_mutex_t counting =
    PTHREAD_MUTEX_INITIALIZER; /* checks are counted by several threads at a time */
static int locked_check(int ok, int line, const char *what) {
    pthread_mutex_lock(&counting);
    test_check(ok, __FILE__, line, what);
    pthread_mutex_unlock(&counting);
    return ok;
}
#undef CHECK
#define CHECK(condition) locked_check(!!(condition), __LINE__, #condition)
#else
#define POSIX_THREADS 0
#endif

enum { PHOTOS = 6, SIDE = 24, LARGEST = SIDE * SIDE, TRUTH = 60 };
/* an instruction set that every CPU has */
enum {
    PLAIN = SSDGS__SCALAR ? SSDGS_ISA_SCALAR
            : SSDGS__NEON ? SSDGS_ISA_NEON
            : SSDGS__WASM ? SSDGS_ISA_WASM
                          : SSDGS_ISA_SSE2
};
#ifdef __TINYC__
enum { SLOW = 2 }; /* no optimiser: shorter runs */
#else
enum { SLOW = 1 };
#endif
#define FNV_START UINT64_C(0xCBF29CE484222325)

static uint16_t pixels[PHOTOS][LARGEST * 4];
static ssdgs_photo photos[PHOTOS];
static int full;

/* ---- fixtures ---- */

/* Of 32-bit words, the lowest byte of each first, whatever the machine. */
static uint64_t fnv(uint64_t hash, const void *words, size_t size) {
    const unsigned char *at = (const unsigned char *)words;
    uint32_t word;
    for (; size >= sizeof word; size -= sizeof word, at += sizeof word) {
        memcpy(&word, at, sizeof word);
        for (int k = 0; k < 4; k++) hash = (hash ^ (word >> 8 * k & 255)) * UINT64_C(0x100000001B3);
    }
    return hash;
}

static uint64_t hash_model(ssdgs_model *model) {
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    uint64_t hash = fnv(FNV_START, &v.count, sizeof v.count);
    for (size_t c = 0; c < (size_t)v.channels; c++)
        hash = fnv(hash, v.gaussians + c * v.stride, (size_t)v.count * sizeof(ssdgs_real));
    return fnv(hash, model->globals, model->global_count * sizeof(ssdgs_real));
}

/* The largest magnitude among a model's parameters; infinite if one is not finite. */
static double largest_parameter(ssdgs_model *model) {
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    double most = 0;
    for (size_t c = 0; c < (size_t)v.channels; c++)
        for (size_t i = 0; i < (size_t)v.count; i++) {
            const double x = fabs((double)v.gaussians[c * v.stride + i]);
            most = test_finite(x) ? x > most ? x : most : HUGE_VAL;
        }
    for (size_t i = 0; i < model->global_count; i++) {
        const double x = fabs((double)model->globals[i]);
        most = test_finite(x) ? x > most ? x : most : HUGE_VAL;
    }
    return most;
}
#define NAME(isa) ssdgs_isa_string((ssdgs_isa)(isa))
#define ALL_FINITE(model) (largest_parameter(model) < 1e30)

static ssdgs_context *new_context(int isa, int threads, test_meter *m, const ssdgs_gpu_hook *hook) {
    ssdgs_context_desc desc;
    ssdgs_context *context = NULL;
    memset(&desc, 0, sizeof desc);
    desc.isa = (ssdgs_isa)isa;
    desc.threads = threads;
    desc.gpu = hook;
    if (m) TEST_METER(desc, m);
    ssdgs_context_create(&desc, &context); /* NULL: an instruction set this machine lacks */
    return context;
}

/* A cloud of coloured Gaussians: what the photographs show. */
static ssdgs_model *new_truth(ssdgs_context *context) {
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, NULL, TRUTH, &model))) exit(1);
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (int i = 0; i < TRUTH; i++)
        for (int c = 0; c < v.channels; c++) {
            const double u = 2 * ssdgs__uniform(11, (uint64_t)(64 * i + c)) - 1;
            const int scale = c >= SSDGS_LOG_SCALE && c < SSDGS_OPACITY;
            v.gaussians[(size_t)c * v.stride + (size_t)i] = (ssdgs_real)(c < 3                ? 0.35 * u
                                                                         : scale              ? 0.4 * u - 2.4
                                                                         : c == SSDGS_OPACITY ? 2 + u
                                                                                              : u);
        }
    for (int i = 0; i < (int)v.scattering_count; i++) /* networks that have something to say */
        v.scattering[i] += (ssdgs_real)(0.2 * ssdgs__uniform(12, (uint64_t)i) - 0.1);
    for (int i = 0; i < (int)v.shadow_count; i++)
        v.shadow[i] += (ssdgs_real)(0.2 * ssdgs__uniform(13, (uint64_t)i) - 0.1);
    return model;
}

/* 16-bit photographs of the truth, from all around, each under its own light. */
static void make_photos(int side) {
    static ssdgs_real color[LARGEST * 3], alpha[LARGEST];
    const ssdgs_real target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    ssdgs_context *context = new_context(PLAIN, 1, NULL, NULL);
    ssdgs_model *truth = new_truth(context);
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color;
    image.alpha = alpha;
    memset(photos, 0, sizeof photos);
    for (int i = 0; i < PHOTOS; i++) {
        const double angle = 6.283185307179586 * i / PHOTOS;
        ssdgs_real eye[3];
        for (int c = 0; c < 3; c++) {
            eye[c] = (ssdgs_real)(c == 0 ? 2 * cos(angle) : c == 1 ? 2 * sin(angle) : i % 2 - 0.3);
            photos[i].light.position[c] = (ssdgs_real)(c == 0   ? 2 * cos(angle + 0.8)
                                                       : c == 1 ? 2 * sin(angle + 0.8)
                                                                : 1);
            photos[i].light.intensity[c] = 12;
        }
        photos[i].camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.5, side, side);
        photos[i].pixels = pixels[i];
        photos[i].format = SSDGS_PIXELS_RGBA16;
        CHECK(!ssdgs_render_ex(truth, &photos[i].camera, &photos[i].light, 1, &exact, &image, NULL));
        for (int j = 0; j < side * side; j++)
            for (int c = 0; c < 4; c++) {
                const ssdgs_real a = alpha[j] > (ssdgs_real)1e-4 ? alpha[j] : (ssdgs_real)1e-4;
                const ssdgs_real x = c == 3 ? alpha[j] : ssdgs_srgb_encode(color[3 * j + c] / a);
                pixels[i][4 * j + c] = (uint16_t)(65535 * (x < 1 ? (double)x : 1) + 0.5);
            }
    }
    ssdgs_model_destroy(truth);
    ssdgs_context_destroy(context);
}

/* All terms from the first step on, density control every ten. */
static ssdgs_train_options short_run(int iterations) {
    ssdgs_train_options o = ssdgs_train_options_default();
    o.iterations = iterations;
    o.schedule = SSDGS_SCHEDULE_JOINT;
    o.initial_points = 60;
    o.max_gaussians = 90;
    o.densify_from = o.densify_every = 10;
    o.opacity_reset_every = 0;
    o.densify_gradient = (ssdgs_real)1e-5;
    return o;
}

static void without_density_control(ssdgs_train_options *o) { o->densify_from = 0x7FFFFFFF; }

typedef struct training {
    ssdgs_context *context;
    ssdgs_model *model;
    ssdgs_trainer *trainer;
} training;

/* Takes the context over; a NULL model starts from random points. */
static training start(ssdgs_context *context, ssdgs_model *model, const ssdgs_settings *settings,
                      const ssdgs_train_options *o, int photo_count) {
    training t;
    t.context = context;
    t.model = model;
    t.trainer = NULL;
    if (!CHECK(context) || !CHECK(model || !ssdgs_model_create(context, settings, 0, &t.model)) ||
        !CHECK(!ssdgs_trainer_create(t.model, photos, photo_count, o, &t.trainer)))
        exit(1);
    return t;
}

static void finish(training *t) {
    ssdgs_trainer_destroy(t->trainer);
    ssdgs_model_destroy(t->model);
    ssdgs_context_destroy(t->context);
}

/* Steps that must succeed with a finite loss; the last one's statistics. */
static ssdgs_train_stats steps(training *t, int count) {
    ssdgs_train_stats stats;
    int good = 0;
    memset(&stats, 0, sizeof stats);
    for (int i = 0; i < count; i++)
        good += !ssdgs_trainer_step(t->trainer, &stats) && test_finite(stats.loss) && test_finite(stats.psnr);
    if (!CHECK(good == count))
        printf("    %d of %d steps: %s\n", good, count, ssdgs_error_message(t->context));
    return stats;
}

/* ---- 54: one value of one gradient ---- */

enum { VIEW_GRADIENT = SSDGS__GROUPS, LIGHT_GRADIENT, SPOILS };
typedef struct spoiler {
    int group, from, until, spared, frame;
    ssdgs_real value;
} spoiler;

/* The CPU's backward, then a value of a group's gradient is overwritten in the frames from .. until but
   one. */
static ssdgs_result spoil_gradient(void *user, ssdgs_frame *frame) {
    spoiler *s = (spoiler *)user;
    const ssdgs_result result = ssdgs_stage_cpu(frame, SSDGS_STAGE_PROJECT_BACKWARD);
    if (s->frame >= s->from && s->frame < s->until && s->frame != s->spared) {
        size_t first[SSDGS__GLOBAL_GROUPS + 1];
        ssdgs__global_groups(&frame->settings, first);
        if (s->group == VIEW_GRADIENT) frame->view_gradient[7] = s->value;
        else if (s->group == LIGHT_GRADIENT) frame->light_gradient[2] = s->value;
        else if (s->group >= SSDGS__PLANE_GROUPS)
            frame->global_gradient[first[s->group - SSDGS__PLANE_GROUPS + 1] - 1] =
                s->value; /* the group's last */
        else frame->gradient[(size_t)ssdgs__group_plane[s->group] * frame->gaussians.stride + 17] = s->value;
    }
    s->frame++;
    return result;
}

/* Everything a step may change but the iteration, and the count of steps refused. */
static uint64_t hash_trainer(const ssdgs_trainer *t) {
    const size_t planes = SSDGS_CHANNELS * t->stride * sizeof(ssdgs_real),
                 globals = t->model->global_count * sizeof(ssdgs_real);
    uint64_t hash = fnv(fnv(hash_model(t->model), t->mean, planes), t->square, planes);
    hash = fnv(fnv(hash, t->global_mean, globals), t->global_square, globals);
    hash = fnv(fnv(hash, t->run.steps, sizeof t->run.steps), t->corrections,
               (size_t)t->photo_count * sizeof *t->corrections);
    return fnv(hash, t->screen_gradient, SSDGS__STATISTICS * t->stride * sizeof(ssdgs_real));
}

/* A refused step changes nothing, says why, and training goes on as after any other refused step. */
static void row_54(void) {
    const double values[3] = {(double)NAN, HUGE_VAL, -HUGE_VAL};
    ssdgs_train_options o = short_run(12);
    uint64_t after = 0, undisturbed = 0;
    make_photos(16);
    o.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT;
    ssdgs_gpu_hook hook;
    memset(&hook, 0, sizeof hook);
    hook.stage[SSDGS_STAGE_PROJECT_BACKWARD] = spoil_gradient;
    spoiler s;
    hook.user = &s;
    memset(&s, 0, sizeof s);
    for (int group = -1; group < SPOILS; group++)
        for (int i = 0; i < (group < 0 || SLOW > 1 ? 1 : 3); i++) {
            training t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, &hook), NULL, NULL, &o, PHOTOS);
            s.group = group;
            s.value = (ssdgs_real)values[i];
            s.frame = 0;
            s.from = group < 0 ? 100 : 7; /* pose and light learn by then */
            s.until = s.from + 1;
            steps(&t, 7);
            const uint64_t before = hash_trainer(t.trainer);
            if (group >= 0) {
                ssdgs_train_stats stats;
                const int refused = ssdgs_trainer_step(t.trainer, &stats) == SSDGS_ERR_NONFINITE;
                if (!CHECK(refused && stats.skipped_steps == 1 && stats.iteration == 8 &&
                           hash_trainer(t.trainer) == before) ||
                    !CHECK(strstr(ssdgs_error_message(t.context), group < SSDGS__GROUPS
                                                                      ? ssdgs__group_names[group]
                                                                  : group == VIEW_GRADIENT ? "camera"
                                                                                           : "light")))
                    printf("    gradient of %s: %s\n",
                           group < SSDGS__GROUPS ? ssdgs__group_names[group] : "camera or light",
                           refused ? ssdgs_error_message(t.context) : "not refused");
                for (; stats.iteration < 11 && !ssdgs_trainer_step(t.trainer, &stats);) continue;
                if (group == 0 && i == 0) after = hash_trainer(t.trainer);
                CHECK(hash_trainer(t.trainer) == after && stats.iteration == 11 && stats.skipped_steps == 1);
            } else {
                steps(&t, 4);
                undisturbed = hash_trainer(t.trainer);
            }
            finish(&t);
        }
    CHECK(after != undisturbed);
    for (int i = 9; i <= 10;
         i++) { /* nine refusals in a row, a step and a tenth are got over, ten in a row end the run */
        training t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, &hook), NULL, NULL, &o, PHOTOS);
        s.group = SSDGS__G_OPACITY;
        s.frame = 0;
        s.from = 1;
        s.until = i == 9 ? 12 : 11;
        s.spared = i == 9 ? 10 : 0;
        CHECK(ssdgs_trainer_run(t.trainer, NULL, NULL) == (i == 9 ? SSDGS_OK : SSDGS_ERR_NONFINITE));
        CHECK(t.trainer->run.iteration == s.until && t.trainer->run.skipped == 10 && ALL_FINITE(t.model));
        finish(&t);
    }
}

/* ---- 55, 56: photographs and SSIM ---- */

/* Mean SSIM of planes (3, h, w) in double: an 11x11 Gaussian window of sigma 1.5, black beyond the border. */
static double ssim_oracle(const ssdgs_real *image, const ssdgs_real *reference, int w, int h) {
    double tap[11], norm = 0, total = 0;
    for (int u = 0; u < 11; u++) norm += tap[u] = exp(-(u - 5) * (u - 5) / 4.5);
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < h; y++)
            for (int x = 0; x < w; x++) {
                double e[5] = {0, 0, 0, 0, 0};
                for (int v = y - 5; v <= y + 5; v++)
                    for (int u = x - 5; u <= x + 5; u++) {
                        const size_t at = (size_t)(c * w * h + v * w + u);
                        const double k = tap[u - x + 5] * tap[v - y + 5] / (norm * norm);
                        if (u < 0 || v < 0 || u >= w || v >= h) continue;
                        e[0] += k * (double)image[at];
                        e[1] += k * (double)reference[at];
                        e[2] += k * (double)image[at] * (double)image[at];
                        e[3] += k * (double)reference[at] * (double)reference[at];
                        e[4] += k * (double)image[at] * (double)reference[at];
                    }
                const double cov = e[4] - e[0] * e[1];
                total +=
                    (2 * e[0] * e[1] + 1e-4) * (2 * cov + 9e-4) /
                    ((e[0] * e[0] + e[1] * e[1] + 1e-4) * (e[2] - e[0] * e[0] + e[3] - e[1] * e[1] + 9e-4));
            }
    return total / (3.0 * w * h);
}

/* Photographs of one colour, of none, and smaller than the window of SSIM; trained a little under every
   term. */
static void row_55(void) {
    static const struct {
        int width, height, rgb, alpha;
    } cases[8] = {{1, 1, 128, 255}, {1, 1, 255, 0},     {2, 1, 0, 255},  {5, 7, 255, 255},
                  {16, 16, 0, 255}, {16, 16, 255, 255}, {16, 16, 90, 0}, {1, 16, 7, 128}};
    static unsigned char flat[16 * 16 * 4];
    static ssdgs_real image[3 * 16 * 16], reference[3 * 16 * 16], gradient[3 * 16 * 16];
    const ssdgs_train_options o = short_run(20);
    for (int i = 0; i < 8; i++) {
        const int w = cases[i].width, h = cases[i].height, n = 3 * w * h;
        ssdgs_context *context = new_context(SSDGS_ISA_AUTO, 2, NULL, NULL);
        ssdgs__buffer memory = {0, 0};
        make_photos(16);
        for (int j = 0; j < w * h * 4; j++)
            flat[j] = (unsigned char)(j % 4 == 3 ? cases[i].alpha : cases[i].rgb);
        for (int j = 0; j < PHOTOS; j++) {
            ssdgs_camera *c = &photos[j].camera;
            c->cx = (ssdgs_real)0.5 * (ssdgs_real)(c->width = w);
            c->cy = (ssdgs_real)0.5 * (ssdgs_real)(c->height = h);
            photos[j].format = SSDGS_PIXELS_RGBA8;
            photos[j].pixels = flat;
        }
        for (int j = 0; j < n; j++) {
            image[j] = (ssdgs_real)ssdgs__uniform(21, (uint64_t)(i * 1000 + j));
            reference[j] =
                (ssdgs_real)(0.5 * (double)image[j] + 0.5 * ssdgs__uniform(22, (uint64_t)(i * 1000 + j)));
        }
        ssdgs__loss_values values;
        const ssdgs__images images = {image, reference, w, h};
        CHECK(!ssdgs__loss(context, &memory, &images, (ssdgs_real)0.2, gradient, &values));
        ssdgs__release(context, memory.memory);
        CHECK(fabs(values.ssim - ssim_oracle(image, reference, w, h)) < 1e-6);
        training t = start(context, NULL, NULL, &o, PHOTOS);
        const ssdgs_train_stats first = steps(&t, 1);
        const ssdgs_train_stats last = steps(&t, 19);
        CHECK(ALL_FINITE(t.model) && last.skipped_steps == 0 && last.gaussians > 0);
        int j, k;
        for (j = k = 0; j < PHOTOS; j++) { /* what shows nothing is darkened, what is white is not */
            ssdgs_metrics m;
            const ssdgs_real black[3] = {0, 0, 0};
            CHECK(!ssdgs_evaluate(t.model, &photos[j], black, NULL, &m));
            k += test_finite(m.psnr) && test_finite(m.ssim) && m.ssim <= 1 + 1e-6;
        }
        CHECK(k == PHOTOS);
        if (cases[i].alpha == 255 && w == 16) CHECK(last.loss < first.loss);
        finish(&t);
    }
}

/* ssdgs_compare(): the metrics of what is left of two images when both are clamped; the best ones for images
   that differ only beyond that. */
static void check_compare(void) {
    enum { W = 19, H = 14, N = 3 * W * H };
    static ssdgs_real image[2][N], plane[2][N];
    double mse = 0;
    for (int i = 0; i < N; i++) {
        double clamped[2];
        for (int k = 0; k < 2; k++) {
            image[k][i] = (ssdgs_real)(2 * ssdgs__uniform(41, (uint64_t)(2 * i + k)) - 0.5);
            clamped[k] = fmin(fmax((double)image[k][i], 0), 1);
            plane[k][i % 3 * W * H + i / 3] = (ssdgs_real)clamped[k];
        }
        mse += (clamped[0] - clamped[1]) * (clamped[0] - clamped[1]) / N;
    }
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        ssdgs_context *context = new_context(isa, 2, NULL, NULL);
        if (!context) continue;
        ssdgs_metrics m;
        CHECK(!ssdgs_compare(context, image[0], image[1], W, H, &m));
        CHECK(fabs(m.psnr + 10 * log10(mse)) < 1e-3);
        CHECK(fabs(m.ssim - ssim_oracle(plane[0], plane[1], W, H)) < 1e-4);
        for (int k = 0; k < 3; k++) { /* itself; beyond 1, below 0 */
            static ssdgs_real other[N];
            for (int i = 0; i < N; i++) {
                const ssdgs_real v = image[0][i];
                other[i] = k == 1 && v >= 1 ? 7 : k == 2 && v <= 0 ? -7 : v;
            }
            CHECK(!ssdgs_compare(context, image[0], other, W, H, &m));
            if (!CHECK(!(fabs(m.psnr - 100) > 0) && fabs(m.ssim - 1) < 1e-7))
                printf("    %s: %g dB, SSIM - 1 = %g\n", NAME(isa), m.psnr, m.ssim - 1);
        }
        ssdgs_context_destroy(context);
    }
}

/* An image against itself. Gradients are relative to L1's slope, 1 / values: terms of 2 / C2 = 2222 cancel
   but for float's 6e-8, times the mean's square beyond 1. */
static void row_56(void) {
    static ssdgs_real image[3 * LARGEST], gradient[3 * LARGEST];
    static const double constants[4] = {0, 0.6, 1, 100};
    double worst = 0, steepest = 0;
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++)
        for (int i = 0; i < 6; i++) {
            ssdgs_context *context = new_context(isa, 1, NULL, NULL);
            ssdgs__buffer memory = {0, 0};
            double here = 0;
            if (!context) continue;
            for (int j = 0; j < 3 * LARGEST; j++)
                image[j] = (ssdgs_real)(i < 4    ? constants[i]
                                        : i == 4 ? ssdgs__uniform(31, (uint64_t)j)
                                                 : 0.5 + 0.5 * sin(0.2 * (j % SIDE)));
            ssdgs__loss_values values;
            const ssdgs__images images = {image, image, SIDE, SIDE};
            CHECK(!ssdgs__loss(context, &memory, &images, 1, gradient, &values));
            for (int j = 0; j < 3 * LARGEST; j++) here = test_most(here, fabs((double)gradient[j]));
            here *= 3 * LARGEST;
            if (!CHECK(fabs(values.ssim - 1) < 1e-7) || !CHECK(here < (i == 3 ? 1e-2 : 6e-4)))
                printf("    %s, image %d: SSIM - 1 = %g, gradient %g\n", NAME(isa), i, values.ssim - 1, here);
            worst = test_most(worst, fabs(values.ssim - 1));
            steepest = here > steepest ? here : steepest;
            CHECK(values.l1 <= 0 && values.mse <= 0);
            ssdgs__release(context, memory.memory);
            ssdgs_context_destroy(context);
        }
    check_compare();
    printf("figure ssim_of_itself_error %.2g\nfigure ssim_of_itself_gradient %.2g\n", worst, steepest);
}

/* ---- 57 to 60: starts, explosions ---- */

/* One photograph; one camera under several lights; the scene's extent comes from its bounds then. */
static void row_57(void) {
    ssdgs_train_options o = short_run(30);
    o.bounds_max[1] = (ssdgs_real)1.5;
    for (int i = 0; i < 3; i++) {
        make_photos(16);
        for (int c = 1; c < PHOTOS; c++) {
            if (i > 0) photos[c].camera = photos[0].camera, photos[c].pixels = photos[0].pixels;
            if (i == 2) photos[c].light = photos[0].light;
        }
        training t = start(new_context(SSDGS_ISA_AUTO, 2, NULL, NULL), NULL, NULL, &o, i ? PHOTOS : 1);
        CHECK(fabs(t.trainer->extent - 1.1 * 2) < 1e-6);
        steps(&t, 30);
        CHECK(ALL_FINITE(t.model) && t.trainer->run.skipped == 0);
        finish(&t);
    }
}

static void row_58(void) {
    static const int few[5] = {-1, 0, 1, 2, 3};
    ssdgs_train_options o = short_run(40);
    make_photos(16);
    training t;
    for (int i = 0; i < 5; i++) {
        o.initial_points = few[i];
        if (few[i] > 0) {
            t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, NULL), NULL, NULL, &o, PHOTOS);
            CHECK(t.model->count == few[i]);
            steps(&t, 40);
            CHECK(t.model->count > 0 && ALL_FINITE(t.model));
        } else {
            memset(&t, 0, sizeof t);
            t.context = new_context(SSDGS_ISA_AUTO, 1, NULL, NULL);
            CHECK(!ssdgs_model_create(t.context, NULL, 0, &t.model));
            CHECK(ssdgs_trainer_create(t.model, photos, PHOTOS, &o, &t.trainer) == SSDGS_ERR_ARGUMENT &&
                  !t.trainer);
            CHECK(strstr(ssdgs_error_message(t.context), "points") != NULL);
        }
        finish(&t);
    }
    o = short_run(40); /* a thousand in one place */
    o.max_gaussians = 1100;
    t.context = new_context(SSDGS_ISA_AUTO, 2, NULL, NULL);
    CHECK(!ssdgs_model_create(t.context, NULL, 1000, &t.model));
    ssdgs_model_view v = ssdgs_model_arrays(t.model);
    for (int i = 0; i < 1000; i++)
        for (int c = 0; c < 3; c++) v.gaussians[(size_t)(SSDGS_LOG_SCALE + c) * v.stride + (size_t)i] = -2;
    t = start(t.context, t.model, NULL, &o, PHOTOS);
    steps(&t, 40);
    CHECK(t.model->count > 0 && t.model->count <= 1100 && ALL_FINITE(t.model));
    finish(&t);
}

/* Everything densifies: the cap holds. All opacities gone: someone remains. */
static void row_59(void) {
    ssdgs_train_options o = short_run(full ? 400 : 120 / SLOW);
    ssdgs_settings settings = ssdgs_settings_default();
    int most = 0;
    for (int side = 16; side <= SIDE; side += SIDE - 16) {
        test_meter m;
        memset(&m, 0, sizeof m);
        make_photos(side);
        o.densify_gradient = 0;
        o.densify_every = 3;
        o.initial_points = 20;
        o.max_gaussians = side > 16 ? 300 : full ? 3000 : 600;
        training t = start(new_context(SSDGS_ISA_AUTO, 1, &m, NULL), NULL, &settings, &o, PHOTOS);
        for (int i = 0; i < o.iterations; i++) {
            steps(&t, 1);
            most = t.model->count > most ? t.model->count : most;
            CHECK(t.model->count <= (int)o.surplus * o.max_gaussians);
        }
        CHECK(most > o.max_gaussians && t.model->count <= o.max_gaussians && ALL_FINITE(t.model));
        printf("    %d Gaussians of %d, %lu bytes at most\n", most, o.max_gaussians, (unsigned long)m.peak);
        finish(&t);
        CHECK(m.live == 0);
        most = 0;
    }
    o = short_run(40);
    training t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, NULL), NULL, NULL, &o, PHOTOS);
    ssdgs_model_view v = ssdgs_model_arrays(t.model);
    for (int i = 0; i < v.count; i++) v.gaussians[(size_t)SSDGS_OPACITY * v.stride + (size_t)i] = -20;
    steps(&t, 40);
    CHECK(t.model->count == 1 && ALL_FINITE(t.model));
    finish(&t);
}

/* A hundred times every rate: a bad model, but a model. */
static void row_60(void) {
    ssdgs_train_options o = short_run(full ? 2000 : 300 / SLOW);
    ssdgs_rate *const rates[12] = {&o.rates.position, &o.rates.opacity,    &o.rates.scale,  &o.rates.rotation,
                                   &o.rates.color,    &o.rates.asg,        &o.rates.frame,  &o.rates.material,
                                   &o.rates.shadow,   &o.rates.scattering, &o.rates.camera, &o.rates.light};
    make_photos(16);
    o.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT;
    for (int i = 0; i < 12; i++) {
        rates[i]->start *= 100;
        rates[i]->end *= 100;
    }
    training t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, NULL), NULL, NULL, &o, PHOTOS);
    steps(&t, o.iterations);
    printf("    %d Gaussians, largest parameter %g\n", t.model->count, largest_parameter(t.model));
    CHECK(ALL_FINITE(t.model));
    finish(&t);
}

/* ---- 61, 62: long and partial runs ---- */

/* Many steps: memory settles, parameters stay bounded. */
static void row_61(void) {
    ssdgs_train_options o = short_run(full ? 100000 : 2000 / SLOW);
    ssdgs_settings settings = ssdgs_settings_default();
    test_meter m;
    memset(&m, 0, sizeof m);
    make_photos(16);
    settings.light_map.size = 64; /* else it grows as Gaussians shrink */
    o.initial_points = o.max_gaussians = 50;
    o.densify_every = 100;
    o.opacity_reset_every = 700;
    o.densify_until = 60000;
    training t = start(new_context(SSDGS_ISA_AUTO, 1, &m, NULL), NULL, &settings, &o, PHOTOS);
    steps(&t, o.iterations / 4);
    const size_t live = m.live;
    for (int i = 1; i < 4; i++) {
        const long calls = m.calls;
        steps(&t, o.iterations / 4);
        /* buffers still meet larger frames; 8 bytes a step would be more */
        CHECK(m.live <= live + live / 10);
        /* density control's own and what grows, nothing a step */
        CHECK(m.calls - calls <= o.iterations / 4 / 5);
    }
    printf("    %d Gaussians, %lu bytes live, largest parameter %g\n", t.model->count, (unsigned long)m.live,
           largest_parameter(t.model));
    CHECK(t.model->count > 25 && t.model->count <= 50 && largest_parameter(t.model) < (full ? 150 : 25));
    finish(&t);
    CHECK(m.live == 0);
}

/* A term not yet joined is a term the model does not have; what serves only absent terms never moves. */
static void row_62(void) {
    static const struct {
        int terms;
        double until;
    } phases[3] = {{SSDGS_DIFFUSE_TERM, 5e3},
                   {SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM, 9e3},
                   {SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM | SSDGS_SCATTERING_TERM, 16e3}};
    ssdgs_train_options o = short_run(120);
    ssdgs_settings settings = ssdgs_settings_default();
    int moved = 0;
    make_photos(16);
    o.schedule = SSDGS_SCHEDULE_PROGRESSIVE;
    for (int phase = 0; phase < 3; phase++) {
        const int count = (int)(phases[phase].until / 60e3 * o.iterations);
        uint64_t hash[2];
        for (int all = 0; all < 2; all++) {
            settings.terms = all ? SSDGS_ALL_TERMS : phases[phase].terms;
            training t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, NULL), NULL, &settings, &o, PHOTOS);
            steps(&t, count);
            hash[all] = hash_model(t.model);
            steps(&t, 10); /* the next term joins, if there is one */
            CHECK(hash_model(t.model) != hash[0]);
            finish(&t);
        }
        CHECK(hash[0] == hash[1]);
    }
    for (size_t i = 0; i < PHOTOS; i++)
        photos[i].light = photos[0].light; /* one light, neither gloss nor depth */
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    training t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, NULL), NULL, &settings, &o, PHOTOS);
    ssdgs_real *globals = (ssdgs_real *)malloc(t.model->global_count * sizeof *globals);
    memcpy(globals, t.model->globals, t.model->global_count * sizeof *globals);
    ssdgs_real was[SSDGS_CHANNELS];
    for (size_t c = 0; c < SSDGS_CHANNELS; c++)
        was[c] = ssdgs_model_arrays(t.model).gaussians[c * t.model->capacity];
    steps(&t, o.iterations);
    ssdgs_model_view v = ssdgs_model_arrays(t.model);
    for (size_t c = SSDGS_SPECULAR; c < SSDGS_MATERIAL; c++) /* every Gaussian's start is the same */
        for (size_t i = 0; i < (size_t)v.count && (c < SSDGS_FRAME || c >= SSDGS_ASG_WEIGHT); i++)
            moved += c != SSDGS_ASG_WEIGHT + 3 && memcmp(v.gaussians + c * v.stride + i, &was[c],
                                                         sizeof was[c]) != 0; /* but shadows' softness */
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&t.model->settings, first);
    const size_t last = first[SSDGS__SHADOW_NET];
    CHECK(moved == 0 && !memcmp(globals, t.model->globals, last * sizeof *globals));
    CHECK(memcmp(globals + last, t.model->globals + last, (t.model->global_count - last) * sizeof *globals));
    CHECK(ALL_FINITE(t.model));
    free(globals);
    finish(&t);
}

/* ---- 63, 64: poses ---- */

/* exp(K(w)) and its integral over the way there, sum of K^n / (n + 1)!: plain series. */
static void exponential(const double w[3], double e[9], double integral[9]) {
    const double k[9] = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};
    double term[9];
    for (int i = 0; i < 9; i++) e[i] = integral[i] = term[i] = i % 4 == 0;
    double next[9];
    int l;
    for (int n = 1; n < 60; n++) {
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                for (l = 0, next[3 * i + j] = 0; l < 3; l++)
                    next[3 * i + j] += term[3 * i + l] * k[3 * l + j] / n;
        for (int i = 0; i < 9; i++) {
            term[i] = next[i];
            e[i] += term[i];
            integral[i] += term[i] / (n + 1);
        }
    }
}

/* sum of weight . corrected view, in double. */
static double weighted_view(const ssdgs_photo *photo, const double value[10], const ssdgs_real weight[12]) {
    double e[9], integral[9], sum = 0;
    exponential(value + 3, e, integral);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            double x = j == 3 ? value[i] : 0;
            for (int l = 0; l < 3; l++) x += e[3 * i + l] * (double)photo->camera.view[4 * l + j];
            sum += x * (double)weight[4 * i + j];
        }
    return sum;
}

static void row_63(void) {
    static const double pi = 3.14159265358979323846,
                        seam = 0.03162277660168379; /* where the series take over */
    const double angles[12] = {
        0, 1e-300, 1e-160,        1e-12, 1e-6, 1e-3, seam * (1 - 1e-9), seam * (1 + 1e-9),
        1, pi,     2 * pi - 1e-6, 2 * pi};
    ssdgs_train_options o = short_run(12);
    double worst = 0, slope = 0;
    make_photos(16);
    for (int a = 0; a < 12; a++)
        for (int axis = 0; axis < 4; axis++) {
            double value[10] = {0}, scale = 0;
            for (int i = 0; i < 9; i++)
                value[i] = i < 3 || i > 5 ? 0.1 * i
                           : axis == 3    ? ssdgs__uniform(41, (uint64_t)i) - 0.5
                                          : i - 3 == axis;
            for (int i = 3; i < 6; i++) scale += value[i] * value[i];
            for (int i = 3; i < 6; i++) value[i] *= angles[a] / sqrt(scale);
            ssdgs_real weight[12];
            for (int i = 0; i < 12; i++) weight[i] = (ssdgs_real)(ssdgs__uniform(42, (uint64_t)i) - 0.5);
            double e[9], jacobian[9];
            ssdgs__rotate_by(value + 3, e, jacobian);
            double want[9], integral[9];
            exponential(value + 3, want, integral);
            for (int i = 0; i < 9; i++) {
                worst = test_most(worst, fabs(e[i] - want[i]));
                worst = test_most(worst, fabs(jacobian[i] - integral[i]));
            }
            double d[6];
            ssdgs__correct_backward(&photos[1], value, weight, d);
            for (int i = 0; i < 6; i++) { /* two central differences and Richardson */
                double difference[2];
                for (int half = 0; half < 2; half++) {
                    const double h = half ? 1e-3 : 2e-3;
                    double moved[10];
                    memcpy(moved, value, sizeof moved);
                    moved[i] += h;
                    difference[half] = weighted_view(&photos[1], moved, weight);
                    moved[i] -= 2 * h;
                    difference[half] =
                        (difference[half] - weighted_view(&photos[1], moved, weight)) / (2 * h);
                }
                difference[0] = (4 * difference[1] - difference[0]) / 3;
                slope = test_most(slope, fabs(d[i] - difference[0]));
            }
        }
    printf("figure rotation_series_error %.2g\nfigure pose_gradient_error %.2g\n", worst, slope);
    CHECK(worst < 5e-14); /* rounding at two pi, and at the seam */
    CHECK(slope < 1e-10);
    for (int a = 9; a < 12; a++) { /* a pose turned that far: the trainer goes on, a whole turn is none */
        o.refine = SSDGS_REFINE_CAMERA;
        o.rates.position.start = o.rates.position.end = 0; /* or the scene would follow instead */
        training t = start(new_context(SSDGS_ISA_AUTO, 1, NULL, NULL), NULL, NULL, &o, 1);
        t.trainer->corrections[0].value[4] = angles[a];
        ssdgs_camera camera;
        ssdgs_light light;
        CHECK(!ssdgs_trainer_refined(t.trainer, 0, &camera, &light));
        if (a == 11) CHECK_NEAR(camera.view, photos[0].camera.view, 12, 1e-6, 0, "a whole turn is none");
        steps(&t, 12);
        CHECK(ALL_FINITE(t.model) && fabs(t.trainer->corrections[0].value[4] - angles[a]) < 0.02);
        finish(&t);
    }
}

/* Adds how far a photograph's pose and light are from the true ones: centre, angle in radians, light. */
static void pose_error(const ssdgs_camera *camera, const ssdgs_light *light, const ssdgs_photo *truth,
                       double error[3]) {
    double trace = 0, centre = 0, place = 0;
    for (int i = 0; i < 3; i++) {
        double x = 0, d = (double)light->position[i] - (double)truth->light.position[i];
        for (int j = 0; j < 3; j++) {
            const double dr = (double)camera->view[4 * i + j] - (double)truth->camera.view[4 * i + j];
            x += (double)camera->view[4 * j + i] * (double)camera->view[4 * j + 3] -
                 (double)truth->camera.view[4 * j + i] * (double)truth->camera.view[4 * j + 3];
            trace += dr * dr;
        }
        centre += x * x;
        place += d * d;
    }
    error[0] += sqrt(centre);
    error[1] += sqrt(trace / 2); /* |R - R'|^2 = 8 sin^2(angle / 2) */
    error[2] += sqrt(place);
}

/* The true model and its photographs, poses and lights off by 0.01: they come back. */
static void row_64(void) {
    static const char *const names[3] = {"pose_centre_left", "pose_angle_left", "light_left"};
    static ssdgs_photo truth[PHOTOS];
    ssdgs_train_options o = short_run((full ? 1000 : 500) * (full ? PHOTOS : 2));
    ssdgs_rate *const rates[10] = {&o.rates.position, &o.rates.opacity,   &o.rates.scale, &o.rates.rotation,
                                   &o.rates.color,    &o.rates.asg,       &o.rates.frame, &o.rates.material,
                                   &o.rates.shadow,   &o.rates.scattering};
    double before[3] = {0, 0, 0}, after[3] = {0, 0, 0};
    const int count = full ? PHOTOS : 2;
    make_photos(SIDE);
    memcpy(truth, photos, sizeof truth);
    for (int i = 0; i < 10; i++)
        rates[i]->start = rates[i]->end = 0; /* a moving model could take the disturbance over */
    without_density_control(&o);
    o.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT;
    o.rates.camera.start = o.rates.light.start = (ssdgs_real)0.01; /* quickly there, then as fine as ever */
    for (int i = 0; i < count; i++) {
        double value[10] = {0}, length[3] = {0, 0, 0};
        for (int c = 0; c < 9; c++) {
            value[c] = ssdgs__uniform(51, (uint64_t)(9 * i + c)) - 0.5;
            length[c / 3] += value[c] * value[c];
        }
        for (int c = 0; c < 9; c++) value[c] *= 0.01 / sqrt(length[c / 3]);
        ssdgs__correct(&truth[i], value, &photos[i].camera, &photos[i].light);
        pose_error(&photos[i].camera, &photos[i].light, &truth[i], before);
    }
    training t;
    t.context = new_context(SSDGS_ISA_AUTO, 2, NULL, NULL);
    t = start(t.context, new_truth(t.context), NULL, &o, count);
    const uint64_t hash = hash_model(t.model);
    steps(&t, o.iterations);
    CHECK(hash_model(t.model) == hash);
    for (int i = 0; i < count; i++) {
        ssdgs_camera camera;
        ssdgs_light light;
        CHECK(!ssdgs_trainer_refined(t.trainer, i, &camera, &light));
        pose_error(&camera, &light, &truth[i], after);
    }
    for (int i = 0; i < 3; i++) {
        printf("figure %s %.3g\n", names[i], after[i] / before[i]);
        CHECK(i == 0 || fabs(before[i] / count - 0.01) < 1e-5);
        CHECK(after[i] < 0.003 * before[i]); /* measured: at most 0.0008 */
    }
    finish(&t);
}

/* ---- 66 to 69: one result ---- */

typedef struct hashes {
    uint64_t render, light, training;
    double psnr;
} hashes;

/* A rendering of the truth with its components, what its light pass finds, a model after `count` steps. */
static hashes hash_all(ssdgs_context *context, const ssdgs_train_options *o, int count) {
    ssdgs_real *color = (ssdgs_real *)malloc(LARGEST * 3 * sizeof *color);
    const size_t side = (size_t)photos[0].camera.width, bytes = side * side * 3 * sizeof *color;
    ssdgs_model *truth = new_truth(context);
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color;
    CHECK(!ssdgs_render(truth, &photos[1].camera, &photos[2].light, 1, &image));
    hashes h;
    h.render = fnv(FNV_START, color, bytes);
    truth->settings.transport = truth->settings.depth_cue = 1; /* the walk sums flux and depth too */
    ssdgs_frame frame;
    CHECK(!ssdgs__frame_of_model(&frame, truth, &photos[1].camera, &photos[3].light, 1, NULL, 0, 0));
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK));
    h.light = fnv(fnv(FNV_START, frame.visibility, TRUTH * sizeof(ssdgs_real)), frame.depth_cue,
                  TRUTH * sizeof(ssdgs_real));
    h.light = fnv(h.light, frame.flux, TRUTH * sizeof(ssdgs_real));
    training t = start(context, NULL, NULL, o, PHOTOS);
    const ssdgs_train_stats stats = steps(&t, count);
    h.training = hash_model(t.model);
    h.psnr = stats.psnr;
    ssdgs_trainer_destroy(t.trainer);
    ssdgs_model_destroy(t.model);
    ssdgs_model_destroy(truth);
    free(color);
    return h;
}

static int same_hashes(hashes a, hashes b) {
    return a.render == b.render && a.light == b.light && a.training == b.training;
}

static void row_66(void) {
    static const int threads[5] = {1, 2, 3, 7, 16};
    const ssdgs_train_options o = short_run(50);
    int groups = 0;
    make_photos(SIDE);
    hashes first[SSDGS_ISA_COUNT];
    int known[SSDGS_ISA_COUNT];
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        known[isa] = 0;
        for (int i = 0; i < 5; i++) {
            ssdgs_context *context = new_context(isa, threads[i], NULL, NULL);
            if (!context) break;
            const hashes h = hash_all(context, &o, 50);
            if (i == 0) first[isa] = h;
            CHECK(same_hashes(h, first[isa]));
            ssdgs_context_destroy(context);
            known[isa] = 1;
        }
        if (!known[isa]) continue;
        printf("hash %s %016llx %016llx %016llx\n", NAME(isa), (unsigned long long)first[isa].render,
               (unsigned long long)first[isa].light, (unsigned long long)first[isa].training);
        int other;
        for (other = SSDGS_ISA_SCALAR;
             other < isa && !(known[other] && same_hashes(first[isa], first[other])); other++) {}
        groups += other == isa;
#if FLT_EVAL_METHOD == 0 && !defined(__FAST_MATH__)
        for (other = SSDGS_ISA_SCALAR; other < isa; other++) /* from AVX2 on all have FMA */
            if (known[other] && (other >= SSDGS_ISA_AVX2) == (isa >= SSDGS_ISA_AVX2))
                CHECK(same_hashes(first[isa], first[other]));
#endif
    }
    printf("figure hash_groups %d\n", groups);
}

#if defined(__SSE2__) && !defined(__TINYC__)
#define CAN_FLUSH 1
static void set_flush(int on) { _mm_setcsr(on ? _mm_getcsr() | 0x8040u : _mm_getcsr() & ~0x8040u); }
#else
#define CAN_FLUSH 0
static void set_flush(int on) { (void)on; }
#endif

/* Subnormals flushed, before or after the context makes its threads: no bit moves. Other roundings: close,
   and finite. */
static void row_67(void) {
    enum { STEPS = 30 };
    static const struct {
        const char *name;
        int mode;
    } modes[] = {
#ifdef FE_UPWARD
        {"up", FE_UPWARD},
#endif
#ifdef FE_DOWNWARD
        {"down", FE_DOWNWARD},
#endif
#ifdef FE_TOWARDZERO
        {"zero", FE_TOWARDZERO},
#endif
        {"nearest", FE_TONEAREST}};
    const ssdgs_train_options o = short_run(STEPS);
    static ssdgs_real color[2][LARGEST * 3];
    ssdgs_image image;
    double worst[2] = {0, 0};
    memset(&image, 0, sizeof image);
    make_photos(16);
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        ssdgs_context *context = new_context(isa, 3, NULL, NULL);
        if (!context) continue;
        hashes plain = hash_all(context, &o, STEPS);
        for (int i = 0; CAN_FLUSH && i < 2; i++) {
            ssdgs_context *own = i ? context : NULL;
            set_flush(1);
            if (!own) own = new_context(isa, 3, NULL, NULL);
            const hashes h = hash_all(own, &o, STEPS);
            set_flush(0);
            if (!CHECK(same_hashes(h, plain)))
                printf("    %s, flushed: render %d, light %d, training %d\n", NAME(isa),
                       h.render == plain.render, h.light == plain.light, h.training == plain.training);
            if (!i) ssdgs_context_destroy(own);
        }
        ssdgs_context_destroy(context);
        for (int i = (int)(sizeof modes / sizeof *modes) - 1; i >= 0; i--) {
            /* these two round as the mode says inside exp and sin, too: half a step outside of their
               polynomials' range; without transport, which takes the 16th power of that (5.2e-3 with it) */
            const int nearest = modes[i].mode == FE_TONEAREST,
                      follows = isa == SSDGS_ISA_SCALAR || isa == SSDGS_ISA_SSE2;
            double most = 0;
            if (fesetround(modes[i].mode)) continue;
            context = new_context(isa, 2, NULL, NULL);
            ssdgs_model *truth = new_truth(context);
            int sizes[SSDGS_MAX_LAYERS + 1];
            ssdgs__network_sizes(&truth->settings, 0, sizes);
            for (int j = 0; follows && j < sizes[1]; j++)
                memset(ssdgs_model_arrays(truth).scattering + (j + 1) * sizes[0] - SSDGS__LENGTHS, 0,
                       SSDGS__LENGTHS * sizeof(ssdgs_real));
            image.color = color[!nearest];
            CHECK(!ssdgs_render(truth, &photos[1].camera, &photos[2].light, 1, &image));
            hashes h = hash_all(context, &o, STEPS);
            fesetround(FE_TONEAREST);
            for (int j = 0; j < 16 * 16 * 3; j++) {
                const double d = fabs((double)color[!nearest][j] - (double)color[0][j]);
                most = test_finite(d) ? d > most ? d : most : HUGE_VAL;
            }
            if (!CHECK(most < (follows ? 5e-3 : 1e-5)) || !CHECK(fabs(h.psnr - plain.psnr) < 1))
                printf("    %s, rounding %s: off by %g, %g dB for %g\n", NAME(isa), modes[i].name, most,
                       h.psnr, plain.psnr);
            worst[!follows] = most > worst[!follows] ? most : worst[!follows];
            ssdgs_model_destroy(truth);
            ssdgs_context_destroy(context);
        }
    }
    printf("figure rounding_mode_error_scalar_sse2 %.2g\nfigure rounding_mode_error_wider %.2g\n", worst[0],
           worst[1]);
}

/* Bytes of a file; 0 when it cannot be read. */
static uint64_t hash_file(const char *path) {
    uint64_t hash = FNV_START;
    FILE *f = fopen(path, "rb");
    if (!f) return 0;
    unsigned char bytes[4096];
    size_t n;
    while ((n = fread(bytes, 1, sizeof bytes, f)) > 0) hash = fnv(hash, bytes, n);
    fclose(f);
    return hash;
}

static int left_out; /* 1: a row could not be tried on this machine, so there is no line of it */

/* A locale with a decimal comma changes no byte written and no number read. */
static void row_68(void) {
    static const char *const locales[] = {"de_DE.UTF-8", "de_DE.utf8",          "de_DE",
                                          "fr_FR.UTF-8", "fr_FR.utf8",          "es_ES.UTF-8",
                                          "ru_RU.UTF-8", "German_Germany.1252", "de-DE"};
    static const char ascii[] =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "property float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float "
        "scale_2\nproperty float rot_0\n"
        "property float rot_1\nproperty float rot_2\nproperty float rot_3\n"
        "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nend_header\n"
        "0.25 -1.5e-1 2.125 0.5 -2.75 -3 -3.5 0.5 0.5 -0.5 0.5 0.5 0.25 0.75\n";
    static const char *const paths[2] = {"build/t_soak.ply", "build/t_soak.ckpt"};
    const ssdgs_train_options o = short_run(12);
    int comma = 0;
    make_photos(16);
    uint64_t hash[2][3];
    for (int round = 0; round < 2; round++) {
        ssdgs_model *loaded = NULL;
        for (int i = 0; round && !comma && i < (int)(sizeof locales / sizeof *locales); i++)
            comma = setlocale(LC_ALL, locales[i]) && *localeconv()->decimal_point == ',';
        training t = start(new_context(PLAIN, 1, NULL, NULL), NULL, NULL, &o, PHOTOS);
        steps(&t, 5);
        CHECK(!ssdgs_model_save(t.model, paths[0]) && !ssdgs_trainer_save(t.trainer, paths[1]));
        steps(&t, 3);
        CHECK(!ssdgs_trainer_load(t.trainer, paths[1]));
        CHECK(!ssdgs_model_load(t.context, paths[0], &loaded, NULL));
        CHECK(loaded && hash_model(loaded) == hash_model(t.model));
        hash[round][0] = hash_file(paths[0]);
        hash[round][1] = hash_file(paths[1]);
        ssdgs_model_destroy(loaded);
        CHECK(!ssdgs_model_load_memory(t.context, ascii, sizeof ascii - 1, &loaded, NULL));
        const ssdgs_model_view v = ssdgs_model_arrays(loaded);
        CHECK(fabs((double)v.gaussians[0] - 0.25) < 1e-7 &&
              fabs((double)v.gaussians[v.stride] + 0.15) < 1e-7);
        CHECK(fabs((double)v.gaussians[SSDGS_LOG_SCALE * v.stride] + 2.75) < 1e-7);
        hash[round][2] = hash_model(loaded);
        ssdgs_model_destroy(loaded);
        CHECK(ssdgs_model_load_memory(t.context, "ply\nx", 5, &loaded, NULL) == SSDGS_ERR_FORMAT);
        finish(&t);
        remove(paths[0]);
        remove(paths[1]);
        setlocale(LC_ALL, "C");
    }
    CHECK(hash[0][0] && !memcmp(hash[0], hash[1], sizeof hash[0]));
    left_out = !comma;
    if (!comma) puts("no locale here has a decimal comma");
}

typedef struct job {
    int threads, seed;
    hashes result;
} job;

static void *run_job(void *data) {
    job *j = (job *)data;
    ssdgs_train_options o = short_run(30);
    ssdgs_context *context = new_context(SSDGS_ISA_AUTO, j->threads, NULL, NULL);
    o.seed = (uint64_t)j->seed;
    j->result = hash_all(context, &o, 30);
    ssdgs_context_destroy(context);
    return NULL;
}

/* Contexts share nothing: side by side as alone. */
static void row_69(void) {
#if POSIX_THREADS
    enum { SIDE_BY_SIDE = 3 };
    make_photos(16);
    job jobs[SIDE_BY_SIDE];
    hashes alone[SIDE_BY_SIDE];
    for (int i = 0; i < SIDE_BY_SIDE; i++) {
        jobs[i].threads = i + 1;
        jobs[i].seed = i % 2 + 1;
        run_job(&jobs[i]);
        alone[i] = jobs[i].result;
        memset(&jobs[i].result, 0, sizeof jobs[i].result);
    }
    pthread_t threads[SIDE_BY_SIDE];
    for (int i = 0; i < SIDE_BY_SIDE; i++)
        if (!CHECK(!pthread_create(&threads[i], NULL, run_job, &jobs[i]))) exit(1);
    for (int i = 0; i < SIDE_BY_SIDE; i++) CHECK(!pthread_join(threads[i], NULL));
    for (int i = 0; i < SIDE_BY_SIDE; i++) CHECK(same_hashes(jobs[i].result, alone[i]));
    CHECK(alone[0].training != alone[1].training && alone[0].training == alone[2].training);
#endif
}

int main(int argc, char **argv) {
    static const struct {
        const char *number, *name;
        void (*run)(void);
    } rows[] = {{"54", "a gradient that is not finite", row_54},
                {"55", "degenerate photographs", row_55},
                {"56", "SSIM of an image and itself", row_56},
                {"57", "one photograph, one camera", row_57},
                {"58", "few points, coincident points", row_58},
                {"59", "explosion, extinction", row_59},
                {"60", "rates times 100", row_60},
                {"61", "soak", row_61},
                {"62", "terms that never join", row_62},
                {"63", "pose series", row_63},
                {"64", "disturbed poses and lights come back", row_64},
                {"66", "one hash for any threads and vector width", row_66},
                {"67", "flushed subnormals, other roundings", row_67},
                {"68", "decimal comma", row_68},
                {"69", "contexts side by side", row_69}};
    const int count = (int)(sizeof rows / sizeof *rows);
    full = argc > 1 && !strcmp(argv[1], "full");
    for (int i = 0; i < count; i++) {
        if (argc > 2 && strcmp(argv[2], rows[i].number)) continue;
        const int before = test_failed;
        left_out = 0;
        rows[i].run();
        if (!left_out) test_row(before, rows[i].number, rows[i].name);
    }
    TEST_END();
}
