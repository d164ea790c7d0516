/* adopt.h - what an editor of splats has taken from a model's file, back. MIT, see ssdgs.h.

   #define SSDGS_STAGES
   #include "ssdgs.h"
   #include "adopt.h"
   ...
   ssdgs_load_stats edited_stats, original_stats;
   ssdgs_model_load(context, "edited.ply", &model, &edited_stats);
   ssdgs_model_load(context, "trained.ply", &original, &original_stats);
   const char *problem;
   ssdgs_result result = adopt_model(context, &model, &edited_stats, original, &original_stats, &problem);

   HOW  The model gets the settings, ASG and networks of the original. Networks know the model only where it
   was trained. So the Gaussians that both have, in any order, tell how the editor has turned, scaled and
   moved it. The model's own come back to the original's places, and what the editor did becomes part of
   settings.placement, with which the model is drawn and saved. */

#ifndef ADOPT_H
#define ADOPT_H
#if !defined(SSDGS_STAGES) && !defined(SSDGS_IMPLEMENTATION)
#error adopt.h needs SSDGS_STAGES to be defined before ssdgs.h is included
#endif

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ADOPT__PAIRS 4096 /* places that tell how a model was moved, at most */

/* A rotation, a scale and a move: x -> scale (turned x) + move. scale below 0 mirrors, too. */
typedef struct adopt__similarity {
    double q[4], r[9], scale, move[3];
} adopt__similarity;

static inline void adopt__similarity_at(const adopt__similarity *s, const double x[3], double to[3]) {
    for (int i = 0; i < 3; i++)
        to[i] =
            s->scale * (s->r[3 * i] * x[0] + s->r[3 * i + 1] * x[1] + s->r[3 * i + 2] * x[2]) + s->move[i];
}

/* A turn, axis times radians, as a quaternion. */
static inline void adopt__turn_quaternion(const ssdgs_real turn[3], double q[4]) {
    double angle = 0;
    for (int i = 0; i < 3; i++) angle += (double)turn[i] * (double)turn[i];
    angle = sqrt(angle);
    q[0] = cos(0.5 * angle);
    for (int i = 0; i < 3; i++) q[1 + i] = angle > 0 ? sin(0.5 * angle) * (double)turn[i] / angle : 0;
}

