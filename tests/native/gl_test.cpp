// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "base/errors.h"
#include "gl_fixture.h"

namespace {

using namespace tolvol;

class Gl : public GlTest {};

std::string message_of(const std::function<void()>& work) {
  try {
    gl::run(work);
  } catch (const GlUnavailable& error) {
    return error.what();
  }
  return "";
}

TEST_F(Gl, NamesWhatDraws) {
  const gl::Renderer renderer = gl::renderer();
  EXPECT_FALSE(renderer.vendor.empty());
  EXPECT_FALSE(renderer.renderer.empty());
  EXPECT_NE(renderer.name().find(renderer.version), std::string::npos);
}

TEST_F(Gl, RunsOnOneOtherThreadAndWaits) {
  std::thread::id first, second, nested;
  gl::run([&] {
    first = std::this_thread::get_id();
    gl::run([&] { nested = std::this_thread::get_id(); });
  });
  std::thread([&] { gl::run([&] { second = std::this_thread::get_id(); }); }).join();
  EXPECT_NE(first, std::this_thread::get_id());
  EXPECT_EQ(first, second);
  EXPECT_EQ(first, nested);
}

TEST_F(Gl, ThrowsWhatTheWorkThrows) {
  EXPECT_THROW(gl::run([] { throw InvalidInput("mine"); }), InvalidInput);
  gl::run([] {});
}

TEST_F(Gl, ErrorsBecomeExceptionsOnce) {
  const std::string message = message_of([] { glEnable(0x7777); });
  EXPECT_EQ(message.find("GL unavailable: GL error"), 0u) << message;
  EXPECT_GT(message.size(), 25u);
  EXPECT_EQ(message_of([] {}), "");
}

TEST_F(Gl, BuffersKeepWhatIsWritten) {
  gl::run([] {
    const std::vector<int> values = {1, 2, 3, 4};
    gl::Buffer buffer(values);
    const int five = 5;
    buffer.write(sizeof(int), sizeof(int), &five);
    std::vector<int> read(4);
    buffer.read(0, 4 * sizeof(int), read.data());
    EXPECT_EQ(read, (std::vector<int>{1, 5, 3, 4}));
    buffer.clear();
    buffer.read(0, 4 * sizeof(int), read.data());
    EXPECT_EQ(read, std::vector<int>(4, 0));
    EXPECT_EQ(gl::Buffer(0, nullptr).bytes(), 0u);
  });
}

TEST_F(Gl, ShaderErrorsNameFileAndReason) {
  const std::string message = message_of([] { gl::Program({{GL_VERTEX_SHADER, {"samples.vert", "samples.vert"}}}); });
  EXPECT_NE(message.find("samples.vert + samples.vert does not compile: "), std::string::npos) << message;
  EXPECT_NE(message.find("main"), std::string::npos) << message;
}

TEST_F(Gl, ObjectsOfALostContextSaySo) {
  gl::Buffer buffer;
  gl::run([&] { buffer = gl::Buffer(16, nullptr); });
  EXPECT_NE(message_of([] {
              eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
            }).find("lost"),
            std::string::npos);
  EXPECT_NE(message_of([&] { buffer.clear(); }).find("lost"), std::string::npos);
  gl::run([&] { buffer = gl::Buffer(16, nullptr); });
  EXPECT_EQ(message_of([&] { buffer.clear(); }), "");
}

TEST_F(Gl, NothingIsDeletedOnceTheContextIsLost) {
  gl::renderer();
  EXPECT_NE(message_of([] { eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }),
            "");
  std::promise<unsigned> generation;
  gl::post([&] { generation.set_value(gl::generation()); });
  EXPECT_EQ(generation.get_future().get(), 0u);
}

TEST_F(Gl, ShutsDownAndStartsAgain) {
  gl::Buffer buffer;
  gl::run([&] { buffer = gl::Buffer(16, nullptr); });
  gl::shutdown();
  gl::shutdown();
  EXPECT_NE(message_of([&] { buffer.clear(); }), "");
  gl::run([] { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); });
}

TEST_F(Gl, FramebuffersHoldWhatWasCleared) {
  gl::run([] {
    const gl::Framebuffer framebuffer = gl::Framebuffer::with_colour(3, 2);
    framebuffer.bind();
    glClearColor(1, 0, 0.5f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    const std::vector<std::uint8_t> pixels = framebuffer.read_pixels();
    ASSERT_EQ(pixels.size(), 24u);
    EXPECT_EQ(pixels[20], 255);
    EXPECT_NEAR(pixels[22], 128, 1);
    EXPECT_GE(gl::Framebuffer::largest(), 1024);
  });
}

}  // namespace
