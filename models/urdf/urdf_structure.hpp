// models/urdf/urdf_structure.hpp
// What a URDF file says before any number is read: its XML, the names of links and joints, and who hangs from whom.
//
//   once a UrdfStructure stands                       else InputError
//   the text is XML, <robot ...>, without macros      not XML, UTF-16, another format, xacro, elements of 200 attributes
//   every link and every joint has its own name       no name, or one name twice
//   every joint has a known type, a parent, a child   other type, or a link that does not exist
//   the links are one tree with one root              two joints above a link, a loop, two roots
//   mimics lead to a joint that turns or slides       no such joint, a circle, a leader that does neither
//
// Words that are not URDF's, or not used, are told (models/urdf/urdf_vocabulary.hpp) before what may come of them throws. A robot without a
// name is called "robot", and text that is not UTF-8 is read as Latin-1, each with a warning. A follower may follow a follower; a <mimic>
// of a fixed, floating or planar joint is ignored, with a warning. Elements stay those of the document: they live as long as the
// UrdfStructure, and its numbers are not looked at.
//
// cost  one pass over links and joints each; a wrong name is compared with all others only on the way to its error
#pragma once

#include <tinyxml2.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace linden {

/// Where messages go: errors are thrown, warnings collected.
struct UrdfReport {
  std::string source;  // stands for the file
  std::vector<std::string> warnings;
  std::string suspect;  // the first word that is not used, which an error may come of: said with every error; may be empty

  /// Throws InputError: `source:line: found; expected ...; advice`.
  [[noreturn]] void fail(int line, const std::string& found, std::string_view expected, std::string_view advice) const;
  void warn(int line, const std::string& message);
};

struct UrdfLink {
  std::string name;
  const tinyxml2::XMLElement* element = nullptr;
  int joint = -1;  // that carries it; -1 = root
};

struct UrdfJoint {
  std::string name;
  const tinyxml2::XMLElement* element = nullptr;
  std::string type;             // as the file calls it
  int parent = -1, child = -1;  // links
  int leader = -1;              // joint that it follows; -1 = none

  /// Moves about or along one axis: revolute, continuous or prismatic.
  bool is_screw() const;
};

class UrdfStructure {
 public:
  UrdfStructure(std::string xml, UrdfReport& report);

  const std::string& name() const { return name_; }
  const tinyxml2::XMLElement& robot() const { return *robot_; }
  const std::vector<UrdfLink>& links() const { return links_; }     // in the order of the file
  const std::vector<UrdfJoint>& joints() const { return joints_; }  // in the order of the file
  const UrdfLink& link(int index) const { return links_[static_cast<std::size_t>(index)]; }
  const UrdfJoint& joint(int index) const { return joints_[static_cast<std::size_t>(index)]; }

 private:
  void parse(std::string xml);
  template <class Named>
  void index_names(const char* tag, std::vector<Named>& list, std::unordered_map<std::string, int>& at);
  /// Type and both links of a joint.
  void join(UrdfJoint& joint);
  /// The link that <parent> or <child> names.
  int end_of(const UrdfJoint& joint, const char* end) const;
  void require_one_tree();
  /// Leader of a joint that mimics.
  void follow(UrdfJoint& joint);
  void require_leaders();

  UrdfReport& report_;
  tinyxml2::XMLDocument document_;
  std::string name_;
  const tinyxml2::XMLElement* robot_ = nullptr;
  std::vector<UrdfLink> links_;
  std::vector<UrdfJoint> joints_;
  std::unordered_map<std::string, int> link_called_, joint_called_;
};

}  // namespace linden
