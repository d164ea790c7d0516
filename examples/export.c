/* cc -O2 examples/export.c -o export -lm -lpthread: a relightable model under one light as splats for
   viewers: PREFIX.glb (KHR_gaussian_splatting), PREFIX.ply and PREFIX.splat. Reads them again, prints how
   near they come to the model, and shows it in PREFIX.png. Highlights move with the eye: they are left out.
   The model's middle is the files' 0, and up is where viewers look for it: -y in .ply and .splat, y in .glb.
 */
#define SSDGS_IMPLEMENTATION
#ifndef SSDGS_STAGES
#define SSDGS_STAGES
#endif
#include "../ssdgs.h"
#include "olat.h"

static char program[] = "export";

enum { SIDE = 256, VIEWS = 4, EYES = 14, GLB = 0, PLY, SPLAT, FILES };
static const char *const suffix[FILES] = {".glb", ".ply", ".splat"};
static const float harmonic = 0.28209479177387814f; /* of degree 0 */

/* What viewers know of a Gaussian. */
typedef struct splat {
    float position[3], scale[3], rotation[4], color[3], opacity; /* w x y z; sRGB */
} splat;

typedef struct exporter {
    ssdgs_context *context;
    ssdgs_model *model;
    ssdgs_light light;
    ssdgs_object object; /* where the model stands: an editor may have moved it .. */
    float turn[4];       /* .. and turned it, a quaternion */
    float middle[3], radius;
    int keep; /* 1: the dataset's places and axes */
    int count;
    splat *splats;
    float *normals; /* (count, 3) */
    double *sums;   /* (count, 4) colours, weighted by how much a Gaussian faces the eye, and these weights */
    int listening;
    unsigned char *bytes; /* of the file at hand */
    size_t size;
} exporter;

/* ---- the colours: a frame's stages, listened to ---- */

static ssdgs_result see_all(void *user, ssdgs_frame *frame) {
    const ssdgs_result result = ssdgs_stage_cpu(frame, SSDGS_STAGE_WALK);
    if (!result && ((exporter *)user)->listening) memset(frame->seen, SSDGS_SEEN, (size_t)frame->count);
    return result;
}

/* A Gaussian's own S, eq. 8, of the shadow network's answer and its visibility. */
static float shadow_of(const ssdgs_settings *s, const float *answer) {
    const float v = fminf(0.99f, fmaxf(0.01f, answer[1]));
    if (!(s->terms & SSDGS_SHADOW_TERM)) return 1;
    if (!s->shadow.layers) return answer[1];
    return 1 / (1 + expf(-answer[0]) * (s->residual_shadow ? (1 - v) / v : 1));
}

/* Adds what each Gaussian sends to this eye. Where light is deferred, color is what scatters, and layers 5
   and 6 are the light's diffuse part and what S is made of. */
static ssdgs_result take_colors(void *user, ssdgs_frame *frame) {
    exporter *e = (exporter *)user;
    const size_t plane = 4 * (size_t)frame->count;
    for (int i = 0; e->listening && i < frame->count; i++) {
        const float *color = frame->color + 4 * (size_t)i,
                    *layer = frame->layer_count ? frame->layers + 4 * (size_t)i : NULL;
        const float shadow = layer ? shadow_of(&frame->settings, layer + 6 * plane) : 0;
        double weight = 0, length2 = 0;
        for (int c = 0; c < 3; c++) {
            const double to_eye = (double)(frame->eye[c] - e->splats[i].position[c]);
            weight += to_eye * (double)e->normals[3 * i + c];
            length2 += to_eye * to_eye;
        }
        weight = fmax(weight / sqrt(length2), 0.05);
        for (int c = 0; c < 3; c++) {
            const float diffuse = frame->layer_count ? shadow * layer[5 * plane + (size_t)c] : 0;
            e->sums[4 * i + c] += weight * (double)(color[c] + diffuse);
        }
        e->sums[4 * i + 3] += weight;
    }
    return ssdgs_stage_cpu(frame, SSDGS_STAGE_COMPOSITE);
}

