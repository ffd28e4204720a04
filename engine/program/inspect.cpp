#include "engine/program/inspect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "engine/effects/effect_plan.hpp"
#include "engine/files/output_file.hpp"
#include "engine/files/report_files.hpp"
#include "engine/mass_distribution.hpp"
#include "engine/mobility.hpp"
#include "engine/program/contact_cost.hpp"
#include "engine/program/couplings_text.hpp"
#include "engine/program/effect_cost.hpp"
#include "engine/program/effects_text.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/standard_streams.hpp"
#include "engine/sweeps/schedule.hpp"
#include "engine/sweeps/sweep_cost.hpp"
#include "engine/text.hpp"
#include "engine/version.hpp"
#include "layout/state.hpp"
#include "layout/workspace.hpp"
#include "models/build/world_shapes.hpp"

namespace linden {
namespace {

using Json = nlohmann::ordered_json;
using Align = Table::Align;

constexpr Index kLongTable = 60, kShown = 20;
constexpr std::size_t kLineWidth = 120;

/// How the joint in `slot` moves.
std::string motion_of(const Model& model, Index slot, JointKind kind) {
  if (kind == JointKind::ball) return "ball";
  if (kind == JointKind::free) return "free";
  if (model.constants.screw(slot, 0) == 0) return "prismatic";
  return model.constants.screw(slot, 1) == 0 ? "revolute" : "helical";
}

std::string_view kind_name(JointKind kind) {
  return kind == JointKind::screw ? "screw" : kind == JointKind::ball ? "ball" : "free";
}

/// "7", "0-6"
std::string rows_text(Index first, Index count) {
  return count == 1 ? fmt::format("{}", first) : fmt::format("{}-{}", first, first + count - 1);
}

std::string limits_text(double lower, double upper, bool turns) {
  if (!std::isfinite(lower) && !std::isfinite(upper)) return "-";
  return fmt::format("{:.4g} to {:.4g} {}", lower, upper, turns ? "rad" : "m");
}

/// One body with all that is said of it.
struct BodyFacts {
  Index slot, parent;
  std::string body, parent_body, joint, motion;
  JointKind kind;
  Index first_q, first_v;
  double pitch, mass, lower, upper;
  std::array<double, 3> axis;  // of a screw, in the frame of the link that the parent body is called after
  bool massless;
  const Mimic* follows;  // null: it leads itself
};

/// Direction of a screw's axis in the frame of the link that its parent body is called after, which the joint does not turn. The massless bodies within planar joints have
/// no link: their own frame serves.
std::array<double, 3> axis_of(const Model& model, Index slot) {
  const auto& X = model.constants.tree_placement;
  std::array<double, 3> axis{X(slot, 2), X(slot, 5), X(slot, 8)};
  const Index parent = model.tree.parent(slot);
  const auto link = model.names.link.find(model.names.body[static_cast<std::size_t>(parent)]);
  if (parent != 0 && link != model.names.link.end()) axis = turned_back(link->second.in_body, axis);
  constexpr double kRounding = 1e-12;
  for (double& part : axis) {
    if (std::abs(part - std::round(part)) < kRounding) part = std::round(part) + 0.0;
  }
  return axis;
}

bool is_massless(const Model& model, Index slot) {
  for (int k = 0; k < 10; ++k) {
    if (model.constants.inertia(slot, k) != 0) return false;
  }
  return true;
}

std::vector<BodyFacts> bodies_of(const Model& model) {
  const Tree& tree = model.tree;
  const auto name = [](const std::vector<std::string>& names, Index slot) { return names[static_cast<std::size_t>(slot)]; };
  std::vector<const Mimic*> follows(static_cast<std::size_t>(tree.shape.slots), nullptr);
  for (const Mimic& mimic : model.mimics) follows[static_cast<std::size_t>(mimic.follower_slot)] = &mimic;
  std::vector<BodyFacts> bodies;
  for (const Run& run : tree.runs) {
    for (Index i = run.begin; i < run.end; ++i) {
      const Index v = tree.first_v(i);
      bodies.push_back({.slot = i,
                        .parent = tree.parent(i),
                        .body = name(model.names.body, i),
                        .parent_body = name(model.names.body, tree.parent(i)),
                        .joint = run.kind == JointKind::screw ? name(model.names.velocity, v) : name(model.names.joint, i),
                        .motion = motion_of(model, i, run.kind),
                        .kind = run.kind,
                        .first_q = tree.first_q(i),
                        .first_v = v,
                        .pitch = model.constants.screw(i, 1),
                        .mass = model.constants.inertia(i, 0),
                        .lower = model.attributes.lower(v),
                        .upper = model.attributes.upper(v),
                        .axis = axis_of(model, i),
                        .massless = is_massless(model, i),
                        .follows = follows[static_cast<std::size_t>(i)]});
    }
  }
  return bodies;
}

struct MergedLink {
  Index slot;
  std::string name;
};

/// Shapes that stand in the world, as they were added.
std::vector<const BodyShape*> world_shapes(const Model& model) {
  std::vector<const BodyShape*> shapes;
  for (const BodyShape& shape : model.welded.shapes) {
    if (stands_in_world(shape.link)) shapes.push_back(&shape);
  }
  return shapes;
}

/// "box 1 x 0.6 x 0.04 m", "sphere, radius 0.1 m", "mesh rock.stl"
std::string size_text(const BodyShape& placed) {
  const CollisionShape& shape = placed.shape;
  const std::array<double, 3>& size = shape.size;
  const std::array<double, 9>& turn = placed.pose.rotation;
  switch (shape.kind) {
    case ShapeKind::sphere: return fmt::format("sphere, radius {:g} m", size[0]);
    case ShapeKind::box: return fmt::format("box {:g} x {:g} x {:g} m", size[0], size[1], size[2]);
    case ShapeKind::cylinder: return fmt::format("cylinder, radius {:g} m, length {:g} m", size[0], size[1]);
    case ShapeKind::capsule: return fmt::format("capsule, radius {:g} m, length {:g} m", size[0], size[1]);
    case ShapeKind::ellipsoid: return fmt::format("ellipsoid, semi-axes {:g}, {:g} and {:g} m", size[0], size[1], size[2]);
    case ShapeKind::plane: return fmt::format("plane, normal {:g} {:g} {:g}", turn[2] + 0.0, turn[5] + 0.0, turn[8] + 0.0);
    case ShapeKind::heights:
      return fmt::format("heights, {} x {} points, {:g} and {:g} m apart", shape.heights->columns, shape.heights->rows, shape.heights->spacing_x,
                         shape.heights->spacing_y);
    case ShapeKind::mesh: break;
  }
  return fmt::format("mesh {}", printable(shape.mesh));
}

/// Links that have no body of their own, by slot and name.
std::vector<MergedLink> merged_links(const Model& model) {
  std::vector<MergedLink> merged;
  for (const auto& [name, place] : model.names.link) {
    if (place.slot == 0 && stands_in_world(name)) continue;
    if (place.slot == 0 || model.names.body[static_cast<std::size_t>(place.slot)] != name) merged.push_back({place.slot, name});
  }
  std::ranges::sort(merged, [](const MergedLink& a, const MergedLink& b) { return std::tie(a.slot, a.name) < std::tie(b.slot, b.name); });
  return merged;
}

std::map<std::string, Index> counts_of(const std::vector<BodyFacts>& bodies) {
  std::map<std::string, Index> counts;
  for (const BodyFacts& body : bodies) counts[body.motion] += 1;
  return counts;
}

Index widest_level(const Tree& tree) {
  std::vector<Index> bodies(static_cast<std::size_t>(tree.levels()), 0);
  for (Index i = 1; i < tree.shape.slots; ++i) bodies[static_cast<std::size_t>(tree.level(i))] += 1;
  return *std::ranges::max_element(bodies);
}

/// The sweeps of a step, and what all of it costs on this machine.
struct Costs {
  std::vector<Sweep> sweeps;
  std::vector<double> of_sweeps;    // [ns per body]
  std::vector<EffectCost> effects;  // of a scene
  std::optional<ContactCost> contact;  // of one that has it
};

/// Where the scene begins, or in the zero configuration.
Mobility mobility_at_start(const InspectArguments& arguments, const Model& model) {
  return mobility_of(model, arguments.scene ? std::span<const double>(arguments.scene->initial.positions) : std::span<const double>());
}

Costs measure(const InspectArguments& arguments, const Model& model) {
  const EffectPlan plan(model, arguments.options, arguments.effects());
  Costs costs;
  costs.sweeps = schedule_of(model, arguments.options, plan);
  const InitialState start = arguments.scene ? arguments.scene->initial : InitialState();
  costs.of_sweeps = sweep_costs(model, arguments.options, plan, start, costs.sweeps);
  if (arguments.scene) costs.effects = effect_costs(*arguments.scene);
  if (arguments.effects().contact) costs.contact = contact_cost(*arguments.scene);
  return costs;
}

class Printer {
 public:
  Printer(const InspectArguments& arguments, const Model& model, const Costs& costs, const Mobility& mobility)
      : arguments_(arguments), model_(model), bodies_(bodies_of(model)), costs_(costs), mobility_(mobility) {}

