/* splats.h - reads plain splats as phones and editors pack them. MIT, see ssdgs.h.

   #include "ssdgs.h"
   #include "splats.h"
   ...
   ssdgs_model *model; char error[512];
   if (splats_load(context, "scan.spz", &model, NULL, error)) { puts(error); return 1; }

   READS  what ssdgs_model_load() reads, SuperSplat's compressed PLY, and SPZ up to version 3. These two
   become plain PLY in memory, of 56 bytes a Gaussian, 236 with harmonics of degree 3. SPZ's axes, y up and z
   back, become those that plain PLY mostly has, y down and z ahead.

   HOSTILE  Every byte of a file may be wrong. */

#ifndef SPLATS_H
#define SPLATS_H

#include "images.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SPLATS__CHUNK = 256, SPLATS__MOST = 1 << 28, SPLATS__PROPERTIES = 64, SPLATS__HEAD = 1 << 16 };
#define SPLATS__HARMONIC 0.28209479177387814 /* a colour is 0.5 + this x f_dc */

/* ---- a plain PLY in memory ---- */

typedef struct splats__ply {
    unsigned char *bytes, *rows;
    size_t size, row; /* bytes, of all and of a row */
    int rest;         /* how many f_rest there are */
} splats__ply;

/* 0, or 1 and a message. */
static inline int splats__begin(splats__ply *p, const char *name, size_t count, int rest, char *error) {
    static const char *const others[8] = {"opacity", "scale_0", "scale_1", "scale_2",
                                          "rot_0",   "rot_1",   "rot_2",   "rot_3"};
    char head[4096] = "";
    p->rest = rest;
    p->row = 4 * (size_t)(14 + rest);
    if (count > SPLATS__MOST || count > ((size_t)-1 - sizeof head) / p->row)
        return olat__fail(error, "%s: %lu Gaussians are too many", name, (unsigned long)count);
    olat__append(head, sizeof head,
                 "ply\nformat binary_little_endian 1.0\nelement vertex %lu\nproperty float x\n"
                 "property float y\nproperty float z\n",
                 (unsigned long)count);
    for (int i = 0; i < 3; i++) olat__append(head, sizeof head, "property float f_dc_%d\n", i);
    for (int i = 0; i < rest; i++) olat__append(head, sizeof head, "property float f_rest_%d\n", i);
    for (int i = 0; i < 8; i++) olat__append(head, sizeof head, "property float %s\n", others[i]);
    olat__append(head, sizeof head, "end_header\n");
    const size_t length = strlen(head);
    p->size = length + count * p->row;
    p->bytes = (unsigned char *)malloc(p->size);
    if (!p->bytes) return olat__fail(error, "%s: out of memory", name);
    memcpy(p->bytes, head, length);
    p->rows = p->bytes + length;
    return 0;
}

/* Sets a value of a row: x y z, f_dc, f_rest, opacity, scale, rot. */
static inline void splats__put(const splats__ply *p, size_t row, int place, double value) {
    const float number = (float)value;
    unsigned char *at = p->rows + row * p->row + 4 * (size_t)place;
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    for (int i = 0; i < 4; i++) at[i] = (unsigned char)(bits >> 8 * i);
}

/* An opacity as files have it, before a sigmoid. */
static inline double splats__logit(double alpha) {
    return alpha <= 0 ? -20 : alpha >= 1 ? 20 : log(alpha / (1 - alpha));
}

/* Turns three parts of a unit quaternion to four: the largest, number `largest`, is the rest. */
static inline void splats__whole(const double parts[3], int largest, double q[4]) {
    double rest = 1;
    for (int i = 0, from = 0; i < 4; i++) {
        if (i == largest) continue;
        rest -= parts[from] * parts[from];
        q[i] = parts[from++];
    }
    q[largest] = sqrt(rest > 0 ? rest : 0);
}

/* ---- SuperSplat's compressed PLY: chunks of 256 Gaussians, and numbers between their bounds ---- */

typedef struct splats__element {
    size_t count, row; /* rows; bytes of one */
    const unsigned char *rows;
    int properties;
    struct {
        char name[24], type;
        size_t at;
    } property[SPLATS__PROPERTIES];
} splats__element;

