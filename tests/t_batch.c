/* Several photographs a step, on one process or many: the mean of their gradients, the same bits, and nothing
   half done where one fails. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

enum { PHOTOS = 6, SIDE = 32, BATCH = 4 };

static unsigned char pixels[PHOTOS][SIDE * SIDE * 4];
static ssdgs_photo photos[PHOTOS];

/* A shaded disc, transparent around. */
static void make_photos(void) {
    const ssdgs_real target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    for (int i = 0; i < PHOTOS; i++) {
        const ssdgs_real eye[3] = {(ssdgs_real)(2 * cos(1.0 * i)), (ssdgs_real)(2 * sin(1.0 * i)),
                                   (ssdgs_real)0.4};
        memset(&photos[i], 0, sizeof photos[i]);
        photos[i].camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, SIDE, SIDE);
        for (int c = 0; c < 3; c++) {
            photos[i].light.position[c] = eye[c] + (ssdgs_real)(c == i % 3);
            photos[i].light.intensity[c] = 20;
        }
        for (int k = 0; k < SIDE * SIDE; k++) {
            const double x = (k % SIDE + 0.5) / SIDE - 0.5, y = (k / SIDE + 0.5) / SIDE - 0.5;
            const int inside = x * x + y * y < 0.09;
            for (int c = 0; c < 3; c++)
                pixels[i][4 * k + c] = (unsigned char)(inside ? 120 + 60 * c + 150 * (i % 2 ? x : y) : 0);
            pixels[i][4 * k + 3] = inside ? 255 : 0;
        }
        photos[i].pixels = pixels[i];
    }
}

static ssdgs_train_options short_run(int batch) {
    ssdgs_train_options o = ssdgs_train_options_default();
    o.iterations = 96;
    o.initial_points = 300;
    o.max_gaussians = 500;
    o.densify_from = 8;
    o.densify_every = 10; /* no multiple of the batch */
    o.opacity_reset_every = 30;
    o.densify_gradient = (ssdgs_real)1e-5;
    o.batch = batch;
    o.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT | SSDGS_REFINE_AMBIENT;
    return o;
}

/* ---- processes that are not: each one's part is taken from a step that ends refused, then all step with
   their sum ---- */

typedef struct process {
    ssdgs_context *context;
    ssdgs_model *model;
    ssdgs_trainer *trainer;
    ssdgs_real *part, *total; /* total NULL: the part is taken */
    size_t count;
    int calls;
} process;

static ssdgs_result add(void *user, ssdgs_real *values, size_t count) {
    process *p = (process *)user;
    p->calls++;
    if (p->total) {
        CHECK(count == p->count && !memcmp(values, p->part, count * sizeof *values));
        memcpy(values, p->total, count * sizeof *values);
        return SSDGS_OK;
    }
    free(p->part);
    p->part = (ssdgs_real *)malloc(count * sizeof *values);
    if (!p->part) exit(1);
    memcpy(p->part, values, count * sizeof *values);
    p->count = count;
    return SSDGS_ERR_IO;
}

static void open_process(process *p, const ssdgs_train_options *shared, int rank, int processes,
                         const ssdgs_gpu_hook *gpu) {
    ssdgs_train_options options = *shared;
    ssdgs_context_desc desc;
    memset(p, 0, sizeof *p);
    memset(&desc, 0, sizeof desc);
    desc.threads = 1 + rank % 2;
    desc.gpu = gpu;
    if (processes) {
        options.sum.add = add;
        options.sum.user = p;
        options.sum.rank = rank;
        options.sum.processes = processes;
    }
    if (!CHECK(!ssdgs_context_create(&desc, &p->context)) ||
        !CHECK(!ssdgs_model_create(p->context, NULL, 0, &p->model)) ||
        !CHECK(!ssdgs_trainer_create(p->model, photos, PHOTOS, &options, &p->trainer)))
        exit(1);
}

