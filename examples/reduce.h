/* reduce.h - levels of detail: a model of fewer Gaussians. MIT, see ssdgs.h.

   #define SSDGS_STAGES
   #include "ssdgs.h"
   #include "reduce.h"
   ...
   ssdgs_result result = reduce_model(context, &model, 5000);
   if (!result) result = reduce_teach(original, model);

   HOW  Neighbours are merged, those first that are least missed, until so many are left. A merged Gaussian
   has the mean of both, weighted by what is seen of each from around. No photographs are needed:
   reduce_teach() trains what is left on pictures of the original. With photographs 1,000 more iterations win
   back what was lost of them (examples/train.c, --refit).

   It takes a second for 30,000 Gaussians, so save the result. Its memory comes from malloc(). */

#ifndef REDUCE_H
#define REDUCE_H
#if !defined(SSDGS_STAGES) && !defined(SSDGS_IMPLEMENTATION)
#error reduce.h needs SSDGS_STAGES to be defined before ssdgs.h is included
#endif

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define REDUCE__LEAF 16      /* neighbours among which partners are found, at most */
#define REDUCE__VIEWS 8      /* directions that tell what is seen */
#define REDUCE__STEP 8       /* a round removes one Gaussian of so many at most; then new partners */
#define REDUCE__UNSEEN 1e-3  /* a hidden Gaussian counts as if this share of it were seen */
#define REDUCE__OPAQUE 0.999 /* no merged Gaussian has more opacity */
#define REDUCE__NEVER (ssdgs_real)1e30 /* the cost of a pair with values that are not finite */

/* What merging reads of a Gaussian. */
typedef struct reduce__blob {
    double position[3], covariance[9], log_determinant; /* world; of the covariance */
    double seen, share;         /* of its opacity x area: what is seen from around, on average */
    double normal[3], color[9]; /* c_d, c_s, c_sss */
} reduce__blob;

/* Two of a level. The first becomes both. */
typedef struct reduce__pair {
    ssdgs_real cost;
    uint32_t kept, gone;
} reduce__pair;

/* rows are the Gaussians of the model that was given, as merged so far. A level is a model of those left, in
   the order of ssdgs_model_sort(). */
typedef struct reduce__state {
    ssdgs_context *context;  /* of the levels; its hook finds flux */
    ssdgs_settings settings; /* of the levels: what lights see, no networks */
    size_t rows, planes;
    int baked;
    ssdgs_real *raw;    /* (planes, rows) raw parameters, as ssdgs_model_view has them */
    ssdgs_real *seen;   /* (rows) opacity x area that is seen */
    ssdgs_real *flux;   /* (rows) of one light */
    uint32_t *left;     /* (count) rows */
    reduce__blob *blob; /* (count) */
    reduce__pair *pair; /* (leaves, REDUCE__LEAF / 2) unused ones cost more than any other */
    int count, offset;  /* offset: of the leaves */
} reduce__state;

/* Stage WALK with the light that Gaussians take, for which no network asks. */
static inline ssdgs_result reduce__walk(void *user, ssdgs_frame *frame) {
    frame->flux = ((const reduce__state *)user)->flux;
    return ssdgs_stage_cpu(frame, SSDGS_STAGE_WALK);
}

/* A colour before softplus. */
static inline double reduce__raw(double color) {
    return color < 2.1e-9 ? -20 : color > 30 ? color : log(expm1(color));
}

/* The Gaussians left as a model. Places of rows are kept as material, which levels do not use. */
static inline ssdgs_result reduce__level(const reduce__state *r, ssdgs_model **level) {
    ssdgs_result result = ssdgs_model_create(r->context, &r->settings, r->count, level);
    if (result) return result;
    const ssdgs_model_view v = ssdgs_model_arrays(*level);
    for (size_t i = 0; i < (size_t)r->count; i++) {
        const uint32_t row = r->left[i];
        for (size_t c = 0; c < (r->baked ? SSDGS_DIFFUSE : SSDGS_MATERIAL); c++)
            v.gaussians[c * v.stride + i] = r->raw[c * r->rows + row];
        for (size_t c = SSDGS_DIFFUSE; c < SSDGS_HARMONICS && r->baked; c++)
            v.gaussians[c * v.stride + i] =
                (ssdgs_real)reduce__raw(0.5 + 0.28209479177387814 * (double)r->raw[c * r->rows + row]);
        v.gaussians[SSDGS_MATERIAL * v.stride + i] = (ssdgs_real)(row & 4095);
        v.gaussians[(SSDGS_MATERIAL + 1) * v.stride + i] = (ssdgs_real)(row >> 12);
    }
    return SSDGS_OK;
}

