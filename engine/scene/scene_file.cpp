#include "engine/scene/scene_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "engine/assembly.hpp"
#include "engine/effects/stiff_contact.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/scene/scene_couplings.hpp"
#include "engine/scene/scene_effects.hpp"
#include "engine/scene/scene_start.hpp"
#include "engine/scene/scene_world.hpp"
#include "engine/scene/scene_yaml.hpp"
#include "engine/start_check.hpp"
#include "layout/smooth_curve.hpp"
#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"
#include "models/build/generators.hpp"
#include "models/build/merged_models.hpp"

namespace linden {
namespace {

using Kind = SceneValue::Kind;

const std::vector<std::string> kScene{"model", "models",    "base", "step",           "duration",   "solver",  "order",
                                      "guess", "tolerance", "stop", "max_iterations", "max_splits", "initial", "start",  "effects",
                                      "inertia", "randomize", "couplings", "assemble", "world", "accuracy"};
const std::vector<std::string> kModel{"model",    "base",       "name",     "parent", "position",
                                      "rotation", "quaternion", "velocity", "angular_velocity", "inertia"};
const std::vector<std::string> kBases{"fixed", "floating"};
const std::vector<std::string> kInertia{"density"};
const std::vector<std::string> kYesNo{"true", "false"};
const std::vector<std::string> kStarts{"checked", "as given"};
/// Of a model that needs contact.
constexpr const char* kGeneratedScene = R"(duration: 5
effects: {gravity: [0, 0, -9.81], contact: {friction: 0.6}}
)";
constexpr const char* kAModel = "a URDF file, or a generated model such as chain:3";

/// A model of the list `models`.
struct Entrant {
  SceneValue at;
  PlacedModel placed;
  BaseStart base;
};

class SceneReader {
 public:
  /// model: given already, beside what the values say.
  SceneReader(const SceneYaml& yaml, const SceneStart& given, std::optional<Model> model = std::nullopt)
      : root_(yaml.root()), given_(given), file_(yaml.file()), folder_(std::filesystem::path(file_).parent_path().string()),
        model_(std::move(model)) {}

  Scene read() {
    root_.entries_of(kScene, effect_keys(), "effects");
    read_model();
    if (const auto world = root_.find("world")) scene_.model = read_world(*world, std::move(scene_.model), folder_);
    if (const auto couplings = root_.find("couplings")) {
      SceneCouplings coupled = read_couplings(*couplings, std::move(scene_.model));
      scene_.model = std::move(coupled.model);
      cable_ends_ = std::move(coupled.ends);
    }
    read_options();
    const auto initial = root_.find("initial"), effects = root_.find("effects");
    if (const auto rule = root_.find("start")) scene_.start_as_given = rule->choice(kStarts) == "as given";
    Effects limited;
    if (effects) {
      limited.limits = read_limits(*effects, scene_.model);
      refuse_second_ends(*effects, limited.limits);
    }
    if (initial) refuse_lengths(*initial);
    scene_.initial = read_start(initial, scene_.model, bases_, given_, limited.limits);
    close_couplings(initial);
    fit_cables();
    limited.limits.insert(limited.limits.end(), cable_ends_.limits.begin(), cable_ends_.limits.end());
    require_finite(initial.value_or(root_), "position", scene_.initial.positions, scene_.model.names.position);
    require_finite(initial.value_or(root_), "velocity", scene_.initial.velocities, scene_.model.names.velocity);
    if (!scene_.start_as_given && !limited.limits.empty()) move_onto_limits(limited, initial ? initial->place() : file_);
    scene_.options.gravity = {};
    scene_.gravity_named = effects && effects->find("gravity");
    if (effects) {
      SceneEffects read = read_effects(*effects, scene_.model, scene_.initial.positions, folder_);
      scene_.effects = std::move(read.effects);
      scene_.options.gravity = read.gravity;
      if (initial) refuse_given(*initial);
      begin_motions();
      std::ranges::move(read.warnings, std::back_inserter(scene_.model.warnings));
      if (const auto ground = effects->find("ground")) warn_of_stiff_ground(*ground);
    }
    warn_of_shapes_untouched();
    add_cable_ends();
    scene_.seed = read_seed(initial, given_).value_or(kDefaultSeed);
    if (const auto randomize = root_.find("randomize")) read_randomize(*randomize);
    return std::move(scene_);
  }

