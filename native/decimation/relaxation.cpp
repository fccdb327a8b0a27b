// SPDX-License-Identifier: GPL-3.0-or-later
// The energy is the sum of w (d / tolerance)^p over points of both surfaces, d the distance from a point to the other
// surface. A point of a face at barycentric coordinates b follows the corners x_i of the face by sum b_i x_i, so that
// with the residual r = d u, |u| = 1, the gradient with respect to x_i is -w p d^(p-2) b_i r, and the matrix
// p (p-1) w d^(p-2) b_i b_j u u^T is the leading part of the second derivative. The steps are those of K. Levenberg and
// D. Marquardt. A Newton step lowers a deviation to (p-2) / (p-1) of itself alone, so that steps are made longer as
// long as they succeed. A large p approaches the minimax fit.
#include "decimation/relaxation.h"

#include <algorithm>
#include <cmath>

#include "base/call.h"

namespace tolvol {
namespace {

constexpr int kSumPower = 8, kLargestPower = 24, kFinalPower = 96;
/// The last power is used from a smaller deviation than this, over the tolerance, and for so many steps.
constexpr double kNearlyEnough = 1.06;
constexpr int kFinalSteps = 20;
/// The weights of the points of a vertex, an edge and a face. The points of the reference near a face weigh 1 together.
constexpr double kVertexWeight = 0.05, kEdgeWeight = 0.03, kFaceWeight = 0.05;
/// The largest deviation, over the tolerance, from which a success may still come before the first, second, ... step.
/// Of 621 successes 97 in 100 kept to it.
constexpr double kGiveUpAbove[] = {9, 2.1, 2.1, 2.1, 2.1, 1.33, 1.33, 1.33, 1.33, 1.26, 1.26, 1.26, 1.26, 1.17};
/// The same for try_lower_largest(), with the first power and with the last one. Of 250 successes 97 in 100 kept to
/// it.
constexpr double kGiveUpAgainAbove[] = {1.35, 1.35, 1.2, 1.2, 1.15, 1.15, 1.09, 1.09, 1.05, 1.05};
constexpr double kGiveUpAtLastAbove[] = {1.06, 1.06, 1.03, 1.03, 1.03, 1.01, 1.01, 1.01, 1.01, 1.01,
                                         1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01};
/// Damping of the first step, and its factors after a step that lowered the energy and one that did not.
constexpr double kDamping = 1e-2, kLessDamping = 0.5, kMoreDamping = 5, kMostDamping = 1e4;
/// The share of the mean of the diagonal, times the damping, that is added to the diagonal beside the damped diagonal.
constexpr double kMeanShare = 0.1;
/// The factor of the first step, and the factors of this factor after a success and a failure.
constexpr double kOverstep = 1.5, kLonger = 1.15, kShorter = 0.6;
/// A vertex moves at most by this share of its shortest edge in one step.
constexpr double kMostMove = 0.3;
/// A normal turns by less than the angle of the first cosine in one step, and the normals at an edge do not come to
/// differ by more than the angle of the second.
constexpr double kTurnCosine = 0.3, kEdgeCosine = -0.8;
/// Vertices whose faces turn too far go half the way so many times, and then not at all.
constexpr int kMostHalvings = 4;
/// The normals that a flip leaves differ from the mean before by less than the angle of this cosine.
constexpr double kFlipCosine = 0.2;
/// Edges are flipped before one step in so many, where the flip leaves less than this share of the energy.
constexpr int kFlipEvery = 4;
constexpr double kFlipGain = 0.99;
/// All faces are looked at before one step in so many, and whenever a deviation is beyond this share of the tolerance.
constexpr int kLookAroundEvery = 3;
constexpr double kLookEverywhereAbove = 0.98;
/// The search for the nearest face crosses so many edges at most.
constexpr int kMostCrossings = 16;
/// The squared deviation of a face's point that is too far from the reference to see it.
constexpr double kFarSquare = 4;
/// A triangle that the rule of facing admits is looked for within so many tolerances.
constexpr double kAdmittedReach = 3;

/// x^n for a small n.
double power_of(double x, int n) {
  double result = 1;
  for (; n > 0; n >>= 1, x *= x) {
    if (n & 1) result *= x;
  }
  return result;
}

glm::dvec3 normal_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) { return glm::cross(b - a, c - a); }

bool turned(const glm::dvec3& before, const glm::dvec3& after, double cosine) {
  const double dot = glm::dot(before, after);
  return !(dot > 0 && dot * dot >= cosine * cosine * glm::dot(before, before) * glm::dot(after, after));
}

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

/// The cosine of the angle between two normals; 1 where one has no direction.
double cosine_of(const glm::dvec3& a, const glm::dvec3& b) {
  const double lengths2 = glm::dot(a, a) * glm::dot(b, b);
  return lengths2 > 0 ? glm::dot(a, b) / std::sqrt(lengths2) : 1;
}

}  // namespace

