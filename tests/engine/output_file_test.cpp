// What is on the disk when an output appears.
#include "engine/files/output_file.hpp"

#include <catch2/catch.hpp>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <functional>

#include "tests/engine/folder.hpp"

namespace {

std::function<int(int file)> on_fsync;  // in place of the system's

}  // namespace

// stands before the one of the C library in this program
extern "C" int fsync(int file) { return on_fsync ? on_fsync(file) : static_cast<int>(::syscall(SYS_fsync, file)); }

namespace linden::output_file_test {
namespace {

/// While it lives, on_fsync.
struct Instead {
  explicit Instead(std::function<int(int file)> work) { on_fsync = std::move(work); }
  ~Instead() { on_fsync = nullptr; }
};

TEST_CASE("all of an output is on the disk before the old file is replaced, and its name when all is done") {
  const Folder folder;
  folder.write("a", "old");
  std::string seen, seen_last;
  long written = 0;
  const Instead look([&](int file) {
    struct stat status {};
    REQUIRE(::fstat(file, &status) == 0);
    if (S_ISDIR(status.st_mode)) {
      seen_last = text_of(folder / "a");
      return 0;
    }
    CHECK(seen_last.empty());
    written = status.st_size;
    seen = text_of(folder / "a");
    return 0;
  });
  write_file(folder.file("a"), "something new");
  CHECK(seen == "old");
  CHECK(written == 13);
  CHECK(seen_last == "something new");
  CHECK(text_of(folder / "a") == "something new");
  CHECK(folder.files() == std::set<std::string>{"a"});
}

TEST_CASE("an output that does not reach the disk leaves the old file and nothing else") {
  const Folder folder;
  folder.write("a", "old");
  const Instead fail([](int) {
    errno = EIO;
    return -1;
  });
  CHECK_THROWS_WITH(write_file(folder.file("a"), "new"), folder.file("a") + ": cannot be written: Input/output error");
  CHECK(text_of(folder / "a") == "old");
  CHECK(folder.files() == std::set<std::string>{"a"});
}

}  // namespace
}  // namespace linden::output_file_test
