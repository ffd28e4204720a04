// engine/checkpoint_bytes.hpp
// What checkpoints of a Simulation and of a Batch have in common: a line of text that says what they are, a header of fixed size that begins
// with what they belong to, the text of their effects, numbers, and FNV-1a over all of it. Raw bits, little endian, so that what is continued
// is the same to the bit.
#pragma once

#include <cstdint>
#include <cstring>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include "engine/options.hpp"
#include "layout/model.hpp"

namespace linden {

/// What a checkpoint belongs to.
struct CheckpointOf {
  std::uint64_t model_hash;
  double step;
  double gravity[3];
  std::int64_t positions, velocities;
};

CheckpointOf checkpoint_of(const Model& model, const Options& options);

/// The bytes, all there are in memory, or those of a file, read no farther than can be of use: it may be any file, and have no end.
class CheckpointBytes {
 public:
  /// Both must outlive it. name: of where they come from, for messages.
  CheckpointBytes(std::string_view bytes, const std::string& name) : name_(name), given_(bytes) {}
  /// Throws InputError where the file cannot be read.
  explicit CheckpointBytes(const std::string& file);

  const std::string& name() const { return name_; }
  /// The first so many of them, or all where there are fewer; valid until it is called again.
  std::string_view first(std::size_t size);

 private:
  const std::string& name_;
  std::string_view given_;
  std::ifstream in_;
  std::string read_;
};

/// How checkpoints of something begin, and what it is called.
struct CheckpointKind {
  std::string_view line, any_version;
  const char* of;  // "simulation"
};
inline constexpr CheckpointKind kOfSimulation{"linden checkpoint 9\n", "linden checkpoint ", "simulation"};
inline constexpr CheckpointKind kOfBatch{"linden batch 5\n", "linden batch ", "batch"};

/// Reads one from its beginning to its end. Everything throws InputError for what does not fit.
class CheckpointReader {
 public:
  CheckpointReader(CheckpointBytes& bytes, const CheckpointKind& kind) : source_(bytes), kind_(kind) {}

  template <class Header>
  Header header() {
    begin(sizeof(Header));
    Header header{};
    std::memcpy(&header, bytes_.data() + kind_.line.size(), sizeof(Header));
    return header;
  }

  // Whether the run that was saved is one that these would continue.
  void check_model(const CheckpointOf& saved, const Model& model) const;
  void check_step(const CheckpointOf& saved, const Options& options) const;
  /// Takes the text of the effects, so many bytes.
  void check_effects(std::int64_t size, const std::string& here);

  /// The numbers that follow, of so many bytes, and the sum over all.
  void numbers(std::size_t size);
  /// The next of them.
  std::string_view next(std::size_t size);
  void read(auto numbers) {  // a span
    const std::string_view from = next(numbers.size_bytes());
    if (!from.empty()) std::memcpy(numbers.data(), from.data(), from.size());
  }

  [[noreturn]] void impossible(const std::string& what) const;
  /// How many bytes of something there are, where that is told.
  std::size_t size_of(const char* what, std::int64_t told) const;

 private:
  void begin(std::size_t header);

  CheckpointBytes& source_;
  CheckpointKind kind_;
  std::string_view bytes_;
  std::size_t next_ = 0;
};

}  // namespace linden
