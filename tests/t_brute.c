/* Both passes against every pixel x every Gaussian, sorted, no tiles, in double and from the formulas alone;
   also as real64. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

enum { MOST = 256, SIDE = 40, PIXELS = 96 * 96, DOUBLE = sizeof(ssdgs_real) == 8 };
#define PI 3.14159265358979324

typedef struct scene {
    int count, light_count;
    ssdgs_settings settings;
    ssdgs_render_options options;
    ssdgs_camera camera;
    ssdgs_light lights[2];
    ssdgs_real raw[SSDGS_CHANNELS][MOST], basis[SSDGS_ASG_COUNT * 4], sharpness[SSDGS_ASG_COUNT * 2],
        sigma[SSDGS_ASG_COUNT];
} scene;

typedef struct planes {
    ssdgs_real color[PIXELS * 3], alpha[PIXELS], depth[PIXELS];
} planes;

static ssdgs_context
    *contexts[SSDGS_ISA_COUNT][2]; /* with one thread and with three; NULL where the CPU lacks it */
static scene s;
static planes image[2];

/* ---- scenes ---- */

static uint64_t key, drawn;

static double uniform(double low, double high) { return low + (high - low) * ssdgs__uniform(key, drawn++); }
static int integer(int low, int high) { return (int)floor(uniform(low, high + 1)); }

static void unit_vector(double v[3]) {
    const double z = uniform(-1, 1), turn = uniform(0, 2 * PI), r = sqrt(1 - z * z);
    v[0] = r * cos(turn), v[1] = r * sin(turn), v[2] = z;
}

static void random_camera(double distance, int width, int height) {
    double from[3];
    unit_vector(from);
    double to[3];
    for (int c = 0; c < 3; c++) to[c] = uniform(-1, 1);
    ssdgs_real eye[3], target[3], up[3];
    for (int c = 0; c < 3; c++) {
        eye[c] = (ssdgs_real)(distance * from[c]);
        target[c] = (ssdgs_real)(0.2 * to[c]);
        up[c] = (ssdgs_real)uniform(-1, 1);
    }
    s.camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)uniform(0.3, 1.2), width, height);
}

static void random_light(ssdgs_light *light, double distance) {
    double from[3];
    unit_vector(from);
    memset(light, 0, sizeof *light);
    for (int c = 0; c < 3; c++) {
        light->position[c] = (ssdgs_real)(distance * from[c]);
        light->intensity[c] = (ssdgs_real)(uniform(0.5, 1.5) * distance * distance);
    }
}

/* count Gaussians in [-0.5, 0.5]^3, scales from .. to; networks off. */
static void random_scene(uint64_t seed, int count, double from, double to) {
    key = seed, drawn = 0;
    memset(&s, 0, sizeof s);
    s.count = count;
    s.settings = ssdgs_settings_default();
    s.settings.depth_cue = 1;
    s.settings.scattering.layers = 2, s.settings.scattering.width = 1, s.settings.shadow.layers = 0;
    s.settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
    s.options = ssdgs_render_options_exact();
    for (size_t i = 0; i < (size_t)count; i++) {
        for (size_t c = 0; c < SSDGS_CHANNELS; c++) s.raw[c][i] = (ssdgs_real)uniform(-2, 1);
        for (size_t c = 0; c < 4; c++) s.raw[SSDGS_ROTATION + c][i] = (ssdgs_real)uniform(-1, 1);
        for (size_t c = 0; c < 4; c++) s.raw[SSDGS_FRAME + c][i] = (ssdgs_real)uniform(-1, 1);
        for (size_t c = 0; c < 3; c++) s.raw[SSDGS_POSITION + c][i] = (ssdgs_real)uniform(-0.5, 0.5);
        for (size_t c = 0; c < 3; c++)
            s.raw[SSDGS_LOG_SCALE + c][i] = (ssdgs_real)uniform(log(from), log(to));
        s.raw[SSDGS_OPACITY][i] = (ssdgs_real)uniform(-4, 7);
    }
    for (size_t i = 0; i < SSDGS_ASG_COUNT * 4; i++) s.basis[i] = (ssdgs_real)uniform(-1, 1);
    for (size_t i = 0; i < SSDGS_ASG_COUNT * 2; i++) s.sharpness[i] = (ssdgs_real)uniform(-1, 3);
    for (size_t i = 0; i < SSDGS_ASG_COUNT; i++) s.sigma[i] = (ssdgs_real)uniform(-1, 2);
    s.light_count = 1;
    random_light(s.lights, 2);
    random_camera(2, SIDE, SIDE);
}

static ssdgs_model *make_model(ssdgs_context *context) {
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, &s.settings, s.count, &model))) exit(1);
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t c = 0; c < (size_t)v.channels; c++)
        memcpy(v.gaussians + c * v.stride, s.raw[c], (size_t)s.count * sizeof(ssdgs_real));
    memcpy(v.asg_basis, s.basis, sizeof s.basis);
    memcpy(v.asg_sharpness, s.sharpness, sizeof s.sharpness);
    memcpy(v.asg_sigma, s.sigma, sizeof s.sigma);
    for (size_t i = 0; i < v.shadow_count; i++) v.shadow[i] += (ssdgs_real)(0.2 * ssdgs__uniform(5, i) - 0.1);
    return model;
}

static void render(ssdgs_context *context, planes *to) {
    ssdgs_model *model = make_model(context);
    ssdgs_image out;
    memset(&out, 0, sizeof out);
    out.color = to->color, out.alpha = to->alpha, out.depth = to->depth;
    if (!CHECK(!ssdgs_render_ex(model, &s.camera, s.lights, s.light_count, &s.options, &out, NULL)))
        printf("    %s\n", ssdgs_error_message(context));
    ssdgs_model_destroy(model);
}

/* ---- the oracle ---- */

typedef struct gaussian {
    double x[3], axes[9], scale[3], opacity, diffuse[3], specular[3], frame[9], weight[SSDGS_ASG_COUNT];
    double sharp[2], f0, soft; /* deferred */
} gaussian;

typedef struct lens {
    double fx, fy, cx, cy, view[12], near_plane, variance, distance;
    int width, height, orthographic, by_distance, floor, compensate;
} lens;

/* A Gaussian's colour; deferred, what pixels blend instead, of two lights. V: its visibility. */
enum { COLOR = 0, Q = 3, F0 = 12, SOFT = 13, V = 14, N = 16, M = 19, D = 25, VALUES = 31 };
typedef struct shaded {
    double value[VALUES];
    int sure;
} shaded;

typedef struct splat {
    double x, y, a, b, c, opacity, depth;
    int index;
} splat; /* centre, conic */

static gaussian all[MOST];
static lens faces[6]; /* of the first light's map */
static int face_count;

static double sigmoid(double x) { return 1 / (1 + exp(-x)); }
static double softplus(double x) { return log(1 + exp(x)); }
static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void normalise(double v[3]) {
    const double length = sqrt(dot(v, v));
    for (int i = 0; i < 3; i++) v[i] /= length;
}

/* Rows of r: the images of the axes are its columns. */
static void rotation(double w, double x, double y, double z, double r[9]) {
    const double k = 2 / (w * w + x * x + y * y + z * z);
    r[0] = 1 - k * (y * y + z * z), r[1] = k * (x * y - w * z), r[2] = k * (x * z + w * y);
    r[3] = k * (x * y + w * z), r[4] = 1 - k * (x * x + z * z), r[5] = k * (y * z - w * x);
    r[6] = k * (x * z - w * y), r[7] = k * (y * z + w * x), r[8] = 1 - k * (x * x + y * y);
}

static void read_gaussians(void) {
    for (int i = 0; i < s.count; i++) {
        gaussian *g = all + i;
#define RAW(channel) ((double)s.raw[channel][i])
        for (int c = 0; c < 3; c++) {
            g->x[c] = RAW(SSDGS_POSITION + c);
            g->scale[c] = exp(RAW(SSDGS_LOG_SCALE + c));
            g->diffuse[c] = softplus(RAW(SSDGS_DIFFUSE + c));
            g->specular[c] = softplus(RAW(SSDGS_SPECULAR + c));
        }
        for (int c = 0; c < SSDGS_ASG_COUNT; c++) g->weight[c] = softplus(RAW(SSDGS_ASG_WEIGHT + c));
        for (int c = 0; c < 2; c++) g->sharp[c] = exp(RAW(SSDGS_ASG_WEIGHT + c));
        g->f0 = sigmoid(RAW(SSDGS_ASG_WEIGHT + 2) + log(0.04 / 0.96));
        g->soft = sigmoid(RAW(SSDGS_ASG_WEIGHT + 3));
        g->opacity = sigmoid(RAW(SSDGS_OPACITY));
        rotation(RAW(SSDGS_ROTATION), RAW(SSDGS_ROTATION + 1), RAW(SSDGS_ROTATION + 2),
                 RAW(SSDGS_ROTATION + 3), g->axes);
        rotation(RAW(SSDGS_FRAME), RAW(SSDGS_FRAME + 1), RAW(SSDGS_FRAME + 2), RAW(SSDGS_FRAME + 3),
                 g->frame);
#undef RAW
    }
}

static lens camera_lens(void) {
    lens l;
    memset(&l, 0, sizeof l);
    l.fx = (double)s.camera.fx, l.fy = (double)s.camera.fy, l.cx = (double)s.camera.cx,
    l.cy = (double)s.camera.cy;
    for (int i = 0; i < 12; i++) l.view[i] = (double)s.camera.view[i];
    l.near_plane = s.camera.near_plane > 0 ? (double)s.camera.near_plane : 0.01;
    l.variance = (double)s.settings.pixel_variance;
    l.width = s.camera.width, l.height = s.camera.height;
    l.compensate = s.options.antialias;
    return l;
}

/* The library's choice of a light's camera; check_light_camera() judges it. */
static lens light_lens(const ssdgs_splat_view *v) {
    lens l;
    memset(&l, 0, sizeof l);
    l.fx = (double)v->fx, l.fy = (double)v->fy, l.cx = (double)v->cx, l.cy = (double)v->cy;
    for (int i = 0; i < 12; i++) l.view[i] = (double)v->view[i];
    l.near_plane = (double)v->near_plane;
    l.distance = (double)v->distance;
    l.width = v->width, l.height = v->height;
    l.orthographic = v->orthographic;
    l.by_distance = !v->orthographic; /* to a point light, distances of centres; to a far one, depths */
    l.floor = l.compensate = s.settings.light_map.blur == SSDGS_BLUR_FLOOR;
    l.variance = l.floor ? 0.2 : 0.3;
    return l;
}

static void to_view(const lens *l, const double x[3], double t[3]) {
    for (int i = 0; i < 3; i++) t[i] = dot(l->view + 4 * i, x) + l->view[4 * i + 3];
}

/* What is left of opacity near the eye, and of what reaches far back along z beside the picture, but not
   within 45 degrees of the axis: cos^4 of the angles in x and y, relative to the border's. */
static double fade(const lens *l, const double t[3], double back) {
    double kept = 1;
    for (int i = 0; i < 2; i++) {
        const double focal = i ? l->fy : l->fx, centre = i ? l->cy : l->cx, side = i ? l->height : l->width;
        const double low = fmin(-1, -centre / focal), high = fmax(1, (side - centre) / focal);
        const double angle = atan2(t[i], t[2]), edge = fmax(atan(low), fmin(atan(high), angle));
        kept *= pow(cos(angle) / cos(edge), 4);
    }
    const double deep = fmax(0, fmin(1, (back - 0.02) / 0.04));
    return fmin(1, t[2] / l->near_plane - 1) * (1 - deep + deep * kept);
}

