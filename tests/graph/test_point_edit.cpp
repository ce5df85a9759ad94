#include "runtime/graph/point_edit.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <functional>
#include <new>
#include <random>
#include <stdexcept>

#include "tests/graph/graph_under_test.h"

namespace rapid {
namespace {

// Edits a point; returns true to remove it.
using Visit = std::function<bool(PointSet& points, std::size_t i)>;

class Edit : public PointEdit {
public:
    explicit Edit(Visit visit, bool removes = false) : visit_(std::move(visit)), removes_(removes) {}

    void* fields() override { return nullptr; }
    void uses(Uses&) const override {}
    void check() const override {}
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const override
    {
        points.v().write();
        received = before;
        return std::make_unique<Pass>(*this, points, now);
    }
    bool removes_points() const override { return removes_; }
    bool reads_indices() const override { return false; }

    mutable Before received;
    mutable int begun = 0;

private:
    class Pass : public EditPass {
    public:
        Pass(const Edit& edit, PointSet& points, const Evaluation& of) : EditPass(of), edit_(edit), points_(points) {}
        void begin() override { ++edit_.begun; }
        std::size_t chunk() const override { return 1000; }
        void visit(const Stretch& stretch) override
        {
            for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
                std::uint8_t* alive = stretch.alive ? stretch.alive + (i - stretch.begin) : nullptr;
                if ((!alive || *alive) && edit_.visit_(points_, i)) *alive = 0;
            }
        }

    private:
        const Edit& edit_;
        PointSet& points_;
    };

    Visit visit_;
    bool removes_;
};

// Edits of 20,500 points, fused.
struct Together {
    PointSet points;
    std::vector<Edit> edits;
    FrameFigures figures;

    Together()
    {
        points.append(20500);
        std::int64_t id = 0;
        for (std::int64_t& i : points.id().write()) i = id++;
    }

    void run()
    {
        const Frame frame{};
        std::vector<std::string> warnings;
        const std::function<void(const std::string&, const PointSet&)> write;
        std::vector<std::string> names;
        std::vector<Location> locations;
        for (std::size_t k = 0; k < edits.size(); ++k) {
            names.push_back("edit" + std::to_string(k));
            locations.push_back({"scene.lua", static_cast<int>(k) + 1});
        }
        std::vector<Evaluation> now;
        std::vector<const Evaluation*> received;
        std::vector<PointEdit*> all;
        for (std::size_t k = 0; k < edits.size(); ++k)
            now.push_back({frame, false, names[k], locations[k], RandomKey(1, names[k]), figures, warnings, write});
        for (std::size_t k = 0; k < edits.size(); ++k) received.push_back(&now[k]), all.push_back(&edits[k]);
        edit_together(all, received, points);
    }
};

std::span<Vec3f> velocities(PointSet& points) { return {const_cast<Vec3f*>(points.v().read().data), points.size()}; }

Visit append_digit(int k)
{
    return [k](PointSet& points, std::size_t i) {
        float& x = velocities(points)[i].x();
        x = 10 * x + static_cast<float>(k);
        return false;
    };
}

TEST_CASE("each point goes through all edits in their order, and each edit begins once", "[point_edit]")
{
    Together scene;
    for (int k = 1; k <= 5; ++k) scene.edits.emplace_back(append_digit(k));
    scene.run();
    bool all = true;
    for (const Vec3f& v : velocities(scene.points)) all &= v.x() == 12345;
    CHECK(all);
    for (const Edit& edit : scene.edits) CHECK(edit.begun == 1);
}

TEST_CASE("a point that an edit removes is gone for those that follow, and in the end", "[point_edit]")
{
    Together scene;
    const auto every = [](std::int64_t n) {
        return [n](PointSet& points, std::size_t i) { return points.id()[i] % n == 0; };
    };
    scene.edits.emplace_back(append_digit(1));
    scene.edits.emplace_back(every(2), true);
    scene.edits.emplace_back(append_digit(2));
    scene.edits.emplace_back(every(3), true);
    scene.edits.emplace_back([](PointSet& points, std::size_t i) {
        if (points.id()[i] % 2 == 0 || points.id()[i] % 3 == 0) throw Error("asked about a point that is gone");
        return false;
    });
    scene.run();
    REQUIRE(scene.points.size() == 6833);  // those below 20,500 that are coprime to 6
    bool all = true;
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
        const std::int64_t id = scene.points.id()[i];
        all &= id == static_cast<std::int64_t>(3 * i + 1 + i % 2) && velocities(scene.points)[i].x() == 12;
    }
    CHECK(all);
    CHECK(scene.figures.died == 20500 - 6833);
}

TEST_CASE("an edit knows whether others come before it, and whether they remove points", "[point_edit]")
{
    Together scene;
    const Visit nothing = [](PointSet&, std::size_t) { return false; };
    for (const bool removes : {false, true, false}) scene.edits.emplace_back(nothing, removes);
    scene.run();
    std::vector<std::pair<bool, bool>> received;
    for (const Edit& edit : scene.edits) received.emplace_back(edit.received.edits, edit.received.removals);
    CHECK(received == std::vector<std::pair<bool, bool>>{{false, false}, {true, false}, {true, true}});
}

TEST_CASE("the error of edits that go together is that of the first edit that fails, at its first point",
          "[point_edit][threads]")
{
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(GENERATE(1, 2, 7)));
    std::mt19937 random(3);
    for (int round = 0; round < 50; ++round) {
        // Up to three random indices at which each of four edits fails.
        std::vector<std::vector<std::size_t>> fails(4);
        for (auto& at : fails)
            for (int n = static_cast<int>(random() % 4); n > 0; --n) at.push_back(random() % 20500);
        Together scene;
        std::string first;
        for (std::size_t k = 0; k < fails.size(); ++k) {
            std::sort(fails[k].begin(), fails[k].end());
            if (first.empty() && !fails[k].empty())
                first = "scene.lua:" + std::to_string(k + 1) + ": node \"edit" + std::to_string(k) + "\": at " +
                        std::to_string(fails[k][0]);
            scene.edits.emplace_back([k, &fails](PointSet&, std::size_t i) {
                if (std::binary_search(fails[k].begin(), fails[k].end(), i)) throw Error("at " + std::to_string(i));
                return false;
            });
        }
        CHECK(test::error_of([&] { scene.run(); }) == first);
    }
}

TEST_CASE("a fault of a library in one of the edits names that edit", "[point_edit]")
{
    const bool memory = GENERATE(false, true);
    Together scene;
    scene.edits.emplace_back([](PointSet&, std::size_t) { return false; });
    scene.edits.emplace_back([=](PointSet&, std::size_t i) -> bool {
        if (i == 10000 && memory) throw std::bad_alloc();
        if (i == 10000) throw std::runtime_error("a fault");
        return false;
    });
    CHECK(test::error_of([&] { scene.run(); }) ==
          std::string("scene.lua:2: node \"edit1\": ") + (memory ? "out of memory" : "a fault"));
}

}  // namespace
}  // namespace rapid
