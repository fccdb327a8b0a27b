// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/crossings.h"

#include <algorithm>
#include <numeric>

#include "base/call.h"
#include "topology/faces_cross.h"
#include "topology/near_faces.h"

namespace tolvol {

Crossings crossings(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, std::size_t most,
                    Team& team, Progress* progress) {
  const MeshView mesh{triangles, vertices};
  std::vector<Corners> corners(triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    poll_at(i);
    corners[i] = mesh.corners(i);
  }
  std::vector<std::uint32_t> faces(triangles.size());
  std::iota(faces.begin(), faces.end(), 0u);
  const NearFaces near(faces, corners, NearFaces::hubs_of(triangles, vertices.size()), team);
  if (progress) progress->begin("finding crossings");
  Crossings found;
  // One face may cross all others, so that pairs are collected from a few faces at a time before they are counted.
  constexpr std::size_t kAtOnce = 128, kBlock = 8;
  std::vector<std::vector<glm::uvec2>> of_block(kAtOnce / kBlock);
  for (std::size_t first = 0; first < triangles.size() && found.complete; first += kAtOnce) {
    team.run(std::min(kAtOnce, triangles.size() - first), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<glm::uvec2>& pairs = of_block[begin / kBlock];
      pairs.clear();
      for (auto i = static_cast<std::uint32_t>(first + begin); i < first + end; ++i) {
        const std::size_t before = pairs.size();
        near.for_each_near(corners[i], [&](std::uint32_t j) {
          poll_at(j);
          if (j > i && faces_cross(corners[i], corners[j])) pairs.emplace_back(i, j);
          return true;
        });
        std::sort(pairs.begin() + static_cast<std::ptrdiff_t>(before), pairs.end(),
                  [](const glm::uvec2& a, const glm::uvec2& b) { return a.y < b.y; });
      }
    });
    const std::size_t blocks = (std::min(kAtOnce, triangles.size() - first) + kBlock - 1) / kBlock;
    for (std::size_t block = 0; block < blocks && found.complete; ++block) {
      found.pairs.insert(found.pairs.end(), of_block[block].begin(), of_block[block].end());
      found.complete = found.pairs.size() <= most;
    }
    if (progress) progress->update(static_cast<double>(first) / static_cast<double>(triangles.size()));
  }
  if (!found.complete) found.pairs.resize(most);
  return found;
}

}  // namespace tolvol
