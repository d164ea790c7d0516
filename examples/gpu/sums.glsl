/* Sums over the pixels of a tile, of 8 entries at once, up to three values each. Only the micro-tiles of
   an entry count. 32 threads do an entry: each sums its pixel of every other micro-tile; then four do a
   value. */

const uint at_once = 8u;
shared float part[3][8][256];
void add_up(uint values, uint mask) { /* mask: entry lane() / 32's */
    uint entry = lane() >> 5u, first = lane() & 31u, which = first >> 2u;
    uint rest = mask & (first < 16u ? 0x5555u : 0xAAAAu);
    vec3 sum = vec3(0);
    barrier();
    while (rest != 0u) {
        uint pixel = 16u * take(rest, 0u) + (first & 15u);
        sum.x += part[0][entry][pixel];
        if (values > 1u) sum.y += part[1][entry][pixel];
        if (values > 2u) sum.z += part[2][entry][pixel];
    }
    part[0][entry][first] = sum.x; /* which no other thread of the entry reads before the barrier */
    if (values > 1u) part[1][entry][first] = sum.y;
    if (values > 2u) part[2][entry][first] = sum.z;
    barrier();
    if (which < values) {
        float quarter = 0;
        for (uint i = first & 3u; i < 32u; i += 4u) quarter += part[which][entry][i];
        part[which][entry][first & 3u] = quarter;
    }
    barrier();
}
/* After add_up(). */
float added(uint which, uint entry) {
    return (part[which][entry][0] + part[which][entry][1]) + (part[which][entry][2] + part[which][entry][3]);
}
