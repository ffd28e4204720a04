// tests/reference/plain_scene.hpp
// A plain simulator of whole scenes: minimal coordinates, dense matrices, tiny steps. The judge of the engine, which shares nothing with
// it but the model and the values of the effects.
//
//   coordinates  u of those rows that follow no other, v = Z u + G w         q' = rates of quaternions and places
//                w of joints whose motion is given
//   smooth       Z^T M Z u' = Z^T (Q - bias - M G w')                               Runge and Kutta's method of order 4
//   sudden       A (u+ - u) = dt Z^T (Q - bias - dt K v) + W^T lambda         A = Z^T (M + dt C + dt^2 K) Z, first order
//                rows of plain_forces.hpp, D = W A^-1 W^T dense, by projected Gauss and Seidel
//
// A step in which nothing sudden may act is one of the first kind, so limits and ground cost no order before they are met. Forces that
// jump in time do so between steps: a step never reaches across a time at which one begins, ends or bends.
//
// source  Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988); Anitescu, Potra, Formulating dynamic multi-rigid-
//         body contact problems with friction as solvable linear complementarity problems (1997); Hairer, Norsett, Wanner, Solving
//         Ordinary Differential Equations I, II.1
#pragma once

#include <memory>

#include "tests/reference/plain_couplings.hpp"
#include "tests/reference/plain_curve.hpp"
#include "tests/reference/plain_forces.hpp"

namespace linden::reference {

class PlainScene {
 public:
  /// At rest in the zero configuration. Model and effects are copied as far as they are needed.
  PlainScene(const Model& model, const Effects& effects, const std::array<double, 3>& gravity)
      : fixed_(std::make_shared<const Fixed>(model, effects, gravity)),
        v(VectorXd::Zero(model.tree.shape.velocities)),
        sudden(VectorXd::Zero(model.tree.shape.velocities)) {
    const std::vector<double> neutral = model.neutral();
    q = Eigen::Map<const VectorXd>(neutral.data(), static_cast<Eigen::Index>(neutral.size()));
  }

  const PlainTree& tree() const { return fixed_->tree; }

  /// Where bodies touch each other: of their stiffness the damper that stands for steps of this length [s]; 0 at first.
  void ease_contact(double step) { eases_ = step; }

  /// Followers follow.
  void start(const VectorXd& positions, const VectorXd& velocities) {
    q = positions;
    v = velocities;
    for (const auto& [row, curve] : fixed_->moved) {
      q[static_cast<Eigen::Index>(fixed_->forces.position_row(row))] = curve.derivative(0, time);
      v[row] = curve.derivative(1, time);
    }
    for (const Mimic& mimic : fixed_->mimics) {
      q[mimic.follower_q] = mimic.multiplier * q[mimic.leader_q] + mimic.offset;
      v[mimic.follower_v] = mimic.multiplier * v[mimic.leader_v];
    }
    close_gaps();
  }

  /// On by `duration`, in so many steps or a few more.
  void advance(double duration, int steps) {
    const double begin = time, end = time + duration, longest = duration / steps;
    std::vector<double> stops{begin};
    for (const double stop : fixed_->breaks) {
      if (stop > begin + 1e-9 * longest && stop < end - 1e-9 * longest) stops.push_back(stop);
    }
    stops.push_back(end);
    for (std::size_t piece = 0; piece + 1 < stops.size(); ++piece) {
      const double length = stops[piece + 1] - stops[piece];
      const int count = std::max(1, static_cast<int>(std::ceil(length / longest - 1e-6)));
      for (int k = 0; k < count; ++k) step(stops[piece] + k * length / count, length / count);
    }
    time = end;
  }

  /// M with rotors, of all rows as if none followed another.
  MatrixXd mass_matrix() const { return mass_matrix_at(body_motions(tree(), q, v)); }

  /// v' of the smooth forces.
  VectorXd acceleration() const { return acceleration_at(q, v, time, {time, time}); }

