// SPDX-License-Identifier: GPL-3.0-or-later
// The paper asks one global query about the deformed mesh, and blocks a deformation that does not pass. So does this
// code, by the certificate. For a deformation that does not pass it looks for the share of the way that passes, or has
// vertices pulled back.
#include "motion/deformation.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/certificate.h"
#include "check/input_checks.h"
#include "geometry/weld.h"
#include "motion/constrain.h"
#include "motion/moving_coverage.h"
#include "motion/moving_crossings.h"
#include "motion/moving_mesh.h"
#include "motion/selection.h"

namespace tolvol {
namespace {

/// The permitted fraction is known to this share of the way.
constexpr int kHalvings = 10;

using Mode = DeformationOptions::Mode;

class Deformation {
 public:
  Deformation(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
              const StoredSpace& space, const ToleranceVolume* volume, const LatticeDeformation& lattice,
              const DeformationOptions& options)
      : before_(vertices),
        faces_(faces),
        corners_(static_cast<std::size_t>(corners)),
        space_(volume ? space.in(volume->frame()) : space),
        volume_(volume),
        lattice_(lattice),
        options_(options) {
    if (volume) certificate_.emplace(*volume);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (std::isfinite(glm::dot(vertices[i], glm::dvec3(1)))) continue;
      throw InvalidInput("vertex " + std::to_string(i) + " is not finite", "invalid_mesh");
    }
    if (corners < 1 || corners > 4 || faces.size() % corners_ != 0) {
      throw InvalidInput("a face must have 1 to 4 corners, and all faces the same number");
    }
    if (volume && faces.empty()) throw InvalidInput("there are no faces to keep within the tolerance");
    for (std::size_t i = 0; i < faces.size(); ++i) {
      if (faces[i] < vertices.size()) continue;
      throw InvalidInput("face " + std::to_string(i / corners_) + " uses vertex " + std::to_string(faces[i]) +
                             ", but there are only " + std::to_string(vertices.size()),
                         "invalid_mesh");
    }
  }

  DeformationResult run() {
    carry();
    if (volume_) {
      bound();
    } else {
      result_.vertices = after_;
    }
    const StoredSpace world = space_.in({});
    for (std::size_t i = 0; i < before_.size(); ++i) {
      if (result_.vertices[i] == before_[i]) continue;
      ++result_.moved;
      const double motion = glm::length(world.world(result_.vertices[i]) - world.world(before_[i]));
      result_.largest_motion = std::max(result_.largest_motion, motion);
    }
    return std::move(result_);
  }

 private:
  void carry() {
    if (options_.progress) options_.progress->begin("deforming");
    const StoredSpace world = space_.in({});
    after_.assign(before_.begin(), before_.end());
    std::atomic<std::size_t> outside{0};
    parallel_for(after_.size(), kManyAtOnce, options_.threads, [&](std::size_t begin, std::size_t end) {
      if (options_.progress) options_.progress->update(static_cast<double>(begin) / static_cast<double>(after_.size()));
      for (std::size_t i = begin; i < end; ++i) {
        const glm::dvec3 p = world.world(before_[i]);
        const std::optional<glm::dvec3> displacement = lattice_.displacement(p);
        if (!displacement) ++outside;
        // Mapping to the world and back would round even where nothing moves.
        if (!displacement || *displacement == glm::dvec3(0)) continue;
        after_[i] = world.store(p + *displacement);
        if (!std::isfinite(glm::dot(after_[i], glm::dvec3(1)))) {
          throw InvalidInput("the lattice carries vertex " + std::to_string(i) + " too far to be stored", "too_far");
        }
      }
    });
    result_.outside_lattice = outside;
  }

