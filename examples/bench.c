/* (cd examples/gpu; awk -f shaders.awk *.comp) >gpu_shaders.h
   cc -O2 -I. examples/bench.c -o bench -lm -lpthread: how fast models render and train here, and what each
   shortcut costs in quality. Tables on stdout, bench.json and bench.svg beside the program. Times are the
   best of several passes, taken view by view. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "gpu/gpu_gl.c"
#include "olat.h"
#include "reduce.h"
#ifndef _WIN32
#include <sys/time.h>
#endif
#if defined(__clang__)
#define COMPILER "clang " __clang_version__
#elif defined(__TINYC__)
#define COMPILER "tcc"
#elif defined(__GNUC__)
#define COMPILER "gcc " __VERSION__
#else
#define COMPILER "unknown"
#endif

static char own_name[] = "bench";

enum {
    SIDE = 256, /* px, of the timed frames */
    MAX_PHOTOS = 16,
    MAX_JOBS = 48,
    MAX_COLUMNS = 12,
    MAX_TABLES = 32,
    MAX_FACTS = 64,
    MAX_PIXELS = 1920 * 1080
};
static const double none = -1e300; /* what could not be measured: - on stdout, null in JSON */
static volatile double sink;       /* what is written here had to be computed */

static void die(const char *what, const char *why) {
    fprintf(stderr, "bench: %s: %s\n", what, why);
    exit(1);
}

static void *make(size_t count, size_t size) {
    void *memory = calloc(count + 1, size);
    if (!memory) die("memory", "not enough");
    return memory;
}

/* ---- what is found: tables of named rows, and facts, the figures that others quote ---- */

typedef struct row {
    char name[48];
    double value[MAX_COLUMNS];
} row;
typedef struct table {
    char key[64];
    const char *columns; /* names between spaces */
    int column_count, row_count;
    row rows[MAX_JOBS];
} table;

typedef struct bench {
    int quick, best_isa, isas[SSDGS_ISA_COUNT], isa_count, threads[3],
        thread_count; /* threads: 1, 2, all; no doubles */
    const char *dataset, *model,
        *prefix;       /* the model at hand, and what stands before its tables' and facts' names */
    olat_dataset data; /* the test split */
    ssdgs_photo photos[MAX_PHOTOS], scaled[MAX_PHOTOS]; /* some of it, and to SIDE x SIDE */
    int photo_count, views;                             /* for quality, for times */
    ssdgs_real *color, *alpha;                          /* (MAX_PIXELS, 3), (MAX_PIXELS) */
    char cpu[128];
    table tables[MAX_TABLES];
    struct {
        char key[64];
        double value;
    } facts[MAX_FACTS];
    int table_count, fact_count;
} bench;

static table *new_table(bench *b, const char *key, const char *columns) {
    table *t = b->tables + b->table_count++;
    if (b->table_count > MAX_TABLES) die(key, "too many tables");
    snprintf(t->key, sizeof t->key, "%s%s", b->prefix, key);
    t->columns = columns;
    for (t->column_count = 1; (columns = strchr(columns, ' ')) != NULL; columns++) t->column_count++;
    return t;
}

static double *new_row(table *t, const char *name) {
    row *r = t->rows + t->row_count++;
    if (t->row_count > MAX_JOBS) die(t->key, "too many rows");
    snprintf(r->name, sizeof r->name, "%s", name);
    return r->value;
}

/* A row and its values: as many doubles as there are columns. */
static const double *add_row(table *t, const char *name, ...) {
    double *values = new_row(t, name);
    va_list arguments;
    va_start(arguments, name);
    for (int c = 0; c < t->column_count; c++) values[c] = va_arg(arguments, double);
    va_end(arguments);
    return values;
}

/* Keys between spaces, and a double for each. */
static void add_facts(bench *b, const char *keys, ...) {
    va_list arguments;
    va_start(arguments, keys);
    for (; *keys; keys += strspn(keys, " "), b->fact_count++) {
        const int length = (int)strcspn(keys, " ");
        if (b->fact_count == MAX_FACTS) die(keys, "too many facts");
        snprintf(b->facts[b->fact_count].key, sizeof b->facts->key, "%s%.*s", b->prefix, length, keys);
        b->facts[b->fact_count].value = va_arg(arguments, double);
        keys += length;
    }
    va_end(arguments);
}

static void print_table(const table *t) {
    for (int r = -1; r < t->row_count; r++) { /* the names of the columns first */
        const char *column = t->columns;
        printf("%s%-30s", r < 0 ? "\n" : "", r < 0 ? t->key : t->rows[r].name);
        for (int c = 0; c < t->column_count; c++) {
            const int length = (int)strcspn(column, " "), width = length < 8 ? 9 : length + 1;
            const double x = r < 0 ? none : t->rows[r].value[c], size = fabs(x); /* three digits of it */
            if (x <= none) printf("%*.*s", width, r < 0 ? length : 1, r < 0 ? column : "-");
            else
                printf("%*.*f", width,
                       size >= 100 || x == floor(x) ? 0
                       : size >= 10                 ? 1
                       : size >= 1                  ? 2
                       : size > 0.1                 ? 3
                                                    : 5,
                       x);
            column += length + 1;
        }
        printf("\n");
    }
    fflush(stdout);
}

static void write_number(FILE *file, const char *key, int length, double x) {
    if (x <= none) fprintf(file, "\"%.*s\": null", length, key);
    else fprintf(file, "\"%.*s\": %.6g", length, key, x);
}

static void write_json(const bench *b, FILE *file) {
    fprintf(file,
            "{\n \"cpu\": \"%s\",\n \"isa\": \"%s\",\n \"threads\": %d,\n \"compiler\": \"%s\",\n "
            "\"dataset\": \"",
            b->cpu, ssdgs_isa_string((ssdgs_isa)b->best_isa), b->threads[b->thread_count - 1], COMPILER);
    for (int i = 0; b->dataset[i]; i++)
        fputc(b->dataset[i] == '\\' || b->dataset[i] == '"' ? '/' : b->dataset[i], file);
    fprintf(file, "\"");
    for (int i = 0; i < b->fact_count; i++) {
        fprintf(file, ",\n ");
        write_number(file, b->facts[i].key, 64, b->facts[i].value);
    }
    fprintf(file, ",\n \"tables\": {");
    for (int i = 0; i < b->table_count; i++) {
        const table *t = b->tables + i;
        fprintf(file, "%s\n  \"%s\": [", i ? "," : "", t->key);
        for (int r = 0; r < t->row_count; r++) {
            const char *column = t->columns;
            fprintf(file, "%s\n   {\"name\": \"%s\"", r ? "," : "", t->rows[r].name);
            for (int c = 0; c < t->column_count; c++, column += strcspn(column, " ") + 1) {
                fprintf(file, ", ");
                write_number(file, column, (int)strcspn(column, " "), t->rows[r].value[c]);
            }
            fprintf(file, "}");
        }
        fprintf(file, "\n  ]");
    }
    fprintf(file, "\n }\n}\n");
}

/* ---- kernels: the machine's peaks and the networks' layers ---- */

/* Twelve chains of FMAs, enough to hide their latency; volatile, so that the compiler cannot know them to be
   the same. It may make vectors of scalars, here as in the kernels. */
static volatile float half = 0.5f;
#define PEAK(name, attribute, vector, load, fma) \
    attribute static float name(long rounds) { \
        float lanes[28]; \
        vector sum[12], x; \
        int i; \
        for (i = 0; i < 28; i++) lanes[i] = half; \
        x = load(lanes + 12); \
        SSDGS__UNROLL for (i = 0; i < 12; i++) sum[i] = load(lanes + i); \
        for (; rounds > 0; rounds--) { SSDGS__UNROLL for (i = 0; i < 12; i++) sum[i] = fma; } \
        SSDGS__UNROLL for (i = 0; i < 12; i++) x = fma; \
        memcpy(lanes, &x, sizeof x); \
        return lanes[0]; \
    }
#define LOAD(p) (*(p))
PEAK(peak_scalar, , float, LOAD, sum[i] * x + x)
#if SSDGS__X86 >= 1
PEAK(peak_sse2, SSDGS__ATTRIBUTE("sse2"), __m128, _mm_loadu_ps, _mm_add_ps(_mm_mul_ps(sum[i], x), x))
#endif
#if SSDGS__X86 >= 2
PEAK(peak_avx2, SSDGS__ATTRIBUTE("avx2,fma"), __m256, _mm256_loadu_ps, _mm256_fmadd_ps(sum[i], x, x))
#endif
#if SSDGS__X86 >= 3
PEAK(peak_avx512, SSDGS__ATTRIBUTE("avx512f"), __m512, _mm512_loadu_ps, _mm512_fmadd_ps(sum[i], x, x))
#endif
#if SSDGS__NEON
PEAK(peak_neon, , float32x4_t, vld1q_f32, vfmaq_f32(x, sum[i], x))
#endif
static const struct {
    int isa;
    float (*work)(long);
    double operations;
} peaks[] = {/* operations of one round */
#if SSDGS__X86 >= 1
             {SSDGS_ISA_SSE2, peak_sse2, 12 * 4 * 2},
#endif
#if SSDGS__X86 >= 2
             {SSDGS_ISA_AVX2, peak_avx2, 12 * 8 * 2},
#endif
#if SSDGS__X86 >= 3
             {SSDGS_ISA_AVX512, peak_avx512, 12 * 16 * 2},
#endif
#if SSDGS__NEON
             {SSDGS_ISA_NEON, peak_neon, 12 * 4 * 2},
#endif
             {SSDGS_ISA_SCALAR, peak_scalar, 12 * 2}};

/* A network of the size of a model's scattering network in which no neuron is ever 0, so that none is left
   out, and memory for one block. */
typedef struct network {
    int sizes[SSDGS_MAX_LAYERS + 1], layers;
    ssdgs_real *weights, *gradient, *inputs, *outputs, *output_gradient, *d, *spare, *transposed;
    ssdgs__row_lists *lists;
    double operations; /* of a block's forward; the backward's are twice as many */
} network;

/* In the library's own memory, aligned as a frame's is. */
static ssdgs_real *take(ssdgs_context *context, size_t count) {
    ssdgs_real *memory = (ssdgs_real *)ssdgs__allocate(context, count * sizeof *memory);
    if (!memory) die("memory", "not enough");
    return memory;
}

