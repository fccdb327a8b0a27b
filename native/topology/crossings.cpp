// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/crossings.h"

#include <algorithm>
#include <numeric>

#include "base/call.h"
#include "topology/faces_cross.h"
#include "topology/near_faces.h"

namespace tolvol {
namespace {

/// Appends the pairs that cross of a group of faces, until there are more than `most`.
void append_pairs(std::size_t group, const MeshView& mesh, const NearFaces& near, std::size_t most,
                  std::vector<glm::uvec2>& pairs) {
  std::size_t seen = 0;
  near.for_each_pair(group, [&](std::uint32_t a, std::uint32_t b) {
    if (seen++ % 256 == 0) poll();
    if (faces_cross(mesh.corners(a), mesh.corners(b))) pairs.emplace_back(std::min(a, b), std::max(a, b));
    return pairs.size() <= most;
  });
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
  // One face may cross all others: few groups are searched at once, and more only as long as their faces cross few.
  constexpr std::size_t kBlocks = 16, kFewest = 16, kMost = 1024;
  std::vector<std::vector<glm::uvec2>> of_block(kBlocks);
  std::size_t at_once = kFewest, count;
  for (std::size_t first = 0; first < near.group_count() && found.complete; first += count) {
    count = std::min(at_once, near.group_count() - first);
    const std::size_t block = at_once / kBlocks, before = found.pairs.size(), more = most - before;
    team.run(count, block, [&](std::size_t begin, std::size_t end) {
      std::vector<glm::uvec2>& pairs = of_block[begin / block];
      pairs.clear();
      for (std::size_t group = first + begin; group < first + end && pairs.size() <= more; ++group) {
        append_pairs(group, mesh, near, more, pairs);
      }
    });
    for (std::size_t i = 0; i * block < count && found.complete; ++i) {
      found.pairs.insert(found.pairs.end(), of_block[i].begin(), of_block[i].end());
      found.complete = found.pairs.size() <= most;
    }
    at_once = found.pairs.size() - before > FaceTree::kLeaf * count ? kFewest : std::min(2 * at_once, kMost);
    if (progress) progress->update(static_cast<double>(first + count) / static_cast<double>(near.group_count()));
  }
  if (!found.complete) found.pairs.resize(most);
  std::size_t compared = 0;
  const auto key = [](const glm::uvec2& pair) { return std::uint64_t{pair.x} << 32 | pair.y; };
  std::ranges::sort(found.pairs, [&](const glm::uvec2& a, const glm::uvec2& b) {
    poll_at(++compared);
    return key(a) < key(b);
  });
  return found;
}

}  // namespace tolvol
