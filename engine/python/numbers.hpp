// engine/python/numbers.hpp
// Arrays from Python and back. What comes in may be anything that NumPy makes an array of: lists, arrays of other types, tensors by DLPack;
// what is an array of the right type and order is not copied. What goes out is a NumPy array of its own memory, not writeable where writing
// into it would change nothing.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "engine/queries/matrix.hpp"

namespace linden::python {

namespace nb = nanobind;

/// Given out as an array that has its memory to itself and cannot be written into, also where it is a property, of which nanobind would
/// keep the object alive instead.
struct FixedArray {
  using Array = nb::ndarray<nb::numpy, const double>;
  Array array;
};

/// Numbers of an argument, row after row.
class Numbers {
 public:
  /// shape: what is expected; -1 stands for any count. Throws InputError that names the argument, with the shape expected and found.
  Numbers(nb::handle value, const char* argument, std::initializer_list<std::ptrdiff_t> shape);
  operator std::span<const double>() const { return {array_.data(), array_.size()}; }
  std::array<double, 3> three() const { return {array_.data()[0], array_.data()[1], array_.data()[2]}; }

 private:
  nb::ndarray<const double, nb::c_contig, nb::device::cpu> array_;
};

/// An array of the numbers, whose memory is its own.
template <class Number>
nb::ndarray<nb::numpy, const Number> owning_array(std::vector<Number> numbers, std::initializer_list<std::size_t> shape) {
  auto held = std::make_unique<std::vector<Number>>(std::move(numbers));
  const Number* const data = held->data();
  nb::capsule owner(held.get(), [](void* vector) noexcept { delete static_cast<std::vector<Number>*>(vector); });
  static_cast<void>(held.release());
  return {data, shape, owner};
}

/// The same of this shape, as all answers of one kind are given.
FixedArray fixed_array(std::vector<double> numbers, std::initializer_list<std::size_t> shape);
inline FixedArray fixed_array(std::vector<double> numbers) {
  const std::size_t count = numbers.size();
  return fixed_array(std::move(numbers), {count});
}
inline FixedArray fixed_array(std::span<const double> numbers) { return fixed_array(std::vector<double>(numbers.begin(), numbers.end())); }
inline FixedArray fixed_array(const Matrix& m) {
  return fixed_array(m.numbers, {static_cast<std::size_t>(m.rows), static_cast<std::size_t>(m.columns)});
}
/// Angular, then linear.
FixedArray fixed_array(const SpatialMotion& motion);
/// Moment, then force.
FixedArray fixed_array(const SpatialForce& wrench);

}  // namespace linden::python

template <>
struct nanobind::detail::type_caster<linden::python::FixedArray> {
  using Array = type_caster<linden::python::FixedArray::Array>;
  NB_TYPE_CASTER(linden::python::FixedArray, Array::Name)
  static handle from_cpp(const linden::python::FixedArray& value, rv_policy, cleanup_list* cleanup) noexcept {
    return Array::from_cpp(value.array, rv_policy::automatic, cleanup);
  }
};
