/* unbake.h - a plain splat becomes a model that takes light. MIT, see ssdgs.h.

   #define SSDGS_STAGES
   #include "ssdgs.h"
   #include "unbake.h"
   ...
   ssdgs_result result = unbake_model(context, plain, NULL, &lit);

   HOW  Where each Gaussian sees the sky, from 32 directions, says on which side of it the air is: its
   shortest axis points there and becomes its normal. Its colour, divided by the share of the sky that it
   sees, becomes its albedo, averaged over neighbours of its hue. What things stand on was photographed from
   above: no direction from below it counts. A room is looked at from places in it, which options name.

   HOW WELL  Trained models, baked under an even sky and lit again by the lamps of their test photographs
   (tests/unbaked.c), had 26 dB where things are matt, 34 where they are of wax that options tell, and 22
   where they are of metal, which no colour tells. It takes some seconds for 150,000 Gaussians, so save the
   result. Its memory comes from malloc(). */

#ifndef UNBAKE_H
#define UNBAKE_H
#if !defined(SSDGS_STAGES) && !defined(SSDGS_IMPLEMENTATION)
#error unbake.h needs SSDGS_STAGES to be defined before ssdgs.h is included
#endif

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define UNBAKE__SKY 32     /* directions from which it is seen */
#define UNBAKE__AT_ONCE 8  /* of them, in one frame */
#define UNBAKE__NEAR 24    /* neighbours */
#define UNBAKE__ROUNDS 10  /* of averaging albedos over them */
#define UNBAKE__CHUNK 256  /* Gaussians of a task */
#define UNBAKE__FLAT 0.85  /* cosine of the angle to a plane's normal within which a Gaussian lies in it */
#define UNBAKE__LAYERS 64  /* heights, over twice the model's size */
#define UNBAKE__THICK 4    /* of them: a plane */
#define UNBAKE__BELOW 0.3  /* sine: directions count down to this angle below what things stand on */
#define UNBAKE__LEAST 0.05 /* share of the sky that a Gaussian sees, at least */
#define UNBAKE__MOST 0.95  /* of the surface: what sees or reflects more counts as what is at this share */

/* What is known of a splat beside its file. */
typedef struct unbake_options {
    ssdgs_real ambient[9][3]; /* irradiance under which it was photographed, as ssdgs_render_options has it;
                                 0: even, and of such strength that what is white is 0.9 */
    ssdgs_real scattering[3]; /* of 1 world unit, as settings.medium has them: all of it is wax or skin; */
    ssdgs_real absorption[3]; /* 0: it is opaque; 0 */
    ssdgs_real roughness;     /* of its highlights, 0.01 .. 1; 0: it has none; 0 */
    ssdgs_real f0;            /* what it reflects at normal incidence; 0.04 */
    ssdgs_real kept;          /* 0 .. 1: share of its own light that it keeps beside its lamps', see
                                 ssdgs_settings; 0 */
    const ssdgs_real (*eyes)[3]; /* (eye_count) of a room: places, world, from which it was photographed: its
                                    surfaces face them, and all are taken to be lit alike; NULL */
    int eye_count;               /* up to 32; 0: it was photographed from outside; 0 */
} unbake_options;
static inline unbake_options unbake_options_default(void) {
    unbake_options options;
    memset(&options, 0, sizeof options);
    options.f0 = (ssdgs_real)0.04;
    return options;
}

/* What is found of a Gaussian. */
typedef struct unbake__splat {
    float position[3], axis[3]; /* world; axis: its shortest */
    float flat, weight;         /* 0 .. 1: how much shorter that is; opacity x area */
    float normal[3], share;     /* share: of an even sky */
    float color[3], hue[2];     /* linear; hue: shares of red and green */
} unbake__splat;

typedef struct unbake__state {
    const ssdgs_model *plain;
    const unbake_options *options;
    int count, batch, told;          /* batch: the first direction at work; told: options.ambient is */
    ssdgs_real low[3], high[3];      /* bounds */
    double size, most;               /* their longest side; the sky that all but few Gaussians see less of */
    int sky_count;                   /* directions, or eyes */
    double sky[UNBAKE__SKY][3];      /* directions, even over the sphere; eyes */
    unsigned char used[UNBAKE__SKY]; /* 0: nothing was photographed from there */
    unsigned char *seen;             /* (UNBAKE__SKY, count) how well, 255: fully */
    unbake__splat *splat;            /* (count) */
    uint32_t *tree, *neighbours;     /* (count) a k-d tree; (count, UNBAKE__NEAR) */
    unsigned char *across;           /* (count) the axis along which the tree is cut */
    float *tells;                    /* (count, UNBAKE__NEAR) shares of the neighbours, itself one */
    float *albedo, *averaged;        /* (count, 3) */
} unbake__state;

