/* Everything that reads what others wrote, and most numbers that a caller may set, under any bytes at all.
   Built plainly, it runs each FILE once, as the target that its folder is named after: seeds and past
   findings. Built with -DLIBFUZZER -fsanitize=fuzzer (`make fuzz`), it is libFuzzer for the target that the
   program is named after. A finding ends the program. Not drawn: threads, processes that share a batch. */
#define SSDGS_IMPLEMENTATION
#include "../../ssdgs.h"
#include "../../examples/colmap.h"
#include "../../examples/olat.h"
#include "../../examples/reduce.h"
#include "../../examples/sky.h"
#include "../../examples/splats.h"

#define HOLDS(condition) ((condition) ? (void)0 : broken(__LINE__, #condition))

static void broken(int line, const char *what) {
    fprintf(stderr, "fuzz.c:%d: does not hold: %s\n", line, what);
    abort();
}

static char folder[1000]; /* the program's: files are written there */

static const char *put_file(const char *name, const void *bytes, size_t size) {
    static char path[1100];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    HOLDS(file && fwrite(bytes, 1, size, file) == size && !fclose(file));
    return path;
}

/* A copy with no byte to spare, so that the address sanitizer sees the first one read beyond. */
static unsigned char *copy_of(const unsigned char *bytes, size_t size) {
    unsigned char *copy = (unsigned char *)calloc(size ? size : 1, 1);
    HOLDS(copy);
    if (size) memcpy(copy, bytes, size);
    return copy;
}

/* ---- bytes to values: 0, and what lies beyond the end, leave the default, so that few bytes make a scene
   ---- */

typedef struct input {
    const unsigned char *at, *end;
    int tame; /* 1: every number drawn was within -1000 .. 1000, where nothing overflows */
} input;

static input defaults_only(void) {
    static const unsigned char none[1] = {0};
    input in = {none, none, 1};
    return in;
}

static int draw(input *in) { return in->at < in->end ? *in->at++ : 0; }
static int draw_below(input *in, int count) { return draw(in) % count; }

/* Mostly within range of 0; some bytes stand for a number that has hurt others, one is followed by any 32
   bits. */
static ssdgs_real draw_real(input *in, double otherwise, double range) {
    static const double edges[63] = {
        0,        -0.0,  1,     -1,           0.5,          2,     1e-45,  -1e-45, 1.2e-38, 1e-30, 1e-20,
        -1e-20,   1e-15, 1e-10, 1e-7,         -1e-7,        1e-4,  1e-3,   0.01,   -0.01,   4,     10,
        -10,      20,    -20,   21,           50,           -50,   88,     -88,    89,      -89,   100,
        -100,     104,   127,   128,          1e3,          -1e3,  1e4,    -1e4,   1e5,     1e6,   -1e6,
        16777216, 1e8,   -1e8,  2147483648.0, 4294967296.0, 1e10,  -1e10,  1e13,   1e15,    -1e15, 1e18,
        1e19,     -1e19, 1e20,  1e25,         1e30,         -1e30, 3.4e38, -3.4e38};
    const int byte = draw(in);
    uint32_t bits = 0;
    if (byte == 0) return (ssdgs_real)otherwise;
    if (byte < 192) return (ssdgs_real)((byte - 96) / 95.0 * range);
    float value = (float)edges[byte < 255 ? byte - 192 : 0];
    for (int i = 0; byte == 255 && i < 4; i++) bits |= (uint32_t)draw(in) << 8 * i;
    if (byte == 255) memcpy(&value, &bits, sizeof value);
    in->tame = in->tame && ssdgs__finite((ssdgs_real)value) && fabs((double)value) <= 1000;
    return (ssdgs_real)value;
}

static ssdgs_real draw_size(input *in, double otherwise, double range) {
    const ssdgs_real value = draw_real(in, otherwise, range);
    return value < 0 ? -value : value;
}

/* Whether it was done; a failure has a message of its own. */
static int done(ssdgs_context *context, ssdgs_result result) {
    HOLDS(!result || context->message[0]);
    context->message[0] = 0;
    return !result;
}

static ssdgs_context *draw_context(input *in) {
    ssdgs_context *context = NULL;
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = 1;
    desc.isa = (ssdgs_isa)draw_below(in, SSDGS_ISA_COUNT);
    if (ssdgs_context_create(&desc, &context)) desc.isa = SSDGS_ISA_AUTO;
    HOLDS(context || !ssdgs_context_create(&desc, &context));
    return context;
}

static ssdgs_settings draw_settings(input *in) {
    ssdgs_settings s = draw(in) & 1 ? ssdgs_settings_published() : ssdgs_settings_default();
    int flags = draw(in);
    s.terms ^= draw_below(in, 16);
    s.baked = flags >> 7;
    s.transfer ^= flags & 1;
    s.per_channel_optics ^= flags >> 1 & 1;
    s.depth_cue ^= flags >> 2 & 1;
    s.transport ^= flags >> 3 & 1;
    s.residual_shadow ^= flags >> 4 & 1;
    s.shadow_on_scattering ^= flags >> 5 & 1;
    s.light_map.blur ^= flags >> 6 & 1;
    s.dipole = draw_below(in, 2);
    s.asg = draw_below(in, 2) ? SSDGS_ASG_DEFERRED : SSDGS_ASG_GEOMETRIC;
    s.scattering.layers = 2 + draw_below(in, 3);
    s.scattering.width = 1 + draw_below(in, 20);
    s.shadow.layers = draw_below(in, 4);
    s.shadow.width = 1 + draw_below(in, 20);
    s.light_map.size = 16 + draw_below(in, 64);
    if (draw(in) == 1) s.light_map.size = 0;
    s.light_map.bias = draw_real(in, (double)s.light_map.bias, 1);
    s.pixel_variance = draw_real(in, (double)s.pixel_variance, 1);
    s.eta = draw_real(in, (double)s.eta, 3);
    s.length_unit = draw_real(in, (double)s.length_unit, 2);
    s.light_scale = draw_real(in, (double)s.light_scale, 2);
    for (int i = 0; i < 3; i++) s.centre[i] = draw_real(in, (double)s.centre[i], 2);
    return s;
}

/* What joined later is drawn last, where older inputs have no bytes left: here and in all named more_. */
static void more_settings(input *in, ssdgs_settings *s) {
    const int flags = draw(in);
    if (flags & 1) s->scattering.layers = 0, s->transport = 1;
    if (flags & 2) s->octaves.view = draw_below(in, 9);
    if (flags & 4) s->octaves.light = draw_below(in, 9);
    if (s->baked) s->harmonics = flags >> 6;
    for (int i = 0; i < 3; i++) {
        s->medium.scattering[i] = draw_size(in, 3, 20);
        s->medium.absorption[i] = draw_size(in, 0.1, 1);
        s->ambient[i] = draw_size(in, 0, 1);
        s->origin[i] = draw_real(in, 0, 2);
    }
    if (!s->baked && flags & 8) s->kept = draw_size(in, 0.5, 1), s->harmonics = s->kept > 0 ? flags >> 6 : 0;
}

/* NULL where the settings are refused. more: where the rest of them is drawn, or NULL. */
static ssdgs_model *draw_model(input *in, ssdgs_context *context, int most, input *more) {
    ssdgs_settings settings = draw_settings(in);
    ssdgs_model *model = NULL;
    if (more) more_settings(more, &settings);
    if (ssdgs_model_create(context, &settings, draw_below(in, most + 1), &model)) return NULL;
    for (int i = 0; i < model->count; i++)
        for (int c = 0; c < model->channels; c++) {
            ssdgs_real *value = model->gaussians + (size_t)c * model->capacity + i;
            *value = draw_real(in, (double)*value, c < SSDGS_ROTATION ? 1 : 6);
        }
    for (int i = draw_below(in, 9); i > 0; i--) { /* shared values anywhere */
        size_t at = (size_t)draw(in) << 8;
        at |= (size_t)draw(in);
        model->globals[at % model->global_count] = draw_real(in, 0, 6);
    }
    return model;
}

/* Draws the model again, with more settings where the input has them. */
static ssdgs_model *redraw_model(ssdgs_model *model, input from, int most, input *more) {
    if (!model || more->at == more->end) return model;
    ssdgs_context *context = model->context;
    ssdgs_model_destroy(model);
    return draw_model(&from, context, most, more);
}

