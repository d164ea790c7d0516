/* examples/view.h from outside, by raw sockets: what it serves, what it refuses, and that visitors who are
   slow, broken or many harm nobody. */
#define SSDGS_IMPLEMENTATION
#ifdef _WIN32
#include <winsock2.h>
#endif
#include "../ssdgs.h"
#include "../examples/olat.h"
#include "../examples/unbake.h"
#include "../examples/picture.h"
#include "../examples/view.h"
#include "test.h"
#ifdef _WIN32
int main(void) { TEST_END(); } /* the server runs there; this program's threads do not */
#else
#include <pthread.h>
#ifndef MSG_NOSIGNAL
#define MSG_NOSIGNAL 0
#endif

static view_server here;
static volatile int ended;

/* A ball of two dozen Gaussians. */
static void make_model(void) {
    ssdgs_settings settings = ssdgs_settings_default();
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SHADOW_TERM;
    settings.shadow.layers = 0;
    for (int c = 0; c < 3; c++) settings.ambient[c] = 0.2f * (float)(c + 1);
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.tracer.stage = view_stage;
    desc.tracer.user = &here.show;
    CHECK(!ssdgs_context_create(&desc, &here.show.context));
    CHECK(!ssdgs_model_create(here.show.context, &settings, 24, here.show.models));
    for (int i = 0; i < 24; i++) {
        ssdgs_gaussian g = ssdgs_gaussian_default();
        const float turn = 2.4f * (float)i, z = 1 - (float)(2 * i + 1) / 24, across = sqrtf(1 - z * z);
        g.position[0] = 0.4f * across * cosf(turn), g.position[1] = 0.4f * across * sinf(turn),
        g.position[2] = 0.4f * z;
        for (int c = 0; c < 3; c++) g.scale[c] = 0.1f, g.normal[c] = g.position[c];
        g.opacity = 0.8f;
        CHECK(!ssdgs_model_set(here.show.models[0], i, &g));
    }
}

static void *run(void *unused) {
    while (!ended) view_poll(&here, 100);
    return unused;
}

