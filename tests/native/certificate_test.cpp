// SPDX-License-Identifier: GPL-3.0-or-later
// The results are judged by measure/hausdorff.h, whose bounds are its own. It shares native/geometry and native/base
// with the certificate, and is tested against brute force and CGAL.
#include "check/certificate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "base/errors.h"
#include "base/simd.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

const StoredSpace kIdentity(glm::dmat4(1), Storage::float64);

struct Candidates {
  std::vector<dvec3> points;  // three a candidate, in the world
  std::vector<std::uint32_t> indices;
};

std::vector<Verdict> check(const ToleranceVolume& volume, const Candidates& candidates, unsigned threads = 1) {
  return Certificate(volume).check({candidates.points, kIdentity, candidates.indices}, {threads, nullptr});
}

/// Candidates near the surface: a point of the reference moved by up to 2 epsilon along a random direction, two more
/// around it; then scaled so that every third has its largest distance within 2 % of epsilon.
Candidates near_surface(const TriangleMesh& reference, double tolerance, int count, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  const auto direction = [&] {
    dvec3 d;
    do d = {u(engine), u(engine), u(engine)};
    while (!(glm::dot(d, d) > 1e-3 && glm::dot(d, d) < 1));
    return glm::normalize(d);
  };
  Candidates result;
  for (int i = 0; i < count; ++i) {
    const glm::uvec3 t = reference.triangles[engine() % reference.triangles.size()];
    const double v = std::abs(u(engine)), w = std::abs(u(engine)) * (1 - v);
    const dvec3 on = reference.vertices[t.x] * (1 - v - w) + reference.vertices[t.y] * v + reference.vertices[t.z] * w;
    const double size = tolerance * std::pow(10.0, 2 * u(engine));
    const double away = i % 3 == 0 ? tolerance * (1 + 0.02 * u(engine)) : tolerance * std::abs(2 * u(engine));
    const dvec3 base = on + away * direction();
    for (int k = 0; k < 3; ++k) {
      result.indices.push_back(std::uint32_t(result.points.size()));
      result.points.push_back(k == 0 ? base : base + size * direction() * (i % 3 == 0 ? 0.05 : 1.0));
    }
  }
  return result;
}

struct Score {
  int inside = 0, outside = 0, wrong_inside = 0, wrong_outside = 0, unproved_clear = 0, clear = 0;
};

Score judge(const TriangleMesh& reference, double tolerance, const Candidates& candidates,
            const std::vector<Verdict>& verdicts) {
  Score score;
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    TriangleMesh one{{candidates.points[3 * i], candidates.points[3 * i + 1], candidates.points[3 * i + 2]},
                     {{0, 1, 2}}};
    const HausdorffInterval exact = hausdorff(one, reference, {tolerance, 1, nullptr});
    score.inside += verdicts[i] == Verdict::inside;
    score.outside += verdicts[i] == Verdict::outside;
    score.wrong_inside += verdicts[i] == Verdict::inside && exact.lower > tolerance;
    score.wrong_outside += verdicts[i] == Verdict::outside && exact.upper <= tolerance;
    const bool clear = exact.upper < 0.98 * tolerance || exact.lower > 1.02 * tolerance;
    score.clear += clear;
    score.unproved_clear += clear && verdicts[i] == Verdict::unproved;
  }
  return score;
}

class RandomCandidates : public testing::TestWithParam<double> {};

TEST_P(RandomCandidates, NoWrongVerdictAndFewUnproved) {
  const double tolerance = GetParam();
  // Each measurement builds a hierarchy of the reference, so that a small one leaves time for many candidates.
  for (const TriangleMesh& reference : {shapes::torus(20, 0.01), shapes::box(6)}) {
    const ToleranceVolume volume(reference.vertices, reference.triangles, kIdentity, tolerance);
    const int count = (is_full_run() ? 20'000 : many(10'000));
    const Candidates candidates = near_surface(reference, tolerance, count, 3);
    const Score score = judge(reference, tolerance, candidates, check(volume, candidates));
    EXPECT_EQ(score.wrong_inside, 0);
    EXPECT_EQ(score.wrong_outside, 0);
    EXPECT_LE(score.unproved_clear, score.clear / 1000);
    EXPECT_GT(score.inside, count / 20);
    EXPECT_GT(score.outside, count / 20);
  }
}

INSTANTIATE_TEST_SUITE_P(Tolerances, RandomCandidates, testing::Values(0.1, 0.01, 0.0003));

