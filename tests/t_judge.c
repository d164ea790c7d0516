/* examples/hull.h: what it says of right captures, which is nothing, and of each fault at several strengths;
   the trainer's notes on hot pixels and forgotten bounds. cc -o build/t_judge tests/t_judge.c -lm -lpthread
   && build/t_judge */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/olat.h"
#include "../examples/hull.h"
#include "../examples/judge.h"
#include "test.h"

enum { MANY = 24, SIDE = 48, PIXELS = SIDE * SIDE, BODY = 1400, ALL = 1700 };

static ssdgs_context *context;
static ssdgs_model *model;
static float right[MANY][4 * PIXELS], flooded[MANY][4 * PIXELS]; /* linear, straight alpha */
static unsigned char bytes[MANY][4 * PIXELS];
static float floats[MANY][4 * PIXELS];
static olat_frame frames[MANY];
static char names[MANY][32], heard[4096];

static void hear(void *user, ssdgs_result code, const char *message) {
    (void)user;
    if (!code && strlen(heard) + strlen(message) + 2 < sizeof heard) strcat(strcat(heard, message), "\n");
}
static const ssdgs_logger logger = {hear, NULL};

static void direction_of(int i, int many, double turn, double d[3]) {
    const double z = 1 - 2 * (i + 0.5) / many, across = sqrt(1 - z * z), angle = 2.399963229728653 * i + turn;
    d[0] = across * cos(angle), d[1] = across * sin(angle), d[2] = z;
}

/* A matt ball, checkered, with a smaller one at its side that throws shadows. */
static void make_model(void) {
    ssdgs_settings s = ssdgs_settings_default();
    s.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    s.light_map.bias = (ssdgs_real)0.05;
    s.shadow.layers = 0;
    if (!CHECK(!ssdgs_model_create(context, &s, ALL, &model))) exit(1);
    for (int i = 0; i < ALL; i++) {
        const int small = i >= BODY;
        const double radius = small ? 0.13 : 0.3,
                     middle[3] = {small ? 0.36 : 0, small ? 0.1 : 0, small ? 0.12 : 0};
        double d[3];
        ssdgs_gaussian g = ssdgs_gaussian_default();
        direction_of(small ? i - BODY : i, small ? ALL - BODY : BODY, 0, d);
        const int check = ((int)floor(5 * d[0]) + (int)floor(5 * d[1]) + (int)floor(5 * d[2])) & 1;
        const double length = sqrt(2 * (1 + d[2]) + 1e-9);
        g.rotation[0] = (ssdgs_real)((1 + d[2]) / length); /* takes z to d */
        g.rotation[1] = (ssdgs_real)(-d[1] / length);
        g.rotation[2] = (ssdgs_real)(d[0] / length);
        for (int c = 0; c < 3; c++) {
            g.position[c] = (ssdgs_real)(middle[c] + radius * d[c]);
            g.normal[c] = (ssdgs_real)d[c];
            g.scale[c] = (ssdgs_real)(c < 2 ? 0.016 : 0.002);
            g.diffuse[c] = (ssdgs_real)(check ? 0.8 : 0.5 - 0.1 * c);
            g.specular[c] = g.scattering[c] = 0;
        }
        g.opacity = (ssdgs_real)0.95;
        CHECK(!ssdgs_model_set(model, i, &g));
    }
}

static void render(int i, const ssdgs_light *lights, int count, float *to) {
    static ssdgs_real color[3 * PIXELS], alpha[PIXELS];
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color, image.alpha = alpha;
    if (!CHECK(!ssdgs_render(model, &frames[i].camera, lights, count, &image))) exit(1);
    ssdgs_to_pixels(NULL, &image, SIDE, SIDE, SSDGS_TRANSFER_SRGB, SSDGS_RGBA32F, to,
                    4 * SIDE * (ptrdiff_t)sizeof *to);
}

