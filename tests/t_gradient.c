/* The whole backward pass against central differences of the whole forward pass, in double, for the options
   the golden files do not reach; and identities that need no oracle. */
#ifndef SSDGS_REAL64
#define SSDGS_REAL64
#endif
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

#define COUNT 24
#define SIDE 20
static ssdgs_context *context;

typedef struct scene {
    const char *name;
    ssdgs_settings settings;
    ssdgs_render_options options;
    ssdgs_light lights[2];
    int light_count, wall;
    int shine; /* ambient light on highlights: of these c_s alone learns from it */
    int given; /* pixels' visibility comes from elsewhere */
} scene;

static double draw(uint64_t counter) { return ssdgs__uniform(77, counter); }

/* Soft, small splats spread in depth: smooth almost everywhere. */
static void fill(ssdgs_model *model) {
    ssdgs_model_view v = ssdgs_model_arrays(model);
    uint64_t at = 0;
    for (size_t i = 0; i < COUNT; i++) {
        ssdgs_real *p = v.gaussians + i;
        for (int c = 0; c < SSDGS_CHANNELS; c++) p[(size_t)c * v.stride] = 2 * draw(at++) - 1;
        for (int c = 0; c < 3; c++) {
            p[(size_t)(SSDGS_POSITION + c) * v.stride] *= 0.4;
            p[(size_t)(SSDGS_LOG_SCALE + c) * v.stride] = -2.2 + 0.5 * draw(at++);
        }
    }
    for (size_t i = 0; i < model->global_count; i++) model->globals[i] += 0.3 * (2 * draw(at++) - 1);
}

/* One Gaussian behind the others, so wide and opaque that its alpha reaches its bound in some pixels. */
static void build_wall(ssdgs_model *model) {
    for (int c = 0; c < 3; c++) {
        model->gaussians[(size_t)(SSDGS_POSITION + c) * model->capacity] = c == 1 ? 0.4 : 0;
        model->gaussians[(size_t)(SSDGS_LOG_SCALE + c) * model->capacity] = c == 1 ? -2 : 1;
    }
    model->gaussians[SSDGS_OPACITY * model->capacity] = 12;
}

/* A frame's views from the lights with maps of their own, which other frames can hold. */
static void keep_maps(const ssdgs_frame *frame, ssdgs_splat_view *views) {
    for (int i = 1; i < frame->view_count; i++) {
        const ssdgs_splat_view *from = frame->views + i;
        const size_t tiles = (size_t)from->tiles_x * (size_t)from->tiles_y;
        size_t used = 0;
        views[i] = *from;
        if (!from->light_map) continue;
        for (size_t t = 0; t < tiles; t++) used += from->map_tile[t] != UINT32_MAX;
        views[i].map_tile = (uint32_t *)malloc(tiles * sizeof(uint32_t));
        views[i].light_map = (ssdgs_light_pixel *)malloc((used + 1) * 256 * sizeof(ssdgs_light_pixel));
        memcpy(views[i].map_tile, from->map_tile, tiles * sizeof(uint32_t));
        memcpy(views[i].light_map, from->light_map, used * 256 * sizeof(ssdgs_light_pixel));
    }
}

/* A smooth objective of the image, deferred also of the blended normals and their alpha: the product with
   fixed weights. */
static double objective(const scene *s, ssdgs_model *model, const ssdgs_camera *camera,
                        const ssdgs_light *lights, const ssdgs_frame *fixed, ssdgs_frame *frame,
                        int backward) {
    const size_t pixels = SIDE * SIDE, n = COUNT * (size_t)s->light_count;
    static ssdgs_real normal_gradient[4 * SIDE * SIDE];
    double sum = 0;
    if (ssdgs__frame_of_model(frame, model, camera, lights, s->light_count, &s->options, 0, 1)) exit(1);
    if (ssdgs__run_stages(frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK)) exit(1);
    if (fixed) { /* the Gaussians' visibility, depth cue, flux and the lights' maps are held fixed */
        if (frame->flux) memcpy(frame->flux, fixed->flux, n * sizeof(ssdgs_real));
        memcpy(frame->visibility, fixed->visibility, n * sizeof(ssdgs_real));
        if (frame->depth_cue) memcpy(frame->depth_cue, fixed->depth_cue, n * sizeof(ssdgs_real));
        for (int i = 1; i < frame->view_count; i++) frame->views[i] = fixed->views[i];
    }
    frame->visibility_given = s->given;
    for (size_t i = 0; i < pixels * (size_t)s->light_count && s->given; i++)
        frame->pixel_visibility[i] = 0.5 + 0.6 * sin(0.7 * (double)i);
    for (size_t i = 0; i < COUNT; i++) frame->seen[i] = 1;
    if (ssdgs__run_stages(frame, SSDGS_STAGE_SHADE, SSDGS_STAGE_COMPOSITE)) exit(1);
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < pixels; i++) {
            const double weight = sin(0.37 * (double)i + 1.3 * (double)c);
            sum +=
                weight * (frame->pixels[pixels * c + i] + frame->transmittance[i] * s->options.background[c]);
            frame->pixel_gradient[pixels * c + i] = weight;
            frame->pixel_gradient[pixels * 3 + i] =
                (c ? frame->pixel_gradient[pixels * 3 + i] : 0) + weight * s->options.background[c];
        }
    frame->normal_gradient = frame->layer_count ? normal_gradient : NULL;
    for (size_t c = 0; frame->layer_count && c < 4; c++) {
        const ssdgs_real *plane =
            c < 3 ? ssdgs__layer_plane(frame, 4, (int)c) : ssdgs__layer_plane(frame, 3, 2);
        for (size_t i = 0; i < pixels; i++) {
            normal_gradient[pixels * c + i] = 0.3 * sin(0.29 * (double)i + 0.9 * (double)c + 2);
            sum += normal_gradient[pixels * c + i] * plane[i];
        }
    }
    if (backward && ssdgs__run_stages(frame, SSDGS_STAGE_COMPOSITE_BACKWARD, SSDGS_STAGE_PROJECT_BACKWARD))
        exit(1);
    return sum;
}

/* Central differences at two steps: where they disagree a fold (alpha's threshold, ReLU, the sort) lies
   between, and the entry is skipped; few may be. */
typedef struct tally {
    double norm, error;
    int tried, skipped;
} tally;

static const double steps[4] = {2e-6, -2e-6, 1e-6, -1e-6};

static void tell(const double side[4], double analytic, tally *t) {
    const double coarse = (side[0] - side[1]) / (steps[0] - steps[1]),
                 fine = (side[2] - side[3]) / (steps[2] - steps[3]);
    t->tried++;
    if (fabs(coarse - fine) > 1e-5 * (fabs(fine) + 1e-3)) {
        t->skipped++;
        return;
    }
    t->error += (fine - analytic) * (fine - analytic);
    t->norm += fine * fine;
}

static void compare(const scene *s, ssdgs_model *model, ssdgs_camera *camera, ssdgs_light *lights,
                    const ssdgs_frame *fixed, ssdgs_real *value, double analytic, tally *t) {
    const double start = *value;
    double side[4];
    for (int i = 0; i < 4; i++) {
        *value = start + steps[i];
        ssdgs_frame frame;
        side[i] = objective(s, model, camera, lights, fixed, &frame, 0);
    }
    *value = start;
    tell(side, analytic, t);
}

