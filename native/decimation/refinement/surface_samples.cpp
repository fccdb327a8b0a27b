// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/surface_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/call.h"
#include "decimation/certified_bounds.h"
#include "geometry/closest_point.h"

namespace tolvol {
namespace {

/// A face has about so many samples, if its pieces have as many points.
constexpr std::size_t kSamples = 36;
/// At most this many pieces of a face are looked at.
constexpr std::size_t kMostPieces = 300;
/// A face's samples weigh 1 together, unless there are fewer than this.
constexpr std::size_t kLeastSamples = 5;

struct Measured {
  glm::dvec3 point;
  double square;       ///< of its distance from the face
  glm::dvec3 weights;  ///< of the point of the face that is nearest to it
};

/// Leaves about kSamples of the points: in each cell of a grid over an area the one that is farthest from the face.
void thin(std::vector<Measured>& points, double area) {
  if (points.size() <= kSamples) return;
  const double side = std::sqrt(area / static_cast<double>(kSamples));
  if (!(side > 0)) return;
  const glm::dvec3 origin = points.front().point;
  struct Keyed {
    std::array<std::int64_t, 3> cell;
    double square;
    std::uint32_t point;
  };
  std::vector<Keyed> keyed;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 cell = glm::floor((points[i].point - origin) / side);
    keyed.push_back(
        {{static_cast<std::int64_t>(cell.x), static_cast<std::int64_t>(cell.y), static_cast<std::int64_t>(cell.z)},
         points[i].square,
         i});
  }
  std::ranges::sort(keyed, [](const Keyed& a, const Keyed& b) {
    if (a.cell != b.cell) return a.cell < b.cell;
    return a.square != b.square ? a.square > b.square : a.point < b.point;
  });
  std::vector<Measured> kept;
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    if (i == 0 || keyed[i].cell != keyed[i - 1].cell) kept.push_back(points[keyed[i].point]);
  }
  points = std::move(kept);
}

}  // namespace

SurfaceSamples::SurfaceSamples(const BoundedMesh& mesh, Team& team)
    : samples_(mesh.connectivity().n_faces()), energy_(samples_.size(), 0) {
  constexpr std::size_t kBlock = 16;
  team.run(samples_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) renew(mesh, static_cast<std::uint32_t>(f));
  });
}

void SurfaceSamples::renew(const BoundedMesh& mesh, std::uint32_t face) {
  samples_[face].clear(), energy_[face] = 0;
  const Coverage* const backward = mesh.certified()->backward();
  if (!backward || !mesh.alive(face)) return;
  poll();
  std::vector<glm::dvec3> points;
  backward->points(face, backward->piece_count(face) / kMostPieces + 1, points);
  const glm::uvec3& t = mesh.triangle(face);
  const glm::dvec3 &a = mesh.position(t.x), &b = mesh.position(t.y), &c = mesh.position(t.z);
  std::vector<Measured> measured;
  measured.reserve(points.size());
  for (const glm::dvec3& p : points) {
    const ClosestPoint nearest = closest_point(p, a, b, c);
    measured.push_back({p, nearest.distance_squared, nearest.weights});
  }
  thin(measured, 0.5 * glm::length(glm::cross(b - a, c - a)));
  const double weight = 1 / static_cast<double>(std::max(measured.size(), kLeastSamples));
  const double limit = mesh.certified()->forward().limit();
  for (const Measured& m : measured) {
    const double square = m.square / (limit * limit);
    samples_[face].push_back({m.point, weight, std::sqrt(square), m.weights});
    energy_[face] += weight * square * square * square * square;
  }
}

}  // namespace tolvol
