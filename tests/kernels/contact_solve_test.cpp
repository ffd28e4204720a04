#include "kernels/couplings/contact_solve.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "tests/kernels/allocation_counter.hpp"

namespace linden::contact_solve_test {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kHeld = std::numeric_limits<double>::infinity();

class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  /// Spread evenly over the powers of ten between them.
  double of_sizes(double low, double high) { return std::pow(10.0, between(low, high)); }
  Index count(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine_); }
  MatrixXd matrix(Index rows, Index columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&] { return std::normal_distribution<double>()(engine_); });
  }

 private:
  std::mt19937_64 engine_;
};

struct Problem {
  MatrixXd S;
  VectorXd b, lambda, guess;
  std::vector<double> yields;
  std::vector<std::size_t> first;
  std::vector<ContactLaw> laws;
  std::vector<Index> turns;  // rows of turns of each contact: 0 or 3; fewer numbers than contacts: 0 of the others

  explicit Problem(Index rows)
      : S(MatrixXd::Zero(rows, rows)), b(VectorXd::Zero(rows)), lambda(b), guess(b), yields(static_cast<std::size_t>(rows), 0.0) {}

  Index rows() const { return b.size(); }
  double yield(Index row) const { return yields[static_cast<std::size_t>(row)]; }
  Index turns_of(std::size_t contact) const { return contact < turns.size() ? turns[contact] : 0; }
  std::vector<Index> linear_rows() const {
    std::vector<Index> list;
    for (Index k = 0; k < rows(); ++k) {
      const auto row = static_cast<std::size_t>(k);
      bool of_contact = false;
      for (std::size_t c = 0; c < first.size(); ++c) of_contact = of_contact || (row >= first[c] && row < first[c] + 3 + static_cast<std::size_t>(turns_of(c)));
      if (!of_contact) list.push_back(k);
    }
    return list;
  }
};

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// S as a product of itself and of 1: all rows are felt by one group.
struct WholeProduct {
  Rows S, one;

  explicit WholeProduct(const MatrixXd& of) : S(of), one(MatrixXd::Identity(of.rows(), of.cols())) {}
  ContactSolve::Product terms(const Problem& problem) const {
    const auto rows = static_cast<std::size_t>(S.rows());
    ContactSolve::Product product{{{rows, false}}, {}, {}};
    const auto add = [&](std::size_t first, std::size_t count, bool touches) {
      product.blocks.push_back({first, count, product.terms.size(), product.terms.size() + 1, touches});
      product.terms.push_back({0, S.row(static_cast<Index>(first)).data(), one.row(static_cast<Index>(first)).data(), 1, rows});
    };
    for (std::size_t c = 0; c < problem.first.size(); ++c) add(problem.first[c], 3 + static_cast<std::size_t>(problem.turns_of(c)), true);
    for (const Index row : problem.linear_rows()) add(static_cast<std::size_t>(row), 1, false);
    return product;
  }
};

/// Of a solver that is prepared.
VectorXd answer(ContactSolve& solver, const Problem& problem) {
  const std::vector<double> guess(problem.guess.data(), problem.guess.data() + problem.rows());
  const std::vector<double> lambda(problem.lambda.data(), problem.lambda.data() + problem.rows());
  VectorXd z = problem.b;
  solver.solve({problem.yields, problem.first, problem.laws, lambda, guess}, {z.data(), static_cast<std::size_t>(z.size())});
  return z;
}

VectorXd solved(ContactSolve& solver, const Problem& problem) {
  const WholeProduct whole(problem.S);
  solver.prepare(whole.terms(problem));
  return answer(solver, problem);
}

VectorXd solved(const Problem& problem) {
  ContactSolve solver;
  return solved(solver, problem);
}

