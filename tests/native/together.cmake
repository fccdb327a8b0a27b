# SPDX-License-Identifier: GPL-3.0-or-later
# Writes the files SOURCES one after another into OUTPUT, to be compiled as one. The namespace without a name that holds a
# test file's functions and tests gets the name of the file, so that no name in it meets one of another file.
file(WRITE ${OUTPUT} "")
cmake_path(GET OUTPUT PARENT_PATH folder)
foreach(source IN LISTS SOURCES)
  cmake_path(GET source STEM name)
  file(READ ${source} text)
  string(FIND "${text}" "\nnamespace {\n" place)
  if(place EQUAL -1)
    message(FATAL_ERROR "${source}: its functions and tests have to be in a namespace without a name")
  endif()
  string(REPLACE "\nnamespace {\n" "\nnamespace ${name} {\n" text "${text}")
  # A path from BUILD, where the compiler runs, is the same in each checkout, so that ccache knows this file again.
  cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${BUILD})
  file(APPEND ${OUTPUT} "#line 1 \"${source}\"\n${text}")
endforeach()
