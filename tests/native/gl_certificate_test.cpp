// SPDX-License-Identifier: GPL-3.0-or-later
// All accepted candidates together are judged by measure/hausdorff.h, which is not part of the shader.
#include "check/gl_certificate.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <thread>

#include "candidates.h"
#include "check/certificate.h"
#include "gl_fixture.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using candidates::kIdentity;
using glm::dvec3;

class GlCertificates : public GlTest {};

ToleranceVolume volume_of(const TriangleMesh& mesh, double tolerance, std::optional<double> precision = {}) {
  return {mesh.vertices, mesh.triangles, kIdentity, tolerance, {precision, 0, nullptr}};
}

/// Pieces of `corners` consecutive points each.
std::vector<Verdict> check(const ToleranceCheck& method, const std::vector<dvec3>& points, int corners = 3,
                           Progress* progress = nullptr) {
  std::vector<std::uint32_t> indices(points.size());
  for (std::uint32_t i = 0; i < indices.size(); ++i) indices[i] = i;
  return method.check({points, kIdentity, indices, corners}, {1, progress});
}

Verdict check_one(const ToleranceVolume& volume, const std::vector<dvec3>& points) {
  return check(GlCertificate(volume), points, static_cast<int>(points.size())).at(0);
}

dvec3 direction(std::mt19937& engine) {
  std::normal_distribution<double> normal(0, 1);
  return glm::normalize(dvec3(normal(engine), normal(engine), normal(engine)));
}

/// Three points a candidate, in turn: of any size anywhere up to two tolerances away; a small one whose corners are
/// within 2 % of the tolerance of a reference triangle; one on the reference with a corner pulled off.
std::vector<dvec3> hostile(const TriangleMesh& reference, double tolerance, int count, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<dvec3> points;
  for (int i = 0; i < count; ++i) {
    const glm::uvec3 t = reference.triangles[engine() % reference.triangles.size()];
    const dvec3 a = reference.vertices[t.x], b = reference.vertices[t.y], c = reference.vertices[t.z];
    const double v = std::abs(u(engine)), w = std::abs(u(engine)) * (1 - v);
    const dvec3 on = a + v * (b - a) + w * (c - a);
    if (i % 3 == 0) {
      const dvec3 base = on + 2 * tolerance * u(engine) * direction(engine);
      const double size = tolerance * std::pow(10.0, 2 * u(engine));
      for (int k = 0; k < 3; ++k) points.push_back(base + size * direction(engine));
    } else if (i % 3 == 1) {
      const dvec3 base = on + tolerance * (1 + 0.02 * u(engine)) * direction(engine);
      for (int k = 0; k < 3; ++k) points.push_back(base + 0.01 * tolerance * direction(engine));
    } else {
      points.push_back(a + tolerance * (1.1 + 0.6 * u(engine)) * direction(engine));
      points.push_back(b + tolerance * 0.999999 * direction(engine));
      points.push_back(i % 2 ? c : on);
    }
  }
  return points;
}

