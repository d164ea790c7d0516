/* Materials changed and made in code, also as real64: an object's roughness, strength of highlights,
   translucency and mask; media and mirrors beside what path tracing says of balls. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "scene.h"

static double exactly(double floats) { return real64 ? 1e-9 : floats; }

static ssdgs_settings settings_of(int asg) {
    ssdgs_settings s = small_settings();
    s.asg = asg;
    return s;
}

/* ---- objects that differ from their model ---- */

static void show(const ssdgs_object *object, const ssdgs_light *lights, int count, const ssdgs_real sky,
                 picture *p) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    ssdgs_render_options options = ssdgs_render_options_exact();
    for (int c = 0; c < 3; c++) options.ambient[0][c] = sky;
    together(object, 1, &camera, lights, count, &options, p);
}

/* As a model whose Gaussians were written so: tint, strength of highlights, and of deferred ones their
   sharpness. Those that the mask leaves out stay; half a mask is half of the way. */
static void test_edits(int asg) {
    enum { COUNT = 200 };
    const ssdgs_settings settings = settings_of(asg);
    const ssdgs_light lights[2] = {point_light(2, -2, 2), parallel_light(0.6, 0, 0.8)};
    unsigned char mask[COUNT];
    for (int i = 0; i < COUNT; i++) mask[i] = (unsigned char)(i % 3 == 0 ? 255 : i % 3 == 1 ? 0 : 102);
    for (int masked = 0; masked < 2; masked++)
        for (int sky = 0; sky < 2; sky++) {
            ssdgs_model *model = cloud(&settings, 0, COUNT, 0.6), *written = cloud(&settings, 0, COUNT, 0.6);
            ssdgs_object object = ssdgs_object_default(model), same_object = ssdgs_object_default(written);
            object.tint[0] = (ssdgs_real)0.4;
            object.tint[2] = (ssdgs_real)1.5;
            object.specular = 3;
            if (masked) object.mask = mask;
            for (int i = 0; i < COUNT; i++) {
                ssdgs_gaussian g;
                const ssdgs_real share = masked ? (ssdgs_real)mask[i] / 255 : 1;
                CHECK(!ssdgs_model_get(written, i, &g));
                for (int c = 0; c < 3; c++) {
                    const ssdgs_real tint = 1 + share * (object.tint[c] - 1);
                    g.diffuse[c] *= tint;
                    g.specular[c] *= tint * (1 + share * 2);
                    g.scattering[c] *= tint;
                }
                CHECK(!ssdgs_model_set(written, i, &g));
            }
            show(&object, lights, 2, (ssdgs_real)sky, shot);
            show(&same_object, lights, 2, (ssdgs_real)sky, shot + 1);
            CHECK_NEAR(shot[0].value, shot[1].value, VALUES, exactly(2e-5), exactly(2e-4),
                       "tint and strength");
            object.tint[0] = object.tint[2] = object.specular = 1;
            show(&object, lights, 2, (ssdgs_real)sky, shot + 1);
            object.mask = NULL;
            show(&object, lights, 2, (ssdgs_real)sky, shot + 2);
            CHECK(same(shot + 1, shot + 2) && !same(shot, shot + 2)); /* nothing to take */
            ssdgs_model_destroy(model);
            ssdgs_model_destroy(written);
        }
}

/* The mean brightness of a large facet's highlight under lights all over the sky is as before, whatever the
   roughness; its middle is brighter where it is smoother. */
