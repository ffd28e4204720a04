#include "engine/queries/observations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "engine/effects/effect_plan.hpp"
#include "engine/queries/block_observer.hpp"
#include "engine/simulation.hpp"
#include "engine/sweeps/body_contacts.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// What can be asked for, of the whole state or of one joint or link.
struct ObservedKind {
  std::string_view name;
  Look what;
  enum class Subject : std::uint8_t { none, joint_if_named, joint, link } subject;
  Index width;  // 0: as many as there are
  std::string_view units;
  std::string_view rows;  // with spaces
};
using enum ObservedKind::Subject;

constexpr std::string_view kXyz = "x y z", kAngularLinear = "wx wy wz vx vy vz";
constexpr std::array kKinds{
    ObservedKind{"q", Look::positions, joint_if_named, 0, "rad, m, 1", ""},
    ObservedKind{"v", Look::velocities, joint_if_named, 0, "rad/s, m/s", ""},
    ObservedKind{"a", Look::accelerations, joint_if_named, 0, "rad/s^2, m/s^2", ""},
    ObservedKind{"p", Look::momenta, joint_if_named, 0, "kg m^2/s, kg m/s", ""},
    ObservedKind{"targets", Look::targets, none, 0, "rad, m", ""},
    ObservedKind{"target", Look::targets, joint, 1, "rad, m", ""},
    ObservedKind{"time", Look::time, none, 1, "s", "time"},
    ObservedKind{"energy", Look::energy, none, 2, "J", "kinetic potential"},
    ObservedKind{"com", Look::centre_of_mass, none, 3, "m", kXyz},
    ObservedKind{"com_velocity", Look::centre_of_mass_velocity, none, 3, "m/s", kXyz},
    ObservedKind{"momentum", Look::momentum, none, 6, "kg m^2/s, kg m/s", "kx ky kz lx ly lz"},
    ObservedKind{"pose", Look::pose, link, 7, "m, 1", "x y z qx qy qz qw"},
    ObservedKind{"position", Look::position, link, 3, "m", kXyz},
    ObservedKind{"quaternion", Look::quaternion, link, 4, "1", "qx qy qz qw"},
    ObservedKind{"twist", Look::twist, link, 6, "rad/s, m/s", kAngularLinear},
    ObservedKind{"acceleration", Look::acceleration, link, 6, "rad/s^2, m/s^2", "awx awy awz avx avy avz"},
    ObservedKind{"imu", Look::imu, link, 6, "rad/s, m/s^2", "wx wy wz fx fy fz"},
    ObservedKind{"contact", Look::contact, link, 2, "1, N", "points force"},
};

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for (const ObservedKind& kind : kKinds) names.emplace_back(kind.name);
  return names;
}

const ObservedKind& kind_of(const std::string& name, std::string_view word, bool has_subject) {
  const auto found = std::ranges::find(kKinds, word, &ObservedKind::name);
  if (found == kKinds.end()) {
    const std::vector<std::string> known = kind_names();
    const std::string guess = nearest(word, known);
    throw InputError(fmt::format("observation {} is not known; expected one of {}, of a joint or link with its name behind a colon{}",
                                 quoted(name), fmt::join(known, ", "), guess.empty() ? "" : fmt::format("; did you mean {}?", guess)));
  }
  if (has_subject && found->subject == none) {
    throw InputError(fmt::format("observation {}: {} is of the whole state; expected no name behind it", quoted(name), word));
  }
  if (!has_subject && (found->subject == joint || found->subject == link)) {
    throw InputError(
        fmt::format("observation {}: of which {}? expected \"{}:NAME\"", quoted(name), found->subject == joint ? "joint" : "link", word));
  }
  return *found;
}

/// Makes schedule and layout entry by entry.
class Compiler {
 public:
  Compiler(const Model& model, const Effects& effects) : model_(model), effects_(effects) {
    schedule_.model_hash = model.hash();
    schedule_.servos = effects.servos.size();
  }

