/* images.h - reads PNG, JPEG and OpenEXR, writes PNG, animated too. MIT, see ssdgs.h.

   #include "ssdgs.h"
   #include "images.h"
   ...
   int width, height; ssdgs_pixels format; void *pixels; char error[512];
   if (olat_read_png("in.png", &width, &height, &format, &pixels, error)) { puts(error); return 1; }
   ... (height, width, 4) bytes or words as stored ...  free(pixels);
   if (olat_write_png("out.png", width, height, 4, bytes, error)) { puts(error); return 1; }

   READS  PNG of any kind, as bytes or words of sRGB: what cICP, else an ICC profile of curves and a matrix,
   else sRGB, else gAMA and cHRM say is converted to that, PQ and HLG to light in halves. OpenEXR, scan lines
   or tiles, unpacked, RLE, ZIPS, ZIP, PIZ or PXR24, halves or floats: the display window, alpha divided out,
   in sRGB's primaries; R G B A of the layer or part named Combined, else of the one without a name, else of
   rgba or beauty, of one with alpha, of any; where there is none, Y; of the default view. JPEG as jpeg.h has
   it, by its ICC profile, EXIF's Adobe RGB, or sRGB. olat__image_file does all that and tells what is to be
   noted; olat_read_png gives a PNG's numbers as they are stored.

   CONTENTS  inflate and deflate; what is to be noted of files; primaries; PNG; OpenEXR; what numbers stand
   for, curves and profiles, each kind of file as a photograph or a mask.

   ERRORS  Functions return 0, or 1 and one message that names the file and the byte. Nothing is kept.

   MEMORY  Pixels are the caller's to free. Beside them reading a PNG takes its file twice and its samples,
   OpenEXR its file and four ssdgs_real a pixel, JPEG its file and what jpeg.h says; writing takes a little
   more than two pictures. All that is freed before the end.

   HOSTILE  Every byte of a file may be wrong. */

#ifndef OLAT_IMAGES_H
#define OLAT_IMAGES_H

#include "files.h"
#include "jpeg.h"
#include <math.h>

/* ==== inflate and deflate, RFC 1950 and 1951 ==== */

static const unsigned short olat__length_base[29] = {3,  4,  5,  6,   7,   8,   9,   10,  11, 13,
                                                     15, 17, 19, 23,  27,  31,  35,  43,  51, 59,
                                                     67, 83, 99, 115, 131, 163, 195, 227, 258};
static const unsigned short olat__distance_base[30] = {
    1,   2,   3,   4,   5,   7,    9,    13,   17,   25,   33,   49,   65,    97,    129,
    193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577};
static int olat__length_extra(int i) { return i < 8 || i == 28 ? 0 : i / 4 - 1; }
static int olat__distance_extra(int i) { return i < 4 ? 0 : i / 2 - 1; }

static unsigned olat__reverse(unsigned code, int length) {
    unsigned reversed = 0;
    for (; length > 0; length--, code >>= 1) reversed = reversed << 1 | (code & 1);
    return reversed;
}

static uint32_t olat__adler32(const unsigned char *data, size_t size) {
    uint32_t a = 1, b = 0;
    while (size > 0) {
        size_t part = size < 5552 ? size : 5552; /* the most for which b stays below 2^32 */
        for (size -= part; part > 0; part--) b += a += *data++;
        a %= 65521;
        b %= 65521;
    }
    return b << 16 | a;
}

