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
/// What the GPU keeps of a volume between two pictures.
struct Pictures {
  PictureField field;
  std::optional<DistanceRenderer> distance;
  std::optional<VolumeRenderer> volume;
};
#endif

namespace {

using Vector = std::array<double, 3>;
using Size = std::array<int, 2>;  // width, height

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
/// The image that draw(pictures) returns. Called without the GIL.
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
    volume.pictures.reset();  // made anew the next time
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
                                          int samples, int threads, Progress* progress) {
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
                                        int threads, Progress* progress) {
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
[[noreturn]] py::object no_pictures(const py::args&, const py::kwargs&) {
  throw GlUnavailable("GL unavailable: this module was built without it (TOLVOL_GL=OFF)");
}
#endif

}  // namespace

void bind_picture(py::module_& module) {
  py::class_<Camera>(module, "Camera", py::module_local(),
                     "From where a picture is taken, in perspective; world units.")
      .def(py::init(&make_camera), py::arg("eye"), py::arg("target"), py::arg("up") = vector(Framing().up),
           py::arg("angle") = Framing().angle,
           "eye, target, up: three numbers each. angle: the height of the picture in degrees. Raises InvalidInput when "
           "there is no\n"
           "such view.")
      .def_static("framing", &frame_mesh, py::arg("vertices"), py::arg("triangles"), py::arg("size") = Size{1024, 1024},
                  py::arg("direction") = vector(Framing().direction), py::arg("up") = vector(Framing().up),
                  py::arg("angle") = Framing().angle, py::arg("room") = 0.0, py::arg("to_world") = py::none(),
                  "The camera that sees all of a mesh, as large as a picture of `size` (width, height) can show it, "
                  "from `direction`,\n"
                  "which leads from the mesh to the eye. room: kept around the mesh, world units.")
      .def_property_readonly("eye", [](const Camera& c) { return vector(c.eye); })
      .def_property_readonly("target", [](const Camera& c) { return vector(c.target); })
      .def_property_readonly("up", [](const Camera& c) { return vector(c.up); })
      .def_readonly("angle", &Camera::angle, "Degrees.");

  module.def("transfer_colours", &colours, py::arg("transfer") = "signed",
             "(256, 3) uint8: the colours of a picture from one end of its range to the other, for a legend.\n"
             "\"signed\": from -tolerance (inside) to the tolerance, Moreland's cool to warm. \"magnitude\": from 0 to "
             "the tolerance,\n"
             "viridis.");
  const auto list = [](const glm::u8vec3& c) { return py::make_tuple(c.x, c.y, c.z); };
  module.attr("OUTSIDE_COLOURS") = py::make_tuple(list(kOutsideColour), list(kOutsideStripe));
#ifdef TOLVOL_GL
  module.def("render_distance", &render_distance, py::arg("vertices"), py::arg("triangles"), py::arg("volume"),
             py::arg("camera") = py::none(), py::arg("size") = Size{1024, 1024}, py::arg("transfer") = "signed",
             py::arg("to_world") = py::none(), py::arg("edges") = false, py::arg("samples") = 2, py::arg("threads") = 0,
             py::arg("progress") = py::none(),
             "A picture of a mesh, each pixel coloured by its distance to the volume's reference: (height, width, 4) "
             "uint8, RGBA, top\n"
             "row first, transparent where there is no mesh. What is farther than the tolerance is striped.\n\n"
             "camera: a Camera; None frames the mesh. size: (width, height). transfer: \"signed\" or \"magnitude\", "
             "see\n"
             "transfer_colours. edges: draw the mesh's edges too. samples: samples * samples a pixel, 1 to 8.\n"
             "Distances are read from a grid of 4 nodes per tolerance (fewer where 256 MB or GL do not hold it) and "
             "interpolated: off by\n"
             "under 2 % of the tolerance where the reference is smooth, by 22 % at the worst. A picture proves "
             "nothing.\n"
             "Raises InvalidInput, GlUnavailable. Cost: at the first picture of a volume about 0.5 s for its grid, "
             "which is kept; then\n"
             "without a GPU about 0.1 s for 270,000 triangles with samples=1.\n"
             "After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 3.");
  module.def("render_volume", &render_volume, py::arg("volume"), py::arg("camera") = py::none(),
             py::arg("size") = Size{1024, 1024}, py::arg("vertices") = py::none(), py::arg("triangles") = py::none(),
             py::arg("to_world") = py::none(), py::arg("cut") = py::none(), py::arg("samples") = 2,
             py::arg("threads") = 0, py::arg("progress") = py::none(),
             "A picture of the tolerance volume as a translucent shell with a mesh inside (by default the reference): "
             "(height, width,\n"
             "4) uint8, RGBA, top row first, transparent where there is neither.\n\n"
             "camera, size, samples: as for render_distance. cut: a plane (point, normal) that takes the volume away "
             "on the side its\n"
             "normal points to and shows the distances in the section. Raises InvalidInput, GlUnavailable. Cost: "
             "seconds without a GPU.\n"
             "After figure 1 of the same paper.");
#else
  module.def("render_distance", &no_pictures, "Needs a module built with TOLVOL_GL=ON.");
  module.def("render_volume", &no_pictures, "Needs a module built with TOLVOL_GL=ON.");
#endif
}

}  // namespace tolvol::python
