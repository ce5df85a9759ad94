// The viewer's server: the files of the page by HTTP, and requests by WebSocket, on this machine only.
//
// It listens on the loopback device. All requests need a Host of this machine; if they have an Origin, it must name
// that host. The page's own files are served to anybody, since they are the same in all views. Everything else goes
// over the WebSocket, which needs the token of the address that the command prints. The page offers the token as a
// subprotocol instead of a cookie, which a browser would send to every port of this machine.
//
// File names in requests are looked up among those of the page. A page that sends more requests than are answered
// waits, and a closed one leaves nothing behind. The number of connections is limited, and for those without a token
// also the time, so that the simulation always has descriptors.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace rapid {

// Answers a request once, from any thread.
using Answer = std::function<void(std::string message, bool binary)>;

class ViewServer {
public:
    // Called from its own thread with each message of a page, one after another.
    using Handler = std::function<void(const std::string& message, Answer answer)>;

    // Returns a listening socket of the loopback device, as a descriptor. port 0: a free one. Throws Error if the port
    // is taken.
    static int listen(int port);
    // Returns the files that it serves: the page's, and three.js. Throws Error if three.js is missing.
    static std::vector<std::filesystem::path> files(const std::filesystem::path& folder);

    // socket: from listen(). folder: of the page. Throws Error if the page or three.js is missing.
    ViewServer(int socket, const std::filesystem::path& folder, Handler handler);
    ~ViewServer();

    std::string address() const;  // with the token
    // Returns the address with another token, which opens one socket: a browser's arguments are no secret on this
    // machine. The page gets the lasting token through that socket.
    std::string address_to_open() const;
    // Calls f on the handler's thread: soon, or at this interval.
    void post(std::function<void()> f);
    void repeat(int milliseconds, std::function<void()> f);
    // Serves until the process ends.
    void run();

private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid
