// The sizes of pictures at their limits.
#include "runtime/picture/frame_picture.h"

#include "tests/test.h"

namespace rapid {
namespace {

TEST_CASE("a picture has from 1 to 16384 pixels a side", "[picture]")
{
    constexpr int least = 1, most = 16384;
    for (const int width : {least, most})
        for (const int height : {least, most}) CHECK_NOTHROW(require_picture_size(width, height));

    for (const int wrong : {-most, least - 1, most + 1, 2 * most})
        for (const int right : {least, most}) {
            CAPTURE(wrong, right);
            const auto limits = Catch::Matchers::Contains("each side must be from 1 to 16384 pixels");
            CHECK_THROWS_WITH(require_picture_size(wrong, right), limits);
            CHECK_THROWS_WITH(require_picture_size(right, wrong), limits);
        }
}

}  // namespace
}  // namespace rapid