static int visit(void) {
    struct sockaddr_in address;
    const struct timeval patience = {20, 0};
    const int s = socket(AF_INET, SOCK_STREAM, 0);
    memset(&address, 0, sizeof address);
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons((unsigned short)here.port);
    setsockopt(s, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    CHECK(s >= 0 && !connect(s, (struct sockaddr *)&address, sizeof address));
    return s;
}

static void tell(int s, const char *text, size_t size) {
    CHECK(send(s, text, size, MSG_NOSIGNAL) == (long)size);
}

/* One whole answer; its status, 0 where none came. body may be NULL. */
static int hear(int s, char **body, size_t *size) {
    static char head[4096];
    size_t got = 0, length = 0;
    int status = 0;
    while (got + 1 < sizeof head && recv(s, head + got, 1, 0) == 1) {
        head[++got] = 0;
        if (got > 3 && !strcmp(head + got - 4, "\r\n\r\n")) break;
    }
    head[got] = 0;
    const char *at = strstr(head, "Content-Length: ");
    if (sscanf(head, "HTTP/1.1 %d ", &status) != 1 || !at) return 0;
    length = (size_t)strtoul(at + 16, NULL, 10);
    char *bytes = (char *)malloc(length + 1);
    for (got = 0; got < length;) {
        const long part = (long)recv(s, bytes + got, length - got, 0);
        if (part <= 0) break;
        got += (size_t)part;
    }
    bytes[got] = 0;
    if (got < length) status = 0;
    if (body) *body = bytes, *size = length;
    else free(bytes);
    return status;
}

/* What one request of a visitor of its own is answered; %d in it is the port. */
static int asks(const char *format, const char *want) {
    char request[512], *body = NULL;
    size_t size = 0;
    snprintf(request, sizeof request, format, here.port);
    const int s = visit();
    tell(s, request, strlen(request));
    const int status = hear(s, &body, &size);
    if (want && !test_check(body && strstr(body, want), __FILE__, __LINE__, format))
        printf("    answered %d: %s\n", status, body ? body : "nothing");
    free(body);
    close(s);
    return status;
}

/* Whether it hangs up after the answer. */
static int hangs_up(const char *format) {
    char request[512], byte;
    snprintf(request, sizeof request, format, here.port);
    const int s = visit();
    tell(s, request, strlen(request));
    const int left = hear(s, NULL, NULL) == 200 && recv(s, &byte, 1, 0) == 0;
    close(s);
    return left;
}

static void test_wishes(void) {
    static const struct {
        const char *text;
        int good;
    } wishes[] = {
        {"", 1},
        {"w=320&h=240&eye=0,-2,1.5e0&plane=normal&preset=exact", 1},
        {"light=1,2,3,1,1,1&light=-1,2,3,0,0,0.5", 1},
        {"eye=5e6,4000000,3000001.5&target=5e6,4e6,3e6&light=5e6,4e6,3e6,1,1,1", 1},
        {"w=15", 0},
        {"w=2561", 0},
        {"w=1e99", 0},
        {"w=", 0},
        {"w", 0},
        {"w=12x", 0},
        {"=3", 0},
        {"eye=1,2", 0},
        {"eye=1,2,3,4", 0},
        {"eye=1,2,", 0},
        {"eye=nan,0,0", 0},
        {"eye=1,2,3&&", 0},
        {"nothing=1", 0},
        {"plane=", 0},
        {"plane=colo", 0},
        {"plane=colors", 0},
        {"preset=best", 0},
        {"light=0,0,0,-1,0,0", 0},
        {"roughness=0", 0},
        {"light=1,1,1,1,1,1&light=1,1,1,1,1,1&light=1,1,1,1,1,1&light=1,1,1,1,1,1&light=1,1,1,1,1,1&"
         "light=1,1,1,1,1,1&light=1,1,1,1,1,1&light=1,1,1,1,1,1&light=1,1,1,1,1,1",
         0}};
    for (size_t i = 0; i < sizeof wishes / sizeof *wishes; i++) {
        view__wish w;
        char problem[128] = "";
        if (!test_check(view__read_wish(wishes[i].text, &w, problem, sizeof problem) == wishes[i].good,
                        __FILE__, __LINE__, "a wish"))
            printf("    %s\n", wishes[i].text);
        CHECK(wishes[i].good == !*problem);
    }
    view__wish w;
    char problem[128];
    CHECK(view__read_wish("w=320&eye=1,-2.5,3&plane=depth&preset=fast&light=1,2,3,4,5,6", &w, problem,
                          sizeof problem));
    CHECK(fabs(w.value[VIEW__WIDTH][0] - 320) < 1e-9 && fabs(w.value[VIEW__EYE][1] + 2.5) < 1e-9 &&
          w.plane == VIEW__DEPTH);
    CHECK(w.preset == VIEW__FAST && w.lights == 1 && fabs(w.light[0][5] - 6) < 1e-9 &&
          fabs(w.value[VIEW__TINT][2] - 1) < 1e-9);
}

static void test_answers(void) {
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "the page") == 200);
    CHECK(asks("GET / HTTP/1.0\r\nHOST:localhost:%d\r\nConnection: close\r\n\r\n", "the page") == 200);
    CHECK(asks("GET /models HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n",
               "\"name\":\"a?b.ply\",\"gaussians\":24") == 200);
    CHECK(asks("GET /picture?w=16&h=16 HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", NULL) == 200);
    CHECK(asks("GET /picture?w=3 HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "no such wish: w=3") == 400);
    CHECK(asks("GET /photograph?1 HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", NULL) == 200);
    CHECK(asks("GET /photograph?2 HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "no such photograph") == 404);
    CHECK(asks("GET /photograph HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "no such photograph") == 404);
    CHECK(asks("GET /photograph?-1 HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "no such photograph") == 404);
    CHECK(asks("GET /../view.c HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "nothing here") == 404);
    CHECK(asks("GET /etc/passwd HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "nothing here") == 404);
    CHECK(asks("GET / HTTP/1.1\r\n\r\n", "another host") == 403);
    CHECK(asks("GET / HTTP/1.1\r\nHost: evil.example:%d\r\n\r\n", "another host") == 403);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d1\r\n\r\n", "another host") == 403);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nOrigin: http://evil.example\r\n\r\n",
               "another page") == 403);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%1$d\r\nOrigin: http://127.0.0.1:%1$d\r\n\r\n",
               "the page") == 200);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nSec-Fetch-Site: cross-site\r\n\r\n",
               "another page") == 403);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nSec-Fetch-Site: same-origin\r\n\r\n", "the page") ==
          200);
    CHECK(asks("POST / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "GET alone") == 405);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Length: 4\r\n\r\n", "no body") == 400);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Length: 0\r\n\r\n", "the page") == 200);
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nTransfer-Encoding: chunked\r\n\r\n", "no body") ==
          400);
    CHECK(asks("\r\nGET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "the page") == 200);
    CHECK(asks("GET / HTTP/1.1\r\nHost: LocalHost:%d \t\r\n\r\n", "the page") == 200);
    CHECK(hangs_up("GET / HTTP/1.0\r\nHost: 127.0.0.1:%d\r\n\r\n"));
    CHECK(hangs_up("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nConnection: keep-alive, Close\r\n\r\n"));
    CHECK(asks("GET / HTTP/3\r\nHost: 127.0.0.1:%d\r\n\r\n", "no HTTP") == 400);
    CHECK(asks("GET /\r\nHost: 127.0.0.1:%d\r\n\r\n", "no HTTP") == 400);
    CHECK(asks("Host: 127.0.0.1:%d\r\n\r\n", "host") == 403);
}

/* Several requests of one visitor, in pieces and at once; the bytes are those of the library. */
static void test_pictures(pthread_t server) {
    char request[512], *body[2];
    size_t size[2];
    const int s = visit();
    const int length = snprintf(
        request, sizeof request,
        "GET /picture?w=48&h=32&eye=0,-2,0.5&light=1,-2,2,3,2,1&plane=diffuse HTTP/1.1\r\n"
        "Host: 127.0.0.1:%d\r\n\r\nGET /picture?w=48&h=32&plane=alpha HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n",
        here.port, here.port);
    for (int i = 0; i < length; i++) tell(s, request + i, 1);
    for (int i = 0; i < 2; i++) CHECK(hear(s, body + i, size + i) == 200 && size[i] == 4 * 48 * 32);
    close(s);
    ended = 1; /* the library is this thread's now */
    pthread_join(server, NULL);
    static const char *const stages[] = {"project", "sort", "bin", "walk", "shade", "composite"};
    for (int i = 0; i < 6; i++)
        CHECK(here.show.stages[i].name && !strcmp(here.show.stages[i].name, stages[i]) &&
              here.show.stages[i].seconds >= 0 && here.show.stages[i].seconds < 60);
    CHECK(!here.show.stages[6].name && !here.show.stage);
    const float eye[3] = {0, -2, 0.5f}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7f, 48, 32);
    ssdgs_light light;
    static float diffuse[3 * 48 * 32];
    ssdgs_image image;
    memset(&light, 0, sizeof light);
    memset(&image, 0, sizeof image);
    image.diffuse = diffuse;
    float distance2 = 0;
    const float at[3] = {1, -2, 2};
    for (int c = 0; c < 3; c++) {
        light.position[c] = at[c];
        distance2 += (at[c] - here.show.middle[c]) * (at[c] - here.show.middle[c]);
    }
    for (int c = 0; c < 3; c++) light.intensity[c] = (float)(3 - c) * distance2;
    CHECK(!ssdgs_render(here.show.models[0], &camera, &light, 1, &image));
    int worst = 0, brightest = 0;
    for (int i = 0; i < 48 * 32; i++)
        for (int c = 0; c < 3; c++) {
            const int got = (unsigned char)body[0][4 * i + c];
            const int want = (int)(fminf(1, ssdgs_srgb_encode(fmaxf(0, diffuse[3 * i + c]))) * 255 + 0.5f);
            worst = abs(got - want) > worst ? abs(got - want) : worst;
            brightest = got > brightest ? got : brightest;
        }
    CHECK(worst <= 1 && brightest > 100);
    CHECK((unsigned char)body[1][4 * (16 * 48 + 24)] > 150 && (unsigned char)body[1][3] == 255);
    free(body[0]), free(body[1]);
}

static void test_trouble(void) {
    static char junk[2 * VIEW__REQUEST];
    char request[128];
    int slow[2 * VIEW__VISITORS];
    memset(junk, 'x', sizeof junk);
    int s = visit(); /* longer than any request */
    (void)!send(s, junk, sizeof junk, MSG_NOSIGNAL);
    CHECK(hear(s, NULL, NULL) == 431);
    close(s);
    s = visit();
    tell(s, "GET /\0 HTTP/1.1\r\n", 17);
    CHECK(hear(s, NULL, NULL) == 400);
    close(s);
    for (int i = 0; i < 20; i++) { /* who leave before their answer */
        const int length =
            snprintf(request, sizeof request,
                     "GET /picture?w=256&h=256 HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", here.port);
        s = visit();
        tell(s, request, i % 2 ? (size_t)length : 10);
        close(s);
    }
    for (int i = 0; i < 2 * VIEW__VISITORS; i++) { /* who never finish what they say: others are served */
        slow[i] = visit();
        tell(slow[i], "GET / HT", 8);
    }
    CHECK(asks("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "the page") == 200);
    for (int i = 0; i < 2 * VIEW__VISITORS; i++) { /* who were silent for longest have left, and they alone */
        char byte;
        const long got = (long)recv(slow[i], &byte, 1, i > VIEW__VISITORS ? MSG_DONTWAIT : 0);
        CHECK(got <= 0 && (i > VIEW__VISITORS) == (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)));
        close(slow[i]);
    }
}

/* A model that trains may be told to wait, by this page alone. */
static void test_pause(void) {
    CHECK(asks("POST /pause HTTP/1.1\r\nHost: 127.0.0.1:%1$d\r\nOrigin: http://127.0.0.1:%1$d\r\n\r\n",
               "GET alone") == 405);
    here.show.training.on = 1;
    here.show.training.iteration = 7;
    CHECK(asks("GET /models HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n",
               "\"training\":true,\"paused\":false,\"photographs\":2,\"iteration\":7") == 200);
    CHECK(asks("POST /pause HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n", "GET alone") == 405 &&
          !here.show.training.paused);
    CHECK(asks("GET /pause HTTP/1.1\r\nHost: 127.0.0.1:%1$d\r\nOrigin: http://127.0.0.1:%1$d\r\n\r\n",
               NULL) == 404);
    CHECK(asks("POST /pause HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nOrigin: http://evil\r\n\r\n", NULL) == 403 &&
          !here.show.training.paused);
    CHECK(asks("POST /pause HTTP/1.1\r\nHost: 127.0.0.1:%1$d\r\nOrigin: http://127.0.0.1:%1$d\r\n\r\n",
               "\"paused\":true") == 200);
    CHECK(here.show.training.paused);
    CHECK(asks("POST /go-on HTTP/1.1\r\nHost: 127.0.0.1:%1$d\r\nOrigin: http://127.0.0.1:%1$d\r\n\r\n",
               "\"paused\":false") == 200);
    CHECK(!here.show.training.paused);
    here.show.training.on = 0;
}

enum { WIDE = 8, HIGH = 6, PIXELS = WIDE * HIGH };
static unsigned char bytes[4 * PIXELS];
static uint16_t words[4 * PIXELS];
static ssdgs_photo photos[2]; /* the same, in bytes and in words */
static void make_photos(void) {
    const float eye[3] = {0, -2, 0.5f}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    for (int i = 0; i < 4 * PIXELS; i++) {
        bytes[i] = (unsigned char)(i * 37 % 256);
        words[i] = (uint16_t)(257 * bytes[i]);
    }
    for (int i = 0; i < 2; i++) {
        photos[i].camera = ssdgs_camera_look_at(eye, target, up, 0.6f, WIDE, HIGH);
        photos[i].light.position[1] = -3;
        for (int c = 0; c < 3; c++) photos[i].light.intensity[c] = 9;
        photos[i].pixels = i ? (const void *)words : (const void *)bytes;
        photos[i].format = i ? SSDGS_PIXELS_RGBA16 : SSDGS_PIXELS_RGBA8;
    }
    here.show.training.photos = photos;
    here.show.training.count = 2;
}

/* Both photographs over black, each with its rendering, once no server is at work. */
static void test_photographs(void) {
    static float color[3 * PIXELS], alpha[PIXELS];
    const float black[3] = {0, 0, 0};
    char note[256];
    ssdgs_image image;
    memset(&image, 0, sizeof image);
    image.color = color;
    image.alpha = alpha;
    ssdgs_render_options options =
        ssdgs_render_options_exact(); /* with the room's light, as photographs are */
    for (int c = 0; c < 3; c++) options.ambient[0][c] = 0.2f * (float)(c + 1);
    ssdgs_light lights[2] = {photos[0].light, photos[0].light};
    lights[1].position[0] = 3, lights[1].intensity[1] = 2;
    for (int number = 0; number < 2; number++)
        photos[number].more = lights + 1, photos[number].more_count = 1;
    CHECK(!ssdgs_render_ex(here.show.models[0], &photos[0].camera, lights, 2, &options, &image, NULL));
    ssdgs_compose(color, alpha, PIXELS, ssdgs_model_settings(here.show.models[0])->transfer, black, color);
    for (int number = 0; number < 2; number++) {
        size_t size = 0;
        int wrong = 0, bright = 0;
        CHECK(!view__photograph(&here.show, number, &size, note, sizeof note) && size == 8 * PIXELS);
        CHECK(!strcmp(note, "{\"w\":16,\"h\":6}"));
        for (int y = 0; y < HIGH; y++)
            for (int x = 0; x < WIDE; x++)
                for (int c = 0; c < 4; c++) {
                    const unsigned char *row = here.show.bytes + (size_t)y * 8 * WIDE;
                    const int at = y * WIDE + x;
                    const double photo = c < 3 ? bytes[4 * at + c] * bytes[4 * at + 3] / 255.0 : 255;
                    const double render = c < 3 ? 255 * fmin(1, (double)color[3 * at + c]) : 255;
                    wrong += !(fabs(row[4 * x + c] - photo) <= 1);
                    wrong += !(fabs(row[4 * (WIDE + x) + c] - render) <= 1);
                    bright += c < 3 && row[4 * (WIDE + x) + c] > 60;
                }
        CHECK(!wrong && bright > 10);
    }
}

/* A plain splat file's colours are shown as they are stored; models apart stand side by side, in the middle.
 */
static void test_plain(void) {
    static view_show show;
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_scene *scene = NULL;
    ssdgs_render_stats stats;
    view__wish wish;
    char problem[128];
    settings.baked = 1;
    show.context = here.show.context;
    for (int i = 0; i < 2; i++) {
        ssdgs_gaussian g = ssdgs_gaussian_default();
        settings.transfer = i ? SSDGS_TRANSFER_SRGB : SSDGS_TRANSFER_NONE; /* the first says */
        CHECK(!ssdgs_model_create(show.context, &settings, 1, show.models + i));
        for (int c = 0; c < 3; c++) g.scale[c] = 0.2f, g.diffuse[c] = 0.5f;
        g.position[1] = 7.0f * (float)i, g.position[2] = 3.0f * (float)i;
        g.opacity = 0.995f;
        CHECK(!ssdgs_model_set(show.models[i], 0, &g));
    }
    show.count = 1;
    CHECK(!view_arrange(&show) && view__read_wish("w=32&h=32&eye=0,-2,0", &wish, problem, sizeof problem));
    CHECK(!view__draw(&show, &scene, &wish, &stats));
    CHECK(abs(show.bytes[4 * (16 * 32 + 16)] - 127) < 3);
    /* it takes light where that is asked for, keeps its own where that is, and is plain again */
    static const struct {
        const char *wish;
        int low, high;
    } lit[6] = {{"lit=1", 0, 0},
                {"lit=1&kept=1", 124, 130},
                {"lit=1&kept=0.25", 60, 68}, /* 0.214 / 4, encoded */
                {"lit=1&light=0,-4,0,3,3,3", 20, 255},
                {"light=0,-4,0,3,3,3", 124, 130},
                {"kept=0", 124, 130}};
    for (int i = 0; i < 6; i++) {
        char all[96];
        snprintf(all, sizeof all, "w=32&h=32&eye=0,-2,0&%s", lit[i].wish);
        CHECK(view__read_wish(all, &wish, problem, sizeof problem) &&
              !view__draw(&show, &scene, &wish, &stats));
        const int grey = show.bytes[4 * (16 * 32 + 16)];
        if (!CHECK(grey >= lit[i].low && grey <= lit[i].high)) printf("    %s: %d\n", lit[i].wish, grey);
    }
    char about[1024];
    show.names[0] = show.names[1] = "plain.ply";
    view__about(&show, about, sizeof about);
    CHECK(strstr(about, "\"plain\":true,\"kept\":0.000}") != NULL);
    show.count = 2;
    show.radius = 0;
    CHECK(!view_arrange(&show));
    char place[96];
    snprintf(place, sizeof place, "w=32&h=32&eye=%g,-3,0&target=%g,0,0", (double)show.objects[0].to_world[3],
             (double)show.objects[0].to_world[3]);
    CHECK(view__read_wish(place, &wish, problem, sizeof problem) &&
          !view__draw(&show, &scene, &wish, &stats));
    CHECK(abs(show.bytes[4 * (16 * 32 + 16)] - 127) < 6);
    CHECK(fabsf(show.objects[1].to_world[7] + 7) < 1e-3f && fabsf(show.middle[1]) < 1e-3f);
    CHECK(show.radius > 2.0f && fabsf(show.middle[2] - 1.5f) < 1e-3f);
    ssdgs_scene_destroy(scene);
    for (int i = 0; i < 2; i++) ssdgs_model_destroy(show.models[i]);
    view__forget(&show);
}

int main(void) {
    static const char page[] = "build/t_view.html";
    char error[512] = "";
    pthread_t thread;
    here.show.count = 1;
    here.show.names[0] = "folder/a\"b.ply";
    make_model();
    make_photos();
    CHECK(!view_arrange(&here.show));
    test_wishes();
    CHECK(view_open(&here, "build/no/such/page", error) && strstr(error, "no/such/page"));
    view_close(&here);
    CHECK(!olat__write_file(page, (const unsigned char *)"<p>the page", 11, error));
    if (!test_check(!view_open(&here, page, error), __FILE__, __LINE__, error) ||
        pthread_create(&thread, NULL, run, NULL))
        TEST_END();
    remove(page);
    test_answers();
    test_pause();
    test_trouble();
    test_pictures(thread);
    test_photographs();
    test_plain();
    view_close(&here);
    ssdgs_model_destroy(here.show.models[0]);
    ssdgs_context_destroy(here.show.context);
    TEST_END();
}
#endif
