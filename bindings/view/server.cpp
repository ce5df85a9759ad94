#include "bindings/view/server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <fstream>
#include <list>
#include <map>
#include <optional>
#include <random>
#include <thread>

#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/base/printable.h"

namespace rapid {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Tcp = asio::ip::tcp;
using Request = http::request<http::string_body>;
using HttpResponse = http::response<http::string_body>;

// Bytes. A header has the cookies of all servers of this machine that a browser has visited: it stores 180 per host.
constexpr std::size_t max_header = 32768, max_body = 1024, max_message = 1 << 20;
// Answers that a page has not taken, and their bytes: it requests few at a time.
constexpr std::size_t max_answers = 64, max_answer_bytes = std::size_t{256} << 20;
// Unanswered requests of a page; further ones are read when some are answered.
constexpr int max_unanswered = 32;
// A connection has this long to send a request, and then to take the answer, unless it is a page's socket.
constexpr std::chrono::seconds request_time{10}, answer_time{60};

// Limits on descriptors, which leave most of the process's descriptors to the simulation.
struct ConnectionLimits {
    std::size_t pages, unauthenticated;  // sockets with a token; connections without one

    static ConnectionLimits for_this_process()
    {
        rlimit files{};
        const bool is_known = ::getrlimit(RLIMIT_NOFILE, &files) == 0;
        const rlim_t share = is_known ? files.rlim_cur / 8 : 0;
        return {std::clamp<std::size_t>(share, 8, 64), std::clamp<std::size_t>(share, 8, 32)};
    }
};

std::string random_token()
{
    std::random_device device;
    std::string token;
    for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", static_cast<std::uint32_t>(device()));
    return token;
}

// Compares in a time that does not depend on where they differ.
bool same_secret(std::string_view a, std::string_view b)
{
    unsigned char differ = a.size() != b.size();
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) differ |= static_cast<unsigned char>(a[i] ^ b[i]);
    return differ == 0;
}

// Subprotocols that a page offers with its socket: the one that it speaks, and one that is its token. A script cannot
// set any other header of a socket. A cookie would go to every port of this machine.
constexpr const char* protocol = "rapid";
constexpr std::string_view token_protocol = "rapid.token.";

// Otherwise programs started from here, such as the browser, would inherit it.
void close_on_exec(int socket) { ::fcntl(socket, F_SETFD, FD_CLOEXEC); }

bool is_own_host(std::string_view host)
{
    const std::size_t colon = host.rfind(':');
    const std::string_view name =
        host.substr(0, colon == std::string_view::npos || host.ends_with(']') ? host.size() : colon);
    return name == "127.0.0.1" || name == "localhost" || name == "[::1]";
}

const char* type_of(std::string_view name)
{
    if (name.ends_with(".html")) return "text/html; charset=utf-8";
    if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
    if (name.ends_with(".css")) return "text/css; charset=utf-8";
    return name.ends_with(".svg") ? "image/svg+xml" : "application/octet-stream";
}

// An exception, usually out of memory, ends only the handler that threw it.
void run_handlers(asio::io_context& context)
{
    for (;;) {
        try {
            context.run();
            return;
        } catch (const std::exception& error) {
            fmt::print(stderr, "rapid view: a request failed: {}\n", printable(error.what()));
        }
    }
}

std::string text_of(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Error("can't be read").at({path, 0});
    return {std::istreambuf_iterator<char>(file), {}};
}

std::filesystem::path three_file()
{
    for (const char* name :
         {"/usr/share/javascript/three/build/three.module.js", "/usr/share/javascript/three/three.module.js",
          "/usr/share/nodejs/three/build/three.module.js"})
        if (std::error_code none; std::filesystem::exists(name, none)) return name;
    throw Error("the viewer needs three.js; install it (apt install libjs-three)");
}

}  // namespace

class ViewServer::Impl {
public:
    Impl(int socket, const std::filesystem::path& folder, Handler handler)
        : folder_(folder), handler_(std::move(handler)), acceptor_(net_), work_guard_(asio::make_work_guard(work_))
    {
        std::error_code none;
        for (const auto& entry : std::filesystem::directory_iterator(folder, none))
            if (entry.is_regular_file()) files_["/" + entry.path().filename().string()] = entry.path();
        if (!files_.contains("/index.html")) throw Error("the files of the viewer's page are missing").at({folder, 0});
        files_["/three.module.js"] = three_file();
        acceptor_.assign(Tcp::v4(), socket);
        port_ = acceptor_.local_endpoint().port();
        worker_ = std::thread([this] { run_handlers(work_); });
    }
    ~Impl()
    {
        work_.stop();
        net_.stop();
        worker_.join();
    }

