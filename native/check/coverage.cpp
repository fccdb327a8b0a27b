// SPDX-License-Identifier: GPL-3.0-or-later
// Most changes are settled without looking at a piece: if all pieces of an element are within e of it and its points
// move by at most m, the pieces are within e + m of the moved element, because the same barycentric combination is the
// witness. The pieces are measured again only if e + m exceeds the tolerance, and then e usually becomes smaller.
#include "check/coverage.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/call.h"
#include "base/parallel.h"
#include "check/tolerance_volume.h"

namespace tolvol {
namespace {

// A piece is cut along an edge only if both sides are at least this wide, in tolerances.
constexpr double kNarrowestStrip = 0.25;
// A piece shorter than this, in tolerances, is not split further.
constexpr double kShortestPiece = 0.1;
// A change is refused once splitting has added this many pieces.
constexpr std::size_t kBudgetOfChange = 1 << 12;
// find_witnesses() may look at this many parts more for each element, all calls together, and divides a part down to
// the headroom below the tolerance, so that it finds witnesses again for a mesh that kept within the headroom. Once a
// point of a triangle is known to be beyond the tolerance, it goes no deeper than a change does.
constexpr std::size_t kBudgetOfElement = 64, kBudgetOfFirst = 1 << 16;
// It looks at this many parts of a triangle with a point beyond the tolerance: nothing is promised of such a triangle.
// All of them share a further budget, which is the one above over kDivisorOfBeyond.
constexpr std::size_t kBudgetOfBeyond = 64, kDivisorOfBeyond = 8;
// A part of such a triangle counts once more for each so many nodes that the searches for it visit. Near a vertex of
// thousands of needles each search visits all of them.
constexpr std::size_t kNodesOfPart = 64;
// The budget grows by this many pieces for each piece that a change places.
constexpr std::size_t kBudgetOfPiece = 4;
// A triangle of so many pieces, all of which lose their witness, is placed as a whole even if each piece has a budget.
constexpr std::uint32_t kMostUnited = 256;
// If there are more candidates than this, a piece looks only at the nearest.
constexpr std::size_t kMany = 64;
// A try polls after this many parts of pieces, each of which may look at kMany candidates.
constexpr std::size_t kPartsBetweenPolls = 64;
// find_witnesses() searches for the witnesses of this many whole triangles before it assigns them.
constexpr std::size_t kSearchedAtOnce = 1 << 16;
// A thread takes this many of them at a time. A search takes about 0.5 us.
constexpr std::size_t kSearchedOfBlock = 256;
// In a change of many elements a thread takes this many at a time. A piece takes about 1 us.
constexpr std::size_t kElementsOfBlock = 16;
// This bit of split_into_ marks a triangle some of which is out of reach.
constexpr std::uint32_t kNeverWhole = 1u << 31;

FourPoints with_centre(const Part& part) {
  const auto& [a, b, c] = part.corners;
  FourPoints points;
  points.set(a, b, c, (a + b + c) * (1.0 / 3));
  return points;
}

/// Takes parts from the budget, if there are any left.
bool take(std::size_t& budget, std::size_t parts) {
  if (budget == 0) return false;
  budget -= std::min(budget, parts);
  return true;
}

TriangleMesh mesh_of(std::span<const Coverage::Element> elements) {
  TriangleMesh mesh;
  for (const Coverage::Element& e : elements) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    for (const glm::dvec3& corner : e.corners) mesh.vertices.push_back(corner);
  }
  return mesh;
}

}  // namespace

Coverage::Coverage(const TriangleMesh& reference, double limit, std::size_t element_count)
    : reference_(&reference),
      limit_(limit),
      limit2_(limit * limit),
      pieces_(element_count),
      distance_(element_count, kNoPiece),
      budget_of_first_(kBudgetOfFirst + kBudgetOfElement * element_count),
      budget_of_beyond_(budget_of_first_ / kDivisorOfBeyond),
      split_into_(reference.triangles.size()) {}