  void bound() {
    result_.method = certificate_->method(), result_.renderer = certificate_->renderer();
    warn_of_rounding();
    require_normal_angle(options_.max_normal_angle);
    if (options_.two_sided) require_area_to_cover(static_cast<int>(corners_));
    place_ = weld_equal_positions(before_);
    start(before_);
    add_warnings(start_.warnings);
    if (options_.outside == Outside::error && !is_whole()) return accept_only_if_whole();
    hold_t_junctions();
    if (options_.outside == Outside::keep) keep_outside();
    std::vector<std::uint32_t> failing = leaving(after_);
    if (!failing.empty()) {
      result_.leaving = FaceCount::of(failing);
    } else if (failing = turning(after_); !failing.empty()) {
      result_.turning = FaceCount::of(failing);
    } else if (failing = crossing(after_); !failing.empty()) {
      result_.crossing = FaceCount::of(failing);
    }
    if (failing.empty()) {
      result_.vertices = after_;
    } else {
      options_.mode == Mode::pull_back ? pull_back() : search(std::move(failing));
    }
    if (!result_.normals) take_normals();
    for (std::size_t i = 0; i < after_.size(); ++i) result_.held_back += result_.vertices[i] != after_[i];
  }

  void warn_of_rounding() {
    std::vector<bool> used(before_.size(), false);
    for (const std::uint32_t v : faces_) used[v] = true;
    for (const std::span<const glm::dvec3> stored : {before_, std::span<const glm::dvec3>(after_)}) {
      std::vector<glm::dvec3> of_faces;
      for (std::size_t v = 0; v < stored.size(); ++v) {
        if (used[v]) of_faces.push_back(stored[v]);
      }
      const std::optional<std::string> warning = storage_warning(*volume_, space_, of_faces);
      if (warning && result_.warnings.empty()) result_.warnings.push_back(*warning);
    }
  }

  void add_warnings(std::vector<std::string>& warnings) {
    for (std::string& warning : warnings) {
      if (std::ranges::find(result_.warnings, warning) == result_.warnings.end()) {
        result_.warnings.push_back(std::move(warning));
      }
    }
  }

  /// Begins to keep what is asked for, from this state on.
  void start(std::span<const glm::dvec3> stored) {
    coverage_.reset();
    if (!mesh_) {
      mesh_.emplace(*volume_, space_, faces_, static_cast<int>(corners_), before_.size(), options_.threads);
    }
    start_ = mesh_->start(stored, options_.max_normal_angle, place_, options_.progress);
    if (options_.two_sided) coverage_.emplace(*mesh_, options_.progress);
  }

  FaceCount uncovered() const { return coverage_ ? coverage_->uncovered() : FaceCount{}; }
  bool is_whole() const { return start_.outside.empty() && uncovered().faces == 0; }

  /// A mesh that is not within the tolerance to begin with may be brought there as a whole, but not halfway.
  void accept_only_if_whole() {
    const std::vector<std::uint32_t> outside = start_.outside;
    std::vector<std::uint32_t> excused = mesh_->exceeding(), turned;
    excused.insert(excused.end(), outside.begin(), outside.end());  // Of these, no angle is known.
    std::ranges::sort(excused);
    const FaceCount uncovered_before = uncovered();
    start(after_);
    std::ranges::set_difference(mesh_->exceeding(), excused, std::back_inserter(turned));
    const std::size_t crossing_count = is_whole() && turned.empty() ? crossing(after_).size() : 0;
    if (is_whole() && turned.empty() && crossing_count == 0) {
      result_.vertices = after_;
      result_.normals = mesh_->normals();
      return;
    }
    if (is_whole()) {
      const std::string but = "the deformation would bring the mesh within the tolerance, but ";
      throw InvalidInput(turned.empty() ? but + std::to_string(crossing_count) +
                                              " faces would then cross others; allow it (crossings=\"allow\")"
                                        : but + std::to_string(turned.size()) +
                                              " faces would then be turned away from the reference; allow it "
                                              "(max_normal_angle=180)");
    }
    if (!outside.empty()) refuse_outside(FaceCount::of(outside));
    take_uncovered(uncovered_before, Outside::error);
  }

  /// Looks how the faces of the result face the reference. They are compared by the same sides as at the start: a start
  /// from the result might find others for parts that face the reference by about as much area with either.
  void take_normals() {
    result_.normals = mesh_->normals();
    if (!result_.normals || result_.vertices == std::vector(before_.begin(), before_.end())) return;
    const PullBack::Moving moving = try_at(result_.vertices);
    mesh_->accept_proved(moving.vertices, moving.faces, options_.progress);
    result_.normals = mesh_->normals();
  }

