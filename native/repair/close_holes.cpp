// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/close_holes.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <set>
#include <unordered_set>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/certificate.h"
#include "check/facing.h"
#include "check/input_checks.h"
#include "geometry/frame.h"
#include "repair/least_triangulation.h"
#include "topology/boundary_loops.h"
#include "topology/face_tree.h"
#include "topology/faces_cross.h"
#include "topology/sides.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = HoleClosingResult::kNone;
/// A loop is searched for a filling at most so many times, a long one less often. After each search but the last, faces
/// that are in the way are gone around, and one of two triangles that cross, or that lie on one edge, is left out.
constexpr int kMostTries = 32, kMostTriesOfLong = 8;
/// A loop with more corners than this is long.
constexpr std::size_t kLong = 200;
/// A loop is given up after so many of its triangles were refused, in all searches together.
constexpr std::size_t kMostRefused = 50000;
/// Where the triangles of a loop cross more faces than so many, each further triangle is compared with all faces near
/// it instead of with these.
constexpr std::size_t kMostObstacles = 64;
/// An edge across a hole is probed in so many points before any triangle at it is proved.
constexpr int kProbes = 7;

constexpr std::array kNames = {"closed", "not_a_loop", "too_long",     "perimeter", "outside",
                               "turned", "crossing",   "non_manifold", "degenerate"};

using Faces = std::vector<glm::uvec3>;

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

/// A boundary loop, and the triangles that fill it.
struct Filled {
  std::vector<Side> sides;                              ///< of the rim
  std::vector<std::uint32_t> corner;                    ///< the vertex at which each side begins
  std::vector<glm::dvec3> at;                           ///< its position in the frame
  std::vector<TriangleCertificate::PointBound> bounds;  ///< of the positions
  bool reversed = false;                                ///< tells whether the rim looks against the reference
  Faces faces;  ///< corners i < k < j of the loop, the front of which is (j, k, i)
};

class Closing {
 public:
  Closing(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
          const ToleranceVolume& volume, const CloseHolesOptions& options, Team& team)
      : mesh_{triangles, vertices},
        space_(space.in(volume.frame())),
        volume_(volume),
        options_(options),
        team_(team),
        place_(weld_equal_positions(vertices)) {
    if (options_.progress) options_.progress->begin("finding holes");
    std::vector<glm::dvec3> positions = space_.frame(vertices);
    for (BoundaryLoop& loop : boundary_loops(positions, place_, triangles, team_)) take(std::move(loop), positions);
    positions_ = std::move(positions);
  }

