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
// Triangles around a corner that many share are cut into slices (geometry/hub_slices). A slice is a child like a
// triangle.
#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "base/parallel.h"
#include "geometry/hierarchy.h"
#include "geometry/hub_slices.h"
#include "geometry/morton_order.h"

namespace tolvol {
namespace {

/// A range of more triangles is divided among the threads.
constexpr std::uint32_t kOfSubtree = 4096;
/// A thread takes this many elements of a loop at once.
constexpr std::size_t kBlock = 4096;
/// A thread gets at least about this many triangles: for fewer, starting it would take longer.
constexpr std::size_t kOfThread = 20'000;

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
  struct Range {
    std::uint32_t begin, end;

    std::uint32_t size() const { return end - begin; }
  };
  /// The at most eight ranges of a node's children.
  struct Parts {
    Range whole;
    int count = 1;
    std::array<Range, kWidth> range{whole};
  };
  /// A range of the sorted order. One thread makes its node and the nodes below it: `nodes` of them from
  /// tree.nodes_[first] on. If the range is large, it makes the node alone, and the parts of the range are the subtrees
  /// from `below` on.
  struct Subtree {
    Range range;
    std::uint32_t nodes = 1, first = 0;
    std::size_t below = 0;
    FloatBox box{};
    std::vector<std::pair<std::uint32_t, OrientedBoxes>> oriented{};  // of nodes, in no order

    bool is_large() const { return range.size() > kOfSubtree; }
  };

  Hierarchy& tree;
  Team& team;
  Unfilled<MortonKey> keys;         // `slice` is an index in slices_, or kNone for a whole triangle
  std::vector<Outline> outlines{};  // of slices_, local
  Unfilled<double> taken{};         // holds twice the area of the triangles sorted before a place

  /// Leaves the first of each set of triangles with exactly the same corners in the same order, and chains the others
  /// to it, because a thousand copies would be a thousand ties to look at in every search.
  void join_twins(const TriangleMesh& mesh) {
    const auto corner = [&](const MortonKey& key, int k) -> const glm::dvec3& {
      return mesh.vertices[mesh.triangles[key.triangle][k]];
    };
    std::size_t compared = 0;
    const auto order = [&](const MortonKey& x, const MortonKey& y) {  // returns -1, 0 or 1
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
        std::sort(keys.begin() + begin, keys.begin() + end, [&](const MortonKey& x, const MortonKey& y) {
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
                                         [&](const MortonKey& key) { return key.code < high; });
    return std::uint32_t(at - keys.begin());
  }

  void place_triangles(const TriangleMesh& mesh) {
    const std::size_t places = keys.size();
    tree.corners_.resize(places);
    tree.triangle_.resize(places);
    tree.place_.resize(mesh.triangles.size());
    if (!tree.slices_.empty()) tree.slice_.resize(places);
    team.run(places, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t place = begin; place < end; ++place) {
        const auto [code, index, slice] = keys[place];
        tree.triangle_[place] = index;
        for (int k = 0; k < 3; ++k) {
          tree.corners_[place][k] = tree.scaled(mesh.vertices[mesh.triangles[index][k]]);
        }
        if (!tree.slices_.empty()) tree.slice_[place] = slice;
        // The slice that ends at the far edge stands for all slices of the triangle.
        if (slice != kNone && std::isfinite(tree.slices_[slice].to)) continue;
        for (std::uint32_t i = index; i != kNone; i = tree.twin(i)) tree.place_[i] = std::uint32_t(place);
      }
    });
  }

