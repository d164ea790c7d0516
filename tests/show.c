/* What tests/experiments.sh needs beside train and relight:

   show pipeline OUT.png DATASET BACKGROUND MODEL
       shadow: per ray from the light, coarse, refined; the image (Figure 3)

   show sweeps OUT.png DATASET BACKGROUND MODEL
       one view under six lights, six views under one light (Figure 10)

   show backlit OUT.png DATASET BACKGROUND MODEL...
       the middle of the brightest test view lit from behind, photograph first

   show strip OUT.png COLUMNS FILE.png...
       images side by side

   show parts DATASET BACKGROUND MODEL
       where the squared error of the test views lies, a row of a table

   show poses TRUE.json FITTED.json
       how far cameras and lights are from the truth */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/olat.h"

enum { COLUMNS = 6, ROWS = 4 };

/* Everything the program holds; main releases it. */
typedef struct show {
    ssdgs_context *context, *coarse; /* coarse shows a Gaussian's visibility as its colour */
    ssdgs_model *model, *coarse_model;
    olat_dataset set, other;
    ssdgs_real background[3], *image, *alpha, /* of the view at hand: (h,w,3), (h,w) */
        *planes;                              /* (h,w,8) to compare with */
    unsigned char *bytes, *sheet;
    int width, height, columns, rows; /* of a cell in pixels; of the sheet in cells */
    char error[512];
} show;

static int failed(show *s, const char *message) {
    snprintf(s->error, sizeof s->error, "%s", message);
    return 1;
}

static ssdgs_result show_visibility(void *user, ssdgs_frame *frame) {
    ssdgs_result result = ssdgs_stage_cpu(frame, SSDGS_STAGE_SHADE);
    (void)user;
    for (int i = 0; !result && i < frame->gaussians.count; i++)
        for (int c = 0; c < 3; c++) frame->color[4 * i + c] = frame->visibility[i];
    frame->layer_count = 0; /* no highlights on it */
    return result;
}

static int open_dataset(show *s, const char *folder, const char *background) {
    for (int i = 0; i < 3; i++) s->background[i] = (ssdgs_real)!strcmp(background, "white");
    if (olat_load(folder, "transforms_test.json", 0, &s->set, s->error)) return 1;
    s->width = s->set.frames[0].camera.width;
    s->height = s->set.frames[0].camera.height;
    for (int i = 1; i < s->set.count; i++)
        if (s->set.frames[i].camera.width != s->width || s->set.frames[i].camera.height != s->height)
            return failed(s, "the views differ in size");
    s->image = (ssdgs_real *)malloc(sizeof *s->image * 4 * (size_t)s->width * (size_t)s->height);
    s->bytes = (unsigned char *)malloc(3 * (size_t)s->width * (size_t)s->height);
    if (!s->image || !s->bytes) return failed(s, "out of memory");
    s->alpha = s->image + 3 * (size_t)s->width * (size_t)s->height;
    return 0;
}

static int open_model(show *s, const char *path) {
    ssdgs_model_destroy(s->model);
    s->model = NULL;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    ssdgs_gpu_hook gpu;
    memset(&gpu, 0, sizeof gpu);
    gpu.stage[SSDGS_STAGE_SHADE] = show_visibility;
    desc.gpu = &gpu;
    if (!s->context && (ssdgs_context_create(NULL, &s->context) || ssdgs_context_create(&desc, &s->coarse)))
        return failed(s, "no context");
    if (ssdgs_model_load(s->context, path, &s->model, NULL))
        return failed(s, ssdgs_error_message(s->context));
    return 0;
}

static int make_sheet(show *s, int columns, int rows) {
    s->columns = columns;
    s->rows = rows;
    s->sheet =
        (unsigned char *)calloc((size_t)columns * (size_t)rows * (size_t)s->width * (size_t)s->height, 3);
    return s->sheet ? 0 : failed(s, "out of memory");
}

