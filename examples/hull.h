/* hull.h - what the photographs of a capture tell against each other before they are trained on: frames lit
   from all around among those of one lamp, exposures that nobody told, a background mixed into edges, OpenEXR
   that is not linear light. MIT, see ssdgs.h.

   #include "ssdgs.h"
   #include "olat.h"
   #include "hull.h"
   ...
   if (hull_judge(&set, &options, &logger)) puts("out of memory");

   HOW  The outlines carve the object's hull out of the bounds, coarsely. Points on it have normals, see
   cameras and lamps or do not, and so a matt surface's light is known but for its albedo. Albedos and one
   gain for each photograph are fitted. Objects are neither their hull nor matt, so what depends on where
   camera and lamp stand is no fault, and only what is far from right captures is told.

   Notes of judge.h and of the trainer are not repeated. */

#ifndef HULL_H
#define HULL_H

enum {
    HULL__SIDE = 64,    /* photographs are read down to so many cells */
    HULL__GRID = 32,    /* cells of the hull, each way */
    HULL__POINTS = 800, /* on it, at most */
    HULL__EDGES = 4096, /* half-transparent pixels that are looked at, at most */
    HULL__FEW = 12,     /* photographs that tell about each other */
    HULL__LISTED = 6,   /* names in a note */
    HULL__LEAST = 15,   /* lit points that tell a photograph's gain */
    HULL__LIT = 1,      /* how a lamp's light comes to a point */
    HULL__SHADED
};

/* A photograph as cells. */
typedef struct hull__view {
    const olat_frame *frame;
    int width, height, step;        /* cells, and pixels of a cell's side */
    float *light, *alpha;           /* (height, width) means: of linear light times alpha; of alpha */
    int outlined, flooded;          /* flooded: lit from all around */
    double eye[3], gain;            /* gain: logarithm of its brightness over what its lamps explain */
    double darkest, light_in_shade; /* where no lamp shines: light over what a lamp would bring; 1 and more is
                                       too much */
    int lit;                        /* points from which the gain is known */
} hull__view;

/* A half-transparent pixel, and the colour to which the opaque ones beside it lead. */
typedef struct hull__edge {
    float value[3], beside[3], alpha;
} hull__edge;

typedef struct hull__point {
    double place[3], normal[3], albedo;
    int lit; /* photographs from which that is known */
} hull__point;

typedef struct hull {
    const olat_dataset *set;
    const ssdgs_logger *logger;
    hull__view *views;
    float *cells; /* of all views */
    float *curve; /* (65536) linear light of stored words */
    hull__edge *edges;
    int edge_count;
    size_t edges_met;
    double low[3], cell[3]; /* the grid */
    unsigned char *hull;    /* (GRID^3) */
    hull__point *points;
    int point_count, flooded, usable; /* flooded photographs; photographs with outlines */
    unsigned char *kind;              /* (photographs, points): HULL__LIT, HULL__SHADED or 0, unknown */
    float *ratio, *due; /* (photographs, points) log of light seen over light due; log of light due to a white
                           point or, in shadow, of what would be if it faced the lamp */
    double most;        /* of all numbers in OpenEXR photographs */
    size_t numbers, full, above, on_grid; /* of them; that are 1; above 0.1, of these a byte's */
} hull;

/* ---- reading ---- */

/* Keeps of the half-transparent pixels those that have opaque ones beside them, in the end a part of all. */
static void hull__edge_at(hull *k, const olat_frame *frame, size_t pixel, double alpha) {
    for (int side = 0; side < 4; side++) { /* right and left, next to it and one further */
        const size_t step = 1 + (size_t)side / 2, next = side & 1 ? pixel - step : pixel + step,
                     further = side & 1 ? next - 1 : next + 1;
        if (olat__number(frame->pixels, frame->format, 4 * next + 3) < (ssdgs_real)0.99 ||
            olat__number(frame->pixels, frame->format, 4 * further + 3) < (ssdgs_real)0.99)
            continue;
        const size_t met = k->edges_met++;
        size_t at = met;
        if (at >= HULL__EDGES) at = (size_t)((met * UINT64_C(0x9E3779B97F4A7C15) >> 32) % (met + 1));
        if (at >= HULL__EDGES) return;
        hull__edge *e = k->edges + at;
        e->alpha = (float)alpha;
        for (size_t c = 0; c < 3; c++) {
            const double beside = (double)olat__number(frame->pixels, frame->format, 4 * next + c);
            const double lead =
                beside +
                (double)step * (beside - (double)olat__number(frame->pixels, frame->format, 4 * further + c));
            e->value[c] = (float)olat__number(frame->pixels, frame->format, 4 * pixel + c);
            e->beside[c] = (float)(lead < 0 ? 0 : lead > 1 && !olat__is_light(frame->format) ? 1 : lead);
        }
        if (met < HULL__EDGES) k->edge_count++;
        return;
    }
}

