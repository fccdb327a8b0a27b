// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>

#include "base/errors.h"
#include "picture/camera.h"
#include "picture/transfer.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"
#ifdef TOLVOL_GL
#include "picture/render_distance.h"
#include "picture/render_volume.h"
#endif

namespace tolvol::python {

#ifdef TOLVOL_GL
/// The data of a volume that the GPU keeps between two pictures.
struct Pictures {
  PictureField field;
  std::optional<DistanceRenderer> distance;
  std::optional<VolumeRenderer> volume;
};
#endif

namespace {

using Vector = std::array<double, 3>;
using Size = std::array<int, 2>;  // holds width and height

glm::dvec3 vector(const Vector& v) { return {v[0], v[1], v[2]}; }
Vector vector(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

Transfer to_transfer(const std::string& name) {
  if (name == "signed") return Transfer::signed_distance;
  if (name == "magnitude") return Transfer::magnitude;
  throw InvalidInput("transfer must be \"signed\" or \"magnitude\", not \"" + name + "\"");
}

Camera make_camera(const Vector& eye, const Vector& target, const Vector& up, double angle) {
  const Camera camera{vector(eye), vector(target), vector(up), angle};
  validate(camera);
  return camera;
}

double aspect(const Size& size) { return static_cast<double>(size[0]) / size[1]; }

Camera frame_mesh(const py::object& vertices, const py::object& triangles, const Size& size, const Vector& direction,
                  const Vector& up, double angle, double margin, const py::object& to_world) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  validate(v.values, t);
  const StoredSpace space(to_matrix(to_world), v.storage);
  return framing(space.frame(v.values), t, {vector(direction), vector(up), angle, aspect(size), margin});
}

py::array_t<std::uint8_t> colours(const std::string& transfer) {
  py::array_t<std::uint8_t> array({static_cast<py::ssize_t>(kTransferColours), py::ssize_t{3}});
  auto view = array.mutable_unchecked<2>();
  py::ssize_t i = 0;
  for (const glm::u8vec3& colour : transfer_colours(to_transfer(transfer), kTransferColours)) {
    for (int k = 0; k < 3; ++k) view(i, k) = colour[k];
    ++i;
  }
  return array;
}

#ifdef TOLVOL_GL
/// Returns the image of draw(pictures). Must be called without the GIL.
template <class Draw>
Image draw_picture(const Volume& volume, unsigned threads, Progress* progress, Draw&& draw) {
  const std::lock_guard lock(volume.drawing);
  try {
    if (!volume.pictures) {
      volume.pictures.reset(new Pictures{
          {volume.native.reference(), volume.native.mirrored(), volume.native.frame_tolerance(), threads, progress},
          std::nullopt,
          std::nullopt});
    }
    return draw(*volume.pictures);
  } catch (const GlUnavailable&) {
    volume.pictures.reset();  // the next picture makes them anew
    throw;
  }
}

py::array_t<std::uint8_t> to_array(const Image& image) {
  py::array_t<std::uint8_t> array({py::ssize_t{image.height}, py::ssize_t{image.width}, py::ssize_t{4}});
  std::copy(image.pixels.begin(), image.pixels.end(), array.mutable_data());
  return array;
}

Camera camera_or_framing(const std::optional<Camera>& camera, const Vertices& v, const std::vector<glm::uvec3>& t,
                         const StoredSpace& space, const Size& size, double margin) {
  if (camera) return *camera;
  validate(v.values, t);
  Framing how;
  how.aspect = aspect(size), how.margin = margin;
  return framing(space.frame(v.values), t, how);
}

py::array_t<std::uint8_t> render_distance(const py::object& vertices, const py::object& triangles, const Volume& volume,
                                          const std::optional<Camera>& camera, const Size& size,
                                          const std::string& transfer, const py::object& to_world, bool edges,
                                          int samples, std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space(to_matrix(to_world), v.storage);
  const DistanceRenderer::Options options{to_transfer(transfer), edges, {{size[0], size[1]}, samples}, progress};
  const unsigned thread_count = to_threads(threads);
  Image image;
  {
    const Interruptible call(progress);
    require(options.resolution);
    const Camera from = camera_or_framing(camera, v, t, space, size, 0);
    image = draw_picture(volume, thread_count, progress, [&](Pictures& pictures) {
      if (!pictures.distance) pictures.distance.emplace(pictures.field);
      const Frame& frame = volume.native.frame();
      return pictures.distance->render({v.values, t, space.in(frame), pictures.field}, from, frame, options);
    });
  }
  return to_array(image);
}

using Cut = std::pair<Vector, Vector>;

py::array_t<std::uint8_t> render_volume(const Volume& volume, const std::optional<Camera>& camera, const Size& size,
                                        const py::object& vertices, const py::object& triangles,
                                        const py::object& to_world, const std::optional<Cut>& cut, int samples,
                                        std::optional<int> threads, Progress* progress) {
  if (vertices.is_none() != triangles.is_none()) {
    throw InvalidInput("vertices and triangles must both be given, or neither for the reference itself");
  }
  Vertices v{{}, Storage::float64};
  std::vector<glm::uvec3> t;
  if (vertices.is_none()) {
    for (const glm::dvec3& p : volume.native.reference().vertices)
      v.values.push_back(volume.native.frame().to_world(p));
    t = volume.native.reference().triangles;
  } else {
    v = to_vertices(vertices, "vertices");
    t = to_triangles(triangles, "triangles");
  }
  const StoredSpace space(vertices.is_none() ? glm::dmat4(1) : to_matrix(to_world), v.storage);
  VolumeRenderer::Options options{std::nullopt, {{size[0], size[1]}, samples}, progress};
  if (cut) options.cut = {vector(cut->first), vector(cut->second)};
  const unsigned thread_count = to_threads(threads);
  Image image;
  {
    const Interruptible call(progress);
    require(options.resolution);
    const Camera from = camera_or_framing(camera, v, t, space, size, volume.native.tolerance());
    image = draw_picture(volume, thread_count, progress, [&](Pictures& pictures) {
      if (!pictures.volume) pictures.volume.emplace(pictures.field, volume.native.hierarchy(), thread_count);
      const Frame& frame = volume.native.frame();
      return pictures.volume->render({v.values, t, space.in(frame), pictures.field}, from, frame, options);
    });
  }
  return to_array(image);
}
#else
[[noreturn]] py::object no_pictures(const py::args&, const py::kwargs&) { throw GlUnavailable::not_built(); }
#endif

}  // namespace

void bind_picture(py::module_& module) {
  py::class_<Camera>(module, "Camera", py::module_local(),
                     "The place from which a picture is taken, in perspective and in world units.")
      .def(py::init(&make_camera), py::arg("eye"), py::arg("target"), py::kw_only(),
           py::arg("up") = vector(Framing().up), py::arg("angle") = Framing().angle,
           R"doc(Make a camera.

Parameters
----------
eye, target, up : three floats each
angle : float
    The height of the picture in degrees, between 0 and 180.

Raises
------
InvalidInput
    If there is no such view.)doc")
      .def_static("framing", &frame_mesh, py::arg("vertices"), py::arg("triangles"), py::kw_only(),
                  py::arg("size") = Size{1024, 1024}, py::arg("direction") = vector(Framing().direction),
                  py::arg("up") = vector(Framing().up), py::arg("angle") = Framing().angle, py::arg("margin") = 0.0,
                  py::arg("to_world") = py::none(),
                  R"doc(Return the camera that sees all of a mesh, as large as a picture can show it.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
size : two ints
    Width and height of the picture.
direction : three floats
    Leads from the mesh to the eye.
up, angle
    As for Camera.
margin : float
    The distance that is kept free around the mesh, in world units.
to_world
    See help(tolvol).

Raises
------
InvalidInput)doc")
      .def_property_readonly(
          "eye", [](const Camera& c) { return vector(c.eye); }, "The place of the eye, three floats.")
      .def_property_readonly(
          "target", [](const Camera& c) { return vector(c.target); }, "The place that the eye looks at, three floats.")
      .def_property_readonly(
          "up", [](const Camera& c) { return vector(c.up); }, "The direction that is up in the picture, three floats.")
      .def_readonly("angle", &Camera::angle, "The height of the picture in degrees.");

  module.def("transfer_colours", &colours, py::arg("transfer") = "signed",
             R"doc(Return the colours of a picture from one end of its range to the other, for a legend.

Parameters
----------
transfer : {"signed", "magnitude"}
    "signed" goes from -tolerance (inside) to the tolerance in Moreland's cool to warm, "magnitude" from 0 to the
    tolerance in viridis.

Returns
-------
(256, 3) uint8 array

Raises
------
InvalidInput)doc");
  const auto list = [](const glm::u8vec3& c) { return py::make_tuple(c.x, c.y, c.z); };
  module.attr("OUTSIDE_COLOURS") = py::make_tuple(list(kOutsideColour), list(kOutsideStripe));
#ifdef TOLVOL_GL
  module.def("render_distance", &render_distance, py::arg("vertices"), py::arg("triangles"), py::arg("volume"),
             py::kw_only(), py::arg("camera") = py::none(), py::arg("size") = Size{1024, 1024},
             py::arg("transfer") = "signed", py::arg("to_world") = py::none(), py::arg("edges") = false,
             py::arg("samples") = 2, py::arg("threads") = py::none(), py::arg("progress") = py::none(),
             R"doc(Draw a mesh, with each pixel coloured by its distance from the reference of a volume.

What is farther away than the tolerance is striped. A picture proves nothing.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
volume : ToleranceVolume
camera : Camera, optional
    None frames the mesh.
size : two ints
    Width and height.
transfer : {"signed", "magnitude"}
    See transfer_colours.
edges : bool
    Whether the edges of the mesh are drawn too.
samples : int
    From 1 to 8: a pixel has samples * samples of them.
to_world, threads, progress
    See help(tolvol).

Returns
-------
(height, width, 4) uint8 array
    RGBA, the top row first, transparent where there is no mesh.

Raises
------
InvalidInput
GlUnavailable
Cancelled

Notes
-----
Distances are interpolated in a grid of 4 nodes per tolerance, or fewer if 256 MB or OpenGL do not hold it. They are off by
less than 2 % of the tolerance where the reference is smooth, and by 22 % at the worst.

Cost: the first picture of a volume takes about 0.5 s for the grid, which is kept. Without a GPU a picture then takes about
0.1 s for 270,000 triangles with samples=1.

After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 3.)doc");
  module.def("render_volume", &render_volume, py::arg("volume"), py::kw_only(), py::arg("camera") = py::none(),
             py::arg("size") = Size{1024, 1024}, py::arg("vertices") = py::none(), py::arg("triangles") = py::none(),
             py::arg("to_world") = py::none(), py::arg("cut") = py::none(), py::arg("samples") = 2,
             py::arg("threads") = py::none(), py::arg("progress") = py::none(),
             R"doc(Draw a tolerance volume as a translucent shell with a mesh inside.

A picture proves nothing.

Parameters
----------
volume : ToleranceVolume
vertices, triangles : optional
    The mesh inside. None is the reference itself.
cut : (point, normal), optional
    A plane of three floats each, in world units. The volume is taken away on the side that the normal points to, and the
    section shows the distances.
camera, size, samples, to_world, threads, progress
    As for render_distance.

Returns
-------
(height, width, 4) uint8 array
    RGBA, the top row first, transparent where there is neither.

Raises
------
InvalidInput
GlUnavailable
Cancelled

Notes
-----
Cost: seconds without a GPU.

After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, figure 1.)doc");
#else
  module.def("render_distance", &no_pictures, "Raise GlUnavailable: this module was built without TOLVOL_GL.");
  module.def("render_volume", &no_pictures, "Raise GlUnavailable: this module was built without TOLVOL_GL.");
#endif
}

}  // namespace tolvol::python
