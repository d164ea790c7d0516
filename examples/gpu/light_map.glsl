/* Lights' maps: what of a light passes splats on the way to a place. Here as in ssdgs_light_map(), but in
   the order in which tiles lie on the device. */

struct light_pixel {
    float fall[3]; /* the distances at which transmittance falls */
    float left[2];
    float before[2];
    float behind;
};
layout(std430, binding = 9) readonly buffer light_map_block { light_pixel light_pixels[]; };
/* Through a map's pixel: what a fall leaves stays until the next is nearer than `thick`, and from there goes
   straight to what there was before that. */
float passed(int tile, int tiles_x, ivec2 p, float distance, float thick) {
    uint number = uint(tile + (p.y >> 4) * tiles_x + (p.x >> 4));
    if (light_pixels[number * 256u].fall[0] < 0.0) return 1.0; /* the tile has nothing */
    light_pixel at = light_pixels[number * 256u +
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
/* To a place in the world, between four pixels of a view; -1 outside of it. */
float passed_to(int which, vec3 place) {
    projection v = views[which];
    vec2 most = vec2(v.size.xy - 1);
    vec3 t = vec3(dot(v.view[0].xyz, place) + v.view[0].w, dot(v.view[1].xyz, place) + v.view[1].w,
        dot(v.view[2].xyz, place) + v.view[2].w);
    if (!(t.z > v.kind.x)) return -1.0;
    vec2 at = v.lens.xy * t.xy * (v.kind.y > 0.0 ? 1.0 : 1.0 / t.z) + v.lens.zw - 0.5;
    if (!(at.x >= -0.5 && at.y >= -0.5 && at.x <= most.x + 0.5 && at.y <= most.y + 0.5)) return -1.0;
    at = clamp(at, vec2(0), most);
    float distance = v.kind.z > 0.0 ? length(t) : t.z;
    distance -= pixel_bias + 1e-6 * distance + facts[which].nearest;
    ivec2 p = min(ivec2(at), v.size.xy - 2);
    at -= vec2(p);
    vec2 two = vec2(0);
    for (int i = 0; i < 2; i++)
        two[i] = mix(passed(v.of.y, v.size.z, p + ivec2(0, i), distance, pixel_bias),
            passed(v.of.y, v.size.z, p + ivec2(1, i), distance, pixel_bias), at.x);
    return mix(two.x, two.y, at.y);
}
/* Of a light's views the first that knows the place; -1: none does. */
float light_map_at(int light, vec3 place) {
    float found = -1.0;
    ivec4 of = lamps[light].of;
    for (int i = 0; i < of.y && found < 0.0; i++) found = passed_to(of.x + i, place);
    return found;
}
