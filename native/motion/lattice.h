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
  glm::uvec3 size{0};                             ///< control points along each axis, at least 2
  std::vector<glm::dvec3> points;                 ///< where they are now; (i, j, k) is number (i size.y + j) size.z + k
  std::vector<double> weights;                    ///< in the same order, positive; empty: all equal
  glm::dmat4 domain{1};                           ///< the box: the unit cube mapped to the world
  glm::uvec3 degree{3};                           ///< below the number of points; that number less 1: Bernstein
  std::array<std::vector<double>, 3> knots = {};  ///< clamped, size + degree + 1 each; empty: uniform
};

/// The control points of a lattice at rest, in the order of Lattice::points.
std::vector<glm::dvec3> rest_points(const glm::uvec3& size, const glm::dmat4& domain);

/// The basis functions along one axis, over places x of the box from 0 to 1. The parameter of a place is the one at
/// which the grid at rest reproduces it, so that a lattice at rest is the identity whatever its degree and knots.
class LatticeAxis {
 public:
  static constexpr unsigned kMaxDegree = 15;

  /// The basis functions that are not zero at a place: those of the points first, ..., first + degree.
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
  std::vector<double> knots_;        // from 0 to 1
  std::vector<double> reciprocals_;  // of the knot differences that evaluate() needs, a span after the other
  std::vector<double> places_;       // of the knots, by the grid at rest; empty when they are the knots themselves
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
  std::vector<glm::dvec4> moved_;  // per point: its motion times its weight, and the weight
  std::vector<glm::dvec4> rest_;   // per point: its place in the box times its weight; empty when all weights are equal
};

}  // namespace tolvol