  void hold_t_junctions() {
    if (const auto warning = mesh_->hold_t_junctions(before_, place_)) result_.warnings.push_back(*warning);
    for (std::uint32_t v = 0; v < after_.size(); ++v) {
      if (!mesh_->frozen(v)) continue;
      result_.held_back += after_[v] != before_[v];
      after_[v] = before_[v];
    }
  }

  /// Keeps the faces that are outside to begin with as they are, and asks about them no more. Two-sided, it also keeps
  /// what is nearest to uncovered parts of the reference.
  void keep_outside() {
    const std::vector<std::uint32_t>& outside = start_.outside;
    std::vector<bool> is_kept(place_.size());
    const auto keep = [&](std::uint32_t v) { is_kept[place_[v]] = true; };
    // What is at the place of a vertex that stays has to stay as well.
    const auto keep_places = [&] {
      for (std::uint32_t v = 0; v < after_.size(); ++v) {
        if (!is_kept[place_[v]]) continue;
        result_.held_back += after_[v] != before_[v];
        after_[v] = before_[v];
      }
    };
    result_.outside = FaceCount::of(outside);
    if (!outside.empty()) kept_.assign(faces_.size() / corners_, false);
    for (const std::uint32_t face : outside) {
      kept_[face] = true;
      for (const std::uint32_t v : corners_of(face)) keep(v);
    }
    result_.uncovered = uncovered();
    if (result_.uncovered.faces) {
      result_.warnings.push_back(take_uncovered(result_.uncovered, Outside::keep));
      for (std::uint32_t v = 0; v < after_.size(); ++v) {
        if (mesh_->frozen(v)) keep(v);
      }
    }
    keep_places();
  }

  void pull_back() {
    result_.permitted_fraction = std::nullopt;
    ConstrainOptions options;
    options.outside = options_.outside, options.two_sided = options_.two_sided;
    options.crossings = options_.crossings;
    options.max_normal_angle = options_.max_normal_angle;
    options.threads = options_.threads, options.progress = options_.progress;
    ConstrainResult held = constrain(before_, after_, faces_, static_cast<int>(corners_), space_, *volume_, options);
    result_.vertices = std::move(held.vertices), result_.kept_from_crossing = held.kept_from_crossing;
    result_.normals = held.normals;
    add_warnings(held.warnings);
  }

  void search(std::vector<std::uint32_t> failing) {
    result_.vertices.assign(before_.begin(), before_.end());
    std::vector<glm::dvec3> permitted = result_.vertices;
    double inside = 0, outside = 1;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = 0.5 * (inside + outside);
      std::vector<glm::dvec3> state = at(middle);
      // Faces that failed farther out are the likeliest to fail here, and are asked first.
      std::vector<std::uint32_t> still = not_inside(state, only(failing));
      if (still.empty()) {
        still = leaving(state);
        if (still.empty()) still = turning(state);
        if (still.empty()) still = crossing(state);
      } else {
        for (std::uint32_t& i : still) i = failing[i];
      }
      if (still.empty()) {
        inside = middle;
        permitted = std::move(state);
      } else {
        outside = middle;
        failing = std::move(still);
      }
    }
    result_.permitted_fraction = inside;
    if (options_.mode == Mode::farthest) result_.vertices = std::move(permitted);
  }

  /// The stored positions at a share of the way.
  std::vector<glm::dvec3> at(double share) const {
    std::vector<glm::dvec3> state(before_.begin(), before_.end());
    for (std::size_t i = 0; i < state.size(); ++i) {
      if (after_[i] == before_[i]) continue;
      const glm::dvec3 p = before_[i] + share * (after_[i] - before_[i]);
      state[i] = space_.storage() == Storage::float32 ? rounded_to_float32(p) : p;
    }
    return state;
  }

  std::span<const std::uint32_t> corners_of(std::uint32_t face) const {
    return faces_.subspan(std::size_t{face} * corners_, corners_);
  }