    std::string address() const { return address_with(token_); }
    std::string address_to_open() const { return address_with(token_to_open_); }
    asio::io_context& work() { return work_; }

    void run()
    {
        accept();
        run_handlers(net_);
    }

    void repeat(int milliseconds, std::function<void()> f)
    {
        auto timer = std::make_shared<asio::steady_timer>(work_, std::chrono::milliseconds(milliseconds));
        timer->async_wait([this, milliseconds, timer, f = std::move(f)](const beast::error_code& error) mutable {
            if (error) return;
            f();
            repeat(milliseconds, std::move(f));
        });
    }

private:
    class Socket;
    class Connection;

    void accept();

    std::string address_with(const std::string& token) const
    {
        return fmt::format("http://127.0.0.1:{}/?token={}", port_, token);
    }

    enum class Token { None, Lasting, Once };

    // Returns the message for a page opened with the one-time token, so that it can connect again.
    std::string lasting_token() const
    {
        JsonText json;
        json.object("re", 0, "token", token_);
        return json.text();
    }

    // Returns the token among the subprotocols. That of the address to open is valid once.
    Token token_of(const Request& request)
    {
        const auto offered = request[http::field::sec_websocket_protocol];
        for (const auto name : http::token_list(offered)) {
            const std::string_view text(name.data(), name.size());
            if (!text.starts_with(token_protocol)) continue;
            const std::string_view token = text.substr(token_protocol.size());
            if (same_secret(token, token_)) return Token::Lasting;
            if (!is_opened_ && same_secret(token, token_to_open_)) {
                is_opened_ = true;
                return Token::Once;
            }
        }
        return Token::None;
    }

    static std::string path_of(const Request& request)
    {
        const std::string target(request.target());
        return target.substr(0, target.find('?'));
    }

    // Returns why the request is refused, or an empty string.
    std::string refusal(const Request& request) const
    {
        const std::string host(request[http::field::host]), origin(request[http::field::origin]);
        if (!is_own_host(host)) return "the Host is not this machine";
        if (!origin.empty() && origin != "http://" + host) return "the Origin is another page";
        return "";
    }

    static HttpResponse empty_answer(const Request& request)
    {
        HttpResponse response(http::status::ok, request.version());
        response.keep_alive(request.keep_alive());
        response.set(http::field::cache_control, "no-store");
        response.set("X-Content-Type-Options", "nosniff");
        response.set("Referrer-Policy", "no-referrer");
        response.set("X-Frame-Options", "DENY");
        response.set("Cross-Origin-Resource-Policy", "same-origin");
        response.set("Content-Security-Policy",
                     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src "
                     "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
        response.set(http::field::content_type, "text/plain; charset=utf-8");
        return response;
    }

    static HttpResponse refuse(const Request& request, http::status status, const std::string& why)
    {
        HttpResponse response = empty_answer(request);
        response.result(status);
        response.body() = why + '\n';
        response.prepare_payload();
        return response;
    }

    // Returns a file of the page. These contain nothing of the scene, and need no token.
    HttpResponse answer(const Request& request) const
    {
        if (const std::string why = refusal(request); !why.empty())
            return refuse(request, http::status::forbidden, why);
        if (request.method() != http::verb::get)
            return refuse(request, http::status::method_not_allowed, "only GET is answered");
        const std::string path = path_of(request);
        const auto file = files_.find(path == "/" ? "/index.html" : path);
        if (file == files_.end()) return refuse(request, http::status::not_found, "the page has no such file");
        HttpResponse response = empty_answer(request);
        try {
            response.body() = text_of(file->second);
        } catch (const Error& error) {
            return refuse(request, http::status::internal_server_error, error.what());
        }
        response.set(http::field::content_type, type_of(file->first));
        response.prepare_payload();
        return response;
    }

    // A page that opens a socket always sends its Origin.
    bool requests_socket(const Request& request) const
    {
        return websocket::is_upgrade(request) && path_of(request) == "/socket" && refusal(request).empty() &&
               !request[http::field::origin].empty();
    }

    const std::filesystem::path folder_;
    const Handler handler_;
    const std::string token_ = random_token(), token_to_open_ = random_token();
    bool is_opened_ = false;
    const ConnectionLimits limits_ = ConnectionLimits::for_this_process();
    std::list<Connection*> unauthenticated_;  // connections without a token, in the order in which they came
    std::atomic<std::size_t> pages_ = 0;      // sockets
    std::map<std::string, std::filesystem::path> files_;  // by the path of a request
    asio::io_context net_{1}, work_{1};
    Tcp::acceptor acceptor_;
    asio::executor_work_guard<asio::io_context::executor_type> work_guard_;
    int port_ = 0;
    std::thread worker_;
};

// A page. Its functions run on the server's thread.
class ViewServer::Impl::Socket : public std::enable_shared_from_this<Socket> {
public:
    Socket(Impl& server, beast::tcp_stream&& stream) : server_(server), stream_(std::move(stream)) { ++server_.pages_; }
    ~Socket() { --server_.pages_; }

