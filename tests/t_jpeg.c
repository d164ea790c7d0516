/* examples/jpeg.h: the pictures in tests/fuzz/seeds/jpeg have the very numbers that djpeg of
   libjpeg-turbo 2.1.5 makes of them, one after the other in tests/golden/jpeg.ppm; what they tell, in
   datasets too; every byte that is wrong. cc -o build/t_jpeg tests/t_jpeg.c -lm -lpthread && build/t_jpeg
   (writes under build/) */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"
#include "meter.h"

#define FOLDER "build/t_jpeg_files"

static const char *const names[] = {
    "base420", "base440", "base411_restart", "base_thirds",  "base_mixed", "extended444", "scans420", "grey",
    "rgb",     "prog422", "prog420_restart", "prog440_bits", "small420",   "small422",    "even420"};
enum { NAMES = sizeof names / sizeof *names };

static unsigned char file[1 << 14];
static size_t file_size;
static char error[512];
static olat__found found;
static olat__image image;

static void read_seed(const char *name) {
    char path[200];
    snprintf(path, sizeof path, "tests/fuzz/seeds/jpeg/%s.jpg", name);
    FILE *stream = fopen(path, "rb");
    file_size = stream ? fread(file, 1, sizeof file, stream) : 0;
    if (stream) fclose(stream);
    CHECK(file_size > 100 && file_size < sizeof file - 1000);
}

/* Reads an exact copy of the file as a photograph, or as a mask: 1 if it could be read. */
static int reads(int is_mask) {
    unsigned char *copy = (unsigned char *)malloc(file_size + !file_size);
    memset(&image, 0, sizeof image);
    memset(&found, 0, sizeof found);
    memset(error, 0, sizeof error);
    memcpy(copy, file, file_size);
    const int failed = olat__jpeg_file("a.jpg", copy, file_size, is_mask, &image, &found, error);
    free(copy);
    if (failed) meter_free(image.pixels), image.pixels = NULL;
    if (failed) CHECK(live == 0 && !strncmp(error, "a.jpg: ", 7));
    return !failed;
}

static void forget(void) {
    meter_free(image.pixels);
    memset(&image, 0, sizeof image);
    CHECK(live == 0);
}

static int refused(const char *message) {
    if (!reads(0) && strstr(error, message)) return 1;
    printf("    wanted \"%s\", got \"%s\"\n", message, error);
    if (image.pixels) forget();
    return 0;
}

/* Where the n-th segment of a kind begins, behind its length; 0: there is none. Entropy-coded data look like
   none. */
static size_t segment(int marker, int n) {
    for (size_t at = 2; at + 4 < file_size; at++)
        if (file[at] == 255 && file[at + 1] == marker && n-- == 0) return at + 4;
    return 0;
}

static void insert(size_t at, const void *bytes, size_t size) {
    memmove(file + at + size, file + at, file_size - at);
    memcpy(file + at, bytes, size);
    file_size += size;
}

static void erase(size_t at, size_t size) {
    memmove(file + at, file + at + size, file_size - at - size);
    file_size -= size;
}

/* ---- numbers ---- */

static unsigned char golden[NAMES][33 * 21 * 3];
static int golden_width[NAMES], golden_height[NAMES];

static void read_golden(void) {
    FILE *stream = fopen("tests/golden/jpeg.ppm", "rb");
    for (int i = 0; i < NAMES && CHECK(stream); i++) {
        int kind, width = 0, height = 0;
        CHECK(fscanf(stream, "P%d %d %d 255", &kind, &width, &height) == 3 && fgetc(stream) == '\n');
        const size_t count = (size_t)(width * height), channels = kind == 5 ? 1 : 3;
        if (!CHECK(count <= 33 * 21 && fread(golden[i], channels, count, stream) == count)) break;
        for (size_t k = 3 * count; channels == 1 && k-- > 0;) golden[i][k] = golden[i][k / 3];
        golden_width[i] = width, golden_height[i] = height;
    }
    if (stream) fclose(stream);
}

/* Whether the image has the i-th's numbers. */
static int is_golden(int i) {
    const unsigned char *pixels = (const unsigned char *)image.pixels;
    int wrong = 0;
    if (image.width != golden_width[i] || image.height != golden_height[i]) return 0;
    for (int k = 0; k < 4 * image.width * image.height; k++)
        wrong += pixels[k] != (k % 4 < 3 ? golden[i][k / 4 * 3 + k % 4] : 255);
    return !wrong && image.format == SSDGS_PIXELS_RGBA8;
}

/* What must change nothing: to be read as before, with this note or none. */
static int still(int i, const char *note) {
    if (!reads(0)) {
        printf("    %s: %s\n", names[i], error);
        return 0;
    }
    const int same =
        is_golden(i) && (note ? found.count == 1 && strstr(found.remarks->text, note) : !found.count);
    if (!same)
        printf("    %s: other numbers or notes: %s\n", names[i], found.count ? found.remarks->text : "");
    forget();
    return same;
}

static void test_numbers(void) {
    for (int i = 0; i < NAMES; i++) {
        read_seed(names[i]);
        CHECK(still(i, NULL));
        CHECK(reads(1) && is_golden(i));
        forget();
    }
    read_seed("grey"); /* of one component no factors matter */
    file[segment(0xC0, 0) + 7] = 0x42;
    CHECK(still(7, NULL));
}

/* ---- what surrounds the picture ---- */

static void test_segments(void) {
    static const unsigned char fill[3] = {255, 255, 255}, word[8] = {255, 0xFE, 0, 6, 'a', 255, 0xD9, 'b'},
                               adobe[16] = {255, 0xEE, 0, 14, 'A', 'd', 'o', 'b', 'e'};
    read_seed("base420");
    insert(file_size, "\xFF\xD8\xFF", 3); /* a second picture behind the first */
    insert(2, word, 8), insert(2, fill, 3), insert(segment(0xDA, 0) - 4, fill, 2);
    insert(file_size - 5, fill, 3);
    CHECK(still(0, NULL));
    read_seed("base420");
    insert(file_size - 2, "\xFF\xD0", 2); /* a restart that nothing follows */
    insert(2, "\xFF\x01", 2);
    CHECK(still(0, NULL));
    insert(file_size - 2, "\0\0\xFF", 4);
    CHECK(still(0, "padded where no padding belongs: it may be damaged"));
    read_seed("base411_restart");
    insert(segment(0xD0, 0) - 4, "\x7F", 1);
    CHECK(still(2, "padded where no padding belongs"));
    read_seed("base420"); /* JFIF's word counts, then Adobe's, then the components' names */
    insert(2, adobe, 16);
    CHECK(still(0, NULL));
    erase(18, 18);
    CHECK(reads(0) && !is_golden(0));
    forget();
    file[17] = 1;
    CHECK(still(0, NULL));
    read_seed("rgb");
    const size_t marker = segment(0xEE, 0) - 4;
    CHECK(file[marker + 15] == 0);
    erase(marker, 16);
    CHECK(still(8, NULL));
    file[segment(0xC0, 0) + 6] = 'r', file[segment(0xDA, 0) + 1] = 'r';
    CHECK(reads(0) && !is_golden(8));
    forget();
    static unsigned char steps[69] = {255, 0xDB, 0, 67}; /* a table counts from a component's first scan on */
    memset(steps + 5, 9, 64);
    read_seed("prog422");
    size_t last = 0;
    for (int n = 0; segment(0xDA, n); n++) last = segment(0xDA, n) - 4;
    insert(last, steps, 69);
    CHECK(still(9, NULL));
}

/* 1 with the marker's segment gone. */
static int without(const char *name, int marker, const char *message) {
    read_seed(name);
    for (size_t at; (at = segment(marker, 0)) != 0;)
        erase(at - 4, 2 + (size_t)(file[at - 2] << 8 | file[at - 1]));
    return refused(message);
}

/* ... with a byte of the n-th of them changed. */
static int changed(const char *name, int marker, int n, size_t at, int to, const char *message) {
    read_seed(name);
    const size_t start = segment(marker, n);
    CHECK(start);
    file[start + at] = (unsigned char)to;
    return refused(message);
}

static void test_refusals(void) {
    static const int lossless[] = {0xC3, 0xC5, 0xC6, 0xC7},
                     arithmetic[] = {0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF};
    for (size_t i = 0; i < 4; i++)
        CHECK(changed("base420", 0xC0, 0, (size_t)-3, lossless[i],
                      "lossless and hierarchical JPEG cannot be read: convert it to PNG"));
    for (size_t i = 0; i < 6; i++)
        CHECK(changed("base420", 0xC0, 0, (size_t)-3, arithmetic[i],
                      "arithmetic codes cannot be read: repack, for instance with: jpegtran"));
    CHECK(changed("base420", 0xE0, 0, (size_t)-3, 0xDE, "lossless and hierarchical"));
    CHECK(changed("base420", 0xE0, 0, (size_t)-3, 0xBF, "byte 2: an unknown marker"));
    CHECK(changed("base420", 0xE0, 0, (size_t)-3, 0xD8, "an unknown marker"));
    CHECK(changed("base420", 0xE0, 0, (size_t)-1, 1, "shorter than its length"));
    CHECK(changed("base420", 0xE0, 0, (size_t)-2, 255, "byte 2: the file ends early"));
    CHECK(
        changed("base420", 0xC0, 0, 0, 12, "samples of other than 8 bits cannot be read: convert it to PNG"));
    CHECK(
        changed("base420", 0xC0, 0, 2, 0, "told behind the picture (DNL) cannot be read: convert it to PNG"));
    CHECK(changed("base420", 0xC0, 0, 4, 0, "no pixels"));
    CHECK(changed("base420", 0xC0, 0, 3, 0x80, "a side is longer than 32768 pixels"));
    CHECK(changed("base420", 0xC0, 0, 1, 0x7F, "less data than are needed"));
    CHECK(changed("base420", 0xC0, 0, 5, 1, "a frame header of a bad length"));
    CHECK(changed("grey", 0xC0, 0, 5, 0, "a frame header of a bad length"));
    CHECK(changed("base420", 0xC0, 0, 7, 0x52, "a sampling or a quantization table that cannot be"));
    CHECK(changed("base420", 0xC0, 0, 7, 0x20, "a sampling or"));
    CHECK(changed("base420", 0xC0, 0, 8, 4, "a sampling or"));
    CHECK(changed("base420", 0xC0, 0, 8, 3, "a quantization table is missing"));
    CHECK(changed("base420", 0xC0, 0, 10, 0x32, "samplings that do not divide the finest cannot be read"));
    CHECK(changed("base420", 0xC0, 0, 10, 0x13, "samplings that do not divide"));
    CHECK(changed("base420", 0xC0, 0, 9, 1, "two components of one name"));
    CHECK(changed("base420", 0xC4, 0, 0, 4, "a bad Huffman table"));
    CHECK(changed("base420", 0xC4, 0, 0, 0x20, "a bad Huffman table"));
    CHECK(changed("base420", 0xC4, 0, 16, 200, "a bad Huffman table"));
    CHECK(changed("base420", 0xC4, 0, 17, 16, "a Huffman code for more than 15 bits"));
    read_seed("base420"); /* three codes of one bit, as many in all as there were */
    const size_t codes = segment(0xC4, 0);
    file[codes + 1] = 3, file[codes + 3] = (unsigned char)(file[codes + 3] - 3);
    CHECK(refused("more Huffman codes than there can be"));
    CHECK(changed("base420", 0xDB, 0, 0, 4, "a bad quantization table"));
    CHECK(changed("base420", 0xDB, 0, 0, 0x20, "a bad quantization table"));
    CHECK(changed("base420", 0xDB, 0, 0, 0x10, "a bad quantization table"));
    CHECK(changed("base420", 0xDB, 0, 5, 0, "a quantization step of 0"));
    CHECK(changed("base420", 0xDA, 0, 0, 0, "a scan header of a bad length"));
    CHECK(changed("base420", 0xDA, 0, 0, 4, "a scan header of a bad length"));
    CHECK(changed("base420", 0xDA, 0, 0, 2, "a scan header of a bad length"));
    CHECK(changed("base420", 0xDA, 0, 1, 9, "a scan of a component that the frame has not"));
    CHECK(changed("base420", 0xDA, 0, 3, 1, "not in this order"));
    CHECK(changed("base420", 0xDA, 0, 2, 0x40, "a Huffman table is missing"));
    CHECK(changed("base420", 0xDA, 0, 2, 0x04, "a Huffman table is missing"));
    CHECK(changed("base420", 0xDA, 0, 2, 0x20, "a Huffman table is missing"));
    CHECK(changed("base420", 0xDA, 0, 2, 0x02, "a Huffman table is missing"));
    CHECK(changed("scans420", 0xDA, 1, 1, 1, "a scan out of turn"));
    CHECK(changed("base411_restart", 0xDD, 0, (size_t)-3, 0xFE, "byte "));
    CHECK(changed("base411_restart", 0xD1, 0, (size_t)-3, 0xD2, "a restart is missing"));
    CHECK(changed("prog440_bits", 0xDA, 0, 8, 1, "a scan of coefficients or bits that cannot be"));
    CHECK(changed("prog440_bits", 0xDA, 1, 3, 0, "a scan of coefficients or bits that cannot be"));
    CHECK(changed("prog440_bits", 0xDA, 1, 4, 64, "a scan of coefficients or bits that cannot be"));
    CHECK(changed("prog440_bits", 0xDA, 1, 5, 14, "a scan of coefficients or bits that cannot be"));
    CHECK(changed("prog440_bits", 0xDA, 2, 9, 0x31, "a scan of coefficients or bits that cannot be"));
    CHECK(changed("prog440_bits", 0xDA, 2, 9, 0x21, "a scan out of turn"));
    CHECK(without("base420", 0xDB, "a quantization table is missing"));
    CHECK(without("base420", 0xC4, "a Huffman table is missing"));
    CHECK(without("base420", 0xC0, "a scan before the frame header"));
    CHECK(without("base420", 0xDA, "byte "));
    read_seed("base420");
    memcpy(file, "\xFF\xD8\xFF\xD9", file_size = 4);
    CHECK(refused("byte 2: the picture is missing"));
    read_seed("base420");
    insert(segment(0xC0, 0) - 4, file + segment(0xC0, 0) - 4, 19);
    CHECK(refused("a second frame header"));
    read_seed("base420");
    insert(segment(0xDA, 0) - 4, "\xFF\xDD\0\3\0", 5);
    CHECK(refused("a restart interval of a bad length"));
    read_seed("scans420");
    file_size = segment(0xDA, 2) - 4;
    insert(file_size, "\xFF\xD9", 2);
    CHECK(refused("a component has no scan"));
    static const int counts[2] = {4, 2};
    for (int i = 0; i < 2; i++) { /* CMYK, and what is nothing */
        read_seed("base420");
        const size_t frame = segment(0xC0, 0);
        if (counts[i] == 4) insert(frame + 15, "\4\x11\0", 3);
        else erase(frame + 12, 3);
        file[frame + 5] = (unsigned char)counts[i], file[frame - 1] = (unsigned char)(8 + 3 * counts[i]);
        CHECK(refused(i ? "neither grey nor of three components" : "CMYK cannot be read: convert it to RGB"));
    }
    /* scans that take too long, of which a file would be long */
    olat__jpeg j;
    read_seed("prog422");
    for (int most = 0; most < 2; most++) {
        memset(&j, 0, sizeof j);
        j.visited = OLAT__JPEG_MOST_BLOCKS - (most ? 1000 : 10);
        CHECK(olat__jpeg_decode("a", file, file_size, &j, error) == !most &&
              (most || strstr(error, "too many scans for a picture of this size")));
        meter_free(j.out);
    }
}

/* ---- bytes that are wrong ---- */

static void test_damage(void) {
    static const unsigned char steps[4] = {1, 0x10, 0x80, 0xFF};
    for (int i = 0; i <= NAMES; i++) {
        read_seed(i < NAMES ? names[i] : "p3_turned");
        const size_t size = file_size;
        int read = 0;
        for (file_size = 3; file_size < size; file_size++)
            if (reads(0)) read++, forget();
        CHECK(!read); /* without its end none is whole */
        for (size_t at = 2; at < size; at++)
            for (int k = 0; k < 4; k++) {
                file[at] ^= steps[k];
                if (reads(0)) forget();
                file[at] ^= steps[k];
            }
    }
}

static void test_memory(void) {
    static const char *const some[3] = {"base420", "prog422", "p3_turned"};
    for (int i = 0; i < 3; i++) {
        int done = 0;
        read_seed(some[i]);
        for (fail_at = 1; !done && fail_at < 20; fail_at++) {
            calls = -1; /* the copy's */
            done = reads(0);
            CHECK(done || strstr(error, "out of memory"));
            if (done) forget();
        }
        CHECK(done && fail_at > 6);
    }
    fail_at = 0;
}

/* ---- what is told ---- */

static double to_light(double v) { return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4); }

static void test_told(void) {
    static const double p3[9] = {1.2249401, -0.2249402, 0,          -0.0420570, 1.0420571,
                                 0,         -0.0196376, -0.0786361, 1.0982735};
    static const struct {
        size_t from; /* ICC_PROFILE's: number and count behind the name; else the profile's byte */
        int part, to;
        const char *note;
    } profiles[] = {
        {12, 0, 1, "cannot be used (damaged)"}, {12, 0, 0, "cannot be used (damaged)"},
        {12, 0, 4, "cannot be used (damaged)"}, {13, 0, 4, "cannot be used (damaged)"},
        {13, 1, 2, "cannot be used (damaged)"}, {14 + 17, 1, 'X', "of another kind of colours than RGB"}};
    double worst = 0;
    read_seed("p3_turned");
    if (CHECK(reads(0) && image.format == SSDGS_PIXELS_RGBA16)) {
        CHECK(found.count == 3 && strstr(found.remarks[0].text, "not sRGB (ICC profile): converted to sRGB"));
        CHECK(strstr(found.remarks[1].text, "of colours that sRGB does not hold") &&
              strstr(found.remarks[2].text, "(EXIF's orientation 6): read as stored"));
        for (int i = 0; i < 33 * 21; i++) {
            const uint16_t *got = (const uint16_t *)image.pixels + 4 * i;
            for (int c = 0; c < 3; c++) {
                double light = 0;
                for (int k = 0; k < 3; k++) light += p3[3 * c + k] * to_light(golden[0][3 * i + k] / 255.0);
                light = light < 0 ? 0 : light > 1 ? 1 : light;
                worst = test_most(worst, fabs(to_light(got[c] / 65535.0) - light));
            }
            CHECK(got[3] == 65535);
        }
        CHECK(worst < 2e-4);
        forget();
    }
    CHECK(reads(1) && is_golden(0) && !found.count); /* a mask's numbers are what they are */
    forget();
    for (size_t i = 0; i < sizeof profiles / sizeof *profiles; i++) {
        read_seed("p3_turned");
        file[segment(0xE2, profiles[i].part) + profiles[i].from] = (unsigned char)profiles[i].to;
        if (CHECK(reads(0) && is_golden(0) && found.count == 2 &&
                  strstr(found.remarks[0].text, profiles[i].note)))
            forget();
    }
    read_seed("p3_turned"); /* one of three parts is missing */
    erase(segment(0xE2, 1) - 4, 118);
    if (CHECK(reads(0) && is_golden(0) &&
              strstr(found.remarks[0].text, "an ICC profile that cannot be used")))
        forget();
    for (int turn = 0; turn < 10; turn++) {
        read_seed("p3_turned");
        file[segment(0xE1, 0) + 25] = (unsigned char)turn;
        CHECK(reads(0) && found.count == (turn > 1 && turn < 9 ? 3 : 2));
        forget();
    }
    read_seed("base420");
    file[segment(0xE0, 0) + 9] = 2;
    CHECK(still(0, "of pixels that are not square (JFIF density 2 x 1): read as stored"));
    file[segment(0xE0, 0) + 11] = 0;
    CHECK(still(0, NULL));
}

/* EXIF as cameras write it: the interoperability index, two directories deep. R03 is Adobe RGB, whose matrix
   to sRGB is that of its primaries (Adobe RGB (1998), 4.3.4); a profile goes before it. */
static void test_adobe_rgb(void) {
    static const double adobe[9] = {1.3983557, -0.3983557, 0, 0, 1, 0, 0, -0.0429290, 1.0429290};
    static const struct {
        char index[4];
        int big, cut, says;
    } cases[] = {{"R03", 0, 0, 1}, {"R03", 1, 0, 1}, {"R98", 0, 0, 0}, {"R03", 0, 5, 0}, {"R03", 1, 30, 0}};
    static const unsigned tags[3] = {0x8769, 0xA005, 1};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        unsigned char exif[4 + 6 + 8 + 3 * 18] = {255, 0xE1, 0, 0, 'E', 'x', 'i', 'f'}, *tiff = exif + 10;
        const int big = cases[k].big;
        const size_t size = sizeof exif - (size_t)cases[k].cut;
        double worst = 0;
        exif[3] = (unsigned char)(size - 2);
        memcpy(tiff, big ? "MM\0*\0\0\0\x08" : "II*\0\x08\0\0\0", 8);
        for (int i = 0; i < 3; i++) { /* a directory of one entry */
            const unsigned words[3] = {1, tags[i], i < 2 ? 4u : 2u};
            unsigned char *at = tiff + 8 + 18 * i;
            for (int w = 0; w < 3; w++)
                at[2 * w + big] = words[w] & 255, at[2 * w + !big] = words[w] >> 8 & 255;
            at[big ? 9 : 6] = i < 2 ? 1 : 4;
            at[big ? 13 : 10] = (unsigned char)(8 + 18 * (i + 1));
            if (i == 2) memcpy(at + 10, cases[k].index, 4);
        }
        read_seed(names[0]);
        insert(2, exif, size);
        if (!CHECK(reads(0))) continue;
        CHECK(cases[k].says
                  ? image.format == SSDGS_PIXELS_RGBA16 && found.count >= 1 &&
                        strstr(found.remarks[0].text, "not sRGB (EXIF's Adobe RGB): converted to sRGB")
                  : is_golden(0) && !found.count);
        for (int i = 0; i < golden_width[0] * golden_height[0] && cases[k].says; i++) {
            const uint16_t *got = (const uint16_t *)image.pixels + 4 * i;
            for (int c = 0; c < 3; c++) {
                double light = 0;
                for (int j = 0; j < 3; j++)
                    light += adobe[3 * c + j] * pow(golden[0][3 * i + j] / 255.0, 563.0 / 256);
                light = light < 0 ? 0 : light > 1 ? 1 : light;
                worst = test_most(worst, fabs(to_light(got[c] / 65535.0) - light));
            }
        }
        CHECK(worst < 2e-4);
        forget();
        read_seed("p3_turned");
        insert(2, exif, size);
        CHECK(reads(0) && strstr(found.remarks[0].text, "not sRGB (ICC profile)"));
        forget();
    }
}

/* ---- datasets ---- */

static olat_dataset set;

static int loads(const char *frame) {
    FILE *stream = fopen(FOLDER "/set.json", "wb");
    if (!CHECK(stream)) return 0;
    fprintf(stream,
            "{\"camera_angle_x\":1,\"frames\":[{%s,\"pl_pos\":[1,2,3],"
            "\"transform_matrix\":[[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]}",
            frame);
    fclose(stream);
    memset(error, 0, sizeof error);
    return !olat_load(FOLDER, "set.json", 0, &set, error);
}

/* Whether the frame is that file. */
static int shows(const char *frame, const char *name, ssdgs_pixels format) {
    const int good =
        loads(frame) && !strcmp(set.frames->file + strlen(FOLDER) + 1, name) && set.frames->format == format;
    if (!good) printf("    %s: %s %s\n", frame, set.count ? set.frames->file : "", error);
    olat_free(&set);
    return good && live == 0;
}

static void put_file(const char *name) {
    char path[200];
    snprintf(path, sizeof path, FOLDER "/%s", name);
    FILE *stream = fopen(path, "wb");
    CHECK(stream && fwrite(file, 1, file_size, stream) == file_size && !fclose(stream));
}

static void test_datasets(void) {
    static const char *const others[] = {"r.png", "r.exr", "r.jpg", "r.jpeg", "s.jpg", "t.JPG", "s.jpg.png"};
    const ssdgs_pixels bytes = SSDGS_PIXELS_RGBA8;
    unsigned char white[33 * 21];
    MAKE_FOLDER("build");
    MAKE_FOLDER(FOLDER);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        char path[200];
        snprintf(path, sizeof path, FOLDER "/%s", others[i]);
        remove(path);
    }
    read_seed("base420");
    put_file("r.jpeg");
    CHECK(shows("\"file_path\":\"./r\"", "./r.jpeg", bytes));
    read_seed("p3_turned");
    put_file("r.jpg");
    CHECK(shows("\"file_path\":\"./r\"", "./r.jpg", SSDGS_PIXELS_RGBA16));
    CHECK(shows("\"file_path\":\"r\",\"file_ext\":\".png\"", "r.jpg", SSDGS_PIXELS_RGBA16));
    CHECK(shows("\"file_path\":\"r\",\"file_ext\":\".jpeg\"", "r.jpeg", bytes));
    CHECK(shows("\"file_path\":\"r.jpeg\"", "r.jpeg", bytes) &&
          shows("\"img_path\":\"r.jpeg\"", "r.jpeg", bytes));
    CHECK(shows("\"file_path\":\"r.jpg\",\"file_ext\":\".jpg\"", "r.jpg", SSDGS_PIXELS_RGBA16));
    CHECK(shows("\"file_path\":\"r.jpeg\",\"file_ext\":\".png\"", "r.jpeg", bytes));
    put_file("t.JPG");
    CHECK(shows("\"file_path\":\"t.JPG\"", "t.JPG", SSDGS_PIXELS_RGBA16));
    CHECK(shows("\"file_path\":\"t\",\"file_ext\":\".JPG\"", "t.JPG", SSDGS_PIXELS_RGBA16));
    CHECK(!loads("\"file_path\":\"r\",\"file_ext\":\"jpg\"") &&
          strstr(error, "file_ext: \".png\", \".jpg\" or \".exr\" was expected"));
    CHECK(!loads("\"file_path\":\"r\",\"file_ext\":\"\"") && strstr(error, "was expected"));
    CHECK(!loads("\"file_path\":\"none\"") && strstr(error, "none.png: cannot be opened"));
    CHECK(!loads("\"file_path\":\"none.jpg\"") && strstr(error, "none.jpg: cannot be opened"));
    memset(white, 255, sizeof white); /* of all the usual kind is taken */
    CHECK(!olat_write_png(FOLDER "/r.png", 33, 21, 1, white, error) &&
          shows("\"file_path\":\"r\"", "r.png", bytes));
    file_size = 50;
    put_file("s.jpg");
    CHECK(!loads("\"file_path\":\"s.jpg\"") && strstr(error, "s.jpg: byte ") &&
          strstr(error, "the file ends early"));
    CHECK(!olat_write_png(FOLDER "/s.jpg.png", 33, 21, 1, white, error));
    CHECK(shows("\"file_path\":\"s.jpg\",\"file_ext\":\".png\"", "s.jpg.png", bytes));
    /* as a mask: what is bright is kept */
    read_seed("grey");
    put_file("s.jpg");
    if (CHECK(loads("\"file_path\":\"r\",\"mask_path\":\"s.jpg\""))) {
        const unsigned char *pixels = (const unsigned char *)set.frames->pixels;
        int wrong = 0;
        for (int i = 0; i < 33 * 21; i++) wrong += pixels[4 * i + 3] != golden[7][3 * i];
        CHECK(!wrong && !strcmp(set.notes, "masks of 1 of the 1 photographs are used"));
    }
    olat_free(&set);
    CHECK(live == 0);
}

int main(void) {
    read_golden();
    test_numbers();
    test_segments();
    test_refusals();
    test_damage();
    test_memory();
    test_told();
    test_adobe_rgb();
    test_datasets();
    TEST_END();
}
