// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/patch_deviations.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tolvol {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();
/// The weights of the points of a vertex, an edge and a face. The points of the reference near a face weigh 1 together.
constexpr double kVertexWeight = 0.05, kEdgeWeight = 0.03, kFaceWeight = 0.05;
/// A search that looks around looks at all faces if a deviation is beyond this share of the tolerance.
constexpr double kLookEverywhereAbove = 0.98;
/// renew() searches for a point if the one that was nearest to it is at more than this squared deviation: it is beyond
/// the tolerance.
constexpr double kSearchAbove = 1;
/// A step of a relaxation searches for a point if its energy is more than this share of that of the largest deviation.
constexpr double kFollowed = 3e-4;
/// The search for the nearest face crosses at most this many edges or corners.
constexpr int kMostCrossings = 16;
/// A point of a face that finds no triangle of the reference counts with this squared deviation.
constexpr double kFarSquare = 4;
/// A triangle that the rule of facing admits is looked for within this many tolerances.
constexpr double kAdmittedReach = 3;

/// The point of a triangle that is nearest to p, after C. Ericson, Real-Time Collision Detection, 2005, 5.1.5. A weight
/// is exactly 0 where the point is on an edge or a corner. closest_point(), which is right for needles, too, takes
/// three times as long.
glm::dvec3 weights_of_nearest(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const glm::dvec3 bp = p - b;
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 - d3 > 0 ? d1 / (d1 - d3) : 0;
    return {1 - t, t, 0};
  }
  const glm::dvec3 cp = p - c;
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 - d6 > 0 ? d2 / (d2 - d6) : 0;
    return {1 - t, 0, t};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double length = (d4 - d3) + (d5 - d6), t = length > 0 ? (d4 - d3) / length : 0;
    return {0, 1 - t, t};
  }
  const double scale = 1 / (va + vb + vc);
  return {1 - (vb + vc) * scale, vb * scale, vc * scale};
}

}  // namespace

void PatchDeviations::start(Patch& patch) {
  patch_ = &patch;
  points_.clear(), added_points_.clear(), separations_.clear(), terms_.clear();
  power_ = kPower, work_ = 0;
  take_points_of_faces();
}

/// The corners, the midpoints of edges and the centroids of the faces that can move.
void PatchDeviations::take_points_of_faces() {
  own_points_.clear();
  const auto moves = [&](std::uint32_t v) { return patch_->vertices()[v].free; };
  for (std::uint32_t f = 0; f < patch_->faces().size(); ++f) {
    const Patch::Face& face = patch_->faces()[f];
    const auto& c = face.corners;
    if (!face.changed && !moves(c[0]) && !moves(c[1]) && !moves(c[2])) continue;
    const double scale = scale_of(f);
    own_points_.push_back({{c[0], c[1], c[2]}, glm::dvec3(1.0 / 3), kFaceWeight, scale});
    for (int k = 0; k < 3; ++k) {
      if (face.across[k] != Patch::kNone && face.across[k] < f) continue;
      const int l = (k + 1) % 3;
      if (!face.changed && !moves(c[k]) && !moves(c[l])) continue;
      own_points_.push_back({{c[k], c[l], c[(k + 2) % 3]}, {0.5, 0.5, 0}, kEdgeWeight, scale});
    }
  }
  for (std::uint32_t v = 0; v < patch_->vertices().size(); ++v) {
    if (!moves(v)) continue;
    double scale = 1;
    for (const std::uint32_t f : patch_->vertices()[v].faces) scale = std::max(scale, scale_of(f));
    own_points_.push_back({{v, v, v}, {1, 0, 0}, kVertexWeight, scale});
  }
}

/// Faces that may use nothing are left to the certificates.
double PatchDeviations::scale_of(std::uint32_t face) const {
  double share = 1;
  for (const std::uint32_t v : patch_->faces()[face].corners) share = std::min(share, patch_->vertices()[v].share);
  return share > 0 ? 1 / (share * share) : 1;
}

void PatchDeviations::add(std::span<const SurfaceSample> samples, std::uint32_t face) {
  const bool is_as_it_was = !patch_->faces()[face].changed;
  for (const SurfaceSample& s : samples) {
    add_reference_point(s, face);
    // A sample has the weights of its nearest point for the corners that its face has in the mesh.
    if (is_as_it_was) terms_.back().weights = s.weights, terms_.back().square = s.deviation * s.deviation;
  }
}

void PatchDeviations::add_reference_point(const glm::dvec3& point, double weight, std::uint32_t face) {
  add_reference_point(SurfaceSample{point, weight, 0, {}}, face);
}

void PatchDeviations::add_reference_point(const SurfaceSample& sample, std::uint32_t face) {
  // Terms of the points of the reference stand first.
  terms_.resize(points_.size());
  points_.push_back(sample);
  terms_.push_back({face, {}, sample.point, {}, kUnknown});
}

void PatchDeviations::add_face_point(std::uint32_t face, const glm::dvec3& weights, double weight) {
  add_point(point_of(face, weights, weight));
}

void PatchDeviations::add_open_point(std::uint32_t face, const glm::dvec3& weights, double weight) {
  add_point(open_point_of(face, weights, weight));
}

