// SPDX-License-Identifier: GPL-3.0-or-later
/// The places that the vertices of a mesh occupy, so that no vertex is put where another is. A reader that welds equal
/// positions would make the two vertices one, and then more than two faces may meet at an edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <unordered_map>

namespace tolvol {

class Occupied {
 public:
  void add(const glm::dvec3& place) { ++count_[place]; }
  void remove(const glm::dvec3& place) {
    const auto found = count_.find(place);
    if (--found->second == 0) count_.erase(found);
  }
  bool contains(const glm::dvec3& place) const { return count_.contains(place); }

 private:
  struct Hash {
    std::size_t operator()(const glm::dvec3& p) const {
      std::size_t hash = 0;
      // The sum with 0.0 turns the negative zero into the positive one, which is equal to it.
      for (int k = 0; k < 3; ++k) hash = hash * 0x9E3779B97F4A7C15u + std::hash<double>()(p[k] + 0.0);
      return hash;
    }
  };
  std::unordered_map<glm::dvec3, std::uint32_t, Hash> count_;
};

}  // namespace tolvol
