// SPDX-License-Identifier: GPL-3.0-or-later
/// Bounds that another method decides about, so that benchmarks can run it in the same decimation.
#pragma once

#include <string>

#include "check/bounds.h"
#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// The decimation runs on one thread, and asks it about one change after another.
class RingCheck : public Bounds {
 public:
  /// Is called once, before the first trial, with the mesh that is decimated, in the volume's frame. The triangles of
  /// the mesh are the elements of the changes. `space` is where their positions are stored.
  virtual void begin(const TriangleMesh& mesh, const StoredSpace& space) = 0;

  virtual std::string method() const = 0;
  /// The name of what computes the answers: "CPU", or a GL renderer.
  virtual std::string renderer() const { return "CPU"; }
};

}  // namespace tolvol
