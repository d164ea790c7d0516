/* Shared by shade.comp and composite.glsl: the functions that both need. */

const int diffuse = 11; /* channels of a Gaussian */
const int specular = 14;
const int scattering = 17;
const int frame = 20;
const int asg_weight = 24;
const int material = 32;
const uint lengths = 5u; /* of true dipole transport */
uint o; /* the object */
bool on(int flag) { return (objects[o].of.x & flag) != 0; }

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
    if (objects[o].network[1].x == 0) return visibility;
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
