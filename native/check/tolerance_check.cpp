// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/tolerance_check.h"

#include <algorithm>
#include <unordered_map>

#include "reference/errors.h"

namespace tolvol {

void combine_groups(std::span<Verdict> verdicts, std::span<const std::int32_t> groups) {
  if (groups.size() != verdicts.size()) throw InvalidInput("groups must have one label for each face");
  std::unordered_map<std::int32_t, Verdict> least;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const auto [entry, added] = least.try_emplace(groups[i], verdicts[i]);
    if (!added) entry->second = std::min(entry->second, verdicts[i]);
  }
  for (std::size_t i = 0; i < groups.size(); ++i) verdicts[i] = least.at(groups[i]);
}

}  // namespace tolvol