static void close_process(process *p) {
    free(p->part);
    ssdgs_trainer_destroy(p->trainer);
    ssdgs_model_destroy(p->model);
    ssdgs_context_destroy(p->context);
}

/* All that a run is: model, moments, statistics, corrections. */
static uint64_t state_of(const process *p) {
    const ssdgs_trainer *t = p->trainer;
    const size_t n = (size_t)p->model->count * sizeof(ssdgs_real);
    uint64_t hash = ssdgs__fold(1, &t->run.iteration, sizeof t->run.iteration);
    for (size_t c = 0; c < SSDGS_CHANNELS; c++) {
        hash = ssdgs__fold(hash, p->model->gaussians + c * p->model->capacity, n);
        hash = ssdgs__fold(hash, t->mean + c * t->stride, n);
        hash = ssdgs__fold(hash, t->square + c * t->stride, n);
    }
    for (size_t c = 0; c < SSDGS__STATISTICS; c++)
        hash = ssdgs__fold(hash, t->screen_gradient + c * t->stride, n);
    hash = ssdgs__fold(hash, p->model->globals, p->model->global_count * sizeof(ssdgs_real));
    hash = ssdgs__fold(hash, t->run.steps, sizeof t->run.steps);
    return ssdgs__fold(hash, t->corrections, PHOTOS * sizeof *t->corrections);
}

/* A step of all: their parts, summed in pairs, then the same step again with the sum. */
static void step_all(process *p, int processes, ssdgs_train_stats *stats) {
    for (int i = 0; i < processes; i++) {
        const uint64_t before = state_of(p + i);
        p[i].total = NULL;
        CHECK(ssdgs_trainer_step(p[i].trainer, NULL) == SSDGS_ERR_IO);
        CHECK(strstr(ssdgs_error_message(p[i].context), "options.sum.add() failed") != NULL);
        CHECK(state_of(p + i) == before);
    }
    const size_t count = p->count;
    ssdgs_real *sums = (ssdgs_real *)malloc(count * (size_t)processes * sizeof *sums);
    if (!sums) exit(1);
    for (int i = 0; i < processes; i++) {
        CHECK(p[i].count == count);
        memcpy(sums + count * (size_t)i, p[i].part, count * sizeof *sums);
    }
    for (int apart = 1; apart < processes; apart *= 2)
        for (int i = 0; i < processes; i += 2 * apart)
            for (size_t k = 0; k < count; k++)
                sums[count * (size_t)i + k] += sums[count * (size_t)(i + apart) + k];
    for (int i = 0; i < processes; i++) {
        p[i].total = sums;
        CHECK(!ssdgs_trainer_step(p[i].trainer, stats));
    }
    free(sums);
}

/* One, two and four processes, and one without a sum, come to the same bits; more Gaussians, resets and
   refinement among them. */
static void test_same_bits(void) {
    const ssdgs_train_options options = short_run(BATCH);
    process alone, many[3][BATCH];
    ssdgs_train_stats one, all;
    int grew = 0, shrank = 0, last = 0;
    open_process(&alone, &options, 0, 0, NULL);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 1 << k; i++) open_process(many[k] + i, &options, i, 1 << k, NULL);
    for (int step = 0; step < 20; step++) {
        CHECK(!ssdgs_trainer_step(alone.trainer, &one));
        CHECK(one.iteration == BATCH * (step + 1));
        double most = 0; /* statistics grow until density control, after 10 iterations and more */
        for (int i = 0; i < alone.model->count; i++)
            most = fmax(most, (double)alone.trainer->screen_count[i]);
        if (step < 2) CHECK(most > BATCH * step && most <= BATCH * (step + 1));
        if (step == 2) CHECK(most <= 0); /* it was, at the twelfth */
        for (int k = 0; k < 3; k++) {
            step_all(many[k], 1 << k, &all);
            CHECK(!memcmp(&one, &all, sizeof one));
            for (int i = 0; i < 1 << k; i++) CHECK(state_of(many[k] + i) == state_of(&alone));
        }
        grew += one.gaussians > last, shrank += one.gaussians < last, last = one.gaussians;
    }
    CHECK(grew > 1 && shrank > 0 && alone.trainer->corrections[0].steps[0] > 0 &&
          alone.trainer->corrections[0].steps[1] > 0);
    close_process(&alone);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 1 << k; i++) close_process(many[k] + i);
}

