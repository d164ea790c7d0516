/* lens.h - lenses that bend straight lines: photographs without that, and smaller ones. MIT, see ssdgs.h.

   #include "ssdgs.h"
   #include "lens.h"
   ...
   olat_lens lens = ...  (as told)
   if (!olat_lens_zoom(&lens)) puts("no picture comes of that");
   void *flat = olat_resample(pixels, format, &lens, 1);  ... (height, width, 4) of a pinhole camera with
   focal lengths lens.zoom * lens.focal and the same centre ...  free(flat);

   MODEL  OpenCV's, which COLMAP and nerfstudio have, too. Of the ray (x, y, 1), r^2 = x^2 + y^2, the picture
   lies at
     x s + 2 p1 x y + p2 (r^2 + 2 x^2), y s + p1 (r^2 + 2 y^2) + 2 p2 x y,
   s = 1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8; fisheye: s = t / r (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8),
   t = atan r, without p1 and p2.

   HOW  The new picture has the old one's size and centre, and the widest view of which the old one has every
   pixel, up to 120 degrees. Between pixels a cubic spline (Catmull-Rom) interpolates light, colours times
   alpha, no further than the four nearest pixels reach: nothing rings.

   MEMORY  The picture is the caller's to free; beside it resampling takes 16 bytes a pixel. */

#ifndef OLAT_LENS_H
#define OLAT_LENS_H

#include "images.h"

typedef struct olat_lens {
    int fisheye, width, height; /* of the photograph as stored */
    double focal[2], centre[2]; /* pixels of that */
    double k[4], p[2], zoom;    /* zoom: of the focal lengths, by olat_lens_zoom; 1: a pinhole's */
} olat_lens;

/* Whether it is no pinhole. */
OLAT__API int olat_lens_bends(const olat_lens *lens) {
    int bends = lens->fisheye;
    for (int i = 0; i < 4; i++) bends |= fabs(lens->k[i]) > 0;
    return bends || fabs(lens->p[0]) > 0 || fabs(lens->p[1]) > 0;
}

/* Where the photograph, in its pixels, shows the ray (x, y, 1); 0 where the lens would fold. */
OLAT__API int olat_lens_point(const olat_lens *lens, double x, double y, double point[2]) {
    const double r2 = x * x + y * y, r = sqrt(r2), t = lens->fisheye ? atan(r) : r, *p = lens->p;
    double sum = 1, slope = 1, power = 1; /* slope: of t * sum */
    for (int i = 0; i < 4; i++) {
        power *= t * t;
        sum += lens->k[i] * power;
        slope += (2 * i + 3) * lens->k[i] * power;
    }
    if (lens->fisheye && r > 0) sum *= t / r;
    point[0] = lens->centre[0] + lens->focal[0] * (x * sum + 2 * p[0] * x * y + p[1] * (r2 + 2 * x * x));
    point[1] = lens->centre[1] + lens->focal[1] * (y * sum + 2 * p[1] * x * y + p[0] * (r2 + 2 * y * y));
    return slope > 0;
}

/* Whether the photograph has all of the picture's border, and that is no wider than 120 degrees. */
static int olat__lens_holds(const olat_lens *lens, double zoom) {
    enum { STEPS = 64 };
    const double size[2] = {(double)lens->width, (double)lens->height};
    for (int i = 0; i < 4 * STEPS; i++) {
        const double along = (i % STEPS) / (double)STEPS, side = i / (2 * STEPS);
        const int axis = i / STEPS % 2;
        double ray[2], at[2];
        ray[axis] = (along * size[axis] - lens->centre[axis]) / (zoom * lens->focal[axis]);
        ray[!axis] = (side * size[!axis] - lens->centre[!axis]) / (zoom * lens->focal[!axis]);
        if (hypot(ray[0], ray[1]) > 1.7320508075688772 || !olat_lens_point(lens, ray[0], ray[1], at) ||
            !(at[0] >= 0 && at[1] >= 0 && at[0] <= size[0] && at[1] <= size[1]))
            return 0;
    }
    return 1;
}

/* Finds lens->zoom; 0 if the lens shows no picture of which every pixel is there. */
OLAT__API int olat_lens_zoom(olat_lens *lens) {
    double good = 16, bad = good;
    lens->zoom = 1;
    if (!olat_lens_bends(lens)) return 1;
    if (!olat__lens_holds(lens, good)) return 0;
    while (bad > 1.0 / 16 && olat__lens_holds(lens, bad)) good = bad, bad *= 0.995;
    for (int i = 0; i < 40; i++) { /* from narrow to wide: beyond a fold the border may lie within again */
        const double middle = 0.5 * (good + bad);
        if (olat__lens_holds(lens, middle)) good = middle;
        else bad = middle;
    }
    lens->zoom = good;
    return 1;
}

