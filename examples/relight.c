/* cc -O2 examples/relight.c -o relight -lm -lpthread: renders a model in the views and lights of a dataset,
   or on a path */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "adopt.h"
#include "olat.h"
#include "flip.h"
#include "reduce.h"
#include "sky.h"
#include <ctype.h>

#define PI 3.14159265358979323846
static char program[] = "relight";

enum {
    SPLIT,
    OUT_FOLDER,
    BACKGROUND,
    SHEET,
    THREADS,
    ISA,
    NETWORKS,
    REDUCE,
    AMBIENT,
    SKY,
    ANIMATION,
    SIDE,
    DOWNSCALE,
    TRAJECTORY, /* it and those after it take no value */
    COMPONENTS,
    FIT,
    OPTION_COUNT
};
static const char *const option_names[OPTION_COUNT] = {
    "--split",     "--out",        "--background", "--sheet", "--threads",   "--isa",
    "--networks",  "--reduce",     "--ambient",    "--sky",   "--animation", "--size",
    "--downscale", "--trajectory", "--components", "--fit"};

static const char *const help[] = {
    "usage: relight MODEL.ply DATASET --out DIR [OPTION...]",
    "Renders a model in the views and lights of a dataset's frames to PNG. Where frames have",
    "photographs, prints how near it comes to them and writes that to DIR/metrics.json. No file that is",
    "read is replaced.",
    "",
    "  --out DIR                where the images go",
    "  --split NAME             test (default), train or valid: the frames of transforms_NAME.json",
    "  --background COLOUR      black (default) or white",
    "  --downscale N            photographs and cameras N times smaller, as train's",
    "  --fit                    also scores each view with its camera and light fitted to its photograph,",
    "                           apart: \"fitted\" in DIR/metrics.json",
    "  --components             also writes each term, shadow, normal, depth and alpha",
    "  --sheet FILE.png         a contact sheet of up to four views: photograph, rendering, terms,",
    "                           shadow, normal",
    "  --trajectory             renders the paper's path instead: light and camera turn round the object",
    "  --animation FILE.png     the light's first round on that path, as one animated PNG",
    "  --size PIXELS            width of the path's pictures; that of the photographs",
    "  --sky MAP                an environment map, EXR, PNG or JPEG, lights all frames in place of lamps",
    "                           and room: 16 lights and ambient light; its rows lie round the upward axis",
    "  --ambient FACTOR         of the light from the room that the model's photographs had; 1, 0 leaves",
    "                           it out",
    "  --reduce N               renders a level of detail, DIR/reduced.ply: merges Gaussians until N are",
    "                           left, and teaches these what the model shows (half a minute)",
    "  --networks ORIGINAL.ply  settings and networks of the model before an editor of splats dropped",
    "                           them; with these, and where the editor put it, it goes to DIR/whole.ply",
    "  --threads N              0 = one per CPU (default); the result does not depend on it",
    "  --isa NAME               scalar, sse2, avx2, avx512 or neon; the best that this machine has"};

static int usage(const char *problem, const char *what) {
    fprintf(
        stderr,
        "relight: %s %s\nusage: relight MODEL.ply DATASET --out DIR [OPTION...]; relight --help lists them\n",
        problem, what);
    return 2;
}

static int fail(const char *message) {
    fprintf(stderr, "relight: %s\n", message);
    return 1;
}

static int fail_with(const ssdgs_context *context, ssdgs_result result) {
    return fail(result == SSDGS_ERR_MEMORY ? "out of memory" : ssdgs_error_message(context));
}

/* What is written for a view; the first columns of the sheet come first. */
enum { PHOTO, IMAGE, DIFFUSE, SPECULAR, SCATTERING, SHADOW, NORMAL, DEPTH, ALPHA, OUTPUT_COUNT };
enum { FIT_STEPS = 200, SHEET_COLUMNS = DEPTH, SHEET_ROWS = 4, SHEET_CELL = 160, SKY_LIGHTS = 16 };
/* Pictures of the light's way round on the path; every second one is the animation's, which takes five
   seconds. */
enum { ROUND = 150, FILM_STEP = 2, FILM_FRAMES = ROUND / FILM_STEP, FILM_DELAY = 67 };
static const char *const suffixes[OUTPUT_COUNT] = {
    "_photo", "", "_diffuse", "_specular", "_scattering", "_shadow", "_normal", "_depth", "_alpha"};

/* How near a view comes to its photograph, and olat_flip(). */
typedef struct score {
    ssdgs_metrics is;
    double flip;
} score;

/* Everything the program holds; main releases it. */
typedef struct job {
    const char *given[OPTION_COUNT], *model_path, *dataset, *out;
    ssdgs_context_desc desc;
    ssdgs_real background[3];
    int downscale;
    int reduce, size; /* Gaussians to be left, width of the path's pictures; 0 = all, the photographs' */
    double ambient;
    ssdgs_context *context;
    ssdgs_model *model;
    olat_dataset data;
    olat_guard guard;
    score *scores[2];   /* of each frame that has an image; with its camera and light fitted */
    ssdgs_image planes; /* of the view at hand; color is scratch once image is made */
    ssdgs_real *memory, *image,
        *photo; /* what planes point into; (h,w,3) stored values of the rendering and the photograph */
    int black;  /* pictures so far */
    unsigned char *bytes, *sheet, *film;             /* (h,w,3), film FILM_FRAMES of them */
    int sheet_rows, cell_width, cell_height, shrink; /* so many pixels each way become one of the sheet */
    ssdgs_light sky[SKY_LIGHTS];                     /* and the ambient light of the map that --sky names */
    ssdgs_real sky_ambient[9][3];
} job;

