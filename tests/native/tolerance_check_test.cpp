// SPDX-License-Identifier: GPL-3.0-or-later
// What every check that proves must say, whichever way it finds out. The paper's own, which proves nothing, has
// paper_test.cpp.
#include "check/tolerance_check.h"

#include <gtest/gtest.h>

#include <memory>

#include "base/errors.h"
#include "candidates.h"
#include "check/methods.h"
#ifdef TOLVOL_GL
#include "gl_fixture.h"
#endif

namespace {

using namespace tolvol;
using candidates::ask;
using candidates::kIdentity;
using candidates::Maker;
using candidates::Points;
using glm::dvec3;

constexpr double kTolerance = 0.05;
// Fine enough for the methods that interpolate.
constexpr double kPrecision = 6;
// Of the tolerance: nearer than this every method at that precision must see, but for what it cannot at all.
constexpr double kSeen = 0.7;

std::unique_ptr<ToleranceVolume> make_volume(const TriangleMesh& reference, double tolerance = kTolerance,
                                             double precision = kPrecision) {
  ToleranceVolume::Options options;
  options.precision = precision;
  return std::make_unique<ToleranceVolume>(reference.vertices, reference.triangles, kIdentity, tolerance, options);
}

class ProvingCheck : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
#ifdef TOLVOL_GL
    if (std::string(GetParam()) != "certificate") require_gl();
#endif
  }
  std::vector<Verdict> ask_about(const TriangleMesh& reference, const Points& points, int corners = 3) {
    const std::unique_ptr<ToleranceVolume> volume = make_volume(reference);
    return ask(*make_check(GetParam(), *volume), points, corners);
  }
  bool inside(const TriangleMesh& reference, const Points& points) {
    return ask_about(reference, points, int(points.size())).at(0) == Verdict::inside;
  }
  bool inside_or_refused(const TriangleMesh& reference, const Points& points) {
    try {
      return inside(reference, points);
    } catch (const InvalidInput&) {
      return false;  // so far off that doubles cannot hold the tolerance there
    }
  }
};

TEST_P(ProvingCheck, SeesAParallelPlaneOnBothSidesOfTheTolerance) {
  const TriangleMesh plane = shapes::grid(8);
  for (const double side : {-1.0, 1.0}) {
    for (const double height : {0.0, 0.3, kSeen}) {
      const double z = side * height * kTolerance;
      EXPECT_TRUE(inside(plane, {{0.1, 0.1, z}, {0.9, 0.2, z}, {0.3, 0.8, z}})) << z;
    }
    for (const double height : {1 + 1e-6, 1.1, 2.0}) {
      const double z = side * height * kTolerance;
      EXPECT_FALSE(inside(plane, {{0.1, 0.1, z}, {0.9, 0.2, z}, {0.3, 0.8, z}})) << z;
      EXPECT_FALSE(inside(plane, {{0.1, 0.1, 0}, {0.9, 0.2, 0}, {0.3, 0.8, z}})) << z;
    }
  }
}

TEST_P(ProvingCheck, SeesASphereOnBothSidesOfTheTolerance) {
  const TriangleMesh sphere = shapes::torus(64);  // its tube has radius 0.4
  const auto at = [](double r, double u, double v) {
    return dvec3((1 + r * std::cos(v)) * std::cos(u), (1 + r * std::cos(v)) * std::sin(u), r * std::sin(v));
  };
  Points near, far;
  for (int i = 0; i < 500; ++i) {
    const double u = 0.1 * i, v = 0.37 * i;
    for (const dvec3& d : {dvec3(0, 0, 0), dvec3(0.01, 0, 0), dvec3(0, 0.01, 0)}) {
      near.push_back(at(0.4 + 0.5 * kTolerance * std::sin(i), u + d.x, v + d.y));
      far.push_back(at(0.4 + (i % 2 ? 1.2 : -1.2) * kTolerance, u + d.x, v + d.y));
    }
  }
  for (const Verdict v : ask_about(sphere, near)) EXPECT_EQ(v, Verdict::inside);
  for (const Verdict v : ask_about(sphere, far)) EXPECT_NE(v, Verdict::inside);
}

