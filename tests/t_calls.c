/* Calls that the manual does not allow, and what must come of them: from hooks, tasks, the allocator and the
   log; after a fork; in the wrong order; with NULL; with shared parameters that are not finite. And the bytes
   that images become. cc -o build/t_calls tests/t_calls.c -lm -lpthread && build/t_calls       (writes under
   build/) */
#ifndef _DEFAULT_SOURCE
#define _DEFAULT_SOURCE /* fork, alarm */
#endif
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"
#ifndef _WIN32
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#define FILE_NAME "build/t_calls.ply"
enum { SIDE = 16, MANY = 70 };

static ssdgs_real color[SIDE * SIDE * 3], alpha[SIDE * SIDE];
static unsigned char pixels[SIDE * SIDE * 4];
static ssdgs_image image;
static ssdgs_photo photo;

/* What the callbacks below call into. */
static struct {
    ssdgs_context *context;
    ssdgs_model *model;
    ssdgs_trainer *trainer;
    int tries, calls, depth; /* how many calls came back, of how many; 1 within one of them */
} all;

static void set_up(const ssdgs_context_desc *desc, int with_trainer) {
    const ssdgs_real eye[3] = {0, -2, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    ssdgs_train_options options = ssdgs_train_options_default();
    memset(&all, 0, sizeof all);
    memset(pixels, 100, sizeof pixels);
    photo.camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, SIDE, SIDE);
    photo.light.kind = SSDGS_LIGHT_POINT;
    for (int c = 0; c < 3; c++)
        photo.light.position[c] = -1 - (ssdgs_real)c / 2, photo.light.intensity[c] = 4;
    photo.pixels = pixels;
    photo.format = SSDGS_PIXELS_RGBA8;
    image.color = color;
    image.alpha = alpha;
    if (!CHECK(!ssdgs_context_create(desc, &all.context) &&
               !ssdgs_model_create(all.context, NULL, MANY, &all.model)))
        exit(1);
    const ssdgs_model_view v = ssdgs_model_arrays(all.model);
    for (int i = 0; i < MANY; i++)
        for (int c = 0; c < 3; c++) {
            v.gaussians[(size_t)c * v.stride + (size_t)i] =
                (ssdgs_real)(test_uniform(1, (uint64_t)(3 * i + c)) - 0.5);
            v.gaussians[(size_t)(SSDGS_LOG_SCALE + c) * v.stride + (size_t)i] = -2;
        }
    options.iterations = 3;
    if (with_trainer && !CHECK(!ssdgs_trainer_create(all.model, &photo, 1, &options, &all.trainer))) exit(1);
}

static void tear_down(void) {
    ssdgs_trainer_destroy(all.trainer);
    ssdgs_model_destroy(all.model);
    ssdgs_context_destroy(all.context);
}

/* Makes every call there is; each must be refused, and nothing may change or crash. Returns how many were. */
static int call_everything(void) {
    ssdgs_model *model = all.model, *other = NULL;
    ssdgs_trainer *trainer = all.trainer, *next = NULL;
    ssdgs_context *context = all.context;
    ssdgs_photo copy = photo;
    int refused = 0;
    if (all.depth || !context || !model) return 0; /* the log hears none of what follows */
    all.depth = 1;
    refused += ssdgs_render(model, &photo.camera, &photo.light, 1, &image) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_model_sort(model) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_context_run(context, 1, NULL, NULL) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_model_reduce(model, 1) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_model_create(context, NULL, 1, &other) == SSDGS_ERR_ARGUMENT && !other;
    refused += ssdgs_model_adopt(model, model) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_model_save(model, FILE_NAME) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_model_load(context, FILE_NAME, &other, NULL) == SSDGS_ERR_ARGUMENT && !other;
    refused += ssdgs_model_load_memory(context, "ply", 3, &other, NULL) == SSDGS_ERR_ARGUMENT && !other;
    ssdgs_metrics metrics;
    refused += ssdgs_compare(context, color, color, 4, 4, &metrics) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_evaluate(model, &photo, photo.light.intensity, NULL, &metrics) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_refine_photo(model, &copy, photo.light.intensity, 1) == SSDGS_ERR_ARGUMENT;
    refused += ssdgs_trainer_create(model, &photo, 1, NULL, &next) == SSDGS_ERR_ARGUMENT && !next;
    int iteration;
    refused += ssdgs_checkpoint_iteration(context, FILE_NAME, &iteration) == SSDGS_ERR_ARGUMENT;
    all.tries += 14;
    if (trainer) {
        refused += ssdgs_trainer_step(trainer, NULL) == SSDGS_ERR_ARGUMENT;
        refused += ssdgs_trainer_run(trainer, NULL, NULL) == SSDGS_ERR_ARGUMENT;
        refused += ssdgs_trainer_save(trainer, FILE_NAME) == SSDGS_ERR_ARGUMENT;
        refused += ssdgs_trainer_load(trainer, FILE_NAME) == SSDGS_ERR_ARGUMENT;
        refused += ssdgs_trainer_refined(trainer, 0, &copy.camera, &copy.light) == SSDGS_ERR_ARGUMENT;
        all.tries += 5;
    }
    ssdgs_trainer_destroy(trainer);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    all.calls += refused;
    all.depth = 0;
    return refused;
}