/* Direction number i of so many on a spiral around the sphere, which begins at an angle. */
static inline void reduce__direction(int i, int many, double angle, double d[3]) {
    const double z = 1 - (2 * i + 1.0) / many, across = sqrt(1 - z * z), turn = 2.39996323;
    d[0] = across * cos(angle + turn * i);
    d[1] = across * sin(angle + turn * i);
    d[2] = z;
}

/* How much of each Gaussian is seen from around: what parallel lights shed on it, on average. */
static inline ssdgs_result reduce__seen_around(const reduce__state *r) {
    ssdgs_model *level = NULL;
    ssdgs_scene *scene = NULL;
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    ssdgs_result result = reduce__level(r, &level);
    if (!result) result = ssdgs_scene_create(r->context, &scene);
    const ssdgs_object object = ssdgs_object_default(level);
    for (int view = 0; view < REDUCE__VIEWS && !result; view++) {
        double d[3];
        reduce__direction(view, REDUCE__VIEWS, 0, d);
        const ssdgs_real even[3] = {1, 1, 1},
                         along[3] = {(ssdgs_real)-d[0], (ssdgs_real)-d[1], (ssdgs_real)-d[2]};
        const ssdgs_light light = ssdgs_light_directional(along, even);
        result = ssdgs_scene_light(scene, &object, 1, NULL, &light, 1, &exact);
        for (size_t i = 0; i < r->rows && !result; i++) r->seen[i] += r->flux[i] / REDUCE__VIEWS;
    }
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(level);
    return result;
}

/* About proportional to an ellipsoid's surface, so to the mean area of its shadows. */
static inline double reduce__area(const double scale[3]) {
    return scale[0] * scale[1] + scale[1] * scale[2] + scale[2] * scale[0];
}

static inline void reduce__blob_of(const ssdgs_gaussian *g, double seen, reduce__blob *b) {
    const double w = (double)g->rotation[0], x = (double)g->rotation[1], y = (double)g->rotation[2],
                 z = (double)g->rotation[3];
    const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    double scale[3];
    b->log_determinant = 0;
    for (int c = 0; c < 3; c++) {
        b->position[c] = (double)g->position[c];
        b->normal[c] = (double)g->normal[c];
        b->color[c] = (double)g->diffuse[c];
        b->color[3 + c] = (double)g->specular[c];
        b->color[6 + c] = (double)g->scattering[c];
        scale[c] = (double)g->scale[c];
        b->log_determinant += 2 * log(scale[c]);
    }
    for (int i = 0; i < 9; i++) {
        b->covariance[i] = 0;
        for (int c = 0; c < 3; c++)
            b->covariance[i] += r[3 * (i / 3) + c] * r[3 * (i % 3) + c] * scale[c] * scale[c];
    }
    const double mass = (double)g->opacity * reduce__area(scale);
    b->share = REDUCE__UNSEEN + (mass > 0 ? seen / mass : 0);
    b->seen = b->share * mass;
}

/* Puts what is left in order, neighbours together, and finds what merging reads of it. */
static inline ssdgs_result reduce__arrange(reduce__state *r) {
    ssdgs_model *level = NULL;
    ssdgs_result result = reduce__level(r, &level);
    if (!result) result = ssdgs_model_sort(level);
    if (!result) {
        const ssdgs_model_view v = ssdgs_model_peek(level);
        for (size_t i = 0; i < (size_t)r->count; i++)
            r->left[i] = (uint32_t)v.gaussians[SSDGS_MATERIAL * v.stride + i] +
                         4096 * (uint32_t)v.gaussians[(SSDGS_MATERIAL + 1) * v.stride + i];
    }
    for (int i = 0; i < r->count && !result; i++) {
        ssdgs_gaussian g;
        result = ssdgs_model_get(level, i, &g);
        if (!result) reduce__blob_of(&g, (double)r->seen[r->left[i]], r->blob + i);
    }
    ssdgs_model_destroy(level);
    return result;
}

