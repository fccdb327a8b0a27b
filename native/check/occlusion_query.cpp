// SPDX-License-Identifier: GPL-3.0-or-later
// Based on [Botsch04, §4] and deviates from it where that is not conservative. The paper's triangle of edge n leaves
// out the candidate's corners, and a small one draws no pixel at all: here the pixels are samples that include them.
// The paper counts pixels outside, so that one that is missing is good: here the good ones are counted. The paper
// interpolates in hardware, signed, in 8 bits: here in the shader, unsigned, in float32. Candidates larger than a cell
// of the framebuffer are cut, because what a framebuffer cuts off nobody misses.
//
// Why a candidate is inside when D(x) <= eps' at every sample x, D the interpolated distance. Let d be the
// distance to the reference; it changes by no more than the way. A point p of the candidate is in one of the
// triangles between the samples, no edge of which is longer than h, hence within h / sqrt(3) of a sample x. D(x) is a
// mean of values of at least d(v_i) >= d(x) - |x - v_i| at the eight nodes v_i around x, with weights of which x is the
// mean of the nodes; the mean of |x - v_i| is at most the root of the mean of its square, sum over the axes of h^2 t (1
// - t) <= (3/4) h^2. So d(p) <= D(x) + (sqrt(3)/2) h + h / sqrt(3). By way of the nearest node v alone it is d(p) <=
// d(v) + |x - v| + h / sqrt(3); that is tried first.
#include "check/occlusion_query.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "base/errors.h"
#include "base/parallel.h"
#include "check/witness.h"
#include "gl/context.h"

namespace tolvol {
namespace {

constexpr float kMargin = 1.5f;      // half way between the last sample and the next pixel
constexpr double kLargestPart = 62;  // subdivisions: with the margin it fits a cell of 64 pixels

constexpr double kInterpolationLoss = 0.8660254037844387;  // spacings that interpolation may lose

float rounded_down(double x) { return std::nextafter(static_cast<float>(x), 0.0f); }

/// Upper bounds on the distances of the nodes, float32 rounded up. Never the grid's own distances: those are rounded
/// either way and, at needles, guesses. Nodes without an id are taken for farther than anything in the grid.
std::vector<float> upper_bounds(const ToleranceVolume& volume) {
  const DistanceGrid& grid = volume.grid();
  const float far = static_cast<float>(2 * grid.spacing * glm::length(glm::dvec3(grid.nodes)));
  std::vector<float> bounds(grid.distance.size(), far);
  const std::size_t rows = static_cast<std::size_t>(grid.nodes.y) * grid.nodes.z;
  constexpr std::size_t kBlock = 64;
  parallel_for(rows, kBlock, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const auto y = static_cast<int>(row % grid.nodes.y), z = static_cast<int>(row / grid.nodes.y);
      for (int x = 0; x < grid.nodes.x; ++x) {
        const std::size_t i = grid.index(x, y, z);
        if (grid.triangle[i] == DistanceGrid::kNone) continue;
        const glm::dvec3 p = grid.origin + grid.spacing * glm::dvec3(x, y, z);
        FourPoints points;
        points.set(p, p, p, p);
        double d2[4];
        witness_distances(volume.witnesses()[grid.triangle[i]], points, d2);
        bounds[i] = std::nextafter(static_cast<float>(std::sqrt(d2[0])), std::numeric_limits<float>::infinity());
      }
    }
  });
  return bounds;
}

}  // namespace

OcclusionQuery::OcclusionQuery(const ToleranceVolume& volume) : SampledCheck(volume, kMargin) {
  bound(0);  // throws before any work when the grid is too coarse
  const std::vector<float> bounds = upper_bounds(volume);
  gl::run([&] {
    texture_.emplace(volume.grid(), bounds, volume.frame_tolerance(), TextureFormat::float32);
    programs();
  });
}

