/* Model files: the round trip, the variants of PLY a reader meets, hostile files, failing memory and disks;
   also as real64. cc -I. -o build/t_ply tests/t_ply.c -lm -lpthread && build/t_ply       (writes under
   build/) */
#ifndef _DEFAULT_SOURCE
#define _DEFAULT_SOURCE /* directories, limits */
#endif
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/adopt.h"
#include "test.h"
#ifndef _WIN32
#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#endif

static test_meter memory;
static ssdgs_context *context;

/* ---- models ---- */

static uint32_t random_state = 1;
static uint32_t random_bits(void) { return random_state = random_state * 1664525u + 1013904223u; }

static ssdgs_real from_bits(uint32_t bits) {
    float x;
    memcpy(&x, &bits, 4);
    return (ssdgs_real)x;
}

static ssdgs_real uniform(double low, double high) { /* a float in every build */
    return (ssdgs_real)(float)(low + (high - low) * (random_bits() >> 8) / 16777216.0);
}

static ssdgs_model *make_model(int count) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    settings.scattering.layers = settings.shadow.layers = 2;
    settings.scattering.width = 2;
    settings.shadow.width = 3;
    settings.octaves.view = settings.octaves.light = 4; /* as before there were such settings */
    settings.dipole = SSDGS_DIPOLE_PRINTED;
    settings.centre[1] = (ssdgs_real)(float)-0.3;
    settings.eta = (ssdgs_real)(float)1.3;
    settings.pixel_variance = (ssdgs_real)(float)0.7;
    settings.light_scale = (ssdgs_real)(float)1e-7;
    settings.light_map.bias = (ssdgs_real)(float)0.02;
    settings.light_map.size = 300;
    settings.shadow_on_scattering = 1;
    for (int c = 0; c < 3; c++) settings.ambient[c] = (ssdgs_real)(float)(0.1 + c);
    if (ssdgs_model_create(context, &settings, count, &model) != SSDGS_OK) return NULL;
    ssdgs_model_view view = ssdgs_model_arrays(model);
    for (int channel = 0; channel < view.channels; channel++)
        for (int i = 0; i < count; i++)
            view.gaussians[(size_t)channel * view.stride + (size_t)i] = uniform(-4, 4);
    if (count > 2) { /* least, largest, minus zero */
        view.gaussians[SSDGS_DIFFUSE * view.stride] = from_bits(0x00800000u);
        view.gaussians[SSDGS_DIFFUSE * view.stride + 1] = from_bits(0xff7fffffu);
        view.gaussians[SSDGS_DIFFUSE * view.stride + 2] = from_bits(0x80000000u);
    }
    for (size_t k = 0; k < SSDGS_ASG_COUNT * 4; k++) view.asg_basis[k] = uniform(-1, 1);
    for (size_t k = 0; k < SSDGS_ASG_COUNT * 2; k++) view.asg_sharpness[k] = uniform(-1, 1);
    for (size_t k = 0; k < SSDGS_ASG_COUNT; k++) view.asg_sigma[k] = uniform(-1, 1);
    for (size_t k = 0; k < view.scattering_count; k++) view.scattering[k] = uniform(-1, 1);
    for (size_t k = 0; k < view.shadow_count; k++) view.shadow[k] = uniform(-1, 1);
    return model;
}

/* Plain splats whose colours change with the view. */
static ssdgs_model *make_baked(int count, int degree) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    settings.baked = 1;
    settings.harmonics = degree;
    settings.transfer = SSDGS_TRANSFER_NONE;
    if (ssdgs_model_create(context, &settings, count, &model) != SSDGS_OK) return NULL;
    const ssdgs_model_view view = ssdgs_model_arrays(model);
    for (size_t channel = 0; channel < (size_t)view.channels; channel++)
        for (size_t i = 0; i < (size_t)count; i++) view.gaussians[channel * view.stride + i] = uniform(-4, 4);
    for (size_t k = 0; k < model->global_count; k++) model->globals[k] = uniform(-1, 1);
    return model;
}

static int same_globals(ssdgs_model *a, ssdgs_model *b) {
    const ssdgs_model_view u = ssdgs_model_arrays(a), v = ssdgs_model_arrays(b);
    const size_t real = sizeof *u.shadow;
    return u.scattering_count == v.scattering_count && u.shadow_count == v.shadow_count &&
           !memcmp(u.asg_basis, v.asg_basis, SSDGS_ASG_COUNT * 4 * real) &&
           !memcmp(u.asg_sharpness, v.asg_sharpness, SSDGS_ASG_COUNT * 2 * real) &&
           !memcmp(u.asg_sigma, v.asg_sigma, SSDGS_ASG_COUNT * real) &&
           !memcmp(u.scattering, v.scattering, u.scattering_count * real) &&
           !memcmp(u.shadow, v.shadow, u.shadow_count * real);
}

static int same_gaussians(ssdgs_model *a, ssdgs_model *b) {
    const ssdgs_model_view u = ssdgs_model_arrays(a), v = ssdgs_model_arrays(b);
    int equal = u.count == v.count && u.channels == v.channels;
    for (int channel = 0; equal && channel < u.channels; channel++)
        equal = !memcmp(u.gaussians + (size_t)channel * u.stride, v.gaussians + (size_t)channel * v.stride,
                        (size_t)u.count * sizeof(ssdgs_real));
    return equal;
}

static int same(ssdgs_model *a, ssdgs_model *b) {
    return a && b && same_gaussians(a, b) && same_globals(a, b) &&
           !memcmp(ssdgs_model_settings(a), ssdgs_model_settings(b), sizeof(ssdgs_settings));
}

/* Plain splats: in double the other settings are no floats. */
static int same_baked(ssdgs_model *a, ssdgs_model *b) {
    return a && b && same_gaussians(a, b) && same_globals(a, b) && a->settings.baked == b->settings.baked &&
           a->settings.harmonics == b->settings.harmonics && a->settings.transfer == b->settings.transfer;
}

/* ---- bytes, and files in them ---- */

typedef struct bytes {
    unsigned char *data;
    size_t size, room;
} bytes;

static void put(bytes *to, const void *from, size_t size) {
    if (to->size + size > to->room) {
        to->room = 2 * (to->size + size) + 1024;
        to->data = (unsigned char *)realloc(to->data, to->room);
        if (!to->data) exit(1);
    }
    memcpy(to->data + to->size, from, size);
    to->size += size;
}

static void text(bytes *to, const char *words) { put(to, words, strlen(words)); }

static bytes slurp(const char *path) {
    bytes all = {NULL, 0, 0};
    unsigned char part[4096];
    size_t got;
    FILE *file = fopen(path, "rb");
    while (file && (got = fread(part, 1, sizeof part, file)) > 0) put(&all, part, got);
    if (file) fclose(file);
    return all;
}

/* Loads from a block of the exact size, so that a sanitizer sees every byte read beyond it. */
static ssdgs_result load(const void *data, size_t size, ssdgs_model **model, ssdgs_load_stats *stats) {
    void *copy = malloc(size ? size : 1);
    if (!copy) exit(1);
    if (size) memcpy(copy, data, size);
    const ssdgs_result result = ssdgs_model_load_memory(context, copy, size, model, stats);
    free(copy);
    return result;
}

/* Must be refused, with a message, and leave nothing behind. */
static int refused(const void *data, size_t size) {
    const size_t live = memory.live;
    ssdgs_model *model = NULL;
    const ssdgs_result result = load(data, size, &model, NULL);
    const int good = (result == SSDGS_ERR_FORMAT || result == SSDGS_ERR_LIMIT) && !model &&
                     ssdgs_error_message(context)[0] && memory.live == live;
    ssdgs_model_destroy(model);
    return good;
}

static int refused_text(const char *data) { return refused(data, strlen(data)); }

/* ---- a second writer: turns a saved file into its variants ---- */