void Relaxation::start(Patch& patch) {
  patch_ = &patch;
  points_.clear(), added_points_.clear(), separations_.clear(), terms_.clear();
  free_.clear(), unknown_.clear();
  for (std::uint32_t v = 0; v < patch.vertices().size(); ++v) {
    const bool free = patch.vertices()[v].free;
    unknown_.push_back(free ? static_cast<std::uint32_t>(free_.size()) : Patch::kNone);
    if (free) free_.push_back(v);
  }
  take_points_of_faces();
}

/// The corners, the midpoints of edges and the centroids of the faces that can move.
void Relaxation::take_points_of_faces() {
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
  for (const std::uint32_t v : free_) {
    double scale = 1;
    for (const std::uint32_t f : patch_->vertices()[v].faces) scale = std::max(scale, scale_of(f));
    own_points_.push_back({{v, v, v}, {1, 0, 0}, kVertexWeight, scale});
  }
}

/// Faces that may use nothing are left to the certificates.
double Relaxation::scale_of(std::uint32_t face) const {
  double share = 1;
  for (const std::uint32_t v : patch_->faces()[face].corners) share = std::min(share, patch_->vertices()[v].share);
  return share > 0 ? 1 / (share * share) : 1;
}

void Relaxation::add(std::span<const SurfaceSample> samples, std::uint32_t face) {
  // Terms of the points of the reference stand first.
  terms_.resize(points_.size());
  for (const SurfaceSample& s : samples) {
    points_.push_back(s);
    terms_.push_back({face, {}, {}, 0});
  }
}

void Relaxation::add_face_point(std::uint32_t face, const glm::dvec3& weights, double weight) {
  added_points_.push_back(point_of(face, weights, weight));
}

void Relaxation::add_open_point(std::uint32_t face, const glm::dvec3& weights, double weight) {
  added_points_.push_back(open_point_of(face, weights, weight));
}

Relaxation::FacePoint Relaxation::point_of(std::uint32_t face, const glm::dvec3& weights, double weight) const {
  const auto& c = patch_->faces()[face].corners;
  return {{c[0], c[1], c[2]}, weights, weight, scale_of(face)};
}

Relaxation::FacePoint Relaxation::open_point_of(std::uint32_t face, const glm::dvec3& weights, double weight) const {
  FacePoint point = point_of(face, weights, weight);
  point.ruled_by = patch_->faces()[face].id;
  return point;
}

void Relaxation::add_separation(std::uint32_t face, const Separation& separation, double weight) {
  const auto& c = patch_->faces()[face].corners;
  const double tolerance = 1 / std::sqrt(unit2_);
  separations_.push_back(
      {{{c[0], c[1], c[2]}, separation.weights, weight, 1}, separation.normal, separation.offset + tolerance});
}

void Relaxation::renew() {
  evaluate(true, tried_);
  std::swap(terms_, tried_);
  now_ = sum(terms_, kSumPower);
}

Relaxation::Term Relaxation::at(const glm::dvec3& point, std::uint32_t face) const {
  return at(point, face, patch_->position(face, 0), patch_->position(face, 1), patch_->position(face, 2));
}

