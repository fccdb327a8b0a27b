// SPDX-License-Identifier: GPL-3.0-or-later
/// For tests that need a context: skipped where there is none, unless TOLVOL_REQUIRE_GL is set.
#pragma once

#include <epoxy/egl.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "base/errors.h"
#include "gl/context.h"
#include "gl/objects.h"

inline void require_gl() {
  try {
    tolvol::gl::renderer();
  } catch (const tolvol::GlUnavailable& error) {
    if (std::getenv("TOLVOL_REQUIRE_GL")) FAIL() << error.what();
    GTEST_SKIP() << error.what();
  }
}

/// Ends the GL thread after the last test. Otherwise it could still delete objects while the driver is unloaded.
class EndGl : public testing::Environment {
 public:
  void TearDown() override { tolvol::gl::shutdown(); }
};
inline testing::Environment* const kEndGl = testing::AddGlobalTestEnvironment(new EndGl);

class GlTest : public testing::Test {
 protected:
  void SetUp() override { require_gl(); }
};