void Coverage::set_witness(std::uint32_t element, std::uint32_t triangle) {
  pieces_[element].push_back(whole(triangle));
  distance_[element] = std::max(distance_[element], 0.0);
}

Coverage::Uncovered Coverage::find_witnesses(std::span<const std::uint32_t> triangles, const TriangleMesh& mesh,
                                             std::span<const std::uint32_t> ids, double provable, unsigned threads,
                                             Progress* progress) {
  if (mesh.triangles.empty()) return {{triangles.begin(), triangles.end()}, {}, {}};
  const Hierarchy hierarchy(mesh, threads);
  Uncovered uncovered;
  std::vector<Hierarchy::Common> common(std::min(triangles.size(), kSearchedAtOnce));
  for (std::size_t first = 0; first < triangles.size(); first += kSearchedAtOnce) {
    const std::span<const std::uint32_t> part =
        triangles.subspan(first, std::min(common.size(), triangles.size() - first));
    parallel_for(part.size(), kSearchedOfBlock, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) common[i] = hierarchy.common(whole(part[i]).corners, provable);
    });
    // On one thread and in order, because the lists of pieces and the budgets depend on it.
    for (std::size_t i = 0; i < part.size(); ++i) {
      poll_at(i);
      if (progress) progress->update(static_cast<double>(first + i) / static_cast<double>(triangles.size()));
      find_witnesses_of(part[i], common[i], mesh, hierarchy, ids, provable, uncovered);
    }
  }
  return uncovered;
}

/// Does so for one triangle. `of_whole` is hierarchy.common() of its corners.
void Coverage::find_witnesses_of(std::uint32_t triangle, const Hierarchy::Common& of_whole, const TriangleMesh& mesh,
                                 const Hierarchy& hierarchy, std::span<const std::uint32_t> ids, double provable,
                                 Uncovered& uncovered) {
  std::vector<Part> stack{whole(triangle)};
  std::size_t looked = 0;
  bool found_beyond = false;
  std::uint32_t hint = Hierarchy::kNone;
  while (!stack.empty()) {
    poll();
    const Part piece = stack.back();
    stack.pop_back();
    const auto& c = piece.corners;
    const auto assign = [&](std::uint32_t witness, double distance) {
      hint = witness;
      const std::uint32_t element = ids[witness];
      if (element == kNone) return;
      pieces_[element].push_back(piece);
      distance_[element] = std::max(distance_[element], distance);
      if (piece.cuts > 0) ++split_into_[triangle];
    };
    const Hierarchy::Common common = piece.cuts == 0 ? of_whole : hierarchy.common(c, provable, -1, hint);
    if (common.triangle != Hierarchy::kNone) {
      assign(common.triangle, common.distance);
      continue;
    }
    const auto [centre, radius] = sphere_around({c[0], c[1], c[2]});
    const Hierarchy::Nearest closest = hierarchy.nearest(centre, std::numeric_limits<double>::infinity(), hint);
    const glm::uvec3& t = mesh.triangles[closest.triangle];
    const WitnessTriangle below{mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]};
    // common() may have missed this face at a vertex of very many.
    double d2[4];
    witness_distances(below, with_centre(piece), d2);
    if (const double distance = std::sqrt(std::max({d2[0], d2[1], d2[2]})); distance <= provable) {
      assign(closest.triangle, distance);
      continue;
    }
    found_beyond = found_beyond || closest.distance > provable;
    const std::size_t parts = found_beyond ? 1 + (common.nodes + closest.nodes) / kNodesOfPart : 1;
    const double floor = (found_beyond ? kShortestPiece : kHeadroom) * limit_;
    const bool finest = longest_squared(piece) <= floor * floor || piece.cuts == kMostCuts ||
                        !may_look(looked += parts, parts, found_beyond);
    const bool is_beyond = closest.distance > provable + radius;
    if (is_beyond || finest) {
      if (!is_beyond) uncovered.in_part.push_back(piece);
      uncovered.nearest.push_back(closest.triangle);
      if (!(split_into_[triangle] & kNeverWhole)) uncovered.triangles.push_back(triangle);
      split_into_[triangle] |= kNeverWhole;
    } else if (!cut(piece, below, kNarrowestStrip * limit_, stack)) {
      split(piece, stack);
    }
  }
}