/// By how much z misses what is asked of it, beside the largest there is of its kind.
double violation(const Problem& problem, const VectorXd& z) {
  const VectorXd opens = problem.S * z - problem.b, x = problem.lambda + z;
  const double scale = 1 + x.lpNorm<Eigen::Infinity>();
  double worst = 0;
  for (const Index k : problem.linear_rows()) {
    worst = std::max(worst, problem.yield(k) == kHeld ? std::abs(z[k]) : std::abs(opens[k] + problem.yield(k) * z[k]) / scale);
  }
  for (std::size_t c = 0; c < problem.first.size(); ++c) {
    const auto at = static_cast<Index>(problem.first[c]);
    const ContactLaw& law = problem.laws[c];
    const Vector2d s = opens.segment<2>(at), friction = -law.friction * x[at + 2] * s / std::max(s.norm(), law.creep);
    worst = std::max(worst, std::abs(x[at + 2] - law.stiffness * std::max(-(opens[at + 2] + law.lift), 0.0)) / scale);
    worst = std::max(worst, (x.segment<2>(at) - friction).norm() / scale);
    if (problem.turns_of(c) == 0) continue;
    const Vector2d rolls = opens.segment<2>(at + 3);
    const double spins = opens[at + 5];
    worst = std::max(worst, (x.segment<2>(at + 3) + law.rolling * x[at + 2] * rolls / std::max(rolls.norm(), law.creep)).norm() / scale);
    worst = std::max(worst, std::abs(x[at + 5] + law.torsion * x[at + 2] * spins / std::max(std::abs(spins), law.creep)) / scale);
  }
  return worst;
}

/// Friction that is `most` or less, of a point that would move by `free`, and moves by free + S x: x = -drag (free + S x), drag found by bisection.
Vector2d friction_of(double most, double creep, const Matrix2d& S, const Vector2d& free) {
  double low = 0, high = most / creep;
  const auto moves = [&](double drag) { return Vector2d((Matrix2d::Identity() + drag * S).inverse() * free); };
  if (moves(high).norm() > creep) {
    for (int k = 0; k < 200 && high - low > 1e-16 * high; ++k) {
      const double drag = (low + high) / 2;
      (drag * moves(drag).norm() < most ? low : high) = drag;
    }
  }
  return -high * moves(high);
}

/// The plain twin: row after row, of a contact its normal and then its friction, as if all others stood, until nothing changes.
VectorXd settled(const Problem& problem) {
  const MatrixXd& S = problem.S;
  VectorXd z = VectorXd::Zero(problem.rows());
  for (int sweep = 0; sweep < 100000; ++sweep) {
    const VectorXd before = z;
    for (const Index k : problem.linear_rows()) {
      if (problem.yield(k) != kHeld) z[k] += (problem.b[k] - S.row(k) * z - problem.yield(k) * z[k]) / (S(k, k) + problem.yield(k));
    }
    for (std::size_t c = 0; c < problem.first.size(); ++c) {
      const auto at = static_cast<Index>(problem.first[c]), n = at + 2;
      const ContactLaw& law = problem.laws[c];
      const double x = problem.lambda[n] + z[n], free = S.row(n) * z - problem.b[n] - S(n, n) * x + law.lift;
      const double load = std::max(0.0, -law.stiffness * free / (1 + law.stiffness * S(n, n)));
      z[n] = load - problem.lambda[n];
      const auto rub = [&](Index row, double most) {
        const Matrix2d across = S.block<2, 2>(row, row);
        const Vector2d moves = S.middleRows<2>(row) * z - problem.b.segment<2>(row);
        z.segment<2>(row) = friction_of(most, law.creep, across, moves - across * (problem.lambda + z).segment<2>(row)) - problem.lambda.segment<2>(row);
      };
      rub(at, law.friction * load);
      if (problem.turns_of(c) == 0) continue;
      rub(at + 3, law.rolling * load);
      const Index w = at + 5;
      const double spins = S.row(w) * z - problem.b[w] - S(w, w) * (problem.lambda[w] + z[w]);
      z[w] = friction_of(law.torsion * load, law.creep, Vector2d(S(w, w), 1).asDiagonal(), {spins, 0})[0] - problem.lambda[w];
    }
    if ((z - before).lpNorm<Eigen::Infinity>() <= 1e-15 * (1 + z.lpNorm<Eigen::Infinity>())) return z;
  }
  FAIL("the plain twin does not settle");
  return z;
}

