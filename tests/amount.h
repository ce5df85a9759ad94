// The number of random cases of a test (tests/amount.lua is the same for Lua). A test that uses it is tagged [random],
// so that tests/run --thorough runs it again with more cases.
#pragma once

#include <cstdlib>

namespace rapid {

// Returns the environment variable `name`, or `quick` times RAPID_TEST_SCALE.
inline int amount(const char* name, int quick)
{
    if (const char* const text = std::getenv(name)) return std::atoi(text);
    const char* const scale = std::getenv("RAPID_TEST_SCALE");
    return quick * (scale ? std::atoi(scale) : 1);
}

}  // namespace rapid