static inline double unbake__dot(const double a[3], const float b[3]) {
    return a[0] * (double)b[0] + a[1] * (double)b[1] + a[2] * (double)b[2];
}

/* Stage WALK keeps what the Gaussians get of each light. */
static inline ssdgs_result unbake__walk(void *user, ssdgs_frame *frame) {
    unbake__state *u = (unbake__state *)user;
    const ssdgs_result result = ssdgs_stage_cpu(frame, SSDGS_STAGE_WALK);
    for (int light = 0; light < frame->light_count && !result; light++)
        for (int i = 0; i < u->count; i++) {
            const double passed = (double)frame->visibility[(size_t)light * (size_t)frame->count + (size_t)i];
            u->seen[(size_t)(u->batch + light) * (size_t)u->count + (size_t)i] =
                (unsigned char)(passed > 0 ? 255 * (passed < 1 ? passed : 1) + 0.5 : 0);
        }
    return result;
}

/* The Gaussians' places, shapes and opacities, bit for bit. */
static inline void unbake__copy(const unbake__state *u, ssdgs_model *model) {
    const ssdgs_model_view from = ssdgs_model_peek(u->plain), to = ssdgs_model_arrays(model);
    for (size_t c = 0; c < SSDGS_DIFFUSE; c++)
        memcpy(to.gaussians + c * to.stride, from.gaussians + c * from.stride,
               (size_t)u->count * sizeof *to.gaussians);
}

/* Makes that the context's message, after the function's name, with a number behind it: as the library's,
   with a point wherever the program's locale has a comma, and nan without a sign. */
static inline ssdgs_result unbake__refuse(ssdgs_context *context, ssdgs_result result, const char *what,
                                          double number) {
    char text[256], digits[40];
    snprintf(digits, sizeof digits, "%.7g", number == number ? number : fabs(number));
    char *const comma = strchr(digits, ',');
    if (comma) *comma = '.';
    snprintf(text, sizeof text, "unbake_model: %s%s", what, digits);
    return ssdgs_context_fail(context, result, text);
}

/* Who sees the sky: lights from all around shine on the Gaussians. */
static inline ssdgs_result unbake__look(unbake__state *u, ssdgs_context *context) {
    ssdgs_settings settings = ssdgs_settings_default();
    const ssdgs_render_options coarse = ssdgs_render_options_preview();
    ssdgs_gpu_hook hook;
    ssdgs_context_desc desc;
    ssdgs_context *own = NULL;
    ssdgs_model *model = NULL;
    ssdgs_scene *scene = NULL;
    memset(&hook, 0, sizeof hook);
    memset(&desc, 0, sizeof desc);
    hook.stage[SSDGS_STAGE_WALK] = unbake__walk;
    hook.user = u;
    desc.gpu = &hook;
    desc.threads = ssdgs_context_threads(context);
    desc.isa = ssdgs_context_isa(context);
    settings.terms = SSDGS_SHADOW_TERM;
    settings.scattering.layers = settings.shadow.layers = settings.transport = 0;
    settings.light_map.bias /= 2; /* thin things have two sides */
    ssdgs_result result = ssdgs_context_create(&desc, &own);
    settings.length_unit = u->size > 0 ? (ssdgs_real)(u->size / 2) : 1;
    if (!result) result = ssdgs_model_create(own, &settings, u->count, &model);
    if (!result) result = ssdgs_scene_create(own, &scene);
    if (!result) unbake__copy(u, model);
    const ssdgs_object object = ssdgs_object_default(model);
    for (u->batch = 0; u->batch < u->sky_count && !result; u->batch += UNBAKE__AT_ONCE) {
        ssdgs_light lights[UNBAKE__AT_ONCE];
        int count = 0;
        for (; count < UNBAKE__AT_ONCE && u->batch + count < u->sky_count; count++) {
            static const ssdgs_real even[3] = {1, 1, 1};
            const double *d = u->sky[u->batch + count];
            const ssdgs_real along[3] = {(ssdgs_real)-d[0], (ssdgs_real)-d[1], (ssdgs_real)-d[2]};
            lights[count] = u->options->eye_count
                                ? ssdgs_light_point(u->options->eyes[u->batch + count], even)
                                : ssdgs_light_directional(along, even);
        }
        result = ssdgs_scene_light(scene, &object, 1, NULL, lights, count, &coarse);
    }
    if (result) ssdgs_context_fail(context, result, own ? ssdgs_error_message(own) : "out of memory");
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(own);
    return result;
}

