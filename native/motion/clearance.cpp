// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/clearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/call.h"
#include "base/parallel.h"
#include "topology/faces_apart.h"

namespace tolvol {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
/// The room of a vertex that is not even in it at its anchor: every comparison with it is false.
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
/// Rooms are smaller than what is proved by this share, which is far more than the rounding of a distance.
constexpr double kInside = 1 - 1e-9;
/// A bound on the relative rounding of a sum of two products of differences.
constexpr double kRounding = 8 * 0x1p-53;
/// What products that are too small for double precision lose.
constexpr double kSmallest = 1e-300;
/// The number of vertices or faces that a thread takes at a time, for what they leave to rooms.
constexpr std::size_t kRoomsAtOnce = 64;
/// A vertex that leaves its room at once would do so again. It gets a room again at the kRest-th call of renew(),
/// counted from the call that finds it gone.
constexpr std::uint8_t kRest = 8;
/// A vertex with more faces than this gets no room, because its fan is looked at pair by pair.
constexpr std::size_t kMostFaces = 32;

void lower(std::atomic<double>& value, double to) {
  double known = value.load(std::memory_order_relaxed);
  while (to < known && !value.compare_exchange_weak(known, to, std::memory_order_relaxed)) {
  }
}

}  // namespace

Clearance::Clearance(MovingMesh& mesh, std::span<const glm::dvec3> stored)
    : mesh_(mesh),
      anchor_(stored.begin(), stored.end()),
      room_(stored.size(), kNone),
      reach_(stored.size(), 0),
      face_room_(mesh.face_count()),
      renewed_(mesh.face_count(), 0),
      since_(stored.size(), 0),
      rest_(stored.size(), 0) {
  for (std::atomic<double>& room : face_room_) room.store(kFar, std::memory_order_relaxed);
}

Corners Clearance::corners(std::uint32_t face) const {
  const auto c = mesh_.corners_of(face);
  return {anchor_[c[0]], anchor_[c[1]], anchor_[c[2]]};
}

Box Clearance::room_box(std::uint32_t vertex) const {
  const glm::dvec3 reach = reach_[vertex] / kInside + glm::abs(anchor_[vertex]) * 0x1p-52;
  return {anchor_[vertex] - reach, anchor_[vertex] + reach};
}

/// How far a point of the face may go at most.
double Clearance::reach(std::uint32_t face) const {
  double reach = 0;
  for (const std::uint32_t v : mesh_.corners_of(face)) reach = std::max(reach, reach_[v]);
  return reach;
}

/// The way that the corners of the faces around a vertex may go before these faces could overlap; 0 where they might do
/// so already.
double Clearance::fan(std::uint32_t vertex) const {
  const std::span<const std::uint32_t> faces = mesh_.ring(vertex);
  if (faces.empty() || faces.size() > kMostFaces) return 0;
  struct Side {
    std::uint32_t from, to;
  };
  std::array<Side, kMostFaces> sides;  // opposite the vertex
  glm::dvec3 normal(0);
  const glm::dvec3 centre = anchor_[vertex];
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto c = mesh_.corners_of(faces[i]);
    const int k = c[0] == vertex ? 0 : c[1] == vertex ? 1 : 2;
    sides[i] = {c[(k + 1) % 3], c[(k + 2) % 3]};
    normal += glm::cross(anchor_[sides[i].from] - centre, anchor_[sides[i].to] - centre);
  }
  const glm::dvec3 size = glm::abs(normal);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  int x = (axis + 1) % 3, y = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(x, y);
  // The fan is closed by two triangles with a corner in the gap, if it has one gap. All of them have to turn to the
  // left and pass the positive x axis once.
  double width = kFar;
  int passes = 0;
  const auto add = [&](const glm::dvec2& p, const glm::dvec2& q) {
    const double one = p.x * q.y, other = p.y * q.x;
    const double area = one - other - kRounding * (std::abs(one) + std::abs(other)) - kSmallest;
    if (!(area > 0)) return false;
    width = std::min(width, area / std::max({glm::length(p), glm::length(q), glm::length(p - q)}));
    passes += p.y < 0 && q.y >= 0;
    return true;
  };
  const auto seen = [&](std::uint32_t v) { return glm::dvec2(anchor_[v][x] - centre[x], anchor_[v][y] - centre[y]); };
  const std::span<const Side> all(sides.data(), faces.size());
  std::size_t starts = 0, ends = 0;
  Side gap{};
  for (const Side& side : all) {
    if (!add(seen(side.from), seen(side.to))) return 0;
    std::size_t before = 0, after = 0;
    for (const Side& other : all) {
      if (&other != &side && (other.from == side.from || other.to == side.to)) return 0;
      before += other.to == side.from, after += other.from == side.to;
    }
    if (before == 0) ++starts, gap.to = side.from;
    if (after == 0) ++ends, gap.from = side.to;
  }
  if (starts != ends || starts > 1) return 0;
  if (starts == 1) {
    const glm::dvec2 from = seen(gap.from), to = seen(gap.to), across = glm::normalize(to) - glm::normalize(from);
    const glm::dvec2 middle = glm::length(from) * glm::normalize(glm::dvec2(across.y, -across.x));
    if (!add(from, middle) || !add(middle, to)) return 0;
  }
  return passes == 1 ? width / 2 * kInside : 0;
}