static void hull__read(hull *k, hull__view *v) {
    const olat_frame *frame = v->frame;
    const int w = frame->camera.width, h = frame->camera.height, light = olat__is_light(frame->format);
    size_t clear = 0;
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            const size_t pixel = (size_t)y * (size_t)w + (size_t)x,
                         cell = (size_t)(y / v->step) * (size_t)v->width + (size_t)(x / v->step);
            const double alpha = (double)olat__number(frame->pixels, frame->format, 4 * pixel + 3);
            double sum = 0;
            if (alpha <= 0) {
                clear++;
                continue;
            }
            for (size_t c = 0; c < 3; c++)
                if (frame->format == SSDGS_PIXELS_RGBA8)
                    sum +=
                        (double)k->curve[257 * (size_t)((const unsigned char *)frame->pixels)[4 * pixel + c]];
                else if (!light) sum += (double)k->curve[((const uint16_t *)frame->pixels)[4 * pixel + c]];
                else {
                    const double number = (double)olat__number(frame->pixels, frame->format, 4 * pixel + c);
                    sum += number;
                    k->most = number > k->most ? number : k->most;
                    k->full += number > 0.9995 && number < 1.0005;
                    k->numbers++;
                    if (!(number > 0.1)) continue; /* below, many are near a byte's by chance */
                    k->above++;
                    k->on_grid += fabs(255 * number - floor(255 * number + 0.5)) < 0.03;
                }
            v->light[cell] += (float)(alpha * sum / 3);
            v->alpha[cell] += (float)alpha;
            if (alpha > 0.1 && alpha < 0.7 && x >= 3 && x < w - 3) hull__edge_at(k, frame, pixel, alpha);
        }
    for (int y = 0; y < v->height; y++)
        for (int x = 0; x < v->width; x++) {
            const int across = w - x * v->step, down = h - y * v->step;
            const float area =
                (float)(across < v->step ? across : v->step) * (float)(down < v->step ? down : v->step);
            v->light[y * v->width + x] /= area;
            v->alpha[y * v->width + x] /= area;
        }
    const size_t pixels = (size_t)w * (size_t)h;
    v->outlined = clear > pixels / 100 && clear < pixels;
    ssdgs_real eye[3];
    olat_eye(&frame->camera, eye);
    for (int c = 0; c < 3; c++) v->eye[c] = (double)eye[c];
}

/* The cell that shows a place, or -1. */
static int hull__cell_of(const hull__view *v, const double place[3]) {
    const ssdgs_camera *camera = &v->frame->camera;
    double seen[3];
    for (int r = 0; r < 3; r++) {
        const ssdgs_real *row = camera->view + 4 * r;
        seen[r] = (double)row[0] * place[0] + (double)row[1] * place[1] + (double)row[2] * place[2] +
                  (double)row[3];
    }
    if (!(seen[2] > 0)) return -1;
    const double x = (double)camera->fx * seen[0] / seen[2] + (double)camera->cx,
                 y = (double)camera->fy * seen[1] / seen[2] + (double)camera->cy;
    if (!(x >= 0 && y >= 0 && x < camera->width && y < camera->height)) return -1;
    return (int)y / v->step * v->width + (int)x / v->step;
}

/* ---- the hull ---- */

static int hull__inside(const hull *k, const int at[3]) {
    for (int c = 0; c < 3; c++)
        if (at[c] < 0 || at[c] >= HULL__GRID) return 0;
    return k->hull[(at[0] * HULL__GRID + at[1]) * HULL__GRID + at[2]];
}

/* Leaves in the grid what no more than 2 in 100 outlines leave out; 0 where nothing is left. box: of the
   cells left. */
