// SPDX-License-Identifier: GPL-3.0-or-later
// Every result is judged by measure/hausdorff.h on what is stored.
#include "decimation/decimation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "base/errors.h"
#include "base/simd.h"
#include "decimation_cases.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "shapes.h"
#include "topology/wedges.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::expect_within;
using cases::run;
using glm::dvec3;
using Options = DecimationOptions;

/// The maps tell one story: each result triangle is its source with the corners mapped.
void expect_consistent(const Case& c, const DecimationResult& r) {
  ASSERT_EQ(r.vertex_map.size(), c.mesh.vertices.size());
  ASSERT_EQ(r.vertex_source.size(), r.vertices.size());
  ASSERT_EQ(r.triangle_source.size(), r.triangles.size());
  ASSERT_EQ(r.source_triangle.size(), r.triangles.size());
  for (std::size_t i = 0; i < r.triangles.size(); ++i) {
    const glm::uvec3 source = c.mesh.triangles[r.triangle_source[i]];
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(r.vertex_map[source[k]], std::int32_t(r.triangles[i][k]));
      const dvec3 w = r.source_weights[i][k];
      EXPECT_NEAR(w.x + w.y + w.z, 1, 1e-12);
      EXPECT_GE(std::min({w.x, w.y, w.z}), 0);
      const glm::uvec3 from = c.mesh.triangles[r.source_triangle[i][k]];
      const dvec3 at = c.mesh.vertices[from.x] * w.x + c.mesh.vertices[from.y] * w.y + c.mesh.vertices[from.z] * w.z;
      const double off = glm::length(c.space().world(at) - c.space().world(r.vertices[r.triangles[i][k]]));
      EXPECT_LE(off, 1.0001 * c.tolerance()) << "attributes come from nearby";
    }
  }
  for (std::size_t v = 0; v < r.vertices.size(); ++v) EXPECT_EQ(r.vertex_map[r.vertex_source[v]], std::int32_t(v));
}

TEST(Decimation, KeepsBothDirectionsOnEveryMesh) {
  int number = 0;
  for (const Case& c : cases::all()) {
    for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
      SCOPED_TRACE(testing::Message() << "case " << number
                                      << (placement == Options::Placement::subset ? " subset" : " optimal"));
      Options options;
      options.placement = placement;
      const DecimationResult r = run(c, options);
      expect_within(c, r);
      expect_consistent(c, r);
      EXPECT_LT(r.triangles.size(), c.mesh.triangles.size());
    }
    ++number;
  }
}

TEST(Decimation, SubsetKeepsPositionsBitForBit) {
  const Case c{shapes::torus(40, 0.002)};
  Options options;
  options.placement = Options::Placement::subset;
  const DecimationResult r = run(c, options);
  for (std::size_t v = 0; v < r.vertices.size(); ++v) EXPECT_EQ(r.vertices[v], c.mesh.vertices[r.vertex_source[v]]);
  const DecimationResult optimal = run(c);
  EXPECT_LT(optimal.triangles.size(), r.triangles.size());
  std::size_t moved = 0;
  for (std::size_t v = 0; v < optimal.vertices.size(); ++v) {
    moved += optimal.vertices[v] != c.mesh.vertices[optimal.vertex_source[v]];
  }
  EXPECT_GT(moved, optimal.vertices.size() / 2);
}

TEST(Decimation, TargetStopsItAndToleranceStopsItSooner) {
  const Case c{shapes::torus(40, 0.002)};
  Options options;
  options.target_triangles = 1500;
  const DecimationResult reached = run(c, options);
  EXPECT_TRUE(reached.stopped_at_target);
  EXPECT_LE(reached.triangles.size(), 1500u);
  EXPECT_GE(reached.triangles.size(), 1498u);
  options.target_triangles = 10;
  const DecimationResult missed = run(c, options);
  EXPECT_FALSE(missed.stopped_at_target);
  EXPECT_GT(missed.triangles.size(), 10u);
  expect_within(c, missed);
}