/* Each photograph by its lamp, and by light from all around of about that strength. */
static void make_photographs(void) {
    enum { SKY = 24 };
    static const ssdgs_real target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    for (int i = 0; i < MANY; i++) {
        ssdgs_light sky[SKY];
        double d[3];
        ssdgs_real eye[3];
        direction_of(i, MANY, 0, d);
        for (int c = 0; c < 3; c++) eye[c] = (ssdgs_real)(2.2 * d[c]);
        frames[i].camera = ssdgs_camera_look_at(eye, target, up, (ssdgs_real)0.5, SIDE, SIDE);
        direction_of(i * 7 % MANY, MANY, 1, d);
        for (int c = 0; c < 3; c++) {
            frames[i].light.position[c] = (ssdgs_real)((1.5 + 0.02 * i) * d[c]);
            frames[i].light.intensity[c] = 5;
        }
        render(i, &frames[i].light, 1, right[i]);
        memset(sky, 0, sizeof sky);
        for (int l = 0; l < SKY; l++) {
            direction_of(l, SKY, 0, d);
            for (int c = 0; c < 3; c++)
                sky[l].position[c] = (ssdgs_real)d[c], sky[l].intensity[c] = (ssdgs_real)(6.0 / SKY);
            TEST_PARALLEL(sky[l]);
        }
        render(i, sky, SKY, flooded[i]);
        sprintf(names[i], "set/train/r_%03d.png", i);
        frames[i].file = names[i];
    }
}

static float encode(float light) { return (float)ssdgs_srgb_encode((ssdgs_real)light); }

/* The photographs as PNG has them: which are flooded, each one's exposure, a background mixed in by alpha. */
static void as_bytes(uint32_t which, const double *exposure, const float *behind, int as_light) {
    for (int i = 0; i < MANY; i++) {
        for (int k = 0; k < 4 * PIXELS; k++) {
            float v = (which >> i & 1 ? flooded : right)[i][k];
            const float alpha = right[i][k | 3];
            if (k % 4 < 3) {
                v *= exposure ? (float)exposure[i] : 1;
                if (behind && as_light) v = alpha * v + (1 - alpha) * behind[k % 4];
                v = encode(v > 1 ? 1 : v);
                if (behind && !as_light) v = alpha * v + (1 - alpha) * behind[k % 4];
            } else v = alpha;
            bytes[i][k] = (unsigned char)(255 * (v < 0 ? 0 : v > 1 ? 1 : v) + 0.5f);
        }
        frames[i].pixels = bytes[i];
        frames[i].format = SSDGS_PIXELS_RGBA8;
        frames[i].has_image = 1;
    }
}

/* What is said of the first `count` photographs. */
static const char *said(int count) {
    olat_dataset set;
    const ssdgs_train_options options = ssdgs_train_options_default();
    memset(&set, 0, sizeof set);
    set.frames = frames;
    set.count = count;
    heard[0] = 0;
    CHECK(!hull_judge(&set, &options, &logger));
    return heard;
}

static int silent(int count) {
    const int ok = !*said(count);
    if (!ok) printf("    %s", heard);
    return ok;
}

static void test_flooded(void) {
    as_bytes(0, NULL, NULL, 0);
    CHECK(silent(MANY));
    as_bytes(1 << 3 | 1 << 9 | 1 << 15 | 1 << 21, NULL, NULL, 0);
    CHECK(strstr(said(MANY), "4 of the 24 photographs look lit from all around") &&
          strstr(heard, ": r_003.png, r_009.png, r_015.png, r_021.png. ") && !strstr(heard, "brightness"));
    as_bytes(1 << 15, NULL, NULL, 0);
    CHECK(strstr(said(MANY), "1 of the 24 photographs looks lit") && strstr(heard, ": r_015.png. "));
    as_bytes(0xAAAAAA, NULL, NULL, 0); /* every other one: most are told, none of the others is */
    CHECK(strstr(said(MANY), "lit from all around"));
    int many = 0;
    CHECK(sscanf(heard, "%d", &many) == 1 && many >= 8 && many <= 12);
    for (int i = 0; i < MANY; i += 2) CHECK(!strstr(heard, names[i] + 10));
    as_bytes(0xFFFFFF, NULL, NULL, 0); /* a room, and no dark one: not this note's matter */
    CHECK(!strstr(said(MANY), "lit from all around"));
}

