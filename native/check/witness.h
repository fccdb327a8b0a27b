// SPDX-License-Identifier: GPL-3.0-or-later
/// The one piece of arithmetic that the certificate rests on: upper bounds on the distances of four points to one
/// triangle, each from an explicit witness in that triangle.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// Four points, a coordinate a row.
struct alignas(32) FourPoints {
  double x[4], y[4], z[4];

  /// Written in the same halves in which witness_distances() reads: a processor forwards a store to a load only whole.
  void set(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    using Half = double __attribute__((vector_size(16)));
    const Half halves[6] = {{a.x, b.x}, {c.x, d.x}, {a.y, b.y}, {c.y, d.y}, {a.z, b.z}, {c.z, d.z}};
    __builtin_memcpy(x, &halves[0], sizeof x);
    __builtin_memcpy(y, &halves[2], sizeof y);
    __builtin_memcpy(z, &halves[4], sizeof z);
  }
};

/// A triangle prepared for witness_distances(); degenerate ones are the segments or points they are.
struct WitnessTriangle {
  WitnessTriangle() = default;
  WitnessTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

  glm::dvec3 a{0}, ab{0}, ac{0};
  glm::dvec3 gs{0}, gt{0};  ///< gradients of the barycentric coordinates of b and c
  double inverse_ab = 0, inverse_ac = 0, inverse_bc = 0;
};

/// All triangles of a mesh, prepared. O(m).
std::vector<WitnessTriangle> prepare_witnesses(const TriangleMesh& mesh);

/// Squared distances from the points to witnesses in the triangle: out[i] = |p_i - q_i|^2 in floating point. Any
/// clamped parameters give a valid upper bound, so a poor parameter (a needle's) costs completeness and never
/// soundness. Both instruction paths give the same bits. About 20 ns.
void witness_distances(const WitnessTriangle& triangle, const FourPoints& points, double out[4]);

/// What rounding may hide. If the floating-point result is d^2, the exact distance of p to the exact triangle with the
/// given corners is at most d + witness_error(R + d), R the largest coordinate magnitude of a corner.
///
/// Derivation, u = 2^-53, per coordinate, M = R + |p|: p - a is off by u M; ab and ac by u 2R each, their products with
/// s and t round once more, and s + t <= 1 in floating point means at most 1 + u in real arithmetic: with s, t >= 0
/// together u 6R; the two subtractions round results of at most M + 2R each. For the edge bc, whose witness is b + w
/// bc, one subtraction more. Altogether below u (4 M + 14 R). An accepted |p| is at most sqrt(3) R + d, so M <= 2.74 R
/// + d and the sum is below 25 u (R + d); three coordinates: times sqrt(3). The sum of three squares has a relative
/// error of at most 4u and the squared threshold of 2u, which moves d by 3u d. 25 sqrt(3) + 3 < 47. Cutting pieces up
/// (part.h) adds 32 * 5.2 < 167; 256 is a power of two.
inline double witness_error(double magnitude) { return 256 * kUnitRoundoff * magnitude; }

}  // namespace tolvol
