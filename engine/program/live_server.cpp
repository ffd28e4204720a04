#include "engine/program/live_server.hpp"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <array>
#include <cerrno>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "engine/program/live_host.hpp"
#include "engine/view/live.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Error = beast::error_code;
using Shared = std::shared_ptr<const std::string>;

constexpr auto kRequestTime = std::chrono::seconds(10);  // in which a request has to be there
constexpr auto kPageTime = std::chrono::seconds(60);     // in which an answer has to be taken
constexpr auto kIdleTime = std::chrono::seconds(30);     // in which a watcher has to answer a ping
constexpr auto kGoodbyeTime = std::chrono::seconds(2);   // in which a client that was refused has to go
constexpr std::uint32_t kMostOfHeader = 8192;            // [bytes]
constexpr std::size_t kMostConnections = 96, kMostWatchers = 32, kMostAnswers = 16;
constexpr int kSendBuffer = 1 << 18;  // [bytes]: what lies there is on its way, however old it becomes

/// What the server's parts share; the server's thread alone touches it, but for the waiting room.
struct Hall {
  std::string host;  // that it listens at, as addresses have it
  bool loopback = true;
  Shared page;
  std::function<void(LiveEvent)> hear;
  std::map<std::uint64_t, std::weak_ptr<class Watcher>> watchers;
  std::uint64_t last_watcher = 0;
  std::size_t connections = 0;
  Shared frame, status;  // the last ones

  // what other threads have left to be sent
  std::mutex mutex;
  Shared waiting_frame, waiting_status;
  bool called = false;  // the server's thread knows
};

/// One of the connections that there may be.
class Seat {
 public:
  explicit Seat(Hall& hall) : hall_(hall) { ++hall_.connections; }
  ~Seat() { --hall_.connections; }
  Seat(const Seat&) = delete;
  Seat& operator=(const Seat&) = delete;

 private:
  Hall& hall_;
};

using Stream = websocket::stream<beast::tcp_stream>;
using Request = http::request<http::string_body>;

/// A page that watches.
class Watcher : public std::enable_shared_from_this<Watcher> {
 public:
  Watcher(Hall& hall, std::unique_ptr<Seat> seat, beast::tcp_stream stream)
      : hall_(hall), seat_(std::move(seat)), stream_(std::move(stream)), number_(++hall.last_watcher) {}
  ~Watcher() { leave(); }

  void begin(const Request& request) {
    Error ignored;
    auto& socket = beast::get_lowest_layer(stream_).socket();
    socket.set_option(tcp::no_delay(true), ignored);
    socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(websocket::stream_base::timeout{kRequestTime, kIdleTime, true});
    stream_.read_message_max(kMostOfCommand);
    stream_.auto_fragment(false);
    hall_.watchers[number_] = weak_from_this();
    stream_.async_accept(request, [self = shared_from_this()](Error error) {
      if (error) return self->leave();
      self->joined_ = true;
      self->hall_.hear({LiveEvent::What::joined, self->number_, ""});
      if (self->hall_.status) self->give_status(self->hall_.status);
      if (self->hall_.frame) self->give_frame(self->hall_.frame);
      self->read();
    });
  }

  void give_frame(const Shared& frame) {
    frame_ = frame;
    send();
  }
  void give_status(const Shared& status) {
    status_ = status;
    send();
  }
  void give_answer(std::string text) {
    if (answers_.size() >= kMostAnswers) {
      Error ignored;
      beast::get_lowest_layer(stream_).socket().close(ignored);
      return leave();
    }
    answers_.push_back(std::make_shared<const std::string>(std::move(text)));
    send();
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](Error error, std::size_t) {
      if (error) return self->leave();
      if (self->stream_.got_text()) {
        self->hall_.hear({LiveEvent::What::said, self->number_, beast::buffers_to_string(self->buffer_.data())});
      } else {
        self->give_answer(live_error("a command came as binary; expected text"));
      }
      self->buffer_.consume(self->buffer_.size());
      if (!self->gone_) self->read();
    });
  }

  void send() {
    if (on_its_way_ || !joined_ || gone_) return;
    bool text = true;
    if (status_) {
      on_its_way_ = std::exchange(status_, nullptr);
    } else if (!answers_.empty()) {
      on_its_way_ = answers_.front();
      answers_.pop_front();
    } else if (frame_) {
      on_its_way_ = std::exchange(frame_, nullptr);
      text = false;
    } else {
      return;
    }
    stream_.text(text);
    stream_.async_write(asio::buffer(*on_its_way_), [self = shared_from_this()](Error error, std::size_t) {
      self->on_its_way_ = nullptr;
      if (error) return self->leave();
      self->send();
    });
  }

  void leave() {
    if (std::exchange(gone_, true)) return;
    hall_.watchers.erase(number_);
    if (joined_) hall_.hear({LiveEvent::What::left, number_, ""});
  }

  Hall& hall_;
  std::unique_ptr<Seat> seat_;
  Stream stream_;
  std::uint64_t number_;
  bool joined_ = false, gone_ = false;
  beast::flat_buffer buffer_{kMostOfCommand};
  Shared frame_, status_;  // that wait
  std::deque<Shared> answers_;
  Shared on_its_way_;
};

