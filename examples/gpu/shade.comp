/* SHADE. Reads the list of seen_list.comp, the model, networks, lights, and for each Gaussian and light
   visibility, depth cue and transport. Writes colours, and the layers of deferred highlights. A group
   shades as many Gaussians as the networks have columns, under one light after the other. */
#version 430
#include "common.glsl"
#include "rotation.glsl"
#include "lighting.glsl"
#include "network.glsl"

/* ---- a Gaussian under a light: eqs. 9 to 12 ---- */

layout(std430, binding = 1) readonly buffer lamp_block { lamp lamps[]; };
layout(std430, binding = 2) readonly buffer gauss_block { float gauss[]; };
uint me; /* the Gaussian */
vec3 place;
mat3 axes; /* of its frame; the third is the normal */
vec3 wi;
vec3 wo;
float irradiance;
float cosine;
float gloss;
float raw(int channel) { return gauss[uint(channel) * uint(counts.y) + me]; }
vec3 place_of(uint g) { return vec3(gauss[g], gauss[uint(counts.y) + g], gauss[2u * uint(counts.y) + g]); }
vec3 raw3(int channel) { return vec3(raw(channel), raw(channel + 1), raw(channel + 2)); }
/* NaN, which max() and clamp() may lose. */
bool is_broken() {
    bool any = false;
    for (int i = diffuse; i < material; i++) any = any || !is_number(raw(i));
    return any;
}
void find_frame() {
    place = place_of(me);
    axes = rotation(vec4(raw(frame), raw3(frame + 1)));
    vec3 to = eye.xyz - place;
    wo = to / sqrt(max(dot(to, to), eye.w));
}
/* Deferred: sqrt(lambda mu). */
float lobe_height() {
    return power_of_e(0.5 * (clamp(raw(asg_weight), -12.0, 12.0) + clamp(raw(asg_weight + 1), -12.0, 12.0)));
}
void find_geometry(lamp l) {
    bool directional = l.place.w > 0.0;
    vec3 to = directional ? l.place.xyz : l.place.xyz - place;
    irradiance = directional ? 1.0 : 1.0 / max(dot(to, to), eye.w);
    wi = to * sqrt(irradiance);
    cosine = max(0.0, dot(axes[2], wi));
    gloss = lobe_height(); /* deferred: the rest is the pixels' */
    if (on(deferred)) return;
    vec3 h;
    float missing;
    float sum = 0.0;
    bool shines = half_vector(wi, wo, h, missing) && on(specular_term);
    vec3 local = h * axes;
    for (int j = 0; j < 8 && shines; j++) {
        vec4 x = basis[3 * j];
        vec4 y = basis[3 * j + 1];
        float along = dot(x.xyz, local);
        float across = dot(y.xyz, local);
        sum += softplus(raw(asg_weight + j)) * power_of_e(-(x.w * along * along + y.w * across * across));
    }
    gloss = schlick(0.04, missing) * sum;
}
/* What a spot's cone, the range and the focus leave. */
float reach_of(lamp l, vec3 at) {
    vec3 way = at - l.place.xyz;
    float distance2 = dot(way, way);
    float far = distance2 * l.cone.w * l.cone.w;
    way /= sqrt(distance2 > 0.0 ? distance2 : 1.0);
    vec3 beside = way - l.cone.xyz;
    /* at the light itself the cosine counts as 0 */
    float beside2 = distance2 > 0.0 ? dot(beside, beside) : 1.0 + dot(l.cone.xyz, l.cone.xyz);
    float share = clamp(l.rim.x - l.rim.y * beside2, 0.0, 1.0);
    float focused = l.rim.w > 0.0 ? pow(max(dot(way, l.cone.xyz), 0.0), l.rim.w) : 1.0;
    return share * share * focused * max(0.0, 1.0 - far * far);
}

/* ---- its colour: eqs. 3 to 5 and 13 ---- */

