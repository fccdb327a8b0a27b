// SPDX-License-Identifier: GPL-3.0-or-later
/// How much of the same a test looks at.
#pragma once

#include <cstdlib>

namespace tolvol {

/// Whether this is the run of everything, in which tests are as long as they can be: sh tests/run.sh --all
inline bool is_full_run() { return std::getenv("TOLVOL_ALL_TESTS") != nullptr; }

#ifdef TOLVOL_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// So many, or an eighth under the sanitizers, which are ten times as slow: they look for faults of memory and threads,
/// and the ordinary build holds the limits of work.
constexpr int many(int count) { return kSanitized ? count / 8 : count; }

/// So many squares along a side of a mesh, or half of them under the sanitizers: the ordinary build holds the
/// full size.
constexpr unsigned across(unsigned count) { return kSanitized ? count / 2 : count; }

}  // namespace tolvol