/// Contacts, of which this share resist turning, and linear rows in any order; multipliers, right sides and lifts of all signs and sizes that there are.
Problem random_problem(Numbers& random, double turning = 0) {
  const Index contacts = random.count(1, 6), linear = random.count(0, 3);
  std::vector<Index> blocks;
  for (Index k = 0; k < contacts; ++k) blocks.push_back(turning > 0 && random.between(0, 1) < turning ? 6 : 3);
  const Index rows = std::accumulate(blocks.begin(), blocks.end(), linear);
  Problem problem(rows);
  const MatrixXd J = random.matrix(rows, rows + 6);
  problem.S = J * J.transpose() / static_cast<double>(rows + 6);
  problem.b = random.matrix(rows, 1);
  problem.lambda = random.matrix(rows, 1);
  problem.guess = random.matrix(rows, 1);
  for (Index k = 0; k < linear; ++k) blocks.insert(blocks.begin() + random.count(0, static_cast<int>(blocks.size())), 1);
  Index row = 0;
  for (const Index block : blocks) {
    if (block >= 3) {
      problem.first.push_back(static_cast<std::size_t>(row));
      problem.turns.push_back(block - 3);
      problem.b.segment<2>(row) *= random.of_sizes(-2, 0);
      problem.b[row + 2] *= 5;
      problem.laws.push_back({random.of_sizes(-3, 3) / problem.S(row + 2, row + 2), random.between(0, 0.5), random.of_sizes(-5, -1),
                              random.count(0, 1) == 0 ? 0 : random.between(0, 0.5)});
      if (block == 6) {
        problem.b.segment<3>(row + 3) *= random.of_sizes(-4, 0);
        problem.laws.back().rolling = random.count(0, 3) == 0 ? 0 : random.between(0, 0.6);
        problem.laws.back().torsion = random.count(0, 3) == 0 ? 0 : random.between(0, 0.3);
      }
    } else {
      const double kinds[] = {0, random.of_sizes(-2, 1), kHeld};
      problem.yields[static_cast<std::size_t>(row)] = kinds[random.count(0, 2)];
    }
    row += block;
  }
  return problem;
}

/// One contact of a body of 2 kg: a ball that may turn gives way across 3.5 times as easily as one that may not.
Problem single(double across, const Vector3d& b, const ContactLaw& law, const Vector3d& lambda = Vector3d::Zero()) {
  Problem problem(3);
  problem.S.diagonal() << across, across, 0.5;
  problem.b = b;
  problem.lambda = lambda;
  problem.first = {0};
  problem.laws = {law};
  return problem;
}

/// Contacts and other rows of bodies that are joined to a few others, as S = Y X of them and as the matrix itself.
struct Bodies {
  struct Row {
    std::vector<std::size_t> groups;
    bool touches;
    std::size_t rows;
  };
  std::vector<ContactSolve::Group> groups;
  std::vector<Row> blocks;
  std::vector<Rows> across, columns;  // of each block and group, row by row
  Problem problem{0};

  ContactSolve::Product product() const {
    ContactSolve::Product product{groups, {}, {}};
    std::size_t row = 0;
    for (const Row& block : blocks) {
      product.blocks.push_back({row, block.rows, product.terms.size(), product.terms.size() + block.groups.size(), block.touches});
      for (const std::size_t group : block.groups) {
        const std::size_t k = product.terms.size();
        product.terms.push_back({group, across[k].data(), columns[k].data(), 1, groups[group].size});
      }
      row += block.rows;
    }
    return product;
  }
};

