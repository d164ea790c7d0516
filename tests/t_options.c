/* examples/train.c: what each option of its command line sets, and that it sets nothing else. cc -o
   build/t_options tests/t_options.c -lm -lpthread && build/t_options */
int train_main(int argc, char **argv);
#define main train_main
#include "../examples/train.c"
#undef main
#include "test.h"

static job parsed;

/* The exit status of parsing "train DATASET -o MODEL.ply" and these words, which a space divides. */
static int parse_words(const char *words) {
    static char text[512];
    char *argv[32];
    int argc = 0;
    snprintf(text, sizeof text, "train DATASET -o MODEL.ply%s%s", *words ? " " : "", words);
    for (char *word = strtok(text, " "); word && argc < 32; word = strtok(NULL, " ")) argv[argc++] = word;
    memset(&parsed, 0, sizeof parsed);
    return parse(&parsed, argc, argv);
}

static int alike(const void *got, const void *want, size_t count, const void *but, size_t size) {
    const unsigned char *a = (const unsigned char *)got, *b = (const unsigned char *)want,
                        *from = (const unsigned char *)but;
    int other = 0;
    for (size_t i = 0; i < count; i++) other += a[i] != b[i] && !(a + i >= from && a + i < from + size);
    return !other;
}

/* Whether settings and options are the preset's but for so many bytes. No padding lies between their members
   up to the rates. */
static int elsewhere_alike(int published, const void *but, size_t size) {
    const ssdgs_settings settings = published ? ssdgs_settings_published() : ssdgs_settings_default();
    const ssdgs_train_options options =
        published ? ssdgs_train_options_published() : ssdgs_train_options_default();
    return alike(&parsed.settings, &settings, sizeof settings, but, size) &&
           alike(&parsed.options, &options, offsetof(ssdgs_train_options, rates) + sizeof options.rates, but,
                 size);
}

static int sets_int(const char *words, const int *at, int value) {
    return !parse_words(words) && *at == value && elsewhere_alike(0, at, sizeof *at);
}

/* "NAME=VALUE": a value that the default has not. */
static int set_sets(const char *name, const void *at, int reals, int count) {
    char words[128];
    const double least = 3;
    int length = snprintf(words, sizeof words, "--set %s=%g", name, least), right = 1;
    for (int i = 1; i < count; i++)
        length += snprintf(words + length, sizeof words - (size_t)length, ",%g", least + i);
    if (parse_words(words)) return 0;
    for (int i = 0; i < count; i++)
        right &=
            reals ? ((const ssdgs_real *)at)[i] == (ssdgs_real)(least + i) : ((const int *)at)[i] == 3 + i;
    return right && elsewhere_alike(0, at, (size_t)count * (reals ? sizeof(ssdgs_real) : sizeof(int)));
}

