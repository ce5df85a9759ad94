#include "runtime/lanes/kernel_random.h"

#include <bit>

#include "runtime/math/items.h"

namespace rapid {

RandomKey key_in_frame(RandomKey key, double frame)
{
    const auto mixed = uniform4(key, std::bit_cast<std::uint64_t>(frame), ~std::uint64_t{0});
    key.value ^= static_cast<std::uint64_t>(mixed[0] * 0x1p32) << 32 | static_cast<std::uint64_t>(mixed[1] * 0x1p32);
    return key;
}

double kernel_random(RandomKey key, std::uint64_t id, double use, double frame)
{
    // The points of a pass share the key, and computing it takes as long as a random number.
    thread_local struct {
        std::uint64_t random = 0;
        double frame = 0;
        RandomKey key;
    } last;
    if (frame != 0) {
        if (last.random != key.value || last.frame != frame) last = {key.value, frame, key_in_frame(key, frame)};
        key = last.key;
    }
    return uniform53(key, id, std::bit_cast<std::uint64_t>(use + 0.0));
}

}  // namespace rapid