/* The cost of merging two: how far apart they are in place and shape (the Bhattacharyya distance, but shapes
   count half), normal and colour, times the lesser one's seen amount. */
static inline double reduce__cost(const reduce__blob *a, const reduce__blob *b) {
    double s[9], d[3], adjugate[9], away = 0, other = 0;
    for (int i = 0; i < 9; i++) s[i] = a->covariance[i] + b->covariance[i];
    for (int i = 0; i < 3; i++) {
        const int i1 = 3 * ((i + 1) % 3), i2 = 3 * ((i + 2) % 3);
        d[i] = a->position[i] - b->position[i];
        other += (a->normal[i] - b->normal[i]) * (a->normal[i] - b->normal[i]);
        for (int j = 0; j < 3; j++) {
            const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            adjugate[3 * i + j] = s[i1 + j1] * s[i2 + j2] - s[i1 + j2] * s[i2 + j1];
        }
    }
    for (int i = 0; i < 9; i++) other += (a->color[i] - b->color[i]) * (a->color[i] - b->color[i]);
    const double determinant = s[0] * adjugate[0] + s[1] * adjugate[1] + s[2] * adjugate[2];
    for (int i = 0; i < 9; i++) away += d[i / 3] * adjugate[i] * d[i % 3] / determinant;
    const double shape = log(determinant / 8) - 0.5 * (a->log_determinant + b->log_determinant);
    return (3 * (away + shape) + other) * a->seen * b->seen / (a->seen + b->seen);
}

static inline int reduce__compare(const void *a, const void *b) {
    const reduce__pair *x = (const reduce__pair *)a, *y = (const reduce__pair *)b;
    if (x->cost < y->cost || y->cost < x->cost) return x->cost < y->cost ? -1 : 1;
    return x->kept < y->kept ? -1 : x->kept > y->kept;
}

/* Pairs off the Gaussians of a leaf, the cheapest pair first. */
static inline void reduce__pair_task(void *data, int leaf) {
    const reduce__state *r = (const reduce__state *)data;
    const int from = leaf * REDUCE__LEAF - r->offset, begin = from > 0 ? from : 0;
    const int end = from + REDUCE__LEAF < r->count ? from + REDUCE__LEAF : r->count;
    reduce__pair all[REDUCE__LEAF * (REDUCE__LEAF - 1) / 2], *out = r->pair + leaf * (REDUCE__LEAF / 2);
    size_t n = 0;
    unsigned taken = 0;
    for (int i = begin; i < end; i++)
        for (int j = i + 1; j < end; j++) {
            const ssdgs_real cost = (ssdgs_real)reduce__cost(r->blob + i, r->blob + j);
            all[n].cost = ssdgs_finite(cost) && cost < REDUCE__NEVER ? cost : REDUCE__NEVER;
            all[n].kept = (uint32_t)i;
            all[n++].gone = (uint32_t)j;
        }
    qsort(all, n, sizeof *all, reduce__compare);
    for (size_t i = 0; i < n; i++) {
        const unsigned both = 1u << ((int)all[i].kept - begin) | 1u << ((int)all[i].gone - begin);
        if (!(taken & both)) *out++ = all[i];
        taken |= taken & both ? 0 : both;
    }
    for (; out < r->pair + (leaf + 1) * (REDUCE__LEAF / 2); out++) out->cost = 2 * REDUCE__NEVER;
}

