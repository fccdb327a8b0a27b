// SPDX-License-Identifier: GPL-3.0-or-later
// This finds closest points without branches after C. Ericson, Real-Time Collision Detection, 2005, §5.1, in four lanes
// of double. It tries the nearest points of the three edges and, if it falls inside, the foot of the perpendicular as a
// barycentric combination. Each is built as a point and measured as a distance between points, never from a plane.
#include "check/witness.h"

#include <cstdint>

#include "base/simd.h"

namespace tolvol {
namespace {

using Lanes = double __attribute__((vector_size(32)));
using LaneMasks = std::int64_t __attribute__((vector_size(32)));

/// Returns 0 if there is no finite inverse. A parameter of 0 still gives a point of the triangle.
double inverse_or_zero(double x) {
  const double inverse = 1 / x;
  return x > 0 && inverse < 1e300 ? inverse : 0;
}

TOLVOL_INLINE Lanes clamp01(Lanes x) {
  const Lanes zero{}, one = zero + 1.0;
  x = x > zero ? x : zero;  // NaN becomes 0
  return x < one ? x : one;
}

TOLVOL_INLINE Lanes load(const double (&lanes)[4]) {
  using Half = double __attribute__((vector_size(16)));
  Half low, high;
  __builtin_memcpy(&low, lanes, sizeof low);
  __builtin_memcpy(&high, lanes + 2, sizeof high);
  return __builtin_shufflevector(low, high, 0, 1, 2, 3);
}

TOLVOL_INLINE Lanes squared(Lanes x, Lanes y, Lanes z) { return x * x + y * y + z * z; }

/// Returns the squared distances from the edge o + w e, 0 <= w <= 1, of points that are relative to o.
TOLVOL_INLINE Lanes edge(Lanes x, Lanes y, Lanes z, const glm::dvec3& e, double inverse) {
  const Lanes w = clamp01((x * e.x + y * e.y + z * e.z) * inverse);
  return squared(x - w * e.x, y - w * e.y, z - w * e.z);
}

TOLVOL_INLINE void distances(const WitnessTriangle& t, const FourPoints& p, double out[4]) {
  const Lanes px = load(p.x), py = load(p.y), pz = load(p.z);
  const Lanes x = px - t.a.x, y = py - t.a.y, z = pz - t.a.z;

  Lanes best = edge(x, y, z, t.ab, t.inverse_ab);
  const Lanes other = edge(x, y, z, t.ac, t.inverse_ac);
  best = best < other ? best : other;
  const Lanes third = edge(x - t.ab.x, y - t.ab.y, z - t.ab.z, t.ac - t.ab, t.inverse_bc);
  best = best < third ? best : third;

  const Lanes s = x * t.gs.x + y * t.gs.y + z * t.gs.z, u = x * t.gt.x + y * t.gt.y + z * t.gt.z;
  const Lanes foot = squared(x - s * t.ab.x - u * t.ac.x, y - s * t.ab.y - u * t.ac.y, z - s * t.ab.z - u * t.ac.z);
  const LaneMasks usable = (s >= 0.0) & (u >= 0.0) & (s + u <= 1.0) & (foot < best);
  best = usable ? foot : best;
  __builtin_memcpy(out, &best, sizeof best);
}

void distances_portable(const WitnessTriangle& t, const FourPoints& p, double out[4]) { distances(t, p, out); }
TOLVOL_TARGET_AVX2 void distances_avx2(const WitnessTriangle& t, const FourPoints& p, double out[4]) {
  distances(t, p, out);
}

}  // namespace

WitnessTriangle::WitnessTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c)
    : a(a), ab(b - a), ac(c - a) {
  const glm::dvec3 bc = c - b;
  inverse_ab = inverse_or_zero(glm::dot(ab, ab));
  inverse_ac = inverse_or_zero(glm::dot(ac, ac));
  inverse_bc = inverse_or_zero(glm::dot(bc, bc));
  const glm::dvec3 n = glm::cross(ab, ac);
  const double inverse = inverse_or_zero(glm::dot(n, n));
  gs = glm::cross(ac, n) * inverse;
  gt = glm::cross(n, ab) * inverse;
}

void witness_distances(const WitnessTriangle& triangle, const FourPoints& points, double out[4]) {
  if (simd_path().load(std::memory_order_relaxed) == Simd::avx2) {
    distances_avx2(triangle, points, out);
  } else {
    distances_portable(triangle, points, out);
  }
}

}  // namespace tolvol
