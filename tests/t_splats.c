/* Plain splats as phones and editors pack them: every number, every header, every byte that is wrong. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/splats.h"
#include "test.h"

typedef struct file {
    unsigned char bytes[1 << 16];
    size_t size;
} file;

static void put(file *f, const void *bytes, size_t size) {
    memcpy(f->bytes + f->size, bytes, size);
    f->size += size;
}
static void put_text(file *f, const char *text) { put(f, text, strlen(text)); }
static void put_word(file *f, uint32_t word) {
    for (int i = 0; i < 4; i++) f->bytes[f->size++] = (unsigned char)(word >> 8 * i);
}
static void put_float(file *f, double value) {
    const float number = (float)value;
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    put_word(f, bits);
}
static double draw(uint64_t at) { return test_uniform(5, at); }

/* The model of packed bytes; NULL and a message where they are refused. */
static ssdgs_model *unpacked(ssdgs_context *context, const file *f, char error[512]) {
    unsigned char *plain = NULL;
    size_t size = 0;
    ssdgs_model *model = NULL;
    ssdgs_load_stats stats;
    if (splats_unpack("scan", f->bytes, f->size, &plain, &size, error)) {
        CHECK(!plain && !strncmp(error, "scan: ", 6));
        return NULL;
    }
    if (!CHECK(plain && !ssdgs_model_load_memory(context, plain, size, &model, &stats) && stats.plain))
        exit(1);
    CHECK(!stats.clamped_opacities && !stats.dropped);
    free(plain);
    return model;
}

static double plane(const ssdgs_model *model, int c, int i) {
    const ssdgs_model_view v = ssdgs_model_peek(model);
    return (double)v.gaussians[(size_t)c * v.stride + (size_t)i];
}

/* ---- compressed PLY ---- */

enum { COUNT = 300, SH_ROOM = 45 };
static const char *const bound_names[18] = {
    "min_x",       "min_y",       "min_z",       "max_x",       "max_y",       "max_z",
    "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z",
    "min_r",       "min_g",       "min_b",       "max_r",       "max_g",       "max_b"};
static uint32_t words[COUNT][4];
static double bounds[2][18];
static unsigned char sh[COUNT][SH_ROOM];

static void compress(file *f, int count, int bound_count, int rest, const char *newline) {
    char line[128];
    f->size = 0;
    snprintf(line, sizeof line, "ply%sformat binary_little_endian 1.0%scomment by hand%s", newline, newline,
             newline);
    put_text(f, line);
    snprintf(line, sizeof line, "element chunk %d%s", (count + 255) / 256, newline);
    put_text(f, line);
    for (int i = 0; i < bound_count; i++) {
        snprintf(line, sizeof line, "property float %s%s", bound_names[i], newline);
        put_text(f, line);
    }
    snprintf(line, sizeof line,
             "element vertex %d%sproperty uint packed_color%sproperty uint packed_position%s", count, newline,
             newline, newline);
    put_text(f, line);
    snprintf(line, sizeof line, "property uint packed_scale%sproperty uint packed_rotation%s", newline,
             newline);
    put_text(f, line);
    if (rest) {
        snprintf(line, sizeof line, "element sh %d%s", count, newline);
        put_text(f, line);
    }
    for (int i = 0; i < rest; i++) {
        snprintf(line, sizeof line, "property uchar f_rest_%d%s", i, newline);
        put_text(f, line);
    }
    snprintf(line, sizeof line, "end_header%s", newline);
    put_text(f, line);
    for (int i = 0; i < (count + 255) / 256; i++)
        for (int k = 0; k < bound_count; k++) put_float(f, bounds[i][k]);
    static const int order[4] = {3, 0, 2, 1}; /* as the header has them */
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 4; k++) put_word(f, words[i][order[k]]);
    for (int i = 0; i < count && rest; i++) put(f, sh[i], (size_t)rest);
}

