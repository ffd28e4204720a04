#include "engine/scene/scene_servos.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "engine/scene/scene_time_table.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

using Kind = SceneValue::Kind;
using Entry = SceneValue::Entry;

const std::vector<std::string> kServo{"stiffness", "damping", "max_force", "targets", "velocities", "feedforward", "joints"};
const std::vector<std::string> kServoJoint{"stiffness", "damping", "target", "target_velocity", "feedforward", "max_force"};

class ServoReader {
 public:
  ServoReader(const SceneJoints& joints, const std::vector<double>& start, const std::string& folder, std::vector<std::string>& warnings)
      : joints_(joints), model_(joints.model()), start_(start), folder_(folder), warnings_(warnings) {}

  std::vector<Servo> read(const SceneValue& at) {
    at.entries_of(kServo);
    const auto stiffness = at.find("stiffness"), damping = at.find("damping"), force = at.find("max_force"),
               joints = at.find("joints");
    const double shared_damping = damping ? damping->not_negative() : 0;
    std::map<Index, Servo> servos;
    const auto add = [&](const SceneValue& place, const NamedJoint& joint) {
      joints_.refuse_follower(place, joint);
      Servo servo{.row = joint.row, .stiffness = stiffness ? stiffness->not_negative() : 0, .damping = shared_damping};
      servo.target = start_[static_cast<std::size_t>(joint.position)];
      servo.max_force = max_force(force, joint.row);
      servos.emplace(joint.row, servo);
    };
    const auto require_stiffness = [&](const SceneValue& place) {
      if (!stiffness)
        place.fail(place.path() + " has no stiffness", "one for all its joints, or one a joint", "add stiffness: number");
    };
    if (!joints || (joints->is(Kind::map) && stiffness)) {
      require_stiffness(at);
      for (const Servo& servo : servo_everywhere(model_, stiffness->not_negative(), shared_damping, start_)) {
        servos.emplace(servo.row, servo).first->second.max_force = max_force(force, servo.row);
      }
    } else if (joints->is(Kind::list)) {
      require_stiffness(at);
      for (const SceneValue& item : joints->list("joints")) {
        const NamedJoint named = joints_.screw(item, item.text("the name of a joint"));
        if (servos.count(named.row) > 0) item.refuse("every joint once", "leave one out");
        add(item, named);
      }
    }
    if (joints && !joints->is(Kind::list)) {
      constexpr std::string_view kExpected =
          "[joint, ...] or {joint: {stiffness, damping, target, target_velocity, feedforward, max_force}}";
      for (const Entry& entry : joints->entries(kExpected)) {
        entry.value.entries_of(kServoJoint);
        const NamedJoint named = joints_.screw(entry);
        if (!entry.value.find("stiffness")) require_stiffness(entry.value);
        add(entry.value, named);
        own_values(entry.value, servos.at(named.row));
      }
    }
    const auto over_joints = [&](const char* key, const char* own_key, const auto& put) {
      const auto map = at.find(key);
      if (!map) return;
      for (const Entry& entry : map->entries("{joint: number, FILE.csv or {times, values}}")) {
        const NamedJoint named = joints_.screw(entry);
        joints_.refuse_follower(entry.value, named);
        const auto found = servos.find(named.row);
        if (found == servos.end())
          entry.value.fail(fmt::format("joint {} has no servo", quoted(entry.key)), "a joint that has one",
                           "add it to joints");
        if (joints && joints->is(Kind::map)) {
          if (const auto own = joints->find(entry.key); own && own->find(own_key))
            entry.value.refuse(fmt::format("one {} a joint", own_key), "leave one out");
        }
        put(found->second, read_time_table(entry.value, folder_));
      }
    };
    over_joints("targets", "target", set_target);
    over_joints("velocities", "target_velocity", [](Servo& servo, TimeTable table) { servo.target_velocity = std::move(table); });
    over_joints("feedforward", "feedforward", [](Servo& servo, TimeTable table) { servo.feedforward = std::move(table); });
    std::vector<std::string> dead;
    for (const auto& [row, servo] : servos) {
      if (servo.stiffness == 0 && servo.damping == 0 && is_zero(servo.feedforward)) continue;
      if (servo.max_force == 0) dead.push_back(model_.names.velocity[static_cast<std::size_t>(row)]);
      result_.push_back(servo);
    }
    if (result_.empty()) warnings_.push_back("no joint has any");
    if (!dead.empty()) {
      warnings_.push_back(fmt::format("{} of {} servos have no strength ({}): their effort limit is 0; max_force gives another", dead.size(),
                       result_.size(), quoted(dead.front())));
    }
    return std::move(result_);
  }

 private:
  /// Effort limit that `at` says, or else the model's file.
  double max_force(const std::optional<SceneValue>& at, Index row) const {
    if (!at || at->says("urdf")) return model_.attributes.max_effort(row);
    if (at->says("none")) return std::numeric_limits<double>::infinity();
    return at->not_negative("urdf, none or a number");
  }

  static bool is_zero(const TimeTable& table) {
    return std::ranges::all_of(table.values, [](double value) { return value == 0; });
  }

  /// A table, or where it is one value, that.
  static void set_target(Servo& servo, TimeTable table) {
    if (table.values.size() == 1) {
      servo.target = table.values.front();
    } else {
      servo.target_over_time = std::move(table);
    }
  }

  void own_values(const SceneValue& at, Servo& servo) const {
    if (const auto value = at.find("stiffness")) servo.stiffness = value->not_negative();
    if (const auto value = at.find("damping")) servo.damping = value->not_negative();
    if (const auto value = at.find("target")) set_target(servo, read_time_table(*value, folder_));
    if (const auto value = at.find("target_velocity")) servo.target_velocity = read_time_table(*value, folder_);
    if (const auto value = at.find("feedforward")) servo.feedforward = read_time_table(*value, folder_);
    if (const auto value = at.find("max_force")) servo.max_force = max_force(value, servo.row);
  }

  const SceneJoints& joints_;
  const Model& model_;
  const std::vector<double>& start_;
  const std::string& folder_;
  std::vector<std::string>& warnings_;
  std::vector<Servo> result_;
};

}  // namespace

std::vector<Servo> read_servos(const SceneValue& at, const SceneJoints& joints, const std::vector<double>& start, const std::string& folder,
                               std::vector<std::string>& warnings) {
  return ServoReader(joints, start, folder, warnings).read(at);
}

}  // namespace linden