/* Reads the whole number of an option that is given. */
static int parse_number(const job *j, int option, long low, long high, int *number) {
    char *end, problem[80];
    if (!j->given[option]) return 0;
    const long value = strtol(j->given[option], &end, 10);
    *number = (int)value;
    if (end != j->given[option] && !*end && value >= low && value <= high) return 0;
    snprintf(problem, sizeof problem, "%s needs a number from %ld to %ld, not", option_names[option], low,
             high);
    return usage(problem, j->given[option]);
}

static int parse(job *j, int argc, char **argv) {
    int isa = 0;
    char *end = NULL;
    for (int i = 1; i < argc; i++) {
        if (argv[i][0] != '-') {
            if (j->dataset) return usage("a third file:", argv[i]);
            if (j->model_path) j->dataset = argv[i];
            else j->model_path = argv[i];
            continue;
        }
        int option;
        for (option = 0; option < OPTION_COUNT && strcmp(argv[i], option_names[option]); option++) {}
        if (option == OPTION_COUNT) return usage("no such option:", argv[i]);
        if (option < TRAJECTORY && i + 1 == argc) return usage("a value is missing after", argv[i]);
        j->given[option] = option < TRAJECTORY ? argv[++i] : "";
    }
    j->out = j->given[OUT_FOLDER];
    if (!j->dataset || !j->out || !j->out[0]) return usage("needs MODEL.ply, DATASET and", "--out DIR");
    if (j->given[TRAJECTORY] && (j->given[SPLIT] || j->given[FIT]))
        return usage("--trajectory has no photographs, so it takes no", j->given[FIT] ? "--fit" : "--split");
    if (!j->given[TRAJECTORY] && (j->given[ANIMATION] || j->given[SIDE]))
        return usage("--trajectory is needed for", j->given[SIDE] ? "--size" : "--animation");
    if (j->given[SKY] && (j->given[FIT] || j->given[AMBIENT] || j->given[ANIMATION]))
        return usage("--sky is all the light there is, and stands still, so it takes no",
                     j->given[FIT]       ? "--fit"
                     : j->given[AMBIENT] ? "--ambient"
                                         : "--animation");
    const char *value = j->given[SPLIT];
    if (!value) j->given[SPLIT] = "test";
    else if (strcmp(value, "test") && strcmp(value, "train") && strcmp(value, "valid"))
        return usage("no such split:", value);
    value = j->given[BACKGROUND];
    if (value && !strcmp(value, "white")) j->background[0] = j->background[1] = j->background[2] = 1;
    else if (value && strcmp(value, "black")) return usage("no such background:", value);
    if (parse_number(j, THREADS, 0, 1024, &j->desc.threads) ||
        parse_number(j, REDUCE, 1, 1000000000, &j->reduce) || parse_number(j, SIDE, 1, 4096, &j->size) ||
        parse_number(j, DOWNSCALE, 1, 1024, &j->downscale))
        return 2;
    value = j->given[AMBIENT];
    j->ambient = value ? strtod(value, &end) : 1;
    if (value && (*end || end == value || !(j->ambient >= 0 && j->ambient <= 1e6)))
        return usage("--ambient needs a number from 0 to 1000000, not", value);
    if (value && j->given[FIT]) return usage("--fit takes the room's light as it is, so no --ambient", value);
    value = j->given[ISA];
    while (value && isa < SSDGS_ISA_COUNT && strcmp(value, ssdgs_isa_string((ssdgs_isa)isa))) isa++;
    if (isa == SSDGS_ISA_COUNT) return usage("no such instruction set:", value);
    j->desc.isa = (ssdgs_isa)isa;
    j->desc.logger.write = olat_hear;
    j->desc.logger.user = program;
    return 0;
}

/* ---- files ---- */

/* A frame's file name without its folder. */
static const char *base_name(const olat_frame *frame) {
    const char *slash = strrchr(frame->file, '/');
    return slash ? slash + 1 : frame->file;
}

/* A file name's length without its extension. */
static size_t stem(const char *name) {
    const char *dot = strrchr(name, '.');
    return dot ? (size_t)(dot - name) : strlen(name);
}

/* OUT/NAME + SUFFIX.png, NAME being the frame's file name without its extension; without a frame OUT/SUFFIX.
   To be freed. */
static char *output_path(const job *j, const olat_frame *frame, const char *suffix) {
    const char *name = frame ? base_name(frame) : "";
    const size_t length = stem(name);
    char *path = (char *)malloc(strlen(j->out) + length + strlen(suffix) + 8);
    if (path) sprintf(path, "%s/%.*s%s%s", j->out, (int)length, name, suffix, frame ? ".png" : "");
    else fail("out of memory");
    return path;
}