static void fill(void) {
    for (int i = 0; i < COUNT; i++) {
        for (int k = 0; k < 4; k++) words[i][k] = (uint32_t)(draw((uint64_t)(10 * i + k)) * 4294967295.0);
        for (int k = 0; k < SH_ROOM; k++)
            sh[i][k] = (unsigned char)(draw((uint64_t)(9999 + 64 * i + k)) * 255);
    }
    for (int k = 0; k < SH_ROOM; k++) sh[0][k] = (unsigned char)(k & 1 ? 255 : 0);
    words[1][3] = 0xFFFFFFFFu, words[2][3] = 0xFFFFFF00u; /* opacities 1 and 0 */
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 18; k++)
            bounds[i][k] =
                (k / 3 % 2 ? 1.5 : -0.5) + draw((uint64_t)(100000 + 18 * i + k)) - (k / 6 == 1 ? 4 : 0);
}

static double within(int chunk, int low, double share) {
    return (1 - share) * (double)(float)bounds[chunk][low] + share * (double)(float)bounds[chunk][low + 3];
}

static void test_compressed(ssdgs_context *context) {
    static file f;
    static const int rests[4] = {0, 9, 24, 45};
    char error[512];
    fill();
    for (int turn = 0; turn < 8; turn++) {
        const int rest = rests[turn / 2], colored = turn % 2;
        compress(&f, COUNT, colored ? 18 : 12, rest, turn & 4 ? "\r\n" : "\n");
        ssdgs_model *model = unpacked(context, &f, error);
        if (!CHECK(model != NULL)) exit(1);
        CHECK(ssdgs_model_count(model) == COUNT &&
              3 * ssdgs__harmonics(ssdgs_model_settings(model)->harmonics) == rest);
        double off = 0;
        for (int i = 0; i < COUNT; i++) {
            const int chunk = i / 256;
            const uint32_t p = words[i][0], r = words[i][1], s = words[i][2], c = words[i][3];
            const double place[3] = {(p >> 21) / 2047.0, (p >> 11 & 1023) / 1023.0, (p & 2047) / 2047.0};
            const double scale[3] = {(s >> 21) / 2047.0, (s >> 11 & 1023) / 1023.0, (s & 2047) / 2047.0};
            const double root = sqrt(2.0);
            double parts[3], q[4], rest2 = 1;
            for (int k = 0; k < 3; k++) {
                off = fmax(off, fabs(plane(model, SSDGS_POSITION + k, i) - within(chunk, k, place[k])));
                off = fmax(off, fabs(plane(model, SSDGS_LOG_SCALE + k, i) - within(chunk, 6 + k, scale[k])));
                const double byte = (c >> (24 - 8 * k) & 255) / 255.0;
                const double color = colored ? within(chunk, 12 + k, byte) : byte;
                off = fmax(off, fabs(0.28209479177387814 * plane(model, SSDGS_DIFFUSE + k, i) + 0.5 - color));
                parts[k] = ((r >> (20 - 10 * k) & 1023) / 1023.0 - 0.5) * root;
                rest2 -= parts[k] * parts[k];
            }
            const int largest = (int)(r >> 30);
            for (int k = 0; k < 4; k++)
                q[k] = k == largest ? sqrt(rest2 > 0 ? rest2 : 0) : parts[k < largest ? k : k - 1];
            for (int k = 0; k < 4; k++) off = fmax(off, fabs(plane(model, SSDGS_ROTATION + k, i) - q[k]));
            const double opacity = 1 / (1 + exp(-plane(model, SSDGS_OPACITY, i)));
            off = fmax(off, fabs(opacity - (c & 255) / 255.0));
            for (int k = 0; k < rest; k++) {
                const int v = sh[i][k];
                const double value = v == 0 ? -4 : v == 255 ? 4 : (v + 0.5) / 32 - 4;
                off = fmax(off, fabs(plane(model, SSDGS_HARMONICS + k, i) - value));
            }
        }
        CHECK(off < 2e-6);
        ssdgs_model_destroy(model);
    }
}

