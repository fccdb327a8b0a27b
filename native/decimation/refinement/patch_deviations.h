// SPDX-License-Identifier: GPL-3.0-or-later
/// How far a patch and the reference are from each other: at points of the reference, which are near faces of the
/// patch, and at points of these faces, which are near the reference. It steers a Relaxation and proves nothing.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "decimation/certified_bounds.h"
#include "decimation/refinement/patch.h"
#include "decimation/refinement/separation.h"
#include "decimation/refinement/surface_samples.h"

namespace tolvol {

class PatchDeviations {
 public:
  /// `bounds` finds the points of the reference that are near to points of faces. Deviations are in units of the limit
  /// of its forward direction, in the frame. Keeps a reference to it.
  explicit PatchDeviations(const CertifiedBounds& bounds)
      : bounds_(&bounds), unit2_(1 / (bounds.forward().limit() * bounds.forward().limit())) {}

  /// Starts with the faces and positions of a patch. Keeps a reference to the patch until the next start.
  void start(Patch& patch);
  Patch& patch() const { return *patch_; }

  /// Adds the samples of a face of the mesh. `face` is the place of this face in the patch, or of the one that takes
  /// over its points. The samples are nearest to `face` or to faces near by.
  void add(std::span<const SurfaceSample> samples, std::uint32_t face);
  /// Adds a point of the reference, which is nearest to `face` or to a face near by.
  void add_reference_point(const glm::dvec3& point, double weight, std::uint32_t face);
  /// Adds a point of a face, by its barycentric coordinates, to be held near the reference.
  void add_face_point(std::uint32_t face, const glm::dvec3& weights, double weight);
  /// The same for a point that has no proof: it is held near those triangles of the reference that the rule of facing
  /// admits for the face, as it is turned at each search for the point. The search takes some microseconds.
  void add_open_point(std::uint32_t face, const glm::dvec3& weights, double weight);
  /// Adds a point of a face to be held in a half-space. Its deviation is 1 at the half-space's end and 0 one tolerance
  /// inside.
  void add_separation(std::uint32_t face, const Separation& separation, double weight);
  /// Drops all points that are held in half-spaces.
  void drop_separations() { separations_.clear(); }
  bool has_separations() const { return !separations_.empty(); }

  /// Finds the deviations of all points, as the patch is now. It is needed after points were added or positions were
  /// changed. It searches only for new points and for points beyond the tolerance, and after points of the reference
  /// were added for all points of faces. For the others the point that was nearest counts as nearest still. Their
  /// deviations may therefore be less than what is found; those of open points may also be more, where the face has
  /// turned since the search.
  void renew();
  /// The same, and keeps what it finds if the energy is less than before. Returns whether it is. It searches for all
  /// points whose energy is not negligible beside that of the largest deviation. Unless `look_around`, the search for
  /// the nearest face ends where no face beside it is nearer.
  bool renew_if_lower(bool look_around);
  /// The same as renew_if_lower(false) after flips, which change the edges and faces that have points. It keeps what it
  /// finds in any case.
  void renew_after_flips();

  /// The number of searches for a nearest point since start(). They take most of the time of a relaxation.
  std::size_t work() const { return work_; }

  /// The energy is the sum of the weighted deviations to this power, which is even: kPower from the start on.
  static constexpr int kPower = 8;
  int power() const { return power_; }
  void set_power(int power);

  /// The energy, and the largest deviation.
  struct State {
    double energy = 0, largest = 0;
  };
  const State& state() const { return now_; }
  /// Deviations up to this share of the tolerance are enough; the rest is for what the samples do not see.
  static constexpr double kEnough = 0.994;
  /// Whether the largest deviation that is seen is at most kEnough. A point of the reference that was beyond it before
  /// may stay where it was.
  bool enough() const { return now_.largest <= kEnough; }
  /// Whether a point that was added deviates too far and lies between vertices that do not move.
  bool is_stuck() const;

  /// The deviation of a point of the reference from the patch, over the tolerance, and the face that is nearest.
  /// `face` is where the search begins.
  double deviation(const glm::dvec3& point, std::uint32_t& face) const;
  /// The deviation of a point of a face from the reference, over the tolerance.
  double deviation_of(std::uint32_t face, const glm::dvec3& weights) const;
  /// The same from the triangles of the reference that the rule of facing admits for the face; 2 if it is beyond 3.
  double admitted_deviation_of(std::uint32_t face, const glm::dvec3& weights) const;