/* Copies a cell's size of (.., stride) pixels of RGB from x, y on. */
static void paste(show *s, int row, int column, const unsigned char *from, int stride, int x, int y) {
    for (int line = 0; line < s->height; line++)
        memcpy(
            s->sheet +
                3 * (((size_t)row * (size_t)s->height + (size_t)line) * (size_t)s->columns + (size_t)column) *
                    (size_t)s->width,
            from + 3 * ((size_t)(y + line) * (size_t)stride + (size_t)x), 3 * (size_t)s->width);
}

/* The model in this view and light as stored values, into bytes. */
static int render(show *s, const ssdgs_camera *camera, const ssdgs_light *light) {
    const size_t pixels = (size_t)camera->width * (size_t)camera->height;
    ssdgs_image planes;
    memset(&planes, 0, sizeof planes);
    planes.color = s->image;
    planes.alpha = s->alpha;
    if (ssdgs_render(s->model, camera, light, 1, &planes)) return failed(s, ssdgs_error_message(s->context));
    ssdgs_compose(s->image, s->alpha, pixels, ssdgs_model_settings(s->model)->transfer, s->background,
                  s->image);
    ssdgs_to_bytes(s->image, 3 * pixels, SSDGS_TRANSFER_NONE, s->bytes);
    return 0;
}

/* ---- pictures ---- */

static int pipeline(show *s, const char *model) {
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    const int rows = s->set.count < ROWS ? s->set.count : ROWS;
    if (ssdgs_model_load(s->coarse, model, &s->coarse_model, NULL))
        return failed(s, ssdgs_error_message(s->coarse));
    if (make_sheet(s, 4, rows)) return 1;
    for (int row = 0; row < rows; row++) {
        const olat_frame *frame = &s->set.frames[(2 * row + 1) * s->set.count / (2 * rows)];
        const ssdgs_settings *settings = ssdgs_model_settings(s->model);
        const ssdgs_real up[3] = {0, 0, 1},
                         field = (ssdgs_real)(2 * atan(0.5 * s->width / (double)frame->camera.fx));
        const ssdgs_camera from_light =
            ssdgs_camera_look_at(frame->light.position, settings->centre, up, field, s->width, s->height);
        for (int column = 0; column < 4; column++) {
            ssdgs_image planes;
            ssdgs_result result = SSDGS_OK;
            memset(&planes, 0, sizeof planes);
            planes.color = s->image;
            if (column == 0) planes.alpha = s->alpha;
            if (column == 2) planes.shadow = s->alpha;
            if (column == 1)
                result = ssdgs_render(s->coarse_model, &frame->camera, &frame->light, 1, &planes);
            else if (column < 3)
                result =
                    ssdgs_render(s->model, column ? &frame->camera : &from_light, &frame->light, 1, &planes);
            if (result) return failed(s, ssdgs_error_message(column == 1 ? s->coarse : s->context));
            if (column < 3) {
                for (size_t i = 0; i < pixels && column != 1; i++)
                    for (int c = 0; c < 3; c++)
                        s->image[3 * i + (size_t)c] = column ? s->alpha[i] : 1 - s->alpha[i];
                ssdgs_to_bytes(s->image, 3 * pixels, SSDGS_TRANSFER_NONE, s->bytes);
            } else if (render(s, &frame->camera, &frame->light)) {
                return 1;
            }
            paste(s, row, column, s->bytes, s->width, 0, 0);
        }
    }
    return 0;
}

static int sweeps(show *s) {
    if (make_sheet(s, COLUMNS, 2)) return 1;
    for (int row = 0; row < 2; row++)
        for (int column = 0; column < COLUMNS; column++) {
            const olat_frame *other = &s->set.frames[column * s->set.count / COLUMNS];
            if (render(s, &s->set.frames[row ? column * s->set.count / COLUMNS : 0].camera,
                       row ? &s->set.frames[0].light : &other->light))
                return 1;
            paste(s, row, column, s->bytes, s->width, 0, 0);
        }
    return 0;
}