static ssdgs_camera draw_camera(input *in, int side) {
    ssdgs_real eye[3], target[3], up[3];
    int width = 1 + draw_below(in, side), height = 1 + draw_below(in, side), flags = draw(in);
    for (int i = 0; i < 3; i++) {
        eye[i] = draw_real(in, i == 1 ? -3 : i, 3);
        target[i] = draw_real(in, 0, 1);
        up[i] = draw_real(in, i == 2, 1);
    }
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, draw_real(in, 0.6, 3), width, height);
    if (flags & 1) camera.near_plane = draw_real(in, 0, 4);
    if (flags & 2) camera.cx = draw_real(in, 0, 20), camera.cy = draw_real(in, 0, 20);
    if (flags & 4) camera.fx = draw_real(in, 10, 100), camera.fy = draw_real(in, 10, 100);
    for (int i = 0; flags & 8 && i < 12; i++) camera.view[i] = draw_real(in, (double)camera.view[i], 1);
    return camera;
}

static void make_unit(ssdgs_real v[3]) {
    double length = 0;
    for (int i = 0; i < 3; i++) length += (double)v[i] * (double)v[i];
    for (int i = 0; length > 0 && i < 3; i++) v[i] = (ssdgs_real)((double)v[i] / sqrt(length));
}

static ssdgs_light draw_light(input *in) {
    ssdgs_light light;
    int kind = draw(in) & 3; /* 1: directional; 3: so, and of whatever length it was given */
    memset(&light, 0, sizeof light);
    light.kind = kind & 1 ? SSDGS_LIGHT_DIRECTIONAL : SSDGS_LIGHT_POINT;
    for (int i = 0; i < 3; i++) {
        light.position[i] = draw_real(in, i - 1, 3);
        light.intensity[i] = draw_real(in, 9, 10);
    }
    if (kind == 1) make_unit(light.position);
    for (int i = 0; i < 3 && (kind & 1); i++) light.direction[i] = -light.position[i];
    return light;
}

/* A spot shines at the middle unless it is told otherwise. */
static void more_light(input *in, ssdgs_light *light) {
    const int flags = draw(in);
    if (!flags) return;
    if (flags & 1) light->kind = SSDGS_LIGHT_SPOT;
    light->unshadowed = flags >> 1 & 1;
    for (int i = 0; i < 3; i++) light->direction[i] = draw_real(in, -(double)light->position[i], 1);
    if (!(flags & 4)) make_unit(light->direction);
    light->cone[0] = draw_size(in, 0.2, 1);
    light->cone[1] = light->cone[0] + draw_size(in, 0.3, 2);
    light->range = draw_size(in, 0, 5);
    light->focus = draw_size(in, 0, 20);
    if (flags & 8) light->kept = draw_size(in, 0.5, 1);
}

static int all_finite(const ssdgs_real *values, size_t count) {
    size_t i = 0;
    while (i < count && ssdgs__finite(values[i])) i++;
    return i == count;
}

static int model_finite(const ssdgs_model *model) {
    int finite = all_finite(model->globals, model->global_count) && all_finite(model->settings.ambient, 3);
    for (int c = 0; c < model->channels; c++)
        finite &= all_finite(model->gaussians + (size_t)c * model->capacity, (size_t)model->count);
    return finite;
}

static uint64_t model_hash(const ssdgs_model *model) {
    uint64_t hash = ssdgs__fold(1, model->globals, model->global_count * sizeof(ssdgs_real));
    hash = ssdgs__fold(hash, model->settings.ambient, sizeof model->settings.ambient);
    for (int c = 0; c < model->channels; c++)
        hash = ssdgs__fold(hash, model->gaussians + (size_t)c * model->capacity,
                           (size_t)model->count * sizeof(ssdgs_real));
    return hash;
}

/* ---- rendering: no NaN from tame numbers, coverage within 0 and 1, the same bits from a context that kept
   results ---- */

enum { PLANES = 9, MOST_SIDE = 40, MOST_STRIDE = MOST_SIDE + 3, MOST_LIGHTS = 4, MOST_OBJECTS = 3 };
static const int plane_channels[PLANES] = {3, 1, 1, 3, 3, 3, 3, 1, 1}; /* of ssdgs_image, in order */

typedef struct picture {
    ssdgs_camera camera;
    ssdgs_light lights[MOST_LIGHTS];
    ssdgs_render_options options;
    ssdgs_real *planes[PLANES], depth[MOST_SIDE * MOST_STRIDE]; /* depth: the scene's, where `hidden` */
    int light_count, stride, wanted, hidden;
    ssdgs_scene *scene; /* NULL: of a model alone */
    ssdgs_object objects[MOST_OBJECTS];
    int object_count, passes; /* passes: what an occluder lets pass, of 255 */
} picture;

static size_t plane_values(const picture *p, int plane) {
    return (size_t)((p->camera.height - 1) * p->stride + p->camera.width) * (size_t)plane_channels[plane];
}

static void draw_picture(input *in, picture *p) {
    ssdgs_render_options *o = &p->options;
    memset(p, 0, sizeof *p);
    p->camera = draw_camera(in, MOST_SIDE);
    p->stride = p->camera.width + draw_below(in, 4);
    p->wanted = ~draw(in) & 255;
    p->light_count = (1 + draw(in)) % 3;
    for (int i = 0; i < p->light_count; i++) p->lights[i] = draw_light(in);
    *o = draw(in) & 1 ? ssdgs_render_options_exact() : ssdgs_render_options_default();
    o->terms ^= draw_below(in, 16);
    o->antialias = draw(in) & 1;
    o->stop = draw_real(in, (double)o->stop, 1);
    o->alpha_threshold = draw_real(in, (double)o->alpha_threshold, 1);
    o->max_error = draw_real(in, (double)o->max_error, 1);
    o->light_detail = draw_real(in, 1, 1);
    if (o->light_detail > 1) o->light_detail = 1; /* larger maps cost time alone */
    for (int i = 0; i < 3; i++) o->background[i] = draw_real(in, 0.5, 1);
}

static void more_picture(input *in, picture *p) {
    ssdgs_render_options *o = &p->options;
    ssdgs_real depth[5];
    const int flags = draw(in);
    for (int i = 0; i < p->light_count; i++) more_light(in, p->lights + i);
    o->transport_detail = draw_size(in, (double)o->transport_detail, 1);
    if (o->transport_detail > 1) o->transport_detail = 1; /* as light_detail */
    for (int i = 0; flags & 1 && i < 27; i++) o->ambient[i / 3][i % 3] = draw_real(in, 0, 1);
    p->wanted |= (flags & 2) << 7;
    p->hidden = flags >> 2 & 1;
    for (int i = 0; p->hidden && i < 5; i++) depth[i] = draw_size(in, HUGE_VAL, 6);
    for (int i = 0; p->hidden && i < MOST_SIDE * MOST_STRIDE; i++) p->depth[i] = depth[i % 5];
    o->level_detail = draw_size(in, 1, 1);
}

static ssdgs_result take_picture(ssdgs_model *model, picture *p) {
    for (int i = 0; i < PLANES; i++)
        p->planes[i] =
            p->wanted >> i & 1 ? (ssdgs_real *)calloc(plane_values(p, i), sizeof(ssdgs_real)) : NULL;
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.stride = p->stride;
    image.color = p->planes[0];
    image.alpha = p->planes[1];
    image.depth = p->planes[2];
    image.normal = p->planes[3];
    image.diffuse = p->planes[4];
    image.specular = p->planes[5];
    image.scattering = p->planes[6];
    image.shadow = p->planes[7];
    image.median_depth = p->planes[8];
    if (p->hidden) image.scene_depth = p->depth;
    ssdgs_render_stats stats;
    if (p->scene)
        return ssdgs_scene_render(p->scene, p->objects, p->object_count, &p->camera, p->lights,
                                  p->light_count, &p->options, &image, &stats);
    return ssdgs_render_ex(model, &p->camera, p->lights, p->light_count, &p->options, &image, &stats);
}

static void drop_picture(picture *p) {
    for (int i = 0; i < PLANES; i++) free(p->planes[i]);
}

static int is_nan(ssdgs_real value) { return !ssdgs__finite(value) && !(value > 1) && !(value < -1); }

static void check_picture(const picture *p, int tame) {
    for (int plane = 0; plane < PLANES; plane++)
        for (size_t i = 0; p->planes[plane] && i < plane_values(p, plane); i++) {
            if (tame) HOLDS(!is_nan(p->planes[plane][i]));
            if (plane == 1) HOLDS(p->planes[plane][i] >= 0 && p->planes[plane][i] <= 1);
        }
}

