/* Every stage against the golden files, on every instruction set; built again in double (real64), where the
   bounds are 1e-12. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "test.h"

#define BLOCK SSDGS__BLOCK
static const int real64 = sizeof(ssdgs_real) == 8;
static gold_file file;
static ssdgs_context *context;

static double gradient_bound(void) { return real64 ? 1e-12 : 4e-5; }
static double value_bound(void) { return real64 ? 1e-12 : 5e-6; }

static ssdgs_real *reals(size_t n) { return (ssdgs_real *)calloc(n + 64, sizeof(ssdgs_real)); }

static ssdgs_real *gold_reals(const char *name) {
    size_t n;
    const double *from = gold(&file, name, &n);
    ssdgs_real *to = reals(n);
    for (size_t i = 0; i < n; i++) to[i] = (ssdgs_real)from[i];
    return to;
}

/* (n, width) rows of a golden array into planes of a stride. */
static void to_planes(const char *name, ssdgs_real *planes, size_t stride) {
    const gold_array *a = gold_find(&file, name);
    size_t width = a->count / a->dims[0];
    for (size_t i = 0; i < a->dims[0]; i++)
        for (size_t c = 0; c < width; c++) planes[c * stride + i] = (ssdgs_real)a->data[i * width + c];
}

static void check_planes(const char *name, const ssdgs_real *planes, size_t stride, double bound) {
    const gold_array *a = gold_find(&file, name);
    size_t width = a->count / a->dims[0];
    double *rows = (double *)malloc(a->count * sizeof *rows);
    for (size_t i = 0; i < a->dims[0]; i++)
        for (size_t c = 0; c < width; c++) rows[i * width + c] = (double)planes[c * stride + i];
    CHECK_L2(rows, a->data, a->count, bound, name);
    free(rows);
}

/* (h, w, c) golden image against planes. */
static double image_error; /* the largest of all */
static void check_image(const char *name, const ssdgs_real *planes, double bound) {
    const gold_array *a = gold_find(&file, name);
    const size_t pixels = (size_t)a->dims[0] * a->dims[1], channels = a->dims[2];
    double *rows = (double *)malloc(a->count * sizeof *rows);
    for (size_t i = 0; i < a->count; i++) rows[i] = (double)planes[pixels * (i % channels) + i / channels];
    CHECK_NEAR(rows, a->data, a->count, bound, 0, name);
    for (size_t i = 0; i < a->count; i++) image_error = test_most(image_error, fabs(rows[i] - a->data[i]));
    free(rows);
}

static void gold_planes(const char *name, ssdgs_real *planes) {
    const gold_array *a = gold_find(&file, name);
    const size_t pixels = (size_t)a->dims[0] * a->dims[1], channels = a->dims[2];
    for (size_t i = 0; i < a->count; i++)
        planes[pixels * (i % channels) + i / channels] = (ssdgs_real)a->data[i];
}

static ssdgs_camera gold_camera(void) {
    const double *view = gold(&file, "view", NULL), *intrinsics = gold(&file, "intrinsics", NULL),
                 *size = gold(&file, "size", NULL);
    ssdgs_camera c;
    memset(&c, 0, sizeof c);
    for (int i = 0; i < 12; i++) c.view[i] = (ssdgs_real)view[i];
    c.fx = (ssdgs_real)intrinsics[0];
    c.fy = (ssdgs_real)intrinsics[1];
    c.cx = (ssdgs_real)intrinsics[2];
    c.cy = (ssdgs_real)intrinsics[3];
    c.width = (int)size[0];
    c.height = (int)size[1];
    return c;
}

/* dL/d(transmittance) of an image with the background behind it. */
static void through_background(ssdgs_frame *frame) {
    const size_t pixels = (size_t)frame->camera.width * (size_t)frame->camera.height;
    for (size_t i = 0; i < pixels; i++) {
        frame->pixel_gradient[3 * pixels + i] = 0;
        for (size_t c = 0; c < 3; c++)
            frame->pixel_gradient[3 * pixels + i] +=
                frame->pixel_gradient[c * pixels + i] * frame->options.background[c];
    }
}

static ssdgs_model *gold_geometry(const ssdgs_settings *settings) {
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, settings, (int)gold_find(&file, "mean")->dims[0], &model)))
        exit(1);
    ssdgs_model_view view = ssdgs_model_arrays(model);
    to_planes("mean", view.gaussians + SSDGS_POSITION * view.stride, view.stride);
    to_planes("quat", view.gaussians + SSDGS_ROTATION * view.stride, view.stride);
    to_planes("log_scale", view.gaussians + SSDGS_LOG_SCALE * view.stride, view.stride);
    to_planes("opacity_logit", view.gaussians + SSDGS_OPACITY * view.stride, view.stride);
    return model;
}

static void begin(ssdgs_frame *frame, ssdgs_model *model, const ssdgs_camera *camera,
                  const ssdgs_light *lights, int light_count, const double *background) {
    ssdgs_render_options options = ssdgs_render_options_default();
    options.stop = 0;
    for (int i = 0; i < 3 && background; i++) options.background[i] = (ssdgs_real)background[i];
    if (!CHECK(!ssdgs__frame_of_model(frame, model, camera, lights, light_count, &options, 1, 1))) exit(1);
}

/* A threshold between the golden alphas next to 1/255. The one below is 5e-6 of 1/255 away, which float
   cannot tell from above. */
static double threshold_in_gap(const ssdgs_camera *camera) {
    const double *mean = gold(&file, "mean2d", NULL), *conic = gold(&file, "conic", NULL),
                 *logit = gold(&file, "opacity_logit", NULL);
    double below = 0, above = 1;
    for (size_t i = 0; i < gold_find(&file, "mean2d")->dims[0]; i++)
        for (int y = 0; y < camera->height; y++)
            for (int x = 0; x < camera->width; x++) {
                const double dx = x + 0.5 - mean[2 * i], dy = y + 0.5 - mean[2 * i + 1], *k = conic + 4 * i;
                const double far_off = k[0] * dx * dx + 2 * k[1] * dx * dy + k[3] * dy * dy;
                const double alpha = exp(-0.5 * far_off) / (1 + exp(-logit[i]));
                if (alpha < 1.0 / 255) below = fmax(below, alpha);
                else above = fmin(above, alpha);
            }
    CHECK(above - below > 3e-5 / 255 && above - below < 0.01 / 255);
    return (below + above) / 2;
}

