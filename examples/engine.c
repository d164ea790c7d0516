/* (cd examples/gpu; awk -f shaders.awk *.comp) >gpu_shaders.h
   cc -O2 -I. examples/engine.c -o engine -lm -lpthread (before glibc 2.34: -ldl): how a game engine draws
   with ssdgs.h. Meshes, a floor and a box, and three objects of two models, trained ones or plain splats,
   stand in a level, under a spot that moves, a sun and a fill light. Everything hides and shadows everything.
   usage: engine [--frames N] [--size W H] [--out PREFIX] [--gpu] [MODEL.ply [MODEL.ply]]; writes
   PREFIX000.png and so on, and PREFIXsheet.png with nine of them; PREFIX is build/engine_. --gpu: splats are
   drawn on the GPU, and read back: tests/engine_gl.c has an engine's own window, where nothing is. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "gpu/gpu_gl.c"
#include "olat.h"
#include "reduce.h"
#include "unbake.h"

enum { OBJECTS = 3, LIGHTS = 3, CASTING = 2, TILES = 24, SHEET = 3, BALL = 2000, SHADOW = 512 };

/* ---- the engine: its framebuffer, its triangles, its matrices (OpenGL's) ---- */

/* Where triangles are drawn. Matrices have their columns one after the other. */
typedef struct raster {
    int width, height;
    float matrix[16];               /* projection x view */
    float *buffer;                  /* OpenGL's depth, 0 .. 1 */
    float *normal, *albedo, *world; /* of each pixel; NULL: depth alone */
} raster;

typedef struct level {
    int width, height;
    float view[16], projection[16];
    raster screen, shadow[CASTING]; /* shadow: of the lights that meshes keep from splats and each other */
    ssdgs_shadow_map maps[CASTING]; /* the same for the library */
    unsigned char *pixels;          /* (h,w,4) sRGB */
    float *lit, *passed;
    ssdgs_camera camera;
    ssdgs_light lights[LIGHTS];
    ssdgs_object objects[OBJECTS];
    float light_scale; /* of the first model: what its photographs' intensities are multiplied by */
    float box_low[3], box_high[3];
    /* the library's */
    ssdgs_context *context;
    ssdgs_model *models[2], *coarse[2]; /* coarse: of a third of the Gaussians, for small pictures of them */
    ssdgs_real low[2][3], high[2][3];   /* their bounds */
    ssdgs_scene *scene;
    ssdgs_render_stats stats; /* of the last frame */
    float *color, *alpha, *depth;
} level;

static void perspective(float fov_y, float aspect, float near_plane, float out[16]) { /* infinitely far */
    const float f = 1 / tanf(fov_y / 2);
    memset(out, 0, 16 * sizeof *out);
    out[0] = f / aspect, out[5] = f, out[10] = out[11] = -1, out[14] = -2 * near_plane;
}

static void parallel(float half, float depth, float out[16]) { /* a box, half as wide, ahead of the eye */
    memset(out, 0, 16 * sizeof *out);
    out[0] = out[5] = 1 / half, out[10] = -2 / depth, out[14] = -1, out[15] = 1;
}

static void multiply(const float a[16], const float b[16], float out[16]) {
    for (int i = 0; i < 16; i++) {
        out[i] = 0;
        for (int j = 0; j < 4; j++) out[i] += a[4 * j + i % 4] * b[i / 4 * 4 + j];
    }
}

static void normalize(float v[3]) {
    const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) v[i] /= length;
}