static int write_image(const job *j, const olat_frame *frame, const char *suffix) {
    char *path = output_path(j, frame, suffix), error[512] = "";
    int ok = path && !olat_write_png(path, frame->camera.width, frame->camera.height, 3, j->bytes, error);
    if (path && !ok) fail(error);
    free(path);
    return ok;
}

/* Whether a path may be written. */
static int check_output(job *j, const char *path) {
    char error[512] = "";
    return path && (!olat_guard_output(&j->guard, path, error) || !fail(error));
}

/* Nothing that will be written may be one of the files read, or of the dataset's, or be written twice. */
static int check_outputs(job *j) {
    static const char *const splits[3] = {"transforms_train.json", "transforms_test.json",
                                          "transforms_valid.json"};
    char error[512] = "";
    const char *const inputs[3] = {j->model_path, j->given[NETWORKS], j->given[SKY]};
    int ok = 1;
    for (int i = 0; i < 3; i++)
        if ((inputs[i] && olat_guard_input(&j->guard, inputs[i], error)) ||
            olat_guard_folder(&j->guard, j->dataset, splits[i], error))
            return !fail(error);
    for (int i = 0; i < j->data.count && ok; i++)
        for (int output = IMAGE; output < (j->given[COMPONENTS] ? OUTPUT_COUNT : IMAGE + 1) && ok; output++) {
            char *path = output_path(j, &j->data.frames[i], suffixes[output]);
            ok = check_output(j, path);
            free(path);
        }
    static const char *const names[3] = {"metrics.json", "reduced.ply", "whole.ply"};
    const int written[3] = {1, j->reduce > 0, j->given[NETWORKS] != NULL};
    for (int i = 0; i < 3 && ok; i++) {
        char *path = written[i] ? output_path(j, NULL, names[i]) : NULL;
        ok = !written[i] || check_output(j, path);
        free(path);
    }
    const char *const files[2] = {j->given[SHEET], j->given[ANIMATION]};
    for (int i = 0; i < 2 && ok; i++)
        ok = !files[i] ||
             (check_output(j, files[i]) && (!olat_check_writable(files[i], error) || !fail(error)));
    return ok;
}

static void write_numbers(olat__writer *w, const score *s) {
    char text[128]; /* no setlocale is called, so that numbers have a point */
    snprintf(text, sizeof text, "\"psnr\": %.4f, \"ssim\": %.6f, \"flip\": %.6f}", s->is.psnr, s->is.ssim,
             s->flip);
    olat__write(w, text);
}

/* Means over the views that have photographs, and theirs. */
static void write_scores(olat__writer *w, const job *j, const score *scores, const score *mean) {
    const char *separator = "";
    olat__write(w, "\"mean\": {");
    write_numbers(w, mean);
    olat__write(w, ",\n \"views\": [");
    for (int i = 0; i < j->data.count; i++) {
        if (!j->data.frames[i].has_image) continue;
        olat__write(w, separator);
        olat__write(w, "\n  {\"file\": ");
        olat__write_string(w, base_name(&j->data.frames[i]));
        olat__write(w, ", ");
        write_numbers(w, scores + i);
        separator = ",";
    }
    olat__write(w, "\n ]");
}

static int write_metrics(const job *j, const score *means) {
    char *path = output_path(j, NULL, "metrics.json"), error[512] = "";
    if (!path) return 0;
    olat__writer w;
    olat__writer_start(&w);
    olat__write(&w, "{\n ");
    write_scores(&w, j, j->scores[0], means);
    if (j->given[FIT]) {
        olat__write(&w, ",\n \"fitted\": {");
        write_scores(&w, j, j->scores[1], means + 1);
        olat__write(&w, "}");
    }
    olat__write(&w, "\n}\n");
    const int failed = olat__writer_end(&w, path, error);
    if (failed) fail(error);
    free(path);
    return !failed;
}

/* ---- the path of the paper's Appendix D ---- */

/* A circle round the z axis of `axes`: a mean distance and a mean height, as seen from the centre. */
typedef struct orbit {
    double centre[3], radius, height, azimuth;
} orbit;

static void orbit_add(orbit *o, double axes[3][3], const ssdgs_real point[3], double share, int is_first) {
    double local[3];
    int k;
    for (int i = 0; i < 3; i++)
        for (k = 0, local[i] = 0; k < 3; k++) local[i] += axes[i][k] * ((double)point[k] - o->centre[k]);
    o->radius += share * sqrt(local[0] * local[0] + local[1] * local[1] + local[2] * local[2]);
    o->height += share * local[2];
    if (is_first) o->azimuth = atan2(local[1], local[0]);
}

static void orbit_at(const orbit *o, double axes[3][3], double turn, ssdgs_real point[3]) {
    double angle = o->azimuth + turn * PI / 180,
           around = sqrt(fmax(0, o->radius * o->radius - o->height * o->height));
    double local[3] = {around * cos(angle), around * sin(angle), o->height};
    for (int k = 0; k < 3; k++) {
        double sum = o->centre[k];
        for (int i = 0; i < 3; i++) sum += local[i] * axes[i][k];
        point[k] = (ssdgs_real)sum;
    }
}

