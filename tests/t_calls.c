/* Calls that the manual does not allow, and what must come of them: from hooks, tasks, the allocator, the log
   and other threads; after a fork; in the wrong order; with NULL; with shared parameters that are not finite.
   And the rows of images, and the bytes that they become. cc -o build/t_calls tests/t_calls.c -lm -lpthread
   && build/t_calls       (writes under build/) */
#ifndef _DEFAULT_SOURCE
#define _DEFAULT_SOURCE /* fork, alarm */
#endif
#include <limits.h>
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"
#ifndef _WIN32
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>
#endif
#if !defined(_WIN32) && !defined(SSDGS_NO_THREADS)
#include <pthread.h>
#define THREADS 1 /* to call from */
#else
#define THREADS 0
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
    ssdgs_scene *scene;
    ssdgs_model *model;
    ssdgs_trainer *trainer;
    int tries, calls, depth; /* how many calls were refused, of how many; 1 within one of them */
    int told;                /* 1 while the log hears a message, which stays */
    int elsewhere;           /* 1: calls come from another thread than the callback's */
} all;
static ssdgs_context *home; /* of guest, which no call is at work on */
static ssdgs_model *guest;

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
    if (!CHECK(!ssdgs_context_create(desc, &all.context) && !ssdgs_scene_create(all.context, &all.scene) &&
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
    ssdgs_scene_destroy(all.scene);
    ssdgs_context_destroy(all.context);
}

static ssdgs_result render(void) { return ssdgs_render(all.model, &photo.camera, &photo.light, 1, &image); }

/* Of the model, or of nothing. */
static ssdgs_result render_scene(int objects) {
    const ssdgs_object object = ssdgs_object_default(all.model);
    return ssdgs_scene_render(all.scene, objects ? &object : NULL, objects, &photo.camera, &photo.light, 1,
                              NULL, &image, NULL);
}

static int take_none(void *user, const void *bytes, size_t size) { return !user && bytes && size; }
static void count_task(void *data, int index) { ((int *)data)[index]++; }
static void count_high(void *data, int index) {
    if (!CHECK(index >= 0)) exit(1); /* there would be no end */
    ((int *)data)[index >> 29]++;
}

/* A call has come back, as it must: the message says of this function why. */
static void refused(ssdgs_result result, const char *function) {
    const char *message = ssdgs_error_message(all.context);
    const size_t length = strcspn(message, ":"); /* ssdgs_render_ex is called ssdgs_render */
    const int named = length > 0 && !strncmp(message, function, length) &&
                      strstr(message, ": another call on this context is at work") == message + length,
              good = result == SSDGS_ERR_ARGUMENT && (named || all.told);
    all.tries++;
    all.calls += good;
    if (!good) printf("    %s was not refused\n", function);
}

/* After one that was not refused nothing is as it should be: no more calls. */
#define REFUSED(function, ...) (all.calls < all.tries ? (void)0 : refused(function(__VA_ARGS__), #function))
#define IGNORED(function, ...) \
    (all.calls < all.tries ? (void)0 : (function(__VA_ARGS__), refused(SSDGS_ERR_ARGUMENT, #function)))

/* Pixels are made all the same, by the calling thread alone, and the message stays. */
static void make_pixels(void) {
    ssdgs_real one[3] = {(ssdgs_real)0.5, (ssdgs_real)0.25, 1};
    unsigned char bytes[4] = {0, 0, 0, 0};
    char before[200];
    ssdgs_image from;
    memset(&from, 0, sizeof from);
    from.color = one;
    snprintf(before, sizeof before, "%s", ssdgs_error_message(all.context));
    ssdgs_to_pixels(all.context, &from, 1, 1, SSDGS_TRANSFER_NONE, SSDGS_BGRA8, bytes, 4);
    CHECK(bytes[0] == 255 && bytes[1] == 64 && bytes[2] == 128 && bytes[3] == 255);
    CHECK(!strcmp(before, ssdgs_error_message(all.context)));
}

/* Makes every call that may not be made while another is at work (tests/builds.sh looks that none is
   missing); each must be refused, and nothing may change or crash. */
static void call_everything(void) {
    ssdgs_context *context = all.context;
    ssdgs_scene *scene = all.scene, *stage = NULL;
    ssdgs_model *model = all.model, *other = NULL;
    ssdgs_trainer *trainer = all.trainer, *next = NULL;
    ssdgs_photo copy;
    const float floats[1] = {0};
    const ssdgs_object object = ssdgs_object_default(model);
    ssdgs_gaussian gaussian = ssdgs_gaussian_default();
    const ssdgs_real rough[2] = {(ssdgs_real)0.3, (ssdgs_real)0.3};
    ssdgs_real low[3], high[3], matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -1, 0};
    ssdgs_metrics metrics;
    int iteration, done = 0;
    if (all.depth || !context || !model) return; /* the log hears none of what follows */
    all.depth = 1;
    make_pixels();
    memcpy(&copy, &photo, sizeof copy);
    IGNORED(ssdgs_context_trim, context);
    REFUSED(ssdgs_context_run, context, 1, count_task, &done);
    REFUSED(ssdgs_camera_from_matrices, context, matrix, matrix, 0, 4, 4, &copy.camera);
    REFUSED(ssdgs_depth_from_buffer, context, matrix, 0, floats, 4, 1, 1, matrix);
    REFUSED(ssdgs_compare, context, color, color, 4, 4, &metrics);
    REFUSED(ssdgs_checkpoint_iteration, context, FILE_NAME, &iteration, NULL);
    REFUSED(ssdgs_render_ex, model, &photo.camera, &photo.light, 1, NULL, &image, NULL);
    REFUSED(ssdgs_model_create, context, NULL, 1, &other);
    REFUSED(ssdgs_render, model, &photo.camera, &photo.light, 1, &image);
    REFUSED(ssdgs_model_load_memory, context, "ply", 3, &other, NULL);
    REFUSED(ssdgs_model_load, context, FILE_NAME, &other, NULL);
    REFUSED(ssdgs_model_write, model, take_none, NULL);
    REFUSED(ssdgs_model_save, model, FILE_NAME);
    REFUSED(ssdgs_model_set, model, 0, &gaussian);
    REFUSED(ssdgs_model_get, model, 0, &gaussian);
    REFUSED(ssdgs_gaussian_mirror, model, rough, &gaussian);
    REFUSED(ssdgs_model_bounds, model, low, high);
    REFUSED(ssdgs_model_sort, model);
    REFUSED(ssdgs_model_move, model, home);
    REFUSED(ssdgs_evaluate, model, &photo, photo.light.intensity, NULL, &metrics);
    REFUSED(ssdgs_model_move, guest, context);
    REFUSED(ssdgs_refine_photo, model, &copy, photo.light.intensity, 1);
    REFUSED(ssdgs_scene_create, context, &stage);
    REFUSED(ssdgs_scene_render, scene, &object, 1, &photo.camera, &photo.light, 1, NULL, &image, NULL);
    REFUSED(ssdgs_scene_light, scene, &object, 1, &photo.camera, &photo.light, 1, NULL);
    ssdgs_light_map light_map;
    REFUSED(ssdgs_scene_light_map, scene, 0, &light_map, NULL, NULL);
    REFUSED(ssdgs_scene_shadow, scene, 0, gaussian.position, 1, low);
    IGNORED(ssdgs_scene_occlude, scene, NULL);
    REFUSED(ssdgs_trainer_create, model, &photo, 1, NULL, &next);
    if (trainer) {
        REFUSED(ssdgs_trainer_step, trainer, NULL);
        REFUSED(ssdgs_trainer_run, trainer, NULL, NULL);
        REFUSED(ssdgs_trainer_save, trainer, FILE_NAME);
        REFUSED(ssdgs_trainer_load, trainer, FILE_NAME);
        REFUSED(ssdgs_trainer_refined, trainer, 0, &copy.camera, &copy.light);
        IGNORED(ssdgs_trainer_destroy, trainer);
    }
    IGNORED(ssdgs_scene_destroy, scene);
    IGNORED(ssdgs_model_destroy, model);
    IGNORED(ssdgs_context_destroy, context);
    all.tries++;
    all.calls += !done && !other && !stage && !next && !memcmp(&copy, &photo, sizeof copy);
    all.depth = 0;
}

/* ---- where they come from ---- */

static int met, strangers; /* how many callbacks ran; on another thread than the program's */

#if THREADS
static pthread_t mine;

static void *call_on_thread(void *data) {
    call_everything();
    return data;
}
#endif

/* A callback runs. */
static void meet(void) {
    met++;
#if THREADS
    strangers += !pthread_equal(pthread_self(), mine);
#endif
}

static void call_back(void) {
    meet();
#if THREADS
    pthread_t thread;
    if (all.elsewhere && !all.depth) {
        if (!pthread_create(&thread, NULL, call_on_thread, NULL)) pthread_join(thread, NULL);
        return;
    }
#endif
    call_everything();
}

static ssdgs_result hook(void *user, ssdgs_frame *frame) {
    (void)user;
    call_back();
    return ssdgs_stage_cpu(frame, SSDGS_STAGE_SHADE);
}

static ssdgs_result fetch(void *user, ssdgs_frame *frame, ssdgs_stage stage) {
    (void)user, (void)frame, (void)stage;
    call_back();
    return SSDGS_OK;
}

static void released(void *user, const void *gone) {
    (void)user, (void)gone;
    call_back();
}

static void run(void *user, int count, void (*task)(void *data, int index), void *data) {
    (void)user;
    for (int i = 0; i < count; i++) task(data, i);
    call_back();
}

static void *allocate(void *user, size_t bytes) {
    (void)user;
    call_back();
    return malloc(bytes);
}

static void release(void *user, void *memory) {
    (void)user;
    call_back();
    free(memory);
}

static void hear(void *user, ssdgs_result code, const char *message) {
    (void)user, (void)code;
    char before[512];
    snprintf(before, sizeof before, "%s", message);
    all.told = 1;
    call_back();
    all.told = 0;
    CHECK(!strcmp(before, message)); /* what is being told stays */
}

static void trace(void *user, const char *name) {
    (void)user, (void)name;
    call_back();
}

static void test_from(int from, int with_trainer, int elsewhere) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = 4;
    ssdgs_gpu_hook gpu;
    memset(&gpu, 0, sizeof gpu);
    gpu.stage[SSDGS_STAGE_SHADE] = hook;
    gpu.fetch = fetch;
    gpu.released = released;
    if (from == 0) desc.gpu = &gpu;
    if (from == 1) desc.parallel.run = run;
    if (from == 2) desc.allocator.allocate = allocate, desc.allocator.release = release;
    if (from == 3) desc.logger.write = hear;
    if (from == 4) desc.tracer.stage = trace;
    set_up(&desc, with_trainer);
    all.tries = all.calls = 0;
    all.elsewhere = elsewhere;
    if (from == 3) { /* makes the log hear something */
        const ssdgs_real good = photo.camera.near_plane;
        photo.camera.near_plane = -1;
        CHECK(render() == SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(all.context), "near_plane = -1") != NULL);
        photo.camera.near_plane = good;
    } else if (with_trainer) CHECK(!ssdgs_trainer_run(all.trainer, NULL, NULL));
    else CHECK(!render());
    CHECK(!render_scene(1));
    if (!CHECK(all.tries > 0 && all.calls == all.tries))
        printf("    %d: %d of %d refused\n", from, all.calls, all.tries);
    all.depth = 1;
    CHECK(!render() && !render_scene(1)); /* all are still there */
    tear_down();
}

/* And callbacks run on the caller's thread, whoever works. */
static void test_from_within(void) {
    met = strangers = 0;
    for (int from = 0; from < 5; from++)
        for (int with_trainer = 0; with_trainer < 2; with_trainer++)
            for (int elsewhere = 0; elsewhere <= THREADS; elsewhere++)
                test_from(from, with_trainer, elsewhere);
    CHECK(met > 0 && strangers == 0);
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
    for (int i = 0; i < 2; i++, *heard = 0) CHECK(!render() && !strcmp(heard, rendered));
    *trained = 0;
    for (int i = 0; i < 3; i++)
        snprintf(trained + strlen(trained), sizeof trained - strlen(trained),
                 "%scomposite backward. shade backward. project backward. ", rendered);
    CHECK(!ssdgs_trainer_run(all.trainer, NULL, NULL) && !strcmp(heard, trained));
    tear_down();
}

/* A program's own tasks, one of which calls. */
static void calling_task(void *data, int index) {
    count_task(data, index);
    if (index == 500) call_everything();
}

static void test_run(void) {
    static int done[1000];
    for (int threads = 1; threads < 4; threads += 2) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = threads;
        set_up(&desc, 1);
        memset(done, 0, sizeof done);
        CHECK(!ssdgs_context_run(all.context, 1000, calling_task, done));
        CHECK(all.tries > 0 && all.calls == all.tries);
        for (int i = 0; i < 1000; i++) CHECK(done[i] == 1);
        CHECK(!ssdgs_context_run(all.context, 0, NULL, NULL));
        CHECK(ssdgs_context_run(all.context, 1, NULL, done) == SSDGS_ERR_ARGUMENT &&
              strstr(ssdgs_error_message(all.context), "task is NULL")); /* no longer of those refused */
        CHECK(ssdgs_context_run(NULL, 1, count_task, done) == SSDGS_ERR_ARGUMENT && done[0] == 1);
        tear_down();
    }
}

