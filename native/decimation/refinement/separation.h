// SPDX-License-Identifier: GPL-3.0-or-later
/// How a face has to stay on its side of a face of another sheet. It steers a Relaxation and proves nothing:
/// topology/faces_cross.h decides whether the two cross.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

#include "topology/faces_cross.h"

namespace tolvol {

/// A point of a face, by its barycentric coordinates, and the half-space in which it has to stay: all x with
/// dot(normal, x) >= offset.
struct Separation {
  glm::dvec3 weights;
  glm::dvec3 normal;  ///< a unit vector
  double offset;
};

/// The faces of a sheet.
struct Sheet {
  std::vector<Corners> faces;
  std::vector<Box> boxes;  ///< of the faces

  void add(const Corners& face) { faces.push_back(face), boxes.push_back(box_of(face)); }
};

/// Appends what holds a face on the side of `other` where its sheet is: the side of the point of `sheet` that is
/// nearest to the point of `other` nearest to the middle of `face`. There is no such side, and nothing is appended, if
/// the faces have a corner in common, if `other` is degenerate, or if the sheet is beside `other` rather than in front
/// of it or behind it. In the view along the normal of `other` the two faces overlap in a convex polygon, over which
/// the gap between them is linear, so that it is least at a corner of the polygon. Each corner where the gap is less
/// than `reach` gives a separation, at most 6. All are in the frame. About 30 ns if the two do not overlap in this
/// view, and 10 ns for each face of the sheet if they do. Returns the number of faces of the sheet that were measured.
std::size_t separate(const Corners& face, const Corners& other, const Sheet& sheet, double reach,
                     std::vector<Separation>& found);

}  // namespace tolvol
