// A value that each thread has of its own and keeps until it ends, such as a function's buffer:
//
//   thread_local OfThread<std::vector<double>> kept;
//   std::vector<double>& phi = *kept;
//
// For values with a destructor. A thread_local std::vector does the same, but glibc takes memory for its destructor
// when a thread first comes there, and ends the process where there is none; here that is a std::bad_alloc.
#pragma once

#include <memory>
#include <utility>

namespace rapid {

// What a thread destroys when it ends.
struct KeptByThread {
    KeptByThread() = default;
    KeptByThread(const KeptByThread&) = delete;
    KeptByThread& operator=(const KeptByThread&) = delete;
    virtual ~KeptByThread() = default;

    std::unique_ptr<KeptByThread> earlier;  // destroyed behind this one
};

// Keeps it until the calling thread ends; until the process does, where that is the first one.
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
