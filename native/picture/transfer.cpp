// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/transfer.h"

#include <algorithm>

namespace tolvol {
namespace {

constexpr std::size_t kKnots = 33;

// These are every eighth of the published 256 values. Between them the maps are linear within 2 % of the range.
constexpr glm::u8vec3 kCoolWarm[kKnots] = {
    {59, 76, 192},   {68, 90, 204},   {78, 104, 216},  {88, 117, 225},  {98, 130, 234},  {108, 143, 241},
    {119, 154, 247}, {130, 166, 251}, {141, 176, 254}, {152, 185, 255}, {163, 194, 254}, {174, 201, 252},
    {184, 208, 249}, {194, 213, 244}, {204, 217, 237}, {213, 219, 229}, {220, 220, 220}, {228, 217, 210},
    {235, 211, 198}, {241, 205, 185}, {244, 197, 173}, {247, 187, 160}, {247, 177, 148}, {247, 166, 135},
    {244, 154, 123}, {241, 141, 111}, {236, 127, 99},  {229, 112, 88},  {222, 97, 77},   {213, 80, 66},
    {203, 62, 56},   {192, 40, 47},   {180, 4, 38}};
// This starts at the light end, so that places near the reference, usually most of a picture, show their shape.
constexpr glm::u8vec3 kViridis[kKnots] = {
    {253, 231, 37}, {234, 229, 26}, {213, 226, 26}, {192, 223, 37}, {170, 220, 50}, {149, 216, 64}, {130, 211, 77},
    {110, 206, 88}, {92, 200, 99},  {77, 194, 108}, {62, 188, 116}, {49, 181, 123}, {39, 173, 129}, {33, 166, 133},
    {31, 159, 136}, {31, 151, 139}, {33, 144, 140}, {35, 137, 142}, {38, 130, 142}, {41, 122, 142}, {44, 114, 142},
    {47, 107, 142}, {51, 99, 141},  {55, 91, 141},  {59, 82, 139},  {62, 73, 137},  {66, 64, 134},  {69, 55, 129},
    {71, 45, 123},  {72, 35, 116},  {72, 24, 106},  {71, 13, 96},   {68, 1, 84}};

}  // namespace

std::vector<glm::u8vec3> transfer_colours(Transfer transfer, std::size_t count) {
  const auto& knots = transfer == Transfer::signed_distance ? kCoolWarm : kViridis;
  std::vector<glm::u8vec3> colours(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double at = static_cast<double>(i * (kKnots - 1)) / static_cast<double>(count - 1);
    const std::size_t knot = std::min(static_cast<std::size_t>(at), kKnots - 2);
    colours[i] = glm::u8vec3(
        glm::round(glm::mix(glm::dvec3(knots[knot]), glm::dvec3(knots[knot + 1]), at - static_cast<double>(knot))));
  }
  return colours;
}

}  // namespace tolvol