/* Two photographs' gradients are added and halved, their statistics and moves added: against each photograph
   alone. */
static void test_mean(void) {
    const ssdgs_train_options options = short_run(2);
    process both, each[2];
    open_process(&both, &options, 0, 1, NULL);
    for (int i = 0; i < 2; i++) open_process(each + i, &options, i, 2, NULL);
    for (int i = 0; i < 2; i++) CHECK(ssdgs_trainer_step(each[i].trainer, NULL) == SSDGS_ERR_IO);
    CHECK(ssdgs_trainer_step(both.trainer, NULL) == SSDGS_ERR_IO);
    const ssdgs__batch_layout at = ssdgs__batch_layout_of(both.trainer);
    int bad = 0, apart = 0;
    for (size_t k = 0; k < at.size; k++) {
        const ssdgs_real sum = each[0].part[k] + each[1].part[k];
        bad += memcmp(&sum, both.part + k, sizeof sum) != 0;
        apart += each[0].part[k] < each[1].part[k] || each[0].part[k] > each[1].part[k];
    }
    CHECK(at.size == both.count && bad == 0 && apart > 1000);
    for (size_t j = 0; j < 9; j++) /* a photograph's moves stand in its place alone */
        CHECK(each[0].part[at.correction_gradient + SSDGS__CORRECTIONS + j] == 0 &&
              each[1].part[at.correction_gradient + j] == 0);
    ssdgs_real *total = both.part;
    both.total = total;
    ssdgs_train_stats stats;
    CHECK(!ssdgs_trainer_step(both.trainer, &stats));
    CHECK(fabs(stats.loss - ((double)total[1]) / 2) < 1e-6 && stats.loss > 0.01);
    CHECK(fabs(stats.psnr - ((double)total[2]) / 2) < 1e-4 && stats.shaded > 10);
    double worst = 0;
    int moved = 0;
    for (size_t i = 0; i < (size_t)both.model->count;
         i++) { /* Adam's first mean is a tenth of the gradient */
        const size_t c = SSDGS_OPACITY * both.trainer->stride + i;
        const double want = 0.05 * (double)total[at.gradient + c], got = (double)both.trainer->mean[c];
        worst = fabs(got - want) > worst * fabs(want) ? fabs(got - want) / fabs(want) : worst;
        moved += fabs(want) > 0;
    }
    if (!CHECK(worst < 1e-5 && moved > 50)) printf("    off by %g, %d moved\n", worst, moved);
    close_process(&both);
    for (int i = 0; i < 2; i++) close_process(each + i);
}

/* Adam moves the farther the more photographs agree: by the root of the batch. */
static void test_rate(void) {
    process p[2];
    for (int i = 0; i < 2; i++) {
        ssdgs_train_options options = short_run(i ? 4 : 1);
        options.adam_epsilon = 0;
        open_process(p + i, &options, 0, 0, NULL);
    }
    double step[2];
    for (int i = 0; i < 2; i++) {
        const ssdgs_real *opacity = p[i].model->gaussians + SSDGS_OPACITY * p[i].model->capacity;
        double most = 0;
        ssdgs_real start[300];
        memcpy(start, opacity, sizeof start);
        CHECK(!ssdgs_trainer_step(p[i].trainer, NULL));
        for (int k = 0; k < 300; k++)
            most =
                fabs((double)(opacity[k] - start[k])) > most ? fabs((double)(opacity[k] - start[k])) : most;
        step[i] = most;
    }
    CHECK(fabs(step[0] - 0.05) < 1e-4 && fabs(step[1] - 0.1) < 1e-4);
    for (int i = 0; i < 2; i++) close_process(p + i);
}