/* ---- the progress callback ---- */

static int steps; /* of the trainer */

static int progress(void *user, const ssdgs_train_stats *stats) {
    (void)user;
    meet();
    steps = stats->iteration;
    CHECK(!render());
    ssdgs_metrics metrics;
    CHECK(!ssdgs_evaluate(all.model, &photo, photo.light.intensity, NULL, &metrics));
    CHECK(!ssdgs_model_save(all.model, FILE_NAME));
    ssdgs_trainer_destroy(all.trainer); /* refused */
    CHECK(strstr(ssdgs_error_message(all.context), "ssdgs_trainer_destroy: the trainer runs") != NULL);
    if (all.model && steps == 2) { /* these go with the trainer */
        ssdgs_model_destroy(all.model);
        ssdgs_scene_destroy(all.scene);
        ssdgs_context_destroy(all.context);
        return 0;
    }
    return 1;
}

static void test_progress(void) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = 4;
    set_up(&desc, 1);
    met = strangers = 0;
    CHECK(ssdgs_trainer_run(all.trainer, progress, NULL) == SSDGS_ERR_CANCELLED && steps == 2);
    CHECK(met == 2 && strangers == 0);
    ssdgs_trainer_destroy(all.trainer);
    remove(FILE_NAME);
}

/* ---- the order of destroying ---- */