TEST(Decimation, LockedVerticesStayExactly) {
  const Case c{shapes::torus(40)};
  const auto locked = std::make_unique<bool[]>(c.mesh.vertices.size());
  for (std::size_t i = 0; i < c.mesh.vertices.size(); i += 37) locked[i] = true;
  Options options;
  options.locked = {locked.get(), c.mesh.vertices.size()};
  const DecimationResult r = run(c, options);
  expect_within(c, r);
  for (std::size_t i = 0; i < c.mesh.vertices.size(); i += 37) {
    ASSERT_GE(r.vertex_map[i], 0);
    EXPECT_EQ(r.vertices[std::size_t(r.vertex_map[i])], c.mesh.vertices[i]);
    EXPECT_EQ(r.vertex_source[std::size_t(r.vertex_map[i])], i);
  }
  EXPECT_GT(r.triangles.size(), run(c).triangles.size());
  EXPECT_EQ(r.locked.at("asked for"), (c.mesh.vertices.size() + 36) / 37);
}

TEST(Decimation, OutsideIsAnErrorOrKept) {
  const Case c{shapes::torus(40)};
  TriangleMesh bent = c.mesh;
  bent.vertices[7] += dvec3(0, 0, 5 * c.tolerance());
  bent = shapes::stored(bent);
  const auto volume = c.volume();
  try {
    decimate(bent.vertices, bent.triangles, c.space(), volume.get(), {});
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("faces are not within"), std::string::npos) << error.what();
  }
  Options options;
  options.outside = Outside::keep;
  const DecimationResult r = decimate(bent.vertices, bent.triangles, c.space(), volume.get(), options);
  EXPECT_GT(r.outside.faces, 0u);
  ASSERT_TRUE(r.outside.first.has_value());
  EXPECT_GE(r.vertex_map[7], 0);
  EXPECT_EQ(r.vertices[std::size_t(r.vertex_map[7])], bent.vertices[7]) << "kept as it was";
  // None got worse.
  const TriangleMesh result{r.vertices, r.triangles};
  EXPECT_LE(hausdorff(result, c.mesh).lower, hausdorff(bent, c.mesh).upper);
}

TEST(Decimation, AgainAndAgainDoesNotDrift) {
  const Case c{shapes::torus(50, 0.003)};
  const auto volume = c.volume();
  DecimationResult r = decimate(c.mesh.vertices, c.mesh.triangles, c.space(), volume.get(), {});
  for (int again = 0; again < 4; ++again) {
    const std::size_t before = r.triangles.size();
    r = decimate(r.vertices, r.triangles, c.space(), volume.get(), {});
    EXPECT_LE(r.triangles.size(), before);
    expect_within(c, r);
  }
}

TEST(Decimation, ThreadsAndInstructionsDoNotChangeABit) {
  const Case c{shapes::torus(40, 0.003)};
  const auto with = [&](unsigned threads) {
    ToleranceVolume::Options volume_options;
    volume_options.threads = threads;
    const ToleranceVolume volume(c.mesh.vertices, c.mesh.triangles, c.space(), c.tolerance(), volume_options);
    Options options;
    options.threads = threads;
    return decimate(c.mesh.vertices, c.mesh.triangles, c.space(), &volume, options);
  };
  const DecimationResult one = with(1), three = with(3);
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.triangles, three.triangles);
  const Simd best = simd_path();
  simd_path() = Simd::portable;
  const DecimationResult portable = with(1);
  simd_path() = best;
  EXPECT_EQ(one.vertices, portable.vertices);
  EXPECT_EQ(one.triangles, portable.triangles);
}

TEST(Decimation, TryingAheadChangesNothing) {
  int number = 0;
  for (const Case& c : cases::all()) {
    if (kSanitized && number++ % 4 > 0) continue;
    const auto volume = c.volume();
    for (const bool subset : {false, true}) {
      const auto with = [&](unsigned threads) {
        Options options;
        options.threads = threads, options.two_sided = !subset;
        options.placement = subset ? Options::Placement::subset : Options::Placement::optimal;
        return decimate(c.mesh.vertices, c.mesh.triangles, c.space(), volume.get(), options);
      };
      const DecimationResult one = with(1), four = with(4);
      EXPECT_EQ(one.vertices, four.vertices);
      EXPECT_EQ(one.triangles, four.triangles);
      EXPECT_EQ(one.triangle_source, four.triangle_source);
    }
  }
}