static void finish(const scene *s, const char *group, const tally *t) {
    const int ok = t->error <= 1e-10 * t->norm + 1e-16 * t->tried && t->skipped <= t->tried / 10 + 1;
    if (!CHECK(ok))
        printf("    %s, %s: relative error %.3g, norm %.3g, %d of %d skipped\n", s->name, group,
               sqrt(t->error / (t->norm + 1e-300)), sqrt(t->norm), t->skipped, t->tried);
}

static void run(const scene *s) {
    static const ssdgs_real eye[3] = {0.3, -1.9, 0.4}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7, SIDE, SIDE);
    ssdgs_light lights[2];
    ssdgs_model *model = NULL;
    memcpy(lights, s->lights, sizeof lights);
    if (!CHECK(!ssdgs_model_create(context, &s->settings, COUNT, &model))) exit(1);
    fill(model);
    if (s->wall) build_wall(model);
    const size_t stride = model->capacity;
    ssdgs_frame frame;
    objective(s, model, &camera, lights, NULL, &frame, 1);
    ssdgs_real *gradient = (ssdgs_real *)malloc(stride * SSDGS_CHANNELS * sizeof *gradient);
    ssdgs_real *global_gradient = (ssdgs_real *)malloc(model->global_count * sizeof *gradient);
    ssdgs_real *visibility = (ssdgs_real *)malloc(COUNT * 2 * sizeof *visibility);
    ssdgs_real *cue = (ssdgs_real *)malloc(COUNT * 2 * sizeof *cue);
    ssdgs_real *flux = (ssdgs_real *)malloc(COUNT * 2 * sizeof *flux);
    memcpy(gradient, frame.gradient, stride * SSDGS_CHANNELS * sizeof *gradient);
    memcpy(global_gradient, frame.global_gradient, model->global_count * sizeof *gradient);
    memcpy(visibility, frame.visibility, COUNT * (size_t)s->light_count * sizeof *visibility);
    if (frame.depth_cue) memcpy(cue, frame.depth_cue, COUNT * (size_t)s->light_count * sizeof *cue);
    if (frame.flux) memcpy(flux, frame.flux, COUNT * (size_t)s->light_count * sizeof *flux);
    ssdgs_frame fixed = frame;
    fixed.flux = flux;
    fixed.visibility = visibility;
    ssdgs_splat_view views[1 + 2 * 6];
    keep_maps(&frame, views);
    fixed.views = views;
    fixed.depth_cue = cue;
    ssdgs_photo photo;
    memset(&photo, 0, sizeof photo);
    photo.camera = camera;
    double value[10];
    memset(value, 0, sizeof value);
    double pose[6];
    ssdgs__correct_backward(&photo, value, frame.view_gradient, pose);
    double light_gradient[3];
    double ambient_gradient[3];
    for (int c = 0; c < 3; c++) {
        light_gradient[c] = frame.light_gradient[c];
        ambient_gradient[c] = frame.ambient_gradient[c];
    }
    for (int i = 0; i < COUNT; i++) { /* gradient . q = 0 for both rotations */
        double dot = 0, dot2 = 0;
        for (int c = 0; c < 4; c++) {
            dot += gradient[(size_t)(SSDGS_ROTATION + c) * stride + (size_t)i] *
                   model->gaussians[(size_t)(SSDGS_ROTATION + c) * stride + (size_t)i];
            dot2 += gradient[(size_t)(SSDGS_FRAME + c) * stride + (size_t)i] *
                    model->gaussians[(size_t)(SSDGS_FRAME + c) * stride + (size_t)i];
        }
        CHECK(fabs(dot) < 1e-12 && fabs(dot2) < 1e-12);
    }
    for (int group = 0; group < SSDGS__PLANE_GROUPS; group++) {
        tally t = {0, 0, 0, 0};
        if (s->settings.transport && group == SSDGS__G_POSITION) continue;
        if (s->shine && group != SSDGS__G_SPECULAR) continue;
        for (int i = 0; i < COUNT; i += 2)
            for (int c = ssdgs__group_plane[group]; c < ssdgs__group_plane[group + 1]; c++)
                compare(s, model, &camera, lights, &fixed, model->gaussians + (size_t)c * stride + (size_t)i,
                        gradient[(size_t)c * stride + (size_t)i], &t);
        finish(s, ssdgs__group_names[group], &t);
    }
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&s->settings, first);
    for (int group = 0; group < SSDGS__GLOBAL_GROUPS && !s->shine; group++) {
        tally t = {0, 0, 0, 0};
        const size_t step = (first[group + 1] - first[group]) / 40 + 1;
        for (size_t at = first[group]; at < first[group + 1]; at += step)
            compare(s, model, &camera, lights, &fixed, model->globals + at, global_gradient[at], &t);
        if (t.tried) finish(s, ssdgs__group_names[SSDGS__PLANE_GROUPS + group], &t);
    }
    {
        tally t = {0, 0, 0, 0};
        for (int c = 0; c < 3 && lights[0].kind != SSDGS_LIGHT_DIRECTIONAL && !s->settings.transport; c++)
            compare(s, model, &camera, lights, &fixed, lights[0].position + c, light_gradient[c], &t);
        for (int c = 0; c < 3 && lights[0].kind == SSDGS_LIGHT_DIRECTIONAL; c++) { /* stays a unit vector */
            double move[10] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, side[4];
            photo.light = s->lights[0];
            for (int i = 0; i < 4; i++) {
                move[6 + c] = steps[i];
                ssdgs_camera still;
                ssdgs__correct(&photo, move, &still, lights);
                CHECK(fabs(lights[0].direction[0] * lights[0].direction[0] +
                           lights[0].direction[1] * lights[0].direction[1] +
                           lights[0].direction[2] * lights[0].direction[2] - 1) < 1e-14);
                ssdgs_frame moved;
                side[i] = objective(s, model, &camera, lights, &fixed, &moved, 0);
            }
            lights[0] = s->lights[0];
            tell(side, light_gradient[c], &t);
        }
        if (t.tried) finish(s, "light", &t);
    }
    { /* ambient light, which its bound of 0 leaves */
        tally t = {0, 0, 0, 0};
        scene lit = *s;
        for (int c = 0; c < 3 && frame.objects->sky_share; c++)
            compare(&lit, model, &camera, lights, &fixed, lit.options.ambient[0] + c, ambient_gradient[c],
                    &t);
        if (t.tried) finish(s, "ambient light", &t);
    }
    if (!s->shine) { /* the pose, at a correction that is not zero */
        tally t = {0, 0, 0, 0};
        ssdgs_light lamp;
        ssdgs_camera moved;
        double at[10] = {0.012, -0.02, 0.03, 0.2, -0.1, 0.15, 0, 0, 0, 0};
        ssdgs__correct(&photo, at, &moved, &lamp);
        objective(s, model, &moved, lights, &fixed, &frame, 1);
        ssdgs__correct_backward(&photo, at, frame.view_gradient, pose);
        for (int c = 0; c < 6; c++) {
            const double start = at[c];
            double side[4];
            for (int i = 0; i < 4; i++) {
                at[c] = start + steps[i];
                ssdgs__correct(&photo, at, &moved, &lamp);
                side[i] = objective(s, model, &moved, lights, &fixed, &frame, 0);
            }
            at[c] = start;
            tell(side, pose[c], &t);
        }
        finish(s, "pose", &t);
    }
    free(gradient);
    free(global_gradient);
    free(visibility);
    for (int i = 1; i < fixed.view_count; i++)
        if (views[i].light_map) {
            free(views[i].light_map);
            free(views[i].map_tile);
        }
    free(cue);
    free(flux);
    ssdgs_model_destroy(model);
}

