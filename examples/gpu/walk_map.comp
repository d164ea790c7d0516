/* WALK of a light whose map or flux is asked for. Reads the tiles' lists of one of its views. Writes the
   map: of each pixel where transmittance falls below 0.98, 0.5 and 0.1. A tile where nothing is has -1
   first. With flux it writes of each entry the sum of solid angle x blend weight. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "walk.glsl"
const uint window = 64u, windows = 1u;
#include "window.glsl"
#include "fours.glsl"
#include "sums.glsl"

layout(std430, binding = 8) buffer sums { vec4 tile_sums[]; };
layout(std430, binding = 9) writeonly buffer maps_ { vec4 light_map[]; };
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
    float inverse_focal = views[view].kind.w;
    vec2 slope = (centre() - views[view].lens.zw) * inverse_focal;
    float cosine2 = views[view].kind.y > 0 ? 1 : 1 / (1 + dot(slope, slope));
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
    if (!find_tile(camera_tiles + group(), tiles)) return;
    uint begin = tile_start[tile], end = tile_start[tile + 1u], number = uint(views[view].of.y) + own_tile;
    if (maps != 0u && begin == end && lane() == 0u) light_map[number * 512u].x = -1; /* nothing is there */
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
            distances[lane()] = depth[base + entry.first] - nearest;
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
    if (maps == 0u || begin == end) return;
    light_map[(number * 256u + lane()) * 2u] = vec4(falls, left.x);
    light_map[(number * 256u + lane()) * 2u + 1u] = vec4(left.y, before, t);
}
