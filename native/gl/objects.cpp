// SPDX-License-Identifier: GPL-3.0-or-later
#include "gl/objects.h"

#include <algorithm>
#include <memory>
#include <sstream>

#include "base/errors.h"
#include "gl/context.h"
#include "gl/shaders.h"

namespace tolvol::gl {

Object::Object(GLuint name, Delete destroy) : name_(name), destroy_(destroy), generation_(generation()) {}

Object::~Object() {
  if (name_ == 0) return;
  post([name = name_, destroy = destroy_, made_in = generation_] {
    if (generation() == made_in) destroy(name);
  });
}

GLuint Object::name() const {
  if (name_ == 0 || generation_ != generation()) {
    throw GlUnavailable("GL unavailable: the context that held this was lost or shut down");
  }
  return name_;
}

Buffer::Buffer(std::size_t bytes, const void* data) : bytes_(bytes) {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  object_ = Object(name, [](GLuint n) { glDeleteBuffers(1, &n); });
  // GL refuses an empty buffer. One byte that is never used does no harm.
  glNamedBufferStorage(name, static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 1)), bytes ? data : nullptr,
                       GL_DYNAMIC_STORAGE_BIT);
}

void Buffer::write(std::size_t offset, std::size_t bytes, const void* data) {
  glNamedBufferSubData(name(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), data);
}

void Buffer::read(std::size_t offset, std::size_t bytes, void* data) const {
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  glGetNamedBufferSubData(name(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), data);
}

void Buffer::clear() {
  const GLuint zero = 0;
  glClearNamedBufferData(name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
}

void Buffer::bind_storage(GLuint binding) const { glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name()); }

void Buffer::require_room(std::size_t bytes, const char* what, const char* unlimited) {
  GLint64 limit = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
  if (bytes <= static_cast<std::size_t>(limit)) return;
  std::ostringstream text;
  text << what << " take " << (bytes >> 20) << " MB, more than this GL holds in one buffer (" << (limit >> 20)
       << " MB); " << unlimited << " has no such limit";
  throw ResourceLimit(text.str());
}

Texture::Texture(GLenum target, GLenum internal_format, const glm::ivec3& size, GLenum format, GLenum type,
                 const void* data, int row) {
  GLuint name = 0;
  glCreateTextures(target, 1, &name);
  object_ = Object(name, [](GLuint n) { glDeleteTextures(1, &n); });
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, row);
  switch (target) {
    case GL_TEXTURE_1D:
      glTextureStorage1D(name, 1, internal_format, size.x);
      if (data) glTextureSubImage1D(name, 0, 0, size.x, format, type, data);
      break;
    case GL_TEXTURE_2D:
      glTextureStorage2D(name, 1, internal_format, size.x, size.y);
      if (data) glTextureSubImage2D(name, 0, 0, 0, size.x, size.y, format, type, data);
      break;
    default:
      glTextureStorage3D(name, 1, internal_format, size.x, size.y, size.z);
      if (data) glTextureSubImage3D(name, 0, 0, 0, 0, size.x, size.y, size.z, format, type, data);
  }
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    glTextureParameteri(name, wrap, GL_CLAMP_TO_EDGE);
  }
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

void Texture::filter_linearly() {
  glTextureParameteri(name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
}

void Texture::bind(GLuint unit) const { glBindTextureUnit(unit, name()); }

int Texture::largest_3d() {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &largest);
  return largest;
}

namespace {

std::string log_of(GLuint name, void (*size)(GLuint, GLenum, GLint*),
                   void (*text)(GLuint, GLsizei, GLsizei*, GLchar*)) {
  GLint length = 0;
  size(name, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
  text(name, length, nullptr, log.data());
  log.resize(log.find('\0'));
  return log;
}

Object compile(const Program::Stage& stage) {
  Object shader(glCreateShader(stage.type), [](GLuint n) { glDeleteShader(n); });
  std::vector<const GLchar*> texts = {"#version 450 core\n"};
  std::vector<GLint> lengths = {-1};
  std::string names;
  for (const std::string_view file : stage.files) {
    const std::string_view source = shader_source(file);
    texts.push_back(source.data());
    lengths.push_back(static_cast<GLint>(source.size()));
    names.append(names.empty() ? "" : " + ").append(file);
  }
  glShaderSource(shader.name(), static_cast<GLsizei>(texts.size()), texts.data(), lengths.data());
  glCompileShader(shader.name());
  GLint ok = GL_FALSE;
  glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &ok);
  if (!ok) {
    throw GlUnavailable("GL unavailable: shader " + names +
                        " does not compile: " + log_of(shader.name(), glGetShaderiv, glGetShaderInfoLog));
  }
  return shader;
}

Object make_framebuffer() {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  return Object(name, [](GLuint n) { glDeleteFramebuffers(1, &n); });
}

Object make_renderbuffer(GLenum format, int width, int height) {
  GLuint name = 0;
  glCreateRenderbuffers(1, &name);
  Object object(name, [](GLuint n) { glDeleteRenderbuffers(1, &n); });
  glNamedRenderbufferStorage(name, format, width, height);
  return object;
}

void require_complete(GLuint framebuffer) {
  if (glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw GlUnavailable("GL unavailable: the framebuffer is not complete");
  }
}

}  // namespace

