// SPDX-License-Identifier: GPL-3.0-or-later
/// The faces that a change of a mesh may come to meet, and whether the change would make new crossings with them: those
/// of the whole mesh, or those of a region's cell and near it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "decimation/bounded_mesh.h"
#include "decimation/change.h"
#include "topology/near_faces.h"
#include "topology/new_crossings.h"

namespace tolvol {

class Surroundings {
 public:
  /// The whole mesh, with the faces that never change. Keeps references to `mesh` and `crossings`.
  Surroundings(const BoundedMesh& mesh, NewCrossings& crossings, Team& team);
  /// A region: changes may put vertices strictly inside `cell` alone, and meet no faces but `faces`, which are in
  /// rising order. Keeps references to `mesh` and `crossings`.
  Surroundings(const BoundedMesh& mesh, NewCrossings& crossings, std::vector<std::uint32_t> faces, const Box& cell);

  /// Whether a change may put a vertex there.
  bool may_put(const VertexPosition& target) const { return strictly_inside(target.stored, cell_); }

  /// The corners of a face as it is now.
  Corners corners(std::uint32_t face) const { return crossings_.corners(face); }

  /// Takes all faces as they are now. O(n log n).
  void renew();

  /// What a try read, and its scratch; one for each thread.
  struct Trial {
    NewCrossings::Trial crossings;
    std::vector<NewCrossings::Face> faces;
    std::vector<NewCrossings::Removed> removed;
  };
  /// Whether a change makes no new crossing and no degenerate face, given the faces as they are now. Several threads
  /// may ask at once.
  bool allow(const Change& change, Trial& trial) const;
  /// The same for the faces and the removed faces that the trial names, for whatever reason they change.
  bool allow(Trial& trial) const { return crossings_.none(near_, trial.faces, trial.removed, trial.crossings); }
  /// The faces, in rising order, that the change may cross which the trial was asked about last, and that stay as they
  /// are.
  std::vector<std::uint32_t> faces_near(const Trial& trial) const {
    return crossings_.others_near(near_, trial.faces, trial.crossings);
  }
  /// Whether none of some faces that were changed on trust, as they are now, crosses others anew or is degenerate.
  bool allow(std::span<const std::uint32_t> changed) const { return crossings_.none(near_, changed); }
  /// Follows a change, which `trial` was asked about last, before it is carried out on the mesh. Returns a box around
  /// all that it changes: also around the faces that come to stand for others.
  Box follow(const Change& change, Trial& trial);
  /// The same for the faces and the removed faces that the trial names.
  Box follow(const Trial& trial);

 private:
  void renew(Team& team);
  void gather(const Change& change, Trial& trial) const;

  const BoundedMesh& mesh_;
  NewCrossings& crossings_;
  std::vector<std::uint32_t> faces_;
  Box cell_;
  NearFaces near_;
};

/// The faces that a change removes, and the faces that stand for them from then on.
void gather_removed(const Change& change, std::vector<NewCrossings::Removed>& removed);

}  // namespace tolvol