/* Where a property of that type lies in a row; -1: there is none. */
static inline int splats__at(const splats__element *e, const char *name, char type) {
    for (int i = 0; i < e->properties; i++)
        if (e->property[i].type == type && !strcmp(e->property[i].name, name)) return (int)e->property[i].at;
    return -1;
}

/* Reads the header's elements chunk, vertex and sh. Returns what is wrong, and in which line, 0: in none; or
   NULL. */
static inline const char *splats__header(const unsigned char *bytes, size_t size, splats__element e[3],
                                         int *number) {
    static const char *const names[3] = {"chunk", "vertex", "sh"};
    const unsigned char *at = bytes, *const end = bytes + size;
    int order[3], elements = 0, little = 0;
    memset(e, 0, 3 * sizeof *e);
    for (*number = 1;; ++*number) {
        const unsigned char *stop =
            at < end ? (const unsigned char *)memchr(at, '\n', (size_t)(end - at)) : NULL;
        char line[128], word[4][32] = {"", "", "", ""};
        if (!stop) return "its header has no end";
        size_t length = (size_t)(stop - at);
        if (length && at[length - 1] == '\r') length--;
        if (length >= sizeof line) length = sizeof line - 1; /* of a comment */
        memcpy(line, at, length);
        line[length] = 0;
        at = stop + 1;
        const int words = sscanf(line, "%31s %31s %31s %31s", word[0], word[1], word[2], word[3]);
        splats__element *now = elements ? e + order[elements - 1] : NULL;
        if (words < 1 || !strcmp(word[0], "ply") || !strcmp(word[0], "comment")) continue;
        if (!strcmp(word[0], "obj_info")) continue;
        if (!strcmp(word[0], "end_header")) break;
        if (words == 3 && !strcmp(word[0], "format")) little = !strcmp(word[1], "binary_little_endian");
        else if (words == 3 && !strcmp(word[0], "element")) {
            int which = 0;
            while (which < 3 && strcmp(names[which], word[1]) != 0) which++;
            for (int i = 0; i < elements; i++)
                if (order[i] == which) return "an element stands twice in its header";
            if (which == 3) return "it has an element beside chunk, vertex and sh";
            const double count = strtod(word[2], NULL);
            if (strspn(word[2], "0123456789") != strlen(word[2]) || count > (double)SPLATS__MOST)
                return "a count of rows is no number, or too large";
            e[which].count = (size_t)count;
            order[elements++] = which;
        } else if (words == 3 && !strcmp(word[0], "property") && now) {
            const char *t = word[1];
            const char type = !strcmp(t, "float") || !strcmp(t, "float32") ? 'f'
                              : !strcmp(t, "uint") || !strcmp(t, "uint32") ? 'u'
                              : !strcmp(t, "uchar") || !strcmp(t, "uint8") ? 'b'
                                                                           : 0;
            if (!type) return "a property is neither float, uint nor uchar";
            if (now->properties == SPLATS__PROPERTIES || strlen(word[2]) >= sizeof now->property->name)
                return "an element has too many properties, or one of too long a name";
            strcpy(now->property[now->properties].name, word[2]);
            now->property[now->properties].type = type;
            now->property[now->properties++].at = now->row;
            now->row += type == 'b' ? 1 : 4;
        } else return "its header has a line that says nothing";
    }
    *number = 0;
    if (!little) return "it is not binary_little_endian";
    for (int i = 0; i < elements; i++) {
        splats__element *now = e + order[i];
        now->rows = at;
        if (now->row && now->count > (size_t)(end - at) / now->row) return "it ends early";
        at += now->count * now->row;
    }
    return NULL;
}

/* So many of a number's bits, from `low` on, as 0 .. 1. */
static inline double splats__bits(uint32_t value, int low, int bits) {
    const uint32_t most = (1u << bits) - 1;
    return (double)(value >> low & most) / most;
}

