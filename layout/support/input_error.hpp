// layout/support/input_error.hpp
// Bad input: a file, a name or a number that cannot be used. The message says where, what was found, what was expected.
#pragma once

#include <stdexcept>

namespace linden {

class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace linden
