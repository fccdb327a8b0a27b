// SPDX-License-Identifier: GPL-3.0-or-later
/// The promise that a changing mesh gets no new crossings: two faces may cross (topology/faces_cross.h) only where
/// input faces that they stand for (topology/face_origins.h) crossed. As every input face is stood for by one face, the
/// number of pairs of faces that cross never rises, and a mesh without crossings stays without.
///
/// The sheets of a double sheet (topology/double_sheets.h) are exempt from each other: they touch in all their points,
/// and could not change one after the other. Pairs of their faces may become more. A face is of the sheet that it was
/// of as it came in, whatever else it stands for.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.h"
#include "topology/face_origins.h"
#include "topology/face_tree.h"
#include "topology/faces_cross.h"
#include "topology/input_crossings.h"
#include "topology/near_faces.h"

namespace tolvol {

class NewCrossings {
 public:
  /// `input` and `now` are the mesh as it came in and as it is, with the same numbers of faces; positions are as they
  /// are stored. Both are read whenever something is asked. `fixed` are further faces, which never change; their
  /// numbers follow on the others'. `find_near` finds faces of the input (topology/input_crossings.h). O(n).
  NewCrossings(const MeshView& input, const MeshView& now, std::vector<Corners> fixed,
               InputCrossings::FindNear find_near = {});

  /// A face as a change would leave it, with another shape than now.
  struct Face {
    std::uint32_t id;
    Corners corners;
  };
  /// A face that a change removes, and the face that stands for it from then on.
  struct Removed {
    std::uint32_t id, successor;
  };
  /// An input face that another face stands for after a change: `to` instead of `from`, which may be the successor of a
  /// removed face.
  struct Given {
    std::uint32_t input_face, from, to;
  };
  /// What a try read, and its scratch; one for each thread.
  class Trial {
   public:
    /// Starts a series of tries around one place.
    void begin() { read_ = {}, met_last_ = kNone; }
    /// What the series found depends on no face outside this box.
    const Box& read() const { return read_; }
    /// What the change that was asked about last, and may be carried out, has to give.
    std::span<const Given> given() const { return given_; }

   private:
    friend class NewCrossings;
    Box read_;
    std::vector<Box> boxes_;
    FaceTree ring_;  ///< of the changed faces by their places in the change, if there are many; by their rims at a hub
    std::optional<glm::dvec3> hub_;        ///< a corner that all changed faces have, if there are many
    std::vector<std::uint32_t> replaced_;  ///< sorted
    std::uint32_t met_last_ = kNone;       ///< the face that was in the way last, which likely still is
    std::vector<Given> given_;
  };

  /// Whether the mesh would have no new crossing if `faces` replaced those of the same number and `removed` were gone,
  /// and no face would become degenerate. `near` has to have every face whose box meets those of `faces`. Only reads;
  /// several threads may ask at once. About 5 us for the faces around a vertex, and O(n log n) where n faces around a
  /// vertex lie about it like a fan.
  bool none(const NearFaces& near, std::span<const Face> faces, std::span<const Removed> removed, Trial& trial) const;

  /// The faces that those of a change may cross, which none() was asked about last with this trial, and that stay as
  /// they are. They are in rising order: that of a search depends on which corners counted as hubs when the tree was
  /// built, and no result may depend on that.
  std::vector<std::uint32_t> others_near(const NearFaces& near, std::span<const Face> faces, const Trial& trial) const;

  /// The same of changes that were carried out on trust: whether none of the `changed` faces, as they are now, is
  /// degenerate or crosses any face anew. `near` has to have every face that meets them, as it is now. Several threads
  /// may ask at once. About 3 us a face.
  bool none(const NearFaces& near, std::span<const std::uint32_t> changed) const;

  /// After a change was carried out, with what none() found that it has to give.
  void hand_over(std::span<const Removed> removed, std::span<const Given> given = {});

  /// For those who put faces back.
  FaceOrigins& origins() { return origins_; }

  Corners corners(std::uint32_t face) const {
    return face < now_.triangles.size() ? now_.corners(face) : input_.corners(face);
  }
  /// The fixed faces among them.
  std::size_t face_count() const { return input_.face_count(); }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  std::vector<std::uint32_t> origins_of(std::uint32_t face, std::span<const Removed> removed) const;
  bool may_cross(std::uint32_t a, std::uint32_t b, std::span<const Removed> removed) const;
  bool share_out(const NearFaces& near, std::span<const Face> faces, std::span<const Removed> removed,
                 Trial& trial) const;

  MeshView now_;
  InputCrossings input_;
  FaceOrigins origins_;
};

}  // namespace tolvol
