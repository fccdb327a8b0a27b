// SPDX-License-Identifier: GPL-3.0-or-later
/// A mesh with certified bounds of both directions, as a decimation holds it, whose reference has the same triangles.
#pragma once

#include <optional>
#include <vector>

#include "check/certificate.h"
#include "decimation/bounded_mesh.h"
#include "decimation/certified_bounds.h"
#include "geometry/weld.h"
#include "shapes.h"
#include "topology/manifold_cut.h"

namespace tolvol {

struct CertifiedMesh {
  /// The mesh has the reference's triangles and these positions, which are within the tolerance. The reference must be
  /// a manifold, sheets of which may touch.
  CertifiedMesh(const TriangleMesh& surface, const std::vector<glm::dvec3>& vertices, double tolerance,
                std::vector<bool> pinned = {}, std::vector<double> shares = {})
      : reference(surface) {
    volume.emplace(reference.vertices, reference.triangles, StoredSpace(glm::dmat4(1), Storage::float64), tolerance,
                   ToleranceVolume::Options{.precision = 8});
    space = StoredSpace(glm::dmat4(1), Storage::float64).in(volume->frame());
    const double limit = volume->provable(2 * space->mapping_error(vertices, volume->frame_tolerance()));
    certificate.emplace(volume->witnesses(), volume->grid(), volume->hierarchy(), limit, volume->frame_tolerance());
    coverage.emplace(volume->reference(), limit, reference.triangles.size());
    for (std::uint32_t i = 0; i < reference.triangles.size(); ++i) coverage->set_witness(i, i);
    BoundedMeshInput input;
    std::vector<glm::dvec3> positions;
    input.triangles = reference.triangles;
    input.mates = cut_to_manifold(reference.vertices, reference.triangles, team).mates;
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
      input.positions.push_back({vertices[v], space->frame(vertices[v])});
      positions.push_back(input.positions.back().position);
    }
    input.slots = weld_equal_positions(reference.vertices);
    input.pinned = pinned.empty() ? std::vector<bool>(vertices.size(), false) : std::move(pinned);
    input.shares = std::move(shares);
    input.store = [this](const glm::dvec3& p) {
      const glm::dvec3 stored = space->store(p);
      return VertexPosition{stored, space->frame(stored)};
    };
    bounds.emplace(CertifiedBounds::Directions{*certificate, &*coverage}, MeshView{reference.triangles, positions},
                   team);
    mesh.emplace(std::move(input), &*bounds, team);
  }

  /// The faces that are left, as they are stored.
  TriangleMesh now() const {
    TriangleMesh result;
    for (std::uint32_t v = 0; v < reference.vertices.size(); ++v) result.vertices.push_back(mesh->stored(v));
    for (std::uint32_t f = 0; f < reference.triangles.size(); ++f) {
      if (mesh->alive(f)) result.triangles.push_back(mesh->triangle(f));
    }
    return result;
  }

  Team team{1};
  TriangleMesh reference;
  std::optional<StoredSpace> space;
  std::optional<ToleranceVolume> volume;
  std::optional<TriangleCertificate> certificate;
  std::optional<Coverage> coverage;
  std::optional<CertifiedBounds> bounds;
  std::optional<BoundedMesh> mesh;
};

}  // namespace tolvol
