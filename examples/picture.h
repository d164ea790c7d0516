/* picture.h - draws what a page asks for: "w=320&h=200&eye=0,-3,1&light=1,-2,2,1,1,1&plane=shadow". MIT, see
   ssdgs.h. view.h serves such pictures, web.c draws them in the page itself. Needs ssdgs.h with SSDGS_STAGES,
   olat.h and unbake.h before it. */
#ifndef PICTURE_H
#define PICTURE_H

/* ---- what a picture shows ---- */

enum { VIEW__MODELS = 16, VIEW__LIGHTS = 8, VIEW__SIDE = 2560 };
enum {
    VIEW__COLOR,
    VIEW__DIFFUSE,
    VIEW__SPECULAR,
    VIEW__SCATTERING,
    VIEW__SHADOW,
    VIEW__NORMAL,
    VIEW__DEPTH,
    VIEW__ALPHA,
    VIEW__PLANES
};
static const char *const view__plane_names[VIEW__PLANES] = {"color",  "diffuse", "specular", "scattering",
                                                            "shadow", "normal",  "depth",    "alpha"};
enum { VIEW__EXACT, VIEW__DEFAULT, VIEW__FAST, VIEW__PREVIEW, VIEW__PRESETS };
static const char *const view__preset_names[VIEW__PRESETS] = {"exact", "default", "fast", "preview"};

/* Names and how many numbers each has; in the order of the struct below. */
enum {
    VIEW__WIDTH,
    VIEW__HEIGHT,
    VIEW__EYE,
    VIEW__TARGET,
    VIEW__UP,
    VIEW__ANGLE,
    VIEW__EXPOSURE,
    VIEW__AMBIENT,
    VIEW__TINT,
    VIEW__ROUGHNESS,
    VIEW__GLOSS,
    VIEW__TRANSLUCENCY,
    VIEW__LIT,  /* 1: plain splats take light */
    VIEW__KEPT, /* what models keep of their own; -1: as they say */
    VIEW__LIGHT,
    VIEW__FIELDS
};
static const struct {
    const char *name;
    int count;
    double least, most, usual[3];
} view__field[VIEW__FIELDS] = {
    {"w", 1, 16, VIEW__SIDE, {256, 0, 0}}, {"h", 1, 16, VIEW__SIDE, {256, 0, 0}},
    {"eye", 3, -1e15, 1e15, {0, -3, 1}},   {"target", 3, -1e15, 1e15, {0, 0, 0}},
    {"up", 3, -1, 1, {0, 0, 1}},           {"angle", 1, 0.05, 2.5, {0.7, 0, 0}},
    {"exposure", 1, 1e-3, 1e3, {1, 0, 0}}, {"ambient", 3, 0, 1e3, {0, 0, 0}},
    {"tint", 3, 0, 100, {1, 1, 1}},        {"roughness", 1, 0.1, 10, {1, 0, 0}},
    {"gloss", 1, 0, 100, {1, 0, 0}},       {"translucency", 1, 0.1, 10, {1, 0, 0}},
    {"lit", 1, 0, 1, {0, 0, 0}},           {"kept", 1, -1, 1, {-1, 0, 0}},
    {"light", 6, -1e15, 1e15, {0, 0, 0}}}; /* place and colour, once for each light */

typedef struct view__wish {
    double value[VIEW__FIELDS][3], light[VIEW__LIGHTS][6];
    int lights, plane, preset;
} view__wish;

static int view__index_of(const char *const *names, int count, const char *text, size_t length) {
    for (int i = 0; i < count; i++)
        if (strlen(names[i]) == length && !memcmp(names[i], text, length)) return i;
    return -1;
}

/* Numbers with commas between them; 0: there are others, or something else. */
static int view__numbers(const char *text, size_t length, int count, double least, double most, double *out) {
    const char *const end = text + length;
    for (int i = 0; i < count; i++) {
        const size_t used = text < end ? olat__parse_number(text, out + i) : 0;
        if (!used || text + used > end || !(out[i] >= least && out[i] <= most)) return 0;
        text += used;
        if (i + 1 < count && (text == end || *text++ != ',')) return 0;
    }
    return text == end;
}

