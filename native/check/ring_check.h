// SPDX-License-Identifier: GPL-3.0-or-later
/// What another method has to say about a collapse, so that benchmarks can run it in the same decimation.
#pragma once

#include <span>
#include <string>

#include "check/coverage.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class RingCheck {
 public:
  virtual ~RingCheck() = default;

  /// Once, before the first question: the mesh that is decimated, in the volume's frame. Its triangles are the elements
  /// of the questions. `mapping_error`: StoredSpace::mapping_error() of all that the questions may be about.
  virtual void begin(const TriangleMesh& mesh, double mapping_error) = 0;
  /// Whether the collapse that would leave `faces` (those with moved > 0 change) of the ring, and remove `removed`, may
  /// be carried out.
  virtual bool accepts(std::span<const Coverage::Element> faces, std::span<const Coverage::Removed> removed) = 0;
  /// The collapse asked about last, and accepted, is carried out.
  virtual void commit() {}

  virtual std::string method() const = 0;
  /// What computes it: "CPU", or the name of a GL renderer.
  virtual std::string renderer() const { return "CPU"; }
};

}  // namespace tolvol
