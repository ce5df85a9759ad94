// The points on which a node acts: those of its group for which its `where` is true.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "runtime/graph/point_edit.h"
#include "runtime/graph/point_function.h"
#include "runtime/points/column.h"

namespace rapid {

class Selection {
public:
    // Selects the points of `group` (all if empty) for which `where` is true (all if null). `where` is evaluated only
    // for points of the group. The set and `now` must outlive it.
    Selection(const PointSet& points, std::string group, const PointFunction* where, const Evaluation& now,
              const Before& before);

    // The same as in EditPass.
    void begin();
    std::size_t chunk() const { return test_ ? test_->chunk() : chunk_size; }
    bool is_script() const { return test_ != nullptr; }

    // Returns 1 for selected points that are alive, else 0; shape [size].
    std::vector<std::uint8_t> of(const Stretch& stretch) const;

private:
    const PointSet& points_;
    const std::string group_;
    const Before before_;
    std::unique_ptr<PointTest> test_;
    Strided<std::uint8_t> members_{nullptr, 0};
};

}  // namespace rapid