/* The rotation of a unit quaternion. */
static inline void adopt__quaternion_matrix(const double q[4], double r[9]) {
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double rows[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                            2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                            2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(r, rows, sizeof rows);
}

/* q, then p. */
static inline void adopt__quaternion_product(const double p[4], const double q[4], double to[4]) {
    to[0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3];
    for (int k = 1; k < 4; k++) {
        const int a = k % 3 + 1, b = (k + 1) % 3 + 1;
        to[k] = p[0] * q[k] + p[k] * q[0] + p[a] * q[b] - p[b] * q[a];
    }
}

/* Two places of one Gaussian, and how far a similarity is off. */
typedef struct adopt__pair_of_places {
    double from[3], to[3], off;
} adopt__pair_of_places;

static inline int adopt__off_compare(const void *a, const void *b) {
    const double x = ((const adopt__pair_of_places *)a)->off, y = ((const adopt__pair_of_places *)b)->off;
    return (x > y) - (x < y);
}

/* The similarity nearest to n pairs; side: 1, or -1 for one that mirrors. Its quaternion is the eigenvector
   of the largest eigenvalue of a symmetric 4 x 4 matrix (Horn 1987). 0 where the pairs tell none: all lie on
   a line, say. */
static inline int adopt__similarity_of(const adopt__pair_of_places *pairs, int n, double side,
                                       adopt__similarity *s) {
    double mean[2][3] = {{0, 0, 0}, {0, 0, 0}}, c[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0}, m[16], trace = 0;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) mean[0][k] += pairs[i].from[k] / n, mean[1][k] += pairs[i].to[k] / n;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 9; k++)
            c[k] += side * (pairs[i].from[k / 3] - mean[0][k / 3]) * (pairs[i].to[k % 3] - mean[1][k % 3]);
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            const int a = (i ? i : j) - 1, d = j - 1; /* axes */
            const double sum = c[0] + c[4] + c[8];
            double v = sum; /* of the real part with itself */
            if ((i > 0) != (j > 0))
                v = c[3 * ((a + 1) % 3) + (a + 2) % 3] - c[3 * ((a + 2) % 3) + (a + 1) % 3];
            if (i > 0 && j > 0) v = c[3 * a + d] + c[3 * d + a] - (i == j ? sum : 0);
            m[4 * i + j] = v;
        }
    double size = 0;
    for (int i = 0; i < 16; i++) size += fabs(m[i]);
    if (!(size > 0)) return 0;
    for (int i = 0; i < 16; i++) m[i] = m[i] / size + (i % 5 == 0); /* all eigenvalues positive */
    for (int turn = 0; turn < 50; turn++) { /* squared again and again the largest one is left */
        double square[16];
        trace = m[0] + m[5] + m[10] + m[15];
        for (int i = 0; i < 16; i++) {
            square[i] = 0;
            for (int k = 0; k < 4; k++) square[i] += m[i / 4 * 4 + k] * m[4 * k + i % 4] / (trace * trace);
        }
        memcpy(m, square, sizeof m);
    }
    int best = 0;
    for (int i = 1; i < 4; i++) best = m[5 * i] > m[5 * best] ? i : best;
    trace = m[0] + m[5] + m[10] + m[15];
    double norm = 0;
    for (int i = 0; i < 4; i++) norm += m[4 * best + i] * m[4 * best + i];
    if (!(norm > 0.999 * m[5 * best] * trace)) return 0; /* two eigenvalues are alike */
    for (int i = 0; i < 4; i++) s->q[i] = m[4 * best + i] / sqrt(norm);
    adopt__quaternion_matrix(s->q, s->r);
    double along = 0, square = 0;
    for (int k = 0; k < 9; k++) along += s->r[k] * c[k % 3 * 3 + k / 3];
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            square += (pairs[i].from[k] - mean[0][k]) * (pairs[i].from[k] - mean[0][k]);
    s->scale = side * along / square;
    if (!(along > 0) || !(square > 0)) return 0;
    for (int k = 0; k < 3; k++) s->move[k] = 0;
    double centre[3];
    adopt__similarity_at(s, mean[0], centre);
    for (int k = 0; k < 3; k++) s->move[k] = mean[1][k] - centre[k];
    return 1;
}

/* The similarity that most pairs follow, by fits to the better half, and how far off half of them are; 1e300:
   there is none. */
static inline double adopt__similarity_fit(adopt__pair_of_places *pairs, int n, double side,
                                           adopt__similarity *s) {
    for (int turn = 0; turn < 12; turn++) {
        if (!adopt__similarity_of(pairs, turn ? n / 2 + 1 : n, side, s)) return 1e300;
        for (int i = 0; i < n; i++) {
            double at[3];
            adopt__similarity_at(s, pairs[i].from, at);
            pairs[i].off = 0;
            for (int k = 0; k < 3; k++) pairs[i].off += (at[k] - pairs[i].to[k]) * (at[k] - pairs[i].to[k]);
        }
        qsort(pairs, (size_t)n, sizeof *pairs, adopt__off_compare);
    }
    return sqrt(pairs[n / 2].off);
}

/* What no editor of splats changes of a Gaussian are the properties that are ours alone: from SSDGS_DIFFUSE
   on. One of them as files have it. Highlights' colours are left out: old files have them otherwise. */