static void test_exposures(void) {
    double exposure[MANY];
    for (int strength = 0; strength < 3; strength++) {
        static const double ratios[3] = {1.2, 5, 9};
        for (int i = 0; i < MANY; i++)
            exposure[i] = 0.6 * pow(ratios[strength], (i * 11 % MANY) / (MANY - 1.0) - 0.5);
        as_bytes(0, exposure, NULL, 0);
        const char *notes = said(MANY);
        if (!CHECK(!strstr(notes, "brightness differs") == !strength && !strstr(notes, "all around")))
            printf("    %g times: %s", ratios[strength], notes);
        for (int i = 0; i < MANY; i++) /* told, they are right */
            for (int c = 0; c < 3; c++) frames[i].light.intensity[c] *= (ssdgs_real)exposure[i];
        CHECK(silent(MANY));
        for (int i = 0; i < MANY; i++)
            for (int c = 0; c < 3; c++) frames[i].light.intensity[c] = 5;
    }
    for (int i = 0; i < MANY; i++) exposure[i] = i * 5 % 8 < 4 ? 1 : 0.3; /* two telephones */
    as_bytes(0, exposure, NULL, 0);
    CHECK(strstr(said(MANY), "brightness differs") && strstr(heard, "--refine"));
}

static void test_edges(void) {
    static const float white[3] = {1, 1, 1}, green[3] = {0.1f, 0.9f, 0.2f}, black[3] = {0, 0, 0};
    for (int as_light = 0; as_light < 2; as_light++) {
        as_bytes(0, NULL, white, as_light);
        CHECK(strstr(said(MANY), "lead towards white (1.00,1.00,1.00)"));
        as_bytes(0, NULL, black, as_light); /* is told as multiplied by alpha, by the trainer */
        CHECK(silent(MANY));
    }
    as_bytes(0, NULL, green, 0);
    CHECK(strstr(said(MANY), "lead towards one colour (0.1") && strstr(heard, ",0.9") &&
          strstr(heard, ",0.2"));
}

static void as_floats(float factor, float most, int encoded) {
    as_bytes(0, NULL, NULL, 0);
    for (int i = 0; i < MANY; i++) {
        for (int k = 0; k < 4 * PIXELS; k++) {
            float v = right[i][k];
            if (k % 4 < 3) {
                v = factor * v > most ? most : factor * v;
                v = encoded ? encode(v) : v;
                if (encoded == 2) v = floorf(255 * v + 0.5f) / 255;
            }
            floats[i][k] = v;
        }
        frames[i].pixels = floats[i];
        frames[i].format = SSDGS_PIXELS_RGBA32F;
    }
}

static void test_numbers(void) {
    float most = 0;
    for (int i = 0; i < MANY; i++)
        for (int k = 0; k < 4 * PIXELS; k++)
            if (k % 4 < 3 && right[i][k] > most) most = right[i][k];
    as_floats(2 / most, 10, 0);
    CHECK(silent(MANY));
    as_floats(0.9f / most, 10, 0); /* nothing is bright, and all is light */
    CHECK(silent(MANY));
    as_floats(0.9f / most, 10, 1);
    CHECK(strstr(said(MANY), "no number in the OpenEXR photographs exceeds 1"));
    as_floats(0.9f / most, 10, 2);
    CHECK(strstr(said(6), "no number in the OpenEXR photographs exceeds 1"));
    as_floats(2 / most, 1, 0);
    CHECK(strstr(said(MANY), "exceeds 1"));
}

static void test_limits(void) {
    as_bytes(0, NULL, NULL, 0);
    CHECK(strstr(said(11), "cannot be judged: that takes 12 photographs that show outlines, and 11 do"));
    static olat_frame kept[MANY];
    memcpy(kept, frames, sizeof kept);
    for (int i = 0; i < MANY; i++) frames[i] = kept[i % 2];
    CHECK(strstr(said(MANY), "cannot be judged") || !*heard);
    for (int i = 0; i < MANY; i++) frames[i] = kept[0];
    CHECK(strstr(said(MANY), "all are taken from one side"));
    memcpy(frames, kept, sizeof kept);
    for (int i = 0; i < MANY; i++) /* nothing is in the box */
        for (int c = 0; c < 3; c++) frames[i].camera.view[4 * c + 3] += (ssdgs_real)(c ? 0 : 0.8);
    CHECK(strstr(said(MANY), "bounds_min .. bounds_max do not hold what the photographs show"));
    memcpy(frames, kept, sizeof kept);
    olat_dataset set;
    char error[512];
    const olat_reader reader = {context, NULL, NULL};
    const ssdgs_train_options options = ssdgs_train_options_default();
    if (!CHECK(!olat_load_at("examples/data/waxcow", "transforms_train.json", 0, NULL, &reader, &set, error)))
        return;
    heard[0] = 0;
    CHECK(!hull_judge(&set, &options, &logger) && !*heard);
    olat_free(&set);
}

