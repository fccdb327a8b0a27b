// SPDX-License-Identifier: GPL-3.0-or-later
/// The faces of a moving mesh by their boxes, to find those that one of them may meet. It differs from a FaceTree of
/// the boxes where very many faces share a vertex, a hub: their boxes all meet there, but two faces with a common
/// corner cross (topology/faces_cross.h) only if what of one is opposite the corner meets the other.
///
/// NearFaces does the same for faces that come and go, and knows hubs by their positions. Here a hub is a vertex, which
/// keeps its faces wherever it moves, so that a change needs no memory.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "geometry/triangle_mesh.h"
#include "topology/face_tree.h"
#include "topology/faces_apart.h"
#include "topology/faces_cross.h"

namespace tolvol {

/// In all calls `at(vertex)` is a box around all places where the vertex may be. Where it is another one than before,
/// all faces of the vertex have to be changed before the next search.
class MovingFaces {
  /// For search(): no hub tells of any faces that they are apart. It is first, because its type is deduced.
  static auto none_apart(const glm::dvec3&) {
    return [](const Box&) { return false; };
  }

 public:
  MovingFaces() = default;
  /// `faces` has `corners` indices, 3 or 4, for each face; keeps a reference to them. A face whose corners become
  /// others stays with the hub that it has now: this decides about time alone. O(n).
  MovingFaces(std::span<const std::uint32_t> faces, std::size_t corners, std::size_t vertex_count);

  /// A box around a face.
  template <class At>
  Box box(std::uint32_t face, At&& at) const {
    Box box;
    for (const std::uint32_t v : corners_of(face)) box.add(at(v));
    return box;
  }

  /// Takes the boxes of all faces, which has to come before all that follows. O(n log n).
  template <class At>
  void build(At&& at, Team& team);
  /// Takes another box of a face. O(log n). It never throws.
  template <class At>
  void change(std::uint32_t face, At&& at) {
    Group& group = groups_[group_of(face)];
    group.tree.change(face, rim(face, group.hub, at));
  }
  /// The same for many.
  template <class At>
  void change(std::span<const std::uint32_t> faces, At&& at);

  /// FaceTree::extent() of all.
  double extent() const;

  /// Calls visit(other) for all faces that the face may cross, and for itself: for all whose boxes meet its own, except
  /// for some that share a hub with it and do not cross it. A visit that returns false ends the search.
  template <class At, class Visit>
  void for_each_near(std::uint32_t face, At&& at, Visit&& visit) const {
    search(Shared::looked_at, none_apart, face, at, visit);
  }
  /// The same without the faces that are kept around a hub of this one. They share the hub with it if no face has come
  /// to have other corners.
  template <class At, class Visit>
  void for_each_near_elsewhere(std::uint32_t face, At&& at, Visit&& visit) const {
    search(Shared::left_out, none_apart, face, at, visit);
  }
  /// As for_each_near(face, at, visit), for a triangle with these corners, where `at` has all hubs at points. Those
  /// around a hub that are apart from it as seen from there are left out, too; so may be the face itself.
  template <class At, class Visit>
  void for_each_near(std::uint32_t face, const Corners& corners, At&& at, Visit&& visit) const {
    const auto apart_from = [&](const glm::dvec3& hub) {
      return [fan = ApartFromFan(corners, hub)](const Box& rims) { return fan.surely(rims); };
    };
    search(Shared::looked_at, apart_from, face, at, visit);
  }

 private:
  /// What becomes of the faces around a hub of the face itself.
  enum class Shared { looked_at, left_out };
  template <class Apart, class At, class Visit>
  void search(Shared shared, Apart&& apart_from, std::uint32_t face, At&& at, Visit&& visit) const;

  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  /// The faces around one hub, by the boxes of their corners beside the hub, or all faces without a hub.
  struct Group {
    std::uint32_t hub = kNone;
    FaceTree tree{};
    std::vector<std::uint32_t> faces{};  ///< in rising order
  };

  std::span<const std::uint32_t> corners_of(std::uint32_t face) const {
    return faces_.subspan(std::size_t{face} * corners_, corners_);
  }
  std::uint32_t group_of(std::uint32_t face) const { return group_of_.empty() ? 0 : group_of_[face]; }
  /// The box of the corners beside the hub; of all if the face does not have the hub, or nothing else.
  template <class At>
  Box rim(std::uint32_t face, std::uint32_t hub, At&& at) const {
    Box rim;
    for (const std::uint32_t v : corners_of(face)) {
      if (v != hub) rim.add(at(v));
    }
    return rim.empty() ? box(face, at) : rim;
  }
  template <class At>
  std::vector<Box> rims(std::span<const std::uint32_t> faces, std::uint32_t hub, At&& at) const {
    std::vector<Box> rims;
    rims.reserve(faces.size());
    for (const std::uint32_t f : faces) rims.push_back(rim(f, hub, at));
    return rims;
  }

  std::span<const std::uint32_t> faces_;
  std::size_t corners_ = 3;
  std::vector<Group> groups_;            // The first one has all faces without a hub.
  std::vector<std::uint32_t> group_of_;  // For each face; empty if there is no hub.
};

template <class At>
void MovingFaces::build(At&& at, Team& team) {
  for (Group& group : groups_) group.tree = FaceTree(group.faces, rims(group.faces, group.hub, at), team);
}

template <class At>
void MovingFaces::change(std::span<const std::uint32_t> faces, At&& at) {
  if (group_of_.empty()) {
    groups_.front().tree.change(faces, rims(faces, kNone, at));
    return;
  }
  std::vector<std::vector<std::uint32_t>> of_group(groups_.size());
  for (const std::uint32_t f : faces) of_group[group_of_[f]].push_back(f);
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    groups_[i].tree.change(of_group[i], rims(of_group[i], groups_[i].hub, at));
  }
}

/// `apart_from(hub)` tells of the box of faces' corners beside the hub whether they are surely apart from the face.
template <class Apart, class At, class Visit>
void MovingFaces::search(Shared shared, Apart&& apart_from, std::uint32_t face, At&& at, Visit&& visit) const {
  const Box own = box(face, at);
  bool more = true;
  const auto next = [&](std::uint32_t other) { return more = visit(other); };
  groups_.front().tree.for_each_meeting(own, next);
  for (std::size_t i = 1; i < groups_.size() && more; ++i) {
    const Group& group = groups_[i];
    const Box hub = at(group.hub);
    const auto whole = [&](Box rims) {
      rims.add(hub);
      return rims;
    };
    if (!meet(whole(group.tree.box()), own)) continue;
    const bool shares = std::ranges::find(corners_of(face), group.hub) != corners_of(face).end();
    if (shares && shared == Shared::left_out) continue;
    const Box opposite = shares ? rim(face, group.hub, at) : own;
    const auto apart = apart_from(hub.lower);
    group.tree.for_each_where(
        [&](const Box& rims) {
          if (rims.empty() || !(meet(whole(rims), opposite) || (shares && meet(rims, own)))) return false;
          return !apart(rims);
        },
        next);
  }
}

}  // namespace tolvol
