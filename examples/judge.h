/* judge.h - whether photographs, cameras, lights and bounds suit each other, told before they are trained on.
   MIT, see ssdgs.h.

   #include "ssdgs.h"
   #include "judge.h"
   ...
   if (judge_photos(photos, count, &settings, &options, &logger)) puts("out of memory");

   WHAT  Where the lines of sight to the object meet, and so its box; cameras and lights that stand within it;
   shading that contradicts the lights, and how else these may be read; colours that are multiplied by alpha.
   The library's own notes, on what training makes of outlines, backgrounds and lights that do not move, are
   not repeated. hull.h judges what the photographs tell against each other. */

#ifndef JUDGE_H
#define JUDGE_H

#include "images.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What is judged. */
typedef struct judge__capture {
    const ssdgs_photo *photos;
    int count, transfer;
    const ssdgs_settings *settings;
    const ssdgs_train_options *options;
    const ssdgs_logger *logger;
    double radius, unit; /* of the cameras from their middle; the bounds' longest side */
} judge__capture;

static inline void judge__note(const judge__capture *k, const char *format, ...) {
    char text[600];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (k->logger && k->logger->write) k->logger->write(k->logger->user, SSDGS_OK, text);
}

/* ---- pixels, cameras, lights ---- */

static inline double judge__alpha(const ssdgs_photo *photo, size_t pixel) {
    return (double)olat__number(photo->pixels, photo->format, 4 * pixel + 3);
}

/* A stored value. */
static inline double judge__value(const ssdgs_photo *photo, int transfer, size_t pixel, int c) {
    const ssdgs_real number = olat__number(photo->pixels, photo->format, 4 * pixel + (size_t)c);
    const int encodes = transfer == SSDGS_TRANSFER_SRGB && olat__is_light(photo->format);
    return (double)(encodes ? ssdgs_srgb_encode(number) : number);
}

static inline void judge__to_camera(const ssdgs_camera *camera, const double world[3], double w,
                                    double seen[3]) {
    int j;
    for (int i = 0; i < 3; i++)
        for (seen[i] = w * (double)camera->view[4 * i + 3], j = 0; j < 3; j++)
            seen[i] += (double)camera->view[4 * i + j] * world[j];
}

static inline void judge__camera_centre(const ssdgs_camera *camera, double centre[3]) {
    for (int j = 0; j < 3; j++) {
        centre[j] = 0;
        for (int l = 0; l < 3; l++)
            centre[j] -= (double)camera->view[4 * l + j] * (double)camera->view[4 * l + 3];
    }
}

static inline void judge__cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* Where a light stands, or the direction towards it. */
static inline void judge__light_place(const ssdgs_light *light, double place[3]) {
    for (int i = 0; i < 3; i++)
        place[i] =
            (double)(light->kind == SSDGS_LIGHT_DIRECTIONAL ? -light->direction[i] : light->position[i]);
}

static inline void judge__bounds_centre(const ssdgs_train_options *o, double centre[3]) {
    for (int j = 0; j < 3; j++) centre[j] = 0.5 * ((double)o->bounds_min[j] + (double)o->bounds_max[j]);
}

static inline int judge__in_bounds(const ssdgs_train_options *o, const double x[3]) {
    int j = 0;
    while (j < 3 && x[j] > (double)o->bounds_min[j] && x[j] < (double)o->bounds_max[j]) j++;
    return j == 3;
}

/* ---- cameras and bounds ---- */

/* Whether more than a hundredth of its pixels, but not all, are wholly transparent. */
static inline int judge__outlined(const ssdgs_photo *photo) {
    const size_t pixels = (size_t)photo->camera.width * (size_t)photo->camera.height;
    size_t clear = 0;
    for (size_t i = 0; i < pixels; i++) clear += judge__alpha(photo, i) < 0.5 / 65535;
    return clear > pixels / 100 && clear < pixels;
}

/* What a photograph shows: its pixels' sides, how many these are and how many of them lie beside the bounds'
   picture. */
typedef struct judge__silhouette {
    int left, right, top, bottom; /* right < left: nothing */
    int whole;                    /* not cut by the picture's border, so that its middle is known */
    double shown, outside;
} judge__silhouette;

