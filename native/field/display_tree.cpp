// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/display_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "geometry/closest_point.h"
#include "geometry/pseudonormals.h"

namespace tolvol {
namespace {

constexpr std::size_t kLeaf = 4;  // a leaf has at most this many triangles
// Distances count as equal if they differ by less than this length in the frame. surface_distance.glsl has the same
// number.
constexpr double kTie = 2e-6;
constexpr double kTiny = 1e-30;
constexpr double kSamples = 1 << 16;
// So many samples, of triangles spread over the mesh, tell how many nodes a sample visits. All samples together may
// visit about kMostVisits nodes and kVisitsPerTriangle more for each triangle. If they would visit more, there are
// fewer samples, but about kFewestSamples at least. On a scan all samples visit less than half of what they may.
constexpr std::size_t kProbes = 64;
constexpr double kMostVisits = 1 << 24, kVisitsPerTriangle = 256, kFewestSamples = 256;
// These steps spread the samples of a triangle, or the first samples of neighbouring triangles, evenly [M. Roberts, The
// Unreasonable Effectiveness of Quasirandom Sequences, 2018].
constexpr double kStepU = 0.7548776662466927, kStepV = 0.5698402909980532;

/// Sorts the triangles so that each half of each range lies together.
class Split {
 public:
  explicit Split(const TriangleMesh& mesh) : order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    centres_.reserve(mesh.triangles.size());
    for (const glm::uvec3& t : mesh.triangles) {
      centres_.push_back(mesh.vertices[t.x] + mesh.vertices[t.y] + mesh.vertices[t.z]);
    }
  }

  /// `leaves` is the number of leaves into which this range is cut, a power of two.
  void cut(std::size_t first_leaf, std::size_t leaves, std::size_t all_leaves) {
    if (leaves == 1) return;
    const std::size_t half = leaves / 2;
    const auto at = [&](std::size_t leaf) { return order_.begin() + begin_of(leaf, all_leaves); };
    const auto begin = at(first_leaf), middle = at(first_leaf + half), end = at(first_leaf + leaves);
    if (end - begin > 4096) poll();
    Box box;
    for (auto i = begin; i != end; ++i) box.add(centres_[*i]);
    const glm::dvec3 side = box.upper - box.lower;
    const int axis = side.x >= side.y && side.x >= side.z ? 0 : side.y >= side.z ? 1 : 2;
    // Equal centres keep the order of their numbers, so that the tree is the same on every machine.
    std::nth_element(begin, middle, end, [&](std::uint32_t i, std::uint32_t j) {
      const double u = centres_[i][axis], v = centres_[j][axis];
      return u != v ? u < v : i < j;
    });
    cut(first_leaf, half, all_leaves);
    cut(first_leaf + half, half, all_leaves);
  }

  std::ptrdiff_t begin_of(std::size_t leaf, std::size_t all_leaves) const {
    return static_cast<std::ptrdiff_t>(leaf * order_.size() / all_leaves);
  }
  const std::vector<std::uint32_t>& order() const { return order_; }

 private:
  std::vector<std::uint32_t> order_;
  std::vector<glm::dvec3> centres_;
};

}  // namespace

DisplayTree::DisplayTree(const TriangleMesh& reference, bool mirrored, Progress* progress) {
  const Call call(progress);
  const std::size_t count = reference.triangles.size();
  if (count > kMost) throw InvalidInput("a reference of more than 16,777,216 triangles cannot be shown");
  if (progress) progress->begin("preparing");
  poll();
  closed = Pseudonormals(reference).closed();
  const bool turned = closed ? enclosed_volume(reference) < 0 : mirrored;
  const std::size_t leaves = std::bit_ceil((count + kLeaf - 1) / kLeaf);
  Split split(reference);
  split.cut(0, leaves, leaves);
  corners.reserve(3 * count);
  for (const std::uint32_t i : split.order()) {
    const glm::uvec3& t = reference.triangles[i];
    for (const std::uint32_t v : {t.x, turned ? t.z : t.y, turned ? t.y : t.z}) {
      corners.emplace_back(glm::vec3(reference.vertices[v]), 0);
    }
  }
  nodes.assign(2 * leaves, {glm::vec3(0), 0, glm::vec3(0), 0});
  for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
    const std::ptrdiff_t begin = split.begin_of(leaf, leaves), end = split.begin_of(leaf + 1, leaves);
    Node node{glm::vec3(HUGE_VALF), static_cast<float>(begin), glm::vec3(-HUGE_VALF), static_cast<float>(end)};
    for (std::ptrdiff_t corner = 3 * begin; corner < 3 * end; ++corner) {
      const glm::vec3 p(corners[static_cast<std::size_t>(corner)]);
      node.lower = glm::min(node.lower, p);
      node.upper = glm::max(node.upper, p);
    }
    nodes[leaves + leaf] = node;
  }
  for (std::size_t i = leaves - 1; i > 0; --i) {
    const Node &a = nodes[2 * i], &b = nodes[2 * i + 1];
    nodes[i] = {glm::min(a.lower, b.lower), a.begin, glm::max(a.upper, b.upper), b.end};
  }
}

