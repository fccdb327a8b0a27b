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
#include "decimation/near_input_faces.h"
#include "decimation/refinement/refinement.h"

namespace tolvol {
namespace {

using Clock = std::chrono::steady_clock;

/// If the collapses after a refinement remove more than this share of the triangles, the mesh is refined again: of
/// parts of slivers this removes up to a quarter, and of scans hardly anything.
constexpr double kWorthAnotherTime = 0.01;

class Decimation {
 public:
  Decimation(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
             const ToleranceVolume* volume, const DecimationOptions& options, bool joins_t_junctions,
             Clock::time_point start)
      : options_(options),
        start_(start),
        // A baseline answers one question after another.
        team_(options.baseline ? 1 : std::min(thread_count(options.threads), kMostThreads)),
        input_(vertices, triangles, space, volume, options, joins_t_junctions, team_, result_) {}

  DecimationResult run() {
    BoundedMesh mesh(input_.take_mesh(), input_.bounds(), team_);
    std::optional<NewCrossings> crossings;
    const std::size_t apart = input_.cut().aside.size();
    const std::size_t target = options_.target_triangles > apart ? options_.target_triangles - apart : 0;
    // Where collapses or refinement end early, the try that is under way is not carried out, so the mesh is proved.
    until(
        [this] { return is_out_of_time(); },
        [&] {
          if (mesh.certified() && options_.crossings == DecimationOptions::Crossings::keep_out) {
            crossings.emplace(input_.stored_mesh(), mesh.stored_mesh(), input_.faces_aside(), near_input_faces(input_));
          }
          collapse_edges(mesh, crossings ? &*crossings : nullptr, target, begins_anew(mesh), team_, options_.progress);
        });
    if (mesh.certified() && options_.effort == DecimationOptions::Effort::thorough && !result_.stopped_at_time) {
      until([this] { return is_out_of_time() || is_asked_to_finish(); },
            [&] { refine(mesh, crossings ? &*crossings : nullptr, target); });
    }
    result_.stopped_at_target =
        options_.target_triangles > 0 && mesh.triangle_count() + apart <= options_.target_triangles;
    write_result(input_, mesh, result_);
    return std::move(result_);
  }

 private:
  /// Refines the mesh and collapses the edges that can then collapse alone, as long as that is worth another time.
  void refine(BoundedMesh& mesh, NewCrossings* crossings, std::size_t target) {
    for (;;) {
      Refinement(mesh, crossings, team_).run(target, options_.progress);
      const auto refined = static_cast<double>(mesh.triangle_count());
      collapse_once_more(mesh, crossings, target, team_);
      if (static_cast<double>(mesh.triangle_count()) > (1 - kWorthAnotherTime) * refined) return;
    }
  }

  /// Thorough leaves as many triangles without it, and so does fast where each vertex stays where it was. A cell that
  /// holds only a part of the reference does without it to save time: in a large mesh a later round usually decimates
  /// again what the first round leaves.
  bool begins_anew(const BoundedMesh& mesh) const {
    return mesh.certified() && !input_.is_reference_across_cell() &&
           options_.effort == DecimationOptions::Effort::fast &&
           options_.placement == DecimationOptions::Placement::optimal;
  }

  bool is_out_of_time() {
    if (!(options_.max_seconds > 0)) return false;
    const std::chrono::duration<double> spent = Clock::now() - start_;
    result_.stopped_at_time = spent.count() > options_.max_seconds;
    return result_.stopped_at_time;
  }
  bool is_asked_to_finish() {
    result_.stopped_on_request = options_.progress && options_.progress->finishing();
    return result_.stopped_on_request;
  }

  /// Works until there is no more to do or, at any poll, `ended` returns true.
  template <class Ended, class Work>
  void until(Ended&& ended, Work&& work) {
    const Call limited(nullptr, ended);
    try {
      work();
    } catch (const Cancelled&) {
      if (!limited.stopped()) throw;
    }
  }

  const DecimationOptions& options_;
  const Clock::time_point start_;
  Team team_;
  DecimationResult result_;
  DecimationInput input_;
};

}  // namespace

DecimationResult decimate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                          const StoredSpace& space, const ToleranceVolume* volume, const DecimationOptions& options) {
  const Call call(options.progress);
  const Clock::time_point start = Clock::now();
  DecimationResult result = Decimation(vertices, triangles, space, volume, options, true, start).run();
  // Pieces of triangles that were divided at T-junctions may be left where hardly anything can collapse.
  if (result.triangles.size() <= triangles.size()) return result;
  return Decimation(vertices, triangles, space, volume, options, false, start).run();
}

}  // namespace tolvol