/* The axes of a covariance as a quaternion, their standard deviations (Jacobi's method). */
static inline void reduce__axes(double s[9], double q[4], double scale[3]) {
    q[0] = 1;
    q[1] = q[2] = q[3] = 0;
    for (int turn = 0; turn < 24; turn++) {
        const int k = turn % 3, i = (k + 1) % 3, j = (k + 2) % 3;
        const double apart = s[4 * i] - s[4 * j], both = s[3 * i + j];
        const double angle = (apart < 0 ? -0.5 : 0.5) * atan2(2 * both, fabs(apart));
        const double c = cos(angle), d = sin(angle), h = cos(angle / 2), p = sin(angle / 2);
        for (int l = 0; l < 3; l++) { /* columns, then rows */
            const double x = s[3 * l + i], y = s[3 * l + j];
            s[3 * l + i] = c * x + d * y;
            s[3 * l + j] = c * y - d * x;
        }
        for (int l = 0; l < 3; l++) {
            const double x = s[3 * i + l], y = s[3 * j + l];
            s[3 * i + l] = c * x + d * y;
            s[3 * j + l] = c * y - d * x;
        }
        const double w = q[0], a = q[1 + i], b = q[1 + j], z = q[1 + k]; /* q (h, p around axis k) */
        q[0] = h * w - p * z;
        q[1 + i] = h * a + p * b;
        q[1 + j] = h * b - p * a;
        q[1 + k] = h * z + p * w;
    }
    for (int c = 0; c < 3; c++) scale[c] = sqrt(s[4 * c] > 1e-30 ? s[4 * c] : 1e-30);
}

/* A row becomes the mean of two, weighted by what is seen of each. Its opacity is such that, where their mean
   share of it is seen, it shows as much as both did. */
static inline void reduce__merge(const reduce__state *r, const reduce__pair *pair) {
    const size_t stride = r->rows, to = r->left[pair->kept], from = r->left[pair->gone];
    ssdgs_real *kept = r->raw + to, *gone = r->raw + from;
    const reduce__blob *a = r->blob + pair->kept, *b = r->blob + pair->gone;
    const double sum = a->seen + b->seen, w = sum > 0 ? a->seen / sum : 0.5;
    const double share = w * a->share + (1 - w) * b->share;
    double s[9], q[4], scale[3], raw[SSDGS_CHANNELS + 48], along = 0, length[2] = {0, 0};
    for (int i = 0; i < 9; i++)
        s[i] = w * a->covariance[i] + (1 - w) * b->covariance[i] +
               w * (1 - w) * (a->position[i / 3] - b->position[i / 3]) *
                   (a->position[i % 3] - b->position[i % 3]);
    reduce__axes(s, q, scale);
    for (size_t c = SSDGS_FRAME; c < SSDGS_FRAME + 4 && !r->baked; c++) {
        const double x = (double)kept[c * stride], y = (double)gone[c * stride];
        along += x * y;
        length[0] += x * x;
        length[1] += y * y;
    }
    const double turn = (along < 0 ? -1 : 1) * sqrt(length[0] / (length[1] > 0 ? length[1] : 1));
    for (size_t c = 0; c < r->planes; c++) {
        const double x = (double)kept[c * stride], y = (double)gone[c * stride];
        raw[c] = w * x + (1 - w) * (!r->baked && c >= SSDGS_FRAME && c < SSDGS_FRAME + 4 ? turn * y : y);
    }
    for (int c = 0; c < 3; c++) {
        raw[SSDGS_POSITION + c] = w * a->position[c] + (1 - w) * b->position[c];
        raw[SSDGS_LOG_SCALE + c] = log(scale[c]);
    }
    for (int c = 0; c < 4; c++) raw[SSDGS_ROTATION + c] = q[c];
    for (int c = 0; c < 9 && !r->baked; c++)
        raw[SSDGS_DIFFUSE + c] = reduce__raw(w * a->color[c] + (1 - w) * b->color[c]);
    double opacity = sum / share / reduce__area(scale);
    opacity = opacity < REDUCE__OPAQUE ? opacity : REDUCE__OPAQUE;
    opacity = log(opacity) - log1p(-opacity); /* before a sigmoid */
    raw[SSDGS_OPACITY] = opacity < -20 ? -20 : opacity;
    for (size_t c = 0; c < r->planes; c++) kept[c * stride] = (ssdgs_real)raw[c];
    r->seen[to] += r->seen[from];
}