/* ---- where they come from ---- */

static ssdgs_result hook(void *user, ssdgs_frame *frame) {
    (void)user;
    call_everything();
    return ssdgs_stage_cpu(frame, SSDGS_STAGE_SHADE);
}

static void run(void *user, int count, void (*task)(void *data, int index), void *data) {
    (void)user;
    for (int i = 0; i < count; i++) task(data, i);
    call_everything();
}

static void *allocate(void *user, size_t bytes) {
    (void)user;
    call_everything();
    return malloc(bytes);
}

static void release(void *user, void *memory) {
    (void)user;
    call_everything();
    free(memory);
}

static void hear(void *user, ssdgs_result code, const char *message) {
    (void)user, (void)code;
    char before[512];
    snprintf(before, sizeof before, "%s", message);
    call_everything();
    CHECK(!strcmp(before, message)); /* what is being told stays */
}

static void trace(void *user, const char *name) {
    (void)user, (void)name;
    call_everything();
}

static void test_from_within(void) {
    for (int from = 0; from < 5; from++)
        for (int with_trainer = 0; with_trainer < 2; with_trainer++) {
            ssdgs_context_desc desc;
            ssdgs_real bad = photo.camera.near_plane;
            memset(&desc, 0, sizeof desc);
            desc.threads = 2;
            ssdgs_gpu_hook gpu;
            memset(&gpu, 0, sizeof gpu);
            gpu.stage[SSDGS_STAGE_SHADE] = hook;
            if (from == 0) desc.gpu = &gpu;
            if (from == 1) desc.parallel.run = run;
            if (from == 2) desc.allocator.allocate = allocate, desc.allocator.release = release;
            if (from == 3) desc.logger.write = hear;
            if (from == 4) desc.tracer.stage = trace;
            set_up(&desc, with_trainer);
            all.tries = all.calls = 0;
            if (from == 3) { /* makes the log hear something */
                photo.camera.near_plane = -1;
                CHECK(ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image) == SSDGS_ERR_ARGUMENT);
                CHECK(strstr(ssdgs_error_message(all.context), "near_plane = -1") != NULL);
                photo.camera.near_plane = bad;
            } else if (with_trainer) CHECK(!ssdgs_trainer_run(all.trainer, NULL, NULL));
            else CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image));
            if (!CHECK(all.tries > 0 && all.calls == all.tries))
                printf("    %d: %d of %d refused\n", from, all.calls, all.tries);
            CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image)); /* all are still there */
            if (from < 2 || from == 4)
                CHECK(strstr(ssdgs_error_message(all.context),
                             "ssdgs_context_destroy: another call on this context is at work") != NULL);
            all.depth = 1;
            tear_down();
        }
}

/* ---- what a tracer hears ---- */

static void note_stage(void *user, const char *name) {
    char *heard = (char *)user;
    const size_t length = strlen(heard);
    snprintf(heard + length, 1024 - length, "%s", name ? name : ". ");
}