static void test_raster(void) {
    ssdgs_settings settings = ssdgs_settings_published();
    if (!gold_open(&file, "raster")) return;
    ssdgs_model *model = gold_geometry(&settings);
    ssdgs_camera camera = gold_camera();
    const size_t n = (size_t)model->count;
    const size_t pixels = (size_t)camera.width * (size_t)camera.height;
    ssdgs_frame frame;
    begin(&frame, model, &camera, NULL, 0, gold(&file, "background", NULL));
    frame.options.alpha_threshold = (ssdgs_real)threshold_in_gap(&camera);
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_SHADE));
    ssdgs_real *color = gold_reals("color");
    for (size_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++) frame.color[4 * i + (size_t)c] = color[3 * i + (size_t)c];
    CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_COMPOSITE));
    double *out = (double *)malloc(n * 8 * sizeof *out);
    for (size_t i = 0; i < n; i++) {
        const ssdgs_record *r = frame.views[0].record + i;
        out[2 * i] = (double)r->x;
        out[2 * i + 1] = (double)r->y;
        const double ux = (double)r->ux, uy = (double)r->uy, wy = (double)r->wy;
        out[2 * n + 4 * i] = 2 * log(2) * ux * ux;
        out[2 * n + 4 * i + 1] = out[2 * n + 4 * i + 2] = 2 * log(2) * ux * uy;
        out[2 * n + 4 * i + 3] = 2 * log(2) * (uy * uy + wy * wy);
        out[6 * n + i] = (double)frame.views[0].depth[i];
    }
    CHECK_NEAR(out, gold(&file, "mean2d", NULL), 2 * n, value_bound(), 1e-6, "raster: mean2d");
    CHECK_NEAR(out + 2 * n, gold(&file, "conic", NULL), 4 * n, value_bound(), 1e-5, "raster: conic");
    CHECK_NEAR(out + 6 * n, gold(&file, "depth", NULL), n, value_bound(), 0, "raster: depth");
    ssdgs_real *image = reals(pixels * 3);
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < pixels; i++)
            image[pixels * (size_t)c + i] =
                frame.pixels[pixels * (size_t)c + i] + frame.transmittance[i] * frame.options.background[c];
    check_image("image", image, value_bound());
    CHECK_NEAR(frame.transmittance, gold(&file, "transmittance", NULL), pixels, value_bound(), 0,
               "raster: transmittance");
    gold_planes("grad_image", frame.pixel_gradient);
    through_background(&frame);
    CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_COMPOSITE_BACKWARD));
    memset(frame.gradient, 0, frame.gaussians.stride * SSDGS_CHANNELS * sizeof(ssdgs_real));
    CHECK(!ssdgs_stage_cpu(&frame, SSDGS_STAGE_PROJECT_BACKWARD));
    for (size_t i = 0; i < n; i++) {
        out[i] = (double)frame.splat_gradient[SSDGS_SPLAT_GRADIENTS * i + 6];
        for (int c = 0; c < 3; c++)
            out[n + 3 * i + (size_t)c] = (double)frame.color_gradient[4 * i + (size_t)c];
    }
    CHECK_L2(out, gold(&file, "blend_weight", NULL), n, gradient_bound(), "raster: blend_weight");
    CHECK_L2(out + n, gold(&file, "grad_color", NULL), 3 * n, gradient_bound(), "raster: grad_color");
    check_planes("grad_mean", frame.gradient + SSDGS_POSITION * frame.gaussians.stride,
                 frame.gaussians.stride, gradient_bound());
    check_planes("grad_quat", frame.gradient + SSDGS_ROTATION * frame.gaussians.stride,
                 frame.gaussians.stride, gradient_bound());
    check_planes("grad_log_scale", frame.gradient + SSDGS_LOG_SCALE * frame.gaussians.stride,
                 frame.gaussians.stride, gradient_bound());
    check_planes("grad_opacity_logit", frame.gradient + SSDGS_OPACITY * frame.gaussians.stride,
                 frame.gaussians.stride, gradient_bound());
    double expected[16];
    memcpy(expected, gold(&file, "grad_view", NULL), sizeof expected);
    CHECK_L2(frame.view_gradient, expected, 12, gradient_bound(), "raster: grad_view");
    free(out);
    free(color);
    free(image);
    ssdgs_model_destroy(model);
    gold_close(&file);
}

static void test_light_pass(const char *name) {
    ssdgs_settings settings = ssdgs_settings_default();
    if (!gold_open(&file, name)) return;
    settings.light_map.bias = (ssdgs_real)gold(&file, "bias", NULL)[0] / settings.length_unit;
    settings.light_map.blur = SSDGS_BLUR_ADD;
    settings.depth_cue = 1;
    ssdgs_model *model = gold_geometry(&settings);
    ssdgs_camera camera = gold_camera();
    const double *at = gold(&file, "light", NULL);
    ssdgs_light light;
    memset(&light, 0, sizeof light);
    for (int i = 0; i < 3; i++) {
        light.position[i] = (ssdgs_real)at[i];
        light.intensity[i] = 1;
    }
    ssdgs_frame frame;
    begin(&frame, model, &camera, &light, 1, NULL);
    frame.view_count = 2; /* the file's own light camera in place of the fitted one */
    ssdgs_splat_view *v = frame.views + 1;
    memcpy(v->view, camera.view, sizeof v->view);
    v->orthographic = 0;
    v->by_distance = 1;
    v->width = camera.width;
    v->height = camera.height;
    v->fx = camera.fx;
    v->fy = camera.fy;
    v->cx = camera.cx;
    v->cy = camera.cy;
    v->near_plane = (ssdgs_real)0.01;
    const size_t n = (size_t)model->count;
    frame.flux = reals(n);
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK));
    CHECK_NEAR(v->depth, gold(&file, "distance", NULL), n, value_bound(), 0, "light pass: distance");
    CHECK_NEAR(frame.visibility, gold(&file, "visibility", NULL), n, value_bound(), 0,
               "light pass: visibility");
    CHECK_NEAR(frame.depth_cue, gold(&file, "depth_cue", NULL), n, value_bound(), 0, "light pass: depth cue");
    CHECK_NEAR(frame.flux, gold(&file, "flux", NULL), n, value_bound() * 1e-2, value_bound(),
               "light pass: flux");
    free(frame.flux);
    ssdgs_model_destroy(model);
    gold_close(&file);
}

