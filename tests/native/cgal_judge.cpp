// SPDX-License-Identifier: GPL-3.0-or-later
// The largest distance of a point of one mesh to another, by CGAL, for tests/fuzz.py. Reads doubles: the number of
// triangles of either mesh, the error that is allowed, and nine coordinates for each triangle. Prints the distance.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Surface_mesh.h>

#include <array>
#include <cstdio>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

std::vector<double> read(std::size_t count) {
  std::vector<double> values(count);
  if (std::fread(values.data(), sizeof(double), count, stdin) != count)
    throw std::runtime_error("the input is too short");
  return values;
}

/// Every triangle with vertices of its own: a distance asks nothing of how they are connected, and so all meshes will
/// do.
Surface surface(std::size_t triangles) {
  Surface result;
  const std::vector<double> values = read(9 * triangles);
  for (std::size_t i = 0; i < triangles; ++i) {
    std::array<Surface::Vertex_index, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const double* p = values.data() + 9 * i + 3 * k;
      corners[k] = result.add_vertex({p[0], p[1], p[2]});
    }
    result.add_face(corners[0], corners[1], corners[2]);
  }
  return result;
}

}  // namespace

int main() {
  try {
    const std::vector<double> head = read(3);
    const Surface a = surface(static_cast<std::size_t>(head[0]));
    const Surface b = surface(static_cast<std::size_t>(head[1]));
    std::printf("%.17g\n",
                CGAL::Polygon_mesh_processing::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(a, b, head[2]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cgal_judge: %s\n", error.what());
    return 1;
  }
}