  HoleClosingResult run() {
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < loops_.size(); ++i) {
      if (result_.loops[i].outcome == LoopOutcome::closed) open.push_back(i);
    }
    if (!open.empty()) {
      set_rules();
      if (options_.progress) options_.progress->begin("closing holes");
      std::atomic<std::size_t> done = 0;
      team_.run(open.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          fill(open[i]);
          if (options_.progress)
            options_.progress->update(static_cast<double>(++done) / static_cast<double>(open.size()));
        }
      });
      keep_apart(open);
    }
    write();
    return std::move(result_);
  }

 private:
  class Filling;

  void take(BoundaryLoop&& found, std::span<const glm::dvec3> positions) {
    HoleClosingResult::Loop loop;
    Filled filled;
    filled.sides = std::move(found.sides);
    glm::dvec3 sum(0);
    double length = 0;
    for (std::size_t i = 0; i < filled.sides.size(); ++i) {
      const std::uint32_t from = vertex_of(filled.sides[i]), to = vertex_of(next_corner(filled.sides[i]));
      filled.corner.push_back(from);
      filled.at.push_back(positions[from]);
      sum += positions[from];
      length += glm::length(positions[to] - positions[from]);
    }
    loop.vertex = filled.corner.front();
    loop.corners = filled.sides.size();
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
    loops_.push_back(std::move(filled));
  }

  std::uint32_t vertex_of(Side corner) const { return mesh_.triangles[corner / 3][static_cast<int>(corner % 3)]; }

  /// Makes what is asked about every face.
  void set_rules() {
    std::vector<glm::dvec3> used;
    const std::vector<bool> is_used = used_vertices(mesh_.vertices.size(), mesh_.triangles);
    for (std::size_t v = 0; v < is_used.size(); ++v) {
      if (is_used[v]) used.push_back(mesh_.vertices[v]);
    }
    const double mapping_error = space_.mapping_error(used);
    certificate_.emplace(volume_.witnesses(), volume_.grid(), volume_.hierarchy(),
                         volume_.provable(mapping_error) * (1 - kHeadroom), volume_.refutable(mapping_error));
    facing_ = facing_rule(volume_, mapping_error, options_.max_normal_angle, result_.warnings);
    std::vector<Box> boxes(mesh_.triangles.size());
    for (std::uint32_t t = 0; t < boxes.size(); ++t) {
      poll_at(t);
      boxes[t] = box_of(mesh_.corners(t));
    }
    std::vector<std::uint32_t> faces(boxes.size());
    std::iota(faces.begin(), faces.end(), 0u);
    tree_ = FaceTree(faces, boxes, team_);

    // Only edges between two places at rims can be those of new faces.
    std::vector<bool> at_rim(mesh_.vertices.size(), false);
    for (const Filled& loop : loops_) {
      for (const std::uint32_t v : loop.corner) at_rim[place_[v]] = true;
    }
    for (std::uint32_t side = 0; side < 3 * mesh_.triangles.size(); ++side) {
      poll_at(side);
      const std::uint32_t a = place_[vertex_of(side)], b = place_[vertex_of(next_corner(side))];
      if (at_rim[a] && at_rim[b]) edges_.insert(pair_key(a, b));
    }
  }

  void fill(std::uint32_t loop);
  void keep_apart(std::span<const std::uint32_t> open);
  bool looks_against(const Filled& loop) const;
  double share_at(std::uint32_t vertex) const { return options_.shares.empty() ? 1 : options_.shares[vertex]; }
  Corners corners_of(const Filled& loop, const glm::uvec3& face) const {
    return {mesh_.vertices[loop.corner[face.z]], mesh_.vertices[loop.corner[face.y]],
            mesh_.vertices[loop.corner[face.x]]};
  }
  std::uint64_t edge_of(const Filled& loop, std::uint32_t i, std::uint32_t j) const {
    return pair_key(place_[loop.corner[i]], place_[loop.corner[j]]);
  }
  /// Calls visit(i, j) for the edges of the filling that are none of the rim, once each.
  template <class Visit>
  static void for_inner_edges(const Filled& loop, Visit&& visit) {
    const auto last = static_cast<std::uint32_t>(loop.corner.size() - 1);
    for (const glm::uvec3& f : loop.faces) {
      if (f.x != 0 || f.z != last) visit(f.x, f.z);  // each inner edge is (x, z) of the one face that it spans
    }
  }
  void write();

  MeshView mesh_;
  StoredSpace space_;
  const ToleranceVolume& volume_;
  const CloseHolesOptions& options_;
  Team& team_;
  std::vector<std::uint32_t> place_;   ///< for each vertex: the first at its position
  std::vector<glm::dvec3> positions_;  ///< of the vertices, in the frame
  std::vector<Filled> loops_;
  std::optional<TriangleCertificate> certificate_;
  std::optional<FacingRule> facing_;
  FaceTree tree_;                            ///< of the input's faces
  std::unordered_set<std::uint64_t> edges_;  ///< between places at rims
  /// What was filled before: the faces of all loops, those of a loop together, and the loops among them that stay.
  std::vector<Corners> new_faces_;
  std::vector<std::uint32_t> loop_of_;
  FaceTree new_tree_;
  std::unordered_set<std::uint64_t> new_edges_;  ///< inner edges of the loops that stay
  HoleClosingResult result_;
};

/// Fills one loop, and counts what refused its faces.
class Closing::Filling {
 public:
  /// If `before` is given, the loop has to keep apart from the fillings of lower loops.
  Filling(const Closing& closing, Filled& loop, std::optional<std::uint32_t> before)
      : closing_(closing), loop_(loop), before_(before) {}

