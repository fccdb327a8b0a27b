// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/errors.h"
#include "decimation_cases.h"
#include "many.h"
#include "polls.h"
#include "topology/wedges.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::run;
using glm::dvec3;
using Options = DecimationOptions;

Options thorough() {
  Options options;
  options.effort = Options::Effort::thorough;
  return options;
}

/// The time of thorough grows with the number of triangles that fast leaves.
constexpr double kPercent = 3;

Case torus() { return {shapes::torus(across(44), 0.002), glm::dmat4(1), Storage::float32, kPercent}; }

TEST(Refinement, KeepsBothDirectionsOnEveryMeshAndAddsNoTriangle) {
  std::size_t fast = 0, fewer = 0;
  std::vector<Case> all = cases::all();
  for (std::size_t i = 0; i < all.size(); i += static_cast<std::size_t>(8 / many(8))) {
    Case& c = all[i];
    if (c.percent < 0.1) continue;  // takes long and shows nothing new
    if (!is_full_run()) c.percent = std::max(c.percent, kPercent);
    const DecimationResult r = run(c, thorough());
    cases::expect_within(c, r);
    const std::size_t before = run(c).triangles.size();
    EXPECT_LE(r.triangles.size(), before);
    fast += before, fewer += r.triangles.size();
  }
  EXPECT_LT(static_cast<double>(fewer), 0.95 * static_cast<double>(fast));
}

TEST(Refinement, ARoundEndsAfterFailuresInARowAndWhereHardlyATrySucceeds) {
  /// The number of tries of a round if one in so many succeeds.
  const auto tries = [](std::size_t steps, std::size_t one_in) {
    Refinement::Patience patience(steps);
    std::size_t count = 0;
    while (count < steps && !patience.is_over()) patience.note(++count % one_in == 0);
    return count;
  };
  const std::size_t never = 1000000;
  EXPECT_EQ(tries(100, never), 40u);
  EXPECT_EQ(tries(8000, never), 1000u);
  EXPECT_EQ(tries(8000, 20), 8000u);
  EXPECT_LT(tries(8000, 80), 1600u);
}

TEST(Refinement, RoundsWithManyStartsMayTakeSoMuchMoreThanThoseBefore) {
  for (const std::size_t before : {0u, 1'000'000u, 700'000'000u}) {
    Refinement::Budget budget;
    budget.note(before);
    EXPECT_FALSE(budget.is_over());
    budget.limit();
    budget.note(before + 49'999'999);
    EXPECT_FALSE(budget.is_over());
    budget.note(1);
    EXPECT_TRUE(budget.is_over());
  }
}

TEST(Refinement, KeepsTheOneDirectionThatIsAskedFor) {
  Options options = thorough();
  options.two_sided = false;
  for (const Case& c : {torus(), Case{shapes::stored(shapes::grid(20)), glm::dmat4(1), Storage::float32, kPercent}}) {
    const DecimationResult r = run(c, options);
    cases::expect_within(c, r, false);
    EXPECT_GT(r.triangles.size(), 0u);
  }
}

TEST(Refinement, SubsetKeepsPositionsBitForBit) {
  // On the smoother torus of the other tests fast leaves as few triangles as thorough.
  const Case c{shapes::torus(36, 0.02), glm::dmat4(1), Storage::float32, kPercent};
  Options options = thorough();
  options.placement = Options::Placement::subset;
  const DecimationResult r = run(c, options);
  cases::expect_within(c, r);
  for (std::size_t v = 0; v < r.vertices.size(); ++v) EXPECT_EQ(r.vertices[v], c.mesh.vertices[r.vertex_source[v]]);
  options.effort = Options::Effort::fast;
  EXPECT_LT(r.triangles.size(), run(c, options).triangles.size());
}

