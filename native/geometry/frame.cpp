// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/frame.h"

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>

#include "base/errors.h"
#include "geometry/lengths.h"

namespace tolvol {

double rounded_to_float32(double x) {
  const volatile float rounded = static_cast<float>(x);
  return rounded;
}

glm::dvec3 rounded_to_float32(const glm::dvec3& p) {
  return {rounded_to_float32(p.x), rounded_to_float32(p.y), rounded_to_float32(p.z)};
}

Frame::Frame(const Box& world) {
  if (world.empty()) return;
  centre_ = world.lower * 0.5 + world.upper * 0.5;
  const glm::dvec3 half = world.upper * 0.5 - world.lower * 0.5;
  const double largest = std::max({half.x, half.y, half.z});
  if (!(largest > 0)) return;
  // The half diagonal is divided by the largest side first, because its square might leave the range of double.
  const double radius = largest * glm::length(half / largest);
  int exponent = 0;
  std::frexp(radius, &exponent);
  scale_ = std::ldexp(1.0, -exponent);
}

StoredSpace::StoredSpace(const glm::dmat4& to_world, Storage storage, const Frame& frame)
    : to_world_(to_world), storage_(storage), mirrors_(false), frame_(frame) {
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) {
      if (!std::isfinite(to_world[column][row]))
        throw InvalidInput("to_world has a value that is not finite", "invalid_transform");
    }
    if (to_world[column][3] != (column == 3 ? 1.0 : 0.0)) {
      throw InvalidInput("to_world is not affine: its last row must be 0 0 0 1", "invalid_transform");
    }
  }
  // The columns are scaled to length one first, because the determinant of a matrix of tiny scales would underflow.
  glm::dmat3 linear(to_world);
  glm::dvec3 lengths{0};
  for (int column = 0; column < 3; ++column) {
    const glm::dvec3 c = linear[column];
    const double most = largest(c);
    if (most > 0) lengths[column] = most * glm::length(c / most);
    if (!(lengths[column] > 0))
      throw InvalidInput("to_world is singular: an axis is scaled to zero; give it a scale", "invalid_transform");
    linear[column] /= lengths[column];
  }
  const double determinant = glm::determinant(linear);
  mirrors_ = determinant < 0;
  if (std::abs(determinant) < 1e-12) {
    throw InvalidInput("to_world is singular: it flattens the mesh; give every axis a scale", "invalid_transform");
  }
  glm::dmat3 inverse = glm::inverse(linear);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) inverse[column][row] /= lengths[row];
  }
  to_local_ = inverse;
  set_anchor();
}

StoredSpace StoredSpace::in(const Frame& frame) const {
  StoredSpace copy = *this;
  copy.frame_ = frame;
  copy.set_anchor();
  return copy;
}

// Stored positions less the anchor are small where the mesh is near the frame's centre, and no large numbers cancel.
// The offset makes up for the rounding of the anchor. It is the sum of large numbers that cancel, hence the quadruple
// precision.
void StoredSpace::set_anchor() {
  using Quad = boost::multiprecision::cpp_bin_float_quad;
  constexpr double kQuadRoundoff = 0x1p-113;
  anchor_ = to_local_ * (frame_.centre() - glm::dvec3(to_world_[3]));
  // An anchor out of the range of double is no help.
  if (!std::isfinite(anchor_.x + anchor_.y + anchor_.z)) anchor_ = glm::dvec3(0);
  anchor_error_ = 0;
  for (int row = 0; row < 3; ++row) {
    Quad sum = Quad(to_world_[3][row]) - Quad(frame_.centre()[row]);
    double magnitude = std::abs(to_world_[3][row]) + std::abs(frame_.centre()[row]);
    for (int column = 0; column < 3; ++column) {
      sum += Quad(to_world_[column][row]) * Quad(anchor_[column]);
      magnitude += std::abs(to_world_[column][row] * anchor_[column]);
    }
    anchor_offset_[row] = static_cast<double>(sum);
    anchor_error_ = std::max(anchor_error_, 8 * kQuadRoundoff * magnitude);  // three products and four sums
  }
}

