// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/hausdorff.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/progress.h"
#include "measures.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using namespace tolvol::measures;

TriangleMesh box(double half) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.push_back(half * dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  for (const auto& [a, b, c, d] : {std::array{0u, 1u, 3u, 2u},
                                   {4u, 6u, 7u, 5u},
                                   {0u, 4u, 5u, 1u},
                                   {2u, 3u, 7u, 6u},
                                   {0u, 2u, 6u, 4u},
                                   {1u, 5u, 7u, 3u}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

TriangleMesh soup(shapes::Random& random, int triangles, double size) {
  TriangleMesh mesh;
  for (int i = 0; i < triangles; ++i) {
    const dvec3 centre = random.point();
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(centre + size * random.point());
    mesh.triangles.push_back(glm::uvec3(3 * i) + glm::uvec3(0, 1, 2));
  }
  return mesh;
}

void expect_contains(const HausdorffInterval& h, double truth, double rounding = 0) {
  EXPECT_LE(h.lower, truth + rounding);
  EXPECT_GE(h.upper, truth - rounding);
}

using Long = glm::vec<3, long double>;

/// Exact but for the rounding of long double; not for needles.
long double exact_distance(const Long& p, const Long& a, const Long& b, const Long& c) {
  const Long n = glm::cross(b - a, c - a);
  const Long* corner[] = {&a, &b, &c, &a};
  bool above = true;
  long double nearest = std::numeric_limits<long double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const Long from = *corner[i], edge = *corner[i + 1] - from;
    const long double t = glm::clamp(glm::dot(p - from, edge) / glm::dot(edge, edge), 0.0L, 1.0L);
    nearest = std::min(nearest, glm::length(p - from - t * edge));
    above = above && glm::dot(glm::cross(edge, p - from), n) >= 0;
  }
  return above ? std::abs(glm::dot(n, p - a)) / glm::length(n) : nearest;
}

// From one triangle to another the distance is largest at a corner: known to more digits than a double has.
TEST(Hausdorff, RoundingIsInside) {
  shapes::Random random(7);
  for (int round = 0; round < 5000; ++round) {
    const dvec3 offset = 100.0 * random.point();
    TriangleMesh a{{}, {{0, 1, 2}}}, b = a;
    for (int k = 0; k < 3; ++k) a.vertices.push_back(offset + random.point());
    for (int k = 0; k < 3; ++k) b.vertices.push_back(offset + random.point());
    long double truth = 0;
    for (const dvec3& p : a.vertices) {
      truth = std::max(truth, exact_distance(Long(p), Long(b.vertices[0]), Long(b.vertices[1]), Long(b.vertices[2])));
    }
    const HausdorffInterval h = hausdorff(a, b, {.threads = 1});
    ASSERT_LE(h.lower, truth);
    ASSERT_GE(h.upper, truth);
    ASSERT_LT(h.upper - h.lower, 1e-14 * 8);
  }
}

TEST(Hausdorff, ParallelPlanes) {
  for (const double distance : {1.0, 1e-2, 1e-4}) {
    for (const auto& [n, m] : {std::pair{1u, 40u}, {40u, 1u}, {7u, 11u}}) {
      const auto h =
          measured(shapes::grid(n), shapes::squares(m, [&](const dvec3& p) { return p + dvec3(0, 0, distance); }));
      expect_contains(h, distance);
    }
  }
}

TEST(Hausdorff, Boxes) {
  expect_contains(measured(box(1), box(1.5), {}, 2), 0.5);
  expect_contains(measured(box(1.5), box(1), {}, 2), std::sqrt(0.75), 1e-15);
  expect_contains(measured(box(1), subdivided(subdivided(subdivided(box(1.5)))), {}, 2), 0.5);
  expect_contains(measured(subdivided(subdivided(box(1.5))), box(1), {}, 2), std::sqrt(0.75), 1e-15);
}

TEST(Hausdorff, ConcentricSpheres) {
  const unsigned n = 60;
  const double radius = 1, larger = 1.1, sag = 1 - std::cos(2 * M_PI / n);  // how far inside the ball a face is at most
  const auto out = measured(sphere(n, radius), sphere(n + 9, larger)),
             in = measured(sphere(n + 9, larger), sphere(n, radius));
  for (const auto& h : {out, in}) {
    EXPECT_GE(h.upper, larger - radius - larger * sag);
    EXPECT_LE(h.lower, larger - radius + radius * sag);
  }
}

// The farthest point is inside a triangle, far from every corner and midpoint.
TEST(Hausdorff, CentreOfOneTriangleBetweenThreePoints) {
  const TriangleMesh a{{{0, 0, 0}, {1, 0, 0}, {0.5, std::sqrt(0.75), 0}}, {{0, 1, 2}}};
  const TriangleMesh b{a.vertices, {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}};
  expect_contains(measured(a, b), 1 / std::sqrt(3.0), 1e-15);
  expect_contains(measured(b, a), 0);
}

// A flat one-sided fit: nothing is lost one way, nearly everything the other way.
TEST(Hausdorff, IsDirected) {
  const TriangleMesh plate = shapes::grid(20);
  const TriangleMesh corner{{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}}, {{0, 1, 2}}};
  EXPECT_LT(measured(corner, plate).upper, 1e-14);
  expect_contains(measured(plate, corner), std::sqrt(2) - std::sqrt(2) * 0.05, 1e-15);
}

// Small enough for the truth by sampling: it lies between the largest sample and that plus the spacing.
TEST(Hausdorff, RandomMeshesAgainstSamples) {
  shapes::Random random(1);
  for (int round = 0; round < 40; ++round) {
    const double size = std::pow(10.0, -round % 3);
    const TriangleMesh a = soup(random, 3, size), b = soup(random, 1 + round % 9, 1);
    const int n = 60;
    double largest = 0, spacing = 0;
    for (const glm::uvec3& t : a.triangles) {
      const dvec3 &p = a.vertices[t.x], &q = a.vertices[t.y], &r = a.vertices[t.z];
      spacing = std::max({spacing, glm::distance(p, q) / n, glm::distance(q, r) / n, glm::distance(r, p) / n});
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; i + j <= n; ++j) {
          largest = std::max(largest, brute((double(i) * p + double(j) * q + double(n - i - j) * r) / double(n), b));
        }
      }
    }
    const HausdorffInterval h = measured(a, b, {}, 10);
    EXPECT_GE(h.upper, largest - 1e-14);
    EXPECT_LE(h.lower, largest + spacing);
    EXPECT_LE(h.upper, 1.001 * (largest + spacing));
  }
}

