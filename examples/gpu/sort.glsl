/* SORT: a radix sort by 8 bits at a time, the lowest first. A group has a block of keys, some rows of 256.
   Reads keys and how many there are. In the first pass their values are 0, 1, 2 .. Depths are keys by
   their bits: those drawn are not negative, so the order is the same, and what is not drawn, -1, comes
   last. */

layout(std140, binding = 0) uniform parameters { uint room, shift, blocks, rows, view, instances; };
layout(std430, binding = 0) buffer facts_ { fact facts[]; };
layout(std430, binding = 1) readonly buffer keys { uint key[]; };
uint count() { return instances != 0u ? listed(facts[view].instances, room) : room; }
uint at(uint row) { return (group() * rows + row) * 256u + lane(); }
uint digit(uint which) { return key[which] >> shift & 255u; }
