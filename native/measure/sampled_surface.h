// SPDX-License-Identifier: GPL-3.0-or-later
/// Pieces that cover a surface, with bounds on their distances from another surface and the exact distance of one point
/// of each. They are cut where this sharpens the mean distance most.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/progress.h"
#include "geometry/frame.h"
#include "geometry/hierarchy.h"
#include "geometry/triangle_mesh.h"
#include "measure/deviation.h"
#include "measure/distribution.h"
#include "measure/placed_pair.h"
#include "measure/sampled_piece.h"
#include "measure/side.h"

namespace tolvol {

/// A range of the mean that is no wider than this, in the frame, is rounding.
inline constexpr double kRangeNoise = 256 * kUnitRoundoff;

class SampledSurface {
 public:
  /// Cuts pair.a into pieces. `world_b` is the mesh that pair.b is a part of. Keeps a reference to the progress.
  SampledSurface(const PlacedPair& pair, const TriangleMesh& world_b, const DeviationOptions& options);

  /// Measures all pieces, and cuts the worst of them until there is nothing more to gain or to spend. Throws Cancelled.
  /// About 2 to 15 us a piece.
  void measure();

  const std::vector<SampledPiece>& pieces() const { return pieces_; }
  std::size_t steps() const { return steps_; }
  bool has_sides() const { return sides_.known(); }
  double spacing() const {
    if (measure_ == kNumber) return 0;
    const double each = total_.value() / double(pieces_.size());
    return measure_ == kArea ? std::sqrt(each) : each;
  }

 private:
  /// Computes the bounds and points of these pieces, the first of which has the number `first`. Returns how many pieces
  /// it did. If all steps are used up it stops, or bounds the other pieces loosely if it must do `all`.
  std::size_t evaluate(std::span<SampledPiece> pieces, std::size_t first, bool all);
  /// Cuts the worst pieces. Returns false if there is nothing more to gain or to spend.
  bool refine();
  template <class Visit>
  void halve(const SampledPiece& piece, Visit&& visit) const;

  const TriangleMesh b_;
  Hierarchy hierarchy_;
  SideOf sides_;
  unsigned threads_;
  Progress* progress_;
  Measure measure_ = kNumber;
  Sum total_;
  std::size_t budget_ = 0, steps_ = 0, most_steps_ = 0;
  std::vector<SampledPiece> pieces_;
};

}  // namespace tolvol
