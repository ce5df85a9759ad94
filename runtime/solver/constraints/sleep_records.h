// The conditions under which sleeping points fell asleep, stored between frames.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/solver/constraints/shape_grip.h"
#include "runtime/vec.h"

namespace rapid {

struct SleepRecords {
    struct Record {
        std::int64_t id;
        Vec3f P;              // m
        double inverse_mass;  // 1/kg
        Vec3f acceleration;   // m/s²
        ShapeGrip grip;       // of the shapes that it touches
        float load;           // N, the total pressure of other points
    };
    std::vector<Record> records;
};

}  // namespace rapid
