/* olat.h - reads and writes datasets of photographs under known lights. MIT, see ssdgs.h.

   #include "ssdgs.h"
   #include "olat.h"
   ...
   olat_dataset set; char error[512];
   if (olat_load("scene", "transforms_train.json", 0, &set, error)) { puts(error); return 1; }
   ssdgs_photo *photos = olat_photos(&set);  ... photos[0 .. set.count) ...  free(photos); olat_free(&set);

   KEYS  At the top or in a frame: camera_angle_x camera_angle_y, or camera_intrinsics [cx, cy, fx, fy], or
   fl_x fl_y cx cy w h; k1 .. k4, p1, p2 and camera_model of a lens that bends straight lines, which become
   straight, see lens.h. A frame's key wins over the top's, one for a focal length over all such keys of the
   top. At the top bounds_min and bounds_max, corners of the box that holds the object.

   In frames[]: file_path (+ file_ext) or img_path. mask_path, see MASKS. transform_matrix (camera to world,
   OpenGL axes), or R_opt and T_opt. pl_pos or pl_dir. pl_intensity. pl_mu and pl_axis: an LED, which
   fades as cos^mu of the angle to that axis. pl_lights: where several lights shine, a list of objects with
   pl_ keys.

   Or a frame is a camera's, with lists: light_positions, light_intensities, file_paths, less those that
   exclude_list.txt names.

   IMAGES  PNG, JPEG and OpenEXR as images.h reads them. A name without an ending is .png, else .exr, .jpg or
   .jpeg where there is no such PNG.

   MASKS  Where a mask's alpha varies it is what is kept, of an indexed image with a palette of colours and
   black as index 0 all but that, else what is white. Where no mask of the dataset has a number of 16 or more,
   as 0 1 2 of 255, the numbers are labels: all but 0 is kept. Else, where none has more than 0.6 of white,
   the most that any has keeps all; one dim mask among others stays dim.

   ADAPTED  Coordinates far from 0 become relative to an origin, photographs that say they are not sRGB become
   so, masks become alpha. The dataset's notes say what was done.

   CONTENTS  cameras and lights; paths; masks; photographs and frames; frames of several photographs; loading
   and guarding; saving; what programs do with frames.

   ERRORS  Functions return 0, or 1 and one message that names the file and the key and line, or the byte.
   Nothing is kept.

   HOSTILE  Every byte of a file may be wrong. Image paths reach only regular files below the folder, or
   through its links.

   MEMORY  olat_free frees a dataset: its frames, their pixels, names and lights.

   SYSTEMS  POSIX, MinGW. All functions are static and keep no state. */

#ifndef OLAT_H
#define OLAT_H

#include "files.h"
#include "images.h"
#include "json.h"
#include "lens.h"
#include <math.h>

enum {                     /* flags of olat_load */
       OLAT_NO_IMAGES = 1, /* a trajectory: images are neither needed nor read; sizes are w, h or 256 x 256 */
       OLAT_ALLOW_PARENT = 2 /* image paths may contain ".." */
};
/* Another one: photographs, masks and cameras are made so many times smaller, 1 to 1024. */
#define OLAT_DOWNSCALE(times) ((times) << 8)

enum { OLAT_MOST_LIGHTS = 64 }; /* of a photograph */

typedef struct olat_frame {
    ssdgs_camera camera;
    ssdgs_light light;
    ssdgs_light *more; /* (more_count) those beside it */
    int more_count;
    char *file, *mask; /* folder/path of the image and its mask; NULL if the frame names none */
    void *pixels;      /* (h,w,4) straight alpha, tightly packed; NULL without image */
    ssdgs_pixels format;
    int has_image;
    olat_lens lens; /* of the photograph as its file has it */
} olat_frame;

typedef struct olat_dataset {
    olat_frame *frames;
    int count;
    double origin[3]; /* what positions are relative to, in the dataset's coordinates; 0 unless these lie far
                         away */
    double bounds[2][3]; /* corners of the box that holds the object, in the dataset's coordinates */
    int has_bounds;
    char notes[2048]; /* what was done or may be wrong: lines, the last one without its newline; "" if
                         nothing */
} olat_dataset;

/* Who reads photographs, and hears how many have been read. */
typedef struct olat_reader {
    ssdgs_context *context; /* its threads decode images */
    void (*progress)(void *user, int done, int count);
    void *user;
} olat_reader;

enum { OLAT__MAX_FRAMES = 1 << 20 };

/* An ssdgs_logger for programs: prints the library's notes, of what loading mended for instance, not
   failures, which are told where they end the program. user: the program's name, a string. */
OLAT__API void olat_hear(void *user, ssdgs_result code, const char *message) {
    if (code == SSDGS_OK) fprintf(stderr, "%s: note: %s\n", (const char *)user, message);
}

/* ==== the dataset: after a failure readers return 0 and go on, since only the first one is reported ==== */

/* ---- cameras and lights ---- */

static double olat__dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Reads a matrix of 3 x 3, 3 x 4 or 4 x 4: its columns are a camera's axes and position; 0 if it is absent.
   The axes must be a rotation times a scale, to three decimals, and become exactly a rotation: rounding
   shears no image. */
static int olat__get_pose(olat__json *j, const olat__node *object, const char *key, int any_scale,
                          double axes[3][3], double origin[3]) {
    const olat__node *node = olat__find(j, object, key);
    double scale2 = 1;
    if (!node) return 0;
    const olat__node *row = &j->nodes[node->child];
    const int columns = row->size;
    if (node->type != OLAT__ARRAY || columns < 3 || columns > 4 || node->size < 3 || node->size > columns) {
        return olat__json_fail(j, node, "a matrix of 3 x 3, 3 x 4 or 4 x 4 numbers was expected");
    }
    for (int i = 0; i < node->size; i++, row = &j->nodes[row->next]) {
        double v[4] = {0, 0, 0, 0};
        if (!olat__numbers(j, row, columns, v)) return 0;
        for (int k = 0; k < 3 && i < 3; k++) axes[k][i] = v[k];
        if (i < 3) origin[i] = v[3];
        else if (olat__dot(v, v) > 1e-12 || fabs(v[3] - 1) > 1e-6)
            return olat__json_fail(j, row, "this row must be 0 0 0 1");
    }
    if (any_scale)
        scale2 =
            (olat__dot(axes[0], axes[0]) + olat__dot(axes[1], axes[1]) + olat__dot(axes[2], axes[2])) / 3;
    for (int i = 0; i < 9; i++) {
        if (scale2 > 1e-12 && fabs(olat__dot(axes[i / 3], axes[i % 3]) / scale2 - (i % 4 == 0)) <= 5e-3)
            continue;
        return olat__json_fail(j, node, "the 3 x 3 part is not a rotation%s",
                               any_scale ? " times a scale" : "");
    }
    const double z_length = sqrt(olat__dot(axes[2], axes[2]));
    for (int k = 0; k < 3; k++) axes[2][k] /= z_length;
    const double along = olat__dot(axes[0], axes[2]);
    for (int k = 0; k < 3; k++) axes[0][k] -= along * axes[2][k];
    const double x_length = sqrt(olat__dot(axes[0], axes[0]));
    for (int k = 0; k < 3; k++) axes[0][k] /= x_length;
    double y[3];
    for (int k = 0; k < 3; k++)
        y[k] = axes[2][(k + 1) % 3] * axes[0][(k + 2) % 3] - axes[2][(k + 2) % 3] * axes[0][(k + 1) % 3];
    if (olat__dot(y, axes[1]) < 0)
        return olat__json_fail(j, node, "the matrix mirrors: its determinant is negative");
    memcpy(axes[1], y, sizeof y);
    return 1;
}

typedef struct olat__lens {
    double focal[4], centre[2]; /* focal lengths of x and y, then angles of view; 0 = not given */
    int w, h, has_centre;
    olat_lens bend; /* its k, p, fisheye */
} olat__lens;

