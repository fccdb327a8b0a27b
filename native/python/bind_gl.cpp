// SPDX-License-Identifier: GPL-3.0-or-later
#ifdef TOLVOL_GL
#include "gl/context.h"
#endif
#include "base/errors.h"
#include "python/module.h"
#include "python/worker.h"

namespace tolvol::python {
namespace {

namespace py = pybind11;

#ifdef TOLVOL_GL
std::string renderer() {
  const WithoutPython released;
  return gl::renderer().name();
}

void shutdown() {
  const WithoutPython released;
  gl::shutdown();
}
#else
std::string renderer() { throw GlUnavailable::not_built(); }
void shutdown() {}
#endif

}  // namespace

void bind_gl(py::module_& module) {
  module.def("renderer", &renderer,
             R"doc(Return name, GL version and vendor of what draws pictures and runs the GL checks.

The first call starts OpenGL.

Returns
-------
str

Raises
------
GlUnavailable
    If there is no OpenGL 4.5. Everything but pictures and the GL checks works without.)doc");
  module.def("shutdown", &shutdown,
             R"doc(End the thread that owns the GL context, and free what it holds.

The next call that needs OpenGL starts it again.)doc");
  // GL ends before the interpreter does, because a driver that is unloaded under a living context crashes.
  py::module_::import("atexit").attr("register")(module.attr("shutdown"));
}

}  // namespace tolvol::python
