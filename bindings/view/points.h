// Reads columns of a frame for requests: of all points, or of some.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "include/rapid/scene.h"

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

}  // namespace rapid
