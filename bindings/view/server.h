// The viewer's server: the files of the page by HTTP, and requests by WebSocket, on this machine alone.
//
// Closed: it listens on the loopback device; a request needs the token of the address that the command prints (the page
// keeps it as a cookie), a Host of this machine and, where it has one, that host as its Origin. Names of files in
// requests are looked up among those of the page; none is opened by what a request says. A page that asks for more than
// is answered waits, and one that is closed leaves nothing behind.
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
    // Called from a thread of its own with each message of a page, one after another.
    using Handler = std::function<void(const std::string& message, Answer answer)>;

    // A socket of the loopback device that listens, as a descriptor. port 0: a free one. Error: the port is taken.
    static int listen(int port);
    // The files that it serves: the page's, and three.js. Error: there is no three.js.
    static std::vector<std::filesystem::path> files(const std::filesystem::path& folder);

    // socket: of listen(). folder: of the page. Error: the page or three.js is missing.
    ViewServer(int socket, const std::filesystem::path& folder, Handler handler);
    ~ViewServer();

    std::string address() const;  // with the token
    // The same with another token, which one request may have: arguments of a browser are no secret on this machine.
    std::string address_to_open() const;
    // Calls f from the handler's thread: soon, or every so many milliseconds.
    void post(std::function<void()> f);
    void repeat(int milliseconds, std::function<void()> f);
    // Serves until the process ends.
    void run();

private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid
