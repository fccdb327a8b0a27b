// SPDX-License-Identifier: GPL-3.0-or-later
// Where the orientation of the reference is not consistent, the cut makes that of the mesh consistent. The triangles of
// a reference that is the mesh itself are turned along. Of another reference they stay as they are, so that the parts
// of the mesh over its reversed triangles are free of the rule, and counted.
#include "decimation/input_facing.h"

#include <limits>
#include <numbers>

#include "base/call.h"
#include "base/union_find.h"

namespace tolvol {
namespace {

constexpr std::size_t kBlock = 64;
constexpr double kUnknownBound = std::numeric_limits<double>::infinity();

/// For each triangle, the first triangle of its connected part.
std::vector<std::uint32_t> connected_parts(const CutMesh& cut) {
  UnionFind parts(cut.triangles.size());
  for (std::uint32_t side = 0; side < cut.mates.size(); ++side) {
    poll_at(side);
    if (cut.mates[side] != CutMesh::kNone) parts.join(side / 3, cut.mates[side] / 3);
  }
  std::vector<std::uint32_t> part(cut.triangles.size());
  for (std::uint32_t t = 0; t < part.size(); ++t) part[t] = parts.find(t);
  return part;
}

}  // namespace

void face_as_cut(const CutMesh& cut, const Hierarchy& hierarchy, Team& team, FacingRule& rule) {
  std::vector<bool> is_in_cut(rule.normals.size(), false), reversed(rule.normals.size(), false);
  for (std::uint32_t t = 0; t < cut.triangles.size(); ++t) {
    poll_at(t);
    const std::uint32_t input = cut.triangle_input[t];
    if (input >= is_in_cut.size()) continue;  // it is no triangle of the reference
    is_in_cut[input] = true, reversed[input] = cut.reversed[t];
  }
  for (std::size_t i = 0; i < is_in_cut.size(); ++i) {
    poll_at(i);
    if (!is_in_cut[i]) rule.normals[i] = glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  }
  rule.turn(reversed, hierarchy, team);
}

InputFacing face_as_reference(const CutMesh& cut, std::span<const glm::dvec3> positions,
                              const TriangleCertificate& certificate, const Hierarchy& hierarchy,
                              const FacingRule& rule, Team& team, CertifiedBounds& bounds, Progress* progress) {
  struct Place {
    double area = 0;  ///< Of the triangle, negative if all near it face against it, and 0 if some do and some do not.
    std::uint32_t below = CutMesh::kNone;  ///< The nearest triangle that faces as this one, or else the nearest one.
  };
  std::vector<Place> places(cut.triangles.size());
  team.run(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::uvec3& t = cut.triangles[i];
      const glm::dvec3 &a = positions[t.x], &b = positions[t.y], &c = positions[t.z];
      const glm::dvec3 centre = (a + b + c) * (1.0 / 3), normal = glm::cross(b - a, c - a);
      const auto nearest = [&](double sign) {
        return rule.nearest(hierarchy, centre, sign * normal, kSameSide, certificate.limit()).triangle;
      };
      const std::uint32_t along = nearest(1), against = nearest(-1);
      places[i].below = along != CutMesh::kNone ? along : against;
      if ((along == CutMesh::kNone) != (against == CutMesh::kNone)) {
        places[i].area = (along != CutMesh::kNone ? 1 : -1) * glm::length(normal);
      }
    }
  });
  const std::vector<std::uint32_t> part = connected_parts(cut);
  std::vector<double> area(part.size(), 0);
  for (std::size_t i = 0; i < part.size(); ++i) area[part[i]] += places[i].area;

  std::vector<std::uint32_t> all(part.size()), below(part.size());
  for (std::uint32_t f = 0; f < all.size(); ++f) {
    all[f] = f, below[f] = places[f].below;
    FaceRule of_face = bounds.rule(f);
    of_face.reversed = area[part[f]] < 0;
    bounds.set_rule(f, of_face);
  }
  return keep_angles(cut, positions, certificate, rule, all, team, bounds, progress, below);
}

InputFacing keep_angles(const CutMesh& cut, std::span<const glm::dvec3> positions,
                        const TriangleCertificate& certificate, const FacingRule& rule,
                        std::span<const std::uint32_t> faces, Team& team, CertifiedBounds& bounds, Progress* progress,
                        std::span<const std::uint32_t> hints) {
  std::vector<std::uint8_t> exceeds(faces.size(), 0);  // Threads would share bits.
  InputFacing found;
  found.proved.assign(cut.triangles.size(), 0);
  team.run(faces.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(faces.size()));
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t f = faces[i];
      const glm::uvec3& t = cut.triangles[f];
      const glm::dvec3 corners[3] = {positions[t.x], positions[t.y], positions[t.z]};
      const glm::uvec3 hint(hints.empty() ? CutMesh::kNone : hints[i], CutMesh::kNone, CutMesh::kNone);
      FaceRule of_face = bounds.rule(f);
      const auto prove = [&](double limit) -> std::optional<double> {
        of_face.limit = limit;
        bounds.set_rule(f, of_face);
        std::optional<Facing> question;
        bounds.start(f, corners, question);
        if (!question) return 0;
        if (certificate.verdict(corners, glm::dvec3(kUnknownBound), hint, &*question) != Verdict::inside) return {};
        bounds.note_face(f, {bounds.face_bound(f).distance, question->angle()});
        found.proved[f] = 1;
        return question->angle();
      };
      if (prove(rule.angle)) continue;
      exceeds[i] = 1;
      of_face.limit = least_limit(rule.angle, prove);
      bounds.set_rule(f, of_face);
    }
  });
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (exceeds[i]) found.exceeding.push_back(faces[i]);
  }
  return found;
}

}  // namespace tolvol
