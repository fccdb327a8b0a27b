// SPDX-License-Identifier: GPL-3.0-or-later
/// The backward direction: every piece of the reference has one element of the current mesh (a face; for boundaries an
/// edge) that is its witness, so that every point of the reference stays within the tolerance of the result.
///
/// The certificate with the roles exchanged: a piece whose three corners are within epsilon of one element is within
/// epsilon of it as a whole. A change of the mesh must find a new witness for each piece of the elements it replaces,
/// splitting pieces where one element does not do; one piece without a witness refuses the change. Where all pieces of
/// a triangle of the reference are to find new witnesses, it is taken as a whole again.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "check/part.h"
#include "check/witness.h"
#include "geometry/hierarchy.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class Coverage {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  /// An element as the change would leave it. Any point of it that the change carries along moves by at most `moved`.
  struct Element {
    std::uint32_t id;
    glm::dvec3 corners[3];
    double moved;
  };
  /// An element that the change removes: its points end up in the element at place `successor`, having moved by at most
  /// `moved`.
  struct Removed {
    std::uint32_t id;
    std::uint32_t successor;
    double moved;
  };

  /// `limit`: the provable distance. Keeps a reference to `reference`.
  Coverage(const TriangleMesh& reference, double limit, std::size_t element_count);

  /// A triangle of the reference that is the element itself.
  void set_witness(std::uint32_t element, std::uint32_t triangle);

  /// Finds witnesses for a triangle of the reference among the triangles of a hierarchy; `ids[i]` is the element that
  /// triangle i there is, kNone for one that never changes. Pieces farther than `provable` from all of them count no
  /// further; the nearest triangles are added to `nearest`. Returns whether all of it is covered.
  bool find_witnesses(std::uint32_t triangle, const Hierarchy& hierarchy, std::span<const std::uint32_t> ids,
                      double provable, std::vector<std::uint32_t>& nearest);

  /// Points that stand for the pieces of an element, every `stride`-th of them.
  struct Sample {
    glm::dvec3 point;
    double area;
  };
  void sample(std::uint32_t element, std::size_t stride, std::vector<Sample>& out) const;

  class Trial;
  /// Whether all pieces of the elements named have witnesses among `elements`; only reads. Nothing changes until
  /// commit().
  bool try_change(std::span<const Element> elements, std::span<const Removed> removed, Trial& trial) const;
  /// Carries out the last change tried, which must have succeeded on this state.
  void commit(const Trial& trial);

 private:
  struct List {
    std::vector<Part> pieces;
    double distance = 0;  ///< every piece is within this of the element
  };
  struct Moved {
    Part piece;
    std::uint32_t element;
  };

  Part whole(std::uint32_t triangle) const;
  bool place_all(Trial& trial, std::vector<std::uint32_t>& gathered) const;
  bool place(const Part& whole, std::uint32_t first, Trial& trial) const;

  const TriangleMesh* reference_;
  double limit_, limit2_;
  std::vector<List> lists_;
  /// Per triangle of the reference: the pieces that it was split into, none while it is whole. A count changes while
  /// others read it, yet never looks as if a piece that is elsewhere did not exist.
  std::vector<std::atomic<std::uint32_t>> split_into_;
};

/// What a try found, and its scratch; one a thread.
class Coverage::Trial {
 public:
  /// Starts a series of tries around one place: what they find depends on nothing before.
  void begin() { failed_last_ = 0, looked_at_ = 0; }
  /// Parts of pieces that the series has looked at.
  std::size_t looked_at() const { return looked_at_; }

 private:
  friend class Coverage;
  struct Candidate {
    std::uint32_t id;
    WitnessTriangle witness;
    double distance;
    bool replaced;  ///< its own pieces were looked at one by one
  };
  struct RemovedList {
    std::uint32_t id, successor;
    bool whole;  ///< passed on as it is
  };
  /// Calls call(piece) for all pieces that the change places anew.
  template <class Call>
  void for_each_replaced(const std::vector<List>& lists, Call&& call) const {
    for (const RemovedList& h : removed_lists_) {
      if (!h.whole) std::for_each(lists[h.id].pieces.begin(), lists[h.id].pieces.end(), call);
    }
    for (const Candidate& c : candidates_) {
      if (c.replaced) std::for_each(lists[c.id].pieces.begin(), lists[c.id].pieces.end(), call);
    }
  }

  std::vector<Candidate> candidates_;
  std::vector<RemovedList> removed_lists_;
  std::vector<Moved> moved_;
  std::vector<Part> stack_;
  std::optional<Hierarchy> hierarchy_;  ///< of the candidates, where there are too many to look at each
  std::size_t budget_ = 0;              ///< pieces that this change may still add
  std::size_t looked_at_ = 0;
  std::uint32_t last_ = 0;         ///< the candidate that took the last piece
  std::uint32_t failed_last_ = 0;  ///< the one whose pieces failed last: tried first, to be refused soon
};

}  // namespace tolvol