/* A camera at one of `many` places around the model. */
static ssdgs_camera camera_at(const exporter *e, int i, int many, int side) {
    const float z = many == VIEWS ? 0.35f : 1 - 2 * ((float)i + 0.5f) / (float)many;
    const float turn = many == VIEWS ? 1.5707963f * (float)i + 0.4f : 2.3999632f * (float)i;
    const float direction[3] = {sqrtf(1 - z * z) * cosf(turn), sqrtf(1 - z * z) * sinf(turn), z};
    const float up[3] = {0, 0, 1};
    float eye[3];
    for (int c = 0; c < 3; c++) eye[c] = e->middle[c] + 3.2f * e->radius * direction[c];
    return ssdgs_camera_look_at(eye, e->middle, up, 0.7f, side, side);
}

/* Turns a quaternion by another. */
static void turn_by(const float p[4], float q[4]) {
    const float was[4] = {q[0], q[1], q[2], q[3]};
    q[0] = p[0] * was[0] - p[1] * was[1] - p[2] * was[2] - p[3] * was[3];
    for (int c = 1; c < 4; c++) {
        const int a = c % 3 + 1, b = (c + 1) % 3 + 1;
        q[c] = p[0] * was[c] + p[c] * was[0] + p[a] * was[b] - p[b] * was[a];
    }
}

/* Puts a splat and its normal where the model stands. */
static void put_in_place(const exporter *e, splat *s, float normal[3]) {
    const float x[3] = {s->position[0], s->position[1], s->position[2]},
                n[3] = {normal[0], normal[1], normal[2]};
    const float size = fabsf(ssdgs_model_settings(e->model)->placement.scale);
    turn_by(e->turn, s->rotation);
    for (int c = 0; c < 3; c++) {
        const float *m = e->object.to_world + 4 * c;
        s->position[c] = m[0] * x[0] + m[1] * x[1] + m[2] * x[2] + m[3];
        normal[c] = (m[0] * n[0] + m[1] * n[1] + m[2] * n[2]) / size;
        s->scale[c] *= size;
    }
}

/* The colours of all Gaussians: the mean of several eyes. */
static ssdgs_result bake(exporter *e) {
    static float color[3 * 16 * 16];
    const ssdgs_settings *s = ssdgs_model_settings(e->model);
    const int linear = s->transfer == SSDGS_TRANSFER_SRGB; /* what is blended is light */
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_image image;
    ssdgs_result result = SSDGS_OK;
    memset(&image, 0, sizeof image);
    image.color = color;
    options.terms &= ~SSDGS_SPECULAR_TERM;
    for (int i = 0; i < e->count && !result; i++) {
        ssdgs_gaussian g;
        result = ssdgs_model_get(e->model, i, &g);
        memcpy(e->splats[i].position, g.position, sizeof g.position);
        memcpy(e->splats[i].scale, g.scale, sizeof g.scale);
        memcpy(e->splats[i].rotation, g.rotation, sizeof g.rotation);
        memcpy(e->normals + 3 * i, g.normal, sizeof g.normal);
        e->splats[i].opacity = g.opacity;
        put_in_place(e, e->splats + i, e->normals + 3 * i);
    }
    e->listening = 1;
    for (int i = 0; i < EYES && !result; i++) {
        const ssdgs_camera camera = camera_at(e, i, EYES, 16);
        result = ssdgs_render_ex(e->model, &camera, &e->light, 1, &options, &image, NULL);
    }
    e->listening = 0;
    for (int i = 0; i < 3 * e->count && !result; i++) {
        const double *sum = e->sums + 4 * (i / 3);
        const float mean = sum[3] > 0 ? (float)(sum[i % 3] / sum[3]) : 0;
        e->splats[i / 3].color[i % 3] = linear ? ssdgs_srgb_encode(fmaxf(mean, 0)) : fmaxf(mean, 0);
    }
    return result;
}

