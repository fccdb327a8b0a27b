// SPDX-License-Identifier: GPL-3.0-or-later
// Builds a hierarchy; hierarchy.cpp searches it, and tells what local coordinates and spreads are.
//
// The tree follows C. Lauterbach et al., Fast BVH Construction on GPUs, 2009 (sort by Morton code, split where the
// highest bit changes). It is collapsed to nodes of eight children whose boxes are tested together, after I. Wald, C.
// Benthin, S. Boulos, Getting Rid of Packets, 2008. A triangle is a child like any other: there are no leaf lists.
//
// A needle across the axes fills little of its box, and a search among many needles would look at most of them. A node
// has boxes turned along the triangles instead if these are smaller by half (geometry/oriented_boxes).
//
// Needles that share a corner, the hub, do not fill turned boxes either: each is as wide at the hub as at the other
// end, so that near the hub a search would look at all of them. They are cut into slices, each kTaper times as far from
// the hub as the one before, with boxes of their own. A line of a cut is as far from the hub on both edges there: a
// line parallel to the opposite edge would be as long as the needle if only one of its edges at the hub is short. A
// slice is a child like a triangle, and stands for the whole triangle, so that the nearest triangle does not depend on
// the slices. Their corners are computed in local coordinates, where they err by less than 7e-14: a share of an edge by
// less than 9 u / kSharp, u = 2^-53, and an edge is at most 3.5 long. kSliceRoom is for that.
#include <algorithm>
#include <bit>
#include <cmath>

#include "geometry/hierarchy.h"

namespace tolvol {
namespace {

struct Key {
  std::uint64_t code;
  std::uint32_t triangle;
  std::uint32_t slice = Hierarchy::kNone;  // an index in slices_, or kNone for a whole triangle
};

/// A corner that at least this many triangles share is a hub.
constexpr std::uint32_t kHub = 64;
constexpr float kTaper = 8;
/// Widens the boxes of slices, in local coordinates.
constexpr double kSliceRoom = 1e-13;
/// Slices overlap by this share, so that what rounding puts into the next one is in the box of either.
constexpr double kOverlap = 1e-9;
/// The edge opposite the hub is cut only if its ends differ by this share in their distances from the hub. Where a line
/// meets it is not sharp else.
constexpr double kSharp = 1.0 / 16;

/// Sorts by the least significant digit first, which is stable, so that equal codes stay in the order of their index.
void radix_sort(std::vector<Key>& keys) {
  constexpr int kBits = 11;
  std::vector<Key> other(keys.size());
  for (int shift = 0; shift < 63; shift += kBits) {
    std::array<std::uint32_t, (1 << kBits) + 1> start{};
    auto digit = [&](const Key& key) { return key.code >> shift & ((1 << kBits) - 1); };
    poll();
    for (const Key& key : keys) ++start[digit(key) + 1];
    for (int i = 0; i < 1 << kBits; ++i) start[i + 1] += start[i];
    poll();
    for (const Key& key : keys) other[start[digit(key)]++] = key;
    keys.swap(other);
  }
}

/// Returns the lowest 21 bits of x with two zeros between them.
std::uint64_t spread_bits(std::uint64_t x) {
  x &= 0x1FFFFF;
  x = (x | x << 32) & 0x1F00000000FFFF;
  x = (x | x << 16) & 0x1F0000FF0000FF;
  x = (x | x << 8) & 0x100F00F00F00F00F;
  x = (x | x << 4) & 0x10C30C30C30C30C3;
  return (x | x << 2) & 0x1249249249249249;
}

struct FloatBox {
  float lower[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF}, upper[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

  void add(const FloatBox& box) {
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], box.lower[k]);
      upper[k] = std::max(upper[k], box.upper[k]);
    }
  }
};

/// Returns the length by which a side of a box at x is moved outwards (hierarchy.cpp).
float spread(float x) { return std::abs(x) * 2.4e-7f + 1e-37f; }

}  // namespace

struct Hierarchy::Build {
  using Outline = std::array<glm::dvec3, 5>;

