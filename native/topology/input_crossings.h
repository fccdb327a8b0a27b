// SPDX-License-Identifier: GPL-3.0-or-later
/// Which faces of a mesh crossed each other (topology/faces_cross.h) as it came in, asked about a few faces at a time.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <shared_mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include "topology/faces_cross.h"
#include "topology/near_faces.h"

namespace tolvol {

class InputCrossings {
 public:
  /// Calls visit(other) for the faces that a face may cross, and for others, until it returns false. Returns false if
  /// it has called it for none, because that would take too long.
  using FindNear = std::function<bool(std::uint32_t face, const std::function<bool(std::uint32_t)>& visit)>;

  /// The positions are as they are stored. `fixed` are further faces, whose numbers follow on the others'. Without
  /// `find_near`, and where that returns false, faces are searched in a tree, which is built when it is first needed.
  /// O(1).
  InputCrossings(const MeshView& input, std::vector<Corners> fixed, FindNear find_near = {})
      : input_(input), fixed_(std::move(fixed)), find_near_(std::move(find_near)) {}

  Corners corners(std::uint32_t face) const {
    const std::size_t count = input_.triangles.size();
    return face < count ? input_.corners(face) : fixed_[face - count];
  }
  /// The fixed faces among them.
  std::size_t face_count() const { return input_.triangles.size() + fixed_.size(); }

  // Several threads may ask any of these at once.

  /// Whether two faces are of one double sheet (topology/double_sheets.h). Costs as keep_crossing() does; the first
  /// time that both cross others it takes about 1 us for each face of the mesh.
  bool are_of_one_sheet(std::uint32_t a, std::uint32_t b) const;
  /// Whether two faces crossed that are not of one double sheet.
  bool crossed(std::uint32_t a, std::uint32_t b) const;
  /// Whether crossed() holds for a face of `a` and a face of `b`. No face is in both. Costs as keep_crossing() does,
  /// then O(k log k) for the k faces of `b`, and about 5 ns for each pair whose boxes do not meet. Once a face of `a`
  /// was asked about with very many others, all that it crosses is found and kept. From then on each question about it
  /// is a search in a sorted list.
  bool any_crossed(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) const;
  /// The places in `a`, in rising order, of the faces for which crossed() holds with a face of `b`. No face is in both,
  /// and keep_crossing() keeps all of them. Costs as any_crossed() does.
  std::vector<std::uint32_t> which_crossed(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) const;
  /// Takes away the faces that crossed no other. It takes about 3 us for each face that it is asked about for the first
  /// time, and 0.2 us for each face of the mesh if it has to build the tree.
  void keep_crossing(std::vector<std::uint32_t>& faces) const;

 private:
  enum State : std::uint8_t { unknown, crossing, clear };
  struct Boxed {
    std::uint32_t face;
    Corners corners;
    Box box;
  };

  std::vector<Boxed> boxed(std::span<const std::uint32_t> faces) const;
  std::size_t first_crossed(std::span<const std::uint32_t> faces, std::span<const Boxed> others, std::size_t first,
                            std::size_t& turn) const;

  const std::vector<std::uint32_t>* all_crossed(std::uint32_t face, std::size_t asked_now) const;
  bool crosses_another(std::uint32_t face) const;
  void for_each_crossing(std::uint32_t face, const std::function<bool(std::uint32_t)>& visit) const;
  void build_tree() const;
  void find_sheets() const;

  MeshView input_;
  std::vector<Corners> fixed_;
  FindNear find_near_;
  mutable std::once_flag sheets_known_, states_ready_, counts_ready_, tree_ready_;
  mutable std::vector<std::uint32_t> sheets_;             ///< per face, found when first needed
  mutable NearFaces near_;                                ///< all faces, made when first needed
  mutable std::vector<std::atomic<std::uint8_t>> state_;  ///< per face: a State, made when first needed
  /// Per face: how many pairs with it were asked about before it has a list, made when first needed.
  mutable std::vector<std::atomic<std::uint32_t>> asked_;
  mutable std::shared_mutex lists_mutex_;
  mutable std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> lists_;  ///< as all_crossed() returns them
  mutable std::size_t in_lists_ = 0;                                             ///< the number of faces in all lists
};

}  // namespace tolvol