/* Reads how the lens bends, and refuses models that are not known by any coefficient that is not 0. */
static void olat__read_bend(olat__json *j, const olat__node *object, olat_lens *bend) {
    enum { FISHEYES = 7, MODELS = 11 };
    static const char *const models[MODELS] = {
        "pinhole",        "simple_pinhole",        "perspective",   "opencv",
        "full_opencv",    "simple_radial",         "radial",        "fisheye",
        "opencv_fisheye", "simple_radial_fisheye", "radial_fisheye"};
    static const char *const known[7] = {"k1", "k2", "k3", "k4", "p1", "p2", "is_fisheye"};
    static const char others[] = "k5 k6 k7 k8 k9 p3 p4 p5 p6 p7 p8 p9 s1 s2 s3 s4 s5 s6 s7 s8 s9 b1 b2 skew "
                                 "ftheta_p0 ftheta_p1 ftheta_p2 ftheta_p3 ftheta_p4 distortion "
                                 "distortion_params distortion_coefficients rolling_shutter ";
    const olat__node *model = olat__find(j, object, "camera_model"), *wrong = NULL;
    for (int i = 0; i < 6; i++) {
        const olat__node *node = olat__find(j, object, known[i]);
        if (node && olat__nonzero(j, node))
            olat__numbers(j, node, 1, i < 4 ? bend->k + i : bend->p + (i - 4));
    }
    const olat__node *fisheye = olat__find(j, object, known[6]);
    if (fisheye) bend->fisheye = olat__nonzero(j, fisheye);
    if (model && olat__nonzero(j, model)) {
        int m = 0;
        while (m < MODELS && !(model->type == OLAT__STRING && olat__is_word(model, models[m]))) m++;
        if (m == MODELS) wrong = model;
        else bend->fisheye = m >= FISHEYES;
    }
    for (const char *word = others; *word && !wrong; word = strchr(word, ' ') + 1) {
        char key[32];
        snprintf(key, sizeof key, "%.*s", (int)strcspn(word, " "), word);
        const olat__node *node = olat__find(j, object, key);
        if (node && olat__nonzero(j, node)) wrong = node;
    }
    const int beyond = bend->fisheye ? fabs(bend->p[0]) > 0 || fabs(bend->p[1]) > 0 : fabs(bend->k[3]) > 0;
    const olat__node *key = olat__find(j, object, bend->fisheye ? fabs(bend->p[0]) > 0 ? "p1" : "p2" : "k4");
    if (beyond && !wrong) wrong = key ? key : object;
    if (!wrong) return;
    const char *value = wrong->type == OLAT__STRING ? wrong->text : wrong->type == OLAT__TRUE ? "true" : "";
    olat__json_fail(
        j, wrong,
        "%.40s%sthis lens is not supported: OpenCV's k1, k2, k3, p1, p2 are, and its fisheye's k1 .. "
        "k4. Undistort the images first, with COLMAP's image_undistorter, say",
        value, value[0] ? ": " : "");
}

/* Reads what the object says about the lens over what is there already. */
static void olat__read_lens(olat__json *j, const olat__node *object, olat__lens *lens) {
    static const char *const focal[4] = {"fl_x", "fl_y", "camera_angle_x", "camera_angle_y"};
    double v[4] = {0, 0, 0, 0};
    int given = 0;
    olat__read_bend(j, object, &lens->bend);
    for (int i = 0; i < 2; i++) {
        const char *key = i ? "h" : "w";
        double side;
        if (!olat__get(j, object, key, 1, &side)) continue;
        if (!(side >= 1 && side <= 32768 && floor(side) >= side))
            olat__json_fail(j, object, "%s is not 1 to 32768", key);
        else if (i) lens->h = (int)side;
        else lens->w = (int)side;
    }
    for (int i = 0; i < 4; i++) {
        if (!olat__get(j, object, focal[i], 1, &v[i])) continue;
        given = 1;
        if (i < 2 && !(v[i] > 0)) olat__json_fail(j, object, "%s is not positive", focal[i]);
        if (i > 1 && !(v[i] > 1e-4 && v[i] < 3.14))
            olat__json_fail(j, object, "%s is not between 0 and pi", focal[i]);
    }
    if (given) memcpy(lens->focal, v, sizeof v); /* a frame's camera is another one than the top's */
    int has_cx = olat__get(j, object, "cx", 1, &lens->centre[0]);
    const int has_cy = olat__get(j, object, "cy", 1, &lens->centre[1]);
    if (has_cx != has_cy) olat__json_fail(j, object, "cx and cy come in pairs");
    if (olat__get(j, object, "camera_intrinsics", 4, v)) {
        if (!(v[2] > 0 && v[3] > 0))
            olat__json_fail(j, object, "camera_intrinsics: focal lengths must be positive");
        memcpy(lens->centre, v, 2 * sizeof *v);
        memcpy(lens->focal, v + 2, 2 * sizeof *v);
        has_cx = 1;
    }
    lens->has_centre |= has_cx;
}

