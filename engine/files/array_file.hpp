// engine/files/array_file.hpp
// Files of named arrays: arrays of numbers, which grow along their first axis a row at a time or stay as they are, and lists of words. They appear when they
// are committed, whole or not at all; memory does not grow with the rows. Equal content makes equal bytes: no time of day is in it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace linden {

enum class ElementType : std::uint8_t { float32, float64, uint8 };

/// What arrays there are. All functions throw std::runtime_error: `FILE: cannot be written: reason`.
class ArrayLayout {
 public:
  ArrayLayout() = default;
  virtual ~ArrayLayout() = default;
  ArrayLayout(const ArrayLayout&) = delete;
  ArrayLayout& operator=(const ArrayLayout&) = delete;

  /// An array [rows, row...] that has no rows yet. columns: what its numbers are called in a table; empty: they are in none.
  virtual void add_numbers(const std::string& name, ElementType type, std::vector<std::int64_t> row, std::vector<std::string> columns) = 0;
  /// Of the array of numbers added last: what the numbers of a row are called, and their units. Left out where the format has no place for it.
  virtual void describe(std::span<const std::string> /*names*/, const std::string& /*units*/) {}
  /// An array of so many doubles as the shape says, which is whole from the beginning; it is in no table.
  virtual void add_fixed(const std::string& name, std::vector<std::int64_t> shape, std::span<const double> numbers) = 0;
  /// An array [words]. Words are UTF-8.
  virtual void add_words(const std::string& name, std::span<const std::string> words) = 0;
};

/// After an error nothing but commit, which puts in place what was whole before, and the destructor may be called, after commit the
/// destructor alone. What was not committed is deleted.
class ArrayFile : public ArrayLayout {
 public:
  /// A row of every array of numbers, in the order in which they were added. Where the disk has no room for all of them, and for what
  /// commit needs, none is.
  virtual void append(std::span<const void* const> rows) = 0;
  virtual void commit() = 0;
  /// Rows that every array of numbers has; after commit, that are in place, also where it has failed.
  virtual std::int64_t rows() const = 0;
};

/// For numpy.load: a zip of .npy files, not compressed. The arrays are gathered in a file each and copied at the commit, which takes
/// twice the space; it is held from the beginning.
std::unique_ptr<ArrayFile> npz_file(const std::string& file);

/// A table: a line of names, then one a row, of all arrays that have names for their numbers. Words are left out.
std::unique_ptr<ArrayFile> csv_file(const std::string& file);

/// For h5py.File: HDF5, every array a dataset in chunks (engine/files/h5_chunks.hpp), written where it stays. Up to 16 MiB of rows of each
/// array wait in memory for their chunks to be full. packers: threads that compress them; 0: they stay as they are.
std::unique_ptr<ArrayFile> h5_file(const std::string& file, int packers);

}  // namespace linden
