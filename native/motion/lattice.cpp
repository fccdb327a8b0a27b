// SPDX-License-Identifier: GPL-3.0-or-later
// The basis functions are computed by algorithm A2.2 of L. Piegl, W. Tiller, The NURBS Book, 1997. Where this deviates
// from Sederberg and Parry: they have Bernstein polynomials, for which a regular grid of control points is the
// identity. For other degrees it is not, unless the parameter of a point is found by inverting the map at rest, which
// here is one monotone function per axis. The code evaluates the motion of the control points, not their position, so
// that nothing is rounded where nothing moved.
#include "motion/lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "base/errors.h"

namespace tolvol {
namespace {

constexpr const char* kAxisNames[3] = {"u", "v", "w"};

/// A point counts as in the box up to this share of an edge outside. Meshes that just fit a box stick out of it by the
/// rounding of their float32 coordinates, and must not be torn there.
constexpr double kSlack = 0x1p-18;

/// Knots that are not equal and closer than this share of the range are refused, because dividing by their difference
/// would be inaccurate.
constexpr double kKnotGap = 1e-9;

/// The most steps of the search. Newton's method takes four; halving alone would end after as many as a double has
/// bits.
constexpr int kSteps = 64;

StoredSpace domain_space(const glm::dmat4& domain) {
  try {
    return {domain, Storage::float64};
  } catch (const InvalidInput&) {
    throw InvalidInput("the domain of the lattice must be a finite, affine matrix with three independent edges");
  }
}

void check_size(const std::string& name, unsigned size) {
  if (size >= 2) return;
  throw InvalidInput("a lattice needs at least 2 control points along each axis; along " + name + " it has " +
                     std::to_string(size));
}

std::string place_name(std::size_t i, const glm::uvec3& size) {
  std::ostringstream text;
  text << "(" << i / (size.y * size.z) << ", " << i / size.z % size.y << ", " << i % size.z << ")";
  return text.str();
}

/// Scales the weights so that the heaviest is 1: a common factor of all weights cancels.
std::vector<double> normalised_weights(const Lattice& lattice) {
  if (lattice.weights.empty()) return std::vector<double>(lattice.points.size(), 1);
  if (lattice.weights.size() != lattice.points.size()) {
    throw InvalidInput("the lattice must have one weight for each control point");
  }
  const auto refuse_unless = [&](bool good, std::size_t i, const char* remedy) {
    if (good) return;
    std::ostringstream text;
    text << "the weight of control point " << place_name(i, lattice.size) << " is " << lattice.weights[i] << "; "
         << remedy;
    throw InvalidInput(text.str());
  };
  std::vector<double> weights = lattice.weights;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    refuse_unless(weights[i] > 0 && std::isfinite(weights[i]), i, "weights must be positive and finite");
  }
  const double heaviest = *std::max_element(weights.begin(), weights.end());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] /= heaviest;
    refuse_unless(weights[i] >= std::numeric_limits<double>::min(), i, "that is nothing beside the heaviest one");
  }
  return weights;
}

std::vector<double> clamped_knots(const std::string& name, unsigned size, unsigned degree,
                                  const std::vector<double>& knots) {
  const std::size_t count = std::size_t{size} + degree + 1;
  if (knots.empty()) {
    std::vector<double> uniform(count);
    for (std::size_t i = 0; i < count; ++i) {
      uniform[i] = std::clamp((static_cast<double>(i) - degree) / (size - degree), 0.0, 1.0);
    }
    return uniform;
  }
  const std::string knots_name = "the knots along " + name;
  if (knots.size() != count) {
    throw InvalidInput(knots_name + " must be " + std::to_string(count) + ", the points and the degree and 1, not " +
                       std::to_string(knots.size()));
  }
  const double range = knots.back() - knots.front();
  if (!(range > 0) || !std::isfinite(range)) throw InvalidInput(knots_name + " must be finite and increase");
  std::vector<double> result(count);
  for (std::size_t i = 0; i < count; ++i) {
    result[i] = (knots[i] - knots.front()) / range;
    if (i > 0 && !(result[i] == result[i - 1] || result[i] - result[i - 1] >= kKnotGap)) {
      throw InvalidInput(knots_name + " must be equal or increase, and be finite; knot " + std::to_string(i) + " is " +
                         std::to_string(knots[i]));
    }
  }
  for (std::size_t i = 0; i + degree < count; ++i) {
    const bool end = i == 0 || i + degree + 1 == count;
    if (end ? result[i] != result[i + degree] : result[i] == result[i + degree]) {
      throw InvalidInput(knots_name + " must be clamped: the first and the last value degree + 1 times, " +
                         "others at most degree times");
    }
  }
  return result;
}

}  // namespace

std::vector<glm::dvec3> rest_points(const glm::uvec3& size, const glm::dmat4& domain) {
  for (int axis = 0; axis < 3; ++axis) check_size(kAxisNames[axis], size[axis]);
  const StoredSpace space = domain_space(domain);
  const glm::dvec3 last = glm::dvec3(size) - 1.0;
  std::vector<glm::dvec3> result;
  result.reserve(std::size_t{size.x} * size.y * size.z);
  for (unsigned i = 0; i < size.x; ++i) {
    for (unsigned j = 0; j < size.y; ++j) {
      for (unsigned k = 0; k < size.z; ++k) result.push_back(space.world(glm::dvec3(i, j, k) / last));
    }
  }
  return result;
}

LatticeAxis::LatticeAxis(const std::string& name, unsigned size, unsigned degree, const std::vector<double>& knots)
    : size_(size), degree_(degree) {
  check_size(name, size);
  if (degree < 1 || degree >= size || degree > kMaxDegree) {
    throw InvalidInput("the degree along " + name + " must be from 1 to " +
                       std::to_string(std::min(size - 1, kMaxDegree)) + " for " + std::to_string(size) +
                       " control points, not " + std::to_string(degree));
  }
  knots_ = clamped_knots(name, size, degree, knots);
  for (unsigned span = degree; span < size; ++span) {
    for (unsigned j = 1; j <= degree; ++j) {
      for (unsigned r = 0; r < j; ++r) reciprocals_.push_back(1 / (knots_[span + 1 + r] - knots_[span + 1 - j + r]));
    }
  }
  if (degree + 1 == size) return;  // There is one polynomial, which reproduces its parameter.
  double values[kMaxDegree + 1];
  std::vector<double> places(knots_.size(), 0.0);
  for (unsigned i = degree; i < size; ++i) places[i] = evaluate(span(knots_, knots_[i]), knots_[i], values).place;
  std::fill(places.begin() + size, places.end(), 1.0);
  places_ = std::move(places);
}

/// The interval between consecutive values of `breaks`, all of which are in order, that has `value` in it.
unsigned LatticeAxis::span(const std::vector<double>& breaks, double value) const {
  const auto first = breaks.begin() + degree_ + 1, last = breaks.begin() + size_;
  return static_cast<unsigned>(std::upper_bound(first, last, value) - breaks.begin()) - 1;
}

/// Fills in the basis functions; returns where the grid at rest is at this parameter, and its derivative there.
LatticeAxis::Rest LatticeAxis::evaluate(unsigned span, double parameter, double* values) const {
  double left[kMaxDegree + 1], right[kMaxDegree + 1];
  const double* reciprocal = &reciprocals_[(span - degree_) * std::size_t{degree_} * (degree_ + 1) / 2];
  double slope = 0;
  values[0] = 1;
  for (unsigned j = 1; j <= degree_; ++j) {
    left[j] = parameter - knots_[span + 1 - j];
    right[j] = knots_[span + j] - parameter;
    double saved = 0;
    slope = 0;
    for (unsigned r = 0; r < j; ++r) {
      const double share = values[r] * *reciprocal++;
      slope += share;
      values[r] = saved + right[r + 1] * share;
      saved = left[j - r] * share;
    }
    values[j] = saved;
  }
  const double last = size_ - 1;
  double place = 0;
  for (unsigned r = 0; r <= degree_; ++r) place += values[r] * ((span - degree_ + r) / last);
  return {place, slope * degree_ / last};
}

LatticeAxis::Support LatticeAxis::at(double x) const {
  Support support;
  const unsigned span = this->span(places_.empty() ? knots_ : places_, x);
  support.first = span - degree_;
  double parameter = x;
  if (!places_.empty()) {
    // This is Newton's method, kept between bounds.
    double lower = knots_[span], upper = knots_[span + 1];
    const double rise = places_[span + 1] - places_[span];
    parameter = rise > 0 ? lower + std::clamp((x - places_[span]) / rise, 0.0, 1.0) * (upper - lower) : lower;
    for (int step = 0; step < kSteps; ++step) {
      const Rest rest = evaluate(span, parameter, support.values);
      const double off = rest.place - x;
      if (off == 0) return support;
      (off > 0 ? upper : lower) = parameter;
      double next = parameter - off / rest.slope;
      if (!(next > lower && next < upper)) next = 0.5 * (lower + upper);
      if (std::abs(next - parameter) <= std::numeric_limits<double>::epsilon() * parameter) break;
      parameter = next;
    }
  }
  evaluate(span, parameter, support.values);
  return support;
}

LatticeDeformation::LatticeDeformation(const Lattice& lattice)
    : size_(lattice.size),
      domain_(domain_space(lattice.domain)),
      axes_{LatticeAxis(kAxisNames[0], lattice.size.x, lattice.degree.x, lattice.knots[0]),
            LatticeAxis(kAxisNames[1], lattice.size.y, lattice.degree.y, lattice.knots[1]),
            LatticeAxis(kAxisNames[2], lattice.size.z, lattice.degree.z, lattice.knots[2])} {
  const std::vector<glm::dvec3> rest = rest_points(lattice.size, lattice.domain);
  if (lattice.points.size() != rest.size()) {
    throw InvalidInput("the lattice must have " + std::to_string(rest.size()) + " control points, not " +
                       std::to_string(lattice.points.size()));
  }
  const std::vector<double> weights = normalised_weights(lattice);
  moved_.reserve(rest.size());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const glm::dvec3 motion = lattice.points[i] - rest[i];
    if (!std::isfinite(glm::dot(motion, glm::dvec3(1)))) {
      throw InvalidInput("control point " + place_name(i, size_) + " is not finite");
    }
    moved_.emplace_back(weights[i] * motion, weights[i]);
  }
  if (std::all_of(weights.begin(), weights.end(), [](double weight) { return weight == 1; })) return;
  const std::vector<glm::dvec3> places = rest_points(size_, glm::dmat4(1));
  rest_.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) rest_.emplace_back(moved_[i].w * places[i], 0);
}

std::optional<glm::dvec3> LatticeDeformation::displacement(const glm::dvec3& world) const {
  const glm::dvec3 place = domain_.store(world);
  // The comparison is written so that NaN is outside.
  if (!glm::all(glm::greaterThanEqual(place, glm::dvec3(-kSlack))) ||
      !glm::all(glm::lessThanEqual(place, glm::dvec3(1 + kSlack)))) {
    return std::nullopt;
  }
  const glm::dvec3 x = glm::clamp(place, 0.0, 1.0);
  const LatticeAxis::Support u = axes_[0].at(x.x), v = axes_[1].at(x.y), w = axes_[2].at(x.z);
  const auto sum = [&](const std::vector<glm::dvec4>& points) {
    glm::dvec4 total(0);
    for (unsigned i = 0; i <= axes_[0].degree(); ++i) {
      glm::dvec4 plane(0);
      for (unsigned j = 0; j <= axes_[1].degree(); ++j) {
        const glm::dvec4* cell = &points[((u.first + i) * std::size_t{size_.y} + v.first + j) * size_.z + w.first];
        glm::dvec4 row(0);
        for (unsigned k = 0; k <= axes_[2].degree(); ++k) row += w.values[k] * cell[k];
        plane += v.values[j] * row;
      }
      total += u.values[i] * plane;
    }
    return total;
  };
  const glm::dvec4 moved = sum(moved_);
  glm::dvec3 result = glm::dvec3(moved) / moved.w;
  if (!rest_.empty()) {
    // Unequal weights draw the space towards the heavier points even at rest.
    const glm::dvec3 drawn = glm::dvec3(sum(rest_)) / moved.w - x;
    result += glm::dmat3(domain_.to_world()) * drawn;
  }
  return result;
}

}  // namespace tolvol
