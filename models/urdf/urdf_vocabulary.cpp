#include "models/urdf/urdf_vocabulary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "layout/support/words.hpp"
#include "models/urdf/urdf_loops.hpp"

namespace linden {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;
using enum UrdfUse;
using enum UrdfCount;

// clang-format off
constexpr auto kVocabulary = std::to_array<UrdfElement>({
    // name               parents                            use        count       attributes                     attributes that are lost
    {"robot",             "",                                moves,     one,        "name version xmlns xmlns:* xsi:*", ""},
    {"link",              "robot",                           moves,     many,       "name type",                   ""},
    {"joint",             "robot",                           moves,     many,       "name type dont_collapse",     ""},
    {"inertial",          "link",                            moves,     one,        "",                            ""},
    {"origin",            "joint inertial collision visual", moves,     one,        "xyz rpy",                     ""},
    {"mass",              "inertial",                        moves,     one,        "value",                       ""},
    {"inertia",           "inertial",                        moves,     one,        "ixx iyy izz ixy ixz iyz",     ""},
    {"parent",            "joint",                           moves,     one,        "link",                        ""},
    {"child",             "joint",                           moves,     one,        "link",                        ""},
    {"axis",              "joint",                           moves,     one,        "xyz",                         ""},
    {"limit",             "joint",                           moves,     one,        "lower upper effort velocity",
     "acceleration jerk drake:*"},
    {"dynamics",          "joint",                           moves,     one,        "damping friction",
     "armature rotor_inertia gear_ratio stiffness spring_stiffness spring_reference K D mu_coulomb mu_viscous drake:*"},
    {"mimic",             "joint",                           moves,     one,        "joint multiplier offset",     ""},
    {"collision",         "link",                            moves,     many,       "name group",                  ""},
    {"geometry",          "collision visual",                moves,     one,        "name",                        ""},
    {"sphere",            "geometry",                        moves,     one_of_all, "radius",                      ""},
    {"box",               "geometry",                        moves,     one_of_all, "size",                        ""},
    {"cylinder",          "geometry",                        moves,     one_of_all, "radius length",               ""},
    {"capsule",           "geometry",                        moves,     one_of_all, "radius length",               ""},
    {"mesh",              "geometry",                        moves,     one_of_all, "filename scale",              ""},

    {"visual",            "link",                            no_motion, many,       "name group",                  ""},
    {"material",          "robot visual collision",          no_motion, many,       "name",                        ""},
    {"color",             "material",                        no_motion, one,        "rgba",                        ""},
    {"texture",           "material",                        no_motion, one,        "filename",                    ""},
    {"verbose",           "collision",                       no_motion, one,        "value",                       ""},
    {"calibration",       "joint",                           no_motion, one,        "rising falling reference_position", ""},
    {"safety_controller", "joint",                           no_motion, one,
     "soft_lower_limit soft_upper_limit k_position k_velocity", ""},

    {"loop_joint",        "robot",                           loops,     many,       "",                            ""},
    {"loop",              "robot",                           loops,     many,       "",                            ""},
    {"drake:ball_constraint",    "robot",                    loops,     many,       "",                            ""},
    {"drake:linear_spring_damper", "robot",                  loops,     many,       "",                            ""},
    {"drake:linear_bushing_rpy", "robot",                    loops,     many,       "",                            ""},

    {"coupling",          "robot",                           lost,      many,       "",                            ""},
    {"cable",             "robot",                           lost,      many,       "",                            ""},
    {"force_element",     "robot",                           lost,      many,       "",                            ""},
    {"spring",            "robot joint",                     lost,      many,       "",                            ""},
    {"traits",            "joint",                           lost,      many,       "",                            ""},
    {"joint_properties",  "joint",                           lost,      many,       "",                            ""},
    {"drake:tendon_constraint",  "robot",                    lost,      many,       "",                            ""},
    {"drake:mimic",       "joint",                           lost,      many,       "",                            ""},
    {"contact",           "link",                            lost,      many,       "",                            ""},
    {"gravity",           "link",                            lost,      many,       "",                            ""},
    {"ellipsoid",         "geometry",                        lost,      many,       "",                            ""},
    {"plane",             "geometry",                        lost,      many,       "",                            ""},

    {"gazebo",            "robot link joint",                others,    many,       "",                            ""},
    {"transmission",      "robot",                           others,    many,       "",                            ""},
    {"actuator",          "robot joint",                     others,    many,       "",                            ""},
    {"hardwareInterface", "joint",                           others,    many,       "",                            ""},
    {"ros2_control",      "robot",                           others,    many,       "",                            ""},
    {"sensor",            "robot link joint",                others,    many,       "",                            ""},
    {"sensor:*",          "robot link joint",                others,    many,       "",                            ""},
    {"controller:*",      "robot link joint",                others,    many,       "",                            ""},
    {"controller_gains",  "joint",                           others,    many,       "",                            ""},
    {"drake:*",           "*",                               others,    many,       "",                            ""},
    {"mujoco",            "robot",                           others,    many,       "",                            ""},
    {"frame",             "robot",                           others,    many,       "",                            ""},
    {"collision_filter_group", "robot",                      others,    many,       "",                            ""},
    {"disable_collisions", "robot",                          others,    many,       "",                            ""},
    {"self_collision_checking", "link",                      others,    many,       "",                            ""},
    {"collision_checking", "link",                           others,    many,       "",                            ""},
    {"self_filter",       "link",                            others,    many,       "",                            ""},

    {"xacro:*",           "*",                               macro,     many,       "",                            ""},
});

/// What other formats call the same: theirs, ours.
constexpr auto kOtherWords = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"pos", "xyz"}, {"position", "xyz"}, {"translation", "xyz"}, {"euler", "rpy"}, {"rotation", "rpy"}, {"orientation", "rpy"},
    {"quat", "rpy"}, {"quat_xyzw", "rpy"}, {"min", "lower"}, {"max", "upper"}, {"range", "limit"}, {"limits", "limit"},
    {"pose", "origin"}, {"transform", "origin"}, {"body", "link"}, {"geom", "collision"}, {"frictionloss", "friction"},
    {"file", "filename"}, {"uri", "filename"}, {"izy", "iyz"}, {"izx", "ixz"}, {"iyx", "ixy"},
});
// clang-format on

