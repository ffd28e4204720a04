// engine/python/bindings.hpp
// The parts of the module `linden._core`, each bound in a file of its own, and what they share. What people call is in linden/, on top of
// these.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "engine/scene/scene.hpp"
#include "engine/simulation.hpp"

namespace linden::python {

namespace nb = nanobind;

/// An object that one thread uses at a time. Calls that take long let other threads of Python run meanwhile, which may not touch it then.
class InUse {
 public:
  /// Throws RuntimeError where another thread is in a call.
  void require_free() const {
    if (taken_.load(std::memory_order_relaxed)) {
      throw nb::builtin_exception(nb::exception_type::runtime_error,
                                  "another thread is in a call of this object; give each thread a copy of its own");
    }
  }
  /// While it lives the object is in use.
  class Hold {
   public:
    explicit Hold(InUse& object) : object_(object) {
      object.require_free();
      object.taken_ = true;
    }
    ~Hold() { object_.taken_ = false; }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    InUse& object_;
  };

 private:
  std::atomic<bool> taken_{false};
};

/// A simulation, its scene with it.
class PySimulation {
 public:
  explicit PySimulation(std::shared_ptr<Scene> scene) : scene_(std::move(scene)), simulation_(*scene_) {}

  const std::shared_ptr<Scene>& scene() const { return scene_; }
  InUse& in_use() { return in_use_; }
  /// To read.
  Simulation& look() {
    in_use_.require_free();
    return simulation_;
  }
  /// Before the state changes: what is known of it is known no longer.
  Simulation& to_change() {
    kinematics_.reset();
    return look();
  }
  /// work(simulation) while other threads of Python go on.
  template <class Work>
  auto ask(const Work& work) {
    Simulation& simulation = look();
    const InUse::Hold hold(in_use_);
    const nb::gil_scoped_release release;
    return work(simulation);
  }
  template <class Work>
  auto change(const Work& work) {
    to_change();
    return ask(work);
  }
  /// Made once a state, when it is first asked; whoever has it keeps it as it is.
  const std::shared_ptr<Kinematics>& kinematics() {
    if (!kinematics_) kinematics_ = ask([](Simulation& simulation) { return std::make_shared<Kinematics>(simulation); });
    return kinematics_;
  }

 private:
  std::shared_ptr<Scene> scene_;
  Simulation simulation_;
  std::shared_ptr<Kinematics> kinematics_;
  InUse in_use_;
};

/// work() while other threads of Python go on.
template <class Work>
auto freely(const Work& work) {
  const nb::gil_scoped_release release;
  return work();
}

/// "aligned", "link" or "world"; throws InputError for anything else.
Frame frame_from(const std::string& name);

void bind_errors(nb::module_& m);
/// Raises linden.StepError with the message and the report.
[[noreturn]] void raise_step_error(const std::string& message, nb::object report);

void bind_models(nb::module_& m);
void bind_scenes(nb::module_& m);
void bind_queries(nb::module_& m);
void bind_simulations(nb::module_& m);
void bind_observations(nb::module_& m);
void bind_animations(nb::module_& m);
void bind_batches(nb::module_& m);

}  // namespace linden::python
