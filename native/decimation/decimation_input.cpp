// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/decimation_input.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

#include "base/call.h"
#include "base/errors.h"
#include "check/input_checks.h"
#include "decimation/input_facing.h"
#include "topology/wedges.h"

namespace tolvol {
namespace {

void check(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const ToleranceVolume* volume,
           const DecimationOptions& options) {
  validate(vertices, triangles);
  if (!volume && options.target_triangles == 0) throw InvalidInput("without a volume a target is needed");
  if (!volume && options.baseline) throw InvalidInput("without a volume there is no tolerance for a baseline to keep");
  if (!options.locked.empty() && options.locked.size() != vertices.size()) {
    throw InvalidInput("locked must have one value for each vertex");
  }
  if (!options.shares.empty() && options.shares.size() != vertices.size()) {
    throw InvalidInput("shares must have one value for each vertex");
  }
  for (std::size_t i = 0; i < options.shares.size(); ++i) {
    if (!(options.shares[i] >= 0 && options.shares[i] <= 1)) {
      throw InvalidInput("shares must be from 0 to 1, that of vertex " + std::to_string(i) + " is not");
    }
  }
  require_normal_angle(options.max_normal_angle);
  if (options.cell && (!volume || !options.two_sided || options.baseline)) {
    throw InvalidInput("a cell needs a volume and two_sided=True");
  }
  if (!options.wedges.empty() && options.wedges.size() != 3 * triangles.size()) {
    throw InvalidInput("wedges must have one label for each corner of each triangle");
  }
}

}  // namespace

DecimationInput::DecimationInput(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                                 const StoredSpace& space, const ToleranceVolume* volume,
                                 const DecimationOptions& options, bool joins_t_junctions, Team& team,
                                 DecimationResult& report)
    : vertices_(vertices),
      input_triangles_(triangles),
      triangles_(triangles),
      wedges_(options.wedges),
      volume_(volume),
      options_(options),
      space_(space),
      report_(report) {
  check(vertices, triangles, volume, options);
  space_ = space.in(volume ? volume->frame() : own_frame());
  if (volume_ && !options_.baseline && input_begins_as_reference()) own_count_ = volume_->reference().triangles.size();
  cut_ = cut_to_manifold(vertices_, triangles_, team);
  const bool has_t_junctions = join_t_junctions(joins_t_junctions, team);
  positions_ = frame_positions();
  pin();
  hold_outside_cell();
  if (has_t_junctions) pin_t_junctions(team);
  if (std::none_of(cut_.triangles.begin(), cut_.triangles.end(), [&](const glm::uvec3& t) {
        return glm::cross(positions_[t.y] - positions_[t.x], positions_[t.z] - positions_[t.x]) != glm::dvec3(0);
      })) {
    throw InvalidInput("all faces are degenerate (segments or points): there is no surface to decimate",
                       "invalid_mesh");
  }
  if (volume_) bounds_ = set_bounds(team);
}

Frame DecimationInput::own_frame() const {
  const std::vector<bool> used = used_vertices(vertices_.size(), triangles_);
  Box world;
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    if (used[v]) world.add(space_.world(vertices_[v]));
  }
  return Frame(world);
}

void DecimationInput::pin() {
  pinned_.resize(cut_.vertex_input.size());
  for (std::size_t v = 0; v < pinned_.size(); ++v) pinned_[v] = cut_.cause[v] == CutCause::degenerate;
  if (options_.locked.empty()) return;
  for_holders([&](std::uint32_t of_input, std::uint32_t vertex) {
    if (options_.locked[of_input]) pin(vertex, "asked for");
  });
}

/// Vertices of faces that are not strictly inside the cell stay.
void DecimationInput::hold_outside_cell() {
  exempt_.assign(triangles_.size(), false);
  if (!options_.cell) return;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    const glm::uvec3& t = triangles_[i];
    const auto inside = [&](int k) { return strictly_inside(vertices_[t[k]], *options_.cell); };
    if (inside(0) && inside(1) && inside(2)) continue;
    exempt_[i] = true;
    reaches_out_of_cell_ = true;
    pin_corners(i, "outside the cell");
  }
}

/// Calls visit(input vertex, vertex of the manifold) for all vertices that hold an input vertex: the one that it
/// became, and those at its place in a face that stands in for a face that was dropped.
template <class Visit>
void DecimationInput::for_holders(Visit&& visit) const {
  for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
    if (cut_.input_vertex[i] != CutMesh::kNone) visit(i, cut_.input_vertex[i]);
  }
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const std::uint32_t held_by = cut_.stand_in[t];
    if (held_by == t || held_by == CutMesh::kNone) continue;
    for (int k = 0; k < 9; ++k) {
      const std::uint32_t dropped = triangles_[t][k / 3], held = triangles_[held_by][k % 3];
      if (vertices_[dropped] == vertices_[held] && cut_.input_vertex[held] != CutMesh::kNone) {
        visit(dropped, cut_.input_vertex[held]);
      }
    }
  }
}

