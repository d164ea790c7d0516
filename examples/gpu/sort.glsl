/* SORT: least significant digit first, of 8 bits, some rows of 256 keys a group. Of the first digit the
   values are 0, 1, 2 .. Depths are keys as they are: those drawn are not negative, so their bits are in
   their order, and what is not drawn, -1, comes last. */

layout(std140, binding = 0) uniform parameters { uint room, shift, blocks, rows, view, instances; };
layout(std430, binding = 0) buffer facts_ { fact facts[]; };
layout(std430, binding = 1) readonly buffer keys { uint key[]; };
uint count() { return instances != 0u ? listed(facts[view].instances, room) : room; }
uint at(uint row) { return (group() * rows + row) * 256u + lane(); }
uint digit(uint which) { return key[which] >> shift & 255u; }
