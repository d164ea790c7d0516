/* Faults: allocations that fail, disks that fill, files that are damaged, hostile, no files at all or change
   under the reader, processes killed at any moment. Nothing leaks, hangs, is left half done or changes what
   was there before. cc -o build/t_faults tests/t_faults.c -lm -lpthread && build/t_faults [full] (writes
   under build/) */
#ifndef _DEFAULT_SOURCE
#define _DEFAULT_SOURCE /* processes, limits, folders, links */
#endif
#include "test.h"
#include <limits.h>
#include <stdarg.h>
#include <sys/stat.h>
#ifndef _WIN32
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* ---- a disk that fails on demand: the system calls of both headers come through here ---- */

typedef struct trouble {
    size_t room;          /* bytes until it is full; 0 = endless, n = n - 1 */
    size_t part;          /* bytes written at a time; 0 = all */
    int interrupts;       /* every other write */
    long pause;           /* nanoseconds before a write */
    int taken;            /* so many names exist already */
    int sync, shut, name; /* errno of fsync, close, rename */
} trouble;

static trouble disk;

static ssize_t faulty_write(int file, const void *bytes, size_t size) {
    static int calls;
    struct timespec pause;
    pause.tv_sec = 0;
    pause.tv_nsec = disk.pause;
    if (disk.pause) nanosleep(&pause, NULL);
    if (disk.interrupts && calls++ % 2) return errno = EINTR, -1;
    if (disk.room == 1) return errno = ENOSPC, -1;
    if (disk.part && size > disk.part) size = disk.part;
    if (disk.room && size > disk.room - 1) size = disk.room - 1;
    if (disk.room) disk.room -= size;
    return write(file, bytes, size);
}

static int faulty_open(const char *path, int flags, ...) {
    va_list list;
    int mode = 0;
    va_start(list, flags);
    if (flags & O_CREAT) mode = va_arg(list, int);
    va_end(list);
    if (flags & O_EXCL && disk.taken > 0) return disk.taken--, errno = EEXIST, -1;
    return open(path, flags, mode);
}

static int faulty_close(int file) { return close(file) || !disk.shut ? 0 : (errno = disk.shut, -1); }
static int faulty_fsync(int file); /* its body comes later: -std=c99 makes the library declare fsync */
static int faulty_rename(const char *from, const char *to) {
    return disk.name ? errno = disk.name, -1 : rename(from, to);
}

#define write faulty_write
#define open faulty_open
#define close faulty_close
#define fsync faulty_fsync
#define rename faulty_rename
#endif

#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"

#ifndef _WIN32
static int faulty_fsync(int file) {
    (void)file;
    return disk.sync ? errno = disk.sync, -1 : 0;
}
#endif

/* ---- memory that counts, and fails on demand ---- */

typedef struct meter {
    long live, calls, fail_at; /* blocks; calls so far; the one that fails, 0 = none */
    int for_ever;              /* 1: so do all after it */
    size_t bytes, peak, limit; /* in use; most so far; 0 = any */
    void (*meanwhile)(void);   /* happens once, at the next call */
} meter;

static meter memory;

static void *meter_resize(void *old, size_t size) {
    const size_t had = old ? ((size_t *)old)[-2] : 0;
    memory.calls++;
    if (memory.meanwhile) {
        void (*const now)(void) = memory.meanwhile;
        memory.meanwhile = NULL;
        now();
    }
    if (memory.fail_at &&
        (memory.calls == memory.fail_at || (memory.for_ever && memory.calls > memory.fail_at)))
        return NULL;
    if (memory.limit && size > memory.limit) return NULL;
    size_t *block = (size_t *)realloc(old ? (size_t *)old - 2 : NULL, size + 2 * sizeof *block);
    if (!block) return NULL;
    block[0] = size;
    memory.live += !old;
    memory.bytes += size - had;
    if (memory.bytes > memory.peak) memory.peak = memory.bytes;
    return block + 2;
}

static void meter_free(void *block) {
    if (!block) return;
    memory.live--;
    memory.bytes -= ((size_t *)block)[-2];
    free((size_t *)block - 2);
}

static void *meter_clear(size_t count, size_t size) {
    void *block = meter_resize(NULL, count * size);
    return block ? memset(block, 0, count * size) : NULL;
}

static void *meter_allocate(void *user, size_t bytes) {
    (void)user;
    return meter_resize(NULL, bytes);
}
static void meter_release(void *user, void *block) {
    (void)user;
    meter_free(block);
}

#ifndef _WIN32
#define malloc(size) meter_resize(NULL, size)
#define realloc(block, size) meter_resize(block, size)
#define calloc(count, size) meter_clear(count, size)
#define free(block) meter_free(block)
#include "../examples/olat.h"
#undef malloc
#undef realloc
#undef calloc
#undef free
#endif

/* ---- a small world: photographs, a context, a model, a trainer ---- */

enum {
    PHOTOS = 3,
    SIDE = 24,
    POINTS = 60,
    DENSE = 3,
    RESETS = 13
}; /* the first density control comes with step DENSE */
#define FOLDER "build/t_faults_files"

static const char file_path[] = FOLDER "/file", start_path[] = FOLDER "/start", run_path[] = FOLDER "/run";
static unsigned char pixels[PHOTOS][SIDE * SIDE * 4];
static ssdgs_photo photos[PHOTOS], refined;
static ssdgs_context *context;
static ssdgs_model *model, *made;
static ssdgs_scene *scene;
static ssdgs_trainer *trainer;
static ssdgs_train_options options;
static ssdgs_metrics metrics;
static ssdgs_real planes[8][SIDE * SIDE * 3], pair[2][SIDE * SIDE * 3];
static char error[512];
static int full, last_note;
static long oom_points, io_points, bad_inputs;

static double draw(void) {
    static uint64_t counter;
    return ssdgs__uniform(11, counter++);
}

static size_t draw_below(size_t n) { return (size_t)(draw() * (double)n); }

/* A lit ball on a transparent ground, seen from all around. */
static void make_photos(void) {
    for (int i = 0; i < PHOTOS; i++) {
        const double angle = 6.2831853 * i / PHOTOS;
        ssdgs_real eye[3], target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
        eye[0] = (ssdgs_real)(2 * cos(angle));
        eye[1] = (ssdgs_real)(2 * sin(angle));
        eye[2] = (ssdgs_real)0.5;
        memset(&photos[i], 0, sizeof photos[i]);
        photos[i].camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.63, SIDE, SIDE);
        photos[i].light.position[0] = (ssdgs_real)(2 * cos(angle + 1));
        photos[i].light.position[1] = (ssdgs_real)(2 * sin(angle + 1));
        photos[i].light.position[2] = 1;
        for (int c = 0; c < 3; c++) photos[i].light.intensity[c] = 7;
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                const double dx = (x + 0.5 - SIDE / 2) / (SIDE * 0.3),
                             dy = (y + 0.5 - SIDE / 2) / (SIDE * 0.3);
                const double r2 = dx * dx + dy * dy;
                unsigned char *p = pixels[i] + 4 * (y * SIDE + x);
                for (int c = 0; c < 3; c++)
                    p[c] = r2 < 1 ? (unsigned char)(60 + 150 * (1 - r2) * (c ? 0.7 : 1) + 30 * dx) : 0;
                p[3] = r2 < 1 ? 255 : 0;
            }
        photos[i].pixels = pixels[i];
    }
    for (int i = 0; i < SIDE * SIDE * 6; i++) pair[i % 2][i / 2] = (ssdgs_real)ssdgs__uniform(1, (uint64_t)i);
    options = ssdgs_train_options_default();
    options.seed = 2;
    options.iterations = 40;
    options.initial_points = POINTS;
    options.max_gaussians = 300;
    options.prune_outside = 1; /* looked for; none is in more than all photographs */
    options.densify_from = options.densify_every = DENSE;
    options.opacity_reset_every = RESETS;
    options.densify_gradient = (ssdgs_real)1e-4;
    options.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT;
}

