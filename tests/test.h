/* The tests' tools: checks that count, and the reader of .gold files. Each program closes with "N passed, N
   failed"; lines "figure KEY VALUE" and "row ROW,ROW passed|failed NAME", of the stress catalogue, before
   that are for `make figures`. */
#ifndef SSDGS_TEST_H
#define SSDGS_TEST_H
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <direct.h>
#define MAKE_FOLDER(path) _mkdir(path)
#else
#include <sys/stat.h>
#define MAKE_FOLDER(path) mkdir(path, 0777)
#endif

static int test_passed, test_failed;

/* Whether there are denormal floats: -ffast-math may make them 0. */
static inline int test_denormal(void) {
    const volatile float least = 1.2e-38f;
    return least * 0.25f > 0;
}

static inline int test_check(int ok, const char *file, int line, const char *what) {
    if (ok) test_passed++;
    else test_failed++, printf("%s:%d: failed: %s\n", file, line, what);
    return ok;
}

/* By the bits: -ffast-math folds isfinite to a constant. */
static inline int test_finite(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return ((bits >> 52) & 0x7ff) != 0x7ff;
}

/* Takes a number's bytes to a file's order, little-endian, and back. */
static inline void test_little(void *number, size_t size) {
    const int one = 1;
    unsigned char *p = (unsigned char *)number;
    for (size_t i = 0; !*(const char *)&one && i < size / 2; i++) {
        const unsigned char kept = p[i];
        p[i] = p[size - 1 - i], p[size - 1 - i] = kept;
    }
}

