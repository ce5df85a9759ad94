#include "bindings/command_line/signals.h"

#include <utility>

namespace rapid {
namespace {

bool is_ignored(int signal)
{
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    return action.sa_handler == SIG_IGN;
}

}  // namespace

sigset_t ending_signals()
{
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT})
        if (!is_ignored(signal)) sigaddset(&set, signal);
    return set;
}

SignalThread::SignalThread(std::function<void(int signal)> end)
{
    sigset_t ours = ending_signals();
    sigaddset(&ours, SIGUSR1);  // for the destructor
    pthread_sigmask(SIG_BLOCK, &ours, nullptr);
    thread_ = std::thread([this, ours, end = std::move(end)] {
        while (!stopping_) {
            int signal = 0;
            if (sigwait(&ours, &signal) == 0 && signal != SIGUSR1) end(signal);
        }
    });
}

SignalThread::~SignalThread()
{
    stopping_ = true;
    pthread_kill(thread_.native_handle(), SIGUSR1);
    thread_.join();
}

}  // namespace rapid
