#include "tests/kernels/query_rig.hpp"

namespace linden {

void check_query(const OnRig<QueryRig>& prepare, const OnRig<QueryRig>& run, const std::vector<std::string>& writes,
                 const std::vector<std::string>& world_left) {
  for (const Model& model : mixed_trees()) {
    constexpr std::size_t count = 2 * Pack::size + 1;
    std::vector<std::vector<double>> plain(count), packed(count);
    std::vector<AskedState> states;
    for (std::size_t k = 0; k < count; ++k) {
      states.emplace_back(model, 100 + k);
      QueryRig<double> rig(model);
      rig.set(states.back());
      prepare(rig);
      QueryRig<double>::each(rig, [&](const char* name, auto& field) {
        if (contains(writes, name)) poison(field);
      });
      const QueryRig<double> before = rig;
      const AllocationCounter counter;
      run(rig);
      const std::int64_t allocations = counter.count();
      CHECK(allocations == 0);
      std::vector<std::vector<double>> old;
      QueryRig<double>::each(before, [&](const char*, auto& field) { old.emplace_back(field.flat().begin(), field.flat().end()); });
      std::size_t at = 0, found = 0;
      QueryRig<double>::each(rig, [&](const char* name, auto& field) {
        const std::vector<double>& was = old[at++];
        INFO(model.names.model << ": " << name);
        if (contains(writes, name)) {
          found += 1;
          const std::size_t left = contains(world_left, name) ? field.flat().size() / static_cast<std::size_t>(field.rows()) : 0;
          CHECK(std::all_of(field.flat().begin() + static_cast<std::ptrdiff_t>(left), field.flat().end(),
                            [](double x) { return std::isfinite(x); }));
          plain[k].insert(plain[k].end(), field.flat().begin() + static_cast<std::ptrdiff_t>(left), field.flat().end());
        } else {
          CHECK(std::equal(was.begin(), was.end(), field.flat().begin(), same_bits));
        }
      });
      CHECK(found == writes.size());
    }
    for (const std::size_t stride : {1u, 2u}) {
      for (std::size_t round = 0; round < count; ++round) {
        QueryRig<Pack> rig(model);
        for (std::size_t l = 0; l < Pack::size; ++l) rig.set(states[(round + stride * l) % count], l);
        prepare(rig);
        run(rig);
        for (std::size_t l = 0; l < Pack::size; ++l) {
          const std::size_t k = (round + stride * l) % count;
          std::vector<double> numbers;
          QueryRig<Pack>::each(rig, [&](const char* name, auto& field) {
            if (!contains(writes, name)) return;
            const std::size_t left = contains(world_left, name) ? field.flat().size() / static_cast<std::size_t>(field.rows()) : 0;
            for (std::size_t n = left; n < field.flat().size(); ++n) numbers.push_back(lane(field.flat()[n], l));
          });
          if (packed[k].empty()) packed[k] = numbers;
          const bool equal = std::equal(numbers.begin(), numbers.end(), packed[k].begin(), same_bits);
          const auto size = static_cast<Eigen::Index>(numbers.size());
          const auto expected = Eigen::Map<const VectorXd>(plain[k].data(), size);
          const bool close =
              (Eigen::Map<const VectorXd>(numbers.data(), size) - expected).cwiseAbs().maxCoeff() <= 1e-12 * expected.cwiseAbs().maxCoeff();
          if (equal && close) continue;
          CAPTURE(model.names.model, stride, round, l);
          REQUIRE(equal);
          REQUIRE(close);
        }
      }
    }
  }
}

}  // namespace linden