/* The cosine of the angle at the centre between the eye and the light. */
static double facing(const olat_frame *frame, const ssdgs_real centre[3]) {
    ssdgs_real eye[3];
    olat_eye(&frame->camera, eye);
    double to_eye[3], to_light[3];
    for (int i = 0; i < 3; i++) {
        to_eye[i] = (double)(eye[i] - centre[i]);
        to_light[i] = (double)(frame->light.position[i] - centre[i]);
    }
    return olat__dot(to_eye, to_light) / sqrt(olat__dot(to_eye, to_eye) * olat__dot(to_light, to_light));
}

/* The sum of a photograph's values. */
static double brightness(show *s, const olat_frame *frame) {
    const ssdgs_real black[3] = {0, 0, 0};
    double sum = 0;
    const ssdgs_photo photo = olat_photo(frame);
    olat_compose(&photo, ssdgs_model_settings(s->model)->transfer, black, s->image);
    for (size_t i = 0; i < 3 * (size_t)frame->camera.width * (size_t)frame->camera.height; i++)
        sum += (double)s->image[i];
    return sum;
}

static int backlit(show *s, const char *const *models, int count) {
    const int width = s->width, height = s->height;
    const olat_frame *chosen = s->set.frames;
    double most = 0;
    for (int i = 0; i < s->set.count; i++) {
        const double light = brightness(s, s->set.frames + i);
        if (facing(s->set.frames + i, ssdgs_model_settings(s->model)->centre) > -0.25 || light <= most)
            continue;
        most = light;
        chosen = s->set.frames + i;
    }
    s->width /= 2;
    s->height /= 2;
    if (make_sheet(s, 1 + count, 1)) return 1;
    const ssdgs_photo photo = olat_photo(chosen);
    olat_compose(&photo, ssdgs_model_settings(s->model)->transfer, s->background, s->image);
    ssdgs_to_bytes(s->image, 3 * (size_t)width * (size_t)height, SSDGS_TRANSFER_NONE, s->bytes);
    paste(s, 0, 0, s->bytes, width, width / 4, height / 4);
    for (int i = 0; i < count; i++) {
        if (open_model(s, models[i]) || render(s, &chosen->camera, &chosen->light)) return 1;
        paste(s, 0, 1 + i, s->bytes, width, width / 4, height / 4);
    }
    return 0;
}

static int strip(show *s, int columns, const char *const *files, int count) {
    for (int i = 0; i < count; i++) {
        void *pixels = NULL;
        ssdgs_pixels format;
        int width, height;
        if (olat_read_png(files[i], &width, &height, &format, &pixels, s->error)) return 1;
        if (i == 0) {
            s->width = width;
            s->height = height;
            s->bytes = (unsigned char *)malloc(3 * (size_t)width * (size_t)height);
            if (make_sheet(s, columns, (count + columns - 1) / columns)) s->columns = 0;
        }
        const int bad = !s->bytes || !s->sheet || width != s->width || height != s->height ||
                        format != SSDGS_PIXELS_RGBA8;
        for (size_t p = 0; !bad && p < (size_t)width * (size_t)height; p++)
            for (size_t c = 0; c < 3; c++) s->bytes[3 * p + c] = ((const uint8_t *)pixels)[4 * p + c];
        free(pixels);
        if (bad) return failed(s, "the images differ, or are too large");
        paste(s, i / columns, i % columns, s->bytes, width, 0, 0);
    }
    return 0;
}

/* ---- where the error lies ---- */

/* The largest step between neighbours within two pixels of one. */
static double steepest(const show *s, const ssdgs_real *plane, int x, int y) {
    double most = 0;
    for (int j = y > 2 ? y - 2 : 0; j <= y + 2 && j < s->height; j++)
        for (int i = x > 2 ? x - 2 : 0; i <= x + 2 && i < s->width; i++) {
            const ssdgs_real *at = plane + (size_t)j * (size_t)s->width + (size_t)i;
            const double across = i ? fabs((double)(at[0] - at[-1])) : 0,
                         down = j ? fabs((double)(at[0] - at[-s->width])) : 0;
            most = fmax(most, fmax(across, down));
        }
    return most;
}

enum { OUTLINE, SHADOW_EDGE, HIGHLIGHT, LIT, HALF_LIT, DARK, BACKGROUND, PARTS };

