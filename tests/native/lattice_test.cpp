// SPDX-License-Identifier: GPL-3.0-or-later
// Against the definitions: Bernstein polynomials by binomials, basis functions by the recursion of Cox and de Boor.
#include "motion/lattice.h"

#include <gtest/gtest.h>

#include <random>

#include "base/errors.h"

namespace {

using namespace tolvol;
using glm::dvec3;

const glm::dmat4 kSheared(2, 0.5, 0, 0, -0.3, 1, 0.2, 0, 0, 0.4, 3, 0, 10, -20, 30, 1);

Lattice at_rest(const glm::uvec3& size, const glm::uvec3& degree, const glm::dmat4& domain = glm::dmat4(1)) {
  Lattice lattice;
  lattice.size = size, lattice.degree = degree, lattice.domain = domain;
  lattice.points = rest_points(size, domain);
  return lattice;
}

Lattice shaken(Lattice lattice, unsigned seed, double amount = 0.3) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal(0, amount);
  for (dvec3& p : lattice.points) p += dvec3(normal(engine), normal(engine), normal(engine));
  return lattice;
}

Lattice weighed(Lattice lattice, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(0.1, 5);
  for (std::size_t i = 0; i < lattice.points.size(); ++i) lattice.weights.push_back(uniform(engine));
  return lattice;
}

std::vector<dvec3> places(unsigned seed = 1) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<dvec3> result{{0, 0, 0}, {1, 1, 1}, {0.5, 0.5, 0.5}, {0.25, 0, 1}, {1e-300, 1 - 0x1p-53, 1e-17}};
  for (int i = 0; i < 500; ++i) result.emplace_back(uniform(engine), uniform(engine), uniform(engine));
  return result;
}

dvec3 world(const Lattice& lattice, const dvec3& place) { return dvec3(lattice.domain * glm::dvec4(place, 1)); }

double bernstein(unsigned i, unsigned n, double u) {
  return std::tgamma(n + 1.0) / (std::tgamma(i + 1.0) * std::tgamma(n - i + 1.0)) * std::pow(u, i) *
         std::pow(1 - u, n - i);
}

/// Evaluates a basis function by the recursion of Cox and de Boor. The last interval is closed.
double cox_de_boor(const std::vector<double>& knots, unsigned i, unsigned degree, double u) {
  if (degree == 0) {
    return (knots[i] <= u && u < knots[i + 1]) || (u == knots.back() && knots[i] < u && knots[i + 1] == u) ? 1 : 0;
  }
  double result = 0;
  if (knots[i + degree] > knots[i]) {
    result += (u - knots[i]) / (knots[i + degree] - knots[i]) * cox_de_boor(knots, i, degree - 1, u);
  }
  if (knots[i + degree + 1] > knots[i + 1]) {
    result +=
        (knots[i + degree + 1] - u) / (knots[i + degree + 1] - knots[i + 1]) * cox_de_boor(knots, i + 1, degree - 1, u);
  }
  return result;
}

/// The whole NURBS function by its definition, for basis functions basis(axis, i).
template <class Basis>
dvec3 direct(const Lattice& lattice, Basis&& basis) {
  dvec3 sum(0);
  double weight = 0;
  std::size_t at = 0;
  for (unsigned i = 0; i < lattice.size.x; ++i) {
    for (unsigned j = 0; j < lattice.size.y; ++j) {
      for (unsigned k = 0; k < lattice.size.z; ++k, ++at) {
        const double w = basis(0, i) * basis(1, j) * basis(2, k) * (lattice.weights.empty() ? 1 : lattice.weights[at]);
        sum += w * lattice.points[at], weight += w;
      }
    }
  }
  return sum / weight;
}

TEST(Lattice, AtRestNothingMovesAtAll) {
  Lattice knotted = at_rest({6, 4, 5}, {3, 2, 2}, kSheared);
  knotted.knots[0] = {-1, -1, -1, -1, 0.1, 7, 7.5, 7.5, 7.5, 7.5};
  for (const Lattice& lattice : {at_rest({4, 4, 4}, {3, 3, 3}), at_rest({2, 3, 9}, {1, 2, 3}, kSheared),
                                 at_rest({7, 8, 9}, {6, 5, 1}), knotted}) {
    const LatticeDeformation deformation(lattice);
    for (const dvec3& place : places()) EXPECT_EQ(deformation.displacement(world(lattice, place)), dvec3(0));
  }
}