/* The left Jacobian and the exponential stay continuous where the series takes over. */
static void test_rotation(void) {
    for (int i = 0; i < 40; i++) {
        const double angle = i < 20 ? pow(10, -i) : 0.0316 + 1e-4 * (i - 30);
        double w[3] = {0.6 * angle, 0, 0.8 * angle}, e[9], j[9], trace = 0;
        ssdgs__rotate_by(w, e, j);
        w[0] *= 1 + 1e-9;
        w[2] *= 1 + 1e-9;
        double f[9], k[9];
        ssdgs__rotate_by(w, f, k);
        for (int a = 0; a < 9; a++) CHECK(fabs(e[a] - f[a]) < 1e-8 && fabs(j[a] - k[a]) < 1e-8);
        double product[9];
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                product[3 * a + b] = 0;
                for (int c = 0; c < 3; c++) product[3 * a + b] += e[3 * a + c] * e[3 * b + c];
                CHECK(fabs(product[3 * a + b] - (a == b)) < 1e-12);
            }
        for (int a = 0; a < 3; a++) trace += e[4 * a];
        CHECK(fabs((trace - 1) / 2 - cos(angle)) < 1e-12);
    }
}

/* Shared gradients over many blocks: the whole is the sum of the even Gaussians' and the odd ones', which
   fill other blocks. */
static void test_shared_sums(void) {
    enum { MANY = 64 * 40 + 5 };
    static const ssdgs_real eye[3] = {0, -2, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7, SIDE, SIDE);
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    ssdgs_light light;
    double difference = 0, norm = 0;
    memset(&light, 0, sizeof light);
    settings.scattering.width = 16;
    settings.light_map.size = 64;
    for (int c = 0; c < 3; c++) light.position[c] = light.intensity[c] = 1 + c;
    if (!CHECK(!ssdgs_model_create(context, &settings, MANY, &model))) exit(1);
    double *sum = (double *)calloc(model->global_count, sizeof *sum);
    for (size_t i = 0; i < MANY; i++)
        for (int c = 0; c < SSDGS_CHANNELS; c++)
            model->gaussians[(size_t)c * model->capacity + i] =
                (c < 3 ? 0.4 : 1) * (2 * draw(i * 40 + (size_t)c) - 1);
    ssdgs_frame frame;
    for (int part = 0; part < 3; part++) {
        if (ssdgs__frame_of_model(&frame, model, &camera, &light, 1, NULL, 0, 1)) exit(1);
        if (ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK)) exit(1);
        for (size_t i = 0; i < MANY; i++) frame.seen[i] = part == 2 || (int)(i & 1) == part;
        if (ssdgs_stage_cpu(&frame, SSDGS_STAGE_SHADE)) exit(1);
        for (size_t i = 0; i < 4 * MANY; i++) frame.color_gradient[i] = draw(i) - 0.5;
        for (size_t i = 0; i < 4 * MANY * (size_t)frame.layer_count; i++)
            frame.layer_gradient[i] = draw(4 * MANY + i) - 0.5;
        memset(frame.global_gradient, 0, model->global_count * sizeof *frame.global_gradient);
        if (ssdgs_stage_cpu(&frame, SSDGS_STAGE_SHADE_BACKWARD)) exit(1);
        for (size_t i = 0; i < model->global_count; i++)
            sum[i] += (part == 2 ? -1 : 1) * frame.global_gradient[i];
    }
    for (size_t i = 0; i < model->global_count; i++) {
        difference += sum[i] * sum[i];
        norm += frame.global_gradient[i] * frame.global_gradient[i];
    }
    CHECK(norm > 0 && difference < 1e-20 * norm);
    free(sum);
    ssdgs_model_destroy(model);
}

/* To move all Gaussians is to move the camera the other way; there are enough of them for several tasks. */
static void test_moved_camera(void) {
    enum { MANY = 2500 };
    static const ssdgs_real eye[3] = {0.3, -1.9, 0.4}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7, SIDE, SIDE);
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, NULL, MANY, &model))) exit(1);
    for (size_t i = 0; i < MANY; i++)
        for (int c = 0; c < 3; c++) {
            model->gaussians[(size_t)(SSDGS_POSITION + c) * model->capacity + i] =
                0.8 * draw(3 * i + (size_t)c) - 0.4;
            model->gaussians[(size_t)(SSDGS_LOG_SCALE + c) * model->capacity + i] =
                -3 - draw(10000 + 3 * i + (size_t)c);
        }
    ssdgs_frame frame;
    if (ssdgs__frame_of_model(&frame, model, &camera, NULL, 0, NULL, 0, 1)) exit(1);
    if (ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_SHADE)) exit(1);
    for (size_t i = 0; i < 4 * MANY; i++) frame.color[i] = draw(20000 + i);
    if (ssdgs_stage_cpu(&frame, SSDGS_STAGE_COMPOSITE)) exit(1);
    for (size_t i = 0; i < 4 * SIDE * SIDE; i++) frame.pixel_gradient[i] = draw(40000 + i) - 0.5;
    if (ssdgs__run_stages(&frame, SSDGS_STAGE_COMPOSITE_BACKWARD, SSDGS_STAGE_PROJECT_BACKWARD)) exit(1);
    for (int c = 0; c < 3; c++) {
        double moved = 0, camera_moved = 0;
        for (size_t i = 0; i < MANY; i++)
            moved += frame.gradient[(size_t)(SSDGS_POSITION + c) * frame.gaussians.stride + i];
        for (int j = 0; j < 3; j++) camera_moved += camera.view[4 * j + c] * frame.view_gradient[4 * j + 3];
        CHECK(fabs(moved) > 0.1 && fabs(moved - camera_moved) < 1e-10 * fabs(moved));
    }
    ssdgs_model_destroy(model);
}

/* Where formulas have no value: an empty footprint's visibility, the half vector of opposite directions, the
   logits of 0 and 1. */