  void print() const {
    totals();
    effects();
    table();
    conventions();
    world();
    merged();
    mimics();
    couplings();
    sweeps();
    contact();
    warnings();
  }

 private:
  /// How many of `count` rows are printed.
  std::size_t shown(std::size_t count) const {
    return arguments_.all || count <= static_cast<std::size_t>(kLongTable) ? count : static_cast<std::size_t>(kShown);
  }
  void left_out(std::size_t count) const {
    const auto rest = static_cast<std::int64_t>(count - shown(count));
    if (rest > 0) say("  ... and {} more; --all prints them\n", grouped(rest));
  }

  void totals() const {
    const Tree& tree = model_.tree;
    const MassDistribution masses = mass_distribution(model_, model_.neutral());
    const auto row = [](const char* label, const std::string& value) { say("{:<11} {}\n", label, value); };
    std::vector<std::string> kinds;
    for (const auto& [motion, count] : counts_of(bodies_)) kinds.push_back(fmt::format("{} {}", grouped(count), motion));
    row("model", printable(model_.names.model) + ", " + base_of(model_));
    const auto massless = static_cast<std::int64_t>(std::ranges::count(bodies_, true, &BodyFacts::massless));
    row("bodies", fmt::format("{}: joints {}{}", grouped(tree.bodies()), fmt::join(kinds, ", "),
                              massless == 0 ? "" : fmt::format("; {} massless", grouped(massless))));
    const auto followers = static_cast<std::int64_t>(model_.mimics.size());
    const std::string mimics = followers == 0 ? "" : fmt::format(" less {}", counted(followers, "mimic joint"));
    const Index held = mobility_.rows - mobility_.giving_way - mobility_.held_already;
    const std::string couplings = held == 0 ? "" : fmt::format(" less {} that couplings hold", grouped(held));
    row("freedom", fmt::format("{} of freedom; {} in q, {} in v{}{}", counted(mobility_.freedom, "degree"),
                               counted(tree.shape.positions, "row"), grouped(tree.shape.velocities), mimics, couplings));
    row("mass", fmt::format("{:.6g} kg; centre of mass ({:.6g}, {:.6g}, {:.6g}) m in the zero configuration", masses.mass,
                            masses.center[0], masses.center[1], masses.center[2]));
    if (model_.welded.mass() > 0) row("", fmt::format("{:.6g} kg of links fixed to the world beside it, which move nothing", model_.welded.mass()));
    row("tree", fmt::format("{}, up to {} wide; {} of one joint kind", counted(tree.levels() - 1, "level"),
                            counted(widest_level(tree), "body"), counted(static_cast<std::int64_t>(tree.runs.size()), "run")));
    row("memory", fmt::format("state {}, constants {}, workspace {}", memory_text(bytes_for<State<double>>(tree.shape)),
                              memory_text(bytes_for<BodyConstants<double>>(tree.shape) + bytes_for<Tree>(tree.shape)),
                              memory_text(bytes_for<Workspace<double>>(tree.shape))));
  }

  void effects() const {
    if (!arguments_.scene) return;
    const Scene& scene = *arguments_.scene;
    const Options& options = arguments_.options;
    const std::string steps = options.varies() ? fmt::format("steps for an accuracy of {:g}", *options.accuracy) : fmt::format("steps of {:g} s", options.step);
    say("\neffects of the scene: {:g} s in {}\n", scene.duration, steps);
    const auto& g = arguments_.options.gravity;
    const std::vector<EffectLine> lines = effect_lines(scene.effects, model_);
    std::size_t width = 9;
    for (const EffectLine& line : lines) width = std::max(width, line.name.size());
    if (g != std::array<double, 3>{0, 0, 0}) say("  {:<{}} {:g} {:g} {:g} m/s^2\n", "gravity", width, g[0], g[1], g[2]);
    for (const EffectLine& line : lines) say("  {:<{}} {}, {}\n", line.name, width, line.where, line.what);
    if (scene.randomization.any()) say("\ndrawn for each instance: {}\n", randomization_text(scene.randomization));
    const std::vector<EffectCost>& costs = costs_.effects;
    say("\nwhat a step costs on this machine, ns per body: {:.0f} without effects, {:.0f} with all\n", costs.front().nanoseconds,
               costs.back().nanoseconds);
    for (std::size_t k = 1; k + 1 < costs.size(); ++k) say("  {:<{}} {:+.0f} alone\n", costs[k].name, width, costs[k].nanoseconds);
  }

