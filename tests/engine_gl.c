/* An engine's window, by SDL2, with its own OpenGL context: it draws meshes with a shadow map and a depth
   buffer; splats stand among them, drawn by examples/gpu in the same context, and its shader composites them.
   Compared with the CPU's splats over the same meshes. Needs SDL2 and OpenGL 4.3: `make test-engine`. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/gpu/gpu_gl.c"
#include "../examples/olat.h"
#include "test.h"
#define GL_GLEXT_PROTOTYPES
#include <SDL.h>
#include <SDL_opengl.h>
#include <SDL_opengl_glext.h>

enum { W = 400, H = 300, SHADOW = 512, LIGHTS = 2, OBJECTS = 3, FRAMES = 6, CORNERS = 7 * 6 };

typedef struct engine {
    SDL_Window *window;
    SDL_GLContext gl;
    GLuint mesh, vertices, meshes, composite, color, depth, shadow, screen, cast;
    float view[16], projection[16], shadow_matrix[16];
    ssdgs_light lights[LIGHTS];
    ssdgs_object objects[OBJECTS];
    ssdgs_shadow_map map;
} engine;

/* One of the two that draw the splats: the CPU's, or the GPU's. */
typedef struct splats {
    ssdgs_context *context;
    ssdgs_model *cow, *ball;
    ssdgs_scene *scene;
} splats;

/* ---- shaders ---- */

static const char mesh_vertex[] = "#version 430\n"
                                  "layout(location = 0) in vec3 corner;\n"
                                  "layout(location = 1) in vec3 normal;\n"
                                  "layout(location = 2) in vec3 albedo;\n"
                                  "uniform mat4 matrix;\n"
                                  "out vec3 at, n, color;\n"
                                  "void main() {\n"
                                  "    at = corner, n = normal, color = albedo;\n"
                                  "    gl_Position = matrix * vec4(corner, 1);\n"
                                  "}\n";
/* The splats' shadow: gpu_light_map has the places, ssdgs_light_map the function left(). */
static const char mesh_fragment[] =
    "#version 430\n"
    "in vec3 at, n, color;\n"
    "out vec4 result;\n"
    "uniform mat4 shadow_matrix;\n"
    "uniform vec4 place[2], power[2];\n"
    "uniform sampler2DShadow shadow;\n"
    "layout(std430, binding = 2) readonly buffer maps { vec4 light_map[]; };\n"
    "uniform int faces[2], size[2], parallel[2], first[12];\n"
    "uniform float focal[2], bias[2], nearest[12];\n"
    "uniform vec4 view[36];\n"
    "float left(vec4 a, vec4 b, float d, float bias) {\n"
    "    bool past = d > a.y;\n"
    "    float from = past ? a.y : a.x, to = past ? a.z : a.y, dark = past ? b.x : a.w;\n"
    "    float begin = max(to - bias, from), part = (d - begin) / (to - begin);\n"
    "    return d <= a.x ? 1 : d > a.z ? b.w : d > begin ? mix(dark, past ? b.z : b.y, part) : dark;\n"
    "}\n"
    "float left_at(int i, int face, ivec2 p, float d) {\n"
    "    p = clamp(p, ivec2(0), ivec2(size[i] - 1));\n"
    "    int tile = (first[6 * i + face] + p.y / 16 * (size[i] / 16) + p.x / 16) * 256;\n"
    "    int to = 2 * (tile + ((p.y & 12) << 4 | (p.x & 12) << 2 | (p.y & 3) << 2 | (p.x & 3)));\n"
    "    if (light_map[2 * tile].x < 0) return 1;\n"
    "    vec4 more = vec4(vec3(nearest[6 * i + face]), 0);\n"
    "    return left(light_map[to] + more, light_map[to + 1], d, bias[i]);\n"
    "}\n"
    "float splats_leave(int i) {\n"
    "    for (int face = 0; face < faces[i]; face++) {\n"
    "        int row = 18 * i + 3 * face;\n"
    "        vec3 p = vec3(dot(view[row], vec4(at, 1)), dot(view[row + 1], vec4(at, 1)),\n"
    "                      dot(view[row + 2], vec4(at, 1)));\n"
    "        vec2 pixel = focal[i] * p.xy / (parallel[i] != 0 ? 1 : p.z) + size[i] / 2.0 - 0.5;\n"
    "        float d = (parallel[i] != 0 ? p.z : length(p)) * (1 - 1e-6) - bias[i];\n"
    "        if (!(p.z > 0) || any(lessThan(pixel, vec2(-0.5))) || any(greaterThan(pixel, vec2(size[i] - "
    "0.5))))\n"
    "            continue;\n"
    "        ivec2 at = ivec2(floor(pixel));\n"
    "        vec2 part = pixel - at;\n"
    "        return mix(mix(left_at(i, face, at, d), left_at(i, face, at + ivec2(1, 0), d), part.x),\n"
    "                   mix(left_at(i, face, at + ivec2(0, 1), d), left_at(i, face, at + 1, d), part.x), "
    "part.y);\n"
    "    }\n"
    "    return 1;\n"
    "}\n"
    "void main() {\n"
    "    vec4 s = shadow_matrix * vec4(at + 0.02 * n, 1);\n"
    "    float of_splats = splats_leave(0);\n"
    "    result = vec4(0.05 * color, of_splats);\n"
    "    for (int i = 0; i < 2; i++) {\n"
    "        vec3 to = place[i].xyz - at * place[i].w;\n"
    "        float e = max(0, dot(n, normalize(to))) / (place[i].w > 0 ? dot(to, to) : 1) / 3.14159265;\n"
    "        e *= i == 0 ? texture(shadow, s.xyz / s.w * 0.5 + 0.5) * of_splats : splats_leave(1);\n"
    "        result.rgb += color * power[i].rgb * e;\n"
    "    }\n"
    "}\n";