static int notes;

static void count_notes(void *user, ssdgs_result code, const char *message) {
    (void)user;
    notes += code == SSDGS_OK && (strstr(message, "go with the last") || strstr(message, "goes with it") ||
                                  strstr(message, "the context goes"));
}

/* Whatever goes first, everything else works on, the log hears of what waits for the last of its users, and
   nothing is left over. The scene has drawn the model, but does not hold it. */
static void test_order(void) {
    for (int order = 0; order < 24; order++) {
        char left[5] = "tmsc", gone[5] = "";
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = 3;
        test_meter memory;
        memset(&memory, 0, sizeof memory);
        TEST_METER(desc, &memory);
        desc.logger.write = count_notes;
        set_up(&desc, 1);
        CHECK(!render_scene(1));
        notes = 0;
        for (int k = 0, rest = order; k < 4; k++) {
            char *next = left + rest % (4 - k);
            rest /= 4 - k;
            gone[k] = *next;
            memmove(next, next + 1, strlen(next));
            if (gone[k] == 't') ssdgs_trainer_destroy(all.trainer);
            if (gone[k] == 'm') ssdgs_model_destroy(all.model);
            if (gone[k] == 's') ssdgs_scene_destroy(all.scene);
            if (gone[k] == 'c') ssdgs_context_destroy(all.context);
            if (strchr(left, 'm')) CHECK(!render());
            if (strchr(left, 't')) CHECK(!ssdgs_trainer_step(all.trainer, NULL));
            if (strchr(left, 's')) CHECK(!render_scene(strchr(left, 'm') != NULL));
        }
        const int told = (strchr(gone, 'm') < strchr(gone, 't')) + (gone[3] != 'c');
        if (!CHECK(memory.live == 0 && notes == told))
            printf("    %s: %lu bytes left, told %d times\n", gone, (unsigned long)memory.live, notes);
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
        CHECK(!render());
        memcpy(first, color, sizeof first);
        fflush(stdout);
        const pid_t child = fork();
        if (child == 0) {
            alarm(20); /* hangs */
            memset(color, 0, sizeof color);
            int good = round % 2 || !render();
            good = good && (round % 2 || !memcmp(first, color, sizeof first));
            tear_down();
            _exit(good ? 0 : 1);
        }
        CHECK(child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
              WEXITSTATUS(status) == 0);
        CHECK(!render() && !memcmp(first, color, sizeof first));
        tear_down();
    }
#endif
}