static network make_network(ssdgs_model *model) {
    network n;
    size_t widest = 16, at = 0;
    memset(&n, 0, sizeof n);
    n.layers = ssdgs__network_sizes(&model->settings, 0, n.sizes);
    n.weights = take(model->context, ssdgs__network_count(&model->settings, 0) + 16);
    n.lists = (ssdgs__row_lists *)make(1, sizeof *n.lists);
    ssdgs__row_lists_fill(n.lists);
    for (int l = 0; l <= n.layers; l++) {
        if (l) {
            const size_t products = (size_t)n.sizes[l] * (size_t)n.sizes[l - 1],
                         end = at + products + (size_t)n.sizes[l];
            n.operations += 2.0 * (double)products * SSDGS__BLOCK;
            for (size_t i = 0; at < end; i++, at++)
                n.weights[at] =
                    i < products ? (ssdgs_real)((ssdgs__uniform(3, at) - 0.5) / n.sizes[l - 1]) : 2;
        }
        widest = (size_t)n.sizes[l] + 32 > widest ? (size_t)n.sizes[l] + 32 : widest;
    }
    n.output_gradient = take(model->context, widest * SSDGS__BLOCK * (5 + (size_t)n.layers));
    n.d = n.output_gradient + widest * SSDGS__BLOCK;
    n.spare = n.d + widest * SSDGS__BLOCK;
    n.transposed = n.spare + widest * SSDGS__BLOCK;
    n.inputs = n.transposed + widest * SSDGS__BLOCK;
    n.outputs = n.inputs + widest * SSDGS__BLOCK;
    n.gradient = take(model->context, ssdgs__slot_gradient_size(n.sizes, n.layers));
    for (size_t i = 0; i < (size_t)n.sizes[0] * SSDGS__BLOCK; i++) /* as sines and cosines are */
        n.inputs[i] = (ssdgs_real)(2 * ssdgs__uniform(1, i) - 1);
    for (size_t i = 0; i < (size_t)n.sizes[n.layers] * SSDGS__BLOCK; i++)
        n.output_gradient[i] = (ssdgs_real)(2e-3 * ssdgs__uniform(2, i) - 1e-3);
    return n;
}

/* Work that is repeated until a clock can time it, on each of the context's threads. */
typedef enum kind { PEAK_RATE, READ, FORWARD, BACKWARD } kind;
typedef struct kernel {
    kind work;
    ssdgs_context *context;
    float (*peak)(long);
    const network *net;
    const uint64_t *words; /* to read; a thread's share is a multiple of 8 */
    size_t share;
    long repeat;
    double operations, best; /* operations of one repeat, all threads; 1e9 of them per second */
} kernel;

static void kernel_task(void *data, int task) {
    const kernel *job = (const kernel *)data;
    const ssdgs__kernels *k = job->context->k;
    const network *n = job->net;
    const ssdgs__network net = {n ? n->sizes : NULL, n ? n->layers : 0, n ? n->weights : NULL};
    const ssdgs__network_scratch backward = {n ? n->d : NULL, n ? n->spare : NULL, n ? n->transposed : NULL};
    const uint64_t *p = job->words + (size_t)task * job->share;
    uint64_t a = 0, b = 0, c = 0, d = 0;
    if (job->work == PEAK_RATE) sink = (double)job->peak(job->repeat);
    else
        for (long r = 0; r < job->repeat; r++) switch (job->work) {
            case FORWARD: ssdgs__network_forward(k, &net, NULL, n->lists, n->inputs, n->outputs); break;
            case BACKWARD:
                memcpy(n->d, n->output_gradient, (size_t)n->sizes[n->layers] * SSDGS__BLOCK * sizeof *n->d);
                ssdgs__network_backward(k, &net, n->inputs, n->outputs, &backward, n->lists, n->sizes[0],
                                        n->gradient);
                break;
            default:
                for (size_t i = 0; i < job->share; i += 8) {
                    a += p[i] + p[i + 1], b += p[i + 2] + p[i + 3];
                    c += p[i + 4] + p[i + 5], d += p[i + 6] + p[i + 7];
                }
                sink = (double)(a + b + c + d);
            }
}

static kernel make_kernel(kind work, ssdgs_context *context, int isa, const network *net) {
    kernel k = {work, context, NULL, net, NULL, 0, 1, 0, 0};
    size_t i = 0;
    while (peaks[i].isa != isa) i++;
    k.peak = peaks[i].work;
    k.operations =
        net ? net->operations * (work == BACKWARD ? 2 : 1) : peaks[i].operations * context->threads;
    return k;
}

/* All in turn until the seconds are over: what disturbs one disturbs its neighbours too. */
static void time_kernels(kernel *kernels, int count, double seconds) {
    const double end = olat_seconds() + seconds;
    double elapsed;
    for (int round = 0; round < 4 || olat_seconds() < end; round++)
        for (int i = 0; i < count; i++) {
            kernel *k = kernels + i;
            for (;; k->repeat *= 2) {
                const double start = olat_seconds();
                ssdgs__parallel(k->context, k->context->threads, kernel_task, k);
                elapsed = olat_seconds() - start;
                if (elapsed > 8e-3) break; /* the processor's clock has settled after the one before */
            }
            const double rate = 1e-9 * k->operations * (double)k->repeat / elapsed;
            k->best = rate > k->best ? rate : k->best;
        }
}

/* ---- frames and training steps, timed stage by stage where hooks are set ---- */

enum { TRANSPORT = SSDGS_STAGE_COUNT, TIMES }; /* of SHADE's, beside the stages */
typedef struct session {
    ssdgs_context *context;
    ssdgs_model *model;
    double stage[TIMES]; /* seconds since they were last zeroed */
} session;

static void check(ssdgs_context *context, ssdgs_result result) {
    if (result) die(ssdgs_result_string(result), context ? ssdgs_error_message(context) : "no context");
}

static ssdgs_result time_stage(void *user, ssdgs_frame *frame, ssdgs_stage stage) {
    const double start = olat_seconds();
    session *s = (session *)user;
    ssdgs_result result = SSDGS_OK;
    if (stage == SSDGS_STAGE_SHADE && frame->flux) { /* shading finds it done */
        const ssdgs_real *sums;
        result = ssdgs__transport(frame, &sums);
        s->stage[TRANSPORT] += olat_seconds() - start;
    }
    if (!result) result = ssdgs_stage_cpu(frame, stage);
    s->stage[stage] += olat_seconds() - start;
    return result;
}

#define STAGES(X) \
    X(PROJECT) \
    X(SORT) X(BIN) X(WALK) X(SHADE) X(COMPOSITE) X(COMPOSITE_BACKWARD) X(SHADE_BACKWARD) X(PROJECT_BACKWARD)
#define HOOK(name) \
    static ssdgs_result time_##name(void *user, ssdgs_frame *frame) { \
        return time_stage(user, frame, SSDGS_STAGE_##name); \
    }
STAGES(HOOK)

/* A context with the model at hand; allocator may be NULL, threads 0 = all. The hooks want s to stay where it
   is. */
static void open_session(const bench *b, session *s, int isa, int threads, int hooks,
                         const ssdgs_allocator *allocator) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    ssdgs_gpu_hook hook;
    memset(&hook, 0, sizeof hook);
    memset(s, 0, sizeof *s);
    desc.isa = (ssdgs_isa)isa;
    desc.threads = threads;
    if (allocator) desc.allocator = *allocator;
#define SET(name) hook.stage[SSDGS_STAGE_##name] = time_##name;
    STAGES(SET)
    hook.user = s;
    if (hooks) desc.gpu = &hook;
    check(NULL, ssdgs_context_create(&desc, &s->context));
    check(s->context, ssdgs_model_load(s->context, b->model, &s->model, NULL));
}

/* The session's model becomes a level of detail with a share of its Gaussians. */
static void reduce_session(session *s, double share) {
    const int count = (int)(share * s->model->count);
    if (share < 1) check(s->context, reduce_model(s->context, &s->model, count > 1 ? count : 1));
}

static void close_session(session *s) {
    ssdgs_model_destroy(s->model);
    ssdgs_context_destroy(s->context);
}

/* A frame of each view or, with a trainer, a step. Light and camera move every time unless they are fixed. */
typedef struct job {
    session *s;
    ssdgs_trainer *trainer;
    int iteration; /* of the first view's step; a multiple of the views, where a pass over the photographs
                      begins */
    ssdgs_render_options options;
    int width, height, views, fixed_light, fixed_camera, turned_away;
    double ms, stage_ms[TIMES]; /* means over the views of each one's best */
    double shaded;              /* fraction of the Gaussians */
} job;

static job make_job(const bench *b, session *s, ssdgs_render_options options) {
    const int views =
        s->context->isa == b->best_isa || b->views < 4 ? b->views : 2; /* fewer where they take long */
    job j = {s, NULL, 0, options, SIDE, SIDE, views, 0, 0, 0, 0, {0}, 0};
    return j;
}

/* The same picture on a screen of another size; a wider one shows more on both sides. */
static ssdgs_camera scaled_camera(const ssdgs_camera *camera, int width, int height) {
    ssdgs_camera c = *camera;
    const ssdgs_real scale = (ssdgs_real)height / (ssdgs_real)camera->height;
    c.fx *= scale;
    c.fy *= scale;
    c.cx = c.cx * scale + ((ssdgs_real)width - (ssdgs_real)camera->width * scale) / 2;
    c.cy *= scale;
    c.width = width;
    c.height = height;
    return c;
}

