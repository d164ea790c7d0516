/* cc -O2 examples/view.c -o view -lm -lpthread (Windows: -lws2_32): models in a browser on this machine.
   Serves view.html and one picture a request, which says all that it is to show: nothing of a visitor is kept
   but what makes the next picture faster. Ctrl-C ends it. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#ifdef _WIN32
#include <winsock2.h>
#endif
#include "olat.h"
#include <signal.h>
#include <time.h>
#ifndef _WIN32
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/select.h>
#include <sys/socket.h>
typedef int socket_t;
#define close_socket close
#define NO_SOCKET (-1)
#else
typedef SOCKET socket_t;
#define close_socket closesocket
#define NO_SOCKET INVALID_SOCKET
#define recv(socket, to, size, flags) recv(socket, to, (int)(size), flags)
#define send(socket, from, size, flags) send(socket, from, (int)(size), flags)
#endif

enum { VISITORS = 8, REQUEST = 8192, MODELS = 16, LIGHTS = 8, SIDE = 2560, PATIENCE = 30 /* seconds */ };

/* ---- what a picture shows ---- */

enum { COLOR, DIFFUSE, SPECULAR, SCATTERING, SHADOW, NORMAL, DEPTH, ALPHA, PLANES };
static const char *const plane_names[PLANES] = {"color",  "diffuse", "specular", "scattering",
                                                "shadow", "normal",  "depth",    "alpha"};
enum { EXACT, DEFAULT, FAST, PREVIEW, PRESETS };
static const char *const preset_names[PRESETS] = {"exact", "default", "fast", "preview"};

/* Names and how many numbers each has; in the order of the struct below. */
enum {
    WIDTH,
    HEIGHT,
    EYE,
    TARGET,
    UP,
    ANGLE,
    EXPOSURE,
    AMBIENT,
    TINT,
    ROUGHNESS,
    GLOSS,
    TRANSLUCENCY,
    LIGHT,
    FIELDS
};
static const struct {
    const char *name;
    int count;
    double least, most, usual[3];
} field[FIELDS] = {{"w", 1, 16, SIDE, {256, 0, 0}},       {"h", 1, 16, SIDE, {256, 0, 0}},
                   {"eye", 3, -1e6, 1e6, {0, -3, 1}},     {"target", 3, -1e6, 1e6, {0, 0, 0}},
                   {"up", 3, -1, 1, {0, 0, 1}},           {"angle", 1, 0.05, 2.5, {0.7, 0, 0}},
                   {"exposure", 1, 1e-3, 1e3, {1, 0, 0}}, {"ambient", 3, 0, 1e3, {0, 0, 0}},
                   {"tint", 3, 0, 100, {1, 1, 1}},        {"roughness", 1, 0.1, 10, {1, 0, 0}},
                   {"gloss", 1, 0, 100, {1, 0, 0}},       {"translucency", 1, 0.1, 10, {1, 0, 0}},
                   {"light", 6, -1e6, 1e6, {0, 0, 0}}}; /* place and colour, once for each light */

typedef struct wish {
    double value[FIELDS][3], light[LIGHTS][6];
    int lights, plane, preset;
} wish;

static int index_of(const char *const *names, int count, const char *text, size_t length) {
    for (int i = 0; i < count; i++)
        if (strlen(names[i]) == length && !memcmp(names[i], text, length)) return i;
    return -1;
}