/* One round: the cheapest pairs of neighbours merge, until `count` are left or an eighth is gone. */
static inline ssdgs_result reduce__round(reduce__state *r, int count) {
    const int now = r->count, tasks = (now + r->offset - 1) / REDUCE__LEAF + 1;
    const int most = now / REDUCE__STEP + 1, merges = now - count < most ? now - count : most;
    const ssdgs_result result = ssdgs_context_run(r->context, tasks, reduce__pair_task, r);
    if (result) return result;
    qsort(r->pair, (size_t)tasks * (REDUCE__LEAF / 2), sizeof *r->pair, reduce__compare);
    for (int i = 0; i < merges && r->pair[i].cost <= REDUCE__NEVER; i++) {
        reduce__merge(r, r->pair + i);
        r->left[r->pair[i].gone] = UINT32_MAX;
    }
    r->count = 0;
    for (int i = 0; i < now; i++)
        if (r->left[i] != UINT32_MAX) r->left[r->count++] = r->left[i];
    r->offset = REDUCE__LEAF / 2 - r->offset;
    return SSDGS_OK;
}

/* Merges the rows until `count` are left. Those that no frame draws go first. */
static inline ssdgs_result reduce__rows(reduce__state *r, int count) {
    ssdgs_result result = reduce__seen_around(r);
    const int all = r->count;
    r->count = 0;
    for (int i = 0; i < all; i++) {
        size_t c;
        for (c = 0; c < SSDGS_DIFFUSE && ssdgs_finite(r->raw[c * r->rows + (size_t)i]); c++) {}
        if (c == SSDGS_DIFFUSE) r->left[r->count++] = (uint32_t)i;
    }
    if (!result) result = reduce__arrange(r);
    while (r->count > count && !result) {
        result = reduce__round(r, count);
        if (!result) result = reduce__arrange(r);
    }
    return result;
}

/* Copies `count` values, of which there may be none. */
static inline void reduce__copy(ssdgs_real *to, const ssdgs_real *from, size_t count) {
    if (count) memcpy(to, from, count * sizeof *to);
}

/* Makes of *model one of `count` Gaussians, on the same context, destroys it and puts the new one in its
   place. Where it has no more than that, it stays. A model that a trainer or an object uses must not be
   given. ERR_ARGUMENT: count < 1. ERR_MEMORY. Where it fails, *model is as it was; the context's message says
   why. */
