/* flip.h - FLIP: the visible difference of two images shown in turn (Andersson et al. 2020). MIT, see
   ssdgs.h.

   #include "ssdgs.h"
   #include "flip.h"
   ...
   double error = olat_flip(image, reference, width, height); (0 is best)

   CONTENTS  colours; the filters; an image's planes; the error.

   MEMORY  14 planes of the images' size, freed before the end. */

#ifndef OLAT_FLIP_H
#define OLAT_FLIP_H

#include "images.h" /* olat__transform */

/* Linear sRGB to CIE XYZ relative to the white point, and back. Rows sum to 1. */
static const double olat__flip_to_xyz[9] = {
    10135552.0 / 23359437, 8788810.0 / 23359437, 4435075.0 / 23359437,
    2613072.0 / 12288897,  8788810.0 / 12288897, 887015.0 / 12288897,
    1425312.0 / 80288307,  8788810.0 / 80288307, 70074185.0 / 80288307};
static const double olat__flip_to_rgb[9] = {3.080341988280,  -1.537398969489, -0.542943018792,
                                            -0.921178396165, 1.875929983695,  0.045248412470,
                                            0.052881292876,  -0.204011206124, 1.151129913248};

/* Linear sRGB to CIELAB with Hunt's adjustment: chroma counts less where it is dark. */
OLAT__API void olat__flip_lab(const double rgb[3], double lab[3]) {
    const double delta = 6.0 / 29;
    double f[3];
    olat__transform(olat__flip_to_xyz, rgb, f);
    for (int i = 0; i < 3; i++)
        f[i] = f[i] > delta * delta * delta ? pow(f[i], 1.0 / 3) : f[i] / (3 * delta * delta) + 4.0 / 29;
    lab[0] = 116 * f[1] - 16;
    lab[1] = 0.01 * lab[0] * 500 * (f[0] - f[1]);
    lab[2] = 0.01 * lab[0] * 200 * (f[1] - f[2]);
}

OLAT__API double olat__flip_hyab(const double p[3], const double q[3]) {
    return fabs(p[0] - q[0]) + sqrt((p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]));
}

enum {
    OLAT__FLIP_COLOR_RADIUS = 10,
    OLAT__FLIP_FEATURE_RADIUS = 9,
    OLAT__FLIP_TAPS = 21
}; /* 3 sigma of the widest */

/* Taps of a Gaussian (order 0), its first or second derivative: positive ones sum to 1, negative ones to -1.
   Returns what the positive ones summed to before. */
OLAT__API double olat__flip_kernel(int order, double sigma, int radius, ssdgs_real *taps) {
    double raw[OLAT__FLIP_TAPS], positive = 0, negative = 0;
    for (int i = 0; i <= 2 * radius; i++) {
        const double x = (i - radius) / sigma;
        raw[i] = exp(-0.5 * x * x) * (order == 0 ? 1 : order == 1 ? -x : x * x - 1);
        *(raw[i] > 0 ? &positive : &negative) += fabs(raw[i]);
    }
    for (int i = 0; i <= 2 * radius; i++)
        taps[i] = (ssdgs_real)(raw[i] / (raw[i] > 0 ? positive : raw[i] < 0 ? negative : 1));
    return positive;
}

/* output += weight x input filtered by across along the rows and down along the columns; the border pixels go
   on for ever. scratch holds a plane and a row with its borders. */
OLAT__API void olat__flip_filter(const ssdgs_real *input, int width, int height, const ssdgs_real *across,
                                 const ssdgs_real *down, int radius, double weight, ssdgs_real *scratch,
                                 ssdgs_real *output) {
    const size_t w = (size_t)width;
    ssdgs_real *row = scratch + w * (size_t)height;
    for (int y = 0; y < height; y++) {
        const ssdgs_real *from = input + w * (size_t)y;
        ssdgs_real *to = scratch + w * (size_t)y;
        for (int x = -radius; x < width + radius; x++)
            row[x + radius] = from[x < 0 ? 0 : x < width ? x : width - 1];
        for (int x = 0; x < width; x++) to[x] = 0;
        for (int k = 0; k <= 2 * radius; k++) {
            for (int x = 0; x < width; x++) to[x] += across[k] * row[x + k];
        }
    }
    for (int y = 0; y < height; y++) {
        ssdgs_real *to = output + w * (size_t)y;
        for (int k = 0; k <= 2 * radius; k++) {
            const int source = y + k - radius;
            const ssdgs_real *from = scratch + w * (size_t)(source < 0        ? 0
                                                            : source < height ? source
                                                                              : height - 1);
            const ssdgs_real tap = (ssdgs_real)weight * down[k];
            for (int x = 0; x < width; x++) to[x] += tap * from[x];
        }
    }
}

/* Fills five planes: what the eye resolves of an image's colours (Hunt-adjusted L, a, b), how strong its
   edges and points are. scratch holds four planes and a row. */