/* Forks while a call is at work: the child may not use what that call has half made. A child whose callback
   returns goes on, without threads. */
#if !defined(_WIN32) && !defined(SSDGS_NO_THREADS)
static int forks_at, fork_status, is_child;

static void fork_now(void *user, const char *name) {
    (void)user;
    if (!name || --forks_at) return;
    fflush(stdout);
    const pid_t child = fork();
    if (!child) {
        alarm(20); /* hangs */
        is_child = 1;
        if (render() != SSDGS_ERR_ARGUMENT) _exit(2);
    } else if (child < 0 || waitpid(child, &fork_status, 0) != child) fork_status = -1;
}
#endif

static void test_fork_within(void) {
#if !defined(_WIN32) && !defined(SSDGS_NO_THREADS)
    static ssdgs_real first[SIDE * SIDE * 3];
    for (int round = 0; round < 24; round++) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = 4;
        desc.tracer.stage = fork_now;
        forks_at = 0;
        set_up(&desc, 1);
        CHECK(!render());
        memcpy(first, color, sizeof first);
        ssdgs_model_arrays(all.model); /* all is made again */
        forks_at = 1 + round % 6;
        const ssdgs_result result = render();
        const int same = !result && !memcmp(first, color, sizeof first);
        if (is_child) _exit(same && ssdgs_context_threads(all.context) == 1 ? 0 : 1);
        CHECK(same && WIFEXITED(fork_status) && WEXITSTATUS(fork_status) == 0);
        tear_down();
    }