/* The frame's pose as a view matrix in our axes, of coordinates relative to origin. */
static void olat__read_pose(olat__json *j, const olat__node *node, const double origin[3], double view[12]) {
    double axes[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, place[3] = {0, 0, 0}, t[3] = {0, 0, 0};
    int refined = olat__find(j, node, "R_opt") != NULL;
    if (refined) {
        olat__get_pose(j, node, "R_opt", 0, axes, place);
        if (!olat__get(j, node, "T_opt", 3, t)) olat__json_fail(j, node, "T_opt is missing");
    } else if (!olat__get_pose(j, node, "transform_matrix", 1, axes, place)) {
        olat__json_fail(j, node, "transform_matrix or R_opt is missing");
    }
    for (int i = 0; i < 3; i++) place[i] -= origin[i];
    for (int i = 0; i < 3; i++) { /* transform_matrix has y up and z backward, R_opt has our axes */
        const double sign = i > 0 && !refined ? -1 : 1;
        for (int k = 0; k < 3; k++) {
            view[4 * i + k] = sign * axes[i][k];
            if (fabs(origin[k]) > 0) t[i] += axes[i][k] * origin[k];
        }
        view[4 * i + 3] = refined ? t[i] : -sign * olat__dot(axes[i], place);
    }
}

/* How many lights a frame has, or one too many, and the node that says what light number `at` is. */
static int olat__light_count(const olat__json *j, const olat__node *frame) {
    const olat__node *lights = olat__find(j, frame, "pl_lights");
    if (!lights) return 1;
    if (lights->type != OLAT__ARRAY) return 0;
    return lights->size < OLAT_MOST_LIGHTS ? lights->size
                                           : OLAT_MOST_LIGHTS + (lights->size > OLAT_MOST_LIGHTS);
}

static const olat__node *olat__light_node(const olat__json *j, const olat__node *frame, int at) {
    const olat__node *lights = olat__find(j, frame, "pl_lights");
    if (!lights) return frame;
    const olat__node *node = &j->nodes[lights->child];
    while (at-- > 0) node = &j->nodes[node->next];
    return node;
}

/* What the frames' positions had better be relative to: where cameras and point lights lie too far away for
   floats to tell them apart, their mean, rounded so that floats hold it; else 0. Cameras in one place do not
   tell how large the scene is: they must be further away than millimetres can explain. What is wrong with a
   frame is told when it is read. */
static void olat__find_origin(olat__json *j, const olat__node *frames, double origin[3]) {
    double sum[3] = {0, 0, 0}, mean[3] = {0, 0, 0}, radius = 0;
    int places = 0;
    for (int turn = 0; turn < 2; turn++) {
        const olat__node *node = &j->nodes[frames->child];
        for (int i = 0; i < frames->size && !j->failed; i++, node = &j->nodes[node->next])
            for (int light = 0; light <= olat__light_count(j, node); light++) {
                double place[3] = {0, 0, 0};
                if (light && !olat__get(j, olat__light_node(j, node, light - 1), "pl_pos", 3, place))
                    continue;
                double view[12];
                if (!light) olat__read_pose(j, node, mean, view);
                for (int k = 0; k < 3; k++) {
                    if (light) place[k] -= mean[k];
                    else place[k] = -(view[k] * view[3] + view[4 + k] * view[7] + view[8 + k] * view[11]);
                    sum[k] += place[k];
                }
                places += turn == 0;
                const double length = sqrt(olat__dot(place, place));
                if (turn == 1 && length > radius) radius = length;
            }
        for (int k = 0; k < 3 && turn == 0; k++) mean[k] = sum[k] / (places ? places : 1);
    }
    const double length = sqrt(olat__dot(mean, mean));
    for (int k = 0; k < 3; k++)
        origin[k] = length > 64 * radius && length > 1000 && !j->failed ? (double)(float)mean[k] : 0;
    j->failed = 0;
}

/* The lens of a photograph of so many pixels; 0 unless the two belong together. */
static int olat__lens_of(const olat__lens *lens, int width, int height, olat_lens *out) {
    const double size[2] = {(double)width, (double)height};
    double focal[2];
    for (int i = 0; i < 2; i++) {
        const double angle = lens->focal[2 + i];
        focal[i] = lens->focal[i] > 0 ? lens->focal[i] : angle > 0 ? 0.5 * size[i] / tan(0.5 * angle) : 0;
    }
    *out = lens->bend;
    out->width = width;
    out->height = height;
    for (int i = 0; i < 2; i++) { /* pixels are square where one is not given */
        out->focal[i] = focal[i] > 0 ? focal[i] : focal[!i];
        out->centre[i] = lens->has_centre ? lens->centre[i] : 0.5 * size[i];
    }
    const int in_pixels = lens->focal[0] > 0 || lens->focal[1] > 0 || lens->has_centre;
    return in_pixels ? (!lens->w || lens->w == width) && (!lens->h || lens->h == height)
                     : !lens->w || !lens->h || /* an angle allows another size alone */
                           fabs(size[0] * lens->h - size[1] * lens->w) <= fmax(size[0], size[1]);
}

/* Fills the frame's camera from its lens and its pose. */
static void olat__read_camera(olat__json *j, const olat__node *node, const olat__lens *lens,
                              const double origin[3], int downscale, olat_frame *frame) {
    ssdgs_camera *camera = &frame->camera;
    olat_lens *of = &frame->lens;
    const int width = of->width, height = of->height, fits = olat__lens_of(lens, width, height, of);
    if (!fits)
        olat__json_fail(j, node, "the image has %d x %d pixels, not w x h%s%s", width, height,
                        frame->file ? ": " : "", frame->file ? olat__tail(frame->file) : "");
    else if (!(of->focal[0] > 0))
        olat__json_fail(j, node, "camera_angle_x, camera_intrinsics or fl_x is missing");
    else if (!olat_lens_zoom(of))
        olat__json_fail(j, node, "the lens's centre or k1 .. p2 leave no picture: are they of this camera?");
    else if (width < downscale || height < downscale)
        olat__json_fail(j, node, "%d x %d pixels are too few to be made %d times smaller", width, height,
                        downscale);
    if (j->failed) return;
    camera->width = width / downscale;
    camera->height = height / downscale;
    camera->fx = (ssdgs_real)(of->zoom * of->focal[0] / downscale);
    camera->fy = (ssdgs_real)(of->zoom * of->focal[1] / downscale);
    camera->cx = (ssdgs_real)(of->centre[0] / downscale);
    camera->cy = (ssdgs_real)(of->centre[1] / downscale);
    double view[12];
    olat__read_pose(j, node, origin, view);
    for (int i = 0; i < 12; i++) camera->view[i] = (ssdgs_real)view[i];
}

static void olat__read_light(olat__json *j, const olat__node *node, const double origin[3],
                             ssdgs_light *light) {
    const olat__node *intensity = olat__find(j, node, "pl_intensity");
    double v[3] = {0, 0, 0}, rgb[3] = {1, 1, 1}, length = 1;
    int is_point = olat__get(j, node, "pl_pos", 3, v), is_far = olat__get(j, node, "pl_dir", 3, v);
    if (is_point == is_far)
        olat__json_fail(j, node, is_far ? "both pl_pos and pl_dir" : "pl_pos or pl_dir is missing");
    if (is_far) length = sqrt(olat__dot(v, v));
    if (!(fabs(length - 1) < 1e-2)) olat__json_fail(j, node, "pl_dir is not a unit vector");
    if (intensity && intensity->type == OLAT__ARRAY && intensity->size != 1)
        olat__numbers(j, intensity, 3, rgb);
    else if (intensity && olat__numbers(j, intensity, 1, rgb)) rgb[1] = rgb[2] = rgb[0];
    if (rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0) olat__json_fail(j, intensity, "an intensity is negative");
    double mu = 0, axis[3] = {0, 0, 0};
    if (olat__get(j, node, "pl_mu", 1, &mu) && mu != 0) {
        if (!is_point || !(mu > 0 && mu <= 1000))
            olat__json_fail(j, node, is_point ? "pl_mu is not in 0 .. 1000" : "pl_mu goes with pl_pos");
        length = olat__get(j, node, "pl_axis", 3, axis) ? sqrt(olat__dot(axis, axis)) : 0;
        if (!(fabs(length - 1) < 1e-2)) olat__json_fail(j, node, "pl_mu needs pl_axis, a unit vector");
    }
    light->focus = (ssdgs_real)mu;
    light->kind = is_far ? SSDGS_LIGHT_DIRECTIONAL : SSDGS_LIGHT_POINT;
    for (int i = 0; i < 3 && !j->failed; i++) {
        light->position[i] = (ssdgs_real)(is_far ? 0 : v[i] - origin[i]);
        light->direction[i] = (ssdgs_real)((is_far ? -v[i] : axis[i]) / length);
        light->intensity[i] = (ssdgs_real)rgb[i];
    }
}

/* All of a frame's. */
static void olat__read_lights(olat__json *j, const olat__node *node, const double origin[3],
                              olat_frame *frame) {
    const int count = olat__light_count(j, node);
    if (count < 1 || count > OLAT_MOST_LIGHTS)
        olat__json_fail(j, olat__find(j, node, "pl_lights"), "a list of 1 to %d lights was expected",
                        OLAT_MOST_LIGHTS);
    if (count > 1 && !j->failed) {
        frame->more = (ssdgs_light *)calloc((size_t)count - 1, sizeof *frame->more);
        if (frame->more) frame->more_count = count - 1;
        else olat__json_fail(j, node, "out of memory");
    }
    static const char *const own[5] = {"pl_pos", "pl_dir", "pl_intensity", "pl_mu", "pl_axis"};
    for (int i = 0; i < 5 && olat__find(j, node, "pl_lights"); i++) {
        const olat__node *key = olat__find(j, node, own[i]);
        if (key) olat__json_fail(j, key, "beside pl_lights: each light there has its own");
    }
    for (int i = 0; i < count && !j->failed; i++) {
        const olat__node *light = olat__light_node(j, node, i);
        if (light->type != OLAT__OBJECT) olat__json_fail(j, light, "an object was expected");
        else olat__read_light(j, light, origin, i ? frame->more + i - 1 : &frame->light);
    }
}

/* ---- paths ---- */

/* What is wrong with a path out of a file, on any system; NULL if nothing. */
static const char *olat__path_problem(const char *path, size_t length, int allow_parent) {
    static const char *const devices[] = {"con", "prn", "aux", "nul", "com", "lpt"};
    if (length == 0 || length > OLAT__MAX_PATH) return length ? "the path is too long" : "the path is empty";
    if (path[0] == '/' || path[0] == '\\' || (length > 1 && path[1] == ':'))
        return "the path is not relative";
    for (size_t i = 0; i < length; i++) {
        if ((unsigned char)path[i] < 32 || path[i] == 127) return "the path holds a control character";
    }
    size_t end;
    for (size_t start = 0; start <= length; start = end + 1) {
        const char *name = path + start;
        for (end = start; end < length && path[end] != '/' && path[end] != '\\'; end++) {}
        if (end == start) return "the path holds an empty name";
        if (end - start == 1 && name[0] == '.') continue;
        if (end - start == 2 && name[0] == '.' && name[1] == '.') {
            if (!allow_parent) return "the path leaves the folder by '..'";
            continue;
        }
        if (path[end - 1] == '.' || path[end - 1] == ' ')
            return "a name in the path ends in a dot or a space";
        size_t stem;
        for (stem = 0; stem < end - start && name[stem] != '.'; stem++) {}
        for (size_t d = 0; d < 6; d++) { /* com and lpt take a digit */
            if (stem != (d < 4 ? 3 : 4) || !olat__same_letters(name, devices[d], 3)) continue;
            if (d < 4 || (name[3] >= '1' && name[3] <= '9')) return "the path names a device";
        }
    }
    return NULL;
}

/* Of images that can be read, in the order in which they are looked for. */
static const char *const olat__endings[4] = {".png", ".exr", ".jpg", ".jpeg"};

/* Refuses a name that ends as those of another kind of image do; 1 if it does. */
static int olat__other_image(olat__json *j, const olat__node *name) {
    static const char *const kinds[][2] = {
        {".webp", "WebP"}, {".hdr", "Radiance HDR"}, {".tif", "TIFF"},  {".tiff", "TIFF"}, {".bmp", "BMP"},
        {".gif", "GIF"},   {".heic", "HEIC"},        {".avif", "AVIF"}, {".dng", "DNG"},   {".ppm", "PPM"}};
    const size_t size = name->text_length;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        const size_t length = strlen(kinds[i][0]);
        if (size < length || !olat__same_letters(name->text + size - length, kinds[i][0], length)) continue;
        olat__json_fail(
            j, name,
            "%s: %s images cannot be read: convert them to PNG or OpenEXR, for instance with: mogrify -format"
            " png *%s, and name those here",
            name->text + (size > 60 ? size - 60 : 0), kinds[i][1], kinds[i][0]);
        return 1;
    }
    return 0;
}

