// SPDX-License-Identifier: GPL-3.0-or-later
/// Which of the faces that a change leaves stands for which of the input faces that the changed faces stood for, so
/// that each crossing that is left has a crossing of the input that it goes back to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tolvol {

class Succession {
 public:
  /// The owner of a member that stays with a face that the change does not reshape.
  static constexpr std::uint32_t kOutside = 0xFFFFFFFFu;

  /// The members are the input faces, named by their places in `owners`: the face that each would go to by itself, or
  /// kOutside.
  explicit Succession(std::vector<std::uint32_t> owners) : owners_(std::move(owners)), kept_(owners_.size(), false) {}

  /// The member stays with its owner.
  void keep(std::uint32_t member) { kept_[member] = true; }
  /// The face needs one of the members, which are in rising order.
  void need(std::uint32_t face, std::vector<std::uint32_t> members) { needs_.push_back({face, std::move(members)}); }

  /// An owner for each member, so that all needs are met, or nothing where none was found: then there may still be one.
  /// Needs with few members choose first. O(sum of the members of all needs).
  std::optional<std::vector<std::uint32_t>> find() const;

 private:
  struct Need {
    std::uint32_t face;
    std::vector<std::uint32_t> members;
  };
  std::vector<std::uint32_t> owners_;
  std::vector<bool> kept_;
  std::vector<Need> needs_;
};

}  // namespace tolvol
