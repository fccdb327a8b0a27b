// SPDX-License-Identifier: GPL-3.0-or-later
/// Pieces of a reference's triangles, in order. Nearly all pieces are whole triangles, of which only the number is
/// kept: 4 bytes instead of the 80 of a Part.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "check/part.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class PieceList {
 public:
  std::size_t size() const { return names_.size(); }
  bool empty() const { return names_.empty(); }

  /// Adds a piece. One without cuts is the whole triangle that it is `of`.
  void push_back(const Part& piece) {
    if (piece.cuts == 0) return names_.push_back(piece.of);
    if (!parts_) parts_ = std::make_unique<std::vector<Part>>();
    names_.push_back(kPart | static_cast<std::uint32_t>(parts_->size()));
    parts_->push_back(piece);
  }
  void append(const PieceList& other) {
    const std::size_t before = parts_ ? parts_->size() : 0;
    for (const std::uint32_t name : other.names_) {
      names_.push_back(name & kPart ? name + static_cast<std::uint32_t>(before) : name);
    }
    if (!other.parts_) return;
    if (!parts_) parts_ = std::make_unique<std::vector<Part>>();
    parts_->insert(parts_->end(), other.parts_->begin(), other.parts_->end());
  }
  /// Keeps the memory for further pieces.
  void clear() {
    names_.clear();
    if (parts_) parts_->clear();
  }

  /// The piece at a place of the list; `reference` has its triangle.
  Part at(std::size_t place, const TriangleMesh& reference) const {
    const std::uint32_t name = names_[place];
    return name & kPart ? (*parts_)[name & ~kPart] : whole(name, reference);
  }
  static Part whole(std::uint32_t triangle, const TriangleMesh& reference) {
    const glm::uvec3& t = reference.triangles[triangle];
    return {{reference.vertices[t.x], reference.vertices[t.y], reference.vertices[t.z]}, 0, triangle};
  }
  /// Those of the pieces that are not whole triangles, in order.
  std::span<const Part> parts() const { return parts_ ? std::span<const Part>(*parts_) : std::span<const Part>(); }

 private:
  static constexpr std::uint32_t kPart = 0x80000000u;

  std::vector<std::uint32_t> names_;          ///< of each piece: its triangle, or kPart and its place in parts_
  std::unique_ptr<std::vector<Part>> parts_;  ///< null until there is one: most lists have none
};

}  // namespace tolvol
