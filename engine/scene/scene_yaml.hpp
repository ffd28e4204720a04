// engine/scene/scene_yaml.hpp
// The values of a YAML file, each knowing its place, so that whatever is wrong is said with file and line.
//
//   once a SceneYaml stands                          else InputError
//   the text is one YAML document, not empty         syntax errors, tabs, control characters, a second document
//   every key is plain text and there once           a list or nothing for a key; a key twice (YAML readers keep one silently)
//   it is no deeper than kMostLevels and holds no    aliases that multiply, a file of some megabytes
//     more than kMostValues, aliases written out
//   values have no tags                              !!python/object and the like
//
// A SceneValue is a view into a SceneYaml, which must outlive it. Every message is `file:line: what was found; what was expected;
// what to do`, on one line; of values that no file holds, made by a program, without `file:line: `. Numbers are read as in the "C" locale.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace linden {

struct YamlNode {
  enum class Kind : std::uint8_t { nothing, text, list, map };
  Kind kind = Kind::nothing;
  int line = 1;                   // 0: in no file
  std::string text;               // of a text
  std::vector<std::string> keys;  // of a map
  std::vector<int> key_lines;
  std::vector<std::shared_ptr<const YamlNode>> items;  // of a list or a map
  std::size_t count = 1;                               // of values: this one and all within
  int height = 1;                                      // levels: this one and the deepest within
};

class SceneValue {
 public:
  using Kind = YamlNode::Kind;
  struct Entry;

  SceneValue(const YamlNode& node, std::string path, int line, const std::string& file)
      : node_(&node), path_(std::move(path)), line_(line), file_(&file) {}

  Kind kind() const { return node_->kind; }
  bool is(Kind kind) const { return node_->kind == kind; }
  /// Where it is, for people: "effects.spring.knee".
  const std::string& path() const { return path_; }
  /// "file:line: path", for warnings.
  std::string place() const;

  /// Throws InputError for this place.
  [[noreturn]] void fail(const std::string& found, std::string_view expected, std::string_view advice) const;
  /// The same; the path and what stands there are what was found.
  [[noreturn]] void refuse(std::string_view expected, std::string_view advice) const;
  /// What `action` returns; an InputError of its own gets file and line in front.
  template <class Action>
  auto located(const Action& action) const;

  /// A finite number; `expected` where more than numbers may stand here.
  double number(std::string_view expected = "a finite number") const;
  double positive() const;
  double not_negative(std::string_view expected = "zero or more") const;
  int integer(int least, int most) const;
  std::vector<double> numbers() const;
  std::vector<double> numbers(std::size_t count, std::string_view expected) const;
  std::array<double, 3> vector(std::string_view expected) const;
  /// Unit quaternion x y z w.
  std::array<double, 4> quaternion() const;
  /// Text that is not empty.
  const std::string& text(std::string_view expected) const;
  /// Whether it is text that reads so.
  bool says(std::string_view word) const { return is(Kind::text) && node_->text == word; }
  /// One of the words.
  const std::string& choice(std::span<const std::string> words) const;

  /// Items of a list; `expected` says of what.
  std::vector<SceneValue> list(std::string_view expected) const;
  /// Entries of a map in the order of the file; `expected` says of what.
  std::vector<Entry> entries(std::string_view expected) const;
  /// The same where only these keys may be. `elsewhere`: keys that belong to another place, said by its name.
  std::vector<Entry> entries_of(std::span<const std::string> known, std::span<const std::string> elsewhere = {},
                                std::string_view place = {}) const;
  /// What the key holds; nothing where it is not there, or no map is here.
  std::optional<SceneValue> find(std::string_view key) const;

 private:
  std::string path_to(std::string_view key) const;
  void rethrow(const char* message) const;

  const YamlNode* node_;
  std::string path_;
  int line_;  // of its key, where it has one
  const std::string* file_;
};

struct SceneValue::Entry {
  std::string key;
  SceneValue value;
};

/// A whole file.
class SceneYaml {
 public:
  static constexpr int kMostLevels = 16;
  static constexpr std::size_t kMostValues = 1'000'000, kMostBytes = 16 << 20;

  /// `file` stands for the source in messages.
  SceneYaml(const std::string& text, std::string file);
  /// Values that no file holds, each of line 0.
  explicit SceneYaml(std::shared_ptr<const YamlNode> root) : root_(std::move(root)) {}
  SceneValue root() const { return {*root_, "", root_->line, file_}; }
  const std::string& file() const { return file_; }

 private:
  std::string file_;
  std::shared_ptr<const YamlNode> root_;
};

}  // namespace linden

#include "layout/support/input_error.hpp"

namespace linden {

template <class Action>
auto SceneValue::located(const Action& action) const {
  try {
    return action();
  } catch (const InputError& error) {
    rethrow(error.what());
    throw;
  }
}

}  // namespace linden
