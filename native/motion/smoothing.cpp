// SPDX-License-Identifier: GPL-3.0-or-later
// The steps are explicit steps of the normalised operators of Desbrun et al. 1999, except for this: cotangents are
// clamped, as a needle's would drown all others (their cure, implicit integration, does not know a tolerance); the sum
// for an edge is never negative, as a mean needs; where the boundary is smoothed along itself, the weights of its two
// edges are the inverse lengths; umbrella vectors of boundary vertices count as zero for their inner neighbours.
//
// Steps are computed in stored coordinates, with weights that are measured in the world: an affine map takes means to
// means. So a vertex that does not move keeps its bits, and the result does not depend on any frame.
#include "motion/smoothing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/certificate.h"
#include "check/input_checks.h"
#include "geometry/weld.h"
#include "motion/finite.h"
#include "motion/selection.h"
#include "topology/t_junctions.h"

namespace tolvol {
namespace {

constexpr double kLaplacianStep = 0.5, kBilaplacianStep = 0.25;
/// A vertex that was pulled back goes at most so many times as far in the next iteration. One that cannot move any more
/// would otherwise be pulled back from afar in every iteration.
constexpr double kGrowth = 2;
/// It may always go by this share of the tolerance.
constexpr double kLeastReach = 1.0 / 16;
/// The cotangent of 3 degrees.
constexpr double kLargestCotangent = 19.1;

class Smoothing {
 public:
  Smoothing(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
            const ToleranceVolume* volume, const SmoothingOptions& options)
      : input_(vertices),
        space_(space),
        volume_(volume),
        options_(options),
        positions_(vertices.begin(), vertices.end()) {
    validate(vertices, triangles);
    require_options();
    same_as_ = weld_equal_positions(vertices);
    triangles_.reserve(triangles.size());
    for (const glm::uvec3& t : triangles) triangles_.emplace_back(same_as_[t.x], same_as_[t.y], same_as_[t.z]);
    for (std::uint32_t v = 0; v < same_as_.size(); ++v) result_.welded += same_as_[v] != v;
  }

  SmoothingResult run() {
    link();
    fix_t_junctions();
    set_strength();
    if (volume_) start_pull_back();
    std::vector<std::uint32_t> moving;
    for (std::uint32_t v = 0; v < positions_.size(); ++v) {
      if (strength_[v] > 0) moving.push_back(v);
    }
    if (pull_back_) {
      moving_ = pull_back_->moving(std::move(moving));
    } else {
      moving_.vertices = std::move(moving);
    }
    if (pull_back_ && !options_.reset) {
      reach_.assign(moving_.vertices.size(), std::numeric_limits<double>::infinity());
      is_shortened_.assign(moving_.vertices.size(), 0);
    }
    if (options_.progress) options_.progress->begin("smoothing");
    for (unsigned i = 0; i < options_.iterations; ++i) {
      if (options_.progress) options_.progress->update(static_cast<double>(i) / options_.iterations);
      iterate();
    }
    if (pull_back_) result_.normals = pull_back_->normals();
    write();
    return std::move(result_);
  }

 private:
  enum class Kind : std::uint8_t { inner, curve, fixed };
  /// A neighbour, and the corners opposite to the edge to it, as 3 * triangle + corner; on the boundary the same twice.
  struct Link {
    std::uint32_t vertex;
    std::uint32_t opposite[2];
  };

  void require_options() const {
    require_normal_angle(options_.max_normal_angle);
    if (!options_.locked.empty() && options_.locked.size() != input_.size()) {
      throw InvalidInput("locked must have one value for each vertex");
    }
    if (!options_.strength.empty() && options_.strength.size() != input_.size()) {
      throw InvalidInput("strength must have one value for each vertex");
    }
    for (std::size_t v = 0; v < options_.strength.size(); ++v) {
      if (options_.strength[v] >= 0 && options_.strength[v] <= 1) continue;
      throw InvalidInput("the strength of vertex " + std::to_string(v) + " is " + std::to_string(options_.strength[v]) +
                         "; it must be from 0 to 1");
    }
  }

