// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/display_grid.h"

#include <algorithm>
#include <cmath>

#include "field/scatter.h"
#include "field/signs.h"
#include "reference/call.h"
#include "reference/closest_point.h"
#include "reference/parallel.h"
#include "reference/pseudonormals.h"

namespace tolvol {
namespace {

constexpr double kCoarser = 0.8;  // a step towards a grid that fits
constexpr double kTie = 1e-3;     // in spacings
constexpr double kTiny = 1e-30;
constexpr double kSamples = 1 << 16;
// Samples of a triangle, or the first ones of neighbouring triangles, are spread evenly by these steps [M. Roberts, The
// Unreasonable Effectiveness of Quasirandom Sequences, 2018].
constexpr double kStepU = 0.7548776662466927, kStepV = 0.5698402909980532;

double enclosed_volume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    volume += glm::dot(mesh.vertices[t.x], glm::cross(mesh.vertices[t.y], mesh.vertices[t.z]));
  }
  return volume;
}

}  // namespace

DisplayGrid::DisplayGrid(const TriangleMesh& reference, bool mirrored, double tolerance, const Options& options) {
  const Call call(options.progress);
  const std::vector<bool> used = used_vertices(reference.vertices.size(), reference.triangles);
  Box box;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) box.add(reference.vertices[i]);
  }
  double precision = options.precision;
  const auto fits = [&] {
    if (precision_that_fits(box, tolerance, precision) < precision) return false;
    const glm::ivec3 n = layout_grid(box, tolerance, precision).nodes;
    return std::max({n.x, n.y, n.z}) <= options.longest &&
           static_cast<double>(n.x) * n.y * n.z <= static_cast<double>(options.nodes);
  };
  while (!fits()) precision *= kCoarser;
  grid = layout_grid(box, tolerance, precision);
  scatter(reference, grid, options.threads, options.progress);
  const Pseudonormals normals(reference);
  closed = normals.closed();
  grid.distance = signed_distance(reference, normals, grid, options.threads);
  grid.is_signed = true;
  const bool turned = closed ? enclosed_volume(reference) < 0 : mirrored;
  const float to_spacings = static_cast<float>((turned ? -1 : 1) / grid.spacing);
  for (float& d : grid.distance) d *= to_spacings;
  corners.reserve(3 * reference.triangles.size());
  for (const glm::uvec3& t : reference.triangles) {
    poll_at(corners.size() / 3);
    for (const std::uint32_t v : {t.x, turned ? t.z : t.y, turned ? t.y : t.z}) {
      corners.emplace_back((reference.vertices[v] - grid.origin) / grid.spacing);
    }
  }
}

float DisplayGrid::nearest(const glm::dvec3& node) const {
  const glm::dvec3 last(grid.nodes - 1), place = glm::clamp(node, glm::dvec3(0), last);
  const glm::ivec3 first(glm::min(glm::floor(place), last - 1.0));
  double nearest = grid.band / grid.spacing, steepest = 0, side = 1;
  for (int k = 0; k < 8; ++k) {
    const std::uint32_t id = grid.triangle[grid.index(first.x + (k & 1), first.y + (k >> 1 & 1), first.z + (k >> 2))];
    if (id == DistanceGrid::kNone) continue;
    const glm::dvec3 a(corners[3 * id]), b(corners[3 * id + 1]), c(corners[3 * id + 2]);
    const glm::dvec3 off = place - closest_point(place, a, b, c).point, normal = glm::cross(b - a, c - a);
    const double distance = glm::length(off), across = glm::dot(off, normal) / std::max(glm::length(normal), kTiny);
    // Of two faces at an edge that it is equally far from, the one that it is more above tells the side.
    if (!(distance < nearest + kTie) || (distance > nearest - kTie && std::abs(across) < steepest)) continue;
    nearest = std::min(distance, nearest), steepest = std::abs(across), side = across < 0 ? -1 : 1;
  }
  return static_cast<float>(side * nearest);
}

float DisplayGrid::interpolated(const glm::dvec3& node) const {
  const glm::dvec3 last(grid.nodes - 1), place = glm::clamp(node, glm::dvec3(0), last);
  const glm::dvec3 first = glm::min(glm::floor(place), last - 1.0);
  const glm::vec3 t(place - first);
  const std::size_t base = grid.index(static_cast<int>(first.x), static_cast<int>(first.y), static_cast<int>(first.z));
  const std::size_t row = grid.index(0, 1, 0), layer = grid.index(0, 0, 1);
  const auto four = [&](std::size_t at) {
    return glm::vec4(grid.distance[at], grid.distance[at + row], grid.distance[at + layer],
                     grid.distance[at + row + layer]);
  };
  glm::vec4 low = four(base), high = four(base + 1);
  const auto swizzle = [](const glm::vec4& v, int a, int b, int c, int d) { return glm::vec4(v[a], v[b], v[c], v[d]); };
  const auto across = [&](const glm::vec4& v) { return glm::abs(swizzle(v, 0, 0, 1, 2) - swizzle(v, 1, 2, 3, 3)); };
  const glm::vec4 change = glm::max(glm::abs(high - low), glm::max(across(low), across(high)));
  float sign_of_nearest = 1;
  if (std::max({change.x, change.y, change.z, change.w}) > 1.001f) {
    const glm::vec4& side = t.x < 0.5f ? low : high;
    sign_of_nearest = glm::sign(side[(t.y < 0.5f ? 0 : 1) + (t.z < 0.5f ? 0 : 2)]);
    low = glm::abs(low);
    high = glm::abs(high);
  }
  const glm::vec4 along_x = glm::mix(low, high, t.x);
  const float near = glm::mix(along_x.x, along_x.y, t.y), far = glm::mix(along_x.z, along_x.w, t.y);
  return sign_of_nearest * glm::mix(near, far, t.z);
}

std::vector<double> area_shares(const DisplayGrid& display, bool nearest, std::span<const glm::dvec3> nodes,
                                std::span<const glm::uvec3> triangles, std::span<const double> edges,
                                unsigned threads) {
  std::vector<double> area(triangles.size());
  double whole = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::dvec3 a = nodes[triangles[i].x];
    area[i] = glm::length(glm::cross(nodes[triangles[i].y] - a, nodes[triangles[i].z] - a));
    whole += area[i];
  }
  const std::size_t bins = edges.size() + 1;
  std::vector<double> shares(bins, 0);
  if (!(whole > 0)) return shares;
  // A sum for each block, added in order: the same for any number of threads.
  constexpr std::size_t kBlock = 4096;
  std::vector<double> sums((triangles.size() + kBlock - 1) / kBlock * bins, 0);
  parallel_for(triangles.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
    double* sum = &sums[begin / kBlock * bins];
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 a = nodes[triangles[i].x], ab = nodes[triangles[i].y] - a, ac = nodes[triangles[i].z] - a;
      poll_at(i);
      const auto count = 1 + static_cast<std::size_t>(area[i] / whole * kSamples);
      for (std::size_t k = i; k < i + count; ++k) {
        double u = glm::fract(kStepU * static_cast<double>(k)), v = glm::fract(kStepV * static_cast<double>(k));
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const glm::dvec3 p = a + u * ab + v * ac;
        const double d = nearest ? display.nearest(p) : display.interpolated(p);
        sum[std::upper_bound(edges.begin(), edges.end(), d) - edges.begin()] +=
            area[i] / (static_cast<double>(count) * whole);
      }
    }
  });
  for (std::size_t i = 0; i < sums.size(); ++i) shares[i % bins] += sums[i];
  return shares;
}

}  // namespace tolvol
