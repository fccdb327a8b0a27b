// SPDX-License-Identifier: GPL-3.0-or-later
/// The few things that native code throws. python/errors.cpp maps each to a Python exception of the same name.
#pragma once

#include <stdexcept>

namespace tolvol {

/// An argument is wrong. The message names the first offender and, where there is one, the remedy.
struct InvalidInput : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The work would exceed a stated limit (memory, pieces). The message names a setting that fits.
struct ResourceLimit : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// There is no OpenGL 4.5 here, or it failed on the way: whatever was asked of it is unanswered. The message begins
/// "GL unavailable: " and says why.
struct GlUnavailable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The caller asked for a stop through Progress::cancel().
struct Cancelled : std::runtime_error {
  Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace tolvol