/* Eq. 1's projection by full matrices: J W Sigma W^T J^T. 0: not drawn. */
static int project(const lens *l, const gaussian *g, splat *out) {
    double t[3];
    to_view(l, g->x, t);
    if (!(t[2] > l->near_plane)) return 0;
    double sigma[9];
    int i, k;
    for (i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (k = 0, sigma[3 * i + j] = 0; k < 3; k++)
                sigma[3 * i + j] += g->axes[3 * i + k] * g->scale[k] * g->scale[k] * g->axes[3 * j + k];
    double w[6];
    for (int j = 0; j < 3; j++) {
        w[j] = l->orthographic ? l->fx * l->view[j]
                               : l->fx / t[2] * l->view[j] - l->fx * t[0] / (t[2] * t[2]) * l->view[8 + j];
        w[3 + j] = l->orthographic
                       ? l->fy * l->view[4 + j]
                       : l->fy / t[2] * l->view[4 + j] - l->fy * t[1] / (t[2] * t[2]) * l->view[8 + j];
    }
    double cov[3];
    for (int m = 0; m < 3; m++) /* xx, xy, yy */
        for (i = 0, cov[m] = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) cov[m] += w[(m > 1) * 3 + i] * sigma[3 * i + j] * w[(m > 0) * 3 + j];
    const double det0 = cov[0] * cov[2] - cov[1] * cov[1];
    double h = l->variance;
    if (l->floor)
        h -= 0.5 * (cov[0] + cov[2]) - sqrt(0.25 * (cov[0] - cov[2]) * (cov[0] - cov[2]) + cov[1] * cov[1]);
    h = h > 0 ? h : 0;
    const double det = (cov[0] + h) * (cov[2] + h) - cov[1] * cov[1];
    out->a = (cov[2] + h) / det, out->b = -cov[1] / det, out->c = (cov[0] + h) / det;
    out->opacity = g->opacity * (l->compensate ? sqrt(det0 / det) : 1);
    double back = 0; /* variance along z / depth^2 */
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) back += l->view[8 + i] * sigma[3 * i + k] * l->view[8 + k] / (t[2] * t[2]);
    if (!l->orthographic) out->opacity *= fade(l, t, back);
    out->x = l->fx * t[0] / (l->orthographic ? 1 : t[2]) + l->cx;
    out->y = l->fy * t[1] / (l->orthographic ? 1 : t[2]) + l->cy;
    out->depth = l->by_distance ? sqrt(dot(t, t)) : t[2];
    return 1;
}

static int nearer(const void *a, const void *b) {
    const double x = ((const splat *)a)->depth, y = ((const splat *)b)->depth;
    return (x > y) - (x < y);
}

static int project_all(const lens *l, splat *out) {
    int n = 0;
    for (int i = 0; i < s.count; i++)
        if (project(l, all + i, out + n)) out[n++].index = i;
    qsort(out, (size_t)n, sizeof *out, nearer);
    return n;
}

static double response(const splat *p, double x, double y) {
    const double dx = x - p->x, dy = y - p->y, q = p->a * dx * dx + 2 * p->b * dx * dy + p->c * dy * dy;
    return q < 50 ? p->opacity * exp(-0.5 * q) : 0;
}

static void camera_centre(double eye[3]) {
    for (int i = 0; i < 3; i++)
        eye[i] = -((double)s.camera.view[i] * (double)s.camera.view[3] +
                   (double)s.camera.view[4 + i] * (double)s.camera.view[7] +
                   (double)s.camera.view[8 + i] * (double)s.camera.view[11]);
}

/* Eqs. 3, 9 to 12 without scattering; visibility: S per light and Gaussian, NULL = 1. Not sure where wi + wo
   nearly cancels, so float knows no half vector. */
static void shade(const gaussian *g, int index, const double *visibility, shaded *out) {
    double eye[3], *color = out->value + COLOR;
    camera_centre(eye);
    double wo[3];
    for (int i = 0; i < 3; i++) wo[i] = eye[i] - g->x[i], color[i] = 0;
    normalise(wo);
    out->sure = 1;
    out->value[F0] = g->f0;
    out->value[SOFT] = g->soft;
    for (int i = 0; i < 3; i++) out->value[N + i] = g->frame[3 * i + 2];
    int j;
    for (int i = 0; i < 9; i++)
        for (j = 0, out->value[Q + i] = 0; j < 2; j++)
            out->value[Q + i] += g->sharp[j] * g->frame[i / 3 * 3 + j] * g->frame[i % 3 * 3 + j];
    for (int light = 0; light < s.light_count; light++) {
        const ssdgs_light *lamp = s.lights + light;
        const int directional = lamp->kind == SSDGS_LIGHT_DIRECTIONAL;
        const double n[3] = {g->frame[2], g->frame[5], g->frame[8]};
        double wi[3], d = 0;
        for (int i = 0; i < 3; i++)
            wi[i] = directional ? -(double)lamp->direction[i] : (double)lamp->position[i] - g->x[i];
        double falloff = directional ? 1 : 1 / dot(wi, wi);
        normalise(wi);
        double h[3];
        for (int i = 0; i < 3; i++) h[i] = wi[i] + wo[i];
        if (dot(h, h) < 0.01) out->sure = 0;
        normalise(h);
        double local[3];
        for (int i = 0; i < 3; i++)
            local[i] = g->frame[i] * h[0] + g->frame[3 + i] * h[1] + g->frame[6 + i] * h[2];
        for (j = 0; j < SSDGS_ASG_COUNT; j++) {
            const ssdgs_real *q = s.basis + 4 * j, *sharp = s.sharpness + 2 * j;
            double r[9];
            rotation((double)q[0], (double)q[1], (double)q[2], (double)q[3], r);
            double p[3];
            for (int i = 0; i < 3; i++) p[i] = r[i] * local[0] + r[3 + i] * local[1] + r[6 + i] * local[2];
            d += g->weight[j] *
                 exp(-exp((double)sharp[0]) * p[0] * p[0] - exp((double)sharp[1]) * p[1] * p[1]);
        }
        const double fresnel = 0.04 + 0.96 * pow(1 - dot(wo, h), 5);
        const double diffuse = dot(n, wi) > 0 ? dot(n, wi) / PI : 0;
        falloff *= (double)s.settings.light_scale;
        out->value[V + light] = visibility ? visibility[light * s.count + index] : 1;
        for (int i = 0; i < 3; i++) {
            const double arrives = falloff * (double)lamp->intensity[i];
            color[i] +=
                (g->diffuse[i] * diffuse + g->specular[i] * fresnel * d) * arrives * out->value[V + light];
            out->value[M + 3 * light + i] = g->specular[i] * sqrt(g->sharp[0] * g->sharp[1]) * arrives;
            out->value[D + 3 * light + i] = g->diffuse[i] * diffuse * arrives;
            if (s.settings.asg == SSDGS_ASG_DEFERRED) color[i] = 0;
        }
    }
}

/* Transmittance to a distance along the ray of a map's pixel, of which the falls below three levels are
   known, all of these a little higher or lower: from the light bias before a fall on it goes straight to what
   there was just before it. */
static double passed(const splat *p, int n, int x, int y, double distance, double higher) {
    static const double level[3] = {0.98, 0.5, 0.1};
    const double thick = ((double)s.settings.light_map.bias + 1e-5) * (double)s.settings.length_unit;
    double t = 1, fall[3], before[3], left[3];
    int falls = 0;
    for (int k = 0; k < n; k++) {
        const double raw = response(p + k, x + 0.5, y + 0.5), above = t;
        if (raw < (double)s.options.alpha_threshold) continue;
        t *= 1 - (raw < 0.999 ? raw : 0.999);
        for (; falls < 3 && t < level[falls] * higher; falls++)
            fall[falls] = p[k].depth, before[falls] = above, left[falls] = t;
    }
    int k;
    for (k = 0; k < falls && distance > fall[k]; k++) {}
    if (!k) return 1;
    if (k == 3) return t;
    if (k == falls) return left[k - 1];
    const double since = distance - fmax(fall[k] - thick, fall[k - 1]);
    return since <= 0 ? left[k - 1]
                      : left[k - 1] + (before[k] - left[k - 1]) * since / (since + fall[k] - distance);
}

/* Visibility of a place from the first light. 0 where the last bits of float decide what is in the way. */
static int look(const double at[3], double *visibility) {
    static splat p[MOST];
    for (int f = 0; f < face_count; f++) {
        const lens *l = faces + f;
        double t[3], sum[4] = {0, 0, 0, 0};
        to_view(l, at, t);
        double x = l->fx * t[0] / (l->orthographic ? 1 : t[2]) + l->cx,
               y = l->fy * t[1] / (l->orthographic ? 1 : t[2]) + l->cy;
        if (!(t[2] > l->near_plane) || x < 0 || y < 0 || x > l->width || y > l->height) continue;
        const int n = project_all(l, p);
        const double distance = (l->by_distance ? sqrt(dot(t, t)) : t[2]) * (1 - 1e-6) -
                                ((double)s.settings.light_map.bias + 1e-5) * (double)s.settings.length_unit;
        x = fmin(fmax(x - 0.5, 0), l->width - 1), y = fmin(fmax(y - 0.5, 0), l->height - 1);
        const int column = x < l->width - 1 ? (int)x : l->width - 2,
                  row = y < l->height - 1 ? (int)y : l->height - 2;
        x -= column, y -= row;
        for (int i = 0; i < 4; i++) {
            const double weight = (i % 2 ? x : 1 - x) * (i / 2 ? y : 1 - y);
            const int u = column + i % 2, w = row + i / 2;
            *visibility = sum[0] += weight * passed(p, n, u, w, distance, 1);
            sum[1] += weight * passed(p, n, u, w, distance * (1 + 2e-6), 1);
            sum[2] += weight * passed(p, n, u, w, distance, 1 + 2e-6);
            sum[3] += weight * passed(p, n, u, w, distance, 1 - 2e-6);
        }
        return fabs(sum[1] - sum[0]) < 2e-5 && fabs(sum[2] - sum[0]) < 2e-5 && fabs(sum[3] - sum[0]) < 2e-5;
    }
    return -1;
}

/* Adds the diffuse and specular terms of a pixel whose Gaussians blend to b, at a depth; out[5]: what an
   error of the normal is multiplied by. 0: not sure. */
