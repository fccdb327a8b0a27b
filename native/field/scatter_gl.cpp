// SPDX-License-Identifier: GPL-3.0-or-later
// scatter.cpp on the GPU. Instead of rows that are cut to the band, the shader gets blocks of nodes. The box of a large
// triangle is nearly empty, so that large triangles are halved until the boxes of their parts hold few nodes. Where the
// band is wide, such a box has several blocks.
#include "field/scatter_gl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "base/call.h"
#include "field/scatter_triangle.h"
#include "gl/context.h"
#include "gl/objects.h"

namespace tolvol {
namespace {

// A part of a triangle is at most this many nodes long, or as long as the band is wide.
constexpr double kLongest = 8;
// The shader gets blocks of at most this many nodes along each axis.
constexpr unsigned kBlock = 16;
// A step has at most so many blocks and looks at about so many nodes: only between steps a cancel is seen and a GPU
// serves its screen.
constexpr std::size_t kMostBlocks = 1 << 14, kMostNodes = 1 << 21;
// The numbers that scatter.comp reads of a triangle and of a block.
constexpr std::size_t kTriangleNumbers = 28, kBlockNumbers = 8;

using Corners = std::array<glm::dvec3, 3>;

struct ScatterProgram : gl::Program {
  ScatterProgram() : Program({{GL_COMPUTE_SHADER, {"scatter.comp"}}}) {}
};

/// What one dispatch of the shader works on.
struct Step {
  std::vector<float> triangles;
  std::vector<std::uint32_t> blocks;
  std::size_t nodes = 0;

  bool full() const { return blocks.size() >= kMostBlocks * kBlockNumbers || nodes >= kMostNodes; }
  void clear() { triangles.clear(), blocks.clear(), nodes = 0; }
};

void add_triangle(const ScatterTriangle& t, const DistanceGrid& grid, std::vector<float>& numbers) {
  const auto add = [&](const glm::vec3& v) { numbers.insert(numbers.end(), {v.x, v.y, v.z}); };
  // GLSL promises nothing for NaN; the shader knows a degenerate triangle by its normal.
  const bool has_plane = t.normal != glm::vec3(0);
  add(grid.origin - t.a), add(t.ab), add(t.ac), add(t.bc);
  add(has_plane ? t.gs : glm::vec3(0)), add(has_plane ? t.gt : glm::vec3(0)), add(t.normal);
  add({t.inverse_ab, t.inverse_ac, t.inverse_bc}), add(t.middle);
  numbers.push_back(t.radius);
}

/// The parts of triangles, each with the blocks of nodes in its band.
class Blocks {
 public:
  explicit Blocks(const DistanceGrid& grid) : grid_(grid), longest_(std::max(kLongest * grid.spacing, grid.band)) {}

  /// Adds the blocks of a triangle. Calls go() whenever the step is full, which leaves it empty.
  template <class Go>
  void add(const ScatterTriangle& triangle, std::uint32_t id, Step& step, Go&& go) {
    waiting_ = {{triangle.a + triangle.corner[0], triangle.a + triangle.corner[1], triangle.a + triangle.corner[2]}};
    while (!waiting_.empty()) {
      const Corners part = waiting_.back();
      waiting_.pop_back();
      Box box;
      for (const glm::dvec3& p : part) box.add(p);
      const glm::dvec3 extent = box.upper - box.lower;
      if (std::max({extent.x, extent.y, extent.z}) > longest_) {
        halve(part);
        continue;
      }
      for_each_block(box, [&](const glm::uvec3& begin, const glm::uvec3& size) {
        if (step.full()) go();
        const bool is_new = step.blocks.empty() || step.blocks[step.blocks.size() - kBlockNumbers + 1] != id;
        if (is_new) add_triangle(triangle, grid_, step.triangles);
        const auto place = static_cast<std::uint32_t>(step.triangles.size() - kTriangleNumbers);
        step.blocks.insert(step.blocks.end(), {place, id, begin.x, begin.y, begin.z, size.x, size.y, size.z});
        step.nodes += std::size_t{size.x} * size.y * size.z;
      });
    }
  }

 private:
  /// Halves the longest edge.
  void halve(const Corners& part) {
    int k = 0;
    double longest = -1;
    for (int i = 0; i < 3; ++i) {
      const double length = glm::length(part[(i + 1) % 3] - part[i]);
      if (length > longest) longest = length, k = i;
    }
    const glm::dvec3 &p = part[k], &q = part[(k + 1) % 3], &opposite = part[(k + 2) % 3], middle = (p + q) * 0.5;
    waiting_.push_back({p, middle, opposite});
    waiting_.push_back({middle, q, opposite});
  }

