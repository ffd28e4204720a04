// layout/names.hpp
// What the slots and rows of a tree are called: read by people and messages, never by a sweep.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "layout/field.hpp"
#include "layout/pose.hpp"

namespace linden {

/// Where a link of the source ended up: a link behind a fixed joint is part of another body.
struct LinkPlace {
  Index slot = 0;  // body that carries the link; 0 = fixed to the world
  Pose in_body;    // link frame in the body's frame
};

struct Names {
  std::string model;
  std::vector<std::string> body;        // [slots]  link at the joint; "world" in slot 0
  std::vector<std::string> joint;       // [slots]  joint that carries the body; empty in slot 0
  std::vector<std::string> position;    // [nq]     "elbow", "base.x", "base.qw", ...
  std::vector<std::string> velocity;    // [nv]     "elbow", "base.wx", "base.vx", ...
  std::unordered_map<std::string, LinkPlace> link;        // every link of the source, merged ones too
  std::unordered_map<std::string, Index> slot_of_joint;   // every moving joint; a fixed joint is not in it
};

}  // namespace linden
