// SPDX-License-Identifier: GPL-3.0-or-later
// The midpoint rule on a regular subdivision: the distance is Lipschitz with constant 1, so a mean is off by less than
// the spacing and, the distance being smooth nearly everywhere, by far less in practice.
#include "measure/deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "measure/placed_pair.h"
#include "reference/hierarchy.h"
#include "reference/parallel.h"

namespace tolvol {
namespace {

using glm::dvec3;
using Corners = std::array<dvec3, 3>;

constexpr double kSamples = 262144;  // 0.2 s; a spacing of about 0.2 % of the size of a scan
constexpr std::size_t kBlock = 8;    // triangles whose sums are added up together, in a fixed order

/// What a triangle weighs in the averages.
enum class Measure { area, length, number };

double measure_of(const Corners& p, Measure measure) {
  switch (measure) {
    case Measure::area:
      return 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
    case Measure::length:
      return std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
    case Measure::number:
      break;
  }
  return 1;
}

struct Sums {
  double distance = 0, squared = 0, weight = 0;
  std::size_t samples = 0;
  std::vector<double> beyond;

  void add(double d, double w, std::span<const double> bounds) {
    distance += w * d;
    squared += w * d * d;
    weight += w;
    ++samples;
    for (std::size_t i = 0; i < bounds.size(); ++i) {
      if (d > bounds[i]) beyond[i] += w;
    }
  }
};

/// visit(point, its part of the triangle) for k parts along the longest edge or for k x k equal triangles.
template <class Visit>
void cover(const Corners& p, Measure measure, int k, Visit&& visit) {
  if (measure != Measure::area) {
    int longest = 0;
    for (int i = 1; i < 3; ++i) {
      if (glm::distance(p[i], p[(i + 1) % 3]) > glm::distance(p[longest], p[(longest + 1) % 3])) longest = i;
    }
    for (int i = 0; i < k; ++i) visit(glm::mix(p[longest], p[(longest + 1) % 3], (i + 0.5) / k), 1.0 / k);
    return;
  }
  const double third = 1 / (3.0 * k);
  for (int i = 0; i < k; ++i) {
    for (int j = 0; i + j < k; ++j) {
      for (const int up : {1, 2}) {  // the centroid in thirds of a part: (i, j) + 1/3 or, upside down, + 2/3
        if (up == 2 && i + j + 1 == k) continue;
        const double u = (3 * i + up) * third, v = (3 * j + up) * third;
        visit(p[0] + u * (p[1] - p[0]) + v * (p[2] - p[0]), 1.0 / k / k);
      }
    }
  }
}

}  // namespace

Deviation deviation(const TriangleMesh& a, const TriangleMesh& b, std::span<const double> bounds,
                    const DeviationOptions& options) {
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    if (bounds[i] >= 0) continue;
    std::ostringstream text;
    text << "bound " << i << " is not a length of 0 or more";
    throw InvalidInput(text.str());
  }
  if (options.progress) options.progress->begin("averaging");
  const PlacedPair pair(a, b);
  const Frame& frame = pair.frame;
  const Hierarchy hierarchy(pair.b);
  std::vector<double> bounds_in_frame(bounds.begin(), bounds.end());
  for (double& bound : bounds_in_frame) bound *= frame.scale();

  const std::size_t count = a.triangles.size();
  const auto corners = [&](std::size_t i) {
    const glm::uvec3& t = pair.a.triangles[i];
    return Corners{pair.a.vertices[t.x], pair.a.vertices[t.y], pair.a.vertices[t.z]};
  };
  Measure measure = Measure::number;
  double total = double(count);
  for (const Measure wanted : {Measure::area, Measure::length}) {
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += measure_of(corners(i), wanted);
    if (!(sum > 0)) continue;
    measure = wanted, total = sum;
    break;
  }
  const double part = total / kSamples;  // what a sample stands for

  std::vector<Sums> blocks((count + kBlock - 1) / kBlock);
  constexpr std::size_t kRound = 2048;  // blocks between two looks at the progress
  for (std::size_t first = 0; first < blocks.size(); first += kRound) {
    const std::size_t last = std::min(first + kRound, blocks.size());
    parallel_for(last - first, 1, options.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t block = first + begin; block < first + end; ++block) {
        Sums& sums = blocks[block];
        sums.beyond.resize(bounds.size());
        std::uint32_t hint = Hierarchy::kNone;
        for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, count); ++i) {
          const Corners p = corners(i);
          const double whole = measure_of(p, measure);
          const double parts = measure == Measure::number ? 1 : whole / part;
          const int k = std::max(1, int(std::lround(measure == Measure::area ? std::sqrt(parts) : parts)));
          cover(p, measure, k, [&](const dvec3& sample, double share) {
            const Hierarchy::Nearest nearest = hierarchy.nearest(sample, std::numeric_limits<double>::infinity(), hint);
            hint = nearest.triangle;
            sums.add(nearest.distance, whole * share, bounds_in_frame);
          });
        }
      }
    });
    if (options.progress) options.progress->update(double(last) / double(blocks.size()));
  }

  Sums all;
  all.beyond.resize(bounds.size());
  for (const Sums& sums : blocks) {
    all.distance += sums.distance;
    all.squared += sums.squared;
    all.weight += sums.weight;
    all.samples += sums.samples;
    for (std::size_t i = 0; i < bounds.size(); ++i) all.beyond[i] += sums.beyond[i];
  }
  Deviation result{all.distance / all.weight / frame.scale(), std::sqrt(all.squared / all.weight) / frame.scale(),
                   all.beyond, 0, all.samples};
  for (double& share : result.share_beyond) share /= all.weight;
  if (measure == Measure::area) result.spacing = std::sqrt(total / double(all.samples)) / frame.scale();
  if (measure == Measure::length) result.spacing = total / double(all.samples) / frame.scale();
  return result;
}

}  // namespace tolvol
