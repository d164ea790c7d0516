/* view.h - shows models in a browser on this machine. MIT, see ssdgs.h.

   view_server s; ... models, names, count, context, view_arrange() or middle and radius ...
   if (view_open(&s, "view.html", error)) ...
   while (...) view_poll(&s, 1000);
   view_close(&s);

   It serves view.html on 127.0.0.1, and one picture a request, which says all that it is to show: nothing of
   a visitor is kept but what makes the next picture faster. Whoever asks by another host's name, or from
   another page, is refused. Needs ssdgs.h and olat.h before it. */
#ifndef VIEW_H
#define VIEW_H

#ifdef _WIN32
#include <winsock2.h>
#include <ws2tcpip.h>
#endif
#include <signal.h>
#include <time.h>
#ifndef _WIN32
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/select.h>
#include <sys/socket.h>
typedef int view__socket;
#define view__close_socket close
#define VIEW__NO_SOCKET (-1)
#else
typedef SOCKET view__socket;
#define view__close_socket closesocket
#define VIEW__NO_SOCKET INVALID_SOCKET
#define recv(socket, to, size, flags) recv(socket, to, (int)(size), flags)
#define send(socket, from, size, flags) send(socket, from, (int)(size), flags)
#endif

enum {
    VIEW__VISITORS = 8,
    VIEW__REQUEST = 8192,
    VIEW__MODELS = 16,
    VIEW__LIGHTS = 8,
    VIEW__SIDE = 2560,
    VIEW__PATIENCE = 30 /* seconds */
};

/* ---- what a picture shows ---- */

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
    VIEW__LIGHT,
    VIEW__FIELDS
};
static const struct {
    const char *name;
    int count;
    double least, most, usual[3];
} view__field[VIEW__FIELDS] = {
    {"w", 1, 16, VIEW__SIDE, {256, 0, 0}}, {"h", 1, 16, VIEW__SIDE, {256, 0, 0}},
    {"eye", 3, -1e6, 1e6, {0, -3, 1}},     {"target", 3, -1e6, 1e6, {0, 0, 0}},
    {"up", 3, -1, 1, {0, 0, 1}},           {"angle", 1, 0.05, 2.5, {0.7, 0, 0}},
    {"exposure", 1, 1e-3, 1e3, {1, 0, 0}}, {"ambient", 3, 0, 1e3, {0, 0, 0}},
    {"tint", 3, 0, 100, {1, 1, 1}},        {"roughness", 1, 0.1, 10, {1, 0, 0}},
    {"gloss", 1, 0, 100, {1, 0, 0}},       {"translucency", 1, 0.1, 10, {1, 0, 0}},
    {"light", 6, -1e6, 1e6, {0, 0, 0}}}; /* place and colour, once for each light */

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

/* ---- the program ---- */

typedef struct view__visitor {
    view__socket socket;
    char in[VIEW__REQUEST + 1]; /* what came, and is not answered yet */
    size_t got;
    unsigned char *out; /* the answer, so far sent */
    size_t size, sent, room;
    time_t heard; /* when something last went to or fro */
    int leaves;   /* once the answer is sent */
    ssdgs_scene *scene;
} view__visitor;

typedef struct view_server {
    ssdgs_context *context;
    ssdgs_model *models[VIEW__MODELS];
    const char *names[VIEW__MODELS];
    int count;
    float middle[3], radius;
    ssdgs_object objects[VIEW__MODELS];
    unsigned char *page;
    size_t page_size;
    float *planes;        /* (VIEW__SIDE,VIEW__SIDE,4) */
    unsigned char *bytes; /* (VIEW__SIDE,VIEW__SIDE,4) */
    view__socket listener;
    int port;           /* 0: any; then the one that was had */
    struct {            /* while the model trains: */
        int on, paused; /* paused: the page asks to wait */
        int iteration, iterations;
        double loss, psnr, left; /* left: seconds */
    } training;
    view__visitor visitors[VIEW__VISITORS];
} view_server;

