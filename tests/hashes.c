/* Hashes of what the library computes, one line for each part, instruction set and settings. A change that
   only moves or renames code leaves every line as it was: `make hashes` before and after. The first argument
   is a folder to write into, the second, if any, names the one instruction set to try. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/reduce.h"
#include "../examples/sky.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { PHOTOS = 6, SIDE = 48, PIXELS = SIDE * SIDE, PLANES = 19 };
static unsigned char pixels[PHOTOS][PIXELS * 4];
static float floats[PIXELS * 4];
static uint16_t words[2][PIXELS * 4];
static ssdgs_photo photos[PHOTOS];
static uint64_t hash;
static char path[2][1000];
static ssdgs_context *context;

static void see(const void *data, size_t size) { /* FNV-1a */
    const unsigned char *bytes = (const unsigned char *)data;
    for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 1099511628211u;
}

static void see_model(ssdgs_model *model) {
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t c = 0; c < (size_t)v.channels; c++)
        see(v.gaussians + c * v.stride, (size_t)v.count * sizeof(ssdgs_real));
    see(v.scattering, v.scattering_count * sizeof(ssdgs_real));
    see(v.shadow, v.shadow_count * sizeof(ssdgs_real));
    see(v.asg_basis, 4 * SSDGS_ASG_COUNT * sizeof(ssdgs_real));
    see(ssdgs_model_settings(model)->ambient, 3 * sizeof(ssdgs_real));
}