static uint32_t word_at(const unsigned char *p) {
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

typedef struct column {
    char name[32];
    int integer;
} column;
typedef struct table {
    char name[32];
    int rows, columns;
    struct column column[80];
    const unsigned char *data;
} table;
typedef struct document {
    struct table table[8];
    int tables;
} document;

static document parse(const bytes *file) {
    document d;
    const char *line = (const char *)file->data;
    memset(&d, 0, sizeof d);
    for (; strncmp(line, "end_header", 10) != 0; line = strchr(line, '\n') + 1) {
        table *t = d.tables ? &d.table[d.tables - 1] : NULL;
        char type[8];
        if (sscanf(line, "element %31s %d", d.table[d.tables].name, &d.table[d.tables].rows) == 2) d.tables++;
        else if (t && sscanf(line, "property %7s %31s", type, t->column[t->columns].name) == 2)
            t->column[t->columns++].integer = !strcmp(type, "int");
    }
    const unsigned char *data = (const unsigned char *)line + 11;
    for (int i = 0; i < d.tables; i++) {
        d.table[i].data = data;
        data += (size_t)d.table[i].rows * (size_t)d.table[i].columns * 4;
    }
    CHECK(data == file->data + file->size);
    return d;
}

enum { ASCII = 0, LITTLE, BIG };
typedef struct variant {
    int format;
    const char *newline;
    int wide;         /* double for float, short for int */
    int reversed;     /* elements and properties in reverse order */
    int extras;       /* properties, lists and elements that nobody knows */
    const char *skip; /* this property or element is left out */
} variant;

static void put_value(bytes *to, const variant *v, const char *type, double value) {
    size_t size = 0;
    if (v->format == ASCII) {
        char digits[40];
        sprintf(digits, type[0] == 'f' ? "%.9g " : type[0] == 'd' ? "%.17E\t" : "%.0f ", value);
        text(to, digits);
        return;
    }
    unsigned char raw[8];
    if (type[0] == 'f') {
        const float x = (float)value;
        uint32_t bits;
        memcpy(&bits, &x, 4);
        size_t i;
        for (size = 4, i = 0; i < 4; i++) raw[i] = (unsigned char)(bits >> 8 * i);
    } else if (type[0] == 'd') {
        uint64_t bits;
        memcpy(&bits, &value, 8);
        size_t i;
        for (size = 8, i = 0; i < 8; i++) raw[i] = (unsigned char)(bits >> 8 * i);
    } else {
        const int32_t x = (int32_t)value;
        size = strstr(type, "short") ? 2 : strstr(type, "char") ? 1 : 4;
        for (size_t i = 0; i < size; i++) raw[i] = (unsigned char)((uint32_t)x >> 8 * i);
    }
    for (size_t i = 0; i < size; i++) put(to, &raw[v->format == BIG ? size - 1 - i : i], 1);
}

static bytes emit(const document *d, const variant *v) {
    static const char *const formats[3] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const char *real = v->wide ? "double" : "float", *integer = v->wide ? "short" : "int";
    bytes to = {NULL, 0, 0};
    char line[128];
    sprintf(line, "ply%sformat %s 1.0%sobj_info of a test%s", v->newline, formats[v->format], v->newline,
            v->newline);
    text(&to, line);
    for (int pass = 0; pass < 2; pass++) { /* header, data */
        if (v->extras && !pass) {
            sprintf(line,
                    "element face 2%sproperty list uchar int corners%selement void 99999999%scomment  %s",
                    v->newline, v->newline, v->newline, v->newline);
            text(&to, line);
        }
        for (int c = 0; v->extras && pass && c < 8; c++) {
            put_value(&to, v, c == 0 || c == 4 ? "uchar" : "int", 3);
            if (c % 4 == 3 && v->format == ASCII) text(&to, v->newline);
        }
        for (int t = 0; t < d->tables; t++) {
            const table *from = &d->table[v->reversed ? d->tables - 1 - t : t];
            if (v->skip && !strcmp(from->name, v->skip)) continue;
            if (!pass) {
                sprintf(line, "element\t%s  %d %s", from->name, from->rows, v->newline);
                text(&to, line);
            }
            for (int row = 0; row < (pass ? from->rows : 1); row++) {
                if (v->extras && !pass) {
                    sprintf(line, "property list ushort double tags%sproperty char sign%s", v->newline,
                            v->newline);
                    text(&to, line);
                }
                if (v->extras && pass) {
                    put_value(&to, v, "ushort", row % 3);
                    for (int c = 0; c < row % 3; c++) put_value(&to, v, "double", 1e300);
                    put_value(&to, v, "char", -1);
                }
                for (int c = 0; c < from->columns; c++) {
                    const int k = v->reversed ? from->columns - 1 - c : c;
                    const unsigned char *raw =
                        from->data + ((size_t)row * (size_t)from->columns + (size_t)k) * 4;
                    const uint32_t bits = word_at(raw);
                    const char *type = from->column[k].integer ? integer : real;
                    if (v->skip && !strcmp(from->column[k].name, v->skip)) continue;
                    if (pass) {
                        put_value(&to, v, type,
                                  from->column[k].integer ? (double)(int32_t)bits : (double)from_bits(bits));
                    } else {
                        sprintf(line, "property %s %s%s", type, from->column[k].name, v->newline);
                        text(&to, line);
                    }
                }
                if (pass && v->format == ASCII) text(&to, v->newline);
            }
        }
        if (!pass) text(&to, "end_header"), text(&to, v->newline);
    }
    return to;
}

/* ---- the tests ---- */

#ifdef SSDGS_REAL64
#define FILES_AS "build/t_ply_64"
#define FILES_AS_WIDE L"build/t_ply_64"
#else
#define FILES_AS "build/t_ply"
#define FILES_AS_WIDE L"build/t_ply"
#endif
static const char path[] = FILES_AS ".ply";

static bytes saved(const ssdgs_model *model) {
    CHECK(ssdgs_model_save(model, path) == SSDGS_OK);
    return slurp(path);
}

static void test_round_trip(void) {
    static const int counts[3] = {0, 1, 777};
    ssdgs_settings edge = ssdgs_settings_default(); /* what is allowed can be read again */
    edge.pixel_variance = (ssdgs_real)0.01;
    edge.length_unit = (ssdgs_real)1e-15;
    edge.light_scale = (ssdgs_real)1e30;
    edge.light_map.bias = (ssdgs_real)1e30;
    edge.centre[0] = (ssdgs_real)-1e30;
    edge.origin[2] = (ssdgs_real)1e9;
    edge.scattering.layers = 0;
    edge.medium.scattering[1] = (ssdgs_real)1e-12;
    edge.medium.scattering[0] = edge.medium.scattering[2] = edge.medium.absorption[0] = (ssdgs_real)1e12;
    ssdgs_model *extreme = NULL, *read = NULL;
    CHECK(ssdgs_model_create(context, &edge, 1, &extreme) == SSDGS_OK &&
          ssdgs_model_save(extreme, path) == SSDGS_OK);
    CHECK(ssdgs_model_load(context, path, &read, NULL) == SSDGS_OK);
    ssdgs_model_destroy(extreme);
    ssdgs_model_destroy(read);
    for (int i = 0; i < 3; i++) {
        ssdgs_model *model = make_model(counts[i]), *back = NULL, *again = NULL;
        bytes file = saved(model);
        ssdgs_load_stats stats;
        CHECK(ssdgs_model_load(context, path, &back, &stats) == SSDGS_OK && same(model, back));
        CHECK(!stats.plain && !stats.dropped && !stats.zero_rotations && !stats.clamped_opacities &&
              !stats.clamped_scales);
        CHECK(load(file.data, file.size, &again, NULL) == SSDGS_OK && same(model, again));
        CHECK(file.size > 300 &&
              !strncmp((char *)file.data, "ply\nformat binary_little_endian 1.0\nelement vertex ", 50));
        ssdgs_model_destroy(model);
        ssdgs_model_destroy(back);
        ssdgs_model_destroy(again);
        free(file.data);
    }
}

static void test_variants(void) {
    static const char *const newlines[3] = {"\n", "\r\n", "\r"};
    ssdgs_model *model = make_model(20), *back;
    bytes file = saved(model);
    document d = parse(&file);
    for (int k = 0; k < 72; k++) {
        variant v;
        v.format = k % 3;
        v.newline = newlines[k / 3 % 3];
        v.wide = k / 9 % 2;
        v.reversed = k / 18 % 2;
        v.extras = k / 36 % 2;
        v.skip = NULL;
        bytes other = emit(&d, &v);
        back = NULL;
        CHECK(load(other.data, other.size, &back, NULL) == SSDGS_OK && same(model, back));
        ssdgs_model_destroy(back);
        if (v.format == ASCII) { /* the end of the last line may be missing */
            CHECK(load(other.data, other.size - strlen(v.newline) - 1, &back, NULL) == SSDGS_OK &&
                  same(model, back));
            ssdgs_model_destroy(back);
        }
        free(other.data);
    }
    for (int k = 0; k < d.tables; k++) { /* every property of every element is missed by its name, but for
                                        those that others use or that came later */
        for (int c = 0; c < d.table[k].columns; c++) {
            variant v = {LITTLE, "\n", 0, 0, 0, NULL};
            const char *name = v.skip = d.table[k].column[c].name;
            bytes other = emit(&d, &v);
            if (!strncmp(name, "f_dc", 4) || !strcmp(name, "nx") || !strcmp(name, "ny") ||
                !strcmp(name, "nz") || strstr(name, "_octaves") || !strncmp(name, "origin_", 7) ||
                !strncmp(name, "medium_", 7) || !strcmp(name, "harmonics") || !strcmp(name, "kept") ||
                !strncmp(name, "placement_", 10)) {
                CHECK(load(other.data, other.size, &back, NULL) == SSDGS_OK && same(model, back));
                ssdgs_model_destroy(back);
            } else if (!strcmp(name, "pixel_variance")) {
                CHECK(load(other.data, other.size, &back, NULL) == SSDGS_OK && same_gaussians(model, back) &&
                      ssdgs_model_settings(back)->pixel_variance == (ssdgs_real)(float)0.3);
                ssdgs_model_destroy(back);
            } else if (!strncmp(name, "ambient_", 8)) { /* older photographs had none */
                CHECK(load(other.data, other.size, &back, NULL) == SSDGS_OK && same_gaussians(model, back) &&
                      !(ssdgs_model_settings(back)->ambient[name[8] - '0'] > 0) &&
                      ssdgs_model_settings(back)->ambient[(name[8] - '0' + 1) % 3] > 0);
                ssdgs_model_destroy(back);
            } else if (!strcmp(name, "transport")) { /* files without it have a network with fewer inputs */
                CHECK(refused(other.data, other.size) && strstr(ssdgs_error_message(context), "scattering"));
            } else {
                CHECK(refused(other.data, other.size) && strstr(ssdgs_error_message(context), name));
            }
            free(other.data);
        }
    }
    for (int k = 2; k < d.tables; k++) { /* without weights or bases */
        variant v = {BIG, "\n", 0, 0, 0, NULL};
        v.skip = d.table[k].name;
        bytes other = emit(&d, &v);
        CHECK(refused(other.data, other.size) && strstr(ssdgs_error_message(context), v.skip));
        free(other.data);
    }
    ssdgs_model_destroy(model);
    free(file.data);
}

/* Files of others: the published implementation's, plain splats, points with colours. */
static void test_foreign(void) {
    ssdgs_model *model = make_model(5), *back = NULL, *fresh = NULL;
    const ssdgs_settings published = ssdgs_settings_published();
    bytes file = saved(model), other = {NULL, 0, 0};
    document d = parse(&file);
    variant v = {LITTLE, "\n", 0, 0, 0, NULL};
    d.tables = 1;
    other = emit(&d, &v);
    ssdgs_load_stats stats;
    CHECK(load(other.data, other.size, &back, &stats) == SSDGS_OK && same_gaussians(model, back) &&
          !stats.plain);
    CHECK(ssdgs_model_create(context, &published, 0, &fresh) == SSDGS_OK && back &&
          same_globals(fresh, back));
    CHECK(back && !memcmp(ssdgs_model_settings(back), &published, sizeof published));
    ssdgs_model_destroy(model);
    ssdgs_model_destroy(back);
    ssdgs_model_destroy(fresh);
    free(other.data);
    free(file.data);

    memset(&other, 0, sizeof other); /* 62 floats */
    text(&other, "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float "
                 "y\nproperty float z\n"
                 "property float nx\nproperty float ny\nproperty float nz\nproperty float f_dc_0\nproperty "
                 "float f_dc_1\n"
                 "property float f_dc_2\n");
    char line[64];
    for (int i = 0; i < 45; i++) sprintf(line, "property float f_rest_%d\n", i), text(&other, line);
    text(&other,
         "property float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\n"
         "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float "
         "rot_3\nend_header\n");
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 62; i++)
            put_value(&other, &v, "float",
                      i == 6    ? -3
                      : i < 9   ? i + 0.5 * j
                      : i < 54  ? 1e30
                      : i == 54 ? 25
                                : 0.25 * i - 14);
    CHECK(load(other.data, other.size, &back, &stats) == SSDGS_OK);
    if (back) {
        ssdgs_model_view view = ssdgs_model_arrays(back);
        CHECK(stats.plain && stats.clamped_opacities == 3 && stats.dropped == 0 &&
              stats.zero_rotations == 0 && view.count == 3);
        CHECK(ssdgs_model_settings(back)->baked == 1 &&
              ssdgs_model_settings(back)->transfer == SSDGS_TRANSFER_NONE);
        CHECK(ssdgs_model_create(context, ssdgs_model_settings(back), 3, &fresh) == SSDGS_OK &&
              same_globals(back, fresh));
        CHECK(view.gaussians[view.stride + 2] == 2 && view.gaussians[SSDGS_OPACITY * view.stride] == 20 &&
              view.gaussians[SSDGS_LOG_SCALE * view.stride + 1] == (ssdgs_real)-0.25 &&
              view.gaussians[(SSDGS_ROTATION + 3) * view.stride] == (ssdgs_real)1.25);
        CHECK(view.channels == SSDGS_HARMONICS + 45 && ssdgs_model_settings(back)->harmonics == 3);
        CHECK(view.gaussians[SSDGS_DIFFUSE * view.stride] == -3 && /* below black, and kept */
              view.gaussians[(SSDGS_DIFFUSE + 1) * view.stride + 1] == (ssdgs_real)7.5 &&
              view.gaussians[(SSDGS_HARMONICS + 44) * view.stride + 2] == (ssdgs_real)(float)1e30);
        file = saved(back); /* a baked model keeps its colours, f_dc shows them */
        d = parse(&file);
        CHECK(fabs((double)from_bits(word_at(d.table[0].data + 28)) - 7) < 1e-5);
        free(file.data);
    }
    ssdgs_model_destroy(back);
    ssdgs_model_destroy(fresh);
    free(other.data);

    back = NULL;
    memset(&other, 0, sizeof other);
    text(&other,
         "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float opacity\nproperty "
         "float scale_0\n"
         "property float scale_1\nproperty float scale_2\nproperty float rot_0\nproperty float rot_1\n"
         "property float rot_2\nproperty float rot_3\nend_header\n"
         "1 2 3 255 0 51 inf 0 0 0 1 0 0 0\n1 2 3 0 0 0 -Infinity 0 -INF 1e3 0 0 0 0\n"
         "nan 2 3 0 0 0 1 0 0 0 1 0 0 0\n1 2 3 0 0 0 NaN 0 0 0 1 0 0 0\n.5 -5.E-1 +1e999 0 0 0 1 0 0 0 1 0 0 "
         "0\n");
    CHECK(load(other.data, other.size, &back, &stats) == SSDGS_OK);
    if (back) {
        ssdgs_model_view view = ssdgs_model_arrays(back);
        CHECK(view.count == 2 && stats.dropped == 3 && stats.zero_rotations == 1);
        CHECK(stats.clamped_opacities == 2 && stats.clamped_scales == 2);
        CHECK(view.gaussians[SSDGS_OPACITY * view.stride] == 20 &&
              view.gaussians[SSDGS_OPACITY * view.stride + 1] == -20);
        CHECK(view.gaussians[SSDGS_ROTATION * view.stride + 1] == 1);
        CHECK(view.gaussians[(SSDGS_LOG_SCALE + 1) * view.stride + 1] == -20);
        CHECK(fabs((double)view.gaussians[SSDGS_DIFFUSE * view.stride] * 0.28209479 - 0.5) < 1e-6);
        CHECK(fabs((double)view.gaussians[(SSDGS_DIFFUSE + 2) * view.stride] * 0.28209479 + 0.3) < 1e-6);
    }
    ssdgs_model_destroy(back);
    free(other.data);
}