/* Models side by side along x. */
OLAT__API ssdgs_result view_arrange(view_server *s) {
    float at = 0, low[3], high[3], tallest[2] = {1e30f, -1e30f};
    for (int i = 0; i < s->count; i++) {
        const ssdgs_result result = ssdgs_model_bounds(s->models[i], low, high);
        if (result) return result;
        s->objects[i] = ssdgs_object_default(s->models[i]);
        const float width = high[0] - low[0];
        if (s->count > 1) s->objects[i].to_world[3] = at - low[0];
        else at = low[0];
        at += (s->count > 1 ? 1.15f : 1) * width;
        for (int c = 1; c < 3; c++) s->radius = fmaxf(s->radius, (high[c] - low[c]) / 2);
        s->middle[1] = (low[1] + high[1]) / 2;
        tallest[0] = fminf(tallest[0], low[2]);
        tallest[1] = fmaxf(tallest[1], high[2]);
        if (i == s->count - 1) {
            const float all = s->count > 1 ? at - 0.15f * width : width;
            s->middle[0] = s->count > 1 ? all / 2 : (low[0] + high[0]) / 2;
            s->radius = fmaxf(s->radius, all / 2);
        }
    }
    s->middle[2] = (tallest[0] + tallest[1]) / 2;
    return SSDGS_OK;
}

static void view__floats_of(const double *from, int count, float *to) {
    for (int i = 0; i < count; i++) to[i] = (float)from[i];
}

/* One pixel of a plane as four bytes. */
static void view__pixel(const view__wish *w, const view_server *s, const float *value, float alpha,
                        unsigned char *rgba) {
    float rgb[3] = {0, 0, 0};
    const float thin = alpha > 1e-6f ? alpha : 1e-6f;
    for (int c = 0; c < 3; c++) {
        if (w->plane <= VIEW__SCATTERING)
            rgb[c] = ssdgs_srgb_encode(fmaxf(0, value[c] * (float)w->value[VIEW__EXPOSURE][0]));
        else if (w->plane == VIEW__NORMAL) rgb[c] = 0.5f * (value[c] + alpha);
        else if (w->plane == VIEW__DEPTH) {
            double distance2 = 0;
            for (int i = 0; i < 3; i++) distance2 += pow(w->value[VIEW__EYE][i] - (double)s->middle[i], 2);
            rgb[c] = alpha * (0.5f - (value[0] / thin - (float)sqrt(distance2)) / (2.4f * s->radius));
        } else rgb[c] = value[0];
    }
    for (int c = 0; c < 3; c++) rgba[c] = (unsigned char)(fminf(1, fmaxf(0, rgb[c])) * 255 + 0.5f);
    rgba[3] = 255;
}

static int view__draw(view_server *s, view__visitor *v, const view__wish *w, unsigned char *rgba,
                      ssdgs_render_stats *stats) {
    const int width = (int)w->value[VIEW__WIDTH][0], height = (int)w->value[VIEW__HEIGHT][0];
    const size_t pixels = (size_t)width * (size_t)height;
    const float light_scale = ssdgs_model_settings(s->models[0])->light_scale;
    float eye[3], target[3], up[3], *value = s->planes,
                                    *alpha = s->planes + 3 * (size_t)VIEW__SIDE * VIEW__SIDE;
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
    ssdgs_result result = v->scene ? SSDGS_OK : ssdgs_scene_create(s->context, &v->scene);
    if (!result)
        result = ssdgs_scene_render(v->scene, s->objects, s->count, &camera, lights, w->lights, &options,
                                    &image, stats);
    const int three = w->plane <= VIEW__SCATTERING || w->plane == VIEW__NORMAL;
    for (size_t i = 0; i < pixels && !result; i++)
        view__pixel(w, s, value + (three ? 3 * i : i), image.alpha[i], rgba + 4 * i);
    return result == SSDGS_OK;
}

/* ---- answers ---- */

/* Room for an answer of so many bytes behind its head; NULL: there is none. */
static unsigned char *view__answer(view__visitor *v, const char *status, const char *type, size_t size,
                                   const char *more) {
    char head[1024];
    const int length = snprintf(
        head, sizeof head,
        "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %lu\r\nCache-Control: no-store\r\n"
        "X-Content-Type-Options: nosniff\r\nCross-Origin-Resource-Policy: same-origin\r\n"
        "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
        "connect-src 'self'; img-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n%s"
        "Connection: %s\r\n\r\n",
        status, type, (unsigned long)size, more, v->leaves ? "close" : "keep-alive");
    const size_t all = (size_t)length + size;
    if (all > v->room) {
        free(v->out);
        v->out = (unsigned char *)malloc(all);
        v->room = v->out ? all : 0;
        if (!v->out) return NULL;
    }
    memcpy(v->out, head, (size_t)length);
    v->size = all;
    v->sent = 0;
    return v->out + length;
}

static void view__say(view__visitor *v, const char *status, const char *type, const void *text, size_t size) {
    unsigned char *to = view__answer(v, status, type, size, "");
    if (to) memcpy(to, text, size);
}