  /// Finds each vertex's neighbours and what kind of vertex it is; sides of an edge meet when sorted by its far end.
  void link() {
    struct Side {
      std::uint32_t from, to, opposite;
    };
    const std::size_t count = positions_.size();
    std::vector<std::uint32_t> start(count + 1, 0);
    const auto each_side = [&](auto&& use) {
      for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
        poll_at(t);
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint32_t a = triangles_[t][(k + 1) % 3], b = triangles_[t][(k + 2) % 3];
          if (a != b) use(Side{a, b, 3 * t + k}), use(Side{b, a, 3 * t + k});
        }
      }
    };
    each_side([&](const Side& s) { ++start[s.from + 1]; });
    for (std::size_t v = 0; v < count; ++v) start[v + 1] += start[v];
    std::vector<Side> sides(start.back());
    std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
    each_side([&](const Side& s) { sides[next[s.from]++] = s; });

    const bool along = options_.boundary == SmoothingOptions::Boundary::along;
    kind_.assign(count, Kind::inner);
    link_start_.assign(1, 0);
    std::vector<Link> around, rim;
    for (std::uint32_t v = 0; v < count; ++v) {
      poll_at(v);
      const auto first = sides.begin() + start[v], last = sides.begin() + start[v + 1];
      std::sort(first, last,
                [](const Side& a, const Side& b) { return a.to != b.to ? a.to < b.to : a.opposite < b.opposite; });
      around.clear(), rim.clear();
      bool branches = false;
      for (auto side = first; side != last;) {
        const auto end = std::find_if(side, last, [&](const Side& s) { return s.to != side->to; });
        around.push_back({side->to, {side->opposite, end[-1].opposite}});
        if (end - side == 1) rim.push_back(around.back());
        if (end - side == 1 && v < side->to) open_.emplace_back(v, side->to);
        branches = branches || end - side > 2;
        side = end;
      }
      if (branches || (!rim.empty() && !(along && rim.size() == 2))) {
        kind_[v] = Kind::fixed;
        ++(branches ? result_.fixed_non_manifold : result_.fixed_boundary);
      } else if (!rim.empty()) {
        kind_[v] = Kind::curve;
      } else if (around.empty()) {
        kind_[v] = Kind::fixed;
      }
      const std::vector<Link>& kept = kind_[v] == Kind::curve ? rim : around;
      if (kind_[v] != Kind::fixed) links_.insert(links_.end(), kept.begin(), kept.end());
      link_start_.push_back(static_cast<std::uint32_t>(links_.size()));
    }
  }

  /// Faces that meet in a T-junction share no edge along which they could be kept together while it moves.
  void fix_t_junctions() {
    if (open_.empty()) return;
    Team team(thread_count(options_.threads));
    for (const std::uint32_t v : t_junctions({positions_, triangles_}, open_, space_.unit_roundoff(), team)) {
      if (kind_[v] == Kind::fixed) continue;
      kind_[v] = Kind::fixed;
      ++result_.fixed_t_junctions;
    }
  }

  void set_strength() {
    strength_.assign(positions_.size(), 1);
    for (std::uint32_t v = 0; v < positions_.size(); ++v) {
      double& strength = strength_[same_as_[v]];
      if (!options_.strength.empty()) strength = std::min(strength, options_.strength[v]);
      if (!options_.locked.empty() && options_.locked[v]) strength = 0;
      if (kind_[v] == Kind::fixed) strength_[v] = 0;  // All that are the same as another one are among them.
    }
  }

