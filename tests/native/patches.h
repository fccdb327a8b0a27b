// SPDX-License-Identifier: GPL-3.0-or-later
/// Patches around a collapse in the middle of a grid, with the deviations of their points.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <vector>

#include "certified_mesh.h"
#include "decimation/change.h"
#include "decimation/refinement/patch.h"
#include "decimation/refinement/patch_deviations.h"
#include "decimation/refinement/surface_samples.h"

namespace tolvol::patches {

inline constexpr unsigned kSide = 10;
inline constexpr std::uint32_t kMiddle = (kSide / 2) * (kSide + 1) + kSide / 2;

/// Prepares a collapse into the middle of the grid, and takes the patch around it.
inline void gather(const BoundedMesh& mesh, Change& change, Patch& patch) {
  const auto h = mesh.connectivity().find_halfedge(BoundedMesh::handle(kMiddle - 1), BoundedMesh::handle(kMiddle));
  if (!change.prepare_collapse(h, mesh.vertex_position(kMiddle))) throw std::logic_error("no collapse");
  patch.gather(change, 2, true);
}

/// All faces of a patch, in order.
inline std::vector<std::uint32_t> faces_of(const Patch& patch) {
  std::vector<std::uint32_t> faces(patch.faces().size());
  std::iota(faces.begin(), faces.end(), 0u);
  return faces;
}

/// Flips each edge that the patch lets flip, of one face after the other.
inline void flip_all(Patch& patch, const std::vector<std::uint32_t>& faces) {
  for (const std::uint32_t f : faces) {
    for (int k = 0; k < 3; ++k) {
      Patch::Flipped flipped;
      if (patch.can_flip(f, k, flipped)) patch.flip(flipped);
    }
  }
}

/// Carries out in the mesh the collapse that a patch was taken around, and its flips. Returns whether the mesh allowed
/// each of them.
inline bool carry_out(BoundedMesh& mesh, Change& change, const Patch& patch) {
  mesh.apply(change);
  for (const Patch::Flip& flip : patch.flips()) {
    const auto h = mesh.connectivity().find_halfedge(BoundedMesh::handle(flip.from), BoundedMesh::handle(flip.to));
    if (!h.is_valid() || !change.prepare_flip(mesh.connectivity().edge_handle(h))) return false;
    mesh.apply(change);
  }
  return true;
}

/// A flat plate, which is its own reference. The free vertices of the patch are lifted by so many tolerances.
struct Plate {
  explicit Plate(double lift)
      : plate(flat(), flat().vertices, 0.02),
        change(*plate.mesh),
        unit(plate.certificate->limit()),
        deviations(*plate.bounds) {
    SurfaceSamples samples(*plate.mesh, plate.team);
    gather(*plate.mesh, change, patch);
    for (Patch::Vertex& v : patch.vertices()) {
      if (v.free) v.position.z += lift * unit;
    }
    deviations.start(patch);
    for (std::uint32_t f = 0; f < patch.faces().size(); ++f) deviations.add(samples.of(patch.faces()[f].id), f);
    for (const Coverage::Removed& r : change.removed()) deviations.add(samples.of(r.id), r.successor);
    deviations.renew();
  }
  static TriangleMesh flat() {
    TriangleMesh mesh = shapes::grid(kSide);
    for (glm::dvec3& p : mesh.vertices) p.z = 0;
    return mesh;
  }
  double height() const {
    double highest = 0;
    for (const Patch::Vertex& v : patch.vertices()) highest = std::max(highest, std::abs(v.position.z) / unit);
    return highest;
  }

  CertifiedMesh plate;
  Change change;
  Patch patch;
  double unit;
  PatchDeviations deviations;
};

/// A grid with a ridge along one diagonal of its squares. Its edges run along the ridge or, if `across`, are the other
/// diagonals. No vertex of the patch is free. The points are those of the ridge, of which one diagonal of each square
/// has all and the other one none.
struct Ridge {
  explicit Ridge(bool across)
      : mesh(surface(across), surface(across).vertices, 0.05), change(*mesh.mesh), deviations(*mesh.bounds) {
    gather(*mesh.mesh, change, patch);
    for (Patch::Vertex& v : patch.vertices()) v.free = false;
    deviations.start(patch);
    for (double t = -0.1; t <= 0.1; t += 0.01) {
      const glm::dvec3 middle = mesh.reference.vertices[kMiddle];
      deviations.add_reference_point(mesh.space->frame(glm::dvec3(middle.x + t, middle.y - t, 0)), 1, 0);
    }
    deviations.renew();
  }
  static TriangleMesh surface(bool across) {
    TriangleMesh ridge = shapes::grid(kSide);
    for (glm::dvec3& p : ridge.vertices)
      p.z = -0.7 * std::abs(p.x + p.y - ridge.vertices[kMiddle].x - ridge.vertices[kMiddle].y);
    if (across) return ridge;
    for (std::size_t i = 0; i + 1 < ridge.triangles.size(); i += 2) {
      // Both triangles of a square share the diagonal; the other diagonal replaces it.
      const glm::uvec3 a = ridge.triangles[i], b = ridge.triangles[i + 1];
      std::uint32_t apex_a = 0, apex_b = 0;
      for (int k = 0; k < 3; ++k) {
        if (a[k] != b.x && a[k] != b.y && a[k] != b.z) apex_a = a[k];
        if (b[k] != a.x && b[k] != a.y && b[k] != a.z) apex_b = b[k];
      }
      int k = 0;
      while (a[k] != apex_a) ++k;
      ridge.triangles[i] = {apex_a, a[(k + 1) % 3], apex_b};
      ridge.triangles[i + 1] = {apex_a, apex_b, a[(k + 2) % 3]};
    }
    return ridge;
  }

  CertifiedMesh mesh;
  Change change;
  Patch patch;
  PatchDeviations deviations;
};

}  // namespace tolvol::patches
