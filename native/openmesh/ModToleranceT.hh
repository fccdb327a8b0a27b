// SPDX-License-Identifier: GPL-3.0-or-later
/// A module for OpenMesh's decimaters that keeps the mesh within a tolerance of a reference, certified. It is the
/// header of tolvol::openmesh for other people's programs, in the style of OpenMesh's own modules.
#pragma once

#include <OpenMesh/Tools/Decimater/ModBaseT.hh>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "base/errors.h"
#include "check/certificate.h"
#include "check/tolerance_volume.h"

namespace tolvol {

/// Returns the space of an OpenMesh mesh, whose points are stored as they are in the world.
template <class Mesh>
StoredSpace space_of(const Mesh&) {
  constexpr bool kSingle = std::is_same_v<typename Mesh::Scalar, float>;
  return StoredSpace(glm::dmat4(1), kSingle ? Storage::float32 : Storage::float64);
}

template <class Point>
glm::dvec3 to_dvec3(const Point& p) {
  return {p[0], p[1], p[2]};
}

/// Returns the volume of all points within `tolerance`, in the mesh's units, of a triangle mesh as it is now. Throws
/// what ToleranceVolume throws.
template <class Mesh>
ToleranceVolume volume_of(const Mesh& mesh, double tolerance) {
  std::vector<glm::dvec3> vertices;
  for (const auto v : mesh.all_vertices()) vertices.push_back(to_dvec3(mesh.point(v)));
  std::vector<glm::uvec3> triangles;
  for (const auto f : mesh.faces()) {
    glm::uvec3& t = triangles.emplace_back();
    int k = 0;
    for (const auto v : mesh.fv_range(f)) t[k++] = static_cast<unsigned>(v.idx());
  }
  return ToleranceVolume(vertices, triangles, space_of(mesh), tolerance);
}

/// A binary module that forbids every half-edge collapse after which a face would not be proved to be within the
/// tolerance of the reference. So every point of the result is within it. The reference may be farther from the result;
/// for this direction tolvol::decimate has two_sided. Any number of runs with the same volume keep the one tolerance,
/// also with other modules and with other changes between them, which are checked too. About 1 us for each collapse
/// asked about.
template <class MeshT>
class ModToleranceT : public OpenMesh::Decimater::ModBaseT<MeshT> {
 public:
  DECIMATING_MODULE(ModToleranceT, MeshT, Tolerance);

  explicit ModToleranceT(MeshT& mesh) : Base(mesh, true) {}

  /// Keeps a reference to `volume`. Must be called before the decimater's initialize().
  void set_volume(const ToleranceVolume& volume) { volume_ = &volume; }

  /// Throws InvalidInput without a volume, for a mesh with points that are not finite or faces that are not within the
  /// tolerance, and if the mesh is too far from its origin for the tolerance.
  void initialize() override;
  float collapse_priority(const CollapseInfo& collapse) override;
  /// Collapses from now on keep within this share, 0 to 1, of the tolerance. Faces that are farther already stay.
  void set_error_tolerance_factor(double factor) override;

 private:
  void set_certificate();

  const ToleranceVolume* volume_ = nullptr;
  std::optional<StoredSpace> space_;
  double mapping_error_ = 0;
  std::optional<TriangleCertificate> certificate_;
};

template <class MeshT>
void ModToleranceT<MeshT>::initialize() {
  if (!volume_) throw InvalidInput("ModToleranceT needs a volume: call set_volume() before initialize()");
  const Mesh& mesh = Base::mesh();
  space_ = space_of(mesh).in(volume_->frame());
  std::vector<glm::dvec3> points;
  std::vector<std::uint32_t> indices, faces;
  for (const auto v : mesh.all_vertices()) points.push_back(to_dvec3(mesh.point(v)));
  for (const auto f : mesh.faces()) {
    faces.push_back(static_cast<std::uint32_t>(f.idx()));
    for (const auto v : mesh.fv_range(f)) indices.push_back(static_cast<std::uint32_t>(v.idx()));
  }
  mapping_error_ = space_->mapping_error(points);
  const std::vector<Verdict> verdicts = Certificate(*volume_).check({points, *space_, indices, 3}, {});
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (verdicts[i] == Verdict::inside) continue;
    throw InvalidInput("face " + std::to_string(faces[i]) + " is not within the tolerance of the reference; " +
                       "take a larger tolerance, or the volume of this mesh");
  }
  set_certificate();
}

template <class MeshT>
void ModToleranceT<MeshT>::set_certificate() {
  const double limit = volume_->provable(mapping_error_) * (1 - kHeadroom) * Base::error_tolerance_factor_;
  certificate_.emplace(volume_->witnesses(), volume_->grid(), volume_->hierarchy(), limit,
                       volume_->refutable(mapping_error_));
}

template <class MeshT>
float ModToleranceT<MeshT>::collapse_priority(const CollapseInfo& collapse) {
  const Mesh& mesh = Base::mesh();
  const auto in_frame = [&](auto vertex) { return space_->frame(to_dvec3(mesh.point(vertex))); };
  const glm::dvec3 kept = in_frame(collapse.v1), unknown(TriangleCertificate::kUnproved);
  for (const auto h : mesh.voh_range(collapse.v0)) {
    const auto face = mesh.face_handle(h);
    if (!face.is_valid() || face == collapse.fl || face == collapse.fr) continue;
    const glm::dvec3 corners[3] = {kept, in_frame(mesh.to_vertex_handle(h)),
                                   in_frame(mesh.to_vertex_handle(mesh.next_halfedge_handle(h)))};
    if (certificate_->bound(corners, unknown) == TriangleCertificate::kUnproved) return Base::ILLEGAL_COLLAPSE;
  }
  return Base::LEGAL_COLLAPSE;
}

template <class MeshT>
void ModToleranceT<MeshT>::set_error_tolerance_factor(double factor) {
  Base::set_error_tolerance_factor(factor);
  if (certificate_) set_certificate();
}

}  // namespace tolvol