/* One key and its value. 0: no such key, or no such value. */
static int view__read_key(view__wish *w, const char *key, size_t key_length, const char *value,
                          size_t length) {
    if (key_length == 5 && !memcmp(key, "plane", 5))
        return (w->plane = view__index_of(view__plane_names, VIEW__PLANES, value, length)) >= 0;
    if (key_length == 6 && !memcmp(key, "preset", 6))
        return (w->preset = view__index_of(view__preset_names, VIEW__PRESETS, value, length)) >= 0;
    for (int i = 0; i < VIEW__FIELDS; i++) {
        if (strlen(view__field[i].name) != key_length || memcmp(view__field[i].name, key, key_length) != 0)
            continue;
        if (i == VIEW__LIGHT && w->lights == VIEW__LIGHTS) return 0;
        return view__numbers(value, length, view__field[i].count, view__field[i].least, view__field[i].most,
                             i == VIEW__LIGHT ? w->light[w->lights++] : w->value[i]);
    }
    return 0;
}

/* The wish of "key=value&key=value". 0, and what is wrong in problem. */
static int view__read_wish(const char *text, view__wish *w, char *problem, size_t room) {
    memset(w, 0, sizeof *w);
    for (int i = 0; i < VIEW__LIGHT; i++) memcpy(w->value[i], view__field[i].usual, sizeof w->value[i]);
    w->preset = VIEW__DEFAULT;
    while (*text) {
        const size_t length = strcspn(text, "&"), key = strcspn(text, "=&");
        const char *value = text + key + (key < length);
        if (!view__read_key(w, text, key, value, length - (size_t)(value - text))) {
            snprintf(problem, room, "no such wish: %.60s\n", text);
            return 0;
        }
        text += length;
        text += *text == '&';
    }
    for (int l = 0; l < w->lights; l++)
        for (int c = 3; c < 6; c++)
            if (w->light[l][c] < 0) {
                snprintf(problem, room, "light %d is darker than black\n", l);
                return 0;
            }
    return 1;
}

/* ---- what there is to show ---- */

enum { VIEW__STAGES = 8 };
typedef struct view_show {
    ssdgs_context *context;
    ssdgs_model *models[VIEW__MODELS];
    const char *names[VIEW__MODELS];
    ssdgs_model *lit[VIEW__MODELS]; /* of plain ones, once it is asked for: those that take light */
    int count;
    float middle[3], radius;
    ssdgs_object objects[VIEW__MODELS];
    float *planes;        /* of the last picture: (h,w,4) */
    unsigned char *bytes; /* RGBA */
    size_t pixels;        /* that there is room for */
    struct {              /* of the last frame */
        const char *name;
        double seconds;
    } stages[VIEW__STAGES];
    const char *stage; /* at work */
    double since;
    struct { /* while the model trains: */
        const ssdgs_photo *photos;
        int on, paused; /* paused: the page asks to wait */
        int count, iteration, iterations;
        double loss, psnr, left; /* left: seconds */
    } training;
} view_show;

/* The context's tracer, with the show as user: how long each stage of the frame takes. */
static void view_stage(void *user, const char *name) {
    view_show *s = (view_show *)user;
    const double now = olat_seconds();
    for (int i = 0; i < VIEW__STAGES && s->stage; i++) {
        if (s->stages[i].name && strcmp(s->stages[i].name, s->stage) != 0) continue;
        s->stages[i].name = s->stage;
        s->stages[i].seconds += now - s->since;
        break;
    }
    s->stage = name;
    s->since = now;
}

/* Models side by side along x. */
OLAT__API ssdgs_result view_arrange(view_show *s) {
    float at = 0, low[3], high[3], tallest[2] = {1e30f, -1e30f};
    for (int i = 0; i < s->count; i++) {
        s->objects[i] = ssdgs_object_default(s->models[i]);
        const ssdgs_result result = olat_bounds(s->objects + i, low, high);
        if (result) return result;
        const float width = high[0] - low[0];
        if (s->count > 1) s->objects[i].to_world[3] += at - low[0];
        else at = low[0];
        at += (s->count > 1 ? 1.15f : 1) * width;
        for (int c = 1; c < 3; c++) s->radius = fmaxf(s->radius, (high[c] - low[c]) / 2);
        if (!i) s->middle[1] = (low[1] + high[1]) / 2;
        s->objects[i].to_world[7] += s->middle[1] - (low[1] + high[1]) / 2;
        tallest[0] = fminf(tallest[0], low[2]);
        tallest[1] = fmaxf(tallest[1], high[2]);
        if (i == s->count - 1) {
            const float all = s->count > 1 ? at - 0.15f * width : width;
            s->middle[0] = s->count > 1 ? all / 2 : (low[0] + high[0]) / 2;
            s->radius = fmaxf(s->radius, all / 2);
        }
    }
    s->middle[2] = (tallest[0] + tallest[1]) / 2;
    s->radius = fmaxf(s->radius, (tallest[1] - tallest[0]) / 2);
    return SSDGS_OK;
}

