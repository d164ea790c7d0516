/* SHADE. Reads the list of seen_list.comp, models with their networks, tables, and for each Gaussian and
   light visibility, depth cue and transport. Writes colours, and the layers of deferred highlights. A
   group shades as many Gaussians of an object as its networks have columns, under one light after the
   other. All is in the object's space but what layers hold. */
#version 430
#include "common.glsl"
#include "rotation.glsl"
#include "frame.glsl"
#include "model.glsl"
#include "lighting.glsl"
#include "network.glsl"

/* ---- a Gaussian under a light: eqs. 9 to 12 ---- */

uint me; /* the Gaussian; in its object */
uint own;
vec3 place;
mat3 axes; /* of its frame; the third is the normal */
vec3 wi;
vec3 wo;
float irradiance;
float cosine;
float gloss;
bool black; /* something is not finite, or too large */
float blunter = 0.0; /* what the object's roughness takes from a deferred lobe's logarithms */
/* What a baked model has besides its colours is neutral. */
float raw(int channel) {
    if (!on(is_baked)) return plane_of(o, uint(channel), own);
    return channel == frame || channel >= material ? 1.0 : channel < frame ? 0.5 : 0.0;
}
vec3 place_of(uint g) { return planes_of(o, 0u, g - uint(objects[o].place.x)); }
vec3 raw3(int channel) { return vec3(raw(channel), raw(channel + 1), raw(channel + 2)); }
/* NaN, which max() and clamp() may lose. */
bool is_broken() {
    bool any = false;
    for (int i = diffuse; i < (on(is_deferred) ? asg_weight + 4 : material); i++)
        any = any || !is_number(raw(i));
    return any;
}
void find_frame() {
    place = place_of(me);
    axes = rotation(vec4(raw(frame), raw3(frame + 1)));
    vec3 to = objects[o].eye.xyz - place;
    wo = to / sqrt(max(dot(to, to), objects[o].eye.w));
}
/* Deferred: ln lambda, ln mu; sqrt(lambda mu). */
float sharpness(int i) { return clamp(raw(asg_weight + i) - blunter, -12.0, 12.0); }
float lobe_height() { return power_of_e(0.5 * (sharpness(0) + sharpness(1))); }
void find_geometry(lamp l) {
    bool directional = l.place.w > 0.0;
    vec3 to = directional ? turned_back(o, l.place.xyz) :
        turned_back(o, (l.place.xyz - offset_of(o)) / objects[o].shape.x) - place;
    irradiance = directional ? 1.0 : 1.0 / max(dot(to, to), objects[o].eye.w);
    wi = to * sqrt(irradiance);
    cosine = max(0.0, dot(axes[2], wi));
    gloss = lobe_height(); /* deferred: the rest is the pixels' */
    if (on(is_deferred)) return;
    vec3 h;
    float missing;
    float sum = 0.0;
    bool shines = half_vector(wi, wo, h, missing) && on(specular_term);
    vec3 local = h * axes;
    for (int j = 0; j < 8 && shines; j++) {
        vec4 x = objects[o].basis[3 * j];
        vec4 y = objects[o].basis[3 * j + 1];
        float along = dot(x.xyz, local);
        float across = dot(y.xyz, local);
        sum += softplus(raw(asg_weight + j)) * power_of_e(-(x.w * along * along + y.w * across * across));
    }
    gloss = schlick(0.04, missing) * sum;
}
/* What a spot's cone, the range and the focus leave. */
float reach_of(lamp l, vec3 at) {
    vec3 way = to_world(o, at) - l.place.xyz;
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
    float zv = zr * objects[o].edit.w;
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
/* Adds a light's; `arrives` of transport's lengths. Deferred ones are without S. taken: kept colours that are
   the light's. */
void add_colour(vec3 intensity, float shadow, float arrives[lengths], vec3 taken) {
    vec3 power = irradiance * intensity;
    vec3 lit = on(is_deferred) ? power : shadow * power;
    diffuse_sum += on(is_deferred) ? taken : shadow * taken;
    if (on(diffuse_term)) diffuse_sum += softplus(raw3(diffuse)) * (0.31830988618 * cosine) * lit;
    if (on(specular_term)) specular_sum += softplus(raw3(specular)) * gloss * lit;
    if (!on(scattering_term)) return;
    vec3 through = vec3(0);
    for (int i = 0; i < int(lengths) && on(has_medium); i++)
        through += 0.31830988618 * objects[o].medium[i].rgb * arrives[i];
    if (!on(has_medium)) through = profile() * (on(shadow_on_scattering) ? shadow : 1.0);
    scattering_sum += softplus(raw3(scattering)) * through * power;
}
/* The networks' inputs. */
void encode_shadow(float visibility) {
    vec4 centre = objects[o].centre;
    int at = encode(0, (place - centre.xyz) * (on(residual_shadow) ? centre.w : 1.0), 3);
    at = put(encode(at, wi, 3), visibility);
    for (int i = 0; i < 6; i++) at = put(at, raw(material + i));
}
void encode_scattering(float cue, float arrives[lengths]) {
    vec4 centre = objects[o].centre;
    int at = encode(0, (place - centre.xyz) * (on(has_cue | has_transport) ? centre.w : 1.0), 4);
    at = encode(encode(at, wo, objects[o].inputs.x), wi, objects[o].inputs.y);
    for (int i = 0; i < 3; i++) at = put(at, axes[2][i]);
    for (int i = 0; i < 6; i++) at = put(at, raw(material + i));
    if (on(has_cue)) {
        encode(at, 1, cue * centre.w, 4);
        at += 9;
    }
    for (int i = 0; i < int(lengths) && on(has_transport); i++) at = put(at, arrives[i]);
}

/* ---- deferred highlights' layers, and ambient light ---- */

layout(std430, binding = 11) writeonly buffer layer_block { vec4 layer[]; }; /* the first is the colour */
bool live; /* the thread has a Gaussian of its own */
void write_layer(int which, vec3 value) {
    black = black || !is_finite(value) || any(greaterThan(abs(value), vec3(1e30)));
    if (live) layer[uint(which) * count + me] = vec4(value, 0);
}
/* Q of the pixel's highlight, depth, F0, cover, normal. */
void write_lobe(float depth) {
    vec3 x = turned(o, axes[0]);
    vec3 y = turned(o, axes[1]);
    float along = power_of_e(sharpness(0));
    float across = power_of_e(sharpness(1));
    write_layer(1, along * x * x + across * y * y);
    write_layer(2, along * x * x.yzx + across * y * y.yzx);
    write_layer(3, vec3(depth, sigmoid(raw(asg_weight + 2) - 3.1780538303479458), 1));
    write_layer(4, turned(o, axes[2]));
}
/* What a lobe e^(-x u), u = 1 - (n.h)^2, sends back along n of a sky of radiance 1, over 4 pi. */
float lobe_share(float x) {
    bool even = x < 0.03;
    float share = even ? 0.5 - x / 8.0 : (1.0 - power_of_e(-0.5 * x)) / x;
    if (!on(is_deferred)) return share;
    return (even ? 0.25 - x / 24.0 : (1.0 - 2.0 * share) / x) * (1.0 + 1.0 / (4.4 + 0.75 * x));
}
/* Of lobes that much narrower. */
float lobe_energy(float narrower) {
    float sum = 0.0;
    if (on(is_deferred)) narrower *= lobe_height();
    for (int j = 0; j < 8; j++) {
        vec4 x = objects[o].basis[3 * j];
        vec4 y = objects[o].basis[3 * j + 1];
        vec4 b = objects[o].basis[3 * j + 2];
        if (on(is_deferred)) sum += b.z * lobe_share(b.y * narrower);
        else sum += softplus(raw(asg_weight + j)) * lobe_share(sqrt(x.w * y.w) * narrower);
    }
    return 12.566370614359172 * sum * (on(is_deferred) ? narrower : 1.0);
}
/* The irradiance of ambient light on a surface with a normal. */
vec3 ambient_at(vec3 n) {
    return max(vec3(0), ambient[0].rgb + n.y * ambient[1].rgb + n.z * ambient[2].rgb + n.x * ambient[3].rgb +
        n.x * n.y * ambient[4].rgb + n.y * n.z * ambient[5].rgb + (3.0 * n.z * n.z - 1.0) * ambient[6].rgb +
        n.x * n.z * ambient[7].rgb + (n.x * n.x - n.y * n.y) * ambient[8].rgb);
}
/* What the object makes of its model's colours, and of its highlights. */
vec3 tint = vec3(1.0);
float shinier = 1.0;
layout(std430, binding = 12) readonly buffer masks { uint mask[]; }; /* four a word */
void find_edits() {
    vec4 edit = objects[o].edit;
    int at = objects[o].more.w;
    uint byte = uint(max(at, 0)) + own;
    float share = at < 0 ? 1.0 : float(mask[byte >> 2u] >> 8u * (byte & 3u) & 255u) / 255.0;
    tint = 1.0 + share * (objects[o].tint.rgb - 1.0);
    shinier = 1.0 + share * (objects[o].tint.w - 1.0);
    if (!on(specular_term) || edit.x == 1.0) return;
    float wider = on(is_deferred) ? 1.0 + share * (edit.x - 1.0) : edit.x;
    if (on(is_deferred)) shinier *= lobe_energy(1.0) / lobe_energy(1.0 / (wider * wider));
    else shinier *= lobe_energy(wider * wider) / lobe_energy(1.0);
    if (on(is_deferred)) blunter = 2.0 * log(wider);
}

/* ---- colours that no light makes ---- */

float decoded(float x) { return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4); }
/* Real spherical harmonics, as seen from the eye. */
vec3 find_kept() {
    uint first = on(is_baked) ? 11u : 38u;
    int degree = objects[o].inputs.w;
    uint more = uint((degree + 1) * (degree + 1) - 1);
    vec3 d = place - objects[o].eye.xyz;
    d /= sqrt(max(dot(d, d), 1e-30));
    vec3 s = d * d;
    float y[15] = float[15](-0.48860251190291992 * d.y, 0.48860251190291992 * d.z, -0.48860251190291992 * d.x,
        1.0925484305920792 * d.x * d.y, -1.0925484305920792 * d.y * d.z,
        0.31539156525252005 * (2.0 * s.z - s.x - s.y), -1.0925484305920792 * d.x * d.z,
        0.54627421529603959 * (s.x - s.y), -0.59004358992664352 * d.y * (3.0 * s.x - s.y),
        2.8906114426405538 * d.x * d.y * d.z, -0.45704579946446572 * d.y * (4.0 * s.z - s.x - s.y),
        0.3731763325901154 * d.z * (2.0 * s.z - 3.0 * (s.x + s.y)),
        -0.45704579946446572 * d.x * (4.0 * s.z - s.x - s.y), 1.4453057213202769 * d.z * (s.x - s.y),
        -0.59004358992664352 * d.x * (s.x - 3.0 * s.y));
    vec3 kept;
    for (uint c = 0u; c < 3u; c++) {
        float sum = 0.28209479177387814 * plane_of(o, first + c, own) + 0.5;
        for (uint i = 0u; i < more; i++) sum += y[i] * plane_of(o, first + 3u + c * more + i, own);
        black = black || !is_number(sum);
        sum = is_number(sum) ? max(0.0, sum) : 0.0;
        kept[c] = (on(decodes) ? decoded(sum) : sum) * objects[o].shape.w;
    }
    return kept;
}