static inline judge__silhouette judge__silhouette_of(const ssdgs_photo *photo, const ssdgs_train_options *o) {
    const ssdgs_camera *camera = &photo->camera;
    judge__silhouette s = {0, -1, 0, -1, 0, 0, 0};
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
    for (int corner = 0; corner < 8; corner++) {
        double world[3];
        for (int c = 0; c < 3; c++)
            world[c] = (double)(corner >> c & 1 ? o->bounds_max[c] : o->bounds_min[c]);
        double seen[3];
        judge__to_camera(camera, world, 1, seen);
        for (int c = 0; c < 2; c++) {
            const double f = (double)(c ? camera->fy : camera->fx),
                         at = (double)(c ? camera->cy : camera->cx);
            const double p = seen[2] > 0 ? f * seen[c] / seen[2] + at : 0;
            low[c] = seen[2] > 0 ? p < low[c] ? p : low[c]
                                 : -1e30; /* reaching behind the camera it may be anywhere */
            high[c] = seen[2] > 0 ? p > high[c] ? p : high[c] : 1e30;
        }
    }
    for (int y = 0; y < camera->height; y++)
        for (int x = 0; x < camera->width; x++) {
            if (judge__alpha(photo, (size_t)y * (size_t)camera->width + (size_t)x) < 0.5) continue;
            if (s.right < s.left) s.left = s.right = x, s.top = y;
            s.left = x < s.left ? x : s.left;
            s.right = x > s.right ? x : s.right;
            s.bottom = y;
            s.shown++;
            s.outside += x + 1 < low[0] || x > high[0] || y + 1 < low[1] || y > high[1];
        }
    s.whole = s.shown > 0 && s.left > 0 && s.right < camera->width - 1 && s.top > 0 &&
              s.bottom < camera->height - 1;
    return s;
}

/* Notes where photographs and their cameras or the bounds do not suit each other. The rays through the
   middles of the silhouettes meet about where the object is; `within` cameras stand within the bounds. */
