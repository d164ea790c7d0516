/* cc -O2 examples/colmap.c -o colmap -lm -lpthread: makes a dataset of what COLMAP found of photographs that
   were taken with two phones, one of which is the lamp, or with one and its own flash */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "colmap.h"
#include "hull.h"

static const char *const help[] = {
    "usage: colmap MODEL --images DIR [--masks DIR] [--lamp PREFIX [--shift N]] [--offset X,Y,Z] -o DATASET",
    "Makes a dataset for check and train of what COLMAP found (sparse/0: cameras, images, points3D).",
    "",
    "  --images DIR      the photographs by their names in the model, or with .exr, .png, .jpg instead",
    "  --masks DIR       white where the object is: NAME.png, or the name's ending replaced",
    "  --lamp PREFIX     the lamp is the phone whose photographs' names begin so, as B/: photographs of one",
    "                    number (the last one in the name) were taken at once. Without it each photograph",
    "                    was lit by its own flash",
    "  --shift N         the lamp's number is N more; 2.5 is midway between two of them; 0",
    "  --offset X,Y,Z    where the LED is beside the lamp's lens: right, up, back, in the model's unit; "
    "0,0,0",
    "  -o DATASET        a folder: gets copies of photographs and masks, transforms_train.json, and",
    "                    transforms_test.json with every eighth photograph; only these lists are replaced",
    "",
    "Coordinates stay COLMAP's. The lists have the lens, which train makes straight; how bright the lamp's",
    "photographs are beside the others, from points that both show; and the box that holds the object, from",
    "points that the masks show. The folder may be the one that has the photographs: nothing is copied "
    "then."};

enum { IMAGES, MASKS, LAMP, SHIFT, OFFSET, OUTPUT, OPTIONS, TEST_EVERY = 8, MOST_SIDE = 1024 };

typedef struct source { /* a photograph's files: where they are, and where in the dataset */
    char *from[2], *to[2];
} source;

typedef struct job {
    const char *model_folder, *given[OPTIONS];
    char loaded[OLAT__MAX_PATH]; /* the model's own folder */
    double shift, offset[3];
    colmap_model model;
    olat_dataset all; /* by name, as the model's images that are used */
    int *images;      /* of these the model's */
    int *partners;    /* the model's image of the lamp's photograph that was taken at once, or -1 */
    source *sources;  /* of the model's images */
    olat_guard guard;
    ssdgs_context *context;
} job;

static const double no_offset[3] = {0, 0, 0};

static int fail(const char *message) {
    fprintf(stderr, "colmap: %s\n", message);
    return 1;
}

OLAT__PRINTF(1, 2) static void note(const char *format, ...) {
    va_list list;
    fprintf(stderr, "colmap: note: ");
    va_start(list, format);
    vfprintf(stderr, format, list);
    va_end(list);
    fprintf(stderr, "\n");
}

/* ---- the model ---- */

static int has_model(const char *folder) {
    char path[OLAT__MAX_PATH];
    int found = 0;
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%.3000s/images.%s", folder, i ? "txt" : "bin");
        found |= olat_exists(path);
    }
    return found;
}

/* Loads the model of a folder, or the largest of several below it: parts that COLMAP could not join have
   coordinates of their own. */
