// SPDX-License-Identifier: GPL-3.0-or-later
/// The files of shaders/, embedded when the project was built by embed_shaders.cmake.
#pragma once

#include <string_view>

namespace tolvol::gl {

/// Returns a file by its name, as in "samples.vert", without a #version line. Throws std::logic_error for an unknown
/// name.
std::string_view shader_source(std::string_view file);

}  // namespace tolvol::gl