  void table() const {
    say("\nbodies, parents first\n");
    Table table({{"slot", Align::right},
                 {"body", Align::left},
                 {"parent", Align::left},
                 {"joint", Align::left},
                 {"kind", Align::left},
                 {"axis", Align::left},
                 {"q", Align::left},
                 {"v", Align::left},
                 {"mass kg", Align::right},
                 {"limits", Align::left}});
    for (const BodyFacts& body : std::span(bodies_).first(shown(bodies_.size()))) {
      const bool screw = body.kind == JointKind::screw;
      const std::string pitch = body.motion == "helical" ? fmt::format(", {:.3g} m/rad", body.pitch) : "";
      const std::string axis =
          !screw ? "-" : fmt::format("{} {:.4g} {:.4g} {:.4g}{}", body.motion, body.axis[0], body.axis[1], body.axis[2], pitch);
      table.add({fmt::format("{}", body.slot), body.body, fmt::format("{} {}", body.parent, body.parent_body), body.joint,
                 fmt::format("{}{}", kind_name(body.kind), body.follows ? ", tied" : ""), axis, rows_text(body.first_q, position_count(body.kind)),
                 rows_text(body.first_v, velocity_count(body.kind)), body.massless ? "massless" : fmt::format("{:.4g}", body.mass),
                 screw ? limits_text(body.lower, body.upper, body.motion != "prismatic") : "-"});
    }
    say_text(table.text("  "));
    left_out(bodies_.size());
  }