/* ---- what loading tells ---- */

static char told[2000]; /* all notes since the last look */

static void hear(void *user, ssdgs_result code, const char *message) {
    (void)user;
    if (code == SSDGS_OK) snprintf(told + strlen(told), sizeof told - strlen(told), "%s\n", message);
}

/* Loads in a context whose log is read. */
static int tells(const bytes *file, ssdgs_load_stats *stats, const char *words) {
    ssdgs_context_desc desc;
    ssdgs_context *other = NULL;
    ssdgs_model *model = NULL;
    memset(&desc, 0, sizeof desc);
    desc.logger.write = hear;
    told[0] = 0;
    const int good = !ssdgs_context_create(&desc, &other) &&
                     !ssdgs_model_load_memory(other, file->data, file->size, &model, stats) &&
                     (words ? strstr(told, words) != NULL : !told[0]);
    if (!good) printf("    wanted \"%s\", got \"%s\"\n", words ? words : "", told);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(other);
    return good;
}

/* Gives a model what the original has; lost: its file had no settings. version: who wrote the original's. */
static ssdgs_result adopt_from(ssdgs_model **model, int lost, const ssdgs_model *original, int version) {
    ssdgs_load_stats own, trained;
    const char *problem;
    memset(&own, 0, sizeof own);
    memset(&trained, 0, sizeof trained);
    own.untrained = lost;
    trained.version = version;
    const ssdgs_result result = adopt_model((*model)->context, model, &own, original, &trained, &problem);
    if (problem) snprintf(told, sizeof told, "%s", problem);
    return result;
}
#define ADOPT(model, lost, original) adopt_from(&(model), lost, original, SSDGS_VERSION)

/* A model that lost what an editor drops is told, whichever part it lost, and is whole again once given it
   back. */
static void test_edited(void) {
    ssdgs_model *model = make_model(9), *back = NULL, *baked = NULL;
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_load_stats stats;
    bytes file = saved(model);
    document d = parse(&file), cut = d;
    variant v = {LITTLE, "\n", 0, 0, 0, NULL};
    const size_t live = memory.live;
    CHECK(tells(&file, &stats, NULL) && !stats.untrained);
    cut.tables = 1;
    bytes other = emit(&cut, &v);
    CHECK(tells(&other, &stats, "has no settings, as editors of splats drop them") && stats.untrained == 1 &&
          !stats.plain);
    CHECK(load(other.data, other.size, &back, &stats) == SSDGS_OK && stats.untrained == 1 &&
          !same_globals(model, back));
    memory.calls = 0;
    memory.fail_at = 1;
    CHECK(ADOPT(back, 1, model) == SSDGS_ERR_MEMORY && !same_globals(model, back));
    memory.fail_at = 0;
    CHECK(ADOPT(back, 1, model) == SSDGS_OK && same(model, back));
    settings.baked = 1;
    CHECK(ssdgs_model_create(context, &settings, 1, &baked) == SSDGS_OK);
    CHECK(ADOPT(back, 0, baked) == SSDGS_ERR_ARGUMENT && ADOPT(baked, 0, model) == SSDGS_ERR_ARGUMENT &&
          same(model, back));
    ssdgs_model_destroy(baked);
    ssdgs_model_destroy(back);
    CHECK(memory.live == live);
    free(other.data);
    ssdgs_model_destroy(model);
    free(file.data);
}

#define PLAIN \
    "property float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\n" \
    "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"
#define POINT "1 2 3 0 0 0 0 1 0 0 0 "
#define DC "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n"

static bytes ascii(const char *count, const char *properties, const char *rows) {
    bytes b = {NULL, 0, 0};
    text(&b, "ply\nformat ascii 1.0\nelement vertex ");
    text(&b, count);
    text(&b, "\nproperty float x\nproperty float y\nproperty float z\n" PLAIN);
    text(&b, properties);
    text(&b, "end_header\n");
    text(&b, rows);
    return b;
}

/* A row of an ASCII file ends with its line; what follows the last is told. */
static void test_rows(void) {
    static const struct {
        const char *rows, *refused;
    } files[] = {{POINT "0 0 0\n" POINT "0 0 0", NULL},
                 {POINT "0\n0\t0 \r\n" POINT "0 0 0 \n", NULL}, /* a row may take several */
                 {POINT "0 0 0 99\n" POINT "0 0 0\n",
                  "element vertex, row 0, property f_dc_2: the line should end here"},
                 {POINT "0 0\n" POINT "0 0 0    \n",
                  "element vertex, row 0, property f_dc_2: the line should end here"},
                 {POINT "0 0 0\n1 2 x 0 0 0 0 1 0 0 0 0 0 0\n",
                  "element vertex, row 1, property z: the file ends, or"},
                 {POINT "0 0 0\n", "element vertex, row 1, property f_dc_2: the file is cut short"},
                 {"1 2 3\n", "element vertex, row 0, property f_dc_2: the file is cut short"}};
    ssdgs_load_stats stats;
    for (size_t k = 0; k < sizeof files / sizeof *files; k++) {
        bytes b = ascii("2", DC, files[k].rows);
        ssdgs_model *model = NULL;
        if (!files[k].refused) CHECK(load(b.data, b.size, &model, NULL) == SSDGS_OK && model->count == 2);
        else if (!CHECK(refused(b.data, b.size) && strstr(ssdgs_error_message(context), files[k].refused)))
            printf("    %s\n", ssdgs_error_message(context));
        ssdgs_model_destroy(model);
        free(b.data);
    }
    bytes b = ascii("1", DC, POINT "0 0 0\n \r\n");
    CHECK(tells(&b, &stats, "plain splats") && !strstr(told, "behind"));
    text(&b, "1 2\n");
    CHECK(tells(&b, &stats, "4 bytes behind the last element are not read: was it copied as text?"));
    free(b.data);
    ssdgs_model *model = make_model(1);
    b = saved(model);
    put(&b, "\n", 1);
    CHECK(tells(&b, &stats, "1 bytes behind the last element are not read"));
    free(b.data);
    ssdgs_model_destroy(model);
}

/* f_rest of degrees 1 to 3 in both orders, with bands that are 0, and what is saved of it. */
static void test_harmonics(void) {
    enum { ROWS = 40 };
    for (int degree = 1; degree < 4; degree++)
        for (int mixed = 0; mixed < 2; mixed++)
            for (int bands = 0; bands <= degree; bands++) {
                const int file = (degree + 1) * (degree + 1) - 1, kept = (bands + 1) * (bands + 1) - 1;
                static double value[ROWS][3][15];
                char properties[2000] = DC, line[100];
                bytes rows = {NULL, 0, 0};
                for (int i = 0; i < 3 * file; i++)
                    sprintf(properties + strlen(properties), "property float f_rest_%d\n", i);
                for (int g = 0; g < ROWS; g++) {
                    text(&rows, POINT "0 0 0");
                    for (int i = 0; i < file; i++) {
                        const double grey = (double)uniform(-1, 1);
                        for (int c = 0; c < 3; c++)
                            value[g][c][i] = i < kept ? floor(4096 * (grey + 0.2 * c)) / 4096 : 0;
                    }
                    for (int i = 0; i < 3 * file; i++) {
                        sprintf(line, " %.9g", mixed ? value[g][i % 3][i / 3] : value[g][i / file][i % file]);
                        text(&rows, line);
                    }
                    text(&rows, "\n");
                }
                put(&rows, "", 1);
                sprintf(line, "%d", ROWS);
                bytes b = ascii(line, properties, (const char *)rows.data);
                ssdgs_load_stats stats;
                CHECK(tells(&b, &stats, "f_rest seems to hold one coefficient after the other") ==
                      (mixed && bands > 0));
                ssdgs_model *model = NULL, *back = NULL;
                CHECK(load(b.data, b.size, &model, &stats) == SSDGS_OK && !stats.dropped);
                if (model) {
                    int wrong = 0;
                    CHECK(ssdgs_model_settings(model)->harmonics == bands &&
                          model->channels == SSDGS_HARMONICS + 3 * kept);
                    for (int i = 0; i < 3 * kept * ROWS; i++) {
                        const int plane = i / ROWS, g = i % ROWS;
                        const double is =
                                         (double)model
                                             ->gaussians[(size_t)(SSDGS_HARMONICS + plane) * model->capacity +
                                                         (size_t)g],
                                     want = value[g][plane / kept][plane % kept];
                        wrong += !(is >= want && is <= want);
                    }
                    CHECK(!wrong);
                    bytes again = saved(model);
                    CHECK(load(again.data, again.size, &back, NULL) == SSDGS_OK &&
                          same_gaussians(model, back) && ssdgs_model_settings(back)->harmonics == bands);
                    free(again.data);
                }
                ssdgs_model_destroy(back), ssdgs_model_destroy(model);
                free(rows.data), free(b.data);
            }
    ssdgs_load_stats stats;
    char properties[2000] = DC;
    for (int i = 0; i < 46; i++) sprintf(properties + strlen(properties), "property char f_rest_%d\n", i);
    bytes b = ascii("0", properties, "");
    CHECK(tells(&b, &stats, "f_rest is left out: it is not of degree 1, 2 or 3"));
    free(b.data);
    for (int first = 0; first < 15; first++) { /* one value of red alone keeps its band */
        char row[200] = POINT "0 0 0";
        ssdgs_model *model = NULL;
        strcpy(properties, DC);
        for (int i = 0; i < 45; i++) {
            sprintf(properties + strlen(properties), "property float f_rest_%d\n", i);
            strcat(row, i == first ? " 1" : " 0");
        }
        b = ascii("1", properties, strcat(row, "\n"));
        CHECK(load(b.data, b.size, &model, NULL) == SSDGS_OK &&
              model->settings.harmonics == (first < 3   ? 1
                                            : first < 8 ? 2
                                                        : 3));
        ssdgs_model_destroy(model);
        free(b.data);
    }
    strcpy(properties, DC);
    for (int i = 0; i < 9; i++) sprintf(properties + strlen(properties), "property float f_rest_%d\n", i);
    b = ascii("3", properties,
              POINT "0 0 0 1 1 1 1 1 1 1 1 1\n" POINT "0 0 0 1 1 1 1 nan 1 1 1 1\n" POINT
                    "0 0 0 1 1 1 1 1 1 1 1 "
                    "inf\n");
    CHECK(tells(&b, &stats, "2 Gaussians of 3 are left out") && stats.dropped == 2);
    free(b.data);
    for (int k = 0; k < 8; k++) { /* ours, of each degree, of linear colours too */
        ssdgs_model *model = make_baked(5, k % 4), *back = NULL;
        model->settings.transfer = k < 4 ? SSDGS_TRANSFER_NONE : SSDGS_TRANSFER_SRGB;
        b = saved(model);
        CHECK(load(b.data, b.size, &back, NULL) == SSDGS_OK && same_baked(model, back));
        if (k < 4) { /* other programs read the same colours */
            const document d = parse(&b);
            const ssdgs_real shown = (ssdgs_real)from_bits(word_at(d.table[0].data + 24));
            CHECK(!memcmp(&shown, model->gaussians + SSDGS_DIFFUSE * model->capacity, sizeof shown));
        }
        ssdgs_gaussian g, h;
        CHECK(!ssdgs_model_get(back, 1, &g) && !ssdgs_model_set(back, 1, &g));
        for (size_t c = SSDGS_DIFFUSE; c < (size_t)back->channels; c++) /* also what is below black */
            CHECK(!memcmp(back->gaussians + c * back->capacity, model->gaussians + c * model->capacity,
                          5 * sizeof(ssdgs_real)));
        g.diffuse[1] = (ssdgs_real)0.75;
        CHECK(!ssdgs_model_set(back, 1, &g) && !ssdgs_model_get(back, 1, &h));
        for (int c = 0; c < 3; c++) CHECK(fabs((double)(h.diffuse[c] - g.diffuse[c])) < 1e-5);
        ssdgs_model_destroy(back), ssdgs_model_destroy(model);
        free(b.data);
    }
    /* of 0.2.5: all planes, the colour before softplus */
    ssdgs_model *model = make_model(7), *back = NULL;
    model->settings.baked = 0;
    b = saved(model);
    const document d = parse(&b);
    for (int c = 0; c < d.table[1].columns; c++)
        if (!strcmp(d.table[1].column[c].name, "baked")) b.data[d.table[1].data - b.data + 4 * c] = 1;
    CHECK(load(b.data, b.size, &back, NULL) == SSDGS_OK && back->channels == SSDGS_HARMONICS);
    for (size_t i = 3; i < 7 && back; i++)
        for (size_t c = SSDGS_DIFFUSE; c < SSDGS_HARMONICS; c++)
            CHECK(fabs(0.5 + 0.28209479177 * (double)back->gaussians[c * back->capacity + i] -
                       log1p(exp((double)model->gaussians[c * model->capacity + i]))) < 1e-5);
    ssdgs_model_destroy(back), ssdgs_model_destroy(model);
    free(b.data);
}

