#include "runtime/files/base64.h"

#include <string>

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;

namespace {

std::string text_of(const std::vector<unsigned char>& bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace

TEST_CASE("the vectors of RFC 4648 are read", "[base64]")
{
    const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                           {"Zg==", "f"},
                                                           {"Zm8=", "fo"},
                                                           {"Zm9v", "foo"},
                                                           {"Zm9vYg==", "foob"},
                                                           {"Zm9vYmE=", "fooba"},
                                                           {"Zm9vYmFy", "foobar"}};
    for (const auto& [text, bytes] : vectors) CHECK(text_of(from_base64(text)) == bytes);

    std::size_t length = 0;
    CHECK(text_of(from_base64("Zm9vYmFyZm9v", 4, length)) == "foob");
    CHECK(length == 8);
}

TEST_CASE("invalid base64 is an error", "[base64]")
{
    std::size_t length = 0;
    CHECK(test::error_of([&] { from_base64("Zm9v", 4, length); }) == "the array ends early");
    CHECK(test::error_of([&] { from_base64("Zm9*"); }) == "the array is not valid base64");
    CHECK(test::error_of([&] { from_base64("Z=9v"); }) == "the array is not valid base64");
}
