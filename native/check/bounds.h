// SPDX-License-Identifier: GPL-3.0-or-later
/// What the changes of a mesh must keep: whether the faces that a change leaves may take the place of those that there
/// are. The certificates of a decimation prove it; a RingCheck has another method decide.
#pragma once

#include <cstddef>
#include <memory>

namespace tolvol {

class ChangedFaces;

class Bounds {
 public:
  virtual ~Bounds() = default;

  /// Decides about one change after another, and holds all that this needs, so that a thread each can ask about
  /// different changes of one mesh.
  class Trial {
   public:
    virtual ~Trial() = default;
    /// Starts a series of questions around one place. What is answered depends on nothing before.
    virtual void begin() {}
    /// Whether the change, which is possible, keeps the bounds. Only reads.
    virtual bool accepts(const ChangedFaces& change) = 0;
    /// Notes that the change, which was accepted last, is about to be carried out. The mesh is still as it was then.
    virtual void commit(const ChangedFaces& change) = 0;
    /// How many parts of pieces the series of questions has looked at.
    virtual std::size_t looked_at() const { return 0; }
  };
  /// Makes a trial for one thread. The trial keeps a reference to the bounds.
  virtual std::unique_ptr<Trial> trial() = 0;
};

}  // namespace tolvol
