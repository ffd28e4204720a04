#include "engine/python/numbers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "layout/support/input_error.hpp"

namespace linden::python {
namespace {

std::string shape_text(std::initializer_list<std::ptrdiff_t> shape) {
  if (shape.size() == 0) return "one number";
  std::string text;
  for (const std::ptrdiff_t count : shape) text += fmt::format("{}{}", text.empty() ? "" : ", ", count < 0 ? "any" : std::to_string(count));
  return fmt::format("numbers of shape [{}]", text);
}

}  // namespace

Numbers::Numbers(nb::handle value, const char* argument, std::initializer_list<std::ptrdiff_t> shape) {
  if (!nb::try_cast(value, array_, false)) {
    static PyObject* const as_array = nb::object(nb::module_::import_("numpy").attr("ascontiguousarray")).release().ptr();
    try {
      array_ = nb::cast<decltype(array_)>(nb::handle(as_array)(value, "float64"));
    } catch (const nb::python_error& error) {
      if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_TypeError)) throw;
      throw InputError(fmt::format("{}: {} is given; expected {}; NumPy says: {}", argument, nb::type_name(value.type()).c_str(),
                                   shape_text(shape), nb::str(error.value()).c_str()));
    }
  }
  bool fits = array_.ndim() == shape.size();
  std::size_t axis = 0;
  for (const std::ptrdiff_t count : shape) {
    fits = fits && (count < 0 || array_.shape(axis) == static_cast<std::size_t>(count));
    ++axis;
  }
  // one number may come as an array of one
  if (fits || (shape.size() == 0 && array_.size() == 1)) return;
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < array_.ndim(); ++k) found.push_back(array_.shape(k));
  throw InputError(fmt::format("{}: numbers of shape [{}] are given; expected {}", argument, fmt::join(found, ", "), shape_text(shape)));
}

FixedArray fixed_array(std::vector<double> numbers, std::initializer_list<std::size_t> shape) {
  return {owning_array(std::move(numbers), shape)};
}

FixedArray fixed_array(const SpatialMotion& motion) {
  std::vector<double> numbers(motion.angular.begin(), motion.angular.end());
  numbers.insert(numbers.end(), motion.linear.begin(), motion.linear.end());
  return fixed_array(std::move(numbers));
}

FixedArray fixed_array(const SpatialForce& wrench) {
  std::vector<double> numbers(wrench.moment.begin(), wrench.moment.end());
  numbers.insert(numbers.end(), wrench.force.begin(), wrench.force.end());
  return fixed_array(std::move(numbers));
}

}  // namespace linden::python
