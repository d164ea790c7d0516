/* usage: unbaked MODEL.ply DATASET black|white [SCATTERING,ABSORPTION]: how well plain splats take light. A
   trained model is baked under a sky, unbaked (examples/unbake.h), and scored on the dataset's test
   photographs under their lamps, times the gain that is best for all of them, as a plain file does not know
   their unit. Prints a line of a table for an even sky and for a coloured one that unbaking is not told. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/olat.h"
#include "../examples/unbake.h"

enum { VIEWS = 64, SIDE = 256 };

/* Colours of the Gaussians seen, summed over views. */
typedef struct bakery {
    double *sum;
    int *views;
} bakery;

static ssdgs_result take_colors(void *user, ssdgs_frame *frame) {
    bakery *b = (bakery *)user;
    for (int i = 0; i < frame->count; i++) {
        if (frame->seen[i] != SSDGS_SEEN) continue;
        for (int c = 0; c < 3; c++) b->sum[3 * i + c] += (double)frame->color[4 * i + c];
        b->views[i]++;
    }
    return ssdgs_stage_cpu(frame, SSDGS_STAGE_COMPOSITE);
}

/* Looks at the model from all around under a sky whose irradiance, times light_scale, is that. */
static ssdgs_result look(ssdgs_context *context, ssdgs_model *model, const double sky[9][3]) {
    static ssdgs_real picture[3 * SIDE * SIDE];
    const double light_scale = (double)ssdgs_model_settings(model)->light_scale;
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_real low[3], high[3], middle[3], size = 0;
    ssdgs_image image;
    ssdgs_scene *scene = NULL;
    memset(&image, 0, sizeof image);
    image.color = picture;
    for (int i = 0; i < 27; i++)
        options.ambient[i / 3][i % 3] = (ssdgs_real)(sky[i / 3][i % 3] / light_scale);
    ssdgs_result result = ssdgs_model_bounds(model, low, high);
    if (!result) result = ssdgs_scene_create(context, &scene);
    for (int c = 0; c < 3 && !result; c++) {
        middle[c] = (low[c] + high[c]) / 2;
        size = high[c] - low[c] > size ? high[c] - low[c] : size;
    }
    const ssdgs_object object = ssdgs_object_default(model);
    for (int i = 0; i < VIEWS && !result; i++) { /* on a spiral around the sphere */
        const double z = 1 - (2 * i + 1.0) / VIEWS, across = sqrt(1 - z * z), turn = 2.39996323 * i;
        const double away[3] = {across * cos(turn), across * sin(turn), z};
        const ssdgs_real steep = fabs(z) > 0.98, up[3] = {steep, 0, 1 - steep};
        ssdgs_real eye[3];
        for (int c = 0; c < 3; c++) eye[c] = middle[c] + (ssdgs_real)2.4 * size * (ssdgs_real)away[c];
        const ssdgs_camera camera = ssdgs_camera_look_at(eye, middle, up, (ssdgs_real)0.6, SIDE, SIDE);
        result = ssdgs_scene_render(scene, &object, 1, &camera, NULL, 0, &options, &image, NULL);
    }
    ssdgs_scene_destroy(scene);
    return result;
}

/* The model as a plain splat of degree 0. Gaussians that no view saw are left out. */
static ssdgs_result bake(const char *path, const double sky[9][3], ssdgs_context *context,
                         ssdgs_model **out) {
    ssdgs_context_desc desc;
    ssdgs_gpu_hook hook;
    ssdgs_context *own = NULL;
    ssdgs_model *model = NULL;
    ssdgs_settings settings = ssdgs_settings_default();
    bakery b = {NULL, NULL};
    memset(&desc, 0, sizeof desc);
    memset(&hook, 0, sizeof hook);
    hook.stage[SSDGS_STAGE_COMPOSITE] = take_colors;
    hook.user = &b;
    desc.gpu = &hook;
    ssdgs_result result = ssdgs_context_create(&desc, &own);
    if (!result) result = ssdgs_model_load(own, path, &model, NULL);
    const size_t n = result ? 1 : (size_t)ssdgs_model_count(model) + 1;
    b.sum = (double *)calloc(3 * n, sizeof *b.sum);
    b.views = (int *)calloc(n, sizeof *b.views);
    if (!b.sum || !b.views) result = SSDGS_ERR_MEMORY;
    if (!result) result = look(own, model, sky);
    int kept = 0;
    for (size_t i = 0; i < n; i++) kept += b.views[i] > 0;
    settings.baked = 1;
    settings.transfer = SSDGS_TRANSFER_NONE;
    if (!result) settings.pixel_variance = ssdgs_model_settings(model)->pixel_variance;
    if (!result) result = ssdgs_model_create(context, &settings, kept, out);
    if (!result) {
        const ssdgs_model_view from = ssdgs_model_peek(model), to = ssdgs_model_arrays(*out);
        for (size_t i = 0, k = 0; i + 1 < n; i++) {
            if (!b.views[i]) continue;
            for (size_t c = 0; c < SSDGS_DIFFUSE; c++)
                to.gaussians[c * to.stride + k] = from.gaussians[c * from.stride + i];
            for (size_t c = 0; c < 3; c++)
                to.gaussians[(SSDGS_DIFFUSE + c) * to.stride + k] =
                    (ssdgs_real)(((double)ssdgs_srgb_encode((ssdgs_real)(b.sum[3 * i + c] / b.views[i])) -
                                  0.5) /
                                 0.28209479177387814);
            k++;
        }
    }
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(own);
    free(b.sum);
    free(b.views);
    return result;
}