/* stats may be NULL: they take their time too. */
static void run(bench *b, job *j, int view, ssdgs_render_stats *stats) {
    const ssdgs_photo *seen = b->photos + (j->fixed_camera ? 0 : view * b->photo_count / j->views);
    const ssdgs_photo *lit = b->photos + (j->fixed_light ? 0 : view * b->photo_count / j->views);
    ssdgs_camera camera = scaled_camera(&seen->camera, j->width, j->height);
    ssdgs_image image = {0, b->color, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    for (int i = 0; j->turned_away && i < 4; i++) { /* half a turn about the camera's y */
        camera.view[i] = -camera.view[i];
        camera.view[8 + i] = -camera.view[8 + i];
    }
    if (j->trainer) {
        j->trainer->run.iteration = j->iteration + view;
        check(j->s->context, ssdgs_trainer_step(j->trainer, NULL));
    } else
        check(j->s->context,
              ssdgs_render_ex(j->s->model, &camera, &lit->light, 1, &j->options, &image, stats));
}

/* Jobs in turn, for at least two passes; the first also warms up. */
static void time_jobs(bench *b, job *jobs, int count, double seconds) {
    static double best[MAX_JOBS][MAX_PHOTOS][TIMES + 1];
    const double end = olat_seconds() + seconds * (b->quick ? 0.2 : 1);
    if (count > MAX_JOBS) die("jobs", "too many");
    for (int round = 0; round < 2 || (round < 40 && olat_seconds() < end); round++)
        for (int i = 0; i < count; i++) {
            job *j = jobs + i;
            run(b, j, j->views - 1, NULL); /* what is fixed must have been so in the frame before */
            ssdgs_render_stats stats;
            for (int v = 0; v < j->views; v++) {
                memset(j->s->stage, 0, sizeof j->s->stage);
                const double start = olat_seconds();
                run(b, j, v, round ? NULL : &stats);
                double took[TIMES + 1];
                took[TIMES] = olat_seconds() - start;
                if (!round && stats.gaussians) j->shaded += (double)stats.shaded / stats.gaussians / j->views;
                memcpy(took, j->s->stage, sizeof j->s->stage);
                for (int stage = 0; stage <= TIMES; stage++)
                    if (!round || took[stage] < best[i][v][stage]) best[i][v][stage] = took[stage];
            }
        }
    for (int i = 0; i < count; i++) {
        job *j = jobs + i;
        for (int v = 0; v < j->views; v++) {
            for (int stage = 0; stage < TIMES; stage++)
                j->stage_ms[stage] += 1e3 * best[i][v][stage] / j->views;
            j->ms += 1e3 * best[i][v][TIMES] / j->views;
        }
    }
}

/* Phases of the default schedule, in iterations of 60,000. */
static const struct {
    const char *name;
    int from, to;
} phases[] = {{"diffuse", 0, 5000}, {"all", 5000, 60000}};
enum { PHASES = sizeof phases / sizeof *phases };

/* The job as a training job at the model's number of Gaussians, on scaled photographs of its views. */
static job training_job(const bench *b, job j, ssdgs_trainer *trainer, int phase) {
    ssdgs_train_options options = ssdgs_train_options_default();
    options.iterations = 60000;
    options.densify_every = 1 << 30;
    options.opacity_reset_every = 0;
    options.max_gaussians = SSDGS__MAX_GAUSSIANS;
    ssdgs_photo photos[MAX_PHOTOS];
    for (int v = 0; v < j.views; v++) photos[v] = b->scaled[v * b->photo_count / j.views];
    j.trainer = trainer;
    if (!trainer)
        check(j.s->context, ssdgs_trainer_create(j.s->model, photos, j.views, &options, &j.trainer));
    j.iteration = (phases[phase].from + j.views) / j.views * j.views;
    return j;
}

/* ---- quality: images against those of the first options and against the photographs, at the photographs'
   size ---- */

typedef struct quality {
    double psnr_exact, max_error, psnr_photo;
} quality;

static const ssdgs_real black[3] = {0, 0, 0};

/* Stored values within [0,1] of a photograph's view, left in color. */
static void render_stored(bench *b, session *s, const ssdgs_photo *photo,
                          const ssdgs_render_options *options) {
    ssdgs_image image = {0, b->color, b->alpha, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    const size_t pixels = (size_t)photo->camera.width * (size_t)photo->camera.height;
    check(s->context, ssdgs_render_ex(s->model, &photo->camera, &photo->light, 1, options, &image, NULL));
    ssdgs_compose(b->color, b->alpha, pixels, s->model->settings.transfer, black, b->color);
    for (size_t i = 0; i < 3 * pixels; i++)
        b->color[i] = b->color[i] < 0 ? 0 : b->color[i] > 1 ? 1 : b->color[i];
}

/* Of jobs' models and options; the first is exact. */
static void measure_quality(bench *b, const job *jobs, int count, quality *out) {
    const int views = jobs->s->context->isa == b->best_isa || b->photo_count < 4 ? b->photo_count : 4;
    ssdgs_real *target = (ssdgs_real *)make(3 * MAX_PIXELS, sizeof *target);
    memset(out, 0, (size_t)count * sizeof *out);
    ssdgs_real *exact[MAX_PHOTOS];
    for (int o = 0; o < count; o++) {
        double squares = 0, values = 0;
        for (int v = 0; v < views; v++) {
            const ssdgs_photo *photo = b->photos + v * b->photo_count / views;
            const size_t n = (size_t)photo->camera.width * (size_t)photo->camera.height;
            double photo_squares = 0;
            render_stored(b, jobs[o].s, photo, &jobs[o].options);
            if (!o)
                exact[v] =
                    (ssdgs_real *)memcpy(make(3 * n, sizeof *target), b->color, 3 * n * sizeof *target);
            olat_compose(photo, jobs[o].s->model->settings.transfer, black, target);
            for (size_t i = 0; i < 3 * n; i++) {
                double error = (double)(b->color[i] - target[i]);
                photo_squares += error * error;
                error = fabs((double)(b->color[i] - exact[v][i]));
                squares += error * error;
                out[o].max_error = error > out[o].max_error ? error : out[o].max_error;
            }
            values += 3 * (double)n;
            out[o].psnr_photo += ssdgs__psnr(photo_squares / (3 * (double)n)) / views;
        }
        out[o].psnr_exact = ssdgs__psnr(squares / values);
    }
    for (int v = 0; v < views; v++) free(exact[v]);
    free(target);
}

/* ---- what is measured ---- */

static const char *const presets[] = {"exact", "default", "fast", "preview"};
enum { EXACT, DEFAULT, FAST, PREVIEW, PRESETS };

static ssdgs_render_options preset(int i) {
    return i == EXACT     ? ssdgs_render_options_exact()
           : i == DEFAULT ? ssdgs_render_options_default()
           : i == FAST    ? ssdgs_render_options_fast()
                          : ssdgs_render_options_preview();
}

/* One shortcut at a time on top of exact, from weak to strong; levels of detail, the last, by the share of
   the Gaussians. */
static const struct {
    const char *name;
    double values[6];
} knobs[] = {{"max_error", {0.01, 0.03, 0.06, 0.12, 0.25}},
             {"light_detail", {0.8, 0.6, 0.5, 0.35}},
             {"stop", {1e-3, 4e-3, 0.01, 0.03}},
             {"transport_detail", {0.7, 0.5, 0.35}},
             {"alpha_threshold", {0.005, 0.006, 0.01, 0.02}},
             {"gaussians", {0.7, 0.5, 0.35, 0.25, 0.12}}};
enum { KNOBS = sizeof knobs / sizeof *knobs, GAUSSIANS = KNOBS - 1 };

enum { LEVELS = 6, PREVIEW_LEVEL = 4 }; /* levels of detail: the whole, then those of the sweep */

/* The whole model and, behind it, that of previews: pair[i == PREVIEW] is a preset's. */
static void open_pair(const bench *b, session pair[2], int isa, int threads, int hooks) {
    for (int i = 0; i < 2; i++) {
        open_session(b, pair + i, isa, threads, hooks, NULL);
        reduce_session(pair + i, i ? knobs[GAUSSIANS].values[PREVIEW_LEVEL - 1] : 1);
    }
}

static const char *name_of(char text[48], const session *s,
                           const char *what) { /* NULL = nothing more to say */
    snprintf(text, 48, "%s %d thread%s%s%.20s", ssdgs_isa_string(ssdgs_context_isa(s->context)),
             s->context->threads, s->context->threads > 1 ? "s" : "", what ? " " : "", what ? what : "");
    return text;
}

/* Peaks of the chip and its memory. */
static void measure_machine(bench *b) {
    table *t = new_table(b, "machine", "fma_gflops read_gb_per_s");
    const size_t words = (size_t)1 << (b->quick ? 25 : 27); /* 256 MiB, 1 GiB: far beyond the caches */
    uint64_t *memory = (uint64_t *)make(words, sizeof *memory);
    memset(memory, 1, words * sizeof *memory); /* else all its pages are one of zeros */
    for (int i = 0; i < b->isa_count * b->thread_count; i++) {
        const int isa = b->isas[i / b->thread_count];
        session s;
        open_session(b, &s, isa, b->threads[i % b->thread_count], 0, NULL);
        kernel kernels[2];
        kernels[0] = kernels[1] = make_kernel(PEAK_RATE, s.context, isa, NULL);
        kernels[1].work = READ;
        kernels[1].words = memory;
        kernels[1].share = words / (size_t)s.context->threads / 8 * 8;
        kernels[1].operations = 8.0 * (double)kernels[1].share * s.context->threads;
        const int n = isa == b->best_isa ? 2 : 1;
        time_kernels(kernels, n, b->quick ? 0.1 : 0.5);
        char name[48];
        add_row(t, name_of(name, &s, NULL), kernels[0].best, n > 1 ? kernels[1].best : none);
        close_session(&s);
    }
    const int n =
        t->row_count -
        b->thread_count; /* no program can gain more from a second thread; near 1 the machine was busy */
    add_facts(b, "threads2_speedup_peak",
              b->thread_count > 1 ? t->rows[n + 1].value[0] / t->rows[n].value[0] : none);
    free(memory);
    print_table(t);
}

/* The scattering network's layers on one thread, against that thread's peak in the same seconds. */
static void measure_layers(bench *b) {
    table *t = new_table(b, "layers",
                         "peak forward_gflops backward_gflops forward_of_peak backward_of_peak both_of_peak");
    for (int i = 0; i < b->isa_count; i++) {
        session s;
        open_session(b, &s, b->isas[i], 1, 0, NULL);
        network n = make_network(s.model);
        kernel k[3];
        k[0] = make_kernel(PEAK_RATE, s.context, b->isas[i], NULL);
        k[1] = make_kernel(FORWARD, s.context, b->isas[i], &n);
        k[2] = make_kernel(BACKWARD, s.context, b->isas[i], &n);
        time_kernels(k, 3, b->quick ? 0.5 : 2);
        const double *v = add_row(t, ssdgs_isa_string((ssdgs_isa)b->isas[i]), k[0].best, k[1].best, k[2].best,
                                  k[1].best / k[0].best, k[2].best / k[0].best,
                                  3 / (1 / k[1].best + 2 / k[2].best) / k[0].best);
        if (b->isas[i] == b->best_isa) /* of one thread, all of them */
            add_facts(b,
                      "peak_fma_gflops mlp_fp32_fraction_of_peak mlp_fp32_forward_fraction_of_peak "
                      "mlp_fp32_backward_fraction_of_peak",
                      v[0], v[5], v[3], v[4]);
        ssdgs__release(s.context, n.weights);
        ssdgs__release(s.context, n.output_gradient);
        ssdgs__release(s.context, n.gradient);
        free(n.lists);
        close_session(&s);
    }
    print_table(t);
}

/* A row of a job's stages, what is beside them, and all. */
static void add_stages(table *t, const char *name, const job *j) {
    const int stages = t->column_count - 2;
    double *v = new_row(t, name);
    v[stages] = v[stages + 1] = j->ms;
    for (int stage = 0; stage < stages; stage++) v[stages] -= v[stage] = j->stage_ms[stage];
}

/* Ends with a row of each preset, on one thread. */
static void measure_stages(bench *b) {
    table *t[2];
    t[0] = new_table(b, "stages_frame", "project sort bin walk shade composite other total");
    t[1] =
        new_table(b, "stages_training",
                  "project sort bin walk shade composite composite_back shade_back project_back other total");
    for (int i = 0; i < b->isa_count * b->thread_count; i++) {
        session s;
        open_session(b, &s, b->isas[i / b->thread_count], b->threads[i % b->thread_count], 1, NULL);
        job jobs[2];
        jobs[0] = make_job(b, &s, preset(DEFAULT));
        jobs[0].views = jobs[0].views > 4 ? 4 : jobs[0].views;
        jobs[1] = training_job(b, jobs[0], NULL, PHASES - 1);
        for (int k = 0; k < 2; k++) { /* the frame first: steps change the model */
            char name[48];
            time_jobs(b, jobs + k, 1, 1);
            add_stages(t[k], name_of(name, &s, NULL), jobs + k);
        }
        if (b->isas[i / b->thread_count] == b->best_isa && i % b->thread_count == 0) /* on one thread */
            add_facts(b, "walk_fraction transport_fraction", jobs[0].stage_ms[SSDGS_STAGE_WALK] / jobs[0].ms,
                      jobs[0].stage_ms[TRANSPORT] / jobs[0].ms);
        ssdgs_trainer_destroy(jobs[1].trainer);
        close_session(&s);
    }
    session pair[2];
    open_pair(b, pair, b->best_isa, 1, 1);
    for (int p = 0; p < PRESETS; p++) {
        job j = make_job(b, pair + (p == PREVIEW), preset(p));
        j.views = j.views > 4 ? 4 : j.views;
        time_jobs(b, &j, 1, 1);
        add_stages(t[0], presets[p], &j);
    }
    for (int i = 0; i < 2; i++) close_session(pair + i);
    print_table(t[0]);
    print_table(t[1]);
}

static void measure_frames(bench *b) {
    table *t =
        new_table(b, "frames", "ms frames_per_s psnr_exact max_error psnr_photo loss_db shaded_fraction");
    for (int i = 0; i < b->isa_count; i++) {
        session pairs[3][2];
        job jobs[3 * PRESETS], *all = jobs + PRESETS * (b->thread_count - 1);
        for (int n = 0; n < b->thread_count; n++) {
            open_pair(b, pairs[n], b->isas[i], b->threads[n], 0);
            for (int p = 0; p < PRESETS; p++)
                jobs[n * PRESETS + p] = make_job(b, pairs[n] + (p == PREVIEW), preset(p));
        }
        quality q[PRESETS];
        measure_quality(b, all, PRESETS, q);
        time_jobs(b, jobs, b->thread_count * PRESETS, b->isas[i] == b->best_isa ? 6 : 2);
        for (int n = 0; n < b->thread_count * PRESETS; n++) {
            const int p = n % PRESETS;
            char name[48];
            add_row(t, name_of(name, jobs[n].s, presets[p]), jobs[n].ms, 1e3 / jobs[n].ms, q[p].psnr_exact,
                    q[p].max_error, q[p].psnr_photo, q[EXACT].psnr_photo - q[p].psnr_photo, jobs[n].shaded);
        }
        for (int n = 0; n < 2 * b->thread_count; n++) close_session(pairs[n / 2] + n % 2);
        if (b->isas[i] != b->best_isa) continue;
        add_facts(b, "render256_exact_fps render256_default_fps render256_fast_fps render256_preview_fps",
                  1e3 / all[EXACT].ms, 1e3 / all[DEFAULT].ms, 1e3 / all[FAST].ms, 1e3 / all[PREVIEW].ms);
        add_facts(b,
                  "default_psnr_loss_db fast_psnr_loss_db preview_psnr_loss_db shaded_fraction "
                  "threads2_speedup_render",
                  q[EXACT].psnr_photo - q[DEFAULT].psnr_photo, q[EXACT].psnr_photo - q[FAST].psnr_photo,
                  q[EXACT].psnr_photo - q[PREVIEW].psnr_photo, all[DEFAULT].shaded,
                  b->thread_count > 1 ? jobs[DEFAULT].ms / jobs[PRESETS + DEFAULT].ms : none);
    }
    print_table(t);
}

static void measure_sweep(bench *b) {
    table *t = new_table(b, "sweep", "ms rms_error max_error loss_db shaded_fraction");
    char names[MAX_JOBS][48];
    session levels[LEVELS];
    job jobs[MAX_JOBS];
    int count;
    for (int i = 0; i < LEVELS; i++) {
        open_session(b, levels + i, b->best_isa, 0, 0, NULL);
        reduce_session(levels + i, i ? knobs[GAUSSIANS].values[i - 1] : 1);
    }
    for (count = 0; count < PRESETS; count++) {
        jobs[count] = make_job(b, levels + (count == PREVIEW ? PREVIEW_LEVEL : 0), preset(count));
        snprintf(names[count], sizeof *names, "%s", presets[count]);
    }
    for (int k = 0; k < KNOBS; k++)
        for (int i = 0; knobs[k].values[i] > 0; i++, count++) {
            jobs[count] = make_job(b, levels + (k == GAUSSIANS ? i + 1 : 0), preset(EXACT));
            ssdgs_render_options *o = &jobs[count].options;
            ssdgs_real *const fields[GAUSSIANS] = {&o->max_error, &o->light_detail, &o->stop,
                                                   &o->transport_detail, &o->alpha_threshold};
            if (k < GAUSSIANS) *fields[k] = (ssdgs_real)knobs[k].values[i];
            snprintf(names[count], sizeof *names, "%s %g", knobs[k].name, knobs[k].values[i]);
        }
    for (int i = 0; i < count; i++) jobs[i].views = jobs[i].views > 4 ? 4 : jobs[i].views;
    quality q[MAX_JOBS];
    measure_quality(b, jobs, count, q);
    time_jobs(b, jobs, count, 12);
    for (int i = 0; i < count; i++)
        add_row(t, names[i], jobs[i].ms, pow(10, -q[i].psnr_exact / 20), q[i].max_error,
                q[EXACT].psnr_photo - q[i].psnr_photo, jobs[i].shaded);
    for (int i = 0; i < LEVELS; i++) close_session(levels + i);
    print_table(t);
}

/* What stays as it was, or what a scene does without, should cost nothing. */
static void measure_skipping(bench *b) {
    static const struct {
        const char *name;
        int skipped_terms, fixed_light, fixed_camera, turned_away;
    } kinds[] = {{"everything moves, all terms", 0, 0, 0, 0},
                 {"light fixed", 0, 1, 0, 0},
                 {"camera fixed", 0, 0, 1, 0},
                 {"light and camera fixed", 0, 1, 1, 0},
                 {"out of visibility", 0, 0, 0, 1},
                 {"opaque: no scattering", SSDGS_SCATTERING_TERM, 0, 0, 0},
                 {"no shadow", SSDGS_SHADOW_TERM, 0, 0, 0},
                 {"matt: no specular", SSDGS_SPECULAR_TERM, 0, 0, 0},
                 {"no scattering, no specular", SSDGS_SCATTERING_TERM | SSDGS_SPECULAR_TERM, 0, 0, 0},
                 {"diffuse alone", SSDGS_ALL_TERMS & ~SSDGS_DIFFUSE_TERM, 0, 0, 0}};
    enum { KINDS = sizeof kinds / sizeof *kinds };
    table *t = new_table(b, "skipping",
                         "exact_ms default_ms fast_ms preview_ms exact_of_all default_of_all fast_of_all "
                         "preview_of_all");
    session pair[2];
    open_pair(b, pair, b->best_isa, 0, 0);
    job jobs[PRESETS * KINDS];
    for (int i = 0; i < PRESETS * KINDS; i++) {
        jobs[i] = make_job(b, pair + (i % PRESETS == PREVIEW), preset(i % PRESETS));
        jobs[i].options.terms &= ~kinds[i / PRESETS].skipped_terms;
        jobs[i].fixed_light = kinds[i / PRESETS].fixed_light;
        jobs[i].fixed_camera = kinds[i / PRESETS].fixed_camera;
        jobs[i].turned_away = kinds[i / PRESETS].turned_away;
    }
    time_jobs(b, jobs, PRESETS * KINDS, 8);
    for (int i = 0; i < KINDS; i++) {
        double *v = new_row(t, kinds[i].name);
        for (int p = 0; p < PRESETS; p++) {
            v[p] = jobs[PRESETS * i + p].ms;
            v[PRESETS + p] = v[p] / jobs[p].ms;
        }
    }
    for (int i = 0; i < 2; i++) close_session(pair + i);
    print_table(t);
}

/* So many Gaussians on the surfaces of a model: the more they are, the smaller each. */
static ssdgs_model *crowd(ssdgs_context *context, const ssdgs_model *from, int count) {
    ssdgs_model *model;
    check(context, ssdgs_model_create(context, &from->settings, count, &model));
    memcpy(model->globals, from->globals, from->global_count * sizeof *from->globals);
    const double parts = (double)count / from->count;
    for (int i = 0; i < count; i++) {
        const size_t parent = (size_t)((double)i * from->count / count);
        ssdgs_real raw[4], q[4], r[9], *to = model->gaussians + i;
        for (size_t c = 0; c < SSDGS_CHANNELS; c++)
            to[c * model->capacity] = from->gaussians[c * from->capacity + parent];
        for (size_t c = 0; c < 4; c++) raw[c] = to[(SSDGS_ROTATION + c) * model->capacity];
        ssdgs__rotation_scalar(raw, q, r);
        for (size_t axis = 0; axis < 3; axis++) {
            ssdgs_real *log_scale = to + (SSDGS_LOG_SCALE + axis) * model->capacity;
            const double step =
                3 * exp((double)*log_scale) * (ssdgs__uniform(3, 3 * (uint64_t)i + axis) - 0.5);
            for (size_t c = 0; c < 3; c++)
                to[(SSDGS_POSITION + c) * model->capacity] += (ssdgs_real)(step * (double)r[3 * c + axis]);
            *log_scale -= (ssdgs_real)(0.5 * log(parts));
        }
    }
    check(context, ssdgs_model_sort(model));
    return model;
}

/* The session's model becomes one of so many Gaussians. */
static void replicate(session *s, int count) {
    ssdgs_model *from = s->model;
    s->model = crowd(s->context, from, count);
    ssdgs_model_destroy(from);
}

/* An allocator that counts; a block's size stands before it. */
typedef struct meter {
    size_t live, peak;
    int allocations;
} meter;

static void *meter_allocate(void *user, size_t bytes) {
    meter *m = (meter *)user;
    unsigned char *memory = (unsigned char *)malloc(bytes + 64);
    if (!memory) return NULL;
    memcpy(memory, &bytes, sizeof bytes);
    m->allocations++;
    m->live += bytes;
    m->peak = m->live > m->peak ? m->live : m->peak;
    return memory + 64;
}

static void meter_release(void *user, void *memory) {
    unsigned char *start = (unsigned char *)memory - 64;
    size_t bytes;
    memcpy(&bytes, start, sizeof bytes);
    ((meter *)user)->live -= bytes;
    free(start);
}

/* The session holds a model of so many Gaussians, and no more. */
static void open_metered(const bench *b, session *s, meter *m, int gaussians) {
    ssdgs_allocator allocator;
    allocator.allocate = meter_allocate, allocator.release = meter_release, allocator.user = m;
    memset(m, 0, sizeof *m);
    open_session(b, s, b->best_isa, 0, 0, &allocator);
    if (gaussians) replicate(s, gaussians);
    m->peak = m->live;
}

/* Slope of the logarithms of column y over those of column x, by least squares. */
static double exponent(const table *t, int first, int count, int x, int y) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = first; i < first + count; i++) {
        const double u = log(t->rows[i].value[x]), v = log(t->rows[i].value[y]);
        sx += u, sy += v, sxx += u * u, sxy += u * v;
    }
    return (count * sxy - sx * sy) / (count * sxx - sx * sx);
}

