/* Interface and implementation as C++11. */
#define SSDGS_IMPLEMENTATION
#include "compile_c.c"