static void test_words(void) {
    static const struct {
        const char *types[3], *row;
    } colours[5] = {{{"uchar", "uchar", "uchar"}, "51 0 255"},
                    {{"ushort", "ushort", "ushort"}, "13107 0 65535"},
                    {{"float", "float", "float"}, "0.2 0 1"},
                    {{"double", "double", "double"}, "0.2 -1 1"},
                    {{"uchar", "float", "ushort"}, "51 0 65535"}};
    static const double want[3] = {0.2, 0, 1};
    ssdgs_load_stats stats;
    for (size_t k = 0; k < 5; k++) {
        char properties[200];
        sprintf(properties, "property %s red\nproperty %s green\nproperty %s blue\n", colours[k].types[0],
                colours[k].types[1], colours[k].types[2]);
        char rows[200];
        sprintf(rows, POINT "%s\n", colours[k].row);
        bytes b = ascii("1", properties, rows);
        CHECK(tells(&b, &stats, "plain splats, which have their colours baked in") && stats.plain);
        ssdgs_model *model = NULL;
        CHECK(load(b.data, b.size, &model, NULL) == SSDGS_OK);
        for (int c = 0; c < 3 && model; c++)
            CHECK(fabs(0.5 +
                       0.28209479 * (double)model->gaussians[(size_t)(SSDGS_DIFFUSE + c) * model->capacity] -
                       (k == 3 && c == 1 ? -1 : want[c])) < 2e-6);
        ssdgs_model_destroy(model);
        free(b.data);
    }
    bytes b = ascii("1", "property int red\nproperty int green\nproperty int blue\n", POINT "1 1 1\n");
    CHECK(refused(b.data, b.size) && strstr(ssdgs_error_message(context), "lacks property f_dc_0"));
    free(b.data);
    b = ascii("3", DC, POINT "0 0 0\nnan " POINT "0 0\n" POINT "nan 0 0\n");
    CHECK(tells(&b, &stats, "2 Gaussians of 3 are left out") && stats.dropped == 2);
    free(b.data);
    b = ascii("0", DC, "");
    CHECK(tells(&b, &stats, "holds no Gaussians"));
    free(b.data);
    b = ascii("1", "property uint packed_position\n", POINT "1\n");
    CHECK(refused(b.data, b.size) &&
          strstr(ssdgs_error_message(context), "a compressed PLY (packed_position): examples/splats.h"));
    free(b.data);
    b = ascii("1", DC "property float filter_3D\n", POINT "0 0 0 1\n");
    CHECK(refused(b.data, b.size) && strstr(ssdgs_error_message(context), "without their filter"));
    free(b.data);
    b = ascii("1", DC "property float f_rest_0\n", POINT "0 0 0 1\n");
    CHECK(tells(&b, &stats, "f_rest is left out: it is not of degree 1, 2 or 3"));
    free(b.data);
    CHECK(refused_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                       "y\nproperty float z\nproperty uchar red\n"
                       "property uchar green\nproperty uchar blue\nend_header\n1 2 3 4 5 6\n") &&
          strstr(ssdgs_error_message(context), "lacks property opacity: these are no Gaussian splats"));
    CHECK(refused_text("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float "
                       "y\nproperty float z\n" DC
                       "property float opacity\nproperty float scale_0\nproperty float scale_1\n"
                       "end_header\n") &&
          strstr(ssdgs_error_message(context), "lacks property scale_2") &&
          !strstr(ssdgs_error_message(context), "no Gaussian splats")); /* flat ones */
    CHECK(refused_text("ply\nformat ascii 1.0\nelement vertex 1\n") &&
          strstr(ssdgs_error_message(context), "the file ends within the header"));
    for (int kind = 0; kind < 3; kind++) { /* one long comment, many, too much of them */
        bytes longer = {NULL, 0, 0};
        text(&longer, DC);
        text(&longer, "comment ");
        for (size_t k = 0; k < (kind == 2 ? 1100000 : 70000); k++)
            text(&longer, kind == 1 && k % 100 == 99 ? "\ncomment " : "x");
        text(&longer, "\n");
        put(&longer, "", 1);
        b = ascii("1", (const char *)longer.data, POINT "0 0 0\n");
        ssdgs_model *model = NULL;
        if (kind == 2) CHECK(refused(b.data, b.size) && strstr(ssdgs_error_message(context), "within 1 MiB"));
        else CHECK(load(b.data, b.size, &model, NULL) == SSDGS_OK);
        ssdgs_model_destroy(model);
        free(b.data);
        free(longer.data);
    }
}

/* Whether `back` has the model's Gaussians, but for c_s: softplus of the model's is now its lobe's height. */
static int has_heights(ssdgs_model *model, ssdgs_model *back) {
    const ssdgs_model_view u = ssdgs_model_arrays(model), v = ssdgs_model_arrays(back);
    int equal = u.count == v.count && same_globals(model, back);
    for (int i = 0; equal && i < u.count; i++) {
        ssdgs_gaussian g;
        equal = ssdgs_model_get(back, i, &g) == SSDGS_OK;
        for (size_t c = 0; c < SSDGS_CHANNELS; c++) {
            const double x = (double)u.gaussians[c * u.stride + (size_t)i],
                         y = (double)v.gaussians[c * v.stride + (size_t)i];
            if (c < SSDGS_SPECULAR || c >= SSDGS_SCATTERING) {
                equal &= !(x < y || x > y);
                continue;
            }
            const double height = log(1 + exp(x));
            const double a = (double)u.gaussians[SSDGS_ASG_WEIGHT * u.stride + (size_t)i],
                         b = (double)u.gaussians[(SSDGS_ASG_WEIGHT + 1) * u.stride + (size_t)i];
            equal &= fabs((double)g.specular[c - SSDGS_SPECULAR] - height) <= 1e-5 * height;
            equal &= fabs(log(1 + exp(y)) * exp(0.5 * (a + b)) - height) <= 1e-5 * height;
        }
    }
    return equal;
}

/* Files of older versions load, 0.1.0's are of 100; of newer ones nothing is known. Up to 0.2.0, 200, they
   have a lobe's height where c_s is now: also where an editor dropped the settings, and the model is given
   them back. */
static void test_versions(void) {
    static const struct {
        int version, loads, heights;
    } cases[6] = {{0, 0, 0},   {100, 1, 1},           {200, 1, 1},
                  {201, 1, 0}, {SSDGS_VERSION, 1, 0}, {SSDGS_VERSION + 1, 0, 0}};
    ssdgs_model *model = make_model(3);
    bytes file = saved(model);
    const document d = parse(&file);
    document cut = d;
    variant v = {LITTLE, "\n", 0, 0, 0, NULL};
    unsigned char *setting[2] = {NULL, NULL};
    static const char *const names[2] = {"version", "asg"};
    for (int t = 0; t < d.tables; t++)
        for (int c = 0; c < d.table[t].columns; c++)
            for (int i = 0; i < 2; i++)
                if (!strcmp(d.table[t].name, "ssdgs_settings") &&
                    !strcmp(d.table[t].column[c].name, names[i]))
                    setting[i] = file.data + (d.table[t].data - file.data) + 4 * c;
    cut.tables = 1;
    bytes edited = emit(&cut, &v);
    for (int i = 0; i < 6 && CHECK(setting[0] && setting[1]); i++) {
        ssdgs_model *back = NULL, *bare = NULL;
        setting[0][0] = (unsigned char)(cases[i].version & 255);
        setting[0][1] = (unsigned char)(cases[i].version >> 8);
        if (!cases[i].loads) {
            CHECK(refused(file.data, file.size) &&
                  strstr(ssdgs_error_message(context), "; this library reads 1 to "));
            continue;
        }
        CHECK(load(file.data, file.size, &back, NULL) == SSDGS_OK &&
              load(edited.data, edited.size, &bare, NULL) == SSDGS_OK);
        CHECK(cases[i].heights ? has_heights(model, back) : same(model, back));
        for (int again = 0; again < 2; again++)
            CHECK(adopt_from(&bare, !again, back, cases[i].version) == SSDGS_OK && same(bare, back));
        CHECK(ADOPT(back, 0, model) == SSDGS_OK && same(bare, back));
        ssdgs_model *stranger = NULL; /* one of whose Gaussians the original has not */
        ssdgs_model_arrays(back).gaussians[SSDGS_MATERIAL * back->capacity] += 1;
        CHECK(load(edited.data, edited.size, &stranger, NULL) == SSDGS_OK &&
              adopt_from(&stranger, 1, back, cases[i].version) == SSDGS_OK);
        for (int c = 0; c < SSDGS_CHANNELS && stranger; c++) {
            const int changes = cases[i].heights && c >= SSDGS_SPECULAR && c < SSDGS_SCATTERING;
            const ssdgs_real raw = model->gaussians[(size_t)c * model->capacity];
            ssdgs_gaussian g;
            CHECK(changes || stranger->gaussians[(size_t)c * stranger->capacity] == raw);
            if (!changes || !CHECK(!ssdgs_model_get(stranger, 0, &g))) continue;
            const double height = log1p(exp((double)raw));
            CHECK(fabs((double)g.specular[c - SSDGS_SPECULAR] - height) < 1e-5 * height);
        }
        ssdgs_model_destroy(stranger);
        ssdgs_model_destroy(bare);
        ssdgs_model_destroy(back);
        back = NULL;
        *setting[1] = SSDGS_ASG_GEOMETRIC;
        CHECK(load(file.data, file.size, &back, NULL) == SSDGS_OK && same_gaussians(model, back));
        *setting[1] = SSDGS_ASG_DEFERRED;
        ssdgs_model_destroy(back);
    }
    ssdgs_model_destroy(model);
    free(edited.data);
    free(file.data);
}

/* ---- models that an editor of splats has turned, scaled and moved ---- */

enum { DRAWN = 300, SIDE = 24 };

/* x -> scale (turned x) + move; scale below 0 mirrors. */
typedef struct edit {
    double axis[3], degrees, scale, move[3];
    int wanted; /* 1: turned and mirrored; 2: stretched; 3: shaken; 4: few are the original's; 5: it stays */
} edit;

static void quaternion_of(const edit *e, double q[4]) {
    const double half = e->degrees * 0.0087266462599716479;
    q[0] = cos(half);
    for (int c = 0; c < 3; c++) q[1 + c] = sin(half) * e->axis[c];
}