#endif
}

/* ---- no context ---- */

static void hear_code(void *user, ssdgs_result code, const char *message) {
    ((int *)user)[code] += strstr(message, "ssdgs_context_create: ") == message;
}

static void *no_memory(void *user, size_t bytes) {
    (void)user, (void)bytes;
    return NULL;
}
static void nothing_back(void *user, void *memory) { (void)user, (void)memory; }

static void test_no_context(void) {
    int told[SSDGS_RESULT_COUNT];
    for (int i = 0; i < 5; i++) {
        const ssdgs_result want = i < 3 ? SSDGS_ERR_ARGUMENT : i < 4 ? SSDGS_ERR_ISA : SSDGS_ERR_MEMORY;
        ssdgs_context_desc desc;
        ssdgs_context *none = all.context;
        memset(&desc, 0, sizeof desc);
        memset(told, 0, sizeof told);
        desc.logger.write = hear_code;
        desc.logger.user = told;
        if (i < 2) desc.threads = i ? 1025 : -1;
        if (i == 2 || i == 4) desc.allocator.allocate = no_memory;
        if (i == 4) desc.allocator.release = nothing_back;
        if (i == 3) desc.isa = SSDGS_ISA_COUNT;
        CHECK(ssdgs_context_create(&desc, &none) == want && !none && told[want] == 1);
    }
}

/* ---- numbers ---- */

