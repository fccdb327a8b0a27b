// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/decimation.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "base/call.h"
#include "base/parallel.h"
#include "decimation/collapse_rounds.h"
#include "decimation/decimation_input.h"
#include "decimation/decimation_output.h"
#include "decimation/refinement.h"

namespace tolvol {
namespace {

class Decimation {
 public:
  Decimation(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
             const ToleranceVolume* volume, const DecimationOptions& options)
      : options_(options),
        // A baseline answers one question after another.
        team_(options.baseline ? 1 : std::min(thread_count(options.threads), kMostThreads)),
        input_(vertices, triangles, space, volume, options, team_, result_) {}

  DecimationResult run() {
    BoundedMesh mesh(input_.take_mesh(), input_.bounds(), team_);
    std::optional<NewCrossings> crossings;
    if (mesh.certified() && options_.crossings == DecimationOptions::Crossings::keep_out) {
      crossings.emplace(input_.stored_mesh(), mesh.stored_mesh(), input_.faces_aside());
    }
    NewCrossings* const kept_out = crossings ? &*crossings : nullptr;
    const std::size_t apart = input_.cut().aside.size();
    const std::size_t target = options_.target_triangles > apart ? options_.target_triangles - apart : 0;
    collapse(mesh, kept_out, target);
    if (mesh.certified() && options_.effort == DecimationOptions::Effort::thorough && !result_.stopped_at_time) {
      Refinement(mesh, kept_out, team_)
          .run(
              target, [&] { return ended_early(); }, options_.progress);
    }
    result_.stopped_at_target =
        options_.target_triangles > 0 && mesh.triangle_count() + apart <= options_.target_triangles;
    write_result(input_, mesh, result_);
    return std::move(result_);
  }

 private:
  bool out_of_time() const {
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    return options_.max_seconds > 0 && spent.count() > options_.max_seconds;
  }

  /// Collapses edges until none can be collapsed or the time is over. A try that is under way then is not carried out.
  void collapse(BoundedMesh& mesh, NewCrossings* crossings, std::size_t target) {
    const Call limited(nullptr, [this] { return out_of_time(); });
    try {
      collapse_edges(mesh, crossings, target, team_, options_.progress);
    } catch (const Cancelled&) {
      if (!limited.stopped()) throw;
      result_.stopped_at_time = true;
    }
  }

  bool ended_early() {
    result_.stopped_at_time = out_of_time();
    result_.stopped_on_request = options_.progress && options_.progress->finishing();
    return result_.stopped_at_time || result_.stopped_on_request;
  }

  const DecimationOptions& options_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Team team_;
  DecimationResult result_;
  DecimationInput input_;
};

}  // namespace

DecimationResult decimate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                          const StoredSpace& space, const ToleranceVolume* volume, const DecimationOptions& options) {
  const Call call(options.progress);
  return Decimation(vertices, triangles, space, volume, options).run();
}

}  // namespace tolvol