vec3 diffuse_sum;
vec3 specular_sum;
vec3 scattering_sum;
float dipole(float ss, float sa, float r) {
    float st = ss + sa;
    float s = on(printed_dipole) ? st : sqrt(3.0 * sa * st);
    float zr = 1.0 / st;
    float zv = zr * lens.x;
    float dr = sqrt(r * r + zr * zr);
    float dv = sqrt(r * r + zv * zv);
    float q = on(printed_dipole) ? dr : dv;
    float first = (s * dr + 1.0) * power_of_e(-s * dr) / (dr * dr * dr);
    float second = (s * q + 1.0) * power_of_e(-s * dv) / (dv * dv * dv);
    return ss * zr * 0.079577471545947668 * (zr * first + (on(printed_dipole) ? zr * zv : zv) * second);
}
/* Of the scattering network's answers. */
vec3 profile() {
    vec3 found = vec3(0.0);
    for (int c = 0; c < (on(per_channel_optics) ? 3 : 1); c++) {
        ivec3 at = on(per_channel_optics) ? ivec3(c, 3 + c, 6) : ivec3(0, 1, 2);
        vec3 unit = sigmoid(vec3(answer_of(at.x), answer_of(at.y), answer_of(at.z)));
        found[c] = dipole(2.0 * unit.x + 0.05, 2.0 * unit.y + 0.05, 3.0 * unit.z + 0.1);
    }
    return on(per_channel_optics) ? found : vec3(found.x);
}
/* Adds a light's; `arrives` of transport's lengths. Deferred ones are without S. */
void add_colour(vec3 intensity, float shadow, float arrives[lengths]) {
    vec3 power = irradiance * intensity;
    vec3 lit = on(deferred) ? power : shadow * power;
    if (on(diffuse_term)) diffuse_sum += softplus(raw3(diffuse)) * (0.31830988618 * cosine) * lit;
    if (on(specular_term)) specular_sum += softplus(raw3(specular)) * gloss * lit;
    if (!on(scattering_term)) return;
    vec3 through = vec3(0);
    for (int i = 0; i < lengths && on(has_medium); i++) through += 0.31830988618 * medium[i].rgb * arrives[i];
    if (!on(has_medium)) through = profile() * (on(shadow_on_scattering) ? shadow : 1.0);
    scattering_sum += softplus(raw3(scattering)) * through * power;
}
/* The networks' inputs. */
void encode_shadow(float visibility) {
    int at = encode(0, (place - centre.xyz) * (on(residual_shadow) ? centre.w : 1.0), 3);
    at = put(encode(at, wi, 3), visibility);
    for (int i = 0; i < 6; i++) at = put(at, raw(material + i));
}
void encode_scattering(float cue, float arrives[lengths]) {
    int at = encode(0, (place - centre.xyz) * (on(depth_cue | transport) ? centre.w : 1.0), 4);
    at = encode(encode(at, wo, inputs.x), wi, inputs.y);
    for (int i = 0; i < 3; i++) at = put(at, axes[2][i]);
    for (int i = 0; i < 6; i++) at = put(at, raw(material + i));
    if (on(depth_cue)) {
        encode(at, 1, cue * centre.w, 4);
        at += 9;
    }
    for (int i = 0; i < lengths && on(transport); i++) at = put(at, arrives[i]);
}

/* ---- deferred highlights' layers, and ambient light ---- */

