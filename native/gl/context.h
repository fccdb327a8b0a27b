// SPDX-License-Identifier: GPL-3.0-or-later
/// The process's one GL context, surfaceless, and the one thread that owns it. Inside Blender the main thread has a
/// context of its own that no other may share, so all GL work is handed to this thread; it is started on first use.
#pragma once

#include <functional>
#include <string>

namespace tolvol::gl {

struct Renderer {
  std::string vendor, renderer, version;
  std::string name() const { return renderer + ", GL " + version + " (" + vendor + ")"; }
};

/// Runs `work` on the GL thread and waits for it. An exception of `work` is thrown here. On the GL thread it runs at
/// once. Never call this while holding a lock that the work needs, nor while holding Python's GIL. Throws GlUnavailable
/// if there is no EGL, libGL or GL 4.5, if a call in `work` was a GL error, or if the context was lost. Nothing that
/// `work` computed may be used then.
void run(const std::function<void()>& work);

/// Hands `work` to the GL thread and returns at once, for destructors. The work is dropped if there is no context any
/// more.
void post(std::function<void()> work) noexcept;

/// The renderer. Throws GlUnavailable like run().
Renderer renderer();

/// Ends the thread and its context. Using an object that was made in it then throws. A later run() starts anew. A
/// program should call this before it ends. Otherwise the thread may delete objects while the program ends, when some
/// drivers have already destroyed the context.
void shutdown() noexcept;

/// Returns the number of the current context, counted from 1. Must be called on the GL thread. Objects remember it,
/// because names of a context that is gone may belong to other objects in the next context.
unsigned generation();

}  // namespace tolvol::gl
