// Writes states and reads them back: bit-identical, with shared columns, and without trust in the data.
#include "runtime/points/saved_state.h"

#include "runtime/points/state_archive.h"
#include "tests/test.h"

namespace rapid {
namespace {

// A clock with one member of each kind that a state can have.
struct Clock {
    struct Tick {
        std::int64_t id = 0;
        Vec3f P = Vec3f::Zero();
        bool held = false;

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(id, P, held);
        }
    };

    double due = 0;
    std::vector<Tick> ticks;
    std::vector<Vec3d> places;
    std::vector<std::array<std::uint32_t, 2>> pairs;
    std::map<std::string, float> by_name;
    std::set<std::array<std::int64_t, 2>> parted;
    std::optional<Quatf> turn;
    PointSet points;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(due, ticks, places, pairs, by_name, parted, turn, points);
    }
};

Clock some_clock()
{
    Clock clock;
    clock.due = 0.1;
    clock.ticks = {{3, {1, 2, 3}, true}, {4, {-0.0f, 5, 6}, false}};
    clock.places = {Vec3d(1, 2, 3), Vec3d(4, 5, 6)};
    clock.pairs = {{1, 2}, {3, 4}, {5, 6}};
    clock.by_name = {{"a", 1.5f}, {"b", -2}};
    clock.parted = {{1, 2}, {1, 3}};
    clock.turn = Quatf(0.5f, 0.5f, 0.5f, 0.5f);
    test::Points points({{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
    points.set<float>("heat", {1, 2, 3}).group("hot", {0, 2});
    points.add({"pscale", 0.25f});
    points.details["total"] = Vec3d(1, 2, 3);
    clock.points = points;
    return clock;
}

struct TwoSets {
    PointSet a, b;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(a, b);
    }
};

}  // namespace

TEST_CASE("a state that is read back is the one that was written", "[state]")
{
    const Clock clock = some_clock();
    const SavedState state = state_of(clock);
    Clock read;
    restore(read, state);

    CHECK(state_of(read) == state);
    CHECK(read.due == clock.due);
    REQUIRE(read.ticks.size() == 2);
    CHECK(read.ticks[1].P == clock.ticks[1].P);
    CHECK(read.ticks[0].held);
    CHECK(read.places == clock.places);
    CHECK(read.pairs == clock.pairs);
    CHECK(read.by_name == clock.by_name);
    CHECK(read.parted == clock.parted);
    CHECK(read.turn->coeffs() == clock.turn->coeffs());
    REQUIRE(read.points.size() == 3);
    CHECK(test::same_bits(read.points.P(), clock.points.P()));
    CHECK(read.points.column<float>("heat")[2] == 3);
    CHECK(read.points.column<float>("pscale").is_uniform());
    CHECK(read.points.column<float>("pscale").fallback() == 0.25f);
    CHECK((*read.points.find_group("hot"))[2] == 1);
    CHECK(std::get<Vec3d>(read.points.details.at("total")) == Vec3d(1, 2, 3));
}

TEST_CASE("a state differs where a bit of what is kept does", "[state]")
{
    const SavedState state = state_of(some_clock());
    Clock other = some_clock();
    other.ticks[1].P.x() = 0;  // was -0
    CHECK(!(state_of(other) == state));
    other = some_clock();
    other.points.P().write()[1].y() = std::nextafter(5.0f, 6.0f);
    CHECK(!(state_of(other) == state));
}

TEST_CASE("a state shares columns until they are written", "[state]")
{
    Clock clock = some_clock();
    const SavedState state = state_of(clock);
    CHECK(state.bytes.size() < 800);
    REQUIRE(std::holds_alternative<Column<Vec3f>>(state.columns.front()));
    CHECK(std::get<Column<Vec3f>>(state.columns.front()).shares_values_with(clock.points.P()));

    const Vec3f before = std::as_const(clock.points).P()[0];
    clock.points.P().write()[0] = Vec3f(9, 9, 9);
    Clock read;
    restore(read, state);
    CHECK(std::as_const(read.points).P()[0] == before);
}

TEST_CASE("columns of one memory are kept once, and are one memory again", "[state]")
{
    TwoSets two;
    two.a = two.b = some_clock().points;
    two.b.P().write()[0] = Vec3f(7, 7, 7);
    const SavedState state = state_of(two);
    TwoSets read;
    restore(read, state);
    CHECK(read.a.id().shares_values_with(read.b.id()));
    CHECK(!std::as_const(read.a).P().shares_values_with(std::as_const(read.b).P()));
    CHECK(state.columns.size() == 5);  // P, id, heat, hot and the other P; v and pscale are uniform
}

TEST_CASE("a state within a state is read back", "[state]")
{
    const std::map<std::string, SavedState> states = {{"one", state_of(some_clock())}, {"two", {}}};
    std::map<std::string, SavedState> read;
    restore(read, state_of(states));
    CHECK(read == states);
}

TEST_CASE("a state that is too short, too long or has too many elements is refused", "[state]")
{
    const SavedState state = state_of(some_clock());
    for (std::size_t size = 0; size < state.bytes.size(); ++size) {
        SavedState torn = state;
        torn.bytes.resize(size);
        Clock read;
        CHECK_THROWS_AS(restore(read, torn), Error);
    }
    SavedState longer = state;
    longer.bytes.push_back(0);
    Clock read;
    CHECK_THROWS_AS(restore(read, longer), Error);

    std::vector<std::int32_t> list;
    SavedState many = state_of(std::uint64_t{1} << 60);
    CHECK_THROWS_AS(restore(list, many), Error);

    SavedState without_columns = state;
    without_columns.columns.clear();
    CHECK_THROWS_AS(restore(read, without_columns), Error);
}

}  // namespace rapid