double DisplayTree::distance(const glm::dvec3& place, double reach, std::size_t& visited) const {
  const std::size_t leaves = nodes.size() / 2;
  const auto from_box = [&](std::size_t i) {
    const glm::dvec3 lower(nodes[i].lower), upper(nodes[i].upper);
    return glm::length(glm::max(glm::max(lower - place, place - upper), 0.0));
  };
  const auto from_triangle = [&](std::size_t t) {
    return place - closest_point(place, corners[3 * t], corners[3 * t + 1], corners[3 * t + 2]).point;
  };
  double found = reach, steepest = 0, side = 1;
  std::size_t i = 1;
  if (from_box(i) > found) return found;
  // Descending to the nearer half at each node leads to near triangles, which give a first bound whatever the reach is.
  while (i < leaves) i = from_box(2 * i) <= from_box(2 * i + 1) ? 2 * i : 2 * i + 1;
  for (auto t = static_cast<std::size_t>(nodes[i].begin); t < static_cast<std::size_t>(nodes[i].end); ++t) {
    found = std::min(found, glm::length(from_triangle(t)));
  }
  i = 1;
  do {
    if (++visited % 1024 == 0) poll();
    const Node& node = nodes[i];
    if (from_box(i) <= found + kTie) {
      if (i < leaves) {
        i *= 2;
        continue;
      }
      for (auto t = static_cast<std::size_t>(node.begin); t < static_cast<std::size_t>(node.end); ++t) {
        const glm::dvec3 a(corners[3 * t]), b(corners[3 * t + 1]), c(corners[3 * t + 2]);
        const glm::dvec3 away = from_triangle(t), normal = glm::cross(b - a, c - a);
        const double d = glm::length(away), across = glm::dot(away, normal) / std::max(glm::length(normal), kTiny);
        // If the place is equally far from two faces at an edge, the face whose plane is farther away tells the side.
        if (!(d < found + kTie) || (d > found - kTie && std::abs(across) < steepest)) continue;
        found = std::min(d, found), steepest = std::abs(across), side = across < 0 ? -1 : 1;
      }
    }
    // Go to the next node that is not within this one: up while this is the second half, then to the other half.
    for (++i; i % 2 == 0; i /= 2) {
    }
  } while (i != 1);
  return side * found;
}

namespace {

/// How many samples each triangle has: one, and more by its share of the whole area.
std::vector<std::size_t> many_samples(std::span<const double> shares) {
  std::vector<std::size_t> counts;
  counts.reserve(shares.size());
  for (const double share : shares) counts.push_back(1 + static_cast<std::size_t>(share * kSamples));
  return counts;
}

/// The same where about `all` samples are spread over the whole area, one on each equal part of it.
std::vector<std::size_t> few_samples(std::span<const double> shares, double all) {
  std::vector<std::size_t> counts;
  counts.reserve(shares.size());
  double before = 0;
  for (const double share : shares) {
    const double after = before + share * all;
    counts.push_back(static_cast<std::size_t>(std::floor(after) - std::floor(before)));
    before = after;
  }
  return counts;
}

}  // namespace

std::vector<double> area_shares(const DisplayTree& tree, std::span<const glm::dvec3> vertices,
                                std::span<const glm::uvec3> triangles, std::span<const double> edges,
                                unsigned threads) {
  std::vector<double> area(triangles.size());
  double whole = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::dvec3 a = vertices[triangles[i].x];
    area[i] = glm::length(glm::cross(vertices[triangles[i].y] - a, vertices[triangles[i].z] - a));
    whole += area[i];
  }
  const std::size_t bins = edges.size() + 1;
  std::vector<double> shares(bins, 0);
  if (!(whole > 0)) return shares;
  double reach = 0;
  for (const double edge : edges) reach = std::max(reach, 1.001 * std::abs(edge) + 2 * DisplayTree::kRounding);
  const auto sample = [&](std::size_t triangle, std::size_t k, std::size_t& visited) {
    const glm::dvec3 a = vertices[triangles[triangle].x], ab = vertices[triangles[triangle].y] - a,
                     ac = vertices[triangles[triangle].z] - a;
    double u = glm::fract(kStepU * static_cast<double>(k)), v = glm::fract(kStepV * static_cast<double>(k));
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return tree.distance(a + u * ab + v * ac, reach, visited);
  };

  for (double& share : area) share /= whole;
  std::size_t probed = 0, visited = 0;
  for (std::size_t i = 0; i < triangles.size(); i += triangles.size() / kProbes + 1, ++probed) sample(i, i, visited);
  const double each = static_cast<double>(visited) / static_cast<double>(probed);
  const double most = (kMostVisits + kVisitsPerTriangle * static_cast<double>(triangles.size())) / each;
  const bool are_few = most < static_cast<double>(triangles.size()) + kSamples;
  const std::vector<std::size_t> counts =
      are_few ? few_samples(area, std::max(std::floor(most), kFewestSamples)) : many_samples(area);
  const auto of_all = static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::size_t{0}));

  // Each block has a sum, and the sums are added in order, so that the result is the same for any number of threads.
  constexpr std::size_t kBlock = 1024;
  std::vector<double> sums((triangles.size() + kBlock - 1) / kBlock * bins, 0);
  parallel_for(triangles.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
    double* sum = &sums[begin / kBlock * bins];
    std::size_t nodes = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const double share = are_few ? 1 / of_all : area[i] / static_cast<double>(counts[i]);
      for (std::size_t k = i; k < i + counts[i]; ++k) {
        if (k % 64 == 0) poll();
        const double d = sample(i, k, nodes);
        const double shown = std::copysign(std::max(std::abs(d) - DisplayTree::kRounding, 0.0), d);
        sum[std::upper_bound(edges.begin(), edges.end(), shown) - edges.begin()] += share;
      }
    }
  });
  for (std::size_t i = 0; i < sums.size(); ++i) shares[i % bins] += sums[i];
  return shares;
}

}  // namespace tolvol
