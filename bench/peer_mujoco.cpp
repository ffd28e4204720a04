#include <fmt/format.h>
#include <mujoco/mujoco.h>
#include <tinyxml2.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "bench/peer.hpp"

namespace linden {
namespace {

using tinyxml2::XMLElement;

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct DataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using ModelPointer = std::unique_ptr<mjModel, ModelDeleter>;
using DataPointer = std::unique_ptr<mjData, DataDeleter>;

void delete_children(XMLElement& parent, const char* tag) {
  while (XMLElement* child = parent.FirstChildElement(tag)) parent.DeleteChild(child);
}

/// Carries the root link by a floating joint of this name: MuJoCo fixes a root to the world.
void set_afloat(XMLElement& root, const std::string& root_link, const std::string& joint_name) {
  constexpr const char* world = "world";
  root.InsertNewChildElement("link")->SetAttribute("name", world);
  XMLElement* joint = root.InsertNewChildElement("joint");
  joint->SetAttribute("name", joint_name.c_str());
  joint->SetAttribute("type", "floating");
  joint->InsertNewChildElement("parent")->SetAttribute("link", world);
  joint->InsertNewChildElement("child")->SetAttribute("link", root_link.c_str());
}

bool floats(const XMLElement& root) {
  for (const XMLElement* joint = root.FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
    if (joint->Attribute("type", "floating")) return true;
  }
  return false;
}

/// The robot's file without shapes, damping and friction, its root set afloat, and MuJoCo told to take inertias as they are.
void write_for_mujoco(const Robot& robot, const std::string& target) {
  tinyxml2::XMLDocument text;
  if (text.LoadFile(robot.file.c_str()) != tinyxml2::XML_SUCCESS) throw std::runtime_error(text.ErrorStr());
  XMLElement& root = *text.RootElement();
  for (XMLElement* link = root.FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
    delete_children(*link, "visual");
    delete_children(*link, "collision");
  }
  for (XMLElement* joint = root.FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
    delete_children(*joint, "dynamics");
  }
  delete_children(root, "mujoco");
  XMLElement* mujoco = root.InsertNewChildElement("mujoco");
  XMLElement* compiler = mujoco->InsertNewChildElement("compiler");
  compiler->SetAttribute("fusestatic", "true");
  compiler->SetAttribute("inertiafromgeom", "false");
  compiler->SetAttribute("balanceinertia", "false");
  compiler->SetAttribute("boundmass", "0");
  compiler->SetAttribute("boundinertia", "0");
  XMLElement* size = mujoco->InsertNewChildElement("size");  // room for constraints is 13 MB an instance otherwise
  size->SetAttribute("njmax", "0");
  size->SetAttribute("nconmax", "0");
  size->SetAttribute("nstack", "100000");  // numbers; the implicit integrator's need, not counted by MuJoCo without constraints
  if (!floats(root)) set_afloat(root, robot.model->names.body[1], robot.model->names.joint[1]);
  if (text.SaveFile(target.c_str()) != tinyxml2::XML_SUCCESS) throw std::runtime_error(text.ErrorStr());
}

ModelPointer load(const Robot& robot, const Plan& plan, mjtIntegrator integrator) {
  const char* const ending = robot.file.empty() ? "xml" : "urdf";
  const std::filesystem::path file = std::filesystem::temp_directory_path() / fmt::format("linden-peer-{}.{}", getpid(), ending);
  if (robot.file.empty()) {
    std::ofstream(file) << mjcf_of(robot);
  } else {
    write_for_mujoco(robot, file.string());
  }
  char message[1000] = "";
  ModelPointer model(mj_loadXML(file.c_str(), nullptr, message, sizeof message));
  std::filesystem::remove(file);
  if (!model) throw std::runtime_error(fmt::format("MuJoCo cannot read {}: {}", robot.name, message));
  model->opt.timestep = plan.step;
  model->opt.integrator = integrator;
  model->opt.gravity[2] = -plan.gravity;
  mju_user_warning = [](const char*) {};                                      // they are counted; it would write a file of them
  mju_user_error = [](const char* text) { throw std::runtime_error(text); };  // it would end the program
  model->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_LIMIT | mjDSBL_FRICTIONLOSS;
  return model;
}

class MujocoPeer : public Peer {
 public:
  MujocoPeer(const Robot& robot, const Plan& plan, mjtIntegrator integrator)
      : linden_(robot.model), model_(load(robot, plan, integrator)), team_(plan.threads) {
    const Tree& tree = linden_->tree;
    for (Index slot = 1; slot < tree.shape.slots; ++slot) places_.push_back(place_of(slot));
    for (std::int64_t i = 0; i < plan.instances; ++i) data_.emplace_back(mj_makeData(model_.get()));
  }

  double mass() const override { return mj_getTotalmass(model_.get()); }
  Index degrees_of_freedom() const override { return model_->nv; }