static void test_edges(void) {
    static const ssdgs_real eye[3] = {0, -2, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7, SIDE, SIDE);
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    settings.asg = SSDGS_ASG_GEOMETRIC;
    ssdgs_light light;
    memset(&light, 0, sizeof light);
    light.position[1] = 2;
    for (int c = 0; c < 3; c++) light.intensity[c] = 1;
    if (!CHECK(!ssdgs_model_create(context, &settings, 2, &model))) exit(1);
    ssdgs_model_view v = ssdgs_model_arrays(model);
    v.gaussians[SSDGS_OPACITY * v.stride] =
        -8; /* too faint for the light's map: nothing is known to be in its way */
    memset(v.shadow, 0, v.shadow_count * sizeof *v.shadow);
    ssdgs_frame frame;
    if (ssdgs__frame_of_model(&frame, model, &camera, &light, 1, NULL, 1, 1)) exit(1);
    if (ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK)) exit(1);
    CHECK(frame.visibility[0] == 1);
    for (int i = 0; i < 2; i++) {
        frame.seen[i] = 1;
        frame.visibility[i] = i;
    }
    if (ssdgs_stage_cpu(&frame, SSDGS_STAGE_SHADE)) exit(1);
    for (int i = 0; i < 8; i++) frame.color_gradient[i] = 1;
    memset(frame.view_gradient, 0, sizeof frame.view_gradient);
    if (ssdgs_stage_cpu(&frame, SSDGS_STAGE_SHADE_BACKWARD)) exit(1);
    for (int i = 0; i < 2; i++) {
        CHECK(fabs(frame.shadow[4 * i] - (i ? 0.99 : 0.01)) < 1e-12);
        for (int c = 0; c < 3; c++) CHECK(frame.specular[4 * i + c] == 0);
        for (int j = 0; j < 8; j++)
            CHECK(frame.gradient[(size_t)(SSDGS_ASG_WEIGHT + j) * frame.gaussians.stride + (size_t)i] == 0);
    }
    ssdgs_model_destroy(model);
}

/* Deferred lobes get neither sharper nor broader than the bound, so what lies beyond it has no gradient:
   neither through their tensor nor through their height. */
static void test_sharpest(void) {
    static ssdgs_real gauss[SSDGS_CHANNELS * SSDGS__BLOCK], dlobe[SSDGS__LOBE * SSDGS__BLOCK],
        dgauss[SSDGS_CHANNELS * SSDGS__BLOCK], rows[SSDGS__ROWS * SSDGS__BLOCK],
        drows[SSDGS__ROWS * SSDGS__BLOCK], lane_sums[SSDGS__LANE_SUMS * 16];
    static const double raw[4] = {-SSDGS__SHARPEST - 1, -1, 1, SSDGS__SHARPEST + 1};
    static ssdgs__lighting lighting;
    lighting.deferred = lighting.specular = lighting.directional = 1;
    lighting.light[2] = lighting.eye[2] = 1;
    for (int s = 0; s < SSDGS__BLOCK; s++) {
        gauss[SSDGS_FRAME * SSDGS__BLOCK + s] = 1;
        for (int i = 0; i < 2; i++) gauss[(SSDGS_ASG_WEIGHT + i) * SSDGS__BLOCK + s] = raw[(s >> 2 * i) % 4];
        for (int i = 0; i < SSDGS__LOBE; i++) dlobe[i * SSDGS__BLOCK + s] = 1;
        drows[SSDGS__GLOSS * SSDGS__BLOCK + s] = 1;
    }
    for (int height = 0; height < 2; height++) {
        memset(dgauss, 0, sizeof dgauss);
        if (!height) context->k->lobe_backward(gauss, dlobe, dgauss);
        else {
            context->k->reflect(&lighting, gauss, rows);
            context->k->reflect_backward(&lighting, gauss, drows, dgauss, lane_sums);
        }
        for (int s = 0; s < SSDGS__BLOCK; s++) {
            double sum = 0;
            for (int i = 0; i < 2; i++)
                sum += fmax(-SSDGS__SHARPEST, fmin(SSDGS__SHARPEST, raw[(s >> 2 * i) % 4])) / 2;
            if (height) {
                CHECK(fabs(rows[SSDGS__GLOSS * SSDGS__BLOCK + s] - exp(sum)) < 1e-14 * exp(sum));
                CHECK(fabs(ssdgs__lobe_height(gauss + SSDGS_ASG_WEIGHT * SSDGS__BLOCK + s, SSDGS__BLOCK) -
                           exp(sum)) < 1e-14 * exp(sum));
            }
            for (int i = 0; i < 2; i++) {
                const double d = dgauss[(SSDGS_ASG_WEIGHT + i) * SSDGS__BLOCK + s],
                             at = raw[(s >> 2 * i) % 4];
                const double want = fabs(at) > SSDGS__SHARPEST ? 0 : height ? exp(sum) / 2 : exp(at);
                CHECK(fabs(d - want) <= 1e-14 * (1 + want));
            }
        }
    }
}

/* Blended layers of tiles without a Gaussian are 0 whatever the frame before left there: normals beside them
   read their depth. */
static void test_empty_tiles(void) {
    enum { WIDE = 64 };
    static const ssdgs_real eye[3] = {0, -2, 0}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7, WIDE, WIDE);
    const ssdgs_settings settings = ssdgs_settings_default();
    const ssdgs_render_options options = ssdgs_render_options_exact();
    ssdgs_light light;
    ssdgs_model *model = NULL;
    memset(&light, 0, sizeof light);
    light.position[0] = light.intensity[0] = light.intensity[1] = light.intensity[2] = 2;
    if (!CHECK(!ssdgs_model_create(context, &settings, 1, &model))) exit(1);
    for (size_t i = 0; i < 3; i++) model->gaussians[(SSDGS_LOG_SCALE + i) * model->capacity] = -4;
    for (int training = 0; training < 2; training++) { /* which keeps two layers */
        ssdgs_frame frame;
        int blended = 0, left = 0;
        if (ssdgs__frame_of_model(&frame, model, &camera, &light, 1, &options, !training, training)) exit(1);
        const size_t count = (size_t)(3 * (training ? 2 : 1 + frame.layer_count)) * WIDE * WIDE;
        for (size_t i = 0; i < count; i++) frame.layer_pixels[i] = 0.7;
        if (ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_COMPOSITE)) exit(1);
        for (size_t i = 0; i < count; i++)
            left += frame.layer_pixels[i] == 0.7, blended += frame.layer_pixels[i] > 0;
        CHECK(!left && blended > 0 && blended < (int)count / 4);
    }
    ssdgs_model_destroy(model);
}

/* A photograph with transparency on a background: the gradient goes through the blending of stored values,
   and stops where a bright rendering meets a photograph's 1. */
