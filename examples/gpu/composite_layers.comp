/* COMPOSITE with layers: colours, and highlights of what the pixels' layers hold, the materials one after
   the other, each under the lights one after the other. composite.glsl says what it reads and writes. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "walk.glsl"
const uint window = 128u, windows = 1u;
#include "window.glsl"
#include "fours.glsl"
#include "hides.glsl"
const uint at_once = 8u;
#include "composite.glsl"
#include "lighting.glsl"
#include "occlude.glsl"
#include "light_map.glsl"

/* What the pixel blends of the material: Q, over the cover; depth, F0, 1; normal. */
vec3 q, mixed, more, normal, ray, place;
float cover;
bool later; /* other materials have been here */
/* n.wi / (wo.h)^2 F sum of a e^(-s ((1 - t) p.Q p + t h.Q h)) */
float highlight(vec3 wi, vec3 wo) {
    vec3 h;
    float missing;
    bool shines = half_vector(wi, wo, h, missing) && dot(normal, normal) >= 1e-12;
    vec3 n = normal / sqrt(max(dot(normal, normal), 1e-12));
    vec3 p = h - n * dot(n, h);
    float own = dot(p, q * p + mixed * p.yzx + mixed.zxy * p.zxy);
    float all = dot(h, q * h + mixed * h.yzx + mixed.zxy * h.zxy);
    float grazing = max(0.25, 1.0 - missing);
    float sum = 0.0;
    for (int j = 0; j < 8; j++) {
        vec4 b = objects[o].basis[3 * j + 2];
        sum += b.z * power_of_e(-b.y * max(0.0, (1.0 - b.x) * own + b.x * all));
    }
    return shines ? max(0.0, dot(n, wi)) / (grazing * grazing) * schlick(more.y / cover, missing) * sum : 0.0;
}
uint layer_plane(uint which, uint c) { return (5u + 3u * which + c) * pixels() + here(); }
uint light_plane(uint light, uint shadow) { /* of visibility, or of S */
    return (5u + 3u * (layers + 1u) + lights * shadow + light) * pixels() + here();
}
void keep_layer(uint which, vec3 value) {
    for (uint c = 0u; c < 3u && inside(); c++)
        plane[layer_plane(which, c)] = value[c] + (later ? plane[layer_plane(which, c)] : 0);
}
/* Parts of several materials: v and S are averaged by cover, D such that D x S is the sum of both. */
void keep_light(uint light, vec3 mirrored, vec3 diffused, vec3 arrives, float map, float shadow) {
    uint v = light_plane(light, 0u), s = light_plane(light, 1u);
    keep_layer(5u + 3u * light, mirrored);
    keep_layer(7u + 3u * light, arrives);
    if (!inside()) return;
    float all = plane[layer_plane(3u, 2u)], share = later && all > 1e-6 ? more.z / all : 1;
    float before = later ? plane[s] : 0;
    float joined = later ? before + share * (shadow - before) : shadow;
    for (uint c = 0u; c < 3u; c++) {
        uint d = layer_plane(6u + 3u * light, c);
        float sum = later ? diffused[c] * shadow + plane[d] * before : 0;
        plane[d] = !later ? diffused[c] : joined > 0 ? sum / joined : 0;
    }
    plane[v] = later ? plane[v] + share * (map - plane[v]) : map;
    plane[s] = joined;
}
/* What one light adds, by its M, D and shadow layer. */
vec3 lit_by(uint light, vec3 mirrored, vec3 diffused, vec3 arrives) {
    lamp l = lamps[light];
    bool shadowed = on(shadow_term) && on(is_lit) && l.intensity.w > 0.0;
    vec3 over = arrives / cover; /* the network's answer, v_g, softness */
    float map = 1.0;
    if (shadowed && more.z > 1e-6) {
        map = light_map_at(int(light), place);
        map = map < 0.0 ? over.y : map * (map_count > 0u ? let_pass(int(light), place) : 1.0);
    }
    float shadow = shadow_factor(shadowed, mix(map, over.y, over.z), over.x);
    vec3 sum = shadow * diffused;
    if (any(greaterThan(mirrored, vec3(0)))) {
        bool directional = l.place.w > 0.0;
        vec3 to = directional ? l.place.xyz : l.place.xyz - place;
        float least = objects[o].eye.w * objects[o].shape.x * objects[o].shape.x;
        vec3 wi = directional ? to : to / sqrt(max(dot(to, to), least));
        sum += mirrored * (shadow * highlight(wi, -normalize(ray)));
    }
    if (parts != 0u) keep_light(light, mirrored, diffused, arrives, map, shadow);
    return sum;
}
/* Some object of the material; its lobes and its kind of shadow are all of theirs. */
void find_object(uint wanted) {
    o = 0u;
    while (sharing != 0u && o + 1u < object_count && objects[o].of.y != int(wanted)) o++;
}
void main() {
    vec3 color = vec3(0);
    float passed_all = 1, depth_at_half = 0;
    if (!find_tile(group(), camera_tiles)) return;
    vec2 at = (centre() - views[0].lens.zw) / views[0].lens.xy;
    ray = views[0].view[0].xyz * at.x + views[0].view[1].xyz * at.y + views[0].view[2].xyz;
    later = false;
    for (uint material = material_after(-1); material != none; material = material_after(material_now)) {
        material_now = int(material);
        find_object(material);
        blend(0u);
        passed_all = t;
        depth_at_half = half_depth;
        q = sums[1], mixed = sums[2], more = sums[3], normal = sums[4];
        cover = max(more.z, 1e-6);
        q /= cover, mixed /= cover;
        place = eye.xyz + more.x / cover * ray;
        color += sums[0];
        if (parts != 0u)
            for (uint i = 0u; i < 5u; i++) keep_layer(i, sums[i]);
        if (lights > 0u) color += lit_by(0u, sums[5], sums[6], sums[7]);
        for (uint light = 1u; light < lights; light += 2u) {
            blend(5u + 3u * light);
            color += lit_by(light, sums[0], sums[1], sums[2]);
            if (light + 1u < lights) color += lit_by(light + 1u, sums[3], sums[4], sums[5]);
        }
        later = true;
    }
    if (!inside()) return;
    for (uint c = 0u; c < 3u; c++) plane[c * pixels() + here()] = color[c];
    plane[3u * pixels() + here()] = passed_all;
    if (median != 0u) plane[4u * pixels() + here()] = depth_at_half;
    for (uint i = 0u; !later && parts != 0u && i < 3u * (layers + 1u) + 2u * lights; i++)
        plane[(5u + i) * pixels() + here()] = 0; /* nothing is there */
}
