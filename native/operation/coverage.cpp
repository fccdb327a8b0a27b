// SPDX-License-Identifier: GPL-3.0-or-later
// Most changes are settled without looking at a piece: if all pieces of an element are within e of it and its points
// move by at most m, they are within e + m of what it becomes (the same barycentric combination is the witness). Only
// when e + m passes the tolerance are the pieces measured again, which usually brings e down.
#include "operation/coverage.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tolvol {
namespace {

constexpr double kFloor = 0.1;  // of the tolerance: a shorter piece is not split further
// Pieces that splitting may add before a change is refused, and in assign() of one triangle of the reference.
constexpr std::size_t kBudget = 1 << 14;

FourPoints with_centre(const Part& part) {
  const auto& [a, b, c] = part.corners;
  FourPoints points;
  points.set(a, b, c, (a + b + c) * (1.0 / 3));
  return points;
}

}  // namespace

Coverage::Coverage(const TriangleMesh& reference, double within, std::size_t element_count)
    : reference_(&reference), within_(within), within2_(within * within), lists_(element_count) {}

Part Coverage::whole(std::uint32_t triangle) const {
  const glm::uvec3 t = reference_->triangles[triangle];
  return {{reference_->vertices[t.x], reference_->vertices[t.y], reference_->vertices[t.z]}};
}

void Coverage::own(std::uint32_t element, std::uint32_t triangle) { lists_[element].pieces.push_back(whole(triangle)); }

bool Coverage::assign(std::uint32_t triangle, const Hierarchy& hierarchy, std::span<const std::uint32_t> ids,
                      double provable, std::vector<std::uint32_t>& nearest) {
  bool all = true;
  std::vector<Part> stack{whole(triangle)};
  std::size_t looked = 0;
  std::uint32_t hint = Hierarchy::kNone;
  while (!stack.empty()) {
    const Part piece = stack.back();
    stack.pop_back();
    const auto& c = piece.corners;
    const Hierarchy::Common common = hierarchy.common(c, provable, -1, hint);
    if (common.triangle != Hierarchy::kNone) {
      hint = common.triangle;
      const std::uint32_t element = ids[common.triangle];
      if (element == kNone) continue;
      List& list = lists_[element];
      list.distance = std::max(list.distance, common.distance);
      list.pieces.push_back(piece);
      continue;
    }
    const glm::dvec3 centre = (c[0] + c[1] + c[2]) * (1.0 / 3);
    const Hierarchy::Nearest closest = hierarchy.nearest(centre, std::numeric_limits<double>::infinity(), hint);
    const double radius =
        std::sqrt(std::max({glm::dot(c[0] - centre, c[0] - centre), glm::dot(c[1] - centre, c[1] - centre),
                            glm::dot(c[2] - centre, c[2] - centre)}));
    const bool finest =
        longest_squared(piece) <= kFloor * kFloor * within2_ || piece.cuts == kMostCuts || ++looked > kBudget;
    if (closest.distance > provable + radius || finest) {
      nearest.push_back(closest.triangle);
      all = false;
    } else {
      split(piece, stack);
    }
  }
  return all;
}

void Coverage::sample(std::uint32_t element, std::size_t stride, std::vector<Sample>& out) const {
  const std::vector<Part>& pieces = lists_[element].pieces;
  for (std::size_t i = 0; i < pieces.size(); i += stride) {
    const auto& [a, b, c] = pieces[i].corners;
    out.push_back({(a + b + c) * (1.0 / 3), 0.5 * glm::length(glm::cross(b - a, c - a))});
  }
}

