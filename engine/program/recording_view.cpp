#include "engine/program/recording_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/text.hpp"
#include "engine/view/animation_recorder.hpp"
#include "engine/view/curves.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// An array [frames, instances, rows] and what of it is shown.
struct RecordedRows {
  const NumberArray* array;
  std::vector<std::size_t> columns;
  double at(std::size_t frame, std::int64_t instance, std::size_t column) const {
    const auto instances = static_cast<std::size_t>(array->shape[1]), rows = array->shape.size() > 2 ? static_cast<std::size_t>(array->shape[2]) : 1;
    return array->numbers[(frame * instances + static_cast<std::size_t>(instance)) * rows + columns[column]];
  }
};

class RecordingView {
 public:
  RecordingView(const RecordedArrays& arrays, const std::string& file, const Model& model, std::int64_t shown)
      : arrays_(arrays), file_(file), model_(model) {
    const NumberArray& time = array("time", 1);
    const NumberArray& q = array("q", 3);
    times_ = time.numbers;
    if (q.shape[0] != time.shape[0]) fail(fmt::format("\"q\" has {} frames and \"time\" {}", q.shape[0], time.shape[0]));
    if (times_.empty()) fail("it holds no frame");
    check_times();
    all_ = q.shape[1];
    shown_ = std::min(shown, all_);
    positions_ = {&q, columns_of("positions", model.names.position, q)};
  }

