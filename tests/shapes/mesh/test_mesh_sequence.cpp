#include "runtime/shapes/mesh/mesh_sequence.h"

#include <fmt/format.h>

#include <filesystem>

#include "runtime/base/error.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Contains;
using rapid::test::close_to;

namespace {

struct SequenceFolder : test::TemporaryFolder {
    // Writes a tetrahedron with its apex at this height.
    void tetrahedron(int frame, double apex) const
    {
        file(frame, fmt::format("v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 {} 0\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n", apex));
    }
    void file(int frame, const std::string& text) const { write(fmt::format("body.{:04}.obj", frame), text); }
    MeshSequence sequence(int first, int last) const
    {
        std::map<int, std::filesystem::path> files;
        for (int frame = first; frame <= last; ++frame)
            if (const auto name = *this / fmt::format("body.{:04}.obj", frame); std::filesystem::exists(name))
                files[frame] = name;
        return {files, "body.####.obj"};
    }
};

double apex(const Mesh& mesh) { return mesh.bounds().max().y(); }

}  // namespace

TEST_CASE("a sequence has each frame's vertices, and holds its first and last file outside", "[mesh]")
{
    const SequenceFolder folder;
    for (int frame = 3; frame <= 6; ++frame) folder.tetrahedron(frame, frame);
    const MeshSequence sequence = folder.sequence(1, 9);
    CHECK(sequence.first() == 3);
    CHECK(sequence.last() == 6);
    for (const int frame : {5, 3, 6, 4, 5}) CHECK(apex(*sequence.at(frame)) == frame);
    CHECK(apex(*sequence.at(-100)) == 3);
    CHECK(apex(*sequence.at(100)) == 6);
    CHECK(sequence.at(4)->positions.size() == 4);
    CHECK(sequence.at(4)->triangles == sequence.rest()->triangles);
}

TEST_CASE("a sequence in memory has the meshes that were appended last, and holds them outside", "[mesh]")
{
    const auto mesh_of = [](int frame) { return make_sphere(frame, 4, Vec3d::Zero()); };
    MeshSequence sequence(mesh_of(1), {{7, mesh_of(7)}});
    for (int frame = 8; frame <= 12; ++frame) sequence.append(frame, mesh_of(frame));
    CHECK(sequence.last() == 12);
    CHECK(sequence.first() <= 9);  // the spline from 11 to 12 and the jumps around it need the meshes from 9 on
    for (const int frame : {9, 10, 11, 12}) CHECK(apex(*sequence.at(frame)) == Approx(frame));
    CHECK(apex(*sequence.at(100)) == Approx(12));
    CHECK(apex(*sequence.at(-100)) == Approx(sequence.first()));
    CHECK(apex(*sequence.rest()) == Approx(1));

    sequence.append(20, mesh_of(20));  // it rested until frame 19
    CHECK(sequence.first() == 19);
    CHECK(apex(*sequence.at(19)) == Approx(12));
    CHECK(apex(*sequence.at(20)) == Approx(20));
}

TEST_CASE("the file of a frame is the one that walking there step by step ends at", "[mesh][sequence]")
{
    using Beyond = FrameSequence::Beyond;
    for (const Beyond how : {Beyond::Hold, Beyond::Repeat, Beyond::Mirror})
        for (const std::int64_t n : {1, 2, 5}) {
            const FrameSequence order{10, 10 + n - 1, how, how, 3};
            // Starts at the first file and steps forwards or backwards, a frame at a time.
            for (const int way : {1, -1}) {
                std::int64_t file = 10, step = way;
                if (how == Beyond::Hold && way < 0) step = 0;
                if (how == Beyond::Mirror && way < 0) step = 1;  // it turns around at the first file
                if (n == 1) step = 0;
                for (std::int64_t frame = 13; std::abs(frame - 13) < 40; frame += way) {
                    CAPTURE(static_cast<int>(how), n, frame);
                    CHECK(order.file_of(frame) == file);
                    std::int64_t next = file + step;
                    if (next < 10 || next > 10 + n - 1) {
                        if (how == Beyond::Hold) step = 0;
                        if (how == Beyond::Mirror) step = -step;
                        next = how == Beyond::Repeat ? (next < 10 ? 10 + n - 1 : 10) : file + step;
                    }
                    file = next;
                }
            }
        }
    const FrameSequence none{10, 12, Beyond::None, Beyond::None, 3};
    CHECK(!none.file_of(12));
    CHECK(none.file_of(13) == 10);
    CHECK(none.file_of(15) == 12);
    CHECK(!none.file_of(16));
}

TEST_CASE("only the files that are needed are read, and the last few are kept", "[mesh]")
{
    const SequenceFolder folder;
    for (int frame = 1; frame <= 20; ++frame) folder.tetrahedron(frame, frame);
    folder.file(15, "nothing that is a mesh");
    const MeshSequence sequence = folder.sequence(1, 20);
    const MeshPtr first = sequence.at(2);
    for (int frame = 3; frame <= 8; ++frame) sequence.at(frame);
    std::filesystem::remove(folder / "body.0002.obj");
    CHECK(sequence.at(2) == first);
    CHECK_THAT(test::error_of([&] { sequence.at(15); }), Contains("frame 15"));
}

TEST_CASE("a sequence whose topology changes is refused, with the frame and both counts", "[mesh]")
{
    const SequenceFolder folder;
    for (int frame = 1; frame <= 3; ++frame) folder.tetrahedron(frame, 1);
    folder.file(2, "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
    folder.file(3, "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 3 2\nf 1 3 4\nf 1 4 2\nf 2 4 3\n");
    const MeshSequence sequence = folder.sequence(1, 3);
    CHECK_THAT(
        test::error_of([&] { sequence.at(2); }),
        Contains("changes at frame 2: it has 6 corners and 2 faces there and 12 corners and 4 faces at frame 1"));
    // Corners in another order keep their vertices.
    CHECK_THAT(test::error_of([&] { sequence.at(3); }), Contains("at frame 3"));
}

TEST_CASE("a sequence without a file, or with a gap, says which frame is missing", "[mesh]")
{
    const SequenceFolder folder;
    CHECK_THAT(test::error_of([&] { folder.sequence(1, 3); }), Contains("there is no mesh file \"body.####.obj\""));
    folder.tetrahedron(1, 1);
    folder.tetrahedron(3, 1);
    CHECK_THAT(test::error_of([&] { folder.sequence(1, 3); }),
               Contains("frame 2 of \"body.####.obj\" is missing; each frame from 1 to 3 needs a file"));
}