/* Of a pixel: its photograph and rendering, the photograph's alpha and the rendering's S, both (h,w). */
static int part_of(const show *s, const ssdgs_real *photo, const ssdgs_real *rendered,
                   const ssdgs_real *alpha, const ssdgs_real *shadow, int x, int y) {
    const size_t at = (size_t)y * (size_t)s->width + (size_t)x;
    double missing = 0, least = 1;
    if (steepest(s, alpha, x, y) > 0.02) return OUTLINE;
    if (!(alpha[at] > (ssdgs_real)0.999)) return BACKGROUND;
    if (steepest(s, shadow, x, y) > 0.25) return SHADOW_EDGE;
    for (size_t c = 0; c < 3; c++) {
        missing = fmax(missing, (double)(photo[3 * at + c] - rendered[3 * at + c]));
        least = fmin(least, (double)photo[3 * at + c]);
    }
    if (missing > 0.04 && least > 0.25) return HIGHLIGHT;
    return shadow[at] > (ssdgs_real)0.7 ? LIT : shadow[at] < (ssdgs_real)0.3 ? DARK : HALF_LIT;
}

static int parts(show *s) {
    static const ssdgs_real black[3] = {0, 0, 0}, white[3] = {1, 1, 1};
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    double error[PARTS], total = 0;
    size_t count[PARTS], all = pixels * (size_t)s->set.count;
    memset(error, 0, sizeof error);
    memset(count, 0, sizeof count);
    s->planes = (ssdgs_real *)malloc(sizeof *s->planes * 8 * pixels);
    if (!s->planes) return failed(s, "out of memory");
    ssdgs_real *photo = s->planes, *other = photo + 3 * pixels, *alpha = other + 3 * pixels,
               *shadow = alpha + pixels;
    const int transfer = ssdgs_model_settings(s->model)->transfer;
    for (int i = 0; i < s->set.count; i++) {
        const olat_frame *frame = s->set.frames + i;
        const ssdgs_photo from = olat_photo(frame);
        ssdgs_light lights[OLAT_MOST_LIGHTS];
        ssdgs_image planes;
        memset(&planes, 0, sizeof planes);
        planes.color = s->image;
        planes.alpha = s->alpha;
        planes.shadow = shadow;
        if (ssdgs_render(s->model, &frame->camera, lights, olat_lights(&from, lights), &planes))
            return failed(s, ssdgs_error_message(s->context));
        ssdgs_compose(s->image, s->alpha, pixels, transfer, s->background, s->image);
        olat_compose(&from, transfer, black, photo);
        olat_compose(&from, transfer, white, other);
        for (size_t p = 0; p < pixels; p++) alpha[p] = 1 - (other[3 * p] - photo[3 * p]);
        olat_compose(&from, transfer, s->background, photo);
        for (size_t p = 0; p < pixels; p++) {
            const int part = part_of(s, photo, s->image, alpha, shadow, (int)(p % (size_t)s->width),
                                     (int)(p / (size_t)s->width));
            for (size_t c = 3 * p; c < 3 * p + 3; c++) {
                const double off = (double)(photo[c] - s->image[c]);
                error[part] += off * off;
                total += off * off;
            }
            count[part]++;
        }
    }
    printf("%.2f |", -10 * log10(total / (3 * (double)all)));
    for (int part = 0; part < PARTS; part++)
        printf(" %.0f %% on %.1f |", 100 * error[part] / total, 100 * (double)count[part] / (double)all);
    printf("\n");
    return 0;
}

/* ---- poses ---- */

/* How far apart, in px, two cameras see the corners of a cube as wide as half of the bounds, on average: what
   turns and moves that make up for each other leave. */