static inline uint32_t adopt__own_bits(const ssdgs_model_view *model, size_t i, size_t c) {
    const float value = (float)model->gaussians[c * model->stride + i];
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline uint64_t adopt__own_key(const ssdgs_model_view *model, size_t i) {
    uint64_t hash = 1;
    for (size_t c = SSDGS_DIFFUSE; c < SSDGS_CHANNELS; c++) {
        if (c >= SSDGS_SPECULAR && c < SSDGS_SCATTERING) continue;
        hash = (hash ^ adopt__own_bits(model, i, c)) * UINT64_C(0x9E3779B97F4A7C15);
        hash ^= hash >> 29;
    }
    return hash << 32 | (uint32_t)i;
}

static inline int adopt__own_same(const ssdgs_model_view *a, size_t i, const ssdgs_model_view *b, size_t j) {
    int same = 1;
    for (size_t c = SSDGS_DIFFUSE; c < SSDGS_CHANNELS; c++)
        same = same && ((c >= SSDGS_SPECULAR && c < SSDGS_SCATTERING) ||
                        adopt__own_bits(a, i, c) == adopt__own_bits(b, j, c));
    return same;
}

static inline int adopt__key_compare(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Which of the original's Gaussians Gaussian i is; -1: none, or several. keys: the original's, sorted. */
static inline int adopt__own_match(const ssdgs_model_view *model, size_t i, const ssdgs_model_view *original,
                                   const uint64_t *keys) {
    const uint64_t key = adopt__own_key(model, i) >> 32;
    size_t low = 0, high = (size_t)original->count;
    int found = -1;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (keys[middle] >> 32 < key) low = middle + 1;
        else high = middle;
    }
    for (; low < (size_t)original->count && keys[low] >> 32 == key; low++) {
        if (!adopt__own_same(model, i, original, (uint32_t)keys[low])) continue;
        if (found >= 0) return -1;
        found = (int)(uint32_t)keys[low];
    }
    return found;
}

/* Brings Gaussian i back. A place, rotation or size that is what the similarity makes of the original's, j,
   or that the editor left as it was, becomes the original's to the bit; any other has been edited, and is
   turned back. j -1: it is not in the original. */
static inline void adopt__bring_back(const ssdgs_model_view *model, size_t i,
                                     const ssdgs_model_view *original, int j, const adopt__similarity *s,
                                     double tolerance) {
    ssdgs_real *g = model->gaussians + i;
    const ssdgs_real *o = original->gaussians + (j < 0 ? 0 : j);
    const size_t stride = model->stride, from = original->stride;
    double x[3], q[4], back[4], dot = 0, norm[2] = {0, 0}, off = 0;
    for (size_t k = 0; k < 3; k++) x[k] = (double)g[(SSDGS_POSITION + k) * stride] - s->move[k];
    for (size_t k = 0; k < 3; k++) {
        const double home = (s->r[k] * x[0] + s->r[3 + k] * x[1] + s->r[6 + k] * x[2]) / s->scale;
        off += j < 0 ? 0 : fabs(home - (double)o[(SSDGS_POSITION + k) * from]);
        g[(SSDGS_POSITION + k) * stride] = (ssdgs_real)home;
    }
    for (size_t k = 0; k < 3 && j >= 0 && off * fabs(s->scale) < 2 * tolerance; k++)
        g[(SSDGS_POSITION + k) * stride] = o[(SSDGS_POSITION + k) * from];
    for (size_t k = 0; k < 4; k++) q[k] = (double)g[(SSDGS_ROTATION + k) * stride];
    const double inverse[4] = {s->q[0], -s->q[1], -s->q[2], -s->q[3]};
    adopt__quaternion_product(inverse, q, back);
    int same = j >= 0;
    for (size_t k = 0; k < 4 && j >= 0; k++) {
        const double own = (double)o[(SSDGS_ROTATION + k) * from];
        same = same && !(q[k] < own) && !(q[k] > own);
        dot += back[k] * own, norm[0] += back[k] * back[k], norm[1] += own * own;
    }
    same = same || (j >= 0 && dot * dot > (1 - 1e-6) * norm[0] * norm[1]);
    for (size_t k = 0; k < 4; k++)
        g[(SSDGS_ROTATION + k) * stride] = same ? o[(SSDGS_ROTATION + k) * from] : (ssdgs_real)back[k];
    for (size_t k = 0; k < 3; k++) {
        ssdgs_real *size = g + (SSDGS_LOG_SCALE + k) * stride;
        const double home = (double)*size - log(fabs(s->scale)),
                     own = j < 0 ? 1e300 : (double)o[(SSDGS_LOG_SCALE + k) * from];
        const int kept = !((double)*size < own) && !((double)*size > own);
        *size = kept || fabs(home - own) < 1e-4 ? (ssdgs_real)own : (ssdgs_real)home;
    }
}

/* Puts what an editor did, s, in front of the settings' placement. A file that lost its origin had positions
   relative to it or in the world: that is taken which moves the model less. 0: the settings' ranges do not
   hold the result. */
static inline int adopt__place_after(ssdgs_settings *settings, const adopt__similarity *s,
                                     const double apart[3], int lost, double tolerance) {
    double move2 = 0, other2 = 0, turn = 0, move[3], placed[3], q[4];
    for (int k = 0; k < 3; k++) {
        move2 += s->move[k] * s->move[k];
        other2 += (s->move[k] + apart[k]) * (s->move[k] + apart[k]);
        turn += s->q[1 + k] * s->q[1 + k];
    }
    const int in_world = !lost || other2 < move2;
    if (2 * atan2(sqrt(turn), fabs(s->q[0])) < 1e-6 && fabs(s->scale - 1) < 1e-6 &&
        (in_world ? other2 : move2) < tolerance * tolerance)
        return 1;
    adopt__similarity before;
    for (int k = 0; k < 3; k++) { /* without what rounding left */
        before.move[k] = (double)settings->placement.move[k];
        move[k] = s->move[k] + (in_world ? apart[k] : 0);
        move[k] = fabs(move[k]) < 1e-2 * tolerance ? 0 : move[k];
    }
    adopt__turn_quaternion(settings->placement.turn, before.q);
    adopt__quaternion_matrix(before.q, before.r);
    before.scale = (double)settings->placement.scale;
    adopt__similarity_at(&before, move, placed);
    adopt__quaternion_product(before.q, s->q, q);
    const double sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), side = q[0] < 0 ? -1 : 1,
                 angle = 2 * atan2(sine, fabs(q[0])), scale = before.scale * s->scale;
    if (!(fabs(scale) < 1e9 && fabs(scale) > 1.001e-9)) return 0;
    for (int k = 0; k < 3; k++)
        if (!(fabs(placed[k]) < 1e9)) return 0;
    for (int k = 0; k < 3; k++) {
        const double turned = sine > 0 ? side * angle * q[1 + k] / sine : 0;
        settings->placement.turn[k] = (ssdgs_real)(fabs(turned) < 1e-6 ? 0 : turned);
        settings->placement.move[k] = (ssdgs_real)placed[k];
    }
    settings->placement.scale = (ssdgs_real)(fabs(fabs(scale) - 1) < 1e-6 ? (scale < 0 ? -1 : 1) : scale);
    return 1;
}