/* World axes with up last: z, unless the cameras' mean upward direction lies clearly along another one. */
static void find_axes(const olat_dataset *data, double axes[3][3]) {
    double up[3] = {0, 0, 0};
    int best = 2;
    for (int i = 0; i < data->count; i++)
        for (int k = 0; k < 3; k++) up[k] -= (double)data->frames[i].camera.view[4 + k] / data->count;
    for (int k = 0; k < 3; k++)
        if (fabs(up[k]) > 1.5 * fabs(up[best]) && fabs(up[k]) > 0.2) best = k;
    const int sign = up[best] < -0.2 ? -1 : 1;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) axes[i][k] = k == (best + 1 + i) % 3 ? (i > 0 ? sign : 1) : 0;
}

/* Replaces the frames of data, from which it takes its measures, by those of the path: the light goes round
   in steps of 2.4 degrees, the camera goes to the back in steps of 2, the light goes round again, the camera
   returns. */
static int make_trajectory(job *j) {
    olat_dataset *data = &j->data;
    double intensity[3] = {0, 0, 0};
    const ssdgs_model_view model = ssdgs_model_peek(j->model);
    int count = 2 * (ROUND + 90);
    if (data->count < 1) return !fail("the dataset holds no cameras to make the path from");
    ssdgs_camera first = data->frames[0].camera;
    if (j->size) {
        const double by = (double)j->size / first.width;
        first.width = j->size;
        first.height = (int)ceil(by * first.height);
        first.fx *= (ssdgs_real)by;
        first.fy *= (ssdgs_real)by;
    }
    ssdgs_light light = data->frames[0].light;
    light.focus = 0; /* it shines to all sides on its way */
    double axes[3][3];
    find_axes(data, axes);
    orbit camera_orbit;
    memset(&camera_orbit, 0, sizeof camera_orbit);
    orbit light_orbit;
    memset(&light_orbit, 0, sizeof light_orbit);
    ssdgs_real centre[3], up[3];
    const ssdgs_object placed = ssdgs_object_default(j->model);
    double own[3];
    for (int k = 0; k < 3; k++) {
        double sum = 0;
        for (int i = 0; i < model.count; i++)
            sum += (double)model.gaussians[(size_t)(SSDGS_POSITION + k) * model.stride + (size_t)i];
        own[k] = model.count ? sum / model.count : 0;
    }
    for (int k = 0; k < 3; k++) {
        const ssdgs_real *m = placed.to_world + 4 * k;
        centre[k] = (ssdgs_real)((double)m[0] * own[0] + (double)m[1] * own[1] + (double)m[2] * own[2] +
                                 (double)m[3]);
        up[k] = (ssdgs_real)axes[2][k];
        camera_orbit.centre[k] = (double)centre[k];
        light_orbit.centre[k] = light.kind == SSDGS_LIGHT_POINT ? (double)centre[k] : 0;
    }
    ssdgs_real eye[3];
    for (int i = 0; i < data->count; i++) {
        const ssdgs_light *l = &data->frames[i].light;
        ssdgs_real place[3];
        olat_place(l, place);
        olat_eye(&data->frames[i].camera, eye);
        orbit_add(&camera_orbit, axes, eye, 1.0 / data->count, i == 0);
        orbit_add(&light_orbit, axes, place, 1.0 / data->count, 0);
        for (int k = 0; k < 3; k++) intensity[k] += (double)l->intensity[k] / data->count;
    }
    light_orbit.azimuth = camera_orbit.azimuth; /* starts at the viewer */
    olat_frame *frames = (olat_frame *)calloc((size_t)count, sizeof *frames);
    if (!frames) return !fail("out of memory");
    for (int i = 0; i < count; i++) {
        int half = i / 240, step = i % 240 + 1;
        double light_turn = step < ROUND ? 360.0 / (double)ROUND * step : 0,
               camera_turn = (step > ROUND ? 2.0 * (step - ROUND) : 0) + 180 * half;
        ssdgs_camera *camera = &frames[i].camera;
        orbit_at(&camera_orbit, axes, camera_turn, eye);
        *camera = ssdgs_camera_look_at(eye, centre, up,
                                       (ssdgs_real)(2 * atan(0.5 * first.width / (double)first.fx)),
                                       first.width, first.height);
        camera->fy = first.fy;
        frames[i].light = light;
        ssdgs_real place[3];
        orbit_at(&light_orbit, axes, light_turn, place);
        for (int k = 0; k < 3; k++) {
            frames[i].light.intensity[k] = (ssdgs_real)intensity[k];
            if (light.kind == SSDGS_LIGHT_DIRECTIONAL) frames[i].light.direction[k] = -place[k];
            else frames[i].light.position[k] = place[k];
        }
    }
    olat_free(data);
    data->frames = frames;
    data->count = count;
    return 1;
}

/* ---- one view ---- */