Relaxation::Term Relaxation::at(const glm::dvec3& point, std::uint32_t face, const glm::dvec3& a, const glm::dvec3& b,
                                const glm::dvec3& c) const {
  const glm::dvec3 weights = weights_of_nearest(point, a, b, c);
  const glm::dvec3 residual = point - (weights.x * a + weights.y * b + weights.z * c);
  return {face, weights, residual, glm::dot(residual, residual) * unit2_};
}

/// Goes on to the faces beyond the edge or around the corner to which the nearest point is clamped.
Relaxation::Term Relaxation::nearest(const glm::dvec3& point, std::uint32_t face, bool look_around) const {
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

glm::dvec3 Relaxation::place(const FacePoint& p) const {
  const auto vertices = patch_->vertices();
  return p.weights.x * vertices[p.vertices[0]].position + p.weights.y * vertices[p.vertices[1]].position +
         p.weights.z * vertices[p.vertices[2]].position;
}

Relaxation::Term Relaxation::toward_reference(const FacePoint& p) const {
  const glm::dvec3 x = place(p);
  const auto q = p.ruled_by == Patch::kNone ? bounds_->forward().nearby_point(x) : nearest_admitted(p, x);
  if (!q) return {Patch::kNone, p.weights, glm::dvec3(0), kFarSquare};
  const glm::dvec3 residual = *q - x;
  return {Patch::kNone, p.weights, residual, glm::dot(residual, residual) * unit2_ * p.scale};
}

/// A face without a sure normal is steered as if it were free of the rule.
std::optional<glm::dvec3> Relaxation::nearest_admitted(const FacePoint& p, const glm::dvec3& x) const {
  const auto vertices = patch_->vertices();
  const glm::dvec3 corners[3] = {vertices[p.vertices[0]].position, vertices[p.vertices[1]].position,
                                 vertices[p.vertices[2]].position};
  std::optional<Facing> facing;
  bounds_->start(p.ruled_by, corners, facing);
  const TriangleCertificate& forward = bounds_->forward();
  return forward.nearest_point(x, kAdmittedReach * forward.limit(), facing ? &*facing : nullptr);
}

Relaxation::Term Relaxation::into_half_space(const HeldPoint& p) const {
  const double missing = std::max(0.0, p.offset - glm::dot(p.normal, place(p.point)));
  return {Patch::kNone, p.point.weights, missing * p.normal, missing * missing * unit2_};
}

/// Finds the terms of all points, as the patch is now. The search for a nearest face begins at that of terms_.
void Relaxation::evaluate(bool look_around, std::vector<Term>& terms) const {
  terms.clear();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    terms.push_back(nearest(points_[i].point, terms_[i].face, look_around));
  }
  for (const auto* all : {&own_points_, &added_points_}) {
    for (const FacePoint& p : *all) terms.push_back(toward_reference(p));
  }
  for (const HeldPoint& p : separations_) terms.push_back(into_half_space(p));
}

Relaxation::State Relaxation::sum(const std::vector<Term>& terms, int power) const {
  State state;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const double square = terms[i].square;
    state.energy += weight(i) * power_of(square, power / 2);
    // A deviation that was beyond kEnough before may stay as it was.
    const double before = i < points_.size() ? points_[i].deviation : 0;
    state.largest = std::max(state.largest, before > kEnough ? square * kEnough * kEnough / (before * before) : square);
  }
  state.largest = std::sqrt(state.largest);
  return state;
}

double Relaxation::deviation(const glm::dvec3& point, std::uint32_t& face) const {
  const Term found = nearest(point, face, true);
  face = found.face;
  return std::sqrt(found.square);
}

double Relaxation::deviation_of(std::uint32_t face, const glm::dvec3& weights) const {
  return std::sqrt(toward_reference(point_of(face, weights, 0)).square);
}

double Relaxation::admitted_deviation_of(std::uint32_t face, const glm::dvec3& weights) const {
  return std::sqrt(toward_reference(open_point_of(face, weights, 0)).square);
}