/* Shape and colour. What is not finite weighs nothing. */
static inline ssdgs_result unbake__read(unbake__state *u) {
    const int linear = ssdgs_model_settings(u->plain)->transfer == SSDGS_TRANSFER_SRGB;
    for (int i = 0; i < u->count; i++) {
        unbake__splat *s = u->splat + i;
        ssdgs_gaussian g;
        const ssdgs_result result = ssdgs_model_get(u->plain, i, &g);
        if (result) return result;
        const double w = (double)g.rotation[0], x = (double)g.rotation[1], y = (double)g.rotation[2],
                     z = (double)g.rotation[3];
        const double axis[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                                   {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                                   {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
        int least = 0;
        double sum = 1e-12;
        for (int c = 1; c < 3; c++) least = g.scale[c] < g.scale[least] ? c : least;
        const double a = (double)g.scale[(least + 1) % 3], b = (double)g.scale[(least + 2) % 3];
        s->flat = (float)(1 - (double)g.scale[least] / (a < b ? a : b));
        s->weight = (float)((double)g.opacity * a * b);
        int finite = ssdgs_finite((ssdgs_real)s->flat) && ssdgs_finite((ssdgs_real)s->weight);
        for (int c = 0; c < 3; c++) {
            const double stored = (double)g.diffuse[c];
            s->position[c] = (float)g.position[c];
            s->axis[c] = (float)axis[least][c];
            s->color[c] = (float)(linear ? stored : (double)ssdgs_srgb_decode((ssdgs_real)stored));
            sum += (double)s->color[c];
            finite &= ssdgs_finite((ssdgs_real)s->position[c]) && ssdgs_finite((ssdgs_real)s->axis[c]) &&
                      ssdgs_finite((ssdgs_real)s->color[c]);
        }
        if (!finite) memset(s, 0, sizeof *s);
        for (int c = 0; c < 2; c++) s->hue[c] = finite ? (float)((double)s->color[c] / sum) : 0;
    }
    return SSDGS_OK;
}

/* Along a plane's normal, from the middle of the bounds. */
static inline double unbake__height(const unbake__state *u, const double normal[3], const unbake__splat *s) {
    double height = unbake__dot(normal, s->position);
    for (int c = 0; c < 3; c++) height -= normal[c] * ((double)u->low[c] + (double)u->high[c]) / 2;
    return height;
}

/* The share of what is seen along a direction that lies in one plane across it. `plane` gets that plane's
   normal, one of both, `middle` its height. */
static inline double unbake__plane(const unbake__state *u, int k, double plane[3], double *middle) {
    const unsigned char *seen = u->seen + (size_t)k * (size_t)u->count;
    double sum[3] = {0, 0, 0}, all = 1e-30, within = 0, layer[UNBAKE__LAYERS] = {0};
    for (int pass = 0; pass < 2; pass++) {
        const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) + 1e-30;
        for (int c = 0; c < 3; c++) plane[c] = pass ? sum[c] / length : u->sky[k][c];
        for (int i = 0; i < u->count; i++) {
            const unbake__splat *s = u->splat + i;
            const double along = unbake__dot(plane, s->axis),
                         weight = (double)s->weight * seen[i] * fabs(unbake__dot(u->sky[k], s->axis));
            if (!pass) all += weight;
            if (fabs(along) < UNBAKE__FLAT) continue;
            if (!pass) {
                for (int c = 0; c < 3; c++) sum[c] += weight * (along < 0 ? -1 : 1) * (double)s->axis[c];
                continue;
            }
            const double height = unbake__height(u, plane, s) / (u->size + 1e-30),
                         at = UNBAKE__LAYERS / 2 * (1 + height);
            if (at >= 0 && at < UNBAKE__LAYERS) layer[(int)at] += weight;
        }
    }
    for (int j = 0; j <= UNBAKE__LAYERS - UNBAKE__THICK; j++) {
        double together = 0;
        for (int t = 0; t < UNBAKE__THICK; t++) together += layer[j + t];
        if (together > within)
            within = together, *middle = u->size * ((2.0 * j + UNBAKE__THICK) / UNBAKE__LAYERS - 1);
    }
    return within / all;
}

/* A plane that looks flat from some direction and has air on both sides is taken for what things stand on:
   most of what else there is lies above it. Photographs show it from there, so directions from below it do
   not count. */
static inline void unbake__stand(unbake__state *u) {
    const double half = u->size * UNBAKE__THICK / UNBAKE__LAYERS;
    double best = 0, normal[3] = {0, 0, 0}, middle = 0, above = 0, seen[2] = {0, 0};
    for (int k = 0; k < UNBAKE__SKY; k++) {
        double plane[3], at = 0;
        const double share = unbake__plane(u, k, plane, &at);
        if (share <= best) continue;
        best = share, middle = at;
        memcpy(normal, plane, sizeof normal);
    }
    for (int i = 0; i < u->count; i++) {
        const unbake__splat *s = u->splat + i;
        const double height = unbake__height(u, normal, s) - middle;
        if (fabs(height) > half) above += height < 0 ? -(double)s->weight : (double)s->weight;
        if (fabs(height) > half || fabs(unbake__dot(normal, s->axis)) < UNBAKE__FLAT) continue;
        for (int k = 0; k < UNBAKE__SKY; k++) {
            const double *d = u->sky[k], along = normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2];
            seen[along > 0] +=
                (double)s->weight * fabs(along) * u->seen[(size_t)k * (size_t)u->count + (size_t)i];
        }
    }
    const int side = above > 0, stands = best > 0.4 && seen[side] > 0.25 * seen[!side];
    for (int k = 0; k < UNBAKE__SKY; k++) {
        const double *d = u->sky[k], along = normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2];
        u->used[k] = !stands || (side ? along : -along) > -UNBAKE__BELOW;
    }
}

