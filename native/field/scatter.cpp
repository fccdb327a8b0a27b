// SPDX-License-Identifier: GPL-3.0-or-later
// This is based on the initial band of [Botsch04, §2]: each triangle writes exact distances to the nodes of its
// enlarged box, and the smallest distance stays. Here the box is enlarged by the whole band, so that no marching is
// needed and every value is exact. Eight nodes along x are computed at once. Nearly all nodes in the box of a small
// triangle have a nearer triangle, so that eight nodes are skipped if a ball around the triangle is too far away to be
// nearest. In the box of a large triangle only the nodes of a row near its plane and near the part of it beside the row
// are looked at, because the box of a needle across the axes is nearly empty.
#include "field/scatter.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/call.h"
#include "base/parallel.h"
#include "base/simd.h"
#include "field/scatter_triangle.h"

namespace tolvol {
namespace {

constexpr int kLanes = DistanceGrid::kLanes;
// A row of a triangle's box with more nodes than this is cut to the nodes in the band.
constexpr int kWide = 3 * kLanes;
// This many rows of nodes, or triangles, are between two polls.
constexpr std::size_t kBetweenPolls = 1024;
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Masks = std::int32_t __attribute__((vector_size(4 * kLanes)));

TOLVOL_INLINE bool any(Masks masks) {
  using Wide = std::int64_t __attribute__((vector_size(sizeof(Masks))));
  const Wide wide = reinterpret_cast<Wide>(masks);
  return (wide[0] | wide[1] | wide[2] | wide[3]) != 0;
}

TOLVOL_INLINE Floats clamp01(Floats x) {
  const Floats zero{}, one = zero + 1.0f;
  x = x > zero ? x : zero;
  return x < one ? x : one;
}

/// Returns the squared distance from the edge o + u e, 0 <= u <= 1, of points (x, y, z) relative to o.
TOLVOL_INLINE Floats edge_distance(Floats x, float y, float z, const glm::vec3& e, float inverse) {
  const Floats u = clamp01((x * e.x + (y * e.y + z * e.z)) * inverse);
  const Floats dx = x - u * e.x, dy = y - u * e.y, dz = z - u * e.z;
  return dx * dx + dy * dy + dz * dz;
}

/// Returns the box of the part of the triangle whose coordinate k differs from `at` by no more than `reach`.
TOLVOL_INLINE Box part_beside(const ScatterTriangle& t, int k, double at, double reach) {
  Box part;
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 &p = t.corner[i], along = t.corner[(i + 1) % 3] - p;
    double begin = 0, end = 1;
    if (along[k] != 0) {
      const double u = (at - reach - p[k]) / along[k], v = (at + reach - p[k]) / along[k];
      begin = std::max(begin, std::min(u, v)), end = std::min(end, std::max(u, v));
    } else if (std::abs(p[k] - at) > reach) {
      continue;
    }
    if (begin <= end) part.add(p + along * begin), part.add(p + along * end);
  }
  return part;
}

/// Writes the distances of one triangle to the nodes of its box in rows z0 <= z < z1.
TOLVOL_INLINE void splat(const ScatterTriangle& t, std::uint32_t id, DistanceGrid& grid, int z0, int z1) {
  const double h = grid.spacing;
  const float band = static_cast<float>(grid.band), band2 = band * band, hf = static_cast<float>(h);
  const glm::dvec3 low = (t.box.lower - grid.band - grid.origin) / h,
                   high = (t.box.upper + grid.band - grid.origin) / h;
  const int zbegin = std::max(z0, static_cast<int>(std::ceil(low.z)));
  const int zend = std::min(z1 - 1, static_cast<int>(std::floor(high.z)));
  const int ybegin = std::max(0, static_cast<int>(std::ceil(low.y)));
  const int yend = std::min(grid.nodes.y - 1, static_cast<int>(std::floor(high.y)));
  const int box_begin = std::max(0, static_cast<int>(std::ceil(low.x)));
  const int box_end = std::min(grid.nodes.x - 1, static_cast<int>(std::floor(high.x)));
  Floats lane;
  for (int i = 0; i < kLanes; ++i) lane[i] = static_cast<float>(i) * hf;
  const Masks ids = Masks{} + static_cast<std::int32_t>(id);

  const glm::vec3 lower = t.box.lower - t.a, upper = t.box.upper - t.a;
  const glm::vec3 first = grid.origin - t.a;
  const double reach = ScatterTriangle::kBeyond * grid.band;
  const bool is_wide = std::max(box_end - box_begin, yend - ybegin) >= kWide;
  std::size_t rows = 0;
  for (int z = zbegin; z <= zend; ++z) {
    const float pz = first.z + static_cast<float>(z) * hf;
    const float bz = std::max({0.0f, lower.z - pz, pz - upper.z});
    Box layer;
    int y = ybegin, ylast = yend;
    if (is_wide) {
      layer = part_beside(t, 2, pz, reach);
      if (layer.empty()) continue;
      y = std::max(y, static_cast<int>(std::floor((layer.lower.y - reach - first.y) / h)));
      ylast = std::min(ylast, static_cast<int>(std::ceil((layer.upper.y + reach - first.y) / h)));
    }
    for (; y <= ylast; ++y) {
      if (++rows % kBetweenPolls == 0) poll();
      const float py = first.y + static_cast<float>(y) * hf;
      const float by = std::max({0.0f, lower.y - py, py - upper.y});
      const float room = band2 - by * by - bz * bz;
      if (room <= 0) continue;
      const float plane = t.normal.y * py + t.normal.z * pz;
      int xbegin = box_begin, xend = box_end;
      if (xend - xbegin >= kWide) {
        const Box part = part_beside(t, 1, py, reach);
        if (part.empty()) continue;
        const float half = std::sqrt(room);
        float xlow = static_cast<float>(std::max(layer.lower.x, part.lower.x)) - half,
              xhigh = static_cast<float>(std::min(layer.upper.x, part.upper.x)) + half;
        if (std::abs(t.normal.x) > 1e-3f) {
          const float middle = -plane / t.normal.x, reach = t.slab / std::abs(t.normal.x);
          xlow = std::max(xlow, middle - reach), xhigh = std::min(xhigh, middle + reach);
        } else if (std::abs(plane) > t.slab + 1e-3f * std::max(std::abs(xlow), std::abs(xhigh))) {
          continue;
        }
        xbegin = std::max(0, static_cast<int>(std::floor((xlow - first.x) / hf)));
        xend = std::min(grid.nodes.x - 1, static_cast<int>(std::ceil((xhigh - first.x) / hf)));
      }
      const float my = py - t.middle.y, mz = pz - t.middle.z, to_middle = my * my + mz * mz;
      const std::size_t row = grid.index(0, y, z);
      for (int next = xbegin; next <= xend; next += kLanes) {
        const int x = std::min(next, grid.pitch - kLanes);  // No vector may run into the next row.
        const Floats px = (first.x + static_cast<float>(x) * hf) + lane;
        Floats old;
        __builtin_memcpy(&old, &grid.distance[row + x], sizeof old);
        const Floats mx = px - t.middle.x;
        const Floats reach = old + t.radius;
        if (!any(mx * mx + to_middle < reach * reach)) continue;
        const Floats s = px * t.gs.x + (py * t.gs.y + pz * t.gs.z), u = px * t.gt.x + (py * t.gt.y + pz * t.gt.z);
        const Floats off = px * t.normal.x + plane;
        Floats d = edge_distance(px, py, pz, t.ab, t.inverse_ab);
        const Floats d2 = edge_distance(px, py, pz, t.ac, t.inverse_ac);
        const Floats d3 = edge_distance(px - t.ab.x, py - t.ab.y, pz - t.ab.z, t.bc, t.inverse_bc);
        d = d < d2 ? d : d2;
        d = d < d3 ? d : d3;
        const Masks inside = (s >= 0.0f) & (u >= 0.0f) & (s + u <= 1.0f);
        d = inside ? off * off : d;
        for (int i = 0; i < kLanes; ++i) d[i] = std::sqrt(d[i]);
        Masks old_ids;
        const Masks nearer = d < old;
        __builtin_memcpy(&old_ids, &grid.triangle[row + x], sizeof old_ids);
        d = nearer ? d : old;
        old_ids = nearer ? ids : old_ids;
        __builtin_memcpy(&grid.distance[row + x], &d, sizeof d);
        __builtin_memcpy(&grid.triangle[row + x], &old_ids, sizeof old_ids);
      }
    }
  }
}

TOLVOL_INLINE void splat_all(const TriangleMesh& mesh, DistanceGrid& grid, int z0, int z1, Progress* progress) {
  const double zlow = grid.origin.z + z0 * grid.spacing - grid.band,
               zhigh = grid.origin.z + (z1 - 1) * grid.spacing + grid.band;
  for (std::uint32_t id = 0; id < mesh.triangles.size(); ++id) {
    if (id % kBetweenPolls == 0) {
      poll();
      if (progress) progress->update(static_cast<double>(id) / static_cast<double>(mesh.triangles.size()));
    }
    const glm::uvec3 t = mesh.triangles[id];
    const double a = mesh.vertices[t.x].z, b = mesh.vertices[t.y].z, c = mesh.vertices[t.z].z;
    if (std::max({a, b, c}) < zlow || std::min({a, b, c}) > zhigh) continue;
    splat(ScatterTriangle(mesh, id, grid.band), id, grid, z0, z1);
  }
}

void splat_baseline(const TriangleMesh& mesh, DistanceGrid& grid, int z0, int z1, Progress* progress) {
  splat_all(mesh, grid, z0, z1, progress);
}
TOLVOL_TARGET_AVX2 void splat_avx2(const TriangleMesh& mesh, DistanceGrid& grid, int z0, int z1, Progress* progress) {
  splat_all(mesh, grid, z0, z1, progress);
}

/// Returns slabs of z that hold about equally many triangles. Each slab is written by one thread.
std::vector<int> slab_bounds(const TriangleMesh& mesh, const DistanceGrid& grid, unsigned slabs) {
  std::vector<int> bounds{0};
  std::vector<double> heights(mesh.triangles.size());
  for (std::size_t i = 0; i < heights.size(); ++i) {
    poll_at(i);
    heights[i] = mesh.vertices[mesh.triangles[i].x].z;
  }
  auto begin = heights.begin();
  for (unsigned i = 1; i < slabs; ++i) {
    const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() * i / slabs);
    std::nth_element(begin, middle, heights.end());
    begin = middle;
    poll();
    const int z = static_cast<int>(std::lround((*middle - grid.origin.z) / grid.spacing));
    bounds.push_back(std::clamp(z, bounds.back(), grid.nodes.z));
  }
  bounds.push_back(grid.nodes.z);
  return bounds;
}

}  // namespace

void scatter(const TriangleMesh& reference, DistanceGrid& grid, unsigned threads, Progress* progress) {
  if (progress) progress->begin("measuring distances");
  const std::size_t size = static_cast<std::size_t>(grid.pitch) * grid.nodes.y * grid.nodes.z;
  fill(grid.distance, size, static_cast<float>(grid.band));
  fill(grid.triangle, size, DistanceGrid::kNone);
  const auto kernel = simd_path() == Simd::avx2 ? splat_avx2 : splat_baseline;
  const std::vector<int> bounds = slab_bounds(reference, grid, thread_count(threads));
  parallel_for(bounds.size() - 1, 1, threads, [&](std::size_t slab, std::size_t) {
    kernel(reference, grid, bounds[slab], bounds[slab + 1], progress);
  });
}

}  // namespace tolvol
