/* jpeg.h - reads JPEG. MIT, see ssdgs.h.

   Part of images.h, whose olat__image_file makes photographs and masks of what this reads.

   READS  ITU-T T.81 with Huffman codes and 8 bits: baseline, extended and progressive, grey, YCbCr or RGB, in
   any scans, of any samplings that divide the finest, with restarts or without. The numbers are those that
   libjpeg-turbo's djpeg makes. What is told of the picture is found, not judged: EXIF, the parts of an ICC
   profile, JFIF's density. What follows the picture in its file is not looked at.

   REFUSES  Arithmetic codes, lossless and hierarchical JPEG, 12 bits, CMYK, a height that comes last (DNL).

   CONTENTS  sizes of images; bits and codes; blocks; scans; samples and pixels; segments.

   MEMORY  A byte a sample, four a pixel; of progressive pictures two more a sample.

   HOSTILE  Every byte of a file may be wrong. No scan says again what an earlier one said, and all scans
   together visit 2^28 blocks at most: the time is bounded, too. */

#ifndef OLAT_JPEG_H
#define OLAT_JPEG_H

#include "files.h"

/* ==== sizes of images, of any kind ==== */

enum { OLAT__MAX_SIDE = 1 << 15, OLAT__MAX_PIXELS = 1 << 28 };

static const char *olat__size_problem(uint32_t width, uint32_t height) {
    if (width < 1 || height < 1) return "the image has no pixels";
    if (width > OLAT__MAX_SIDE || height > OLAT__MAX_SIDE) return "a side is longer than 32768 pixels";
    return height > OLAT__MAX_PIXELS / width ? "the image has more than 2^28 pixels" : NULL;
}

/* ==== bits and codes ==== */

enum { OLAT__JPEG_FAST = 9, OLAT__JPEG_MOST_BLOCKS = 1 << 28 };

typedef struct olat__jpeg_code {
    uint16_t fast[1 << OLAT__JPEG_FAST]; /* symbol | length << 8 of the code in the high bits; 0: a longer
                                            code, or none */
    uint32_t end[17];                    /* behind the codes of each length, in the high ones of 16 bits */
    int offset[17], given;               /* from a code of each length to its symbol's place */
    unsigned char symbol[256];
} olat__jpeg_code;

typedef struct olat__jpeg_part { /* a component */
    int id, h, v, quantizer_of;  /* samples in the smallest rectangle that has whole ones of all */
    int dc, ac, last;            /* the scan's codes; the DC coefficient before */
    int width, height;           /* in samples */
    int columns, rows;           /* blocks in memory, which fill those rectangles */
    unsigned char known[64];     /* of each coefficient in the file's order: 1 + the lowest bit; 0: nothing */
    uint16_t quantizer[64];
    int16_t *blocks; /* of a progressive picture: 64 coefficients each, in rows */
    unsigned char *samples;
} olat__jpeg_part;

typedef struct olat__jpeg {
    const unsigned char *bytes;
    size_t size, at;
    uint64_t bits; /* read but not consumed, highest first, zeros below */
    int count;
    const char *problem; /* the first one; readers then return harmless values and the loops end */
    int width, height, parts, progressive, h, v; /* h, v: the most of any part */
    olat__jpeg_part part[3];
    olat__jpeg_code code[2][4]; /* DC, AC */
    uint16_t quantizer[4][64];
    int first, end, high, low; /* the scan's coefficients and bits */
    int run, interval;         /* blocks that have no more of it; rectangles between restarts */
    uint64_t visited;          /* blocks, in all scans */
    unsigned char *out;        /* (height, width, 4) */
    /* what is told */
    int is_jfif, density[2], adobe, profile_parts, profile_damaged;
    int padded; /* bytes belong to nothing */
    struct {
        const unsigned char *data;
        size_t size;
    } exif, profile[256]; /* a TIFF, NULL: there is none; parts of an ICC profile, from 1 on */
} olat__jpeg;

static int olat__jpeg_bad(olat__jpeg *j, const char *problem) {
    if (!j->problem) j->problem = problem;
    return 0;
}

