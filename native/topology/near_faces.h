// SPDX-License-Identifier: GPL-3.0-or-later
/// The faces that some faces may cross, while faces change and vanish. It differs from a FaceTree of their boxes where
/// very many faces meet in one corner: the boxes of all of them meet there, but two faces with a common corner cross
/// (topology/faces_cross.h) only if the edge of one that is opposite the corner meets the other, and few of them do not
/// lie beside each other as seen from the corner.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "geometry/triangle_mesh.h"
#include "topology/face_tree.h"
#include "topology/faces_apart.h"
#include "topology/faces_cross.h"

namespace tolvol {

class NearFaces {
 public:
  /// A corner that at least so many faces share is a hub.
  static constexpr std::uint32_t kHub = 256;
  static constexpr std::uint8_t kNoHub = 3;

  NearFaces() = default;
  /// `faces` are the numbers of the faces, in rising order, and corners(i), which may be asked for twice, the corners
  /// of faces[i]. `hubs` has for each the corner that is a hub, or kNoHub; if none has one it may be empty. Which
  /// corners count as hubs decides about time alone. O(n log n), as a FaceTree, and twice as much for faces at hubs.
  NearFaces(std::span<const std::uint32_t> faces, const std::function<Corners(std::size_t)>& corners,
            std::span<const std::uint8_t> hubs, Team& team);

  /// The corner of a triangle that is a hub, the one with the most faces, or kNoHub. `faces_at` tells how many faces a
  /// vertex has.
  template <class FacesAt>
  static std::uint8_t hub_of(const glm::uvec3& triangle, FacesAt&& faces_at) {
    std::uint8_t hub = kNoHub;
    std::uint32_t most = kHub - 1;
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t count = faces_at(triangle[k]);
      if (count > most) most = count, hub = k;
    }
    return hub;
  }
  /// The same for all triangles of a mesh, by the vertices that their corners name; empty if there is none.
  static std::vector<std::uint8_t> hubs_of(std::span<const glm::uvec3> triangles, std::size_t vertex_count);

  /// Gives a face of the constructor's other corners, or removes it. O(log n).
  void change(std::uint32_t face, const Corners& corners);
  void remove(std::uint32_t face);

  /// Calls visit(face) for all faces that one of `own` crosses, and for some others whose boxes meet. `all` is a box
  /// around `own`, whose elements have a member `corners`. A visit that returns false ends the search. Which faces a
  /// search finds depends on `own` and the faces alone; their order also depends on those that the trees were built
  /// with.
  template <class Faces, class Visit>
  void for_each_near(const Box& all, const Faces& own, Visit&& visit) const;
  /// The same near one face.
  template <class Visit>
  void for_each_near(const Corners& own, Visit&& visit) const {
    struct Own {
      Corners corners;
    };
    for_each_near(box_of(own), std::array{Own{own}}, visit);
  }

  /// The number of groups into which for_each_pair() divides the faces: a leaf of a FaceTree, or one face at a hub.
  std::size_t group_count() const { return others_.leaf_count() + crowded_.size(); }
  /// Calls visit(a, b) for all pairs of faces that cross, and for some others whose boxes meet: over all groups once
  /// for each pair. A visit that returns false ends the search of the group. No face may have been changed or removed.
  template <class Visit>
  void for_each_pair(std::size_t group, Visit&& visit) const;

 private:
  /// Of at most so many faces each is asked whether it is apart from faces around a hub.
  static constexpr std::size_t kFew = 32;

  /// The faces around one hub, by the boxes of their corners beside the hub, and by those of the directions in which
  /// these are seen from there. A box around a long rim that runs aslant is seen in many more directions than the rim.
  struct Crowd {
    glm::dvec3 hub;
    std::vector<std::uint32_t> faces;  ///< in rising order; those that were removed stay
    FaceTree rims, directions;
    std::size_t alive;        ///< the number of faces that were not removed
    std::size_t strayed = 0;  ///< how many have left the hub since it was last looked for

    /// A box around faces whose rims are in a box.
    Box whole(Box box) const {
      box.add(hub);
      return box;
    }
  };

  static bool has_corner(const Corners& corners, const glm::dvec3& p) {
    return corners[0] == p || corners[1] == p || corners[2] == p;
  }
  void find_hub(Crowd& crowd, const Corners& corners);

  std::size_t place_of(std::uint32_t face) const {
    return static_cast<std::size_t>(std::lower_bound(faces_.begin(), faces_.end(), face) - faces_.begin());
  }

  FaceTree others_;  ///< all faces without a hub
  std::vector<Crowd> crowds_;
  FaceTree places_;  ///< of the crowds: the box around the faces of each
  // These are empty if there is no crowd.
  std::vector<std::uint32_t> faces_;     ///< in rising order
  std::vector<std::uint32_t> crowd_of_;  ///< for each of faces_; crowds_.size() for one without a hub
  std::vector<Corners> corners_;         ///< for each of faces_ that is in a crowd
  std::vector<bool> is_gone_;            ///< for each of faces_ that is in a crowd
  std::vector<std::uint32_t> crowded_;   ///< the places in faces_ of those in a crowd
};

template <class Visit>
void NearFaces::for_each_pair(std::size_t group, Visit&& visit) const {
  if (group < others_.leaf_count()) {
    others_.for_each_pair(group, visit);
    return;
  }
  const std::uint32_t place = crowded_[group - others_.leaf_count()], own = faces_[place];
  for_each_near(corners_[place], [&](std::uint32_t other) {
    const bool is_for_other = crowd_of_[place_of(other)] < crowds_.size() && other <= own;
    return is_for_other || visit(own, other);
  });
}

template <class Faces, class Visit>
void NearFaces::for_each_near(const Box& all, const Faces& own, Visit&& visit) const {
  bool more = true;
  const auto next = [&](std::uint32_t face) { return more = visit(face); };
  others_.for_each_meeting(all, next);
  if (!more) return;
  places_.for_each_meeting(all, [&](std::uint32_t number) {
    const Crowd& crowd = crowds_[number];
    Box sharing, opposite, strange;  // Of those of `own` that share the hub, of their rims, and of the rest.
    for (const auto& face : own) {
      if (has_corner(face.corners, crowd.hub)) {
        sharing.add(box_of(face.corners)), opposite.add(rim_of(face.corners, crowd.hub));
      } else {
        strange.add(box_of(face.corners));
      }
    }
    Box first = opposite;
    first.add(strange);
    std::vector<ApartFromFan> apart;
    if (own.size() <= kFew) {
      for (const auto& face : own) apart.emplace_back(face.corners, crowd.hub);
    }
    const auto may_cross = [&](const Box& rims) {
      if (rims.empty() || !(meet(crowd.whole(rims), first) || meet(rims, sharing))) return false;
      return apart.empty() || !std::ranges::all_of(apart, [&](const ApartFromFan& a) { return a.surely(rims); });
    };
    if (apart.empty() || !std::ranges::all_of(apart, &ApartFromFan::looks_by_directions)) {
      crowd.rims.for_each_where(may_cross, next);
      return more;
    }
    crowd.directions.for_each_where(
        [&](const Box& directions) {
          return !directions.empty() &&
                 !std::ranges::all_of(apart, [&](const ApartFromFan& a) { return a.surely_seen(directions); });
        },
        [&](std::uint32_t face) { return !may_cross(rim_of(corners_[place_of(face)], crowd.hub)) || next(face); });
    return more;
  });
}

}  // namespace tolvol
