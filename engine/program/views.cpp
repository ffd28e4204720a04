#include "engine/program/views.hpp"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "engine/files/report_files.hpp"
#include "engine/files/temporary_folder.hpp"
#include "engine/program/browser.hpp"
#include "engine/program/child_process.hpp"
#include "engine/program/progress.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "engine/view/gltf.hpp"
#include "engine/view/page.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr double kFilmRate = 30;  // frames a second

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(at, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// "azimuth=30,follow=pelvis" as the fragment of an address: azimuth=30&follow=pelvis.
std::string look_from(const std::string& text, std::string& follow) {
  static const std::vector<std::string> kKeys{"azimuth", "elevation", "distance", "follow", "theme", "layers"};
  std::string look;
  for (const std::string& entry : split(text, ',')) {
    const std::size_t equals = entry.find('=');
    const std::string key = entry.substr(0, equals);
    if (equals == entry.npos || std::ranges::find(kKeys, key) == kKeys.end()) {
      const std::string guess = nearest(key, kKeys);
      throw InputError(fmt::format("--look {}: {} is not known; expected some of {}, each =VALUE, with commas{}", text, quoted(entry),
                                   fmt::join(kKeys, ", "), guess.empty() ? "" : fmt::format("; did you mean {}=?", guess)));
    }
    const std::string value = entry.substr(equals + 1);
    if (key == "azimuth" || key == "elevation" || key == "distance") {
      const double number = number_from("--look " + key, value, key == "distance" ? "metres, such as 3" : "degrees, such as 30");
      if (!std::isfinite(number)) throw InputError(fmt::format("--look {}={}: expected a finite number", key, value));
    }
    if (key == "theme" && value != "light" && value != "dark") {
      throw InputError(fmt::format("--look theme={}: expected light or dark", value));
    }
    if (key == "follow") follow = value;
    look += fmt::format("&{}=", key);
    for (const char c : value) look += std::isalnum(static_cast<unsigned char>(c)) ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return look;
}

void size_from(const std::string& text, ViewArguments& arguments) {
  const std::vector<std::string> parts = split(text, 'x');
  const auto wrong = [&] { return InputError(fmt::format("--size {}: expected WIDTHxHEIGHT in pixels, even numbers from 64 to 4096, such as 1280x720", text)); };
  if (parts.size() != 2) throw wrong();
  const auto number = [&](const std::string& part) {
    const std::int64_t pixels = integer_from("--size", part, "WIDTHxHEIGHT in pixels, such as 1280x720");
    if (pixels < 64 || pixels > 4096 || pixels % 2 != 0) throw wrong();
    return static_cast<int>(pixels);
  };
  arguments.width = number(parts[0]);
  arguments.height = number(parts[1]);
}

/// The page in a browser, for as long as its pictures are taken.
class Stage {
 public:
  Stage(const ViewArguments& arguments, const Animation& animation, const std::string& target)
      : folder_(target), page_(folder_.file("page.html")) {
    write_file(page_, page_of(animation));
    browser_.emplace(page_, folder_.file("profile"), arguments.width, arguments.height, "chrome=0" + arguments.look);
  }
  std::string picture(double seconds) {
    browser_->show(seconds);
    return browser_->picture();
  }
  TemporaryFolder& folder() { return folder_; }

 private:
  TemporaryFolder folder_;
  std::string page_;
  std::optional<Browser> browser_;
};

double end_of(const Animation& animation) { return animation.times.back() - animation.times.front(); }

void check_moments(const ViewArguments& arguments, double end) {
  for (const double moment : arguments.moments) {
    if (moment <= end * (1 + 1e-9)) continue;
    throw InputError(fmt::format("--moments {}: the motion ends at {:.6g} s; choose moments up to there", moment, end));
  }
}

std::vector<double> moments_of(const ViewArguments& arguments, const Animation& animation) {
  const double end = end_of(animation);
  if (arguments.moments.empty()) {
    if (end == 0) return {0};
    return {0, end / 3, 2 * end / 3, end};
  }
  check_moments(arguments, end);
  return arguments.moments;
}

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;

void require_fine(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) throw std::runtime_error(fmt::format("a picture cannot be put together: {}", cairo_status_to_string(status)));
}

Surface surface_of(const std::string& png) {
  struct Reading {
    std::string_view left;
  } reading{png};
  const auto read = [](void* closure, unsigned char* to, unsigned int length) {
    auto& from = static_cast<Reading*>(closure)->left;
    if (from.size() < length) return CAIRO_STATUS_READ_ERROR;
    std::memcpy(to, from.data(), length);
    from.remove_prefix(length);
    return CAIRO_STATUS_SUCCESS;
  };
  Surface surface(cairo_image_surface_create_from_png_stream(read, &reading));
  require_fine(cairo_surface_status(surface.get()));
  return surface;
}

/// Side by side, each with its time.
std::string filmstrip(const std::vector<std::string>& pngs, const std::vector<double>& moments, int width, int height, bool dark) {
  const int count = static_cast<int>(pngs.size());
  Surface strip(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width * count, height));
  require_fine(cairo_surface_status(strip.get()));
  cairo_t* const pen = cairo_create(strip.get());
  for (int k = 0; k < count; ++k) {
    const Surface moment = surface_of(pngs[static_cast<std::size_t>(k)]);
    cairo_set_source_surface(pen, moment.get(), k * width, 0);
    cairo_paint(pen);
    if (count == 1) continue;
    cairo_select_font_face(pen, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(pen, std::max(12.0, height / 32.0));
    const double shade = dark ? 0.9 : 0.15;
    cairo_set_source_rgb(pen, shade, shade, shade);
    cairo_move_to(pen, k * width + height / 40.0, height - height / 40.0);
    cairo_show_text(pen, fmt::format("{:.2f} s", moments[static_cast<std::size_t>(k)]).c_str());
  }
  const cairo_status_t drawn = cairo_status(pen);
  cairo_destroy(pen);
  require_fine(drawn);
  std::string png;
  const auto append = [](void* closure, const unsigned char* bytes, unsigned int length) {
    static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(bytes), length);
    return CAIRO_STATUS_SUCCESS;
  };
  require_fine(cairo_surface_write_to_png_stream(strip.get(), append, &png));
  return png;
}

