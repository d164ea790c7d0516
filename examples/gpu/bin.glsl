/* BIN lists the instances of one Gaussian after the other, in depth order, and sorts them by tiles. So a
   tile's list stays in depth order. Shared by its programs. */

layout(std140, binding = 0) uniform parameters {
    uint count, view, tiles_x, tiles_y, room;
    float log2_threshold;
};
layout(std430, binding = 0) buffer facts_ { fact facts[]; };
