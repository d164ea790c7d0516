/* colmap.h - reads what COLMAP found: cameras, images, points3D. MIT, see ssdgs.h.

   #include "ssdgs.h"
   #include "colmap.h"
   ...
   colmap_model model; char error[512];
   if (colmap_load("sparse/0", &model, error)) { puts(error); return 1; }
   ... model.images[0 .. model.image_count), by name ...  colmap_free(&model);

   READS  .bin where a folder has them, else .txt: cameras, images, and points3D where they are there. Of
   images' observations nothing is kept: points know who saw them. Cameras: SIMPLE_PINHOLE, PINHOLE,
   SIMPLE_RADIAL, RADIAL, OPENCV, OPENCV_FISHEYE, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE.

   COORDINATES  COLMAP's own. An image's rotation and translation take the world to its camera: x right, y
   down, z ahead, as ssdgs_camera.view has them. Pixels are counted from the upper left corner.

   ERRORS  Functions return 0, or 1 and one message that names the file and the line or byte. Nothing is kept.

   HOSTILE  Every byte may be wrong. Counts are believed only as far as the file is long. */

#ifndef OLAT_COLMAP_H
#define OLAT_COLMAP_H

#include "olat.h"

typedef struct colmap_image {
    int id, camera; /* an index */
    double rotation[9], translation[3];
    char *name; /* below the folder of photographs, with / */
} colmap_image;

typedef struct colmap_point {
    double place[3];
    unsigned char color[3]; /* sRGB */
    int track, seen;        /* of tracks: from here on so many images */
} colmap_point;

typedef struct colmap_model {
    olat_lens *cameras;
    int *camera_ids;
    colmap_image *images; /* by name */
    colmap_point *points;
    int *tracks; /* images' indices */
    int camera_count, image_count, point_count, track_count;
} colmap_model;

/* ==== a file of records, as text or binary: after a failure all is 0 ==== */

typedef struct colmap__file {
    const char *path;
    unsigned char *bytes;
    size_t size, at, line_end; /* line_end: of text: where the line ends that is read */
    uint64_t left;             /* of binary: how many records are to come */
    int binary, line, failed;
    char *error;
} colmap__file;

OLAT__PRINTF(2, 3) static int colmap__bad(colmap__file *f, const char *format, ...) {
    if (f->failed) return 0;
    char what[240];
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    f->failed = f->binary ? olat__fail(f->error, "%s: at byte %lu: %s", olat__tail(f->path),
                                       (unsigned long)f->at, what)
                          : olat__fail(f->error, "%s: line %d: %s", olat__tail(f->path), f->line, what);
    return 0;
}

/* So many bytes of a binary file as a number, little-endian. */
static uint64_t colmap__bytes(colmap__file *f, int count) {
    uint64_t value = 0;
    if (!f->failed && f->size - f->at < (size_t)count) colmap__bad(f, "the file is cut short");
    for (int i = count; i-- > 0 && !f->failed;) value = value << 8 | f->bytes[f->at + (size_t)i];
    if (!f->failed) f->at += (size_t)count;
    return value;
}

/* Goes to the line's next word; 0 if there is none. */
static int colmap__word(colmap__file *f) {
    while (f->at < f->line_end && strchr(" \t\r", f->bytes[f->at])) f->at++;
    return !f->failed && f->at < f->line_end;
}

/* Begins a line of text; 0 if there is none. */
static int colmap__line(colmap__file *f) {
    if (f->failed || f->at >= f->size) return 0;
    const unsigned char *end = (const unsigned char *)memchr(f->bytes + f->at, '\n', f->size - f->at);
    f->line_end = end ? (size_t)(end - f->bytes) : f->size;
    f->line++;
    return 1;
}

static void colmap__end_line(colmap__file *f) {
    if (colmap__word(f)) colmap__bad(f, "the line goes on where it should end");
    f->at = f->line_end + (f->line_end < f->size);
}

/* Passes over a number that is not used, whatever it is. */
static void colmap__skip(colmap__file *f) {
    if (f->binary) (void)colmap__bytes(f, 8);
    else if (!colmap__word(f)) colmap__bad(f, "a number was expected");
    while (!f->binary && f->at < f->line_end && !strchr(" \t\r", f->bytes[f->at])) f->at++;
}

/* A number of text, or the 8 bytes of a double. */
static double colmap__real(colmap__file *f) {
    double value = 0;
    if (f->binary) {
        const uint64_t bits = colmap__bytes(f, 8);
        memcpy(&value, &bits, sizeof value);
        if ((bits >> 52 & 0x7FF) == 0x7FF) value = 1e300; /* -ffast-math compares NaN as a number */
    } else if (!f->failed) {
        const char *text = (const char *)f->bytes + f->at;
        size_t used = colmap__word(f) ? olat__parse_number(text = (const char *)f->bytes + f->at, &value) : 0;
        if (used && !strchr(" \t\r\n", text[used])) used = 0; /* a NUL ends the file */
        if (!used) return colmap__bad(f, "a number was expected");
        f->at += used;
    }
    if (!(fabs(value) < 1e12)) value = colmap__bad(f, "the number is not finite, or out of range");
    return value;
}

/* A whole number; of binary files so many bytes. */
static int64_t colmap__whole(colmap__file *f, int bytes) {
    const double most = 9007199254740992.0;
    if (f->binary) {
        const uint64_t value = colmap__bytes(f, bytes);
        return value > (uint64_t)most ? -1 : (int64_t)value;
    }
    const double value = colmap__real(f);
    if (!(fabs(value) <= most && floor(value) >= value)) return colmap__bad(f, "a whole number was expected");
    return (int64_t)value;
}

/* Opens folder/name.bin, or .txt. 1: failed, where there must be one, or it cannot be read. */
static int colmap__open(colmap__file *f, const char *folder, const char *name, int optional, char *path,
                        char *error) {
    struct stat there;
    memset(f, 0, sizeof *f);
    f->path = path;
    f->error = error;
    snprintf(path, OLAT__MAX_PATH, "%s/%s.bin", folder, name);
    f->binary = stat(path, &there) == 0;
    if (!f->binary) {
        snprintf(path, OLAT__MAX_PATH, "%s/%s.txt", folder, name);
        if (stat(path, &there) != 0)
            return optional
                       ? 0
                       : olat__fail(error, "%s/%s: there is no .bin and no .txt", olat__tail(folder), name);
    }
    if (olat__read_file(path, &f->bytes, &f->size, error)) return f->failed = 1;
    if (f->binary) f->left = colmap__bytes(f, 8);
    else if (f->size > 2 && !memcmp(f->bytes, "\xEF\xBB\xBF", 3)) f->at = 3; /* an editor's byte order mark */
    return f->failed;
}

/* Whether another record follows; of text, blank lines and comments are passed over. */
static int colmap__next(colmap__file *f) {
    if (f->failed || !f->bytes) return 0;
    if (f->binary) return f->left > 0 && f->left-- > 0;
    while (colmap__line(f)) {
        if (colmap__word(f) && f->bytes[f->at] != '#') return 1;
        f->at = f->line_end + (f->line_end < f->size);
    }
    return 0;
}

/* Makes room for one more of a growing array, whose count is a power of two where it is full. */
static void *colmap__grow(colmap__file *f, void *array, int count, size_t size) {
    if (f->failed || (count & (count - 1)) != 0) return array;
    void *grown = count > 1 << 29 ? NULL : realloc(array, 2 * (size_t)(count ? count : 1) * size);
    if (!grown) f->failed = olat__fail(f->error, "%s: out of memory", olat__tail(f->path));
    return grown ? grown : array;
}

/* ==== the three files ==== */

static void colmap__camera(colmap__file *f, colmap_model *m) {
    enum { MODELS = 11, LENGTHS = 2 };
    /* By COLMAP's numbers: focal lengths, then two of the centre, then k and p; - is not known. */
    static const struct {
        const char *name, *numbers; /* f: of both axes, x y: of one, 0: k1 .. p: p1, q: p2 */
        int fisheye;
    } models[MODELS] = {{"SIMPLE_PINHOLE", "fcd", 0},
                        {"PINHOLE", "xycd", 0},
                        {"SIMPLE_RADIAL", "fcd0", 0},
                        {"RADIAL", "fcd01", 0},
                        {"OPENCV", "xycd01pq", 0},
                        {"OPENCV_FISHEYE", "xycd0123", 1},
                        {"FULL_OPENCV", NULL, 0},
                        {"FOV", NULL, 0},
                        {"SIMPLE_RADIAL_FISHEYE", "fcd0", 1},
                        {"RADIAL_FISHEYE", "fcd01", 1},
                        {"THIN_PRISM_FISHEYE", NULL, 1}};
    olat_lens lens;
    memset(&lens, 0, sizeof lens);
    lens.zoom = 1;
    const int id = (int)colmap__whole(f, 4);
    int model = 0;
    char name[32] = "";
    if (f->binary) model = (int)colmap__whole(f, 4);
    else if (colmap__word(f)) {
        const size_t begin = f->at;
        while (f->at < f->line_end && !strchr(" \t\r", f->bytes[f->at])) f->at++;
        snprintf(name, sizeof name, "%.*s", (int)(f->at - begin < 31 ? f->at - begin : 31), f->bytes + begin);
        while (model < MODELS && strcmp(models[model].name, name) != 0) model++;
    }
    if (f->failed) return;
    if (model < 0 || model >= MODELS || !models[model].numbers) {
        if (model >= 0 && model < MODELS) snprintf(name, sizeof name, "%s", models[model].name);
        else if (f->binary) snprintf(name, sizeof name, "number %d", model);
        colmap__bad(f,
                    "camera model %s is not known here: let COLMAP find the cameras anew with "
                    "--ImageReader.camera_model OPENCV, or OPENCV_FISHEYE",
                    name);
        return;
    }
    const int64_t width = colmap__whole(f, 8), height = colmap__whole(f, 8);
    for (const char *c = models[model].numbers; *c; c++) {
        const double v = colmap__real(f);
        if (*c == 'f') lens.focal[0] = lens.focal[1] = v;
        else if (*c == 'x' || *c == 'y') lens.focal[*c - 'x'] = v;
        else if (*c == 'c' || *c == 'd') lens.centre[*c - 'c'] = v;
        else if (*c == 'p' || *c == 'q') lens.p[*c - 'p'] = v;
        else lens.k[*c - '0'] = v;
    }
    lens.fisheye = models[model].fisheye;
    if (!f->failed && (width < 1 || height < 1 || width > OLAT__MAX_SIDE || height > OLAT__MAX_SIDE))
        colmap__bad(f, "pictures are 1 to 32768 pixels wide and high");
    if (!f->failed && !(lens.focal[0] > 0 && lens.focal[1] > 0))
        colmap__bad(f, "a focal length is not positive");
    lens.width = (int)width;
    lens.height = (int)height;
    m->cameras = (olat_lens *)colmap__grow(f, m->cameras, m->camera_count, sizeof *m->cameras);
    m->camera_ids = (int *)colmap__grow(f, m->camera_ids, m->camera_count, sizeof *m->camera_ids);
    if (f->failed) return;
    m->cameras[m->camera_count] = lens;
    m->camera_ids[m->camera_count++] = id;
}

