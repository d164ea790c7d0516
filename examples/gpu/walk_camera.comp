/* WALK of the camera. Reads the tiles' lists. Writes of each entry which micro-tiles blend it, and
   whether it must be shaded. A pixel passes over small weights as long as their sum stays within
   max_error, so what no pixel needs adds up to no more than that. What is heavy in some pixel is shaded
   in any case and takes nothing of that sum, so a round before finds it. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "walk.glsl"
const uint window = 256u, windows = 1u;
#include "window.glsl"
#include "fours.glsl"
#include "hides.glsl"

layout(std430, binding = 7) writeonly buffer seens { uint tile_seen[]; };
layout(std430, binding = 8) writeonly buffer neededs { uint tile_needed[]; };
shared uint blends[16 * 8]; /* as `covered` */
shared uint heavy[8];
shared uint must[8];
float t, over;
uint blended, marked; /* bits of 32 entries */
float slight;
uint strong;
/* Marked is what weighs more than `slight`, and beyond max_error what is not in `strong`. */
void meet(float weight, uint i) {
    bool drawn = weight > 0 && t >= stop && is_open(i);
    float alpha = drawn ? alpha_of(weight) : 0, w = alpha * t;
    uint own = drawn ? 1u << (i & 31u) : 0u, passed_over = own & ~strong;
    t = fma(-alpha, t, t);
    over += passed_over != 0u ? w : 0;
    blended |= own;
    marked |= w > slight ? own : over > max_error ? passed_over : 0u;
}
void main() {
    if (!find_tile(group(), camera_tiles)) return;
    uint begin = tile_start[tile], end = tile_start[tile + 1u], step = 0u;
    bool dark = false;
    vec2 at = centre();
    t = inside() ? 1 : -1;
    over = 0;
    find_behind();
    if (lane() == 0u) lit = 0u;
    uint from = begin;
    for (; from < end && !dark; from += window) {
        uint entries = min(window, end - from);
        barrier();
        if (lane() < 16u * words) blends[lane()] = 0u;
        if (lane() < words) heavy[lane()] = must[lane()] = 0u;
        if (lane() < entries) load(lane(), tile_list[from + lane()].first, tile_list[from + lane()].second);
        else masks[lane()] = 0u;
        if (lane() < entries) load_front(lane(), tile_list[from + lane()].first);
        find_covered(0u);
        float before = t;
        for (uint round = 1u - thrifty; round < 2u; round++) {
            t = before;
            for (uint word = 0u; word < words && t >= stop; word++) {
                uint rest = covered[words * micro() + word];
                strong = round == 0u || thrifty == 0u ? ~0u : heavy[word];
                slight = round == 0u ? max_error * 0.03125 : 1e30;
                blended = marked = 0u;
                while (rest != 0u && t >= stop) meet_four(rest, word, at);
                if (round == 1u && blended != 0u) atomicOr(blends[words * micro() + word], blended);
                if (round == 0u && marked != 0u) atomicOr(heavy[word], marked);
                if (round == 1u && marked != 0u) atomicOr(must[word], marked);
            }
            barrier();
        }
        if (lane() < entries) {
            uint word = lane() >> 5u, place = lane() & 31u, mask = 0u;
            for (uint m = 0u; m < 16u; m++) mask |= (blends[words * m + word] >> place & 1u) << m;
            tile_seen[from + lane()] = mask;
            if (thrifty != 0u) tile_needed[from + lane()] = (heavy[word] | must[word]) >> place & 1u;
        }
        dark = is_dark(t, ++step);
    }
    for (uint i = from + lane(); i < end; i += 256u) {
        tile_seen[i] = 0u;
        if (thrifty != 0u) tile_needed[i] = 0u;
    }
}