static void look_at(const float eye[3], const float target[3], float out[16]) { /* z is up, -z ahead */
    float f[3], r[3], u[3];
    for (int i = 0; i < 3; i++) f[i] = target[i] - eye[i];
    normalize(f);
    r[0] = f[1], r[1] = -f[0], r[2] = 0;
    normalize(r);
    for (int i = 0; i < 3; i++) u[i] = r[(i + 1) % 3] * f[(i + 2) % 3] - r[(i + 2) % 3] * f[(i + 1) % 3];
    for (int i = 0; i < 3; i++) {
        out[4 * i] = r[i], out[4 * i + 1] = u[i], out[4 * i + 2] = -f[i], out[4 * i + 3] = 0;
    }
    for (int i = 0; i < 3; i++) {
        const float *axis = i == 0 ? r : i == 1 ? u : f;
        out[12 + i] = (i == 2 ? 1.0f : -1.0f) * (axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
    }
    out[15] = 1;
}

/* Clip space of a place. */
static void transform(const float matrix[16], const float at[3], float clip[4]) {
    for (int i = 0; i < 4; i++)
        clip[i] = matrix[i] * at[0] + matrix[4 + i] * at[1] + matrix[8 + i] * at[2] + matrix[12 + i];
}

/* A triangle into the depth buffer, and its pixels' place, normal, colour. */
static void triangle(raster *r, float corner[3][3], const float normal[3], const float albedo[3]) {
    float x[3], y[3], z[3], w[3];
    for (int i = 0; i < 3; i++) {
        float clip[4];
        transform(r->matrix, corner[i], clip);
        w[i] = clip[3];
        if (w[i] < 0.05f) return;
        x[i] = (clip[0] / w[i] + 1) * 0.5f * (float)r->width;
        y[i] = (1 - clip[1] / w[i]) * 0.5f * (float)r->height;
        z[i] = 0.5f + 0.5f * clip[2] / w[i];
    }
    const float area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (fabsf(area) < 1e-9f) return;
    float low_x = fminf(x[0], fminf(x[1], x[2])), high_x = fmaxf(x[0], fmaxf(x[1], x[2]));
    float low_y = fminf(y[0], fminf(y[1], y[2])), high_y = fmaxf(y[0], fmaxf(y[1], y[2]));
    low_x = fmaxf(low_x, 0), low_y = fmaxf(low_y, 0);
    high_x = fminf(high_x, (float)r->width - 1), high_y = fminf(high_y, (float)r->height - 1);
    for (int py = (int)low_y; (float)py <= high_y; py++)
        for (int px = (int)low_x; (float)px <= high_x; px++) {
            const float at_x = (float)px + 0.5f, at_y = (float)py + 0.5f;
            float b[3];
            for (int i = 0; i < 3; i++) {
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                b[i] = ((x[j] - at_x) * (y[k] - at_y) - (x[k] - at_x) * (y[j] - at_y)) / area;
            }
            if (b[0] < 0 || b[1] < 0 || b[2] < 0) continue;
            const int pixel = py * r->width + px;
            const float value = b[0] * z[0] + b[1] * z[1] + b[2] * z[2];
            if (value < 0 || value >= r->buffer[pixel]) continue;
            r->buffer[pixel] = value;
            if (!r->world) continue;
            const float depth = 1 / (b[0] / w[0] + b[1] / w[1] + b[2] / w[2]);
            for (int c = 0; c < 3; c++) {
                r->world[3 * pixel + c] = depth * (b[0] * corner[0][c] / w[0] + b[1] * corner[1][c] / w[1] +
                                                   b[2] * corner[2][c] / w[2]);
                r->normal[3 * pixel + c] = normal[c];
                r->albedo[3 * pixel + c] = albedo[c];
            }
        }
}

static void quad(raster *r, float corner[4][3], const float normal[3], const float albedo[3]) {
    float second[3][3];
    memcpy(second[0], corner[0], sizeof second[0]);
    memcpy(second[1], corner[2], sizeof second[1]);
    memcpy(second[2], corner[3], sizeof second[2]);
    triangle(r, corner, normal, albedo);
    triangle(r, second, normal, albedo);
}

static void draw_meshes(const level *l, raster *r) {
    const float up[3] = {0, 0, 1}, dark[3] = {0.22f, 0.22f, 0.24f}, light[3] = {0.5f, 0.48f, 0.45f},
                red[3] = {0.6f, 0.14f, 0.08f};
    for (int i = 0; i < r->width * r->height; i++) {
        r->buffer[i] = 1;
        if (r->albedo) memset(r->albedo + 3 * i, 0, 3 * sizeof *r->albedo);
    }
    for (int i = 0; i < TILES * TILES; i++) { /* the floor, a chessboard */
        const float s = 0.5f, x = s * (float)(i % TILES - TILES / 2), y = s * (float)(i / TILES - TILES / 2);
        float tile[4][3] = {{x, y, 0}, {x + s, y, 0}, {x + s, y + s, 0}, {x, y + s, 0}};
        quad(r, tile, up, (i % TILES + i / TILES) % 2 ? light : dark);
    }
    for (int face = 0; face < 6; face++) { /* the box */
        const int axis = face / 2, a = (axis + 1) % 3, b = (axis + 2) % 3;
        float corner[4][3], normal[3] = {0, 0, 0};
        normal[axis] = face % 2 ? 1.0f : -1.0f;
        for (int i = 0; i < 4; i++) {
            corner[i][axis] = face % 2 ? l->box_high[axis] : l->box_low[axis];
            corner[i][a] = i == 1 || i == 2 ? l->box_high[a] : l->box_low[a];
            corner[i][b] = i > 1 ? l->box_high[b] : l->box_low[b];
        }
        quad(r, corner, normal, red);
    }
}

/* The shadow map of a light, for meshes, and for the library to know what meshes take from splats. */
static void draw_shadow_map(level *l, int light, const float eye[3], const float target[3],
                            const float projection[16]) {
    raster *r = l->shadow + light;
    ssdgs_shadow_map *map = l->maps + light;
    float view[16];
    look_at(eye, target, view);
    multiply(projection, view, r->matrix);
    draw_meshes(l, r);
    map->light = light;
    map->width = r->width, map->height = r->height;
    map->flags = SSDGS_COLUMN_MAJOR;
    map->depth = r->buffer;
    map->pitch = (ptrdiff_t)sizeof *r->buffer * r->width;
    if (memcmp(map->matrix, r->matrix, sizeof map->matrix) != 0) map->revision++; /* the box does not move */
    memcpy(map->matrix, r->matrix, sizeof map->matrix);
    map->bias = 0.02f;
    map->range = 0; /* depths are the projection's */
}

/* Whether meshes hide a light from a place on one of them. */
static int in_shadow(const level *l, int light, const float point[3], const float normal[3]) {
    const raster *r = l->shadow + light;
    float clip[4], at[3];
    if (light >= CASTING) return 0;
    for (int c = 0; c < 3; c++) at[c] = point[c] + 0.02f * normal[c];
    transform(r->matrix, at, clip);
    const float x = (1 + clip[0] / clip[3]) / 2 * (float)r->width,
                y = (1 - clip[1] / clip[3]) / 2 * (float)r->height;
    if (!(clip[3] > 0 && x >= 0 && y >= 0 && x < (float)r->width && y < (float)r->height)) return 0;
    return r->buffer[(int)y * r->width + (int)x] < 0.5f + 0.5f * clip[2] / clip[3];
}

/* What of a light comes to a place on a mesh, before shadows: irradiance. */
static float irradiance(const level *l, int light, const float point[3], const float normal[3]) {
    const ssdgs_light *from = l->lights + light;
    float to[3], strength = l->light_scale, cosine = 0, along = 0;
    for (int c = 0; c < 3; c++)
        to[c] = from->kind == SSDGS_LIGHT_DIRECTIONAL ? -from->direction[c] : from->position[c] - point[c];
    if (from->kind == SSDGS_LIGHT_SPOT) strength /= to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
    normalize(to);
    for (int c = 0; c < 3; c++) cosine += to[c] * normal[c], along -= to[c] * from->direction[c];
    if (from->kind == SSDGS_LIGHT_SPOT) {
        const float inner = cosf(from->cone[0]), outer = cosf(from->cone[1]);
        const float t = fminf(1, fmaxf(0, (along - outer) / (inner - outer)));
        strength *= t * t;
    }
    return strength * fmaxf(0, cosine);
}

/* Ambient irradiance, times 1 and z: blue from above, darker from below. */
static const float sky[3][3] = {{0.10f, 0.12f, 0.15f}, {0, 0, 0}, {0.05f, 0.06f, 0.09f}};

/* Lights the meshes' pixels. Splats take light from them: the scene is asked for all pixels at once. */
static ssdgs_result shade_meshes(level *l) {
    const raster *r = &l->screen;
    const int pixels = l->width * l->height;
    for (int i = 0; i < 3 * pixels; i++)
        l->lit[i] = r->albedo[i] * (sky[0][i % 3] + sky[2][i % 3] * r->normal[3 * (i / 3) + 2]) / 3.14159265f;
    for (int light = 0; light < LIGHTS; light++) {
        const ssdgs_result result = ssdgs_scene_shadow(l->scene, light, r->world, pixels, l->passed);
        if (result) return result;
        for (int i = 0; i < pixels; i++) {
            const float *at = r->world + 3 * i;
            if (!(r->buffer[i] < 1) || in_shadow(l, light, at, r->normal + 3 * i)) continue;
            const float e = irradiance(l, light, at, r->normal + 3 * i) * l->passed[i] / 3.14159265f;
            for (int c = 0; c < 3; c++)
                l->lit[3 * i + c] += r->albedo[3 * i + c] * e * l->lights[light].intensity[c];
        }
    }
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = l->lit;
    ssdgs_to_pixels(l->context, &image, l->width, l->height, SSDGS_TRANSFER_SRGB, SSDGS_RGBA8, l->pixels,
                    4 * (ptrdiff_t)l->width);
    return SSDGS_OK;
}

/* ---- the level ---- */

/* A ball of flat discs, for those who bring no model: of wax, or of gold, a mirror of microfacets. */
static ssdgs_result make_ball(ssdgs_context *context, int metal, ssdgs_model **out) {
    const float scattering[3] = {40, 32, 24}, absorption[3] = {0.05f, 0.2f, 0.8f},
                gold[3] = {1, 0.78f, 0.34f};
    const float roughness[2] = {0.3f, 0.3f};
    ssdgs_settings settings = ssdgs_settings_default();
    settings.terms = SSDGS_SHADOW_TERM | (metal ? SSDGS_SPECULAR_TERM : SSDGS_SCATTERING_TERM);
    settings.shadow.layers = settings.scattering.layers = 0; /* nothing here is trained */
    settings.light_map.bias = 0.16f;
    memcpy(settings.medium.scattering, scattering, sizeof scattering);
    memcpy(settings.medium.absorption, absorption, sizeof absorption);
    ssdgs_result result = ssdgs_model_create(context, &settings, BALL, out);
    for (int i = 0; i < BALL && !result; i++) {
        const float z = 1 - (2 * (float)i + 1) / (float)BALL, r = sqrtf(1 - z * z), turn = 2.4f * (float)i;
        const float normal[3] = {r * cosf(turn), r * sinf(turn), z};
        ssdgs_gaussian g = ssdgs_gaussian_default();
        for (int c = 0; c < 3; c++) {
            g.position[c] = 0.5f * (g.normal[c] = normal[c]);
            g.scale[c] = c < 2 ? 0.03f : 0.002f;
            g.scattering[c] = 1; /* as the medium has it */
        }
        memset(g.rotation, 0, sizeof g.rotation); /* none: the third axis is the normal */
        g.opacity = 0.99f;
        g.softness = 1; /* the discs are too coarse for sharp shadows */
        if (metal) result = ssdgs_gaussian_mirror(*out, roughness, &g);
        for (int c = 0; c < 3 && metal; c++) g.specular[c] *= gold[c];
        if (metal) g.f0 = 0.9f;
        if (!result) result = ssdgs_model_set(*out, i, &g);
    }
    return result ? result : ssdgs_model_sort(*out);
}

/* An object of this height that stands on the floor at x, y, turned about the vertical. */
static ssdgs_object place(const level *l, int model, float height, float x, float y, float turn) {
    const ssdgs_real *low = l->low[model], *high = l->high[model];
    const float s = height / (high[2] - low[2]), c = s * cosf(turn), d = s * sinf(turn);
    const float rows[12] = {c, -d, 0, x, d, c, 0, y, 0, 0, s, -s * low[2]};
    const float middle[2] = {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
    ssdgs_object object = ssdgs_object_default(l->models[model]);
    object.levels = &l->coarse[model];
    object.level_count = 5 * ssdgs_model_count(l->coarse[model]) <= 4 * ssdgs_model_count(object.model);
    memcpy(object.to_world, rows, sizeof rows);
    for (int i = 0; i < 2; i++)
        object.to_world[4 * i + 3] -= rows[4 * i] * middle[0] + rows[4 * i + 1] * middle[1];
    for (int i = 0; i < 3; i++) /* all are lit alike */
        object.tint[i] = l->light_scale / ssdgs_model_settings(object.model)->light_scale;
    return object;
}

static void move(level *l, float t) { /* t: 0 .. 1 */
    const float turn = 6.2831853f * t, sun[3] = {-0.48f, 0.36f, -0.8f}, aim[3] = {0, 0.2f, 0.4f};
    const float beside[3] = {0.6f, 0.7f, -0.4f};
    const float eye[3] = {3.2f * sinf(0.5f * sinf(turn)), -3.2f * cosf(0.5f * sinf(turn)), 1.7f};
    look_at(eye, aim, l->view);
    perspective(0.75f, (float)l->width / (float)l->height, 0.05f, l->projection);
    multiply(l->projection, l->view, l->screen.matrix);
    const float lamp[3] = {2.2f * cosf(turn), -1.2f + 0.8f * sinf(turn), 2.6f};
    const float beam[3] = {aim[0] - lamp[0], aim[1] - lamp[1], aim[2] - lamp[2]}, unit = 1 / l->light_scale;
    const float warm[3] = {30 * unit, 30 * unit, 24 * unit},
                cool[3] = {0.5f * unit, 0.6f * unit, 0.7f * unit},
                faint[3] = {0.2f * unit, 0.2f * unit, 0.2f * unit};
    float lens[16], above[3];
    perspective(1.1f, 1, 0.1f, lens); /* wider than the spot */
    draw_shadow_map(l, 0, lamp, aim, lens);
    parallel(3.5f, 12, lens);
    for (int c = 0; c < 3; c++) above[c] = aim[c] - 6 * sun[c];
    draw_shadow_map(l, 1, above, aim, lens);
    l->lights[0] = ssdgs_light_spot(lamp, beam, warm, 0.3f, 0.5f);
    l->lights[1] = ssdgs_light_directional(sun, cool);
    l->lights[1].kept = 0.6f; /* so much of what plain splats keep is missing in the sun's shadow */
    l->lights[2] = ssdgs_light_directional(beside, faint);
    l->lights[2].unshadowed = 1; /* fills shadows in, and costs no map */
    l->objects[0] = place(l, 0, 1.0f, -0.75f, 0.1f, turn);
    l->objects[1] = place(l, 1, 0.8f, 0.85f, 0.3f, 0.6f);
    l->objects[2] = place(l, 0, 0.5f, 0.15f, -0.8f, 2 - turn);
    l->objects[2].tint[0] /= 2; /* the same model, bluer */
}

/* What an engine does for a frame. */
static ssdgs_result draw_frame(level *l, float t) {
    ssdgs_image image;
    ssdgs_render_options options = ssdgs_render_options_default();
    move(l, t);
    options.level_detail = 1.5f; /* levels that were not taught show sooner */
    options.antialias = 1;       /* models are seen from farther away than their photographs */
    for (int i = 0; i < 9; i++) options.ambient[i / 3][i % 3] = sky[i / 3][i % 3] / l->light_scale;
    memset(&image, 0, sizeof image);
    image.color = l->color;
    image.alpha = l->alpha;
    image.scene_depth = l->depth;
    ssdgs_result result = ssdgs_camera_from_matrices(l->context, l->view, l->projection, SSDGS_COLUMN_MAJOR,
                                                     l->width, l->height, &l->camera);
    if (!result)
        result = ssdgs_scene_light(l->scene, l->objects, OBJECTS, &l->camera, l->lights, LIGHTS, &options);
    if (!result) draw_meshes(l, &l->screen);
    if (!result) result = shade_meshes(l);
    if (!result)
        result = ssdgs_depth_from_buffer(l->context, l->projection, SSDGS_COLUMN_MAJOR, l->screen.buffer,
                                         (ptrdiff_t)sizeof(float) * l->width, l->width, l->height, l->depth);
    if (!result)
        result = ssdgs_scene_render(l->scene, l->objects, OBJECTS, &l->camera, l->lights, LIGHTS, &options,
                                    &image, &l->stats);
    if (!result)
        ssdgs_blend_pixels(l->context, &image, l->width, l->height, SSDGS_TRANSFER_SRGB, SSDGS_RGBA8,
                           l->pixels, 4 * (ptrdiff_t)l->width);
    return result;
}

/* The engine's log, of any thread. */
static void hear(void *user, ssdgs_result code, const char *message) {
    (void)user;
    fprintf(stderr, "engine: %s%s\n", code ? "" : "note: ", message);
}

static ssdgs_result open_context(int threads, const ssdgs_gpu_hook *hook, ssdgs_context **out) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.gpu = hook;
    desc.logger.write = hear;
    desc.threads = threads;
    return ssdgs_context_create(&desc, out);
}

typedef struct load {
    const char *path; /* NULL: a ball */
    ssdgs_context *context;
    ssdgs_model *model, *coarse;
    ssdgs_result result;
} load;

static ssdgs_result read_model(const load *job, int index, ssdgs_model **out) {
    ssdgs_result result = job->path ? ssdgs_model_load(job->context, job->path, out, NULL)
                                    : make_ball(job->context, index, out);
    if (!result && ssdgs_model_settings(*out)->baked) { /* a plain splat: now it takes light */
        ssdgs_model *plain = *out;
        unbake_options options = unbake_options_default();
        options.kept = 0.2f; /* and keeps some of its own */
        result = unbake_model(job->context, plain, &options, out);
        ssdgs_model_destroy(plain);
    }
    return result;
}

/* A job of a loader thread. It has a context of its own, as one serves one thread at a time. An engine would
   have its levels of detail in files: build/relight --reduce teaches them, too. */
static void load_model(void *loads, int index) {
    load *job = (load *)loads + index;
    job->result = open_context(1, NULL, &job->context);
    if (!job->result) job->result = read_model(job, index, &job->model);
    if (!job->result) job->result = read_model(job, index, &job->coarse);
    if (!job->result)
        job->result = reduce_model(job->context, &job->coarse, ssdgs_model_count(job->model) / 3 + 1);
}

static ssdgs_result open_level(level *l, const char *const models[2], const ssdgs_gpu_hook *hook) {
    ssdgs_occluder meshes;
    const float low[3] = {-0.1f, 0.6f, 0}, high[3] = {0.5f, 1.2f, 1.3f};
    load loads[2];
    memcpy(l->box_low, low, sizeof low);
    memcpy(l->box_high, high, sizeof high);
    memset(loads, 0, sizeof loads);
    for (int i = 0; i < 2; i++) loads[i].path = models[i];
    ssdgs_result result = open_context(0, hook, &l->context);
    if (!result)
        result = ssdgs_context_run(l->context, 2, load_model, loads); /* or threads of the engine's */
    for (int i = 0; i < 2; i++) {
        ssdgs_result loaded = loads[i].result;
        l->models[i] = loads[i].model;
        l->coarse[i] = loads[i].coarse;
        if (!loaded) loaded = ssdgs_model_move(l->models[i], l->context);
        if (!loaded) loaded = ssdgs_model_move(l->coarse[i], l->context);
        if (!loaded) loaded = ssdgs_model_bounds(l->models[i], l->low[i], l->high[i]);
        if (!loaded) printf("model %d: %d Gaussians\n", i, ssdgs_model_count(l->models[i]));
        if (!result) result = loaded;
        ssdgs_context_destroy(loads[i].context);
    }
    if (!result) result = ssdgs_scene_create(l->context, &l->scene);
    if (result) return result;
    memset(&meshes, 0, sizeof meshes); /* no function of ours: the maps say it */
    meshes.maps = l->maps;
    meshes.map_count = CASTING;
    ssdgs_scene_occlude(l->scene, &meshes);
    l->light_scale = ssdgs_model_settings(l->models[0])->light_scale;
    return SSDGS_OK;
}

static int write_png(const char *prefix, const char *name, int width, int height,
                     const unsigned char *pixels) {
    char path[1200], error[512];
    snprintf(path, sizeof path, "%s%s", prefix, name);
    if (!olat_write_png(path, width, height, 4, pixels, error)) return 0;
    fprintf(stderr, "%s\n", error);
    return 1;
}

/* A whole number, 0 where the text is none. */
static int number(const char *text) {
    char *end;
    const long value = strtol(text, &end, 10);
    return *end || value < 0 || value > 9999 ? 0 : (int)value;
}

int main(int argc, char **argv) {
    const char *out = "build/engine_", *models[2] = {NULL, NULL};
    int frames = 120, given = 0, failed = 0, wants_gpu = 0;
    level l;
    memset(&l, 0, sizeof l);
    l.width = 480, l.height = 270;
    for (int i = 1; i < argc && !failed; i++) {
        if (!strcmp(argv[i], "--frames") && i + 1 < argc) frames = number(argv[++i]);
        else if (!strcmp(argv[i], "--out") && i + 1 < argc) out = argv[++i];
        else if (!strcmp(argv[i], "--gpu")) wants_gpu = 1;
        else if (!strcmp(argv[i], "--size") && i + 2 < argc)
            l.width = number(argv[++i]), l.height = number(argv[++i]);
        else if (argv[i][0] != '-' && given < 2) models[given++] = argv[i];
        else failed = 1;
    }
    if (failed || frames < 1 || frames > 999 || l.width < 16 || l.height < 16 || l.width > 4096 ||
        l.height > 4096) {
        fprintf(stderr,
                "usage: engine [--frames N, 1 .. 999] [--size W H, 16 .. 4096] [--out PREFIX] [--gpu] "
                "[MODEL.ply [MODEL.ply]]\n");
        return 2;
    }
    const size_t pixels = (size_t)l.width * (size_t)l.height;
    float *planes = (float *)calloc(pixels * 19 + CASTING * SHADOW * SHADOW, sizeof *planes);
    unsigned char *sheet = (unsigned char *)calloc(pixels * SHEET * SHEET, 4);
    l.pixels = (unsigned char *)malloc(pixels * 4);
    l.depth = planes, l.alpha = planes + pixels, l.passed = planes + 2 * pixels;
    l.lit = planes + 3 * pixels, l.color = planes + 6 * pixels;
    l.screen.width = l.width, l.screen.height = l.height, l.screen.buffer = planes + 9 * pixels;
    l.screen.normal = planes + 10 * pixels, l.screen.albedo = planes + 13 * pixels,
    l.screen.world = planes + 16 * pixels;
    for (int i = 0; i < CASTING; i++) {
        l.shadow[i].width = l.shadow[i].height = SHADOW;
        l.shadow[i].buffer = planes + 19 * pixels + (size_t)i * SHADOW * SHADOW;
    }
    failed = !planes || !sheet || !l.pixels;
    if (failed) fprintf(stderr, "out of memory\n");
    char message[256] = "";
    gpu *const device = wants_gpu ? gpu_create(NULL, message, sizeof message) : NULL;
    const ssdgs_gpu_hook hook = gpu_hook(device);
    if (device) printf("on %s\n", gpu_name(device));
    else if (wants_gpu) fprintf(stderr, "engine: %s: the CPU renders\n", message);
    ssdgs_result result = failed ? SSDGS_OK : open_level(&l, models, device ? &hook : NULL);
    for (int frame = 0; frame < frames && !result && !failed; frame++) {
        char name[32];
        result = draw_frame(&l, (float)frame / (float)frames);
        if (result) break;
        snprintf(name, sizeof name, "%03d.png", frame);
        failed = write_png(out, name, l.width, l.height, l.pixels);
        for (int i = 0; i < SHEET * SHEET; i++) { /* every ninth part of the way */
            if (frame != i * frames / (SHEET * SHEET)) continue;
            for (int y = 0; y < l.height; y++)
                memcpy(sheet + 4 * ((size_t)(i / SHEET * l.height + y) * (size_t)(SHEET * l.width) +
                                    (size_t)(i % SHEET * l.width)),
                       l.pixels + 4 * (size_t)y * (size_t)l.width, 4 * (size_t)l.width);
        }
    }
    if (result) fprintf(stderr, "engine: %s\n", ssdgs_result_string(result)); /* the log has said more */
    else if (!failed)
        printf("last frame: %d Gaussians shaded, %d skipped; %d light maps; camera at rest: %d;\n"
               "  %.0f shadows kept, %.0f %% of the networks' work\n",
               l.stats.shaded, l.stats.skipped, l.stats.light_views, l.stats.camera_cached,
               (double)l.stats.shadows_cached, 100 * l.stats.network_work);
    ssdgs_context_trim(l.context); /* as when a menu hides the level: its next frame takes the memory anew */
    if (!result && !failed) failed = write_png(out, "sheet.png", SHEET * l.width, SHEET * l.height, sheet);
    ssdgs_scene_destroy(l.scene);
    for (int i = 0; i < 2; i++) ssdgs_model_destroy(l.models[i]), ssdgs_model_destroy(l.coarse[i]);
    ssdgs_context_destroy(l.context);
    gpu_destroy(device);
    free(planes), free(sheet), free(l.pixels);
    return result || failed;
}
