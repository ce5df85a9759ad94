// Encodes frames and shapes as binary messages for the page: positions with 16 bits per coordinate within the frame's
// bounds, colours with 8, values with 16. A message is the number of its request, the length of a header in JSON, that
// header, and the arrays that it names, each aligned to four bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"
#include "runtime/base/json.h"

namespace rapid {

// Prefix of a group among the page's attributes.
inline const std::string group_mark = "group:";

// Indices of some points in the columns.
using Indices = std::vector<std::uint32_t>;

// The values of a column, packed: a view into the frame if it has them in this form. T: type of a component. indices:
// null for all points.
template <class T>
class PointValues {
public:
    PointValues(const SceneColumn& column, const Indices* indices)
        : size_(indices ? indices->size() : column.count),
          components_(column.components),
          step_(column.stride == 0 ? 0 : components_),
          data_(static_cast<const T*>(column.data))
    {
        if (is_one() || (!indices && column.stride == components_ * sizeof(T))) return;
        own_ = std::make_shared<std::vector<T>>(size_ * components_);
        switch (components_) {
            case 1:
                gather<1>(column, indices);
                break;
            case 3:
                gather<3>(column, indices);
                break;
            default:
                gather<0>(column, indices);
        }
        data_ = own_->data();
    }

    std::size_t size() const { return size_; }
    // Returns true if all points share one value, which is stored once.
    bool is_one() const { return step_ == 0; }
    // Returns the components of point k.
    const T* operator[](std::size_t k) const { return data_ + k * step_; }

private:
    // count: number of components; 0: as many as the column has.
    template <std::size_t count>
    void gather(const SceneColumn& column, const Indices* indices)
    {
        const std::size_t n = count > 0 ? count : components_;
        T* to = own_->data();
        for (std::size_t k = 0; k < size_; ++k, to += n) {
            const T* value = column.at<T>(indices ? (*indices)[k] : k);
            for (std::size_t c = 0; c < n; ++c) to[c] = value[c];
        }
    }

    std::size_t size_, components_, step_;
    std::shared_ptr<std::vector<T>> own_;
    const T* data_;
};

// Returns a column of this type, or nothing if there is none.
inline std::optional<SceneColumn> find_column(const SceneFrame& points, std::string_view name, ColumnType type)
{
    const Result<SceneColumn> column = points.column(name);
    if (!column || column->type != type) return std::nullopt;
    return *column;
}

struct FrameOptions {
    std::string colour;          // an attribute, "speed", "group:NAME"; empty: Cd, else speed
    std::string group;           // shows its points; empty: all
    bool velocities = false;     // for streaks
    std::size_t most = 2000000;  // points; if there are more, those whose id is a multiple of a power of two
};

// Indices of the points that are shown, or nothing if all are. Throws Error if the group does not exist.
struct ShownPoints {
    std::optional<Indices> indices;
    std::size_t count = 0;
    std::uint64_t every = 1;  // ids are multiples of it

    std::size_t operator[](std::size_t k) const { return indices ? (*indices)[k] : k; }
    const Indices* all_or_some() const { return indices ? &*indices : nullptr; }
};
ShownPoints shown_points(const SceneFrame& points, const FrameOptions& frame_options);

// head: members of the header, an object. Throws Error if the attribute or group does not exist.
std::string frame_message(std::uint32_t request, const SceneFrame& points, const FrameOptions& frame_options,
                          CheckedJson head);

// Returns the shapes of a frame: planes, and meshes by number, without those that the page has. head: as above.
std::string shapes_message(std::uint32_t request, const SceneShapes& shapes, const std::set<std::uint64_t>& known,
                           const std::vector<std::uint64_t>& numbers, CheckedJson head);

// ends: ends of line segments, with x y z and their age from 0 to 1; every: as in ShownPoints.
std::string trails_message(std::uint32_t request, const std::vector<float>& ends, std::uint64_t every);

// Returns a value for each point at `indices` (null: all points): an attribute as a number (the length of a vector),
// "speed", or membership of "group:NAME". Throws Error if the attribute or group does not exist.
std::vector<float> numbers_of(const SceneFrame& points, const std::string& name, const Indices* indices = nullptr);

}  // namespace rapid
