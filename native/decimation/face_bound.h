// SPDX-License-Identifier: GPL-3.0-or-later
/// What is known of all points of a face.
#pragma once

#include <numbers>

#include "check/certificate.h"

namespace tolvol {

/// Every point of the face has a witness within both bounds.
struct FaceBound {
  double distance = TriangleCertificate::kUnproved;  ///< in the frame; kUnproved if there is no proof
  double angle = std::numbers::pi;                   ///< between the face and its witnesses (check/facing.h)
};

}  // namespace tolvol