/* A number of 0 .. 1 for each counter, in any order. */
static inline double test_uniform(uint64_t key, uint64_t counter) {
    uint64_t x = key * UINT64_C(0x9E3779B97F4A7C15) + counter;
    x = (x ^ (x >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94D049BB133111EB);
    x ^= x >> 31;
    x = (x + UINT64_C(0x9E3779B97F4A7C15)) * UINT64_C(0xD6E8FEB86659FD93);
    return (double)((x ^ (x >> 32)) >> 11) * (1.0 / 9007199254740992.0);
}

/* How far got is outside of absolute + relative * |want|: 1 is just inside. What is not finite is far. */
static inline double test_error(double got, double want, double absolute, double relative) {
    if (!test_finite(got) || !test_finite(want)) return 1e300;
    return fabs(got - want) / (absolute + relative * fabs(want) + 1e-300);
}

/* The larger of both; an error that is not finite is the largest. */
static inline double test_most(double most, double error) {
    if (!test_finite(error)) error = 1e300;
    return error > most ? error : most;
}

/* |got - want|^2 and |want|^2: is that within the bound? */
static double test_worst_l2; /* relative, of all that were asked */
static inline int test_l2(double error, double norm, double relative) {
    const double e = norm > 0 ? sqrt(error / norm) : 0;
    if (!(e <= test_worst_l2)) test_worst_l2 = e;
    return error <= relative * relative * norm;
}

#define CHECK(condition) test_check(!!(condition), __FILE__, __LINE__, #condition)

/* got, want: arrays of any number type. */
#define CHECK_NEAR(got, want, count, absolute, relative, name) \
    do { \
        size_t test_worst = 0, test_count = (size_t)(count); \
        double test_max = 0; \
        for (size_t test_i = 0; test_i < test_count; test_i++) { \
            const double test_e = \
                test_error((double)(got)[test_i], (double)(want)[test_i], absolute, relative); \
            if (test_e > test_max) test_max = test_e, test_worst = test_i; \
        } \
        if (!test_check(test_count > 0 && test_max <= 1, __FILE__, __LINE__, name) && test_count > 0) \
            printf("    worst at %lu of %lu: got %.9g, want %.9g, %.3g times the tolerance\n", \
                   (unsigned long)test_worst, (unsigned long)test_count, (double)(got)[test_worst], \
                   (double)(want)[test_worst], test_max); \
    } while (0)

/* |got - want| <= relative |want| in the 2-norm. */
#define CHECK_L2(got, want, count, relative, name) \
    do { \
        size_t test_count = (size_t)(count); \
        double test_sum = 0, test_norm = 0; \
        for (size_t test_i = 0; test_i < test_count; test_i++) { \
            const double test_d = (double)(got)[test_i] - (double)(want)[test_i]; \
            test_sum += test_finite(test_d) ? test_d * test_d : 1e300; \
            test_norm += (double)(want)[test_i] * (double)(want)[test_i]; \
        } \
        if (!test_check(test_count > 0 && test_l2(test_sum, test_norm, relative), __FILE__, __LINE__, name)) \
            printf("    relative error %.3g over %lu values, norm %.3g\n", \
                   sqrt(test_sum / (test_norm + 1e-300)), (unsigned long)test_count, sqrt(test_norm)); \
    } while (0)

/* How rows of the stress catalogue fared: their test's checks, those after test_failed was at before. */
static inline void test_row(int before, const char *rows, const char *name) {
    printf("row %s %s %s\n", rows, test_failed == before ? "passed" : "failed", name);
}

/* Runs their test. */
#define TEST_ROW(rows, name, test) \
    do { \
        const int test_before = test_failed; \
        test; \
        test_row(test_before, rows, name); \
    } while (0)

/* Makes of a light whose position is the unit vector towards it a directional one. */
#define TEST_PARALLEL(light) \
    do { \
        (light).kind = SSDGS_LIGHT_DIRECTIONAL; \
        for (int axis_ = 0; axis_ < 3; axis_++) (light).direction[axis_] = -(light).position[axis_]; \
    } while (0)

#define TEST_END() \
    do { \
        printf("%d passed, %d failed\n", test_passed, test_failed); \
        return test_failed != 0; \
    } while (0)

/* ---- memory that counts, and fails on demand ---- */

typedef struct test_meter {
    size_t live, peak, limit; /* bytes, the most there were, how many there may be (0: any number) */
    long calls, fail_at;      /* the call that fails (0: none), and with for_ever all that come after it */
    int for_ever;
} test_meter;

static inline void *test_allocate(void *user, size_t bytes) {
    test_meter *meter = (test_meter *)user;
    meter->calls++;
    if (meter->fail_at &&
        (meter->calls == meter->fail_at || (meter->for_ever && meter->calls > meter->fail_at)))
        return NULL;
    if (meter->limit && (bytes > meter->limit || meter->live > meter->limit - bytes)) return NULL;
    size_t *memory = (size_t *)malloc(bytes + 16); /* the size, and what keeps the rest aligned */
    if (!memory) return NULL;
    *memory = bytes;
    meter->live += bytes;
    if (meter->live > meter->peak) meter->peak = meter->live;
    return (char *)memory + 16;
}

static inline void test_release(void *user, void *memory) {
    size_t *block = (size_t *)(void *)((char *)memory - 16);
    ((test_meter *)user)->live -= *block;
    free(block);
}

/* Sets an ssdgs_context_desc's allocator. */
#define TEST_METER(desc, meter) \
    ((desc).allocator.allocate = test_allocate, (desc).allocator.release = test_release, \
     (desc).allocator.user = (meter))

#ifdef SSDGS_H
/* A context of its own threads; none ends the program. */
static inline ssdgs_context *test_context(int threads) {
    ssdgs_context_desc desc;
    ssdgs_context *context = NULL;
    memset(&desc, 0, sizeof desc);
    desc.threads = threads;
    if (!CHECK(!ssdgs_context_create(&desc, &context))) exit(1);
    return context;
}
#endif

/* ---- golden files ---- */

#define GOLD_ARRAYS 256
typedef struct gold_array {
    char name[33];
    uint32_t dims[4]; /* unused = 1 */
    size_t count;
    double *data;
} gold_array;
typedef struct gold_file {
    char path[1024];
    int count;
    gold_array array[GOLD_ARRAYS];
} gold_file;

/* The array called name; none ends the program, which counts as failed for want of its closing line. */
static inline gold_array *gold_find(gold_file *file, const char *name) {
    for (int i = 0; i < file->count; i++)
        if (!strcmp(file->array[i].name, name)) return &file->array[i];
    printf("%s: holds no array %s\n", file->path, name);
    exit(1);
    return NULL; /* for tcc */
}

static inline const double *gold(gold_file *file, const char *name, size_t *count) {
    gold_array *array = gold_find(file, name);
    if (count) *count = array->count;
    return array->data;
}

static inline void gold_close(gold_file *file) {
    while (file->count > 0) free(file->array[--file->count].data);
}

static inline uint32_t gold_u32(FILE *stream) {
    unsigned char b[4] = {0, 0, 0, 0};
    if (fread(b, 1, 4, stream) != 4) return 0;
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* Reads name.gold of the folder $SSDGS_GOLDEN, else tests/golden. 0, and a failed check, when it cannot be
   read. */
static inline int gold_open(gold_file *file, const char *name) {
    const char *folder = getenv("SSDGS_GOLDEN");
    file->count = 0;
    snprintf(file->path, sizeof file->path, "%s/%s.gold", folder && *folder ? folder : "tests/golden", name);
    FILE *stream = fopen(file->path, "rb");
    char magic[8];
    int ok = stream && fread(magic, 1, 8, stream) == 8 && !memcmp(magic, "SSDGOLD1", 8);
    const uint32_t count = ok ? gold_u32(stream) : 0;
    ok = ok && count <= GOLD_ARRAYS;
    for (uint32_t i = 0; ok && i < count; i++) {
        gold_array *array = &file->array[i];
        ok = fread(array->name, 1, 32, stream) == 32;
        array->name[32] = 0;
        gold_u32(stream);
        uint32_t k;
        for (k = 0, array->count = 1; k < 4; k++) array->count *= array->dims[k] = gold_u32(stream);
        array->data = (double *)malloc(array->count * sizeof(double) + 1);
        file->count++;
        ok = ok && array->data && fread(array->data, sizeof(double), array->count, stream) == array->count;
        for (size_t at = 0; ok && at < array->count;
             at++) { /* lowest byte first in the file, whatever the machine */
            const unsigned char *bytes = (const unsigned char *)(array->data + at);
            uint64_t word = 0;
            for (k = 8; k-- > 0;) word = word << 8 | bytes[k];
            memcpy(array->data + at, &word, sizeof word);
        }
    }
    if (stream) fclose(stream);
    if (!test_check(ok, file->path, 0, "a golden file that can be read")) gold_close(file);
    return ok;
}

#endif