/* The unit vector from a Gaussian to where light number k is. */
static inline void unbake__toward(const unbake__state *u, const unbake__splat *s, int k, double d[3]) {
    double length = 1e-30;
    for (int c = 0; c < 3; c++) {
        d[c] = u->sky[k][c] - (u->options->eye_count ? (double)s->position[c] : 0);
        length += d[c] * d[c];
    }
    for (int c = 0; c < 3; c++) d[c] /= sqrt(length);
}

/* A Gaussian's normal and how much of the sky it sees. */
static inline void unbake__side_task(void *data, int chunk) {
    unbake__state *u = (unbake__state *)data;
    for (int i = chunk * UNBAKE__CHUNK; i < u->count && i / UNBAKE__CHUNK == chunk; i++) {
        unbake__splat *s = u->splat + i;
        double open[3] = {0, 0, 0}, side = 0, n[3], length = 1e-30, share = 0, d[3];
        for (int k = 0; k < u->sky_count; k++) {
            const double seen = u->used[k] * u->seen[(size_t)k * (size_t)u->count + (size_t)i];
            unbake__toward(u, s, k, d);
            side += seen * unbake__dot(d, s->axis);
            for (int c = 0; c < 3; c++) open[c] += seen * d[c];
        }
        const double away = sqrt(open[0] * open[0] + open[1] * open[1] + open[2] * open[2]) + 1e-9;
        for (int c = 0; c < 3; c++) {
            n[c] = (double)s->flat * (side < 0 ? -1 : 1) * (double)s->axis[c] +
                   (1 - (double)s->flat) * open[c] / away;
            length += n[c] * n[c];
        }
        for (int c = 0; c < 3; c++) s->normal[c] = (float)(n[c] / sqrt(length));
        for (int k = 0; k < u->sky_count; k++) {
            unbake__toward(u, s, k, d);
            share += u->used[k] * u->seen[(size_t)k * (size_t)u->count + (size_t)i] *
                     fmax(0, unbake__dot(d, s->normal));
        }
        s->share = (float)(u->options->eye_count ? 1 : share);
    }
}

/* Its albedo, in the light that comes to it. What sees the most sky, but for a few, sees all of it. */
static inline void unbake__albedo_task(void *data, int chunk) {
    unbake__state *u = (unbake__state *)data;
    for (int i = chunk * UNBAKE__CHUNK; i < u->count && i / UNBAKE__CHUNK == chunk; i++) {
        unbake__splat *s = u->splat + i;
        const double share = (double)s->share / u->most, x = (double)s->normal[0], y = (double)s->normal[1],
                     z = (double)s->normal[2];
        const double term[9] = {1, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y};
        s->share = (float)(share < UNBAKE__LEAST ? UNBAKE__LEAST : share > 1 ? 1 : share);
        for (int c = 0; c < 3; c++) {
            double light = u->told ? 0 : 1;
            for (int j = 0; j < 9; j++) light += term[j] * (double)u->options->ambient[j][c];
            u->albedo[3 * (size_t)i + (size_t)c] =
                light > 0 ? (float)(3.14159265358979 * (double)s->color[c] / (light * (double)s->share)) : 0;
        }
    }
}

