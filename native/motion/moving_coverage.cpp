// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/moving_coverage.h"

#include <algorithm>

#include "base/call.h"
#include "base/parallel.h"

namespace tolvol {
namespace {

/// A bound on the relative rounding of a step's length.
constexpr double kInflate = 0x1p-50;
/// The number of faces that a thread takes at a time, for work of about 10 ns each.
constexpr std::size_t kBlock = 1024;
/// A triangulation of a quad has this many triangles.
constexpr std::size_t kOfQuad = 2;

}  // namespace

MovingCoverage::MovingCoverage(MovingMesh& mesh, Progress* progress) : mesh_(&mesh) {
  const std::span<const PieceTriangle> triangles = triangles_of(mesh.corners());
  const std::size_t of_layer = std::min(triangles.size(), kOfQuad);
  for (std::size_t first = 0; first < triangles.size(); first += of_layer) {
    layers_.push_back({triangles.subspan(first, of_layer),
                       Coverage(mesh.volume().reference(), mesh.limit(), of_layer * mesh.face_count()),
                       {},
                       {}});
  }
  if (progress) progress->begin("comparing");
  for (Layer& layer : layers_) find_witnesses(layer, progress);
}

void MovingCoverage::find_witnesses(Layer& layer, Progress* progress) {
  const auto count = static_cast<std::uint32_t>(mesh_->volume().reference().triangles.size());
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < count; ++i) {
    poll_at(i);
    i < mesh_->face_count() && mesh_->is_own(i) ? layer.coverage.set_witness(i, i) : open.push_back(i);
  }
  if (open.empty()) return;
  if (mesh_->face_count() == 0) {
    uncovered_ = {open.size(), open.front()};
    return;
  }
  TriangleMesh elements;
  for (std::uint32_t v = 0; v < mesh_->vertex_count(); ++v) {
    // A vertex without faces may be anywhere.
    elements.vertices.push_back(mesh_->ring(v).empty() ? glm::dvec3(0) : mesh_->state(v));
  }
  std::vector<std::uint32_t> ids;
  for (std::uint32_t f = 0; f < mesh_->face_count(); ++f) {
    const std::span<const std::uint32_t> corners = mesh_->corners_of(f);
    for (const auto& [a, b, c] : layer.triangles) {
      ids.push_back(static_cast<std::uint32_t>(ids.size()));
      elements.triangles.emplace_back(corners[a], corners[b], corners[c]);
    }
  }
  const Hierarchy hierarchy(elements);
  std::vector<std::uint32_t> nearest;
  std::size_t uncovered = 0;
  for (std::size_t i = 0; i < open.size(); ++i) {
    poll_at(i);
    if (progress) progress->update(static_cast<double>(i) / static_cast<double>(open.size()));
    if (layer.coverage.find_witnesses(open[i], hierarchy, ids, mesh_->provable(), nearest)) continue;
    if (uncovered++ == 0) uncovered_.first = std::min(open[i], uncovered_.first.value_or(open[i]));
  }
  uncovered_.faces = std::max(uncovered_.faces, uncovered);
  for (const std::uint32_t element : nearest) {
    for (int k = 0; k < 3; ++k) mesh_->freeze(elements.triangles[element][k]);
  }
}

/// How far a point of the element moves from the state to the trial at most.
double MovingCoverage::moved(const Layer& layer, std::uint32_t element) const {
  const auto of_face = static_cast<std::uint32_t>(layer.triangles.size());
  const std::span<const std::uint32_t> corners = mesh_->corners_of(element / of_face);
  double step = 0;
  for (const std::uint8_t k : layer.triangles[element % of_face]) step = std::max(step, mesh_->step(corners[k]));
  return step * (1 + kInflate);
}

std::vector<std::uint32_t> MovingCoverage::failing(std::span<const std::uint32_t> faces) {
  for (Layer& layer : layers_) {
    std::vector<std::uint32_t> failed = failing(layer, unsettled(layer, faces), Neighbours::lose_pieces);
    if (!failed.empty()) return failed;
  }
  return {};
}

std::vector<std::uint32_t> MovingCoverage::still_failing(std::span<const std::uint32_t> failed) {
  for (Layer& layer : layers_) {
    std::vector<std::uint32_t> still = failing(layer, failed, Neighbours::only_take_pieces);
    if (!still.empty()) return still;
  }
  return {};
}

/// The faces that may lose a piece.
std::vector<std::uint32_t> MovingCoverage::unsettled(const Layer& layer, std::span<const std::uint32_t> faces) const {
  const auto of_face = static_cast<std::uint32_t>(layer.triangles.size());
  std::vector<std::uint8_t> chosen(faces.size(), 0);  // Threads would share bits.
  parallel_for(faces.size(), kBlock, mesh_->threads(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::uint32_t e = of_face * faces[i]; e < of_face * (faces[i] + 1); ++e) {
        if (!layer.coverage.settles(e, moved(layer, e))) chosen[i] = 1;
      }
    }
  });
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (chosen[i]) result.push_back(faces[i]);
  }
  return result;
}

/// Tries to find witnesses for the pieces of these faces among all faces around them.
std::vector<std::uint32_t> MovingCoverage::failing(Layer& layer, std::span<const std::uint32_t> faces,
                                                   Neighbours neighbours) {
  const auto of_face = static_cast<std::uint32_t>(layer.triangles.size());
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t f : faces) {
    const std::span<const std::uint32_t> corners = mesh_->corners_of(f);
    vertices.insert(vertices.end(), corners.begin(), corners.end());
  }
  std::vector<std::uint32_t> around = mesh_->faces_around(vertices);
  std::sort(around.begin(), around.end());
  layer.elements.clear();
  for (const std::uint32_t f : around) {
    const std::span<const std::uint32_t> corners = mesh_->corners_of(f);
    const bool loses = neighbours == Neighbours::lose_pieces || std::binary_search(faces.begin(), faces.end(), f);
    for (std::uint32_t k = 0; k < of_face; ++k) {
      const auto& [a, b, c] = layer.triangles[k];
      const std::uint32_t element = of_face * f + k;
      layer.elements.push_back({element,
                                {mesh_->trial(corners[a]), mesh_->trial(corners[b]), mesh_->trial(corners[c])},
                                loses ? moved(layer, element) : 0});
    }
  }
  layer.trial.begin();
  layer.trial.look_for_failures(1);
  layer.coverage.try_change(layer.elements, {}, layer.trial);
  std::vector<std::uint32_t> failed;
  for (const Coverage::Trial::Failure& f : layer.trial.failed()) {
    failed.push_back(layer.elements[f.element].id / of_face);
  }
  std::sort(failed.begin(), failed.end());
  failed.erase(std::unique(failed.begin(), failed.end()), failed.end());
  return failed;
}

void MovingCoverage::accept(std::span<const std::uint32_t> faces) {
  for (Layer& layer : layers_) {
    const auto of_face = static_cast<std::uint32_t>(layer.triangles.size());
    std::vector<bool> is_tried(mesh_->face_count(), false);
    for (const Coverage::Element& e : layer.elements) is_tried[e.id / of_face] = true;
    layer.coverage.commit(layer.trial);
    for (const std::uint32_t f : faces) {
      for (std::uint32_t e = of_face * f; !is_tried[f] && e < of_face * (f + 1); ++e) {
        layer.coverage.carry(e, moved(layer, e));
      }
    }
  }
}

}  // namespace tolvol
