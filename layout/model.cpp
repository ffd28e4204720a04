#include "layout/model.hpp"

#include <fmt/format.h>

#include <cstring>

#include "layout/support/input_error.hpp"

namespace linden {
namespace {

/// FNV-1a, 64 bits.
class Hash {
 public:
  template <class T>
  void add(const T& value) {
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (const unsigned char byte : bytes) state_ = (state_ ^ byte) * 1099511628211ull;
  }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 14695981039346656037ull;
};

}  // namespace

std::vector<double> Model::neutral() const {
  std::vector<double> q(static_cast<std::size_t>(tree.shape.positions), 0.0);
  for (const Run& run : tree.runs) {
    if (run.kind == JointKind::screw) continue;
    const Index last = position_count(run.kind) - 1;
    for (Index i = run.begin; i < run.end; ++i) q[static_cast<std::size_t>(tree.first_q(i) + last)] = 1;
  }
  for (const Mimic& mimic : mimics) q[static_cast<std::size_t>(mimic.follower_q)] = mimic.offset;
  return q;
}

std::uint64_t Model::hash() const {
  Hash hash;
  for (const Run& run : tree.runs) {
    hash.add(run.begin);
    hash.add(run.end);
    hash.add(run.kind);
  }
  const auto add_fields = [&](const auto& structure) {
    structure.each(structure, [&](const char*, const auto& field, Rows, const char*) {
      for (const auto& value : field.flat()) hash.add(value);
    });
  };
  add_fields(tree);
  add_fields(constants);
  for (const Mimic& mimic : mimics) {
    hash.add(mimic.follower_slot);
    hash.add(mimic.leader_slot);
    hash.add(mimic.multiplier);
    hash.add(mimic.offset);
  }
  return hash.value();
}

void refuse_warnings(const Model& model) {
  if (model.warnings.empty()) return;
  const std::size_t others = model.warnings.size() - 1;
  const std::string more = others == 0 ? "" : fmt::format(", and {} more", others);
  throw InputError(fmt::format("{} (a warning{}; strict reading refuses them)", model.warnings.front(), more));
}

}  // namespace linden