  void conventions() const {
    say("\nrows of a joint\n");
    const auto has = [&](JointKind kind) {
      return std::ranges::any_of(model_.tree.runs, [&](const Run& run) { return run.kind == kind; });
    };
    if (has(JointKind::screw)) say("  screw  q: angle [rad] (prismatic: shift [m]); v: its rate\n");
    if (has(JointKind::ball)) say("  ball   q: unit quaternion x y z w; v: angular velocity x y z in the body's frame\n");
    if (has(JointKind::free)) {
      say("  free   q: position x y z in the parent's frame, unit quaternion x y z w; v: angular x y z, then linear x y z, in the "
                 "body's frame\n");
    }
    say("  A quaternion turns body coordinates to the parent's. A body's frame sits at its joint, the axis of a screw along z.\n");
    say("  Axes above: x y z in the frame of the link that the parent is called after. A tied joint follows another, as listed below.\n");
  }

  void world() const {
    const std::vector<const BodyShape*> shapes = world_shapes(model_);
    if (shapes.empty()) return;
    say("\nshapes that stand in the world\n");
    for (const BodyShape* shape : std::span(shapes).first(shown(shapes.size()))) {
      const std::array<double, 3>& at = shape->pose.shift;
      say("  {}: {}, at {:g} {:g} {:g}\n", printable(shape->link), size_text(*shape), at[0], at[1], at[2]);
    }
    left_out(shapes.size());
  }

  void merged() const {
    const std::vector<MergedLink> links = merged_links(model_);
    if (links.empty()) return;
    say("\nlinks behind fixed joints, merged into the body that carries them\n");
    const std::size_t count = shown(links.size());
    for (std::size_t begin = 0, end = 0; begin < count; begin = end) {
      const Index slot = links[begin].slot;
      std::string line = fmt::format("  {} {}:", slot, printable(model_.names.body[static_cast<std::size_t>(slot)]));
      for (end = begin; end < count && links[end].slot == slot; ++end) {
        const std::string word = (end > begin ? ", " : " ") + printable(links[end].name);
        if (line.size() + word.size() > kLineWidth && end > begin) {
          say("{},\n", line);
          line = "      " + printable(links[end].name);
        } else {
          line += word;
        }
      }
      say("{}\n", line);
    }
    left_out(links.size());
  }

  void mimics() const {
    if (model_.mimics.empty()) return;
    say("\nmimic joints\n");
    const auto joint = [&](Index slot) { return printable(model_.names.joint[static_cast<std::size_t>(slot)]); };
    for (const Mimic& mimic : std::span(model_.mimics).first(shown(model_.mimics.size()))) {
      say("  {} = {:g} x {}{}\n", joint(mimic.follower_slot), mimic.multiplier, joint(mimic.leader_slot),
                 mimic.offset == 0 ? "" : fmt::format(" {:+g}", mimic.offset));
    }
    left_out(model_.mimics.size());
  }

  void couplings() const {
    if (model_.couplings.empty()) return;
    say("\ncouplings, {}\n", arguments_.scene ? "where the scene begins" : "in the zero configuration");
    say_couplings(model_, mobility_, shown(model_.couplings.size()));
    const std::vector<ClosureWork> closures = closure_work(model_);
    say("\nwhere loops close, the dearest first\n");
    say_closures(model_, closures, shown(closures.size()));
  }

  void sweeps() const {
    say("\nsweeps of a step, solver {}, in order\n", name(arguments_.options.solver));
    Table table({{"when", Align::left}, {"sweep", Align::left}, {"ns/body", Align::right}, {"reads", Align::left}, {"writes", Align::left}},
                kLineWidth);
    std::string_view before;
    for (std::size_t k = 0; k < costs_.sweeps.size(); ++k) {
      const Sweep& sweep = costs_.sweeps[k];
      const std::string_view when = name(sweep.when);
      table.add({std::string(when == before ? "" : when), sweep.name, fmt::format("{:.2f}", costs_.of_sweeps[k]), sweep.reads, sweep.writes});
      before = when;
    }
    say_text(table.text("  "));
    say("  start: where no step before is known; evaluation: of the first guess and after every correction; factor: where\n"
        "  that of an earlier step does not serve, and again where a correction gains little; arrival: at new positions, also\n"
        "  where a motion starts; ns/body: of each sweep alone on this machine, over the whole tree\n");
  }

