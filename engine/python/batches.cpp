// engine/python/batches.cpp
// Many instances in time (engine/batch.hpp): the rows of all of them in arrays that Python has made and the threads read and write.
#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "engine/batch.hpp"
#include "engine/python/bindings.hpp"
#include "engine/python/numbers.hpp"
#include "engine/python/patience.hpp"
#include "engine/queries/observations.hpp"
#include "engine/randomization.hpp"
#include "layout/support/input_error.hpp"

using namespace nanobind::literals;

namespace linden::python {
namespace {

template <class Number>
using Rows = nb::ndarray<Number, nb::c_contig, nb::device::cpu>;
using Instances = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

template <class Real>
class PyBatch {
 public:
  PyBatch(std::shared_ptr<Scene> scene, std::int64_t size, int threads, const std::optional<std::string>& instructions,
          const std::vector<std::string>& names)
      : scene_(std::move(scene)), batch_(*scene_, size, computed_by(threads, instructions)), seen_(scene_->model, scene_->effects, names) {}

  BatchOf<Real>& batch() {
    in_use_.require_free();
    return batch_;
  }
  const std::shared_ptr<Scene>& scene() const { return scene_; }
  const Observations& seen() const { return seen_; }

  /// The rows are taken in before the steps; what is seen goes out after them.
  void step(std::int64_t n, const BatchRows<Real>& rows) {
    if (n < 0) throw InputError(fmt::format("n: {} steps are asked for; expected zero or more", n));
    BatchOf<Real>& batch = this->batch();
    const InUse::Hold hold(in_use_);
    // one part where it may be, as what is seen is then still in the cache; the first call has no time to go by
    constexpr double kBodySecond = 1e-7;
    const double guess = kBodySecond * static_cast<double>(batch.size()) * batch.model().tree.bodies() / batch.threads();
    const auto part = std::max<std::int64_t>(1, static_cast<std::int64_t>(2 * kPart / guess));
    if (n <= part) {
      const nb::gil_scoped_release release;
      batch.step(n, rows);
      return;
    }
    bool first = true;
    BatchRows<Real> inward = rows;
    inward.observations = nullptr;
    inward.observed = {};
    in_parts(n - part, part, [&](std::int64_t count) {
      batch.step(count, std::exchange(first, false) ? inward : BatchRows<Real>{});
      return true;
    });
    const nb::gil_scoped_release release;
    batch.step(part, {.observations = rows.observations, .observed = rows.observed});
  }

  template <class Work>
  auto busy(const Work& work) {
    BatchOf<Real>& batch = this->batch();
    const InUse::Hold hold(in_use_);
    const nb::gil_scoped_release release;
    return work(batch);
  }

 private:
  static BatchOptions computed_by(int threads, const std::optional<std::string>& instructions) {
    return {.threads = threads, .instructions = instructions ? std::optional(instructions_from(*instructions)) : std::nullopt};
  }

