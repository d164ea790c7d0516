/* SORT, second half of a pass. Reads keys, values and the counts of all blocks. Writes keys and values in
   the order of their digits. A digit begins after all smaller ones, and after its like in the blocks
   before. A block goes row by row. For each 32 keys of a row a digit has a word of bits: a key's place
   among its like is the number of bits before its own. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "sort.glsl"
#include "scan.glsl"

layout(std430, binding = 4) readonly buffer digits { uint counted[]; };
layout(std430, binding = 5) readonly buffer values { uint value[]; };
layout(std430, binding = 6) writeonly buffer keys_out { uint key_out[]; };
layout(std430, binding = 7) writeonly buffer values_out { uint value_out[]; };
shared uint bits[8 * 256];
shared uint next[256];
void main() {
    if (is_idle()) return;
    uint before = 0u, like = 0u, all, first = segment() * sort_blocks(), from = segment() * keys;
    for (uint other = 0u; other < sort_blocks(); other += 8u) {
        uint here[8]; /* loads that do not wait for one another */
        for (uint i = 0u; i < 8u; i++)
            here[i] = counted[256u * (first + min(other + i, sort_blocks() - 1u)) + lane()];
        for (uint i = 0u; i < 8u; i++) {
            before += other + i < block() ? here[i] : 0u;
            like += other + i < sort_blocks() ? here[i] : 0u;
        }
    }
    next[lane()] = before + scan(like, all);
    for (uint word = 0u; word < 8u; word++) bits[word * 256u + lane()] = 0u;
    for (uint row = 0u; row < rows; row++) {
        bool there = at(row) < all_keys();
        uint own = there ? digit(at(row)) : 0u, bit = lane() & 31u;
        barrier();
        if (there) atomicOr(bits[(lane() >> 5u) * 256u + own], 1u << bit);
        barrier();
        if (there) {
            uint place = next[own] + uint(bitCount(bits[(lane() >> 5u) * 256u + own] & ((1u << bit) - 1u)));
            for (uint word = 0u; word < lane() >> 5u; word++)
                place += uint(bitCount(bits[word * 256u + own]));
            key_out[from + place] = key[from + at(row)];
            value_out[from + place] = shift == 0u ? at(row) : value[from + at(row)];
        }
        barrier();
        for (uint word = 0u; word < 8u; word++) {
            next[lane()] += uint(bitCount(bits[word * 256u + lane()]));
            bits[word * 256u + lane()] = 0u;
        }
    }
}