static void view__refuse(view__visitor *v, const char *status, const char *why) {
    v->leaves = 1;
    view__say(v, status, "text/plain", why, strlen(why));
}

static void view__say_models(const view_server *s, view__visitor *v) {
    char text[4096];
    size_t length =
        (size_t)snprintf(text, sizeof text, "{\"middle\":[%g,%g,%g],\"radius\":%g,\"models\":[",
                         (double)s->middle[0], (double)s->middle[1], (double)s->middle[2], (double)s->radius);
    for (int i = 0; i < s->count; i++) {
        const char *name = s->names[i];
        for (const char *c = name; *c; c++)
            if (*c == '/' || *c == '\\') name = c + 1;
        length += (size_t)snprintf(text + length, sizeof text - length, "%s{\"name\":\"", i ? "," : "");
        for (int c = 0; name[c] && c < 60; c++)
            text[length++] = name[c] >= ' ' && name[c] < 127 && !strchr("\"\\<>&", name[c]) ? name[c] : '?';
        length += (size_t)snprintf(text + length, sizeof text - length, "\",\"gaussians\":%d}",
                                   ssdgs_model_peek(s->models[i]).count);
    }
    length += (size_t)snprintf(
        text + length, sizeof text - length,
        "],\"training\":%s,\"paused\":%s,\"iteration\":%d,\"iterations\":%d,\"loss\":%.6f,"
        "\"psnr\":%.3f,\"left\":%.0f}\n",
        s->training.on ? "true" : "false", s->training.paused ? "true" : "false", s->training.iteration,
        s->training.iterations, s->training.loss, s->training.psnr, s->training.left);
    view__say(v, "200 OK", "application/json", text, length);
}

static void view__say_picture(view_server *s, view__visitor *v, const char *query) {
    char problem[128], more[200];
    view__wish w;
    ssdgs_render_stats stats;
    if (!view__read_wish(query, &w, problem, sizeof problem)) {
        view__refuse(v, "400 Bad Request", problem);
        return;
    }
    const size_t size = 4 * (size_t)w.value[VIEW__WIDTH][0] * (size_t)w.value[VIEW__HEIGHT][0];
    const double start = olat_seconds();
    if (!view__draw(s, v, &w, s->bytes, &stats)) {
        view__refuse(v, "500 Internal Server Error", ssdgs_error_message(s->context));
        return;
    }
    snprintf(more, sizeof more, "X-Picture: %.2f ms, %d of %d Gaussians shaded, %d maps kept\r\n",
             1e3 * (olat_seconds() - start), stats.shaded, stats.gaussians, stats.lights_cached);
    unsigned char *to = view__answer(v, "200 OK", "application/octet-stream", size, more);
    if (to) memcpy(to, s->bytes, size);
}

/* The value of a header of a request, if it has one of this name: its length, with the value's place in at.
 */
static size_t view__header(const char *request, const char *name, const char **at) {
    const size_t length = strlen(name);
    for (const char *line = strstr(request, "\r\n"); line; line = strstr(line + 2, "\r\n")) {
        size_t i = 0;
        while (i < length && (line[2 + i] | 32) == name[i]) i++;
        if (i < length || line[2 + i] != ':') continue;
        *at = line + 3 + i + strspn(line + 3 + i, " \t");
        return strcspn(*at, "\r\n");
    }
    *at = NULL;
    return 0;
}

/* Whether a host, after a prefix, is this server's. */
static int view__is_here(const view_server *s, const char *prefix, const char *text, size_t length) {
    static const char *const hosts[2] = {"127.0.0.1", "localhost"};
    for (int i = 0; i < 2; i++) {
        char here[64];
        const int size = snprintf(here, sizeof here, "%s%s:%d", prefix, hosts[i], s->port);
        if ((size_t)size == length && !memcmp(here, text, length)) return 1;
    }
    return 0;
}