/* Which of them a name has; NULL: none. */
static const char *olat__ending(const olat__node *name) {
    for (int i = 0; i < 4; i++) {
        const size_t length = strlen(olat__endings[i]), size = name->text_length;
        if (size >= length && olat__same_letters(name->text + size - length, olat__endings[i], length))
            return olat__endings[i];
    }
    return NULL;
}

/* Checks a path out of the file and joins it to the folder. One that is not whole gets ext, else ".png", if
   it has no ending or a file of both is there; without ext, or with ".png", where there is no such file but
   one of another ending, that is meant. NULL after a failure. */
static char *olat__join(olat__json *j, const char *folder, const olat__node *path, const olat__node *ext,
                        int whole, int flags) {
    const char *problem, *suffix = ext ? ext->text : ".png";
    const size_t used = strlen(folder);
    if (path->type != OLAT__STRING) olat__json_fail(j, path, "a string was expected");
    else if ((problem = olat__path_problem(path->text, path->text_length, flags & OLAT_ALLOW_PARENT)) !=
             NULL) {
        olat__json_fail(j, path, "%s", problem);
    }
    if (j->failed || (!ext && !(flags & OLAT_NO_IMAGES) && olat__other_image(j, path))) return NULL;
    const char *own = olat__ending(path);
    if (whole || (own && (!ext || own == olat__ending(ext)))) suffix = "";
    const size_t room = used + path->text_length + 8;
    char *file;
    if ((file = (char *)malloc(room)) == NULL) {
        olat__json_fail(j, path, "out of memory");
        return NULL;
    }
    struct stat there;
    snprintf(file, room, "%s%s%s%s", folder, used ? "/" : "", path->text, suffix);
    for (size_t i = used; file[i]; i++) {
        if (file[i] == '\\') file[i] = '/'; /* datasets made on Windows */
    }
    char *ending = file + strlen(file) - strlen(suffix);
    const int searches = !own && !strcmp(suffix, ".png");
    for (int i = 1; i <= 4 && searches && stat(file, &there) != 0; i++) strcpy(ending, olat__endings[i % 4]);
    if (own && stat(file, &there) != 0) *ending = 0;
    return file;
}

/* The paths of the frame's image and mask; NULL where it names none. */
static void olat__read_paths(olat__json *j, const olat__node *node, const char *folder, int flags,
                             char **file, char **mask) {
    const olat__node *whole = olat__find(j, node, "img_path"),
                     *path = whole ? whole : olat__find(j, node, "file_path");
    const olat__node *ext = whole ? NULL : olat__find(j, node, "file_ext"),
                     *of_mask = olat__find(j, node, "mask_path");
    if (!path && !(flags & OLAT_NO_IMAGES)) olat__json_fail(j, node, "file_path or img_path is missing");
    const char *ending = ext && ext->type == OLAT__STRING ? olat__ending(ext) : NULL;
    if (path && ext && (!ending || strlen(ending) != ext->text_length) &&
        (ext->type != OLAT__STRING || !olat__other_image(j, ext))) {
        olat__json_fail(j, ext, "\".png\", \".jpg\" or \".exr\" was expected: other images cannot be read");
    }
    if (path) *file = olat__join(j, folder, path, ext, whole != NULL, flags);
    if (of_mask && of_mask->type != OLAT__NULL) *mask = olat__join(j, folder, of_mask, NULL, 0, flags);
}

/* ---- masks ---- */

/* A number of a mask, words for light. */
static unsigned olat__mask_sample(const void *mask, ssdgs_pixels format, size_t i) {
    if (!olat__is_light(format)) return olat__sample(mask, format, i);
    const ssdgs_real v = olat__number(mask, format, i);
    return (unsigned)(65535 * (v < 1 ? v : 1) + (ssdgs_real)0.5);
}

/* Multiplies the photograph's alpha by its mask: by alpha where that varies, else by brightness. white: what
   keeps all, of 1; 0 where that is not known yet: then masks without anything bright wait. */
static int olat__apply_mask(olat_frame *frame, double white, olat__found *found, char *error) {
    const int w = frame->camera.width, h = frame->camera.height;
    const size_t pixels = (size_t)w * (size_t)h;
    const unsigned long broken = found->broken;
    const int told = found->count;
    int width, height, varies = 0;
    ssdgs_pixels format;
    char problem[512];
    void *mask;
    if (olat__image_file(frame->mask, 1, &width, &height, &format, &mask, found, problem)) {
        return olat__fail(error, "mask_path: %s", problem);
    }
    if (width != w || height != h) {
        free(mask);
        return olat__fail(error,
                          "%s: the mask has %d x %d pixels, its photograph %d x %d: make them the same size",
                          olat__tail(frame->mask), width, height, w, h);
    }
    const unsigned top = format == SSDGS_PIXELS_RGBA8 ? 255 : 65535;
    uint32_t *values = (uint32_t *)malloc(pixels * sizeof *values), largest = 0;
    if (!values) {
        free(mask);
        return olat__fail(error, "%s: out of memory", olat__tail(frame->mask));
    }
    for (size_t i = 0; i < pixels; i++)
        varies |= olat__mask_sample(mask, format, 4 * i + 3) != olat__mask_sample(mask, format, 3);
    for (size_t i = 0; i < pixels; i++) {
        values[i] = varies ? top : 0;
        for (size_t c = 0; c < 3 && !varies; c++) {
            const unsigned v = olat__mask_sample(mask, format, 4 * i + c);
            if (v > values[i]) values[i] = v;
        }
        values[i] *= olat__mask_sample(mask, format, 4 * i + 3);
        if (values[i] > largest) largest = values[i];
    }
    free(mask);
    uint64_t one = (uint64_t)top * top, smallest = one;
    found->largest = (double)largest / (double)one;
    found->number = olat__is_light(format) ? top : largest / top;
    found->waits = !(white > 0) && found->largest <= 0.6;
    if (white > 0) one = (uint64_t)fmax(white * (double)one + 0.5, 1);
    double border = 0, middle = 0, of_border = 0, of_middle = 0;
    for (size_t i = 0; i < pixels && !found->waits; i++) {
        const int x = (int)(i % (size_t)w), y = (int)(i / (size_t)w);
        const uint64_t value = values[i] < one ? values[i] : one;
        if (value < smallest) smallest = value;
        if (x == 0 || y == 0 || x == w - 1 || y == h - 1) border += (double)value, of_border++;
        if (x >= w / 3 && x < w - w / 3 && y >= h / 3 && y < h - h / 3) middle += (double)value, of_middle++;
        if (olat__is_light(frame->format)) {
            const float alpha =
                (float)olat__number(frame->pixels, frame->format, 4 * i + 3) * (float)value / (float)one;
            if (frame->format == SSDGS_PIXELS_RGBA32F) ((float *)frame->pixels)[4 * i + 3] = alpha;
            else ((uint16_t *)frame->pixels)[4 * i + 3] = olat__to_half(alpha);
            continue;
        }
        const uint64_t alpha =
            (olat__sample(frame->pixels, frame->format, 4 * i + 3) * value + one / 2) / one;
        if (frame->format == SSDGS_PIXELS_RGBA16) ((uint16_t *)frame->pixels)[4 * i + 3] = (uint16_t)alpha;
        else ((unsigned char *)frame->pixels)[4 * i + 3] = (unsigned char)alpha;
    }
    free(values);
    if (found->waits) { /* what there is to say is said then */
        found->broken = broken;
        found->count = told;
        return 0;
    }
    found->inverted = border > 0.9 * of_border * (double)one && middle < 0.7 * of_middle * (double)one;
    if (!largest) olat__tell(found, OLAT__OF_MASK | OLAT__NAMED, "black everywhere: nothing is kept");
    else if (smallest == one) olat__tell(found, OLAT__OF_MASK | OLAT__NAMED, "white everywhere: all is kept");
    else if (found->largest <= 0.6 && !(white < 1))
        olat__tell(found, OLAT__OF_MASK | OLAT__NAMED,
                   "of no more than 0.6 of white, where others have more: used as stored");
    return 0;
}

/* ---- photographs and frames ---- */

/* Adds a line to the notes. */
OLAT__PRINTF(2, 3) static void olat__note(olat_dataset *set, const char *format, ...) {
    const size_t used = strlen(set->notes), more = used > 0 && used + 1 < sizeof set->notes;
    if (more) set->notes[used] = '\n';
    va_list list;
    va_start(list, format);
    vsnprintf(set->notes + used + more, sizeof set->notes - used - more, format, list);
    va_end(list);
}

