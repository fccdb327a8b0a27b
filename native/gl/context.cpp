// SPDX-License-Identifier: GPL-3.0-or-later
// Entry points come through libepoxy, which looks them up when they are first called, so that neither libEGL nor libGL
// need be present when the program starts. libepoxy ends the process if a library is missing; so this looks for it
// first.
#include "gl/context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "base/errors.h"

namespace tolvol::gl {
namespace {

[[noreturn]] void unavailable(const std::string& reason) { throw GlUnavailable("GL unavailable: " + reason); }

bool has_extension(const char* list, const char* name) { return list && std::strstr(list, name); }

bool can_load(const char* library) {
  void* const handle = dlopen(library, RTLD_LAZY | RTLD_LOCAL);
  if (handle) dlclose(handle);
  return handle != nullptr;
}

/// Returns the displays to try, hardware before software.
std::vector<EGLDisplay> displays() {
  const char* const client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  std::vector<EGLDisplay> found;
  if (has_extension(client, "EGL_EXT_device_enumeration") || has_extension(client, "EGL_EXT_device_base")) {
    EGLint count = 0;
    eglQueryDevicesEXT(0, nullptr, &count);
    std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(std::max(count, 0)));
    eglQueryDevicesEXT(count, devices.data(), &count);
    std::stable_partition(devices.begin(), devices.end(), [](EGLDeviceEXT device) {
      return !has_extension(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
    });
    for (const EGLDeviceEXT device : devices) {
      found.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
    }
  }
  if (has_extension(client, "EGL_MESA_platform_surfaceless")) {
    found.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  }
  return found;
}

std::atomic<unsigned> generations{0};

/// A context that is current for as long as it lives. It is made, used and destroyed on the GL thread.
class Context {
 public:
  Context() {
    if (!epoxy_has_egl()) unavailable("libEGL is missing (on Debian: apt-get install libegl1)");
    if (!can_load("libOpenGL.so.0") && !can_load("libGL.so.1")) {
      unavailable("libGL is missing (on Debian: apt-get install libgl1)");
    }
    for (const EGLDisplay display : displays()) {
      if (try_display(display)) return;
    }
    unavailable("no EGL device offers OpenGL 4.5 (on Debian: apt-get install libgl1-mesa-dri)");
  }
  ~Context() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
    eglReleaseThread();
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const Renderer& renderer() const { return renderer_; }
  bool lost() const { return lost_; }
  unsigned generation() const { return generation_; }

  /// Runs the work, and throws an exception if GL reported an error meanwhile.
  void run(const std::function<void()>& work) {
    error_.clear();
    work();
    lost_ = eglGetCurrentContext() != context_ || glGetGraphicsResetStatus() != GL_NO_ERROR;
    if (lost_) unavailable("the context was lost");
    const GLenum code = glGetError();
    while (glGetError() != GL_NO_ERROR) {
    }
    if (!error_.empty()) unavailable(error_);
    if (code != GL_NO_ERROR) unavailable("GL error " + std::to_string(code));
  }

 private:
  bool try_display(EGLDisplay display) {
    EGLint major = 0, minor = 0;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor)) return false;
    const char* const extensions = eglQueryString(display, EGL_EXTENSIONS);
    if (!has_extension(extensions, "EGL_KHR_surfaceless_context") ||
        !has_extension(extensions, "EGL_KHR_no_config_context") || !eglBindAPI(EGL_OPENGL_API)) {
      return false;
    }
    std::vector<EGLint> attributes = {EGL_CONTEXT_MAJOR_VERSION,       4,
                                      EGL_CONTEXT_MINOR_VERSION,       5,
                                      EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                      EGL_CONTEXT_OPENGL_DEBUG,        EGL_TRUE};
    if (major > 1 || minor >= 5) {
      attributes.insert(attributes.end(), {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET});
    }
    attributes.push_back(EGL_NONE);
    context_ = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
    if (context_ == EGL_NO_CONTEXT) return false;
    display_ = display;
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
      eglDestroyContext(display, context_);
      return false;
    }
    const auto text = [](GLenum name) { return std::string(reinterpret_cast<const char*>(glGetString(name))); };
    renderer_ = {text(GL_VENDOR), text(GL_RENDERER), text(GL_VERSION)};
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(
        [](GLenum, GLenum type, GLuint, GLenum, GLsizei, const GLchar* message, const void* context) {
          std::string& error = static_cast<Context*>(const_cast<void*>(context))->error_;
          if (type == GL_DEBUG_TYPE_ERROR && error.empty()) error = std::string("GL error: ") + message;
        },
        this);
    return true;
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  const unsigned generation_ = ++generations;
  bool lost_ = false;
  Renderer renderer_;
  std::string error_;  // is the first error since run() began
};