/* Points through reflect and reflect_backward, in blocks. objective: given the rows of a block, fills their
   gradients. */
typedef struct asg_run {
    ssdgs_model *model;
    ssdgs__lighting k;
    ssdgs_real *gauss, *dgauss, *rows, *drows; /* planes of a stride n padded to whole blocks */
    ssdgs_real sums[SSDGS__LANE_SUMS];
    size_t n, stride;
} asg_run;

static void asg_forward(asg_run *run) {
    for (size_t at = 0; at < run->stride; at += BLOCK)
        context->k->reflect(&run->k, run->gauss + at * SSDGS_CHANNELS, run->rows + at * SSDGS__ROWS);
}

/* Adds to dgauss and sums. */
static void asg_backward(asg_run *run) {
    ssdgs_real *lanes = reals(SSDGS__LANE_SUMS * 16);
    for (size_t at = 0; at < run->stride; at += BLOCK)
        context->k->reflect_backward(&run->k, run->gauss + at * SSDGS_CHANNELS, run->drows + at * SSDGS__ROWS,
                                     run->dgauss + at * SSDGS_CHANNELS, lanes);
    for (size_t at = 0; at < SSDGS__LANE_SUMS * 16; at++) run->sums[at / 16] += lanes[at];
    free(lanes);
}

static ssdgs_real *row_of(ssdgs_real *blocks, int rows, int row, size_t point) {
    return blocks + (point / BLOCK * (size_t)rows + (size_t)row) * BLOCK + point % BLOCK;
}

static void check_points(asg_run *run, const char *name, int channel, int width, double bound) {
    double *d = (double *)malloc(run->n * (size_t)width * sizeof *d);
    for (size_t i = 0; i < run->n * (size_t)width; i++)
        d[i] = (double)*row_of(run->dgauss, SSDGS_CHANNELS, channel + (int)(i % (size_t)width),
                               i / (size_t)width);
    CHECK_L2(d, gold(&file, name, NULL), run->n * (size_t)width, bound, name);
    free(d);
}

static void test_asg(void) {
    ssdgs_settings settings = ssdgs_settings_default();
    if (!gold_open(&file, "shading")) return;
    asg_run run;
    memset(&run, 0, sizeof run);
    settings.asg = SSDGS_ASG_GEOMETRIC;
    run.n = gold_find(&file, "position")->dims[0];
    run.stride = (run.n + BLOCK - 1) / BLOCK * BLOCK;
    if (!CHECK(!ssdgs_model_create(context, &settings, (int)run.n, &run.model))) exit(1);
    ssdgs_model_view view = ssdgs_model_arrays(run.model);
    to_planes("position", view.gaussians + SSDGS_POSITION * view.stride, view.stride);
    to_planes("frame_quat", view.gaussians + SSDGS_FRAME * view.stride, view.stride);
    to_planes("asg_weight_raw", view.gaussians + SSDGS_ASG_WEIGHT * view.stride, view.stride);
    for (size_t i = 0; i < 32; i++) view.asg_basis[i] = (ssdgs_real)gold(&file, "asg_quat", NULL)[i];
    for (size_t i = 0; i < 16; i++)
        view.asg_sharpness[i] = (ssdgs_real)gold(&file, "asg_log_lambda_mu", NULL)[i];
    ssdgs_light lamp;
    memset(&lamp, 0, sizeof lamp);
    ssdgs_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.width = camera.height = 8;
    camera.fx = camera.fy = 8;
    for (int c = 0; c < 3; c++) {
        lamp.position[c] = (ssdgs_real)gold(&file, "light", NULL)[c];
        lamp.intensity[c] = 1;
        camera.view[4 * c + c] = 1;
        camera.view[4 * c + 3] = (ssdgs_real)-gold(&file, "camera", NULL)[c];
    }
    ssdgs_frame frame;
    begin(&frame, run.model, &camera, &lamp, 1, NULL);
    run.k = ssdgs__lighting_of(&frame, frame.objects, 0, NULL);
    run.gauss = reals(run.stride * SSDGS_CHANNELS);
    run.dgauss = reals(run.stride * SSDGS_CHANNELS);
    run.rows = reals(run.stride * SSDGS__ROWS);
    run.drows = reals(run.stride * SSDGS__ROWS);
    double *value = (double *)malloc(3 * run.n * sizeof *value);
    for (size_t i = 0; i < run.stride; i++)
        for (int c = 0; c < SSDGS_CHANNELS; c++)
            *row_of(run.gauss, SSDGS_CHANNELS, c, i) =
                view.gaussians[(size_t)c * view.stride + (i < run.n ? i : run.n - 1)];
    {
        asg_forward(&run);
        for (size_t i = 0; i < run.n;
             i++) { /* the file's objective is (f_s, f_d) / d^2 against the given gradients */
            const double fs = value[i] = (double)*row_of(run.rows, SSDGS__ROWS, SSDGS__GLOSS, i);
            const double fd = value[run.n + i] = (double)*row_of(run.rows, SSDGS__ROWS, SSDGS__COSINE, i);
            const double e = value[2 * run.n + i] =
                (double)*row_of(run.rows, SSDGS__ROWS, SSDGS__IRRADIANCE, i);
            const double dfs = gold(&file, "grad_f_specular", NULL)[i],
                         dfd = gold(&file, "grad_f_diffuse", NULL)[i];
            *row_of(run.drows, SSDGS__ROWS, SSDGS__GLOSS, i) = (ssdgs_real)(dfs * e);
            *row_of(run.drows, SSDGS__ROWS, SSDGS__COSINE, i) = (ssdgs_real)(dfd * e);
            *row_of(run.drows, SSDGS__ROWS, SSDGS__IRRADIANCE, i) = (ssdgs_real)(dfs * fs + dfd * fd);
        }
        CHECK_NEAR(value, gold(&file, "f_specular", NULL), run.n, value_bound(), 0, "shading: f_specular");
        CHECK_NEAR(value + run.n, gold(&file, "f_diffuse", NULL), run.n, value_bound(), 0,
                   "shading: f_diffuse");
        CHECK_NEAR(value + 2 * run.n, gold(&file, "inv_dist2", NULL), run.n, value_bound(), 0,
                   "shading: 1 / d^2");
        asg_backward(&run);
        check_points(&run, "grad_asg_weight_raw", SSDGS_ASG_WEIGHT, 8, gradient_bound());
        CHECK_L2(run.sums, gold(&file, "grad_light", NULL), 3, gradient_bound(), "shading: grad_light");
        CHECK_L2(run.sums + 3, gold(&file, "grad_camera", NULL), 3, gradient_bound(), "shading: grad_camera");
    }
    check_points(&run, "grad_position", SSDGS_POSITION, 3, gradient_bound());
    check_points(&run, "grad_frame_quat", SSDGS_FRAME, 4, gradient_bound());
    ssdgs__asg_backward(&frame, run.sums + 6);
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&settings, first);
    CHECK_L2(frame.global_gradient, gold(&file, "grad_asg_quat", NULL), 32, gradient_bound(),
             "grad_asg_quat");
    CHECK_L2(frame.global_gradient + first[SSDGS__ASG_SHARPNESS], gold(&file, "grad_asg_log_lambda_mu", NULL),
             16, gradient_bound(), "grad of the ASG sharpness");
    free(run.gauss);
    free(run.dgauss);
    free(run.rows);
    free(run.drows);
    free(value);
    ssdgs_model_destroy(run.model);
    gold_close(&file);
}