TEST(Hausdorff, NeedlesAndDegenerateTriangles) {
  shapes::Random random(2);
  for (int round = 0; round < 60; ++round) {
    TriangleMesh a, b;
    for (TriangleMesh* mesh : {&a, &b}) {
      for (unsigned i = 0; i < 40; ++i) {
        const dvec3 p = random.point(), q = random.point();
        const double height = i % 4 == 0 ? 0 : std::pow(10.0, -random.share() * 12);
        mesh->vertices.insert(mesh->vertices.end(),
                              {p, i % 8 == 0 ? p : q, glm::mix(p, q, random.share()) + height * random.point()});
        mesh->triangles.push_back(glm::uvec3(3 * i) + glm::uvec3(i % 3, (i + 1) % 3, (i + 2) % 3));
      }
    }
    const HausdorffInterval h = measured(a, b, {}, 10);
    double largest = 0;
    for (const glm::uvec3& t : a.triangles) {
      for (int i = 0; i < 50; ++i) {
        const dvec3 on =
            glm::mix(glm::mix(a.vertices[t.x], a.vertices[t.y], random.share()), a.vertices[t.z], random.share());
        largest = std::max(largest, brute(on, b));
      }
    }
    EXPECT_GE(h.upper, largest - 1e-14);
    EXPECT_LT(measured(a, a, {}, 10).upper, 1e-13);
  }
}

// A point and a segment of a count though they have no area.
TEST(Hausdorff, DegenerateTrianglesCount) {
  TriangleMesh plate = shapes::grid(4);
  const TriangleMesh bare = plate;
  plate.vertices.insert(plate.vertices.end(), {{0.5, 0.5, 3}, {0.5, 0.5, 0}, {0.25, 0.5, 2}});
  plate.triangles.push_back({25, 26, 25});
  expect_contains(measured(plate, bare, {}, 3), 3);
  plate.triangles.back() = {27, 27, 27};
  expect_contains(measured(plate, bare, {}, 3), 2);
  plate.triangles.pop_back();  // now unused, and of no account
  EXPECT_LT(measured(plate, bare).upper, 1e-14);
  plate.vertices.back() = {1e300, 0, 0};
  EXPECT_LT(measured(plate, bare).upper, 1e-14);
}

// The interval keeps its width where the distance is far smaller than the triangles: float32 rounding, for one.
TEST(Hausdorff, TinyDistances) {
  shapes::Random random(4);
  for (const double noise : {1e-4, 1e-7, 1e-10}) {
    const TriangleMesh plate =
        shapes::squares(1, [](const dvec3& p) { return dvec3(p.x, p.y, 0.3 * p.x - 0.7 * p.y); });
    TriangleMesh rough = shapes::squares(30, [](const dvec3& p) { return dvec3(p.x, p.y, 0.3 * p.x - 0.7 * p.y); });
    for (dvec3& p : rough.vertices) p += noise * random.point();
    const HausdorffInterval there = measured(rough, plate), back = measured(plate, rough);
    EXPECT_GT(there.lower, noise);
    EXPECT_GT(back.lower, noise);
    EXPECT_LT(back.upper, 6 * noise);
  }
}

