// Where a model's couplings are felt and where they close: made once, of the tree alone.
//
// A coupling pushes its bodies, two or more; what the joints on the way between them, up to the nearest body that all hang on, see of that is
// its *path*. There it closes: what its path has yielded is all that body needs to know of it, and nothing above feels a loop that is closed
// below but as inertia. Loops that close at one body and share joints close together, as one *closure*. A path may lead past closures of
// others: there its impulses make those yield once more, as they do joints.
//
// Where joints are tied to each other (kernels/tree/mimic.hpp) a tree is solved with tied rows held, which belong to the whole of it. There all
// couplings close at the world, and a path goes on up to it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "layout/model.hpp"

namespace linden {

struct CouplingPath {
  /// A joint that is gone through, where its velocities are among the path's, and how it moves b against a: 1 on the way to b, -1 on the way
  /// to a, 0 above both; 1 on the way to any body of a cable. above: number of the joint of its parent among these, -1 where that is the body
  /// that all hang on.
  struct Joint {
    Index slot;
    Index at;
    double sign;
    Index above;
  };
  /// A body that is pushed: number of its joint, -1 of the body that all hang on; how it would move were it free, wrench -> twist.
  struct End {
    Index at;
    std::array<double, 36> yields;
  };
  /// A closure that is gone past, and where its rows are among the path's numbers.
  struct Passed {
    std::size_t closure;
    std::size_t at;
  };
  /// Numbers next to each other that are of the same joints or closures in the paths of two couplings.
  struct Shared {
    std::size_t at_first, at_second, count;
  };
  /// The other coupling, and what both paths share.
  struct Meeting {
    std::size_t path;
    std::vector<Shared> shared;
  };

  const Coupling* coupling;
  std::size_t first_row, last_row;    // of all rows of all couplings
  std::size_t room;                   // for a number of each row (kernels/couplings/row_lanes.hpp)
  std::size_t first_velocity;         // of what is kept for each velocity and row
  std::size_t first_number;           // of what is kept for each number and row
  std::vector<Joint> joints;          // leaves first; those that move b against a come first
  std::vector<Index> slots;           // of the joints
  std::vector<Index> velocity_rows;   // of each velocity, its row among the tree's
  std::vector<std::size_t> moving;    // velocities that move b against a
  std::vector<Passed> passed;         // in the order of a way up
  std::size_t velocities, on_path;    // of all joints; of those up to the last that moves b against a
  std::size_t numbers;                // velocities, and rows of closures that are passed
  std::vector<Meeting> meetings;      // not with contacts: with those of its closure, itself too, in their order, which a contact's does not have; then
                                      // with those of each closure that is passed
  std::size_t met_in_closure;         // how many of them are of its closure
  std::vector<std::size_t> terms;     // of a gear, or of a cable its length: where the velocity of each term is
  Index closes_at;                    // body, 0: the world
  std::size_t closure;                // number of the one it closes in
  std::size_t first_in_closure;       // its first row, among that one's
  double length;                      // [m] of the way from frame to frame, by which a gap is judged
  std::vector<End> ends;              // of a and b; of a cable of each of its bodies
  std::vector<std::size_t> points;    // of a cable: which of them each point is on
  double least_yield;                 // of a gear, how far it would move were its bodies free; of a cable, which may have no direction, the least of it

  std::size_t rows() const { return last_row - first_row; }
};

/// Couplings that close together.
struct Closure {
  Index slot;                      // of the body, 0: the world
  std::vector<std::size_t> paths;
  std::vector<std::size_t> rows;   // of all rows, path by path; those of contacts come last
  std::size_t lasting_rows = 0;    // that are no contact's

  bool touches() const { return lasting_rows < rows.size(); }
};

/// Where couplings close.
enum class Closing : std::uint8_t {
  nearest,   // at the nearest body that theirs hang on; at the world where joints are tied to each other
  at_world,  // to be compared with
};

class CouplingPaths {
 public:
  /// side_by_side: rows of a coupling in a register. contacts: further couplings, which close at the world; must outlive it.
  CouplingPaths(const Model& model, Closing closing, std::size_t side_by_side, std::span<const Coupling> contacts = {});
  // not inline: those that use it are compiled for one processor each
  ~CouplingPaths();
  CouplingPaths(const CouplingPaths&) = delete;
  CouplingPaths& operator=(const CouplingPaths&) = delete;

  bool empty() const { return paths_.empty(); }
  std::span<const CouplingPath> all() const { return paths_; }
  /// Leaves first: each after those that its paths pass.
  std::span<const Closure> closures() const { return closures_; }
  std::size_t rows() const { return empty() ? 0 : paths_.back().last_row; }
  /// That a row of all of them belongs to.
  const CouplingPath& path_of(std::size_t row) const;
  /// Of those that are no contacts: they come first.
  std::size_t lasting_rows() const { return lasting_rows_; }
  /// Whether a row of all of them does not give way.
  bool is_rigid(std::size_t row) const { return rigid_[row] != 0; }
  /// What is kept for each velocity of a path and row; for each number and row.
  std::size_t velocities() const { return velocities_; }
  std::size_t numbers() const { return numbers_; }
  /// Bodies on the way of any coupling to the world, and those from joints that are tied to each other; leaves first.
  std::span<const Index> reached() const { return reached_; }

 private:
  void add(const Model& model, const Coupling& coupling, bool at_world, std::size_t side_by_side);
  void close(const Model& model);

  std::vector<CouplingPath> paths_;
  std::vector<Closure> closures_;
  std::vector<Index> reached_;
  std::vector<char> rigid_;  // of each row
  std::size_t velocities_ = 0, numbers_ = 0, lasting_rows_ = 0;
};

}  // namespace linden