  Hierarchy& tree;
  std::vector<Key> keys;
  std::vector<Outline> outlines{};  // of slices_, local
  struct Range {
    std::uint32_t begin, end;
  };

  std::vector<double> taken{};  // holds twice the area of the triangles sorted before a place

  /// Leaves the first of each set of triangles with exactly the same corners in the same order, and chains the others
  /// to it, because a thousand copies would be a thousand ties to look at in every search.
  void join_twins(const TriangleMesh& mesh) {
    const auto corner = [&](const Key& key, int k) -> const glm::dvec3& {
      return mesh.vertices[mesh.triangles[key.triangle][k]];
    };
    std::size_t compared = 0;
    const auto order = [&](const Key& x, const Key& y) {  // returns -1, 0 or 1
      poll_at(++compared);
      for (int i = 0; i < 9; ++i) {
        const double u = corner(x, i / 3)[i % 3], v = corner(y, i / 3)[i % 3];
        if (u != v) return u < v ? -1 : 1;
      }
      return 0;
    };
    std::size_t kept = 0;
    std::uint32_t last = kNone;
    for (std::size_t begin = 0, end; begin < keys.size(); begin = end) {
      for (end = begin + 1; end < keys.size() && keys[end].code == keys[begin].code;) ++end;
      if (end - begin > 1) {
        std::sort(keys.begin() + begin, keys.begin() + end, [&](const Key& x, const Key& y) {
          const int o = order(x, y);
          return o != 0 ? o < 0 : x.triangle < y.triangle;
        });
      }
      for (std::size_t i = begin; i < end; ++i) {
        if (i > begin && order(keys[i - 1], keys[i]) == 0) {
          if (tree.twin_.empty()) tree.twin_.assign(mesh.triangles.size(), kNone);
          tree.twin_[last] = keys[i].triangle;
        } else {
          keys[kept++] = keys[i];
        }
        last = keys[i].triangle;
      }
    }
    keys.resize(kept);
  }

  /// Returns the Morton code of the middle of a box, in local coordinates.
  static std::uint64_t code_of(const glm::dvec3& middle) {
    std::uint64_t code = 0;
    for (int k = 0; k < 3; ++k) {
      const double cell = (middle[k] + 1) * 0x1p20;
      code |= spread_bits(std::uint64_t(std::clamp(cell, 0.0, double(0x1FFFFF)))) << k;
    }
    return code;
  }

  /// Returns for each triangle of `keys` its hub, or 3 if it has none, and into how many slices it is cut.
  std::vector<std::pair<std::uint8_t, std::uint8_t>> find_hubs(const TriangleMesh& mesh) const {
    // Corners at one place are counted by a hash. Another place with the same hash may make a hub of one that is none,
    // which costs a little time.
    const std::size_t slots = std::bit_ceil(2 * mesh.triangles.size());
    std::vector<std::uint32_t> count(slots);
    std::uint32_t most = 0;
    const auto slot_of = [&](const Key& key, int k) {
      std::uint64_t hash = 0;
      const glm::dvec3 p = mesh.vertices[mesh.triangles[key.triangle][k]] + 0.0;  // makes 0 of -0
      for (int i = 0; i < 3; ++i) {
        hash = (hash ^ std::bit_cast<std::uint64_t>(p[i])) * 0x9E3779B97F4A7C15u;
        hash ^= hash >> 32;
      }
      return hash & (slots - 1);
    };
    for (std::size_t i = 0; i < keys.size(); ++i) {
      poll_at(i);
      for (int k = 0; k < 3; ++k) most = std::max(most, ++count[slot_of(keys[i], k)]);
    }
    std::vector<std::pair<std::uint8_t, std::uint8_t>> hubs;
    if (most < kHub) return hubs;
    hubs.reserve(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) {
      poll_at(i);
      std::uint32_t sharing = kHub - 1;
      std::pair<std::uint8_t, std::uint8_t> hub{std::uint8_t(3), std::uint8_t(1)};
      for (std::uint8_t k = 0; k < 3; ++k) {
        const std::uint32_t n = count[slot_of(keys[i], k)];
        if (n > sharing) sharing = n, hub.first = k;
      }
      float reach = kTaper;
      while (hub.first < 3 && reach < float(sharing)) reach *= kTaper, ++hub.second;
      hubs.push_back(hub);
    }
    return hubs;
  }

