// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/scatter_triangle.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tolvol {
namespace {

// float32 rounds a distance by less than this share of it.
constexpr double kSlack = 1e-5;
// A needle whose height float32 cannot hold is left to its edges, because their distances are never too small.
constexpr double kThinnestSine = 1e-4;

float safe_inverse(double x) { return x > 0 ? static_cast<float>(std::min(1 / x, 1e30)) : 0.0f; }

}  // namespace

ScatterTriangle::ScatterTriangle(const TriangleMesh& mesh, std::uint32_t id, double band)
    : a(mesh.vertices[mesh.triangles[id].x]) {
  const glm::dvec3 &b = mesh.vertices[mesh.triangles[id].y], &c = mesh.vertices[mesh.triangles[id].z];
  box.add(a), box.add(b), box.add(c);
  const glm::dvec3 centre = (box.lower + box.upper) * 0.5;
  const double reach = std::max({glm::length(a - centre), glm::length(b - centre), glm::length(c - centre)});
  middle = centre - a;
  radius = static_cast<float>(reach + kSlack * (band + reach));
  const glm::dvec3 to_b = b - a, to_c = c - a, from_b_to_c = c - b, n = glm::cross(to_b, to_c);
  const double nn = glm::dot(n, n), ab2 = glm::dot(to_b, to_b), ac2 = glm::dot(to_c, to_c);
  corner = {glm::dvec3(0), to_b, to_c};
  ab = to_b, ac = to_c, bc = from_b_to_c;
  inverse_ab = safe_inverse(ab2), inverse_ac = safe_inverse(ac2);
  inverse_bc = safe_inverse(glm::dot(from_b_to_c, from_b_to_c));
  if (nn > kThinnestSine * kThinnestSine * ab2 * ac2 && nn > 0) {
    gs = glm::cross(to_c, n) / nn, gt = glm::cross(n, to_b) / nn, normal = n / std::sqrt(nn);
    slab = static_cast<float>(band * kBeyond);
  } else {
    gs = gt = glm::vec3(std::numeric_limits<float>::quiet_NaN());
    normal = glm::vec3(0);  // no foot of a perpendicular is then inside
    slab = std::numeric_limits<float>::infinity();
  }
}

}  // namespace tolvol