/* Puts the middle one of tree[from .. to) along an axis in its place, smaller ones before it. */
static inline void unbake__middle(const unbake__state *u, int from, int to, int axis) {
    const int middle = (from + to) / 2;
    for (to--; from < to;) {
        const float pivot = u->splat[u->tree[middle]].position[axis];
        int i = from, j = to;
        do {
            while (u->splat[u->tree[i]].position[axis] < pivot) i++;
            while (pivot < u->splat[u->tree[j]].position[axis]) j--;
            if (i > j) break;
            const uint32_t swapped = u->tree[i];
            u->tree[i++] = u->tree[j];
            u->tree[j--] = swapped;
        } while (i <= j);
        if (j < middle) from = i;
        if (middle < i) to = j;
    }
}

/* Cuts tree[from .. to) where it is longest, and so on: a node is the middle of its part. */
static inline void unbake__cut(unbake__state *u, int from, int to) {
    while (to - from > 1) {
        int axis = 0;
        float longest = -1;
        for (int c = 0; c < 3; c++) {
            float low = u->splat[u->tree[from]].position[c], high = low;
            for (int i = from + 1; i < to; i++) {
                const float x = u->splat[u->tree[i]].position[c];
                low = x < low ? x : low;
                high = x > high ? x : high;
            }
            if (high - low > longest) longest = high - low, axis = c;
        }
        unbake__middle(u, from, to, axis);
        u->across[(from + to) / 2] = (unsigned char)axis;
        unbake__cut(u, from, (from + to) / 2);
        from = (from + to) / 2 + 1;
    }
}

/* Who is nearest, nearest first. */
typedef struct unbake__near {
    const float *at;
    uint32_t *who;
    float distance2[UNBAKE__NEAR];
    int count;
} unbake__near;
static inline void unbake__search(const unbake__state *u, int from, int to, unbake__near *found) {
    while (from < to) {
        const int middle = (from + to) / 2, axis = u->across[middle];
        const float *p = u->splat[u->tree[middle]].position;
        float d2 = 0;
        for (int c = 0; c < 3; c++) d2 += (p[c] - found->at[c]) * (p[c] - found->at[c]);
        if (found->count < UNBAKE__NEAR || d2 < found->distance2[UNBAKE__NEAR - 1]) {
            int j = found->count < UNBAKE__NEAR ? found->count++ : UNBAKE__NEAR - 1;
            for (; j && d2 < found->distance2[j - 1]; j--) {
                found->distance2[j] = found->distance2[j - 1];
                found->who[j] = found->who[j - 1];
            }
            found->distance2[j] = d2;
            found->who[j] = u->tree[middle];
        }
        const float beyond = found->at[axis] - p[axis];
        unbake__search(u, beyond < 0 ? from : middle + 1, beyond < 0 ? middle : to, found);
        if (found->count == UNBAKE__NEAR && beyond * beyond >= found->distance2[UNBAKE__NEAR - 1]) return;
        if (beyond < 0) from = middle + 1;
        else to = middle;
    }
}

/* Neighbours, and what each tells of a Gaussian's albedo: those of its hue that see much of the sky most. */
static inline void unbake__near_task(void *data, int chunk) {
    unbake__state *u = (unbake__state *)data;
    for (int i = chunk * UNBAKE__CHUNK; i < u->count && i / UNBAKE__CHUNK == chunk; i++) {
        const size_t first = (size_t)i * UNBAKE__NEAR;
        const unbake__splat *s = u->splat + i;
        double sum = 0;
        unbake__near found;
        found.at = s->position;
        found.who = u->neighbours + first;
        found.count = 0;
        unbake__search(u, 0, u->count, &found);
        for (; found.count < UNBAKE__NEAR; found.count++) found.who[found.count] = (uint32_t)i;
        for (size_t j = first; j < first + UNBAKE__NEAR; j++) {
            const unbake__splat *o = u->splat + u->neighbours[j];
            const double red = (double)(s->hue[0] - o->hue[0]), green = (double)(s->hue[1] - o->hue[1]);
            u->tells[j] = (float)(((double)o->weight + 1e-12) * (double)(o->share * o->share) *
                                  exp(-450 * (red * red + green * green + red * green)));
            sum += (double)u->tells[j];
        }
        for (size_t j = first; j < first + UNBAKE__NEAR; j++)
            u->tells[j] = sum > 0 ? (float)((double)u->tells[j] / sum) : 1.f / UNBAKE__NEAR;
    }
}

