/* BIN sums, in one group. Reads how many instances each 256 Gaussians of a view have. Writes where they
   begin, and how many there are of each view and of all. */
#version 430
#include "common.glsl"
#include "frame.glsl"
#include "scan.glsl"

layout(std430, binding = 6) buffer groups_ { uint before[]; };
shared uint starts[256]; /* of each slot */
uint in_256s(uint x) { return (x >> 8u) + 1u; } /* sums of these fit 32 bits where sums of x may not */
void main() {
    if (group() > 0u) return;
    uint groups = groups_of(count), items = groups * slots, each = (items + 255u) / 256u, sum = 0u, all, most;
    uint first = min(lane() * each, items), end = min(first + each, items);
    for (uint i = first; i < end; i++) sum += min(before[i], 0x7FFFFFFFu - min(sum, 0x7FFFFFFFu));
    scan(in_256s(sum), most); /* the total alone */
    uint at = scan(sum, all);
    if (most > 7812500u) all = none; /* 2e9 */
    for (uint i = first; i < end; i++) {
        uint own = before[i];
        before[i] = at;
        if (i % groups == 0u) starts[i / groups] = at;
        at += own;
    }
    barrier();
    for (uint slot = lane(); slot < slots; slot += 256u) {
        uint next = slot + 1u < slots ? starts[slot + 1u] : all;
        facts[view_at_work[slot]].instances = all == none ? none : next - starts[slot];
    }
    if (lane() == 0u) facts[total].instances = all;
}
