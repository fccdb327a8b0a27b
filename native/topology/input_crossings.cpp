// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/input_crossings.h"

#include <algorithm>
#include <numeric>

#include "topology/double_sheets.h"

namespace tolvol {
namespace {

/// After so many pairs with a face, or pairs for this share of all faces if that is more, all that it crosses is found.
/// This search costs at most a test of each face of the mesh: kManyAskedShare times as many as were made by then.
constexpr std::size_t kManyAsked = 1024, kManyAskedShare = 16;
/// The lists hold at most about so many faces, in 64 MB, so that they stay small beside the mesh.
constexpr std::size_t kMostInLists = 1 << 24;

}  // namespace

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
  std::size_t turn = 0;
  return first_crossed(some_a, boxed(some_b), 0, turn) < some_a.size();
}

std::vector<std::uint32_t> InputCrossings::which_crossed(std::span<const std::uint32_t> a,
                                                         std::span<const std::uint32_t> b) const {
  const std::vector<Boxed> others = boxed(b);
  std::vector<std::uint32_t> found;
  std::size_t turn = 0;
  for (std::size_t i = 0; (i = first_crossed(a, others, i, turn)) < a.size(); ++i) {
    found.push_back(static_cast<std::uint32_t>(i));
  }
  return found;
}

/// The faces with their corners and boxes, in rising order of their numbers.
std::vector<InputCrossings::Boxed> InputCrossings::boxed(std::span<const std::uint32_t> faces) const {
  std::vector<Boxed> found;
  found.reserve(faces.size());
  for (const std::uint32_t face : faces) {
    const Corners all = corners(face);
    found.push_back({face, all, box_of(all)});
  }
  std::ranges::sort(found, {}, &Boxed::face);
  return found;
}

/// The first place from `first` on of a face that crossed one of the others, as boxed() returns them, or the number of
/// faces. `turn` counts the steps since the last poll.
std::size_t InputCrossings::first_crossed(std::span<const std::uint32_t> faces, std::span<const Boxed> others,
                                          std::size_t first, std::size_t& turn) const {
  for (std::size_t i = first; i < faces.size(); ++i) {
    if (const std::vector<std::uint32_t>* const crossed = all_crossed(faces[i], others.size())) {
      const auto is_other = [&](std::uint32_t face) {
        poll_at(++turn);
        return std::ranges::binary_search(others, face, {}, &Boxed::face);
      };
      const auto is_crossed = [&](const Boxed& other) {
        poll_at(++turn);
        return std::ranges::binary_search(*crossed, other.face);
      };
      const bool few = crossed->size() < others.size();
      if (few ? std::ranges::any_of(*crossed, is_other) : std::ranges::any_of(others, is_crossed)) return i;
      continue;
    }
    const Corners own = corners(faces[i]);
    const Box box = box_of(own);
    for (const Boxed& other : others) {
      poll_at(++turn);
      if (!meet(box, other.box) || !faces_cross(own, other.corners)) continue;
      if (!are_of_one_sheet(faces[i], other.face)) return i;
    }
  }
  return faces.size();
}

void InputCrossings::keep_crossing(std::vector<std::uint32_t>& faces) const {
  std::erase_if(faces, [&](std::uint32_t face) { return !crosses_another(face); });
}

bool InputCrossings::crosses_another(std::uint32_t face) const {
  std::call_once(states_ready_, [&] { state_ = std::vector<std::atomic<std::uint8_t>>(face_count()); });
  std::uint8_t state = state_[face].load(std::memory_order_relaxed);
  if (state == unknown) {
    state = clear;
    for_each_crossing(face, [&](std::uint32_t) {
      state = crossing;
      return false;
    });
    state_[face].store(state, std::memory_order_relaxed);
  }
  return state == crossing;
}

/// All faces for which crossed() holds with a face, in rising order. Null as long as few pairs with the face were asked
/// about, to which this adds `asked_now`, and where the lists of all faces would take too much memory.
const std::vector<std::uint32_t>* InputCrossings::all_crossed(std::uint32_t face, std::size_t asked_now) const {
  std::call_once(counts_ready_, [&] { asked_ = std::vector<std::atomic<std::uint32_t>>(face_count()); });
  if (asked_[face].load(std::memory_order_relaxed) < std::max(kManyAsked, face_count() / kManyAskedShare)) {
    asked_[face].fetch_add(static_cast<std::uint32_t>(asked_now), std::memory_order_relaxed);
    return nullptr;
  }
  {
    const std::shared_lock lock(lists_mutex_);
    const auto found = lists_.find(face);
    if (found != lists_.end()) return &found->second;
    if (in_lists_ > kMostInLists) return nullptr;
  }
  poll();
  std::vector<std::uint32_t> crossed;
  for_each_crossing(face, [&](std::uint32_t other) {
    if (!are_of_one_sheet(face, other)) crossed.push_back(other);
    return true;
  });
  std::ranges::sort(crossed);
  crossed.erase(std::unique(crossed.begin(), crossed.end()), crossed.end());
  crossed.shrink_to_fit();
  const std::unique_lock lock(lists_mutex_);
  const auto [place, is_new] = lists_.try_emplace(face, std::move(crossed));
  if (is_new) in_lists_ += place->second.size();
  return &place->second;
}

/// Calls visit(other) for the faces that cross a face, until it returns false. One may come more than once.
void InputCrossings::for_each_crossing(std::uint32_t face, const std::function<bool(std::uint32_t)>& visit) const {
  const Corners own = corners(face);
  const Box box = box_of(own);
  std::size_t turn = 0;
  const auto next = [&](std::uint32_t other) {
    poll_at(++turn);
    if (other == face) return true;
    const Corners its = corners(other);
    return !meet(box, box_of(its)) || !faces_cross(own, its) || visit(other);
  };
  if (find_near_ && find_near_(face, next)) return;
  std::call_once(tree_ready_, [&] { build_tree(); });
  near_.for_each_near(own, next);
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