static void test_roughness(int asg) {
    static ssdgs_light lights[600];
    enum { MANY = 600 };
    ssdgs_settings settings = settings_of(asg);
    settings.terms = SSDGS_SPECULAR_TERM;
    ssdgs_model *model = NULL;
    ssdgs_gaussian g = ssdgs_gaussian_default();
    const ssdgs_real facing[3] = {(ssdgs_real)0.4, (ssdgs_real)-2.2, (ssdgs_real)0.8};
    CHECK(!ssdgs_model_create(context, &settings, 1, &model));
    for (int c = 0; c < 3; c++) {
        g.scale[c] = (ssdgs_real)0.3;
        g.normal[c] = facing[c];
    }
    g.opacity = (ssdgs_real)0.9;
    g.sharpness[0] = 4;
    g.sharpness[1] = 6;
    CHECK(!ssdgs_model_set(model, 0, &g));
    for (int i = 0; i < MANY; i++) {
        double from[3];
        direction_of(i, MANY, from);
        lights[i] = parallel_light(from[0], from[1], from[2]);
        lights[i].unshadowed = 1;
        /* geometric lobes do not end at the horizon: the sky does */
        double above = 0;
        for (int c = 0; c < 3; c++) above += (double)(lights[i].position[c] * facing[c]);
        if (above < 0) memset(lights[i].intensity, 0, sizeof lights[i].intensity);
    }
    ssdgs_object object = ssdgs_object_default(model);
    const ssdgs_light ahead = parallel_light(0.4 / 2.3748, -2.2 / 2.3748, 0.8 / 2.3748);
    const int middle = 6 * PIXELS + 3 * (SIDE / 2 * SIDE + SIDE / 2);
    double even = 0, last = 1e9;
    for (int i = 0; i < 5; i++) {
        static const double roughness[5] = {1, 0.5, 0.8, 1.25, 2};
        object.roughness = (ssdgs_real)roughness[i];
        show(&object, lights, MANY, 0, shot);
        const double all = (double)shot[0].value[middle];
        if (!i) even = all;
        if (!real64)
            printf("figure roughness_%d_%.0f %.3f of the light\n", asg, 100 * roughness[i], all / even);
        CHECK(fabs(all / even - 1) < 0.12);
        if (!i) { /* a sky of the radiance that the lights are together */
            show(&object, NULL, 0, MANY / (ssdgs_real)4, shot + 1);           /* red has intensity 1 */
            const double of_sky = (double)shot[1].value[middle - 6 * PIXELS]; /* in scattering */
            if (!CHECK(fabs(of_sky / all - 1) < (asg == SSDGS_ASG_DEFERRED ? 0.03 : 0.1)))
                printf("    %d: %g of the sky, %g of lights\n", asg, of_sky, all);
        }
        show(&object, &ahead, 1, 0, shot + 1);
        if (i > 0) CHECK((double)shot[1].value[middle] < last);
        if (i > 0) last = (double)shot[1].value[middle];
        show(&object, NULL, 0, 1, shot + 2); /* ambient light sees the same of each */
        if (!i) shot[3] = shot[2];
        CHECK_NEAR(shot[2].value, shot[3].value, 3 * PIXELS, exactly(1e-6), exactly(1e-4),
                   "ambient of any roughness");
    }
    if (asg == SSDGS_ASG_DEFERRED) { /* as a Gaussian of that sharpness */
        object.roughness = 2;
        show(&object, &ahead, 1, 0, shot);
        g.sharpness[0] = 1;
        g.sharpness[1] = (ssdgs_real)1.5;
        CHECK(!ssdgs_model_set(model, 0, &g));
        object.roughness = 1;
        show(&object, &ahead, 1, 0, shot + 1);
        const double ratio = (double)(shot[0].value[middle] / shot[1].value[middle]);
        for (int i = 0; i < PIXELS; i++)
            for (int c = 0; c < 3; c++) shot[1].value[6 * PIXELS + 3 * i + c] *= (ssdgs_real)ratio;
        CHECK(ratio > 0.1 && ratio < 0.5);
        CHECK_NEAR(shot[0].value + 6 * PIXELS, shot[1].value + 6 * PIXELS, 3 * PIXELS, exactly(1e-6),
                   exactly(1e-4), "its form");
    }
    ssdgs_model_destroy(model);
}

/* ---- media ---- */

static const double red[3] = {40, 32, 24}, dark[3] = {0.05, 0.2, 0.8}; /* sigma_s, sigma_a: wax */
enum { BALL = 20000 };

/* What wax sends back of an irradiance of 1, in all directions: the dipole's albedo, by Jensen et al., times
   what passes the surface on the way in and out, over pi. */
static double beneath(int channel, double eta) {
    const double albedo = red[channel] / (red[channel] + dark[channel]), root = sqrt(3 * (1 - albedo));
    const double fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
    const double a = albedo / 2 * (1 + exp(-4 * (1 + fdr) / (1 - fdr) * root / 3)) * exp(-root);
    const double passed = 1 + 0.4399 - 0.7099 * eta + 0.3319 * eta * eta - 0.0636 * eta * eta * eta;
    return a * passed * passed / pi;
}

