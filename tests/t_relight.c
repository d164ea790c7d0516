/* examples/relight.c: the paper's path, what each picture shows, the contact sheet, scores. cc -o
   build/t_relight tests/t_relight.c -lm -lpthread && build/t_relight */
int relight_main(int argc, char **argv);
#define main relight_main
#include "../examples/relight.c"
#undef main
#include "test.h"

#define FOLDER "build/t_relight_files"
enum { VIEWS = 5, W = 200, H = 90, N = W * H };

static double distance_of(const double a[3], const ssdgs_real b[3]) {
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += ((double)b[k] - a[k]) * ((double)b[k] - a[k]);
    return sqrt(sum);
}

/* A camera turned round `up` so far, at this height. */
static ssdgs_camera camera_at(int up, int sign, double degrees, double height, double around,
                              const double centre[3]) {
    ssdgs_real eye[3], target[3], upward[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) target[k] = (ssdgs_real)centre[k];
    eye[up] = (ssdgs_real)(centre[up] + sign * height);
    eye[(up + 1) % 3] = (ssdgs_real)(centre[(up + 1) % 3] + around * cos(degrees * PI / 180));
    eye[(up + 2) % 3] = (ssdgs_real)(centre[(up + 2) % 3] + around * sin(degrees * PI / 180));
    upward[up] = (ssdgs_real)sign;
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, upward, (ssdgs_real)0.7, W, H);
    camera.fy *= (ssdgs_real)1.5;
    return camera;
}

/* Degrees from one point to another, seen from the centre, counterclockwise about the upward axis. */
static double turned_by(int up, int sign, const double centre[3], const ssdgs_real from[3],
                        const ssdgs_real to[3]) {
    double angle[2];
    for (int i = 0; i < 2; i++) {
        const ssdgs_real *p = i ? to : from;
        const int a = (up + 1) % 3, b = (up + 2) % 3;
        angle[i] = sign * atan2((double)p[b] - centre[b], (double)p[a] - centre[a]) * 180 / PI;
    }
    const double turn = angle[1] - angle[0];
    return turn - 360 * floor((turn + 1e-3) / 360);
}

/* Which way is up is found from the cameras. The light goes round once in 150 frames, then the camera to the
   back in 90, the light once more, the camera home; all that at the mean heights and distances. */