bool Coverage::place(const Part& whole, std::uint32_t first, Trial& trial) const {
  trial.stack_.assign(1, whole);
  while (!trial.stack_.empty()) {
    if (trial.stack_.size() > 1 && ++trial.looked_ > kBudget) return false;
    const Part piece = trial.stack_.back();
    trial.stack_.pop_back();
    const FourPoints points = with_centre(piece);
    double centre2 = std::numeric_limits<double>::infinity();
    Cover cover;
    std::uint32_t cover_by = 0;
    const auto covered_by = [&](std::uint32_t i) {
      double d2[4];
      witness_distances(trial.candidates_[i].witness, points, d2);
      centre2 = std::min(centre2, d2[3]);
      // Written so that NaN is not covered.
      if (d2[0] <= within2_ && d2[1] <= within2_ && d2[2] <= within2_) {
        trial.candidates_[i].distance =
            std::max(trial.candidates_[i].distance, std::sqrt(std::max({d2[0], d2[1], d2[2]})));
        trial.moved_.push_back({piece, i});
        trial.last_ = i;
        return true;
      }
      if (cover.improve(d2, within_)) cover_by = i;
      return false;
    };
    // The element that took the last piece is as likely as the one that follows from the change.
    const std::uint32_t second = trial.last_;
    if (covered_by(first) || (second != first && covered_by(second))) continue;
    bool covered = false;
    for (std::uint32_t i = 0; i < trial.candidates_.size() && !covered; ++i) {
      if (i != first && i != second) covered = covered_by(i);
    }
    if (covered) continue;
    if (!(centre2 <= within2_) || longest_squared(piece) <= kFloor * kFloor * within2_ || piece.cuts == kMostCuts) {
      return false;
    }
    trial.cut_off_.clear();
    if (cut(piece, cover, trial.cut_off_, trial.stack_)) {
      for (const Part& part : trial.cut_off_) trial.moved_.push_back({part, cover_by});
      trial.candidates_[cover_by].distance = std::max(trial.candidates_[cover_by].distance, cover.within);
      trial.last_ = cover_by;
    } else {
      split(piece, trial.stack_);
    }
  }
  return true;
}

bool Coverage::try_change(std::span<const Element> elements, std::span<const Removed> removed, Trial& trial) const {
  trial.candidates_.clear();
  trial.heirlooms_.clear();
  trial.moved_.clear();
  trial.last_ = 0;
  trial.looked_ = 0;
  bool settled = true;
  for (const Element& e : elements) {
    const List& list = lists_[e.id];
    const double distance = list.pieces.empty() ? 0 : list.distance + e.moved;
    const bool keeps = distance <= within_;
    settled &= keeps;
    trial.candidates_.push_back({e.id, {}, keeps ? distance : 0, !keeps});
  }
  for (const Removed& r : removed) {
    const List& list = lists_[r.id];
    const double distance = list.distance + r.moved;
    const bool whole = list.pieces.empty() || distance <= within_;
    settled &= whole;
    if (whole && !list.pieces.empty())
      trial.candidates_[r.heir].distance = std::max(trial.candidates_[r.heir].distance, distance);
    trial.heirlooms_.push_back({r.id, r.heir, whole});
  }
  if (settled) return true;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    trial.candidates_[i].witness = {elements[i].corners[0], elements[i].corners[1], elements[i].corners[2]};
  }
  // What loses its element is the likeliest to fail.
  for (const Trial::Heirloom& h : trial.heirlooms_) {
    if (h.whole) continue;
    for (const Part& piece : lists_[h.id].pieces) {
      if (!place(piece, h.heir, trial)) return false;
    }
  }
  for (std::uint32_t k = 0; k < trial.candidates_.size(); ++k) {
    const std::uint32_t i = (trial.suspect_ + k) % static_cast<std::uint32_t>(trial.candidates_.size());
    if (!trial.candidates_[i].replaced) continue;
    for (const Part& piece : lists_[trial.candidates_[i].id].pieces) {
      if (!place(piece, i, trial)) {
        trial.suspect_ = i;
        return false;
      }
    }
  }
  return true;
}

void Coverage::commit(const Trial& trial) {
  for (const Trial::Candidate& c : trial.candidates_) {
    if (c.replaced) lists_[c.id].pieces.clear();
    lists_[c.id].distance = c.distance;
  }
  for (const Trial::Heirloom& h : trial.heirlooms_) {
    // Not clear(): the element is gone, and so goes its memory.
    const std::vector<Part> pieces = std::exchange(lists_[h.id].pieces, {});
    std::vector<Part>& to = lists_[trial.candidates_[h.heir].id].pieces;
    if (h.whole) to.insert(to.end(), pieces.begin(), pieces.end());
  }
  for (const Moved& m : trial.moved_) lists_[trial.candidates_[m.element].id].pieces.push_back(m.piece);
}

}  // namespace tolvol
