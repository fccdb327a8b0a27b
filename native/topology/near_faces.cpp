// SPDX-License-Identifier: GPL-3.0-or-later
// The rule about faces with a common corner holds for degenerate ones, too: a segment from the hub that runs into a
// face either ends on it, or leaves it through the edge opposite the hub. A face of a crowd that has lost its hub has
// all of its corners in the tree, so that the hull of the hub and of its box is around it as well.
#include "topology/near_faces.h"

#include <map>
#include <numeric>

#include "base/call.h"

namespace tolvol {

std::vector<std::uint8_t> NearFaces::hubs_of(std::span<const glm::uvec3> triangles, std::size_t vertex_count) {
  std::vector<std::uint32_t> count(vertex_count, 0);
  std::uint32_t most = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    poll_at(i);
    for (int k = 0; k < 3; ++k) most = std::max(most, ++count[triangles[i][k]]);
  }
  std::vector<std::uint8_t> hubs;
  if (most < kHub) return hubs;
  hubs.reserve(triangles.size());
  for (const glm::uvec3& t : triangles) hubs.push_back(hub_of(t, [&](std::uint32_t v) { return count[v]; }));
  return hubs;
}

NearFaces::NearFaces(std::span<const std::uint32_t> faces, const std::function<Corners(std::size_t)>& corners,
                     std::span<const std::uint8_t> hubs, Team& team) {
  if (std::ranges::all_of(hubs, [](std::uint8_t corner) { return corner == kNoHub; })) {
    others_ = FaceTree(
        faces, [&](std::size_t i) { return box_of(corners(i)); }, team);
    return;
  }
  struct Group {
    std::uint32_t number;
    std::vector<std::uint32_t> faces{};
    std::vector<Box> rims{}, directions{};
  };
  const auto before = [](const glm::dvec3& a, const glm::dvec3& b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  };
  std::map<glm::dvec3, Group, decltype(before)> groups(before);
  Group rest{0};
  std::vector<Group*> group_of(faces.size(), &rest);
  corners_.reserve(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    poll_at(i);
    corners_.push_back(corners(i));
    const Corners& own = corners_.back();
    if (hubs[i] != kNoHub) group_of[i] = &groups.try_emplace(own[hubs[i]], Group{0}).first->second;
    group_of[i]->faces.push_back(faces[i]);
    group_of[i]->rims.push_back(hubs[i] == kNoHub ? box_of(own) : rim_of(own, own[hubs[i]]));
    if (hubs[i] != kNoHub) group_of[i]->directions.push_back(directions_of(own, own[hubs[i]]));
  }
  for (auto& [hub, group] : groups) {
    group.number = static_cast<std::uint32_t>(crowds_.size());
    crowds_.push_back({hub, group.faces, FaceTree(group.faces, group.rims, team),
                       FaceTree(group.faces, group.directions, team), group.faces.size()});
  }
  std::vector<std::uint32_t> numbers(crowds_.size());
  std::iota(numbers.begin(), numbers.end(), 0u);
  std::vector<Box> places;
  places.reserve(crowds_.size());
  for (const Crowd& crowd : crowds_) places.push_back(crowd.whole(crowd.rims.box()));
  places_ = FaceTree(numbers, places, team);
  rest.number = static_cast<std::uint32_t>(crowds_.size());
  others_ = FaceTree(rest.faces, rest.rims, team);
  faces_.assign(faces.begin(), faces.end());
  is_gone_.assign(faces.size(), false);
  for (std::uint32_t place = 0; place < faces.size(); ++place) {
    crowd_of_.push_back(group_of[place]->number);
    if (group_of[place] != &rest) crowded_.push_back(place);
  }
}

void NearFaces::change(std::uint32_t face, const Corners& corners) {
  const std::size_t place = crowds_.empty() ? 0 : place_of(face);
  if (crowds_.empty() || crowd_of_[place] == crowds_.size()) {
    others_.change(face, box_of(corners));
    return;
  }
  Crowd& crowd = crowds_[crowd_of_[place]];
  const bool strays = has_corner(corners_[place], crowd.hub) && !has_corner(corners, crowd.hub);
  corners_[place] = corners;
  if (is_gone_[place]) is_gone_[place] = false, ++crowd.alive;
  crowd.rims.change(face, rim_of(corners, crowd.hub));
  crowd.directions.change(face, directions_of(corners, crowd.hub));
  if (strays && 2 * ++crowd.strayed > crowd.alive) find_hub(crowd, corners);
  places_.change(crowd_of_[place], crowd.whole(crowd.rims.box()));
}

/// Takes the corner of a face to which most of the crowd have gone as its hub, if there is one. This costs about as
/// much as the changes that have led to it.
void NearFaces::find_hub(Crowd& crowd, const Corners& corners) {
  crowd.strayed = 0;
  for (const glm::dvec3& corner : corners) {
    std::size_t count = 0;
    for (const std::uint32_t face : crowd.faces) {
      const std::size_t place = place_of(face);
      count += !is_gone_[place] && has_corner(corners_[place], corner);
    }
    if (2 * count <= crowd.alive) continue;
    crowd.hub = corner;
    std::vector<std::uint32_t> faces;
    std::vector<Box> rims, directions;
    for (const std::uint32_t face : crowd.faces) {
      const std::size_t place = place_of(face);
      if (is_gone_[place]) continue;
      faces.push_back(face), rims.push_back(rim_of(corners_[place], corner));
      directions.push_back(directions_of(corners_[place], corner));
    }
    crowd.rims.change(faces, rims);
    crowd.directions.change(faces, directions);
    return;
  }
}

void NearFaces::remove(std::uint32_t face) {
  const std::size_t place = crowds_.empty() ? 0 : place_of(face);
  if (crowds_.empty() || crowd_of_[place] == crowds_.size()) {
    others_.change(face, Box());
    return;
  }
  Crowd& crowd = crowds_[crowd_of_[place]];
  if (!is_gone_[place]) is_gone_[place] = true, --crowd.alive;
  crowd.rims.change(face, Box());
  crowd.directions.change(face, Box());
  places_.change(crowd_of_[place], crowd.whole(crowd.rims.box()));
}

}  // namespace tolvol
