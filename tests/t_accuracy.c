/* How accurate elementary functions, dipole and ASG are, against oracles that share nothing with them; again
   in double, real64, where dipole and ASG hold to rounding. `full` tries every float in the elementary
   functions alone (an hour), `full exp` in one of them (minutes), `shading` is all the rest. */
#ifdef SSDGS__ISA
/* The header includes itself for every instruction set through SSDGS_SELF, which is this file: ahead of the
   kernels' table it slips in functions that apply the elementary ones and the dipole to arrays. */
#define EACH(name, value) \
    SSDGS__FN void F(name)(const R *a, const R *b, R *out, size_t n) { \
        size_t i; \
        V s, c; \
        for (i = 0; i < n; i += (size_t)F(lanes)) { \
            const V x = V_LOAD(a + i), y = V_LOAD(b + i); \
            s = x, c = y; \
            V_STORE(out + i, value); \
        } \
        (void)s, (void)c; \
    }
#define ssdgs__kernels \
    int F(lanes) = SSDGS__VW; \
    EACH(each_exp2, F(exp2)(x)) \
    EACH(each_exp, F(exp)(x)) \
    EACH(each_log, F(log)(x)) \
    EACH(each_log1p, F(log1p)(x)) \
    EACH(each_sin, (F(sincos)(x, &s, &c), s)) \
    EACH(each_cos, (F(sincos)(x, &s, &c), c)) \
    EACH(each_sigmoid, F(sigmoid)(x)) \
    EACH(each_softplus, F(softplus)(x)) \
    static SSDGS__UNUSED each_function *const F(elementary)[MAPS] = { \
        F(each_exp2), F(each_exp), F(each_log),     F(each_log1p), \
        F(each_sin),  F(each_cos), F(each_sigmoid), F(each_softplus)}; \
    SSDGS__FN void F(profile)(int form, const R *ss, const R *sa, const R *r, R virtual_depth, R *f, R *d, \
                              size_t n) { \
        for (size_t i = 0; i < n; i += SSDGS__VW) { \
            V slope[3]; \
            V_STORE(f + i, F(dipole)(form == SSDGS_DIPOLE_PRINTED, V_LOAD(ss + i), V_LOAD(sa + i), \
                                     V_LOAD(r + i), virtual_depth, slope)); \
            for (size_t j = 0; j < 3; j++) V_STORE(d + j * n + i, slope[j]); \
        } \
    } \
    static const SSDGS__UNUSED ssdgs__kernels
#include "../ssdgs.h"
#undef ssdgs__kernels
#undef EACH
#ifdef TEST_HAS_KERNELS
#include "kernels.h"
#endif
#else

#include "../ssdgs.h"
#include "test.h"
enum { EXP2, EXP, LOG, LOG1P, SIN, COS, SIGMOID, SOFTPLUS, MAPS, SRGB_ENCODE = MAPS, SRGB_DECODE };
#ifdef SSDGS_SELF /* the Makefile's: the tables are linked */
#undef SSDGS_SELF
#define TEST_HAS_KERNELS
#endif
#define SSDGS_SELF "tests/t_accuracy.c" /* as seen from the header */
typedef void each_function(const ssdgs_real *, const ssdgs_real *, ssdgs_real *, size_t);
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"

#define PI 3.14159265358979323846
enum { BLOCK = SSDGS__BLOCK };
static const double eps =
    sizeof(ssdgs_real) == 4 ? 1.0 / 16777216 : 1.0 / 9007199254740992.0; /* of rounding: 2^-24, 2^-53 */
static int isa;
static const ssdgs__kernels *k;
#define EVERY_ISA \
    for (isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) \
        if ((k = ssdgs__table(isa)) != NULL)

/* Does what follows the name of the instruction set in use: OF_ISA(f, (x)) calls f_avx2(x). */
#if SSDGS__SCALAR
#define OF_SCALAR(f, rest) \
    if (isa == SSDGS_ISA_SCALAR) f##_scalar rest
#else
#define OF_SCALAR(f, rest)
#endif
#if SSDGS__X86 >= 1
#define OF_SSE2(f, rest) \
    if (isa == SSDGS_ISA_SSE2) f##_sse2 rest
#else
#define OF_SSE2(f, rest)
#endif
#if SSDGS__X86 >= 2
#define OF_AVX2(f, rest) \
    if (isa == SSDGS_ISA_AVX2) f##_avx2 rest
#else
#define OF_AVX2(f, rest)
#endif
#if SSDGS__X86 >= 3
#define OF_AVX512(f, rest) \
    if (isa == SSDGS_ISA_AVX512) f##_avx512 rest
#else
#define OF_AVX512(f, rest)
#endif
#if SSDGS__NEON
#define OF_NEON(f, rest) \
    if (isa == SSDGS_ISA_NEON) f##_neon rest
#else
#define OF_NEON(f, rest)
#endif
#if SSDGS__WASM
#define OF_WASM(f, rest) \
    if (isa == SSDGS_ISA_WASM) f##_wasm rest
#else
#define OF_WASM(f, rest)
#endif
#define OF_ISA(f, rest) \
    do { \
        OF_SCALAR(f, rest); \
        OF_SSE2(f, rest); \
        OF_AVX2(f, rest); \
        OF_AVX512(f, rest); \
        OF_NEON(f, rest); \
        OF_WASM(f, rest); \
    } while (0)

static const char *isa_name(void) { return ssdgs_isa_string((ssdgs_isa)isa); }
static double draw(uint64_t counter) { return ssdgs__uniform(77, counter); }
static double max(double a, double b) { return a > b ? a : b; }
static double gap(double got, double want) { return test_finite(got) ? fabs(got - want) : 1e300; }
static void figure(const char *key, double value) { printf("figure %s %.4g\n", key, value); }

/* ---- elementary functions, in float ---- */

#ifndef SSDGS_REAL64
enum { CHUNK = 4096 };
static float in[2][CHUNK], out[CHUNK];

static void apply(int map) {
    if (map == SRGB_ENCODE) k->srgb_encode(out, NULL, in[0], CHUNK);
    if (map == SRGB_DECODE) k->srgb_decode(out, in[0], CHUNK);
    if (map >= MAPS) return;
    OF_ISA(ssdgs__elementary, [map](in[0], in[1], out, CHUNK));
}

static double sigmoid(double x) { return 1 / (1 + exp(-x)); }
static double softplus(double x) { return (x > 0 ? x : 0) + log1p(exp(-fabs(x))); }
static double srgb_encode(double x) { return x < 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055; }
static double srgb_decode(double x) { return x < 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4); }