static void test_path(int up, int sign, int directional) {
    job j;
    memset(&j, 0, sizeof j);
    const ssdgs_settings settings = ssdgs_settings_default();
    const double at[2][3] = {{0.5, -0.25, 0.1}, {0.1, 0.75, -0.3}}, nowhere[3] = {0, 0, 0};
    double centre[3];
    CHECK(!ssdgs_context_create(NULL, &j.context) && !ssdgs_model_create(j.context, &settings, 2, &j.model));
    for (int k = 0; k < 3; k++) {
        ssdgs_model_view view = ssdgs_model_arrays(j.model);
        centre[k] = (at[0][k] + at[1][k]) / 2;
        for (int i = 0; i < 2; i++)
            view.gaussians[(size_t)(SSDGS_POSITION + k) * view.stride + (size_t)i] = (ssdgs_real)at[i][k];
    }
    const double *lit = directional ? nowhere : centre;
    j.data.count = 3;
    j.data.frames = (olat_frame *)calloc(3, sizeof *j.data.frames);
    double heights = 0, distances = 0, light_heights = 0, light_distances = 0;
    for (int i = 0; i < 3; i++) {
        olat_frame *f = j.data.frames + i;
        ssdgs_real eye[3];
        f->camera = camera_at(up, sign, 20 + 100 * i, 1 + 0.5 * i, 3 - 0.2 * i, centre);
        f->light.kind = directional ? SSDGS_LIGHT_DIRECTIONAL : SSDGS_LIGHT_POINT;
        f->light.focus = 1;
        for (int k = 0; k < 3; k++) {
            f->light.position[k] = (ssdgs_real)(lit[k] + (k == up ? sign * (2 + i) : 0.5 * i + k));
            f->light.direction[k] = -f->light.position[k]; /* of a directional one */
            f->light.intensity[k] = (ssdgs_real)(1 + k + 3 * i);
        }
        olat_eye(&f->camera, eye);
        heights += sign * ((double)eye[up] - centre[up]) / 3;
        distances += distance_of(centre, eye) / 3;
        light_heights += sign * ((double)f->light.position[up] - lit[up]) / 3;
        light_distances += distance_of(lit, f->light.position) / 3;
    }
    ssdgs_camera first = j.data.frames[0].camera;
    ssdgs_real start[3];
    olat_eye(&first, start);
    CHECK(make_trajectory(&j) && j.data.count == 480);
    double off = 0, turns[2] = {0, 0};
    int wrong = 0;
    for (int i = 0; i < 480; i++) {
        const olat_frame *f = j.data.frames + i;
        const int step = i % 240 + 1;
        const double camera_turn = (i < 240 ? 0 : 180) + (step > 150 ? 2 * (step - 150) : 0),
                     light_turn = step < 150 ? 360.0 / 150 * step : 0;
        ssdgs_real eye[3], place[3];
        olat_eye(&f->camera, eye);
        olat_place(&f->light, place);
        off = test_most(off, fabs(sign * ((double)eye[up] - centre[up]) - heights));
        off = test_most(off, fabs(distance_of(centre, eye) - distances));
        off = test_most(off, fabs(sign * ((double)place[up] - lit[up]) - light_heights));
        off = test_most(off, fabs(distance_of(lit, place) - light_distances));
        for (int k = 0; k < 3; k++) off = test_most(off, fabs((double)f->light.intensity[k] - 4 - k));
        turns[0] =
            test_most(turns[0], fabs(turned_by(up, sign, centre, start, eye) - fmod(camera_turn, 360)));
        ssdgs_real from_centre[3];
        for (int k = 0; k < 3; k++) from_centre[k] = (ssdgs_real)((double)place[k] - lit[k] + centre[k]);
        turns[1] = test_most(turns[1], fabs(turned_by(up, sign, centre, start, from_centre) - light_turn));
        /* it looks at the centre, upright, through the first frame's lens */
        double seen[3];
        for (int row = 0; row < 3; row++) {
            const ssdgs_real *r = f->camera.view + 4 * row;
            seen[row] =
                (double)r[0] * centre[0] + (double)r[1] * centre[1] + (double)r[2] * centre[2] + (double)r[3];
        }
        off = test_most(off, hypot(seen[0], seen[1]));
        off = test_most(off, fabs(seen[2] - distances));
        off = test_most(off, fabs((double)f->camera.view[up]));
        wrong += !(sign * (double)f->camera.view[4 + up] < -0.1);
        wrong += f->camera.width != W || f->camera.height != H || f->camera.fy != first.fy;
        wrong += !(fabs((double)(f->camera.fx / first.fx) - 1) < 1e-5);
        wrong += (f->light.kind == SSDGS_LIGHT_DIRECTIONAL) != directional || f->light.focus != 0;
    }
    if (!CHECK(!wrong && off < 1e-5 && turns[0] < 1e-3 && turns[1] < 1e-3))
        printf("    up %d: %d wrong, off %g, turns %g %g\n", sign * (up + 1), wrong, off, turns[0], turns[1]);
    CHECK(name_frames(&j.data) && !strcmp(j.data.frames[0].file, "0000") &&
          !strcmp(j.data.frames[479].file, "0479"));
    ssdgs_model_destroy(j.model);
    ssdgs_context_destroy(j.context);
    olat_free(&j.data);
}

static unsigned char byte_of(double value) { return (unsigned char)(255 * fmin(1, fmax(0, value)) + 0.5); }

/* Bytes that differ from the wanted by more than one. */
static int other_bytes(const unsigned char *got, const unsigned char *want, size_t count) {
    int other = 0;
    for (size_t i = 0; i < count; i++) other += abs((int)got[i] - (int)want[i]) > 1;
    return other;
}

