// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/crossings.h"

#include <algorithm>
#include <numeric>

#include "base/call.h"
#include "topology/faces_cross.h"
#include "topology/near_faces.h"

namespace tolvol {
namespace {

/// Appends the pairs of face `i` and a higher one, in order.
void append_pairs(std::uint32_t i, const MeshView& mesh, const NearFaces& near, std::vector<glm::uvec2>& pairs) {
  const auto before = static_cast<std::ptrdiff_t>(pairs.size());
  const Corners own = mesh.corners(i);
  std::size_t seen = 0;
  near.for_each_near(own, [&](std::uint32_t j) {
    if (seen++ % 256 == 0) poll();
    if (j <= i) return true;
    const Corners other = mesh.corners(j);
    if (faces_cross(own, other)) pairs.emplace_back(i, j);
    return true;
  });
  std::sort(pairs.begin() + before, pairs.end(), [](const glm::uvec2& a, const glm::uvec2& b) { return a.y < b.y; });
}

}  // namespace

Crossings crossings(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, std::size_t most,
                    Team& team, Progress* progress) {
  const MeshView mesh{triangles, vertices};
  std::vector<std::uint32_t> faces(triangles.size());
  std::iota(faces.begin(), faces.end(), 0u);
  const NearFaces near(
      faces, [&](std::size_t i) { return mesh.corners(i); }, NearFaces::hubs_of(triangles, vertices.size()), team);
  if (progress) progress->begin("finding crossings");
  Crossings found;
  // One face may cross all others: few faces are searched at once, and more only as long as they cross few.
  constexpr std::size_t kBlocks = 16, kFewest = 128, kMost = 8192;
  std::vector<std::vector<glm::uvec2>> of_block(kBlocks);
  std::size_t at_once = kFewest, count;
  for (std::size_t first = 0; first < triangles.size() && found.complete; first += count) {
    count = std::min(at_once, triangles.size() - first);
    const std::size_t block = at_once / kBlocks, before = found.pairs.size(), more = most - before;
    team.run(count, block, [&](std::size_t begin, std::size_t end) {
      std::vector<glm::uvec2>& pairs = of_block[begin / block];
      pairs.clear();
      for (std::size_t i = first + begin; i < first + end && pairs.size() <= more; ++i) {
        append_pairs(static_cast<std::uint32_t>(i), mesh, near, pairs);
      }
    });
    for (std::size_t i = 0; i * block < count && found.complete; ++i) {
      found.pairs.insert(found.pairs.end(), of_block[i].begin(), of_block[i].end());
      found.complete = found.pairs.size() <= most;
    }
    at_once = found.pairs.size() - before > count ? kFewest : std::min(2 * at_once, kMost);
    if (progress) progress->update(static_cast<double>(first) / static_cast<double>(triangles.size()));
  }
  if (!found.complete) found.pairs.resize(most);
  return found;
}

}  // namespace tolvol
