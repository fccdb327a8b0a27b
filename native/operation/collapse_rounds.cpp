// SPDX-License-Identifier: GPL-3.0-or-later
// In a round each region goes up to the same cost, so that the order is nearly that of one loop over all; the counts
// that it leads to are higher or lower by up to four per cent, in the mean about the same.
#include "operation/collapse_rounds.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "operation/collapse_loop.h"
#include "operation/edge_collapse.h"
#include "operation/regions.h"
#include "reference/parallel.h"

namespace tolvol {
namespace {

constexpr std::size_t kMostVertices = 4096;   // of a region
constexpr std::size_t kLeastRegions = 12;     // for as many threads
constexpr std::size_t kLeastVertices = 1024;  // a mesh of fewer is not cut: rims would be much of it
constexpr double kRoundShare = 0.8;           // of the edges that the first of a round may collapse
constexpr double kLeastGain = 0.1;            // of the triangles: after a round that removes fewer there is no other

class Rounds {
 public:
  Rounds(BoundedMesh& mesh, Team& team, Progress* progress)
      : mesh_(mesh),
        team_(team),
        collapse_(mesh),
        shared_(collapse_),
        costs_(mesh.connectivity().n_edges()),
        progress_(progress) {
    if (progress) progress->begin("decimating");
  }

  void by_regions() {
    for (int round = 0;; ++round) {
      const std::size_t triangles = mesh_.triangle_count(), vertices = triangles / 2;
      if (vertices < kLeastVertices) return;
      price();
      const double limit = cost_at(kRoundShare);
      // Every other time the rims come to lie elsewhere.
      const Regions parts =
          regions(mesh_, std::min(kMostVertices, vertices / kLeastRegions), round % 2 == 0 ? 0.5 : 0.35);
      const std::vector<std::vector<std::uint32_t>> edges = edges_of(parts);
      team_.run(parts.count, 1, [&](std::size_t i, std::size_t) {
        CollapseLoop loop(shared_, parts, static_cast<std::uint32_t>(i));
        for (const std::uint32_t e : edges[i]) loop.add(e, costs_[e]);
        loop.run({limit, 0}, progress_);
      });
      const double left = static_cast<double>(mesh_.triangle_count()) / static_cast<double>(triangles);
      if (left > 1 - kLeastGain) return;
    }
  }

  void whole(std::size_t target) {
    price();
    CollapseLoop loop(shared_, team_);
    for (std::uint32_t e = 0; e < costs_.size(); ++e) loop.add(e, costs_[e]);
    loop.run({EdgeCollapse::kNever, target}, progress_);
  }

 private:
  /// Costs of the edges that may be collapsed now.
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
    const auto at = finite.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(finite.size() - 1));
    std::nth_element(finite.begin(), at, finite.end());
    return *at;
  }

  std::vector<std::vector<std::uint32_t>> edges_of(const Regions& parts) const {
    std::vector<std::vector<std::uint32_t>> out(parts.count);
    for (std::uint32_t e = 0; e < costs_.size(); ++e) {
      if (!(costs_[e] < EdgeCollapse::kNever)) continue;
      const std::uint32_t part = parts.of_edge(mesh_, e);
      if (part != Regions::kNone) out[part].push_back(e);
    }
    return out;
  }

  BoundedMesh& mesh_;
  Team& team_;
  EdgeCollapse collapse_;
  CollapseLoop::Shared shared_;
  std::vector<double> costs_;
  Progress* progress_;
};

}  // namespace

void collapse_edges(BoundedMesh& mesh, std::size_t target, Team& team, Progress* progress) {
  Rounds rounds(mesh, team, progress);
  if (target == 0 && !mesh.bounds().rival) rounds.by_regions();
  rounds.whole(target);
}

}  // namespace tolvol
