// A checkpoint is continued or refused, whatever was done to it.
//
// The input is laid over a good checkpoint: its first byte says how many bytes go off the end, the others flip bits from the
// beginning on. The checksum is made to agree, or nothing behind it would ever be reached.
#include <cmath>
#include <cstdint>

#include "engine/simulation.hpp"
#include "models/build/generators.hpp"
#include "tests/fuzz/input.hpp"

namespace {

using namespace linden;

constexpr std::size_t kChecksum = 8;

/// Of order 4, whose sub-steps have pasts of their own; its steps end soon whatever state they start from.
Simulation simulation() { return Simulation(random_tree({.bodies = 3}), {.order = 4, .max_iterations = 8, .max_splits = 0}); }

/// FNV-1a, little endian.
std::string checksum(const std::string& bytes) {
  std::uint64_t sum = 14695981039346656037ull;
  for (const char byte : bytes) sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211ull;
  std::string result;
  for (std::size_t k = 0; k < kChecksum; ++k) result += static_cast<char>(sum >> 8 * k);
  return result;
}

/// The checkpoint of a run of some steps, without its checksum.
std::string good_checkpoint(const ScratchFolder& folder) {
  Simulation run = simulation();
  for (int k = 0; k < 3; ++k) require(run.step().ok(), "a step of the good run fails");
  run.save(folder.file("good"));
  const std::string bytes = text_of(folder.file("good"));
  const std::string body = bytes.substr(0, bytes.size() - kChecksum);
  require(body + checksum(body) == bytes, "the checksum is another");
  return body;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  static const ScratchFolder folder(input_folder());
  static const std::string good = good_checkpoint(folder);
  std::string bytes = good;
  if (size > 0) bytes.resize(bytes.size() - std::min<std::size_t>(data[0], bytes.size()));
  for (std::size_t k = 1; k < size; ++k) {
    if (k > bytes.size()) bytes += '\0';
    bytes[k - 1] = static_cast<char>(bytes[k - 1] ^ data[k]);
  }
  folder.write("state", bytes + checksum(bytes));
  Simulation run = simulation();
  read_or_refuse([&] {
    run.load(folder.file("state"));
    for (const double q : run.positions()) require(std::isfinite(q), "a position");
    for (const double p : run.momenta()) require(std::isfinite(p), "a momentum");
    for (int k = 0; k < 2; ++k) run.step();
  });
  return 0;
}