 private:
  /// A length that is less than the links are apart because of the digits it was written with is theirs.
  void fit_cables() {
    constexpr double kRounding = 1e-9;
    for (const Coupling& coupling : scene_.model.couplings) {
      if (coupling.kind != CouplingKind::cable) continue;
      const GearTerm& term = coupling.terms.front();
      const double length = scene_.initial.positions[static_cast<std::size_t>(term.q_row)];
      for (JointLimit& end : cable_ends_.limits) {
        if (end.row != term.v_row || !(length > end.upper) || length - end.upper > kWrittenDigits * length) continue;
        if (length - end.upper > kRounding * length) {
          scene_.model.warnings.push_back(fmt::format("{}: cable {} starts {:.2g} m longer than its length; that is taken to be {:.10g} m", file_,
                                                      quoted(coupling.name), length - end.upper, length));
        }
        end.upper = length;
      }
    }
  }
  void refuse_second_ends(const SceneValue& effects, const std::vector<JointLimit>& limits) const {
    for (const JointLimit& end : cable_ends_.limits) {
      if (std::ranges::find(limits, end.row, &JointLimit::row) == limits.end()) continue;
      effects.fail(fmt::format("effects.limits names {}, a cable that has a length", quoted(scene_.model.names.velocity[static_cast<std::size_t>(end.row)])),
                   "one of both", "write joint: beside the cable and leave its length out, or leave out its limits");
    }
  }
  /// Where cables are taut, beside the effects that the scene names.
  void add_cable_ends() {
    const auto add = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    add(scene_.effects.limits, cable_ends_.limits);
    add(scene_.effects.dead_zone_springs, cable_ends_.dead_zone_springs);
  }
  /// Joints whose motion is given start where that does, as fast as it does.
  void begin_motions() {
    const Tree& tree = scene_.model.tree;
    for (const JointMotion& motion : scene_.effects.motions) {
      const SmoothCurve curve(motion.position, motion.velocities);
      for (Index i = 1; i < tree.shape.slots; ++i) {
        if (tree.first_v(i) != motion.row) continue;
        scene_.initial.positions[static_cast<std::size_t>(tree.first_q(i))] = curve.at(0);
        scene_.initial.velocities[static_cast<std::size_t>(motion.row)] = curve.slope(0);
      }
    }
  }
  void refuse_given(const SceneValue& initial) const {
    each_started(initial, [&](const SceneValue::Entry& entry) {
      const Index row = row_of(scene_.model, entry.key);
      if (std::ranges::find(scene_.effects.motions, row, &JointMotion::row) == scene_.effects.motions.end()) return;
      entry.value.fail(fmt::format("the motion of joint {} is given", quoted(entry.key)), "a joint that moves by itself",
                       "leave it out: it starts where effects.motion does");
    });
  }
  void refuse_lengths(const SceneValue& initial) const {
    for (const Coupling& coupling : scene_.model.couplings) {
      if (coupling.kind != CouplingKind::cable) continue;
      each_started(initial, [&](const SceneValue::Entry& entry) {
        const auto joint = scene_.model.names.slot_of_joint.find(entry.key);
        if (joint == scene_.model.names.slot_of_joint.end() || scene_.model.tree.first_v(joint->second) != coupling.terms.front().v_row) return;
        entry.value.fail(fmt::format("{} is the length of a cable", quoted(entry.key)), "a joint that may be anywhere",
                         "leave it out: it follows from where the links are");
      });
    }
  }
  /// visit(entry) of joints that are given a position or a velocity.
  template <class Visit>
  static void each_started(const SceneValue& initial, const Visit& visit) {
    for (const char* key : {"positions", "velocities"}) {
      const auto values = initial.find(key);
      if (!values || values->is(Kind::nothing)) continue;
      for (const SceneValue::Entry& entry : values->entries("a map of joints")) visit(entry);
    }
  }

  /// Loops are closed before the motion begins; a start that leaves them open by more than what people round off has to ask for it.
  void close_couplings(const std::optional<SceneValue>& initial) {
    const auto asked = root_.find("assemble");
    const bool assemble = asked && asked->choice(kYesNo) == "true";
    if (scene_.model.couplings.empty()) {
      if (asked) asked->fail("there is nothing to assemble", "couplings", "leave it out");
      return;
    }
    if (scene_.start_as_given) return;
    const Assembly open = linden::assemble(scene_.model, scene_.initial.positions, assemble ? Assembled::from_anywhere : Assembled::if_nearly_closed);
    if (open.closed) return;
    const SceneValue at = initial.value_or(root_);
    if (assemble) {
      at.fail(fmt::format("coupling {} cannot be closed: {:.3g} is the least that it is open by", quoted(open.coupling), open.gap),
              "a mechanism that can be put together", "look at its frames and lengths, or start nearer to where it closes");
    }
    at.fail(fmt::format("coupling {} is open by {:.3g} at the start, {:.2g} of the size of its mechanism", quoted(open.coupling), open.gap, open.relative),
            "positions that close it", "change them, or write assemble: true");
  }