/* A function holds from low to high. Below and above it takes the value there, or is not called (SAME, NONE).
   Its errors count in units in the last place: of the value, or of `least` where the value is smaller. The
   bounds are the worst seen in one of 67 floats, on any instruction set, rounded up: without FMA pi / 2 runs
   out of bits beyond 1e4, and powers multiply log's error. */
enum { NONE = 0, SAME_BELOW = 1, SAME_ABOVE = 2, SAME = 3 };
static const struct law {
    const char *name;
    double (*truth)(double);
    int map, beyond;
    float low, high;
    double least, bound;
} laws[] = {
    {"exp2", exp2, EXP2, SAME_BELOW, -126, 127, 0, 3.2},
    {"exp", exp, EXP, SAME, -87, 87, 0, 1.1},
    {"log", log, LOG, NONE, FLT_MIN, FLT_MAX, 0, 2.1},
    {"log1p", log1p, LOG1P, NONE, 0, 1, 0, 2.1},
    {"sin", sin, SIN, NONE, -3, 3, 0, 1.5},
    {"cos", cos, COS, NONE, -3, 3, 0, 1.6},
    {"sin_1e4", sin, SIN, NONE, -1e4f, 1e4f, 1, 0.85},
    {"cos_1e4", cos, COS, NONE, -1e4f, 1e4f, 1, 0.85},
    {"sin_1e5", sin, SIN, NONE, -1e5f, 1e5f, 1, 9},
    {"cos_1e5", cos, COS, NONE, -1e5f, 1e5f, 1, 7},
    {"sigmoid", sigmoid, SIGMOID, SAME, -87, 87, 0, 2.6},
    {"softplus", softplus, SOFTPLUS, SAME_BELOW, -87, FLT_MAX, 0, 3},
    {"srgb_encode", srgb_encode, SRGB_ENCODE, NONE, -1e4f, 1e4f, 0, 9.5},
    {"srgb_decode", srgb_decode, SRGB_DECODE, NONE, -1e4f, 16, 0, 17},
};
enum { LAWS = sizeof laws / sizeof *laws };

/* 1 / the unit in the last place of a float of this size. */
static double per_ulp(double size) {
    uint64_t bits, least = (uint64_t)(1023 - 126) << 52;
    memcpy(&bits, &size, 8);
    bits &= (uint64_t)0x7FF << 52;
    bits = ((uint64_t)(2 * 1023 + 23) << 52) - (bits > least ? bits : least);
    double inverse;
    memcpy(&inverse, &bits, 8);
    return inverse;
}

static float from_bits(uint64_t bits) {
    const uint32_t word = (uint32_t)bits;
    float x;
    memcpy(&x, &word, 4);
    return x;
}

static float law_input(const struct law *law, float x) {
    return x < law->low ? law->low : x > law->high ? law->high : x;
}

/* All floats of the domain in steps (4001 is prime to the mantissas: each exponent gets 2097), those beyond
   it in the wide ones; at last those next to the ends of the domain, to where the polynomials' pieces meet,
   and to nothing. */
static void test_law(const struct law *law, uint64_t step) {
    const float corners[] = {law->low,   law->high, 0,           -0.0f,       FLT_MIN,     -FLT_MIN,
                             1,          -1,        1.41421356f, 0.70710678f, 0.78539816f, 1.57079633f,
                             0.0031308f, 0.04045f,  0.5f,        86.5f,       1e-30f};
    static double want[CHUNK], scale[CHUNK];
    double worst[SSDGS_ISA_COUNT], value = 0, inverse = 0;
    float last = -1;
    uint64_t next = 0;
    int more = 1;
    memset(worst, 0, sizeof worst);
    float at[SSDGS_ISA_COUNT];
    memset(at, 0, sizeof at);
    while (more) {
        more = next >> 32 == 0;
        for (int i = 0; i < CHUNK; i++) {
            float x = from_bits(next), c = law_input(law, x);
            if (more) {
                next += c == x ? step : 4001;
            } else {
                uint32_t bits;
                memcpy(&bits, corners + (size_t)i / 9 % (sizeof corners / sizeof *corners), 4);
                x = from_bits((uint64_t)bits + (uint64_t)(i % 9) - 4);
                c = law_input(law, x);
            }
            if (!test_finite((double)x) || (c > x && !(law->beyond & SAME_BELOW)) ||
                (c < x && !(law->beyond & SAME_ABOVE)))
                x = c = 0.5f;
            if (c != last)
                value = law->truth((double)c), inverse = per_ulp(max(fabs(value), law->least)), last = c;
            in[0][i] = in[1][i] = x, want[i] = value, scale[i] = inverse;
        }
        EVERY_ISA {
            double most = worst[isa];
            apply(law->map);
            for (int i = 0; i < CHUNK; i++) {
                const double error = fabs((double)out[i] - want[i]) * scale[i];
                most = test_most(most, error);
            }
            if (!k->within(out, CHUNK, SSDGS__MOST)) most = 1e300;
            for (int i = 0; most > worst[isa] && i < CHUNK; i++)
                if (!test_finite((double)out[i]) || fabs((double)out[i] - want[i]) * scale[i] >= most)
                    at[isa] = in[0][i];
            worst[isa] = most;
        }
    }
    EVERY_ISA {
        char key[64];
        sprintf(key, "ulp_%s_%s", law->name, isa_name());
        figure(key, worst[isa]);
        if (!CHECK(worst[isa] <= law->bound) || step == 1)
            printf("    %s, %s: worst at %.9g\n", law->name, isa_name(), (double)at[isa]);
    }
}

/* What is not a number stays so, for the caller to find; infinities saturate. */
static void test_not_numbers(void) {
    static const struct {
        int map;
        float below, above;
    } ends[] = {{EXP, -87, 87}, {SIGMOID, -87, 87}, {SOFTPLUS, -87, 0}, {EXP2, -126, 0}};
    const float infinite = from_bits(0x7F800000u);
    EVERY_ISA {
        for (int map = EXP2; map <= SOFTPLUS; map++) {
            if (map == LOG) continue; /* its callers have bounds of their own */
            for (int i = 0; i < CHUNK; i++) in[0][i] = from_bits(i & 1 ? 0x7FC00000u : 0xFFC00001u);
            apply(map);
            int i;
            for (i = 0; i < CHUNK && !test_finite((double)out[i]);) i++;
            CHECK(i == CHUNK);
        }
        for (int map = SRGB_ENCODE; map <= SRGB_DECODE; map++) { /* what is no colour stays none */
            for (int i = 0; i < CHUNK; i++)
                in[0][i] = i % 3 == 0 ? from_bits(0x7FC00000u) : i % 3 == 1 ? infinite : -infinite;
            apply(map);
            int finite = 0;
            for (int i = 0; i < CHUNK; i++) finite += test_finite((double)out[i]);
            CHECK(!finite);
        }
        for (size_t e = 0; e < sizeof ends / sizeof *ends; e++) {
            for (int i = 0; i < CHUNK; i++) in[0][i] = i & 1 ? ends[e].above : ends[e].below;
            apply(ends[e].map);
            float limit[2];
            memcpy(limit, out, sizeof limit);
            for (int i = 0; i < CHUNK; i++)
                in[0][i] = i & 1 && ends[e].above > 0 ? infinite : i & 1 ? ends[e].above : -infinite;
            apply(ends[e].map);
            CHECK(limit[0] > 0 && !memcmp(out, limit, sizeof limit));
        }
    }
}

