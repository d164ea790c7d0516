/* (cd examples/gpu; awk -f shaders.awk *.comp) >gpu_shaders.h
   cc -O2 -I. examples/view.c -o view -lm -lpthread (Windows: -lws2_32; before glibc 2.34: -ldl): models in a
   browser on this machine. Prints the address to open; Ctrl-C ends it. */
#define SSDGS_IMPLEMENTATION
#ifdef _WIN32
#include <winsock2.h> /* before windows.h */
#endif
#include "../ssdgs.h"
#include "gpu/gpu_gl.c"
#include "olat.h"
#include "splats.h"
#include "unbake.h"
#include "picture.h"
#include "view.h"

static volatile sig_atomic_t ended;
static void end(int number) {
    (void)number;
    ended = 1;
}

static char program[] = "view";

/* What a model is, and what reading it mended. */
static void tell_of(const char *name, const ssdgs_model *model, const ssdgs_load_stats *read) {
    const int mended = read->zero_rotations + read->clamped_opacities + read->clamped_scales;
    fprintf(stderr, "view: %s: %d Gaussians", name, ssdgs_model_count(model));
    if (read->dropped || mended) fprintf(stderr, ", %d dropped, %d mended", read->dropped, mended);
    fprintf(stderr, "%s%s", read->sorted ? ", sorted" : "", read->plain ? ", plain splats" : "");
    if (read->plain) fprintf(stderr, " of degree %d", ssdgs_model_settings(model)->harmonics);
    fprintf(stderr, "%s\n",
            read->untrained ? ", without the settings and networks that an editor has dropped" : "");
}

static int usage(FILE *to) {
    fprintf(to, "usage: view MODEL [MODEL ...] [--port N] [--page view.html] [--gpu]\n"
                "  MODEL        trained, or plain splats: PLY, compressed PLY, or SPZ up to version 3\n"
                "  --port N     where the page is served, on this machine alone; any that is free\n"
                "  --page FILE  the page; the view.html beside view.c\n"
                "  --gpu        the GPU draws, by OpenGL 4.3; else the CPU does\n");
    return to == stderr ? 2 : 0;
}

int main(int argc, char **argv) {
    static view_server s;
    char error[512] = "", page[OLAT__MAX_PATH] = "";
    int failed = 0, wants_gpu = 0;
    for (int i = 1; i < argc; i++) {
        char *rest = NULL;
        if (!strcmp(argv[i], "--help")) return usage(stdout);
        if (!strcmp(argv[i], "--port") && i + 1 < argc) {
            s.port = (int)strtol(argv[++i], &rest, 10);
            if (*rest || s.port < 1 || s.port > 65535) return usage(stderr);
        } else if (!strcmp(argv[i], "--page") && i + 1 < argc) snprintf(page, sizeof page, "%s", argv[++i]);
        else if (!strcmp(argv[i], "--gpu")) wants_gpu = 1;
        else if (argv[i][0] != '-' && s.show.count < VIEW__MODELS) s.show.names[s.show.count++] = argv[i];
        else return usage(stderr);
    }
    if (!s.show.count) return usage(stderr);
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.tracer.stage = view_stage;
    desc.tracer.user = &s.show;
    desc.logger.write = olat_hear;
    desc.logger.user = program;
    gpu *const device = wants_gpu ? gpu_create(NULL, error, sizeof error) : NULL;
    ssdgs_gpu_hook hook;
    if (device) {
        hook = gpu_hook(device);
        desc.gpu = &hook;
        printf("on %s\n", gpu_name(device));
    } else if (wants_gpu) fprintf(stderr, "view: %s: the CPU renders\n", error);
    ssdgs_result result = ssdgs_context_create(&desc, &s.show.context);
    for (int i = 0; i < s.show.count && !result && !failed; i++) {
        ssdgs_load_stats read;
        failed = splats_load(s.show.context, s.show.names[i], s.show.models + i, &read, error);
        if (!failed) tell_of(s.show.names[i], s.show.models[i], &read);
    }
    if (!result && !failed) result = view_arrange(&s.show);
    if (!result && !failed && !*page && view_page(__FILE__, argv[0], page, sizeof page, error)) failed = 1;
    if (!result && !failed) failed = view_open(&s, page, error);
    if (!result && !failed) {
        signal(SIGINT, end);
        signal(SIGTERM, end);
        printf("http://127.0.0.1:%d\n", s.port);
        fflush(stdout);
        while (!ended) view_poll(&s, 1000);
    }
    if (failed) fprintf(stderr, "view: %s\n", error);
    if (result)
        fprintf(stderr, "view: %s: %s\n", ssdgs_result_string(result), ssdgs_error_message(s.show.context));
    view_close(&s);
    for (int i = 0; i < s.show.count; i++) ssdgs_model_destroy(s.show.models[i]);
    ssdgs_context_destroy(s.show.context);
    gpu_destroy(device);
    return failed || result;
}
