/* Prints hashes of renderings with every term and network, on the best kernels and on scalar ones, these with
   the program's own parallel: tests/builds.sh compares builds with other options. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

static int calls;

static void backwards(void *user, int count, void (*task)(void *data, int index), void *data) {
    (void)user;
    calls++;
    while (count > 0) task(data, --count);
}

int main(void) {
    enum { SIDE = 48, COUNT = 500 };
    static ssdgs_real color[SIDE * SIDE * 3], depth[SIDE * SIDE], eye[3] = {0, -3, 1}, target[3] = {0, 0, 0},
                                                                  up[3] = {0, 0, 1};
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, SIDE, SIDE);
    static const ssdgs_real lamp[3] = {1, -2, 2}, white[3] = {9, 9, 9};
    ssdgs_light light = ssdgs_light_point(lamp, white);
    ssdgs_image image = {0, color, NULL, depth, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    ssdgs_settings settings[2];
    settings[0] = ssdgs_settings_default();
    settings[1] = ssdgs_settings_published();
    uint64_t hash = 0;
    for (int run = 0; run < 4; run++) {
        const int kind = run % 2, scalar = run / 2;
        ssdgs_context *context = NULL;
        ssdgs_model *model = NULL;
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        if (scalar) desc.isa = SSDGS_ISA_SCALAR, desc.parallel.run = backwards;
        if (kind == 0) hash = 1; /* of both kinds together */
        if (ssdgs_context_create(&desc, &context) ||
            ssdgs_model_create(context, &settings[kind], COUNT, &model))
            return 1;
        ssdgs_model_view view = ssdgs_model_arrays(model);
        for (int i = 0; i < COUNT; i++)
            for (int c = 0; c < SSDGS_CHANNELS; c++)
                view.gaussians[(size_t)c * view.stride + (size_t)i] +=
                    (ssdgs_real)(0.8 * test_uniform(3, (uint64_t)(i * SSDGS_CHANNELS + c)) - 0.4);
        if (ssdgs_render(model, &camera, &light, 1, &image)) return 1;
        for (int i = 0; i < (int)sizeof color; i++)
            hash = (hash ^ ((const unsigned char *)color)[i]) * UINT64_C(0x100000001B3);
        for (int i = 0; i < (int)sizeof depth; i++)
            hash = (hash ^ ((const unsigned char *)depth)[i]) * UINT64_C(0x100000001B3);
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
        if (kind)
            printf("%08lx%08lx%s", (unsigned long)(hash >> 32), (unsigned long)(hash & 0xffffffffu),
                   scalar ? "\n" : " ");
    }
    return !calls;
}
