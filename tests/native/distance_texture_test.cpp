// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/distance_texture.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/errors.h"
#include "field/scatter.h"
#include "gl_fixture.h"
#include "laid_out.h"
#include "shapes.h"

namespace {

using namespace tolvol;

class DistanceTextureTest : public GlTest {
 protected:
  static constexpr double kTolerance = 0.1;

  static DistanceGrid grid() {
    const TriangleMesh torus = shapes::torus(12);
    DistanceGrid grid = laid_out(torus, kTolerance, 3.0);
    scatter(torus, grid);
    return grid;
  }

  /// Every texel as DistanceTexture says it is to be read, in the grid's order without its padding.
  static std::vector<float> texels(const DistanceGrid& grid, TextureFormat format, double& quantisation) {
    std::vector<float> values(static_cast<std::size_t>(grid.nodes.x) * grid.nodes.y * grid.nodes.z);
    gl::run([&] {
      const DistanceTexture texture(grid, grid.distance, kTolerance, format);
      quantisation = texture.quantisation();
      glGetTextureImage(texture.texture().name(), 0, GL_RED, GL_FLOAT,
                        static_cast<GLsizei>(values.size() * sizeof(float)), values.data());
      for (float& value : values) value = value * texture.scale() + texture.offset();
    });
    return values;
  }
};

TEST_F(DistanceTextureTest, HoldsTheGridWithinItsQuantisation) {
  const DistanceGrid g = grid();
  ASSERT_NE(g.nodes.x, g.pitch) << "wanted: rows with padding";
  for (const TextureFormat format : {TextureFormat::normalised8, TextureFormat::normalised16, TextureFormat::float32}) {
    double quantisation = -1;
    const std::vector<float> values = texels(g, format, quantisation);
    EXPECT_EQ(quantisation == 0, format == TextureFormat::float32);
    double largest = 0;
    std::size_t i = 0;
    for (int z = 0; z < g.nodes.z; ++z) {
      for (int y = 0; y < g.nodes.y; ++y) {
        for (int x = 0; x < g.nodes.x; ++x, ++i) {
          double expected = g.distance[g.index(x, y, z)];
          if (format != TextureFormat::float32) expected = std::min(expected, kTolerance);
          largest = std::max(largest, std::abs(values[i] - expected));
        }
      }
    }
    EXPECT_LE(largest, quantisation * 1.0001 + 1e-7);
    if (format == TextureFormat::normalised8) {
      EXPECT_GT(largest, quantisation / 10);
    }
  }
}

TEST_F(DistanceTextureTest, KeepsTheSign) {
  DistanceGrid g = grid();
  for (float& d : g.distance) d = -d;
  double quantisation = 0;
  const std::vector<float> values = texels(g, TextureFormat::normalised16, quantisation);
  EXPECT_NEAR(*std::min_element(values.begin(), values.end()), -kTolerance, 1e-6);
}

TEST_F(DistanceTextureTest, NodesAreAtTheCentresOfTexels) {
  const DistanceGrid g = grid();
  const TextureCoordinates coordinates(g);
  const glm::ivec3 node(3, 5, 7);
  const glm::dvec3 position = g.origin + g.spacing * glm::dvec3(node);
  const glm::dvec3 texel = ((position - g.origin) * coordinates.scale + coordinates.offset) * glm::dvec3(g.nodes);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(texel[k], node[k] + 0.5, 1e-12);
}

TEST_F(DistanceTextureTest, TooLargeNamesThePrecisionThatFits) {
  Box box;
  box.add(glm::dvec3(0)), box.add(glm::dvec3(1, 1e-4, 1e-4));
  gl::run([&] {
    const double limit = 1.0 / gl::Texture::largest_3d();
    const auto make = [&](double precision) {
      const DistanceGrid g = layout_grid(box, limit, precision);
      return DistanceTexture(g, std::vector<float>(g.index(0, 0, g.nodes.z)), limit, TextureFormat::normalised8);
    };
    try {
      make(2);
      FAIL() << "accepted";
    } catch (const ResourceLimit& error) {
      const std::string message = error.what();
      const std::size_t at = message.find("precision ");
      ASSERT_NE(at, std::string::npos) << message;
      const double precision = std::stod(message.substr(at + 10));
      EXPECT_GT(precision, 0.5);
      EXPECT_NO_THROW(make(precision));
    }
  });
}

}  // namespace