static int make_planes(job *j) {
    size_t most = 0;
    int width = 0, height = 0;
    for (int i = 0; i < j->data.count; i++) {
        const ssdgs_camera *camera = &j->data.frames[i].camera;
        if (camera->width > width) width = camera->width;
        if (camera->height > height) height = camera->height;
        const size_t pixels = (size_t)camera->width * (size_t)camera->height;
        if (pixels > most) most = pixels;
    }
    for (int i = 0; i < 2; i++) j->scores[i] = (score *)calloc((size_t)j->data.count + 1, sizeof **j->scores);
    ssdgs_real *next;
    j->memory = next = (ssdgs_real *)malloc(most * 24 * sizeof *next + 1);
    j->bytes = (unsigned char *)malloc(most * 3 + 1);
    if (j->given[SHEET] && j->data.count > 0) {
        j->sheet_rows = j->data.count < SHEET_ROWS ? j->data.count : SHEET_ROWS;
        j->shrink = (width + SHEET_CELL - 1) / SHEET_CELL;
        j->cell_width = width / j->shrink;
        j->cell_height = (height + j->shrink - 1) / j->shrink; /* never 0 */
        j->sheet = (unsigned char *)calloc((size_t)j->cell_width * SHEET_COLUMNS,
                                           (size_t)(j->cell_height * j->sheet_rows) * 3);
    }
    if (j->given[ANIMATION]) {
        if (most > OLAT__MAX_PIXELS / FILM_FRAMES)
            return !fail("the pictures are too large for --animation: give a smaller --size");
        j->film = (unsigned char *)calloc(FILM_FRAMES, 3 * most);
    }
    if ((j->given[ANIMATION] && !j->film) || !j->scores[0] || !j->scores[1] || !j->memory || !j->bytes ||
        (j->sheet_rows && !j->sheet))
        return !fail("out of memory");
    j->image = next;
    j->photo = next += 3 * most;
    j->planes.color = next += 3 * most;
    j->planes.diffuse = next += 3 * most;
    j->planes.specular = next += 3 * most;
    j->planes.scattering = next += 3 * most;
    j->planes.normal = next += 3 * most;
    j->planes.depth = next += 3 * most;
    j->planes.alpha = next += most;
    j->planes.shadow = next + most;
    return 1;
}

/* Says why a picture is black. */
static void tell_black(job *j, const olat_frame *frame, const ssdgs_render_stats *stats) {
    const ssdgs_real *light = frame->light.intensity;
    const int baked = ssdgs_model_settings(j->model)->baked;
    const char *why = !stats->gaussians ? "the model holds no Gaussians"
                      : stats->rejected == stats->gaussians
                          ? "no Gaussian of the model can be drawn: their values are not finite"
                      : !stats->visible ? "no Gaussian is in the picture: is this the model's dataset?"
                      : !stats->shaded  ? "the Gaussians in the picture are too faint or too small to show"
                      : stats->blackened == stats->shaded ? "the Gaussians' colours are not finite"
                      : !baked && !j->given[SKY] && !frame->more_count && !(light[0] > 0) &&
                              !(light[1] > 0) && !(light[2] > 0)
                          ? "the light's intensity is 0"
                          : "no light reaches what the camera sees: is the light where it should be, and its "
                            "intensity in the model's unit?";
    if (!j->black++) fprintf(stderr, "relight: note: %s is black: %s\n", base_name(frame), why);
}

/* The image, and its metrics when there is a photograph, into job; with the components when they are asked
   for. */
static ssdgs_result render(job *j, int index, int components) {
    const olat_frame *frame = &j->data.frames[index];
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height;
    const ssdgs_settings *settings = ssdgs_model_settings(j->model);
    ssdgs_render_options options =
        frame->has_image ? ssdgs_render_options_exact() : ssdgs_render_options_default();
    for (int c = 0; c < 3; c++)
        options.ambient[0][c] = (ssdgs_real)(j->ambient * (double)settings->ambient[c]);
    ssdgs_image planes = j->planes;
    if (!components) {
        memset(&planes, 0, sizeof planes);
        planes.color = j->planes.color;
        planes.alpha = j->planes.alpha;
    }
    ssdgs_render_stats stats;
    ssdgs_light lights[OLAT_MOST_LIGHTS];
    const ssdgs_photo photo = olat_photo(frame);
    int count = olat_lights(&photo, lights);
    if (j->given[SKY]) {
        memcpy(lights, j->sky, sizeof j->sky);
        memcpy(options.ambient, j->sky_ambient, sizeof j->sky_ambient);
        count = SKY_LIGHTS;
    }
    const ssdgs_result result =
        ssdgs_render_ex(j->model, &photo.camera, lights, count, &options, &planes, &stats);
    if (result) return result;
    size_t i;
    for (i = 0; i < 3 * pixels && !(planes.color[i] > (ssdgs_real)1.5e-4); i++) {} /* less is the byte 0 */
    if (i == 3 * pixels) tell_black(j, frame, &stats);
    ssdgs_compose(planes.color, planes.alpha, pixels, settings->transfer, j->background, j->image);
    olat_compose(&photo, settings->transfer, j->background, j->photo);
    if (!frame->has_image) return SSDGS_OK;
    score *s = j->scores[0] + index;
    s->flip = olat_flip(j->image, j->photo, frame->camera.width, frame->camera.height);
    if (s->flip < 0) return SSDGS_ERR_MEMORY;
    return ssdgs_compare(j->context, j->image, j->photo, frame->camera.width, frame->camera.height, &s->is);
}

