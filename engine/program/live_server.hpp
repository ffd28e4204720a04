// engine/program/live_server.hpp
// The page and the stream of a running simulation, over HTTP, by one thread of its own. What it carries says engine/view/live.hpp.
//
//   GET /        the page
//   GET /stream  a WebSocket
//
//   watchers     each has one message under way, and of frames and of status messages the latest one waiting: who reads slowly is sent
//                fewer, who does not read at all none, and whoever sends them waits for nobody
//   strangers    a request has to name a host of this machine (a foreign name that leads here is refused) and, where it names an origin, the
//                page's own: pages of others can neither watch nor steer
//   limits       sizes of requests and messages, times in which a request has to be there and a page to be taken, numbers of connections and
//                of watchers. Who answers nothing for half a minute is let go
//
// The bytes that arrive are anybody's: nothing of them is believed before it is checked, and the worst of them end their own connection.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace linden {

struct LiveAddress {
  std::string bind = "127.0.0.1";  // an address of this machine, or localhost
  std::uint16_t port = 8470;       // 0: any that is free
};

/// What happens to watchers, each known by a number of its own.
struct LiveEvent {
  enum class What : std::uint8_t { joined, left, said } what;
  std::uint64_t watcher;
  std::string text;  // that it said
};

class LiveServer {
 public:
  /// Listens: who comes now waits until serve. Throws InputError where the address is none or the port is taken.
  explicit LiveServer(const LiveAddress& address);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  /// Where it listens: http://127.0.0.1:8470/
  std::string address() const;
  /// Whether others than this machine can reach it.
  bool reachable() const;

  /// Begins. `hear` is called by the server's thread and must not take long.
  void serve(std::string page, std::function<void(LiveEvent)> hear);

  // From any thread, without waiting. Newcomers get the last of both.
  void send_frame(std::string bytes);
  void send_status(std::string text);
  /// To one watcher. Who has sixteen answers waiting does not read them and is let go.
  void answer(std::uint64_t watcher, std::string text);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace linden