/// Lowers what all vertices may reach that share a face with these.
void Clearance::limit_by_fans(std::span<const std::uint32_t> vertices) {
  std::vector<double> rooms(vertices.size());
  parallel_for(vertices.size(), kRoomsAtOnce, mesh_.threads(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) rooms[i] = fan(vertices[i]);
  });
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (const std::uint32_t f : mesh_.ring(vertices[i])) {
      for (const std::uint32_t v : mesh_.corners_of(f)) reach_[v] = std::min(reach_[v], rooms[i]);
    }
  }
}

/// Notes what these faces leave to their corners, and to those of faces near them, that share no corner with them.
void Clearance::limit_by_gaps(std::span<const std::uint32_t> faces, const MovingFaces& near) {
  parallel_for(faces.size(), kRoomsAtOnce, mesh_.threads(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t face = faces[i];
      if (rests(face)) continue;
      const auto own = mesh_.corners_of(face);
      const Corners triangle = corners(face);
      const double own_reach = reach(face);
      std::size_t looked_at = 0;
      near.for_each_near_elsewhere(face, in_room(), [&](std::uint32_t other) {
        if (++looked_at % 64 == 0) poll();
        if (other < face && renewed_[other] == now_) return true;  // it looks at this one
        const auto c = mesh_.corners_of(other);
        for (const std::uint32_t v : own) {
          if (v == c[0] || v == c[1] || v == c[2]) return true;
        }
        if (rests(other)) return true;
        const double both = (own_reach + reach(other)) / kInside;
        const double found = gap(triangle, corners(other), both);
        if (found >= both) return true;
        lower(face_room_[face], found / 2);
        lower(face_room_[other], found / 2);
        return true;
      });
    }
  });
}

bool Clearance::rests(std::uint32_t face) const {
  const auto c = mesh_.corners_of(face);
  return rest_[c[0]] > 0 || rest_[c[1]] > 0 || rest_[c[2]] > 0;
}

/// The vertices that get another room. Those that rest get an anchor alone.
std::vector<std::uint32_t> Clearance::gone(std::span<const glm::dvec3> stored) {
  std::vector<std::uint32_t> gone;
  for (std::uint32_t v = 0; v < stored.size(); ++v) {
    poll_at(v);
    if (has(v, stored[v])) continue;
    const bool is_hasty = now_ > 0 && rest_[v] == 0 && since_[v] == now_;
    if (is_hasty) rest_[v] = kRest;
    if (rest_[v] > 0) --rest_[v];
    anchor_[v] = stored[v], room_[v] = kNone, reach_[v] = 0;
    if (rest_[v] == 0) gone.push_back(v);
  }
  return gone;
}

void Clearance::renew(std::span<const glm::dvec3> stored, MovingFaces& near) {
  const std::vector<std::uint32_t> vertices = gone(stored);
  ++now_;
  for (const std::uint32_t v : vertices) reach_[v] = kFar, since_[v] = now_;
  const std::vector<std::uint32_t> faces = mesh_.faces_around(vertices);
  std::vector<std::uint32_t> around;
  for (const std::uint32_t f : faces) {
    const auto c = mesh_.corners_of(f);
    around.insert(around.end(), c.begin(), c.end());
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  limit_by_fans(around);
  for (const std::uint32_t f : mesh_.faces_around(around)) {
    for (const std::uint32_t v : mesh_.corners_of(f)) room_[v] = std::min(room_[v], reach_[v]);
  }
  for (const std::uint32_t f : faces) renewed_[f] = now_;
  near.change(faces, in_room());
  limit_by_gaps(faces, near);
  for (std::uint32_t f = 0; f < mesh_.face_count(); ++f) {
    if (face_room_[f].load(std::memory_order_relaxed) == kFar) continue;
    const double room = face_room_[f].exchange(kFar, std::memory_order_relaxed) * kInside;
    for (const std::uint32_t v : mesh_.corners_of(f)) {
      reach_[v] = std::min(reach_[v], room);
      room_[v] = std::min(room_[v], room);  // stays kNone
    }
  }
  for (const std::uint32_t v : vertices) room_[v] = reach_[v];
}

}  // namespace tolvol
