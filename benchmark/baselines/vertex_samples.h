// SPDX-License-Identifier: GPL-3.0-or-later
/// The one-sided distance from the original vertices to the decimated mesh: L. Kobbelt, S. Campagna, H.-P. Seidel, A
/// general framework for mesh decimation, 1998. Every original vertex has a face that is within the tolerance of it; a
/// collapse must find a new one for those of the faces it changes. The rest of the reference, and the result's own
/// points, may be farther: the triangles between the vertices are never looked at.
///
/// In the paper the method runs with half-edge collapses (DecimationOptions::Placement::subset), and only the removed
/// vertices have a face. Here the surviving ones have a face, too. This costs nothing, because their distance is 0, and
/// lets them move.
#pragma once

#include <memory>
#include <optional>

#include "check/coverage.h"
#include "check/ring_check.h"

namespace tolvol::baselines {

class VertexSamples final : public RingCheck {
 public:
  /// `tolerance` is a length in the frame.
  explicit VertexSamples(double tolerance) : tolerance_(tolerance) {}

  void begin(const TriangleMesh& mesh, const StoredSpace& space) override;
  std::unique_ptr<Trial> trial() override;
  std::string method() const override { return "vertex_samples"; }

 private:
  class Asking;

  double tolerance_;
  TriangleMesh points_;  // It has a triangle for each vertex, with all corners there.
  std::optional<Coverage> samples_;
};

}  // namespace tolvol::baselines