static ssdgs_settings small_settings(int width) {
    ssdgs_settings s = ssdgs_settings_default();
    s.transport = 1;
    s.scattering.layers = s.shadow.layers = 2;
    s.scattering.width = s.shadow.width = width;
    return s;
}

static ssdgs_model *random_model(int count, int width) {
    const ssdgs_settings settings = small_settings(width);
    ssdgs_model *m = NULL;
    if (!CHECK(!ssdgs_model_create(context, &settings, count, &m))) exit(1);
    ssdgs_model_view v = ssdgs_model_arrays(m);
    for (int i = 0; i < count; i++)
        for (int c = 0; c < SSDGS_CHANNELS; c++) {
            const double u = 2 * ssdgs__uniform(3, (uint64_t)(i * 64 + c)) - 1;
            v.gaussians[(size_t)c * v.stride + (size_t)i] =
                (ssdgs_real)(c < SSDGS_ROTATION                          ? 0.5 * u
                             : c >= SSDGS_LOG_SCALE && c < SSDGS_OPACITY ? u - 2.5
                                                                         : u);
        }
    return m;
}

static void note(void *user, ssdgs_result code, const char *message) {
    (void)user;
    (void)message;
    last_note = (int)code;
}

static void with_context(void) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = 1;
    desc.logger.write = note;
    desc.allocator.allocate = meter_allocate;
    desc.allocator.release = meter_release;
    if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
}

static ssdgs_result frame(int large) { /* the large one asks for more of everything */
    ssdgs_render_options o = ssdgs_render_options_default();
    ssdgs_light lights[3];
    ssdgs_camera camera = photos[large].camera;
    for (int i = 0; i < 3; i++) lights[i] = photos[i].light;
    if (!large) camera.width = camera.height = SIDE / 2; /* a corner */
    o.antialias = large;
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    memset(planes, 0, sizeof planes);
    image.color = planes[0];
    image.alpha = planes[1];
    if (large) {
        image.depth = planes[2], image.normal = planes[3], image.diffuse = planes[4],
        image.specular = planes[5];
        image.scattering = planes[6], image.shadow = planes[7];
    }
    return ssdgs_render_ex(model, &camera, lights, large ? 3 : 1, &o, &image, NULL);
}

static void with_model(void) {
    with_context();
    model = random_model(80, 8);
}

static void with_frame(void) {
    with_model();
    CHECK(!frame(0));
}

static void with_scene(void) {
    with_model();
    if (!CHECK(!ssdgs_scene_create(context, &scene))) exit(1);
}

static void with_empty_model(void) {
    const ssdgs_settings settings = small_settings(8);
    with_context();
    if (!CHECK(!ssdgs_model_create(context, &settings, 0, &model))) exit(1);
}

static ssdgs_result make_trainer(void) {
    return ssdgs_trainer_create(model, photos, PHOTOS, &options, &trainer);
}
static ssdgs_result step(void) { return ssdgs_trainer_step(trainer, NULL); }

static void with_trainer(void) {
    with_empty_model();
    if (!CHECK(!make_trainer())) exit(1);
}

static void with_steps(int count) {
    with_trainer();
    while (count-- > 0) CHECK(!step());
}

static void before_control(void) {
    options.opacity_reset_every =
        DENSE; /* in the same step, whether or not there is memory for more Gaussians */
    with_steps(DENSE - 1);
}
static void after_control(void) { with_steps(DENSE + 1); }

static void end_world(void) {
    ssdgs_trainer_destroy(trainer);
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(made);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    trainer = NULL;
    scene = NULL;
    model = made = NULL;
    context = NULL;
    options.opacity_reset_every = RESETS;
}

/* ---- what the world holds, as hashes ---- */

#define SEED UINT64_C(0xCBF29CE484222325)

static uint64_t hash_model(uint64_t hash, const ssdgs_model *m) {
    hash = ssdgs__fold(ssdgs__fold(hash, &m->settings, sizeof m->settings), &m->count, sizeof m->count);
    for (int c = 0; c < m->channels; c++)
        hash =
            ssdgs__fold(hash, m->gaussians + (size_t)c * m->capacity, (size_t)m->count * sizeof(ssdgs_real));
    return ssdgs__fold(hash, m->globals, m->global_count * sizeof(ssdgs_real));
}

static uint64_t hash_file(uint64_t hash, const char *path) {
    unsigned char part[4096];
    size_t got;
    FILE *stream = fopen(path, "rb");
    for (; stream && (got = fread(part, 1, sizeof part, stream)) > 0;) hash = ssdgs__fold(hash, part, got);
    if (stream) fclose(stream);
    return hash;
}

/* Model and trainer: what a call that fails must not touch. */
static uint64_t held(void) {
    const ssdgs_trainer *t = trainer;
    uint64_t hash = model ? hash_model(SEED, model) : SEED;
    if (!t) return hash;
    hash = ssdgs__fold(hash, &t->run, sizeof t->run);
    for (int i = 0; i < SSDGS_CHANNELS; i++) {
        hash = ssdgs__fold(hash, t->mean + (size_t)i * t->stride, (size_t)model->count * sizeof(ssdgs_real));
        hash =
            ssdgs__fold(hash, t->square + (size_t)i * t->stride, (size_t)model->count * sizeof(ssdgs_real));
    }
    for (int i = 0; i < SSDGS__STATISTICS; i++)
        hash = ssdgs__fold(hash, t->screen_gradient + (size_t)i * t->stride,
                           (size_t)model->count * sizeof(ssdgs_real));
    hash = ssdgs__fold(hash, t->global_mean, model->global_count * sizeof(ssdgs_real));
    hash = ssdgs__fold(hash, t->global_square, model->global_count * sizeof(ssdgs_real));
    return ssdgs__fold(hash, t->corrections, (size_t)t->photo_count * sizeof *t->corrections);
}

/* All that calls give. */
static uint64_t given(void) {
    uint64_t hash = ssdgs__fold(hash_file(held(), file_path), planes, sizeof planes);
    hash = ssdgs__fold(hash, &metrics, sizeof metrics);
    hash = ssdgs__fold(hash, &refined.camera.view, sizeof refined.camera.view);
    hash = ssdgs__fold(hash, refined.light.position, sizeof refined.light.position);
    return made ? hash_model(hash, made) : hash;
}

/* ---- every allocation fails ---- */

static ssdgs_result do_create(void) {
    const ssdgs_settings settings = small_settings(8);
    return ssdgs_model_create(context, &settings, 70, &made);
}
static ssdgs_result do_load(void) { return ssdgs_model_load(context, start_path, &made, NULL); }
static ssdgs_result do_save(void) { return ssdgs_model_save(model, file_path); }
static ssdgs_result do_sort(void) { return ssdgs_model_sort(model); }
static ssdgs_result do_frame(void) { return frame(1); }
static ssdgs_result do_scene(void) {
    ssdgs_object objects[2] = {ssdgs_object_default(model), ssdgs_object_default(model)};
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = planes[0];
    image.specular = planes[1];
    objects[1].to_world[3] = (ssdgs_real)0.4;
    objects[1].roughness = 2;
    return ssdgs_scene_render(scene, objects, 2, &photos[0].camera, &photos[1].light, 1, NULL, &image, NULL);
}
static ssdgs_result do_bounds(void) { return ssdgs_model_bounds(model, planes[0], planes[0] + 3); }
static ssdgs_result do_iteration(void) {
    int iteration = -1;
    const ssdgs_result result = ssdgs_checkpoint_iteration(context, run_path, &iteration, NULL);
    planes[0][0] = (ssdgs_real)(result ? 0 : iteration);
    return result;
}
static ssdgs_result do_compare(void) {
    return ssdgs_compare(context, pair[0], pair[1], SIDE, SIDE, &metrics);
}
static ssdgs_result do_evaluate(void) {
    return ssdgs_evaluate(model, photos, options.background, planes[0], &metrics);
}
static ssdgs_result do_refine(void) { return ssdgs_refine_photo(model, &refined, options.background, 2); }
static ssdgs_result do_keep(void) { return ssdgs_trainer_save(trainer, file_path); }
static ssdgs_result do_resume(void) { return ssdgs_trainer_load(trainer, run_path); }

static ssdgs_result do_load_memory(void) {
    static unsigned char bytes[1 << 17];
    FILE *stream = fopen(start_path, "rb");
    const size_t size = stream ? fread(bytes, 1, sizeof bytes, stream) : 0;
    if (stream) fclose(stream);
    return ssdgs_model_load_memory(context, bytes, size, &made, NULL);
}

#ifndef _WIN32
static ssdgs_result do_png(void) {
    return !olat_write_png(file_path, SIDE, SIDE, 4, pixels[0], error) ? SSDGS_OK
           : strstr(error, "out of memory")                            ? SSDGS_ERR_MEMORY
                                                                       : SSDGS_ERR_IO;
}

static ssdgs_result do_dataset(void) {
    olat_dataset set;
    ssdgs_photo *shots = NULL;
    if (!olat_load(FOLDER, "set.json", 0, &set, error)) {
        shots = olat_photos(&set);
        if (!shots) sprintf(error, "out of memory");
        else memcpy(planes[0], shots[1].pixels, SIDE * SIDE * 4);
    }
    meter_free(shots);
    olat_free(&set);
    return shots ? SSDGS_OK : strstr(error, "out of memory") ? SSDGS_ERR_MEMORY : SSDGS_ERR_FORMAT;
}
#endif

typedef struct operation {
    const char *name;
    void (*prepare)(void);
    ssdgs_result (*run)(void);
    int frames; /* 1: leaves buffers in the context */
} operation;

static const operation operations[] = {{"model_create", with_context, do_create, 0},
                                       {"model_load", with_context, do_load, 0},
                                       {"model_load_memory", with_context, do_load_memory, 0},
                                       {"model_save", with_model, do_save, 0},
                                       {"model_sort", with_model, do_sort, 0},
                                       {"render", with_model, do_frame, 1},
                                       {"render more", with_frame, do_frame, 1},
                                       {"scene_render", with_scene, do_scene, 1},
                                       {"model_bounds", with_model, do_bounds, 1},
                                       {"checkpoint_iteration", with_context, do_iteration, 0},
                                       {"compare", with_frame, do_compare, 0},
                                       {"evaluate", with_frame, do_evaluate, 1},
                                       {"refine_photo", with_frame, do_refine, 1},
                                       {"trainer_create", with_empty_model, make_trainer, 0},
                                       {"trainer_create, a model there", with_model, make_trainer, 0},
                                       {"step", with_trainer, step, 1},
                                       {"step with density control", before_control, step, 1},
                                       {"trainer_save", after_control, do_keep, 0},
                                       {"trainer_load", with_trainer, do_resume, 0},
#ifndef _WIN32
                                       {"olat_load", with_context, do_dataset, 0},
                                       {"olat_write_png", with_context, do_png, 0}
#endif
};

static void begin(const operation *op) {
    remove(file_path);
    memset(&metrics, 0, sizeof metrics);
    refined = photos[1];
    op->prepare();
    memset(planes, 0, sizeof planes);
    memory.calls = 0;
}

static int all_finite(const ssdgs_real *values, size_t n) {
    size_t i;
    for (i = 0; i < n && test_finite((double)values[i]); i++) {}
    return i == n;
}

static int finite_model(const ssdgs_model *m) {
    int good = all_finite(m->globals, m->global_count);
    for (int c = 0; c < m->channels; c++)
        good &= all_finite(m->gaussians + (size_t)c * m->capacity, (size_t)m->count);
    return good;
}

static void test_memory(void) {
    const int operation_count = (int)(sizeof operations / sizeof *operations);
    int uncontrolled = 0;
    options.densify_every = 1000; /* the step with density control, without */
    before_control();
    CHECK(!step());
    const uint64_t plain_step = held();
    end_world();
    options.densify_every = DENSE;
    for (int i = 0; i < operation_count; i++) {
        const operation *op = operations + i;
        uint64_t base = 0;
        int wrong = 0, shown = 0;
        begin(op);
        const uint64_t before = held();
        if (model && model->count) base = frame(0) ? 0 : ssdgs__fold(SEED, planes, sizeof planes);
        end_world();
        begin(op);
        CHECK(!op->run());
        const long calls = memory.calls;
        const uint64_t want = given();
        end_world();
        CHECK(memory.live == 0 && calls > 0);
        for (long n = 0; n < 2 * calls; n++) {
            begin(op);
            const int for_ever = n >= calls;
            const long live = memory.live;
            const int at = trainer ? trainer->run.iteration : 0;
            memory.fail_at = 1 + n % calls;
            memory.for_ever = for_ever;
            error[0] = 0;
            wrong += op->run() != SSDGS_ERR_MEMORY || made;
            memory.fail_at = 0;
            wrong += !strstr(error[0] ? error : ssdgs_error_message(context), "out of memory");
            wrong += !op->frames && memory.live != live;
            if (trainer &&
                trainer->run.iteration != at) { /* the step was done, its density control was not */
                wrong += held() != plain_step || step() || !finite_model(model);
                uncontrolled++;
            } else {
                wrong += held() != before;
                if (base && n % 2)
                    wrong += frame(0) || ssdgs__fold(SEED, planes, sizeof planes) != base; /* still */
                memset(planes, 0, sizeof planes);
                wrong += op->run() != SSDGS_OK || given() != want;
            }
            end_world();
            wrong += memory.live != 0;
            if (wrong && !shown++)
                printf("%s: wrong when allocation %ld of %ld fails\n", op->name, 1 + n % calls, calls);
        }
        oom_points += 2 * calls;
        if (!test_check(!wrong, __FILE__, __LINE__, op->name)) printf("    %d things wrong\n", wrong);
    }
    CHECK(uncontrolled > 4);
    for (int i = 0; i < 8; i++) { /* the context itself, with a thread of its own: three allocations */
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.threads = 2;
        desc.allocator.allocate = meter_allocate;
        desc.allocator.release = meter_release;
        memory.calls = 0;
        memory.fail_at = 1 + i / 2;
        memory.for_ever = i % 2;
        CHECK(ssdgs_context_create(&desc, &context) == (i < 6 ? SSDGS_ERR_MEMORY : SSDGS_OK) &&
              !context == (i < 6));
        memory.fail_at = 0;
        ssdgs_context_destroy(context);
        context = NULL;
        CHECK(memory.live == 0);
        oom_points += i < 6;
    }
}

/* ---- files ---- */

typedef struct bytes {
    unsigned char *data;
    size_t size;
} bytes;

static bytes slurp(const char *path) {
    bytes all = {NULL, 0};
    FILE *stream = fopen(path, "rb");
    long size = stream && !fseek(stream, 0, SEEK_END) ? ftell(stream) : 0;
    all.data = (unsigned char *)malloc((size_t)size + 1);
    if (stream) {
        rewind(stream);
        all.size = fread(all.data, 1, (size_t)size, stream);
        fclose(stream);
    }
    return all;
}

static void spill(const char *path, const void *data, size_t size) {
    remove(path); /* some file systems flush what is overwritten, which takes long */
    FILE *stream = fopen(path, "wb");
    const int good = stream && fwrite(data, 1, size, stream) == size;
    if (!CHECK(stream && !fclose(stream) && good)) exit(1);
}

static int holds(const char *path, const bytes *want) {
    bytes got = slurp(path);
    const int same = got.size == want->size && !memcmp(got.data, want->data, got.size);
    free(got.data);
    return same;
}

#ifndef _WIN32
/* Files of the test's folder whose names contain this; remove: 1 = removes them. */
static int files_with(const char *part, int unlinked) {
    int count = 0;
    DIR *folder = opendir(FOLDER);
    struct dirent *entry;
    while (folder && (entry = readdir(folder)) != NULL) {
        if (!strstr(entry->d_name, part) || entry->d_name[0] == '.') continue;
        count++;
        char path[512];
        snprintf(path, sizeof path, FOLDER "/%s", entry->d_name);
        if (unlinked) remove(path);
    }
    if (folder) closedir(folder);
    return count;
}

/* Runs a function in a process of its own that has twenty seconds (a reader that hangs fails); its result. */
static int apart(int (*function)(void)) {
    int status = 0;
    fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
        alarm(20);
        _exit(function());
    }
    return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* ---- writing: whatever fails, the old file stays, no other does, and the message has the path ---- */

typedef struct writer {
    const char *name;
    ssdgs_result (*save)(const char *path);
} writer;

static ssdgs_result save_model(const char *path) { return ssdgs_model_save(model, path); }
static ssdgs_result save_run(const char *path) { return ssdgs_trainer_save(trainer, path); }
static ssdgs_result save_png(const char *path) {
    return olat_write_png(path, SIDE, SIDE, 4, pixels[0], error) ? SSDGS_ERR_IO : SSDGS_OK;
}

static const writer writers[3] = {{"model", save_model}, {"checkpoint", save_run}, {"PNG", save_png}};

static int fails_cleanly(const writer *w, const char *path, const bytes *old) {
    const long live = memory.live;
    const uint64_t before = held();
    error[0] = 0;
    const ssdgs_result result = w->save(path);
    memset(&disk, 0, sizeof disk);
    io_points++;
    const int good = result == SSDGS_ERR_IO &&
                     strstr(error[0] ? error : ssdgs_error_message(context), path) && memory.live == live &&
                     held() == before && !files_with(".tmp.", 1) && (!old || holds(path, old));
    if (!good)
        printf("%s, %s: %s, \"%s\"\n", w->name, path, ssdgs_result_string(result),
               error[0] ? error : ssdgs_error_message(context));
    return good;
}

static int save_where_not_allowed(void) {
    const bytes old = slurp(FOLDER "/locked/file");
    if (getuid() == 0 && setuid(65534)) return 0; /* root may write anywhere */
    if (access(FOLDER "/locked/file", R_OK)) return 0;
    return !fails_cleanly(&writers[0], FOLDER "/locked/file", &old) ||
           !fails_cleanly(&writers[1], FOLDER "/locked/file", &old) ||
           !fails_cleanly(&writers[2], FOLDER "/locked/file", &old);
}

static void test_disk(void) {
    static const char text[] = "what was here before";
    bytes old = {NULL, 0};
    old.data = (unsigned char *)malloc(sizeof text);
    memcpy(old.data, text, old.size = sizeof text);
    after_control();
    signal(SIGXFSZ, SIG_IGN);
    for (int w = 0; w < 3; w++) {
        const writer *const by = &writers[w];
        int wrong = 0;
        CHECK(!by->save(file_path));
        bytes whole = slurp(file_path);
        spill(file_path, text, sizeof text);
        for (size_t k = 0; k < whole.size;
             k += full || k < 8 || k + 9 > whole.size ? 1 : 1 + draw_below(whole.size / 64)) {
            disk.room = 1 + k; /* full after k bytes */
            disk.part = k % 3 ? 0 : 1 + draw_below(5000);
            wrong += !fails_cleanly(by, file_path, &old);
        }
        struct rlimit limit;
        getrlimit(RLIMIT_FSIZE, &limit);
        for (int i = 0; i < 3; i++) { /* the system itself refuses: most bytes that a file may have */
            struct rlimit tight = limit;
            tight.rlim_cur = (rlim_t)(i == 0 ? 0 : i == 1 ? whole.size / 2 : whole.size - 1);
            setrlimit(RLIMIT_FSIZE, &tight);
            wrong += !fails_cleanly(by, file_path, &old);
            setrlimit(RLIMIT_FSIZE, &limit);
        }
        disk.shut = EIO;
        wrong += !fails_cleanly(by, file_path, &old);
        disk.name = EACCES;
        wrong += !fails_cleanly(by, file_path, &old);
        disk.taken = 100; /* names for the temporary file */
        wrong += !fails_cleanly(by, file_path, &old);
        if (w < 2) { /* a PNG is not synchronised */
            disk.sync = EIO;
            wrong += !fails_cleanly(by, file_path, &old);
        }
        wrong += !fails_cleanly(by, FOLDER "/none/file", NULL);
        MAKE_FOLDER(FOLDER "/folder");
        wrong +=
            !fails_cleanly(by, FOLDER "/folder", NULL) || rmdir(FOLDER "/folder"); /* in a file's place */
        if (!CHECK(!wrong)) printf("    %d things wrong with the %s's writer\n", wrong, by->name);
        for (int i = 0; i < 3; i++) { /* a slow disk is no fault */
            disk.interrupts = i > 0;
            disk.part = i == 1 ? 7 : 1000;
            disk.taken = 9 * i;
            disk.sync = i == 2 ? EINVAL : 0; /* some file systems cannot */
            CHECK(!by->save(file_path) && holds(file_path, &whole));
            memset(&disk, 0, sizeof disk);
        }
        free(whole.data);
    }
    MAKE_FOLDER(FOLDER "/locked");
    spill(FOLDER "/locked/file", text, sizeof text);
    chmod(FOLDER "/locked", 0555);
    CHECK(apart(save_where_not_allowed) == 0);
    chmod(FOLDER "/locked", 0777);
    remove(FOLDER "/locked/file");
    rmdir(FOLDER "/locked");
    io_points += 3; /* of that process */
    for (int w = 0; w < 3;
         w++) { /* saving must not put a file where a device or a pipe was: root could lose /dev/null */
        mkfifo(FOLDER "/pipe", 0666);
        struct stat info;
        CHECK(fails_cleanly(&writers[w], FOLDER "/pipe", NULL) && !stat(FOLDER "/pipe", &info) &&
              S_ISFIFO(info.st_mode));
        remove(FOLDER "/pipe");
        CHECK(!symlink("/dev/full", FOLDER "/full"));
        CHECK(fails_cleanly(&writers[w], FOLDER "/full", NULL) && !lstat(FOLDER "/full", &info) &&
              S_ISLNK(info.st_mode));
        remove(FOLDER "/full");
    }
    end_world();
    free(old.data);
}

/* ---- reading what is no file, or changes ---- */

static const char *odd_path;
static ssdgs_result read_model(void) { return ssdgs_model_load(context, odd_path, &made, NULL); }
static ssdgs_result read_run(void) { return ssdgs_trainer_load(trainer, odd_path); }
static ssdgs_result read_png(void) {
    ssdgs_pixels format;
    void *read_pixels = NULL;
    int width, height;
    const int failed = olat_read_png(odd_path, &width, &height, &format, &read_pixels, error);
    meter_free(read_pixels);
    return failed ? SSDGS_ERR_IO : SSDGS_OK;
}
static ssdgs_result (*const readers[3])(void) = {read_model, read_run, read_png};

