// SPDX-License-Identifier: GPL-3.0-or-later
// The paper asks one global query about the deformed mesh and blocks what does not pass. So does this, by the
// certificate; and it looks for the share of the way that does pass.
#include "operation/deformation.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <sstream>

#include "check/certificate.h"
#include "reference/errors.h"
#include "reference/parallel.h"

namespace tolvol {
namespace {

/// Halvings of the way: the permitted fraction is known to a thousandth of it.
constexpr int kHalvings = 10;

constexpr std::size_t kBlock = 1024;

class Deformation {
 public:
  Deformation(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
              const Placement& placement, const ToleranceVolume* volume, const LatticeDeformation& lattice,
              const DeformationOptions& options)
      : before_(vertices),
        faces_(faces),
        corners_(static_cast<std::size_t>(corners)),
        placement_(volume ? placement.in(volume->frame()) : placement),
        volume_(volume),
        lattice_(lattice),
        options_(options) {
    if (volume) certificate_.emplace(*volume);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (std::isfinite(glm::dot(vertices[i], glm::dvec3(1)))) continue;
      throw InvalidInput("vertex " + std::to_string(i) + " is not finite");
    }
    if (corners < 1 || corners > 4 || faces.size() % corners_ != 0) {
      throw InvalidInput("a face must have 1 to 4 corners, and all faces the same number");
    }
    if (volume && faces.empty()) throw InvalidInput("there are no faces to keep within the tolerance");
    for (std::size_t i = 0; i < faces.size(); ++i) {
      if (faces[i] < vertices.size()) continue;
      throw InvalidInput("face " + std::to_string(i / corners_) + " uses vertex " + std::to_string(faces[i]) +
                         ", but there are only " + std::to_string(vertices.size()));
    }
  }

  DeformationResult run() {
    wish();
    if (volume_) {
      check_storage();
      bound();
    }
    const Placement world = placement_.in({});
    for (std::size_t i = 0; i < before_.size(); ++i) {
      if (result_.vertices[i] == before_[i]) continue;
      ++result_.moved;
      result_.largest_motion =
          std::max(result_.largest_motion, glm::length(world.world(result_.vertices[i]) - world.world(before_[i])));
    }
    return std::move(result_);
  }

 private:
  void wish() {
    if (options_.progress) options_.progress->begin("deforming");
    const Placement world = placement_.in({});
    after_.assign(before_.begin(), before_.end());
    std::atomic<std::size_t> outside{0};
    parallel_for(after_.size(), kBlock, options_.threads, [&](std::size_t begin, std::size_t end) {
      if (options_.progress) options_.progress->update(static_cast<double>(begin) / static_cast<double>(after_.size()));
      for (std::size_t i = begin; i < end; ++i) {
        const glm::dvec3 p = world.world(before_[i]);
        const std::optional<glm::dvec3> displacement = lattice_.displacement(p);
        if (!displacement) ++outside;
        // Mapping to the world and back would round even where nothing moved.
        if (!displacement || *displacement == glm::dvec3(0)) continue;
        after_[i] = world.store(p + *displacement);
        if (!std::isfinite(glm::dot(after_[i], glm::dvec3(1)))) {
          throw InvalidInput("the lattice carries vertex " + std::to_string(i) + " too far to be stored");
        }
      }
    });
    result_.outside_lattice = outside;
    result_.vertices = after_;
  }

  void check_storage() {
    const double share =
        std::max(placement_.storage_step(before_), placement_.storage_step(after_)) / volume_->frame_tolerance();
    std::ostringstream text;
    text << "at these coordinates the stored type rounds positions by up to " << 100 * share << " % of the tolerance; "
         << "move the mesh nearer to its origin or take a larger tolerance";
    if (share > 0.5) throw InvalidInput(text.str());
    if (share > 0.01) result_.warnings.push_back(text.str());
  }

  void bound() {
    result_.method = certificate_->method(), result_.renderer = certificate_->renderer();
    std::vector<std::uint32_t> failing = not_inside(after_, faces_);
    if (failing.empty()) return;
    result_.outside_faces = failing.size();
    result_.first_outside = failing.front();
    if (const std::vector<std::uint32_t> already = not_inside(before_, faces_); !already.empty()) {
      std::ostringstream text;
      text << already.size() << " faces are not within the tolerance of the reference before the deformation, the "
           << "first is face " << already.front() << "; take a larger tolerance or set the reference anew";
      throw InvalidInput(text.str());
    }
    std::vector<glm::dvec3> permitted(before_.begin(), before_.end());
    double inside = 0, outside = 1;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = 0.5 * (inside + outside);
      std::vector<glm::dvec3> state = at(middle);
      // What failed farther out is likeliest to fail here, and asked first.
      std::vector<std::uint32_t> still = not_inside(state, only(failing));
      if (!still.empty()) {
        for (std::uint32_t& i : still) i = failing[i];
      } else {
        still = not_inside(state, faces_);
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
    if (options_.mode == DeformationOptions::Mode::farthest) {
      result_.vertices = std::move(permitted);
    } else {
      result_.vertices.assign(before_.begin(), before_.end());
    }
  }

  /// The stored state at a share of the way.
  std::vector<glm::dvec3> at(double share) const {
    std::vector<glm::dvec3> state(before_.begin(), before_.end());
    for (std::size_t i = 0; i < state.size(); ++i) {
      if (after_[i] == before_[i]) continue;
      const glm::dvec3 p = before_[i] + share * (after_[i] - before_[i]);
      state[i] = placement_.storage() == Storage::float32 ? rounded_to_float32(p) : p;
    }
    return state;
  }

  std::vector<std::uint32_t> only(const std::vector<std::uint32_t>& faces) const {
    std::vector<std::uint32_t> result;
    result.reserve(faces.size() * corners_);
    for (const std::uint32_t i : faces) {
      const auto corner = faces_.begin() + static_cast<std::ptrdiff_t>(i * corners_);
      result.insert(result.end(), corner, corner + static_cast<std::ptrdiff_t>(corners_));
    }
    return result;
  }

  /// Which of the faces are not certified to be inside, in order.
  std::vector<std::uint32_t> not_inside(std::span<const glm::dvec3> stored,
                                        std::span<const std::uint32_t> faces) const {
    std::vector<glm::dvec3> points(stored.size());
    parallel_for(points.size(), kBlock, options_.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) points[i] = placement_.frame(stored[i]);
    });
    const std::vector<Verdict> verdicts =
        certificate_->check({points, faces, static_cast<int>(corners_), placement_.mapping_error(stored)},
                            {options_.threads, options_.progress});
    std::vector<std::uint32_t> result;
    for (std::uint32_t i = 0; i < verdicts.size(); ++i) {
      if (verdicts[i] != Verdict::inside) result.push_back(i);
    }
    return result;
  }

  std::span<const glm::dvec3> before_;
  std::span<const std::uint32_t> faces_;
  std::size_t corners_;
  Placement placement_;
  const ToleranceVolume* volume_;
  const LatticeDeformation& lattice_;
  const DeformationOptions& options_;
  std::optional<Certificate> certificate_;
  std::vector<glm::dvec3> after_;
  DeformationResult result_;
};

}  // namespace

DeformationResult deform(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
                         const Placement& placement, const ToleranceVolume* volume, const LatticeDeformation& lattice,
                         const DeformationOptions& options) {
  return Deformation(vertices, faces, corners, placement, volume, lattice, options).run();
}

}  // namespace tolvol
