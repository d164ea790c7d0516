/* cc -O2 examples/unbake.c -o unbake -lm -lpthread: a plain splat, PLY or
   packed (splats.h), becomes a model that takes light. */
#define SSDGS_IMPLEMENTATION
#define SSDGS_NO_TRAINER
#include "../ssdgs.h"
#include "olat.h"
#include "splats.h"
#include "unbake.h"

static char program[] = "unbake";

/* The library's notes, but that a plain splat takes no light: now it does. */
static void hear(void *user, ssdgs_result code, const char *message) {
    if (!strstr(message, "lights change nothing")) olat_hear(user, code, message);
}

static int usage(FILE *to) {
    fprintf(
        to,
        "usage: unbake PLAIN -o LIT.ply [--ambient R,G,B] [--eye X,Y,Z ...] [--keep K]\n"
        "              [--medium S,A] [--roughness R] [--f0 F]\n"
        "  PLAIN            PLY, compressed PLY, or SPZ up to version 3\n"
        "  --ambient R,G,B  the even irradiance in which it was photographed; else its brightest albedo is\n"
        "                   taken for 0.9\n"
        "  --eye X,Y,Z      it is a room, photographed from there; up to 32 times\n"
        "  --keep K         share, 0 .. 1, of its own light that it keeps beside its lamps'\n"
        "  --medium S,A     it is of wax or skin: reduced scattering and absorption of one world unit\n"
        "  --roughness R    it has highlights, of Beckmann's roughness 0.01 .. 1\n"
        "  --f0 F           with --roughness: what they reflect from the front, above 0, up to 1; 0.04\n");
    return to == stderr ? 2 : 0;
}

/* Numbers with commas between them, all finite and at least so much. */
static int numbers(const char *text, int count, double least, ssdgs_real *out) {
    char copy[256], *at = copy;
    if (strlen(text) >= sizeof copy) return 0;
    strcpy(copy, text);
    for (int i = 0; i < count; i++) {
        char *comma = strchr(at, ',');
        double value;
        if (!comma != (i == count - 1)) return 0;
        if (comma) *comma = 0;
        if (!olat_argument(at, &value) || value < least || value > 1e6) return 0;
        out[i] = (ssdgs_real)value;
        if (comma) at = comma + 1;
    }
    return 1;
}

int main(int argc, char **argv) {
    static ssdgs_real eyes[UNBAKE__SKY][3];
    unbake_options options = unbake_options_default();
    const char *from = NULL, *to = NULL;
    char error[512] = "";
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL, *lit = NULL;
    ssdgs_context_desc desc;
    olat_guard guard;
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : "";
        ssdgs_real medium[2];
        int known = 1;
        if (!strcmp(argv[i], "--help")) return usage(stdout);
        if (!strcmp(argv[i], "-o") && i + 1 < argc) to = value;
        else if (!strcmp(argv[i], "--ambient")) known = numbers(value, 3, 0, options.ambient[0]);
        else if (!strcmp(argv[i], "--keep")) known = numbers(value, 1, 0, &options.kept);
        else if (!strcmp(argv[i], "--roughness")) known = numbers(value, 1, 0, &options.roughness);
        else if (!strcmp(argv[i], "--f0")) known = numbers(value, 1, 0, &options.f0);
        else if (!strcmp(argv[i], "--medium")) {
            known = numbers(value, 2, 0, medium);
            for (int c = 0; c < 3 && known; c++)
                options.scattering[c] = medium[0], options.absorption[c] = medium[1];
        } else if (!strcmp(argv[i], "--eye") && options.eye_count < UNBAKE__SKY)
            known = numbers(value, 3, -1e6, eyes[options.eye_count++]);
        else if (argv[i][0] != '-' && !from) {
            from = argv[i];
            continue;
        } else known = 0;
        if (!known) {
            fprintf(stderr, "unbake: what is %s%s%s?\n", argv[i], *value ? " " : "", value);
            return usage(stderr);
        }
        i++;
    }
    if (!from || !to) {
        fprintf(stderr, "unbake: needs PLAIN and -o LIT.ply\n");
        return usage(stderr);
    }
    options.eyes = (const ssdgs_real(*)[3])eyes;
    memset(&guard, 0, sizeof guard);
    int failed = olat_guard_input(&guard, from, error) || olat_guard_output(&guard, to, error);
    olat_guard_free(&guard);
    memset(&desc, 0, sizeof desc);
    desc.logger.write = hear;
    desc.logger.user = program;
    ssdgs_result result = failed ? SSDGS_OK : ssdgs_context_create(&desc, &context);
    if (!failed && !result) failed = splats_load(context, from, &model, NULL, error);
    if (!failed && !result && !ssdgs_model_settings(model)->baked)
        failed = olat__fail(error, "%s: is no plain splat, it takes light as it is", from);
    if (!failed && !result && ssdgs_model_settings(model)->harmonics && !(options.kept > 0))
        fprintf(stderr, "%s: %s: how its colours change with the view is left out\n", program, from);
    if (!failed && !result) result = unbake_model(context, model, &options, &lit);
    if (!failed && !result) result = ssdgs_model_save(lit, to);
    if (!failed && !result) printf("%s: %d Gaussians that take light\n", to, ssdgs_model_count(lit));
    if (failed) fprintf(stderr, "%s: %s\n", program, error);
    else if (result)
        fprintf(stderr, "%s: %s: %s\n", program, ssdgs_result_string(result), ssdgs_error_message(context));
    ssdgs_model_destroy(model);
    ssdgs_model_destroy(lit);
    ssdgs_context_destroy(context);
    return failed || result;
}
