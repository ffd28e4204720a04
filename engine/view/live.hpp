// engine/view/live.hpp
// The wire between a running simulation and the pages that watch it, `linden view --live`: what goes over the WebSocket at /stream
// (engine/program/live_server.hpp).
//
// The page is that of engine/view/page.hpp. Its data is the start as one frame, and its header has beside the rest
//
//   "live"  {"session": text, other in every process; "step": [s], "forces": most of them in a frame, "weight": [N] of all bodies,
//            "servos": [{"name", "unit", "least", "most"}, ...]: joint, "rad" or "m", what a slider may ask of it}
//
// To a page, binary: a frame, little endian, without gaps.
//
//   time      float64                 [s]
//   episode   uint32                  counts resets: what is of different episodes is no one motion
//   forces    uint32                  F
//   pulls     uint32                  P
//   steps     uint32                  taken, modulo 2^32
//   poses     float32  [bodies][7]    quaternion x y z w, place [m], as Animation::poses has them
//   curves    float32  [C]            values of the header's curves, NaN where there is none
//   forces    float32  [F][7]         body, place [m], force [N], world frame
//   pulls     float32  [P][7]         body, where it is held [m], where it is drawn to [m], world frame
//
// To a page, text: JSON.
//
//   {"is": "status", "session", "state": "paused", "running" or "failed", "speed": asked for [s/s], "pace": reached [s/s] or null,
//    "slow": whether it falls behind what is asked for, "targets": [of each servo], "watchers": pages, "message": why it failed, or ""}
//   {"is": "error", "message": one sentence on a command that was refused}
//
// From a page, text: JSON, at most kMostOfCommand bytes, one command with these members and no others.
//
//   {"do": "run"}                                    at the speed of the clock times the speed that was asked for
//   {"do": "pause"}
//   {"do": "step", "steps": 1 to 100,000}            and pause
//   {"do": "reset"}                                  to the start; pauses one that has failed
//   {"do": "speed", "factor": 0.001 to 1,000}
//   {"do": "target", "servo": its place in the list, "value": [rad, m]}
//   {"do": "pull", "body": b, "point": [x, y, z] in the body's frame [m], "to": [x, y, z] in the world's [m]}
//                                                    a spring from there to there (engine/program/pull.hpp); again: moves it
//   {"do": "release"}                                the spring that this page has pulled with; it goes with the page's connection too
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/view/animation.hpp"

namespace linden {

inline constexpr std::size_t kMostOfCommand = 4096;  // [bytes]

struct LiveServo {
  std::string name;  // joint
  std::string unit;  // "rad" or "m"
  double least = 0, most = 0;
};

/// What a page has to know of a simulation before its first frame.
struct LiveFacts {
  std::string session;
  double step = 0;             // [s]
  std::size_t most_forces = 0;
  double weight = 0;           // [N]
  std::vector<LiveServo> servos;
};

/// A spring that somebody pulls with.
struct DrawnPull {
  Index slot = 0;
  std::array<double, 3> from{}, to{};  // world frame [m]
};

struct LiveCommand {
  enum class Do : std::uint8_t { run, pause, step, reset, speed, target, pull, release } what = Do::pause;
  std::int64_t number = 0;              // steps; servo; body
  double value = 0;                     // factor; target
  std::array<double, 3> point{}, to{};  // of a pull
};

/// The page of a simulation that runs on from the one frame that there is. Throws as page_of does.
std::string live_page_of(const Animation& start, const LiveFacts& live);

/// Bytes of a frame: the last one that the animation has.
std::string live_frame(const Animation& animation, std::uint32_t episode, std::uint32_t steps, std::span<const DrawnPull> pulls);

/// What a page asks for. Throws InputError, one sentence, for whatever is no command.
LiveCommand live_command(std::string_view text, std::size_t bodies, std::size_t servos);

/// JSON of a refusal.
std::string live_error(std::string_view message);

}  // namespace linden