// The distance grows up to the line where both sheets are as near. Pieces as small as the interval is narrow would be
// too many along that line.
TEST(Hausdorff, BetweenTwoSheetsTheIntervalIsNarrow) {
  for (const double gap : {1e-2, 1e-5, 1e-8}) {
    const TriangleMesh sheets{
        {dvec3(-2, -3, 0), dvec3(2, -3, 0), dvec3(0, 4, 0), dvec3(-2, -3, gap), dvec3(2, -3, gap), dvec3(0, 4, gap)},
        {{0, 1, 2}, {3, 4, 5}}};
    const TriangleMesh needle{{dvec3(0, 0, 0), dvec3(1, 0.1, 0), dvec3(0, 0, gap)}, {{0, 1, 2}}};
    const HausdorffInterval d = hausdorff(needle, sheets);
    EXPECT_LE(d.lower, gap / 2);
    EXPECT_GE(d.upper, gap / 2);
    EXPECT_LE(d.upper - d.lower, 0.001 * d.upper);
  }
}

TEST(Hausdorff, BoundDecides) {
  shapes::Random random(5);
  TriangleMesh rough = sphere(40, 1);
  for (dvec3& p : rough.vertices) p += 0.02 * random.point();
  for (const auto& [a, b] : {std::pair{sphere(17, 1), rough}, {rough, sphere(17, 1)}}) {
    const HausdorffInterval free = measured(a, b, {}, 2);
    const HausdorffInterval tight = measured(a, b, {.bound = free.lower * 1.00001}, 2, false);
    EXPECT_TRUE(tight.upper <= free.lower * 1.00001 || tight.lower > free.lower * 1.00001);
    const HausdorffInterval within = measured(a, b, {.bound = tight.upper * 1.000001}, 2);
    EXPECT_LE(within.upper, tight.upper * 1.000001);
    const HausdorffInterval beyond = measured(a, b, {.bound = tight.lower * 0.99999}, 2, false);
    EXPECT_GT(beyond.lower, tight.lower * 0.99999);
    expect_contains(beyond, tight.lower);
    const HausdorffInterval wide = measured(a, b, {.bound = 10 * tight.upper}, 2);  // decided at once, and still narrow
    EXPECT_GE(wide.lower, 0.998 * tight.lower);
  }
  // Once the bound is exceeded nothing more is done for the upper end.
  const TriangleMesh coarse = sphere(6, 1);
  EXPECT_GT(measured(coarse, rough, {.bound = 1e-3}, 2, false).upper, 1.01 * measured(coarse, rough, {}, 2).upper);
  // The bound is the distance itself: no arithmetic in doubles can decide that, and the call must end all the same.
  const TriangleMesh plate = shapes::grid(9);
  const TriangleMesh above = shapes::squares(13, [](const dvec3& p) { return p + dvec3(0, 0, 0.1); });
  expect_contains(measured(plate, above, {.bound = 0.1}), 0.1);
  // The bound is the distance itself here, too: the pieces around the farthest point would have to shrink to nothing.
  const TriangleMesh a{{{0, 0, 0}, {1, 0, 0}, {0.5, std::sqrt(0.75), 0}}, {{0, 1, 2}}};
  const TriangleMesh corners{a.vertices, {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}};
  const HausdorffInterval sharp = measured(a, corners, {.bound = 1 / std::sqrt(3.0)});
  expect_contains(sharp, 1 / std::sqrt(3.0), 1e-15);
  EXPECT_LT(sharp.upper - sharp.lower, 1e-12);
  EXPECT_THROW(hausdorff(plate, above, {.bound = -1.0}), InvalidInput);
  EXPECT_THROW(hausdorff(plate, above, {.bound = std::nan("")}), InvalidInput);
}

TEST(Hausdorff, NoMoreThanTheBoundIsDecidedOnRequest) {
  shapes::Random random(7);
  TriangleMesh rough = sphere(40, 1);
  for (dvec3& p : rough.vertices) p += 0.02 * random.point();
  for (const auto& [a, b] : {std::pair{sphere(17, 1), rough}, {rough, sphere(17, 1)}}) {
    const HausdorffInterval narrow = measured(a, b, {}, 2);
    for (const double share : {0.5, 0.99, 0.998, 1.002, 1.01, 1.5}) {
      const double bound = share * (share < 1 ? narrow.lower : narrow.upper);
      const HausdorffInterval found = measured(a, b, {.bound = bound, .narrow = false}, 2, false);
      EXPECT_EQ(found.upper <= bound, share > 1) << share;
      EXPECT_EQ(found.lower > bound, share < 1) << share;
      EXPECT_LE(found.lower, narrow.upper);
      EXPECT_GE(found.upper, narrow.lower);
    }
    const HausdorffInterval wide = hausdorff(a, b, {.bound = 3 * narrow.upper, .threads = 1, .narrow = false});
    EXPECT_GT(wide.upper - wide.lower, 0.01 * wide.upper) << "more work than was asked for";
  }
}