static void rotation_of(const double q[4], double r[9]) {
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double all[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                           2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                           2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(r, all, sizeof all);
}

static void moved_place(const edit *e, const double x[3], double to[3]) {
    double q[4], r[9];
    quaternion_of(e, q);
    rotation_of(q, r);
    for (int c = 0; c < 3; c++)
        to[c] = e->scale * (r[3 * c] * x[0] + r[3 * c + 1] * x[1] + r[3 * c + 2] * x[2]) + e->move[c];
}

/* A model that can be drawn, of Gaussians that all differ. */
static ssdgs_model *drawn_model(void) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    settings.scattering.width = settings.shadow.width = 8;
    settings.light_map.size = 512;
    if (!CHECK(ssdgs_model_create(context, &settings, DRAWN, &model) == SSDGS_OK)) exit(1);
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t c = 0; c < SSDGS_CHANNELS; c++)
        for (size_t i = 0; i < DRAWN; i++) {
            const int position = c < SSDGS_ROTATION, size = c >= SSDGS_LOG_SCALE && c < SSDGS_OPACITY;
            v.gaussians[c * v.stride + i] = position ? uniform(-0.4, 0.4)
                                            : size   ? uniform(-3.5, -2.5)
                                                     : uniform(-1, 1);
        }
    for (size_t k = 0; k < v.scattering_count; k++) v.scattering[k] += uniform(-0.3, 0.3);
    for (size_t k = 0; k < v.shadow_count; k++) v.shadow[k] += uniform(-0.3, 0.3);
    return model;
}