bool Relaxation::is_stuck() const {
  for (std::size_t i = points_.size() + own_points_.size(); i < terms_.size(); ++i) {
    if (terms_[i].square <= kEnough * kEnough) continue;
    const FacePoint& p = face_point(i - points_.size());
    // Where the rule of facing holds, what the point has to be near to depends on all corners of the face.
    bool moves = false;
    for (int k = 0; k < 3; ++k) {
      const bool counts = p.weights[k] > 0 || p.ruled_by != Patch::kNone;
      moves = moves || (counts && unknown_[p.vertices[k]] != Patch::kNone);
    }
    if (!moves) return true;
  }
  return false;
}

bool Relaxation::lower_sum(int steps, bool flip) {
  flips_ = flip;
  minimise(kSumPower, steps, kGiveUpAbove);
  const std::size_t last = std::min(static_cast<std::size_t>(steps), std::size(kGiveUpAbove)) - 1;
  return now_.largest <= kGiveUpAbove[last];
}

void Relaxation::lower_largest(int steps) { lower_largest(steps, {}, {}); }

void Relaxation::try_lower_largest(int steps) { lower_largest(steps, kGiveUpAgainAbove, kGiveUpAtLastAbove); }

void Relaxation::lower_largest(int steps, std::span<const double> give_up_above,
                               std::span<const double> give_up_at_last) {
  minimise(kLargestPower, steps, give_up_above);
  if (!enough() && now_.largest < kNearlyEnough) minimise(kFinalPower, kFinalSteps, give_up_at_last);
  now_ = sum(terms_, kSumPower);
}

void Relaxation::minimise(int power, int steps, std::span<const double> give_up_above) {
  now_ = sum(terms_, power);
  damping_ = kDamping, overstep_ = kOverstep;
  for (int i = 0; i < steps && !enough(); ++i) {
    poll();
    const auto place = static_cast<std::size_t>(i);
    if (place < give_up_above.size() && now_.largest > give_up_above[place]) return;
    const bool flipped = flips_ && i % kFlipEvery == kFlipEvery - 1 && flip_edges(power);
    if (!step(power, i % kLookAroundEvery == 0) && !flipped && damping_ > kMostDamping) return;
  }
}

/// Takes one step if it lowers the energy, and returns whether it does.
bool Relaxation::step(int power, bool look_around) {
  assemble(power);
  if (free_.empty() || !solve()) return false;
  const auto vertices = patch_->vertices();
  before_.clear(), normals_.clear();
  for (const std::uint32_t v : free_) before_.push_back(vertices[v].position);
  for (std::uint32_t f = 0; f < patch_->faces().size(); ++f) {
    normals_.push_back(normal_of(patch_->position(f, 0), patch_->position(f, 1), patch_->position(f, 2)));
  }
  std::vector<glm::dvec3> after;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    glm::dvec3 move(move_[3 * i], move_[3 * i + 1], move_[3 * i + 2]);
    move *= overstep_;
    double shortest2 = std::numeric_limits<double>::infinity();
    for (const std::uint32_t f : vertices[free_[i]].faces) {
      for (const std::uint32_t v : patch_->faces()[f].corners) {
        if (v == free_[i]) continue;
        const glm::dvec3 d = vertices[v].position - before_[i];
        shortest2 = std::min(shortest2, glm::dot(d, d));
      }
    }
    const double most = kMostMove * std::sqrt(shortest2), length = glm::length(move);
    if (length > most) move *= most / length;
    after.push_back(before_[i] + move);
  }
  if (place_unturned(after)) {
    evaluate(look_around, tried_);
    const State tried = sum(tried_, power);
    if (tried.energy < now_.energy) {
      now_ = tried;
      std::swap(terms_, tried_);
      damping_ *= kLessDamping;
      overstep_ = std::min(overstep_ * kLonger, static_cast<double>(power - 1));
      return true;
    }
  }
  for (std::size_t i = 0; i < free_.size(); ++i) vertices[free_[i]].position = before_[i];
  damping_ *= kMoreDamping;
  overstep_ = std::max(overstep_ * kShorter, 1.0);
  return false;
}