// What float32 hides, u = 2^-24, G the largest number of nodes along an axis. GLSL rounds sums and products correctly
// but to either side: by 2u. In grid spacings, per coordinate: the corner is sent with an error of u G, the edges,
// because i/n + j/n <= 1, together with u G; their multiplication rounds by 2u G together, the two sums by 2u G each.
// 8 u G in three coordinates is below 14 u G h; doubles, which bring the corners into the grid, and n, which they
// round, are far below the 16 counted here. The way from a node is exact. In the interpolation every term is a product
// of non-negative factors: three weights, three products and eight sums round by 2u of the result each, 28 u of at most
// epsilon; 32 leave room for the bound's own rounding. By way of one node, the way's square rounds by 8u, and half of
// that counts, room and its square by 4u: below 10 u. What the witnesses behind the nodes hide is in provable()
// already.
float OcclusionQuery::bound(double mapping_error) const {
  constexpr double kUnit = 0x1p-24;
  const DistanceGrid& grid = volume().grid();
  const double h = grid.spacing, largest = std::max({grid.nodes.x, grid.nodes.y, grid.nodes.z}),
               rounding = kUnit * (16 * h * largest + 32 * volume().frame_tolerance());
  const double bound = volume().provable(mapping_error) - h / std::sqrt(3.0) - kInterpolationLoss * h - rounding;
  if (!(bound > 0)) {
    constexpr int kGood = 4;  // more than a third of the tolerance goes to what samples stand for
    std::ostringstream text;
    text << "the method occlusion_query needs a finer grid: at a precision of " << volume().precision()
         << " what its samples stand for is larger than the tolerance; take precision=" << kGood;
    throw InvalidInput(text.str());
  }
  return rounded_down(bound);
}

bool OcclusionQuery::add_triangle_samples(const Corners& corners, std::uint32_t counter,
                                          std::vector<SampledTriangle>& triangles) const {
  // A cell away from the grid's border no rounding leads out of it; and there nothing is within the tolerance.
  const glm::dvec3 last = glm::dvec3(volume().grid().nodes) - 2.0;
  for (const glm::dvec3& p : corners) {
    // Written so that NaN fails as well.
    if (!(p.x >= 1 && p.y >= 1 && p.z >= 1 && p.x <= last.x && p.y <= last.y && p.z <= last.z)) return false;
  }
  const glm::dvec3 along = corners[1] - corners[0], across = corners[2] - corners[0];
  const glm::dvec3 third = across - along;
  const double longest =
      std::sqrt(std::max({glm::dot(along, along), glm::dot(across, across), glm::dot(third, third)}));
  const double pieces = std::max(1.0, std::ceil(longest / kLargestPart));
  const auto n = static_cast<float>(std::max(1.0, std::ceil(longest / pieces)));
  const glm::dvec3 step1 = along / pieces, step2 = across / pieces;
  const glm::vec3 edge1 = step1 / static_cast<double>(n), edge2 = step2 / static_cast<double>(n);
  const int count = static_cast<int>(pieces);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; i + j < count; ++j) {
      const glm::dvec3 corner = corners[0] + static_cast<double>(i) * step1 + static_cast<double>(j) * step2;
      triangles.push_back({corner, n, edge1, counter, edge2, 0});
      // Between this one and the next on the diagonal lies one that points the other way.
      if (i + j + 1 < count) triangles.push_back({corner + step1 + step2, n, -edge1, counter, -edge2, 0});
    }
  }
  return true;
}

void OcclusionQuery::use(const gl::Program& program, float bound) const {
  const double h = volume().grid().spacing;
  texture_->texture().bind(0);
  program.set("distances", 0);
  program.set("bound", bound);
  program.set("bound_near", rounded_down(bound + kInterpolationLoss * h));
  program.set("spacing2", std::nextafter(static_cast<float>(h * h), 1.0f));
}

const SampledCheck::Programs& OcclusionQuery::programs() const {
  struct Own : Programs {
    Own() : Programs("occlusion_query.frag") {}
  };
  return gl::of_context<Own>();
}

Verdict OcclusionQuery::verdict(std::uint64_t counted, std::uint64_t points) const {
  return counted == points ? Verdict::inside : Verdict::unproved;
}

}  // namespace tolvol
