// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/change_trial.h"

#include <cassert>

#include "decimation/certified_bounds.h"

namespace tolvol {

ChangeTrial::ChangeTrial(const BoundedMesh& mesh, Surroundings* around, Proof proof)
    : change_(mesh), around_(around), proof_(proof) {
  if (!mesh.bounds()) return;
  bounds_ = proof == Proof::later ? mesh.certified()->trial_on_trust() : mesh.bounds()->trial();
}

void ChangeTrial::begin() {
  prepared_ = met_another_ = false;
  if (bounds_) bounds_->begin();
  crossings_.crossings.begin();
}

bool ChangeTrial::prepare_collapse(Halfedge h, const VertexPosition& target) {
  prepared_ = true;
  return change_.prepare_collapse(h, target);
}

ChangeTrial::Outcome ChangeTrial::try_collapse(Halfedge h, const VertexPosition& target) {
  if (!change_.mesh().may_hold(target)) return Outcome::refused;
  if (around_ && !around_->may_put(target)) return Outcome::impossible;
  return prepare_collapse(h, target) ? check() : Outcome::impossible;
}

ChangeTrial::Outcome ChangeTrial::check() {
  if (change_.meets_another()) {
    met_another_ = true;
    return Outcome::refused;
  }
  const bool kept = !change_.folds_over() && (!bounds_ || bounds_->accepts(change_)) &&
                    (!around_ || proof_ == Proof::later || around_->allow(change_, crossings_));
  return kept ? Outcome::possible : Outcome::refused;
}

Box ChangeTrial::carry_out(BoundedMesh& mesh) {
  assert(&mesh == &change_.mesh());
  if (bounds_) bounds_->commit(change_);
  const Box changed = around_ && proof_ == Proof::now ? around_->follow(change_, crossings_) : Box();
  mesh.apply(change_);
  return changed;
}

}  // namespace tolvol
