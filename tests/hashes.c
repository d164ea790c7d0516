/* Hashes of 50 training steps, of renders and of what the lights see, one line per instruction set and
   settings. A change that only moves or renames code leaves every line as it was: `make hashes` before and
   after. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { PHOTOS = 6, SIDE = 48, PIXELS = SIDE * SIDE };
static unsigned char pixels[PHOTOS][PIXELS * 4];
static ssdgs_photo photos[PHOTOS];

static uint64_t hash_bytes(uint64_t hash, const void *data, size_t size) { /* FNV-1a */
    const unsigned char *bytes = (const unsigned char *)data;
    for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 1099511628211u;
    return hash;
}

/* A ball with stripes on a transparent ground, seen and lit from all around. */
static void make_photos(void) {
    for (int i = 0; i < PHOTOS; i++) {
        const double turn = 6.2831853 * i / PHOTOS;
        const ssdgs_real eye[3] = {(ssdgs_real)(2 * cos(turn)), (ssdgs_real)(2 * sin(turn)), (ssdgs_real)0.5};
        const ssdgs_real target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
        photos[i].camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.63, SIDE, SIDE);
        photos[i].light.position[0] = (ssdgs_real)(2 * cos(turn + 1));
        photos[i].light.position[1] = (ssdgs_real)(2 * sin(turn + 1));
        photos[i].light.position[2] = 1;
        for (int c = 0; c < 3; c++) photos[i].light.intensity[c] = 20;
        for (int p = 0; p < PIXELS; p++) {
            const int x = p % SIDE - SIDE / 2, y = p / SIDE - SIDE / 2;
            for (int c = 0; c < 3; c++)
                pixels[i][4 * p + c] = (unsigned char)(120 + 3 * x - 2 * y + 40 * (c == (p / 5 + i) % 3));
            pixels[i][4 * p + 3] = (unsigned char)(x * x + y * y < 300 ? 255 : 0);
        }
        photos[i].pixels = pixels[i];
    }
}

static ssdgs_result train(ssdgs_model *model, uint64_t *hash) {
    ssdgs_train_options options = ssdgs_train_options_default();
    ssdgs_trainer *trainer = NULL;
    options.iterations = 50;
    options.schedule = SSDGS_SCHEDULE_JOINT;
    options.initial_points = 500;
    options.densify_every = options.densify_from = 20;
    options.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT | SSDGS_REFINE_AMBIENT;
    ssdgs_result result = ssdgs_trainer_create(model, photos, PHOTOS, &options, &trainer);
    if (!result) result = ssdgs_trainer_run(trainer, NULL, NULL);
    ssdgs_trainer_destroy(trainer);
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t c = 0; c < SSDGS_CHANNELS; c++)
        *hash = hash_bytes(*hash, v.gaussians + c * v.stride, (size_t)v.count * sizeof(ssdgs_real));
    *hash = hash_bytes(*hash, v.scattering, v.scattering_count * sizeof(ssdgs_real));
    *hash = hash_bytes(*hash, v.shadow, v.shadow_count * sizeof(ssdgs_real));
    *hash = hash_bytes(*hash, v.asg_basis, 4 * SSDGS_ASG_COUNT * sizeof(ssdgs_real));
    *hash = hash_bytes(*hash, ssdgs_model_settings(model)->ambient, 3 * sizeof(ssdgs_real));
    return result;
}

/* Every plane of a render lit from two sides, once exact and once with the shortcuts of a game. */
static ssdgs_result render(ssdgs_model *model, uint64_t *hash) {
    static ssdgs_real planes[18 * PIXELS];
    const ssdgs_image image = {0,
                               planes,
                               planes + 3 * PIXELS,
                               planes + 4 * PIXELS,
                               planes + 5 * PIXELS,
                               planes + 8 * PIXELS,
                               planes + 11 * PIXELS,
                               planes + 14 * PIXELS,
                               planes + 17 * PIXELS,
                               NULL,
                               NULL};
    const ssdgs_light lights[2] = {photos[2].light, photos[5].light};
    const ssdgs_render_options options[2] = {ssdgs_render_options_exact(), ssdgs_render_options_fast()};
    ssdgs_result result = SSDGS_OK;
    for (int i = 0; i < 2 && !result; i++) {
        result = ssdgs_render_ex(model, &photos[1].camera, lights, 2, &options[i], &image, NULL);
        *hash = hash_bytes(*hash, planes, sizeof planes);
    }
    return result;
}

int main(void) {
    make_photos();
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++)
        for (int published = 0; published < 2; published++) {
            const ssdgs_settings settings = published ? ssdgs_settings_published() : ssdgs_settings_default();
            uint64_t trained = 14695981039346656037u, rendered = trained;
            ssdgs_context_desc desc = {0};
            ssdgs_context *context = NULL;
            ssdgs_model *model = NULL;
            desc.isa = (ssdgs_isa)isa;
            if (ssdgs_context_create(&desc, &context)) continue;
            ssdgs_result result = ssdgs_model_create(context, &settings, 0, &model);
            if (!result) result = train(model, &trained);
            if (!result) result = render(model, &rendered);
            printf("%s %s %s: trained %016llx rendered %016llx%s%s\n",
                   sizeof(ssdgs_real) == 4 ? "float" : "double", ssdgs_isa_string((ssdgs_isa)isa),
                   published ? "published" : "default", (unsigned long long)trained,
                   (unsigned long long)rendered, result ? " " : "",
                   result ? ssdgs_error_message(context) : "");
            ssdgs_model_destroy(model);
            ssdgs_context_destroy(context);
        }
    return 0;
}
