#include "engine/scene/scene_yaml.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <unordered_map>
#include <unordered_set>

#include "layout/support/words.hpp"

namespace linden {
namespace {

using Kind = YamlNode::Kind;

/// "file:line: "; nothing where there is no file.
std::string place_of_line(const std::string& file, int line) { return line == 0 ? "" : fmt::format("{}:{}: ", file, line); }

[[noreturn]] void fail_at(const std::string& file, int line, const std::string& found, std::string_view expected,
                          std::string_view advice) {
  throw InputError(fmt::format("{}{}; expected {}; {}", place_of_line(file, line), found, expected, advice));
}

/// Builds the tree of values from the parser's events.
class Builder : public YAML::EventHandler {
 public:
  explicit Builder(const std::string& file) : file_(file) {}

  const std::shared_ptr<YamlNode>& root() const { return root_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (root_)
      fail_at(file_, line_of(mark), "a second document begins", "one scene a file",
              "leave out the ---, or make it a file of its own");
  }
  void OnDocumentEnd() override {}
  void OnAnchor(const YAML::Mark&, const std::string&) override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (expects_key()) fail_at(file_, line_of(mark), "a key is missing before a colon", "key: value", "name it");
    put(made(mark, Kind::nothing), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (expects_key()) refuse_key(mark);
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end())
      fail_at(file_, line_of(mark), "an alias stands within what it names", "plain values", "write it out");
    add(found->second, line_of(mark));
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, const std::string& value) override {
    refuse_tag(mark, tag);
    if (expects_key()) {
      Open& map = open_.back();
      if (!map.seen.insert(value).second) {
        fail_at(file_, line_of(mark), fmt::format("the key {} is here for the second time", quoted(value)), "every key once",
                "keep the one that is meant");
      }
      map.key = value;
      map.key_line = line_of(mark);
      map.has_key = true;
      return;
    }
    std::shared_ptr<YamlNode> node = made(mark, Kind::text);
    node->text = value;
    put(node, anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    begin(mark, tag, anchor, Kind::list);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, YAML::EmitterStyle::value) override {
    begin(mark, tag, anchor, Kind::map);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapEnd() override { end(); }

 private:
  /// A list or map that is not complete yet.
  struct Open {
    std::shared_ptr<YamlNode> node;
    YAML::anchor_t anchor;
    std::unordered_set<std::string> seen;
    std::string key;
    int key_line = 0;
    bool has_key = false;
  };

  static int line_of(const YAML::Mark& mark) { return std::max(mark.line, 0) + 1; }
  bool expects_key() const { return !open_.empty() && open_.back().node->kind == Kind::map && !open_.back().has_key; }

  [[noreturn]] void refuse_key(const YAML::Mark& mark) const {
    fail_at(file_, line_of(mark), "a key is no plain text", "key: value", "write the name itself");
  }
  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (tag.empty() || tag == "?" || tag == "!") return;
    fail_at(file_, line_of(mark), fmt::format("the tag {}", quoted(tag)), "values without tags", "leave the tag out");
  }

  std::shared_ptr<YamlNode> made(const YAML::Mark& mark, Kind kind) const {
    auto node = std::make_shared<YamlNode>();
    node->kind = kind;
    node->line = line_of(mark);
    return node;
  }

  void begin(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, Kind kind) {
    refuse_tag(mark, tag);
    if (expects_key()) refuse_key(mark);
    require_levels(static_cast<int>(open_.size()) + 1, line_of(mark));
    open_.push_back({made(mark, kind), anchor, {}, {}, 0, false});
  }

  void end() {
    const Open done = std::move(open_.back());
    open_.pop_back();
    put(done.node, done.anchor);
  }

  void put(const std::shared_ptr<YamlNode>& node, YAML::anchor_t anchor) {
    if (anchor != 0) anchored_[anchor] = node;
    add(node, node->line);
  }

  void add(const std::shared_ptr<YamlNode>& node, int line) {
    if (open_.empty()) {
      root_ = node;
      return;
    }
    Open& into = open_.back();
    require_levels(static_cast<int>(open_.size()) + node->height, line);
    into.node->height = std::max(into.node->height, node->height + 1);
    into.node->count += node->count;
    if (into.node->count > SceneYaml::kMostValues) {
      fail_at(file_, line, fmt::format("more than {} values, aliases written out", SceneYaml::kMostValues), "a scene of fewer",
              "put long tables into files of their own");
    }
    into.node->items.push_back(node);
    if (into.node->kind != Kind::map) return;
    into.node->keys.push_back(std::move(into.key));
    into.node->key_lines.push_back(into.key_line);
    into.has_key = false;
  }

  void require_levels(int levels, int line) const {
    if (levels <= SceneYaml::kMostLevels) return;
    fail_at(file_, line, fmt::format("lists and maps {} levels deep", levels), fmt::format("{} at most", SceneYaml::kMostLevels),
            "look for a bracket that is not closed");
  }

  const std::string& file_;
  std::vector<Open> open_;
  std::unordered_map<YAML::anchor_t, std::shared_ptr<YamlNode>> anchored_;
  std::shared_ptr<YamlNode> root_;
};

/// The parser takes some control characters for the end of the file or for another encoding.
void refuse_control_characters(const std::string& text, const std::string& file) {
  int line = 1;
  for (const char c : text) {
    if (c == '\n') ++line;
    const auto code = static_cast<unsigned char>(c);
    if (code >= ' ' || c == '\n' || c == '\r' || c == '\t') continue;
    fail_at(file, line, fmt::format("the control character {:#04x}", code), "plain text in UTF-8",
            "make sure that this is a scene");
  }
}

int line_count(const std::string& text) {
  return std::max(1, static_cast<int>(std::ranges::count(text, '\n')) + (text.ends_with('\n') ? 0 : 1));
}

/// The first line from 1 to `last` that is indented by a tab; 0 where there is none.
int line_with_tab(const std::string& text, int last) {
  int line = 1;
  for (std::size_t begin = 0; begin < text.size() && line <= last; ++line) {
    const std::size_t content = std::min(text.find_first_not_of(" \t", begin), text.size());
    if (text.find('\t', begin) < content) return line;
    begin = std::min(text.find('\n', begin), text.size() - 1) + 1;
  }
  return 0;
}

std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' '; }, ' ');
  return text;
}