static uint32_t olat__be32(const unsigned char *p) {
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

static void olat__put_be32(unsigned char *p, uint32_t value) {
    for (int i = 0; i < 4; i++) p[i] = (unsigned char)(value >> (24 - 8 * i) & 255);
}

#define OLAT__FAST_BITS 9
typedef struct olat__huffman {
    uint16_t fast[1 << OLAT__FAST_BITS]; /* symbol | length << 9 of the code in the low bits; 0: a longer
                                            code, or none */
    uint16_t count[16], symbol[288];     /* codes of each length; symbols in the order of their codes */
} olat__huffman;

typedef struct olat__inflater {
    const unsigned char *in;
    size_t size, at;
    uint64_t bits; /* read but not consumed, lowest first, zeros above */
    int count;
    unsigned char *out;
    size_t capacity, length;
    int may_be_less;     /* capacity is only a bound */
    const char *problem; /* the first one; readers then return harmless values and the loops end */
    olat__huffman literals, distances;
} olat__inflater;

static int olat__bad(olat__inflater *z, const char *problem) {
    if (!z->problem) z->problem = problem;
    return 256;
}

/* Builds the canonical code. Incomplete sets are refused, but for the one-code and the empty distance
   code. */
static void olat__huffman_build(olat__inflater *z, olat__huffman *h, const unsigned char *lengths, int count,
                                const char *problem) {
    unsigned code[16] = {0}, offset[16] = {0};
    int left = 1, used = 0;
    memset(h, 0, sizeof *h);
    for (int i = 0; i < count; i++) h->count[lengths[i]]++;
    h->count[0] = 0;
    for (int i = 1; i < 16; i++) {
        left = 2 * left - h->count[i];
        if (left < 0) break;
        code[i] = (code[i - 1] + h->count[i - 1]) << 1;
        offset[i] = offset[i - 1] + h->count[i - 1];
        used += h->count[i];
    }
    if (left < 0 || (left > 0 && !(h == &z->distances && used <= 1 && used == h->count[1]))) {
        olat__bad(z, problem);
        return;
    }
    for (int i = 0; i < count; i++) {
        int length = lengths[i];
        if (length == 0) continue;
        h->symbol[offset[length]++] = (uint16_t)i;
        unsigned slot = olat__reverse(code[length]++, length);
        for (; length <= OLAT__FAST_BITS && slot < 1 << OLAT__FAST_BITS; slot += 1u << length) {
            h->fast[slot] = (uint16_t)(i | length << 9);
        }
    }
}

static void olat__refill(olat__inflater *z) {
    for (; z->count <= 56 && z->at < z->size; z->count += 8) z->bits |= (uint64_t)z->in[z->at++] << z->count;
}

static int olat__drop(olat__inflater *z, int n, int value) {
    if (z->count < n) return olat__bad(z, "the data end early");
    z->bits >>= n;
    z->count -= n;
    return value;
}

/* The next n <= 16 bits. */
static int olat__take(olat__inflater *z, int n) {
    olat__refill(z);
    return olat__drop(z, n, (int)(z->bits & ((1u << n) - 1)));
}

static int olat__symbol(olat__inflater *z, const olat__huffman *h) {
    int code = 0, first = 0, index = 0;
    olat__refill(z);
    const unsigned entry = h->fast[z->bits & ((1 << OLAT__FAST_BITS) - 1)];
    if (entry) return olat__drop(z, (int)(entry >> 9), (int)(entry & 511));
    for (int length = 1; length < 16; length++) {
        code |= (int)(z->bits >> (length - 1) & 1);
        if (code - first < h->count[length]) return olat__drop(z, length, h->symbol[index + code - first]);
        index += h->count[length];
        first = (first + h->count[length]) << 1;
        code <<= 1;
    }
    return olat__bad(z, "a code that stands for nothing");
}

/* Gives whole unread bytes back to the input and drops the rest of the current one; returns how many bytes
   are left. */
static size_t olat__align(olat__inflater *z) {
    z->at -= (size_t)(z->count / 8);
    z->bits = 0;
    z->count = 0;
    return z->size - z->at;
}

static void olat__stored(olat__inflater *z) {
    size_t left = olat__align(z), length;
    const unsigned char *p = z->in + z->at;
    if (left < 4) olat__bad(z, "the data end early");
    else if ((p[0] ^ p[2]) != 255 || (p[1] ^ p[3]) != 255)
        olat__bad(z, "a stored block's length and its complement disagree");
    else if ((length = (size_t)(p[0] | p[1] << 8)) > left - 4) olat__bad(z, "the data end early");
    else if (length > z->capacity - z->length) olat__bad(z, "more data than are needed");
    else {
        memcpy(z->out + z->length, p + 4, length);
        z->at += 4 + length;
        z->length += length;
    }
}

/* Reads the two codes of a dynamic block, whose lengths are written in a third one. */
static void olat__dynamic(olat__inflater *z) {
    static const unsigned char order[19] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    unsigned char lengths[320] = {0};
    int literals = 257 + olat__take(z, 5), distances = 1 + olat__take(z, 5), codes = 4 + olat__take(z, 4);
    if (literals > 286 || distances > 30) olat__bad(z, "too many codes");
    for (int i = 0; i < codes && !z->problem; i++) lengths[order[i]] = (unsigned char)olat__take(z, 3);
    if (z->problem) return;
    olat__huffman_build(z, &z->literals, lengths, 19, "bad lengths of code lengths");
    for (int i = 0; i < literals + distances && !z->problem;) {
        int symbol = olat__symbol(z, &z->literals), value = symbol < 16 ? symbol : 0, repeat = 1;
        if (symbol == 16) {
            if (i == 0) olat__bad(z, "a repeat before the first code length");
            else value = lengths[i - 1];
        }
        if (symbol > 15)
            repeat = symbol == 18 ? 11 + olat__take(z, 7) : 3 + olat__take(z, symbol == 16 ? 2 : 3);
        if (repeat > literals + distances - i) olat__bad(z, "too many code lengths");
        for (; repeat > 0 && !z->problem; repeat--) lengths[i++] = (unsigned char)value;
    }
    if (lengths[256] == 0) olat__bad(z, "no code for the end of a block");
    if (z->problem) return;
    olat__huffman_build(z, &z->literals, lengths, literals, "bad literal codes");
    olat__huffman_build(z, &z->distances, lengths + literals, distances, "bad distance codes");
}

static void olat__fixed(olat__inflater *z) {
    unsigned char lengths[288];
    memset(lengths, 8, 288);
    memset(lengths + 144, 9, 112);
    memset(lengths + 256, 7, 24);
    olat__huffman_build(z, &z->literals, lengths, 288, "");
    memset(lengths, 5, 32); /* 30 and 31 complete the code and are refused when met */
    olat__huffman_build(z, &z->distances, lengths, 32, "");
}

static void olat__compressed(olat__inflater *z) {
    while (!z->problem) {
        int symbol = olat__symbol(z, &z->literals);
        if (symbol == 256) return;
        if (symbol < 256) {
            if (z->length == z->capacity) olat__bad(z, "more data than are needed");
            else z->out[z->length++] = (unsigned char)symbol;
            continue;
        }
        symbol -= 257;
        if (symbol > 28) {
            olat__bad(z, "a bad length code");
            return;
        }
        int length = olat__length_base[symbol] + olat__take(z, olat__length_extra(symbol));
        symbol = olat__symbol(z, &z->distances);
        if (symbol > 29) {
            olat__bad(z, "a bad distance code");
            return;
        }
        const size_t distance =
            (size_t)(olat__distance_base[symbol] + olat__take(z, olat__distance_extra(symbol)));
        if (distance > z->length) olat__bad(z, "a distance reaches before the data");
        if ((size_t)length > z->capacity - z->length) olat__bad(z, "more data than are needed");
        for (; length > 0 && !z->problem; length--, z->length++)
            z->out[z->length] = z->out[z->length - distance];
    }
}

/* Unpacks a stream without a header, from z->at on, to exactly z->capacity bytes, or to fewer where that is
   allowed; z->at becomes its end. Returns NULL or what is wrong. */
static const char *olat__unpack(olat__inflater *z) {
    for (int last = 0; !last && !z->problem;) {
        last = olat__take(z, 1);
        const int type = olat__take(z, 2);
        if (z->problem) break;
        if (type == 3) olat__bad(z, "a block of unknown type");
        else if (type == 0) olat__stored(z);
        else {
            if (type == 1) olat__fixed(z);
            else olat__dynamic(z);
            olat__compressed(z);
        }
    }
    olat__align(z);
    if (!z->problem && z->length < z->capacity && !z->may_be_less) olat__bad(z, "less data than are needed");
    return z->problem;
}

/* The same of a zlib stream. */
static const char *olat__inflate(olat__inflater *z) {
    if (z->size < 6) return "the data end early";
    if ((z->in[0] & 15) != 8 || z->in[0] >> 4 > 7 || (z->in[0] * 256 + z->in[1]) % 31 != 0 ||
        (z->in[1] & 32) != 0) {
        return "a bad zlib header";
    }
    z->at = 2;
    if (olat__unpack(z)) return z->problem;
    if (z->size - z->at < 4) return "the data end early";
    return olat__be32(z->in + z->at) == olat__adler32(z->out, z->length) ? NULL
                                                                         : "the Adler checksum is wrong";
}

typedef struct olat__deflater {
    unsigned char *out;
    size_t length;
    uint64_t bits;
    int count;
} olat__deflater;

static void olat__put(olat__deflater *z, size_t value, int n) {
    z->bits |= (uint64_t)value << z->count;
    for (z->count += n; z->count >= 8; z->count -= 8, z->bits >>= 8)
        z->out[z->length++] = (unsigned char)(z->bits & 255);
}

static void olat__put_symbol(olat__deflater *z, int symbol) {
    int length = symbol < 144 || symbol > 279 ? 8 : symbol < 256 ? 9 : 7;
    int code = symbol + (symbol < 144 ? 0x30 : symbol < 256 ? 0x190 - 144 : symbol < 280 ? -256 : 0xC0 - 280);
    olat__put(z, olat__reverse((unsigned)code, length), length);
}

static unsigned olat__hash(const unsigned char *p) {
    return ((uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16) * 2654435761u >> 17;
}

/* Packs size < 2^31 bytes into one block of fixed codes; returns the length of the zlib stream. The table
   holds (2, 32768) zeros: the last position + 1 of each hash, and the one before of each position. Nine bits
   a byte are the worst case. */
static size_t olat__deflate(const unsigned char *in, size_t size, unsigned char *out, uint32_t *table) {
    olat__deflater z = {out, 0, 0, 0};
    size_t i = 0;
    olat__put(&z, 0x0178, 16);
    olat__put(&z, 3, 3); /* last block, fixed codes */
    while (i < size) {
        size_t best = 2, distance = 0;
        uint32_t candidate = i + 3 <= size ? table[olat__hash(in + i)] : 0;
        for (int tries = 0; tries < 48 && candidate && i - (candidate - 1) <= 32768; tries++) {
            size_t from = candidate - 1, length = 0;
            while (length < 258 && i + length < size && in[from + length] == in[i + length]) length++;
            if (length > best) best = length, distance = i - from;
            candidate = table[32768 + (from & 32767)];
        }
        size_t step = distance ? best : 1;
        if (distance) {
            int s;
            for (s = 28; olat__length_base[s] > best; s--) {}
            olat__put_symbol(&z, 257 + s);
            olat__put(&z, best - olat__length_base[s], olat__length_extra(s));
            for (s = 29; olat__distance_base[s] > distance; s--) {}
            olat__put(&z, olat__reverse((unsigned)s, 5), 5);
            olat__put(&z, distance - olat__distance_base[s], olat__distance_extra(s));
        } else olat__put_symbol(&z, in[i]);
        for (; step > 0; step--, i++) {
            uint32_t *head = i + 3 <= size ? &table[olat__hash(in + i)] : NULL;
            if (!head) continue;
            table[32768 + (i & 32767)] = *head;
            *head = (uint32_t)i + 1;
        }
    }
    olat__put_symbol(&z, 256);
    olat__put(&z, 0, (8 - z.count) & 7);
    olat__put_be32(out + z.length, olat__adler32(in, size));
    return z.length + 4;
}

/* ==== what is to be noted of files ==== */

enum { OLAT__NAMED = 1, OLAT__OF_MASK = 2, OLAT__REMARKS = 8 };
#define OLAT__OUTSIDE \
    "of colours that sRGB does not hold, in more than 0.1 %% of the pixels: these are clamped"
#define OLAT__OBLONG(kind) \
    "of pixels that are not square (" kind "): read as stored, so fl_x and fl_y must be those of the " \
    "stored picture"
#define OLAT__TURNED \
    "to be turned or mirrored for viewing (%s %d): read as stored, so cameras must be those of the stored " \
    "picture"
#define OLAT__UNUSABLE \
    "marked with %s that cannot be used (%s): read without; export as sRGB, or with a profile of a matrix " \
    "and curves"
typedef struct olat__remark {
    int flags; /* OLAT__NAMED: the files' names belong to it; OLAT__OF_MASK: it is about masks */
    char text[240];
} olat__remark;

typedef struct olat__found {
    olat__remark remarks[OLAT__REMARKS];
    int count;
    unsigned long broken; /* values that are not finite */
    double largest;       /* of the mask, of 1 */
    unsigned number;      /* the same as stored */
    int waits, inverted;  /* the mask */
    int failed;
} olat__found;

/* Adds what follows "1 of the 9 photographs is"; equal ones are counted. */
OLAT__PRINTF(3, 4) static void olat__tell(olat__found *found, int flags, const char *format, ...) {
    if (found->count == OLAT__REMARKS) return;
    olat__remark *remark = found->remarks + found->count++;
    remark->flags = flags;
    va_list list;
    va_start(list, format);
    vsnprintf(remark->text, sizeof remark->text, format, list);
    va_end(list);
    olat__tame(remark->text);
}

/* ==== primaries ==== */

static void olat__transform(const double matrix[9], const double v[3], double result[3]) {
    for (int i = 0; i < 3; i++)
        result[i] = matrix[3 * i] * v[0] + matrix[3 * i + 1] * v[1] + matrix[3 * i + 2] * v[2];
}

/* 0 where there is no inverse. */
static int olat__invert(const double m[9], double inverse[9]) {
    for (int i = 0; i < 9; i++) { /* the cofactor of row i % 3, column i / 3 */
        const int r = 3 * ((i + 1) % 3), s = 3 * ((i + 2) % 3), c = (i / 3 + 1) % 3, d = (i / 3 + 2) % 3;
        inverse[i] = m[r + c] * m[s + d] - m[r + d] * m[s + c];
    }
    const double determinant = m[0] * inverse[0] + m[1] * inverse[3] + m[2] * inverse[6];
    for (int i = 0; i < 9; i++) inverse[i] /= fabs(determinant) > 1e-9 ? determinant : 1;
    return fabs(determinant) > 1e-9;
}

/* CIE XYZ of the light of three primaries, in columns, and of white as 1 1 1 of it, from the xy of the
   four. */
static int olat__xyz(const double xy[8], double xyz[9]) {
    double inverse[9], white[3], amount[3];
    for (int i = 0; i < 8; i++)
        if (!(xy[i] >= -1 && xy[i] <= 2)) return 0;
    for (int i = 0; i < 3; i++) {
        xyz[i] = xy[2 * i];
        xyz[3 + i] = xy[2 * i + 1];
        xyz[6 + i] = 1 - xy[2 * i] - xy[2 * i + 1];
    }
    white[0] = xy[6], white[1] = xy[7], white[2] = 1 - xy[6] - xy[7];
    if (!olat__invert(xyz, inverse) || !(white[1] > 0.01)) return 0;
    olat__transform(inverse, white, amount);
    for (int i = 0; i < 9; i++) xyz[i] *= amount[i % 3] / white[1];
    return amount[0] > 0 && amount[1] > 0 && amount[2] > 0;
}

/* What Bradford's three cones take in of the primaries, relative to what they do of 1 1 1, their white. */
static int olat__cones(const double xyz[9], double cones[9]) {
    static const double bradford[9] = {0.8951, 0.2664, -0.1614, -0.7502, 1.7135,
                                       0.0367, 0.0389, -0.0685, 1.0296};
    int good = 1;
    for (int i = 0; i < 9; i++) {
        const double *row = bradford + i / 3 * 3;
        cones[i] = row[0] * xyz[i % 3] + row[1] * xyz[3 + i % 3] + row[2] * xyz[6 + i % 3];
    }
    for (int i = 0; i < 9; i += 3) {
        const double white = cones[i] + cones[i + 1] + cones[i + 2];
        good &= white > 0.01;
        for (int k = 0; k < 3; k++) cones[i + k] /= white > 0.01 ? white : 1;
    }
    return good;
}

/* What takes linear light of primaries of this XYZ to linear light of sRGB's, and white to white: returns 0
   where there is no such matrix, 1 where it is the identity, 2 else. Rows sum to 1. */
static int olat__colorants(const double xyz[9], double matrix[9]) {
    static const double srgb[8] = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
    double to_xyz[9], from[9], to[9], inverse[9];
    int differs = 0, sensible = olat__cones(xyz, from);
    olat__xyz(srgb, to_xyz);
    olat__cones(to_xyz, to);
    olat__invert(to, inverse);
    for (int i = 0; i < 9; i++) {
        const double *row = inverse + i / 3 * 3;
        matrix[i] = row[0] * from[i % 3] + row[1] * from[3 + i % 3] + row[2] * from[6 + i % 3];
        sensible &= fabs(matrix[i]) < 16;
        differs |= fabs(matrix[i] - (i % 4 == 0)) > 1e-3;
    }
    for (int i = 0; i < 9 && !differs; i++) matrix[i] = i % 4 == 0;
    return sensible ? 1 + differs : 0;
}

/* The same from the CIE xy of red, green, blue and white; all else about the eye's adaptation is Bradford's.
 */
static int olat__primaries(const double xy[8], double matrix[9]) {
    double xyz[9];
    return olat__xyz(xy, xyz) ? olat__colorants(xyz, matrix) : 0;
}

/* ==== PNG ==== */

enum {
    OLAT__IHDR = 0x49484452,
    OLAT__PLTE = 0x504C5445,
    OLAT__IDAT = 0x49444154,
    OLAT__IEND = 0x49454E44,
    OLAT__TRNS = 0x74524E53,
    OLAT__ACTL = 0x6163544C, /* of animated ones: how many frames; of a frame; its pixels */
    OLAT__FCTL = 0x6663544C,
    OLAT__FDAT = 0x66644154
};
/* Chunks that tell about the picture: kept as they are, the first intact one of each kind. */
enum { OLAT__GAMA, OLAT__CHRM, OLAT__SRGB, OLAT__ICCP, OLAT__CICP, OLAT__PHYS, OLAT__EXIF, OLAT__TELLING };
static const struct {
    char type[5];
    size_t length; /* 0: any */
} olat__telling[OLAT__TELLING] = {{"gAMA", 4}, {"cHRM", 32}, {"sRGB", 1}, {"iCCP", 0},
                                  {"cICP", 4}, {"pHYs", 9},  {"eXIf", 0}};
static const unsigned char olat__signature[8] = {137, 80, 78, 71, 13, 10, 26, 10};

/* The seven passes of an interlaced image, and the only one of others: first pixel and step in x and y. */
static const unsigned char olat__passes[8][4] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                                 {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}, {0, 0, 1, 1}};

typedef struct olat__png {
    int width, height, depth, color, channels, first_pass, end_pass, palette_size, has_key;
    int is_mask, labels; /* a mask's palette of colours is one of labels: white but for its first */
    struct {
        const unsigned char *data; /* in the file; NULL: there is none */
        size_t size;
    } told[OLAT__TELLING];
    int damaged[OLAT__TELLING];
    ssdgs_pixels format;
    unsigned key[3]; /* the transparent colour */
    unsigned char palette[256][4];
    unsigned char *packed, *raw, *out;
    size_t packed_size, at; /* at: where a problem is */
    const char *unit;       /* what `at` counts */
} olat__png;

static uint32_t olat__crc32(const unsigned char *data, size_t size) {
    uint32_t table[16], crc = 0xFFFFFFFFu; /* half a byte at a time: a table this small is made on the spot */
    for (uint32_t i = 0; i < 16; i++) {
        uint32_t k;
        for (table[i] = i, k = 0; k < 4; k++) table[i] = (table[i] & 1 ? 0xEDB88320u : 0) ^ table[i] >> 1;
    }
    for (; size > 0; size--) {
        crc ^= *data++;
        crc = table[crc & 15] ^ crc >> 4;
        crc = table[crc & 15] ^ crc >> 4;
    }
    return crc ^ 0xFFFFFFFFu;
}

static const char *olat__png_header(olat__png *png, const unsigned char *data, size_t length) {
    static const unsigned char depths[7] = {31, 0, 24, 15, 24, 0, 24}; /* bit k: depth 2^k is allowed */
    int k = 0;
    if (length != 13) return "IHDR is not 13 bytes long";
    const uint32_t width = olat__be32(data);
    const uint32_t height = olat__be32(data + 4);
    while (k < 5 && data[8] != 1 << k) k++;
    const char *problem = olat__size_problem(width, height);
    if (problem) return problem;
    if (data[9] > 6 || !(depths[data[9]] >> k & 1)) return "unknown combination of colour type and bit depth";
    if (data[10] != 0 || data[11] != 0 || data[12] > 1)
        return "unknown compression, filter or interlace method";
    png->width = (int)width;
    png->height = (int)height;
    png->depth = data[8];
    png->color = data[9];
    png->channels = png->color == 3 ? 1 : 1 + (png->color & 2) + (png->color >> 2);
    png->first_pass = data[12] ? 0 : 7;
    png->end_pass = data[12] ? 7 : 8;
    png->format = png->depth == 16 ? SSDGS_PIXELS_RGBA16 : SSDGS_PIXELS_RGBA8;
    return NULL;
}

static const char *olat__png_palette(olat__png *png, const unsigned char *data, size_t length) {
    if (length % 3 != 0 || length < 3 || length > 768) return "PLTE has a bad length";
    if (png->color == 3 && length / 3 > (size_t)1 << png->depth)
        return "PLTE is longer than the bit depth allows";
    png->palette_size = (int)(length / 3);
    for (size_t i = 0; i < 4 * (length / 3); i++)
        png->palette[i / 4][i % 4] = i % 4 < 3 ? data[i / 4 * 3 + i % 4] : 255;
    for (size_t i = 0; i < length && png->is_mask && png->color == 3 && !data[0] && !data[1] && !data[2]; i++)
        png->labels |= abs(data[i] - data[i - i % 3]) > 32; /* colours, not greys that were rounded */
    for (size_t i = 1; i < length / 3 && png->labels; i++) memset(png->palette[i], 255, 3);
    return NULL;
}

static const char *olat__png_transparency(olat__png *png, const unsigned char *data, size_t length) {
    if (png->color & 4) return "tRNS in an image with alpha";
    if (png->color == 3 ? length < 1 || length > (size_t)png->palette_size
                        : length != 2 * (size_t)png->channels) {
        return "tRNS has a bad length";
    }
    png->has_key = 1;
    for (size_t i = 0; png->color == 3 && i < length; i++) png->palette[i][3] = data[i];
    for (size_t i = 0; png->color != 3 && i < length / 2; i++) { /* bits beyond the depth mean nothing */
        png->key[i] = (unsigned)(data[2 * i] << 8 | data[2 * i + 1]) & ((1u << png->depth) - 1);
    }
    return NULL;
}

/* What the file is where it is no PNG, by its first bytes. */
static const char *olat__png_foreign(const unsigned char *bytes, size_t size) {
#define OLAT__FOREIGN(kind) "this is " kind " file, not a PNG file: convert it to PNG"
    static const struct {
        size_t at, length;
        const char *bytes, *problem;
    } kinds[] = {{0, 3, "\xFF\xD8\xFF", OLAT__FOREIGN("a JPEG")},
                 {8, 4, "WEBP", OLAT__FOREIGN("a WebP")},
                 {0, 4, "GIF8", OLAT__FOREIGN("a GIF")},
                 {0, 4, "II*\0", OLAT__FOREIGN("a TIFF")},
                 {0, 4, "MM\0*", OLAT__FOREIGN("a TIFF")},
                 {0, 2, "BM", OLAT__FOREIGN("a BMP")},
                 {0, 4, "\x76\x2F\x31\x01", OLAT__FOREIGN("an OpenEXR")},
                 {4, 4, "ftyp", OLAT__FOREIGN("a HEIC or AVIF")},
                 {0, 23, "version https://git-lfs",
                  "this is a Git LFS pointer, not the image itself: run git lfs pull"}};
#undef OLAT__FOREIGN
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (size >= kinds[i].at + kinds[i].length &&
            !memcmp(bytes + kinds[i].at, kinds[i].bytes, kinds[i].length))
            return kinds[i].problem;
    return "this is not a PNG file";
}

/* Walks over the chunks: fills the header and the palette, and gathers the compressed data in png->packed. */
static const char *olat__png_chunks(olat__png *png, const unsigned char *bytes, size_t size) {
    enum { START, HEADER, DATA, AFTER } stage = START;
    if (size < 8 || memcmp(bytes, olat__signature, 8) != 0) return olat__png_foreign(bytes, size);
    for (png->at = 8;;) {
        const unsigned char *chunk = bytes + png->at, *data = chunk + 8;
        size_t left = size - png->at, length = left < 12 ? 0 : olat__be32(chunk);
        const char *problem = NULL;
        if (left < 12 || length > left - 12) return "the file ends early";
        const uint32_t type = olat__be32(chunk + 4);
        if (stage == START && type != OLAT__IHDR) return "the first chunk is not IHDR";
        int kind = 0;
        while (kind < OLAT__TELLING && memcmp(chunk + 4, olat__telling[kind].type, 4) != 0) kind++;
        const int tells =
            kind < OLAT__TELLING && !png->told[kind].data &&
            (kind == OLAT__EXIF || (stage == HEADER && (kind == OLAT__PHYS || !png->palette_size)));
        const int intact = ((chunk[4] & 32) && type != OLAT__TRNS && !tells) ||
                           olat__be32(data + length) == olat__crc32(chunk + 4, length + 4);
        if (!intact && !tells) return "the chunk's CRC is wrong";
        if (tells && intact && (!olat__telling[kind].length || length == olat__telling[kind].length))
            png->told[kind].data = data, png->told[kind].size = length;
        else if (tells) png->damaged[kind] = 1;
        if (stage == DATA && type != OLAT__IDAT) stage = AFTER;
        if (type == OLAT__IHDR) {
            problem = stage != START ? "a second IHDR" : olat__png_header(png, data, length);
            stage = HEADER;
        } else if (type == OLAT__PLTE) {
            problem = stage != HEADER || png->palette_size ? "PLTE is out of place"
                                                           : olat__png_palette(png, data, length);
        } else if (type == OLAT__TRNS) {
            problem = stage != HEADER || png->has_key ? "tRNS is out of place"
                                                      : olat__png_transparency(png, data, length);
        } else if (type == OLAT__IDAT) {
            if (stage == AFTER) return "IDAT chunks are not consecutive";
            if (png->color == 3 && !png->palette_size) return "PLTE is missing";
            memcpy(png->packed + png->packed_size, data, length);
            png->packed_size += length;
            stage = DATA;
        } else if (type == OLAT__IEND) {
            return stage < DATA ? "IDAT is missing" : length ? "IEND is not empty" : NULL;
        } else if (!(chunk[4] & 32)) return "unknown critical chunk";
        if (problem) return problem;
        png->at += 12 + length;
    }
}

/* What a filter expects a byte to be, from the row above (NULL: none) and the byte `back` to the left. */
static inline int olat__predict(int filter, const unsigned char *row, const unsigned char *above, size_t i,
                                size_t back) {
    int a = i < back ? 0 : row[i - back], b = above ? above[i] : 0,
        c = above && i >= back ? above[i - back] : 0;
    int pa = abs(b - c), pb = abs(a - c), pc = abs(a + b - 2 * c);
    switch (filter) {
    case 1: return a;
    case 2: return b;
    case 3: return (a + b) >> 1;
    case 4: return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
    default: return 0;
    }
}

/* Size of a pass: pixels and the bytes of a row without its filter byte. */
static size_t olat__png_pass(const olat__png *png, int pass, int *width, int *height) {
    const unsigned char *p = olat__passes[pass];
    *width = (png->width - p[0] + p[2] - 1) / p[2];
    *height = *width > 0 ? (png->height - p[1] + p[3] - 1) / p[3] : 0;
    return ((size_t)*width * (size_t)(png->channels * png->depth) + 7) / 8;
}

/* Writes a row of samples to every step-th pixel of the output from pixel `to` on. */
static const char *olat__png_row(const olat__png *png, const unsigned char *row, int count, size_t to,
                                 size_t step) {
    const unsigned opaque = (1u << png->depth) - 1;
    const int second = png->color & 2 ? 1 : 0, third = 2 * second;
    size_t i = 0;
    if (png->color == 6 && png->depth == 8 && step == 1) {
        memcpy(png->out + 4 * to, row, 4 * (size_t)count);
        return NULL;
    }
    for (; count > 0; count--, to += step) {
        unsigned s[4] = {0, 0, 0, 0};
        for (int c = 0; c < png->channels; c++, i++) {
            size_t bit = i * (size_t)png->depth;
            if (png->depth == 8) s[c] = row[i];
            else if (png->depth == 16) s[c] = (unsigned)(row[2 * i] << 8 | row[2 * i + 1]);
            else s[c] = (unsigned)row[bit >> 3] >> (8 - png->depth - (int)(bit & 7)) & opaque;
        }
        if (png->color == 3) {
            if (s[0] >= (unsigned)png->palette_size) return "an index beyond the palette";
            memcpy(png->out + 4 * to, png->palette[s[0]], 4);
            continue;
        }
        unsigned rgba[4];
        rgba[0] = s[0];
        rgba[1] = s[second];
        rgba[2] = s[third];
        rgba[3] = png->color & 4 ? s[png->channels - 1] : opaque;
        if (png->has_key && s[0] == png->key[0] && s[second] == png->key[second] &&
            s[third] == png->key[third])
            rgba[3] = 0;
        for (int c = 0; c < 4; c++) {
            uint16_t wide = (uint16_t)rgba[c];
            if (png->depth == 16) memcpy(png->out + 8 * to + 2 * c, &wide, 2);
            else png->out[4 * to + (size_t)c] = (unsigned char)(rgba[c] * (255 / opaque));
        }
    }
    return NULL;
}

#define OLAT__UNFILTER(filter) \
    case filter: \
        for (size_t i = 0; i < bytes; i++) \
            row[i] = (unsigned char)((row[i] + olat__predict(filter, row, above, i, back)) & 255); \
        break;
/* Undoes the filters of png->raw in place and spreads its rows over png->out. */
static const char *olat__png_unfilter(olat__png *png) {
    const size_t back = (size_t)(png->channels * png->depth + 7) / 8;
    unsigned char *row = png->raw;
    const char *problem = NULL;
    for (int pass = png->first_pass; pass < png->end_pass; pass++) {
        const unsigned char *p = olat__passes[pass], *above = NULL;
        int width, height;
        size_t bytes = olat__png_pass(png, pass, &width, &height);
        for (int y = 0; y < height && !problem; y++, above = row, row += bytes) {
            int filter = *row++;
            png->at = (size_t)(row - png->raw) - 1;
            if (filter > 4) return "unknown filter";
            switch (filter) { /* each a loop of its own, which takes half of the time */
                OLAT__UNFILTER(1)
                OLAT__UNFILTER(2)
                OLAT__UNFILTER(3)
                OLAT__UNFILTER(4)
            default: break;
            }
            problem =
                olat__png_row(png, row, width, (size_t)(p[1] + y * p[3]) * (size_t)png->width + p[0], p[2]);
        }
    }
    return problem;
}

/* Leaves the pixels in png->out; returns NULL or what is wrong. */
static const char *olat__png_read(olat__png *png, const unsigned char *bytes, size_t size) {
    uint64_t raw_size = 0;
    png->unit = "byte";
    if ((png->packed = (unsigned char *)malloc(size + 1)) == NULL) return "out of memory";
    const char *problem;
    if ((problem = olat__png_chunks(png, bytes, size)) != NULL) return problem;
    for (int pass = png->first_pass; pass < png->end_pass; pass++) {
        int width, height;
        size_t row = olat__png_pass(png, pass, &width, &height);
        raw_size += (uint64_t)height * (row + 1);
    }
    const uint64_t out_size = (uint64_t)png->width * (uint64_t)png->height * (png->depth == 16 ? 8 : 4);
    png->unit = "byte of the compressed data";
    png->at = png->packed_size;
    if (raw_size / 1032 > png->packed_size) return "less data than are needed"; /* deflate packs no better */
    if (raw_size > SIZE_MAX || out_size > SIZE_MAX) return "out of memory";
    png->raw = (unsigned char *)malloc((size_t)raw_size);
    png->out = (unsigned char *)malloc((size_t)out_size);
    if (!png->raw || !png->out) return "out of memory";
    olat__inflater z;
    memset(&z, 0, sizeof z);
    z.in = png->packed;
    z.size = png->packed_size;
    z.out = png->raw;
    z.capacity = (size_t)raw_size;
    problem = olat__inflate(&z);
    png->at = z.at;
    if (problem) return problem;
    png->unit = "byte of the unpacked data";
    return olat__png_unfilter(png);
}

/* Decodes a PNG; png is empty but for is_mask, and is so again after a failure. */
static int olat__png_decode(const char *name, const unsigned char *bytes, size_t size, olat__png *png,
                            char *error) {
    const char *problem = olat__png_read(png, bytes, size);
    free(png->packed);
    free(png->raw);
    if (!problem) return 0;
    olat__fail(error, "%s: %s %lu: %s", olat__tail(name), png->unit, (unsigned long)png->at, problem);
    free(png->out);
    memset(png, 0, sizeof *png);
    return 1;
}

static int olat__png_stored(const char *name, const unsigned char *bytes, size_t size, int *width,
                            int *height, ssdgs_pixels *format, void **pixels, char *error) {
    olat__png png;
    memset(&png, 0, sizeof png);
    const int failed = olat__png_decode(name, bytes, size, &png, error);
    *width = png.width;
    *height = png.height;
    *format = png.format;
    *pixels = png.out;
    return failed;
}

/* Decodes a PNG of any kind into (h,w,4) straight RGBA as stored, 16 bits if the file has 16. free() the
   pixels. */
OLAT__API int olat_decode_png(const unsigned char *bytes, size_t size, int *width, int *height,
                              ssdgs_pixels *format, void **pixels, char error[512]) {
    return olat__png_stored("PNG", bytes, size, width, height, format, pixels, error);
}

/* The same from a file. */
OLAT__API int olat_read_png(const char *path, int *width, int *height, ssdgs_pixels *format, void **pixels,
                            char error[512]) {
    unsigned char *bytes = NULL;
    size_t size = 0;
    *pixels = NULL;
    const int failed = olat__read_file(path, &bytes, &size, error) ||
                       olat__png_stored(path, bytes, size, width, height, format, pixels, error);
    free(bytes);
    return failed;
}

/* Filters a row into out: the filter byte, then the differences. Takes the filter whose differences are
   smallest. */
static void olat__filter_row(const unsigned char *row, const unsigned char *above, size_t bytes, size_t back,
                             unsigned char *out) {
    uint64_t best = UINT64_MAX;
    int chosen = 0;
    for (int turn = 0; turn < 6; turn++) { /* five to measure, one to write */
        uint64_t sum = 0;
        out[0] = (unsigned char)(turn < 5 ? turn : chosen);
        for (size_t i = 0; i < bytes; i++) {
            out[1 + i] = (unsigned char)((row[i] - olat__predict(out[0], row, above, i, back)) & 255);
            sum += out[1 + i] < 128 ? out[1 + i] : 256u - out[1 + i];
        }
        if (sum < best) best = sum, chosen = turn;
    }
}

/* Completes a chunk whose length bytes of data are in place already at p + 8; returns where the next one
   starts. */
static unsigned char *olat__put_chunk(unsigned char *p, uint32_t type, size_t length) {
    olat__put_be32(p, (uint32_t)length);
    olat__put_be32(p + 4, type);
    olat__put_be32(p + 8 + length, olat__crc32(p + 4, length + 4));
    return p + 12 + length;
}

/* Writes (count,h,w,channels) bytes as PNG: 1 grey, 3 RGB, 4 RGBA. Of several pictures it makes an animated
   PNG, as PNG's third edition has it: each is shown for `delay` <= 65535 milliseconds, again and again;
   programs that know nothing of that show the first. The file appears whole or not at all. */
OLAT__API int olat_write_pngs(const char *path, int width, int height, int channels,
                              const unsigned char *pixels, int count, int delay, char error[512]) {
    const size_t row = (size_t)width * (size_t)channels, raw_size = (size_t)height * (row + 1);
    if (width < 1 || height < 1 || width > OLAT__MAX_SIDE || height > OLAT__MAX_SIDE || count < 1 ||
        height > OLAT__MAX_PIXELS / width / count || delay < 0 || delay > 65535 ||
        (channels != 1 && channels != 3 && channels != 4)) {
        return olat__fail(error, "%s: cannot write %d x %d pixels of %d channels, %d pictures",
                          olat__tail(path), width, height, channels, count);
    }
    unsigned char *raw = (unsigned char *)malloc(raw_size);
    unsigned char *file = /* nine bits a byte, and the chunks */
        (unsigned char *)malloc((size_t)count * (raw_size + raw_size / 8 + 128) + 128);
    uint32_t *table = (uint32_t *)malloc(65536 * sizeof *table), sequence = 0;
    int failed;
    if (raw && file && table) {
        memcpy(file, olat__signature, 8);
        unsigned char *p = file + 8;
        memset(p + 16, 0, 5);
        olat__put_be32(p + 8, (uint32_t)width);
        olat__put_be32(p + 12, (uint32_t)height);
        p[16] = 8;
        p[17] = (unsigned char)(channels == 1 ? 0 : channels == 3 ? 2 : 6);
        p = olat__put_chunk(p, OLAT__IHDR, 13);
        if (count > 1) {
            olat__put_be32(p + 8, (uint32_t)count);
            olat__put_be32(p + 12, 0); /* for ever */
            p = olat__put_chunk(p, OLAT__ACTL, 8);
        }
        for (int i = 0; i < count; i++) {
            for (int y = 0; y < height; y++, pixels += row)
                olat__filter_row(pixels, y ? pixels - row : NULL, row, (size_t)channels,
                                 raw + (size_t)y * (row + 1));
            if (count > 1) { /* all of the picture, which replaces the one before */
                memset(p + 8, 0, 26);
                olat__put_be32(p + 8, sequence++);
                olat__put_be32(p + 12, (uint32_t)width);
                olat__put_be32(p + 16, (uint32_t)height);
                olat__put_be32(p + 28, (uint32_t)delay << 16 | 1000);
                p = olat__put_chunk(p, OLAT__FCTL, 26);
            }
            unsigned char *packed = p + 8;
            if (i) olat__put_be32(packed, sequence++), packed += 4;
            memset(table, 0, 65536 * sizeof *table);
            packed += olat__deflate(raw, raw_size, packed, table);
            p = olat__put_chunk(p, i ? OLAT__FDAT : OLAT__IDAT, (size_t)(packed - p - 8));
        }
        p = olat__put_chunk(p, OLAT__IEND, 0);
        failed = olat__write_file(path, file, (size_t)(p - file), error);
    } else failed = olat__fail(error, "%s: out of memory", olat__tail(path));
    free(raw);
    free(file);
    free(table);
    return failed;
}

/* The same of one picture. */
OLAT__API int olat_write_png(const char *path, int width, int height, int channels,
                             const unsigned char *pixels, char error[512]) {
    return olat_write_pngs(path, width, height, channels, pixels, 1, 0, error);
}

/* ==== OpenEXR: scan lines or tiles; plain, RLE, ZIPS, ZIP, PIZ, PXR24; half and float ==== */

/* What is written into a file is linear light times alpha; what comes out is straight alpha. */
enum {
    OLAT__EXR_MAGIC = 20000630,
    OLAT__EXR_CHANNELS = 256,
    OLAT__EXR_PARTS = 1024,
    OLAT__EXR_HALF = 1,
    OLAT__EXR_FLOAT = 2,
    OLAT__EXR_NONE = 64 /* the rank of what has no colours */
};
typedef struct olat__exr_text {
    const char *text;
    size_t size;
} olat__exr_text;
typedef struct olat__exr {
    const unsigned char *bytes;
    size_t size, at; /* what is read next */
    const char *problem;
    char text[256]; /* the problem's, where it has names */
    int several;    /* parts: each block names its own */
    /* of a part, the one at hand or chosen */
    int part, found;                    /* found: bits of the attributes that are there */
    olat__exr_text name, type, views;   /* views: numbers of 4 bytes and so many letters, the default first */
    int data[4], display[4];            /* windows: left, top, right, bottom, all inside */
    int packing, tiled, lines, tile[2]; /* lines: of a block */
    int sparse, deep;                   /* what cannot be read: channels of fewer samples, lists of depths */
    uint32_t blocks;                    /* where there are several parts */
    int has_xy;                         /* chromaticities */
    double xy[8];
    float aspect;
    int turned_by; /* Orientation */
    struct {
        const char *name;
        size_t layer; /* letters before its own name */
        int type, to; /* to: 0 .. 3 of RGBA, 4 grey, -1 nowhere */
    } channels[OLAT__EXR_CHANNELS];
    int channel_count, wide; /* wide: a colour is float */
    size_t pixel_size;
    int chosen, letters, rank; /* a channel of the layer; those it has, as bits; the lower the better */
    int colours, greys;        /* layers that could have been chosen, of all parts */
    /* of the picture */
    unsigned char *raw, *turned; /* a block unpacked, and before its bytes are sorted */
    struct olat__piz *piz;       /* what unpacking PIZ needs */
    ssdgs_real *color, *alpha;   /* of the display window */
    unsigned long broken;        /* values that are not finite */
} olat__exr;

static int olat__exr_bad(olat__exr *e, const char *problem) {
    if (!e->problem) e->problem = problem;
    return 0;
}

/* The next bytes; NULL after a failure. */
static const unsigned char *olat__exr_take(olat__exr *e, size_t count) {
    const unsigned char *p = e->bytes + e->at;
    if (e->problem || e->size - e->at < count) {
        olat__exr_bad(e, "the file ends early");
        return NULL;
    }
    e->at += count;
    return p;
}

static uint32_t olat__le32(const unsigned char *p) {
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static int32_t olat__exr_int(olat__exr *e) {
    const unsigned char *p = olat__exr_take(e, 4);
    const uint32_t bits = p ? olat__le32(p) : 0;
    int32_t value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* A name that ends with a zero byte before `end`; "" after a failure. */
static const char *olat__exr_text_at(olat__exr *e, size_t end) {
    const char *text = (const char *)e->bytes + e->at;
    const size_t left = e->at < end ? end - e->at : 0;
    if (e->problem || !left || !memchr(text, 0, left < 256 ? left : 256)) {
        olat__exr_bad(e, "a name does not end");
        return "";
    }
    e->at += strlen(text) + 1;
    return text;
}

static int olat__exr_is(olat__exr_text text, const char *word) {
    return text.size == strlen(word) && !memcmp(text.text, word, text.size);
}

static void olat__exr_channels(olat__exr *e, size_t end) {
    const char *name;
    while (*(name = olat__exr_text_at(e, end))) {
        const int type = olat__exr_int(e);
        olat__exr_take(e, 4);
        const int across = olat__exr_int(e), down = olat__exr_int(e);
        if (e->problem) return;
        if (type < 0 || type > 2) olat__exr_bad(e, "a channel of unknown type");
        if (e->channel_count == OLAT__EXR_CHANNELS) olat__exr_bad(e, "more than 256 channels");
        if (e->problem) return;
        const char *dot = strrchr(name, '.');
        e->sparse |= across != 1 || down != 1;
        e->channels[e->channel_count].name = name;
        e->channels[e->channel_count].layer = dot ? (size_t)(dot + 1 - name) : 0;
        e->channels[e->channel_count++].type = type;
        e->pixel_size += type == OLAT__EXR_HALF ? 2 : 4;
    }
}

static void olat__exr_window(olat__exr *e, int *window) {
    for (int i = 0; i < 4; i++) {
        window[i] = olat__exr_int(e);
        if (window[i] < -(1 << 29) || window[i] > 1 << 29) olat__exr_bad(e, "a window is out of range");
    }
    for (int i = 0; i < 2; i++)
        if (!e->problem && (window[2 + i] < window[i] || window[2 + i] - window[i] >= OLAT__MAX_SIDE))
            olat__exr_bad(e, "a window's side is not within 1 .. 32768");
}

static void olat__exr_packing(olat__exr *e) {
    static const int lines[6] = {1, 1, 1, 16, 32, 16};
    const unsigned char *p = olat__exr_take(e, 1);
    e->packing = p ? *p : 0;
    e->lines = e->packing < 6 ? lines[e->packing] : 1;
}

/* Why a picture cannot be unpacked; NULL if it can. */
static const char *olat__exr_packed(int packing) {
#define OLAT__REPACK(kind) \
    kind " compression cannot be read: repack, for instance with: oiiotool in.exr --compression zip -o " \
         "out.exr"
    static const char *const others[] = {OLAT__REPACK("B44"), OLAT__REPACK("B44A"), OLAT__REPACK("DWAA"),
                                         OLAT__REPACK("DWAB"), OLAT__REPACK("unknown")};
#undef OLAT__REPACK
    return packing < 6 ? NULL : others[packing > 10 ? 4 : packing - 6];
}

static void olat__exr_tiles(olat__exr *e) {
    const int w = olat__exr_int(e), h = olat__exr_int(e);
    if (!e->problem && (w < 1 || h < 1 || w > OLAT__MAX_SIDE || h > OLAT__MAX_SIDE))
        olat__exr_bad(e, "a tile's side is not within 1 .. 32768");
    e->tile[0] = w;
    e->tile[1] = h;
    olat__exr_take(e, 1); /* levels: the first is the whole image */
}

/* 0 for what is not finite. */
static float olat__le_float(const unsigned char *p) {
    const uint32_t bits = olat__le32(p);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (bits & 0x7F800000) == 0x7F800000 ? 0 : value;
}

/* Reads what a part tells of itself. Attributes that only add something count where they are what their names
   tell. */
static void olat__exr_header(olat__exr *e) {
    static const struct {
        const char *name, *type;
        uint32_t size; /* 0: any */
    } wanted[] = {{"channels", "chlist", 0},
                  {"compression", "compression", 1},
                  {"dataWindow", "box2i", 16},
                  {"displayWindow", "box2i", 16},
                  {"tiles", "tiledesc", 9},
                  {"chunkCount", "int", 4},
                  {"type", "string", 0},
                  {"name", "string", 0},
                  {"multiView", "stringvector", 0},
                  {"chromaticities", "chromaticities", 32},
                  {"pixelAspectRatio", "float", 4},
                  {"Orientation", "int", 4}};
    enum { CHANNELS, PACKING, DATA, DISPLAY, TILES, BLOCKS, TYPE, NAME, VIEWS, XY, ASPECT, TURNED, KINDS };
    const char *name;
    while (*(name = olat__exr_text_at(e, e->size))) {
        const char *type = olat__exr_text_at(e, e->size);
        const uint32_t length = (uint32_t)olat__exr_int(e);
        if (!e->problem && length > e->size - e->at) olat__exr_bad(e, "the file ends early");
        if (e->problem) return;
        const size_t end = e->at + length;
        const unsigned char *p = e->bytes + e->at;
        const olat__exr_text text = {(const char *)p, length};
        for (int i = 0; i < KINDS; i++) {
            if (strcmp(name, wanted[i].name) != 0) continue;
            const int matches =
                !strcmp(type, wanted[i].type) && (!wanted[i].size || wanted[i].size == length);
            if (!matches && i > TILES) continue;
            if (!matches) olat__exr_bad(e, "an attribute of another type than its name tells");
            if (e->found >> i & 1) olat__exr_bad(e, "an attribute twice");
            e->found |= 1 << i;
            if (i == CHANNELS) olat__exr_channels(e, end);
            if (i == PACKING) olat__exr_packing(e);
            if (i == DATA) olat__exr_window(e, e->data);
            if (i == DISPLAY) olat__exr_window(e, e->display);
            if (i == TILES) olat__exr_tiles(e);
            if (i == BLOCKS) e->blocks = olat__le32(p);
            if (i == TYPE) e->type = text;
            if (i == NAME) e->name = text;
            if (i == VIEWS) e->views = text;
            e->has_xy |= i == XY;
            for (int k = 0; i == XY && k < 8; k++) e->xy[k] = (double)olat__le_float(p + 4 * k);
            if (i == ASPECT) e->aspect = olat__le_float(p);
            if (i == TURNED) e->turned_by = olat__exr_int(e);
        }
        if (e->problem) return;
        e->at = end;
    }
    if (e->problem) return;
    if (e->several) {
        if (!(e->found >> BLOCKS & 1)) olat__exr_bad(e, "a part does not tell its chunkCount");
        e->tiled = olat__exr_is(e->type, "tiledimage");
        e->deep = !e->tiled && !olat__exr_is(e->type, "scanlineimage");
    } else e->name.size = 0;
    if ((e->found & 15) != 15 || (e->tiled && !(e->found >> TILES & 1)))
        olat__exr_bad(e, "channels, compression, dataWindow, displayWindow or tiles are missing");
}

static int olat__exr_same_layer(const olat__exr *e, int i, int k) {
    const size_t length = e->channels[i].layer;
    return e->channels[k].layer == length && !memcmp(e->channels[i].name, e->channels[k].name, length);
}

/* What a channel is by its own name: 0 .. 3 of RGBA, 4 Y, 5 X, -1 none of them. */
static int olat__exr_letter(const olat__exr *e, int i) {
    static const char letters[] = "RGBAYX";
    const char *own = e->channels[i].name + e->channels[i].layer;
    const char *at = own[0] && !own[1] ? strchr(letters, own[0]) : NULL;
    return at ? (int)(at - letters) : -1;
}

/* Takes the last part off a name of parts between dots. */
static olat__exr_text olat__exr_last(olat__exr_text *name) {
    olat__exr_text last = *name;
    while (name->size && name->text[name->size - 1] != '.') name->size--;
    last.text += name->size;
    last.size -= name->size;
    name->size -= name->size > 0;
    return last;
}

/* The place of a name among the part's views, -1 if it is none. */
static int olat__exr_view(const olat__exr *e, olat__exr_text name) {
    olat__exr_text left = e->views;
    for (int i = 0; left.size >= 4; i++) {
        const size_t size = olat__le32((const unsigned char *)left.text);
        left.text += 4;
        left.size -= 4;
        if (size > left.size) break;
        if (size && size == name.size && !memcmp(left.text, name.text, size)) return i;
        left.text += size;
        left.size -= size;
    }
    return -1;
}

/* How well a layer suits as the picture, by its name, that of its part where it has none, and its letters:
   Combined as Blender has it, the one without a name, what others call it, with alpha, without; then those of
   other views than the default; then grey ones; then whole numbers. X Y Z is a place or a direction. */
static int olat__exr_rank(const olat__exr *e, int channel, int letters, int whole) {
    const int colours = (letters & 7) == 7;
    olat__exr_text name = {e->channels[channel].name, e->channels[channel].layer};
    if (!colours && (letters & 0x30) != 0x10) return OLAT__EXR_NONE;
    if (!name.size) name = e->name;
    else name.size--;
    olat__exr_text last = olat__exr_last(&name);
    const int view = olat__exr_view(e, last);
    if (view >= 0) last = olat__exr_last(&name);
    const int rank = olat__exr_is(last, "Combined") ? 0
                     : !last.size                   ? 1
                     : (last.size == 4 && olat__same_letters(last.text, "rgba", 4)) ||
                             (last.size == 6 && olat__same_letters(last.text, "beauty", 6))
                         ? 2
                     : letters & 8 ? 3
                                   : 4;
    return rank + 8 * (view > 0) + 16 * !colours + 32 * ((whole & (colours ? 15 : 24)) != 0);
}

/* Chooses the part's layer that suits best, the first one of equals; `most` becomes the letters of the one
   that has most of R, G, B so far. */
static void olat__exr_choose(olat__exr *e, int *most) {
    e->rank = OLAT__EXR_NONE;
    for (int i = 0; i < e->channel_count && !e->deep; i++) {
        int letters = 0, whole = 0;
        const int own = olat__exr_letter(e, i);
        if (own < 0) continue;
        for (int k = 0; k < e->channel_count; k++) {
            const int letter = olat__exr_same_layer(e, i, k) ? olat__exr_letter(e, k) : -1;
            if (letter >= 0) letters |= 1 << letter;
            if (letter >= 0 && !e->channels[k].type) whole |= 1 << letter;
        }
        const int rgb = letters & 7, of[8] = {0, 1, 1, 2, 1, 2, 2, 3};
        if (of[rgb] > of[*most & 7]) *most = letters;
        const int rank = own == (rgb == 7 ? 0 : 4) ? olat__exr_rank(e, i, letters, whole) : OLAT__EXR_NONE;
        if (rank == OLAT__EXR_NONE) continue;
        if (rgb == 7) e->colours++;
        else e->greys++;
        if (rank >= e->rank) continue;
        e->rank = rank;
        e->chosen = i;
        e->letters = rgb == 7 ? letters & 15 : letters & 24;
    }
    for (int i = 0; i < e->channel_count; i++) {
        const int letter = olat__exr_letter(e, i);
        const int used = e->rank < OLAT__EXR_NONE && letter >= 0 && olat__exr_same_layer(e, e->chosen, i) &&
                         (e->letters >> letter & 1);
        e->channels[i].to = used ? letter : -1;
        e->wide |= used && e->channels[i].type == OLAT__EXR_FLOAT;
    }
}

/* Reads the headers of all parts and chooses one as layers are chosen. What is read next are its blocks'
   places. */
static void olat__exr_parts(olat__exr *e) {
    olat__exr blank, best;
    char channels[160] = "";
    int most = 0, deep = 0, colours = 0, greys = 0;
    uint64_t before = 0, blocks = 0; /* places before those of the best part, of the parts so far */
    olat__exr_take(e, 4);
    const uint32_t version = (uint32_t)olat__exr_int(e);
    if (!e->problem && (version & 255) != 2) olat__exr_bad(e, "not version 2 of the format");
    e->several = (version & 0x1000) != 0;
    e->tiled = !e->several && (version & 0x200);
    e->deep = !e->several && (version & 0x800);
    e->aspect = 1;
    e->name.text = e->type.text = e->views.text = "";
    if (e->problem) return;
    blank = *e;
    best = *e;
    for (int part = 0; !part || (e->several && e->at < e->size && e->bytes[e->at]); part++) {
        blank.at = e->at;
        *e = blank;
        e->part = part;
        olat__exr_header(e);
        if (part == OLAT__EXR_PARTS) olat__exr_bad(e, "more than 1024 parts");
        if (e->problem) return;
        olat__exr_choose(e, &most);
        deep |= e->deep;
        colours += e->colours;
        greys += e->greys;
        for (int i = 0; i < e->channel_count; i++)
            olat__append(channels, sizeof channels, "%s%s", *channels ? ", " : "", e->channels[i].name);
        if (!part || e->rank < best.rank) {
            best = *e;
            before = blocks;
        }
        blocks += e->blocks;
    }
    if (e->several) olat__exr_take(e, 1); /* what ends the headers */
    if (!e->problem && best.rank == OLAT__EXR_NONE && deep)
        olat__exr_bad(e, "deep pixels cannot be read: flatten them, for instance with: oiiotool in.exr "
                         "--flatten -o out.exr");
    if (!e->problem && best.rank == OLAT__EXR_NONE) {
        char missing[16] = "";
        for (int c = 0; c < 3; c++)
            if (!(most >> c & 1))
                olat__append(missing, sizeof missing, "%s%c", *missing ? ", " : "", "RGB"[c]);
        snprintf(e->text, sizeof e->text,
                 "channels are missing: %s; it has %s%s: light must be named R, G, B, or Y", missing,
                 *channels ? channels : "none", strlen(channels) + 1 == sizeof channels ? " ..." : "");
        e->problem = e->text;
    }
    if (e->problem) return;
    best.at = e->at;
    *e = best;
    e->colours = colours;
    e->greys = greys;
    if (e->rank >= 32) olat__exr_bad(e, "a channel of colour holds whole numbers");
    if (e->sparse) olat__exr_bad(e, "channels of fewer samples cannot be read");
    if (olat__exr_packed(e->packing)) olat__exr_bad(e, olat__exr_packed(e->packing));
    if (before > e->size / 8) olat__exr_bad(e, "the file ends early");
    else olat__exr_take(e, 8 * (size_t)before);
}

/* Expands runs: a count below 0 is of bytes that follow, else one more than that of copies of the next. */
static void olat__exr_runs(olat__exr *e, const unsigned char *in, size_t size, size_t capacity) {
    size_t i = 0, length = 0;
    while (i < size && !e->problem) {
        const int literal = in[i] > 127;
        const size_t count = literal ? 256u - in[i] : in[i] + 1u, bytes = literal ? count : 1;
        i++;
        if (bytes > size - i) olat__exr_bad(e, "a run ends early");
        else if (count > capacity - length) olat__exr_bad(e, "more data than are needed");
        else if (literal) memcpy(e->turned + length, in + i, count);
        else memset(e->turned + length, in[i], count);
        i += bytes;
        length += count;
    }
    if (!e->problem && length < capacity) olat__exr_bad(e, "less data than are needed");
}

/* Bits of PIZ, the highest of a byte first. */
typedef struct olat__bits {
    const unsigned char *in;
    size_t size, at;
    uint64_t bits; /* read but not consumed, highest first, zeros below */
    int count;
} olat__bits;

static void olat__bits_fill(olat__bits *b) {
    for (; b->count <= 56 && b->at < b->size; b->count += 8)
        b->bits |= (uint64_t)b->in[b->at++] << (56 - b->count);
}

/* The next 1 .. 57 bits. */
static uint64_t olat__bits_take(olat__exr *e, olat__bits *b, int n) {
    olat__bits_fill(b);
    const uint64_t value = b->bits >> (64 - n);
    if (b->count < n) return (uint64_t)olat__exr_bad(e, "the data end early");
    b->bits <<= n;
    b->count -= n;
    return value;
}

/* PIZ packs 16-bit words: a word becomes its place among those that occur, the places of a channel are
   halved to means and differences in both directions until few are left, and what results is coded after
   Huffman. */
enum { OLAT__PIZ_WORDS = 1 << 16, OLAT__PIZ_FAST = 12, OLAT__PIZ_LONGEST = 57 };
typedef struct olat__piz {
    uint16_t values[OLAT__PIZ_WORDS]; /* the words that occur */
    unsigned char lengths[OLAT__PIZ_WORDS + 1];
    uint32_t symbols[OLAT__PIZ_WORDS + 1], fast[1 << OLAT__PIZ_FAST]; /* fast: symbol << 6 | length of the
                                           code in the high bits; 0: a longer one */
    uint32_t begin[OLAT__PIZ_LONGEST + 1];                            /* where each length's symbols begin */
    uint64_t first[OLAT__PIZ_LONGEST + 1]; /* the first code of each length; longer codes are smaller */
} olat__piz;

/* Reads the lengths of the codes of the symbols from `low` to `high` and builds the code, which must be
   complete: every sequence of bits then stands for symbols. */
static void olat__piz_codes(olat__exr *e, olat__bits *b, uint32_t low, uint32_t high) {
    olat__piz *piz = e->piz;
    uint32_t count[OLAT__PIZ_LONGEST + 1] = {0}, place = 0;
    uint64_t code = 0;
    int complete = 1;
    for (uint32_t symbol = low; symbol <= high;) {
        const uint32_t word = (uint32_t)olat__bits_take(e, b, 6), length = word < 59 ? word : 0;
        uint32_t run = word < 59 ? 1 : word < 63 ? word - 57 : 6 + (uint32_t)olat__bits_take(e, b, 8);
        if (run > high + 1 - symbol) olat__exr_bad(e, "too many code lengths");
        if (length > OLAT__PIZ_LONGEST) olat__exr_bad(e, "a code is longer than 57 bits");
        if (e->problem) return;
        count[length] += run;
        for (; run > 0; run--) piz->lengths[symbol++] = (unsigned char)length;
    }
    for (int i = OLAT__PIZ_LONGEST; i > 0; i--) {
        piz->first[i] = code;
        code += count[i];
        complete &= !(code & 1);
        code >>= 1;
    }
    if (!complete || code != 1) olat__exr_bad(e, "bad codes");
    if (e->problem) return;
    for (int i = 1; i <= OLAT__PIZ_LONGEST; place += count[i++]) piz->begin[i] = place;
    memset(piz->fast, 0, sizeof piz->fast);
    memset(count, 0, sizeof count);
    for (uint32_t symbol = low; symbol <= high; symbol++) {
        const int length = piz->lengths[symbol], rest = OLAT__PIZ_FAST - length;
        if (!length) continue;
        const uint32_t rank = count[length]++;
        piz->symbols[piz->begin[length] + rank] = symbol;
        for (uint32_t i = 0; rest >= 0 && i < 1u << rest; i++)
            piz->fast[((uint32_t)piz->first[length] + rank) << rest | i] = symbol << 6 | (uint32_t)length;
    }
}

static uint32_t olat__piz_symbol(olat__exr *e, olat__bits *b) {
    const olat__piz *piz = e->piz;
    olat__bits_fill(b);
    const uint32_t entry = piz->fast[b->bits >> (64 - OLAT__PIZ_FAST)];
    int length = OLAT__PIZ_FAST + 1;
    if (entry) {
        olat__bits_take(e, b, (int)(entry & 63));
        return entry >> 6;
    }
    while (b->bits >> (64 - length) < piz->first[length]) length++; /* the longest length's first is 0 */
    return piz->symbols[piz->begin[length] + (olat__bits_take(e, b, length) - piz->first[length])];
}

/* Huffman's codes become `count` words. The highest symbol repeats the last word. */
static void olat__piz_words(olat__exr *e, const unsigned char *in, size_t size, uint16_t *words,
                            size_t count) {
    olat__bits b;
    size_t length = 0;
    memset(&b, 0, sizeof b);
    if (size < 20) olat__exr_bad(e, "the data end early");
    if (e->problem) return;
    const uint32_t low = olat__le32(in), high = olat__le32(in + 4), bits = olat__le32(in + 12);
    if (low > high || high > OLAT__PIZ_WORDS) olat__exr_bad(e, "codes of unknown words");
    b.in = in + 20;
    b.size = size - 20;
    if (!e->problem) olat__piz_codes(e, &b, low, high);
    if (e->problem) return;
    const size_t begin = b.at - (size_t)b.count / 8;
    if (b.size - begin < (bits + (size_t)7) / 8) olat__exr_bad(e, "the data end early");
    else b.size = begin + (bits + (size_t)7) / 8;
    b.at = begin;
    b.bits = 0;
    b.count = 0;
    while (length < count && !e->problem) {
        const uint32_t symbol = olat__piz_symbol(e, &b);
        size_t run = symbol == high ? (size_t)olat__bits_take(e, &b, 8) : 1;
        const uint16_t word = symbol < high ? (uint16_t)symbol : length ? words[length - 1] : 0;
        if (symbol == high && !length) olat__exr_bad(e, "a repeat before the first word");
        if (run > count - length) olat__exr_bad(e, "more data than are needed");
        for (; run > 0 && !e->problem; run--) words[length++] = word;
    }
    if (8 * (uint64_t)(b.at - begin) - (uint64_t)b.count != bits)
        olat__exr_bad(e, "more data than are needed");
}

/* A mean and a difference become the two words that they were made of. */
static inline void olat__piz_pair(uint16_t *mean, uint16_t *difference, int narrow) {
    const int m = *mean, d = *difference, change = d > 32767 ? d - 65536 : d;
    const int second = narrow ? m + (change + (d & 1)) / 2 - change : m - d / 2;
    *mean = (uint16_t)(narrow ? second + change : second + d - 32768);
    *difference = (uint16_t)second;
}

/* Undoes the halving of w x h words, of which a row's lie `across` apart and a column's `down`. Words below
   2^14 are halved in another way than all of 16 bits. */
static void olat__piz_unhalve(uint16_t *words, int w, int h, size_t across, size_t down, int narrow) {
    int apart = 1;
    while (2 * apart <= (w < h ? w : h)) apart *= 2;
    for (apart /= 2; apart > 0; apart /= 2) {
        const int full_w = w - w % (2 * apart), full_h = h - h % (2 * apart);
        const size_t right = across * (size_t)apart, below = down * (size_t)apart;
        for (int y = 0; y < full_h; y += 2 * apart) {
            uint16_t *at = words + (size_t)y * down;
            for (int x = 0; x < full_w; x += 2 * apart, at += 2 * right) {
                olat__piz_pair(at, at + below, narrow);
                olat__piz_pair(at + right, at + right + below, narrow);
                olat__piz_pair(at, at + right, narrow);
                olat__piz_pair(at + below, at + below + right, narrow);
            }
            if (w & apart) olat__piz_pair(at, at + below, narrow);
        }
        uint16_t *at = words + (size_t)full_h * down;
        for (int x = 0; x < full_w && (h & apart); x += 2 * apart, at += 2 * right)
            olat__piz_pair(at, at + right, narrow);
    }
}

/* A block of PIZ: which words occur, as bits of a part of a bitmap, and the coded ones, channel after
   channel. */
static void olat__exr_piz(olat__exr *e, const unsigned char *in, size_t size, int w, int h) {
    const size_t pixels = (size_t)w * (size_t)h, words = pixels * e->pixel_size / 2;
    uint16_t *word = (uint16_t *)(void *)e->turned;
    int count = 1; /* 0 always occurs */
    e->piz->values[0] = 0;
    if (size < 8) olat__exr_bad(e, "the data end early");
    if (e->problem) return;
    const int low = in[0] | in[1] << 8, high = in[2] | in[3] << 8;
    const size_t bitmap = low > high ? 0 : (size_t)(high - low) + 1;
    if (high >= OLAT__PIZ_WORDS / 8) olat__exr_bad(e, "a bitmap of unknown words");
    else if (size - 8 < bitmap || olat__le32(in + 4 + bitmap) > size - 8 - bitmap)
        olat__exr_bad(e, "the data end early");
    if (e->problem) return;
    for (int i = 8 * low; i < 8 * (high + 1); i++)
        if (i && in[4 + i / 8 - low] >> (i & 7) & 1) e->piz->values[count++] = (uint16_t)i;
    olat__piz_words(e, in + 8 + bitmap, olat__le32(in + 4 + bitmap), word, words);
    size_t offset = 0; /* of the channel, in a row */
    for (int c = 0; c < e->channel_count && !e->problem; c++) {
        const size_t each = e->channels[c].type == OLAT__EXR_HALF ? 1 : 2, row = each * (size_t)w;
        for (size_t k = 0; k < each; k++) olat__piz_unhalve(word + k, w, h, each, row, count <= 1 << 14);
        for (size_t y = 0; y < (size_t)h; y++) {
            unsigned char *out = e->raw + y * e->pixel_size * (size_t)w + offset;
            for (size_t i = 0; i < row; i++, word++) {
                if (*word >= count) olat__exr_bad(e, "a word that does not occur");
                const uint16_t value = e->piz->values[*word < count ? *word : 0];
                out[2 * i] = (unsigned char)(value & 255);
                out[2 * i + 1] = (unsigned char)(value >> 8);
            }
        }
        offset += 2 * row;
    }
}

static void olat__exr_inflate(olat__exr *e, const unsigned char *in, size_t size, size_t capacity) {
    olat__inflater z;
    memset(&z, 0, sizeof z);
    z.in = in;
    z.size = size;
    z.out = e->turned;
    z.capacity = capacity;
    const char *problem = olat__inflate(&z);
    if (problem) olat__exr_bad(e, problem);
}

/* A block of PXR24: rows of differences of neighbours, the highest byte of all first; floats lack their
   lowest byte. */
static void olat__exr_pxr24(olat__exr *e, const unsigned char *in, size_t size, int w, int h) {
    static const int kept[3] = {4, 2, 3}; /* bytes of a sample, by type */
    const unsigned char *at = e->turned;
    unsigned char *out = e->raw;
    size_t pixel = 0;
    for (int c = 0; c < e->channel_count; c++) pixel += (size_t)kept[e->channels[c].type];
    olat__exr_inflate(e, in, size, pixel * (size_t)w * (size_t)h);
    for (int i = 0; i < h * e->channel_count && !e->problem; i++) {
        const int type = e->channels[i % e->channel_count].type, bytes = kept[type];
        uint32_t value = 0; /* from the highest bit on */
        for (int x = 0; x < w; x++, at++) {
            for (int k = 0; k < bytes; k++) value += (uint32_t)at[k * w] << (24 - 8 * k);
            for (int k = type == OLAT__EXR_HALF ? 2 : 0; k < 4; k++)
                *out++ = (unsigned char)(value >> 8 * k & 255);
        }
        at += (bytes - 1) * w;
    }
}

/* A block's bytes, of w x h pixels. */
static const unsigned char *olat__exr_unpack(olat__exr *e, const unsigned char *in, size_t size, int w,
                                             int h) {
    const size_t capacity = (size_t)w * (size_t)h * e->pixel_size;
    if (size == capacity) return in; /* what does not get smaller is stored as it is */
    if (!e->packing) olat__exr_bad(e, "a block has another size than its pixels");
    else if (e->packing == 1) olat__exr_runs(e, in, size, capacity);
    else if (e->packing == 4) olat__exr_piz(e, in, size, w, h);
    else if (e->packing == 5) olat__exr_pxr24(e, in, size, w, h);
    else olat__exr_inflate(e, in, size, capacity);
    if (e->problem || e->packing > 3) return e->raw;
    /* these are differences, first of the even bytes, then of the odd ones */
    for (size_t i = 1; i < capacity; i++)
        e->turned[i] = (unsigned char)((e->turned[i - 1] + e->turned[i] + 128) & 255);
    for (size_t i = 0; i < capacity; i++) e->raw[i] = e->turned[i / 2 + (i & 1) * (capacity / 2)];
    return e->raw;
}

static float olat__from_half(unsigned half) {
    const uint32_t bits = ((half & 0x7FFF) << 13) + (112u << 23); /* what the exponents' biases differ by */
    float value;
    memcpy(&value, &bits, sizeof value);
    if (!(half & 0x7C00)) value = (float)(half & 1023) / 16777216; /* subnormal */
    return half & 0x8000 ? -value : value;
}

/* Of a number from 0 to 65504, to the nearest. */
static uint16_t olat__to_half(float value) {
    uint32_t bits;
    if (value < 6.103515625e-5f) return (uint16_t)(value * 16777216 + 0.5f); /* subnormal */
    memcpy(&bits, &value, sizeof bits);
    return (uint16_t)((bits + 0xFFF + (bits >> 13 & 1) - (112u << 23)) >> 13);
}

/* Puts a block's pixels where they lie in the display window. */
static void olat__exr_put(olat__exr *e, const unsigned char *p, int left, int top, int width, int height) {
    const int columns = e->display[2] - e->display[0] + 1, rows = e->display[3] - e->display[1] + 1;
    for (int y = top; y < top + height; y++)
        for (int i = 0; i < e->channel_count; i++) {
            const int to = e->channels[i].to, size = e->channels[i].type == OLAT__EXR_HALF ? 2 : 4;
            for (int x = left; x < left + width; x++, p += size) {
                float value = 0;
                if (to < 0 || y < 0 || y >= rows || x < 0 || x >= columns) continue;
                const size_t at = (size_t)y * (size_t)columns + (size_t)x;
                const uint32_t bits = size == 4 ? olat__le32(p) : p[0] | (uint32_t)p[1] << 8,
                               infinite = size == 4 ? 0x7F800000 : 0x7C00;
                if ((bits & infinite) == infinite) e->broken++;
                else if (size == 4) memcpy(&value, &bits, sizeof value);
                else value = olat__from_half(bits);
                if (to == 3) e->alpha[at] = (ssdgs_real)value;
                for (size_t c = 0; to != 3 && c < 3; c++)
                    if (to == 4 || c == (size_t)to) e->color[3 * at + c] = (ssdgs_real)value;
            }
        }
}

static void olat__exr_block(olat__exr *e, int number) {
    const int width = e->data[2] - e->data[0] + 1, height = e->data[3] - e->data[1] + 1;
    const int across = e->tiled ? (width + e->tile[0] - 1) / e->tile[0] : 1;
    const int step[2] = {e->tiled ? e->tile[0] : width, e->tiled ? e->tile[1] : e->lines};
    const int x = number % across * step[0], y = number / across * step[1]; /* in the data window */
    const int w = width - x < step[0] ? width - x : step[0], h = height - y < step[1] ? height - y : step[1];
    const int wanted[4] = {number % across, number / across, 0, 0};
    if (e->several && olat__exr_int(e) != e->part)
        olat__exr_bad(e, "another part's block than its place in the table tells");
    for (int i = 0; i < (e->tiled ? 4 : 1); i++)
        if (olat__exr_int(e) != (e->tiled ? wanted[i] : y + e->data[1]))
            olat__exr_bad(e, "another block than its place in the table tells");
    const uint32_t size = (uint32_t)olat__exr_int(e);
    const unsigned char *packed = olat__exr_take(e, size);
    if (!packed) return;
    packed = olat__exr_unpack(e, packed, size, w, h);
    if (!e->problem)
        olat__exr_put(e, packed, x + e->data[0] - e->display[0], y + e->data[1] - e->display[1], w, h);
}

/* No light is negative, and none becomes too much for halves when it is divided by alpha. Colours become
   those of sRGB's primaries. */
static void olat__exr_mend(olat__exr *e, size_t pixels, olat__found *found) {
    double matrix[9], v[3], light[3];
    size_t clear = 0, lit = 0, outside = 0;
    const int space = e->has_xy && (e->letters & 7) ? olat__primaries(e->xy, matrix) : 1;
    if (!space)
        olat__exr_bad(e, "chromaticities that no colours have: take them out, for instance with: oiiotool "
                         "in.exr --eraseattrib chromaticities -o out.exr");
    for (size_t i = 0; i < pixels && space; i++) {
        ssdgs_real *color = e->color + 3 * i, *alpha = e->alpha + i;
        if (!(e->letters & 8)) *alpha = 1;
        *alpha = *alpha < 0 ? 0 : *alpha > 1 ? 1 : *alpha;
        if (*alpha < (ssdgs_real)(1.0 / 255)) {
            clear++;
            lit += color[0] > (ssdgs_real)0.01 || color[1] > (ssdgs_real)0.01 || color[2] > (ssdgs_real)0.01;
        }
        if (space == 2) {
            for (int c = 0; c < 3; c++) v[c] = (double)color[c];
            olat__transform(matrix, v, light);
            for (int c = 0; c < 3; c++) color[c] = (ssdgs_real)light[c];
            outside += light[0] < -1e-3 || light[1] < -1e-3 || light[2] < -1e-3;
        }
        for (int c = 0; c < 3; c++)
            color[c] = color[c] < 0 ? 0 : color[c] > 65504 * *alpha ? 65504 * *alpha : color[c];
    }
    if (space == 2) olat__tell(found, 0, "of other primaries (chromaticities): converted to sRGB's");
    if (outside > pixels / 1000) olat__tell(found, OLAT__NAMED, OLAT__OUTSIDE);
    if (100 * lit > pixels && 4 * lit > clear)
        olat__tell(
            found, OLAT__NAMED,
            "bright where alpha is 0, as if alpha were straight: OpenEXR's colours are light times alpha; "
            "multiply them, for instance with: oiiotool in.exr --premult -o out.exr");
}

/* What is to be told of a photograph that could be read. */
static void olat__exr_tell(const olat__exr *e, olat__found *found) {
    const int layers = e->letters & 7 ? e->colours : e->greys;
    const size_t letters = e->channels[e->chosen].layer;
    const int layer = letters > 80 ? 80
                      : letters    ? (int)letters - 1
                                   : 0,
              part = e->name.size > 60 ? 60 : (int)e->name.size;
    if (layers > 1)
        olat__tell(found, OLAT__NAMED, "made of %d layers or parts with %s: %.*s%s%.*s%s is taken", layers,
                   e->letters & 7 ? "R, G, B" : "Y", part, e->name.text, part && layer ? "." : "", layer,
                   e->channels[e->chosen].name, part || layer ? "" : "the one without a name");
    if (!(fabs((double)e->aspect - 1) < 0.01))
        olat__tell(found, OLAT__NAMED, OLAT__OBLONG("pixelAspectRatio %g"), (double)e->aspect);
    if (e->turned_by > 1 && e->turned_by < 9)
        olat__tell(found, OLAT__NAMED, OLAT__TURNED, "OpenEXR's Orientation", e->turned_by);
}

static void olat__exr_read(olat__exr *e, olat__found *found) {
    olat__exr_parts(e);
    if (e->problem) return;
    const uint64_t columns = (uint64_t)e->display[2] - (uint64_t)e->display[0] + 1,
                   rows = (uint64_t)e->display[3] - (uint64_t)e->display[1] + 1,
                   width = (uint64_t)e->data[2] - (uint64_t)e->data[0] + 1,
                   height = (uint64_t)e->data[3] - (uint64_t)e->data[1] + 1;
    const uint64_t step[2] = {e->tiled && (uint64_t)e->tile[0] < width ? (uint64_t)e->tile[0] : width,
                              e->tiled ? (uint64_t)e->tile[1] : (uint64_t)e->lines};
    const uint64_t blocks = (width + step[0] - 1) / step[0] * ((height + step[1] - 1) / step[1]);
    const uint64_t block = step[0] * (step[1] < height ? step[1] : height) * e->pixel_size;
    if (columns * rows > OLAT__MAX_PIXELS || width * height > OLAT__MAX_PIXELS) {
        olat__exr_bad(e, "more than 2^28 pixels");
        return;
    }
    if (columns * rows > 1 << 24 && columns * rows / 64 > width * height) {
        olat__exr_bad(e, "the display window is much larger than what the file holds");
        return;
    }
    if (width * height * e->pixel_size / (e->packing == 5 ? 1376 : 1032) > e->size ||
        blocks > (e->size - e->at) / 8 || (e->several && blocks > e->blocks)) {
        olat__exr_bad(e, "less data than are needed"); /* deflate packs no better */
        return;
    }
    const unsigned char *table = olat__exr_take(e, 8 * (size_t)blocks);
    e->color = (ssdgs_real *)calloc((size_t)(columns * rows), 3 * sizeof *e->color);
    e->alpha = (ssdgs_real *)calloc((size_t)(columns * rows), sizeof *e->alpha);
    if (block <= OLAT__MAX_FILE) e->raw = (unsigned char *)malloc((size_t)block);
    if (block <= OLAT__MAX_FILE) e->turned = (unsigned char *)malloc((size_t)block);
    if (e->packing == 4) e->piz = (olat__piz *)malloc(sizeof *e->piz);
    if (!e->color || !e->alpha || !e->raw || !e->turned || (e->packing == 4 && !e->piz))
        olat__exr_bad(e, "out of memory");
    for (size_t i = 0; i < blocks && !e->problem; i++) {
        const uint64_t at = olat__le32(table + 8 * i) | (uint64_t)olat__le32(table + 8 * i + 4) << 32;
        if (at < 8 || at > e->size) olat__exr_bad(e, "a block lies outside of the file: it was not finished");
        else e->at = (size_t)at;
        olat__exr_block(e, (int)i);
    }
    if (!e->problem) olat__exr_mend(e, (size_t)(columns * rows), found);
    if (!e->problem) olat__exr_tell(e, found);
}

static int olat__exr_decode(const char *name, const unsigned char *bytes, size_t size, int *width,
                            int *height, ssdgs_pixels *format, void **pixels, olat__found *found,
                            char *error) {
    olat__exr e;
    ssdgs_image image;
    memset(&e, 0, sizeof e);
    memset(&image, 0, sizeof image);
    e.bytes = bytes;
    e.size = size;
    olat__exr_read(&e, found);
    *width = e.problem ? 0 : e.display[2] - e.display[0] + 1;
    *height = e.problem ? 0 : e.display[3] - e.display[1] + 1;
    *format = e.wide ? SSDGS_PIXELS_RGBA32F : SSDGS_PIXELS_RGBA16F;
    const size_t pitch = e.problem ? 0 : (size_t)*width * (e.wide ? 16 : 8);
    *pixels = e.problem ? NULL : malloc(pitch * (size_t)*height);
    if (!e.problem && !*pixels) olat__exr_bad(&e, "out of memory");
    image.color = e.color;
    image.alpha = e.alpha;
    if (!e.problem)
        ssdgs_to_pixels(NULL, &image, *width, *height, SSDGS_TRANSFER_NONE,
                        e.wide ? SSDGS_RGBA32F : SSDGS_RGBA16F, *pixels, (ptrdiff_t)pitch);
    found->broken += e.broken;
    free(e.raw), free(e.turned), free(e.piz), free(e.color), free(e.alpha);
    return e.problem ? olat__fail(error, "%s: byte %lu: %s", olat__tail(name), (unsigned long)e.at, e.problem)
                     : 0;
}

/* ==== what the numbers of photographs stand for ==== */

/* Whether numbers are light, not stored values. */
OLAT__API int olat__is_light(ssdgs_pixels format) {
    return format == SSDGS_PIXELS_RGBA16F || format == SSDGS_PIXELS_RGBA32F;
}

/* Bytes of a number. */
OLAT__API size_t olat__number_size(ssdgs_pixels format) {
    return format == SSDGS_PIXELS_RGBA8 ? 1 : format == SSDGS_PIXELS_RGBA32F ? 4 : 2;
}

/* A number of a photograph of bytes or words. */
static unsigned olat__sample(const void *pixels, ssdgs_pixels format, size_t i) {
    return format == SSDGS_PIXELS_RGBA16 ? ((const uint16_t *)pixels)[i] : ((const unsigned char *)pixels)[i];
}

/* Of any, bytes and words from 0 to 1. */
OLAT__API ssdgs_real olat__number(const void *pixels, ssdgs_pixels format, size_t i) {
    const ssdgs_real unit =
        format == SSDGS_PIXELS_RGBA16 ? (ssdgs_real)(1.0 / 65535) : (ssdgs_real)(1.0 / 255);
    if (format == SSDGS_PIXELS_RGBA32F) return (ssdgs_real)((const float *)pixels)[i];
    if (format == SSDGS_PIXELS_RGBA16F) return (ssdgs_real)olat__from_half(((const uint16_t *)pixels)[i]);
    return unit * (ssdgs_real)olat__sample(pixels, format, i);
}

/* How a number from 0 to 1 stands for light. */
enum { OLAT__POWER, OLAT__TABLE, OLAT__PQ, OLAT__HLG };
typedef struct olat__code {
    int kind;
    double g, a, b, c, d, e, f; /* OLAT__POWER: (a v + b)^g + e from d on, c v + f below */
    const unsigned char *table; /* OLAT__TABLE: so many words, the last one for 1 */
    uint32_t entries;
} olat__code;

typedef struct olat__space {
    olat__code code[3];
    int differs, high, narrow; /* from sRGB's primaries, by a matrix; light above 1; black is 16 of 255 */
    double matrix[9];
    char source[48]; /* who tells it */
} olat__space;

typedef struct olat__image {
    int width, height;
    ssdgs_pixels format;
    void *pixels; /* (height, width, 4) */
} olat__image;

static void olat__power(olat__code *code, double g, double a, double b, double c, double d) {
    memset(code, 0, sizeof *code);
    code->g = g, code->a = a, code->b = b, code->c = c, code->d = d;
}

/* Light, from 0 to 1, or 1 for white and more for what is brighter. */
static double olat__light(const olat__code *code, double v) {
    double light, base;
    if (code->kind == OLAT__TABLE) {
        const double at = v * (code->entries - 1), from = floor(at);
        const unsigned char *p = code->table + 2 * (size_t)from;
        const double low = p[0] << 8 | p[1], high = from < at ? p[2] << 8 | p[3] : low;
        return (low + (at - from) * (high - low)) / 65535;
    }
    if (code->kind == OLAT__PQ) { /* SMPTE ST 2084; a white of 203 nits, as ITU-R BT.2408 has it */
        base = pow(v, 1 / 78.84375);
        light = base > 0.8359375 ? (base - 0.8359375) / (18.8515625 - 18.6875 * base) : 0;
        return 10000.0 / 203 * pow(light, 1 / 0.1593017578125);
    }
    if (code->kind == OLAT__HLG) { /* ITU-R BT.2100, of the scene; white is 75 % of the signal there too */
        light = v <= 0.5 ? v * v / 3 : (exp((v - 0.55991073) / 0.17883277) + 0.28466892) / 12;
        return light / 0.26496255978640015;
    }
    base = code->a * v + code->b;
    base = base > 0 ? base < 4 ? base : 4 : 0;
    light = v >= code->d ? pow(base, code->g) + code->e : code->c * v + code->f;
    return light > 0 ? light < 1 ? light : 1 : 0;
}

/* In double: floats do not round to the right one of 16 bits. */
static double olat__to_srgb(double light) {
    return light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1 / 2.4) - 0.055;
}

static void olat__srgb_space(olat__space *space) {
    memset(space, 0, sizeof *space);
    for (int c = 0; c < 3; c++)
        olat__power(space->code + c, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045);
    for (int i = 0; i < 9; i++) space->matrix[i] = i % 4 == 0;
}

/* How far two spaces are from each other: colours of 0 to 1 on the sRGB curve, entries of matrices. */
static double olat__space_distance(const olat__space *a, const olat__space *b) {
    double most = a->high != b->high || a->narrow != b->narrow;
    for (int i = 0; i < 3 * 256; i++) {
        const double v = i % 256 / 255.0, apart = olat__to_srgb(olat__light(a->code + i / 256, v)) -
                                                  olat__to_srgb(olat__light(b->code + i / 256, v));
        if (fabs(apart) > most) most = fabs(apart);
    }
    for (int i = 0; i < 9; i++)
        if (fabs(a->matrix[i] - b->matrix[i]) > most) most = fabs(a->matrix[i] - b->matrix[i]);
    return most;
}

/* Those that follow fill a space that is sRGB from a chunk, and return what is wrong with it, or NULL. */

/* gAMA, cHRM, either or both, or neither; one that is wrong leaves the other. Gammas near sRGB's are meant to
   be that. */
static const char *olat__gama_space(const olat__png *png, olat__space *space) {
    const unsigned char *gama = png->told[OLAT__GAMA].data, *chrm = png->told[OLAT__CHRM].data;
    const uint32_t gamma = gama ? olat__be32(gama) : 45455;
    const int good = gamma >= 16 && gamma <= 625000000; /* libpng's limits */
    double xy[8], matrix[9];
    if (gama && good) snprintf(space->source, sizeof space->source, "gAMA %g", gamma / 1e5);
    for (int c = 0; c < 3 && good && (gamma < 40000 || gamma > 50000); c++)
        olat__power(space->code + c, 1e5 / gamma, 1, 0, 0, 0);
    for (int i = 0; chrm && i < 8; i++) xy[(i + 6) % 8] = olat__be32(chrm + 4 * i) / 1e5;
    const int primaries = chrm ? olat__primaries(xy, matrix) : 1;
    if (primaries == 2) {
        olat__append(space->source, sizeof space->source, "%scHRM", *space->source ? ", " : "");
        memcpy(space->matrix, matrix, sizeof matrix);
        space->differs = 1;
    }
    return !primaries ? "primaries that no light has" : good ? NULL : "damaged";
}

static double olat__icc_number(const unsigned char *p) { return (int32_t)olat__be32(p) / 65536.0; }

/* A curve of an ICC profile; 0 if it is none. */
static int olat__icc_curve(const unsigned char *p, size_t size, olat__code *code) {
    static const unsigned char counts[5] = {1, 3, 4, 5, 7};
    double v[7] = {0, 0, 0, 0, 0, 0, 0};
    olat__power(code, 1, 1, 0, 0, 0);
    if (size < 12) return 0;
    const uint32_t entries = olat__be32(p + 8);
    const int kind = p[8] << 8 | p[9];
    if (!memcmp(p, "curv", 4)) {
        if (entries > (size - 12) / 2) return 0;
        if (entries == 1) code->g = (p[12] << 8 | p[13]) / 256.0;
        if (entries > 1) code->kind = OLAT__TABLE, code->table = p + 12, code->entries = entries;
        return code->g > 0;
    }
    if (memcmp(p, "para", 4) != 0 || kind > 4 || (size - 12) / 4 < counts[kind]) return 0;
    for (int i = 0; i < counts[kind]; i++) v[i] = olat__icc_number(p + 12 + 4 * i);
    code->g = v[0];
    if (kind) code->a = v[1], code->b = v[2];
    if (kind == 1 || kind == 2) {
        if (!(fabs(v[1]) > 0)) return 0;
        code->d = -v[2] / v[1];
        code->e = code->f = v[3];
    }
    if (kind > 2) code->c = v[3], code->d = v[4], code->e = v[5], code->f = v[6];
    return code->g > 0 && code->g < 100;
}

/* A profile of a matrix and curves, or of one curve for grey. */
static const char *olat__icc_space(const unsigned char *profile, size_t size, olat__space *space) {
    static const char names[7][5] = {"rTRC", "gTRC", "bTRC", "rXYZ", "gXYZ", "bXYZ", "kTRC"};
    const unsigned char *tag[7] = {NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    uint32_t length[7] = {0, 0, 0, 0, 0, 0, 0};
    double xyz[9];
    if (size < 132 || memcmp(profile + 36, "acsp", 4) != 0 || olat__be32(profile) > size) return "damaged";
    size = olat__be32(profile);
    const int grey = !memcmp(profile + 16, "GRAY", 4);
    if (!grey && memcmp(profile + 16, "RGB ", 4) != 0) return "of another kind of colours than RGB";
    if (size < 132 || olat__be32(profile + 128) > (size - 132) / 12) return "damaged";
    for (uint32_t i = olat__be32(profile + 128); i-- > 0;)
        for (int k = 0; k < 7; k++) {
            const unsigned char *p = profile + 132 + 12 * (size_t)i;
            const uint32_t at = olat__be32(p + 4);
            if (memcmp(p, names[k], 4) != 0) continue;
            length[k] = olat__be32(p + 8);
            if (at > size || length[k] > size - at) return "damaged";
            tag[k] = profile + at;
        }
    if (memcmp(profile + 20, "XYZ ", 4) != 0 || !tag[grey ? 6 : 5] || (!grey && (!tag[3] || !tag[4])))
        return "of tables or for Lab, not of curves and a matrix";
    for (int c = 0; c < 3; c++) {
        const int k = grey ? 6 : c;
        if (!tag[k] || !olat__icc_curve(tag[k], length[k], space->code + c)) return "damaged";
        for (int i = 0; i < 3 && !grey; i++) {
            if (length[3 + c] < 20 || memcmp(tag[3 + c], "XYZ ", 4) != 0) return "damaged";
            xyz[3 * i + c] = olat__icc_number(tag[3 + c] + 8 + 4 * i);
        }
    }
    const int primaries = grey ? 1 : olat__colorants(xyz, space->matrix);
    space->differs = primaries == 2;
    snprintf(space->source, sizeof space->source, "ICC profile");
    return primaries ? NULL : "damaged";
}

/* Unpacks the profile and leaves it in png->packed, where curves point to. */
static const char *olat__iccp_space(olat__png *png, olat__space *space) {
    const size_t most = 1 << 24;
    const unsigned char *name = png->told[OLAT__ICCP].data;
    const size_t size = png->told[OLAT__ICCP].size;
    const unsigned char *end = (const unsigned char *)memchr(name, 0, size < 80 ? size : 80);
    const size_t before = end ? (size_t)(end - name) + 2 : 0;
    if (!end || before > size || end[1]) return "damaged";
    olat__inflater z;
    memset(&z, 0, sizeof z);
    z.in = name + before;
    z.size = size - before;
    z.capacity = z.size < most / 1032 ? 1032 * z.size + 1 : most; /* deflate packs no better */
    z.may_be_less = 1;
    z.out = png->packed = (unsigned char *)malloc(z.capacity);
    if (!z.out) return "out of memory";
    const char *problem = olat__inflate(&z);
    return problem ? z.length > most - 258 ? "of more than 16 MiB" : "damaged"
                   : olat__icc_space(z.out, z.length, space);
}

/* By the code points of ITU-T H.273. */
static const char *olat__cicp_space(const olat__png *png, olat__space *space) {
    static const struct {
        int code;
        double xy[8];
    } known[10] = {{4, {0.67, 0.33, 0.21, 0.71, 0.14, 0.08, 0.31, 0.316}},
                   {5, {0.64, 0.33, 0.29, 0.6, 0.15, 0.06, 0.3127, 0.329}},
                   {6, {0.63, 0.34, 0.31, 0.595, 0.155, 0.07, 0.3127, 0.329}},
                   {7, {0.63, 0.34, 0.31, 0.595, 0.155, 0.07, 0.3127, 0.329}},
                   {8, {0.681, 0.319, 0.243, 0.692, 0.145, 0.049, 0.31, 0.316}},
                   {9, {0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329}},
                   {10, {1, 0, 0, 1, 0, 0, 1.0 / 3, 1.0 / 3}},
                   {11, {0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.314, 0.351}},
                   {12, {0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329}},
                   {22, {0.63, 0.34, 0.295, 0.605, 0.155, 0.077, 0.3127, 0.329}}};
    const unsigned char *p = png->told[OLAT__CICP].data;
    const double alpha = 1.09929682680944, beta = 0.018053968510807; /* of BT.709 */
    olat__code *code = space->code;
    int i = 0;
    snprintf(space->source, sizeof space->source, "cICP %d %d %d %d", p[0], p[1], p[2], p[3]);
    while (i < 10 && known[i].code != p[0]) i++;
    if (p[0] != 1 && i == 10) return "primaries that are not known";
    if (i < 10) space->differs = olat__primaries(known[i].xy, space->matrix) == 2;
    if (p[1] == 1 || p[1] == 6 || p[1] == 14 || p[1] == 15)
        olat__power(code, 1 / 0.45, 1 / alpha, 1 - 1 / alpha, 1 / 4.5, 4.5 * beta);
    else if (p[1] == 4 || p[1] == 5 || p[1] == 8)
        olat__power(code, p[1] == 4 ? 2.2 : p[1] == 5 ? 2.8 : 1, 1, 0, 0, 0);
    else if (p[1] == 16 || p[1] == 18) code->kind = p[1] == 16 ? OLAT__PQ : OLAT__HLG;
    else if (p[1] != 13) return "a curve that is not known";
    code[1] = code[2] = code[0];
    space->high = code->kind != OLAT__POWER;
    space->narrow = !p[3];
    return NULL;
}

/* What the PNG's chunks say; the later ones in this list know more. */
static int olat__png_space(const char *name, olat__png *png, olat__space *space, olat__found *found,
                           char *error) {
    static const struct {
        int kind, other;
        const char *name;
    } chunks[4] = {{OLAT__GAMA, OLAT__CHRM, "gAMA or cHRM"},
                   {OLAT__SRGB, OLAT__SRGB, "sRGB"},
                   {OLAT__ICCP, OLAT__ICCP, "an ICC profile"},
                   {OLAT__CICP, OLAT__CICP, "cICP"}};
    const unsigned char *cicp = png->told[OLAT__CICP].data;
    olat__srgb_space(space);
    if (cicp && cicp[2])
        return olat__fail(error,
                          "%s: cICP: matrix coefficients %d: a PNG holds red, green and blue, which is 0: "
                          "convert the picture to RGB, or drop the chunk where it is RGB already",
                          olat__tail(name), cicp[2]);
    for (int i = 0; i < 4; i++) {
        const int kind = chunks[i].kind, other = chunks[i].other;
        const int told = png->told[kind].data || png->told[other].data,
                  damaged = png->damaged[kind] || png->damaged[other];
        const char *problem = NULL;
        olat__space next;
        olat__srgb_space(&next);
        if (!told && !damaged) continue;
        if (kind == OLAT__GAMA) problem = olat__gama_space(png, &next);
        else if (told && kind == OLAT__SRGB) snprintf(next.source, sizeof next.source, "sRGB");
        else if (told && kind == OLAT__ICCP) problem = olat__iccp_space(png, &next);
        else if (told) problem = olat__cicp_space(png, &next);
        if (!problem && damaged && (!told || kind == OLAT__GAMA)) problem = "damaged";
        if (problem && !strcmp(problem, "out of memory"))
            return olat__fail(error, "%s: out of memory", olat__tail(name));
        if (problem) olat__tell(found, OLAT__NAMED, OLAT__UNUSABLE, chunks[i].name, problem);
        if (problem && kind != OLAT__GAMA) continue;
        if (*space->source && *next.source && olat__space_distance(space, &next) > 0.05)
            olat__tell(found, OLAT__NAMED, "marked in two ways that contradict (%s; %s): the latter is taken",
                       space->source, next.source);
        *space = next;
    }
    return 0;
}

/* Brings colours to the sRGB curve in 16 bits, or to light in halves where some may be brighter than white;
   alpha stays. */
static int olat__convert(const olat__space *space, olat__image *image, olat__found *found) {
    const size_t pixels = (size_t)image->width * (size_t)image->height;
    const int wide = image->format == SSDGS_PIXELS_RGBA16, plain = !space->differs && !space->high;
    const unsigned top = wide ? 65535 : 255;
    const double black = space->narrow ? wide ? 16 * 256 : 16 : 0,
                 range = space->narrow ? wide ? 219 * 256 : 219 : top;
    uint16_t *out = (uint16_t *)malloc(4 * pixels * sizeof *out);
    double *table = (double *)malloc(3 * ((size_t)top + 1) * sizeof *table);
    size_t outside = 0;
    if (!out || !table) {
        free(out), free(table);
        return 1;
    }
    for (size_t i = 0; i < 3 * ((size_t)top + 1); i++) {
        const double v = ((double)(i % (top + 1)) - black) / range;
        table[i] = olat__light(space->code + i / (top + 1), v < 0 ? 0 : v > 1 ? 1 : v);
        if (plain) table[i] = 65535 * olat__to_srgb(table[i]) + 0.5;
    }
    for (size_t i = 0; i < pixels; i++) {
        const unsigned alpha = olat__sample(image->pixels, image->format, 4 * i + 3);
        double stored[3], v[3];
        int odd = 0;
        for (size_t c = 0; c < 3; c++)
            stored[c] = table[c * (top + 1) + olat__sample(image->pixels, image->format, 4 * i + c)];
        olat__transform(space->matrix, stored, v);
        for (size_t c = 0; c < 3; c++) {
            if (!plain) {
                odd |= v[c] < -0.01 || (v[c] > 1.01 && !space->high); /* more than bytes round */
                v[c] = v[c] < 0 ? 0 : v[c] > 1 && !space->high ? 1 : v[c];
                if (!space->high) v[c] = 65535 * olat__to_srgb(v[c]) + 0.5;
            }
            out[4 * i + c] = space->high ? olat__to_half((float)v[c]) : (uint16_t)v[c];
        }
        out[4 * i + 3] =
            space->high ? olat__to_half((float)alpha / (float)top) : (uint16_t)(alpha * (65535 / top));
        outside += odd && alpha;
    }
    if (outside > pixels / 1000) olat__tell(found, OLAT__NAMED, OLAT__OUTSIDE);
    free(table);
    free(image->pixels);
    image->pixels = out;
    image->format = space->high ? SSDGS_PIXELS_RGBA16F : SSDGS_PIXELS_RGBA16;
    return 0;
}

/* EXIF is a TIFF. A number in it; and where an entry of a directory has its value, 0 if there is none. */
static uint32_t olat__exif_long(const unsigned char *p, size_t at) {
    return p[0] == 'I' ? olat__le32(p + at) : olat__be32(p + at);
}
static size_t olat__exif_entry(const unsigned char *p, size_t size, uint32_t directory, int tag) {
    const int high = p[0] == 'I', low = !high; /* where a word has which byte */
    if (directory > size - 2) return 0;
    const int count = p[directory + (uint32_t)low] | p[directory + (uint32_t)high] << 8;
    for (size_t i = 0; i < (size_t)count && i < (size - 2 - directory) / 12; i++) {
        const size_t at = directory + 2 + 12 * i;
        if ((p[at + (size_t)low] | p[at + (size_t)high] << 8) == tag) return at + 8;
    }
    return 0;
}

/* What EXIF tells: an orientation, 1 if none, and whether the pixels are of Adobe RGB, as cameras say it that
   add no profile: by the interoperability index of DCF's option file. */
static void olat__exif_told(const unsigned char *p, size_t size, int *orientation, int *is_adobe) {
    *orientation = 1, *is_adobe = 0;
    if (!p || size < 8 || (memcmp(p, "II*\0", 4) != 0 && memcmp(p, "MM\0*", 4) != 0)) return;
    size_t at = olat__exif_entry(p, size, olat__exif_long(p, 4), 0x112);
    if (at) *orientation = p[at + (p[0] != 'I')] | p[at + (p[0] == 'I')] << 8;
    at = olat__exif_entry(p, size, olat__exif_long(p, 4), 0x8769);
    if (at) at = olat__exif_entry(p, size, olat__exif_long(p, at), 0xA005);
    if (at) at = olat__exif_entry(p, size, olat__exif_long(p, at), 1);
    *is_adobe = at && !memcmp(p + at, "R03", 4);
}

/* Makes pixels of that space those of a photograph. */
static int olat__to_photo(const char *name, const olat__space *space, olat__image *image, olat__found *found,
                          char *error) {
    static const char *const what[4] = {"converted to sRGB", "converted to the sRGB curve",
                                        "read as light, of which 203 nits are 1",
                                        "read as the scene's light, of which 75 % of the signal are 1"};
    const int kind = space->code->kind;
    int linear = 1;
    olat__space srgb;
    olat__srgb_space(&srgb);
    if (!space->differs && olat__space_distance(space, &srgb) <= 0.002) return 0;
    for (int c = 0; c < 3; c++) linear &= fabs(olat__light(space->code + c, 0.5) - 0.5) < 2e-3;
    olat__tell(found, 0, "%s (%s): %s",
               linear        ? "linear"
               : space->high ? "HDR"
                             : "not sRGB",
               space->source,
               what[kind == OLAT__HLG  ? 3
                    : kind == OLAT__PQ ? 2
                                       : !space->differs]);
    return olat__convert(space, image, found) && olat__fail(error, "%s: out of memory", olat__tail(name));
}

static void olat__tell_turned(olat__found *found, const char *who, int turned) {
    if (turned > 1 && turned < 9) olat__tell(found, OLAT__NAMED, OLAT__TURNED, who, turned);
}

/* A PNG as a photograph, or as a mask. */
static int olat__png_file(const char *name, const unsigned char *bytes, size_t size, int is_mask,
                          olat__image *image, olat__found *found, char *error) {
    olat__png png;
    olat__space space;
    memset(&png, 0, sizeof png);
    png.is_mask = is_mask;
    int failed = olat__png_decode(name, bytes, size, &png, error);
    image->width = png.width;
    image->height = png.height;
    image->format = png.format;
    image->pixels = png.out;
    if (png.labels)
        olat__tell(found, OLAT__OF_MASK, "of labels, by a palette of colours: all but index 0 is kept");
    if (failed || is_mask) return failed;
    png.packed = NULL;
    failed = olat__png_space(name, &png, &space, found, error) ||
             olat__to_photo(name, &space, image, found, error);
    free(png.packed);
    int turned, is_adobe; /* PNG has chunks for that */
    olat__exif_told(png.told[OLAT__EXIF].data, png.told[OLAT__EXIF].size, &turned, &is_adobe);
    olat__tell_turned(found, "eXIf orientation", turned);
    const unsigned char *phys = png.told[OLAT__PHYS].data;
    if (phys) {
        const double x = olat__be32(phys), y = olat__be32(phys + 4);
        if (x > 0 && y > 0 && fabs(x / y - 1) > 0.01)
            olat__tell(found, OLAT__NAMED, OLAT__OBLONG("pHYs %g x %g"), x, y);
    }
    return failed;
}

/* The space of a JPEG's ICC profile, whose parts are joined in *joined, where curves point to. */
static const char *olat__jpeg_space(const olat__jpeg *j, unsigned char **joined, olat__space *space) {
    size_t size = 0;
    for (int i = 1; i <= j->profile_parts; i++) {
        if (!j->profile[i].data) return "damaged";
        size += j->profile[i].size;
    }
    if (j->profile_damaged) return "damaged";
    if ((*joined = (unsigned char *)malloc(size + 1)) == NULL) return "out of memory";
    size = 0;
    for (int i = 1; i <= j->profile_parts; size += j->profile[i].size, i++)
        memcpy(*joined + size, j->profile[i].data, j->profile[i].size);
    return olat__icc_space(*joined, size, space);
}

/* A JPEG as a photograph, or as a mask. */
static int olat__jpeg_file(const char *name, const unsigned char *bytes, size_t size, int is_mask,
                           olat__image *image, olat__found *found, char *error) {
    olat__jpeg j;
    olat__space space;
    unsigned char *joined = NULL;
    memset(&j, 0, sizeof j);
    int failed = olat__jpeg_decode(name, bytes, size, &j, error);
    image->width = j.width;
    image->height = j.height;
    image->format = SSDGS_PIXELS_RGBA8;
    image->pixels = j.out;
    if (failed || is_mask) return failed;
    int turned, is_adobe;
    olat__exif_told(j.exif.data, j.exif.size, &turned, &is_adobe);
    olat__srgb_space(&space);
    const char *problem = j.profile_parts || j.profile_damaged ? olat__jpeg_space(&j, &joined, &space) : NULL;
    if (problem && !strcmp(problem, "out of memory"))
        failed = olat__fail(error, "%s: out of memory", olat__tail(name));
    else if (problem)
        olat__srgb_space(&space), olat__tell(found, OLAT__NAMED, OLAT__UNUSABLE, "an ICC profile", problem);
    else if (is_adobe && !j.profile_parts) {
        static const double xy[8] = {0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.329};
        for (int c = 0; c < 3; c++) olat__power(space.code + c, 563.0 / 256, 1, 0, 0, 0);
        space.differs = olat__primaries(xy, space.matrix) == 2;
        snprintf(space.source, sizeof space.source, "EXIF's Adobe RGB");
    }
    if (!failed) failed = olat__to_photo(name, &space, image, found, error);
    free(joined);
    olat__tell_turned(found, "EXIF's orientation", turned);
    if (j.density[0] && j.density[1] && fabs((double)j.density[0] / j.density[1] - 1) > 0.01)
        olat__tell(found, OLAT__NAMED, OLAT__OBLONG("JFIF density %d x %d"), j.density[0], j.density[1]);
    if (j.padded) olat__tell(found, OLAT__NAMED, "padded where no padding belongs: it may be damaged");
    return failed;
}

/* Reads a PNG, JPEG or OpenEXR, as a photograph or as a mask. */
OLAT__API int olat__image_file(const char *path, int is_mask, int *width, int *height, ssdgs_pixels *format,
                               void **pixels, olat__found *found, char *error) {
    unsigned char *bytes = NULL;
    size_t size = 0;
    olat__image image;
    const int told = found->count;
    memset(&image, 0, sizeof image);
    int failed = olat__read_file(path, &bytes, &size, error);
    if (!failed && size >= 4 && olat__le32(bytes) == OLAT__EXR_MAGIC) {
        failed = olat__exr_decode(path, bytes, size, &image.width, &image.height, &image.format,
                                  &image.pixels, found, error);
        if (is_mask) found->count = told;
    } else if (!failed && size >= 3 && !memcmp(bytes, "\xFF\xD8\xFF", 3))
        failed = olat__jpeg_file(path, bytes, size, is_mask, &image, found, error);
    else if (!failed) failed = olat__png_file(path, bytes, size, is_mask, &image, found, error);
    *width = image.width;
    *height = image.height;
    *format = image.format;
    *pixels = image.pixels;
    free(bytes);
    return failed;
}

#endif /* OLAT_IMAGES_H */
