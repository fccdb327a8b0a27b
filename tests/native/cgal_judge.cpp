// SPDX-License-Identifier: GPL-3.0-or-later
// The largest distance of a point of one mesh to another, by CGAL, for tests/fuzz.py. Reads doubles: the number of
// triangles of either mesh, the error that is allowed, and nine coordinates for each triangle. Prints the distance.
#include <cstdio>
#include <stdexcept>
#include <vector>

#include "distance_judge.h"

namespace {

std::vector<double> read(std::size_t count) {
  std::vector<double> values(count);
  if (std::fread(values.data(), sizeof(double), count, stdin) != count)
    throw std::runtime_error("the input is too short");
  return values;
}

tolvol::TriangleMesh triangles(std::size_t count) {
  const std::vector<double> values = read(9 * count);
  tolvol::TriangleMesh mesh;
  for (std::size_t i = 0; i < values.size(); i += 3) {
    mesh.vertices.emplace_back(values[i], values[i + 1], values[i + 2]);
  }
  for (std::uint32_t i = 0; i < mesh.vertices.size(); i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
  return mesh;
}

}  // namespace

int main() {
  try {
    const std::vector<double> head = read(3);
    const tolvol::TriangleMesh a = triangles(static_cast<std::size_t>(head[0]));
    const tolvol::TriangleMesh b = triangles(static_cast<std::size_t>(head[1]));
    std::printf("%.17g\n", tolvol::distance_by_cgal(a, b, head[2]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cgal_judge: %s\n", error.what());
    return 1;
  }
}
