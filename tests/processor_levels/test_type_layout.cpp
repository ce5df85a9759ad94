
#include <array>
#include <cstdint>
#include <vector>

#include "runtime/processor_levels/shared_types.h"
#include "tests/test.h"

namespace rapid {

TEST_CASE("code for a level and the rest of the library agree on the types that they share", "[levels]")
{
    CHECK(layout_difference(shared_types_of_level(), shared_types) == "");
}

TEST_CASE("tables of types that differ name the first difference", "[levels]")
{
    const std::array cold = {TypeLayout{"Slot", 1024, 64}, TypeLayout{"Pack", 576, 64}};
    auto hot = cold;

    hot[1].alignment = 16;
    CHECK(layout_difference(hot, cold) == "Pack of 576 bytes aligned to 16, and Pack of 576 aligned to 64");

    hot[0].size = 512;
    CHECK(layout_difference(hot, cold) == "Slot of 512 bytes aligned to 64, and Slot of 1024 aligned to 64");

    CHECK(layout_difference(std::span(cold).first(1), cold) == "they share 1 and 2 types");
}

TEST_CASE("a vector of packs lies where code for the widest registers takes it to be", "[levels]")
{
    // Blocks of other sizes lie elsewhere. All of them are held, or one place would serve each.
    std::vector<std::vector<LaneRunner::Slot>> slots;
    std::vector<std::vector<Vectors<Floats>>> vectors;
    for (std::size_t n = 1; n < 40; ++n) {
        slots.emplace_back(n);
        vectors.emplace_back(n);
        CAPTURE(n);
        CHECK(reinterpret_cast<std::uintptr_t>(slots.back().data()) % sizeof(Doubles) == 0);
        CHECK(reinterpret_cast<std::uintptr_t>(vectors.back().data()) % sizeof(Floats) == 0);
    }
}

}  // namespace rapid
