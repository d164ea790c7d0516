/* examples/lens.h, colmap.h, colmap.c: lenses against formulas of their own, pictures of known light, models
   as text and binary, two phones, hostile bytes. cc -o build/t_colmap tests/t_colmap.c -lm -lpthread &&
   build/t_colmap (writes under build/) */
int colmap_main(int argc, char **argv);
#define main colmap_main
#include "../examples/colmap.c"
#undef main
#include "test.h"

#define FOLDER "build/t_colmap_files"

static char error[512];

/* ---- lenses ---- */

/* Where OpenCV's manual puts a ray, term by term. */
static void by_the_book(const olat_lens *l, double x, double y, double out[2]) {
    const double r = hypot(x, y), theta = atan(r), k1 = l->k[0], k2 = l->k[1], k3 = l->k[2], k4 = l->k[3];
    double u, v;
    if (l->fisheye) {
        const double d =
            theta + k1 * pow(theta, 3) + k2 * pow(theta, 5) + k3 * pow(theta, 7) + k4 * pow(theta, 9);
        u = r > 0 ? d / r * x : x, v = r > 0 ? d / r * y : y;
    } else {
        const double s = 1 + k1 * pow(r, 2) + k2 * pow(r, 4) + k3 * pow(r, 6);
        u = s * x + 2 * l->p[0] * x * y + l->p[1] * (r * r + 2 * x * x);
        v = s * y + l->p[0] * (r * r + 2 * y * y) + 2 * l->p[1] * x * y;
    }
    out[0] = l->focal[0] * u + l->centre[0];
    out[1] = l->focal[1] * v + l->centre[1];
}

/* Lenses of phones and wide ones; the last one is a pinhole. */
enum { LENSES = 9, PINHOLE = LENSES - 1, W = 120, H = 90 };
static olat_lens lens_number(int i) {
    static const double numbers[LENSES][7] = {{0, -0.1, 0, 0, 0, 0, 0},
                                              {0, 0.08, 0, 0, 0, 0, 0},
                                              {0, -0.28, 0.09, 0, 0, 0, 0},
                                              {0, -0.12, 0.03, 0.01, 0, 3e-3, -2e-3},
                                              {0, 0.05, -0.02, 0, 0, -4e-3, 1e-3},
                                              {1, 0, 0, 0, 0, 0, 0},
                                              {1, 0.03, -0.01, 0.002, -0.0005, 0, 0},
                                              {1, -0.04, 0.01, 0, 0, 0, 0},
                                              {0, 0, 0, 0, 0, 0, 0}};
    olat_lens l;
    memset(&l, 0, sizeof l);
    l.width = W, l.height = H;
    l.fisheye = numbers[i][0] > 0;
    for (int c = 0; c < 4; c++) l.k[c] = numbers[i][1 + c];
    l.p[0] = numbers[i][5], l.p[1] = numbers[i][6];
    l.focal[0] = l.fisheye ? 65 : 95, l.focal[1] = l.focal[0] * 1.02;
    l.centre[0] = 0.5 * W + 3, l.centre[1] = 0.5 * H - 2;
    return l;
}

static void test_lens_points(void) {
    for (int i = 0; i < LENSES; i++) {
        olat_lens l = lens_number(i);
        for (int k = 0; k < 200; k++) {
            const double x = 1.2 * test_uniform(1, (uint64_t)k) - 0.6,
                         y = 1.2 * test_uniform(2, (uint64_t)k) - 0.6;
            double got[2], want[2];
            const int whole = olat_lens_point(&l, k ? x : 0, k ? y : 0, got);
            by_the_book(&l, k ? x : 0, k ? y : 0, want);
            if (!CHECK(whole && fabs(got[0] - want[0]) < 1e-9 && fabs(got[1] - want[1]) < 1e-9)) return;
        }
        CHECK(olat_lens_bends(&l) == (i != PINHOLE));
        if (!CHECK(olat_lens_zoom(&l))) continue;
        if (i == PINHOLE) {
            CHECK(l.zoom == 1);
            continue;
        }
        double widest = 0;
        for (int turn = 0; turn < 2; turn++) { /* all of the picture is there; of a wider one not all */
            const double zoom = turn ? 0.999 * l.zoom : l.zoom;
            int within = 1;
            for (int k = 0; k < 4000; k++) {
                double at[2] = {W * test_uniform(3, (uint64_t)k), H * test_uniform(4, (uint64_t)k)}, ray[2],
                       want[2];
                if (k % 4 < 2) at[k % 2] = k % 8 < 4 ? 0 : k % 2 ? H : W;
                for (int c = 0; c < 2; c++) ray[c] = (at[c] - l.centre[c]) / (zoom * l.focal[c]);
                by_the_book(&l, ray[0], ray[1], want);
                widest = turn ? widest : fmax(widest, hypot(ray[0], ray[1]));
                within &= want[0] > -0.01 && want[1] > -0.01 && want[0] < W + 0.01 && want[1] < H + 0.01;
            }
            CHECK(turn || within);
            CHECK(!turn || olat__lens_holds(&l, l.zoom));
            CHECK(!turn || !olat__lens_holds(&l, zoom));
        }
        CHECK(widest <= 1.7321);
    }
    olat_lens l = lens_number(5); /* a fisheye of 180 degrees: 120 are kept, from corner to corner */
    double corner[2];
    l.focal[0] = l.focal[1] = 30;
    CHECK(olat_lens_zoom(&l));
    for (int c = 0; c < 2; c++) corner[c] = fmax(l.centre[c], (c ? H : W) - l.centre[c]) / (30 * l.zoom);
    CHECK(fabs(hypot(corner[0], corner[1]) - sqrt(3)) < 1e-6);
    l = lens_number(0);
    l.k[0] = -1e6;
    CHECK(!olat_lens_zoom(&l)); /* it folds at once */
    double at[2];
    l.k[0] = -1.0 / 3; /* r - r^3 / 3 turns at 1 */
    CHECK(olat_lens_point(&l, 0.99, 0, at) && !olat_lens_point(&l, 1.01, 0, at));
    l = lens_number(0);
    l.centre[0] = -1;
    CHECK(!olat_lens_zoom(&l)); /* what the centre shows is not there */
}

/* A smooth scene by direction: light of three colours, and alpha. */
static void scene(double x, double y, double v[4]) {
    v[0] = 0.35 + 0.3 * sin(9 * x) * cos(7 * y);
    v[1] = 0.3 + 0.25 * cos(8 * x + 3 * y);
    v[2] = 0.4 + 0.3 * sin(6 * y - 2 * x);
    v[3] = 0.6 + 0.35 * cos(3 * x - 4 * y);
}