/// The thread with its queue and its context.
class Worker {
 public:
  Worker() : thread_([this] { serve(); }) {}

  /// Returns false and drops the work if the thread was stopped.
  bool submit(std::function<void()> work) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return false;
      queue_.push_back(std::move(work));
    }
    wake_.notify_one();
    return true;
  }
  /// Stops the thread after the work in the queue.
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }
  bool is_of_this_process() const { return process_ == getpid(); }

  /// Must be called on the thread itself. Makes the context on first use, so that a failure is thrown to the caller.
  Context& context() {
    if (context_ && context_->lost()) context_.reset();
    if (!context_) context_ = std::make_unique<Context>();
    return *context_;
  }
  /// Returns 0 without a context, and after the context was lost: nothing that was made in it may be deleted then.
  unsigned generation() const { return context_ && !context_->lost() ? context_->generation() : 0; }

 private:
  void serve();

  const pid_t process_ = getpid();
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> queue_;
  bool stopping_ = false;
  std::unique_ptr<Context> context_;
  std::thread thread_;  // comes last because it uses the other members
};

thread_local Worker* here = nullptr;  // is the worker of a GL thread

void Worker::serve() {
  here = this;
  for (;;) {
    std::function<void()> work;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
      if (queue_.empty()) break;
      work = std::move(queue_.front());
      queue_.pop_front();
    }
    work();
  }
  context_.reset();
}

struct Process {
  std::mutex mutex;
  std::shared_ptr<Worker> worker;
};

// This is never destroyed: a program may end without shutdown().
Process& process() {
  static Process& instance = *new Process;
  return instance;
}

std::shared_ptr<Worker> worker() {
  Process& p = process();
  const std::lock_guard lock(p.mutex);
  if (p.worker && !p.worker->is_of_this_process()) unavailable("the process was forked; start a new one instead");
  if (!p.worker) p.worker = std::make_shared<Worker>();
  return p.worker;
}

void run_with_context(const std::function<void(Context&)>& work) {
  if (here) return work(here->context());
  const std::shared_ptr<Worker> w = worker();
  std::promise<void> done;
  const bool accepted = w->submit([&] {
    try {
      work(w->context());
      done.set_value();
    } catch (...) {
      done.set_exception(std::current_exception());
    }
  });
  if (!accepted) unavailable("it was shut down meanwhile");
  done.get_future().get();
}

}  // namespace

void run(const std::function<void()>& work) {
  if (here) return work();
  run_with_context([&](Context& context) { context.run(work); });
}

void post(std::function<void()> work) noexcept {
  Process& p = process();
  const std::lock_guard lock(p.mutex);
  if (p.worker && p.worker->is_of_this_process()) p.worker->submit(std::move(work));
}

Renderer renderer() {
  Renderer result;
  run_with_context([&](Context& context) { result = context.renderer(); });
  return result;
}

void shutdown() noexcept {
  Process& p = process();
  std::shared_ptr<Worker> last;
  {
    const std::lock_guard lock(p.mutex);
    if (!p.worker || !p.worker->is_of_this_process()) return;
    last = std::move(p.worker);
  }
  last->stop();
}

unsigned generation() { return here ? here->generation() : 0; }

}  // namespace tolvol::gl
