// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/input_crossings.h"

#include <algorithm>
#include <numeric>

#include "topology/double_sheets.h"

namespace tolvol {
namespace {

/// All faces that a face crosses are found once it was asked about kMany others, or about the kManyShare-th part of all
/// faces if that is more: to find them takes some times as long as this.
constexpr std::size_t kMany = 1024, kManyShare = 16;
/// So many faces in the lists of what a face crosses take 64 MB.
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
  return first_crossed(some_a, boxed(some_b), 0) < some_a.size();
}

std::vector<std::uint32_t> InputCrossings::which_crossed(std::span<const std::uint32_t> a,
                                                         std::span<const std::uint32_t> b) const {
  const std::vector<Boxed> others = boxed(b);
  std::vector<std::uint32_t> found;
  for (std::size_t i = 0; (i = first_crossed(a, others, i)) < a.size(); ++i) {
    found.push_back(static_cast<std::uint32_t>(i));
  }
  return found;
}

/// Some faces in rising order.
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
/// faces.
std::size_t InputCrossings::first_crossed(std::span<const std::uint32_t> faces, std::span<const Boxed> others,
                                          std::size_t first) const {
  std::size_t turn = 0;
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
  std::call_once(states_ready_, [&] {
    state_ = std::vector<std::atomic<std::uint8_t>>(face_count());
    asked_ = std::vector<std::atomic<std::uint32_t>>(face_count());
  });
  std::uint8_t state = state_[face].load(std::memory_order_relaxed);
  if (state == unknown) {
    state = find_crossing(face) ? crossing : clear;
    state_[face].store(state, std::memory_order_relaxed);
  }
  return state == crossing;
}

/// All faces for which crossed() holds with a face, in rising order, after it was asked about very many others, of
/// which `others` are new. Null before, and where all such lists together would take too much memory.
const std::vector<std::uint32_t>* InputCrossings::all_crossed(std::uint32_t face, std::size_t others) const {
  const std::size_t many = std::max(kMany, face_count() / kManyShare);
  if (asked_[face].load(std::memory_order_relaxed) < many) {
    asked_[face].fetch_add(static_cast<std::uint32_t>(others), std::memory_order_relaxed);
    return nullptr;
  }
  {
    const std::shared_lock lock(lists_mutex_);
    const auto found = lists_.find(face);
    if (found != lists_.end()) return &found->second;
    if (in_lists_ > kMostInLists) return nullptr;
  }
  const Corners own = corners(face);
  std::vector<std::uint32_t> crossed;
  std::size_t turn = 0;
  std::call_once(tree_ready_, [&] { build_tree(); });
  near_.for_each_near(own, [&](std::uint32_t other) {
    poll_at(++turn);
    if (other != face && faces_cross(own, corners(other)) && !are_of_one_sheet(face, other)) crossed.push_back(other);
    return true;
  });
  std::ranges::sort(crossed);
  crossed.erase(std::unique(crossed.begin(), crossed.end()), crossed.end());
  const std::unique_lock lock(lists_mutex_);
  const auto [place, is_new] = lists_.try_emplace(face, std::move(crossed));
  if (is_new) in_lists_ += place->second.size();
  return &place->second;
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
