// engine/files/array_readers.hpp
// One reader a format (engine/files/recorded_arrays.hpp).
#pragma once

#include "engine/files/recorded_arrays.hpp"

namespace linden {

RecordedArrays npz_arrays(const std::string& file);
RecordedArrays h5_arrays(const std::string& file);

/// Numbers that an array of this shape has. Throws InputError for a negative size and for more than memory holds.
std::size_t count_of(const std::string& file, const std::string& name, const std::vector<std::int64_t>& shape);

}  // namespace linden