static int refuses_odd_file(void) {
    const uint64_t before = held();
    int wrong = 0;
    memory.limit = (size_t)1 << 26; /* an endless file must not fill the memory either */
    for (int r = 0; r < 3; r++) {
        error[0] = 0;
        wrong += readers[r]() != SSDGS_ERR_IO ||
                 !strstr(error[0] ? error : ssdgs_error_message(context), odd_path);
        if (wrong)
            return printf("%s: \"%s\"\n", odd_path, error[0] ? error : ssdgs_error_message(context)),
                   fflush(stdout), 1;
    }
    return held() != before;
}

static const char *changing_path;
static size_t changed_size;

static void change_size(void) { CHECK(!truncate(changing_path, (off_t)changed_size)); }

/* Cut or lengthened between the moment when its size is asked for and the reading: that is when memory is
   allocated. */
static void test_odd_files(void) {
    static const char *const odd[3] = {FOLDER, FOLDER "/pipe", "/dev/zero"};
    static const char *const sources[3] = {FOLDER "/start", FOLDER "/run", FOLDER "/a.png"};
    int wrong = 0;
    with_trainer();
    const uint64_t before = held();
    mkfifo(FOLDER "/pipe", 0666);
    for (int i = 0; i < 3; i++) {
        odd_path = odd[i];
        bad_inputs += 3;
        if (access(odd_path, R_OK)) continue;
        if (!CHECK(apart(refuses_odd_file) == 0)) printf("    %s is read or waited for\n", odd_path);
    }
    remove(FOLDER "/pipe");
    odd_path = changing_path = file_path;
    for (int r = 0; r < 3; r++) {
        bytes whole = slurp(sources[r]);
        for (int k = 0; k < 40; k++) {
            const long live = memory.live;
            spill(file_path, whole.data, whole.size);
            changed_size = k < 30 ? draw_below(whole.size) : whole.size + 1 + draw_below(300000);
            memory.meanwhile = change_size;
            const ssdgs_result result = readers[r]();
            /* a model's and a PNG's end is told by what stands before it */
            wrong += k < 30 || r == 1 ? result == SSDGS_OK || memory.live != live || held() != before
                                      : result != SSDGS_OK;
            ssdgs_model_destroy(made);
            made = NULL;
            bad_inputs++;
        }
        free(whole.data);
    }
    CHECK(!wrong);
    end_world();
}
#endif

/* ---- damaged and made-up checkpoints: refused with a message, the trainer stays as it was ---- */

static int run_refused(const void *data, size_t size, uint64_t before) {
    spill(file_path, data, size);
    bad_inputs++;
    const ssdgs_result result = ssdgs_trainer_load(trainer, file_path);
    if (result == SSDGS_ERR_FORMAT && strstr(ssdgs_error_message(context), file_path) && held() == before)
        return 1;
    printf("checkpoint: %s, \"%s\"%s\n", ssdgs_result_string(result), ssdgs_error_message(context),
           held() == before ? "" : ", the trainer has changed");
    return 0;
}

enum { WORD, REAL, DOUBLE };