  void sum_areas() {
    taken.resize(keys.size() + 1);
    taken[0] = 0;
    team.run(keys.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t place = begin; place < end; ++place) {
        if (const std::uint32_t slice = keys[place].slice; slice != kNone) {
          const auto& [p, q, r, s, t] = outlines[slice];
          taken[place + 1] =
              glm::length(glm::cross(q - p, r - p) + glm::cross(r - p, s - p) + glm::cross(s - p, t - p));
        } else {
          const Corners& t = tree.corners_[place];
          taken[place + 1] = glm::length(glm::cross(t[1] - t[0], t[2] - t[0]));
        }
      }
    });
    for (std::size_t place = 0; place < keys.size(); ++place) {
      poll_at(place);
      taken[place + 1] += taken[place];
    }
  }

  double area(Range range) const { return taken[range.end] - taken[range.begin]; }

  /// Makes box i of some boxes hold the triangles and slices of a range. Returns half the area of the box.
  double fit(OrientedBoxes& boxes, int i, Range range) const {
    const std::size_t count = range.end - range.begin;
    const auto begin = keys.begin() + range.begin, end = keys.begin() + range.end;
    if (std::all_of(begin, end, [](const MortonKey& key) { return key.slice == kNone; })) {
      return boxes.fit(i, std::span<const Corners>(&tree.corners_[range.begin], count), tree.centre_, 0);
    }
    std::vector<Outline> around;
    around.reserve(count);
    for (std::uint32_t place = range.begin; place < range.end; ++place) {
      const std::uint32_t slice = keys[place].slice;
      around.push_back(slice == kNone ? outline(tree.corners_[place], {}, tree.centre_) : outlines[slice]);
    }
    return boxes.fit(i, std::span<const Outline>(around), glm::dvec3(0), kSliceRoom);
  }

  /// Returns oriented boxes for a node, whose box is `whole`, if its boxes along the axes overlap or are mostly empty,
  /// and if oriented boxes are smaller by half.
  std::optional<OrientedBoxes> orient(const Node& node, const FloatBox& whole, const Parts& parts) const {
    constexpr double kLarge = 4, kSmaller = 0.5;
    const auto half_area = [](double x, double y, double z) { return x * y + y * z + z * x; };
    const double around =
        half_area(whole.upper[0] - whole.lower[0], whole.upper[1] - whole.lower[1], whole.upper[2] - whole.lower[2]);
    double along_axes = 0;
    for (int i = 0; i < parts.count; ++i) {
      along_axes += half_area(node.upper[0][i] - node.lower[0][i], node.upper[1][i] - node.lower[1][i],
                              node.upper[2][i] - node.lower[2][i]);
    }
    if (along_axes < kLarge * std::min(around, area(parts.whole))) return {};
    OrientedBoxes boxes;
    double oriented = 0;
    for (int i = 0; i < parts.count; ++i) oriented += fit(boxes, i, parts.range[i]);
    if (oriented > kSmaller * along_axes) return {};
    return boxes;
  }

  Parts parts_of(Range range) const {
    Parts parts{range};
    while (parts.count < kWidth) {
      Range& largest = *std::max_element(parts.range.begin(), parts.range.begin() + parts.count,
                                         [](const Range& a, const Range& b) { return a.size() < b.size(); });
      if (largest.size() < 2) break;
      const std::uint32_t middle = split(largest);
      parts.range[parts.count++] = {middle, largest.end};
      largest.end = middle;
    }
    return parts;
  }

  /// Fills a node and returns its box. child_of(range, box) sets the box of a child and returns its number.
  template <class ChildOf>
  FloatBox fill(std::uint32_t index, const Parts& parts, Subtree& subtree, ChildOf&& child_of) const {
    Node& node = tree.nodes_[index];
    FloatBox whole;
    for (int i = 0; i < kWidth; ++i) {
      FloatBox box;
      node.child[i] = kTriangle;  // an empty child is never followed, because its box is infinitely far
      if (i < parts.count && parts.range[i].size() == 1) {
        node.child[i] |= parts.range[i].begin;
        box = triangle_box(parts.range[i].begin);
      } else if (i < parts.count) {
        node.child[i] = child_of(parts.range[i], box);
      }
      for (int k = 0; k < 3; ++k) node.lower[k][i] = box.lower[k], node.upper[k][i] = box.upper[k];
      whole.add(box);
    }
    if (const auto oriented = orient(node, whole, parts)) subtree.oriented.emplace_back(index, *oriented);
    return whole;
  }

  /// Returns how many nodes the range takes. walk_in explains why this is at most 95 deep.
  std::uint32_t count_nodes(Range range) const {
    const Parts parts = parts_of(range);
    std::uint32_t nodes = 1;
    for (int i = 0; i < parts.count; ++i) {
      if (parts.range[i].size() > 1) nodes += count_nodes(parts.range[i]);
    }
    return nodes;
  }

  /// Makes the node of a range and the nodes below it, from tree.nodes_[next] on, and returns its box.
  FloatBox make(Range range, std::uint32_t& next, Subtree& subtree) const {
    const std::uint32_t index = next++;
    poll_at(index);
    return fill(index, parts_of(range), subtree, [&](Range part, FloatBox& box) {
      const std::uint32_t child = next;
      box = make(part, next, subtree);
      return child;
    });
  }

  /// Makes all nodes, each before those below it, in an order that does not depend on the number of threads.
  void make_nodes() {
    std::vector<Subtree> subtrees(1, Subtree{{0, std::uint32_t(keys.size())}});
    for (std::size_t i = 0; i < subtrees.size(); ++i) {
      if (!subtrees[i].is_large()) continue;
      subtrees[i].below = subtrees.size();
      const Parts parts = parts_of(subtrees[i].range);
      for (int k = 0; k < parts.count; ++k) {
        if (parts.range[k].size() > 1) subtrees.push_back({parts.range[k]});
      }
    }
    const auto for_each_small = [&](auto&& work) {
      team.run(subtrees.size(), 1, [&](std::size_t i, std::size_t) {
        if (!subtrees[i].is_large()) work(subtrees[i]);
      });
    };
    for_each_small([&](Subtree& subtree) { subtree.nodes = count_nodes(subtree.range); });
    std::uint32_t count = 0;
    for (Subtree& subtree : subtrees) subtree.first = std::exchange(count, count + subtree.nodes);
    tree.nodes_.resize(count);
    for_each_small([&](Subtree& subtree) {
      std::uint32_t next = subtree.first;
      subtree.box = make(subtree.range, next, subtree);
    });
    for (std::size_t i = subtrees.size(); i-- > 0;) {
      Subtree& large = subtrees[i];
      if (!large.is_large()) continue;
      large.box =
          fill(large.first, parts_of(large.range), large, [&, next = large.below](Range, FloatBox& box) mutable {
            const Subtree& child = subtrees[next++];
            box = child.box;
            return child.first;
          });
    }
    gather_oriented(subtrees);
  }

  /// Finds the nodes below which there are only slices around one hub. A node comes before those below it.
  void find_hubs() {
    if (tree.slices_.empty()) return;
    tolvol::fill(tree.around_, tree.nodes_.size(), kNone);
    for (std::uint32_t node = tree.node_count(); node-- > 0;) {
      poll_at(node);
      AroundHub all{};
      bool is_around_one = true;
      const auto add = [&](const AroundHub& part) {
        if (all.first == kTriangle) {
          all = part;
          return;
        }
        is_around_one = is_around_one && all.hub == part.hub;
        if (tree.triangle_[part.first] < tree.triangle_[all.first]) all.first = part.first;
        for (int k = 0; k < 3; ++k) {
          all.lower[k] = std::min(all.lower[k], part.lower[k]);
          all.upper[k] = std::max(all.upper[k], part.upper[k]);
        }
      };
      const Node& above = tree.nodes_[node];
      for (int c = 0; c < kWidth && is_around_one; ++c) {
        if (above.lower[0][c] > above.upper[0][c]) continue;  // there is no such child
        const std::uint32_t below = above.child[c], place = below & ~kTriangle;
        if (below & kTriangle) {
          is_around_one = tree.slice_[place] != kNone;
          if (is_around_one) add(around_hub(place));
        } else {
          is_around_one = tree.around_[below] != kNone;
          if (is_around_one) add(tree.hubs_[tree.around_[below]]);
        }
      }
      if (!is_around_one) continue;
      tree.around_[node] = std::uint32_t(tree.hubs_.size());
      tree.hubs_.push_back(all);
    }
  }

  AroundHub around_hub(std::uint32_t place) const {
    const Corners& t = tree.corners_[place];
    const std::uint32_t hub = tree.slices_[tree.slice_[place]].hub;
    const glm::dvec3 to[2] = {t[(hub + 1) % 3] - t[hub], t[(hub + 2) % 3] - t[hub]};
    AroundHub around{t[hub], {}, {}, place};
    for (int k = 0; k < 3; ++k) {
      const auto lower = float(std::min(to[0][k], to[1][k])), upper = float(std::max(to[0][k], to[1][k]));
      around.lower[k] = lower - spread(lower), around.upper[k] = upper + spread(upper);
    }
    return around;
  }

  void gather_oriented(std::vector<Subtree>& subtrees) {
    std::size_t count = 0;
    for (const Subtree& subtree : subtrees) count += subtree.oriented.size();
    if (count == 0) return;
    tolvol::fill(tree.turned_, tree.nodes_.size(), kNone);
    tree.oriented_.reserve(count);
    for (Subtree& subtree : subtrees) {
      poll();
      for (const auto& [node, boxes] : subtree.oriented) {
        tree.turned_[node] = std::uint32_t(tree.oriented_.size());
        tree.oriented_.push_back(boxes);
      }
      subtree.oriented = {};  // Among needles they would take as much memory again.
    }
  }
};