static void test_photo(int transfer, double intensity) {
    static const ssdgs_real eye[3] = {0.3, -1.9, 0.4}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1},
                            background[3] = {0.7, 0.2, 0.5};
    static const int frozen[2] = {1, 1};
    static unsigned char pixels[SIDE * SIDE * 4];
    ssdgs_settings settings = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    tally t = {0, 0, 0, 0};
    settings.transfer = transfer;
    ssdgs_photo photo;
    memset(&photo, 0, sizeof photo);
    photo.camera = ssdgs_camera_look_at(eye, target, up, 0.7, SIDE, SIDE);
    photo.light.position[0] = photo.light.position[1] = -2;
    photo.light.intensity[0] = photo.light.intensity[1] = photo.light.intensity[2] = intensity;
    photo.pixels = pixels;
    for (size_t i = 0; i < sizeof pixels; i++)
        pixels[i] = (unsigned char)(intensity > 9 && i / 4 % 3 ? 255 : 255.9 * draw(7000 + i));
    if (!CHECK(!ssdgs_model_create(context, &settings, COUNT, &model))) exit(1);
    fill(model);
    const size_t stride = model->capacity;
    ssdgs__loss_values values;
    ssdgs_frame frame;
    const ssdgs__photo_job shot = {
        &photo, &photo.camera, &photo.light, background, SSDGS_DIFFUSE_TERM, {frozen[0], frozen[1]}, 0.2, 0,
        1,      NULL};
    if (ssdgs__photo_backward(&frame, model, &shot, &values)) exit(1);
    ssdgs_real gradient[COUNT * SSDGS_CHANNELS];
    for (size_t i = 0; i < SSDGS_CHANNELS * COUNT; i++)
        gradient[i] = frame.gradient[i / COUNT * stride + i % COUNT];
    for (size_t i = 0; i < COUNT * SSDGS_SPECULAR; i += 5) { /* geometry, opacity, diffuse colour */
        ssdgs_real *value = model->gaussians + i / COUNT * stride + i % COUNT, start = *value;
        double loss[2];
        for (int side = 0; side < 2; side++) {
            *value = start + (side ? 1e-6 : -1e-6);
            if (ssdgs__photo_backward(&frame, model, &shot, &values)) exit(1);
            loss[side] = values.loss;
        }
        *value = start;
        const double slope = (loss[1] - loss[0]) / 2e-6;
        t.tried++;
        t.norm += slope * slope;
        t.error += (slope - gradient[i]) * (slope - gradient[i]);
    }
    if (!CHECK(t.error < 1e-6 * t.norm && t.norm > 0))
        printf("    transfer %d, intensity %g: relative error %.3g\n", transfer, intensity,
               sqrt(t.error / t.norm));
    ssdgs_model_destroy(model);
}

/* Shadows teach the surfaces that receive them, but not where no network can mend what is wrong in them. */
static void test_receivers(void) {
    static const ssdgs_real eye[3] = {0.3, -1.9, 0.4}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1},
                            background[3] = {0, 0, 0};
    static unsigned char pixels[SIDE * SIDE * 4];
    ssdgs_photo photo;
    memset(&photo, 0, sizeof photo);
    photo.camera = ssdgs_camera_look_at(eye, target, up, 0.7, SIDE, SIDE);
    photo.light.position[0] = photo.light.position[1] = -2;
    photo.light.intensity[0] = photo.light.intensity[1] = photo.light.intensity[2] = 9;
    photo.pixels = pixels;
    memset(pixels, 255, sizeof pixels);
    for (int layers = 0; layers < 2; layers++) {
        ssdgs_real position[3][COUNT]; /* dL/dx as trained, with visibility held fixed, and not */
        ssdgs_settings settings = ssdgs_settings_default();
        ssdgs__loss_values values;
        ssdgs_model *model = NULL;
        ssdgs_frame frame;
        settings.shadow.layers = layers;
        if (!CHECK(!ssdgs_model_create(context, &settings, COUNT, &model))) exit(1);
        fill(model);
        const ssdgs__photo_job shot = {
            &photo, &photo.camera, &photo.light, background, SSDGS_ALL_TERMS, {0, 0}, 0.2, 0, 1, NULL};
        if (ssdgs__photo_backward(&frame, model, &shot, &values)) exit(1);
        for (int way = 0; way < 3; way++) {
            if (way) frame.visibility_given = way == 1;
            if (way &&
                ssdgs__run_stages(&frame, SSDGS_STAGE_COMPOSITE_BACKWARD, SSDGS_STAGE_PROJECT_BACKWARD))
                exit(1);
            memcpy(position[way], frame.gradient, sizeof position[way]);
        }
        CHECK(memcmp(position[1], position[2], sizeof position[1]) != 0);
        CHECK(!memcmp(position[0], position[layers ? 2 : 1], sizeof position[0]));
        ssdgs_model_destroy(model);
    }
}

/* What a rendering looks like on a background is what a photograph of the same colour and alpha looks
   like. */
static void test_compose(void) {
    static const ssdgs_real background[3] = {0.7, 0.2, 0.5}, stored[3] = {0.9, 0.4, 0.02};
    ssdgs_real color[6], alpha[2] = {0.25, 0};
    for (int transfer = 0; transfer < 2; transfer++) {
        for (int c = 0; c < 3; c++) {
            color[c] =
                alpha[0] * (transfer == SSDGS_TRANSFER_SRGB ? ssdgs_srgb_decode(stored[c]) : stored[c]);
            color[3 + c] = 0;
        }
        ssdgs_real out[6];
        ssdgs_compose(color, alpha, 2, transfer, background, out);
        for (int c = 0; c < 3; c++)
            CHECK(fabs(out[c] - (0.25 * stored[c] + 0.75 * background[c])) < 1e-9 &&
                  fabs(out[3 + c] - background[c]) < 1e-15);
    }
}

/* The scattering network's inputs, in their order: x in four octaves, wo in view_octaves, wi in
   light_octaves, n. */
static void test_octaves(void) {
    ssdgs_frame frame;
    ssdgs_placed object;
    int n = 0;
    memset(&frame, 0, sizeof frame);
    memset(&object, 0, sizeof object);
    object.settings = ssdgs_settings_default();
    object.settings.length_unit = 1;
    object.settings.octaves.view = 2;
    object.settings.octaves.light = 1;
    object.terms = SSDGS_SCATTERING_TERM;
    frame.light_count = 1;
    ssdgs__block_layout l = ssdgs__layout(&frame, &object);
    CHECK(l.scattering[0] == 27 + 15 + 9 + 3 + SSDGS_MATERIAL_COUNT + SSDGS__LENGTHS);
    ssdgs_real *gauss =
        (ssdgs_real *)calloc(l.lights + l.light_size + (size_t)l.scattering[0] * SSDGS__BLOCK, sizeof *gauss);
    ssdgs_real *part = gauss + l.lights;
    ssdgs_real *rows = part + l.light_size;
    double want[27 + 15 + 9 + 3];
    for (int i = 0; i < 4; i++) {
        static const int octaves[4] = {4, 2, 1, 0},
                         from[4] = {SSDGS_POSITION, SSDGS__WO, SSDGS__WI, SSDGS__NORMAL};
        for (int c = 0; c < 3; c++)
            (i ? part : gauss)[(from[i] + c) * SSDGS__BLOCK] = want[n++] = 0.2 + 0.3 * i - 0.5 * c;
        for (int k = 0; k < 6 * octaves[i]; k++, n++) {
            const double angle = (0.2 + 0.3 * i - 0.5 * (k % 3)) * (1 << k / 3 % octaves[i]);
            want[n] = k < 3 * octaves[i] ? sin(angle) : cos(angle);
        }
    }
    ssdgs__encode_inputs(context->k, &object.settings, &l, 0, NULL, gauss, part, rows);
    for (int i = 0; i < n; i++) rows[i] = rows[i * SSDGS__BLOCK];
    CHECK_NEAR(rows, want, n, 1e-12, 0, "the scattering network's inputs");
    free(gauss);
}

