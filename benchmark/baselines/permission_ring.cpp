// SPDX-License-Identifier: GPL-3.0-or-later
// Overlap of a triangle and a cell after M. Schwarz, H.-P. Seidel, Fast Parallel Surface and Solid Voxelization on
// GPUs, 2010: the box of the triangle, its plane, and its three projections, each as three half planes.
#include "baselines/permission_ring.h"

#include <algorithm>
#include <cmath>

#include "check/changed_faces.h"

namespace tolvol::baselines {
namespace {

/// A triangle counts as overlapping a cell if they are so near or nearer, in widths of a cell: rounding may hide that
/// they overlap.
constexpr double kSlack = 1e-9;

/// A projection of the triangle along an axis, as what the lowest corner (x, y) of a unit cell must fulfil to overlap
/// it: x * nx + y * ny + d >= 0 for each edge.
struct Projection {
  double nx[3], ny[3], d[3];

  Projection(const glm::dvec3 (&v)[3], const glm::dvec3& normal, int axis) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const double side = normal[axis] < 0 ? -1 : 1;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 edge = v[(k + 1) % 3] - v[k];
      nx[k] = -side * edge[j], ny[k] = side * edge[i];
      d[k] = -(nx[k] * v[k][i] + ny[k] * v[k][j]) + std::max(0.0, nx[k]) + std::max(0.0, ny[k]) +
             kSlack * (std::abs(nx[k]) + std::abs(ny[k]));
    }
  }
  bool overlaps(double x, double y) const {
    for (int k = 0; k < 3; ++k) {
      if (!(nx[k] * x + ny[k] * y + d[k] >= 0)) return false;
    }
    return true;
  }
  /// Narrows [first, last] to the x that overlap in row y.
  void narrow(double y, int& first, int& last) const {
    for (int k = 0; k < 3; ++k) {
      const double rest = ny[k] * y + d[k];
      if (nx[k] > 0) {
        first = static_cast<int>(std::max<double>(first, std::ceil(-rest / nx[k] - kSlack)));
      } else if (nx[k] < 0) {
        last = static_cast<int>(std::min<double>(last, std::floor(-rest / nx[k] + kSlack)));
      } else if (rest < 0) {
        last = first - 1;
      }
    }
  }
};

}  // namespace

bool permits(const PermissionGrid& grid, const glm::dvec3 (&corners)[3]) {
  glm::dvec3 v[3];
  Box box;
  for (int k = 0; k < 3; ++k) {
    if (!grid.permits(grid.cell_of(corners[k]))) return false;
    v[k] = (corners[k] - grid.origin()) / grid.spacing();
    box.add(v[k]);
  }
  const glm::ivec3 low(glm::floor(box.lower - kSlack)), high(glm::floor(box.upper + kSlack));
  const glm::dvec3 normal = glm::cross(v[1] - v[0], v[2] - v[0]), size = glm::abs(normal);
  const int z = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2), x = (z + 1) % 3,
            y = (z + 2) % 3;
  const Projection along[3] = {{v, normal, 0}, {v, normal, 1}, {v, normal, 2}};
  const double plane = glm::dot(normal, v[0]);
  glm::ivec3 cell;
  for (cell[y] = low[y]; cell[y] <= high[y]; ++cell[y]) {
    int first = low[x], last = high[x];
    along[z].narrow(cell[y], first, last);
    for (cell[x] = first; cell[x] <= last; ++cell[x]) {
      int bottom = low[z], top = high[z];
      if (size[z] > 0) {
        // Heights of the plane over the cell's square.
        const double middle = (plane - normal[x] * (cell[x] + 0.5) - normal[y] * (cell[y] + 0.5)) / normal[z];
        const double reach = 0.5 * (size[x] + size[y]) / size[z] + kSlack;
        bottom = static_cast<int>(std::max<double>(bottom, std::floor(middle - reach)));
        top = static_cast<int>(std::min<double>(top, std::floor(middle + reach)));
      }
      for (cell[z] = bottom; cell[z] <= top; ++cell[z]) {
        if (grid.permits(cell)) continue;
        if (along[x].overlaps(cell[y], cell[z]) && along[y].overlaps(cell[z], cell[x])) return false;
      }
    }
  }
  return true;
}

class PermissionRing::Asking final : public Trial {
 public:
  explicit Asking(const PermissionGrid& grid) : grid_(grid) {}
  bool accepts(const ChangedFaces& change) override {
    return std::ranges::all_of(change.elements(), [&](const Coverage::Element& face) {
      return face.moved == 0 || permits(grid_, face.corners);
    });
  }
  void commit(const ChangedFaces&) override {}

 private:
  const PermissionGrid& grid_;
};

std::unique_ptr<Bounds::Trial> PermissionRing::trial() { return std::make_unique<Asking>(*grid_); }

}  // namespace tolvol::baselines