  Animation show(const Effects& effects, const ViewArguments& arguments) {
    AnimationRecorder recorder(model_, effects, model_.names.model, shown_);
    if (shown_ < all_) recorder.add_note(fmt::format("the first {} of {} instances", grouped(shown_), grouped(all_)));
    add_curves(recorder);
    const auto frames = static_cast<std::int64_t>(times_.size());
    const double step = frames > 1 ? (times_.back() - times_.front()) / static_cast<double>(frames - 1) : 1;
    const FrameStride stride = frame_stride(frames - 1, step, arguments.fps, shown_ * model_.tree.bodies());
    if (!stride.note.empty()) recorder.add_note(stride.note);
    for (std::int64_t frame = 0; frame < frames; frame += stride.steps) add_frame(static_cast<std::size_t>(frame), recorder);
    if ((frames - 1) % stride.steps != 0) add_frame(static_cast<std::size_t>(frames - 1), recorder);
    return recorder.animation();
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}; expected what linden recorded of {}", file_, what, model_.names.model));
  }

  const NumberArray& array(const std::string& name, std::size_t axes) const {
    const auto found = arrays_.numbers.find(name);
    if (const auto unread = arrays_.unread.find(name); unread != arrays_.unread.end()) {
      fail(fmt::format("\"{}\" holds numbers of the type '{}' instead of '<f8' or '<f4'", name, unread->second));
    }
    if (found == arrays_.numbers.end()) fail(fmt::format("there is no array \"{}\"", name));
    if (found->second.shape.size() != axes) fail(fmt::format("\"{}\" has {} axes instead of {}", name, found->second.shape.size(), axes));
    return found->second;
  }

  void check_times() const {
    for (std::size_t k = 0; k < times_.size(); ++k) {
      if (std::isfinite(times_[k]) && (k == 0 || times_[k] > times_[k - 1])) continue;
      fail(fmt::format("time {} of frame {} does not rise above those before it", times_[k], k));
    }
  }

  /// Which column of an array each of the model's rows is.
  std::vector<std::size_t> columns_of(const std::string& names, const std::vector<std::string>& rows, const NumberArray& of) const {
    const auto found = arrays_.words.find(names);
    if (found == arrays_.words.end() || static_cast<std::int64_t>(found->second.size()) != of.shape[2]) {
      fail(fmt::format("the names \"{}\" of its rows are missing or not as many as these", names));
    }
    std::vector<std::size_t> columns;
    for (const std::string& row : rows) {
      const auto place = std::ranges::find(found->second, row);
      if (place == found->second.end()) {
        const std::string guess = nearest(row, found->second);
        fail(fmt::format("position {} of the model is not in it{}", quoted(row), guess.empty() ? "" : fmt::format(" (nearest: {})", quoted(guess))));
      }
      columns.push_back(static_cast<std::size_t>(place - found->second.begin()));
    }
    return columns;
  }

  bool fits(const NumberArray& of, std::size_t axes) const {
    return of.shape.size() == axes && of.shape[0] == static_cast<std::int64_t>(times_.size()) && of.shape[1] == all_;
  }

  void add_curves(AnimationRecorder& recorder) {
    constexpr std::size_t kMostNumbers = 4'000'000;  // of an array
    const auto take = [&](const std::string& name, RecordedRows rows, const auto& curves_of) {
      if (rows.columns.size() * times_.size() * static_cast<std::size_t>(shown_) > kMostNumbers) {
        recorder.add_note(fmt::format("no curves of {}: its {} rows are too many", name, rows.columns.size()));
        return;
      }
      for (std::int64_t i = 0; i < shown_; ++i) recorder.add_curves(curves_of(i));
      curves_.push_back(std::move(rows));
    };
    take("q", positions_, [&](std::int64_t i) { return position_curves(model_, i); });
    for (const auto& entry : arrays_.numbers) {
      const std::string& name = entry.first;
      const NumberArray& numbers = entry.second;
      if (name == "q" || name == "status") continue;
      const auto words = arrays_.words.find(name == "v" ? "velocities" : name == "energies" ? "energy_names" : name + "_names");
      const bool named = words != arrays_.words.end() && fits(numbers, 3) && static_cast<std::int64_t>(words->second.size()) == numbers.shape[2];
      if (!named && !(name == "energy" && fits(numbers, 2))) continue;
      RecordedRows rows{&numbers, {}};
      for (std::size_t k = 0; k < (named ? words->second.size() : 1); ++k) rows.columns.push_back(k);
      take(name, rows, [&](std::int64_t i) {
        if (name == "v" && words->second == model_.names.velocity) return velocity_curves(model_, i);
        std::vector<Curve> curves;
        for (const std::size_t k : rows.columns) {
          const bool energy = name == "energy" || name == "energies";
          curves.push_back({energy ? "energy" : name, named ? words->second[k] : "total", energy ? "J" : "", -1, i, {}});
        }
        return curves;
      });
    }
  }

  void add_frame(std::size_t frame, AnimationRecorder& recorder) {
    std::vector<double> q, numbers;
    const auto append = [&](const RecordedRows& rows, std::int64_t instance, std::vector<double>& to) {
      for (std::size_t k = 0; k < rows.columns.size(); ++k) to.push_back(rows.at(frame, instance, k));
    };
    for (std::int64_t i = 0; i < shown_; ++i) append(positions_, i, q);
    for (const RecordedRows& rows : curves_) {
      for (std::int64_t i = 0; i < shown_; ++i) append(rows, i, numbers);
    }
    recorder.add(times_[frame], q, numbers);
  }

  const RecordedArrays& arrays_;
  const std::string& file_;
  const Model& model_;
  std::vector<double> times_;
  std::int64_t all_ = 0, shown_ = 0;  // instances
  RecordedRows positions_{};
  std::vector<RecordedRows> curves_;  // in the order of the recorder's
};

}  // namespace

Animation animation_of(const RecordedArrays& arrays, const std::string& file, const Model& model, const Effects& effects,
                       const ViewArguments& arguments, std::int64_t shown) {
  try {
    return RecordingView(arrays, file, model, shown).show(effects, arguments);
  } catch (const InputError& error) {
    if (std::string_view(error.what()).starts_with(file)) throw;
    throw InputError(fmt::format("{}: {}", file, error.what()));
  }
}

}  // namespace linden