/* ---- the files ---- */

/* Whether a file has y down and z into the picture, where the dataset has z up. A GLB says so in its node. */
static int is_turned(const exporter *e, int file) { return file != GLB && !e->keep; }

/* A splat as a file has it: seen from the model's middle. */
static splat placed(const exporter *e, const splat *s, int file) {
    static const float quarter[4] = {0.70710678f, 0.70710678f, 0, 0}; /* a turn about x */
    splat p = *s;
    for (int c = 0; c < 3 && !e->keep; c++) p.position[c] -= e->middle[c];
    if (is_turned(e, file)) {
        const float y = p.position[1];
        p.position[1] = -p.position[2];
        p.position[2] = y;
        turn_by(quarter, p.rotation);
    }
    return p;
}

/* A camera of the model's for what a file has. */
static ssdgs_camera placed_camera(const exporter *e, const ssdgs_camera *camera, int file) {
    ssdgs_camera c = *camera;
    for (float *row = c.view; row < c.view + 12; row += 4) {
        for (int k = 0; k < 3 && !e->keep; k++) row[3] += row[k] * e->middle[k];
        if (is_turned(e, file)) {
            const float y = row[1];
            row[1] = -row[2];
            row[2] = y;
        }
    }
    return c;
}

static void put(exporter *e, const void *data, size_t size) {
    memcpy(e->bytes + e->size, data, size);
    e->size += size;
}

static void put_word(exporter *e, uint32_t word) { /* lowest byte first */
    const unsigned char b[4] = {(unsigned char)word, (unsigned char)(word >> 8), (unsigned char)(word >> 16),
                                (unsigned char)(word >> 24)};
    put(e, b, 4);
}

static void put_floats(exporter *e, const float *values, int count) {
    for (int i = 0; i < count; i++) {
        uint32_t word;
        memcpy(&word, values + i, 4);
        put_word(e, word);
    }
}

static void floats_at(const unsigned char *p, float *values, int count) {
    for (int i = 0; i < count; i++) {
        const uint32_t word = olat__le32(p + 4 * i);
        memcpy(values + i, &word, 4);
    }
}

static unsigned char byte_of(float value) { return (unsigned char)(fminf(1, fmaxf(0, value)) * 255 + 0.5f); }

static void write_ply(exporter *e) {
    static const char *const names[17] = {"x",       "y",      "z",      "nx",      "ny",      "nz",
                                          "f_dc_0",  "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
                                          "scale_2", "rot_0",  "rot_1",  "rot_2",   "rot_3"};
    char header[1024];
    int length = snprintf(header, sizeof header, "ply\nformat binary_little_endian 1.0\nelement vertex %d\n",
                          e->count);
    for (int i = 0; i < 17; i++)
        length += snprintf(header + length, sizeof header - (size_t)length, "property float %s\n", names[i]);
    length += snprintf(header + length, sizeof header - (size_t)length, "end_header\n");
    put(e, header, (size_t)length);
    for (int i = 0; i < e->count; i++) {
        const splat s = placed(e, e->splats + i, PLY);
        const float o = fminf(0.9999999f, fmaxf(1e-7f, s.opacity)), logit = logf(o / (1 - o)),
                    none[3] = {0, 0, 0};
        float dc[3], log_scale[3];
        for (int c = 0; c < 3; c++) {
            dc[c] = (s.color[c] - 0.5f) / harmonic;
            log_scale[c] = logf(s.scale[c]);
        }
        put_floats(e, s.position, 3);
        put_floats(e, none, 3);
        put_floats(e, dc, 3);
        put_floats(e, &logit, 1);
        put_floats(e, log_scale, 3);
        put_floats(e, s.rotation, 4);
    }
}

/* A quaternion as bytes, which some readers take for (b - 128) / 128, others for (b - 127.5) / 127.5: in
   between. The largest number is negative, as 0 is -1 to all of them and no byte is 1. */