/* sin and cos by doubling the angle: each level doubles the error of the one before. Far out and beyond it
   stays finite. */
static void test_encode(void) {
    enum { LEVELS = 4 };
    static float x[BLOCK], code[(1 + 2 * LEVELS) * BLOCK];
    double worst = 0;
    EVERY_ISA {
        for (int round = 0; round < 200; round++) {
            for (int i = 0; i < BLOCK; i++) x[i] = (float)(20 * draw((uint64_t)(round * BLOCK + i)) - 10);
            k->encode(code, x, NULL, 1, 1, LEVELS);
            for (int l = 0; l < LEVELS; l++)
                for (int i = 0; i < BLOCK; i++) {
                    const double angle = (1 << l) * (double)x[i];
                    worst = max(worst, gap((double)code[(1 + l) * BLOCK + i], sin(angle)));
                    worst = max(worst, gap((double)code[(1 + LEVELS + l) * BLOCK + i], cos(angle)));
                }
        }
        for (int i = 0; i < BLOCK; i++) x[i] = (float)((i & 1 ? -1 : 1) * pow(10, 0.6 * i));
        x[BLOCK - 1] = from_bits(0x7F800000u);
        k->encode(code, x, NULL, 1, 1, LEVELS);
        CHECK(k->within(code + BLOCK, 2 * LEVELS * BLOCK, SSDGS__MOST));
        int i;
        for (i = BLOCK; i < (1 + 2 * LEVELS) * BLOCK && fabs((double)code[i]) <= 1.00001;) i++;
        CHECK(i == (1 + 2 * LEVELS) * BLOCK);
    }
    CHECK(worst < 3e-6);
    figure("encode_error", worst);
}
#endif

/* Plain splats' colours: real spherical harmonics by Legendre's recurrence, with the Condon-Shortley phase.
 */
static double harmonic(int l, int m, const double d[3]) {
    const double z = d[2], s = sqrt(d[0] * d[0] + d[1] * d[1]), turn = atan2(d[1], d[0]);
    const int order = abs(m);
    double p = 1, before = 0, scale = (2 * l + 1) / (4 * 3.14159265358979323846);
    for (int i = 1; i <= order; i++) p *= -(2 * i - 1) * s;
    for (int i = order + 1; i <= l; i++) {
        const double next = ((2 * i - 1) * z * p - (i + order - 1) * before) / (i - order);
        before = p, p = next;
    }
    for (int i = l - order + 1; i <= l + order; i++) scale /= i;
    return sqrt(scale) * p * (!m ? 1 : sqrt(2) * (m > 0 ? cos(order * turn) : sin(order * turn)));
}

static void test_harmonics(void) {
    static ssdgs_real at[3 * BLOCK], values[48 * BLOCK], color[3 * BLOCK];
    const ssdgs_real eye[3] = {(ssdgs_real)0.25, (ssdgs_real)-0.5, (ssdgs_real)0.125};
    static const double ahead[3] = {0, 0, 1};
    double worst = 0;
    EVERY_ISA {
        int dark = 0;
        for (int degree = 0; degree < 4; degree++) {
            const int more = (degree + 1) * (degree + 1) - 1;
            for (int i = 0; i < 3 * BLOCK; i++) at[i] = (ssdgs_real)(2 * draw((uint64_t)i) - 1);
            for (int i = 0; i < 48 * BLOCK; i++) values[i] = (ssdgs_real)(2 * draw((uint64_t)(4096 + i)) - 1);
            k->harmonics(at, values, degree, eye, color);
            for (int i = 0; i < 3 * BLOCK; i++) {
                const int s = i % BLOCK, c = i / BLOCK;
                double d[3], length = 0, want = 0.5 + harmonic(0, 0, ahead) * (double)values[i];
                for (int j = 0; j < 3; j++) d[j] = (double)at[j * BLOCK + s] - (double)eye[j];
                for (int j = 0; j < 3; j++) length += d[j] * d[j];
                for (int j = 0; j < 3; j++) d[j] /= sqrt(length);
                for (int l = 1, n = 0; l <= degree; l++)
                    for (int m = -l; m <= l; m++, n++)
                        want += harmonic(l, m, d) * (double)values[(3 + c * more + n) * BLOCK + s];
                dark += want < 0;
                worst = max(worst, fabs((double)color[i] - (want > 0 ? want : 0)));
            }
        }
        CHECK(dark > 10);
        for (int i = 0; i < 3 * BLOCK; i++) at[i] = eye[i / BLOCK]; /* no direction at all */
        k->harmonics(at, values, 3, eye, color);
        CHECK(k->within(color, 3 * BLOCK, SSDGS__MOST));
    }
    CHECK(worst < (sizeof(ssdgs_real) == 8 ? 1e-14 : 2e-6));
}

typedef double function(const double *p, const void *with);

/* df/dp[i], of fourth order. */
static double slope(function *f, double *p, int i, const void *with, double h) {
    const double p0 = p[i];
    double side[4];
    for (int s = 0; s < 4; s++) p[i] = p0 + h * (s < 2 ? s - 2 : s - 1), side[s] = f(p, with);
    p[i] = p0;
    return (8 * (side[2] - side[1]) - (side[3] - side[0])) / (12 * h);
}

/* ---- the dipole ---- */

enum { FORMS = 2, NODES = 256 };
static const char *const form_name[FORMS] = {"jensen", "printed"};
typedef struct medium {
    double ss, sa, eta;
    int form;
} medium;

/* 4 A / 3 + 1: how much deeper the virtual source lies, by Jensen's fit. */
static double boundary(double eta) {
    const double fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
    return 1 + 4 * (1 + fdr) / (3 * (1 - fdr));
}