/* Headers that are wrong, and what is said of them. */
static void test_headers(ssdgs_context *context) {
    static const struct {
        const char *old, *now, *says;
    } wrong[] = {{"binary_little_endian", "binary_big_endian", "is not binary_little_endian"},
                 {"property float max_y", "property float may_y", ": max_y is missing"},
                 {"property float max_g", "property float mag_g", ": max_g is missing"},
                 {"property float min_r", "property float mir_r", ": min_r is missing"},
                 {"property uint packed_scale", "property float packed_scale", ": packed_scale is missing"},
                 {"property uchar f_rest_7", "property uchar f_rust_7", ": f_rest_7 is missing"},
                 {"property uchar f_rest_8\n", "", "of no degree from 1 to 3"},
                 {"element sh 300", "element sh 299", "not all of its vertices have harmonics"},
                 {"element sh 300", "element sh 301", "ends early"},
                 {"element chunk 2", "element chunk 1", "not all of its vertices have a chunk"},
                 {"element sh 300", "element hs 300", "beside chunk, vertex and sh"},
                 {"element sh 300", "element vertex 300", "stands twice"},
                 {"element sh 300", "element sh 3e2", ": line 28: a count of rows is no number"},
                 {"element chunk 2", "element chunk -2", "is no number"},
                 {"element vertex 300", "element vertex 268435457", "too large"},
                 {"property uchar f_rest_3", "property short f_rest_3", "neither float, uint nor uchar"},
                 {"property uchar f_rest_3", "property uchar f_rest_3 4", "says nothing"},
                 {"property uchar f_rest_3", "property uchar a_name_of_twenty_four_let", "too long a name"},
                 {"end_header\n", "", "says nothing"}};
    static file f, g;
    char error[512];
    compress(&f, COUNT, 18, 9, "\n");
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        f.bytes[f.size] = 0;
        const char *at = strstr((const char *)f.bytes, wrong[i].old);
        if (!CHECK(at != NULL)) exit(1);
        const size_t before = (size_t)(at - (const char *)f.bytes), old = strlen(wrong[i].old);
        g.size = 0;
        put(&g, f.bytes, before);
        put_text(&g, wrong[i].now);
        put(&g, f.bytes + before + old, f.size - before - old);
        ssdgs_model *model = unpacked(context, &g, error);
        if (!CHECK(!model && strstr(error, wrong[i].says))) printf("    %s: %s\n", wrong[i].now, error);
        ssdgs_model_destroy(model);
    }
    compress(&f, 3, 18, 9, "\n");
    const char *end = strstr((const char *)f.bytes, "end_header\n");
    const size_t header = (size_t)(end - (const char *)f.bytes) + 11, whole = f.size;
    for (f.size = header; f.size < whole; f.size++)
        CHECK(!unpacked(context, &f, error) && strstr(error, "early"));
    for (f.size = 100; f.size < header; f.size++) { /* shorter it is no compressed one */
        unsigned char *plain = NULL;
        size_t size;
        CHECK(splats_unpack("scan", f.bytes, f.size, &plain, &size, error) || !plain);
    }
    f.size = whole;
    for (size_t i = 0; i < whole; i++) { /* any byte may be wrong */
        const unsigned char good = f.bytes[i];
        for (int turn = 0; turn < 3; turn++) {
            unsigned char *plain = NULL;
            size_t size;
            f.bytes[i] = (unsigned char)(turn == 0 ? good ^ 1 : turn == 1 ? 0 : 255);
            if (splats_unpack("scan", f.bytes, whole, &plain, &size, error))
                CHECK(!strncmp(error, "scan: ", 6));
            free(plain);
        }
        f.bytes[i] = good;
    }
}

/* ---- SPZ ---- */