static void view__floats_of(const double *from, int count, float *to) {
    for (int i = 0; i < count; i++) to[i] = (float)from[i];
}

/* One pixel of what is no light as four bytes. depth: what is neither black nor white there. */
static void view__pixel(int plane, float depth, float radius, const float *value, float alpha,
                        unsigned char *rgba) {
    const float thin = alpha > 1e-6f ? alpha : 1e-6f;
    for (int c = 0; c < 3; c++) {
        float grey = value[0];
        if (plane == VIEW__NORMAL) grey = 0.5f * (value[c] + alpha);
        if (plane == VIEW__DEPTH) grey = alpha * (0.5f - (value[0] / thin - depth) / (2.4f * radius));
        rgba[c] = (unsigned char)(fminf(1, fmaxf(0, grey)) * 255 + 0.5f);
    }
    rgba[3] = 255;
}

/* Room for a picture; 0: there is none. */
static int view__room(view_show *s, size_t pixels) {
    if (pixels <= s->pixels) return 1;
    free(s->planes), free(s->bytes);
    s->planes = (float *)malloc(4 * pixels * sizeof *s->planes);
    s->bytes = (unsigned char *)malloc(4 * pixels);
    s->pixels = s->planes && s->bytes ? pixels : 0;
    return s->pixels > 0;
}

/* What the wish shows of model i, and how much of its own light: a plain splat may take light. */
static ssdgs_result view__choose(view_show *s, int i, const view__wish *w) {
    const ssdgs_settings *settings = ssdgs_model_settings(s->models[i]);
    const int lit = settings->baked && w->value[VIEW__LIT][0] > 0.5;
    unbake_options options = unbake_options_default();
    options.kept = 1;
    if (lit && !s->lit[i]) {
        const ssdgs_result result = unbake_model(s->context, s->models[i], &options, s->lit + i);
        if (result) return result;
    }
    s->objects[i].model = lit ? s->lit[i] : s->models[i];
    s->objects[i].kept = settings->baked && !lit ? 1 : settings->kept;
    if ((lit || !settings->baked) && w->value[VIEW__KEPT][0] >= 0)
        s->objects[i].kept = (float)w->value[VIEW__KEPT][0];
    return SSDGS_OK;
}

