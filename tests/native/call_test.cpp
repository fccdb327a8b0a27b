// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/call.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "base/parallel.h"
#include "check/certificate.h"
#include "decimation/decimation.h"
#include "field/display_grid.h"
#include "field/scatter.h"
#include "field/signs.h"
#include "laid_out.h"
#include "many.h"
#include "measure/deviation.h"
#include "measure/hausdorff.h"
#include "motion/constrain.h"
#include "motion/deformation.h"
#include "motion/guard.h"
#include "motion/smoothing.h"
#include "polls.h"
#include "shapes.h"

namespace tolvol {
namespace {

const TriangleMesh& wavy() {
  static const TriangleMesh mesh = shapes::torus(across(24), 0.004);
  return mesh;
}

constexpr double kTolerance = 0.02;

const ToleranceVolume& volume() {
  static const ToleranceVolume instance(wavy().vertices, wavy().triangles, StoredSpace(glm::dmat4(1), Storage::float64),
                                        kTolerance);
  return instance;
}

std::vector<glm::dvec3> pushed() {
  std::vector<glm::dvec3> result = wavy().vertices;
  for (std::size_t i = 0; i < result.size(); ++i) result[i] *= 1 + 0.02 * std::sin(7.0 * double(i));
  return result;
}

std::vector<std::uint32_t> indices() { return shapes::indices(wavy()); }

struct NamedCall {
  const char* name;
  std::function<void()> run;
};

std::vector<NamedCall> calls() {
  static const StoredSpace space(glm::dmat4(1), Storage::float64);
  static const std::vector<std::uint32_t> faces = indices();
  static const std::vector<glm::dvec3> moved = pushed();
  static const auto decimated = [](auto&& set, const ToleranceVolume& within = volume()) {
    DecimationOptions options;
    options.threads = 1;
    set(options);
    decimate(wavy().vertices, wavy().triangles, space, &within, options);
  };
  // The time of thorough grows with the number of triangles that fast leaves.
  static const ToleranceVolume wide(wavy().vertices, wavy().triangles, space, 5 * kTolerance);
  return {
      {"ToleranceVolume",
       [] {
         ToleranceVolume(wavy().vertices, wavy().triangles, space, kTolerance, {std::nullopt, 1, nullptr});
       }},
      {"fast marching",
       [] {
         ToleranceVolume(wavy().vertices, wavy().triangles, space, kTolerance, {1, 1, nullptr, Field::fast_marching});
       }},
      {"signed_distance", [] { signed_distance(volume().reference(), volume().grid(), 1); }},
      {"DisplayGrid", [] { DisplayGrid(wavy(), false, kTolerance, {.precision = 1, .threads = 1}); }},
      {"check",
       [] {
         Certificate(volume()).check({moved, space, faces}, {1, nullptr});
       }},
      {"decimate", [] { decimated([](DecimationOptions&) {}); }},
      {"decimate one way", [] { decimated([](DecimationOptions& o) { o.two_sided = false; }); }},
      {"decimate thorough",
       [] { decimated([](DecimationOptions& o) { o.effort = DecimationOptions::Effort::thorough; }, wide); }},
      {"smooth",
       [] {
         SmoothingOptions options;
         options.threads = 1;
         smooth(wavy().vertices, wavy().triangles, space, &volume(), options);
       }},
      {"constrain",
       [] {
         ConstrainOptions options;
         options.threads = 1;
         constrain(wavy().vertices, moved, faces, 3, space, volume(), options);
       }},
      {"hausdorff",
       [] {
         hausdorff({moved, wavy().triangles}, wavy(), {std::nullopt, 1, nullptr});
       }},
      {"deviation",
       [] {
         deviation({moved, wavy().triangles}, wavy(), {.threads = 1, .steps = 1, .pieces = 24000});
       }},
  };
}

TEST(Call, StopsEveryOperationInItsMiddle) {
  for (const NamedCall& named : calls()) {
    SCOPED_TRACE(named.name);
    const std::size_t polls = polls_of(named.run);
    ASSERT_GE(polls, 8u);
    for (const double share : {0.5, 0.02, 0.97}) {
      if (kSanitized && share != 0.5) break;  // the ordinary build cancels early and late, too
      const Counted part(1 + static_cast<std::size_t>(share * static_cast<double>(polls)));
      EXPECT_THROW(named.run(), Cancelled) << share;
      EXPECT_EQ(part.polls, part.last) << share;
    }
  }
}

TEST(Call, IsHeardWhileALargeGridIsFilled) {
  // Two small triangles far from each other: hardly any work but that of writing the grid.
  const TriangleMesh specks{{{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}, {1, 1, 1}, {0.99, 1, 1}, {1, 0.99, 1}},
                            {{0, 1, 2}, {3, 4, 5}}};
  DistanceGrid grid = laid_out(specks, 0.005, 1);
  const std::size_t polls = polls_of([&] { scatter(specks, grid, 1, nullptr); });
  ASSERT_GT(grid.distance.size(), 7 * kFilledAtOnce);
  EXPECT_GT(polls, 2 * (grid.distance.size() / kFilledAtOnce));
  EXPECT_GT(polls_of([&] { copied(grid.distance); }), grid.distance.size() / kFilledAtOnce);
  EXPECT_EQ(copied(grid.distance), grid.distance);
}

TEST(Call, IsHeardInsideOneFace) {
  // The face lies where hardly a part of it is nearer than the tolerance or farther: it takes the whole budget.
  const TriangleMesh waves = shapes::squares(
      100, [](const glm::dvec3& p) { return glm::dvec3(p.x, p.y, 0.01 * std::sin(60 * p.x) * std::sin(60 * p.y)); });
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const ToleranceVolume around(waves.vertices, waves.triangles, space, 0.00995);
  const std::vector<glm::dvec3> corners{{0.02, 0.02, 0}, {0.98, 0.02, 0}, {0.98, 0.98, 0}};
  const std::vector<std::uint32_t> face{0, 1, 2};
  const auto check = [&] { Certificate(around).check({corners, space, face}, {1, nullptr}); };
  const std::size_t polls = polls_of(check);
  ASSERT_GE(polls, 20u);
  const Counted part(polls / 2);
  EXPECT_THROW(check(), Cancelled);
}

TEST(Call, IsHeardInsideOneSearch) {
  // From its centre all triangles of a sphere are equally far.
  const Hierarchy hierarchy(shapes::sphere(60));
  EXPECT_GE(polls_of([&] { hierarchy.nearest(glm::dvec3(0)); }), 3u);
}

TEST(Call, CancelledAtTheEndOfACheckLeavesNoVerdicts) {
  const std::vector<std::uint32_t> faces = indices();
  const Certificate certificate(volume());
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const auto check = [&] { certificate.check({wavy().vertices, space, faces}, {1, nullptr}); };
  const Counted part(polls_of(check));
  EXPECT_THROW(check(), Cancelled);
}

TEST(Call, LeavesTheGuardAsItWas) {
  std::vector<float> start, wish;
  for (const glm::dvec3& p : wavy().vertices) start.insert(start.end(), {float(p.x), float(p.y), float(p.z)});
  for (const glm::dvec3& p : pushed()) wish.insert(wish.end(), {float(p.x), float(p.y), float(p.z)});
  Guard stopped(start, indices(), 3, glm::dmat4(1), volume(), {.threads = 1});
  Guard plain(start, indices(), 3, glm::dmat4(1), volume(), {.threads = 1});
  Guard other(start, indices(), 3, glm::dmat4(1), volume(), {.threads = 1});
  const std::size_t polls = polls_of([&] { other.constrain(wish); });
  ASSERT_GE(polls, 8u);
  for (const std::size_t divisor : {8, 3, 2}) {
    const Counted part(polls - polls / divisor);
    EXPECT_THROW(stopped.constrain(wish), Cancelled);
  }
  const Guard::Correction after = stopped.constrain(wish), without = plain.constrain(wish);
  EXPECT_EQ(after.vertices, without.vertices);
  EXPECT_EQ(after.positions, without.positions);
}

TEST(Call, IsThatOfWhoeverSharesALoop) {
  Team team(3);
  Progress progress;
  const Call call(&progress);
  std::atomic<int> begun = 0;
  EXPECT_THROW(team.run(3, 1,
                        [&](std::size_t, std::size_t) {
                          if (++begun == 3) progress.cancel();
                          for (;;) poll();
                        }),
               Cancelled);
}

TEST(Call, EndsTheFastPhaseInTimeWithWhatIsProved) {
  DecimationOptions options;
  options.threads = 1;
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const std::size_t whole = decimate(wavy().vertices, wavy().triangles, space, &volume(), options).triangles.size();
  options.max_seconds = 1e-9;
  for (const auto effort : {DecimationOptions::Effort::fast, DecimationOptions::Effort::thorough}) {
    options.effort = effort;
    const DecimationResult result = decimate(wavy().vertices, wavy().triangles, space, &volume(), options);
    EXPECT_TRUE(result.stopped_at_time);
    EXPECT_GT(result.triangles.size(), whole);
    const TriangleMesh mesh{result.vertices, result.triangles};
    EXPECT_LE(hausdorff(mesh, wavy(), {kTolerance}).upper, kTolerance);
    EXPECT_LE(hausdorff(wavy(), mesh, {kTolerance}).upper, kTolerance);
  }
}

}  // namespace
}  // namespace tolvol
