// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's judgement, for tests/fuzz.py and the benchmarks. All input is doubles.
// Without an argument it prints the largest distance of a point of one mesh to another. It reads the number of
// triangles of either mesh, the error that is allowed, and nine coordinates for each triangle. With the argument
// "crossings" it prints the number of pairs of faces that cross. It reads the numbers of vertices and of triangles,
// three coordinates for each vertex, and three indices for each triangle.
#include <cstdio>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "crossing_judge.h"
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

tolvol::TriangleMesh indexed_mesh() {
  const std::vector<double> head = read(2);
  const std::vector<double> coordinates = read(static_cast<std::size_t>(3 * head[0]));
  const std::vector<double> indices = read(static_cast<std::size_t>(3 * head[1]));
  tolvol::TriangleMesh mesh;
  for (std::size_t i = 0; i < coordinates.size(); i += 3) {
    mesh.vertices.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);
  }
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    mesh.triangles.emplace_back(indices[i], indices[i + 1], indices[i + 2]);
  }
  return mesh;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    if (count == 2 && std::string_view(arguments[1]) == "crossings") {
      std::printf("%zu\n", tolvol::crossings_by_cgal(indexed_mesh()).size());
      return 0;
    }
    const std::vector<double> head = read(3);
    const tolvol::TriangleMesh a = triangles(static_cast<std::size_t>(head[0]));
    const tolvol::TriangleMesh b = triangles(static_cast<std::size_t>(head[1]));
    std::printf("%.17g\n", tolvol::distance_by_cgal(a, b, head[2]));
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "cgal_judge: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cgal_judge: %s\n", error.what());
    return 1;
  }
}
