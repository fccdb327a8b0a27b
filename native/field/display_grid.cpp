// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/display_grid.h"

#include <algorithm>
#include <cmath>

#include "base/call.h"
#include "field/scatter.h"
#include "field/signs.h"
#include "geometry/pseudonormals.h"

namespace tolvol {

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
  for (std::size_t i = 0; i < grid.distance.size(); ++i) {
    poll_at(i);
    grid.distance[i] *= to_spacings;
  }
}

}  // namespace tolvol