static ssdgs_model *ball(const ssdgs_settings *settings, double radius) {
    ssdgs_model *model = NULL;
    if (!CHECK(!ssdgs_model_create(context, settings, BALL, &model))) exit(1);
    for (int i = 0; i < BALL; i++) {
        double n[3];
        direction_of(i, BALL, n);
        ssdgs_gaussian g = ssdgs_gaussian_default();
        for (int c = 0; c < 3; c++) {
            g.position[c] = (ssdgs_real)((radius - 0.004) * n[c]);
            g.normal[c] = (ssdgs_real)n[c];
            g.scale[c] = (ssdgs_real)(radius * (c < 2 ? 0.018 : 0.002));
            g.scattering[c] = 1;
        }
        memset(g.diffuse, 0, sizeof g.diffuse);
        memset(g.specular, 0, sizeof g.specular);
        g.rotation[0] = 0, g.rotation[1] = g.normal[0], g.rotation[2] = g.normal[1],
        g.rotation[3] = g.normal[2] + 1;
        g.opacity = (ssdgs_real)0.99;
        CHECK(!ssdgs_model_set(model, i, &g));
    }
    CHECK(!ssdgs_model_sort(model));
    return model;
}

static ssdgs_settings wax(void) {
    ssdgs_settings s = ssdgs_settings_default();
    s.terms = SSDGS_SCATTERING_TERM;
    s.scattering.layers = s.shadow.layers = 0;
    s.eta = 1;
    for (int c = 0; c < 3; c++) {
        s.medium.scattering[c] = (ssdgs_real)red[c];
        s.medium.absorption[c] = (ssdgs_real)dark[c];
    }
    return s;
}

static uint64_t drawn;
static double next(void) { return test_uniform(77, drawn++); }

/* How far it is from x along d to the surface of a ball around 0. */
static double way_out(const double x[3], const double d[3], double radius) {
    double along = 0, x2 = 0;
    for (int c = 0; c < 3; c++) {
        along += x[c] * d[c];
        x2 += x[c] * x[c];
    }
    return -along + sqrt(fmax(0, along * along + radius * radius - x2));
}

/* Radiance that leaves a ball of a medium, isotropic and of the index around it, against a ray, by so many
   paths: at each place where light scatters, the sun's. */
static double traced(const double x0[3], const double d0[3], const double sun[3], double radius,
                     double scattering, double absorption, int paths) {
    double sum = 0;
    for (int path = 0; path < paths; path++) {
        double x[3], d[3], weight = 1;
        for (int c = 0; c < 3; c++) x[c] = x0[c], d[c] = d0[c];
        for (int bounce = 0; bounce < 2000; bounce++) {
            const double step = -log(1 - next()) / (scattering + absorption);
            if (step >= way_out(x, d, radius)) break;
            for (int c = 0; c < 3; c++) x[c] += step * d[c];
            weight *= scattering / (scattering + absorption);
            sum += weight * exp(-(scattering + absorption) * way_out(x, sun, radius)) / (4 * pi);
            if (weight < 0.1) {
                if (next() < 0.5) break;
                weight *= 2;
            }
            const double z = 1 - 2 * next(), across = sqrt(1 - z * z), turn = 2 * pi * next();
            d[0] = across * cos(turn), d[1] = across * sin(turn), d[2] = z;
        }
    }
    return sum / paths;
}

/* The ray through the middle of a pixel: where it meets the ball, and whether it does. */
static int meets(const ssdgs_camera *camera, int pixel, double radius, double x[3], double d[3]) {
    double eye[3], along = 0, eye2 = 0, length = 0;
    const double u = (pixel % SIDE + 0.5 - (double)camera->cx) / (double)camera->fx;
    const double v = (pixel / SIDE + 0.5 - (double)camera->cy) / (double)camera->fy;
    for (int c = 0; c < 3; c++) {
        d[c] = (double)(camera->view[c]) * u + (double)camera->view[4 + c] * v + (double)camera->view[8 + c];
        length += d[c] * d[c];
        eye[c] = -(double)(camera->view[c] * camera->view[3] + camera->view[4 + c] * camera->view[7] +
                           camera->view[8 + c] * camera->view[11]);
    }
    for (int c = 0; c < 3; c++) {
        d[c] /= sqrt(length);
        along += eye[c] * d[c];
        eye2 += eye[c] * eye[c];
    }
    const double root = along * along - eye2 + radius * radius;
    for (int c = 0; c < 3; c++) x[c] = eye[c] + (-along - sqrt(fmax(root, 0))) * d[c];
    return root > 0.02 * radius * radius; /* not the very rim */
}