/* A light nearer to a Gaussian than the least distance: what its length is held at has no gradient. */
static void test_held(void) {
    static ssdgs_real gauss[SSDGS_CHANNELS * SSDGS__BLOCK], rows[SSDGS__ROWS * SSDGS__BLOCK],
        drows[SSDGS__ROWS * SSDGS__BLOCK], dgauss[SSDGS_CHANNELS * SSDGS__BLOCK], sums[SSDGS__LANE_SUMS * 16];
    const ssdgs__kernels *kernels = ssdgs__table(SSDGS_ISA_SCALAR);
    for (int s = 0; s < SSDGS__BLOCK; s++)
        gauss[SSDGS_FRAME * SSDGS__BLOCK + s] = 1, gauss[(SSDGS_FRAME + 2) * SSDGS__BLOCK + s] = 0.9;
    drows[SSDGS__IRRADIANCE * SSDGS__BLOCK] = 1e-6, drows[SSDGS__COSINE * SSDGS__BLOCK] = 1;
    for (int inside = 0; inside < 2; inside++) {
        ssdgs__lighting k;
        memset(&k, 0, sizeof k);
        memset(dgauss, 0, sizeof dgauss);
        k.least_distance2 = 1e-6, k.eye[2] = -2;
        k.light[0] = inside ? 0.3e-3 : 1.2e-3, k.light[1] = inside ? 0.4e-3 : 1.6e-3;
        kernels->reflect_backward(&k, gauss, drows, dgauss, sums);
        for (int c = 0; c < 3; c++) {
            double value[2];
            for (int side = 0; side < 2; side++) {
                gauss[c * SSDGS__BLOCK] = side ? -1e-8 : 1e-8;
                kernels->reflect(&k, gauss, rows);
                value[side] =
                    1e-6 * rows[SSDGS__IRRADIANCE * SSDGS__BLOCK] + rows[SSDGS__COSINE * SSDGS__BLOCK];
            }
            gauss[c * SSDGS__BLOCK] = 0;
            const double want = (value[0] - value[1]) / 2e-8;
            if (!CHECK(fabs(dgauss[c * SSDGS__BLOCK] - want) < 1e-3 + 1e-4 * fabs(want)))
                printf("    inside %d, %d: %g, not %g\n", inside, c, dgauss[c * SSDGS__BLOCK], want);
        }
    }
}

/* Opacity's fade beside a wide picture and near the eye, the whole of it and each of its parts, in every
   parameter and in the camera's: of ln opacity alone, so that nothing else has a part in it. */
static double log_opacity(const ssdgs__projection *k, const ssdgs_real *gaussian) {
    ssdgs_record record;
    ssdgs_real depth;
    context->k->project(k, gaussian, 1, 0, 1, &record, &depth, NULL);
    CHECK(depth > 0);
    return record.log2_opacity * log(2);
}

static void test_fade(void) {
    enum { EACH = 200 };
    int faded[4] = {0, 0, 0, 0};
    double worst = 0;
    for (int i = 0; i < 4 * EACH; i++) { /* near; beside; deep; all of it */
        const int part = i / EACH;
        uint64_t at = 1000 + 40 * (uint64_t)i;
        ssdgs_real gaussian[SSDGS_CHANNELS], planes[SSDGS_CHANNELS], view[12], splat[SSDGS__SPLAT];
        ssdgs__projection k;
        memset(&k, 0, sizeof k), memset(gaussian, 0, sizeof gaussian), memset(planes, 0, sizeof planes);
        memset(splat, 0, sizeof splat);
        k.width = 4000, k.height = 3000, k.fx = 900, k.fy = 1000, k.cx = 2100,
        k.cy = 1450; /* borders: 2.1, 1.5 */
        k.log2_threshold = -60, k.variance = 0.1, k.depth_scale = k.presence = 1;
        k.view[0] = k.view[5] = k.view[10] = 1;
        for (int j = 0; j < 12; j++) k.view[j] += 0.1 * (draw(at++) - 0.5);
        const double z = 0.5 + draw(at), x = part == 0 ? 0 : 1.5 + 3 * draw(at + 1),
                     y = part == 0 ? 0.5 : 1.2 + 2 * draw(at + 2);
        gaussian[0] = (i & 1 ? -1 : 1) * x * z, gaussian[1] = (i & 2 ? -1 : 1) * y * z, gaussian[2] = z;
        k.near_plane = k.view[8] * gaussian[0] + k.view[9] * gaussian[1] + k.view[10] * z + k.view[11];
        k.near_plane /= part == 0 || part == 3 ? 1.05 + 0.9 * draw(at + 11) : 3;
        for (int j = 0; j < 3; j++)
            gaussian[SSDGS_LOG_SCALE + j] = log(z * (part == 1   ? 0.5 + draw(at + 3)
                                                     : part == 0 ? 0.02
                                                                 : 0.13 + 0.2 * draw(at + 3 + (uint64_t)j)));
        for (int j = 0; j < 4; j++) gaussian[SSDGS_ROTATION + j] = draw(at + 6 + (uint64_t)j) - 0.5;
        gaussian[SSDGS_OPACITY] = 4 * draw(at + 10) - 2;
        const double value = log_opacity(&k, gaussian), whole = log(1 / (1 + exp(-gaussian[SSDGS_OPACITY])));
        faded[part] += value < whole - 0.01;
        splat[5] = 1;
        const ssdgs__project_gradient d = {splat, planes, 1, view};
        context->k->project_backward(&k, gaussian, 1, 0, 1, &d);
        for (int j = 0; j < SSDGS_OPACITY + 1 + 12; j++) {
            ssdgs_real *p = j <= SSDGS_OPACITY ? gaussian + j : k.view + j - SSDGS_OPACITY - 1;
            const ssdgs_real kept = *p;
            double side[4];
            for (int n = 0; n < 4; n++) {
                *p = kept + steps[n] * 0.1;
                side[n] = log_opacity(&k, gaussian);
            }
            *p = kept;
            const double coarse = (side[0] - side[1]) / 4e-7, fine = (side[2] - side[3]) / 2e-7;
            const double got = j <= SSDGS_OPACITY ? planes[j] : view[j - SSDGS_OPACITY - 1];
            if (fabs(coarse - fine) > 1e-5 * (1 + fabs(fine))) continue; /* where a part begins or ends */
            const double error = fabs(got - fine) / (1 + fabs(fine));
            if (!CHECK(error < 1e-6)) printf("    case %d, parameter %d: %g, not %g\n", i, j, got, fine);
            worst = error > worst ? error : worst;
        }
    }
    for (int part = 0; part < 4; part++) CHECK(faded[part] > EACH / 4);
    printf("fade: %.2g\n", worst);
}

