// SPDX-License-Identifier: GPL-3.0-or-later
// This is based on [Botsch04, §2] and, for the marching, on J. Sethian, A fast marching level set method for
// monotonically advancing fronts, 1996. There are three deviations:
// - The paper takes all nodes of the triangles' enlarged boxes for known. Here only the nodes within one cell of the
//   surface are known, because a triangle whose box does not reach a node may be nearer to it than one whose box does.
//   So every initial value is exact, and scatter() with a band of one cell computes them.
// - Normals at edges are pseudonormals, not interpolated normals (geometry/pseudonormals.h).
// - Open and closed meshes are marched alike, without a sign. A node of a closed mesh then gets the sign of the node
//   from which the front came, because the surface is between known nodes only. For other meshes the sign is estimated
//   as in the initial phase, against the triangle from which the front came.
#include "field/fast_marching.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "base/call.h"
#include "field/scatter.h"
#include "field/signs.h"

namespace tolvol {
namespace {

// The initial band, in cells, is a little more than one, so that it holds both ends of every grid edge that meets the
// surface.
constexpr double kInitialBand = 1.001;

class Front {
 public:
  Front(const TriangleMesh& reference, const Pseudonormals& normals, DistanceGrid& grid,
        std::vector<std::uint8_t>& known)
      : reference_(reference),
        normals_(normals),
        grid_(grid),
        known_(known),
        origin_(copied(grid.triangle)),
        strides_{1, grid.index(0, 1, 0), grid.index(0, 0, 1)} {
    for (int z = 0; z < grid.nodes.z; ++z) {
      for (int y = 0; y < grid.nodes.y; ++y) {
        poll();
        for (int x = 0; x < grid.nodes.x; ++x) {
          const glm::ivec3 at(x, y, z);
          if (known_[grid.index(x, y, z)]) continue;
          bool beside = false;
          for_neighbours(at, [&](std::size_t, const glm::ivec3&, std::size_t other) { beside |= known_[other] != 0; });
          if (beside) relax(at);
        }
      }
    }
  }

  void march(double stop, Progress* progress) {
    constexpr std::size_t kBetween = 1 << 12;  // After this many entries of the heap the march updates its progress.
    float reached = 0;
    for (std::size_t count = 1; !heap_.empty() && !(static_cast<double>(reached) > stop); ++count) {
      std::pop_heap(heap_.begin(), heap_.end(), std::greater());
      const std::uint64_t top = heap_.back();
      heap_.pop_back();
      if (count % kBetween == 0) {
        poll();
        if (progress) progress->update(std::min(1.0, static_cast<double>(reached) / stop));
      }
      const std::uint32_t node = static_cast<std::uint32_t>(top);
      if (known_[node]) continue;  // this is an older entry of a node that came nearer
      reached = std::bit_cast<float>(static_cast<std::uint32_t>(top >> 32));
      conquer(node, reached);
    }
  }

 private:
  /// Calls visit(axis, position, index) for the up to six nodes beside a node.
  template <class Visit>
  void for_neighbours(const glm::ivec3& at, Visit&& visit) const {
    const std::size_t node = grid_.index(at.x, at.y, at.z);
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 other = at;
      if (--other[axis] >= 0) visit(axis, other, node - strides_[axis]);
      other[axis] += 2;
      if (other[axis] < grid_.nodes[axis]) visit(axis, other, node + strides_[axis]);
    }
  }

  /// Returns the distance at a node by the known nodes beside it. It is the solution u of sum over the axes of
  /// max(0, u - d)^2 = h^2, where d is the lesser distance of the two nodes along an axis.
  void relax(const glm::ivec3& at) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    double d[3] = {kFar, kFar, kFar};
    for_neighbours(at, [&](int axis, const glm::ivec3&, std::size_t other) {
      if (known_[other]) d[axis] = std::min(d[axis], static_cast<double>(std::abs(grid_.distance[other])));
    });
    std::sort(d, d + 3);
    const double h = grid_.spacing, b = d[1] - d[0], c = d[2] - d[0];
    double u = h;  // is relative to d[0]
    if (u > b) u = (b + std::sqrt(2 * h * h - b * b)) / 2;
    if (u > c) u = (b + c + std::sqrt((b + c) * (b + c) - 3 * (b * b + c * c - h * h))) / 3;
    const float distance = static_cast<float>(d[0] + u);
    float& held = grid_.distance[grid_.index(at.x, at.y, at.z)];
    if (!(distance < held)) return;
    held = distance;
    heap_.push_back(std::uint64_t{std::bit_cast<std::uint32_t>(distance)} << 32 | grid_.index(at.x, at.y, at.z));
    std::push_heap(heap_.begin(), heap_.end(), std::greater());
  }

  void conquer(std::uint32_t node, float distance) {
    const std::size_t row = node / strides_[1];
    const glm::ivec3 at(node % strides_[1], row % grid_.nodes.y, row / grid_.nodes.y);
    std::size_t from = node;  // becomes the known node beside it that is nearest to the surface
    for_neighbours(at, [&](int, const glm::ivec3&, std::size_t other) {
      if (!known_[other]) return;
      if (from == node || std::abs(grid_.distance[other]) < std::abs(grid_.distance[from])) from = other;
    });
    origin_[node] = origin_[from];
    const bool inside = normals_.closed() ? std::signbit(grid_.distance[from]) : estimate(at, origin_[node]);
    grid_.distance[node] = inside ? -distance : distance;
    known_[node] = 1;
    for_neighbours(at, [&](int, const glm::ivec3& position, std::size_t other) {
      if (!known_[other]) relax(position);
    });
  }

  bool estimate(const glm::ivec3& at, std::uint32_t triangle) const {
    const glm::uvec3 t = reference_.triangles[triangle];
    const glm::dvec3 p = grid_.origin + grid_.spacing * glm::dvec3(at);
    const auto corner = [&](int k) { return reference_.vertices[t[k]]; };
    return normals_.inside(p, triangle, closest_point(p, corner(0), corner(1), corner(2)));
  }

  const TriangleMesh& reference_;
  const Pseudonormals& normals_;
  DistanceGrid& grid_;
  std::vector<std::uint8_t>& known_;
  std::vector<std::uint32_t> origin_;  // holds for each known node the triangle from which the front came
  const std::size_t strides_[3];
  // An entry has the bits of a distance, which order like it, above those of the node, so that ties go by index.
  std::vector<std::uint64_t> heap_;
};

}  // namespace

void fast_marching(const TriangleMesh& reference, DistanceGrid& grid, double stop, unsigned threads,
                   Progress* progress) {
  const double band = std::exchange(grid.band, kInitialBand * grid.spacing);
  scatter(reference, grid, threads, progress);
  grid.band = band;
  const Pseudonormals normals(reference);
  sign_by_triangle(reference, normals, grid, grid.distance, threads);
  grid.is_signed = true;

  if (progress) progress->begin("marching");
  std::vector<std::uint8_t> known;
  fill(known, grid.distance.size(), std::uint8_t{0});
  const float far = static_cast<float>(band);
  for (std::size_t i = 0; i < known.size(); ++i) {
    poll_at(i);
    known[i] = grid.triangle[i] != DistanceGrid::kNone;
    if (!known[i]) grid.distance[i] = far;
  }
  Front(reference, normals, grid, known).march(stop, progress);
  for (std::size_t i = 0; i < known.size(); ++i) {
    poll_at(i);
    if (!known[i]) grid.distance[i] = far;  // the front had only touched this node
  }
  spread_signs(grid, std::move(known), grid.distance);
}

}  // namespace tolvol
