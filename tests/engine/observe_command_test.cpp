// --observe of run and rollout: observations by name in tables, arrays and pictures.
#include <fmt/format.h>
#include <hdf5.h>

#include <cstring>

#include "engine/queries/kinematics.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/queries/observations.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/command_line.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::observe_command_test {
namespace {

std::vector<double> doubles_of(const Array& array) {
  REQUIRE(array.type == "<f8");
  std::vector<double> numbers(array.bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), array.bytes.data(), array.bytes.size());
  return numbers;
}

/// Words of an attribute of a dataset.
std::vector<std::string> attribute(const std::string& file, const std::string& dataset, const char* name) {
  const hid_t in = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t found = H5Aopen_by_name(in, dataset.c_str(), name, H5P_DEFAULT, H5P_DEFAULT);
  REQUIRE(found >= 0);
  const hid_t type = H5Aget_type(found), space = H5Aget_space(found);
  std::vector<char*> words(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  REQUIRE(H5Aread(found, type, words.data()) >= 0);
  const std::vector<std::string> texts(words.begin(), words.end());
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, words.data());
  H5Sclose(space);
  H5Tclose(type);
  H5Aclose(found);
  H5Fclose(in);
  return texts;
}

const std::string kArm = LINDEN_MODELS_DIR "/arm.urdf";

}  // namespace

TEST_CASE("a run records observations beside positions and velocities, as the library sees them", "[command line]") {
  const Shell shell;
  const std::vector<std::string> names{"pose:link_7", "com", "q", "energy", "imu:link_6"};
  const std::string run = "run " + kArm + " --duration 0.05 --seed 3 --spread 0.4 --observe pose:link_7,com,q,energy,imu:link_6 --record ";
  for (const std::string ending : {"csv", "npz", "h5"}) REQUIRE(shell.linden(run + "a." + ending).exit_code == 0);
  const Model model = load_urdf(model_file("arm.urdf"));
  const InitialState start = random_state(model, 3, 0.4);
  Observations seen(model, {}, names);
  std::vector<double> row(static_cast<std::size_t>(seen.width()));
  for (const std::string ending : {"npz", "h5"}) {
    const Arrays arrays = read(shell.file("a." + ending));
    CHECK((arrays.contains("q") && arrays.contains("v")));
    const std::map<std::string, std::string> called{{"pose:link_7", "pose:link_7"}, {"com", "com"}, {"q", "q_2"}, {"energy", "energy_2"},
                                                    {"imu:link_6", "imu:link_6"}};
    Simulation now(model);
    now.set_positions(start.positions);
    now.set_velocities(start.velocities);
    for (std::size_t k = 0; k <= 50; ++k) {
      if (k > 0) linden::run(now, 1);
      seen.observe(now, row);
      for (const Observed& entry : seen.layout()) {
        const Array& array = arrays.at(called.at(entry.name));
        const std::vector<double> numbers = doubles_of(array);
        REQUIRE(array.shape == std::vector<std::int64_t>{51, 1, entry.width});
        for (Index i = 0; i < entry.width; ++i) {
          CHECK(numbers.at(k * static_cast<std::size_t>(entry.width) + static_cast<std::size_t>(i)) ==
                row[static_cast<std::size_t>(entry.offset + i)]);
        }
        CHECK(arrays.at(entry.name + "_names").words == entry.rows);
      }
    }
  }
  CHECK(attribute(shell.file("a.h5"), "pose:link_7", "units") == std::vector<std::string>{"m, 1"});
  CHECK(attribute(shell.file("a.h5"), "pose:link_7", "names") == seen.at("pose:link_7").rows);
  const std::string table = text_of(shell / "a.csv");
  CHECK_THAT(table.substr(0, table.find('\n')), Contains(",pose:link_7.x,pose:link_7.y,") && Contains(",com.z,") && Contains(",energy.kinetic,"));
}

TEST_CASE("a rollout records observations of every instance", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("rollout " + kArm + " --instances 5 --duration 0.02 --spread 0.3 --every 5 --record a.npz --observe energy,twist:link_5,q")
              .exit_code == 0);
  const Arrays arrays = read(shell.file("a.npz"));
  const Model model = load_urdf(model_file("arm.urdf"));
  const std::vector<double> q = doubles_of(arrays.at("q")), v = doubles_of(arrays.at("v"));
  CHECK(doubles_of(arrays.at("q_2")) == q);
  const Array& twists = arrays.at("twist:link_5");
  REQUIRE(twists.shape == std::vector<std::int64_t>{5, 5, 6});
  const std::vector<double> twist = doubles_of(twists), energy = doubles_of(arrays.at("energy")), parts = doubles_of(arrays.at("energy_2"));
  const auto nq = static_cast<std::size_t>(model.tree.shape.positions), nv = static_cast<std::size_t>(model.tree.shape.velocities);
  for (std::size_t k = 0; k < 25; ++k) {
    CHECK(energy[k] == Approx(parts[2 * k] + parts[2 * k + 1]).epsilon(1e-12).margin(1e-12));
    const SpatialMotion expected =
        link_twist(Kinematics(model, std::span(q).subspan(k * nq, nq), std::span(v).subspan(k * nv, nv)), place_of(model, "link_5"));
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(twist[6 * k + i] == Approx(expected.angular[i]).epsilon(1e-12).margin(1e-12));
      CHECK(twist[6 * k + 3 + i] == Approx(expected.linear[i]).epsilon(1e-12).margin(1e-12));
    }
  }
  REQUIRE(shell.linden("rollout chain:3 --instances 3 --float --duration 0.01 --record f.npz --what energies --observe com").exit_code == 0);
  CHECK(read(shell.file("f.npz")).at("com").type == "<f4");
}

TEST_CASE("observations are plotted, a panel each", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run " + kArm + " --duration 0.05 --plot a.svg --record a.csv --observe position:link_7,com_velocity").exit_code == 0);
  const std::string picture = text_of(shell / "a.svg");
  CHECK_THAT(picture, Contains("position:link_7 [m]") && Contains("com_velocity [m/s]"));
  CHECK_THAT(picture, !Contains("positions [rad") && !Contains("Energy drift"));
}

TEST_CASE("observations that there are not are refused in one line, with the nearest name", "[command line]") {
  const Shell shell;
  for (const std::string command : {"run ", "rollout "}) {
    const std::string begin = command + kArm + " --record a.npz --observe ";
    check_refused(shell, begin + "pse:link_7", "--observe: observation \"pse:link_7\" is not known");
    check_refused(shell, begin + "pose:lnk_7", "did you mean \"link_7\"?");
    check_refused(shell, begin + "com,,q", "--observe: observation \"\" is not known");
    check_refused(shell, begin + "com,com", "twice");
    check_refused(shell, begin + "contact:link_7", "no ground");
    check_refused(shell, begin + "targets", "no servo");
    check_refused(shell, command + kArm + " --observe com", "--observe says what --record");
  }
  check_refused(shell, "rollout " + kArm + " --float --record a.npz --observe a", "single precision");
  check_refused(shell, "run " + kArm + " --order 4 --record a.npz --observe imu:link_7", "expected order 2");
}

}  // namespace linden::observe_command_test