TEST_P(ProvingCheck, TriangleSmallerThanACellAndLargerThanAnyFramebufferCell) {
  const TriangleMesh plane = shapes::grid(8);
  for (const double size : {1e-12, 1e-6, 1e-3, 0.9}) {
    const Points points{{0.05, 0.05, 0.01}, {0.05 + size, 0.05, 0.01}, {0.05, 0.05 + size, -0.01}};
    EXPECT_TRUE(inside(plane, points)) << size;
    for (int k = 0; k < 3; ++k) {
      Points moved = points;
      moved[k].z = 1.001 * kTolerance;
      EXPECT_FALSE(inside(plane, moved)) << size << " corner " << k;
    }
  }
  // Lattices of up to 1,800 subdivisions.
  TriangleMesh strip = shapes::grid(8);
  for (dvec3& p : strip.vertices) p.x *= 15;
  EXPECT_TRUE(inside(strip, {{0.1, 0.1, 0.01}, {14.9, 0.2, 0.01}, {10, 0.9, 0.01}}));
  EXPECT_FALSE(inside(strip, {{0.1, 0.1, 0.01}, {15.1, 0.2, 0.01}, {10, 0.9, 0.01}}));
}

TEST_P(ProvingCheck, SliversAndOneCornerOut) {
  const TriangleMesh plane = shapes::grid(8);
  for (const double width : {1e-3, 1e-6, 1e-9, 0.0}) {
    const Points sliver{{0.1, 0.5, 0.01}, {0.9, 0.5, 0.01}, {0.4, 0.5 + width, 0.01}};
    EXPECT_TRUE(inside(plane, sliver)) << width;
    Points out = sliver;
    out[1].z = 1.01 * kTolerance;
    EXPECT_FALSE(inside(plane, out)) << width;
  }
}

