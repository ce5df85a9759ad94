// A per-thread value that is kept until the thread ends, such as a function's buffer:
//
//   thread_local PerThread<std::vector<double>> kept;
//   std::vector<double>& phi = *kept;
//
// For values with a destructor. A thread_local std::vector does the same, but glibc allocates memory for its destructor
// when a thread first uses it, and terminates the process if that fails. Here that is a std::bad_alloc.
#pragma once

#include <memory>
#include <utility>

namespace rapid {

// An object that is destroyed when its thread ends.
struct ThreadObject {
    ThreadObject() = default;
    ThreadObject(const ThreadObject&) = delete;
    ThreadObject& operator=(const ThreadObject&) = delete;
    virtual ~ThreadObject() = default;

    std::unique_ptr<ThreadObject> earlier;  // destroyed after this one
};

// Keeps an object until the calling thread ends. On the main thread, until the process ends.
void keep_until_thread_ends(std::unique_ptr<ThreadObject> object);

template <class Value>
class PerThread {
public:
    Value& operator*()
    {
        if (!value_) make();
        return *value_;
    }

private:
    struct Owned final : ThreadObject {
        explicit Owned(PerThread& per_thread) : owner(per_thread) {}
        ~Owned() override { owner.value_ = nullptr; }

        PerThread& owner;
        Value value{};
    };

    void make()
    {
        auto object = std::make_unique<Owned>(*this);
        Value* const value = &object->value;
        keep_until_thread_ends(std::move(object));
        value_ = value;
    }

    Value* value_ = nullptr;
};

}  // namespace rapid