static int highlight(const double b[VALUES], double depth, double x, double y, double out[6]) {
    const double at[3] = {(x - (double)s.camera.cx) / (double)s.camera.fx,
                          (y - (double)s.camera.cy) / (double)s.camera.fy, 1};
    double eye[3];
    int sure = 1;
    camera_centre(eye);
    double ray[3], place[3], wo[3];
    for (int i = 0; i < 3; i++) {
        ray[i] = (double)s.camera.view[i] * at[0] + (double)s.camera.view[4 + i] * at[1] +
                 (double)s.camera.view[8 + i];
        place[i] = eye[i] + depth * ray[i];
        wo[i] = -ray[i];
    }
    normalise(wo);
    for (int light = 0; light < s.light_count; light++) {
        const ssdgs_light *lamp = s.lights + light;
        double q[2] = {0, 0}, sum = 0, visible = 1, arrives = 1;
        if (s.settings.terms & SSDGS_SHADOW_TERM) {
            const int known = look(place, &visible);
            sure &= known;
            arrives = known < 0 ? b[V + light] : visible + b[SOFT] * (b[V + light] - visible);
        }
        double wi[3];
        for (int i = 0; i < 3; i++)
            wi[i] = lamp->kind == SSDGS_LIGHT_DIRECTIONAL ? -(double)lamp->direction[i]
                                                          : (double)lamp->position[i] - place[i];
        normalise(wi);
        double h[3];
        for (int i = 0; i < 3; i++) h[i] = wi[i] + wo[i];
        if (dot(h, h) < 0.01) sure = 0;
        normalise(h);
        double n[3];
        for (int i = 0; i < 3; i++) n[i] = b[N + i];
        normalise(n);
        double p[3];
        for (int i = 0; i < 3; i++) p[i] = h[i] - n[i] * dot(n, h);
        for (int i = 0; i < 9; i++)
            q[0] += p[i / 3] * b[Q + i] * p[i % 3], q[1] += h[i / 3] * b[Q + i] * h[i % 3];
        for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
            const double part = sigmoid((double)s.sharpness[2 * j + 1]);
            sum += softplus((double)s.sigma[j]) *
                   exp(-exp((double)s.sharpness[2 * j]) * ((1 - part) * q[0] + part * q[1]));
        }
        const double woh = dot(wo, h);
        const double fresnel = b[F0] + (1 - b[F0]) * pow(1 - woh, 5);
        const double microfacet =
            dot(n, wi) > 0 && dot(b + N, b + N) >= 1e-12 ? dot(n, wi) / (woh > 0.25 ? woh * woh : 0.0625) : 0;
        for (int i = 0; i < 3 && microfacet > 0; i++) {
            const double steep = b[M + 3 * light + i] * fresnel * sum / (woh > 0.25 ? woh * woh : 0.0625) /
                                 sqrt(dot(b + N, b + N));
            out[5] = fmax(out[5], steep);
        }
        for (int i = 0; i < 3; i++)
            out[i] += ((microfacet > 0 ? b[M + 3 * light + i] * microfacet * fresnel * sum : 0) +
                       b[D + 3 * light + i]) *
                      arrives;
    }
    return sure;
}

/* Eq. 1 at a pixel: red, green, blue, alpha, depth. 0 where the last bit of float decides what is drawn. */
static int blend(const splat *p, int n, double x, double y, const shaded *of, double out[6]) {
    const double threshold =
        (double)s.options.alpha_threshold > 1e-9 ? (double)s.options.alpha_threshold : 1e-9;
    const double stop = (double)s.options.stop;
    double t = 1, last = -1, sum[VALUES];
    int sure = 1;
    memset(sum, 0, sizeof sum);
    for (int c = 0; c < 6; c++) out[c] = 0;
    for (int k = 0; k < n; k++) {
        const double raw = response(p + k, x, y), alpha = raw < 0.999 ? raw : 0.999;
        if (threshold > 1e-4 && fabs(raw - threshold) < 1e-5) sure = 0;
        if (raw < threshold) continue;
        if (fabs(t - stop) < 0.02 * stop) sure = 0;
        if (t < stop) break;
        if (p[k].depth - last < 1e-6 * p[k].depth) sure = 0; /* in one order or the other */
        sure = sure && of[p[k].index].sure;
        last = p[k].depth;
        for (int c = 0; c < VALUES; c++) sum[c] += t * alpha * of[p[k].index].value[c];
        out[4] += t * alpha * p[k].depth;
        t *= 1 - alpha;
    }
    for (int c = 0; c < 3; c++) out[c] = sum[COLOR + c] + t * (double)s.options.background[c];
    out[3] = 1 - t;
    if (s.settings.asg == SSDGS_ASG_DEFERRED && t < 1) {
        for (int c = Q; c < N; c++) sum[c] /= 1 - t;
        sure &= highlight(sum, out[4] / (1 - t), x, y, out);
    }
    return sure;
}

/* ---- 1. the camera pass ---- */

typedef struct errors {
    double most, sum, count;
    int unsure, pixels;
} errors;

static void count_error(errors *e, double error) {
    e->most = error <= e->most ? e->most : error; /* NaN is the most */
    e->sum += error, e->count++;
}

/* What a colour's error is told by: of deferred highlights above 1, bright where seen nearly against the
   light, the colour, or how steep they are. */
static double scale_of(double color, double steep) {
    return s.settings.asg == SSDGS_ASG_DEFERRED ? fmax(1, fmax(fabs(color), steep)) : 1;
}

static void compare(const planes *got, double (*want)[6], const unsigned char *sure, int pixels, errors *e) {
    for (int i = 0; i < pixels; i++)
        for (int c = 0; sure[i] && c < 5; c++) {
            const double value = (double)(c < 3   ? got->color[3 * i + c]
                                          : c < 4 ? got->alpha[i]
                                                  : got->depth[i]);
            count_error(e, fabs(value - want[i][c]) / (c < 3 ? scale_of(want[i][c], want[i][5]) : 1));
        }
}

static void oracle_image(const double *visibility, double (*want)[6], unsigned char *sure) {
    static splat p[MOST];
    static shaded of[MOST];
    const lens l = camera_lens();
    const int n = project_all(&l, p);
    for (int i = 0; i < n; i++) shade(all + p[i].index, p[i].index, visibility, of + p[i].index);
    for (int i = 0; i < l.width * l.height; i++)
        sure[i] = (unsigned char)blend(p, n, i % l.width + 0.5, i / l.width + 0.5, of, want[i]);
}

static void camera_scene(int index) {
    random_scene((uint64_t)index, 200, 0.01, 0.2);
    s.count = index % 10 == 5 ? integer(100, 200) : integer(1, 60); /* tiles are walked 64 at a time */
    const int width = integer(16, 40),
              height = integer(16, 40); /* one after the other: compilers differ in the order of arguments */
    random_camera(uniform(0.9, 3), width, height);
    s.camera.fy = (ssdgs_real)((double)s.camera.fx * (index % 4 == 1 ? uniform(0.25, 4) : 1));
    if (index % 4 == 2) {
        s.camera.cx += (ssdgs_real)uniform(-30, 30);
        s.camera.cy += (ssdgs_real)uniform(-30, 30);
    }
    if (index % 4 == 3) s.camera.near_plane = (ssdgs_real)uniform(0.5, 2.5); /* through the scene */
    s.settings.asg = index % 3 ? SSDGS_ASG_DEFERRED : SSDGS_ASG_GEOMETRIC;
    if (index % 5 == 1) s.options.antialias = 1;
    if (index % 7 == 1) s.options.alpha_threshold = 0;
    if (index % 11 == 1) s.options.stop = 0;
    if (index % 13 == 1) s.settings.pixel_variance = (ssdgs_real)0.3;
    s.settings.light_scale = (ssdgs_real)uniform(0.5, 2);
    for (int c = 0; c < 3; c++) s.options.background[c] = (ssdgs_real)uniform(0, 1);
    s.light_count = integer(0, 2);
    random_light(s.lights, 1);
    random_light(s.lights + 1, uniform(0.8, 3));
    TEST_PARALLEL(s.lights[0]);
}

static void test_camera(int scenes) {
    static double want[PIXELS][6];
    static unsigned char sure[PIXELS];
    errors e[SSDGS_ISA_COUNT][2]; /* of specular terms per Gaussian, deferred */
    double most[2] = {0, 0}, sum = 0, count = 0;
    int unsure = 0, pixels = 0;
    memset(e, 0, sizeof e);
    s.options = ssdgs_render_options_exact(); /* the oracle takes these from them */
    CHECK(fabs((double)s.options.alpha_threshold * 255 - 1) < 1e-6 &&
          fabs((double)s.options.stop * 1e4 - 1) < 1e-6);
    for (int index = 0; index < scenes; index++) {
        camera_scene(index);
        read_gaussians();
        oracle_image(NULL, want, sure);
        pixels += s.camera.width * s.camera.height;
        for (int i = 0; i < s.camera.width * s.camera.height; i++) unsure += !sure[i];
        for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
            if (!contexts[isa][0]) continue;
            render(contexts[isa][0], image);
            compare(image, want, sure, s.camera.width * s.camera.height,
                    e[isa] + (s.settings.asg == SSDGS_ASG_DEFERRED));
            if (index % 4 == isa % 4) { /* every kind of scene for some instruction set */
                const size_t size = (size_t)(s.camera.width * s.camera.height) * sizeof(ssdgs_real);
                render(contexts[isa][1], image + 1);
                CHECK(!memcmp(image[0].color, image[1].color, 3 * size) &&
                      !memcmp(image[0].alpha, image[1].alpha, size) &&
                      !memcmp(image[0].depth, image[1].depth, size));
            }
        }
    }
    for (int isa = 0; isa < SSDGS_ISA_COUNT; isa++)
        for (int i = 0; i < 2 && contexts[isa][0]; i++) {
            printf("%s%s: at most %.3g, on average %.3g\n", ssdgs_isa_string((ssdgs_isa)isa),
                   i ? ", deferred" : "", e[isa][i].most, e[isa][i].sum / e[isa][i].count);
            most[i] = e[isa][i].most > most[i] ? e[isa][i].most : most[i];
            sum += e[isa][i].sum, count += e[isa][i].count;
        }
    printf("%d of %d pixels left out\n", unsure, pixels);
    CHECK(unsure < 0.01 * pixels && count > 0);
    CHECK(most[0] < (DOUBLE ? 1e-12 : 2.5e-5) && most[1] < (DOUBLE ? 1e-12 : 2.5e-5) &&
          sum / count < (DOUBLE ? 1e-15 : 1e-7)); /* some roundings */
    if (!DOUBLE)
        printf("figure bruteforce_max_abs %.3g\nfigure bruteforce_max_abs_deferred %.3g\nfigure "
               "bruteforce_mean_abs %.3g\n",
               most[0], most[1], sum / count);
}

/* ---- 2. the light pass ---- */

static ssdgs_context *best(void) {
    int i;
    for (i = SSDGS_ISA_COUNT - 1; !contexts[i][0]; i--) {}
    return contexts[i][0];
}

/* The light's views and what the walk finds through them; the frame's arrays live as long as the model. */
static ssdgs_frame light_frame(ssdgs_model *model) {
    ssdgs_frame frame;
    if (!CHECK(!ssdgs__frame_of_model(&frame, model, &s.camera, s.lights, s.light_count, &s.options, 0, 0)) ||
        !CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK)))
        exit(1);
    return frame;
}

/* Every centre lies on a face, a perspective face looks from the light, and its rows are orthonormal. */
static void check_light_camera(void) {
    int on = 0;
    for (int f = 0; f < face_count; f++) {
        double position[3];
        for (int i = 0; i < 3; i++) position[i] = (double)s.lights[0].position[i];
        double t[3];
        to_view(faces + f, position, t);
        for (int i = 0; i < 3; i++) {
            CHECK(faces[f].orthographic || fabs(t[i]) < 2e-6 * (1 + sqrt(dot(position, position))));
            CHECK(fabs(dot(faces[f].view + 4 * i, faces[f].view + 4 * (i > 0 ? i - 1 : 2))) < 1e-6);
            CHECK(fabs(dot(faces[f].view + 4 * i, faces[f].view + 4 * i) - 1) < 1e-6);
        }
    }
    for (int g = 0; g < s.count; g++)
        for (int f = 0; f < face_count; f++) {
            splat p;
            if (project(faces + f, all + g, &p) && p.x >= 0 && p.y >= 0 && p.x <= faces[f].width &&
                p.y <= faces[f].height) {
                on++;
                break;
            }
        }
    CHECK(on == s.count);
}

