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

/// Runs `work` on the GL thread and waits for it; what it throws is thrown here. Called on the GL thread it runs at
/// once. Never call it while holding a lock that the work needs, nor Python's GIL.
/// Throws GlUnavailable, and then nothing that `work` computed may be used, when there is no EGL, libGL or GL 4.5, when
/// a call in it was a GL error, or when the context was lost.
void run(const std::function<void()>& work);

/// Hands `work` to the GL thread and returns at once; for destructors. Dropped when there is no context any more.
void post(std::function<void()> work) noexcept;

/// What draws. Throws GlUnavailable like run().
Renderer renderer();

/// Ends the thread and its context; objects made in it become unusable and say so. A later run() starts anew.
void shutdown() noexcept;

/// Which context is current, counted from 1; on the GL thread alone. Objects remember it: names of a context that is
/// gone may be those of other objects in the next.
unsigned generation();

}  // namespace tolvol::gl
