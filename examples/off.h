// SPDX-License-Identifier: GPL-3.0-or-later
/// Triangle meshes in OFF files, for the examples.
#pragma once

#include <tolvol/geometry/triangle_mesh.h>
#include <fstream>
#include <iomanip>
#include <stdexcept>
#include <string>

inline tolvol::TriangleMesh read_off(const std::string& path) {
  std::ifstream file(path);
  std::string word;
  std::size_t vertices = 0, triangles = 0, edges = 0, corners = 0;
  file >> word >> vertices >> triangles >> edges;
  if (!file || word != "OFF") throw std::runtime_error(path + " is not an OFF file");
  tolvol::TriangleMesh mesh{std::vector<glm::dvec3>(vertices), std::vector<glm::uvec3>(triangles)};
  for (glm::dvec3& p : mesh.vertices) file >> p.x >> p.y >> p.z;
  for (glm::uvec3& t : mesh.triangles) {
    file >> corners >> t.x >> t.y >> t.z;
    if (corners != 3) throw std::runtime_error(path + " has faces that are not triangles");
  }
  if (!file) throw std::runtime_error(path + " ends too soon");
  return mesh;
}

/// Writes 17 digits, which hold a double exactly.
inline void write_off(const std::string& path, const tolvol::TriangleMesh& mesh) {
  std::ofstream file(path);
  file << "OFF\n" << mesh.vertices.size() << ' ' << mesh.triangles.size() << " 0\n" << std::setprecision(17);
  for (const glm::dvec3& p : mesh.vertices) file << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const glm::uvec3& t : mesh.triangles) file << "3 " << t.x << ' ' << t.y << ' ' << t.z << '\n';
  if (!file.flush()) throw std::runtime_error(path + " cannot be written");
}