TEST_P(ProvingCheck, NeedlesOfTheReferenceDoNotMislead) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> u(0, 1);
  for (const double height : {1e-1, 1e-3, 1e-5, 1e-7, 0.0}) {
    TriangleMesh needles;
    for (unsigned i = 0; i < 60; ++i) {
      const dvec3 a(u(engine), u(engine), u(engine)), b(u(engine), u(engine), u(engine)),
          across = glm::normalize(glm::cross(b - a, dvec3(u(engine), u(engine), u(engine)) - 0.5));
      needles.vertices.insert(needles.vertices.end(), {a, b, a + u(engine) * (b - a) + height * across});
      needles.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    const double tolerance = 0.05;
    const std::unique_ptr<ToleranceVolume> volume = make_volume(needles, tolerance);
    const Points points = Maker(needles, tolerance, 7).all_kinds(4'000);
    const Points in = candidates::accepted(points, ask(*make_check(GetParam(), *volume), points));
    EXPECT_GT(in.size(), 300u) << height;
    EXPECT_EQ(candidates::farther(in, needles, tolerance), 0) << height;
  }
}

TEST_P(ProvingCheck, RandomAndHostileCandidates) {
  const std::pair<const char*, TriangleMesh> references[] = {
      {"torus", shapes::torus(48, 0.01)}, {"box", shapes::box(6)}, {"soup", shapes::soup(shapes::torus(16))}};
  for (const auto& [name, reference] : references) {
    const std::unique_ptr<ToleranceVolume> volume = make_volume(reference);
    const Points points = Maker(reference, kTolerance, 3).all_kinds(20'000);
    const Points in = candidates::accepted(points, ask(*make_check(GetParam(), *volume), points));
    EXPECT_GT(in.size(), 3 * 3'000u) << name;
    EXPECT_EQ(candidates::farther(in, reference, kTolerance), 0) << name;
  }
}

// Its distances are not exact, and most of its nodes have no triangle.
TEST_P(ProvingCheck, AFieldByFastMarchingDoesNotMislead) {
  const TriangleMesh torus = shapes::torus(32, 0.01);
  const double tolerance = 2 * kTolerance;
  ToleranceVolume::Options options;
  options.precision = 3;
  options.field = Field::fast_marching;
  const ToleranceVolume volume(torus.vertices, torus.triangles, kIdentity, tolerance, options);
  const Points points = Maker(torus, tolerance, 3).all_kinds(5'000);
  const Points in = candidates::accepted(points, ask(*make_check(GetParam(), volume), points));
  EXPECT_GT(in.size(), 0u);
  EXPECT_EQ(candidates::farther(in, torus, tolerance), 0);
}

TEST_P(ProvingCheck, OutsideTheGridAndNotFinite) {
  const TriangleMesh plane = shapes::grid(8);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double far : {5.0, -5.0, 1e6, 1e30, 1e300, nan, infinity, -infinity}) {
    EXPECT_FALSE(inside_or_refused(plane, {{0.1, 0.1, 0}, {0.9, 0.2, 0}, {0.3, 0.8, far}})) << far;
    EXPECT_FALSE(inside_or_refused(plane, {{far, 0.1, 0}, {far, 0.2, 0}, {far, 0.8, 0}})) << far;
    EXPECT_FALSE(inside_or_refused(plane, {{0.5, far, 0}})) << far;
  }
}

TEST_P(ProvingCheck, PiecesOfOneToFourCorners) {
  const TriangleMesh plane = shapes::grid(8);
  const Points ring{{0.2, 0.2, 0.01}, {0.8, 0.2, -0.01}, {0.8, 0.8, 0.01}, {0.2, 0.8, -0.01}};
  for (std::size_t corners = 1; corners <= 4; ++corners) {
    for (std::size_t out = 0; out <= corners; ++out) {
      Points points(ring.begin(), ring.begin() + std::ptrdiff_t(corners));
      if (out < corners) points[out].z = 1.01 * kTolerance;
      EXPECT_EQ(inside(plane, points), out == corners) << corners << " corners, " << out;
    }
  }
  // A quad over a gap: one of its diagonals crosses it, the other does not.
  TriangleMesh gap = shapes::grid(8);
  std::erase_if(gap.triangles, [&](const glm::uvec3& t) {
    const dvec3 c = (gap.vertices[t.x] + gap.vertices[t.y] + gap.vertices[t.z]) / 3.0;
    return c.x < 0.5 && c.y < 0.5;
  });
  const Points arrow{{0.9, 0.9, 0}, {0.1, 0.7, 0}, {0.6, 0.6, 0}, {0.7, 0.1, 0}};
  EXPECT_FALSE(inside(gap, arrow));
  EXPECT_TRUE(inside(gap, {arrow[0], arrow[1], arrow[2]}));
  EXPECT_TRUE(inside(gap, {arrow[0], arrow[2], arrow[3]}));
}

TEST_P(ProvingCheck, GroupsTakeTheLeastVerdictInAnyOrder) {
  const TriangleMesh torus = shapes::torus(32);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(torus);
  const std::unique_ptr<ToleranceCheck> check = make_check(GetParam(), *volume);
  const Points points = Maker(torus, kTolerance, 9).all_kinds(3'000);
  const std::vector<std::uint32_t> indices = candidates::corners(points.size());
  const Pieces pieces{points, kIdentity, indices};
  std::vector<std::int32_t> groups(points.size() / 3);
  std::mt19937 engine(1);
  for (std::int32_t& g : groups) g = std::int32_t(std::int64_t(engine() % 1'000) * 4'000'000 - 2'000'000'000);
  std::vector<Verdict> expected = check->check(pieces, {});
  combine_groups(expected, groups);
  EXPECT_EQ(check->check_groups(pieces, groups, {}), expected);
  EXPECT_GT(std::count(expected.begin(), expected.end(), Verdict::inside), 100);
  const std::vector<std::int32_t> one(points.size() / 3, -7);
  EXPECT_NE(check->check_groups(pieces, one, {}).at(17), Verdict::inside);
  EXPECT_THROW(check->check_groups(pieces, std::span(one).first(5), {}), InvalidInput);
}

TEST_P(ProvingCheck, RefusesPiecesThatAreNot) {
  const TriangleMesh plane = shapes::grid(2);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(plane);
  const std::unique_ptr<ToleranceCheck> check = make_check(GetParam(), *volume);
  const Points points(4, dvec3(0));
  const std::vector<std::uint32_t> indices{0, 1, 2, 3, 4, 0};
  EXPECT_THROW(check->check({points, kIdentity, indices, 3}, {}), InvalidInput);
  EXPECT_THROW(check->check({points, kIdentity, std::span(indices).first(4), 3}, {}), InvalidInput);
  EXPECT_THROW(check->check({points, kIdentity, indices, 6}, {}), InvalidInput);
  EXPECT_THROW(check->check({points, kIdentity, indices, 0}, {}), InvalidInput);
  EXPECT_TRUE(check->check({points, kIdentity, {}, 3}, {}).empty());
}

TEST_P(ProvingCheck, TheMappingErrorOfUsedPointsCountsAgainstTheTolerance) {
  constexpr double kSmall = 0.01;
  const TriangleMesh plane = shapes::grid(2);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(plane, kSmall);
  const std::unique_ptr<ToleranceCheck> check = make_check(GetParam(), *volume);
  // Where the points are stored, large numbers cancel under a shear, so that placing the second one may err by this
  // share of the tolerance.
  const auto verdict = [&](double share, const std::vector<std::uint32_t>& used) {
    const double shear = std::round(share * kSmall / (165 * kUnitRoundoff));
    glm::dmat4 to_world(1);
    to_world[1].x = shear;
    const Points points{{0.5 - 0.5 * shear, 0.5, 0.6 * kSmall}, {0.5 - 8 * shear, 8, 0}};
    return check->check({points, StoredSpace(to_world, Storage::float64), used, 1}, {}).at(0);
  };
  EXPECT_EQ(verdict(0, {0, 1}), Verdict::inside);
  EXPECT_EQ(verdict(1, {0}), Verdict::inside) << "the second point is not used";
  EXPECT_NE(verdict(0.45, {0, 1}), Verdict::inside);
  EXPECT_THROW(verdict(1, {0, 1}), InvalidInput);
}

TEST_P(ProvingCheck, AFarOriginCostsNothing) {
  const TriangleMesh plane = shapes::grid(2);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(plane);
  const std::unique_ptr<ToleranceCheck> check = make_check(GetParam(), *volume);
  const std::vector<std::uint32_t> index{0};
  for (const double far : {1e5, 1e10, 1e15}) {
    glm::dmat4 to_world(1);
    to_world[3].x = far;
    const Points points{{-far, 0.5, 0.9 * kTolerance}};
    EXPECT_EQ(check->check({points, StoredSpace(to_world, Storage::float64), index, 1}, {}).at(0), Verdict::inside);
  }
}

TEST_P(ProvingCheck, APointFarAwayCostsTheOthersNothing) {
  const TriangleMesh plane = shapes::grid(2);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(plane);
  const Points points{{0.5, 0.5, 0.6 * kTolerance}, {1e300, 0.5, 0}};
  const std::vector<Verdict> verdicts = ask(*make_check(GetParam(), *volume), points, 1);
  EXPECT_EQ(verdicts[0], Verdict::inside);
  EXPECT_NE(verdicts[1], Verdict::inside);
}

TEST_P(ProvingCheck, CanBeCancelledAndNamesItself) {
  const TriangleMesh torus = shapes::torus(32);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(torus);
  const std::unique_ptr<ToleranceCheck> check = make_check(GetParam(), *volume);
  const Points points = Maker(torus, kTolerance, 9).all_kinds(2'000);
  Progress progress;
  progress.cancel();
  EXPECT_THROW(check->check({points, kIdentity, candidates::corners(points.size())}, {1, &progress}), Cancelled);
  EXPECT_EQ(check->method(), GetParam());
  EXPECT_EQ(check->renderer() == "CPU", check->method() == "certificate");
}

#ifdef TOLVOL_GL
INSTANTIATE_TEST_SUITE_P(Methods, ProvingCheck, testing::Values("certificate", "gl_certificate", "occlusion_query"),
                         [](const auto& info) { return std::string(info.param); });
#else
INSTANTIATE_TEST_SUITE_P(Methods, ProvingCheck, testing::Values("certificate"),
                         [](const auto& info) { return std::string(info.param); });
#endif

TEST(Methods, UnknownOnesAreRefusedWithTheNamesOfTheOthers) {
  const TriangleMesh plane = shapes::grid(2);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(plane);
  try {
    make_check("query", *volume);
    FAIL();
  } catch (const InvalidInput& error) {
    for (const char* name : {"\"query\"", "certificate", "gl_certificate", "occlusion_query", "paper"}) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
#ifndef TOLVOL_GL
  for (const char* name : {"gl_certificate", "occlusion_query", "paper", "paper_half_h"}) {
    EXPECT_THROW(make_check(name, *volume), GlUnavailable) << name;
  }
#endif
}

}  // namespace
