// SPDX-License-Identifier: GPL-3.0-or-later
// Most changes are settled without looking at a piece: if all pieces of an element are within e of it and its points
// move by at most m, they are within e + m of what it becomes (the same barycentric combination is the witness). Only
// when e + m passes the tolerance are the pieces measured again, which usually brings e down.
#include "operation/coverage.h"

#include <algorithm>
#include <cmath>

namespace tolvol {
namespace {

constexpr double kFloor = 0.1;            // of the tolerance: a shorter piece is not split further
constexpr std::size_t kBudget = 1 << 14;  // pieces that splitting may add in one change before it is refused
constexpr int kDeepest = 15;              // levels that 16-bit places hold

FourPoints with_centre(const glm::dvec3 (&c)[3]) {
  FourPoints points;
  points.set(c[0], c[1], c[2], (c[0] + c[1] + c[2]) * (1.0 / 3));
  return points;
}

double longest_squared(const glm::dvec3 (&c)[3]) {
  const glm::dvec3 e0 = c[1] - c[0], e1 = c[2] - c[1], e2 = c[0] - c[2];
  return std::max({glm::dot(e0, e0), glm::dot(e1, e1), glm::dot(e2, e2)});
}

}  // namespace

Coverage::Coverage(const TriangleMesh& reference, double within, std::size_t element_count)
    : reference_(&reference), within_(within), within2_(within * within), lists_(element_count) {
  pool_.reserve(reference.triangles.size() + reference.triangles.size() / 4);
}

void Coverage::corners(const Piece& piece, glm::dvec3 (&out)[3]) const {
  const glm::uvec3 t = reference_->triangles[piece.triangle];
  const glm::dvec3 &a = reference_->vertices[t.x], &b = reference_->vertices[t.y], &c = reference_->vertices[t.z];
  if (piece.level == 0) {
    out[0] = a, out[1] = b, out[2] = c;
    return;
  }
  const double unit = std::ldexp(1.0, -piece.level);
  const glm::dvec3 ab = (b - a) * unit, ac = (c - a) * unit;
  const int i = piece.i, j = piece.j;
  const auto at = [&](int s, int t) { return a + static_cast<double>(s) * ab + static_cast<double>(t) * ac; };
  if (piece.reversed) {
    out[0] = at(i + 1, j + 1), out[1] = at(i, j + 1), out[2] = at(i + 1, j);
  } else {
    out[0] = at(i, j), out[1] = at(i + 1, j), out[2] = at(i, j + 1);
  }
}

void Coverage::split(const Piece& piece, std::vector<Piece>& out) {
  const auto part = [&](int di, int dj, bool reversed) {
    out.push_back({piece.triangle, static_cast<std::uint16_t>(2 * piece.i + di),
                   static_cast<std::uint16_t>(2 * piece.j + dj), static_cast<std::uint8_t>(piece.level + 1), reversed,
                   kNone});
  };
  if (piece.reversed) {
    part(1, 1, true), part(0, 1, true), part(1, 0, true), part(1, 1, false);
  } else {
    part(0, 0, false), part(1, 0, false), part(0, 1, false), part(0, 0, true);
  }
}

void Coverage::push(List& list, const Piece& piece) {
  std::uint32_t at = free_;
  if (at != kNone) {
    free_ = pool_[at].next;
    pool_[at] = piece;
  } else {
    at = static_cast<std::uint32_t>(pool_.size());
    pool_.push_back(piece);
  }
  pool_[at].next = list.head;
  if (list.head == kNone) list.tail = at;
  list.head = at;
}

void Coverage::free(List& list) {
  if (list.head == kNone) return;
  pool_[list.tail].next = free_;
  free_ = list.head;
  list.head = list.tail = kNone;
}

void Coverage::own(std::uint32_t element, std::uint32_t triangle) {
  push(lists_[element], {triangle, 0, 0, 0, false, kNone});
}

bool Coverage::assign(std::uint32_t triangle, const Hierarchy& hierarchy, std::span<const std::uint32_t> ids,
                      double provable, std::vector<std::uint32_t>& nearest) {
  bool all = true;
  std::vector<Piece> stack{{triangle, 0, 0, 0, false, kNone}};
  std::uint32_t hint = Hierarchy::kNone;
  while (!stack.empty()) {
    const Piece piece = stack.back();
    stack.pop_back();
    glm::dvec3 c[3];
    corners(piece, c);
    const Hierarchy::Common common = hierarchy.common(c, provable, -1, hint);
    if (common.triangle != Hierarchy::kNone) {
      hint = common.triangle;
      const std::uint32_t element = ids[common.triangle];
      if (element == kNone) continue;
      List& list = lists_[element];
      list.distance = std::max(list.distance, common.distance);
      push(list, piece);
      continue;
    }
    const glm::dvec3 centre = (c[0] + c[1] + c[2]) * (1.0 / 3);
    const Hierarchy::Nearest closest = hierarchy.nearest(centre, std::numeric_limits<double>::infinity(), hint);
    const double radius =
        std::sqrt(std::max({glm::dot(c[0] - centre, c[0] - centre), glm::dot(c[1] - centre, c[1] - centre),
                            glm::dot(c[2] - centre, c[2] - centre)}));
    // What an earlier decimation left has a witness for each of its pieces, and those were cut no finer than this.
    const bool finest = longest_squared(c) <= kFloor * kFloor * within2_ || piece.level == kDeepest;
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
  std::size_t skip = 0;
  for (std::uint32_t p = lists_[element].head; p != kNone; p = pool_[p].next) {
    if (skip-- > 0) continue;
    skip = stride - 1;
    glm::dvec3 c[3];
    corners(pool_[p], c);
    out.push_back({(c[0] + c[1] + c[2]) * (1.0 / 3), 0.5 * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]))});
  }
}

