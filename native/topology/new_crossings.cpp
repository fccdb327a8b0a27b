// SPDX-License-Identifier: GPL-3.0-or-later
// Faces around one vertex all meet in it, so that their boxes tell none of them apart. Two of them cross elsewhere only
// if the edge of one that is opposite the vertex meets the other.
#include "topology/new_crossings.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "base/call.h"
#include "topology/faces_apart.h"
#include "topology/succession.h"

namespace tolvol {
namespace {

/// With more changed faces than this they are searched in a tree.
constexpr std::size_t kManyChanged = 48;
/// A change is refused where more pairs of input faces would have to be looked at to share them out.
constexpr std::size_t kMostPairs = 1 << 17;

/// A corner that all faces have.
std::optional<glm::dvec3> common_corner(std::span<const NewCrossings::Face> faces) {
  for (const glm::dvec3& corner : faces.front().corners) {
    if (std::ranges::all_of(faces, [&](const NewCrossings::Face& face) {
          return std::ranges::find(face.corners, corner) != face.corners.end();
        })) {
      return corner;
    }
  }
  return std::nullopt;
}

/// The faces of one change, to find those that others may cross.
struct Ring {
  std::span<const NewCrossings::Face> faces;
  std::span<const Box> boxes;
  const FaceTree& tree;  ///< of the faces, if there are many: by their rims if they have a hub
  const std::optional<glm::dvec3>& hub;

  /// Calls visit(i) for all that `own` crosses, and some others, until it returns false. Returns whether it never did.
  template <class Visit>
  bool for_each_near(const Corners& own, Visit&& visit) const {
    bool all = true;
    const auto next = [&](std::uint32_t i) { return all = visit(i); };
    if (faces.size() > kManyChanged && hub) {
      const ApartFromFan apart(own, *hub);
      tree.for_each_where([&](const Box& rims) { return !rims.empty() && !apart.surely(rims); }, next);
    } else if (faces.size() > kManyChanged) {
      tree.for_each_meeting(box_of(own), next);
    } else {
      const Box box = box_of(own);
      for (std::uint32_t i = 0; i < boxes.size() && all; ++i) {
        if (meet(box, boxes[i])) next(i);
      }
    }
    return all;
  }