/* A network with its inputs and its head, in one block of 64. */
static void test_network(const char *name, int shadow, int residual, int defaults) {
    ssdgs_settings settings = defaults ? ssdgs_settings_default() : ssdgs_settings_published();
    const char *prefix = shadow && residual ? "res_" : "";
    if (!gold_open(&file, name)) return;
    settings.octaves.view = settings.octaves.light = 4;
    settings.transport = 0;
    settings.depth_cue = defaults;
    if (defaults) settings.scattering.width = 64; /* the golden network's */
    settings.residual_shadow = residual;
    settings.shadow.width = 32;
    settings.shadow.layers = 4;
    ssdgs_frame frame;
    ssdgs_placed object;
    memset(&frame, 0, sizeof frame);
    memset(&object, 0, sizeof object);
    frame.light_count = 1;
    object.settings = settings;
    object.terms = SSDGS_ALL_TERMS;
    if (defaults || residual) object.settings.length_unit = (ssdgs_real)gold(&file, "length_unit", NULL)[0];
    ssdgs__block_layout l = ssdgs__layout(&frame, &object);
    ssdgs_real *memory = reals(l.size);
    ssdgs_real *gauss = memory + l.gauss;
    ssdgs_real *scratch = reals(l.scratch);
    ssdgs_real *outs = scratch + l.outs;
    ssdgs_real *inputs = scratch + l.inputs;
    ssdgs_real *part = memory + l.lights;
    to_planes("x", gauss + SSDGS_POSITION * BLOCK, BLOCK);
    to_planes("material", gauss + SSDGS_MATERIAL * BLOCK, BLOCK);
    to_planes("wi", part + SSDGS__WI * BLOCK, BLOCK);
    if (shadow) to_planes("visibility", part + l.visibility, BLOCK);
    if (!shadow) {
        to_planes("wo", part + SSDGS__WO * BLOCK, BLOCK);
        to_planes("normal", part + SSDGS__NORMAL * BLOCK, BLOCK);
        if (defaults) to_planes("depth_cue", part + l.cue, BLOCK);
    }
    for (int s = 0; s < BLOCK; s++) { /* unit irradiance, c = 1 */
        part[SSDGS__IRRADIANCE * BLOCK + s] = 1;
        part[SSDGS__COSINE * BLOCK + s] = 1;
        for (int c = 0; c < 3; c++)
            gauss[(SSDGS_SCATTERING + c) * BLOCK + s] = gauss[(SSDGS_DIFFUSE + c) * BLOCK + s] =
                (ssdgs_real)0.54132485461291811;
    }
    ssdgs_real *weights = gold_reals("weights");
    size_t count;
    gold(&file, "weights", &count);
    ssdgs__lighting k;
    memset(&k, 0, sizeof k);
    for (int c = 0; c < 3; c++) k.intensity[c] = 1;
    k.scattering = !shadow;
    k.shadow = k.diffuse = shadow;
    k.refined_shadow = shadow;
    k.residual_shadow = residual;
    k.per_channel_optics = settings.per_channel_optics;
    {
        const double eta = 1.3, fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
        k.virtual_depth = (ssdgs_real)(1 + 4.0 / 3 * (1 + fdr) / (1 - fdr));
    }
    ssdgs__row_lists lists;
    ssdgs__row_lists_fill(&lists);
    const int *sizes = shadow ? l.shadow : l.scattering;
    const int layers = shadow ? l.shadow_layers : l.scattering_layers;
    CHECK((size_t)sizes[0] == (size_t)gold(&file, "layer_sizes", NULL)[0]);
    ssdgs_real *dgauss, *drows, *dnet, *spare, *transposed, *dweights, *slot, *dvisibility, *dother;
    char key[64];
    double *out;
    {
        ssdgs_real *outputs = part + (shadow ? l.shadow_at : l.scattering_at),
                   *head = outputs + BLOCK * (ssdgs__output_rows(sizes, layers) - (size_t)sizes[layers]);
        ssdgs__encode_inputs(context->k, &object.settings, &l, shadow, NULL, gauss, part, inputs);
        const ssdgs__network net = {sizes, layers, weights};
        const ssdgs__colour_in in = {
            gauss, part, part + l.visibility, shadow ? head : NULL, shadow ? NULL : head, NULL};
        ssdgs__network_forward(context->k, &net, NULL, &lists, inputs, outputs);
        context->k->colour(&k, &in, outs);
        out = (double *)malloc(BLOCK * 3 * sizeof *out);
        ssdgs_real one[3 * BLOCK];
        memset(one, 0, sizeof one);
        if (shadow) {
            for (int s = 0; s < BLOCK; s++) out[s] = (double)outs[9 * BLOCK + s];
            snprintf(key, sizeof key, "%sS", prefix);
            CHECK_NEAR(out, gold(&file, key, NULL), BLOCK, value_bound(), 0, key);
            for (int s = 0; s < BLOCK; s++)
                one[s] = (ssdgs_real)(gold(&file, "grad_S", NULL)[s] * 3.14159265358979323846);
        } else {
            const int per = defaults ? 3 : 1;
            for (int s = 0; s < BLOCK; s++)
                for (int c = 0; c < per; c++) out[s * per + c] = (double)outs[(6 + c) * BLOCK + s];
            CHECK_NEAR(out, gold(&file, "f_sss", NULL), BLOCK * per, real64 ? 1e-12 : 2e-9,
                       real64 ? 1e-9 : 2e-5, name);
            for (int s = 0; s < BLOCK; s++)
                for (int c = 0; c < per; c++)
                    one[c * BLOCK + s] = (ssdgs_real)gold(&file, "grad_f", NULL)[s * per + c];
        }
        dgauss = reals(SSDGS_CHANNELS * BLOCK);
        drows = reals(SSDGS__ROWS * BLOCK);
        dnet = reals((size_t)(l.widest + 1) * BLOCK);
        spare = reals((size_t)(l.widest + 1) * BLOCK);
        transposed = reals((size_t)(l.widest + 32) * BLOCK);
        dvisibility = reals(BLOCK);
        dother = reals((size_t)(l.widest + 1) * BLOCK);
        dweights = reals(count);
        slot = reals(ssdgs__slot_gradient_size(sizes, layers));
        const ssdgs__colour_gradient gradients = {
            one, one, one, dgauss, drows, shadow ? dnet : dother, shadow ? dother : dnet, dvisibility};
        const ssdgs__network_scratch backward = {dnet, spare, transposed};
        context->k->colour_backward(&k, &in, &gradients);
        memset(dgauss, 0, SSDGS_CHANNELS * BLOCK * sizeof *dgauss);
        ssdgs_real *dinputs =
            ssdgs__network_backward(context->k, &net, inputs, outputs, &backward, &lists, sizes[0], slot);
        ssdgs__sum_slots(sizes, layers, slot, 0, 1, 0, 1, dweights);
        ssdgs__encode_inputs_backward(context->k, &object.settings, &l, shadow, inputs, dinputs, dgauss,
                                      drows, dvisibility);
    }
    snprintf(key, sizeof key, "%sgrad_weights", prefix);
    CHECK_L2(dweights, gold(&file, key, NULL), count, gradient_bound(), key);
    snprintf(key, sizeof key, "%sgrad_x", prefix);
    check_planes(key, dgauss + SSDGS_POSITION * BLOCK, BLOCK, gradient_bound());
    snprintf(key, sizeof key, "%sgrad_material", prefix);
    check_planes(key, dgauss + SSDGS_MATERIAL * BLOCK, BLOCK, gradient_bound());
    snprintf(key, sizeof key, "%sgrad_wi", prefix);
    check_planes(key, drows + SSDGS__WI * BLOCK, BLOCK, gradient_bound());
    if (shadow) {
        snprintf(key, sizeof key, "%sgrad_visibility", prefix);
        check_planes(key, dvisibility, BLOCK, gradient_bound());
    } else {
        check_planes("grad_wo", drows + SSDGS__WO * BLOCK, BLOCK, gradient_bound());
        check_planes("grad_normal", drows + SSDGS__NORMAL * BLOCK, BLOCK, gradient_bound());
    }
    free(memory);
    free(scratch);
    free(weights);
    free(out);
    free(dgauss);
    free(drows);
    free(dnet);
    free(spare);
    free(transposed);
    free(dvisibility);
    free(dother);
    free(dweights);
    free(slot);
    gold_close(&file);
}