typedef struct light_truth {
    double v[MOST], cue[MOST], flux[MOST];
    unsigned char doubt[MOST];
} light_truth;

/* Eqs. 6, 7, depth cue and flux, over all pixels of all faces. rho carries the splat's opacity, which cancels
   on one face; over several it makes each count by its mass, blurred more or less as it is there. */
static void oracle_light(light_truth *out) {
    static splat p[MOST];
    static double raw[MOST], rho[MOST], v[MOST], cue[MOST];
    const double threshold = (double)s.options.alpha_threshold;
    const double bias = (double)s.settings.light_map.bias * (double)s.settings.length_unit;
    memset(out, 0, sizeof *out);
    for (int g = 0; g < s.count; g++) rho[g] = v[g] = cue[g] = 0;
    for (int f = 0; f < face_count; f++) {
        const lens *l = faces + f;
        const int n = project_all(l, p);
        for (int i = 0; i < l->width * l->height; i++) {
            const double x = i % l->width + 0.5, y = i / l->width + 0.5, u = (x - l->cx) / l->fx,
                         w = (y - l->cy) / l->fy;
            const double solid = l->orthographic ? pow(l->fx * l->distance, -2)
                                                 : pow(1 + u * u + w * w, -1.5) / (l->fx * l->fy);
            double beam = 1;
            for (int k = 0; k < n; k++) {
                raw[k] = response(p + k, x, y);
                if (fabs(raw[k] - threshold) < 1e-4 * threshold)
                    for (int g = 0; g < n; g++)
                        if (response(p + g, x, y) > 0.9 * threshold) out->doubt[p[g].index] = 1;
                raw[k] = raw[k] < threshold ? 0 : raw[k];
                out->flux[p[k].index] += solid * beam * (raw[k] < 0.999 ? raw[k] : 0.999);
                beam *= 1 - (raw[k] < 0.999 ? raw[k] : 0.999);
            }
            for (int g = 0; g < n; g++) {
                double t = 1, depth = 0;
                if (raw[g] <= 0) continue;
                for (int k = 0; k < n; k++) {
                    const double ahead = p[g].depth - bias - p[k].depth,
                                 alpha = raw[k] < 0.999 ? raw[k] : 0.999;
                    if (k != g && raw[k] > 0 && fabs(ahead) < 3e-6 * p[g].depth) out->doubt[p[g].index] = 1;
                    if (k == g || raw[k] <= 0 || ahead <= 0) continue;
                    depth += t * alpha * (p[g].depth - p[k].depth);
                    t *= 1 - alpha;
                }
                rho[p[g].index] += raw[g];
                v[p[g].index] += raw[g] * t;
                cue[p[g].index] += raw[g] * depth;
            }
        }
    }
    for (int g = 0; g < s.count; g++) {
        out->v[g] = rho[g] > 0 ? v[g] / rho[g] : 1;
        out->cue[g] = rho[g] > 0 ? cue[g] / rho[g] : 0;
    }
}

typedef struct light_case {
    const char *name;
    int kind;
    double distance, bias;
    int faces, map;
} light_case;
static const light_case light_cases[] = {
    {"outside", SSDGS_LIGHT_POINT, 3, 0, 1, 64},    {"outside, bias", SSDGS_LIGHT_POINT, 3, 0.3, 1, 64},
    {"far", SSDGS_LIGHT_POINT, 3e4, 0.1, 1, 48},    {"directional", SSDGS_LIGHT_DIRECTIONAL, 1, 0.1, 1, 64},
    {"close", SSDGS_LIGHT_POINT, 0.9, 0.05, 6, 32}, {"inside", SSDGS_LIGHT_POINT, 0.2, 0, 6, 32}};

static void test_light(int rounds) {
    static double want[PIXELS][6];
    static unsigned char sure[PIXELS];
    static light_truth truth;
    errors v;
    const int cases = (int)(sizeof light_cases / sizeof *light_cases);
    int doubtful = 0, total = 0;
    memset(&v, 0, sizeof v);
    errors cue, flux, colors;
    cue = flux = colors = v;
    for (int index = 0; index < rounds * 2 * cases; index++) {
        const light_case *c = light_cases + index / 2 % cases;
        int known = 0;
        random_scene(1000000 + (uint64_t)index, 200, 0.01, 0.1);
        s.count = index % 8 == 5 ? 200 : integer(2, 40); /* tiles are walked 64 at a time */
        for (int i = 0; i < 6; i++)
            s.raw[SSDGS_POSITION + i / 2][i % 2] = (ssdgs_real)(i % 2 - 0.5); /* always as large a scene */
        for (int i = 0; i < s.count; i++) s.raw[SSDGS_OPACITY][i] += 2;
        read_gaussians();
        random_light(s.lights, c->distance);
        if (c->kind == SSDGS_LIGHT_DIRECTIONAL) TEST_PARALLEL(s.lights[0]);
        s.settings.light_map.blur = index % 2 ? SSDGS_BLUR_ADD : SSDGS_BLUR_FLOOR;
        s.settings.light_map.bias = (ssdgs_real)c->bias;
        s.settings.light_map.size = c->map;
        for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
            if (!contexts[isa][0]) continue;
            s.settings.terms = SSDGS_ALL_TERMS;
            s.settings.transport = 1; /* for the flux */
            ssdgs_model *model = make_model(contexts[isa][index % 3 == 0]);
            ssdgs_frame frame = light_frame(model);
            if (!CHECK(frame.view_count == 1 + c->faces)) exit(1);
            if (!known) {
                face_count = c->faces;
                for (int i = 0; i < c->faces; i++) faces[i] = light_lens(frame.views + 1 + i);
                check_light_camera();
                oracle_light(&truth);
                oracle_image(truth.v, want, sure);
                known = 1;
                total += s.count;
                for (int i = 0; i < s.count; i++) doubtful += truth.doubt[i];
            }
            for (int i = 0; i < s.count; i++) {
                if (truth.doubt[i]) continue;
                count_error(&v, fabs((double)frame.visibility[i] - truth.v[i]));
                count_error(&cue, fabs((double)frame.depth_cue[i] - truth.cue[i]));
                if (truth.flux[i] > 1e-9) count_error(&flux, fabs((double)frame.flux[i] / truth.flux[i] - 1));
            }
            ssdgs_model_destroy(model);
            int i;
            for (i = 0; i < s.count && !truth.doubt[i]; i++) {}
            if (i < s.count || index % 2) continue;
            s.settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM | SSDGS_SHADOW_TERM;
            s.settings.transport = 0;
            render(contexts[isa][0], image);
            compare(image, want, sure, s.camera.width * s.camera.height, &colors);
            for (i = 0; i < s.camera.width * s.camera.height; i++) colors.unsure += !sure[i];
            colors.pixels += s.camera.width * s.camera.height;
        }
    }
    printf("light: v at most %.3g, cue %.3g, flux %.3g; %d of %d left out; shadowed image %.3g, on average "
           "%.3g, %d of %d left out\n",
           v.most, cue.most, flux.most, doubtful, total, colors.most, colors.sum / colors.count,
           colors.unsure, colors.pixels);
    CHECK(doubtful < 0.05 * total && v.count > 0 && colors.unsure < 0.05 * colors.pixels && colors.count > 0);
    CHECK(v.most < (DOUBLE ? 1e-12 : 1e-5) && cue.most < (DOUBLE ? 1e-12 : 1e-5));
    CHECK(flux.most < (DOUBLE ? 1e-12 : 1.5e-5) && colors.most < (DOUBLE ? 1e-12 : 2.5e-5));
    if (!DOUBLE) printf("figure visibility_max_abs %.3g\nfigure flux_max_rel %.3g\n", v.most, flux.most);
}

/* Deep in an opaque heap the walk ends: visibility and flux are off by what the stop leaves, at most. */
static void test_dark(void) {
    static const double stops[3] = {0, 1e-4, 0.3};
    static light_truth truth;
    double lost[3] = {0, 0, 0};
    int dark[3] = {0, 0, 0}, off = 0, faint = 0;
    for (int index = 0; index < 12; index++) {
        const light_case *c = light_cases + (index % 2 ? 4 : 1);
        random_scene(2000000 + (uint64_t)index, MOST, 0.1, 0.2);
        for (int i = 0; i < s.count; i++) s.raw[SSDGS_OPACITY][i] += 5;
        read_gaussians();
        random_light(s.lights, c->distance);
        s.settings.light_map.bias = (ssdgs_real)c->bias;
        s.settings.light_map.size = c->map;
        s.settings.terms = SSDGS_ALL_TERMS;
        s.settings.transport = 1;
        for (int k = 0; k < 3; k++) {
            s.options.stop = (ssdgs_real)stops[k];
            ssdgs_model *model = make_model(best());
            ssdgs_frame frame = light_frame(model);
            if (!k) {
                face_count = c->faces;
                for (int i = 0; i < c->faces; i++) faces[i] = light_lens(frame.views + 1 + i);
                oracle_light(&truth);
            }
            double flux = 0, all_flux = 0;
            for (int i = 0; i < s.count; i++) {
                all_flux += truth.flux[i];
                if (truth.doubt[i]) continue;
                const double v = (double)frame.visibility[i] - truth.v[i];
                off += !(fabs(v) < stops[k] + 1e-5);
                faint += truth.flux[i] > 0 && truth.v[i] < 1e-6;
                dark[k] += truth.flux[i] > 0 && !(frame.flux[i] > 0);
                flux += truth.flux[i] - (double)frame.flux[i];
            }
            lost[k] = flux / all_flux > lost[k] ? flux / all_flux : lost[k];
            ssdgs_model_destroy(model);
        }
    }
    printf("in the dark: %d of %d and %d not walked, %.2g, %.2g, %.2g of the flux lost\n", dark[1], faint / 3,
           dark[2], lost[0], lost[1], lost[2]);
    CHECK(!off && !dark[0] && dark[1] > faint / 12 && dark[2] > dark[1]);
    CHECK(lost[0] < 1e-5 && lost[1] < 1e-4 + 1e-5 && lost[2] > 1e-3 && lost[2] < 0.3);
}

/* Largest response of g along the ray from `eye`. */
static double ray_response(const gaussian *g, const double eye[3], const double direction[3],
                           double farthest) {
    double o[3], d[3];
    int j;
    for (int i = 0; i < 3; i++)
        for (j = 0, o[i] = d[i] = 0; j < 3; j++) {
            o[i] += g->axes[3 * j + i] * (eye[j] - g->x[j]) / g->scale[i];
            d[i] += g->axes[3 * j + i] * direction[j] / g->scale[i];
        }
    if (dot(o, d) >= 0) return 0; /* behind */
    double cross[3];
    for (int i = 0; i < 3; i++) cross[i] = o[(i + 1) % 3] * d[(i + 2) % 3] - o[(i + 2) % 3] * d[(i + 1) % 3];
    const double d2 = dot(cross, cross) / dot(d, d);
    return d2 < farthest ? g->opacity * exp(-0.5 * d2) : 0;
}