TEST(Decimation, SeamsKeepTheirSides) {
  // A seam ring around the torus: corners on either side of vertex column 0 differ.
  const unsigned n = 30;
  const Case c{shapes::torus(n, 0, 1), glm::dmat4(1), Storage::float32, 3};
  std::vector<float> values(c.mesh.triangles.size() * 3);
  for (std::size_t corner = 0; corner < values.size(); ++corner) {
    const unsigned v = c.mesh.triangles[corner / 3][int(corner % 3)], column = v % n;
    const unsigned strip = unsigned(corner / 3 / 2) % n;  // the squares of column j span columns j and j + 1
    values[corner] = float(column == 0 && strip == n - 1 ? n : column);
  }
  const std::vector<std::uint32_t> wedges = wedge_labels(c.mesh.triangles, values, 1);
  const auto widest = [&](const DecimationResult& r) {
    float widest = 0;
    for (std::size_t i = 0; i < r.triangles.size(); ++i) {
      float low = float(n), high = 0;
      for (int k = 0; k < 3; ++k) {
        float value = 0;
        for (int w = 0; w < 3; ++w) {
          value += values[3 * r.source_triangle[i][k] + unsigned(w)] * float(r.source_weights[i][k][w]);
        }
        low = std::min(low, value), high = std::max(high, value);
      }
      widest = std::max(widest, high - low);
    }
    return widest;
  };
  for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
    Options options;
    options.placement = placement;
    options.wedges = wedges;
    const DecimationResult r = run(c, options);
    expect_within(c, r);
    expect_consistent(c, r);
    EXPECT_LT(r.triangles.size(), c.mesh.triangles.size() / 2);
    EXPECT_LT(widest(r), float(n) / 2) << "a face that reaches across the seam spans all values";
  }
  EXPECT_GT(widest(run(c)), float(n) / 2) << "without wedges no face reaches across";
}

TEST(Decimation, RepairsAreCounted) {
  TriangleMesh mesh = shapes::torus(20);
  mesh.triangles.push_back(mesh.triangles[5]);
  mesh.triangles.push_back({0, 0, 1});
  mesh.vertices.push_back({9, 9, 9});
  const Case c{mesh};
  const DecimationResult r = run(c);
  std::map<std::string, std::size_t> repairs;
  for (const Repair& repair : r.repairs) repairs[repair.kind] = repair.count;
  EXPECT_EQ(repairs["duplicate"], 1u);
  EXPECT_EQ(repairs["degenerate"], 1u);
  EXPECT_EQ(repairs["unused"], 1u);
  EXPECT_EQ(r.vertex_map.back(), -1);
  expect_within(c, r);
}

TEST(Decimation, BadInput) {
  const Case c{shapes::torus(10)};
  const auto volume = c.volume();
  const auto attempt = [&](const TriangleMesh& mesh, const Options& options = {}) {
    decimate(mesh.vertices, mesh.triangles, c.space(), volume.get(), options);
  };
  TriangleMesh nan = c.mesh, range = c.mesh, empty;
  nan.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  range.triangles[2].z = 100000;
  EXPECT_THROW(attempt(nan), InvalidInput);
  EXPECT_THROW(attempt(range), InvalidInput);
  EXPECT_THROW(attempt(empty), InvalidInput);
  EXPECT_THROW(attempt({c.mesh.vertices, {}}), InvalidInput);
  const bool one[1] = {true};
  Options options;
  options.locked = one;
  EXPECT_THROW(attempt(c.mesh, options), InvalidInput);
  EXPECT_THROW(decimate(c.mesh.vertices, c.mesh.triangles, c.space(), nullptr, {}), InvalidInput);
}