/* A stray, which the light's map does not cover, in front of a cloud: its pixels' visibility is its own. */
enum { STRAYS = 300, STRAY_SIDE = 24 };
static double stray_loss(ssdgs_model *model, ssdgs_frame *frame, int *without) {
    ssdgs_camera camera;
    ssdgs_light light;
    const ssdgs_render_options options = ssdgs_render_options_exact();
    const int pixels = STRAY_SIDE * STRAY_SIDE;
    double sum = 0;
    memset(&camera, 0, sizeof camera);
    memset(&light, 0, sizeof light);
    camera.width = camera.height = STRAY_SIDE, camera.fx = camera.fy = 60, camera.cx = camera.cy = 12;
    camera.near_plane = 0.02, camera.view[0] = camera.view[5] = camera.view[10] = 1;
    light.position[0] = 3, light.position[2] = 2;
    for (int c = 0; c < 3; c++) light.intensity[c] = 9;
    CHECK(!ssdgs__frame_of_model(frame, model, &camera, &light, 1, &options, 0, 1) &&
          !ssdgs__run_stages(frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK));
    for (int i = 0; i < STRAYS; i++) frame->seen[i] = 1, frame->visibility[i] = i ? 0.2 : 1; /* held fixed */
    CHECK(!ssdgs__run_stages(frame, SSDGS_STAGE_SHADE, SSDGS_STAGE_COMPOSITE));
    for (int i = 0; i < 3 * pixels; i++) {
        frame->pixel_gradient[i] = 1 + 0.5 * sin(0.37 * i);
        sum += frame->pixel_gradient[i] * frame->pixels[i];
    }
    memset(frame->pixel_gradient + 3 * pixels, 0, (size_t)pixels * sizeof(ssdgs_real));
    frame->normal_gradient = NULL;
    for (int i = 0; without && i < pixels; i++) {
        const double alpha = ssdgs__layer_plane(frame, SSDGS__DEPTH_LAYER, 2)[i],
                     z = ssdgs__layer_plane(frame, SSDGS__DEPTH_LAYER, 0)[i] / alpha;
        double at[48] = {0}, passed[16]; /* of sixteen places the first counts */
        at[0] = (i % STRAY_SIDE + 0.5 - 12) / 60 * z;
        at[16] = (i / STRAY_SIDE + 0.5 - 12) / 60 * z;
        at[32] = z;
        for (int j = 0; j < 16; j++) passed[j] = j ? 1 : -1;
        ssdgs__light_transmittance(frame->context->k, frame->views + 1, frame->views + frame->view_count,
                                   frame->bias[1], at, passed, NULL);
        *without += alpha > 1e-3 && passed[0] < 0;
    }
    return sum;
}

static void test_stray(void) {
    ssdgs_settings settings = ssdgs_settings_default();
    settings.terms = SSDGS_DIFFUSE_TERM | SSDGS_SPECULAR_TERM | SSDGS_SHADOW_TERM;
    settings.transfer = SSDGS_TRANSFER_NONE;
    ssdgs_model *model = NULL;
    static ssdgs_frame frame, other;
    int without = 0;
    if (!CHECK(!ssdgs_model_create(context, &settings, STRAYS, &model))) return;
    ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t i = 0; i < STRAYS; i++) {
        ssdgs_real *p = v.gaussians + i;
        for (size_t j = 0; j < 3; j++) {
            p[j * v.stride] = 0.4 * (draw(3 * i + j) - 0.5) + (j == 2 ? 2 : 0);
            p[(SSDGS_LOG_SCALE + j) * v.stride] = -3.5;
        }
        p[SSDGS_OPACITY * v.stride] = -2 + 0.01 * (double)i;
        p[(SSDGS_ASG_WEIGHT + 3) * v.stride] = -1;
    }
    for (size_t j = 0; j < 3; j++) {
        v.gaussians[j * v.stride] = j == 2 ? 0.1 : 0.002;
        v.gaussians[(SSDGS_LOG_SCALE + j) * v.stride] = -4.3;
    }
    ssdgs_real *opacity = v.gaussians + SSDGS_OPACITY * v.stride;
    *opacity = 0;
    (void)stray_loss(model, &frame, &without);
    CHECK(without > 20);
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_COMPOSITE_BACKWARD, SSDGS_STAGE_PROJECT_BACKWARD));
    double found[5];
    for (int i = 0; i < 5; i++)
        found[i] = frame.gradient[SSDGS_OPACITY * frame.gaussians.stride + 60 * (size_t)i];
    for (int i = 0; i < 5; i++) {
        double value[2];
        for (int side = 0; side < 2; side++) {
            opacity[60 * i] += side ? -2e-6 : 1e-6;
            ssdgs_model_arrays(model);
            value[side] = stray_loss(model, &other, NULL);
        }
        opacity[60 * i] += 1e-6;
        const double want = (value[0] - value[1]) / 2e-6;
        if (!CHECK(fabs(found[i] - want) < 1e-5 + 1e-4 * fabs(want)))
            printf("    stray's %d: %g, not %g\n", 60 * i, found[i], want);
    }
    ssdgs_model_destroy(model);
}

/* A second light that is dark changes no gradient, whatever an earlier photograph has left in memory. */
static void test_dark_light(const scene *base) {
    static const ssdgs_real eye[3] = {0.3, -1.9, 0.4}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1};
    const ssdgs_camera camera = ssdgs_camera_look_at(eye, target, up, 0.7, SIDE, SIDE);
    for (int asg = 0; asg < 2; asg++) {
        scene s = *base;
        ssdgs_model *model = NULL;
        ssdgs_real *gradient[2];
        size_t size = 0;
        double most = 0;
        int wrong = 0;
        s.settings.asg = asg ? SSDGS_ASG_GEOMETRIC : SSDGS_ASG_DEFERRED;
        for (int c = 0; c < 3; c++) s.lights[1].intensity[c] = 0;
        if (!CHECK(!ssdgs_model_create(context, &s.settings, COUNT, &model))) exit(1);
        fill(model);
        for (s.light_count = 2; s.light_count; s.light_count--) {
            ssdgs_frame frame;
            objective(&s, model, &camera, s.lights, NULL, &frame, 1);
            if (s.light_count == 2) {
                ssdgs__buffer *before = &frame.scratch->activations;
                memset(before->memory, 255, before->bytes); /* NaN */
                objective(&s, model, &camera, s.lights, NULL, &frame, 1);
            }
            const size_t own = model->capacity * SSDGS_CHANNELS;
            size = own + model->global_count;
            ssdgs_real *to = gradient[s.light_count - 1] = (ssdgs_real *)malloc(size * sizeof *to);
            memcpy(to, frame.gradient, own * sizeof *to);
            memcpy(to + own, frame.global_gradient, model->global_count * sizeof *to);
        }
        for (size_t i = 0; i < size; i++) most = fmax(most, fabs(gradient[0][i]));
        for (size_t i = 0; i < size; i++) wrong += !(fabs(gradient[1][i] - gradient[0][i]) <= 1e-12 * most);
        CHECK(most > 0.01 && !wrong);
        free(gradient[0]);
        free(gradient[1]);
        ssdgs_model_destroy(model);
    }
}