/// Whether find_witnesses() may look at `parts` more parts of a triangle, which are `looked` together.
bool Coverage::may_look(std::size_t looked, std::size_t parts, bool found_beyond) {
  if (!found_beyond) return looked <= kBudgetOfChange || take(budget_of_first_, parts);
  return looked <= kBudgetOfBeyond || (looked <= kBudgetOfChange && take(budget_of_beyond_, parts));
}

void Coverage::sample(std::uint32_t element, std::size_t stride, std::vector<Sample>& out) const {
  const PieceList& pieces = pieces_[element];
  for (std::size_t i = 0; i < pieces.size(); i += stride) {
    const Part piece = pieces.at(i, *reference_);
    const auto& [a, b, c] = piece.corners;
    out.push_back({(a + b + c) * (1.0 / 3), 0.5 * glm::length(glm::cross(b - a, c - a))});
  }
}

void Coverage::points(std::uint32_t element, std::size_t stride, std::vector<glm::dvec3>& out) const {
  const PieceList& pieces = pieces_[element];
  for (std::size_t i = 0; i < pieces.size(); i += stride) {
    const Part piece = pieces.at(i, *reference_);
    const auto& [a, b, c] = piece.corners;
    for (const glm::dvec3& p : {(a + b + c) * (1.0 / 3), a, b, c}) out.push_back(p);
  }
}

const Hierarchy& Coverage::Trial::hierarchy() const {
  if (!hierarchy_) hierarchy_.emplace(mesh_of(elements_));
  return *hierarchy_;
}

bool Coverage::place(const Part& whole, std::uint32_t first, const Trial& trial, Placing& placing) const {
  placing.stack.assign(1, whole);
  placing.budget = trial.of_many_ ? kBudgetOfChange : placing.budget + kBudgetOfPiece;
  while (!placing.stack.empty()) {
    if (++placing.looked_at % kPartsBetweenPolls == 0) poll();
    const Part piece = placing.stack.back();
    placing.stack.pop_back();
    const auto fail = [&] {
      placing.failed.push_back({piece, first});
      return false;
    };
    if (!placing.stack.empty()) {
      if (placing.budget == 0) return fail();  // The search may go on with other pieces, without a budget still.
      --placing.budget;
    }
    const FourPoints points = with_centre(piece);
    double centre2 = std::numeric_limits<double>::infinity();
    std::uint32_t below = first;
    const auto covered_by = [&](std::uint32_t i) {
      double d2[4];
      witness_distances(trial.candidates_[i].witness, points, d2);
      if (d2[3] < centre2) centre2 = d2[3], below = i;
      // A comparison with NaN is false, so that NaN is not covered.
      if (d2[0] <= limit2_ && d2[1] <= limit2_ && d2[2] <= limit2_) {
        placing.moved.push_back(piece);
        placing.goals.push_back({i, std::sqrt(std::max({d2[0], d2[1], d2[2]}))});
        placing.last = i;
        return true;
      }
      return false;
    };
    // The element that took the last piece is as likely a witness as the one that follows from the change.
    const std::uint32_t second = placing.last;
    if (covered_by(first) || (second != first && covered_by(second))) continue;
    bool covered = false;
    if (trial.candidates_.size() > kMany) {
      const glm::dvec3 centre(points.x[3], points.y[3], points.z[3]);
      const Hierarchy::Nearest nearest = trial.hierarchy().nearest(centre, limit_, below);
      covered = nearest.triangle != Hierarchy::kNone && covered_by(nearest.triangle);
    } else {
      for (std::uint32_t i = 0; i < trial.candidates_.size() && !covered; ++i) {
        if (i != first && i != second) covered = covered_by(i);
      }
    }
    if (covered) continue;
    if (!(centre2 <= limit2_) || longest_squared(piece) <= kShortestPiece * kShortestPiece * limit2_ ||
        piece.cuts == kMostCuts) {
      return fail();
    }
    const WitnessTriangle& nearest = trial.candidates_[below].witness;
    if (!cut(piece, nearest, kNarrowestStrip * limit_, placing.stack)) split(piece, placing.stack);
  }
  return true;
}