/* What judge.h and the trainer note of the photographs. */
static const char *noted(void) {
    ssdgs_context_desc desc;
    ssdgs_context *own = NULL;
    ssdgs_model *fresh = NULL;
    ssdgs_trainer *trainer = NULL;
    static ssdgs_photo photos[MANY];
    memset(&desc, 0, sizeof desc);
    desc.logger = logger;
    for (int i = 0; i < MANY; i++) photos[i] = olat_photo(frames + i);
    CHECK(!ssdgs_context_create(&desc, &own) && !ssdgs_model_create(own, NULL, 0, &fresh));
    heard[0] = 0;
    CHECK(!ssdgs_trainer_create(fresh, photos, MANY, NULL, &trainer));
    const ssdgs_train_options standard = ssdgs_train_options_default();
    CHECK(!judge_photos(photos, MANY, ssdgs_model_settings(fresh), &standard, &logger));
    ssdgs_trainer_destroy(trainer);
    ssdgs_model_destroy(fresh);
    ssdgs_context_destroy(own);
    return heard;
}

static void test_trainer(void) {
    as_floats(1, 10, 0);
    CHECK(!*noted());
    for (int i = 0; i < MANY; i++) { /* one hot pixel in each, somewhere on the object or beside it */
        const int pixel = (int)(test_uniform(11, (uint64_t)i) * PIXELS);
        for (int c = 0; c < 3; c++) floats[i][4 * pixel + c] = 3000;
        floats[i][4 * pixel + 3] = 1;
    }
    CHECK(!*noted());
    CHECK(!strstr(said(MANY), "brightness") && !strstr(heard, "all around"));
    static olat_frame kept[MANY];
    memcpy(kept, frames, sizeof kept);
    as_bytes(0, NULL, NULL, 0);
    for (int i = 0; i < MANY; i++) { /* lights of the others contradict */
        frames[i].light = kept[(i + 5) % MANY].light;
    }
    CHECK(strstr(noted(), "contradicts"));
    static const int ways[4] = {2, 6, 10, 11};
    for (int way = 0; way < 4; way++) { /* half as large again, and beside the box: it holds a part */
        double d[3];
        direction_of(ways[way], 12, 0.3, d);
        for (int i = 0; i < MANY; i++) {
            ssdgs_real *view = frames[i].camera.view;
            memcpy(frames + i, kept + i, sizeof *kept);
            frames[i].pixels = bytes[i];
            frames[i].format = SSDGS_PIXELS_RGBA8;
            for (int c = 0; c < 3; c++) {
                frames[i].light.position[c] =
                    (ssdgs_real)(1.5 * (double)kept[i].light.position[c] + 1.125 * d[c]);
                view[4 * c + 3] *= (ssdgs_real)1.5;
                for (int l = 0; l < 3; l++) view[4 * c + 3] -= view[4 * c + l] * (ssdgs_real)(1.125 * d[l]);
            }
        }
        CHECK(strstr(noted(), "lie outside of bounds_min") && !strstr(heard, "masks or poses"));
        CHECK(strstr(said(MANY), "do not hold") && !strstr(heard, "all around") &&
              !strstr(heard, "brightness"));
    }
    memcpy(frames, kept, sizeof kept);
    as_bytes(0, NULL, NULL, 0);
    for (int k = 3; k < 4 * PIXELS; k += 4) bytes[5][k] = (unsigned char)(255 - bytes[5][k]);
    CHECK(strstr(noted(), "1 photographs of 24, the first number 5, are transparent where the others show"));
}

int main(void) {
    if (!CHECK(!ssdgs_context_create(NULL, &context))) return 1;
    make_model();
    make_photographs();
    test_flooded();
    test_exposures();
    test_edges();
    test_numbers();
    test_limits();
    test_trainer();
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    TEST_END();
}