/// A fan of needles of the given height, some degenerate, at an offset from the origin.
TriangleMesh needles(double height, const dvec3& offset) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> u(-1, 1);
  TriangleMesh mesh;
  for (int i = 0; i < 60; ++i) {
    const dvec3 a = offset + dvec3(u(engine), u(engine), u(engine)),
                b = offset + dvec3(u(engine), u(engine), u(engine));
    const dvec3 c = a + std::abs(u(engine)) * (b - a) + height * dvec3(u(engine), u(engine), u(engine));
    const unsigned n = unsigned(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {a, b, i % 7 == 0 ? b : c});
    mesh.triangles.emplace_back(n, n + 1, n + 2);
  }
  return mesh;
}

TEST(HostileReferences, NoWrongVerdict) {
  const double tolerance = 1e-3;
  for (const double offset : {0.0, 1e4}) {
    for (int exponent = 2; exponent <= 7; ++exponent) {
      const TriangleMesh reference = needles(std::pow(10.0, -exponent), dvec3(offset));
      const ToleranceVolume volume(reference.vertices, reference.triangles, kIdentity, tolerance);
      const Candidates candidates = near_surface(reference, tolerance, many(3000), unsigned(exponent));
      const Score score = judge(reference, tolerance, candidates, check(volume, candidates));
      EXPECT_EQ(score.wrong_inside, 0) << "height 1e-" << exponent << " offset " << offset;
      EXPECT_EQ(score.wrong_outside, 0);
      EXPECT_GT(score.inside, many(100));
    }
  }
}

TEST(Certificate, TouchesTheToleranceFromBothSides) {
  const TriangleMesh plane = shapes::grid(4);
  const double tolerance = 0.125;
  const ToleranceVolume volume(plane.vertices, plane.triangles, kIdentity, tolerance);
  const auto over_one = [&](double z) {  // above a single triangle of the plane
    return check(volume, {{{0.05, 0.02, z}, {0.2, 0.03, z}, {0.2, 0.18, z}}, {0, 1, 2}})[0];
  };
  const auto over_many = [&](double z) {
    return check(volume, {{{0.1, 0.1, z}, {0.9, 0.2, z}, {0.4, 0.8, z}}, {0, 1, 2}})[0];
  };
  for (const double side : {-tolerance, tolerance}) {
    EXPECT_EQ(over_one(side * (1 - 1e-12)), Verdict::inside);
    EXPECT_EQ(over_one(side * (1 + 1e-12)), Verdict::outside);
    // A part that lies across two triangles is proved by one of them, which costs up to (floor)^2 / 2 of the tolerance.
    EXPECT_EQ(over_many(side * (1 - 5e-4)), Verdict::inside);
    EXPECT_NE(over_many(side * (1 - 1e-9)), Verdict::outside);
    EXPECT_EQ(over_many(side * (1 + 1e-9)), Verdict::outside);
  }
  EXPECT_NE(over_one(std::nextafter(tolerance, 1)), Verdict::inside) << "outside by the last bit";
  EXPECT_EQ(over_one(100), Verdict::outside);
}

TEST(Certificate, LargeAndBentPieces) {
  const TriangleMesh plane = shapes::grid(50);
  const ToleranceVolume volume(plane.vertices, plane.triangles, kIdentity, 0.01);
  // Covers thousands of reference triangles; then one corner leaves the plane by more than the tolerance.
  EXPECT_EQ(check(volume, {{{0, 0, 0.005}, {1, 0, 0.005}, {0, 1, 0.005}}, {0, 1, 2}})[0], Verdict::inside);
  EXPECT_EQ(check(volume, {{{0, 0, 0.005}, {1, 0, 0.005}, {0, 1, 0.012}}, {0, 1, 2}})[0], Verdict::outside);
  // All corners near, the middle not: a chord of the torus.
  const TriangleMesh torus = shapes::torus(60);
  const ToleranceVolume ring(torus.vertices, torus.triangles, kIdentity, 0.02);
  EXPECT_EQ(check(ring, {{{1.4, 0, 0}, {-0.7, 1.2, 0}, {-0.7, -1.2, 0}}, {0, 1, 2}})[0], Verdict::outside);
}