static void test_checkpoints(void) {
    typedef ssdgs__checkpoint_head head;
    const double nan_value = (double)NAN, infinite = HUGE_VAL;
    bytes whole = slurp(run_path);
    head h;
    const size_t hashes = sizeof h, parameters = hashes + PHOTOS * sizeof(ssdgs__checkpoint_photo);
    int wrong = 0;
    with_steps(14); /* all that training knows comes back: by now every statistic counts */
    uint64_t before = held();
    for (size_t k = 0; k < SSDGS__STATISTICS; k++) {
        ssdgs_real most = 0;
        for (size_t i = 0; i < (size_t)model->count; i++)
            if (trainer->screen_gradient[k * trainer->stride + i] > most) most = 1;
        CHECK(most > 0);
    }
    CHECK(trainer->corrections[0].steps[1] > 0);
    for (int outlines = 0; outlines < 2; outlines++) { /* 0: as where no random point is inside of them */
        trainer->run.outlines = outlines;
        const uint64_t saved = held();
        CHECK(!ssdgs_trainer_save(trainer, file_path));
        end_world();
        with_trainer();
        trainer->run.outlines = !outlines;
        CHECK(!ssdgs_trainer_load(trainer, file_path) && held() == saved);
    }
    end_world();
    with_trainer();
    before = held();
    memcpy(&h, whole.data, sizeof h);
    const size_t n = (size_t)h.count * sizeof(ssdgs_real);
    const size_t moments = parameters + n * SSDGS_CHANNELS + (size_t)h.global_count * sizeof(ssdgs_real);
    const size_t squares = 2 * moments - parameters;
    const size_t statistics = 3 * moments - 2 * parameters;
    const size_t corrections = statistics + n * (SSDGS__STATISTICS + 1);
    CHECK(whole.size == corrections + PHOTOS * sizeof(ssdgs__correction) + 8);
    for (size_t k = 0; k < whole.size && wrong < 9;
         k += full || k < sizeof h ? 1 : 1 + draw_below(whole.size / 150)) {
        const unsigned char was = whole.data[k];
        whole.data[k] = (unsigned char)(was ^ 1 << draw_below(8));
        wrong += !run_refused(whole.data, whole.size, before);
        whole.data[k] = was;
        wrong += !run_refused(whole.data, k, before); /* cut */
    }
    CHECK(!wrong);
    for (size_t k = 1; k < 4; k++) {
        CHECK(run_refused(whole.data, k * whole.size / 4, before));
        CHECK(strstr(ssdgs_error_message(context), ": it is cut short") != NULL);
    }
    {
        int iteration = 0; /* it is in the head: no more is read */
        const size_t held_bytes = memory.bytes;
        spill(file_path, whole.data, sizeof h + 8);
        memory.peak = held_bytes;
        CHECK(!ssdgs_checkpoint_iteration(context, run_path, &iteration, NULL) &&
              iteration == h.run.iteration);
        CHECK(memory.peak - held_bytes < 4096);
        CHECK(!ssdgs_checkpoint_iteration(context, file_path, &iteration, NULL) &&
              iteration == h.run.iteration);
        spill(file_path, whole.data, sizeof h + 7);
        CHECK(ssdgs_checkpoint_iteration(context, file_path, &iteration, NULL) == SSDGS_ERR_FORMAT &&
              !iteration);
        head lie = h;
        lie.run.iteration = -5;
        memcpy(whole.data, &lie, sizeof lie);
        spill(file_path, whole.data, whole.size);
        CHECK(ssdgs_checkpoint_iteration(context, file_path, &iteration, NULL) == SSDGS_ERR_FORMAT &&
              !iteration);
        memcpy(whole.data, &h, sizeof h);
    }
    ssdgs_settings settings;
    {
        const struct {
            const char *what;
            size_t at;
            int type;
            double value;
        } lies[] = {
            /* with the right checksum */
            {"magic", 0, WORD, 7},
            {"byte order", offsetof(head, byte_order), WORD, 0x04030201},
            {"version", offsetof(head, version), WORD, SSDGS_VERSION + 1},
            {"precision", offsetof(head, real_size), WORD, 2},
            {"seed", offsetof(head, options.seed), WORD, 1},
            {"background", offsetof(head, options.background[2]), REAL, nan_value},
            {"dssim", offsetof(head, options.dssim), REAL, infinite},
            {"camera", hashes, WORD, 1},
            {"lights", hashes + offsetof(ssdgs__checkpoint_photo, lights), WORD, 1},
            {"pixels", parameters - sizeof(uint64_t), WORD, 1},
            {"globals", offsetof(head, global_count), WORD, 1},
            {"photographs", offsetof(head, photo_count), WORD, PHOTOS + 1},
            {"photographs", offsetof(head, photo_count), WORD, -1},
            {"count", offsetof(head, count), WORD, 0},
            {"count", offsetof(head, count), WORD, -1},
            {"count", offsetof(head, count), WORD, (double)h.count + 1},
            {"count", offsetof(head, count), WORD, 0x7fffffff},
            {"iteration", offsetof(head, run.iteration), WORD, -1},
            {"iteration", offsetof(head, run.iteration), WORD, 0x7fffffff},
            {"skipped", offsetof(head, run.skipped), WORD, -1},
            {"skipped", offsetof(head, run.skipped), WORD, 0x7fffffff},
            {"steps", offsetof(head, run.steps), WORD, -1},
            {"steps", offsetof(head, run.steps), WORD, (double)h.run.iteration + 1},
            {"ambient light's moment", offsetof(head, run.ambient), DOUBLE, infinite},
            {"ambient light's square", offsetof(head, run.ambient) + 5 * sizeof(double), DOUBLE, -1},
            {"ambient light's steps", offsetof(head, run.ambient_steps), WORD, -1},
            {"ambient light's steps", offsetof(head, run.ambient_steps), WORD, (double)h.run.iteration + 1},
            {"sky_ready", offsetof(head, run.sky_ready), WORD, 2},
            {"outlines", offsetof(head, run.outlines), WORD, -1},
            {"outlines", offsetof(head, run.outlines), WORD, 2},
            {"settings", offsetof(head, settings), WORD, 0},
            {"terms", offsetof(head, settings.terms), WORD, 16},
            {"width", offsetof(head, settings.scattering.width), WORD, 1024},
            {"octaves", offsetof(head, settings.octaves.view), WORD, 3},
            {"octaves", offsetof(head, settings.octaves.light), WORD, 3},
            {"eta", offsetof(head, settings.eta), REAL, 9},
            {"eta", offsetof(head, settings.eta), REAL, nan_value},
            {"unit", offsetof(head, settings.length_unit), REAL, 0},
            {"light scale", offsetof(head, settings.light_scale), REAL, infinite},
            {"ambient", offsetof(head, settings.ambient), REAL, -1},
            {"centre", offsetof(head, settings.centre), REAL, nan_value},
            {"network", moments - 4 * sizeof(ssdgs_real), REAL, nan_value},
            {"moment", moments + 5 * sizeof(ssdgs_real), REAL, nan_value},
            {"moment", squares - 5 * sizeof(ssdgs_real), REAL, infinite},
            {"square", squares + 5 * sizeof(ssdgs_real), REAL, -1},
            {"square", squares, REAL, nan_value},
            {"square", statistics - sizeof(ssdgs_real), REAL, -1},
            {"statistic", statistics, REAL, nan_value},
            {"statistic", corrections - sizeof(ssdgs_real), REAL, infinite},
            {"camera", corrections + offsetof(ssdgs__correction, value), DOUBLE, nan_value},
            {"camera's moment", corrections + offsetof(ssdgs__correction, mean), DOUBLE, infinite},
            {"camera's square", corrections + offsetof(ssdgs__correction, square), DOUBLE, -1},
            {"intensity", corrections + offsetof(ssdgs__correction, sure), DOUBLE, infinite},
            {"camera's steps", corrections + offsetof(ssdgs__correction, steps), WORD, -5},
            {"camera's steps", corrections + offsetof(ssdgs__correction, steps), WORD, 0x7fffffff}};
        for (size_t k = 0; k <= sizeof lies / sizeof *lies; k++) {
            const int last = k == sizeof lies / sizeof *lies; /* another rounding: taken, and told */
            unsigned char *lie = (unsigned char *)malloc(whole.size);
            const int32_t word = last ? !h.fused : lies[k].type == WORD ? (int32_t)lies[k].value : 0;
            const ssdgs_real real = (ssdgs_real)(last ? 0 : lies[k].value);
            memcpy(lie, whole.data, whole.size);
            if (last) memcpy(lie + offsetof(head, fused), &word, sizeof word);
            else if (lies[k].type == WORD) memcpy(lie + lies[k].at, &word, sizeof word);
            else if (lies[k].type == REAL) memcpy(lie + lies[k].at, &real, sizeof real);
            else memcpy(lie + lies[k].at, &lies[k].value, sizeof lies[k].value);
            uint64_t sum = ssdgs__fold(SEED, lie, whole.size - 8);
            memcpy(lie + whole.size - 8, &sum, 8);
            if (!last &&
                !CHECK(run_refused(lie, whole.size, before))) { /* what has been taken in may not last */
                printf("    made up: %s\n", lies[k].what);
                end_world();
                with_trainer();
            }
            if (last) {
                spill(file_path, lie, whole.size);
                last_note = -1;
                CHECK(!ssdgs_trainer_load(trainer, file_path) && last_note == SSDGS_OK && held() != before);
            }
            free(lie);
        }
    }
    for (int i = 0; i < 3; i++) CHECK(!step());
    end_world();
    const ssdgs_train_options other = options;
    settings = small_settings(8);
    static const char *const told[14] = {"seed was ",
                                         "batch was ",
                                         "finish was ",
                                         "bounds_max[2] was ",
                                         "densify_gradient was ",
                                         "scattering.width was 8 in its run and is 9 now",
                                         "transport was 1 in its run and is 0 now",
                                         "terms was 15 in its run and is 1 now",
                                         "photograph 2 has another camera",
                                         "photograph 0 has other lights",
                                         "its run had 3 photographs, this one has 2",
                                         "photograph 1 has other pixels",
                                         "photograph 2 has other pixels",
                                         "origin[1] was 0 in its run and is 7 now"};
    for (int i = 0; i < 14; i++) { /* another run's checkpoint: the message names what differs first */
        static unsigned char retouched[sizeof pixels[0]];
        ssdgs_photo shots[PHOTOS];
        memcpy(shots, photos, sizeof shots);
        options = other;
        if (i == 0) options.seed++;
        if (i == 1) options.batch++;
        if (i == 2) options.finish = 0;
        if (i == 3) options.bounds_max[2] *= 2;
        if (i == 4) options.densify_gradient = 0;
        settings = small_settings(i == 5 ? 9 : 8);
        settings.transport = i != 6;
        settings.terms = i == 7 ? SSDGS_DIFFUSE_TERM : SSDGS_ALL_TERMS;
        if (i == 8) shots[2].camera.view[3] += (ssdgs_real)0.01;
        if (i == 9) shots[0].light.intensity[1] *= 2;
        if (i > 10 && i < 13) { /* one bit, at the start or the end */
            memcpy(retouched, shots[i - 10].pixels, sizeof retouched);
            retouched[i == 11 ? 0 : sizeof retouched - 1] ^= 1;
            shots[i - 10].pixels = retouched;
        }
        if (i == 13) settings.origin[1] = 7;
        with_context();
        CHECK(!ssdgs_model_create(context, &settings, 0, &model));
        CHECK(!ssdgs_trainer_create(model, shots, i == 10 ? 2 : PHOTOS, &options, &trainer));
        before = held();
        CHECK(run_refused(whole.data, whole.size, before));
        if (!CHECK(strstr(ssdgs_error_message(context), told[i]) != NULL))
            printf("    %s: %s\n", told[i], ssdgs_error_message(context));
        end_world();
    }
    options = other;
    free(whole.data);
}

/* ---- damaged and made-up models ---- */

