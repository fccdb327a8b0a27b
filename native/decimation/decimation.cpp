// SPDX-License-Identifier: GPL-3.0-or-later
// What surrounds the loop: certify the input, cut it to a manifold, set up the bounds that were asked for, and carry
// the result back to the input's vertices, triangles and attributes.
#include "decimation/decimation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <unordered_map>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/certificate.h"
#include "check/input_checks.h"
#include "decimation/boundary.h"
#include "decimation/certified_bounds.h"
#include "decimation/collapse_rounds.h"
#include "decimation/refinement.h"
#include "topology/manifold_cut.h"
#include "topology/wedges.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = CutMesh::kNone;

class Decimation {
 public:
  Decimation(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
             const ToleranceVolume* volume, const DecimationOptions& options)
      : vertices_(vertices),
        triangles_(triangles),
        volume_(volume),
        options_(options),
        space_(space),
        // A baseline answers one question after another.
        team_(options.baseline ? 1 : std::min(thread_count(options.threads), kMostThreads)) {
    validate(vertices, triangles);
    if (!volume && options.target_triangles == 0) throw InvalidInput("without a volume a target is needed");
    if (!volume && options.baseline)
      throw InvalidInput("without a volume there is no tolerance for a baseline to keep");
    if (!options.locked.empty() && options.locked.size() != vertices.size()) {
      throw InvalidInput("locked must have one value for each vertex");
    }
    if (!options.shares.empty() && options.shares.size() != vertices.size()) {
      throw InvalidInput("shares must have one value for each vertex");
    }
    for (std::size_t i = 0; i < options.shares.size(); ++i) {
      if (!(options.shares[i] >= 0 && options.shares[i] <= 1)) {
        throw InvalidInput("shares must be from 0 to 1, that of vertex " + std::to_string(i) + " is not");
      }
    }
    if (!options.wedges.empty() && options.wedges.size() != 3 * triangles.size()) {
      throw InvalidInput("wedges must have one label for each corner of each triangle");
    }
    space_ = space.in(volume ? volume->frame() : own_frame());
  }

  DecimationResult run() {
    cut_ = cut_to_manifold(vertices_, triangles_, team_);
    positions_.resize(cut_.vertex_input.size());
    for (std::size_t v = 0; v < positions_.size(); ++v) positions_[v] = space_.frame(vertices_[cut_.vertex_input[v]]);
    pin();
    if (std::none_of(cut_.triangles.begin(), cut_.triangles.end(), [&](const glm::uvec3& t) {
          return glm::cross(positions_[t.y] - positions_[t.x], positions_[t.z] - positions_[t.x]) != glm::dvec3(0);
        })) {
      throw InvalidInput("all faces are degenerate (segments or points): there is no surface to decimate");
    }
    Bounds* const bounds = volume_ ? set_bounds() : nullptr;
    BoundedMesh mesh(mesh_input(), bounds, team_);
    const std::size_t apart = cut_.aside.size();
    const std::size_t target = options_.target_triangles > apart ? options_.target_triangles - apart : 0;
    collapse(mesh, target);
    if (mesh.certified() && options_.effort == DecimationOptions::Effort::thorough && !result_.stopped_at_time) {
      Refinement(mesh, team_)
          .run(
              target, [&] { return ended_early(); }, options_.progress);
    }
    result_.stopped_at_target =
        options_.target_triangles > 0 && mesh.triangle_count() + apart <= options_.target_triangles;
    write(mesh);
    take_attributes(mesh);
    report();
    return std::move(result_);
  }

 private:
  bool out_of_time() const {
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    return options_.max_seconds > 0 && spent.count() > options_.max_seconds;
  }