TEST(Lattice, AffineMotionOfAllPointsIsThatMotionOfTheSpace) {
  const glm::dmat3 turn(0.9, 0.3, -0.2, -0.4, 1.2, 0.1, 0.3, 0, 0.7);
  const dvec3 shift(5, 6, 7);
  Lattice knotted = at_rest({6, 4, 5}, {3, 2, 2}, kSheared);
  knotted.knots[1] = {0, 0, 0, 0.9, 1, 1, 1};
  for (Lattice lattice : {at_rest({5, 4, 3}, {4, 3, 2}), at_rest({9, 7, 5}, {3, 2, 1}, kSheared),
                          at_rest({16, 12, 8}, {15, 3, 3}, kSheared), knotted}) {
    for (dvec3& p : lattice.points) p = turn * p + shift;
    const LatticeDeformation deformation(lattice);
    for (const dvec3& place : places()) {
      const dvec3 p = world(lattice, place);
      EXPECT_LT(glm::length(p + *deformation.displacement(p) - (turn * p + shift)), 1e-13 * 100);
    }
  }
}

TEST(Lattice, BernsteinIsTheDirectFormula) {
  for (const Lattice& lattice : {shaken(at_rest({4, 3, 6}, {3, 2, 5}), 1), shaken(at_rest({2, 2, 2}, {1, 1, 1}), 2),
                                 weighed(shaken(at_rest({3, 5, 4}, {2, 4, 3}), 3), 4)}) {
    const LatticeDeformation deformation(lattice);
    for (const dvec3& place : places()) {
      const dvec3 expected =
          direct(lattice, [&](int axis, unsigned i) { return bernstein(i, lattice.size[axis] - 1, place[axis]); });
      EXPECT_LT(glm::length(place + *deformation.displacement(place) - expected), 1e-13);
    }
  }
}

TEST(Lattice, SplinesAreTheRecursionAtTheParameterThatRestReproduces) {
  Lattice lattice = weighed(shaken(at_rest({7, 6, 5}, {3, 2, 1}), 5), 6);
  lattice.knots[0] = {0, 0, 0, 0, 0.2, 0.2, 0.8, 1, 1, 1, 1};
  const std::vector<double> knots[3] = {
      lattice.knots[0], {0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1}, {0, 0, 0.25, 0.5, 0.75, 1, 1}};
  const LatticeDeformation deformation(lattice);
  for (const dvec3& place : places(2)) {
    dvec3 parameter;
    for (int axis = 0; axis < 3; ++axis) {
      double lower = 0, upper = 1;
      for (int halving = 0; halving < 60; ++halving) {
        const double u = 0.5 * (lower + upper);
        double x = 0;
        for (unsigned i = 0; i < lattice.size[axis]; ++i) {
          x += cox_de_boor(knots[axis], i, lattice.degree[axis], u) * i / (lattice.size[axis] - 1);
        }
        (x < place[axis] ? lower : upper) = u;
      }
      parameter[axis] = upper;
    }
    const dvec3 expected = direct(lattice, [&](int axis, unsigned i) {
      return cox_de_boor(knots[axis], i, lattice.degree[axis], parameter[axis]);
    });
    EXPECT_LT(glm::length(place + *deformation.displacement(place) - expected), 1e-12);
  }
}

TEST(Lattice, PartitionOfUnity) {
  for (unsigned degree = 1; degree <= LatticeAxis::kMaxDegree; ++degree) {
    const LatticeAxis axis("u", 17, degree, {});
    for (const dvec3& place : places(degree)) {
      const LatticeAxis::Support support = axis.at(place.x);
      ASSERT_LE(support.first + degree, 16u);
      double sum = 0;
      for (unsigned i = 0; i <= degree; ++i) {
        EXPECT_GE(support.values[i], 0);
        sum += support.values[i];
      }
      EXPECT_NEAR(sum, 1, 1e-14);
    }
  }
}

TEST(Lattice, OnePointMovesOnlyItsNeighbourhood) {
  Lattice lattice = at_rest({12, 4, 4}, {3, 3, 3});
  lattice.points[(2 * 4 + 1) * 4 + 1] += dvec3(0, 0, 1);
  const LatticeDeformation deformation(lattice);
  // The support of N_2 ends at the third of nine spans; rest reaches 5 / 11 or so there.
  int moved = 0;
  for (const dvec3& place : places()) {
    const dvec3 displacement = *deformation.displacement(place);
    EXPECT_EQ(displacement.x, 0);
    if (place.x > 0.5) {
      EXPECT_EQ(displacement, dvec3(0));
    } else {
      moved += displacement.z > 0;
    }
  }
  EXPECT_GT(moved, 100);
}

TEST(Lattice, CornersFollowTheirPoints) {
  Lattice lattice = shaken(at_rest({5, 6, 4}, {3, 2, 3}, kSheared), 8);
  const LatticeDeformation deformation(lattice);
  const std::vector<dvec3> rest = rest_points(lattice.size, lattice.domain);
  for (const std::size_t corner : {std::size_t{0}, lattice.points.size() - 1}) {
    const dvec3 carried = rest[corner] + *deformation.displacement(rest[corner]);
    EXPECT_LT(glm::length(carried - lattice.points[corner]), 1e-13 * 40);
  }
}

