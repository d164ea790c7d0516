/* Kernels take long to compile: the Makefile does so once, in build/kernels.o, and makes this file what
   ssdgs.h includes for each instruction set (SSDGS_SELF). In that object each table gets a pointer; elsewhere
   there is the pointer alone, and the scalar kernels, of which some are called by name. A test that is
   compiled by hand has kernels of its own, and does without this file. */
#ifdef TEST_KERNELS
#define KERNELS(isa) \
    extern const ssdgs__kernels *const test_kernels_##isa; \
    const ssdgs__kernels *const test_kernels_##isa = &ssdgs__kernels_##isa;
#else
#define KERNELS(isa) extern const ssdgs__kernels *const test_kernels_##isa;
#endif

#ifndef TEST_HAS_KERNELS /* t_accuracy: they are there already, with functions of its own */
#if defined(TEST_KERNELS) || SSDGS__ISA == SSDGS__ISA_SCALAR
#define ssdgs__kernels SSDGS__UNUSED ssdgs__kernels /* the table's own name */
#include "../ssdgs.h"
#undef ssdgs__kernels
#elif SSDGS__ISA == SSDGS__ISA_SSE2
#define ssdgs__srgb_encode_sse2 test_kernels_sse2->srgb_encode
#elif SSDGS__ISA == SSDGS__ISA_NEON
#define ssdgs__srgb_encode_neon test_kernels_neon->srgb_encode
#elif SSDGS__ISA == SSDGS__ISA_WASM
#define ssdgs__srgb_encode_wasm test_kernels_wasm->srgb_encode
#endif
#endif

#if SSDGS__ISA == SSDGS__ISA_SCALAR && SSDGS__SCALAR
KERNELS(scalar)
#define ssdgs__kernels_scalar (*test_kernels_scalar)
#elif SSDGS__ISA == SSDGS__ISA_SSE2
KERNELS(sse2)
#define ssdgs__kernels_sse2 (*test_kernels_sse2)
#elif SSDGS__ISA == SSDGS__ISA_AVX2
KERNELS(avx2)
#define ssdgs__kernels_avx2 (*test_kernels_avx2)
#elif SSDGS__ISA == SSDGS__ISA_AVX512
KERNELS(avx512)
#define ssdgs__kernels_avx512 (*test_kernels_avx512)
#elif SSDGS__ISA == SSDGS__ISA_NEON
KERNELS(neon)
#define ssdgs__kernels_neon (*test_kernels_neon)
#elif SSDGS__ISA == SSDGS__ISA_WASM
KERNELS(wasm)
#define ssdgs__kernels_wasm (*test_kernels_wasm)
#endif
#undef KERNELS