static int load_model(job *j, char error[512]) {
    static const char *const below[2] = {"", "/sparse"};
    char folder[OLAT__MAX_PATH], list[256] = "";
    int models = 0, best = 0, failed = 0;
    snprintf(j->loaded, sizeof j->loaded, "%.3000s", j->model_folder);
    if (has_model(j->loaded)) {
        uint64_t ids[2][2];
        for (int i = 0; i < 100 && olat__identify(j->loaded, ids[0]); i++) {
            snprintf(folder, sizeof folder, "%.3000s/../%d", j->loaded, i);
            if (!has_model(folder) || !olat__identify(folder, ids[1]) || !memcmp(ids[0], ids[1], sizeof *ids))
                continue;
            olat__append(list, sizeof list, "%s%d", *list ? ", " : "", i);
        }
        if (*list) note("beside this model lie others that could not be joined with it (%s): not used", list);
        return colmap_load(j->loaded, &j->model, error);
    }
    for (int b = 0; b < 2 && !models; b++)
        for (int i = -1; i < 100 && !failed; i++) {
            colmap_model next;
            snprintf(folder, sizeof folder, "%.2000s%s/%d", j->model_folder, below[b], i);
            if (i < 0) snprintf(folder, sizeof folder, "%.2000s%s", j->model_folder, below[b]);
            if (!has_model(folder)) continue;
            failed = colmap_load(folder, &next, error);
            if (failed) break;
            olat__append(list, sizeof list, "%s%d: %d", models ? ", " : "", i, next.image_count);
            models++;
            if (next.image_count > j->model.image_count) {
                colmap_free(&j->model);
                j->model = next;
                best = i;
                memcpy(j->loaded, folder, sizeof folder);
            } else colmap_free(&next);
        }
    if (!failed && !models)
        failed = olat__fail(error, "%s: there is no COLMAP model, images.bin or images.txt",
                            olat__tail(j->model_folder));
    if (!failed && models > 1)
        note("%d models could not be joined (photographs of each: %s): model %d is used, the others' "
             "photographs are left out. More pictures between them, or more texture in view, join models",
             models, list, best);
    return failed;
}

/* ---- photographs and masks ---- */

/* The file of an image below a folder: its name, then with other endings; NULL if there is none. */
static const char *find_file(const char *folder, const char *name, int is_mask, char path[OLAT__MAX_PATH]) {
    static const char *const endings[8] = {"", ".exr", ".png", ".jpg", ".jpeg", ".EXR", ".PNG", ".JPG"};
    const char *dot = strrchr(name, '.');
    const int stem = dot && !strchr(dot, '/') ? (int)(dot - name) : (int)strlen(name);
    snprintf(path, OLAT__MAX_PATH, "%.1000s/%.1000s.png", folder, name); /* as COLMAP's own masks are named */
    if (is_mask && olat_exists(path)) return path + strlen(folder) + 1;
    for (int i = 0; i < 8; i++) {
        snprintf(path, OLAT__MAX_PATH, "%.1000s/%.*s%s", folder, i ? stem : (int)strlen(name), name,
                 endings[i]);
        if (olat_exists(path)) return path + strlen(folder) + 1;
    }
    return NULL;
}

/* A path, to be freed; NULL: out of memory. */
static char *joined(const char *folder, const char *kind, const char *name) {
    const size_t room = strlen(folder) + strlen(kind) + strlen(name) + 3;
    char *path = (char *)malloc(room);
    if (path) snprintf(path, room, "%s%s%s%s%s", folder, *kind ? "/" : "", kind, *name ? "/" : "", name);
    return path;
}

/* Finds the photographs and masks of all images, and makes frames of those that are there. */
static int find_photographs(job *j, char error[512]) {
    static const char *const kinds[2] = {"images", "masks"};
    const colmap_model *m = &j->model;
    char path[OLAT__MAX_PATH];
    int unmasked = 0;
    const size_t count = (size_t)m->image_count;
    j->all.frames = (olat_frame *)calloc(count, sizeof *j->all.frames);
    j->images = (int *)calloc(count, sizeof *j->images);
    j->partners = (int *)calloc(count, sizeof *j->partners);
    j->sources = (source *)calloc(count, sizeof *j->sources);
    if (!j->all.frames || !j->images || !j->partners || !j->sources)
        return olat__fail(error, "out of memory");
    colmap_centre(m->images, no_offset, j->all.origin); /* numbers stay small where coordinates are large */
    for (int i = 0; i < m->image_count; i++) {
        const colmap_image *image = m->images + i;
        source *files = j->sources + i;
        for (int kind = 0; kind < 2; kind++) {
            const char *folder = j->given[kind ? MASKS : IMAGES],
                       *name = folder && (!kind || files->from[0])
                                   ? find_file(folder, image->name, kind, path)
                                   : NULL;
            if (!name) continue;
            files->from[kind] = joined(path, "", "");
            files->to[kind] = joined(j->given[OUTPUT], kinds[kind], name);
            if (!files->from[kind] || !files->to[kind]) return olat__fail(error, "out of memory");
            if (olat_guard_input(&j->guard, path, error)) return 1;
        }
        if (!files->from[0]) continue;
        unmasked += !files->from[1];
        olat_frame *frame = j->all.frames + j->all.count;
        j->images[j->all.count++] = i;
        frame->lens = m->cameras[image->camera];
        for (int r = 0; r < 3; r++) {
            const double *row = image->rotation + 3 * r;
            for (int c = 0; c < 3; c++) frame->camera.view[4 * r + c] = (ssdgs_real)row[c];
            frame->camera.view[4 * r + 3] =
                (ssdgs_real)(image->translation[r] + olat__dot(row, j->all.origin));
        }
    }
    if (!j->all.count)
        return olat__fail(error, "%s: none of the %d photographs is there, as %.160s",
                          olat__tail(j->given[IMAGES]), m->image_count, m->images[0].name);
    if (j->all.count < m->image_count)
        note("%d of the %d photographs in the model are not in %s: left out", m->image_count - j->all.count,
             m->image_count, j->given[IMAGES]);
    if (j->given[MASKS] && unmasked)
        note("%d of the %d photographs have no mask in %s: all that they show is taken for the object",
             unmasked, j->all.count, j->given[MASKS]);
    return 0;
}