static const char screen_vertex[] =
    "#version 430\n"
    "void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }\n";
static const char screen_fragment[] =
    "#version 430\n"
    "out vec4 result;\n"
    "uniform sampler2D meshes;\n"
    "layout(std430, binding = 1) readonly buffer planes { float plane[]; };\n"
    "void main() {\n"
    "    ivec2 p = ivec2(gl_FragCoord.xy), size = textureSize(meshes, 0);\n"
    "    int at = (size.y - 1 - p.y) * size.x + p.x, all = size.x * size.y;\n"
    "    vec3 c = vec3(plane[at], plane[all + at], plane[2 * all + at]) +\n"
    "        plane[3 * all + at] * texelFetch(meshes, p, 0).rgb;\n"
    "    c = clamp(c, vec3(0), vec3(1));\n"
    "    result = vec4(mix(12.92 * c, 1.055 * pow(c, vec3(1 / 2.4)) - 0.055, greaterThan(c, "
    "vec3(0.0031308))), 1);\n"
    "}\n";

static GLuint program_of(const char *vertex, const char *fragment) {
    const GLuint program = glCreateProgram();
    for (int i = 0; i < 2; i++) {
        const GLuint shader = glCreateShader(i ? GL_FRAGMENT_SHADER : GL_VERTEX_SHADER);
        char log[1024] = "";
        glShaderSource(shader, 1, i ? &fragment : &vertex, NULL);
        glCompileShader(shader);
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        if (!CHECK(!*log)) printf("%s\n", log);
        glAttachShader(program, shader);
        glDeleteShader(shader);
    }
    glLinkProgram(program);
    return program;
}

static GLint uniform(const engine *e, const char *name) { return glGetUniformLocation(e->mesh, name); }

/* ---- the engine ---- */

static void multiply(const float a[16], const float b[16], float out[16]) {
    for (int i = 0; i < 16; i++) {
        out[i] = 0;
        for (int j = 0; j < 4; j++) out[i] += a[4 * j + i % 4] * b[i / 4 * 4 + j];
    }
}

/* OpenGL's, columns one after the other. */
static void look_at(const float eye[3], const float target[3], float out[16]) {
    float f[3], r[3], length = 0;
    for (int i = 0; i < 3; i++) f[i] = target[i] - eye[i], length += f[i] * f[i];
    for (int i = 0; i < 3; i++) f[i] /= sqrtf(length);
    length = sqrtf(f[0] * f[0] + f[1] * f[1]);
    r[0] = f[1] / length, r[1] = -f[0] / length, r[2] = 0;
    memset(out, 0, 16 * sizeof *out);
    for (int i = 0; i < 3; i++) {
        const float u = r[(i + 1) % 3] * f[(i + 2) % 3] - r[(i + 2) % 3] * f[(i + 1) % 3];
        out[4 * i] = r[i], out[4 * i + 1] = u, out[4 * i + 2] = -f[i];
        out[12] -= r[i] * eye[i], out[13] -= u * eye[i], out[14] += f[i] * eye[i];
    }
    out[15] = 1;
}

