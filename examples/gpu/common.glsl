/* What every program begins with. A group has 256 threads, for as many items or for the pixels of a 16x16
   tile. Groups may lie in two dimensions, as one holds only 65535; group() counts through both. No loop
   in these files returns: NVIDIA's driver 580 would still take the loop's step. */

layout(local_size_x = 256) in;
uint lane() { return gl_LocalInvocationIndex; }
uint group() { return gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x; }
uint item() { return group() * 256u + lane(); }
/* By the bits: compilers may take NaN for impossible. */
bool is_number(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) <= 0x7F800000u; }
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) < 0x7F800000u; }
bool is_finite(vec3 x) { return is_finite(x.x) && is_finite(x.y) && is_finite(x.z); }

/* Views, records and lists, as in ssdgs.h. */
struct fact { uint visible, instances; float nearest; };
struct splat { float x, y, ux, uy, wy, log2_opacity, extent_x, extent_y; };
/* An instance's place and mask; a Gaussian's first instance and how many; an entry's Gaussian and mask. */
struct pair { uint first, second; };
const float log2e = 1.44269504088896341;
const uint none = 0xFFFFFFFFu;
/* How many instances there is room for. Too many to count are over the limit of any list: 0. */
uint listed(uint instances, uint room) { return instances > 0x7FFFFFFFu ? 0u : min(instances, room); }
const uint is_seen = 1u; /* a Gaussian, as WALK of the camera finds */
const uint is_skipped = 2u;