OLAT__API void olat__flip_image(const ssdgs_real *image, int width, int height, ssdgs_real *planes,
                                ssdgs_real *scratch) {
    const double degree =
        3840 * 3.14159265358979323846 / 180; /* px per degree: 0.7 m before a 0.7 m wide 4K monitor */
    const double pi2 = 9.86960440108935861883;
    /* Contrast sensitivity of the three opponent channels; the last is a sum of two Gaussians. */
    static const double amplitude[4] = {1, 1, 34.1, 13.5}, spread[4] = {0.0047, 0.0053, 0.04, 0.025};
    static const int channel[4] = {0, 1, 2, 2};
    const size_t pixels = (size_t)width * (size_t)height;
    ssdgs_real *opponent = scratch + pixels + (size_t)width + 2 * OLAT__FLIP_COLOR_RADIUS;
    double color[3], xyz[3];
    for (size_t p = 0; p < pixels; p++) { /* Yy, Cx, Cz without their scale and offset, which filters keep */
        for (int k = 0; k < 3; k++) {
            const ssdgs_real v = image[3 * p + (size_t)k];
            color[k] = (double)ssdgs_srgb_decode(v > 0 ? v < 1 ? v : 1 : 0);
        }
        olat__transform(olat__flip_to_xyz, color, xyz);
        opponent[p] = (ssdgs_real)xyz[1];
        opponent[pixels + p] = (ssdgs_real)(xyz[0] - xyz[1]);
        opponent[2 * pixels + p] = (ssdgs_real)(xyz[1] - xyz[2]);
    }

    ssdgs_real smooth[OLAT__FLIP_TAPS];
    olat__flip_kernel(0, 0.041 * degree, OLAT__FLIP_FEATURE_RADIUS,
                      smooth); /* half of 0.082 degrees, peak to trough */
    ssdgs_real taps[4][OLAT__FLIP_TAPS];
    for (int k = 1; k <= 2;
         k++) { /* edges, points: length of the two derivatives; L and a are free to hold them */
        olat__flip_kernel(k, 0.041 * degree, OLAT__FLIP_FEATURE_RADIUS, taps[0]);
        memset(planes, 0, 2 * pixels * sizeof *planes);
        olat__flip_filter(opponent, width, height, taps[0], smooth, OLAT__FLIP_FEATURE_RADIUS, 1, scratch,
                          planes);
        olat__flip_filter(opponent, width, height, smooth, taps[0], OLAT__FLIP_FEATURE_RADIUS, 1, scratch,
                          planes + pixels);
        for (size_t p = 0; p < pixels; p++) {
            const double dx = (double)planes[p], dy = (double)planes[pixels + p];
            planes[(size_t)(2 + k) * pixels + p] = (ssdgs_real)sqrt(dx * dx + dy * dy);
        }
    }

    double gain[4];
    for (int i = 0; i < 4; i++) { /* a spread b is a Gaussian of sigma sqrt(b / 2) / pi degrees */
        const double sum =
            olat__flip_kernel(0, sqrt(spread[i] / (2 * pi2)) * degree, OLAT__FLIP_COLOR_RADIUS, taps[i]);
        gain[i] = i < 2 ? 1 : amplitude[i] / sqrt(spread[i]) * sum * sum;
    }
    memset(planes, 0, 3 * pixels * sizeof *planes);
    for (int i = 0; i < 4; i++) {
        olat__flip_filter(opponent + (size_t)channel[i] * pixels, width, height, taps[i], taps[i],
                          OLAT__FLIP_COLOR_RADIUS, i < 2 ? 1 : gain[i] / (gain[2] + gain[3]), scratch,
                          planes + (size_t)channel[i] * pixels);
    }
    for (size_t p = 0; p < pixels; p++) {
        xyz[1] = (double)planes[p];
        xyz[0] = xyz[1] + (double)planes[pixels + p];
        xyz[2] = xyz[1] - (double)planes[2 * pixels + p];
        olat__transform(olat__flip_to_rgb, xyz, color);
        for (int k = 0; k < 3; k++) color[k] = color[k] > 0 ? color[k] < 1 ? color[k] : 1 : 0;
        olat__flip_lab(color, xyz);
        for (int k = 0; k < 3; k++) planes[(size_t)k * pixels + p] = (ssdgs_real)xyz[k];
    }
}

/* Mean LDR-FLIP error of two (h,w,3) images of sRGB-encoded values, clamped to [0,1]: 0 is best. -1 without
   memory. */
OLAT__API double olat_flip(const ssdgs_real *image, const ssdgs_real *reference, int width, int height) {
    static const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1}; /* the largest difference there is */
    const size_t pixels = (size_t)width * (size_t)height;
    double sum = 0;
    /* five planes of each image, four and a row of scratch */
    ssdgs_real *planes =
        (ssdgs_real *)malloc((14 * pixels + (size_t)width + 2 * OLAT__FLIP_COLOR_RADIUS) * sizeof *planes);
    if (!planes) return -1;
    olat__flip_image(image, width, height, planes, planes + 10 * pixels);
    olat__flip_image(reference, width, height, planes + 5 * pixels, planes + 10 * pixels);

    double lab[2][3];
    olat__flip_lab(green, lab[0]);
    olat__flip_lab(blue, lab[1]);
    const double largest = pow(olat__flip_hyab(lab[0], lab[1]), 0.7);
    const double knee = 0.4 * largest; /* errors below it take 95% of the scale */
    for (size_t p = 0; p < pixels; p++) {
        for (int i = 0; i < 3; i++) {
            lab[0][i] = (double)planes[(size_t)i * pixels + p];
            lab[1][i] = (double)planes[(size_t)(i + 5) * pixels + p];
        }
        double color = pow(olat__flip_hyab(lab[0], lab[1]), 0.7);
        color = color < knee ? 0.95 / knee * color : 0.95 + 0.05 * (color - knee) / (largest - knee);
        const double edge = fabs((double)planes[3 * pixels + p] - (double)planes[8 * pixels + p]);
        const double point = fabs((double)planes[4 * pixels + p] - (double)planes[9 * pixels + p]);
        const double feature = sqrt((edge > point ? edge : point) / 1.41421356237309504880);
        sum += pow(color, feature < 1 ? 1 - feature : 0);
    }
    free(planes);
    return sum / (double)pixels;
}

#endif /* OLAT_FLIP_H */
