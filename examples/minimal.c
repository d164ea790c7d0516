/* cc -O2 examples/minimal.c -o minimal -lm -lpthread: a ball over a floor, made in code, lit, in
   build/minimal.png */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "images.h"

enum { BALL = 1500, SIDE = 40, FLOOR = SIDE * SIDE, WIDTH = 320, HEIGHT = 240 };

/* A flat disc of the surface at `position` that faces along `normal`. */
static ssdgs_gaussian disc(const float position[3], const float normal[3], float radius, const float color[3],
                           float shine) {
    ssdgs_gaussian g = ssdgs_gaussian_default();
    for (int i = 0; i < 3; i++) {
        g.position[i] = position[i];
        g.normal[i] = normal[i];
        g.scale[i] = i < 2 ? radius : radius / 20;
        g.diffuse[i] = color[i];
        g.specular[i] = shine;
    }
    memset(g.rotation, 0, sizeof g.rotation); /* none: the third axis is the normal */
    g.opacity = 0.99f;
    g.sharpness[0] = g.sharpness[1] = 6; /* how narrow the highlight is */
    return g;
}

static ssdgs_result fill(ssdgs_model *model) {
    const float orange[3] = {0.9f, 0.22f, 0.06f}, grey[3] = {0.42f, 0.42f, 0.42f}, up[3] = {0, 0, 1};
    ssdgs_result result = SSDGS_OK;
    for (int i = 0; i < BALL && !result; i++) { /* along a spiral from pole to pole */
        const float z = 1 - (2 * (float)i + 1) / (float)BALL, r = sqrtf(1 - z * z), turn = 2.4f * (float)i;
        const float normal[3] = {r * cosf(turn), r * sinf(turn), z};
        const float position[3] = {0.6f * normal[0], 0.6f * normal[1], 0.6f * normal[2] + 0.1f};
        const ssdgs_gaussian g = disc(position, normal, 0.045f, orange, 0.55f);
        result = ssdgs_model_set(model, i, &g);
    }
    for (int i = 0; i < FLOOR && !result; i++) {
        const float position[3] = {0.1f * (float)(i % SIDE) - 2, 0.1f * (float)(i / SIDE) - 2, -0.5f};
        const ssdgs_gaussian g = disc(position, up, 0.06f, grey, 0);
        result = ssdgs_model_set(model, BALL + i, &g);
    }
    return result ? result : ssdgs_model_sort(model);
}

int main(int argc, char **argv) {
    static float color[WIDTH * HEIGHT * 3];
    static unsigned char bytes[WIDTH * HEIGHT * 3];
    const char *path = argc > 1 ? argv[1] : "build/minimal.png";
    const float eye[3] = {0, -4, 2}, target[3] = {0, 0, 0.2f}, up[3] = {0, 0, 1};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7f, WIDTH, HEIGHT);
    const ssdgs_real lamp[3] = {2, -2, 3}, white[3] = {140, 140, 140};
    const ssdgs_light light = ssdgs_light_point(lamp, white);
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_image image;
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    char error[512] = "";

    if (argc > 2 || path[0] == '-') {
        fprintf(stderr, "usage: minimal [PICTURE.png]\n");
        return 2;
    }
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM | SSDGS_SHADOW_TERM;
    settings.shadow.layers = 0;     /* nothing here is trained */
    settings.light_map.bias = 0.2f; /* discs as coarse as these must not shadow their neighbours */
    memset(&image, 0, sizeof image);
    image.color = color;

    ssdgs_result result = ssdgs_context_create(NULL, &context);
    if (!result) result = ssdgs_model_create(context, &settings, BALL + FLOOR, &model);
    if (!result) result = fill(model);
    if (!result) result = ssdgs_render(model, &camera, &light, 1, &image);
    if (result) fprintf(stderr, "%s: %s\n", ssdgs_result_string(result), ssdgs_error_message(context));
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    if (result) return 1;

    ssdgs_to_bytes(color, WIDTH * HEIGHT * 3, settings.transfer, bytes);
    if (!olat_write_png(path, WIDTH, HEIGHT, 3, bytes, error)) return 0;
    fprintf(stderr, "%s\n", error);
    return 1;
}