static int same_bytes(const unsigned char *a, size_t size, const char *path) {
    unsigned char *b = NULL;
    size_t other = 0;
    char error[512];
    const int same = !olat__read_file(path, &b, &other, error) && other == size && !memcmp(a, b, size);
    free(b);
    return same;
}

/* Copies photographs and masks to the dataset's folder, those that are not there. A file of other bytes there
   is somebody's: nothing is copied then. */
static int copy_photographs(job *j, char error[512]) {
    for (int writes = 0; writes < 2; writes++)
        for (int i = 0; i < 2 * j->all.count; i++) {
            const source *files = j->sources + j->images[i / 2];
            olat_frame *frame = j->all.frames + i / 2;
            const char *from = files->from[i % 2], *to = files->to[i % 2];
            uint64_t ids[2][2];
            unsigned char *bytes = NULL;
            size_t size;
            if (!from) continue;
            char **named = i % 2 ? &frame->mask : &frame->file;
            if (!writes && (*named = joined(to, "", "")) == NULL) return olat__fail(error, "out of memory");
            const int there = olat__identify(to, ids[1]);
            if (there && olat__identify(from, ids[0]) && !memcmp(ids[0], ids[1], sizeof *ids)) continue;
            if (!writes && !there && olat_guard_output(&j->guard, to, error)) return 1;
            if (there == writes) continue; /* compared before anything is written */
            int failed = olat__read_file(from, &bytes, &size, error);
            if (!failed && there && !same_bytes(bytes, size, to))
                failed =
                    olat__fail(error, "%s: is there already, and is another file than %s: choose another -o",
                               olat__tail(to), olat__tail(from));
            char *slash = *named ? strrchr(*named, '/') : NULL;
            if (!failed && !there && slash) {
                *slash = 0;
                failed = olat_make_folder(*named, error);
                *slash = '/';
                failed = failed || olat__write_file(to, bytes, size, error);
            }
            free(bytes);
            if (failed) return 1;
        }
    return 0;
}

/* ---- the lamp ---- */

/* The last number in a name, but for its ending, by its last 15 digits; -1 if there is none. */
static double number_of(const char *name) {
    const char *dot = strrchr(name, '.');
    size_t end = dot ? (size_t)(dot - name) : strlen(name), begin;
    while (end > 0 && !olat__is_digit(name[end - 1])) end--;
    for (begin = end; begin > 0 && end - begin < 15 && olat__is_digit(name[begin - 1]);) begin--;
    double value = begin < end ? 0 : -1;
    for (; begin < end; begin++) value = 10 * value + (name[begin] - '0');
    return value;
}

/* A photograph of the lamp's phone. */
typedef struct lamp {
    double number, place[3];
    int image; /* the model's */
} lamp;

static int by_number(const void *a, const void *b) {
    const double x = ((const lamp *)a)->number, y = ((const lamp *)b)->number;
    return (x > y) - (x < y);
}

static int is_lamp(const job *j, int image) {
    const char *prefix = j->given[LAMP];
    return !prefix || !strncmp(j->model.images[image].name, prefix, strlen(prefix));
}

