// SPDX-License-Identifier: GPL-3.0-or-later
// After [Zelinka and Garland 2002], with the exact distance of each cell's centre where they rasterise the volume.
#include "baselines/permission_grid.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/errors.h"
#include "base/parallel.h"
#include "field/scatter.h"

namespace tolvol::baselines {

PermissionGrid::PermissionGrid(const TriangleMesh& reference, double tolerance, double precision, unsigned threads)
    : spacing_(tolerance / precision) {
  const double limit = tolerance - std::sqrt(0.75) * spacing_;
  if (!(tolerance > 0 && precision > 0 && limit > 0 && std::isfinite(tolerance) && std::isfinite(precision))) {
    throw InvalidInput("a permission grid needs a positive tolerance and a precision above 0.87");
  }
  Box box;
  for (const glm::uvec3& t : reference.triangles) {
    for (int k = 0; k < 3; ++k) box.add(reference.vertices[t[k]]);
  }
  const glm::dvec3 extent = box.upper - box.lower, count = glm::ceil((extent + 2 * tolerance) / spacing_);
  if (count.x * count.y * count.z / 8 > static_cast<double>(kBudget)) {
    std::ostringstream text;
    text << "a permission grid of " << count.x << " x " << count.y << " x " << count.z << " cells needs "
         << count.x * count.y * count.z / 8 / (1 << 20) << " MB, the limit is " << (kBudget >> 20)
         << " MB; take a lower precision";
    throw ResourceLimit(text.str());
  }
  cells_ = glm::ivec3(count);
  origin_ = box.lower - (count * spacing_ - extent) * 0.5;
  row_ = (cells_.x + 7) / 8;
  bits_.resize(static_cast<std::size_t>(row_) * cells_.y * cells_.z);

  // The nodes of each slab's distance grid are the centres of its cells.
  DistanceGrid layer;
  layer.spacing = spacing_;
  layer.band = tolerance;
  layer.nodes = {cells_.x, cells_.y, 1};
  layer.pitch = DistanceGrid::padded(cells_.x);
  const int depth = static_cast<int>(std::max<std::size_t>(1, kSlab / (layer.index(0, 0, 1) * 8)));
  const std::size_t slabs = static_cast<std::size_t>((cells_.z + depth - 1) / depth);
  parallel_for(slabs, 1, threads, [&](std::size_t slab, std::size_t) {
    const int begin = static_cast<int>(slab) * depth;
    DistanceGrid grid = layer;
    grid.nodes.z = std::min(depth, cells_.z - begin);
    grid.origin = origin_ + spacing_ * (glm::dvec3(0, 0, begin) + 0.5);
    scatter(reference, grid, 1);
    for (int z = 0; z < grid.nodes.z; ++z) {
      for (int y = 0; y < cells_.y; ++y) {
        for (int x = 0; x < cells_.x; ++x) {
          if (grid.distance[grid.index(x, y, z)] <= limit) bits_[byte_of({x, y, begin + z})] |= 1 << (x % 8);
        }
      }
    }
  });
}

}  // namespace tolvol::baselines
