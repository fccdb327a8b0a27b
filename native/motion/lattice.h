// SPDX-License-Identifier: GPL-3.0-or-later
/// Freeform deformation: a trivariate tensor-product NURBS function that carries the space of a box along with a
/// lattice of control points [Sederberg & Parry, Free-form deformation of solid geometric models, 1986].
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "geometry/frame.h"

namespace tolvol {

/// Control points in world units. At rest they are the regular grid of a box: point (i, j, k) is at (i / (size.x - 1),
/// j / (size.y - 1), k / (size.z - 1)) of it.
struct Lattice {
  glm::uvec3 size{0};              ///< The number of control points along each axis, at least 2.
  std::vector<glm::dvec3> points;  ///< Where they are now; (i, j, k) is number (i size.y + j) size.z + k.
  std::vector<double> weights;     ///< In the same order, positive; empty if all are equal.
  glm::dmat4 domain{1};            ///< It maps the unit cube to the box in the world.
  glm::uvec3 degree{3};            ///< Below the number of points. One less than it means Bernstein polynomials.
  std::array<std::vector<double>, 3> knots = {};  ///< Clamped, size + degree + 1 for each axis; empty if uniform.
};

/// The control points of a lattice at rest, in the order of Lattice::points.
std::vector<glm::dvec3> rest_points(const glm::uvec3& size, const glm::dmat4& domain);

/// The basis functions along one axis, over places x of the box from 0 to 1. The parameter of a place is the one at
/// which the grid at rest reproduces it, so that a lattice at rest is the identity whatever its degree and knots.
class LatticeAxis {
 public:
  static constexpr unsigned kMaxDegree = 15;

  /// The basis functions that are not zero at a place. They belong to the points first, ..., first + degree.
  struct Support {
    unsigned first;
    double values[kMaxDegree + 1];
  };

  /// Throws InvalidInput, naming the axis, unless 1 <= degree < size, and for knots that are not clamped or not in
  /// order.
  LatticeAxis(const std::string& name, unsigned size, unsigned degree, const std::vector<double>& knots);

  /// O(degree^2).
  Support at(double x) const;
  unsigned degree() const { return degree_; }

 private:
  struct Rest {
    double place, slope;
  };
  Rest evaluate(unsigned span, double parameter, double* values) const;
  unsigned span(const std::vector<double>& breaks, double value) const;

  unsigned size_, degree_;
  std::vector<double> knots_;        // They go from 0 to 1.
  std::vector<double> reciprocals_;  // Of the knot differences that evaluate() needs, span after span.
  std::vector<double> places_;       // The knots' places by the grid at rest; empty if they equal the knots.
};

class LatticeDeformation {
 public:
  /// Throws InvalidInput, naming the first offender, for a lattice that is not as described. O(points).
  explicit LatticeDeformation(const Lattice& lattice);

  /// How far the lattice carries a point of the world, exactly zero where none of the points that it depends on has
  /// left its rest (and the weights are equal); none for a point outside the box, which is not carried at all.
  /// O(product of degree + 1), about 0.4 us for degree 3.
  std::optional<glm::dvec3> displacement(const glm::dvec3& world) const;

 private:
  glm::uvec3 size_;
  StoredSpace domain_;
  std::array<LatticeAxis, 3> axes_;
  std::vector<glm::dvec4> moved_;  // For each point: its motion times its weight, and the weight.
  std::vector<glm::dvec4>
      rest_;  // For each point: its place in the box times its weight; empty if all weights are equal.
};

}  // namespace tolvol
