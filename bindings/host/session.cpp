#include "bindings/host/session.h"

#include <utility>

#include "bindings/host/script_host.h"

namespace rapid {

Session::Session(const std::filesystem::path& file, SessionOptions options)
    : host_(std::make_unique<ScriptHost>(file, std::move(options)))
{
}

Session::~Session() = default;

const Graph& Session::graph() const { return host_->graph; }
const Registry& Session::registry() const { return host_->registry; }
const std::vector<Session::Parameter>& Session::parameters() const { return host_->parameters; }
const std::map<std::string, std::vector<Session::FunctionCode>>& Session::code() const { return host_->code; }
std::vector<std::string> Session::take_warnings() { return std::exchange(host_->warnings, {}); }

void Session::use_from_this_thread() { host_->use_from_this_thread(); }
void Session::interrupt(const Error& why) { host_->interruption.request(why); }
bool Session::is_interrupted() const { return host_->interruption.is_requested(); }

Registry Session::all_node_types()
{
    ScriptHost host({}, SessionOptions{});
    host.load_shipped_nodes();
    return host.registry;
}

}  // namespace rapid
