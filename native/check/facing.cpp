// SPDX-License-Identifier: GPL-3.0-or-later
// Rounding moves a corner by at most d, so that an edge of length l is wrong by at most e = 2 d + 24 u, u = 2^-53, with
// the subtraction. The cross product n of the edges p and q is then wrong by at most e (|p| + |q|) + e^2 and its own
// rounding of at most 3 u |p| |q| for each component, for which 24 u in e has room because edges are at most 6 long:
// the tolerance is at most the reference's diagonal, which is at most 2 in its frame. The normal is sure if this is at
// most kSureNormal |n|, which 4 e^2 (|p|^2 + |q|^2) <= kSureNormal^2 |n|^2 implies.
#include "check/facing.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/call.h"
#include "base/parallel.h"
#include "geometry/frame.h"

namespace tolvol {
namespace {

/// Bounds the rounding of the dot product of two unit vectors and of their lengths.
constexpr double kRounding = 32 * kUnitRoundoff;
/// The angle between two sure normals may be wrong by at most this, because each of them may be wrong.
constexpr double kBothNormals = 2.001 * kSureNormal;
/// A smaller difference to the least angle that can be proved of a face does not matter.
constexpr double kNearEnough = std::numbers::pi / 180;
/// A face that keeps no smaller angle than this one is free.
constexpr double kNearlyTurned = 0.99 * std::numbers::pi;
/// A thread takes so many triangles or nodes at once: about a millisecond of work between two polls.
constexpr std::size_t kBlock = 8192;

/// No dot product of a normal in a box is larger than this by more than kRounding.
double largest_dot(const RoundedBox& box, const glm::dvec3& normal) {
  const glm::dvec3 dots = glm::max(glm::dvec3(box.lower) * normal, glm::dvec3(box.upper) * normal);
  return dots.x + dots.y + dots.z;
}

/// The least cosine of two sure normals between which the angle is at most `limit`. It is rounded up to few digits, so
/// that every platform gets one result although their cosines differ in the last ones.
double least_cosine(double limit) {
  constexpr double kDigits = 0x1p40;
  return std::ceil((std::cos(std::max(limit - kBothNormals, 0.0)) + kRounding) * kDigits) / kDigits;
}

}  // namespace

std::optional<glm::dvec3> sure_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double error) {
  const glm::dvec3 p = b - a, q = c - a, n = glm::cross(p, q);
  const double e = 2 * error + 24 * kUnitRoundoff, n2 = glm::dot(n, n);
  // A comparison with NaN is false, so that NaN is not sure.
  const bool is_sure = n2 > 0 && 4 * e * e * (glm::dot(p, p) + glm::dot(q, q)) <= kSureNormal * kSureNormal * n2;
  if (!is_sure) return std::nullopt;
  return n * (1 / std::sqrt(n2));
}

double angle_bound(double cosine) {
  // With s = 1 - cos x the series x = sqrt(2 s) (1 + s / 12 + 3 s^2 / 160 + ...) has positive coefficients, so that
  // (x / sqrt(2 s) - 1) / s rises with s, from 1 / 12 to 0.11072 at a right angle. Beyond a right angle, the angle is
  // pi less the other one, which is at least the sum of these three terms.
  const double lowered = std::max(cosine - kRounding, -1.0);
  const double s = 1 - std::abs(lowered), root = std::sqrt(2 * s);
  const double exact =
      lowered >= 0 ? root * (1 + 0.11073 * s) : std::numbers::pi - root * (1 + s / 12 + 3 * s * s / 160) + kRounding;
  return exact + kBothNormals;
}