TEST(Certificate, ProvesLargeFacesOverTrianglesOfAnySize) {
  // Cutting along one reference triangle after the other must not go round in circles.
  const TriangleMesh plane = shapes::grid(30);  // of side 1
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> u(0, 1);
  for (const double tolerance : {0.1, 0.02, 0.005, 0.001}) {
    const ToleranceVolume volume(plane.vertices, plane.triangles, kIdentity, tolerance, {});
    Candidates faces;
    for (std::uint32_t i = 0; i < 3'000; ++i) {
      const dvec3 middle(u(engine), u(engine), 0);
      const double size = 0.5 * u(engine);
      for (int k = 0; k < 3; ++k) {
        const dvec3 p = middle + size * dvec3(u(engine) - 0.5, u(engine) - 0.5, 0);
        faces.points.push_back({std::clamp(p.x, 0.0, 1.0), std::clamp(p.y, 0.0, 1.0), 0.9 * tolerance * u(engine)});
        faces.indices.push_back(3 * i + static_cast<std::uint32_t>(k));
      }
    }
    const std::vector<Verdict> verdicts = check(volume, faces);
    EXPECT_EQ(std::count(verdicts.begin(), verdicts.end(), Verdict::inside), 3'000) << "at " << tolerance;
  }
}

TEST(Certificate, APointOutsideIsSoughtAmongTheHintsBeforeTheHierarchy) {
  // Among triangles as large as the cube that they fill, a search looks at a share of all of them, and polls.
  TriangleMesh tangle;
  shapes::Random random(2);
  for (std::uint32_t i = 0; i < 50'000; ++i) {
    for (int k = 0; k < 3; ++k) tangle.vertices.push_back(0.3 * random.point());
    tangle.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  const Witnesses witnesses(tangle);
  const Hierarchy hierarchy(tangle);
  const DistanceGrid no_grid;
  const TriangleCertificate certificate(witnesses, no_grid, hierarchy, 0.001, 0.0011);
  const dvec3 by(0, 0, 0.0001),
      corners[3] = {tangle.vertices[0] + by, tangle.vertices[1] + by, tangle.vertices[2] + by};
  EXPECT_GT(polls_of([&] { EXPECT_FALSE(certificate.point_outside(corners)); }), 0u);
  EXPECT_EQ(polls_of([&] { EXPECT_FALSE(certificate.point_outside(corners, nullptr, {7, 0, 9})); }), 0u);
}

TEST(Certificate, AsksTheNodesAroundAPartBeforeTheHierarchy) {
  // A search of the hierarchy takes ten times as long as a look at a node. The searches are counted by a hierarchy that
  // is made of triangles across all space, so that each search looks at most of its nodes, and polls.
  const double tolerance = 0.003;
  TriangleMesh rough = shapes::grid(100);  // of side 1; the triangles are about three tolerances long
  std::mt19937 engine(4);
  std::uniform_real_distribution<double> u(0, 1);
  for (dvec3& p : rough.vertices) p += tolerance * dvec3(u(engine), u(engine), u(engine) - 0.5);
  const ToleranceVolume volume(rough.vertices, rough.triangles, kIdentity, tolerance);
  const StoredSpace placed = kIdentity.in(volume.frame());
  TriangleMesh across;
  for (std::uint32_t i = 0; i < volume.reference().triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) across.vertices.emplace_back(4 * u(engine) - 2, 4 * u(engine) - 2, 4 * u(engine) - 2);
    across.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  const Hierarchy slow(across);
  const TriangleCertificate certificate(volume.witnesses(), volume.grid(), slow, volume.provable(0),
                                        volume.refutable(0));
  const auto prove = [&] {
    for (int i = 0; i < 20; ++i) {
      const dvec3 at(0.1 + 0.6 * u(engine), 0.1 + 0.6 * u(engine), 0);
      dvec3 corners[3];
      for (dvec3& p : corners) p = placed.frame(at + 0.2 * dvec3(u(engine), u(engine), 0));
      EXPECT_NE(certificate.bound(corners, dvec3(TriangleCertificate::kUnproved)), TriangleCertificate::kUnproved);
    }
  };
  EXPECT_LE(polls_of(prove), 60) << "a search for each part that the nearest node does not settle takes 337";
}

TEST(Certificate, AmongNeedlesSideBySideFewSearchesAreInVain) {
  // Two fans of needles between two lines close to each other, each from an end of one line to the other line: many are
  // nearly as near to a point as the nearest one. A face that moved by less than the tolerance is cut into many parts.
  TriangleMesh fans;
  std::mt19937 engine(6);
  std::uniform_real_distribution<double> u(0, 1);
  const std::uint32_t count = many(20'000);
  for (const double y : {0.0, 1e-4}) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const double x = static_cast<double>(i) / (count - 1);
      fans.vertices.emplace_back(0.6 * x - 0.8 * y, 0.48 * x + 0.36 * y, 0.64 * x + 0.48 * y);
    }
  }
  for (std::uint32_t i = 0; i + 1 < count; ++i) {
    fans.triangles.emplace_back(i, i + 1, 2 * count - 1);
    fans.triangles.emplace_back(i + count, 0, i + count + 1);
  }
  fans = shapes::stored(fans);  // where they overlap, rounding decides which one is the nearest
  const double tolerance = 0.005;
  const ToleranceVolume volume(fans.vertices, fans.triangles, kIdentity, tolerance);
  ASSERT_TRUE(volume.hierarchy().has_mostly_needles());
  const StoredSpace placed = kIdentity.in(volume.frame());
  const TriangleCertificate certificate(volume.witnesses(), volume.grid(), volume.hierarchy(), volume.provable(0),
                                        volume.refutable(0));
  const std::size_t polls = polls_of([&] {
    for (std::uint32_t f = 0; f < 2 * count - 2; f += 100) {
      dvec3 corners[3];
      for (int k = 0; k < 3; ++k) {
        const dvec3 by = tolerance * dvec3(u(engine) - 0.5, u(engine) - 0.5, u(engine) - 0.5);
        corners[k] = placed.frame(fans.vertices[fans.triangles[f][k]] + by);
      }
      const double bound = certificate.bound_in_any_order(corners, dvec3(TriangleCertificate::kUnproved));
      EXPECT_NE(bound, TriangleCertificate::kUnproved);
    }
  });
  EXPECT_LT(polls, 500) << "a search for each part that no node helps to cut takes 2,439";
}

TEST(Certificate, ProbesFindWhatHasNoProofAndNothingElse) {
  const TriangleMesh torus = shapes::torus(60);
  const double tolerance = 0.02;
  const ToleranceVolume volume(torus.vertices, torus.triangles, kIdentity, tolerance);
  const StoredSpace placed = kIdentity.in(volume.frame());
  const TriangleCertificate certificate(volume.witnesses(), volume.grid(), volume.hierarchy(), volume.provable(0),
                                        volume.refutable(0));
  std::mt19937 engine(9);
  std::uniform_real_distribution<double> u(0, 1);
  int outside = 0, shown = 0;
  for (int i = 0; i < 3000; ++i) {
    // Corners on the torus, chords and saddles between them.
    const double around = 6.28 * u(engine), across = 6.28 * u(engine), size = 0.6 * u(engine);
    dvec3 corners[3];
    for (dvec3& p : corners) {
      const double s = around + size * u(engine), t = across + 2 * size * u(engine);
      p = placed.frame(
          dvec3((1 + 0.4 * std::cos(t)) * std::cos(s), (1 + 0.4 * std::cos(t)) * std::sin(s), 0.4 * std::sin(t)));
    }
    const Verdict verdict = certificate.verdict(corners, dvec3(TriangleCertificate::kUnproved));
    const bool shows = certificate.point_outside(corners).has_value();
    EXPECT_FALSE(shows && verdict == Verdict::inside);
    const dvec3 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    const double distance = volume.hierarchy().nearest(middle).distance;
    EXPECT_EQ(certificate.is_open(middle, nullptr), distance > certificate.limit() + 0x1p-40) << distance;
    outside += verdict == Verdict::outside, shown += shows;
  }
  EXPECT_GT(outside, 300);
  EXPECT_GT(shown, 0.9 * outside);
  EXPECT_LT(outside, 2700);
}

TEST(Certificate, PointsSegmentsAndQuads) {
  const TriangleMesh plane = shapes::grid(4);
  const ToleranceVolume volume(plane.vertices, plane.triangles, kIdentity, 0.1);
  const auto verdict = [&](const std::vector<dvec3>& points) {
    std::vector<std::uint32_t> indices(points.size());
    for (std::uint32_t i = 0; i < indices.size(); ++i) indices[i] = i;
    return Certificate(volume).check({points, kIdentity, indices, int(points.size())}, {})[0];
  };
  EXPECT_EQ(verdict({{0.5, 0.5, 0.09}}), Verdict::inside);
  EXPECT_EQ(verdict({{0.5, 0.5, 0.11}}), Verdict::outside);
  EXPECT_EQ(verdict({{0.1, 0.5, 0.09}, {0.9, 0.5, -0.09}}), Verdict::inside);
  EXPECT_EQ(verdict({{0.1, 0.5, 0.09}, {1.5, 0.5, 0}}), Verdict::outside);
  EXPECT_EQ(verdict({{0, 0, 0.09}, {1, 0, -0.09}, {1, 1, 0.09}, {0, 1, -0.09}}), Verdict::inside);
  // Within in one triangulation, outside in the other: a quad is judged in both.
  const TriangleMesh roof{{{0, 0, 0}, {1, 0, 0.5}, {1, 1, 0}, {0, 1, 0.5}}, {{0, 1, 3}, {1, 2, 3}}};
  const ToleranceVolume over(roof.vertices, roof.triangles, kIdentity, 0.1);
  const std::vector<std::uint32_t> quad{0, 1, 2, 3}, halves{0, 1, 3, 1, 2, 3};
  EXPECT_EQ(Certificate(over).check({roof.vertices, kIdentity, quad, 4}, {})[0], Verdict::outside);
  EXPECT_EQ(Certificate(over).check({roof.vertices, kIdentity, halves, 3}, {})[0], Verdict::inside);
  EXPECT_THROW(Certificate(over).check({roof.vertices, kIdentity, quad, 5}, {}), InvalidInput);
}

/// Triangles of a rough mesh whose corners have moved apart until the proof that is left is the last: a little farther
/// there is none.
std::vector<dvec3> barely_inside(const ToleranceVolume& volume, const TriangleCertificate& certificate, int count,
                                 unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  const TriangleMesh& reference = volume.reference();
  std::vector<dvec3> result;
  while (result.size() < 3 * static_cast<std::size_t>(count)) {
    const glm::uvec3 t = reference.triangles[engine() % reference.triangles.size()];
    const dvec3 step[3] = {
        {u(engine), u(engine), u(engine)}, {u(engine), u(engine), u(engine)}, {u(engine), u(engine), u(engine)}};
    const auto moved = [&](double by, dvec3(&corners)[3]) {
      for (int k = 0; k < 3; ++k) corners[k] = reference.vertices[t[k]] + by * step[k];
    };
    dvec3 corners[3];
    double inside = 0, beyond = 3 * volume.frame_tolerance();
    for (int halving = 0; halving < 14; ++halving) {
      const double middle = 0.5 * (inside + beyond);
      moved(middle, corners);
      const bool proved = certificate.verdict(corners, dvec3(TriangleCertificate::kUnproved)) == Verdict::inside;
      (proved ? inside : beyond) = middle;
    }
    moved(inside, corners);
    result.insert(result.end(), corners, corners + 3);
  }
  return result;
}

TEST(Certificate, WhatIsProvedOfAPieceIsProvedOfItsParts) {
  const TriangleMesh reference = shapes::torus(40, 0.03);
  for (const double tolerance : {0.1, 0.03, 0.01}) {
    const ToleranceVolume volume(reference.vertices, reference.triangles, kIdentity, tolerance);
    const TriangleCertificate certificate(volume.witnesses(), volume.grid(), volume.hierarchy(), volume.provable(0),
                                          volume.refutable(0));
    std::vector<dvec3> points = barely_inside(volume, certificate, is_full_run() ? 13'000 : many(2'000), 17);
    for (dvec3& p : points) p = volume.frame().to_world(p);
    const Certificate check(volume);
    std::vector<std::uint32_t> whole(points.size());
    std::iota(whole.begin(), whole.end(), 0u);
    const std::vector<Verdict> verdicts = check.check({points, kIdentity, whole}, {});
    std::size_t inside = 0;
    for (const std::vector<std::uint32_t>& part : std::vector<std::vector<std::uint32_t>>{
             {0},          {1},          {2},          {0, 1},       {1, 0},      {1, 2},       {2, 1},
             {2, 0},       {0, 2},       {1, 2, 0},    {2, 0, 1},    {2, 1, 0},   {1, 0, 2},    {0, 2, 1},
             {0, 0, 1},    {0, 1, 0},    {0, 1, 1},    {2, 1, 2},    {2, 2, 2},   {0, 1, 2, 0}, {0, 1, 2, 2},
             {0, 0, 1, 2}, {0, 1, 1, 2}, {1, 0, 1, 2}, {2, 0, 2, 0}, {1, 1, 0, 0}}) {
      std::vector<std::uint32_t> indices;
      for (std::uint32_t i = 0; i < points.size(); i += 3) {
        if (verdicts[i / 3] != Verdict::inside) continue;
        for (const std::uint32_t corner : part) indices.push_back(i + corner);
      }
      const std::vector<Verdict> of_parts =
          check.check({points, kIdentity, indices, static_cast<int>(part.size())}, {});
      inside = of_parts.size();
      EXPECT_EQ(std::count(of_parts.begin(), of_parts.end(), Verdict::inside), static_cast<std::ptrdiff_t>(inside))
          << testing::PrintToString(part) << " at " << tolerance;
    }
    EXPECT_GT(inside, points.size() / 3 * 9 / 10);
  }
}