static void test_odd_numbers(void) {
    static const struct {
        double value;
        const char *text;
    } numbers[] = {{0, "0"},
                   {-7, "-7"},
                   {1e30, "1e+30"},
                   {9.9999999e30, "1e+31"},
                   {-2.5e-9, "-2.5e-09"},
                   {-123456789012.0, "-123456789012"},
                   {0.125, "0.125"},
                   {1e-300, "1e-300"},
                   {1.5e300, "1.5e+300"}};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        char text[SSDGS__MESSAGE] = "";
        size_t at = 0;
        ssdgs__append_number(text, &at, numbers[i].value);
        if (!CHECK(!strcmp(text, numbers[i].text))) printf("    %s, not %s\n", text, numbers[i].text);
    }
    if (test_denormal() > 0) {
        char text[SSDGS__MESSAGE] = "";
        size_t at = 0;
        ssdgs__append_number(text, &at, 5e-324);
        CHECK(!strncmp(text, "4.94", 4) && strstr(text, "e-324") != NULL);
    }
    CHECK(ssdgs__times(6, 7) == 42 && ssdgs__times(SIZE_MAX / 2, 3) == SIZE_MAX && ssdgs__times(0, 3) == 0);
    int done[8] = {0}; /* in groups, up to the last int */
    ssdgs__group_job job;
    job.task = count_high;
    job.data = done;
    job.count = INT_MAX;
    job.groups = 1 << 29;
    ssdgs__group_task(&job, 5);
    for (int i = 0; i < 8; i++) CHECK(done[i] == (i < 4));
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
    NAMES(ssdgs_checkpoint_iteration(all.context, NULL, &iteration, NULL),
          "ssdgs_checkpoint_iteration: path is NULL");
    NAMES(ssdgs_checkpoint_iteration(all.context, FILE_NAME, NULL, NULL),
          "ssdgs_checkpoint_iteration: iteration is NULL");
    CHECK(!other);
    CHECK(ssdgs_render(NULL, &photo.camera, NULL, 0, &image) && ssdgs_model_sort(NULL) &&
          ssdgs_model_save(NULL, FILE_NAME) && ssdgs_trainer_step(NULL, NULL) &&
          ssdgs_trainer_run(NULL, NULL, NULL) && ssdgs_trainer_create(NULL, &photo, 1, NULL, &none) &&
          ssdgs_stage_cpu(NULL, SSDGS_STAGE_SORT));
    const ssdgs_real there[3] = {0, 1, 0};
    for (int i = 0; i < 6; i++) { /* what sees nothing is refused */
        static const double fov[6] = {1, 0, -1, 3.15, 40, (double)NAN};
        camera = ssdgs_camera_look_at(three, i ? there : three, three, (ssdgs_real)fov[i], 4, 4);
        CHECK(camera.fx == 0 &&
              ssdgs_render(all.model, &camera, &photo.light, 1, &image) == SSDGS_ERR_ARGUMENT);
    }
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
    ssdgs_to_pixels(NULL, NULL, 1, 1, 0, SSDGS_RGBA8, &byte, 4);
    ssdgs_to_pixels(NULL, &image, 1, 1, 0, SSDGS_RGBA8, NULL, 4);
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
            CHECK(!render());
            ssdgs_model_view view = ssdgs_model_arrays(all.model);
            ssdgs_real *at[5];
            at[0] = view.asg_basis, at[1] = view.asg_sharpness, at[2] = view.asg_sigma,
            at[3] = view.scattering, at[4] = view.shadow;
            at[group][5] = kind ? (ssdgs_real)NAN : (ssdgs_real)INFINITY;
            char text[100];
            snprintf(text, sizeof text, "model: value 5 of %s is not finite", names[group]);
            CHECK(render() == SSDGS_ERR_NONFINITE);
            if (!CHECK(!strcmp(ssdgs_error_message(all.context), text)))
                printf("    %s\n", ssdgs_error_message(all.context));
            CHECK(ssdgs_trainer_run(all.trainer, NULL, NULL) == SSDGS_ERR_NONFINITE);
            snprintf(text, sizeof text, FILE_NAME ": model: value 5 of %s is not finite", names[group]);
            CHECK(ssdgs_model_save(all.model, FILE_NAME) == SSDGS_ERR_NONFINITE &&
                  !strcmp(ssdgs_error_message(all.context), text));
            view = ssdgs_model_arrays(all.model);
            at[group][5] = 0;
            CHECK(!render());
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
        ssdgs_to_pixels(NULL, &from, 3, 1, SSDGS_TRANSFER_SRGB, SSDGS_RGBA16F, out, 24);
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
    ssdgs_to_pixels(NULL, &from, 1, 1, SSDGS_TRANSFER_SRGB, SSDGS_RGBA16F, out, 8);
    ssdgs_image veil;
    memset(&veil, 0, sizeof veil);
    ssdgs_real black[3] = {0, 0, 0}, cover = (ssdgs_real)0.5;
    veil.color = black, veil.alpha = &cover;
    for (uint16_t small = 2; small < 0x800; small = (uint16_t)(small + 2)) { /* subnormal and a little more */
        uint16_t under[4] = {small, (uint16_t)(small | 0x8000), 0, 0};
        ssdgs_blend_pixels(NULL, &veil, 1, 1, SSDGS_TRANSFER_NONE, SSDGS_RGBA16F, under, 8);
        wrong += half_value(under[0]) != half_value(small) / 2 || under[1] != (under[0] | 0x8000);
    }
    CHECK(wrong == 0);
    CHECK((out[0] & 0x7FFF) > 0x7C00 && out[1] == 0x7C00 && out[2] == 0xFC00);
}