/* R of p = sigma_s, sigma_a, r. */
static double profile(const double *p, const void *with) {
    const medium *m = (const medium *)with;
    const double st = p[0] + p[1], alpha = p[0] / st, r = p[2];
    const int printed = m->form == SSDGS_DIPOLE_PRINTED;
    const double zr = 1 / st, zv = zr * boundary(m->eta), dr = sqrt(r * r + zr * zr),
                 dv = sqrt(r * r + zv * zv);
    const double s = printed ? st : sqrt(3 * p[1] * st), inner = printed ? dr : dv,
                 outer = printed ? zr * zv : zv;
    const double real = zr * (s * dr + 1) * exp(-s * dr) / pow(dr, 3);
    const double image = outer * (s * inner + 1) * exp(-s * dv) / pow(dv, 3);
    return alpha / (4 * PI) * (real + image);
}

/* The kernel's R and derivatives at n places, a multiple of 16. */
static void kernel_profile(const medium *m, const ssdgs_real *r, int n, ssdgs_real *f,
                           ssdgs_real *derivatives) {
    ssdgs_real ss[NODES], sa[NODES];
    for (int i = 0; i < n; i++) ss[i] = (ssdgs_real)m->ss, sa[i] = (ssdgs_real)m->sa;
    OF_ISA(ssdgs__profile, (m->form, ss, sa, r, (ssdgs_real)boundary(m->eta), f, derivatives, (size_t)n));
}

/* The integral of R over the plane: the trapezoid rule in ln r, whose error falls as e^(-pi^2 / step):
   1e-17. */
static double total(const medium *m, int by_kernel) {
    ssdgs_real r[NODES];
    double sum = 0;
    for (int i = 0; i < NODES; i++) r[i] = (ssdgs_real)exp(0.25 * i - 40);
    ssdgs_real f[NODES], derivatives[3 * NODES];
    if (by_kernel) kernel_profile(m, r, NODES, f, derivatives);
    for (int i = 0; i < NODES; i++) {
        double p[3];
        p[0] = m->ss, p[1] = m->sa, p[2] = (double)r[i];
        sum += 0.25 * 2 * PI * p[2] * p[2] * (by_kernel ? (double)f[i] : profile(p, m));
    }
    return sum;
}

/* What it must be; of the printed form there is no closed one. */
static double closed(const medium *m) {
    const double st = m->ss + m->sa, alpha = m->ss / st, q = sqrt(3 * (1 - alpha)),
                 virtual_source = exp(-boundary(m->eta) * q);
    if (m->form == SSDGS_DIPOLE_PRINTED) return total(m, 0);
    return alpha / 2 * (exp(-q) + virtual_source);
}

static void test_dipole_total(void) {
    static const struct {
        double ss, sa, eta, closed, printed, digits;
    } published[] = {
        {0.05, 0.05, 1.3, 0.074507, 1.462, 1e-3}, {1.05, 0.05, 1.3, 0.421528, 0.424, 1e-3},
        {2.05, 0.05, 1.3, 0.521446, 0.347, 1e-3}, {2.05, 2.05, 1.3, 0.074507, 1.240, 1e-3},
        {0.05, 2.05, 1.3, 0.002156, 2.049, 1e-3}, {10, 0.01, 1.5, 0.82709, 0.18380 / 0.82709, 2e-5}};
    static const double etas[3] = {1, 1.3, 2.5};
    double worst[FORMS] = {0, 0}, least[FORMS] = {9, 9}, most[FORMS] = {0, 0};
    medium m;
    EVERY_ISA {
        for (size_t i = 0; i < sizeof published / sizeof *published; i++) {
            m.ss = published[i].ss, m.sa = published[i].sa, m.eta = published[i].eta;
            m.form = SSDGS_DIPOLE_JENSEN;
            CHECK(fabs(total(&m, 1) - published[i].closed) < 1e-5);
            m.form = SSDGS_DIPOLE_PRINTED;
            CHECK(fabs(total(&m, 1) / published[i].closed - published[i].printed) < published[i].digits);
        }
        for (m.form = 0; m.form < FORMS; m.form++)
            for (int e = 0; e < 3; e++)
                for (int grid = 0; grid < 81; grid++) {
                    m.ss = 0.05 + 2 * pow(grid % 9 / 8.0, 2), m.sa = 0.05 + 2 * pow(grid / 9 / 8.0, 2),
                    m.eta = etas[e];
                    medium right = m;
                    right.form = SSDGS_DIPOLE_JENSEN;
                    const double all = total(&m, 1), factor = all / closed(&right);
                    worst[m.form] = max(worst[m.form], gap(all / closed(&m), 1));
                    if (e == 1)
                        most[m.form] = max(most[m.form], factor),
                        least[m.form] = -max(-least[m.form], -factor);
                }
    }
    for (m.form = 0; m.form < FORMS; m.form++) {
        CHECK(worst[m.form] < 80 * eps);
        char key[64];
        sprintf(key, "dipole_total_error_%s", form_name[m.form]);
        figure(key, worst[m.form]);
        if (m.form != SSDGS_DIPOLE_PRINTED) continue;
        sprintf(key, "dipole_%s_to_jensen_least", form_name[m.form]);
        figure(key, least[m.form]);
        sprintf(key, "dipole_%s_to_jensen_most", form_name[m.form]);
        figure(key, most[m.form]);
    }
}

/* Lengths in another unit: R(k sigma, r / k) = k^2 R(sigma, r). With k = 2 to the bit, where the form has a
   dimension. */
static void test_dipole_units(void) {
    ssdgs_real r[2][16], f[2][16], derivatives[48];
    medium m[2];
    EVERY_ISA {
        for (m[0].form = 0; m[0].form < FORMS; m[0].form++) {
            double apart = 0;
            m[0].ss = 0.7, m[0].sa = 0.2, m[0].eta = 1.3;
            m[1] = m[0];
            m[1].ss = 2 * (double)(ssdgs_real)m[0].ss, m[1].sa = 2 * (double)(ssdgs_real)m[0].sa;
            for (int i = 0; i < 16; i++) r[0][i] = (ssdgs_real)(0.1 + 0.2 * i), r[1][i] = r[0][i] / 2;
            for (int i = 0; i < 2; i++) kernel_profile(m + i, r[i], 16, f[i], derivatives);
            for (int i = 0; i < 16; i++) apart = max(apart, gap((double)f[1][i] / (4 * (double)f[0][i]), 1));
            CHECK(m[0].form == SSDGS_DIPOLE_JENSEN ? apart == 0 : apart > 1e-3);
        }
    }
}