/* The codes of each length follow on each other (T.81, C.2). */
static const char *olat__jpeg_build(olat__jpeg_code *code, const unsigned char *counts, int is_dc) {
    uint32_t next = 0;
    int place = 0;
    memset(code, 0, sizeof *code);
    for (int length = 1; length <= 16; length++, next <<= 1) {
        const int spare = OLAT__JPEG_FAST - length;
        code->offset[length] = place - (int)next;
        if (next + counts[length - 1] > 1u << length) return "more Huffman codes than there can be";
        for (int i = 0; i < counts[length - 1]; i++, place++, next++) {
            code->symbol[place] = counts[16 + place];
            if (is_dc && code->symbol[place] > 15) return "a Huffman code for more than 15 bits";
            for (uint32_t k = 0; spare >= 0 && k < 1u << spare; k++)
                code->fast[(next << spare) + k] = (uint16_t)(code->symbol[place] | length << 8);
        }
        code->end[length] = next << (16 - length);
    }
    code->given = 1;
    return NULL;
}

/* Stops before a marker. A byte of 255 is data where 0 follows, which is not. */
static void olat__jpeg_refill(olat__jpeg *j) {
    for (; j->count <= 56 && j->at < j->size; j->count += 8) {
        const unsigned char *p = j->bytes + j->at;
        if (*p == 255 && (j->at + 1 == j->size || p[1] != 0)) return;
        j->at += *p == 255 ? 2 : 1;
        j->bits |= (uint64_t)*p << (56 - j->count);
    }
}

static int olat__jpeg_drop(olat__jpeg *j, int n, int value) {
    if (j->count < n) return olat__jpeg_bad(j, "the data end early");
    j->bits <<= n;
    j->count -= n;
    return value;
}

/* The next n < 16 bits. */
static int olat__jpeg_take(olat__jpeg *j, int n) {
    if (j->count < n) olat__jpeg_refill(j);
    return olat__jpeg_drop(j, n, (int)(j->bits >> 48) >> (16 - n));
}

/* A number of n bits; those that begin with 0 are negative (T.81, F.2.2.1). */
static int olat__jpeg_number(olat__jpeg *j, int n) {
    const int number = olat__jpeg_take(j, n);
    return n > 0 && number < 1 << (n - 1) ? number - (1 << n) + 1 : number;
}

static int olat__jpeg_symbol(olat__jpeg *j, const olat__jpeg_code *code) {
    if (j->count < 32) olat__jpeg_refill(j);
    const uint32_t next = (uint32_t)(j->bits >> 48);
    const int entry = code->fast[next >> (16 - OLAT__JPEG_FAST)];
    if (entry) return olat__jpeg_drop(j, entry >> 8, entry & 255);
    for (int length = OLAT__JPEG_FAST + 1; length <= 16; length++)
        if (next < code->end[length])
            return olat__jpeg_drop(j, length,
                                   code->symbol[code->offset[length] + (int)(next >> (16 - length))]);
    return olat__jpeg_bad(j, "a code that stands for nothing");
}

/* ==== blocks ==== */

static const unsigned char olat__jpeg_order[64] = {
    0,  1,  8,  16, 9,  2,  3,  10, 17, 24, 32, 25, 18, 11, 4,  5,  12, 19, 26, 33, 40, 48,
    41, 34, 27, 20, 13, 6,  7,  14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23,
    30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63};

/* Adds the scan's bit to coefficients that are not 0, from k on, and passes over `zeros` others: returns
   where the next of those is, or the scan's end. */
static int olat__jpeg_refine(olat__jpeg *j, int16_t *block, int k, int zeros) {
    for (; k < j->end; k++) {
        int16_t *c = block + olat__jpeg_order[k];
        if (!*c && zeros-- == 0) break;
        if (*c && olat__jpeg_take(j, 1)) *c = (int16_t)(*c + (*c > 0 ? 1 << j->low : -(1 << j->low)));
    }
    return k;
}

/* What a scan holds of a block: all, or coefficients from j->first to before j->end, and of these the bits
   from j->low on, or only that one (T.81, F.2.2 and G.1.2). */