static void check_same(const picture *p, const picture *other) {
    for (int i = 0; i < PLANES; i++)
        if (p->planes[i])
            HOLDS(!memcmp(p->planes[i], other->planes[i], plane_values(p, i) * sizeof(ssdgs_real)));
}

static void fuzz_render(const unsigned char *data, size_t size) {
    static picture pictures[3];
    input in = {data, data + size, 1};
    ssdgs_context *context = draw_context(&in), *other = NULL;
    const input from = in;
    ssdgs_model *model = draw_model(&in, context, 12, NULL), *twin = NULL;
    const int frames = model ? 1 + draw_below(&in, 3) : 0;
    for (int i = 0; i < frames; i++) draw_picture(&in, pictures + i);
    for (int i = 0; i < frames; i++) more_picture(&in, pictures + i);
    model = redraw_model(model, from, 12, &in);
    for (int i = 0; model && i < frames; i++) {
        picture *p = pictures + i, again = *p;
        const int taken = done(context, take_picture(model, p));
        if (taken) check_picture(p, in.tame);
        if (taken && i == frames - 1 && i > 0) {
            ssdgs_context_desc desc;
            memset(&desc, 0, sizeof desc);
            desc.threads = 1;
            desc.isa = (ssdgs_isa)context->isa;
            HOLDS(!ssdgs_context_create(&desc, &other) &&
                  !ssdgs_model_create(other, &model->settings, model->count, &twin));
            memcpy(twin->globals, model->globals, model->global_count * sizeof(ssdgs_real));
            memcpy(twin->gaussians, model->gaussians,
                   model->capacity * (size_t)model->channels * sizeof(ssdgs_real));
            HOLDS(!take_picture(twin, &again));
            check_same(p, &again);
            drop_picture(&again);
        }
        drop_picture(p);
    }
    ssdgs_model_destroy(twin);
    ssdgs_context_destroy(other);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* ---- scenes: pictures as those of models alone, the same bits from a scene that kept results and a new one,
   shadows within 0 and 1; models edited in between ---- */

static void occlude(void *user, int light, const ssdgs_real *points, int count, ssdgs_real *fraction) {
    const picture *p = (const picture *)user;
    HOLDS(light >= 0 && light < p->light_count);
    for (int i = 0; i < count; i++)
        if (points[3 * i] > 0) fraction[i] *= (ssdgs_real)p->passes / 255;
}

static void draw_rotation(input *in, ssdgs_real r[9]) {
    ssdgs_real raw[4], q[4];
    for (int i = 0; i < 4; i++) raw[i] = draw_real(in, i == 0, 1);
    ssdgs__rotation_scalar(raw, q, r);
}

static ssdgs_object draw_object(input *in, ssdgs_model *const models[2]) {
    static const unsigned char mask[8] = {255, 0, 128, 1, 254, 255, 0, 64};
    const int flags = draw(in);
    ssdgs_object o = ssdgs_object_default(models[flags & 1]);
    ssdgs_real r[9];
    draw_rotation(in, r);
    const ssdgs_real scale = draw_real(in, 1, 2);
    for (int i = 0; i < 9; i++)
        o.to_world[i / 3 * 4 + i % 3] = flags & 2 && i % 3 ? -scale * r[i] : scale * r[i];
    for (int i = 0; i < 3; i++) {
        o.to_world[4 * i + 3] = draw_real(in, 0, 2);
        o.tint[i] = draw_size(in, 1, 2);
    }
    const int changed = flags & 4 ? draw_below(in, 12) : 0;
    if (flags & 4) o.to_world[changed] = draw_real(in, 0, 2);
    o.roughness = draw_size(in, 1, 4);
    o.specular = draw_size(in, 1, 4);
    o.translucency = draw_size(in, 1, 4);
    o.presence = flags & 16 ? draw_size(in, 1, 1) : 1;
    if (flags & 32 && o.model == models[0]) o.levels = models + 1, o.level_count = 1;
    if (flags & 8) o.mask = mask;
    return o;
}

/* The camera as an engine's matrices, some of their elements drawn. */
static void draw_matrices(input *in, ssdgs_context *context, ssdgs_camera *camera) {
    const int flags = draw(in), width = camera->width, height = camera->height;
    ssdgs_real m[2][16], passed[2][16];
    memset(m, 0, sizeof m);
    for (int i = 0; i < 12; i++) m[0][i] = i < 4 && !(flags & 4) ? camera->view[i] : -camera->view[i];
    m[1][0] = 2 * camera->fx / (ssdgs_real)width;
    m[1][2] = 1 - 2 * camera->cx / (ssdgs_real)width;
    m[1][5] = 2 * camera->fy / (ssdgs_real)height;
    m[1][6] = 2 * camera->cy / (ssdgs_real)height - 1;
    m[0][15] = 1;
    m[1][14] = -1;
    for (int i = draw_below(in, 4); i > 0; i--) {
        const int at = draw_below(in, 32);
        m[at / 16][at % 16] = draw_real(in, 0, 2);
    }
    for (int i = 0; i < 32; i++)
        passed[i / 16][i % 16] = m[i / 16][flags & SSDGS_COLUMN_MAJOR ? i % 4 * 4 + i % 16 / 4 : i % 16];
    done(context,
         ssdgs_camera_from_matrices(context, passed[0], passed[1], flags & 11, width, height, camera));
}

static void draw_sky(input *in, ssdgs_context *context, picture *p) {
    ssdgs_real pixels[8 * 4 * 3], turn[9];
    const int flags = draw(in), width = 1 + draw_below(in, 8), height = 1 + draw_below(in, 4);
    const int count = draw_below(in, MOST_LIGHTS + 1);
    for (int i = 0; i < 8 * 4 * 3; i++) pixels[i] = i < 5 ? draw_size(in, 1, 2) : pixels[i * i % 11 % 5];
    draw_rotation(in, turn);
    ssdgs_real(*ambient)[3] = flags & 2 ? p->options.ambient : NULL;
    if (sky_lights(pixels, width, height, flags & 1 ? turn : NULL, p->lights, count, ambient)) return;
    p->light_count = count;
    if (in->tame)
        HOLDS(!ssdgs__lights_check(context, p->lights, count) && all_finite(p->options.ambient[0], 27));
}

/* A Gaussian is set, and read back; Gaussians are merged, sorted, and their box taken. */
static void edit_model(input *in, ssdgs_model **given) {
    ssdgs_model *model = *given;
    ssdgs_context *context = model->context;
    const int flags = draw(in), index = draw_below(in, 10), before = model->count;
    ssdgs_gaussian g = ssdgs_gaussian_default(), back;
    ssdgs_real v[sizeof g / sizeof(ssdgs_real)], roughness[2], low[3], high[3];
    memcpy(v, &g, sizeof g); /* position, rotation and normal are of any sign */
    for (size_t i = 0; flags & 1 && i < sizeof v / sizeof *v; i++)
        v[i] = i < 7 || (i > 9 && i < 13) ? draw_real(in, (double)v[i], 1) : draw_size(in, (double)v[i], 1);
    memcpy(&g, v, sizeof g);
    for (int i = 0; flags & 2 && i < 2; i++) roughness[i] = draw_size(in, 0.3, 1);
    if (flags & 2) done(context, ssdgs_gaussian_mirror(model, roughness, &g));
    if (done(context, ssdgs_model_set(model, index, &g))) {
        HOLDS(done(context, ssdgs_model_get(model, index, &back)));
        memcpy(v, &back, sizeof back);
        for (size_t i = 0; i < sizeof v / sizeof *v; i++) /* highlights are set where they are deferred */
            HOLDS(!is_nan(v[i]) || (i > 22 && i < 27 && model->settings.asg != SSDGS_ASG_DEFERRED));
        HOLDS(!memcmp(g.position, back.position, sizeof back.position) &&
              fabs((double)(g.opacity - back.opacity)) < 1e-4);
    }
    if (flags & 4) {
        const int most = draw_below(in, 10), finite = model_finite(model);
        if (!most) HOLDS(reduce_model(context, given, most) == SSDGS_ERR_ARGUMENT); /* without a message */
        else if (done(context, reduce_model(context, given, most)))
            HOLDS(before <= most ? (*given)->count == before : (*given)->count <= most);
        model = *given;
        if (finite) HOLDS(model_finite(model));
    }
    if (flags & 8) HOLDS(done(context, ssdgs_model_sort(model)));
    if (flags & 16) HOLDS(done(context, ssdgs_model_bounds(model, low, high)));
    for (int i = 0; flags & 16 && in->tame && i < 3; i++) HOLDS(low[i] <= high[i]);
}

static void check_shadow(input *in, const picture *p) {
    ssdgs_context *context = p->scene->context;
    ssdgs_real points[4 * 3], fraction[4];
    const int light = draw_below(in, MOST_LIGHTS + 1) - 1;
    for (int i = 0; i < 4 * 3; i++) points[i] = draw_real(in, i % 3 - 1, 2);
    const int lit = done(context, ssdgs_scene_light(p->scene, p->objects, p->object_count, NULL, p->lights,
                                                    p->light_count, &p->options));
    if (!done(context, ssdgs_scene_shadow(p->scene, light, points, 4, fraction))) return;
    HOLDS(lit && light >= 0 && light < p->light_count);
    for (int i = 0; i < 4; i++)
        if (all_finite(points + 3 * i, 3)) HOLDS(fraction[i] >= 0 && fraction[i] <= 1);
}

static void fuzz_scene(const unsigned char *data, size_t size) {
    static picture p, again;
    input in = {data, data + size, 1};
    ssdgs_context *context = draw_context(&in);
    ssdgs_model *models[2];
    ssdgs_scene *scene = NULL;
    for (int i = 0; i < 2; i++) {
        models[i] = draw_model(&in, context, 8, &in);
        HOLDS(models[i] || done(context, ssdgs_model_create(context, NULL, 2, models + i)));
    }
    HOLDS(done(context, ssdgs_scene_create(context, &scene)));
    for (int frames = 1 + draw_below(&in, 3); frames > 0; frames--) {
        draw_picture(&in, &p);
        more_picture(&in, &p);
        const int flags = draw(&in);
        p.scene = scene;
        p.object_count = (1 + draw(&in)) % (MOST_OBJECTS + 1);
        for (int i = 0; i < p.object_count; i++) p.objects[i] = draw_object(&in, models);
        if (flags & 2) draw_matrices(&in, context, &p.camera);
        if (flags & 4) draw_sky(&in, context, &p);
        int edited[MOST_OBJECTS]; /* merging its Gaussians makes another model */
        for (int i = 0; i < p.object_count; i++) edited[i] = p.objects[i].model == models[flags & 1];
        if (flags & 8) edit_model(&in, models + (flags & 1));
        for (int i = 0; i < p.object_count; i++)
            if (edited[i]) p.objects[i].model = models[flags & 1];
        for (int i = 0; i < p.object_count && flags & 64; i++) p.objects[i].kept = draw_size(&in, 1, 3);
        p.passes = draw(&in);
        ssdgs_occluder occluder = {occlude, &p, 0, NULL, 0};
        occluder.revision = (uint64_t)p.passes;
        ssdgs_scene_occlude(scene, flags & 16 ? &occluder : NULL);
        if (flags & 32) check_shadow(&in, &p);
        again = p;
        if (done(context, take_picture(NULL, &p))) {
            check_picture(&p, in.tame);
            occluder.user = &again;
            HOLDS(!ssdgs_scene_create(context, &again.scene));
            ssdgs_scene_occlude(again.scene, flags & 16 ? &occluder : NULL);
            HOLDS(done(context, take_picture(NULL, &again)));
            check_same(&p, &again);
            drop_picture(&again);
            ssdgs_scene_destroy(again.scene);
        }
        drop_picture(&p);
    }
    ssdgs_scene_destroy(scene);
    for (int i = 0; i < 2; i++) ssdgs_model_destroy(models[i]);
    ssdgs_context_destroy(context);
}

/* ---- training: a step leaves every parameter finite, or changes none ---- */

#define SIDE 16

static ssdgs_train_options draw_options(input *in) {
    ssdgs_train_options o = ssdgs_train_options_default();
    int flags = draw(in), rate = draw(in), rate_count = rate ? 12 : 0;
    o.seed = (uint64_t)draw(in);
    o.iterations = 1 + draw(in);
    if (flags & 128) o.iterations *= 1000;
    o.schedule = draw_below(in, 4);
    o.random_background = ~flags & 1;
    o.refine = flags >> 1 & 3;
    if (flags & 8) o.normal_weight = (ssdgs_real)(flags & 16 ? 1e30 : 0);
    if (flags & 32) o.prune_outside = (ssdgs_real)(flags & 64 ? 1 : 0);
    o.initial_points = draw_below(in, 40);
    o.max_gaussians = 1 + draw_below(in, 64);
    o.densify_every = 1 + draw_below(in, 4);
    o.densify_from = draw_below(in, 4);
    o.opacity_reset_every = draw_below(in, 4);
    o.dssim = draw_real(in, 0.2, 1);
    o.densify_gradient = draw_real(in, 0, 1);
    for (int i = 0; i < 3; i++) {
        o.background[i] = draw_real(in, 0.5, 1);
        o.bounds_min[i] = draw_real(in, -0.5, 1);
        o.bounds_max[i] = draw_real(in, 0.5, 1);
    }
    ssdgs_rate *rates[12];
    rates[0] = &o.rates.position, rates[1] = &o.rates.opacity, rates[2] = &o.rates.scale,
    rates[3] = &o.rates.rotation, rates[4] = &o.rates.color;
    rates[5] = &o.rates.asg, rates[6] = &o.rates.frame, rates[7] = &o.rates.material,
    rates[8] = &o.rates.shadow, rates[9] = &o.rates.scattering;
    rates[10] = &o.rates.camera, rates[11] = &o.rates.light;
    for (int i = 0; i < rate_count; i++) {
        rates[i]->start = draw_real(in, (double)rates[i]->start, 1);
        rates[i]->end = draw_real(in, (double)rates[i]->end, 1);
    }
    return o;
}

static void more_options(input *in, ssdgs_train_options *o) {
    o->refine |= draw_below(in, 4) << 2;
    o->batch = 1 + draw_below(in, 3);
    o->adam_epsilon = draw_size(in, (double)o->adam_epsilon, 1);
    o->finish = draw_size(in, (double)o->finish, 1);
}

static void draw_photo(input *in, ssdgs_photo *photo, uint32_t pixels[SIDE * SIDE * 4]) {
    unsigned char *bytes = (unsigned char *)pixels;
    memset(photo, 0, sizeof *photo);
    photo->camera = draw_camera(in, SIDE);
    photo->light = draw_light(in);
    photo->format = draw(in) & 1 ? SSDGS_PIXELS_RGBA16 : SSDGS_PIXELS_RGBA8;
    photo->pixels = pixels;
    unsigned pattern[4];
    for (size_t i = 0; i < 4; i++) pattern[i] = (unsigned)draw(in);
    for (size_t i = 0; i < SIDE * SIDE * 4 * sizeof *pixels; i++)
        bytes[i] = (unsigned char)(pattern[i & 3] + i * (pattern[1] & 15));
}

/* Halves and floats are within -2 .. 2, alphas within 0 .. 1, unless the pattern's bytes shall stay. */
static void more_photo(input *in, ssdgs_photo *photo, uint32_t *pixels, ssdgs_light more[2]) {
    const int flags = draw(in);
    more_light(in, &photo->light);
    photo->more = more;
    photo->more_count = draw_below(in, 3);
    for (int i = 0; i < photo->more_count; i++) {
        more[i] = draw_light(in);
        more_light(in, more + i);
    }
    if (flags & 1) photo->format = flags & 2 ? SSDGS_PIXELS_RGBA32F : SSDGS_PIXELS_RGBA16F;
    for (size_t i = 0; (flags & 5) == 1 && i < SIDE * SIDE * 4; i++) {
        uint16_t half;
        memcpy(&half, (unsigned char *)pixels + 2 * i, sizeof half);
        half = (uint16_t)(half & (i % 4 == 3 ? 0x3BFF : 0xBFFF));
        if (flags & 2) pixels[i] &= i % 4 == 3 ? 0x3F7FFFFF : 0xBFFFFFFF;
        else memcpy((unsigned char *)pixels + 2 * i, &half, sizeof half);
    }
}

static void step_holds(ssdgs_trainer *trainer) {
    const int finite = model_finite(trainer->model);
    const uint64_t before = model_hash(trainer->model);
    ssdgs_train_stats stats;
    if (!done(trainer->context, ssdgs_trainer_step(trainer, &stats)))
        HOLDS(model_hash(trainer->model) == before);
    else if (finite) HOLDS(model_finite(trainer->model));
}

static void fuzz_train(const unsigned char *data, size_t size) {
    static uint32_t pixels[2][SIDE * SIDE * 4];
    static ssdgs_light more[2][2];
    input in = {data, data + size, 1};
    ssdgs_context *context = draw_context(&in);
    ssdgs_train_options options = draw_options(&in);
    const int photo_count = 1 + draw_below(&in, 2);
    ssdgs_trainer *trainer = NULL;
    ssdgs_photo photos[2];
    int steps = 1 + draw_below(&in, 3);
    for (int i = 0; i < photo_count; i++) draw_photo(&in, photos + i, pixels[i]);
    const input from = in;
    ssdgs_model *model = draw_model(&in, context, 8, NULL);
    const int start = draw_below(&in, options.iterations); /* each term joins at its time */
    more_options(&in, &options);
    for (int i = 0; i < photo_count; i++) more_photo(&in, photos + i, pixels[i], more[i]);
    model = redraw_model(model, from, 8, &in);
    if (model && done(context, ssdgs_trainer_create(model, photos, photo_count, &options, &trainer))) {
        trainer->run.iteration = start;
        while (steps-- > 0) step_holds(trainer);
        HOLDS(model->count <= 40 ||
              model->count <= (double)options.surplus * options.max_gaussians + 0.5); /* before it is lean */
    }
    ssdgs_trainer_destroy(trainer);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* ---- checkpoints: one made here, then bytes of it changed (place, value: 3 + 1 bytes each), perhaps cut or
   lengthened ---- */

static void fuzz_checkpoint(const unsigned char *data, size_t size) {
    static uint32_t pixels[SIDE * SIDE * 4];
    static unsigned char *saved, *bytes;
    static size_t saved_size;
    input in = {data, data + size, 1}, defaults = defaults_only();
    ssdgs_context *context = draw_context(&defaults);
    ssdgs_settings settings = draw_settings(&defaults);
    ssdgs_train_options options = draw_options(&defaults);
    ssdgs_trainer *trainer = NULL;
    ssdgs_model *model = NULL;
    const int flags = draw(&in), cut = draw(&in);
    options.iterations = 2;
    options.refine = SSDGS_REFINE_CAMERA | SSDGS_REFINE_LIGHT;
    options.initial_points = 3;
    options.densify_until = 0;
    ssdgs_photo photo;
    draw_photo(&defaults, &photo, pixels);
    HOLDS(!ssdgs_model_create(context, &settings, 0, &model) &&
          !ssdgs_trainer_create(model, &photo, 1, &options, &trainer));
    if (!saved) {
        unsigned char *read = NULL;
        HOLDS(!ssdgs_trainer_step(trainer, NULL));
        const char *path = put_file("fuzz.checkpoint", "", 0);
        HOLDS(!ssdgs_trainer_save(trainer, path) && !ssdgs__read_file(context, path, 0, &read, &saved_size));
        saved = copy_of(read, saved_size);
        ssdgs__release(context, read);
    }
    bytes = (unsigned char *)calloc(saved_size + 128, 1);
    HOLDS(bytes);
    memcpy(bytes, saved, saved_size);
    const size_t length = cut < 128 ? saved_size - (flags & 2 ? (size_t)cut * saved_size / 128 : (size_t)cut)
                                    : saved_size + (size_t)cut - 128;
    while (in.end - in.at >= 4) {
        size_t at = (size_t)draw(&in) << 16;
        at |= (size_t)draw(&in) << 8;
        at |= (size_t)draw(&in);
        bytes[at % (saved_size + 128)] = (unsigned char)draw(&in);
    }
    if (!(flags & 1) && length >= 8) { /* else the checksum stays wrong */
        const uint64_t hash = ssdgs__fold(UINT64_C(0xCBF29CE484222325), bytes, length - 8);
        memcpy(bytes + length - 8, &hash, sizeof hash);
    }
    const int same = length == saved_size && !memcmp(bytes, saved, length);
    const char *path = put_file("fuzz.checkpoint", bytes, length);
    free(bytes);
    const uint64_t before = model_hash(model);
    const int sound = !ssdgs_trainer_load(trainer, path);
    HOLDS(sound ? same || !(flags & 1)
                : !same && model_hash(model) == before); /* refused: as if nothing had been */
    for (int i = 0; sound && i < 2; i++) ssdgs_trainer_step(trainer, NULL); /* whatever it then computes */
    ssdgs_trainer_destroy(trainer);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
}

/* ---- model files: whatever is accepted is finite, and renders ---- */

static void fuzz_ply(const unsigned char *data, size_t size) {
    input defaults = defaults_only();
    unsigned char *copy = copy_of(data, size);
    ssdgs_context *context = draw_context(&defaults);
    ssdgs_load_stats stats;
    ssdgs_model *model;
    if (!ssdgs_model_load_memory(context, copy, size, &model, &stats)) {
        HOLDS(model_finite(model));
        picture p;
        draw_picture(&defaults, &p);
        p.options.light_detail = (ssdgs_real)0.1;
        if (model->global_count < 20000 && !take_picture(model, &p)) check_picture(&p, 1);
        if (model->global_count < 20000) drop_picture(&p);
        ssdgs_model_destroy(model);
    } else HOLDS(!model && ssdgs_error_message(context)[0]);
    ssdgs_context_destroy(context);
    free(copy);
}

/* ---- images: as they are, and with every checksum mended ---- */

static void check_numbers(const olat__image *image) {
    HOLDS(image->width > 0 && image->height > 0 && image->pixels);
    for (size_t i = 0; i < 4 * (size_t)image->width * (size_t)image->height; i++) {
        const ssdgs_real number = olat__number(image->pixels, image->format, i);
        HOLDS(number >= 0 && number <= (i % 4 < 3 && olat__is_light(image->format) ? 65504 : 1));
    }
}

static void read_png(const unsigned char *bytes, size_t size) {
    static olat__found found;
    ssdgs_pixels format;
    int width, height;
    void *pixels;
    char error[512] = "";
    const int failed = olat_decode_png(bytes, size, &width, &height, &format, &pixels, error);
    if (failed) HOLDS(!pixels && error[0]);
    else HOLDS(width > 0 && height > 0 && pixels);
    free(pixels);
    for (int is_mask = 0; is_mask < 2; is_mask++) {
        olat__image image;
        memset(&image, 0, sizeof image);
        memset(&found, 0, sizeof found);
        error[0] = 0;
        const int bad = olat__png_file("", bytes, size, is_mask, &image, &found, error);
        HOLDS(bad == (error[0] != 0) && (bad || !failed) && (failed || !is_mask || !bad));
        if (!bad) check_numbers(&image);
        free(image.pixels);
    }
}

/* As JPEG, of at most 2047 pixels a side: more are slow to clear. */
static void fuzz_jpeg(const unsigned char *data, size_t size) {
    static olat__found found;
    unsigned char *copy = copy_of(data, size);
    for (size_t i = 0; i + 9 < size; i++)
        if (copy[i] == 255 && copy[i + 1] >= 0xC0 && copy[i + 1] <= 0xC2) copy[i + 5] &= 7, copy[i + 7] &= 7;
    for (int is_mask = 0; is_mask < 2; is_mask++) {
        olat__image image;
        char error[512] = "";
        memset(&image, 0, sizeof image);
        memset(&found, 0, sizeof found);
        if (olat__jpeg_file("", copy, size, is_mask, &image, &found, error)) HOLDS(!image.pixels && error[0]);
        else check_numbers(&image);
        free(image.pixels);
    }
    free(copy);
}

/* What is read is light: finite, not negative, with an alpha from 0 to 1. */
static void fuzz_exr(const unsigned char *data, size_t size) {
    unsigned char *copy = copy_of(data, size);
    int width, height;
    ssdgs_pixels format;
    void *pixels = NULL;
    olat__found found;
    char error[512] = "";
    olat__exr e;
    memset(&e, 0, sizeof e);
    memset(&found, 0, sizeof found);
    e.bytes = copy;
    e.size = size;
    olat__exr_parts(&e);
    const int large =
        !e.problem && (e.display[2] - e.display[0] > 2047 || e.display[3] - e.display[1] > 2047);
    if (large) {
    } /* slow to clear */
    else if (olat__exr_decode("exr", copy, size, &width, &height, &format, &pixels, &found, error))
        HOLDS(!pixels && error[0]);
    else
        for (size_t i = 0; i < 4 * (size_t)width * (size_t)height; i++) {
            const ssdgs_real number = olat__number(pixels, format, i);
            HOLDS(number >= 0 && number <= (i % 4 == 3 ? 1 : 65504));
        }
    free(pixels);
    free(copy);
}

/* As an ICC profile, which lies packed in a PNG. */
static void read_profile(const unsigned char *bytes, size_t size) {
    olat__space space;
    memset(&space, 0, sizeof space);
    if (olat__icc_space(bytes, size, &space)) return;
    for (int i = 0; i < 3 * 257; i++) {
        const double light = olat__light(space.code + i / 257, i % 257 / 256.0);
        HOLDS(light >= 0 && light <= 1);
    }
    for (int i = 0; i < 9 && space.differs; i++) HOLDS(fabs(space.matrix[i]) < 16);
}

static void fuzz_png(const unsigned char *data, size_t size) {
    unsigned char *copy = copy_of(data, size);
    size_t at = 8;
    read_profile(copy, size);
    if (size > 24 && olat__be32(data + 16) > 2048)
        copy[16] = copy[17] = 0, copy[18] &= 7; /* a large image is slow to clear */
    if (size > 24 && olat__be32(data + 20) > 2048) copy[20] = copy[21] = 0, copy[22] &= 7;
    read_png(copy, size);
    size_t length;
    for (; size >= 12 && at <= size - 12 && (length = olat__be32(copy + at)) <= size - at - 12;
         at += 12 + length)
        olat__put_be32(copy + at + 8 + length, olat__crc32(copy + at + 4, length + 4));
    read_png(copy, size);
    free(copy);
}

/* The pixels behind the checksum of the compressed data: 13 bytes of header, a byte of palette size, palette,
   rows. */
static void fuzz_unfilter(const unsigned char *data, size_t size) {
    olat__png png;
    unsigned char header[13] = {0}, palette[768] = {0};
    size_t raw = 0;
    memset(&png, 0, sizeof png);
    if (size < 14) return;
    memcpy(header, data, 13);
    header[0] = header[1] = header[4] = header[5] = 0;
    header[2] &= 1;
    header[6] &= 1;
    if (olat__png_header(&png, header, 13)) return;
    const int colors = 1 + data[13];
    const size_t used = size - 14 < 3 * (size_t)colors ? size - 14 : 3 * (size_t)colors;
    memcpy(palette, data + 14, used);
    if (png.color == 3 && olat__png_palette(&png, palette, 3 * (size_t)colors)) return;
    if (!(png.color & 4))
        olat__png_transparency(&png, palette, png.color == 3 ? 1 : 2 * (size_t)png.channels);
    for (int pass = png.first_pass; pass < png.end_pass; pass++) {
        int width, height;
        const size_t row = olat__png_pass(&png, pass, &width, &height);
        raw += (size_t)height * (row + 1);
    }
    png.raw = (unsigned char *)calloc(raw, 1);
    png.out = (unsigned char *)malloc((size_t)png.width * (size_t)png.height * (png.depth == 16 ? 8 : 4));
    HOLDS(png.raw && png.out);
    size -= 14 + used;
    memcpy(png.raw, data + 14 + used, size < raw ? size : raw);
    olat__png_unfilter(&png);
    free(png.raw);
    free(png.out);
}

/* A packed splat file; behind a first byte of 0 what gzip would hold of one, whose checksum no fuzzer finds.
   What is made of it is a plain PLY that loads, and only with room that is lacking it does not. */
static void fuzz_splats(const unsigned char *data, size_t size) {
    unsigned char *copy = copy_of(data, size), *plain = NULL;
    const int bare = size && !data[0];
    char error[512] = "";
    splats__ply p;
    memset(&p, 0, sizeof p);
    const int failed = bare ? splats__spz("x", copy + 1, size - 1, &p, error)
                            : splats_unpack("x", copy, size, &plain, &p.size, error);
    if (bare && !failed) plain = p.bytes;
    HOLDS(failed ? !plain && !strncmp(error, "x: ", 3) : !error[0]);
    if (plain) {
        ssdgs_context *context = NULL;
        ssdgs_model *model = NULL;
        HOLDS(!ssdgs_context_create(NULL, &context));
        HOLDS(!ssdgs_model_load_memory(context, plain, p.size, &model, NULL));
        HOLDS(ssdgs_model_settings(model)->baked);
        ssdgs_model_destroy(model);
        ssdgs_context_destroy(context);
    }
    free(plain);
    free(copy);
}

/* Two bytes of capacity, then the stream; what comes out is packed, and unpacked again. */
static void fuzz_inflate(const unsigned char *data, size_t size) {
    if (size < 2) return;
    unsigned char *copy = copy_of(data + 2, size - 2);
    olat__inflater z;
    memset(&z, 0, sizeof z);
    z.in = copy;
    z.size = size - 2;
    z.capacity = (size_t)data[0] << 8 | data[1];
    z.out = (unsigned char *)malloc(z.capacity + !z.capacity);
    const char *problem = olat__inflate(&z);
    HOLDS(z.length <= z.capacity && z.at <= z.size);
    if (!problem || z.length == z.capacity) { /* whatever the checksum says */
        uint32_t *table = (uint32_t *)calloc(65536, sizeof *table);
        unsigned char *packed = (unsigned char *)malloc(z.length + z.length / 8 + 128);
        unsigned char *back = (unsigned char *)malloc(z.length + 1);
        olat__inflater y;
        memset(&y, 0, sizeof y);
        y.size = olat__deflate(z.out, z.length, packed, table);
        y.in = packed;
        y.out = back;
        y.capacity = z.length;
        HOLDS(!olat__inflate(&y) && !memcmp(back, z.out, z.length));
        free(table);
        free(packed);
        free(back);
    }
    free(z.out);
    free(copy);
}

/* ---- JSON and datasets ---- */

/* Every node but the root is a child of one container that counts it. */
static void fuzz_json(const unsigned char *data, size_t size) {
    char error[512] = "", path[] = "fuzz.json";
    olat__json j;
    int seen = 1;
    memset(&j, 0, sizeof j);
    j.text = (char *)malloc(size + 1);
    HOLDS(j.text);
    if (size) memcpy(j.text, data, size);
    j.text[size] = 0;
    j.path = path;
    j.error = error;
    j.end = j.text + size;
    olat__json_parse(&j);
    HOLDS(j.failed == (error[0] != 0));
    for (int i = 0; !j.failed && i < j.count; i++) {
        const olat__node *node = j.nodes + i;
        int children = 0;
        HOLDS(node->type != OLAT__NUMBER || isfinite(node->number));
        HOLDS(node->type != OLAT__STRING || (node->text >= j.text && node->text + node->text_length < j.end));
        for (int child = node->child; child; child = j.nodes[child].next, children++, seen++)
            HOLDS(j.nodes[child].parent == i);
        HOLDS(children == node->size);
    }
    HOLDS(j.failed || seen == j.count);
    free(j.nodes);
    free(j.text);
}

/* A string's value by RFC 8259 and 3629, of one to its end at `end`; -1 where it is none. */
static long string_value(const unsigned char *p, const unsigned char *end, unsigned char *out) {
    static const char escapes[] = "\"\"\\\\//b\bf\fn\nr\rt\t";
    long length = 0, code;
    for (p++; p < end && *p != '"';) {
        if (*p < 32) return -1;
        if (*p >= 128) { /* the shortest form, no surrogates, nothing beyond U+10FFFF */
            const int more = *p >= 240 ? 3 : *p >= 224 ? 2 : 1;
            code = *p++ - (more == 3 ? 240 : more == 2 ? 224 : 192);
            for (int i = 0; i < more; i++, p++) {
                if (p >= end || *p < 128 || *p > 191) return -1;
                code = 64 * code + (*p - 128);
            }
            if (code < (more == 3 ? 0x10000 : more == 2 ? 0x800 : 0x80)) return -1;
        } else if (*p != '\\') code = *p++;
        else if (end - p < 2) return -1;
        else if (p[1] != 'u') {
            int i;
            for (i = 0; escapes[i] && escapes[i] != p[1]; i += 2) {}
            if (!escapes[i]) return -1;
            code = escapes[i + 1];
            p += 2;
        } else {
            int halves;
            for (code = 0, halves = 0; halves < 2; halves++) {
                if (end - p < 6 || p[0] != '\\' || p[1] != 'u') return -1;
                long unit;
                int i;
                for (unit = 0, i = 2; i < 6; i++) {
                    static const char digits[] = "0123456789abcdef0123456789ABCDEF";
                    const char *digit = p[i] ? strchr(digits, p[i]) : NULL;
                    if (!digit) return -1;
                    unit = 16 * unit + (digit - digits) % 16;
                }
                p += 6;
                if (halves && (unit < 0xDC00 || unit > 0xDFFF)) return -1;
                code = halves ? 0x10000 + 0x400 * (code - 0xD800) + unit - 0xDC00 : unit;
                if (!halves && (unit < 0xD800 || unit > 0xDBFF)) break;
            }
        }
        if (code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return -1;
        if (code < 0x80) out[length++] = (unsigned char)code;
        else {
            int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
            out[length++] = (unsigned char)((more == 1 ? 192 : more == 2 ? 224 : 240) + (code >> 6 * more));
            while (more-- > 0) out[length++] = (unsigned char)(128 + (code >> 6 * more) % 64);
        }
    }
    return p + 1 == end ? length : -1;
}

/* Parses the text, whose value is so many bytes, -1: none; then what the value is written as. */
static void parse_string(const char *text, size_t size, const unsigned char *want, long length) {
    char error[512] = "", path[] = "fuzz.json";
    olat__json j;
    memset(&j, 0, sizeof j);
    j.text = (char *)malloc(size + 1);
    HOLDS(j.text);
    memcpy(j.text, text, size);
    j.text[size] = 0;
    j.path = path;
    j.error = error;
    j.end = j.text + size;
    olat__json_parse(&j);
    HOLDS(j.failed == (length < 0));
    if (length >= 0) {
        const olat__node *value = j.nodes;
        HOLDS(value->type == OLAT__STRING && value->text_length == (size_t)length &&
              !memcmp(value->text, want, (size_t)length));
        long n;
        for (long i = 0; i < length; i += n) HOLDS((n = olat__utf8_length(value->text + i)) > 0);
        if (strlen(value->text) == (size_t)length) {
            olat__writer w;
            w.size = 0;
            w.room = 1;
            w.text = (char *)malloc(1);
            olat__write_string(&w, value->text);
            HOLDS(w.text);
            if (w.size != size || memcmp(w.text, text, size)) parse_string(w.text, w.size, want, length);
            free(w.text);
        }
    }
    free(j.nodes);
    free(j.text);
}

/* The bytes between quotes as they are; then as code points, 3 bytes each, written raw or as escapes. */
static void fuzz_json_string(const unsigned char *data, size_t size) {
    char *text = (char *)malloc(4 * size + 40);
    unsigned char *want = (unsigned char *)malloc(4 * size + 40);
    size_t used = 1;
    HOLDS(text && want);
    text[0] = '"';
    if (size) memcpy(text + 1, data, size);
    text[1 + size] = '"';
    parse_string(text, size + 2, want,
                 string_value((unsigned char *)text, (unsigned char *)text + size + 2, want));
    for (size_t at = 0; at + 3 <= size; at += 3) {
        const unsigned bits = (unsigned)data[at] << 16 | (unsigned)data[at + 1] << 8 | data[at + 2],
                       code = bits & 0x1FFFFF;
        if (!(bits >> 22) && code < 0x80 && code > 31 && code != '"' && code != '\\')
            text[used++] = (char)code;
        else if (!(bits >> 22) && code >= 0x80 && code < 0x800) { /* raw, whatever it is */
            text[used++] = (char)(unsigned char)(192 + code / 64);
            text[used++] = (char)(unsigned char)(128 + code % 64);
        } else if (code < 0x10000)
            used += (size_t)sprintf(text + used, bits >> 23 ? "\\u%04X" : "\\u%04x", code);
        else
            used += (size_t)sprintf(text + used, "\\u%04x\\u%04X", 0xD7C0 + code / 1024 % 0x440,
                                    0xDC00 + code % 1024);
    }
    text[used++] = '"';
    parse_string(text, used, want, string_value((unsigned char *)text, (unsigned char *)text + used, want));
    free(text);
    free(want);
}

/* JSON, then, after a NUL, the image it may call fuzz_image.png. What is accepted can be trained on. */
static void fuzz_dataset(const unsigned char *data, size_t size) {
    const unsigned char *nul = (const unsigned char *)(size ? memchr(data, 0, size) : NULL);
    const size_t text = nul ? (size_t)(nul - data) : size;
    input defaults = defaults_only();
    ssdgs_context *context = draw_context(&defaults);
    char error[512] = "";
    put_file("fuzz_transforms.json", data, text);
    put_file("fuzz_image.png", nul ? nul + 1 : data, nul ? size - text - 1 : 0);
    olat_dataset set;
    ssdgs_photo *photos;
    for (int images = 0; images < 2; images++) {
        if (olat_load(folder, "fuzz_transforms.json", images ? 0 : OLAT_NO_IMAGES, &set, error)) {
            HOLDS(error[0] && !set.count && !set.frames);
            continue;
        }
        HOLDS((photos = olat_photos(&set)) != NULL);
        for (int i = 0; i < set.count; i++) {
            HOLDS(!ssdgs__camera_check(context, &photos[i].camera, 0) &&
                  !ssdgs__lights_check(context, &photos[i].light, 1));
            HOLDS(!images || photos[i].pixels);
        }
        free(photos);
        olat_free(&set);
    }
    ssdgs_context_destroy(context);
}

/* ---- calls in any order and from anywhere: hooks, tasks, the allocator, the log, the progress callback
   ---- */

static struct {
    input *in;
    ssdgs_context *context; /* NULL once destroyed, as the next two */
    ssdgs_model *model;
    ssdgs_trainer *trainer;
    ssdgs_photo photo;
    int depth, runs; /* callbacks under way, all of them or progress callbacks alone */
} play;

static int play_progress(void *user, const ssdgs_train_stats *stats);

/* One call, as a byte says. From within another it must be refused; from the progress callback it may be
   anything. */
static void play_call(void) {
    static ssdgs_real color[64 * 3];
    const int what = draw_below(play.in, 14), within = play.depth > play.runs;
    const ssdgs_real background[3] = {0, 0, 0};
    ssdgs_train_options options = ssdgs_train_options_default();
    ssdgs_result result = SSDGS_ERR_ARGUMENT;
    ssdgs_photo photo = play.photo;
    ssdgs_model *model = NULL;
    ssdgs_trainer *trainer = NULL;
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color;
    options.iterations = 4;
    options.densify_from = options.densify_every = 1;
    options.initial_points = 20;
    ssdgs_metrics metrics;
    switch (what) {
    case 0:
    case 1:
        if (play.model)
            result = ssdgs_render(play.model, &photo.camera, &photo.light, draw_below(play.in, 2), &image);
        break;
    case 2:
        if (play.model) result = ssdgs_model_sort(play.model);
        break;
    case 3:
        if (play.model) result = ssdgs_evaluate(play.model, &photo, background, NULL, &metrics);
        break;
    case 4:
        if (play.model) result = ssdgs_refine_photo(play.model, &photo, background, 1);
        break;
    case 5:
        if (play.context) result = ssdgs_compare(play.context, color, color, 8, 8, &metrics);
        break;
    case 6:
        if (play.context) result = ssdgs_model_create(play.context, NULL, draw_below(play.in, 30), &model);
        break;
    case 7:
        if (play.context) result = ssdgs_model_load_memory(play.context, "ply\nformat", 10, &model, NULL);
        break;
    case 8:
        if (play.model) result = ssdgs_trainer_create(play.model, &photo, 1, &options, &trainer);
        break;
    case 9:
        if (play.trainer) result = ssdgs_trainer_step(play.trainer, NULL);
        break;
    case 10:
        if (play.trainer && play.runs < 3) result = ssdgs_trainer_run(play.trainer, play_progress, NULL);
        break;
    case 11:
        if (play.runs && !within) break; /* the run's own, which is refused and stays */
        ssdgs_trainer_destroy(play.trainer);
        if (!within) play.trainer = NULL;
        break;
    case 12:
        ssdgs_model_destroy(play.model);
        if (!within) play.model = NULL;
        break;
    default:
        ssdgs_context_destroy(play.context);
        if (!within) play.context = NULL;
        break;
    }
    if (within) HOLDS(result == SSDGS_ERR_ARGUMENT && !model && !trainer);
    if (model) {
        if (play.model) ssdgs_model_destroy(model);
        else play.model = model;
    }
    if (trainer) {
        if (play.trainer) ssdgs_trainer_destroy(trainer);
        else play.trainer = trainer;
    }
}

static void play_within(void) {
    if (!play.in || play.depth > play.runs || draw_below(play.in, 3) != 1) return;
    play.depth++;
    play_call();
    play.depth--;
}

static int play_progress(void *user, const ssdgs_train_stats *stats) {
    (void)user, (void)stats;
    play.runs++;
    play.depth++;
    if (draw(play.in) & 1) play_call();
    play.depth--;
    play.runs--;
    return play.trainer && !(draw(play.in) & 2);
}

#define PLAY_STAGE(name) \
    static ssdgs_result play_##name(void *user, ssdgs_frame *frame) { \
        (void)user; \
        play_within(); \
        return ssdgs_stage_cpu(frame, SSDGS_STAGE_##name); \
    }
PLAY_STAGE(PROJECT)
PLAY_STAGE(SORT)
PLAY_STAGE(BIN)
PLAY_STAGE(WALK)
PLAY_STAGE(SHADE)
PLAY_STAGE(COMPOSITE)
PLAY_STAGE(COMPOSITE_BACKWARD)
PLAY_STAGE(SHADE_BACKWARD)
PLAY_STAGE(PROJECT_BACKWARD)

static void play_run(void *user, int count, void (*task)(void *data, int index), void *data) {
    (void)user;
    for (int i = 0; i < count; i++) task(data, i);
    play_within();
}

static void *play_allocate(void *user, size_t bytes) {
    (void)user;
    play_within();
    void *memory = malloc(bytes);
    return memory;
}

static void play_release(void *user, void *memory) {
    (void)user;
    play_within();
    free(memory);
}

static void play_hear(void *user, ssdgs_result code, const char *message) {
    (void)user, (void)code;
    HOLDS(message[0]);
    play_within();
}

static void fuzz_hooks(const unsigned char *data, size_t size) {
    static ssdgs_result (*const stages[SSDGS_STAGE_COUNT])(void *, ssdgs_frame *) = {play_PROJECT,
                                                                                     play_SORT,
                                                                                     play_BIN,
                                                                                     play_WALK,
                                                                                     play_SHADE,
                                                                                     play_COMPOSITE,
                                                                                     play_COMPOSITE_BACKWARD,
                                                                                     play_SHADE_BACKWARD,
                                                                                     play_PROJECT_BACKWARD};
    static unsigned char pixels[64 * 4];
    input in = {data, data + size, 1}, defaults = defaults_only();
    ssdgs_context_desc desc;
    ssdgs_model *model = NULL;
    int hooks = draw(&in), flags = draw(&in);
    memset(&desc, 0, sizeof desc);
    ssdgs_gpu_hook gpu;
    memset(&gpu, 0, sizeof gpu);
    desc.gpu = &gpu;
    desc.threads = 1 + (flags & 1);
    for (int i = 0; i < SSDGS_STAGE_COUNT; i++)
        if ((hooks | (flags & 2) << 7) >> i & 1) gpu.stage[i] = stages[i];
    if (flags & 4) desc.parallel.run = play_run;
    if (flags & 8) desc.allocator.allocate = play_allocate, desc.allocator.release = play_release;
    if (flags & 16) desc.logger.write = play_hear;
    memset(&play, 0, sizeof play);
    play.photo.camera = draw_camera(&defaults, 1);
    play.photo.camera.width = play.photo.camera.height = 8;
    play.photo.light = draw_light(&defaults);
    memset(pixels, 100, sizeof pixels);
    play.photo.pixels = pixels;
    HOLDS(!ssdgs_context_create(&desc, &play.context) && !ssdgs_model_create(play.context, NULL, 30, &model));
    play.model = model;
    play.in = &in;
    for (int i = 0; i < 40 && in.at < in.end && (play.model || play.context || play.trainer); i++)
        play_call();
    play.in = NULL;
    ssdgs_trainer_destroy(play.trainer);
    ssdgs_model_destroy(play.model);
    ssdgs_context_destroy(play.context);
}

/* ---- which target, and both ways to start ---- */

typedef struct target {
    const char *name;
    void (*run)(const unsigned char *data, size_t size);
} target;
/* A model of COLMAP's: whether it is binary, where its second and third file begin, the three. Its lenses are
   used on a picture. */
static void fuzz_colmap(const unsigned char *data, size_t size) {
    static const char *const names[3][2] = {
        {"cameras.txt", "cameras.bin"}, {"images.txt", "images.bin"}, {"points3D.txt", "points3D.bin"}};
    if (size < 5) return;
    const int binary = data[0] & 1;
    size_t ends[4] = {5, 0, 0, size};
    for (size_t i = 0; i < 2; i++) {
        const size_t length = (size_t)(data[1 + 2 * i] | data[2 + 2 * i] << 8);
        ends[i + 1] = length < size - ends[i] ? ends[i] + length : size;
    }
    for (int i = 0; i < 3; i++) {
        remove(put_file(names[i][!binary], "", 0));
        put_file(names[i][binary], data + ends[i], ends[i + 1] - ends[i]);
    }
    colmap_model m;
    char error[512] = "";
    if (colmap_load(folder, &m, error)) {
        HOLDS(error[0] && !m.images && !m.points);
        return;
    }
    HOLDS(m.image_count > 0);
    for (int i = 0; i < m.image_count; i++) {
        const double offset[3] = {1, 2, 3};
        double centre[3];
        HOLDS(m.images[i].camera >= 0 && m.images[i].camera < m.camera_count);
        HOLDS(!olat__path_problem(m.images[i].name, strlen(m.images[i].name), 0));
        colmap_centre(m.images + i, offset, centre);
        for (int c = 0; c < 3; c++) HOLDS(fabs(centre[c]) < 1e13);
    }
    for (int i = 0; i < m.point_count; i++)
        for (int k = 0; k < m.points[i].seen; k++) {
            const int image = m.tracks[m.points[i].track + k];
            HOLDS(image >= 0 && image < m.image_count);
        }
    for (int i = 0; i < m.camera_count && i < 4; i++) {
        olat_lens *lens = m.cameras + i;
        if (!olat_lens_zoom(lens)) continue;
        const double shrink = fmax(lens->width, lens->height) / 16.0; /* to a picture of 16 pixels */
        for (int c = 0; c < 2; c++) lens->focal[c] /= shrink, lens->centre[c] /= shrink;
        lens->width = lens->width > shrink ? (int)(lens->width / shrink) : 1;
        lens->height = lens->height > shrink ? (int)(lens->height / shrink) : 1;
        if (!olat_lens_zoom(lens)) continue;
        uint16_t pixels[4 * 16 * 16];
        for (size_t k = 0; k < sizeof pixels / sizeof *pixels; k++) pixels[k] = (uint16_t)(k * 40503);
        free(olat_resample(pixels, SSDGS_PIXELS_RGBA16, lens, 1));
    }
    colmap_free(&m);
}

static const target targets[] = {{"png", fuzz_png},
                                 {"colmap", fuzz_colmap},
                                 {"jpeg", fuzz_jpeg},
                                 {"exr", fuzz_exr},
                                 {"unfilter", fuzz_unfilter},
                                 {"inflate", fuzz_inflate},
                                 {"json", fuzz_json},
                                 {"json_string", fuzz_json_string},
                                 {"dataset", fuzz_dataset},
                                 {"ply", fuzz_ply},
                                 {"checkpoint", fuzz_checkpoint},
                                 {"render", fuzz_render},
                                 {"scene", fuzz_scene},
                                 {"train", fuzz_train},
                                 {"hooks", fuzz_hooks},
                                 {"splats", fuzz_splats}};

/* The target that is a name in the path, the last of those. */
static const target *find_target(const char *path) {
    const target *found = NULL;
    while (*path) {
        const size_t length = strcspn(path, "/\\");
        for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
            if (strlen(targets[i].name) == length && !memcmp(path, targets[i].name, length))
                found = targets + i;
        path += length + (path[length] != 0);
    }
    return found;
}

static void find_folder(const char *program) {
    size_t length = strlen(program);
    while (length > 0 && program[length - 1] != '/' && program[length - 1] != '\\') length--;
    snprintf(folder, sizeof folder, "%.*s", length > 1 ? (int)length - 1 : 1, length ? program : ".");
}

#ifdef LIBFUZZER
static const target *chosen;

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv) {
    (void)argc;
    find_folder(**argv);
    chosen = find_target(**argv);
    HOLDS(chosen);
    return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    chosen->run(data, size);
    return 0;
}
#else
int main(int argc, char **argv) {
    int passed = 0, failed = argc < 2;
    find_folder(argv[0]);
    char error[512];
    unsigned char *data;
    size_t size;
    for (int i = 1; i < argc; i++) {
        const target *found = find_target(argv[i]);
        if (!found || olat__read_file(argv[i], &data, &size, error)) {
            printf("%s: no target's file, or not to be read\n", argv[i]);
            failed++;
            continue;
        }
        printf("%s\n", argv[i]);
        fflush(stdout); /* a finding ends the program here */
        found->run(data, size);
        free(data);
        passed++;
    }
    printf("%d passed, %d failed\n", passed, failed);
    return failed != 0;
}
#endif