Hierarchy::Hierarchy(const TriangleMesh& mesh, unsigned threads) {
  const std::size_t count = mesh.triangles.size();
  Team team(static_cast<unsigned>(std::min<std::size_t>(thread_count(threads), 1 + count / kOfThread)));
  Box box;
  for (std::size_t i = 0; i < count; ++i) {
    poll_at(i);
    for (int k = 0; k < 3; ++k) box.add(mesh.vertices[mesh.triangles[i][k]]);
  }
  if (box.empty()) return;
  const glm::dvec3 half = 0.5 * box.upper - 0.5 * box.lower;
  const double size = std::max({half.x, half.y, half.z});
  // A mesh that is one point counts as large as its coordinates, so that these do not overflow.
  const glm::dvec3 far = glm::max(glm::abs(box.lower), glm::abs(box.upper));
  const double unit = size > 0 ? size : std::max({far.x, far.y, far.z});
  scale_ = unit > 0 ? std::ldexp(1.0, -std::clamp(std::ilogb(unit) + 1, -1000, 1000)) : 1;
  centre_ = 0.5 * scaled(box.upper) + 0.5 * scaled(box.lower);

  Build build{*this, team, Unfilled<MortonKey>(count)};
  team.run(count, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::uvec3& t = mesh.triangles[i];
      const glm::dvec3 &a = mesh.vertices[t.x], &b = mesh.vertices[t.y], &c = mesh.vertices[t.z];
      const glm::dvec3 middle =
          0.5 * scaled(glm::min(a, glm::min(b, c))) + 0.5 * scaled(glm::max(a, glm::max(b, c))) - centre_;
      build.keys[i] = {morton_code(middle), std::uint32_t(i), kNone};
    }
  });
  sort_by_code(build.keys, team);
  build.join_twins(mesh);
  HubSlices cut = cut_at_hubs(mesh, scale_, centre_, build.keys, team);
  slices_ = std::move(cut.slices);
  build.outlines = std::move(cut.outlines);
  build.place_triangles(mesh);
  build.sum_areas();
  build.make_nodes();
  build.find_hubs();
}

}  // namespace tolvol
