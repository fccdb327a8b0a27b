// SPDX-License-Identifier: GPL-3.0-or-later
// No power of a coordinate is formed, which could leave the range of double although the result does not: matrix and
// differences are scaled by powers of two to about 1 first, and so are their products.
#include "topology/area_and_volume.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/call.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

glm::dvec3 scaled(const glm::dvec3& v, int exponent) {
  return {std::ldexp(v.x, exponent), std::ldexp(v.y, exponent), std::ldexp(v.z, exponent)};
}

/// The exponent of the power of two that is just above `value`.
int exponent_of(double value) {
  int exponent = 0;
  std::frexp(value, &exponent);
  return exponent;
}

}  // namespace

AreaAndVolume area_and_volume(std::span<const glm::dvec3> stored, std::span<const glm::uvec3> triangles,
                              std::span<const std::uint32_t> shell_of, const glm::dmat3& linear) {
  /// Calls call(a, b, c) for each triangle, with half of the way of each corner from a corner of the shell: the whole
  /// way may be infinite.
  const auto for_each = [&](auto&& call) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      poll_at(t);
      const glm::dvec3 origin = 0.5 * stored[triangles[shell_of[t]].x];
      const auto half_way = [&](std::uint32_t v) { return 0.5 * stored[v] - origin; };
      call(half_way(triangles[t].x), half_way(triangles[t].y), half_way(triangles[t].z));
    }
  };
  const int of_matrix = exponent_of(std::max({largest(linear[0]), largest(linear[1]), largest(linear[2])}));
  const glm::dmat3 map(scaled(linear[0], -of_matrix), scaled(linear[1], -of_matrix), scaled(linear[2], -of_matrix));
  double way = 0;
  for_each([&](const auto&... corner) { way = std::max({way, largest(corner)...}); });
  const int of_way = exponent_of(way);
  double mapped = 0;
  const auto map_scaled = [&](const glm::dvec3& corner) { return map * scaled(corner, -of_way); };
  for_each([&](const auto&... corner) { mapped = std::max({mapped, largest(map_scaled(corner))...}); });
  const int of_mapped = exponent_of(mapped);

  double twice_area = 0, six_volumes = 0;
  for_each([&](const auto&... corner) {
    const auto [a, b, c] = std::array{scaled(map_scaled(corner), -of_mapped)...};
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    twice_area += std::hypot(normal.x, normal.y, normal.z);
    six_volumes += glm::dot(a, glm::cross(b, c));
  });
  const int exponent = of_matrix + of_way + of_mapped + 1;
  const double sign = glm::determinant(map) < 0 ? -1 : 1;
  return {std::ldexp(twice_area / 2, 2 * exponent), std::ldexp(sign * six_volumes / 6, 3 * exponent)};
}

}  // namespace tolvol