/* Numbers with commas between them; 0: there are others, or something else. */
static int numbers(const char *text, size_t length, int count, double least, double most, double *out) {
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
static int read_key(wish *w, const char *key, size_t key_length, const char *value, size_t length) {
    if (key_length == 5 && !memcmp(key, "plane", 5))
        return (w->plane = index_of(plane_names, PLANES, value, length)) >= 0;
    if (key_length == 6 && !memcmp(key, "preset", 6))
        return (w->preset = index_of(preset_names, PRESETS, value, length)) >= 0;
    for (int i = 0; i < FIELDS; i++) {
        if (strlen(field[i].name) != key_length || memcmp(field[i].name, key, key_length) != 0) continue;
        if (i == LIGHT && w->lights == LIGHTS) return 0;
        return numbers(value, length, field[i].count, field[i].least, field[i].most,
                       i == LIGHT ? w->light[w->lights++] : w->value[i]);
    }
    return 0;
}

/* The wish of "key=value&key=value". 0, and what is wrong in problem. */
static int read_wish(const char *text, wish *w, char *problem, size_t room) {
    memset(w, 0, sizeof *w);
    for (int i = 0; i < LIGHT; i++) memcpy(w->value[i], field[i].usual, sizeof w->value[i]);
    w->preset = DEFAULT;
    while (*text) {
        const size_t length = strcspn(text, "&"), key = strcspn(text, "=&");
        const char *value = text + key + (key < length);
        if (!read_key(w, text, key, value, length - (size_t)(value - text))) {
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

typedef struct visitor {
    socket_t socket;
    char in[REQUEST + 1]; /* what came, and is not answered yet */
    size_t got;
    unsigned char *out; /* the answer, so far sent */
    size_t size, sent, room;
    time_t heard; /* when something last went to or fro */
    int leaves;   /* once the answer is sent */
    ssdgs_scene *scene;
} visitor;

typedef struct server {
    ssdgs_context *context;
    ssdgs_model *models[MODELS];
    const char *names[MODELS];
    int count;
    float middle[3], radius;
    ssdgs_object objects[MODELS];
    unsigned char *page;
    size_t page_size;
    float *planes; /* (SIDE,SIDE,4) */
    socket_t listener;
    int port;
    visitor visitors[VISITORS];
} server;

static volatile sig_atomic_t ended;
static void end(int number) {
    (void)number;
    ended = 1;
}

/* Models side by side along x. */
static ssdgs_result arrange(server *s) {
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

static void floats_of(const double *from, int count, float *to) {
    for (int i = 0; i < count; i++) to[i] = (float)from[i];
}

/* One pixel of a plane as four bytes. */
static void pixel(const wish *w, const server *s, const float *value, float alpha, unsigned char *rgba) {
    float rgb[3] = {0, 0, 0};
    const float thin = alpha > 1e-6f ? alpha : 1e-6f;
    for (int c = 0; c < 3; c++) {
        if (w->plane <= SCATTERING)
            rgb[c] = ssdgs_srgb_encode(fmaxf(0, value[c] * (float)w->value[EXPOSURE][0]));
        else if (w->plane == NORMAL) rgb[c] = 0.5f * (value[c] + alpha);
        else if (w->plane == DEPTH) {
            double distance2 = 0;
            for (int i = 0; i < 3; i++) distance2 += pow(w->value[EYE][i] - (double)s->middle[i], 2);
            rgb[c] = alpha * (0.5f - (value[0] / thin - (float)sqrt(distance2)) / (2.4f * s->radius));
        } else rgb[c] = value[0];
    }
    for (int c = 0; c < 3; c++) rgba[c] = (unsigned char)(fminf(1, fmaxf(0, rgb[c])) * 255 + 0.5f);
    rgba[3] = 255;
}

static int draw(server *s, visitor *v, const wish *w, unsigned char *rgba, ssdgs_render_stats *stats) {
    const int width = (int)w->value[WIDTH][0], height = (int)w->value[HEIGHT][0];
    const size_t pixels = (size_t)width * (size_t)height;
    const float light_scale = ssdgs_model_settings(s->models[0])->light_scale;
    float eye[3], target[3], up[3], *value = s->planes, *alpha = s->planes + 3 * (size_t)SIDE * SIDE;
    ssdgs_light lights[LIGHTS];
    ssdgs_render_options options = w->preset == EXACT     ? ssdgs_render_options_exact()
                                   : w->preset == DEFAULT ? ssdgs_render_options_default()
                                   : w->preset == FAST    ? ssdgs_render_options_fast()
                                                          : ssdgs_render_options_preview();
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    memset(lights, 0, sizeof lights);
    memset(value, 0, 3 * pixels * sizeof *value);
    float **const plane[PLANES] = {&image.color,  &image.diffuse, &image.specular, &image.scattering,
                                   &image.shadow, &image.normal,  &image.depth,    &image.alpha};
    *plane[w->plane] = value;
    image.alpha = w->plane == ALPHA ? value : alpha;
    floats_of(w->value[EYE], 3, eye);
    floats_of(w->value[TARGET], 3, target);
    floats_of(w->value[UP], 3, up);
    const ssdgs_camera camera =
        ssdgs_camera_look_at(eye, target, up, (float)w->value[ANGLE][0], width, height);
    for (int i = 0; i < w->lights; i++) {
        float distance2 = 0;
        floats_of(w->light[i], 3, lights[i].position);
        for (int c = 0; c < 3; c++) distance2 += powf(lights[i].position[c] - s->middle[c], 2);
        for (int c = 0; c < 3; c++)
            lights[i].intensity[c] = (float)w->light[i][3 + c] * distance2 / light_scale;
    }
    for (int c = 0; c < 3; c++) options.ambient[0][c] = (float)w->value[AMBIENT][c] / light_scale;
    for (int i = 0; i < s->count; i++) {
        floats_of(w->value[TINT], 3, s->objects[i].tint);
        s->objects[i].roughness = (float)w->value[ROUGHNESS][0];
        s->objects[i].specular = (float)w->value[GLOSS][0];
        s->objects[i].translucency = (float)w->value[TRANSLUCENCY][0];
    }
    ssdgs_result result = v->scene ? SSDGS_OK : ssdgs_scene_create(s->context, &v->scene);
    if (!result)
        result = ssdgs_scene_render(v->scene, s->objects, s->count, &camera, lights, w->lights, &options,
                                    &image, stats);
    const int three = w->plane <= SCATTERING || w->plane == NORMAL;
    for (size_t i = 0; i < pixels && !result; i++)
        pixel(w, s, value + (three ? 3 * i : i), image.alpha[i], rgba + 4 * i);
    return result == SSDGS_OK;
}

/* ---- answers ---- */

/* Room for an answer of so many bytes behind its head; NULL: there is none. */
static unsigned char *answer(visitor *v, const char *status, const char *type, size_t size,
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

static void say(visitor *v, const char *status, const char *type, const void *text, size_t size) {
    unsigned char *to = answer(v, status, type, size, "");
    if (to) memcpy(to, text, size);
}

static void refuse(visitor *v, const char *status, const char *why) {
    v->leaves = 1;
    say(v, status, "text/plain", why, strlen(why));
}

static void say_models(const server *s, visitor *v) {
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
    length += (size_t)snprintf(text + length, sizeof text - length, "]}\n");
    say(v, "200 OK", "application/json", text, length);
}

static void say_picture(server *s, visitor *v, const char *query) {
    char problem[128], more[200];
    wish w;
    ssdgs_render_stats stats;
    if (!read_wish(query, &w, problem, sizeof problem)) {
        refuse(v, "400 Bad Request", problem);
        return;
    }
    const size_t size = 4 * (size_t)w.value[WIDTH][0] * (size_t)w.value[HEIGHT][0];
    static unsigned char rgba[4 * (size_t)SIDE * SIDE];
    const double start = olat_seconds();
    if (!draw(s, v, &w, rgba, &stats)) {
        refuse(v, "500 Internal Server Error", ssdgs_error_message(s->context));
        return;
    }
    snprintf(more, sizeof more, "X-Picture: %.2f ms, %d of %d Gaussians shaded, %d maps kept\r\n",
             1e3 * (olat_seconds() - start), stats.shaded, stats.gaussians, stats.lights_cached);
    unsigned char *to = answer(v, "200 OK", "application/octet-stream", size, more);
    if (to) memcpy(to, rgba, size);
}

/* The value of a header of a request, if it has one of this name: its length, with the value's place in at.
 */
static size_t header(const char *request, const char *name, const char **at) {
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
static int is_here(const server *s, const char *prefix, const char *text, size_t length) {
    static const char *const hosts[2] = {"127.0.0.1", "localhost"};
    for (int i = 0; i < 2; i++) {
        char here[64];
        const int size = snprintf(here, sizeof here, "%s%s:%d", prefix, hosts[i], s->port);
        if ((size_t)size == length && !memcmp(here, text, length)) return 1;
    }
    return 0;
}

/* Answers a whole request, of headers alone. */
static void serve(server *s, visitor *v, char *request) {
    const char *value;
    char *path, *rest, *query;
    size_t length = header(request, "connection", &value);
    if (length == 5 && !memcmp(value, "close", 5)) v->leaves = 1;
    length = header(request, "host", &value);
    if (!is_here(s, "", value, length)) {
        refuse(v, "403 Forbidden", "this is another host\n");
        return;
    }
    length = header(request, "origin", &value);
    if (value && !is_here(s, "http://", value, length)) {
        refuse(v, "403 Forbidden", "asked from another page\n");
        return;
    }
    length = header(request, "sec-fetch-site", &value);
    if (value && !(length == 11 && !memcmp(value, "same-origin", 11)) &&
        !(length == 4 && !memcmp(value, "none", 4))) {
        refuse(v, "403 Forbidden", "asked from another page\n");
        return;
    }
    length = header(request, "content-length", &value);
    int body = value && !(length == 1 && *value == '0');
    (void)header(request, "transfer-encoding", &value);
    body |= value != NULL;
    if (body) {
        refuse(v, "400 Bad Request", "requests have no body\n");
        return;
    }
    if (strncmp(request, "GET ", 4) != 0) {
        refuse(v, "405 Method Not Allowed", "GET alone\n");
        return;
    }
    path = request + 4;
    rest = path + strcspn(path, " \r\n");
    if (strncmp(rest, " HTTP/1.1\r\n", 11) != 0 && strncmp(rest, " HTTP/1.0\r\n", 11) != 0) {
        refuse(v, "400 Bad Request", "this is no HTTP\n");
        return;
    }
    *rest = 0;
    query = path + strcspn(path, "?");
    if (*query) *query++ = 0;
    if (!strcmp(path, "/")) say(v, "200 OK", "text/html; charset=utf-8", s->page, s->page_size);
    else if (!strcmp(path, "/models")) say_models(s, v);
    else if (!strcmp(path, "/picture")) say_picture(s, v, query);
    else refuse(v, "404 Not Found", "there is nothing here\n");
}

/* ---- visitors ---- */

static void leave(visitor *v) {
    close_socket(v->socket);
    free(v->out);
    ssdgs_scene_destroy(v->scene);
    memset(v, 0, sizeof *v);
    v->socket = NO_SOCKET;
}

/* The first whole request among what came, if no answer is on its way. */
static void next_request(server *s, visitor *v) {
    v->in[v->got] = 0;
    char *stop = strlen(v->in) == v->got ? strstr(v->in, "\r\n\r\n") : NULL;
    if (v->size) return;
    if (strlen(v->in) < v->got) refuse(v, "400 Bad Request", "a zero byte\n");
    else if (stop) {
        const size_t length = (size_t)(stop + 4 - v->in);
        char request[REQUEST + 1];
        memcpy(request, v->in, length);
        request[length] = 0;
        v->got -= length;
        memmove(v->in, v->in + length, v->got);
        serve(s, v, request);
        if (!v->size) v->leaves = 1; /* out of memory */
    } else if (v->got == REQUEST) refuse(v, "431 Request Header Fields Too Large", "too long\n");
}

static void receive(server *s, visitor *v) {
    const long got = (long)recv(v->socket, v->in + v->got, REQUEST - v->got, 0);
    if (got <= 0) {
        leave(v);
        return;
    }
    v->heard = time(NULL);
    v->got += (size_t)got;
    next_request(s, v);
    if (!v->size && v->leaves) leave(v);
}

static void transmit(server *s, visitor *v) {
    const size_t left = v->size - v->sent;
    const long put =
        (long)send(v->socket, (const char *)v->out + v->sent, left < 1 << 20 ? left : 1 << 20, 0);
    if (put <= 0) {
        leave(v);
        return;
    }
    v->heard = time(NULL);
    v->sent += (size_t)put;
    if (v->sent < v->size) return;
    v->size = v->sent = 0;
    if (!v->leaves) next_request(s, v);
    if (!v->size && v->leaves) leave(v);
}

static int blocks_not(socket_t socket) {
#ifdef _WIN32
    u_long one = 1;
    return ioctlsocket(socket, FIONBIO, &one) == 0;
#else
    return fcntl(socket, F_SETFL, O_NONBLOCK) == 0;
#endif
}

static void welcome(server *s) {
    const socket_t socket = accept(s->listener, NULL, NULL);
    const int one = 1;
    visitor *v = s->visitors;
    if (socket == NO_SOCKET) return;
    while (v < s->visitors + VISITORS && v->socket != NO_SOCKET) v++;
#ifndef _WIN32
    if (socket >= FD_SETSIZE) v = s->visitors + VISITORS;
#endif
    if (v == s->visitors + VISITORS || !blocks_not(socket)) {
        close_socket(socket);
        return;
    }
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, (const char *)&one, sizeof one);
    v->socket = socket;
    v->heard = time(NULL);
}

static void listen_on(server *s) {
    while (!ended) {
        fd_set in, out;
        struct timeval second = {1, 0};
        socket_t highest = s->listener;
        FD_ZERO(&in);
        FD_ZERO(&out);
        FD_SET(s->listener, &in);
        for (visitor *v = s->visitors; v < s->visitors + VISITORS; v++) {
            if (v->socket == NO_SOCKET) continue;
            if (time(NULL) - v->heard > PATIENCE) {
                leave(v);
                continue;
            }
            if (v->size) FD_SET(v->socket, &out);
            else FD_SET(v->socket, &in);
            highest = v->socket > highest ? v->socket : highest;
        }
        if (select((int)highest + 1, &in, &out, NULL, &second) <= 0) continue;
        for (visitor *v = s->visitors; v < s->visitors + VISITORS; v++) {
            if (v->socket == NO_SOCKET) continue;
            if (FD_ISSET(v->socket, &out)) transmit(s, v);
            else if (FD_ISSET(v->socket, &in)) receive(s, v);
        }
        if (FD_ISSET(s->listener, &in)) welcome(s);
    }
}

static int open_port(server *s, char *error) {
    struct sockaddr_in address;
    const int one = 1;
#ifdef _WIN32
    WSADATA data;
    int length = (int)sizeof address;
    if (WSAStartup(MAKEWORD(2, 2), &data)) return olat__fail(error, "no sockets here");
#else
    socklen_t length = (socklen_t)sizeof address;
    signal(SIGPIPE, SIG_IGN);
#endif
    memset(&address, 0, sizeof address);
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons((unsigned short)s->port);
    s->listener = socket(AF_INET, SOCK_STREAM, 0);
    if (s->listener == NO_SOCKET) return olat__fail(error, "no socket can be opened");
#ifndef _WIN32 /* there it would let others take the port */
    setsockopt(s->listener, SOL_SOCKET, SO_REUSEADDR, (const char *)&one, sizeof one);
#endif
    (void)one;
    if (bind(s->listener, (struct sockaddr *)&address, length) || listen(s->listener, VISITORS) ||
        getsockname(s->listener, (struct sockaddr *)&address, &length) || !blocks_not(s->listener))
        return olat__fail(error, "port %d of 127.0.0.1 cannot be had", s->port);
    s->port = ntohs(address.sin_port);
    return 0;
}

static int usage(void) {
    fprintf(stderr, "usage: view MODEL.ply [MODEL.ply ...] [--port N] [--page view.html]\n");
    return 2;
}

int main(int argc, char **argv) {
    static server s;
    char error[512] = "", page[OLAT__MAX_PATH] = "";
    ssdgs_result result = SSDGS_OK;
    s.listener = NO_SOCKET;
    for (int i = 0; i < VISITORS; i++) s.visitors[i].socket = NO_SOCKET;
    for (int i = 1; i < argc; i++) {
        char *rest = NULL;
        if (!strcmp(argv[i], "--port") && i + 1 < argc) {
            s.port = (int)strtol(argv[++i], &rest, 10);
            if (*rest || s.port < 1 || s.port > 65535) return usage();
        } else if (!strcmp(argv[i], "--page") && i + 1 < argc) snprintf(page, sizeof page, "%s", argv[++i]);
        else if (argv[i][0] != '-' && s.count < MODELS) s.names[s.count++] = argv[i];
        else return usage();
    }
    if (!s.count) return usage();
    if (!*page) snprintf(page, sizeof page, "%.*shtml", (int)strlen(__FILE__) - 1, __FILE__);
    int failed = olat__read_file(page, &s.page, &s.page_size, error);
    s.planes = (float *)malloc(4 * (size_t)SIDE * SIDE * sizeof *s.planes);
    if (!s.planes) failed = olat__fail(error, "out of memory");
    if (!failed) result = ssdgs_context_create(NULL, &s.context);
    for (int i = 0; i < s.count && !failed && !result; i++)
        result = ssdgs_model_load(s.context, s.names[i], s.models + i, NULL);
    if (!failed && !result) result = arrange(&s);
    if (!failed && !result) failed = open_port(&s, error);
    if (!failed && !result) {
        signal(SIGINT, end);
        signal(SIGTERM, end);
        printf("http://127.0.0.1:%d\n", s.port);
        fflush(stdout);
        listen_on(&s);
    }
    if (failed) fprintf(stderr, "view: %s\n", error);
    if (result)
        fprintf(stderr, "view: %s: %s\n", ssdgs_result_string(result), ssdgs_error_message(s.context));
    for (visitor *v = s.visitors; v < s.visitors + VISITORS; v++)
        if (v->socket != NO_SOCKET) leave(v);
    if (s.listener != NO_SOCKET) close_socket(s.listener);
    for (int i = 0; i < s.count; i++) ssdgs_model_destroy(s.models[i]);
    ssdgs_context_destroy(s.context);
    free(s.page), free(s.planes);
    return failed || result;
}
