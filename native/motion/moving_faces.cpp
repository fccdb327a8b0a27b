// SPDX-License-Identifier: GPL-3.0-or-later
// The rule about faces with a common corner holds for quads, too: a triangle of a quad that does not have the hub lies
// in the box of the quad's other corners.
#include "motion/moving_faces.h"

#include "base/call.h"
#include "topology/near_faces.h"

namespace tolvol {

MovingFaces::MovingFaces(std::span<const std::uint32_t> faces, std::size_t corners, std::size_t vertex_count)
    : faces_(faces), corners_(corners), groups_(1) {
  const std::size_t face_count = faces.size() / corners;
  std::vector<std::uint32_t> count(vertex_count, 0), group_of_hub(vertex_count, kNone);
  for (std::size_t i = 0; i < faces.size(); ++i) poll_at(i), ++count[faces[i]];
  const bool any = std::ranges::any_of(count, [](std::uint32_t n) { return n >= NearFaces::kHub; });
  if (any) group_of_.reserve(face_count);
  for (std::uint32_t f = 0; f < face_count; ++f) {
    poll_at(f);
    const std::uint32_t hub = *std::ranges::max_element(corners_of(f), {}, [&](std::uint32_t v) { return count[v]; });
    std::uint32_t group = 0;
    if (count[hub] >= NearFaces::kHub) {
      group = group_of_hub[hub];
      if (group == kNone) {
        group = group_of_hub[hub] = static_cast<std::uint32_t>(groups_.size());
        groups_.push_back({hub});
      }
    }
    groups_[group].faces.push_back(f);
    if (any) group_of_.push_back(group);
  }
}

double MovingFaces::extent() const {
  double extent = 0;
  for (const Group& group : groups_) extent += group.tree.extent();
  return extent;
}

}  // namespace tolvol