TEST(Refinement, LockedVerticesStay) {
  const Case c = torus();
  const auto locked = std::make_unique<bool[]>(c.mesh.vertices.size());
  for (std::size_t v = 0; v < c.mesh.vertices.size(); v += 50) locked[v] = true;
  Options options = thorough();
  options.locked = {locked.get(), c.mesh.vertices.size()};
  const DecimationResult r = run(c, options);
  for (std::size_t v = 0; v < c.mesh.vertices.size(); v += 50) {
    ASSERT_GE(r.vertex_map[v], 0);
    EXPECT_EQ(r.vertices[static_cast<std::size_t>(r.vertex_map[v])], c.mesh.vertices[v]);
  }
}

TEST(Refinement, EdgesBetweenLockedVerticesStay) {
  const Case c{shapes::torus(60, 0.002)};
  const auto locked = std::make_unique<bool[]>(c.mesh.vertices.size());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> line;  // rings around the tube
  for (const glm::uvec3& t : c.mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (a / 60 % 5 == 0 && b / 60 == a / 60 && a < b) line.emplace_back(a, b), locked[a] = locked[b] = true;
    }
  }
  ASSERT_EQ(line.size(), 12u * 60);
  Options options = thorough();
  options.locked = {locked.get(), c.mesh.vertices.size()};
  const DecimationResult r = run(c, options);
  cases::expect_within(c, r);
  for (const auto& [a, b] : line) {
    const auto has = [&](const glm::uvec3& t, std::uint32_t v) {
      const auto i = static_cast<std::uint32_t>(r.vertex_map[v]);
      return t.x == i || t.y == i || t.z == i;
    };
    EXPECT_TRUE(std::any_of(r.triangles.begin(), r.triangles.end(),
                            [&](const glm::uvec3& t) { return has(t, a) && has(t, b); }));
  }
}

TEST(Refinement, SharesOfTheToleranceAreKeptAroundTheirVertices) {
  const Case c{shapes::torus(across(40), 0.002), glm::dmat4(1), Storage::float32, kPercent};
  std::vector<double> shares(c.mesh.vertices.size(), 1);
  for (std::size_t v = 0; v < shares.size(); ++v) {
    if (c.mesh.vertices[v].x < 0) shares[v] = 0.25;
  }
  const std::vector<double> small_everywhere(shares.size(), 0.25);
  Options options;
  for (const auto effort : {Options::Effort::fast, Options::Effort::thorough}) {
    if (kSanitized && effort == Options::Effort::fast) continue;  // its shares have tests of their own
    options.effort = effort, options.shares = {};
    const auto near = [&](const DecimationResult& r) {
      std::vector<glm::uvec3> there;
      for (const glm::uvec3& t : r.triangles) {
        if (std::max({r.vertices[t.x].x, r.vertices[t.y].x, r.vertices[t.z].x}) < -0.1) there.push_back(t);
      }
      return hausdorff(c.world(r.vertices, there), c.world(c.mesh.vertices, c.mesh.triangles),
                       {0.25 * c.tolerance(), 1, nullptr});
    };
    const DecimationResult without = run(c, options);
    EXPECT_GT(near(without).lower, 0.25 * c.tolerance());
    options.shares = shares;
    const DecimationResult r = run(c, options);
    cases::expect_within(c, r);
    EXPECT_LE(near(r).upper, 0.25 * c.tolerance());
    EXPECT_GT(r.triangles.size(), without.triangles.size());
    if (kSanitized) continue;  // a count that the ordinary build holds
    options.shares = small_everywhere;
    EXPECT_LT(r.triangles.size(), run(c, options).triangles.size()) << "than with the small share everywhere";
  }
}

