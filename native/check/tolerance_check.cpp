// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/tolerance_check.h"

#include <algorithm>
#include <unordered_map>

#include "reference/call.h"
#include "reference/errors.h"

namespace tolvol {

void require_valid(const Pieces& pieces) {
  if (pieces.corners < 1 || pieces.corners > 4) {
    throw InvalidInput("a face must have 1 to 4 corners; triangulate larger ones");
  }
  const std::size_t corners = static_cast<std::size_t>(pieces.corners);
  if (pieces.indices.size() % corners != 0) throw InvalidInput("the face array is not a whole number of faces");
  for (std::size_t i = 0; i < pieces.indices.size(); ++i) {
    poll_at(i);
    if (pieces.indices[i] < pieces.points.size()) continue;
    throw InvalidInput("faces[" + std::to_string(i / corners) + "] uses point " + std::to_string(pieces.indices[i]) +
                       ", but there are only " + std::to_string(pieces.points.size()));
  }
}

std::vector<Verdict> ToleranceCheck::check_groups(const Pieces& pieces, std::span<const std::int32_t> groups,
                                                  const Options& options) const {
  const Call call(options.progress);
  std::vector<Verdict> verdicts = check(pieces, options);
  combine_groups(verdicts, groups);
  return verdicts;
}

void combine_groups(std::span<Verdict> verdicts, std::span<const std::int32_t> groups) {
  if (groups.size() != verdicts.size()) throw InvalidInput("groups must have one label for each face");
  std::unordered_map<std::int32_t, Verdict> least;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    poll_at(i);
    const auto [entry, added] = least.try_emplace(groups[i], verdicts[i]);
    if (!added) entry->second = std::min(entry->second, verdicts[i]);
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    poll_at(i);
    verdicts[i] = least.at(groups[i]);
  }
}

}  // namespace tolvol