static ssdgs_result view__draw(view_show *s, ssdgs_scene **scene, const view__wish *w,
                               ssdgs_render_stats *stats) {
    const int width = (int)w->value[VIEW__WIDTH][0], height = (int)w->value[VIEW__HEIGHT][0];
    const size_t pixels = (size_t)width * (size_t)height;
    const float light_scale = ssdgs_model_settings(s->models[0])->light_scale;
    ssdgs_result result = view__room(s, pixels) ? SSDGS_OK : SSDGS_ERR_MEMORY;
    for (int i = 0; i < s->count && !result; i++) result = view__choose(s, i, w);
    if (result) return result;
    int lit = 0; /* the first model that is not baked says how colours are stored */
    while (lit < s->count && ssdgs_model_settings(s->objects[lit].model)->baked) lit++;
    const int transfer = ssdgs_model_settings(s->objects[lit < s->count ? lit : 0].model)->transfer;
    float eye[3], target[3], up[3], *value = s->planes, *alpha = s->planes + 3 * pixels;
    ssdgs_light lights[VIEW__LIGHTS];
    ssdgs_render_options options = w->preset == VIEW__EXACT     ? ssdgs_render_options_exact()
                                   : w->preset == VIEW__DEFAULT ? ssdgs_render_options_default()
                                   : w->preset == VIEW__FAST    ? ssdgs_render_options_fast()
                                                                : ssdgs_render_options_preview();
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    memset(lights, 0, sizeof lights);
    memset(value, 0, 3 * pixels * sizeof *value);
    float **const plane[VIEW__PLANES] = {&image.color,  &image.diffuse, &image.specular, &image.scattering,
                                         &image.shadow, &image.normal,  &image.depth,    &image.alpha};
    *plane[w->plane] = value;
    image.alpha = w->plane == VIEW__ALPHA ? value : alpha;
    view__floats_of(w->value[VIEW__EYE], 3, eye);
    view__floats_of(w->value[VIEW__TARGET], 3, target);
    view__floats_of(w->value[VIEW__UP], 3, up);
    const ssdgs_camera camera =
        ssdgs_camera_look_at(eye, target, up, (float)w->value[VIEW__ANGLE][0], width, height);
    for (int i = 0; i < w->lights; i++) {
        float distance2 = 0;
        view__floats_of(w->light[i], 3, lights[i].position);
        for (int c = 0; c < 3; c++) distance2 += powf(lights[i].position[c] - s->middle[c], 2);
        for (int c = 0; c < 3; c++)
            lights[i].intensity[c] = (float)w->light[i][3 + c] * distance2 / light_scale;
    }
    for (int c = 0; c < 3; c++) options.ambient[0][c] = (float)w->value[VIEW__AMBIENT][c] / light_scale;
    for (int i = 0; i < s->count; i++) {
        view__floats_of(w->value[VIEW__TINT], 3, s->objects[i].tint);
        s->objects[i].roughness = (float)w->value[VIEW__ROUGHNESS][0];
        s->objects[i].specular = (float)w->value[VIEW__GLOSS][0];
        s->objects[i].translucency = (float)w->value[VIEW__TRANSLUCENCY][0];
    }
    memset(s->stages, 0, sizeof s->stages);
    result = *scene ? SSDGS_OK : ssdgs_scene_create(s->context, scene);
    if (!result)
        result = ssdgs_scene_render(*scene, s->objects, s->count, &camera, lights, w->lights, &options,
                                    &image, stats);
    if (result) return result;
    if (w->plane <= VIEW__SCATTERING) {
        for (size_t i = 0; i < 3 * pixels; i++) value[i] *= (float)w->value[VIEW__EXPOSURE][0];
        memset(&image, 0, sizeof image);
        image.color = value;
        ssdgs_to_pixels(NULL, &image, width, height, transfer, SSDGS_RGBA8, s->bytes, 4 * width);
        return SSDGS_OK;
    }
    float depth = 0;
    for (int c = 0; c < 3; c++) depth += (eye[c] - s->middle[c]) * (eye[c] - s->middle[c]);
    depth = sqrtf(depth);
    for (size_t i = 0; i < pixels; i++)
        view__pixel(w->plane, depth, s->radius, value + (w->plane == VIEW__NORMAL ? 3 * i : i),
                    image.alpha[i], s->bytes + 4 * i);
    return SSDGS_OK;
}

/* What the page must know of the models, as JSON. */
static void view__about(const view_show *s, char *text, size_t room) {
    *text = 0;
    olat__append(text, room, "{\"middle\":[%.9g,%.9g,%.9g],\"radius\":%.9g,\"light_scale\":%.9g,\"models\":[",
                 (double)s->middle[0], (double)s->middle[1], (double)s->middle[2], (double)s->radius,
                 (double)ssdgs_model_settings(s->models[0])->light_scale);
    for (int i = 0; i < s->count; i++) {
        const char *name = s->names[i];
        for (const char *c = name; *c; c++)
            if (*c == '/' || *c == '\\') name = c + 1;
        olat__append(text, room, "%s{\"name\":\"", i ? "," : "");
        for (int c = 0; name[c] && c < 60; c++)
            olat__append(text, room, "%c",
                         name[c] >= ' ' && name[c] < 127 && !strchr("\"\\<>&", name[c]) ? name[c] : '?');
        olat__append(text, room, "\",\"gaussians\":%d,\"plain\":%s,\"kept\":%.3f}",
                     ssdgs_model_count(s->models[i]),
                     ssdgs_model_settings(s->models[i])->baked ? "true" : "false",
                     (double)ssdgs_model_settings(s->models[i])->kept);
    }
    olat__append(text, room,
                 "],\"training\":%s,\"paused\":%s,\"photographs\":%d,\"iteration\":%d,\"iterations\":%d,"
                 "\"loss\":%.6f,\"psnr\":%.3f,\"left\":%.0f}\n",
                 s->training.on ? "true" : "false", s->training.paused ? "true" : "false", s->training.count,
                 s->training.iteration, s->training.iterations, s->training.loss, s->training.psnr,
                 s->training.left);
}

