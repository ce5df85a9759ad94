// A per-thread value that is kept until the thread ends, such as a function's buffer:
//
//   thread_local OfThread<std::vector<double>> kept;
//   std::vector<double>& phi = *kept;
//
// For values with a destructor. A thread_local std::vector does the same, but glibc allocates memory for its destructor
// when a thread first uses it, and terminates the process if that fails. Here that is a std::bad_alloc.
#pragma once

#include <memory>
#include <utility>

namespace rapid {

// An object that is destroyed when its thread ends.
struct KeptByThread {
    KeptByThread() = default;
    KeptByThread(const KeptByThread&) = delete;
    KeptByThread& operator=(const KeptByThread&) = delete;
    virtual ~KeptByThread() = default;

    std::unique_ptr<KeptByThread> earlier;  // destroyed after this one
};

// Keeps an object until the calling thread ends. On the main thread, until the process ends.
void keep_by_thread(std::unique_ptr<KeptByThread> kept);

template <class Value>
class OfThread {
public:
    Value& operator*()
    {
        if (!value_) make();
        return *value_;
    }

private:
    struct Kept final : KeptByThread {
        explicit Kept(OfThread& of_thread) : owner(of_thread) {}
        ~Kept() override { owner.value_ = nullptr; }

        OfThread& owner;
        Value value{};
    };

    void make()
    {
        auto kept = std::make_unique<Kept>(*this);
        Value* const value = &kept->value;
        keep_by_thread(std::move(kept));
        value_ = value;
    }

    Value* value_ = nullptr;
};

}  // namespace rapid
