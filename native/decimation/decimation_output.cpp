// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/decimation_output.h"

#include <algorithm>
#include <optional>
#include <string>

#include "base/call.h"
#include "base/union_find.h"
#include "decimation/certified_bounds.h"
#include "geometry/hierarchy.h"

namespace tolvol {
namespace {

class Output {
 public:
  Output(const DecimationInput& input, const BoundedMesh& mesh, DecimationResult& result)
      : input_(input), cut_(input.cut()), mesh_(mesh), result_(result), same_(cut_.vertex_input.size()) {
    for (std::uint32_t v = 0; v < cut_.vertex_input.size(); ++v) {
      same_.join(v, cut_.output_slot[v]), same_.join(v, mesh.survivor(v));
    }
  }

  void write() {
    // Result vertices are in the order of the input vertices that they continue.
    std::vector<std::uint32_t> order;
    std::vector<std::uint32_t> used(cut_.vertex_input.size(), CutMesh::kNone);
    // Copies that were several vertices of the input stay several, unless they have become one with the same vertex.
    std::vector<std::uint32_t> chosen(cut_.vertex_input.size(), CutMesh::kNone);
    const auto slot = [&](std::uint32_t v) {
      const std::uint32_t survivor = mesh_.survivor(v), same = same_.find(survivor), copy = mesh_.slot(survivor);
      if (chosen[same] == CutMesh::kNone) chosen[same] = same_.find(copy) == same ? copy : survivor;
      return chosen[same];
    };
    // Returns the vertex at corner k of a result triangle, in the corner order of the input triangle that it continues.
    const auto corner = [&](std::uint32_t input, std::uint32_t t, int k) {
      return slot(t == CutMesh::kNone ? cut_.input_vertex[input_.triangles()[input][k]]
                                      : mesh_.triangle(t)[input_.own_corner(t, k)]);
    };
    const auto use = [&](std::uint32_t s) {
      if (used[s] == CutMesh::kNone) used[s] = 0, order.push_back(s);
    };
    // Of input_.triangles(), and of the cut mesh or CutMesh::kNone.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> kept;
    for (std::uint32_t t = 0; t < cut_.triangles.size(); ++t) {
      if (mesh_.alive(t)) kept.emplace_back(cut_.triangle_input[t], t);
    }
    for (const std::uint32_t i : cut_.aside) kept.emplace_back(i, CutMesh::kNone);
    std::ranges::sort(kept, {}, [&](const auto& k) { return std::pair(input_.parent(k.first), k.first); });
    for (const auto& [input, t] : kept) {
      poll_at(order.size());
      for (int k = 0; k < 3; ++k) use(corner(input, t, k));
    }
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return cut_.vertex_input[a] < cut_.vertex_input[b]; });
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      const std::uint32_t v = order[i];
      used[v] = i;
      const std::uint32_t source = cut_.vertex_input[v];
      result_.vertex_source.push_back(source);
      result_.vertices.push_back(mesh_.stored(v));
    }
    for (const auto& [input, t] : kept) {
      glm::uvec3 triangle;
      for (int k = 0; k < 3; ++k) triangle[k] = used[corner(input, t, k)];
      result_.triangles.push_back(triangle);
      result_.triangle_source.push_back(input_.parent(input));
      kept_.push_back(t);
    }
    result_.vertex_map.assign(input_.vertices().size(), -1);
    for (std::size_t i = 0; i < input_.vertices().size(); ++i) {
      if (cut_.input_vertex[i] == CutMesh::kNone) continue;
      result_.vertex_map[i] = static_cast<std::int32_t>(used[slot(cut_.input_vertex[i])]);
    }
  }

  void take_attributes() {
    const glm::dmat3 unit(1);
    const std::vector<std::uint32_t>& islands = input_.islands();
    std::vector<std::uint32_t> any_corner(cut_.vertex_input.size(), CutMesh::kNone);
    for (std::uint32_t t = 0; t < cut_.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        std::uint32_t& corner = any_corner[cut_.triangles[t][k]];
        if (corner == CutMesh::kNone) corner = 3 * t + static_cast<std::uint32_t>(k);
      }
    }
    std::optional<Hierarchy> own;
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      poll_at(i);
      glm::uvec3 triangle(result_.triangle_source[i]);
      glm::dmat3 weights = unit;
      for (int k = 0; k < 3 && kept_[i] != CutMesh::kNone; ++k) {
        const std::uint32_t t = kept_[i];
        const int corner = input_.own_corner(t, k);
        const std::uint32_t v = mesh_.triangle(t)[corner];
        if (!mesh_.left_original(v)) {
          const bool is_own = input_.is_piece(cut_.triangle_input[t]) && cut_.triangles[t][corner] == v;
          const std::uint32_t source = !islands.empty() ? mesh_.corner_source(t, corner)
                                       : is_own         ? 3 * t + static_cast<std::uint32_t>(corner)
                                                        : any_corner[v];
          const std::uint32_t original = input_.input_corner(source / 3, static_cast<int>(source % 3));
          triangle[k] = input_.parent(original / 3);
          weights[k] = input_.weights_in_parent(original / 3)[static_cast<int>(original % 3)];
          continue;
        }
        const auto same_island = [&](std::uint32_t other) { return islands.empty() || islands[other] == islands[t]; };
        const glm::dvec3& p = mesh_.position(v);
        if (const ToleranceVolume* const volume = input_.own_volume()) {
          const Hierarchy::Nearest nearest = volume->hierarchy().nearest_if(p, [&](std::uint32_t i) {
            return input_.element_of()[i] != CutMesh::kNone && same_island(input_.element_of()[i]);
          });
          triangle[k] = nearest.triangle;
          weights[k] = nearest.weights;
          continue;
        }
        if (!own) own.emplace(input_.frame_mesh());
        const Hierarchy::Nearest nearest = own->nearest_if(p, same_island);
        const std::uint32_t source = cut_.triangle_input[nearest.triangle];
        glm::dvec3 own = nearest.weights;
        if (cut_.reversed[nearest.triangle]) std::swap(own.y, own.z);
        triangle[k] = input_.parent(source);
        weights[k] = input_.weights_in_parent(source) * own;
      }
      result_.source_triangle.push_back(triangle);
      result_.source_weights.push_back(weights);
    }
  }

  void report() {
    const auto repair = [&](std::size_t count, const char* kind, const char* message) {
      if (count) result_.repairs.push_back({kind, count, std::to_string(count) + " " + message});
    };
    repair(cut_.duplicates, "duplicate", "exact duplicate faces dropped");
    repair(cut_.degenerate_on_edge, "degenerate", "degenerate faces on an edge of another face dropped");
    repair(cut_.aside.size(), "kept_degenerate", "degenerate faces kept as they are");
    repair(input_.joined_count(), "T-junction", "vertices put into the edges and faces that they lie on");
    repair(cut_.welded, "welded", "vertices at exactly the position of another stay with it");
    repair(cut_.cut_edges, "cut", "non-manifold edges, which collapse along themselves alone");
    repair(cut_.reversed_count, "misoriented", "faces against their neighbours' orientation, kept so");
    repair(cut_.double_sheet_faces, "double_sheet", "faces that lie exactly on another face, which they may cross");
    std::size_t unused = 0;
    for (const std::uint32_t v : cut_.input_vertex) unused += v == CutMesh::kNone;
    repair(unused, "unused", "vertices that no face uses are not part of the result");
    report_normals();
    for (const CutCause cause : cut_.cause) {
      if (cause == CutCause::degenerate) ++result_.locked["degenerate face"];
    }
  }

 private:
  void report_normals() {
    const CertifiedBounds* const bounds = mesh_.certified();
    if (!bounds || !input_.facing()) return;
    Normals normals;
    std::optional<double> largest;
    for (std::uint32_t t = 0; t < cut_.triangles.size(); ++t) {
      poll_at(t);
      if (!mesh_.alive(t) || bounds->rule(t).limit > input_.facing()->angle) continue;
      const glm::uvec3& corners = mesh_.triangle(t);
      std::optional<Facing> facing;
      bounds->start(t, {mesh_.position(corners.x), mesh_.position(corners.y), mesh_.position(corners.z)}, facing);
      if (facing) {
        largest = std::max(largest.value_or(0), bounds->face_bound(t).angle);
      } else {
        ++normals.unsure;
      }
    }
    // The conversion to degrees must not round the bound above the option.
    if (largest) normals.largest = std::min(glm::degrees(*largest), input_.max_normal_angle());
    normals.exceeded_before = input_.exceeding().size();
    for (const std::uint32_t t : input_.exceeding()) normals.exceeded_after += mesh_.alive(t);
    result_.normals = normals;
  }

  const DecimationInput& input_;
  const CutMesh& cut_;
  const BoundedMesh& mesh_;
  DecimationResult& result_;
  UnionFind same_;                   ///< Holds the vertices of the cut mesh that are one vertex of the result.
  std::vector<std::uint32_t> kept_;  ///< For each result triangle: its triangle in the cut mesh.
};

}  // namespace

void write_result(const DecimationInput& input, const BoundedMesh& mesh, DecimationResult& result) {
  Output output(input, mesh, result);
  output.write();
  output.take_attributes();
  output.report();
}

}  // namespace tolvol
