/* cc -O2 examples/train.c -o train -lm -lpthread (Windows: -lws2_32): trains a relightable model from a
   folder of OLAT photographs */
#define SSDGS_IMPLEMENTATION
#ifdef _WIN32
#include <winsock2.h> /* before windows.h */
#endif
#include "../ssdgs.h"
#include "olat.h"
#include "flip.h"
#include "hull.h"
#include "judge.h"
#include "reduce.h"
#include "unbake.h"
#include "picture.h"
#include "view.h"
#include <errno.h>
#include <signal.h>
#include <time.h>
#ifdef _WIN32
#include <io.h>
#define on_terminal() _isatty(2)
#else
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>
#define on_terminal() isatty(2)
#endif

static char program[] = "train";

enum {
    OUTPUT,
    ITERATIONS,
    BACKGROUND,
    PRESET,
    TRANSFER,
    SCHEDULE,
    TERMS,
    SEED,
    THREADS,
    MAX_GAUSSIANS,
    START_POINTS,
    CHECKPOINT_EVERY,
    ISA,
    TRAIN_JSON,
    SET,
    REFIT,
    DOWNSCALE,
    RESUME,
    REFINE,
    KEEP_BEST,
    VIEW,
    OPTION_COUNT /* the flags, RESUME and on, take no value */
};
static const char *const option_names[OPTION_COUNT] = {
    "-o",       "--iterations", "--background", "--preset",        "--transfer",  "--schedule",
    "--terms",  "--seed",       "--threads",    "--max-gaussians", "--points",    "--checkpoint-every",
    "--isa",    "--train-json", "--set",        "--refit",         "--downscale", "--resume",
    "--refine", "--keep-best",  "--view"};

static const char *const help[] = {
    "usage: train DATASET -o MODEL.ply [OPTION...]",
    "Trains a relightable model on a folder of photographs, each under known light, and tests it on",
    "transforms_test.json where the folder has one. examples/olat.h says what a folder holds.",
    "",
    "  -o MODEL.ply             the model",
    "  --iterations N           20000, published 60000; the schedule scales with it",
    "  --background COLOUR      black (default) or white: behind transparent pixels, around opaque",
    "                           objects",
    "  --preset NAME            default, or published: the paper's model, order of terms, density control",
    "                           and rates",
    "  --transfer NAME          srgb: shade in linear light, compare as seen (default); none (published)",
    "                           or, for OpenEXR, linear: fit the numbers in the files",
    "  --schedule NAME          order of the terms: merged (default), progressive (published), joint,",
    "                           swapped",
    "  --terms LIST             of diffuse,specular,shadow,scattering; all",
    "  --refine                 also fits cameras' poses, lights' places and intensities, into",
    "                           MODEL.ply.refined.json, and even light from the room, into the model",
    "  --refit MODEL.ply        instead of a start from points: merges a trained model's Gaussians until",
    "                           --max-gaussians are left, and trains those for 1000 iterations",
    "  --downscale N            photographs, masks and cameras N times smaller: means of N x N pixels' light",
    "  --keep-best              holds every tenth photograph out and keeps the model that scores best on",
    "                           those, in MODEL.ply.best until the run ends",
    "  --checkpoint-every N     writes MODEL.ply.ckpt every N iterations, not only at the end and at Ctrl-C",
    "  --view                   shows the model as it trains in the browser: prints the address to open",
    "  --resume                 goes on from MODEL.ply.ckpt, bit for bit; give the other options again. Only",
    "                           --iterations, --max-gaussians and rates may be others: longer, say",
    "  --points N               random points at the start, of which those outside of the outlines go;",
    "                           10000",
    "  --max-gaussians N        at most so many Gaussians in the end, twice as many before; three eighths of",
    "                           the pixels that a photograph shows (published: 100000 at any time)",
    "  --train-json FILE        another list of frames in DATASET; transforms_train.json",
    "  --seed N                 of the random numbers; 1",
    "  --threads N              0 = one per CPU (default); the result does not depend on it",
    "  --isa NAME               scalar, sse2, avx2, avx512 or neon; the best that this machine has",
    "  --set bounds_min=X,Y,Z   the box that holds the object, in the dataset's units; the dataset's own,",
    "                           else -0.5,-0.5,-0.5",
    "  --set bounds_max=X,Y,Z   its other corner; 0.5,0.5,0.5",
    "  --set ambient=R,G,B      even light from the room, where it is known; 0,0,0",
    "  --set NAME=VALUE         a number of ssdgs_settings or ssdgs_train_options; may be repeated",
    "  --set NAME=START,END     a learning rate's first and last value; the names, which ssdgs.h",
    "                           explains:"};
static const char *const help_end[] = {
    "",
    "Photographs should be transparent where the object is not, by their alpha or a mask_path. Opaque",
    "ones whose borders have the colour of --background are taken to show it, and Gaussians of that",
    "colour fade (--set prune_outside=0 keeps them); all that other opaque photographs show is taken",
    "for opaque. Exposures may differ where the lights' intensities tell it. What is clipped at full",
    "white may have been brighter; OpenEXR is light as it is.",
    "",
    "Notes tell what cannot be right or cannot work: a camera whose axes, lens or pose is wrong, lights",
    "that the shading contradicts, cameras or lights that all stand in one place or move together,",
    "masks that contradict the others (they are left out), colours multiplied by alpha or mixed with a",
    "background, an object that the box does not hold, frames lit from all around, exposures that differ",
    "untold, OpenEXR that is not linear light.",
    "",
    "--refine tests with and without fitting the test views' poses and lights. Training anew with",
    "--train-json and the refined list, moved into DATASET, gains up to 0.4 dB. No file of the dataset",
    "is ever replaced, nor is the checkpoint of a run that is further than this one will get."};