static void perspective(float fov, float aspect, float near_plane, float far_plane, float out[16]) {
    memset(out, 0, 16 * sizeof *out);
    out[5] = 1 / tanf(fov / 2), out[0] = out[5] / aspect, out[11] = -1;
    out[10] = (far_plane + near_plane) / (near_plane - far_plane);
    out[14] = 2 * far_plane * near_plane / (near_plane - far_plane);
}

static GLuint texture_of(GLenum format, int width, int height) {
    GLuint name;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexStorage2D(GL_TEXTURE_2D, 1, format, width, height);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    return name;
}

static GLuint target_of(GLuint color, GLuint depth) {
    GLuint name;
    glGenFramebuffers(1, &name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    if (color) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color, 0);
    else glDrawBuffer(GL_NONE), glReadBuffer(GL_NONE);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
    CHECK(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE);
    return name;
}

/* A box from low to high, or a floor where they are as high: corners, normals, colours. */
static float *put_box(float *to, const float low[3], const float high[3], const float albedo[3]) {
    for (int face = low[2] < high[2] ? 0 : 5; face < 6; face++) {
        const int axis = face / 2, a = (axis + 1) % 3, b = (axis + 2) % 3;
        static const int order[6] = {0, 1, 2, 0, 2, 3};
        for (int i = 0; i < 6; i++, to += 9) {
            const int c = order[i];
            to[axis] = face % 2 ? high[axis] : low[axis];
            to[a] = c == 1 || c == 2 ? high[a] : low[a];
            to[b] = c > 1 ? high[b] : low[b];
            to[3] = to[4] = to[5] = 0;
            to[3 + axis] = face % 2 ? 1.0f : -1.0f;
            memcpy(to + 6, albedo, 3 * sizeof *to);
        }
    }
    return to;
}

static void make_meshes(engine *e) {
    static const float floor_low[3] = {-4, -4, 0}, floor_high[3] = {4, 4, 0}, grey[3] = {0.5f, 0.5f, 0.55f};
    static const float low[3] = {-0.15f, -0.3f, 0}, high[3] = {0.15f, 0, 1}, red[3] = {0.6f, 0.15f, 0.1f};
    static float corner[9 * CORNERS];
    GLuint buffer;
    float *end = put_box(put_box(corner, floor_low, floor_high, grey), low, high, red);
    CHECK(end == corner + 9 * CORNERS);
    glGenVertexArrays(1, &e->vertices);
    glBindVertexArray(e->vertices);
    glGenBuffers(1, &buffer);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, sizeof corner, corner, GL_STATIC_DRAW);
    for (GLuint i = 0; i < 3; i++) {
        glVertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 9 * sizeof(float),
                              (void *)(intptr_t)(3 * i * sizeof(float)));
        glEnableVertexAttribArray(i);
    }
}

static int open_engine(engine *e) {
    if (SDL_Init(SDL_INIT_VIDEO)) return printf("SDL: %s\n", SDL_GetError()), 0;
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 4);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 3);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_CORE);
    e->window = SDL_CreateWindow("splats among meshes", 0, 0, W, H, SDL_WINDOW_OPENGL);
    e->gl = e->window ? SDL_GL_CreateContext(e->window) : NULL;
    if (!e->gl) return printf("SDL: %s\n", SDL_GetError()), 0;
    e->mesh = program_of(mesh_vertex, mesh_fragment);
    e->composite = program_of(screen_vertex, screen_fragment);
    e->color = texture_of(GL_RGBA32F, W, H);
    e->depth = texture_of(GL_DEPTH_COMPONENT32F, W, H);
    e->shadow = texture_of(GL_DEPTH_COMPONENT24, SHADOW, SHADOW);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    e->screen = target_of(e->color, e->depth);
    e->cast = target_of(0, e->shadow);
    make_meshes(e);
    return 1;
}

