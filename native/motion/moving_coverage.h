// SPDX-License-Identifier: GPL-3.0-or-later
/// The backward direction of a moving mesh: every point of the reference stays within the tolerance of it.
///
/// Each piece of the reference has a triangle of the mesh as its witness (check/coverage.h), and the witness moves
/// along with its face. Only where that leaves the tolerance is another one looked for. A quad is two triangles in
/// either of its triangulations, so that each piece has one witness for each triangulation.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/progress.h"
#include "check/coverage.h"
#include "check/outside.h"
#include "check/tolerance_check.h"
#include "motion/moving_mesh.h"

namespace tolvol {

class MovingCoverage {
 public:
  /// Finds witnesses for the state of the mesh, which must have started. What is nearest to an uncovered part of the
  /// reference never moves again. About 2 us a face of the reference, and nothing for faces that are the reference's
  /// own.
  MovingCoverage(MovingMesh& mesh, Progress* progress);
  /// The faces of the reference that the state did not cover at the start; nothing is promised of them.
  const FaceCount& uncovered() const { return uncovered_; }

  /// Returns faces of `faces` whose pieces would have no witness on trial; none if every piece has one. `faces` must be
  /// all faces that move. A face that is far from the tolerance costs about 10 ns, another one about 0.1 us a piece.
  std::vector<std::uint32_t> failing(std::span<const std::uint32_t> faces);
  /// Takes another look at faces that failing() returned: which of them fail still? It proves nothing of other faces.
  std::vector<std::uint32_t> still_failing(std::span<const std::uint32_t> failed);
  /// Returns faces around these vertices, which went elsewhere, whose pieces have no witness now, in any triangulation.
  /// It is for a quick look between two calls of failing(): it may miss a face, or return one that failing() would not,
  /// and proves nothing.
  std::vector<std::uint32_t> failing_around(std::span<const std::uint32_t> vertices);
  /// Returns faces of `faces`, whose corners are others now, whose pieces would have no witness in the state, which is
  /// on trial, and those that have been nearest to an uncovered part of the reference since the start; none if there is
  /// neither. accept() makes the faces part of the state then.
  std::vector<std::uint32_t> failing_replaced(std::span<const std::uint32_t> faces);
  /// Goes with the mesh to its trial, for which failing() found no face last. The mesh itself accepts it after this.
  void accept(std::span<const std::uint32_t> faces);
  /// Whether the last look for witnesses found a piece that had been divided so often that it could not be divided
  /// again.
  bool is_worn() const { return is_worn_; }
  /// Finds all witnesses of the state anew, as at the start. Costs as much, and does nothing if not all were found
  /// then.
  void renew();
  /// Does so if the reference has been divided into many more pieces since then.
  void tidy();

 private:
  /// One triangulation of the mesh. Its element `e` is triangle e % triangles.size() of face e / triangles.size().
  struct Layer {
    std::span<const PieceTriangle> triangles;  ///< of each face
    Coverage coverage;
    Coverage::Trial trial;
    std::vector<Coverage::Element> elements;  ///< of the last change that was tried
  };

  double moved(std::uint32_t face, const PieceTriangle& triangle) const;
  std::vector<std::uint32_t> unsettled(const Layer& layer, std::span<const std::uint32_t> faces) const;
  /// The faces that may lose pieces, and whether their neighbours may lose pieces as well.
  enum class Neighbours { lose_pieces, only_take_pieces };
  /// Whether these faces carry their pieces along where they can, or lose all of them because they are other faces now.
  enum class Chosen { move, are_replaced };
  std::vector<std::uint32_t> failing(Layer& layer, std::span<const std::uint32_t> faces, Neighbours neighbours,
                                     Chosen chosen = Chosen::move);
  std::vector<std::uint32_t> corners_of(std::span<const std::uint32_t> faces) const;
  /// Witnesses of the state, the faces of the reference that have none, and the vertices and faces nearest to these.
  struct Found {
    std::vector<Layer> layers;
    FaceCount uncovered;
    std::vector<std::uint32_t> nearest, nearest_faces;
  };
  Found find_layers(Progress* progress) const;
  void find_witnesses(Found& found, Progress* progress) const;
  void count_pieces();

  MovingMesh* mesh_;
  std::vector<Layer> layers_;
  FaceCount uncovered_;
  std::vector<std::uint32_t> nearest_faces_;  ///< Those nearest to uncovered parts of the reference, ascending.
  std::size_t pieces_ = 0, most_pieces_ = 0;
  bool is_worn_ = false;
};

}  // namespace tolvol