static void test_choices(void) {
    const ssdgs_settings *s = &parsed.settings;
    const ssdgs_train_options *o = &parsed.options;
    CHECK(!parse_words("") && elsewhere_alike(0, NULL, 0) && !strcmp(parsed.dataset, "DATASET"));
    CHECK(!strcmp(parsed.given[OUTPUT], "MODEL.ply") && !parsed.progress.checkpoint_every &&
          !parsed.desc.threads);
    CHECK(!parse_words("--preset default") && elsewhere_alike(0, NULL, 0));
    CHECK(!parse_words("--preset published") && elsewhere_alike(1, NULL, 0) && o->iterations == 60000);
    CHECK(sets_int("--iterations 77", &o->iterations, 77));
    CHECK(sets_int("--points 78", &o->initial_points, 78));
    CHECK(sets_int("--max-gaussians 79", &o->max_gaussians, 79));
    CHECK(!parse_words("--seed 80") && o->seed == 80 && elsewhere_alike(0, &o->seed, sizeof o->seed));
    CHECK(!parse_words("--threads 5") && parsed.desc.threads == 5 && elsewhere_alike(0, NULL, 0));
    CHECK(!parse_words("--isa scalar") && parsed.desc.isa == SSDGS_ISA_SCALAR);
    CHECK(!parse_words("--checkpoint-every 9") && parsed.progress.checkpoint_every == 9);
    CHECK(sets_int("--schedule merged", &o->schedule, SSDGS_SCHEDULE_MERGED));
    CHECK(sets_int("--schedule progressive", &o->schedule, SSDGS_SCHEDULE_PROGRESSIVE));
    CHECK(sets_int("--schedule joint", &o->schedule, SSDGS_SCHEDULE_JOINT));
    CHECK(sets_int("--schedule swapped", &o->schedule, SSDGS_SCHEDULE_SWAPPED));
    CHECK(sets_int("--transfer srgb", &s->transfer, SSDGS_TRANSFER_SRGB));
    CHECK(sets_int("--transfer none", &s->transfer, SSDGS_TRANSFER_NONE));
    CHECK(sets_int("--transfer linear", &s->transfer, SSDGS_TRANSFER_NONE));
    CHECK(sets_int("--terms diffuse", &s->terms, SSDGS_DIFFUSE_TERM));
    CHECK(sets_int("--terms specular", &s->terms, SSDGS_SPECULAR_TERM));
    CHECK(sets_int("--terms shadow,diffuse", &s->terms, SSDGS_SHADOW_TERM | SSDGS_DIFFUSE_TERM));
    CHECK(sets_int("--terms diffuse,scattering", &s->terms, SSDGS_DIFFUSE_TERM | SSDGS_SCATTERING_TERM));
    CHECK(sets_int("--refine", &o->refine,
                   SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT | SSDGS_REFINE_INTENSITY | SSDGS_REFINE_AMBIENT));
    for (int white = 0; white < 2; white++) {
        CHECK(!parse_words(white ? "--background white" : "--background black"));
        for (int c = 0; c < 3; c++) CHECK(o->background[c] == (ssdgs_real)white);
        CHECK(elsewhere_alike(0, o->background, sizeof o->background));
    }
    CHECK(!parse_words("--train-json other.json") && !strcmp(parsed.given[TRAIN_JSON], "other.json"));
    CHECK(!parse_words("--resume") && parsed.given[RESUME] && !parsed.given[VIEW] &&
          elsewhere_alike(0, NULL, 0));
    /* what is set goes over a preset, wherever it stands */
    CHECK(!parse_words("--set dssim=0.5 --preset published") && o->dssim == (ssdgs_real)0.5);
    CHECK(elsewhere_alike(1, &o->dssim, sizeof o->dssim));
}

/* A trained model's last steps: fine ones, of all terms, without density control. */
static void test_refit(void) {
    const ssdgs_train_options o = ssdgs_train_options_default();
    const ssdgs_rate *was = &o.rates.position, *is = &parsed.options.rates.position;
    CHECK(!parse_words("--refit OTHER.ply") && !strcmp(parsed.given[REFIT], "OTHER.ply"));
    CHECK(parsed.options.iterations == 1000 && parsed.options.schedule == SSDGS_SCHEDULE_JOINT &&
          !parsed.options.densify_until && !parsed.options.opacity_reset_every);
    for (int i = 0; i < 12; i++) {
        const double start = i == 0 ? 0.03 : i < 10 ? 0.3 : 1, end = i < 10 ? 0.3 : 1;
        CHECK(fabs((double)is[i].start / (double)was[i].start - start) < 1e-6 &&
              fabs((double)is[i].end / (double)was[i].end - end) < 1e-6);
    }
    CHECK(!parse_words("--refit OTHER.ply --iterations 30") && parsed.options.iterations == 30);
    CHECK(parse_words("--refit OTHER.ply --terms diffuse") == 2);
}