static inline int judge__bounds(const judge__capture *k, int within) {
    double a[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0}, b[3] = {0, 0, 0}, x[3] = {0, 0, 0};
    double shown = 0, outside = 0, half = 0, miss = 0;
    judge__silhouette *silhouettes = (judge__silhouette *)calloc((size_t)k->count, sizeof *silhouettes);
    int rays = 0, behind = 0;
    if (!silhouettes) return 1;
    int l;
    for (int i = 0; i < k->count;
         i++) { /* sum of |(1 - d d') (x - eye)|^2 = x.a x - 2 b.x + miss, d the ray */
        const ssdgs_camera *camera = &k->photos[i].camera;
        judge__silhouette *s = silhouettes + i;
        if (!judge__outlined(k->photos + i)) continue;
        *s = judge__silhouette_of(k->photos + i, k->options);
        shown += s->shown;
        outside += s->outside;
        if (!s->whole) continue;
        rays++;
        double ray[3];
        ray[0] = (0.5 * (s->left + s->right + 1) - (double)camera->cx) / (double)camera->fx;
        ray[1] = (0.5 * (s->top + s->bottom + 1) - (double)camera->cy) / (double)camera->fy;
        ray[2] = 1;
        const double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
        double eye[3];
        judge__camera_centre(camera, eye);
        double d[3];
        for (int j = 0; j < 3; j++)
            for (d[j] = 0, l = 0; l < 3; l++) d[j] += (double)camera->view[4 * l + j] * ray[l] / length;
        for (int j = 0; j < 3; j++)
            for (l = 0; l < 3; l++) {
                a[3 * j + l] += (j == l) - d[j] * d[l];
                b[j] += ((j == l) - d[j] * d[l]) * eye[l];
                miss += ((j == l) - d[j] * d[l]) * eye[j] * eye[l];
            }
    }
    double cross[3];
    judge__cross(a + 3, a + 6, cross);
    const double determinant = a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2];
    if (determinant > 1e-6) {         /* else they are parallel */
        for (int j = 0; j < 3; j++) { /* Cramer's rule on a symmetric matrix */
            double m[9];
            memcpy(m, a, sizeof m);
            memcpy(m + 3 * j, b, sizeof b);
            judge__cross(m + 3, m + 6, cross);
            x[j] = (m[0] * cross[0] + m[1] * cross[1] + m[2] * cross[2]) / determinant;
        }
        for (int i = 0; i < k->count; i++) {
            const ssdgs_camera *camera = &k->photos[i].camera;
            const judge__silhouette *s = silhouettes + i;
            double seen[3];
            judge__to_camera(camera, x, 1, seen);
            if (!s->whole) continue;
            double wide = 0.5 * seen[2] * (s->right + 1 - s->left) / (double)camera->fx;
            const double high = 0.5 * seen[2] * (s->bottom + 1 - s->top) / (double)camera->fy;
            wide = wide > high ? wide : high;
            half = wide > half ? wide : half;
            behind += wide < 0;
        }
        for (int j = 0; j < 3; j++)
            for (miss -= 2 * b[j] * x[j], l = 0; l < 3; l++) miss += x[j] * a[3 * j + l] * x[l];
        miss = sqrt(miss > 0 ? miss / rays : 0);
    }
    free(silhouettes);
    const int doubtful = determinant > 1e-6 && miss > 0.5 * half;
    if (doubtful && behind > rays / 2)
        judge__note(k, "what the photographs show lies behind the cameras: are their axes right?");
    else if (doubtful)
        judge__note(k,
                    "what the photographs show is in no one place, lines of sight to it miss each other by "
                    "%g where it is %g "
                    "wide: are the cameras' poses, axes and lenses right?",
                    miss, 2 * half);
    if (within)
        judge__note(
            k, "%d cameras of %d stand within bounds_min .. bounds_max, which should hold the object alone",
            within, k->count);
    if (outside > 0.1 * shown && !doubtful)
        judge__note(k,
                    "of what the photographs show %d in 100 pixels lie outside of bounds_min .. bounds_max",
                    (int)(100 * outside / shown));
    if ((!within && outside <= 0.1 * shown) || doubtful || !(half > 0)) return 0;
    const double step = pow(10, floor(log10(half)) - 1);
    for (int j = 0; j < 3; j++) x[j] += (double)k->settings->origin[j];
    judge__note(k, "the object lies about within bounds_min=%.9g,%.9g,%.9g bounds_max=%.9g,%.9g,%.9g",
                step * floor((x[0] - half) / step), step * floor((x[1] - half) / step),
                step * floor((x[2] - half) / step), step * ceil((x[0] + half) / step),
                step * ceil((x[1] + half) / step), step * ceil((x[2] + half) / step));
    return 0;
}

/* ---- shading and lights ---- */

/* Of one photograph, for whether its shading agrees with its light. In camera axes. */
typedef struct judge__shading {
    double rotation[9]; /* world to camera */
    double eye[3];      /* from the bounds' centre, world */
    double position[3]; /* as given: of the light, or towards it */
    double shift[2];    /* of the brightness' middle from the silhouette's, in the silhouette's standard
                           deviations */
    double brightness;  /* mean, over the light's intensity */
    int directional;
} judge__shading;

/* The stored colour of a pixel laid over black. */
static inline void judge__over_black(const ssdgs_photo *photo, int transfer, size_t pixel, double stored[3]) {
    for (int c = 0; c < 3; c++)
        stored[c] = judge__alpha(photo, pixel) * judge__value(photo, transfer, pixel, c);
}

/* About the light of a pixel laid over black; 0 where it has the colour of the first one. */
static inline double judge__lightness(const ssdgs_photo *photo, int transfer, const double corner[3],
                                      size_t pixel) {
    double value = 0, apart = 0, stored[3];
    judge__over_black(photo, transfer, pixel, stored);
    for (int c = 0; c < 3; c++) {
        value += stored[c] * stored[c];
        apart = fabs(stored[c] - corner[c]) > apart ? fabs(stored[c] - corner[c]) : apart;
    }
    return apart < 0.02 ? 0 : value;
}

