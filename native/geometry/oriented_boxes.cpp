// SPDX-License-Identifier: GPL-3.0-or-later
// The axes are chosen as by T. Larsson, L. Kallberg, Fast Computation of Tight-Fitting Oriented Bounding Boxes, 2011:
// from the most distant points, here of one edge, and from the point that is farthest from their line.
//
// The margins are as follows. An axis is shortened by kShorter before its coordinates are rounded to float, so that the
// three axes together lengthen no vector: a length measured along them is at most the true length. The products are in
// double. For |x| <= 2 their sums are off by less than 1e-15, and for any p by less than 1e-15 of its largest
// coordinate. kSlack covers both. The faces of the boxes are rounded outwards by more than the rounding to float.
#include "geometry/oriented_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/call.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

constexpr double kShorter = 3e-7;  // shortens an axis, which rounding its coordinates lengthens by at most 1.1e-7
constexpr double kSlack = 4e-15;
constexpr double kShortest = 1e-200;  // an edge of a smaller square has no direction, because of subnormal numbers
constexpr double kNarrowest = 1e-20;  // below this squared ratio to the longest edge, the direction across is rounding
constexpr float kInfinity = std::numeric_limits<float>::infinity();

glm::dvec3 any_perpendicular(const glm::dvec3& d) {
  const glm::dvec3 a = glm::abs(d);
  return glm::cross(d, a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                       : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                : glm::dvec3(0, 0, 1));
}

}  // namespace

OrientedBoxes::OrientedBoxes() {
  std::fill_n(&axis_[0][0][0], 9 * kWidth, 0.0f);
  std::fill_n(&lower_[0][0], 3 * kWidth, kInfinity);
  std::fill_n(&upper_[0][0], 3 * kWidth, -kInfinity);
}

template <std::size_t kCorners>
double OrientedBoxes::fit(int i, std::span<const std::array<glm::dvec3, kCorners>> faces, const glm::dvec3& centre,
                          double room) {
  // This polls at n + 1, because most calls have a few triangles and need no poll.
  glm::dvec3 along(1, 0, 0), start(faces[0][0]);
  double longest = kShortest;
  for (std::size_t n = 0; n < faces.size(); ++n) {
    poll_at(n + 1);
    const std::array<glm::dvec3, kCorners>& face = faces[n];
    for (std::size_t k = 0; k < kCorners; ++k) {
      const glm::dvec3 edge = face[(k + 1) % kCorners] - face[k];
      const double squared = glm::dot(edge, edge);
      if (squared > longest) longest = squared, along = edge, start = face[k];
    }
  }
  along = glm::normalize(along);
  glm::dvec3 across = any_perpendicular(along);
  double farthest = kNarrowest * longest;
  for (std::size_t n = 0; n < faces.size(); ++n) {
    poll_at(n + 1);
    for (const glm::dvec3& corner : faces[n]) {
      const glm::dvec3 off = corner - start, sideways = off - along * glm::dot(off, along);
      const double squared = glm::dot(sideways, sideways);
      if (squared > farthest) farthest = squared, across = sideways;
    }
  }
  across = glm::normalize(across);
  across = glm::normalize(across - along * glm::dot(across, along));  // rounding made it lean by up to 1e-6
  const glm::dvec3 axis[3] = {along, across, glm::cross(along, across)};
  for (int k = 0; k < 3; ++k) {
    glm::dvec3 stored;
    for (int j = 0; j < 3; ++j) stored[j] = axis_[k][j][i] = static_cast<float>(axis[k][j] * (1 - kShorter));
    double lower = std::numeric_limits<double>::infinity(), upper = -lower;
    for (std::size_t n = 0; n < faces.size(); ++n) {
      poll_at(n + 1);
      for (const glm::dvec3& corner : faces[n]) {
        const double x = glm::dot(stored, corner - centre);
        lower = std::min(lower, x), upper = std::max(upper, x);
      }
    }
    lower_[k][i] = std::nextafter(static_cast<float>(lower - room - kSlack), -kInfinity);
    upper_[k][i] = std::nextafter(static_cast<float>(upper + room + kSlack), kInfinity);
  }
  const double x = upper_[0][i] - lower_[0][i], y = upper_[1][i] - lower_[1][i], z = upper_[2][i] - lower_[2][i];
  return x * y + y * z + z * x;
}
template double OrientedBoxes::fit(int, std::span<const std::array<glm::dvec3, 3>>, const glm::dvec3&, double);
template double OrientedBoxes::fit(int, std::span<const std::array<glm::dvec3, 5>>, const glm::dvec3&, double);

template <class Real>
void OrientedBoxes::distances(const glm::dvec3& p, Real (&squared)[kWidth]) const {
  const double slack = kSlack * largest(p);
  double sum[kWidth] = {};
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < kWidth; ++i) {
      const double x = double(axis_[k][0][i]) * p.x + double(axis_[k][1][i]) * p.y + double(axis_[k][2][i]) * p.z;
      const double below = double(lower_[k][i]) - x, above = x - double(upper_[k][i]);
      const double outside = (below > above ? below : above) - slack;
      sum[i] += outside > 0 ? outside * outside : 0;
    }
  }
  for (int i = 0; i < kWidth; ++i) squared[i] = static_cast<Real>(sum[i]);
}
template void OrientedBoxes::distances(const glm::dvec3&, float (&)[kWidth]) const;
template void OrientedBoxes::distances(const glm::dvec3&, double (&)[kWidth]) const;

}  // namespace tolvol