FacingRule::FacingRule(const TriangleMesh& reference, double reference_error, double mesh_error, double angle,
                       Team& team)
    : mesh_error(mesh_error), angle(angle), least_cosine(tolvol::least_cosine(angle)) {
  fill(normals, reference.triangles.size(), glm::dvec3(0));
  std::atomic<std::size_t> unsure_ones = 0;
  team.run(normals.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::size_t of_block = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const glm::uvec3& t = reference.triangles[i];
      const glm::dvec3 &a = reference.vertices[t.x], &b = reference.vertices[t.y], &c = reference.vertices[t.z];
      const std::optional<glm::dvec3> normal = sure_normal(a, b, c, reference_error);
      of_block += !normal && glm::cross(b - a, c - a) != glm::dvec3(0);
      normals[i] = normal.value_or(glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
    }
    unsure_ones += of_block;
  });
  unsure = unsure_ones;
}

void FacingRule::bound_normals(const Hierarchy& hierarchy, Team& team) {
  below_.assign(hierarchy.node_count(), {});
  team.run(below_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (auto node = static_cast<std::uint32_t>(begin); node < end; ++node) {
      Box box;
      hierarchy.for_each_child(
          node,
          [&](std::uint32_t triangle) {
            if (!std::isnan(normals[triangle].x)) box.add(normals[triangle]);
          },
          [](std::uint32_t) {});
      if (!box.empty()) below_[node].add(box.lower), below_[node].add(box.upper);
    }
  });
  for (std::uint32_t node = hierarchy.node_count(); node-- > 0;) {
    poll_at(node);
    hierarchy.for_each_child(
        node, [](std::uint32_t) {}, [&](std::uint32_t child) { below_[node].add(below_[child]); });
  }
}

void FacingRule::turn(const std::vector<bool>& reversed, const Hierarchy& hierarchy, Team& team) {
  bool any = false;
  for (std::size_t t = 0; t < reversed.size(); ++t) {
    poll_at(t);
    if (reversed[t]) normals[t] = -normals[t], any = true;
  }
  if (any) bound_normals(hierarchy, team);
}

Hierarchy::Nearest FacingRule::nearest(const Hierarchy& hierarchy, const glm::dvec3& p, const glm::dvec3& normal,
                                       double least, double radius, std::uint32_t hint, const Enough& enough) const {
  const auto accept = [&](std::uint32_t triangle) { return glm::dot(normals[triangle], normal) >= least; };
  const double scale = std::max(1.0, glm::length(normal)), scaled_least = least / scale;
  const glm::dvec3 scaled = normal / scale;
  const auto may_accept = [&](std::uint32_t node) { return may_face(node, scaled, scaled_least); };
  return hierarchy.nearest_if(p, accept, radius, hint, may_accept,
                              [&](std::uint32_t triangle) { return enough && enough(triangle); });
}

bool FacingRule::may_face(std::uint32_t node, const glm::dvec3& normal, double least) const {
  if (below_.empty()) return true;
  const RoundedBox& normals_below = below_[node];
  return !normals_below.empty() && largest_dot(normals_below, normal) >= least - kRounding;
}

Facing::Facing(const FacingRule& rule, const glm::dvec3& normal, double limit)
    : rule_(&rule),
      normal_(normal),
      limit_(limit),
      least_cosine_(limit == rule.angle ? rule.least_cosine : least_cosine(limit)) {}

bool start_facing(const FacingRule& rule, const FaceRule& of_face, const glm::dvec3 (&corners)[3],
                  std::optional<Facing>& facing) {
  if (!(of_face.limit < std::numbers::pi)) return true;
  const std::optional<glm::dvec3> normal = sure_normal(corners[0], corners[1], corners[2], rule.mesh_error);
  if (!normal) return of_face.may_be_unsure;
  facing.emplace(rule, of_face.reversed ? -*normal : *normal, of_face.limit);
  return true;
}

double least_limit(double angle, const std::function<std::optional<double>(double limit)>& prove) {
  std::optional<double> proved = prove(kNearlyTurned);
  if (!proved) return std::numbers::pi;
  // A search notes the angle of the witnesses that it happens to find. Those with less may be there, too.
  for (double least = angle; *proved - least > kNearEnough;) {
    const double tried = (least + *proved) / 2;
    if (const std::optional<double> found = prove(tried)) {
      proved = found;
    } else {
      least = tried;
    }
  }
  return *proved;
}

}  // namespace tolvol
