/* mpicc -O2 examples/train_mpi.c -o train_mpi -lm -lpthread; mpirun --bind-to none -n 4 train_mpi DATASET
   MODEL.ply: training on several processes, here by MPI; ssdgs.h knows only the function add() */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "olat.h"
#include <mpi.h>

static const char *const usage =
    "usage: mpirun --bind-to none -n PROCESSES train_mpi DATASET MODEL.ply [ITERATIONS [BATCH "
    "[BACKGROUND]]]\n"
    "Trains on a folder of photographs, BATCH a step, shared by 1, 2, 4, 8 ... processes. The model is the\n"
    "same for any number of them. Bound to a core, a process would have its threads share it.\n"
    "20000 iterations; a batch of 4, or of as many as there are processes; black or white behind\n"
    "transparent pixels.\n";

typedef struct team {
    int rank, processes, batch;
    double start;
    ssdgs_real received[1 << 16];
} team;

/* Adds in pairs, then pairs of pairs: a sum's bits do not depend on its order, so all come to the same. */
static ssdgs_result add(void *user, ssdgs_real *values, size_t count) {
    const size_t room = sizeof((team *)user)->received / sizeof *values;
    team *t = (team *)user;
    for (int apart = 1; apart < t->processes; apart *= 2)
        for (size_t at = 0; at < count; at += room) {
            const size_t n = count - at < room ? count - at : room;
            const int other = t->rank ^ apart, bytes = (int)(n * sizeof *values);
            if (MPI_Sendrecv(values + at, bytes, MPI_BYTE, other, 0, t->received, bytes, MPI_BYTE, other, 0,
                             MPI_COMM_WORLD, MPI_STATUS_IGNORE) != MPI_SUCCESS)
                return SSDGS_ERR_IO;
            for (size_t i = 0; i < n; i++) values[at + i] += t->received[i];
        }
    return SSDGS_OK;
}

static int progress(void *user, const ssdgs_train_stats *stats) {
    const team *t = (const team *)user;
    if (stats->iteration % 500 < t->batch)
        fprintf(stderr, "%d PSNR %.1f %d Gaussians %.0f s\n", stats->iteration, stats->psnr, stats->gaussians,
                MPI_Wtime() - t->start);
    return 1;
}

/* How many threads each process of this machine gets. */
static int threads_each(void) {
    ssdgs_context *context = NULL;
    MPI_Comm machine;
    int all = 1, here = 1;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    MPI_Comm_size(machine, &here);
    MPI_Comm_free(&machine);
    if (!ssdgs_context_create(NULL, &context)) all = ssdgs_context_threads(context);
    ssdgs_context_destroy(context);
    return all > here ? all / here : 1;
}

int main(int argc, char **argv) {
    static team t;
    MPI_Init(&argc, &argv);
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    MPI_Comm_rank(MPI_COMM_WORLD, &t.rank);
    MPI_Comm_size(MPI_COMM_WORLD, &t.processes);
    ssdgs_train_options options = ssdgs_train_options_default();
    options.batch = t.processes > 4 ? t.processes : 4;
    if (argc > 3) options.iterations = atoi(argv[3]);
    if (argc > 4) options.batch = atoi(argv[4]);
    for (int c = 0; c < 3; c++) options.background[c] = argc > 5 && !strcmp(argv[5], "white");
    options.sum.add = add;
    options.sum.user = &t;
    options.sum.rank = t.rank;
    options.sum.processes = t.processes;
    if (argc < 3 || argc > 6 || t.processes & (t.processes - 1)) {
        if (!t.rank) fputs(usage, stderr);
        MPI_Finalize();
        return 2;
    }
    olat_dataset data;
    char error[512] = "";
    const double origin[3] = {0, 0, 0};
    memset(&data, 0, sizeof data);
    if (olat_load_at(argv[1], "transforms_train.json", 0, origin, NULL, &data, error)) {
        fprintf(stderr, "train_mpi: process %d: %s\n", t.rank, error);
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    ssdgs_photo *photos = olat_photos(&data);
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = threads_each();
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    ssdgs_trainer *trainer = NULL;
    t.batch = options.batch;
    t.start = MPI_Wtime();
    ssdgs_result result = ssdgs_context_create(&desc, &context);
    if (!result) result = ssdgs_model_create(context, NULL, 0, &model);
    if (!result) result = ssdgs_trainer_create(model, photos, data.count, &options, &trainer);
    if (!result) result = ssdgs_trainer_run(trainer, t.rank ? NULL : progress, &t);
    const double seconds = MPI_Wtime() - t.start;
    if (!result && !t.rank) result = ssdgs_model_save(model, argv[2]);
    if (result) { /* the others wait for this one's part */
        fprintf(stderr, "train_mpi: process %d: %s\n", t.rank,
                context ? ssdgs_error_message(context) : ssdgs_result_string(result));
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    if (!t.rank)
        printf("%s: %d processes of %d threads, batches of %d: %.2f photographs/s\n", argv[2], t.processes,
               desc.threads, options.batch, options.iterations / seconds);
    ssdgs_trainer_destroy(trainer);
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    free(photos);
    olat_free(&data);
    MPI_Finalize();
    return 0;
}