TEST(Certificate, SameVerdictsOnAnyThreadsAndInstructions) {
  const TriangleMesh reference = shapes::torus(30, 0.01);
  const ToleranceVolume volume(reference.vertices, reference.triangles, kIdentity, 0.01);
  const Candidates candidates = near_surface(reference, 0.01, 5000, 11);
  const std::vector<Verdict> one = check(volume, candidates);
  EXPECT_EQ(one, check(volume, candidates, 2));
  EXPECT_EQ(one, check(volume, candidates, 5));
  const Simd best = simd_path();
  simd_path() = Simd::portable;
  EXPECT_EQ(one, check(volume, candidates));
  simd_path() = best;
}

TEST(Certificate, HoldsAtAnyPrecision) {
  const TriangleMesh reference = shapes::torus(30, 0.01);
  const Candidates candidates = near_surface(reference, 0.03, many(3000), 12);
  for (const double precision : {0.01, 0.1, 0.5, 2.0, 4.0}) {
    ToleranceVolume::Options options;
    options.precision = precision;
    const ToleranceVolume volume(reference.vertices, reference.triangles, kIdentity, 0.03, options);
    EXPECT_NEAR(volume.precision(), precision, 1e-9);
    const Score score = judge(reference, 0.03, candidates, check(volume, candidates));
    EXPECT_EQ(score.wrong_inside + score.wrong_outside, 0);
    EXPECT_LE(score.unproved_clear, score.clear / 1000);
  }
}

