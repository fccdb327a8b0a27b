// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/new_crossings.h"

#include <algorithm>

#include "topology/double_sheets.h"

namespace tolvol {

NewCrossings::NewCrossings(const MeshView& input, const MeshView& now, std::vector<Corners> fixed)
    : input_(input), now_(now), fixed_(std::move(fixed)), origins_(input.triangles.size() + fixed_.size()) {}

const std::vector<std::uint32_t>& NewCrossings::sheets() const {
  std::call_once(sheets_known_, [&] {
    sheets_ = double_sheets(input_.vertices, input_.triangles);
    sheets_.resize(face_count(), kNoSheet);
  });
  return sheets_;
}

std::vector<std::uint32_t> NewCrossings::origins_of(std::uint32_t face, std::span<const Removed> removed) const {
  std::vector<std::uint32_t> found;
  const auto add = [&](std::uint32_t i) {
    found.push_back(i);
    return true;
  };
  origins_.for_each(face, add);
  for (const Removed& r : removed) {
    if (r.successor == face) origins_.for_each(r.id, add);
  }
  return found;
}

/// Whether input faces of both crossed, or are of sheets that lie on each other.
bool NewCrossings::inherited(std::uint32_t a, std::uint32_t b, std::span<const Removed> removed) const {
  const std::vector<std::uint32_t> of_a = origins_of(a, removed), of_b = origins_of(b, removed);
  struct Input {
    std::uint32_t face;
    Corners corners;
    Box box;
  };
  const auto input = [&](std::uint32_t face) {
    const Corners corners = of(input_, face);
    return Input{face, corners, box_of(corners)};
  };
  std::vector<Input> inputs_of_b;
  inputs_of_b.reserve(of_b.size());
  for (const std::uint32_t face : of_b) inputs_of_b.push_back(input(face));
  const std::vector<std::uint32_t>& sheet = sheets();
  return std::ranges::any_of(of_a, [&](std::uint32_t face) {
    const Input one = input(face);
    return std::ranges::any_of(inputs_of_b, [&](const Input& other) {
      return (sheet[face] != kNoSheet && sheet[face] == sheet[other.face]) ||
             (meet(one.box, other.box) && faces_cross(one.corners, other.corners));
    });
  });
}

bool NewCrossings::none(const FaceTree& near, std::span<const Face> faces, std::span<const Removed> removed,
                        Trial& trial) const {
  Box all;
  trial.boxes_.clear(), trial.replaced_.clear();
  for (const Face& face : faces) {
    trial.boxes_.push_back(box_of(face.corners));
    all.add(trial.boxes_.back());
    trial.replaced_.push_back(face.id);
  }
  for (const Removed& r : removed) trial.replaced_.push_back(r.id);
  std::sort(trial.replaced_.begin(), trial.replaced_.end());
  trial.read_.add(all);

  for (const Face& face : faces) {
    if (is_degenerate(face.corners) && !is_degenerate(corners(face.id))) return false;
  }
  const auto crosses_any = [&](std::uint32_t other) {
    const Corners t = corners(other);
    const Box box = box_of(t);
    for (std::size_t i = 0; i < faces.size(); ++i) {
      if (meet(trial.boxes_[i], box) && faces_cross(faces[i].corners, t) && !inherited(faces[i].id, other, removed)) {
        return true;
      }
    }
    return false;
  };
  const auto stays = [&](std::uint32_t other) {
    return !std::binary_search(trial.replaced_.begin(), trial.replaced_.end(), other);
  };
  for (std::size_t i = 0; i < faces.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (meet(trial.boxes_[i], trial.boxes_[k]) && faces_cross(faces[i].corners, faces[k].corners) &&
          !inherited(faces[i].id, faces[k].id, removed)) {
        return false;
      }
    }
  }
  if (trial.met_last_ != kNone && stays(trial.met_last_) && crosses_any(trial.met_last_)) return false;
  trial.met_last_ = kNone;
  near.for_each_meeting(all, [&](std::uint32_t other) {
    if (stays(other) && crosses_any(other)) trial.met_last_ = other;
    return trial.met_last_ == kNone;
  });
  return trial.met_last_ == kNone;
}

bool NewCrossings::none(const FaceTree& near, std::span<const std::uint32_t> changed) const {
  return std::ranges::none_of(changed, [&](std::uint32_t face) {
    poll();
    const Corners own = corners(face);
    if (is_degenerate(own) && !is_degenerate(of(input_, face))) return true;
    bool crosses = false;
    near.for_each_meeting(box_of(own), [&](std::uint32_t other) {
      crosses = other != face && faces_cross(own, corners(other)) && !inherited(face, other, {});
      return !crosses;
    });
    return crosses;
  });
}

void NewCrossings::hand_over(std::span<const Removed> removed) {
  for (const Removed& r : removed) origins_.hand_over(r.id, r.successor);
}

}  // namespace tolvol