void DecimationInput::pin(std::uint32_t vertex, const std::string& cause) {
  if (!pinned_[vertex]) ++report_.locked[cause];
  pinned_[vertex] = true;
}

/// Pins the vertices of an input triangle. Those of one that was dropped may be none of the manifold.
void DecimationInput::pin_corners(std::uint32_t triangle, const std::string& cause) {
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t v = cut_.input_vertex[triangles_[triangle][k]];
    if (v != CutMesh::kNone) pin(v, cause);
  }
}

bool DecimationInput::input_begins_as_reference() const {
  const TriangleMesh& reference = volume_->reference();
  const std::span<const glm::uvec3> own = input_triangles_;
  if (reference.vertices.size() != vertices_.size() || reference.triangles.size() > own.size()) return false;
  if (!std::equal(reference.triangles.begin(), reference.triangles.end(), own.begin())) return false;
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    if (space_.frame(vertices_[i]) != reference.vertices[i]) return false;
  }
  return true;
}

/// Whether a triangle that is none of the reference has an open edge.
bool DecimationInput::added_triangles_are_open() const {
  for (std::uint32_t side = 0; side < cut_.mates.size(); ++side) {
    if (parent(cut_.triangle_input[side / 3]) >= own_count_ && cut_.mates[side] == CutMesh::kNone) return true;
  }
  return false;
}

Bounds* DecimationInput::set_bounds(Team& team) {
  std::vector<glm::dvec3> used;
  used.reserve(cut_.vertex_input.size());
  for (const std::uint32_t i : cut_.vertex_input) used.push_back(vertices_[i]);
  if (const auto warning = storage_warning(*volume_, space_, used)) report_.warnings.push_back(*warning);
  // Vertices may end up anywhere in the volume.
  mapping_error_ = space_.mapping_error(used, 1 + volume_->frame_tolerance());
  const double provable = volume_->provable(mapping_error_), limit = provable * (1 - kHeadroom);
  if (options_.baseline) {
    options_.baseline->begin({positions_, cut_.triangles}, space_);
    report_.method = options_.baseline->method(), report_.renderer = options_.baseline->renderer();
    return options_.baseline;
  }
  const Certificate certificate(*volume_);
  report_.method = certificate.method(), report_.renderer = certificate.renderer();
  if (own_count_ > 0) {
    element_of_.assign(triangles_.size(), CutMesh::kNone);
    for (std::uint32_t t = 0; t < cut_.triangle_input.size(); ++t) element_of_[cut_.triangle_input[t]] = t;
  }
  forward_.emplace(volume_->witnesses(), volume_->grid(), volume_->hierarchy(), limit,
                   volume_->refutable(mapping_error_));
  CertifiedBounds::Directions directions{*forward_};
  if (options_.two_sided) {
    backward_.emplace(volume_->reference(), limit, cut_.triangles.size());
    directions.backward = &*backward_;
  } else {
    // Open edges of the reference that were closed are no boundary any more.
    const bool is_own_boundary = own_count_ > 0 && !added_triangles_are_open();
    boundary_.emplace(*volume_, cut_, positions_, is_own_boundary, limit, provable, team);
    if (boundary_->any()) {
      directions.boundary_forward = &boundary_->forward();
      directions.boundary_backward = &boundary_->backward();
    }
  }
  facing_ = facing_rule(*volume_, mapping_error_, options_.max_normal_angle, report_.warnings, team);
  if (facing_) {
    if (own_count_ > 0) face_as_cut(cut_, volume_->hierarchy(), team, *facing_);
    directions.facing = &*facing_;
  }
  std::vector<std::uint32_t> on_reference;
  if (own_count_ > 0) {
    on_reference = cut_.triangle_input;
    for (std::uint32_t& t : on_reference) t = is_of_reference(t) ? t : CutMesh::kNone;
  }
  certified_.emplace(directions, MeshView{cut_.triangles, positions_}, team, on_reference);
  // What is proved to face the reference is within the tolerance, and is not proved again.
  std::vector<std::uint8_t> proved;
  if (facing_ && own_count_ < triangles_.size()) proved = face(provable, team);
  certify_input(certificate, proved);
  // A face that is outside has no witness, and so no angle. It is counted as outside.
  std::erase_if(exceeding_, [&](std::uint32_t t) { return exempt_[cut_.triangle_input[t]]; });
  options_.two_sided ? cover(provable) : pin_boundary();
  return &*certified_;
}

