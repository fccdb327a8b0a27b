// SPDX-License-Identifier: GPL-3.0-or-later
// In a round each region goes up to the same cost, so that the order is nearly that of one loop over the whole mesh.
// The result has up to four per cent more or fewer triangles, and in the mean about as many.
#include "decimation/collapse_rounds.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <optional>
#include <vector>

#include "base/call.h"
#include "base/parallel.h"
#include "decimation/certified_bounds.h"
#include "decimation/collapse_loop.h"
#include "decimation/deferred_proof.h"
#include "decimation/edge_collapse.h"
#include "decimation/regions.h"
#include "decimation/surroundings.h"

namespace tolvol {
namespace {

/// A region has at most this many vertices.
constexpr std::size_t kMostVertices = 4096;
/// A mesh that is cut has at least this many regions, which as many threads can share.
constexpr std::size_t kLeastRegions = 12;
/// A mesh with fewer vertices than this is not cut, because the rims would be much of it.
constexpr std::size_t kLeastVertices = 1024;
/// A round collapses edges up to the cost below which this share of the edges lies that may be collapsed.
constexpr double kRoundShare = 0.9;
/// After a round that removes a smaller share of the triangles than this there is no other round.
constexpr double kLeastGain = 0.1;
/// After a round that takes back a larger share of the regions than this each collapse is proved at once.
constexpr double kMostTakenBack = 0.25;
/// Up to this cost hardly a collapse is refused, so rounds on trust go at least this far. The unit of costs is the
/// fourth power of a length; this is a multiple of the fourth power of the tolerance.
constexpr double kTrustedCost = 1;
/// The passes over the whole mesh, where bounds refuse collapses. The second one removes two in a hundred of the
/// triangles that the first one leaves, and takes an eighth of the time; a third one removes hardly any.
constexpr int kPasses = 2;

class Rounds {
 public:
  Rounds(BoundedMesh& mesh, NewCrossings* crossings, Team& team, Progress* progress)
      : mesh_(mesh),
        crossings_(crossings),
        team_(team),
        collapse_(mesh, team),
        shared_(collapse_),
        costs_(mesh.connectivity().n_edges()),
        places_(mesh.certified() ? mesh.connectivity().n_faces() : 0),
        progress_(progress) {
    if (progress) progress->begin("decimating");
  }

  /// Works in rounds, for bounds that are certified: the first rounds put their proofs off.
  void by_regions() {
    bool on_trust = true;
    for (int round = 0;; ++round) {
      const std::size_t triangles = mesh_.triangle_count(), vertices = triangles / 2;
      if (vertices < kLeastVertices) return;
      price();
      const double limit = std::max(cost_at(kRoundShare), on_trust ? trusted_cost() : 0);
      // The two shares take turns, so that the rims lie elsewhere in the next round.
      const Regions parts(mesh_, std::min(kMostVertices, vertices / kLeastRegions), round % 2 == 0 ? 0.5 : 0.35, team_);
      const std::vector<Members> members = members_of(parts);
      mesh_.keep_apart(parts, team_);
      std::atomic<std::size_t> taken_back = 0;
      team_.run(parts.count(), 1, [&](std::size_t i, std::size_t) {
        const auto region = static_cast<std::uint32_t>(i);
        std::optional<Surroundings> surroundings;
        if (crossings_) surroundings.emplace(mesh_, *crossings_, members[i].met(), parts.cell(region));
        Surroundings* const around = surroundings ? &*surroundings : nullptr;
        const auto work = [&](DeferredProof* later) {
          CollapseLoop loop(shared_, parts, region, around, later);
          for (const std::uint32_t e : members[i].edges) loop.add(e, costs_[e]);
          loop.run({limit, 0}, progress_);
        };
        if (on_trust) {
          DeferredProof later(collapse_, mesh_, crossings_, members[i].vertices, members[i].faces, places_);
          if (later.possible()) {
            try {
              work(&later);
              if (later.holds(around)) return;
            } catch (const Cancelled&) {
              later.take_back();
              throw;
            }
            later.take_back();
            ++taken_back;
          }
        }
        if (around) around->renew();
        work(nullptr);
      });
      on_trust = on_trust && static_cast<double>(taken_back) <= kMostTakenBack * static_cast<double>(parts.count());
      const double left = static_cast<double>(mesh_.triangle_count()) / static_cast<double>(triangles);
      if (left > 1 - kLeastGain) return;
    }
  }

  /// Works on the whole mesh, in so many passes. It is called last, because it frees what the rounds need. A pass ends
  /// when no edge can collapse any more; the next one begins anew, as the first one does if `begins_anew`.
  void whole(std::size_t target, int passes, bool begins_anew) {
    places_ = {};
    if (mesh_.certified()) mesh_.keep_apart();
    std::optional<Surroundings> around;
    if (crossings_) around.emplace(mesh_, *crossings_, team_);
    for (int pass = 0; pass < passes && mesh_.triangle_count() > target; ++pass) {
      if (pass > 0 || begins_anew) begin_anew();
      price();
      CollapseLoop loop(shared_, around ? &*around : nullptr, team_);
      for (std::uint32_t e = 0; e < costs_.size(); ++e) {
        poll_at(e);
        loop.add(e, costs_[e]);
      }
      loop.run({EdgeCollapse::kNever, target}, progress_);
    }
  }