static void measure_scaling(bench *b) {
    static const int sizes[] = {10000, 30000, 100000, 300000, 1000000, 3000000, 300000},
                     screens[][2] = {{800, 800},   {128, 128},  {256, 256},  {512, 512},
                                     {1024, 1024}, {1280, 720}, {1920, 1080}};
    enum { SIZES = 6, SCREENS = 6, MILLION = 4 };
    table *t = new_table(b, "scaling", "gaussians pixels ms frames_per_s mib_held second_frame_allocations");
    const int most = b->quick ? 3 : b->prefix[0] ? 5 : SIZES; /* the published network takes long */
    const row *last = t->rows + (most - 1 < MILLION ? most - 1 : MILLION);
    for (int i = 0; i <= SIZES + SCREENS; i++) { /* sizes; both; screens at the model's own size */
        if ((i >= most && i < SIZES) || (i == SIZES && b->quick)) continue;
        session s;
        meter m;
        open_metered(b, &s, &m, i <= SIZES ? sizes[i] : 0);
        job j = make_job(b, &s, preset(DEFAULT));
        j.views = 2;
        j.width = screens[i < SIZES ? 2 : i - SIZES][0];
        j.height = screens[i < SIZES ? 2 : i - SIZES][1];
        for (int k = 0; k < 2;
             k++) { /* the same frame twice; a model that changed in between, so that all is done again */
            const int before = m.allocations;
            ssdgs_model_arrays(s.model);
            run(b, &j, 0, NULL);
            m.allocations -= k ? before : 0;
        }
        char name[48];
        snprintf(name, sizeof name, "%d at %dx%d", s.model->count, j.width, j.height);
        const int k = m.allocations;
        time_jobs(b, &j, 1, 1);
        add_row(t, name, (double)s.model->count, (double)j.width * j.height, j.ms, 1e3 / j.ms,
                (double)m.peak / 1048576, (double)k);
        close_session(&s);
    }
    add_facts(b,
              "exponent_gaussians exponent_pixels render800_300k_default_fps second_frame_gaussians "
              "second_frame_allocations",
              exponent(t, 0, most, 0, 2), exponent(t, t->row_count - SCREENS, SCREENS, 1, 2),
              b->quick ? none : t->rows[most].value[3], last->value[0], last->value[5]);
    add_facts(b, "bytes_per_gaussian_render",
              1048576 * (last[0].value[4] - last[-1].value[4]) / (last[0].value[0] - last[-1].value[0]));
    print_table(t);
}