static int hull__carve(hull *k, int box[2][3]) {
    int left = 0;
    for (int c = 0; c < 3; c++) box[0][c] = HULL__GRID, box[1][c] = -1;
    for (int i = 0; i < HULL__GRID * HULL__GRID * HULL__GRID; i++) {
        const int at[3] = {i / HULL__GRID / HULL__GRID, i / HULL__GRID % HULL__GRID, i % HULL__GRID};
        double place[3];
        int seen = 0, out = 0;
        for (int c = 0; c < 3; c++) place[c] = k->low[c] + (at[c] + 0.5) * k->cell[c];
        for (int p = 0; p < k->set->count && 50 * out <= k->usable; p++) {
            const hull__view *v =
                k->views + (size_t)p * 7919 % (size_t)k->set->count; /* neighbours tell the same */
            const int cell = v->outlined ? hull__cell_of(v, place) : -1;
            if (cell < 0) continue;
            seen++;
            out += v->alpha[cell] < 0.02f;
        }
        k->hull[i] = (unsigned char)(seen > 0 && 50 * out <= seen);
        if (!k->hull[i]) continue;
        left++;
        for (int c = 0; c < 3; c++) {
            box[0][c] = at[c] < box[0][c] ? at[c] : box[0][c];
            box[1][c] = at[c] > box[1][c] ? at[c] : box[1][c];
        }
    }
    return left;
}

/* Points on the hull, evenly taken from all its outer cells, whose normals point to where less of it is. */
static void hull__place_points(hull *k) {
    enum { most = HULL__POINTS };
    for (int pass = 0, outer = 0, kept = 0; pass < 2; pass++) {
        int met = 0;
        for (int i = 0; i < HULL__GRID * HULL__GRID * HULL__GRID; i++) {
            const int at[3] = {i / HULL__GRID / HULL__GRID, i / HULL__GRID % HULL__GRID, i % HULL__GRID};
            int whole = 1, to[3];
            if (!k->hull[i]) continue;
            for (int side = 0; side < 6; side++) {
                memcpy(to, at, sizeof to);
                to[side / 2] += side % 2 ? 1 : -1;
                whole = whole && hull__inside(k, to);
            }
            if (whole) continue;
            if (!pass) {
                outer++;
                continue;
            }
            if ((long long)met++ * most / outer < kept && outer > most) continue;
            kept++;
            hull__point *p = k->points + k->point_count;
            double length = 0;
            for (int c = 0; c < 3; c++)
                p->normal[c] = 0, p->place[c] = k->low[c] + (at[c] + 0.5) * k->cell[c];
            for (int d = 0; d < 125; d++) {
                const int off[3] = {d / 25 - 2, d / 5 % 5 - 2, d % 5 - 2};
                for (int c = 0; c < 3; c++) to[c] = at[c] + off[c];
                if (hull__inside(k, to))
                    for (int c = 0; c < 3; c++) p->normal[c] -= off[c] / k->cell[c];
            }
            for (int c = 0; c < 3; c++) length += p->normal[c] * p->normal[c];
            if (!(length > 0)) continue;
            for (int c = 0; c < 3; c++) p->normal[c] /= sqrt(length);
            k->point_count++;
        }
    }
}

/* Whether the hull is in the way from just above a point towards a direction. */
static int hull__blocked(const hull *k, const hull__point *p, const double direction[3]) {
    const double step = fmax(k->cell[0], fmax(k->cell[1], k->cell[2]));
    for (int i = 1; i < 4 * HULL__GRID; i++) {
        int at[3];
        for (int c = 0; c < 3; c++) {
            const double cell =
                (p->place[c] + step * (1.7 * p->normal[c] + i * direction[c]) - k->low[c]) / k->cell[c];
            if (!(cell >= 0 && cell < (double)HULL__GRID)) return 0;
            at[c] = (int)cell;
        }
        if (hull__inside(k, at)) return 1;
    }
    return 0;
}

/* Where a light stands from a point: its direction, and what it would bring to a surface that faces it. */
static double hull__toward(const ssdgs_light *light, const double place[3], double direction[3]) {
    const int directional = light->kind == SSDGS_LIGHT_DIRECTIONAL;
    double distance2 = 0, e = 0, along = 0;
    ssdgs_real from[3];
    olat_place(light, from);
    for (int c = 0; c < 3; c++) {
        direction[c] = (double)from[c] - (directional ? 0 : place[c]);
        distance2 += direction[c] * direction[c];
        e += (double)light->intensity[c] / 3;
    }
    for (int c = 0; c < 3; c++) {
        direction[c] /= sqrt(distance2) + 1e-30;
        along -= direction[c] * (double)light->direction[c];
    }
    if (light->focus > 0) e *= along > 0 ? pow(along, (double)light->focus) : 0;
    return directional ? e : e / (distance2 + 1e-30);
}

/* What each photograph shows of each point, and what it should. Surfaces seen or lit at a slant tell little.
 */
