// SPDX-License-Identifier: GPL-3.0-or-later
/// The backward direction keeps every point of the reference within the tolerance of the result: every piece of the
/// reference has one element of the current mesh (a face; for boundaries an edge) as its witness.
///
/// This is the certificate with the roles exchanged: a piece whose three corners are within epsilon of one element is
/// within epsilon of it as a whole. A change of the mesh must find a new witness for each piece of the elements it
/// replaces, and splits a piece that no single element covers. One piece without a witness refuses the change. If all
/// pieces of a triangle of the reference need new witnesses, the search begins with the whole triangle again. A change
/// of many elements begins with the pieces where a triangle has very many, which it would only be split into again.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "check/part.h"
#include "check/piece_list.h"
#include "check/witness.h"
#include "geometry/hierarchy.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class Coverage {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  /// An element as the change would leave it. A point of it that the change carries along moves by at most `moved`.
  struct Element {
    std::uint32_t id;
    glm::dvec3 corners[3];
    double moved;
  };
  /// An element that the change removes. Its points move by at most `moved`, to the element at index `successor` of the
  /// change.
  struct Removed {
    std::uint32_t id;
    std::uint32_t successor;
    double moved;
  };

  /// `limit` is the provable distance in the frame. Keeps a reference to `reference`.
  Coverage(const TriangleMesh& reference, double limit, std::size_t element_count);

  /// Makes the element the witness of a triangle of the reference that coincides with it.
  void set_witness(std::uint32_t element, std::uint32_t triangle);

  /// What find_witnesses() leaves without a witness.
  struct Uncovered {
    std::vector<std::uint32_t> triangles;  ///< Triangles of the reference of which a piece has no witness.
    std::vector<std::uint32_t> nearest;    ///< The triangle of the mesh nearest to each such piece.
    std::vector<Part> in_part;             ///< Those of the pieces of which the mesh may cover a part.
  };
  /// Finds witnesses for triangles of the reference, whose numbers ascend, among the triangles of a mesh. `ids[i]` is
  /// the element that triangle i of the mesh is, or kNone if it never changes. A piece farther than `provable` from all
  /// triangles gets no witness; in a triangle with a point that far, a small part near the mesh may get none either.
  /// Uses this many threads (0: one for each core), which never change a result.
  /// About 0.5 us a triangle on one thread where one face covers all of it.
  Uncovered find_witnesses(std::span<const std::uint32_t> triangles, const TriangleMesh& mesh,
                           std::span<const std::uint32_t> ids, double provable, unsigned threads, Progress* progress);

  /// A point that stands for a piece. sample() adds one for every `stride`-th piece of the element.
  struct Sample {
    glm::dvec3 point;
    double area;
  };
  void sample(std::uint32_t element, std::size_t stride, std::vector<Sample>& out) const;

  /// Adds the corners and centroids of every `stride`-th piece of the element.
  void points(std::uint32_t element, std::size_t stride, std::vector<glm::dvec3>& out) const;
  std::size_t piece_count(std::uint32_t element) const { return pieces_[element].size(); }

  /// Tells whether the element is still the witness of all its pieces, without a look at them, when its points move by
  /// at most `moved`.
  bool settles(std::uint32_t element, double moved) const { return distance_after(element, moved) <= limit_; }
  /// Carries out such a motion.
  void carry(std::uint32_t element, double moved) { distance_[element] = distance_after(element, moved); }

  struct Failure;
  class Trial;
  /// Tells whether all pieces of the elements of a change have witnesses among `elements`. An element that does not
  /// move keeps its pieces. Only reads: nothing changes until commit().
  bool try_change(std::span<const Element> elements, std::span<const Removed> removed, Trial& trial) const;
  /// Carries out the last change that was tried, which must have succeeded on this state.
  void commit(const Trial& trial);

 private:
  /// The distance of an element without pieces.
  static constexpr double kNoPiece = -std::numeric_limits<double>::infinity();
  /// Where a piece goes, and how far it is from that element at most.
  struct Goal {
    std::uint32_t element;
    double distance;
  };

  /// The distance of an element whose points move by at most `moved`, which may be infinite.
  double distance_after(std::uint32_t element, double moved) const {
    return distance_[element] == kNoPiece ? kNoPiece : distance_[element] + moved;
  }
  Part whole(std::uint32_t triangle) const { return PieceList::whole(triangle, *reference_); }
  void find_witnesses_of(std::uint32_t triangle, const Hierarchy::Common& of_whole, const TriangleMesh& mesh,
                         const Hierarchy& hierarchy, std::span<const std::uint32_t> ids, double provable,
                         Uncovered& uncovered);
  bool may_look(std::size_t looked, std::size_t parts, bool found_beyond);
  struct Placing;
  template <class Call>
  bool for_each_to_place(const PieceList& pieces, bool of_many, std::vector<std::uint32_t>& gathered,
                         Call&& call) const;
  bool place_all(Trial& trial, std::vector<std::uint32_t>& gathered) const;
  bool place_in_blocks(Trial& trial, std::vector<std::uint32_t>& gathered) const;
  bool place(const Part& whole, std::uint32_t first, const Trial& trial, Placing& placing) const;

  const TriangleMesh* reference_;
  double limit_, limit2_;
  std::vector<PieceList> pieces_;  ///< of each element
  std::vector<double> distance_;   ///< No piece of the element is farther than this from it.
  /// The number of parts that find_witnesses() may still look at, when a triangle has taken its own share.
  std::size_t budget_of_first_;
  std::size_t budget_of_beyond_;  ///< The same for triangles with a point beyond the tolerance.
  /// Counts for each triangle of the reference the pieces that it was split into, 0 while it is whole. Other threads
  /// may read a count while it changes, but it is never less than the number of pieces that exist.
  std::vector<std::atomic<std::uint32_t>> split_into_;
};