static void test_loss(void) {
    ssdgs__buffer memory = {0, 0};
    if (!gold_open(&file, "loss")) return;
    const gold_array *a = gold_find(&file, "image");
    const size_t pixels = (size_t)a->dims[0] * a->dims[1];
    ssdgs_real *image = reals(3 * pixels);
    ssdgs_real *target = reals(3 * pixels);
    ssdgs_real *gradient = reals(3 * pixels);
    gold_planes("image", image);
    gold_planes("target", target);
    ssdgs__loss_values values;
    const ssdgs__images images = {image, target, (int)a->dims[1], (int)a->dims[0]};
    const ssdgs__images equal = {target, target, (int)a->dims[1], (int)a->dims[0]};
    CHECK(!ssdgs__loss(context, &memory, &images, (ssdgs_real)gold(&file, "lambda_dssim", NULL)[0], gradient,
                       &values));
    double got[4];
    got[0] = values.l1;
    got[1] = values.ssim;
    got[2] = values.loss;
    got[3] = ssdgs__psnr(values.mse);
    double want[4];
    want[0] = gold(&file, "l1", NULL)[0];
    want[1] = gold(&file, "ssim", NULL)[0];
    want[2] = gold(&file, "loss", NULL)[0];
    want[3] = gold(&file, "psnr", NULL)[0];
    CHECK_NEAR(got, want, 4, real64 ? 1e-10 : 1e-6, real64 ? 1e-9 : 1e-6, "loss: l1, ssim, loss, psnr");
    double *rows = (double *)malloc(3 * pixels * sizeof *rows);
    for (size_t i = 0; i < 3 * pixels; i++) rows[i] = (double)gradient[pixels * (i % 3) + i / 3];
    CHECK_L2(rows, gold(&file, "grad_image", NULL), 3 * pixels, gradient_bound(), "loss: grad_image");
    CHECK(!ssdgs__loss(context, &memory, &equal, (ssdgs_real)0.2, gradient, &values));
    for (size_t i = 0; i < 3 * pixels; i++)
        rows[i] = 0; /* equal images pull at nothing, where one grey level makes 1e-4 */
    CHECK_NEAR(gradient, rows, 3 * pixels, real64 ? 1e-15 : 1e-8, 0, "loss: gradient of equal images");
    free(rows);
    free(image);
    free(target);
    free(gradient);
    ssdgs__release(context, memory.memory);
    gold_close(&file);
}

/* The conic (px^-2) of a Gaussian under an orthographic view of 1 px a unit, from its quaternion (4) and log
   scales (3), and what compensation adds to ln opacity. */
