// SPDX-License-Identifier: GPL-3.0-or-later
/// How much of the same a test looks at.
#pragma once

#include <cstdlib>

namespace tolvol {

/// Whether this is the run of everything, in which tests are as long as they can be: sh tests/run.sh --all
inline bool is_full_run() { return std::getenv("TOLVOL_ALL_TESTS") != nullptr; }

/// So many, or an eighth under the sanitizers: they are ten times as slow, and what they look for any few show.
constexpr int many(int count) {
#ifdef TOLVOL_SANITIZED
  return count / 8;
#else
  return count;
#endif
}

/// So many squares along a side of a mesh, or five eighths of them under the sanitizers: the ordinary build holds the
/// full size.
constexpr unsigned across(unsigned count) {
#ifdef TOLVOL_SANITIZED
  return count * 5 / 8;
#else
  return count;
#endif
}

}  // namespace tolvol
