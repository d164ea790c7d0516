/* cc -O2 examples/minimal.c -o minimal -lm -lpthread: a ball over a floor, made in code, lit, rendered to
   minimal.png */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "olat.h"

int main(int argc, char **argv) {
    enum { BALL = 1500, FLOOR = 40, COUNT = BALL + FLOOR * FLOOR, W = 320, H = 240 };
    static ssdgs_real color[W * H * 3], eye[3] = {0, -4, 2}, target[3] = {0, 0, 0.2f}, up[3] = {0, 0, 1};
    static unsigned char bytes[W * H * 3];
    char error[512] = "";
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7f, W, H);
    ssdgs_light light = {SSDGS_LIGHT_POINT, {2, -2, 3}, {60, 60, 60}};
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    ssdgs_image image = {0, color, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    int i, c;
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM | SSDGS_SHADOW_TERM; /* no networks to train */
    settings.shadow_layers = 0;
    settings.light_bias = 0.2f; /* 3 standard deviations: coarse Gaussians must not shadow their neighbours */
    if (ssdgs_context_create(NULL, &context) || ssdgs_model_create(context, &settings, COUNT, &model))
        return 1;
    for (i = 0; i < COUNT; i++) { /* flat Gaussians whose z axis is the normal (x, y, z): a spiral round the
                                     ball, then a grid */
        ssdgs_model_view view = ssdgs_model_get(model);
        int ball = i < BALL, k = i - BALL;
        double z = ball ? 1 - (2 * i + 1.0) / BALL : 1, r = sqrt(1 - z * z), x = r * cos(2.4 * i),
               y = r * sin(2.4 * i);
        double raw[SSDGS_SCATTERING] = {ball ? 0.6 * x : k % FLOOR * 0.1 - 2,
                                        ball ? 0.6 * y : k / FLOOR * 0.1 - 2,
                                        ball ? 0.6 * z + 0.1 : -0.5,
                                        1 + z,
                                        -y,
                                        x,
                                        0,
                                        ball ? -3.1 : -2.8,
                                        ball ? -3.1 : -2.8,
                                        -6,
                                        6, /* size, opacity */
                                        ball ? 2 : 0.5,
                                        ball ? -0.5 : 0.5,
                                        ball ? -2 : 0.5,
                                        ball ? 1. : -4.,
                                        ball ? 1. : -4.,
                                        ball ? 1. : -4.}; /* colours */
        for (c = 0; c < SSDGS_SCATTERING; c++)
            view.gaussians[(size_t)c * view.stride + (size_t)i] = (ssdgs_real)raw[c];
        for (c = 0; c < 4; c++)
            view.gaussians[(size_t)(SSDGS_FRAME + c) * view.stride + (size_t)i] = (ssdgs_real)raw[3 + c];
    }
    if (ssdgs_model_sort(model) || ssdgs_render(model, &camera, &light, 1, &image))
        return fprintf(stderr, "%s\n", ssdgs_error_message(context)), 1;
    ssdgs_to_bytes(color, W * H * 3, settings.transfer, bytes);
    if (olat_write_png(argc > 1 ? argv[1] : "build/minimal.png", W, H, 3, bytes, error))
        return fprintf(stderr, "%s\n", error), 1;
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    return 0;
}
