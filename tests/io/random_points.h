// Point sets of every kind for the tests of formats: all types, uniform and varying columns, groups, ids with gaps.
#pragma once

#include <bit>
#include <random>
#include <string>

#include "runtime/points/point_set.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid::test {

struct RandomPoints {
    std::size_t size = 0;
    unsigned seed = 1;
    float extent = 2;  // m
    std::int64_t first_id = 0;
    bool wide = true;     // an int64 attribute beside id
    bool strings = true;  // string attributes
};

inline PointSet random_points(const RandomPoints& options)
{
    std::mt19937 random(options.seed);
    std::uniform_real_distribution<float> place(-options.extent, options.extent), unit(-1, 1);
    const auto vec = [&](auto& distribution) {
        const float x = distribution(random), y = distribution(random), z = distribution(random);
        return Vec3f(x, y, z);
    };
    PointSet points;
    points.append(options.size);
    points.add({"pscale", 0.02f});  // uniform
    points.add({"Cd", Vec3f(1, 0.5f, 0.25f)});
    points.add({"age", 0.0f});
    points.add({"N", Vec3f(0, 1, 0)});
    points.add({"hitnum", std::int32_t{0}});
    points.add({"orient", Quatf::Identity()});
    if (options.wide) points.add({"serial", std::int64_t{0}});
    std::int64_t id = options.first_id;
    for (std::size_t i = 0; i < options.size; ++i) {
        points.P().write()[i] = vec(place);
        points.v().write()[i] = vec(unit);
        points.id().write()[i] = id;
        id += 1 + static_cast<std::int64_t>(random() % 3);
        points.column<float>("age").write()[i] = unit(random) * 1e-3f;
        points.column<Vec3f>("N").write()[i] = vec(unit).normalized();
        points.column<std::int32_t>("hitnum").write()[i] = static_cast<std::int32_t>(random());
        points.column<Quatf>("orient").write()[i] = Quatf(unit(random), unit(random), unit(random), unit(random));
        if (options.wide)
            points.column<std::int64_t>("serial").write()[i] = static_cast<std::int64_t>(random()) << 24 | 1;
    }
    points.group("all").fill(1);
    std::span<std::uint8_t> hot = points.group("hot").write();
    for (std::uint8_t& member : hot) member = random() % 5 == 0;
    points.group("nobody");
    if (options.strings) {
        points.add({"material", token_of("bark")});  // uniform
        points.add({"name", Token()});
        const std::string_view strings[] = {
            "", "leaf", "a \"quoted\", comma", "two\nlines", "C:\\tmp", "Gr\u00fc\u00dfe \U0001f33f", "7"};
        for (Token& text : points.column<Token>("name").write())
            text = token_of(strings[random() % std::size(strings)]);
        if (options.size > 0) points.column<Token>("name").write()[0] = token_of("leaf");
    }
    return points;
}

// Returns the names of columns that are missing in one of two sets or not bitwise equal.
inline std::string differing_columns(const PointSet& a, const PointSet& b)
{
    std::string different;
    if (a.size() != b.size()) different += "size ";
    for (const PointSet* set : {&a, &b})
        for (const std::string& name : set->column_names()) {
            const AnyColumn *x = a.find(name), *y = b.find(name);
            const bool same = x && y && x->index() == y->index() &&
                              std::visit(
                                  [&](const auto& c) {
                                      using C = std::decay_t<decltype(c)>;
                                      return same_bits(c, std::get<C>(*y));
                                  },
                                  *x);
            if (!same) different += name + " ";
        }
    for (const PointSet* set : {&a, &b})
        for (const std::string& name : set->group_names()) {
            const Column<std::uint8_t>*x = a.find_group(name), *y = b.find_group(name);
            if (!x || !y || !same_bits(*x, *y)) different += "group:" + name + " ";
        }
    return different;
}

}  // namespace rapid::test