void PatchDeviations::add_point(const FacePoint& point) {
  // The term of the new point stands before those of points that are held in half-spaces.
  terms_.resize(std::min(terms_.size(), points_.size() + own_points_.size() + added_points_.size()));
  added_points_.push_back(point);
}

PatchDeviations::FacePoint PatchDeviations::point_of(std::uint32_t face, const glm::dvec3& weights,
                                                     double weight) const {
  const auto& c = patch_->faces()[face].corners;
  return {{c[0], c[1], c[2]}, weights, weight, scale_of(face)};
}

PatchDeviations::FacePoint PatchDeviations::open_point_of(std::uint32_t face, const glm::dvec3& weights,
                                                          double weight) const {
  FacePoint point = point_of(face, weights, weight);
  point.ruled_by = patch_->faces()[face].id;
  return point;
}

void PatchDeviations::add_separation(std::uint32_t face, const Separation& separation, double weight) {
  const auto& c = patch_->faces()[face].corners;
  const double tolerance = 1 / std::sqrt(unit2_);
  separations_.push_back(
      {{{c[0], c[1], c[2]}, separation.weights, weight, 1}, separation.normal, separation.offset + tolerance});
}

void PatchDeviations::renew() {
  evaluate(true, kSearchAbove, tried_);
  keep_tried();
}

bool PatchDeviations::renew_if_lower(bool look_around) {
  evaluate(look_around, square_at(kFollowed), tried_);
  const State tried = sum(tried_);
  if (!(tried.energy < now_.energy)) return false;
  std::swap(terms_, tried_);
  now_ = tried;
  return true;
}

void PatchDeviations::renew_after_flips() {
  terms_.resize(points_.size());
  take_points_of_faces();
  evaluate(false, square_at(kFollowed), tried_);
  keep_tried();
}

void PatchDeviations::set_power(int power) {
  power_ = power;
  now_ = sum(terms_);
}

PatchDeviations::Term PatchDeviations::at(const glm::dvec3& point, std::uint32_t face,
                                          const std::uint32_t (&corners)[3]) const {
  const auto vertices = patch_->vertices();
  const glm::dvec3 &a = vertices[corners[0]].position, &b = vertices[corners[1]].position,
                   &c = vertices[corners[2]].position;
  const glm::dvec3 weights = weights_of_nearest(point, a, b, c);
  const glm::dvec3 residual = point - (weights.x * a + weights.y * b + weights.z * c);
  return {face, weights, point, residual, glm::dot(residual, residual) * unit2_};
}

/// Goes on to the faces beyond the edge or around the corner to which the nearest point is clamped.
PatchDeviations::Term PatchDeviations::nearest(const glm::dvec3& point, std::uint32_t face, bool look_around) const {
  Term best = at(point, face);
  bool closer = false;
  const auto try_face = [&](std::uint32_t other) {
    if (other == Patch::kNone) return;
    const Term found = at(point, other);
    if (found.square < best.square) best = found, closer = true;
  };
  const auto walk = [&] {
    for (int crossings = 0; crossings < kMostCrossings; ++crossings) {
      closer = false;
      const Patch::Face& here = patch_->faces()[best.face];
      const glm::dvec3 weights = best.weights;
      const std::uint32_t current = best.face;
      for (int k = 0; k < 3; ++k) {
        const bool edge = weights[k] == 0, next = weights[(k + 1) % 3] == 0, last = weights[(k + 2) % 3] == 0;
        if (edge && !next && !last) try_face(here.across[(k + 1) % 3]);
        if (!edge && next && last) {
          for (const std::uint32_t f : patch_->vertices()[here.corners[k]].faces) {
            if (f != current) try_face(f);
          }
        }
      }
      if (!closer) return;
    }
  };
  walk();
  if (!look_around) return best;
  if (best.square > kLookEverywhereAbove * kLookEverywhereAbove) {
    for (std::uint32_t f = 0; f < patch_->faces().size(); ++f) try_face(f);
    return best;
  }
  const Patch::Face& here = patch_->faces()[best.face];
  closer = false;
  for (const std::uint32_t other : {here.across[0], here.across[1], here.across[2]}) try_face(other);
  if (closer) walk();
  return best;
}

glm::dvec3 PatchDeviations::place(const FacePoint& p) const {
  const auto vertices = patch_->vertices();
  return p.weights.x * vertices[p.vertices[0]].position + p.weights.y * vertices[p.vertices[1]].position +
         p.weights.z * vertices[p.vertices[2]].position;
}

PatchDeviations::Term PatchDeviations::toward_reference(const FacePoint& p) const {
  const glm::dvec3 x = place(p);
  const auto q = p.ruled_by == Patch::kNone ? bounds_->forward().nearby_point(x) : nearest_admitted(p, x);
  if (!q) return {Patch::kNone, p.weights, x, glm::dvec3(0), kFarSquare};
  const glm::dvec3 residual = *q - x;
  return {Patch::kNone, p.weights, *q, residual, glm::dot(residual, residual) * unit2_ * p.scale};
}