glm::dvec3 StoredSpace::world(const glm::dvec3& stored) const {
  glm::dvec3 result;
  for (int row = 0; row < 3; ++row) {
    result[row] =
        to_world_[0][row] * stored.x + to_world_[1][row] * stored.y + to_world_[2][row] * stored.z + to_world_[3][row];
  }
  return result;
}

std::vector<glm::dvec3> StoredSpace::frame(std::span<const glm::dvec3> stored) const {
  std::vector<glm::dvec3> result(stored.size());
  for (std::size_t i = 0; i < stored.size(); ++i) result[i] = frame(stored[i]);
  return result;
}

glm::dvec3 StoredSpace::store(const glm::dvec3& in_frame) const {
  const glm::dvec3 local = to_local_ * (in_frame / frame_.scale() - anchor_offset_) + anchor_;
  return storage_ == Storage::float32 ? rounded_to_float32(local) : local;
}

double StoredSpace::mapping_error(std::span<const glm::dvec3> stored) const {
  glm::dvec3 extent{0};
  for (const glm::dvec3& p : stored) extent = glm::max(extent, glm::abs(p - anchor_));
  double largest = 0;
  for (int row = 0; row < 3; ++row) {
    largest = std::max(largest, std::abs(to_world_[0][row]) * extent.x + std::abs(to_world_[1][row]) * extent.y +
                                    std::abs(to_world_[2][row]) * extent.z + std::abs(anchor_offset_[row]));
  }
  // The difference to the anchor, a product and up to three sums round each term of a row, and the offset was rounded
  // before, hence an error of at most six u times the sum of magnitudes. Scaling by a power of two adds nothing. The
  // length over three coordinates is sqrt(3) times as much.
  return (11 * kUnitRoundoff * largest + 2 * anchor_error_) * frame_.scale();
}

double StoredSpace::mapping_error(std::span<const glm::dvec3> stored, double reach) const {
  // The error is convex in the position, so that it is largest at a corner of the cube.
  std::vector<glm::dvec3> extremes(stored.begin(), stored.end());
  for (int corner = 0; corner < 8; ++corner) {
    extremes.push_back(store(reach * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
  }
  return mapping_error(extremes);
}

double StoredSpace::storage_step(std::span<const glm::dvec3> stored) const {
  // A coordinate is off by half a unit in the last place, and in double precision by as much again in the last sum of
  // store().
  const double rounding = (storage_ == Storage::float32 ? 1 : 2) * unit_roundoff();
  glm::dvec3 extent{0};
  for (const glm::dvec3& p : stored) extent = glm::max(extent, glm::abs(p));
  glm::dvec3 step{0};
  for (int row = 0; row < 3; ++row) {
    // Each term is brought to the frame before they are added: in the world their squares may leave the range of
    // double.
    for (int column = 0; column < 3; ++column) {
      step[row] += std::abs(to_world_[column][row]) * frame_.scale() * (rounding * extent[column]);
    }
  }
  return glm::length(step);
}

double longest_diagonal(std::span<const glm::dvec3> stored, std::span<const glm::uvec3> triangles,
                        const glm::dmat4& to_world) {
  const std::vector<bool> used = used_vertices(stored.size(), triangles);
  Box box;
  for (std::size_t i = 0; i < stored.size(); ++i) {
    if (used[i]) box.add(stored[i]);
  }
  const glm::dvec3 side = box.upper - box.lower;
  const glm::dmat3 linear(to_world);
  double longest = 0;
  for (const glm::dvec3 sign :
       {glm::dvec3(1, 1, 1), glm::dvec3(1, 1, -1), glm::dvec3(1, -1, 1), glm::dvec3(-1, 1, 1)}) {
    const glm::dvec3 diagonal = linear * (side * sign);
    longest = std::max(longest, std::hypot(diagonal.x, diagonal.y, diagonal.z));
  }
  if (!(longest > 0)) throw InvalidInput("all vertices are at one point: the mesh has no size", "invalid_mesh");
  return longest;
}

}  // namespace tolvol
