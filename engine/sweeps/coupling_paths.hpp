// Which joints a model's couplings are felt at: made once, of the tree alone.
//
// A coupling pushes its two bodies; what the joints on the way between them, up to the body that both hang on, see of that is its *path*. What
// is left of it when those joints have yielded goes on from there to the world: the *reach* of a coupling is its path and all joints above it,
// leaves first. Two couplings feel each other where their reaches meet.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "layout/model.hpp"

namespace linden {

struct CouplingPath {
  /// A joint of the reach, where its velocities are among the reach's, and how it moves b against a: 1 on the way to b, -1 on the way to a,
  /// 0 above both.
  struct Joint {
    Index slot;
    Index at;
    double sign;
  };
  const Coupling* coupling;
  std::size_t first_row, last_row;    // of all rows of all couplings
  std::size_t first_number;           // of what is kept for each row and velocity of the reach
  std::vector<Joint> reach;           // leaves first; those of the path come first
  std::size_t velocities, on_path;    // of the reach; of the path
  std::vector<std::size_t> terms;     // of a gear: where the velocity of each term is among the reach's
  double length;                      // [m] of the way from frame to frame, by which a gap is judged
  std::array<double, 36> yield_a, yield_b;  // how the bodies would move were they free: wrench -> twist
  double gear_yield;                  // likewise, of a gear

  std::size_t rows() const { return last_row - first_row; }
};

class CouplingPaths {
 public:
  /// A joint in the reach of two couplings, and where its velocities are in the one and the other.
  struct Shared {
    Index slot;
    Index at_first, at_second;
  };

  explicit CouplingPaths(const Model& model);
  // not inline: those that use it are compiled for one processor each
  ~CouplingPaths();
  CouplingPaths(const CouplingPaths&) = delete;
  CouplingPaths& operator=(const CouplingPaths&) = delete;

  bool empty() const { return paths_.empty(); }
  std::span<const CouplingPath> all() const { return paths_; }
  std::size_t rows() const { return empty() ? 0 : paths_.back().last_row; }
  /// Whether a row of all of them does not give way.
  bool is_rigid(std::size_t row) const { return rigid_[row] != 0; }
  /// What is kept for each row and velocity of its reach.
  std::size_t numbers() const { return numbers_; }
  /// Bodies in the reach of any coupling, and those from joints that are tied to each other up to the world; leaves first.
  std::span<const Index> reached() const { return reached_; }
  /// Of couplings number `first` and `second`.
  std::span<const Shared> shared(std::size_t first, std::size_t second) const { return shared_[first * paths_.size() + second]; }

 private:
  std::vector<CouplingPath> paths_;
  std::vector<Index> reached_;
  std::vector<char> rigid_;  // of each row
  std::vector<std::vector<Shared>> shared_;
  std::size_t numbers_ = 0;
};

}  // namespace linden
