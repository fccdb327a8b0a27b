// SPDX-License-Identifier: GPL-3.0-or-later
// A part (i, j) of the polygon has the corners i to j and the inner edge from i to j. Parts are settled in the order of
// their number of corners. A part that has no triangulation is not looked at again: where holes are far wider than what
// is admitted, nearly all parts are such.
#include "repair/least_triangulation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/call.h"

namespace tolvol {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

class Triangulation {
 public:
  Triangulation(std::span<const glm::dvec3> corners, const TriangulationRules& rules)
      : corners_(corners),
        rules_(rules),
        count_(static_cast<std::uint32_t>(corners.size())),
        least_(corners.size() * (corners.size() - 1) / 2, kNever),
        middle_(least_.size(), 0),
        ends_(corners.size()) {}

  std::vector<glm::uvec3> run() {
    for (std::uint32_t i = 0; i + 1 < count_; ++i) settle(i, i + 1, 0, i);
    for (std::uint32_t length = 2; length < count_; ++length) {
      for (std::uint32_t i = 0; i + length < count_; ++i) {
        poll();
        settle_part(i, i + length);
      }
    }
    std::vector<glm::uvec3> triangles;
    if (least_[index(0, count_ - 1)] == kNever) return triangles;
    std::vector<glm::uvec2> parts{{0, count_ - 1}};
    while (!parts.empty()) {
      const glm::uvec2 part = parts.back();
      parts.pop_back();
      if (part.y - part.x < 2) continue;
      const std::uint32_t k = middle_[index(part.x, part.y)];
      triangles.emplace_back(part.x, k, part.y);
      parts.emplace_back(k, part.y);
      parts.emplace_back(part.x, k);
    }
    return triangles;
  }

 private:
  struct Choice {
    double sum;
    std::uint32_t corner;
    bool operator<(const Choice& other) const { return sum < other.sum || (sum == other.sum && corner < other.corner); }
  };

  std::size_t index(std::uint32_t i, std::uint32_t j) const { return static_cast<std::size_t>(j) * (j - 1) / 2 + i; }

  double weight(std::uint32_t i, std::uint32_t k, std::uint32_t j) const {
    const glm::dvec3 u = corners_[k] - corners_[i], v = corners_[j] - corners_[i], w = corners_[j] - corners_[k];
    const glm::dvec3 n = glm::cross(u, v);
    return std::sqrt(glm::dot(n, n)) * (glm::dot(u, u) + glm::dot(v, v) + glm::dot(w, w));
  }

  void settle(std::uint32_t i, std::uint32_t j, double sum, std::uint32_t middle) {
    least_[index(i, j)] = sum;
    middle_[index(i, j)] = middle;
    ends_[i].push_back(j);
  }

  void settle_part(std::uint32_t i, std::uint32_t j) {
    choices_.clear();
    for (const std::uint32_t k : ends_[i]) {
      const double beyond = least_[index(k, j)];
      if (beyond != kNever) choices_.push_back({least_[index(i, k)] + beyond, k});
    }
    const bool is_whole = i == 0 && j == count_ - 1;
    if (choices_.empty() || (!is_whole && !rules_.admits_edge(i, j))) return;
    for (Choice& choice : choices_) choice.sum += weight(i, choice.corner, j);
    while (!choices_.empty()) {
      if (choices_.size() % 16 == 0) poll();
      const auto best = std::min_element(choices_.begin(), choices_.end());
      if (rules_.admits_triangle({i, best->corner, j})) {
        settle(i, j, best->sum, best->corner);
        return;
      }
      *best = choices_.back();
      choices_.pop_back();
    }
  }

  std::span<const glm::dvec3> corners_;
  const TriangulationRules& rules_;
  std::uint32_t count_;
  std::vector<double> least_;                     ///< for each part: its least sum, or kNever
  std::vector<std::uint32_t> middle_;             ///< for each part: the third corner of the triangle at its inner edge
  std::vector<std::vector<std::uint32_t>> ends_;  ///< for each corner i: the j of the parts (i, j) that have a sum
  std::vector<Choice> choices_;
};

}  // namespace

std::vector<glm::uvec3> least_triangulation(std::span<const glm::dvec3> corners, const TriangulationRules& rules) {
  return Triangulation(corners, rules).run();
}

}  // namespace tolvol