static void hull__look(hull *k, int photo) {
    const hull__view *v = k->views + photo;
    const size_t first = (size_t)photo * (size_t)k->point_count;
    const double above = 0.5 * fmax(k->cell[0], fmax(k->cell[1], k->cell[2]));
    for (int i = 0; i < k->point_count; i++) {
        const hull__point *p = k->points + i;
        double to[3], length2 = 0, facing = 0, place[3], shadow = 0, light = 0;
        int slant = 0;
        for (int c = 0; c < 3; c++) {
            to[c] = v->eye[c] - p->place[c];
            length2 += to[c] * to[c];
            facing += to[c] * p->normal[c];
            place[c] = p->place[c] + above * p->normal[c];
        }
        if (!(facing > 0.25 * sqrt(length2))) continue;
        for (int c = 0; c < 3; c++) to[c] /= sqrt(length2);
        const int cell = hull__cell_of(v, place);
        if (cell < 0 || v->alpha[cell] < 0.5f || hull__blocked(k, p, to)) continue;
        for (int l = 0; l <= v->frame->more_count; l++) {
            const double e = hull__toward(l ? v->frame->more + l - 1 : &v->frame->light, p->place, to);
            const double cosine = to[0] * p->normal[0] + to[1] * p->normal[1] + to[2] * p->normal[2];
            if (cosine > 0 && !hull__blocked(k, p, to)) {
                light += e * cosine;
                slant |= cosine < 0.3;
            } else shadow += e;
        }
        if (slant || (light > 0 && light < 0.3 * shadow) || !(light + shadow > 0)) continue;
        const double seen = (double)v->light[cell] / (double)v->alpha[cell], due = light > 0 ? light : shadow;
        if (light > 0 && !(seen > 1e-6 * due)) continue; /* black: nothing tells its albedo */
        k->kind[first + (size_t)i] = light > 0 ? HULL__LIT : HULL__SHADED;
        k->due[first + (size_t)i] = (float)log(due);
        k->ratio[first + (size_t)i] = (float)log((seen + 1e-9 * due) / due);
    }
}

/* Albedos and gains, logarithms, such that seen = albedo x gain x due where the lamp shines; what is far off,
   a highlight for instance, counts little. */
static void hull__fit(hull *k) {
    enum { sweeps = 24 };
    const int n = k->set->count, points = k->point_count;
    for (int i = 0; i < n; i++) k->views[i].gain = 0, k->views[i].lit = 0;
    for (int i = 0; i < n * points; i++) k->views[i / points].lit += k->kind[i] == HULL__LIT;
    for (int sweep = 0; sweep < sweeps; sweep++) {
        double mean = 0;
        int known = 0;
        for (int i = 0; i < points + n; i++) { /* each albedo, then each gain */
            const int of_point = i < points;
            double *value = of_point ? &k->points[i].albedo : &k->views[i - points].gain, sum = 0,
                   weights = 0;
            int count = 0;
            for (int j = 0; j < (of_point ? n : points); j++) {
                const int photo = of_point ? j : i - points, point = of_point ? i : j;
                const int at = photo * points + point;
                if (k->kind[at] != HULL__LIT || k->views[photo].lit < HULL__LEAST) continue;
                const double wants = (double)k->ratio[at] -
                                     (of_point ? k->views[photo].gain : k->points[point].albedo),
                             off = fabs(wants - *value), weight = sweep && off > 0.3 ? 0.3 / off : 1;
                sum += weight * wants;
                weights += weight;
                count++;
            }
            *value = weights > 0 ? sum / weights : 0;
            if (of_point) k->points[i].lit = count;
            if (of_point || !(weights > 0)) continue;
            mean += *value;
            known++;
        }

        for (int i = 0; i < n && known; i++)
            if (k->views[i].lit >= HULL__LEAST) k->views[i].gain -= mean / known;
    }
}

/* ---- what they tell ---- */

OLAT__PRINTF(2, 3) static void hull__say(const hull *k, const char *format, ...) {
    char text[1024];
    va_list values;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    k->logger->write(k->logger->user, SSDGS_OK, text);
}

static int hull__ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The values' share-quantile; sorts them. 0 of none. */
static double hull__quantile(double *values, int count, double share) {
    qsort(values, (size_t)count, sizeof *values, hull__ascending);
    return count ? values[(int)(share * (count - 1))] : 0;
}

