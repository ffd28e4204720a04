// tests/engine/live_client.hpp
// `linden view --live` as strangers meet it: the program in a process of its own, and clients of plain sockets.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/engine/command_line.hpp"

namespace linden {

/// The program on a port that was free.
class LiveProgram {
 public:
  explicit LiveProgram(const std::string& arguments) {
    const std::string command = fmt::format("exec '{}' view {} --live --port 0 2> '{}'", LINDEN_PROGRAM, arguments, folder_.file("err"));
    int ends[2];
    REQUIRE(::pipe2(ends, O_CLOEXEC) == 0);
    process_ = ::fork();
    if (process_ == 0) {
      ::dup2(ends[1], STDOUT_FILENO);
      ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      ::_exit(127);
    }
    ::close(ends[1]);
    std::string out;
    char byte;
    while (out.find("Ctrl-C") == out.npos && ::read(ends[0], &byte, 1) == 1) out += byte;
    ::close(ends[0]);
    const std::size_t at = out.find("http://127.0.0.1:");
    INFO(out << errors());
    REQUIRE(at != out.npos);
    port_ = std::stoi(out.substr(at + 17));
  }
  ~LiveProgram() {
    if (process_ > 0) interrupt();
  }
  LiveProgram(const LiveProgram&) = delete;
  LiveProgram& operator=(const LiveProgram&) = delete;

  int port() const { return port_; }
  std::string errors() const { return text_of(folder_ / "err"); }

  /// By a signal; the exit code, or minus the signal that ended it.
  int interrupt(int signal = SIGINT) {
    ::kill(process_, signal);
    int status = 0;
    ::waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  Folder folder_;
  pid_t process_ = -1;
  int port_ = 0;
};

/// A connection. Whatever is read is waited for.
class Client {
 public:
  /// room: of what came and was not read [bytes]; 0: as the system has it.
  explicit Client(int port, int room = 0) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (room > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// False where the other side has gone.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  void end() { ::shutdown(socket_, SHUT_WR); }

  /// So many bytes, or fewer where the other side has gone.
  std::string read(std::size_t count) {
    std::string bytes(count, '\0');
    std::size_t got = 0;
    while (got < count) {
      const ssize_t more = ::recv(socket_, bytes.data() + got, count - got, 0);
      if (more <= 0) break;
      got += static_cast<std::size_t>(more);
    }
    bytes.resize(got);
    return bytes;
  }
  std::string read_to_end() {
    std::string all;
    for (std::string some = read(4096); !some.empty(); some = read(4096)) all += some;
    return all;
  }
  std::string read_header() {
    std::string header;
    while (!header.ends_with("\r\n\r\n")) {
      const std::string byte = read(1);
      if (byte.empty()) break;
      header += byte;
    }
    return header;
  }

 private:
  int socket_;
};

/// All of the answer to a request; `more`: lines of its header.
inline std::string asked(const LiveProgram& program, const std::string& target = "/", const std::string& more = "", const std::string& host = "localhost",
                         const std::string& method = "GET") {
  Client client(program.port());
  client.send(fmt::format("{} {} HTTP/1.1\r\nHost: {}\r\n{}\r\n", method, target, host, more));
  return client.read_to_end();
}

inline const std::string kUpgrade =
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

struct LiveMessage {
  int kind = 8;  // 1 text, 2 binary, 8 the end
  std::string bytes;
};

/// Head of a frame.
struct LiveHead {
  double time;
  std::uint32_t episode, forces, pulls, steps;
};

/// A page that watches, without a page.
class LiveClient {
 public:
  explicit LiveClient(const LiveProgram& program, int room = 0) : client_(program.port(), room) {
    client_.send("GET /stream HTTP/1.1\r\nHost: localhost\r\n" + kUpgrade + "\r\n");
    const std::string header = client_.read_header();
    INFO(header);
    REQUIRE(header.starts_with("HTTP/1.1 101"));
  }

  bool send(const std::string& text, int kind = 1) {
    std::string bytes{static_cast<char>(0x80 | kind)};
    if (text.size() < 126) {
      bytes += static_cast<char>(0x80 | text.size());
    } else {
      bytes += {static_cast<char>(0xFE), static_cast<char>(text.size() >> 8), static_cast<char>(text.size())};
    }
    bytes += std::string(4, '\0');  // a mask that changes nothing
    return client_.send(bytes + text);
  }
  bool send_bytes(const std::string& bytes) { return client_.send(bytes); }

  LiveMessage read() {
    const std::string head = client_.read(2);
    if (head.size() < 2) return {};
    const auto byte = [](char c) { return static_cast<std::uint64_t>(static_cast<unsigned char>(c)); };
    std::uint64_t size = byte(head[1]);
    if (size >= 126) {
      const std::string more = client_.read(size == 126 ? 2 : 8);
      size = 0;
      for (const char c : more) size = size << 8 | byte(c);
    }
    LiveMessage message{head[0] & 15, client_.read(size)};
    if (message.kind != 9) return message;
    send(message.bytes, 10);
    return read();
  }
  /// The next text of that kind; an empty object where the connection has ended.
  nlohmann::json text(const std::string& kind) {
    for (LiveMessage message = read(); message.kind != 8; message = read()) {
      if (message.kind != 1) continue;
      const nlohmann::json json = nlohmann::json::parse(message.bytes);
      if (json["is"] == kind) return json;
    }
    return nlohmann::json::object();
  }
  /// The next status that says so.
  nlohmann::json status(const std::string& key, const nlohmann::json& value) {
    for (;;) {
      const nlohmann::json json = text("status");
      REQUIRE(!json.empty());
      if (json[key] == value) return json;
    }
  }
  std::string frame() {
    for (LiveMessage message = read(); message.kind != 8; message = read()) {
      if (message.kind == 2) return message.bytes;
    }
    FAIL("the stream has ended");
    return {};
  }
  static LiveHead head(const std::string& frame) {
    LiveHead head;
    static_assert(sizeof head == 24);
    std::memcpy(&head, frame.data(), sizeof head);
    return head;
  }
  static float number(const std::string& frame, std::size_t k) {
    float number;
    std::memcpy(&number, frame.data() + sizeof(LiveHead) + 4 * k, 4);
    return number;
  }

 private:
  Client client_;
};

}  // namespace linden