  /// What each row's velocity weighs where all others are free to move [kg m^2, kg].
  /// Infinite where the motion is given. The length of a cable weighs what the cable moves.
  VectorXd row_inertia() const {
    const MatrixXd M = fixed_->Z.transpose() * mass_matrix() * fixed_->Z;
    const Eigen::LDLT<MatrixXd> factor = M.ldlt();
    VectorXd inertia = (fixed_->Z * factor.solve(fixed_->Z.transpose())).diagonal().cwiseInverse();
    if (fixed_->cables.empty()) return inertia;
    MatrixXd C = fixed_->cables.opening(q);
    for (std::size_t k = 0; k < fixed_->lengths.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      C(row, fixed_->lengths[k]) = 0;
      const VectorXd pulls = fixed_->Z.transpose() * C.row(row).transpose();
      const double moved = pulls.dot(factor.solve(pulls));
      if (moved > 0) inertia[fixed_->lengths[k]] += 1 / moved;
    }
    return inertia;
  }

  /// Stiffest of the joints' own rates [1/s], those beyond dead zones too: roots of stiffness, and damping, over inertia.
  double stiffest_rate() const {
    VectorXd c, k;
    fixed_->forces.joint_gains(q, c, k);
    for (const DeadZoneSpring& spring : fixed_->effects.dead_zone_springs) {
      if (std::abs(fixed_->forces.position(q, spring.row) - spring.rest) > spring.half_width) continue;
      k[spring.row] += spring.stiffness;
      c[spring.row] += spring.damping;
    }
    for (const Servo& servo : fixed_->effects.servos) {
      if (!std::isfinite(servo.max_force)) continue;
      c[servo.row] += servo.damping;
      k[servo.row] += servo.stiffness;
    }
    const VectorXd inertia = row_inertia();
    double stiffest = std::max(k.cwiseQuotient(inertia).cwiseSqrt().maxCoeff(), c.cwiseQuotient(inertia).maxCoeff());
    if (fixed_->springs.empty()) return stiffest;
    const VectorXd moved = moved_freely(fixed_->springs.opening(q), mass_matrix());
    for (std::size_t row = 0; row < fixed_->springs.laws().size(); ++row) {
      const Compliance& law = fixed_->springs.laws()[row];
      const double yields = moved[static_cast<Eigen::Index>(row)];
      stiffest = std::max({stiffest, std::sqrt(law.stiffness * yields), law.damping * yields});
    }
    return stiffest;
  }

  /// Kinetic energy and potential of gravity, springs, ground and contact [J].
  double energy() const {
    double sum = 0.5 * v.dot(mass_matrix() * v);
    const std::vector<BodyMotion> motions = body_motions(tree(), q, v);
    for (Index i = 1; i < tree().slots(); ++i) {
      const PlainBody& body = tree().body(i);
      sum -= body.mass() * fixed_->gravity.dot(motions[static_cast<std::size_t>(i)].world(center_of(body)));
    }
    const auto half_square = [](double k, double x) { return 0.5 * k * x * x; };
    for (const JointSpring& spring : fixed_->effects.springs) {
      sum += half_square(spring.stiffness, fixed_->forces.position(q, spring.row) - spring.rest);
    }
    for (const DeadZoneSpring& spring : fixed_->effects.dead_zone_springs) {
      const double x = fixed_->forces.position(q, spring.row) - spring.rest;
      sum += half_square(spring.stiffness, x - std::clamp(x, -spring.half_width, spring.half_width));
    }
    for (const BallSpring& spring : fixed_->effects.ball_springs) {
      if (spring.stiffness > 0) {
        const Vector3d torque = ball_spring_torque(spring, q.segment<4>(tree().body(spring.slot).q));
        sum += half_square(1 / spring.stiffness, torque.norm());
      }
    }
    const VectorXd gaps = fixed_->springs.gaps(q);
    for (std::size_t row = 0; row < fixed_->springs.laws().size(); ++row) {
      sum += half_square(fixed_->springs.laws()[row].stiffness, gaps[static_cast<Eigen::Index>(row)]);
    }
    for (const PlainTouch& touch : touches(motions, 0)) sum += half_square(fixed_->effects.contact->materials[0].stiffness, std::min(touch.gap, 0.0));
    for (const PlainContact& contact : fixed_->forces.contacts(motions)) {
      sum += half_square(fixed_->effects.ground->stiffness, std::min(contact.gap, 0.0));
    }
    return sum;
  }