  /// Calls visit(i, k) for the pairs that cross each other, until it returns false. Returns whether it never did. A
  /// pair may come twice.
  template <class Visit>
  bool for_each_crossing(Visit&& visit) const {
    const bool twice = faces.size() > kManyChanged;
    for (std::uint32_t i = 0; i < faces.size(); ++i) {
      if (twice) poll();
      const bool all = for_each_near(faces[i].corners, [&](std::uint32_t k) {
        return (twice ? k == i : k >= i) || !faces_cross(faces[i].corners, faces[k].corners) || visit(i, k);
      });
      if (!all) return false;
    }
    return true;
  }
};

}  // namespace

NewCrossings::NewCrossings(const MeshView& input, const MeshView& now, std::vector<Corners> fixed,
                           InputCrossings::FindNear find_near)
    : now_(now), input_(input, std::move(fixed), std::move(find_near)), origins_(input_.face_count()) {}

std::vector<std::uint32_t> NewCrossings::origins_of(std::uint32_t face, std::span<const Removed> removed) const {
  std::vector<std::uint32_t> found;
  const auto add = [&](std::uint32_t i) {
    found.push_back(i);
    return true;
  };
  origins_.for_each(face, add);
  for (const Removed& r : removed) {
    if (r.successor == face) origins_.for_each(r.id, add);
  }
  return found;
}

/// Whether both are of sheets that lie on each other, or input faces of both crossed.
bool NewCrossings::may_cross(std::uint32_t a, std::uint32_t b, std::span<const Removed> removed) const {
  return input_.are_of_one_sheet(a, b) || input_.any_crossed(origins_of(a, removed), origins_of(b, removed));
}

bool NewCrossings::none(const NearFaces& near, std::span<const Face> faces, std::span<const Removed> removed,
                        Trial& trial) const {
  Box all;
  trial.boxes_.clear(), trial.replaced_.clear(), trial.given_.clear();
  for (const Face& face : faces) {
    trial.boxes_.push_back(box_of(face.corners));
    all.add(trial.boxes_.back());
    trial.replaced_.push_back(face.id);
  }
  for (const Removed& r : removed) trial.replaced_.push_back(r.id);
  std::sort(trial.replaced_.begin(), trial.replaced_.end());
  trial.read_.add(all);
  if (faces.size() > kManyChanged) {
    std::vector<std::uint32_t> places(faces.size());
    std::iota(places.begin(), places.end(), 0u);
    Team alone(1);
    trial.hub_ = common_corner(faces);
    std::vector<Box> rims;
    for (const Face& face : faces)
      rims.push_back(trial.hub_ ? rim_of(face.corners, *trial.hub_) : box_of(face.corners));
    trial.ring_ = FaceTree(places, rims, alone);
  }
  const Ring ring{faces, trial.boxes_, trial.ring_, trial.hub_};

  for (const Face& face : faces) {
    if (is_degenerate(face.corners) && !is_degenerate(corners(face.id))) return false;
  }
  const auto crosses_any = [&](std::uint32_t other) {
    const Corners t = corners(other);
    return !ring.for_each_near(t, [&](std::uint32_t i) {
      return !faces_cross(faces[i].corners, t) || may_cross(faces[i].id, other, removed);
    });
  };
  const auto stays = [&](std::uint32_t other) {
    return !std::binary_search(trial.replaced_.begin(), trial.replaced_.end(), other);
  };
  const bool alone = ring.for_each_crossing(
      [&](std::uint32_t i, std::uint32_t k) { return may_cross(faces[i].id, faces[k].id, removed); });
  if (!alone) return false;
  if (trial.met_last_ != kNone && stays(trial.met_last_) && crosses_any(trial.met_last_)) {
    return share_out(near, faces, removed, trial);
  }
  trial.met_last_ = kNone;
  near.for_each_near(all, faces, [&](std::uint32_t other) {
    if (stays(other) && crosses_any(other)) trial.met_last_ = other;
    return trial.met_last_ == kNone;
  });
  return trial.met_last_ == kNone || share_out(near, faces, removed, trial);
}

std::vector<std::uint32_t> NewCrossings::others_near(const NearFaces& near, std::span<const Face> faces,
                                                     const Trial& trial) const {
  Box all;
  for (const Box& box : trial.boxes_) all.add(box);
  std::vector<std::uint32_t> found;
  near.for_each_near(all, faces, [&](std::uint32_t face) {
    if (!std::ranges::binary_search(trial.replaced_, face)) found.push_back(face);
    return true;
  });
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

/// Whether the input faces that the changed and the removed faces stand for can be shared out among the changed faces
/// so that every crossing is inherited, after one was found with `trial.met_last_` that is not. Notes in `trial` what
/// has to be given then.
bool NewCrossings::share_out(const NearFaces& near, std::span<const Face> faces, std::span<const Removed> removed,
                             Trial& trial) const {
  std::vector<std::uint32_t> of_met = origins_of(trial.met_last_, {});
  input_.keep_crossing(of_met);
  if (of_met.empty()) return false;    // as always in a mesh without crossings
  std::vector<std::uint32_t> members;  // input faces
  std::vector<std::uint32_t> holders;  // per member: the face that would stand for it
  std::vector<std::uint32_t> owners;   // per member: the place of that face in `faces`, or kOutside
  const auto add_all = [&](std::uint32_t face, std::uint32_t of, std::uint32_t owner) {
    std::vector<std::uint32_t> crossing = origins_of(face, {});
    input_.keep_crossing(crossing);
    for (const std::uint32_t i : crossing) members.push_back(i), holders.push_back(of), owners.push_back(owner);
  };
  for (std::uint32_t i = 0; i < faces.size(); ++i) add_all(faces[i].id, faces[i].id, i);
  for (const Removed& r : removed) {
    const auto at = std::ranges::find(faces, r.successor, &Face::id);
    add_all(r.id, r.successor,
            at == faces.end() ? Succession::kOutside : static_cast<std::uint32_t>(at - faces.begin()));
  }
  if (members.empty() || members.size() * of_met.size() > kMostPairs) return false;
  if (input_.which_crossed(members, of_met).empty()) return false;

  Succession succession(owners);
  const Ring ring{faces, trial.boxes_, trial.ring_, trial.hub_};
  ring.for_each_crossing([&](std::uint32_t i, std::uint32_t k) {
    if (input_.are_of_one_sheet(faces[i].id, faces[k].id)) return true;
    for (std::uint32_t a = 0; a < members.size(); ++a) {
      if (owners[a] != i) continue;
      for (std::uint32_t b = 0; b < members.size(); ++b) {
        if (owners[b] != k || !input_.crossed(members[a], members[b])) continue;
        succession.keep(a), succession.keep(b);
        return true;
      }
    }
    return true;  // they are inherited, so that this is not reached
  });
  std::size_t pairs = 0;
  for (const std::uint32_t other : others_near(near, faces, trial)) {
    const Corners t = corners(other);
    std::vector<std::uint32_t> crossing;
    ring.for_each_near(t, [&](std::uint32_t i) {
      if (faces_cross(faces[i].corners, t) && !input_.are_of_one_sheet(faces[i].id, other)) crossing.push_back(i);
      return true;
    });
    if (crossing.empty()) continue;
    std::vector<std::uint32_t> origins = origins_of(other, {});
    input_.keep_crossing(origins);
    pairs += origins.size() * members.size();
    if (pairs > kMostPairs) return false;
    const std::vector<std::uint32_t> of_other = input_.which_crossed(members, origins);
    if (of_other.empty()) return false;
    for (const std::uint32_t i : crossing) succession.need(i, of_other);
  }
  const std::optional<std::vector<std::uint32_t>> found = succession.find();
  if (!found) return false;
  for (std::size_t m = 0; m < members.size(); ++m) {
    if ((*found)[m] == owners[m]) continue;
    trial.given_.push_back({members[m], holders[m], faces[(*found)[m]].id});
  }
  return true;
}

bool NewCrossings::none(const NearFaces& near, std::span<const std::uint32_t> changed) const {
  return std::ranges::none_of(changed, [&](std::uint32_t face) {
    poll();
    const Corners own = corners(face);
    if (is_degenerate(own) && !is_degenerate(input_.corners(face))) return true;
    bool crosses = false;
    near.for_each_near(own, [&](std::uint32_t other) {
      crosses = other != face && faces_cross(own, corners(other)) && !may_cross(face, other, {});
      return !crosses;
    });
    return crosses;
  });
}

void NewCrossings::hand_over(std::span<const Removed> removed, std::span<const Given> given) {
  for (const Removed& r : removed) origins_.hand_over(r.id, r.successor);
  for (const Given& g : given) origins_.give(g.input_face, g.from, g.to);
}

}  // namespace tolvol
