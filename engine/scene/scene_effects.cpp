#include "engine/scene/scene_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "engine/scene/number_table.hpp"
#include "engine/text.hpp"
#include "layout/words.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;
using Kind = SceneValue::Kind;
using Entry = SceneValue::Entry;

const std::vector<std::string> kEffects{"gravity", "armature", "damping", "friction", "spring", "limits",
                                        "servo",   "torque",   "motion",  "wrench",   "drag",   "ground"};
const std::vector<std::string> kSpring{"stiffness", "rest"};
const std::vector<std::string> kLimit{"lower", "upper", "restitution", "velocity"};
const std::vector<std::string> kServo{"stiffness", "damping", "max_force", "targets", "velocities", "feedforward", "joints"};
const std::vector<std::string> kServoJoint{"stiffness", "damping", "target", "target_velocity", "feedforward", "max_force"};
const std::vector<std::string> kCourse{"times", "values"};
const std::vector<std::string> kWrench{"force", "moment", "point", "frame", "from", "to", "file"};
const std::vector<std::string> kFrames{"world", "body"};
const std::vector<std::string> kDrag{"linear", "quadratic", "wind", "bodies"};
const std::vector<std::string> kBodyDrag{"linear", "quadratic"};
const std::vector<std::string> kGround{"normal", "height", "stiffness", "damping", "friction", "terrain"};
const std::vector<std::string> kTerrain{"file", "spacing", "origin"};

constexpr std::string_view kVelocityLimit = "urdf or a number";
constexpr std::string_view kUrdfOrNumber = "urdf, a number or {joint: number}";