/* A gzip file around bytes: stored by olat__deflate without its header; flags: as gzip has them. */
static void gzip(file *f, const unsigned char *bytes, size_t size, int flags) {
    static unsigned char packed[1 << 17];
    static uint32_t table[65536];
    static const unsigned char head[10] = {0x1F, 0x8B, 8, 0, 1, 2, 3, 4, 0, 255};
    memset(table, 0, sizeof table);
    const size_t length = olat__deflate(bytes, size, packed, table);
    f->size = 0;
    put(f, head, sizeof head);
    f->bytes[3] = (unsigned char)flags;
    if (flags & 4) put(f, "\3\0abc", 5);
    if (flags & 8) put(f, "scan.spz", 9);
    if (flags & 16) put(f, "by hand", 8);
    if (flags & 2) put(f, "xx", 2);
    put(f, packed + 2, length - 6);
    put_word(f, olat__crc32(bytes, size));
    put_word(f, (uint32_t)size);
}

enum { POINTS = 40 };
static unsigned char spz_place[POINTS][9], spz_color[POINTS][3], spz_scale[POINTS][3], spz_alpha[POINTS],
    spz_turn[POINTS][4], spz_sh[POINTS][SH_ROOM];

static void spz(file *f, int version, int count, int degree, int fraction) {
    const int rest = 3 * ssdgs__harmonics(degree);
    const unsigned char more[4] = {(unsigned char)degree, (unsigned char)fraction, 1, 0};
    f->size = 0;
    put_text(f, "NGSP");
    put_word(f, (uint32_t)version);
    put_word(f, (uint32_t)count);
    put(f, more, 4);
    for (int i = 0; i < count; i++) put(f, spz_place[i], version == 1 ? 6 : 9);
    put(f, spz_alpha, (size_t)count);
    for (int i = 0; i < count; i++) put(f, spz_color[i], 3);
    for (int i = 0; i < count; i++) put(f, spz_scale[i], 3);
    for (int i = 0; i < count; i++) put(f, spz_turn[i], version == 3 ? 4 : 3);
    for (int i = 0; i < count; i++) put(f, spz_sh[i], (size_t)rest);
}

/* Degree by degree, in the order of f_rest. */
static double harmonic(int i, const double d[3]) {
    const double x = d[0], y = d[1], z = d[2];
    const double values[15] = {y,
                               z,
                               x,
                               x * y,
                               y * z,
                               2 * z * z - x * x - y * y,
                               x * z,
                               x * x - y * y,
                               y * (3 * x * x - y * y),
                               x * y * z,
                               y * (4 * z * z - x * x - y * y),
                               z * (2 * z * z - 3 * x * x - 3 * y * y),
                               x * (4 * z * z - x * x - y * y),
                               z * (x * x - y * y),
                               x * (x * x - 3 * y * y)};
    return values[i];
}

static double signed24(const unsigned char *at) {
    const int whole = at[0] + 256 * at[1] + 65536 * at[2];
    return whole < 1 << 23 ? whole : whole - (1 << 24);
}