/// A part of a piece for which a try found no witness, and the number of the element in the change at which it was
/// sought first.
struct Coverage::Failure {
  Part part;
  std::uint32_t element;
};

/// The witnesses that were found for some pieces of a change, and scratch memory.
struct Coverage::Placing {
  PieceList moved;
  std::vector<Goal> goals;  ///< of each of them
  std::vector<Failure> failed;
  std::vector<Part> stack;
  std::size_t budget = 0;     ///< is the number of pieces that this change, or this piece, may still add
  std::size_t looked_at = 0;  ///< counts parts of pieces
  std::uint32_t last = 0;     ///< is the candidate that took the last piece
};

/// Holds what a try found, and its scratch memory. Each thread has a trial of its own.
class Coverage::Trial {
 public:
  /// Starts a series of tries around one place. Their results do not depend on earlier series.
  void begin() { failed_last_ = 0, placing_.looked_at = 0; }
  /// A refused change has one part without a witness in failed(), or, if it is asked for, several of each element.
  void look_for_failures(std::size_t of_each_element) { most_failures_ = of_each_element; }
  /// Expects changes of many elements: a try uses this many threads (0: one for each core), each piece has the budget
  /// of a whole change, so that the result does not depend on the number of elements, and a refused change has a
  /// failure of each element that has one.
  void expect_many_elements(unsigned threads) { of_many_ = true, threads_ = threads; }
  /// What the last try found no witness for.
  std::span<const Failure> failed() const { return placing_.failed; }
  /// The number of parts of pieces that the series has looked at.
  std::size_t looked_at() const { return placing_.looked_at; }

 private:
  friend class Coverage;
  struct Candidate {
    std::uint32_t id;
    WitnessTriangle witness;
    double distance;  ///< no piece that it keeps is farther; kNoPiece if it keeps none
    bool replaced;    ///< tells whether its own pieces are placed anew
  };
  struct RemovedList {
    std::uint32_t id, successor;
    bool whole;  ///< tells whether the list is passed on as it is
  };
  /// Calls call(piece) for all pieces that the change places anew and that are no whole triangles.
  template <class Call>
  void for_each_replaced_part(const std::vector<PieceList>& pieces, Call&& call) const {
    for (const RemovedList& h : removed_lists_) {
      if (!h.whole) std::ranges::for_each(pieces[h.id].parts(), call);
    }
    for (const Candidate& c : candidates_) {
      if (c.replaced) std::ranges::for_each(pieces[c.id].parts(), call);
    }
  }

  /// Holds the elements, and is built when there are too many candidates to look at each.
  const Hierarchy& hierarchy() const;

  std::vector<Candidate> candidates_;
  std::vector<RemovedList> removed_lists_;
  Placing placing_;
  std::size_t most_failures_ = 0;      ///< of each element, after which the search goes on; 0 ends it at the first
  std::span<const Element> elements_;  ///< are those of the change, while it is tried
  mutable std::optional<Hierarchy> hierarchy_;
  bool of_many_ = false;
  unsigned threads_ = 1;
  std::uint32_t failed_last_ = 0;  ///< is the candidate whose pieces failed last; it comes first, to be refused soon
};

}  // namespace tolvol
