// SPDX-License-Identifier: GPL-3.0-or-later
/// The witness certificate (check/certificate.h) in a compute shader, in float32. It is for batches of many small
/// pieces.
#pragma once

#include "check/tolerance_check.h"
#include "gl/objects.h"

namespace tolvol {

/// A verdict is `inside`, as certain as that of Certificate, or `unproved`, never `outside`. A piece is unproved if it
/// is outside; if the grid names no near triangle for it, because nothing here searches for the closest one (this
/// concerns pieces at nearly the tolerance on a coarse grid, and all pieces in the marched part of a grid, which has no
/// ids); or if it would take more than a few thousand parts. All pieces are unproved if float32 would cost more than
/// half of the tolerance, which is so for a tolerance below about 1e-5 of the reference. A check throws GlUnavailable
/// if the context was lost, and then nothing is known. A few million small pieces take a second on two cores without a
/// GPU.
class GlCertificate final : public ToleranceCheck {
 public:
  /// Puts the grid's ids, 4 bytes a node, and the reference, 36 bytes a triangle, on the GPU. Keeps a reference to
  /// `volume`, which must outlive this. Throws ResourceLimit if this GL takes no buffer that large, and GlUnavailable.
  explicit GlCertificate(const ToleranceVolume& volume);

  std::string method() const override { return "gl_certificate"; }
  std::string renderer() const override { return renderer_; }

 private:
  std::vector<Verdict> verdicts(const PlacedPieces& pieces, const Options& options) const override;

  std::string renderer_;
  gl::Buffer nodes_, a_, ab_, ac_;
};

/// Bounds the rounding of float32, u = 2^-24: if the shader accepts a piece at the threshold t, every point of the
/// piece is within t + float_error(M) of the triangle, where M is the largest coordinate magnitude of piece and
/// triangle.
///
/// This is the derivation. Values are rounded to nearest when they are sent, an error of u. GLSL promises for `precise`
/// +, - and * a correctly rounded result in an unspecified direction, 2u, and for a * b + c one or two such roundings.
/// It promises less for division and dot(), which only choose parameters. Flushed subnormals are far below u M here.
/// Points and corners are at most M and differences of two at most 2 M. So the errors per coordinate, in units of u M,
/// are:
/// - 1 for sending the part's corner, an exact convex combination of sent corners, 2 for its products, 4 for two sums;
/// - 1 for sending the triangle's corner a, and 2 for sending ab and ac, together with their parameters;
/// - 4 for x, the corner as seen from a;
/// - for the foot, 4 for the products of s ab + t ac, 4 because s + t <= 1 may be 1 + 2u, and 8 for two subtractions;
/// - for the edge bc instead, 4 each for x - ab, for bc = ac - ab, for the product and for the subtraction.
///
/// Either way this is 30, and below 52 for the length over three coordinates, which is sqrt(3) times as much. The
/// errors of the sum of squares and of the threshold come off the threshold (threshold() in the .cpp). 64 is a power of
/// two.
inline double float_error(double magnitude) { return 64 * 0x1p-24 * magnitude; }

}  // namespace tolvol