/* Placed objects of one model of 5,000 Gaussians on a square grid, under point lights that hang over it: a
   frame in which the lights, the camera and an object move, and one in which nothing does. */
static void measure_scenes(bench *b) {
    enum { EVERYWHERE, LOCAL, AMBIENT, BY_LEVELS };
    static const char *const reach[4] = {"", " with a range", ", ambient", " with a range, levels of detail"};
    static const int kinds[][3] = {{1, 1, EVERYWHERE}, {3, 2, EVERYWHERE},  {10, 1, EVERYWHERE},
                                   {10, 1, AMBIENT},   {10, 4, EVERYWHERE}, {100, 1, EVERYWHERE},
                                   {100, 16, LOCAL},   {100, 16, BY_LEVELS}}; /* objects, lights */
    enum { KINDS = sizeof kinds / sizeof *kinds, MOST = 100, COUNT = 5000, LIGHTS = 16, COARSER = 3 };
    const ssdgs_real *intensity = b->photos[0].light.intensity;
    table *t = new_table(b, "scenes", "objects lights gaussians ms_moving ms_at_rest mib_held");
    for (int k = 0; k < KINDS - 3 * b->quick; k++) {
        const int objects = kinds[k][0], lights = kinds[k][1], side = (int)ceil(sqrt(objects));
        const int levels = kinds[k][2] == BY_LEVELS, local = levels || kinds[k][2] == LOCAL,
                  rows = local ? 4 : 2;
        ssdgs_model *coarser[COARSER] = {NULL, NULL, NULL};
        ssdgs_render_options options = ssdgs_render_options_default();
        static ssdgs_object object[MOST];
        ssdgs_light light[LIGHTS];
        ssdgs_image image = {0, b->color, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
        ssdgs_real low[3], high[3];
        ssdgs_scene *scene = NULL;
        double best[2] = {1e30, 1e30};
        session s;
        meter m;
        open_metered(b, &s, &m, 0);
        reduce_session(&s, COUNT / (double)s.model->count);
        check(s.context, ssdgs_model_bounds(s.model, low, high));
        for (int i = 0; i < COARSER && levels; i++) { /* a half, a quarter, an eighth, merged */
            check(s.context, ssdgs_model_load(s.context, b->model, &coarser[i], NULL));
            check(s.context, reduce_model(s.context, &coarser[i], s.model->count >> (i + 1)));
        }
        check(s.context, ssdgs_scene_create(s.context, &scene));
        const ssdgs_real step =
            (ssdgs_real)1.1 * (high[0] - low[0] > high[1] - low[1] ? high[0] - low[0] : high[1] - low[1]);
        const ssdgs_real width = step * (ssdgs_real)side, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
        for (int i = 0; i < objects; i++) {
            object[i] = ssdgs_object_default(s.model);
            object[i].levels = coarser;
            object[i].level_count = levels ? COARSER : 0;
            object[i].to_world[3] = step * ((ssdgs_real)(i % side) - (ssdgs_real)(side - 1) / 2);
            object[i].to_world[7] = step * ((ssdgs_real)(i / side) - (ssdgs_real)(side - 1) / 2);
        }
        memset(light, 0, sizeof light);
        for (int c = 0; c < 3 && kinds[k][2] == AMBIENT; c++) options.ambient[0][c] = intensity[c] / 10;
        for (int frame = 0; frame < (b->quick ? 8 : 24); frame++) {
            const int moving = frame % 2 == 0; /* the frame after it is the same */
            const ssdgs_real t01 = (ssdgs_real)(frame / 2) / 12, eye[3] = {t01 * width / 4, -width, width};
            const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.9, SIDE, SIDE);
            object[0].to_world[11] = t01 * step / 4;
            for (int l = 0; l < lights; l++) {
                const ssdgs_real apart = width / (ssdgs_real)(rows - 1) * (local ? (ssdgs_real)0.75 : 1);
                light[l].position[0] =
                    apart * ((ssdgs_real)(l % rows) - (ssdgs_real)(rows - 1) / 2 + t01 / 4);
                light[l].position[1] = apart * ((ssdgs_real)(l / rows) - (ssdgs_real)(rows - 1) / 2);
                light[l].position[2] = local ? step : width;
                light[l].range = local ? 2 * step : 0;
                for (int c = 0; c < 3; c++)
                    light[l].intensity[c] = intensity[c] * light[l].position[2] * light[l].position[2];
            }
            const double start = olat_seconds();
            check(s.context,
                  ssdgs_scene_render(scene, object, objects, &camera, light, lights, &options, &image, NULL));
            const double ms = 1e3 * (olat_seconds() - start);
            if (frame > 1 && ms < best[!moving]) best[!moving] = ms;
        }
        char name[64];
        snprintf(name, sizeof name, "%d object%s, %d light%s%s", objects, objects > 1 ? "s" : "", lights,
                 lights > 1 ? "s" : "", reach[kinds[k][2]]);
        add_row(t, name, (double)objects, (double)lights, (double)objects * s.model->count, best[0], best[1],
                (double)m.peak / 1048576);
        ssdgs_scene_destroy(scene);
        for (int i = 0; i < COARSER; i++) ssdgs_model_destroy(coarser[i]);
        close_session(&s);
    }
    print_table(t);
}

static int count_bytes(void *sum, const void *bytes, size_t size) {
    (void)bytes;
    *(size_t *)sum += size;
    return 0;
}

/* What an engine asks for beside frames: one object that covers few of 1280x720 pixels. Nothing moves. */
static void measure_engine(bench *b) {
    enum { W = 1280, H = 720, CALLS = 8 };
    static const char *const names[CALLS] = {"frame, nothing in sight",     "frame, few pixels covered",
                                             "depth of an engine's buffer", "sRGB bytes",
                                             "premultiplied halves",        "blended over sRGB bytes",
                                             "a light's map for a shader",  "model to memory"};
    const size_t pixels = (size_t)W * H;
    table *t = new_table(b, "engine", "ms");
    session s;
    open_session(b, &s, 0, b->threads[0], 0, NULL);
    ssdgs_scene *scene = NULL;
    check(s.context, ssdgs_scene_create(s.context, &scene));
    ssdgs_object object = ssdgs_object_default(s.model);
    ssdgs_real *color = (ssdgs_real *)calloc(pixels * 5, sizeof *color), low[3], high[3];
    ssdgs_image image = {0, color, color + 3 * pixels, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    float *depth = (float *)calloc(pixels, sizeof *depth), *map[2];
    void *bytes = malloc(8 * pixels);
    if (!color || !depth || !bytes) die("engine", "out of memory");
    check(s.context, ssdgs_model_bounds(s.model, low, high));
    const ssdgs_real away = 6 * (high[0] - low[0]), eye[3] = {0, -away, away / 2}, up[3] = {0, 0, 1};
    const ssdgs_real perspective[16] = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, (ssdgs_real)-0.1, 0, 0, -1, 0};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, low, up, (ssdgs_real)0.9, W, H);
    const ssdgs_light light = b->photos[0].light;
    ssdgs_light_map shape;
    check(s.context, ssdgs_scene_light(scene, &object, 1, NULL, &light, 1, NULL));
    check(s.context, ssdgs_scene_light_map(scene, 0, &shape, NULL, NULL));
    const size_t texels = 4 * (size_t)shape.faces * (size_t)shape.size * (size_t)shape.size;
    map[0] = (float *)malloc((2 * texels + 1) * sizeof **map);
    if (!map[0]) die("engine", "out of memory");
    map[1] = map[0] + texels;
    for (int call = 0; call < CALLS; call++) {
        double best = 1e30;
        object.to_world[3] = call ? 0 : 100 * away;
        for (int i = 0; i < (b->quick ? 3 : 10); i++) {
            const int format = call == 4 ? SSDGS_RGBA16F + SSDGS_PREMULTIPLIED : SSDGS_RGBA8;
            size_t sum = 0;
            const double start = olat_seconds();
            if (call < 2)
                check(s.context,
                      ssdgs_scene_render(scene, &object, 1, &camera, &light, 1, NULL, &image, NULL));
            else if (call == 2)
                check(s.context, ssdgs_depth_from_buffer(s.context, perspective, 0, depth, 4 * W, W, H,
                                                         color + 4 * pixels));
            else if (call < 5)
                ssdgs_to_pixels(s.context, &image, W, H, SSDGS_TRANSFER_SRGB, format, bytes,
                                (call - 2) * 4 * W);
            else if (call == 5)
                ssdgs_blend_pixels(s.context, &image, W, H, SSDGS_TRANSFER_SRGB, SSDGS_RGBA8, bytes, 4 * W);
            else if (call == 6) check(s.context, ssdgs_scene_light_map(scene, 0, &shape, map[0], map[1]));
            else check(s.context, ssdgs_model_write(s.model, count_bytes, &sum));
            const double ms = 1e3 * (olat_seconds() - start);
            if (ms < best) best = ms;
        }
        add_row(t, names[call], best);
    }
    print_table(t);
    free(color), free(depth), free(bytes), free(map[0]);
    ssdgs_scene_destroy(scene);
    close_session(&s);
}