static void olat__jpeg_coefficients(olat__jpeg *j, olat__jpeg_part *part, int16_t *block) {
    const int unit = 1 << j->low;
    int k = j->first;
    if (k == 0 && j->high) block[0] = (int16_t)(block[0] | unit * olat__jpeg_take(j, 1));
    else if (k == 0) {
        const int step = olat__jpeg_number(j, olat__jpeg_symbol(j, &j->code[0][part->dc]));
        part->last = (int16_t)(part->last + step);
        block[0] = (int16_t)(part->last * unit);
    }
    for (k += k == 0; k < j->end && !j->run && !j->problem; k++) {
        const int symbol = olat__jpeg_symbol(j, &j->code[1][part->ac]), zeros = symbol >> 4,
                  bits = symbol & 15;
        if (!bits && zeros < 15) {
            j->run = (1 << zeros) + olat__jpeg_take(j, zeros);
            break;
        }
        if (j->high && bits > 1) olat__jpeg_bad(j, "a new coefficient of more than a bit");
        const int value = olat__jpeg_number(j, bits) * unit;
        k = j->high ? olat__jpeg_refine(j, block, k, zeros) : k + zeros;
        if (k < j->end) block[olat__jpeg_order[k]] = (int16_t)value;
        else if (bits) olat__jpeg_bad(j, "a coefficient beyond its block");
    }
    if (j->run) {
        if (j->high) olat__jpeg_refine(j, block, k, 64);
        j->run--;
    }
}

/* Eight of the cosine transform's sums, times 2^13 (T.81, A.3.3). Factors are those that the "islow"
   transform of libjpeg comes to, so that the numbers are the same. Words never make more than 31 bits. */
static void olat__jpeg_cosines(const int in[8], int out[8]) {
    static const int odd[4][4] = {{11363, 9633, 6437, 2260},
                                  {9633, -2259, -11362, -6436},
                                  {6437, -11362, 2261, 9633},
                                  {2260, -6436, 9633, -11363}};
    const int sum = (in[0] + in[4]) * 8192, difference = (in[0] - in[4]) * 8192,
              outer = in[2] * 10703 + in[6] * 4433, inner = in[2] * 4433 - in[6] * 10704;
    const int even[4] = {sum + outer, difference + inner, difference - inner, sum - outer};
    for (int i = 0; i < 4; i++) {
        const int *m = odd[i], v = in[1] * m[0] + in[3] * m[1] + in[5] * m[2] + in[7] * m[3];
        out[i] = even[i] + v;
        out[7 - i] = even[i] - v;
    }
}

static int olat__jpeg_clamp(int v, int low, int high) { return v < low ? low : v > high ? high : v; }
static unsigned char olat__jpeg_byte(int v) { return (unsigned char)olat__jpeg_clamp(v, 0, 255); }

/* Makes samples of a block: columns, rounded to a quarter, then rows. */
static void olat__jpeg_transform(const int16_t *block, const uint16_t *quantizer, unsigned char *samples,
                                 size_t pitch) {
    int half[64], in[8], out[8];
    for (int x = 0; x < 8; x++) {
        int any = 0;
        for (int y = 0; y < 8; y++) {
            in[y] = (int16_t)(block[8 * y + x] * quantizer[8 * y + x]);
            any |= y ? in[y] : 0;
        }
        if (any) olat__jpeg_cosines(in, out);
        for (int y = 0; y < 8; y++)
            half[8 * y + x] = olat__jpeg_clamp(any ? (out[y] + 1024) >> 11 : 4 * in[0], -32768, 32767);
    }
    for (int y = 0; y < 8; y++) {
        olat__jpeg_cosines(half + 8 * y, out);
        for (int x = 0; x < 8; x++) /* 128 is the middle */
            samples[(size_t)y * pitch + (size_t)x] = olat__jpeg_byte((out[x] + (257 << 17)) >> 18);
    }
}

static void olat__jpeg_samples(const olat__jpeg_part *part, int x, int y, const int16_t *block) {
    const size_t pitch = 8 * (size_t)part->columns, at = 8 * (size_t)y * pitch + 8 * (size_t)x;
    olat__jpeg_transform(block, part->quantizer, part->samples + at, pitch);
}

static int16_t *olat__jpeg_block(const olat__jpeg_part *part, int x, int y) {
    return part->blocks + 64 * ((size_t)y * (size_t)part->columns + (size_t)x);
}

/* ==== scans ==== */

/* The next marker's code, with j->at where it is; 0: there is none. Bytes before it may be 255. */
static int olat__jpeg_marker(olat__jpeg *j) {
    for (; j->at + 1 < j->size; j->at++) {
        const unsigned char *p = j->bytes + j->at;
        if (p[0] == 255 && p[1] != 0 && p[1] != 255) return p[1];
        j->padded |= p[0] != 255 || p[1] == 0;
    }
    return 0;
}

/* Bits up to a whole byte mean nothing. */
static void olat__jpeg_restart(olat__jpeg *j) {
    j->padded |= j->count > 7;
    j->bits = 0;
    j->count = j->run = 0;
    for (int i = 0; i < j->parts; i++) j->part[i].last = 0;
}

/* Reads the data of a scan: of one part its own blocks in rows, of several rectangles with blocks of each
   (T.81, A.2). */
static void olat__jpeg_data(olat__jpeg *j, olat__jpeg_part *const *scanned, int count) {
    const olat__jpeg_part *part = scanned[0];
    const int alone = count == 1, across = alone ? (part->width + 7) / 8 : part->columns / part->h,
              down = alone ? (part->height + 7) / 8 : part->rows / part->v;
    int16_t block[64];
    olat__jpeg_restart(j);
    for (int i = 0; i < across * down; i++) {
        const int restart = j->interval && i && i % j->interval == 0 ? 0xD0 + (i / j->interval - 1) % 8 : 0;
        if (restart) {
            olat__jpeg_restart(j);
            if (olat__jpeg_marker(j) == restart) j->at += 2;
            else olat__jpeg_bad(j, "a restart is missing");
        }
        for (int n = 0; n < count; n++) {
            const int h = alone ? 1 : scanned[n]->h, v = alone ? 1 : scanned[n]->v;
            for (int k = 0; k < h * v; k++) {
                const int x = i % across * h + k % h, y = i / across * v + k / h;
                if (j->problem) return;
                if (!j->progressive) memset(block, 0, sizeof block);
                olat__jpeg_coefficients(j, scanned[n],
                                        j->progressive ? olat__jpeg_block(scanned[n], x, y) : block);
                if (!j->progressive) olat__jpeg_samples(scanned[n], x, y, block);
            }
        }
    }
    olat__jpeg_restart(j);
}

static const char *olat__jpeg_scan(olat__jpeg *j, const unsigned char *p, size_t size) {
    olat__jpeg_part *scanned[3];
    const int count = size ? p[0] : 0;
    if (!j->parts) return "a scan before the frame header";
    if (count < 1 || count > j->parts || size != 4 + 2 * (size_t)count)
        return "a scan header of a bad length";
    const unsigned char *range = p + 1 + 2 * count;
    j->first = j->progressive ? range[0] : 0;
    j->end = j->progressive ? range[1] + 1 : 64;
    j->high = j->progressive ? range[2] >> 4 : 0;
    j->low = j->progressive ? range[2] & 15 : 0;
    if (j->first >= j->end || j->end > 64 || j->low > 13 || (j->high && j->high != j->low + 1) ||
        (j->progressive && (j->first ? count > 1 : j->end > 1)))
        return "a scan of coefficients or bits that cannot be";
    for (int i = 0, n = 0; i < count; i++, n++) {
        const unsigned char *told = p + 1 + 2 * i;
        while (n < j->parts && j->part[n].id != told[0]) n++;
        if (n == j->parts) return "a scan of a component that the frame has not, or not in this order";
        olat__jpeg_part *part = scanned[i] = j->part + n;
        part->dc = told[1] >> 4;
        part->ac = told[1] & 15;
        if (part->dc > 3 || part->ac > 3 || (!j->first && !j->high && !j->code[0][part->dc].given) ||
            (j->end > 1 && !j->code[1][part->ac].given))
            return "a Huffman table is missing";
        if (!part->quantizer[0])
            memcpy(part->quantizer, j->quantizer[part->quantizer_of], sizeof part->quantizer);
        if (!part->quantizer[0]) return "a quantization table is missing";
        for (int k = j->first; k < j->end; k++) {
            if (part->known[k] != (j->high ? j->high + 1 : 0)) return "a scan out of turn";
            part->known[k] = (unsigned char)(j->low + 1);
        }
        j->visited += (uint64_t)part->columns * (uint64_t)part->rows;
    }
    if (j->visited > OLAT__JPEG_MOST_BLOCKS) return "too many scans for a picture of this size";
    j->at = (size_t)(p - j->bytes) + size;
    olat__jpeg_data(j, scanned, count);
    return j->problem;
}

/* ==== samples and pixels ==== */

/* A row of a part in the picture's width. Halves are filled in as libjpeg-turbo has it: 3/4 of the nearest
   sample, 1/4 of the next, in x and y; wider gaps by the nearest. */
static const unsigned char *olat__jpeg_row(const olat__jpeg *j, const olat__jpeg_part *part, int y, int *sums,
                                           unsigned char *out) {
    const int across = j->h / part->h, down = j->v / part->v, n = part->width, at = y / down;
    const int beside = olat__jpeg_clamp(y & 1 ? at + 1 : at - 1, 0, part->height - 1);
    const unsigned char *row = part->samples + (size_t)at * 8 * (size_t)part->columns,
                        *next = part->samples + (size_t)beside * 8 * (size_t)part->columns;
    if (across == 1 && down == 1) return row;
    if (across > 2 || down > 2 || (across == 2 && n < 3)) {
        for (int x = 0; x < j->width; x++) out[x] = row[x / across];
        return out;
    }
    for (int x = 0; x < n; x++) sums[1 + x] = down == 2 ? 3 * row[x] + next[x] : row[x];
    sums[0] = sums[1];
    sums[n + 1] = sums[n];
    if (across == 1)
        for (int x = 0; x < n; x++) out[x] = (unsigned char)((sums[1 + x] + 1 + (y & 1)) >> 2);
    else {
        const int shift = 2 * down, left = down == 2 ? 8 : 1, right = down == 2 ? 7 : 2;
        for (int x = 0; x < n; x++) {
            const int *s = sums + 1 + x;
            out[2 * x] = (unsigned char)((3 * s[0] + s[-1] + left) >> shift);
            out[2 * x + 1] = (unsigned char)((3 * s[0] + s[1] + right) >> shift);
        }
    }
    return out;
}

/* Makes pixels of a row; colours by ITU-T T.871, in 2^-16. */
static void olat__jpeg_pixels(const unsigned char *const row[3], int is_rgb, int width, unsigned char *out) {
    const unsigned char *first = row[0], *second = row[1], *third = row[2];
    for (int x = 0; x < width; x++, out += 4) {
        const int luma = first[x], blue = second[x] - 128, red = third[x] - 128;
        out[0] = olat__jpeg_byte(is_rgb ? luma : luma + ((91881 * red + 32768) >> 16));
        out[1] = olat__jpeg_byte(is_rgb ? blue + 128 : luma + ((-22554 * blue - 46802 * red + 32768) >> 16));
        out[2] = olat__jpeg_byte(is_rgb ? red + 128 : luma + ((116130 * blue + 32768) >> 16));
        out[3] = 255;
    }
}

static const char *olat__jpeg_finish(olat__jpeg *j) {
    const olat__jpeg_part *part = j->part;
    const int names_rgb = part[0].id == 'R' && part[1].id == 'G' && part[2].id == 'B',
              is_rgb = j->parts == 1 || (!j->is_jfif && (j->adobe ? j->adobe == 1 : names_rgb));
    for (int i = 0; i < j->parts; i++, part++) {
        if (!part->known[0]) return "a component has no scan";
        for (int y = 0; y < (part->height + 7) / 8 && j->progressive; y++)
            for (int x = 0; x < (part->width + 7) / 8; x++)
                olat__jpeg_samples(part, x, y, olat__jpeg_block(part, x, y));
    }
    const size_t width = (size_t)j->width;
    j->out = (unsigned char *)malloc(4 * width * (size_t)j->height);
    int *sums = (int *)malloc((width + 2) * sizeof *sums);
    unsigned char *rows = (unsigned char *)malloc(3 * (width + 1));
    const int good = j->out && sums && rows;
    for (int y = 0; y < j->height && good; y++) {
        const unsigned char *row[3];
        for (int i = 0; i < 3; i++)
            row[i] = i < j->parts ? olat__jpeg_row(j, j->part + i, y, sums, rows + (size_t)i * (width + 1))
                                  : row[0];
        olat__jpeg_pixels(row, is_rgb, j->width, j->out + 4 * width * (size_t)y);
    }
    free(sums);
    free(rows);
    return good ? NULL : "out of memory";
}

/* ==== segments ==== */

static const char *olat__jpeg_frame(olat__jpeg *j, int marker, const unsigned char *p, size_t size) {
    if (j->parts) return "a second frame header";
    if (marker == 0xDE || (marker > 0xC2 && marker < 0xC8))
        return "lossless and hierarchical JPEG cannot be read: convert it to PNG";
    if (marker > 0xC8)
        return "arithmetic codes cannot be read: repack, for instance with: jpegtran in.jpg >out.jpg";
    if (size < 6 || size != 6 + 3 * (size_t)p[5]) return "a frame header of a bad length";
    if (p[0] != 8) return "samples of other than 8 bits cannot be read: convert it to PNG";
    if (!p[1] && !p[2])
        return "a height that is told behind the picture (DNL) cannot be read: convert it to PNG";
    if (p[5] == 4)
        return "CMYK cannot be read: convert it to RGB, for instance with: convert in.jpg -colorspace "
               "sRGB out.png";
    if (p[5] != 1 && p[5] != 3) return "neither grey nor of three components";
    const int height = p[1] << 8 | p[2], width = p[3] << 8 | p[4];
    const char *problem = olat__size_problem((uint32_t)width, (uint32_t)height);
    if (problem) return problem;
    size_t blocks = 0;
    for (int i = 0; i < p[5]; i++) {
        olat__jpeg_part *part = j->part + i;
        const unsigned char *told = p + 6 + 3 * i;
        part->id = told[0];
        part->h = told[1] >> 4;
        part->v = told[1] & 15;
        part->quantizer_of = told[2];
        if (part->h < 1 || part->h > 4 || part->v < 1 || part->v > 4 || part->quantizer_of > 3)
            return "a sampling or a quantization table that cannot be";
        for (int k = 0; k < i; k++)
            if (j->part[k].id == part->id) return "two components of one name";
        if (part->h > j->h) j->h = part->h;
        if (part->v > j->v) j->v = part->v;
    }
    for (; j->parts < p[5]; j->parts++) {
        olat__jpeg_part *part = j->part + j->parts;
        if (j->h % part->h || j->v % part->v)
            return "samplings that do not divide the finest cannot be read: convert it to PNG";
        part->width = (width * part->h + j->h - 1) / j->h;
        part->height = (height * part->v + j->v - 1) / j->v;
        part->columns = (width + 8 * j->h - 1) / (8 * j->h) * part->h;
        part->rows = (height + 8 * j->v - 1) / (8 * j->v) * part->v;
        blocks += (size_t)((part->width + 7) / 8) * (size_t)((part->height + 7) / 8);
    }
    if (blocks / 8 > j->size) return "less data than are needed"; /* a bit each at least */
    j->progressive = marker == 0xC2;
    j->width = width;
    j->height = height;
    for (int i = 0; i < j->parts; i++) {
        olat__jpeg_part *part = j->part + i;
        const size_t count = 64 * (size_t)part->columns * (size_t)part->rows;
        part->samples = (unsigned char *)malloc(count);
        if (j->progressive) part->blocks = (int16_t *)calloc(count, sizeof *part->blocks);
        if (!part->samples || (j->progressive && !part->blocks)) return "out of memory";
    }
    return NULL;
}

static const char *olat__jpeg_huffman(olat__jpeg *j, const unsigned char *p, size_t size) {
    while (size > 0) {
        size_t used = 17;
        for (int i = 1; i < 17 && size > 16; i++) used += p[i];
        if (used > size || used > 17 + 256 || p[0] > 0x1F || (p[0] & 15) > 3) return "a bad Huffman table";
        const char *problem = olat__jpeg_build(&j->code[p[0] >> 4][p[0] & 15], p + 1, !(p[0] >> 4));
        if (problem) return problem;
        p += used;
        size -= used;
    }
    return NULL;
}

