/* WALK of a light: eqs. 6, 7 and the depth cue. Reads the tiles' lists of one of its views. Writes of
   each entry the sums of rho v, rho and rho x cue. An entry is sampled once all that is nearer than its
   distance - bias is in the transmittance. So two windows run along the list: what is sampled, and what
   is applied to the transmittance. A thread takes of both what its micro-tile has. In the dark nothing is
   applied any more. What is in no other tile is not sampled there, unless for its cue: v = 0 / 1. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "walk.glsl"
const uint window = 64u, windows = 2u;
#include "window.glsl"
#include "sums.glsl"

layout(std430, binding = 7) readonly buffer of_gaussians { pair of_gaussian[]; };
layout(std430, binding = 8) writeonly buffer sums { vec4 tile_sums[]; };
shared float depths_of[windows * window];
shared uint alone[window];
float t, met; /* transmittance; sum of blend weight x distance */
uint near_rest, near_word; /* what of the micro-tile's is not applied yet */

/* The second window: of what is to be applied, from this entry on. */
void load_near(uint from, uint end) {
    barrier();
    if (lane() < window) {
        bool there = from + lane() < end;
        pair entry = tile_list[min(from + lane(), end - 1u)];
        load(window + lane(), entry.first, there ? entry.second : 0u);
        depths_of[window + lane()] = there ? depth[base + entry.first] : 1e30;
    }
    find_covered(1u);
    near_word = 0u;
    near_rest = covered[words * (16u + micro())];
}
/* All of the window that is nearer than this. */
void apply(float reach, float nearest, vec2 at) {
    bool nearer = true;
    while (nearer) {
        if (near_rest == 0u && near_word == 0u) near_rest = covered[words * (16u + micro()) + ++near_word];
        uint i = window + 32u * near_word + uint(findLSB(near_rest)) % 32u;
        nearer = near_rest != 0u && depths_of[i] < reach;
        if (nearer) {
            float alpha = alpha_of(weight_of(splats[i], spreads[i], at));
            met += alpha * t * (depths_of[i] - nearest);
            t = max(fma(-alpha, t, t), 1e-20);
            near_rest &= near_rest - 1u;
        }
    }
}

void main() {
    if (!find_tile(camera_tiles + group(), tiles)) return;
    uint begin = tile_start[tile], end = tile_start[tile + 1u], next = begin + window; /* near window */
    float nearest = facts[view].nearest;
    bool dark = false;
    vec2 at = centre();
    t = 1;
    met = 0;
    if (lane() == 0u) lit = 0u;
    if (begin < end) load_near(begin, end);
    for (uint from = begin, step = 1u; from < end; from += at_once, step++) {
        uint loaded = (from - begin) % window, entries = min(at_once, end - from), sampled = 0u;
        barrier();
        if (loaded == 0u) {
            if (lane() < window) {
                masks[lane()] = 0u;
                if (from + lane() < end) {
                    pair entry = tile_list[from + lane()];
                    load(lane(), entry.first, entry.second);
                    depths_of[lane()] = depth[base + entry.first];
                    bool once = of_gaussian[base + entry.first].second == 1u;
                    alone[lane()] = views[view].of.w == 0 && cue == 0u && once ? 1u : 0u;
                }
            }
            find_covered(0u);
        }
        for (uint i = 0u; i < entries; i++)
            if (!dark || alone[loaded + i] == 0u) sampled |= 1u << i;
        uint word = loaded >> 5u, shift = loaded & 31u,
            rest = covered[words * micro() + word] >> shift & sampled;
        float last = depths_of[loaded + entries - 1u] - bias;
        bool more = true;
        while (more) {
            float within = depths_of[2u * window - 1u]; /* what is nearer is in the window */
            more = !dark && within < last;
            bool goes_on = rest != 0u;
            while (goes_on) {
                uint i = uint(findLSB(rest));
                float distance = depths_of[loaded + i];
                goes_on = !more || distance - bias <= within;
                if (goes_on) {
                    if (!dark) apply(distance - bias, nearest, at);
                    float rho = weight_of(splats[loaded + i], spreads[loaded + i], at);
                    part[0][i][lane()] = rho * t;
                    part[1][i][lane()] = rho;
                    if (cue != 0u)
                        part[2][i][lane()] = rho * ((distance - nearest) - (distance - nearest) * t - met);
                    rest &= rest - 1u;
                    goes_on = rest != 0u;
                }
            }
            if (more) {
                apply(last, nearest, at);
                load_near(next, end);
                next += window;
            }
        }
        if (!dark) dark = is_dark(t, step);
        uint own = lane() >> 5u;
        if (sampled != 0u)
            add_up(cue != 0u ? 3u : 2u, (sampled >> own & 1u) != 0u ? masks[loaded + own] : 0u);
        if (lane() < entries) {
            vec4 sum = vec4(0, 1, 0, 0);
            if ((sampled >> lane() & 1u) != 0u)
                sum = vec4(added(0u, lane()), added(1u, lane()), cue != 0u ? added(2u, lane()) : 0, 0);
            tile_sums[from + lane()] = sum;
        }
    }
}
