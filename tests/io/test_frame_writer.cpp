#include "runtime/io/frame_writer.h"
#include "tests/files/other_circumstances.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

// Small pictures, for quick tests.
std::shared_ptr<const PictureOptions> small_picture()
{
    return std::make_shared<PictureOptions>(PictureOptions{.width = 160, .height = 90});
}

std::string four_digits(int frame) { return FramePattern("####").expand(frame); }

std::string pattern(const TemporaryFolder& folder, const std::string& name) { return (folder / name).string(); }

}  // namespace

TEST_CASE("all frames are written to all patterns, with missing folders made", "[io][writer][threads]")
{
    const TemporaryFolder folder;
    FrameWriter writer({{pattern(folder, "new/deep/a.####.ply"), {}},
                        {pattern(folder, "new/{output}.####.csv"), std::vector<std::string>{"age"}}});
    for (int frame = 1; frame <= 10; ++frame)
        writer.submit(
            random_points({.size = 100, .seed = static_cast<unsigned>(frame), .wide = false, .strings = false}),
            {.number = frame}, "sparks");
    writer.finish();

    CHECK(file_names(folder / "new/deep").size() == 10);
    for (int frame = 1; frame <= 10; ++frame) {
        const PointSet expected =
            random_points({.size = 100, .seed = static_cast<unsigned>(frame), .wide = false, .strings = false});
        const std::string number = four_digits(frame);
        CHECK(differing_columns(expected, read_points(folder / ("new/deep/a." + number + ".ply"))) == "");
        CHECK(read_points(folder / ("new/sparks." + number + ".csv")).column_names() ==
              std::vector<std::string>{"P", "age", "id", "v"});
    }
    const std::vector<FrameWriter::Written> written = writer.take_written();
    CHECK(written.size() == 20);
    CHECK(written[0].bytes == std::filesystem::file_size(folder / "new/deep/a.0001.ply"));
    for (std::size_t k = 0; k < written.size(); ++k) {
        CHECK(written[k].frame == static_cast<int>(k / 2) + 1);
        CHECK(written[k].seconds > 0);
    }
    CHECK(writer.take_written().empty());
}

TEST_CASE("a writer knows the first frame of which a file is still to come", "[io][writer]")
{
    const TemporaryFolder folder;
    FrameWriter writer({{pattern(folder, "a.##.png"), {}}, {pattern(folder, "a.##.csv"), {}}});
    CHECK(writer.first_unwritten() == std::nullopt);
    // Pictures without points wait for the first that has some.
    for (int frame = 5; frame <= 6; ++frame) writer.submit(PointSet(), {.number = frame, .picture = small_picture()});
    CHECK(writer.first_unwritten() == 5);
    writer.submit(random_points({.size = 50}), {.number = 7, .picture = small_picture()});
    writer.finish();
    CHECK(writer.first_unwritten() == std::nullopt);
    CHECK(writer.take_written().size() == 6);
}

TEST_CASE("pictures of an empty scene wait for points a hundred frames, and no longer", "[io][writer]")
{
    const TemporaryFolder folder;
    FrameWriter writer({{pattern(folder, "a.####.png"), {}}});
    const auto shapes = std::make_shared<const PictureScene>();
    for (int frame = 1; frame <= 250; ++frame)
        writer.submit(PointSet(), {.number = frame, .picture = small_picture(), .scene = shapes});
    // At most three submitted pictures are not yet among the writer's pictures, of which fewer than 100 wait.
    CHECK(shapes.use_count() < 1 + 100 + 3 + 2);
    CHECK(writer.take_written().size() >= 200 - 100);
    writer.finish();
    CHECK(file_names(folder.path()).size() == 250);
    CHECK(shapes.use_count() == 1);
}

TEST_CASE("what changes in a point set after it was submitted is not in the file", "[io][writer][threads]")
{
    const TemporaryFolder folder;
    PointSet points = random_points({.size = 20000, .wide = false, .strings = false});
    const PointSet before = points;
    FrameWriter writer({{pattern(folder, "a.##.ply"), {}}});
    writer.submit(points, {.number = 1});
    for (Vec3f& P : points.P().write()) P = Vec3f(9, 9, 9);
    points.keep(std::vector<std::uint8_t>(20000, 0));
    writer.finish();

    CHECK(differing_columns(before, read_points(folder / "a.01.ply")) == "");
}

TEST_CASE("a full disk is an error that names the file, earlier frames stay, nothing unfinished does", "[io][writer]")
{
    const auto place = GENERATE(range(std::size_t{0}, formats().size()));
    const std::string extension = formats()[place].extension;
    const SmallDisk disk;
    if (formats()[place].film || !disk.mounted()) return;  // mounting is not allowed, so nothing can be filled
    CAPTURE(extension);
    const std::string name = "a.####" + extension;
    const PointSet points = random_points({.size = 4000, .wide = false, .strings = false});

    FrameWriter writer({{pattern(disk.folder(), name), {}}});
    const std::string error = error_of([&] {
        for (int frame = 1; frame <= 40; ++frame) writer.submit(points, {.number = frame});
        writer.finish();
    });

    const std::vector<std::string> names = file_names(disk.folder().path());
    REQUIRE(!names.empty());
    const int complete = static_cast<int>(names.size());
    CHECK(error == pattern(disk.folder(), "a." + four_digits(complete + 1) + extension) +
                       ": can't be written: No space left on device");
    for (int frame = 1; frame <= complete; ++frame)
        CHECK(names[static_cast<std::size_t>(frame - 1)] == "a." + four_digits(frame) + extension);
    if (formats()[place].read) CHECK(read_points(disk.folder() / names.back()).size() == 4000);
    // The same error again: a caller that continued would otherwise lose frames unnoticed.
    CHECK(error_of([&] { writer.submit(points, {.number = 41}); }) == error);
}

