/* The library, of which the Makefile makes two objects: kernels.o and, with all else, ssdgs.o. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
