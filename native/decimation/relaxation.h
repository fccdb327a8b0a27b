// SPDX-License-Identifier: GPL-3.0-or-later
/// Moves all free vertices of a patch together, and flips its edges, to where points of the reference are near the
/// patch's faces and points of these faces near the reference. The largest deviations count most. It steers a search
/// and proves nothing.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "check/certificate.h"
#include "decimation/certified_bounds.h"
#include "decimation/patch.h"
#include "decimation/separation.h"

namespace tolvol {

/// A point of the reference that a face of the mesh has to be near to.
struct SurfaceSample {
  glm::dvec3 point;
  double weight;
  double deviation;  ///< Its deviation from the face now, over the tolerance.
};

class Relaxation {
 public:
  /// `bounds` finds the points of the reference that are near to points of faces. Deviations are in units of the limit
  /// of its forward direction, in the frame. Keeps a reference to it.
  explicit Relaxation(const CertifiedBounds& bounds)
      : bounds_(&bounds), unit2_(1 / (bounds.forward().limit() * bounds.forward().limit())) {}

  /// Starts with the faces and positions of a patch. Keeps a reference to the patch until the next start.
  void start(Patch& patch);
  /// Adds points of the reference, which are nearest to `face` or to faces near by.
  void add(std::span<const SurfaceSample> samples, std::uint32_t face);
  /// Adds a point of a face, by its barycentric coordinates, to be held near the reference.
  void add_face_point(std::uint32_t face, const glm::dvec3& weights, double weight);
  /// The same for a point that has no proof: it is held near those triangles of the reference that the rule of facing
  /// admits for the face, as it is turned at every step. A search of the reference finds them, in some microseconds.
  void add_open_point(std::uint32_t face, const glm::dvec3& weights, double weight);
  /// Adds a point of a face to be held in a half-space. Its deviation is 1 at the half-space's end and 0 one tolerance
  /// inside.
  void add_separation(std::uint32_t face, const Separation& separation, double weight);
  /// Drops all points that are held in half-spaces.
  void drop_separations() { separations_.clear(); }
  bool has_separations() const { return !separations_.empty(); }
  /// Finds the deviations of all points that were added, as the patch is now. The other functions need it after points
  /// were added or positions were changed.
  void renew();

  /// The sum of the weighted deviations to the power of 8, and the largest deviation.
  struct State {
    double energy = 0, largest = 0;
  };
  State state() const { return now_; }

  /// Minimises the sum of deviations to the power of 8 by at most so many steps. If `flip`, it flips edges, too.
  /// Before some of its steps it gives up, and returns false, if the largest deviation is beyond what a success has
  /// been seen to come from.
  bool lower_sum(int steps, bool flip);
  /// Minimises the sum of deviations to the power of 24 by at most so many steps, and then of a still higher power,
  /// which lowers the largest one.
  void lower_largest(int steps);
  /// The same, but gives up like lower_sum(), for points that were added in a state that was enough without them.
  void try_lower_largest(int steps);
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

  /// Deviations up to this share of the tolerance are enough; the rest is for what the samples do not see.
  static constexpr double kEnough = 0.994;

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
  /// A point of a face and the point beyond it that it has to come near to.
  struct Term {
    std::uint32_t face;   ///< The face that is nearest to a point of the reference.
    glm::dvec3 weights;   ///< The barycentric coordinates of the point of the face.
    glm::dvec3 residual;  ///< From the point of the face to the other one.
    double square;        ///< The squared deviation, over the tolerance that the face may use.
  };

  void take_points_of_faces();
  double scale_of(std::uint32_t face) const;
  Term nearest(const glm::dvec3& point, std::uint32_t face, bool look_around) const;
  Term at(const glm::dvec3& point, std::uint32_t face) const;
  Term at(const glm::dvec3& point, std::uint32_t face, const glm::dvec3& a, const glm::dvec3& b,
          const glm::dvec3& c) const;
  Term toward_reference(const FacePoint& p) const;
  std::optional<glm::dvec3> nearest_admitted(const FacePoint& p, const glm::dvec3& x) const;
  FacePoint point_of(std::uint32_t face, const glm::dvec3& weights, double weight) const;
  FacePoint open_point_of(std::uint32_t face, const glm::dvec3& weights, double weight) const;
  Term into_half_space(const HeldPoint& p) const;
  glm::dvec3 place(const FacePoint& p) const;
  void evaluate(bool look_around, std::vector<Term>& terms) const;
  State sum(const std::vector<Term>& terms, int power) const;
  const FacePoint& face_point(std::size_t i) const {
    if (i < own_points_.size()) return own_points_[i];
    i -= own_points_.size();
    return i < added_points_.size() ? added_points_[i] : separations_[i - added_points_.size()].point;
  }
  double weight(std::size_t term) const {
    return term < points_.size() ? points_[term].weight : face_point(term - points_.size()).weight;
  }

  void minimise(int power, int steps, std::span<const double> give_up_above);
  void lower_largest(int steps, std::span<const double> give_up_above, std::span<const double> give_up_at_last);
  bool step(int power, bool look_around);
  void assemble(int power);
  bool solve();
  bool place_unturned(std::vector<glm::dvec3>& places);
  bool find_turned();
  bool flip_edges(int power);
  bool folds(const Patch::Flipped& flipped) const;
  double energy_if(const Patch::Flipped& flipped, int power, double limit) const;
  double energy_now(const Patch::Flipped& flipped, int power) const;

  const CertifiedBounds* bounds_;
  double unit2_;  ///< It is 1 / limit^2.
  Patch* patch_ = nullptr;
  std::vector<SurfaceSample> points_;                 ///< of the reference
  std::vector<FacePoint> own_points_, added_points_;  ///< Those of every vertex, edge and face; those that were added.
  std::vector<HeldPoint> separations_;
  std::vector<Term> terms_, tried_;     ///< Of points_, own_points_, added_points_ and separations_, in this order.
  std::vector<std::uint32_t> unknown_;  ///< For each vertex: its place among the free ones, or kNone.
  std::vector<std::uint32_t> free_;     ///< The free vertices.
  std::vector<double> matrix_, factor_, gradient_, move_;
  std::vector<glm::dvec3> before_, normals_, new_normals_;
  std::vector<bool> turned_;
  std::vector<std::vector<std::uint32_t>> points_of_;  ///< For each face: the points that are nearest to it.
  State now_;
  double damping_ = 0, overstep_ = 0;
  bool flips_ = false;  ///< Whether edges are flipped, too.
};

}  // namespace tolvol