static void test_spz(ssdgs_context *context) {
    static file raw, f;
    static const double toward[3] = {0.3, 0.5, -0.8}, flipped[3] = {0.3, -0.5, 0.8};
    char error[512];
    for (int i = 0; i < POINTS; i++) {
        uint64_t at = (uint64_t)(1000 * i);
        for (int k = 0; k < 9; k++) spz_place[i][k] = (unsigned char)(256 * draw(at++));
        for (int k = 0; k < 3; k++) spz_color[i][k] = (unsigned char)(256 * draw(at++));
        for (int k = 0; k < 3; k++) spz_scale[i][k] = (unsigned char)(256 * draw(at++));
        for (int k = 0; k < 4; k++) spz_turn[i][k] = (unsigned char)(256 * draw(at++));
        for (int k = 0; k < SH_ROOM; k++) spz_sh[i][k] = (unsigned char)(256 * draw(at++));
        spz_alpha[i] = (unsigned char)(i < 2 ? 255 * i : 256 * draw(at++));
    }
    for (int turn = 0; turn < 12; turn++) {
        const int version = 1 + turn % 3, degree = turn / 3, rest = 3 * ssdgs__harmonics(degree),
                  fraction = 10 + degree;
        for (int i = 0; i < POINTS && version == 1; i++) /* halves of 0.25 .. 2, of both signs */
            for (int k = 1; k < 6; k += 2)
                spz_place[i][k] = (unsigned char)((spz_place[i][k] & 128) | 52 | k);
        spz(&raw, version, POINTS, degree, fraction);
        gzip(&f, raw.bytes, raw.size, turn % 2 ? 2 | 4 | 8 | 16 : 0);
        ssdgs_model *model = unpacked(context, &f, error);
        if (!CHECK(model != NULL)) exit(1);
        CHECK(ssdgs_model_count(model) == POINTS && ssdgs_model_settings(model)->harmonics == degree);
        double off = 0;
        for (int i = 0; i < POINTS; i++) {
            const unsigned char *r = spz_turn[i];
            double q[4] = {0, 0, 0, 0}, sum = 0;
            for (int k = 0; k < 3; k++) {
                const int bits = spz_place[i][2 * k] + 256 * spz_place[i][2 * k + 1];
                double x = signed24(spz_place[i] + 3 * k) / (double)(1 << fraction);
                if (version == 1)
                    x = (bits & 0x8000 ? -1 : 1) * (1024 + (bits & 1023)) * pow(2, (bits >> 10 & 31) - 25);
                if (k) x = -x;
                off = fmax(off, fabs(plane(model, SSDGS_POSITION + k, i) - x) / (1 + fabs(x)));
                off = fmax(off, fabs(plane(model, SSDGS_LOG_SCALE + k, i) - (spz_scale[i][k] / 16.0 - 10)));
                off = fmax(off,
                           fabs(plane(model, SSDGS_DIFFUSE + k, i) - (spz_color[i][k] / 255.0 - 0.5) / 0.15));
            }
            if (version < 3) {
                for (int k = 0; k < 3; k++) q[1 + k] = r[k] / 127.5 - 1, sum += q[1 + k] * q[1 + k];
                q[0] = sqrt(sum < 1 ? 1 - sum : 0);
            } else { /* w is the fourth there; the lowest bits are the last part's */
                uint32_t word =
                    (uint32_t)r[0] | (uint32_t)r[1] << 8 | (uint32_t)r[2] << 16 | (uint32_t)r[3] << 24;
                const int largest = (int)(word >> 30);
                for (int k = 3; k >= 0; k--) {
                    if (k == largest) continue;
                    const double part = (word & 511) / 511.0 / sqrt(2.0) * (word & 512 ? -1 : 1);
                    q[(k + 1) % 4] = part;
                    sum += part * part;
                    word >>= 10;
                }
                q[(largest + 1) % 4] = sqrt(sum < 1 ? 1 - sum : 0);
            }
            for (int k = 0; k < 4; k++)
                off = fmax(off, fabs(plane(model, SSDGS_ROTATION + k, i) - (k > 1 ? -q[k] : q[k])));
            off = fmax(off, fabs(1 / (1 + exp(-plane(model, SSDGS_OPACITY, i))) - spz_alpha[i] / 255.0));
            for (int k = 0; k < rest; k++) { /* the same colour from the same side */
                const double value = (spz_sh[i][k / (rest / 3) + 3 * (k % (rest / 3))] - 128) / 128.0;
                const double sign = harmonic(k % (rest / 3), flipped) / harmonic(k % (rest / 3), toward);
                off = fmax(off, fabs(plane(model, SSDGS_HARMONICS + k, i) - sign * value));
            }
        }
        if (!CHECK(off < 2e-6)) printf("    version %d, degree %d: off by %g\n", version, degree, off);
        ssdgs_model_destroy(model);
    }
}