/// `count` bodies in a row, each beside the next, every third beside one farther on; loops hang between some, said twice; some bodies carry a loop that
/// is closed below, which takes from what they yield. unlike: by how much X and Y differ.
Bodies random_bodies(Numbers& random, std::size_t count, bool loops, double unlike) {
  Bodies bodies;
  for (std::size_t k = 0; k < count; ++k) bodies.groups.push_back({k % 4 == 3 ? 1u : 6u, false});
  const auto add = [&](std::vector<std::size_t> groups, bool touches, std::size_t rows) { bodies.blocks.push_back({std::move(groups), touches, rows}); };
  for (std::size_t k = 0; k + 1 < count; ++k) {
    if (loops && k % 5 == 2) add({k, k + 1}, false, 2);
    add({k, k + 1}, true, 3);
    if (k % 3 == 0 && k + 4 < count) add({k + 4, k}, true, 3);
  }
  add({0}, true, 3);
  // rows of loops that are closed below, each on two bodies next to each other
  std::vector<std::size_t> below;
  for (std::size_t k = 0; loops && k + 1 < count; k += 6) {
    below.push_back(bodies.groups.size());
    bodies.groups.push_back({1, true});
    for (Bodies::Row& block : bodies.blocks) {
      if (std::ranges::count(block.groups, k) > 0) block.groups.push_back(below.back());
    }
  }
  std::size_t rows = 0, numbers = 0;
  std::vector<std::size_t> first;
  for (const ContactSolve::Group& group : bodies.groups) {
    first.push_back(numbers);
    numbers += group.size;
  }
  for (const Bodies::Row& block : bodies.blocks) rows += block.rows;
  Problem& problem = bodies.problem = Problem(static_cast<Index>(rows));
  MatrixXd Y = MatrixXd::Zero(static_cast<Index>(rows), static_cast<Index>(numbers)), X = Y;
  std::size_t row = 0;
  for (const Bodies::Row& block : bodies.blocks) {
    const auto at = static_cast<Index>(row), height = static_cast<Index>(block.rows);
    for (const std::size_t group : block.groups) {
      const auto begin = static_cast<Index>(first[group]), size = static_cast<Index>(bodies.groups[group].size);
      Rows of(height, size);
      if (bodies.groups[group].late) {
        // what the body that carries it makes of the rows, along one direction of its own, is half taken away
        const auto carrier = static_cast<Index>(first[6 * (group - below.front())]);
        of = std::sqrt(0.5) * X.block(at, carrier, height, 1);
      } else {
        of = random.matrix(height, size);
        if (!block.touches) of.row(1) = of.row(0);  // said twice
      }
      X.block(at, begin, height, size) = of;
      bodies.columns.push_back(of);
      if (bodies.groups[group].late) of = -of;
      of += unlike * random.matrix(height, size);
      Y.block(at, begin, height, size) = of;
      bodies.across.push_back(of);
    }
    if (block.touches) {
      problem.first.push_back(row);
      problem.laws.push_back({random.of_sizes(-1, 3), random.between(0, 0.2), random.of_sizes(-5, -1), random.count(0, 1) == 0 ? 0 : random.between(0, 0.5)});
    } else {
      problem.yields[row + 1] = kHeld;
      if (random.count(0, 1) == 0) problem.yields[row] = random.of_sizes(-2, 1);
    }
    row += block.rows;
  }
  problem.S = Y * X.transpose();
  problem.b = random.matrix(problem.rows(), 1);
  problem.lambda = random.matrix(problem.rows(), 1);
  problem.guess = random.matrix(problem.rows(), 1);
  return bodies;
}

}  // namespace

TEST_CASE("multipliers of contacts are those of the law, and all other rows close", "[contact_solve]") {
  Numbers random(1);
  double worst = 0, apart = 0;
  int pressing = 0, sliding = 0, sticking = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Problem problem = random_problem(random);
    CAPTURE(trial, problem.first.size(), problem.rows());
    const VectorXd z = solved(problem), twin = settled(problem);
    worst = std::max(worst, violation(problem, z));
    apart = std::max(apart, (z - twin).lpNorm<Eigen::Infinity>() / (1 + twin.lpNorm<Eigen::Infinity>()));
    REQUIRE(violation(problem, twin) < 1e-9);
    REQUIRE(violation(problem, z) < 1e-9);
    const VectorXd opens = problem.S * z - problem.b;
    for (std::size_t c = 0; c < problem.first.size(); ++c) {
      const auto at = static_cast<Index>(problem.first[c]);
      if (problem.lambda[at + 2] + z[at + 2] <= 0) continue;
      ++pressing;
      ++(opens.segment<2>(at).norm() > problem.laws[c].creep ? sliding : sticking);
    }
  }
  CAPTURE(worst, apart, pressing, sliding, sticking);
  CHECK(apart < 1e-9);
  CHECK(sliding > 100);
  CHECK(sticking > 20);
}