layout(std430, binding = 10) writeonly buffer layer_block { vec4 layers[]; };
bool live; /* the thread has a Gaussian of its own */
bool black; /* something is not finite, or too large */
void write_layer(int layer, vec3 value) {
    black = black || !is_finite(value) || any(greaterThan(abs(value), vec3(1e30)));
    if (live) layers[uint(layer) * uint(counts.x) + me] = vec4(value, 0);
}
/* Q of the pixel's highlight, depth, F0, cover, normal. */
void write_lobe(float depth) {
    vec3 x = axes[0];
    vec3 y = axes[1];
    float along = power_of_e(clamp(raw(asg_weight), -12.0, 12.0));
    float across = power_of_e(clamp(raw(asg_weight + 1), -12.0, 12.0));
    write_layer(0, along * x * x + across * y * y);
    write_layer(1, along * x * x.yzx + across * y * y.yzx);
    write_layer(2, vec3(depth, sigmoid(raw(asg_weight + 2) - 3.1780538303479458), 1));
    write_layer(3, axes[2]);
}
/* What a lobe e^(-x u), u = 1 - (n.h)^2, sends back along n of a sky of radiance 1, over 4 pi. */
float lobe_share(float x) {
    bool even = x < 0.03;
    float share = even ? 0.5 - x / 8.0 : (1.0 - power_of_e(-0.5 * x)) / x;
    if (!on(deferred)) return share;
    return (even ? 0.25 - x / 24.0 : (1.0 - 2.0 * share) / x) * (1.0 + 1.0 / (4.4 + 0.75 * x));
}
float lobe_energy() {
    float sum = 0.0;
    float narrower = lobe_height();
    for (int j = 0; j < 8; j++) {
        vec4 b = basis[3 * j + 2];
        if (on(deferred)) sum += b.z * lobe_share(b.y * narrower);
        else sum += softplus(raw(asg_weight + j)) * lobe_share(sqrt(basis[3 * j].w * basis[3 * j + 1].w));
    }
    return 12.566370614359172 * sum * (on(deferred) ? narrower : 1.0);
}
/* The irradiance of ambient light on a surface with a normal. */
vec3 ambient_at(vec3 n) {
    return max(vec3(0), ambient[0].rgb + n.y * ambient[1].rgb + n.z * ambient[2].rgb + n.x * ambient[3].rgb +
        n.x * n.y * ambient[4].rgb + n.y * n.z * ambient[5].rgb + (3.0 * n.z * n.z - 1.0) * ambient[6].rgb +
        n.x * n.z * ambient[7].rgb + (n.x * n.x - n.y * n.y) * ambient[8].rgb);
}
/* Light from all around falls as from along the normal, and a highlight mirrors what is around its
   direction. */
void find_ambient_geometry(float sky_share) {
    float facing = dot(axes[2], wo);
    float steep = on(deferred) ? min(1.0, max(0.0, facing) / 0.25) : 1.0;
    float f0 = on(deferred) ? sigmoid(raw(asg_weight + 2) - 3.1780538303479458) : 0.04;
    wi = axes[2];
    irradiance = sky_share;
    cosine = 1.0;
    facing = clamp(facing, 0.0, 1.0);
    gloss = on(specular_term) ? schlick(f0, 1.0 - facing) * lobe_energy() : 0.0;
    gloss *= (on(deferred) ? steep * steep : facing) * 0.31830988618;
}

/* ---- all of it ---- */