static void conic_of(const double raw[7], double variance, double conic[4]) {
    double cov[3] = {0, 0, 0}, length = 0;
    for (int i = 0; i < 4; i++) length += raw[i] * raw[i];
    double q[4];
    for (int i = 0; i < 4; i++) q[i] = raw[i] / sqrt(length);
    double r[6];
    r[0] = 1 - 2 * (q[2] * q[2] + q[3] * q[3]);
    r[1] = 2 * (q[1] * q[2] - q[0] * q[3]);
    r[2] = 2 * (q[1] * q[3] + q[0] * q[2]);
    r[3] = 2 * (q[1] * q[2] + q[0] * q[3]);
    r[4] = 1 - 2 * (q[1] * q[1] + q[3] * q[3]);
    r[5] = 2 * (q[2] * q[3] - q[0] * q[1]);
    double m[2][3];
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 3; j++) m[i][j] = r[3 * i + j] * exp(raw[4 + j]);
    for (int j = 0; j < 3; j++) {
        cov[0] += m[0][j] * m[0][j];
        cov[1] += m[0][j] * m[1][j];
        cov[2] += m[1][j] * m[1][j];
    }
    const double det = pow(m[0][0] * m[1][1] - m[0][1] * m[1][0], 2) +
                       pow(m[0][1] * m[1][2] - m[0][2] * m[1][1], 2) +
                       pow(m[0][2] * m[1][0] - m[0][0] * m[1][2], 2);
    const double blurred = det + variance * (cov[0] + cov[2] + variance);
    conic[0] = (cov[2] + variance) / blurred;
    conic[1] = -cov[1] / blurred;
    conic[2] = (cov[0] + variance) / blurred;
    conic[3] = 0.5 * (log(det) - log(blurred));
}

/* Gradients by the conic and ln opacity, from those of a splat (SSDGS_SPLAT_GRADIENTS). */
static void conic_gradient(const double conic[4], const ssdgs_real *splat, double gradient[4]) {
    const double ux = sqrt(conic[0]), uy = conic[1] / ux, wy = sqrt(conic[2] - uy * uy);
    const double ratio = uy / wy, uu = (double)splat[2], uw = (double)splat[3], ww = (double)splat[4];
    gradient[0] = -0.5 * (uu - 2 * ratio * uw + ratio * ratio * ww) / (ux * ux); /* -dx^2 / 2 */
    gradient[1] = -(uw - ratio * ww) / (ux * wy);
    gradient[2] = -0.5 * ww / (wy * wy);
    gradient[3] = (double)splat[5];
}

/* Rotations' and log scales' gradients of thin Gaussians, 3 to 300 px long and 0.1 to 1 px thin, against
   central differences in double: what products of conics would lose. */
static void test_needles(void) {
    enum { MANY = 16, VALUES = SSDGS_CHANNELS * MANY };
    static const double long_side[4] = {3, 30, 100, 300}, thin_side[2] = {0.1, 1};
    ssdgs_real *gaussians = reals(VALUES), *gradient = reals(VALUES), *splat = reals(MANY * SSDGS__SPLAT);
    for (int compensated = 0; compensated < 2; compensated++) {
        double worst[2] = {0, 0};
        ssdgs__projection view;
        memset(&view, 0, sizeof view);
        view.view[0] = view.view[5] = view.view[10] = view.fx = view.fy = 1;
        view.orthographic = 1;
        view.depth_scale = view.presence = 1;
        view.compensate = compensated;
        view.variance = (ssdgs_real)0.1;
        view.blur = SSDGS_BLUR_ADD;
        memset(gradient, 0, VALUES * sizeof *gradient);
        for (int i = 0; i < MANY; i++) {
            for (int j = 0; j < 4; j++) {
                gaussians[(SSDGS_ROTATION + j) * MANY + i] =
                    (ssdgs_real)(2 * ssdgs__uniform(1, (uint64_t)(4 * i + j)) - 1);
                splat[i * SSDGS__SPLAT + 2 + j] =
                    (ssdgs_real)(2 * ssdgs__uniform(2, (uint64_t)(4 * i + j)) - 1);
            }
            for (int j = 0; j < 3; j++)
                gaussians[(SSDGS_LOG_SCALE + j) * MANY + i] =
                    (ssdgs_real)log(j == i % 3 ? long_side[i % 4] : thin_side[i / 4 % 2]);
        }
        ssdgs_real slot[12];
        const ssdgs__project_gradient d = {splat, gradient, MANY, slot};
        context->k->project_backward(&view, gaussians, MANY, 0, MANY, &d);
        for (int i = 0; i < MANY; i++) {
            double raw[7], error[2] = {0, 0}, norm[2] = {0, 0};
            for (int j = 0; j < 7; j++)
                raw[j] = (double)gaussians[((j < 4 ? SSDGS_ROTATION : SSDGS_LOG_SCALE - 4) + j) * MANY + i];
            double conic[4], weight[4];
            conic_of(raw, 0.1, conic);
            conic_gradient(conic, splat + i * SSDGS__SPLAT, weight);
            for (int j = 0; j < 7; j++) {
                const double start = raw[j], step = j < 4 ? 3e-6 : 1e-4,
                             got = (double)
                                 gradient[((j < 4 ? SSDGS_ROTATION : SSDGS_LOG_SCALE - 4) + j) * MANY + i];
                double want = 0, before[4];
                raw[j] = start - step;
                conic_of(raw, 0.1, before);
                raw[j] = start + step;
                conic_of(raw, 0.1, conic);
                for (int c = 0; c < 3 + compensated; c++)
                    want += weight[c] * (conic[c] - before[c]) / (2 * step);
                raw[j] = start;
                error[j > 3] += (got - want) * (got - want);
                norm[j > 3] += want * want;
            }
            for (int j = 0; j < 2; j++) worst[j] = test_most(worst[j], sqrt(error[j] / norm[j]));
        }
        if (!CHECK(worst[0] < (real64 ? 1e-6 : 1e-5) && worst[1] < (real64 ? 1e-6 : 1e-5)))
            printf("    needles%s: rotations off by %.3g, scales by %.3g\n",
                   compensated ? ", compensated" : "", worst[0], worst[1]);
    }
    free(gaussians);
    free(gradient);
    free(splat);
}

/* d ln(opacity) / d logit is 1 - opacity, also where that is far below what rounding leaves of 1; and none
   beyond the clamp of logits. */
