#include "bindings/host/interruption.h"

#include <fmt/format.h>
#include <ucontext.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <lua.hpp>
#include <utility>

#include "runtime/base/setting_names.h"

namespace rapid {
namespace {

// Ignored by default, so that a late signal does no harm.
constexpr int our_signal = SIGURG;

thread_local Interruption::Call* innermost = nullptr;

struct sigaction handler_before = {};

// Code that a jump may leave: code that LuaJIT compiled, and LuaJIT. Read before the first signal requests a jump.
struct CodeRanges {
    struct Range {
        std::uintptr_t begin, end;
    };
    std::array<Range, 1024> ranges;
    std::atomic<std::size_t> size = 0;

    bool contains(std::uintptr_t address) const
    {
        const std::size_t count = size.load(std::memory_order_acquire);
        for (std::size_t i = 0; i < count; ++i)
            if (ranges[i].begin <= address && address < ranges[i].end) return true;
        return false;
    }

    void read()
    {
        std::size_t count = 0;
        std::ifstream maps("/proc/self/maps");
        for (std::string line; std::getline(maps, line) && count < ranges.size();) {
            Range range{};
            char access[5] = {};
            int name = 0;
            if (std::sscanf(line.c_str(), "%" SCNxPTR "-%" SCNxPTR " %4s %*s %*s %*s %n", &range.begin, &range.end,
                            access, &name) != 3 ||
                access[2] != 'x')
                continue;
            const std::string file = line.substr(std::min<std::size_t>(name, line.size()));
            if (file.empty() || file.find("/libluajit") != std::string::npos) ranges[count++] = range;
        }
        size.store(count, std::memory_order_release);
    }
};

CodeRanges& code_ranges()
{
    static CodeRanges ranges;
    return ranges;
}
std::mutex code_ranges_mutex;  // guards rereading the ranges

}  // namespace

Interruption::~Interruption()
{
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    stopping_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void Interruption::request(const Error& why)
{
    const std::lock_guard lock(mutex_);
    if (is_requested() || stop_) return;
    why_ = why;
    is_requested_ = true;
    thread_ = std::thread([this] { signal_until_over(); });
}

void Interruption::check() const
{
    if (is_requested()) throw Error(why_);
}

Interruption::Slot::Slot(Interruption& owner) : owner_(owner)
{
    const std::lock_guard lock(owner_.mutex_);
    owner_.slots_.insert(this);
}

Interruption::Slot::~Slot()
{
    const std::lock_guard lock(owner_.mutex_);
    owner_.slots_.erase(this);
}

// The call is counted before the check for an interruption. signal_until_over() does the reverse, so that one of them
// always sees the other.
Interruption::Call::Call(Slot& slot, lua_State* L) : slot_(slot), lua_(L), outer_(innermost)
{
    if (slot_.calls_.load() == 0) slot_.thread_ = pthread_self();
    slot_.calls_.fetch_add(1);
    innermost = this;
    if (!slot_.owner_.is_requested()) return;
    end();
    slot_.owner_.check();
}

Interruption::Call::~Call() { end(); }

// The lock is needed because a signal may be sent only to a running thread, and this one may end.
void Interruption::Call::end()
{
    innermost = outer_;
    slot_.calls_.fetch_sub(1);
    if (slot_.owner_.is_requested()) const std::lock_guard lock(slot_.owner_.mutex_);
}

void Interruption::Call::after_jump() const
{
    sigset_t ours;
    sigemptyset(&ours);
    sigaddset(&ours, our_signal);
    pthread_sigmask(SIG_UNBLOCK, &ours, nullptr);
}

void Interruption::Call::try_to_leave(const Slot& slot)
{
    if (innermost && innermost->natives_.load(std::memory_order_relaxed) == 0) leave(slot);
}

void Interruption::Call::leave(const Slot& slot)
{
    if (innermost && &innermost->slot_ == &slot) siglongjmp(innermost->jump_target, 1);
}

Interruption::InNative::InNative() : call_(innermost)
{
    if (call_) call_->natives_.fetch_add(1, std::memory_order_relaxed);
}

Interruption::InNative::~InNative()
{
    if (call_) call_->natives_.fetch_sub(1, std::memory_order_relaxed);
}

void Interruption::install_handler()
{
    static const bool installed = [] {
        struct sigaction action {};
        action.sa_sigaction = on_signal;
        action.sa_flags = SA_SIGINFO | SA_RESTART | SA_ONSTACK;
        sigemptyset(&action.sa_mask);
        return sigaction(our_signal, &action, &handler_before) == 0;
    }();
    static_cast<void>(installed);
}

void Interruption::on_signal(int signal, siginfo_t* info, void* context)
{
    Call* const call = innermost;
    if (!call || !call->slot_.owner_.is_requested()) {
        if (handler_before.sa_flags & SA_SIGINFO)
            handler_before.sa_sigaction(signal, info, context);
        else if (handler_before.sa_handler != SIG_DFL && handler_before.sa_handler != SIG_IGN)
            handler_before.sa_handler(signal);
        return;
    }
    lua_sethook(call->lua_, stop, LUA_MASKCOUNT, 1);
    if (!call->slot_.owner_.jumps_ || call->natives_.load(std::memory_order_relaxed) > 0) return;
    const auto address = static_cast<const ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP];
    if (code_ranges().contains(static_cast<std::uintptr_t>(address))) siglongjmp(call->jump_target, 1);
}

// The hook stays set, so that code that catches the error is stopped, too.
void Interruption::stop(lua_State* L, lua_Debug*)
{
    if (innermost) luaL_error(L, "%s", innermost->slot_.owner_.why_.message().c_str());
}

void Interruption::signal_until_over()
{
    constexpr auto pause = std::chrono::milliseconds(5);
    constexpr int passes_without_jump = 20;
    install_handler();
    std::unique_lock lock(mutex_);
    for (int pass = 0; !stop_ && is_any_running(); ++pass) {
        if (pass >= passes_without_jump) {
            const std::lock_guard reading(code_ranges_mutex);
            code_ranges().read();
            jumps_ = true;
        }
        for (const Slot* slot : slots_)
            if (slot->calls_ > 0) pthread_kill(slot->thread_, our_signal);
        stopping_.wait_for(lock, pause);
    }
}

bool Interruption::is_any_running() const
{
    return std::any_of(slots_.begin(), slots_.end(), [](const Slot* slot) { return slot->calls_ > 0; });
}

namespace {

// Returns the duration, capped at the clock's range, which exceeds any run.
std::chrono::steady_clock::duration duration_of(double seconds)
{
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(std::min(seconds, 1e7)));
}

}  // namespace