 private:
  struct Fixed {
    static std::vector<Coupling> cables_of(const Model& model) {
      std::vector<Coupling> cables;
      std::ranges::copy_if(model.couplings, std::back_inserter(cables), [](const Coupling& one) { return one.kind == CouplingKind::cable; });
      return cables;
    }
    Fixed(const Model& model, const Effects& given, const std::array<double, 3>& g)
        : tree(plain_tree(model)), effects(given), mimics(model.mimics), gravity(vector_of(g)), forces(tree, effects, g), couplings(tree, model.couplings),
          springs(tree, model.couplings, Rows::giving_way), cables(tree, cables_of(model)) {
      for (const Coupling& cable : cables_of(model)) lengths.push_back(cable.terms.front().v_row);
      std::vector<const Mimic*> follows(static_cast<std::size_t>(tree.velocities), nullptr);
      for (const Mimic& mimic : mimics) follows[static_cast<std::size_t>(mimic.follower_v)] = &mimic;
      Z = MatrixXd::Zero(tree.velocities, model.degrees_of_freedom() - static_cast<Index>(effects.motions.size()));
      const auto bends = [&](const TimeTable& table) { breaks.insert(breaks.end(), table.times.begin(), table.times.end()); };
      G = MatrixXd::Zero(tree.velocities, static_cast<Eigen::Index>(effects.motions.size()));
      for (const JointMotion& motion : effects.motions) {
        G(motion.row, static_cast<Eigen::Index>(moved.size())) = 1;
        moved.push_back({motion.row, PlainCurve(motion)});
        bends(motion.position);
      }
      Index column = 0;
      for (Index row = 0; row < tree.velocities; ++row) {
        if (follows[static_cast<std::size_t>(row)] == nullptr && G.row(row).isZero()) Z(row, column++) = 1;
      }
      for (const Mimic& mimic : mimics) {
        Z.row(mimic.follower_v) = mimic.multiplier * Z.row(mimic.leader_v);
        G.row(mimic.follower_v) = mimic.multiplier * G.row(mimic.leader_v);
      }
      for (const JointTorque& torque : effects.torques) bends(torque.force);
      for (const Servo& servo : effects.servos) {
        for (const TimeTable* table : {&servo.target_over_time, &servo.target_velocity, &servo.feedforward}) bends(*table);
      }
      for (const BodyWrench& wrench : effects.wrenches) {
        bends(wrench.scale);
        for (const double edge : {wrench.from, wrench.to}) {
          if (std::isfinite(edge)) breaks.push_back(edge);
        }
      }
      std::ranges::sort(breaks);
      breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
    }
    PlainTree tree;
    Effects effects;
    std::vector<Mimic> mimics;
    Vector3d gravity;
    PlainForces forces;
    PlainCouplings couplings, springs;  // rows that are rigid, and that give way
    PlainCouplings cables;              // of the former
    std::vector<Index> lengths;         // of each of them, its row
    MatrixXd Z, G;  // [nv x u], [nv x w]
    std::vector<std::pair<Index, PlainCurve>> moved;  // by row
    std::vector<double> breaks;  // times at which a force jumps or bends [s]
  };

  /// Begin and end of a step: where a force jumps at one of them, it is that within that counts.
  struct Within {
    double begin, end;
    double operator()(double t) const {
      const double sliver = 1e-9 * (end - begin);
      return std::clamp(t, begin + sliver, end - sliver);
    }
  };

  MatrixXd mass_matrix_at(const std::vector<BodyMotion>& motions) const {
    MatrixXd M = mass_matrix_of(tree(), motions);
    for (const Armature& rotor : fixed_->effects.armature) M(rotor.row, rotor.row) += rotor.inertia;
    return M;
  }