static double picture_of(ssdgs_model *model, const edit *e, int terms, ssdgs_real *color) {
    const double eye[3] = {0.3, -2, 0.6}, lamp[3] = {1, -1.5, 1.2};
    double q[4], r[9], there[3], sum = 0;
    ssdgs_camera camera;
    ssdgs_light light;
    ssdgs_image image;
    const ssdgs_real from[3] = {(ssdgs_real)0.3, -2, (ssdgs_real)0.6}, zero[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    ssdgs_render_options options = ssdgs_render_options_exact();
    memset(&light, 0, sizeof light);
    memset(&image, 0, sizeof image);
    options.terms = terms;
    image.color = color;
    camera = ssdgs_camera_look_at(from, zero, up, (ssdgs_real)0.6, SIDE, SIDE);
    quaternion_of(e, q);
    rotation_of(q, r);
    moved_place(e, eye, there); /* the camera turns along: its rows are r times what they were */
    const ssdgs_camera still = camera;
    for (int i = 0; i < 3; i++) {
        double back = 0;
        for (int j = 0; j < 3; j++) {
            double row = 0;
            for (int k = 0; k < 3; k++) row += (double)still.view[4 * i + k] * r[3 * j + k];
            camera.view[4 * i + j] = (ssdgs_real)row;
            back -= row * there[j];
        }
        camera.view[4 * i + 3] = (ssdgs_real)back;
    }
    camera.near_plane = (ssdgs_real)(0.01 * e->scale);
    moved_place(e, lamp, there);
    for (int c = 0; c < 3; c++) {
        light.position[c] = (ssdgs_real)there[c];
        light.intensity[c] = (ssdgs_real)(9 * e->scale * e->scale);
    }
    CHECK(!ssdgs_render_ex(model, &camera, &light, 1, &options, &image, NULL));
    for (int i = 0; i < 3 * SIDE * SIDE; i++) sum += (double)color[i];
    return sum;
}

/* What an editor does to a file's Gaussians: they change order, some are gone, and what it knows of them it
   turns, scales and moves, in floats. */
static void edit_model(ssdgs_model *model, const edit *e) {
    ssdgs_model_view v = ssdgs_model_arrays(model);
    const size_t n = (size_t)model->count;
    double q[4];
    quaternion_of(e, q);
    for (size_t i = 0; i < n; i++) {
        ssdgs_real *g = v.gaussians + i;
        double x[3], to[3], p[4], length = 0;
        for (size_t c = 0; c < 3; c++) x[c] = (double)g[c * v.stride];
        moved_place(e, x, to);
        if (e->wanted == 2) to[0] *= 1.3;
        for (size_t c = 0; c < 3; c++)
            g[c * v.stride] = (ssdgs_real)(float)(to[c] + (e->wanted == 3 ? (double)uniform(-1, 1) : 0));
        for (size_t c = 0; c < 4; c++) p[c] = (double)g[(SSDGS_ROTATION + c) * v.stride];
        const double turned[4] = {q[0] * p[0] - q[1] * p[1] - q[2] * p[2] - q[3] * p[3],
                                  q[0] * p[1] + q[1] * p[0] + q[2] * p[3] - q[3] * p[2],
                                  q[0] * p[2] - q[1] * p[3] + q[2] * p[0] + q[3] * p[1],
                                  q[0] * p[3] + q[1] * p[2] - q[2] * p[1] + q[3] * p[0]};
        for (int c = 0; c < 4; c++) length += turned[c] * turned[c];
        for (size_t c = 0; c < 4 && e->wanted != 5; c++)
            g[(SSDGS_ROTATION + c) * v.stride] = (ssdgs_real)(float)(turned[c] / sqrt(length));
        for (size_t c = 0; c < 3; c++) {
            ssdgs_real *size = g + (SSDGS_LOG_SCALE + c) * v.stride;
            *size = (ssdgs_real)(float)((double)*size + log(fabs(e->scale)));
        }
        for (size_t c = 0; c < 6 && e->wanted == 4 && i % 4; c++)
            g[(SSDGS_MATERIAL + c) * v.stride] = uniform(-1, 1);
    }
    for (size_t c = 0; c < SSDGS_CHANNELS; c++) /* backwards, without the last third */
        for (size_t i = 0; i < n / 2; i++) {
            ssdgs_real *plane = v.gaussians + c * v.stride, kept = plane[i];
            plane[i] = plane[n - 1 - i];
            plane[n - 1 - i] = kept;
        }
    model->count -= model->count / 3; /* and the settings are lost */
    model->settings = ssdgs_settings_published();
}

/* One that is placed keeps its place when it adopts again, and one edited again is moved by both. */
static void check_again(ssdgs_context *other, ssdgs_model **model, const ssdgs_model *original,
                        const edit *first) {
    static const edit second = {{0, 0.6, 0.8}, 40, 0.5, {0.2, -0.7, 0.4}, 0};
    const ssdgs_settings placed = *ssdgs_model_settings(*model);
    bytes before = saved(*model), after;
    CHECK(!ADOPT(*model, 0, original));
    after = saved(*model);
    CHECK(before.size == after.size && !memcmp(before.data, after.data, after.size));
    free(after.data);
    for (int way = 0; way < 4;
         way++) { /* lost its settings, and adopts from a placed one; has them. Edited? */
        const int lost = way < 2;
        ssdgs_model *from = NULL, *again = NULL;
        CHECK(!ssdgs_model_load_memory(other, before.data, before.size, &from, NULL));
        CHECK(!ssdgs_model_load_memory(other, before.data, before.size, &again, NULL));
        const int edited = way % 2;
        if (edited) edit_model(again, &second);
        again->settings = lost ? ssdgs_settings_published() : placed;
        CHECK(!ADOPT(again, lost, lost ? from : original));
        const ssdgs_object object = ssdgs_object_default(again);
        CHECK(edited || sizeof(ssdgs_real) > 4 || !memcmp(&again->settings, &placed, sizeof placed));
        const double x[3] = {0.3, -0.2, 0.5};
        double half[3], to[3];
        moved_place(&second, x, half);
        moved_place(first, edited ? half : x, to);
        for (int c = 0; c < 3; c++) {
            const ssdgs_real *m = object.to_world + 4 * c;
            const double there =
                (double)m[0] * x[0] + (double)m[1] * x[1] + (double)m[2] * x[2] + (double)m[3];
            if (!CHECK(fabs(there - to[c]) < 1e-5 * (fabs(first->scale) + fabs(to[c]))))
                printf("    again %d, %d: %g, not %g\n", way, c, there, to[c]);
        }
        ssdgs_model_destroy(from);
        ssdgs_model_destroy(again);
    }
    free(before.data);
}

/* What an editor did to a few, in their place, stays however little it is: nothing says the model moved. */
static void test_nudged(void) {
    ssdgs_model *original = drawn_model(), *model = drawn_model();
    ssdgs_model_view to = ssdgs_model_arrays(model), from = ssdgs_model_arrays(original);
    memcpy(to.gaussians, from.gaussians, sizeof(ssdgs_real) * SSDGS_CHANNELS * to.stride);
    for (size_t i = 0; i < DRAWN; i += 10)
        for (size_t c = 0; c < SSDGS_OPACITY; c++) to.gaussians[c * to.stride + i] += (ssdgs_real)1e-5;
    for (int lost = 0; lost < 2; lost++) {
        CHECK(!ADOPT(model, lost, original) && same_globals(model, original));
        to = ssdgs_model_arrays(model);
        for (size_t i = 0; i < DRAWN; i++)
            for (size_t c = 0; c < SSDGS_OPACITY; c++) {
                const ssdgs_real is = to.gaussians[c * to.stride + i],
                                 was = from.gaussians[c * from.stride + i];
                CHECK(i % 10 ? !(is < was) && !(is > was) : fabs((double)(is - was) - 1e-5) < 1e-6);
            }
    }
    ssdgs_model_destroy(original);
    ssdgs_model_destroy(model);
}

/* What tells little, or nothing, or cannot be told. */
static void test_few_placed(void) {
    static const edit turned = {{0.6, 0, -0.8}, 70, 2, {1, 0, -3}, 0};
    const double bad[4] = {(double)NAN, (double)INFINITY, -1e30, 1e16};
    for (int k = 0; k < 18; k++) {
        ssdgs_model *original = drawn_model(), *model = NULL;
        ssdgs_context *other = NULL;
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.logger.write = hear;
        if (k < 6) original->count = k; /* so many are left: of 6 four */
        if (k == 5) original->count = 6;
        for (int i = 0; i < 2 * DRAWN && k == 16; i++) /* on a line: which way round it is turned */
            original->gaussians[(size_t)(1 + i % 2) * original->capacity + (size_t)(i / 2)] = 0;
        for (size_t c = SSDGS_DIFFUSE; c < SSDGS_CHANNELS && k == 17;
             c++) /* most are alike: which is which? */
            for (int i = 0; i < DRAWN * 5 / 6; i++)
                original->gaussians[c * original->capacity + (size_t)i] =
                    c == SSDGS_FRAME; /* or it is mended */
        bytes file = saved(original);
        CHECK(!ssdgs_context_create(&desc, &other) &&
              !ssdgs_model_load_memory(other, file.data, file.size, &model, NULL));
        free(file.data);
        edit e = turned;
        if (k == 14) e.scale = 2e9;
        if (k == 15) e.move[1] = 2e9;
        edit_model(model, &e);
        /* a place that is none, of either */
        ssdgs_model *const one = k & 1 ? original : model;
        if (k >= 6 && k < 14) one->gaussians[one->capacity * 2 + 150] = (ssdgs_real)bad[(k - 6) / 2];
        told[0] = 0;
        CHECK(!ADOPT(model, 1, original) &&
              model->settings.scattering.width == original->settings.scattering.width);
        const int placed = k > 4 && k < 14;
        if (!CHECK(ssdgs__is_placed(&model->settings) == placed &&
                   (strstr(told, "too few of the model's") != NULL) == ((k > 0 && k < 5) || k == 17) &&
                   (strstr(told, "no rotation, scale and move") != NULL) == (k > 13 && k < 17)))
            printf("    case %d: %s\n", k, told);
        CHECK(!placed || fabs((double)model->settings.placement.scale - 2) < 1e-5);
        file = saved(model);
        ssdgs_model_destroy(model);
        CHECK(!ssdgs_model_load_memory(other, file.data, file.size, &model, NULL) &&
              (strstr(told, "stands where an editor has put it") != NULL) == placed);
        free(file.data);
        ssdgs_model_destroy(model);
        ssdgs_model_destroy(original);
        ssdgs_context_destroy(other);
    }
}

static void test_placed(void) {
    static const edit edits[] = {{{0, 0, 1}, 90, 1, {0, 0, 0}, 0},
                                 {{1, 0, 0}, -90, 1, {0, 0, 0}, 0},
                                 {{0.6, 0, -0.8}, 180, 1, {0, 0, 0}, 0},
                                 {{0, 0, 1}, 0, 1, {0.5, 0, 0}, 0},
                                 {{0, 0, 1}, 0, 2, {0, 0, 0}, 0},
                                 {{0, 0, 1}, 0, 0.01, {0, 0, 0}, 0},
                                 {{0.6, 0.48, 0.64}, 100, 3, {1, -2, 3}, 0},
                                 {{0, 1, 0}, 0.01, 1, {0, 0, 0}, 0},
                                 {{0, -0.6, 0.8}, 250, 0.3, {20, 9, -7}, 0},
                                 {{0.6, 0.48, 0.64}, 77, -1.5, {1, 0, 0}, 1},
                                 {{0, 0, 1}, 90, 1, {0, 0, 0}, 2},
                                 {{0, 0, 1}, 90, 1, {0, 0, 0}, 3},
                                 {{0, 0, 1}, 90, 1, {0, 0, 0}, 4},
                                 {{0, 0, 1}, 0, 1, {0, 0, 0}, 5}};
    static ssdgs_real want[3 * SIDE * SIDE], got[3 * SIDE * SIDE];
    ssdgs_model *original = drawn_model();
    for (size_t k = 0; k < sizeof edits / sizeof *edits; k++) {
        const edit *e = edits + k;
        ssdgs_model *model = NULL, *again = NULL;
        ssdgs_context *other = NULL;
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.logger.write = hear;
        told[0] = 0;
        bytes file = saved(original);
        CHECK(!ssdgs_context_create(&desc, &other) &&
              !ssdgs_model_load_memory(other, file.data, file.size, &model, NULL));
        free(file.data);
        edit_model(model, e);
        const int by_hand = e->wanted < 2; /* somebody moved one */
        ssdgs_real *moved = model->gaussians + 5;
        if (by_hand) *moved += (ssdgs_real)(0.25 * fabs(e->scale));
        double was[3], home[3];
        for (int c = 0; c < 3; c++) was[c] = (double)moved[(size_t)c * model->capacity];
        CHECK(!ADOPT(model, 1, original));
        moved = model->gaussians + 5;
        const ssdgs_object object = ssdgs_object_default(model);
        int exact = 0;
        for (int i = 0; i < model->count; i++) {
            int same_bits = 1;
            for (size_t c = 0; c < SSDGS_CHANNELS; c++)
                same_bits =
                    same_bits && !memcmp(model->gaussians + c * model->capacity + i,
                                         original->gaussians + c * original->capacity + (DRAWN - 1 - i),
                                         sizeof *model->gaussians);
            exact += same_bits;
        }
        if (e->wanted < 2 || e->wanted == 5) {
            CHECK(exact == model->count - by_hand);
            for (int i = 0; i < 2 * by_hand; i++) { /* the place, and the edit by hand in it */
                const double x[2][3] = {{0.3, -0.2, 0.5}, {0, 0, 0}};
                double to[3];
                moved_place(e, x[i], to);
                for (int c = 0; c < 3; c++) {
                    const ssdgs_real *m = object.to_world + 4 * c;
                    home[c] = (double)m[3];
                    for (int a = 0; a < 3; a++)
                        home[c] += (double)m[a] * (i ? (double)moved[(size_t)a * model->capacity] : x[0][a]);
                    if (!CHECK(fabs(home[c] - (i ? was[c] : to[c])) < 1e-5 * (fabs(e->scale) + fabs(to[c]))))
                        printf("    edit %d, %d: %g, not %g\n", (int)k, c, home[c], i ? was[c] : to[c]);
                }
            }
            CHECK(!told[0] && ssdgs__is_placed(&model->settings) == by_hand);
            if (e->wanted == 0) {
                const edit none = edits[sizeof edits / sizeof *edits - 1];
                const ssdgs_settings placed = *ssdgs_model_settings(model), here = ssdgs_settings_default();
                for (int all = 0; all < 2; all++) { /* a light's map has other pixels than before */
                    const int terms = all ? SSDGS_ALL_TERMS : SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM;
                    const double bright = picture_of(model, e, terms, got);
                    model->settings.placement = here.placement;
                    CHECK(picture_of(model, &none, terms, want) > 10 && bright > 10);
                    model->settings.placement = placed.placement;
                    double error = 0, norm = 0;
                    for (int i = 0; i < 3 * SIDE * SIDE; i++) {
                        error += (double)(got[i] - want[i]) * (double)(got[i] - want[i]);
                        norm += (double)want[i] * (double)want[i];
                    }
                    if (!CHECK(error < (all ? 9e-4 : 1e-8) * norm))
                        printf("    edit %d: a picture is off by %g\n", (int)k, sqrt(error / norm));
                }
                file = saved(model); /* and from its file */
                CHECK(!ssdgs_model_load_memory(other, file.data, file.size, &again, NULL));
                (void)picture_of(again, e, SSDGS_ALL_TERMS, want);
                double off = 0; /* files hold floats */
                for (int i = 0; i < 3 * SIDE * SIDE; i++)
                    off = test_most(off, fabs((double)(got[i] - want[i])));
                CHECK(sizeof(ssdgs_real) > 4 ? off < 1e-2 : off <= 0);
                ssdgs_model_destroy(again);
                free(file.data);
                check_again(other, &model, original, e);
            }
        } else {
            CHECK(strstr(told, e->wanted == 4
                                   ? "too few of the model's Gaussians are the original's"
                                   : "no rotation, scale and move brings the original's Gaussians"));
            CHECK(!ssdgs__is_placed(&model->settings));
        }
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(other);
    }
    ssdgs_model_destroy(original);
}

/* A file as versions up to 0.2.4 wrote it: positions far from 0 as doubles, in the world. */
static bytes old_file(const bytes *file, const ssdgs_real origin[3]) {
    const char *header = (const char *)file->data, *body = strstr(header, "end_header\n") + 11;
    document d = parse(file);
    bytes old = {NULL, 0, 0};
    const size_t row = 4 * (size_t)d.table[0].columns;
    for (const char *line = header; line < body;) {
        const char *end = strchr(line, '\n') + 1;
        const int position = !strncmp(line, "property float ", 15) && line[15] >= 'x' && line[15] <= 'z';
        put(&old, position ? "property double " : line, position ? 16 : (size_t)(end - line));
        if (position) put(&old, line + 15, 2);
        line = end;
    }
    for (int i = 0; i < d.table[0].rows; i++, body += row) {
        for (int c = 0; c < 3; c++) {
            float x;
            memcpy(&x, body + 4 * c, 4);
            test_little(&x, sizeof x);
            double there = (double)x + (double)origin[c];
            test_little(&there, sizeof there);
            put(&old, (const char *)&there, 8);
        }
        put(&old, body + 12, row - 12);
    }
    put(&old, body, file->size - (size_t)(body - header));
    return old;
}

/* Far from 0 files hold positions as floats, beside the origin that the settings have; files up to 0.2.4 held
   doubles in the world, and what an editor left of either gets its place back. */
static void test_origin(void) {
    const ssdgs_real origin[3] = {5000000, -650000, (ssdgs_real)0.5};
    ssdgs_model *home = make_model(7), *model = NULL, *back = NULL;
    ssdgs_settings settings = *ssdgs_model_settings(home);
    memcpy(settings.origin, origin, sizeof origin);
    CHECK(ssdgs_model_create(context, &settings, 7, &model) == SSDGS_OK);
    for (int c = 0; c < SSDGS_CHANNELS; c++)
        memcpy(model->gaussians + (size_t)c * model->capacity, home->gaussians + (size_t)c * home->capacity,
               7 * sizeof(ssdgs_real));
    memcpy(model->globals, home->globals, home->global_count * sizeof(ssdgs_real));
    for (int old = 0; old < 2; old++) {
        bytes file = saved(model);
        const document d = parse(&file);
        CHECK(d.tables > 1 && !strcmp(d.table[1].column[0].name, "version"));
        if (old) { /* the version is the first setting */
            int version = 204;
            test_little(&version, sizeof version);
            memcpy(file.data + (d.table[1].data - file.data), &version, 4);
            const bytes now = file;
            file = old_file(&now, origin);
            free(now.data);
        }
        put(&file, "", 1);
        const char *header = (const char *)file.data;
        CHECK(old ||
              strstr(header, "property float x\nproperty float y\nproperty float z\nproperty float nx\n"));
        const size_t at = (size_t)(strstr(header, "end_header\n") + 11 - header);
        bytes own = file;
        own.size--;
        CHECK(tells(&own, NULL, NULL)); /* who has an origin knows of it */
        back = NULL;
        CHECK(load(file.data, file.size - 1, &back, NULL) == SSDGS_OK);
        for (int c = 0; c < 3 && back && old; c++)
            for (int i = 0; i < 7; i++) {
                const size_t k = (size_t)c * model->capacity + (size_t)i;
                CHECK(fabs((double)back->gaussians[k] - (double)model->gaussians[k]) < 1e-9);
                back->gaussians[k] = model->gaussians[k];
            }
        CHECK(same(model, back));
        ssdgs_model_destroy(back);
        { /* an editor dropped the rest: doubles are read as such all the same */
            bytes cut = {NULL, 0, 0};
            const char *end = strstr(header, "element ssdgs_settings"), *body = header + at;
            back = NULL;
            put(&cut, header, (size_t)(end - header));
            text(&cut, "end_header\n");
            put(&cut, body, file.size - 1 - at);
            CHECK(load(cut.data, cut.size, &back, NULL) == SSDGS_OK && back &&
                  ADOPT(back, 1, model) == SSDGS_OK);
            CHECK(!old || tells(&cut, NULL, "positions are relative to settings.origin, 5000000, -6"));
            CHECK(same(model, back));
            ssdgs_model_destroy(back);
            free(cut.data);
        }
        free(file.data);
    }
    for (int format = ASCII; format <= LITTLE;
         format++) { /* doubles and floats of others, and given back to one without an origin */
        bytes file = saved(home), plain;
        {
            document d = parse(&file);
            variant v = {ASCII, "\n", 1, 0, 0, NULL};
            v.format = format;
            plain = emit(&d, &v);
        }
        back = NULL;
        CHECK(load(plain.data, plain.size, &back, NULL) == SSDGS_OK && same(home, back));
        CHECK(back && ADOPT(back, 0, model) == SSDGS_OK);
        for (int c = 0; c < 3 && back; c++) { /* who has settings stays in the world where it is */
            const ssdgs_object there = ssdgs_object_default(back);
            double x = (double)there.to_world[4 * c + 3] + (double)origin[c];
            for (int k = 0; k < 3; k++)
                x += (double)there.to_world[4 * c + k] * (double)back->gaussians[(size_t)k * back->capacity];
            CHECK(fabs(x - (double)home->gaussians[(size_t)c * home->capacity]) < 1e-6);
        }
        CHECK(back && !memcmp(ssdgs_model_settings(back)->origin, origin, sizeof origin));
        ssdgs_model_destroy(back);
        free(plain.data);
        free(file.data);
    }
    ssdgs_model_destroy(home);
    ssdgs_model_destroy(model);
}

static void test_mending(void) {
    ssdgs_model *model = make_model(8), *back = NULL;
    ssdgs_model_view view = ssdgs_model_arrays(model);
    const size_t stride = view.stride;
    for (int i = 0; i < 4; i++) {
        view.gaussians[(size_t)(SSDGS_ROTATION + i) * stride + 1] = 0;
        view.gaussians[(size_t)(SSDGS_FRAME + i) * stride + 2] = 0;
    }
    for (int i = 0; i < 4; i++) { /* drawn as any other */
        view.gaussians[(size_t)(SSDGS_ROTATION + i) * stride + 5] = (ssdgs_real)(i == 2 ? 2e-37 : 0);
        view.gaussians[(size_t)(SSDGS_FRAME + i) * stride + 5] = (ssdgs_real)(i == 3 ? -9e36 : 0);
    }
    view.gaussians[SSDGS_OPACITY * stride + 3] = from_bits(0x7f800000u);
    view.gaussians[SSDGS_OPACITY * stride + 4] = -21;
    view.gaussians[SSDGS_LOG_SCALE * stride + 4] = from_bits(0xff800000u);
    view.gaussians[SSDGS_MATERIAL * stride + 0] = from_bits(0x7fc00000u);
    view.gaussians[SSDGS_POSITION * stride + 7] = from_bits(0xff800000u);
    bytes file = saved(model);
    ssdgs_load_stats stats;
    CHECK(load(file.data, file.size, &back, &stats) == SSDGS_OK);
    if (back) {
        const ssdgs_model_view now = ssdgs_model_arrays(back);
        CHECK(now.count == 6 && stats.dropped == 2 && stats.zero_rotations == 2);
        CHECK(stats.clamped_opacities == 2 && stats.clamped_scales == 1);
        CHECK(now.gaussians[SSDGS_ROTATION * now.stride] == 1 &&
              now.gaussians[SSDGS_FRAME * now.stride + 1] == 1);
        CHECK(now.gaussians[(SSDGS_ROTATION + 2) * now.stride + 4] > 0 &&
              now.gaussians[(SSDGS_FRAME + 3) * now.stride + 4] < 0);
        CHECK(now.gaussians[SSDGS_OPACITY * now.stride + 2] == 20 &&
              now.gaussians[SSDGS_OPACITY * now.stride + 3] == -20);
        CHECK(now.gaussians[SSDGS_LOG_SCALE * now.stride + 3] == -20);
        CHECK(now.gaussians[SSDGS_POSITION * now.stride + 5] == view.gaussians[SSDGS_POSITION * stride + 6]);
    }
    free(file.data);
    ssdgs_model_destroy(back);
    file = saved(model);
    memcpy(file.data + file.size - 4, "\0\0\300\177", 4); /* the last weight: NaN */
    CHECK(refused(file.data, file.size));
    free(file.data);
    view.shadow[5] = from_bits(0x7fc00000u); /* what would be refused is not written: the old file stays */
    CHECK(ssdgs_model_save(model, path) == SSDGS_ERR_NONFINITE && strstr(ssdgs_error_message(context), path));
    file = slurp(path);
    CHECK(load(file.data, file.size, &back, NULL) == SSDGS_OK);
    free(file.data);
    ssdgs_model_destroy(back);
    ssdgs_model_destroy(model);
}

static void test_numbers(void) {
    static const struct {
        const char *text;
        int good;
        uint32_t bits;
    } cases[] = {{"0", 1, 0},
                 {"-0", 1, 0x80000000u},
                 {"1", 1, 0x3f800000u},
                 {"+1.", 1, 0x3f800000u},
                 {".5", 1, 0x3f000000u},
                 {"16777217", 1, 0x4b800000u},
                 {"16777219", 1, 0x4b800002u},
                 {"3.4028235e38", 1, 0x7f7fffffu},
                 {"1e39", 1, 0x7f800000u},
                 {"-1E+999999999999", 1, 0xff800000u},
                 {"1e-999999999999", 1, 0},
                 {"0e5", 1, 0},
                 {"inf", 1, 0x7f800000u},
                 {"-Infinity", 1, 0xff800000u},
                 {"nan", 1, 0x7fc00000u},
                 {"-nan(ind)", 1, 0xffc00000u},
                 {"NaN()", 1, 0x7fc00000u},
                 {"nan(", 0, 0},
                 {"nan(ind)x", 0, 0},
                 {"inf(ind)", 0, 0},
                 {"100000000000000000000000000000e-29", 1, 0x3f800000u},
                 {"0.00000000000000000000000000000000000000001e41", 1, 0x3f800000u},
                 {"", 0, 0},
                 {"-", 0, 0},
                 {".", 0, 0},
                 {"e5", 0, 0},
                 {"1e", 0, 0},
                 {"1e+", 0, 0},
                 {"1.2.3", 0, 0},
                 {"0x10", 0, 0},
                 {"1,5", 0, 0},
                 {"infinit", 0, 0},
                 {"nanx", 0, 0},
                 {"--1", 0, 0}};
    int wrong = 0;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        ssdgs__ply_token token;
        double value = 0;
        token.text = (const unsigned char *)cases[k].text;
        token.length = strlen(cases[k].text);
        if (ssdgs__ply_number(token, &value) == cases[k].good &&
            (!cases[k].good || ssdgs__ply_bits(value) == cases[k].bits))
            continue;
        printf("%s gives %08x\n", cases[k].text, (unsigned)ssdgs__ply_bits(value));
        wrong++;
    }
    for (size_t k = 0; k < 100000; k++) { /* nine digits tell every float */
        const uint32_t want = random_bits() ^ random_bits() << 16;
        double value = 0;
        if ((want & 0x7f800000u) == 0x7f800000u || !(want & 0x7f800000u)) continue;
        char digits[40];
        sprintf(digits, k % 2 ? "%.9g" : "%.17g", (double)from_bits(want));
        ssdgs__ply_token token;
        token.text = (const unsigned char *)digits;
        token.length = strlen(digits);
        wrong += !ssdgs__ply_number(token, &value) || ssdgs__ply_bits(value) != want;
    }
    CHECK(wrong == 0);
}

