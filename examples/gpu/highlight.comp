/* COMPOSITE's deferred highlights of one light, a thread a pixel. Reads the layers that Gaussians blend
   to, and the light's map. Writes the picture, and each pixel's visibility and shadow. */
#version 430
#include "common.glsl"
#include "lighting.glsl"

layout(std430, binding = 0) readonly buffer layer_pixel_block { float layer_pixels[]; };
layout(std430, binding = 1) readonly buffer lamp_block { lamp lamps[]; };
struct light_pixel {
    float fall[3]; /* the distances at which transmittance falls */
    float left[2];
    float before[2];
    float behind;
};
struct face {
    vec4 view[3];
    vec4 lens; /* fx, fy, cx, cy */
    vec4 kind; /* near plane; 1: orthographic; 1: by distance */
    ivec4 size; /* width, height, tiles in a row, tiles */
};
layout(std430, binding = 2) readonly buffer face_block { face face_of[]; };
layout(std430, binding = 3) readonly buffer fact_block { fact facts[]; };
layout(std430, binding = 4) readonly buffer map_tile_block { uint map_tiles[]; };
layout(std430, binding = 5) readonly buffer light_map_block { light_pixel light_pixels[]; };
/* Through a map's pixel: what a fall leaves stays until the next is nearer than `thick`, and from there goes
   straight to what there was before that. */
float passed(face f, int tiles_before, ivec2 p, float distance, float thick) {
    uint tile = map_tiles[tiles_before + (p.y >> 4) * f.size.z + (p.x >> 4)];
    if (tile == 0xffffffffu) return 1.0;
    light_pixel at = light_pixels[tile * 256u +
        uint((p.y & 12) << 4 | (p.x & 12) << 2 | (p.y & 3) << 2 | (p.x & 3))];
    int level = int(distance > at.fall[0]) + int(distance > at.fall[1]) + int(distance > at.fall[2]);
    if (level == 0) return 1.0;
    if (level == 3) return at.behind;
    float left = level == 1 ? at.left[0] : at.left[1];
    float end = level == 1 ? at.fall[1] : at.fall[2];
    float begin = max(end - thick, level == 1 ? at.fall[0] : at.fall[1]);
    if (distance <= begin) return left;
    return left + ((level == 1 ? at.before[0] : at.before[1]) - left) * (distance - begin) / (end - begin);
}
/* To a place in the world, between four pixels of a face; -1 outside of it. */
float passed_to(int which, int tiles_before, float nearest, vec3 place, float bias) {
    face f = face_of[which];
    vec2 most = vec2(f.size.xy - 1);
    vec3 t = vec3(dot(f.view[0].xyz, place) + f.view[0].w, dot(f.view[1].xyz, place) + f.view[1].w,
        dot(f.view[2].xyz, place) + f.view[2].w);
    if (!(t.z > f.kind.x)) return -1.0;
    vec2 at = f.lens.xy * t.xy * (f.kind.y > 0.0 ? 1.0 : 1.0 / t.z) + f.lens.zw - 0.5;
    if (!(at.x >= -0.5 && at.y >= -0.5 && at.x <= most.x + 0.5 && at.y <= most.y + 0.5)) return -1.0;
    at = clamp(at, vec2(0), most);
    float distance = f.kind.z > 0.0 ? length(t) : t.z;
    distance -= bias + 1e-6 * distance + nearest;
    ivec2 p = min(ivec2(at), f.size.xy - 2);
    at -= vec2(p);
    vec2 rows = vec2(0);
    for (int i = 0; i < 2; i++)
        rows[i] = mix(passed(f, tiles_before, p + ivec2(0, i), distance, bias),
            passed(f, tiles_before, p + ivec2(1, i), distance, bias), at.x);
    return mix(rows.x, rows.y, at.y);
}

layout(std430, binding = 6) buffer pixel_block { float pixels[]; };
layout(std430, binding = 7) buffer pixel_visibility_block { float pixel_visibilities[]; };
layout(std430, binding = 8) writeonly buffer pixel_shadow_block { float pixel_shadows[]; };
vec3 blended(int layer, int plane, int at) {
    at += 3 * layer * plane;
    return vec3(layer_pixels[at], layer_pixels[at + plane], layer_pixels[at + 2 * plane]);
}
/* Of a light's faces the first that knows the place. */
float light_map_at(vec3 place) {
    float found = -1.0;
    for (int i = 0, tiles = 0; i < faces.y && found < 0.0; i++) {
        found = passed_to(faces.x + i, tiles, facts[faces.x + i].nearest, place, camera[2].w);
        tiles += face_of[faces.x + i].size.w;
    }
    return found;
}
/* n.wi / (wo.h)^2 F sum of a e^(-s ((1 - t) p.Q p + t h.Q h)) */
float highlight(vec3 wi, vec3 wo, vec3 normal, vec3 q, vec3 mixed, float f0) {
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
        vec4 b = basis[3 * j + 2];
        sum += b.z * power_of_e(-b.y * max(0.0, (1.0 - b.x) * own + b.x * all));
    }
    return shines ? max(0.0, dot(n, wi)) / (grazing * grazing) * schlick(f0, missing) * sum : 0.0;
}
void main() {
    int at = int(item());
    int plane = size.x * size.y;
    int light = faces.z;
    if (at >= plane) return;
    lamp l = lamps[light];
    bool shadowed = on(shadow_term) && l.intensity.w > 0.0;
    vec3 more = blended(3, plane, at); /* depth, F0, cover */
    float cover = max(more.z, 1e-6);
    vec2 pixel = (vec2(at % size.x, at / size.x) + 0.5 - lens.zw) * vec2(camera[0].w, camera[1].w);
    vec3 ray = camera[0].xyz * pixel.x + camera[1].xyz * pixel.y + camera[2].xyz;
    vec3 place = eye.xyz + more.x / cover * ray;
    vec3 arrives = blended(7 + 3 * light, plane, at) / cover; /* the network's answer, v_g, softness */
    int of_light = light * plane + at;
    float map = on(visibility_given) ? pixel_visibilities[of_light] : 1.0;
    if (!on(visibility_given) && shadowed && more.z > 1e-6) {
        map = light_map_at(place);
        map = map < 0.0 ? arrives.y : map;
    }
    float shadow = shadow_factor(shadowed, mix(map, arrives.y, arrives.z), arrives.x);
    vec3 sum = shadow * blended(6 + 3 * light, plane, at);
    vec3 mirrored = blended(5 + 3 * light, plane, at);
    if (any(greaterThan(mirrored, vec3(0)))) {
        bool directional = l.place.w > 0.0;
        vec3 to = directional ? l.place.xyz : l.place.xyz - place;
        vec3 wi = directional ? to : to / sqrt(max(dot(to, to), eye.w));
        sum += mirrored * (shadow * highlight(wi, -normalize(ray), blended(4, plane, at),
            blended(1, plane, at) / cover, blended(2, plane, at) / cover, more.y / cover));
    }
    for (int c = 0; c < 3; c++) {
        int to = c * plane + at;
        pixels[to] = sum[c] + (light > 0 ? pixels[to] : layer_pixels[to]);
    }
    pixel_visibilities[of_light] = map;
    pixel_shadows[of_light] = shadow;
}