  /// Calls visit(first node, numbers of nodes) for blocks that hold all nodes within the band of a box.
  template <class Visit>
  void for_each_block(const Box& box, Visit&& visit) const {
    const glm::dvec3 last = glm::dvec3(grid_.nodes) - 1.0;
    const glm::dvec3 low = glm::ceil((box.lower - grid_.band - grid_.origin) / grid_.spacing),
                     high = glm::floor((box.upper + grid_.band - grid_.origin) / grid_.spacing);
    const glm::uvec3 begin(glm::clamp(low, glm::dvec3(0), last)), end(glm::clamp(high, glm::dvec3(0), last));
    glm::uvec3 at;
    for (at.z = begin.z; at.z <= end.z; at.z += kBlock) {
      for (at.y = begin.y; at.y <= end.y; at.y += kBlock) {
        for (at.x = begin.x; at.x <= end.x; at.x += kBlock) {
          const glm::uvec3 size = glm::min(end - at + 1u, glm::uvec3(kBlock));
          const glm::dvec3 lower = grid_.origin + grid_.spacing * glm::dvec3(at),
                           upper = lower + grid_.spacing * glm::dvec3(size - 1u);
          const glm::dvec3 apart = glm::max(glm::max(box.lower - upper, lower - box.upper), glm::dvec3(0));
          if (glm::length(apart) <= ScatterTriangle::kBeyond * grid_.band) visit(at, size);
        }
      }
    }
  }

  const DistanceGrid& grid_;
  double longest_;
  std::vector<Corners> waiting_;
};

}  // namespace

void scatter_gl(const TriangleMesh& reference, DistanceGrid& grid, Progress* progress) {
  if (progress) progress->begin("measuring distances");
  const std::size_t size = static_cast<std::size_t>(grid.pitch) * grid.nodes.y * grid.nodes.z;
  fill(grid.distance, size, static_cast<float>(grid.band));
  fill(grid.triangle, size, DistanceGrid::kNone);
  gl::Buffer distances, ids, triangles, blocks;
  gl::run([&] {
    gl::Buffer::require_room(size * sizeof(float), "the distances at the grid's nodes", "the field scatter");
    distances = gl::Buffer(grid.distance), ids = gl::Buffer(grid.triangle);
    triangles = gl::Buffer(kMostBlocks * kTriangleNumbers * sizeof(float), nullptr);
    blocks = gl::Buffer(kMostBlocks * kBlockNumbers * sizeof(std::uint32_t), nullptr);
    gl::of_context<ScatterProgram>();
  });
  Step step;
  for (const int pass : {0, 1}) {
    const auto go = [&] {
      poll();
      gl::run([&] {
        // This sets all state anew, because other code may have used the context since the last step.
        const gl::Program& program = gl::of_context<ScatterProgram>();
        program.use();
        program.set("nodes", grid.nodes);
        program.set("pitch", grid.pitch);
        program.set("spacing", static_cast<float>(grid.spacing));
        program.set("band", static_cast<float>(grid.band));
        program.set("finds_ids", pass);
        triangles.write(0, step.triangles.size() * sizeof(float), step.triangles.data());
        blocks.write(0, step.blocks.size() * sizeof(std::uint32_t), step.blocks.data());
        const gl::Buffer* const bindings[] = {&triangles, &blocks, &distances, &ids};
        for (GLuint i = 0; i < std::size(bindings); ++i) bindings[i]->bind_storage(i);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        glDispatchCompute(static_cast<GLuint>(step.blocks.size() / kBlockNumbers), 1, 1);
        glFinish();
      });
      step.clear();
    };
    Blocks all(grid);
    for (std::uint32_t id = 0; id < reference.triangles.size(); ++id) {
      if (progress && id % 1024 == 0) {
        const double share = static_cast<double>(id) / static_cast<double>(reference.triangles.size());
        progress->update(0.5 * (pass + share));
      }
      all.add(ScatterTriangle(reference, id, grid.band), id, step, go);
    }
    if (!step.blocks.empty()) go();
  }
  gl::run([&] {
    distances.read(0, distances.bytes(), grid.distance.data());
    ids.read(0, ids.bytes(), grid.triangle.data());
  });
  // Checks index with these ids.
  for (std::size_t i = 0; i < size; ++i) {
    poll_at(i);
    if (grid.triangle[i] >= reference.triangles.size()) grid.triangle[i] = DistanceGrid::kNone;
  }
}

}  // namespace tolvol