  /// Returns the local corners of a convex part of a triangle that holds a slice. Where there are fewer than five, some
  /// are the same.
  Outline outline(const Corners& triangle, const Slice& slice) const {
    const Corners t{triangle[0] - tree.centre_, triangle[1] - tree.centre_, triangle[2] - tree.centre_};
    if (slice.from == 0 && slice.to > 1) return {t[0], t[1], t[2], t[2], t[2]};
    const Legs legs(triangle, slice.hub);
    const glm::dvec3 &hub = t[slice.hub], &b = t[(slice.hub + 1) % 3], &c = t[(slice.hub + 2) % 3];
    const glm::dvec3 &near = legs.b < legs.c ? b : c, &far = legs.b < legs.c ? c : b;
    const double middle = std::min(legs.b, legs.c) / legs.longer();
    const auto between = [](const glm::dvec3& p, const glm::dvec3& q, double share) { return p + share * (q - p); };
    // Returns where a line is on the way from the hub over the near corner to the far one.
    const auto opposite = [&](double at, const glm::dvec3& if_not_sharp) {
      if (at < middle) return between(hub, near, at / middle);
      return 1 - middle < kSharp ? if_not_sharp : between(near, far, (at - middle) / (1 - middle));
    };
    const double from = slice.from * (1 - kOverlap), to = std::min(1.0, slice.to * (1 + kOverlap));
    const glm::dvec3 lower = opposite(from, near), upper = opposite(to, far);
    return {between(hub, far, from), between(hub, far, to), upper, from < middle && middle <= to ? near : upper, lower};
  }

  /// Cuts the triangles around hubs into slices, and sorts these among the other triangles.
  void cut_at_hubs(const TriangleMesh& mesh) {
    const std::vector<std::pair<std::uint8_t, std::uint8_t>> hubs = find_hubs(mesh);
    if (hubs.empty()) return;
    std::vector<Key> all;
    all.reserve(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) {
      poll_at(i);
      const auto& [hub, slices] = hubs[i];
      const glm::uvec3& t = mesh.triangles[keys[i].triangle];
      const Corners corners{tree.scaled(mesh.vertices[t.x]), tree.scaled(mesh.vertices[t.y]),
                            tree.scaled(mesh.vertices[t.z])};
      if (slices == 1 || !(Legs(corners, hub).longer() > 0)) {  // A point stays whole, too.
        all.push_back(keys[i]);
        continue;
      }
      float to = std::numeric_limits<float>::infinity(), from = 1 / kTaper;
      for (std::uint8_t k = 0; k < slices; ++k, to = from, from /= kTaper) {
        const Slice slice{k + 1 == slices ? 0 : from, to, hub};
        const Outline o = outline(corners, slice);
        Box box;
        for (const glm::dvec3& corner : o) box.add(corner);
        all.push_back(
            {code_of(0.5 * box.lower + 0.5 * box.upper), keys[i].triangle, std::uint32_t(tree.slices_.size())});
        tree.slices_.push_back(slice);
        outlines.push_back(o);
      }
    }
    keys.swap(all);
    radix_sort(keys);
  }

  FloatBox triangle_box(std::uint32_t place) const {
    FloatBox box;
    if (const std::uint32_t slice = keys[place].slice; slice != kNone) {
      for (int k = 0; k < 3; ++k) {
        const Outline& o = outlines[slice];
        const float lower = float(std::min({o[0][k], o[1][k], o[2][k], o[3][k], o[4][k]}));
        const float upper = float(std::max({o[0][k], o[1][k], o[2][k], o[3][k], o[4][k]}));
        box.lower[k] = lower - spread(lower) - float(kSliceRoom);
        box.upper[k] = upper + spread(upper) + float(kSliceRoom);
      }
      return box;
    }
    const Corners& t = tree.corners_[place];
    for (int k = 0; k < 3; ++k) {
      const float lower = float(std::min({t[0][k], t[1][k], t[2][k]}) - tree.centre_[k]);
      const float upper = float(std::max({t[0][k], t[1][k], t[2][k]}) - tree.centre_[k]);
      box.lower[k] = lower - spread(lower);
      box.upper[k] = upper + spread(upper);
    }
    return box;
  }

