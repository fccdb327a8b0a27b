// SPDX-License-Identifier: GPL-3.0-or-later
/// Bounds that another method decides about, so that benchmarks can run it in the same decimation.
#pragma once

#include <string>

#include "decimation/bounds.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// It is asked about one change after another: the decimation runs on one thread.
class RingCheck : public Bounds {
 public:
  /// Once, before the first trial: the mesh that is decimated, in the volume's frame. Its triangles are the elements of
  /// the changes. `mapping_error`: StoredSpace::mapping_error() of all that the questions may be about.
  virtual void begin(const TriangleMesh& mesh, double mapping_error) = 0;

  virtual std::string method() const = 0;
  /// What computes it: "CPU", or the name of a GL renderer.
  virtual std::string renderer() const { return "CPU"; }
};

}  // namespace tolvol