static unsigned char *png(const char *name, int *width, int *height) {
    char path[256], error[512] = "";
    ssdgs_pixels format;
    void *pixels = NULL;
    snprintf(path, sizeof path, FOLDER "/%s", name);
    CHECK(!olat_read_png(path, width, height, &format, &pixels, error));
    if (error[0]) printf("    %s\n", error);
    return (unsigned char *)pixels;
}

/* The picture of that name is these three planes' values, encoded for display or as they are. */
static void check_picture(const char *name, const unsigned char *want) {
    int width = 0, height = 0;
    unsigned char *got = png(name, &width, &height);
    if (!CHECK(got && width == W && height == H)) return;
    int other = 0;
    for (int i = 0; i < N; i++) other += other_bytes(got + 4 * i, want + 3 * i, 3) + (got[4 * i + 3] != 255);
    if (!CHECK(!other)) printf("    %s: %d values differ\n", name, other);
    free(got);
}

static void encode(const ssdgs_real *values, double scale, unsigned char *bytes) {
    for (int i = 0; i < 3 * N; i++)
        bytes[i] = byte_of((double)ssdgs_srgb_encode((ssdgs_real)(scale * (double)values[i])));
}

/* Views of the dataset lit by a map alone: its sixteen lights and ambient light, a white thing as bright as
 * the map. */
static void check_sky(ssdgs_model *model, const olat_dataset *data) {
    enum { ACROSS = 16, DOWN = 8 };
    unsigned char map[3 * ACROSS * DOWN];
    ssdgs_real linear[3 * ACROSS * DOWN], *planes = (ssdgs_real *)malloc(sizeof *planes * N * 7);
    static unsigned char want[3 * N];
    static char said[7][40] = {"relight", FOLDER "/model.ply", FOLDER "/set", "--out", FOLDER "/lit",
                               "--sky",   FOLDER "/map.png"};
    char *arguments[7], error[512] = "", name[64];
    for (int i = 0; i < 7; i++) arguments[i] = said[i];
    for (int i = 0; i < 3 * ACROSS * DOWN; i++) {
        map[i] = (unsigned char)(i % 48 == 7 ? 255 : 40 + i % 90);
        linear[i] = ssdgs_srgb_decode((ssdgs_real)(map[i] / 255.0));
    }
    CHECK(!olat_write_png(FOLDER "/map.png", ACROSS, DOWN, 3, map, error) && !relight_main(7, arguments));
    ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_light lights[16];
    CHECK(!sky_lights(linear, ACROSS, DOWN, NULL, lights, 16, options.ambient));
    const ssdgs_real unit = 1 / ssdgs_model_settings(model)->light_scale, black[3] = {0, 0, 0};
    for (int i = 0; i < 48; i++) lights[i / 3].intensity[i % 3] *= unit;
    for (int i = 0; i < 27; i++) options.ambient[i / 3][i % 3] *= unit;
    for (int v = 0; v < VIEWS && planes; v++) {
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        image.color = planes;
        image.alpha = planes + 3 * N;
        CHECK(!ssdgs_render_ex(model, &data->frames[v].camera, lights, 16, &options, &image, NULL));
        ssdgs_compose(image.color, image.alpha, N, SSDGS_TRANSFER_SRGB, black, planes + 4 * N);
        for (int i = 0; i < 3 * N; i++) want[i] = byte_of((double)planes[4 * N + i]);
        snprintf(name, sizeof name, "lit/%d.png", v);
        check_picture(name, want);
    }
    FILE *file = fopen(FOLDER "/lit/metrics.json", "r"); /* no photograph is of this light */
    if (!CHECK(!file)) fclose(file);
    free(planes);
}