#define START "ply\nformat binary_little_endian 1.0\n"
#define XYZ "property float x\nproperty float y\nproperty float z\n"

static void test_hostile(void) {
    static const char *const attacks[] = {
        "",
        "p",
        "ply",
        "ply\n",
        "PLY\nformat ascii 1.0\nend_header\n",
        "plyx\nformat ascii 1.0\nend_header\n",
        "ply\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex 0\n",
        START "end_header\n",
        START "element vertex 0\nend_header\n",
        "ply\nformat ascii 2.0\nend_header\n",
        "ply\nformat binary 1.0\nend_header\n",
        START "format ascii 1.0\nend_header\n",
        START "element vertex -1\n" XYZ "end_header\n",
        START "element vertex 1e9\n" XYZ "end_header\n",
        START "element vertex 18446744073709551616\n" XYZ "end_header\n",
        START "element vertex 9223372036854775808\n" XYZ "end_header\n",
        START "element vertex 1537228672809129302\n" XYZ "end_header\n",
        START "element vertex 4000000000\n" XYZ "end_header\n",
        START "element vertex\n" XYZ "end_header\n",
        START "element vertex 1 2\n" XYZ "end_header\n",
        START XYZ "end_header\n",
        START "element vertex 0x10\n" XYZ "end_header\n",
        START "element vertex 0\nproperty float x\nproperty float x\nend_header\n",
        START "element vertex 0\nelement vertex 0\nend_header\n",
        START "element vertex 0\nproperty half x\nend_header\n",
        START "element vertex 0\nproperty list float int x\nend_header\n",
        START "element vertex 0\nproperty list uchar x\nend_header\n",
        START "\nelement vertex 0\nend_header\n",
        START "vertex 0\nend_header\n",
        START "element vertex 0\nend_header now\n",
        START "element face 1\nproperty list char int x\nend_header\n\377abcdefghijkl",
        START "element face 1\nproperty list int int x\nend_header\n\377\377\377\377abcdefghijkl",
        START "element face 1\nproperty list uint double x\nend_header\n\377\377\377\377abcdefghijkl",
        START "element face 9\nproperty list uchar double x\nend_header\n\001abcdefgh",
        "ply\nformat ascii 1.0\nelement vertex 1000000000\n" XYZ "end_header\n1 2 3\n",
        "ply\nformat ascii 1.0\nelement face 1\nproperty list int int x\nend_header\n-1 2 3\n",
        "ply\nformat ascii 1.0\nelement face 1\nproperty list int int x\nend_header\n99999999999999999999 2 "
        "3\n",
        "ply\nformat ascii 1.0\nelement face 1\nproperty list int int x\nend_header\n3 1 2\n",
        START "element vertex 18446744073709551615\nend_header\n"};
    bytes b = {NULL, 0, 0};
    for (size_t k = 0; k < sizeof attacks / sizeof *attacks; k++) {
        CHECK(refused_text(attacks[k]));
        if (!refused_text(attacks[k])) printf("accepted: %s\n", attacks[k]);
    }
    char line[64];
    for (int i = 0; i < 2; i++) { /* too many properties, elements */
        b.size = 0;
        text(&b, START "element vertex 0\n");
        for (size_t k = 0; k < 1100 && i == 0; k++)
            sprintf(line, "property float p%d\n", (int)k), text(&b, line);
        for (size_t k = 0; k < 70 && i == 1; k++) sprintf(line, "element e%d 0\n", (int)k), text(&b, line);
        text(&b, "\nend_header\n");
        CHECK(refused(b.data, b.size));
    }
    free(b.data);
}

/* Every truncation is refused; no damaged byte does harm. */
static void test_damage(void) {
    ssdgs_model *model = make_model(2);
    bytes file = saved(model);
    document d = parse(&file);
    variant v = {ASCII, "\r\n", 0, 1, 1, NULL};
    const size_t live = memory.live;
    int bad = 0;
    for (size_t k = 0; k < file.size; k++) bad += !refused(file.data, k);
    CHECK(bad == 0);
    for (int format = ASCII; format <= BIG; format++) {
        v.format = format;
        bytes other = emit(&d, &v);
        for (size_t k = 0; k < other.size; k++) {
            const unsigned char good = other.data[k];
            ssdgs_model *back;
            const ssdgs_result cut = load(other.data, k, &back, NULL);
            ssdgs_model_destroy(back);
            bad += format == ASCII ? k + 20 < other.size && cut == SSDGS_OK : cut == SSDGS_OK;
            other.data[k] = (unsigned char)(k % 3 ? good ^ 1u << (random_bits() >> 29) : random_bits() >> 24);
            if (load(other.data, other.size, &back, NULL) != SSDGS_OK)
                bad += back != NULL || !ssdgs_error_message(context)[0];
            ssdgs_model_destroy(back);
            other.data[k] = good;
        }
        CHECK(bad == 0 && memory.live == live);
        free(other.data);
    }
    ssdgs_model_destroy(model);
    free(file.data);
}

static int temporaries(void) {
    int count = 0;
#ifndef _WIN32
    DIR *directory = opendir("build");
    struct dirent *entry;
    while (directory && (entry = readdir(directory)) != NULL)
        count += strstr(entry->d_name, &(FILES_AS ".ply.tmp.")[6]) == entry->d_name;
    if (directory) closedir(directory);
#endif
    return count;
}

static void test_memory(void) {
    ssdgs_model *model = make_model(10), *back;
    bytes file = saved(model);
    const size_t live = memory.live;
    for (int what = 0; what < 6;
         what++) { /* load from memory, from a file, save; one failure, failing from then on */
        int n, done = 0;
        for (n = 1; n < 100 && !done; n++) {
            back = NULL;
            memory.calls = 0;
            memory.fail_at = n;
            memory.for_ever = what % 2;
            const ssdgs_result result = what / 2 == 0   ? load(file.data, file.size, &back, NULL)
                                        : what / 2 == 1 ? ssdgs_model_load(context, path, &back, NULL)
                                                        : ssdgs_model_save(model, path);
            memory.fail_at = 0;
            done = memory.calls < n;
            CHECK(done ? result == SSDGS_OK && (what / 2 == 2 || same(model, back))
                       : result == SSDGS_ERR_MEMORY && !back);
            ssdgs_model_destroy(back);
            CHECK(memory.live == live);
        }
        CHECK(done && n > 2);
    }
    CHECK(temporaries() == 0);
    CHECK(load(file.data, file.size, &back, NULL) == SSDGS_OK &&
          same(model, back)); /* the context still works */
    ssdgs_model_destroy(back);
    ssdgs_model_destroy(model);
    free(file.data);
}

