// Recordings in parts read like the recording of one process, whoever wrote them and where they are moved to.
#include <unistd.h>

#include <filesystem>

#include "engine/distributed/parted_recording.hpp"
#include "engine/files/recorded_arrays.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/turns.hpp"

namespace linden::parted_recording_test {
namespace {

namespace fs = std::filesystem;
using Catch::Matchers::Contains;

constexpr std::int64_t kAll = 7;

std::vector<RecordedArray> some_arrays() {
  return {{"q", "positions", {"a", "ä"}, ""}, {"v", "velocities", {}, ""}, {"pose:hand", "pose:hand_names", {"x", "y", "z"}, "", "m"}};
}

std::vector<FixedArray> drawn_of(InstanceRange own) {
  std::vector<double> factors, friction;
  for (std::int64_t i = own.first; i < own.end(); ++i) {
    factors.insert(factors.end(), {static_cast<double>(i), 0.5 + static_cast<double>(i)});
    friction.push_back(0.1 * static_cast<double>(i));
  }
  return {{"mass_factors", "bodies", {"upper", "lower"}, factors}, {"ground_friction", "", {}, friction}};
}

/// Frame f of some instances, by a RolloutFile or a PartedRecording.
template <class Real>
void add(auto& recording, int f, InstanceRange own) {
  std::vector<Real> q, pose, energy;
  std::vector<std::uint8_t> status;
  for (std::int64_t i = own.first; i < own.end(); ++i) {
    const Real value = static_cast<Real>(100 * f) + static_cast<Real>(i) / 7;
    q.insert(q.end(), {value, -value});
    pose.insert(pose.end(), {1 / value, value, 3 * value});
    energy.push_back(value * value);
    status.push_back(static_cast<std::uint8_t>((i + f) % 5));
  }
  const std::span<const Real> arrays[] = {q, {}, pose};
  recording.add(0.1 * f, arrays, energy, status);
}

/// Frames first .. end - 1 by so many ranks, with a new segment before each of `breaks`. What is in place afterwards, of rank 0.
template <class Real>
RecordedParts record(const std::string& file, int count, int first, int end, const std::vector<int>& breaks = {}, RecordedParts done = {}) {
  RecordedParts parts;
  for (const std::exception_ptr& thrown : at_ranks(count, [&](Ranks& ranks) {
         const InstanceRange own = share_of(kAll, ranks.rank(), ranks.count());
         std::optional<PartedRecording<Real>> recording;
         if (done.segments.empty()) recording.emplace(ranks, file, kAll, some_arrays(), drawn_of(own));
         else recording.emplace(ranks, file, kAll, some_arrays(), drawn_of(own), done);
         for (int f = first; f < end; ++f) {
           if (std::ranges::find(breaks, f) != breaks.end()) recording->end_segment();
           add<Real>(*recording, f, own);
         }
         recording->commit();
         if (recording->frames() != end) throw std::runtime_error("frames");
         if (ranks.first()) parts = recording->parts();
       })) {
    if (thrown) std::rethrow_exception(thrown);
  }
  return parts;
}

template <class Real>
Arrays whole(int frames) {
  const Folder folder;
  RolloutFile<Real> file(folder.file("whole.h5"), kAll, some_arrays(), drawn_of({0, kAll}));
  for (int f = 0; f < frames; ++f) add<Real>(file, f, {0, kAll});
  file.commit();
  return read(folder.file("whole.h5"));
}

void check_equal(const Arrays& found, const Arrays& expected) {
  CHECK(found.size() == expected.size());
  for (const auto& [name, array] : expected) {
    INFO(name);
    REQUIRE(found.contains(name));
    CHECK(found.at(name).type == array.type);
    CHECK(found.at(name).shape == array.shape);
    CHECK(found.at(name).bytes == array.bytes);
    CHECK(found.at(name).words == array.words);
  }
}

/// The folder of parts beside a file, of which there is one.
fs::path parts_beside(const Folder& folder) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    if (entry.is_directory()) found.push_back(entry.path());
  }
  REQUIRE(found.size() == 1);
  CHECK(is_parts_folder(found[0].filename().string()));
  return found[0];
}

TEMPLATE_TEST_CASE("a recording of several ranks and segments reads to the same bits as that of one process", "", float, double) {
  for (const int ranks : {1, 2, 3, 4, 7}) {
    for (const std::vector<int>& breaks : {std::vector<int>{}, {2}, {1, 4}, {3, 3, 4}}) {
      INFO(ranks << " ranks, " << breaks.size() << " breaks");
      const Folder folder;
      record<TestType>(folder.file("run.h5"), ranks, 0, 5, breaks);
      check_equal(read(folder.file("run.h5")), whole<TestType>(5));
      CHECK(folder.visible().size() == 2);
      const fs::path parts = parts_beside(folder);
      for (const auto& entry : fs::directory_iterator(parts)) CHECK(entry.path().filename().string()[0] != '.');
    }
  }
}

TEST_CASE("units and names are attributes of the arrays of a master too") {
  const Folder folder;
  record<double>(folder.file("run.h5"), 2, 0, 2);
  const H5Reader reader(folder.file("run.h5"));
  const Dataset dataset(reader.file, "pose:hand");
  CHECK(H5Aexists(dataset.id, "units") > 0);
  CHECK(H5Aexists(dataset.id, "names") > 0);
}