/* What a photograph shows of its light; 0 where it shows nothing. An opaque one's silhouette is the picture.
   Pixels of the first one's colour count as dark, those brighter than all that lie three pixels away as the
   brightest of these. */
static inline int judge__shading_of(const ssdgs_photo *photo, int transfer, const double centre[3],
                                    judge__shading *s) {
    const ssdgs_camera *camera = &photo->camera;
    const int w = camera->width, h = camera->height, step = 1 + (w > h ? w : h) / 128; /* some pixels tell */
    double area = 0, light = 0, middle[2] = {0, 0}, square[2] = {0, 0}, bright[2] = {0, 0}, intensity = 0;
    double corner[3];
    judge__over_black(photo, transfer, 0, corner);
    for (int y = step / 2; y < h; y += step)
        for (int x = step / 2; x < w; x += step) {
            const size_t pixel = (size_t)y * (size_t)w + (size_t)x;
            const double alpha = judge__alpha(photo, pixel);
            const double at[2] = {(x + 0.5 - (double)camera->cx) / (double)camera->fx,
                                  (y + 0.5 - (double)camera->cy) / (double)camera->fy};
            double value = judge__lightness(photo, transfer, corner, pixel), around = 0;
            for (int side = 0; side < 9 && value > around; side++) { /* a hot pixel is not the object's */
                const int u = x + 3 * (side % 3 - 1), v = y + 3 * (side / 3 - 1);
                if (side == 4 || u < 0 || u >= w || v < 0 || v >= h) continue;
                const double there =
                    judge__lightness(photo, transfer, corner, (size_t)v * (size_t)w + (size_t)u);
                around = there > around ? there : around;
            }
            value = value < around ? value : around;
            area += alpha;
            light += value;
            for (int c = 0; c < 2; c++) {
                middle[c] += alpha * at[c];
                square[c] += alpha * at[c] * at[c];
                bright[c] += value * at[c];
            }
        }
    for (int c = 0; c < 3; c++) intensity += (double)photo->light.intensity[c] / 3;
    if (!(area > 0) || !(light > 0) || !(intensity > 0)) return 0;
    for (int c = 0; c < 2; c++) {
        const double variance = square[c] / area - middle[c] / area * (middle[c] / area);
        s->shift[c] = (bright[c] / light - middle[c] / area) / sqrt(variance > 1e-12 ? variance : 1e-12);
    }
    s->brightness = light / area / intensity;
    s->directional = photo->light.kind == SSDGS_LIGHT_DIRECTIONAL;
    judge__light_place(&photo->light, s->position);
    judge__camera_centre(camera, s->eye);
    for (int c = 0; c < 3; c++) {
        s->eye[c] -= centre[c];
        for (int l = 0; l < 3; l++) s->rotation[3 * c + l] = (double)camera->view[4 * c + l];
    }
    return 1;
}

/* A way to read three numbers as a light's position: axis[c] and sign[c] tell which is the c-th coordinate,
   then in world or camera axes, from the world's origin or the camera. */
typedef struct judge__reading {
    int axis[3], in_camera, from_camera;
    double sign[3];
} judge__reading;

/* Where the light stands from the bounds' centre: its direction in world axes, and its squared distance. */
static inline double judge__read_light(const judge__shading *s, const judge__reading *r,
                                       const double centre[3], double direction[3]) {
    double p[3], distance2 = 0;
    for (int c = 0; c < 3; c++) p[c] = r->sign[c] * s->position[r->axis[c]];
    for (int c = 0; c < 3; c++) {
        direction[c] = r->in_camera ? 0 : p[c];
        for (int l = 0; l < 3 && r->in_camera; l++) direction[c] += s->rotation[3 * l + c] * p[l];
        if (!s->directional) direction[c] += r->from_camera ? s->eye[c] : -centre[c];
        distance2 += direction[c] * direction[c];
    }
    for (int c = 0; c < 3; c++) direction[c] /= sqrt(distance2) + 1e-12;
    return s->directional ? 1 : distance2;
}

/* The correlation of (n, width) numbers with others, each less their means; *spread: the first ones' standard
   deviation. */