/* Value and derivatives against the formula, over the networks' box and far outside it. */
static void test_dipole_points(void) {
    static const double extremes[][3] = {{1, 1e-12, 1}, {1e-12, 1, 1}, {1e6, 1e3, 1e-5},   {1e6, 1, 1e-8},
                                         {1, 1, 1e-8},  {1, 1, 1e8},   {0.05, 1e-12, 1e3}, {1e-3, 1e-3, 1e4}};
    double worst[2] = {0, 0};
    medium m;
    m.eta = 1.3;
    ssdgs_real r[16], f[16], derivatives[48];
    EVERY_ISA {
        for (m.form = 0; m.form < FORMS; m.form++) {
            for (int grid = 0; grid < 64; grid++) {
                m.ss = (double)(ssdgs_real)(0.05 + 2.0 / 7 * (grid % 8));
                m.sa = (double)(ssdgs_real)(0.05 + 2.0 / 7 * (grid / 8));
                for (int i = 0; i < 16; i++) r[i] = (ssdgs_real)(0.1 + 0.2 * i);
                kernel_profile(&m, r, 16, f, derivatives);
                for (int i = 0; i < 16; i++) {
                    double p[3];
                    p[0] = m.ss, p[1] = m.sa, p[2] = (double)r[i];
                    const double want = profile(p, &m);
                    worst[0] = max(worst[0], gap((double)f[i] / want, 1));
                    for (int j = 0; j < 3; j++) { /* as a share of R / p, which is the derivative's size where
                                                 it does not pass 0 */
                        const double d = slope(profile, p, j, &m, j < 2 ? 5e-5 : 1e-4);
                        worst[1] = max(worst[1], gap((double)derivatives[16 * j + i], d) * p[j] / want);
                    }
                }
            }
            for (int grid = 0; grid < (int)(sizeof extremes / sizeof *extremes); grid++) {
                m.ss = extremes[grid][0], m.sa = extremes[grid][1];
                for (int i = 0; i < 16; i++) r[i] = (ssdgs_real)extremes[grid][2];
                kernel_profile(&m, r, 16, f, derivatives);
                const double far = profile(extremes[grid], &m); /* exponents beyond 87 saturate */
                if (!CHECK(gap((double)f[0], far) <= 1e-36 + 100 * eps * far) ||
                    !CHECK(k->within(derivatives, 48, SSDGS__MOST)))
                    printf("    %s, %s, extreme %d: got %g, want %g\n", isa_name(), form_name[m.form], grid,
                           (double)f[0], far);
            }
        }
    }
    CHECK(worst[0] < 64 * eps);
    CHECK(worst[1] < 1500 * eps + 1e-9);
    figure("dipole_error", worst[0]);
    figure("dipole_derivative_error", worst[1]);
}

/* Chandrasekhar's exact reflectance of a half space of isotropic scatterers, lit along its normal: 1 - sqrt(1
   - alpha) H(1), with H(u) = 1 / (sqrt(1 - alpha) + alpha / 2 int v H(v) / (u + v) dv). */
static double half_space(double alpha) {
    enum { STEPS = 400 };
    double h[STEPS + 1], sum = 0;
    for (int i = 0; i <= STEPS; i++) h[i] = 1;
    for (int round = 0; round < 200; round++)
        for (int i = 0; i <= STEPS; i++) { /* Simpson in w, v = w^2, for H's logarithm at 0 */
            const double u = pow(i / (double)STEPS, 2);
            int j;
            for (j = 1, sum = 0; j <= STEPS; j++) {
                const double w = j / (double)STEPS;
                sum += (j == STEPS ? 1 : j % 2 ? 4 : 2) * 2 * w * w * w * h[j] / (u + w * w) / (3 * STEPS);
            }
            h[i] = 1 / (sqrt(1 - alpha) + alpha / 2 * sum);
        }
    return 1 - sqrt(1 - alpha) * h[STEPS];
}

/* What diffusion theory misses of it at eta 1. */
static void test_half_space(void) {
    static const struct {
        double ss, sa, exact, dipole;
    } published[] = {{0.05, 2.05, 0.003709, -0.36},
                     {1.05, 1.05, 0.115226, -0.238},
                     {0.5, 0.05, 0.432242, -0.065},
                     {1.05, 0.05, 0.551029, -9},
                     {2.05, 0.05, 0.647681, -0.019}};
    for (isa = SSDGS_ISA_SCALAR; (k = ssdgs__table(isa)) == NULL; isa++) {}
    for (size_t i = 0; i < sizeof published / sizeof *published; i++) {
        const double ss = published[i].ss, sa = published[i].sa, exact = half_space(ss / (ss + sa));
        medium m;
        m.ss = ss, m.sa = sa, m.eta = 1;
        m.form = SSDGS_DIPOLE_JENSEN;
        CHECK(fabs(exact - published[i].exact) < 2e-6);
        if (published[i].dipole > -1) CHECK(fabs(total(&m, 1) / exact - 1 - published[i].dipole) < 0.002);
        char key[64];
        sprintf(key, "dipole_to_exact_albedo_%03.0f", 1000 * ss / (ss + sa));
        figure(key, total(&m, 1) / exact);
    }
}

/* The golden file: eta may differ from value to value, so each is in a vector of its own. */
static void test_dipole_golden(void) {
    static const char *const by[3] = {"sigma_s", "sigma_a", "r"};
    const int real64 = sizeof(ssdgs_real) == 8;
    gold_file file;
    if (!gold_open(&file, "dipole")) return;
    const double *places[3];
    size_t n;
    for (int j = 0; j < 3; j++) places[j] = gold(&file, by[j], &n);
    const double *eta = gold(&file, "eta", &n);
    double *f = (double *)malloc(4 * n * sizeof *f), *d = f + n;
    medium m;
    EVERY_ISA
    for (m.form = 0; m.form < FORMS; m.form++) {
        for (size_t i = 0; i < n; i++) {
            m.ss = places[0][i], m.sa = places[1][i], m.eta = eta[i];
            ssdgs_real r[16];
            for (int j = 0; j < 16; j++) r[j] = (ssdgs_real)places[2][i];
            ssdgs_real value[16], slopes[48];
            kernel_profile(&m, r, 16, value, slopes);
            f[i] = (double)value[0];
            for (int j = 0; j < 3; j++) d[(size_t)j * n + i] = (double)slopes[16 * j];
        }
        CHECK_NEAR(f, gold(&file, form_name[m.form], NULL), n, real64 ? 1e-12 : 1e-9, real64 ? 1e-9 : 3e-5,
                   form_name[m.form]);
        for (int j = 0; j < 3; j++) {
            char name[64];
            snprintf(name, sizeof name, "%s_d_%s", form_name[m.form], by[j]);
            CHECK_NEAR(d + (size_t)j * n, gold(&file, name, NULL), n, real64 ? 1e-11 : 1e-8,
                       real64 ? 1e-8 : 3e-4, name);
        }
    }
    free(f);
    gold_close(&file);
}