bool Coverage::try_change(std::span<const Element> elements, std::span<const Removed> removed, Trial& trial) const {
  trial.candidates_.clear();
  trial.removed_lists_.clear();
  trial.placing_.moved.clear();
  trial.placing_.goals.clear();
  trial.placing_.failed.clear();
  trial.placing_.last = 0;
  trial.hierarchy_.reset();
  trial.placing_.budget = kBudgetOfChange;
  bool settled = true;
  for (const Element& e : elements) {
    poll_at(trial.candidates_.size() + 1);  // Most changes have a few elements and need no poll.
    const double distance = distance_after(e.id, e.moved);
    const bool keeps = e.moved == 0 || distance <= limit_;
    settled &= keeps;
    trial.candidates_.push_back({e.id, {}, keeps ? distance : kNoPiece, !keeps});
  }
  for (const Removed& r : removed) {
    const double distance = distance_after(r.id, r.moved);
    const bool whole = distance <= limit_;
    settled &= whole;
    if (whole) trial.candidates_[r.successor].distance = std::max(trial.candidates_[r.successor].distance, distance);
    trial.removed_lists_.push_back({r.id, r.successor, whole});
  }
  if (settled) return true;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    poll_at(i + 1);
    trial.candidates_[i].witness = {elements[i].corners[0], elements[i].corners[1], elements[i].corners[2]};
  }
  trial.elements_ = elements;
  thread_local std::vector<std::uint32_t> gathered;  // has a count for each triangle of the reference, 0 between calls
  if (gathered.size() < split_into_.size()) gathered.resize(split_into_.size(), 0);
  const auto for_each_split = [&](auto&& call) {
    trial.for_each_replaced_part(pieces_, [&](const Part& piece) { call(gathered[piece.of]); });
  };
  // The counts are cleared even if the search throws.
  const struct Clear {
    const decltype(for_each_split)& each;
    ~Clear() {
      each([](std::uint32_t& count) { count = 0; });
    }
  } clear{for_each_split};
  for_each_split([](std::uint32_t& count) { ++count; });
  return trial.of_many_ ? place_in_blocks(trial, gathered) : place_all(trial, gathered);
}

/// Calls call() for what has to be placed in place of these pieces, which an element loses: each piece, or the whole
/// triangle of the reference once, if all its pieces are lost. `gathered` counts the lost pieces for each triangle that
/// was split. The first call that returns false is the last one. Returns whether every call returned true.
template <class Call>
bool Coverage::for_each_to_place(const PieceList& pieces, bool of_many, std::vector<std::uint32_t>& gathered,
                                 Call&& call) const {
  constexpr std::uint32_t kPlaced = 0xFFFFFFFFu;
  const auto place = [&](const Part& piece) {
    if (piece.cuts == 0) return call(piece);
    std::uint32_t& count = gathered[piece.of];
    if (count == kPlaced) return true;
    const bool too_many = of_many && count > kMostUnited;
    if (too_many || count != split_into_[piece.of].load(std::memory_order_relaxed)) return call(piece);
    count = kPlaced;
    return call(whole(piece.of));
  };
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (!place(pieces.at(i, *reference_))) return false;
  }
  return true;
}

/// Places the pieces of all that is replaced.
bool Coverage::place_all(Trial& trial, std::vector<std::uint32_t>& gathered) const {
  Placing& placing = trial.placing_;
  const auto place_list = [&](const PieceList& pieces, std::uint32_t first) {
    const std::size_t enough = placing.failed.size() + std::max<std::size_t>(trial.most_failures_, 1);
    return for_each_to_place(pieces, false, gathered, [&](const Part& piece) {
      return place(piece, first, trial, placing) || placing.failed.size() < enough;
    });
  };
  const bool goes_on = trial.most_failures_ > 0;
  // Pieces that lose their element are the likeliest to fail.
  for (const Trial::RemovedList& h : trial.removed_lists_) {
    if (!h.whole && !place_list(pieces_[h.id], h.successor) && !goes_on) return false;
  }
  const auto count = static_cast<std::uint32_t>(trial.candidates_.size());
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t i = (trial.failed_last_ + k) % count;
    if (!trial.candidates_[i].replaced) continue;
    if (!place_list(pieces_[trial.candidates_[i].id], i) && !goes_on) {
      trial.failed_last_ = i;
      return false;
    }
  }
  return placing.failed.empty();
}