  /// Until no edge can be collapsed, or the time is over: what was being tried then is not carried out.
  void collapse(BoundedMesh& mesh, std::size_t target) {
    const Call limited(nullptr, [this] { return out_of_time(); });
    try {
      collapse_edges(mesh, target, team_, options_.progress);
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

  Frame own_frame() const {
    Box world;
    for (const glm::dvec3& p : vertices_) world.add(space_.world(p));
    return Frame(world);
  }

  void pin() {
    pinned_.resize(cut_.vertex_input.size());
    for (std::size_t v = 0; v < pinned_.size(); ++v) pinned_[v] = cut_.cause[v] == CutCause::degenerate;
    if (options_.locked.empty()) return;
    for_holders([&](std::uint32_t of_input, std::uint32_t vertex) {
      if (options_.locked[of_input]) pin(vertex, "asked for");
    });
  }

  /// visit(input vertex, vertex of the manifold) for all that hold an input vertex: the one it became, and those at its
  /// place of a face that stands in for one that was dropped.
  template <class Visit>
  void for_holders(Visit&& visit) const {
    for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
      if (cut_.input_vertex[i] != kNone) visit(i, cut_.input_vertex[i]);
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      const std::uint32_t held_by = cut_.stand_in[t];
      if (held_by == t || held_by == kNone) continue;
      for (int k = 0; k < 9; ++k) {
        const std::uint32_t dropped = triangles_[t][k / 3], held = triangles_[held_by][k % 3];
        if (vertices_[dropped] == vertices_[held] && cut_.input_vertex[held] != kNone) {
          visit(dropped, cut_.input_vertex[held]);
        }
      }
    }
  }

  void pin(std::uint32_t vertex, const std::string& cause) {
    if (!pinned_[vertex]) ++result_.locked[cause];
    pinned_[vertex] = true;
  }

  bool input_is_reference() const {
    const TriangleMesh& reference = volume_->reference();
    if (reference.vertices.size() != vertices_.size() || reference.triangles.size() != triangles_.size()) return false;
    if (!std::equal(triangles_.begin(), triangles_.end(), reference.triangles.begin())) return false;
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      if (space_.frame(vertices_[i]) != reference.vertices[i]) return false;
    }
    return true;
  }

