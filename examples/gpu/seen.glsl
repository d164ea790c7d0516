/* Shared by the programs of what is seen: what gather_camera.comp leaves, and the list made of it. Each
   object's part of the list begins at a multiple of 64; what fills it up is `none`. */

layout(std430, binding = 3) buffer seens { uint seen[]; };
layout(std430, binding = 4) buffer tallies { uvec2 tally[]; }; /* of 64: seen; the first skipped */
/* How many are listed; the first skipped, where that is the only one. */
layout(std430, binding = 5) buffer of_objects { uvec2 of_object[]; };
layout(std430, binding = 6) buffer shadeds { uint shaded_count; uint shaded[]; }; /* with what fills up */
layout(std430, binding = 7) buffer neighbour_block { uint neighbours[]; };
layout(std430, binding = 9) buffer aheads { uint ahead_of[]; }; /* of 64: the object's listed before them */