static inline double judge__correlation(const double *a, const double *b, int n, int width, double *spread) {
    double ab = 0, aa = 0, bb = 0;
    for (int c = 0; c < width; c++) {
        double a_mean = 0, b_mean = 0;
        for (int i = 0; i < n; i++) a_mean += a[i * width + c] / n, b_mean += b[i * width + c] / n;
        for (int i = 0; i < n; i++) {
            const double x = a[i * width + c] - a_mean, y = b[i * width + c] - b_mean;
            ab += x * y, aa += x * x, bb += y * y;
        }
    }
    *spread = sqrt(aa / n);
    return ab / sqrt(aa * bb + 1e-30);
}

/* How well shading follows the lights, a correlation: a picture is brightest on the light's side, and bright
   as a whole where the light is on the camera's side. On a floor seen from above only two axes tell of the
   former. 1 where nothing tells. *facing: how far the lights are on the camera's side, on average, plus twice
   its error. scratch: (n, 6). */
static inline double judge__agreement(const judge__shading *s, int n, const judge__reading *reading,
                                      const double centre[3], double *scratch, double *facing) {
    double *toward = scratch, *shift = scratch + 2 * n, *front = scratch + 4 * n, *bright = scratch + 5 * n;
    double sideways = -2, brightness = 0, front_mean = 0;
    for (int flat = 0; flat < 4; flat++) { /* which axis tells nothing; 3: all tell */
        double lights = 0, shown = 0;
        int above = 0;
        for (int i = 0; i < n; i++) {
            double d[3], eye2 = 0, towards_eye = 0;
            const double distance2 = judge__read_light(s + i, reading, centre, d);
            for (int c = 0; c < 3; c++) {
                towards_eye += d[c] * s[i].eye[c];
                eye2 += s[i].eye[c] * s[i].eye[c];
            }
            front[i] = towards_eye / (sqrt(eye2) + 1e-12);
            bright[i] = s[i].brightness * distance2;
            if (flat < 3) {
                lights += d[flat];
                above += s[i].eye[flat] > 0;
                d[flat] = 0;
            }
            for (int c = 0; c < 2; c++) {
                shift[2 * i + c] = s[i].shift[c];
                int l;
                for (l = 0, toward[2 * i + c] = 0; l < 3; l++)
                    toward[2 * i + c] += s[i].rotation[3 * c + l] * d[l];
            }
        }
        if (flat < 3 && (above == 0 ? lights > 0 : above < n || lights < 0))
            continue; /* neither a floor nor a ceiling */
        const double r = judge__correlation(toward, shift, n, 2, &shown);
        sideways = shown > 0.1 && r > sideways ? r : sideways;
    }
    for (int i = 0; i < n; i++) brightness += bright[i] / n, front_mean += front[i] / n;
    for (int i = 0; i < n; i++)
        bright[i] /= bright[i] + brightness + 1e-30; /* a few highlights must not count for all */
    double spread;
    const double frontal = judge__correlation(front, bright, n, 1, &spread);
    *facing = front_mean + 2 * spread / sqrt((double)n);
    if (!(spread > 0.2))
        return sideways < -1 ? 1 : sideways; /* where lights hardly change sides brightness tells nothing */
    return sideways < -1 ? frontal : 0.5 * (sideways + frontal);
}

/* Notes where the photographs' shading contradicts their lights: axes, signs or origins are wrong. Right
   captures agree to 0.8 and more, wrong readings to 0.5 or so; on a floor seen from above one that puts the
   lights below it may agree to 0.86. */
