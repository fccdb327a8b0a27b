// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "gl_fixture.h"
#include "picture/render_distance.h"
#include "picture/render_volume.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using Colour = std::array<int, 4>;

constexpr double kEpsilon = 0.1;

/// A sphere about the origin.
TriangleMesh sphere(double radius, unsigned n = 48) { return shapes::sphere(n, radius); }

/// A square of side 2 about the origin, turned about the y axis.
TriangleMesh square(double turn = 0, const dvec3& shift = dvec3(0)) {
  return shapes::squares(8, [&](const dvec3& p) {
    const dvec3 q = 2.0 * p - dvec3(1, 1, 0);
    return dvec3(q.x * std::cos(turn), q.y, q.x * std::sin(turn)) + shift;
  });
}

/// Everything is its own frame here.
const Frame kFrame;
StoredSpace world() { return StoredSpace(glm::dmat4(1), Storage::float64, kFrame); }

/// Onto the plane z = 0, y upwards, two units high there.
Camera from_above(double distance = 100) {
  return {{0, 0, distance}, {0, 0, 0}, {0, 1, 0}, glm::degrees(2 * std::atan(1 / distance))};
}

Colour at(const Image& image, int x, int y) {
  Colour c;
  const std::size_t first = 4 * (std::size_t(y) * std::size_t(image.width) + std::size_t(x));
  for (std::size_t k = 0; k < 4; ++k) c[k] = image.pixels[first + k];
  return c;
}

Colour centre(const Image& image) { return at(image, image.width / 2, image.height / 2); }

bool striped(const Colour& c) {
  const auto is = [&](const glm::u8vec3& s) { return c[0] == s.x && c[1] == s.y && c[2] == s.z && c[3] == 255; };
  return is(kOutsideColour) || is(kOutsideStripe);
}

std::size_t count_striped(const Image& image) {
  std::size_t count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) count += striped(at(image, x, y));
  }
  return count;
}

Resolution resolution(int width, int height, int samples = 1) { return {{width, height}, samples}; }

/// A picture of `mesh` against `reference`.
Image draw(const TriangleMesh& mesh, const TriangleMesh& reference, const DistanceRenderer::Options& options,
           const Camera& camera = from_above()) {
  const PictureField field(reference, false, kEpsilon);
  return DistanceRenderer(field).render({mesh.vertices, mesh.triangles, world(), field}, camera, kFrame, options);
}

class Picture : public GlTest {};

TEST_F(Picture, CentreHasTheTransferColourOfItsDistance) {
  const TriangleMesh reference = sphere(1);
  const PictureField field(reference, false, kEpsilon);
  EXPECT_EQ(field.precision(), PictureField::kPrecision);
  DistanceRenderer renderer(field);
  for (const Transfer transfer : {Transfer::signed_distance, Transfer::magnitude}) {
    const std::vector<glm::u8vec3> colours = transfer_colours(transfer, 1001);
    for (const double share : {-0.95, -0.5, -0.1, 0.0, 0.1, 0.5, 0.95}) {
      const TriangleMesh mesh = sphere(1 + share * kEpsilon);
      const Image image = renderer.render({mesh.vertices, mesh.triangles, world(), field}, from_above(), kFrame,
                                          {transfer, false, resolution(65, 65), nullptr});
      const double unit = transfer == Transfer::magnitude ? std::abs(share) : 0.5 + 0.5 * share;
      const glm::u8vec3 expected = colours[std::size_t(std::lround(1000 * unit))];
      const Colour seen = centre(image);
      // Two per cent of the tolerance are at most 5 steps of a map with 256.
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(seen[std::size_t(k)], expected[k], 8) << share << " channel " << k;
      EXPECT_EQ(seen[3], 255);
      EXPECT_EQ(at(image, 0, 0), Colour{}) << "the background is transparent";
      EXPECT_EQ(count_striped(image), 0u) << share;
    }
  }
}