/* Writes the marked photographs' names, less the folders they share. */
static void hull__names(const hull *k, char *text, size_t room) {
    const char *first = k->set->frames[0].file;
    size_t folder = 0;
    int listed = 0, more = 0;
    *text = 0;
    for (size_t i = 0, same = 1; same && first[i]; i++) {
        for (int j = 1; j < k->set->count; j++) same = same && k->set->frames[j].file[i] == first[i];
        if (same && strchr(OLAT__SEPARATORS, first[i])) folder = i + 1;
    }
    for (int i = 0; i < k->set->count; i++) {
        if (!k->views[i].flooded) continue;
        if (listed == HULL__LISTED) {
            more++;
            continue;
        }
        olat__append(text, room, "%s%.80s", listed++ ? ", " : "", k->set->frames[i].file + folder);
    }
    if (more) olat__append(text, room, " and %d more", more);
}

/* Marks and names photographs that show light where their lamps bring none, most of all in what is darkest
   there, while the others are dark. Right captures reach 0.8 of what is asked for; where two are sure, 0.8 is
   enough for others. */
static int hull__flooded(hull *k) {
    enum { least = 20 };
    const int n = k->set->count, points = k->point_count;
    double *levels = (double *)malloc(((size_t)n + (size_t)points) * sizeof *levels);
    int judged = 0, sure = 0;
    if (!levels) return 1;
    double *shades = levels + n;
    for (int i = 0; i < n; i++) {
        hull__view *v = k->views + i;
        int count = 0;
        for (int j = 0; j < points; j++)
            if (k->kind[i * points + j] == HULL__SHADED && k->points[j].lit > 1)
                shades[count++] = (double)k->ratio[i * points + j] - k->points[j].albedo;
        v->darkest = v->light_in_shade = 0;
        if (count < least) continue;
        const double darkest = exp(hull__quantile(shades, count, 0.1)),
                     dark = exp(hull__quantile(shades, count, 0.25)),
                     middle = exp(hull__quantile(shades, count, 0.5));
        levels[judged++] = v->darkest = darkest;
        v->light_in_shade = fmin(darkest / 0.18, fmin(dark / 0.33, middle / 0.45)) / exp(fmax(0, v->gain)) /
                            (1 + 15.0 / count);
    }
    const double usual = hull__quantile(levels, judged, 0.25);
    free(levels);
    if (judged < 8) return 0;
    for (int i = 0; i < n; i++) sure += k->views[i].light_in_shade > 1 && k->views[i].darkest > 4 * usual;
    for (int i = 0; i < n; i++) {
        hull__view *v = k->views + i;
        v->flooded = v->light_in_shade > (sure > 1 ? 0.8 : 1) && v->darkest > 4 * usual;
        k->flooded += v->flooded;
    }
    if (!k->flooded) return 0;
    char names[HULL__LISTED * 90 + 40];
    hull__names(k, names, sizeof names);
    hull__say(k,
              "%d of the %d photographs %s lit from all around, not by the lamp that the list gives: %s. "
              "Leave such "
              "frames out of the list, or give them the lights that they have (pl_lights)",
              k->flooded, n, k->flooded == 1 ? "looks" : "look", names);
    return 0;
}

/* Solves a (size, size + extra) system in place by elimination; symmetric and positive. */
static void hull__solve(double *a, int size, int columns) {
    for (int i = 0; i < size; i++) {
        const double pivot = a[i * columns + i] + 1e-12;
        for (int c = 0; c < columns; c++) a[i * columns + c] /= pivot;
        for (int r = 0; r < size; r++) {
            const double factor = a[r * columns + i];
            for (int c = 0; c < columns && r != i; c++) a[r * columns + c] -= factor * a[i * columns + c];
        }
    }
}

enum { HULL__TERMS = 9 };

/* How far numbers are, each, from what a linear function of the first `terms` of their terms, fitted to the
   others, makes of them: about a standard deviation. scratch: (count) */
