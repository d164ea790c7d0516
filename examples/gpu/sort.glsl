/* SORT: a radix sort by 8 bits at a time, the lowest first. A group has a block of keys, some rows of
   256. Segments of as many keys are sorted each by itself; with 0 segments there is one, of all
   instances. Reads keys and how many there are. In the first pass their values are 0, 1, 2 .. Depths are
   keys by their bits: those drawn are not negative, so the order is the same, and what is not drawn, -1,
   comes last. */

layout(std430, binding = 3) readonly buffer keys_ { uint key[]; };
uint sort_blocks() { return (keys + 256u * rows - 1u) / (256u * rows); }
uint segment() { return group() / sort_blocks(); }
uint block() { return group() % sort_blocks(); }
uint all_keys() { return segments > 0u ? keys : listed(facts[total].instances, keys); }
uint at(uint row) { return (block() * rows + row) * 256u + lane(); }
uint digit(uint which) { return key[segment() * keys + which] >> shift & 255u; }
bool is_idle() { return segment() >= max(segments, 1u); }