std::string described(const YamlNode& node) {
  switch (node.kind) {
    case Kind::nothing: return "nothing";
    case Kind::text: return quoted(node.text);
    case Kind::list: return fmt::format("a list of {}", node.items.size());
    case Kind::map: return node.keys.empty() ? "an empty map" : fmt::format("a map with the key {}", quoted(node.keys.front()));
  }
  return "";
}

}  // namespace

SceneYaml::SceneYaml(const std::string& text, std::string file) : file_(std::move(file)) {
  if (text.size() > kMostBytes) {
    fail_at(file_, 1, fmt::format("a file of {} bytes", text.size()), fmt::format("a scene of {} at most", kMostBytes),
            "put long tables into files of their own");
  }
  refuse_control_characters(text, file_);
  // the end of a document ends what a missing quotation mark would let run on
  std::istringstream stream(text + "\n...\n");
  Builder builder(file_);
  try {
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) continue;
  } catch (const YAML::Exception& error) {
    const int line = std::max(error.mark.line, 0) + 1;
    if (const int tab = line_with_tab(text, line); tab > 0) {
      fail_at(file_, tab, "this is no YAML: a tab begins the line", "spaces before a key", "replace the tab by spaces");
    }
    fail_at(file_, std::min(line, line_count(text)), "this is no YAML: " + one_line(error.msg), "key: value",
            "check indentation, colons, quotes and brackets here and above");
  }
  root_ = builder.root();
  if (!root_ || root_->kind == Kind::nothing)
    fail_at(file_, 1, "the file is empty", "a scene", "begin with model: and a file or chain:3");
}

void SceneValue::fail(const std::string& found, std::string_view expected, std::string_view advice) const {
  fail_at(*file_, line_, found, expected, advice);
}

void SceneValue::refuse(std::string_view expected, std::string_view advice) const {
  fail(path_.empty() ? "the file holds " + described(*node_) : fmt::format("{} is {}", path_, described(*node_)), expected,
       advice);
}

std::string SceneValue::path_to(std::string_view key) const {
  // as in messages: on one line, and short, since every value below holds it
  const std::string text = quoted(key);
  return fmt::format("{}{}{}", path_, path_.empty() ? "" : ".", std::string_view(text).substr(1, text.size() - 2));
}

std::string SceneValue::place() const { return place_of_line(*file_, line_) + path_; }

void SceneValue::rethrow(const char* message) const {
  throw InputError(fmt::format("{}{}{}{}", place_of_line(*file_, line_), path_, path_.empty() ? "" : ": ", message));
}

double SceneValue::number(std::string_view expected) const {
  const std::optional<double> value = is(Kind::text) ? number_in(node_->text) : std::nullopt;
  if (!value) refuse(expected, "write for example 0.5 or 1e-3");
  return *value;
}