/* Eq. 7 without a map: exact rays through a grid over each footprint. */
static void trace_visibility(const lens *light, double *v) {
    enum { GRID = 15 }; /* the least alpha, 1/255, is at 11.1 at most */
    static splat p[MOST];
    lens sharp = *light;
    sharp.variance = 0;
    const int n = project_all(&sharp, p);
    double eye[3];
    for (int i = 0; i < 3; i++) eye[i] = (double)s.lights[0].position[i];
    for (int g = 0; g < n; g++) {
        const double bias = (double)s.settings.light_map.bias * (double)s.settings.length_unit;
        const double det = p[g].a * p[g].c - p[g].b * p[g].b, xx = p[g].c / det, xy = -p[g].b / det,
                     yy = p[g].a / det;
        const double lx = sqrt(xx), ly = xy / lx, lyy = sqrt(yy - ly * ly),
                     reach = sqrt(2 * log(255 * p[g].opacity) + 1e-9);
        double sum = 0, rho = 0;
        for (int i = 0; p[g].opacity > 1.0 / 255 && i < GRID * GRID; i++) {
            const double a = reach * ((2 * (i % GRID) + 1.0) / GRID - 1),
                         b = reach * ((2 * (i / GRID) + 1.0) / GRID - 1);
            const double u = (p[g].x + lx * a - light->cx) / light->fx,
                         w = (p[g].y + ly * a + lyy * b - light->cy) / light->fy;
            double direction[3], t = 1;
            for (int j = 0; j < 3; j++)
                direction[j] = u * light->view[j] + w * light->view[4 + j] + light->view[8 + j];
            const double weight = ray_response(all + p[g].index, eye, direction, 12);
            if (weight < 1.0 / 255) continue;
            for (int k = 0; k < n && p[k].depth < p[g].depth - bias; k++) {
                const double alpha = ray_response(all + p[k].index, eye, direction, 12);
                if (alpha >= 1.0 / 255) t *= 1 - (alpha < 0.999 ? alpha : 0.999);
            }
            sum += weight * t, rho += weight;
        }
        v[p[g].index] = rho > 0 ? sum / rho : 1;
    }
}

/* What map size and blur cost, against rays (stability.md 3.5): mean error of v. */
static double shadow_error(int range, int count, int blur, int map, double bias) {
    static const double from[3] = {0.01, 0.005, 0.002}, to[3] = {0.15, 0.05, 0.01};
    static double truth[MOST];
    static int traced = -1;
    const int wanted = 3 * (bias > 0) + range;
    double sum = 0;
    random_scene(2000000 + (uint64_t)range, count, from[range], to[range]);
    read_gaussians();
    random_light(s.lights, 2.5);
    s.settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    s.settings.light_map.bias = (ssdgs_real)bias;
    s.settings.light_map.size = map;
    s.settings.light_map.blur = blur;
    ssdgs_model *model = make_model(best());
    ssdgs_frame frame = light_frame(model);
    lens light = light_lens(frame.views + 1);
    if (traced != wanted) trace_visibility(&light, truth), traced = wanted;
    for (int i = 0; i < s.count; i++) sum += fabs((double)frame.visibility[i] - truth[i]) / s.count;
    ssdgs_model_destroy(model);
    return sum;
}

static void test_shadow_error(int count) {
    static const char *const names[3] = {"_large", "", "_small"};
    static const double default_most[3] = {
        0.012, 0.005, 0.0005}; /* what the affine projection leaves of the large ones stays */
    for (int range = 0; range < 3; range++) {
        const ssdgs_settings d = ssdgs_settings_default();
        const double error =
            shadow_error(range, count, d.light_map.blur, d.light_map.size, (double)d.light_map.bias);
        CHECK(error < default_most[range]);
        if (!DOUBLE) printf("figure shadow_mean_abs_default%s %.5f\n", names[range], error);
        double add[4], floored[4];
        for (int m = 0; m < 4; m++) {
            add[m] = shadow_error(range, count, SSDGS_BLUR_ADD, 64 << m, 0);
            floored[m] = shadow_error(range, count, SSDGS_BLUR_FLOOR, 64 << m, 0);
            if (!DOUBLE) printf("figure shadow_mean_abs_add_%d%s %.5f\n", 64 << m, names[range], add[m]);
            if (!DOUBLE)
                printf("figure shadow_mean_abs_floor_%d%s %.5f\n", 64 << m, names[range], floored[m]);
        }
        CHECK(4 * floored[0] < add[0] && 3 * floored[1] < add[1] && floored[1] < add[2] &&
              floored[2] < add[3]);
        for (int m = 1; m < 4; m++) CHECK(add[m] < 0.8 * add[m - 1] && floored[m] < 1.1 * floored[m - 1]);
    }
}

/* ---- 3. what holds without an oracle ---- */

/* Everything on, networks included. */
static void full_scene(uint64_t seed, int width, int height) {
    random_scene(seed, 200, 0.02, 0.1);
    s.settings = ssdgs_settings_default();
    s.settings.scattering.width = 16;
    s.settings.light_map.size = 64;
    s.options.background[1] = (ssdgs_real)0.4;
    s.camera.width = width, s.camera.height = height;
    s.camera.cx = (ssdgs_real)(0.5 * width), s.camera.cy = (ssdgs_real)(0.5 * height);
    random_light(s.lights, 3);
}

/* Blend weights and the last transmittance make 1. */
static void test_unity(void) {
    double most = 0;
    int dense = 0;
    full_scene(3000000, 93, 61);
    s.settings.baked = 1;
    for (int c = 0; c < 3; c++) {
        s.options.background[c] = 1;
        for (int i = 0; i < s.count; i++)
            s.raw[SSDGS_DIFFUSE + c][i] = (ssdgs_real)1.7724538509055159; /* f_dc: 1 */
    }
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        if (!contexts[isa][0]) continue;
        render(contexts[isa][0], image);
        for (int i = 0; i < 93 * 61; i++) {
            dense += image->alpha[i] > (ssdgs_real)0.5;
            for (int c = 0; c < 3; c++) {
                const double error = fabs((double)image->color[3 * i + c] - 1);
                most = error <= most ? most : error;
            }
        }
    }
    CHECK(most < (DOUBLE ? 1e-14 : 1e-6) && dense > 100);
    if (!DOUBLE) printf("figure unity_max_abs %.3g\n", most);
}

static void test_permutation(void) {
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        if (!contexts[isa][0]) continue;
        full_scene(3000001, 93, 61);
        s.settings.transport = 0; /* which gathers from nodes of neighbours in this order */
        render(contexts[isa][0], image);
        for (int i = s.count - 1; i > 0; i--) {
            const int j = integer(0, i);
            for (int c = 0; c < SSDGS_CHANNELS; c++) {
                const ssdgs_real swap = s.raw[c][i];
                s.raw[c][i] = s.raw[c][j], s.raw[c][j] = swap;
            }
        }
        render(contexts[isa][0], image + 1);
        CHECK(!memcmp(image, image + 1, sizeof *image));
    }
}

/* In front of the camera, round, on the axis, which meets the centre of pixel (8, 8). */
static void axis_scene(int count, double logit) {
    random_scene(3000002, count, 0.1, 0.1);
    for (int i = 0; i < count; i++) {
        for (int c = 0; c < 3; c++) s.raw[c][i] = 0;
        s.raw[SSDGS_OPACITY][i] = (ssdgs_real)logit;
    }
    memset(s.camera.view, 0, sizeof s.camera.view);
    s.camera.view[0] = s.camera.view[5] = s.camera.view[10] = 1, s.camera.view[11] = 2;
    s.camera.width = s.camera.height = 17, s.camera.cx = s.camera.cy = (ssdgs_real)8.5;
}

/* One Gaussian is its opacity at its centre; two a hair apart are one of 1 - (1 - o)^2. */
static void test_coincident(void) {
    for (double logit = -4; logit <= 6; logit++) {
        const double o = sigmoid(logit), both = 1 - (1 - o) * (1 - o), tolerance = DOUBLE ? 1e-14 : 4e-7;
        axis_scene(1, logit);
        render(best(), image);
        CHECK(fabs((double)image->alpha[8 * 17 + 8] - o) < tolerance);
        axis_scene(2, logit);
        s.raw[SSDGS_POSITION + 2][1] = (ssdgs_real)4.7683716e-7;
        render(best(), image);
        CHECK(fabs((double)image->alpha[8 * 17 + 8] - both) < tolerance);
        axis_scene(1, log(both / (1 - both)));
        render(best(), image + 1);
        if (both < 0.999)
            CHECK(fabs((double)(image[1].alpha[8 * 17 + 8] - image->alpha[8 * 17 + 8])) < tolerance);
    }
}

static void visibility(double *v) {
    ssdgs_model *model = make_model(best());
    const ssdgs_frame frame = light_frame(model);
    for (int i = 0; i < s.count; i++) v[i] = (double)frame.visibility[i];
    ssdgs_model_destroy(model);
}

/* Beer and Lambert: k wide layers leave (1 - a)^k, those within the bias do not count. */
static void test_layers(void) {
    const double a = 0.3;
    double most = 0;
    for (int blur = 0; blur < 2; blur++)
        for (int bias = 0; bias < 2; bias++)
            for (int layers = 0; layers < 9; layers++) {
                const int met = layers - (bias ? layers < 2 ? layers : 2 : 0);
                axis_scene(1 + layers, log(a / (1 - a)));
                s.settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
                s.settings.light_map.blur = blur;
                s.settings.light_map.bias = (ssdgs_real)(bias ? 0.5 : 0);
                s.settings.light_map.size = 512;
                s.lights[0].position[0] = s.lights[0].position[1] = 0, s.lights[0].position[2] = 1;
                TEST_PARALLEL(s.lights[0]);
                for (int i = 0; i <= layers; i++) {
                    for (int c = 0; c < 4; c++) s.raw[SSDGS_ROTATION + c][i] = c == 0;
                    for (int c = 0; c < 3; c++)
                        s.raw[SSDGS_LOG_SCALE + c][i] = (ssdgs_real)(i == 0  ? log(0.15)
                                                                     : c < 2 ? log(8.0)
                                                                             : -7);
                    s.raw[SSDGS_POSITION + 2][i] = (ssdgs_real)(0.1 * i); /* the bias is 0.25 */
                }
                double v[MOST];
                visibility(v);
                most = fabs(v[0] - pow(1 - a, met)) <= most ? most : fabs(v[0] - pow(1 - a, met));
            }
    CHECK(most < 5e-4); /* the layers are 8 wide, not infinitely */
}