/* 0 and *p, or 1 and a message. */
static inline int splats__compressed(const char *name, const unsigned char *bytes, size_t size,
                                     splats__ply *p, char *error) {
    static const char *const bounds[9] = {"x", "y", "z", "scale_x", "scale_y", "scale_z", "r", "g", "b"};
    static const char *const packed[4] = {"packed_position", "packed_rotation", "packed_scale",
                                          "packed_color"};
    static const int low[3] = {21, 11, 0}, wide[3] = {11, 10, 11};
    splats__element e[3], *const chunk = e, *const vertex = e + 1, *const sh = e + 2;
    int bound_at[18], at[4], rest_at[45], line, colored = 0; /* bound_at: the lower ones, the upper ones */
    char key[32] = "";                                       /* of what is missing, or the line */
    const char *problem = splats__header(bytes, size, e, &line);
    if (problem && line) snprintf(key, sizeof key, "line %d: ", line);
    for (int i = 0; i < 36 && !problem; i++) { /* twice; colours have all bounds or none */
        const int k = i % 18;
        snprintf(key, sizeof key, "%s_%s", k < 9 ? "min" : "max", bounds[k % 9]);
        bound_at[k] = splats__at(chunk, key, 'f');
        colored |= k % 9 > 5 && bound_at[k] >= 0;
        if (i > 17 && bound_at[k] < 0 && (k % 9 < 6 || colored))
            problem = " is missing among its chunks' floats";
    }
    for (int i = 0; i < 4 && !problem; i++) {
        snprintf(key, sizeof key, "%s", packed[i]);
        at[i] = splats__at(vertex, key, 'u');
        if (at[i] < 0) problem = " is missing among its vertices' uints";
    }
    const int rest = sh->properties;
    const int degrees = rest == 0 || rest == 9 || rest == 24 || rest == 45;
    for (int i = 0; i < rest && degrees && !problem; i++) {
        snprintf(key, sizeof key, "f_rest_%d", i);
        rest_at[i] = splats__at(sh, key, 'b');
        if (rest_at[i] < 0) problem = " is missing among its harmonics' uchars";
    }
    if (!problem) *key = 0;
    if (!problem && !degrees) problem = "its harmonics are of no degree from 1 to 3";
    if (!problem && rest && sh->count != vertex->count) problem = "not all of its vertices have harmonics";
    if (!problem && chunk->count < (vertex->count + SPLATS__CHUNK - 1) / SPLATS__CHUNK)
        problem = "not all of its vertices have a chunk";
    if (problem) return olat__fail(error, "%s: a compressed PLY: %s%s", name, key, problem);
    if (splats__begin(p, name, vertex->count, rest, error)) return 1;
    for (size_t i = 0; i < vertex->count; i++) {
        const unsigned char *of = chunk->rows + i / SPLATS__CHUNK * chunk->row,
                            *row = vertex->rows + i * vertex->row;
        uint32_t word[4];
        double share[9], parts[3], q[4];
        for (int k = 0; k < 4; k++) word[k] = olat__le32(row + at[k]);
        for (int k = 0; k < 9; k++) {
            share[k] = k < 6 ? splats__bits(word[k < 3 ? 0 : 2], low[k % 3], wide[k % 3])
                             : splats__bits(word[3], 24 - 8 * (k - 6), 8);
            if (bound_at[k] >= 0)
                share[k] = (double)olat__le_float(of + bound_at[k]) * (1 - share[k]) +
                           (double)olat__le_float(of + bound_at[9 + k]) * share[k];
        }
        for (int k = 0; k < 3; k++) {
            parts[k] = (splats__bits(word[1], 20 - 10 * k, 10) - 0.5) * 1.4142135623730951;
            splats__put(p, i, k, share[k]);
            splats__put(p, i, 3 + k, (share[6 + k] - 0.5) / SPLATS__HARMONIC);
            splats__put(p, i, 7 + rest + k, share[3 + k]);
        }
        splats__put(p, i, 6 + rest, splats__logit(splats__bits(word[3], 0, 8)));
        splats__whole(parts, (int)(word[1] >> 30), q);
        for (int k = 0; k < 4; k++) splats__put(p, i, 10 + rest + k, q[k]);
        for (int k = 0; k < rest; k++) {
            const int value = sh->rows[i * sh->row + (size_t)rest_at[k]];
            splats__put(p, i, 6 + k, 8 * ((value == 0 ? 0 : value == 255 ? 1 : (value + 0.5) / 256) - 0.5));
        }
    }
    return 0;
}

/* ---- SPZ: gzip around plain arrays ---- */