/* Every stage in order, each closed before the next; frames that keep all but the last stages as well. */
static void test_tracer(void) {
    static const char rendered[] = "project. sort. bin. walk. shade. composite. ";
    char heard[1024] = "", trained[1024];
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.tracer.stage = note_stage;
    desc.tracer.user = heard;
    set_up(&desc, 1);
    CHECK(!*heard);
    for (int i = 0; i < 2; i++, *heard = 0)
        CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image) && !strcmp(heard, rendered));
    *trained = 0;
    for (int i = 0; i < 3; i++)
        snprintf(trained + strlen(trained), sizeof trained - strlen(trained),
                 "%scomposite backward. shade backward. project backward. ", rendered);
    CHECK(!ssdgs_trainer_run(all.trainer, NULL, NULL) && !strcmp(heard, trained));
    tear_down();
}

/* A program's own tasks. */
static void count_task(void *data, int index) { ((int *)data)[index]++; }

static void test_run(void) {
    static int done[1000];
    for (int threads = 1; threads < 4; threads += 2) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = threads;
        set_up(&desc, 0);
        memset(done, 0, sizeof done);
        CHECK(!ssdgs_context_run(all.context, 1000, count_task, done));
        for (int i = 0; i < 1000; i++) CHECK(done[i] == 1);
        CHECK(!ssdgs_context_run(all.context, 0, NULL, NULL));
        CHECK(ssdgs_context_run(all.context, 1, NULL, done) == SSDGS_ERR_ARGUMENT);
        CHECK(ssdgs_context_run(NULL, 1, count_task, done) == SSDGS_ERR_ARGUMENT && done[0] == 1);
        tear_down();
    }
}

/* ---- the progress callback ---- */

static int steps; /* of the trainer */

static int progress(void *user, const ssdgs_train_stats *stats) {
    (void)user;
    steps = stats->iteration;
    CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image));
    ssdgs_metrics metrics;
    CHECK(!ssdgs_evaluate(all.model, &photo, photo.light.intensity, NULL, &metrics));
    CHECK(!ssdgs_model_save(all.model, FILE_NAME));
    ssdgs_trainer_destroy(all.trainer); /* refused */
    CHECK(strstr(ssdgs_error_message(all.context), "ssdgs_trainer_destroy: the trainer runs") != NULL);
    if (all.model && steps == 2) { /* these go with the trainer */
        ssdgs_model_destroy(all.model);
        ssdgs_context_destroy(all.context);
        return 0;
    }
    return 1;
}

static void test_progress(void) {
    set_up(NULL, 1);
    CHECK(ssdgs_trainer_run(all.trainer, progress, NULL) == SSDGS_ERR_CANCELLED && steps == 2);
    ssdgs_trainer_destroy(all.trainer);
    remove(FILE_NAME);
}

/* ---- the order of destroying ---- */

static int blocks, notes;

static void *count_in(void *user, size_t bytes) {
    void *memory = malloc(bytes);
    (void)user;
    blocks += memory != NULL;
    return memory;
}

static void count_out(void *user, void *memory) {
    (void)user;
    blocks -= memory != NULL;
    free(memory);
}

static void count_notes(void *user, ssdgs_result code, const char *message) {
    (void)user;
    notes += code == SSDGS_OK && (strstr(message, "go with the last") || strstr(message, "goes with it") ||
                                  strstr(message, "the context goes"));
}

/* Whatever goes first, everything works as long as it is there, is told, and nothing is left over. */
static void test_order(void) {
    static const char *const orders[6] = {"tmc", "tcm", "mtc", "mct", "ctm", "cmt"};
    static const int told[6] = {0, 1, 1, 2, 1, 2};
    for (int i = 0; i < 6; i++) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = 3;
        desc.allocator.allocate = count_in;
        desc.allocator.release = count_out;
        desc.logger.write = count_notes;
        blocks = notes = 0;
        set_up(&desc, 1);
        notes = 0;
        for (int k = 0; k < 3; k++) {
            const char gone = orders[i][k];
            if (gone == 't') ssdgs_trainer_destroy(all.trainer);
            if (gone == 'm') ssdgs_model_destroy(all.model);
            if (gone == 'c') ssdgs_context_destroy(all.context);
            if (k == 0 && gone != 'm')
                CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image));
            if (k == 0 && gone != 't') CHECK(!ssdgs_trainer_step(all.trainer, NULL));
            if (k == 1 && orders[i][2] == 't') CHECK(!ssdgs_trainer_step(all.trainer, NULL));
        }
        if (!CHECK(blocks == 0 && notes == told[i]))
            printf("    %s: %d blocks left, told %d times\n", orders[i], blocks, notes);
    }
}

