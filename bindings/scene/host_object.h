// Converts a program's objects and nodes into those of the runtime.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "include/rapid/offers.h"
#include "runtime/base/error.h"
#include "runtime/base/object.h"
#include "runtime/graph/node_type.h"

namespace rapid {

// guarded: callbacks write into our arrays, which end with a pattern that shows writes past the end. Throws Error if an
// array is missing or wrong.
ObjectPtr make_object(const std::string& name, const HostObject& offered, bool guarded);
NodeType make_type(const HostNode& node, bool guarded);

// Converts the kinds of objects that a program offers. Throws Error if an array is missing or wrong.
ObjectPtr make_shape(const std::string& name, const HostShape& shape, bool guarded);
// name: under which the program offers it.
ObjectPtr make_mesh(const HostMesh& mesh, const std::string& name);
ObjectPtr make_points(const HostPoints& points);

// The array that a callback of the program writes. With a guard it is longer than the callback knows, and the part
// after its end must stay unchanged.
template <class T>
class GuardedArray {
public:
    GuardedArray(std::size_t size, bool guarded, T fill = T())
        : values_(size + (guarded ? guard : 0), fill), size_(size)
    {
        std::fill(values_.begin() + static_cast<std::ptrdiff_t>(size), values_.end(), pattern);
    }

    T* data() { return values_.data(); }
    const T& operator[](std::size_t i) const { return values_[i]; }

    // Throws Error if a value is not finite, or if one was written past the end. who: "the program's shape "floor": the
    // distance".
    void check(const std::string& who, std::size_t components) const
    {
        for (std::size_t i = size_; i < values_.size(); ++i)
            if (values_[i] != pattern)
                throw Error(fmt::format("{} was written beyond the end of its array, at point {} of {}", who,
                                        i / components, size_ / components));
        for (std::size_t i = 0; i < size_; ++i)
            if (!std::isfinite(static_cast<double>(values_[i])))
                throw Error(fmt::format("{} is {} at index {}; it must be finite", who, static_cast<double>(values_[i]),
                                        i / components));
    }

private:
    static constexpr std::size_t guard = 64;
    static constexpr T pattern = static_cast<T>(113);

    std::vector<T> values_;
    std::size_t size_;
};

}  // namespace rapid