static int usage(const char *problem, const char *what) {
    fprintf(stderr, "train: %s %s\nusage: train DATASET -o MODEL.ply [OPTION...]; train --help lists them\n",
            problem, what);
    return 2;
}

/* The bounds in the dataset's coordinates, which may be too large for floats; infinite: not given. */
typedef struct corners {
    double bounds_min[3], bounds_max[3];
} corners;

/* What --set can set, by the names of ssdgs.h: so many ints, reals or, of corners, doubles. */
typedef enum place { IN_SETTINGS, IN_OPTIONS, IN_CORNERS } place;
typedef struct field {
    const char *name;
    place in;
    int reals, count;
    size_t at;
} field;
#define PART(reals, name, member) \
    { #name, IN_SETTINGS, reals, 1, offsetof(ssdgs_settings, member) }
#define SETTING(reals, name) PART(reals, name, name)
#define OPTION(reals, count, name) \
    { #name, IN_OPTIONS, reals, count, offsetof(ssdgs_train_options, name) }
#define RATE(name, member) \
    { #name, IN_OPTIONS, 1, 2, offsetof(ssdgs_train_options, member) }
#define CORNER(name) \
    { #name, IN_CORNERS, 1, 3, offsetof(corners, name) }
static const field fields[] = {SETTING(0, dipole),
                               SETTING(0, asg),
                               SETTING(0, per_channel_optics),
                               SETTING(0, depth_cue),
                               SETTING(0, transport),
                               SETTING(0, residual_shadow),
                               SETTING(0, shadow_on_scattering),
                               PART(0, scattering_layers, scattering.layers),
                               PART(0, scattering_width, scattering.width),
                               PART(0, view_octaves, octaves.view),
                               PART(0, light_octaves, octaves.light),
                               PART(0, shadow_layers, shadow.layers),
                               PART(0, shadow_width, shadow.width),
                               PART(0, light_blur, light_map.blur),
                               PART(0, light_map_size, light_map.size),
                               PART(1, light_bias, light_map.bias),
                               SETTING(1, pixel_variance),
                               SETTING(1, eta),
                               {"ambient", IN_SETTINGS, 1, 3, offsetof(ssdgs_settings, ambient)},
                               OPTION(0, 1, random_background),
                               OPTION(0, 1, densify_every),
                               OPTION(0, 1, batch),
                               OPTION(0, 1, densify_from),
                               OPTION(0, 1, densify_until),
                               OPTION(0, 1, opacity_reset_every),
                               OPTION(0, 1, refine),
                               OPTION(1, 1, dssim),
                               OPTION(1, 1, normal_weight),
                               CORNER(bounds_min),
                               CORNER(bounds_max),
                               OPTION(1, 1, densify_gradient),
                               OPTION(1, 1, surplus),
                               OPTION(1, 1, prune_outside),
                               OPTION(1, 1, adam_epsilon),
                               OPTION(1, 1, finish),
                               RATE(position, rates.position),
                               RATE(opacity, rates.opacity),
                               RATE(scale, rates.scale),
                               RATE(rotation, rates.rotation),
                               RATE(color, rates.color),
                               RATE(asg, rates.asg),
                               RATE(frame, rates.frame),
                               RATE(material, rates.material),
                               RATE(shadow, rates.shadow),
                               RATE(scattering, rates.scattering),
                               RATE(camera_rate, rates.camera),
                               RATE(light_rate, rates.light)};

static void print_help(void) {
    for (size_t i = 0; i < sizeof help / sizeof *help; i++) puts(help[i]);
    int column = 0;
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
        if (fields[i].in == IN_CORNERS) continue;
        const int length = (int)strlen(fields[i].name) + 1;
        if (column && column + length > 105) column = 0, printf("\n");
        column += column ? printf(" %s", fields[i].name) : printf("      %s", fields[i].name);
    }
    printf("\n");
    for (size_t i = 0; i < sizeof help_end / sizeof *help_end; i++) puts(help_end[i]);
}

/* NAME=VALUE[,VALUE...], the name and the number of values telling the field; what is wrong, or NULL. */
static const char *set_field(ssdgs_settings *settings, ssdgs_train_options *options, corners *bounds,
                             const char *text) {
    unsigned char *const places[3] = {(unsigned char *)settings, (unsigned char *)options,
                                      (unsigned char *)bounds};
    size_t length = strcspn(text, "=");
    const char *p = text + length, *problem = "--set knows no such number:";
    int count = 0;
    for (size_t i = length; text[i]; i++) count += text[i] == '=' || text[i] == ',';
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
        const field *f = fields + i;
        unsigned char *to = places[f->in] + f->at;
        if (strlen(f->name) != length || strncmp(text, f->name, length)) continue;
        problem = "cannot set (rates take START,END, corners X,Y,Z, ambient R,G,B)";
        if (f->count != count) continue;
        for (int n = 0; n < count; n++) {
            char *end;
            double value = strtod(p + 1, &end);
            ssdgs_real real = (ssdgs_real)value;
            int whole = value > -2e9 && value < 2e9 ? (int)value : 0;
            if (end == p + 1 || (*end && *end != ',')) return problem;
            if (!f->reals && !(value >= whole && value <= whole)) return problem;
            if (f->in == IN_CORNERS && !(fabs(value) < HUGE_VAL)) return problem;
            if (f->in == IN_CORNERS) memcpy(to + (size_t)n * sizeof value, &value, sizeof value);
            else if (f->reals) memcpy(to + (size_t)n * sizeof real, &real, sizeof real);
            else memcpy(to, &whole, sizeof whole);
            p = end;
        }
        return NULL;
    }
    return problem;
}

/* The place of word[0 .. length) in a list like "black|white", or -1. */
static int choice(const char *list, const char *word, size_t length) {
    int index = 0;
    for (;; index++) {
        size_t n = strcspn(list, "|");
        if (n == length && !memcmp(list, word, n)) return index;
        if (!list[n]) return -1;
        list += n + 1;
    }
}

/* An option's choice into value, when it was given. */
static int choose(const char *const *given, int option, const char *list, int *value) {
    int index = given[option] ? choice(list, given[option], strlen(given[option])) : *value;
    if (index < 0) return 0;
    *value = index;
    return 1;
}

static int number(const char *const *given, int option, int least, int *value) {
    if (!given[option]) return 1;
    char *end;
    const long parsed = strtol(given[option], &end, 10);
    if (end == given[option] || *end || parsed < least || parsed > 2000000000) {
        char problem[64];
        snprintf(problem, sizeof problem, "%s needs a number from %d to 2000000000, not",
                 option_names[option], least);
        return usage(problem, given[option]), 0;
    }
    *value = (int)parsed;
    return 1;
}

static const char *clock_text(double seconds, char text[32]) {
    int s = seconds < 3e6 ? (int)(seconds + 0.5) : 3000000;
    if (s >= 3600) snprintf(text, 32, "%d:%02d:%02d", s / 3600, s / 60 % 60, s % 60);
    else snprintf(text, 32, "%d:%02d", s / 60, s % 60);
    return text;
}

static volatile sig_atomic_t interrupted;

static void on_interrupt(int signal_number) {
    interrupted = 1;
    signal(signal_number, SIG_DFL); /* a second Ctrl-C ends the program at once */
}

enum { BYTES_A_PIXEL = 175, BYTES_A_GAUSSIAN = 3200 }; /* of training, see tests/EXPERIMENTS.md */

typedef struct run {
    int iterations, batch, checkpoint_every, judge_every, terminal;
    int kept; /* iterations in the checkpoint that another run left: it is replaced once this run has done as
                 many */
    int done; /* iterations of this run */
    int first, drawn_at, percent; /* iteration of the first call and of the last line; last 5% step written */
    double start, drawn, speed, psnr;
    double best;       /* PSNR of the photographs held out */
    int best_at;       /* its iteration; 0: before this run went on, -1: none yet */
    view_server *view; /* who watches; NULL */
} run;

/* Whether the last step came to a multiple. */
static int is_due(const run *r, int every, int done) {
    return every && done / every != (done - r->batch) / every;
}

/* Answers those who watch, and waits while they ask for it. What they see changes no bit of the run. */
static void show(run *r, const ssdgs_train_stats *stats) {
    r->view->show.training.iteration = stats->iteration;
    r->view->show.training.loss = stats->loss;
    r->view->show.training.psnr = r->psnr;
    r->view->show.training.left =
        r->speed > 0 && stats->iteration < r->iterations ? (r->iterations - stats->iteration) / r->speed : 0;
    for (int rounds = 0; rounds < 16 && view_poll(r->view, 0); rounds++) {}
    const double begun = olat_seconds();
    while (r->view->show.training.paused && !interrupted) view_poll(r->view, 100);
    r->drawn += olat_seconds() - begun; /* a pause is no part of the speed */
}

static int progress(void *user, const ssdgs_train_stats *stats) {
    run *r = (run *)user;
    const int total = r->iterations;
    const int done = stats->iteration < total ? stats->iteration : total; /* the last batch may go past it */
    int percent = (int)(100.0 * done / total), finished = done >= total;
    double now = olat_seconds();
    r->done = done;
    if (r->first < 0) { /* the first step also allocates: time starts after it */
        r->first = r->drawn_at = done;
        r->start = r->drawn = now;
        r->percent = percent / 5;
        r->psnr = stats->psnr;
    }
    r->psnr += 0.02 * (stats->psnr - r->psnr);
    char left[32];
    if (r->speed <= 0 && done >= r->first + 50) {
        r->speed = (done - r->first) / (now - r->start + 1e-9);
        fprintf(stderr, "at this speed %s for the %d iterations left; it falls as Gaussians are added\n",
                clock_text((total - done) / r->speed, left), total - done);
    }
    if (r->speed > 0 && (finished || (r->terminal ? now > r->drawn + 0.2 : percent / 5 > r->percent))) {
        double weight = 1 - exp(-(now - r->drawn) / 5); /* the last seconds count */
        if (done > r->drawn_at && now > r->drawn)
            r->speed += weight * ((done - r->drawn_at) / (now - r->drawn) - r->speed);
        if (r->terminal)
            fprintf(stderr, "\r|%.*s%.*s| ", percent / 10, "##########", 10 - percent / 10, "----------");
        fprintf(stderr, "%d/%d loss %.4f PSNR %.1f %d Gaussians %.1f/s %s left%s", done, total, stats->loss,
                r->psnr, stats->gaussians, r->speed, clock_text((total - done) / r->speed, left),
                r->terminal && !finished ? "   " : "\n");
        if (finished && stats->skipped_steps)
            fprintf(stderr, "%d steps were refused: a gradient was not finite\n", stats->skipped_steps);
        r->drawn = now;
        r->drawn_at = done;
        r->percent = percent / 5;
    }
    if (r->view) show(r, stats);
    return !interrupted &&
           (finished || !(is_due(r, r->checkpoint_every, done) || is_due(r, r->judge_every, done)));
}

/* Everything the program holds; main releases it. */
typedef struct job {
    const char *program, *given[OPTION_COUNT], *dataset;
    ssdgs_settings settings;
    ssdgs_train_options options;
    corners bounds;
    ssdgs_context_desc desc;
    run progress;
    char *checkpoint, *refined, *best; /* paths, and NULL where none is written */
    olat_guard guard;
    olat_dataset train_set, test_set;
    ssdgs_photo *photos, *test_photos;
    int count, downscale; /* photographs that are trained on; those held out follow */
    ssdgs_context *context;
    ssdgs_model *model;
    ssdgs_trainer *trainer;
    view_server view;
} job;

static int parse(job *j, int argc, char **argv) {
    const char **given = j->given;
    int sets = 0, white = 0, preset = 0, seed = 1, isa = 0;
    for (int i = 1; i < argc; i++) {
        if (argv[i][0] != '-') {
            if (j->dataset) return usage("a second dataset:", argv[i]);
            j->dataset = argv[i];
            continue;
        }
        int option;
        for (option = 0; option < OPTION_COUNT && strcmp(argv[i], option_names[option]); option++) {}
        if (option == OPTION_COUNT) return usage("no such option:", argv[i]);
        if (option < RESUME && i + 1 == argc) return usage("a value is missing after", argv[i]);
        given[option] = option < RESUME ? argv[++i] : "";
        if (option == SET) argv[sets++] = argv[i]; /* for later: they change what a preset has set */
    }
    if (!j->dataset || !given[OUTPUT]) return usage("needs a DATASET and", "-o MODEL.ply");
    j->downscale = 1;

    if (!choose(given, PRESET, "default|published", &preset)) return usage("no such preset:", given[PRESET]);
    j->settings = preset ? ssdgs_settings_published() : ssdgs_settings_default();
    ssdgs_settings unchanged;
    memcpy(&unchanged, &j->settings, sizeof unchanged);
    j->options = preset ? ssdgs_train_options_published() : ssdgs_train_options_default();
    if (given[REFIT]) reduce_fine_steps(&j->options, 1000);
    if (!choose(given, BACKGROUND, "black|white", &white))
        return usage("no such background:", given[BACKGROUND]);
    if (!choose(given, TRANSFER, "srgb|none|linear", &j->settings.transfer))
        return usage("no such transfer:", given[TRANSFER]);
    if (j->settings.transfer > SSDGS_TRANSFER_NONE) /* linear: another word for none */
        j->settings.transfer = SSDGS_TRANSFER_NONE;
    if (!choose(given, SCHEDULE, "progressive|joint|swapped|merged", &j->options.schedule))
        return usage("no such schedule:", given[SCHEDULE]);
    const char *terms = given[TERMS];
    if (terms) j->settings.terms = 0;
    while (terms) {
        size_t length = strcspn(terms, ",");
        int term = choice("diffuse|specular|shadow|scattering", terms,
                          length); /* in the order of the SSDGS_*_TERM bits */
        if (term < 0) return usage("no such term in --terms", given[TERMS]);
        j->settings.terms |= 1 << term;
        terms = terms[length] ? terms + length + 1 : NULL;
    }
    while (given[ISA] && isa < SSDGS_ISA_COUNT && strcmp(given[ISA], ssdgs_isa_string((ssdgs_isa)isa))) isa++;
    if (isa == SSDGS_ISA_COUNT) return usage("no such instruction set:", given[ISA]);
    if (!number(given, ITERATIONS, 1, &j->options.iterations) ||
        !number(given, START_POINTS, 1, &j->options.initial_points) ||
        !number(given, MAX_GAUSSIANS, 1, &j->options.max_gaussians) ||
        !number(given, CHECKPOINT_EVERY, 1, &j->progress.checkpoint_every) ||
        !number(given, DOWNSCALE, 1, &j->downscale) || !number(given, SEED, 0, &seed) ||
        !number(given, THREADS, 0, &j->desc.threads))
        return 2;
    if (j->downscale > 1024) return usage("--downscale needs a number from 1 to 1024, not", given[DOWNSCALE]);
    if (j->desc.threads > 1024) return usage("--threads needs a number from 0 to 1024, not", given[THREADS]);
    j->options.seed = (uint64_t)seed;
    j->options.background[0] = j->options.background[1] = j->options.background[2] = (ssdgs_real)white;
    if (given[REFINE])
        j->options.refine =
            SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT | SSDGS_REFINE_INTENSITY | SSDGS_REFINE_AMBIENT;
    for (int i = 0; i < 3; i++) j->bounds.bounds_min[i] = j->bounds.bounds_max[i] = HUGE_VAL;
    const char *problem;
    for (int i = 0; i < sets; i++)
        if ((problem = set_field(&j->settings, &j->options, &j->bounds, argv[i])) != NULL)
            return usage(problem, argv[i]);
    if (given[REFIT] && memcmp(&unchanged, &j->settings, sizeof unchanged))
        return usage("--refit keeps what the model computes: not for it are --transfer, --terms, settings of",
                     "--set");
    j->desc.isa = (ssdgs_isa)isa;
    j->desc.logger.write = olat_hear;
    j->desc.logger.user = program;
    return 0;
}

static int fail(const char *message) {
    fprintf(stderr, "train: %s\n", message);
    return 1;
}

/* Says what the library's last failure was, and the file of a training photograph that it names by number. */
static int fail_of(const job *j) {
    const char *message = ssdgs_error_message(j->context), *number = strstr(message, "photograph ");
    char *end = NULL;
    const long index = number ? strtol(number + 11, &end, 10) : -1;
    if (!number || end == number + 11 || index < 0 || index >= j->train_set.count) return fail(message);
    fprintf(stderr, "train: %s (photograph %ld is %s)\n", message, index, j->train_set.frames[index].file);
    return 1;
}

/* Prints the means over every step-th of the photographs, each one's pose and light first fitted by so many
   steps. */
static ssdgs_result evaluate(job *j, const ssdgs_photo *photos, int all, int step, int fit_steps,
                             const char *label) {
    double psnr = 0, ssim = 0, flip = 0;
    int count = (all + step - 1) / step;
    for (int i = 0; i < count; i++) {
        ssdgs_photo photo = photos[i * step];
        ssdgs_result result =
            fit_steps ? ssdgs_refine_photo(j->model, &photo, j->options.background, fit_steps) : SSDGS_OK;
        const size_t values = 3 * (size_t)photo.camera.width * (size_t)photo.camera.height;
        ssdgs_real *images = (ssdgs_real *)malloc(2 * values * sizeof *images); /* rendered, photographed */
        if (!result && !images) result = SSDGS_ERR_MEMORY;
        ssdgs_metrics m;
        if (!result) result = ssdgs_evaluate(j->model, &photo, j->options.background, images, &m);
        double seen = 0;
        if (!result) {
            olat_compose(&photo, ssdgs_model_settings(j->model)->transfer, j->options.background,
                         images + values);
            seen = olat_flip(images, images + values, photo.camera.width, photo.camera.height);
            if (seen < 0) result = SSDGS_ERR_MEMORY;
        }
        free(images);
        if (result) return result;
        psnr += m.psnr / count;
        ssim += m.ssim / count;
        flip += seen / count;
    }
    printf("%s: PSNR %.2f SSIM %.4f FLIP %.4f (%d views)\n", label, psnr, ssim, flip, count);
    return SSDGS_OK;
}

/* As irradiance, which the lamps' is 1 of on average. */
static void tell_ambient(const ssdgs_settings *s) {
    printf("light from the room: %.3f,%.3f,%.3f of the lamps'; relight --ambient 0 leaves it out\n",
           (double)(s->ambient[0] * s->light_scale), (double)(s->ambient[1] * s->light_scale),
           (double)(s->ambient[2] * s->light_scale));
}

static void print_peak_memory(void) {
#ifndef _WIN32
#ifdef __APPLE__
    double unit = 1; /* bytes there, KiB elsewhere */
#else
    double unit = 1024;
#endif
    struct rusage used;
    if (!getrusage(RUSAGE_SELF, &used))
        printf(", peak memory %.0f MiB", (double)used.ru_maxrss * unit / 1048576);
#endif
}

/* No output may be one of the dataset's files, and all must be writable: better known now than after hours of
   training. */
static int check_outputs(job *j, const char *train_json, char error[512]) {
    const char *const outputs[4] = {j->given[OUTPUT], j->checkpoint, j->refined, j->best};
    if (j->given[REFIT] && olat_guard_input(&j->guard, j->given[REFIT], error)) return 1;
    if (olat_guard_folder(&j->guard, j->dataset, train_json, error) ||
        olat_guard_folder(&j->guard, j->dataset, "transforms_train.json", error) ||
        olat_guard_folder(&j->guard, j->dataset, "transforms_test.json", error) ||
        olat_guard_folder(&j->guard, j->dataset, "transforms_valid.json", error))
        return 1;
    for (int i = 0; i < 4; i++)
        if (outputs[i] &&
            (olat_guard_output(&j->guard, outputs[i], error) || olat_check_writable(outputs[i], error)))
            return 1;
    return 0;
}

/* A run that is further than this one must not be lost for it. */
static int check_checkpoint(job *j, char error[512]) {
    FILE *file = fopen(j->checkpoint, "rb");
    if (!file) return 0;
    fclose(file);
    int done, all;
    if (ssdgs_checkpoint_iteration(j->context, j->checkpoint, &done, &all))
        return sprintf(error, "%.300s, and would be replaced: remove it, or give another name with -o",
                       ssdgs_error_message(j->context)),
               1;
    if (done >= all) return 0; /* its model is there */
    if (done > j->options.iterations)
        return sprintf(error,
                       "%.300s holds a run of %d iterations, and this one of %d would replace it: go on with "
                       "--resume, give "
                       "another name with -o, or remove it",
                       j->checkpoint, done, j->options.iterations),
               1;
    j->progress.kept = done;
    return 0;
}

/* The training photographs' cameras and lights as refined, for what follows and in a file beside the
   model. */
static int save_refined(job *j, char error[512]) {
    for (int i = 0; i < j->count; i++) {
        olat_frame *frame = &j->train_set.frames[i];
        ssdgs_trainer_refined(j->trainer, i, &frame->camera, &frame->light);
        j->photos[i].camera = frame->camera;
        j->photos[i].light = frame->light;
    }
    const int failed = olat_save(j->refined, j->dataset, &j->train_set, error);
    if (!failed)
        printf("%s: cameras and lights as refined; in the dataset's folder --train-json reads it\n",
               j->refined);
    return failed;
}

/* Says what memory the run takes, before it is taken; the first photograph stands for all. */
static int tell_memory(const job *j, const char *train_json, int has_test, char error[512]) {
    const double million = 1e6;
    const int threads = ssdgs_context_threads(j->context);
    double photographs = 0, pixels = 0, shown = 0, reading = 0;
    for (int s = 0; s <= has_test; s++) {
        olat_need need;
        if (olat_memory(j->dataset, s ? "transforms_test.json" : train_json, OLAT_DOWNSCALE(j->downscale),
                        &need, error))
            return 1;
        photographs += need.bytes;
        pixels = fmax(pixels, need.pixels);
        shown = fmax(shown, need.shown);
        reading = fmax(reading, need.reading);
    }
    const double gaussians = j->options.max_gaussians ? j->options.max_gaussians : fmin(50000, 0.375 * shown),
                 step = BYTES_A_PIXEL * pixels,
                 model = BYTES_A_GAUSSIAN * gaussians * (double)j->options.surplus, running = step + model,
                 decoding = reading * threads, all = photographs + fmax(running, decoding) + 30 * million;
    fprintf(stderr, "memory: about %.0f MB, %.0f of them for the photographs", all / million,
            photographs / million);
    if (decoding > running)
        fprintf(stderr, ", %.0f while %d threads read them\n", decoding / million, threads);
    else {
        fprintf(stderr, ", %.0f for a step, %.0f for Gaussians", step / million, model / million);
        fprintf(stderr,
                all < 2000 * million         ? "\n"
                : model > photographs + step ? "; --max-gaussians %.0f would halve it\n"
                                             : "; --downscale %.0f would take less than half\n",
                model > photographs + step ? gaussians / 3 : 2.0 * j->downscale);
    }
    return 0;
}

/* Every tenth photograph goes behind the others, to judge the model by. */
static int hold_out(job *j) {
    const int count = j->train_set.count;
    olat_frame *frames = j->train_set.frames;
    j->count = count;
    if (!j->given[KEEP_BEST]) return 0;
    if (count < 10) return fail("--keep-best needs ten photographs and more");
    olat_frame *sorted = (olat_frame *)malloc((size_t)count * sizeof *sorted);
    if (!sorted) return fail("out of memory");
    j->count = 0;
    for (int turn = 0, at = 0; turn < 2; turn++)
        for (int i = 0; i < count; i++)
            if ((i % 10 == 5) == turn) sorted[at++] = frames[i], j->count += !turn;
    memcpy(frames, sorted, (size_t)count * sizeof *frames);
    free(sorted);
    j->progress.judge_every = j->options.iterations > 20 ? j->options.iterations / 20 : 1;
    return 0;
}

/* The mean PSNR of the photographs that are held out. */
static ssdgs_result score(const job *j, ssdgs_model *model, double *psnr) {
    const int held = j->train_set.count - j->count;
    ssdgs_result result = SSDGS_OK;
    *psnr = 0;
    for (int i = j->count; i < j->train_set.count && !result; i++) {
        ssdgs_metrics metrics;
        result = ssdgs_evaluate(model, j->photos + i, j->options.background, NULL, &metrics);
        *psnr += metrics.psnr / held;
    }
    return result;
}

/* Judges the model as it is; the best so far lies beside the output. */
static ssdgs_result judge(job *j) {
    run *r = &j->progress;
    double psnr;
    ssdgs_result result = score(j, j->model, &psnr);
    const int best = r->best_at < 0 || psnr > r->best;
    if (!result && best) result = ssdgs_model_save(j->model, j->best);
    if (result) return result;
    if (best) r->best = psnr, r->best_at = r->done;
    fprintf(stderr, "%sheld out: PSNR %.2f after %d iterations%s\n", r->terminal ? "\n" : "", psnr, r->done,
            best ? ", the best so far" : "");
    return SSDGS_OK;
}

/* A run that goes on has left its best model, which is judged anew; one that begins has none. */
static ssdgs_result judge_kept(job *j) {
    ssdgs_model *kept = NULL;
    run *r = &j->progress;
    r->best_at = -1;
    if (!olat_exists(j->best)) return SSDGS_OK;
    if (!j->given[RESUME]) return remove(j->best), SSDGS_OK;
    ssdgs_result result = ssdgs_model_load(j->context, j->best, &kept, NULL);
    if (!result) result = score(j, kept, &r->best);
    if (!result) {
        r->best_at = 0;
        fprintf(stderr, "held out: PSNR %.2f so far at best\n", r->best);
    }
    ssdgs_model_destroy(kept);
    return result;
}

/* The best model becomes the output. */
static int keep_best(const job *j, char error[512]) {
    unsigned char *bytes = NULL;
    size_t size = 0;
    const int failed = olat__read_file(j->best, &bytes, &size, error) ||
                       olat__write_file(j->given[OUTPUT], bytes, size, error);
    free(bytes);
    if (failed) return 1;
    remove(j->best);
    if (j->progress.best_at == j->progress.done)
        printf("%s: the last model scores best on", j->given[OUTPUT]);
    else if (j->progress.best_at > 0)
        printf("%s: that after %d iterations scores best on", j->given[OUTPUT], j->progress.best_at);
    else printf("%s: one from before the run went on scores best on", j->given[OUTPUT]);
    printf(" the photographs held out, %.2f\n", j->progress.best);
    return 0;
}

/* Opens the page that shows the model as it trains. */
static int watch(job *j, char error[512]) {
    char page[OLAT__MAX_PATH];
    view_show *show = &j->view.show;
    show->context = j->context;
    show->models[0] = j->model;
    show->names[0] = j->given[OUTPUT];
    show->objects[0] = ssdgs_object_default(j->model);
    show->count = show->training.on = 1;
    show->training.iterations = j->options.iterations;
    show->training.photos = j->photos;
    show->training.count = j->count;
    for (int c = 0; c < 3; c++) {
        show->middle[c] = (j->options.bounds_min[c] + j->options.bounds_max[c]) / 2;
        show->radius = fmaxf(show->radius, (j->options.bounds_max[c] - j->options.bounds_min[c]) / 2);
    }
    if (view_page(__FILE__, j->program, page, sizeof page, error) || view_open(&j->view, page, error))
        return 1;
    fprintf(stderr, "to watch: http://127.0.0.1:%d\n", j->view.port);
    j->progress.view = &j->view;
    return 0;
}

/* A line where reading takes more than a second. user: when it began. */
static void tell_reading(void *user, int done, int count) {
    if (olat_seconds() - *(const double *)user > 1)
        fprintf(stderr, "\rphotographs read: %d of %d%s", done, count, done == count ? "\n" : "");
}

static int train(job *j) {
    const char *output = j->given[OUTPUT],
               *train_json = j->given[TRAIN_JSON] ? j->given[TRAIN_JSON] : "transforms_train.json";
    char error[512] = "", *test_json = (char *)malloc(strlen(j->dataset) + 32);
    int width = 0, height = 0;
    const int refines = j->options.refine != 0;
    double start = olat_seconds();
    j->checkpoint = (char *)malloc(strlen(output) + 8);
    if (refines) j->refined = (char *)malloc(strlen(output) + 16);
    if (j->given[KEEP_BEST]) j->best = (char *)malloc(strlen(output) + 8);
    if (!j->checkpoint || !test_json || (refines && !j->refined) || (j->given[KEEP_BEST] && !j->best))
        return free(test_json), fail("out of memory");
    sprintf(j->checkpoint, "%s.ckpt", output);
    if (refines) sprintf(j->refined, "%s.refined.json", output);
    if (j->best) sprintf(j->best, "%s.best", output);
    sprintf(test_json, "%s/transforms_test.json", j->dataset);
    const int has_test = olat_exists(test_json);
    free(test_json);
    if (check_outputs(j, train_json, error)) return fail(error);

    if (j->given[VIEW]) {
        j->desc.tracer.stage = view_stage;
        j->desc.tracer.user = &j->view.show;
    }
    ssdgs_result result = ssdgs_context_create(&j->desc, &j->context);
    if (result) return fail(ssdgs_result_string(result));
    if (tell_memory(j, train_json, has_test, error)) return fail(error);
    double origin[3] = {0, 0, 0};
    if (j->given[REFIT]) {
        if (ssdgs_model_load(j->context, j->given[REFIT], &j->model, NULL))
            return fail(ssdgs_error_message(j->context));
        result = j->options.max_gaussians ? reduce_model(j->context, &j->model, j->options.max_gaussians)
                                          : SSDGS_OK;
        if (result) return fail(ssdgs_error_message(j->context));
        for (int i = 0; i < 3; i++) origin[i] = (double)ssdgs_model_settings(j->model)->origin[i];
    }
    const olat_reader reader = {j->context, on_terminal() ? tell_reading : NULL, &start};
    const int flags = OLAT_DOWNSCALE(j->downscale);
    if (olat_load_at(j->dataset, train_json, flags, j->model ? origin : NULL, &reader, &j->train_set, error))
        return fail(error);
    if (has_test && olat_load_at(j->dataset, "transforms_test.json", flags, j->train_set.origin, &reader,
                                 &j->test_set, error))
        return fail(error);
    if (hold_out(j)) return 1;
    olat_print_notes(&j->train_set, "train");
    if (strcmp(j->train_set.notes, j->test_set.notes)) olat_print_notes(&j->test_set, "train");
    for (int i = 0; i < 3; i++) {
        j->settings.origin[i] = (ssdgs_real)j->train_set.origin[i];
        olat_box_side(&j->train_set, i, j->bounds.bounds_min[i], j->bounds.bounds_max[i],
                      j->options.bounds_min, j->options.bounds_max);
    }
    if (olat_other_unit(&j->train_set, "bounds_min .. bounds_max", j->options.bounds_min,
                        j->options.bounds_max, error))
        fprintf(stderr, "train: note: %s\n", error);
    j->photos = olat_photos(&j->train_set);
    if (j->count < 40 && j->options.iterations > 300 * j->count && !j->given[KEEP_BEST])
        fprintf(stderr,
                "train: note: %d iterations are many for %d photographs: these may be learnt by heart while "
                "other views and lights gain nothing. Try --keep-best, --iterations %d, or take more "
                "photographs\n",
                j->options.iterations, j->count, 100 * j->count);
    if (!j->photos || hull_judge(&j->train_set, &j->options, &j->desc.logger) ||
        judge_photos(j->photos, j->count, j->model ? ssdgs_model_settings(j->model) : &j->settings,
                     &j->options, &j->desc.logger))
        return fail("out of memory");
    for (int i = 0; i < j->train_set.count; i++) {
        if (j->photos[i].camera.width > width) width = j->photos[i].camera.width;
        if (j->photos[i].camera.height > height) height = j->photos[i].camera.height;
    }
    if (!j->given[RESUME] && check_checkpoint(j, error)) return fail(error);
    if ((!j->model && ssdgs_model_create(j->context, &j->settings, 0, &j->model)) ||
        ssdgs_trainer_create(j->model, j->photos, j->count, &j->options, &j->trainer))
        return fail_of(j);
    fprintf(stderr, "%s: %d photographs of %dx%d; %d threads, %s\n", j->dataset, j->train_set.count, width,
            height, ssdgs_context_threads(j->context), ssdgs_isa_string(ssdgs_context_isa(j->context)));
    if (j->given[RESUME]) {
        if (ssdgs_trainer_load(j->trainer, j->checkpoint)) return fail_of(j);
        if (!ssdgs_checkpoint_iteration(j->context, j->checkpoint, &j->progress.done, NULL) &&
            j->progress.done >= j->options.iterations)
            fprintf(stderr, "train: note: %d iterations are done already: --iterations asks for no more\n",
                    j->progress.done);
    }
    if (j->best && judge_kept(j)) return fail_of(j);

    if (j->given[VIEW] && watch(j, error)) return fail(error);
    j->progress.iterations = j->options.iterations;
    j->progress.batch = j->options.batch;
    j->progress.terminal = on_terminal();
    j->progress.first = -1;
    signal(SIGINT, on_interrupt);
#ifdef SIGXFSZ
    signal(SIGXFSZ, SIG_IGN); /* a file that may not grow is an error as any other */
#endif
    while ((result = ssdgs_trainer_run(j->trainer, progress, &j->progress)) == SSDGS_ERR_CANCELLED) {
        if (j->best && is_due(&j->progress, j->progress.judge_every, j->progress.done) && judge(j))
            return fail(ssdgs_error_message(j->context));
        if (!interrupted && !is_due(&j->progress, j->progress.checkpoint_every, j->progress.done)) continue;
        if (j->progress.done < j->progress.kept) {
            if (!interrupted) continue;
            fprintf(stderr,
                    "\nstopped; %s stays as it is, of a run that is further (%d iterations): --resume goes "
                    "on with that\n",
                    j->checkpoint, j->progress.kept);
            return 130;
        }
        if (ssdgs_trainer_save(j->trainer, j->checkpoint)) return fail(ssdgs_error_message(j->context));
        if (interrupted) {
            fprintf(stderr, "\nstopped; the same command with --resume goes on from %s\n", j->checkpoint);
            return 130;
        }
    }
    signal(SIGINT, SIG_DFL);
    view_close(&j->view);
    if (result) return fail_of(j);
    const int saved = !(j->best ? judge(j) : ssdgs_model_save(j->model, output));
    if (!saved) fail(ssdgs_error_message(j->context));
    const int lost = ssdgs_trainer_save(j->trainer, j->checkpoint) && fail(ssdgs_error_message(j->context));
    if (!saved && !lost)
        sprintf(error, "the trained model is in %.440s; --resume saves it", j->checkpoint), fail(error);
    if (!saved) return 1;
    if (j->best && keep_best(j, error)) return fail(error);
    char text[32];
    if (refines && save_refined(j, error)) return fail(error);
    ssdgs_trainer_destroy(j->trainer); /* what is tested is what the file holds */
    ssdgs_model_destroy(j->model);
    j->trainer = NULL;
    j->model = NULL;
    if (ssdgs_model_load(j->context, output, &j->model, NULL)) return fail(ssdgs_error_message(j->context));
    printf("%s: %d Gaussians, trained in %s", output, ssdgs_model_peek(j->model).count,
           clock_text(olat_seconds() - start, text));
    print_peak_memory();
    printf("\n");
    if (j->options.max_gaussians && ssdgs_model_peek(j->model).count > j->options.max_gaussians)
        fprintf(
            stderr,
            "train: note: these are more than --max-gaussians %d: density control had ended. --refit merges "
            "them\n",
            j->options.max_gaussians);
    if (j->options.refine & SSDGS_REFINE_AMBIENT) tell_ambient(ssdgs_model_settings(j->model));
    if (!has_test) return lost;
    j->test_photos = olat_photos(&j->test_set);
    if (!j->test_photos) return fail("out of memory");
    result = evaluate(j, j->test_photos, j->test_set.count, 1, 0, "test");
    if (!result && refines)
        result = evaluate(j, j->test_photos, j->test_set.count, 1, 200,
                          "test (each photograph's pose and light fitted to it)");
    if (!result) result = evaluate(j, j->photos, j->count, (j->count + 39) / 40, 0, "training");
    if (!result) return lost;
    return fail(result == SSDGS_ERR_MEMORY ? "out of memory" : ssdgs_error_message(j->context));
}

int main(int argc, char **argv) {
    job j;
    memset(&j, 0, sizeof j);
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help")) return print_help(), 0;
    j.program = argv[0];
    int status = parse(&j, argc, argv);
    if (!status) status = train(&j);
    view_close(&j.view);
    ssdgs_trainer_destroy(j.trainer);
    ssdgs_model_destroy(j.model);
    ssdgs_context_destroy(j.context);
    free(j.photos);
    free(j.test_photos);
    olat_free(&j.train_set);
    olat_free(&j.test_set);
    olat_guard_free(&j.guard);
    free(j.checkpoint);
    free(j.refined);
    free(j.best);
    return status;
}