static inline ssdgs_result reduce_model(ssdgs_context *context, ssdgs_model **model, int count) {
    reduce__state r;
    memset(&r, 0, sizeof r);
    if (!context) return SSDGS_ERR_ARGUMENT;
    if (!model || !*model || count < 1)
        return ssdgs_context_fail(context, SSDGS_ERR_ARGUMENT,
                                  !model || !*model ? "reduce_model: model is NULL"
                                                    : "reduce_model: count < 1");
    const ssdgs_model_view given = ssdgs_model_peek(*model);
    if (count >= given.count) return SSDGS_OK;
    const size_t n = r.rows = (size_t)given.count, pairs = (n / REDUCE__LEAF + 2) * (REDUCE__LEAF / 2);
    r.count = given.count;
    r.planes = (size_t)given.channels;
    r.baked = ssdgs_model_settings(*model)->baked;
    r.raw = (ssdgs_real *)malloc(r.planes * n * sizeof *r.raw);
    r.seen = (ssdgs_real *)calloc(n, sizeof *r.seen);
    r.flux = (ssdgs_real *)calloc(n, sizeof *r.flux);
    r.left = (uint32_t *)malloc(n * sizeof *r.left);
    r.blob = (reduce__blob *)malloc(n * sizeof *r.blob);
    r.pair = (reduce__pair *)malloc(pairs * sizeof *r.pair);
    ssdgs_result result = r.raw && r.seen && r.flux && r.left && r.blob && r.pair
                              ? SSDGS_OK
                              : ssdgs_context_fail(context, SSDGS_ERR_MEMORY, "reduce_model: out of memory");
    for (size_t c = 0; c < r.planes && !result; c++)
        reduce__copy(r.raw + c * n, given.gaussians + c * given.stride, n);
    for (size_t i = 0; i < n && !result; i++) r.left[i] = (uint32_t)i;
    r.settings = ssdgs_settings_default();
    r.settings.light_map = ssdgs_model_settings(*model)->light_map;
    r.settings.terms = SSDGS_SHADOW_TERM;
    r.settings.asg = SSDGS_ASG_GEOMETRIC; /* its c_s is no lobe's height */
    r.settings.scattering.layers = r.settings.shadow.layers = r.settings.transport = 0;
    ssdgs_gpu_hook hook;
    memset(&hook, 0, sizeof hook);
    hook.stage[SSDGS_STAGE_WALK] = reduce__walk;
    hook.user = &r;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = ssdgs_context_threads(context);
    desc.isa = ssdgs_context_isa(context);
    desc.gpu = &hook;
    if (!result) {
        result = ssdgs_context_create(&desc, &r.context);
        if (!result) result = reduce__rows(&r, count);
        if (result)
            ssdgs_context_fail(context, result, r.context ? ssdgs_error_message(r.context) : "out of memory");
    }
    ssdgs_context_destroy(r.context);
    ssdgs_model *fewer = NULL;
    if (!result) result = ssdgs_model_create(context, ssdgs_model_settings(*model), r.count, &fewer);
    if (!result) {
        const ssdgs_model_view v = ssdgs_model_arrays(fewer);
        for (size_t c = 0; c < r.planes; c++)
            for (size_t i = 0; i < (size_t)r.count; i++)
                v.gaussians[c * v.stride + i] = r.raw[c * n + r.left[i]];
        reduce__copy(v.asg_basis, given.asg_basis, 4 * SSDGS_ASG_COUNT);
        reduce__copy(v.asg_sharpness, given.asg_sharpness, 2 * SSDGS_ASG_COUNT);
        reduce__copy(v.asg_sigma, given.asg_sigma, SSDGS_ASG_COUNT);
        reduce__copy(v.scattering, given.scattering, given.scattering_count);
        reduce__copy(v.shadow, given.shadow, given.shadow_count);
        ssdgs_model_destroy(*model);
        *model = fewer;
    }
    free(r.raw), free(r.seen), free(r.flux), free(r.left), free(r.blob), free(r.pair);
    return result;
}

#ifndef SSDGS_NO_TRAINER
#define REDUCE__PICTURES 150
#define REDUCE__LESSONS 3000 /* iterations */

/* Takes a picture of the original from direction number i, its pixels behind `pixels`, under a light from
   elsewhere; as large as a level of so many Gaussians is drawn at most (ssdgs_object.levels). */