static double hull__spread(const double (*term)[HULL__TERMS], const double *value, int count, int terms,
                           double *weight, double *scratch) {
    enum { columns = 2 * HULL__TERMS + 1, rounds = 8 };
    double spread = 0;
    for (int i = 0; i < count; i++) weight[i] = 1;
    for (int round = 0; round < rounds; round++) {
        double a[(int)HULL__TERMS * columns];
        const int wide = 2 * terms + 1;
        memset(a, 0, sizeof a);
        for (int r = 0; r < terms; r++) {
            a[r * wide + terms + r] = 1; /* becomes the inverse; the last column the solution */
            for (int i = 0; i < count; i++) {
                for (int c = 0; c < terms; c++) a[r * wide + c] += weight[i] * term[i][r] * term[i][c];
                a[r * wide + 2 * terms] += weight[i] * term[i][r] * value[i];
            }
        }
        hull__solve(a, terms, wide);
        for (int i = 0; i < count; i++) {
            double off = value[i], own = 0;
            for (int r = 0; r < terms; r++) {
                off -= term[i][r] * a[r * wide + 2 * terms];
                for (int c = 0; c < terms; c++)
                    own += weight[i] * term[i][r] * term[i][c] * a[r * wide + terms + c];
            }
            scratch[i] = fabs(off) / fmax(1 - own, 0.05);
            weight[i] = scratch[i];
        }
        spread = hull__quantile(scratch, count, 0.5) / 0.6745;
        for (int i = 0; i < count; i++) weight[i] = weight[i] > 1.5 * spread ? 1.5 * spread / weight[i] : 1;
    }
    return spread;
}

/* Says why nothing can be said. */
static int hull__cannot(const hull *k, const char *why) {
    hull__say(k, "whether the photographs are exposed alike and lit by the lamps given cannot be judged: %s",
              why);
    return 0;
}

/* Notes where gains differ more than functions of the directions to camera and lamp explain. */
static int hull__exposures(hull *k) {
    static const int terms[3] = {3, 6, HULL__TERMS}, few[3] = {11, 24, 36};
    const int n = k->set->count;
    double middle[3] = {0, 0, 0}, least = 1e30;
    int known = 0;
    double(*term)[HULL__TERMS] =
        (double(*)[HULL__TERMS])malloc((size_t)n * (sizeof *term + 3 * sizeof(double)));
    if (!term) return 1;
    double *value = (double *)(term + n);
    for (int i = 0; i < k->point_count; i++)
        for (int c = 0; c < 3; c++) middle[c] += k->points[i].place[c] / k->point_count;
    for (int i = 0; i < n; i++) {
        const hull__view *v = k->views + i;
        double light[3], eye[3], length = 0, cosine = 0;
        if (v->flooded || v->lit < HULL__LEAST) continue;
        hull__toward(&v->frame->light, middle, light);
        for (int c = 0; c < 3; c++) eye[c] = v->eye[c] - middle[c], length += eye[c] * eye[c];
        for (int c = 0; c < 3; c++) eye[c] /= sqrt(length) + 1e-30, cosine += eye[c] * light[c];
        term[known][0] = 1, term[known][1] = cosine, term[known][2] = cosine * cosine;
        for (int c = 0; c < 3; c++) term[known][3 + c] = light[c], term[known][6 + c] = eye[c];
        value[known++] = v->gain;
    }
    for (int i = 0; i < 3 && known >= few[i]; i++)
        least = fmin(least, hull__spread((const double(*)[HULL__TERMS])term, value, known, terms[i],
                                         value + n, value + 2 * n));
    free(term);
    if (known < few[0]) return hull__cannot(k, "too few are lit from the camera's side");
    if (least >
        0.28 + 3.5 / known) /* right captures reach 0.85 of that where few are known, else two thirds */
        hull__say(k,
                  "brightness differs from photograph to photograph more than views and lights explain, by a "
                  "factor of %.1f or so: exposures, cameras or lamps that pl_intensity does not tell apart? "
                  "Tell it, or train with --refine, which fits it",
                  exp(2 * least));
    return 0;
}

/* Notes where half-transparent pixels have not the colour to which the opaque ones beside them lead, but that
   mixed with a background by alpha, as stored or as light. Black is premultiplied alpha, which the trainer
   notes. */
static int hull__edges(hull *k) {
    const int count = k->edge_count, light = k->numbers > 0;
    double *values = (double *)malloc((size_t)(count + 1) * sizeof *values);
    int told = count < 50;
    if (!values) return 1;
    for (int decodes = 0; decodes < 2 - light && !told; decodes++) {
        double straight = 0, mixed = 0, behind[3];
        for (int c = 0; c < 3; c++) {
            for (int i = 0; i < 2 * count; i++) {
                const hull__edge *e = k->edges + i % count;
                double v = (double)e->value[c], lead = (double)e->beside[c];
                const double a = (double)e->alpha;
                if (decodes)
                    v = (double)ssdgs_srgb_decode((ssdgs_real)v),
                    lead = (double)ssdgs_srgb_decode((ssdgs_real)lead);
                if (i < count) values[i] = (v - a * lead) / (1 - a);
                if (i == count) behind[c] = fmin(1, fmax(0, hull__quantile(values, count, 0.5)));
                if (i < count) continue;
                straight += fabs(v - lead);
                mixed += fabs(v - a * lead - (1 - a) * behind[c]);
            }
        }
        const double most = fmax(behind[0], fmax(behind[1], behind[2])),
                     least = fmin(behind[0], fmin(behind[1], behind[2]));
        if (mixed > 0.5 * straight || most < 0.15) continue;
        told = 1;
        hull__say(
            k,
            "half-transparent pixels' colours lead towards %s (%.2f,%.2f,%.2f): the background that the "
            "object was cut from is left in them, and shows as a rim. Let the program that cuts it out "
            "remove the background's colour (decontaminate, defringe), or make the edges opaque or clear",
            least > 0.75 ? "white" : "one colour", behind[0], behind[1], behind[2]);
    }
    free(values);
    return 0;
}