/* The only member of a gzip file. Returns what is wrong, or NULL and *out, the caller's to free. */
static inline const char *splats__gunzip(const unsigned char *in, size_t size, unsigned char **out,
                                         size_t *length) {
    olat__inflater *z;
    size_t at = 10;
    if (size < 18 || in[2] != 8 || in[3] & 0xE0) return "a bad gzip header";
    if (in[3] & 4) at += 2 + ((size_t)in[10] | (size_t)in[11] << 8);
    for (int text = 8; text <= 16; text *= 2) /* a name, a comment */
        for (int more = in[3] & text; more; at++)
            if (at >= size) return "a bad gzip header";
            else more = in[at] != 0;
    at += in[3] & 2;
    if (at >= size - 8) return "a bad gzip header";
    const uint32_t checksum = olat__le32(in + size - 8);
    *length = olat__le32(in + size - 4);
    if (*length / 1032 > size) return "cut short, or of a length that deflate cannot reach";
    z = (olat__inflater *)calloc(1, sizeof *z);
    *out = (unsigned char *)malloc(*length + 1);
    const char *problem = z && *out ? NULL : "out of memory";
    if (!problem) {
        z->in = in;
        z->size = size - 8;
        z->at = at;
        z->out = *out;
        z->capacity = *length;
        problem = olat__unpack(z);
        if (!problem && z->at != z->size) problem = "more than one gzip member";
        if (!problem && olat__crc32(*out, *length) != checksum) problem = "the checksum is wrong";
    }
    free(z);
    return problem;
}

/* A plain PLY of what gzip had packed. 0 and *p, or 1 and a message. */
static inline int splats__spz(const char *name, const unsigned char *bytes, size_t size, splats__ply *p,
                              char *error) {
    static const double back[3] = {1, -1, -1}; /* y up, z back: y down, z ahead */
    static const signed char flip[15] = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};
    if (size < 16 || memcmp(bytes, "NGSP", 4) != 0) return olat__fail(error, "%s: gzip, but no SPZ", name);
    const uint32_t version = olat__le32(bytes + 4), count = olat__le32(bytes + 8);
    const int degree = bytes[12], fraction = bytes[13], rest = 3 * ((degree + 1) * (degree + 1) - 1);
    if (version < 1 || version > 3)
        return olat__fail(error, "%s: SPZ of version %lu, where 1 to 3 are read", name,
                          (unsigned long)version);
    if (degree > 3)
        return olat__fail(error, "%s: SPZ: harmonics of degree %d, where 3 is the most", name, degree);
    if (bytes[14] & 2) return olat__fail(error, "%s: SPZ with extensions, which are not read", name);
    const size_t place = version == 1 ? 6 : 9, turn = version < 3 ? 3 : 4,
                 each = place + 1 + 3 + 3 + turn + (size_t)rest;
    if ((size - 16) % each != 0 || (size - 16) / each != count)
        return olat__fail(error, "%s: SPZ: %lu bytes, which are not %lu Gaussians of %d", name,
                          (unsigned long)(size - 16), (unsigned long)count, (int)each);
    const unsigned char *const position = bytes + 16, *const alpha = position + place * count,
                               *const color = alpha + count, *const scale = color + 3 * (size_t)count,
                               *const rotation = scale + 3 * (size_t)count,
                               *const sh = rotation + turn * count;
    if (splats__begin(p, name, count, rest, error)) return 1;
    for (size_t i = 0; i < count; i++) {
        const unsigned char *r = rotation + turn * i;
        double parts[3], xyzw[4];
        int largest = 3;
        for (size_t k = 0; k < 3; k++) {
            const unsigned char *at = position + place * i + place / 3 * k;
            const double whole = (double)(at[0] | at[1] << 8) + (version > 1 ? 65536.0 * (at[2] ^ 128) : 0);
            const double x =
                version == 1 ? (double)olat__from_half((unsigned)whole) : ldexp(whole - 8388608, -fraction);
            splats__put(p, i, (int)k, back[k] * x);
            splats__put(p, i, 3 + (int)k, ((double)color[3 * i + k] / 255 - 0.5) / 0.15);
            splats__put(p, i, 7 + rest + (int)k, (double)scale[3 * i + k] / 16 - 10);
            parts[k] = (double)r[k] / 127.5 - 1;
        }
        if (version == 3) { /* a sign and nine bits each, the last lowest */
            const uint32_t word = olat__le32(r);
            largest = (int)(word >> 30);
            for (int k = 0; k < 3; k++)
                parts[k] = (word >> (29 - 10 * k) & 1 ? -1 : 1) * 0.70710678118654752 *
                           splats__bits(word, 20 - 10 * k, 9);
        }
        splats__whole(parts, largest, xyzw);
        splats__put(p, i, 6 + rest, splats__logit((double)alpha[i] / 255));
        splats__put(p, i, 10 + rest, xyzw[3]);
        for (int k = 0; k < 3; k++) splats__put(p, i, 11 + rest + k, back[k] * xyzw[k]);
        for (int k = 0; k < rest; k++) /* colours of a coefficient lie together */
            splats__put(p, i, 6 + k % 3 * (rest / 3) + k / 3,
                        flip[k / 3] * ((double)sh[(size_t)rest * i + (size_t)k] - 128) / 128);
    }
    return 0;
}

