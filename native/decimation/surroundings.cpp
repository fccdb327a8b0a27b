// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/surroundings.h"

#include <limits>
#include <numeric>

#include "base/call.h"

namespace tolvol {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

std::vector<std::uint32_t> all_faces(const NewCrossings& crossings) {
  std::vector<std::uint32_t> faces(crossings.face_count());
  std::iota(faces.begin(), faces.end(), 0u);
  return faces;
}

}  // namespace

Surroundings::Surroundings(const BoundedMesh& mesh, NewCrossings& crossings, Team& team)
    : Surroundings(mesh, crossings, all_faces(crossings), {glm::dvec3(-kFar), glm::dvec3(kFar)}) {
  renew(team);
}

Surroundings::Surroundings(const BoundedMesh& mesh, NewCrossings& crossings, std::vector<std::uint32_t> faces,
                           const Box& cell)
    : mesh_(mesh), crossings_(crossings), faces_(std::move(faces)), cell_(cell) {}

void Surroundings::renew() {
  Team alone(1);
  renew(alone);
}

void Surroundings::renew(Team& team) {
  std::vector<std::uint32_t> alive;
  std::vector<std::uint8_t> hubs;
  for (const std::uint32_t face : faces_) {
    poll_at(face);
    const bool is_fixed = face >= mesh_.connectivity().n_faces();
    if (!is_fixed && !mesh_.alive(face)) continue;
    alive.push_back(face);
    const auto faces_around = [&](std::uint32_t v) { return mesh_.faces_around(v); };
    hubs.push_back(is_fixed ? NearFaces::kNoHub : NearFaces::hub_of(mesh_.triangle(face), faces_around));
  }
  near_ = NearFaces(
      alive, [&](std::size_t i) { return crossings_.corners(alive[i]); }, hubs, team);
}

/// The faces that get another shape. One that moves by nothing may still have another vertex for a corner.
void Surroundings::gather(const Change& change, Trial& trial) const {
  trial.faces.clear();
  for (std::size_t i = 0; i < change.faces().size(); ++i) {
    const Change::Face& face = change.faces()[i];
    const std::uint32_t id = change.elements()[i].id;
    Corners corners;
    for (int k = 0; k < 3; ++k) corners[k] = mesh_.stored(face.vertices[k]);
    if (face.moves) corners[face.corner] = change.position().stored;
    if (corners != crossings_.corners(id)) trial.faces.push_back({id, corners});
  }
  gather_removed(change, trial.removed);
}

bool Surroundings::allow(const Change& change, Trial& trial) const {
  gather(change, trial);
  return allow(trial);
}

Box Surroundings::follow(const Change& change, Trial& trial) {
  gather(change, trial);
  return follow(trial);
}

Box Surroundings::follow(const Trial& trial) {
  Box all;
  for (const NewCrossings::Face& face : trial.faces) {
    const Box box = box_of(face.corners);
    all.add(box), all.add(box_of(crossings_.corners(face.id)));
    near_.change(face.id, face.corners);
  }
  for (const NewCrossings::Removed& r : trial.removed) {
    all.add(box_of(crossings_.corners(r.id))), all.add(box_of(crossings_.corners(r.successor)));
    near_.remove(r.id);
  }
  crossings_.hand_over(trial.removed, trial.crossings.given());
  return all;
}

void gather_removed(const Change& change, std::vector<NewCrossings::Removed>& removed) {
  removed.clear();
  for (const Coverage::Removed& r : change.removed()) removed.push_back({r.id, change.elements()[r.successor].id});
}

}  // namespace tolvol
