/* view.h - shows models in a browser on this machine. MIT, see ssdgs.h.

   static view_server s; ... s.show: context, models, names, count; then view_arrange(), or middle and radius
   ... if (view_open(&s, "view.html", error)) ... while (...) view_poll(&s, 1000); view_close(&s);

   It serves view.html on 127.0.0.1, and one picture a request, which says all that it is to show: nothing of
   a visitor is kept but what makes the next picture faster. Whoever asks by another host's name, or from
   another page, is refused. Needs ssdgs.h, olat.h, unbake.h and picture.h before it. */
#ifndef VIEW_H
#define VIEW_H

#ifdef _WIN32
#include <winsock2.h>
#include <ws2tcpip.h>
#endif
#include <signal.h>
#ifndef _WIN32
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/select.h>
#include <sys/socket.h>
#if defined(__STRICT_ANSI__) && !defined(__cplusplus)
ssize_t readlink(const char *path, char *text, size_t room); /* hidden by -std=c99 */
#endif
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

enum { VIEW__VISITORS = 8, VIEW__REQUEST = 8192 };

/* ---- the program ---- */

typedef struct view__visitor {
    view__socket socket;
    char in[VIEW__REQUEST + 1]; /* what came, and is not answered yet */
    size_t got;
    unsigned char *out; /* the answer, so far sent */
    size_t size, sent, room;
    uint64_t heard; /* the turn in which something last went to or fro */
    int leaves;     /* once the answer is sent */
    ssdgs_scene *scene;
} view__visitor;

typedef struct view_server {
    view_show show;
    unsigned char *page;
    size_t page_size;
    view__socket listener;
    int port; /* 0: any; then the one that was had */
    view__visitor visitors[VIEW__VISITORS];
    uint64_t turns;
} view_server;

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
    view__about(&s->show, text, sizeof text);
    view__say(v, "200 OK", "application/json", text, strlen(text));
}

/* What has been drawn, or why it has not been. */
static void view__say_pixels(view_server *s, view__visitor *v, ssdgs_result result, size_t size,
                             const char *note) {
    char more[600];
    if (result) {
        view__refuse(v, "500 Internal Server Error", note);
        return;
    }
    snprintf(more, sizeof more, "X-Picture: %s\r\n", note);
    unsigned char *to = view__answer(v, "200 OK", "application/octet-stream", size, more);
    if (to) memcpy(to, s->show.bytes, size);
}

static void view__say_picture(view_server *s, view__visitor *v, const char *query) {
    char note[512];
    view__wish w;
    size_t size = 0;
    if (!view__read_wish(query, &w, note, sizeof note)) {
        view__refuse(v, "400 Bad Request", note);
        return;
    }
    const ssdgs_result result = view__picture(&s->show, &v->scene, &w, &size, note, sizeof note);
    view__say_pixels(s, v, result, size, note);
}

static void view__say_photograph(view_server *s, view__visitor *v, const char *query) {
    char note[512];
    double number;
    size_t size = 0;
    if (!view__numbers(query, strlen(query), 1, 0, s->show.training.count - 1, &number)) {
        view__refuse(v, "404 Not Found", "there is no such photograph\n");
        return;
    }
    const ssdgs_result result = view__photograph(&s->show, (int)number, &size, note, sizeof note);
    view__say_pixels(s, v, result, size, note);
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
        size_t size = strcspn(*at, "\r\n");
        while (size && strchr(" \t", (*at)[size - 1])) size--;
        return size;
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
        /* browsers leave out :80 */
        if (((size_t)size == length || (s->port == 80 && length + 3 == (size_t)size)) &&
            olat__same_letters(text, here, length))
            return 1;
    }
    return 0;
}

/* Answers a whole request, of headers alone. */
static void view__serve(view_server *s, view__visitor *v, char *request) {
    const char *value;
    char *path, *rest, *query;
    size_t length = view__header(request, "connection", &value);
    v->leaves = !!strstr(request, " HTTP/1.0\r\n"); /* unless it asks for more */
    for (size_t i = 0; i < length; i += strcspn(value + i, ", \t\r") + 1) {
        if (olat__same_letters(value + i, "keep-alive", 10)) v->leaves = 0;
        if (olat__same_letters(value + i, "close", 5)) {
            v->leaves = 1;
            break;
        }
    }
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
    if (s->show.training.on && origin && (pauses || goes_on)) { /* the one thing that a visitor changes */
        s->show.training.paused = pauses;
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
    else if (!strcmp(path, "/photograph")) view__say_photograph(s, v, query);
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
    const size_t blank = strspn(v->in, "\r\n"); /* between requests */
    v->got -= blank;
    memmove(v->in, v->in + blank, v->got + 1);
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
    v->heard = ++s->turns;
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
    v->heard = ++s->turns;
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

/* Where there is no room, whoever was silent for longest leaves. A free place's heard is 0. */
static void view__welcome(view_server *s) {
    const view__socket socket = accept(s->listener, NULL, NULL);
    const int one = 1;
    view__visitor *v = s->visitors;
    if (socket == VIEW__NO_SOCKET) return;
    int serves = view__blocks_not(socket);
#ifndef _WIN32
    serves = serves && socket < FD_SETSIZE;
#endif
    if (!serves) {
        view__close_socket(socket);
        return;
    }
    for (int i = 1; i < VIEW__VISITORS; i++)
        if (s->visitors[i].heard < v->heard) v = s->visitors + i;
    if (v->socket != VIEW__NO_SOCKET) view__leave(v);
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, (const char *)&one, sizeof one);
    v->socket = socket;
    v->heard = ++s->turns;
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
    free(s->page);
    s->page = NULL;
    view__forget(&s->show);
}

/* Finds view.html: beside the source file that says __FILE__, beside the program, or in ../examples from
   there; 0, or 1 and a message. called: the program's name, as argv[0] has it. */
OLAT__API int view_page(const char *source, const char *called, char *path, size_t room, char *error) {
    char program[OLAT__MAX_PATH];
    size_t at[2];
    snprintf(program, sizeof program, "%s", called ? called : "");
#ifdef _WIN32
    GetModuleFileNameA(NULL, program, sizeof program);
#else
    const long length = (long)readlink("/proc/self/exe", program, sizeof program - 1);
    if (length > 0) program[length] = 0; /* else there is no /proc */
#endif
    const char *const files[2] = {source, program};
    for (int i = 0; i < 2; i++)
        for (at[i] = strlen(files[i]); at[i] && files[i][at[i] - 1] != '/' && files[i][at[i] - 1] != '\\';)
            at[i]--;
    for (int i = 0; i < 3; i++) {
        snprintf(path, room, "%.*s%sview.html", (int)at[i > 0], files[i > 0], i < 2 ? "" : "../examples/");
        FILE *file = fopen(path, "rb");
        if (file) return fclose(file), 0;
    }
    return olat__fail(error,
                      "no view.html in \"%.*s\", \"%.*s\" or \"%.*s../examples/\"; view has --page FILE",
                      (int)at[0], source, (int)at[1], program, (int)at[1], program);
}

#endif
