// engine/program/views.hpp
// How a motion is to be looked at, and the files that come of it: --view, --gltf, --picture, --film of run, rollout and view.
//
//   --view FILE.html     the page (engine/view/page.hpp)
//   --gltf FILE.glb      binary glTF (engine/view/gltf.hpp)
//   --picture FILE.png   moments of the motion side by side, drawn by a browser without a display
//   --film FILE.mp4      the motion in its own time, 30 frames a second; ffmpeg packs what the browser draws
//   --fps F              frames that are kept of a second of the motion, default 60
//   --moments T,T,...    [s] that the picture shows, default four of them, the last one among them
//   --size WxH           pixels of a moment and of the film, default 960x720
//   --look LIST          camera and colours of pictures, such as azimuth=30,elevation=15,follow=pelvis,theme=dark,layers=collision
#pragma once

#include <string>
#include <vector>

#include "engine/files/output_file.hpp"
#include "engine/view/animation.hpp"

namespace linden {

struct ViewArguments {
  std::string view, gltf, picture, film;  // files; empty = none
  double fps = 60;                        // [1/s]
  std::vector<double> moments;            // [s]
  int width = 960, height = 720;          // [pixels]
  std::string look;                       // fragment of the page's address
  std::string follow;                     // body that it names; empty: none
  bool live = false;                      // looked at while it runs, --live of view; the files are then none

  bool any() const { return !view.empty() || !gltf.empty() || !picture.empty() || !film.empty(); }
};

/// Options as they were written; empty ones stay as they are.
struct ViewTexts {
  std::string fps, moments, size, look;
};
/// Throws InputError for what makes no sense, and for programs that a picture or a film needs and that are not there.
void read_view_options(const ViewTexts& texts, ViewArguments& arguments);

/// Throws InputError for a moment behind the end of a motion of so many seconds, and for a body to follow that the model has not got.
void check_views(const ViewArguments& arguments, const Model& model, double duration);

/// The files among a command's outputs.
std::vector<Output> outputs_of(const ViewArguments& arguments);

/// Tells what the drawing had to do without, the first five of it.
void tell_drawing(const Drawing& drawing);

/// Tells what the drawing had to do without, then writes one file after the other; what each became, in words: "humanoid.html: 600 frames, 1.2 MB". A complaint goes to standard error.
struct WrittenViews {
  std::vector<std::string> lines;
  bool fine = true;
};
WrittenViews write_views(const ViewArguments& arguments, const Animation& animation);

}  // namespace linden