/// Puts the free vertices at these places, and those that would turn a face or an edge too far at half the way, as
/// often as it takes. Returns whether it comes to places where nothing turns too far.
bool Relaxation::place_unturned(std::vector<glm::dvec3>& places) {
  const auto vertices = patch_->vertices();
  for (int halvings = 0; halvings <= kMostHalvings; ++halvings) {
    for (std::size_t i = 0; i < free_.size(); ++i) vertices[free_[i]].position = places[i];
    turned_.assign(vertices.size(), false);
    if (!find_turned()) return true;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      if (turned_[free_[i]]) places[i] = halvings + 1 < kMostHalvings ? 0.5 * (places[i] + before_[i]) : before_[i];
    }
  }
  return false;
}

/// Notes in turned_ the vertices of the faces that have turned too far since normals_.
bool Relaxation::find_turned() {
  new_normals_.clear();
  bool any = false;
  const auto note = [&](std::uint32_t face) {
    any = true;
    for (const std::uint32_t v : patch_->faces()[face].corners) turned_[v] = true;
  };
  for (std::uint32_t f = 0; f < patch_->faces().size(); ++f) {
    new_normals_.push_back(normal_of(patch_->position(f, 0), patch_->position(f, 1), patch_->position(f, 2)));
    if (glm::dot(normals_[f], normals_[f]) > 0 && turned(normals_[f], new_normals_[f], kTurnCosine)) note(f);
  }
  for (std::uint32_t f = 0; f < patch_->faces().size(); ++f) {
    for (const std::uint32_t other : patch_->faces()[f].across) {
      if (other == Patch::kNone || other < f) continue;
      if (cosine_of(new_normals_[f], new_normals_[other]) < kEdgeCosine &&
          cosine_of(normals_[f], normals_[other]) >= kEdgeCosine) {
        note(f), note(other);
      }
    }
  }
  return any;
}

/// Sums up the gradient, and the lower triangle of the matrix, in units of the tolerance.
void Relaxation::assemble(int power) {
  const std::size_t n = 3 * free_.size();
  matrix_.assign(n * n, 0), gradient_.assign(n, 0);
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Term& t = terms_[i];
    if (!(t.square > 0)) continue;
    const auto& corners =
        i < points_.size() ? patch_->faces()[t.face].corners : face_point(i - points_.size()).vertices;
    const double scale = i < points_.size() ? 1 : face_point(i - points_.size()).scale;
    const double force = weight(i) * power * power_of(t.square, power / 2 - 1) * scale;
    const double length2 = glm::dot(t.residual, t.residual);
    if (!(force > 0) || !(length2 > 0)) continue;
    const double stiffness = force * (power - 1) / length2;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t p = unknown_[corners[k]];
      const double bk = t.weights[k];
      if (p == Patch::kNone || !(bk > 0)) continue;
      for (int x = 0; x < 3; ++x) gradient_[3 * p + x] += force * bk * t.residual[x];
      for (int l = 0; l < 3; ++l) {
        const std::uint32_t q = unknown_[corners[l]];
        if (q == Patch::kNone || q > p) continue;
        const double c = stiffness * bk * t.weights[l];
        for (int x = 0; x < 3; ++x) {
          double* const row = &matrix_[(3 * p + x) * n + 3 * q];
          for (int y = 0; y < 3; ++y) row[y] += c * t.residual[x] * t.residual[y];
        }
      }
    }
  }
}

