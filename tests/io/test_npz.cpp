#include <cstdlib>

#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

// Runs lines of Python with numpy as np, in the folder. Returns true if they ended without an exception.
bool python(const TemporaryFolder& folder, const std::string& lines)
{
    folder.write("script.py", "import numpy as np\n" + lines);
    const std::string command =
        "cd '" + folder.path().string() + "' && /usr/bin/python3 script.py > out.txt 2> errors.txt";
    const bool good = std::system(command.c_str()) == 0;
    if (!good) UNSCOPED_INFO(file_text(folder / "errors.txt"));
    return good;
}

}  // namespace

TEST_CASE("points come back from .npz with the same bits", "[io][npz]")
{
    const std::size_t size = GENERATE(0, 1, 2, 5000);
    CAPTURE(size);
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = size, .extent = 1e5f});

    write_points(folder / "a.npz", points);

    CHECK(differing_columns(points, read_points(folder / "a.npz")) == "");
}

TEST_CASE("numpy.load reads a .npz: an array of its type and shape for each attribute and group", "[io][npz]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(5000);
    for (std::size_t i = 0; i < points.size(); ++i) {
        points.P().write()[i] = Vec3f(static_cast<float>(i), 0.5f, -1);
        points.id().write()[i] = 3000000000 + static_cast<std::int64_t>(i);
    }
    points.add({"orient", Quatf(1, 0, 0, 0)});
    points.add({"pscale", 0.25f});
    points.add({"kind", std::int32_t{-3}});
    points.add({"name", token_of("leaf")});
    points.column<Token>("name").write()[1] = token_of("Gr\u00fc\u00dfe \U0001f33f");
    points.group("hot").write()[1] = 1;

    write_points(folder / "a.npz", points);

    CHECK(python(folder, R"(
a = np.load("a.npz", allow_pickle=False)
assert sorted(a.files) == ["P", "group_hot", "id", "kind", "name", "orient", "pscale", "v"], a.files
i = np.arange(5000)
def same(name, type, expected):
    x = a[name]
    assert x.dtype == np.dtype(type), (name, x.dtype)
    assert x.shape == expected.shape, (name, x.shape)
    assert (x == expected).all(), name
same("P", "<f4", np.stack([i, 0.5 + 0 * i, -1 + 0 * i], axis=1))
same("v", "<f4", np.zeros((5000, 3)))
same("id", "<i8", 3000000000 + i)
same("orient", "<f4", np.tile([0, 0, 0, 1], (5000, 1)))
same("pscale", "<f4", np.full(5000, 0.25))
same("kind", "<i4", np.full(5000, -3))
same("group_hot", "|b1", i == 1)
)"));
}

TEST_CASE("files of numpy are read: compressed or not, of any type and order; other arrays are skipped", "[io][npz]")
{
    const std::string save = GENERATE("savez", "savez_compressed");
    CAPTURE(save);
    const TemporaryFolder folder;
    REQUIRE(python(
        folder,
        R"(
P = np.asfortranarray(np.arange(12, dtype=">f8").reshape(4, 3))
np.)" + save +
            R"(("a.npz", P=P, id=np.array([4, 3, 2, 1], dtype="u2"), Cd=np.ones((4, 3), "f2") / 2, uv=np.arange(8.0).reshape(4, 2),
    hot=np.array([1, 0, 0, 1], bool), serial=np.full(4, 2**40), fps=24.0, name=np.array(["a", "b", "c", "d"]),
    any=np.array([None, 1, [], ()], dtype=object), m=np.zeros((4, 4, 4)), wide=np.zeros((4, 17)), other=np.zeros(5),
    record=np.zeros(4, dtype=[("x", "f4"), ("y", "i4")]))
)"));

    const PointSet points = read_points(folder / "a.npz");

    REQUIRE(points.size() == 4);
    CHECK_THAT(points.P()[3], close_to(Vec3f(9, 10, 11), 0));
    CHECK(points.id()[0] == 4);
    CHECK_THAT(points.column<Vec3f>("Cd")[2], close_to(Vec3f(0.5f, 0.5f, 0.5f), 0));
    CHECK(points.column<float>("uv1")[1] == 3);
    CHECK(points.column<std::int64_t>("serial")[2] == std::int64_t{1} << 40);
    CHECK(points.group_names() == std::vector<std::string>{"hot"});
    CHECK(points.find_group("hot")->read()[3] == 1);
    CHECK(points.column_names() == std::vector<std::string>{"Cd", "P", "id", "name", "serial", "uv0", "uv1", "v"});
    CHECK(points.column<Token>("name")[2].text() == "c");
}

TEST_CASE("a damaged .npz is an error that says how", "[io][npz]")
{
    const TemporaryFolder folder;
    const auto error = [&](const std::string& text) {
        folder.write("b.npz", text);
        return error_of([&] { read_points(folder / "b.npz"); });
    };
    write_points(folder / "a.npz", random_points({.size = 3}));
    const std::string whole = file_text(folder / "a.npz");
    CHECK_THAT(error("hello"), Catch::EndsWith("b.npz: not a complete zip file: its directory is missing or damaged"));
    CHECK_THAT(error(whole.substr(0, whole.size() - 30)), Catch::EndsWith("its directory is missing or damaged"));

    // Changes a number of P, which the checksum reveals.
    std::string flipped = whole;
    flipped[whole.find("'shape': (3, 3)") + 100] ^= 1;
    CHECK_THAT(error(flipped), Catch::EndsWith("\"P.npy\" is damaged"));

    // Directories that promise more data than exists: for a stored member both sizes, at 20 and 24 of its entry.
    std::string promising = whole;
    const std::size_t entry = whole.find("PK\1\2");
    for (const std::size_t at : {entry + 20, entry + 24}) promising.replace(at, 4, "\xff\xff\xff\x7f");
    CHECK_THAT(error(promising), Catch::EndsWith("is shorter than its directory says; the file is damaged"));

    const auto saved = [&](const std::string& arrays) {
        REQUIRE(python(folder, "np.savez('c.npz', " + arrays + ")\n"));
        return error_of([&] { read_points(folder / "c.npz"); });
    };
    CHECK_THAT(saved("x=np.zeros((3, 3))"), Catch::EndsWith("there is no array P of numbers with the shape (n, 3)"));
    CHECK_THAT(saved("P=np.zeros((3, 2))"), Catch::EndsWith("there is no array P of numbers with the shape (n, 3)"));
    REQUIRE(python(folder, "P = np.array([[1, 2, 3], [-4, 5, 6]])\nnp.savez('i.npz', P=P)\nnp.save('i.npy', P)\n"));
    for (const char* integers : {"i.npz", "i.npy"}) CHECK(read_points(folder / integers).P()[1] == Vec3f(-4, 5, 6));
    CHECK_THAT(saved("P=np.zeros((3, 3), bool)"),
               Catch::EndsWith("there is no array P of numbers with the shape (n, 3)"));
}