/* A picture's pixels, where given, beside others in sRGB, the brightest white. */
static double decibels(const ssdgs_real *color, const double *want, const unsigned char *given) {
    double white = 1e-9, error2 = 0, count = 0;
    for (int i = 0; i < 3 * PIXELS; i++)
        if (given[i / 3]) white = fmax(white, want[i]);
    for (int i = 0; i < 3 * PIXELS; i++) {
        if (!given[i / 3]) continue;
        const double d = (double)ssdgs_srgb_encode((ssdgs_real)fmin(1, fmax((double)color[i] / white, 0))) -
                         (double)ssdgs_srgb_encode((ssdgs_real)(want[i] / white));
        error2 += d * d;
        count++;
    }
    return -10 * log10(error2 / count);
}

/* A ball of wax, lit from beside the camera, from the side and from behind. */
static void test_wax(void) {
    static double want[3 * PIXELS];
    static unsigned char given[PIXELS];
    const ssdgs_settings settings = wax();
    ssdgs_model *model = ball(&settings, 0.5);
    const ssdgs_camera camera = camera_from(0, -2, 0);
    for (int side = 0; side < 3; side++) {
        static const double suns[3][3] = {{0.48, -0.8, 0.36}, {0.96, 0, 0.28}, {0.6, 0.8, 0}};
        ssdgs_light sun = parallel_light(suns[side][0], suns[side][1], suns[side][2]);
        for (int c = 0; c < 3; c++) sun.intensity[c] = 1;
        alone(model, &camera, &sun, 1, NULL, shot);
        memset(given, 0, sizeof given);
        for (int pixel = 0; pixel < PIXELS; pixel += 3) {
            double x[3], d[3];
            if (!meets(&camera, pixel, 0.5, x, d)) continue;
            given[pixel] = 1;
            for (int c = 0; c < 3; c++)
                want[3 * pixel + c] = traced(x, d, suns[side], 0.5, red[c], dark[c], 150);
        }
        const double dB = decibels(shot[0].value, want, given);
        double ratio[3];
        for (int c = 0; c < 3; c++) {
            double sums[2] = {0, 0};
            for (int pixel = 0; pixel < PIXELS; pixel++)
                if (given[pixel])
                    sums[0] += (double)shot[0].value[3 * pixel + c], sums[1] += want[3 * pixel + c];
            ratio[c] = sums[0] / sums[1];
        }
        printf("figure wax_%d %.1f dB from path tracing; in all %.2f, %.2f, %.2f of the light\n", side, dB,
               ratio[0], ratio[1], ratio[2]);
        CHECK(dB > 26 - 4 * side);
    }
    ssdgs_model_destroy(model);
}

/* A Gaussian that is not finite leaves its neighbours as they are, and so does a light too far away for a
   distance^2. */
static void test_broken(void) {
    ssdgs_settings settings = wax();
    settings.terms = SSDGS_ALL_TERMS;
    ssdgs_model *model = cloud(&settings, 0, 200, 0.5);
    const ssdgs_object object = ssdgs_object_default(model);
    ssdgs_light lights[2] = {point_light(1, -2, 2), point_light(real64 ? 1e200 : 1e25, 0, 0)};
    for (int i = 0; i < 4; i++) {
        const ssdgs_model_view v = ssdgs_model_arrays(model);
        const size_t at = i % 2 ? 70 : 0; /* of the first block, and so of another */
        const ssdgs_real was = v.gaussians[at], opacity = v.gaussians[SSDGS_OPACITY * v.stride + at];
        v.gaussians[SSDGS_OPACITY * v.stride + at] = -20; /* shows nothing */
        show(&object, lights, 1, 0, shot);
        if (i < 2) show(&object, lights, 2, 0, shot + 1);
        else {
            ssdgs_model_arrays(model);
            v.gaussians[at] = (ssdgs_real)(i % 2 ? INFINITY : NAN);
            show(&object, lights, 1, 0, shot + 1);
            ssdgs_model_arrays(model);
        }
        v.gaussians[at] = was;
        v.gaussians[SSDGS_OPACITY * v.stride + at] = opacity;
        CHECK(!shot[1].stats.blackened && shot[1].stats.shaded == shot[0].stats.shaded);
        CHECK_NEAR(shot[1].value, shot[0].value, 3 * PIXELS, 1e-4, 1e-3, "beside what is broken");
    }
    ssdgs_model_destroy(model);
}

/* Twice as translucent is a medium of half the density; light that no one shadows scatters as beneath a
   plane; so does ambient light. What is kept of another translucency does not serve. */