/* Gives each photograph its lamp; those without one are left out. */
static int place_lamps(job *j, char error[512]) {
    const colmap_image *images = j->model.images;
    lamp *lamps = (lamp *)malloc((size_t)j->all.count * sizeof *lamps);
    int count = 0, kept = 0;
    double step = HUGE_VAL;
    if (!lamps) return olat__fail(error, "out of memory");
    for (int i = 0; i < j->all.count; i++) {
        const int image = j->images[i];
        if (!is_lamp(j, image)) continue;
        lamps[count].number = number_of(images[image].name);
        lamps[count].image = image;
        colmap_centre(images + image, j->offset, lamps[count++].place);
    }
    int failed = !count && olat__fail(error, "--lamp %.200s: no photograph's name begins so; one is %.160s",
                                      j->given[LAMP], images[j->images[0]].name);
    if (j->given[LAMP]) qsort(lamps, (size_t)count, sizeof *lamps, by_number);
    for (int i = 0; i < count && j->given[LAMP] && !failed; i++) {
        if (lamps[i].number < 0)
            failed = olat__fail(error, "%.160s has no number that tells which photographs belong to it",
                                images[lamps[i].image].name);
        if (!i) continue;
        const double apart = lamps[i].number - lamps[i - 1].number;
        if (!(apart > 0))
            failed = olat__fail(error, "%.160s and %.160s have the same number: which is the lamp's?",
                                images[lamps[i - 1].image].name, images[lamps[i].image].name);
        step = fmin(step, apart);
    }
    for (int i = 0; i < j->all.count && !failed; i++) {
        olat_frame frame = j->all.frames[i];
        const int image = j->images[i], own = is_lamp(j, image);
        const double name_number = number_of(images[image].name), number = name_number + j->shift;
        double before = 0; /* the share of the lamp before it */
        int at = 0;
        while (at < count && (own ? lamps[at].image != image : lamps[at].number < number)) at++;
        const int paired = !own && name_number >= 0;
        int found = at < count && (own || (paired && lamps[at].number <= number));
        if (!found && paired && at > 0 && at < count && floor(j->shift) < j->shift) {
            const double apart = lamps[at].number - lamps[at - 1].number;
            before = (lamps[at].number - number) / apart;
            found = apart <= step;
        }
        if (!found) continue;
        frame.light.kind = SSDGS_LIGHT_POINT;
        for (int c = 0; c < 3; c++) {
            const double first = before > 0 ? lamps[at - 1].place[c] : 0;
            frame.light.position[c] =
                (ssdgs_real)(before * first + (1 - before) * lamps[at].place[c] - j->all.origin[c]);
            frame.light.intensity[c] = 1;
        }
        j->partners[kept] = own ? -1 : lamps[at - (before > 0.5)].image;
        j->images[kept] = image;
        j->all.frames[kept++] = frame;
    }
    if (!failed && kept < j->all.count)
        note("left out, as the lamp's phone has no photograph of their time: %d of the %d photographs",
             j->all.count - kept, j->all.count);
    if (!failed) j->all.count = kept;
    free(lamps);
    return failed;
}

/* ---- the lists ---- */

/* Every eighth photograph is for the test. */
static int in_test(int frame) { return frame % TEST_EVERY == TEST_EVERY - 1; }

static int save_list(const job *j, int test, char error[512]) {
    char path[OLAT__MAX_PATH];
    olat_dataset part = j->all;
    part.count = 0;
    part.frames = (olat_frame *)malloc((size_t)j->all.count * sizeof *part.frames);
    if (!part.frames) return olat__fail(error, "out of memory");
    for (int i = 0; i < j->all.count; i++)
        if (in_test(i) == test) part.frames[part.count++] = j->all.frames[i];
    snprintf(path, sizeof path, "%.2000s/transforms_%s.json", j->given[OUTPUT], test ? "test" : "train");
    if (!part.count) remove(path); /* an earlier one would be of other photographs */
    const int failed = part.count && olat_save(path, j->given[OUTPUT], &part, error);
    free(part.frames);
    return failed;
}

static int save(const job *j, char error[512]) { return save_list(j, 0, error) || save_list(j, 1, error); }

/* ---- what the photographs show ---- */