/* Scores a view whose camera and light may move to fit its photograph, which render() has left in job. */
static ssdgs_result fit(job *j, int index) {
    ssdgs_photo photo = olat_photo(j->data.frames + index);
    score *s = j->scores[1] + index;
    ssdgs_result result = ssdgs_refine_photo(j->model, &photo, j->background, FIT_STEPS);
    if (!result) result = ssdgs_evaluate(j->model, &photo, j->background, j->planes.color, &s->is);
    if (result) return result;
    s->flip = olat_flip(j->planes.color, j->photo, photo.camera.width, photo.camera.height);
    return s->flip < 0 ? SSDGS_ERR_MEMORY : SSDGS_OK;
}

/* One output as (h,w,3) bytes. Colours are encoded for display; normals, depth, shadow and alpha are shown as
   they are. */
static void show(job *j, const olat_frame *frame, int output) {
    size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height;
    const ssdgs_image *p = &j->planes;
    ssdgs_real *out = p->color, nearest = (ssdgs_real)1e30, farthest = 0;
    int transfer = SSDGS_TRANSFER_NONE;
    if (output >= DIFFUSE && output <= SCATTERING) {
        out = output == DIFFUSE ? p->diffuse : output == SPECULAR ? p->specular : p->scattering;
        transfer = ssdgs_model_settings(j->model)->transfer;
    } else if (output == PHOTO) {
        out = j->photo;
    } else if (output == IMAGE) {
        out = j->image;
    } else if (output == NORMAL) { /* -1 .. 1 to 0 .. 1, nothing to black */
        for (size_t i = 0; i < 3 * pixels; i++) out[i] = (p->normal[i] + p->alpha[i / 3]) / 2;
    } else if (output == DEPTH) { /* nearest white, farthest dark, nothing black */
        for (size_t i = 0; i < pixels; i++) {
            ssdgs_real depth = p->depth[i] / (p->alpha[i] + (ssdgs_real)1e-6);
            if (p->alpha[i] < (ssdgs_real)0.5) continue;
            if (depth < nearest) nearest = depth;
            if (depth > farthest) farthest = depth;
        }
        for (size_t i = 0; i < 3 * pixels; i++) {
            ssdgs_real a = p->alpha[i / 3], depth = p->depth[i / 3] / (a + (ssdgs_real)1e-6);
            out[i] = a * (1 - (ssdgs_real)0.8 * (depth - nearest) / (farthest - nearest + (ssdgs_real)1e-6));
        }
    } else {
        for (size_t i = 0; i < 3 * pixels; i++)
            out[i] = output == SHADOW ? p->shadow[i / 3] : p->alpha[i / 3];
    }
    ssdgs_to_bytes(out, 3 * pixels, transfer, j->bytes);
}

/* Puts the bytes, shrunk, into a cell of the sheet, which holds the largest frame. */
static void paste(job *j, const olat_frame *frame, int row, int column) {
    const int n = j->shrink;
    for (int y = 0; y < j->cell_height && (y + 1) * n <= frame->camera.height; y++)
        for (int x = 0; x < j->cell_width && (x + 1) * n <= frame->camera.width; x++)
            for (int c = 0; c < 3; c++) {
                int k, sum;
                for (sum = 0, k = 0; k < n * n; k++)
                    sum += j->bytes[3 * ((size_t)(y * n + k / n) * (size_t)frame->camera.width +
                                         (size_t)(x * n + k % n)) +
                                    (size_t)c];
                j->sheet[3 * ((row * j->cell_height + y) * SHEET_COLUMNS * j->cell_width +
                              column * j->cell_width + x) +
                         c] = (unsigned char)((sum + n * n / 2) / (n * n));
            }
}

/* Without extensions, which the outputs have not, and regardless of case, as some file systems are. */
static int compare_names(const void *a, const void *b) {
    const char *x = *(const char *const *)a, *y = *(const char *const *)b;
    const char *const ends[2] = {x + stem(x), y + stem(y)};
    while (x < ends[0] && y < ends[1] && tolower((unsigned char)*x) == tolower((unsigned char)*y)) x++, y++;
    return (x < ends[0] ? tolower((unsigned char)*x) : 0) - (y < ends[1] ? tolower((unsigned char)*y) : 0);
}

/* Whether one frame's name is another's with the suffix of an output. */
static int names_overlap(const char *const *names, int count) {
    int overlap = 0;
    for (int i = 0; i < count; i++)
        for (int output = DIFFUSE; output < OUTPUT_COUNT; output++) {
            const size_t length = stem(names[i]), ending = strlen(suffixes[output]);
            char other[256];
            const char *key = other;
            if (length < ending || memcmp(names[i] + length - ending, suffixes[output], ending)) continue;
            snprintf(other, sizeof other, "%.*s.", (int)(length - ending < 250 ? length - ending : 250),
                     names[i]);
            overlap |= bsearch(&key, names, (size_t)count, sizeof *names, compare_names) != NULL;
        }
    return overlap;
}

/* Frames of a path may have no file, those of several folders the same names, or one that is an output of
   another: they are numbered. */