static void test_translucency(void) {
    ssdgs_settings settings = wax(), thin = wax();
    thin.eta = settings.eta = (ssdgs_real)1.3;
    for (int c = 0; c < 3; c++) {
        thin.medium.scattering[c] /= 2;
        thin.medium.absorption[c] /= 2;
    }
    ssdgs_model *model = ball(&settings, 0.5), *thinner = ball(&thin, 0.5);
    ssdgs_object object = ssdgs_object_default(model), thin_object = ssdgs_object_default(thinner);
    const ssdgs_light sun = parallel_light(0.96, 0, 0.28);
    show(&thin_object, &sun, 1, 0, shot);
    show(&object, &sun, 1, 0, shot + 1);
    object.translucency = 2;
    for (int again = 0; again < 2; again++) {
        show(&object, &sun, 1, 0, shot + 2);
        CHECK_NEAR(shot[2].value, shot[0].value, 3 * PIXELS, exactly(2e-5), exactly(2e-4),
                   "twice as translucent");
    }
    object.translucency = 1;
    show(&object, &sun, 1, 0, shot + 2);
    CHECK(same(shot + 1, shot + 2) && !same(shot, shot + 1));
    /* from the file too */
    const char *const path = real64 ? "build/t_material_64.ply" : "build/t_material.ply";
    CHECK(!ssdgs_model_save(model, path));
    ssdgs_model *loaded = NULL;
    CHECK(!ssdgs_model_load(context, path, &loaded, NULL));
    CHECK(!memcmp(&ssdgs_model_settings(loaded)->medium, &settings.medium, sizeof settings.medium) || real64);
    ssdgs_model_destroy(loaded);
    remove(path);
    /* beneath a plane: A / pi x cos, with A of eq. 5's medium and what both surfaces let through */
    ssdgs_light plain = sun;
    plain.unshadowed = 1;
    for (int sky = 0; sky < 2; sky++) {
        const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
        double x[3], d[3], error = 0;
        show(&object, sky ? NULL : &plain, !sky, (ssdgs_real)sky, shot);
        for (int pixel = 0; pixel < PIXELS; pixel++) {
            if (!meets(&camera, pixel, 0.5, x, d) || shot[0].value[15 * PIXELS + pixel] < (ssdgs_real)0.99)
                continue;
            const double cosine = (x[0] * 0.96 + x[2] * 0.28) / 0.5;
            if (!sky && cosine < 0.3) continue;
            for (int c = 0; c < 3; c++) {
                const double irradiance = sky ? 1 : cosine * (double)plain.intensity[c];
                const double got = (double)shot[0].value[3 * pixel + c] / irradiance;
                error = test_most(error, fabs(got / beneath(c, 1.3) - 1));
            }
        }
        if (!real64) printf("figure beneath_a_plane_%d %.2f off\n", sky, error);
        CHECK(error < 0.12);
    }
    ssdgs_model_destroy(model);
    ssdgs_model_destroy(thinner);
}

/* A facet under an unshadowed light from its normal sends A / pi of it, whatever part of that its lengths can
   tell. What networks make of transport changes with translucency at once. */
static void test_media(void) {
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    const ssdgs_real facing[3] = {(ssdgs_real)(0.4 / 2.37487), (ssdgs_real)(-2.2 / 2.37487),
                                  (ssdgs_real)(0.8 / 2.37487)};
    for (int k = 0; k < 4; k++) {
        static const double density[4] = {0.05, 1, 30, 1000};
        ssdgs_settings settings = wax();
        ssdgs_model *model = NULL;
        ssdgs_gaussian g = ssdgs_gaussian_default();
        settings.eta = (ssdgs_real)1.4;
        for (int c = 0; c < 3; c++) {
            settings.medium.scattering[c] = (ssdgs_real)(red[c] * density[k]);
            settings.medium.absorption[c] = (ssdgs_real)(dark[c] * density[k]);
            g.normal[c] = facing[c];
            g.scale[c] = (ssdgs_real)0.3;
            g.scattering[c] = 1;
        }
        g.opacity = (ssdgs_real)0.9;
        CHECK(!ssdgs_model_create(context, &settings, 1, &model) && !ssdgs_model_set(model, 0, &g));
        ssdgs_light light = parallel_light((double)facing[0], (double)facing[1], (double)facing[2]);
        light.unshadowed = 1;
        alone(model, &camera, &light, 1, &exact, shot);
        const int middle = SIDE / 2 * SIDE + SIDE / 2;
        for (int c = 0; c < 3; c++) {
            const double got = (double)(shot[0].value[3 * middle + c] / shot[0].value[15 * PIXELS + middle]);
            CHECK(fabs(got / (beneath(c, 1.4) * (double)light.intensity[c]) - 1) < 1e-4);
        }
        ssdgs_model_destroy(model);
    }
    const ssdgs_settings settings = settings_of(SSDGS_ASG_DEFERRED);
    ssdgs_model *model = cloud(&settings, 0, 200, 0.6);
    ssdgs_object object = ssdgs_object_default(model);
    const ssdgs_light light = point_light(2, -2, 2);
    ssdgs_scene *const kept = scene;
    show(&object, &light, 1, 0, shot);
    show(&object, &light, 1, 0, shot);
    object.translucency = 2;
    show(&object, &light, 1, 0, shot + 1);
    CHECK(!ssdgs_scene_create(context, &scene));
    show(&object, &light, 1, 0, shot + 2);
    ssdgs_scene_destroy(scene);
    scene = kept;
    CHECK(same(shot + 1, shot + 2) && !same(shot, shot + 1));
    ssdgs_model_destroy(model);
}

