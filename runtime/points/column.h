// A typed attribute column: one value for every point of a set.
//
// Copying a column copies a pointer; the first write after a copy clones the values. A value that all points share is
// stored once: `pscale = 0.02` costs four bytes in total instead of four bytes per point.
//
// Layout: shape [size], contiguous; vec3 is packed x y z, as OpenVDB and Houdini hold it. 64-byte aligned until points
// are removed.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/math/vec.h"
#include "runtime/points/buffer.h"

namespace rapid {

// The points that remain after a removal: maximal runs of consecutive points, in order.
struct Compaction {
    struct Run {
        std::size_t begin, size;
    };
    std::vector<Run> runs;
    std::size_t kept = 0;
    std::size_t longest = 0;  // index of the longest run
    std::size_t ahead = 0;    // points in the runs before it

    // Builds the runs from a mask, shape [size]. Points whose mask is 0 are removed.
    static Compaction from_mask(std::span<const std::uint8_t> keep);
};

// Read access without a branch per point on whether the column is uniform. Valid until the column is written or moved.
template <class T>
struct Strided {
    const T* data;
    std::size_t stride;  // 1, or 0 when all points share the one value

    const T& operator[](std::size_t i) const { return data[i * stride]; }
};

template <class T>
class Column {
public:
    // `fallback` is the value of appended points that do not set their own.
    explicit Column(std::size_t size = 0, T shared = zero()) : size_(size), shared_(shared), fallback_(shared) {}
    Column(std::size_t size, T shared, T fallback) : size_(size), shared_(shared), fallback_(fallback) {}
    explicit Column(std::span<const T> values, T fallback = zero()) : size_(0), shared_(fallback), fallback_(fallback)
    {
        append(values);
    }

    static T zero()
    {
        if constexpr (std::is_same_v<T, Vec3f>)
            return Vec3f::Zero();
        else if constexpr (std::is_same_v<T, Quatf>)
            return Quatf::Identity();
        else
            return T{};
    }

    std::size_t size() const { return size_; }
    bool is_uniform() const { return !values_; }
    const T& operator[](std::size_t i) const { return values_ ? data()[i] : shared_; }
    Strided<T> read() const { return values_ ? Strided<T>{data(), 1} : Strided<T>{&shared_, 0}; }

    const T& fallback() const { return fallback_; }
    void set_fallback(const T& value) { fallback_ = value; }

    // Returns the memory of the values. A column shared with another set counts in both.
    std::size_t bytes() const { return values_ ? size_ * sizeof(T) : sizeof(T); }

    // Returns true if both columns use the same memory, or both are uniform.
    bool shares_values_with(const Column& other) const { return values_ == other.values_; }

    // Returns the values for writing, shape [size]. Expands a uniform column and clones a shared one. Call it before a
    // loop instead of inside it, and from one thread: the executor gives a column to one writer at a time.
    std::span<T> write()
    {
        own(size_);
        return {mutable_data(), size_};
    }

    // Like write(), but does not preserve the values: the caller must overwrite all of them.
    std::span<T> overwrite()
    {
        if (!values_ || is_shared()) values_ = std::make_shared<Buffer>(bytes_of(size_));
        return {mutable_data(), size_};
    }

    void fill(const T& value)
    {
        values_.reset();
        shared_ = value;
    }

    // Adds n points with the fallback value. A uniform column of that value stays uniform.
    void append(std::size_t n) { append(n, fallback_); }

    void append(std::size_t n, const T& value)
    {
        if (n == 0) return;
        if (size_ == 0 || (!values_ && same(shared_, value))) {
            fill(value);
            size_ += n;
            return;
        }
        const T copy = value;  // it may refer to a value of this column
        std::span<T> added = append_for_writing(n);
        std::uninitialized_fill(added.begin(), added.end(), copy);
    }

    // Appends values. They must not be this column's own, which move when it grows.
    void append(std::span<const T> values)
    {
        if (values.empty()) return;
        RAPID_ASSERT(!values_ || values.data() + values.size() <= data() || data() + size_ <= values.data());
        std::memcpy(static_cast<void*>(append_for_writing(values.size()).data()), values.data(), values.size_bytes());
    }