TEST(Lattice, EqualWeightsCancelAndAHeavyPointDrawsTheSpace) {
  Lattice lattice = shaken(at_rest({4, 4, 4}, {3, 3, 3}), 9);
  const LatticeDeformation plain(lattice);
  lattice.weights.assign(64, 1e-250);
  const LatticeDeformation equal(lattice);
  const dvec3 middle(0.4, 0.5, 0.6);
  EXPECT_EQ(equal.displacement(middle), plain.displacement(middle));

  const std::size_t heavy = (1 * 4 + 2) * 4 + 1;
  double distance = glm::length(middle + *plain.displacement(middle) - lattice.points[heavy]);
  for (const double weight : {10.0, 1e3, 1e9}) {
    lattice.weights.assign(64, 1);
    lattice.weights[heavy] = weight;
    const LatticeDeformation drawn(lattice);
    const double closer = glm::length(middle + *drawn.displacement(middle) - lattice.points[heavy]);
    EXPECT_LT(closer, distance);
    distance = closer;
  }
  EXPECT_LT(distance, 1e-6);
}

TEST(Lattice, OutsideOfTheBoxNothingIsCarried) {
  Lattice lattice = at_rest({4, 4, 4}, {3, 3, 3}, kSheared);
  for (dvec3& p : lattice.points) p += dvec3(1, 0, 0);
  const LatticeDeformation deformation(lattice);
  for (const dvec3& place : {dvec3(-0.01, 0.5, 0.5), dvec3(0.5, 1.01, 0.5), dvec3(0.5, 0.5, 1e300)}) {
    EXPECT_FALSE(deformation.displacement(world(lattice, place)));
  }
  EXPECT_FALSE(deformation.displacement(dvec3(std::nan(""), 0, 0)));
  // What a float32 rounding leaves outside is carried with its face of the box.
  const auto edge = deformation.displacement(world(lattice, dvec3(1 + 1e-6, -1e-6, 0.5)));
  ASSERT_TRUE(edge);
  EXPECT_LT(glm::length(*edge - dvec3(1, 0, 0)), 1e-14);
}

void expect_refused(const Lattice& lattice, const std::string& part) {
  try {
    const LatticeDeformation deformation(lattice);
    ADD_FAILURE() << "accepted, expected: " << part;
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(Lattice, BadLatticesAreRefused) {
  const Lattice good = at_rest({4, 5, 6}, {3, 3, 3});
  const auto refused = [&](const std::string& part, auto change) {
    Lattice lattice = good;
    change(lattice);
    expect_refused(lattice, part);
  };
  refused("along v it has 1", [](Lattice& l) { l.size.y = 1; });
  refused("along u it has 0", [](Lattice& l) { l.size = glm::uvec3(0), l.points.clear(); });
  refused("must have 120 control points, not 119", [](Lattice& l) { l.points.pop_back(); });
  refused("degree along u must be from 1 to 3 for 4", [](Lattice& l) { l.degree.x = 4; });
  refused("degree along w must be from 1 to 5", [](Lattice& l) { l.degree.z = 0; });
  refused("control point (1, 2, 3) is not finite", [](Lattice& l) { l.points[45].y = std::nan(""); });
  refused("one weight for each", [](Lattice& l) { l.weights.assign(119, 1); });
  for (const double weight : {0.0, -1.0, std::nan(""), 1e-310, HUGE_VAL}) {
    refused("weight of control point (0, 0, 1)", [&](Lattice& l) { l.weights.assign(120, 1), l.weights[1] = weight; });
  }
  refused("knots along v must be 9", [](Lattice& l) { l.knots[1].assign(8, 0); });
  const auto knots = [&](const std::string& part, const std::vector<double>& values) {
    refused(part, [&](Lattice& l) { l.knots[1] = values; });
  };
  knots("equal or increase", {0, 0, 0, 0, -1, 1, 1, 1, 1});
  knots("equal or increase", {0, 0, 0, 0, std::nan(""), 1, 1, 1, 1});
  knots("equal or increase", {0, 0, 0, 0, 1e-12, 1, 1, 1, 1});
  knots("must be finite and increase", {1, 1, 1, 1, 1, 1, 1, 1, 1});
  knots("must be clamped", {0, 1, 2, 3, 4, 5, 6, 7, 8});
  knots("must be clamped", {0, 0, 0, 0, 0, 1, 1, 1, 1});
  refused("domain of the lattice", [](Lattice& l) { l.domain[1] = l.domain[0]; });
  refused("domain of the lattice", [](Lattice& l) { l.domain[3][1] = HUGE_VAL; });
  Lattice steep = at_rest({17, 4, 4}, {16, 3, 3});
  expect_refused(steep, "from 1 to 15");
}

}  // namespace