  /// What rounding puts outside limits is moved, and told. What cannot be a start is refused by those who begin there.
  void move_onto_limits(const Effects& limited, const std::string& place) {
    StartFindings found = StartCheck(scene_.model, scene_.options, limited).look(scene_.initial.positions);
    if (found.moved.empty()) return;
    scene_.initial.positions = std::move(found.positions);
    for (const std::string& moved : found.moved) scene_.model.warnings.push_back(fmt::format("{}: {}", place, moved));
  }

  void read_randomize(const SceneValue& at) {
    constexpr const char* kRange = "a number, or a pair [low, high]";
    for (const auto& [key, value] : at.entries_of(randomized_names())) {
      const std::vector<double> numbers = value.is(Kind::list) ? value.numbers(2, kRange) : std::vector{value.number(kRange)};
      value.located([&, &name = key] { set_range(scene_.randomization, name, numbers, scene_.effects); });
    }
  }

  void warn_of_stiff_ground(const SceneValue& at) {
    const std::optional<StiffContact> stiff = stiffest_unresolved(scene_.model, scene_.options, scene_.effects);
    if (!stiff) return;
    const double h = scene_.options.step, stiffness = scene_.effects.ground->stiffness;
    scene_.model.warnings.push_back(fmt::format(
        "{}: a step of {:g} s does not resolve a stiffness of {:.3g} N/m under the {:.3g} kg of link {}: what bounces there loses energy; elastic "
        "bounces need a step below {:.3g} s or a stiffness below {:.3g} N/m",
        at.place(), h, stiffness, stiff->mass, quoted(stiff->link), std::sqrt(stiff->mass / stiffness), stiff->mass / (h * h)));
  }

  /// Shapes of the scene's world that nothing can touch.
  void warn_of_shapes_untouched() {
    const auto world = root_.find("world");
    if (!world || scene_.effects.contact || world->list("shapes").empty()) return;
    scene_.model.warnings.push_back(fmt::format("{}: nothing touches these shapes: bodies touch by the effect contact, which is not there (effects: "
                                                "{{contact: {{}}}})", world->place()));
  }

  void read_model() {
    if (model_) {
      for (const std::string_view key : {"model", "models", "base", "inertia"}) {
        const auto there = root_.find(key);
        if (there) there->fail(fmt::format("{} is here, beside a model that was given", key), "one of them", "leave it out");
      }
      scene_.model = *std::move(model_);
      return;
    }
    const auto one = root_.find("model"), several = root_.find("models"), base = root_.find("base"), inertia = root_.find("inertia");
    if (one && several) several->fail("model and models are both given", "one of them", "move the model into the list models");
    if (!one && !several)
      root_.fail("the scene has no model", "model: and a URDF file, or a generated one such as chain:3", "add it");
    if (one) {
      scene_.model = load(*one, base, inertia);
      return;
    }
    if (base) base->fail("base stands beside models", "base beside each model of the list", "move it there");
    if (inertia) inertia->fail("inertia stands beside models", "inertia beside each model of the list", "move it there");
    read_models(*several);
  }

  /// What is finite number by number may come to more: by a large spread, a turned frame, a leader's position times a multiplier.
  static void require_finite(const SceneValue& at, const char* what, const std::vector<double>& values,
                             const std::vector<std::string>& names) {
    for (std::size_t row = 0; row < values.size(); ++row) {
      if (std::isfinite(values[row])) continue;
      at.fail(fmt::format("the {} {} is {} at the start", what, quoted(names[row]), values[row]), "finite numbers",
              "choose smaller ones, or a smaller spread");
    }
  }

  /// Of links without inertia [kg/m^3]; the command line goes over the scene.
  std::optional<double> density_of(const std::optional<SceneValue>& inertia) const {
    std::optional<double> density;
    if (inertia) {
      inertia->entries_of(kInertia);
      const auto value = inertia->find("density");
      if (!value) inertia->refuse("{density: number} in kg/m^3, such as 1000", "write one, or leave it out");
      density = value->positive();
    }
    return given_.density ? given_.density : density;
  }

