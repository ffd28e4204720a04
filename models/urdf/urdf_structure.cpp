#include "models/urdf/urdf_structure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/urdf/urdf_vocabulary.hpp"
#include "models/urdf/xml_text.hpp"

namespace linden {
namespace {

using tinyxml2::XMLElement;

const char* complaint(tinyxml2::XMLError error) {
  switch (error) {
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT: return "the element here is not closed by its own tag";
    case tinyxml2::XML_ERROR_PARSING: return "the element here is never closed";
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE: return "an attribute is not name=\"value\", or is there twice";
    case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED: return "elements are nested more than 100 deep";
    default: return "the markup here is broken";
  }
}

/// Advice that names the nearest of the names where one is near.
std::string did_you_mean(std::string_view name, std::span<const std::string> names, const std::string& otherwise) {
  const std::string found = nearest(name, names);
  return found.empty() ? otherwise : fmt::format("did you mean {}?", quoted(found));
}

template <class Named>
std::vector<std::string> names_of(const std::vector<Named>& list) {
  std::vector<std::string> names;
  for (const Named& entry : list) names.push_back(entry.name);
  return names;
}

/// Walks up from every entry; each is visited once. Calls `found(entry, "a, b, c")` at a circle.
template <class Named, class Up, class Found>
void require_no_circle(const std::vector<Named>& list, const Up& up, const Found& found) {
  constexpr int kShown = 6;
  std::vector<int> walk(list.size(), -1);  // number of the walk that came by
  for (int start = 0; start < static_cast<int>(list.size()); ++start) {
    int at = start;
    while (at >= 0 && walk[static_cast<std::size_t>(at)] < 0) {
      walk[static_cast<std::size_t>(at)] = start;
      at = up(list[static_cast<std::size_t>(at)]);
    }
    if (at < 0 || walk[static_cast<std::size_t>(at)] != start) continue;
    std::string names;
    int shown = 0;
    for (int next = at; next != at || shown == 0; next = up(list[static_cast<std::size_t>(next)])) {
      if (++shown > kShown) break;
      names += (shown > 1 ? ", " : "") + quoted(list[static_cast<std::size_t>(next)].name);
    }
    found(list[static_cast<std::size_t>(at)], names + (shown > kShown ? ", ..." : ""));
  }
}

}  // namespace

void UrdfReport::fail(int line, const std::string& found, std::string_view expected, std::string_view advice) const {
  const std::string also = suspect.empty() ? "" : fmt::format(" (and see {})", suspect);
  throw InputError(fmt::format("{}:{}: {}; expected {}; {}{}", source, line, found, expected, advice, also));
}

void UrdfReport::warn(int line, const std::string& message) {
  warnings.push_back(fmt::format("{}:{}: {}", source, line, message));
}

bool UrdfJoint::is_screw() const { return type == "revolute" || type == "continuous" || type == "prismatic"; }

UrdfStructure::UrdfStructure(std::string xml, UrdfReport& report) : report_(report) {
  parse(std::move(xml));
  index_names("link", links_, link_called_);
  index_names("joint", joints_, joint_called_);
  if (links_.empty()) {
    report_.fail(robot_->GetLineNum(), "the robot has no link", "at least one <link name=\"...\"/>", "add its links");
  }
  for (UrdfJoint& joint : joints_) join(joint);
  require_one_tree();
  for (UrdfJoint& joint : joints_) follow(joint);
  require_leaders();
}

void UrdfStructure::parse(std::string xml) {
  if (is_utf16(xml)) {
    report_.fail(1, "the text is UTF-16", "UTF-8", fmt::format("convert it: iconv -f UTF-16 -t UTF-8 {} > out.urdf", report_.source));
  }
  if (const int line = line_not_utf8(xml); line > 0) {
    report_.warn(line, "the text is not UTF-8; read as Latin-1 (iconv -f ISO-8859-1 -t UTF-8 converts it)");
    xml = utf8_of_latin1(xml);
  }
  if (const int line = line_of_crowded_element(xml); line > 0) {
    report_.fail(line, fmt::format("the element here has more than {} attributes", kMostAttributes), "an element of URDF",
                 "delete what is not one");
  }
  document_.Parse(xml.data(), xml.size());
  if (document_.ErrorID() == tinyxml2::XML_ERROR_EMPTY_DOCUMENT) {
    report_.fail(1, "the file is empty", "a URDF robot, <robot name=\"...\"> ... </robot>",
                 "check that it was written completely");
  }
  if (document_.Error()) {
    report_.fail(std::max(document_.ErrorLineNum(), 1),
                 fmt::format("the text is not XML: {}", complaint(document_.ErrorID())), "well-formed XML",
                 "close every tag and quote every attribute near this line");
  }
  robot_ = document_.RootElement();
  if (!robot_ || std::string_view(robot_->Name()) != "robot") {
    report_.fail(robot_ ? robot_->GetLineNum() : 1,
                 robot_ ? fmt::format("the outermost element is <{}>", robot_->Name()) : "the file holds no element",
                 "<robot name=\"...\">", "give a URDF file, or convert this one to URDF");
  }
  check_vocabulary(*robot_, report_);
  const char* name = robot_->Attribute("name");
  name_ = name ? name : "robot";
  if (!name) report_.warn(robot_->GetLineNum(), "<robot> has no name; called \"robot\"");
  const char* version = robot_->Attribute("version");
  if (version && std::string_view(version) != "1.0") {
    report_.warn(robot_->GetLineNum(), fmt::format("URDF version {}; read as version 1.0", quoted(version)));
  }
}

template <class Named>
void UrdfStructure::index_names(const char* tag, std::vector<Named>& list, std::unordered_map<std::string, int>& at) {
  for (const XMLElement* element = robot_->FirstChildElement(tag); element;
       element = element->NextSiblingElement(tag)) {
    const char* name = element->Attribute("name");
    if (!name || !*name) {
      report_.fail(element->GetLineNum(), fmt::format("a <{}> without a name", tag),
                   fmt::format("<{} name=\"...\">", tag), "name it after what it is");
    }
    const auto [first, is_new] = at.emplace(name, static_cast<int>(list.size()));
    if (!is_new) {
      const int line = list[static_cast<std::size_t>(first->second)].element->GetLineNum();
      report_.fail(element->GetLineNum(),
                   fmt::format("a second {} is called {}, like the one in line {}", tag, quoted(name), line),
                   "a name of its own", "rename one of the two");
    }
    list.emplace_back().name = name;
    list.back().element = element;
  }
}

void UrdfStructure::join(UrdfJoint& joint) {
  static const std::array<std::string, 6> kTypes = {"revolute", "continuous", "prismatic",
                                                     "fixed",    "floating",   "planar"};
  const int line = joint.element->GetLineNum();
  const char* type = joint.element->Attribute("type");
  joint.type = type ? type : "";
  if (std::ranges::find(kTypes, joint.type) == kTypes.end()) {
    report_.fail(line, fmt::format("joint {} has {}", quoted(joint.name), type ? "type " + quoted(type) : "no type"),
                 "revolute, continuous, prismatic, fixed, floating or planar",
                 did_you_mean(joint.type, kTypes, "build other joints from these"));
  }
  joint.parent = end_of(joint, "parent");
  joint.child = end_of(joint, "child");
  UrdfLink& child = links_[static_cast<std::size_t>(joint.child)];
  if (child.joint >= 0) {
    const UrdfJoint& first = this->joint(child.joint);
    report_.fail(line,
                 fmt::format("link {} is the child of two joints, {} in line {} and {}", quoted(child.name),
                             quoted(first.name), first.element->GetLineNum(), quoted(joint.name)),
                 "one joint above every link", "delete one of the two, or make it a <loop_joint>, which closes a loop");
  }
  child.joint = static_cast<int>(&joint - joints_.data());
}

int UrdfStructure::end_of(const UrdfJoint& joint, const char* end) const {
  const XMLElement* element = joint.element->FirstChildElement(end);
  const char* name = element ? element->Attribute("link") : nullptr;
  if (!name) {
    report_.fail((element ? element : joint.element)->GetLineNum(),
                 fmt::format("joint {} names no {} link", quoted(joint.name), end),
                 fmt::format("<{} link=\"...\"/>", end), "add it to the joint");
  }
  const auto found = link_called_.find(name);
  if (found == link_called_.end()) {
    report_.fail(element->GetLineNum(),
                 fmt::format("joint {}: its {} link {} does not exist", quoted(joint.name), end, quoted(name)),
                 fmt::format("one of the file's {} links", links_.size()),
                 did_you_mean(name, names_of(links_), fmt::format("add <link name={}/>", quoted(name))));
  }
  return found->second;
}

void UrdfStructure::require_one_tree() {
  require_no_circle(
      links_, [&](const UrdfLink& link) { return link.joint < 0 ? -1 : this->joint(link.joint).parent; },
      [&](const UrdfLink& start, const std::string& names) {
        report_.fail(this->joint(start.joint).element->GetLineNum(),
                     link(this->joint(start.joint).parent).name == start.name
                         ? fmt::format("link {} hangs from itself", names)
                         : fmt::format("the links {} hang from each other in a loop", names),
                     "a tree that starts at one root link", "make one of the joints a <loop_joint>, which closes the loop");
      });
  const UrdfLink* root = nullptr;
  for (const UrdfLink& link : links_) {
    if (link.joint >= 0) continue;
    if (root) {
      report_.fail(link.element->GetLineNum(),
                   fmt::format("two root links, {} in line {} and {}", quoted(root->name),
                               root->element->GetLineNum(), quoted(link.name)),
                   "one link that no joint carries", "join the two by a joint (type fixed, where nothing moves)");
    }
    root = &link;
  }
}

void UrdfStructure::follow(UrdfJoint& joint) {
  const XMLElement* mimic = joint.element->FirstChildElement("mimic");
  if (!mimic) return;
  if (!joint.is_screw()) {
    report_.warn(mimic->GetLineNum(), fmt::format("joint {} is {} and has a <mimic>; the <mimic> is ignored",
                                                  quoted(joint.name), joint.type));
    return;
  }
  const char* leader = mimic->Attribute("joint");
  if (!leader) {
    report_.fail(mimic->GetLineNum(), fmt::format("joint {} mimics no joint", quoted(joint.name)),
                 "<mimic joint=\"...\"/>", "name the joint that leads");
  }
  const auto found = joint_called_.find(leader);
  if (found == joint_called_.end()) {
    report_.fail(mimic->GetLineNum(),
                 fmt::format("joint {} mimics {}, which does not exist", quoted(joint.name), quoted(leader)),
                 fmt::format("one of the file's {} joints", joints_.size()),
                 did_you_mean(leader, names_of(joints_), "name the joint that leads"));
  }
  joint.leader = found->second;
}

void UrdfStructure::require_leaders() {
  require_no_circle(
      joints_, [](const UrdfJoint& joint) { return joint.leader; },
      [&](const UrdfJoint& start, const std::string& names) {
        const bool itself = &this->joint(start.leader) == &start;
        report_.fail(start.element->FirstChildElement("mimic")->GetLineNum(),
                     itself ? fmt::format("joint {} mimics itself", names)
                            : fmt::format("the joints {} mimic each other in a circle", names),
                     "a leader that mimics no joint", "delete the <mimic> of the joint that leads");
      });
  for (const UrdfJoint& follower : joints_) {
    if (follower.leader < 0 || this->joint(follower.leader).is_screw()) continue;
    const UrdfJoint& leader = this->joint(follower.leader);
    report_.fail(
        follower.element->FirstChildElement("mimic")->GetLineNum(),
        fmt::format("joint {} mimics {}, which is {}", quoted(follower.name), quoted(leader.name), leader.type),
        "a leader that turns or slides", "delete the <mimic>, or make the leader revolute, continuous or prismatic");
  }
}

}  // namespace linden