  std::shared_ptr<Scene> scene_;
  BatchOf<Real> batch_;
  Observations seen_;
  InUse in_use_;
};

/// An array that Python has made of the right type; its length the batch looks at.
template <class Number>
std::span<Number> span_of(const std::optional<Rows<Number>>& rows) {
  return rows ? std::span<Number>(rows->data(), rows->size()) : std::span<Number>();
}

std::variant<std::span<double>, std::span<float>> observed_in(nb::handle to) {
  Rows<double> numbers;
  if (nb::try_cast(to, numbers, false)) return std::span<double>(numbers.data(), numbers.size());
  Rows<float> single;
  if (nb::try_cast(to, single, false)) return std::span<float>(single.data(), single.size());
  throw InputError("observations go into an array of float64 or float32, row after row");
}

/// The body that a link is, or is part of.
Index body_of(const Model& model, const std::string& link) {
  const Index slot = place_of(model, link).slot;
  if (slot == 0) throw InputError(fmt::format("link \"{}\" is fixed to the world; expected one that moves", link));
  return slot;
}

template <class Number, class Take>
nb::object array_of_records(std::int64_t size, const Take& take) {
  std::vector<Number> numbers;
  for (std::int64_t i = 0; i < size; ++i) numbers.push_back(take(i));
  return nb::cast(owning_array(std::move(numbers), {static_cast<std::size_t>(size)}));
}

template <class Number, class Real>
nb::object asked(PyBatch<Real>& self, const Observations& seen) {
  const auto size = static_cast<std::size_t>(self.batch().size()), width = static_cast<std::size_t>(seen.width());
  std::vector<Number> numbers(size * width);
  self.busy([&](BatchOf<Real>& batch) { batch.observe(seen, std::span(numbers)); });
  return nb::cast(owning_array(std::move(numbers), {size, width}));
}

/// What it is.
template <class Real>
void bind_facts(nb::class_<PyBatch<Real>>& c) {
  using Self = PyBatch<Real>;
  c.def_prop_ro("scene", &Self::scene)
      .def_prop_ro("size", [](Self& self) { return self.batch().size(); })
      .def_prop_ro("lanes", [](Self& self) { return self.batch().lanes(); })
      .def_prop_ro("threads", [](Self& self) { return self.batch().threads(); })
      .def_prop_ro("instructions", [](Self& self) { return std::string(linden::name(self.batch().instructions())); })
      .def_prop_ro("nbytes", [](Self& self) { return self.batch().bytes(); })
      .def_prop_ro("layout", [](Self& self) { return self.seen().layout(); })
      .def_prop_ro("width", [](Self& self) { return self.seen().width(); });
}

/// In time.
template <class Real>
void bind_time(nb::class_<PyBatch<Real>>& c) {
  using Self = PyBatch<Real>;
  c.def(
       "step",
       [](Self& self, std::int64_t n, std::optional<Rows<const Real>> targets, std::optional<Rows<const Real>> forces,
          std::optional<Rows<const Real>> gains, std::optional<Rows<const Real>> friction, std::optional<Rows<const Real>> ground_friction,
          std::optional<Rows<const Real>> gravity, nb::handle observed) {
         BatchRows<Real> rows{.targets = span_of(targets),
                              .forces = span_of(forces),
                              .gains = span_of(gains),
                              .friction = span_of(friction),
                              .ground_friction = span_of(ground_friction),
                              .gravity = span_of(gravity)};
         if (!observed.is_none()) {
           rows.observations = &self.seen();
           rows.observed = observed_in(observed);
         }
         self.step(n, rows);
       },
       "n"_a, "targets"_a.none(), "forces"_a.none(), "gains"_a.none(), "friction"_a.none(), "ground_friction"_a.none(), "gravity"_a.none(),
       "observed"_a.none())
      .def(
          "observe",
          [](Self& self, nb::handle to) {
            const auto rows = observed_in(to);
            self.busy([&](BatchOf<Real>& batch) { std::visit([&](const auto& span) { batch.observe(self.seen(), span); }, rows); });
          },
          "to"_a)
      .def(
          "ask",
          [](Self& self, const std::vector<std::string>& names, bool single) {
            const Observations seen(self.scene()->model, self.scene()->effects, names);
            return single ? asked<float>(self, seen) : asked<double>(self, seen);
          },
          "names"_a, "single"_a)
      .def(
          "reset",
          [](Self& self, const Instances& which, const Rows<const double>& q, const Rows<const double>& v) {
            self.busy([&](BatchOf<Real>& batch) {
              batch.reset(std::span(which.data(), which.size()), std::span(q.data(), q.size()), std::span(v.data(), v.size()));
            });
          },
          "which"_a, "q"_a, "v"_a)
      .def(
          "draw",
          [](Self& self, const Instances& which, std::uint64_t seed) {
            self.busy([&](BatchOf<Real>& batch) {
              const Scene& scene = *self.scene();
              if (!scene.randomization.any()) return;
              for (const std::int64_t i : std::span(which.data(), which.size())) {
                apply(draw(scene.randomization, scene.model, scene.effects, seed + static_cast<std::uint64_t>(i)), scene.effects, batch, i);
              }
            });
          },
          "which"_a, "seed"_a)
      .def(
          "scatter",
          [](Self& self, const Instances& which, std::uint64_t seed, double spread, Rows<double> q, Rows<double> v) {
            const Scene& scene = *self.scene();
            const auto nq = static_cast<std::size_t>(scene.model.tree.shape.positions),
                       nv = static_cast<std::size_t>(scene.model.tree.shape.velocities);
            if (!(spread >= 0)) throw InputError(fmt::format("spread: {} is given; expected a number, zero or more", spread));
            InitialState start;
            for (std::size_t k = 0; k < which.size(); ++k) {
              start.positions.assign(q.data() + k * nq, q.data() + (k + 1) * nq);
              start.velocities.assign(v.data() + k * nv, v.data() + (k + 1) * nv);
              const InitialState drawn =
                  random_around(scene.model, start, seed + static_cast<std::uint64_t>(which.data()[k]), spread, scene.effects);
              std::ranges::copy(drawn.positions, q.data() + k * nq);
              std::ranges::copy(drawn.velocities, v.data() + k * nv);
            }
          },
          "which"_a, "seed"_a, "spread"_a, "q"_a.noconvert(), "v"_a.noconvert())
      .def(
          "describe", [](Self& self, std::int64_t i) { return self.batch().describe(i); }, "instance"_a)
      .def(
          "blocks",
          [](nb::object self, const std::string& what) {
            BatchOf<Real>& batch = nb::cast<Self&>(self).batch();
            const BatchView<const Real> view = what == "q" ? batch.positions() : batch.momenta();
            const auto lanes = static_cast<std::size_t>(batch.lanes()), rows = static_cast<std::size_t>(view.rows());
            const std::size_t blocks = view.flat().size() / std::max<std::size_t>(1, lanes * rows);
            return nb::ndarray<nb::numpy, const Real>(view.flat().data(), {blocks, lanes, rows}, self,
                                                      {static_cast<std::int64_t>(lanes * rows), 1, static_cast<std::int64_t>(lanes)});
          },
          "what"_a);
}

/// What differs from instance to instance.
template <class Real>
void bind_parameters(nb::class_<PyBatch<Real>>& c) {
  using Self = PyBatch<Real>;
  c.def(
       "masses",
       [](Self& self, const std::string& link) {
         const Index slot = body_of(self.scene()->model, link);
         return array_of_records<double>(self.batch().size(), [&](std::int64_t i) { return self.batch().inertia(i, slot)[0]; });
       },
       "link"_a)
      .def(
          "set_masses",
          [](Self& self, const Instances& which, const std::string& link, const Rows<const double>& masses) {
            const Index slot = body_of(self.scene()->model, link);
            for (std::size_t k = 0; k < which.size(); ++k) {
              self.batch().set_mass(which.data()[k], slot, masses.data()[k]);
            }
          },
          "which"_a, "link"_a, "masses"_a)
      .def(
          "inertias",
          [](Self& self, const std::string& link) {
            const Index slot = body_of(self.scene()->model, link);
            std::vector<double> numbers;
            for (std::int64_t i = 0; i < self.batch().size(); ++i) {
              const std::array<double, 10> inertia = self.batch().inertia(i, slot);
              numbers.insert(numbers.end(), inertia.begin(), inertia.end());
            }
            return fixed_array(std::move(numbers), {static_cast<std::size_t>(self.batch().size()), 10});
          },
          "link"_a)
      .def(
          "set_inertias",
          [](Self& self, const Instances& which, const std::string& link, const Rows<const double>& inertias) {
            const Index slot = body_of(self.scene()->model, link);
            for (std::size_t k = 0; k < which.size(); ++k) {
              std::array<double, 10> inertia;
              std::copy_n(inertias.data() + 10 * k, 10, inertia.begin());
              self.batch().set_inertia(which.data()[k], slot, inertia);
            }
          },
          "which"_a, "link"_a, "inertias"_a)
      .def(
          "rows",
          [](Self& self, const std::string& what) {
            BatchOf<Real>& batch = self.batch();
            const BatchView<Real> view = what == "targets"    ? batch.servo_targets()
                                         : what == "forces"   ? batch.forces()
                                         : what == "gains"    ? batch.gains()
                                         : what == "friction" ? batch.friction()
                                         : what == "gravity"  ? batch.gravity()
                                                              : batch.ground_friction();
            std::vector<double> numbers;
            for (std::int64_t i = 0; i < batch.size(); ++i) {
              for (Index row = 0; row < view.rows(); ++row) numbers.push_back(static_cast<double>(view(i, row)));
            }
            return fixed_array(std::move(numbers), {static_cast<std::size_t>(batch.size()), static_cast<std::size_t>(view.rows())});
          },
          "what"_a)
      .def(
          "column",
          [](Self& self, const std::string& what, const std::string& joint) {
            const Scene& scene = *self.scene();
            const Index row = row_of(scene.model, joint);
            const auto place_in = [&](const auto& entries, const char* effect) {
              for (std::size_t k = 0; k < entries.size(); ++k) {
                if (entries[k].row == row) return k;
              }
              throw InputError(fmt::format("joint \"{}\": it has no {}; expected one among the effects", joint, effect));
            };
            if (what == "forces") return static_cast<std::size_t>(row);
            return what == "friction" ? place_in(scene.effects.friction, "friction") : place_in(scene.effects.servos, "servo");
          },
          "what"_a, "joint"_a);
}

/// What is kept.
template <class Real>
void bind_checkpoints(nb::class_<PyBatch<Real>>& c) {
  using Self = PyBatch<Real>;
  c.def(
       "save", [](Self& self, const std::string& file) { self.busy([&](BatchOf<Real>& batch) { batch.save(file); }); }, "file"_a)
      .def(
          "load", [](Self& self, const std::string& file) { self.busy([&](BatchOf<Real>& batch) { batch.load(file); }); }, "file"_a)
      .def("checkpoint",
           [](Self& self) {
             const std::string bytes = self.busy([](BatchOf<Real>& batch) { return batch.checkpoint(); });
             return nb::bytes(bytes.data(), bytes.size());
           })
      .def(
          "restore",
          [](Self& self, nb::bytes bytes) {
            const std::string_view text(bytes.c_str(), bytes.size());
            self.busy([&](BatchOf<Real>& batch) { batch.restore(text); });
          },
          "checkpoint"_a);
}

template <class Real, class Take>
void bind_record(nb::class_<PyBatch<Real>>& c, const char* name, const Take& take) {
  c.def_prop_ro(name, [take](PyBatch<Real>& self) {
    using Number = decltype(take(self.batch().record(0)));
    return array_of_records<Number>(self.batch().size(), [&](std::int64_t i) { return take(self.batch().record(i)); });
  });
}

template <class Real>
void bind_batch(nb::module_& m, const char* name) {
  nb::class_<PyBatch<Real>> c(m, name);
  c.def(nb::init<std::shared_ptr<Scene>, std::int64_t, int, std::optional<std::string>, std::vector<std::string>>(), "scene"_a,
        "instances"_a, "threads"_a, "instructions"_a.none(), "observe"_a);
  bind_facts(c);
  bind_time(c);
  bind_parameters(c);
  bind_checkpoints(c);
  bind_record(c, "status", [](const InstanceRecord& r) { return static_cast<std::uint8_t>(r.status); });
  bind_record(c, "steps", [](const InstanceRecord& r) { return r.steps; });
  bind_record(c, "evaluations", [](const InstanceRecord& r) { return r.evaluations; });
  bind_record(c, "rescued", [](const InstanceRecord& r) { return r.rescued; });
}

}  // namespace

void bind_batches(nb::module_& m) {
  bind_batch<double>(m, "Batch64");
  bind_batch<float>(m, "Batch32");
}

}  // namespace linden::python
