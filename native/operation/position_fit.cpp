// SPDX-License-Identifier: GPL-3.0-or-later
// Iteratively reweighted least squares for the p-norm of the deviations, p = 6 (for large p it tends to the minimax
// fit; C. L. Lawson, "Contributions to the theory of linear least maximum approximation", 1961). A point at barycentric
// weight beta of the moving corner follows a step s of that corner by beta s, so that a deviation r becomes |r - beta
// s|, linearised along r. Both directions are in it: pieces of the reference against the faces, points of the faces
// against the reference.
#include "operation/position_fit.h"

#include <cmath>
#include <limits>

#include "reference/closest_point.h"

namespace tolvol {
namespace {

constexpr double kDamping = 1e-3;    // of the trace: along directions that nothing determines the vertex stays
constexpr double kFaceShare = 0.1;   // of a face's area that each of its own points stands for
// Points of a face, as weights of the moving corner and, of what is left, of the corner after it.
constexpr double kFacePoints[][2] = {{1, 0},     {0.75, 0},  {0.75, 1},    {0.5, 0},     {0.5, 0.5},
                                     {0.5, 1},   {0.25, 0},  {0.25, 0.33}, {0.25, 0.67}, {0.25, 1}};

}  // namespace

void PositionFit::gather(const Change& change) {
  samples_.clear();
  const Coverage* const backward = mesh_->bounds().backward;
  if (!backward) return;
  for (const Coverage::Removed& r : change.removed()) backward->sample(r.id, stride_, samples_);
  for (const Coverage::Element& e : change.elements()) backward->sample(e.id, stride_, samples_);
}

PositionFit::Fit PositionFit::fit(const Change& change, const glm::dvec3& position) const {
  const TriangleCertificate& forward = *mesh_->bounds().forward;
  const std::vector<Coverage::Element>& elements = change.elements();
  const double unit2 = 1 / (forward.within() * forward.within());
  glm::dmat3 m(0);
  glm::dvec3 g(0);
  double energy = 0;
  const auto add = [&](const glm::dvec3& residual, double area, double beta) {
    const double d2 = glm::dot(residual, residual), relative2 = d2 * unit2, weight = area * relative2 * relative2;
    energy += weight * relative2;
    if (!(d2 > 0)) return;
    m += glm::outerProduct(residual, residual) * (weight * beta * beta / d2);
    g += residual * (weight * beta);
  };
  for (const Coverage::Sample& s : samples_) {
    double nearest = std::numeric_limits<double>::infinity(), beta = 0;
    glm::dvec3 residual(0);
    for (std::size_t i = 0; i < elements.size(); ++i) {
      const auto& c = elements[i].corners;
      const ClosestPoint q = closest_point(s.point, c[0], c[1], c[2]);
      if (!(q.distance_squared < nearest)) continue;
      nearest = q.distance_squared;
      residual = s.point - q.point;
      beta = elements[i].moved > 0 ? q.weights[change.faces()[i].corner] : 0;
    }
    add(residual, s.area, beta);
  }
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (!(elements[i].moved > 0)) continue;
    const auto& c = elements[i].corners;
    const int k = change.faces()[i].corner;
    const glm::dvec3 &p = c[k], &a = c[(k + 1) % 3], &b = c[(k + 2) % 3];
    const double area = 0.5 * kFaceShare * glm::length(glm::cross(a - p, b - p));
    for (const auto& [beta, along] : kFacePoints) {
      const glm::dvec3 x = beta * p + (1 - beta) * (along * a + (1 - along) * b);
      if (const auto q = forward.near(x)) add(*q - x, area, beta);
    }
  }
  const double trace = m[0][0] + m[1][1] + m[2][2];
  if (!(trace > 0)) return {energy, position};
  for (int i = 0; i < 3; ++i) m[i][i] += kDamping * trace;
  glm::dvec3 step = glm::inverse(m) * g;
  const double length = glm::length(step);
  if (length > forward.within()) step *= forward.within() / length;
  return {energy, position + step};
}

}  // namespace tolvol