/* Albedos become means over neighbours. */
static inline void unbake__average_task(void *data, int chunk) {
    const unbake__state *u = (const unbake__state *)data;
    for (int i = chunk * UNBAKE__CHUNK; i < u->count && i / UNBAKE__CHUNK == chunk; i++) {
        float sum[3] = {0, 0, 0};
        for (size_t j = (size_t)i * UNBAKE__NEAR; j < ((size_t)i + 1) * UNBAKE__NEAR; j++)
            for (size_t c = 0; c < 3; c++)
                sum[c] += u->tells[j] * u->albedo[3 * (size_t)u->neighbours[j] + c];
        memcpy(u->averaged + 3 * (size_t)i, sum, sizeof sum);
    }
}

static inline int unbake__compare(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

/* What all but few Gaussians are below, by surface: their share of the sky, or their albedo's brightest
   channel. Writes over `averaged`. */
static inline double unbake__most(const unbake__state *u, int of_albedo) {
    float *pairs = u->averaged;
    double all = 0, sum = 0;
    int at = 0;
    for (int i = 0; i < u->count; i++) { /* a value and how much surface has it */
        const unbake__splat *s = u->splat + i;
        const float *a = u->albedo + 3 * (size_t)i, *pair = pairs + 2 * (size_t)i;
        const float most = a[0] > a[1] ? a[0] > a[2] ? a[0] : a[2] : a[1] > a[2] ? a[1] : a[2];
        pairs[2 * (size_t)i] = of_albedo ? most : s->share;
        pairs[2 * (size_t)i + 1] = s->share > 0 ? s->weight * s->share : 0;
        all += (double)pair[1];
    }
    qsort(pairs, (size_t)u->count, 2 * sizeof *pairs, unbake__compare);
    while (at < u->count - 1 && sum < UNBAKE__MOST * all) sum += (double)pairs[2 * (size_t)at++ + 1];
    return u->count ? (double)pairs[2 * (size_t)at] : 0;
}

static inline ssdgs_result unbake__find(unbake__state *u, ssdgs_context *context) {
    const int chunks = (u->count + UNBAKE__CHUNK - 1) / UNBAKE__CHUNK;
    for (int k = 0; k < UNBAKE__SKY; k++) { /* on a spiral around the sphere */
        const double z = 1 - (2 * k + 1.0) / UNBAKE__SKY, across = sqrt(1 - z * z), turn = 2.39996323 * k;
        u->sky[k][0] = across * cos(turn);
        u->sky[k][1] = across * sin(turn);
        u->sky[k][2] = z;
    }
    u->sky_count = u->options->eye_count ? u->options->eye_count : UNBAKE__SKY;
    for (int i = 0; i < 3 * u->options->eye_count; i++)
        u->sky[i / 3][i % 3] = (double)u->options->eyes[i / 3][i % 3];
    ssdgs_result result = unbake__look(u, context);
    if (!result) result = unbake__read(u);
    if (result) return result;
    memset(u->used, 1, sizeof u->used);
    if (!u->options->eye_count) unbake__stand(u);
    result = ssdgs_context_run(context, chunks, unbake__side_task, u);
    u->most = unbake__most(u, 0);
    if (!(u->most > 0)) u->most = 1;
    if (!result) result = ssdgs_context_run(context, chunks, unbake__albedo_task, u);
    for (int i = 0; i < u->count; i++) u->tree[i] = (uint32_t)i;
    unbake__cut(u, 0, u->count);
    if (!result) result = ssdgs_context_run(context, chunks, unbake__near_task, u);
    for (int round = 0; round < UNBAKE__ROUNDS && !result; round++) {
        result = ssdgs_context_run(context, chunks, unbake__average_task, u);
        float *last = u->albedo;
        u->albedo = u->averaged;
        u->averaged = last;
    }
    return result;
}

/* Its colours, as files have them. Linear ones are encoded, to first order in how they change with the view.
 */
static inline void unbake__keep(const unbake__state *u, ssdgs_model *model) {
    const ssdgs_model_view from = ssdgs_model_peek(u->plain), to = ssdgs_model_arrays(model);
    const size_t rest = ((size_t)from.channels - SSDGS_HARMONICS) / 3, count = (size_t)u->count;
    const double unit = 0.28209479177387814;
    for (size_t c = 0; c < (size_t)to.channels - SSDGS_CHANNELS; c++)
        memcpy(to.gaussians + (SSDGS_CHANNELS + c) * to.stride,
               from.gaussians + (SSDGS_DIFFUSE + c) * from.stride, count * sizeof *to.gaussians);
    if (ssdgs_model_settings(u->plain)->transfer != SSDGS_TRANSFER_SRGB) return;
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 3; c++) {
            ssdgs_real *dc = to.gaussians + (SSDGS_CHANNELS + c) * to.stride + i;
            const double linear = 0.5 + unit * (double)*dc,
                         stored = (double)ssdgs_srgb_encode((ssdgs_real)linear),
                         above = (double)ssdgs_srgb_encode((ssdgs_real)(linear + 1e-3));
            for (size_t j = 0; j < rest; j++)
                dc[(3 - c + c * rest + j) * to.stride] *= (ssdgs_real)((above - stored) / 1e-3);
            *dc = (ssdgs_real)((stored - 0.5) / unit);
        }
}

