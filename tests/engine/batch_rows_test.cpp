// Rows of the caller taken in by a step of a batch, observations given out by it, and many instances reset at once.
#include "engine/batch_rows.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/batch.hpp"
#include "engine/queries/observations.hpp"
#include "models/shapes/contacts_of.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::batch_rows_test {
namespace {

/// A humanoid over the ground, with servos, one of them along a table, and joint friction.
struct Stage {
  Model model = load_urdf(model_file("humanoid.urdf"), Base::floating);
  Effects effects = acting(model);
  Options options{.step = 1e-3};

  static Effects acting(const Model& model) {
    std::vector<std::string> notes;
    Effects effects;
    effects.servos = servo_everywhere(model, 100, 5);
    effects.servos[3].target_over_time = {{0, 1}, {0, 0.5}};
    effects.friction = {{effects.servos[0].row, 0.5}, {effects.servos[5].row, 0.1}};
    effects.ground = Ground{.height = -1.0, .stiffness = 2e4, .damping = 50, .contacts = contacts_of(model, notes)};
    return effects;
  }
};

/// Numbers that differ from one another, within low and high.
template <class Real>
std::vector<Real> spread(std::size_t count, double low, double high) {
  std::vector<Real> numbers(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double share = std::fmod(0.6180339887498949 * static_cast<double>(k + 1), 1.0);
    numbers[k] = static_cast<Real>(low + share * (high - low));
  }
  return numbers;
}

/// What a caller gives, over all instances.
template <class Real>
struct Commands {
  std::vector<Real> targets, forces, gains, friction, ground_friction, gravity;

  Commands(const Stage& stage, std::int64_t size) {
    const auto count = [&](std::size_t each) { return static_cast<std::size_t>(size) * each; };
    targets = spread<Real>(count(stage.effects.servos.size()), -0.3, 0.3);
    for (std::size_t k = 3; k < targets.size(); k += 2 * stage.effects.servos.size()) targets[k] = std::numeric_limits<Real>::quiet_NaN();
    forces = spread<Real>(count(static_cast<std::size_t>(stage.model.tree.shape.velocities)), -2, 2);
    gains = spread<Real>(count(stage.effects.servos.size()), 0.5, 1.5);
    friction = spread<Real>(count(stage.effects.friction.size()), 0, 0.5);
    ground_friction = spread<Real>(count(1), 0.2, 1);
    gravity = spread<Real>(count(3), -10, 1);
  }
  BatchRows<Real> rows() const {
    return {.targets = targets, .forces = forces, .gains = gains, .friction = friction, .ground_friction = ground_friction, .gravity = gravity};
  }
};

template <class Real>
void write(BatchView<Real> to, const std::vector<Real>& from, std::int64_t size) {
  for (std::int64_t i = 0; i < size; ++i) {
    for (Index k = 0; k < to.rows(); ++k) to(i, k) = from[static_cast<std::size_t>(i * to.rows() + k)];
  }
}

template <class Real>
bool same(std::span<const Real> a, std::span<const Real> b) {
  using Bits = std::conditional_t<std::is_same_v<Real, double>, std::uint64_t, std::uint32_t>;
  return std::ranges::equal(a, b, {}, std::bit_cast<Bits, Real>, std::bit_cast<Bits, Real>);
}

template <class Real>
BatchOf<Real> started(const Stage& stage, std::int64_t size, int threads) {
  BatchOf<Real> batch(stage.model, size, stage.options, stage.effects, {.threads = threads});
  for (std::int64_t i = 0; i < size; ++i) {
    const InitialState start = random_state(stage.model, static_cast<std::uint64_t>(i + 1), 0.3);
    batch.reset(i, start.positions, start.velocities);
  }
  return batch;
}

template <class Real>
std::vector<std::string> names_seen() {
  std::vector<std::string> names{"q", "v", "p", "energy", "time", "targets", "com", "pose:pelvis", "contact:left_foot"};
  if (std::is_same_v<Real, double>) names.push_back("imu:pelvis");
  return names;
}

}  // namespace