/* How light grows with what is due, by powers: 1 is light, 0.45 or so are numbers encoded as sRGB. 1 where
   too little is known. */
static double hull__power(const hull *k) {
    const int points = k->point_count;
    double square = 0, product = 0;
    int photos = 0;
    for (int i = 0; i < k->set->count; i++) {
        const hull__view *v = k->views + i;
        double mean = 0;
        if (v->lit < HULL__LEAST || v->flooded) continue;
        photos++;
        for (int j = 0; j < points; j++)
            if (k->kind[i * points + j] == HULL__LIT) mean += (double)k->due[i * points + j] / v->lit;
        for (int j = 0; j < points; j++) {
            if (k->kind[i * points + j] != HULL__LIT) continue;
            const double x = (double)k->due[i * points + j] - mean,
                         off = (double)k->ratio[i * points + j] - k->points[j].albedo - v->gain;
            square += x * x;
            product += x * fmin(1, fmax(-1, off));
        }
    }
    return photos < HULL__FEW || !(square > 0) ? 1 : 1 + product / square;
}

/* Asks where no number in OpenEXR photographs exceeds 1, and they end there, are bytes, or grow too slowly
   with light. */
static void hull__numbers(const hull *k) {
    if (!k->numbers || k->most > 1.0005) return;
    if (k->full * 2000 > k->numbers || k->on_grid * 2 > k->above || hull__power(k) < 0.8)
        hull__say(k,
                  "no number in the OpenEXR photographs exceeds 1: are they made from PNG, or encoded? They "
                  "must hold linear light (darktable: output profile \"linear Rec709 RGB\", LIN_REC709)");
}

/* The share of what a photograph shows that lies beside the bounds' picture. */
static double hull__beside(const hull *k, const hull__view *v) {
    const ssdgs_camera *camera = &v->frame->camera;
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30}, shown = 0, beside = 0;
    for (int corner = 0; corner < 8; corner++) {
        double seen[3];
        for (int r = 0; r < 3; r++) {
            seen[r] = (double)camera->view[4 * r + 3];
            for (int c = 0; c < 3; c++)
                seen[r] += (double)camera->view[4 * r + c] *
                           (k->low[c] + (corner >> c & 1 ? (double)HULL__GRID * k->cell[c] : 0));
        }
        if (!(seen[2] > 0)) return 0; /* reaching behind the camera it may be anywhere */
        for (int c = 0; c < 2; c++) {
            const double at = ((double)(c ? camera->fy : camera->fx) * seen[c] / seen[2] +
                               (double)(c ? camera->cy : camera->cx)) /
                              v->step;
            low[c] = fmin(low[c], at), high[c] = fmax(high[c], at);
        }
    }
    for (int y = 0; y < v->height; y++)
        for (int x = 0; x < v->width; x++) {
            const double alpha = (double)v->alpha[y * v->width + x];
            shown += alpha;
            beside += x + 1 < low[0] || x > high[0] || y + 1 < low[1] || y > high[1] ? alpha : 0;
        }
    return shown > 0 ? beside / shown : 0;
}

