// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/guard.h"

#include <algorithm>
#include <cstring>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/input_checks.h"

namespace tolvol {
namespace {

/// The number of vertices that are compared at once; most chunks are as they were.
constexpr std::size_t kChunk = 64;
/// The number of vertices that one thread takes at a time.
constexpr std::size_t kBlock = 256 * kChunk;

glm::dvec3 at(std::span<const float> positions, std::size_t vertex) {
  return {positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]};
}

/// One bit for each two corners of a face: whether they are one vertex.
template <class Corner>
unsigned repeated(Corner first, int corners) {
  unsigned result = 0;
  for (int i = 0; i < corners; ++i) {
    for (int k = 0; k < i; ++k) result = 2 * result + (first[i] == first[k]);
  }
  return result;
}

}  // namespace

Guard::Guard(std::span<const float> positions, std::vector<std::uint32_t> faces, int corners,
             const glm::dmat4& to_world, const ToleranceVolume& volume, const Options& options)
    : faces_(std::move(faces)),
      corners_(corners),
      last_(positions.size()),
      options_(options),
      pull_back_(volume, StoredSpace(to_world, Storage::float32), faces_, corners, positions.size() / 3,
                 options.threads) {
  require_normal_angle(options.max_normal_angle);
  begin(positions, options.progress);
}

void Guard::require_size(std::span<const float> positions) const {
  if (positions.size() == last_.size()) return;
  throw InvalidInput("the guard is for " + std::to_string(last_.size() / 3) + " vertices, not " +
                     std::to_string(positions.size() / 3) + "; make a new one when vertices come or go");
}

void Guard::begin(std::span<const float> positions, Progress* progress) {
  const Call call(progress);
  std::vector<glm::dvec3> stored(positions.size() / 3);
  for (std::size_t v = 0; v < stored.size(); ++v) stored[v] = at(positions, v);
  start_ = pull_back_.start(
      stored, {options_.outside, options_.two_sided, options_.crossings, options_.max_normal_angle}, progress);
  last_.assign(positions.begin(), positions.end());
}

void Guard::reset(std::span<const float> positions, Progress* progress) {
  require_size(positions);
  interrupted_ = true;
  begin(positions, progress);
  interrupted_ = false;
}

std::vector<std::uint32_t> Guard::replace_faces(std::vector<std::uint32_t> faces, Progress* progress) {
  const auto corners = static_cast<std::size_t>(corners_);
  if (faces.size() != faces_.size()) {
    throw InvalidInput("the guard has " + std::to_string(faces_.size() / corners) + " faces, not " +
                       std::to_string(faces.size() / corners) + "; make a new one when faces come or go");
  }
  require_vertices(faces, corners, vertex_count());
  const Call call(progress);
  resume();
  std::vector<std::uint32_t> differing, refused;
  for (std::uint32_t f = 0; f < faces.size() / corners; ++f) {
    poll_at(f);
    const auto first = faces.begin() + static_cast<std::ptrdiff_t>(f * corners);
    const auto before = faces_.begin() + (first - faces.begin());
    if (std::equal(first, first + corners_, before)) continue;
    if (repeated(first, corners_) != repeated(before, corners_)) {
      throw InvalidInput("face " + std::to_string(f) + " repeats other corners than before; make a new guard");
    }
    differing.push_back(f);
    // Such a face keeps less than others, which another face in its place must not do.
    const auto is_in = [&](const std::vector<std::uint32_t>& found) { return std::ranges::binary_search(found, f); };
    if (is_in(start_.outside) || is_in(start_.exceeding) || pull_back_.may_be_unsure(f)) refused.push_back(f);
  }
  if (!refused.empty()) return refused;
  const auto exchange = [&] {
    for (const std::uint32_t f : differing) {
      const auto first = static_cast<std::ptrdiff_t>(f * corners);
      std::swap_ranges(faces.begin() + first, faces.begin() + first + corners_, faces_.begin() + first);
    }
  };
  interrupted_ = true;
  exchange();
  try {
    refused = pull_back_.replace_faces(differing, progress);
  } catch (...) {
    exchange();
    throw;
  }
  if (!refused.empty()) exchange(), pull_back_.restore_faces(differing);
  interrupted_ = false;
  return refused;
}

/// Starts again from the state if an exception has left the rest of the guard unknown.
void Guard::resume() {
  if (interrupted_) begin(std::vector<float>(last_), nullptr), interrupted_ = false;
}

/// The vertices of which any bit differs from the state, ascending.
std::vector<std::uint32_t> Guard::changed(std::span<const float> positions) const {
  const std::size_t count = vertex_count();
  const auto differ = [&](std::size_t begin, std::size_t end) {
    return std::memcmp(&positions[3 * begin], &last_[3 * begin], 3 * (end - begin) * sizeof(float)) != 0;
  };
  std::vector<std::vector<std::uint32_t>> found((count + kBlock - 1) / kBlock);
  parallel_for(count, kBlock, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; chunk += kChunk) {
      const std::size_t chunk_end = std::min(chunk + kChunk, end);
      if (!differ(chunk, chunk_end)) continue;
      for (std::size_t v = chunk; v < chunk_end; ++v) {
        if (differ(v, v + 1)) found[begin / kBlock].push_back(static_cast<std::uint32_t>(v));
      }
    }
  });
  std::vector<std::uint32_t> result;
  for (const std::vector<std::uint32_t>& part : found) result.insert(result.end(), part.begin(), part.end());
  return result;
}

Guard::Correction Guard::constrain(std::span<const float> positions) {
  require_size(positions);
  resume();
  const PullBack::Moving moving = pull_back_.moving(changed(positions));
  std::vector<glm::dvec3> before, after;
  for (const std::uint32_t v : moving.vertices) before.push_back(at(last_, v)), after.push_back(at(positions, v));
  interrupted_ = true;
  PullBack::Result ends;
  try {
    ends = pull_back_.move(moving, before, after, PullBack::Mode::settle, nullptr);
  } catch (const Error&) {
    interrupted_ = false;  // A refused or cancelled motion has changed nothing. Of any other exception nobody knows.
    throw;
  }
  Correction correction;
  for (std::size_t i = 0; i < moving.vertices.size(); ++i) {
    if (ends.factors[i] >= 1) continue;
    correction.vertices.push_back(moving.vertices[i]);
    for (int k = 0; k < 3; ++k) correction.positions.push_back(static_cast<float>(ends.reached[i][k]));
  }
  for (std::size_t i = 0; i < moving.vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k) last_[3 * moving.vertices[i] + k] = static_cast<float>(ends.reached[i][k]);
  }
  interrupted_ = false;
  return correction;
}

}  // namespace tolvol