static int fails; /* shading, when it has been called so often; 0: not */
static ssdgs_result shade(void *user, ssdgs_frame *frame) {
    (void)user;
    if (fails && --fails == 0) return SSDGS_ERR_LIMIT;
    return ssdgs_stage_cpu(frame, SSDGS_STAGE_SHADE);
}

/* Where this process fails the others hear of it; where another fails this one stays as it was. */
static void test_failures(void) {
    const ssdgs_train_options options = short_run(BATCH);
    ssdgs_gpu_hook gpu;
    memset(&gpu, 0, sizeof gpu);
    gpu.stage[SSDGS_STAGE_SHADE] = shade;
    process p;
    open_process(&p, &options, 0, 2, &gpu);
    const uint64_t before = state_of(&p);
    fails = 2; /* one of this process's two is drawn */
    CHECK(ssdgs_trainer_step(p.trainer, NULL) == SSDGS_ERR_LIMIT && p.calls == 1);
    const ssdgs__batch_layout at = ssdgs__batch_layout_of(p.trainer);
    int other = 0;
    for (size_t k = 1; k < at.size; k++) other += !(p.part[k] == 0);
    CHECK(p.count == at.size && p.part[0] == 1 && other == 0);
    CHECK(ssdgs_trainer_step(p.trainer, NULL) == SSDGS_ERR_IO);
    ssdgs_real *total = (ssdgs_real *)malloc(p.count * sizeof *total);
    if (!total) exit(1);
    memcpy(total, p.part, p.count * sizeof *total);
    total[0] = 1;
    p.total = total;
    CHECK(ssdgs_trainer_step(p.trainer, NULL) == SSDGS_ERR_CANCELLED && state_of(&p) == before);
    CHECK(strstr(ssdgs_error_message(p.context), "another process failed") != NULL);
    total[0] = 0;
    total[at.gradient + 3] = NAN; /* refused by all alike; its photographs are passed over */
    CHECK(ssdgs_trainer_step(p.trainer, NULL) == SSDGS_ERR_NONFINITE && p.trainer->run.iteration == BATCH);
    free(total);
    close_process(&p);
    /* light from all around, found anew before the first photograph, fails alike */
    memset(&gpu, 0, sizeof gpu);
    gpu.stage[SSDGS_STAGE_WALK] = shade;
    open_process(&p, &options, 0, 2, &gpu);
    p.trainer->run.sky_ready = 1;
    p.trainer->run.iteration = 100; /* every hundredth */
    fails = 1;
    CHECK(ssdgs_trainer_step(p.trainer, NULL) == SSDGS_ERR_LIMIT && p.calls == 1 && p.part[0] == 1);
    CHECK(!p.trainer->run.sky_ready);
    close_process(&p);
    static const int wrong[5][3] = {
        {0, 0, 2}, {2, 2, 2}, {-1, 2, 2}, {0, 3, 2}, {0, 0, 257}}; /* rank, of, batch */
    for (int i = 0; i < 5; i++) {
        ssdgs_context *context = NULL;
        ssdgs_model *model = NULL;
        ssdgs_trainer *trainer = NULL;
        ssdgs_train_options o = short_run(wrong[i][2]);
        o.sum.add = add;
        o.sum.rank = wrong[i][0];
        o.sum.processes = wrong[i][1];
        CHECK(!ssdgs_context_create(NULL, &context) && !ssdgs_model_create(context, NULL, 0, &model));
        CHECK(ssdgs_trainer_create(model, photos, PHOTOS, &o, &trainer) == SSDGS_ERR_ARGUMENT && !trainer);
        CHECK(strstr(ssdgs_error_message(context), i < 4 ? "cannot share a batch" : "batch = 257") != NULL);
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
}

int main(void) {
    make_photos();
    test_same_bits();
    test_mean();
    test_rate();
    test_failures();
    TEST_END();
}
