// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/close_holes.h"

#include <algorithm>
#include <atomic>
#include <string>
#include <utility>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/input_checks.h"
#include "geometry/frame.h"
#include "geometry/weld.h"
#include "repair/earlier_fillings.h"
#include "repair/filling.h"
#include "repair/filling_rules.h"
#include "topology/boundary_loops.h"
#include "topology/faces_cross.h"
#include "topology/sides.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = HoleClosingResult::kNone;
/// The holes share kMostSteps steps of searches for proofs (TriangleCertificate::bound_in_any_order()) by the squares
/// of their numbers of corners, but each has kLeastSteps at least, and as many again where it is filled anew. The proof
/// of one triangle among needles may take tens of thousands of steps.
constexpr double kMostSteps = 1e8, kLeastSteps = 1e7;

void check(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
           const CloseHolesOptions& options) {
  validate(vertices, triangles);
  if (options.largest_perimeter && !(*options.largest_perimeter > 0)) {
    throw InvalidInput("largest_perimeter must be more than 0, or None for no limit");
  }
  require_normal_angle(options.max_normal_angle);
  if (!options.shares.empty() && options.shares.size() != vertices.size()) {
    throw InvalidInput("shares must have one value for each vertex");
  }
  for (std::size_t i = 0; i < options.shares.size(); ++i) {
    if (!(options.shares[i] >= 0 && options.shares[i] <= 1)) {
      throw InvalidInput("shares must be from 0 to 1, that of vertex " + std::to_string(i) + " is not");
    }
  }
}

class Closing {
 public:
  Closing(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
          const ToleranceVolume& volume, const CloseHolesOptions& options, Team& team)
      : mesh_{triangles, vertices}, space_(space.in(volume.frame())), volume_(volume), options_(options), team_(team) {}

  HoleClosingResult run() {
    std::vector<std::uint32_t> place = weld_equal_positions(mesh_.vertices, team_);
    if (options_.progress) options_.progress->begin("finding holes");
    const std::vector<glm::dvec3> positions = space_.frame(mesh_.vertices);
    for (BoundaryLoop& loop : boundary_loops(positions, place, mesh_.triangles, team_))
      take(std::move(loop), positions);
    std::vector<std::uint32_t> open;
    for (const Hole& hole : holes_) {
      if (result_.loops[hole.number].outcome == LoopOutcome::closed) open.push_back(hole.number);
    }
    if (!open.empty()) {
      const FillingRules rules(mesh_, std::move(place), holes_, space_, volume_, options_.shares,
                               options_.max_normal_angle, team_, result_.warnings);
      if (options_.progress) options_.progress->begin("closing holes");
      share_steps(open);
      fill(open, rules);
      keep_apart(open, rules);
    }
    write();
    return std::move(result_);
  }

 private:
  void take(BoundaryLoop&& found, std::span<const glm::dvec3> positions) {
    HoleClosingResult::Loop loop;
    Hole hole;
    hole.number = static_cast<std::uint32_t>(holes_.size());
    hole.sides = std::move(found.sides);
    glm::dvec3 sum(0);
    double length = 0;
    for (std::size_t i = 0; i < hole.sides.size(); ++i) {
      const std::uint32_t from = vertex_of(hole.sides[i]), to = vertex_of(next_corner(hole.sides[i]));
      hole.corner.push_back(from);
      hole.at.push_back(positions[from]);
      sum += positions[from];
      length += glm::length(positions[to] - positions[from]);
    }
    loop.vertex = hole.corner.front();
    loop.corners = hole.sides.size();
    loop.perimeter = length / volume_.frame().scale();
    loop.centre = volume_.frame().to_world(sum * (1 / static_cast<double>(loop.corners)));
    if (!found.closed) {
      loop.outcome = LoopOutcome::not_a_loop;
    } else if (options_.largest_perimeter && loop.perimeter > *options_.largest_perimeter) {
      loop.outcome = LoopOutcome::perimeter;
    } else if (loop.corners > kMostLoopCorners) {
      loop.outcome = LoopOutcome::too_long;
    }
    result_.loops.push_back(loop);
    holes_.push_back(std::move(hole));
  }