/* ---- any of them ---- */

/* How a file that begins so is packed. */
enum { SPLATS__PLAIN, SPLATS__GZIP, SPLATS__NEWER, SPLATS__CHUNKS };
static inline int splats__kind(const unsigned char *bytes, size_t size) {
    static const char mark[] = "packed_position";
    const size_t most = size < SPLATS__HEAD ? size : (size_t)SPLATS__HEAD, length = sizeof mark - 1;
    if (size > 2 && bytes[0] == 0x1F && bytes[1] == 0x8B) return SPLATS__GZIP;
    if (size > 4 && !memcmp(bytes, "NGSP", 4)) return SPLATS__NEWER;
    for (size_t at = 0; size > 3 && !memcmp(bytes, "ply", 3) && at + length <= most; at++)
        if (!memcmp(bytes + at, mark, length)) return SPLATS__CHUNKS;
    return SPLATS__PLAIN;
}

/* Makes of a packed file's bytes a plain PLY, *plain, the caller's to free; NULL where it is not packed. 0,
   or 1 and a message that begins with the name. */
static inline int splats_unpack(const char *name, const unsigned char *bytes, size_t size,
                                unsigned char **plain, size_t *plain_size, char error[512]) {
    const int kind = splats__kind(bytes, size);
    unsigned char *raw = NULL;
    size_t length = 0;
    splats__ply p;
    int failed = 0;
    memset(&p, 0, sizeof p);
    *plain = NULL;
    if (kind == SPLATS__GZIP) {
        const char *problem = splats__gunzip(bytes, size, &raw, &length);
        failed = problem ? olat__fail(error, "%s: gzip: %s", name, problem)
                         : splats__spz(name, raw, length, &p, error);
        free(raw);
    } else if (kind == SPLATS__CHUNKS) failed = splats__compressed(name, bytes, size, &p, error);
    else if (kind == SPLATS__NEWER)
        failed = olat__fail(error, "%s: SPZ of version 4 or later, where 1 to 3 are read", name);
    *plain = p.bytes;
    *plain_size = p.size;
    return failed;
}

#ifndef SSDGS_NO_STDIO
/* A model of any of the files above. stats may be NULL. 0, or 1 and a message that names the file; then *out
   is NULL. */
static inline int splats_load(ssdgs_context *context, const char *path, ssdgs_model **out,
                              ssdgs_load_stats *stats, char error[512]) {
    unsigned char head[SPLATS__HEAD], *bytes = NULL, *plain = NULL;
    size_t size = 0;
    FILE *file = fopen(path, "rb");
    *out = NULL;
    if (file) {
        size = fread(head, 1, sizeof head, file);
        fclose(file);
    }
    if (splats__kind(head, size) != SPLATS__PLAIN) {
        const int failed = olat__read_file(path, &bytes, &size, error) ||
                           splats_unpack(path, bytes, size, &plain, &size, error);
        free(bytes);
        if (failed) return 1;
    }
    const ssdgs_result result = plain ? ssdgs_model_load_memory(context, plain, size, out, stats)
                                      : ssdgs_model_load(context, path, out, stats);
    free(plain);
    return result ? olat__fail(error, "%s: %s", ssdgs_result_string(result), ssdgs_error_message(context))
                  : 0;
}
#endif
#endif