TEST_F(Picture, DistancesAreWithinTwoPerCentWhereTheReferenceIsSmooth) {
  // Read from the field itself: colours would round them.
  const PictureField field(shapes::torus(96), false, kEpsilon);
  std::vector<float> texels(std::size_t(field.nodes().x) * std::size_t(field.nodes().y) * std::size_t(field.nodes().z));
  gl::run([&] {
    glGetTextureImage(field.texture().name(), 0, GL_RED, GL_FLOAT, GLsizei(texels.size() * sizeof(float)),
                      texels.data());
  });
  const auto texel = [&](const glm::ivec3& n) {
    return double(
        texels[(std::size_t(n.z) * std::size_t(field.nodes().y) + std::size_t(n.y)) * std::size_t(field.nodes().x) +
               std::size_t(n.x)]);
  };
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  const TriangleMesh reference = shapes::torus(96);
  const Hierarchy hierarchy(reference);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double u = 2 * std::numbers::pi * uniform(engine), v = 2 * std::numbers::pi * uniform(engine);
    const double r = 0.4 + kEpsilon * (2 * uniform(engine) - 1);
    const dvec3 p((1 + r * std::cos(v)) * std::cos(u), (1 + r * std::cos(v)) * std::sin(u), r * std::sin(v));
    const dvec3 place = (p - field.origin()) / field.spacing(), t = glm::fract(place);
    double value = 0;
    for (int k = 0; k < 8; ++k) {
      const glm::ivec3 corner(k & 1, k >> 1 & 1, k >> 2);
      const dvec3 w = glm::mix(1.0 - t, t, dvec3(corner));
      value += w.x * w.y * w.z * texel(glm::ivec3(place) + corner);
    }
    worst = std::max(worst, std::abs(std::abs(value) * field.spacing() - hierarchy.nearest(p).distance));
  }
  EXPECT_LT(worst, 0.02 * kEpsilon);
}

TEST_F(Picture, AMirroredReferenceHasItsInsideWhereItIsInTheWorld) {
  // From above onto a square a little above: in front of it, or behind when its faces run the other way round.
  const TriangleMesh reference = square(), mesh = square(0, {0, 0, 0.9 * kEpsilon});
  const auto seen = [&](bool mirrored) {
    const PictureField field(reference, mirrored, kEpsilon);
    return centre(DistanceRenderer(field).render({mesh.vertices, mesh.triangles, world(), field}, from_above(), kFrame,
                                                 {.resolution = resolution(65, 65)}));
  };
  EXPECT_GT(seen(false)[0], seen(false)[2]) << "outside is red";
  EXPECT_GT(seen(true)[2], seen(true)[0]);
}

TEST_F(Picture, WhatIsOutOfToleranceIsStriped) {
  const Image image = draw(sphere(1 + 1.1 * kEpsilon), sphere(1), {.resolution = resolution(200, 200)});
  std::set<Colour> colours;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) colours.insert(at(image, x, y));
  }
  // Nothing, and the two of the stripes.
  EXPECT_EQ(colours.size(), 3u);
  EXPECT_GT(count_striped(image), 30000u);
}

TEST_F(Picture, TheBorderOfTheStripesIsWhereTheToleranceIs) {
  const double turn = std::asin(0.2);
  const Image image = draw(square(turn), square(), {.resolution = resolution(400, 400)});
  for (int y = 20; y < 380; ++y) {
    for (int x = 20; x < 380; ++x) {
      const double distance = std::abs((x + 0.5 - 200) / 200 * std::tan(turn));
      if (std::abs(distance - kEpsilon) < 0.02 * kEpsilon) continue;
      EXPECT_EQ(striped(at(image, x, y)), distance > kEpsilon) << x << ", " << y;
    }
  }
}

TEST_F(Picture, BeyondTheBorderOfAnOpenReferenceNothingSeemsNear) {
  // The square stands upright beside the border and crosses the plane of the reference: there the sign changes without
  // a surface.
  const TriangleMesh beside = square(std::numbers::pi / 2, {1 + 1.2 * kEpsilon, 0, 0});
  const Camera from_the_right{{100, 0, 0}, {0, 0, 0}, {0, 0, 1}, 1};
  const Image image = draw(beside, square(), {.resolution = resolution(100, 100)}, from_the_right);
  EXPECT_EQ(count_striped(image), 10000u);
}