/* Density control, every hundredth iteration, is left out: the number of Gaussians stays the model's. */
static void measure_training(bench *b) {
    table *t = new_table(b, "training", "iterations ms_1_thread ms_all_threads hours_all_threads");
    const int last = b->thread_count - 1, sizes[2] = {20000, b->quick ? 40000 : 60000};
    double hours[2] = {0, 0};
    session s[3];
    job jobs[3 * PHASES], *all = jobs + PHASES * last;
    for (int n = 0; n <= last; n++) {
        open_session(b, s + n, b->best_isa, b->threads[n], 0, NULL);
        for (int p = 0; p < PHASES; p++)
            jobs[n * PHASES + p] =
                training_job(b, make_job(b, s + n, preset(EXACT)), p ? jobs[n * PHASES].trainer : NULL, p);
    }
    time_jobs(b, jobs, b->thread_count * PHASES, 10);
    for (int p = 0; p < PHASES; p++) {
        const double iterations = phases[p].to - phases[p].from;
        add_row(t, phases[p].name, iterations, jobs[p].ms, all[p].ms, iterations * all[p].ms / 3.6e6);
        hours[0] += iterations * jobs[p].ms / 3.6e6;
        hours[1] += iterations * all[p].ms / 3.6e6;
    }
    add_row(t, "whole run", 6e4, hours[0] * 60, hours[1] * 60, hours[1]);
    const int p = PHASES - 1;
    add_facts(b,
              "train256_ms_per_iteration train256_ms_per_iteration_mean train_60k_hours_projected "
              "threads2_speedup_train",
              all[p].ms /* of the last phase, most of a run */, hours[1] * 60, hours[1],
              last ? jobs[p].ms / jobs[PHASES + p].ms : none);
    for (int n = 0; n <= last; n++) {
        ssdgs_trainer_destroy(jobs[n * PHASES].trainer);
        close_session(s + n);
    }
    double held[2];
    for (int n = 0; n < 2; n++) {
        meter m;
        open_metered(b, s, &m, sizes[n]);
        job j = training_job(b, make_job(b, s, preset(EXACT)), NULL, p);
        run(b, &j, 0, NULL);
        held[n] = (double)m.peak;
        ssdgs_trainer_destroy(j.trainer);
        close_session(s);
    }
    add_facts(b, "bytes_per_gaussian_train", (held[1] - held[0]) / (sizes[1] - sizes[0]));
    print_table(t);
}

static void measure_model(bench *b, const char *prefix, const char *path) {
    b->prefix = prefix;
    b->model = path;
    session s;
    open_session(b, &s, b->best_isa, 1, 0, NULL);
    printf("\n%s: %d Gaussians, scattering network of %d layers, %d wide\n", path, s.model->count,
           s.model->settings.scattering.layers, s.model->settings.scattering.width);
    add_facts(b, "gaussians", (double)s.model->count);
    close_session(&s);
    measure_layers(b);
    measure_stages(b);
    measure_frames(b);
    measure_sweep(b);
    measure_skipping(b);
    measure_scaling(b);
    measure_scenes(b);
    measure_engine(b);
    measure_training(b);
}

/* ---- a GPU beside the CPU ---- */

typedef struct stage_times {
    double began, seconds[SSDGS_STAGE_COUNT];
    int stage;
} stage_times;

static void note_stage(void *user, const char *name) {
    stage_times *t = (stage_times *)user;
    if (name) t->began = olat_seconds();
    else t->seconds[t->stage++] += olat_seconds() - t->began;
    t->stage %= SSDGS_STAGE_COMPOSITE + 1;
}

/* Milliseconds of a frame, the mean of some. The camera moves, the light where that is asked for. */
static double frame_ms(bench *b, ssdgs_model *model, int width, int height, int lights_move, int picture) {
    ssdgs_image image = {0, picture ? b->color : NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    const double first = olat_seconds();
    double start = first;
    int frames = 0, warm = 0; /* a GPU takes a while to raise its clock */
    for (int i = 0; frames < 1 || (frames < 200 && olat_seconds() < start + (b->quick ? 0.2 : 1)); i++) {
        const ssdgs_photo *photo = b->photos + i % b->photo_count;
        const ssdgs_camera camera = scaled_camera(&photo->camera, width, height);
        if (!warm && i > 1 && olat_seconds() > first + (b->quick ? 0 : 0.3)) warm = 1, start = olat_seconds();
        frames += warm;
        check(model->context, ssdgs_render_ex(model, &camera, lights_move ? &photo->light : &b->photos->light,
                                              1, NULL, &image, NULL));
    }
    return 1e3 * (olat_seconds() - start) / frames;
}

enum { PLACED = 20, PLACED_LIGHTS = 4 };

/* Milliseconds a frame of a scene of placed objects that moves, or rests. color: NULL: the
   picture does not come back. */
static double level_ms(ssdgs_context *context, ssdgs_scene *scene, ssdgs_model *model, int frames, int moves,
                       ssdgs_real *color) {
    const ssdgs_real up[3] = {0, 0, 1}, eye[3] = {0, -7, 3}, target[3] = {0, 0, 0}, sun[3] = {0.6f, 0, -0.8f},
                     white[3] = {9, 9, 9}, even[3] = {1, 1, 1};
    const int w = 1280, h = 720;
    ssdgs_image image;
    double start = 0;
    memset(&image, 0, sizeof image);
    image.color = color;
    for (int frame = -1; frame < frames; frame++) { /* the first does not count */
        ssdgs_object objects[PLACED];
        ssdgs_light lights[PLACED_LIGHTS];
        const double t = moves ? 0.1 * (frame + 1) : 0;
        for (int i = 0; i < PLACED; i++) {
            const double turn = t + i, c = cos(turn), d = sin(turn);
            const ssdgs_real rows[12] = {(ssdgs_real)c,
                                         (ssdgs_real)-d,
                                         0,
                                         (ssdgs_real)(1.4 * (i % 5 - 2)),
                                         (ssdgs_real)d,
                                         (ssdgs_real)c,
                                         0,
                                         (ssdgs_real)(1.4 * (i / 5 - 1.5)),
                                         0,
                                         0,
                                         1,
                                         0};
            objects[i] = ssdgs_object_default(model);
            memcpy(objects[i].to_world, rows, sizeof rows);
        }
        for (int i = 0; i < PLACED_LIGHTS; i++) {
            const ssdgs_real at[3] = {(ssdgs_real)(4 * cos(t + 2 * i)), (ssdgs_real)(4 * sin(t + 2 * i)), 4},
                             down[3] = {-at[0], -at[1], -at[2]};
            lights[i] = i == 3   ? ssdgs_light_directional(sun, even)
                        : i == 2 ? ssdgs_light_spot(at, down, white, 0.3f, 0.5f)
                                 : ssdgs_light_point(at, white);
        }
        const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.9f, w, h);
        if (!frame) start = olat_seconds();
        check(context,
              ssdgs_scene_render(scene, objects, PLACED, &camera, lights, PLACED_LIGHTS, NULL, &image, NULL));
    }
    return 1e3 * (olat_seconds() - start) / frames;
}

/* An engine's level on a GPU beside the CPU's. */
static void measure_gpu_level(bench *b, gpu *device, int gaussians, int frames) {
    const ssdgs_gpu_hook hook = gpu_hook(device);
    double ms[2][3];
    for (int on = 0; on < 2; on++) {
        ssdgs_context_desc desc;
        ssdgs_context *context;
        ssdgs_scene *scene;
        ssdgs_model *loaded, *model;
        memset(&desc, 0, sizeof desc);
        if (on) desc.gpu = &hook;
        check(NULL, ssdgs_context_create(&desc, &context));
        check(context, ssdgs_scene_create(context, &scene));
        check(context, ssdgs_model_load(context, b->model, &loaded, NULL));
        model = crowd(context, loaded, gaussians);
        for (int j = 0; j < 3; j++)
            ms[on][j] = level_ms(context, scene, model, frames, j < 2, j == 1 ? b->color : NULL);
        ssdgs_model_destroy(loaded);
        ssdgs_model_destroy(model);
        ssdgs_scene_destroy(scene);
        ssdgs_context_destroy(context);
    }
    printf("%d objects of %d Gaussians, %d lights, 1280 x 720; milliseconds a frame\n"
           "                         | all moves, with picture, at rest\n"
           "  GPU                    | %8.1f %8.1f %8.1f\n"
           "  CPU                    | %8.1f %8.1f %8.1f\n"
           "  CPU / GPU: %.2f; GPU at rest / moving: %.2f\n",
           PLACED, gaussians, PLACED_LIGHTS, ms[1][0], ms[1][1], ms[1][2], ms[0][0], ms[0][1], ms[0][2],
           ms[0][0] / ms[1][0], ms[1][2] / ms[1][0]);
}

