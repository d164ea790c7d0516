/* What views, records and lists are, as in ssdgs.h. */

struct fact { uint visible, instances; float nearest; };
struct splat { float x, y, ux, uy, wy, log2_opacity, extent_x, extent_y; };
struct pair { uint first, second; }; /* instance: place, mask; of a Gaussian: first, count; entry: Gaussian, mask */
const float log2e = 1.44269504088896341;
const uint none = 0xFFFFFFFFu;
/* Instances that there is room for; none where they are too many to count, which is the limit. */
uint listed(uint instances, uint room) { return instances > 0x7FFFFFFFu ? 0u : min(instances, room); }