TEST_CASE("multipliers of contacts that resist turning are those of the law, whatever a solve begins with", "[contact_solve]") {
  Numbers random(9);
  double worst = 0, apart = 0, begun = 0;
  int rolling = 0, clinging = 0, spinning = 0, standing = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Problem problem = random_problem(random, 0.7);
    CAPTURE(trial, problem.first.size(), problem.rows());
    const VectorXd z = solved(problem), twin = settled(problem), opens = problem.S * z - problem.b;
    REQUIRE(violation(problem, twin) < 1e-9);
    REQUIRE(violation(problem, z) < 1e-9);
    worst = std::max(worst, violation(problem, z));
    apart = std::max(apart, (z - twin).lpNorm<Eigen::Infinity>() / (1 + twin.lpNorm<Eigen::Infinity>()));
    problem.guess = 10 * random.matrix(problem.rows(), 1);
    begun = std::max(begun, (solved(problem) - z).lpNorm<Eigen::Infinity>() / (1 + z.lpNorm<Eigen::Infinity>()));
    for (std::size_t c = 0; c < problem.first.size(); ++c) {
      const auto at = static_cast<Index>(problem.first[c]);
      if (problem.turns_of(c) == 0 || problem.lambda[at + 2] + z[at + 2] <= 0) continue;
      if (problem.laws[c].rolling > 0) ++(opens.segment<2>(at + 3).norm() > problem.laws[c].creep ? rolling : clinging);
      if (problem.laws[c].torsion > 0) ++(std::abs(opens[at + 5]) > problem.laws[c].creep ? spinning : standing);
    }
  }
  CAPTURE(worst, apart, begun, rolling, clinging, spinning, standing);
  CHECK(apart < 1e-9);
  CHECK(begun < 1e-9);
  CHECK(std::min(rolling, spinning) > 100);
  CHECK(std::min(clinging, standing) > 20);
}

TEST_CASE("rows of turns that nothing resists change nothing", "[contact_solve]") {
  Numbers random(10);
  for (int trial = 0; trial < 100; ++trial) {
    Problem with = random_problem(random, 1);
    for (ContactLaw& law : with.laws) law.rolling = law.torsion = 0;
    Problem without(with.rows() - 3 * static_cast<Index>(with.first.size()));
    std::vector<Index> kept;  // rows of the one in the other
    for (Index row = 0; row < with.rows(); ++row) {
      const auto is_turn = [&](std::size_t at) { return row >= static_cast<Index>(at) + 3 && row < static_cast<Index>(at) + 6; };
      if (std::ranges::none_of(with.first, is_turn)) kept.push_back(row);
    }
    for (std::size_t c = 0; c < with.first.size(); ++c) {
      for (Index j = static_cast<Index>(with.first[c]) + 3; j < static_cast<Index>(with.first[c]) + 6; ++j) with.lambda[j] = with.guess[j] = 0;
      without.first.push_back(with.first[c] - 3 * c);
    }
    without.laws = with.laws;
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const auto to = static_cast<Index>(k);
      without.yields[k] = with.yields[static_cast<std::size_t>(kept[k])];
      without.b[to] = with.b[kept[k]];
      without.lambda[to] = with.lambda[kept[k]];
      without.guess[to] = with.guess[kept[k]];
      for (std::size_t j = 0; j < kept.size(); ++j) without.S(to, static_cast<Index>(j)) = with.S(kept[k], kept[j]);
    }
    const VectorXd z = solved(with), less = solved(without);
    for (std::size_t k = 0; k < kept.size(); ++k) CHECK(z[kept[k]] == Approx(less[static_cast<Index>(k)]).margin(1e-10));
    for (std::size_t c = 0; c < with.first.size(); ++c) CHECK(z.segment<3>(static_cast<Index>(with.first[c]) + 3).norm() == 0);
  }
}

TEST_CASE("whatever a solve begins with, it ends with the same multipliers", "[contact_solve]") {
  Numbers random(2);
  double apart = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Problem problem = random_problem(random);
    const VectorXd z = solved(problem);
    for (const double size : {0.0, 1.0, 100.0}) {
      problem.guess = size * random.matrix(problem.rows(), 1);
      apart = std::max(apart, (solved(problem) - z).lpNorm<Eigen::Infinity>() / (1 + z.lpNorm<Eigen::Infinity>()));
    }
  }
  CHECK(apart < 1e-9);
}

TEST_CASE("a matrix that is slightly unsymmetric changes nothing of that", "[contact_solve]") {
  Numbers random(4);
  double worst = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Problem problem = random_problem(random);
    problem.S += 1e-3 * random.matrix(problem.rows(), problem.rows());
    worst = std::max(worst, violation(problem, solved(problem)));
  }
  CHECK(worst < 1e-9);
}