/* A forked process has no threads but the one that forked: it renders the same without, and ends. */
static void test_fork(void) {
#if !defined(_WIN32) && !defined(SSDGS_NO_THREADS)
    static ssdgs_real first[SIDE * SIDE * 3];
    for (int round = 0; round < 20; round++) { /* workers are at different points */
        int status = 0;
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = 4;
        set_up(&desc, 1);
        CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image));
        memcpy(first, color, sizeof first);
        fflush(stdout);
        const pid_t child = fork();
        if (child == 0) {
            alarm(20); /* hangs */
            memset(color, 0, sizeof color);
            int good = round % 2 || !ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image);
            good = good && (round % 2 || !memcmp(first, color, sizeof first));
            tear_down();
            _exit(good ? 0 : 1);
        }
        CHECK(child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
              WEXITSTATUS(status) == 0);
        CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image) &&
              !memcmp(first, color, sizeof first));
        tear_down();
    }
#endif
}

/* ---- arguments ---- */

#define NAMES(call, text) \
    do { \
        CHECK(ssdgs_model_create(all.context, NULL, -7, &other) == \
              SSDGS_ERR_ARGUMENT); /* another call's message */ \
        if (!CHECK((call) == SSDGS_ERR_ARGUMENT && !strcmp(ssdgs_error_message(all.context), text))) \
            printf("    \"%s\", not \"%s\"\n", ssdgs_error_message(all.context), text); \
    } while (0)

