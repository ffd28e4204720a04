#include "models/build/link_check.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "models/urdf/urdf.hpp"
#include "tests/layout/robots.hpp"

namespace linden::link_check_test {
using Catch::Matchers::StartsWith;
using Strings = std::vector<std::string>;

namespace {

/// A link with its centre of mass, and moments without products.
std::string solid(const std::string& name, const std::string& mass, const std::string& center, const std::string& moments) {
  return fmt::format(R"(<link name="{}"><inertial><origin xyz="{}"/><mass value="{}"/>)"
                     R"(<inertia {} ixy="0" ixz="0" iyz="0"/></inertial></link>)",
                     name, center, mass, moments);
}

}  // namespace

TEST_CASE("inertias are judged with all that is fixed to them, against mass times size squared") {
  const std::string negative = R"(ixx="-3e-8" iyy="4e-8" izz="5e-8")";
  const std::string antenna = solid("antenna", "1e-6", "0 0 0", negative);
  const std::string hinged = joint("j", "continuous", "a", "b");
  // part of a heavy arm, and alone
  const Strings fixed = told_of(robot("<link name=\"a\"/>" + link("b") + antenna + hinged + joint("f", "fixed", "b", "antenna")));
  REQUIRE(fixed.size() == 1);
  CHECK_THAT(fixed[0], StartsWith("link \"antenna\": its inertia is not positive definite"));
  const std::string alone = robot("<link name=\"a\"/>" + antenna + joint("j", "continuous", "a", "antenna"));
  CHECK_THAT(told_of(alone).front(),
             StartsWith("error: test.urdf: link \"antenna\": its inertia, with all that is fixed to it, is not positive"));
  // what rounding leaves of a zero, and a hundred times the slack
  const auto point = [&](const std::string& moments) {
    return told_of(robot("<link name=\"a\"/>" + solid("b", "0.5", "0 0 0.03", moments) + joint("j", "continuous", "a", "b")));
  };
  const Strings rounded = point(R"(ixx="-5e-20" iyy="-5e-20" izz="0")");
  REQUIRE(rounded.size() == 1);
  CHECK_THAT(rounded[0], StartsWith("link \"b\": its inertia is not positive definite"));
  CHECK_THAT(point(R"(ixx="-5e-8" iyy="-5e-8" izz="0")").front(), StartsWith("error: test.urdf: link \"b\": its inertia"));
}

TEST_CASE("a body far from its joint, and one of which nothing but its joints is far, are judged by their size") {
  // 1e-7 of mass times size squared is negative: where that is the size, and where it is a hundredth of it
  const auto told = [](const std::string& center, const std::string& more) {
    return told_of(robot("<link name=\"a\"/>" + solid("b", "1", center, R"(ixx="-1e-7" iyy="1e-3" izz="1e-3")") +
                         joint("j", "continuous", "a", "b", R"(<axis xyz="0 1 0"/>)") + more));
  };
  const std::string far = link("c") + joint("k", "continuous", "b", "c", R"(<origin xyz="1 0 0"/>)");
  CHECK_THAT(told("0 0 1", "").front(), StartsWith("link \"b\": its inertia is not positive definite"));
  CHECK_THAT(told("0 0 0", far).front(), StartsWith("link \"b\": its inertia is not positive definite"));
  CHECK_THAT(told("0 0 0.1", "").front(), StartsWith("error: test.urdf: link \"b\": its inertia, with all that is fixed to it"));
}

}  // namespace linden::link_check_test