TEST_CASE("of bodies that touch a few others, with loops, a solve by their motions is that by the whole matrix", "[contact_solve]") {
  Numbers random(7);
  double worst = 0, apart = 0;
  for (int trial = 0; trial < 120; ++trial) {
    const bool loops = trial % 2 == 0;
    const auto count = static_cast<std::size_t>(random.count(2, 24));
    const Bodies bodies = random_bodies(random, count, loops, trial % 3 == 0 ? 1e-3 : 0);
    CAPTURE(trial, count, loops);
    ContactSolve solver;
    solver.prepare(bodies.product());
    const VectorXd z = answer(solver, bodies.problem), whole = solved(bodies.problem);
    worst = std::max(worst, violation(bodies.problem, z));
    apart = std::max(apart, (z - whole).lpNorm<Eigen::Infinity>() / (1 + whole.lpNorm<Eigen::Infinity>()));
    // once more, with other numbers in between
    const VectorXd again = answer(solver, bodies.problem);
    solver.renew();
    const VectorXd anew = answer(solver, bodies.problem);
    CHECK((again - z).lpNorm<Eigen::Infinity>() <= 1e-9 * (1 + z.lpNorm<Eigen::Infinity>()));
    CHECK(anew == z);
  }
  CHECK(worst < 1e-9);
  CHECK(apart < 1e-9);
}

TEST_CASE("the order of contacts is of no account", "[contact_solve]") {
  Numbers random(8);
  double apart = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Bodies bodies = random_bodies(random, 12, false, 0);
    // back to front: terms are one after the other, two of each contact but the last
    ContactSolve::Product turned = bodies.product();
    std::ranges::reverse(turned.blocks);
    Problem problem(bodies.problem.rows());
    Index row = 0;
    for (ContactSolve::Block& block : turned.blocks) {
      const auto from = static_cast<Index>(block.first);
      problem.b.segment<3>(row) = bodies.problem.b.segment<3>(from);
      problem.lambda.segment<3>(row) = bodies.problem.lambda.segment<3>(from);
      problem.guess.segment<3>(row) = bodies.problem.guess.segment<3>(from);
      problem.first.push_back(static_cast<std::size_t>(row));
      problem.laws.push_back(bodies.problem.laws[block.first / 3]);
      block.first = static_cast<std::size_t>(row);
      row += 3;
    }
    ContactSolve one, other;
    one.prepare(bodies.product());
    other.prepare(turned);
    const VectorXd z = answer(one, bodies.problem), back = answer(other, problem);
    for (Index k = 0; k < row; k += 3) apart = std::max(apart, (z.segment<3>(k) - back.segment<3>(row - 3 - k)).norm() / (1 + z.norm()));
  }
  CHECK(apart < 1e-9);
}

TEST_CASE("a hundred bodies in a row take ten times as many numbers as ten", "[contact_solve]") {
  const auto numbers_of = [](std::size_t count) {
    std::vector<FrontalSolve::Group> groups(count, {6, false});
    FrontalSolve::Elements elements;
    for (std::size_t k = 0; k + 1 < count; ++k) {
      elements.groups.insert(elements.groups.end(), {k, k + 1});
      elements.first.push_back(elements.groups.size());
    }
    FrontalSolve solve;
    solve.analyse(groups, elements);
    return static_cast<double>(solve.factor_numbers());
  };
  CHECK(numbers_of(100) < 11.5 * numbers_of(10));
  CHECK(numbers_of(1000) < 10.5 * numbers_of(100));
}