    // Adds n points and returns their values, uninitialised.
    std::span<T> append_for_writing(std::size_t n)
    {
        own(size_ + n);
        size_ += n;
        return {mutable_data() + (size_ - n), n};
    }

    // Returns a column of the values at these indices, in this order.
    Column select(std::span<const std::uint32_t> indices) const
    {
        if (!values_) return Column(indices.size(), shared_, fallback_);
        Column result(0, fallback_);
        const T* from = data();
        const std::span<T> to = result.append_for_writing(indices.size());
        for (std::size_t i = 0; i < indices.size(); ++i) to[i] = from[indices[i]];
        return result;
    }

    // Removes all points that are in no run. The others keep their order.
    void keep(const Compaction& compaction)
    {
        if (values_ && is_shared()) {
            auto into = std::make_shared<Buffer>(bytes_of(compaction.kept));
            pack(static_cast<T*>(into->data()), data(), compaction.runs);
            values_ = std::move(into);
        } else if (values_) {
            close_up(compaction);
        }
        size_ = compaction.kept;
    }

private:
    static_assert(std::is_trivially_destructible_v<T>, "values are moved as bytes");

    static bool same(const T& a, const T& b) { return std::memcmp(&a, &b, sizeof(T)) == 0; }

    // Throws std::bad_alloc if the size in bytes would overflow.
    static std::size_t bytes_of(std::size_t size)
    {
        if (size > Buffer::max_bytes / sizeof(T)) throw std::bad_alloc();
        return size * sizeof(T);
    }

    // Returns true if another column uses the same values. The last other owner may have just released them on another
    // thread (a file writer), and its reads must happen before this column writes. use_count() orders nothing, but the
    // decrement of a copy that is made and dropped does.
    bool is_shared() const
    {
        if (values_.use_count() > 1) return true;
        std::shared_ptr<Buffer>(values_).reset();
        return false;
    }

    const T* data() const { return static_cast<const T*>(values_->data()); }
    T* mutable_data() { return values_ ? static_cast<T*>(values_->data()) : nullptr; }

    // Packs the runs contiguously at `to`, which must not lie after the first run.
    static void pack(T* to, const T* from, std::span<const Compaction::Run> runs)
    {
        for (const auto& run : runs) {
            if (to != from + run.begin) std::memmove(static_cast<void*>(to), from + run.begin, run.size * sizeof(T));
            to += run.size;
        }
    }

    // Keeps the longest run in position and closes the others up to it. Mostly the oldest points die, so most of a
    // column is not moved. This leaves room before the first value, at most a quarter of the size of the values.
    void close_up(const Compaction& compaction)
    {
        const std::span runs = compaction.runs;
        T* const from = mutable_data();
        if (runs.empty()) return values_->take_back();
        const Compaction::Run& longest = runs[compaction.longest];
        const std::size_t left = (longest.begin - compaction.ahead) * sizeof(T);
        if (values_->given_up() + left > compaction.kept * sizeof(T) / 4) {
            values_->take_back();
            return pack(mutable_data(), from, runs);
        }
        T* to = from + longest.begin;
        for (std::size_t k = compaction.longest; k-- > 0;) {
            to -= runs[k].size;
            std::memmove(static_cast<void*>(to), from + runs[k].begin, runs[k].size * sizeof(T));
        }
        pack(from + longest.begin + longest.size, from, runs.subspan(compaction.longest + 1));
        values_->give_up(left);
    }

    // Makes the values unshared and expanded, with room for `size` of them.
    void own(std::size_t size)
    {
        if (values_ && !is_shared()) return values_->reserve(bytes_of(size));
        auto owned = std::make_shared<Buffer>(bytes_of(size));
        if (values_)
            std::memcpy(owned->data(), values_->data(), size_ * sizeof(T));
        else
            std::uninitialized_fill_n(static_cast<T*>(owned->data()), size_, shared_);
        values_ = std::move(owned);
    }

    std::size_t size_;
    T shared_;  // every point's value while values_ is null
    T fallback_;
    std::shared_ptr<Buffer> values_;
};

}  // namespace rapid
