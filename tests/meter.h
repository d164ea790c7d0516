/* Memory that counts and fails on demand, and what the examples read and write files with, on it. */
#ifndef SSDGS_METER_H
#define SSDGS_METER_H

static long live, calls, fail_at; /* blocks; allocations so far; the one to refuse, 0 = none */

static void *meter_resize(void *old, size_t size) {
    if (++calls == fail_at) return NULL;
    void *memory = realloc(old, size);
    if (memory && !old) live++;
    return memory;
}

static void *meter_clear(size_t count, size_t size) {
    void *memory = meter_resize(NULL, count * size + 1);
    if (memory) memset(memory, 0, count * size);
    return memory;
}

static void meter_free(void *memory) {
    if (memory) live--;
    free(memory);
}

#define malloc(size) meter_resize(NULL, size)
#define realloc(memory, size) meter_resize(memory, size)
#define calloc(count, size) meter_clear(count, size)
#define free(memory) meter_free(memory)
#include "../examples/olat.h"
#include "../examples/flip.h"
#undef malloc
#undef realloc
#undef calloc
#undef free

#endif