/* Alone, or too faint to be drawn: fully lit. One more in the way never lights any. */
static void test_occluder(void) {
    double most = -1;
    int darker = 0;
    for (int trial = 0; trial < 40; trial++) {
        random_scene(3100000 + (uint64_t)trial, 60, 0.01, 0.1);
        s.settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
        s.settings.light_map.blur = trial % 2 ? SSDGS_BLUR_ADD : SSDGS_BLUR_FLOOR;
        s.settings.light_map.bias = 0;
        s.settings.light_map.size = 64;
        random_light(s.lights, trial % 4 < 2 ? 3 : 0.3);
        for (int i = 0; i < 3; i++)
            s.raw[SSDGS_POSITION + i][0] *= (ssdgs_real)0.5; /* does not stretch what the map must cover */
        s.raw[SSDGS_OPACITY][0] = -20;
        double without[MOST];
        visibility(without);
        CHECK(without[0] >= 1 && without[0] <= 1);
        s.raw[SSDGS_OPACITY][0] = 3;
        double with[MOST];
        visibility(with);
        for (int i = 1; i < s.count; i++) {
            most = with[i] - without[i] <= most ? most : with[i] - without[i];
            darker += with[i] < without[i] - 0.01;
        }
        s.count = 1;
        visibility(with);
        CHECK(with[0] >= 1 && with[0] <= 1);
    }
    CHECK(most <= 1e-6 && darker > 100);
}

/* Light passes freely where its map has no Gaussian, whatever a frame before left there: the place that two
   blend to lies between them. A third one is the nearest to the light. */
static void test_gap(void) {
    for (int dense = 1; dense >= 0; dense--) {
        axis_scene(3, dense ? 8 : 0);
        s.settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
        s.settings.light_map.bias = 0, s.settings.light_map.size = 64;
        for (int c = 0; c < 3; c++) s.lights[0].position[c] = c == 0;
        TEST_PARALLEL(s.lights[0]);
        for (int i = 0; i < 3; i++) {
            for (int c = 0; c < 3; c++) s.raw[SSDGS_LOG_SCALE + c][i] = (ssdgs_real)log(dense ? 0.3 : 0.03);
            s.raw[SSDGS_POSITION][i] = (ssdgs_real)(i == 2 ? 0.3 : 0.1 * dense);
            s.raw[SSDGS_POSITION + 2][i] = (ssdgs_real)(i ? 0.4 : -0.4);
            s.raw[SSDGS_FRAME][i] = s.raw[SSDGS_FRAME + 2][i] = 1; /* faces the light */
            s.raw[SSDGS_ASG_WEIGHT + 3][i] = -40;
        }
        render(best(), image);
    }
    s.settings.terms = SSDGS_DIFFUSE_TERM;
    render(best(), image + 1);
    CHECK((double)image->color[3 * (8 * 17 + 8)] > 0.05);
    CHECK(fabs((double)(image->color[3 * (8 * 17 + 8)] - image[1].color[3 * (8 * 17 + 8)])) < 1e-6);
}

/* What a veil leaves arrives on the floor behind it, all along the gap: also where it is no level of the
   light's map. A veil that takes less than 0.02 casts no shadow. */
static void test_veil(void) {
    enum { ROW = 60, FLOOR = ROW * ROW, PX = 32 };
    static ssdgs_real values[PX * PX * 5];
    const ssdgs_real eye[3] = {(ssdgs_real)0.9, 0, (ssdgs_real)0.25}, target[3] = {0, 0, 0},
                     up[3] = {0, 0, 1};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.5, PX, PX);
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_light light = {
        SSDGS_LIGHT_POINT, {(ssdgs_real)0.01, 0, (ssdgs_real)2.5}, {4, 4, 4}, {0, 0, 0}, {0, 0}, 0, 0, 0, 0};
    ssdgs_image out = {0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    ssdgs_model *model = NULL;
    out.color = values;
    out.alpha = values + 3 * PX * PX;
    out.shadow = values + 4 * PX * PX;
    settings.shadow.layers = 0;
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    if (!CHECK(!ssdgs_model_create(best(), &settings, FLOOR + 1, &model))) exit(1);
    for (int veil = 0; veil < 12; veil++) {
        static const double takes[12] = {0, 0.015, 0.03, 0.07, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.8, 0.9};
        const double taken = takes[veil];
        const ssdgs_model_view v = ssdgs_model_arrays(model);
        for (int i = 0; i <= FLOOR; i++) {
            ssdgs_real *p = v.gaussians + i;
            for (int c = 0; c < 2; c++)
                p[(size_t)c * v.stride] =
                    (ssdgs_real)(i == FLOOR ? 0 : ((c ? i / ROW : i % ROW) + 0.5) / ROW - 0.5);
            p[2 * v.stride] = (ssdgs_real)(i == FLOOR ? 0.4 : 0);
            for (int c = 0; c < 3; c++)
                p[(size_t)(SSDGS_LOG_SCALE + c) * v.stride] = (ssdgs_real)log(c == 2       ? 0.002
                                                                              : i == FLOOR ? 1
                                                                                           : 0.016);
            p[SSDGS_OPACITY * v.stride] = (ssdgs_real)(i < FLOOR   ? 6
                                                       : taken > 0 ? log(taken / (1 - taken))
                                                                   : -20);
            p[(SSDGS_ASG_WEIGHT + 3) * v.stride] = -20; /* hard */
        }
        if (!CHECK(!ssdgs_render_ex(model, &camera, &light, 1, &options, &out, NULL))) exit(1);
        const int i = PX / 2 * PX + PX / 2;
        const double shadow = (double)(out.shadow[i] / out.alpha[i]);
        if (!CHECK(fabs(shadow - (taken < 0.02 ? 1 : 1 - taken)) < 0.005))
            printf("    a veil of %g leaves %g\n", taken, shadow);
    }
    ssdgs_model_destroy(model);
}

/* Without a map, as where a hook walks the lights and makes none, pixels take the visibility of their
   Gaussians. */
static void test_no_map(void) {
    int checked = 0;
    full_scene(3000005, 60, 40);
    ssdgs_model *model = make_model(best());
    ssdgs_frame frame;
    CHECK(!ssdgs__frame_of_model(&frame, model, &s.camera, s.lights, 1, &s.options, 1, 0));
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK));
    for (int i = 1; i < frame.view_count; i++) frame.views[i].light_map = NULL;
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_SHADE, SSDGS_STAGE_COMPOSITE));
    for (int i = 0; i < 60 * 40; i++) {
        const ssdgs_real *of_gaussians = ssdgs__layer_plane(&frame, SSDGS__SHADOW_LAYER, 1) + i;
        const double cover = (double)ssdgs__layer_plane(&frame, SSDGS__DEPTH_LAYER, 2)[i],
                     want = (double)*of_gaussians / cover;
        if (!(cover > 0.1 && want < 0.9)) continue;
        checked++;
        CHECK(fabs((double)frame.pixel_visibility[i] - want) < 1e-6);
    }
    CHECK(checked > 100);
    ssdgs_model_destroy(model);
}

static double largest_difference(int x0, int y0, int width, int height, int whole, double depth_scale,
                                 int spared) {
    double most[3] = {0, 0, 0}; /* of pixels, the largest first */
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double worst = 0;
            for (int c = 0; c < 5; c++) {
                const int a = y * width + x, b = (y + y0) * whole + x + x0;
                const double difference =
                    c < 3   ? (double)(image[1].color[3 * a + c] - image->color[3 * b + c])
                    : c < 4 ? (double)(image[1].alpha[a] - image->alpha[b])
                            : (double)image[1].depth[a] / depth_scale - (double)image->depth[b];
                const double size = c < 3 ? scale_of((double)image->color[3 * b + c], 0) : 1;
                worst = fabs(difference) <= worst * size ? worst : fabs(difference) / size;
            }
            for (int i = 0; i < 3; i++)
                if (!(worst <= most[i])) {
                    const double next = most[i];
                    most[i] = worst, worst = next;
                }
        }
    return most[spared];
}

/* A crop has the bits of the whole where the origin stays; elsewhere cx, cy round differently. */
static void test_crop(void) {
    static const int crops[][4] = {/* from x, y; width, height */
                                   {0, 0, 90, 1},    {0, 0, 1, 70},   {0, 0, 37, 41}, {0, 0, 1, 1},
                                   {16, 16, 48, 32}, {32, 0, 17, 13}, {5, 3, 40, 50}, {77, 69, 1, 1}};
    double most = 0;
    for (size_t i = 0; i < sizeof crops / sizeof *crops; i++) {
        const int *c = crops[i];
        full_scene(3000003, 90, 70);
        s.options.alpha_threshold = 0;
        render(best(), image);
        s.camera.width = c[2], s.camera.height = c[3];
        s.camera.cx -= (ssdgs_real)c[0], s.camera.cy -= (ssdgs_real)c[1];
        render(best(), image + 1);
        const double e = largest_difference(c[0], c[1], c[2], c[3], 90, 1, 0);
        if (c[0] + c[1] == 0) CHECK(e <= 0);
        most = e <= most ? most : e;
    }
    CHECK(most < (DOUBLE ? 1e-14 : 4e-6));
    if (!DOUBLE) printf("figure crop_max_abs %.3g\n", most);
}

/* Everything moved, turned and scaled together looks the same. Networks see absolute directions and light
   maps stand along the axes, so both are off where anything turns. */
static void test_similarity(void) {
    static const struct {
        double scale, turn, move;
    } cases[] = {{1, 0, 0.7}, {1e-6, 0, 0}, {1e-3, 0, 2e-4}, {31, 0, 5},
                 {1e6, 0, 0}, {1, 1, 0},    {1, 2.5, 0.3},   {0.01, 4, 0}};
    double most = 0;
    for (size_t n = 0; n < sizeof cases / sizeof *cases; n++) {
        const double k = cases[n].scale, half = 0.5 * cases[n].turn;
        const double w = cos(half), x = 0.6 * sin(half), y = -0.48 * sin(half), z = 0.64 * sin(half);
        const double move[3] = {cases[n].move, -0.5 * cases[n].move, 0.25 * cases[n].move};
        full_scene(3000004 + n, 70, 50);
        s.options.alpha_threshold = s.options.stop = 0;
        s.settings.light_map.size = 0;
        s.light_count = 2;
        random_light(s.lights + 1, 1);
        TEST_PARALLEL(s.lights[1]);
        s.options.terms = cases[n].turn > 0 ? SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM : SSDGS_ALL_TERMS;
        render(best(), image);
        double r[9];
        rotation(w, x, y, z, r);
        int c;
#define MOVED(out, in, by, how) \
    do { \
        double from_[3]; \
        for (c = 0; c < 3; c++) from_[c] = (double)(in); \
        for (c = 0; c < 3; c++) (out) = (ssdgs_real)((by)*dot(r + 3 * c, from_) + (how)*move[c]); \
    } while (0)
        for (int i = 0; i < s.count; i++) {
            MOVED(s.raw[SSDGS_POSITION + c][i], s.raw[SSDGS_POSITION + c][i], k, 1);
            for (c = 0; c < 3; c++)
                s.raw[SSDGS_LOG_SCALE + c][i] = (ssdgs_real)((double)s.raw[SSDGS_LOG_SCALE + c][i] + log(k));
            for (int j = SSDGS_ROTATION; j <= SSDGS_FRAME; j += SSDGS_FRAME - SSDGS_ROTATION) {
                const double a = (double)s.raw[j][i], b = (double)s.raw[j + 1][i];
                const double d = (double)s.raw[j + 2][i], f = (double)s.raw[j + 3][i];
                s.raw[j][i] = (ssdgs_real)(w * a - x * b - y * d - z * f);
                s.raw[j + 1][i] = (ssdgs_real)(w * b + x * a + y * f - z * d);
                s.raw[j + 2][i] = (ssdgs_real)(w * d - x * f + y * a + z * b);
                s.raw[j + 3][i] = (ssdgs_real)(w * f + x * d - y * b + z * a);
            }
        }
        MOVED(s.lights[0].position[c], s.lights[0].position[c], k, 1);
        MOVED(s.lights[1].direction[c], s.lights[1].direction[c], 1, 0);
        MOVED(s.settings.centre[c], s.settings.centre[c], k, 1);
        for (c = 0; c < 3; c++) s.lights[0].intensity[c] *= (ssdgs_real)(k * k);
        s.settings.length_unit = (ssdgs_real)((double)s.settings.length_unit * k);
        s.camera.near_plane = (ssdgs_real)(0.01 * k);
        for (int i = 0; i < 3; i++) {
            ssdgs_real *row = s.camera.view + 4 * i;
            MOVED(row[c], row[c], 1, 0);
            double axis[3];
            for (c = 0; c < 3; c++) axis[c] = (double)row[c];
            row[3] = (ssdgs_real)(k * (double)row[3] - dot(axis, move));
        }
        render(best(), image + 1);
        const double e = largest_difference(0, 0, 70, 50, 70, k,
                                            DOUBLE ? 0 : 2); /* places near a map's jumps may change sides */
        if (!CHECK(e < (DOUBLE ? 3e-13 : 5e-5)))
            printf("    scale %g, turn %g, move %g: %.3g\n", k, cases[n].turn, cases[n].move, e);
        most = e <= most ? most : e;
    }
    if (!DOUBLE) printf("figure similarity_max_abs %.3g\n", most);
}

