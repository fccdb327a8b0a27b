// SPDX-License-Identifier: GPL-3.0-or-later
/// Closes the holes of a mesh that are smaller than the tolerance.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "check/tolerance_volume.h"
#include "repair/loop_outcome.h"

namespace tolvol {

struct CloseHolesOptions {
  /// The largest length of a boundary loop that is closed, in world units.
  std::optional<double> largest_perimeter = {};
  /// In degrees, more than 0 and at most 180: every point of a new face has a witness within the tolerance whose normal
  /// is within this angle of the face's (check/facing.h). The end of a tube is at right angles to the tube, so that a
  /// limit of 90 would leave it to rounding. 180 keeps no angle.
  double max_normal_angle = 120;
  /// For each vertex, from 0 to 1; may be empty. A new face stays within the least share of the tolerance of its
  /// corners, and there is none at a vertex of share 0.
  std::span<const double> shares = {};
  unsigned threads = 0;  ///< 0 is one for each core. It never changes the result.
  Progress* progress = nullptr;
};

/// The most corners of a loop that is filled: the work on a loop grows with the third power of its corners.
inline constexpr std::size_t kMostLoopCorners = 1000;

struct HoleClosingResult {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  struct Loop {
    LoopOutcome outcome = LoopOutcome::closed;
    std::uint32_t vertex = 0;  ///< where its first edge begins
    std::size_t corners = 0;   ///< the number of its edges
    double perimeter = 0;      ///< in world units
    glm::dvec3 centre{0};      ///< the mean of its corners in the world
  };
  std::vector<Loop> loops;
  /// The input's triangles and after them the new ones, loop by loop.
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> loop;  ///< for each new triangle: its loop
  /// For each side of each new triangle, from corner k to the next: the input triangle that it closes on, or kNone
  /// where another new triangle is.
  std::vector<glm::uvec3> borders;
  /// For each corner of each new triangle: a corner of an input triangle at the rim there, as 3 * triangle + corner, of
  /// the triangle that the new one closes on if there is one. Attributes may be taken from there.
  std::vector<glm::uvec3> corner_source;
  std::vector<std::string> warnings;

  /// The number of loops with this outcome.
  std::size_t count(LoopOutcome outcome) const;
};

/// Fills every boundary loop (topology/boundary_loops.h) that can be filled with triangles between its corners, each
/// within the tolerance of the reference with the headroom that operations leave, facing as the reference does there,
/// neither degenerate nor crossing any other face, so that no edge gets more than two triangles. A loop is filled as a
/// whole or not at all, in the orientation of its rim. Of the triangulations whose triangles keep these bounds one by
/// one it takes the least (repair/least_triangulation.h). Where these cross a face, the next search goes around that
/// face, and where two of them cross each other, or lie on one edge, it goes without one of them: 40 searches at most,
/// and 9 in a loop of more than 200 corners. A loop is given up after these, once 50,000 triangles were refused, or
/// once its share of the steps is used up that all proofs together may take: 100 million, and at least 10 million for
/// each loop. Loops are filled as if they were alone; then each whose faces are in conflict with those of a loop of
/// lower number is filled anew around those, if possible.
///
/// No vertex moves and none is added, and every input triangle keeps its number. Because the input stays, the reference
/// is as near to the result as it is to the input. Throws InvalidInput for a bad mesh, and where the stored type cannot
/// hold the tolerance; Cancelled. 1 us a triangle. A search for the filling of a loop of n corners takes about
/// 5 ns * n^3 / 6. First a triangulation is found and its n - 2 triangles are proved afterwards; mostly one such search
/// is enough. Otherwise a search takes n^2 / 2 certificates, but n^3 / 6 where nearly all triangles are refused
/// although their edges are admitted, as around an island in a hole. A certificate takes 1 us, and milliseconds among
/// needles.
HoleClosingResult close_holes(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                              const StoredSpace& space, const ToleranceVolume& volume,
                              const CloseHolesOptions& options = {});

}  // namespace tolvol