 private:
  /// Orders the edges by the faces as they are now, and asks again about those that were refused.
  void begin_anew() {
    collapse_.sum_quadrics(team_);
    shared_.ask_again();
  }

  /// Computes the costs of the edges that may be collapsed now.
  void price() {
    constexpr std::size_t kBlock = 1024;
    team_.run(costs_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::uint32_t e = static_cast<std::uint32_t>(begin); e < end; ++e) {
        const bool waits = shared_.refused[e] || mesh_.connectivity().status(BoundedMesh::edge(e)).deleted();
        costs_[e] = waits ? EdgeCollapse::kNever : collapse_.cost(e);
      }
    });
  }

  double cost_at(double share) const {
    std::vector<double> finite;
    std::copy_if(costs_.begin(), costs_.end(), std::back_inserter(finite),
                 [](double cost) { return cost < EdgeCollapse::kNever; });
    if (finite.empty()) return 0;
    poll();
    const auto at = finite.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(finite.size() - 1));
    std::nth_element(finite.begin(), at, finite.end());
    return *at;
  }

  double trusted_cost() const {
    const double limit = mesh_.certified()->forward().limit();
    return kTrustedCost * limit * limit * limit * limit;
  }

  struct Members {
    std::vector<std::uint32_t> edges;  ///< Edges that can collapse.
    std::vector<std::uint32_t> vertices;
    std::vector<std::uint32_t> faces;  ///< The faces around the vertices.
    /// The faces of no region that meet the region's cell, where crossings are looked for.
    std::vector<std::uint32_t> still;

    /// All faces that a change of the region may come to meet.
    std::vector<std::uint32_t> met() const {
      std::vector<std::uint32_t> all;
      std::ranges::merge(faces, still, std::back_inserter(all));
      return all;
    }
  };

  std::vector<Members> members_of(const Regions& parts) const {
    std::vector<Members> out(parts.count());
    for (std::uint32_t e = 0; e < costs_.size(); ++e) {
      poll_at(e);
      if (!(costs_[e] < EdgeCollapse::kNever)) continue;
      const std::uint32_t part = parts.of_edge(mesh_, e);
      if (part != Regions::kNone) out[part].edges.push_back(e);
    }
    for (std::uint32_t v = 0; v < mesh_.connectivity().n_vertices(); ++v) {
      if (parts.of_vertex(v) != Regions::kNone) out[parts.of_vertex(v)].vertices.push_back(v);
    }
    for (std::uint32_t f = 0; f < mesh_.connectivity().n_faces(); ++f) {
      if (!mesh_.alive(f)) continue;
      const glm::uvec3& t = mesh_.triangle(f);
      const std::uint32_t part = std::min({parts.of_vertex(t.x), parts.of_vertex(t.y), parts.of_vertex(t.z)});
      if (part != Regions::kNone) {
        out[part].faces.push_back(f);
      } else if (crossings_) {
        add_still(f, parts, out);
      }
    }
    const auto count = static_cast<std::uint32_t>(mesh_.connectivity().n_faces());
    for (std::uint32_t f = count; crossings_ && f < crossings_->face_count(); ++f) add_still(f, parts, out);
    return out;
  }

  void add_still(std::uint32_t face, const Regions& parts, std::vector<Members>& out) const {
    parts.for_each_meeting(box_of(crossings_->corners(face)),
                           [&](std::uint32_t part) { out[part].still.push_back(face); });
  }

  BoundedMesh& mesh_;
  NewCrossings* crossings_;  ///< Null where crossings are allowed.
  Team& team_;
  EdgeCollapse collapse_;
  CollapseLoop::Shared shared_;
  std::vector<double> costs_;
  std::vector<std::uint32_t> places_;  ///< For each face; DeferredProof uses it.
  Progress* progress_;
};

}  // namespace

void collapse_edges(BoundedMesh& mesh, NewCrossings* crossings, std::size_t target, bool begins_anew, Team& team,
                    Progress* progress) {
  Rounds rounds(mesh, crossings, team, progress);
  const bool has_rounds = target == 0 && mesh.certified();
  if (has_rounds) rounds.by_regions();
  rounds.whole(target, begins_anew ? kPasses : 1, has_rounds && begins_anew);
}

void collapse_once_more(BoundedMesh& mesh, NewCrossings* crossings, std::size_t target, Team& team) {
  Rounds(mesh, crossings, team, nullptr).whole(target, 1, false);
}

}  // namespace tolvol