double SceneValue::positive() const {
  const double value = number();
  if (!(value > 0)) refuse("a number above zero", "change it");
  return value;
}

double SceneValue::not_negative(std::string_view expected) const {
  const double value = number(expected == "zero or more" ? "a finite number" : expected);
  if (value < 0) refuse("zero or more", "change its sign");
  return value;
}

int SceneValue::integer(int least, int most) const {
  const double value = number();
  if (value != std::floor(value) || value < least || value > most)
    refuse(fmt::format("a whole number from {} to {}", least, most), "change it");
  return static_cast<int>(value);
}

std::vector<double> SceneValue::numbers() const {
  std::vector<double> values;
  for (const SceneValue& item : list("numbers")) values.push_back(item.number());
  return values;
}

std::vector<double> SceneValue::numbers(std::size_t count, std::string_view expected) const {
  if (!is(Kind::list) || node_->items.size() != count)
    refuse(expected, fmt::format("write [{}", count == 2 ? "0, 0]" : count == 3 ? "0, 0, 1]" : "0, 0, 0, 1]"));
  return numbers();
}

std::array<double, 3> SceneValue::vector(std::string_view expected) const {
  const std::vector<double> values = numbers(3, expected);
  return {values[0], values[1], values[2]};
}

std::array<double, 4> SceneValue::quaternion() const {
  const std::vector<double> values = numbers(4, "a quaternion [x, y, z, w]");
  const double length = std::hypot(std::hypot(values[0], values[1]), std::hypot(values[2], values[3]));
  if (!(length > 1e-6) || !std::isfinite(length)) {
    fail(fmt::format("{} has length {:.3g}", path_, length), "a unit quaternion x y z w", "write [0, 0, 0, 1] for no turn");
  }
  return {values[0] / length, values[1] / length, values[2] / length, values[3] / length};
}

const std::string& SceneValue::text(std::string_view expected) const {
  if (!is(Kind::text) || node_->text.empty()) refuse(expected, "write it after the colon");
  return node_->text;
}

const std::string& SceneValue::choice(std::span<const std::string> words) const {
  const std::string expected = fmt::format("one of {}", fmt::join(words, ", "));
  const std::string& word = text(expected);
  if (std::ranges::find(words, word) != words.end()) return word;
  const std::string guess = nearest(word, words);
  refuse(expected, guess.empty() ? "choose one" : fmt::format("did you mean {}?", guess));
}

std::vector<SceneValue> SceneValue::list(std::string_view expected) const {
  if (!is(Kind::list)) refuse(fmt::format("a list of {}", expected), "write it in brackets, [ , ], or a line each after a dash");
  std::vector<SceneValue> values;
  for (std::size_t k = 0; k < node_->items.size(); ++k) {
    values.emplace_back(*node_->items[k], fmt::format("{}[{}]", path_, k), node_->items[k]->line, *file_);
  }
  return values;
}

std::vector<SceneValue::Entry> SceneValue::entries(std::string_view expected) const {
  if (!is(Kind::map)) refuse(expected, "write key: value lines, indented, or { key: value }");
  std::vector<Entry> values;
  for (std::size_t k = 0; k < node_->items.size(); ++k) {
    values.push_back({node_->keys[k], {*node_->items[k], path_to(node_->keys[k]), node_->key_lines[k], *file_}});
  }
  return values;
}

std::vector<SceneValue::Entry> SceneValue::entries_of(std::span<const std::string> known, std::span<const std::string> elsewhere,
                                                      std::string_view place) const {
  const std::string expected = fmt::format("{}", fmt::join(known, ", "));
  std::vector<Entry> values = entries("a map of " + expected);
  for (const auto& [key, value] : values) {
    if (std::ranges::find(known, key) != known.end()) continue;
    const std::string guess = nearest(key, known);
    const bool misplaced = std::ranges::find(elsewhere, key) != elsewhere.end();
    value.fail(fmt::format("the key {}{} is not known", quoted(key), path_.empty() ? "" : " of " + path_), expected,
               misplaced       ? fmt::format("write it below {}", place)
               : guess.empty() ? std::string("leave it out")
                               : fmt::format("did you mean {}?", guess));
  }
  return values;
}

std::optional<SceneValue> SceneValue::find(std::string_view key) const {
  if (!is(Kind::map)) return std::nullopt;
  const auto found = std::ranges::find(node_->keys, key);
  if (found == node_->keys.end()) return std::nullopt;
  const auto k = static_cast<std::size_t>(found - node_->keys.begin());
  return SceneValue(*node_->items[k], path_to(key), node_->key_lines[k], *file_);
}

}  // namespace linden