/* Up to 0.2.0 files had a deferred lobe's height where c_s is now. */
static inline void adopt__update_specular(ssdgs_model *model, int index) {
    const ssdgs_model_view v = ssdgs_model_peek(model);
    ssdgs_real *plane = v.gaussians + index, was[SSDGS_CHANNELS];
    ssdgs_gaussian g;
    if (ssdgs_model_get(model, index, &g)) return;
    for (size_t c = 0; c < SSDGS_CHANNELS; c++) was[c] = plane[c * v.stride];
    for (size_t c = 0; c < 3; c++) {
        const double raw = (double)was[SSDGS_SPECULAR + c];
        g.specular[c] = (ssdgs_real)(raw > 20 ? raw : log1p(exp(raw)));
    }
    if (ssdgs_model_set(model, index, &g)) return;
    for (size_t c = 0; c < SSDGS_CHANNELS; c++)
        if (c < SSDGS_SPECULAR || c >= SSDGS_SCATTERING) plane[c * v.stride] = was[c];
}

/* What is found before anything changes. */
typedef struct adopt__state {
    ssdgs_model_view model, original;
    uint64_t *keys;              /* (original's count + 1) */
    int *match;                  /* (count + 1) as adopt__own_match */
    adopt__pair_of_places *pair; /* (ADOPT__PAIRS) */
    int lost;                    /* 1: the file had no settings */
    double apart[3]; /* the origins' difference, which positions of a file without settings may have or not */
    adopt__similarity moved; /* from the original's places to the model's */
    double tolerance;
    ssdgs_settings settings; /* the model's from now on */
} adopt__state;

