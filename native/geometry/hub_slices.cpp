// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/hub_slices.h"

#include <bit>

#include "base/call.h"
#include "geometry/morton_order.h"

namespace tolvol {
namespace {

/// A corner that at least this many triangles share is a hub.
constexpr std::uint32_t kHub = 64;
constexpr float kTaper = 8;
/// Slices overlap by this share, so that what rounding puts into the next one is in the box of either.
constexpr double kOverlap = 1e-9;
/// The edge opposite the hub is cut only if its ends differ by this share in their distances from the hub. Where a line
/// meets it is not sharp else.
constexpr double kSharp = 1.0 / 16;

/// `hub` is the corner around which a triangle is cut, or 3 for none, and `slices` the number of its parts.
struct Cuts {
  std::uint8_t hub = 3, slices = 1;
};

/// Returns the Cuts of the triangle of each key, or nothing if there is no hub.
std::vector<Cuts> find_hubs(const TriangleMesh& mesh, const Unfilled<MortonKey>& keys) {
  // Triangles are counted at each vertex, then at each place, which a hash of the position finds. Two places with one
  // hash may make a hub of a corner that is none, which costs a little time.
  std::vector<std::uint32_t> at_vertex;
  fill(at_vertex, mesh.vertices.size(), 0u);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    poll_at(i);
    for (int k = 0; k < 3; ++k) ++at_vertex[mesh.triangles[keys[i].triangle][k]];
  }
  std::vector<std::uint32_t> count;
  fill(count, std::bit_ceil(2 * mesh.vertices.size()), 0u);
  const auto slot_of = [&](std::uint32_t vertex) {
    std::uint64_t hash = 0;
    const glm::dvec3 p = mesh.vertices[vertex] + 0.0;  // makes 0 of -0
    for (int i = 0; i < 3; ++i) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(p[i])) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 32;
    }
    return hash & (count.size() - 1);
  };
  std::uint32_t most = 0;
  for (std::uint32_t v = 0; v < at_vertex.size(); ++v) {
    poll_at(v);
    if (at_vertex[v]) most = std::max(most, count[slot_of(v)] += at_vertex[v]);
  }
  std::vector<Cuts> hubs;
  if (most < kHub) return hubs;
  hubs.reserve(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    poll_at(i);
    std::uint32_t sharing = kHub - 1;
    Cuts cuts;
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t n = count[slot_of(mesh.triangles[keys[i].triangle][k])];
      if (n > sharing) sharing = n, cuts.hub = k;
    }
    float reach = kTaper;
    while (cuts.hub < 3 && reach < float(sharing)) reach *= kTaper, ++cuts.slices;
    hubs.push_back(cuts);
  }
  return hubs;
}

}  // namespace

Outline outline(const Corners& corners, const HubSlice& slice, const glm::dvec3& centre) {
  const Corners t{corners[0] - centre, corners[1] - centre, corners[2] - centre};
  if (slice.from == 0 && slice.to > 1) return {t[0], t[1], t[2], t[2], t[2]};
  const Legs legs(corners, slice.hub);
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

HubSlices cut_at_hubs(const TriangleMesh& mesh, double scale, const glm::dvec3& centre, Unfilled<MortonKey>& keys,
                      Team& team) {
  HubSlices found;
  const std::vector<Cuts> cuts = find_hubs(mesh, keys);
  if (cuts.empty()) return found;
  Unfilled<MortonKey> all;
  all.reserve(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    poll_at(i);
    const auto [hub, slices] = cuts[i];
    const glm::uvec3& t = mesh.triangles[keys[i].triangle];
    const Corners corners{mesh.vertices[t.x] * scale, mesh.vertices[t.y] * scale, mesh.vertices[t.z] * scale};
    if (slices == 1 || !(Legs(corners, hub).longer() > 0)) {  // A point stays whole, too.
      all.push_back(keys[i]);
      continue;
    }
    float to = std::numeric_limits<float>::infinity(), from = 1 / kTaper;
    for (std::uint8_t k = 0; k < slices; ++k, to = from, from /= kTaper) {
      const HubSlice slice{k + 1 == slices ? 0 : from, to, hub};
      found.outlines.push_back(outline(corners, slice, centre));
      Box box;
      for (const glm::dvec3& corner : found.outlines.back()) box.add(corner);
      all.push_back(
          {morton_code(0.5 * box.lower + 0.5 * box.upper), keys[i].triangle, std::uint32_t(found.slices.size())});
      found.slices.push_back(slice);
    }
  }
  keys.swap(all);
  sort_by_code(keys, team);
  return found;
}

}  // namespace tolvol
