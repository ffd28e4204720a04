// tests/reference/urdf_plain.hpp
// A URDF file read as plainly as can be, to judge models/urdf/urdf.cpp by: no urdfdom, no builder, no merging.
//
// Every link keeps its own frame. Poses are 4 x 4 matrices, multiplied from the link up to the root, each time anew;
// the mass matrix of the whole at zero is the sum over links of their spatial inertias about the root link's frame.
#pragma once

#include <tinyxml2.h>

#include <Eigen/Dense>
#include <cmath>
#include <locale>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace linden::reference {

struct PlainLink {
  double mass = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();         // link frame
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();        // about the centre, link's axes
  std::string parent, joint, type = "root";                 // of the joint above
  Eigen::Matrix4d placement = Eigen::Matrix4d::Identity();  // in the parent link's frame at zero
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  std::map<std::string, double> limit, dynamics;  // attributes that the file gives
  bool mimics = false;
  std::string leader;
  double multiplier = 1, offset = 0;
};

inline std::vector<double> plain_numbers(const char* text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  std::vector<double> numbers;
  for (double number = 0; stream >> number;) numbers.push_back(number);
  return numbers;
}

inline Eigen::Vector3d plain_vector(const tinyxml2::XMLElement* element, const char* attribute) {
  if (!element || !element->Attribute(attribute)) return Eigen::Vector3d::Zero();
  const std::vector<double> numbers = plain_numbers(element->Attribute(attribute));
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

/// <origin>: turn by roll about x, pitch about y, yaw about z of the fixed axes, then shift.
inline Eigen::Matrix4d plain_pose(const tinyxml2::XMLElement* origin) {
  const Eigen::Vector3d rpy = plain_vector(origin, "rpy");
  Eigen::Matrix3d roll, pitch, yaw;
  roll << 1, 0, 0, 0, std::cos(rpy.x()), -std::sin(rpy.x()), 0, std::sin(rpy.x()), std::cos(rpy.x());
  pitch << std::cos(rpy.y()), 0, std::sin(rpy.y()), 0, 1, 0, -std::sin(rpy.y()), 0, std::cos(rpy.y());
  yaw << std::cos(rpy.z()), -std::sin(rpy.z()), 0, std::sin(rpy.z()), std::cos(rpy.z()), 0, 0, 0, 1;
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  pose.topLeftCorner<3, 3>() = yaw * pitch * roll;
  pose.topRightCorner<3, 1>() = plain_vector(origin, "xyz");
  return pose;
}

struct PlainRobot {
  std::map<std::string, PlainLink> links;

  explicit PlainRobot(const std::string& file) {
    tinyxml2::XMLDocument document;
    if (document.LoadFile(file.c_str()) != tinyxml2::XML_SUCCESS) throw std::runtime_error("cannot read " + file);
    const tinyxml2::XMLElement* robot = document.FirstChildElement("robot");
    for (auto* link = robot->FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
      PlainLink& it = links[link->Attribute("name")];
      const auto* inertial = link->FirstChildElement("inertial");
      if (!inertial) continue;
      const Eigen::Matrix4d frame = plain_pose(inertial->FirstChildElement("origin"));
      const Eigen::Matrix3d turn = frame.topLeftCorner<3, 3>();
      const auto* moments = inertial->FirstChildElement("inertia");
      const auto get = [&](const char* name) { return plain_numbers(moments->Attribute(name)).at(0); };
      Eigen::Matrix3d about;
      about << get("ixx"), get("ixy"), get("ixz"), get("ixy"), get("iyy"), get("iyz"), get("ixz"), get("iyz"),
          get("izz");
      it.mass = plain_numbers(inertial->FirstChildElement("mass")->Attribute("value")).at(0);
      it.center = frame.topRightCorner<3, 1>();
      it.inertia = turn * about * turn.transpose();
    }
    for (auto* joint = robot->FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
      PlainLink& it = links.at(joint->FirstChildElement("child")->Attribute("link"));
      it.parent = joint->FirstChildElement("parent")->Attribute("link");
      it.joint = joint->Attribute("name");
      it.type = joint->Attribute("type");
      it.placement = plain_pose(joint->FirstChildElement("origin"));
      if (const auto* axis = joint->FirstChildElement("axis")) it.axis = plain_vector(axis, "xyz");
      const auto attributes = [&](const char* tag, std::map<std::string, double>& values) {
        const auto* element = joint->FirstChildElement(tag);
        for (auto* a = element ? element->FirstAttribute() : nullptr; a; a = a->Next()) {
          values[a->Name()] = plain_numbers(a->Value()).at(0);
        }
      };
      attributes("limit", it.limit);
      attributes("dynamics", it.dynamics);
      if (const auto* mimic = joint->FirstChildElement("mimic")) {
        it.mimics = true;
        it.leader = mimic->Attribute("joint");
        if (mimic->Attribute("multiplier")) it.multiplier = plain_numbers(mimic->Attribute("multiplier")).at(0);
        if (mimic->Attribute("offset")) it.offset = plain_numbers(mimic->Attribute("offset")).at(0);
      }
    }
  }

  /// Pose of a link at zero in the root link's frame.
  Eigen::Matrix4d pose(std::string link) const {
    Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
    for (; !links.at(link).parent.empty(); link = links.at(link).parent) result = links.at(link).placement * result;
    return result;
  }

  /// Whether a joint between root and link moves.
  bool moves(std::string link) const {
    for (; !links.at(link).parent.empty(); link = links.at(link).parent) {
      if (links.at(link).type != "fixed") return true;
    }
    return false;
  }

  /// Without a base; joints that mimic are not counted.
  int degrees_of_freedom() const {
    int count = 0;
    for (const auto& [name, link] : links) {
      if (link.type == "revolute" || link.type == "continuous" || link.type == "prismatic")
        count += link.mimics ? 0 : 1;
      if (link.type == "planar") count += 3;
      if (link.type == "floating") count += 6;
    }
    return count;
  }

  /// 6 x 6, angular before linear, about the root link's frame at zero; of the moving links only where `moving`.
  Eigen::Matrix<double, 6, 6> composite_inertia(bool moving) const {
    Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
    for (const auto& [name, link] : links) {
      if (moving && !moves(name)) continue;
      const Eigen::Matrix4d frame = pose(name);
      const Eigen::Matrix3d turn = frame.topLeftCorner<3, 3>();
      const Eigen::Vector3d center = turn * link.center + frame.topRightCorner<3, 1>();
      Eigen::Matrix3d cross;
      cross << 0, -center.z(), center.y(), center.z(), 0, -center.x(), -center.y(), center.x(), 0;
      sum.topLeftCorner<3, 3>() += turn * link.inertia * turn.transpose() + link.mass * cross * cross.transpose();
      sum.topRightCorner<3, 3>() += link.mass * cross;
      sum.bottomLeftCorner<3, 3>() += link.mass * cross.transpose();
      sum.bottomRightCorner<3, 3>() += link.mass * Eigen::Matrix3d::Identity();
    }
    return sum;
  }
};

}  // namespace linden::reference
