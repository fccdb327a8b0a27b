// SPDX-License-Identifier: GPL-3.0-or-later
/// The choice of instructions for the few hot kernels. Each kernel is one always-inlined body in GCC vector types,
/// which is instantiated once for any 64-bit machine and once for AVX2. Without fused multiply-adds both give the same
/// bits, so that the choice changes the speed alone.
#pragma once

#include <atomic>

namespace tolvol {

enum class Simd { portable, avx2 };

#if defined(__x86_64__)
#define TOLVOL_HAS_AVX2 1
#define TOLVOL_TARGET_AVX2 __attribute__((target("avx2")))
#else
#define TOLVOL_HAS_AVX2 0
#define TOLVOL_TARGET_AVX2
#endif
#define TOLVOL_INLINE inline __attribute__((always_inline))

inline Simd best_simd() {
#if TOLVOL_HAS_AVX2
  if (__builtin_cpu_supports("avx2")) return Simd::avx2;
#endif
  return Simd::portable;
}

/// The path that the whole process uses. Only tests set it, to force each path.
inline std::atomic<Simd>& simd_path() {
  static std::atomic<Simd> path{best_simd()};
  return path;
}

}  // namespace tolvol
