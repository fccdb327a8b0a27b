// SPDX-License-Identifier: GPL-3.0-or-later
// This is based on [Botsch04, §4] and deviates from it where it is not conservative. The paper's triangle of edge n
// leaves out the candidate's corners, and a small triangle draws no pixel at all; here the pixels are samples that
// include the corners. The paper counts pixels outside, so that a missing pixel passes for inside; here the pixels
// inside are counted. The paper interpolates signed distances in hardware, in 8 bits; here the shader interpolates
// unsigned distances in float32. Candidates larger than a cell of the framebuffer are cut up, because the framebuffer
// would clip them.
//
// A candidate is inside if D(x) <= eps' at every sample x, where D is the interpolated distance, for this reason. Let d
// be the distance from the reference, which changes by no more than the way from one point to another. A point p of the
// candidate is in one of the triangles between the samples, no edge of which is longer than h, hence within h / sqrt(3)
// of a sample x. D(x) is a mean of values of at least d(v_i) >= d(x) - |x - v_i| at the eight nodes v_i around x, and
// with the same weights x is the mean of the nodes. The mean of |x - v_i| is at most the root of the mean of its
// square, which is the sum over the axes of h^2 t (1 - t) <= (3/4) h^2. So d(p) <= D(x) + (sqrt(3)/2) h + h / sqrt(3).
// The nearest node v alone gives d(p) <= d(v) + |x - v| + h / sqrt(3), which is tried first.
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

// The edge of a drawn triangle is this many pixels longer than n: it ends half way between the last sample and the next
// pixel.
constexpr float kMargin = 1.5f;
// A part has at most this many subdivisions. With the margin it fits a cell of 64 pixels.
constexpr double kLargestPart = 62;
// Interpolation may underestimate a distance by this many grid spacings, sqrt(3) / 2.
constexpr double kInterpolationLoss = 0.8660254037844387;

float rounded_down(double x) { return std::nextafter(static_cast<float>(x), 0.0f); }

/// Returns upper bounds on the distances of the nodes, rounded up to float32. It does not use the grid's own distances,
/// which are rounded either way and are guesses at needles. Nodes without an id get a distance larger than the grid.
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
  bound(0);  // this throws before any work if the grid is too coarse
  const std::vector<float> bounds = upper_bounds(volume);
  gl::run([&] {
    texture_.emplace(volume.grid(), bounds, volume.frame_tolerance(), TextureFormat::float32);
    programs();
  });
}

// The bound leaves room for the rounding of float32. Let u = 2^-24 and G be the largest number of nodes along an axis.
// GLSL rounds sums and products correctly but to either side, by 2u. Per coordinate and in grid spacings, the corner is
// sent with an error of u G, and the edges together with u G, because i/n + j/n <= 1. Their multiplication rounds by 2u
// G together, and the two sums by 2u G each. These 8 u G in three coordinates are below 14 u G h. The doubles that
// bring the corners into the grid and that round n err by far less than the rest of the 16 counted here. The way from a
// node is exact. In the interpolation every term is a product of non-negative factors: three weights, three products
// and eight sums round by 2u of the result each, 28 u of at most epsilon, and 32 leave room for the bound's own
// rounding. By one node alone, the square of the way rounds by 8u, half of which counts, and the room and its square by
// 4u, which is together below 10 u. provable() already covers the rounding of the witnesses behind the nodes.
float OcclusionQuery::bound(double mapping_error) const {
  constexpr double kUnit = 0x1p-24;
  const DistanceGrid& grid = volume().grid();
  const double h = grid.spacing, largest = std::max({grid.nodes.x, grid.nodes.y, grid.nodes.z}),
               rounding = kUnit * (16 * h * largest + 32 * volume().frame_tolerance());
  const double bound = volume().provable(mapping_error) - h / std::sqrt(3.0) - kInterpolationLoss * h - rounding;
  if (!(bound > 0)) {
    // At this precision, in nodes per tolerance, 1.44 h are about a third of the tolerance.
    constexpr int kGood = 4;
    std::ostringstream text;
    text << "the method occlusion_query needs a finer grid: at a precision of " << volume().precision()
         << " what its samples stand for is larger than the tolerance; take precision=" << kGood;
    throw InvalidInput(text.str());
  }
  return rounded_down(bound);
}

bool OcclusionQuery::add_triangle_samples(const Corners& corners, std::uint32_t counter,
                                          std::vector<SampledTriangle>& triangles) const {
  // Nothing in the outermost cells is within the tolerance, and from the other cells no rounding leads out of the grid.
  const glm::dvec3 last = glm::dvec3(volume().grid().nodes) - 2.0;
  for (const glm::dvec3& p : corners) {
    // A comparison with NaN is false, so that NaN fails as well.
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
      // Between this part and the next on the diagonal lies a part that points the other way.
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
