/* BIN: instances rank by rank, then sorted by their tiles, so lists stay in depth order. */

layout(std140, binding = 0) uniform parameters {
    uint count, view, tiles_x, tiles_y, room;
    float log2_threshold;
};
layout(std430, binding = 0) buffer facts_ { fact facts[]; };