/* ---- mirrors ---- */

/* Beckmann's microfacets with Smith's shadowing and Schlick's Fresnel: radiance of irradiance 1 at right
 * angles. */
static double microfacets(const double n[3], const double wi[3], const double wo[3], double alpha,
                          double f0) {
    double h[3], length = 0, nh = 0, woh = 0, to_light = 0, to_eye = 0;
    for (int c = 0; c < 3; c++) {
        h[c] = wi[c] + wo[c];
        length += h[c] * h[c];
        to_light += n[c] * wi[c];
        to_eye += n[c] * wo[c];
    }
    if (to_light <= 0 || to_eye <= 0) return 0;
    for (int c = 0; c < 3; c++) {
        nh += n[c] * h[c] / sqrt(length);
        woh += wo[c] * h[c] / sqrt(length);
    }
    double g = 1;
    for (int i = 0; i < 2; i++) {
        const double cosine = i ? to_eye : to_light,
                     a = cosine / (alpha * sqrt(fmax(1 - cosine * cosine, 1e-12)));
        if (a < 1.6) g *= (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a);
    }
    const double tan2 = (1 - nh * nh) / (nh * nh),
                 density = exp(-tan2 / (alpha * alpha)) / (pi * alpha * alpha * pow(nh, 4));
    return density * g * (f0 + (1 - f0) * pow(1 - woh, 5)) / (4 * to_eye);
}

static void test_metal(void) {
    static double want[3 * PIXELS];
    static unsigned char given[PIXELS];
    static const double gold[3] = {1, 0.78, 0.34}, sun[3] = {0.48, -0.8, 0.36};
    ssdgs_settings settings = ssdgs_settings_default();
    settings.terms = SSDGS_SPECULAR_TERM;
    ssdgs_model *model = ball(&settings, 0.5);
    for (int i = 0; i < 2 * SSDGS_ASG_COUNT; i++) /* other lobes, which the mirror's replace */
        ssdgs_model_arrays(model).asg_sharpness[i] = 2;
    const ssdgs_camera camera = camera_from(0, -2, 0);
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    ssdgs_light light = parallel_light(sun[0], sun[1], sun[2]);
    for (int c = 0; c < 3; c++) light.intensity[c] = 1;
    for (int k = 0; k < 3; k++) {
        static const double alpha[3] = {0.15, 0.3, 0.6};
        const ssdgs_real roughness[2] = {(ssdgs_real)alpha[k], (ssdgs_real)alpha[k]};
        for (int i = 0; i < BALL; i++) {
            ssdgs_gaussian g;
            CHECK(!ssdgs_model_get(model, i, &g));
            CHECK(!ssdgs_gaussian_mirror(model, roughness, &g));
            for (int c = 0; c < 3; c++) g.specular[c] *= (ssdgs_real)gold[c];
            g.f0 = (ssdgs_real)0.9;
            CHECK(!ssdgs_model_set(model, i, &g));
        }
        for (int i = 0; i < SSDGS_ASG_COUNT; i++) /* by the blended normal alone */
            CHECK(ssdgs_model_arrays(model).asg_sharpness[2 * i + 1] < -15);
        alone(model, &camera, &light, 1, &exact, shot);
        memset(given, 0, sizeof given);
        for (int pixel = 0; pixel < PIXELS; pixel++) {
            double x[3], d[3];
            if (!meets(&camera, pixel, 0.5, x, d)) continue;
            const double n[3] = {x[0] / 0.5, x[1] / 0.5, x[2] / 0.5}, wo[3] = {-d[0], -d[1], -d[2]};
            given[pixel] = 1;
            for (int c = 0; c < 3; c++)
                want[3 * pixel + c] = gold[c] * microfacets(n, sun, wo, alpha[k], 0.9);
        }
        const double dB = decibels(shot[0].value, want, given);
        double sums[2] = {0, 0};
        for (int pixel = 0; pixel < PIXELS; pixel++)
            if (given[pixel]) sums[0] += (double)shot[0].value[3 * pixel], sums[1] += want[3 * pixel];
        printf("figure metal_%.0f %.1f dB from microfacets, %.2f of the light\n", 100 * alpha[k], dB,
               sums[0] / sums[1]);
        CHECK(dB > (k == 0   ? 35
                    : k == 1 ? 28.5
                             : 16) &&
              sums[0] / sums[1] > (k < 2 ? 0.9 : 0.6) && sums[0] / sums[1] < 1.1);
    }
    ssdgs_model_destroy(model);
}

