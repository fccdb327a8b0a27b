// SPDX-License-Identifier: GPL-3.0-or-later
// A guard lives on after a cancelled call. It is cancelled at every poll here, and answers another wish after that: it
// has to answer as one that was never cancelled. The same wish again would hide what a cancel left behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "many.h"
#include "motion/guard.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using shapes::flat, shapes::indices;
using Crossed = PullBack::Crossings;

constexpr double kTolerance = 0.02;

class Cancels {
 public:
  Cancels(TriangleMesh mesh, Guard::Options options)
      : mesh_(std::move(mesh)),
        volume_(mesh_.vertices, mesh_.triangles, {glm::dmat4(1), Storage::float32}, kTolerance, {}),
        options_(options) {}

  const TriangleMesh& mesh() const { return mesh_; }
  /// Every `stride`-th vertex goes about `by` tolerances in a random direction.
  std::vector<float> wish(std::size_t stride, double by, unsigned seed) const {
    shapes::Random random(seed);
    std::vector<dvec3> points = mesh_.vertices;
    for (std::size_t v = 0; v < points.size(); v += stride) points[v] += by * kTolerance * random.point();
    return flat(points);
  }

  /// Cancels the first wish at every poll up to `most`, and compares the answer to the other one. Returns the number of
  /// cancels.
  std::size_t compare(const std::vector<float>& first, const std::vector<float>& other, std::size_t most) const {
    Guard fresh = guard();
    const Guard::Correction expected = fresh.constrain(other);
    Guard whole = guard();
    const std::size_t polls = std::min(polls_of([&] { whole.constrain(first); }), most);
    for (std::size_t last = 1; last <= polls; ++last) {
      Guard stopped = guard();
      {
        const Counted cancelled(last);
        EXPECT_THROW(stopped.constrain(first), Cancelled) << last;
      }
      const Guard::Correction correction = stopped.constrain(other);
      EXPECT_EQ(correction.vertices, expected.vertices) << "cancelled at poll " << last;
      EXPECT_EQ(correction.positions, expected.positions) << "cancelled at poll " << last;
    }
    return polls;
  }

 private:
  Guard guard() const { return {flat(mesh_.vertices), indices(mesh_), 3, glm::dmat4(1), volume_, options_}; }

  TriangleMesh mesh_;
  ToleranceVolume volume_;
  Guard::Options options_;
};

// The neighbours of what moves stay where they are, and their distances are measured with the others'.
TEST(GuardCancel, AtAnyPollOfAMotionOfAPartChangesNoLaterAnswer) {
  for (const bool two_sided : {false, true}) {
    for (const Crossed crossings : {Crossed::allow, Crossed::keep_out}) {
      const Cancels cancels(shapes::torus(8), {.two_sided = two_sided, .crossings = crossings, .threads = 1});
      EXPECT_GT(cancels.compare(cancels.wish(5, 2, 1), cancels.wish(3, 2, 2), kSanitized ? 12 : 200), 10u);
    }
  }
}

// So many vertices are moved in several blocks, with a poll before each.
TEST(GuardCancel, BetweenTheBlocksOfALargeMotionChangesNoLaterAnswer) {
  shapes::Random random(5);
  const TriangleMesh rough = shapes::stored(
      shapes::squares(40, [&](const dvec3& p) { return dvec3(p.x, p.y, 0.04 * (random.share() - 0.5)); }));
  const Cancels cancels(rough, {.threads = 1});
  ASSERT_GT(cancels.mesh().vertices.size(), 1024u);
  EXPECT_EQ(cancels.compare(cancels.wish(1, 0.9, 3), cancels.wish(3, 2, 4), 12), 12u);
}

}  // namespace
