// SPDX-License-Identifier: GPL-3.0-or-later
// All axes have the spacing h = tolerance / precision. The paper prints h = D / R as well, but its own grids (Table 1)
// follow h = epsilon / rho.
#include "field/distance_grid.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/errors.h"

namespace tolvol {
namespace {

// Where no precision is given, a grid has at most so many nodes per tolerance: a finer one costs time and saves the
// certificate none.
constexpr double kFinestPrecision = 1;
// The grid around a box smaller than a cell, which has 5 nodes along each axis, fits so many bytes.
constexpr std::size_t kLeastBudget = 4096;

// Returns node counts as doubles, because a precision far too fine must not overflow an integer before it is refused.
struct Layout {
  double h, band, x, y, z, pitch;
  double bytes() const { return pitch * y * z * (sizeof(float) + sizeof(std::uint32_t)); }
};

Layout layout(const Box& box, double tolerance, double precision) {
  const double h = tolerance / precision;
  // A point within the tolerance is less than (sqrt(3)/2) h from its nearest node, and all eight nodes of its cell are
  // within sqrt(3) h of it, so that with this band each of them has an id.
  const double band = tolerance + std::sqrt(3.0) * h;
  const glm::dvec3 n = glm::ceil((box.upper - box.lower + 2 * band) / h) + 1.0;
  return {h, band, n.x, n.y, n.z, std::ceil(n.x / DistanceGrid::kLanes) * DistanceGrid::kLanes};
}

}  // namespace

double precision_that_fits(const Box& box, double tolerance, double finest, std::size_t most) {
  double precision = finest;
  // This ends because a coarser grid has fewer nodes, down to the few of a band around a box smaller than a cell.
  while (layout(box, tolerance, precision).bytes() > static_cast<double>(std::max(most, kLeastBudget)))
    precision *= kCoarser;
  return precision;
}

DistanceGrid layout_grid(const Box& box, double tolerance, std::optional<double> precision, std::size_t most) {
  if (precision && !(*precision > 0 && std::isfinite(*precision))) {
    throw InvalidInput("the precision must be a positive number (grid nodes per tolerance)");
  }
  const Layout l =
      layout(box, tolerance, precision.value_or(precision_that_fits(box, tolerance, kFinestPrecision, most)));
  if (precision && l.bytes() > kGridBudget) {  // Without one, precision_that_fits() has chosen one that fits.
    std::ostringstream text;
    text << "a precision of " << *precision << " needs a grid of " << l.bytes() / (1 << 20) << " MB, the limit is "
         << (kGridBudget >> 20) << " MB; precision " << precision_that_fits(box, tolerance, *precision) << " fits";
    throw ResourceLimit(text.str());
  }
  DistanceGrid grid;
  grid.spacing = l.h;
  grid.band = l.band;
  grid.nodes = {static_cast<int>(l.x), static_cast<int>(l.y), static_cast<int>(l.z)};
  grid.pitch = static_cast<int>(l.pitch);
  const glm::dvec3 slack = l.h * glm::dvec3(grid.nodes - 1) - (box.upper - box.lower);
  grid.origin = box.lower - slack * 0.5;
  return grid;
}

}  // namespace tolvol
