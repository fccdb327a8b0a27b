// SPDX-License-Identifier: GPL-3.0-or-later
#ifdef TOLVOL_GL
#include "gl/context.h"
#endif
#include "base/errors.h"
#include "python/module.h"

namespace tolvol::python {
namespace {

namespace py = pybind11;

#ifdef TOLVOL_GL
std::string renderer() {
  const py::gil_scoped_release release;
  return gl::renderer().name();
}

void shutdown() {
  const py::gil_scoped_release release;
  gl::shutdown();
}
#else
std::string renderer() { throw GlUnavailable("GL unavailable: this module was built without it (TOLVOL_GL=OFF)"); }
void shutdown() {}
#endif

}  // namespace

void bind_gl(py::module_& module) {
  module.def("renderer", &renderer,
             "Name, GL version and vendor of what draws pictures and runs the GL checks. Starts it on first use.\n"
             "Raises GlUnavailable, with the reason, where there is no OpenGL 4.5; everything else works without.");
  module.def("shutdown", &shutdown,
             "Ends the thread that owns the GL context, and frees what it holds. The next use starts anew.");
  // Before the interpreter goes: a driver that is unloaded under a living context crashes.
  py::module_::import("atexit").attr("register")(module.attr("shutdown"));
}

}  // namespace tolvol::python
