// tests/engine/busy_scene.hpp
// A scene in which every effect acts, for what must hold of all of them.
#pragma once

#include <cmath>

#include "engine/scene/scene.hpp"
#include "layout/effects/on_rows.hpp"
#include "models/shapes/contacts_of.hpp"

namespace linden {

/// Waves of 5 cm on a grid, `below` [m] under the origin.
inline HeightField waves(double below) {
  HeightField terrain{.columns = 9, .rows = 7, .spacing_x = 0.5, .spacing_y = 0.5, .origin_x = -2, .origin_y = -1.5, .heights = {}};
  for (int k = 0; k < 63; ++k) terrain.heights.push_back(0.05 * std::sin(1.7 * k) - below);
  return terrain;
}

/// Every effect that the model can have, tables over time included, from the state at rest. Where the model has shapes there is a terrain.
inline Scene busy_scene(const Model& model) {
  Scene scene{.model = model, .options = {.step = 1e-3}, .initial = {}, .effects = {}, .files = {"busy.yaml", "robot.urdf"}};
  Effects& effects = scene.effects;
  effects.armature = armature_everywhere(model, 0.01);
  effects.damping = damping_everywhere(model, 0.05);
  const Followers followers(model);
  Index place = 0;
  for (const Index row : rows_of_joints(model, false)) {
    if (followers.mimic(row) != nullptr) continue;
    switch (place++ % 6) {
      case 0:
        effects.friction.push_back({row, 0.2});
        effects.servos.push_back({.row = row, .stiffness = 50, .damping = 1, .target = 0.2, .max_force = 30});
        break;
      case 1:
        effects.servos.push_back({.row = row,
                                  .stiffness = 20,
                                  .damping = 2,
                                  .target_over_time = {{0, 0.01, 0.02}, {0, 0.1, -0.1}},
                                  .target_velocity = {{0, 0.05}, {0.2, 0}},
                                  .feedforward = {{0, 0.03}, {0.5, -0.5}}});
        effects.limits.push_back({.row = row, .lower = -0.5, .upper = 0.5, .velocity = 6});
        break;
      case 2:
        effects.springs.push_back({row, 3, 0.1});
        effects.torques.push_back({row, {{0, 0.02, 0.02, 0.04}, {0.3, 0.3, -0.3, 0}}});
        break;
      case 3:
        effects.dead_zone_springs.push_back({row, 5, 0.02, 0.01});
        effects.limits.push_back({.row = row, .lower = -0.02, .upper = 0.02, .restitution = 0.5});
        break;
      case 4:
        if (effects.motions.empty()) effects.motions.push_back({row, {{0, 0.05, 0.1}, {0, 0.05, 0}}, {0, 0.3, 0}});
        break;
      default: effects.friction.push_back({row, 0.1}); break;
    }
  }
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    if (model.tree.kind(i) == JointKind::ball) effects.ball_springs.push_back({i, 4, {0.1, 0, 0, std::sqrt(0.99)}});
    if (model.constants.inertia(i, 0) > 0) effects.drag.push_back({.slot = i, .linear = 0.1, .quadratic = 0.2});
  }
  effects.wind = {1, -2, 0.5};
  effects.wrenches.push_back({.slot = 1, .force = {2, -1, 0}, .moment = {0.1, 0, 0.2}, .scale = {{0, 0.02, 0.05}, {1, 2, 0}}});
  effects.wrenches.push_back({.slot = 2, .point = {0, 0, 0.1}, .force = {0, 1, 0}, .in_world = false, .from = 0.01, .to = 0.04});
  std::vector<std::string> notes;
  if (Contacts contacts = contacts_of(model, notes); !contacts.empty()) {
    effects.ground = Ground{.stiffness = 2e4, .damping = 100, .friction = 0.7, .terrain = waves(1.0), .contacts = std::move(contacts)};
  }
  scene.start_as_given = true;
  scene.randomization = {.masses = Range{0.9, 1.1}, .gains = Range{0.5, 2}};
  scene.seed = 7;
  return scene;
}

}  // namespace linden