/* A side of an image not read: twice its middle, 0 = not given. */
static int olat__side(double middle) {
    return middle >= 0.5 && middle <= 16384 ? (int)(2 * middle + 0.5) : 256;
}

/* Photographs being read, on any threads. */
typedef struct olat__reading {
    olat_frame *frames;       /* those at hand */
    const olat__lens *lenses; /* what the list says of them */
    olat__found *found;       /* what was found in each */
    char *waits;              /* of all: its mask waits until all have been seen */
    double white;             /* then what keeps all, of 1; before 0 */
    int downscale;
} olat__reading;

/* What all photographs have in common. */
typedef struct olat__tally {
    olat__remark remark;
    int count, first[3]; /* how many, frames */
} olat__tally;
enum { OLAT__TALLIES = 12 };
typedef struct olat__seen {
    olat__tally tallies[OLAT__TALLIES];
    int count, masks, inverted, more; /* more: what had no place in tallies */
    unsigned long broken;
    double largest;  /* of all masks, of 1 */
    unsigned number; /* the same as stored */
} olat__seen;

static void olat__see(olat__seen *seen, const olat__found *found, int frame) {
    for (int i = 0; i < found->count; i++) {
        const olat__remark *remark = found->remarks + i;
        int k = 0;
        while (k < seen->count && strcmp(seen->tallies[k].remark.text, remark->text) != 0) k++;
        if (k == OLAT__TALLIES) {
            seen->more++;
            continue;
        }
        olat__tally *tally = seen->tallies + k;
        if (k == seen->count) seen->count++, tally->remark = *remark;
        if (tally->count < 3) tally->first[tally->count] = frame;
        tally->count++;
    }
    seen->inverted += found->inverted;
    seen->broken += found->broken;
    if (found->largest > seen->largest) seen->largest = found->largest;
    if (found->number > seen->number) seen->number = found->number;
}

/* The photograph, which has its mask, as it is used: without the lens's bending, and smaller. What is wrong
   with the lens is told when the camera is read. */
static int olat__reshape(const olat__reading *r, int i, olat__found *found, char *error) {
    olat_frame *frame = r->frames + i;
    olat_lens *lens = &frame->lens;
    const int fits = olat__lens_of(r->lenses + i, frame->camera.width, frame->camera.height, lens),
              bends = olat_lens_bends(lens);
    if (!fits || !(lens->focal[0] > 0) || !olat_lens_zoom(lens) || lens->width < r->downscale ||
        lens->height < r->downscale || (!bends && r->downscale == 1))
        return 0;
    void *reshaped = olat_resample(frame->pixels, frame->format, lens, r->downscale);
    if (!reshaped) return olat__fail(error, "%s: out of memory", olat__tail(frame->file));
    free(frame->pixels);
    frame->pixels = reshaped;
    if (bends) olat__tell(found, 0, "made straight, as the lens bends lines");
    return 0;
}

/* The frame's photograph as training takes it, or only its mask, which has waited. */
static int olat__read_one(const olat__reading *r, int i, char *error) {
    olat_frame *frame = r->frames + i;
    olat__found *found = r->found + i;
    ssdgs_camera *camera = &frame->camera;
    memset(found, 0, sizeof *found);
    if (!(r->white > 0) && olat__image_file(frame->file, 0, &camera->width, &camera->height, &frame->format,
                                            &frame->pixels, found, error))
        return 1;
    frame->has_image = 1;
    if (frame->mask && olat__apply_mask(frame, r->white, found, error)) return 1;
    return !found->waits && olat__reshape(r, i, found, error);
}

static void olat__read_task(void *data, int i) {
    const olat__reading *r = (const olat__reading *)data;
    char error[512]; /* what is wrong is told when the frame's turn comes: it is read once more then */
    if (!(r->white > 0) || r->waits[i]) r->found[i].failed = olat__read_one(r, i, error);
}

/* Reads all photographs, or applies the masks that wait. */
static void olat__read_all(olat__json *j, const olat_reader *reader, olat_dataset *out, olat__reading *r,
                           olat__seen *seen) {
    const int most = reader ? 16 + 4 * ssdgs_context_threads(reader->context) : 1; /* at a time */
    const olat__lens *const lenses = r->lenses;
    char *const waits = r->waits;
    for (int begin = 0; begin < out->count && !j->failed; begin += most) {
        const int count = begin + most < out->count ? most : out->count - begin;
        r->frames = out->frames + begin;
        r->lenses = lenses + begin;
        r->waits = waits + begin;
        if (reader && ssdgs_context_run(reader->context, count, olat__read_task, r))
            j->failed = olat__fail(j->error, "%s", ssdgs_error_message(reader->context));
        for (int i = 0; i < count && !j->failed; i++) {
            if (r->white > 0 && !r->waits[i]) continue;
            if (!reader || r->found[i].failed) {
                if (!(r->white > 0)) free(r->frames[i].pixels);
                j->failed = olat__read_one(r, i, j->error);
            }
            r->waits[i] = (char)r->found[i].waits;
            olat__see(seen, r->found + i, begin + i);
        }
        if (reader && reader->progress && !j->failed && !(r->white > 0))
            reader->progress(reader->user, begin + count, out->count);
    }
    r->lenses = lenses;
    r->waits = waits;
}

static void olat__note_tally(olat_dataset *out, const olat__tally *tally, int masks) {
    const int of_mask = tally->remark.flags & OLAT__OF_MASK;
    char names[3 * 64] = "";
    for (int i = 0; i < 3 && i < tally->count && (tally->remark.flags & OLAT__NAMED); i++) {
        const olat_frame *frame = out->frames + tally->first[i];
        const char *name = of_mask ? frame->mask : frame->file;
        const size_t length = strlen(name);
        olat__append(names, sizeof names, "%s%s", *names ? ", " : ": ",
                     name + (length > 60 ? length - 60 : 0));
    }
    olat__note(out, "%d of the %d %s %s %s%s%s", tally->count, of_mask ? masks : out->count,
               of_mask ? "masks" : "photographs", tally->count == 1 ? "is" : "are", tally->remark.text, names,
               *names && tally->count > 3 ? ", ..." : "");
}

/* Reads all photographs and notes what is to be noted of them. A mask without anything bright is right where
   others are brighter; where none is, all are scaled alike: so a dim one among soft masks stays dim. What has
   less than 16 numbers is no brightness: they are labels. */
static void olat__read_photos(olat__json *j, const olat__lens *lenses, int downscale,
                              const olat_reader *reader, olat_dataset *out) {
    const int most = reader ? 16 + 4 * ssdgs_context_threads(reader->context) : 1;
    olat__reading r;
    olat__seen seen;
    memset(&seen, 0, sizeof seen);
    memset(&r, 0, sizeof r);
    r.lenses = lenses;
    r.downscale = downscale;
    r.found = (olat__found *)calloc((size_t)most, sizeof *r.found);
    r.waits = (char *)calloc((size_t)out->count, 1);
    if (!r.found || !r.waits) j->failed = olat__fail(j->error, "out of memory");
    for (int i = 0; i < out->count; i++) seen.masks += out->frames[i].mask != NULL;
    olat__read_all(j, reader, out, &r, &seen);
    const int dim = seen.largest > 0 && seen.largest <= 0.6;
    const int labels = seen.number > 0 && seen.number <= 15;
    r.white = labels ? 1e-12 : dim ? seen.largest : 1;
    if (seen.masks) olat__read_all(j, reader, out, &r, &seen);
    free(r.found);
    free(r.waits);
    if (seen.masks) olat__note(out, "masks of %d of the %d photographs are used", seen.masks, out->count);
    if (labels)
        olat__note(out, "no mask has a number above %u: these are taken as labels, and all but 0 is kept",
                   seen.number);
    else if (dim)
        olat__note(out,
                   "no mask is brighter than %.4g of 255: all are scaled, so that this keeps all and half of "
                   "it half",
                   255 * seen.largest);
    if (2 * seen.inverted > seen.masks)
        olat__note(out,
                   "the border is white and the middle black in %d of the %d masks: white is kept, so invert "
                   "them if that is wrong",
                   seen.inverted, seen.masks);
    for (int i = 0; i < seen.count; i++) olat__note_tally(out, seen.tallies + i, seen.masks);
    if (seen.more) olat__note(out, "%d more remarks like these are left out", seen.more);
    if (seen.broken) olat__note(out, "%lu values in the photographs are not finite: taken as 0", seen.broken);
}