  Bounds* set_bounds() {
    std::vector<glm::dvec3> used;
    for (const std::uint32_t i : cut_.vertex_input) used.push_back(vertices_[i]);
    if (const auto warning = storage_warning(*volume_, space_, used)) result_.warnings.push_back(*warning);
    // Vertices may end up anywhere in the volume.
    const double reach = 1 + volume_->frame_tolerance();
    for (int corner = 0; corner < 8; ++corner) {
      used.push_back(space_.store(reach * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
    }
    const double mapping_error = space_.mapping_error(used);
    const double provable = volume_->provable(mapping_error), limit = provable * (1 - kHeadroom);
    if (options_.baseline) {
      options_.baseline->begin({positions_, cut_.triangles}, mapping_error);
      result_.method = options_.baseline->method(), result_.renderer = options_.baseline->renderer();
      return options_.baseline;
    }
    const Certificate certificate(*volume_);
    result_.method = certificate.method(), result_.renderer = certificate.renderer();
    identical_ = input_is_reference();
    if (identical_) {
      element_of_.assign(triangles_.size(), kNone);
      for (std::uint32_t t = 0; t < cut_.triangle_input.size(); ++t) element_of_[cut_.triangle_input[t]] = t;
    }
    if (!identical_) certify_input(certificate, mapping_error);

    forward_.emplace(volume_->witnesses(), volume_->grid(), volume_->hierarchy(), limit,
                     volume_->refutable(mapping_error));
    CertifiedBounds::Directions directions{*forward_};
    if (options_.two_sided) {
      backward_.emplace(volume_->reference(), limit, cut_.triangles.size());
      cover(provable);
      directions.backward = &*backward_;
    } else {
      boundary_.emplace(*volume_, cut_, positions_, identical_, limit, provable, team_);
      for (const std::uint32_t v : boundary_->uncertified()) pin(v, "boundary not near the reference's boundary");
      if (boundary_->any()) {
        directions.boundary_forward = &boundary_->forward();
        directions.boundary_backward = &boundary_->backward();
        // Edges that were cut count as boundary in the kernel, and are none.
        for (std::uint32_t v = 0; v < cut_.cause.size(); ++v) {
          if (cut_.cause[v] == CutCause::non_manifold) pin(v, "non-manifold");
        }
      }
    }
    return &certified_.emplace(directions, positions_, cut_.triangles.size(), identical_);
  }

  void certify_input(const Certificate& certificate, double mapping_error) {
    const std::vector<glm::dvec3> in_frame = space_.frame(vertices_);
    std::vector<std::uint32_t> indices;
    indices.reserve(3 * triangles_.size());
    for (const glm::uvec3& t : triangles_) indices.insert(indices.end(), {t.x, t.y, t.z});
    const std::vector<Verdict> verdicts =
        certificate.check({in_frame, indices, 3, mapping_error}, {options_.threads, options_.progress});
    for (std::uint32_t i = 0; i < verdicts.size(); ++i) {
      if (verdicts[i] == Verdict::inside) continue;
      ++result_.outside_faces;
      if (!result_.first_outside) result_.first_outside = i;
      for (int k = 0; k < 3; ++k) pin(cut_.input_vertex[triangles_[i][k]], "outside the tolerance");
    }
    if (result_.outside_faces && options_.outside == DecimationOptions::Outside::error) {
      refuse_outside(result_.outside_faces, *result_.first_outside);
    }
  }

  /// First witnesses for every triangle of the reference.
  void cover(double provable) {
    if (identical_) {
      for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
        const std::uint32_t element = element_of_[cut_.stand_in[i]];
        if (element != kNone) backward_->set_witness(element, i);  // what is set aside never changes and covers itself
      }
      return;
    }
    TriangleMesh elements{positions_, cut_.triangles};
    std::vector<std::uint32_t> ids(cut_.triangles.size());
    for (std::uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
    for (const std::uint32_t i : cut_.aside) {
      elements.triangles.emplace_back(cut_.input_vertex[triangles_[i].x], cut_.input_vertex[triangles_[i].y],
                                      cut_.input_vertex[triangles_[i].z]);
      ids.push_back(kNone);
    }
    const Hierarchy hierarchy(elements);
    std::vector<std::uint32_t> nearest;
    std::size_t first = 0;
    std::size_t& uncovered = result_.uncovered_faces;
    const std::size_t count = volume_->reference().triangles.size();
    if (options_.progress) options_.progress->begin("comparing");
    for (std::uint32_t i = 0; i < count; ++i) {
      poll_at(i);
      if (options_.progress) options_.progress->update(static_cast<double>(i) / static_cast<double>(count));
      if (!backward_->find_witnesses(i, hierarchy, ids, provable, nearest) && uncovered++ == 0) first = i;
    }
    if (uncovered && options_.outside == DecimationOptions::Outside::error) {
      std::ostringstream text;
      text << uncovered << " faces of the reference are not within the tolerance of the mesh, the first is face "
           << first
           << "; take a larger tolerance, set the reference anew, keep one direction only (two_sided=False), or go on "
              "from "
           << "what there is (outside=\"keep\")";
      throw InvalidInput(text.str());
    }
    if (uncovered) {
      result_.warnings.push_back(std::to_string(uncovered) +
                                 " faces of the reference are partly or wholly beyond the tolerance of " +
                                 "the mesh, as they were before; what is nearest to them was kept");
    }
    for (const std::uint32_t t : nearest) {
      for (int k = 0; k < 3; ++k) pin(elements.triangles[t][k], "outside the tolerance");
    }
  }

  BoundedMeshInput mesh_input() {
    BoundedMeshInput input;
    input.triangles = cut_.triangles;
    input.mates = std::move(cut_.mates);
    for (std::size_t v = 0; v < positions_.size(); ++v)
      input.positions.push_back({vertices_[cut_.vertex_input[v]], positions_[v]});
    // What holds for a vertex holds for its copies.
    const std::vector<std::uint32_t>& slots = cut_.output_slot;
    std::vector<bool> pinned(positions_.size(), false);
    for (std::size_t v = 0; v < positions_.size(); ++v) pinned[slots[v]] = pinned[slots[v]] || pinned_[v];
    for (const std::uint32_t slot : slots) input.pinned.push_back(pinned[slot]);
    if (!options_.shares.empty()) {
      std::vector<double> shares(positions_.size(), 1);
      for_holders([&](std::uint32_t of_input, std::uint32_t vertex) {
        double& share = shares[slots[vertex]];
        share = std::min(share, options_.shares[of_input]);
      });
      for (const std::uint32_t slot : slots) input.shares.push_back(shares[slot]);
    }
    for (const CutCause cause : cut_.cause) input.joined.push_back(cause == CutCause::non_manifold);
    input.slots = slots;
    if (!options_.wedges.empty()) {
      // Labels name wedges at one input vertex; vertices welded from several hold those of all of them.
      std::unordered_map<std::uint64_t, std::uint32_t> dense;
      for (std::uint32_t t = 0; t < cut_.triangles.size(); ++t) {
        glm::uvec3 wedges;
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t corner = input_corner(t, k);
          const std::uint64_t key =
              (static_cast<std::uint64_t>(triangles_[corner / 3][corner % 3]) << 32) | options_.wedges[corner];
          wedges[k] = dense.try_emplace(key, static_cast<std::uint32_t>(dense.size())).first->second;
        }
        input.wedges.push_back(wedges);
      }
      islands_ = island_labels(cut_.triangles, input.wedges);
    }
    input.subset = options_.placement == DecimationOptions::Placement::subset;
    input.store = [this](const glm::dvec3& p) {
      const glm::dvec3 stored = space_.store(p);
      return VertexPosition{stored, space_.frame(stored)};
    };
    return input;
  }

  /// The input corner, as 3 * triangle + corner, of a corner of the cut mesh.
  std::uint32_t input_corner(std::uint32_t triangle, int corner) const {
    return 3 * cut_.triangle_input[triangle] + static_cast<std::uint32_t>(own_corner(triangle, corner));
  }
  /// The other way around it is the same.
  int own_corner(std::uint32_t triangle, int corner) const {
    return cut_.reversed[triangle] && corner != 0 ? 3 - corner : corner;
  }

  void write(const BoundedMesh& mesh) {
    // Result vertices in the order of the input vertices that they continue.
    std::vector<std::uint32_t> order;
    std::vector<std::uint32_t> used(positions_.size(), kNone);
    const auto slot = [&](std::uint32_t v) { return mesh.slot(mesh.survivor(v)); };
    // Corner k of a result triangle, in the order of the input triangle that it continues.
    const auto corner = [&](std::uint32_t input, std::uint32_t t, int k) {
      return slot(t == kNone ? cut_.input_vertex[triangles_[input][k]] : mesh.triangle(t)[own_corner(t, k)]);
    };
    const auto use = [&](std::uint32_t s) {
      if (used[s] == kNone) used[s] = 0, order.push_back(s);
    };
    std::vector<std::pair<std::uint32_t, std::uint32_t>> kept;  // (input triangle, triangle of the cut mesh or kNone)
    for (std::uint32_t t = 0; t < cut_.triangles.size(); ++t) {
      if (mesh.alive(t)) kept.emplace_back(cut_.triangle_input[t], t);
    }
    for (const std::uint32_t i : cut_.aside) kept.emplace_back(i, kNone);
    std::sort(kept.begin(), kept.end());
    for (const auto& [input, t] : kept) {
      poll_at(order.size());
      for (int k = 0; k < 3; ++k) use(corner(input, t, k));
    }
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return cut_.vertex_input[a] < cut_.vertex_input[b]; });
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      const std::uint32_t v = order[i];
      used[v] = i;
      const std::uint32_t source = cut_.vertex_input[v];
      result_.vertex_source.push_back(source);
      result_.vertices.push_back(mesh.stored(v));
    }
    for (const auto& [input, t] : kept) {
      glm::uvec3 triangle;
      for (int k = 0; k < 3; ++k) triangle[k] = used[corner(input, t, k)];
      result_.triangles.push_back(triangle);
      result_.triangle_source.push_back(input);
      kept_.push_back(t);
    }
    result_.vertex_map.assign(vertices_.size(), -1);
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      if (cut_.input_vertex[i] == kNone) continue;
      result_.vertex_map[i] = static_cast<std::int32_t>(used[slot(cut_.input_vertex[i])]);
    }
  }

  void take_attributes(const BoundedMesh& mesh) {
    const glm::dmat3 unit(1);
    std::vector<std::uint32_t> any_corner(positions_.size(), kNone);
    for (std::uint32_t t = 0; t < cut_.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        std::uint32_t& corner = any_corner[cut_.triangles[t][k]];
        if (corner == kNone) corner = 3 * t + static_cast<std::uint32_t>(k);
      }
    }
    std::optional<Hierarchy> own;
    const TriangleMesh input{positions_, cut_.triangles};
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      poll_at(i);
      glm::uvec3 triangle(result_.triangle_source[i]);
      glm::dmat3 weights = unit;
      for (int k = 0; k < 3 && kept_[i] != kNone; ++k) {
        const std::uint32_t t = kept_[i];
        const int corner = own_corner(t, k);
        const std::uint32_t v = mesh.triangle(t)[corner];
        if (!mesh.left_original(v)) {
          const std::uint32_t source = islands_.empty() ? any_corner[v] : mesh.corner_source(t, corner);
          const std::uint32_t original = input_corner(source / 3, static_cast<int>(source % 3));
          triangle[k] = original / 3;
          weights[k] = unit[static_cast<int>(original % 3)];
          continue;
        }
        const auto same_island = [&](std::uint32_t other) {
          return islands_.empty() || islands_[other] == islands_[t];
        };
        const glm::dvec3& p = mesh.position(v);
        if (identical_) {
          const Hierarchy::Nearest nearest = volume_->hierarchy().nearest_if(
              p, [&](std::uint32_t i) { return element_of_[i] != kNone && same_island(element_of_[i]); });
          triangle[k] = nearest.triangle;
          weights[k] = nearest.weights;
          continue;
        }
        if (!own) own.emplace(input);
        const Hierarchy::Nearest nearest = own->nearest_if(p, same_island);
        triangle[k] = cut_.triangle_input[nearest.triangle];
        weights[k] = nearest.weights;
        if (cut_.reversed[nearest.triangle]) std::swap(weights[k].y, weights[k].z);
      }
      result_.source_triangle.push_back(triangle);
      result_.source_weights.push_back(weights);
    }
  }

  void report() {
    const auto repair = [&](std::size_t count, const char* kind, const char* message) {
      if (count) result_.repairs.push_back({kind, count, std::to_string(count) + " " + message});
    };
    repair(cut_.duplicates, "duplicate", "exact duplicate faces dropped");
    repair(cut_.degenerate_on_edge, "degenerate", "degenerate faces on an edge of another face dropped");
    repair(cut_.aside.size(), "kept_degenerate", "degenerate faces kept as they are");
    repair(cut_.welded, "welded", "vertices at exactly the position of another joined to it");
    repair(cut_.cut_edges, "cut", "non-manifold edges, which collapse along themselves alone");
    repair(cut_.reversed_count, "misoriented", "faces against their neighbours' orientation, kept so");
    std::size_t unused = 0;
    for (const std::uint32_t v : cut_.input_vertex) unused += v == kNone;
    repair(unused, "unused", "vertices that no face uses are not part of the result");
    for (const CutCause cause : cut_.cause) {
      if (cause == CutCause::degenerate) ++result_.locked["degenerate face"];
    }
  }

  std::span<const glm::dvec3> vertices_;
  std::span<const glm::uvec3> triangles_;
  const ToleranceVolume* volume_;
  const DecimationOptions& options_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  StoredSpace space_;
  Team team_;

  CutMesh cut_;
  std::vector<glm::dvec3> positions_;  // of the cut mesh, in the frame
  std::vector<bool> pinned_;
  std::vector<std::uint32_t> islands_;     // per triangle of the cut mesh; empty without wedges
  bool identical_ = false;                 // the input is the reference itself
  std::vector<std::uint32_t> element_of_;  // per input triangle, if so: its triangle in the cut mesh or kNone
  std::optional<TriangleCertificate> forward_;
  std::optional<Coverage> backward_;
  std::optional<BoundaryBounds> boundary_;
  std::optional<CertifiedBounds> certified_;
  std::vector<std::uint32_t> kept_;  // per result triangle: its triangle in the cut mesh
  DecimationResult result_;
};

}  // namespace

DecimationResult decimate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                          const StoredSpace& space, const ToleranceVolume* volume, const DecimationOptions& options) {
  const Call call(options.progress);
  return Decimation(vertices, triangles, space, volume, options).run();
}

}  // namespace tolvol