TEMPLATE_TEST_CASE("a step that takes rows in and gives observations out equals views, steps and observe, to the bit", "[batch_rows]",
                   double, float) {
  using Real = TestType;
  const Stage stage;
  const std::int64_t size = 19;
  const Commands<Real> given(stage, size);
  const Observations seen(stage.model, stage.effects, names_seen<Real>());
  BatchOf<Real> apart = started<Real>(stage, size, 1);
  apart.step(5);
  write(apart.servo_targets(), given.targets, size);
  write(apart.forces(), given.forces, size);
  write(apart.gains(), given.gains, size);
  write(apart.friction(), given.friction, size);
  write(apart.ground_friction(), given.ground_friction, size);
  write(apart.gravity(), given.gravity, size);
  apart.step(20);
  std::vector<double> expected(static_cast<std::size_t>(size * seen.width()));
  apart.observe(seen, expected);
  for (const int threads : {1, 3}) {
    BatchOf<Real> batch = started<Real>(stage, size, threads);
    batch.step(5, {});
    std::vector<double> rows(expected.size(), NAN);
    BatchRows<Real> all = given.rows();
    all.observations = &seen;
    all.observed = std::span(rows);
    batch.step(20, all);
    CHECK(same<double>(rows, expected));
    CHECK(same<Real>(batch.positions().flat(), apart.positions().flat()));
    CHECK(same<Real>(batch.momenta().flat(), apart.momenta().flat()));

    // what was given stays, and rows of floats are the same rounded
    std::vector<float> rounded(expected.size(), NAN);
    batch.step(0, {.observations = &seen, .observed = std::span(rounded)});
    for (std::size_t k = 0; k < rows.size(); ++k) REQUIRE(rounded[k] == static_cast<float>(rows[k]));
    batch.step(7, {});
    BatchOf<Real> again = started<Real>(stage, size, 1);
    again.step(5);
    again.step(27, given.rows());
    CHECK(same<Real>(batch.positions().flat(), again.positions().flat()));
  }
}

TEST_CASE("each kind of rows changes the motion, and those left out leave it", "[batch_rows]") {
  const Stage stage;
  const std::int64_t size = 3;
  const Commands<double> given(stage, size);
  const auto moved = [&](const BatchRows<double>& rows) {
    Batch batch(stage.model, size, stage.options, stage.effects);
    std::vector<double> lying = stage.model.neutral(), sliding(static_cast<std::size_t>(stage.model.tree.shape.velocities), 0.3);
    lying[2] = -0.2;
    for (std::int64_t i = 0; i < size; ++i) batch.reset(i, lying, sliding);
    batch.step(30, rows);
    return std::vector<double>(batch.positions().flat().begin(), batch.positions().flat().end());
  };
  const std::vector<double> plain = moved({});
  CHECK(moved({.targets = given.targets}) != plain);
  CHECK(moved({.forces = given.forces}) != plain);
  CHECK(moved({.gains = given.gains}) != plain);
  CHECK(moved({.friction = given.friction}) != plain);
  CHECK(moved({.ground_friction = given.ground_friction}) != plain);
  CHECK(moved({.gravity = given.gravity}) != plain);
}

TEST_CASE("a batch shows momenta and energies of all instances as rows of observations", "[batch_rows]") {
  const Stage stage;
  const std::int64_t size = 5;
  Batch batch = started<double>(stage, size, 2);
  batch.step(10);
  const Observations seen(stage.model, stage.effects, {"p", "q", "energy"});
  const auto width = static_cast<std::size_t>(seen.width());
  std::vector<double> rows(static_cast<std::size_t>(size) * width);
  batch.observe(seen, rows);
  const Batch::Observation whole = batch.observe();
  for (std::int64_t i = 0; i < size; ++i) {
    const double* const row = rows.data() + static_cast<std::size_t>(i) * width;
    for (Index k = 0; k < seen.at("p").width; ++k) CHECK(row[seen.at("p").offset + k] == batch.momenta()(i, k));
    for (Index k = 0; k < seen.at("q").width; ++k) CHECK(row[seen.at("q").offset + k] == batch.positions()(i, k));
    for (Index k = 0; k < 2; ++k) CHECK(row[seen.at("energy").offset + k] == whole.energies()(i, k));
  }
}