  std::uint32_t vertex_of(Side corner) const { return mesh_.triangles[corner / 3][static_cast<int>(corner % 3)]; }

  void share_steps(std::span<const std::uint32_t> open) {
    const auto squared = [&](std::uint32_t i) {
      const auto count = static_cast<double>(holes_[i].corner.size());
      return count * count;
    };
    double sum = 0;
    for (const std::uint32_t i : open) sum += squared(i);
    for (const std::uint32_t i : open) {
      holes_[i].most_steps = static_cast<std::size_t>(std::max(kMostSteps * squared(i) / sum, kLeastSteps));
    }
  }

  /// Fills each hole as if it were alone.
  void fill(std::span<const std::uint32_t> open, const FillingRules& rules) {
    std::atomic<std::size_t> done = 0;
    team_.run(open.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Hole& hole = holes_[open[i]];
        rules.measure(hole);
        result_.loops[hole.number].outcome = Filling(rules, hole).run();
        if (options_.progress)
          options_.progress->update(static_cast<double>(++done) / static_cast<double>(open.size()));
      }
    });
  }

  /// Fills those holes anew whose triangles cross those of a lower one or lie on one edge with them.
  void keep_apart(std::span<const std::uint32_t> open, const FillingRules& rules) {
    EarlierFillings earlier(rules, holes_, team_);
    for (const std::uint32_t i : open) {
      Hole& hole = holes_[i];
      if (!earlier.allow(hole)) {
        result_.loops[i].outcome = Filling(rules, hole, &earlier).run();
        earlier.replace(hole);
      }
      earlier.keep(hole);
    }
  }

  void write() {
    result_.triangles.assign(mesh_.triangles.begin(), mesh_.triangles.end());
    for (const Hole& hole : holes_) {
      const auto count = static_cast<std::uint32_t>(hole.corner.size());
      for (const glm::uvec3& f : hole.faces) {
        poll_at(result_.loop.size());
        const glm::uvec3 corners(f.z, f.y, f.x);
        glm::uvec3 triangle, borders, source;
        for (int k = 0; k < 3; ++k) {
          // The rim runs the other way: a side of the new triangle from corner b to a is the rim's side a, if b follows
          // a.
          const std::uint32_t b = corners[k], a = corners[(k + 1) % 3];
          triangle[k] = hole.corner[b];
          borders[k] = (a + 1) % count == b ? hole.sides[a] / 3 : kNone;
        }
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t here = corners[k];
          // The side that begins here at the rim, or else the one that ends here.
          const bool ends_here = borders[k] != kNone && borders[(k + 2) % 3] == kNone;
          source[k] = ends_here ? next_corner(hole.sides[(here + count - 1) % count]) : hole.sides[here];
        }
        result_.triangles.push_back(triangle);
        result_.loop.push_back(hole.number);
        result_.borders.push_back(borders);
        result_.corner_source.push_back(source);
      }
    }
  }

  MeshView mesh_;
  StoredSpace space_;
  const ToleranceVolume& volume_;
  const CloseHolesOptions& options_;
  Team& team_;
  std::vector<Hole> holes_;
  HoleClosingResult result_;
};

}  // namespace

std::size_t HoleClosingResult::count(LoopOutcome outcome) const {
  return static_cast<std::size_t>(
      std::count_if(loops.begin(), loops.end(), [&](const Loop& loop) { return loop.outcome == outcome; }));
}

HoleClosingResult close_holes(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                              const StoredSpace& space, const ToleranceVolume& volume,
                              const CloseHolesOptions& options) {
  check(vertices, triangles, options);
  const Call call(options.progress);
  Team team(std::min(thread_count(options.threads), kMostThreads));
  return Closing(vertices, triangles, space, volume, options, team).run();
}

}  // namespace tolvol