/* Where a photograph shows a place, as a pixel's index; -1: nowhere. */
static ptrdiff_t pixel_of(const olat_frame *frame, const double place[3]) {
    const ssdgs_camera *camera = &frame->camera;
    double v[3];
    for (int i = 0; i < 3; i++) {
        v[i] = (double)camera->view[4 * i + 3];
        for (int k = 0; k < 3; k++) v[i] += (double)camera->view[4 * i + k] * place[k];
    }
    const double x = floor((double)camera->fx * v[0] / v[2] + (double)camera->cx),
                 y = floor((double)camera->fy * v[1] / v[2] + (double)camera->cy);
    if (!(v[2] > 0 && x >= 0 && y >= 0 && x < camera->width && y < camera->height)) return -1;
    return (ptrdiff_t)y * camera->width + (ptrdiff_t)x;
}

static double alpha_of(const olat_frame *frame, ptrdiff_t pixel) {
    return (double)olat__number(frame->pixels, frame->format, 4 * (size_t)pixel + 3);
}

/* The box of the points that three photographs saw and the masks show. With nothing cut out it holds what
   most photographs show. */
static int find_box(job *j, olat_frame *const *seen, const double origin[3]) {
    const colmap_model *m = &j->model;
    const int tracked = m->track_count > 0;
    double *at[3], side = 0;
    int count = 0;
    for (int c = 0; c < 3; c++) at[c] = (double *)malloc(((size_t)m->point_count + 1) * sizeof **at);
    const int failed = !at[0] || !at[1] || !at[2];
    for (int p = 0; p < m->point_count && !failed; p++) {
        const colmap_point *point = m->points + p;
        int views = 0, inside = 0;
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = point->place[c] - origin[c];
        for (int i = 0; i < j->all.count; i++) {
            const ptrdiff_t pixel = pixel_of(seen[i], place);
            views += pixel >= 0;
            inside += pixel >= 0 && alpha_of(seen[i], pixel) > 0.5;
        }
        if ((tracked && point->seen < 3) || inside < 0.8 * views || 2 * views < j->all.count) continue;
        for (int c = 0; c < 3; c++) at[c][count] = point->place[c];
        count++;
    }
    double(*box)[3] = j->all.bounds;
    for (int c = 0; c < 3 && count > 7; c++) {
        box[0][c] = hull__quantile(at[c], count, 0.01);
        box[1][c] = hull__quantile(at[c], count, 0.99);
        side = fmax(side, box[1][c] - box[0][c]);
    }
    j->all.has_bounds = side > 0;
    for (int c = 0; c < 3; c++) {
        box[0][c] -= 0.1 * side, box[1][c] += 0.1 * side;
        free(at[c]);
    }
    if (!failed && !j->all.has_bounds)
        note(
            "%d points belong to the object, too few to tell the box that holds it: check says where it lies",
            count);
    return failed;
}

/* A point that the photographs of one instant show. */
typedef struct pair {
    double alike, ratio[3]; /* cosine of the angle between the two views; the lamp's light by the other's */
} pair;

static int most_alike_first(const void *a, const void *b) {
    const double x = ((const pair *)a)->alike, y = ((const pair *)b)->alike;
    return (x < y) - (x > y);
}

/* How bright the lamp's photographs are beside those that were taken at once: the medians over the points
   that both saw, neither black nor at full white. The quarter that is seen from the most alike directions
   tells: from others most things look brighter or darker. */