TEST_CASE("rows that make no sense are told with instance and joint, and nothing is stepped", "[batch_rows]") {
  const Stage stage;
  const std::int64_t size = 11;
  Batch batch = started<double>(stage, size, 2);
  const std::vector<double> before(batch.positions().flat().begin(), batch.positions().flat().end());
  const Commands<double> good(stage, size);
  const std::size_t servos = stage.effects.servos.size();
  const auto name_of = [&](Index row) { return stage.model.names.velocity[static_cast<std::size_t>(row)]; };
  const auto refuses = [&](const BatchRows<double>& rows, const std::vector<std::string>& parts) {
    std::string message;
    try {
      batch.step(3, rows);
    } catch (const InputError& error) {
      message = error.what();
    }
    for (const std::string& part : parts) CHECK_THAT(message, Catch::Contains(part));
    CHECK(same<double>(batch.positions().flat(), before));
    CHECK(batch.record(0).steps == 0);
  };
  Commands<double> bad = good;
  bad.gains[7 * servos + 2] = -1;
  bad.gains[9 * servos + 1] = -2;  // the first is told
  refuses({.targets = good.targets, .gains = bad.gains},
          {"instance 7", "gains of the servo of joint \"" + name_of(stage.effects.servos[2].row) + "\" is -1", "zero or more"});
  bad.friction[2 * 4 + 1] = -0.5;
  refuses({.friction = bad.friction}, {"instance 4", "friction of joint \"" + name_of(stage.effects.friction[1].row) + "\" is -0.5"});
  bad.ground_friction[10] = -0.25;
  refuses({.ground_friction = bad.ground_friction}, {"instance 10", "friction of the ground is -0.25"});
  bad.forces[static_cast<std::size_t>(stage.model.tree.shape.velocities) * 5] = NAN;
  refuses({.forces = bad.forces}, {"instance 5", "force on joint \"" + name_of(0) + "\" is nan", "finite"});
  bad.targets[servos + 4] = NAN;  // of a servo without a table
  refuses({.targets = bad.targets}, {"instance 1", "target of the servo of joint \"" + name_of(stage.effects.servos[4].row) + "\" is nan"});
  bad.targets[servos + 4] = std::numeric_limits<double>::infinity();
  refuses({.targets = bad.targets}, {"instance 1", "is inf"});

  bad.gravity[3 * 8 + 1] = NAN;
  refuses({.gravity = bad.gravity}, {"instance 8", "gravity along y is nan"});

  const std::vector<double> two(2);
  refuses({.targets = two}, {"targets of 11 instances: 2 numbers given, expected 11 x "});
  const Observations seen(stage.model, stage.effects, {"q"});
  std::vector<double> room(4);
  refuses({.observations = &seen, .observed = std::span(room)}, {"room for 4 numbers given"});
  refuses({.observed = std::span(room)}, {"no observations"});

  Batch bare(stage.model, 2);
  CHECK_THROWS_WITH(bare.step(1, {.targets = two}), Catch::Contains("there is no servo"));
  CHECK_THROWS_WITH(bare.step(1, {.friction = two}), Catch::Contains("there is no joint friction"));
  CHECK_THROWS_WITH(bare.step(1, {.ground_friction = two}), Catch::Contains("there is no ground"));
}

TEST_CASE("many instances are reset at once as one by one, and none where one is wrong", "[batch_rows]") {
  const Stage stage;
  const std::int64_t size = 13;
  const Shape& shape = stage.model.tree.shape;
  const auto nq = static_cast<std::size_t>(shape.positions), nv = static_cast<std::size_t>(shape.velocities);
  const std::vector<std::int64_t> which{12, 0, 5, 7};
  std::vector<double> q, v;
  for (const std::int64_t i : which) {
    const InitialState start = random_state(stage.model, static_cast<std::uint64_t>(100 + i), 0.5);
    q.insert(q.end(), start.positions.begin(), start.positions.end());
    v.insert(v.end(), start.velocities.begin(), start.velocities.end());
  }
  Batch together = started<double>(stage, size, 3), apart = started<double>(stage, size, 1);
  together.step(4);
  apart.step(4);
  together.reset(which, q, v);
  for (std::size_t k = 0; k < which.size(); ++k) apart.reset(which[k], std::span(q).subspan(k * nq, nq), std::span(v).subspan(k * nv, nv));
  CHECK((together.record(5).steps == 0 && together.record(6).steps == 4));
  together.step(6);
  apart.step(6);
  CHECK(same<double>(together.positions().flat(), apart.positions().flat()));
  CHECK(same<double>(together.momenta().flat(), apart.momenta().flat()));

  const std::vector<double> before(together.positions().flat().begin(), together.positions().flat().end());
  const auto refuses = [&](const std::vector<std::int64_t>& some, const std::vector<double>& positions,
                           const std::vector<double>& velocities, const std::string& part) {
    CHECK_THROWS_WITH(together.reset(some, positions, velocities), Catch::Contains(part));
    CHECK(same<double>(together.positions().flat(), before));
    CHECK(together.record(0).steps == 6);
  };
  std::vector<double> broken = q;
  broken[2 * nq] = NAN;
  refuses(which, broken, v, "instance 5: position");
  broken = v;
  broken[3 * nv + 1] = INFINITY;
  refuses(which, q, broken, "instance 7: velocity");
  refuses({12, 0, 5, 12}, q, v, "instance 12 is to be reset twice");
  refuses({12, 0, 5, 13}, q, v, "no instance 13");
  refuses({12, 0}, q, v, "positions of 2 instances");
  together.reset(std::vector<std::int64_t>{}, {}, {});
}

}  // namespace linden::batch_rows_test