static ssdgs_result see_file(const char *name) {
    FILE *file = fopen(name, "rb");
    if (!file) return SSDGS_ERR_IO;
    for (int byte = getc(file); byte != EOF; byte = getc(file)) {
        const unsigned char value = (unsigned char)byte;
        see(&value, 1);
    }
    fclose(file);
    return SSDGS_OK;
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

static ssdgs_train_options options_of(int iterations) {
    ssdgs_train_options options = ssdgs_train_options_default();
    options.iterations = iterations;
    options.schedule = SSDGS_SCHEDULE_JOINT;
    options.initial_points = 500;
    options.densify_every = options.densify_from = 20;
    options.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT | SSDGS_REFINE_AMBIENT;
    return options;
}

static ssdgs_result train_on(ssdgs_model *model, const ssdgs_photo *shown,
                             const ssdgs_train_options *options) {
    ssdgs_trainer *trainer = NULL;
    ssdgs_result result = ssdgs_trainer_create(model, shown, PHOTOS, options, &trainer);
    if (!result) result = ssdgs_trainer_run(trainer, NULL, NULL);
    ssdgs_trainer_destroy(trainer);
    see_model(model);
    return result;
}

static ssdgs_result train(ssdgs_model *model) {
    const ssdgs_train_options options = options_of(50);
    return train_on(model, photos, &options);
}

/* The paper's order of terms, three photographs a step in three formats, one under several lights,
   intensities refined, opaque ones over a background; half of it from a checkpoint. */
static ssdgs_result train_else(ssdgs_model *model) {
    static ssdgs_light more[2];
    ssdgs_train_options options = options_of(24);
    ssdgs_photo shown[PHOTOS];
    ssdgs_model *fresh = NULL, *again = NULL;
    ssdgs_trainer *trainer = NULL;
    ssdgs_result result = SSDGS_OK;
    memcpy(shown, photos, sizeof shown);
    for (int p = 0; p < 4 * PIXELS; p++) {
        const double linear = (double)ssdgs_srgb_decode((ssdgs_real)pixels[1][p] / 255);
        floats[p] = (float)(p % 4 < 3 ? linear : pixels[1][p] / 255);
        words[0][p] = (uint16_t)(pixels[2][p] * 257);
        words[1][p] = (uint16_t)(p % 4 < 3 ? 0x2C00 + 8 * pixels[3][p] : pixels[3][p] ? 0x3C00 : 0);
    }
    shown[1].pixels = floats, shown[1].format = SSDGS_PIXELS_RGBA32F;
    shown[2].pixels = words[0], shown[2].format = SSDGS_PIXELS_RGBA16;
    shown[3].pixels = words[1], shown[3].format = SSDGS_PIXELS_RGBA16F;
    more[0] = photos[0].light;
    more[1] = photos[5].light;
    more[1].kind = SSDGS_LIGHT_DIRECTIONAL;
    more[1].direction[2] = -1;
    for (int c = 0; c < 3; c++) more[1].intensity[c] = 1;
    shown[4].more = more, shown[4].more_count = 2;
    shown[5].light.focus = 2;
    for (int c = 0; c < 3; c++) {
        shown[5].light.direction[c] = -shown[5].light.position[c] / (ssdgs_real)2.2360679775;
        options.background[c] = (ssdgs_real)0.1;
    }
    options.schedule = SSDGS_SCHEDULE_PROGRESSIVE;
    options.batch = 3;
    options.random_background = 0;
    options.opacity_reset_every = 11;
    options.densify_from = options.densify_every = 8;
    options.densify_gradient = (ssdgs_real)1e-5;
    options.refine = SSDGS_REFINE_INTENSITY | SSDGS_REFINE_LIGHT;
    result = ssdgs_model_create(context, ssdgs_model_settings(model), 0, &fresh);
    if (!result) result = ssdgs_trainer_create(fresh, shown, PHOTOS, &options, &trainer);
    for (int i = 0; i < 4 && !result; i++) result = ssdgs_trainer_step(trainer, NULL);
    if (!result) result = ssdgs_trainer_save(trainer, path[0]);
    ssdgs_trainer_destroy(trainer);
    trainer = NULL;
    if (!result) result = ssdgs_model_create(context, ssdgs_model_settings(model), 0, &again);
    if (!result) result = ssdgs_trainer_create(again, shown, PHOTOS, &options, &trainer);
    if (!result) result = ssdgs_trainer_load(trainer, path[0]);
    if (!result) result = ssdgs_trainer_run(trainer, NULL, NULL);
    for (int i = 0; i < PHOTOS && !result; i++) {
        result = ssdgs_trainer_refined(trainer, i, &shown[i].camera, &shown[i].light);
        see(&shown[i].camera, sizeof shown[i].camera);
        see(shown[i].light.position, sizeof shown[i].light.position);
        see(shown[i].light.intensity, sizeof shown[i].light.intensity);
    }
    ssdgs_trainer_destroy(trainer);
    if (!result) see_model(again);
    ssdgs_model_destroy(again);
    ssdgs_model_destroy(fresh);
    return result;
}

/* The bytes of a checkpoint, of train_else(). */
static ssdgs_result checkpoint(ssdgs_model *model) {
    int iteration = 0;
    ssdgs_result result = ssdgs_checkpoint_iteration(context, path[0], &iteration, NULL);
    see(&iteration, sizeof iteration);
    return result ? result : see_file(path[0]);
}

static ssdgs_image planes_of(ssdgs_real *planes) {
    ssdgs_image image = {0,
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
    return image;
}

/* Every plane of a render lit from two sides, once exact and once with the shortcuts of a game. */
static ssdgs_result render(ssdgs_model *model) {
    static ssdgs_real planes[18 * PIXELS];
    const ssdgs_image image = planes_of(planes);
    const ssdgs_light lights[2] = {photos[2].light, photos[5].light};
    const ssdgs_render_options options[2] = {ssdgs_render_options_exact(), ssdgs_render_options_fast()};
    ssdgs_result result = SSDGS_OK;
    for (int i = 0; i < 2 && !result; i++) {
        result = ssdgs_render_ex(model, &photos[1].camera, lights, 2, &options[i], &image, NULL);
        see(planes, sizeof planes);
    }
    return result;
}

/* The other presets, and what they leave for the next frame: at rest, the camera moved, a light dark, the
   model touched. */
static ssdgs_result frames(ssdgs_model *model) {
    static ssdgs_real planes[18 * PIXELS];
    const ssdgs_image image = planes_of(planes);
    ssdgs_light lights[3] = {photos[2].light, photos[5].light, photos[3].light};
    ssdgs_render_options options[2] = {ssdgs_render_options_default(), ssdgs_render_options_preview()};
    ssdgs_result result = SSDGS_OK;
    options[0].antialias = 1;
    for (int i = 0; i < 10 && !result; i++) {
        if (i % 5 == 2) lights[1].intensity[0] = lights[1].intensity[1] = lights[1].intensity[2] = 0;
        if (i % 5 == 3) lights[0].position[2] += 1;
        if (i % 5 == 4) ssdgs_model_arrays(model);
        result = ssdgs_render_ex(model, &photos[i % 5 > 0].camera, lights, 3, &options[i / 5], &image, NULL);
        see(planes, sizeof planes);
    }
    return result;
}

static void shade(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    (void)user;
    for (int i = 0; i < count; i++)
        if (points[3 * i] < (ssdgs_real)0.1 * (ssdgs_real)light) fraction[i] *= (ssdgs_real)0.25;
}

/* Wax with a sheen, made in code. */
static ssdgs_result make_wax(const ssdgs_model *like, ssdgs_model **model) {
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_result result;
    settings.transfer = ssdgs_model_settings(like)->transfer;
    settings.scattering.layers = settings.shadow.layers = 0;
    settings.transport = 1;
    settings.length_unit = 1;
    settings.light_map.bias = (ssdgs_real)0.1;
    for (int c = 0; c < 3; c++) {
        settings.medium.scattering[c] = (ssdgs_real)(20 + 5 * c);
        settings.medium.absorption[c] = (ssdgs_real)(0.1 + 0.1 * c);
    }
    result = ssdgs_model_create(context, &settings, 300, model);
    for (int i = 0; i < 300 && !result; i++) {
        const ssdgs_real roughness[2] = {(ssdgs_real)0.3, (ssdgs_real)0.4};
        const double z = 1 - 2 * (i + 0.5) / 300, across = sqrt(1 - z * z), turn = 2.4 * i;
        ssdgs_gaussian g = ssdgs_gaussian_default();
        g.normal[0] = (ssdgs_real)(across * cos(turn));
        g.normal[1] = (ssdgs_real)(across * sin(turn));
        g.normal[2] = (ssdgs_real)z;
        for (int c = 0; c < 3; c++) {
            g.position[c] = g.normal[c] / 3;
            g.scale[c] = (ssdgs_real)0.03;
            g.scattering[c] = 1;
        }
        g.opacity = (ssdgs_real)0.9;
        result = ssdgs_gaussian_mirror(*model, roughness, &g);
        if (!result) result = ssdgs_model_set(*model, i, &g);
    }
    return result ? result : ssdgs_model_sort(*model);
}

/* Placed objects under lights of every kind, with an occluder, depths and an environment: as they are, at
   rest, and moved; what of light passes them. */
static ssdgs_result place(ssdgs_model *model) {
    static ssdgs_real planes[PLANES * PIXELS], scene_depth[PIXELS], sky[8 * 4 * 3];
    static unsigned char mask[100000], bytes[PIXELS * 8];
    ssdgs_image image = planes_of(planes);
    ssdgs_render_options options = ssdgs_render_options_default();
    ssdgs_occluder occluder = {shade, NULL, 1, NULL, 0};
    ssdgs_light lights[7] = {photos[2].light, photos[5].light, photos[4].light, photos[3].light};
    ssdgs_object objects[3];
    ssdgs_model *wax = NULL;
    ssdgs_scene *scene = NULL;
    ssdgs_result result = make_wax(model, &wax);
    if (!result) result = ssdgs_scene_create(context, &scene);
    for (int i = 0; i < 96; i++) sky[i] = (ssdgs_real)(i % 17 ? 0.1 : 2);
    if (!result && sky_lights(sky, 8, 4, NULL, lights + 4, 3, options.ambient)) result = SSDGS_ERR_ARGUMENT;
    for (int i = 4; i < 7; i++) {
        see(lights[i].direction, sizeof lights[i].direction);
        see(lights[i].intensity, sizeof lights[i].intensity);
    }
    see(options.ambient, sizeof options.ambient);
    lights[1].kind = SSDGS_LIGHT_SPOT;
    lights[1].cone[0] = (ssdgs_real)0.1, lights[1].cone[1] = (ssdgs_real)0.3;
    lights[2].range = 3, lights[2].unshadowed = 1;
    lights[3].range = 4, lights[3].focus = 3;
    for (int i = 1; i < 4; i++) /* at (cos, sin, 1/2) x 2: towards the middle */
        for (int c = 0; c < 3; c++)
            lights[i].direction[c] = -lights[i].position[c] / (ssdgs_real)2.2360679775;
    for (int i = 0; i < (int)sizeof mask; i++) mask[i] = (unsigned char)(i * 37);
    for (int i = 0; i < PIXELS; i++) scene_depth[i] = (ssdgs_real)(i % SIDE < 20 ? 2 : 0);
    for (int i = 0; i < 3 && !result; i++) objects[i] = ssdgs_object_default(i < 2 ? model : wax);
    image.median_depth = planes + 18 * PIXELS;
    image.scene_depth = scene_depth;
    for (int frame = 0; frame < 5 && !result; frame++) {
        ssdgs_real points[30], fraction[10];
        if (!frame) {
            objects[1].to_world[0] = 0, objects[1].to_world[1] = (ssdgs_real)0.7;
            objects[1].to_world[4] = (ssdgs_real)0.7, objects[1].to_world[5] = 0;
            objects[1].to_world[10] = (ssdgs_real)0.7; /* mirrors */
            objects[1].to_world[3] = (ssdgs_real)0.4;
            objects[1].tint[1] = (ssdgs_real)0.5;
            objects[1].mask = mask;
            objects[1].roughness = 2;
            objects[1].specular = (ssdgs_real)1.5;
            objects[2].translucency = 2;
            objects[2].to_world[3] = (ssdgs_real)-0.4;
            ssdgs_scene_occlude(scene, &occluder);
        }
        if (frame == 2) objects[2].to_world[7] += (ssdgs_real)0.2;
        if (frame == 3) lights[0].intensity[0] = lights[0].intensity[1] = lights[0].intensity[2] = 0;
        if (frame == 3) scene_depth[PIXELS / 2] = 1;
        if (frame == 4) ssdgs_scene_occlude(scene, NULL);
        if (frame != 1) result = ssdgs_scene_light(scene, objects, 3, NULL, lights, 7, &options);
        for (int i = 0; i < 30; i++) points[i] = (ssdgs_real)(0.15 * (i / 3) - 0.1 * (i % 3));
        for (int light = 0; light < 7 && !result; light++) {
            result = ssdgs_scene_shadow(scene, light, points, 10, fraction);
            see(fraction, sizeof fraction);
        }
        if (!result)
            result =
                ssdgs_scene_render(scene, objects, 3, &photos[1].camera, lights, 7, &options, &image, NULL);
        see(planes, sizeof planes);
    }
    for (int format = SSDGS_RGBA8; format <= SSDGS_RGBA16F; format++) {
        ssdgs_to_pixels(NULL, &image, SIDE, SIDE, SSDGS_TRANSFER_SRGB, format, bytes, SIDE * 8);
        see(bytes, sizeof bytes);
        ssdgs_blend_pixels(NULL, &image, SIDE, SIDE, SSDGS_TRANSFER_SRGB, format, bytes, SIDE * 8);
        see(bytes, sizeof bytes);
    }
    ssdgs_scene_destroy(scene);
    ssdgs_model_destroy(wax);
    return result;
}

/* A photograph evaluated, and its camera, light and intensity fitted; the same values laid over a background.
 */
static ssdgs_result refine(ssdgs_model *model) {
    static ssdgs_real image[3 * PIXELS];
    const ssdgs_real background[3] = {(ssdgs_real)0.2, (ssdgs_real)0.5, 1};
    ssdgs_photo photo = photos[4];
    ssdgs_metrics metrics;
    ssdgs_result result;
    memset(&metrics, 0, sizeof metrics);
    result = ssdgs_evaluate(model, &photo, background, image, &metrics);
    see(image, sizeof image);
    see(&metrics, sizeof metrics);
    if (!result) result = ssdgs_refine_photo(model, &photo, background, 8);
    see(&photo.camera, sizeof photo.camera);
    see(photo.light.position, sizeof photo.light.position);
    ssdgs_compose(image, image + PIXELS, PIXELS, SSDGS_TRANSFER_SRGB, background, image);
    see(image, sizeof image);
    return result;
}

/* Half of the Gaussians. */
static ssdgs_result reduce(ssdgs_model *model) {
    ssdgs_model *copy = NULL;
    ssdgs_result result = ssdgs_model_save(model, path[1]);
    if (!result) result = ssdgs_model_load(context, path[1], &copy, NULL);
    if (!result) result = reduce_model(context, &copy, ssdgs_model_count(copy) / 2);
    if (!result) see_model(copy);
    ssdgs_model_destroy(copy);
    return result;
}

/* Bytes of a model file that was loaded and saved. */
static ssdgs_result file(ssdgs_model *model) {
    ssdgs_model *copy = NULL;
    ssdgs_result result = ssdgs_model_save(model, path[1]);
    if (!result) result = ssdgs_model_load(context, path[1], &copy, NULL);
    if (!result) result = ssdgs_model_save(copy, path[1]);
    if (!result) result = see_file(path[1]);
    ssdgs_model_destroy(copy);
    return result;
}

static const struct {
    const char *name;
    ssdgs_result (*run)(ssdgs_model *model);
} parts[] = {{"trained", train}, {"rendered", render},         {"frames", frames},
             {"scene", place},   {"refined", refine},          {"reduced", reduce},
             {"file", file},     {"trained else", train_else}, {"checkpoint", checkpoint}};

int main(int argc, char **argv) {
    int failed = 0;
    for (int i = 0; i < 2; i++)
        snprintf(path[i], sizeof path[i], "%s/hashes.%s", argc > 1 ? argv[1] : ".", i ? "ply" : "checkpoint");
    make_photos();
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        if (argc > 2 && strcmp(argv[2], ssdgs_isa_string((ssdgs_isa)isa)) != 0) continue;
        for (int published = 0; published < 2; published++) {
            const ssdgs_settings settings = published ? ssdgs_settings_published() : ssdgs_settings_default();
            ssdgs_context_desc desc = {0};
            context = NULL;
            ssdgs_model *model = NULL;
            desc.isa = (ssdgs_isa)isa;
            if (ssdgs_context_create(&desc, &context)) continue;
            ssdgs_result result = ssdgs_model_create(context, &settings, 0, &model);
            for (size_t i = 0; i < sizeof parts / sizeof *parts && !result; i++) {
                hash = 14695981039346656037u;
                result = parts[i].run(model);
                printf("%s %s %s: %s %016llx%s%s\n", sizeof(ssdgs_real) == 4 ? "float" : "double",
                       ssdgs_isa_string((ssdgs_isa)isa), published ? "published" : "default", parts[i].name,
                       (unsigned long long)hash, result ? " " : "",
                       result ? ssdgs_error_message(context) : "");
            }
            failed |= result != SSDGS_OK;
            ssdgs_model_destroy(model);
            ssdgs_context_destroy(context);
        }
    }
    remove(path[0]);
    remove(path[1]);
    return failed;
}
