/* What an engine's shadow maps let pass, as ssdgs_shadow_map says. */

/* -1: the map does not have the place. away: unit vector from the light. */
float passes_map(uint which, vec3 place, vec3 away, float distance) {
    shadow_map m = shadow_maps[which];
    vec4 at, by;
    for (int i = 0; i < 4; i++) {
        at[i] = dot(m.clip[i].xyz, place) + m.clip[i].w;
        by[i] = dot(m.clip[i].xyz, away);
    }
    vec2 size = vec2(m.size.xy), p = (1 + vec2(1, m.kind.w) * at.xy / at.w) / 2 * size - 0.5;
    if (!(at.w > 0 && p.x >= -0.5 && p.x <= size.x - 0.5 && p.y >= -0.5 && p.y <= size.y - 0.5)) return -1;
    bool reversed = !(m.kind.y > 0) && by.z * at.w < at.z * by.w;
    float w_there = at.w - m.kind.x * by.w, z = (at.z - m.kind.x * by.z) / w_there;
    float d = m.kind.y > 0 ? (distance - m.kind.x) / m.kind.y : m.kind.z > 0 ? z : (1 + z) / 2;
    bool beyond = reversed ? d < 0 : d > 1;
    if (!(m.kind.y > 0) && !(w_there > 0)) return 1; /* nearer to the light than the bias */
    d = clamp(d, 0, 1);
    p = max(p, vec2(0));
    ivec2 first = ivec2(p);
    vec2 part = p - vec2(first);
    float passed = 0;
    for (int i = 0; i < 4; i++) {
        ivec2 from = min(first + ivec2(i & 1, i >> 1), m.size.xy - 1);
        float there = outside[m.size.z + from.y * m.size.x + from.x];
        bool hidden = is_number(there) && (reversed ? there > d : there < d);
        passed += hidden ? 0 : ((i & 1) != 0 ? part.x : 1 - part.x) * (i > 1 ? part.y : 1 - part.y);
    }
    return beyond && passed > 0.999999 ? -1 : passed;
}
float let_pass(int light, vec3 place) {
    bool directional = lamps[light].place.w > 0;
    vec3 away = directional ? -lamps[light].place.xyz : place - lamps[light].place.xyz;
    float distance = length(away), passed = -1;
    if (distance > 0) away /= distance;
    for (uint i = 0u; i < map_count && passed < 0; i++)
        if (shadow_maps[i].size.w == light) passed = passes_map(i, place, away, distance);
    return passed < 0 ? 1 : passed;
}
