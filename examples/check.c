/* cc -O2 examples/check.c -o check -lm -lpthread: reads a capture before it is trained on, and says in plain
   words what is right and wrong with it. With --out it draws the photographs, small, and where cameras and
   lights were. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "olat.h"
#include "hull.h"
#include "judge.h"

enum { CELL = 96, COLUMNS = 12, MOST_CELLS = 96, RAYS = 1000, PLOT = 360, LISTED = 6 };

/* What one photograph shows. */
typedef struct facts {
    double shown;        /* share of its pixels that shows something: not transparent, not black */
    double bright, dark; /* light that 5 % of that exceeds, that 2 % falls below */
    double clipped;      /* share of it at full white */
    double noise;        /* standard deviation of stored values, 0 .. 1 */
    double sharp;        /* of its finest differences against coarser ones */
    int has_outline;
    double camera[3], light[3]; /* directions from the middle */
} facts;

typedef struct check {
    const char *dataset, *train_json, *out;
    int downscale;
    ssdgs_context *context;
    olat_dataset sets[2]; /* train, test */
    facts *found[2];
    ssdgs_train_options options;
    double box[6], middle[3]; /* the box as given, or infinite */
    char *notes;              /* what the trainer says, a line each */
    int problems;
} check;

static int fail(const char *message) {
    fprintf(stderr, "check: %s\n", message);
    return 1;
}

/* A line of the report; those that ask for something start with an arrow. */
OLAT__PRINTF(3, 4) static void say(check *k, int problem, const char *format, ...) {
    va_list values;
    printf(problem ? "-> " : "   ");
    va_start(values, format);
    vprintf(format, values);
    va_end(values);
    printf("\n");
    k->problems += problem;
}

static void toward(const double middle[3], const ssdgs_real *place, int directional, double direction[3]) {
    for (int c = 0; c < 3; c++) direction[c] = (double)place[c] - (directional ? 0 : middle[c]);
    const double length = sqrt(olat__dot(direction, direction));
    for (int c = 0; c < 3 && length > 0; c++) direction[c] /= length;
}

/* Fills facts; 0, or 1 when out of memory. */
static int look_at(const ssdgs_photo *photo, const double middle[3], facts *f) {
    const int w = photo->camera.width, h = photo->camera.height;
    const size_t n = (size_t)w * (size_t)h;
    const ssdgs_real black[3] = {0, 0, 0};
    ssdgs_real *stored = (ssdgs_real *)malloc(3 * n * sizeof *stored), eye[3];
    double *light = (double *)malloc(n * sizeof *light), *fine = (double *)malloc(n * sizeof *fine);
    unsigned char *shown = (unsigned char *)malloc(n);
    size_t count = 0, clear = 0, fines = 0;
    double clipped = 0, second = 0, first = 0;
    const int failed = !stored || !light || !fine || !shown;
    if (!failed) {
        olat_compose(photo, SSDGS_TRANSFER_SRGB, black, stored);
        for (size_t i = 0; i < n; i++)
            clear += olat__number(photo->pixels, photo->format, 4 * i + 3) < (ssdgs_real)0.5;
        f->has_outline = clear > n / 100;
        for (size_t i = 0; i < n; i++) {
            const ssdgs_real *v = stored + 3 * i;
            const double most = fmax((double)v[0], fmax((double)v[1], (double)v[2]));
            double sum = 0;
            for (int c = 0; c < 3; c++) sum += (double)ssdgs_srgb_decode(v[c]) / 3;
            shown[i] = f->has_outline
                           ? olat__number(photo->pixels, photo->format, 4 * i + 3) >= (ssdgs_real)0.5
                           : most > 0.03;
            if (!shown[i]) continue;
            light[count++] = sum;
            clipped += most > 0.998 && most < 1.0005;
        }
        for (int y = 1; y < h - 1; y++)
            for (int x = 1; x < w - 1; x++) {
                double v[9], least = 1, most = 0;
                int whole = 1;
                for (int j = 0; j < 9; j++) {
                    const size_t at = (size_t)(y + j / 3 - 1) * (size_t)w + (size_t)(x + j % 3 - 1);
                    v[j] = (double)(stored[3 * at] + stored[3 * at + 1] + stored[3 * at + 2]) / 3;
                    least = fmin(least, v[j]), most = fmax(most, v[j]);
                    whole = whole && shown[at];
                }
                if (!whole || least < 0.02 || most > 0.98) continue;
                const double across = (v[5] - v[3]) / 2, down = (v[7] - v[1]) / 2,
                             curve = v[1] + v[3] + v[5] + v[7] - 4 * v[4];
                fine[fines++] =
                    fabs(v[0] - 2 * v[1] + v[2] - 2 * v[3] + 4 * v[4] - 2 * v[5] + v[6] - 2 * v[7] + v[8]);
                second += curve * curve;
                first += across * across + down * down;
            }
        f->shown = (double)count / (double)n;
        f->clipped = count ? clipped / (double)count : 0;
        f->dark = hull__quantile(light, (int)count, 0.02);
        f->bright = hull__quantile(light, (int)count, 0.95);
        /* a mask of norm 6: its median */
        f->noise = fines > 100 ? hull__quantile(fine, (int)fines, 0.5) / (6 * 0.6745) : 0;
        const double grain = f->noise * f->noise * (double)fines;
        f->sharp = first > 2 * grain && second > 25 * grain ? (second - 20 * grain) / (first - grain) : 0;
        olat_eye(&photo->camera, eye);
        toward(middle, eye, 0, f->camera);
        ssdgs_real place[3];
        olat_place(&photo->light, place);
        toward(middle, place, photo->light.kind == SSDGS_LIGHT_DIRECTIONAL, f->light);
    }
    free(stored), free(light), free(fine), free(shown);
    return failed;
}