bool Coverage::place(const Piece& whole, std::uint32_t first, Trial& trial) const {
  trial.stack_.assign(1, whole);
  while (!trial.stack_.empty()) {
    if (trial.stack_.size() > 1 && ++trial.looked_ > kBudget) return false;
    const Piece piece = trial.stack_.back();
    trial.stack_.pop_back();
    glm::dvec3 c[3];
    corners(piece, c);
    const FourPoints points = with_centre(c);
    double centre2 = std::numeric_limits<double>::infinity();
    const auto covered_by = [&](std::uint32_t i) {
      double d2[4];
      witness_distances(trial.candidates_[i].witness, points, d2);
      const double farthest2 = std::max({d2[0], d2[1], d2[2]});
      centre2 = std::min(centre2, d2[3]);
      if (!(farthest2 <= within2_)) return false;
      trial.candidates_[i].distance = std::max(trial.candidates_[i].distance, std::sqrt(farthest2));
      trial.moved_.push_back({piece, i});
      trial.last_ = i;
      return true;
    };
    // The element that took the last piece is as likely as the one that follows from the change.
    const std::uint32_t second = trial.last_;
    if (covered_by(first) || (second != first && covered_by(second))) continue;
    bool covered = false;
    for (std::uint32_t i = 0; i < trial.candidates_.size() && !covered; ++i) {
      if (i != first && i != second) covered = covered_by(i);
    }
    if (covered) continue;
    if (!(centre2 <= within2_) || longest_squared(c) <= kFloor * kFloor * within2_ || piece.level == kDeepest) {
      return false;
    }
    split(piece, trial.stack_);
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
    const double distance = list.head == kNone ? 0 : list.distance + e.moved;
    const bool keeps = distance <= within_;
    settled &= keeps;
    trial.candidates_.push_back({e.id, {}, keeps ? distance : 0, !keeps});
  }
  for (const Removed& r : removed) {
    const List& list = lists_[r.id];
    const double distance = list.distance + r.moved;
    const bool whole = list.head == kNone || distance <= within_;
    settled &= whole;
    if (whole && list.head != kNone)
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
    for (std::uint32_t p = lists_[h.id].head; p != kNone; p = pool_[p].next) {
      if (!place(pool_[p], h.heir, trial)) return false;
    }
  }
  for (std::uint32_t k = 0; k < trial.candidates_.size(); ++k) {
    const std::uint32_t i = (trial.suspect_ + k) % static_cast<std::uint32_t>(trial.candidates_.size());
    if (!trial.candidates_[i].replaced) continue;
    for (std::uint32_t p = lists_[trial.candidates_[i].id].head; p != kNone; p = pool_[p].next) {
      if (!place(pool_[p], i, trial)) {
        trial.suspect_ = i;
        return false;
      }
    }
  }
  return true;
}

void Coverage::commit(const Trial& trial) {
  for (const Trial::Heirloom& h : trial.heirlooms_) {
    if (!h.whole) free(lists_[h.id]);
  }
  for (const Trial::Candidate& c : trial.candidates_) {
    if (c.replaced) free(lists_[c.id]);
    lists_[c.id].distance = c.distance;
  }
  for (const Trial::Heirloom& h : trial.heirlooms_) {
    List &from = lists_[h.id], &to = lists_[trial.candidates_[h.heir].id];
    if (!h.whole || from.head == kNone) continue;
    pool_[from.tail].next = to.head;
    if (to.head == kNone) to.tail = from.tail;
    to.head = from.head;
    from.head = from.tail = kNone;
  }
  for (const Moved& m : trial.moved_) push(lists_[trial.candidates_[m.element].id], m.piece);
}

}  // namespace tolvol