/* An object of this height on the floor. */
static ssdgs_object stand(ssdgs_model *model, float height, float x, float y, float turn, int mirror) {
    ssdgs_real low[3], high[3];
    ssdgs_object o = ssdgs_object_default(model);
    CHECK(!ssdgs_model_bounds(model, low, high));
    const float s = height / (high[2] - low[2]), c = s * cosf(turn), d = s * sinf(turn);
    const float rows[12] = {mirror ? -c : c, -d, 0, x, mirror ? -d : d, c, 0, y, 0, 0, s, -s * low[2]};
    memcpy(o.to_world, rows, sizeof rows);
    return o;
}

static void move(engine *e, int frame) {
    const float t = 0.4f * (float)frame, eye[3] = {2.5f * sinf(0.3f * t), -2.5f, 1.5f},
                target[3] = {0, 0, 0.4f};
    const float lamp[3] = {1.5f * cosf(t), -1.5f, 2.5f}, warm[3] = {40, 40, 34}, sun[3] = {-0.6f, 0, -0.8f},
                even[3] = {2, 2, 2.5f};
    float lens[16], from[16];
    look_at(eye, target, e->view);
    perspective(0.7f, (float)W / H, 0.1f, 30, e->projection);
    look_at(lamp, target, from);
    perspective(1.2f, 1, 0.3f, 12, lens);
    multiply(lens, from, e->shadow_matrix);
    e->lights[0] = ssdgs_light_point(lamp, warm);
    e->lights[1] = ssdgs_light_directional(sun, even);
    memset(&e->map, 0, sizeof e->map);
    e->map.width = e->map.height = SHADOW;
    e->map.flags = SSDGS_COLUMN_MAJOR;
    e->map.revision = (uint64_t)frame;
    e->map.bias = 0.03f;
    memcpy(e->map.matrix, e->shadow_matrix, sizeof e->map.matrix);
}

static void place(engine *e, const splats *s) {
    e->objects[0] = stand(s->cow, 0.8f, -0.7f, -0.2f, 0.5f, 0);
    e->objects[1] = stand(s->cow, 0.5f, 0.6f, -0.6f, -1, 1);
    e->objects[1].tint[0] = 0.6f;
    e->objects[1].roughness = 1.5f;
    e->objects[2] = stand(s->ball, 0.5f, 0.55f, 0.5f, 0, 0);
    e->objects[2].kept = 0.3f;
}

/* The splats' light maps, for the meshes' shader. */
static void set_maps(const engine *e, const gpu *g) {
    for (int i = 0; i < LIGHTS; i++) {
        const gpu_light_map m = gpu_last_map(g, i);
        char name[32];
        if (!CHECK(m.buffer && m.map.faces > 0)) continue;
        const float values[2] = {m.map.focal, m.map.bias};
        const int numbers[3] = {m.map.faces, m.map.size, m.map.parallel};
        static const char *const value_names[2] = {"focal", "bias"}, *const names[3] = {"faces", "size",
                                                                                        "parallel"};
        for (int j = 0; j < 2; j++)
            snprintf(name, sizeof name, "%s[%d]", value_names[j], i),
                glUniform1f(uniform(e, name), values[j]);
        for (int j = 0; j < 3; j++)
            snprintf(name, sizeof name, "%s[%d]", names[j], i), glUniform1i(uniform(e, name), numbers[j]);
        snprintf(name, sizeof name, "first[%d]", 6 * i);
        glUniform1iv(uniform(e, name), 6, m.first);
        snprintf(name, sizeof name, "nearest[%d]", 6 * i);
        glUniform1fv(uniform(e, name), 6, m.nearest);
        snprintf(name, sizeof name, "view[%d]", 18 * i);
        glUniform4fv(uniform(e, name), 18, m.map.view[0]);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, m.buffer);
    }
}

