// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/moving_coverage.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "base/call.h"
#include "base/parallel.h"
#include "motion/selection.h"

namespace tolvol {
namespace {

/// A bound on the relative rounding of a step's length.
constexpr double kInflate = 0x1p-50;
/// A triangulation of a quad has this many triangles.
constexpr std::size_t kOfQuad = 2;
/// Motion divides pieces and seldom unites them. tidy() acts once there are kGrowth times as many pieces as at first
/// and kMorePieces more.
constexpr std::size_t kGrowth = 2, kMorePieces = 1000;

}  // namespace

MovingCoverage::MovingCoverage(MovingMesh& mesh, Progress* progress) : mesh_(&mesh) {
  if (progress) progress->begin("comparing");
  Found found = find_layers(progress);
  layers_ = std::move(found.layers);
  uncovered_ = found.uncovered;
  for (const std::uint32_t v : found.nearest) mesh_->freeze(v);
  nearest_faces_ = std::move(found.nearest_faces);
  std::ranges::sort(nearest_faces_);
  count_pieces();
}

/// Finds witnesses for the state, in every triangulation.
MovingCoverage::Found MovingCoverage::find_layers(Progress* progress) const {
  Found found;
  const std::span<const PieceTriangle> triangles = triangles_of(mesh_->corners());
  const std::size_t of_layer = std::min(triangles.size(), kOfQuad);
  for (std::size_t first = 0; first < triangles.size(); first += of_layer) {
    found.layers.push_back({triangles.subspan(first, of_layer),
                            Coverage(mesh_->volume().reference(), mesh_->limit(), of_layer * mesh_->face_count()),
                            {},
                            {}});
    found.layers.back().trial.look_for_failures(1);
    found.layers.back().trial.expect_many_elements(mesh_->threads());
    const double count = static_cast<double>(triangles.size());
    const Progress::Part part(progress, static_cast<double>(first) / count,
                              static_cast<double>(first + of_layer) / count);
    find_witnesses(found, progress);
  }
  return found;
}

/// Does so for the last of the layers.
void MovingCoverage::find_witnesses(Found& found, Progress* progress) const {
  Layer& layer = found.layers.back();
  const auto count = static_cast<std::uint32_t>(mesh_->volume().reference().triangles.size());
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < count; ++i) {
    poll_at(i);
    i < mesh_->face_count() && mesh_->is_own(i) ? layer.coverage.set_witness(i, i) : open.push_back(i);
  }
  if (open.empty()) return;
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
  const Coverage::Uncovered missing =
      layer.coverage.find_witnesses(open, elements, ids, mesh_->provable(), mesh_->threads(), progress);
  const FaceCount uncovered = FaceCount::of(missing.triangles);
  found.uncovered.faces = std::max(found.uncovered.faces, uncovered.faces);
  if (uncovered.first)
    found.uncovered.first = std::min(*uncovered.first, found.uncovered.first.value_or(*uncovered.first));
  for (const std::uint32_t element : missing.nearest) {
    for (int k = 0; k < 3; ++k) found.nearest.push_back(elements.triangles[element][k]);
    found.nearest_faces.push_back(element / static_cast<std::uint32_t>(layer.triangles.size()));
  }
}

void MovingCoverage::count_pieces() {
  pieces_ = 0;
  for (const Layer& layer : layers_) {
    for (std::uint32_t e = 0; e < layer.triangles.size() * mesh_->face_count(); ++e) {
      pieces_ += layer.coverage.piece_count(e);
    }
  }
  most_pieces_ = kGrowth * pieces_ + kMorePieces;
}

void MovingCoverage::tidy() {
  if (pieces_ > most_pieces_) renew();
}

void MovingCoverage::renew() {
  if (uncovered_.faces > 0) return;
  Found found = find_layers(nullptr);
  if (found.uncovered.faces == 0) layers_ = std::move(found.layers);
  count_pieces();
}

