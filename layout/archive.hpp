// layout/archive.hpp
// Plain values as bytes and back, the same to the bit: numbers and enumerations as they lie in memory (little endian), before text and
// lists how many there are, of structures all members in their order (layout/support/members.hpp).
//
//   BytesOut out;                         BytesIn in(bytes, "sim.pickle");
//   out.add(effects);                     in.read(effects);
//   file << sealed("linden x 1\n", out.bytes());
//
// What is read may be any bytes: whatever cannot be such a value throws InputError, and no more memory is asked for than the bytes account
// for. Whether numbers make sense is for those to say who take them.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <memory>
#include <utility>
#include <vector>

#include "layout/field.hpp"
#include "layout/support/checksum.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/members.hpp"

namespace linden {

/// The last of an enumeration's values, which begin at 0 and leave none out: others are refused. It has to be stated of each that is read.
template <class Enum>
inline constexpr Enum kLastOf = [] {
  static_assert(!std::is_enum_v<Enum>, "state which value of this enumeration is the last");
  return Enum{};
}();

class BytesOut {
 public:
  const std::string& bytes() const { return bytes_; }

  template <class T>
  void add(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      raw(&value, 1);
    } else {
      put(value);
    }
  }

 private:
  template <class T>
  void raw(const T* values, std::size_t count) {
    if (count > 0) bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  void count(std::size_t number) { add(static_cast<std::uint64_t>(number)); }

  void put(const std::string& text) {
    count(text.size());
    bytes_ += text;
  }
  template <class T>
  void put(const std::vector<T>& list) {
    count(list.size());
    if constexpr (std::is_arithmetic_v<T>) {
      raw(list.data(), list.size());
    } else {
      for (const T& entry : list) add(entry);
    }
  }
  template <class T, std::size_t Count>
  void put(const std::array<T, Count>& list) {
    for (const T& entry : list) add(entry);
  }
  template <class T>
  void put(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  /// What is shared is there once for each who has it.
  template <class T>
  void put(const std::shared_ptr<const T>& value) {
    add(value != nullptr);
    if (value) add(*value);
  }
  template <class First, class Second>
  void put(const std::pair<First, Second>& two) {
    add(two.first);
    add(two.second);
  }
  /// Sorted: the same bytes for the same entries.
  template <class T>
  void put(const std::unordered_map<std::string, T>& map) {
    std::vector<const std::pair<const std::string, T>*> entries;
    for (const auto& entry : map) entries.push_back(&entry);
    std::ranges::sort(entries, {}, [](const auto* entry) { return entry->first; });
    count(entries.size());
    for (const auto* entry : entries) put(*entry);
  }
  template <class T, int Components>
  void put(const Field<T, Components>& field) {
    count(static_cast<std::size_t>(field.rows()));
    raw(field.flat().data(), field.flat().size());
  }
  template <class T>
  void put(const T& structure) {
    each_member(structure, [this](const auto& member) { this->add(member); });
  }

  std::string bytes_;
};

class BytesIn {
 public:
  /// name: of what the bytes were taken from, for messages. Both must outlive it.
  BytesIn(std::string_view bytes, const std::string& name) : left_(bytes), name_(name) {}

  template <class T>
  void read(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t number = 0;
      raw(&number, 1);
      if (number > 1) damaged();
      value = number == 1;
    } else if constexpr (std::is_enum_v<T>) {
      std::underlying_type_t<T> number{};
      raw(&number, 1);
      if (number < 0 || number > static_cast<std::underlying_type_t<T>>(kLastOf<T>)) damaged();
      value = static_cast<T>(number);
    } else if constexpr (std::is_arithmetic_v<T>) {
      raw(&value, 1);
    } else {
      take(value);
    }
  }
  /// There is nothing after it.
  void end() const {
    if (!left_.empty()) damaged();
  }
  [[noreturn]] void damaged() const {
    throw InputError(fmt::format("{}: the bytes are damaged: what they hold is no value of its kind; take others", name_));
  }

 private:
  template <class T>
  void raw(T* values, std::size_t count) {
    if (count > left_.size() / sizeof(T)) damaged();
    if (count == 0) return;
    std::memcpy(values, left_.data(), count * sizeof(T));
    left_.remove_prefix(count * sizeof(T));
  }
  /// How many come: each takes a byte at least.
  std::size_t count(std::size_t bytes_of_each = 1) {
    std::uint64_t number = 0;
    raw(&number, 1);
    if (number > left_.size() / bytes_of_each) damaged();
    return static_cast<std::size_t>(number);
  }

  void take(std::string& text) {
    text.resize(count());
    raw(text.data(), text.size());
  }
  template <class T>
  void take(std::vector<T>& list) {
    list.clear();
    if constexpr (std::is_arithmetic_v<T>) {
      list.resize(count(sizeof(T)));
      raw(list.data(), list.size());
    } else {
      for (std::size_t left = count(); left > 0; --left) read(list.emplace_back());
    }
  }
  template <class T, std::size_t Count>
  void take(std::array<T, Count>& list) {
    for (T& entry : list) read(entry);
  }
  template <class T>
  void take(std::optional<T>& value) {
    bool there = false;
    read(there);
    value.reset();
    if (there) read(value.emplace());
  }
  template <class T>
  void take(std::shared_ptr<const T>& value) {
    bool there = false;
    read(there);
    value.reset();
    if (!there) return;
    auto own = std::make_shared<T>();
    read(*own);
    value = std::move(own);
  }
  template <class First, class Second>
  void take(std::pair<First, Second>& two) {
    read(two.first);
    read(two.second);
  }
  template <class T>
  void take(std::unordered_map<std::string, T>& map) {
    map.clear();
    for (std::size_t left = count(); left > 0; --left) {
      std::pair<std::string, T> entry;
      read(entry);
      map.insert(std::move(entry));
    }
  }
  template <class T, int Components>
  void take(Field<T, Components>& field) {
    const std::size_t rows = count(sizeof(T) * Components);
    if (rows > static_cast<std::size_t>(std::numeric_limits<Index>::max())) damaged();
    field.allocate(static_cast<Index>(rows));
    raw(field.flat().data(), field.flat().size());
  }
  template <class T>
  void take(T& structure) {
    each_member(structure, [this](auto& member) { this->read(member); });
  }

  std::string_view left_;
  const std::string& name_;
};

/// A line that says what the bytes are, the bytes, and the sum of both.
std::string sealed(std::string_view line, std::string_view bytes);

/// The bytes of what was sealed. kind: how the line begins, whatever the version. Throws InputError for what is no such thing, another
/// version, and bytes that are not those that were sealed; `what`: "scene".
std::string_view unsealed(std::string_view line, std::string_view kind, std::string_view what, std::string_view bytes,
                          const std::string& name);

}  // namespace linden
