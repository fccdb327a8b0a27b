# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DOUTPUT=shaders.cpp -DSHADERS="a;b" -P embed_shaders.cmake: writes gl/shaders.h's shader_source().
set(entries "")
foreach(shader IN LISTS SHADERS)
  get_filename_component(name ${shader} NAME)
  file(READ ${shader} text)
  string(APPEND entries "    {\"${name}\", R\"glsl(${text})glsl\"},\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"gl/shaders.h\"

#include <stdexcept>
#include <string>
#include <utility>

namespace tolvol::gl {

std::string_view shader_source(std::string_view file) {
  static constexpr std::pair<std::string_view, std::string_view> kShaders[] = {
${entries}  };
  for (const auto& [name, text] : kShaders) {
    if (name == file) return text;
  }
  throw std::logic_error(\"no shader \" + std::string(file));
}

}  // namespace tolvol::gl
")