    // greeting: the first message, unless it is empty.
    void open(const Request& request, const std::string& greeting)
    {
        beast::get_lowest_layer(stream_).expires_never();
        stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
        stream_.read_message_max(max_message);
        stream_.write_buffer_bytes(1 << 17);
        stream_.auto_fragment(false);
        stream_.set_option(websocket::stream_base::decorator(
            [](websocket::response_type& response) { response.set(http::field::sec_websocket_protocol, protocol); }));
        stream_.async_accept(request, [self = shared_from_this(), greeting](const beast::error_code& error) {
            if (error) return;
            if (!greeting.empty()) self->send(greeting, false);
            self->read();
        });
    }

private:
    // A request that is not answered yet; its answer shares ownership.
    class PendingAnswer {
    public:
        explicit PendingAnswer(std::weak_ptr<Socket> page) : page_(std::move(page)) {}
        ~PendingAnswer()
        {
            try {
                if (auto page = page_.lock()) {
                    asio::io_context& net = page->server_.net_;
                    asio::post(net, [page = std::move(page)] { page->has_answered(); });
                }
            } catch (...) {  // out of memory: the page may request a smaller one
            }
        }
        PendingAnswer(const PendingAnswer&) = delete;
        PendingAnswer& operator=(const PendingAnswer&) = delete;

    private:
        const std::weak_ptr<Socket> page_;
    };

    void has_answered()
    {
        if (pending_answers_-- == max_unanswered && !is_handling_) read();
    }

    void has_handled()
    {
        is_handling_ = false;
        if (pending_answers_ < max_unanswered) read();
    }

    void read()
    {
        stream_.async_read(buffer_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
            if (error) return self->close();
            std::string text = beast::buffers_to_string(self->buffer_.data());
            self->buffer_.consume(self->buffer_.size());
            self->is_handling_ = true;
            ++self->pending_answers_;
            asio::post(self->server_.work_, [self, text = std::move(text)]() mutable {
                self->handle(text);
                asio::io_context& net = self->server_.net_;
                asio::post(net, [self = std::move(self)] { self->has_handled(); });
            });
        });
    }

    // Runs on the handler's thread. An answer may take long, and its page may have closed.
    void handle(const std::string& text)
    {
        const auto pending_answer = std::make_shared<const PendingAnswer>(weak_from_this());
        if (is_closed_) return;
        server_.handler_(text, [page = weak_from_this(), pending_answer](std::string message, bool binary) {
            auto open = page.lock();
            if (!open) return;
            asio::io_context& net = open->server_.net_;
            asio::post(net, [open = std::move(open), message = std::move(message), binary]() mutable {
                open->send(std::move(message), binary);
            });
        });
    }

    void close()
    {
        is_closed_ = true;
        beast::get_lowest_layer(stream_).close();
    }

    void send(std::string message, bool binary)
    {
        if (is_closed_) return;
        bytes_ += message.size();
        if (waiting_.size() >= max_answers || (bytes_ > max_answer_bytes && !waiting_.empty())) return close();
        waiting_.emplace_back(std::move(message), binary);
        if (waiting_.size() == 1) write();
    }

    void write()
    {
        stream_.binary(waiting_.front().second);
        stream_.async_write(asio::buffer(waiting_.front().first),
                            [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                                if (error) {
                                    self->is_closed_ = true;
                                    return self->waiting_.clear();
                                }
                                self->bytes_ -= self->waiting_.front().first.size();
                                self->waiting_.pop_front();
                                if (!self->waiting_.empty()) self->write();
                            });
    }