/// One request, and the answer to it.
class Visitor : public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(Hall& hall, tcp::socket socket) : hall_(hall), seat_(std::make_unique<Seat>(hall)), stream_(std::move(socket)) {
    parser_.header_limit(kMostOfHeader);
    parser_.body_limit(kMostOfCommand);
  }

  void begin() {
    stream_.expires_after(kRequestTime);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](Error error, std::size_t) { self->got(error); });
  }

 private:
  void got(Error error) {
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      return refuse(http::status::request_header_fields_too_large, fmt::format("The request is longer than {} bytes.", kMostOfHeader));
    }
    if (error == http::error::body_limit) return refuse(http::status::payload_too_large, "The request has a body, which nothing here takes.");
    if (error == http::error::end_of_stream) return go();
    if (error && error.category() == http::make_error_code(http::error::bad_method).category()) {
      return refuse(http::status::bad_request, "This is no request of HTTP.");
    }
    if (error) return;
    answer(parser_.get());
  }

  void answer(const Request& request) {
    const std::string host(request[http::field::host]);
    if (request.count(http::field::host) != 1 || !is_own_host(host, hall_.host, hall_.loopback)) {
      return refuse(http::status::forbidden, "This page answers to the address that linden view --live has printed and to no other name.");
    }
    if (request.count(http::field::origin) > 1 || (request.count(http::field::origin) == 1 && !is_own_origin(std::string(request[http::field::origin]), host))) {
      return refuse(http::status::forbidden, "Pages of other origins may not watch or steer this simulation.");
    }
    if (request.method() != http::verb::get) return refuse(http::status::method_not_allowed, "There is nothing here but to GET.");
    if (request.target() == "/") return send_page();
    if (request.target() != "/stream") return refuse(http::status::not_found, "There is nothing here but / and /stream.");
    if (!websocket::is_upgrade(request)) return refuse(http::status::upgrade_required, "This is a WebSocket.");
    if (hall_.watchers.size() >= kMostWatchers) {
      return refuse(http::status::service_unavailable, fmt::format("{} pages watch already, which is the most: close one.", kMostWatchers));
    }
    const auto watcher = std::make_shared<Watcher>(hall_, std::move(seat_), std::move(stream_));
    watcher->begin(request);
  }

  template <class Response>
  void send(const std::shared_ptr<Response>& response) {
    response->set(http::field::x_frame_options, "DENY");
    response->set("X-Content-Type-Options", "nosniff");
    response->set("Cross-Origin-Resource-Policy", "same-origin");
    response->set(http::field::cache_control, "no-store");
    response->keep_alive(false);
    response->prepare_payload();
    stream_.expires_after(kPageTime);
    http::async_write(stream_, *response, [self = shared_from_this(), response](Error error, std::size_t) {
      if (!error) self->go();
    });
  }

  void send_page() {
    const auto response = std::make_shared<http::response<http::span_body<const char>>>();
    response->body() = beast::span<const char>(hall_.page->data(), hall_.page->size());
    response->set(http::field::content_type, "text/html; charset=utf-8");
    send(response);
  }

  void refuse(http::status status, const std::string& sentence) {
    const auto response = std::make_shared<http::response<http::string_body>>(status, 11);
    response->set(http::field::content_type, "text/plain; charset=utf-8");
    if (status == http::status::method_not_allowed) response->set(http::field::allow, "GET");
    response->body() = sentence + "\n";
    send(response);
  }

  /// What is still coming is read and thrown away, or the answer might be lost with it.
  void go() {
    Error ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_.expires_after(kGoodbyeTime);
    drain();
  }
  void drain() {
    constexpr std::size_t kMostDrained = 1 << 22;
    stream_.async_read_some(asio::buffer(thrown_away_), [self = shared_from_this()](Error error, std::size_t bytes) {
      self->drained_ += bytes;
      if (!error && self->drained_ < kMostDrained) self->drain();
    });
  }

  Hall& hall_;
  std::unique_ptr<Seat> seat_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMostOfHeader + kMostOfCommand};
  http::request_parser<http::string_body> parser_;
  std::array<char, 4096> thrown_away_;
  std::size_t drained_ = 0;
};

}  // namespace

