// How many random cases a test tries (tests/amount.lua has the same for tests in Lua). A test that asks is tagged
// [random], so that tests/run --thorough runs it again with more of them.
#pragma once

#include <cstdlib>

namespace rapid {

// The value of the environment variable `name`, or `quick` times RAPID_TEST_SCALE.
inline int amount(const char* name, int quick)
{
    if (const char* const text = std::getenv(name)) return std::atoi(text);
    const char* const scale = std::getenv("RAPID_TEST_SCALE");
    return quick * (scale ? std::atoi(scale) : 1);
}

}  // namespace rapid
