/* examples/check.c: what it measures in photographs that are known, and what it says of them. cc -o
   build/t_check tests/t_check.c -lm -lpthread && build/t_check */
int check_main(int argc, char **argv);
#define main check_main
#include "../examples/check.c"
#undef main
#include "test.h"

enum { W = 96, H = 80, N = W * H };
static unsigned char bytes[N * 4];
static ssdgs_photo photo;
static const double origin[3] = {0, 0, 0};

static double gauss(uint64_t counter) {
    return sqrt(-2 * log(test_uniform(5, 2 * counter) + 1e-12)) *
           cos(6.283185307 * test_uniform(5, 2 * counter + 1));
}

/* Waves of a width in pixels from dark to bright, with noise; transparent round a disc. */
static void draw(double dark, double bright, double width, double noise, int outline) {
    const ssdgs_real eye[3] = {0, -3, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    memset(&photo, 0, sizeof photo);
    photo.camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, W, H);
    photo.light.position[0] = 2;
    photo.pixels = bytes;
    for (int i = 0; i < N; i++) {
        const int x = i % W, y = i / W, inside = hypot(x - W / 2, y - H / 2) < 36;
        const double wave = 0.5 + 0.25 * (sin(6.283185307 * x / width) + cos(6.283185307 * y / width));
        for (int c = 0; c < 3; c++) {
            const double grain = c ? 0 : noise * gauss((uint64_t)i); /* the same in all channels */
            static double shared;
            shared = c ? shared : grain;
            bytes[4 * i + c] =
                (unsigned char)fmin(255, fmax(0, 255 * (dark + (bright - dark) * wave + shared) + 0.5));
        }
        bytes[4 * i + 3] = inside || !outline ? 255 : 0;
    }
}

static facts measured(void) {
    facts f;
    memset(&f, 0, sizeof f);
    CHECK(!look_at(&photo, origin, &f));
    return f;
}

static void test_measures(void) {
    draw(0.2, 0.7, 30, 0, 1);
    const facts clean = measured();
    CHECK(clean.has_outline && fabs(clean.shown - 3.14159265 * 36 * 36 / N) < 0.01);
    CHECK(fabs(clean.bright - (double)ssdgs_srgb_decode((ssdgs_real)0.67)) < 0.06);
    CHECK(fabs(clean.dark - (double)ssdgs_srgb_decode((ssdgs_real)0.22)) < 0.02);
    CHECK(clean.clipped == 0 && clean.noise < 0.003);
    CHECK(fabs(clean.camera[1] + 1) < 1e-6 && fabs(clean.light[0] - 1) < 1e-6);
    for (int i = 1; i < 4; i++) {
        draw(0.3, 0.6, 30, 0.01 * i, 1);
        const facts noisy = measured();
        if (!CHECK(fabs(noisy.noise / (0.01 * i) - 1) < 0.12))
            printf("    %g for %g\n", noisy.noise, 0.01 * i);
    }
    draw(0.2, 0.7, 6, 0, 1);
    const facts crisp = measured();
    CHECK(crisp.sharp > 5 * clean.sharp && clean.sharp > 0);
    draw(0.2, 0.98, 30, 0, 1);
    CHECK(measured().clipped == 0);
    draw(0.2, 1.4, 30, 0, 1);
    CHECK(measured().clipped > 0.1);
    draw(0, 0.1, 30, 0, 0);
    const facts dim = measured();
    CHECK(!dim.has_outline && dim.shown < 1 && dim.bright < 0.02);
    draw(0.2, 0.7, 30, 0, 0);
    CHECK(measured().shown == 1);
    static float floats[N * 4]; /* light beyond white is not clipped */
    for (int i = 0; i < N * 4; i++) floats[i] = i % 4 == 3 ? 1 : 3;
    photo.pixels = floats;
    photo.format = SSDGS_PIXELS_RGBA32F;
    const facts light = measured();
    CHECK(light.clipped == 0 && fabs(light.bright - 3) < 1e-3);
}

static void test_coverage(void) {
    static facts f[400];
    static const double cap = 0.0669873; /* (1 - cos 30 degrees) / 2 of the sphere */
    for (int i = 0; i < 400; i++) {
        const double z = 1 - (2 * i + 1) / 400.0, turn = 2.4 * i;
        f[i].camera[0] = sqrt(1 - z * z) * cos(turn), f[i].camera[1] = sqrt(1 - z * z) * sin(turn),
        f[i].camera[2] = z;
        f[i].light[2] = i % 2 ? 1 : -1;
    }
    CHECK(fabs(coverage(f, 1, offsetof(facts, light)) - cap) < 0.003);
    CHECK(fabs(coverage(f, 2, offsetof(facts, light)) - 2 * cap) < 0.003);
    CHECK(coverage(f, 400, offsetof(facts, camera)) > 0.999);
    check k;
    memset(&k, 0, sizeof k);
    k.found[0] = k.found[1] = f;
    k.sets[0].count = k.sets[1].count = 400;
    CHECK(nearest(&k, offsetof(facts, camera)) < 1e-3);
    facts aside[2];
    memcpy(aside, f, sizeof aside);
    for (int i = 0; i < 2; i++) aside[i].light[0] = 1, aside[i].light[2] = 0;
    k.found[1] = aside;
    k.sets[1].count = 2;
    CHECK(fabs(nearest(&k, offsetof(facts, light)) - 90) < 1e-6);
    double values[5] = {5, 1, 4, 2, 3};
    CHECK(hull__quantile(values, 5, 0.5) == 3 && hull__quantile(values, 5, 0) == 1 &&
          hull__quantile(values, 5, 1) == 5 && hull__quantile(values, 0, 0.5) == 0);
}

int main(void) {
    test_measures();
    test_coverage();
    TEST_END();
}