class LiveServer::Implementation {
 public:
  explicit Implementation(const LiveAddress& address) : acceptor_(context_), pause_(context_) {
    Error error;
    const asio::ip::address ip = asio::ip::make_address(address.bind == "localhost" ? "127.0.0.1" : address.bind, error);
    if (error) throw InputError(fmt::format("--bind {}: expected an address of this machine, such as 127.0.0.1 or ::1, no name", address.bind));
    const tcp::endpoint endpoint(ip, address.port);
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) refuse(address, error);
    hall_.loopback = ip.is_loopback();
    hall_.host = ip.is_v6() ? fmt::format("[{}]", ip.to_string()) : ip.to_string();
  }

  ~Implementation() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
    hall_.hear = [](const LiveEvent&) {};
  }

  std::string address() const { return fmt::format("http://{}:{}/", hall_.host, acceptor_.local_endpoint().port()); }
  bool reachable() const { return !hall_.loopback; }

  void serve(std::string page, std::function<void(LiveEvent)> hear) {
    hall_.page = std::make_shared<const std::string>(std::move(page));
    hall_.hear = std::move(hear);
    accept();
    thread_ = std::thread([this] { context_.run(); });
  }

  void send(Shared frame, Shared status) {
    const std::lock_guard lock(hall_.mutex);
    if (frame) hall_.waiting_frame = std::move(frame);
    if (status) hall_.waiting_status = std::move(status);
    if (std::exchange(hall_.called, true)) return;
    asio::post(context_, [this] { pass_on(); });
  }

  void answer(std::uint64_t number, std::string text) {
    asio::post(context_, [this, number, text = std::move(text)] {
      const auto found = hall_.watchers.find(number);
      if (found == hall_.watchers.end()) return;
      if (const auto watcher = found->second.lock()) watcher->give_answer(text);
    });
  }

 private:
  [[noreturn]] static void refuse(const LiveAddress& address, Error error) {
    if (error == asio::error::address_in_use) {
      throw InputError(fmt::format("--port {}: {} has it in use already, perhaps for another linden view --live; choose another, or --port 0 for one that is free",
                                   address.port, address.bind));
    }
    if (error == asio::error::access_denied) {
      throw InputError(fmt::format("--port {}: this user may not listen there; choose one above 1023, or --port 0 for one that is free", address.port));
    }
    if (error.value() == EADDRNOTAVAIL || error.value() == EAFNOSUPPORT) {
      throw InputError(fmt::format("--bind {}: this machine has no such address; leave it out for 127.0.0.1", address.bind));
    }
    throw InputError(fmt::format("--bind {}, --port {}: {}", address.bind, address.port, error.message()));
  }

  void accept() {
    acceptor_.async_accept([this](Error error, tcp::socket socket) {
      if (!error && hall_.connections < kMostConnections) {
        std::make_shared<Visitor>(hall_, std::move(socket))->begin();
      } else if (!error) {
        turn_away(socket);
      } else {
        // out of descriptors, most often: they come back
        pause_.expires_after(std::chrono::milliseconds(100));
        return pause_.async_wait([this](Error) { accept(); });
      }
      accept();
    });
  }

  static void turn_away(tcp::socket& socket) {
    static constexpr std::string_view kBusy = "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
    Error ignored;
    socket.non_blocking(true, ignored);
    socket.write_some(asio::buffer(kBusy.data(), kBusy.size()), ignored);
  }

  void pass_on() {
    Shared frame, status;
    {
      const std::lock_guard lock(hall_.mutex);
      frame = std::exchange(hall_.waiting_frame, nullptr);
      status = std::exchange(hall_.waiting_status, nullptr);
      hall_.called = false;
    }
    if (frame) hall_.frame = frame;
    if (status) hall_.status = status;
    const auto watchers = hall_.watchers;  // some may leave
    for (const auto& [number, weak] : watchers) {
      const auto watcher = weak.lock();
      if (!watcher) continue;
      if (status) watcher->give_status(status);
      if (frame) watcher->give_frame(frame);
    }
  }

  Hall hall_;
  asio::io_context context_{1};  // goes before the hall: what it still holds of connections is there
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
  std::thread thread_;
};

LiveServer::LiveServer(const LiveAddress& address) : implementation_(std::make_unique<Implementation>(address)) {}
LiveServer::~LiveServer() = default;
std::string LiveServer::address() const { return implementation_->address(); }
bool LiveServer::reachable() const { return implementation_->reachable(); }
void LiveServer::serve(std::string page, std::function<void(LiveEvent)> hear) { implementation_->serve(std::move(page), std::move(hear)); }
void LiveServer::send_frame(std::string bytes) { implementation_->send(std::make_shared<const std::string>(std::move(bytes)), nullptr); }
void LiveServer::send_status(std::string text) { implementation_->send(nullptr, std::make_shared<const std::string>(std::move(text))); }
void LiveServer::answer(std::uint64_t watcher, std::string text) { implementation_->answer(watcher, std::move(text)); }

}  // namespace linden