static inline ssdgs_result reduce__picture(ssdgs_model *original, const ssdgs_real low[3],
                                           const ssdgs_real high[3], int gaussians, int i, ssdgs_photo *photo,
                                           float **pixels) {
    double side[3];
    for (int c = 0; c < 3; c++) side[c] = (double)high[c] - (double)low[c];
    const double area = (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]) / 2;
    const double radius = sqrt(side[0] * side[0] + side[1] * side[1] + side[2] * side[2]) / 2;
    const double focal = 2.2 * radius * sqrt(gaussians * 8 / (3 * area)), across = 0.68 * focal;
    const int width = across < 16 ? 16 : across < 512 ? (int)across : 512;
    const size_t count = (size_t)width * (size_t)width;
    double from[3], lit[3];
    ssdgs_real eye[3], target[3], lamp[3], intensity[3];
    const ssdgs_real up[3] = {0, 0, 1};
    reduce__direction(i, REDUCE__PICTURES, 0, from);
    reduce__direction(i * 61 % REDUCE__PICTURES, REDUCE__PICTURES, 1, lit);
    for (int c = 0; c < 3; c++) {
        const double middle = ((double)low[c] + (double)high[c]) / 2;
        target[c] = (ssdgs_real)middle;
        eye[c] = (ssdgs_real)(middle + 3.2 * radius * from[c]);
        lamp[c] = (ssdgs_real)(middle + 3 * radius * lit[c]);
        intensity[c] =
            (ssdgs_real)(2 * 9 * radius * radius / (double)ssdgs_model_settings(original)->light_scale);
    }
    memset(photo, 0, sizeof *photo);
    photo->camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.66, width, width);
    photo->light = ssdgs_light_point(lamp, intensity);
    photo->format = SSDGS_PIXELS_RGBA32F;
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = (ssdgs_real *)malloc(count * 3 * sizeof *image.color);
    image.alpha = (ssdgs_real *)malloc(count * sizeof *image.alpha);
    photo->pixels = *pixels = (float *)malloc(count * 4 * sizeof **pixels);
    ssdgs_result result = image.color && image.alpha && *pixels ? SSDGS_OK : SSDGS_ERR_MEMORY;
    if (!result) result = ssdgs_render_ex(original, &photo->camera, &photo->light, 1, &exact, &image, NULL);
    for (size_t k = 0; k < 4 * count && !result; k++) {
        const double cover = (double)image.alpha[k / 4];
        (*pixels)[k] = (float)(k % 4 == 3     ? cover
                               : cover > 1e-4 ? (double)image.color[k / 4 * 3 + k % 4] / cover
                                              : 0);
    }
    free(image.color);
    free(image.alpha);
    return result;
}

/* Options for a model that goes on: all terms, nothing but fine steps, no density control. */
static inline void reduce_fine_steps(ssdgs_train_options *o, int iterations) {
    o->iterations = iterations;
    o->schedule = SSDGS_SCHEDULE_JOINT;
    o->densify_until = o->opacity_reset_every = 0;
    for (ssdgs_rate *rate = &o->rates.position; rate <= &o->rates.scattering; rate++) {
        rate->start *= (ssdgs_real)(rate == &o->rates.position ? 0.03 : 0.3);
        rate->end *= (ssdgs_real)0.3;
    }
}

/* Teaches a level, which reduce_model() has made of its original, what that shows from all around, lit from
   all around: half a minute for 2,500 Gaussians. Models that are not trained, baked ones and media, placed
   ones and what has no size stay as they are. Where it fails the level may be half taught. */
static inline ssdgs_result reduce_teach(ssdgs_model *original, ssdgs_model *level) {
    const ssdgs_settings *s = ssdgs_model_settings(original);
    ssdgs_photo photos[REDUCE__PICTURES];
    float *pixels[REDUCE__PICTURES];
    ssdgs_trainer *trainer = NULL;
    memset(pixels, 0, sizeof pixels);
    const ssdgs_settings unplaced = ssdgs_settings_default();
    if (s->baked || s->kept > 0 || !s->scattering.layers || !ssdgs_model_peek(level).count ||
        memcmp(&s->placement, &unplaced.placement, sizeof s->placement))
        return SSDGS_OK;
    ssdgs_train_options o = ssdgs_train_options_default();
    reduce_fine_steps(&o, REDUCE__LESSONS);
    o.prune_outside = 0;
    ssdgs_result result = ssdgs_model_bounds(original, o.bounds_min, o.bounds_max);
    double size = 0;
    for (int c = 0; c < 3; c++) size = fmax(size, (double)o.bounds_max[c] - (double)o.bounds_min[c]);
    if (!result && !(size > 0)) return SSDGS_OK;
    for (int i = 0; i < REDUCE__PICTURES && !result; i++)
        result = reduce__picture(original, o.bounds_min, o.bounds_max, ssdgs_model_peek(level).count, i,
                                 photos + i, pixels + i);
    if (!result) result = ssdgs_trainer_create(level, photos, REDUCE__PICTURES, &o, &trainer);
    if (!result) result = ssdgs_trainer_run(trainer, NULL, NULL);
    ssdgs_trainer_destroy(trainer);
    for (int i = 0; i < REDUCE__PICTURES; i++) free(pixels[i]);
    return result;
}
#endif

#endif