static int compare_phones(job *j, olat_frame *const *seen, const double origin[3]) {
    enum { MOST = 1 << 16, FEWEST = 50 };
    const colmap_model *m = &j->model;
    int count = 0;
    int *frames = (int *)malloc((size_t)m->image_count * sizeof *frames); /* of the model's images */
    char *sees = (char *)malloc((size_t)m->image_count);
    pair *pairs = (pair *)malloc(MOST * sizeof *pairs);
    double *ratios = (double *)malloc(MOST * sizeof *ratios);
    const int failed = !frames || !sees || !pairs || !ratios;
    for (int i = 0; i < m->image_count && !failed; i++) frames[i] = -1;
    for (int i = 0; i < j->all.count && !failed; i++) frames[j->images[i]] = i;
    for (int p = 0; p < m->point_count && !failed; p++) {
        const colmap_point *point = m->points + p;
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = point->place[c] - origin[c];
        memset(sees, m->track_count == 0, (size_t)m->image_count); /* without tracks anybody may */
        for (int t = 0; t < point->seen; t++) sees[m->tracks[point->track + t]] = 1;
        for (int i = 0; i < j->all.count && count < MOST; i++) {
            const int partner = j->partners[i] < 0 ? -1 : frames[j->partners[i]];
            if (partner < 0 || !sees[j->images[i]] || !sees[j->partners[i]]) continue;
            double light[2][3], views[2][3];
            int usable = 1;
            for (int k = 0; k < 2; k++) {
                const olat_frame *frame = seen[k ? partner : i];
                const ptrdiff_t pixel = pixel_of(frame, place);
                usable &= pixel >= 0;
                colmap_centre(m->images + j->images[k ? partner : i], no_offset, views[k]);
                for (size_t c = 0; c < 3 && usable; c++) {
                    const ssdgs_real v = olat__number(frame->pixels, frame->format, 4 * (size_t)pixel + c);
                    light[k][c] = (double)(olat__is_light(frame->format) ? v : ssdgs_srgb_decode(v));
                    usable &= light[k][c] > 0.01 && (olat__is_light(frame->format) || light[k][c] < 0.9);
                    views[k][c] -= point->place[c];
                }
            }
            const double alike = olat__dot(views[0], views[1]) /
                                 sqrt(olat__dot(views[0], views[0]) * olat__dot(views[1], views[1]));
            if (!usable || !(alike >= -2)) continue; /* no number: farther away than squares are numbers */
            pair *made = pairs + count++;
            made->alike = alike;
            for (int c = 0; c < 3; c++) made->ratio[c] = light[1][c] / light[0][c];
        }
    }
    if (!failed && count >= FEWEST) {
        double found[3];
        qsort(pairs, (size_t)count, sizeof *pairs, most_alike_first);
        count = count / 4 > FEWEST ? count / 4 : FEWEST;
        for (int c = 0; c < 3; c++) {
            for (int i = 0; i < count; i++) ratios[i] = pairs[i].ratio[c];
            found[c] = hull__quantile(ratios, count, 0.5);
        }
        for (int i = 0; i < j->all.count; i++)
            for (int c = 0; c < 3 && is_lamp(j, j->images[i]); c++)
                j->all.frames[i].light.intensity[c] = (ssdgs_real)found[c];
        printf("the lamp's photographs are %.3f, %.3f, %.3f times as bright as the others (red, green, blue; "
               "%d points)\n",
               found[0], found[1], found[2], count);
    } else if (!failed)
        note("only %d points tell how bright the two phones' photographs are: taken for alike", count);
    free(frames);
    free(sees);
    free(pairs);
    free(ratios);
    return failed;
}

/* Reads the lists as training does, only smaller, and adds what the photographs tell. */
static int look(job *j, char error[512]) {
    olat_dataset sets[2];
    int most = 1, failed = 0, used[2] = {0, 0};
    olat_frame **seen = (olat_frame **)calloc((size_t)j->all.count, sizeof *seen);
    if (!seen) return olat__fail(error, "out of memory");
    memset(sets, 0, sizeof sets);
    for (int i = 0; i < j->all.count; i++) {
        const olat_lens *lens = &j->all.frames[i].lens;
        most = lens->width > most ? lens->width : most;
        most = lens->height > most ? lens->height : most;
    }
    const olat_reader reader = {j->context, NULL, NULL};
    for (int s = 0; s < 2 && !failed; s++) {
        if (s && j->all.count < TEST_EVERY) break;
        failed = olat_load_at(j->given[OUTPUT], s ? "transforms_test.json" : "transforms_train.json",
                              OLAT_DOWNSCALE((most + MOST_SIDE - 1) / MOST_SIDE), s ? sets[0].origin : NULL,
                              &reader, sets + s, error);
    }
    if (!failed) olat_print_notes(sets, "colmap");
    for (int i = 0; i < j->all.count && !failed; i++) seen[i] = sets[in_test(i)].frames + used[in_test(i)]++;
    failed =
        failed ||
        ((find_box(j, seen, sets[0].origin) || (j->given[LAMP] && compare_phones(j, seen, sets[0].origin))) &&
         olat__fail(error, "out of memory"));
    olat_free(sets);
    olat_free(sets + 1);
    free(seen);
    return failed;
}