/// Solves for the move by Cholesky's factors. The order of all sums is fixed, so that every platform gets one result.
bool Relaxation::solve() {
  const std::size_t n = gradient_.size();
  double trace = 0;
  for (std::size_t i = 0; i < n; ++i) trace += matrix_[i * n + i];
  if (!(trace > 0)) return false;
  factor_ = matrix_;
  for (std::size_t i = 0; i < n; ++i) {
    double& d = factor_[i * n + i];
    d += damping_ * (d + kMeanShare * trace / static_cast<double>(n));
  }
  move_ = gradient_;
  for (std::size_t i = 0; i < n; ++i) {
    double* const row = &factor_[i * n];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const other = &factor_[j * n];
      double sum = row[j];
      for (std::size_t k = 0; k < j; ++k) sum -= row[k] * other[k];
      if (j < i) {
        row[j] = sum / other[j];
      } else {
        if (!(sum > 0)) return false;
        row[i] = std::sqrt(sum);
      }
    }
    double sum = move_[i];
    for (std::size_t k = 0; k < i; ++k) sum -= row[k] * move_[k];
    move_[i] = sum / row[i];
  }
  for (std::size_t i = n; i-- > 0;) {
    move_[i] /= factor_[i * n + i];
    for (std::size_t k = 0; k < i; ++k) move_[k] -= factor_[i * n + k] * move_[i];
  }
  return true;
}

bool Relaxation::folds(const Patch::Flipped& flipped) const {
  const auto at_corner = [&](std::uint32_t v) { return patch_->vertices()[v].position; };
  glm::dvec3 before(0);
  for (const std::uint32_t f : flipped.face) {
    before += normal_of(patch_->position(f, 0), patch_->position(f, 1), patch_->position(f, 2));
  }
  for (const auto& c : flipped.corners) {
    if (turned(before, normal_of(at_corner(c[0]), at_corner(c[1]), at_corner(c[2])), kFlipCosine)) return true;
  }
  return false;
}

double Relaxation::energy_now(const Patch::Flipped& flipped, int power) const {
  double energy = 0;
  for (const std::uint32_t f : flipped.face) {
    for (const std::uint32_t i : points_of_[f]) energy += weight(i) * power_of(terms_[i].square, power / 2);
  }
  return energy;
}

/// The energy of the points near two faces if these were flipped, or a larger number than `limit`.
double Relaxation::energy_if(const Patch::Flipped& flipped, int power, double limit) const {
  double energy = 0;
  const auto at_corner = [&](std::uint32_t v) { return patch_->vertices()[v].position; };
  for (const std::uint32_t f : flipped.face) {
    for (const std::uint32_t i : points_of_[f]) {
      double square = std::numeric_limits<double>::infinity();
      for (const auto& c : flipped.corners) {
        square = std::min(square, at(points_[i].point, f, at_corner(c[0]), at_corner(c[1]), at_corner(c[2])).square);
      }
      energy += weight(i) * power_of(square, power / 2);
      if (energy > limit) return energy;
    }
  }
  return energy;
}

/// Flips the edges whose flip lowers the energy of the points of the reference near by, and returns whether there are
/// any.
bool Relaxation::flip_edges(int power) {
  points_of_.resize(std::max(points_of_.size(), patch_->faces().size()));
  for (auto& points : points_of_) points.clear();
  for (std::uint32_t i = 0; i < points_.size(); ++i) points_of_[terms_[i].face].push_back(i);
  bool any = false;
  for (std::uint32_t f = 0; f < patch_->faces().size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      Patch::Flipped flipped;
      const std::uint32_t other = patch_->faces()[f].across[k];
      if (other == Patch::kNone || other < f || !patch_->can_flip(f, k, flipped) || folds(flipped)) continue;
      const double limit = kFlipGain * energy_now(flipped, power);
      if (!(energy_if(flipped, power, limit) < limit)) continue;
      patch_->flip(flipped);
      any = true;
      std::vector<std::uint32_t> points = points_of_[f];
      points.insert(points.end(), points_of_[other].begin(), points_of_[other].end());
      points_of_[f].clear(), points_of_[other].clear();
      for (const std::uint32_t i : points) {
        const Term first = at(points_[i].point, f), second = at(points_[i].point, other);
        terms_[i] = second.square < first.square ? second : first;
        points_of_[terms_[i].face].push_back(i);
      }
    }
  }
  if (!any) return false;
  take_points_of_faces();
  evaluate(true, tried_);
  std::swap(terms_, tried_);
  now_ = sum(terms_, power);
  return true;
}

}  // namespace tolvol