TEST(Refinement, CornersOfAFaceKeepToOneSideOfASeam) {
  const Case c = torus();
  // A seam where x changes its sign: two values at each vertex on it.
  std::vector<float> values;
  for (const glm::uvec3& t : c.mesh.triangles) {
    const dvec3 centre = (c.mesh.vertices[t.x] + c.mesh.vertices[t.y] + c.mesh.vertices[t.z]) / 3.0;
    values.insert(values.end(), 3, centre.x > 0 ? 1.0f : 0.0f);
  }
  const std::vector<std::uint32_t> wedges = wedge_labels(c.mesh.triangles, values, 1);
  Options options = thorough();
  options.wedges = wedges;
  const DecimationResult r = run(c, options);
  cases::expect_within(c, r);
  for (std::size_t i = 0; i < r.triangles.size(); ++i) {
    float side[3];
    for (int k = 0; k < 3; ++k) side[k] = values[3 * r.source_triangle[i][k]];
    EXPECT_EQ(side[0], side[1]);
    EXPECT_EQ(side[1], side[2]);
  }
}

TEST(Refinement, ThreadsDoNotChangeABit) {
  Case plate{shapes::stored(shapes::grid(20))};
  plate.percent = kPercent;
  for (const Case& c : {torus(), plate}) {
    std::vector<double> shares(c.mesh.vertices.size(), 1);
    const auto locked = std::make_unique<bool[]>(shares.size());
    for (std::size_t v = 0; v < shares.size(); v += 7) shares[v] = 0.5, locked[v] = v % 2 == 0;
    for (const bool two_sided : {true, false}) {
      for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
        for (const bool bound : {true, false}) {
          const bool is_subset = placement == Options::Placement::subset;
          if (kSanitized && (bound != two_sided || is_subset == bound)) continue;  // the others run the same code
          Options options = thorough();
          options.two_sided = two_sided, options.placement = placement;
          if (bound) options.shares = shares, options.locked = {locked.get(), shares.size()};
          cases::expect_same_bits(c, options);
        }
      }
    }
  }
}