  /// Returns where the highest bit that differs within the range changes, or the middle if all codes are equal.
  std::uint32_t split(Range range) const {
    const std::uint64_t first = keys[range.begin].code, last = keys[range.end - 1].code;
    if (first == last) return range.begin + (range.end - range.begin) / 2;
    const std::uint64_t high = last & ~(std::bit_floor(first ^ last) - 1);
    const auto at = std::partition_point(keys.begin() + range.begin, keys.begin() + range.end,
                                         [&](const Key& key) { return key.code < high; });
    return std::uint32_t(at - keys.begin());
  }

  void sum_areas() {
    taken.reserve(tree.corners_.size() + 1);
    taken.assign(1, 0);
    for (std::size_t place = 0; place < tree.corners_.size(); ++place) {
      poll_at(place);
      if (const std::uint32_t slice = keys[place].slice; slice != kNone) {
        const auto& [p, q, r, s, t] = outlines[slice];
        taken.push_back(taken.back() +
                        glm::length(glm::cross(q - p, r - p) + glm::cross(r - p, s - p) + glm::cross(s - p, t - p)));
        continue;
      }
      const Corners& t = tree.corners_[place];
      taken.push_back(taken.back() + glm::length(glm::cross(t[1] - t[0], t[2] - t[0])));
    }
  }

  /// Makes box i of some boxes hold the triangles and slices of a range. Returns half the area of the box.
  double fit(OrientedBoxes& boxes, int i, Range range) const {
    const std::size_t count = range.end - range.begin;
    const auto begin = keys.begin() + range.begin, end = keys.begin() + range.end;
    if (std::all_of(begin, end, [](const Key& key) { return key.slice == kNone; })) {
      return boxes.fit(i, std::span<const Corners>(&tree.corners_[range.begin], count), tree.centre_, 0);
    }
    std::vector<Outline> around;
    around.reserve(count);
    for (std::uint32_t place = range.begin; place < range.end; ++place) {
      const std::uint32_t slice = keys[place].slice;
      around.push_back(slice == kNone ? outline(tree.corners_[place], {}) : outlines[slice]);
    }
    return boxes.fit(i, std::span<const Outline>(around), glm::dvec3(0), kSliceRoom);
  }

