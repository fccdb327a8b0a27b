// SPDX-License-Identifier: GPL-3.0-or-later
/// Quadric error metric: the weighted sum of squared distances to planes. M. Garland, P. Heckbert, "Surface
/// simplification using quadric error metrics", 1997.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <optional>

namespace tolvol {

struct Quadric {
  // The quadric of p is p^T A p + 2 b^T p + c, where A is symmetric.
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  glm::dvec3 b{0};
  double c = 0;

  Quadric() = default;
  /// The quadric weight * (n . p + d)^2.
  Quadric(const glm::dvec3& n, double d, double weight)
      : xx(weight * n.x * n.x),
        xy(weight * n.x * n.y),
        xz(weight * n.x * n.z),
        yy(weight * n.y * n.y),
        yz(weight * n.y * n.z),
        zz(weight * n.z * n.z),
        b(weight * d * n),
        c(weight * d * d) {}

  Quadric& operator+=(const Quadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz, b += q.b, c += q.c;
    return *this;
  }

  double operator()(const glm::dvec3& p) const {
    return p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z)) + p.y * (yy * p.y + 2 * yz * p.z) + zz * p.z * p.z +
           2 * glm::dot(b, p) + c;
  }

  /// The point of the least value, where it is well determined.
  std::optional<glm::dvec3> minimiser() const {
    const double cxx = yy * zz - yz * yz, cxy = xz * yz - xy * zz, cxz = xy * yz - xz * yy;
    const double determinant = xx * cxx + xy * cxy + xz * cxz, trace = xx + yy + zz;
    // Below this the rounding of the largest axis hides the smallest one.
    constexpr double kSingular = 1e-7;
    if (!(determinant > kSingular * trace * trace * trace)) return std::nullopt;
    const double cyy = xx * zz - xz * xz, cyz = xy * xz - xx * yz, czz = xx * yy - xy * xy;
    return glm::dvec3(cxx * b.x + cxy * b.y + cxz * b.z, cxy * b.x + cyy * b.y + cyz * b.z,
                      cxz * b.x + cyz * b.y + czz * b.z) /
           -determinant;
  }
};

inline Quadric operator+(Quadric a, const Quadric& b) { return a += b; }

}  // namespace tolvol
