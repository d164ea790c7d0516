/* Shared by shade.comp and highlight.comp: what they know of a frame and of a light, and the functions
   that both need. Reads the block `parameters`, which is gpu_lighting in gpu_gl.c. */

const int diffuse = 11; /* channels of a Gaussian */
const int specular = 14;
const int scattering = 17;
const int frame = 20;
const int asg_weight = 24;
const int material = 32;
const int diffuse_term = 1; /* flags */
const int specular_term = 2;
const int shadow_term = 4;
const int scattering_term = 8;
const int deferred = 16;
const int depth_cue = 32;
const int transport = 64;
const int residual_shadow = 128;
const int shadow_on_scattering = 256;
const int per_channel_optics = 512;
const int printed_dipole = 1024;
const int has_ambient = 2048;
const int has_medium = 4096;
const int visibility_given = 8192;
const int lengths = 5; /* of true dipole transport */
layout(std140, binding = 0) uniform parameters {
    vec4 eye; /* w: the least squared distance */
    vec4 centre; /* w: 1 / length unit */
    vec4 basis[24]; /* of each lobe: x axis, lambda; y axis, mu; deferred t, s, a */
    vec4 ambient[9];
    vec4 medium[lengths]; /* RGB weights; what comes to an evenly lit plane */
    vec4 camera[3]; /* its rotation; w: 1 / fx, 1 / fy, the bias of pixels in light maps */
    vec4 lens; /* virtual depth, light scale, cx, cy */
    ivec4 network[2]; /* scattering's, shadow's: layers, inputs, width, outputs */
    ivec4 inputs; /* octaves of wo, of wi, the networks' columns, where the shadow network's weights begin */
    ivec4 faces; /* of the light at work: the first view, how many; the light */
    ivec4 counts; /* Gaussians, stride of their planes, lights, layers */
    ivec4 size; /* width, height; flags */
};
struct lamp {
    vec4 place; /* w = 1: the direction to it */
    vec4 intensity; /* w = 1: it has a map */
    vec4 cone; /* the axis, of a spot or with a focus; w: 1 / range */
    vec4 rim; /* a, b: a spot leaves (a - b |way - axis|^2)^2, within 0 .. 1; z = 1: with cone, range or
                 focus; the focus */
};
bool on(int flag) { return (size.z & flag) != 0; }

float power_of_e(float x) { return exp(clamp(x, -87.0, 87.0)); }
float sigmoid(float x) { return 1.0 / (1.0 + power_of_e(-x)); }
vec3 sigmoid(vec3 x) { return vec3(sigmoid(x.x), sigmoid(x.y), sigmoid(x.z)); }
float log_1_plus(float x) { /* of 0 .. 1 */
    float t = x / (x + 2.0);
    float t2 = t * t;
    float p = 2.0 / 17.0;
    for (float i = 15.0; i > 1.0; i -= 2.0) p = p * t2 + 2.0 / i;
    return p * t2 * t + 2.0 * t;
}
float softplus(float x) { return max(x, 0.0) + log_1_plus(power_of_e(-abs(x))); }
vec3 softplus(vec3 x) { return vec3(softplus(x.x), softplus(x.y), softplus(x.z)); }
/* Eq. 8: S of a visibility and the shadow network's answer. */
float shadow_factor(bool shadowed, float visibility, float answer) {
    if (!shadowed) return 1.0;
    if (network[1].x == 0) return visibility;
    float v = clamp(visibility, 0.01, 0.99);
    return sigmoid(on(residual_shadow) ? log(v / (1.0 - v)) + answer : answer);
}
/* h = wi + wo made a unit vector, 1 - wo.h; false: there is none. */
bool half_vector(vec3 wi, vec3 wo, out vec3 h, out float missing) {
    float h2 = dot(wi + wo, wi + wo);
    h = (wi + wo) / sqrt(max(h2, 1e-12));
    missing = clamp(1.0 - dot(wo, h), 0.0, 1.0);
    return h2 >= 1e-12;
}
float schlick(float f0, float missing) {
    float square = missing * missing;
    return f0 + (1.0 - f0) * (square * square * missing);
}
