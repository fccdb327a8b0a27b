// SPDX-License-Identifier: GPL-3.0-or-later
/// The exceptions of the native code. python/errors.cpp maps each to a Python exception of the same name.
///
/// `code` is a short name of the reason, for programs: it stays the same from version to version. The message is for
/// people. The codes and their meanings are listed in python/errors.cpp.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace tolvol {

struct Error : std::runtime_error {
  Error(const char* code, const std::string& message) : std::runtime_error(message), code(code) {}
  const char* code;
};

/// An argument is wrong. The message names the first offender and, if there is one, the remedy.
struct InvalidInput : Error {
  explicit InvalidInput(const std::string& message, const char* code = "invalid_argument") : Error(code, message) {}
};

/// Faces are beyond the tolerance before an operation begins.
struct FacesOutside : InvalidInput {
  FacesOutside(std::size_t count, std::size_t first, const std::string& message, const char* code)
      : InvalidInput(message, code), count(count), first(first) {}
  std::size_t count, first;  ///< how many there are, and the index of the first
};

/// The work would exceed a stated limit (memory, pieces). The message names a setting that fits.
struct ResourceLimit : Error {
  explicit ResourceLimit(const std::string& message) : Error("too_large", message) {}
};

/// There is no OpenGL 4.5 here, or it failed on the way, so that the call has no result. The message begins with
/// "GL unavailable: " and gives the reason.
struct GlUnavailable : Error {
  explicit GlUnavailable(const std::string& message) : Error("gl_unavailable", message) {}
  /// What a build without GL throws.
  static GlUnavailable not_built() {
    return GlUnavailable("GL unavailable: this module was built without it (TOLVOL_GL=OFF)");
  }
};

/// The caller asked for a stop through Progress::cancel().
struct Cancelled : Error {
  Cancelled() : Error("cancelled", "cancelled") {}
};

}  // namespace tolvol