static int name_frames(olat_dataset *data) {
    const char **names = (const char **)malloc((size_t)data->count * sizeof *names + 1);
    int named = 0, repeated = 0;
    if (!names) return !fail("out of memory");
    for (int i = 0; i < data->count; i++)
        if (data->frames[i].file) names[named++] = base_name(&data->frames[i]);
    qsort(names, (size_t)named, sizeof *names, compare_names);
    for (int i = 1; i < named; i++) repeated |= !compare_names(&names[i - 1], &names[i]);
    repeated |= names_overlap(names, named);
    free(names);
    for (int i = 0; i < data->count; i++) {
        olat_frame *frame = &data->frames[i];
        if (frame->file && !repeated) continue;
        free(frame->file);
        frame->file = (char *)malloc(16);
        if (!frame->file) return !fail("out of memory");
        sprintf(frame->file, "%04d", i);
    }
    return 1;
}

static int load_frames(job *j) {
    const ssdgs_real *from = ssdgs_model_settings(j->model)->origin;
    const double origin[3] = {(double)from[0], (double)from[1], (double)from[2]};
    ssdgs_real low[3], high[3];
    char error[512] = "", *path = (char *)malloc(strlen(j->dataset) + 64);
    const char *split = j->given[SPLIT];
    int valid = !strcmp(split, "valid"), path_wanted = j->given[TRAJECTORY] != NULL;
    if (!path) return !fail("out of memory");
    if (valid) { /* the dataset's own path, or the one made here */
        sprintf(path, "%s/transforms_valid.json", j->dataset);
        FILE *file = fopen(path, "rb");
        if (file) fclose(file);
        else path_wanted = 1;
    }
    free(path);
    char name[64];
    snprintf(name, sizeof name, "transforms_%s.json", path_wanted ? "train" : split);
    const olat_reader reader = {j->context, NULL, NULL};
    const int flags = OLAT_DOWNSCALE(j->downscale) | (path_wanted || !valid ? 0 : OLAT_NO_IMAGES);
    if (olat_load_at(j->dataset, name, flags, origin, &reader, &j->data, error)) return !fail(error);
    olat_print_notes(&j->data, "relight");
    const ssdgs_object placed = ssdgs_object_default(j->model);
    if (olat_bounds(&placed, low, high)) return !fail(ssdgs_error_message(j->context));
    if (olat_other_unit(&j->data, "the model", low, high, error))
        fprintf(stderr, "relight: note: %s\n", error);
    return (!path_wanted || make_trajectory(j)) && name_frames(&j->data);
}

/* The map that --sky names becomes lights. A white thing shows the numbers of a map that is alike all around,
   whatever unit the model's photographs had. No photograph was taken in this light: none is scored. */
static int load_sky(job *j) {
    char error[512] = "";
    int width, height;
    ssdgs_pixels format;
    void *map;
    olat__found found;
    memset(&found, 0, sizeof found);
    if (olat__image_file(j->given[SKY], 0, &width, &height, &format, &map, &found, error))
        return !fail(error);
    double axes[3][3];
    ssdgs_real to_world[9];
    find_axes(&j->data, axes);
    for (int k = 0; k < 9; k++) to_world[k] = (ssdgs_real)axes[k % 3][k / 3];
    const size_t count = 3 * (size_t)width * (size_t)height;
    ssdgs_real *pixels = (ssdgs_real *)malloc(count * sizeof *pixels);
    for (size_t i = 0; pixels && i < count; i++) {
        const ssdgs_real value = olat__number(map, format, 4 * (i / 3) + i % 3);
        pixels[i] = olat__is_light(format) ? value : ssdgs_srgb_decode(value);
    }
    const char *wrong = pixels
                            ? sky_lights(pixels, width, height, to_world, j->sky, SKY_LIGHTS, j->sky_ambient)
                            : "out of memory";
    free(pixels);
    free(map);
    if (wrong) return !fail(wrong);
    const ssdgs_real unit = 1 / ssdgs_model_settings(j->model)->light_scale;
    for (int k = 0; k < 3 * SKY_LIGHTS; k++) j->sky[k / 3].intensity[k % 3] *= unit;
    for (int k = 0; k < 27; k++) j->sky_ambient[k / 3][k % 3] *= unit;
    for (int i = 0; i < j->data.count; i++) j->data.frames[i].has_image = 0;
    return 1;
}

/* Saves the model, and takes what the file has: loading tells where it stands. */
static int save_model(job *j, const char *name) {
    char *path = output_path(j, NULL, name);
    if (!path) return 0;
    ssdgs_result result = ssdgs_model_save(j->model, path);
    if (!result) {
        ssdgs_model_destroy(j->model);
        result = ssdgs_model_load(j->context, path, &j->model, NULL);
    }
    free(path);
    return !result || !fail(ssdgs_error_message(j->context));
}

/* Gives the model the networks of another, which an editor has dropped. */
static int take_networks(job *j, const char *path, const ssdgs_load_stats *own) {
    ssdgs_model *original;
    ssdgs_load_stats trained;
    const char *problem;
    if (ssdgs_model_load(j->context, path, &original, &trained))
        return !fail(ssdgs_error_message(j->context));
    const ssdgs_result result = adopt_model(j->context, &j->model, own, original, &trained, &problem);
    ssdgs_model_destroy(original);
    if (result) return !fail(ssdgs_error_message(j->context));
    fprintf(stderr, "relight: note: settings, ASG and networks are those of %s\n", path);
    if (problem)
        fprintf(stderr, "relight: note: %s; the model is not drawn as it was trained where it was moved\n",
                problem);
    return 1;
}