static void rotation_bytes(const float rotation[4], unsigned char bytes[4]) {
    float largest = 0, length2 = 0;
    for (int c = 0; c < 4; c++) {
        if (fabsf(rotation[c]) > fabsf(largest)) largest = rotation[c];
        length2 += rotation[c] * rotation[c];
    }
    const float unit = (largest > 0 ? -127.75f : 127.75f) / sqrtf(length2);
    for (int c = 0; c < 4; c++) bytes[c] = (unsigned char)fminf(255, floorf(128.25f + unit * rotation[c]));
}

/* antimatter15's: 32 bytes a splat. */
static void write_splat(exporter *e) {
    for (int i = 0; i < e->count; i++) {
        const splat s = placed(e, e->splats + i, SPLAT);
        unsigned char tail[8];
        put_floats(e, s.position, 3);
        put_floats(e, s.scale, 3);
        for (int c = 0; c < 3; c++) tail[c] = byte_of(s.color[c]);
        tail[3] = byte_of(s.opacity);
        rotation_bytes(s.rotation, tail + 4);
        put(e, tail, 8);
    }
}

enum { ATTRIBUTES = 6 };
static const struct {
    const char *name, *type;
    int values;
} attribute[ATTRIBUTES] = {{"POSITION", "VEC3", 3},
                           {"KHR_gaussian_splatting:ROTATION", "VEC4", 4},
                           {"KHR_gaussian_splatting:SCALE", "VEC3", 3},
                           {"KHR_gaussian_splatting:OPACITY", "SCALAR", 1},
                           {"KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", "VEC3", 3},
                           {"COLOR_0", "VEC4", 4}}; /* for viewers that know points alone: linear */

/* The GLB's JSON, with spaces up to a multiple of 4; its length. */
static int glb_json(const exporter *e, char *json, size_t room) {
    float low[3], high[3];
    size_t at = 0, length = 0;
    for (int c = 0; c < 3; c++) low[c] = HUGE_VALF, high[c] = -HUGE_VALF;
    for (int i = 0; i < e->count; i++) {
        const splat s = placed(e, e->splats + i, GLB);
        for (int c = 0; c < 3; c++) {
            low[c] = fminf(low[c], s.position[c]);
            high[c] = fmaxf(high[c], s.position[c]);
        }
    }
#define SAY(...) length += (size_t)snprintf(json + length, room - length, __VA_ARGS__)
    SAY("{\"asset\":{\"version\":\"2.0\",\"generator\":\"ssdgs.h\"},\"extensionsUsed\":[\"KHR_gaussian_"
        "splatting\"],"
        "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
        "\"nodes\":[{\"mesh\":0,\"rotation\":[-0.70710678,0,0,0.70710678]}]," /* z up becomes y up */
        "\"meshes\":[{\"primitives\":[{\"mode\":0,\"extensions\":{\"KHR_gaussian_splatting\":{\"kernel\":"
        "\"ellipse\","
        "\"colorSpace\":\"srgb_rec709_display\"}},\"attributes\":{");
    for (int i = 0; i < ATTRIBUTES; i++) SAY("%s\"%s\":%d", i ? "," : "", attribute[i].name, i);
    SAY("}}]}],\"accessors\":[");
    for (int i = 0; i < ATTRIBUTES; i++) {
        SAY("%s{\"bufferView\":%d,\"componentType\":5126,\"count\":%d,\"type\":\"%s\"", i ? "," : "", i,
            e->count, attribute[i].type);
        if (!i)
            SAY(",\"min\":[%.9g,%.9g,%.9g],\"max\":[%.9g,%.9g,%.9g]", (double)low[0], (double)low[1],
                (double)low[2], (double)high[0], (double)high[1], (double)high[2]);
        SAY("}");
    }
    SAY("],\"bufferViews\":[");
    for (int i = 0; i < ATTRIBUTES; i++) {
        const size_t size = 4 * (size_t)attribute[i].values * (size_t)e->count;
        SAY("%s{\"buffer\":0,\"byteOffset\":%lu,\"byteLength\":%lu,\"target\":34962}", i ? "," : "",
            (unsigned long)at, (unsigned long)size);
        at += size;
    }
    SAY("],\"buffers\":[{\"byteLength\":%lu}]}", (unsigned long)at);
    while (length % 4) SAY(" ");
#undef SAY
    return (int)length;
}