  void add(const std::string& name) {
    if (std::ranges::find(layout, name, &Observed::name) != layout.end()) {
      throw InputError(fmt::format("observation {} is there twice; expected it once", quoted(name)));
    }
    const std::size_t colon = name.find(':');
    const bool has_subject = colon != std::string::npos;
    const ObservedKind& kind = kind_of(name, std::string_view(name).substr(0, colon), has_subject);
    const std::string subject = has_subject ? name.substr(colon + 1) : "";
    ScheduledLook look{.what = kind.what, .offset = schedule_.width, .count = kind.width};
    Observed entry;
    entry.name = name;
    entry.offset = schedule_.width;
    entry.units = kind.units;
    for (const std::string_view row : words_of(kind.rows)) entry.rows.emplace_back(row);
    try {
      if (kind.subject == link) look.link = place_of(model_, subject);
      if (kind.rows.empty()) choose_rows(look, subject, entry);
    } catch (const InputError& error) {
      throw InputError(fmt::format("observation {}: {}", quoted(name), error.what()));
    }
    require(look, name);
    entry.width = look.count;
    schedule_.width += look.count;
    schedule_.looks.push_back(look);
    layout.push_back(std::move(entry));
  }

  std::shared_ptr<const ObservationSchedule> finished() {
    std::vector<bool> followed(static_cast<std::size_t>(model_.tree.shape.slots), schedule_.totals);
    for (const ScheduledLook& look : schedule_.looks) {
      if (look.what < Look::pose) continue;
      for (Index i = look.link.slot; i != 0; i = model_.tree.parent(i)) followed[static_cast<std::size_t>(i)] = true;
    }
    for (Index i = 1; i < model_.tree.shape.slots; ++i) {
      if (followed[static_cast<std::size_t>(i)]) schedule_.slots.push_back(i);
    }
    keep_contacts();
    return std::make_shared<const ObservationSchedule>(std::move(schedule_));
  }

  std::vector<Observed> layout;

 private:
  /// Rows of positions, velocities, accelerations, momenta or targets: of a joint, or all.
  void choose_rows(ScheduledLook& look, const std::string& joint, Observed& entry) {
    const Names& names = model_.names;
    if (look.what == Look::targets) {
      for (std::size_t k = 0; k < effects_.servos.size(); ++k) {
        entry.rows.push_back(names.velocity[static_cast<std::size_t>(effects_.servos[k].row)]);
      }
      look.count = static_cast<Index>(entry.rows.size());
      if (look.count == 0) throw InputError("there is no servo; expected one among the effects");
      if (joint.empty()) return;
      const Index row = row_of(model_, joint);
      const auto servo = std::ranges::find(effects_.servos, row, &Servo::row);
      if (servo == effects_.servos.end()) {
        throw InputError(fmt::format("no servo drives it; expected one of the joints {}", fmt::join(entry.rows, ", ")));
      }
      look.first = static_cast<Index>(servo - effects_.servos.begin());
      look.count = 1;
      entry.rows = {names.velocity[static_cast<std::size_t>(row)]};
      return;
    }
    const bool positions = look.what == Look::positions;
    const std::vector<std::string>& all = positions ? names.position : names.velocity;
    look.count = static_cast<Index>(all.size());
    if (!joint.empty()) {
      const Index row = row_of(model_, joint);
      Index slot = 1;
      while (model_.tree.first_v(slot) != row) ++slot;
      const JointKind kind = model_.tree.kind(slot);
      look.first = positions ? model_.tree.first_q(slot) : row;
      look.count = positions ? position_count(kind) : velocity_count(kind);
    }
    entry.rows.assign(all.begin() + look.first, all.begin() + look.first + look.count);
  }

  /// What has to be known of a state for this.
  void require(const ScheduledLook& look, const std::string& name) {
    const auto at_least = [&](MotionDepth depth) {
      schedule_.follows = true;
      schedule_.depth = std::max(schedule_.depth, depth);
      schedule_.velocities = schedule_.velocities || depth >= MotionDepth::twists;
      schedule_.accelerations = schedule_.accelerations || depth >= MotionDepth::accelerations;
    };
    switch (look.what) {
      case Look::positions:
      case Look::momenta: break;
      case Look::velocities: schedule_.velocities = true; break;
      case Look::accelerations: schedule_.accelerations = true; break;
      case Look::targets: schedule_.targets = true; break;
      case Look::time: schedule_.time = true; break;
      case Look::energy: schedule_.energy = true; break;
      case Look::centre_of_mass:
      case Look::centre_of_mass_velocity:
      case Look::momentum:
        schedule_.totals = true;
        schedule_.momenta = schedule_.momenta || look.what != Look::centre_of_mass;
        at_least(schedule_.momenta ? MotionDepth::twists : MotionDepth::poses);
        break;
      case Look::pose:
      case Look::position:
      case Look::quaternion: at_least(MotionDepth::poses); break;
      case Look::contact:
        if (!effects_.ground && !effects_.contact) {
          throw InputError(fmt::format("observation {}: there is no ground, and bodies do not touch each other; expected ground or contact among the effects", quoted(name)));
        }
        at_least(MotionDepth::twists);
        break;
      case Look::twist: at_least(MotionDepth::twists); break;
      case Look::acceleration:
      case Look::imu: at_least(MotionDepth::accelerations); break;
    }
  }