/// Does the same for many elements on several threads, and finds a failure of each element that has one. Each block of
/// elements is placed as if it were alone.
bool Coverage::place_in_blocks(Trial& trial, std::vector<std::uint32_t>& gathered) const {
  struct Lost {
    std::uint32_t first;  // is where a new witness is sought first
    std::size_t begin;    // of its pieces; they end where those of the next one begin
  };
  PieceList pieces;
  std::vector<Lost> lost;
  const auto add = [&](const PieceList& list, std::uint32_t first) {
    lost.push_back({first, pieces.size()});
    for_each_to_place(list, true, gathered, [&](const Part& piece) {
      pieces.push_back(piece);
      return true;
    });
  };
  for (const Trial::RemovedList& h : trial.removed_lists_) {
    if (!h.whole) add(pieces_[h.id], h.successor);
  }
  for (std::uint32_t i = 0; i < trial.candidates_.size(); ++i) {
    if (trial.candidates_[i].replaced) add(pieces_[trial.candidates_[i].id], i);
  }
  const std::size_t count = lost.size();
  lost.push_back({0, pieces.size()});
  if (trial.candidates_.size() > kMany) trial.hierarchy();  // The threads only read it.
  std::vector<Placing> placings((count + kElementsOfBlock - 1) / kElementsOfBlock);
  parallel_for(count, kElementsOfBlock, trial.threads_, [&](std::size_t begin, std::size_t end) {
    Placing placing;
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t enough = placing.failed.size() + std::max<std::size_t>(trial.most_failures_, 1);
      for (std::size_t k = lost[i].begin; k < lost[i + 1].begin; ++k) {
        if (!place(pieces.at(k, *reference_), lost[i].first, trial, placing) && placing.failed.size() == enough) break;
      }
    }
    placing.stack = {};
    placings[begin / kElementsOfBlock] = std::move(placing);
  });
  Placing& all = trial.placing_;
  for (Placing& placing : placings) {
    all.moved.append(placing.moved);
    all.goals.insert(all.goals.end(), placing.goals.begin(), placing.goals.end());
    all.failed.insert(all.failed.end(), placing.failed.begin(), placing.failed.end());
    all.looked_at += placing.looked_at;
    placing = {};
  }
  return all.failed.empty();
}

void Coverage::commit(const Trial& trial) {
  const PieceList& moved = trial.placing_.moved;
  // Counts grow before they shrink, so that no count is ever less than the number of pieces.
  for (const Part& part : moved.parts()) split_into_[part.of].fetch_add(1, std::memory_order_relaxed);
  trial.for_each_replaced_part(pieces_,
                               [&](const Part& part) { split_into_[part.of].fetch_sub(1, std::memory_order_relaxed); });
  for (const Trial::Candidate& c : trial.candidates_) {
    if (c.replaced) pieces_[c.id].clear();
    distance_[c.id] = c.distance;
  }
  for (const Trial::RemovedList& h : trial.removed_lists_) {
    // This frees the memory of the element, which is gone; clear() would keep it.
    const PieceList pieces = std::exchange(pieces_[h.id], {});
    distance_[h.id] = kNoPiece;
    if (h.whole) pieces_[trial.candidates_[h.successor].id].append(pieces);
  }
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const Goal& goal = trial.placing_.goals[i];
    const std::uint32_t to = trial.candidates_[goal.element].id;
    pieces_[to].push_back(moved.at(i, *reference_));
    distance_[to] = std::max(distance_[to], goal.distance);
  }
}

}  // namespace tolvol