Program::Program(std::initializer_list<Stage> stages)
    : object_(glCreateProgram(), [](GLuint n) { glDeleteProgram(n); }) {
  std::vector<Object> shaders;
  for (const Stage& stage : stages) {
    shaders.push_back(compile(stage));
    glAttachShader(name(), shaders.back().name());
  }
  glLinkProgram(name());
  GLint ok = GL_FALSE;
  glGetProgramiv(name(), GL_LINK_STATUS, &ok);
  if (!ok) {
    throw GlUnavailable("GL unavailable: program does not link: " +
                        log_of(name(), glGetProgramiv, glGetProgramInfoLog));
  }
  for (const Object& shader : shaders) glDetachShader(name(), shader.name());
}

void Program::use() const { glUseProgram(name()); }

// A uniform that the compiler dropped because nothing needs it is ignored, as GL does.
GLint Program::location(const char* uniform) const { return glGetUniformLocation(name(), uniform); }
void Program::set(const char* uniform, int value) const { glProgramUniform1i(name(), location(uniform), value); }
void Program::set(const char* uniform, unsigned value) const { glProgramUniform1ui(name(), location(uniform), value); }
void Program::set(const char* uniform, float value) const { glProgramUniform1f(name(), location(uniform), value); }
void Program::set(const char* uniform, const glm::vec2& value) const {
  glProgramUniform2fv(name(), location(uniform), 1, &value.x);
}
void Program::set(const char* uniform, const glm::vec3& value) const {
  glProgramUniform3fv(name(), location(uniform), 1, &value.x);
}
void Program::set(const char* uniform, const glm::vec4& value) const {
  glProgramUniform4fv(name(), location(uniform), 1, &value.x);
}
void Program::set(const char* uniform, const glm::ivec3& value) const {
  glProgramUniform3iv(name(), location(uniform), 1, &value.x);
}
void Program::set(const char* uniform, const glm::mat4& value) const {
  glProgramUniformMatrix4fv(name(), location(uniform), 1, GL_FALSE, &value[0][0]);
}

Query::Query(GLenum target) : target_(target) {
  GLuint name = 0;
  glCreateQueries(target, 1, &name);
  object_ = Object(name, [](GLuint n) { glDeleteQueries(1, &n); });
}

void Query::begin() const { glBeginQuery(target_, object_.name()); }
void Query::end() const { glEndQuery(target_); }

std::uint64_t Query::result() const {
  GLuint64 value = 0;
  glGetQueryObjectui64v(object_.name(), GL_QUERY_RESULT, &value);
  return value;
}

Framebuffer Framebuffer::without_attachments(int width, int height) {
  Framebuffer f;
  f.object_ = make_framebuffer();
  f.width_ = width, f.height_ = height;
  glNamedFramebufferParameteri(f.object_.name(), GL_FRAMEBUFFER_DEFAULT_WIDTH, width);
  glNamedFramebufferParameteri(f.object_.name(), GL_FRAMEBUFFER_DEFAULT_HEIGHT, height);
  require_complete(f.object_.name());
  return f;
}

Framebuffer Framebuffer::with_colour(int width, int height) {
  Framebuffer f;
  f.object_ = make_framebuffer();
  f.width_ = width, f.height_ = height;
  f.colour_ = make_renderbuffer(GL_RGBA8, width, height);
  f.depth_ = make_renderbuffer(GL_DEPTH_COMPONENT32F, width, height);
  glNamedFramebufferRenderbuffer(f.object_.name(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, f.colour_.name());
  glNamedFramebufferRenderbuffer(f.object_.name(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, f.depth_.name());
  require_complete(f.object_.name());
  return f;
}

void Framebuffer::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, object_.name());
  glViewport(0, 0, width_, height_);
}

std::vector<std::uint8_t> Framebuffer::read_pixels() const {
  bind();
  std::vector<std::uint8_t> pixels(std::size_t{4} * static_cast<std::size_t>(width_) *
                                   static_cast<std::size_t>(height_));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  return pixels;
}

int Framebuffer::largest() {
  GLint viewport[2] = {}, width = 0, height = 0;
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
  glGetIntegerv(GL_MAX_FRAMEBUFFER_WIDTH, &width);
  glGetIntegerv(GL_MAX_FRAMEBUFFER_HEIGHT, &height);
  return std::min({viewport[0], viewport[1], width, height});
}

VertexArray VertexArray::make() {
  VertexArray array;
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  array.object_ = Object(name, [](GLuint n) { glDeleteVertexArrays(1, &n); });
  return array;
}

void VertexArray::bind() const { glBindVertexArray(object_.name()); }

}  // namespace tolvol::gl