std::string write_picture(const ViewArguments& arguments, const Animation& animation) {
  const std::vector<double> moments = moments_of(arguments, animation);
  Stage stage(arguments, animation, arguments.picture);
  std::vector<std::string> pngs;
  for (const double moment : moments) pngs.push_back(stage.picture(moment));
  const bool dark = arguments.look.find("theme=dark") != std::string::npos;
  write_file(arguments.picture, filmstrip(pngs, moments, arguments.width, arguments.height, dark));
  return counted(static_cast<std::int64_t>(moments.size()), "moment");
}

std::string write_film(const ViewArguments& arguments, const Animation& animation) {
  Stage stage(arguments, animation, arguments.film);
  Pipe frames;
  ChildProcess ffmpeg({find_program("ffmpeg"), "-loglevel", "error", "-y", "-f", "image2pipe", "-framerate", fmt::format("{}", kFilmRate), "-c:v",
                       "png", "-i", "-", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", stage.folder().file("film.mp4")},
                      {{frames.read_end(), 0}});
  frames.close_read();
  const auto count = static_cast<std::int64_t>(std::floor(end_of(animation) * kFilmRate)) + 1;
  Progress progress(count, 1, "frames");
  bool taken = true;
  for (std::int64_t k = 0; k < count && taken; ++k) {
    const std::string png = stage.picture(static_cast<double>(k) / kFilmRate);
    taken = frames.write_all(png.data(), png.size());
    progress.update(k + 1, Progress::Clock::now());
  }
  progress.erase();
  frames.close_write();
  if (!ffmpeg.wait() || !taken) throw std::runtime_error(fmt::format("{}: cannot be written: ffmpeg has failed", arguments.film));
  stage.folder().publish("film.mp4");
  return counted(count, "frame");
}

std::string size_text(const std::string& file) {
  const auto bytes = static_cast<double>(std::filesystem::file_size(file));
  return bytes < 1e6 ? fmt::format("{:.0f} kB", bytes / 1e3) : fmt::format("{:.1f} MB", bytes / 1e6);
}

}  // namespace

