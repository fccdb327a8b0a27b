// SPDX-License-Identifier: GPL-3.0-or-later
// decimate_with_openmesh IN OUT TOLERANCE: OpenMesh's decimater, no point of the result farther than TOLERANCE from IN.
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <cstdlib>
#include <tolvol/openmesh/ModToleranceT.hh>

int main(int argc, char** argv) {
  using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;
  Mesh mesh;
  if (argc != 4 || !OpenMesh::IO::read_mesh(mesh, argv[1])) return EXIT_FAILURE;
  const tolvol::ToleranceVolume volume = tolvol::volume_of(mesh, std::atof(argv[3]));

  OpenMesh::Decimater::DecimaterT<Mesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;  // which edge goes first
  tolvol::ModToleranceT<Mesh>::Handle tolerance;           // which may go at all
  decimater.add(quadric);
  decimater.add(tolerance);
  decimater.module(quadric).unset_max_err();
  decimater.module(tolerance).set_volume(volume);
  decimater.initialize();
  decimater.decimate();

  mesh.garbage_collection();
  constexpr int kDigits = 9;  // hold a float32 exactly
  return OpenMesh::IO::write_mesh(mesh, argv[2], OpenMesh::IO::Options::Default, kDigits) ? EXIT_SUCCESS : EXIT_FAILURE;
}