/* The model: its Gaussians are the splat's, bit for bit. */
static inline ssdgs_result unbake__make(unbake__state *u, ssdgs_context *context, ssdgs_model **out) {
    const unbake_options *o = u->options;
    const ssdgs_settings *plain = ssdgs_model_settings(u->plain);
    const double white = unbake__most(u, 1);
    ssdgs_settings settings = ssdgs_settings_default();
    int translucent = 0;
    for (int c = 0; c < 3; c++) translucent |= o->scattering[c] > 0;
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM | (translucent ? SSDGS_SCATTERING_TERM : 0) |
                     (o->roughness > 0 ? SSDGS_SPECULAR_TERM : 0);
    settings.scattering.layers = settings.shadow.layers = 0;
    settings.transport = translucent;
    memcpy(settings.medium.scattering, o->scattering, sizeof o->scattering);
    memcpy(settings.medium.absorption, o->absorption, sizeof o->absorption);
    settings.kept = o->kept;
    settings.harmonics = o->kept > 0 ? plain->harmonics : 0;
    settings.pixel_variance = plain->pixel_variance;
    settings.placement = plain->placement;
    memcpy(settings.origin, plain->origin, sizeof plain->origin);
    for (int c = 0; c < 3; c++) settings.centre[c] = (u->low[c] + u->high[c]) / 2;
    settings.length_unit = u->size > 0 ? (ssdgs_real)(u->size / 2) : 1;
    ssdgs_result result = ssdgs_model_create(context, &settings, u->count, out);
    ssdgs_gaussian g = ssdgs_gaussian_default();
    g.softness = (ssdgs_real)0.2; /* sharp shadows, smoothed a little where depths are not sure */
    if (o->roughness > 0 && !result) {
        const ssdgs_real both[2] = {o->roughness, o->roughness};
        result = ssdgs_gaussian_mirror(*out, both, &g);
        g.f0 = o->f0;
    }
    for (int i = 0; i < u->count && !result; i++) {
        for (int c = 0; c < 3; c++) {
            double albedo = (double)u->albedo[3 * (size_t)i + (size_t)c];
            albedo = albedo < white ? albedo : white;
            if (!u->told && white > 0) albedo *= 0.9 / white;
            g.normal[c] = (ssdgs_real)u->splat[i].normal[c];
            g.diffuse[c] = (ssdgs_real)(translucent ? albedo / 2 : albedo);
            g.scattering[c] = translucent ? g.diffuse[c] : 0;
        }
        result = ssdgs_model_set(*out, i, &g);
        if (result)
            return unbake__refuse(context, result, "its colours and options.ambient make an albedo of ",
                                  (double)u->albedo[3 * (size_t)i]);
    }
    if (!result) unbake__copy(u, *out);
    if (!result && o->kept > 0) unbake__keep(u, *out);
    return result;
}

static inline int unbake__within(double x, double low, double high) {
    return ssdgs_finite((ssdgs_real)x) && x >= low && x <= high;
}

/* Looks at the options, and whether the light is told. What is left goes into settings, which are looked at
   there. */
