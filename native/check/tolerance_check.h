// SPDX-License-Identifier: GPL-3.0-or-later
/// The question that every operation asks: are these pieces within the tolerance?
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "check/tolerance_volume.h"

namespace tolvol {

/// Verdicts are ordered: the verdict of a group is the least verdict of its pieces.
enum class Verdict : std::uint8_t {
  outside = 0,   ///< it is proved that some point is farther than the tolerance
  unproved = 1,  ///< neither was proved; this counts as outside wherever something is promised
  inside = 2,    ///< it is proved that every point is within the tolerance
};

/// Pieces of one array of points as they are stored.
struct Pieces {
  std::span<const glm::dvec3> points;
  StoredSpace space;                       ///< places the points in the world, or in any frame
  std::span<const std::uint32_t> indices;  ///< a piece has `corners` indices of points
  int corners = 3;                         ///< 1: points, 2: segments, 3: triangles, 4: quads in both triangulations
};

/// The places of a triangle's corners among the corners of its piece.
using PieceTriangle = std::array<std::uint8_t, 3>;

/// Returns the triangles as which a piece of 1 to 4 corners is checked. A point and a segment are degenerate triangles.
/// A quad is the four triangles of both of its triangulations.
std::span<const PieceTriangle> triangles_of(int corners);

/// Pieces in the frame of a volume, with the error that their placing makes.
struct PlacedPieces {
  /// Keeps a reference to the indices of `pieces`. Throws InvalidInput, naming the first offender, unless the pieces
  /// have 1 to 4 corners, their number is whole, every index has a point, every point is finite, and double precision
  /// can tell under the matrix where each used point is. A point that is certainly farther away than any tolerance is
  /// drawn nearer, to where it is still outside, so that its mapping error is not charged to the other points.
  PlacedPieces(const Pieces& pieces, const ToleranceVolume& volume);

  std::size_t size() const { return indices.size() / static_cast<std::size_t>(corners); }

  std::vector<glm::dvec3> points;
  std::vector<bool> used;  ///< tells which points the pieces use; the others are at the origin
  std::span<const std::uint32_t> indices;
  int corners;
  double mapping_error;  ///< StoredSpace::mapping_error() of the used points, except those that were drawn nearer
};

class ToleranceCheck {
 public:
  struct Options {
    unsigned threads = 0;
    Progress* progress = nullptr;
  };

  virtual ~ToleranceCheck() = default;
  /// A verdict for each piece. Throws InvalidInput for pieces that PlacedPieces refuses, and Cancelled.
  std::vector<Verdict> check(const Pieces& pieces, const Options& options) const;
  /// The same, but every piece gets the least verdict of the pieces with its label. Throws InvalidInput also unless
  /// there is a label for each.
  std::vector<Verdict> check_groups(const Pieces& pieces, std::span<const std::int32_t> groups,
                                    const Options& options) const;
  /// The name in reports. The name of a method whose verdicts are no proofs ends in "(not conservative)".
  virtual std::string method() const = 0;
  /// What computes the verdicts: "CPU", or the name of a GL renderer.
  virtual std::string renderer() const = 0;

 protected:
  /// Keeps a reference to `volume`, which must outlive this.
  explicit ToleranceCheck(const ToleranceVolume& volume) : volume_(&volume) {}
  const ToleranceVolume& volume() const { return *volume_; }

 private:
  virtual std::vector<Verdict> verdicts(const PlacedPieces& pieces, const Options& options) const = 0;
  /// Is given a label for each piece.
  virtual std::vector<Verdict> group_verdicts(const PlacedPieces& pieces, std::span<const std::int32_t> groups,
                                              const Options& options) const;

  const ToleranceVolume* volume_;
};

/// Gives every piece the least verdict of the pieces with the same label. Throws InvalidInput unless there is a label
/// for each.
void combine_groups(std::span<Verdict> verdicts, std::span<const std::int32_t> groups);

}  // namespace tolvol