  /// Gives the node, whose box is `whole`, oriented boxes if its boxes along the axes overlap or are mostly empty, and
  /// if oriented boxes are smaller by half.
  void orient(std::uint32_t index, const FloatBox& whole, Range range, std::span<const Range> parts) {
    constexpr double kLarge = 4, kSmaller = 0.5;
    const auto half_area = [](double x, double y, double z) { return x * y + y * z + z * x; };
    const double around =
        half_area(whole.upper[0] - whole.lower[0], whole.upper[1] - whole.lower[1], whole.upper[2] - whole.lower[2]);
    const Node& node = tree.nodes_[index];
    double along_axes = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      along_axes += half_area(node.upper[0][i] - node.lower[0][i], node.upper[1][i] - node.lower[1][i],
                              node.upper[2][i] - node.lower[2][i]);
    }
    if (along_axes < kLarge * std::min(around, taken[range.end] - taken[range.begin])) return;
    OrientedBoxes boxes;
    double oriented = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      oriented += fit(boxes, int(i), parts[i]);
    }
    if (oriented > kSmaller * along_axes) return;
    tree.turned_.resize(tree.nodes_.size(), kNone);
    tree.turned_[index] = std::uint32_t(tree.oriented_.size());
    tree.oriented_.push_back(boxes);
  }

  /// Makes the node of a range and the nodes below it, and returns its box. walk_in explains why this is at most 95
  /// deep.
  FloatBox make(Range range) {
    std::array<Range, kWidth> parts{range};
    int count = 1;
    while (count < kWidth) {
      int largest = 0;
      for (int i = 1; i < count; ++i) {
        if (parts[i].end - parts[i].begin > parts[largest].end - parts[largest].begin) largest = i;
      }
      if (parts[largest].end - parts[largest].begin < 2) break;
      const std::uint32_t middle = split(parts[largest]);
      parts[count++] = {middle, parts[largest].end};
      parts[largest].end = middle;
    }
    const std::size_t index = tree.nodes_.size();
    poll_at(index);
    tree.nodes_.emplace_back();
    FloatBox whole;
    for (int i = 0; i < kWidth; ++i) {
      FloatBox box;
      std::uint32_t child = kTriangle;  // an empty child is never followed, because its box is infinitely far
      if (i < count) {
        const bool is_triangle = parts[i].end - parts[i].begin == 1;
        child = is_triangle ? kTriangle | parts[i].begin : std::uint32_t(tree.nodes_.size());
        box = is_triangle ? triangle_box(parts[i].begin) : make(parts[i]);
      }
      Node& node = tree.nodes_[index];
      node.child[i] = child;
      for (int k = 0; k < 3; ++k) node.lower[k][i] = box.lower[k], node.upper[k][i] = box.upper[k];
      whole.add(box);
    }
    orient(std::uint32_t(index), whole, range, {parts.data(), std::size_t(count)});
    return whole;
  }
};

Hierarchy::Hierarchy(const TriangleMesh& mesh) {
  Box box;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) box.add(mesh.vertices[t[k]]);
  }
  if (box.empty()) return;
  const glm::dvec3 half = 0.5 * box.upper - 0.5 * box.lower;
  const double size = std::max({half.x, half.y, half.z});
  // A mesh that is one point counts as large as its coordinates, so that these do not overflow.
  const glm::dvec3 far = glm::max(glm::abs(box.lower), glm::abs(box.upper));
  const double unit = size > 0 ? size : std::max({far.x, far.y, far.z});
  scale_ = unit > 0 ? std::ldexp(1.0, -std::clamp(std::ilogb(unit) + 1, -1000, 1000)) : 1;
  centre_ = 0.5 * scaled(box.upper) + 0.5 * scaled(box.lower);

  const std::size_t count = mesh.triangles.size();
  Build build{*this, std::vector<Key>(count)};
  place_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    poll_at(i);
    const glm::uvec3& t = mesh.triangles[i];
    const glm::dvec3 &a = mesh.vertices[t.x], &b = mesh.vertices[t.y], &c = mesh.vertices[t.z];
    const glm::dvec3 middle =
        0.5 * scaled(glm::min(a, glm::min(b, c))) + 0.5 * scaled(glm::max(a, glm::max(b, c))) - centre_;
    build.keys[i] = {Build::code_of(middle), std::uint32_t(i)};
  }
  radix_sort(build.keys);
  build.join_twins(mesh);
  build.cut_at_hubs(mesh);
  corners_.resize(build.keys.size());
  triangle_.resize(build.keys.size());
  if (!slices_.empty()) slice_.reserve(build.keys.size());
  for (std::uint32_t place = 0; place < build.keys.size(); ++place) {
    poll_at(place);
    const std::uint32_t index = build.keys[place].triangle;
    triangle_[place] = index;
    if (!slices_.empty()) slice_.push_back(build.keys[place].slice);
    for (int k = 0; k < 3; ++k) corners_[place][k] = scaled(mesh.vertices[mesh.triangles[index][k]]);
    for (std::uint32_t i = index; i != kNone; i = twin(i)) place_[i] = place;
  }
  nodes_.reserve(build.keys.size() / 3 + 1);
  build.sum_areas();
  build.make({0, std::uint32_t(build.keys.size())});
  if (!turned_.empty()) turned_.resize(nodes_.size(), kNone);
}

}  // namespace tolvol