  /// A point of a face and the point beyond it that it has to come near to.
  struct Term {
    std::uint32_t face;   ///< The face that is nearest to a point of the reference.
    glm::dvec3 weights;   ///< The barycentric coordinates of the point of the face.
    glm::dvec3 target;    ///< The other point.
    glm::dvec3 residual;  ///< From the point of the face to the other one.
    double square;        ///< The squared deviation, over the tolerance that the face may use; infinite before the
                          ///< first search.
  };
  /// One term for each point. Those of the reference come first.
  std::span<const Term> terms() const { return terms_; }
  std::size_t reference_count() const { return points_.size(); }
  /// The vertices that the weights of a term belong to.
  const std::uint32_t (&corners(std::size_t term) const)[3] {
    return term < points_.size() ? patch_->faces()[terms_[term].face].corners
                                 : face_point(term - points_.size()).vertices;
  }
  /// The derivative of the energy of a term with respect to the length of its residual, over this length, in units of
  /// the tolerance.
  double force(std::size_t term) const {
    const double scale = term < points_.size() ? 1 : face_point(term - points_.size()).scale;
    return weight(term) * power_ * power_of(terms_[term].square, power_ / 2 - 1) * scale;
  }
  /// The energy that a term has, or would have with another square.
  double energy(std::size_t term) const { return energy(term, terms_[term].square); }
  double energy(std::size_t term, double square) const { return weight(term) * power_of(square, power_ / 2); }

  /// The squared deviation at which the energy is this share of that of the largest deviation, or of a deviation of one
  /// tolerance if that is less, for a point of the same weight.
  double square_at(double share) const {
    const double deviation = std::min(1.0, now_.largest) * std::pow(share, 1.0 / power_);
    return deviation * deviation;
  }

  /// The squared deviation of a point of the reference from a face that would have these corners.
  double square_from(std::size_t point, const std::uint32_t (&corners)[3]) const;
  /// Takes the nearer of two faces as the one that is nearest to a point of the reference, and returns it.
  std::uint32_t take_nearer(std::size_t point, std::uint32_t face, std::uint32_t other);

 private:
  struct FacePoint {
    std::uint32_t vertices[3];
    glm::dvec3 weights;
    double weight;
    double scale;  ///< 1 / share^2, by the least share of the tolerance that a vertex of the face may use.
    std::uint32_t ruled_by = Patch::kNone;  ///< The face of the mesh whose rule of facing holds for it, or kNone.
  };
  struct HeldPoint {
    FacePoint point;
    glm::dvec3 normal;
    double offset;  ///< The deviation is 0 from here on along the normal.
  };

  /// x^n for a small n.
  static double power_of(double x, int n) {
    double result = 1;
    for (; n > 0; n >>= 1, x *= x) {
      if (n & 1) result *= x;
    }
    return result;
  }
  void add_reference_point(const SurfaceSample& sample, std::uint32_t face);
  void add_point(const FacePoint& point);
  void take_points_of_faces();
  double scale_of(std::uint32_t face) const;
  FacePoint point_of(std::uint32_t face, const glm::dvec3& weights, double weight) const;
  FacePoint open_point_of(std::uint32_t face, const glm::dvec3& weights, double weight) const;
  Term at(const glm::dvec3& point, std::uint32_t face, const std::uint32_t (&corners)[3]) const;
  Term at(const glm::dvec3& point, std::uint32_t face) const { return at(point, face, patch_->faces()[face].corners); }
  Term nearest(const glm::dvec3& point, std::uint32_t face, bool look_around) const;
  glm::dvec3 place(const FacePoint& p) const;
  Term toward_reference(const FacePoint& p) const;
  std::optional<glm::dvec3> nearest_admitted(const FacePoint& p, const glm::dvec3& x) const;
  Term into_half_space(const HeldPoint& p) const;
  std::optional<Term> followed(std::size_t term, double most_square) const;
  void evaluate(bool look_around, double followed_up_to, std::vector<Term>& terms);
  State sum(const std::vector<Term>& terms) const;
  void keep_tried();
  const FacePoint& face_point(std::size_t i) const {
    if (i < own_points_.size()) return own_points_[i];
    i -= own_points_.size();
    return i < added_points_.size() ? added_points_[i] : separations_[i - added_points_.size()].point;
  }
  double weight(std::size_t term) const {
    return term < points_.size() ? points_[term].weight : face_point(term - points_.size()).weight;
  }

  const CertifiedBounds* bounds_;
  double unit2_;  ///< It is 1 / limit^2.
  Patch* patch_ = nullptr;
  std::vector<SurfaceSample> points_;                 ///< of the reference
  std::vector<FacePoint> own_points_, added_points_;  ///< Those of every vertex, edge and face; those that were added.
  std::vector<HeldPoint> separations_;
  std::vector<Term> terms_, tried_;  ///< Of points_, own_points_, added_points_ and separations_, in this order.
  std::size_t work_ = 0;
  int power_ = kPower;
  State now_;
};

}  // namespace tolvol