static void draw_meshes(const engine *e, GLuint target, int size_x, int size_y, const float matrix[16]) {
    glBindFramebuffer(GL_FRAMEBUFFER, target);
    glViewport(0, 0, size_x, size_y);
    glClearColor(0.02f, 0.03f, 0.05f, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glUniformMatrix4fv(uniform(e, "matrix"), 1, GL_FALSE, matrix);
    glDrawArrays(GL_TRIANGLES, 0, CORNERS);
}

static void set_lights(const engine *e, float light_scale) {
    for (int i = 0; i < LIGHTS; i++) {
        const ssdgs_light *l = e->lights + i;
        const int sun = l->kind == SSDGS_LIGHT_DIRECTIONAL;
        const float sign = sun ? -1.0f : 1.0f, *from = sun ? l->direction : l->position;
        char name[32];
        snprintf(name, sizeof name, "place[%d]", i);
        glUniform4f(uniform(e, name), sign * from[0], sign * from[1], sign * from[2], (float)!sun);
        snprintf(name, sizeof name, "power[%d]", i);
        glUniform4f(uniform(e, name), light_scale * l->intensity[0], light_scale * l->intensity[1],
                    light_scale * l->intensity[2], 0);
    }
    glUniformMatrix4fv(uniform(e, "shadow_matrix"), 1, GL_FALSE, e->shadow_matrix);
}

/* What the library touches of OpenGL, as numbers. */
enum { STATES = 4 + 3 * 17 + 4 + 6 };
static void note_state(GLint64 state[STATES]) {
    static const GLenum names[] = {GL_CURRENT_PROGRAM,        GL_SHADER_STORAGE_BUFFER_BINDING,
                                   GL_UNIFORM_BUFFER_BINDING, GL_COPY_READ_BUFFER,
                                   GL_COPY_WRITE_BUFFER,      GL_PIXEL_PACK_BUFFER_BINDING,
                                   GL_TEXTURE_BINDING_2D,     GL_TEXTURE_BINDING_CUBE_MAP,
                                   GL_PACK_ROW_LENGTH,        GL_PACK_SKIP_ROWS,
                                   GL_PACK_SKIP_PIXELS,       GL_DRAW_FRAMEBUFFER_BINDING,
                                   GL_VERTEX_ARRAY_BINDING};
    int at = 0;
    memset(state, 0, STATES * sizeof *state);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) glGetInteger64v(names[i], state + at++);
    for (GLuint i = 0; i < 17; i++)
        for (GLenum j = 0; j < 3; j++)
            glGetInteger64i_v(i < 16 ? GL_SHADER_STORAGE_BUFFER_BINDING + j : GL_UNIFORM_BUFFER_BINDING + j,
                              i % 16, state + at++);
    CHECK(at <= STATES);
}

static int equal(const GLint64 a[STATES], const GLint64 b[STATES]) {
    return !memcmp(a, b, STATES * sizeof *a);
}

/* ---- the two ---- */

static void hear(void *user, ssdgs_result code, const char *message) {
    if (code) printf("%s: %s\n", (const char *)user, message);
}

static ssdgs_model *make_ball(ssdgs_context *context) {
    ssdgs_settings s = ssdgs_settings_default();
    ssdgs_model *model = NULL;
    s.baked = 1;
    CHECK(!ssdgs_model_create(context, &s, 2000, &model));
    const ssdgs_model_view v = ssdgs_model_arrays(model);
    for (size_t i = 0; i < 2000; i++) {
        const double z = 1 - (2 * (double)i + 1) / 2000, r = sqrt(1 - z * z), turn = 2.4 * (double)i;
        const double at[3] = {r * cos(turn), r * sin(turn), z};
        for (size_t c = 0; c < 3; c++) {
            v.gaussians[c * v.stride + i] = (float)at[c];
            v.gaussians[(SSDGS_LOG_SCALE + c) * v.stride + i] = -3;
            v.gaussians[(SSDGS_DIFFUSE + c) * v.stride + i] = (float)(2 * at[c]);
        }
        v.gaussians[SSDGS_OPACITY * v.stride + i] = 3;
    }
    CHECK(!ssdgs_model_sort(model));
    return model;
}

static void open_splats(splats *s, const ssdgs_gpu_hook *hook, const char *path) {
    ssdgs_context_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.gpu = hook;
    desc.logger.write = hear;
    desc.logger.user = (void *)(hook ? "GPU" : "CPU");
    if (!CHECK(!ssdgs_context_create(&desc, &s->context) && !ssdgs_scene_create(s->context, &s->scene)) ||
        !CHECK(!ssdgs_model_load(s->context, path, &s->cow, NULL)))
        exit(1);
    s->ball = make_ball(s->context);
}