  VectorXd acceleration_at(const VectorXd& at, const VectorXd& rate, double t, const Within& within) const {
    const std::vector<BodyMotion> motions = body_motions(tree(), at, rate);
    const MatrixXd M = mass_matrix_at(motions), & Z = fixed_->Z;
    const VectorXd given = fixed_->G * given_derivatives(2, within(t));
    const VectorXd force = fixed_->forces.force(at, rate, within(t), motions, true) + spring_force(at, rate) - bias_force(tree(), motions) - M * given;
    const Eigen::LDLT<MatrixXd> A(Z.transpose() * M * Z);
    VectorXd u = A.solve(Z.transpose() * force);
    if (!fixed_->couplings.empty()) {
      const MatrixXd C = fixed_->couplings.opening(at), CZ = C * Z, response = A.solve(CZ.transpose());
      u -= response * PlainCouplings::multipliers(CZ * response, CZ * u + C * given + fixed_->couplings.bend(at, rate), moved_freely(C, M));
    }
    return given + Z * u;
  }

  VectorXd spring_force(const VectorXd& at, const VectorXd& rate) const {
    return fixed_->springs.empty() ? VectorXd(VectorXd::Zero(tree().velocities)) : fixed_->springs.force(at, rate);
  }

  /// Positions and velocities back onto the gaps, as near as the mass matrix measures.
  void close_gaps() {
    if (fixed_->couplings.empty()) return;
    const MatrixXd& Z = fixed_->Z;
    const auto moved_by = [&](const VectorXd& opens) {
      const MatrixXd C = fixed_->couplings.opening(q), CZ = C * Z, M = mass_matrix();
      const MatrixXd response = (Z.transpose() * M * Z).ldlt().solve(CZ.transpose());
      return VectorXd(Z * (response * PlainCouplings::multipliers(CZ * response, opens, moved_freely(C, M))));
    };
    for (int round = 0; round < 2; ++round) q = advanced(tree(), q, -moved_by(fixed_->couplings.gaps(q)));
    v -= moved_by(fixed_->couplings.opening(q) * v);
  }

  /// For PlainCouplings::multipliers; what no joint moves at all is rounding.
  static VectorXd moved_freely(const MatrixXd& C, const MatrixXd& M) {
    const VectorXd moved = (C * M.ldlt().solve(C.transpose())).diagonal();
    return moved.cwiseMax(1e-10 * moved.maxCoeff());
  }

  VectorXd given_derivatives(int order, double t) const {
    VectorXd all(fixed_->G.cols());
    for (std::size_t k = 0; k < fixed_->moved.size(); ++k) all[static_cast<Eigen::Index>(k)] = fixed_->moved[k].second.derivative(order, t);
    return all;
  }

  /// q' [nq].
  VectorXd position_rate(const VectorXd& at, const VectorXd& rate) const {
    VectorXd slope = VectorXd::Zero(at.size());
    for (Index i = 1; i < tree().slots(); ++i) {
      const PlainBody& body = tree().body(i);
      if (body.kind == JointKind::screw) {
        slope[body.q] = rate[body.v];
        continue;
      }
      const Index turn = body.kind == JointKind::free ? body.q + 3 : body.q;
      const Eigen::Quaterniond now(Eigen::Vector4d(at.segment<4>(turn)));
      const Vector3d w = rate.segment<3>(body.v);
      slope.segment<4>(turn) = 0.5 * (now * Eigen::Quaterniond(0, w.x(), w.y(), w.z())).coeffs();
      if (body.kind == JointKind::free) {
        slope.segment<3>(body.q) = rotation_matrix<double>(at.segment<4>(turn)) * rate.segment<3>(body.v + 3);
      }
    }
    return slope;
  }

  VectorXd unit_quaternions(VectorXd at) const {
    for (Index i = 1; i < tree().slots(); ++i) {
      const PlainBody& body = tree().body(i);
      if (body.kind != JointKind::screw) at.segment<4>(body.kind == JointKind::free ? body.q + 3 : body.q).normalize();
    }
    return at;
  }

