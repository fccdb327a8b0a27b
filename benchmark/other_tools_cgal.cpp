// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's decimation within a polyhedral envelope, as its example edge_collapse_envelope.cpp has it: as far as it goes.
//   other_tools_cgal IN OUT DISTANCE
// IN and OUT: the numbers of vertices and triangles (int64), coordinates (float64), corners (int32). Prints the
// processor seconds.

#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <vector>

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Polyhedral_envelope_filter.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

namespace simplification = CGAL::Surface_mesh_simplification;

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Filter = simplification::Polyhedral_envelope_filter<Kernel, simplification::Bounded_normal_change_filter<>>;

template <typename T>
std::vector<T> read(std::ifstream& in, std::size_t count) {
  std::vector<T> values(count);
  in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
  return values;
}

template <typename T>
void write(std::ofstream& out, const std::vector<T>& values) {
  out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

int main(int argc, char** argv) {
  if (argc != 4) return std::cerr << "other_tools_cgal IN OUT DISTANCE\n", 2;

  std::ifstream in(argv[1], std::ios::binary);
  const auto counts = read<std::int64_t>(in, 2);
  const auto coordinates = read<double>(in, 3 * counts[0]);
  const auto corners = read<std::int32_t>(in, 3 * counts[1]);
  if (!in) return std::cerr << argv[1] << " is too short\n", 2;

  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertices;
  for (std::size_t i = 0; i < coordinates.size(); i += 3)
    vertices.push_back(mesh.add_vertex({coordinates[i], coordinates[i + 1], coordinates[i + 2]}));
  for (std::size_t i = 0; i < corners.size(); i += 3)
    if (mesh.add_face(vertices[corners[i]], vertices[corners[i + 1]], vertices[corners[i + 2]]) == Mesh::null_face())
      return std::cerr << "not an orientable manifold\n", 1;

  const std::clock_t started = std::clock();
  const simplification::LindstromTurk_cost<Mesh> cost;
  const simplification::LindstromTurk_placement<Mesh> placement;
  const Filter filter(std::atof(argv[3]));
  const simplification::Count_stop_predicate<Mesh> stop(0);
  simplification::edge_collapse(mesh, stop, CGAL::parameters::get_cost(cost).filter(filter).get_placement(placement));
  const double seconds = static_cast<double>(std::clock() - started) / CLOCKS_PER_SEC;

  mesh.collect_garbage();
  std::vector<double> left;
  for (const auto vertex : mesh.vertices())
    for (int axis = 0; axis < 3; ++axis) left.push_back(mesh.point(vertex)[axis]);
  std::vector<std::int32_t> faces;
  for (const auto face : mesh.faces())
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face)))
      faces.push_back(static_cast<std::int32_t>(static_cast<std::size_t>(vertex)));
  std::ofstream out(argv[2], std::ios::binary);
  write<std::int64_t>(out, {static_cast<std::int64_t>(left.size() / 3), static_cast<std::int64_t>(faces.size() / 3)});
  write(out, left);
  write(out, faces);
  std::cout << seconds << '\n';
}