  void start_pull_back() {
    for (const glm::uvec3& t : triangles_) faces_.insert(faces_.end(), {t.x, t.y, t.z});
    pull_back_ = std::make_unique<PullBack>(*volume_, space_, faces_, 3, positions_.size(), options_.threads);
    PullBack::Start start = pull_back_->start(
        positions_, {options_.outside, options_.two_sided, options_.crossings, options_.max_normal_angle, true, false},
        options_.progress);
    result_.outside = FaceCount::of(start.outside);
    result_.uncovered = start.uncovered;
    result_.warnings = std::move(start.warnings);
    for (std::uint32_t v = 0; v < strength_.size(); ++v) {
      if (pull_back_->frozen(v)) strength_[v] = 0;
    }
    const Certificate certificate(*volume_);
    result_.method = certificate.method(), result_.renderer = certificate.renderer();
  }

  template <class Body>
  void each(std::size_t count, Body&& body) {
    parallel_for(count, kManyAtOnce, options_.threads, [&](std::size_t begin, std::size_t end) {
      if (options_.progress) options_.progress->poll();
      for (std::size_t i = begin; i < end; ++i) body(static_cast<std::uint32_t>(i));
    });
  }

  glm::dvec3 in_world(const glm::dvec3& direction) const { return glm::dmat3(space_.to_world()) * direction; }

  void measure_cotangents() {
    cotangents_.resize(3 * triangles_.size());
    const glm::dmat3 linear(space_.to_world());
    each(triangles_.size(), [&](std::uint32_t t) {
      const glm::dvec3 &a = positions_[triangles_[t].x], &b = positions_[triangles_[t].y],
                       &c = positions_[triangles_[t].z];
      const glm::dvec3 ab = linear * (b - a), ac = linear * (c - a), bc = ac - ab;
      const double twice_area = glm::length(glm::cross(ab, ac));
      const auto cotangent = [&](double dot) {
        if (std::abs(dot) < kLargestCotangent * twice_area) return dot / twice_area;
        return dot > 0 ? kLargestCotangent : dot < 0 ? -kLargestCotangent : 0.0;
      };
      double* out = &cotangents_[std::size_t{3} * t];
      out[0] = cotangent(glm::dot(ab, ac)), out[1] = cotangent(-glm::dot(ab, bc)), out[2] = cotangent(glm::dot(ac, bc));
    });
  }

  double weight(std::uint32_t vertex, const Link& link) const {
    if (options_.weights == SmoothingOptions::Weights::uniform) return 1;
    if (kind_[vertex] == Kind::curve) {
      const double length = glm::length(in_world(positions_[link.vertex] - positions_[vertex]));
      return length > 0 ? 1 / length : 0;
    }
    return std::max(0.0, cotangents_[link.opposite[0]] + cotangents_[link.opposite[1]]);
  }

  /// The weighted mean of value(neighbour) less `own`.
  template <class Value>
  glm::dvec3 umbrella(std::uint32_t vertex, const glm::dvec3& own, Value&& value) const {
    glm::dvec3 sum(0);
    double total = 0;
    for (std::uint32_t i = link_start_[vertex]; i < link_start_[vertex + 1]; ++i) {
      const double w = weight(vertex, links_[i]);
      sum += w * (value(links_[i].vertex) - own);
      total += w;
    }
    return total > 0 ? sum / total : glm::dvec3(0);
  }