/* Two roughnesses, along the Gaussian's first and second axis: a facet beside microfacets under lights whose
   half vector tilts along either and between them. A quarter of a turn with the roughnesses swapped is the
   same facet, and so is one whose third axis is given as its normal. */
static void test_brushed(void) {
    static const double alpha[2] = {0.15, 0.6}, q[4] = {0.8, 0.3, -0.4, 0.33166247903554}; /* a unit's */
    const double w = q[0], x = q[1], y = q[2], z = q[3], s = sqrt(0.5);
    const double axis[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                               {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                               {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
    const ssdgs_camera camera = camera_from(2.4 * axis[2][0], 2.4 * axis[2][1], 2.4 * axis[2][2]);
    const ssdgs_render_options exact = ssdgs_render_options_exact();
    const int middle = SIDE / 2 * SIDE + SIDE / 2;
    ssdgs_settings settings = ssdgs_settings_default();
    settings.terms = SSDGS_SPECULAR_TERM;
    double at[3], ray[3], worst = 0;
    CHECK(meets(&camera, middle, 0.5, at, ray));
    const double wo[3] = {-ray[0], -ray[1], -ray[2]};
    for (int kind = 0; kind < 4; kind++) {
        const int turned = kind & 1, named = kind >> 1;
        const double turn[4] = {s * (w - z), s * (x + y), s * (y - x),
                                s * (z + w)}; /* about the third axis */
        const ssdgs_real roughness[2] = {(ssdgs_real)alpha[turned], (ssdgs_real)alpha[!turned]};
        ssdgs_model *model = NULL;
        ssdgs_gaussian g = ssdgs_gaussian_default();
        for (int c = 0; c < 4; c++) g.rotation[c] = (ssdgs_real)(turned ? turn[c] : q[c]);
        for (int c = 0; c < 3; c++) {
            g.normal[c] = (ssdgs_real)(named ? axis[2][c] : 0);
            g.scale[c] = (ssdgs_real)0.3;
        }
        g.opacity = (ssdgs_real)0.9;
        g.f0 = (ssdgs_real)0.9;
        CHECK(!ssdgs_model_create(context, &settings, 1, &model));
        CHECK(!ssdgs_gaussian_mirror(model, roughness, &g) && !ssdgs_model_set(model, 0, &g));
        for (int k = 0; k < 4; k++) {
            const double tilt = 0.15, cosine = cos(k * pi / 4), sine = sin(k * pi / 4);
            double h[3], wi[3], across[3] = {0, 0, 0}, toward = 0;
            for (int c = 0; c < 3; c++) {
                h[c] = cos(tilt) * axis[2][c] + sin(tilt) * (cosine * axis[0][c] + sine * axis[1][c]);
                toward += h[c] * wo[c];
            }
            for (int c = 0; c < 3; c++) wi[c] = 2 * toward * h[c] - wo[c];
            for (int c = 0; c < 9; c++) across[c / 3] += h[c % 3] * axis[c / 3][c % 3];
            /* Beckmann's of the roughness that lies in this direction, over its own norm */
            const double a2 = (across[0] * across[0] + across[1] * across[1]) /
                              (across[0] * across[0] / (alpha[0] * alpha[0]) +
                               across[1] * across[1] / (alpha[1] * alpha[1]));
            const double want = microfacets(axis[2], wi, wo, sqrt(a2), 0.9) * a2 / (alpha[0] * alpha[1]);
            ssdgs_light light = parallel_light(wi[0], wi[1], wi[2]);
            for (int c = 0; c < 3; c++) light.intensity[c] = 1;
            light.unshadowed = 1;
            alone(model, &camera, &light, 1, &exact, shot);
            const double got = (double)(shot[0].value[3 * middle] / shot[0].value[15 * PIXELS + middle]);
            worst = test_most(worst, fabs(got / want - 1));
            if (!CHECK(fabs(got / want - 1) < 0.1))
                printf("    turned %d, normal given %d, direction %d: %g, not %g\n", turned, named, k, got,
                       want);
        }
        ssdgs_model_destroy(model);
    }
    if (!real64) printf("figure brushed %.3f off\n", worst);
}

static void test_refused(void) {
    ssdgs_settings settings = settings_of(SSDGS_ASG_DEFERRED);
    ssdgs_model *model = cloud(&settings, 0, 5, 0.5), *none = NULL;
    ssdgs_object object = ssdgs_object_default(model);
    const ssdgs_camera camera = camera_from(0.4, -2.2, 0.8);
    const ssdgs_image image = planes_of(shot);
    for (int i = 0; i < 11; i++) {
        static const double wrong[11] = {0, 0.09, 11, -1, 1e7, 0, 11, (double)NAN, -0.01, 1.01, (double)NAN};
        object = ssdgs_object_default(model);
        *(i < 3   ? &object.roughness
          : i < 5 ? &object.specular
          : i < 8 ? &object.translucency
                  : &object.presence) = (ssdgs_real)wrong[i];
        CHECK(ssdgs_scene_render(scene, &object, 1, &camera, NULL, 0, NULL, &image, NULL) ==
              SSDGS_ERR_ARGUMENT);
        CHECK(strstr(ssdgs_error_message(context), "object 0: roughness") != NULL);
    }
    settings.scattering.layers = 0;
    CHECK(ssdgs_model_create(context, &settings, 1, &none) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "medium.scattering") != NULL);
    settings = wax();
    settings.transport = 0;
    CHECK(ssdgs_model_create(context, &settings, 1, &none) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "transport = 1") != NULL);
    settings = wax();
    settings.scattering.layers = 1;
    CHECK(ssdgs_model_create(context, &settings, 1, &none) == SSDGS_ERR_ARGUMENT);
    const ssdgs_real fine[2] = {(ssdgs_real)0.3, (ssdgs_real)0.3}, rough[2] = {(ssdgs_real)0.3, 2};
    ssdgs_gaussian g = ssdgs_gaussian_default();
    CHECK(ssdgs_gaussian_mirror(model, rough, &g) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "roughness[1] = 2") != NULL);
    CHECK(ssdgs_gaussian_mirror(model, NULL, &g) == SSDGS_ERR_ARGUMENT);
    CHECK(ssdgs_gaussian_mirror(model, fine, NULL) == SSDGS_ERR_ARGUMENT);
    ssdgs_model_destroy(model);
    settings = settings_of(SSDGS_ASG_GEOMETRIC);
    CHECK(!ssdgs_model_create(context, &settings, 1, &model));
    CHECK(ssdgs_gaussian_mirror(model, fine, &g) == SSDGS_ERR_ARGUMENT);
    CHECK(strstr(ssdgs_error_message(context), "geometric") != NULL);
    ssdgs_model_destroy(model);
    settings = wax();
    CHECK(!ssdgs_model_create(context, &settings, 1, &model));
    unsigned char pixels[4 * 16 * 16];
    memset(pixels, 200, sizeof pixels);
    ssdgs_photo photo;
    memset(&photo, 0, sizeof photo);
    photo.camera = camera;
    photo.camera.width = photo.camera.height = 16;
    photo.light = point_light(2, -2, 2);
    photo.pixels = pixels;
    ssdgs_trainer *trainer = NULL;
    CHECK(ssdgs_trainer_create(model, &photo, 1, NULL, &trainer) == SSDGS_ERR_ARGUMENT && !trainer);
    CHECK(strstr(ssdgs_error_message(context), "not trained") != NULL);
    ssdgs_model_destroy(model);
}

int main(void) {
    if (!CHECK(!ssdgs_context_create(NULL, &context)) || !CHECK(!ssdgs_scene_create(context, &scene)))
        TEST_END();
    for (int asg = SSDGS_ASG_GEOMETRIC; asg <= SSDGS_ASG_DEFERRED; asg += 2) {
        TEST_ROW("92", "objects that differ from their model", test_edits(asg));
        test_roughness(asg);
    }
    TEST_ROW("93", "media in code", (test_translucency(), test_media()));
    if (!real64) test_wax();
    test_broken();
    test_metal();
    test_brushed();
    test_refused();
    ssdgs_scene_destroy(scene);
    ssdgs_context_destroy(context);
    TEST_END();
}