/* ---- the highlight: Fresnel x ASG ---- */

enum {
    POSITION = 0,
    TURN = 3,
    WEIGHTS = 7,
    LIGHT = 15,
    EYE = 18,
    PARAMETERS = 21
}; /* of a Gaussian's highlight */
typedef struct lobes {
    double eta, q[SSDGS_ASG_COUNT][4], sharpness[SSDGS_ASG_COUNT][2];
} lobes;
static ssdgs_real gauss[SSDGS_CHANNELS * BLOCK], rows[SSDGS__ROWS * BLOCK];
static ssdgs_real dgauss[SSDGS_CHANNELS * BLOCK], drows[SSDGS__ROWS * BLOCK],
    lane_sums[SSDGS__LANE_SUMS * 16];

/* v seen from the frame q: v' = v + 2 u x (u x v - w v) of the unit quaternion (w, u). */
static void into_frame(const double q[4], const double v[3], double to[3]) {
    const double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double w = q[0] / n, x = q[1] / n, y = q[2] / n, z = q[3] / n, v0 = v[0], v1 = v[1], v2 = v[2];
    const double a = y * v2 - z * v1 - w * v0, b = z * v0 - x * v2 - w * v1, c = x * v1 - y * v0 - w * v2;
    to[0] = v0 + 2 * (y * c - z * b);
    to[1] = v1 + 2 * (z * a - x * c);
    to[2] = v2 + 2 * (x * b - y * a);
}

static double unit(double v[3]) {
    const double n = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) v[i] /= n;
    return n;
}

/* f_s of p (PARAMETERS): eqs. 10 to 12. */
static double highlight(const double *p, const void *with) {
    const lobes *l = (const lobes *)with;
    double wi[3], wo[3], d = 0;
    for (int i = 0; i < 3; i++) wi[i] = p[LIGHT + i] - p[i], wo[i] = p[EYE + i] - p[i];
    unit(wi), unit(wo);
    double h[3];
    for (int i = 0; i < 3; i++) h[i] = wi[i] + wo[i];
    unit(h);
    const double cosine = wo[0] * h[0] + wo[1] * h[1] + wo[2] * h[2];
    double local[3];
    into_frame(p + TURN, h, local);
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        const double weight = log1p(exp(p[WEIGHTS + j])), *s = l->sharpness[j];
        double b[3];
        into_frame(l->q[j], local, b);
        d += weight * exp(-exp(s[0]) * b[0] * b[0] - exp(s[1]) * b[1] * b[1]);
    }
    return (0.04 + 0.96 * pow(1 - cosine, 5)) * d;
}

/* The kernels' lighting, made as for a frame. */
static ssdgs__lighting lighting(const lobes *l, const double *p) {
    ssdgs_frame frame;
    ssdgs_placed object;
    ssdgs_light light;
    memset(&frame, 0, sizeof frame);
    memset(&light, 0, sizeof light);
    memset(&object, 0, sizeof object);
    object.settings = ssdgs_settings_default();
    object.settings.eta = (ssdgs_real)l->eta;
    object.settings.asg = SSDGS_ASG_GEOMETRIC;
    object.terms = SSDGS_SPECULAR_TERM;
    object.scale = object.roughness = 1;
    for (int i = 0; i < 9; i += 4) object.rotation[i] = 1;
    frame.lights = &light;
    frame.light_count = 1;
    for (int i = 0; i < 3; i++)
        light.position[i] = (ssdgs_real)p[LIGHT + i], frame.eye[i] = (ssdgs_real)p[EYE + i];
    ssdgs_real basis[4 * SSDGS_ASG_COUNT], sharpness[2 * SSDGS_ASG_COUNT];
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        for (int i = 0; i < 4; i++) basis[4 * j + i] = (ssdgs_real)l->q[j][i];
        for (int i = 0; i < 2; i++) sharpness[2 * j + i] = (ssdgs_real)l->sharpness[j][i];
    }
    object.gaussians.asg_basis = basis, object.gaussians.asg_sharpness = sharpness;
    return ssdgs__lighting_of(&frame, &object, 0, NULL);
}

static int channel_of(int parameter) {
    const int group = parameter < TURN      ? SSDGS_POSITION
                      : parameter < WEIGHTS ? SSDGS_FRAME - TURN
                                            : SSDGS_ASG_WEIGHT - WEIGHTS;
    return parameter + group;
}

/* Puts p into lane i of the block, and rounds it to what the kernel sees. */
static void put(double *p, int i) {
    for (int c = 0; c < LIGHT; c++) gauss[channel_of(c) * BLOCK + i] = (ssdgs_real)p[c];
    for (int c = 0; c < PARAMETERS; c++) p[c] = (double)(ssdgs_real)p[c];
}

/* f_s of the block, and its gradients; returns whether all are finite. */
static int reflect(const ssdgs__lighting *light) {
    memset(drows, 0, sizeof drows);
    memset(dgauss, 0, sizeof dgauss);
    memset(lane_sums, 0, sizeof lane_sums);
    for (int i = 0; i < BLOCK; i++) drows[SSDGS__GLOSS * BLOCK + i] = 1;
    k->reflect(light, gauss, rows);
    k->reflect_backward(light, gauss, drows, dgauss, lane_sums);
    return k->within(rows, SSDGS__ROWS * BLOCK, SSDGS__MOST) &&
           k->within(dgauss, SSDGS_CHANNELS * BLOCK, SSDGS__MOST) &&
           k->within(lane_sums, SSDGS__LANE_SUMS * 16, SSDGS__MOST);
}

/* Lobes turned at random, each moderate; p: frame and weights at random, light and eye apart. */
static void random_lobes(lobes *l, double *p, uint64_t seed) {
    l->eta = 1.3;
    for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
        for (int i = 0; i < 4; i++) l->q[j][i] = (double)(ssdgs_real)(2 * draw(seed++) - 1);
        for (int i = 0; i < 2; i++) l->sharpness[j][i] = (double)(ssdgs_real)(3 * draw(seed++) - 1);
        seed++;
    }
    for (int i = TURN; i < LIGHT; i++) p[i] = 2 * draw(seed++) - 1;
    for (int i = 0; i < 3; i++) p[LIGHT + i] = i == 2 ? 3 : 1, p[EYE + i] = i == 1 ? 3 : -1;
}