std::array<double, 3> array_of(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// A joint of the model that a scene names.
struct NamedJoint {
  Index slot, row, position;
  JointKind kind;
};

class Reader {
 public:
  Reader(const Model& model, const std::vector<double>& start, std::string folder)
      : model_(model),
        start_(start),
        folder_(std::move(folder)),
        slot_of_row_(static_cast<std::size_t>(model.tree.shape.velocities)) {
    for (const Run& run : model.tree.runs) {
      for (Index i = run.begin; i < run.end; ++i) {
        for (Index k = 0; k < velocity_count(run.kind); ++k) {
          slot_of_row_[static_cast<std::size_t>(model.tree.first_v(i) + k)] = {i, run.kind};
        }
      }
    }
    for (const Mimic& mimic : model.mimics) leader_of_[mimic.follower_slot] = mimic.leader_slot;
  }

  std::vector<JointLimit> read_limits(const SceneValue& at) {
    if (const auto value = at.find("limits")) limits(*value);
    return std::move(result_.effects.limits);
  }

  SceneEffects read(const SceneValue& at) {
    if (at.is(Kind::nothing)) return {};
    for (const auto& [key, value] : at.entries_of(kEffects)) {
      const std::vector<std::string>::size_type before = result_.warnings.size();
      if (key == "gravity") result_.gravity = value.vector("[x, y, z] in m/s^2");
      if (key == "armature") armature(value);
      if (key == "damping") damping(value);
      if (key == "friction") friction(value);
      if (key == "spring") spring(value);
      if (key == "limits") limits(value);
      if (key == "servo") servo(value);
      if (key == "torque") torque(value);
      if (key == "motion") motion(value);
      if (key == "wrench") wrench(value);
      if (key == "drag") drag(value);
      if (key == "ground") ground(value);
      for (std::size_t k = before; k < result_.warnings.size(); ++k) {
        result_.warnings[k] = fmt::format("{}: {}", value.place(), result_.warnings[k]);
      }
    }
    leave_to_motions(at);
    at.located([&] { check(result_.effects, model_); });
    return std::move(result_);
  }

 private:
  const std::string& joint_name(Index slot) const { return model_.names.joint[static_cast<std::size_t>(slot)]; }
  void warn(std::string message) { result_.warnings.push_back(std::move(message)); }

  NamedJoint joint(const Entry& entry) const { return joint(entry.value, entry.key); }
  NamedJoint joint(const SceneValue& at, const std::string& name) const {
    const Index row = at.located([&] { return row_of(model_, name); });
    const auto [slot, kind] = slot_of_row_[static_cast<std::size_t>(row)];
    if (kind == JointKind::free)
      at.fail(fmt::format("joint {} is a free joint", linden::quoted(name)), "a joint that turns or slides", "leave it out");
    return {slot, row, model_.tree.first_q(slot), kind};
  }
  NamedJoint screw(const SceneValue& at, const std::string& name) const {
    const NamedJoint found = joint(at, name);
    if (found.kind != JointKind::screw) {
      at.fail(fmt::format("joint {} is a ball joint", linden::quoted(name)), "a joint that turns or slides about one axis",
              "leave it out; ball joints have damping and spring");
    }
    return found;
  }
  NamedJoint screw(const Entry& entry) const { return screw(entry.value, entry.key); }
  void refuse_follower(const SceneValue& at, const NamedJoint& joint) const {
    const auto found = leader_of_.find(joint.slot);
    if (found == leader_of_.end()) return;
    at.fail(fmt::format("joint {} follows another", linden::quoted(joint_name(joint.slot))), "a joint that follows none",
            fmt::format("name its leader {}", linden::quoted(joint_name(found->second))));
  }

  LinkPlace body(const SceneValue& at, const std::string& link) const {
    const LinkPlace place = at.located([&] { return place_of(model_, link); });
    if (place.slot == 0)
      at.fail(fmt::format("link {} is fixed to the world", linden::quoted(link)), "a link that moves", "leave it out");
    return place;
  }

  std::string file_of(const SceneValue& at) const { return (std::filesystem::path(folder_) / at.text("a CSV file")).string(); }

  static double restitution_of(const SceneValue& at) {
    const double value = at.number();
    if (value < 0 || value > 1) at.refuse("a number from 0 to 1", "0 stops, 1 bounces back at the same speed");
    return value;
  }

  void armature(const SceneValue& at) {
    std::vector<Armature>& list = result_.effects.armature;
    if (at.says("urdf"))
      at.refuse("a number or {joint: number}", "URDF files say nothing of rotors: give a number, such as 0.01");
    if (at.is(Kind::text)) {
      list = armature_everywhere(model_, at.not_negative("a number or {joint: number}"));
    } else {
      for (const Entry& entry : at.entries("a number or {joint: number}"))
        list.push_back({screw(entry).row, entry.value.not_negative()});
      list = on_leaders(model_, list);
    }
    if (list.empty()) warn("no joint has any");
  }

  void damping(const SceneValue& at) {
    std::vector<JointDamping>& list = result_.effects.damping;
    if (at.says("urdf")) {
      list = urdf_damping(model_);
    } else if (at.is(Kind::text)) {
      list = damping_everywhere(model_, at.not_negative(kUrdfOrNumber));
    } else {
      for (const Entry& entry : at.entries(kUrdfOrNumber)) {
        const NamedJoint found = joint(entry);
        const double coefficient = entry.value.not_negative();
        for (Index k = 0; k < velocity_count(found.kind); ++k) list.push_back({found.row + k, coefficient});
      }
      list = on_leaders(model_, list);
    }
    if (list.empty()) warn("no joint has any");
  }

  void friction(const SceneValue& at) {
    std::vector<JointFriction>& list = result_.effects.friction;
    if (at.says("urdf")) {
      list = urdf_friction(model_);
    } else if (at.is(Kind::text)) {
      list = friction_everywhere(model_, at.not_negative(kUrdfOrNumber));
    } else {
      for (const Entry& entry : at.entries(kUrdfOrNumber)) list.push_back({screw(entry).row, entry.value.not_negative()});
      list = on_leaders(model_, list);
    }
    if (list.empty()) warn("no joint has any");
  }

  void spring(const SceneValue& at) {
    for (const Entry& entry : at.entries("{joint: {stiffness, rest}}")) {
      const NamedJoint found = joint(entry);
      refuse_follower(entry.value, found);
      entry.value.entries_of(kSpring);
      const auto stiffness = entry.value.find("stiffness"), rest = entry.value.find("rest");
      if (!stiffness)
        entry.value.fail(entry.value.path() + " has no stiffness", "stiffness and, where it is not 0, rest", "add stiffness");
      if (found.kind == JointKind::screw) {
        result_.effects.springs.push_back({found.row, stiffness->not_negative(), rest ? rest->number() : 0});
      } else {
        BallSpring ball{found.slot, stiffness->not_negative()};
        if (rest) ball.rest = rest->quaternion();
        result_.effects.ball_springs.push_back(ball);
      }
    }
    if (result_.effects.springs.empty() && result_.effects.ball_springs.empty()) warn("no joint has any");
  }

  void limits(const SceneValue& at) {
    std::vector<JointLimit>& list = result_.effects.limits;
    SharedLimits shared;
    bool named = false;
    if (!at.says("urdf")) {
      const std::vector<Entry> entries =
          at.entries("urdf, {restitution: number, velocity: urdf or number} or {joint: {lower, upper, restitution, velocity}}");
      if (const auto value = at.find("restitution")) shared.restitution = restitution_of(*value);
      if (const auto value = at.find("velocity")) {
        shared.velocity_of_file = value->says("urdf");
        if (!shared.velocity_of_file) shared.velocity = value->not_negative(kVelocityLimit);
      }
      for (const Entry& entry : entries) {
        if (entry.key == "restitution" || entry.key == "velocity") continue;
        named = true;
        list.push_back(limit(entry, shared));
      }
    }
    at.located([&] { list = named ? on_leaders(model_, list) : limits_everywhere(shared); });
    if (list.empty()) warn("no joint has any");
    const auto locked = std::ranges::find(list, 0.0, &JointLimit::velocity);
    if (locked == list.end()) return;
    warn(fmt::format("{} of {} joints cannot move ({}): their limit of velocity is 0", std::ranges::count(list, 0.0, &JointLimit::velocity),
                     list.size(), linden::quoted(model_.names.velocity[static_cast<std::size_t>(locked->row)])));
  }

  /// What stands beside the joints, for those that have no values of their own.
  struct SharedLimits {
    double restitution = 0;
    bool velocity_of_file = false;
    double velocity = std::numeric_limits<double>::infinity();
  };

  /// The file's, and a number for a velocity on every joint.
  std::vector<JointLimit> limits_everywhere(const SharedLimits& shared) const {
    std::vector<JointLimit> list = urdf_limits(model_, shared.restitution, shared.velocity_of_file);
    if (!std::isfinite(shared.velocity)) return list;
    for (JointLimit limit : velocity_limit_everywhere(model_, shared.velocity)) {
      limit.restitution = shared.restitution;
      list.push_back(limit);
    }
    return on_leaders(model_, list);
  }

  JointLimit limit(const Entry& entry, const SharedLimits& shared) const {
    const SceneValue& at = entry.value;
    const Index row = screw(entry).row;
    JointLimit result{row, model_.attributes.lower(row), model_.attributes.upper(row), shared.restitution};
    result.velocity = shared.velocity_of_file ? model_.attributes.max_velocity(row) : shared.velocity;
    if (!at.says("urdf")) {
      at.entries_of(kLimit);
      if (const auto value = at.find("lower")) result.lower = value->number();
      if (const auto value = at.find("upper")) result.upper = value->number();
      if (const auto value = at.find("restitution")) result.restitution = restitution_of(*value);
      if (const auto value = at.find("velocity")) {
        result.velocity = value->says("urdf") ? model_.attributes.max_velocity(row) : value->not_negative(kVelocityLimit);
        if (!std::isfinite(result.velocity))
          value->fail(fmt::format("the model's file limits no velocity of {}", linden::quoted(entry.key)), "a number", "write one");
      }
    }
    if (!std::isfinite(result.lower) && !std::isfinite(result.upper) && !std::isfinite(result.velocity)) {
      at.fail(fmt::format("{} has no limit and the model's file gives none", at.path()), "lower, upper, velocity or several of them",
              "add them, or leave the joint out");
    }
    if (result.lower > result.upper) {
      at.fail(fmt::format("{} goes from {} to {}", at.path(), result.lower, result.upper), "lower at or below upper",
              "exchange them");
    }
    return result;
  }

  /// Effort limit that `at` says, or else the model's file.
  double max_force(const std::optional<SceneValue>& at, Index row) const {
    if (!at || at->says("urdf")) return model_.attributes.max_effort(row);
    if (at->says("none")) return std::numeric_limits<double>::infinity();
    return at->not_negative("urdf, none or a number");
  }

  void servo(const SceneValue& at) {
    at.entries_of(kServo);
    const auto stiffness = at.find("stiffness"), damping = at.find("damping"), force = at.find("max_force"),
               joints = at.find("joints");
    const double shared_damping = damping ? damping->not_negative() : 0;
    std::map<Index, Servo> servos;
    const auto add = [&](const SceneValue& place, const NamedJoint& joint) {
      refuse_follower(place, joint);
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
        const NamedJoint named = screw(item, item.text("the name of a joint"));
        if (servos.count(named.row) > 0) item.refuse("every joint once", "leave one out");
        add(item, named);
      }
    }
    if (joints && !joints->is(Kind::list)) {
      constexpr std::string_view kExpected =
          "[joint, ...] or {joint: {stiffness, damping, target, target_velocity, feedforward, max_force}}";
      for (const Entry& entry : joints->entries(kExpected)) {
        entry.value.entries_of(kServoJoint);
        const NamedJoint named = screw(entry);
        if (!entry.value.find("stiffness")) require_stiffness(entry.value);
        add(entry.value, named);
        own_values(entry.value, servos.at(named.row));
      }
    }
    const auto over_joints = [&](const char* key, const char* own_key, const auto& put) {
      const auto map = at.find(key);
      if (!map) return;
      for (const Entry& entry : map->entries("{joint: number, FILE.csv or {times, values}}")) {
        const NamedJoint named = screw(entry);
        refuse_follower(entry.value, named);
        const auto found = servos.find(named.row);
        if (found == servos.end())
          entry.value.fail(fmt::format("joint {} has no servo", linden::quoted(entry.key)), "a joint that has one",
                           "add it to joints");
        if (joints && joints->is(Kind::map)) {
          if (const auto own = joints->find(entry.key); own && own->find(own_key))
            entry.value.refuse(fmt::format("one {} a joint", own_key), "leave one out");
        }
        put(found->second, course(entry.value));
      }
    };
    over_joints("targets", "target", set_target);
    over_joints("velocities", "target_velocity", [](Servo& servo, Course course) { servo.target_velocity = std::move(course); });
    over_joints("feedforward", "feedforward", [](Servo& servo, Course course) { servo.feedforward = std::move(course); });
    std::vector<std::string> dead;
    for (const auto& [row, servo] : servos) {
      if (servo.stiffness == 0 && servo.damping == 0 && is_zero(servo.feedforward)) continue;
      if (servo.max_force == 0) dead.push_back(model_.names.velocity[static_cast<std::size_t>(row)]);
      result_.effects.servos.push_back(servo);
    }
    if (result_.effects.servos.empty()) warn("no joint has any");
    if (!dead.empty()) {
      warn(fmt::format("{} of {} servos have no strength ({}): their effort limit is 0; max_force gives another", dead.size(),
                       result_.effects.servos.size(), linden::quoted(dead.front())));
    }
  }

  static bool is_zero(const Course& course) {
    return std::ranges::all_of(course.values, [](double value) { return value == 0; });
  }

  /// A table, or where it is one value, that.
  static void set_target(Servo& servo, Course course) {
    if (course.values.size() == 1) {
      servo.target = course.values.front();
    } else {
      servo.target_over_time = std::move(course);
    }
  }

  void own_values(const SceneValue& at, Servo& servo) const {
    if (const auto value = at.find("stiffness")) servo.stiffness = value->not_negative();
    if (const auto value = at.find("damping")) servo.damping = value->not_negative();
    if (const auto value = at.find("target")) set_target(servo, course(*value));
    if (const auto value = at.find("target_velocity")) servo.target_velocity = course(*value);
    if (const auto value = at.find("feedforward")) servo.feedforward = course(*value);
    if (const auto value = at.find("max_force")) servo.max_force = max_force(value, servo.row);
  }

  void torque(const SceneValue& at) {
    for (const Entry& entry : at.entries("{joint: number, FILE.csv or {times, values}}")) {
      const NamedJoint named = screw(entry);
      refuse_follower(entry.value, named);
      result_.effects.torques.push_back({named.row, course(entry.value)});
    }
    if (result_.effects.torques.empty()) warn("no joint has any");
  }

  void motion(const SceneValue& at) {
    for (const Entry& entry : at.entries("{joint: number, FILE.csv or {times, values}}")) {
      const NamedJoint named = screw(entry);
      refuse_follower(entry.value, named);
      const Course positions = course(entry.value);
      const auto twice = std::ranges::adjacent_find(positions.times);
      if (twice != positions.times.end())
        entry.value.fail(fmt::format("{} is at two places at {} s", entry.value.path(), *twice), "one position a time",
                         "leave one out; a servo can have a target that jumps");
      result_.effects.motions.push_back({named.row, positions});
    }
    if (result_.effects.motions.empty()) warn("no joint has any");
  }

  /// A joint whose motion is given feels neither friction nor limits; it is not to be led beyond them.
  void leave_to_motions(const SceneValue& at) {
    const auto moved = [&](const auto& entry) {
      return std::ranges::find(result_.effects.motions, entry.row, &JointMotion::row) != result_.effects.motions.end();
    };
    for (const JointLimit& limit : result_.effects.limits) {
      const auto found = std::ranges::find(result_.effects.motions, limit.row, &JointMotion::row);
      if (found == result_.effects.motions.end()) continue;
      for (std::size_t k = 0; k < found->position.values.size(); ++k) {
        const double value = found->position.values[k];
        if (value >= limit.lower && value <= limit.upper) continue;
        at.find("motion")->fail(fmt::format("effects.motion leads {} to {} at {} s, beyond its limits of {} to {}",
                            linden::quoted(model_.names.velocity[static_cast<std::size_t>(limit.row)]), value, found->position.times[k],
                            limit.lower, limit.upper),
                "positions within them", "change the table, or leave the joint out of limits");
      }
    }
    std::erase_if(result_.effects.limits, moved);
    if (const auto left_out = std::erase_if(result_.effects.friction, moved); left_out > 0) {
      warn(fmt::format("{}: left out where the motion is given ({}): what drives a joint overcomes it", at.find("friction")->place(),
                       counted(static_cast<std::int64_t>(left_out), "joint")));
    }
  }

  Course course(const SceneValue& at) const {
    if (at.is(Kind::text)) {
      const std::string& word = at.text("a number or FILE.csv");
      const std::optional<double> value = number_in(word);
      if (value) return {{0}, {at.number()}};
      if (!word.ends_with(".csv")) at.refuse("a number, FILE.csv or {times, values}", "write for example 0.5");
      return course_of_file(at);
    }
    at.entries_of(kCourse);
    const auto times = at.find("times"), values = at.find("values");
    if (!times || !values)
      at.fail(fmt::format("{} has no {}", at.path(), times ? "values" : "times"), "times and values", "add a list");
    Course result{times->numbers(), values->numbers()};
    if (result.times.empty() || result.times.size() != result.values.size()) {
      values->fail(fmt::format("{} has {} times and {} values", at.path(), result.times.size(), result.values.size()),
                   "one value a time, one or more", "add what is missing");
    }
    for (std::size_t k = 1; k < result.times.size(); ++k) {
      if (result.times[k] < result.times[k - 1]) {
        times->fail(fmt::format("time {} s comes after {} s", result.times[k], result.times[k - 1]), "times that ascend",
                    "sort them");
      }
    }
    return result;
  }

  Course course_of_file(const SceneValue& at) const {
    const std::string file = file_of(at);
    const NumberTable table = at.located([&] { return read_numbers(file, 2); });
    Course result{{}, {}};
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
      const double time = table.rows[k][0];
      if (k > 0 && time < result.times.back()) {
        at.fail(fmt::format("{}:{}: time {} s comes after {} s", file, table.lines[k], time, result.times.back()),
                "times that ascend", "sort its lines");
      }
      result.times.push_back(time);
      result.values.push_back(table.rows[k][1]);
    }
    return result;
  }

  void wrench(const SceneValue& at) {
    for (const Entry& entry : at.entries("{link: {force, moment, point, frame, from, to, file}}")) {
      const LinkPlace place = body(entry.value, entry.key);
      if (!entry.value.is(Kind::list)) {
        result_.effects.wrenches.push_back(wrench_on(place, entry.value));
        continue;
      }
      for (const SceneValue& item : entry.value.list("wrenches")) result_.effects.wrenches.push_back(wrench_on(place, item));
    }
    if (result_.effects.wrenches.empty()) warn("no body has any");
  }

  BodyWrench wrench_on(const LinkPlace& place, const SceneValue& at) const {
    at.entries_of(kWrench);
    const auto vector_at = [&](const char* key, const char* expected) {
      const auto value = at.find(key);
      return value ? vector_of(value->vector(expected)) : Vector3d(Vector3d::Zero());
    };
    if (!at.find("force") && !at.find("moment"))
      at.fail(at.path() + " has neither force nor moment", "one of them or both", "add force: [x, y, z]");
    BodyWrench result{.slot = place.slot};
    const Vector3d force = vector_at("force", "[x, y, z] in N"), moment = vector_at("moment", "[x, y, z] in N m");
    const Vector3d point = place.in_body * vector_at("point", "[x, y, z] in m");
    result.point = array_of(point);
    if (const auto frame = at.find("frame")) result.in_world = frame->choice(kFrames) == "world";
    result.force = array_of(result.in_world ? force : Vector3d(place.in_body.linear() * force));
    result.moment = array_of(result.in_world ? moment : Vector3d(place.in_body.linear() * moment));
    if (const auto value = at.find("from")) result.from = value->number();
    if (const auto value = at.find("to")) result.to = value->number();
    if (result.from > result.to)
      at.fail(fmt::format("{} goes from {} to {} s", at.path(), result.from, result.to), "from at or before to", "exchange them");
    if (const auto file = at.find("file")) result.scale = course_of_file(*file);
    return result;
  }

  void drag(const SceneValue& at) {
    at.entries_of(kDrag);
    const auto coefficients = [](const SceneValue& place, Drag drag) {
      if (const auto value = place.find("linear")) drag.linear = value->not_negative();
      if (const auto value = place.find("quadratic")) drag.quadratic = value->not_negative();
      return drag;
    };
    const auto has_mass = [&](Index slot) { return model_.constants.inertia(slot, 0) > 0; };
    std::map<Index, Drag> drags;
    if (at.find("linear") || at.find("quadratic")) {
      for (Index slot = 1; slot < model_.tree.shape.slots; ++slot) {
        if (has_mass(slot)) drags.emplace(slot, coefficients(at, Drag{slot}));
      }
    }
    if (const auto bodies = at.find("bodies")) {
      std::map<Index, std::string> named;
      for (const Entry& entry : bodies->entries("{link: {linear, quadratic}}")) {
        const Index slot = body(entry.value, entry.key).slot;
        entry.value.entries_of(kBodyDrag);
        if (!has_mass(slot))
          entry.value.fail(fmt::format("the body of link {} has no mass", linden::quoted(entry.key)), "one that drag can act on",
                           "leave it out");
        const auto [before, fresh] = named.emplace(slot, entry.key);
        if (!fresh) {
          entry.value.fail(fmt::format("links {} and {} are one body", linden::quoted(before->second), linden::quoted(entry.key)),
                           "every body once", "leave one out");
        }
        drags[slot] = coefficients(entry.value, Drag{slot});
      }
    }
    if (const auto wind = at.find("wind")) result_.effects.wind = wind->vector("[x, y, z] in m/s");
    for (const auto& [slot, drag] : drags) {
      if (drag.linear > 0 || drag.quadratic > 0) result_.effects.drag.push_back(drag);
    }
    if (result_.effects.drag.empty()) warn("no body has any: linear and quadratic are zero or not given");
  }

  void ground(const SceneValue& at) {
    Ground ground;
    if (!at.is(Kind::nothing)) {
      at.entries_of(kGround);
      if (const auto normal = at.find("normal")) {
        const Vector3d direction = vector_of(normal->vector("[x, y, z], which way is up"));
        const double length = direction.stableNorm();
        if (!(length > 0) || !std::isfinite(length))
          normal->fail("effects.ground.normal has no direction", "[x, y, z], which way is up", "write [0, 0, 1]");
        ground.normal = array_of(direction / length);
      }
      if (const auto value = at.find("height")) ground.height = value->number();
      if (const auto value = at.find("stiffness")) ground.stiffness = value->positive();
      if (const auto value = at.find("damping")) ground.damping = value->not_negative();
      if (const auto value = at.find("friction")) ground.friction = value->not_negative();
      if (const auto value = at.find("terrain")) ground.terrain = terrain(*value);
    }
    std::vector<std::string> notes;
    ground.contacts = contacts_of(model_, notes);
    if (ground.contacts.empty()) notes.push_back("no link that moves has a collision shape: nothing touches it");
    for (std::string& note : notes) warn(std::move(note));
    result_.effects.ground = std::move(ground);
  }

  HeightField terrain(const SceneValue& at) const {
    at.entries_of(kTerrain);
    const auto file = at.find("file"), spacing = at.find("spacing"), origin = at.find("origin");
    if (!file || !spacing)
      at.fail(fmt::format("{} has no {}", at.path(), file ? "spacing" : "file"), "file and spacing", "add it");
    const std::vector<double> apart = spacing->numbers(2, "[dx, dy] in m");
    if (!(apart[0] > 0) || !(apart[1] > 0))
      spacing->fail(fmt::format("{} holds {} and {}", spacing->path(), apart[0], apart[1]), "two numbers above zero",
                    "change them");
    const std::vector<double> begin = origin ? origin->numbers(2, "[x, y] in m") : std::vector<double>{0, 0};
    const std::string path = file_of(*file);
    const NumberTable table = file->located([&] { return read_numbers(path, 0, 2); });
    if (table.rows.size() < 2) file->fail(fmt::format("{} has one row", path), "two or more, each along x", "add heights");
    HeightField field{.columns = static_cast<Index>(table.rows.front().size()),
                      .rows = static_cast<Index>(table.rows.size()),
                      .spacing_x = apart[0],
                      .spacing_y = apart[1],
                      .origin_x = begin[0],
                      .origin_y = begin[1],
                      .heights = {}};
    for (const std::vector<double>& row : table.rows) field.heights.insert(field.heights.end(), row.begin(), row.end());
    return field;
  }

  const Model& model_;
  const std::vector<double>& start_;
  std::string folder_;
  std::vector<std::pair<Index, JointKind>> slot_of_row_;
  std::map<Index, Index> leader_of_;
  SceneEffects result_;
};

}  // namespace

const std::vector<std::string>& effect_keys() { return kEffects; }

std::vector<JointLimit> read_limits(const SceneValue& at, const Model& model) { return Reader(model, {}, "").read_limits(at); }

SceneEffects read_effects(const SceneValue& at, const Model& model, const std::vector<double>& start, const std::string& folder) {
  return Reader(model, start, folder).read(at);
}

}  // namespace linden