/// Pins what may not move where the boundary alone proves the direction from the reference.
void DecimationInput::pin_boundary() {
  for (const std::uint32_t v : boundary_->uncertified()) pin(v, "boundary not near the reference's boundary");
  if (!boundary_->any()) return;
  // Edges that were cut count as boundary in the kernel, although they are none.
  for (std::uint32_t v = 0; v < cut_.cause.size(); ++v) {
    if (cut_.cause[v] == CutCause::non_manifold) pin(v, "non-manifold");
  }
  for (const std::uint32_t v : boundary_->strange()) pin(v, "non-manifold");
}

/// Finds how the triangles that are none of the reference face it. Returns for each triangle of the manifold whether it
/// is proved to be within the tolerance.
std::vector<std::uint8_t> DecimationInput::face(double provable, Team& team) {
  const TriangleCertificate start(volume_->witnesses(), volume_->grid(), volume_->hierarchy(), provable,
                                  volume_->refutable(mapping_error_));
  Progress* const progress = options_.progress;
  if (progress) progress->begin("checking");
  InputFacing found;
  if (own_count_ == 0) {
    found = face_as_reference(cut_, positions_, start, volume_->hierarchy(), *facing_, team, *certified_, progress);
  } else {
    std::vector<std::uint32_t> added;
    for (std::uint32_t t = 0; t < cut_.triangle_input.size(); ++t) {
      if (!is_of_reference(cut_.triangle_input[t])) added.push_back(t);
    }
    found = keep_angles(cut_, positions_, start, *facing_, added, team, *certified_, progress);
  }
  exceeding_ = std::move(found.exceeding);
  return std::move(found.proved);
}

/// Proves the triangles that are none of the reference. `proved`: for each triangle of the manifold, whether it is so;
/// empty if none is.
void DecimationInput::certify_input(const Certificate& certificate, std::span<const std::uint8_t> proved) {
  std::vector<std::uint8_t> is_proved(triangles_.size(), 0);
  for (std::uint32_t t = 0; t < proved.size(); ++t) is_proved[cut_.triangle_input[t]] = proved[t];
  std::vector<std::uint32_t> asked, indices;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    if (is_of_reference(i) || exempt_[i] || is_proved[i]) continue;
    const glm::uvec3& t = triangles_[i];
    asked.push_back(i);
    indices.insert(indices.end(), {t.x, t.y, t.z});
  }
  if (asked.empty()) return;
  const std::vector<Verdict> verdicts =
      certificate.check({vertices_, space_, indices}, {options_.threads, options_.progress});
  std::vector<bool> counted(input_triangles_.size(), false);
  for (std::size_t k = 0; k < asked.size(); ++k) {
    if (verdicts[k] == Verdict::inside) continue;
    const std::uint32_t i = asked[k];
    exempt_[i] = true;
    if (!counted[parent(i)]) {
      if (report_.outside.faces++ == 0) report_.outside.first = parent(i);
      counted[parent(i)] = true;
    }
    pin_corners(i, "outside the tolerance");
  }
  if (report_.outside.faces && options_.outside == Outside::error) refuse_outside(report_.outside);
}

