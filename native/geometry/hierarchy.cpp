// SPDX-License-Identifier: GPL-3.0-or-later
// Searches a hierarchy; hierarchy_build.cpp builds it.
//
// Scaled coordinates are those of the mesh times a power of two, which is exact. Local coordinates are scaled
// coordinates minus the centre, each rounded once, so that the boxes can be float wherever the mesh lies; |x| <= 1 on
// the mesh. Boxes only decide which triangles are looked at. The distances come from the scaled corners in double.
//
// The margins are as follows. A box may be skipped only if none of its triangles can be within the bound, equality
// included, because ties go to the lower index. A local coordinate x has a relative error of at most 2^-53. The faces
// of the box and the two ends that stand for the point are rounded to float and moved away by 2.4e-7 |x| + 1e-37: 2^-24
// is for the rounding and one more for the movement, below 4 * 2^-24 = 2.38e-7. So the difference of the two is at most
// the true one before its own rounding of 2^-24. The square of the box distance exceeds the true one by less than 6
// roundings of 2^-24, 3.6e-7, and the bound is raised by 1e-6 before it becomes a float, which also covers that
// rounding and the difference of 1e-15 between a computed and a true distance. 1e-37 covers underflow, also if the
// processor flushes subnormal numbers to zero. Points beyond kFloatReach half sizes are compared in double, because
// there the spread of 2^-24 would exceed details of the mesh. The relative error of a squared box distance is then
// below 16 * 2^-53, against 1e-13. Points beyond kReach are moved towards the centre to that distance R for the search.
// If of two points of the mesh (half size 1) one is nearer as seen from there, it is nearer to the point itself too, up
// to 2 / R, which is below one rounding of the distance, R or more.
#include "geometry/hierarchy.h"

#include <algorithm>
#include <cmath>

#include "geometry/hub_slices.h"
#include "geometry/lengths.h"

namespace tolvol {

template <class Real>
void Hierarchy::box_distances(const Node& node, const Real (&from)[3], const Real (&to)[3], Real (&squared)[kWidth]) {
  const auto outside = [](Real below, Real above) {
    const Real larger = below > above ? below : above;
    return larger > 0 ? larger : Real(0);
  };
  for (int c = 0; c < kWidth; ++c) {
    const Real x = outside(Real(node.lower[0][c]) - to[0], from[0] - Real(node.upper[0][c]));
    const Real y = outside(Real(node.lower[1][c]) - to[1], from[1] - Real(node.upper[1][c]));
    const Real z = outside(Real(node.lower[2][c]) - to[2], from[2] - Real(node.upper[2][c]));
    squared[c] = x * x + y * y + z * z;
  }
}
template void Hierarchy::box_distances(const Node&, const float (&)[3], const float (&)[3], float (&)[kWidth]);
template void Hierarchy::box_distances(const Node&, const double (&)[3], const double (&)[3], double (&)[kWidth]);

bool Hierarchy::is_nearest_slice(const glm::dvec3& q, std::uint32_t place) const {
  if (slice_[place] == kNone) return true;
  const HubSlice& slice = slices_[slice_[place]];
  const Corners& t = corners_[place];
  const Legs legs(t, slice.hub);
  const glm::dvec3 weights = closest_point(q, t[0], t[1], t[2]).weights;
  const double at = weights[int(slice.hub + 1) % 3] * legs.b + weights[int(slice.hub + 2) % 3] * legs.c;
  return at >= slice.from * legs.longer() && at < slice.to * legs.longer();
}

const Hierarchy::AroundHub* Hierarchy::nearest_at_hub(std::uint32_t node, const glm::dvec3& q) const {
  if (around_.empty() || around_[node] == kNone) return nullptr;
  const AroundHub& around = hubs_[around_[node]];
  const glm::dvec3 way = q - around.hub;
  double most = 0;  // the largest dot product of `way` with what leads to another corner
  for (int k = 0; k < 3; ++k) most += std::max(way[k] * double(around.lower[k]), way[k] * double(around.upper[k]));
  return most < -corner_noise(std::max(largest(q), largest(centre_) + 1)) ? &around : nullptr;
}

glm::dvec3 Hierarchy::local(const glm::dvec3& p, bool& beyond_reach) const {
  const glm::dvec3 at = scaled(p) - centre_;
  const double farthest = largest(at);
  if (farthest <= kReach) return at;
  beyond_reach = true;
  const glm::dvec3 towards =
      0.5 * p - 0.5 * (centre_ / scale_);  // halved, because p or the difference may be near the largest double
  return towards * (kReach / largest(towards));
}

Hierarchy::Nearest Hierarchy::seen_from(const glm::dvec3& p, std::uint32_t triangle) const {
  // From far away the mesh is small, and only p might overflow.
  const double far = std::max(largest(p), std::numeric_limits<double>::min());
  const double scale = std::min(scale_, std::ldexp(1.0, -std::clamp(std::ilogb(far), -1000, 1000)));
  const double ratio = scale / scale_;
  const Corners& t = corners_[place_[triangle]];
  return unscaled(triangle, closest_point(p * scale, t[0] * ratio, t[1] * ratio, t[2] * ratio), scale);
}

template <int Count>
Hierarchy::Common Hierarchy::common_of(std::span<const glm::dvec3> points, double radius, double enough,
                                       std::uint32_t hint) const {
  std::array<glm::dvec3, Count> at, q;
  for (int i = 0; i < Count; ++i) {
    bool beyond_reach = false;
    at[i] = local(points[i], beyond_reach);
    q[i] = scaled(points[i]);
    if (!beyond_reach) continue;
    Common common{nearest(points[i]).triangle, 0};
    for (const glm::dvec3& p : points) {
      common.distance = std::max(common.distance, seen_from(p, common.triangle).distance);
    }
    return common.distance <= radius ? common : Common{};
  }
  std::uint32_t best = kNone;
  double bound = radius * scale_ * (radius * scale_) * (1 + 1e-12);
  double best_squared = bound;
  const double enough_squared = enough < 0 ? -1 : enough * scale_ * (enough * scale_);
  auto attempt = [&](std::uint32_t place) {
    const Corners& t = corners_[place];
    double squared = 0;
    for (int i = 0; i < Count; ++i) {
      squared = std::max(squared, closest_point(q[i], t[0], t[1], t[2]).distance_squared);
      if (squared > best_squared) return;
    }
    if (squared == best_squared && best != kNone && triangle_[place] > triangle_[best]) return;
    best = place;
    best_squared = squared;
    bound = squared <= enough_squared ? -1 : std::min(bound, squared);  // -1 ends the search
  };
  if (hint < place_.size()) attempt(place_[hint]);
  Common found;
  if (bound >= 0) found.nodes = static_cast<std::uint32_t>(walk<Count>(at, bound, attempt));
  if (best == kNone) return found;
  const double distance = std::sqrt(best_squared) / scale_;
  if (distance <= radius) found.triangle = triangle_[best], found.distance = distance;
  return found;
}

Hierarchy::Common Hierarchy::common(std::span<const glm::dvec3> points, double radius, double enough,
                                    std::uint32_t hint) const {
  if (triangle_.empty() || points.empty()) return {};
  switch (points.size()) {
    case 1:
      return common_of<1>(points, radius, enough, hint);
    case 2:
      return common_of<2>(points, radius, enough, hint);
    case 3:
      return common_of<3>(points, radius, enough, hint);
    default:
      return common_of<4>(points, radius, enough, hint);
  }
}

}  // namespace tolvol