/* ---- the report ---- */

/* The median of a member over the photographs. */
static double median_of(const facts *f, int count, size_t member) {
    double *values = (double *)malloc((size_t)count * sizeof *values);
    for (int i = 0; i < count && values; i++)
        memcpy(values + i, (const char *)(f + i) + member, sizeof *values);
    const double median = values ? hull__quantile(values, count, 0.5) : 0;
    free(values);
    return median;
}

/* Names photographs; `which` tells which. */
static void name_them(const check *k, const unsigned char *which) {
    const olat_dataset *set = k->sets;
    int listed = 0, more = 0;
    for (int i = 0; i < set->count; i++) {
        if (!which[i]) continue;
        if (listed == LISTED) more++;
        else
            printf("%s%s", listed++ ? ", " : "      ",
                   olat__tail(set->frames[i].file + strlen(k->dataset) + 1));
    }
    if (more) printf(" and %d more", more);
    printf("\n");
}

/* Says how many photographs a test found and names them, or nothing if there are none. */
#define TELL(k, condition, format) \
    do { \
        int found = 0; \
        for (int i = 0; i < set->count; i++) found += which[i] = (unsigned char)(condition); \
        if (found) { \
            say(k, 1, format, found, set->count); \
            name_them(k, which); \
        } \
    } while (0)

