/* The code of a page that needs no server: `make web` compiles it with emscripten for WebAssembly and puts it
   into view.html with a model. A worker of the page calls web_start(), then web_load() and web_picture();
   where pages may share memory others call web_help(), which never returns, and take part in its work. */
#define SSDGS_IMPLEMENTATION
#define SSDGS_NO_TRAINER
#define SSDGS_NO_STDIO
#define SSDGS_NO_THREADS
#include "../ssdgs.h"
#include "olat.h"
#include "splats.h"
#include "unbake.h"
#include "picture.h"

#define WEB_API(name) __attribute__((export_name(#name))) name

/* ---- a job system: every thread takes the next task until there is none ---- */

static struct {
    int lock, jobs; /* jobs: how many there have been; who has nothing to do waits for another */
    int next, done, count;
    void (*task)(void *data, int index);
    void *data;
} work;

static void lock(void) {
    while (__atomic_exchange_n(&work.lock, 1, __ATOMIC_ACQUIRE)) {}
}
static void unlock(void) { __atomic_store_n(&work.lock, 0, __ATOMIC_RELEASE); }

/* Does tasks until all have been taken. Returns the number of the job that is over. */
static int take_part(void) {
    lock();
    while (work.next < work.count) {
        void (*task)(void *, int) = work.task;
        void *data = work.data;
        const int index = work.next++;
        unlock();
        task(data, index);
        lock();
        if (++work.done == work.count) __builtin_wasm_memory_atomic_notify(&work.done, 1);
    }
    const int job = work.jobs;
    unlock();
    return job;
}

static void run(void *user, int count, void (*task)(void *data, int index), void *data) {
    (void)user;
    lock();
    work.task = task;
    work.data = data;
    work.count = count;
    work.next = work.done = 0;
    __atomic_fetch_add(&work.jobs, 1, __ATOMIC_RELEASE);
    unlock();
    __builtin_wasm_memory_atomic_notify(&work.jobs, ~0u);
    take_part();
    for (int done; (done = __atomic_load_n(&work.done, __ATOMIC_ACQUIRE)) < count;)
        __builtin_wasm_memory_atomic_wait32(&work.done, done, -1);
}

void WEB_API(web_help)(void);
void web_help(void) {
    for (;;) __builtin_wasm_memory_atomic_wait32(&work.jobs, take_part(), -1);
}

/* ---- what the page calls; strings end with 0, and memory is the caller's ---- */

static view_show show;
static ssdgs_scene *scene;
static char name[256], note[4096];
static size_t size;

void *WEB_API(web_room)(size_t bytes);
void *web_room(size_t bytes) { return malloc(bytes); }
void WEB_API(web_free)(void *memory);
void web_free(void *memory) { free(memory); }
/* What the last call found, or why it failed. */
const char *WEB_API(web_note)(void);
const char *web_note(void) { return note; }

/* 0, or an ssdgs_result. threads: all that take part, this one counted. */
int WEB_API(web_start)(int threads);
int web_start(int threads) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    if (threads > 1) desc.parallel.run = run;
    desc.threads = threads;
    desc.tracer.stage = view_stage;
    desc.tracer.user = &show;
    return ssdgs_context_create(&desc, &show.context);
}

/* The model of a PLY file, or a packed one, instead of the one before, which stays if this one cannot be
   read. The note says what the page must know of it. */
int WEB_API(web_load)(const char *called, const void *bytes, size_t length);
int web_load(const char *called, const void *bytes, size_t length) {
    ssdgs_model *model = NULL;
    unsigned char *plain = NULL;
    size_t plain_size = 0;
    char error[512];
    if (splats_unpack(called, (const unsigned char *)bytes, length, &plain, &plain_size, error)) {
        snprintf(note, sizeof note, "%s", error);
        return SSDGS_ERR_FORMAT;
    }
    ssdgs_result result = ssdgs_model_load_memory(show.context, plain ? plain : bytes,
                                                  plain ? plain_size : length, &model, NULL);
    free(plain);
    if (!result) {
        view__forget(&show);
        ssdgs_model_destroy(show.models[0]);
        show.models[0] = model;
        show.names[0] = name;
        show.count = 1;
        show.radius = 0;
        snprintf(name, sizeof name, "%s", called);
        result = view_arrange(&show);
        if (result) show.count = 0; /* there is no model then */
    }
    if (result) snprintf(note, sizeof note, "%s", ssdgs_error_message(show.context));
    else view__about(&show, note, sizeof note);
    return result;
}

/* Draws what a query asks for; NULL, or its pixels with their number of bytes in web_size(). The note says
   what it cost. */
const void *WEB_API(web_picture)(const char *query);
const void *web_picture(const char *query) {
    view__wish w;
    if (!show.count) snprintf(note, sizeof note, "there is no model\n");
    else if (view__read_wish(query, &w, note, sizeof note) &&
             !view__picture(&show, &scene, &w, &size, note, sizeof note))
        return show.bytes;
    return NULL;
}
size_t WEB_API(web_size)(void);
size_t web_size(void) { return size; }
