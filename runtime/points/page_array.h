// An array in a block of pages (buffer.h) whose values are not initialised. For large, short-lived arrays that are
// written before they are read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

#include "runtime/points/buffer.h"

namespace rapid {

template <class T>
class PageArray {
public:
    static_assert(std::is_trivially_destructible_v<T>, "values are moved as bytes");

    PageArray() = default;
    explicit PageArray(std::size_t size) { resize(size); }
    PageArray(const PageArray& other) : PageArray(other.size_) { std::copy(other.begin(), other.end(), begin()); }
    PageArray(PageArray&& other) noexcept : buffer_(std::move(other.buffer_)), size_(std::exchange(other.size_, 0)) {}
    PageArray& operator=(PageArray other) noexcept
    {
        buffer_ = std::move(other.buffer_);
        size_ = other.size_;
        return *this;
    }

    // Resizes the array. New values are indeterminate. Throws std::bad_alloc.
    void resize(std::size_t size)
    {
        if (size > Buffer::max_bytes / sizeof(T)) throw std::bad_alloc();
        buffer_.reserve(size * sizeof(T));
        size_ = size;
    }

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    T* data() { return static_cast<T*>(buffer_.data()); }
    const T* data() const { return static_cast<const T*>(buffer_.data()); }
    T& operator[](std::size_t i) { return data()[i]; }
    const T& operator[](std::size_t i) const { return data()[i]; }
    T* begin() { return data(); }
    T* end() { return data() + size_; }
    const T* begin() const { return data(); }
    const T* end() const { return data() + size_; }

private:
    Buffer buffer_;
    std::size_t size_ = 0;
};

}  // namespace rapid
