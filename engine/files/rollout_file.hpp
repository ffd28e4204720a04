// engine/files/rollout_file.hpp
// The motion of many instances as a file that NumPy or h5py opens in one line:
//
//   data = numpy.load("FILE.npz")            data = h5py.File("FILE.h5")
//
//   time       [F]         s
//   q          [F, N, nq]  positions, conventions as everywhere: quaternions x y z w
//   v          [F, N, nv]  velocities
//   energy     [F, N]      kinetic and potential together [J]
//   status     [F, N]      uint8, see StepStatus; 0 = fine, else frozen at its last good state from this frame on
//   positions  [nq], velocities [nv]         names of the coordinates; in h5py text is data["positions"].asstr()[:]
//   statuses   [5]                           what the numbers of `status` mean
//
// q, v and energy are float32 where the batch is, else float64. F frames of N instances are written one by one as they come; the file
// appears when it is committed, whole or not at all.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "layout/names.hpp"

namespace linden {

template <class Real>
class RolloutFile {
 public:
  /// FILE.npz or FILE.h5. Throws std::runtime_error, as add and commit do: `FILE: cannot be written: reason`. After that add throws again,
  /// and commit puts the frames before in place; nothing else is left in the folder.
  RolloutFile(const std::string& file, const Names& names, std::int64_t instances);
  /// What was not committed is deleted.
  ~RolloutFile();
  RolloutFile(const RolloutFile&) = delete;
  RolloutFile& operator=(const RolloutFile&) = delete;

  /// One frame: q [N][nq], v [N][nv], energy [N], status [N], instance by instance. Throws std::invalid_argument for other lengths.
  void add(double time, std::span<const Real> q, std::span<const Real> v, std::span<const Real> energy,
           std::span<const std::uint8_t> status);
  /// Throws where there is no frame because the first one did not fit.
  void commit();

  /// That are kept.
  std::int64_t frames() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace linden
