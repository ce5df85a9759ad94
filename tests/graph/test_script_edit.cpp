#include "runtime/graph/script_edit.h"

#include <tbb/global_control.h>

#include <functional>
#include <random>

#include "tests/graph/graph_under_test.h"

namespace rapid {
namespace {

using Visit = std::function<void(PointSet& points, std::size_t i)>;

class Edit : public ScriptEdit {
public:
    explicit Edit(Visit visit) : visit_(std::move(visit)) {}

    void* fields() override { return nullptr; }
    void uses(Uses&) const override {}
    void check() const override {}
    void prepare(PointSet& points, const Evaluation&) override { points.v().write(); }
    std::unique_ptr<ScriptPass> begin(PointSet& points, const Evaluation&) override
    {
        return std::make_unique<Pass>(*this, points);
    }
    bool removes_points() const override { return false; }

    int finished = 0;

private:
    class Pass : public ScriptPass {
    public:
        Pass(Edit& edit, PointSet& points) : edit_(edit), points_(points) {}
        std::size_t chunk() const override { return 1000; }
        void visit(std::size_t begin, std::size_t end) override
        {
            for (std::size_t i = begin; i < end; ++i) edit_.visit_(points_, i);
        }
        void finish() override { ++edit_.finished; }

    private:
        Edit& edit_;
        PointSet& points_;
    };

    Visit visit_;
};

// Edits of 20,500 points, together.
struct Together {
    PointSet points;
    std::vector<Edit> edits;

    Together() { points.append(20500); }

    void run()
    {
        const Frame frame{};
        const std::string node = "edit";
        const Location location;
        FrameFigures figures;
        std::vector<std::string> warnings;
        const std::function<void(const std::string&, const PointSet&)> write;
        const Evaluation now{frame, false, node, location, RandomKey(1, node), figures, warnings, write};
        std::vector<ScriptEdit*> all;
        for (Edit& edit : edits) all.push_back(&edit);
        const std::vector<const Evaluation*> told(all.size(), &now);
        edit_together(all, told, points);
    }
};

std::span<Vec3f> velocities(PointSet& points) { return {const_cast<Vec3f*>(points.v().read().data), points.size()}; }

TEST_CASE("each point goes through all edits in their order, and each edit ends once", "[script_edit]")
{
    Together scene;
    for (int k = 0; k < 5; ++k)
        scene.edits.emplace_back([k](PointSet& points, std::size_t i) {
            float& x = velocities(points)[i].x();
            x = 10 * x + static_cast<float>(k + 1);
        });
    scene.run();
    bool all = true;
    for (const Vec3f& v : velocities(scene.points)) all &= v.x() == 12345;
    CHECK(all);
    for (const Edit& edit : scene.edits) CHECK(edit.finished == 1);
}

TEST_CASE("the error of edits that go together is that of the first edit that fails, at its first point",
          "[script_edit][threads]")
{
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(GENERATE(1, 2, 7)));
    std::mt19937 random(3);
    for (int round = 0; round < 50; ++round) {
        // Where each of four edits fails, in no particular order; the last of all does not.
        std::vector<std::vector<std::size_t>> fails(4);
        for (auto& at : fails)
            for (int n = static_cast<int>(random() % 4); n > 0; --n) at.push_back(random() % 20500);
        Together scene;
        std::string first;
        for (std::size_t k = 0; k < fails.size(); ++k) {
            std::sort(fails[k].begin(), fails[k].end());
            if (first.empty() && !fails[k].empty()) first = std::to_string(k) + " at " + std::to_string(fails[k][0]);
            scene.edits.emplace_back([k, &fails](PointSet&, std::size_t i) {
                if (std::binary_search(fails[k].begin(), fails[k].end(), i))
                    throw Error(std::to_string(k) + " at " + std::to_string(i));
            });
        }
        CHECK(test::error_of([&] { scene.run(); }) == first);
        for (const Edit& edit : scene.edits) CHECK(edit.finished == (first.empty() ? 1 : 0));
    }
}

}  // namespace
}  // namespace rapid
