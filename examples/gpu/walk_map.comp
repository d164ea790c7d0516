/* WALK of a light whose map or flux is asked for. Reads the tiles' lists of one of its views. Writes the
   map: of each pixel where transmittance falls below 0.98, 0.5 and 0.1. With flux it writes of each entry
   the sum of solid angle x blend weight. */
#version 430
#include "common.glsl"
#include "walk.glsl"
const uint window = 64u, windows = 1u;
#include "window.glsl"
#include "fours.glsl"
#include "sums.glsl"

layout(std430, binding = 3) readonly buffer depths { float depth[]; };
layout(std430, binding = 7) writeonly buffer maps { vec4 light_map[]; };
layout(std430, binding = 5) buffer sums { vec4 tile_sums[]; };
layout(std430, binding = 6) readonly buffer facts_ { fact facts[]; };
layout(std430, binding = 8) writeonly buffer map_tiles { uint map_tile[]; };
shared float distances[window];
float t, omega; /* transmittance; solid angle */
const float levels[4] = float[4](0.98, 0.5, 0.1, -1);
uint fallen;
vec3 falls;
vec2 left, before;

void note(float from, float to, float distance) {
    for (uint l = 0u; l < 3u; l++) {
        if (l != fallen || to >= levels[l]) continue;
        falls[l] = distance;
        if (l < 2u) left[l] = to;
        if (l > 0u) before[l - 1u] = from;
        fallen++;
    }
}
float solid_angle() {
    vec2 slope = (centre() - vec2(cx, cy)) * inverse_focal;
    float cosine2 = orthographic != 0u ? 1 : 1 / (1 + dot(slope, slope));
    return cosine2 * sqrt(cosine2) * inverse_focal * inverse_focal;
}

void meet(float weight, uint i) {
    float alpha = alpha_of(weight), past = t;
    if (i == none) return;
    t = max(fma(-alpha, t, t), 1e-20);
    if (t < levels[fallen]) note(past, t, distances[i]);
    if (flux != 0u) part[0][i % at_once][lane()] = omega * alpha * past;
}
void main() {
    if (group() >= tiles) return;
    uint begin = tile_start[group()], end = tile_start[group() + 1u], number = first_tile + group();
    if (map != 0u && lane() == 0u) map_tile[number] = begin < end ? number : none;
    float nearest = facts[view].nearest;
    bool dark = false;
    vec2 at = centre();
    t = 1;
    omega = solid_angle();
    fallen = 0u;
    falls = vec3(1e30);
    left = before = vec2(0);
    if (lane() == 0u) lit = 0u;
    for (uint from = begin, step = 1u; from < end && !dark; from += window, step++) {
        uint entries = min(window, end - from), own = lane() >> 5u;
        barrier();
        if (lane() < window) masks[lane()] = 0u;
        if (lane() < entries) {
            pair entry = tile_list[from + lane()];
            load(lane(), entry.first, entry.second);
            distances[lane()] = depth[entry.first] - nearest;
        }
        find_covered(0u);
        for (uint first = 0u; first < entries; first += at_once) {
            uint word = first >> 5u, rest = covered[words * micro() + word] & 0xFFu << (first & 31u);
            while (rest != 0u) meet_four(rest, word, at);
            if (flux == 0u) continue;
            add_up(1u, masks[first + own]);
            if (lane() < at_once && first + lane() < entries)
                tile_sums[from + first + lane()].w = added(0u, lane());
            barrier();
        }
        dark = is_dark(t, step);
    }
    if (map == 0u || begin == end) return;
    light_map[(number * 256u + lane()) * 2u] = vec4(falls, left.x);
    light_map[(number * 256u + lane()) * 2u + 1u] = vec4(left.y, before, t);
}