  std::vector<PlainTouch> touches(const std::vector<BodyMotion>& motions, double dt) const { return fixed_->forces.touches(motions, dt, directions_); }
  bool sudden_at(const VectorXd& at, const VectorXd& rate) const {
    const std::vector<BodyMotion> motions = body_motions(tree(), at, rate);
    return fixed_->forces.sudden(at, rate, motions, touches(motions, 0));
  }

  void step(double t, double dt) {
    const Within within{t, t + dt};
    if (!sudden_at(q, v)) {
      // order 4
      VectorXd dq[4], dv[4];
      for (int stage = 0; stage < 4; ++stage) {
        const double share = stage == 0 ? 0 : stage == 3 ? 1 : 0.5;
        const VectorXd at = stage == 0 ? q : VectorXd(q + share * dt * dq[stage - 1]);
        const VectorXd rate = stage == 0 ? v : VectorXd(v + share * dt * dv[stage - 1]);
        dq[stage] = position_rate(at, rate);
        dv[stage] = acceleration_at(at, rate, t + share * dt, within);
      }
      const VectorXd ahead = unit_quaternions(q + dt / 6 * (dq[0] + 2 * dq[1] + 2 * dq[2] + dq[3]));
      const VectorXd rate = v + dt / 6 * (dv[0] + 2 * dv[1] + 2 * dv[2] + dv[3]);
      if (!sudden_at(ahead, rate)) {
        q = ahead;
        v = rate;
        close_gaps();
        return;
      }
    }
    sudden_step(t, within(t + 0.5 * dt), dt);
  }

  /// Velocities of free joints are those of the frame where the step begins, and seen from that where it ends only afterwards: what
  /// touches the ground is held in one and the same frame all along.
  void sudden_step(double begin, double t, double dt) {
    const MatrixXd& Z = fixed_->Z;
    const std::vector<BodyMotion> motions = body_motions(tree(), q, v, true);
    VectorXd c, k;
    fixed_->forces.joint_gains(q, c, k);
    MatrixXd M = mass_matrix_at(motions);
    M.diagonal() += dt * c + dt * dt * k;
    const Eigen::LLT<MatrixXd> A(Z.transpose() * M * Z);
    const VectorXd force = fixed_->forces.force(q, v, t, motions, false) + spring_force(q, v) - bias_force(tree(), motions) - dt * k.cwiseProduct(v);
    VectorXd given = VectorXd::Zero(fixed_->G.cols());  // changes of velocity
    for (std::size_t j = 0; j < fixed_->moved.size(); ++j) {
      const auto& [row, curve] = fixed_->moved[j];
      given[static_cast<Eigen::Index>(j)] = (curve.derivative(0, begin + dt) - fixed_->forces.position(q, row)) / dt - v[row];
    }
    const VectorXd taken_along = fixed_->G * given;
    // what an impulse makes of velocities, couplings holding
    const MatrixXd C = fixed_->couplings.opening(q), coupled = Z * A.solve(Z.transpose() * C.transpose());
    const VectorXd free = fixed_->couplings.empty() ? VectorXd() : moved_freely(C, M);
    const auto close = [&](auto&& velocity) { velocity -= coupled * PlainCouplings::multipliers(C * coupled, C * velocity, free); };
    const auto responses_to = [&](const MatrixXd& impulses) {
      MatrixXd change = Z * A.solve(Z.transpose() * impulses);
      if (fixed_->couplings.empty()) return change;
      for (Eigen::Index column = 0; column < change.cols(); ++column) close(change.col(column));
      return change;
    };
    VectorXd after = v + taken_along + responses_to(dt * force - M * taken_along);
    if (!fixed_->couplings.empty()) close(after);
    const std::vector<PlainRow> rows = fixed_->forces.rows(q, v, after, motions, touches(motions, dt), eases_, t, dt);
    if (!rows.empty()) {
      MatrixXd W(static_cast<Eigen::Index>(rows.size()), tree().velocities);
      for (std::size_t r = 0; r < rows.size(); ++r) W.row(static_cast<Eigen::Index>(r)) = rows[r].J;
      const MatrixXd response = responses_to(W.transpose());
      const VectorXd lambda = impulses(rows, W * response, W * after);
      after += response * lambda;
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const auto at = static_cast<Eigen::Index>(r);
        if (rows[r].kind != RowKind::servo) sudden += (response.col(at) * lambda[at]).cwiseAbs();
      }
    }
    move(0.5 * (v + after), after, dt);
    close_gaps();
  }