/* Frames of models of several sizes on a GPU and on the CPU, and the GPU's stages. */
static void measure_gpu(bench *b) {
    static const int counts[3] = {30000, 300000, 1000000},
                     sizes[3][2] = {{256, 256}, {800, 800}, {1920, 1080}};
    static const char *const stages[] = {"project", "sort", "bin", "walk", "shade", "composite"};
    char message[256];
    gpu *device = gpu_create(NULL, message, sizeof message);
    if (!device) die("--gpu", message);
    printf(
        "%s beside %s; milliseconds a frame, each from another camera, default options\n"
        "  Gaussians      pixels | GPU, no picture, picture, light moves | CPU, light moves | GPU's stages\n",
        gpu_name(device), b->cpu);
    for (int i = 0; i < (b->quick ? 1 : 3); i++) {
        ssdgs_model *models[2], *loaded;
        ssdgs_context *contexts[2];
        stage_times times;
        const ssdgs_gpu_hook hook = gpu_hook(device);
        for (int on = 0; on < 2; on++) {
            ssdgs_context_desc desc;
            memset(&desc, 0, sizeof desc);
            if (on) desc.gpu = &hook, desc.tracer.stage = note_stage, desc.tracer.user = &times;
            memset(&times, 0, sizeof times);
            check(NULL, ssdgs_context_create(&desc, contexts + on));
            check(contexts[on], ssdgs_model_load(contexts[on], b->model, &loaded, NULL));
            models[on] = crowd(contexts[on], loaded, b->quick ? 3000 : counts[i]);
            ssdgs_model_destroy(loaded);
        }
        for (int size = 0; size < (b->quick ? 1 : 3); size++) {
            const int w = sizes[size][0], h = sizes[size][1];
            double ms[5], sum = 0;
            for (int j = 0; j < 5; j++) ms[j] = frame_ms(b, models[j < 3], w, h, j == 2 || j == 4, j > 0);
            printf("  %9d %5d x %4d | %8.2f %8.2f %8.2f | %8.1f %8.1f |", models[1]->count, w, h, ms[0],
                   ms[1], ms[2], ms[3], ms[4]);
            gpu_wait(device, 1);
            memset(&times, 0, sizeof times);
            const double all = frame_ms(b, models[1], w, h, 1, 1);
            gpu_wait(device, 0);
            for (int j = 0; j <= SSDGS_STAGE_COMPOSITE; j++) sum += times.seconds[j];
            for (int j = 0; j <= SSDGS_STAGE_COMPOSITE; j++)
                printf(" %s %.2f", stages[j], all * times.seconds[j] / sum);
            printf("\n");
            fflush(stdout);
        }
        for (int on = 0; on < 2; on++) {
            ssdgs_model_destroy(models[on]);
            ssdgs_context_destroy(contexts[on]);
        }
    }
    measure_gpu_level(b, device, b->quick ? 500 : 15000, b->quick ? 1 : 3);
    gpu_destroy(device);
}

/* ---- the chart: each shortcut's time against its error, from exact on ---- */

static const struct {
    const char *ink, *mark;
} looks[KNOBS] = {/* inks that read on white and on black */
                  {"#d1495b", "m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z"},
                  {"#3d85c6", "m-3.5 -3.5h7v7h-7z"},
                  {"#2a9d6f", "m0 -5l5 9h-10z"},
                  {"#8e5bb5", "m0 -5l5 5l-5 5l-5 -5z"},
                  {"#d98a1f", "m0 5l5 -9h-10z"},
                  {"#7a8b2e", "m-1.5 -5h3v3.5h3.5v3h-3.5v3.5h-3v-3.5h-3.5v-3h3.5z"}};
enum { WIDE = 400, HIGH = 340, LEFT = 56, TOP = 64, BARS = TOP + HIGH + 72, BAR = 22 };
static const double least_error = 1e-5,
                    largest_error = 0.1; /* images that are equal, or nearly, stand on the axis */

typedef struct chart {
    FILE *file;
    double left, fastest, slowest;
} chart;

static double chart_x(const chart *c, double ms) {
    return c->left + WIDE * log(ms / c->fastest) / log(c->slowest / c->fastest);
}

static double chart_y(double error) {
    return TOP + HIGH * log((error > least_error ? error : least_error) / largest_error) /
                     log(least_error / largest_error);
}

static void draw_axes(const chart *c, const char *title) {
    static const double steps[] = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8},
                        levels[] = {1e-5, 1e-4, 1.0 / 255, 1e-3, 1e-2, 1e-1};
    const double bottom = TOP + HIGH;
    fprintf(c->file, "<text x=\"%.0f\" y=\"%d\" class=\"b\">%s</text>\n<g class=\"g\">\n", c->left, TOP - 12,
            title);
    for (int i = 0; i < 6; i++)
        fprintf(c->file,
                "<path d=\"M%.1f %.1fh%d\"%s/><text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%s%g</text>\n",
                c->left, chart_y(levels[i]), WIDE, i == 2 ? " stroke-dasharray=\"4 4\"" : "", c->left - 6,
                chart_y(levels[i]) + 4, i == 2 ? "1/" : "", i == 2 ? 255 : levels[i]);
    for (double decade = 1e-3; decade < c->slowest; decade *= 10)
        for (int i = 0; i < 10; i++) {
            const double x = chart_x(c, decade * steps[i]);
            if (x >= c->left && x <= c->left + WIDE)
                fprintf(c->file,
                        "<path d=\"M%.1f %.1fv-5\"/><text x=\"%.1f\" y=\"%.1f\" "
                        "text-anchor=\"middle\">%g</text>\n",
                        x, bottom, x, bottom + 16, decade * steps[i]);
        }
    fprintf(c->file, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">milliseconds a frame</text></g>\n",
            c->left + WIDE / 2, bottom + 34);
}

/* The Pareto front: no other row is as fast with as small an error. */
static void draw_front(const chart *c, const table *t) {
    double ms = 0;
    fprintf(c->file, "<path class=\"f\" d=\"");
    for (int drawn = 0;; drawn++) { /* the next slower row that errs less than all faster ones */
        const double *next = NULL;
        for (int r = 0; r < t->row_count; r++) {
            const double *v = t->rows[r].value;
            int best = v[0] > ms;
            for (int i = 0; i < t->row_count; i++) {
                const double *w = t->rows[i].value;
                best = best && !(w[0] < v[0] && w[1] <= v[1]);
            }
            if (best && (!next || v[0] < next[0])) next = v;
        }
        if (!next) break;
        fprintf(c->file, "%c%.1f %.1f", drawn ? 'L' : 'M', chart_x(c, next[0]), chart_y(next[1]));
        ms = next[0];
    }
    fprintf(c->file, "\"/>\n");
}

static const char *const stage_inks[] = {"#d1495b", "#8e5bb5", "#3d85c6", "#2a9d6f",
                                         "#d98a1f", "#7a8b2e", "#909090"};
enum { STAGE_INKS = sizeof stage_inks / sizeof *stage_inks };

/* What each stage takes of each preset's frame: the table's last rows. */
static void draw_bars(const chart *c, const table *t) {
    const row *rows = t->rows + t->row_count - PRESETS;
    const double scale = (WIDE - 40) / rows[EXACT].value[STAGE_INKS];
    for (int p = 0; p < PRESETS; p++) {
        double x = c->left;
        for (int i = 0; i < STAGE_INKS; i++) {
            const double width = scale * (rows[p].value[i] > 0 ? rows[p].value[i] : 0);
            fprintf(c->file, "<path fill=\"%s\" d=\"M%.1f %dh%.1fv%dh-%.1fz\"/>\n", stage_inks[i], x,
                    BARS + BAR * p, width, BAR - 4, width);
            x += width;
        }
        fprintf(
            c->file,
            "<text x=\"%.1f\" y=\"%d\" text-anchor=\"end\">%s</text><text x=\"%.1f\" y=\"%d\">%.1f</text>\n",
            c->left - 6, BARS + BAR * p + 13, presets[p], x + 6, BARS + BAR * p + 13,
            rows[p].value[STAGE_INKS]);
    }
}

static void draw_sweep(chart *c, const table *t, const char *title) {
    const double *v = t->rows[EXACT].value, x0 = v[0], y0 = v[1];
    c->fastest = c->slowest = x0;
    for (int r = 0; r < t->row_count; r++) {
        v = t->rows[r].value;
        c->fastest = v[0] < c->fastest ? v[0] : c->fastest;
        c->slowest = v[0] > c->slowest ? v[0] : c->slowest;
    }
    c->fastest /= 1.15;
    c->slowest *= 1.15;
    draw_axes(c, title);
    draw_front(c, t);
    for (int r = PRESETS, k = 0; k < KNOBS; k++) {
        fprintf(c->file, "<g fill=\"%s\"><path fill=\"none\" stroke=\"%s\" d=\"M%.1f %.1f", looks[k].ink,
                looks[k].ink, chart_x(c, x0), chart_y(y0));
        for (int i = 0; knobs[k].values[i] > 0; i++) {
            v = t->rows[r + i].value;
            fprintf(c->file, "L%.1f %.1f", chart_x(c, v[0]), chart_y(v[1]));
        }
        fprintf(c->file, "\"/>");
        for (int i = 0; knobs[k].values[i] > 0; i++, r++) {
            v = t->rows[r].value;
            fprintf(c->file, "<path d=\"M%.1f %.1f%s\"/><text x=\"%.1f\" y=\"%.1f\" class=\"s\">%g</text>",
                    chart_x(c, v[0]), chart_y(v[1]), looks[k].mark, chart_x(c, v[0]) + 7, chart_y(v[1]) + 3,
                    knobs[k].values[i]);
        }
        fprintf(c->file, "</g>\n");
    }
    for (int r = 0; r < PRESETS; r++) {
        const double x = chart_x(c, t->rows[r].value[0]), y = chart_y(t->rows[r].value[1]);
        fprintf(
            c->file,
            "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"7\" class=\"p\"/><text x=\"%.1f\" y=\"%.1f\" class=\"b\" "
            "text-anchor=\"%s\">%s</text>\n",
            x, y, r ? x - 12 : x, r ? y + 4 : y - 12, r ? "end" : "middle", presets[r]);
    }
}

static void write_svg(const bench *b, FILE *file) {
    chart c;
    c.file = file;
    c.left = LEFT;
    fprintf(file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" font-family=\"sans-serif\" "
            "font-size=\"12\" "
            "fill=\"#808080\">\n<style>.g "
            "path{stroke:#888;stroke-opacity:.4;fill:none}.b{font-weight:bold}.s{font-size:9px}"
            ".p{fill:none;stroke:#808080;stroke-width:2.5}"
            ".f{fill:none;stroke:#888;stroke-opacity:.35;stroke-width:9;stroke-linejoin:round}</style>\n"
            "<text x=\"12\" y=\"18\">root mean square error against exact; 1 is white; grey: the Pareto "
            "front</text>\n",
            2 * (WIDE + LEFT) + 32, BARS + BAR * PRESETS + 30);
    for (int i = 0; i < KNOBS; i++)
        fprintf(file, "<path d=\"M%d 32%s\" fill=\"%s\"/><text x=\"%d\" y=\"36\">%s</text>\n", 16 + 120 * i,
                looks[i].mark, looks[i].ink, 26 + 120 * i, knobs[i].name);
    for (int i = 0; i < b->table_count; i++) {
        const char *key = b->tables[i].key;
        const int published = key[0] == 'p';
        c.left = LEFT + (published ? WIDE + LEFT : 0);
        if (!strcmp(key, published ? "published_sweep" : "sweep"))
            draw_sweep(&c, b->tables + i, published ? "published model" : "default model");
        if (!strcmp(key, published ? "published_stages_frame" : "stages_frame")) draw_bars(&c, b->tables + i);
    }
    const char *stage = "project sort bin walk shade composite other ";
    for (int i = 0; i < STAGE_INKS; i++, stage += strcspn(stage, " ") + 1)
        fprintf(file, "<path fill=\"%s\" d=\"M%d %dh9v9h-9z\"/><text x=\"%d\" y=\"%d\">%.*s</text>\n",
                stage_inks[i], LEFT + 90 * i, BARS + BAR * PRESETS + 8, LEFT + 90 * i + 13,
                BARS + BAR * PRESETS + 17, (int)strcspn(stage, " "), stage);
    fprintf(file, "<text x=\"%d\" y=\"%d\">ms of a frame on one thread</text>\n</svg>\n",
            LEFT + 90 * STAGE_INKS, BARS + BAR * PRESETS + 17);
}

