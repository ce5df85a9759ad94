#include "runtime/operators/solve/aging.h"

#include <limits>

#include "runtime/base/parallel.h"
#include "runtime/points/buffer.h"
#include "runtime/points/members.h"

namespace rapid {
namespace {

// Returns the values of a chunk in contiguous memory: in the buffer if the column is uniform.
template <class T>
const T* contiguous(const Strided<T>& values, std::size_t begin, std::size_t end, T* buffer)
{
    if (values.stride != 0) return values.data + begin;
    std::fill_n(buffer, end - begin, *values.data);
    return buffer;
}

}  // namespace

std::size_t age_points(PointSet& points, const std::string& group, double frame_length,
                       const std::function<void(std::span<const std::uint8_t>)>& before_removal)
{
    auto* ages = points.find<float>("age");
    if (!ages || points.empty()) return 0;
    const Aging aging(frame_length);
    const float h = static_cast<float>(frame_length);
    const Column<float>* own = points.find<float>("dt");
    const Strided<float> dt = own ? own->read() : Strided<float>{&h, 0};
    const auto* lives = points.find<float>("life");
    const float immortal = std::numeric_limits<float>::infinity();
    const Strided<float> life = lives ? lives->read() : Strided<float>{&immortal, 0};
    const Strided<std::uint8_t> members = members_of(points, group);

    const Buffer marks(points.size());
    const std::span keep(static_cast<std::uint8_t*>(marks.data()), points.size());
    const std::span<float> age = ages->write();
    for_each_chunk(points.size(), [&, h](std::size_t begin, std::size_t end) {
        // Contiguous, so that the loops vectorise.
        float dt_buffer[chunk_size], life_buffer[chunk_size], whole[chunk_size];
        std::uint8_t member_buffer[chunk_size];
        const float* __restrict t = contiguous(dt, begin, end, dt_buffer);
        const float* __restrict last = contiguous(life, begin, end, life_buffer);
        const std::uint8_t* __restrict is_member = contiguous(members, begin, end, member_buffer);
        float* __restrict a = age.data() + begin;
        std::uint8_t* __restrict stays = keep.data() + begin;
        const std::size_t size = end - begin;
        for (std::size_t i = 0; i < size; ++i) whole[i] = aging.after_frame(a[i]);
        for (std::size_t i = 0; i < size; ++i) {
            const float part = a[i] + t[i], later = t[i] == h ? whole[i] : part;
            a[i] = is_member[i] ? later : a[i];
            stays[i] = a[i] < last[i];
        }
    });
    const std::size_t before = points.size();
    if (!lives) return 0;
    before_removal(keep);
    points.keep(keep);
    return before - points.size();
}

}  // namespace rapid
