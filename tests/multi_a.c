/* One of two translation units: the one with the implementation. */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
