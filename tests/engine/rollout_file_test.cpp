// Rollout files read back to the same bits through the libraries of their formats and through Python, and appear whole or not at all.
#include <fmt/format.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <zip.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/files/rollout_file.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/folder.hpp"

namespace linden::rollout_file_test {
namespace {

namespace fs = std::filesystem;
using Catch::Matchers::Contains;

const std::string kEndings[] = {".npz", ".h5"};

// ---- something to write

constexpr std::int64_t kInstances = 3;

Names some_names() {
  Names names;
  names.position = {"base.qx", "base.qy", "base.qz", "base.qw", "Schulter_ä", "ひじ"};
  names.velocity = {"base.wx", "base.wy", "base.wz", "Schulter_ä", "ひじ"};
  return names;
}

template <class Real>
struct Frame {
  double time;
  std::vector<Real> q, v, energy;
  std::vector<std::uint8_t> status;

  explicit Frame(int number, std::int64_t instances = kInstances, const Names& names = some_names()) : time(0.1 * number) {
    const auto n = static_cast<std::size_t>(instances);
    q.resize(n * names.position.size()), v.resize(n * names.velocity.size()), energy.resize(n), status.resize(n);
    double value = 1000 * number + 0.1;
    for (auto* const field : {&q, &v, &energy}) {
      for (Real& x : *field) x = static_cast<Real>(value += 1 / 3.0);
    }
    for (std::size_t i = 0; i < n; ++i) status[i] = static_cast<std::uint8_t>((i + static_cast<std::size_t>(number)) % 5);
    // what only bits tell apart
    q[0] = std::numeric_limits<Real>::quiet_NaN();
    q[1] = -Real(0);
    v[0] = -std::numeric_limits<Real>::infinity();
    v[1] = std::numeric_limits<Real>::denorm_min();
  }
};

template <class Real>
void add(RolloutFile<Real>& file, const Frame<Real>& frame) {
  file.add(frame.time, frame.q, frame.v, frame.energy, frame.status);
}

template <class Real>
void write(const std::string& name, int frames) {
  RolloutFile<Real> file(name, some_names(), kInstances);
  for (int f = 0; f < frames; ++f) add(file, Frame<Real>(f));
  CHECK(file.frames() == frames);
  file.commit();
}

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

TEMPLATE_TEST_CASE("a rollout reads back to the same bits, for any number of frames", "", float, double) {
  using Shape = std::vector<std::int64_t>;
  const Folder folder;
  const Names names = some_names();
  const std::string real = std::is_same_v<TestType, float> ? "<f4" : "<f8";
  for (const std::string& ending : kEndings) {
    for (const int frames : {0, 1, 7}) {
      INFO(ending << ", " << frames << " frames");
      write<TestType>(folder.file("roll" + ending), frames);
      Arrays arrays = read(folder.file("roll" + ending));
      CHECK(arrays.size() == 8);

      std::string time, q, v, energy, status;
      for (int f = 0; f < frames; ++f) {
        const Frame<TestType> frame(f);
        append(time, std::vector{frame.time});
        append(q, frame.q), append(v, frame.v), append(energy, frame.energy), append(status, frame.status);
      }
      for (const auto& [name, type, shape, bytes] : {std::tuple{"time", std::string("<f8"), Shape{frames}, time},
                                                     std::tuple{"q", real, Shape{frames, 3, 6}, q},
                                                     std::tuple{"v", real, Shape{frames, 3, 5}, v},
                                                     std::tuple{"energy", real, Shape{frames, 3}, energy},
                                                     std::tuple{"status", std::string("|u1"), Shape{frames, 3}, status}}) {
        INFO(name);
        CHECK(arrays[name].type == type);
        CHECK(arrays[name].shape == shape);
        CHECK(arrays[name].bytes == bytes);
      }
      CHECK(arrays["positions"].words == names.position);
      CHECK(arrays["velocities"].words == names.velocity);
      const std::vector<std::string> statuses{"converged", "not_converged", "past_pi", "gains_energy", "not_finite", "opens"};
      CHECK(arrays["statuses"].words == statuses);
    }
  }
}

TEST_CASE("names that are no UTF-8 are replaced where a format cannot hold them, and no names at all are fine") {
  const Folder folder;
  Names odd, none;
  odd.position = {"\xff", "a\xc3", "\xed\xa0\x80!", "fine"};
  RolloutFile<double> file(folder.file("odd.npz"), odd, 1);
  file.commit();
  const std::vector<std::string> replaced{"\xef\xbf\xbd", "a\xef\xbf\xbd", "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd!", "fine"};
  CHECK(read(folder.file("odd.npz"))["positions"].words == replaced);
  for (const std::string& ending : kEndings) {
    RolloutFile<double> empty(folder.file("none" + ending), none, 1);
    const double energy[] = {1};
    const std::uint8_t status[] = {0};
    empty.add(0, {}, {}, energy, status);
    empty.commit();
    Arrays arrays = read(folder.file("none" + ending));
    CHECK(arrays["q"].shape == std::vector<std::int64_t>{1, 1, 0});
    CHECK(arrays["positions"].shape == std::vector<std::int64_t>{0});
  }
}

TEST_CASE("there is no file before the commit, and nothing else after it") {
  const Folder folder;
  for (const std::string& ending : kEndings) {
    const std::string name = "roll" + ending;
    RolloutFile<double> file(folder.file(name), some_names(), kInstances);
    CHECK(folder.visible().empty());
    for (int f = 0; f < 3; ++f) add(file, Frame<double>(f));
    CHECK(folder.visible().empty());
    file.commit();
    CHECK(folder.files() == std::set<std::string>{name});
    CHECK_THROWS_WITH(add(file, Frame<double>(3)), Contains("cannot be written"));
    CHECK_THROWS_WITH(file.commit(), Contains("cannot be written"));
    CHECK(read(folder.file(name))["time"].shape[0] == 3);
    fs::remove(folder.file(name));
  }
}

TEST_CASE("what is not committed leaves nothing, and an older file as it was") {
  const Folder folder;
  for (const std::string& ending : kEndings) {
    const std::string name = "roll" + ending;
    std::ofstream(folder.file(name)) << "older";
    {
      RolloutFile<float> file(folder.file(name), some_names(), kInstances);
      for (int f = 0; f < 3; ++f) add(file, Frame<float>(f));
    }
    CHECK(folder.files() == std::set<std::string>{name});
    CHECK(text_of(folder.file(name)) == "older");
    write<float>(folder.file(name), 2);
    CHECK(folder.files() == std::set<std::string>{name});
    CHECK(read(folder.file(name))["time"].shape[0] == 2);
    fs::remove(folder.file(name));
  }
}

TEST_CASE("two files in one folder do not touch each other, and equal rollouts make equal bytes") {
  const Folder folder;
  for (const std::string& ending : kEndings) {
    RolloutFile<double> a(folder.file("a" + ending), some_names(), kInstances), b(folder.file("b" + ending), some_names(), kInstances);
    for (int f = 0; f < 4; ++f) {
      add(a, Frame<double>(f));
      add(b, Frame<double>(f));
    }
    a.commit();
    CHECK(folder.visible() == std::set<std::string>{"a" + ending});
    b.commit();
    CHECK(folder.files() == std::set<std::string>{"a" + ending, "b" + ending});
    CHECK(text_of(folder.file("a" + ending)) == text_of(folder.file("b" + ending)));
    for (const char* name : {"a", "b"}) fs::remove(folder.file(name + ending));
  }
}

TEST_CASE("a frame of another length is refused and does no harm") {
  const Folder folder;
  for (const std::string& ending : kEndings) {
    RolloutFile<double> file(folder.file("roll" + ending), some_names(), kInstances);
    Frame<double> frame(0);
    add(file, frame);
    frame.v.pop_back();
    CHECK_THROWS_WITH(add(file, frame), Contains("14 numbers of v; expected 15"));
    add(file, Frame<double>(1));
    file.commit();
    CHECK(read(folder.file("roll" + ending))["v"].shape == std::vector<std::int64_t>{2, 3, 5});
  }
}

TEST_CASE("a file that cannot be written is named with the reason") {
  const Folder folder;
  std::ofstream(folder.file("file")) << "no folder";
  for (const std::string& ending : kEndings) {
    const std::string missing = folder.file("no/roll" + ending), within = folder.file("file/roll" + ending);
    CHECK_THROWS_WITH(write<double>(missing, 1), missing + ": cannot be written: No such file or directory");
    CHECK_THROWS_WITH(write<double>(within, 1), within + ": cannot be written: Not a directory");
    fs::create_directory(folder.file("taken" + ending));
    CHECK_THROWS_WITH(write<double>(folder.file("taken" + ending), 1), Contains("this is a folder"));
    fs::remove(folder.file("taken" + ending));
  }
  CHECK_THROWS_WITH(write<double>(folder.file("roll.csv"), 1), Contains("\".csv\"; expected .npz or .h5"));
  CHECK(folder.files() == std::set<std::string>{"file"});
}

TEST_CASE("a folder that vanishes is reported at the commit at the latest") {
  const Folder folder;
  for (const std::string& ending : kEndings) {
    fs::create_directory(folder.file("sub"));
    const std::string name = folder.file("sub/roll" + ending);
    RolloutFile<double> file(name, some_names(), kInstances);
    add(file, Frame<double>(0));
    fs::remove_all(folder.file("sub"));
    add(file, Frame<double>(1));
    CHECK_THROWS_WITH(file.commit(), name + ": cannot be written: No such file or directory");
    CHECK(folder.files().empty());
  }
}

/// No file may grow longer: a disk that is full, as a process sees it.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_CASE("a full disk is reported, and keeps the frames that fit") {
  const Folder folder;
  for (const std::string& ending : kEndings) {
    const std::string name = folder.file("roll" + ending);
    std::set<std::int64_t> kept;
    for (const rlim_t bytes : {0u, 100u, 5'000u, 20'000u, 50'000u, 200'000u, 400'000u, 500'000u, 700'000u}) {
      std::string message;
      std::int64_t frames = 0;
      {
        const FullDisk disk(bytes);
        try {
          RolloutFile<double> file(name, some_names(), 100);
          try {
            for (int f = 0; f < 100; ++f) add(file, Frame<double>(f, 100));
          } catch (const std::runtime_error& error) {
            message = error.what();
            frames = file.frames();
            CHECK_THROWS_WITH(add(file, Frame<double>(0, 100)), Contains("has failed before"));
            file.commit();
          }
        } catch (const std::runtime_error& error) {
          if (message.empty()) message = error.what();
          if (frames > 0) FAIL(error.what());
        }
      }
      INFO(ending << " on " << bytes << " bytes");
      CHECK(message == name + ": cannot be written: File too large");
      kept.insert(frames);
      if (frames == 0) {
        CHECK(folder.files().empty());
        continue;
      }
      CHECK(folder.files() == std::set<std::string>{"roll" + ending});
      CHECK(fs::file_size(name) <= bytes);
      const auto arrays = read(name);
      CHECK(arrays.at("q").shape == std::vector<std::int64_t>{frames, 100, 6});
      for (const char* array : {"time", "v", "energy", "status"}) CHECK(arrays.at(array).shape[0] == frames);
      const Frame<double> last(static_cast<int>(frames) - 1, 100);
      CHECK(std::memcmp(arrays.at("q").bytes.data() + (arrays.at("q").bytes.size() - last.q.size() * sizeof(double)), last.q.data(),
                        last.q.size() * sizeof(double)) == 0);
      fs::remove(name);
    }
    CHECK(kept.contains(0));
    CHECK(kept.size() >= 3);
    write<double>(name, 2);
    CHECK(read(name)["q"].shape == std::vector<std::int64_t>{2, 3, 6});
    fs::remove(name);
  }
}

TEST_CASE("packed recordings read back to the same bits, whatever packs them, and are shorter") {
  const Folder folder;
  constexpr int kFrames = 75;  // no multiple of the rows of a chunk
  constexpr std::size_t kMany = 900;
  std::string texts[3];
  for (const int packers : {0, 1, 3}) {
    const std::string name = folder.file(fmt::format("{}.h5", packers));
    RolloutFile<double> file(name, kMany, {recorded_positions(some_names()), recorded_velocities(some_names())}, {}, packers);
    for (int f = 0; f < kFrames; ++f) {
      Frame<double> frame(f, kMany);
      // numbers that move little from frame to frame, and some that do not
      for (std::size_t k = 2; k < frame.q.size(); ++k) frame.q[k] = std::sin(0.01 * f + static_cast<double>(k));
      for (double& number : frame.v) number = 0.25;
      add(file, frame);
    }
    file.commit();
    texts[packers == 3 ? 2 : packers] = text_of(name);
    const Arrays plain = read(folder.file("0.h5")), packed = read(name);
    for (const char* array : {"time", "q", "v", "energy", "status"}) {
      CAPTURE(array, packers);
      CHECK(packed.at(array).shape == plain.at(array).shape);
      CHECK((packed.at(array).bytes == plain.at(array).bytes));
    }
  }
  CHECK((texts[1] == texts[2]));
  CHECK(10 * texts[1].size() < 6 * texts[0].size());
  // 8 (6 + 5 + 1) + 1 bytes of an instance and frame: chunks at the ends take no more
  CHECK(static_cast<double>(texts[0].size()) < 1.05 * (97 * kMany * kFrames) + 100'000);
}

TEST_CASE("a chunk of HDF5 is some frames of some instances, neither tiny nor huge") {
  const Folder folder;
  for (const std::int64_t instances : {1, 1000, 12'345, 1'000'000}) {
    const std::string name = folder.file("roll.h5");
    RolloutFile<double>(name, some_names(), instances).commit();
    const H5Reader reader(name);
    for (const char* array : {"time", "q", "v", "energy", "status"}) {
      INFO(array << " of " << instances);
      const Dataset dataset(reader.file, array);
      std::vector<hsize_t> chunk(dataset.shape.size());
      REQUIRE(H5Pget_chunk(dataset.creation, static_cast<int>(chunk.size()), chunk.data()) == static_cast<int>(chunk.size()));
      hsize_t bytes = H5Tget_size(dataset.type);
      for (const hsize_t size : chunk) bytes *= size;
      CHECK(bytes >= 1 << 15);
      CHECK(bytes <= 1 << 21);
      if (instances > 1 && chunk.size() > 1) {  // both are read in parts, whose edges do not waste
        if (instances < 1'000'000) CHECK(chunk[0] >= 16);
        if (chunk.size() == 3) CHECK(4 * chunk[1] <= dataset.shape[1]);
        CHECK((dataset.shape[1] + chunk[1] - 1) / chunk[1] * chunk[1] <= dataset.shape[1] + dataset.shape[1] / 50 + 1);
      }
      if (chunk.size() == 3) CHECK(chunk[2] == dataset.shape[2]);
    }
  }
}

TEST_CASE("many frames, over many chunks, arrive in order") {
  const Folder folder;
  for (const std::string& ending : kEndings) {
    constexpr int kFrames = 20'000;
    const std::string name = folder.file("long" + ending);
    Names names;
    names.position = names.velocity = {"joint"};
    RolloutFile<float> file(name, names, 2);
    std::string q;
    for (int f = 0; f < kFrames; ++f) {
      const auto x = static_cast<float>(f);
      const std::vector<float> values{x, -x};
      const std::uint8_t status[] = {0, 1};
      file.add(f, values, values, values, status);
      append(q, values);
    }
    file.commit();
    Arrays arrays = read(name);
    CHECK(arrays["q"].shape == std::vector<std::int64_t>{kFrames, 2, 1});
    for (const char* array : {"q", "v", "energy"}) CHECK((arrays[array].bytes == q));
    std::string fine_and_not;
    for (int f = 0; f < kFrames; ++f) fine_and_not += {'\0', '\1'};
    CHECK((arrays["status"].bytes == fine_and_not));
    fs::remove(name);
  }
}

/// The first Python that has the module; empty: none.
std::string python_with(const std::string& module) {
  for (const char* python : {"python3", "/usr/bin/python3"}) {
    if (std::system(fmt::format("{} -c 'import {}' >/dev/null 2>&1", python, module).c_str()) == 0) return python;
  }
  return "";
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  REQUIRE(pipe);
  std::string output;
  for (int c; (c = std::fgetc(pipe.get())) != EOF;) output += static_cast<char>(c);
  return output;
}

TEMPLATE_TEST_CASE("Python opens a rollout in one line", "", float, double) {
  const Folder folder;
  const std::pair<std::string, std::string> opened[] = {{"numpy", "numpy.load(sys.argv[1])"}, {"h5py", "h5py.File(sys.argv[1])"}};
  const char* const names[] = {"data['positions'][5]", "data['positions'].asstr()[5]"};
  for (const std::size_t k : {0u, 1u}) {
    const auto& [module, open] = opened[k];
    const std::string python = python_with(module), name = folder.file("roll" + kEndings[k]);
    if (python.empty()) {
      WARN("there is no Python with " << module << " here; " << kEndings[k] << " was not opened by it");
      continue;
    }
    write<TestType>(name, 4);
    const std::string script =
        fmt::format("import sys, {}\ndata = {}\n"
                    "print(*[(str(data[a].dtype), data[a].shape) for a in (\"time\", \"q\", \"v\", \"energy\", \"status\")])\n"
                    "print(float(data[\"q\"][3, 2, 5]), ascii(str({})), len(data[\"statuses\"]))\n",
                    module, open, names[k]);
    const std::string real = std::is_same_v<TestType, float> ? "float32" : "float64";
    const std::string expected = fmt::format(
        "('float64', (4,)) ('{0}', (4, 3, 6)) ('{0}', (4, 3, 5)) ('{0}', (4, 3)) ('uint8', (4, 3))\n{1} '\\u3072\\u3058' 6\n", real,
        static_cast<double>(Frame<TestType>(3).q[17]));
    std::ofstream(folder.file("script.py")) << script;
    CHECK(output_of(fmt::format("{} '{}' '{}' 2>&1", python, folder.file("script.py"), name)) == expected);
  }
}

}  // namespace
}  // namespace linden::rollout_file_test