/// So many are found words for, one by one: a word that is not known is compared with all that are.
constexpr std::size_t kMostFindings = 1000;
constexpr const char* kWithout = "the robot moves as if it were not there";
constexpr std::size_t kRows = kVocabulary.size();

/// True where the word is the pattern, or begins with all of it before its "*".
bool fits(std::string_view word, std::string_view pattern) {
  return pattern.ends_with('*') ? word.starts_with(pattern.substr(0, pattern.size() - 1)) : word == pattern;
}

/// The table with its lists cut into words.
struct Row {
  const UrdfElement* element = nullptr;
  std::vector<std::string_view> parents, attributes, lost;

  bool holds(const Row& child) const {
    return std::ranges::any_of(child.parents, [&](std::string_view parent) { return fits(element->name, parent); });
  }
  static bool lists(const std::vector<std::string_view>& patterns, std::string_view word) {
    return std::ranges::any_of(patterns, [&](std::string_view pattern) { return fits(word, pattern); });
  }
};

class Vocabulary {
 public:
  static const Vocabulary& instance() {
    static const Vocabulary vocabulary;
    return vocabulary;
  }

  const Row& robot() const { return rows_.front(); }
  const std::array<Row, kRows>& rows() const { return rows_; }
  std::size_t index(const Row& row) const { return static_cast<std::size_t>(&row - rows_.data()); }

  /// Null for a word that is not known.
  const Row* find(std::string_view name) const {
    if (const auto found = exact_.find(name); found != exact_.end()) return &rows_[found->second];
    const auto found = std::ranges::find_if(rows_, [&](const Row& row) { return fits(name, row.element->name); });
    return found == rows_.end() ? nullptr : &*found;
  }

 private:
  Vocabulary() {
    for (std::size_t k = 0; k < kRows; ++k) {
      const UrdfElement& element = kVocabulary[k];
      rows_[k] = {&element, words_of(element.parents), words_of(element.attributes), words_of(element.lost)};
      exact_.emplace(element.name, k);
    }
  }

  std::array<Row, kRows> rows_;
  std::unordered_map<std::string_view, std::size_t> exact_;
};

