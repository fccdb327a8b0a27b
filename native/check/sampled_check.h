// SPDX-License-Identifier: GPL-3.0-or-later
/// The common part of the checks that draw pieces with the distance texture and count their pixels. Each pixel is a
/// sample of a piece [Botsch04, §4].
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "check/tolerance_check.h"
#include "gl/objects.h"

namespace tolvol {

class SampledCheck : public ToleranceCheck {
 public:
  std::string renderer() const override { return renderer_; }

 protected:
  /// A triangle to draw, as samples.vert reads it. Lengths are in grid spacings and start from node (0, 0, 0).
  struct SampledTriangle {
    glm::vec3 corner;
    float subdivisions;
    glm::vec3 edge1;  ///< is divided by the subdivisions, like edge2
    std::uint32_t counter;
    glm::vec3 edge2;
    float unused;
  };
  using Corners = std::array<glm::dvec3, 3>;  ///< Lengths are in grid spacings and start from node (0, 0, 0).

  struct Programs {
    /// `sample_counts` is the file that defines sample_counts().
    explicit Programs(std::string_view sample_counts);
    gl::Program query, counting;
  };

  /// samples.vert explains `margin`, which is in pixels. Throws GlUnavailable.
  SampledCheck(const ToleranceVolume& volume, float margin);

  /// Returns the distance, in the frame, that samples are compared with. Throws InvalidInput if nothing is left of it.
  virtual float bound(double mapping_error) const = 0;
  /// Appends the triangles to draw for a triangle. Returns false if it cannot be drawn; it is then left unproved.
  virtual bool add_triangle_samples(const Corners& corners, std::uint32_t counter,
                                    std::vector<SampledTriangle>& triangles) const = 0;
  /// Binds texture and uniforms. Runs on the GL thread.
  virtual void use(const gl::Program& program, float bound) const = 0;
  virtual const Programs& programs() const = 0;
  /// Returns the verdict for a piece of which `counted` of `points` samples were counted.
  virtual Verdict verdict(std::uint64_t counted, std::uint64_t points) const = 0;

 private:
  /// Asks occlusion queries about many pieces at a time. Where a query finds that not all of its pieces are inside,
  /// each of them gets a counter in shader storage. O(samples).
  std::vector<Verdict> verdicts(const PlacedPieces& pieces, const Options& options) const override;
  /// Asks one occlusion query for each label, many of them in flight.
  std::vector<Verdict> group_verdicts(const PlacedPieces& pieces, std::span<const std::int32_t> groups,
                                      const Options& options) const override;

  struct Batch;
  /// Numbers of the counted and of the drawn samples of one label. Both are 0 if a query has shown that all are inside.
  struct Sum {
    std::uint64_t counted = 0, points = 0;
    bool drawn = true;
    Sum& operator+=(const Sum& other) {
      counted += other.counted, points += other.points;
      return *this;
    }
  };
  std::vector<Verdict> decide(const PlacedPieces& pieces, std::span<const std::uint32_t> order,
                              std::span<const std::uint32_t> labels, bool queries, const Options& options) const;
  Batch make_batch(const PlacedPieces& pieces, std::span<const std::uint32_t> order,
                   std::span<const std::uint32_t> labels, std::size_t& next) const;
  bool add_piece(const PlacedPieces& pieces, std::size_t piece, std::uint32_t counter,
                 std::vector<SampledTriangle>& triangles) const;
  void draw(const Batch& batch, float bound, bool queries, std::vector<Sum>& sums) const;
  template <class Found>
  void count_by_query(const Batch& batch, std::span<const std::size_t> ends, Found&& found) const;
  void count_each(const Batch& batch, std::vector<Sum>& sums) const;

  float margin_;
  std::string renderer_;
};

}  // namespace tolvol