/* A model and a dataset on disk, relit on white with everything; then what the files hold. */
static void test_pictures(void) {
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    ssdgs_settings settings = ssdgs_settings_default();
    for (int k = 0; k < 3; k++) settings.ambient[k] = (ssdgs_real)(0.1 + 0.05 * k);
    settings.light_scale = (ssdgs_real)1.25;
    CHECK(!ssdgs_context_create(NULL, &context) && !ssdgs_model_create(context, &settings, 200, &model));
    ssdgs_model_view m = ssdgs_model_arrays(model);
    for (int i = 0; i < 200; i++) {
        for (int k = 0; k < 3; k++) {
            m.gaussians[(size_t)(SSDGS_POSITION + k) * m.stride + (size_t)i] =
                (ssdgs_real)(0.6 * test_uniform(1, (uint64_t)(3 * i + k)) - 0.3);
            m.gaussians[(size_t)(SSDGS_LOG_SCALE + k) * m.stride + (size_t)i] =
                (ssdgs_real)log(0.03 + 0.01 * k);
            m.gaussians[(size_t)(SSDGS_DIFFUSE + k) * m.stride + (size_t)i] =
                (ssdgs_real)(2 * test_uniform(2, (uint64_t)(3 * i + k)));
        }
        m.gaussians[(size_t)SSDGS_OPACITY * m.stride + (size_t)i] = 2;
    }
    CHECK(!ssdgs_model_save(model, FOLDER "/model.ply"));
    static unsigned char photo[VIEWS][3 * N], want[OUTPUT_COUNT][3 * N];
    const double centre[3] = {0, 0, 0};
    char error[512] = "", name[64];
    FILE *json = fopen(FOLDER "/set/transforms_test.json", "w");
    if (!CHECK(json)) return;
    ssdgs_camera cameras[VIEWS];
    fprintf(json, "{\"frames\": [");
    for (int v = 0; v < VIEWS; v++) {
        cameras[v] = camera_at(2, 1, 70 * v, 1, 1.5, centre);
        for (int i = 0; i < 3 * N; i++)
            photo[v][i] = (unsigned char)(127 + 100 * sin(i * (0.01 + 0.003 * v)) + 20 * (i % 3));
        snprintf(name, sizeof name, FOLDER "/set/%d.png", v);
        CHECK(!olat_write_png(name, W, H, 3, photo[v], error));
        const ssdgs_real *r = cameras[v].view;
        ssdgs_real eye[3];
        olat_eye(cameras + v, eye);
        fprintf(json,
                "%s\n {\"file_path\": \"./%d\", \"camera_intrinsics\": [%.9g, %.9g, %.9g, %.9g], "
                "\"pl_pos\": [1.5, %g, 1], \"pl_intensity\": [4, 5, 6], \"transform_matrix\": [",
                v ? "," : "", v, (double)cameras[v].cx, (double)cameras[v].cy, (double)cameras[v].fx,
                (double)cameras[v].fy, 0.5 * v - 1);
        for (int k = 0; k < 3; k++)
            fprintf(json, "[%.9g, %.9g, %.9g, %.9g], ", (double)r[k], -(double)r[4 + k], -(double)r[8 + k],
                    (double)eye[k]);
        fprintf(json, "[0, 0, 0, 1]]}");
    }
    fprintf(json, "\n]}\n");
    CHECK(!fclose(json));
    static char said[12][40] = {
        "relight", FOLDER "/model.ply", FOLDER "/set", "--out", FOLDER "/out", "--background",
        "white",   "--components",      "--ambient",   "2",     "--sheet",     FOLDER "/out/sheet.png"};
    char *arguments[12];
    for (int i = 0; i < 12; i++) arguments[i] = said[i];
    CHECK(!relight_main(12, arguments));
    olat_dataset data;
    CHECK(!olat_load(FOLDER "/set", "transforms_test.json", 0, &data, error) && data.count == VIEWS);
    ssdgs_real *planes = (ssdgs_real *)malloc(sizeof *planes * N * 24);
    int width = 0, height = 0;
    unsigned char *sheet = png("out/sheet.png", &width, &height);
    CHECK(sheet && width == SHEET_COLUMNS * W / 2 && height == SHEET_ROWS * H / 2);
    double psnr = 0;
    for (int v = 0, row = 0; v < VIEWS && sheet && planes; v++) {
        ssdgs_image image;
        memset(&image, 0, sizeof image);
        ssdgs_real *next = planes, *composed = next;
        image.color = next += 3 * N;
        image.diffuse = next += 3 * N;
        image.specular = next += 3 * N;
        image.scattering = next += 3 * N;
        image.normal = next += 3 * N;
        image.depth = next += 3 * N;
        image.shadow = next += N;
        image.alpha = next + N;
        ssdgs_render_options options = ssdgs_render_options_exact();
        for (int k = 0; k < 3; k++) options.ambient[0][k] = 2 * settings.ambient[k];
        CHECK(!ssdgs_render_ex(model, &data.frames[v].camera, &data.frames[v].light, 1, &options, &image,
                               NULL));
        memcpy(want[PHOTO], photo[v], sizeof photo[v]);
        encode(image.diffuse, 1, want[DIFFUSE]);
        encode(image.specular, 1, want[SPECULAR]);
        encode(image.scattering, 1, want[SCATTERING]);
        double nearest = 1e30, farthest = 0;
        for (int i = 0; i < N; i++) {
            const double a = (double)image.alpha[i], depth = (double)image.depth[i] / (a + 1e-6);
            if (a >= 0.5) nearest = fmin(nearest, depth), farthest = fmax(farthest, depth);
        }
        CHECK(farthest > nearest + 0.1);
        for (int i = 0; i < 3 * N; i++) {
            const double a = (double)image.alpha[i / 3], depth = (double)image.depth[i / 3] / (a + 1e-6);
            /* straight alpha over stored values */
            const double stored_color =
                a > 0 ? (double)ssdgs_srgb_encode(image.color[i] / image.alpha[i / 3]) : 0;
            composed[i] = (ssdgs_real)(a * stored_color + 1 - a);
            want[IMAGE][i] = byte_of((double)composed[i]);
            want[SHADOW][i] = byte_of((double)image.shadow[i / 3]);
            want[ALPHA][i] = byte_of(a);
            want[NORMAL][i] = byte_of(((double)image.normal[i] + a) / 2);
            want[DEPTH][i] = byte_of(a * (1 - 0.8 * (depth - nearest) / (farthest - nearest)));
        }
        for (int output = IMAGE; output < OUTPUT_COUNT; output++) {
            snprintf(name, sizeof name, "out/%d%s.png", v, suffixes[output]);
            check_picture(name, want[output]);
        }
        ssdgs_real *stored = planes + 21 * N;
        for (int i = 0; i < 3 * N; i++) stored[i] = (ssdgs_real)(photo[v][i] / 255.0);
        ssdgs_metrics is;
        CHECK(!ssdgs_compare(context, composed, stored, W, H, &is));
        psnr += is.psnr / (double)VIEWS;
        if (v == 2) continue; /* four of five are on the sheet */
        int other = 0;
        for (int output = 0; output < SHEET_COLUMNS; output++)
            for (int i = 0; i < N / 4 * 3; i++) {
                const int x = i / 3 % (W / 2), y = i / 3 / (W / 2), c = i % 3;
                const unsigned char *from = want[output] + 3 * (2 * y * W + 2 * x) + c;
                const int mean = (from[0] + from[3] + from[3 * W] + from[3 * W + 3] + 2) / 4;
                other += abs(mean - sheet[4 * ((row * H / 2 + y) * width + output * W / 2 + x) + c]) >
                         (output != PHOTO);
            }
        if (!CHECK(!other)) printf("    row %d of the sheet: %d values differ\n", row, other);
        row++;
    }
    FILE *file = fopen(FOLDER "/out/metrics.json", "r");
    double told = 0;
    CHECK(file && fscanf(file, " { \"mean\" : {\"psnr\": %lf", &told) == 1 && fabs(told - psnr) < 1e-3);
    if (file) fclose(file);
    check_sky(model, &data);
    free(sheet);
    free(planes);
    olat_free(&data);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

int main(void) {
    char error[512];
    CHECK(!olat_make_folder(FOLDER "/set", error));
    for (int up = 0; up < 3; up++)
        for (int sign = -1; sign < 2; sign += 2) test_path(up, sign, up == 1);
    test_pictures();
    TEST_END();
}
