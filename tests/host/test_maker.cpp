// Functions of the frame that return an object do not rebuild it for equal arguments.
#include "bindings/host/maker.h"

#include <cstdlib>
#include <filesystem>

#include "bindings/host/session.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// A graph file in its own folder.
class GraphFile {
public:
    explicit GraphFile(const std::string& text) : path_(folder_.write("scene.lua", text)) {}
    const fs::path& path() const { return path_; }

private:
    test::TemporaryFolder folder_;
    fs::path path_;
};

// Returns the result of the first function among the nodes' arguments at a frame.
ObjectPtr shape_at(const Session& session, double frame)
{
    for (const NodePtr& node : session.graph().nodes)
        for (const auto& [name, value] : node->arguments)
            if (const FrameFunction* function = value.function()) {
                const Value result = function->call({frame, 0, 0});
                REQUIRE(result.get<ObjectPtr>());
                return *result.get<ObjectPtr>();
            }
    FAIL("no function");
    return nullptr;
}

std::string scene(const std::string& shape)
{
    return "local rapid = require \"rapid\"\nlocal mesh = rapid.mesh.sphere { radius = 1 }\n"
           "return rapid.create {} :collide { shape = function(frame) return " +
           shape + " end } :solve {}\n";
}

}  // namespace

TEST_CASE("a function that makes the same shape at each frame makes it once", "[made_before]")
{
    const auto shape = GENERATE(as<std::string>(), "rapid.levelset.from_mesh(mesh, { voxel = 0.2 })",
                                "rapid.levelset.from_mesh(rapid.mesh.box { size = {1, 2, 3} }, { voxel = 0.2 })",
                                "rapid.shape.sphere { radius = math.floor(frame.number / 100) + 1 }");
    const GraphFile file(scene(shape));
    const Session session(file.path(), {});
    const ObjectPtr first = shape_at(session, 1);
    for (int frame = 2; frame < 5; ++frame) CHECK(shape_at(session, frame) == first);
}

TEST_CASE("a function whose input changes makes another shape, and only then", "[made_before]")
{
    const GraphFile file(scene("rapid.shape.sphere { radius = math.floor(frame.number / 3) + 1 }"));
    const Session session(file.path(), {});
    const ObjectPtr at1 = shape_at(session, 1), at2 = shape_at(session, 2), at3 = shape_at(session, 3),
                    at4 = shape_at(session, 4);
    CHECK(at1 == at2);
    CHECK(at3 != at2);
    CHECK(at3 == at4);
}

TEST_CASE("a shape that changes at each frame is not kept", "[made_before]")
{
    const GraphFile file(scene("rapid.shape.sphere { radius = frame.number }"));
    const Session session(file.path(), {});
    const std::weak_ptr<const Object> first = shape_at(session, 1);
    for (int frame = 2; frame < 5000; ++frame) shape_at(session, frame);  // Lua collects its handles meanwhile
    CHECK(first.expired());
}

TEST_CASE("values are identical by content, and objects by identity", "[made_before]")
{
    const auto table = [](Value value) {
        auto made = std::make_shared<Table>();
        made->list = {value};
        made->named["a"] = std::move(value);
        return Value(std::shared_ptr<const Table>(made));
    };
    struct Thing : Object {
        std::string_view kind() const override { return "thing"; }
    };
    const ObjectPtr one = std::make_shared<Thing>(), other = std::make_shared<Thing>();
    CHECK(identical(table(1.0), table(1.0)));
    CHECK_FALSE(identical(table(1.0), table(2.0)));
    CHECK_FALSE(identical(table(1.0), table(true)));
    CHECK_FALSE(identical(Value(0.0), Value(-0.0)));
    CHECK(identical(table("x"), table("x")));
    CHECK(identical(Value(Vec3d(1, 2, 3)), Value(Vec3d(1, 2, 3))));
    CHECK_FALSE(identical(Value(Vec3d(1, 2, 3)), Value(Vec3d(1, 2, 4))));
    CHECK(identical(table(one), table(one)));
    CHECK_FALSE(identical(table(one), table(other)));
    CHECK(identical(Value(AttributeRef{"heat"}), Value(AttributeRef{"heat"})));
}

}  // namespace rapid