static int report_photographs(check *k) {
    const olat_dataset *set = k->sets;
    const facts *f = k->found[0];
    int outlines = 0, floats = 0, others = 0;
    double least = 1, most = 0;
    unsigned char *which = (unsigned char *)calloc((size_t)set->count, 1);
    if (!which) return fail("out of memory");
    for (int i = 0; i < set->count; i++) {
        outlines += f[i].has_outline;
        floats += olat__is_light(set->frames[i].format);
        others += set->frames[i].camera.width != set->frames[0].camera.width ||
                  set->frames[i].camera.height != set->frames[0].camera.height;
        least = fmin(least, f[i].shown), most = fmax(most, f[i].shown);
    }
    printf("Photographs\n");
    say(k, set->count < 40, "%d photographs of %d x %d%s%s%s", set->count, set->frames[0].camera.width,
        set->frames[0].camera.height, others ? " and other sizes" : "",
        floats == set->count ? ", in OpenEXR"
        : floats             ? ", some in OpenEXR"
                             : "",
        set->count < 40 ? ": a hundred and more, each from another place under another light, make a model "
                          "that can be relit"
                        : "");
    say(k, most < 0.05, "the object fills %.0f to %.0f %% of them%s", 100 * least, 100 * most,
        most < 0.05 ? ": move closer or crop" : "");
    if (!outlines)
        say(k, 1,
            "none shows an outline: make what is not the object transparent, or give masks (mask_path)");
    else if (outlines < set->count)
        say(k, 1, "%d of %d show an outline: the others are taken for opaque", outlines, set->count);
    else say(k, 0, "all show the object's outline");

    printf("Exposure\n");
    const double bright = median_of(f, set->count, offsetof(facts, bright)),
                 noise = median_of(f, set->count, offsetof(facts, noise)),
                 sharp = median_of(f, set->count, offsetof(facts, sharp));
    say(k, 0, "the brightest parts have %.0f %% of the light of full white", 100 * bright);
    TELL(k, f[i].bright < 0.05 && olat__dot(f[i].camera, f[i].light) > 0.3,
         "%d of %d are dark: more light, or a longer exposure told by pl_intensity");
    TELL(k, f[i].clipped > 0.02,
         "%d of %d are clipped at full white in more than 2 %% of the object: expose less, or save as "
         "OpenEXR");
    say(k, noise > 0.02,
        "grain is %.1f of 255, noise or fine texture: noise so strong keeps PSNR below %.0f dB%s",
        255 * noise, noise > 0 ? -20 * log10(noise) : 99.0,
        noise > 0.02 ? ". If it is noise: lower the ISO, more light" : "");
    TELL(k, sharp > 0 && f[i].sharp < 0.4 * sharp,
         "%d of %d are softer than the others: out of focus, or moved?");

    printf("Light\n");
    TELL(k, set->frames[i].more_count > 0, "%d of %d have several lights: what follows goes by the first");
    double share = 0, weight = 0, least_cosine = 1;
    for (int i = 0; i < set->count; i++) { /* only light from the side leaves parts that no lamp reaches */
        const double cosine = olat__dot(f[i].camera, f[i].light);
        least_cosine = fmin(least_cosine, cosine);
        if (cosine < 0.7 && f[i].bright > 0) share += f[i].dark / f[i].bright, weight++;
    }
    if (weight > 0) {
        share /= weight;
        say(k, share > 0.08, "the darkest parts have %.0f %% of the bright ones' light%s", 100 * share,
            share > 0.08 ? ": a bright room, or an object that light passes. Darken the room, or train "
                           "with --refine, which learns even light from the room"
                         : ": the room is dark");
    } else if (least_cosine >= 0.7) /* else what is lit from the side is black */
        say(k, 1,
            "all lights are within %.0f degrees of their camera: few shadows tell light from the room, and "
            "colour from light",
            57.29577951308232 * acos(fmin(1, least_cosine)));
    free(which);
    return 0;
}

/* The share of all directions that lie within 30 degrees of one that is given. */
static double coverage(const facts *f, int count, size_t member) {
    int near_one = 0;
    for (int r = 0; r < RAYS; r++) {
        const double z = 1 - (2 * r + 1.0) / RAYS, across = sqrt(1 - z * z), turn = 2.399963229728653 * r;
        const double ray[3] = {across * cos(turn), across * sin(turn), z};
        int i = 0;
        while (i < count &&
               olat__dot(ray, (const double *)(const void *)((const char *)(f + i) + member)) < 0.8660254)
            i++;
        near_one += i < count;
    }
    return (double)near_one / RAYS;
}

/* The median angle from a test photograph's direction to the nearest one in training, degrees. */
static double nearest(const check *k, size_t member) {
    const int count = k->sets[1].count;
    double *angles = (double *)malloc((size_t)count * sizeof *angles);
    for (int i = 0; i < count && angles; i++) {
        const double *to = (const double *)(const void *)((const char *)(k->found[1] + i) + member);
        double best = -1;
        for (int j = 0; j < k->sets[0].count; j++)
            best =
                fmax(best,
                     olat__dot(to, (const double *)(const void *)((const char *)(k->found[0] + j) + member)));
        angles[i] = 57.29577951308232 * acos(fmin(1, best));
    }
    const double median = angles ? hull__quantile(angles, count, 0.5) : 0;
    free(angles);
    return median;
}

static void report_places(check *k) {
    const facts *f = k->found[0];
    const int count = k->sets[0].count;
    const double cameras = coverage(f, count, offsetof(facts, camera)),
                 lights = coverage(f, count, offsetof(facts, light));
    char note[512];
    printf("Places\n");
    say(k, cameras < 0.3, "cameras see it from %.0f %% of all directions (within 30 degrees)%s",
        100 * cameras, cameras < 0.3 ? ": other views will be guesses" : "");
    say(k, lights < 0.3, "lights reach it from %.0f %%%s", 100 * lights,
        lights < 0.3 ? ": light from elsewhere will be a guess" : "");
    if (k->sets[1].count)
        say(k, 0,
            "test photographs: %.0f degrees from the nearest camera in training, %.0f from the nearest light "
            "(medians)",
            nearest(k, offsetof(facts, camera)), nearest(k, offsetof(facts, light)));
    if (olat_other_unit(k->sets, "the box that holds the object", k->options.bounds_min,
                        k->options.bounds_max, note))
        say(k, 1, "%s", note);
}

