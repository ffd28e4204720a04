// layout/field.hpp
// One array of the engine: `rows` rows of `Components` numbers each, 64-byte aligned.
//
// Every structure of linden (Tree, BodyConstants, State, Workspace, Attributes) is a list of fields. The list is written once, as
// a macro of the form
//
//   #define LINDEN_STATE_FIELDS(FIELD) FIELD(Scalar, q, 1, positions, "joint positions ...") ...
//
// and members, allocation, poisoning, hashing, printing and checkpoints all follow from it.
//
// A row is contiguous. Where Scalar is a pack of W instances a row is [component][lane], so that one body of one block of
// instances lies together; where it is a double, one body of one instance does.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <vector>

namespace linden {

using Index = std::int32_t;

/// One cache line, and one AVX-512 register.
inline constexpr std::size_t kAlignment = 64;

/// Memory on cache lines; from some megabytes on in huge pages where the system has them: a step over 65,000 bodies goes through some
/// twenty arrays at once and takes 6 % less time so.
void* allocate_aligned(std::size_t bytes);
void free_aligned(void* pointer, std::size_t bytes);

template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) {}
  T* allocate(std::size_t count) {
    return static_cast<T*>(allocate_aligned(count * sizeof(T)));
  }
  void deallocate(T* pointer, std::size_t count) { free_aligned(pointer, count * sizeof(T)); }
  bool operator==(const AlignedAllocator&) const { return true; }
};

/// What the rows of a field stand for; see Shape.
enum class Rows : std::uint8_t { slots, positions, velocities, blocks, instance };

/// Row counts of a tree. slots = bodies + 1: slot 0 is the world.
struct Shape {
  Index slots = 1;
  Index positions = 0;   // nq: 1 a screw, 4 a ball, 7 a free joint
  Index velocities = 0;  // nv: 1, 3, 6
  Index blocks = 0;      // sum of nv_i^2 over joints: 1, 9, 36
  Index rows(Rows kind) const {
    switch (kind) {
      case Rows::slots: return slots;
      case Rows::positions: return positions;
      case Rows::velocities: return velocities;
      case Rows::blocks: return blocks;
      case Rows::instance: return 1;
    }
    return 0;
  }
  bool operator==(const Shape&) const = default;
};

template <class Element, int Components = 1>
class Field {
 public:
  using value_type = Element;
  static constexpr int components = Components;

  void allocate(Index rows, Element value = Element{}) {
    size_ = static_cast<std::size_t>(rows) * Components;
    data_.assign(size_ + kPadding, value);
  }
  Index rows() const { return static_cast<Index>(size_ / Components); }

  Element& operator()(Index row, int component = 0) { return data_[offset(row, component)]; }
  const Element& operator()(Index row, int component = 0) const { return data_[offset(row, component)]; }

  Element* row(Index row) { return data_.data() + offset(row, 0); }
  const Element* row(Index row) const { return data_.data() + offset(row, 0); }

  std::span<Element> flat() { return {data_.data(), size_}; }
  std::span<const Element> flat() const { return {data_.data(), size_}; }

  std::size_t bytes() const { return size_ * sizeof(Element); }

  bool operator==(const Field& other) const { return std::ranges::equal(flat(), other.flat()); }

 private:
  static std::size_t offset(Index row, int component) {
    return static_cast<std::size_t>(row) * Components + static_cast<std::size_t>(component);
  }
  /// A register may be read or written from the start of any row.
  static constexpr std::size_t kPadding = sizeof(Element) < kAlignment ? kAlignment / sizeof(Element) : 1;

  std::vector<Element, AlignedAllocator<Element>> data_;
  std::size_t size_ = 0;
};

/// Fills a floating-point field with NaN: what a sweep forgets to write is seen at once.
template <class Element, int Components>
void poison(Field<Element, Components>& field) {
  for (Element& value : field.flat()) value = Element(std::numeric_limits<double>::quiet_NaN());
}

// The four things a field list is expanded to.
#define LINDEN_FIELD_MEMBER(type, name, components, rows, meaning) Field<type, components> name;
#define LINDEN_FIELD_ALLOCATE(type, name, components, row_kind, meaning) name.allocate(row_counts.rows(Rows::row_kind));
#define LINDEN_FIELD_VISIT(type, name, components, row_kind, meaning) visit(#name, self.name, Rows::row_kind, meaning);

// Members, `allocate(shape)` and `each(self, visit)`; visit(name, field, rows, meaning) sees every field in order.
#define LINDEN_FIELDS(LIST)                                     \
  LIST(LINDEN_FIELD_MEMBER)                                     \
  void allocate([[maybe_unused]] const Shape& row_counts) {     \
    LIST(LINDEN_FIELD_ALLOCATE)                                 \
  }                                                             \
  template <class Self, class Visit>                            \
  static void each(Self& self, Visit&& visit) {                 \
    LIST(LINDEN_FIELD_VISIT)                                    \
  }

}  // namespace linden