/* Finds the hull and what the photographs show of it, and judges that. */
static int hull__hull(hull *k) {
    const int n = k->set->count;
    int box[2][3];
    double toward[3] = {0, 0, 0};
    double beside = 0;
    for (int i = 0; i < n; i++) {
        k->usable += k->views[i].outlined;
        beside += k->views[i].outlined ? hull__beside(k, k->views + i) : 0;
    }
    if (k->usable < HULL__FEW) {
        char why[80];
        snprintf(why, sizeof why, "that takes %d photographs that show outlines, and %d do", HULL__FEW,
                 k->usable);
        return hull__cannot(k, why);
    }
    if (beside > 0.05 * k->usable)
        return hull__cannot(k, "bounds_min .. bounds_max do not hold what the photographs show");
    for (int level = 0; level < 2; level++) { /* coarsely, then what is left more finely */
        if (hull__carve(k, box) < 30)
            return hull__cannot(k, "the outlines leave nothing of bounds_min .. bounds_max");
        for (int c = 0; c < 3 && !level; c++) {
            const int first = box[0][c] > 0 ? box[0][c] - 1 : 0,
                      last = box[1][c] < HULL__GRID - 1 ? box[1][c] + 1 : HULL__GRID - 1;
            k->low[c] += first * k->cell[c];
            k->cell[c] *= (last + 1 - first) / (double)HULL__GRID;
        }
    }
    for (int i = 0; i < n; i++) {
        double to[3], length = 0;
        for (int c = 0; c < 3; c++)
            to[c] = k->views[i].eye[c] - k->low[c] - HULL__GRID / 2 * k->cell[c], length += to[c] * to[c];
        for (int c = 0; c < 3; c++) toward[c] += to[c] / (sqrt(length) + 1e-30) / n;
    }
    if (toward[0] * toward[0] + toward[1] * toward[1] + toward[2] * toward[2] > 0.8)
        return hull__cannot(k, "all are taken from one side");
    hull__place_points(k);
    const size_t size = (size_t)n * (size_t)k->point_count;
    k->ratio = (float *)malloc((size + 1) * sizeof *k->ratio);
    k->due = (float *)malloc((size + 1) * sizeof *k->due);
    k->kind = (unsigned char *)calloc(size + 1, 1);
    if (!k->ratio || !k->due || !k->kind) return 1;
    for (int i = 0; i < n; i++)
        if (k->views[i].outlined) hull__look(k, i);
    hull__fit(k);
    if (hull__flooded(k)) return 1;
    const int failed = !k->flooded && hull__exposures(k);
    return failed;
}

/* Writes a note to the logger for each thing that is wrong, and where that cannot be known. options: the
   bounds. 1: out of memory. */
OLAT__API int hull_judge(const olat_dataset *set, const ssdgs_train_options *options,
                         const ssdgs_logger *logger) {
    hull k;
    size_t cells = 0, at = 0;
    memset(&k, 0, sizeof k);
    k.set = set;
    k.logger = logger;
    k.views = (hull__view *)calloc((size_t)set->count, sizeof *k.views);
    k.curve = (float *)malloc(65536 * sizeof *k.curve);
    k.edges = (hull__edge *)malloc(HULL__EDGES * sizeof *k.edges);
    k.hull = (unsigned char *)malloc(HULL__GRID * HULL__GRID * HULL__GRID);
    k.points = (hull__point *)malloc((HULL__POINTS + 1) * sizeof *k.points);
    int failed = !k.views || !k.curve || !k.edges || !k.hull || !k.points;
    for (int i = 0; i < 65536 && !failed; i++) k.curve[i] = (float)ssdgs_srgb_decode((ssdgs_real)i / 65535);
    for (int i = 0; i < set->count && !failed; i++) {
        hull__view *v = k.views + i;
        v->frame = set->frames + i;
        const int w = v->frame->camera.width, h = v->frame->camera.height;
        v->step = ((w > h ? w : h) + HULL__SIDE - 1) / HULL__SIDE;
        v->width = (w + v->step - 1) / v->step;
        v->height = (h + v->step - 1) / v->step;
        cells += 2 * (size_t)v->width * (size_t)v->height;
    }
    if (!failed) k.cells = (float *)calloc(cells, sizeof *k.cells);
    failed = failed || !k.cells;
    for (int i = 0; i < set->count && !failed; i++) {
        hull__view *v = k.views + i;
        v->light = k.cells + at;
        v->alpha = v->light + v->width * v->height;
        at += 2 * (size_t)v->width * (size_t)v->height;
        hull__read(&k, v);
    }
    for (int c = 0; c < 3; c++)
        k.low[c] = (double)options->bounds_min[c],
        k.cell[c] = ((double)options->bounds_max[c] - k.low[c]) / (double)HULL__GRID;
    if (!failed) failed = hull__hull(&k) || hull__edges(&k);
    if (!failed) hull__numbers(&k);
    free(k.views), free(k.curve), free(k.edges), free(k.hull), free(k.points), free(k.cells), free(k.ratio),
        free(k.due), free(k.kind);
    return failed;
}
#endif