  std::vector<std::uint32_t> only(const std::vector<std::uint32_t>& faces) const {
    std::vector<std::uint32_t> result;
    result.reserve(faces.size() * corners_);
    for (const std::uint32_t face : faces) {
      const std::span<const std::uint32_t> corners = corners_of(face);
      result.insert(result.end(), corners.begin(), corners.end());
    }
    return result;
  }

  /// The given faces that are not certified to be inside, ascending.
  std::vector<std::uint32_t> not_inside(std::span<const glm::dvec3> stored,
                                        std::span<const std::uint32_t> faces) const {
    const std::vector<Verdict> verdicts =
        certificate_->check({stored, space_, faces, static_cast<int>(corners_)}, {options_.threads, options_.progress});
    std::vector<std::uint32_t> result;
    for (std::uint32_t i = 0; i < verdicts.size(); ++i) {
      if (verdicts[i] != Verdict::inside) result.push_back(i);
    }
    return result;
  }

  /// All faces that are not certified to be inside, except for the kept ones; if there are none, two-sided, faces that
  /// a part of the reference would lose.
  std::vector<std::uint32_t> leaving(std::span<const glm::dvec3> stored) {
    std::vector<std::uint32_t> result = not_inside(stored, faces_);
    if (!kept_.empty()) std::erase_if(result, [&](std::uint32_t face) { return kept_[face]; });
    if (!result.empty() || !coverage_) return result;
    return coverage_->failing(try_at(stored).faces);
  }

  /// Faces that would exceed their angle, where none are leaving.
  std::vector<std::uint32_t> turning(std::span<const glm::dvec3> stored) {
    return mesh_->turned(try_at(stored).faces, options_.progress);
  }

  /// Has the mesh try these positions.
  PullBack::Moving try_at(std::span<const glm::dvec3> stored) {
    PullBack::Moving moving;
    std::vector<glm::dvec3> from, to;
    for (std::uint32_t v = 0; v < before_.size(); ++v) {
      if (after_[v] != before_[v]) moving.vertices.push_back(v), from.push_back(before_[v]), to.push_back(stored[v]);
    }
    mesh_->try_all(moving.vertices, from, to);
    moving.faces = mesh_->faces_around(moving.vertices);
    return moving;
  }

  /// Faces that would cross others anew or become degenerate.
  std::vector<std::uint32_t> crossing(std::span<const glm::dvec3> stored) {
    if (options_.crossings == PullBack::Crossings::allow || corners_ < 3) return {};
    if (!crossings_) crossings_.emplace(faces_, static_cast<int>(corners_), before_, options_.threads);
    std::vector<std::uint32_t> moving;
    for (std::uint32_t v = 0; v < before_.size(); ++v) crossings_->try_at(v, stored[v]);
    for (std::uint32_t f = 0; f < faces_.size() / corners_; ++f) {
      if (std::ranges::any_of(corners_of(f), [&](std::uint32_t v) { return after_[v] != before_[v]; })) {
        moving.push_back(f);
      }
    }
    return crossings_->failing(moving, options_.progress);
  }

  std::span<const glm::dvec3> before_;
  std::span<const std::uint32_t> faces_;
  std::size_t corners_;
  StoredSpace space_;
  const ToleranceVolume* volume_;
  const LatticeDeformation& lattice_;
  const DeformationOptions& options_;
  std::optional<Certificate> certificate_;
  std::optional<MovingMesh> mesh_;
  std::optional<MovingCoverage> coverage_;    // Empty if only the forward direction is kept.
  std::optional<MovingCrossings> crossings_;  // Made when it is first asked.
  MovingMesh::Start start_;                   // Of mesh_.
  std::vector<std::uint32_t> place_;          // For each vertex: the first one at its place before the deformation.
  std::vector<glm::dvec3> after_;
  std::vector<bool> kept_;  // For each face; empty if none is kept.
  DeformationResult result_;
};

}  // namespace

DeformationResult deform(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
                         const StoredSpace& space, const ToleranceVolume* volume, const LatticeDeformation& lattice,
                         const DeformationOptions& options) {
  const Call call(options.progress);
  return Deformation(vertices, faces, corners, space, volume, lattice, options).run();
}

}  // namespace tolvol
