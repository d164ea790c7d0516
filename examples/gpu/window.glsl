/* A window is some entries of a tile's list in shared memory. Each micro-tile has a bit for each entry
   that touches it, in depth order. The program says before how many entries that is, `window`, and how
   many windows it has, `windows`. */

/* The entry of the lowest bit, which goes; none: there is none. */
uint take(inout uint bits, uint word) {
    uint first = bits == 0u ? none : 32u * word + uint(findLSB(bits));
    bits &= bits - 1u;
    return first;
}
const uint words = window / 32u;
shared vec4 splats[windows * window];
shared vec2 spreads[windows * window];
shared uint masks[windows * window]; /* 0 where there is no entry */
shared uint covered[windows * 16u * words]; /* a bit an entry, of each micro-tile */
void load(uint place, uint gaussian, uint mask) {
    splats[place] = record[2u * (base + gaussian)];
    spreads[place] = record[2u * (base + gaussian) + 1u].xy;
    masks[place] = mask;
}
void find_covered(uint which) {
    uint first = which * window + 32u * (lane() % words), bits = 0u;
    barrier();
    if (lane() < 16u * words) {
        for (uint i = 0u; i < 32u; i++) bits |= (masks[first + i] >> lane() / words & 1u) << i;
        covered[which * 16u * words + lane()] = bits;
    }
    barrier();
}