/* Value and gradients at 64 random places against the formula, for 8 draws of everything. */
static void test_asg_points(void) {
    static double want[BLOCK], got[15 * BLOCK], slopes[15 * BLOCK];
    double worst = 0;
    EVERY_ISA {
        for (int round = 0; round < 8; round++) {
            double sums[2][6];
            memset(sums, 0, sizeof sums);
            double p[PARAMETERS];
            lobes l;
            for (int i = 0; i < BLOCK; i++) {
                random_lobes(&l, p, 5000 * (uint64_t)round);
                for (int c = 0; c < LIGHT; c++)
                    p[c] = 2 * draw((uint64_t)(100000 * round + LIGHT * i + c)) - 1;
                put(p, i);
                want[i] = highlight(p, &l);
                for (int c = 0; c < PARAMETERS; c++) {
                    const double d = slope(highlight, p, c, &l, 1e-4);
                    if (c < LIGHT) slopes[LIGHT * i + c] = d;
                    else sums[0][c - LIGHT] += d;
                }
            }
            ssdgs__lighting light = lighting(&l, p);
            CHECK(reflect(&light));
            for (int i = 0; i < BLOCK; i++) {
                worst = max(worst, gap((double)rows[SSDGS__GLOSS * BLOCK + i] / want[i], 1));
                for (int c = 0; c < LIGHT; c++)
                    got[LIGHT * i + c] = (double)dgauss[channel_of(c) * BLOCK + i];
            }
            for (int c = 0; c < 6; c++)
                for (int lane = 0; lane < 16; lane++) sums[1][c] += (double)lane_sums[16 * c + lane];
            CHECK_L2(got, slopes, LIGHT * BLOCK, 30 * eps + 1e-7, "gradients of the highlight");
            CHECK_L2(sums[1], sums[0], 6, 30 * eps + 1e-7, "gradients of light and eye");
        }
    }
    CHECK(worst < 200 * eps);
    figure("asg_error", worst);
}

/* Light and eye in one place make h any direction at F = F0. One lobe, turned within a turned frame, over the
   hemisphere about its own pole, by the cosine: the midpoint rule around, Simpson's in the angle; against the
   one integral that is left when the other is done by hand. */
static void test_asg_integral(void) {
    static const struct { double a, b; } cases[] = {{1, 1}, {2, 2}, {10, 10}, {1, 20}, {30, 3}};
    enum { AROUND = 64, DOWN = 200 };
    double worst = 0;
    EVERY_ISA
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        double p[PARAMETERS], sum = 0, want = 0;
        const int lobe = 3;
        lobes l;
        random_lobes(&l, p, 700 + c);
        for (int j = 0; j < SSDGS_ASG_COUNT; j++) p[WEIGHTS + j] = -100;
        p[WEIGHTS + lobe] = log(exp(1.0) - 1); /* softplus makes it 1 */
        for (int i = 0; i < 3; i++) p[LIGHT + i] = p[EYE + i] = 0;
        l.sharpness[lobe][0] = log(cases[c].a);
        l.sharpness[lobe][1] = log(cases[c].b);
        ssdgs__lighting light = lighting(&l, p);
        double back[4];
        for (int n = 0; n <= DOWN; n++) {
            const double theta = PI / 2 * n / DOWN, simpson = (n == 0 || n == DOWN ? 1
                                                               : n % 2             ? 4
                                                                                   : 2) *
                                                              PI / 2 / DOWN / 3;
            const double ring = 2 * PI * simpson * cos(theta) * sin(theta);
            for (int i = 0; i < AROUND; i++) {
                const double phi = 2 * PI * (i + 0.5) / AROUND;
                double h[3];
                h[0] = sin(theta) * cos(phi), h[1] = sin(theta) * sin(phi), h[2] = cos(theta);
                for (int j = 0; j < 4; j++) back[j] = (j ? -1 : 1) * l.q[lobe][j];
                into_frame(back, h, h);
                for (int j = 0; j < 4; j++) back[j] = (j ? -1 : 1) * p[TURN + j];
                into_frame(back, h, h);
                for (int j = 0; j < 3; j++) p[j] = -h[j]; /* the light stands at the origin */
                put(p, i);
            }
            k->reflect(&light, gauss, rows);
            for (int i = 0; i < AROUND; i++)
                sum += ring / AROUND * (double)rows[SSDGS__GLOSS * BLOCK + i] / 0.04;
        }
        for (int i = 0; i < 4096; i++) {
            const double phi = 2 * PI * i / 4096,
                         g = cases[c].a * pow(cos(phi), 2) + cases[c].b * pow(sin(phi), 2);
            want -= 2 * PI / 4096 * expm1(-g) / (2 * g);
        }
        worst = max(worst, gap(sum / want, 1));
    }
    CHECK(worst < 1e-6); /* Simpson's rule is left with 1e-8 */
    figure("asg_integral_error", worst);
}

/* Around a lobe's poles, by all orders. */
static void test_asg_poles(void) {
    static const double theta[] = {0,   1e-12, 1e-9, 1e-8, 1e-6,      9e-5, 1.1e-4, 1e-3, 1e-2,
                                   0.1, 0.41,  0.42, 1.5,  1.5707963, 1.6,  3,      3.14, PI};
    enum { CASES = sizeof theta / sizeof *theta };
    double worst[2] = {0, 0};
    EVERY_ISA {
        double p[PARAMETERS];
        lobes l;
        random_lobes(&l, p, 900);
        for (int j = 0; j < SSDGS_ASG_COUNT; j++)
            for (int i = 0; i < 4; i++) l.q[j][i] = i == 0;
        for (int i = 0; i < 4; i++) p[TURN + i] = i == 0;
        for (int i = 0; i < 3; i++) p[LIGHT + i] = p[EYE + i] = 0;
        ssdgs__lighting light = lighting(&l, p);
        for (int i = 0; i < BLOCK; i++) {
            p[0] = -sin(theta[i % CASES]) * 0.6, p[1] = -sin(theta[i % CASES]) * 0.8,
            p[2] = -cos(theta[i % CASES]);
            put(p, i);
        }
        CHECK(reflect(&light));
        for (int i = 0; i < CASES - 1; i++) {
            double size = 0, off = 0;
            for (int c = 0; c < 3; c++) p[c] = (double)gauss[(SSDGS_POSITION + c) * BLOCK + i];
            const double want = highlight(p, &l);
            worst[0] = max(worst[0], gap((double)rows[SSDGS__GLOSS * BLOCK + i] / want, 1));
            for (int c = 0; c < 3; c++) {
                const double d = slope(highlight, p, c, &l, 1e-5);
                size += fabs(d), off += gap((double)dgauss[(SSDGS_POSITION + c) * BLOCK + i], d);
            }
            worst[1] = max(worst[1], off / (size + want));
        }
    }
    CHECK(worst[0] < 30 * eps);
    CHECK(worst[1] < 20 * eps + 3e-8); /* 3e-8: the differences' own */
    figure("asg_pole_error", worst[0]);
    figure("asg_pole_gradient_error", worst[1]);
}

