#include "bindings/command/graph_options.h"

#include <utility>

namespace rapid {

SessionOptions GraphOptions::session() const
{
    SessionOptions session;
    session.set = settings();
    session.script_timeout = options().script_seconds;
    session.script_memory = options().script_memory;
    session.keeps_state = keeps_state_;
    return session;
}

std::unique_ptr<Session> GraphOptions::load(bool may_write, std::function<void(const std::string& message)> on_timeout,
                                            std::function<void(const std::filesystem::path& file)> on_read) const
{
    SessionOptions options = session();
    options.may_write = may_write;
    options.on_timeout = std::move(on_timeout);
    options.on_read = std::move(on_read);
    return std::make_unique<Session>(file(), std::move(options));
}

std::unique_ptr<Session> GraphOptions::load_other(const std::string& file,
                                                  std::function<void(const std::string& message)> on_timeout) const
{
    SessionOptions options = session();
    options.set.clear();
    options.on_timeout = std::move(on_timeout);
    return std::make_unique<Session>(file, std::move(options));
}

std::unique_ptr<Session> GraphOptions::load_again(const KernelOrder& order,
                                                  std::function<void(const std::string& message)> on_timeout) const
{
    SessionOptions options = session();
    options.quiet = true;
    options.kernel_order = order;
    options.on_timeout = std::move(on_timeout);
    return std::make_unique<Session>(file(), std::move(options));
}

}  // namespace rapid