static void olat__read_frames(olat__json *j, const char *folder, int flags, const double *origin,
                              const olat_reader *reader, olat_dataset *out) {
    const olat__node *root = j->nodes, *frames = olat__find(j, root, "frames");
    const int downscale = flags >> 8 ? flags >> 8 : 1;
    int oblong = 0;
    olat__lens top;
    memset(&top, 0, sizeof top);
    olat__read_lens(j, root, &top);
    out->has_bounds = olat__get(j, root, "bounds_min", 3, out->bounds[0]) &&
                      olat__get(j, root, "bounds_max", 3, out->bounds[1]);
    for (int c = 0; c < 3 && out->has_bounds; c++)
        if (!(out->bounds[0][c] < out->bounds[1][c]))
            olat__json_fail(j, root, "bounds_min is not below bounds_max");
    if (root->type != OLAT__OBJECT || !frames) olat__json_fail(j, root, "frames is missing");
    else if (frames->type != OLAT__ARRAY) olat__json_fail(j, frames, "an array was expected");
    else if (frames->size < 1 || frames->size > OLAT__MAX_FRAMES)
        olat__json_fail(j, frames, "there must be 1 to 2^20 frames");
    if (j->failed) return;
    olat__lens *lenses = (olat__lens *)calloc((size_t)frames->size, sizeof *lenses);
    out->frames = (olat_frame *)calloc((size_t)frames->size, sizeof *out->frames);
    if (!out->frames || !lenses) {
        free(lenses);
        olat__json_fail(j, frames, "out of memory");
        return;
    }
    out->count = frames->size;
    if (origin) memcpy(out->origin, origin, sizeof out->origin);
    else olat__find_origin(j, frames, out->origin);
    if (olat__dot(out->origin, out->origin) > 0) {
        olat__note(out, "coordinates are taken relative to %.9g, %.9g, %.9g", out->origin[0], out->origin[1],
                   out->origin[2]);
    }
    if (olat__find(j, root, "ply_file_path"))
        olat__note(out, "ply_file_path is not used: training starts from random points");
    const olat__node *node;
    int i;
    for (i = 0, node = &j->nodes[frames->child]; i < out->count && !j->failed;
         i++, node = &j->nodes[node->next]) {
        olat_frame *frame = &out->frames[i];
        if (node->type != OLAT__OBJECT) olat__json_fail(j, node, "an object was expected");
        olat__lens *lens = lenses + i;
        *lens = top;
        olat__read_lens(j, node, lens);
        olat__read_lights(j, node, out->origin, frame);
        olat__read_paths(j, node, folder, flags, &frame->file, &frame->mask);
        frame->camera.width = lens->w ? lens->w : olat__side(lens->centre[0]);
        frame->camera.height = lens->h ? lens->h : olat__side(lens->centre[1]);
    }
    if (!(flags & OLAT_NO_IMAGES) && !j->failed) olat__read_photos(j, lenses, downscale, reader, out);
    for (i = 0, node = &j->nodes[frames->child]; i < out->count && !j->failed;
         i++, node = &j->nodes[node->next]) {
        const olat__lens *lens = lenses + i;
        const ssdgs_camera *camera = &out->frames[i].camera;
        out->frames[i].lens.width = camera->width;
        out->frames[i].lens.height = camera->height;
        olat__read_camera(j, node, lens, out->origin, downscale, out->frames + i);
        oblong +=
            !(lens->focal[0] + lens->focal[1] > 0) && fabs((double)(camera->fx / camera->fy) - 1) > 0.01;
    }
    free(lenses);
    if (oblong) {
        olat__note(out, "pixels of %d of the %d frames are not square, by camera_angle_x and camera_angle_y",
                   oblong, out->count);
    }
}

/* ---- frames of several photographs ---- */

/* The text of folder/exclude_list.txt, empty where there is none; NULL after a failure. */
static char *olat__exclude_list(olat__json *j, const char *folder) {
    const size_t room = strlen(folder) + 32;
    char *path = (char *)malloc(room);
    unsigned char *list = NULL;
    struct stat there;
    size_t size = 0;
    if (path) snprintf(path, room, "%s%sexclude_list.txt", folder, *folder ? "/" : "");
    if (path && stat(path, &there) == 0) j->failed = olat__read_file(path, &list, &size, j->error);
    else if (!path || (list = (unsigned char *)calloc(1, 1)) == NULL)
        j->failed = olat__fail(j->error, "%s: out of memory", olat__tail(folder));
    free(path);
    return (char *)list;
}

/* Whether a line of the list is the last name of a path, which has no ending. */
static int olat__excluded(const char *list, const olat__node *path) {
    size_t start = path->text_length, length;
    if (path->type != OLAT__STRING) return 0;
    while (start > 0 && path->text[start - 1] != '/' && path->text[start - 1] != '\\') start--;
    for (; *list; list += length, list += strspn(list, "\r\n")) {
        length = strcspn(list, "\r\n");
        const size_t name = length > 4 && !strncmp(list + length - 4, ".png", 4) ? length - 4 : length;
        if (name == path->text_length - start && !memcmp(list, path->text + start, name)) return 1;
    }
    return 0;
}

/* Puts a copy of a value before an object's members; 0 where memory is short. */
static int olat__copy_member(olat__json *j, int object, const char *key, int value) {
    const int copy = olat__json_add(j, -1, 0);
    if (copy < 0) return 0;
    olat__node *node = j->nodes + copy;
    *node = j->nodes[value];
    node->key = key;
    node->key_length = strlen(key);
    node->next = j->nodes[object].child;
    j->nodes[object].child = copy;
    return 1;
}

/* Makes frames of one photograph of those of SSS-GS, which have lists. What exclude_list.txt names is left
   out. Lights are in the world, as cameras are: that program turns their axes and turns them back. */
static void olat__unfold(olat__json *j, const char *folder) {
    enum { LIGHTS, FILES = 2, LISTS, KEYS = 5 };
    static const char *const keys[KEYS] = {"light_positions", "light_intensities", "file_paths", "width",
                                           "height"},
                             *const own[KEYS] = {"pl_pos", "pl_intensity", "file_path", "w", "h"};
    const olat__node *found = olat__find(j, j->nodes, "frames");
    const int frames = found && found->type == OLAT__ARRAY ? (int)(found - j->nodes) : 0;
    char *list = NULL;
    int count = 0, last = 0, next, good = 1;
    for (int frame = frames ? found->child : 0; frame && good && !j->failed; frame = next) {
        int value[KEYS], photos = 1; /* nodes: of each photograph, of all */
        next = j->nodes[frame].next;
        for (int k = 0; k < KEYS; k++) {
            found = olat__find(j, j->nodes + frame, keys[k]);
            value[k] = found ? (int)(found - j->nodes) : 0;
        }
        const int lists = value[LIGHTS] && j->nodes[value[LIGHTS]].type == OLAT__ARRAY;
        if (lists) photos = j->nodes[value[LIGHTS]].size;
        for (int k = 0; k < LISTS && lists; k++) {
            found = j->nodes + value[k];
            if (value[k] && (found->type != OLAT__ARRAY || found->size != photos))
                olat__json_fail(j, found, "a list as long as light_positions was expected: of %d", photos);
            value[k] = value[k] ? found->child : 0;
        }
        if (lists && !list && !j->failed) list = olat__exclude_list(j, folder);
        for (int i = 0; i < photos && good && !j->failed; i++) {
            int one = frame;
            if (!lists || !value[FILES] || !olat__excluded(list, j->nodes + value[FILES])) {
                if (lists && (good = (one = olat__json_add(j, -1, 0)) >= 0) != 0)
                    j->nodes[one] = j->nodes[frame];
                for (int k = 0; k < KEYS && lists && good; k++)
                    if (value[k]) good = olat__copy_member(j, one, own[k], value[k]);
                if (!good) break;
                count++;
                j->nodes[one].next = 0;
                if (last) j->nodes[last].next = one;
                else j->nodes[frames].child = one;
                last = one;
            }
            for (int k = 0; k < LISTS && lists; k++) value[k] = value[k] ? j->nodes[value[k]].next : 0;
        }
    }
    if (frames) j->nodes[frames].size = count;
    if (!good) olat__json_fail(j, j->nodes + frames, "out of memory");
    free(list);
}

/* ==== loading and guarding ==== */

/* Frees what olat_load made. */
OLAT__API void olat_free(olat_dataset *set) {
    for (int i = 0; i < set->count; i++) {
        free(set->frames[i].file);
        free(set->frames[i].mask);
        free(set->frames[i].pixels);
        free(set->frames[i].more);
    }
    free(set->frames);
    memset(set, 0, sizeof *set);
}

/* Reads and parses folder/split_json; whatever came of it, olat__json_close frees it. nerfstudio's list is
   transforms.json. */
static void olat__json_open(olat__json *j, const char *folder, const char *split_json, char *error) {
    const size_t room = strlen(folder) + strlen(split_json) + 2;
    unsigned char *text = NULL;
    size_t size = 0;
    memset(j, 0, sizeof *j);
    j->error = error;
    if ((j->path = (char *)malloc(room)) == NULL) {
        j->failed = olat__fail(error, "%s: out of memory", olat__tail(split_json));
        return;
    }
    snprintf(j->path, room, "%s%s%s", folder, folder[0] ? "/" : "", split_json);
    if (!strcmp(split_json, "transforms_train.json") && !olat_exists(j->path)) {
        snprintf(j->path, room, "%s%stransforms.json", folder, folder[0] ? "/" : "");
        if (!olat_exists(j->path))
            snprintf(j->path, room, "%s%s%s", folder, folder[0] ? "/" : "", split_json);
    }
    j->failed = olat__read_file(j->path, &text, &size, error);
    if (j->failed) return;
    j->text = (char *)text;
    j->end = j->text + size;
    olat__json_parse(j);
    if (!j->failed) olat__unfold(j, folder);
}

/* Reads folder/split_json and its images; flags: OLAT_NO_IMAGES, OLAT_ALLOW_PARENT, OLAT_DOWNSCALE. out is
   empty after a failure. Positions become relative to origin, of 3 numbers; NULL chooses one: 0 unless they
   lie far away. reader may be NULL. */
OLAT__API int olat_load_at(const char *folder, const char *split_json, int flags, const double *origin,
                           const olat_reader *reader, olat_dataset *out, char error[512]) {
    memset(out, 0, sizeof *out);
    olat__json j;
    olat__json_open(&j, folder, split_json, error);
    const size_t length = strlen(split_json);
    if (!j.failed &&
        strcmp(j.path + (strlen(j.path) > length ? strlen(j.path) - length : 0), split_json) != 0)
        olat__note(out, "there is no %s: transforms.json is read", split_json);
    if (!j.failed) olat__read_frames(&j, folder, flags, origin, reader, out);
    if (j.failed) olat_free(out);
    olat__json_close(&j);
    return j.failed;
}

OLAT__API int olat_load(const char *folder, const char *split_json, int flags, olat_dataset *out,
                        char error[512]) {
    return olat_load_at(folder, split_json, flags, NULL, NULL, out, error);
}

/* What the photographs of a list take in memory, judged by the first one without its mask. */
typedef struct olat_need {
    double bytes, reading; /* of all; of each thread that reads one */
    double pixels, shown;  /* of one; those that are not transparent */
} olat_need;

OLAT__API int olat_memory(const char *folder, const char *split_json, int flags, olat_need *need,
                          char error[512]) {
    olat__json j;
    olat__json_open(&j, folder, split_json, error);
    const olat__node *frames = j.failed ? NULL : olat__find(&j, j.nodes, "frames");
    char *files[2] = {NULL, NULL};
    memset(need, 0, sizeof *need);
    if (frames && frames->size) /* what is wrong with the list is told when it is read */
        olat__read_paths(&j, &j.nodes[frames->child], folder, flags, &files[0], &files[1]);
    if (files[0] && !j.failed) {
        olat__found found;
        int width, height;
        ssdgs_pixels format;
        void *image;
        memset(&found, 0, sizeof found);
        j.failed = olat__image_file(files[0], 0, &width, &height, &format, &image, &found, error);
        if (!j.failed) {
            const int times = flags >> 8 ? flags >> 8 : 1;
            need->pixels = (double)(width / times) * (height / times);
            need->bytes = 4 * (double)olat__number_size(format) * frames->size * need->pixels;
            olat__lens lens;
            memset(&lens, 0, sizeof lens);
            olat__read_lens(&j, j.nodes, &lens);
            olat__read_lens(&j, &j.nodes[frames->child], &lens);
            need->reading =
                (double)width * height *
                (8 * (double)olat__number_size(format) + (times > 1 || olat_lens_bends(&lens.bend) ? 16 : 0));
            for (size_t i = 0; i < (size_t)width * (size_t)height; i++)
                need->shown += (double)olat__number(image, format, 4 * i + 3) / (times * times);
            free(image);
        }
    }
    for (int k = 0; k < 2; k++) free(files[k]);
    olat__json_close(&j);
    return j.failed;
}

/* A dataset as input: the JSON, and the images and masks that it names as far as it can be read. */
OLAT__API int olat_guard_folder(olat_guard *guard, const char *folder, const char *split_json,
                                char error[512]) {
    char problem[512] = "";
    olat__json j;
    olat__json_open(&j, folder, split_json, problem);
    int failed = j.path && olat_guard_input(guard, j.path, error);
    const olat__node *frames = j.failed ? NULL : olat__find(&j, j.nodes, "frames");
    const olat__node *node = frames ? &j.nodes[frames->child] : NULL;
    for (int i = 0; frames && i < frames->size && !failed; i++, node = &j.nodes[node->next]) {
        char *files[2] = {NULL, NULL};
        j.failed = 0; /* what is wrong with one frame does not expose another's files */
        olat__read_paths(&j, node, folder, OLAT_NO_IMAGES | OLAT_ALLOW_PARENT, &files[0], &files[1]);
        for (int k = 0; k < 2; k++) {
            if (files[k] && !failed) failed = olat_guard_input(guard, files[k], error);
            free(files[k]);
        }
        if (j.failed && strstr(problem, "out of memory")) break;
    }
    if (!failed && j.failed && strstr(problem, "out of memory")) failed = olat__fail(error, "%s", problem);
    olat__json_close(&j);
    return failed;
}

/* ==== saving ==== */

/* A file below the folder, relative to it. */
static void olat__write_path(olat__writer *w, const char *key, const char *file, const char *folder) {
    const size_t used = strlen(folder);
    if (!file || strncmp(file, folder, used) || (used && file[used] != '/')) return;
    olat__write(w, key);
    olat__write_string(w, file + used + (used > 0));
    olat__write(w, ", ");
}

static void olat__write_light(olat__writer *w, const ssdgs_light *light, const double origin[3]) {
    const int is_point = light->kind == SSDGS_LIGHT_POINT;
    double v[3];
    for (int k = 0; k < 3; k++)
        v[k] = is_point ? (double)light->position[k] + origin[k] : 0 - (double)light->direction[k];
    olat__write_numbers(w, is_point ? "\"pl_pos\": [" : "\"pl_dir\": [", v, 3, is_point ? 16 : 9, "], ");
    if (light->focus > 0) {
        v[0] = (double)light->focus;
        olat__write_numbers(w, "\"pl_mu\": ", v, 1, 9, ", ");
        for (int k = 0; k < 3; k++) v[k] = (double)light->direction[k];
        olat__write_numbers(w, "\"pl_axis\": [", v, 3, 9, "], ");
    }
    for (int k = 0; k < 3; k++) v[k] = (double)light->intensity[k];
    olat__write_numbers(w, "\"pl_intensity\": [", v, 3, 9, "]");
}

static void olat__write_frame(olat__writer *w, const olat_frame *frame, const double origin[3],
                              const char *folder) {
    static const double last_row[4] = {0, 0, 0, 1};
    static const char *const keys[12] = {"w",  "h",  "fl_x", "fl_y", "cx", "cy",
                                         "k1", "k2", "k3",   "k4",   "p1", "p2"};
    const ssdgs_camera *camera = &frame->camera;
    olat__write_path(w, "\"file_path\": ", frame->file, folder);
    olat__write_path(w, "\"mask_path\": ", frame->mask, folder);
    double v[4];
    olat_lens own = frame->lens;
    if (!own.width) { /* a frame that was not read */
        own.width = camera->width, own.height = camera->height;
        own.focal[0] = (double)camera->fx, own.focal[1] = (double)camera->fy;
        own.centre[0] = (double)camera->cx, own.centre[1] = (double)camera->cy;
    }
    const int bends = olat_lens_bends(&own);
    const double lens[12] = {(double)own.width, (double)own.height, own.focal[0], own.focal[1],
                             own.centre[0],     own.centre[1],      own.k[0],     own.k[1],
                             own.k[2],          own.k[3],           own.p[0],     own.p[1]};
    if (bends)
        olat__write(w, own.fisheye ? "\"camera_model\": \"OPENCV_FISHEYE\", "
                                   : "\"camera_model\": \"OPENCV\", ");
    for (int i = 0; i < (bends ? 12 : 6); i++) {
        olat__write_string(w, keys[i]);
        olat__write_numbers(w, ": ", lens + i, 1, 16, i == 5 ? ",\n  " : ", ");
    }
    olat__write(w, "\"transform_matrix\": [");
    for (int k = 0; k < 3; k++) { /* camera to world, y up and z backward */
        int m;
        for (m = 0, v[3] = origin[k]; m < 3; m++) {
            v[m] = (double)camera->view[4 * m + k];
            v[3] -= v[m] * (double)camera->view[4 * m + 3];
            if (m) v[m] = -v[m];
        }
        olat__write_numbers(w, "[", v, 3, 9, ", ");
        olat__write_numbers(w, "", v + 3, 1, 16, "], ");
    }
    olat__write_numbers(w, "[", last_row, 4, 9, "]],\n  ");
    if (frame->more_count) olat__write(w, "\"pl_lights\": [\n  {");
    for (int i = 0; i <= frame->more_count; i++) {
        if (i) olat__write(w, "},\n  {");
        olat__write_light(w, i ? frame->more + i - 1 : &frame->light, origin);
    }
    olat__write(w, frame->more_count ? "}]}" : "}");
}

/* Writes the frames' cameras and lights as olat_load reads them, image paths relative to folder: refined
   poses, say. */
OLAT__API int olat_save(const char *path, const char *folder, const olat_dataset *set, char error[512]) {
    olat__writer w;
    olat__writer_start(&w);
    olat__write(&w, "{");
    for (int i = 0; i < 2 && set->has_bounds; i++)
        olat__write_numbers(&w, i ? "\"bounds_max\": [" : "\"bounds_min\": [", set->bounds[i], 3, 9, "],\n ");
    olat__write(&w, "\"frames\": [");
    for (int i = 0; i < set->count; i++) {
        olat__write(&w, i ? ",\n {" : "\n {");
        olat__write_frame(&w, &set->frames[i], set->origin, folder);
    }
    olat__write(&w, "\n]}\n");
    return olat__writer_end(&w, path, error);
}

/* ==== what programs do with frames ==== */

/* Prints a dataset's notes as the program's. */
OLAT__API void olat_print_notes(const olat_dataset *set, const char *program) {
    const char *line = set->notes;
    while (*line) {
        const int length = (int)strcspn(line, "\n");
        fprintf(stderr, "%s: note: %.*s\n", program, length, line);
        line += length + (line[length] == '\n');
    }
}

/* A frame as ssdgs_photo, which shares its pixels. */
OLAT__API ssdgs_photo olat_photo(const olat_frame *frame) {
    ssdgs_photo photo;
    photo.camera = frame->camera;
    photo.light = frame->light;
    photo.pixels = frame->pixels;
    photo.format = frame->format;
    photo.more = frame->more;
    photo.more_count = frame->more_count;
    return photo;
}

/* Its lights in one array, as renders take them: how many. */
OLAT__API int olat_lights(const ssdgs_photo *photo, ssdgs_light lights[OLAT_MOST_LIGHTS]) {
    const int more = photo->more_count < OLAT_MOST_LIGHTS ? photo->more_count : OLAT_MOST_LIGHTS - 1;
    lights[0] = photo->light;
    for (int i = 0; i < more; i++) lights[1 + i] = photo->more[i];
    return 1 + more;
}

/* All frames so: (count), to be freed; NULL if out of memory. */
OLAT__API ssdgs_photo *olat_photos(const olat_dataset *set) {
    ssdgs_photo *photos = (ssdgs_photo *)calloc(set->count > 0 ? (size_t)set->count : 1, sizeof *photos);
    for (int i = 0; photos && i < set->count; i++) photos[i] = olat_photo(set->frames + i);
    return photos;
}

/* A photograph on a background, (h,w,3) stored values by a model's transfer; the background alone where there
   are no pixels. */
OLAT__API void olat_compose(const ssdgs_photo *photo, int transfer, const ssdgs_real background[3],
                            ssdgs_real *out) {
    const size_t pixels = (size_t)photo->camera.width * (size_t)photo->camera.height;
    const int encodes = transfer == SSDGS_TRANSFER_SRGB && olat__is_light(photo->format);
    for (size_t i = 0; i < pixels; i++) {
        ssdgs_real v[4] = {0, 0, 0, 0};
        for (size_t k = 0; photo->pixels && k < 4; k++)
            v[k] = olat__number(photo->pixels, photo->format, 4 * i + k);
        for (size_t k = 0; k < 3; k++)
            out[3 * i + k] = v[3] * (encodes ? ssdgs_srgb_encode(v[k]) : v[k]) + (1 - v[3]) * background[k];
    }
}

/* The box that holds an object where it stands, of its model's own box. */
OLAT__API ssdgs_result olat_bounds(const ssdgs_object *object, ssdgs_real low[3], ssdgs_real high[3]) {
    ssdgs_real own[2][3];
    const ssdgs_result result = ssdgs_model_bounds(object->model, own[0], own[1]);
    for (int i = 0; i < 3; i++)
        for (int corner = 0; corner < 8; corner++) {
            const ssdgs_real *m = object->to_world + 4 * i;
            const ssdgs_real at = m[0] * own[corner & 1][0] + m[1] * own[corner >> 1 & 1][1] +
                                  m[2] * own[corner >> 2][2] + m[3];
            low[i] = corner && low[i] < at ? low[i] : at;
            high[i] = corner && high[i] > at ? high[i] : at;
        }
    return result;
}

/* Where a light is; of a directional one, the unit vector towards it. */
OLAT__API void olat_place(const ssdgs_light *light, ssdgs_real place[3]) {
    for (int i = 0; i < 3; i++)
        place[i] = light->kind == SSDGS_LIGHT_DIRECTIONAL ? -light->direction[i] : light->position[i];
}

/* Where a camera stands. */
OLAT__API void olat_eye(const ssdgs_camera *camera, ssdgs_real eye[3]) {
    int k;
    for (int i = 0; i < 3; i++)
        for (k = 0, eye[i] = 0; k < 3; k++) eye[i] -= camera->view[4 * k + i] * camera->view[4 * k + 3];
}

/* One side of the box that training uses, relative to the dataset's origin: as given in the dataset's
   coordinates, where infinite the dataset's own, else as it is there. */
OLAT__API void olat_box_side(const olat_dataset *set, int axis, double low, double high, ssdgs_real *min,
                             ssdgs_real *max) {
    if (!(low < HUGE_VAL)) low = set->has_bounds ? set->bounds[0][axis] : (double)min[axis];
    if (!(high < HUGE_VAL)) high = set->has_bounds ? set->bounds[1][axis] : (double)max[axis];
    min[axis] = (ssdgs_real)(low - set->origin[axis]);
    max[axis] = (ssdgs_real)(high - set->origin[axis]);
}

/* Whether the list is in another unit than the box that holds the object, as where one has millimetres and
   the other metres: it fills less than a fiftieth of every picture, or all cameras stand in its midst. The
   note says so; 0: neither. */
OLAT__API int olat_other_unit(const olat_dataset *set, const char *box, const ssdgs_real low[3],
                              const ssdgs_real high[3], char note[512]) {
    double size = 0, nearest = HUGE_VAL, farthest = 0;
    int tiny = 0, inside = 0;
    for (int c = 0; c < 3; c++) size = fmax(size, (double)(high[c] - low[c]));
    for (int i = 0; i < set->count; i++) {
        const ssdgs_camera *camera = &set->frames[i].camera;
        ssdgs_real eye[3];
        double away[3];
        olat_eye(camera, eye);
        for (int c = 0; c < 3; c++) away[c] = (double)eye[c] - ((double)low[c] + (double)high[c]) / 2;
        const double distance = sqrt(olat__dot(away, away));
        nearest = fmin(nearest, distance), farthest = fmax(farthest, distance);
        tiny += size * (double)camera->fx < 0.02 * distance * camera->width;
        inside += distance < 0.05 * size;
    }
    if (!(size > 0) || (tiny < set->count && inside < set->count)) return 0;
    if (inside == set->count)
        snprintf(note, 512,
                 "%s is %.3g wide, and all cameras stand within %.3g of its middle: does the list have "
                 "metres where it has millimetres, or another unit else?",
                 box, size, farthest);
    else
        snprintf(note, 512,
                 "%s is %.3g wide, and the nearest camera stands %.3g away: does the list have millimetres "
                 "where it has metres, or another unit else?",
                 box, size, nearest);
    return 1;
}

#endif /* OLAT_H */