TEST_CASE("a read-only folder, a folder that is a file and a file that is a folder are errors that say so",
          "[io][writer]")
{
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 2, .wide = false});
    const auto error = [&](const std::string& name) { return error_of([&] { write_points(folder / name, points); }); };
    std::ofstream(folder / "file") << "x";
    CHECK_THAT(error("file/a.ply"), Catch::StartsWith(pattern(folder, "file/a.ply") + ": can't make the folder") &&
                                        Catch::EndsWith("Not a directory"));
    std::filesystem::create_directories(folder / "b.ply");
    CHECK(error("b.ply") == pattern(folder, "b.ply") + ": can't be written: it is not a regular file");

    std::filesystem::create_directories(folder / "locked");
    std::filesystem::permissions(folder / "locked",
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec |
                                     std::filesystem::perms::others_read | std::filesystem::perms::others_exec);
    std::filesystem::permissions(folder.path(), std::filesystem::perms::all);
    const Unprivileged someone;
    CHECK(error("locked/a.ply") == pattern(folder, "locked/a.ply") + ": can't be written: Permission denied");
}

TEST_CASE("pictures before the first points wait, and share the view of the first frame that has some", "[io][writer]")
{
    const TemporaryFolder folder;
    FrameWriter writer({{pattern(folder, "a.##.png"), {}}, {pattern(folder, "a.##.csv"), {}}});
    writer.submit(PointSet(), {.number = 1, .picture = small_picture()});
    writer.submit(PointSet(), {.number = 2, .time = 1.0 / 24, .picture = small_picture()});
    PointSet far_away = random_points({.size = 50});
    for (Vec3f& P : far_away.P().write()) P += Vec3f(1000, 0, 0);
    writer.submit(far_away, {.number = 3, .time = 2.0 / 24, .picture = small_picture()});
    writer.finish();

    CHECK(file_names(folder.path()).size() == 6);
    // Frame 2 shows the same ground lines as a picture without points with the third frame's view.
    PictureFit fit;
    const PictureView view = fit.next(far_away, {.number = 3, .time = 2.0 / 24, .picture = small_picture()});
    write_points(folder / "expected.png", PointSet(),
                 {.number = 2, .picture = small_picture(), .view = std::make_shared<PictureView>(view)});
    CHECK((file_text(folder / "a.02.png") == file_text(folder / "expected.png")));
}

TEST_CASE("pictures of a sequence without any points are written in the end", "[io][writer]")
{
    const TemporaryFolder folder;
    FrameWriter writer({{pattern(folder, "a.##.png"), {}}});
    writer.submit(PointSet(), {.number = 1, .picture = small_picture()});
    writer.submit(PointSet(), {.number = 2, .picture = small_picture()});
    writer.finish();
    CHECK(file_names(folder.path()) == std::vector<std::string>{"a.01.png", "a.02.png"});
}

TEST_CASE("an unknown extension is refused with the known ones, before anything runs", "[io][writer]")
{
    std::string known;
    for (const Format& format : formats()) known += (known.empty() ? "" : ", ") + format.extension;
    CHECK_THAT(known, Catch::Contains(".bgeo, ") && Catch::Contains(".csv, ") && Catch::Contains(".webm"));
    CHECK(error_of([] {
              FrameWriter(std::vector<OutputTarget>{{"a.####.abc", {}}});
          }) == "a.####.abc: unknown extension \".abc\"; it must be one of " + known);
    CHECK(error_of([] { format_of("a"); }) == "a: the name has no extension; it must be one of " + known);
    CHECK(format_of("A.VDB").extension == ".vdb");
    CHECK(error_of([] { read_points("a.png"); }) == "a.png: points can't be read from a .png file");
    CHECK(error_of([] { read_points("/nowhere/a.vdb"); }) ==
          "/nowhere/a.vdb: can't be read: No such file or directory");
}

TEST_CASE("a writer that is dropped writes no half frame and leaves nothing hidden", "[io][writer][threads]")
{
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 50000});
    {
        FrameWriter writer({{pattern(folder, "a.##.vdb"), {}}});
        for (int frame = 1; frame <= 3; ++frame) writer.submit(points, {.number = frame});
    }
    const std::vector<std::string> names = file_names(folder.path());
    for (const std::string& name : names) {
        CHECK(name[0] == 'a');
        CHECK(read_points(folder / name).size() == 50000);
    }
}

using namespace rapid;
using namespace rapid::test;

TEST_CASE("selected attributes are P, v, id and the named ones, groups too", "[io][selected]")
{
    const PointSet points = random_points({.size = 5});

    const PointSet selected = select_attributes(points, {"age", "hot"});

    CHECK(selected.column_names() == std::vector<std::string>{"P", "age", "id", "v"});
    CHECK(selected.group_names() == std::vector<std::string>{"hot"});
    CHECK(error_of([&] { select_attributes(points, {"agee"}); }) ==
          "there is no attribute or group \"agee\" to write; did you mean \"age\"?");
}