TEST(Decimation, StorageThatCannotHoldTheToleranceIsRefused) {
  Case c{shapes::torus(20), glm::dmat4(1), Storage::float32, 0.1};
  for (dvec3& p : c.mesh.vertices) p += dvec3(4e3, 0, 0);
  c.mesh = shapes::stored(c.mesh);
  EXPECT_FALSE(run(c).warnings.empty()) << "float32 rounds by some per cent of the tolerance";
  c.percent = 0.01;
  EXPECT_THROW(run(c), InvalidInput);
}

TEST(Decimation, StopsWhenCancelled) {
  const Case c{shapes::torus(40)};
  const auto volume = c.volume();
  Progress progress;
  progress.cancel();
  Options options;
  options.progress = &progress;
  EXPECT_THROW(decimate(c.mesh.vertices, c.mesh.triangles, c.space(), volume.get(), options), Cancelled);
}

TEST(Decimation, CutCopiesNeverMeetInOneFaceTwice) {
  // Two holes that touch at vertex 3: the two fans there are cut apart, and are one vertex again in the result.
  const TriangleMesh mesh{
      {{0, 0, 0},
       {1, 0, 0.3},
       {0.5, 1, 0},
       {0.4, 0.4, 0.5},
       {1, 0.3, 1},
       {0.8, 0.9, 1},
       {0.2, 0.8, 1},
       {0.6, 0.5, 1.4}},
      {{0, 1, 2}, {7, 5, 4}, {7, 6, 5}, {0, 3, 1}, {7, 4, 6}, {1, 4, 5}, {1, 5, 2}, {2, 5, 6}, {2, 6, 3}, {3, 4, 1}}};
  for (const bool two_sided : {false, true}) {
    Options options;
    options.two_sided = two_sided;
    const Case c{shapes::stored(mesh), glm::dmat4(1), Storage::float32, 60};
    std::set<std::set<unsigned>> faces;
    for (const glm::uvec3& t : run(c, options).triangles) EXPECT_TRUE(faces.insert({t.x, t.y, t.z}).second);
  }
}

TEST(Decimation, KeepGivesUpOnlyWhatWasNeverCovered) {
  // The mesh is the left quarter of the reference; what it covered it still covers.
  const TriangleMesh reference = shapes::grid(1);
  TriangleMesh quarter = shapes::grid(12);
  for (dvec3& p : quarter.vertices) p.x *= 0.25;
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const double tolerance = 0.02;
  const ToleranceVolume volume(reference.vertices, reference.triangles, space, tolerance);
  Options options;
  EXPECT_THROW(decimate(quarter.vertices, quarter.triangles, space, &volume, options), InvalidInput);
  options.outside = Outside::keep;
  const DecimationResult r = decimate(quarter.vertices, quarter.triangles, space, &volume, options);
  EXPECT_LT(r.triangles.size(), quarter.triangles.size() / 2);
  EXPECT_LE(hausdorff(quarter, {r.vertices, r.triangles}, {2 * tolerance, 1, nullptr}).upper, 2 * tolerance);
  EXPECT_EQ(r.uncovered.faces, 2u);
  EXPECT_FALSE(r.warnings.empty());
}

TEST(Decimation, RoundingToFloatIsInsideTheBound) {
  // Float32 rounds by several per cent of the tolerance here: what is judged is what is stored.
  Case c{shapes::grid(40), glm::dmat4(1), Storage::float32, 0.08};
  for (dvec3& p : c.mesh.vertices) p = dvec3(1000 + p.x, p.y - 1000, 0.05 * std::sin(9 * p.x) * std::cos(7 * p.y));
  c.mesh = shapes::stored(c.mesh);
  const DecimationResult r = run(c);
  EXPECT_FALSE(r.warnings.empty());
  expect_within(c, r);
}

TEST(Decimation, UnboundedReachesItsTarget) {
  const Case c{shapes::torus(40)};
  Options options;
  options.target_triangles = 100;
  const DecimationResult r = decimate(c.mesh.vertices, c.mesh.triangles, c.space(), nullptr, options);
  EXPECT_TRUE(r.stopped_at_target);
  EXPECT_GE(r.triangles.size(), 98u);
}

}  // namespace