static void test_bad_spz(ssdgs_context *context) {
    static file raw, f;
    static const struct {
        int at, value;
        const char *says;
    } wrong[] = {{0, 'M', "gzip, but no SPZ"}, {4, 0, "version 0"},
                 {4, 4, "version 4"},          {12, 4, "degree 4"},
                 {12, 3, "which are not"},     {14, 2, "extensions"},
                 {10, 200, "which are not"},   {8, POINTS - 1, "which are not"}};
    char error[512];
    spz(&raw, 2, POINTS, 1, 12);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        const unsigned char good = raw.bytes[wrong[i].at];
        raw.bytes[wrong[i].at] = (unsigned char)wrong[i].value;
        gzip(&f, raw.bytes, raw.size, 0);
        raw.bytes[wrong[i].at] = good;
        if (!CHECK(!unpacked(context, &f, error) && strstr(error, wrong[i].says))) printf("    %s\n", error);
    }
    gzip(&f, raw.bytes, raw.size + 1, 0);
    CHECK(!unpacked(context, &f, error) && strstr(error, "which are not"));
    gzip(&f, raw.bytes, 10, 0);
    CHECK(!unpacked(context, &f, error) && strstr(error, "gzip, but no SPZ"));
    spz(&raw, 3, 2, 1, 12);
    gzip(&f, raw.bytes, raw.size, 2 | 4 | 8 | 16);
    const size_t whole = f.size;
    for (f.size = 3; f.size < whole; f.size++) CHECK(!unpacked(context, &f, error));
    f.size = whole;
    put(&f, f.bytes, whole);
    CHECK(!unpacked(context, &f, error)); /* two members */
    f.size = whole;
    for (size_t i = 2; i < whole; i++)
        for (int bit = 0; bit < 8; bit++) {
            unsigned char *plain = NULL;
            size_t size;
            f.bytes[i] ^= (unsigned char)(1 << bit);
            const int told =
                i >= 4 && i < 10 + 5 + 9 + 8 + 2; /* time, system, name, comment: whatever they say */
            const int failed = splats_unpack("scan", f.bytes, whole, &plain, &size, error);
            /* the last byte of deflate has bits that nobody reads */
            CHECK(failed ? !plain && !strncmp(error, "scan: ", 6) : told || i == 3 || i == whole - 9);
            free(plain);
            f.bytes[i] ^= (unsigned char)(1 << bit);
        }
    memcpy(f.bytes, "NGSP\4\0\0\0", 8);
    CHECK(!unpacked(context, &f, error) && strstr(error, "version 4 or later"));
}

/* Files of any kind. */
static void test_files(ssdgs_context *context) {
    static file raw, f;
    char error[512] = "";
    ssdgs_model *model = NULL;
    ssdgs_load_stats stats;
    spz(&raw, 3, POINTS, 1, 12);
    gzip(&f, raw.bytes, raw.size, 0);
    CHECK(!olat__write_file("build/t_splats.spz", f.bytes, f.size, error));
    CHECK(!splats_load(context, "build/t_splats.spz", &model, &stats, error) && stats.plain);
    CHECK(ssdgs_model_count(model) == POINTS);
    CHECK(!ssdgs_model_save(model, "build/t_splats.ply"));
    ssdgs_model_destroy(model);
    CHECK(!splats_load(context, "build/t_splats.ply", &model, NULL, error));
    CHECK(ssdgs_model_count(model) == POINTS);
    ssdgs_model_destroy(model);
    model = NULL;
    CHECK(splats_load(context, "build/no_such.ply", &model, NULL, error) && !model);
    CHECK(strstr(error, "no_such.ply") != NULL);
    f.size -= 9;
    CHECK(!olat__write_file("build/t_splats.spz", f.bytes, f.size, error));
    CHECK(splats_load(context, "build/t_splats.spz", &model, NULL, error) && !model);
    CHECK(strstr(error, "t_splats.spz: gzip: ") != NULL);
    remove("build/t_splats.spz");
    remove("build/t_splats.ply");
}

int main(void) {
    ssdgs_context *context = test_context(1);
    test_compressed(context);
    test_headers(context);
    test_spz(context);
    test_bad_spz(context);
    test_files(context);
    ssdgs_context_destroy(context);
    TEST_END();
}