static double shift(const ssdgs_camera *a, const ssdgs_camera *b) {
    const ssdgs_camera *const cameras[2] = {a, b};
    double sum = 0;
    for (int corner = 0; corner < 8; corner++) {
        double at[2][2];
        for (int c = 0; c < 2; c++) {
            double x[3];
            for (int k = 0; k < 3; k++) {
                const ssdgs_real *row = cameras[c]->view + 4 * k;
                x[k] = (double)row[3] + 0.25 * ((corner & 1 ? 1 : -1) * (double)row[0] +
                                                (corner & 2 ? 1 : -1) * (double)row[1] +
                                                (corner & 4 ? 1 : -1) * (double)row[2]);
            }
            at[c][0] = (double)cameras[c]->fx * x[0] / x[2];
            at[c][1] = (double)cameras[c]->fy * x[1] / x[2];
        }
        sum += sqrt((at[0][0] - at[1][0]) * (at[0][0] - at[1][0]) +
                    (at[0][1] - at[1][1]) * (at[0][1] - at[1][1]));
    }
    return sum / 8;
}

static int poses(show *s, const char *truth, const char *fitted) {
    double distance = 0, turn = 0, apart_px = 0, light = 0;
    if (olat_load("", truth, OLAT_NO_IMAGES, &s->set, s->error) ||
        olat_load("", fitted, OLAT_NO_IMAGES, &s->other, s->error))
        return 1;
    if (s->set.count != s->other.count) return failed(s, "the files differ in frames");
    for (int i = 0; i < s->set.count; i++) {
        const ssdgs_real *a = s->set.frames[i].camera.view, *b = s->other.frames[i].camera.view;
        double apart[3] = {0, 0, 0}, trace = 0, lights[3];
        for (int k = 0; k < 3; k++) {
            for (int m = 0; m < 3; m++) {
                apart[k] +=
                    (double)a[4 * m + k] * (double)a[4 * m + 3] - (double)b[4 * m + k] * (double)b[4 * m + 3];
                trace += (double)a[4 * k + m] * (double)b[4 * k + m];
            }
            lights[k] =
                (double)s->set.frames[i].light.position[k] - (double)s->other.frames[i].light.position[k];
        }
        distance += sqrt(olat__dot(apart, apart)) / s->set.count;
        turn += acos(trace < 3 ? (trace - 1) / 2 : 1) * (180 / 3.14159265358979323846) / s->set.count;
        apart_px += shift(&s->set.frames[i].camera, &s->other.frames[i].camera) / s->set.count;
        light += sqrt(olat__dot(lights, lights)) / s->set.count;
    }
    printf("%.2f px, %.4f, %.2f degrees, %.4f\n", apart_px, distance, turn, light);
    return 0;
}

int main(int argc, char **argv) {
    const char *what = argc > 1 ? argv[1] : "", *const *files = (const char *const *)argv + 5;
    int columns = argc > 3 ? atoi(argv[3]) : 0;
    show s;
    memset(&s, 0, sizeof s);
    int status;
    if (!strcmp(what, "poses") && argc == 4) status = poses(&s, argv[2], argv[3]);
    else if (!strcmp(what, "parts") && argc == 5)
        status = open_dataset(&s, argv[2], argv[3]) || open_model(&s, argv[4]) || parts(&s);
    else if (!strcmp(what, "strip") && argc > 4 && columns > 0)
        status = strip(&s, columns, files - 1, argc - 4);
    else if (argc > 5 && (!strcmp(what, "pipeline") || !strcmp(what, "sweeps") || !strcmp(what, "backlit"))) {
        status = open_dataset(&s, argv[3], argv[4]) || open_model(&s, argv[5]) ||
                 (*what == 'p'   ? pipeline(&s, argv[5])
                  : *what == 's' ? sweeps(&s)
                                 : backlit(&s, files, argc - 5));
    } else status = failed(&s, "usage: see the first lines of tests/show.c");
    if (!status && s.sheet)
        status = olat_write_png(argv[2], s.columns * s.width, s.rows * s.height, 3, s.sheet, s.error);
    if (status) fprintf(stderr, "show: %s\n", s.error);
    ssdgs_model_destroy(s.model);
    ssdgs_model_destroy(s.coarse_model);
    ssdgs_context_destroy(s.context);
    ssdgs_context_destroy(s.coarse);
    olat_free(&s.set);
    olat_free(&s.other);
    free(s.image);
    free(s.planes);
    free(s.bytes);
    free(s.sheet);
    return status;
}