/* ---- the program ---- */

/* The path of a file beside the program. To be freed. */
static char *path_beside(const char *program, const char *ending) {
    const size_t length = strlen(program),
                 stem = length > 4 && !strcmp(program + length - 4, ".exe") ? length - 4 : length;
    char *path = (char *)make(length + 16, 1);
    if (!strchr(program, '/') && !strchr(program, '\\'))
        die(program, "start it by its path, as build/bench: it writes beside itself");
    snprintf(path, length + 16, "%.*s%s", (int)stem, program, ending);
    return path;
}

/* Calls write on a file beside the program. */
static void write_beside(const bench *b, const char *program, const char *ending,
                         void (*write)(const bench *, FILE *)) {
    char *path = path_beside(program, ending);
    FILE *file = fopen(path, "wb");
    if (!file) die(path, "cannot be written");
    write(b, file);
    if (ferror(file) | fclose(file)) die(path, "cannot be written");
    printf("wrote %s\n", path);
    free(path);
}

/* Its nearest pixels in SIDE x SIDE: enough to take times from. */
static void scale_photo(const ssdgs_photo *from, ssdgs_photo *to) {
    const size_t pixel = from->format == SSDGS_PIXELS_RGBA8     ? 4
                         : from->format == SSDGS_PIXELS_RGBA32F ? 16
                                                                : 8;
    const int w = from->camera.width, h = from->camera.height;
    unsigned char *pixels = (unsigned char *)make(SIDE * SIDE, pixel);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            int u = (int)floor((x + 0.5 - SIDE / 2) * h / SIDE + 0.5 * w), v = (int)((y + 0.5) * h / SIDE);
            u = u < 0 ? 0 : u < w ? u : w - 1;
            memcpy(pixels + pixel * (size_t)(y * SIDE + x),
                   (const unsigned char *)from->pixels + pixel * ((size_t)v * (size_t)w + (size_t)u), pixel);
        }
    *to = *from;
    to->camera = scaled_camera(&from->camera, SIDE, SIDE);
    to->pixels = pixels;
}

/* What is wrong with the models is better known now; where they lie the dataset must be read. No output may
   be one of these files. */
static void look_at_models(const char *dataset, char paths[2][1024], const char *program, double origin[3]) {
    static const char *const endings[2] = {".json", ".svg"};
    olat_guard guard;
    char error[512] = "";
    memset(&guard, 0, sizeof guard);
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.logger.write = olat_hear;
    desc.logger.user = own_name;
    ssdgs_context *context;
    check(NULL, ssdgs_context_create(&desc, &context));
    int failed = olat_guard_folder(&guard, dataset, "transforms_test.json", error);
    for (int i = 1; i >= 0; i--) {
        ssdgs_model *model;
        check(context, ssdgs_model_load(context, paths[i], &model, NULL));
        for (int c = 0; c < 3; c++) origin[c] = (double)ssdgs_model_settings(model)->origin[c];
        ssdgs_model_destroy(model);
        failed = failed || olat_guard_input(&guard, paths[i], error);
    }
    for (int i = 0; i < 2 && !failed; i++) {
        char *path = path_beside(program, endings[i]);
        failed = olat_guard_output(&guard, path, error);
        free(path);
    }
    if (failed) die("files", error);
    olat_guard_free(&guard);
    ssdgs_context_destroy(context);
}

/* The test split, and how much of it is used. */
static void load_photos(bench *b, const double origin[3]) {
    char error[512] = "";
    double pixels = 0, seconds[2];
    olat_reader reader = {NULL, NULL, NULL};
    check(NULL, ssdgs_context_create(NULL, &reader.context));
    for (int i = 0; i < 2; i++) { /* on one thread, on all: which is kept */
        olat_free(&b->data);
        seconds[i] = olat_seconds();
        if (olat_load_at(b->dataset, "transforms_test.json", 0, origin, i ? &reader : NULL, &b->data, error))
            die(b->dataset, error);
        seconds[i] = olat_seconds() - seconds[i];
    }
    ssdgs_context_destroy(reader.context);
    for (int i = 0; i < b->data.count; i++)
        pixels += 1e-6 * b->data.frames[i].camera.width * b->data.frames[i].camera.height;
    add_facts(b, "read_megapixels_per_second_1_thread read_megapixels_per_second", pixels / seconds[0],
              pixels / seconds[1]);
    olat_print_notes(&b->data, "bench");
    ssdgs_photo *all = olat_photos(&b->data);
    if (!all || b->data.count < 2) die(b->dataset, "needs two test photographs");
    b->photo_count = b->quick ? 4 : MAX_PHOTOS;
    if (b->photo_count > b->data.count) b->photo_count = b->data.count;
    b->views = b->quick ? 2 : b->photo_count < 8 ? b->photo_count : 8;
    for (int i = 0; i < b->photo_count; i++) {
        b->photos[i] = all[i * b->data.count / b->photo_count];
        if (b->photos[i].camera.width * b->photos[i].camera.height > MAX_PIXELS)
            die(b->dataset, "photographs over 1920x1080");
        scale_photo(b->photos + i, b->scaled + i);
    }
    free(all);
}

/* The processor's name, the instruction sets and numbers of threads to try. */
static void look_at_machine(bench *b) {
    FILE *file = fopen("/proc/cpuinfo", "rb");
    const char *name = getenv("PROCESSOR_IDENTIFIER"); /* Windows */
    snprintf(b->cpu, sizeof b->cpu, "%.100s", name ? name : "unknown");
    char line[256];
    while (file && fgets(line, sizeof line, file))
        if (!strncmp(line, "model name", 10))
            snprintf(b->cpu, sizeof b->cpu, "%.100s", line + strcspn(line, ":") + 2);
    if (file) fclose(file);
    b->cpu[strcspn(b->cpu, "\r\n\"\\")] = 0;
    ssdgs_context *context;
    check(NULL, ssdgs_context_create(NULL, &context));
    b->best_isa = (int)ssdgs_context_isa(context);
    const int all = ssdgs_context_threads(context);
    ssdgs_context_destroy(context);
    for (int i = SSDGS_ISA_SCALAR; i < SSDGS_ISA_COUNT; i++)
        if (ssdgs__table(i) && (!b->quick || i == b->best_isa)) b->isas[b->isa_count++] = i;
    for (int i = 1; i <= 2 && i <= all; i++) b->threads[b->thread_count++] = i;
    if (all > 2) b->threads[b->thread_count++] = all;
}

/* All but the GPU, into files beside the program. */
static void measure_all(bench *b, char paths[2][1024], const char *program, double start) {
    measure_machine(b);
    measure_model(b, "", paths[0]);
    measure_model(b, "published_", paths[1]);
    b->prefix = "";
    add_facts(b, "bench_seconds", olat_seconds() - start);
    printf("\n");
    for (int i = 0; i < b->fact_count; i++)
        if (b->facts[i].value > none) printf("%-46s %.7g\n", b->facts[i].key, b->facts[i].value);
    write_beside(b, program, ".json", write_json);
    write_beside(b, program, ".svg", write_svg);
}

static const char *const help[] = {
    "usage: bench [OPTION...] [DATASET DEFAULT.ply PUBLISHED.ply]",
    "Measures this machine: peak arithmetic, every stage and instruction set, frames of both models",
    "with every shortcut, scaling with pixels and Gaussians, training. Writes bench.json and bench.svg",
    "beside the program.",
    "",
    "  --quick       about a minute: fewer views, the best instruction set alone",
    "  --gpu         alone: frames on a GPU beside the CPU's, of models made as large as engines' are",
    "  --models DIR  where waxcow.ply and waxcow_published.ply are; build/demo",
    "  DATASET ...   another dataset, with models of the default and the published networks;",
    "                examples/data/waxcow"};

int main(int argc, char **argv) {
    static bench b;
    const char *given[3] = {NULL, NULL, NULL}, *folder = "build/demo";
    int files = 0, on_gpu = 0;
    double start = olat_seconds();
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--help")) {
            for (size_t line = 0; line < sizeof help / sizeof *help; line++) puts(help[line]);
            return 0;
        }
        if (!strcmp(argv[i], "--quick")) b.quick = 1;
        else if (!strcmp(argv[i], "--gpu")) on_gpu = 1;
        else if (!strcmp(argv[i], "--models") && i + 1 < argc) folder = argv[++i];
        else if (argv[i][0] != '-' && files < 3) given[files++] = argv[i];
        else files = 4;
    }
    if (files != 0 && files != 3) {
        fprintf(stderr, "%s; bench --help lists them\n", help[0]);
        return 2;
    }
    char paths[2][1024];
    for (int i = 0; i < 2; i++)
        snprintf(paths[i], sizeof paths[i], "%s%s", given[0] ? given[1 + i] : folder,
                 given[0] ? ""
                 : i      ? "/waxcow_published.ply"
                          : "/waxcow.ply");
    b.dataset = given[0] ? given[0] : "examples/data/waxcow";
    b.prefix = "";
    b.model = paths[0];
    b.color = (ssdgs_real *)make(4 * MAX_PIXELS, sizeof *b.color);
    b.alpha = b.color + 3 * MAX_PIXELS;
    double origin[3];
    look_at_models(b.dataset, paths, argv[0], origin);
    load_photos(&b, origin);
    look_at_machine(&b);
    printf("%s, %s, %d threads, %s; %s, %d test views\n", b.cpu, ssdgs_isa_string((ssdgs_isa)b.best_isa),
           b.threads[b.thread_count - 1], COMPILER, b.dataset, b.photo_count);
    if (on_gpu) measure_gpu(&b);
    else measure_all(&b, paths, argv[0], start);
    for (int i = 0; i < b.photo_count; i++) free((void *)(uintptr_t)b.scaled[i].pixels);
    free(b.color);
    olat_free(&b.data);
    return 0;
}