/* Keeps what the trainer notes. */
static void hear(void *user, ssdgs_result code, const char *message) {
    check *k = (check *)user;
    const size_t used = k->notes ? strlen(k->notes) : 0;
    char *longer = code ? NULL : (char *)realloc(k->notes, used + strlen(message) + 2);
    if (!longer) return;
    k->notes = longer;
    sprintf(longer + used, "%s\n", message);
}

typedef struct pace {
    double start, seconds;
    int gaussians;
} pace;

static int keep_time(void *user, const ssdgs_train_stats *stats) {
    pace *p = (pace *)user;
    if (stats->iteration == 10) p->start = olat_seconds(); /* the first steps also take memory */
    p->seconds = (olat_seconds() - p->start) / (stats->iteration - 10 + 1e-9);
    p->gaussians = stats->gaussians;
    return stats->iteration < 40;
}

/* What the photographs tell against each other. Begins to train: cameras, lights and outlines that contradict
   each other are noted, and steps take time. */
static int report_training(check *k) {
    ssdgs_photo *photos = olat_photos(k->sets);
    ssdgs_model *model = NULL;
    ssdgs_trainer *trainer = NULL;
    ssdgs_settings settings = ssdgs_settings_default();
    pace p = {0, 0, 0};
    for (int c = 0; c < 3; c++) settings.origin[c] = (ssdgs_real)k->sets[0].origin[c]; /* notes name places */
    const ssdgs_logger logger = {hear, k};
    ssdgs_result result = photos && !hull_judge(k->sets, &k->options, &logger) &&
                                  !judge_photos(photos, k->sets[0].count, &settings, &k->options, &logger)
                              ? ssdgs_model_create(k->context, &settings, 0, &model)
                              : SSDGS_ERR_MEMORY;
    if (!result) result = ssdgs_trainer_create(model, photos, k->sets[0].count, &k->options, &trainer);
    if (!result) result = ssdgs_trainer_run(trainer, keep_time, &p);
    if (result == SSDGS_ERR_CANCELLED) result = SSDGS_OK;
    printf("Training\n");
    for (char *line = k->notes; !result && line && *line;) {
        char *end = strchr(line, '\n');
        *end = 0;
        say(k, 1, "%s", line);
        line = end + 1;
    }
    if (result) fail(result == SSDGS_ERR_MEMORY ? "out of memory" : ssdgs_error_message(k->context));
    else
        say(k, 0,
            "%d iterations take %.0f minutes and more here: %.0f ms each at the start, with %d Gaussians",
            k->options.iterations, ceil(p.seconds * k->options.iterations / 60), 1e3 * p.seconds,
            p.gaussians);
    ssdgs_trainer_destroy(trainer);
    ssdgs_model_destroy(model);
    free(photos);
    return result != SSDGS_OK;
}

/* ---- pictures ---- */

/* Photographs in a sheet: clipped pixels red, dim ones blue. */
static int draw_sheet(const check *k, const char *path) {
    const olat_dataset *set = k->sets;
    const int cells = set->count < MOST_CELLS ? set->count : MOST_CELLS,
              columns = cells < COLUMNS ? cells : COLUMNS, rows = (cells + columns - 1) / columns,
              width = columns * CELL;
    const ssdgs_real black[3] = {0, 0, 0};
    char error[512];
    unsigned char *sheet = (unsigned char *)calloc((size_t)width * (size_t)(rows * CELL), 3);
    int failed = !sheet && fail("out of memory");
    for (int cell = 0; cell < cells && !failed; cell++) {
        const ssdgs_photo photo = olat_photo(set->frames + cell * set->count / cells);
        const int w = photo.camera.width, h = photo.camera.height, side = w > h ? w : h;
        ssdgs_real *stored = (ssdgs_real *)malloc(3 * (size_t)w * (size_t)h * sizeof *stored);
        if (!stored) failed = fail("out of memory");
        if (stored) olat_compose(&photo, SSDGS_TRANSFER_SRGB, black, stored);
        for (int y = 0; y < CELL - 4 && stored; y++)
            for (int x = 0; x < CELL - 4; x++) {
                const int u = (x * side / (CELL - 4)) - (side - w) / 2,
                          v = (y * side / (CELL - 4)) - (side - h) / 2;
                unsigned char *to = sheet + 3 * ((size_t)(cell / columns * CELL + y) * (size_t)width +
                                                 (size_t)(cell % columns * CELL + x));
                if (u < 0 || v < 0 || u >= w || v >= h) continue;
                const size_t at = (size_t)v * (size_t)w + (size_t)u;
                const int clear = olat__number(photo.pixels, photo.format, 4 * at + 3) < (ssdgs_real)0.5;
                ssdgs_to_bytes(stored + 3 * at, 3, SSDGS_TRANSFER_NONE, to);
                if (clear) continue;
                if (to[0] == 255 || to[1] == 255 || to[2] == 255) to[0] = 255, to[1] = to[2] = 0;
                else if (to[0] < 8 && to[1] < 8 && to[2] < 8) to[2] = 120;
            }
        free(stored);
    }
    if (!failed && olat_write_png(path, width, rows * CELL, 3, sheet, error)) failed = fail(error);
    free(sheet);
    return failed;
}

