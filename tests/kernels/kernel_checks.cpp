// The proofs that every sweep owes (rig.hpp).
#include "tests/kernels/rig.hpp"

namespace linden {
namespace {

/// Scratch that one tree lays out by rows of registers and a block of instances does not.
constexpr std::string_view kOwnLayout = "articulated";

}  // namespace

void check_writes(const Kernel& kernel, const std::vector<std::string>& with_world) {
  std::vector<std::string> changed;
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 5, 0.7));
    kernel.prepare(rig);
    Rig<double>::each(rig, [&](const char* name, auto& field, Rows) {
      if (contains(kernel.writes, name)) poison(field);
    });
    Rig<double> before = rig;
    kernel.run(rig);
    std::vector<std::vector<double>> old;
    Rig<double>::each(
        before, [&](const char*, auto& field, Rows) { old.emplace_back(field.flat().begin(), field.flat().end()); });
    std::size_t at = 0, outputs = 0;
    Rig<double>::each(rig, [&](const char* name, auto& field, Rows rows) {
      const std::vector<double>& was = old[at++];
      const std::size_t width = field.flat().size() / static_cast<std::size_t>(field.rows());
      const bool output = contains(kernel.writes, name) || contains(kernel.changes, name);
      outputs += output ? 1 : 0;
      const bool world = rows != Rows::slots || contains(with_world, name);
      bool complete = true, untouched = true, world_untouched = true;
      for (std::size_t k = 0; k < was.size(); ++k) {
        const bool same = same_bits(field.flat()[k], was[k]);
        complete = complete && (std::isfinite(field.flat()[k]) || (k < width && !world));
        untouched = untouched && same;
        world_untouched = world_untouched && (same || k >= width);
      }
      INFO(model.names.model << ": " << name);
      if (contains(kernel.scratch, name)) return;
      if (output) {
        CHECK((world || world_untouched));
        CHECK(complete);
        if (!untouched) changed.push_back(name);
      } else {
        CHECK(untouched);
      }
    });
    CHECK(outputs == kernel.writes.size() + kernel.changes.size());
  }
  for (const std::string& name : kernel.changes) {
    INFO(name);
    CHECK(contains(changed, name));
  }
}

template <class S>
void check_allocates_nothing_as(const Kernel& kernel) {
  const Model model = random_tree({.bodies = 12, .seed = 11});
  Rig<S> rig(model);
  const PlainTree tree = reference::plain_tree(model);
  for (std::size_t l = 0; l < lane_count<S>; ++l) rig.set(random_instance(tree, 5 + l, 0.7), l);
  kernel.prepare(rig);
  const AllocationCounter counter;
  kernel.run(rig);
  const std::int64_t allocations = counter.count();
  CHECK(allocations == 0);
}

void check_allocates_nothing(const Kernel& kernel) {
  check_allocates_nothing_as<double>(kernel);
  check_allocates_nothing_as<Pack>(kernel);
}

void check_lanes(const Kernel& kernel) {
  const Model models[] = {random_tree({.bodies = 9, .seed = 21}),
                          random_tree({.bodies = 9, .seed = 22, .frees = false})};
  for (const Model& model : models) {
    const PlainTree tree = reference::plain_tree(model);
    constexpr std::size_t count = 2 * Pack::size + 1;
    std::vector<Instance> instances;
    std::vector<std::vector<double>> plain, packed(count);
    for (std::size_t k = 0; k < count; ++k) {
      instances.push_back(random_instance(tree, 100 + k, k % 3 == 0 ? 2.0 : 0.1));
      Rig<double> rig(model);
      rig.set(instances[k]);
      kernel.prepare(rig);
      kernel.run(rig);
      plain.emplace_back();
      Rig<double>::each(rig, [&](const char* name, auto& field, Rows) {
        if (name == kOwnLayout) return;
        plain[k].insert(plain[k].end(), field.flat().begin(), field.flat().end());
      });
    }
    for (std::size_t round = 0; round < 2 * count; ++round) {
      const auto instance_in = [&](std::size_t l) {
        return (round + l * (round < count ? 1 : 2)) % count;
      };
      Rig<Pack> rig(model);
      for (std::size_t l = 0; l < Pack::size; ++l) rig.set(instances[instance_in(l)], l);
      kernel.prepare(rig);
      kernel.run(rig);
      for (std::size_t l = 0; l < Pack::size; ++l) {
        const std::size_t k = instance_in(l);
        const bool first = packed[k].empty();
        std::size_t at = 0;
        Rig<Pack>::each(rig, [&](const char* name, auto& field, Rows) {
          if (name == kOwnLayout) return;
          double scale = 0, worst = 0;
          bool equal = true, both_known = true;
          for (std::size_t n = 0; n < field.flat().size(); ++n) {
            const double expected = plain[k][at + n], found = lane(field.flat()[n], l);
            if (first) packed[k].push_back(found);
            equal = equal && same_bits(found, packed[k][at + n]);
            both_known = both_known && std::isnan(found) == std::isnan(expected);
            if (std::isnan(expected)) continue;
            scale = std::max(scale, std::abs(expected));
            worst = std::max(worst, std::abs(found - expected));
          }
          at += field.flat().size();
          if (equal && both_known && worst <= rig.rounding * scale) return;
          CAPTURE(model.names.model, name, round, l, k, worst, scale);
          REQUIRE(equal);
          REQUIRE(both_known);
          REQUIRE(worst <= rig.rounding * scale);
        });
      }
    }
  }
}

}  // namespace linden