/* Answers a whole request, of headers alone. */
static void view__serve(view_server *s, view__visitor *v, char *request) {
    const char *value;
    char *path, *rest, *query;
    size_t length = view__header(request, "connection", &value);
    if (length == 5 && !memcmp(value, "close", 5)) v->leaves = 1;
    length = view__header(request, "host", &value);
    if (!view__is_here(s, "", value, length)) {
        view__refuse(v, "403 Forbidden", "this is another host\n");
        return;
    }
    length = view__header(request, "origin", &value);
    const int origin = value != NULL;
    if (value && !view__is_here(s, "http://", value, length)) {
        view__refuse(v, "403 Forbidden", "asked from another page\n");
        return;
    }
    length = view__header(request, "sec-fetch-site", &value);
    if (value && !(length == 11 && !memcmp(value, "same-origin", 11)) &&
        !(length == 4 && !memcmp(value, "none", 4))) {
        view__refuse(v, "403 Forbidden", "asked from another page\n");
        return;
    }
    length = view__header(request, "content-length", &value);
    int body = value && !(length == 1 && *value == '0');
    (void)view__header(request, "transfer-encoding", &value);
    body |= value != NULL;
    if (body) {
        view__refuse(v, "400 Bad Request", "requests have no body\n");
        return;
    }
    const int pauses = !strncmp(request, "POST /pause ", 12), goes_on = !strncmp(request, "POST /go-on ", 12);
    if (s->training.on && origin && (pauses || goes_on)) { /* the one thing that a visitor changes */
        s->training.paused = pauses;
        view__say_models(s, v);
        return;
    }
    if (strncmp(request, "GET ", 4) != 0) {
        view__refuse(v, "405 Method Not Allowed", "GET alone\n");
        return;
    }
    path = request + 4;
    rest = path + strcspn(path, " \r\n");
    if (strncmp(rest, " HTTP/1.1\r\n", 11) != 0 && strncmp(rest, " HTTP/1.0\r\n", 11) != 0) {
        view__refuse(v, "400 Bad Request", "this is no HTTP\n");
        return;
    }
    *rest = 0;
    query = path + strcspn(path, "?");
    if (*query) *query++ = 0;
    if (!strcmp(path, "/")) view__say(v, "200 OK", "text/html; charset=utf-8", s->page, s->page_size);
    else if (!strcmp(path, "/models")) view__say_models(s, v);
    else if (!strcmp(path, "/picture")) view__say_picture(s, v, query);
    else view__refuse(v, "404 Not Found", "there is nothing here\n");
}

/* ---- visitors ---- */

static void view__leave(view__visitor *v) {
    view__close_socket(v->socket);
    free(v->out);
    ssdgs_scene_destroy(v->scene);
    memset(v, 0, sizeof *v);
    v->socket = VIEW__NO_SOCKET;
}

/* The first whole request among what came, if no answer is on its way. */
static void view__next_request(view_server *s, view__visitor *v) {
    v->in[v->got] = 0;
    char *stop = strlen(v->in) == v->got ? strstr(v->in, "\r\n\r\n") : NULL;
    if (v->size) return;
    if (strlen(v->in) < v->got) view__refuse(v, "400 Bad Request", "a zero byte\n");
    else if (stop) {
        const size_t length = (size_t)(stop + 4 - v->in);
        char request[VIEW__REQUEST + 1];
        memcpy(request, v->in, length);
        request[length] = 0;
        v->got -= length;
        memmove(v->in, v->in + length, v->got);
        view__serve(s, v, request);
        if (!v->size) v->leaves = 1; /* out of memory */
    } else if (v->got == VIEW__REQUEST) view__refuse(v, "431 Request Header Fields Too Large", "too long\n");
}

static void view__receive(view_server *s, view__visitor *v) {
    const long got = (long)recv(v->socket, v->in + v->got, VIEW__REQUEST - v->got, 0);
    if (got <= 0) {
        view__leave(v);
        return;
    }
    v->heard = time(NULL);
    v->got += (size_t)got;
    view__next_request(s, v);
    if (!v->size && v->leaves) view__leave(v);
}

static void view__transmit(view_server *s, view__visitor *v) {
    const size_t left = v->size - v->sent;
    const long put =
        (long)send(v->socket, (const char *)v->out + v->sent, left < 1 << 20 ? left : 1 << 20, 0);
    if (put <= 0) {
        view__leave(v);
        return;
    }
    v->heard = time(NULL);
    v->sent += (size_t)put;
    if (v->sent < v->size) return;
    v->size = v->sent = 0;
    if (!v->leaves) view__next_request(s, v);
    if (!v->size && v->leaves) view__leave(v);
}

static int view__blocks_not(view__socket socket) {
#ifdef _WIN32
    u_long one = 1;
    return ioctlsocket(socket, FIONBIO, &one) == 0;
#else
    return fcntl(socket, F_SETFL, O_NONBLOCK) == 0;
#endif
}