/* A model that is finite, and whose image is; or a message and nothing else. */
static int taken_or_refused(const void *data, size_t size, int draws) {
    static ssdgs_real color[64 * 3];
    unsigned char *copy = (unsigned char *)malloc(size + !size); /* a sanitizer sees what is read beyond */
    const long live = memory.live;
    ssdgs_camera camera = photos[0].camera;
    memcpy(copy, data, size);
    bad_inputs++;
    const ssdgs_result result = ssdgs_model_load_memory(context, copy, size, &made, NULL);
    free(copy);
    if (result)
        return (result == SSDGS_ERR_FORMAT || result == SSDGS_ERR_LIMIT) && !made && memory.live == live &&
               ssdgs_error_message(context)[0];
    int good = finite_model(made);
    if (draws) {
        camera.width = camera.height = 8;
        camera.fx = camera.fy = 10;
        camera.cx = camera.cy = 4;
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        image.color = color;
        good = good && !ssdgs_render(made, &camera, &photos[1].light, 1, &image);
        if (good && !all_finite(color, 64 * 3)) good = 0, printf("a pixel is not finite\n");
    }
    ssdgs_model_destroy(made);
    made = NULL;
    return good;
}

static void test_damaged_models(void) {
    int wrong = 0;
    with_context();
    model = random_model(3, 2);
    CHECK(!do_save());
    bytes whole = slurp(file_path);
    for (size_t k = 0; k < whole.size && wrong < 9; k++) {
        const unsigned char was = whole.data[k];
        for (int i = 1; i < 256; i += full ? 1 : 1 + (int)draw_below(200)) {
            whole.data[k] = (unsigned char)(was ^ i);
            if (!taken_or_refused(whole.data, whole.size, draw() < (full ? 0.05 : 0.3)))
                wrong++, printf("byte %lu of %lu, %d instead of %d\n", (unsigned long)k,
                                (unsigned long)whole.size, was ^ i, was);
        }
        whole.data[k] = was;
        wrong += !ssdgs_model_load_memory(context, whole.data, k, &made, NULL); /* cut */
        bad_inputs++;
    }
    CHECK(!wrong && !made);
    free(whole.data);
    end_world();
}

#define PLY "ply\nformat binary_little_endian 1.0\n"
#define ROW /* all that a plain file needs, 56 bytes: nothing but the count can be wrong */ \
    "property float x\nproperty float y\nproperty float z\n" \
    "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n" \
    "property float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\n" \
    "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"

/* start, then `repeated` so many times (a format for the number; "" is a byte 0), then end. */
static bytes repeat(const char *start, const char *repeated, int times, const char *end) {
    bytes b;
    char *text = (char *)malloc(strlen(start) + (size_t)times * (strlen(repeated) + 8) + strlen(end) + 1);
    b.size = (size_t)sprintf(text, "%s", start);
    for (int i = 0; i < times; i++)
        if (!repeated[0]) text[b.size++] = 0;
        else b.size += (size_t)sprintf(text + b.size, repeated, i);
    b.size += (size_t)sprintf(text + b.size, "%s", end);
    b.data = (unsigned char *)text;
    return b;
}

/* Headers that promise too much: what is allocated follows the file's size, not its word. */
static void test_hostile_headers(void) {
    static const struct {
        const char *start, *repeated;
        int times;
        const char *end;
    } attacks[] = {
        {PLY "element vertex 9223372036854775808\n" ROW "end_header\n", "", 0, ""},
        {PLY "element vertex 18446744073709551615\n" ROW "end_header\n", "x", 40, ""},
        {PLY "element vertex -1\n" ROW "end_header\n", "x", 40, ""},
        {PLY "element vertex 1e999\n" ROW "end_header\n", "x", 40, ""},
        {PLY "element vertex 1e3\n" ROW "end_header\n", "x", 12000, ""},
        {PLY "element vertex 2305843009213693952\n" ROW "end_header\n", "x", 99,
         ""},                                                               /* x 56 = 0 modulo 2^64 */
        {PLY "element vertex 536870912\n" ROW "end_header\n", "x", 99, ""}, /* x 56 = 0 modulo 2^32 */
        {PLY "element vertex 268435455\n" ROW "end_header\n", "x", 5600, ""},
        {PLY "element vertex 101\n" ROW "end_header\n", "x", 5600, ""},
        {PLY "element vertex 0x7fffffff\n" ROW "end_header\n", "x", 24, ""},
        {PLY "element vertex 268435457\nend_header\n", "x", 24, ""},
        {PLY "element vertex 4294967296\nend_header\n", "x", 24, ""},
        {PLY "element face 4294967295\nproperty list uchar int x\nelement vertex 1\n" ROW "end_header\n",
         "\0", 1000, ""},
        {PLY "element face 1\nproperty list uint int x\nend_header\n\377\377\377\377", "x", 1000, ""},
        {PLY "element face 1\nproperty list int int x\nend_header\n\377\377\377\377", "x", 1000, ""},
        {"ply\nformat ascii 1.0\nelement vertex 999999999999\n" ROW "end_header\n", "1 ", 3000, "\n"},
        {PLY "element vertex 1\n" ROW "comment ", "x", 1 << 20, "\nend_header\n"},
        {"", "x", 1 << 20, ""},
        {PLY "element vertex 1\nproperty float ", "x", 1 << 20, "\nend_header\n"},
        {PLY "element ", "v", 1 << 20, " 1\nend_header\n"},
        {PLY "element vertex 1\n", "property float p\n", 100000, "end_header\n"},
        {PLY "element vertex 1\n", "property uchar p%05d\n", 100000, "end_header\n"},
        {PLY, "element e%05d 0\n", 100000, "end_header\n"},
        {PLY "element vertex 1\n" ROW, "comment on and on\n", 100000, "end_header\n"},
        {PLY, "\n", 100000, "end_header\n"},
        {PLY "element vertex 1\n" ROW, "", 0, ""},
        {PLY "element vertex 1\n" ROW "end_heade", "r", 1, ""},
        {PLY "element vertex 1\n" ROW "\nend_header\n", "x", 12, ""}};
    with_context();
    memory.limit = (size_t)1 << 26;
    for (size_t a = 0; a < sizeof attacks / sizeof *attacks; a++) {
        const bytes b = repeat(attacks[a].start, attacks[a].repeated, attacks[a].times, attacks[a].end);
        memory.peak = memory.bytes;
        if (!CHECK(ssdgs_model_load_memory(context, b.data, b.size, &made, NULL) != SSDGS_OK && !made))
            printf("    %.200s\n", (char *)b.data);
        CHECK(ssdgs_error_message(context)[0] &&
              memory.peak - memory.bytes < 4 * b.size + 65536); /* 44 KB know the header */
        bad_inputs++;
        free(b.data);
    }
    memory.limit = 0;
    end_world();
}

/* A file's Gaussians need memory in proportion to its size, by the narrowest types that a header can give
   them. */
static void test_proportion(void) {
    static const char *const names[14] = {"x",     "y",       "z",       "red",     "green",
                                          "blue",  "opacity", "scale_0", "scale_1", "scale_2",
                                          "rot_0", "rot_1",   "rot_2",   "rot_3"};
    enum { ROWS = 20000 };
    char *text = (char *)malloc(ROWS * 14 + 1000);
    with_context();
    model = random_model(2000, 8);
    CHECK(!do_save());
    bytes whole = slurp(file_path);
    memory.peak = memory.bytes;
    CHECK(!ssdgs_model_load(context, file_path, &made, NULL));
    ssdgs_model_destroy(made);
    double ratio[2];
    ratio[0] = (double)(memory.peak - memory.bytes) / (double)whole.size;
    free(whole.data);
    size_t size = (size_t)sprintf(text, PLY "element vertex %d\n", ROWS);
    for (size_t i = 0; i < 14; i++) size += (size_t)sprintf(text + size, "property uchar %s\n", names[i]);
    size += (size_t)sprintf(text + size, "end_header\n");
    memset(text + size, 1, ROWS * 14);
    size += ROWS * 14;
    memory.peak = memory.bytes;
    CHECK(!ssdgs_model_load_memory(context, text, size, &made, NULL) && made && made->count == ROWS);
    ssdgs_model_destroy(made);
    made = NULL;
    ratio[1] = (double)(memory.peak - memory.bytes) / (double)size;
    CHECK(ratio[0] < 4 &&
          ratio[1] < 12 * sizeof(ssdgs_real) / 4); /* 38 floats from 14 bytes, and the networks */
    printf("figure model_load_bytes_per_file_byte %.2f\nfigure worst_load_bytes_per_file_byte %.2f\n",
           ratio[0], ratio[1]);
    free(text);
    end_world();
}