/* Draws the wish into s->bytes, *size of them; what it cost is in note, as JSON, or what went wrong. */
static ssdgs_result view__picture(view_show *s, ssdgs_scene **scene, const view__wish *w, size_t *size,
                                  char *note, size_t room) {
    ssdgs_render_stats stats;
    const double start = olat_seconds();
    const ssdgs_result result = view__draw(s, scene, w, &stats);
    *note = 0;
    if (result) {
        olat__append(note, room, "%s: %s\n", ssdgs_result_string(result), ssdgs_error_message(s->context));
        return result;
    }
    *size = 4 * (size_t)w->value[VIEW__WIDTH][0] * (size_t)w->value[VIEW__HEIGHT][0];
    olat__append(note, room, "{\"ms\":%.2f,\"shaded\":%d,\"gaussians\":%d,\"kept\":%d,\"stages\":{",
                 1e3 * (olat_seconds() - start), stats.shaded, stats.gaussians, stats.lights_cached);
    for (int i = 0; i < VIEW__STAGES && s->stages[i].name; i++)
        olat__append(note, room, "%s\"%s\":%.2f", i ? "," : "", s->stages[i].name,
                     1e3 * s->stages[i].seconds);
    olat__append(note, room, "}}");
    return SSDGS_OK;
}

/* A training photograph over black and, to its right, the model from there under its light; as above. */
OLAT__API ssdgs_result view__photograph(view_show *s, int number, size_t *size, char *note, size_t room) {
    const ssdgs_photo *photo = s->training.photos + number;
    const int width = photo->camera.width, height = photo->camera.height;
    const size_t pixels = (size_t)width * (size_t)height;
    const float black[3] = {0, 0, 0};
    ssdgs_render_options options = ssdgs_render_options_exact();
    memcpy(options.ambient[0], ssdgs_model_settings(s->models[0])->ambient, sizeof options.ambient[0]);
    ssdgs_light lights[OLAT_MOST_LIGHTS];
    ssdgs_image image;
    ssdgs_result result = view__room(s, 2 * pixels) ? SSDGS_OK : SSDGS_ERR_MEMORY;
    memset(&image, 0, sizeof image);
    image.color = s->planes;
    image.alpha = s->planes + 3 * pixels;
    if (!result)
        result = ssdgs_render_ex(s->models[0], &photo->camera, lights, olat_lights(photo, lights), &options,
                                 &image, NULL);
    *note = 0;
    if (result) {
        olat__append(note, room, "%s: %s\n", ssdgs_result_string(result), ssdgs_error_message(s->context));
        return result;
    }
    const int transfer = ssdgs_model_settings(s->models[0])->transfer;
    ssdgs_compose(image.color, image.alpha, pixels, transfer, black, image.color);
    olat_compose(photo, transfer, black, s->planes + 3 * pixels); /* over alpha */
    for (int side = 0; side < 2; side++)
        for (size_t i = 0; i < pixels; i++) {
            const float *rgb = s->planes + (side ? 0 : 3 * pixels) + 3 * i;
            unsigned char *rgba = s->bytes + 4 * (2 * i - i % (size_t)width + (side ? (size_t)width : 0));
            for (int c = 0; c < 3; c++) rgba[c] = (unsigned char)(fminf(1, fmaxf(0, rgb[c])) * 255 + 0.5f);
            rgba[3] = 255;
        }
    *size = 8 * pixels;
    olat__append(note, room, "{\"w\":%d,\"h\":%d}", 2 * width, height);
    return SSDGS_OK;
}

/* Frees the pictures and what was made of models; these and the context are the caller's. */
OLAT__API void view__forget(view_show *s) {
    for (int i = 0; i < VIEW__MODELS; i++) {
        ssdgs_model_destroy(s->lit[i]);
        s->lit[i] = NULL;
    }
    free(s->planes), free(s->bytes);
    s->planes = NULL;
    s->bytes = NULL;
    s->pixels = 0;
}

#endif
