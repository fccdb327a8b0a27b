// SPDX-License-Identifier: GPL-3.0-or-later
/// Pieces of a reference's triangles, in order. At first nearly every list holds one whole triangle, and takes 16 bytes
/// for it; a Part takes 80.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "check/part.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class PieceList {
 public:
  std::size_t size() const { return several_ ? several_->names.size() : only_ != kNone; }
  bool empty() const { return size() == 0; }

  /// Adds a piece. One without cuts is the whole triangle that it is `of`.
  void push_back(const Part& piece) {
    if (piece.cuts == 0) return push_back_name(piece.of);
    Several& to = several();
    to.names.push_back(kPart | static_cast<std::uint32_t>(to.parts.size()));
    to.parts.push_back(piece);
  }
  void append(const PieceList& other) {
    if (!other.several_) {
      if (other.only_ != kNone) push_back_name(other.only_);
      return;
    }
    Several& to = several();
    const auto before = static_cast<std::uint32_t>(to.parts.size());
    for (const std::uint32_t name : other.several_->names) to.names.push_back(name & kPart ? name + before : name);
    to.parts.insert(to.parts.end(), other.several_->parts.begin(), other.several_->parts.end());
  }
  /// Keeps the memory for further pieces.
  void clear() {
    only_ = kNone;
    if (several_) several_->names.clear(), several_->parts.clear();
  }

  /// The piece at a place of the list; `reference` has its triangle.
  Part at(std::size_t place, const TriangleMesh& reference) const {
    const std::uint32_t name = several_ ? several_->names[place] : only_;
    return name & kPart ? several_->parts[name & ~kPart] : whole(name, reference);
  }
  static Part whole(std::uint32_t triangle, const TriangleMesh& reference) {
    const glm::uvec3& t = reference.triangles[triangle];
    return {{reference.vertices[t.x], reference.vertices[t.y], reference.vertices[t.z]}, 0, triangle};
  }
  /// Those of the pieces that are not whole triangles, in order.
  std::span<const Part> parts() const {
    return several_ ? std::span<const Part>(several_->parts) : std::span<const Part>();
  }

 private:
  static constexpr std::uint32_t kPart = 0x80000000u, kNone = 0xFFFFFFFFu;

  struct Several {
    std::vector<std::uint32_t> names;  ///< of each piece: its triangle, or kPart and its place in `parts`
    std::vector<Part> parts;
  };

  Several& several() {
    if (!several_) {
      several_ = std::make_unique<Several>();
      if (only_ != kNone) several_->names.push_back(std::exchange(only_, kNone));
    }
    return *several_;
  }
  void push_back_name(std::uint32_t name) {
    if (several_ || only_ != kNone) {
      several().names.push_back(name);
    } else {
      only_ = name;
    }
  }

  std::uint32_t only_ = kNone;        ///< The one whole triangle, as long as there has been no other piece.
  std::unique_ptr<Several> several_;  ///< All pieces, in any other list that is not empty.
};
static_assert(sizeof(PieceList) == 16);

}  // namespace tolvol
