// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/input_crossings.h"

#include <algorithm>
#include <numeric>

#include "topology/double_sheets.h"

namespace tolvol {

void InputCrossings::find_sheets() const {
  std::call_once(sheets_known_, [&] {
    sheets_ = double_sheets(input_.vertices, input_.triangles);
    sheets_.resize(face_count(), kNoSheet);
  });
}

bool InputCrossings::are_of_one_sheet(std::uint32_t a, std::uint32_t b) const {
  // A face of a double sheet crosses the one that lies on it, so that a mesh without crossings needs no sheets.
  if (!crosses_another(a) || !crosses_another(b)) return false;
  find_sheets();
  return sheets_[a] != kNoSheet && sheets_[a] == sheets_[b];
}

bool InputCrossings::crossed(std::uint32_t a, std::uint32_t b) const {
  const Corners one = corners(a), other = corners(b);
  return meet(box_of(one), box_of(other)) && faces_cross(one, other) && !are_of_one_sheet(a, b);
}

bool InputCrossings::any_crossed(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) const {
  std::vector<std::uint32_t> some_a(a.begin(), a.end()), some_b(b.begin(), b.end());
  keep_crossing(some_a);
  if (some_a.empty()) return false;
  keep_crossing(some_b);
  if (some_b.empty()) return false;
  struct Input {
    std::uint32_t face;
    Corners corners;
    Box box;
  };
  const auto input = [&](std::uint32_t face) {
    const Corners all = corners(face);
    return Input{face, all, box_of(all)};
  };
  std::vector<Input> others;
  others.reserve(some_b.size());
  for (const std::uint32_t face : some_b) others.push_back(input(face));
  std::size_t turn = 0;
  return std::ranges::any_of(some_a, [&](std::uint32_t face) {
    const Input one = input(face);
    return std::ranges::any_of(others, [&](const Input& other) {
      poll_at(++turn);
      return meet(one.box, other.box) && faces_cross(one.corners, other.corners) && !are_of_one_sheet(face, other.face);
    });
  });
}

void InputCrossings::keep_crossing(std::vector<std::uint32_t>& faces) const {
  std::erase_if(faces, [&](std::uint32_t face) { return !crosses_another(face); });
}

bool InputCrossings::crosses_another(std::uint32_t face) const {
  std::call_once(states_ready_, [&] { state_ = std::vector<std::atomic<std::uint8_t>>(face_count()); });
  std::uint8_t state = state_[face].load(std::memory_order_relaxed);
  if (state == unknown) {
    state = find_crossing(face) ? crossing : clear;
    state_[face].store(state, std::memory_order_relaxed);
  }
  return state == crossing;
}

bool InputCrossings::find_crossing(std::uint32_t face) const {
  const Corners own = corners(face);
  const Box box = box_of(own);
  bool found = false;
  const auto visit = [&](std::uint32_t other) {
    if (other == face) return true;
    const Corners its = corners(other);
    found = meet(box, box_of(its)) && faces_cross(own, its);
    return !found;
  };
  if (find_near_ && find_near_(face, visit)) return found;
  std::call_once(tree_ready_, [&] { build_tree(); });
  near_.for_each_near(own, visit);
  return found;
}

void InputCrossings::build_tree() const {
  std::vector<std::uint32_t> all(face_count());
  std::iota(all.begin(), all.end(), 0u);
  std::vector<std::uint8_t> hubs = NearFaces::hubs_of(input_.triangles, input_.vertices.size());
  if (!hubs.empty()) hubs.resize(all.size(), NearFaces::kNoHub);
  Team alone(1);
  near_ = NearFaces(
      all, [&](std::size_t i) { return corners(all[i]); }, hubs, alone);
}

}  // namespace tolvol