#ifndef _WIN32
/* ---- large and odd folders of photographs; images are looked for at last ---- */

#define HEAD "{\"camera_angle_x\":1,\"frames\":["
#define POSE "\"pl_pos\":[1,2,3],\"transform_matrix\":[[1,0,0,0],[0,1,0,0],[0,0,1,4]]}"

static void test_datasets(void) {
    static const struct {
        const char *start, *repeated;
        int times;
        const char *end, *message;
    } sets[] = {{"", "[", 100000, "", "64 levels"},
                {"", "{\"a\":", 100000, "", "64 levels"},
                {HEAD, "{},", (1 << 20) + 1, "{}]}", "2^20 frames"},
                {HEAD, "{\"a%d\":0},", 1000, "{}]}", "missing"},
                {HEAD "{\"file_path\":\"", "a", 65536, "\"," POSE "]}", "too long"},
                {HEAD "{\"file_path\":\"zero\",", "", 0, POSE "]}", "not a regular file"},
                {HEAD "{\"file_path\":\"self\",", "", 0, POSE "]}", "self.png"},
                {"\377\376{", "", 1, "}", "UTF-16"},
                {HEAD "\r\n{\"file_path\"\r\n:\"a\",", "\r\n", 1000, POSE "]}\r\n", NULL}};
    static const unsigned char empty[12] = {0, 0, 0, 0, 'I', 'D', 'A', 'T', 0x35, 0xAF, 0x06, 0x1E};
    enum { CHUNKS = 100000 };
    bytes png = slurp(FOLDER "/a.png");
    unsigned char *longer = (unsigned char *)malloc(png.size + CHUNKS * 12);
    void *got = NULL;
    CHECK(!symlink("/dev/zero", FOLDER "/zero.png") && !symlink("self.png", FOLDER "/self.png"));
    for (size_t k = 0; k < sizeof sets / sizeof *sets; k++) {
        const bytes b = repeat(sets[k].start, sets[k].repeated, sets[k].times, sets[k].end);
        spill(FOLDER "/odd.json", b.data, b.size);
        error[0] = 0;
        olat_dataset set;
        if (!CHECK(olat_load(FOLDER, "odd.json", 0, &set, error)
                       ? sets[k].message && strstr(error, sets[k].message)
                       : !sets[k].message))
            printf("    %s\n", error);
        olat_free(&set);
        bad_inputs++;
        free(b.data);
        CHECK(memory.live == 0);
    }
    memcpy(longer, png.data, 33); /* an image in pieces, nearly all of them empty */
    for (size_t k = 0; k < CHUNKS; k++) memcpy(longer + 33 + 12 * k, empty, 12);
    memcpy(longer + 33 + 12 * CHUNKS, png.data + 33, png.size - 33);
    ssdgs_pixels format;
    int width, height;
    CHECK(!olat_decode_png(longer, png.size + CHUNKS * 12, &width, &height, &format, &got, error) &&
          width == SIDE && !memcmp(got, pixels[1], SIDE * SIDE * 4));
    meter_free(got);
    free(longer);
    free(png.data);
}

/* ---- killed at any moment ---- */

/* The whole run, from where the checkpoint in the folder is, with a checkpoint every step. */
static int whole_run(void) {
    disk.part = 16384; /* much time is spent writing */
    disk.pause = 100000;
    with_trainer();
    if (!access(file_path, F_OK) && ssdgs_trainer_load(trainer, file_path)) return 1;
    while (trainer->run.iteration < options.iterations) {
        if (step()) return 2;
        if (ssdgs_trainer_save(trainer, file_path)) return 3;
    }
    return ssdgs_model_save(model, FOLDER "/final") ? 4 : 0;
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void test_kills(void) {
    const int wanted = full ? 200 : 20;
    int kills = 0, torn = 0, runs = 0, wrong = 0;
    double start = seconds();
    remove(file_path);
    CHECK(apart(whole_run) == 0);
    const double life = seconds() - start;
    bytes want = slurp(FOLDER "/final");
    CHECK(want.size > 1000);
    int status;
    while (kills < wanted && wrong < 5 && runs < 10 * wanted) {
        runs++;
        remove(file_path);
        remove(FOLDER "/final");
        for (;;) {
            const double patience = kills < wanted ? 0.7 * life * draw() : 1e9;
            fflush(stdout);
            const pid_t child = fork();
            if (child == 0) _exit(whole_run());
            if (patience < 1e9) {
                struct timespec moment;
                moment.tv_sec = (time_t)patience;
                moment.tv_nsec = (long)(1e9 * (patience - (double)moment.tv_sec));
                nanosleep(&moment, NULL);
                kill(child, SIGKILL);
            }
            if (child < 0 || waitpid(child, &status, 0) != child) exit(1);
            if (!WIFSIGNALED(status)) break;
            kills++;
            const int half = files_with(".tmp.", 1); /* a process that dies while it writes leaves that */
            torn += half;
            wrong += half > 1;
            with_trainer(); /* the name is absent or whole */
            wrong += !access(file_path, F_OK) && ssdgs_trainer_load(trainer, file_path);
            end_world();
        }
        wrong += WEXITSTATUS(status) || !holds(FOLDER "/final", &want);
    }
    CHECK(!wrong && kills == wanted);
    printf("figure kill_points %d\nfigure kills_while_writing %d\n", kills, torn);
    free(want.data);
}
#endif

int main(int argc, char **argv) {
    full = argc > 1 && !strcmp(argv[1], "full");
    MAKE_FOLDER("build");
    MAKE_FOLDER(FOLDER);
    make_photos();
    with_model();
    CHECK(!ssdgs_model_save(model, start_path));
    end_world();
    after_control();
    CHECK(!ssdgs_trainer_save(trainer, run_path) && model->count > 64); /* loading it has to make room */
    end_world();
#ifndef _WIN32
    {
        static const char set[] = HEAD "{\"file_path\":\"a\"," POSE ",{\"file_path\":\"a\"," POSE "]}";
        spill(FOLDER "/set.json", set, sizeof set - 1);
        CHECK(!olat_write_png(FOLDER "/a.png", SIDE, SIDE, 4, pixels[1], error));
        files_with(".tmp.", 1);
    }
#endif
    TEST_ROW("83", "allocations that fail", test_memory());
    TEST_ROW("85", "damaged, foreign, newer checkpoints", test_checkpoints());
    TEST_ROW("80", "damaged models, hostile headers",
             (test_damaged_models(), test_hostile_headers(), test_proportion()));
#ifndef _WIN32
    test_datasets();
    TEST_ROW("84", "disks that fail at every byte", test_disk());
    TEST_ROW("79,86", "no files, and files that change while read", test_odd_files());
    TEST_ROW("65", "killed at any moment", test_kills());
    files_with("", 1);
    rmdir(FOLDER);
    printf("figure io_fault_points %ld\n", io_points);
#endif
    printf("figure oom_points %ld\nfigure bad_inputs_tried %ld\n", oom_points, bad_inputs);
    CHECK(memory.live == 0);
    TEST_END();
}