TEST_F(Picture, SamplesSmoothEdgesAreDrawnAndColoursAreNotDarkenedByNothing) {
  const TriangleMesh reference = sphere(1);
  const Camera camera = from_above();
  const auto partly = [](const Image& image) {
    std::size_t count = 0;
    for (std::size_t i = 3; i < image.pixels.size(); i += 4) count += image.pixels[i] > 0 && image.pixels[i] < 255;
    return count;
  };
  const Image one = draw(reference, reference, {.resolution = resolution(100, 100, 1)}, camera);
  const Image four = draw(reference, reference, {.resolution = resolution(100, 100, 4)}, camera);
  EXPECT_EQ(partly(one), 0u);
  EXPECT_GT(partly(four), 100u);
  for (int i = 0; i < 100 * 100; ++i) {
    const Colour c = at(four, i % 100, i / 100);
    if (c[3] > 0) {
      EXPECT_GT(c[0] + c[1] + c[2], 255) << "colours are not multiplied by alpha";
    }
  }
  const Image edges = draw(reference, reference, {.edges = true, .resolution = resolution(100, 100, 1)}, camera);
  EXPECT_NE(edges.pixels, one.pixels);
  EXPECT_LT(centre(edges)[0] + at(edges, 51, 50)[0] + at(edges, 50, 51)[0] + at(edges, 51, 51)[0],
            centre(one)[0] + at(one, 51, 50)[0] + at(one, 50, 51)[0] + at(one, 51, 51)[0]);
}

TEST_F(Picture, TilesMakeOnePicture) {
  const TriangleMesh reference = sphere(1), mesh = sphere(1 + 1.5 * kEpsilon);
  // 4098 samples a row: two tiles and a rest of two samples.
  const Image image = draw(mesh, reference, {.resolution = resolution(2049, 9, 2)}, from_above());
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 2049; ++x) {
      EXPECT_EQ(at(image, x, y)[3], at(image, 2048 - x, y)[3]);
      EXPECT_EQ(at(image, x, y)[3], at(image, x, 8 - y)[3]);
    }
  }
  EXPECT_EQ(centre(image)[3], 255);
}

TEST_F(Picture, EveryMeshIsDrawnAsIfItWereTheFirst) {
  const TriangleMesh reference = sphere(1);
  const PictureField field(reference, false, kEpsilon);
  DistanceRenderer renderer(field);
  const auto picture = [&](DistanceRenderer& by, const TriangleMesh& mesh, int size) {
    return by.render({mesh.vertices, mesh.triangles, world(), field}, from_above(), kFrame,
                     {.resolution = resolution(size, size)});
  };
  for (const auto& [n, size] : {std::pair{6u, 64}, {40u, 64}, {38u, 30}, {2u, 64}}) {
    const TriangleMesh mesh = sphere(1 + kEpsilon / n, n);
    DistanceRenderer fresh(field);
    EXPECT_EQ(picture(renderer, mesh, size).pixels, picture(fresh, mesh, size).pixels) << n;
  }
}

TEST_F(Picture, TheCameraFramesTheMeshTightly) {
  const TriangleMesh mesh = sphere(1, 12);
  for (const double aspect : {0.4, 1.0, 3.0}) {
    Framing how;
    how.aspect = aspect;
    const Resolution r = resolution(int(200 * aspect), 200);
    const Image image = draw(mesh, mesh, {.resolution = r}, framing(mesh.vertices, mesh.triangles, how));
    int left = r.size.x, top = r.size.y;
    for (int y = 0; y < r.size.y; ++y) {
      for (int x = 0; x < r.size.x; ++x) {
        if (at(image, x, y)[3]) left = std::min(left, x), top = std::min(top, y);
      }
    }
    EXPECT_GE(std::min(left, top), 1) << aspect;
    EXPECT_LE(std::min(left, top), 8) << aspect;
    how.margin = 0.5;
    const Camera far = framing(mesh.vertices, mesh.triangles, how);
    EXPECT_GT(glm::length(far.eye), 1.4 * glm::length(framing(mesh.vertices, mesh.triangles, {.aspect = aspect}).eye));
  }
}