  LoopOutcome run() {
    TriangulationRules rules{[this](std::uint32_t i, std::uint32_t j) { return admits_edge(i, j); },
                             [this](const glm::uvec3& face) { return admits(face); }};
    const int most = loop_.at.size() > kLong ? kMostTriesOfLong : kMostTries;
    for (int tries = 0; tries < most; ++tries) {
      loop_.faces = least_triangulation(loop_.at, rules);
      if (loop_.faces.empty() || gives_up()) break;
      std::sort(loop_.faces.begin(), loop_.faces.end(), [](const glm::uvec3& a, const glm::uvec3& b) {
        return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z};
      });
      if (is_clear() && is_sound()) return LoopOutcome::closed;
    }
    loop_.faces.clear();
    return reason();
  }

 private:
  LoopOutcome reason() const {
    // Across a corner of one triangle there is an edge already, and a rim that has points on a straight line makes
    // triangles without an area, whatever else there is.
    const auto first = refused_.begin(), others = first + static_cast<int>(LoopOutcome::non_manifold);
    const auto most = std::max_element(first, others);
    return static_cast<LoopOutcome>((*most > 0 ? most : std::max_element(others, refused_.end())) - first);
  }

  bool refuse(LoopOutcome reason) {
    ++refused_[static_cast<std::size_t>(reason)];
    return false;
  }

  bool gives_up() const { return refused_triangles_ >= kMostRefused; }

  bool admits_edge(std::uint32_t i, std::uint32_t j) {
    if (gives_up()) return false;
    const std::uint64_t edge = closing_.edge_of(loop_, i, j);
    if (closing_.place_[loop_.corner[i]] == closing_.place_[loop_.corner[j]]) return refuse(LoopOutcome::degenerate);
    if (closing_.edges_.contains(edge) || left_out_edges_.contains({i, j}) ||
        (before_ && closing_.new_edges_.contains(edge))) {
      return refuse(LoopOutcome::non_manifold);
    }
    // A point that is outside refuses all triangles at the edge.
    const TriangleCertificate& certificate = *closing_.certificate_;
    const double limit = std::min(share_at(i), share_at(j)) * certificate.limit();
    for (int k = 1; k <= kProbes; ++k) {
      const double along = static_cast<double>(k) / (kProbes + 1);
      const glm::dvec3 p = (1 - along) * loop_.at[i] + along * loop_.at[j];
      if (!(certificate.distance_bound(p) <= limit) &&
          closing_.volume_.hierarchy().nearest(p, limit).triangle == Hierarchy::kNone) {
        return refuse(LoopOutcome::outside);
      }
    }
    return true;
  }

  bool admits(const glm::uvec3& face) {
    if (gives_up()) return false;
    const bool is_admitted = proves(face);
    refused_triangles_ += !is_admitted;
    return is_admitted;
  }

  bool proves(const glm::uvec3& face) {
    if (left_out_.contains({face.x, face.y, face.z})) return refuse(LoopOutcome::crossing);
    const Corners stored = closing_.corners_of(loop_, face);
    if (is_degenerate(stored)) return refuse(LoopOutcome::degenerate);
    const glm::dvec3 placed[3] = {loop_.at[face.z], loop_.at[face.y], loop_.at[face.x]};
    std::optional<Facing> facing;
    if (closing_.facing_) {
      const std::optional<glm::dvec3> normal =
          sure_normal(placed[0], placed[1], placed[2], closing_.facing_->mesh_error);
      if (!normal) return refuse(LoopOutcome::turned);
      facing.emplace(*closing_.facing_, loop_.reversed ? -*normal : *normal, closing_.facing_->angle);
    }
    const double share = std::min({share_at(face.x), share_at(face.y), share_at(face.z)});
    if (!(share > 0)) return refuse(LoopOutcome::outside);
    const TriangleCertificate certificate = closing_.certificate_->narrowed(share);
    if (certificate.shows_outside(placed)) return refuse(LoopOutcome::outside);
    const TriangleCertificate::PointBound &a = loop_.bounds[face.z], &b = loop_.bounds[face.y],
                                          &c = loop_.bounds[face.x];
    const glm::dvec3 bounds(a.distance, b.distance, c.distance);
    const glm::uvec3 no_hints(Hierarchy::kNone);
    if (facing) facing->set_corners({a.triangle, b.triangle, c.triangle});
    if (certificate.bound_in_any_order(placed, bounds, no_hints, facing ? &*facing : nullptr) ==
        TriangleCertificate::kUnproved) {
      // Without the rule a proof may exist: then it is the rule that refuses.
      const bool is_inside = facing && certificate.bound_in_any_order(placed, bounds) != TriangleCertificate::kUnproved;
      return refuse(is_inside ? LoopOutcome::turned : LoopOutcome::outside);
    }
    return goes_around(stored) || refuse(LoopOutcome::crossing);
  }

  /// Calls visit(corners) for the faces of the input, and of the fillings that the loop has to keep apart from, whose
  /// boxes meet that of a triangle. A visit that returns false is the last one.
  template <class Visit>
  void for_each_near(const Corners& stored, Visit&& visit) const {
    const Box box = box_of(stored);
    bool more = true;
    std::size_t met = 0;
    closing_.tree_.for_each_meeting(box, [&](std::uint32_t face) {
      if (++met % 64 == 0) poll();
      return more = visit(closing_.mesh_.corners(face));
    });
    if (!before_ || !more) return;
    closing_.new_tree_.for_each_meeting(box, [&](std::uint32_t face) {
      return closing_.loop_of_[face] >= *before_ || visit(closing_.new_faces_[face]);
    });
  }

  /// Whether a triangle crosses nothing that an earlier try crossed.
  bool goes_around(const Corners& stored) const {
    if (obstacles_.size() <= kMostObstacles) {
      const Box box = box_of(stored);
      return std::ranges::none_of(obstacles_, [&](const Obstacle& obstacle) {
        return meet(box, obstacle.box) && faces_cross(stored, obstacle.corners);
      });
    }
    bool clear = true;
    for_each_near(stored, [&](const Corners& other) { return clear = !faces_cross(stored, other); });
    return clear;
  }

  /// Whether the triangles cross no face of the input, and none of the fillings that the loop has to keep apart from.
  /// All triangles of the next try go around what they cross. Hardly a hole has anything in it, so that it would take
  /// most of the time to ask about all triangles whether they cross any face.
  bool is_clear() {
    bool clear = true;
    for (const glm::uvec3& face : loop_.faces) {
      poll();
      const Corners stored = closing_.corners_of(loop_, face);
      for_each_near(stored, [&](const Corners& other) {
        if (!faces_cross(stored, other)) return true;
        clear = refuse(LoopOutcome::crossing);
        obstacles_.push_back({other, box_of(other)});
        return obstacles_.size() <= kMostObstacles;
      });
    }
    return clear;
  }

  /// Whether the triangles fit together. If not, one of those that do not is left out of the next try.
  bool is_sound() {
    bool sound = true;
    std::unordered_set<std::uint64_t> edges;
    for_inner_edges(loop_, [&](std::uint32_t i, std::uint32_t j) {
      if (!sound || edges.insert(closing_.edge_of(loop_, i, j)).second) return;
      sound = false;
      left_out_edges_.insert({i, j});
    });
    std::vector<Corners> corners;
    std::vector<Box> boxes;
    for (const glm::uvec3& face : loop_.faces) {
      corners.push_back(closing_.corners_of(loop_, face));
      boxes.push_back(box_of(corners.back()));
    }
    for (std::size_t a = 0; a < corners.size() && sound; ++a) {
      poll();
      for (std::size_t b = 0; b < a && sound; ++b) {
        if (!meet(boxes[a], boxes[b]) || !faces_cross(corners[a], corners[b])) continue;
        sound = false;
        left_out_.insert({loop_.faces[a].x, loop_.faces[a].y, loop_.faces[a].z});
      }
    }
    if (!sound) refuse(left_out_.empty() ? LoopOutcome::non_manifold : LoopOutcome::crossing);
    return sound;
  }

  double share_at(std::uint32_t corner) const { return closing_.share_at(loop_.corner[corner]); }

  const Closing& closing_;
  Filled& loop_;
  std::optional<std::uint32_t> before_;
  struct Obstacle {
    Corners corners;
    Box box;
  };
  std::size_t refused_triangles_ = 0;
  std::vector<Obstacle> obstacles_;  ///< faces that an earlier try crossed
  std::set<std::array<std::uint32_t, 3>> left_out_;
  std::set<std::array<std::uint32_t, 2>> left_out_edges_;
  std::array<std::size_t, kNames.size()> refused_{};  ///< for each outcome
};