static inline ssdgs_result unbake__check(unbake__state *u, ssdgs_context *context) {
    const unbake_options *o = u->options;
    const double rough = (double)o->roughness, f0 = (double)o->f0;
    const char *what = NULL;
    double number = 0;
    if (o->eye_count < 0 || o->eye_count > UNBAKE__SKY)
        what = "eye_count is not 0 .. 32: ", number = o->eye_count;
    else if (o->eye_count && !o->eyes) what = "eyes is NULL, eye_count ", number = o->eye_count;
    else if (!unbake__within(rough, 0, 0) && !unbake__within(rough, 0.01, 1))
        what = "roughness is neither 0 nor 0.01 .. 1: ", number = rough;
    else if (!unbake__within(f0, 0, 1) || f0 <= 0) what = "f0 is not above 0, up to 1: ", number = f0;
    for (int i = 0; i < 6 && !what; i++) {
        number = (double)(i < 3 ? o->scattering : o->absorption)[i % 3];
        if (!unbake__within(number, 0, 1e18)) what = "scattering or absorption is not 0 .. 1e18: ";
    }
    for (int i = 0; i < 3 * o->eye_count && !what; i++)
        if (!unbake__within((double)o->eyes[i / 3][i % 3], -1e18, 1e18))
            what = "a place of eyes is not finite or too far: ", number = (double)o->eyes[i / 3][i % 3];
    for (int i = 0; i < 27 && !what; i++) {
        const double light = (double)o->ambient[i / 3][i % 3];
        u->told |= light < 0 || light > 0;
        if (!unbake__within(light, i < 3 ? 0 : -1e18, 1e18))
            what = "ambient is not finite, or its mean is negative: ", number = light;
    }
    return what ? unbake__refuse(context, SSDGS_ERR_ARGUMENT, what, number) : SSDGS_OK;
}

/* Makes *lit, a model that takes light, of a plain splat (settings.baked), which stays, on the same context.
   Its own light is gone but for what options.kept says. options NULL = default. The same bits on any number
   of threads. ERR_ARGUMENT: plain is not baked, or an option is out of range. ERR_MEMORY. Where it fails,
   *lit becomes NULL; the context's message says why. */
static inline ssdgs_result unbake_model(ssdgs_context *context, ssdgs_model *plain,
                                        const unbake_options *options, ssdgs_model **lit) {
    const unbake_options none = unbake_options_default();
    unbake__state u;
    if (lit) *lit = NULL;
    if (!context) return SSDGS_ERR_ARGUMENT;
    if (!lit || !plain || !ssdgs_model_settings(plain)->baked)
        return ssdgs_context_fail(context, SSDGS_ERR_ARGUMENT,
                                  !lit     ? "unbake_model: lit is NULL"
                                  : !plain ? "unbake_model: plain is NULL"
                                           : "unbake_model: plain is not baked, it takes light as it is");
    memset(&u, 0, sizeof u);
    u.options = options ? options : &none;
    const ssdgs_result wrong = unbake__check(&u, context);
    if (wrong) return wrong;
    u.plain = plain;
    u.count = ssdgs_model_count(plain);
    const size_t n = (size_t)u.count + 1; /* none is no failure */
    u.seen = (unsigned char *)calloc(n, UNBAKE__SKY);
    u.splat = (unbake__splat *)calloc(n, sizeof *u.splat);
    u.tree = (uint32_t *)calloc(n, sizeof *u.tree);
    u.neighbours = (uint32_t *)calloc(n, UNBAKE__NEAR * sizeof *u.neighbours);
    u.tells = (float *)calloc(n, UNBAKE__NEAR * sizeof *u.tells);
    u.across = (unsigned char *)calloc(n, 1);
    u.albedo = (float *)calloc(n, 3 * sizeof *u.albedo);
    u.averaged = (float *)calloc(n, 3 * sizeof *u.averaged);
    ssdgs_result result =
        u.seen && u.splat && u.tree && u.neighbours && u.tells && u.across && u.albedo && u.averaged
            ? ssdgs_model_bounds(plain, u.low, u.high)
            : ssdgs_context_fail(context, SSDGS_ERR_MEMORY, "unbake_model: out of memory");
    for (int c = 0; c < 3 && !result; c++) u.size = fmax(u.size, (double)(u.high[c] - u.low[c]));
    if (u.size > 1e15)
        result = unbake__refuse(context, SSDGS_ERR_ARGUMENT,
                                "it reaches over more than 1e15, does a Gaussian stray? ", u.size);
    if (!result) result = unbake__find(&u, context);
    if (!result) result = unbake__make(&u, context, lit);
    free(u.seen), free(u.splat), free(u.tree), free(u.neighbours), free(u.tells), free(u.across);
    free(u.albedo), free(u.averaged);
    if (result) {
        ssdgs_model_destroy(*lit);
        *lit = NULL;
    }
    return result;
}
#endif