static int relight(job *j) {
    score means[2];
    memset(means, 0, sizeof means);
    ssdgs_result result = ssdgs_context_create(&j->desc, &j->context);
    int row = 0, scored = 0;
    char error[512] = "";
    if (result) return fail(ssdgs_result_string(result));
    ssdgs_load_stats own;
    if (ssdgs_model_load(j->context, j->model_path, &j->model, &own))
        return fail(ssdgs_error_message(j->context));
    if (j->given[NETWORKS] && !take_networks(j, j->given[NETWORKS], &own)) return 1;
    if (!load_frames(j) || (j->given[SKY] && !load_sky(j))) return 1;
    if (olat_make_folder(j->out, error))
        return fail(error); /* so that paths can be told apart by what they are */
    if (!check_outputs(j) || !make_planes(j)) return 1;
    if (j->given[NETWORKS] && !save_model(j, "whole.ply")) return 1;
    if (j->reduce) {
        ssdgs_model *original = NULL;
        if (ssdgs_model_load(j->context, j->model_path, &original, NULL))
            return fail(ssdgs_error_message(j->context));
        result = reduce_model(j->context, &j->model, j->reduce);
        if (!result) {
            fprintf(stderr, "%d Gaussians learn what the model shows\n", ssdgs_model_count(j->model));
            result = reduce_teach(original, j->model);
        }
        ssdgs_model_destroy(original);
        if (result) return fail(ssdgs_error_message(j->context));
        if (!save_model(j, "reduced.ply")) return 1;
    }
    for (int i = 0; i < j->data.count; i++) {
        const olat_frame *frame = &j->data.frames[i];
        int components = j->given[COMPONENTS] != NULL;
        int on_sheet = row < j->sheet_rows && i == (2 * row + 1) * j->data.count / (2 * j->sheet_rows);
        result = render(j, i, components || on_sheet);
        if (result) return fail_with(j->context, result);
        for (int output = PHOTO; output < OUTPUT_COUNT; output++) {
            int written = output == IMAGE || (components && output != PHOTO),
                pasted = on_sheet && output < SHEET_COLUMNS;
            if (!written && !pasted) continue;
            show(j, frame, output);
            if (written && !write_image(j, frame, suffixes[output])) return 1;
            if (pasted) paste(j, frame, row, output);
            if (output == IMAGE && j->film && i < ROUND && i % FILM_STEP == 0) {
                const size_t size = 3 * (size_t)frame->camera.width * (size_t)frame->camera.height;
                memcpy(j->film + (size_t)(i / FILM_STEP) * size, j->bytes, size);
            }
        }
        row += on_sheet;
        if (!frame->has_image) continue;
        scored++;
        if (j->given[FIT]) result = fit(j, i);
        if (result) return fail_with(j->context, result);
        for (int k = 0; k < 2; k++) {
            means[k].is.psnr += j->scores[k][i].is.psnr;
            means[k].is.ssim += j->scores[k][i].is.ssim;
            means[k].flip += j->scores[k][i].flip;
        }
    }
    if (j->sheet && olat_write_png(j->given[SHEET], SHEET_COLUMNS * j->cell_width,
                                   j->sheet_rows * j->cell_height, 3, j->sheet, error))
        return fail(error);
    if (j->film && olat_write_pngs(j->given[ANIMATION], j->data.frames->camera.width,
                                   j->data.frames->camera.height, 3, j->film, FILM_FRAMES, FILM_DELAY, error))
        return fail(error);
    for (int k = 0; k < (j->given[FIT] ? 2 : 1) && scored; k++) {
        means[k].is.psnr /= scored;
        means[k].is.ssim /= scored;
        means[k].flip /= scored;
        printf("%s%s: PSNR %.2f SSIM %.4f FLIP %.4f (%d views)\n", j->given[SPLIT],
               k ? " (each camera and light fitted to its photograph)" : "", means[k].is.psnr,
               means[k].is.ssim, means[k].flip, scored);
    }
    if (scored && !write_metrics(j, means)) return 1;
    if (j->black > 1)
        fprintf(stderr, "relight: note: %d pictures of %d are black\n", j->black, j->data.count);
    printf("%d images in %s\n", j->data.count, j->out);
    return 0;
}

int main(int argc, char **argv) {
    job j;
    memset(&j, 0, sizeof j);
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help")) {
            for (size_t line = 0; line < sizeof help / sizeof *help; line++) puts(help[line]);
            return 0;
        }
    int status = parse(&j, argc, argv);
    if (!status) status = relight(&j);
    ssdgs_model_destroy(j.model);
    ssdgs_context_destroy(j.context);
    olat_free(&j.data);
    olat_guard_free(&j.guard);
    free(j.scores[0]);
    free(j.scores[1]);
    free(j.memory);
    free(j.bytes);
    free(j.sheet);
    free(j.film);
    return status;
}