static void write_glb(exporter *e) {
    char json[4096];
    const int length = glb_json(e, json, sizeof json);
    const uint32_t binary = 72 * (uint32_t)e->count;
    put_word(e, 0x46546C67); /* glTF */
    put_word(e, 2);
    put_word(e, 28 + (uint32_t)length + binary);
    put_word(e, (uint32_t)length);
    put_word(e, 0x4E4F534A); /* JSON */
    put(e, json, (size_t)length);
    put_word(e, binary);
    put_word(e, 0x004E4942); /* BIN */
    for (int i = 0; i < ATTRIBUTES; i++)
        for (int k = 0; k < e->count; k++) {
            const splat s = placed(e, e->splats + k, GLB);
            float values[4], length2 = 0;
            for (int c = 0; c < 4; c++) length2 += s.rotation[c] * s.rotation[c];
            for (int c = 0; c < attribute[i].values; c++)
                values[c] = i == 0   ? s.position[c]
                            : i == 1 ? s.rotation[(c + 1) % 4] / sqrtf(length2)
                            : i == 2 ? s.scale[c]
                            : i == 3 ? s.opacity
                            : i == 4 ? (s.color[c] - 0.5f) / harmonic
                            : c == 3 ? s.opacity
                                     : fminf(1, ssdgs_srgb_decode(s.color[c]));
            put_floats(e, values, attribute[i].values);
        }
}

/* ---- reading them again ---- */

static int read_splat(const unsigned char *bytes, size_t size, int count, splat *out) {
    if (size != 32 * (size_t)count) return 1;
    for (int i = 0; i < count; i++, bytes += 32) {
        floats_at(bytes, out[i].position, 3);
        floats_at(bytes + 12, out[i].scale, 3);
        for (int c = 0; c < 3; c++) out[i].color[c] = (float)bytes[24 + c] / 255;
        out[i].opacity = (float)bytes[27] / 255;
        for (int c = 0; c < 4; c++) out[i].rotation[c] = ((float)bytes[28 + c] - 127.75f) / 127.75f;
    }
    return 0;
}

/* One of this program, of this model: its JSON must be the one that this writes. */
static int read_glb(const exporter *e, const unsigned char *bytes, size_t size, splat *out) {
    char json[4096];
    const size_t length = (size_t)glb_json(e, json, sizeof json);
    if (size != 28 + length + 72 * (size_t)e->count || olat__le32(bytes) != 0x46546C67 ||
        olat__le32(bytes + 4) != 2 || olat__le32(bytes + 8) != size || olat__le32(bytes + 12) != length ||
        olat__le32(bytes + 16) != 0x4E4F534A || memcmp(bytes + 20, json, length) != 0 ||
        olat__le32(bytes + 20 + length) != size - length - 28 ||
        olat__le32(bytes + 24 + length) != 0x004E4942)
        return 1;
    bytes += 28 + length;
    for (int i = 0; i < ATTRIBUTES; i++)
        for (splat *s = out; s < out + e->count; s++, bytes += 4 * attribute[i].values) {
            float values[4];
            floats_at(bytes, values, attribute[i].values);
            for (int c = 0; c < attribute[i].values; c++)
                if (i == 0) s->position[c] = values[c];
                else if (i == 1) s->rotation[(c + 1) % 4] = values[c];
                else if (i == 2) s->scale[c] = values[c];
                else if (i == 3) s->opacity = values[c];
                else if (i == 4) s->color[c] = values[c] * harmonic + 0.5f;
        }
    return 0;
}