  void contact() const {
    if (!costs_.contact) return;
    const ContactCost& cost = *costs_.contact;
    std::int64_t steps = 0;
    for (const TouchingSteps& group : cost.steps) steps += group.count;
    say("\ncontact, beside these sweeps, over {} from where the scene begins\n", counted(steps, "step"));
    say("  find   first: which of {} of shapes are near, and where they meet; {:.1f} us for {} at last\n",
        counted(static_cast<std::int64_t>(cost.pairs), "pair"), 1e6 * cost.find, counted(static_cast<std::int64_t>(cost.near), "place"));
    say("  rows   factor: three for each place, and what the tree feels of them\n"
        "  solve  evaluation, correction: which of them press, stick or slide, all that touch each other together\n");
    Table table({{"places that press", Align::left}, {"steps", Align::right}, {"us a step", Align::right}});
    for (const TouchingSteps& group : cost.steps) {
      table.add({group.least == group.most ? fmt::format("{}", group.least) : fmt::format("{} to {}", group.least, group.most),
                 fmt::format("{}", group.count), fmt::format("{:.1f}", 1e6 * group.seconds)});
    }
    say_text(table.text("  "));
  }

  void warnings() const {
    if (!model_.notes.empty()) say("\nnotes\n");
    for (const std::string& note : model_.notes) say("  {}\n", printable(note));
    if (model_.warnings.empty()) return;
    say("\nwarnings\n");
    for (const std::string& warning : model_.warnings) say("  {}\n", printable(warning));
  }