/* Finds what has become of the original's Gaussians. 1: they all stay. */
static inline int adopt__find(adopt__state *a, int together, const char **problem) {
    static const adopt__similarity unmoved = {{1, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1, {0, 0, 0}};
    const ssdgs_model_view *model = &a->model, *original = &a->original;
    const size_t count = (size_t)model->count, known = (size_t)original->count;
    size_t shared = 0, still = 0, taken = 0;
    int n = 0;
    for (size_t i = 0; i < known; i++) a->keys[i] = adopt__own_key(original, i);
    qsort(a->keys, known, sizeof *a->keys, adopt__key_compare);
    for (size_t i = 0; i < count; i++) {
        a->match[i] = adopt__own_match(model, i, original, a->keys);
        shared += a->match[i] >= 0;
    }
    double largest = 0, spread = 0, mean[3] = {0, 0, 0};
    for (size_t i = 0; i < count; i++) {
        if (a->match[i] < 0) continue;
        int same = 1, sound = 1;
        double from[3], place[3];
        for (size_t k = 0; k < 3; k++) {
            place[k] = (double)model->gaussians[(SSDGS_POSITION + k) * model->stride + i];
            from[k] =
                (double)original->gaussians[(SSDGS_POSITION + k) * original->stride + (size_t)a->match[i]];
            same = same && !(place[k] < from[k]) && !(place[k] > from[k]);
            sound = sound && ssdgs_finite((ssdgs_real)place[k]) && ssdgs_finite((ssdgs_real)from[k]) &&
                    fabs(place[k]) < 1e15 && fabs(from[k]) < 1e15;
        }
        still += (size_t)same;
        /* some of all tell enough */
        if (!sound || (uint64_t)taken++ * ADOPT__PAIRS / shared < (uint64_t)n || n == ADOPT__PAIRS) continue;
        for (size_t k = 0; k < 3; k++) {
            a->pair[n].from[k] = from[k];
            a->pair[n].to[k] = place[k];
            mean[k] += place[k];
            largest = fabs(place[k]) > largest ? fabs(place[k]) : largest;
        }
        n++;
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            spread += (a->pair[i].to[k] - mean[k] / n) * (a->pair[i].to[k] - mean[k] / n) / n;
    /* floats are exact to 6e-8 of themselves, what editors compute with them to some more */
    const double tolerance = a->tolerance = 1e-4 * sqrt(spread) + 1e-6 * largest;
    a->moved = unmoved;
    if (!count || (2 * still > shared && (a->lost || together))) return 1;
    int fits = 0;
    if (n < 4 || 2 * shared < count)
        *problem = "too few of the model's Gaussians are the original's to tell whether an editor has "
                   "turned, scaled or "
                   "moved it";
    else {
        fits = adopt__similarity_fit(a->pair, n, 1, &a->moved) < tolerance ||
               adopt__similarity_fit(a->pair, n, -1, &a->moved) < tolerance;
        if (fits) fits = adopt__place_after(&a->settings, &a->moved, a->apart, a->lost, tolerance);
        if (!fits)
            *problem =
                "no rotation, scale and move brings the original's Gaussians to where they are: has an "
                "editor stretched it, or joined several?";
    }
    if (fits) return 0;
    a->moved = unmoved;
    for (int k = 0; k < 3; k++) a->moved.move[k] = -a->apart[k];
    return 0;
}

/* Replaces *model by one that has the original's settings, ASG and networks. own: what loading *model told,
   NULL: its settings are its own; trained: what loading the original told, or NULL. *problem: why it is not
   known where the editor has put the model, or NULL. ERR_ARGUMENT: one of them is baked. ERR_MEMORY. After an
   error nothing has changed; the context's message says why. */
static inline ssdgs_result adopt_model(ssdgs_context *context, ssdgs_model **model,
                                       const ssdgs_load_stats *own, const ssdgs_model *original,
                                       const ssdgs_load_stats *trained, const char **problem) {
    adopt__state a;
    ssdgs_model *whole = NULL;
    *problem = NULL;
    memset(&a, 0, sizeof a);
    a.model = ssdgs_model_peek(*model);
    a.original = ssdgs_model_peek(original);
    a.lost = own && own->untrained;
    a.settings = *ssdgs_model_settings(original);
    const ssdgs_settings *before = ssdgs_model_settings(*model);
    if (before->baked || a.settings.baked)
        return ssdgs_context_fail(context, SSDGS_ERR_ARGUMENT, "adopt_model: a baked model has no networks");
    int together = 1;
    for (int c = 0; c < 3; c++) {
        a.apart[c] = (double)before->origin[c] - (double)a.settings.origin[c];
        together = together && !(a.apart[c] < 0) && !(a.apart[c] > 0);
    }
    if (!a.lost) a.settings.placement = before->placement;
    const size_t count = (size_t)a.model.count;
    a.keys = (uint64_t *)malloc(((size_t)a.original.count + 1) * sizeof *a.keys);
    a.match = (int *)malloc((count + 1) * sizeof *a.match);
    a.pair = (adopt__pair_of_places *)malloc(ADOPT__PAIRS * sizeof *a.pair);
    ssdgs_result result = a.keys && a.match && a.pair
                              ? SSDGS_OK
                              : ssdgs_context_fail(context, SSDGS_ERR_MEMORY, "adopt_model: out of memory");
    const int stays = result ? 1 : adopt__find(&a, together, problem);
    if (!result) result = ssdgs_model_create(context, &a.settings, a.model.count, &whole);
    if (!result) {
        const ssdgs_model_view to = ssdgs_model_arrays(whole), *from = &a.original;
        for (size_t c = 0; c < SSDGS_CHANNELS; c++)
            memcpy(to.gaussians + c * to.stride, a.model.gaussians + c * a.model.stride,
                   count * sizeof *to.gaussians);
        memcpy(to.asg_basis, from->asg_basis, 4 * SSDGS_ASG_COUNT * sizeof *to.asg_basis);
        memcpy(to.asg_sharpness, from->asg_sharpness, 2 * SSDGS_ASG_COUNT * sizeof *to.asg_sharpness);
        memcpy(to.asg_sigma, from->asg_sigma, SSDGS_ASG_COUNT * sizeof *to.asg_sigma);
        memcpy(to.scattering, from->scattering, from->scattering_count * sizeof *to.scattering);
        memcpy(to.shadow, from->shadow, from->shadow_count * sizeof *to.shadow);
        const int old = a.lost && trained && trained->version <= 200 && a.settings.asg == SSDGS_ASG_DEFERRED;
        for (size_t i = 0; i < count; i++) {
            for (size_t c = SSDGS_SPECULAR; c < SSDGS_SCATTERING && old && a.match[i] >= 0; c++)
                to.gaussians[c * to.stride + i] = from->gaussians[c * from->stride + (size_t)a.match[i]];
            if (old && a.match[i] < 0) adopt__update_specular(whole, (int)i);
            for (size_t c = SSDGS_CHANNELS; c < (size_t)to.channels; c++) { /* colours that no light makes */
                const ssdgs_real black =
                    c < SSDGS_CHANNELS + 3 ? (ssdgs_real)(-0.5 / 0.28209479177387814) : 0;
                to.gaussians[c * to.stride + i] =
                    a.match[i] >= 0                   ? from->gaussians[c * from->stride + (size_t)a.match[i]]
                    : a.model.channels == to.channels ? a.model.gaussians[c * a.model.stride + i]
                                                      : black;
            }
            if (!stays) adopt__bring_back(&to, i, from, a.match[i], &a.moved, a.tolerance);
        }
        ssdgs_model_destroy(*model);
        *model = whole;
    }
    free(a.keys);
    free(a.match);
    free(a.pair);
    return result;
}

#endif /* ADOPT_H */