static void test_set(void) {
    const ssdgs_settings *s = &parsed.settings;
    const ssdgs_train_options *o = &parsed.options;
    struct {
        const char *name;
        const void *at;
        int reals, count;
    } const set[] = {{"dipole", &s->dipole, 0, 1},
                     {"asg", &s->asg, 0, 1},
                     {"per_channel_optics", &s->per_channel_optics, 0, 1},
                     {"depth_cue", &s->depth_cue, 0, 1},
                     {"transport", &s->transport, 0, 1},
                     {"residual_shadow", &s->residual_shadow, 0, 1},
                     {"shadow_on_scattering", &s->shadow_on_scattering, 0, 1},
                     {"scattering_layers", &s->scattering.layers, 0, 1},
                     {"scattering_width", &s->scattering.width, 0, 1},
                     {"view_octaves", &s->octaves.view, 0, 1},
                     {"light_octaves", &s->octaves.light, 0, 1},
                     {"shadow_layers", &s->shadow.layers, 0, 1},
                     {"shadow_width", &s->shadow.width, 0, 1},
                     {"light_blur", &s->light_map.blur, 0, 1},
                     {"light_map_size", &s->light_map.size, 0, 1},
                     {"light_bias", &s->light_map.bias, 1, 1},
                     {"pixel_variance", &s->pixel_variance, 1, 1},
                     {"eta", &s->eta, 1, 1},
                     {"ambient", s->ambient, 1, 3},
                     {"random_background", &o->random_background, 0, 1},
                     {"densify_every", &o->densify_every, 0, 1},
                     {"batch", &o->batch, 0, 1},
                     {"densify_from", &o->densify_from, 0, 1},
                     {"densify_until", &o->densify_until, 0, 1},
                     {"opacity_reset_every", &o->opacity_reset_every, 0, 1},
                     {"refine", &o->refine, 0, 1},
                     {"dssim", &o->dssim, 1, 1},
                     {"normal_weight", &o->normal_weight, 1, 1},
                     {"densify_gradient", &o->densify_gradient, 1, 1},
                     {"surplus", &o->surplus, 1, 1},
                     {"prune_outside", &o->prune_outside, 1, 1},
                     {"adam_epsilon", &o->adam_epsilon, 1, 1},
                     {"finish", &o->finish, 1, 1},
                     {"position", &o->rates.position, 1, 2},
                     {"opacity", &o->rates.opacity, 1, 2},
                     {"scale", &o->rates.scale, 1, 2},
                     {"rotation", &o->rates.rotation, 1, 2},
                     {"color", &o->rates.color, 1, 2},
                     {"asg", &o->rates.asg, 1, 2},
                     {"frame", &o->rates.frame, 1, 2},
                     {"material", &o->rates.material, 1, 2},
                     {"shadow", &o->rates.shadow, 1, 2},
                     {"scattering", &o->rates.scattering, 1, 2},
                     {"camera_rate", &o->rates.camera, 1, 2},
                     {"light_rate", &o->rates.light, 1, 2}};
    const size_t count = sizeof set / sizeof *set;
    CHECK(count + 2 == sizeof fields / sizeof *fields); /* and the bounds' corners */
    for (size_t i = 0; i < count; i++)
        if (!CHECK(set_sets(set[i].name, set[i].at, set[i].reals, set[i].count)))
            printf("    --set %s\n", set[i].name);
    for (int corner = 0; corner < 2; corner++) {
        CHECK(!parse_words(corner ? "--set bounds_max=1000001,2.5,3" : "--set bounds_min=1000001,2.5,3"));
        const double *at = corner ? parsed.bounds.bounds_max : parsed.bounds.bounds_min,
                     *other = corner ? parsed.bounds.bounds_min : parsed.bounds.bounds_max;
        CHECK(at[0] == 1000001 && at[1] == 2.5 && at[2] == 3);
        for (int k = 0; k < 3; k++) CHECK(!(other[k] < HUGE_VAL));
        CHECK(elsewhere_alike(0, NULL, 0));
    }
}

static void test_refused(void) {
    static const char *const words[] = {
        "OTHER",           "--nothing 1",        "--seed",          "--seed -1",        "--seed 1x",
        "--iterations 0",  "--threads 1025",     "--terms light",   "--terms diffuse,", "--preset paper",
        "--schedule all",  "--background red",   "--isa mmx",       "--transfer gamma", "--set dssim",
        "--set dssim=",    "--set dssim=1,2",    "--set batch=1.5", "--set ambient=1",  "--set nothing=1",
        "--set asg=1,2,3", "--set position=0.1", "--points 0",      "--max-gaussians 0"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (!CHECK(parse_words(words[i]) == 2)) printf("    %s\n", words[i]);
}

int main(void) {
    test_choices();
    test_refit();
    test_set();
    test_refused();
    TEST_END();
}