static inline int judge__note_shading(const judge__capture *k, const double centre[3]) {
    enum { few = 6, enough = 12 };
    static const judge__reading as_given = {{0, 1, 2}, 0, 0, {1, 1, 1}};
    static const char *const axes[2][3] = {{"x", "y", "z"}, {"-x", "-y", "-z"}};
    const size_t room = (size_t)k->count * (sizeof(judge__shading) + 6 * sizeof(double));
    judge__shading *s = (judge__shading *)malloc(room);
    if (!s) return 1;
    double *scratch = (double *)(s + k->count), agrees = 1, facing = 1, best = 0;
    judge__reading found = as_given;
    int n = 0;
    for (int i = 0; i < k->count; i++) n += judge__shading_of(k->photos + i, k->transfer, centre, s + n);
    if (n >= few) agrees = judge__agreement(s, n, &as_given, centre, scratch, &facing);
    judge__reading reading;
    for (int way = 0; way < 4 && n >= enough; way++)
        for (int order = 0; order < 6; order++)
            for (int signs = 0; signs < 8; signs++) {
                for (int i = 0; i < 3; i++) {
                    reading.axis[i] = order < 3 ? (order + i) % 3 : (order - i) % 3;
                    reading.sign[i] = signs >> i & 1 ? -1 : 1;
                }
                reading.in_camera = way & 1;
                reading.from_camera = way >> 1;
                double facing_so;
                const double agrees_so = judge__agreement(s, n, &reading, centre, scratch, &facing_so);
                /* a place beside the camera mixes in the camera's direction, of which much is right in any
                   reading */
                if (facing_so < -0.1 ||
                    agrees_so < best + (reading.from_camera != found.from_camera ? 0.2 : 0))
                    continue;
                best = agrees_so;
                found = reading;
            }
    const int behind = n >= enough && agrees < 0.88 && facing < -0.1;
    const int contradicts = agrees < 0.5 || (best > 0.75 && best > agrees + 0.2 && !behind);
    if (contradicts)
        judge__note(k,
                    "the photographs' shading contradicts their lights: its correlation with their "
                    "directions is %g, and near 1 "
                    "where these are right",
                    floor(100 * agrees + 0.5) / 100);
    else if (behind)
        judge__note(
            k, "the lights stand behind the object as most cameras see it: are their axes and signs right?");
    if ((contradicts || behind) && best > 0.7 && best > agrees + 0.03)
        judge__note(k, "read as (%s, %s, %s) in %s axes%s, the lights would agree with the shading (%g)",
                    axes[found.sign[0] < 0][found.axis[0]], axes[found.sign[1] < 0][found.axis[1]],
                    axes[found.sign[2] < 0][found.axis[2]],
                    found.in_camera ? "each camera's (right, down, forward)" : "the world's",
                    found.from_camera ? ", from the camera" : "", floor(100 * best + 0.5) / 100);
    free(s);
    return 0;
}

/* Notes lights within the bounds and, where lights tell what other lights do, shading that contradicts them.
   They do not where they hardly move, or hardly move in the camera's axes: the trainer tells that. */
static inline int judge__lights(const judge__capture *k) {
    const int n = k->count;
    double centre[3], mean[3] = {0, 0, 0}, held[3] = {0, 0, 0}, spread = 0, apart = 0, away = 0, lit_from = 0;
    int within = 0, points = 0, several = 0;
    judge__bounds_centre(k->options, centre);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < n; i++) {
            const ssdgs_photo *photo = k->photos + i;
            const int point = photo->light.kind != SSDGS_LIGHT_DIRECTIONAL;
            double eye[3], p[3], seen[3], sums[4] = {0, 0, 0, 0};
            judge__camera_centre(&photo->camera, eye);
            judge__light_place(&photo->light, p);
            judge__to_camera(&photo->camera, p, point, seen);
            for (int j = 0; j < 3; j++) {
                sums[0] += (p[j] - mean[j]) * (p[j] - mean[j]);
                sums[1] += (seen[j] - held[j]) * (seen[j] - held[j]);
                sums[2] += (eye[j] - centre[j]) * (eye[j] - centre[j]);
                sums[3] += (p[j] - centre[j]) * (p[j] - centre[j]);
            }
            if (pass) {
                spread = sums[0] > spread ? sums[0] : spread;
                apart = sums[1] > apart ? sums[1] : apart;
                away += (points ? sqrt(sums[2]) : 1) / n;
                lit_from += (points ? sqrt(sums[3]) : 1) / n;
                continue;
            }
            for (int j = 0; j < 3; j++) mean[j] += p[j] / n, held[j] += seen[j] / n;
            within += point && judge__in_bounds(k->options, p);
            points += point;
            several |= photo->more_count > 0;
        }
    if (within)
        judge__note(
            k, "%d lights of %d stand within bounds_min .. bounds_max, which should hold the object alone",
            within, n);
    if (n < 2 || several || (points && points < n)) return 0;
    if (points && k->radius > 1e-3 * k->unit && k->radius < away)
        away = k->radius; /* bounds, and so away, may be wrong */
    if (sqrt(spread) < 0.03 * lit_from || sqrt(apart) < 0.1 * away) return 0;
    return judge__note_shading(k, centre);
}

