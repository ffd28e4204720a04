// engine/files/rollout_file.hpp
// The motion of one or many instances as a file that NumPy or h5py opens in one line:
//
//   data = numpy.load("FILE.npz")            data = h5py.File("FILE.h5")
//
//   time       [F]         s
//   energy     [F, N]      kinetic and potential together [J]
//   q          [F, N, nq]  positions, conventions as everywhere: quaternions x y z w
//   v          [F, N, nv]  velocities
//   status     [F, N]      uint8, see StepStatus; 0 = fine, else frozen at its last good state from this frame on
//   positions  [nq], velocities [nv]         names of the coordinates; in h5py text is data["positions"].asstr()[:]
//   statuses   [6]                           what the numbers of `status` mean
//
// Beside them there may be arrays [N, columns] or [N] of numbers that do not change, each with the names of its columns: what was drawn for
// every instance of a scene that is randomised.
//
//   mass_factors            [N, bodies]   bodies [bodies]
//   ground_friction         [N]
//   joint_friction_factors  [N, joints]   friction_joints [joints]
//   gain_factors            [N, servos]   servos [servos]
//
// In place of q and v and beside them there may be other arrays [F, N, rows], each with its names; an array that has units has names and
// units as attributes too in h5. A name that another array has is followed by _2. All are float32 where the batch is, else float64, which
// those that do not change always are. F frames of N instances are written one by one as they come; the file appears when it is committed,
// whole or not at all.
//
// FILE.csv is the same of one instance as a table: the columns time, energy, and those of the arrays; without the status.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/files/array_file.hpp"
#include "layout/names.hpp"

namespace linden {

/// Numbers of every instance and frame.
struct RecordedArray {
  std::string name;               // of the array
  std::string names;              // of the array with the names of its rows
  std::vector<std::string> rows;  // these
  std::string prefix;             // before them in a table
  std::string units{};            // of its numbers, where they are told
};

/// Numbers of every instance that stay as they are.
struct FixedArray {
  std::string name;
  std::string names;                 // of the array with the names of its columns; empty: it has no such axis
  std::vector<std::string> columns;  // these
  std::vector<double> numbers;       // [N x columns], or [N]
};

/// Arrays called as another one is, or as what every recording has, are followed by _2.
std::vector<RecordedArray> with_own_names(std::vector<RecordedArray> arrays, const std::vector<FixedArray>& fixed);
/// All that a recording consists of; names are different. The numbers of fixed arrays may be left out where the layout takes none.
template <class Real>
void declare(ArrayLayout& arrays, std::int64_t instances, const std::vector<RecordedArray>& recorded, const std::vector<FixedArray>& fixed);

RecordedArray recorded_positions(const Names& names);
RecordedArray recorded_velocities(const Names& names);

template <class Real>
class RolloutFile {
 public:
  /// FILE.npz, FILE.h5 or, of one instance, FILE.csv. Throws std::runtime_error, as add and commit do: `FILE: cannot be written: reason`.
  /// After that add throws again, and commit puts the frames before in place; nothing else is left in the folder.
  /// packers: threads that compress FILE.h5; 0: it is not compressed. No bit that is read back depends on it.
  RolloutFile(const std::string& file, std::int64_t instances, std::vector<RecordedArray> arrays, const std::vector<FixedArray>& fixed = {},
              int packers = 0);
  /// With q and v.
  RolloutFile(const std::string& file, const Names& names, std::int64_t instances)
      : RolloutFile(file, instances, {recorded_positions(names), recorded_velocities(names)}) {}
  /// What was not committed is deleted.
  ~RolloutFile();
  RolloutFile(const RolloutFile&) = delete;
  RolloutFile& operator=(const RolloutFile&) = delete;

  /// One frame: of every array [N][rows], instance by instance; energy [N], status [N]. Throws std::invalid_argument for other lengths.
  void add(double time, std::span<const std::span<const Real>> arrays, std::span<const Real> energy, std::span<const std::uint8_t> status);
  /// The same with q [N][nq] and v [N][nv].
  void add(double time, std::span<const Real> q, std::span<const Real> v, std::span<const Real> energy,
           std::span<const std::uint8_t> status) {
    const std::span<const Real> arrays[] = {q, v};
    add(time, arrays, energy, status);
  }
  /// Throws where there is no frame because the first one did not fit.
  void commit();

  /// That are kept.
  std::int64_t frames() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace linden