TEST(ToleranceVolume, RefusesWhatItCannotHold) {
  const TriangleMesh mesh = shapes::torus(10);
  const auto make = [&](double tolerance, double away = 0) {
    glm::dmat4 to_world(1);
    to_world[3] = {away, away, away, 1};
    ToleranceVolume(mesh.vertices, mesh.triangles, StoredSpace(to_world, Storage::float64), tolerance);
  };
  EXPECT_NO_THROW(make(0.01));
  EXPECT_NO_THROW(make(0.01, 1e14));
  EXPECT_THROW(make(0.01, 1e17), InvalidInput) << "no double is near the centre";
  EXPECT_THROW(make(1e-14), InvalidInput) << "rounding is larger";
  for (const double bad :
       {0.0, -1.0, 10.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(make(bad), InvalidInput) << bad;
  }
}

TEST(ToleranceVolume, AnyScaleGivesTheSameVerdicts) {
  const TriangleMesh reference = shapes::torus(20, 0.01);
  const Candidates candidates = near_surface(reference, 0.02, 2000, 13);
  const auto verdicts = [&](double scale) {
    TriangleMesh mesh = reference;
    Candidates moved = candidates;
    for (dvec3& p : mesh.vertices) p *= scale;
    for (dvec3& p : moved.points) p *= scale;
    const ToleranceVolume volume(mesh.vertices, mesh.triangles, kIdentity, 0.02 * scale);
    return check(volume, moved);
  };
  const std::vector<Verdict> one = verdicts(1);
  for (const double scale : {0x1p-60, 0x1p-500, 0x1p60, 0x1p500}) EXPECT_EQ(one, verdicts(scale));
}

TEST(Groups, EveryPieceGetsTheWorstOfItsGroup) {
  std::vector<Verdict> verdicts{Verdict::inside, Verdict::outside, Verdict::inside, Verdict::unproved};
  const std::vector<std::int32_t> groups{1, 1, 2, -3};
  combine_groups(verdicts, groups);
  EXPECT_EQ(verdicts, (std::vector{Verdict::outside, Verdict::outside, Verdict::inside, Verdict::unproved}));
  EXPECT_THROW(combine_groups(verdicts, std::span(groups).first(2)), InvalidInput);
}

}  // namespace