/* The light of a picture of (w,h) at a place, from (w,h,4) colours times alpha. */
static void olat__lens_sample(const float *light, int w, int h, const double at[2], double sum[4]) {
    double weight[2][4];
    size_t place[2][4];
    for (int axis = 0; axis < 2; axis++) {
        const int size = axis ? h : w;
        const double from = floor(at[axis] - 0.5), t = at[axis] - 0.5 - from;
        weight[axis][0] = t * (t * (2 - t) - 1) / 2;
        weight[axis][1] = (t * t * (3 * t - 5) + 2) / 2;
        weight[axis][2] = t * (t * (4 - 3 * t) + 1) / 2;
        weight[axis][3] = t * t * (t - 1) / 2;
        for (int i = 0; i < 4; i++) {
            const int pixel = (int)from + i - 1;
            place[axis][i] = (size_t)(pixel < 0 ? 0 : pixel < size ? pixel : size - 1);
        }
    }
    float least[4], most[4];
    for (int c = 0; c < 4; c++) least[c] = 1e30f, most[c] = 0, sum[c] = 0;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            const float *v = light + 4 * (place[1][j] * (size_t)w + place[0][i]);
            const double share = weight[0][i] * weight[1][j];
            const int nearest = (i == 1 || i == 2) && (j == 1 || j == 2);
            for (int c = 0; c < 4; c++) {
                sum[c] += share * (double)v[c];
                if (nearest && v[c] < least[c]) least[c] = v[c];
                if (nearest && v[c] > most[c]) most[c] = v[c];
            }
        }
    for (int c = 0; c < 4; c++) sum[c] = fmin(fmax(sum[c], (double)least[c]), (double)most[c]);
}

/* A photograph of lens->width x lens->height without the lens's bending, and smaller by `downscale`: the mean
   light of so many pixels squared; what is left over at the right and below is dropped. NULL: out of
   memory. */
OLAT__API void *olat_resample(const void *pixels, ssdgs_pixels format, const olat_lens *lens, int downscale) {
    const int w = lens->width, h = lens->height, columns = w / downscale, rows = h / downscale,
              bends = olat_lens_bends(lens), is_light = olat__is_light(format);
    const size_t count = 4 * (size_t)w * (size_t)h, made = 4 * (size_t)columns * (size_t)rows,
                 top = format == SSDGS_PIXELS_RGBA16 ? 65535 : 255;
    float *light = (float *)malloc(count * sizeof *light),
          *table = (float *)malloc((top + 1) * sizeof *table);
    unsigned char *out = (unsigned char *)malloc(made * olat__number_size(format));
    if (!light || !table || !out) {
        free(light), free(table), free(out);
        return NULL;
    }
    olat__space srgb;
    olat__srgb_space(&srgb);
    for (size_t i = 0; i <= top; i++) table[i] = (float)olat__light(srgb.code, (double)i / (double)top);
    for (size_t i = 0; i < count; i++) {
        const size_t c = i % 4, alpha = c ? 3 - c : 3; /* alpha first */
        const size_t at = i - c + alpha;
        float v = (float)olat__number(pixels, format, at);
        if (c && !is_light) v = table[olat__sample(pixels, format, at)];
        light[at] = c ? v * light[i - c + 3] : v;
    }
    for (size_t i = 0; i < made; i += 4) {
        const size_t pixel = i / 4;
        const double x = (double)(pixel % (size_t)columns), y = (double)(pixel / (size_t)columns);
        double sum[4] = {0, 0, 0, 0};
        for (int k = 0; k < downscale * downscale; k++) {
            double at[2] = {x * downscale + k % downscale + 0.5, y * downscale + k / downscale + 0.5}, v[4];
            if (bends) {
                olat_lens_point(lens, (at[0] - lens->centre[0]) / (lens->zoom * lens->focal[0]),
                                (at[1] - lens->centre[1]) / (lens->zoom * lens->focal[1]), at);
                olat__lens_sample(light, w, h, at, v);
            } else {
                const float *whole = light + 4 * ((size_t)at[1] * (size_t)w + (size_t)at[0]);
                for (int c = 0; c < 4; c++) v[c] = (double)whole[c];
            }
            for (int c = 0; c < 4; c++) sum[c] += v[c];
        }
        for (size_t c = 0; c < 4; c++) {
            const double share = c == 3 ? downscale * downscale : sum[3];
            double v = share > 0 ? sum[c] / share : 0;
            if (c < 3 && !is_light) v = olat__to_srgb(v);
            if (format == SSDGS_PIXELS_RGBA32F) ((float *)(void *)out)[i + c] = (float)v;
            else if (is_light) ((uint16_t *)(void *)out)[i + c] = olat__to_half((float)fmin(v, 65504));
            else if (top > 255) ((uint16_t *)(void *)out)[i + c] = (uint16_t)(65535 * fmin(v, 1) + 0.5);
            else out[i + c] = (unsigned char)(255 * fmin(v, 1) + 0.5);
        }
    }
    free(light);
    free(table);
    return out;
}

#endif /* OLAT_LENS_H */