static void store(void *pixels, ssdgs_pixels format, size_t i, double light, int is_alpha) {
    const double coded = is_alpha ? light : olat__to_srgb(light);
    if (format == SSDGS_PIXELS_RGBA32F) ((float *)pixels)[i] = (float)light;
    else if (format == SSDGS_PIXELS_RGBA16F) ((uint16_t *)pixels)[i] = olat__to_half((float)light);
    else if (format == SSDGS_PIXELS_RGBA16) ((uint16_t *)pixels)[i] = (uint16_t)(65535 * coded + 0.5);
    else ((unsigned char *)pixels)[i] = (unsigned char)(255 * coded + 0.5);
}

static double light_of(const void *pixels, ssdgs_pixels format, size_t i, int is_alpha) {
    const double v = (double)olat__number(pixels, format, i);
    return is_alpha || olat__is_light(format) ? v : v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

/* What the lens makes of the scene: each pixel's ray by steps back through it. */
static void *photograph(const olat_lens *l, ssdgs_pixels format) {
    void *pixels = calloc(4 * W * H, olat__number_size(format));
    for (int i = 0; i < W * H && pixels; i++) {
        const double to[2] = {i % W + 0.5, i / W + 0.5};
        double ray[2] = {(to[0] - l->centre[0]) / l->focal[0], (to[1] - l->centre[1]) / l->focal[1]}, v[4],
               at[2];
        for (int step = 0; step < 200; step++) {
            by_the_book(l, ray[0], ray[1], at);
            for (int c = 0; c < 2; c++) ray[c] += 0.7 * (to[c] - at[c]) / l->focal[c];
        }
        scene(ray[0], ray[1], v);
        for (int c = 0; c < 4; c++) store(pixels, format, (size_t)(4 * i + c), v[c], c == 3);
    }
    return pixels;
}

static void test_straight(void) {
    static const ssdgs_pixels formats[4] = {SSDGS_PIXELS_RGBA8, SSDGS_PIXELS_RGBA16, SSDGS_PIXELS_RGBA16F,
                                            SSDGS_PIXELS_RGBA32F};
    double worst = 0;
    for (int i = 0; i < LENSES; i++)
        for (int f = 0; f < 4; f++) {
            olat_lens l = lens_number(i);
            void *pixels = photograph(&l, formats[f]), *flat = NULL;
            if (!CHECK(pixels && olat_lens_zoom(&l) &&
                       (flat = olat_resample(pixels, formats[f], &l, 1)) != NULL))
                return;
            double sum = 0, most = 0;
            for (int k = 0; k < W * H; k++) {
                double v[4];
                scene((k % W + 0.5 - l.centre[0]) / (l.zoom * l.focal[0]),
                      (k / W + 0.5 - l.centre[1]) / (l.zoom * l.focal[1]), v);
                for (int c = 0; c < 4; c++) {
                    const double off = fabs(light_of(flat, formats[f], (size_t)(4 * k + c), c == 3) - v[c]);
                    sum += off * off, most = fmax(most, off);
                }
            }
            const double rms = sqrt(sum / (4 * W * H));
            worst = fmax(worst, rms);
            if (!CHECK(rms < (f ? 6e-4 : 2.5e-3) && most < (f ? 0.015 : 0.02)))
                printf("    lens %d, format %d: off by %g, at most %g\n", i, f, rms, most);
            if (i == PINHOLE && formats[f] != SSDGS_PIXELS_RGBA8) /* nothing changes but by rounding */
                CHECK(rms < 1e-3);
            free(pixels), free(flat);
        }
    printf("figure lens_rms %.3g\n", worst);
}

/* Nothing rings, nothing leaks from where alpha is 0, and a plain picture stays as it is. */
static void test_edges(void) {
    olat_lens l = lens_number(3);
    CHECK(olat_lens_zoom(&l));
    static unsigned char pixels[4 * W * H];
    static float lights[4 * W * H];
    for (int i = 0; i < W * H; i++) {
        const int right = i % W > W / 2;
        for (int c = 0; c < 4; c++) {
            pixels[4 * i + c] = (unsigned char)(c == 3 ? right ? 255 : 0 : right ? 40 : 250);
            lights[4 * i + c] = c == 3 ? 1 : right ? 1000.0f : 0.01f;
        }
    }
    unsigned char *flat = (unsigned char *)olat_resample(pixels, SSDGS_PIXELS_RGBA8, &l, 1);
    float *bright = (float *)olat_resample(lights, SSDGS_PIXELS_RGBA32F, &l, 1);
    int mixed = 0, colours = 0, rings = 0;
    for (int i = 0; i < W * H && flat && bright; i++) {
        mixed += flat[4 * i + 3] > 0 && flat[4 * i + 3] < 255;
        colours += flat[4 * i + 3] > 0 && flat[4 * i] != 40;
        rings += bright[4 * i] < 0.0099f || bright[4 * i] > 1000.1f;
    }
    CHECK(flat && bright && mixed > H / 2 && !colours && !rings);
    free(flat), free(bright);
}

/* Means of light, exactly rounded, of colours by their alpha. */
static void test_downscale(void) {
    static unsigned char pixels[4 * W * H];
    static uint16_t words[4 * W * H];
    for (size_t i = 0; i < sizeof pixels; i++) {
        pixels[i] = (unsigned char)(256 * test_uniform(5, i));
        words[i] = (uint16_t)(65536 * test_uniform(6, i));
        if (i % 64 < 32 && i % 4 == 3) pixels[i] = 0, words[i] = 0;
    }
    for (int times = 1; times < 8; times++) {
        olat_lens l = lens_number(PINHOLE);
        l.width = W - 1; /* 7 leaves something over */
        const int columns = l.width / times, rows = H / times;
        unsigned char *small = (unsigned char *)olat_resample(pixels, SSDGS_PIXELS_RGBA8, &l, times);
        uint16_t *fine = (uint16_t *)olat_resample(words, SSDGS_PIXELS_RGBA16, &l, times);
        int wrong = 0;
        for (int y = 0; y < rows && small && fine; y++)
            for (int x = 0; x < columns; x++) {
                double sum[2][4] = {{0, 0, 0, 0}, {0, 0, 0, 0}};
                for (int k = 0; k < times * times; k++) {
                    const size_t at = 4 * (size_t)((y * times + k / times) * (W - 1) + x * times + k % times);
                    for (int f = 0; f < 2; f++) {
                        const void *from = f ? (const void *)words : pixels;
                        const ssdgs_pixels format = f ? SSDGS_PIXELS_RGBA16 : SSDGS_PIXELS_RGBA8;
                        const double top = f ? 65535 : 255, alpha = olat__sample(from, format, at + 3) / top;
                        for (size_t c = 0; c < 3; c++) {
                            const double v = olat__sample(from, format, at + c) / top;
                            sum[f][c] += alpha * (v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
                        }
                        sum[f][3] += alpha;
                    }
                }
                for (int f = 0; f < 2; f++)
                    for (int c = 0; c < 4; c++) {
                        const double top = f ? 65535 : 255, alpha = sum[f][3],
                                     v = c == 3      ? alpha / (times * times)
                                         : alpha > 0 ? sum[f][c] / alpha
                                                     : 0,
                                     want = top * (c == 3 ? v : olat__to_srgb(v));
                        const size_t to = 4 * (size_t)(y * columns + x) + (size_t)c;
                        wrong += fabs((f ? fine[to] : small[to]) - want) > 0.5 + (f ? 0.02 : 1e-4);
                    }
            }
        CHECK(small && fine && !wrong);
        free(small), free(fine);
    }
}

/* ---- models ---- */

typedef struct text {
    unsigned char bytes[1 << 20];
    size_t size;
} text;

OLAT__PRINTF(2, 3) static void put(text *t, const char *format, ...) {
    va_list list;
    va_start(list, format);
    t->size += (size_t)vsnprintf((char *)t->bytes + t->size, sizeof t->bytes - t->size, format, list);
    va_end(list);
}

static void put_bytes(text *t, uint64_t value, int count) {
    for (int i = 0; i < count; i++) t->bytes[t->size++] = (unsigned char)(value >> 8 * i & 255);
}

static void put_double(text *t, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_bytes(t, bits, 8);
}

static int put_file(const char *folder, const char *name, const unsigned char *bytes, size_t size) {
    char path[600];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return olat__write_file(path, bytes, size, error);
}

static void remove_file(const char *folder, const char *name) {
    char path[600];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    remove(path);
}

/* A model of two phones on a ring about a ball on a table, as COLMAP writes it. */
enum { CAMERAS = 8, SHOTS = 24, POINTS = 400, BALL = 250 };
static const char *const model_names[CAMERAS] = {
    "SIMPLE_PINHOLE", "PINHOLE",        "SIMPLE_RADIAL",         "RADIAL",
    "OPENCV",         "OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE"};
static const int model_numbers[CAMERAS] = {0, 1, 2, 3, 4, 5, 8, 9},
                 model_counts[CAMERAS] = {3, 4, 4, 5, 8, 8, 4, 5};
static const double model_values[CAMERAS][8] = {{80, 32, 24},
                                                {80, 81, 32, 24},
                                                {80, 32, 24, -0.02},
                                                {80, 32, 24, -0.02, 0.01},
                                                {80, 81, 32, 24, -0.02, 0.01, 1e-3, -2e-3},
                                                {80, 81, 32, 24, -0.02, 0.01, 1e-3, -2e-3},
                                                {80, 32, 24, -0.02},
                                                {80, 32, 24, -0.02, 0.01}};
typedef struct shot {
    double q[4], t[3], centre[3];
    char name[64];
    int camera;
} shot;
#define LOOKS_ALIKE(shot) ((shot) / 2 % 3 == 0) /* a third of A and B stand close together */
static shot shots[SHOTS];                       /* A's and B's in turn */
static double points[POINTS][3];

static void make_capture(int one_camera) {
    for (int i = 0; i < SHOTS; i++) {
        shot *s = shots + i;
        const double turn = 0.5 * (i / 2) + (i % 2 ? LOOKS_ALIKE(i) ? 0.2 : 1.1 : 0),
                     high = i % 2 ? 1.3 : 0.8;
        const double eye[3] = {2 * cos(turn), 2 * sin(turn), high}, length = sqrt(4 + high * high);
        double ahead[3], right[3] = {-sin(turn), cos(turn), 0}, down[3], m[3][3];
        for (int c = 0; c < 3; c++) ahead[c] = -eye[c] / length;
        for (int c = 0; c < 3; c++)
            down[c] = ahead[(c + 1) % 3] * right[(c + 2) % 3] - ahead[(c + 2) % 3] * right[(c + 1) % 3];
        for (int c = 0; c < 3; c++)
            m[0][c] = right[c], m[1][c] = down[c], m[2][c] = ahead[c], s->centre[c] = eye[c];
        /* the largest of the four squares first */
        const double w = sqrt(fmax(0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2,
                     x = sqrt(fmax(0, 1 + m[0][0] - m[1][1] - m[2][2])) / 2,
                     y = sqrt(fmax(0, 1 - m[0][0] + m[1][1] - m[2][2])) / 2,
                     z = sqrt(fmax(0, 1 - m[0][0] - m[1][1] + m[2][2])) / 2;
        s->q[0] = w;
        s->q[1] = copysign(x, m[2][1] - m[1][2]);
        s->q[2] = copysign(y, m[0][2] - m[2][0]);
        s->q[3] = copysign(z, m[1][0] - m[0][1]);
        for (int r = 0; r < 3; r++) s->t[r] = -(m[r][0] * eye[0] + m[r][1] * eye[1] + m[r][2] * eye[2]);
        s->camera = one_camera ? 1 : i % CAMERAS;
        snprintf(s->name, sizeof s->name, "%s phone/shot %02d.png", i % 2 ? "B" : "A", 3 * (i / 2));
    }
    for (int p = 0; p < POINTS; p++) {
        const double z = 2 * test_uniform(7, (uint64_t)p) - 1,
                     turn = 6.2831853 * test_uniform(8, (uint64_t)p), across = sqrt(1 - z * z);
        points[p][0] = p < BALL ? 0.3 * across * cos(turn) : 4 * z;
        points[p][1] = p < BALL ? 0.25 * across * sin(turn) : 4 * test_uniform(9, (uint64_t)p) - 2;
        points[p][2] = p < BALL ? 0.2 * z : -0.3;
        if (p < BALL && p % 20 == 0)
            points[p][0] = points[p][1] = 0, points[p][2] = 0.33; /* only two saw it */
    }
}

/* The files into a folder, `tracks` to points; messy: as people and other tools leave the text. */
static void write_model(const char *folder, int binary, int tracks, int messy) {
    static text cameras, images, all;
    cameras.size = images.size = all.size = 0;
    if (binary) put_bytes(&cameras, CAMERAS, 8), put_bytes(&images, SHOTS, 8), put_bytes(&all, POINTS, 8);
    else put(&cameras, "# a comment\n\n"), put(&images, messy ? "" : "# two lines each\n# more\n");
    for (int c = 0; c < CAMERAS; c++) {
        if (binary) {
            put_bytes(&cameras, (uint64_t)c + 10, 4), put_bytes(&cameras, (uint64_t)model_numbers[c], 4);
            put_bytes(&cameras, 64, 8), put_bytes(&cameras, 48, 8);
        } else put(&cameras, "%d %s 64 48", c + 10, model_names[c]);
        for (int i = 0; i < model_counts[c]; i++) {
            if (binary) put_double(&cameras, model_values[c][i]);
            else put(&cameras, " %.17g", model_values[c][i]);
        }
        if (!binary) put(&cameras, messy ? " \r\n\r\n" : "\n");
    }
    for (int i = SHOTS; i-- > 0;) {
        const shot *s = shots + i;
        if (binary) put_bytes(&images, (uint64_t)i + 5, 4);
        else put(&images, "%d", i + 5);
        for (int c = 0; c < 7; c++) {
            if (binary) put_double(&images, c < 4 ? s->q[c] : s->t[c - 4]);
            else put(&images, " %.17g", c < 4 ? 2 * s->q[c] : s->t[c - 4]); /* of any length */
        }
        if (binary) {
            put_bytes(&images, (uint64_t)s->camera + 10, 4);
            memcpy(images.bytes + images.size, s->name, strlen(s->name) + 1),
                images.size += strlen(s->name) + 1;
            put_bytes(&images, 2, 8);
            for (int k = 0; k < 2; k++)
                put_double(&images, 1.5), put_double(&images, 2), put_bytes(&images, k ? 7 : UINT64_MAX, 8);
        } else {
            put(&images, " %d %s%s", s->camera + 10, s->name, messy ? " \r\n" : "\n");
            put(&images, messy && i == 0 ? "" : i % 2 ? "\n" : "1.5 2 -1 3 4.25 7\n");
        }
    }
    for (int p = 0; p < POINTS; p++) {
        if (binary) put_bytes(&all, (uint64_t)p + 1, 8);
        else put(&all, "%d", p + 1);
        for (int c = 0; c < 3; c++) {
            if (binary) put_double(&all, points[p][c]);
            else put(&all, " %.17g", points[p][c]);
        }
        if (binary)
            put_bytes(&all, 0x030201, 3), put_double(&all, 0.5),
                put_bytes(&all, tracks ? 2 + (uint64_t)p % 20 : 0, 8);
        else put(&all, " 1 2 3 0.5");
        for (int k = 0; k < 2 + p % 20 && tracks; k++) {
            if (binary) put_bytes(&all, (uint64_t)(5 + (p + k) % SHOTS), 4), put_bytes(&all, 0, 4);
            else put(&all, " %d 0", 5 + (p + k) % SHOTS);
        }
        if (!binary) put(&all, "\n");
    }
    const char *kind = binary ? "bin" : "txt";
    const text *files[3] = {&cameras, &images, &all};
    static const char *const names[3] = {"cameras", "images", "points3D"};
    for (int i = 0; i < 3; i++) {
        char name[32];
        snprintf(name, sizeof name, "%s.%s", names[i], binary ? "txt" : "bin");
        remove_file(folder, name);
        snprintf(name, sizeof name, "%s.%s", names[i], kind);
        CHECK(!put_file(folder, name, files[i]->bytes, files[i]->size));
    }
}

static int by_shot_name(const void *a, const void *b) {
    return strcmp((*(const shot *const *)a)->name, (*(const shot *const *)b)->name);
}

static void test_models(void) {
    const shot *sorted[SHOTS];
    make_capture(0);
    for (int i = 0; i < SHOTS; i++) sorted[i] = shots + i;
    qsort(sorted, SHOTS, sizeof *sorted, by_shot_name);
    for (int kind = 0; kind < 3; kind++) {
        colmap_model m;
        write_model(FOLDER, kind == 2, 1, kind == 1);
        if (!CHECK(!colmap_load(FOLDER, &m, error))) {
            printf("    %s\n", error);
            continue;
        }
        CHECK(m.camera_count == CAMERAS && m.image_count == SHOTS && m.point_count == POINTS);
        for (int c = 0; c < m.camera_count; c++) {
            const olat_lens *l = m.cameras + c;
            const double *v = model_values[c];
            const int two = c == 1 || c == 4 || c == 5, rest = two ? 4 : 3;
            CHECK(l->width == 64 && l->height == 48 && l->fisheye == (c > 4));
            CHECK(l->focal[0] == 80 && l->focal[1] == (two ? 81 : 80) && l->centre[0] == 32 &&
                  l->centre[1] == 24);
            for (int k = 0; k < 4; k++) /* of OPENCV the last two are p */
                CHECK(l->k[k] == (rest + k < model_counts[c] && (c != 4 || k < 2) ? v[rest + k] : 0));
            for (int k = 0; k < 2; k++) CHECK(l->p[k] == (c == 4 ? v[6 + k] : 0));
        }
        for (int i = 0; i < m.image_count; i++) {
            const shot *s = sorted[i];
            const colmap_image *image = m.images + i;
            const double ahead[3] = {0, 0, 1}, still[3] = {0, 0, 0}, offset[3] = {0.1, 0.2, -0.3};
            double centre[3], moved[3], back[3];
            colmap_centre(image, still, centre);
            colmap_centre(image, offset, moved);
            CHECK(!strcmp(image->name, s->name) && image->camera == s->camera &&
                  image->id == (int)(s - shots) + 5);
            CHECK_NEAR(centre, s->centre, 3, 1e-12, 1e-12, "centre");
            for (int r = 0; r < 3; r++) { /* the offset in the camera's axes again: right, down, ahead */
                back[r] = 0;
                for (int c = 0; c < 3; c++) back[r] += image->rotation[3 * r + c] * (moved[c] - centre[c]);
                CHECK(fabs(back[r] - (r ? -offset[r] : offset[r])) < 1e-12);
            }
            double at[3] = {0, 0, 0}; /* the middle of the ball is ahead */
            for (int r = 0; r < 3; r++) at[r] = image->translation[r];
            CHECK(fabs(at[0]) < 1e-12 && fabs(at[1]) < 1e-12 && at[2] * ahead[2] > 1);
        }
        int known = 1;
        for (int p = 0; p < m.point_count; p++) {
            const colmap_point *point = m.points + p;
            known &= point->seen == 2 + p % 20 && point->color[0] == 1 && point->color[2] == 3;
            for (int k = 0; k < point->seen && known; k++)
                known &= m.images[m.tracks[point->track + k]].id == 5 + (p + k) % SHOTS;
            for (int c = 0; c < 3; c++) known &= point->place[c] == points[p][c];
        }
        CHECK(known);
        colmap_free(&m);
    }
}

/* ---- the handed model ---- */

static int with_json(const char *folder, const char *name, olat__json *j) {
    olat__json_open(j, folder, name, error);
    if (j->failed) printf("    %s\n", error);
    return CHECK(!j->failed);
}

static int run_colmap(const char *words) {
    static char copy[1200];
    char *arguments[32];
    int count = 0;
    snprintf(copy, sizeof copy, "colmap %s", words);
    for (char *word = strtok(copy, " "); word; word = strtok(NULL, " ")) arguments[count++] = word;
    return colmap_main(count, arguments);
}

/* A grey photograph, and a mask of a ball in its midst. */
static int write_photo(const char *path, int width, int height, int level, double ball) {
    unsigned char *rgb = (unsigned char *)malloc(3 * (size_t)width * (size_t)height);
    char folder[600];
    snprintf(folder, sizeof folder, "%s", path);
    *strrchr(folder, '/') = 0;
    for (int i = 0; i < 3 * width * height && rgb; i++) {
        const double x = i / 3 % width + 0.5 - 0.5 * width, y = i / 3 / width + 0.5 - 0.5 * height;
        rgb[i] = (unsigned char)(ball > 0 ? 255 * (hypot(x, y) < ball) : level + i % 3);
    }
    const int failed =
        !rgb || olat_make_folder(folder, error) || olat_write_png(path, width, height, 3, rgb, error);
    free(rgb);
    return !CHECK(!failed);
}

static void test_two_phones(void) {
    char path[600];
    for (int i = 0; i < 56; i++) {
        snprintf(path, sizeof path, FOLDER "/two/%c/%c_%03d.png", i % 2 ? 'B' : 'A', i % 2 ? 'B' : 'A',
                 i / 2);
        if (write_photo(path, 478, 358, 100, 0)) return;
        snprintf(path, sizeof path, FOLDER "/two_masks/%c/%c_%03d.png", i % 2 ? 'B' : 'A', i % 2 ? 'B' : 'A',
                 i / 2);
        if (write_photo(path, 478, 358, 100, 150)) return;
    }
    if (!CHECK(!run_colmap("tests/golden/colmap --images " FOLDER "/two --masks " FOLDER
                           "/two_masks --lamp B/ -o " FOLDER "/two_out")))
        return;
    olat__json want, got, test;
    if (!with_json("tests/golden/colmap", "expected.json", &want) ||
        !with_json(FOLDER "/two_out", "transforms_train.json", &got) ||
        !with_json(FOLDER "/two_out", "transforms_test.json", &test))
        return;
    const olat__node *lists[2] = {olat__find(&want, want.nodes, "frames"),
                                  olat__find(&got, got.nodes, "frames")};
    CHECK(lists[0]->size == 2 && lists[1]->size == 49 && olat__find(&test, test.nodes, "frames")->size == 7);
    const olat__node *a = &want.nodes[lists[0]->child];
    for (int i = 0; i < 2; i++, a = &want.nodes[a->next]) {
        const olat__node *b = &got.nodes[lists[1]->child];
        static const char *const texts[2] = {"file_path", "mask_path"}, *const numbers[6] = {"w",    "h",
                                                                                             "fl_x", "fl_y",
                                                                                             "cx",   "cy"};
        for (int k = 0; k < 48 && strcmp(olat__find(&want, a, "file_path")->text,
                                         olat__find(&got, b, "file_path")->text);
             k++)
            b = &got.nodes[b->next];
        for (int k = 0; k < 2; k++)
            CHECK(!strcmp(olat__find(&want, a, texts[k])->text, olat__find(&got, b, texts[k])->text));
        double v[2][4];
        for (int k = 0; k < 6; k++)
            CHECK(olat__get(&want, a, numbers[k], 1, v[0]) && olat__get(&got, b, numbers[k], 1, v[1]) &&
                  fabs(v[0][0] - v[1][0]) < 1e-4);
        CHECK(olat__get(&want, a, "pl_pos", 3, v[0]) && olat__get(&got, b, "pl_pos", 3, v[1]));
        CHECK_NEAR(v[1], v[0], 3, 1e-5, 0, "pl_pos");
        const olat__node *rows[2] = {&want.nodes[olat__find(&want, a, "transform_matrix")->child],
                                     &got.nodes[olat__find(&got, b, "transform_matrix")->child]};
        for (int r = 0; r < 4; r++) {
            CHECK(olat__numbers(&want, rows[0], 4, v[0]) && olat__numbers(&got, rows[1], 4, v[1]));
            CHECK_NEAR(v[1], v[0], 4, 1e-5, 0, "transform_matrix");
            rows[0] = &want.nodes[rows[0]->next], rows[1] = &got.nodes[rows[1]->next];
        }
    }
    olat__json_close(&want), olat__json_close(&got), olat__json_close(&test);
}

/* ---- captures: pairs, shifts, brightness, the box ---- */

static olat_dataset lists[2];

static int read_lists(const char *folder) {
    for (int s = 0; s < 2; s++)
        if (!CHECK(!olat_load(folder, s ? "transforms_test.json" : "transforms_train.json", 0, lists + s,
                              error)))
            return printf("    %s\n", error), 0;
    return 1;
}

static const olat_frame *frame_of(const char *name) {
    for (int s = 0; s < 2; s++)
        for (int i = 0; i < lists[s].count; i++) {
            const char *file = lists[s].frames[i].file;
            if (strlen(file) >= strlen(name) && !strcmp(file + strlen(file) - strlen(name), name))
                return lists[s].frames + i;
        }
    return NULL;
}

/* Where a frame's lamp should be: a share of the way from one of B's shots to another, moved in their axes.
 */
static int lamp_at(const olat_frame *frame, int shot_before, int shot_after, double share,
                   const double offset[3]) {
    double want[3] = {0, 0, 0};
    for (int k = 0; k < 2; k++) {
        const shot *s = shots + (k ? shot_after : shot_before);
        const double w = k ? share : 1 - share, length = sqrt(4 + s->centre[2] * s->centre[2]),
                     *e = s->centre;
        const double right[3] = {-e[1] / 2, e[0] / 2, 0},
                     ahead[3] = {-e[0] / length, -e[1] / length, -e[2] / length};
        for (int c = 0; c < 3; c++) {
            const double down =
                ahead[(c + 1) % 3] * right[(c + 2) % 3] - ahead[(c + 2) % 3] * right[(c + 1) % 3];
            want[c] += w * (e[c] + offset[0] * right[c] - offset[1] * down - offset[2] * ahead[c]);
        }
    }
    double off = 0;
    for (int c = 0; c < 3 && frame; c++)
        off = fmax(off, fabs((double)frame->light.position[c] + lists[0].origin[c] - want[c]));
    return frame && off < 1e-5;
}

static void test_capture(void) {
    static const double none[3] = {0, 0, 0}, offset[3] = {0.05, -0.02, 0.1};
    char path[600];
    make_capture(1);
    for (int i = 0; i < SHOTS; i++) { /* B's have twice the light: 100 and 137 are 0.127 and 0.250 */
        snprintf(path, sizeof path, FOLDER "/capture/%s", shots[i].name);
        if (write_photo(path, 64, 48, i % 2 ? 137 : LOOKS_ALIKE(i) ? 100 : 115, 0)) return;
        snprintf(path, sizeof path, FOLDER "/masks/%s%s", shots[i].name, i % 4 < 2 ? ".png" : "");
        if (write_photo(path, 64, 48, 0, 80 * 0.32 / 2)) return;
    }
    for (int kind = 0; kind < 3; kind++) { /* with tracks, without, and without masks */
        olat_make_folder(FOLDER "/model", error);
        write_model(FOLDER "/model", kind == 1, kind == 0, kind == 2);
        snprintf(path, sizeof path,
                 FOLDER "/model --images " FOLDER "/capture %s --lamp B -o " FOLDER "/out%d",
                 kind == 2 ? "" : "--masks " FOLDER "/masks", kind);
        if (!CHECK(!run_colmap(path))) continue;
        snprintf(path, sizeof path, FOLDER "/out%d", kind);
        if (!read_lists(path)) continue;
        CHECK(lists[0].count == SHOTS - SHOTS / 8 && lists[1].count == SHOTS / 8);
        for (int i = 0; i < SHOTS; i++) {
            const olat_frame *frame = frame_of(shots[i].name);
            if (!CHECK(lamp_at(frame, i | 1, i | 1, 0, none))) continue;
            CHECK((frame->mask != NULL) == (kind < 2));
            for (int c = 0; c < 3; c++) {
                const double bright = i % 2 ? 2 : 1;
                CHECK(fabs((double)frame->light.intensity[c] - bright) <= 0.06 * (i % 2));
            }
        }
        double low[3] = {1, 1, 1}, high[3] = {-1, -1, -1}; /* of the ball's points, most of which count */
        for (int p = 0; p < BALL; p++)
            for (int c = 0; c < 3 && p % 20; c++)
                low[c] = fmin(low[c], points[p][c]), high[c] = fmax(high[c], points[p][c]);
        CHECK(lists[0].has_bounds && lists[1].has_bounds);
        for (int c = 0; c < 3 && kind < 2; c++) {
            const double *l = lists[0].bounds[0], *h = lists[0].bounds[1];
            const double most = kind && c == 2 ? 0.33 : high[c]; /* without tracks all points count */
            CHECK(l[c] < low[c] && l[c] > low[c] - 0.1 && h[c] > most && h[c] < most + 0.1);
        }
        olat_free(lists), olat_free(lists + 1);
    }
    write_model(FOLDER "/model", 1, 1, 0);
    static const struct {
        const char *words;                   /* the lamp's number is three more a shot */
        int own, first, last, before, after; /* of A's shots first .. last, the lamp's next to each */
        double share;
    } cases[5] = {{"--lamp B --shift 3", 0, 0, 20, 3, 3, 0},
                  {"--lamp B --shift -6", 0, 4, 22, -3, -3, 0},
                  {"--lamp B --shift 1.5 --offset 0.05,-0.02,0.1", 0, 0, 20, 1, 3, 0.5},
                  {"--lamp B --shift -0.75", 0, 2, 22, -1, 1, 0.75},
                  {"--offset 0.05,-0.02,0.1", 1, 0, 22, 0, 0, 0}};
    for (int i = 0; i < 5; i++) {
        snprintf(path, sizeof path, FOLDER "/model --images " FOLDER "/capture %s -o " FOLDER "/shifted",
                 cases[i].words);
        if (!CHECK(!run_colmap(path)) || !read_lists(FOLDER "/shifted")) continue;
        const double *moved = strstr(cases[i].words, "--offset") ? offset : none;
        int wrong = 0;
        for (int s = 0; s < SHOTS; s += 2) {
            const olat_frame *a = frame_of(shots[s].name), *b = frame_of(shots[s + 1].name);
            const int has = s >= cases[i].first && s <= cases[i].last;
            wrong += !a != !has || !lamp_at(b, s + 1, s + 1, 0, moved);
            if (has && !lamp_at(a, s + cases[i].before, s + cases[i].after, cases[i].share, moved)) wrong++;
        }
        if (!CHECK(!wrong)) printf("    %s: %d wrong\n", cases[i].words, wrong);
        olat_free(lists), olat_free(lists + 1);
    }
}

/* Photographs through a lens, and what COLMAP leaves out. */
static void test_folders(void) {
    char path[600];
    make_capture(1);
    for (int i = 0; i < SHOTS; i++) shots[i].camera = 4; /* OPENCV */
    olat_make_folder(FOLDER "/parts/sparse/0", error);
    olat_make_folder(FOLDER "/parts/sparse/1", error);
    write_model(FOLDER "/parts/sparse/1", 1, 1, 0);
    CHECK(!put_file(FOLDER "/parts/sparse/0", "cameras.txt",
                    (const unsigned char *)"1 PINHOLE 64 48 80 80 32 24", 27));
    CHECK(!put_file(FOLDER "/parts/sparse/0", "images.txt",
                    (const unsigned char *)"1 1 0 0 0 0 0 1 1 other.png\n\n", 29));
    CHECK(
        !run_colmap(FOLDER "/parts --images " FOLDER "/capture --masks " FOLDER "/masks -o " FOLDER "/bent"));
    if (read_lists(FOLDER "/bent")) { /* the larger model; straight here, as stored in the list */
        const olat_frame *frame = lists[0].frames;
        CHECK(lists[0].count + lists[1].count == SHOTS && strstr(lists[0].notes, "made straight"));
        CHECK(frame->lens.k[0] == -0.02 && frame->lens.p[1] == -2e-3 && frame->lens.focal[1] == 81 &&
              frame->lens.zoom != 1);
        CHECK(fabs((double)frame->camera.fy - 81 * frame->lens.zoom) < 1e-3 && frame->camera.width == 64);
        CHECK(!olat_save(FOLDER "/bent/again.json", FOLDER "/bent", lists, error));
        olat_dataset again, small;
        CHECK(!olat_load(FOLDER "/bent", "again.json", OLAT_DOWNSCALE(3), &small, error) &&
              !olat_load(FOLDER "/bent", "again.json", 0, &again, error));
        CHECK(again.has_bounds && again.bounds[1][2] == lists[0].bounds[1][2]);
        CHECK(!memcmp(&again.frames->lens, &frame->lens, sizeof frame->lens) &&
              !memcmp(again.frames->pixels, frame->pixels, 4 * 64 * 48));
        CHECK(small.frames->camera.width == 21 && small.frames->camera.height == 16);
        CHECK(fabs((double)small.frames->camera.cx - 32 / 3.0) < 1e-5 &&
              fabs(3 * (double)small.frames->camera.fx - (double)frame->camera.fx) < 1e-4);
        CHECK(olat__sample(small.frames->pixels, small.frames->format, 4 * (8 * 21 + 10) + 3) == 255 &&
              olat__sample(small.frames->pixels, small.frames->format, 3) == 0);
        olat_free(&again), olat_free(&small);
        CHECK(olat_load(FOLDER "/bent", "again.json", OLAT_DOWNSCALE(49), &small, error) &&
              strstr(error, "too few"));
        olat_free(lists), olat_free(lists + 1);
    }
    /* beside its photographs nothing is copied; other endings; photographs that are not there */
    for (int i = 0; i < 10; i++) {
        snprintf(path, sizeof path, FOLDER "/inplace/images/%s", shots[i].name);
        if (write_photo(path, 64, 48, 100, 0)) return;
    }
    CHECK(!run_colmap(FOLDER "/parts/sparse/1 --images " FOLDER "/inplace/images -o " FOLDER "/inplace"));
    if (read_lists(FOLDER "/inplace")) {
        CHECK(lists[0].count == 9 && lists[1].count == 1);
        olat_free(lists), olat_free(lists + 1);
    }
    static const struct {
        const char *words, *told;
    } refused[] = {
        {"nowhere --images " FOLDER "/capture -o " FOLDER "/no", "there is no COLMAP model"},
        {FOLDER "/parts --images " FOLDER "/parts -o " FOLDER "/no",
         "none of the 24 photographs is there, as A phone/shot 00.png"},
        {FOLDER "/parts --images " FOLDER "/capture --lamp C -o " FOLDER "/no",
         "no photograph's name begins so"},
        {FOLDER "/parts --images " FOLDER "/capture --lamp A --shift 0.1,2 -o " FOLDER "/no", NULL},
        {FOLDER "/parts --images " FOLDER "/capture --shift 1 -o " FOLDER "/no", NULL},
        {FOLDER "/parts --images " FOLDER "/capture --offset 1,2 -o " FOLDER "/no", NULL},
        {FOLDER "/parts --images " FOLDER "/capture", NULL},
        {FOLDER "/parts --images " FOLDER "/capture -o " FOLDER "/no --nothing", NULL},
        {FOLDER "/parts --images", NULL}};
    static char words[6][64] = {"colmap", FOLDER "/parts", "--images", FOLDER "/capture", "-o", ""};
    char *empty[6];
    for (int i = 0; i < 6; i++) empty[i] = words[i];
    CHECK(colmap_main(6, empty) == 2); /* a shell variable that is not set */
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        job j;
        memset(&j, 0, sizeof j);
        CHECK(run_colmap(refused[i].words) == (refused[i].told ? 1 : 2));
    }
}

/* What is somebody else's stays; lists of an earlier run go. */
static void test_kept(void) {
    unsigned char *bytes = NULL;
    size_t size = 0;
    make_capture(1);
    write_model(FOLDER "/model", 1, 1, 0);
    olat_make_folder(FOLDER "/mine/images/B phone", error);
    CHECK(!put_file(FOLDER "/mine/images/B phone", "shot 09.png", (const unsigned char *)"mine", 4));
    remove_file(FOLDER "/mine/images", "A phone/shot 00.png");
    CHECK(run_colmap(FOLDER "/model --images " FOLDER "/capture -o " FOLDER "/mine") == 1);
    CHECK(!olat__read_file(FOLDER "/mine/images/B phone/shot 09.png", &bytes, &size, error) && size == 4);
    free(bytes);
    CHECK(!olat_exists(FOLDER "/mine/images/A phone/shot 00.png")); /* nothing was begun */
    CHECK(!run_colmap(FOLDER "/model --images " FOLDER "/capture -o " FOLDER "/again"));
    CHECK(!run_colmap(FOLDER "/model --images " FOLDER "/capture -o " FOLDER "/again"));
    CHECK(olat_exists(FOLDER "/again/transforms_test.json"));
    CHECK(!put_file(FOLDER "/bad", "cameras.txt", (const unsigned char *)"1 PINHOLE 64 48 80 80 32 24", 27) &&
          !put_file(FOLDER "/bad", "images.txt",
                    (const unsigned char *)"1 1 0 0 0 0 0 1 1 A phone/shot 00.png", 37) &&
          !put_file(FOLDER "/bad", "points3D.txt", (const unsigned char *)"", 0));
    CHECK(!run_colmap(FOLDER "/bad --images " FOLDER "/capture -o " FOLDER "/again"));
    CHECK(olat_exists(FOLDER "/again/transforms_train.json") &&
          !olat_exists(FOLDER "/again/transforms_test.json"));
}

/* Names and their numbers; without one nobody's lamp is known. */
static void test_numbers(void) {
    static const struct {
        const char *name;
        double number;
    } cases[] = {{"B/frame_0012.jpg", 12},
                 {"7/a 3 b.png", 3},
                 {"a.png", -1},
                 {"B2/x.png", 2},
                 {"000", 0},
                 {"20230101120000001.png", 230101120000001.0},
                 {"12345678901234567.png", 345678901234567.0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        CHECK(number_of(cases[i].name) == cases[i].number);
    make_capture(1);
    snprintf(shots[0].name, sizeof shots[0].name, "A phone/none.png");
    if (write_photo(FOLDER "/capture/A phone/none.png", 64, 48, 100, 0)) return;
    write_model(FOLDER "/model", 1, 1, 0);
    CHECK(!run_colmap(FOLDER "/model --images " FOLDER "/capture --lamp B -o " FOLDER "/numbers"));
    if (read_lists(FOLDER "/numbers")) {
        CHECK(lists[0].count + lists[1].count == SHOTS - 1 && !frame_of("none.png"));
        olat_free(lists), olat_free(lists + 1);
    }
    CHECK(run_colmap(FOLDER "/model --images " FOLDER "/capture --lamp A -o " FOLDER "/numbers") == 1);
}

/* ---- what may be wrong with files ---- */

static int model_fails(const char *cameras, const char *images, const char *all, const char *told) {
    colmap_model m;
    CHECK(!put_file(FOLDER "/bad", "cameras.txt", (const unsigned char *)cameras, strlen(cameras)) &&
          !put_file(FOLDER "/bad", "images.txt", (const unsigned char *)images, strlen(images)) &&
          !put_file(FOLDER "/bad", "points3D.txt", (const unsigned char *)all, strlen(all)));
    error[0] = 0;
    const int failed = colmap_load(FOLDER "/bad", &m, error);
    for (int i = 0; i < m.image_count; i++) CHECK(!strchr(m.images[i].name, '\\'));
    colmap_free(&m);
    if (told ? failed && strstr(error, told) : !failed) return 1;
    printf("    wanted \"%s\", got \"%s\"\n", told ? told : "", error);
    return 0;
}

static void test_refused(void) {
    static const char camera[] = "1 PINHOLE 64 48 80 80 32 24\n", image[] = "7 1 0 0 0 0 0 1 1 a b.png\n\n",
                      point[] = "1 0 0 0 1 2 3 0.1 7 0\n";
    static const struct {
        const char *camera, *image, *point, *told;
    } cases[] = {{camera, image, point, NULL},
                 {camera, "7 1 0 0 0 0 0 1 1 a b.png", "", NULL},
                 {"", image, point, "images.txt: line 1: there is no camera 1"},
                 {"1 PINHOLE 64 48 80 80 32\n", image, point, "cameras.txt: line 1: a number was expected"},
                 {"\n1 PINHOLE 64 48 80 80 32 24 5\n", image, point, "cameras.txt: line 2: the line goes on"},
                 {"1 PINHOLE 0 48 80 80 32 24\n", image, point, "1 to 32768 pixels"},
                 {"1 PINHOLE 64.5 48 80 80 32 24\n", image, point, "a whole number was expected"},
                 {"1 PINHOLE 64 48 80 -80 32 24\n", image, point, "a focal length is not positive"},
                 {"1 PINHOLE 64 48 nan 80 32 24\n", image, point, "a number was expected"},
                 {"1 PINHOLE 64 48 1e300 80 32 24\n", image, point, "out of range"},
                 {"1 FULL_OPENCV 64 48 80 80 32 24 0 0 0 0 0 0 0 0\n", image, point,
                  "camera model FULL_OPENCV is not known here"},
                 {"1 pinhole 64 48 80 80 32 24\n", image, point, "camera model pinhole is not known here"},
                 {camera, "", point, "no image was registered"},
                 {camera, "7 0 0 0 0 0 0 1 1 a.png\n\n", point, "line 1: the quaternion is 0"},
                 {camera, "7 1 0 0 0 0 0 1 1\n\n", point, "line 1: a name was expected"},
                 {camera, "7 1 0 0 0 0 0 1 1 ../a.png\n\n", point, "leaves the folder"},
                 {camera, "7 1 0 0 0 0 0 1 1 /a.png\n\n", point, "not relative"},
                 {camera, "7 1 0 0 0 0 0 1 1 a.png\n1 2\n", point, "line 2: X, Y and POINT3D_ID"},
                 {camera, "7 1 0 0 0 0 0 1 1 a.png\n8 1 0 0 0 0 0 1 1 b.png\n", point,
                  "line 2: a number was expected"},
                 {camera, "7 1 0 0 0 0 0 1 1 a.png\n\n8 1 0 0 0 0 0 1 1 a.png\n\n", point,
                  "two images are named a.png"},
                 {camera, image, "1 0 0 0 1 2 300 0.1 7 0\n", "points3D.txt: line 1: a colour of 0 to 255"},
                 {camera, image, "1 0 0 0 1 2 3 0.1 8 0\n", "there is no image 8"},
                 {camera, image, "1 0 0 0 1 2 3 0.1 7\n", "a number was expected"},
                 {camera, image, "1 0 0 0 1 2 3\n", "a number was expected"},
                 {camera, "7 1 0 0 0 0 0 1 1 a\\b.png\n", "1 0 0 0 1 2 3 nan 7 0\n", NULL},
                 {"\xEF\xBB\xBF"
                  "1 PINHOLE 64 48 80 80 32 24\n",
                  image, point, NULL}};
    olat_make_folder(FOLDER "/bad", error);
    remove_file(FOLDER "/bad", "cameras.bin");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        CHECK(model_fails(cases[i].camera, cases[i].image, cases[i].point, cases[i].told));
}

/* Every byte changed and every truncation: a message, or a model that makes sense. */
static void test_hostile(void) {
    static const char *const names[6] = {"cameras.bin", "images.bin", "points3D.bin",
                                         "cameras.txt", "images.txt", "points3D.txt"};
    static const unsigned char values[4] = {0, 0x80, 0xff, '\n'};
    int silent = 0, cut = 0;
    make_capture(0);
    olat_make_folder(FOLDER "/hostile", error);
    for (int f = 0; f < 6; f++) {
        char path[600];
        unsigned char *bytes;
        size_t size;
        write_model(FOLDER "/hostile", f < 3, 1, 0);
        snprintf(path, sizeof path, FOLDER "/hostile/%s", names[f]);
        if (!CHECK(!olat__read_file(path, &bytes, &size, error))) return;
        const size_t step = size > 1000 ? size / 100 : 1;
        for (size_t at = 0; at < size; at += at < 100 ? 1 : step) {
            for (int v = -1; v < 4; v++) {
                colmap_model m;
                const unsigned char old = bytes[at];
                if (v >= 0) bytes[at] = values[v];
                if (put_file(FOLDER "/hostile", names[f], bytes, v < 0 ? at : size)) break;
                error[0] = 0;
                const int failed = colmap_load(FOLDER "/hostile", &m, error);
                silent += failed && !*error;
                cut += v < 0 && f < 3 && !failed; /* a binary file that is cut short is told */
                if (!failed)
                    for (int i = 0; i < m.track_count; i++)
                        silent += m.tracks[i] < 0 || m.tracks[i] >= m.image_count;
                colmap_free(&m);
                bytes[at] = old;
            }
        }
        CHECK(!put_file(FOLDER "/hostile", names[f], bytes, size));
        free(bytes);
    }
    CHECK(!silent && !cut);
}

int main(void) {
    MAKE_FOLDER("build");
    MAKE_FOLDER(FOLDER);
    test_lens_points();
    test_straight();
    test_edges();
    test_downscale();
    test_models();
    test_two_phones();
    test_capture();
    test_folders();
    test_refused();
    test_kept();
    test_numbers();
    test_hostile();
    TEST_END();
}