/// Whether over more of the rim all triangles of the reference look against the rim than all look as it does.
bool Closing::looks_against(const Filled& loop) const {
  double sum = 0;
  for (const Side side : loop.sides) {
    poll();
    const glm::uvec3& t = mesh_.triangles[side / 3];
    const glm::dvec3 &a = positions_[t.x], &b = positions_[t.y], &c = positions_[t.z];
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const auto is_there = [&](double sign) {
      const glm::dvec3 centre = (a + b + c) * (1.0 / 3);
      return facing_->nearest(volume_.hierarchy(), centre, sign * normal, kSameSide, certificate_->limit()).triangle !=
             Hierarchy::kNone;
    };
    const bool along = is_there(1), against = is_there(-1);
    if (along != against) sum += (along ? 1 : -1) * glm::length(normal);
  }
  return sum < 0;
}

void Closing::fill(std::uint32_t loop) {
  for (const glm::dvec3& p : loops_[loop].at) loops_[loop].bounds.push_back(certificate_->point_bound(p));
  if (facing_) loops_[loop].reversed = looks_against(loops_[loop]);
  result_.loops[loop].outcome = Filling(*this, loops_[loop], std::nullopt).run();
}

/// Fills those loops anew whose triangles cross those of a lower loop or lie on one edge with them.
void Closing::keep_apart(std::span<const std::uint32_t> open) {
  std::vector<std::uint32_t> first(loops_.size(), kNone), numbers;
  std::vector<Box> boxes;
  for (const std::uint32_t i : open) {
    first[i] = static_cast<std::uint32_t>(new_faces_.size());
    for (const glm::uvec3& face : loops_[i].faces) {
      new_faces_.push_back(corners_of(loops_[i], face));
      loop_of_.push_back(i);
      boxes.push_back(box_of(new_faces_.back()));
      numbers.push_back(static_cast<std::uint32_t>(numbers.size()));
    }
  }
  new_tree_ = FaceTree(numbers, boxes, team_);
  for (const std::uint32_t i : open) {
    Filled& loop = loops_[i];
    const auto count = static_cast<std::uint32_t>(loop.faces.size());
    bool apart = true;
    for_inner_edges(loop,
                    [&](std::uint32_t a, std::uint32_t b) { apart &= !new_edges_.contains(edge_of(loop, a, b)); });
    for (std::uint32_t f = first[i]; f < first[i] + count && apart; ++f) {
      poll();
      new_tree_.for_each_meeting(boxes[f], [&](std::uint32_t other) {
        return apart = loop_of_[other] >= i || !faces_cross(new_faces_[f], new_faces_[other]);
      });
    }
    if (!apart) {
      result_.loops[i].outcome = Filling(*this, loop, i).run();
      for (std::uint32_t k = 0; k < count; ++k) {
        // A filling has as many triangles as the one before, or none.
        if (!loop.faces.empty()) new_faces_[first[i] + k] = corners_of(loop, loop.faces[k]);
        new_tree_.change(first[i] + k, loop.faces.empty() ? Box() : box_of(new_faces_[first[i] + k]));
      }
    }
    for_inner_edges(loop, [&](std::uint32_t a, std::uint32_t b) { new_edges_.insert(edge_of(loop, a, b)); });
  }
}