/* ---- 4. projection ---- */

/* L1 error of the affine projection of a round Gaussian of size sigma at distance 1, `degrees` off the
   axis. */
static double projection_error(double sigma, double degrees) {
    enum { GRID = 160 };
    const double angle = degrees * PI / 180, eye[3] = {0, 0, 0};
    double sum = 0, whole = 0;
    gaussian g;
    memset(&g, 0, sizeof g);
    lens l;
    memset(&l, 0, sizeof l);
    for (int c = 0; c < 3; c++) g.axes[4 * c] = 1, g.scale[c] = sigma, l.view[5 * c] = 1;
    g.opacity = 1;
    g.x[0] = sin(angle), g.x[2] = cos(angle);
    l.fx = l.fy = 1;
    splat p;
    CHECK(project(&l, &g, &p));
    p.opacity = g.opacity; /* nothing fades here */
    for (int i = 0; i < GRID * GRID; i++) {
        const double x = p.x + 8 / sqrt(p.a) * ((2 * (i % GRID) + 1.0) / GRID - 1);
        const double y = p.y + 8 / sqrt(p.c) * ((2 * (i / GRID) + 1.0) / GRID - 1);
        const double direction[3] = {x, y, 1}, exact = ray_response(&g, eye, direction, 50);
        sum += fabs(response(&p, x, y) - exact), whole += exact;
    }
    return sum / whole;
}

/* The oracle's own projection, which the camera pass is held to, against rays: the published table
   (stability.md 3.4). */
static void test_projection(void) {
    static const double sigmas[6] = {0.005, 0.02, 0.05, 0.1, 0.2, 0.3};
    static const double published[6][5] = {
        {0.0001, 0.0032, 0.0069, 0.012, 0.021}, {0.0016, 0.013, 0.028, 0.048, 0.083},
        {0.010, 0.033, 0.070, 0.12, 0.21},      {0.041, 0.073, 0.15, 0.25, 0.43},
        {0.18, 0.21, 0.35, 0.54, 0.76},         {0.44, 0.47, 0.59, 0.74, 0.88}};
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 5; j++) {
            const double error = projection_error(sigmas[i], 15 * j);
            CHECK(fabs(error - published[i][j]) < 0.15 * published[i][j]);
            if (!DOUBLE) printf("figure ewa_l1_sigma%03.0f_at%02d %.4g\n", 1000 * sigmas[i], 15 * j, error);
        }
}

/* One Gaussian per turn about the axis, sigma by sigma / aspect px, on the axis at distance 1. */
enum { TURNS = 96, FOCAL = 1000, SCREEN = 1024 };
static ssdgs_real turned[SSDGS_CHANNELS][TURNS];

static int fill_turned(double sigma, double aspect, int step) {
    memset(turned, 0, sizeof turned);
    int n;
    for (n = 0; n * step <= 90; n++) {
        turned[SSDGS_POSITION + 2][n] = 1;
        turned[SSDGS_ROTATION][n] = (ssdgs_real)cos(n * step * PI / 360);
        turned[SSDGS_ROTATION + 3][n] = (ssdgs_real)sin(n * step * PI / 360);
        for (int c = 0; c < 3; c++)
            turned[SSDGS_LOG_SCALE + c][n] = (ssdgs_real)log(sigma / FOCAL / (c ? aspect : 1));
        turned[SSDGS_OPACITY][n] = 2;
    }
    return n;
}

/* ux, uy, wy of a record; the determinant has no difference in it. */
static void true_factor(int n, double variance, long double factor[3]) {
    const long double log0 = (long double)turned[SSDGS_LOG_SCALE][n],
                      log1 = (long double)turned[SSDGS_LOG_SCALE + 1][n];
    const long double s0 = expl(log0) * FOCAL, s1 = expl(log1) * FOCAL, h = (long double)variance;
    const long double w = (long double)turned[SSDGS_ROTATION][n],
                      z = (long double)turned[SSDGS_ROTATION + 3][n];
    const long double co = (w * w - z * z) / (w * w + z * z), si = 2 * w * z / (w * w + z * z);
    const long double xy = (s0 * s0 - s1 * s1) * si * co, yy = s0 * s0 * si * si + s1 * s1 * co * co + h;
    const long double det = s0 * s0 * s1 * s1 + h * (s0 * s0 + s1 * s1) + h * h,
                      k = 0.72134752044448170368L; /* log2(e) / 2 */
    factor[0] = sqrtl(k * yy / det);
    factor[1] = -factor[0] * xy / yy;
    factor[2] = sqrtl(k / yy);
}

/* Records of giants and needles against long double, and what the exponents at pixel centres are off by where
   the Gaussian is seen: first of those up to 10 : 1, then of needles. One too large for a determinant is not
   drawn. */
static void test_conic(int step) {
    static ssdgs_record record[TURNS];
    static ssdgs_real depth[TURNS];
    double worst = 0, off[2] = {0, 0};
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++)
        for (int size = 1; size <= 6 && ssdgs__table(isa); size++)
            for (int aspect = 0; aspect <= 6; aspect++) {
                ssdgs__projection p;
                memset(&p, 0, sizeof p);
                p.view[0] = p.view[5] = p.view[10] = 1;
                p.fx = p.fy = FOCAL, p.cx = p.cy = SCREEN / 2, p.near_plane = (ssdgs_real)0.01;
                p.log2_threshold = -8, p.width = p.height = SCREEN, p.variance = (ssdgs_real)0.1;
                p.depth_scale = p.presence = 1;
                int n = fill_turned(pow(10, size), pow(10, aspect), step);
                ssdgs__table(isa)->project(&p, turned[0], TURNS, 0, (size_t)(n + 15) / 16 * 16, record, depth,
                                           NULL);
                while (n--) {
                    const ssdgs_record *r = record + n;
                    const double got[3] = {(double)r->ux, (double)r->uy, (double)r->wy};
                    CHECK(depth[n] > 0);
                    long double want[3];
                    true_factor(n, (double)p.variance, want);
                    for (int c = 0; c < 3; c++) {
                        const double size_of_it = (double)(c == 1 ? want[0] + fabsl(want[1]) : want[c]);
                        worst = test_most(worst, fabs(got[c] - (double)want[c]) / size_of_it);
                    }
                    for (int y = 0; y < SCREEN; y += 37)
                        for (int x = 0; x < SCREEN; x++) {
                            const ssdgs_real dx = (ssdgs_real)(x + 0.5) - r->x,
                                             dy = (ssdgs_real)(y + 0.5) - r->y;
                            const ssdgs_real u = r->ux * dx + r->uy * dy, w = r->wy * dy;
                            const long double true_u = want[0] * (long double)dx + want[1] * (long double)dy,
                                              true_w = want[2] * (long double)dy;
                            const double exponent = (double)(true_u * true_u + true_w * true_w);
                            if (exponent > 8) continue;
                            off[aspect > 1] =
                                test_most(off[aspect > 1], fabs((double)(u * u + w * w) - exponent));
                        }
                }
            }
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        ssdgs__projection p;
        memset(&p, 0, sizeof p);
        p.view[0] = p.view[5] = p.view[10] = 1;
        p.fx = p.fy = FOCAL, p.log2_threshold = (ssdgs_real)-7.994353437, p.width = p.height = SCREEN;
        p.variance = (ssdgs_real)0.1, p.depth_scale = p.presence = 1, p.orthographic = 1;
        if (!ssdgs__table(isa)) continue;
        fill_turned(1e10, 1, 90);
        for (int i = 0; i < 16; i++) /* hardly above the threshold: a box of no size */
            turned[SSDGS_OPACITY][i] = (ssdgs_real)(1e-5 - log(254.0));
        ssdgs__table(isa)->project(&p, turned[0], TURNS, 0, 16, record, depth, NULL);
        CHECK(depth[0] < 0);
    }
    printf("conic: %.3g, exponent %.3g, of needles %.3g\n", worst, off[0], off[1]);
    CHECK(worst < (DOUBLE ? 4e-15 : 1.5e-6));
    CHECK(off[0] < (DOUBLE ? 1e-13 : 4e-5) && off[1] < (DOUBLE ? 1e-11 : 4e-3));
    if (!DOUBLE)
        printf("figure conic_max_rel %.3g\nfigure exponent_error %.3g\nfigure needle_exponent_error %.3g\n",
               worst, off[0], off[1]);
}

/* Lists of round Gaussians and needles have every micro-tile where a pixel reaches the threshold, and few
 * more. */