  /// Joints end where their limits were asked, with the velocity that they end with; what turns freely goes on by the mean of both.
  void move(const VectorXd& mean, const VectorXd& after, double dt) {
    v = after;
    for (Index i = 1; i < tree().slots(); ++i) {
      const PlainBody& body = tree().body(i);
      if (body.kind == JointKind::screw) {
        q[body.q] += dt * after[body.v];
        continue;
      }
      const Index turn = body.kind == JointKind::free ? body.q + 3 : body.q;
      const Eigen::Quaterniond before(Eigen::Vector4d(q.segment<4>(turn)));
      const Eigen::Quaterniond moved(rotation_quaternion<double>(dt * mean.segment<3>(body.v)));
      q.segment<4>(turn) = (before * moved).normalized().coeffs();
      if (body.kind == JointKind::free) {
        q.segment<3>(body.q) += dt * (before * Vector3d(mean.segment<3>(body.v + 3)));
        v.segment<3>(body.v + 3) = moved.conjugate() * Vector3d(after.segment<3>(body.v + 3));
      }
    }
  }

  /// Projected Gauss and Seidel; pairs of tangents are kept within their circle together.
  static VectorXd impulses(const std::vector<PlainRow>& rows, const MatrixXd& D, const VectorXd& free) {
    constexpr int kMost = 1000;
    constexpr double kEnough = 1e-13;  // of the largest velocity in question
    const auto count = static_cast<Eigen::Index>(rows.size());
    VectorXd lambda = VectorXd::Zero(count), speed = free;  // speed = free + D lambda
    const auto change = [&](Eigen::Index r, double to) {
      const double by = to - lambda[r];
      if (by == 0) return 0.0;
      speed += by * D.col(r);
      lambda[r] = to;
      return std::abs(by) * D(r, r);
    };
    const double scale = free.cwiseAbs().maxCoeff();
    for (int sweep = 0; sweep < kMost; ++sweep) {
      double most = 0;
      for (Eigen::Index r = 0; r < count; ++r) {
        const PlainRow& row = rows[static_cast<std::size_t>(r)];
        if (row.kind == RowKind::tangent) {
          // both tangents; the normal stands before them
          const double d = std::max(D(r, r), D(r + 1, r + 1)), circle = row.friction * lambda[r - row.back];
          if (d > 0) {
            Eigen::Vector2d to = lambda.segment<2>(r) - speed.segment<2>(r) / d;
            if (to.norm() > circle) to *= circle / to.norm();
            most = std::max({most, change(r, to[0]), change(r + 1, to[1])});
          }
          ++r;
          continue;
        }
        const double d = D(r, r) + row.compliance;
        if (!(d > 0)) continue;
        const double miss = row.goal - speed[r] - row.compliance * lambda[r], twists = row.kind == RowKind::twist ? row.friction * lambda[r - row.back] : 0;
        most = std::max(most, change(r, std::clamp(lambda[r] + miss / d, row.low - twists, row.high + twists)));
      }
      if (most <= kEnough * scale) break;
    }
    return lambda;
  }

  std::shared_ptr<const Fixed> fixed_;
  double eases_ = 0;
  mutable std::vector<Vector3d> directions_;  // of pairs that touch, as they were looked for last

 public:
  VectorXd q, v;     // [nq], [nv]
  double time = 0;   // [s]
  VectorXd sudden;   // [nv] changes of velocity that sudden rows gave so far, each with its size
};

}  // namespace linden::reference
