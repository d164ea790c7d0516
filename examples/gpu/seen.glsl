/* What seen_list and seen_copy share. Reads what the walk has found of each Gaussian, which it has counted
   256 at a time. */

layout(std140, binding = 0) uniform parameters { uint count; uint layer_count; };
layout(std430, binding = 0) buffer seen_block { uint seen[]; };
layout(std430, binding = 1) buffer tally_block { uvec2 tally[]; }; /* seen; the first skipped */
layout(std430, binding = 2) buffer shaded_block { uint shaded_count; uint shaded[]; };