  void iterate() {
    const std::vector<std::uint32_t>& moving = moving_.vertices;
    if (options_.weights == SmoothingOptions::Weights::cotangent) measure_cotangents();
    const bool bilaplacian = options_.kind == SmoothingOptions::Operator::bilaplacian;
    if (bilaplacian) {
      umbrellas_.resize(positions_.size());
      each(positions_.size(), [&](std::uint32_t v) {
        umbrellas_[v] = umbrella(v, positions_[v], [&](std::uint32_t other) { return positions_[other]; });
      });
    }
    before_.resize(moving.size()), after_.resize(moving.size());
    each(moving.size(), [&](std::uint32_t i) {
      const std::uint32_t v = moving[i];
      glm::dvec3 step;
      if (bilaplacian) {
        step = -kBilaplacianStep * umbrella(v, umbrellas_[v], [&](std::uint32_t other) {
          return kind_[other] == kind_[v] ? umbrellas_[other] : glm::dvec3(0);
        });
      } else {
        step = kLaplacianStep * umbrella(v, positions_[v], [&](std::uint32_t other) { return positions_[other]; });
      }
      if (!reach_.empty()) {
        const double length = strength_[v] * glm::length(in_world(step));
        is_shortened_[i] = length > reach_[i];
        if (is_shortened_[i]) step *= reach_[i] / length;
      }
      const glm::dvec3 to = positions_[v] + strength_[v] * step;
      before_[i] = positions_[v];
      after_[i] = space_.storage() == Storage::float32 ? rounded_to_float32(to) : to;
    });
    std::size_t held_back = 0, kept_from_crossing = 0;
    if (pull_back_) {
      PullBack::Result ends = pull_back_->move(
          moving_, before_, after_, options_.reset ? PullBack::Mode::reset : PullBack::Mode::halve, options_.progress);
      after_.swap(ends.reached);
      held_back = ends.held_back, kept_from_crossing = ends.kept_from_crossing;
      if (!reach_.empty()) {
        set_reach(ends.factors);
        // A vertex that went all of a shortened step did not go all the way.
        for (std::size_t i = 0; i < moving.size(); ++i) held_back += is_shortened_[i] && ends.factors[i] >= 1;
      }
    }
    result_.held_back.push_back(held_back), result_.kept_from_crossing.push_back(kept_from_crossing);
    each(moving.size(), [&](std::uint32_t i) { positions_[moving[i]] = after_[i]; });
  }

  /// Sets how far the vertices may go in the next iteration, once it is known which share of their ways they went.
  void set_reach(const std::vector<double>& factors) {
    each(factors.size(), [&](std::uint32_t i) {
      if (factors[i] < 1) {
        const double went = glm::length(in_world(after_[i] - before_[i]));
        reach_[i] = std::max(kGrowth * went, kLeastReach * volume_->tolerance());
      } else {
        reach_[i] *= kGrowth;
      }
    });
  }

  void write() {
    result_.vertices.assign(input_.begin(), input_.end());
    for (std::size_t v = 0; v < input_.size(); ++v) {
      const glm::dvec3& end = positions_[same_as_[v]];
      if (end == input_[v]) continue;
      if (!finite(end)) {
        throw InvalidInput("the coordinates around vertex " + std::to_string(v) + " are too large for double precision",
                           "too_far");
      }
      result_.vertices[v] = end;
      result_.largest_motion = std::max(result_.largest_motion, glm::length(in_world(end - input_[v])));
    }
  }

  std::span<const glm::dvec3> input_;
  const StoredSpace& space_;
  const ToleranceVolume* volume_;
  const SmoothingOptions& options_;
  SmoothingResult result_;
  std::vector<glm::dvec3> positions_;      // Stored; among vertices that are the same, the first is kept up to date.
  std::vector<std::uint32_t> same_as_;     // For each vertex: the first one at its place.
  std::vector<glm::uvec3> triangles_;      // Their corners are such first ones.
  std::vector<std::uint32_t> link_start_;  // For each vertex: its place in links_.
  std::vector<Link> links_;
  std::vector<glm::uvec2> open_;  // The edges of one triangle.
  std::vector<Kind> kind_;
  std::vector<double> strength_;
  std::vector<std::uint32_t> faces_;
  std::unique_ptr<PullBack> pull_back_;  // Null without a volume.
  PullBack::Moving moving_;
  /// For each moving vertex: how far it may go in the next iteration, in world units. Empty without a volume, and with
  /// `reset`.
  std::vector<double> reach_;
  std::vector<std::uint8_t> is_shortened_;  // For each moving vertex: whether its reach shortened its step.
  std::vector<double> cotangents_;          // For each corner.
  std::vector<glm::dvec3> umbrellas_, before_, after_;
};

}  // namespace

SmoothingResult smooth(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                       const StoredSpace& space, const ToleranceVolume* volume, const SmoothingOptions& options) {
  const Call call(options.progress);
  return Smoothing(vertices, triangles, space, volume, options).run();
}

}  // namespace tolvol