Watchdog::Watchdog(double limit, OnTimeout on_timeout)
    : limit_(limit), on_timeout_(std::move(on_timeout)), thread_([this] { watch(); })
{
}

Watchdog::~Watchdog()
{
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

// The watchdog need not be woken: it always sleeps for less than a section may take.
Watchdog::Section::Section(Watchdog& watchdog, std::string what) : watchdog_(watchdog)
{
    const std::lock_guard lock(watchdog.mutex_);
    const auto now = std::chrono::steady_clock::now();
    const auto limit = duration_of(watchdog.limit_);
    const auto others = now + limit * static_cast<int>(watchdog.running_.size());
    watchdog.deadline_ = std::clamp(watchdog.deadline_, now, others) + limit;
    watchdog.running_.push_back(std::move(what));
}

Watchdog::Section::~Section()
{
    const std::lock_guard lock(watchdog_.mutex_);
    watchdog_.running_.pop_back();  // sections end in reverse order; it does not matter whose name is removed
}

// The thread wakes up often. If it wakes much later than intended, the process was suspended (SIGSTOP, a sleeping
// machine), and no script ran in the meantime.
void Watchdog::watch()
{
    const auto step = std::min<std::chrono::steady_clock::duration>(std::chrono::seconds(1), duration_of(limit_ / 4));
    std::unique_lock lock(mutex_);
    while (!stop_) {
        const auto now = std::chrono::steady_clock::now();
        if (running_.empty() || now < deadline_) {
            const auto then = running_.empty() ? now + step : std::min(deadline_, now + step);
            wake_.wait_until(lock, then);
            if (const auto overslept = std::chrono::steady_clock::now() - then; overslept > step)
                deadline_ += overslept;
            continue;
        }
        const std::string message = fmt::format("{}: the script ran for more than {:g} s; {} sets the limit",
                                                fmt::join(running_, ", "), limit_, name_of(Setting::ScriptSeconds));
        if (on_timeout_(message) == EndProcess) {
            std::fprintf(stderr, "%s\n", message.c_str());
            std::_Exit(1);
        }
        deadline_ = now + duration_of(limit_);
    }
}

}  // namespace rapid
