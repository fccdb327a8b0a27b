// SPDX-License-Identifier: GPL-3.0-or-later
/// GL objects that delete themselves. They are made and used on the GL thread (inside run()), and destroyed on any
/// thread. Using an object whose context is gone throws GlUnavailable.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gl/context.h"

namespace tolvol::gl {

/// The name of one GL object. It can be moved.
class Object {
 public:
  using Delete = void (*)(GLuint);

  Object() = default;
  Object(GLuint name, Delete destroy);
  Object(Object&& other) noexcept { swap(other); }
  Object& operator=(Object&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Object();

  /// Throws GlUnavailable if it is empty or its context is gone.
  GLuint name() const;

 private:
  void swap(Object& other) noexcept {
    std::swap(name_, other.name_), std::swap(destroy_, other.destroy_), std::swap(generation_, other.generation_);
  }

  GLuint name_ = 0;
  Delete destroy_ = nullptr;
  unsigned generation_ = 0;
};

/// Immutable storage on the GPU.
class Buffer {
 public:
  Buffer() = default;
  /// `data` may be null: the content is then undefined.
  Buffer(std::size_t bytes, const void* data);
  template <class T>
  explicit Buffer(const std::vector<T>& values) : Buffer(values.size() * sizeof(T), values.data()) {}

  GLuint name() const { return object_.name(); }
  std::size_t bytes() const { return bytes_; }
  void write(std::size_t offset, std::size_t bytes, const void* data);
  /// Waits for the GPU.
  void read(std::size_t offset, std::size_t bytes, void* data) const;
  void clear();
  void bind_storage(GLuint binding) const;
  /// Throws ResourceLimit, naming `what` and what has no such limit, unless GL takes a buffer of that many bytes. Must
  /// be called on the GL thread.
  static void require_room(std::size_t bytes, const char* what, const char* unlimited);

 private:
  Object object_;
  std::size_t bytes_ = 0;
};

/// A 1D, 2D or 3D texture with one level, clamped at its edges.
class Texture {
 public:
  Texture() = default;
  /// `target` is GL_TEXTURE_1D, _2D or _3D. Components of the size beyond its dimension are 1. `row` is the number of
  /// pixels from one row of `data` to the next, 0 for size.x. `data` may be null.
  Texture(GLenum target, GLenum internal_format, const glm::ivec3& size, GLenum format, GLenum type, const void* data,
          int row = 0);

  GLuint name() const { return object_.name(); }
  void filter_linearly();
  void bind(GLuint unit) const;
  /// The largest side of a 3D texture.
  static int largest_3d();

 private:
  Object object_;
};

/// A program of a vertex and a fragment shader, or of a compute shader, from the sources in shaders/.
class Program {
 public:
  struct Stage {
    GLenum type;
    std::initializer_list<std::string_view> files;  ///< are joined in this order
  };

  Program() = default;
  /// Throws GlUnavailable with the compiler's log.
  explicit Program(std::initializer_list<Stage> stages);

  GLuint name() const { return object_.name(); }
  void use() const;
  void set(const char* uniform, int value) const;
  void set(const char* uniform, unsigned value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const glm::vec2& value) const;
  void set(const char* uniform, const glm::vec3& value) const;
  void set(const char* uniform, const glm::vec4& value) const;
  void set(const char* uniform, const glm::ivec3& value) const;
  void set(const char* uniform, const glm::mat4& value) const;

 private:
  GLint location(const char* uniform) const;
  Object object_;
};

/// Counts samples, or tells only whether there are any.
class Query {
 public:
  Query() = default;
  /// The target is GL_SAMPLES_PASSED or GL_ANY_SAMPLES_PASSED. It never changes, because GL keeps that of the first
  /// use.
  explicit Query(GLenum target);

  void begin() const;
  void end() const;
  /// Waits for the GPU.
  std::uint64_t result() const;

 private:
  Object object_;
  GLenum target_ = 0;
};

/// A framebuffer with colour (RGBA8) and depth, or one without attachments, for queries that count samples.
class Framebuffer {
 public:
  Framebuffer() = default;
  static Framebuffer without_attachments(int width, int height);
  static Framebuffer with_colour(int width, int height);

  void bind() const;
  /// Reads RGBA pixels, bottom row first. Waits for the GPU.
  std::vector<std::uint8_t> read_pixels() const;
  /// The largest side of a framebuffer without attachments, which is the smaller of framebuffer and viewport limits.
  static int largest();

 private:
  Object object_, colour_, depth_;
  int width_ = 0, height_ = 0;
};

/// The state that a draw call needs even when all vertices come from buffers that the shader reads itself.
class VertexArray {
 public:
  VertexArray() = default;
  static VertexArray make();
  void bind() const;

 private:
  Object object_;
};

/// Returns the one T of the current context, which is made on first use. Must be called on the GL thread. It is for
/// programs, which take long to compile.
template <class T>
T& of_context() {
  // This is never destroyed, because at the end of the process the driver may be gone first.
  static T* kept = nullptr;
  static unsigned made_in = 0;
  if (!kept || made_in != generation()) {
    delete std::exchange(kept, nullptr);
    kept = new T;
    made_in = generation();
  }
  return *kept;
}

}  // namespace tolvol::gl