/// Triangles with two long edges and the given height, some of them segments and points.
TriangleMesh needles(double height, const dvec3& offset) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> u(-1, 1);
  TriangleMesh mesh;
  for (unsigned i = 0; i < 60; ++i) {
    const dvec3 a = offset + dvec3(u(engine), u(engine), u(engine)),
                b = offset + dvec3(u(engine), u(engine), u(engine));
    const dvec3 c = a + std::abs(u(engine)) * (b - a) + height * dvec3(u(engine), u(engine), u(engine));
    mesh.vertices.insert(mesh.vertices.end(), {a, b, i % 7 == 0 ? b : c});
    mesh.triangles.emplace_back(3 * i, i % 11 == 0 ? 3 * i : 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

void expect_no_wrong_accept(const TriangleMesh& reference, double tolerance, const std::vector<dvec3>& points,
                            std::optional<double> precision = {}) {
  const ToleranceVolume volume = volume_of(reference, tolerance, precision);
  const std::vector<Verdict> verdicts = check(GlCertificate(volume), points);
  const candidates::Points inside = candidates::accepted(points, verdicts);
  EXPECT_GT(inside.size() / 3, verdicts.size() / 20);
  EXPECT_EQ(candidates::farther(inside, reference, tolerance), 0);
  EXPECT_EQ(std::count(verdicts.begin(), verdicts.end(), Verdict::outside), 0);
}

TEST_F(GlCertificates, NoWrongAccept) {
  for (const TriangleMesh& reference : {shapes::torus(40, 0.01), shapes::box(6)}) {
    for (const double tolerance : {0.5, 0.1, 0.01, 0.0003}) {
      SCOPED_TRACE(tolerance);
      expect_no_wrong_accept(reference, tolerance, hostile(reference, tolerance, 20'000, 3));
    }
  }
}

TEST_F(GlCertificates, NoWrongAcceptAtAnyPrecision) {
  const TriangleMesh reference = shapes::torus(30, 0.01);
  for (const double precision : {0.05, 0.5, 4.0}) {
    SCOPED_TRACE(precision);
    expect_no_wrong_accept(reference, 0.03, hostile(reference, 0.03, 5'000, 4), precision);
  }
}

TEST_F(GlCertificates, NoWrongAcceptOnNeedles) {
  for (int exponent = 1; exponent <= 7; ++exponent) {
    SCOPED_TRACE(exponent);
    const TriangleMesh reference = needles(std::pow(10.0, -exponent), dvec3(exponent % 2 ? 0 : 1e4));
    expect_no_wrong_accept(reference, 1e-3, hostile(reference, 1e-3, 20'000, static_cast<unsigned>(exponent)));
  }
}

TEST_F(GlCertificates, FindsHoles) {
  // Candidates in the plane of the reference, where only what is missing of it is outside.
  const TriangleMesh whole = shapes::grid(40);
  TriangleMesh plane{whole.vertices, {}};
  for (std::size_t i = 0; i < whole.triangles.size(); ++i) {
    if (i / 2 % 37 != 0) plane.triangles.push_back(whole.triangles[i]);
  }
  std::mt19937 engine(8);
  std::uniform_real_distribution<double> u(0, 1);
  std::vector<dvec3> points;
  for (int i = 0; i < 5'000; ++i) {
    const dvec3 base(u(engine), u(engine), 0);
    for (int k = 0; k < 3; ++k) {
      points.push_back(glm::clamp(base + 0.3 * dvec3(u(engine) - 0.5, u(engine) - 0.5, 0), dvec3(0), dvec3(1)));
    }
  }
  expect_no_wrong_accept(plane, 0.01, points);
}

TEST_F(GlCertificates, ProvesWhatDecimationMakes) {
  const TriangleMesh reference = shapes::torus(150, 0.002);
  for (const double tolerance : {0.03, 0.003}) {
    const ToleranceVolume volume = volume_of(reference, tolerance);
    std::mt19937 engine(2);
    std::normal_distribution<double> normal(0, 0.3 * tolerance);
    std::vector<dvec3> points;
    for (const glm::uvec3& t : reference.triangles) {
      for (int k = 0; k < 3; ++k) {
        points.push_back(reference.vertices[t[k]] + dvec3(normal(engine), normal(engine), normal(engine)));
      }
    }
    const std::vector<Verdict> ours = check(GlCertificate(volume), points),
                               reached = check(Certificate(volume), points);
    std::size_t inside = 0, proved = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
      inside += reached[i] == Verdict::inside;
      proved += ours[i] == Verdict::inside;
      EXPECT_FALSE(ours[i] == Verdict::inside && reached[i] == Verdict::outside);
    }
    EXPECT_GT(inside, ours.size() / 2);
    EXPECT_GE(static_cast<double>(proved), 0.985 * static_cast<double>(inside));
  }
}

TEST_F(GlCertificates, TouchesTheToleranceFromBothSides) {
  // Turned, so that nothing is exact in float32.
  const glm::dmat3 turn(0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6);
  const auto place = [&](const dvec3& p) { return turn * (p * 0.7 - dvec3(0.1, 0.3, 0)); };
  const TriangleMesh plane = shapes::squares(4, place);
  const double tolerance = 0.07;
  const ToleranceVolume volume = volume_of(plane, tolerance);
  const GlCertificate method(volume);
  // What the header says float32 hides, and half as much again for rounding the threshold.
  const double hidden = 1.5 * float_error(1 + 2 * volume.frame_tolerance()) / volume.frame_tolerance();
  EXPECT_LT(hidden, 1e-4);
  std::mt19937 engine(6);
  std::uniform_real_distribution<double> u(0, 1);
  std::vector<dvec3> below, above;
  for (int i = 0; i < 20'000; ++i) {
    const double x = (i % 4) * 0.25, y = (i / 4 % 4) * 0.25, side = i % 2 ? 0.1 : -0.1;
    for (int k = 0; k < 3; ++k) {
      const double s = 0.15 + 0.04 * u(engine), t = 0.06 + 0.04 * u(engine);  // about the middle of a triangle
      below.push_back(place({x + s, y + t, side * (1 - hidden)}));
      above.push_back(place({x + s, y + t, side * (1 + (i % 3 ? 1e-6 : 1e-9))}));
    }
  }
  for (const Verdict v : check(method, below)) ASSERT_EQ(v, Verdict::inside);
  for (const Verdict v : check(method, above)) ASSERT_EQ(v, Verdict::unproved);
}

TEST_F(GlCertificates, LargeAndBentPieces) {
  const TriangleMesh plane = shapes::grid(50);
  const ToleranceVolume volume = volume_of(plane, 0.02);
  // Covers thousands of reference triangles; then one corner leaves the plane by more than the tolerance, then a part
  // of it the rectangle.
  EXPECT_EQ(check_one(volume, {{0, 0, 0.01}, {0.5, 0, 0.01}, {0, 0.5, 0.01}}), Verdict::inside);
  EXPECT_EQ(check_one(volume, {{0, 0, 0.01}, {0.5, 0, 0.01}, {0, 0.5, 0.024}}), Verdict::unproved);
  EXPECT_EQ(check_one(volume, {{0, 0, 0.01}, {0.5, 0, 0.01}, {-0.03, 0.5, 0.01}}), Verdict::unproved);
  // All corners near, the middle not: a chord of the torus.
  const TriangleMesh torus = shapes::torus(60);
  EXPECT_EQ(check_one(volume_of(torus, 0.02), {{1.4, 0, 0}, {-0.7, 1.2, 0}, {-0.7, -1.2, 0}}), Verdict::unproved);
  // More parts than are looked at: left open, not claimed, in reasonable time.
  EXPECT_EQ(check_one(volume_of(plane, 1e-4), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), Verdict::unproved);
}

TEST_F(GlCertificates, PointsSegmentsAndQuads) {
  const TriangleMesh plane = shapes::grid(4);
  const ToleranceVolume volume = volume_of(plane, 0.1);
  EXPECT_EQ(check_one(volume, {{0.5, 0.5, 0.09}}), Verdict::inside);
  EXPECT_EQ(check_one(volume, {{0.5, 0.5, 0.11}}), Verdict::unproved);
  EXPECT_EQ(check_one(volume, {{0.1, 0.5, 0.09}, {0.9, 0.5, -0.09}}), Verdict::inside);
  EXPECT_EQ(check_one(volume, {{0.1, 0.5, 0.09}, {1.5, 0.5, 0}}), Verdict::unproved);
  EXPECT_EQ(check_one(volume, {{0, 0, 0.09}, {1, 0, -0.09}, {1, 1, 0.09}, {0, 1, -0.09}}), Verdict::inside);
  EXPECT_EQ(check_one(volume, {{0, 0, 0.09}, {1, 0, -0.09}, {1, 1.2, 0.09}, {0, 1, -0.09}}), Verdict::unproved);
  // Within in one triangulation, outside in the other, whichever corner is the first: a quad is judged in both.
  const TriangleMesh roof{{{0, 0, 0}, {1, 0, 0.5}, {1, 1, 0}, {0, 1, 0.5}}, {{0, 1, 3}, {1, 2, 3}}};
  const ToleranceVolume over = volume_of(roof, 0.1);
  EXPECT_EQ(check_one(over, roof.vertices), Verdict::unproved);
  EXPECT_EQ(check_one(over, {roof.vertices[1], roof.vertices[2], roof.vertices[3], roof.vertices[0]}),
            Verdict::unproved);
  EXPECT_EQ(check_one(over, {roof.vertices[0], roof.vertices[1], roof.vertices[3]}), Verdict::inside);
}

TEST_F(GlCertificates, OddCoordinatesAreUnproved) {
  const ToleranceVolume volume = volume_of(shapes::grid(4), 0.1);
  const GlCertificate method(volume);
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const double odd : {nan, infinity, -infinity, 1e300, -1e39, 1e38, 100.0, 1.3}) {
    for (int axis = 0; axis < 3; ++axis) {
      dvec3 p(0);
      p[axis] = odd;
      const std::vector<dvec3> points = {dvec3(0), {0.1, 0, 0}, p};
      const std::vector<std::uint32_t> indices = {0, 1, 2, 2, 2, 2, 2, 0, 1, 0, 2, 1, 0, 1, 0};
      if (!std::isfinite(odd)) {
        EXPECT_THROW(method.check({points, kIdentity, indices}, {}), InvalidInput);
        continue;
      }
      const std::vector<Verdict> verdicts = method.check({points, kIdentity, indices}, {});
      EXPECT_EQ(verdicts[4], Verdict::inside);
      for (int i = 0; i < 4; ++i) EXPECT_EQ(verdicts[i], Verdict::unproved) << odd;
    }
  }
  for (const double tiny : {-0.0, 1e-310, -1e-40, 1e-44}) {
    EXPECT_EQ(check_one(volume, {{tiny, tiny, tiny}, {0.5 + tiny, tiny, 0}, {0.5, 0.5, tiny}}), Verdict::inside);
  }
}

TEST_F(GlCertificates, TolerancesFromTheLargestToWhatFloatCannotHold) {
  const TriangleMesh plane = shapes::grid(4);
  const auto over = [&](double tolerance, double height) {
    const double z = height * tolerance;
    return check_one(volume_of(plane, tolerance), {{0.30, 0.31, z}, {0.31, 0.31, z}, {0.31, 0.32, z}});
  };
  for (const double tolerance : {std::sqrt(2.0), 0.5, 1e-2, 1e-3, 1e-4}) {
    EXPECT_EQ(over(tolerance, 0.9), Verdict::inside) << tolerance;
    EXPECT_EQ(over(tolerance, 1 + 1e-6), Verdict::unproved) << tolerance;
  }
  for (const double tolerance : {2e-6, 1e-7, 1e-12}) EXPECT_EQ(over(tolerance, 0), Verdict::unproved) << tolerance;
}

TEST_F(GlCertificates, BatchesDoNotShow) {
  // More than one batch of triangles, and of those that the first look leaves open; quads take four each.
  const TriangleMesh torus = shapes::torus(40, 0.01);
  const ToleranceVolume volume = volume_of(torus, 0.05);
  const GlCertificate method(volume);
  std::vector<dvec3> few = hostile(torus, 0.05, 4'000, 9);
  const std::vector<Verdict> expected = check(method, few), quads = check(method, few, 4);
  EXPECT_NE(std::count(expected.begin(), expected.end(), Verdict::inside), 0);
  std::vector<dvec3> many;
  for (int i = 0; i < 70; ++i) many.insert(many.end(), few.begin(), few.end());
  Progress progress;
  const std::vector<Verdict> got = check(method, many, 3, &progress);
  for (std::size_t i = 0; i < got.size(); ++i) ASSERT_EQ(got[i], expected[i % expected.size()]);
  EXPECT_GT(progress.fraction(), 0.5);
  many.resize(30 * few.size());
  const std::vector<Verdict> of_quads = check(method, many, 4);
  for (std::size_t i = 0; i < of_quads.size(); ++i) ASSERT_EQ(of_quads[i], quads[i % quads.size()]);
  EXPECT_TRUE(check(method, {}).empty());
}

TEST_F(GlCertificates, AnswersTwoThreadsAtATime) {
  const TriangleMesh torus = shapes::torus(40, 0.01);
  const ToleranceVolume volume = volume_of(torus, 0.05);
  const GlCertificate method(volume);
  const std::vector<dvec3> first = hostile(torus, 0.05, 3'000, 1), second = hostile(torus, 0.05, 2'000, 2);
  const std::vector<Verdict> of_first = check(method, first), of_second = check(method, second);
  std::thread other([&] {
    for (int i = 0; i < 10; ++i) EXPECT_EQ(check(method, second), of_second);
  });
  for (int i = 0; i < 10; ++i) EXPECT_EQ(check(method, first), of_first);
  other.join();
}

TEST_F(GlCertificates, IsCancelled) {
  const TriangleMesh torus = shapes::torus(10);
  const ToleranceVolume volume = volume_of(torus, 0.05);
  Progress progress;
  progress.cancel();
  EXPECT_THROW(check(GlCertificate(volume), torus.vertices, 1, &progress), Cancelled);
}

TEST_F(GlCertificates, ALostContextAnswersNothing) {
  const TriangleMesh torus = shapes::torus(10);
  const ToleranceVolume volume = volume_of(torus, 0.05);
  const GlCertificate method(volume);
  EXPECT_EQ(check(method, torus.vertices, 1).at(0), Verdict::inside);
  gl::shutdown();
  EXPECT_THROW(check(method, torus.vertices, 1), GlUnavailable);
  EXPECT_EQ(check(GlCertificate(volume), torus.vertices, 1).at(0), Verdict::inside);
}

TEST_F(GlCertificates, RefusesWhatIsNotValid) {
  const ToleranceVolume volume = volume_of(shapes::torus(10), 0.05);
  const std::vector<dvec3> points(10);
  const std::vector<std::uint32_t> indices = {0, 1, 10};
  EXPECT_THROW(GlCertificate(volume).check({points, kIdentity, indices, 3}, {}), InvalidInput);
  EXPECT_THROW(GlCertificate(volume).check({points, kIdentity, indices, 5}, {}), InvalidInput);
  EXPECT_THROW(GlCertificate(volume).check({points, kIdentity, indices, 2}, {}), InvalidInput);
}

}  // namespace