/* Such splats as a model. */
static ssdgs_result model_of(exporter *e, const splat *splats, ssdgs_model **out) {
    ssdgs_settings settings = ssdgs_settings_published();
    settings.baked = 1;
    ssdgs_result result = ssdgs_model_create(e->context, &settings, e->count, out);
    for (int i = 0; i < e->count && !result; i++) {
        ssdgs_gaussian g = ssdgs_gaussian_default();
        memcpy(g.position, splats[i].position, sizeof g.position);
        memcpy(g.scale, splats[i].scale, sizeof g.scale);
        memcpy(g.rotation, splats[i].rotation, sizeof g.rotation);
        for (int c = 0; c < 3; c++) g.diffuse[c] = fmaxf(0, splats[i].color[c]);
        g.opacity = fminf(1, fmaxf(0, splats[i].opacity));
        result = ssdgs_model_set(*out, i, &g);
    }
    return result;
}

static ssdgs_result read_again(exporter *e, int file, const char *path, ssdgs_model **out, char *error) {
    unsigned char *bytes = NULL;
    size_t size = 0;
    splat *splats = (splat *)calloc((size_t)e->count, sizeof *splats);
    int failed = !splats || olat__read_file(path, &bytes, &size, error);
    if (!splats) olat__fail(error, "out of memory");
    if (!failed && file != PLY) {
        failed = file == GLB ? read_glb(e, bytes, size, splats) : read_splat(bytes, size, e->count, splats);
        if (failed) olat__fail(error, "%s: is not as it was written", path);
    }
    ssdgs_result result = SSDGS_OK;
    if (!failed)
        result = file == PLY ? ssdgs_model_load_memory(e->context, bytes, size, out, NULL)
                             : model_of(e, splats, out);
    free(bytes), free(splats);
    return failed ? SSDGS_ERR_FORMAT : result;
}

/* ---- pictures ---- */

/* Bytes of a view, sRGB, into place `row` of the sheet's column `view`. Behind the first two rows are files.
 */
static ssdgs_result show(exporter *e, ssdgs_model *model, int view, int row, int terms,
                         unsigned char *sheet) {
    static float color[3 * SIDE * SIDE];
    static unsigned char bytes[3 * SIDE * SIDE];
    ssdgs_camera camera = camera_at(e, view, VIEWS, SIDE);
    if (row > 1) camera = placed_camera(e, &camera, row - 2);
    ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color;
    options.terms = terms;
    const ssdgs_result result = ssdgs_render_ex(model, &camera, &e->light, 1, &options, &image, NULL);
    ssdgs_to_bytes(color, 3 * SIDE * SIDE, ssdgs_model_settings(model)->transfer, bytes);
    for (int y = 0; y < SIDE && !result; y++)
        memcpy(sheet + 3 * SIDE * ((row * SIDE + y) * VIEWS + view), bytes + 3 * SIDE * y, 3 * SIDE);
    return result;
}

/* PSNR of two rows of the sheet. */
static double psnr(const unsigned char *sheet, int a, int b) {
    const size_t row = (size_t)3 * SIDE * SIDE * VIEWS;
    double error2 = 0;
    for (size_t i = 0; i < row; i++) {
        const double d = (double)sheet[(size_t)a * row + i] - (double)sheet[(size_t)b * row + i];
        error2 += d * d / (double)row;
    }
    return error2 > 0 ? 10 * log10(255 * 255 / error2) : 100;
}

/* ---- the program ---- */

/* The model's place, and a light, given in the dataset's coordinates or above its left side, as bright there
   as the photographs' on average. */