static void draw_dots(olat__writer *w, const facts *f, int count, size_t member, double middle,
                      const char *color, double radius) {
    for (int i = 0; i < count; i++) {
        const double *d = (const double *)(const void *)((const char *)(f + i) + member),
                     across = hypot(d[0], d[1]);
        const double r = across > 0 ? PLOT * 0.45 * sqrt((1 - d[2]) / 2) / across : 0;
        char text[160];
        snprintf(text, sizeof text, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" fill=\"%s\"/>\n",
                 middle + r * d[0], PLOT / 2 + 20 - r * d[1], radius, color);
        olat__write(w, text);
    }
}

/* Directions of cameras and lights from the object, by equal areas: up is the middle, down the rim. */
static int draw_places(const check *k, const char *path) {
    char error[512], text[512];
    olat__writer w;
    olat__writer_start(&w);
    snprintf(text, sizeof text,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
             "font-family=\"sans-serif\" font-size=\"13\">\n"
             "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
             2 * PLOT, PLOT + 40);
    olat__write(&w, text);
    for (int side = 0; side < 2; side++) {
        const double middle = PLOT * (side + 0.5);
        const size_t member = side ? offsetof(facts, light) : offsetof(facts, camera);
        snprintf(
            text, sizeof text,
            "<text x=\"%.0f\" y=\"18\" text-anchor=\"middle\">%s: z in the middle, -z at the rim</text>\n"
            "<circle cx=\"%.0f\" cy=\"%d\" r=\"%.1f\" fill=\"#f4f4f4\" stroke=\"#999\"/>\n"
            "<circle cx=\"%.0f\" cy=\"%d\" r=\"%.1f\" fill=\"none\" stroke=\"#bbb\"/>\n",
            middle, side ? "lights" : "cameras", middle, PLOT / 2 + 20, PLOT * 0.45, middle, PLOT / 2 + 20,
            PLOT * 0.45 * sqrt(0.5));
        olat__write(&w, text);
        draw_dots(&w, k->found[1], k->sets[1].count, member, middle, "#bbbbbb", 5);
        draw_dots(&w, k->found[0], k->sets[0].count, member, middle, side ? "#d07a00" : "#1f5fa8", 3);
    }
    snprintf(text, sizeof text, "<text x=\"8\" y=\"%d\" fill=\"#777\">grey: test</text>\n</svg>\n",
             PLOT + 32);
    olat__write(&w, text);
    return olat__writer_end(&w, path, error) && fail(error);
}

static int usage(void) {
    fprintf(stderr,
            "usage: check DATASET [--out DIR] [--bounds X,Y,Z,X,Y,Z] [--train-json FILE] [--downscale N]\n"
            "Says what is right and wrong with a capture; lines with an arrow ask for something.\n"
            "  --out DIR     draws into a folder: photographs.png (clipped: red, black: blue), places.svg\n"
            "  --bounds ...  corners of the box that holds the object; the dataset's own, else\n"
            "                -0.5,-0.5,-0.5,0.5,0.5,0.5\n"
            "  --train-json FILE  another list of frames in DATASET; transforms_train.json\n"
            "  --downscale N  photographs and cameras N times smaller, as train's\n");
    return 2;
}

