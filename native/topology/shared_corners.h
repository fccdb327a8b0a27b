// SPDX-License-Identifier: GPL-3.0-or-later
/// The corners that two triangles share: those with the same coordinates.
#pragma once

#include <array>
#include <utility>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// The pairs of equal corners, which are at most three. Each corner of the first triangle is in one pair at most.
struct SharedCorners {
  int count = 0;
  std::array<std::pair<int, int>, 3> at{};
};

inline SharedCorners shared_corners(const Corners& a, const Corners& b) {
  SharedCorners shared;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      if (a[i] != b[k]) continue;
      shared.at[shared.count++] = {i, k};
      break;
    }
  }
  return shared;
}

}  // namespace tolvol
