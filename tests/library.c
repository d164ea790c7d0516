/* The library, of which the Makefile makes two objects: kernels.o and, with all else, ssdgs.o. */
#include <assert.h>
#define SSDGS_ASSERT assert
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
