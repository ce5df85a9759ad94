#include "runtime/io/merge_parts.h"

#include <rapidcheck.h>

#include <algorithm>
#include <fstream>

#include "runtime/io/format.h"
#include "runtime/points/subset.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

namespace rapid {
namespace {

PointSet part_of(const PointSet& whole, int number, int count)
{
    const Subset subset(number, count);
    std::vector<std::uint8_t> kept(whole.size());
    for (std::size_t i = 0; i < whole.size(); ++i) kept[i] = subset.has(whole.id()[i]);
    PointSet part = whole;
    part.keep(kept);
    return part;
}

std::vector<PointSet> parts_of(const PointSet& whole, int count)
{
    std::vector<PointSet> parts;
    for (int k = 1; k <= count; ++k) parts.push_back(part_of(whole, k, count));
    return parts;
}

std::vector<std::string> names_of_parts(int count)
{
    std::vector<std::string> names;
    for (int k = 1; k <= count; ++k) names.push_back("part" + std::to_string(k));
    return names;
}

std::string bytes_of(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

TEST_CASE("the merged parts of a set are bit-identical to the set, for any size and gaps of ids", "[merge_parts]")
{
    CHECK(rc::check([] {
        test::RandomPoints options;
        options.size = static_cast<std::size_t>(*rc::gen::inRange(0, 3000));
        options.seed = *rc::gen::arbitrary<unsigned>();
        options.first_id = *rc::gen::inRange<std::int64_t>(0, 1LL << 40);
        PointSet whole = test::random_points(options);
        // A few gaps of any width.
        std::int64_t shift = 0;
        for (std::int64_t& id : whole.id().write()) {
            if (*rc::gen::inRange(0, 100) == 0) shift += *rc::gen::inRange(1, 1 << 30);
            id += shift;
        }
        const int count = *rc::gen::inRange(1, 20);
        const PointSet merged = merge_parts(parts_of(whole, count), names_of_parts(count));
        RC_ASSERT(test::differing_columns(whole, merged).empty());
    }));
}

TEST_CASE("parts that were written and read again make the file of the whole, byte for byte", "[merge_parts]")
{
    std::vector<std::string> extensions;
    for (const Format& format : formats())
        if (format.read && !format.positions_only) extensions.push_back(format.extension);
    REQUIRE(extensions.size() >= 8);
    const std::string extension = GENERATE_COPY(from_range(extensions));
    const int count = GENERATE(2, 3, 16);
    const std::size_t size = GENERATE(std::size_t{0}, std::size_t{5}, std::size_t{40000});
    CAPTURE(extension, count, size);
    const test::TemporaryFolder folder;
    const PointSet whole = test::random_points({.size = size, .seed = 7, .wide = extension == ".vdb"});
    const FrameInfo frame{.number = 12, .time = 0.5};
    const auto file = [&](const std::string& name) { return folder.path() / (name + extension); };
    write_points(file("whole"), whole, frame);

    std::vector<PointSet> parts;
    std::vector<std::string> names;
    for (const PointSet& part : parts_of(whole, count)) {
        names.push_back(file("part" + std::to_string(parts.size())).string());
        write_points(names.back(), part, frame);
        parts.push_back(read_points(names.back()));
    }
    write_points(file("merged"), merge_parts(parts, names), frame);
    CHECK(bytes_of(file("merged")) == bytes_of(file("whole")));
}

TEST_CASE("parts that do not belong together are refused, with their names", "[merge_parts]")
{
    const PointSet whole = test::random_points({.size = 100});
    std::vector<PointSet> parts = parts_of(whole, 3);
    const auto refused_with = [&](const std::string& text) {
        const std::string message = test::error_of([&] { merge_parts(parts, names_of_parts(3)); });
        CAPTURE(message);
        CHECK(message.find(text) != std::string::npos);
    };
    SECTION("a part in place of another")
    {
        std::swap(parts[0], parts[2]);
        refused_with("is not of part 1 of 3, but of part 3");
    }
    SECTION("a part of other points")
    {
        parts[1].id().write()[0] += 1;
        while (Subset::part_of(parts[1].id()[0], 3) == 1) parts[1].id().write()[0] += 1;
        refused_with("part2");
    }
    SECTION("an attribute that one lacks")
    {
        parts[2].remove("Cd");
        refused_with("part3");
    }
    SECTION("an attribute of another type")
    {
        parts[2].remove("age");
        parts[2].add({"age", Vec3f(0, 0, 0)});
        refused_with("age is vec3, but float in part1");
    }
    SECTION("points in another order")
    {
        std::span<std::int64_t> ids = parts[0].id().write();
        std::reverse(ids.begin(), ids.end());
        refused_with("in order of id");
    }
}

}  // namespace
}  // namespace rapid
