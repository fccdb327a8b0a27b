// SPDX-License-Identifier: GPL-3.0-or-later
// The frame is an affine image of the positions as they are stored, so that the images of faces that cross have a point
// in common. This point is in the smallest sphere around the centre of one face that has its corners, and on the other
// face. In the frame each corner is off by at most the mapping error: the other face is found within twice the error of
// the sphere, and 16 u more for the rounding of its radius.
#include "decimation/near_input_faces.h"

#include <algorithm>
#include <atomic>
#include <memory>

#include "base/call.h"
#include "geometry/frame.h"

namespace tolvol {
namespace {

/// The sphere around a needle may have very many others, although few are in its box. Once all searches together have
/// visited so many faces for each face of the input, none begins any more. All faces of a scan together visit fewer.
constexpr std::size_t kMostVisits = 32;

}  // namespace

InputCrossings::FindNear near_input_faces(const DecimationInput& input) {
  const ToleranceVolume* const volume = input.own_volume();
  if (!volume) return {};
  const auto visited = std::make_shared<std::atomic<std::size_t>>(0);
  return [&input, volume, visited](std::uint32_t face, const std::function<bool(std::uint32_t)>& visit) {
    const std::size_t most = kMostVisits * input.triangles().size();
    if (visited->load(std::memory_order_relaxed) > most) return false;
    const CutMesh& cut = input.cut();
    const auto count = static_cast<std::uint32_t>(cut.triangles.size());
    const std::uint32_t of_reference = face < count ? cut.triangle_input[face] : cut.aside[face - count];
    const TriangleMesh& reference = volume->reference();
    const MeshView faces{reference.triangles, reference.vertices};
    const auto [centre, radius] = sphere_around(faces.corners(of_reference));
    std::size_t seen = 0;
    const auto visit_triangle = [&](std::uint32_t triangle) {
      poll_at(++seen);
      const std::uint32_t element = input.element_of()[triangle];
      if (element != CutMesh::kNone) return visit(element);
      const auto aside = std::ranges::lower_bound(cut.aside, triangle);
      const bool was_dropped = aside == cut.aside.end() || *aside != triangle;
      return was_dropped || visit(count + static_cast<std::uint32_t>(aside - cut.aside.begin()));
    };
    const double reach = radius + 2 * input.mapping_error() + 16 * kUnitRoundoff;
    volume->hierarchy().for_each_within(centre, reach, visit_triangle);
    visited->fetch_add(seen, std::memory_order_relaxed);
    return true;
  };
}

}  // namespace tolvol