    Impl& server_;
    websocket::stream<beast::tcp_stream> stream_;
    beast::flat_buffer buffer_;
    std::deque<std::pair<std::string, bool>> waiting_;
    std::size_t bytes_ = 0;                // of waiting answers
    int pending_answers_ = 0;              // requests that are not answered yet
    bool is_handling_ = false;             // one of its requests is being handled
    std::atomic<bool> is_closed_ = false;  // its requests are no longer answered
};

class ViewServer::Impl::Connection : public std::enable_shared_from_this<Connection> {
public:
    Connection(Impl& server, Tcp::socket&& socket)
        : server_(server),
          stream_(std::move(socket)),
          place_(server_.unauthenticated_.insert(server_.unauthenticated_.end(), this))
    {
    }
    ~Connection() { leave(); }

    void close()
    {
        leave();
        stream_.close();
    }

    void read()
    {
        parser_.emplace();
        parser_->header_limit(max_header);
        parser_->body_limit(max_body);
        stream_.expires_after(request_time);
        http::async_read(stream_, buffer_, *parser_,
                         [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                             if (!error) self->respond();
                         });
    }

private:
    void leave()
    {
        if (place_) server_.unauthenticated_.erase(*place_);
        place_.reset();
    }

    void respond()
    {
        const Request& request = parser_->get();
        if (!server_.requests_socket(request))
            response_ = server_.answer(request);
        else if (server_.pages_ >= server_.limits_.pages)
            response_ = refuse(request, http::status::service_unavailable, "too many pages are open; close one");
        else if (const Token token = server_.token_of(request); token == Token::None)
            response_ = refuse(request, http::status::forbidden,
                               "the token is missing; open the address that rapid view printed");
        else
            return std::make_shared<Socket>(server_, std::move(stream_))
                ->open(request, token == Token::Once ? server_.lasting_token() : "");
        stream_.expires_after(answer_time);
        http::async_write(stream_, response_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
            if (error) return;
            if (self->response_.keep_alive()) return self->read();
            beast::error_code none;
            self->stream_.socket().shutdown(Tcp::socket::shutdown_send, none);
        });
    }

    Impl& server_;
    beast::tcp_stream stream_;
    std::optional<std::list<Connection*>::iterator> place_;  // in the server's list, while it has no token
    beast::flat_buffer buffer_;
    std::optional<http::request_parser<http::string_body>> parser_;
    HttpResponse response_;
};

void ViewServer::Impl::accept()
{
    acceptor_.async_accept([this](const beast::error_code& error, Tcp::socket socket) {
        if (error) {  // usually out of descriptors, until others have ended
            auto pause = std::make_shared<asio::steady_timer>(net_, std::chrono::milliseconds(100));
            return pause->async_wait([this, pause](const beast::error_code&) { accept(); });
        }
        beast::error_code none;
        socket.set_option(Tcp::no_delay(true), none);
        close_on_exec(socket.native_handle());
        // If there are too many, the oldest is closed: a page needs few, and for a short time.
        if (unauthenticated_.size() >= limits_.unauthenticated) unauthenticated_.front()->close();
        std::make_shared<Connection>(*this, std::move(socket))->read();
        accept();
    });
}

int ViewServer::listen(int port)
{
    try {
        asio::io_context none;
        Tcp::acceptor acceptor(none);
        const Tcp::endpoint here(asio::ip::address_v4::loopback(), static_cast<std::uint16_t>(port));
        acceptor.open(here.protocol());
        close_on_exec(acceptor.native_handle());
        acceptor.set_option(asio::socket_base::reuse_address(true));
        acceptor.bind(here);
        acceptor.listen();
        return acceptor.release();
    } catch (const std::exception& error) {
        throw Error(fmt::format("--port {}: {}", port, error.what()));
    }
}

std::vector<std::filesystem::path> ViewServer::files(const std::filesystem::path& folder)
{
    return {folder, three_file()};
}

ViewServer::ViewServer(int socket, const std::filesystem::path& folder, Handler handler)
    : impl_(std::make_unique<Impl>(socket, folder, std::move(handler)))
{
}

ViewServer::~ViewServer() = default;

std::string ViewServer::address() const { return impl_->address(); }
std::string ViewServer::address_to_open() const { return impl_->address_to_open(); }
void ViewServer::post(std::function<void()> f) { asio::post(impl_->work(), std::move(f)); }
void ViewServer::repeat(int milliseconds, std::function<void()> f) { impl_->repeat(milliseconds, std::move(f)); }
void ViewServer::run() { impl_->run(); }

}  // namespace rapid
