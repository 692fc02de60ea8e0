// Build-wide switches of the native core.
//
// Every header that is compiled once per instruction set opens its code with
// DRIFTWALK_LANES_BEGIN and closes it with DRIFTWALK_LANES_END. Each instruction set then has an
// inline namespace of its own, so the linker can never take an AVX-512 copy of an inline function
// for a processor without it. For the same reason these headers use no std:: containers.
//
// A .cpp file keeps its own names in an anonymous namespace: of an `inline` one that two files
// define the linker keeps either. .ci/one-definition finds both mistakes.
#pragma once

#ifndef DRIFTWALK_ISA
#define DRIFTWALK_ISA baseline
#endif

#define DRIFTWALK_LANES_BEGIN                                                                      \
  namespace driftwalk {                                                                            \
  inline namespace DRIFTWALK_ISA {
#define DRIFTWALK_LANES_END                                                                        \
  }                                                                                                \
  }

// DRIFTWALK_PER_ISA(simulate_kernel_) is simulate_kernel_avx2 in the AVX2 build of a file.
#define DRIFTWALK_JOIN_(a, b) a##b
#define DRIFTWALK_JOIN(a, b) DRIFTWALK_JOIN_(a, b)
#define DRIFTWALK_PER_ISA(name) DRIFTWALK_JOIN(name, DRIFTWALK_ISA)

// Host and device: empty for C++, both qualifiers under CUDA.
#if defined(__CUDACC__)
#define DRIFTWALK_HD __host__ __device__
#else
#define DRIFTWALK_HD
#endif