/* Light from all around falls as from along the normal, and a highlight mirrors what is around its
   direction. */
void find_ambient_geometry(float sky_share) {
    float facing = dot(axes[2], wo);
    float steep = on(is_deferred) ? min(1.0, max(0.0, facing) / 0.25) : 1.0;
    float f0 = on(is_deferred) ? sigmoid(raw(asg_weight + 2) - 3.1780538303479458) : 0.04;
    wi = axes[2];
    irradiance = sky_share;
    cosine = 1.0;
    facing = clamp(facing, 0.0, 1.0);
    gloss = on(specular_term) ? schlick(f0, 1.0 - facing) * lobe_energy(1.0) * shinier : 0.0;
    gloss *= (on(is_deferred) ? steep * steep : facing) * 0.31830988618;
}

/* ---- all of it ---- */

layout(std430, binding = 5) readonly buffer shadeds { uint shaded_count; uint shaded[]; };
layout(std430, binding = 6) readonly buffer visibility_block { float visibilities[]; };
layout(std430, binding = 7) readonly buffer cue_block { float cues[]; };
layout(std430, binding = 8) readonly buffer transport_block { float transported[]; };
layout(std430, binding = 9) readonly buffer depths { float depth[]; }; /* the camera's */
layout(std430, binding = 10) readonly buffer sky_share_block { float sky_shares[]; };
shared uint lit;
bool mine; /* the thread has a column */
uint first_of_64; /* in the list */
/* Whether any is in the light's reach, of the 64 that the CPU shades together. */
bool reached(lamp l) {
    uint g = shaded[first_of_64 + (lane() & 63u)];
    barrier();
    if (lane() == 0u) lit = 0u;
    barrier();
    if (lane() < 64u && g != none && reach_of(l, place_of(g)) > 0.0) atomicOr(lit, 1u);
    barrier();
    return lit != 0u;
}
vec3 kept; /* colours; what of them no light takes for its own */
float rest;
void add_light(int i) {
    lamp l = lamps[i];
    bool casts = l.intensity.w > 0.0;
    bool shadowed = casts && on(shadow_term);
    float share = mine && l.rim.z > 0.0 ? reach_of(l, place) : 1.0;
    float visibility = 1.0;
    float cue = 0.0;
    float answer = 0.0;
    float arrives[lengths] = float[lengths](0.0, 0.0, 0.0, 0.0, 0.0);
    bool comes = on(is_lit) && reaches(i, o) && l.intensity.w >= 0.0;
    if (comes && l.rim.z > 0.0) comes = reached(l);
    if (layers > 0u && !(comes && on(is_deferred))) {
        write_layer(5 + 3 * i, vec3(0));
        write_layer(6 + 3 * i, vec3(0));
        bool waits = on(is_deferred) && on(is_lit); /* there S is 1, or what blends with it would be darker */
        write_layer(7 + 3 * i, waits ? vec3(0, 1, sigmoid(raw(asg_weight + 3))) : vec3(0));
    }
    if (!comes) return;
    if (mine) {
        find_geometry(l);
        uint at = count * uint(i) + me;
        if (shadowed) visibility = visibilities[at];
        if (casts && on(has_cue) && on(scattering_term)) cue = cues[at] * objects[o].edit.y;
        for (int k = 0; k < int(lengths) && on(has_transport); k++) {
            float brought = casts ? transported[count * uint(int(lengths) * i + k) + me] : 0.0;
            if (casts) arrives[k] = irradiance > 0.0 ? brought / irradiance : 0.0;
            else arrives[k] = cosine * objects[o].medium[k].w;
        }
    }
    if (shadowed && objects[o].network[1].x > 0) {
        if (mine) encode_shadow(visibility);
        run_network(objects[o].network[1], objects[o].more.y);
        if (mine) answer = answer_of(0);
    }
    if (on(scattering_term) && !on(has_medium)) {
        if (mine) encode_scattering(cue, arrives);
        run_network(objects[o].network[0], objects[o].more.x);
    }
    if (!mine) return;
    float shadow = shadow_factor(shadowed, visibility, answer);
    float area = l.place.w > 0.0 ? 1.0 : objects[o].shape.x * objects[o].shape.x;
    float taken = objects[o].shape.w > 0.0 ? l.share.x * share : 0.0;
    irradiance *= share;
    rest -= taken;
    add_colour(l.intensity.rgb * objects[o].edit.z / area, shadow, arrives, taken * kept);
    if (!on(is_deferred)) return;
    write_layer(5 + 3 * i, specular_sum * tint * shinier);
    write_layer(6 + 3 * i, diffuse_sum * tint);
    write_layer(7 + 3 * i, vec3(answer, visibility, sigmoid(raw(asg_weight + 3))));
    specular_sum = vec3(0);
    diffuse_sum = vec3(0);
}
void add_ambient() {
    float arrives[lengths];
    vec3 before[3] = vec3[3](diffuse_sum, specular_sum, scattering_sum);
    if (mine) find_ambient_geometry(sky_shares[uint(objects[o].more.z) + own]);
    for (int k = 0; k < int(lengths); k++) arrives[k] = on(has_transport) ? objects[o].medium[k].w : 0.0;
    if (on(scattering_term) && !on(has_medium)) {
        if (mine) encode_scattering(0.0, arrives);
        run_network(objects[o].network[0], objects[o].more.x);
    }
    if (!mine) return;
    diffuse_sum = vec3(0);
    specular_sum = vec3(0);
    scattering_sum = vec3(0);
    add_colour(vec3(objects[o].edit.z), 1.0, arrives, vec3(0));
    vec3 n = turned(o, axes[2]);
    vec3 mirrored = turned(o, 2.0 * dot(axes[2], wo) * axes[2] - wo);
    vec3 sum = ambient_at(n) * (diffuse_sum + scattering_sum) + ambient_at(mirrored) * specular_sum;
    diffuse_sum = before[0];
    specular_sum = before[1];
    scattering_sum = before[2] + sum;
}
void main() {
    uint parts_of_64 = 64u / segments, in_64 = group() % parts_of_64; /* segments: the fewest columns */
    first_of_64 = group() / parts_of_64 * 64u;
    if (first_of_64 >= shaded_count) return;
    o = object_at(shaded[first_of_64]);
    columns = objects[o].inputs.z;
    uint at = first_of_64 + in_64 * uint(columns);
    if (in_64 * uint(columns) >= 64u || shaded[at] == none) return;
    mine = int(lane()) < columns;
    me = shaded[at + min(lane(), uint(columns) - 1u)];
    live = mine && me != none;
    if (me == none) me = shaded[at];
    own = me - uint(objects[o].place.x);
    diffuse_sum = specular_sum = scattering_sum = kept = vec3(0);
    rest = 1.0;
    black = false;
    if (mine) {
        find_frame();
        find_edits();
        if (objects[o].shape.w > 0.0) kept = find_kept();
        if (layers > 0u) write_lobe(depth[me]);
    }
    for (int i = 0; i < int(lights); i++) add_light(i);
    if (on(has_ambient)) add_ambient();
    if (!live) return;
    diffuse_sum += max(rest, 0.0) * kept;
    vec3 sum = tint * (diffuse_sum + shinier * specular_sum + scattering_sum);
    black = black || !is_finite(sum) || !is_finite(axes[2]) || is_broken();
    for (uint i = 1u; i <= layers && black; i++) layer[i * count + me] = vec4(0);
    layer[me] = black ? vec4(0, 0, 0, 1) : vec4(sum, 0);
}
