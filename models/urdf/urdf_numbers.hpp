// models/urdf/urdf_numbers.hpp
// Numbers in the attributes of a URDF file's elements. What is no number throws InputError with the line it stands in;
// `owner` says in the message whose element it is: link "hand".
#pragma once

#include <tinyxml2.h>

#include <array>
#include <string>

#include "models/urdf/urdf_structure.hpp"

namespace linden {

class UrdfNumbers {
 public:
  explicit UrdfNumbers(const UrdfReport& report) : report_(report) {}

  /// The attribute, or InputError where there is none.
  const tinyxml2::XMLAttribute& attribute(const std::string& owner, const tinyxml2::XMLElement& element, const char* name) const;

  double one(const std::string& owner, const tinyxml2::XMLElement& element, const char* name) const;
  double one_or(double otherwise, const std::string& owner, const tinyxml2::XMLElement& element, const char* name) const;
  /// A number, or an infinity, as some tools write it.
  double one_or_infinity(const std::string& owner, const tinyxml2::XMLElement& element, const char* name) const;
  std::array<double, 3> three(const std::string& owner, const tinyxml2::XMLElement& element, const char* name) const;

  /// <origin> of an element, if it has one; a turn given as a quaternion is refused.
  const tinyxml2::XMLElement* origin(const std::string& owner, const tinyxml2::XMLElement& parent) const;

 private:
  const UrdfReport& report_;
};

}  // namespace linden