static void test_masks(int step) {
    enum { TILES = 16, WIDE = 16 * TILES };
    static ssdgs_record record[TURNS];
    static ssdgs_real depth[TURNS];
    static ssdgs_instance instance[TILES * TILES];
    static ssdgs_instances of_gaussian[TURNS];
    static unsigned char needed[TILES * TILES][16], listed[TILES * TILES][16];
    ssdgs_splat_view view;
    memset(&view, 0, sizeof view);
    view.tiles_x = view.tiles_y = TILES;
    view.record = record;
    view.instance = instance;
    view.of_gaussian = of_gaussian;
    int missed = 0, more = 0, wanted = 0;
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++)
        for (int size = 1; size <= 5 && ssdgs__table(isa); size++)
            for (int aspect = 0; aspect <= size; aspect++) {
                ssdgs__projection p;
                memset(&p, 0, sizeof p);
                p.view[0] = p.view[5] = p.view[10] = 1;
                p.fx = p.fy = FOCAL, p.cx = (ssdgs_real)100.3, p.cy = (ssdgs_real)140.8;
                p.near_plane = (ssdgs_real)0.01, p.log2_threshold = -8, p.width = p.height = WIDE;
                p.variance = (ssdgs_real)0.1, p.depth_scale = p.presence = 1;
                p.orthographic = 1;
                const int n = fill_turned(pow(10, size), pow(10, aspect), step);
                for (int i = 0; i < n && aspect > 1; i++) { /* their thin parts, far from the centre */
                    turned[SSDGS_POSITION][i] =
                        (ssdgs_real)(2 * pow(10, size) / FOCAL * cos(i * step * PI / 180));
                    turned[SSDGS_POSITION + 1][i] =
                        (ssdgs_real)(2 * pow(10, size) / FOCAL * sin(i * step * PI / 180));
                }
                ssdgs__table(isa)->project(&p, turned[0], TURNS, 0, (size_t)(n + 15) / 16 * 16, record, depth,
                                           NULL);
                for (int i = 0; i < n; i++) {
                    const ssdgs_record *r = record + i;
                    uint16_t boxes[4 * TURNS];
                    ssdgs__tile_box(&view, r, boxes + 4 * i);
                    CHECK(depth[i] > 0);
                    const uint32_t count =
                        ssdgs__table(isa)->bin(&view, boxes, p.log2_threshold, i, i + 1, 0);
                    CHECK(count == of_gaussian[i].count && of_gaussian[i].first == 0);
                    memset(listed, 0, sizeof listed);
                    memset(needed, 0, sizeof needed);
                    for (uint32_t k = 0; k < count; k++)
                        for (int micro = 0; micro < 16; micro++)
                            listed[instance[k].place][micro] = instance[k].mask >> micro & 1;
                    for (int y = 0; y < WIDE; y++)
                        for (int x = 0; x < WIDE; x++) {
                            const ssdgs_real dx = (ssdgs_real)(x + 0.5) - r->x,
                                             dy = (ssdgs_real)(y + 0.5) - r->y;
                            const ssdgs_real u = r->ux * dx + r->uy * dy, w = r->wy * dy;
                            if (r->log2_opacity - u * u - w * w >= p.log2_threshold)
                                needed[y / 16 * TILES + x / 16][y % 16 / 4 * 4 + x % 16 / 4] = 1;
                        }
                    for (int k = 0; k < TILES * TILES * 16; k++) {
                        missed += needed[k / 16][k % 16] && !listed[k / 16][k % 16];
                        more += listed[k / 16][k % 16] && !needed[k / 16][k % 16];
                        wanted += needed[k / 16][k % 16];
                    }
                }
            }
    printf("masks: %d missed, %d more of %d\n", missed, more, wanted);
    CHECK(!missed && wanted > 10000 && more < wanted / 1000);
}

static void make_contexts(void) {
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++)
        for (int t = 0; t < 2; t++) {
            ssdgs_context_desc desc;
            memset(&desc, 0, sizeof desc);
            desc.isa = (ssdgs_isa)isa;
            desc.threads = t ? 3 : 1;
            const ssdgs_result result = ssdgs_context_create(&desc, &contexts[isa][t]);
            CHECK(result == SSDGS_OK || result == SSDGS_ERR_ISA);
            if (result) contexts[isa][t] = NULL;
        }
}

/* ---- 5. the normals of a depth image ---- */

/* Towards the camera, in its axes, of the triangle from a pixel to the nearer neighbours in its row and
   column. 0: none, or the last bit decides which neighbour. */
static int depth_normal(const double *depth, int width, int x, int y, double n[3]) {
    double way[2][3];
    for (int i = 0; i < 2; i++) {
        double p[3][3]; /* before, here, after */
        for (int c = -1; c <= 1; c++) {
            const int px = i ? x : x + c, py = i ? y + c : y;
            const double d = depth[py * width + px];
            p[c + 1][0] = (px + 0.5 - (double)s.camera.cx) / (double)s.camera.fx * d;
            p[c + 1][1] = (py + 0.5 - (double)s.camera.cy) / (double)s.camera.fy * d;
            p[c + 1][2] = d;
            if (d <= 0) return 0;
        }
        double distance[2];
        distance[0] = fabs(p[1][2] - p[0][2]), distance[1] = fabs(p[2][2] - p[1][2]);
        if (fabs(distance[0] - distance[1]) < 1e-6) return 0;
        for (int c = 0; c < 3; c++)
            way[i][c] = distance[0] < distance[1] ? p[1][c] - p[0][c] : p[2][c] - p[1][c];
    }
    for (int c = 0; c < 3; c++)
        n[c] = way[1][(c + 1) % 3] * way[0][(c + 2) % 3] - way[1][(c + 2) % 3] * way[0][(c + 1) % 3];
    normalise(n);
    return 1;
}

static void test_normals(void) {
    enum { WIDTH = 53, HEIGHT = 37, SIZE = WIDTH * HEIGHT };
    static ssdgs_real layers[2 * 3 * SIZE]; /* the depth's and the normals' */
    static double depth[SIZE];
    double most = 0, weight = 0.7 / SIZE;
    int told = 0, flat = 0;
    for (int index = 0; index < 20; index++) {
        double plane[3] = {0, 0, 1};
        key = (uint64_t)(9000 + index), drawn = 0;
        random_camera(uniform(0.9, 3), WIDTH, HEIGHT);
        for (int c = 0; c < 2; c++) plane[c] = uniform(-0.7, 0.7);
        for (int i = 0; i < SIZE; i++) { /* a plane, or anything */
            const double u = (i % WIDTH + 0.5 - (double)s.camera.cx) / (double)s.camera.fx;
            const double v = (i / WIDTH + 0.5 - (double)s.camera.cy) / (double)s.camera.fy;
            const double alpha = uniform(0, 1) < 0.05 ? uniform(0, 0.49) : uniform(0.51, 1);
            const double d = index < 10 ? 1.5 / (plane[0] * u + plane[1] * v + 1) : uniform(1, 1.5);
            layers[i] = (ssdgs_real)(alpha * d);
            layers[2 * SIZE + i] = (ssdgs_real)alpha;
            depth[i] = alpha < 0.5 ? 0 : (double)layers[i] / (double)layers[2 * SIZE + i];
        }
        normalise(plane);
        for (int isa = 0; isa < SSDGS_ISA_COUNT; isa++)
            for (int threads = 0; threads < 2 && contexts[isa][0]; threads++) {
                ssdgs_frame frame;
                memset(&frame, 0, sizeof frame);
                frame.context = contexts[isa][threads];
                frame.scratch = frame.context->scratch;
                frame.camera = s.camera;
                frame.layer_count = 5;
                frame.layer_pixels = layers;
                CHECK(!ssdgs__normals_loss(&frame, 0) && !frame.normal_gradient);
                if (!CHECK(!ssdgs__normals_loss(&frame, (ssdgs_real)0.7) && frame.normal_gradient)) return;
                for (int y = 0; y < HEIGHT; y++)
                    for (int x = 0; x < WIDTH; x++) {
                        const ssdgs_real *got = frame.normal_gradient + y * WIDTH + x;
                        const int inside = x > 0 && y > 0 && x < WIDTH - 1 && y < HEIGHT - 1;
                        const int known = inside && depth[y * WIDTH + x] > 0 &&
                                          depth[y * WIDTH + x - 1] > 0 && depth[y * WIDTH + x + 1] > 0 &&
                                          depth[(y - 1) * WIDTH + x] > 0 && depth[(y + 1) * WIDTH + x] > 0;
                        most = test_most(most, fabs((double)got[3 * SIZE] / weight - known));
                        for (int c = 0; c < 3 && !known; c++)
                            most = test_most(most, fabs((double)got[c * SIZE]) / weight);
                        if (!known) continue;
                        double n[3];
                        if (index < 10)
                            for (int c = 0; c < 3; c++) n[c] = -plane[c]; /* plane . p = constant */
                        else if (!depth_normal(depth, WIDTH, x, y, n)) continue;
                        told++, flat += index < 10;
                        for (int c = 0; c < 3; c++) {
                            const double world = (double)s.camera.view[c] * n[0] +
                                                 (double)s.camera.view[4 + c] * n[1] +
                                                 (double)s.camera.view[8 + c] * n[2];
                            most = test_most(most, fabs((double)got[c * SIZE] / weight + world));
                        }
                    }
            }
    }
    CHECK(flat > 10000 && told - flat > 10000);
    if (!CHECK(most < (DOUBLE ? 1e-12 : 5e-5))) printf("    normals of a depth image: off by %.3g\n", most);
}

/* A fall in a later batch of a walk knows what the batches before it left. 66 entries: the first and the last
   two lie in another micro-tile than those between, which fill the first batch. */
static void test_map_batches(const ssdgs__kernels *k) {
    enum { ENTRIES = 66, SPLIT = ENTRIES - 2 };
    ssdgs_record record[ENTRIES];
    ssdgs_tile_entry list[ENTRIES];
    ssdgs_real depth[ENTRIES], sums[4 * ENTRIES];
    static ssdgs_light_pixel map[256];
    ssdgs__tile tile;
    memset(&tile, 0, sizeof tile);
    memset(record, 0, sizeof record);
    for (int i = 0; i < ENTRIES; i++) {
        const double alpha = !i ? 0.05 : i == SPLIT ? 0.58 : i > SPLIT ? 0.8 : 0.01;
        record[i].log2_opacity = (ssdgs_real)(log(alpha) / log(2.0));
        list[i].gaussian = (uint32_t)i;
        list[i].mask = (uint16_t)(!i || i >= SPLIT ? 2 : 1);
        depth[i] = (ssdgs_real)(2 + i);
    }
    tile.record = record;
    tile.list = list;
    tile.depth = depth;
    tile.count = ENTRIES;
    tile.width = tile.height = 16;
    tile.log2_threshold = -8;
    tile.light_map = map;
    k->walk_light(&tile, sums);
    for (int lane = 0; lane < 16; lane++) {
        const ssdgs_light_pixel *at = map + 16 + lane;
        const double told[8] = {2,           2 + SPLIT, 3 + SPLIT,   0.95,
                                0.95 * 0.42, 0.95,      0.95 * 0.42, 0.95 * 0.42 * 0.2},
                     got[8] = {(double)at->distance[0], (double)at->distance[1], (double)at->distance[2],
                               (double)at->left[0],     (double)at->left[1],     (double)at->before[0],
                               (double)at->before[1],   (double)at->behind};
        for (int i = 0; i < 8; i++) CHECK(fabs(got[i] / told[i] - 1) < 1e-6);
    }
    CHECK(map[0].distance[0] == 5 && fabs((double)map[0].left[0] - 0.99 * 0.99 * 0.99) < 1e-6);
}

int main(int argc, char **argv) {
    const int full = argc > 1 && !strcmp(argv[1], "full");
    make_contexts();
    TEST_ROW("30", "every pixel against every Gaussian", test_camera(full ? 10000 : 1000));
    test_light(full ? 40 : 4);
    test_dark();
    test_shadow_error(200);
    TEST_ROW("24", "weights add up to one", test_unity());
    TEST_ROW("23", "order of the Gaussians", test_permutation());
    TEST_ROW("25", "coincident Gaussians", test_coincident());
    TEST_ROW("45", "slabs, gaps, added occluders", (test_layers(), test_gap(), test_veil(), test_occluder()));
    test_no_map();
    for (int isa = 0; isa < SSDGS_ISA_COUNT; isa++)
        if (contexts[isa][0]) test_map_batches(contexts[isa][0]->k);
    TEST_ROW("3", "images of one pixel, row, column; crops", test_crop());
    TEST_ROW("21,22", "scaled, moved, turned scenes", test_similarity());
    test_projection();
    TEST_ROW("8,9", "conics of needles and giants", (test_conic(full ? 1 : 10), test_masks(full ? 1 : 3)));
    test_normals();
    TEST_END();
}