/// A face without a sure normal is steered as if it were free of the rule.
std::optional<glm::dvec3> PatchDeviations::nearest_admitted(const FacePoint& p, const glm::dvec3& x) const {
  const auto vertices = patch_->vertices();
  const glm::dvec3 corners[3] = {vertices[p.vertices[0]].position, vertices[p.vertices[1]].position,
                                 vertices[p.vertices[2]].position};
  std::optional<Facing> facing;
  bounds_->start(p.ruled_by, corners, facing);
  const TriangleCertificate& forward = bounds_->forward();
  return forward.nearest_point(x, kAdmittedReach * forward.limit(), facing ? &*facing : nullptr);
}

PatchDeviations::Term PatchDeviations::into_half_space(const HeldPoint& p) const {
  const glm::dvec3 x = place(p.point);
  const double missing = std::max(0.0, p.offset - glm::dot(p.normal, x));
  return {Patch::kNone, p.point.weights, x + missing * p.normal, missing * p.normal, missing * missing * unit2_};
}

/// The term as the patch is now, with the point that was nearest in the place of the nearest one. Of open points alone
/// the true deviation may be more. Returns nullopt for a point that is new, and where the square was or is more than
/// `most_square`.
std::optional<PatchDeviations::Term> PatchDeviations::followed(std::size_t term, double most_square) const {
  if (term >= terms_.size() || terms_[term].square > most_square) return std::nullopt;
  Term now = terms_[term];
  const auto vertices = patch_->vertices();
  const auto& c = corners(term);
  now.residual = now.target - (now.weights.x * vertices[c[0]].position + now.weights.y * vertices[c[1]].position +
                               now.weights.z * vertices[c[2]].position);
  const double scale = term < points_.size() ? 1 : face_point(term - points_.size()).scale;
  now.square = glm::dot(now.residual, now.residual) * unit2_ * scale;
  if (now.square > most_square) return std::nullopt;
  return now;
}

/// Finds the terms of all points, as the patch is now: up to the squared deviation `followed_up_to` by followed(), and
/// beyond by a search. The search for a nearest face begins at that of terms_.
void PatchDeviations::evaluate(bool look_around, double followed_up_to, std::vector<Term>& terms) {
  terms.clear();
  const auto add_next = [&](const auto& search) {
    const std::optional<Term> term = followed(terms.size(), followed_up_to);
    terms.push_back(term ? *term : search());
    work_ += !term;
  };
  for (std::size_t i = 0; i < points_.size(); ++i) {
    add_next([&] { return nearest(points_[i].point, terms_[i].face, look_around); });
  }
  for (const auto* all : {&own_points_, &added_points_}) {
    for (const FacePoint& p : *all) add_next([&] { return toward_reference(p); });
  }
  for (const HeldPoint& p : separations_) terms.push_back(into_half_space(p));
}

void PatchDeviations::keep_tried() {
  std::swap(terms_, tried_);
  now_ = sum(terms_);
}

PatchDeviations::State PatchDeviations::sum(const std::vector<Term>& terms) const {
  State state;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const double square = terms[i].square;
    state.energy += energy(i, square);
    // A deviation that was beyond kEnough before may stay as it was.
    const double before = i < points_.size() ? points_[i].deviation : 0;
    state.largest = std::max(state.largest, before > kEnough ? square * kEnough * kEnough / (before * before) : square);
  }
  state.largest = std::sqrt(state.largest);
  return state;
}

double PatchDeviations::deviation(const glm::dvec3& point, std::uint32_t& face) const {
  const Term found = nearest(point, face, true);
  face = found.face;
  return std::sqrt(found.square);
}

double PatchDeviations::deviation_of(std::uint32_t face, const glm::dvec3& weights) const {
  return std::sqrt(toward_reference(point_of(face, weights, 0)).square);
}

double PatchDeviations::admitted_deviation_of(std::uint32_t face, const glm::dvec3& weights) const {
  return std::sqrt(toward_reference(open_point_of(face, weights, 0)).square);
}

bool PatchDeviations::is_stuck() const {
  for (std::size_t i = points_.size() + own_points_.size(); i < terms_.size(); ++i) {
    if (terms_[i].square <= kEnough * kEnough) continue;
    const FacePoint& p = face_point(i - points_.size());
    // Where the rule of facing holds, what the point has to be near to depends on all corners of the face.
    bool moves = false;
    for (int k = 0; k < 3; ++k) {
      const bool counts = p.weights[k] > 0 || p.ruled_by != Patch::kNone;
      moves = moves || (counts && patch_->vertices()[p.vertices[k]].free);
    }
    if (!moves) return true;
  }
  return false;
}

double PatchDeviations::square_from(std::size_t point, const std::uint32_t (&corners)[3]) const {
  return at(points_[point].point, Patch::kNone, corners).square;
}

std::uint32_t PatchDeviations::take_nearer(std::size_t point, std::uint32_t face, std::uint32_t other) {
  const Term first = at(points_[point].point, face), second = at(points_[point].point, other);
  terms_[point] = second.square < first.square ? second : first;
  return terms_[point].face;
}

}  // namespace tolvol
