// SPDX-License-Identifier: GPL-3.0-or-later
// decimate IN OUT TOLERANCE writes as few triangles as the decimation finds, with no point of OUT farther than
// TOLERANCE from IN and no point of IN farther than TOLERANCE from OUT.
#include <tolvol/decimation/decimation.h>
#include <cstdlib>
#include <iostream>

#include "off.h"

int main(int argc, char** argv) try {
  if (argc != 4) throw std::runtime_error("usage: decimate IN OUT TOLERANCE");
  const tolvol::TriangleMesh mesh = read_off(argv[1]);
  const tolvol::StoredSpace space(glm::dmat4(1), tolvol::Storage::float64);
  const tolvol::ToleranceVolume volume(mesh.vertices, mesh.triangles, space, std::atof(argv[3]));

  const tolvol::DecimationResult result = tolvol::decimate(mesh.vertices, mesh.triangles, space, &volume, {});
  write_off(argv[2], {result.vertices, result.triangles});
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return EXIT_FAILURE;
}