static void close_splats(splats *s) {
    ssdgs_model_destroy(s->cow);
    ssdgs_model_destroy(s->ball);
    ssdgs_scene_destroy(s->scene);
    ssdgs_context_destroy(s->context);
}

static ssdgs_camera camera_of(const engine *e, const splats *s) {
    ssdgs_camera camera;
    CHECK(!ssdgs_camera_from_matrices(s->context, e->view, e->projection, SSDGS_COLUMN_MAJOR, W, H, &camera));
    return camera;
}

static void occlude(const engine *e, const splats *s, const float *depth) {
    static ssdgs_shadow_map map;
    ssdgs_occluder occluder;
    map = e->map;
    if (depth) { /* OpenGL's bottom row is the first */
        map.depth = depth + SHADOW * (SHADOW - 1);
        map.pitch = -(ptrdiff_t)(SHADOW * sizeof *depth);
    }
    memset(&occluder, 0, sizeof occluder);
    occluder.maps = &map;
    occluder.map_count = 1;
    ssdgs_scene_occlude(s->scene, &occluder);
}

/* A frame of the engine with the splats on the GPU, in the order in which an engine does it. */
static void draw_frame(engine *e, splats *s, gpu *g) {
    const float light_scale = ssdgs_model_settings(s->cow)->light_scale;
    float matrix[16];
    GLint64 before[STATES], after[STATES];
    ssdgs_image image;
    memset(&image, 0, sizeof image); /* no plane comes back */
    place(e, s);
    const ssdgs_camera camera = camera_of(e, s);
    glUseProgram(e->mesh);
    glEnable(GL_DEPTH_TEST);
    glBindTexture(GL_TEXTURE_2D, e->shadow);
    draw_meshes(e, e->cast, SHADOW, SHADOW, e->shadow_matrix); /* 1: shadow maps */
    note_state(before);
    gpu_shadow_texture(g, 0, e->shadow, GL_TEXTURE_2D);
    occlude(e, s, NULL);
    CHECK(!ssdgs_scene_light(s->scene, e->objects, OBJECTS, &camera, e->lights, LIGHTS,
                             NULL)); /* 2: light maps */
    note_state(after);
    CHECK(equal(before, after));
    set_maps(e, g); /* 3: meshes, with shadows of meshes and of splats */
    set_lights(e, light_scale);
    multiply(e->projection, e->view, matrix);
    draw_meshes(e, e->screen, W, H, matrix);
    glPixelStorei(GL_PACK_ROW_LENGTH, 77);
    glPixelStorei(GL_PACK_SKIP_ROWS, 3);
    note_state(before);
    gpu_scene_depth(g, e->depth, e->projection);
    CHECK(!ssdgs_scene_render(s->scene, e->objects, OBJECTS, &camera, e->lights, LIGHTS, NULL, &image,
                              NULL)); /* 4 */
    note_state(after);
    CHECK(equal(before, after));
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    glPixelStorei(GL_PACK_SKIP_ROWS, 0);
    const gpu_picture picture = gpu_last_picture(g);
    CHECK(picture.buffer && picture.width == W && picture.height == H);
    glBindFramebuffer(GL_FRAMEBUFFER, 0); /* 5: splats over meshes */
    glDisable(GL_DEPTH_TEST);
    glUseProgram(e->composite);
    glBindTexture(GL_TEXTURE_2D, e->color);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, picture.buffer);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    CHECK(!glGetError());
}

