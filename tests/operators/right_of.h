// A `where` for tests, and points to evaluate it on.
#pragma once

#include "runtime/graph/point_function.h"
#include "tests/operators/node_test.h"

namespace rapid::test {

// True for points whose P.x is above a limit. Fails if evaluated for a point at x = 100.
class RightOf : public PointFunction {
public:
    explicit RightOf(float limit) : limit_(limit) {}
    void uses(Uses& uses) const override { uses.reads.push_back("P"); }
    bool reads_indices() const override { return false; }
    std::optional<std::vector<ObjectPtr>> objects() const override { return std::vector<ObjectPtr>(); }
    std::unique_ptr<PointTest> test_of(const PointSet& points, const Evaluation&) const override
    {
        return std::make_unique<Test>(points, limit_);
    }

private:
    class Test : public PointTest {
    public:
        Test(const PointSet& points, float limit) : points_(points), limit_(limit) {}
        void begin(bool) override {}
        void test(std::size_t begin, std::span<std::uint8_t> selected) const override
        {
            for (std::size_t i = 0; i < selected.size(); ++i) {
                if (!selected[i]) continue;
                const float x = points_.P()[begin + i].x();
                if (x == 100) throw Error("asked about a point outside the group");
                selected[i] = x > limit_;
            }
        }

    private:
        const PointSet& points_;
        const float limit_;
    };

    float limit_;
};

inline Value right_of(float limit) { return ObjectPtr(std::make_shared<RightOf>(limit)); }

// Returns points at x = 0, 1, 2.
inline PointSet three_points() { return points_at({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}); }

}  // namespace rapid::test