  void reset(std::int64_t i, const InitialState& start) override {
    mjData& data = *data_[static_cast<std::size_t>(i)];
    mj_resetData(model_.get(), &data);
    for (const Place& place : places_) {
      const double* from_q = &start.positions[place.linden_q];
      const double* from_v = &start.velocities[place.linden_v];
      mjtNum* q = data.qpos + place.q;
      mjtNum* v = data.qvel + place.v;
      if (place.kind == JointKind::ball) {
        for (int k = 0; k < 4; ++k) q[k] = from_q[(k + 3) % 4];
        mju_copy3(v, from_v);
      } else if (place.kind == JointKind::free) {
        // position, quaternion w x y z; linear velocity in the world's frame, angular in the body's
        const mjtNum quaternion[4] = {from_q[6], from_q[3], from_q[4], from_q[5]};
        mju_copy3(q, from_q);
        mju_copy4(q + 3, quaternion);
        mju_rotVecQuat(v, from_v + 3, quaternion);
        mju_copy3(v + 3, from_v);
      } else {
        *q = *from_q;
        *v = *from_v;
      }
    }
  }

  void step(int n) override {
    team_.share(data_.size(), [&](std::size_t i) {
      for (int k = 0; k < n; ++k) mj_step(model_.get(), data_[i].get());
    });
    // what is no number any more it warns of, and begins anew without a word
    for (const DataPointer& data : data_) {
      for (const mjtWarning bad : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}) {
        if (data->warning[bad].number > 0)
          throw std::runtime_error(mju_warningText(bad, static_cast<size_t>(data->warning[bad].lastinfo)));
      }
    }
  }

  std::vector<double> positions(std::int64_t i) override {
    const mjtNum* q = data_[static_cast<std::size_t>(i)]->qpos;
    std::vector<double> rows = linden_->neutral();
    for (const Place& place : places_) {
      double* to = &rows[place.linden_q];
      const mjtNum* from = q + place.q;
      if (place.kind == JointKind::ball) {
        for (int k = 0; k < 4; ++k) to[k] = from[(k + 1) % 4];
        continue;
      }
      *to = *from;
      if (place.kind != JointKind::free) continue;
      for (int k = 1; k < 3; ++k) to[k] = from[k];
      for (int k = 0; k < 4; ++k) to[3 + k] = from[3 + (k + 1) % 4];
    }
    return rows;
  }

  Energy energy(std::int64_t i) override {
    mjData* data = data_[static_cast<std::size_t>(i)].get();
    model_->opt.enableflags |= mjENBL_ENERGY;
    mj_forward(model_.get(), data);
    model_->opt.enableflags &= ~mjENBL_ENERGY;
    return {.kinetic = data->energy[1], .potential = data->energy[0]};
  }

  std::optional<Momentum> momentum(std::int64_t i) override {
    mjData* data = data_[static_cast<std::size_t>(i)].get();
    mj_forward(model_.get(), data);
    mj_subtreeVel(model_.get(), data);  // of the world's subtree: the velocity of its centre of mass, what turns about that
    Momentum all;
    mju_scl3(all.linear.data(), data->subtree_linvel, mass());
    mju_cross(all.angular.data(), data->subtree_com, all.linear.data());
    mju_addTo3(all.angular.data(), data->subtree_angmom);
    return all;
  }

 private:
  /// First rows of one joint, ours and theirs.
  struct Place {
    JointKind kind;
    std::size_t linden_q, linden_v;
    int q, v;
  };

  Place place_of(Index slot) const {
    const Tree& tree = linden_->tree;
    const std::string& name = linden_->names.joint[static_cast<std::size_t>(slot)];
    const int joint = mj_name2id(model_.get(), mjOBJ_JOINT, name.c_str());
    const JointKind kind = tree.kind(slot);
    const int type = joint < 0 ? -1 : model_->jnt_type[joint];
    if (joint < 0 || (kind == JointKind::ball) != (type == mjJNT_BALL) || (kind == JointKind::free) != (type == mjJNT_FREE)) {
      throw std::runtime_error(fmt::format("MuJoCo has no joint \"{}\" of the same kind", name));
    }
    return {kind, static_cast<std::size_t>(tree.first_q(slot)), static_cast<std::size_t>(tree.first_v(slot)),
            model_->jnt_qposadr[joint], model_->jnt_dofadr[joint]};
  }

  std::shared_ptr<const Model> linden_;
  ModelPointer model_;
  Team team_;
  std::vector<Place> places_;
  std::vector<DataPointer> data_;
};

Contender contender(const char* name, const char* method, mjtIntegrator integrator, bool races = true) {
  return {name,  fmt::format("MuJoCo {}, {}", mj_versionString(), method),
          races, races,
          1e-7,  [=](const Robot& robot, const Plan& plan) { return std::make_unique<MujocoPeer>(robot, plan, integrator); }};
}

}  // namespace

std::vector<Contender> mujoco_contenders() {
  return {contender("mujoco-euler", "semi-implicit Euler", mjINT_EULER),
          contender("mujoco-rk4", "Runge-Kutta of fourth order", mjINT_RK4),
          contender("mujoco-implicit", "Euler implicit in velocities", mjINT_IMPLICIT,
                    false)};  // needs more stack than robots' files give
}

}  // namespace linden
