/* Builds and runs the examples of the manual in ssdgs.h, which the Makefile extracts. */
#include "test.h"
int manual_main(int argc, char **argv);
#define main manual_main
#include "manual_render.c"
#undef main
int train(const ssdgs_photo *photos, int count, int iterations, const char *path);
#include "manual_train.c"

int main(void) {
    enum { SIZE = 16, STEPS = 5 };
    static unsigned char pixels[SIZE * SIZE * 4]; /* a grey disc on nothing */
    static ssdgs_real eye[3] = {0, -3, 1}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    char name[] = "manual", path[] = "build/manual_model.ply", missing[] = "build/manual_missing.ply";
    ssdgs_photo photo;
    memset(&photo, 0, sizeof photo);
    photo.camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.6, SIZE, SIZE);
    photo.light.position[2] = 3;
    for (int c = 0; c < 3; c++) photo.light.intensity[c] = 9;
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++)
            for (int c = 0; c < 4; c++)
                pixels[(y * SIZE + x) * 4 + c] =
                    (2 * x - 15) * (2 * x - 15) + (2 * y - 15) * (2 * y - 15) < 100 ? c < 3 ? 128 : 255 : 0;
    photo.pixels = pixels;
    char *arguments[3];
    arguments[0] = name;
    arguments[1] = path;
    arguments[2] = NULL;
    remove(path);
    CHECK(manual_main(1, arguments) == 0);
    CHECK(train(&photo, 1, STEPS, path) == 0);
    CHECK(manual_main(2, arguments) == 0);     /* what was trained renders */
    CHECK(train(&photo, 0, STEPS, path) == 1); /* no photographs */
    arguments[1] = missing;
    CHECK(manual_main(2, arguments) == 1);
    remove(path);
    TEST_END();
}