static int run(check *k) {
    const char *const lists[2] = {k->train_json, "transforms_test.json"};
    static const char *const names[2] = {"photographs.png", "places.svg"};
    char error[512] = "", paths[2][OLAT__MAX_PATH], test[OLAT__MAX_PATH];
    ssdgs_context_desc desc;
    olat_guard guard;
    memset(&desc, 0, sizeof desc);
    memset(&guard, 0, sizeof guard);
    desc.logger.write = hear;
    desc.logger.user = k;
    int failed = snprintf(test, sizeof test, "%s/%s", k->dataset, lists[1]) >= (int)sizeof test &&
                 fail("the path is too long");
    FILE *file = failed ? NULL : fopen(test, "rb");
    if (file) fclose(file);
    if (!failed && k->out &&
        (olat_make_folder(k->out, error) || olat_guard_folder(&guard, k->dataset, lists[0], error) ||
         (file && olat_guard_folder(&guard, k->dataset, lists[1], error))))
        failed = fail(error);
    for (int i = 0; i < 2 && k->out && !failed; i++) {
        if (snprintf(paths[i], sizeof paths[i], "%s/%s", k->out, names[i]) >= (int)sizeof paths[i])
            failed = fail("the path is too long");
        else if (olat_guard_output(&guard, paths[i], error) || olat_check_writable(paths[i], error))
            failed = fail(error);
    }
    olat_guard_free(&guard);
    if (!failed && ssdgs_context_create(&desc, &k->context)) failed = fail("out of memory");
    const olat_reader reader = {k->context, NULL, NULL};
    for (int s = 0; s < (file ? 2 : 1) && !failed; s++) {
        if (olat_load_at(k->dataset, lists[s], OLAT_DOWNSCALE(k->downscale), s ? k->sets[0].origin : NULL,
                         &reader, k->sets + s, error))
            return fail(error);
        k->found[s] = (facts *)calloc((size_t)k->sets[s].count, sizeof **k->found);
        if (!k->found[s]) return fail("out of memory");
        for (int c = 0; c < 3 && !s; c++) {
            olat_box_side(k->sets, c, k->box[c], k->box[3 + c], k->options.bounds_min, k->options.bounds_max);
            k->middle[c] = (double)(k->options.bounds_min[c] + k->options.bounds_max[c]) / 2;
        }
        for (int i = 0; i < k->sets[s].count && !failed; i++) {
            const ssdgs_photo photo = olat_photo(k->sets[s].frames + i);
            failed = look_at(&photo, k->middle, k->found[s] + i) && fail("out of memory");
        }
    }
    if (failed) return 1;
    olat_print_notes(k->sets, "check");
    if (file && strcmp(k->sets[0].notes, k->sets[1].notes)) olat_print_notes(k->sets + 1, "check");
    if (report_photographs(k)) return 1;
    report_places(k);
    if (report_training(k)) return 1;
    if (k->out && (draw_sheet(k, paths[0]) || draw_places(k, paths[1]))) return 1;
    if (k->out) printf("%s, %s\n", paths[0], paths[1]);
    if (k->problems) printf("%d thing%s to look at\n", k->problems, k->problems == 1 ? "" : "s");
    else printf("nothing to look at\n");
    return 0;
}

int main(int argc, char **argv) {
    check k;
    memset(&k, 0, sizeof k);
    for (int c = 0; c < 6; c++) k.box[c] = HUGE_VAL;
    k.options = ssdgs_train_options_default();
    k.train_json = "transforms_train.json";
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--out") && i + 1 < argc && *argv[i + 1]) k.out = argv[++i];
        else if (!strcmp(argv[i], "--train-json") && i + 1 < argc) k.train_json = argv[++i];
        else if (!strcmp(argv[i], "--downscale") && i + 1 < argc) {
            double times;
            if (!olat_argument(argv[++i], &times) || !(times >= 1 && times <= 1024 && floor(times) >= times))
                return usage();
            k.downscale = (int)times;
        } else if (!strcmp(argv[i], "--bounds") && i + 1 < argc) {
            const char *at = argv[++i];
            for (int c = 0; c < 6; c++) {
                const size_t used = olat__parse_number(at, k.box + c);
                if (!used || at[used] != (c < 5 ? ',' : 0)) return usage();
                at += used + (c < 5);
            }
            for (int c = 0; c < 3; c++)
                if (!(k.box[c] < k.box[c + 3]))
                    return fail("--bounds: the first corner must be below the second"), 2;
        } else if (argv[i][0] != '-' && !k.dataset) k.dataset = argv[i];
        else return usage();
    }
    if (!k.dataset) return usage();
    const int failed = run(&k);
    for (int s = 0; s < 2; s++) {
        olat_free(k.sets + s);
        free(k.found[s]);
    }
    free(k.notes);
    ssdgs_context_destroy(k.context);
    return failed;
}
