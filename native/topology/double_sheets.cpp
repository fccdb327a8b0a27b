// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/double_sheets.h"

#include <algorithm>
#include <array>

#include "base/call.h"
#include "base/union_find.h"
#include "geometry/triangle_mesh.h"
#include "geometry/weld.h"

namespace tolvol {

std::vector<std::uint32_t> double_sheets(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles) {
  const std::vector<std::uint32_t> place = weld_equal_positions(vertices);
  struct Key {
    std::array<std::uint32_t, 3> places;
    std::uint32_t triangle;
  };
  std::vector<Key> keys(triangles.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    poll_at(i);
    keys[i] = {{place[triangles[i].x], place[triangles[i].y], place[triangles[i].z]}, i};
    std::sort(keys[i].places.begin(), keys[i].places.end());
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.places != b.places ? a.places < b.places : a.triangle < b.triangle;
  });
  UnionFind groups(triangles.size());
  std::vector<Key> twins;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const bool as_before = i > 0 && keys[i].places == keys[i - 1].places;
    const bool as_next = i + 1 < keys.size() && keys[i].places == keys[i + 1].places;
    if (as_before) groups.join(keys[i - 1].triangle, keys[i].triangle);
    if (as_before || as_next) twins.push_back(keys[i]);
  }
  struct Side {
    std::array<std::uint32_t, 2> places;
    std::uint32_t triangle;
  };
  std::vector<Side> sides;
  for (const auto& [p, triangle] : twins) {
    sides.push_back({{p[0], p[1]}, triangle});
    sides.push_back({{p[0], p[2]}, triangle});
    sides.push_back({{p[1], p[2]}, triangle});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.places < b.places; });
  for (std::size_t i = 1; i < sides.size(); ++i) {
    if (sides[i].places == sides[i - 1].places) groups.join(sides[i - 1].triangle, sides[i].triangle);
  }
  std::vector<std::uint32_t> sheet(triangles.size(), kNoSheet);
  for (const Key& key : twins) sheet[key.triangle] = groups.find(key.triangle);
  return sheet;
}

}  // namespace tolvol