/* The same by the CPU over the engine's own meshes. Returns decibels between the two. */
static double compare(engine *e, splats *s, const char *out) {
    static float meshes[4 * W * H], buffer[W * H], shadow[SHADOW * SHADOW], depth[W * H], color[3 * W * H],
        alpha[W * H], world[3 * W * H], passed[W * H];
    static unsigned char screen[4 * W * H], want[4 * W * H], row[4 * W];
    ssdgs_image image;
    double square = 0, off = 0, shaded = 0;
    glReadPixels(0, 0, W, H, GL_RGBA, GL_UNSIGNED_BYTE, screen);
    glBindTexture(GL_TEXTURE_2D, e->color);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, meshes);
    glBindTexture(GL_TEXTURE_2D, e->depth);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, GL_FLOAT, buffer);
    glBindTexture(GL_TEXTURE_2D, e->shadow);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, GL_FLOAT, shadow);
    place(e, s);
    occlude(e, s, shadow);
    const ssdgs_camera camera = camera_of(e, s);
    CHECK(!ssdgs_depth_from_buffer(s->context, e->projection, SSDGS_COLUMN_MAJOR, buffer + W * (H - 1),
                                   -(ptrdiff_t)(W * sizeof *buffer), W, H, depth));
    CHECK(!ssdgs_scene_light(s->scene, e->objects, OBJECTS, &camera, e->lights, LIGHTS, NULL));
    for (int i = 0; i < W * H; i++)
        for (int c = 0; c < 3; c++) {
            const float p[3] = {((float)(i % W) + 0.5f - camera.cx) / camera.fx * depth[i],
                                ((float)(i / W) + 0.5f - camera.cy) / camera.fy * depth[i], depth[i]};
            world[3 * i + c] = 0;
            for (int j = 0; j < 3; j++)
                world[3 * i + c] += camera.view[4 * j + c] * (p[j] - camera.view[4 * j + 3]);
        }
    CHECK(!ssdgs_scene_shadow(s->scene, 0, world, W * H, passed));
    memset(&image, 0, sizeof image);
    image.color = color, image.alpha = alpha, image.scene_depth = depth;
    CHECK(!ssdgs_scene_render(s->scene, e->objects, OBJECTS, &camera, e->lights, LIGHTS, NULL, &image, NULL));
    for (int i = 0; i < W * H; i++) {
        const float *below = meshes + 4 * ((H - 1 - i / W) * W + i % W);
        if (buffer[(H - 1 - i / W) * W + i % W] < 1)
            off += fabs((double)(below[3] - passed[i])) / (W * H), shaded += passed[i] < 0.5f;
        for (int c = 0; c < 3; c++) color[3 * i + c] += (1 - alpha[i]) * below[c];
        alpha[i] = 1;
    }
    CHECK(shaded > 300);
    if (!CHECK(off < 2e-3)) printf("splats' shadows on meshes differ by %g\n", off);
    ssdgs_to_pixels(s->context, &image, W, H, SSDGS_TRANSFER_SRGB, SSDGS_RGBA8, want, 4 * W);
    for (int y = 0; y < H / 2; y++) { /* the top row first */
        memcpy(row, screen + 4 * W * y, sizeof row);
        memcpy(screen + 4 * W * y, screen + 4 * W * (H - 1 - y), sizeof row);
        memcpy(screen + 4 * W * (H - 1 - y), row, sizeof row);
    }
    for (int i = 0; i < 4 * W * H; i++) {
        const double d = (screen[i] - want[i]) / 255.0;
        square += i % 4 == 3 ? 0 : d * d / (3 * W * H);
    }
    char error[512];
    CHECK(!olat_write_png(out, W, H, 4, screen, error));
    return -10 * log10(square + 1e-10);
}

int main(int argc, char **argv) {
    static engine e;
    splats on_gpu, on_cpu;
    char message[256] = "";
    double least = 200;
    if (!CHECK(open_engine(&e))) return 1;
    gpu *g = gpu_create(SDL_GL_GetProcAddress, message, sizeof message);
    if (!CHECK(g != NULL)) {
        printf("%s\n", message);
        return 1;
    }
    printf("%s\n", gpu_name(g));
    const ssdgs_gpu_hook hook = gpu_hook(g);
    open_splats(&on_gpu, &hook, "examples/data/waxcow.ply");
    open_splats(&on_cpu, NULL, "examples/data/waxcow.ply");
    for (int frame = 0; frame < FRAMES; frame++) {
        move(&e, frame);
        draw_frame(&e, &on_gpu, g);
        const double db = compare(&e, &on_cpu, argc > 1 ? argv[1] : "build/engine_gl.png");
        least = fmin(least, db);
        SDL_GL_SwapWindow(e.window);
    }
    printf("the screen: %.1f dB at least from the CPU's splats over the same meshes\n", least);
    CHECK(least > 40);
    close_splats(&on_gpu);
    close_splats(&on_cpu);
    gpu_destroy(g);
    CHECK(!glGetError());
    SDL_GL_DeleteContext(e.gl);
    SDL_DestroyWindow(e.window);
    SDL_Quit();
    TEST_END();
}
