// engine/view/glb.hpp
// A binary glTF file under construction: lists of its JSON, the parts of its binary chunk, and how both become the bytes of one file.
//
// The JSON is made first, of what is known of the numbers before they are written; then the numbers go straight to where they stay.
//
//   GLB file    header "glTF", version 2, length;  chunk JSON, padded by spaces to 4 bytes;  chunk BIN, likewise by zeros; all uint32
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace linden {

/// Bytes that a file may still have.
class GlbRoom {
 public:
  /// refusal: what is said where more are asked for.
  GlbRoom(std::uint64_t bytes, std::string refusal) : left_(bytes), refusal_(std::move(refusal)) {}
  /// Throws std::runtime_error.
  void take(std::uint64_t bytes);

 private:
  std::uint64_t left_;
  std::string refusal_;
};

/// An array of the JSON, as text: values of a motion of 10,000 bodies that are kept as nlohmann has them take ten times the memory.
class GlbList {
 public:
  explicit GlbList(GlbRoom& room) : room_(&room) {}
  /// Returns its index.
  std::size_t add(const nlohmann::ordered_json& entry);
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  /// Appends `"key":[...]` and a comma before it; nothing where the array is empty, which glTF does not allow.
  void append_to(std::string& json, const char* key) const;

 private:
  GlbRoom* room_;
  std::string text_;
  std::size_t size_ = 0;
};

/// Bytes that are no UTF-8 are U+FFFD.
std::string json_text(const nlohmann::ordered_json& entry);
/// A name without control characters: they become U+FFFD.
std::string plain_name(std::string_view name);

/// The numbers of the binary chunk, all of 4 bytes: accessors say what they are, buffer views what they are for. They lie in the file one
/// view after the other, in the order of their first accessors, and within a view in the order of its accessors.
class GlbNumbers {
 public:
  enum View : std::size_t { vertices, corners, motion, views };
  enum class Component : int { corner = 5125, real = 5126 };  // unsigned int, float: numbers of the specification

  explicit GlbNumbers(GlbRoom& room) : room_(&room), accessors_(room) {}
  /// `count` elements: of "SCALAR" one number, of "VEC3" three, of "VEC4" four. bounds: "min" and "max", where glTF asks for them. Returns
  /// the index of the accessor.
  std::size_t add(View view, Component component, const char* type, std::uint64_t count, const nlohmann::ordered_json& bounds);
  std::uint64_t bytes() const;
  void append_to(std::string& json) const;

 private:
  GlbRoom* room_;
  GlbList accessors_;
  std::vector<View> order_;
  std::array<std::uint64_t, views> bytes_{};
};

/// Bytes of a file with so many of JSON and so many of numbers (a multiple of 4; 0: no such chunk).
std::uint64_t glb_length(std::uint64_t json, std::uint64_t binary);
/// The file but for its numbers, with memory for them: they are to be appended.
std::string glb_head(std::string json, std::uint64_t binary);

/// Bytes of numbers as they are in memory.
template <class Number>
void append_as_it_is(std::string& file, std::span<const Number> numbers) {
  file.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
}

}  // namespace linden