static void view__welcome(view_server *s) {
    const view__socket socket = accept(s->listener, NULL, NULL);
    const int one = 1;
    view__visitor *v = s->visitors;
    if (socket == VIEW__NO_SOCKET) return;
    while (v < s->visitors + VIEW__VISITORS && v->socket != VIEW__NO_SOCKET) v++;
#ifndef _WIN32
    if (socket >= FD_SETSIZE) v = s->visitors + VIEW__VISITORS;
#endif
    if (v == s->visitors + VIEW__VISITORS || !view__blocks_not(socket)) {
        view__close_socket(socket);
        return;
    }
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, (const char *)&one, sizeof one);
    v->socket = socket;
    v->heard = time(NULL);
}

/* Serves whoever asks within so many milliseconds, one round: to be called again and again. 0: nobody did. */
static int view_poll(view_server *s, int milliseconds) {
    fd_set in, out;
    struct timeval time_left = {milliseconds / 1000, 1000 * (milliseconds % 1000)};
    view__socket highest = s->listener;
    FD_ZERO(&in);
    FD_ZERO(&out);
    FD_SET(s->listener, &in);
    for (view__visitor *v = s->visitors; v < s->visitors + VIEW__VISITORS; v++) {
        if (v->socket == VIEW__NO_SOCKET) continue;
        if (time(NULL) - v->heard > VIEW__PATIENCE) {
            view__leave(v);
            continue;
        }
        if (v->size) FD_SET(v->socket, &out);
        else FD_SET(v->socket, &in);
        highest = v->socket > highest ? v->socket : highest;
    }
    if (select((int)highest + 1, &in, &out, NULL, &time_left) <= 0) return 0;
    for (view__visitor *v = s->visitors; v < s->visitors + VIEW__VISITORS; v++) {
        if (v->socket == VIEW__NO_SOCKET) continue;
        if (FD_ISSET(v->socket, &out)) view__transmit(s, v);
        else if (FD_ISSET(v->socket, &in)) view__receive(s, v);
    }
    if (FD_ISSET(s->listener, &in)) view__welcome(s);
    return 1;
}

/* Opens the port and reads the page; 0, or 1 and a message. */
static int view_open(view_server *s, const char *page, char *error) {
    struct sockaddr_in address;
    s->listener = VIEW__NO_SOCKET;
    for (int i = 0; i < VIEW__VISITORS; i++) s->visitors[i].socket = VIEW__NO_SOCKET;
    if (olat__read_file(page, &s->page, &s->page_size, error)) return 1;
    s->planes = (float *)malloc(4 * (size_t)VIEW__SIDE * VIEW__SIDE * sizeof *s->planes);
    s->bytes = (unsigned char *)malloc(4 * (size_t)VIEW__SIDE * VIEW__SIDE);
    if (!s->planes || !s->bytes) return olat__fail(error, "out of memory");
#ifdef _WIN32
    WSADATA data;
    int length = (int)sizeof address;
    if (WSAStartup(MAKEWORD(2, 2), &data)) return olat__fail(error, "no sockets here");
#else
    const int one = 1;
    socklen_t length = (socklen_t)sizeof address;
    signal(SIGPIPE, SIG_IGN);
#endif
    memset(&address, 0, sizeof address);
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons((unsigned short)s->port);
    s->listener = socket(AF_INET, SOCK_STREAM, 0);
    if (s->listener == VIEW__NO_SOCKET) return olat__fail(error, "no socket can be opened");
#ifndef _WIN32 /* there it would let others take the port */
    setsockopt(s->listener, SOL_SOCKET, SO_REUSEADDR, (const char *)&one, sizeof one);
#endif
    if (bind(s->listener, (struct sockaddr *)&address, length) || listen(s->listener, VIEW__VISITORS) ||
        getsockname(s->listener, (struct sockaddr *)&address, &length) || !view__blocks_not(s->listener))
        return olat__fail(error, "port %d of 127.0.0.1 cannot be had", s->port);
    s->port = ntohs(address.sin_port);
    return 0;
}

/* Before the models and the context go. */
static void view_close(view_server *s) {
    for (view__visitor *v = s->visitors; s->page && v < s->visitors + VIEW__VISITORS; v++)
        if (v->socket != VIEW__NO_SOCKET) view__leave(v);
    if (s->page && s->listener != VIEW__NO_SOCKET) view__close_socket(s->listener);
    free(s->page), free(s->planes), free(s->bytes);
    s->page = s->bytes = NULL;
    s->planes = NULL;
}

/* view.html beside the source file that says __FILE__. */
OLAT__API void view_page(const char *source, char *path, size_t room) {
    size_t folder = strlen(source);
    while (folder && source[folder - 1] != '/' && source[folder - 1] != '\\') folder--;
    snprintf(path, room, "%.*sview.html", (int)folder, source);
}

#endif