/// Finds the first witnesses for every triangle of the reference.
void DecimationInput::cover(double provable) {
  if (own_count_ > 0) {
    for (std::uint32_t i = 0; i < own_count_; ++i) {
      if (!is_of_reference(i)) continue;
      const std::uint32_t element = element_of_[cut_.stand_in[i]];
      // What is set aside never changes and covers itself.
      if (element != CutMesh::kNone) backward_->set_witness(element, i);
    }
    if (joined_) cover_divided(provable);
    return;
  }
  TriangleMesh elements{positions_, cut_.triangles};
  std::vector<std::uint32_t> ids(cut_.triangles.size());
  for (std::uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
  for (const std::uint32_t i : cut_.aside) {
    elements.triangles.emplace_back(cut_.input_vertex[triangles_[i].x], cut_.input_vertex[triangles_[i].y],
                                    cut_.input_vertex[triangles_[i].z]);
    ids.push_back(CutMesh::kNone);
  }
  std::vector<std::uint32_t> all(volume_->reference().triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  if (options_.progress) options_.progress->begin("comparing");
  const Coverage::Uncovered found =
      backward_->find_witnesses(all, elements, ids, provable, options_.threads, options_.progress);
  if (options_.cell) return hold_near(found.in_part, elements, provable);
  report_.uncovered = FaceCount::of(found.triangles);
  if (report_.uncovered.faces) report_.warnings.push_back(take_uncovered(report_.uncovered, options_.outside));
  for (const std::uint32_t t : found.nearest) {
    for (int k = 0; k < 3; ++k) pin(elements.triangles[t][k], "outside the tolerance");
  }
}

/// Pins all faces that may cover a part of one of some pieces of the reference: those within the tolerance of them.
void DecimationInput::hold_near(std::span<const Part> pieces, const TriangleMesh& elements, double provable) {
  if (pieces.empty()) return;
  const Hierarchy hierarchy(elements);
  for (const Part& piece : pieces) {
    poll();
    const auto [centre, radius] = sphere_around({piece.corners[0], piece.corners[1], piece.corners[2]});
    hierarchy.for_each_within(centre, (provable + radius) * (1 + kHeadroom), [&](std::uint32_t near) {
      for (int k = 0; k < 3; ++k) pin(elements.triangles[near][k], "beside an uncovered part of the reference");
    });
  }
}

/// Finds the first witnesses for the triangles of the reference that were divided, among the pieces.
void DecimationInput::cover_divided(double provable) {
  TriangleMesh pieces{positions_, {}};
  std::vector<std::uint32_t> ids, divided;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    if (!joined_->is_piece[i]) continue;
    if (i < own_count_) divided.push_back(i);
    const std::uint32_t element = element_of_[cut_.stand_in[i]];
    if (element == CutMesh::kNone || parent(i) >= own_count_) continue;
    pieces.triangles.push_back(cut_.triangles[element]);
    ids.push_back(element);
  }
  const Coverage::Uncovered found =
      backward_->find_witnesses(divided, pieces, ids, provable, options_.threads, nullptr);
  report_.uncovered = FaceCount::of(found.triangles);
  if (report_.uncovered.faces) report_.warnings.push_back(take_uncovered(report_.uncovered, options_.outside));
  for (const std::uint32_t t : found.nearest) {
    for (int k = 0; k < 3; ++k) pin(pieces.triangles[t][k], "outside the tolerance");
  }
}

std::vector<glm::dvec3> DecimationInput::frame_positions() const {
  std::vector<glm::dvec3> positions;
  positions.reserve(cut_.vertex_input.size());
  for (const std::uint32_t i : cut_.vertex_input) positions.push_back(space_.frame(vertices_[i]));
  return positions;
}

std::vector<Corners> DecimationInput::faces_aside() const {
  std::vector<Corners> faces;
  faces.reserve(cut_.aside.size());
  for (const std::uint32_t i : cut_.aside) {
    const glm::uvec3& t = triangles_[i];
    faces.push_back({vertices_[t.x], vertices_[t.y], vertices_[t.z]});
  }
  return faces;
}

BoundedMeshInput DecimationInput::take_mesh() {
  BoundedMeshInput input;
  input.triangles = cut_.triangles;
  input.mates = std::move(cut_.mates);
  for (std::size_t v = 0; v < positions_.size(); ++v) {
    stored_.push_back(vertices_[cut_.vertex_input[v]]);
    input.positions.push_back({stored_[v], positions_[v]});
  }
  // What holds for a vertex holds for its copies.
  const std::vector<std::uint32_t>& slots = cut_.copies_of;
  std::vector<bool> pinned(positions_.size(), false);
  for (std::size_t v = 0; v < positions_.size(); ++v) pinned[slots[v]] = pinned[slots[v]] || pinned_[v];
  for (const std::uint32_t slot : slots) input.pinned.push_back(pinned[slot]);
  if (!options_.shares.empty()) {
    std::vector<double> shares(positions_.size(), 1);
    for_holders([&](std::uint32_t of_input, std::uint32_t vertex) {
      double& share = shares[slots[vertex]];
      share = std::min(share, options_.shares[of_input]);
    });
    for (const std::uint32_t slot : slots) input.shares.push_back(shares[slot]);
  }
  for (const CutCause cause : cut_.cause) input.joined.push_back(cause == CutCause::non_manifold);
  if (boundary_ && boundary_->any()) {
    for (const std::uint32_t v : boundary_->strange()) input.joined[v] = true;
  }
  input.slots = slots;
  if (!wedges_.empty()) {
    // Labels name wedges at one input vertex; vertices welded from several hold those of all of them.
    std::unordered_map<std::uint64_t, std::uint32_t> dense;
    for (std::uint32_t t = 0; t < cut_.triangles.size(); ++t) {
      poll_at(t);
      glm::uvec3 wedges;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t corner = input_corner(t, k);
        const std::uint64_t key =
            (static_cast<std::uint64_t>(triangles_[corner / 3][corner % 3]) << 32) | wedges_[corner];
        wedges[k] = dense.try_emplace(key, static_cast<std::uint32_t>(dense.size())).first->second;
      }
      input.wedges.push_back(wedges);
    }
    islands_ = island_labels(cut_.triangles, input.wedges);
  }
  // The assignment of {} would keep the memory.
  positions_ = std::vector<glm::dvec3>(), cut_.stand_in = std::vector<std::uint32_t>();
  if (options_.cell) input.cell = *options_.cell;
  input.subset = options_.placement == DecimationOptions::Placement::subset;
  input.store = [this](const glm::dvec3& p) {
    const glm::dvec3 stored = space_.store(p);
    return VertexPosition{stored, space_.frame(stored)};
  };
  return input;
}

}  // namespace tolvol