  const InspectArguments& arguments_;
  const Model& model_;
  std::vector<BodyFacts> bodies_;
  const Costs& costs_;
  const Mobility& mobility_;
};

Json json_of(const InspectArguments& arguments, const Model& model, const Costs& costs, const Mobility& mobility) {
  const Tree& tree = model.tree;
  const MassDistribution masses = mass_distribution(model, model.neutral());
  const std::vector<BodyFacts> bodies = bodies_of(model);
  const auto name = [](const std::vector<std::string>& names, Index slot) { return names[static_cast<std::size_t>(slot)]; };
  Json result{{"command", "inspect"},
              {"version", kVersion},
              {"model", model.names.model},
              {"source", arguments.model},
              {"base", base_of(model)},
              {"bodies", tree.bodies()},
              {"dofs", mobility.freedom},
              {"positions", tree.shape.positions},
              {"velocities", tree.shape.velocities},
              {"mass", masses.mass},
              {"welded_mass", model.welded.mass()},
              {"center_of_mass", {masses.center[0], masses.center[1], masses.center[2]}},
              {"levels", tree.levels() - 1},
              {"widest_level", widest_level(tree)},
              {"joints", counts_of(bodies)},
              {"quaternion_order", "x y z w"},
              {"twist_order", "angular linear, body frame"},
              {"position_names", model.names.position},
              {"velocity_names", model.names.velocity},
              {"state_bytes", bytes_for<State<double>>(tree.shape)},
              {"constants_bytes", bytes_for<BodyConstants<double>>(tree.shape) + bytes_for<Tree>(tree.shape)},
              {"workspace_bytes", bytes_for<Workspace<double>>(tree.shape)}};
  Json& table = result["table"] = Json::array();
  for (const BodyFacts& body : bodies) {
    // an infinite limit becomes null
    table.push_back({{"slot", body.slot},
                     {"body", body.body},
                     {"parent", body.parent},
                     {"joint", body.joint},
                     {"kind", kind_name(body.kind)},
                     {"motion", body.motion},
                     {"pitch", body.pitch},
                     {"axis", body.kind == JointKind::screw ? Json(body.axis) : Json(nullptr)},
                     {"follows", body.follows ? Json(name(model.names.joint, body.follows->leader_slot)) : Json(nullptr)},
                     {"massless", body.massless},
                     {"first_q", body.first_q},
                     {"first_v", body.first_v},
                     {"rows_q", position_count(body.kind)},
                     {"rows_v", velocity_count(body.kind)},
                     {"mass", body.mass},
                     {"lower", body.lower},
                     {"upper", body.upper},
                     {"damping", model.attributes.damping(body.first_v)},
                     {"friction", model.attributes.friction(body.first_v)}});
  }
  Json& runs = result["runs"] = Json::array();
  for (const Run& run : tree.runs) runs.push_back({{"begin", run.begin}, {"end", run.end}, {"kind", kind_name(run.kind)}});
  Json& merged = result["merged_links"] = Json::array();
  for (const MergedLink& link : merged_links(model)) merged.push_back({{"link", link.name}, {"slot", link.slot}});
  Json& world = result["world"] = Json::array();
  for (const BodyShape* shape : world_shapes(model)) {
    world.push_back({{"link", shape->link}, {"shape", size_text(*shape)}, {"position", shape->pose.shift}, {"rotation", shape->pose.rotation}});
  }
  Json& mimics = result["mimics"] = Json::array();
  for (const Mimic& mimic : model.mimics) {
    mimics.push_back({{"follower", name(model.names.joint, mimic.follower_slot)},
                      {"leader", name(model.names.joint, mimic.leader_slot)},
                      {"multiplier", mimic.multiplier},
                      {"offset", mimic.offset}});
  }
  result["couplings"] = couplings_json(model, mobility);
  result["closures"] = closures_json(model, closure_work(model));
  Json& sweeps = result["sweeps"] = Json::array();
  for (std::size_t k = 0; k < costs.sweeps.size(); ++k) {
    const Sweep& sweep = costs.sweeps[k];
    sweeps.push_back({{"when", linden::name(sweep.when)},
                      {"name", sweep.name},
                      {"ns_per_body", costs.of_sweeps[k]},
                      {"reads", sweep.reads},
                      {"writes", sweep.writes}});
  }
  if (costs.contact) {
    Json& contact = result["contact"];
    contact = {{"pairs", costs.contact->pairs}, {"places_near", costs.contact->near}, {"find_us", 1e6 * costs.contact->find}};
    Json& steps = contact["steps"] = Json::array();
    for (const TouchingSteps& group : costs.contact->steps) {
      steps.push_back({{"least_places", group.least}, {"most_places", group.most}, {"steps", group.count}, {"us_per_step", 1e6 * group.seconds}});
    }
  }
  if (arguments.scene) {
    const Scene& scene = *arguments.scene;
    result["step"] = arguments.options.step;
    result["duration"] = scene.duration;
    result["gravity"] = arguments.options.gravity;
    result["effects"] = effects_json(scene.effects, model);
    for (const EffectCost& cost : costs.effects) result["ns_per_body_step"][cost.name] = cost.nanoseconds;
    result["initial"] = {{"positions", scene.initial.positions}, {"velocities", scene.initial.velocities}};
  }
  result["warnings"] = model.warnings;
  result["notes"] = model.notes;
  return result;
}

}  // namespace

int inspect(const InspectArguments& arguments) {
  check(arguments.options);
  const Outputs outputs{{"--json", arguments.json, {".json"}}};
  const std::shared_ptr<const Model> loaded = arguments.loaded(outputs);
  const Model& model = *loaded;
  const Costs costs = measure(arguments, model);
  const Mobility mobility = mobility_at_start(arguments, model);
  if (!arguments.json.empty()) write_json(arguments.json, json_of(arguments, model, costs, mobility));
  Printer(arguments, model, costs, mobility).print();
  return 0;
}

}  // namespace linden