static void test_null(void) {
    const ssdgs_real three[3] = {0, 0, 0};
    ssdgs_model *other = NULL;
    ssdgs_trainer *none = NULL;
    unsigned char byte = 7;
    ssdgs_real value = 7;
    set_up(NULL, 1);
    NAMES(ssdgs_render(all.model, NULL, &photo.light, 1, &image), "ssdgs_render: camera is NULL");
    NAMES(ssdgs_render(all.model, &photo.camera, &photo.light, 1, NULL), "ssdgs_render: image is NULL");
    NAMES(ssdgs_model_create(all.context, NULL, 1, NULL), "ssdgs_model_create: out is NULL");
    NAMES(ssdgs_model_adopt(all.model, NULL), "ssdgs_model_adopt: original is NULL");
    NAMES(ssdgs_model_save(all.model, NULL), "ssdgs_model_save: path is NULL");
    NAMES(ssdgs_model_load(all.context, NULL, &other, NULL), "ssdgs_model_load: path is NULL");
    NAMES(ssdgs_model_load(all.context, FILE_NAME, NULL, NULL), "ssdgs_model_load: out is NULL");
    NAMES(ssdgs_model_load_memory(all.context, NULL, 3, &other, NULL),
          "ssdgs_model_load_memory: bytes is NULL");
    NAMES(ssdgs_model_load_memory(all.context, "ply", 3, NULL, NULL), "ssdgs_model_load_memory: out is NULL");
    ssdgs_metrics metrics;
    NAMES(ssdgs_compare(all.context, NULL, color, 4, 4, &metrics), "ssdgs_compare: image is NULL");
    NAMES(ssdgs_compare(all.context, color, color, 4, 4, NULL), "ssdgs_compare: metrics is NULL");
    NAMES(ssdgs_evaluate(all.model, NULL, three, NULL, &metrics), "ssdgs_evaluate: photo is NULL");
    NAMES(ssdgs_evaluate(all.model, &photo, NULL, NULL, &metrics), "ssdgs_evaluate: background is NULL");
    NAMES(ssdgs_evaluate(all.model, &photo, three, NULL, NULL), "ssdgs_evaluate: metrics is NULL");
    NAMES(ssdgs_refine_photo(all.model, NULL, three, 1), "ssdgs_refine_photo: photo is NULL");
    NAMES(ssdgs_refine_photo(all.model, &photo, NULL, 1), "ssdgs_refine_photo: background is NULL");
    NAMES(ssdgs_refine_photo(all.model, &photo, three, -1), "ssdgs_refine_photo: -1 iterations");
    NAMES(ssdgs_trainer_create(all.model, &photo, 1, NULL, NULL), "ssdgs_trainer_create: out is NULL");
    ssdgs_light light;
    NAMES(ssdgs_trainer_refined(all.trainer, 0, NULL, &light), "ssdgs_trainer_refined: camera is NULL");
    ssdgs_camera camera;
    NAMES(ssdgs_trainer_refined(all.trainer, 0, &camera, NULL), "ssdgs_trainer_refined: light is NULL");
    NAMES(ssdgs_trainer_refined(all.trainer, 1, &camera, &light), "ssdgs_trainer_refined: photograph 1 of 1");
    NAMES(ssdgs_trainer_save(all.trainer, NULL), "ssdgs_trainer_save: path is NULL");
    NAMES(ssdgs_trainer_load(all.trainer, NULL), "ssdgs_trainer_load: path is NULL");
    int iteration;
    NAMES(ssdgs_checkpoint_iteration(all.context, NULL, &iteration),
          "ssdgs_checkpoint_iteration: path is NULL");
    NAMES(ssdgs_checkpoint_iteration(all.context, FILE_NAME, NULL),
          "ssdgs_checkpoint_iteration: iteration is NULL");
    NAMES(ssdgs_model_adopt(all.model, all.model), "ssdgs_model_adopt: a trainer has the model");
    NAMES(ssdgs_model_reduce(all.model, 1), "ssdgs_model_reduce: a trainer has the model");
    NAMES(ssdgs_model_reduce(all.model, 0), "ssdgs_model_reduce: 0 Gaussians");
    CHECK(!other);
    CHECK(ssdgs_render(NULL, &photo.camera, NULL, 0, &image) && ssdgs_model_sort(NULL) &&
          ssdgs_model_adopt(NULL, all.model) && ssdgs_model_save(NULL, FILE_NAME) &&
          ssdgs_trainer_step(NULL, NULL) && ssdgs_trainer_run(NULL, NULL, NULL) &&
          ssdgs_trainer_create(NULL, &photo, 1, NULL, &none) && ssdgs_stage_cpu(NULL, SSDGS_STAGE_SORT));
    camera = ssdgs_camera_look_at(NULL, three, three, 1, 4, 4);
    CHECK(camera.width == 0 && ssdgs_render(all.model, &camera, NULL, 0, &image) == SSDGS_ERR_ARGUMENT);
    camera = ssdgs_camera_look_at(three, NULL, three, 1, 4, 4);
    CHECK(camera.width == 0);
    camera = ssdgs_camera_look_at(three, three, NULL, 1, 4, 4);
    CHECK(camera.width == 0);
    ssdgs_to_bytes(NULL, 1, 0, &byte);
    ssdgs_to_bytes(&value, 1, 0, NULL);
    ssdgs_compose(NULL, &value, 1, 0, three, &value);
    ssdgs_compose(three, NULL, 1, 0, three, &value);
    ssdgs_compose(three, &value, 1, 0, NULL, &value);
    ssdgs_compose(three, &value, 1, 0, three, NULL);
    ssdgs_to_pixels(NULL, 1, 1, 0, SSDGS_RGBA8, &byte, 4);
    ssdgs_to_pixels(&image, 1, 1, 0, SSDGS_RGBA8, NULL, 4);
    CHECK(byte == 7 && value >= 7 && value <= 7);
    ssdgs_trainer_destroy(NULL);
    ssdgs_model_destroy(NULL);
    ssdgs_context_destroy(NULL);
    tear_down();
}

/* A shared parameter that is no number is in every Gaussian: no frame is drawn with it, none is trained, and
   the message names it. */