/* ---- alpha ---- */

/* Notes where colours are multiplied by alpha already: a half-transparent pixel then has not the colour that
   the opaque ones beside it lead to, but that times alpha, as stored or as linear light. */
static inline void judge__alphas(const judge__capture *k) {
    const int transfer = k->transfer;
    double straight = 0, times_alpha = 0, times_linear = 0, count = 0;
    for (int i = 0; i < k->count; i++) {
        const ssdgs_photo *photo = k->photos + i;
        const int w = photo->camera.width, h = photo->camera.height;
        for (int y = 0; y < h; y++)
            for (int x = 3; x < w - 3; x++) {
                const size_t pixel = (size_t)y * (size_t)w + (size_t)x;
                const double a = judge__alpha(photo, pixel);
                if (a < 0.1 || a > 0.7) continue;
                for (int side = 0; side < 4; side++) { /* right and left, next to it and one further */
                    const int step = 1 + side / 2;
                    const size_t next = side & 1 ? pixel - (size_t)step : pixel + (size_t)step,
                                 further = side & 1 ? next - 1 : next + 1;
                    if (judge__alpha(photo, next) < 0.99 || judge__alpha(photo, further) < 0.99) continue;
                    for (int c = 0; c < 3; c++) {
                        const double v = judge__value(photo, transfer, pixel, c),
                                     beside = judge__value(photo, transfer, next, c);
                        double n = beside + step * (beside - judge__value(photo, transfer, further, c));
                        n = n < 0 ? 0 : n > 1 ? 1 : n;
                        straight += fabs(v - n);
                        times_alpha += fabs(v - a * n);
                        times_linear += fabs(v - pow(a, 1 / 2.2) * n);
                    }
                    count++;
                    break;
                }
            }
    }
    if (count >= 50 && (times_alpha < 0.5 * straight || times_linear < 0.5 * straight))
        judge__note(k, "the photographs' colours look multiplied by alpha, which darkens "
                       "outlines: they must be straight "
                       "(divide by alpha, or export without premultiplication)");
}

/* Writes a note to the logger for each thing that is wrong. settings: transfer and origin are read; options:
   the bounds. The photographs must be such as ssdgs_trainer_create() takes. 1: out of memory. */
static inline int judge_photos(const ssdgs_photo *photos, int count, const ssdgs_settings *settings,
                               const ssdgs_train_options *options, const ssdgs_logger *logger) {
    judge__capture k = {photos, count, settings->transfer, settings, options, logger, 0, 0};
    double mean[3] = {0, 0, 0}, eye[3];
    int within = 0, failed = 0;
    for (int i = 0; i < count; i++) {
        judge__camera_centre(&photos[i].camera, eye);
        for (int c = 0; c < 3; c++) mean[c] += eye[c] / count;
        within += judge__in_bounds(options, eye);
    }
    for (int i = 0; i < count; i++) {
        double away = 0;
        judge__camera_centre(&photos[i].camera, eye);
        for (int c = 0; c < 3; c++) away += (eye[c] - mean[c]) * (eye[c] - mean[c]);
        k.radius = sqrt(away) > k.radius ? sqrt(away) : k.radius;
    }
    for (int c = 0; c < 3; c++) {
        const double side = (double)options->bounds_max[c] - (double)options->bounds_min[c];
        k.unit = side > k.unit ? side : k.unit;
    }
    if (k.radius >= 1e-3 * k.unit)
        failed = judge__bounds(&k, within); /* else from one place: who can tell? */
    failed = failed || judge__lights(&k);
    if (!failed) judge__alphas(&k);
    return failed;
}
#endif