/// How far a point of a triangle of the face moves from the state to the trial at most.
double MovingCoverage::moved(std::uint32_t face, const PieceTriangle& triangle) const {
  const std::span<const std::uint32_t> corners = mesh_->corners_of(face);
  double step = 0;
  for (const std::uint8_t k : triangle) step = std::max(step, mesh_->step(corners[k]));
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

std::vector<std::uint32_t> MovingCoverage::failing_around(std::span<const std::uint32_t> vertices) {
  // Nearly always the pieces of a face go to faces that share a corner with it.
  std::vector<std::uint32_t> faces = mesh_->faces_around(corners_of(mesh_->faces_around(vertices)));
  std::ranges::sort(faces);
  std::vector<std::uint32_t> all;
  bool is_worn = false;
  for (Layer& layer : layers_) {
    const std::vector<std::uint32_t> failed = failing(layer, unsettled(layer, faces), Neighbours::only_take_pieces);
    all.insert(all.end(), failed.begin(), failed.end());
    is_worn = is_worn || is_worn_;
  }
  is_worn_ = is_worn;
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

std::vector<std::uint32_t> MovingCoverage::failing_replaced(std::span<const std::uint32_t> faces) {
  std::vector<std::uint32_t> nearest;
  std::size_t looked_at = 0;
  std::ranges::copy_if(faces, std::back_inserter(nearest), [&](std::uint32_t f) {
    poll_at(++looked_at);
    return std::ranges::binary_search(nearest_faces_, f);
  });
  if (!nearest.empty()) return nearest;
  for (Layer& layer : layers_) {
    std::vector<std::uint32_t> failed = failing(layer, faces, Neighbours::only_take_pieces, Chosen::are_replaced);
    if (!failed.empty()) return failed;
  }
  return {};
}

/// The faces that may lose a piece.
std::vector<std::uint32_t> MovingCoverage::unsettled(const Layer& layer, std::span<const std::uint32_t> faces) const {
  const auto of_face = static_cast<std::uint32_t>(layer.triangles.size());
  std::vector<std::uint8_t> chosen(faces.size(), 0);  // Threads would share bits.
  parallel_for(faces.size(), kManyAtOnce, mesh_->threads(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::uint32_t k = 0; k < of_face; ++k) {
        if (!layer.coverage.settles(of_face * faces[i] + k, moved(faces[i], layer.triangles[k]))) chosen[i] = 1;
      }
    }
  });
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (chosen[i]) result.push_back(faces[i]);
  }
  return result;
}

std::vector<std::uint32_t> MovingCoverage::corners_of(std::span<const std::uint32_t> faces) const {
  std::vector<std::uint32_t> vertices;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    poll_at(i + 1);  // A few faces need no poll.
    const std::span<const std::uint32_t> corners = mesh_->corners_of(faces[i]);
    vertices.insert(vertices.end(), corners.begin(), corners.end());
  }
  return vertices;
}

/// Tries to find witnesses for the pieces of these faces among all faces around them.
std::vector<std::uint32_t> MovingCoverage::failing(Layer& layer, std::span<const std::uint32_t> faces,
                                                   Neighbours neighbours, Chosen chosen) {
  const auto of_face = static_cast<std::uint32_t>(layer.triangles.size());
  std::vector<std::uint32_t> around = mesh_->faces_around(corners_of(faces));
  std::size_t compared = 0;
  std::sort(around.begin(), around.end(), [&](std::uint32_t a, std::uint32_t b) {
    poll_at(++compared);
    return a < b;
  });
  layer.elements.clear();
  for (const std::uint32_t f : around) {
    poll_at(layer.elements.size() / of_face + 1);
    const std::span<const std::uint32_t> corners = mesh_->corners_of(f);
    const bool loses = neighbours == Neighbours::lose_pieces || std::binary_search(faces.begin(), faces.end(), f);
    for (std::uint32_t k = 0; k < of_face; ++k) {
      const auto& [a, b, c] = layer.triangles[k];
      const std::uint32_t element = of_face * f + k;
      const double by =
          chosen == Chosen::are_replaced ? std::numeric_limits<double>::infinity() : moved(f, layer.triangles[k]);
      layer.elements.push_back(
          {element, {mesh_->trial(corners[a]), mesh_->trial(corners[b]), mesh_->trial(corners[c])}, loses ? by : 0});
    }
  }
  layer.trial.begin();
  layer.coverage.try_change(layer.elements, {}, layer.trial);
  std::vector<std::uint32_t> failed;
  is_worn_ = false;
  for (const Coverage::Failure& f : layer.trial.failed()) {
    is_worn_ = is_worn_ || f.part.cuts == kMostCuts;
    failed.push_back(layer.elements[f.element].id / of_face);
  }
  std::sort(failed.begin(), failed.end());
  failed.erase(std::unique(failed.begin(), failed.end()), failed.end());
  return failed;
}

void MovingCoverage::accept(std::span<const std::uint32_t> faces) {
  for (Layer& layer : layers_) {
    const auto of_face = static_cast<std::uint32_t>(layer.triangles.size());
    const auto count = [&] {
      std::size_t pieces = 0;
      for (const Coverage::Element& e : layer.elements) pieces += layer.coverage.piece_count(e.id);
      return pieces;
    };
    pieces_ -= count();
    layer.coverage.commit(layer.trial);
    pieces_ += count();
    std::vector<bool> is_tried(layer.elements.empty() ? 0 : mesh_->face_count(), false);
    for (const Coverage::Element& e : layer.elements) is_tried[e.id / of_face] = true;
    parallel_for(faces.size(), kManyAtOnce, mesh_->threads(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t f = faces[i];
        if (!is_tried.empty() && is_tried[f]) continue;
        for (std::uint32_t k = 0; k < of_face; ++k) layer.coverage.carry(of_face * f + k, moved(f, layer.triangles[k]));
      }
    });
  }
}

}  // namespace tolvol