static void test_shared(void) {
    static const char *const names[5] = {"asg_basis", "asg_sharpness", "asg_sigma", "the scattering network",
                                         "the shadow network"};
    for (int group = 0; group < 5; group++)
        for (int kind = 0; kind < 2; kind++) {
            set_up(NULL, 1);
            CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image));
            ssdgs_model_view view = ssdgs_model_arrays(all.model);
            ssdgs_real *at[5];
            at[0] = view.asg_basis, at[1] = view.asg_sharpness, at[2] = view.asg_sigma,
            at[3] = view.scattering, at[4] = view.shadow;
            at[group][5] = kind ? (ssdgs_real)NAN : (ssdgs_real)INFINITY;
            char text[100];
            snprintf(text, sizeof text, "model: value 5 of %s is not finite", names[group]);
            CHECK(ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image) == SSDGS_ERR_NONFINITE);
            if (!CHECK(!strcmp(ssdgs_error_message(all.context), text)))
                printf("    %s\n", ssdgs_error_message(all.context));
            CHECK(ssdgs_trainer_run(all.trainer, NULL, NULL) == SSDGS_ERR_NONFINITE);
            snprintf(text, sizeof text, FILE_NAME ": model: value 5 of %s is not finite", names[group]);
            CHECK(ssdgs_model_save(all.model, FILE_NAME) == SSDGS_ERR_NONFINITE &&
                  !strcmp(ssdgs_error_message(all.context), text));
            view = ssdgs_model_arrays(all.model);
            at[group][5] = 0;
            CHECK(!ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image));
            tear_down();
        }
}

/* ---- images as bytes ---- */

static double curve(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055; }

/* Every 97th float of 0 .. 1 and beyond: at most one level off, every byte comes back, steps never go
   down. */
static void test_bytes(void) {
    const ssdgs_real odd[8] = {-1, (ssdgs_real)-1e30,    (ssdgs_real)NAN,      0, 1,
                               2,  (ssdgs_real)INFINITY, (ssdgs_real)-INFINITY};
    const unsigned char want[8] = {0, 0, 0, 0, 255, 255, 255, 0};
    for (int transfer = 0; transfer < 2; transfer++) {
        ssdgs_real *many = (ssdgs_real *)malloc(4096 * sizeof *many);
        unsigned char *out = (unsigned char *)malloc(4096);
        uint32_t bits = 0x33000000u;
        int off = 0, before = 0, falls = 0;
        unsigned char got[8];
        ssdgs_to_bytes(odd, 8, transfer, got);
        CHECK(!memcmp(got, want, 8));
        while (bits < 0x3F900000u) {
            for (int i = 0; i < 4096; i++, bits += 97) {
                float x;
                memcpy(&x, &bits, sizeof x);
                many[i] = (ssdgs_real)x;
            }
            ssdgs_to_bytes(many, 4096, transfer, out);
            for (int i = 0; i < 4096; i++) {
                const double x = many[i] < 1 ? (double)many[i] : 1,
                             level = 255 * (transfer == SSDGS_TRANSFER_SRGB ? curve(x) : x);
                off += fabs(out[i] - level) > 1;
                falls += out[i] < before;
                before = out[i];
            }
        }
        CHECK(off == 0 && falls == 0);
        ssdgs_real values[256];
        for (int i = 0; i < 256; i++)
            values[i] = transfer == SSDGS_TRANSFER_SRGB ? ssdgs_srgb_decode((ssdgs_real)(i / 255.0))
                                                        : (ssdgs_real)(i / 255.0);
        unsigned char bytes[256];
        ssdgs_to_bytes(values, 256, transfer, bytes);
        int i;
        for (i = 0; i < 256 && bytes[i] == i; i++) {}
        CHECK(i == 256);
        free(many);
        free(out);
    }
}

/* The value of a half, by its definition. */
static double half_value(unsigned half) {
    const int exponent = (int)(half >> 10 & 31);
    const double rest = half & 1023, sign = half & 0x8000 ? -1 : 1;
    return sign * (exponent ? ldexp(1024 + rest, exponent - 25) : ldexp(rest, -24));
}