/* Also with -ffast-math. */
static void test_finite_values(void) {
    static const double good[6] = {0, -1, 1, 1e-45, 3.4e38, -3.4e38};
    const double bad[4] = {(double)NAN, -(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 6; i++) CHECK(ssdgs_finite((ssdgs_real)good[i]) == 1);
    for (int i = 0; i < 4; i++) CHECK(ssdgs_finite((ssdgs_real)bad[i]) == 0);
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
            ssdgs_blend_pixels(NULL, &from, N / 4, 4, transfer, format, to,
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
                ssdgs_to_pixels(NULL, &from, W, H, SSDGS_TRANSFER_SRGB, bgra ? SSDGS_BGRA8 : SSDGS_RGBA8,
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
    test_finite_values();
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

/* Rows farther apart than they are long: all planes, of which scene_depth is read, asked for together or one
   by one, are the packed picture's, and what lies between rows stays. */
static void test_rows(void) {
    enum { W = 37, H = 21, STRIDE = W + 5, COUNT = 9 };
    static ssdgs_real packed[COUNT][3 * W * H], apart[COUNT][3 * STRIDE * H], hidden[W * H],
        hidden_apart[STRIDE * H];
    static const int channels[COUNT] = {3, 3, 3, 3, 3, 1, 1, 1, 1};
    const ssdgs_real eye[3] = {0, -2, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    unsigned char padding[5 * 3 * sizeof(ssdgs_real)];
    memset(padding, 77, sizeof padding);
    set_up(NULL, 0);
    for (int i = 0; i < MANY; i++) {
        ssdgs_gaussian g;
        CHECK(!ssdgs_model_get(all.model, i, &g));
        g.opacity = (ssdgs_real)0.5;
        g.normal[0] = g.normal[1] = g.normal[2] = -1; /* towards the light and the eye */
        for (int c = 0; c < 3; c++) g.diffuse[c] = g.specular[c] = g.scattering[c] = (ssdgs_real)(c + 1) / 4;
        CHECK(!ssdgs_model_set(all.model, i, &g));
    }
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, W, H);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < STRIDE; x++) { /* a mesh in the left half, and one between rows */
            const ssdgs_real depth = (ssdgs_real)(x < W / 2 ? 2 : x < W ? 1e30 : 0.01);
            hidden_apart[y * STRIDE + x] = depth;
            if (x < W) hidden[y * W + x] = depth;
        }
    for (int asked = -1; asked <= COUNT; asked++) { /* -1: packed; COUNT: all; else one */
        ssdgs_real *plane[COUNT];
        memset(apart, 77, sizeof apart);
        for (int i = 0; i < COUNT; i++)
            plane[i] = asked < 0 ? packed[i] : asked == i || asked == COUNT ? apart[i] : NULL;
        const ssdgs_image to = {asked < 0 ? 0 : STRIDE,
                                plane[0],
                                plane[5],
                                plane[6],
                                plane[1],
                                plane[2],
                                plane[3],
                                plane[4],
                                plane[7],
                                plane[8],
                                asked < 0 ? hidden : hidden_apart};
        CHECK(!ssdgs_render(all.model, &camera, &photo.light, 1, &to));
        for (int i = 0; i < COUNT; i++) {
            const size_t row = (size_t)channels[i] * W, step = (size_t)channels[i] * STRIDE;
            int wrong = 0, something = 0;
            for (size_t y = 0; y < H; y++) {
                const ssdgs_real *want = packed[i] + y * row, *got = apart[i] + y * step;
                for (size_t x = 0; x < row; x++) something |= want[x] > 0 || want[x] < 0;
                if (asked < 0 || !plane[i]) continue;
                wrong += memcmp(got, want, row * sizeof *got) != 0;
                wrong += memcmp(got + row, padding, (step - row) * sizeof *got) != 0;
            }
            if (!CHECK(something && !wrong)) printf("    plane %d, asked for %d: %d rows\n", i, asked, wrong);
        }
    }
    tear_down();
}

/* A framebuffer's rows may be far apart, or stored the last one first, in every format, by one thread or a
   context's. Floats hold the straight colour, or the premultiplied one as it is. Where alpha is 0 pixels
   become 0, and nothing is blended: no bit changes, not even of what is no number. */
static void test_pitch(void) {
    enum { W = 5, H = 37, STRIDE = 7, PITCH = 16 * W + 12 };
    static const int sizes[4] = {4, 4, 8, 16};
    static ssdgs_real colors[3 * STRIDE * H], alphas[STRIDE * H], none[STRIDE * H];
    unsigned char packed[16 * W * H], apart[PITCH * H], before[PITCH * H];
    ssdgs_image from;
    memset(&from, 0, sizeof from);
    from.stride = STRIDE, from.color = colors;
    for (int i = 0; i < STRIDE * H; i++) {
        alphas[i] = (ssdgs_real)(i % 5) / 4;
        for (int c = 0; c < 3; c++)
            colors[3 * i + c] = alphas[i] * (ssdgs_real)(3 * test_uniform(9, (uint64_t)(3 * i + c)));
    }
    for (int format = SSDGS_RGBA8; format <= SSDGS_RGBA32F; format++)
        for (int up = 0; up < 2; up++)
            for (int transfer = 0; transfer < 2; transfer++) {
                const int size = sizes[format];
                unsigned char *first = up ? apart + (H - 1) * PITCH : apart;
                memset(apart, 77, sizeof apart);
                for (int blend = 0; blend < 2; blend++) { /* over what the first round has written */
                    void (*write)(ssdgs_context *, const ssdgs_image *, int, int, int, int, void *,
                                  ptrdiff_t) = blend ? ssdgs_blend_pixels : ssdgs_to_pixels;
                    int wrong = 0;
                    from.alpha = alphas;
                    write(NULL, &from, W, H, transfer, format, packed, W * size);
                    write(up ? NULL : home, &from, W, H, transfer, format, first, up ? -PITCH : PITCH);
                    for (int y = 0; y < H; y++) {
                        const unsigned char *row = apart + (up ? H - 1 - y : y) * PITCH;
                        wrong += memcmp(row, packed + y * W * size, (size_t)(W * size)) != 0;
                        for (int x = W * size; x < PITCH; x++) wrong += row[x] != 77;
                    }
                    CHECK(wrong == 0);
                    for (int i = 0; format == SSDGS_RGBA32F && !blend && i < W * H; i++) {
                        const int at = i / W * STRIDE + i % W;
                        const double a = (double)alphas[at];
                        float rgba[4];
                        double want[4] = {0, 0, 0, a};
                        memcpy(rgba, packed + 16 * i, sizeof rgba);
                        for (int c = 0; c < 3; c++)
                            if (a > 0) want[c] = (double)colors[3 * at + c] / a;
                        CHECK_NEAR(rgba, want, 4, 1e-30, 1e-6, "floats of a straight colour");
                    }
                }
                ssdgs_to_pixels(home, &from, W, H, transfer, format + SSDGS_PREMULTIPLIED, packed, W * size);
                for (int i = 0; i < W * H; i++) {
                    const int at = i / W * STRIDE + i % W;
                    const ssdgs_real *c = colors + 3 * at;
                    float rgba[4];
                    memcpy(rgba, packed + size * i, format == SSDGS_RGBA32F ? 16 : 4);
                    if (format == SSDGS_RGBA32F)
                        CHECK(rgba[0] == (float)c[0] && rgba[2] == (float)c[2] &&
                              rgba[3] == (float)alphas[at]);
                    if (format > SSDGS_BGRA8) continue;
                    unsigned char bytes[3];
                    ssdgs_to_bytes(c, 3, transfer, bytes);
                    CHECK(packed[4 * i] == bytes[format == SSDGS_BGRA8 ? 2 : 0] &&
                          packed[4 * i + 1] == bytes[1]);
                }
                for (int i = 0; i < PITCH * H; i++)
                    apart[i] = before[i] = (unsigned char)(256 * test_uniform(10, (uint64_t)i));
                from.alpha = none;
                ssdgs_blend_pixels(home, &from, W, H, transfer, format, first, up ? -PITCH : PITCH);
                CHECK(!memcmp(apart, before, sizeof before));
            }
}

int main(void) {
#if THREADS
    mine = pthread_self();
#endif
    if (!CHECK(!ssdgs_context_create(NULL, &home) && !ssdgs_model_create(home, NULL, 1, &guest))) return 1;
    test_from_within();
    test_tracer();
    test_run();
    ssdgs_model_destroy(guest);
    ssdgs_context_destroy(home);
    test_progress();
    test_order();
    test_fork();
    test_fork_within();
    test_no_context();
    test_odd_numbers();
    test_null();
    test_shared();
    test_bytes();
    test_pixels();
    test_rows();
    test_pitch();
    TEST_END();
}