TEST_F(Picture, CamerasThatSeeNothingAreRefused) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  for (const Camera& bad :
       {Camera{{nan, 0, 0}, {0, 0, 0}, {0, 0, 1}, 30}, Camera{{0, 0, 0}, {infinity, 0, 0}, {0, 0, 1}, 30},
        Camera{{1, 1, 1}, {1, 1, 1}, {0, 0, 1}, 30}, Camera{{0, 0, 5}, {0, 0, 0}, {0, 0, -2}, 30},
        Camera{{0, 5, 0}, {0, 0, 0}, {0, 0, 0}, 30}, Camera{{0, 5, 0}, {0, 0, 0}, {0, 0, 1}, 0},
        Camera{{0, 5, 0}, {0, 0, 0}, {0, 0, 1}, 180}, Camera{{0, 5, 0}, {0, 0, 0}, {0, 0, 1}, nan}}) {
    EXPECT_THROW(validate(bad), InvalidInput);
  }
  validate({{1e-200, 0, 0}, {0, 0, 0}, {0, 0, 1e-300}, 30});
  validate({{1e200, 0, 0}, {0, 0, 0}, {0, 0, 1e300}, 30});
  const TriangleMesh point{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, {{0, 1, 2}}};
  EXPECT_LT(glm::distance(framing(point.vertices, point.triangles, {}).target, dvec3(1, 2, 3)), 1e-12);
  EXPECT_THROW(framing(point.vertices, point.triangles, {.aspect = infinity}), InvalidInput);
  EXPECT_THROW(framing(point.vertices, point.triangles, {.margin = -1}), InvalidInput);
}

TEST_F(Picture, SizesThatCannotBeDrawnAreRefused) {
  int largest = 0;
  gl::run([&] { largest = gl::Framebuffer::largest(); });
  for (const Resolution& bad : {resolution(0, 9), resolution(9, -1), resolution(largest + 1, 9),
                                resolution(largest / 2 + 1, 9, 2), resolution(9, 9, 0), resolution(9, 9, 9)}) {
    EXPECT_THROW(require(bad), InvalidInput);
  }
  require(resolution(largest, largest));
  const TriangleMesh mesh = sphere(1);
  EXPECT_EQ(draw(mesh, mesh, {.resolution = resolution(1, 1)}).pixels.size(), 4u);
  EXPECT_EQ(draw(mesh, mesh, {.resolution = resolution(largest, 1)}).width, largest);
}

TEST_F(Picture, MeshesThatCannotBeDrawnAreRefused) {
  const TriangleMesh reference = sphere(1, 6);
  TriangleMesh bad = reference;
  bad.vertices[7].y = std::nan("");
  EXPECT_THROW(draw(bad, reference, {}), InvalidInput);
  bad.vertices[7].y = 1e30;
  try {
    draw(bad, reference, {});
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("vertex 7 is too far"), std::string::npos) << error.what();
  }
  EXPECT_THROW(draw({}, reference, {}), InvalidInput);
  // Behind the eye, and with the eye inside.
  EXPECT_EQ(centre(draw(reference, reference, {}, {{0, 0, 9}, {0, 0, 10}, {0, 1, 0}, 30})), Colour{});
  EXPECT_EQ(centre(draw(reference, reference, {}, {{0, 0, 0}, {0, 0, 10}, {0, 1, 0}, 30}))[3], 255);
}

TEST_F(Picture, StopsWhenAskedTo) {
  const TriangleMesh mesh = sphere(1);
  Progress progress;
  const PictureField field(mesh, false, kEpsilon);
  DistanceRenderer renderer(field);
  const DrawnMesh drawn{mesh.vertices, mesh.triangles, world(), field};
  progress.cancel();
  EXPECT_THROW(renderer.render(drawn, from_above(), kFrame, {.progress = &progress}), Cancelled);
  EXPECT_STREQ(progress.stage(), "picture");
  EXPECT_EQ(centre(renderer.render(drawn, from_above(), kFrame, {}))[3], 255);
}

