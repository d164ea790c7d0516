/* Shared by seen_list.comp and seen_copy.comp: what gather_camera.comp leaves, and the list made of it. */

layout(std140, binding = 0) uniform parameters { uint count; uint layer_count; };
layout(std430, binding = 0) buffer seen_block { uint seen[]; };
layout(std430, binding = 1) buffer tally_block { uvec2 tally[]; }; /* seen; the first skipped */
layout(std430, binding = 2) buffer shaded_block { uint shaded_count; uint shaded[]; };
