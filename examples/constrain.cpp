// SPDX-License-Identifier: GPL-3.0-or-later
// constrain IN OUT TOLERANCE smooths a mesh by moving each vertex towards the mean of its neighbours, with no point of
// OUT farther than TOLERANCE from IN.
#include <tolvol/motion/constrain.h>
#include <cstdlib>
#include <iostream>

#include "off.h"

int main(int argc, char** argv) try {
  if (argc != 4) throw std::runtime_error("usage: constrain IN OUT TOLERANCE");
  const tolvol::TriangleMesh mesh = read_off(argv[1]);
  const tolvol::StoredSpace space(glm::dmat4(1), tolvol::Storage::float64);
  const tolvol::ToleranceVolume volume(mesh.vertices, mesh.triangles, space, std::atof(argv[3]));
  std::vector<std::uint32_t> faces;
  for (const glm::uvec3& t : mesh.triangles) faces.insert(faces.end(), {t.x, t.y, t.z});

  std::vector<glm::dvec3> positions = mesh.vertices;
  for (int iteration = 0; iteration < 30; ++iteration) {
    std::vector<glm::dvec3> sums(positions.size());
    std::vector<double> counts(positions.size());
    for (const glm::uvec3& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) {
        sums[t[k]] += positions[t[(k + 1) % 3]] + positions[t[(k + 2) % 3]];
        counts[t[k]] += 2;
      }
    }
    std::vector<glm::dvec3> wish = positions;
    for (std::size_t v = 0; v < wish.size(); ++v) {
      if (counts[v] > 0) wish[v] = 0.5 * (positions[v] + sums[v] / counts[v]);
    }
    positions = tolvol::constrain(positions, wish, faces, 3, space, volume).vertices;  // instead of positions = wish
  }
  write_off(argv[2], {positions, mesh.triangles});
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return EXIT_FAILURE;
}