  /// The ground's points, and the shapes, of the bodies that are asked for.
  void keep_contacts() {
    const auto asked = [&](Index slot) {
      return std::ranges::any_of(schedule_.looks,
                                 [&](const ScheduledLook& look) { return look.what == Look::contact && look.link.slot == slot; });
    };
    if (std::ranges::find(schedule_.looks, Look::contact, &ScheduledLook::what) == schedule_.looks.end()) return;
    for (std::size_t shape = 0; effects_.contact && shape < effects_.contact->shapes.size(); ++shape) {
      const Index slot = effects_.contact->shapes[shape].slot;
      if (asked(slot)) schedule_.loads.push_back({slot, remembered_load(effects_.contact->shapes.size()) + 2 * shape});
    }
    Effects alone;
    alone.ground = effects_.ground;
    schedule_.ground = EffectPlan(model_, {}, alone).ground;
    std::erase_if(schedule_.ground.points, [&](const GroundPoint& point) { return !asked(point.slot); });
    schedule_.ground.share.clear();
  }

  const Model& model_;
  const Effects& effects_;
  ObservationSchedule schedule_;
};

}  // namespace

Observations::Observations(const Model& model, const Effects& effects, const std::vector<std::string>& names) {
  Compiler compiler(model, effects);
  for (const std::string& name : names) compiler.add(name);
  layout_ = std::move(compiler.layout);
  schedule_ = compiler.finished();
  width_ = schedule_->width;
}

Observations::~Observations() = default;
Observations::Observations(Observations&&) noexcept = default;
Observations& Observations::operator=(Observations&&) noexcept = default;

const Observed& Observations::at(const std::string& name) const {
  const auto found = std::ranges::find(layout_, name, &Observed::name);
  if (found != layout_.end()) return *found;
  std::vector<std::string> known;
  for (const Observed& entry : layout_) known.push_back(entry.name);
  const std::string guess = nearest(name, known);
  throw InputError(fmt::format("{} is not observed; expected one of {}{}", quoted(name), fmt::join(known, ", "),
                               guess.empty() ? "" : fmt::format("; did you mean {}?", guess)));
}

void Observations::observe(Simulation& simulation, std::span<double> to) {
  const ObservationSchedule& schedule = *schedule_;
  const Model& model = simulation.model();
  if (to.size() != static_cast<std::size_t>(width_)) {
    throw InputError(fmt::format("observations: room for {} numbers given, expected {}", to.size(), width_));
  }
  if (model_ != &model || !observer_) {
    require_same_model(schedule, model, model.hash());
    observer_ = make_block_observer<Instructions::scalar>(
        ObserverSetup<double>{model.tree, model.constants, schedule, simulation.options().gravity});
    model_ = &model;
  }
  const std::vector<double> v = schedule.velocities ? simulation.velocities() : std::vector<double>();
  const std::vector<double> a = schedule.accelerations ? simulation.accelerations() : std::vector<double>();
  const std::vector<double> targets = schedule.targets ? simulation.servo_targets() : std::vector<double>();
  if (schedule.targets) require_same_servos(schedule, targets.size());
  const double time = simulation.time();
  std::array<double, 2> energy{};
  if (schedule.energy) {
    const Energy now = simulation.energy();
    energy = {now.kinetic, now.potential};
  }
  observer_->observe({.q = simulation.positions().data(), .v = v.data(), .a = a.data(), .p = simulation.momenta().data(),
                      .targets = targets.data(), .time = &time, .energy = energy.data(), .contacts = simulation.contact_memory().data()},
                     to.data());
}

}  // namespace linden
