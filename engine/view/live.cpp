#include "engine/view/live.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>

#include "layout/support/input_error.hpp"

namespace linden {
namespace {

using LiveJson = nlohmann::json;

/// Numbers one behind the other, as they lie in memory.
class FrameBytes {
 public:
  template <class T>
  void add(T number) {
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  void add(std::span<const float> numbers) { bytes_.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()); }
  template <class T>
  void add_floats(const std::array<T, 3>& numbers) {
    for (const T number : numbers) add(static_cast<float>(number));
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

constexpr std::string_view kCommands = "run, pause, step, reset, speed, target, pull or release";

/// As it was written, short enough for a message.
std::string written(const LiveJson& value) { return value.dump(-1, ' ', true, LiveJson::error_handler_t::replace).substr(0, 60); }

/// One command with its members.
class LiveReader {
 public:
  explicit LiveReader(std::string_view text) : object_(LiveJson::parse(text, nullptr, false)) {
    if (!object_.is_object()) throw InputError(fmt::format("a command was {}; expected {{\"do\": ...}}", object_.is_discarded() ? "no JSON" : "no object"));
    const auto found = object_.find("do");
    if (found == object_.end() || !found->is_string()) throw InputError(fmt::format("a command does nothing; expected \"do\": {}", kCommands));
    name_ = found->get<std::string>();
  }

  const std::string& name() const { return name_; }

  void expect(std::initializer_list<std::string_view> members) const {
    for (const auto& [key, value] : object_.items()) {
      if (key != "do" && std::ranges::find(members, key) == members.end()) {
        throw InputError(fmt::format("the command {} has no {}; expected {}", name_, written(key),
                                     members.size() == 0 ? "nothing else" : fmt::format("{}", fmt::join(members, ", "))));
      }
    }
  }

  double number(const char* member, double least, double most) const {
    const LiveJson& value = at(member);
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number >= least && number <= most)) wrong(member, value, fmt::format("a number from {:g} to {:g}", least, most));
    return number;
  }

  std::int64_t whole(const char* member, std::int64_t least, std::int64_t most) const {
    const LiveJson& value = at(member);
    if (!value.is_number_integer() || (value.is_number_unsigned() && value.get<std::uint64_t>() > 1ULL << 62) || value.get<std::int64_t>() < least ||
        value.get<std::int64_t>() > most) {
      wrong(member, value, most < least ? "that there is one" : fmt::format("a whole number from {} to {}", least, most));
    }
    return value.get<std::int64_t>();
  }

  std::array<double, 3> place(const char* member) const {
    constexpr double kFarthest = 1e6;  // [m]
    const LiveJson& value = at(member);
    std::array<double, 3> place{};
    bool fine = value.is_array() && value.size() == 3;
    for (std::size_t k = 0; fine && k < 3; ++k) {
      fine = value[k].is_number() && std::abs(value[k].get<double>()) <= kFarthest;
      if (fine) place[k] = value[k].get<double>();
    }
    if (!fine) wrong(member, value, fmt::format("three numbers of metres up to {:g}", kFarthest));
    return place;
  }

 private:
  const LiveJson& at(const char* member) const {
    const auto found = object_.find(member);
    if (found == object_.end()) throw InputError(fmt::format("the command {} is without {}; expected it", name_, member));
    return *found;
  }
  [[noreturn]] void wrong(const char* member, const LiveJson& value, const std::string& expected) const {
    throw InputError(fmt::format("the command {} has {} {}; expected {}", name_, member, written(value), expected));
  }

  LiveJson object_;
  std::string name_;
};

}  // namespace

std::string live_frame(const Animation& animation, std::uint32_t episode, std::uint32_t steps, std::span<const DrawnPull> pulls) {
  const std::size_t frame = animation.frames() - 1;
  FrameBytes bytes;
  bytes.add(animation.times[frame]);
  bytes.add(episode);
  bytes.add(static_cast<std::uint32_t>(animation.forces[frame].size()));
  bytes.add(static_cast<std::uint32_t>(pulls.size()));
  bytes.add(steps);
  bytes.add(std::span<const float>(animation.poses).subspan(animation.pose_at(frame, 0, 0), animation.bodies.size() * 7));
  for (const Curve& curve : animation.curves) bytes.add(curve.values[frame]);
  for (const DrawnForce& force : animation.forces[frame]) {
    bytes.add(static_cast<float>(force.slot - 1));
    bytes.add_floats(force.place);
    bytes.add_floats(force.force);
  }
  for (const DrawnPull& pull : pulls) {
    bytes.add(static_cast<float>(pull.slot - 1));
    bytes.add_floats(pull.from);
    bytes.add_floats(pull.to);
  }
  return bytes.take();
}

LiveCommand live_command(std::string_view text, std::size_t bodies, std::size_t servos) {
  constexpr double kLargest = 1e9;  // [rad, m]
  using Do = LiveCommand::Do;
  const LiveReader read(text);
  const std::string& name = read.name();
  LiveCommand command;
  if (name == "run" || name == "pause" || name == "reset" || name == "release") {
    read.expect({});
    command.what = name == "run" ? Do::run : name == "pause" ? Do::pause : name == "reset" ? Do::reset : Do::release;
  } else if (name == "step") {
    read.expect({"steps"});
    command.what = Do::step;
    command.number = read.whole("steps", 1, 100'000);
  } else if (name == "speed") {
    read.expect({"factor"});
    command.what = Do::speed;
    command.value = read.number("factor", 1e-3, 1e3);
  } else if (name == "target") {
    read.expect({"servo", "value"});
    command.what = Do::target;
    command.number = read.whole("servo", 0, static_cast<std::int64_t>(servos) - 1);
    command.value = read.number("value", -kLargest, kLargest);
  } else if (name == "pull") {
    read.expect({"body", "point", "to"});
    command.what = Do::pull;
    command.number = read.whole("body", 0, static_cast<std::int64_t>(bodies) - 1);
    command.point = read.place("point");
    command.to = read.place("to");
  } else {
    throw InputError(fmt::format("the command {} is not known; expected {}", written(name), kCommands));
  }
  return command;
}

std::string live_error(std::string_view message) {
  return LiveJson{{"is", "error"}, {"message", message}}.dump(-1, ' ', true, LiveJson::error_handler_t::replace);
}

}  // namespace linden