TEST(Hausdorff, SameForAnyNumberOfThreads) {
  shapes::Random random(6);
  TriangleMesh rough = sphere(50, 1);
  for (dvec3& p : rough.vertices) p += 0.02 * random.point();
  const TriangleMesh coarse = sphere(8, 1);
  for (const auto& [a, b] : {std::pair{rough, coarse}, {coarse, rough}}) {
    for (const std::optional<double> bound : {std::optional<double>(), std::optional(0.05), std::optional(0.2)}) {
      const HausdorffInterval one = hausdorff(a, b, {bound, 1, nullptr});
      for (const unsigned threads : {2u, 3u, 7u}) {
        const HausdorffInterval many = hausdorff(a, b, {bound, threads, nullptr});
        EXPECT_EQ(many.lower, one.lower);
        EXPECT_EQ(many.upper, one.upper);
        EXPECT_EQ(many.position, one.position);
        EXPECT_EQ(many.triangle, one.triangle);
      }
    }
  }
}

TEST(Hausdorff, AnyScaleAndAnyPlace) {
  for (const auto& [scale, offset] :
       {std::pair{1e-300, 0.0}, {1e-20, 0.0}, {1e20, 0.0}, {1e300, 0.0}, {1.0, 1e6}, {1e-20, 1e-12}}) {
    const auto move = [&](const dvec3& p) { return offset * dvec3(1, -1, 2) + scale * p; };
    TriangleMesh inner = box(1), outer = subdivided(box(1.5));
    for (dvec3& p : inner.vertices) p = move(p);
    for (dvec3& p : outer.vertices) p = move(p);
    const double rounding = (1e-15 + 1e-15 * offset / scale) * scale;
    for (const auto& [h, truth] :
         {std::pair{hausdorff(inner, outer), 0.5}, {hausdorff(outer, inner), std::sqrt(0.75)}}) {
      expect_contains(h, truth * scale, rounding);
      EXPECT_LE(h.upper - h.lower, 0.0011 * h.upper + rounding);
    }
  }
  // One far away from the other, and one tiny beside the other.
  TriangleMesh far = box(1);
  for (dvec3& p : far.vertices) p.x += 1e12;
  expect_contains(hausdorff(box(1), far), 1e12, 1e-3);
  expect_contains(hausdorff(box(1e-12), box(1)), 1);
  const HausdorffInterval to_tiny = hausdorff(subdivided(box(1)), box(1e-12));
  EXPECT_NEAR(to_tiny.lower, std::sqrt(3), 0.002);
  EXPECT_NEAR(to_tiny.upper, std::sqrt(3), 0.002);
}

TEST(Hausdorff, RefusesWhatIsNoMesh) {
  const TriangleMesh good = box(1);
  TriangleMesh bad = good;
  bad.vertices[3].y = std::nan("");
  EXPECT_THROW(hausdorff(bad, good), InvalidInput);
  EXPECT_THROW(hausdorff(good, bad), InvalidInput);
  EXPECT_THROW(hausdorff(good, {}), InvalidInput);
  bad = good;
  for (dvec3& p : bad.vertices) p *= 1e-310;  // no power of two brings it to 1
  EXPECT_THROW(hausdorff(bad, bad), InvalidInput);
  bad = good;
  bad.triangles[2].z = 8;
  EXPECT_THROW(hausdorff(good, bad), InvalidInput);
}

TEST(Hausdorff, ReportsProgressAndStops) {
  Progress progress;
  hausdorff(sphere(20, 1), sphere(21, 1.1), {{}, 1, &progress});
  EXPECT_STREQ(progress.stage(), "measuring");
  EXPECT_GT(progress.fraction(), 0.5);
  EXPECT_LE(progress.fraction(), 1);
  {
    const Progress::Part first(&progress, 0, 0.5);
    hausdorff(sphere(20, 1), sphere(21, 1.1), {{}, 1, &progress});
    EXPECT_GT(progress.fraction(), 0.25);
    EXPECT_LE(progress.fraction(), 0.5);
  }
  progress.cancel();
  EXPECT_THROW(hausdorff(sphere(20, 1), sphere(21, 1.1), {{}, 1, &progress}), Cancelled);
}

}  // namespace