// A vertex into which another merges stays where it is and has a smaller share from then on; so have faces around it
// that the collapse does not touch. Two fans, at (3, 0) and (-3.5, -0.28), meet in the first vertex.
TEST(Refinement, WhatIsTriedAheadKnowsWhatAVertexThatStaysMayStillUse) {
  TriangleMesh fans;
  fans.vertices = {{0, 0, 0},         {-0.1, -0.0757, 0},  {6.1, -0.0043, 0},    {6.1, 0.0043, 0},
                   {-0.1, 0.0757, 0}, {3, 0, 0.02},        {-7, -0.2, 0},        {-7, -0.36, 0},
                   {0, -0.56, 0},     {-3.5, -0.28, 0.05}, {-0.505, -0.28, -0.2}};
  const auto fan = [&](std::uint32_t middle, const std::vector<std::uint32_t>& rim) {
    for (std::size_t i = 0; i < rim.size(); ++i) fans.triangles.emplace_back(middle, rim[i], rim[(i + 1) % rim.size()]);
  };
  fan(5, {1, 2, 3, 4, 0}), fan(9, {0, 6, 7, 8, 10});
  fans.triangles.emplace_back(0, 10, 1);
  const std::size_t triangles = fans.triangles.size();
  // Aside, so that the mesh has steps enough to be tried at once.
  for (std::uint32_t i = 0; i < 3; ++i) {
    const double x = 10.0 + i;
    const auto n = static_cast<std::uint32_t>(fans.vertices.size());
    fans.vertices.insert(fans.vertices.end(), {{x, 10, 0}, {x + 0.5, 10, 0}, {x, 10.5, 0}});
    fans.triangles.emplace_back(n, n + 1, n + 2);
  }
  const TriangleMesh reference{{{-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const ToleranceVolume volume(reference.vertices, reference.triangles, space, 1.0);
  std::vector<double> shares(fans.vertices.size(), 1);
  shares[5] = 0.17;
  const auto locked = std::make_unique<bool[]>(shares.size());
  for (std::size_t v = 0; v < shares.size(); ++v) locked[v] = v != 5 && v != 9;
  Options options = thorough();
  options.two_sided = false, options.shares = shares, options.locked = {locked.get(), shares.size()};
  for (const unsigned threads : {1u, 2u, 4u}) {
    options.threads = threads;
    const DecimationResult r = decimate(fans.vertices, fans.triangles, space, &volume, options);
    EXPECT_EQ(r.triangles.size(), triangles - 2 + 3) << threads << " threads";
  }
}

TEST(Refinement, TimeAndTargetEndIt) {
  Case c = torus();
  c.percent = 0.5;
  Options options = thorough();
  options.max_seconds = 1e-9;
  const DecimationResult late = run(c, options);
  EXPECT_TRUE(late.stopped_at_time);
  EXPECT_GT(late.triangles.size(), run(c).triangles.size());
  cases::expect_within(c, late);
  // With a target the collapses go by another order: how far they come alone, the refinement goes beyond.
  Options alone;
  alone.target_triangles = 4;
  const std::size_t fast = run(c, alone).triangles.size();
  options.max_seconds = 0;
  options.target_triangles = fast - 4;
  const DecimationResult at_target = run(c, options);
  EXPECT_TRUE(at_target.stopped_at_target);
  EXPECT_FALSE(at_target.stopped_at_time);
  EXPECT_GE(at_target.triangles.size(), fast - 6);
  EXPECT_LE(at_target.triangles.size(), fast - 4);
}

TEST(Refinement, KeepsWhatThereIsOnRequest) {
  const Case c = torus();
  const DecimationResult fast = run(c);
  Options options = thorough();
  Progress progress;
  progress.finish();
  options.progress = &progress;
  const DecimationResult kept = run(c, options);
  EXPECT_TRUE(kept.stopped_on_request);
  EXPECT_FALSE(fast.stopped_on_request);
  cases::expect_within(c, kept);
  // Fast asks about all edges again at the end, while thorough begins to refine.
  EXPECT_LE(static_cast<double>(kept.triangles.size()), 1.05 * static_cast<double>(fast.triangles.size()));
  EXPECT_GT(kept.triangles.size(), run(c, thorough()).triangles.size());
}

// The add-on lets Esc keep the result while this stage lasts.
TEST(Refinement, TheCollapsesAfterItBelongToItsStage) {
  Options options = thorough();
  Progress progress;
  options.progress = &progress;
  run(torus(), options);
  EXPECT_STREQ(progress.stage(), "refining");
}

TEST(Refinement, EndsAtOnceOnRequestWithWhatIsProved) {
  const Case c{shapes::torus(across(40), 0.002), glm::dmat4(1), Storage::float32, kPercent};
  Options options = thorough();
  options.threads = 1;
  // What thorough has before it refines.
  Progress ended;
  ended.finish();
  Options begun = options;
  begun.progress = &ended;
  const std::size_t begun_polls = polls_of([&] { run(c, begun); });
  const std::size_t unrefined = run(c, begun).triangles.size();
  const std::size_t whole = polls_of([&] { run(c, options); });
  for (const double share : {0.05, 0.3, 0.7}) {
    const auto at = begun_polls + static_cast<std::size_t>(share * static_cast<double>(whole - begun_polls));
    Progress progress;
    options.progress = &progress;
    std::size_t polls = 0;
    const Call asked(nullptr, [&] {
      if (++polls == at) progress.finish();
      return false;
    });
    const DecimationResult r = run(c, options);
    EXPECT_TRUE(r.stopped_on_request);
    EXPECT_LE(r.triangles.size(), unrefined);
    EXPECT_LE(polls, at + 100) << "a price of all edges, and a try to its end, take more";
    cases::expect_within(c, r);
  }
}

TEST(Refinement, StopsWhenCancelled) {
  const Case c = torus();
  Options options = thorough();
  Progress progress;
  progress.cancel();
  options.progress = &progress;
  EXPECT_THROW(run(c, options), Cancelled);
}

}  // namespace