/* Mean dB of every step-th photograph, its lamps times `gain`; below 0: it failed. */
static double score(ssdgs_model *model, const olat_dataset *set, double gain, const ssdgs_real background[3],
                    int step) {
    double sum = 0;
    int count = 0;
    for (int i = 0; i < set->count; i += step, count++) {
        ssdgs_photo photo;
        ssdgs_metrics metrics;
        memset(&photo, 0, sizeof photo);
        photo.camera = set->frames[i].camera;
        photo.light = set->frames[i].light;
        photo.pixels = set->frames[i].pixels;
        photo.format = set->frames[i].format;
        for (int c = 0; c < 3; c++) photo.light.intensity[c] *= (ssdgs_real)gain;
        if (ssdgs_evaluate(model, &photo, background, NULL, &metrics)) return -1;
        sum += metrics.psnr;
    }
    return sum / count;
}

/* At the gain e^x that is best for every fourth photograph: on a grid, then by halving. */
static double best_score(ssdgs_model *model, const olat_dataset *set, const ssdgs_real background[3]) {
    double best = -1, at = 0;
    for (double x = -6; x <= 2; x += 0.5) {
        const double now = score(model, set, exp(x), background, 4);
        if (now > best) best = now, at = x;
    }
    for (double by = 0.25; by > 0.01; by /= 2)
        for (int side = -1; side <= 1; side += 2) {
            const double now = score(model, set, exp(at + side * by), background, 4);
            if (now > best) best = now, at += side * by;
        }
    return score(model, set, exp(at), background, 1);
}

int main(int argc, char **argv) {
    static const double skies[2][9][3] = {{{2, 2, 2}},
                                          {{2, 2, 2}, {0, 0.2, 0.4}, {0.9, 0.8, 0.6}, {0.5, 0, -0.3}}};
    unbake_options options = unbake_options_default();
    double scattering = 0, absorption = 0;
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    olat_dataset set;
    char error[512] = "";
    memset(&set, 0, sizeof set);
    if (argc < 4 || (argc > 4 && sscanf(argv[4], "%lf,%lf", &scattering, &absorption) != 2)) {
        fprintf(stderr, "usage: unbaked MODEL.ply DATASET black|white [SCATTERING,ABSORPTION]\n");
        return 2;
    }
    const ssdgs_real bright = !strcmp(argv[3], "white"), background[3] = {bright, bright, bright};
    for (int c = 0; c < 3; c++) {
        options.scattering[c] = (ssdgs_real)scattering;
        options.absorption[c] = (ssdgs_real)absorption;
    }
    ssdgs_result result = ssdgs_context_create(NULL, &context);
    olat_reader reader = {context, NULL, NULL};
    if (!result && olat_load_at(argv[2], "transforms_test.json", 0, NULL, &reader, &set, error)) {
        fprintf(stderr, "unbaked: %s\n", error);
        return 1;
    }
    if (!result) result = ssdgs_model_load(context, argv[1], &model, NULL);
    if (!result) printf("| %s | trained %.2f |", argv[1], score(model, &set, 1, background, 1));
    for (int k = 0; k < 2 && !result; k++) {
        ssdgs_model_destroy(model);
        result = bake(argv[1], skies[k], context, &model);
        ssdgs_model *plain = model;
        if (!result) result = unbake_model(context, plain, &options, &model), ssdgs_model_destroy(plain);
        if (!result)
            printf(" %s %.2f |", k ? "coloured sky" : "even sky", best_score(model, &set, background));
    }
    printf("\n");
    if (result) fprintf(stderr, "unbaked: %s\n", ssdgs_error_message(context));
    olat_free(&set);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    return result != SSDGS_OK;
}