static ssdgs_result look(exporter *e, const double *from, char *error) {
    const ssdgs_settings *settings = ssdgs_model_settings(e->model);
    float low[3], high[3], distance2 = 0;
    const float direction[3] = {-0.5f, -0.7f, 0.5f};
    const float *turn = settings->placement.turn,
                angle = sqrtf(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
    e->object = ssdgs_object_default(e->model);
    e->turn[0] = cosf(angle / 2);
    for (int c = 0; c < 3; c++) e->turn[1 + c] = angle > 0 ? sinf(angle / 2) * turn[c] / angle : 0;
    const ssdgs_result result = olat_bounds(&e->object, low, high);
    for (int c = 0; c < 3 && !result; c++) {
        e->middle[c] = (low[c] + high[c]) / 2;
        e->radius = fmaxf(e->radius, (high[c] - low[c]) / 2);
    }
    e->light.kind = SSDGS_LIGHT_POINT;
    for (int c = 0; c < 3; c++) {
        e->light.position[c] = from ? (float)(from[c] - (double)settings->origin[c])
                                    : e->middle[c] + 4 * e->radius * direction[c];
        distance2 += (e->light.position[c] - e->middle[c]) * (e->light.position[c] - e->middle[c]);
    }
    for (int c = 0; c < 3; c++) e->light.intensity[c] = distance2 / settings->light_scale;
    if (!result && !(distance2 > 0)) olat__fail(error, "--light: it is in the middle of the object");
    if (!result) {
        double place[3]; /* of the files' 0, in the dataset */
        for (int c = 0; c < 3; c++)
            place[c] = (double)settings->origin[c] + (e->keep ? 0 : (double)e->middle[c]);
        printf("x y z in %s are %.9g + x, %.9g + y, %.9g + z in the dataset\n",
               e->keep ? "all files" : "the GLB, without its node's turn,", place[0], place[1], place[2]);
        if (!e->keep)
            printf("x y z in .ply and .splat are %.9g + x, %.9g + z, %.9g - y\n", place[0], place[1],
                   place[2]);
    }
    return result;
}

static ssdgs_result work(exporter *e, const char *prefix, char *error) {
    const int rows = 2 + FILES, all = SSDGS_ALL_TERMS;
    unsigned char *sheet = (unsigned char *)calloc((size_t)rows * VIEWS * SIDE * SIDE, 3);
    ssdgs_result result = sheet ? bake(e) : SSDGS_ERR_MEMORY;
    for (int view = 0; view < VIEWS && !result; view++)
        for (int row = 0; row < 2 && !result; row++)
            result = show(e, e->model, view, row, row ? all & ~SSDGS_SPECULAR_TERM : all, sheet);
    for (int file = 0; file < FILES && !result && !*error; file++) {
        char path[OLAT__MAX_PATH];
        ssdgs_model *again = NULL;
        snprintf(path, sizeof path, "%s%s", prefix, suffix[file]);
        e->size = 0;
        if (file == GLB) write_glb(e);
        else if (file == PLY) write_ply(e);
        else write_splat(e);
        if (olat__write_file(path, e->bytes, e->size, error)) break;
        result = read_again(e, file, path, &again, error);
        for (int view = 0; view < VIEWS && !result; view++)
            result = show(e, again, view, 2 + file, all, sheet);
        ssdgs_model_destroy(again);
        if (!result)
            printf("%s: %lu bytes, %.2f dB from the model, %.2f dB without its highlights\n", path,
                   (unsigned long)e->size, psnr(sheet, 2 + file, 0), psnr(sheet, 2 + file, 1));
    }
    if (!result && !*error) {
        char path[OLAT__MAX_PATH];
        snprintf(path, sizeof path, "%s.png", prefix);
        if (olat_write_png(path, VIEWS * SIDE, rows * SIDE, 3, sheet, error)) result = SSDGS_ERR_IO;
    }
    free(sheet);
    return result;
}

/* The library's notes on the model, not on what is read again. */
static void hear(void *user, ssdgs_result code, const char *message) {
    if (!((const exporter *)user)->splats) olat_hear(program, code, message);
}

static int usage(void) {
    fprintf(
        stderr,
        "usage: export MODEL.ply PREFIX [--keep] [--light X Y Z]\n"
        "writes PREFIX.glb, PREFIX.ply, PREFIX.splat and, to compare, PREFIX.png\n"
        "The model's middle becomes 0: viewers that keep halves are coarse elsewhere. .ply and .splat get\n"
        "y down and z into the picture, as COLMAP has them and viewers take them: SuperSplat and Babylon\n"
        "turn them up by themselves, in Spark and GaussianSplats3D half a turn about x does. The GLB's\n"
        "node makes y up, as glTF has it. How to undo it is printed.\n"
        "  --keep         keeps the dataset's places, and its axes in .ply and .splat\n"
        "  --light X Y Z  where the light is, as in the dataset; else above the left side\n");
    return 2;
}

int main(int argc, char **argv) {
    exporter e;
    ssdgs_gpu_hook hook;
    ssdgs_context_desc desc;
    olat_guard guard;
    const char *names[2] = {NULL, NULL};
    double from[3];
    char error[512] = "";
    int given = 0, lit = 0;
    memset(&e, 0, sizeof e);
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--keep")) e.keep = 1;
        else if (!strcmp(argv[i], "--light") && i + 3 < argc) {
            for (lit = 0; lit < 3; lit++) {
                if (!olat_argument(argv[++i], from + lit)) return usage();
            }
        } else if (argv[i][0] != '-' && given < 2) names[given++] = argv[i];
        else return usage();
    }
    const size_t length = given < 2 ? 0 : strlen(names[1]);
    if (!length || length > OLAT__MAX_PATH - 16 || strchr(OLAT__SEPARATORS, names[1][length - 1]))
        return usage();
    memset(&guard, 0, sizeof guard);
    int failed = olat_guard_input(&guard, names[0], error);
    for (int i = 0; i <= FILES && !failed; i++) {
        char path[OLAT__MAX_PATH];
        snprintf(path, sizeof path, "%s%s", names[1], i < FILES ? suffix[i] : ".png");
        failed = olat_guard_output(&guard, path, error);
    }
    olat_guard_free(&guard);
    memset(&hook, 0, sizeof hook);
    memset(&desc, 0, sizeof desc);
    hook.user = &e;
    hook.stage[SSDGS_STAGE_WALK] = see_all;
    hook.stage[SSDGS_STAGE_COMPOSITE] = take_colors;
    desc.gpu = &hook;
    desc.logger.write = hear;
    desc.logger.user = &e;
    ssdgs_result result = failed ? SSDGS_OK : ssdgs_context_create(&desc, &e.context);
    if (!failed && !result) result = ssdgs_model_load(e.context, names[0], &e.model, NULL);
    if (e.model) e.count = ssdgs_model_peek(e.model).count;
    if (!failed && !result && (e.count < 1 || ssdgs_model_settings(e.model)->baked))
        failed = olat__fail(error, "%s: %s", names[0],
                            e.count < 1 ? "has no Gaussians"
                                        : "is a plain splat: build/unbake makes a model of it");
    if (!failed && !result) {
        e.splats = (splat *)calloc((size_t)e.count, sizeof *e.splats);
        e.normals = (float *)calloc((size_t)e.count, 3 * sizeof *e.normals);
        e.sums = (double *)calloc((size_t)e.count, 4 * sizeof *e.sums);
        e.bytes = (unsigned char *)malloc(8192 + 72 * (size_t)e.count);
        if (!e.splats || !e.normals || !e.sums || !e.bytes) failed = olat__fail(error, "out of memory");
    }
    if (!failed && !result) result = look(&e, lit ? from : NULL, error);
    if (!failed && !result && !*error) result = work(&e, names[1], error);
    if (*error) fprintf(stderr, "export: %s\n", error);
    else if (result)
        fprintf(stderr, "export: %s: %s\n", ssdgs_result_string(result), ssdgs_error_message(e.context));
    ssdgs_model_destroy(e.model);
    ssdgs_context_destroy(e.context);
    free(e.splats), free(e.normals), free(e.sums), free(e.bytes);
    return failed || result || *error;
}