TEST_CASE("one contact that rests, slides, rolls or parts is a closed form", "[contact_solve]") {
  const double K = 1e4, mu = 0.5, creep = 1e-9;
  const ContactLaw law{K, mu, creep, 0};
  const double load = K * 2e-3 / (1 + 0.5 * K);  // that holds what would come 2 mm nearer
  SECTION("what rests bears its weight, and pushed a little it creeps by the share of its friction that holds it") {
    const Vector3d z = solved(single(0.5, {0, 1e-4, 2e-3}, law));
    CHECK(z[2] == Approx(load).epsilon(1e-13));
    CHECK(z[0] == 0);
    const double drag = mu * load / creep;
    CHECK(z[1] == Approx(drag * 1e-4 / (1 + 0.5 * drag)).epsilon(1e-12));
    CHECK(std::abs(1e-4 - 0.5 * z[1]) < creep);
  }
  SECTION("what slides is dragged against its way by mu times what it bears") {
    const Vector3d z = solved(single(0.5, {-0.03, 0.04, 2e-3}, law));
    CHECK(z[2] == Approx(load).epsilon(1e-13));
    CHECK(z[0] == Approx(-0.6 * mu * load).epsilon(1e-12));
    CHECK(z[1] == Approx(0.8 * mu * load).epsilon(1e-12));
  }
  SECTION("what rolls is held by two sevenths of the friction that would stop it") {
    const double across = 0.5 * 3.5, speed = 1e-3;
    const Vector3d z = solved(single(across, {speed, 0, 2e-3}, law));
    CHECK(z[0] == Approx(speed / across).epsilon(1e-5));
    CHECK(z[0] < mu * load);
    CHECK(std::abs(speed - across * z[0]) < creep);
  }
  SECTION("what parts loses what pushed it") {
    const Vector3d lambda{0.01, -0.02, 0.05};
    const Vector3d z = solved(single(0.5, {0.1, 0, -0.2}, law, lambda));
    CHECK((z + lambda).norm() < 1e-15);
  }
  SECTION("depth that is lifted does not push") {
    const Vector3d z = solved(single(0.5, {0, 0, 2e-3}, {K, mu, creep, 1.5e-3}));
    CHECK(z[2] == Approx(load / 4).epsilon(1e-12));
  }
  SECTION("nothing touches where stiffness is zero") { CHECK(solved(single(0.5, {0.1, 0, 2e-3}, {0, mu, creep, 0})).norm() == 0); }
}

TEST_CASE("stacks of ten are solved in a few corrections", "[contact_solve]") {
  Numbers random(5);
  int most = 0, sum = 0, most_rounds = 0;
  double worst = 0;
  for (int trial = 0; trial < 100; ++trial) {
    // points on top of each other, the lowest on the floor; they come down, and slide, at speeds of their own
    constexpr Index kBodies = 10;
    constexpr double kStep = 1e-3;
    Problem problem(3 * kBodies);
    VectorXd mobility(kBodies), speed(3 * kBodies);
    for (Index k = 0; k < kBodies; ++k) {
      mobility[k] = 1 / random.of_sizes(-1, 1);
      speed.segment<3>(3 * k) << random.between(-0.1, 0.1), random.between(-0.1, 0.1), random.between(-0.2, 0.1) - 9.81 * kStep;
      for (Index j = 0; j < 3; ++j) {
        const Index row = 3 * k + j;
        problem.S(row, row) = mobility[k] + (k > 0 ? mobility[k - 1] : 0);
        if (k > 0) problem.S(row, row - 3) = problem.S(row - 3, row) = -mobility[k - 1];
        problem.b[row] = -kStep * (speed[row] - (k > 0 ? speed[row - 3] : 0));
      }
      problem.first.push_back(static_cast<std::size_t>(3 * k));
      problem.laws.push_back({kStep * kStep * random.of_sizes(6, 9), random.between(0, 1), kStep * 1e-6, 0});
    }
    ContactSolve solver;
    const VectorXd z = solved(solver, problem);
    worst = std::max(worst, violation(problem, z) * (1 + z.lpNorm<Eigen::Infinity>()) / z.lpNorm<Eigen::Infinity>());
    most = std::max(most, solver.corrections());
    most_rounds = std::max(most_rounds, solver.rounds());
    sum += solver.corrections();
  }
  CAPTURE(most, sum, most_rounds, worst);
  CHECK(worst < 2e-9);
  CHECK(most <= 60);
  CHECK(most_rounds <= 3);
  CHECK(sum <= 2200);  // before loads were solved for too it was 2000: across and along are apart here, and there is nothing to gain
}

TEST_CASE("a solve of as many rows as before allocates nothing", "[contact_solve]") {
  Numbers random(6);
  Problem problem = random_problem(random);
  while (problem.rows() != 18 || problem.turns_of(0) == 0) problem = random_problem(random, 0.5);
  const WholeProduct whole(problem.S);
  const std::vector<double> lambda(18, 0.1), guess(18, 0.0);
  std::vector<double> z(18);
  const ContactSolve::Rows rows{problem.yields, problem.first, problem.laws, lambda, guess};
  ContactSolve solver;
  solver.prepare(whole.terms(problem));
  std::copy_n(problem.b.data(), 18, z.begin());
  solver.solve(rows, z);
  std::copy_n(problem.b.data(), 18, z.begin());
  solver.renew();
  const AllocationCounter counter;
  solver.solve(rows, z);
  const auto count = counter.count();
  CHECK(count == 0);
}

}  // namespace linden::contact_solve_test