static void test_opaque(void) {
    enum { MANY = 16, VALUES = SSDGS_CHANNELS * MANY };
    ssdgs_real *gaussians = reals(VALUES), *gradient = reals(VALUES), *splat = reals(MANY * SSDGS__SPLAT),
               slot[12];
    ssdgs__projection view;
    memset(&view, 0, sizeof view);
    view.view[0] = view.view[5] = view.view[10] = view.fx = view.fy = 1;
    view.orthographic = 1;
    view.depth_scale = view.presence = 1;
    view.variance = (ssdgs_real)0.1;
    memset(gaussians, 0, VALUES * sizeof *gaussians);
    memset(gradient, 0, VALUES * sizeof *gradient);
    memset(splat, 0, MANY * SSDGS__SPLAT * sizeof *splat);
    for (int i = 0; i < MANY; i++) {
        gaussians[SSDGS_ROTATION * MANY + i] = 1;
        gaussians[SSDGS_OPACITY * MANY + i] = (ssdgs_real)(3 * i - 20); /* -20 .. 25 */
        splat[i * SSDGS__SPLAT + 5] = 2;
    }
    const ssdgs__project_gradient d = {splat, gradient, MANY, slot};
    context->k->project_backward(&view, gaussians, MANY, 0, MANY, &d);
    for (int i = 0; i < MANY; i++) {
        const double logit = 3 * i - 20, want = fabs(logit) < 20 ? 2 / (1 + exp(logit)) : 0;
        CHECK(test_error((double)gradient[SSDGS_OPACITY * MANY + i], want, 0, real64 ? 1e-14 : 2e-6) <= 1);
    }
    free(gaussians);
    free(gradient);
    free(splat);
}

static void test_adam(void) {
    if (!gold_open(&file, "adam")) return;
    ssdgs_real *p = gold_reals("start");
    ssdgs_real *g = gold_reals("grads");
    size_t n;
    gold(&file, "start", &n);
    const size_t steps = gold_find(&file, "grads")->dims[0];
    ssdgs_real *m = reals(n);
    ssdgs_real *v = reals(n);
    const ssdgs_real rate = (ssdgs_real)gold(&file, "lr", NULL)[0];
    for (size_t t = 0; t < steps; t++) {
        const ssdgs__adam_rate step = {rate, ssdgs__bias_correction(0.9, (int)t + 1),
                                       ssdgs__bias_correction(0.999, (int)t + 1), (ssdgs_real)1e-15};
        context->k->adam(p, g + t * n, m, v, n, &step);
        CHECK_NEAR(p, gold(&file, "trajectory", NULL) + t * n, n, real64 ? 1e-12 : 1e-6, real64 ? 1e-9 : 2e-6,
                   "adam: trajectory");
    }
    free(p);
    free(g);
    free(m);
    free(v);
    gold_close(&file);
}

/* All four terms, both networks, the loss, and back to every parameter, the light and the pose. */
static void test_full(const char *name, int defaults) {
    ssdgs_settings settings = defaults ? ssdgs_settings_default() : ssdgs_settings_published();
    ssdgs__buffer memory = {0, 0};
    if (!gold_open(&file, name)) return;
    settings.asg = SSDGS_ASG_GEOMETRIC;
    settings.transport = 0;
    settings.pixel_variance = (ssdgs_real)0.3;
    settings.depth_cue = defaults;
    settings.octaves.view = settings.octaves.light = 4;
    if (defaults) settings.scattering.width = 64; /* the golden network's */
    if (defaults) settings.length_unit = (ssdgs_real)gold(&file, "length_unit", NULL)[0];
    ssdgs_model *model = gold_geometry(&settings);
    ssdgs_model_view view = ssdgs_model_arrays(model);
    size_t stride = view.stride;
    to_planes("kd_raw", view.gaussians + SSDGS_DIFFUSE * stride, stride);
    to_planes("ks_raw", view.gaussians + SSDGS_SPECULAR * stride, stride);
    to_planes("ksss_raw", view.gaussians + SSDGS_SCATTERING * stride, stride);
    to_planes("frame_quat", view.gaussians + SSDGS_FRAME * stride, stride);
    to_planes("asg_weight_raw", view.gaussians + SSDGS_ASG_WEIGHT * stride, stride);
    to_planes("material", view.gaussians + SSDGS_MATERIAL * stride, stride);
    for (size_t i = 0; i < 32; i++) view.asg_basis[i] = (ssdgs_real)gold(&file, "asg_quat", NULL)[i];
    for (size_t i = 0; i < 16; i++)
        view.asg_sharpness[i] = (ssdgs_real)gold(&file, "asg_log_lambda_mu", NULL)[i];
    CHECK(gold_find(&file, "sss_weights")->count == view.scattering_count);
    CHECK(gold_find(&file, "shadow_weights")->count == view.shadow_count);
    for (size_t i = 0; i < view.scattering_count; i++)
        view.scattering[i] = (ssdgs_real)gold(&file, "sss_weights", NULL)[i];
    for (size_t i = 0; i < view.shadow_count; i++)
        view.shadow[i] = (ssdgs_real)gold(&file, "shadow_weights", NULL)[i];
    ssdgs_camera camera = gold_camera();
    size_t n = (size_t)model->count;
    const size_t pixels = (size_t)camera.width * (size_t)camera.height;
    ssdgs_light light;
    memset(&light, 0, sizeof light);
    for (int c = 0; c < 3; c++) {
        light.position[c] = (ssdgs_real)gold(&file, "light", NULL)[c];
        light.intensity[c] = 1;
    }
    ssdgs_frame frame;
    begin(&frame, model, &camera, &light, 1, gold(&file, "background", NULL));
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_PROJECT, SSDGS_STAGE_WALK));
    size_t i;
    for (i = 0; i < n; i++) { /* given and fixed; every Gaussian is compared, so every one is shaded */
        frame.visibility[i] = (ssdgs_real)gold(&file, "visibility", NULL)[i];
        if (frame.depth_cue) frame.depth_cue[i] = (ssdgs_real)gold(&file, "depth_cue", NULL)[i];
        frame.seen[i] = 1;
    }
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_SHADE, SSDGS_STAGE_COMPOSITE));
    double *rows = (double *)malloc((3 * pixels + 3 * n) * sizeof *rows);