  Model load(const SceneValue& at, const std::optional<SceneValue>& base, const std::optional<SceneValue>& inertia,
             Still still = Still::refused) const {
    const std::string& name = at.text(kAModel);
    const std::optional<Base> root =
        base ? std::optional(base->choice(kBases) == "floating" ? Base::floating : Base::fixed) : std::nullopt;
    if (is_generated(name)) {
      if (base) base->fail(fmt::format("base, but {} is generated, base and all", name), "it beside a URDF file", "leave it out");
      if (inertia) inertia->fail(fmt::format("inertia, but {} is generated, mass and all", name), "it beside a URDF file", "leave it out");
      return at.located([&] {
        check_memory(name);
        return generate(name);
      });
    }
    if (is_scene(name)) at.refuse(kAModel, "a scene holds models, not scenes");
    const std::string file = (std::filesystem::path(folder_) / name).string();
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) {
      at.fail(fmt::format("{}: there is no file {}", at.path(), quoted(file)), "a URDF file, found relative to the scene",
              "check the path; a generated model is written chain:3");
    }
    return load_urdf(file, root.value_or(Base::fixed), Reading::lenient, density_of(inertia), still);
  }

  void read_models(const SceneValue& at) {
    std::vector<Entrant> entrants;
    const std::vector<SceneValue> items = at.list("models, {model: FILE.urdf, name: ..., position: [x, y, z]}");
    at.located([&] { require_memory("all of them", memory_of_generated(items)); });
    for (const SceneValue& item : items) {
      item.entries_of(kModel);
      const auto model = item.find("model");
      if (!model)
        item.fail(fmt::format("{} has no model", item.path()), "model: and a URDF file, or a generated one such as chain:3",
                  "add it");
      PlacedModel placed{load(*model, item.find("base"), item.find("inertia"), Still::furniture), ""};
      entrants.push_back({item, std::move(placed), read_base(item)});
      const auto name = item.find("name");
      if (name) entrants.back().placed.name = name->text("a name");
      if (const auto parent = item.find("parent")) entrants.back().placed.parent = parent->text("a link of another model, such as crane/hook");
    }
    if (entrants.empty()) at.refuse("a list of models", "add one");
    give_names(entrants);
    std::vector<PlacedModel> parts;
    for (Entrant& entrant : entrants) {
      place(entrant);
      parts.push_back(std::move(entrant.placed));
    }
    scene_.model = at.located([&] { return merged(parts, std::filesystem::path(file_).stem().string()); });
    if (scene_.model.tree.bodies() == 0) {
      at.fail("nothing moves: all models are rigid bodies, fixed to the world", "one that moves", "write base: floating beside one of them");
    }
    for (const Entrant& entrant : entrants) remember_bases(entrant, parts[static_cast<std::size_t>(&entrant - entrants.data())]);
  }

  /// Of all generated models together.
  static double memory_of_generated(const std::vector<SceneValue>& items) {
    double bytes = 0;
    for (const SceneValue& item : items) {
      const auto model = item.find("model");
      if (!model || !model->is(Kind::text)) continue;
      const std::string& name = model->text(kAModel);
      if (is_generated(name)) bytes += memory_of(name);
    }
    return bytes;
  }

  /// Several models need a name each: the one they are given, or their own. Shapes of the world are called world/NAME.
  static void give_names(std::vector<Entrant>& entrants) {
    for (const Entrant& entrant : entrants) {
      const std::string& called = entrant.placed.name.empty() && entrants.size() > 1 ? entrant.placed.model.names.model : entrant.placed.name;
      if (called == "world") entrant.at.fail("a model is called world", "another name: the world itself is called so", "write name: beside it");
    }
    if (entrants.size() == 1) return;
    std::unordered_set<std::string> seen;
    for (Entrant& entrant : entrants) {
      std::string& name = entrant.placed.name;
      if (name.empty()) name = entrant.placed.model.names.model;
      if (!seen.insert(name).second) {
        entrant.at.fail(fmt::format("two models are called {}", quoted(name)), "a name of its own for each",
                        "write name: beside them");
      }
    }
  }