TEST_CASE("a master reads the same where it is moved with its parts, by links and by any name, and names a part that is not there") {
  const Folder folder;
  record<double>(folder.file("run.h5"), 3, 0, 4);
  const fs::path parts = parts_beside(folder);
  fs::create_directory(folder / "elsewhere");
  fs::rename(parts, folder / "elsewhere" / parts.filename());
  fs::rename(folder / "run.h5", folder / "elsewhere" / "other.h5");
  check_equal(read(folder.file("elsewhere/other.h5")), whole<double>(4));
  fs::create_symlink("elsewhere/other.h5", folder / "link.h5");
  check_equal(read(folder.file("link.h5")), whole<double>(4));
  CHECK(read_recording(folder.file("elsewhere/other.h5")).numbers.at("q").shape == std::vector<std::int64_t>{4, kAll, 2});
  CHECK(read_recording(folder.file("link.h5")).numbers.at("q").shape == std::vector<std::int64_t>{4, kAll, 2});

  fs::remove(folder / "elsewhere" / parts.filename() / "0.1-of-3.h5");
  CHECK_THROWS_WITH(read_recording(folder.file("elsewhere/other.h5")),
                    Contains("other.h5: its part " + parts.filename().string() + "/0.1-of-3.h5 is not there") && Contains("move the folder with it"));
  const Arrays rest = read(folder.file("elsewhere/other.h5"));
  double lost = 0;
  std::memcpy(&lost, rest.at("energy").bytes.data() + 3 * sizeof lost, sizeof lost);  // instance 3 is the first of rank 1
  CHECK(std::isnan(lost));
  CHECK(static_cast<unsigned char>(rest.at("status").bytes[3]) == 255);
  CHECK(rest.at("status").bytes[2] == 2);
}

TEST_CASE("a recording goes on behind what is in place, with other ranks too, and drops what was begun") {
  const Folder folder;
  const RecordedParts first = record<double>(folder.file("run.h5"), 3, 0, 4, {2});
  CHECK(first.segments == std::vector<RecordedSegment>{{2, 3}, {2, 3}});
  const fs::path parts = parts_beside(folder);
  // the end was lost: it goes on behind the first segment
  RecordedParts done{first.letters, {{2, 3}}};
  folder.write(parts.filename().string() + "/.1.0-of-3.h5.linden.01234567.part", "begun");
  const RecordedParts second = record<double>(folder.file("run.h5"), 2, 2, 6, {}, done);
  CHECK(second.segments == std::vector<RecordedSegment>{{2, 3}, {4, 2}});
  check_equal(read(folder.file("run.h5")), whole<double>(6));
  CHECK(parts_beside(folder) == parts);
  CHECK(folder.files().size() == 2 + 3 + 2);
}

TEST_CASE("a master shows the frames that all ranks have, and the next segment goes on behind them") {
  const Folder folder;
  for (const std::exception_ptr& thrown : at_ranks(3, [&](Ranks& ranks) {
         const InstanceRange own = share_of(kAll, ranks.rank(), ranks.count());
         PartedRecording<double> recording(ranks, folder.file("run.h5"), kAll, some_arrays(), drawn_of(own));
         for (int f = 0; f < 3 + ranks.rank(); ++f) add<double>(recording, f, own);
         recording.end_segment();
         if (recording.frames() != 3) throw std::runtime_error("frames");
         for (int f = 3; f < 6 - ranks.rank() / 2; ++f) add<double>(recording, f, own);
         recording.commit();
         if (recording.frames() != 5) throw std::runtime_error("frames");
       })) {
    CHECK_FALSE(thrown);
  }
  check_equal(read(folder.file("run.h5")), whole<double>(5));
}

TEST_CASE("a recording is replaced with its parts, by one in parts or by one that is whole, and by nothing less") {
  const Folder folder;
  record<double>(folder.file("run.h5"), 2, 0, 3);
  const fs::path before = parts_beside(folder);
  // given up before there is a master
  at_ranks(2, [&](Ranks& ranks) {
    PartedRecording<double> recording(ranks, folder.file("run.h5"), kAll, some_arrays());
    add<double>(recording, 0, share_of(kAll, ranks.rank(), 2));
    ranks.barrier();
    if (ranks.first()) check_equal(read(folder.file("run.h5")), whole<double>(3));
    ranks.barrier();
  });
  CHECK(parts_beside(folder) == before);
  check_equal(read(folder.file("run.h5")), whole<double>(3));
  record<double>(folder.file("run.h5"), 3, 0, 2);
  CHECK(parts_beside(folder) != before);
  check_equal(read(folder.file("run.h5")), whole<double>(2));
  RolloutFile<double> file(folder.file("run.h5"), kAll, some_arrays());
  add<double>(file, 0, {0, kAll});
  file.commit();
  CHECK(folder.files() == std::set<std::string>{"run.h5"});
}

TEST_CASE("what is no .h5 cannot be in parts, and what cannot be written is told to all ranks") {
  const Folder folder;
  const auto message_of = [](const std::exception_ptr& thrown) -> std::string {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  const auto begin = [&](const std::string& name) {
    return at_ranks(3, [&](Ranks& ranks) { PartedRecording<double>(ranks, folder.file(name), kAll, some_arrays()); });
  };
  for (const std::exception_ptr& thrown : begin("run.npz")) CHECK_THAT(message_of(thrown), Contains("run.npz: ") && Contains("expected .h5"));
  for (const std::exception_ptr& thrown : begin("no/run.h5")) {
    CHECK_THAT(message_of(thrown), Contains("no/run.h5: cannot be written: No such file or directory"));
  }
  CHECK(folder.files().empty());
  // another process that writes there
  const RecordedParts done = record<double>(folder.file("run.h5"), 1, 0, 2);
  at_ranks(1, [&](Ranks& ranks) {
    PartedRecording<double> one(ranks, folder.file("run.h5"), kAll, some_arrays(), {}, done);
    CHECK_THROWS_WITH(PartedRecording<double>(ranks, folder.file("run.h5"), kAll, some_arrays(), {}, done),
                      Contains("another process writes its parts"));
  });
}

}  // namespace
}  // namespace linden::parted_recording_test