static void test_disk(void) {
    ssdgs_model *model = make_model(2000), *old = make_model(3), *back = NULL;
    const size_t live = memory.live;
    CHECK(ssdgs_model_save(old, path) == SSDGS_OK);
    CHECK(ssdgs_model_save(model, FILES_AS ".none/a.ply") == SSDGS_ERR_IO);
    CHECK(strstr(ssdgs_error_message(context), FILES_AS ".none/a.ply"));
    CHECK(ssdgs_model_load(context, FILES_AS ".absent", &back, NULL) == SSDGS_ERR_IO && !back);
    CHECK(ssdgs_model_load(context, "build", &back, NULL) != SSDGS_OK && !back);
    char longest[700] = "build/"; /* its end is told, and what is wrong */
    memset(longest + 6, 'n', 600);
    strcpy(longest + 606, "/m.ply");
    CHECK(ssdgs_model_save(model, longest) == SSDGS_ERR_IO);
    CHECK(strstr(ssdgs_error_message(context), "nnn/m.ply: cannot be created (errno "));
    CHECK(ssdgs_model_save(NULL, path) == SSDGS_ERR_ARGUMENT &&
          ssdgs_model_save(model, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_model_load(context, NULL, &back, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_model_load(NULL, path, &back, NULL) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_model_load_memory(context, NULL, 0, &back, NULL) == SSDGS_ERR_ARGUMENT);
#ifndef _WIN32
    {
        struct stat info; /* what is private stays so, what is protected is not replaced */
        chmod(path, 0600);
        CHECK(!ssdgs_model_save(model, path) && !stat(path, &info) && (info.st_mode & 0777) == 0600);
        chmod(path, 0400);
        if (access(path, W_OK)) /* not as root */
            CHECK(ssdgs_model_save(old, path) == SSDGS_ERR_IO &&
                  strstr(ssdgs_error_message(context), "is write-protected"));
        chmod(path, 0600);
        CHECK(ssdgs_model_save(old, path) == SSDGS_OK);
        MAKE_FOLDER(FILES_AS ".folder");
        CHECK(ssdgs_model_save(model, FILES_AS ".folder") == SSDGS_ERR_IO); /* the rename fails */
        rmdir(FILES_AS ".folder");
        signal(SIGXFSZ, SIG_IGN); /* a disk that is full after 100,000 bytes */
        struct rlimit limit;
        getrlimit(RLIMIT_FSIZE, &limit);
        struct rlimit tight = limit;
        tight.rlim_cur = 100000;
        setrlimit(RLIMIT_FSIZE, &tight);
        CHECK(ssdgs_model_save(model, path) == SSDGS_ERR_IO);
        setrlimit(RLIMIT_FSIZE, &limit);
    }
#endif
    CHECK(temporaries() == 0 && memory.live == live);
    CHECK(ssdgs_model_load(context, path, &back, NULL) == SSDGS_OK && same(old, back));
    ssdgs_model_destroy(back);
    ssdgs_model_destroy(old);
    ssdgs_model_destroy(model);
    remove(path);
}

/* Mean distance from a Gaussian to the next. */
static double mean_step(ssdgs_model *model) {
    const ssdgs_model_view view = ssdgs_model_arrays(model);
    double sum = 0;
    for (int i = 1; i < view.count; i++) {
        double step2 = 0;
        for (int c = 0; c < 3; c++) {
            const ssdgs_real *x = view.gaussians + (size_t)c * view.stride + (size_t)i;
            step2 += ((double)x[0] - (double)x[-1]) * ((double)x[0] - (double)x[-1]);
        }
        sum += sqrt(step2);
    }
    return sum / (view.count - 1);
}

/* How many Gaussians of b are Gaussian i of a, in every channel. */
static int found(ssdgs_model *a, int i, ssdgs_model *b) {
    const ssdgs_model_view u = ssdgs_model_arrays(a), v = ssdgs_model_arrays(b);
    int count = 0;
    for (int j = 0; j < v.count; j++) {
        int channel;
        for (channel = 0; channel < SSDGS_CHANNELS; channel++)
            if (u.gaussians[(size_t)channel * u.stride + (size_t)i] !=
                v.gaussians[(size_t)channel * v.stride + (size_t)j])
                break;
        count += channel == SSDGS_CHANNELS;
    }
    return count;
}

/* Gaussians in no order come sorted, all of them; those in order, few ones and baked ones come as they
   are. */
static void test_order(void) {
    enum { MANY = 1500, FEW = 1000 };
    ssdgs_model *model = make_model(MANY), *back = NULL, *again = NULL, *small = make_model(FEW);
    ssdgs_load_stats stats;
    bytes file = saved(model);
    int once = 0;
    CHECK(load(file.data, file.size, &back, &stats) == SSDGS_OK && stats.sorted == 1 &&
          same_globals(model, back));
    for (int i = 0; i < MANY; i++) once += found(model, i, back) == 1;
    CHECK(once == MANY && ssdgs_model_arrays(back).count == MANY &&
          mean_step(back) < 0.25 * mean_step(model));
    free(file.data);
    file = saved(back);
    CHECK(load(file.data, file.size, &again, &stats) == SSDGS_OK && !stats.sorted && same(back, again));
    ssdgs_model_destroy(again);
    free(file.data);
    CHECK(ssdgs_model_sort(model) == SSDGS_OK && same(model, back));
    ssdgs_model_destroy(back);
    file = saved(small);
    CHECK(load(file.data, file.size, &back, &stats) == SSDGS_OK && !stats.sorted && same(small, back));
    CHECK(ssdgs_model_sort(small) == SSDGS_OK && !same(small, back) &&
          mean_step(small) < 0.25 * mean_step(back));
    ssdgs_model_destroy(back);
    ssdgs_model_destroy(small);
    free(file.data);
    model->gaussians[MANY / 2] = (ssdgs_real)1e7; /* one far out does not hide the others' order */
    file = saved(model);
    CHECK(load(file.data, file.size, &back, &stats) == SSDGS_OK && !stats.sorted && same(model, back));
    ssdgs_model_destroy(back);
    free(file.data);
    ssdgs_model_destroy(model);
    model = make_model(MANY);
    for (int i = 0; i < MANY; i++)
        model->gaussians[i] +=
            (ssdgs_real)(100 * (4 * i / MANY)); /* four objects far apart, each in no order */
    file = saved(model);
    CHECK(load(file.data, file.size, &back, &stats) == SSDGS_OK && stats.sorted == 1 &&
          mean_step(back) < 0.5 * mean_step(model));
    ssdgs_model_destroy(back);
    free(file.data);
    ssdgs_model_destroy(model);
    model = make_baked(MANY, 2);
    file = saved(model);
    CHECK(load(file.data, file.size, &back, &stats) == SSDGS_OK && !stats.sorted && same_baked(model, back));
    ssdgs_model_destroy(back);
    ssdgs_model_destroy(model);
    free(file.data);
}

static double value_named(const document *d, const char *name) {
    for (int c = 0; c < d->table[0].columns; c++)
        if (!strcmp(d->table[0].column[c].name, name))
            return (double)from_bits(word_at(d->table[0].data + 4 * c));
    return 1e30;
}

/* What other programs show of a file: the normal, and as f_dc what light of 1 from all sides makes of the
   terms that the model has, encoded where its pictures are. */
static void test_look(void) {
    static const char *const dc[3] = {"f_dc_0", "f_dc_1", "f_dc_2"}, *const normal[3] = {"nx", "ny", "nz"};
    static const int terms[3] = {SSDGS_ALL_TERMS, SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM,
                                 SSDGS_SCATTERING_TERM};
    for (int i = 0; i < 6; i++) {
        ssdgs_settings settings = ssdgs_settings_default();
        ssdgs_gaussian g = ssdgs_gaussian_default();
        ssdgs_model *model = NULL;
        settings.terms = terms[i / 2];
        settings.transfer = i % 2 ? SSDGS_TRANSFER_NONE : SSDGS_TRANSFER_SRGB;
        for (int c = 0; c < 3; c++) {
            g.diffuse[c] = (ssdgs_real)(0.3 + 0.2 * c);
            g.scattering[c] = (ssdgs_real)(9 - 4 * c);
        }
        g.normal[0] = (ssdgs_real)0.6;
        g.normal[2] = (ssdgs_real)-0.8;
        CHECK(!ssdgs_model_create(context, &settings, 1, &model) && !ssdgs_model_set(model, 0, &g));
        bytes file = saved(model);
        document d = parse(&file);
        for (int c = 0; c < 3; c++) {
            const double diffuse = i / 2 < 2 ? (0.3 + 0.2 * c) / (2 * 3.14159265) : 0,
                         scattered = i / 2 != 1 ? 0.02 * (9 - 4 * c) : 0, color = diffuse + scattered,
                         shown = i % 2 ? color : 1.055 * pow(color, 1 / 2.4) - 0.055;
            CHECK(fabs(value_named(&d, dc[c]) - (shown - 0.5) / 0.28209479) < 1e-5);
            CHECK(fabs(value_named(&d, normal[c]) - (double)g.normal[c]) < 1e-5);
        }
        ssdgs_model_destroy(model);
        free(file.data);
    }
}

typedef struct taken {
    unsigned char *bytes;
    size_t size, most; /* most: refuses from so many on */
    int calls;
} taken;

static int take(void *user, const void *piece, size_t size) {
    taken *t = (taken *)user;
    t->calls++;
    if (t->size + size > t->most) return 1;
    t->bytes = (unsigned char *)realloc(t->bytes, t->size + size);
    memcpy(t->bytes + t->size, piece, size);
    t->size += size;
    return 0;
}

/* A model written to who takes its bytes: those of its file, whose name may be any. Who refuses some gets no
   more. */
static void test_taken(void) {
    ssdgs_context *home = NULL;
    ssdgs_model *model = NULL, *again = NULL;
    taken all = {NULL, 0, (size_t)-1, 0}, few = {NULL, 0, 100000, 0};
    const char *const name = FILES_AS "\xc3\xa9\xe6\xbc\xa2"; /* e with an acute, and a Chinese character */
    unsigned char *file = NULL;
    size_t size = 0;
    CHECK(!ssdgs_context_create(NULL, &home) && !ssdgs_model_create(home, NULL, 700, &model));
    CHECK(!ssdgs_model_save(model, name));
    CHECK(!ssdgs__read_file(home, name, 0, &file, &size));
#ifdef _WIN32
    CHECK(GetFileAttributesW(FILES_AS_WIDE L"\x00e9\x6f22") != INVALID_FILE_ATTRIBUTES);
#endif
    CHECK(!ssdgs_model_write(model, take, &all) && all.calls > 2);
    CHECK(all.size == size && !memcmp(all.bytes, file, size));
    CHECK(!ssdgs_model_load_memory(home, all.bytes, all.size, &again, NULL));
    CHECK(ssdgs_model_count(again) == 700);
    CHECK(ssdgs_model_write(model, take, &few) == SSDGS_ERR_CANCELLED);
    CHECK(few.calls == 2 && few.size < 100000 &&
          !strcmp(ssdgs_error_message(home), "model: its bytes were not taken"));
    CHECK(ssdgs_model_write(model, NULL, NULL) == SSDGS_ERR_ARGUMENT);
    ssdgs__release(home, file);
    free(all.bytes), free(few.bytes);
    (void)SSDGS__UNLINK(name);
    ssdgs_model_destroy(model), ssdgs_model_destroy(again);
    ssdgs_context_destroy(home);
}

int main(void) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = 1;
    TEST_METER(desc, &memory);
#ifndef _WIN32
    MAKE_FOLDER("build");
    test_taken();
#endif
    if (ssdgs_context_create(&desc, &context) != SSDGS_OK) return 1;
    test_round_trip();
    TEST_ROW("81", "every variant of PLY", (test_variants(), test_rows()));
    TEST_ROW("82", "other tools' files", (test_foreign(), test_words(), test_harmonics(), test_mending()));
    test_look();
    test_edited();
    test_versions();
    test_origin();
    test_placed();
    test_nudged();
    test_few_placed();
    test_numbers();
    test_order();
    TEST_ROW("80", "hostile headers, damaged bodies", (test_hostile(), test_damage()));
    TEST_ROW("83", "allocations that fail", test_memory());
    TEST_ROW("84", "disks that fail", test_disk());
    ssdgs_context_destroy(context);
    CHECK(memory.live == 0);
    TEST_END();
}