TEST_F(Picture, ALostContextIsSaid) {
  const TriangleMesh mesh = sphere(1);
  const PictureField field(mesh, false, kEpsilon);
  DistanceRenderer renderer(field);
  const DrawnMesh drawn{mesh.vertices, mesh.triangles, world(), field};
  gl::shutdown();
  EXPECT_THROW(renderer.render(drawn, from_above(), kFrame, {}), GlUnavailable);
  EXPECT_EQ(centre(draw(mesh, mesh, {}))[3], 255);
}

/// The volume of a sphere of radius 1, with another mesh in it.
Image draw_volume(const TriangleMesh& mesh, const VolumeRenderer::Options& options) {
  const TriangleMesh reference = sphere(1);
  const PictureField field(reference, false, kEpsilon);
  VolumeRenderer renderer(field, Hierarchy(reference));
  Camera camera = from_above();
  camera.angle *= 1.25;
  return renderer.render({mesh.vertices, mesh.triangles, world(), field}, camera, kFrame, options);
}

TEST_F(Picture, TheShellTakesAsMuchLightAsTheRayIsLongInIt) {
  const int size = 251;
  const Image image = draw_volume(sphere(0.2), {.resolution = resolution(size, size)});
  const double unit = size / 2.5;  // pixels
  const auto alpha = [&](double radius) {
    return at(image, int(std::lround(size / 2 + radius * unit)), size / 2)[3] / 255.0;
  };
  EXPECT_EQ(alpha(0), 1) << "the mesh is opaque";
  EXPECT_GT(alpha(1 + 0.98 * kEpsilon), 0);
  EXPECT_EQ(alpha(1 + 1.03 * kEpsilon), 0);
  const auto inside = [](double radius) {
    const auto half = [&](double r) { return std::sqrt(std::max(r * r - radius * radius, 0.0)); };
    return 2 * (half(1 + kEpsilon) - half(1 - kEpsilon));
  };
  for (const double radius : {0.3, 0.5, 0.7, 0.85, 0.95}) {
    const double facing = std::sqrt(1 - std::pow(radius / (1 + kEpsilon), 2)), rim = std::pow(1 - facing, 3);
    EXPECT_NEAR(alpha(radius), 1 - std::exp(-0.4 * inside(radius) / kEpsilon) * (1 - 0.7 * rim), 0.03) << radius;
  }
}

TEST_F(Picture, ACutTakesTheVolumeAwayAndShowsDistances) {
  const int size = 251;
  const double unit = size / 2.5;
  const Image image =
      draw_volume(sphere(0.2), {VolumeRenderer::Cut{{0, 0, 0}, {0, 0, 3}}, resolution(size, size), nullptr});
  const std::vector<glm::u8vec3> colours = transfer_colours(Transfer::signed_distance, 1001);
  for (const double share : {-0.8, -0.4, 0.0, 0.4, 0.8}) {
    const int x = int(std::floor(size / 2.0 + (1 + share * kEpsilon) * unit));
    const double seen = ((x + 0.5 - size / 2.0) / unit - 1) / kEpsilon;
    const glm::u8vec3 expected = colours[std::size_t(std::lround(500 * (1 + seen)))];
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(at(image, x, size / 2)[std::size_t(k)], expected[k], 8) << share;
  }
  const Image whole = draw_volume(sphere(0.2), {.resolution = resolution(size, size)});
  EXPECT_LT(at(image, size / 2 + int(0.5 * unit), size / 2)[3], at(whole, size / 2 + int(0.5 * unit), size / 2)[3]);
  // All of it, and the mesh stays.
  const Image none =
      draw_volume(sphere(0.2), {VolumeRenderer::Cut{{0, 0, -9}, {0, 0, 1}}, resolution(99, 99), nullptr});
  EXPECT_EQ(centre(none)[3], 255);
  EXPECT_EQ(at(none, 80, 49)[3], 0);
  EXPECT_THROW(draw_volume(sphere(1), {VolumeRenderer::Cut{{0, 0, 0}, {0, 0, 0}}, resolution(9, 9), nullptr}),
               InvalidInput);
  EXPECT_THROW(
      draw_volume(sphere(1), {VolumeRenderer::Cut{{0, std::nan(""), 0}, {0, 0, 1}}, resolution(9, 9), nullptr}),
      InvalidInput);
}

}  // namespace