static int run(job *j, char error[512]) {
    static const char *const files[3] = {"cameras", "images", "points3D"};
    static const char *const lists[2] = {"transforms_train.json", "transforms_test.json"};
    char path[OLAT__MAX_PATH];
    if (load_model(j, error)) return 1;
    for (int i = 0; i < 6; i++) {
        snprintf(path, sizeof path, "%.3000s/%s.%s", j->loaded, files[i / 2], i % 2 ? "txt" : "bin");
        if (olat_guard_input(&j->guard, path, error)) return 1;
    }
    if (find_photographs(j, error) || place_lamps(j, error) || olat_make_folder(j->given[OUTPUT], error))
        return 1;
    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%.2000s/%s", j->given[OUTPUT], lists[i]);
        if (olat_guard_output(&j->guard, path, error)) return 1;
    }
    if (copy_photographs(j, error)) return 1;
    if (ssdgs_context_create(NULL, &j->context)) return olat__fail(error, "out of memory");
    if (save(j, error) || look(j, error) || save(j, error)) return 1;
    int tests = 0;
    for (int i = 0; i < j->all.count; i++) tests += in_test(i);
    const double(*box)[3] = (const double(*)[3])j->all.bounds;
    if (j->all.has_bounds)
        printf("the object lies within %.3g, %.3g, %.3g and %.3g, %.3g, %.3g\n", box[0][0], box[0][1],
               box[0][2], box[1][0], box[1][1], box[1][2]);
    printf("%s: %d of the model's %d photographs for training, %d for the test\n", j->given[OUTPUT],
           j->all.count - tests, j->model.image_count, tests);
    return 0;
}

static int usage(const char *problem, const char *what) {
    fprintf(stderr, "colmap: %s %s\n%s\n", problem, what, help[0]);
    return 2;
}

int main(int argc, char **argv) {
    static const char *const names[OPTIONS] = {"--images", "--masks", "--lamp", "--shift", "--offset", "-o"};
    char error[512];
    job j;
    memset(&j, 0, sizeof j);
    for (int i = 1; i < argc; i++) {
        int option = 0;
        while (option < OPTIONS && strcmp(argv[i], names[option]) != 0) option++;
        if (!strcmp(argv[i], "--help")) {
            for (size_t k = 0; k < sizeof help / sizeof *help; k++) puts(help[k]);
            return 0;
        }
        if (option < OPTIONS && i + 1 == argc) return usage("a value is missing after", argv[i]);
        if (option < OPTIONS) j.given[option] = argv[++i];
        else if (argv[i][0] == '-') return usage("no such option:", argv[i]);
        else if (j.model_folder) return usage("a second model:", argv[i]);
        else j.model_folder = argv[i];
    }
    if (!j.model_folder || !j.given[IMAGES] || !j.given[OUTPUT] || !*j.given[OUTPUT])
        return usage("needs a MODEL, --images DIR and", "-o DATASET");
    if (j.given[SHIFT] && !j.given[LAMP]) return usage("--shift goes with", "--lamp");
    if (j.given[SHIFT] && !olat_argument(j.given[SHIFT], &j.shift))
        return usage("--shift needs a number, not", j.given[SHIFT]);
    const char *at = j.given[OFFSET];
    for (int c = 0; c < 3 && at; c++) {
        const size_t length = olat__parse_number(at, j.offset + c);
        if (!length || at[length] != (c < 2 ? ',' : 0) || !(fabs(j.offset[c]) < 1e6))
            return usage("--offset needs three numbers, X,Y,Z, not", j.given[OFFSET]);
        at += length + 1;
    }
    const int failed = run(&j, error) && fail(error);
    for (int i = 0; i < 2 * j.model.image_count && j.sources; i++)
        free(j.sources[i / 2].from[i % 2]), free(j.sources[i / 2].to[i % 2]);
    free(j.sources);
    colmap_free(&j.model);
    olat_free(&j.all);
    olat_guard_free(&j.guard);
    ssdgs_context_destroy(j.context);
    free(j.images);
    free(j.partners);
    return failed;
}
