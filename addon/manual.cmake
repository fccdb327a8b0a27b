# SPDX-License-Identifier: GPL-3.0-or-later
# Writes the manual as a page that every browser shows: cmake -D CMARK=... -D MANUAL=....md -D PAGE=....html -P manual.cmake
execute_process(COMMAND ${CMARK} --extension table ${MANUAL} OUTPUT_VARIABLE body COMMAND_ERROR_IS_FATAL ANY)
# A link may lead to a section: the anchor of a heading is its words in lower case, with hyphens, as in docs/manual.md.
string(REGEX MATCHALL "<h2>[^<]*</h2>" headings "${body}")
foreach(heading IN LISTS headings)
  string(REGEX REPLACE "</?h2>" "" words "${heading}")
  string(TOLOWER "${words}" anchor)
  string(REGEX REPLACE "[^a-z0-9]+" "-" anchor "${anchor}")
  string(REPLACE "${heading}" "<h2 id=\"${anchor}\">${words}</h2>" body "${body}")
endforeach()
file(WRITE ${PAGE} "<!DOCTYPE html>
<html lang=\"en\">
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width\">
<title>Tolerance Volumes: Manual</title>
<style>
body { max-width: 46em; margin: 2em auto; padding: 0 1em; font: 1em/1.5 sans-serif; color: #222; background: #fff }
img { max-width: 100% }
code, pre { background: #f2f2f2 }
pre { padding: 0.6em; overflow-x: auto }
table { border-collapse: collapse }
td, th { border: 1px solid #bbb; padding: 0.3em 0.6em; text-align: left; vertical-align: top }
@media (prefers-color-scheme: dark) {
  body { color: #ddd; background: #1c1c1c }
  code, pre { background: #2c2c2c }
  a { color: #8ab4f8 }
}
</style>
${body}</html>
")
