// SPDX-License-Identifier: GPL-3.0-or-later
/// Keeps a mesh that others edit inside a tolerance volume, edit by edit: a sculpting session asks it after each dab.
/// An edit costs the work on the faces that it touches, and a comparison of all positions with the last ones.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "check/tolerance_volume.h"
#include "motion/constrain.h"
#include "motion/pull_back.h"

namespace tolvol {

class Guard {
 public:
  struct Options {
    Outside outside = Outside::error;                            ///< See ConstrainOptions.
    bool two_sided = true;                                       ///< See ConstrainOptions.
    PullBack::Crossings crossings = PullBack::Crossings::allow;  ///< Relative to the last start.
    double max_normal_angle = 90;                                ///< See ConstrainOptions.
    unsigned threads = 0;                                        ///< 0 is one for each core.
    Progress* progress = nullptr;                                ///< The progress of the construction alone.
  };

  /// The vertices that constrain() moved back, ascending, and their new positions, three coordinates each.
  struct Correction {
    std::vector<std::uint32_t> vertices;
    std::vector<float> positions;
  };

  /// `positions`: three float32 coordinates a vertex, local, as Blender stores them. `faces`: `corners` indices a face,
  /// as in Pieces. Keeps a reference to `volume`. Throws InvalidInput like constrain(); Cancelled. About 1 us a vertex;
  /// holds about 150 bytes a vertex and 60 a triangle, 100 a triangle more where an angle is kept, and where crossings
  /// are kept out 72 and 130 more.
  Guard(std::span<const float> positions, std::vector<std::uint32_t> faces, int corners, const glm::dmat4& to_world,
        const ToleranceVolume& volume, const Options& options);
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

  /// Takes the mesh as it was edited since the last call: what is inside is the new state, the rest is pulled back
  /// along its motion since then, as by constrain(); going back to an earlier state by undo is an edit like others.
  /// Throws InvalidInput for another number of vertices or a moved one that is not finite, and Cancelled; both keep the
  /// state.
  Correction constrain(std::span<const float> positions);

  /// Starts anew from these positions, whatever came before. Throws like the constructor, keeping the state; the next
  /// call then starts from it.
  void reset(std::span<const float> positions, Progress* progress = nullptr);

  /// Takes other faces on the same vertices, as many and with as many corners, where polygons are triangulated in
  /// another way now. Those that differ have to be inside, to keep the angle and to cross no face, and no part of the
  /// reference may lose its last witness. They may not replace faces that since the start have been outside, exceeding,
  /// without a sure normal or nearest to an uncovered part of the reference. Returns the faces for which this does not
  /// hold, ascending; the guard takes the faces only if there are none. Throws InvalidInput for other faces, also for
  /// one that repeats other corners than before, and Cancelled; both keep the faces. Costs about 50 ns a face of the
  /// mesh, and as much as the constructor for the faces that differ.
  std::vector<std::uint32_t> replace_faces(std::vector<std::uint32_t> faces, Progress* progress = nullptr);

  std::size_t vertex_count() const { return last_.size() / 3; }
  int corners() const { return corners_; }                 ///< of a face
  const PullBack::Start& start() const { return start_; }  ///< What the last start found.

 private:
  void begin(std::span<const float> positions, Progress* progress);
  void resume();
  void require_size(std::span<const float> positions) const;
  std::vector<std::uint32_t> changed(std::span<const float> positions) const;

  bool interrupted_ = false;  // An exception has ended a call: last_ holds the state, and pull_back_ may not.
  std::vector<std::uint32_t> faces_;
  int corners_;
  std::vector<float> last_;  // The state, as it is stored.
  Options options_;
  PullBack pull_back_;  // It refers to the elements of faces_.
  PullBack::Start start_;
};

}  // namespace tolvol