int main(void) {
    if (!CHECK(!ssdgs_context_create(NULL, &context))) return 1;
    test_rotation();
    test_shared_sums();
    test_moved_camera();
    test_edges();
    test_sharpest();
    for (int transfer = 0; transfer < 2; transfer++) {
        test_photo(transfer, 9);
        test_photo(transfer, 300);
    }
    test_receivers();
    test_compose();
    test_octaves();
    test_empty_tiles();
    ssdgs_context_destroy(context); /* so small pictures are quickest by one thread */
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.threads = 1;
    if (!CHECK(!ssdgs_context_create(&desc, &context))) return 1;
    scene base;
    memset(&base, 0, sizeof base);
    base.name = "depth cue without transport";
    base.settings = ssdgs_settings_default();
    base.settings.depth_cue = 1;
    base.settings.transport = 0; /* whose distances are held fixed: positions could not be compared */
    base.settings.scattering.width = 16;
    base.settings.shadow.width = 8;
    base.settings.light_map.size = 32;
    base.options = ssdgs_render_options_default();
    base.options.stop = 0;
    base.options.background[0] = 0.3;
    base.options.background[1] = 0.5;
    base.light_count = 1;
    for (int i = 0; i < 3; i++) {
        base.lights[0].position[i] = i == 1 ? -1.2 : 1.1;
        base.lights[0].intensity[i] = 2 + i;
        base.lights[1].position[i] = i == 2 ? 0.8 : i == 1 ? -0.6 : 0;
        base.lights[1].intensity[i] = 1;
    }
    run(&base);
    scene s = base;
    s.name = "default", s.settings.transport = 1, s.settings.depth_cue = 0;
    run(&s);
    s = base, s.name = "antialias, two lights", s.options.antialias = 1, s.light_count = 2;
    run(&s);
    s = base, s.name = "geometric ASG, shadow on scattering", s.settings.asg = SSDGS_ASG_GEOMETRIC,
    s.settings.shadow_on_scattering = 1;
    run(&s);
    s = base, s.name = "geometric ASG, early stop", s.settings.asg = SSDGS_ASG_GEOMETRIC;
    s.options.stop = 0.4;
    run(&s);
    s = base, s.name = "printed dipole, scalar optics, plain shadow network",
    s.settings.dipole = SSDGS_DIPOLE_PRINTED;
    s.settings.per_channel_optics = s.settings.residual_shadow = s.settings.depth_cue = 0,
    s.settings.shadow_on_scattering = 1;
    run(&s);
    s = base, s.name = "shadow on scattering, no shadow network, a wall", s.wall = 1;
    s.settings.shadow_on_scattering = 1, s.settings.shadow.layers = 0;
    run(&s);
    s = base, s.name = "shadow network of one layer", s.settings.shadow.layers = 1;
    run(&s);
    s = base, s.name = "lights at the back",
    s.lights[0].position[1] = 1.3; /* where Fresnel's term is steep */
    s.light_count = 2, s.lights[1].position[0] = -0.2, s.lights[1].position[1] = 1.5,
    s.lights[1].position[2] = -0.2; /* wo.h < 0.25 */
    run(&s);
    s = base, s.name = "directional and point light", s.light_count = 2;
    TEST_PARALLEL(s.lights[1]);
    run(&s);
    s = base, s.name = "light amid them, six maps", s.light_count = 2;
    for (int i = 0; i < 3; i++) s.lights[0].position[i] = i == 0 ? 0.5 : i == 1 ? -0.4 : 0.2;
    run(&s);
    s = base, s.name = "pixels' visibility given, two lights", s.given = 1, s.light_count = 2;
    run(&s);
    for (int i = 0; i < 3; i++) { /* highlights per pixel, per Gaussian, and light that scatters */
        static const char *const names[3] = {"directional light", "directional light, geometric ASG",
                                             "directional light, scattering only"};
        s = base, s.name = names[i];
        s.settings.octaves.light = i; /* the network sees wi alone, or its sines too */
        s.settings.asg = i == 1 ? SSDGS_ASG_GEOMETRIC : SSDGS_ASG_DEFERRED;
        if (i == 2) s.options.terms = SSDGS_SCATTERING_TERM;
        const double direction[3] = {0.48, -0.8, 0.36};
        memcpy(s.lights[0].position, direction, sizeof direction);
        TEST_PARALLEL(s.lights[0]);
        run(&s);
    }
    for (int i = 0; i < 5; i++) { /* the last three leave some or all Gaussians dark */
        static const char *const names[5] = {"LED", "spot with a range, geometric ASG",
                                             "narrow LED, two lights", "LED amid them, scattering alone",
                                             "LED that faces away, geometric ASG"};
        s = base, s.name = names[i];
        s.lights[0].direction[0] = -0.48, s.lights[0].direction[1] = 0.6, s.lights[0].direction[2] = -0.64;
        s.lights[0].focus = i == 2 ? 40 : 1.5;
        if (i == 1) {
            s.settings.asg = SSDGS_ASG_GEOMETRIC;
            s.lights[0].kind = SSDGS_LIGHT_SPOT, s.lights[0].cone[0] = 0.02, s.lights[0].cone[1] = 0.6;
            s.lights[0].range = 2.5, s.lights[0].focus = 0;
        }
        if (i == 2) s.light_count = 2;
        if (i == 3) {
            s.options.terms = SSDGS_SCATTERING_TERM;
            s.lights[0].position[0] = 0.5, s.lights[0].position[1] = -0.4, s.lights[0].position[2] = 0.2;
        }
        if (i == 4) {
            s.settings.asg = SSDGS_ASG_GEOMETRIC, s.light_count = 2;
            for (int c = 0; c < 3; c++) s.lights[0].direction[c] *= -1;
        }
        run(&s);
    }
    for (int i = 0; i < 4; i++) {
        static const char *const names[4] = {"diffuse only", "specular only", "shadow and diffuse",
                                             "scattering only"};
        static const int terms[4] = {SSDGS_DIFFUSE_TERM, SSDGS_SPECULAR_TERM,
                                     SSDGS_SHADOW_TERM | SSDGS_DIFFUSE_TERM, SSDGS_SCATTERING_TERM};
        s = base, s.name = names[i], s.options.terms = terms[i];
        run(&s);
    }
    for (int i = 0; i < 6; i++) {
        static const char *const names[6] = {
            "ambient light",       "ambient light, depth cue",    "ambient light, geometric ASG",
            "ambient light alone", "ambient light on highlights", "ambient light on geometric highlights"};
        s = base, s.name = names[i], s.shine = i >= 4;
        s.options.terms = s.shine ? SSDGS_SPECULAR_TERM : SSDGS_ALL_TERMS & ~SSDGS_SPECULAR_TERM;
        s.settings.transport = s.settings.depth_cue = i == 0 || i == 3;
        if (i == 1) s.settings.depth_cue = 1, s.light_count = 2;
        if (i == 2 || i == 5) s.settings.asg = SSDGS_ASG_GEOMETRIC;
        if (i == 3) s.light_count = 0;
        for (int c = 0; c < 3; c++) s.options.ambient[0][c] = 0.4 + 0.9 * c;
        run(&s);
    }
    test_dark_light(&base);
    test_held();
    test_fade();
    test_stray();
    ssdgs_context_destroy(context);
    test_row(0, "53", "gradients of every group under every option");
    TEST_END();
}
