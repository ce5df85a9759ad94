// Errors of the file system, and a descriptor that closes itself.
//
// Errors contain the system's reason but not the file's name, because a file that is being written is named only when
// complete. The caller adds the name (Error::at).
#pragma once

#include <string>
#include <utility>

#include "runtime/base/error.h"

namespace rapid {

// Returns an error such as `can't be written: No space left on device`.
Error file_error(const std::string& what, int system_error);

class Descriptor {
public:
    explicit Descriptor(int number = -1) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept
    {
        std::swap(number_, other.number_);
        return *this;
    }
    ~Descriptor();

    explicit operator bool() const { return number_ >= 0; }
    int number() const { return number_; }

private:
    int number_;
};

}  // namespace rapid
