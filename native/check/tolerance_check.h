// SPDX-License-Identifier: GPL-3.0-or-later
/// The question every operation asks: are these pieces within the tolerance?
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

/// Ordered: the verdict of a group is the least of its pieces.
enum class Verdict : std::uint8_t {
  outside = 0,   ///< proved: some point is farther than the tolerance
  unproved = 1,  ///< neither was proved; counts as outside wherever something is promised
  inside = 2,    ///< proved: every point is within the tolerance
};

/// Pieces of one array of points, all in the volume's frame.
struct Pieces {
  std::span<const glm::dvec3> points;
  std::span<const std::uint32_t> indices;  ///< `corners` a piece
  int corners = 3;                         ///< 1 point, 2 segment, 3 triangle, 4 quad in both of its triangulations
  double mapping_error = 0;                ///< StoredSpace::mapping_error() of the points

  std::size_t size() const { return indices.size() / static_cast<std::size_t>(corners); }
};

/// The places of a triangle's corners among the corners of its piece.
using PieceTriangle = std::array<std::uint8_t, 3>;

/// The triangles that a piece of 1 to 4 corners is checked as: a point and a segment as degenerate triangles, a quad as
/// the four triangles of both of its triangulations.
std::span<const PieceTriangle> triangles_of(int corners);

/// Points as they are stored, placed in the frame of a volume for a check.
struct PlacedPoints {
  /// Throws InvalidInput, naming the first offender, for a point that is not finite, and for one of which double
  /// precision cannot tell under its matrix where it is. Points that are certainly farther away than any tolerance are
  /// drawn near to where they are still outside, so that what mapping costs them is not charged to the others.
  PlacedPoints(std::span<const glm::dvec3> stored, const StoredSpace& space, const ToleranceVolume& volume);

  std::vector<glm::dvec3> points;
  double mapping_error;  ///< of all but those
};

class ToleranceCheck {
 public:
  struct Options {
    unsigned threads = 0;
    Progress* progress = nullptr;
  };

  virtual ~ToleranceCheck() = default;
  /// A verdict for each piece. Throws InvalidInput for pieces that are not valid, Cancelled.
  virtual std::vector<Verdict> check(const Pieces& pieces, const Options& options) const = 0;
  /// The same, but every piece gets the least verdict of the pieces with its label. Throws InvalidInput also unless
  /// there is a label for each.
  virtual std::vector<Verdict> check_groups(const Pieces& pieces, std::span<const std::int32_t> groups,
                                            const Options& options) const;
  /// As reports name it; one whose verdicts are no proofs says "(not conservative)".
  virtual std::string method() const = 0;
  /// What computed it: "CPU", or the name of a GL renderer.
  virtual std::string renderer() const = 0;
};

/// Throws InvalidInput, naming the first offender, unless there are 1 to 4 corners, a whole number of pieces, and a
/// point for every index.
void require_valid(const Pieces& pieces);

/// Gives every piece the least verdict of the pieces with the same label. Throws InvalidInput unless there is a label
/// for each.
void combine_groups(std::span<Verdict> verdicts, std::span<const std::int32_t> groups);

}  // namespace tolvol
