/* What all programs begin with. A group is 256 threads, or a tile's pixels. group() counts through groups,
   where they are more than a dimension can have, too. No loop in these files is left by return: NVIDIA's
   driver 580 takes its step even so. */

layout(local_size_x = 256) in;
uint lane() { return gl_LocalInvocationIndex; }
uint group() { return gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x; }
uint item() { return group() * 256u + lane(); }
/* By the bits: compilers may take NaN for impossible. */
bool is_number(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) <= 0x7F800000u; }
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) < 0x7F800000u; }
bool is_finite(vec3 x) { return is_finite(x.x) && is_finite(x.y) && is_finite(x.z); }

/* What views, records and lists are, as in ssdgs.h. */
struct fact { uint visible, instances; float nearest; };
struct splat { float x, y, ux, uy, wy, log2_opacity, extent_x, extent_y; };
struct pair { uint first, second; }; /* instance: place, mask; of a Gaussian: first, count; entry: Gaussian, mask */
const float log2e = 1.44269504088896341;
const uint none = 0xFFFFFFFFu;
/* Instances that there is room for; none where they are too many to count, which is the limit. */
uint listed(uint instances, uint room) { return instances > 0x7FFFFFFFu ? 0u : min(instances, room); }
const uint is_seen = 1u; /* a Gaussian, as WALK of the camera finds */
const uint is_skipped = 2u;