void read_view_options(const ViewTexts& texts, ViewArguments& arguments) {
  if (!texts.fps.empty()) {
    arguments.fps = number_from("--fps", texts.fps, "frames a second, such as 60");
    if (!(arguments.fps > 0) || !std::isfinite(arguments.fps)) throw InputError(fmt::format("--fps {}: expected a number above zero, such as 60", texts.fps));
  }
  if (!texts.moments.empty()) {
    for (const std::string& moment : split(texts.moments, ',')) {
      arguments.moments.push_back(number_from("--moments", moment, "seconds with commas, such as 0,0.5,1"));
      if (!(arguments.moments.back() >= 0) || !std::isfinite(arguments.moments.back())) {
        throw InputError(fmt::format("--moments {}: expected seconds since the begin of the motion, zero or more", moment));
      }
    }
    if (arguments.moments.size() > 16) throw InputError(fmt::format("--moments names {}; expected 16 at most", arguments.moments.size()));
  }
  if (!texts.size.empty()) size_from(texts.size, arguments);
  if (!texts.look.empty()) arguments.look = look_from(texts.look, arguments.follow);
  if (!texts.moments.empty() && arguments.picture.empty()) throw InputError("--moments are those of a picture: give --picture FILE.png too");
  if (!texts.fps.empty() && !arguments.any() && !arguments.live) throw InputError("--fps says what --view, --gltf, --picture and --film take: give one of them too");
  if ((!texts.size.empty() || !texts.look.empty()) && arguments.picture.empty() && arguments.film.empty()) {
    throw InputError(fmt::format("{} is about pictures: give --picture FILE.png or --film FILE.mp4 too", texts.size.empty() ? "--look" : "--size"));
  }
  if (!arguments.picture.empty()) find_browser("--picture");
  if (arguments.film.empty()) return;
  find_browser("--film");
  if (find_program("ffmpeg").empty()) throw InputError("--film: ffmpeg was not found, which packs the film; install it (apt-get install ffmpeg)");
}

void check_views(const ViewArguments& arguments, const Model& model, double duration) {
  check_moments(arguments, duration);
  const std::vector<std::string>& bodies = model.names.body;
  if (arguments.follow.empty() || std::ranges::find(bodies, arguments.follow) != bodies.end()) return;
  const std::string guess = nearest(arguments.follow, bodies);
  throw InputError(fmt::format("--look follow={}: {} has no body of that name; {}", arguments.follow, model.names.model,
                               guess.empty() ? "linden inspect lists what there is" : fmt::format("did you mean {}?", guess)));
}

std::vector<Output> outputs_of(const ViewArguments& arguments) {
  return {{"--view", arguments.view, {".html"}},
          {"--gltf", arguments.gltf, {".glb"}},
          {"--picture", arguments.picture, {".png"}},
          {"--film", arguments.film, {".mp4"}}};
}

void tell_drawing(const Drawing& drawing) {
  constexpr std::size_t kMost = 5;
  const std::size_t told = std::min(kMost, drawing.warnings.size());
  for (std::size_t k = 0; k < told; ++k) tell("warning: {}", drawing.warnings[k]);
  if (told < drawing.warnings.size()) tell("warning: and {} more like these", drawing.warnings.size() - told);
}

WrittenViews write_views(const ViewArguments& arguments, const Animation& animation) {
  tell_drawing(animation.drawing);
  for (const std::string& note : animation.notes) tell("shown: {}", note);
  WrittenViews written;
  const std::string frames = counted(static_cast<std::int64_t>(animation.frames()), "frame");
  const auto write = [&](const std::string& file, const std::function<std::string()>& action) {
    if (file.empty()) return;
    std::string what;
    if (attempt([&] { what = action(); })) {
      written.lines.push_back(fmt::format("{}: {}, {}", file, what, size_text(file)));
    } else {
      written.fine = false;
    }
  };
  write(arguments.view, [&] {
    write_file(arguments.view, page_of(animation));
    return frames;
  });
  write(arguments.gltf, [&] {
    write_file(arguments.gltf, glb_of(animation));
    return frames;
  });
  write(arguments.picture, [&] { return write_picture(arguments, animation); });
  write(arguments.film, [&] { return write_film(arguments, animation); });
  return written;
}

}  // namespace linden