void Closing::write() {
  result_.triangles.assign(mesh_.triangles.begin(), mesh_.triangles.end());
  for (std::uint32_t i = 0; i < loops_.size(); ++i) {
    const Filled& loop = loops_[i];
    const auto count = static_cast<std::uint32_t>(loop.corner.size());
    for (const glm::uvec3& f : loop.faces) {
      poll_at(result_.loop.size());
      const glm::uvec3 corners(f.z, f.y, f.x);
      glm::uvec3 triangle, borders, source;
      for (int k = 0; k < 3; ++k) {
        // The rim runs the other way: a side of the new triangle from corner b to a is the rim's side a, if b follows
        // a.
        const std::uint32_t b = corners[k], a = corners[(k + 1) % 3];
        triangle[k] = loop.corner[b];
        borders[k] = (a + 1) % count == b ? loop.sides[a] / 3 : kNone;
      }
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t here = corners[k];
        // The side that begins here at the rim, or else the one that ends here.
        const bool ends_here = borders[k] != kNone && borders[(k + 2) % 3] == kNone;
        source[k] = ends_here ? next_corner(loop.sides[(here + count - 1) % count]) : loop.sides[here];
      }
      result_.triangles.push_back(triangle);
      result_.loop.push_back(i);
      result_.borders.push_back(borders);
      result_.corner_source.push_back(source);
    }
  }
}

}  // namespace

const char* name_of(LoopOutcome outcome) { return kNames[static_cast<std::size_t>(outcome)]; }

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
