// SPDX-License-Identifier: GPL-3.0-or-later
/// A triangle prepared to have its distance from many nodes of a grid computed in float32, on the CPU or by a shader.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// All its positions but the box are relative to corner a.
struct ScatterTriangle {
  ScatterTriangle(const TriangleMesh& mesh, std::uint32_t id, double band);

  /// Nodes that are left out without a look at each are farther than this many bands.
  static constexpr double kBeyond = 1.001;

  glm::dvec3 a;
  std::array<glm::dvec3, 3> corner;
  Box box;
  glm::vec3 ab, ac, bc;
  glm::vec3 gs, gt;  ///< are the gradients of the barycentric coordinates of b and c, or NaN if it is degenerate
  glm::vec3 normal;  ///< is of unit length, or zero if the triangle is degenerate
  glm::vec3 middle;  ///< is the middle of the box
  float inverse_ab, inverse_ac, inverse_bc;  ///< are 1 over the squared lengths
  float radius;  ///< is the radius of a ball about this middle that holds the triangle, with room for rounding
  float slab;    ///< bounds |normal . p| in the band, with the rounding of float32; infinite for degenerate triangles
};

}  // namespace tolvol