/* With lambda = mu = 0 the highlight is Fresnel's factor alone. The Gaussian lies between light and eye, off
   their line by all orders: wi turns into -wo, wo.h goes from 1 to 0, where h has no direction left. The sum
   wi + wo keeps what its size leaves of eps. */
static void test_fresnel(void) {
    double worst = 0, lowest = 1, highest = 0;
    EVERY_ISA
    for (int round = 0; round < 40; round++) {
        double p[PARAMETERS];
        lobes l;
        random_lobes(&l, p, 1000 + 100 * (uint64_t)round);
        for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
            l.sharpness[j][0] = l.sharpness[j][1] = -100;
            p[WEIGHTS + j] = j ? -100 : log(exp(1.0) - 1);
        }
        for (int j = 0; j < 3; j++) { /* every other round in one place: wo.h = 1, or an ulp more or less */
            p[LIGHT + j] = 2 * draw((uint64_t)(7 * round + j)) - 1;
            p[EYE + j] = (round % 2 ? 1 : -1) * p[LIGHT + j];
        }
        ssdgs__lighting light = lighting(&l, p);
        for (int i = 0; i < BLOCK; i++) {
            const double off = i == 0 ? 0 : pow(10, -9.0 * i / (BLOCK - 1) + 1);
            for (int j = 0; j < 3; j++)
                p[j] = off * (2 * draw((uint64_t)(BLOCK * 3 * round + 3 * i + j)) - 1);
            put(p, i);
        }
        CHECK(reflect(&light));
        for (int i = 0; i < BLOCK; i++) {
            const double got = (double)rows[SSDGS__GLOSS * BLOCK + i];
            double sum[3];
            for (int j = 0; j < 3; j++) {
                p[j] = (double)gauss[(SSDGS_POSITION + j) * BLOCK + i];
                sum[j] = (double)(rows[(SSDGS__WI + j) * BLOCK + i] + rows[(SSDGS__WO + j) * BLOCK + i]);
            }
            const double apart = unit(sum);
            if (apart < 1.1e-6) {
                if (apart < 0.9e-6)
                    CHECK(got == 0 && dgauss[SSDGS_POSITION * BLOCK + i] == 0); /* no half vector */
                continue;
            }
            const double want = highlight(p, &l);
            lowest = -max(-lowest, -got), highest = max(highest, got);
            worst = max(worst, gap(got, want) * apart / eps);
        }
    }
    CHECK(lowest >= 0.04 * (1 - 2 * eps) && highest <= 1 + 4 * eps);
    CHECK(worst < 40);
    figure("fresnel_least", lowest);
    figure("fresnel_most", highest);
    figure("fresnel_error_eps_by_half_vector", worst);
}

/* Raw sharpness of any size gives a finite highlight. */
static void test_asg_extremes(void) {
    static const double raw[3] = {-100, 0, 100};
    EVERY_ISA
    for (int grid = 0; grid < 9; grid++) {
        double p[PARAMETERS];
        lobes l;
        random_lobes(&l, p, 900);
        for (int j = 0; j < SSDGS_ASG_COUNT; j++) {
            l.sharpness[j][0] = raw[grid % 3], l.sharpness[j][1] = raw[grid / 3];
            for (int i = 0; i < 4; i++)
                l.q[j][i] = j % 2 ? l.q[j][i] : i == 0; /* half of them: poles that h may meet */
        }
        for (int i = 0; i < 4; i++) p[TURN + i] = i == 0;
        for (int i = 0; i < 3; i++) p[LIGHT + i] = p[EYE + i] = 0;
        ssdgs__lighting light = lighting(&l, p);
        for (int i = 0; i < BLOCK; i++) {
            for (int j = 0; j < 3; j++) p[j] = i ? 2 * draw((uint64_t)(3 * i + j)) - 1 : j == 2 ? -1 : 0;
            put(p, i);
        }
        if (!CHECK(reflect(&light))) printf("    %s, case %d\n", isa_name(), grid);
    }
}

/* The index of refraction sets the virtual source's depth, and is refused where its fit breaks down (3.85:
   infinite). */
static void test_eta(void) {
    static const struct {
        double eta;
        int good;
    } etas[] = {{1, 1}, {1.3, 1}, {2.5, 1}, {0.8, 0}, {2.6, 0}, {3.84, 0}, {3.85, 0}, {-1.3, 0}};
    ssdgs_context *context = NULL;
    if (!CHECK(!ssdgs_context_create(NULL, &context))) exit(1);
    for (size_t i = 0; i < sizeof etas / sizeof *etas; i++) {
        ssdgs_settings settings = ssdgs_settings_default();
        ssdgs_model *model = NULL;
        settings.eta = (ssdgs_real)etas[i].eta;
        CHECK((ssdgs_model_create(context, &settings, 1, &model) == SSDGS_OK) == etas[i].good);
        ssdgs_model_destroy(model);
        double p[PARAMETERS];
        lobes l;
        random_lobes(&l, p, 1);
        l.eta = etas[i].eta;
        if (etas[i].good)
            CHECK(gap((double)lighting(&l, p).virtual_depth / boundary((double)(ssdgs_real)l.eta), 1) <
                  4 * eps + 16 * DBL_EPSILON); /* at 2.5 doubles cancel to 0.12 */
    }
    ssdgs_context_destroy(context);
}

int main(int argc, char **argv) {
    const int full = argc > 1 && !strcmp(argv[1], "full");
#ifndef SSDGS_REAL64
    for (size_t l = 0; l < LAWS && (full || argc < 2); l++)
        if (argc < 3 || !strcmp(argv[2], laws[l].name)) test_law(laws + l, full ? 1 : 4001);
    if (full) TEST_END();
    test_not_numbers();
    test_encode();
#else
    if (full) TEST_END();
#endif
    test_harmonics();
    TEST_ROW("43", "dipole: total reflectance, units", (test_dipole_total(), test_dipole_units()));
    TEST_ROW("42", "dipole: media, distances and eta at their ends", (test_dipole_points(), test_eta()));
    test_dipole_golden();
    test_half_space();
    test_asg_points();
    test_asg_integral();
    TEST_ROW("38", "ASG at its poles", test_asg_poles());
    TEST_ROW("40", "Fresnel from 0.04 to 1", test_fresnel());
    TEST_ROW("39", "ASG of extreme sharpness", test_asg_extremes());
    TEST_END();
}
#endif
