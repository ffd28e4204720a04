// layout/effects/row_facts.hpp
// What the velocity rows of a model belong to.
#pragma once

#include <vector>

#include "layout/model.hpp"

namespace linden {

/// Kind of the joint that each velocity row belongs to, and the mimic that it follows by.
class RowFacts {
 public:
  explicit RowFacts(const Model& model)
      : kind_(static_cast<std::size_t>(model.tree.shape.velocities)), position_(kind_.size()), mimic_(kind_.size(), nullptr) {
    for (const Run& run : model.tree.runs) {
      for (Index i = run.begin; i < run.end; ++i) {
        for (Index k = 0; k < velocity_count(run.kind); ++k) {
          kind_[static_cast<std::size_t>(model.tree.first_v(i) + k)] = run.kind;
          position_[static_cast<std::size_t>(model.tree.first_v(i) + k)] = model.tree.first_q(i);
        }
      }
    }
    for (const Mimic& mimic : model.mimics) mimic_[static_cast<std::size_t>(mimic.follower_v)] = &mimic;
  }
  Index count() const { return static_cast<Index>(kind_.size()); }
  JointKind kind(Index row) const { return kind_[static_cast<std::size_t>(row)]; }
  Index first_position(Index row) const { return position_[static_cast<std::size_t>(row)]; }
  const Mimic* mimic(Index row) const { return mimic_[static_cast<std::size_t>(row)]; }

 private:
  std::vector<JointKind> kind_;
  std::vector<Index> position_;
  std::vector<const Mimic*> mimic_;
};

}  // namespace linden
