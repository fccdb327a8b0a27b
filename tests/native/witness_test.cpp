// SPDX-License-Identifier: GPL-3.0-or-later
// The judge is long double arithmetic with margins of its own: a computed distance must never be below the exact one by
// more than witness_error() says.
#include "check/witness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "base/simd.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using Real = long double;
using Vec = glm::vec<3, Real>;

/// Squared distance to the triangle by minimising over a fine net of directions would be slow; the exact minimum over a
/// triangle is the least of the three edges and, if the foot lies inside, the plane. In 64-bit mantissas.
Real exact_distance(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const auto segment = [&](const Vec& q, const Vec& s, const Vec& e) {
    const Vec d = e - s;
    const Real length2 = glm::dot(d, d), t = length2 > 0 ? std::clamp<Real>(glm::dot(q - s, d) / length2, 0, 1) : 0;
    return glm::length(q - s - t * d);
  };
  const Vec q(p), va(a), vb(b), vc(c);
  Real best = std::min({segment(q, va, vb), segment(q, vb, vc), segment(q, va, vc)});
  const Vec n = glm::cross(vb - va, vc - va);
  const Real nn = glm::dot(n, n);
  if (nn > 0) {
    const Real s = glm::dot(glm::cross(vc - va, n), q - va) / nn, t = glm::dot(glm::cross(n, vb - va), q - va) / nn;
    if (s >= 0 && t >= 0 && s + t <= 1) best = std::min(best, glm::length(q - va - s * (vb - va) - t * (vc - va)));
  }
  return best;
}

struct Sample {
  dvec3 a, b, c;
  FourPoints points;
  dvec3 p[4];
};

/// Ordinary triangles, needles of height 1e-2 to 1e-16, segments and points; test points near and far.
Sample hostile(std::mt19937& engine) {
  std::uniform_real_distribution<double> u(-1, 1);
  const auto point = [&] { return dvec3(u(engine), u(engine), u(engine)); };
  Sample s;
  s.a = point() * 0.57, s.b = point() * 0.57;
  const double height = std::pow(10.0, -2 - 14 * std::abs(u(engine)));
  switch (engine() % 5) {
    case 0:
      s.c = point() * 0.57;
      break;
    case 1:
      s.c = s.a + std::abs(u(engine)) * (s.b - s.a) + height * point();
      break;
    case 2:
      s.c = s.a + height * point();
      break;
    case 3:
      s.c = s.b;
      break;
    default:
      s.c = s.b = s.a;
  }
  const double reach = std::pow(10.0, -6 * std::abs(u(engine)));
  for (int i = 0; i < 4; ++i) {
    const double v = std::abs(u(engine)), w = std::abs(u(engine)) * (1 - v);
    s.p[i] = s.a + v * (s.b - s.a) + w * (s.c - s.a) + reach * point();
  }
  s.points.set(s.p[0], s.p[1], s.p[2], s.p[3]);
  return s;
}

TEST(Witness, NeverCloserThanTheTriangleIs) {
  std::mt19937 engine(7);
  double loosest = 0;
  for (int i = 0; i < 200'000; ++i) {
    const Sample s = hostile(engine);
    double d2[4];
    witness_distances({s.a, s.b, s.c}, s.points, d2);
    for (int k = 0; k < 4; ++k) {
      const Real exact = exact_distance(s.p[k], s.a, s.b, s.c), got = std::sqrt(static_cast<Real>(d2[k]));
      ASSERT_GE(got + witness_error(1 + static_cast<double>(got)), exact) << "sample " << i;
      // Complete as well: on needles a parameter may be poor, but the edges are always tried.
      loosest = std::max(loosest, static_cast<double>(got - exact));
    }
  }
  EXPECT_LT(loosest, 1e-7);
}

TEST(Witness, ErrorBoundIsNotIdle) {
  // With exact data on a representable plane the result is exact; on random data rounding shows, far below the bound.
  std::mt19937 engine(8);
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Sample s = hostile(engine);
    double d2[4];
    witness_distances({s.a, s.b, s.c}, s.points, d2);
    for (int k = 0; k < 4; ++k) {
      worst = std::max(
          worst, static_cast<double>(exact_distance(s.p[k], s.a, s.b, s.c) - std::sqrt(static_cast<Real>(d2[k]))));
    }
  }
  EXPECT_GT(worst, 0) << "rounding does lead to distances that are too small: the margin is needed";
  EXPECT_LT(worst, witness_error(1));
}

TEST(Witness, BothInstructionPathsGiveTheSameBits) {
  std::mt19937 engine(9);
  const Simd best = simd_path();
  for (int i = 0; i < 20'000; ++i) {
    const Sample s = hostile(engine);
    double fast[4], plain[4];
    simd_path() = best;
    witness_distances({s.a, s.b, s.c}, s.points, fast);
    simd_path() = Simd::portable;
    witness_distances({s.a, s.b, s.c}, s.points, plain);
    for (int k = 0; k < 4; ++k) ASSERT_EQ(fast[k], plain[k]);
  }
  simd_path() = best;
}

TEST(Witness, NotANumberIsNeverNear) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  FourPoints points;
  points.set({nan, 0, 0}, {0, nan, 0}, {0, 0, nan}, {nan, nan, nan});
  double d2[4];
  witness_distances({dvec3(0), dvec3(1, 0, 0), dvec3(0, 1, 0)}, points, d2);
  for (const double d : d2) EXPECT_FALSE(d <= 1e300);
}

}  // namespace