  /// Where every root floats the pose is a start, not part of the model.
  static void place(Entrant& entrant) {
    const Model& model = entrant.placed.model;
    const std::size_t free = floating_roots(model).size();
    if (free == 0 && (entrant.base.velocity || entrant.base.angular_velocity)) {
      entrant.at.fail(fmt::format("{} has a velocity, but its base is fixed", entrant.at.path()), "a floating base",
                      "write base: floating, or leave it out");
    }
    if (free == 0 || free < model.tree.roots().size()) entrant.placed.pose = entrant.base.pose();
  }

  void remember_bases(const Entrant& entrant, const PlacedModel& part) {
    const bool moved = floating_roots(part.model).size() < part.model.tree.roots().size();
    for (const Index slot : floating_roots(part.model)) {
      const std::string& joint = part.model.names.joint[static_cast<std::size_t>(slot)];
      BaseStart start = entrant.base;
      if (moved) start.position.reset(), start.rotation.reset();
      bases_.push_back({part.name.empty() ? joint : part.name + "/" + joint, start});
    }
  }

  void read_options() {
    Options& options = scene_.options;
    bool tolerance = false;
    for (const auto& [key, value] : root_.entries("a scene")) {
      if (key == "step") read_step(value);
      if (key == "accuracy") {
        options.accuracy = value.positive();
        value.located([&] { check_accuracy(options); });
      }
      if (key == "duration") scene_.duration = value.positive();
      if (key == "tolerance") {
        options.tolerance = value.positive();
        tolerance = true;
      }
      if (key == "solver") options.solver = solver_from(value.choice(names_of({Solver::newton, Solver::riqn})));
      if (key == "guess") {
        options.guess =
            guess_from(value.choice(names_of({FirstGuess::extrapolation, FirstGuess::ig1, FirstGuess::ig2, FirstGuess::ig3})));
      }
      if (key == "stop") options.stop = stop_from(value.choice(names_of({StopTest::energy, StopTest::absolute})));
      if (key == "max_iterations") options.max_iterations = value.integer(0, 1'000'000);
      if (key == "max_splits") options.max_splits = value.integer(0, 20);
      if (key == "order") {
        options.order = value.integer(2, 8);
        if (options.order % 2 != 0) value.refuse("2, 4, 6 or 8", "odd orders do not exist");
      }
    }
    if (!tolerance) use_default_tolerance(options);
    options.vary = !options.accuracy || !root_.find("step") || root_.find("step")->says("auto");
    if (scene_.duration < options.step) {
      root_.fail(fmt::format("a duration of {} s is less than a step of {} s", scene_.duration, options.step), "one step or more",
                 "change one of them");
    }
  }

  /// With an accuracy it may be auto, which is what it is where it is not named.
  void read_step(const SceneValue& value) {
    if (!value.says("auto")) {
      scene_.options.step = value.positive();
    } else if (!root_.find("accuracy")) {
      value.fail("the step is auto, and no accuracy is named", "accuracy: 1e-6, or another, beside it", "steps are chosen for an accuracy");
    }
  }

  template <class Choice>
  static std::vector<std::string> names_of(std::initializer_list<Choice> choices) {
    std::vector<std::string> names;
    for (const Choice choice : choices) names.emplace_back(name(choice));
    return names;
  }

  SceneValue root_;
  SceneStart given_;
  std::string file_, folder_;
  std::optional<Model> model_;
  Scene scene_;
  std::vector<PlacedBase> bases_;
  Effects cable_ends_;
};

}  // namespace

bool is_scene(const std::string& file) { return file.ends_with(".yaml") || file.ends_with(".yml"); }

bool is_generated_scene(const std::string& name) { return needs_contact(name); }

Scene load_scene(const std::string& file, const SceneStart& given) {
  if (is_generated_scene(file)) {
    const SceneYaml yaml(kGeneratedScene, file);
    return SceneReader(yaml, given, load_model(file, std::nullopt, given.density)).read();
  }
  const FilesRead files;
  Scene scene = parse_scene(read_text(file, "a scene", SceneYaml::kMostBytes), file, given);
  scene.files = files.names();
  return scene;
}

Scene parse_scene(const std::string& text, const std::string& file, const SceneStart& given) {
  const SceneYaml yaml(text, file);
  return SceneReader(yaml, given).read();
}

Scene scene_of(std::shared_ptr<const YamlNode> values, std::optional<Model> model, const SceneStart& given) {
  const FilesRead files;
  const SceneYaml yaml(std::move(values));
  Scene scene = SceneReader(yaml, given, std::move(model)).read();
  scene.files = files.names();
  return scene;
}

}  // namespace linden
