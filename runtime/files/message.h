// Messages between processes in shared memory: values and arrays, one after another.
//
// The receiver does not trust a message, because the other process may have failed before it ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace rapid {

class MessageWriter {
public:
    explicit MessageWriter(std::span<unsigned char> memory) : memory_(memory) {}

    template <class T>
    void put(const T& value)
    {
        put_array(std::span<const T>(&value, 1));
    }
    // Writes only the values. The receiver must know how many there are.
    template <class T>
    void put_array(std::span<const T> values)
    {
        static_assert(std::is_trivially_copyable_v<T> || std::is_standard_layout_v<T>);
        put_bytes(values.data(), values.size_bytes());
    }
    void put_text(const std::string& text);

    std::size_t bytes() const { return at_; }

private:
    void put_bytes(const void* from, std::size_t bytes);

    std::span<unsigned char> memory_;
    std::size_t at_ = 0;
};

class MessageReader {
public:
    explicit MessageReader(std::span<const unsigned char> memory) : memory_(memory) {}

    template <class T>
    T take()
    {
        T value;
        take_array(std::span<T>(&value, 1));
        return value;
    }
    template <class T>
    void take_array(std::span<T> values)
    {
        std::memcpy(static_cast<void*>(values.data()), take_bytes(values.size(), sizeof(T)), values.size_bytes());
    }
    // Reads `count` values into a vector. Checks first that the message has that many.
    template <class T>
    std::vector<T> take_vector(std::size_t count)
    {
        const unsigned char* from = take_bytes(count, sizeof(T));
        std::vector<T> values(count);
        if (count > 0) std::memcpy(static_cast<void*>(values.data()), from, count * sizeof(T));
        return values;
    }
    std::string take_text();
    // Returns all bytes that have not been read yet.
    std::span<const unsigned char> left() const { return memory_.subspan(at_); }
    // Throws Error if fewer than `count` values of this size are left.
    void check_left(std::size_t count, std::size_t bytes) const;

private:
    const unsigned char* take_bytes(std::size_t count, std::size_t bytes);

    std::span<const unsigned char> memory_;
    std::size_t at_ = 0;
};

}  // namespace rapid