/* Every finite half comes back, and what lies between two goes to the nearer one, or the even one. */
static void test_halves(void) {
    int wrong = 0;
    for (unsigned half = 0; half < 0xFC00; half++) {
        if ((half & 0x7FFF) >= 0x7C00) continue;
        const double value = half_value(half), next = half_value(half + 1);
        ssdgs_real linear[9];
        ssdgs_image from;
        uint16_t out[12];
        for (int i = 0; i < 9; i++)
            linear[i] = (ssdgs_real)(value + (next - value) * (i / 3 == 0 ? 0 : i / 3 == 1 ? 0.5 : 0.75));
        memset(&from, 0, sizeof from);
        from.color = linear;
        ssdgs_to_pixels(&from, 3, 1, SSDGS_TRANSFER_SRGB, SSDGS_RGBA16F, out, 24);
        const int last =
            (half & 0x7FFF) == 0x7BFF; /* half_value() of what follows is the number infinity is for */
        wrong += out[0] != half || out[4] != (half & 1 ? half + 1 : half) || out[8] != half + 1;
        wrong += out[3] != 0x3C00 || (last && (out[4] & 0x7FFF) != 0x7C00);
    }
    CHECK(wrong == 0);
    ssdgs_real linear[3] = {(ssdgs_real)NAN, (ssdgs_real)1e9, (ssdgs_real)-1e9};
    ssdgs_image from;
    uint16_t out[4];
    memset(&from, 0, sizeof from);
    from.color = linear;
    ssdgs_to_pixels(&from, 1, 1, SSDGS_TRANSFER_SRGB, SSDGS_RGBA16F, out, 8);
    ssdgs_image veil;
    memset(&veil, 0, sizeof veil);
    ssdgs_real black[3] = {0, 0, 0}, cover = (ssdgs_real)0.5;
    veil.color = black, veil.alpha = &cover;
    for (uint16_t small = 2; small < 0x800; small = (uint16_t)(small + 2)) { /* subnormal and a little more */
        uint16_t under[4] = {small, (uint16_t)(small | 0x8000), 0, 0};
        ssdgs_blend_pixels(&veil, 1, 1, SSDGS_TRANSFER_NONE, SSDGS_RGBA16F, under, 8);
        wrong += half_value(under[0]) != half_value(small) / 2 || under[1] != (under[0] | 0x8000);
    }
    CHECK(wrong == 0);
    CHECK((out[0] & 0x7FFF) > 0x7C00 && out[1] == 0x7C00 && out[2] == 0xFC00);
}

/* color + (1 - alpha) x what is there, by light, in every format; nothing where alpha is 0. */
static void test_blended(void) {
    enum { N = 400 };
    static ssdgs_real linear[3 * N], cover[N];
    ssdgs_image from;
    memset(&from, 0, sizeof from);
    from.color = linear, from.alpha = cover;
    for (uint64_t i = 0; i < N; i++) {
        cover[i] = (ssdgs_real)(i % 5) / 4;
        for (uint64_t c = 0; c < 3; c++)
            linear[3 * i + c] = cover[i] * (ssdgs_real)test_uniform(5, 3 * i + c);
    }
    for (int format = SSDGS_RGBA8; format <= SSDGS_RGBA32F; format++)
        for (int transfer = 0; transfer < 2; transfer++) {
            static unsigned char bytes[4 * N];
            static uint16_t halves[4 * N];
            static float floats[4 * N];
            double worst = 0;
            for (uint64_t i = 0; i < 4 * N; i++) {
                floats[i] = (float)test_uniform(6, i);
                bytes[i] = (unsigned char)(255 * test_uniform(6, i));
                halves[i] = (uint16_t)(0x3C00 * test_uniform(7, i));
            }
            void *to = format == SSDGS_RGBA32F   ? (void *)floats
                       : format == SSDGS_RGBA16F ? (void *)halves
                                                 : (void *)bytes;
            static unsigned char bytes_before[4 * N];
            static uint16_t halves_before[4 * N];
            static float floats_before[4 * N];
            memcpy(bytes_before, bytes, sizeof bytes);
            memcpy(halves_before, halves, sizeof halves);
            memcpy(floats_before, floats, sizeof floats);
            ssdgs_blend_pixels(&from, N / 4, 4, transfer, (ssdgs_format)format, to,
                               N * (format == SSDGS_RGBA32F   ? 4
                                    : format == SSDGS_RGBA16F ? 2
                                                              : 1));
            for (int i = 0; i < 4 * N; i++) {
                const int c = i % 4 == 3 ? 3 : format == SSDGS_BGRA8 ? 2 - i % 4 : i % 4;
                const double a = (double)cover[i / 4], add = c == 3 ? a : (double)linear[3 * (i / 4) + c];
                double error;
                if (format == SSDGS_RGBA32F)
                    error = (double)floats[i] - (add + (1 - a) * (double)floats_before[i]);
                else if (format == SSDGS_RGBA16F)
                    error = (half_value(halves[i]) - (add + (1 - a) * half_value(halves_before[i]))) / 16;
                else {
                    const double was = bytes_before[i] / 255.0;
                    const int bend = c < 3 && transfer == SSDGS_TRANSFER_SRGB;
                    const double light = bend ? (double)ssdgs_srgb_decode((ssdgs_real)was) : was;
                    const double now = add + (1 - a) * light;
                    error = (bytes[i] - 255 * (bend ? curve(now) : now)) / 1e4;
                    if (!(a > 0)) CHECK(bytes[i] == bytes_before[i]);
                }
                worst = test_most(worst, fabs(error));
            }
            CHECK(worst < (format == SSDGS_RGBA32F ? 1e-6 : 1.1e-4));
        }
}

/* Rows, strides and orders of ssdgs_to_pixels(), and straight colours; ssdgs_compose() to 2e-5 of the
   formula, beyond 1 too. */
static void test_pixels(void) {
    enum { W = 5, H = 4, STRIDE = 7, PITCH = 32 };
    ssdgs_real background[3] = {(ssdgs_real)0.2, 0, 1};
    ssdgs_image from;
    memset(&from, 0, sizeof from);
    from.stride = STRIDE;
    ssdgs_real colors[H * STRIDE * 3];
    from.color = colors;
    ssdgs_real alphas[H * STRIDE];
    for (int y = 0; y < H * STRIDE; y++) {
        alphas[y] = (ssdgs_real)(y % 5) / 4;
        for (int c = 0; c < 3; c++)
            colors[3 * y + c] = alphas[y] * (ssdgs_real)test_uniform(2, (uint64_t)(3 * y + c));
    }
    unsigned char out[H * PITCH];
    for (int opaque = 0; opaque < 2; opaque++)
        for (int bgra = 0; bgra < 2; bgra++)
            for (int up = 0; up < 2; up++) {
                int wrong = 0;
                from.alpha = opaque ? NULL : alphas;
                memset(out, 77, sizeof out);
                ssdgs_to_pixels(&from, W, H, SSDGS_TRANSFER_SRGB, bgra ? SSDGS_BGRA8 : SSDGS_RGBA8,
                                up ? out + (H - 1) * PITCH : out, up ? -PITCH : PITCH);
                for (int y = 0; y < H; y++)
                    for (int x = 0; x < PITCH; x++) {
                        const unsigned char *p = out + (up ? H - 1 - y : y) * PITCH + x;
                        const int at = y * STRIDE + x / 4, channel = x % 4 == 3 ? 3
                                                                     : bgra     ? 2 - x % 4
                                                                                : x % 4;
                        const double a = opaque || x >= 4 * W ? 1 : (double)alphas[at];
                        if (x >= 4 * W) wrong += *p != 77;
                        else if (channel == 3)
                            wrong += a > 0 && a < 1 ? fabs(*p - 255 * a) > 1 : *p != (int)(255 * a);
                        else
                            wrong += fabs(*p - 255 * (a > 0 ? curve((double)colors[3 * at + channel] / a)
                                                            : 0)) > 1;
                    }
                CHECK(wrong == 0);
            }
    test_halves();
    test_blended();
    for (int x = 0; x < 3000; x++) {
        const double a = (x % 7 + 1) / 7.0, v = pow(10, -6 + 8.0 * x / 3000);
        const ssdgs_real color3[3] = {(ssdgs_real)(a * v), (ssdgs_real)(-a * v), 0}, one = (ssdgs_real)a;
        const double want[3] = {a * curve(v) + (1 - a) * 0.2, -a * 12.92 * v, 1 - a};
        ssdgs_real stored[3];
        ssdgs_compose(color3, &one, 1, SSDGS_TRANSFER_SRGB, background, stored);
        CHECK_NEAR(stored, want, 3, 3e-7, 2e-5, "composed");
    }
}

int main(void) {
    test_from_within();
    test_tracer();
    test_run();
    test_progress();
    test_order();
    test_fork();
    test_null();
    test_shared();
    test_bytes();
    test_pixels();
    TEST_END();
}