static const char *olat__jpeg_quantizers(olat__jpeg *j, const unsigned char *p, size_t size) {
    while (size > 0) {
        const int wide = p[0] >> 4, k = p[0] & 15;
        const size_t used = wide ? 129 : 65;
        if (used > size || wide > 1 || k > 3) return "a bad quantization table";
        for (int i = 0; i < 64; i++) {
            const int step = wide ? p[1 + 2 * i] << 8 | p[2 + 2 * i] : p[1 + i];
            if (!step) return "a quantization step of 0";
            j->quantizer[k][olat__jpeg_order[i]] = (uint16_t)step;
        }
        p += used;
        size -= used;
    }
    return NULL;
}

static int olat__jpeg_begins(const unsigned char *p, size_t size, const char *name, size_t length) {
    return size >= length && !memcmp(p, name, length);
}

/* What programs and cameras tell. */
static void olat__jpeg_told(olat__jpeg *j, int marker, const unsigned char *p, size_t size) {
    if (marker == 0xE0 && olat__jpeg_begins(p, size, "JFIF", 5) && size >= 14) {
        j->is_jfif = 1;
        for (int i = 0; i < 2; i++) j->density[i] = p[8 + 2 * i] << 8 | p[9 + 2 * i];
    } else if (marker == 0xE1 && olat__jpeg_begins(p, size, "Exif\0", 6) && !j->exif.data) {
        j->exif.data = p + 6;
        j->exif.size = size - 6;
    } else if (marker == 0xE2 && olat__jpeg_begins(p, size, "ICC_PROFILE", 12)) {
        const int number = size > 14 ? p[12] : 0;
        if (!number || number > p[13] || (j->profile_parts && j->profile_parts != p[13]) ||
            j->profile[number].data)
            j->profile_damaged = 1;
        else j->profile_parts = p[13], j->profile[number].data = p + 14, j->profile[number].size = size - 14;
    } else if (marker == 0xEE && olat__jpeg_begins(p, size, "Adobe", 5) && size >= 12) j->adobe = 1 + p[11];
}

/* Leaves the pixels in j->out; returns NULL or what is wrong. */
static const char *olat__jpeg_read(olat__jpeg *j) {
    const char *problem = NULL;
    for (j->at = 2; !problem;) {
        const int marker = olat__jpeg_marker(j);
        const size_t left = j->size - j->at;
        if (marker == 0xD9) return j->parts ? olat__jpeg_finish(j) : "the picture is missing";
        if (marker == 1 || (marker >= 0xD0 && marker <= 0xD7)) { /* those have no segment */
            j->at += 2;
            continue;
        }
        const unsigned char *p = j->bytes + j->at;
        const size_t length = !marker || left < 4 ? left : (size_t)(p[2] << 8 | p[3]);
        if (!marker || length > left - 2) return "the file ends early";
        if (length < 2) return "a segment that is shorter than its length";
        const size_t size = length - 2, after = j->at + 2 + length;
        p += 4;
        if (marker < 0xC0 || marker == 0xD8) problem = "an unknown marker";
        else if (marker == 0xC4) problem = olat__jpeg_huffman(j, p, size);
        else if (marker == 0xDB) problem = olat__jpeg_quantizers(j, p, size);
        else if (marker == 0xDA) problem = olat__jpeg_scan(j, p, size);
        else if (marker == 0xDD && size != 2) problem = "a restart interval of a bad length";
        else if (marker == 0xDD) j->interval = p[0] << 8 | p[1];
        else if (marker == 0xDE || (marker < 0xD0 && marker != 0xC8 && marker != 0xCC))
            problem = olat__jpeg_frame(j, marker, p, size);
        else olat__jpeg_told(j, marker, p, size);
        if (!problem && marker != 0xDA) j->at = after;
    }
    return problem;
}

/* Decodes a JPEG; j is empty, and is so again after a failure. */
static int olat__jpeg_decode(const char *name, const unsigned char *bytes, size_t size, olat__jpeg *j,
                             char *error) {
    j->bytes = bytes;
    j->size = size;
    const char *problem = olat__jpeg_read(j);
    for (int i = 0; i < 3; i++) free(j->part[i].samples), free(j->part[i].blocks);
    if (!problem) return 0;
    olat__fail(error, "%s: byte %lu: %s", olat__tail(name), (unsigned long)j->at, problem);
    free(j->out);
    memset(j, 0, sizeof *j);
    return 1;
}

#endif /* OLAT_JPEG_H */