#define COMPONENT(array, golden, width) \
    do { \
        for (i = 0; i < n * (width); i++) rows[i] = (double)frame.array[4 * (i / (width)) + i % (width)]; \
        CHECK_NEAR(rows, gold(&file, golden, NULL), n *(width), value_bound(), 0, golden); \
    } while (0)
    COMPONENT(color, "color", 3);
    COMPONENT(shadow, "shadow", 1);
    for (int c = 0; c < 3; c++) { /* the file's diffuse and specular are before S */
        const char *const names[3] = {"diffuse", "specular", "scatter"};
        const ssdgs_real *from[3];
        from[0] = frame.diffuse;
        from[1] = frame.specular;
        from[2] = frame.scattering;
        for (i = 0; i < 3 * n; i++)
            rows[i] = (double)from[c][4 * (i / 3) + i % 3] / (c < 2 ? gold(&file, "shadow", NULL)[i / 3] : 1);
        CHECK_NEAR(rows, gold(&file, names[c], NULL), 3 * n, value_bound(), 0, names[c]);
    }
    ssdgs_real *image = reals(3 * pixels);
    ssdgs_real *slope = reals(3 * pixels);
    ssdgs_real *target = reals(3 * pixels);
    for (int c = 0; c < 3; c++)
        for (i = 0; i < pixels; i++)
            image[pixels * (size_t)c + i] =
                frame.pixels[pixels * (size_t)c + i] + frame.transmittance[i] * frame.options.background[c];
    check_image("image", image, value_bound());
    if (defaults) context->k->srgb_encode(image, slope, image, 3 * pixels);
    gold_planes("target", target);
    ssdgs__loss_values values;
    const ssdgs__images images = {image, target, camera.width, camera.height};
    CHECK(!ssdgs__loss(context, &memory, &images, 0, frame.pixel_gradient, &values));
    double loss[1];
    loss[0] = values.loss;
    CHECK_NEAR(loss, gold(&file, "loss", NULL), 1, value_bound(), 0, "full: loss");
    for (i = 0; i < 3 * pixels && defaults; i++) frame.pixel_gradient[i] *= slope[i];
    through_background(&frame);
    CHECK(!ssdgs__run_stages(&frame, SSDGS_STAGE_COMPOSITE_BACKWARD, SSDGS_STAGE_PROJECT_BACKWARD));
#define GRADIENT(golden, plane) \
    check_planes(golden, frame.gradient + (size_t)(plane)*stride, stride, gradient_bound())
    GRADIENT("grad_mean", SSDGS_POSITION);
    GRADIENT("grad_quat", SSDGS_ROTATION);
    GRADIENT("grad_log_scale", SSDGS_LOG_SCALE);
    GRADIENT("grad_opacity_logit", SSDGS_OPACITY);
    GRADIENT("grad_kd_raw", SSDGS_DIFFUSE);
    GRADIENT("grad_ks_raw", SSDGS_SPECULAR);
    GRADIENT("grad_ksss_raw", SSDGS_SCATTERING);
    GRADIENT("grad_frame_quat", SSDGS_FRAME);
    GRADIENT("grad_asg_weight_raw", SSDGS_ASG_WEIGHT);
    GRADIENT("grad_material", SSDGS_MATERIAL);
    size_t first[SSDGS__GLOBAL_GROUPS + 1];
    ssdgs__global_groups(&settings, first);
    CHECK_L2(frame.global_gradient, gold(&file, "grad_asg_quat", NULL), 32, gradient_bound(),
             "full: grad_asg_quat");
    CHECK_L2(frame.global_gradient + first[1], gold(&file, "grad_asg_log_lambda_mu", NULL), 16,
             gradient_bound(), "full: grad_asg_log_lambda_mu");
    CHECK_L2(frame.global_gradient + first[3], gold(&file, "grad_sss_weights", NULL), view.scattering_count,
             gradient_bound(), "full: grad_sss_weights");
    CHECK_L2(frame.global_gradient + first[4], gold(&file, "grad_shadow_weights", NULL), view.shadow_count,
             gradient_bound(), "full: grad_shadow_weights");
    CHECK_L2(frame.light_gradient, gold(&file, "grad_light", NULL), 3, gradient_bound(), "full: grad_light");
    ssdgs_photo photo;
    memset(&photo, 0, sizeof photo);
    double zero[10];
    memset(zero, 0, sizeof zero);
    photo.camera = camera;
    double pose[6];
    ssdgs__correct_backward(&photo, zero, frame.view_gradient, pose);
    CHECK_L2(pose, gold(&file, "grad_pose", NULL), 6, gradient_bound(), "full: grad_pose");
    free(rows);
    free(image);
    free(slope);
    free(target);
    ssdgs__release(context, memory.memory);
    ssdgs_model_destroy(model);
    gold_close(&file);
}

int main(void) {
    const char *only = getenv("SSDGS_TEST_ISA");
    int found = 0, has[SSDGS_ISA_COUNT] = {0};
    for (int isa = SSDGS_ISA_SCALAR; isa < SSDGS_ISA_COUNT; isa++) {
        ssdgs_context_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.isa = (ssdgs_isa)isa;
        if (only && strcmp(only, ssdgs_isa_string((ssdgs_isa)isa))) continue;
        const ssdgs_result result = ssdgs_context_create(&desc, &context);
        if (result) {
            CHECK(result == SSDGS_ERR_ISA);
            printf("skipped: %s\n", ssdgs_isa_string((ssdgs_isa)isa));
            continue;
        }
        printf("%s%s\n", ssdgs_isa_string((ssdgs_isa)isa), real64 ? " in double" : "");
        found = has[isa] = 1;
        test_raster();
        test_light_pass("shadow_bias0");
        test_light_pass("shadow_bias1");
        test_asg();
        test_network("sss_mlp", 0, 0, 0);
        test_network("sss_mlp_default", 0, 1, 1);
        test_network("shadow_mlp", 1, 0, 0);
        test_network("shadow_mlp", 1, 1, 1);
        test_loss();
        test_needles();
        test_opaque();
        test_adam();
        test_full("full", 0);
        test_full("full_default", 1);
        ssdgs_context_destroy(context);
    }
#if SSDGS__X86 >= 2 && defined(__GNUC__) && !defined(__TINYC__) && !defined(SSDGS_REAL64)
    if (!only) /* what this CPU has was run */
        CHECK(has[SSDGS_ISA_AVX2] == (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")));
#endif
    CHECK(found);
    printf("figure golden_max_abs_image%s %.3g\nfigure golden_max_rel_grad_f%d %.3g\n", real64 ? "_f64" : "",
           image_error, real64 ? 64 : 32, test_worst_l2);
    TEST_END();
}
