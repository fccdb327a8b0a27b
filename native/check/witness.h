// SPDX-License-Identifier: GPL-3.0-or-later
/// The one piece of arithmetic that the certificate rests on. It computes upper bounds on the distances of four points
/// from one triangle, each by an explicit witness in that triangle.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// Four points. Each array holds one of their coordinates.
struct alignas(32) FourPoints {
  double x[4], y[4], z[4];

  /// Writes in the same halves in which witness_distances() reads, because a processor forwards only a whole store.
  void set(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
    using Half = double __attribute__((vector_size(16)));
    const Half halves[6] = {{a.x, b.x}, {c.x, d.x}, {a.y, b.y}, {c.y, d.y}, {a.z, b.z}, {c.z, d.z}};
    __builtin_memcpy(x, &halves[0], sizeof x);
    __builtin_memcpy(y, &halves[2], sizeof y);
    __builtin_memcpy(z, &halves[4], sizeof z);
  }
};

/// A triangle prepared for witness_distances(). A degenerate triangle counts as the segment or point that it is.
struct WitnessTriangle {
  WitnessTriangle() = default;
  WitnessTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

  glm::dvec3 a{0}, ab{0}, ac{0};
  glm::dvec3 gs{0}, gt{0};  ///< are the gradients of the barycentric coordinates of b and c
  double inverse_ab = 0, inverse_ac = 0, inverse_bc = 0;
};

/// The triangles of a mesh as witnesses. Each is prepared when it is asked for, which takes about 10 ns. Kept, they
/// would be 144 bytes a triangle, nearly as much as all else that a volume holds of its reference.
class Witnesses {
 public:
  /// Keeps a reference to `mesh`.
  explicit Witnesses(const TriangleMesh& mesh) : mesh_(&mesh) {}
  explicit Witnesses(const TriangleMesh&&) = delete;
  std::size_t size() const { return mesh_->triangles.size(); }
  WitnessTriangle operator[](std::size_t triangle) const {
    const glm::uvec3& t = mesh_->triangles[triangle];
    return {mesh_->vertices[t.x], mesh_->vertices[t.y], mesh_->vertices[t.z]};
  }

  /// The corners, with the rounding of the edges that start in the first one. A closest point needs no more.
  std::array<glm::dvec3, 3> corners(std::size_t triangle) const {
    const glm::uvec3& t = mesh_->triangles[triangle];
    const glm::dvec3& a = mesh_->vertices[t.x];
    return {a, a + (mesh_->vertices[t.y] - a), a + (mesh_->vertices[t.z] - a)};
  }

 private:
  const TriangleMesh* mesh_;
};

/// Computes the squared distances of the points from witnesses in the triangle, out[i] = |p_i - q_i|^2 in floating
/// point. Any clamped parameters give a valid upper bound, so that a poor parameter, as of a needle, costs completeness
/// and never soundness. Both instruction paths give the same bits. A call costs about 20 ns.
void witness_distances(const WitnessTriangle& triangle, const FourPoints& points, double out[4]);

/// Bounds the rounding. If the floating-point result is d^2, the exact distance of p from the exact triangle with the
/// given corners is at most d + witness_error(R + d), where R is the largest coordinate magnitude of a corner.
///
/// This is the derivation, with u = 2^-53 and M = R + |p|, per coordinate. p - a is off by u M, and ab and ac by u 2R
/// each. Their products with s and t round once more, and s + t <= 1 in floating point means at most 1 + u in real
/// arithmetic; with s, t >= 0 these are together u 6R. The two subtractions round results of at most M + 2R each. The
/// edge bc, whose witness is b + w bc, needs one more subtraction. All this is below u (4 M + 14 R). An accepted |p| is
/// at most sqrt(3) R + d, so that M <= 2.74 R + d and the sum is below 25 u (R + d). The length over three coordinates
/// is sqrt(3) times as much. The sum of three squares has a relative error of at most 4u and the squared threshold of
/// 2u, which moves d by 3u d. 25 sqrt(3) + 3 < 47. Cutting up pieces (part.h) adds 64 * 5.2 < 333. 512 is a power of
/// two.
inline double witness_error(double magnitude) { return 512 * kUnitRoundoff * magnitude; }

}  // namespace tolvol