layout(std430, binding = 3) readonly buffer shaded_block { uint shaded_count; uint shaded[]; };
layout(std430, binding = 4) readonly buffer visibility_block { float visibilities[]; };
layout(std430, binding = 5) readonly buffer cue_block { float cues[]; };
layout(std430, binding = 6) readonly buffer transport_block { float transported[]; };
layout(std430, binding = 7) readonly buffer sky_share_block { float sky_shares[]; };
layout(std430, binding = 8) readonly buffer depth_block { float depths[]; };
layout(std430, binding = 9) writeonly buffer color_block { vec4 colors[]; };
shared uint lit;
bool mine; /* the thread has a column */
/* Whether any is in the light's reach, of the 64 that the CPU shades together. */
bool reached(lamp l) {
    uint at = group() * uint(inputs.z) / 64u * 64u + lane();
    barrier();
    if (lane() == 0u) lit = 0u;
    barrier();
    if (lane() < 64u && reach_of(l, place_of(shaded[min(at, shaded_count - 1u)])) > 0.0) atomicOr(lit, 1u);
    barrier();
    return lit != 0u;
}
void add_light(int i) {
    lamp l = lamps[i];
    bool casts = l.intensity.w > 0.0;
    bool shadowed = casts && on(shadow_term);
    float share = mine && l.rim.z > 0.0 ? reach_of(l, place) : 1.0;
    float visibility = 1.0;
    float cue = 0.0;
    float answer = 0.0;
    float arrives[lengths] = float[lengths](0.0, 0.0, 0.0, 0.0, 0.0);
    if (l.rim.z > 0.0 && !reached(l)) {
        if (!on(deferred)) return;
        write_layer(4 + 3 * i, vec3(0));
        write_layer(5 + 3 * i, vec3(0));
        write_layer(6 + 3 * i, vec3(0, 1, sigmoid(raw(asg_weight + 3)))); /* there S is 1 */
        return;
    }
    if (mine) {
        find_geometry(l);
        uint at = uint(counts.x) * uint(i) + me;
        if (shadowed) visibility = visibilities[at];
        if (casts && on(depth_cue) && on(scattering_term)) cue = cues[at];
        for (int k = 0; k < lengths && on(transport); k++) {
            float brought = casts ? transported[uint(counts.x) * uint(lengths * i + k) + me] : 0.0;
            if (casts) arrives[k] = irradiance > 0.0 ? brought / irradiance : 0.0;
            else arrives[k] = cosine * medium[k].w;
        }
    }
    if (shadowed && network[1].x > 0) {
        if (mine) encode_shadow(visibility);
        run_network(network[1], inputs.w);
        if (mine) answer = answer_of(0);
    }
    if (on(scattering_term) && !on(has_medium)) {
        if (mine) encode_scattering(cue, arrives);
        run_network(network[0], 0);
    }
    if (!mine) return;
    float shadow = shadow_factor(shadowed, visibility, answer);
    irradiance *= share;
    add_colour(l.intensity.rgb, shadow, arrives);
    if (!on(deferred)) return;
    write_layer(4 + 3 * i, specular_sum);
    write_layer(5 + 3 * i, diffuse_sum);
    write_layer(6 + 3 * i, vec3(answer, visibility, sigmoid(raw(asg_weight + 3))));
    specular_sum = vec3(0);
    diffuse_sum = vec3(0);
}
void add_ambient() {
    float arrives[lengths];
    vec3 before[3] = vec3[3](diffuse_sum, specular_sum, scattering_sum);
    if (mine) find_ambient_geometry(sky_shares[me]);
    for (int k = 0; k < lengths; k++) arrives[k] = on(transport) ? medium[k].w : 0.0;
    if (on(scattering_term) && !on(has_medium)) {
        if (mine) encode_scattering(0.0, arrives);
        run_network(network[0], 0);
    }
    if (!mine) return;
    diffuse_sum = vec3(0);
    specular_sum = vec3(0);
    scattering_sum = vec3(0);
    add_colour(vec3(lens.y), 1.0, arrives);
    vec3 sum = ambient_at(axes[2]) * (diffuse_sum + scattering_sum);
    sum += ambient_at(2.0 * dot(axes[2], wo) * axes[2] - wo) * specular_sum;
    diffuse_sum = before[0];
    specular_sum = before[1];
    scattering_sum = before[2] + sum;
}
void main() {
    uint at = group() * uint(inputs.z);
    if (at >= shaded_count) return;
    mine = int(lane()) < inputs.z;
    at += lane();
    live = mine && at < shaded_count;
    me = shaded[min(at, shaded_count - 1u)];
    diffuse_sum = specular_sum = scattering_sum = vec3(0);
    black = false;
    if (mine) {
        find_frame();
        if (counts.w > 0) write_lobe(depths[me]);
    }
    for (int i = 0; i < counts.z; i++) add_light(i);
    if (on(has_ambient)) add_ambient();
    if (!live) return;
    vec3 sum = diffuse_sum + specular_sum + scattering_sum;
    black = black || !is_finite(sum) || !is_finite(axes[2]) || is_broken();
    for (int i = 0; i < counts.w && black; i++) layers[uint(i) * uint(counts.x) + me] = vec4(0);
    colors[me] = black ? vec4(0, 0, 0, 1) : vec4(sum, 0);
}