/* The name is the rest of the line, spaces within belong to it. */
static char *colmap__name(colmap__file *f) {
    if (f->failed || (!f->binary && !colmap__word(f)))
        return colmap__bad(f, "a name was expected"), (char *)0;
    size_t end = f->at;
    const size_t most = f->binary ? f->size : f->line_end;
    while (end < most && f->bytes[end]) end++;
    if (f->binary && end == most) return colmap__bad(f, "the file is cut short"), (char *)0;
    const size_t next = end + (size_t)f->binary;
    while (!f->binary && strchr(" \t\r", f->bytes[end - 1])) end--;
    const size_t length = end - f->at;
    const char *text = (const char *)f->bytes + f->at, *problem = olat__path_problem(text, length, 0);
    char *name = problem ? NULL : (char *)malloc(length + 1);
    if (problem) colmap__bad(f, "a photograph's name: %s", problem);
    else if (!name) f->failed = olat__fail(f->error, "%s: out of memory", olat__tail(f->path));
    if (!name) return NULL;
    memcpy(name, text, length);
    name[length] = 0;
    for (char *c = name; *c; c++)
        if (*c == '\\') *c = '/'; /* models made on Windows */
    f->at = next;
    return name;
}

static void colmap__image(colmap__file *f, colmap_model *m) {
    colmap_image image;
    double q[4], length = 0;
    memset(&image, 0, sizeof image);
    image.id = (int)colmap__whole(f, 4);
    for (int i = 0; i < 4; i++) q[i] = colmap__real(f), length += q[i] * q[i];
    for (int i = 0; i < 3; i++) image.translation[i] = colmap__real(f);
    const int camera = (int)colmap__whole(f, 4);
    if (!f->failed && !(length > 1e-12)) colmap__bad(f, "the quaternion is 0");
    while (!f->failed && image.camera < m->camera_count && m->camera_ids[image.camera] != camera)
        image.camera++;
    if (!f->failed && image.camera == m->camera_count) colmap__bad(f, "there is no camera %d", camera);
    image.name = colmap__name(f);
    uint64_t points = 0;
    if (f->binary) {
        points = colmap__bytes(f, 8);
        if (!f->failed && points > (f->size - f->at) / 24)
            colmap__bad(f, "more points than the file has room for");
        if (!f->failed) f->at += 24 * (size_t)points;
    } else {
        colmap__end_line(f);
        if (colmap__line(f)) /* it may be blank, and the last one missing */
            for (; colmap__word(f); points++) (void)colmap__real(f);
        if (points % 3) colmap__bad(f, "X, Y and POINT3D_ID of each observation were expected");
        if (!f->failed && f->at < f->size) colmap__end_line(f);
    }
    m->images = (colmap_image *)colmap__grow(f, m->images, m->image_count, sizeof *m->images);
    if (f->failed) {
        free(image.name);
        return;
    }
    for (int i = 0; i < 4; i++) q[i] /= sqrt(length);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3; /* q: w, x, y, z */
        image.rotation[4 * i] = 1 - 2 * (q[1 + j] * q[1 + j] + q[1 + k] * q[1 + k]);
        image.rotation[3 * i + j] = 2 * (q[1 + i] * q[1 + j] - q[1 + k] * q[0]);
        image.rotation[3 * j + i] = 2 * (q[1 + i] * q[1 + j] + q[1 + k] * q[0]);
    }
    m->images[m->image_count++] = image;
}

static int colmap__by_name(const void *a, const void *b) {
    return strcmp(((const colmap_image *)a)->name, ((const colmap_image *)b)->name);
}

static int colmap__by_first(const void *a, const void *b) {
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

/* by_id: (image_count, 2) ids and indices, in order. */
static void colmap__point(colmap__file *f, colmap_model *m, const int *by_id) {
    colmap_point point;
    memset(&point, 0, sizeof point);
    (void)colmap__whole(f, 8); /* its id */
    for (int i = 0; i < 3; i++) point.place[i] = colmap__real(f);
    for (int i = 0; i < 3; i++) {
        const int64_t v = colmap__whole(f, 1);
        if (v < 0 || v > 255) colmap__bad(f, "a colour of 0 to 255 was expected");
        point.color[i] = (unsigned char)v;
    }
    colmap__skip(f); /* its error */
    uint64_t left = f->binary ? colmap__bytes(f, 8) : 0;
    if (f->binary && !f->failed && left > (f->size - f->at) / 8)
        colmap__bad(f, "more images than the file has room for");
    point.track = m->track_count;
    while (!f->failed && (f->binary ? left-- > 0 : colmap__word(f))) {
        const int id = (int)colmap__whole(f, 4);
        (void)colmap__whole(f, 4);
        const int *found =
            (const int *)bsearch(&id, by_id, (size_t)m->image_count, 2 * sizeof *by_id, colmap__by_first);
        if (!f->failed && !found) colmap__bad(f, "there is no image %d", id);
        m->tracks = (int *)colmap__grow(f, m->tracks, m->track_count, sizeof *m->tracks);
        if (f->failed) return;
        m->tracks[m->track_count++] = found[1];
    }
    point.seen = m->track_count - point.track;
    if (!f->binary) colmap__end_line(f);
    m->points = (colmap_point *)colmap__grow(f, m->points, m->point_count, sizeof *m->points);
    if (!f->failed) m->points[m->point_count++] = point;
}

/* ==== models ==== */

OLAT__API void colmap_free(colmap_model *m) {
    for (int i = 0; i < m->image_count; i++) free(m->images[i].name);
    free(m->cameras), free(m->camera_ids), free(m->images), free(m->points), free(m->tracks);
    memset(m, 0, sizeof *m);
}

/* Reads a folder's model; without points3D it has none. */
OLAT__API int colmap_load(const char *folder, colmap_model *m, char error[512]) {
    char path[OLAT__MAX_PATH];
    colmap__file f;
    int *by_id = NULL;
    memset(m, 0, sizeof *m);
    int failed = strlen(folder) + 32 > sizeof path &&
                 olat__fail(error, "%s: the path is too long", olat__tail(folder));
    if (!failed) {
        failed = colmap__open(&f, folder, "cameras", 0, path, error);
        while (!failed && colmap__next(&f)) {
            colmap__camera(&f, m);
            if (!f.binary && !f.failed) colmap__end_line(&f);
        }
        failed |= f.failed;
        free(f.bytes);
    }
    if (!failed) {
        failed = colmap__open(&f, folder, "images", 0, path, error);
        while (!failed && colmap__next(&f)) colmap__image(&f, m);
        failed |= f.failed;
        free(f.bytes);
    }
    if (!failed && !m->image_count)
        failed = olat__fail(error, "%s: no image was registered", olat__tail(folder));
    if (!failed) {
        qsort(m->images, (size_t)m->image_count, sizeof *m->images, colmap__by_name);
        by_id = (int *)malloc(2 * (size_t)m->image_count * sizeof *by_id);
        if (!by_id) failed = olat__fail(error, "%s: out of memory", olat__tail(folder));
        for (int i = 0; i < m->image_count && !failed; i++) {
            by_id[2 * i] = m->images[i].id, by_id[2 * i + 1] = i;
            if (i && !strcmp(m->images[i].name, m->images[i - 1].name))
                failed = olat__fail(error, "%s: two images are named %.160s", olat__tail(folder),
                                    m->images[i].name);
        }
    }
    if (!failed) {
        qsort(by_id, (size_t)m->image_count, 2 * sizeof *by_id, colmap__by_first);
        failed = colmap__open(&f, folder, "points3D", 1, path, error);
        while (!failed && colmap__next(&f)) colmap__point(&f, m, by_id);
        failed |= f.failed;
        free(f.bytes);
    }
    free(by_id);
    if (failed) colmap_free(m);
    return failed;
}

/* Where an image's camera stands, or a place beside it, along its own axes: right, up, back. */
OLAT__API void colmap_centre(const colmap_image *image, const double beside[3], double place[3]) {
    for (int i = 0; i < 3; i++) {
        place[i] = 0;
        for (int k = 0; k < 3; k++)
            place[i] += image->rotation[3 * k + i] * ((k ? -beside[k] : beside[k]) - image->translation[k]);
    }
}

#endif /* OLAT_COLMAP_H */