/// A word of the file, cut where it is long.
std::string shown(std::string_view word) {
  const std::string marked = quoted(word);
  return marked.substr(1, marked.size() - 2);
}

/// The word that is meant: what another format's word is called here, or the nearest, whether letters are large or small; else empty.
std::string meant_by(std::string_view word, const std::vector<std::string>& known) {
  std::string small(word);
  std::ranges::transform(small, small.begin(), [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  for (const auto& [theirs, ours] : kOtherWords) {
    if (theirs == small && std::ranges::find(known, ours) != known.end()) return std::string(ours);
  }
  return nearest(small, known);
}

/// "a, b or c"
std::string alternatives(const std::vector<std::string>& words) {
  std::string result;
  for (std::size_t k = 0; k < words.size(); ++k) {
    result += (k == 0 ? "" : k + 1 == words.size() ? " or " : ", ") + words[k];
  }
  return result;
}

class Walk {
 public:
  explicit Walk(UrdfReport& report) : report_(report) {}

  void run(const XMLElement& robot) {
    frames_of_bushings_ = frames_of_bushings(robot);
    look_at(robot, vocabulary_.robot(), nullptr);
    tell_findings();
    tell_others();
  }

 private:
  struct Words {
    std::string what, advice;
  };
  /// What was found first, and how often.
  struct Finding {
    int line, last_line;
    std::string what, advice;
    int count = 0;
  };
  struct Extension {
    int line, count = 0;
  };

  /// An element that is known and in its place. `owner`: the link or joint that it is part of.
  void look_at(const XMLElement& element, const Row& row, const XMLElement* owner) {
    const bool names_its_parts = row.parents.size() == 1 && row.parents[0] == "robot" && element.Attribute("name");
    if (names_its_parts) owner = &element;
    look_at_attributes(element, row, owner);
    std::array<const XMLElement*, kRows> first{};
    const XMLElement* first_of_all = nullptr;
    for (const tinyxml2::XMLNode* node = element.FirstChild(); node; node = node->NextSibling()) {
      if (node->ToText()) look_at_text(*node, element, owner);
      const XMLElement* child = node->ToElement();
      if (!child) continue;
      const Row* child_row = vocabulary_.find(child->Name());
      if (child_row && child_row->element->use == macro) refuse_macro(*child);
      if (!child_row) {
        refuse_macros_within(*child);
        tell(*child, "unknown", row, "", owner, [&] { return of_unknown_element(*child, row); });
      } else if (!row.holds(*child_row)) {
        refuse_macros_within(*child);
        tell_misplaced(*child, element, *child_row, owner);
      } else if (child_row->element->use == lost) {
        refuse_macros_within(*child);
        const auto words = [&] { return Words{fmt::format("known but not simulated: <{}>", shown(child->Name())), kWithout}; };
        tell(*child, "lost", row, "", owner, words);
      } else if (child_row->element->use == loops) {
        refuse_macros_within(*child);
      } else if (child_row->element->use == others) {
        refuse_macros_within(*child);
        if (row.element->name == "robot" && (holds_joints_only(*child) || frames_of_bushings_.contains(child))) continue;
        const auto at = extensions_.try_emplace(shown(child->Name()), Extension{child->GetLineNum()}).first;
        at->second.count += 1;
      } else {
        const bool alternative = child_row->element->count == one_of_all;
        const XMLElement*& before = alternative ? first_of_all : first[vocabulary_.index(*child_row)];
        if (before && child_row->element->count != many) tell_repeated(*child, *before, element, row, owner);
        if (!before) before = child;
        look_at(*child, *child_row, owner);
      }
    }
  }

  void look_at_attributes(const XMLElement& element, const Row& row, const XMLElement* owner) {
    std::string lost_words;
    int lost_line = 0;
    for (const XMLAttribute* attribute = element.FirstAttribute(); attribute; attribute = attribute->Next()) {
      const std::string_view name = attribute->Name();
      refuse_macro_in(*attribute, element);
      if (Row::lists(row.attributes, name)) continue;
      if (Row::lists(row.lost, name)) {
        if (lost_words.empty()) lost_line = attribute->GetLineNum();
        lost_words += (lost_words.empty() ? "" : ", ") + shown(name);
        continue;
      }
      tell(element, "unknown", row, name, owner, [&] { return of_unknown_attribute(*attribute, element, row); }, attribute->GetLineNum());
    }
    if (lost_words.empty()) return;
    const auto words = [&] { return Words{fmt::format("known but not simulated: {} of <{}>", lost_words, element.Name()), kWithout}; };
    tell(element, "lost", row, lost_words, owner, words, lost_line);
  }

  Words of_unknown_attribute(const XMLAttribute& attribute, const XMLElement& element, const Row& row) const {
    std::vector<std::string> known;
    for (const std::string_view word : row.attributes) {
      if (!word.ends_with('*')) known.emplace_back(word);
    }
    const std::string what =
        fmt::format("<{}> has {}={}, which is not known and not used", element.Name(), shown(attribute.Name()), quoted(attribute.Value()));
    if (const std::string meant = meant_by(attribute.Name(), known); !meant.empty()) return {what, fmt::format("did you mean {}?", meant)};
    if (const std::string meant = meant_by(attribute.Name(), elements_of(row)); !meant.empty()) {
      return {what, fmt::format("did you mean <{}> within it?", meant)};
    }
    return {what, known.empty() ? fmt::format("<{}> has no attributes", element.Name())
                                : fmt::format("<{}> has {}", element.Name(), alternatives(known))};
  }

  void look_at_text(const tinyxml2::XMLNode& text, const XMLElement& element, const XMLElement* owner) {
    if (words_of(text.Value()).empty()) return;
    const auto words = [&] {
      return Words{fmt::format("the text {} within <{}> is not read", quoted(text.Value()), element.Name()),
                   "URDF has its numbers and names in attributes"};
    };
    tell(element, "text", *vocabulary_.find(element.Name()), "", owner, words, text.GetLineNum());
  }

  /// What the vocabulary lets an element hold.
  std::vector<std::string> elements_of(const Row& parent) const {
    std::vector<std::string> names;
    for (const Row& row : vocabulary_.rows()) {
      if (parent.holds(row) && !row.element->name.ends_with('*')) names.emplace_back(row.element->name);
    }
    return names;
  }

  Words of_unknown_element(const XMLElement& child, const Row& parent) const {
    std::vector<std::string> all, main, attributes(parent.attributes.begin(), parent.attributes.end());
    for (const Row& row : vocabulary_.rows()) {
      const UrdfElement& element = *row.element;
      if (!element.name.ends_with('*')) all.emplace_back(element.name);
      const bool read = element.use == moves || element.use == no_motion;
      if (read && parent.holds(row)) main.push_back(fmt::format("<{}>", element.name));
    }
    const std::string within = fmt::format("<{}>", parent.element->name);
    std::string advice = main.empty() ? within + " holds no elements" : fmt::format("{} may hold {}", within, alternatives(main));
    if (const std::string meant = meant_by(child.Name(), elements_of(parent)); !meant.empty()) {
      advice = fmt::format("did you mean <{}>?", meant);
    } else if (const std::string attribute = meant_by(child.Name(), attributes); !attribute.empty()) {
      advice = fmt::format("did you mean <{} {}=\"...\">?", parent.element->name, attribute);
    } else if (const std::string elsewhere = meant_by(child.Name(), all); !elsewhere.empty()) {
      advice = fmt::format("did you mean <{}>?", elsewhere);
    }
    return {fmt::format("<{}> is not known and not used", shown(child.Name())), advice};
  }

  void tell_misplaced(const XMLElement& child, const XMLElement& parent, const Row& row, const XMLElement* owner) {
    const auto words = [&] {
      std::vector<std::string> places;
      for (const std::string_view place : row.parents) places.push_back(fmt::format("<{}>", place));
      return Words{fmt::format("<{}> is not used within <{}>", shown(child.Name()), parent.Name()),
                   places.empty() ? "it is the outermost element" : "it belongs in " + alternatives(places)};
    };
    tell(child, "misplaced", *vocabulary_.find(parent.Name()), "", owner, words);
  }

  void tell_repeated(const XMLElement& child, const XMLElement& before, const XMLElement& parent, const Row& row,
                     const XMLElement* owner) {
    const auto words = [&] {
      const bool same = std::string_view(child.Name()) == before.Name();
      const std::string what = same ? fmt::format("a second <{}>", child.Name())
                                    : fmt::format("<{}> beside <{}>", child.Name(), before.Name());
      return Words{fmt::format("{} within <{}>", what, parent.Name()),
                   fmt::format("the first, in line {}, is used", before.GetLineNum())};
    };
    tell(child, "repeated", row, before.Name(), owner, words);
  }

  /// Adds what was found to what is equal to it, or begins anew with the words that `say` finds for it. `attribute` may be empty; `line` is
  /// the element's where it is not given.
  template <class Say>
  void tell(const XMLElement& element, std::string_view kind, const Row& place, std::string_view attribute, const XMLElement* owner,
            const Say& say, int line = 0) {
    if (line == 0) line = element.GetLineNum();
    std::string key = fmt::format("{} {} {} {}", kind, place.element->name, element.Name(), attribute);
    const bool too_many = findings_.size() >= kMostFindings && finding_of_.find(key) == finding_of_.end();
    if (too_many) key.clear();
    const auto [found, is_new] = finding_of_.try_emplace(std::move(key), findings_.size());
    if (is_new) {
      const std::string whose = owner ? fmt::format("{} {}: ", owner->Name(), quoted(owner->Attribute("name"))) : "";
      const auto [what, advice] = too_many ? Words{"something else that is not used", "correct the others first"} : say();
      findings_.push_back({line, line, whose + what, advice});
      const bool slipped = kind == "misplaced" || advice.starts_with("did you mean");
      if (slipped && report_.suspect.empty()) report_.suspect = fmt::format("line {}: {}; {}", line, whose + what, advice);
    }
    Finding& finding = findings_[found->second];
    finding.count += 1;
    finding.last_line = line;
  }

  void tell_findings() {
    for (const Finding& finding : findings_) {
      const std::string often = fmt::format(" ({} times, the last in line {})", finding.count, finding.last_line);
      report_.warn(finding.line, fmt::format("{}{}; {}", finding.what, finding.count == 1 ? "" : often, finding.advice));
    }
  }

  void tell_others() {
    constexpr std::size_t kShown = 20;
    if (extensions_.empty()) return;
    int line = extensions_.begin()->second.line;
    std::string list;
    std::size_t kinds = 0;
    for (const auto& [name, extension] : extensions_) {
      line = std::min(line, extension.line);
      if (++kinds <= kShown) list += fmt::format("{}{} <{}>", list.empty() ? "" : ", ", extension.count, name);
    }
    if (kinds > kShown) list += fmt::format(", and {} other kinds", kinds - kShown);
    report_.warn(line, fmt::format("known but not simulated: {}; other programs read them", list));
  }

  /// In what is not looked into for words.
  void refuse_macros_within(const XMLElement& element) {
    for (const XMLElement* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
      const Row* row = vocabulary_.find(child->Name());
      if (row && row->element->use == macro) refuse_macro(*child);
      refuse_macros_within(*child);
    }
  }

  void refuse_macro(const XMLElement& element) const { refuse(element.GetLineNum(), fmt::format("the macro <{}>", shown(element.Name()))); }

  void refuse_macro_in(const XMLAttribute& attribute, const XMLElement& element) const {
    if (std::string_view(attribute.Value()).find("${") == std::string_view::npos) return;
    refuse(attribute.GetLineNum(),
           fmt::format("<{}> has the macro {}={}", shown(element.Name()), shown(attribute.Name()), quoted(attribute.Value())));
  }

  [[noreturn]] void refuse(int line, const std::string& found) const {
    report_.suspect.clear();
    report_.fail(line, found, "plain URDF", fmt::format("expand the macros first: xacro {} > out.urdf", report_.source));
  }

  UrdfReport& report_;
  const Vocabulary& vocabulary_ = Vocabulary::instance();
  std::vector<Finding> findings_;  // in the order of the file
  std::unordered_map<std::string, std::size_t> finding_of_;
  std::map<std::string, Extension> extensions_;
  std::unordered_set<const XMLElement*> frames_of_bushings_;
};

}  // namespace

std::span<const UrdfElement> urdf_vocabulary() { return kVocabulary; }

void check_vocabulary(const XMLElement& robot, UrdfReport& report) { Walk(report).run(robot); }

}  // namespace linden
