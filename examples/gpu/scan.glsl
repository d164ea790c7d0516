/* The sum of the values of the threads before this one; `total` is the sum of all. The whole group must
   call it. */

shared uint scanned[256];
shared uint scanned_16[16]; /* of 16 threads */
uint scan(uint value, out uint total) {
    uint before = 0u, own = lane() & ~15u;
    barrier();
    scanned[lane()] = value;
    barrier();
    if (lane() < 16u) {
        uint sum = 0u;
        for (uint i = 0u; i < 16u; i++) sum += scanned[16u * lane() + i];
        scanned_16[lane()] = sum;
    }
    barrier();
    total = 0u;
    for (uint i = 0u; i < 16u; i++) {
        if (16u * i < own) before += scanned_16[i];
        total += scanned_16[i];
        if (own + i < lane()) before += scanned[own + i];
    }
    return before;
}
